//! Writes the lookup tables into `OUT_DIR`.

use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let directory = std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR for build scripts");
    let source = llsr_epi_tables::Tables::generate().to_source();
    std::fs::write(Path::new(&directory).join("tables.rs"), source).expect("OUT_DIR can be written");
}
