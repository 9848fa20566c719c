//! Changes of visibility by asking everywhere.

use llsr_visibility::Visibility;

/// Asks at `cells` + 1 equally spaced points and returns the cell of each change, as (from, to, visible at to).
///
/// Finds everything that is wider than 1 / `cells`.
pub fn brute_force<V: Visibility + ?Sized>(oracle: &mut V, cells: u32) -> Vec<(f64, f64, bool)> {
    let place = |i: u32| f64::from(i) / f64::from(cells);
    let mut found = Vec::new();
    let mut before = oracle.visible(0.0);
    for i in 1..=cells {
        let now = oracle.visible(place(i));
        if now != before {
            found.push((place(i - 1), place(i), now));
        }
        before = now;
    }
    found
}
