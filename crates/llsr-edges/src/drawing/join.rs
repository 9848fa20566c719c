//! Parts of edges joined into polylines.

use glam::DVec3;

use super::{Line, Part, Stroke};

/// One end of a part, named by what must agree for a joint: group, visibility and the exact place.
type Key = (u32, bool, [u64; 3]);

/// No partner.
const FREE: u32 = u32::MAX;

/// Joins parts of one group that end in one point, bit for bit, into polylines.
///
/// Visible and hidden parts are kept apart. Where more than two parts meet, those that continue each other most nearly
/// straight as `project` shows them (any plane picture of a point) are joined, and at most 60 degrees of turn count as
/// continuing. Each part is in one line; the order of the lines is that of their first parts.
/// Cost: O(n log n).
pub fn join(strokes: &[Stroke], parts: &[Part], project: impl Fn(DVec3) -> DVec3) -> Vec<Line> {
    let ends: Vec<[DVec3; 2]> = parts
        .iter()
        .map(|part| part.t.map(|t| strokes[part.stroke as usize].at(t)))
        .collect();
    let place = |end: u32| ends[end as usize / 2][end as usize % 2];
    let key = |end: u32| -> Key {
        let part = &parts[end as usize / 2];
        let group = strokes[part.stroke as usize].group;
        // Adding zero turns -0 into 0.
        let bits = (place(end) + DVec3::ZERO).to_array().map(f64::to_bits);
        (group, part.hidden, bits)
    };
    let mut sorted: Vec<(Key, u32)> = (0..2 * parts.len() as u32).map(|end| (key(end), end)).collect();
    sorted.sort_unstable();
    let mut partner = vec![FREE; 2 * parts.len()];
    let away = |end: u32| (project(place(end ^ 1)) - project(place(end))).normalize_or_zero();
    for meeting in sorted.chunk_by(|a, b| a.0 == b.0) {
        match *meeting {
            // A part whose ends coincide is no joint.
            [(_, a), (_, b)] if a ^ 1 == b => {}
            [(_, a), (_, b)] => (partner[a as usize], partner[b as usize]) = (b, a),
            [_, _, ..] => pair_straightest(meeting, away, &mut partner),
            _ => {}
        }
    }

    let mut lines = Vec::new();
    let mut used = vec![false; parts.len()];
    // Open lines from their free ends, then what is left: loops.
    for open in [true, false] {
        for first in 0..parts.len() as u32 {
            let free = [2 * first, 2 * first + 1]
                .into_iter()
                .find(|&end| partner[end as usize] == FREE);
            let start = match (open, free) {
                _ if used[first as usize] => continue,
                (true, Some(end)) => end,
                (true, None) => continue,
                (false, _) => 2 * first,
            };
            let part = &parts[first as usize];
            let mut points = vec![place(start)];
            let mut end = start;
            loop {
                used[end as usize / 2] = true;
                points.push(place(end ^ 1));
                end = partner[(end ^ 1) as usize];
                if end == FREE || end == start {
                    break;
                }
            }
            let closed = end == start;
            if closed {
                points.pop();
            }
            lines.push((
                first,
                Line {
                    group: strokes[part.stroke as usize].group,
                    hidden: part.hidden,
                    closed,
                    points,
                },
            ));
        }
    }
    lines.sort_by_key(|line| line.0);
    lines.into_iter().map(|line| line.1).collect()
}

/// Cosine of the largest turn at which one part continues another.
const CONTINUES: f64 = 0.5;
/// At a point where more parts meet than this none is joined: it is the hub of a fan, and comparing all pairs is quadratic.
const HUB: usize = 64;

fn pair_straightest(meeting: &[(Key, u32)], away: impl Fn(u32) -> DVec3, partner: &mut [u32]) {
    if meeting.len() > HUB {
        return;
    }
    let directions: Vec<(u32, DVec3)> = meeting.iter().map(|&(_, end)| (end, away(end))).collect();
    let mut pairs = Vec::new();
    for (i, &(a, u)) in directions.iter().enumerate() {
        for &(b, v) in &directions[i + 1..] {
            let straight = -u.dot(v);
            if straight >= CONTINUES && a ^ 1 != b {
                pairs.push((straight, a, b));
            }
        }
    }
    pairs.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for (_, a, b) in pairs {
        if partner[a as usize] == FREE && partner[b as usize] == FREE {
            (partner[a as usize], partner[b as usize]) = (b, a);
        }
    }
}
