//! The lookup tables of the edge-and-point image: their sizes and their digest.

use std::path::Path;

use llsr_epi_tables::Tables;

/// The committed digest, from the root of the workspace.
const DIGEST: &str = "crates/llsr-epi/tables.digest";
/// BWG03 section 7.4.
const LIMIT: usize = 16 * 1024;

/// Prints the tables' sizes and renews the committed digest; with `--check` compares it instead.
pub(crate) fn run(args: &[String]) -> Result<(), String> {
    let check = match args {
        [] => false,
        [flag] if flag == "--check" => true,
        _ => return Err("usage: cargo xtask tables [--check]".into()),
    };
    let tables = Tables::generate();
    for (name, bytes) in tables.parts() {
        println!("{name:16} {:6} bytes", bytes.len());
    }
    println!("{:16} {:6} bytes of at most {LIMIT}", "all", tables.byte_len());
    if tables.byte_len() >= LIMIT {
        return Err(format!("the tables take {} bytes", tables.byte_len()));
    }
    let digest = format!("{:016x}", tables.digest());
    println!("{:16} {digest}", "digest");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(DIGEST);
    if check {
        let committed =
            std::fs::read_to_string(&path).map_err(|e| format!("{DIGEST} cannot be read: {e}"))?;
        if committed.trim() != digest {
            return Err(format!(
                "{DIGEST} holds {}; if the change is meant, run `cargo xtask tables`",
                committed.trim()
            ));
        }
        return Ok(());
    }
    std::fs::write(&path, format!("{digest}\n")).map_err(|e| format!("{DIGEST} cannot be written: {e}"))
}
