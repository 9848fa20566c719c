//! EV events: where the fan of a light's side sweeps across a vertex of the blocker.
//!
//! Appendix A of Bala et al. (2003) walks along the silhouette from edge to edge and compares angles. Here each vertex
//! is decided by itself, for meshes of any kind. Let the plane hold the side and the vertex. Seen from a point of the
//! side, the faces around the vertex cover sectors of the directions around it, and moving the receiver across the
//! plane moves the side's image from just above the vertex to just below it. What is seen of the side around there
//! changes its kind only if
//!
//! - no sector reaches into one half and some into the other: the first bit is hidden (penumbral);
//! - the sectors cover all of one half but not of the other: the last bit is hidden (umbral).
//!
//! In all other cases a visible and a hidden piece are on both sides of the plane. The paper's convex and concave
//! cases are those in which the sectors are one connected range. For a line, every change between all and part of it
//! is of one of these kinds or a VE event: the first hidden bit is at an end, or it lies where the fan's inside first
//! touches a vertex. A change between part and none can also be a gap between two edges that closes (EEE).

use glam::DVec3;
use llsr_intervals::{OrientedPlane, orientation};
use std::cmp::Ordering;

use super::events::Kinds;
use super::mesh::{ShadowMesh, Star};

/// The measure of 180 degrees in [`is_covered`].
const STRAIGHT: f64 = 2.0;

/// A face around the vertex: its other two corners and their sides of the plane.
#[derive(Clone, Copy, Debug)]
struct Sector {
    arms: [DVec3; 2],
    /// Above the plane?
    above: [bool; 2],
}

/// Working memory of the test of a vertex.
#[derive(Clone, Debug, Default)]
pub(super) struct CornerScratch {
    sectors: Vec<Sector>,
    cuts: Vec<f64>,
    covered: Vec<[f64; 2]>,
}

