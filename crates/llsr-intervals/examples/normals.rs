//! Which of a sphere's bands of latitude can hold a silhouette edge, seen from above?

use llsr_intervals::{Interval, IntervalVec3};

fn main() {
    let view = IntervalVec3::point(0.2f32, 3.0, 0.1);
    for band in 0..9 {
        let angles = [band, band + 1].map(|k| (k as f32 * 20.0 - 90.0).to_radians());
        let around = angles[0].cos().max(angles[1].cos());
        let sideways = Interval::of([-around, around]);
        let up = Interval::of(angles.map(f32::sin));
        let normals = IntervalVec3::new(sideways, up, sideways);
        // The sphere has radius 1, so its points are its normals.
        let facing = normals.dot(&(view - normals));
        let verdict = if facing.certainly_positive() {
            "faces the viewer"
        } else if facing.certainly_negative() {
            "faces away"
        } else {
            "may hold silhouette edges"
        };
        println!("latitude {:4} to {:4}: {verdict}", band * 20 - 90, band * 20 - 70);
    }
}
