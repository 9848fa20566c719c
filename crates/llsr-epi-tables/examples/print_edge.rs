//! Draws what the tables say of one edge: `cargo run -p llsr-epi-tables --example print_edge FIRST SECOND`.

use llsr_epi_tables::{Tables, code};

fn main() {
    let mut segments = std::env::args()
        .skip(1)
        .map(|arg| arg.parse::<usize>().ok().filter(|&s| s < 32));
    let (Some(Some(first)), Some(Some(second))) = (segments.next(), segments.next()) else {
        eprintln!("two boundary segments, 0..32: top 0-7, right 8-15, bottom 16-23, left 24-31");
        std::process::exit(2);
    };
    let tables = Tables::generate();
    let code = code(first, second);
    println!(
        "code {code:010b}, corners {:04b}, primary {}/512",
        tables.corners[code], tables.area[code]
    );
    for row in 0..4 {
        let regions: String = (0..4)
            .map(|column| match tables.side[code] >> (2 * (4 * row + column)) & 3 {
                1 => 'P',
                2 => 's',
                _ => '/',
            })
            .collect();
        println!("  {regions}");
    }
    const NAMES: [&str; 8] = ["N", "NE", "E", "SE", "S", "SW", "W", "NW"];
    let lenders: Vec<&str> = (0..5)
        .map(|i| NAMES[usize::from(tables.lenders[code] >> (3 * i) & 7)])
        .collect();
    println!("secondary colour from {}", lenders.join(", "));
}
