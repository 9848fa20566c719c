//! Blockers given as pairs on the command line, the visible panels printed: `partition 0.1 0.3 0.25 0.5`.

use llsr_visibility::{Panel, Partition};

fn main() -> Result<(), std::num::ParseFloatError> {
    let mut ends = std::env::args()
        .skip(1)
        .map(|arg| arg.parse::<f64>())
        .collect::<Result<Vec<_>, _>>()?;
    if ends.is_empty() {
        ends = vec![0.1, 0.3, 0.25, 0.5, 0.9, 1.4];
    }
    let mut blocked = Partition::dark();
    for pair in ends.chunks_exact(2) {
        blocked.insert(Panel::exact(pair[0], pair[1]));
    }
    let mut visible = Partition::dark();
    blocked.complement_into(&mut visible);
    for panel in visible.panels() {
        println!("visible from {} to {}", panel.start, panel.end);
    }
    println!(
        "visible share {}, {} changes",
        visible.measure(),
        visible.discontinuities()
    );
    Ok(())
}
