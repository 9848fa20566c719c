//! Which triples can matter at all.

use glam::{DVec3, Vec3};
use llsr_scene::{Bounds, ObjectId, Triple};

use super::light::ShadowLight;
use super::scene::ShadowScene;

/// Pieces into which a line is cut, so that the box of each is small even if the line runs askew.
const PIECES: u32 = 8;

impl ShadowScene {
    /// All triples whose boxes allow a shadow: some segment from the light to the receiver's box meets the blocker's.
    ///
    /// No shadow edge is missing, but some are emitted that nothing shows: an edge is clipped only against receivers of its
    /// own light and blocker (section 6.5 of Bala et al. 2003), and of those only what a blocker may shade is among them. An
    /// edge of a blocker that lies wholly in another's shadow stays, though no light comes past it. That is as in the paper and
    /// cheapest after moves. For drawings and other stills use
    /// [`all_triples_and_hiders`](Self::all_triples_and_hiders), which takes such edges away.
    ///
    /// An interactive renderer has its triples from the shader and needs neither. An object may shade itself. Cost: the
    /// square of the number of objects for each light.
    pub fn all_triples(&self) -> Vec<Triple> {
        self.triples_where(|light, blocker, receiver| any_hull_meets(light, receiver, blocker))
    }

    /// [`all_triples`](Self::all_triples), and those whose receiver may stand between light and blocker: the choice for
    /// still pictures.
    ///
    /// No shadow falls on these receivers, but they hide edges that the others would have: where something stands
    /// between the light and the blocker's edge, that edge casts no shadow. The edges are those of `all_triples` less what is
    /// hidden so. The price is time, and that more has to be computed again when such an object moves.
    pub fn all_triples_and_hiders(&self) -> Vec<Triple> {
        self.triples_where(|light, blocker, receiver| {
            any_hull_meets(light, receiver, blocker) || any_hull_meets(light, blocker, receiver)
        })
    }

    fn triples_where(&self, may: impl Fn(&[Bounds], Bounds, Bounds) -> bool) -> Vec<Triple> {
        let bounds: Vec<(ObjectId, Bounds)> = self
            .objects()
            .filter_map(|id| Some((id, self.object(id)?.bounds())))
            .collect();
        let mut triples = Vec::new();
        for light in self.lights() {
            let Some(boxes) = self.light(light).map(light_boxes) else {
                continue;
            };
            for &(blocker, b) in &bounds {
                for &(receiver, r) in &bounds {
                    if blocker == receiver || may(&boxes, b, r) {
                        triples.push(Triple {
                            light,
                            blocker,
                            receiver,
                        });
                    }
                }
            }
        }
        triples
    }
}

fn any_hull_meets(light: &[Bounds], to: Bounds, between: Bounds) -> bool {
    light.iter().any(|&light| hull_meets(light, to, between))
}

fn light_boxes(light: &ShadowLight) -> Vec<Bounds> {
    let around = |a: DVec3, b: DVec3| {
        let (low, high) = (a.min(b), a.max(b));
        let outwards = |p: DVec3, up: bool| {
            Vec3::from_array(p.to_array().map(|x| {
                let near = x as f32;
                if up { near.next_up() } else { near.next_down() }
            }))
        };
        Bounds {
            min: outwards(low, false),
            max: outwards(high, true),
        }
    };
    match *light.corners() {
        [] => Vec::new(),
        [p] => vec![around(p, p)],
        [a, b] => {
            let at = |i: u32| a + (b - a) * (f64::from(i) / f64::from(PIECES));
            (0..PIECES).map(|i| around(at(i), at(i + 1))).collect()
        }
        [first, ..] => {
            let (low, high) = light
                .corners()
                .iter()
                .fold((first, first), |(low, high), &p| (low.min(p), high.max(p)));
            vec![around(low, high)]
        }
    }
}

/// Does the convex hull of the boxes `from` and `to` meet the box `between`?
///
/// The hull is swept by the boxes (1 - t) from + t to; on each axis, that such a box overlaps `between` is two linear
/// conditions on t.
fn hull_meets(from: Bounds, to: Bounds, between: Bounds) -> bool {
    if from.is_empty() || to.is_empty() || between.is_empty() {
        return false;
    }
    // Room for rounding.
    let pad = 1e-6
        * (from.union(to).union(between).diagonal() + between.max.abs().max(between.min.abs()).max_element());
    let (mut low, mut high) = (0.0f64, 1.0f64);
    // Keeps t where a + (b - a) t <= 0.
    let mut keep = |a: f64, b: f64| {
        if a <= 0.0 && b <= 0.0 {
            return;
        }
        if a > 0.0 && b > 0.0 {
            high = -1.0;
            return;
        }
        let zero = a / (a - b);
        if a > 0.0 {
            low = low.max(zero);
        } else {
            high = high.min(zero);
        }
    };
    for axis in 0..3 {
        let [f, t, b] =
            [from, to, between].map(|bounds| (f64::from(bounds.min[axis]), f64::from(bounds.max[axis])));
        let pad = f64::from(pad);
        keep(f.0 - b.1 - pad, t.0 - b.1 - pad);
        keep(b.0 - f.1 - pad, b.0 - t.1 - pad);
    }
    low <= high
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(at: Vec3, half: f32) -> Bounds {
        Bounds {
            min: at - half,
            max: at + half,
        }
    }

    #[test]
    fn a_box_between_two_others_is_met() {
        let light = cube(Vec3::new(0.0, 5.0, 0.0), 0.1);
        let floor = Bounds {
            min: Vec3::new(-3.0, 0.0, -3.0),
            max: Vec3::new(3.0, 0.0, 3.0),
        };
        assert!(
            hull_meets(light, floor, cube(Vec3::new(1.0, 1.0, 1.0), 0.5)),
            "above the floor"
        );
        assert!(
            !hull_meets(light, floor, cube(Vec3::new(0.0, 7.0, 0.0), 0.5)),
            "above the light"
        );
        assert!(
            !hull_meets(light, floor, cube(Vec3::new(3.0, 4.0, 0.0), 0.5)),
            "beside"
        );
        assert!(
            !hull_meets(light, floor, cube(Vec3::new(0.0, -1.0, 0.0), 0.5)),
            "below"
        );
        assert!(!hull_meets(light, floor, Bounds::EMPTY), "nothing");
    }

    #[test]
    fn no_segment_between_the_boxes_is_forgotten() {
        // Random segments that cross the box in the middle have their boxes admitted.
        let mut state = 1u64;
        let mut unit = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut point = |size: f32| Vec3::new(unit(), unit(), unit()) * (2.0 * size) - size;
        for _ in 0..2000 {
            let (a, b) = (point(5.0), point(5.0));
            let t = 0.5 + 0.08 * point(1.0).x;
            let around = |p: Vec3, q: Vec3| Bounds {
                min: p.min(p + q),
                max: p.max(p + q),
            };
            let (from, to) = (around(a, point(1.0)), around(b, point(1.0)));
            let between = around(a + (b - a) * t, point(0.2));
            assert!(hull_meets(from, to, between), "{a} to {b}");
        }
    }
}