/// Gives to `found` the parts of the side `ends`, as parameters in [0, 1], for which the wedge behind `vertex` is an
/// event.
///
/// `inner` is a point of a polygonal light beyond that side; a line has none.
pub(super) fn corner_events(
    mesh: &ShadowMesh,
    vertex: u32,
    ends: [DVec3; 2],
    inner: Option<DVec3>,
    scratch: &mut CornerScratch,
    mut found: impl FnMut(Kinds, [f64; 2]),
) {
    let at = mesh.position(vertex);
    let [p, q] = ends;
    let normal = (p - at).cross(q - at);
    let lengths = (p - at).length_squared() * (q - at).length_squared();
    if normal.length_squared() <= 1e-24 * lengths {
        // Seen end-on, the side has no plane.
        return;
    }
    let inner = match inner.map(|x| orientation(p, q, at, x)) {
        Some(Ordering::Equal) => return,
        side => side.map(|side| side == Ordering::Greater),
    };
    // A corner in the plane counts as above if its number is larger: as if all corners were moved a little, so that
    // of an edge in the plane one end alone is first.
    let plane = OrientedPlane::new([p, q, at]);
    let is_above = |v: u32| match plane.side(mesh.position(v)) {
        Ordering::Greater => true,
        Ordering::Less => false,
        Ordering::Equal => v > vertex,
    };
    let sectors = &mut scratch.sectors;
    sectors.clear();
    let mut push = |arms: [u32; 2], above: [bool; 2]| {
        let arms = arms.map(|v| mesh.position(v) - at);
        sectors.push(Sector { arms, above });
    };
    let (any_above, any_below, crossings, closes);
    match mesh.star(vertex) {
        Star::Ring(ring) => {
            let above = (0..)
                .zip(ring)
                .fold(0u64, |bits, (i, &v)| bits | u64::from(is_above(v)) << i);
            let all = u64::MAX >> (64 - ring.len());
            any_above = above != 0;
            any_below = above != all;
            let next = above >> 1 | (above & 1) << (ring.len() - 1);
            crossings = (above ^ next).count_ones();
            closes = true;
            if crossings > 2 {
                for i in 0..ring.len() {
                    let k = (i + 1) % ring.len();
                    push([ring[i], ring[k]], [above >> i & 1 == 1, above >> k & 1 == 1]);
                }
            }
        }
        Star::Faces(faces) => {
            let (mut some_above, mut some_below, mut count) = (false, false, 0);
            for &face in faces {
                let corners = mesh.edges().faces()[face as usize];
                let Some(place) = corners.iter().position(|&v| v == vertex) else {
                    continue;
                };
                let arms = [corners[(place + 1) % 3], corners[(place + 2) % 3]];
                let above = arms.map(is_above);
                some_above |= above[0] | above[1];
                some_below |= !(above[0] & above[1]);
                count += u32::from(above[0] != above[1]);
                push(arms, above);
            }
            (any_above, any_below, crossings) = (some_above, some_below, count);
            closes = mesh.edges().is_closed();
        }
    }
    if any_above != any_below {
        // From a polygon on the same side, the vertex hides nothing but what its own faces hide already.
        if inner != Some(any_above) {
            found(Kinds::PENUMBRAL, [0.0, 1.0]);
        }
        return;
    }
    // To cover a half, sectors have to cross the plane at both ends of it. In a ring of faces that crosses it twice,
    // at different ends, both halves are covered.
    if crossings < 2 || crossings == 2 && closes {
        return;
    }
    // A face's sector changes its end of the half where the side cuts the face's plane.
    scratch.cuts.clear();
    for sector in scratch.sectors.iter().filter(|s| s.above[0] != s.above[1]) {
        let face = sector.arms[0].cross(sector.arms[1]);
        let (from, to) = (face.dot(p - at), face.dot(q - at));
        let t = from / (from - to);
        if t > 0.0 && t < 1.0 {
            scratch.cuts.push(t);
        }
    }
    scratch.cuts.push(1.0);
    scratch.cuts.sort_unstable_by(f64::total_cmp);
    let mut start = 0.0;
    let mut open: Option<f64> = None;
    for i in 0..scratch.cuts.len() {
        let end = scratch.cuts[i];
        let from = p + (q - p) * (0.5 * (start + end));
        let [above, below] = [true, false]
            .map(|half| is_covered(&scratch.sectors, half, normal, from - at, &mut scratch.covered));
        let is_event = end > start
            && match inner {
                None => above != below,
                Some(true) => above && !below,
                Some(false) => below && !above,
            };
        if is_event && open.is_none() {
            open = Some(start);
        }
        if !is_event && let Some(begin) = open.take() {
            found(Kinds::UMBRAL, [begin, start]);
        }
        start = end;
    }
    if let Some(begin) = open {
        found(Kinds::UMBRAL, [begin, start]);
    }
}

/// Do the sectors cover all directions above (or below) the plane, seen along `view`?
fn is_covered(
    sectors: &[Sector],
    half: bool,
    normal: DVec3,
    view: DVec3,
    covered: &mut Vec<[f64; 2]>,
) -> bool {
    let across = normal.cross(view);
    let (up, right) = (normal.normalize(), across.normalize());
    // Height above the plane, towards the half; corners that count as above may lie in it.
    let height = |arm: DVec3, above: bool| {
        let height = up.dot(arm);
        if above { height.max(0.0) } else { height.min(0.0) }
    };
    covered.clear();
    for &Sector { arms, above } in sectors {
        if above[0] != half && above[1] != half {
            continue;
        }
        let heights = [0, 1].map(|i| height(arms[i], above[i]));
        let sides = arms.map(|arm| right.dot(arm));
        // Grows with the angle from 0 to 2 * 90 degrees as that does, at less cost.
        let angle = |i: usize| {
            let height = heights[i].abs();
            1.0 - sides[i] / (sides[i].abs() + height)
        };
        covered.push(if above[0] == above[1] {
            let (a, b) = (angle(0), angle(1));
            [a.min(b), a.max(b)]
        } else {
            let inside = usize::from(above[1] == half);
            let crossing = sides[0] * heights[1].abs() + sides[1] * heights[0].abs();
            if crossing > 0.0 {
                [0.0, angle(inside)]
            } else {
                [angle(inside), STRAIGHT]
            }
        });
    }
    covered.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut reached = 0.0;
    for &[from, to] in covered.iter() {
        if from > reached {
            return false;
        }
        reached = to.max(reached);
    }
    reached >= STRAIGHT
}
