//! What stands in the rooms; nothing within a stride of the circle through the doorways.

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::super::pattern::hash;
use super::super::solid::{arc, ball, block, blocks, lathe, put, sweep, torus};
use super::paint::Paint;
use super::{INSIDE, add, at};
use crate::{MaterialId, Mesh, Scene};

pub(super) struct Furniture<'a> {
    pub(super) scene: &'a mut Scene,
    pub(super) paint: &'a Paint,
}

fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

impl Furniture<'_> {
    fn place(&mut self, name: &str, mesh: &Mesh, place: Affine3A) {
        let mut moved = Mesh::default();
        put(&mut moved, mesh, place);
        add(self.scene, name, moved);
    }

    /// Pictures on the outer walls, and four pieces on plinths.
    pub(super) fn gallery(&mut self) {
        let Paint {
            stone,
            bronze,
            glaze,
            pictures,
            ..
        } = *self.paint;
        self.picture(
            "picture hills",
            pictures[0],
            at(INSIDE, 1.6, 2.0, -90.0),
            1.3,
            1.0,
        );
        self.picture("picture bars", pictures[1], at(INSIDE, 1.6, 4.6, -90.0), 1.0, 1.0);
        self.picture(
            "picture rings",
            pictures[2],
            at(4.8, 1.6, INSIDE, 180.0),
            1.0,
            1.2,
        );
        self.picture("picture vase", pictures[3], at(1.9, 1.6, INSIDE, 180.0), 0.9, 1.2);
        let plinth = |height| block(v(-0.26, 0.0, -0.26), v(0.26, height, 0.26), stone);
        for (x, z, height) in [
            (5.7, 1.15, 0.8),
            (6.3, 6.3, 1.0),
            (1.2, 5.9, 0.9),
            (1.15, 1.15, 0.9),
        ] {
            self.place("plinth", &plinth(height), at(x, 0.0, z, 0.0));
        }
        // Two rings through each other.
        let ring = torus(0.25, 0.06, 32, 10, bronze);
        let mut rings = Mesh::default();
        put(&mut rings, &ring, Affine3A::from_rotation_x(1.25));
        let other = Affine3A::from_rotation_translation(
            Quat::from_rotation_y(1.2) * Quat::from_rotation_x(1.5),
            v(0.2, 0.0, 0.08),
        );
        put(&mut rings, &ring, other);
        self.place("rings", &rings, at(5.6, 1.1, 1.15, 20.0));
        self.place("vase", &vase(0.62, 22, glaze), at(6.3, 1.0, 6.3, 0.0));
        self.place("ball", &ball(0.24, 24, 12, stone), at(1.2, 1.14, 5.9, 0.0));
        self.spiral(at(1.15, 0.9, 1.15, 0.0));
    }

    /// A wire that climbs in narrowing turns.
    fn spiral(&mut self, place: Affine3A) {
        let steps = 43u16;
        let path: Vec<Vec3> = (0..=steps)
            .map(|i| {
                let share = f32::from(i) / f32::from(steps);
                let (angle, radius) = (3.5 * std::f32::consts::TAU * share, 0.22 * (1.0 - 0.7 * share));
                v(radius * angle.cos(), 0.025 + 0.6 * share, radius * angle.sin())
            })
            .collect();
        let wire = sweep(&path, |_| 0.025, 6, self.paint.bronze);
        self.place("spiral", &wire, place);
    }

    /// A framed canvas whose back is at `place`, facing its +z.
    fn picture(&mut self, name: &str, canvas: MaterialId, place: Affine3A, width: f32, height: f32) {
        let (x, y, rim) = (0.5 * width, 0.5 * height, 0.06);
        let planes = [
            &[-x - rim, -x, x, x + rim][..],
            &[-y - rim, -y, y, y + rim],
            &[0.0, 0.05],
        ];
        let frame = blocks(planes, |[i, j, _]| (i, j) != (1, 1), |_, _| self.paint.gilt);
        self.place("frame", &frame, place);
        let mut sheet = block(v(-x, -y, 0.0), v(x, y, 0.025), canvas);
        for (uv, position) in sheet.uvs.iter_mut().zip(&sheet.positions) {
            *uv = Vec2::new(position.x / width + 0.5, 0.5 - position.y / height);
        }
        self.place(name, &sheet, place);
    }

    /// A laid table with four chairs, and a sideboard.
    pub(super) fn dining_room(&mut self) {
        let Paint {
            wood,
            dark_wood,
            china,
            glaze,
            metal,
            bronze,
            ..
        } = *self.paint;
        let (x, z) = (5.6, -5.2);
        self.place("table", &table(v(1.5, 0.75, 1.5), 0.07, wood), at(x, 0.0, z, 0.0));
        let chair = chair(dark_wood);
        for (turn, dx, dz) in [
            (0.0, 0.05, -1.0),
            (90.0, -1.0, 0.1),
            (180.0, -0.1, 1.05),
            (270.0, 1.0, 0.0),
        ] {
            self.place("chair", &chair, at(x + dx, 0.0, z + dz, turn + 4.0));
        }
        let (plate, cup) = (plate(0.13, 18, china), cup(12, china));
        let place_setting = |turn: f32, radius: f32| {
            let d = Vec2::from_angle(turn.to_radians()) * radius;
            (x + d.x, z + d.y)
        };
        for turn in [0.0, 90.0, 180.0, 270.0] {
            let (px, pz) = place_setting(turn, 0.52);
            self.place("plate", &plate, at(px, 0.75, pz, 0.0));
            let (cx, cz) = place_setting(turn + 26.0, 0.50);
            self.place("cup", &cup, at(cx, 0.75, cz, 0.0));
        }
        self.place("bowl", &vase(0.2, 18, glaze), at(x, 0.75, z, 0.0));
        let case = block(v(-0.8, 0.1, -0.24), v(0.8, 0.9, 0.24), wood);
        self.place("sideboard", &case, at(1.9, 0.0, -INSIDE + 0.26, 0.0));
        self.place(
            "sideboard foot",
            &block(v(-0.72, 0.0, -0.2), v(0.72, 0.1, 0.2), dark_wood),
            at(1.9, 0.0, -INSIDE + 0.26, 0.0),
        );
        self.place("jar", &vase(0.42, 18, china), at(1.4, 0.9, -INSIDE + 0.26, 0.0));
        self.candlestick(at(2.4, 0.9, -INSIDE + 0.26, 0.0), bronze);
        self.coat_stand(at(0.75, 0.0, -0.75, 15.0), metal);
    }

    fn candlestick(&mut self, place: Affine3A, material: MaterialId) {
        let profile = [
            (0.0, 0.0),
            (0.09, 0.0),
            (0.09, 0.015),
            (0.03, 0.04),
            (0.016, 0.1),
            (0.03, 0.13),
            (0.016, 0.16),
            (0.016, 0.24),
            (0.05, 0.26),
            (0.05, 0.27),
            (0.018, 0.27),
            (0.018, 0.45),
            (0.0, 0.45),
        ]
        .map(|(r, y)| Vec2::new(r, y));
        self.place("candlestick", &lathe(&profile, 11, 50.0, material), place);
    }

    /// A post with four arms, for the corner of the walls.
    fn coat_stand(&mut self, place: Affine3A, material: MaterialId) {
        let mut stand = Mesh::default();
        let post = [
            (0.0, 0.0),
            (0.2, 0.0),
            (0.2, 0.02),
            (0.025, 0.06),
            (0.02, 1.75),
            (0.0, 1.8),
        ]
        .map(|(r, y)| Vec2::new(r, y));
        put(&mut stand, &lathe(&post, 16, 50.0, material), Affine3A::IDENTITY);
        for turn in [0.0, 90.0, 180.0, 270.0] {
            let hook: Vec<Vec3> = arc(Vec2::new(0.0, 1.55), 0.16, -80.0, 40.0, 4)
                .map(|p| v(p.x - 0.02, p.y, 0.0))
                .collect();
            put(
                &mut stand,
                &sweep(&hook, |_| 0.009, 6, material),
                at(0.0, 0.0, 0.0, turn),
            );
        }
        self.place("coat stand", &stand, place);
    }

    /// Two cases of books, a desk with a lamp and a globe.
    pub(super) fn library(&mut self) {
        let Paint {
            wood,
            dark_wood,
            bronze,
            glaze,
            ..
        } = *self.paint;
        self.shelf(at(-5.6, 0.0, -INSIDE + 0.16, 0.0), 0);
        self.shelf(at(-INSIDE + 0.16, 0.0, -5.2, 90.0), 60);
        let (x, z) = (-1.9, -6.1);
        self.place(
            "desk",
            &table(v(1.5, 0.74, 0.8), 0.06, dark_wood),
            at(x, 0.0, z, 0.0),
        );
        self.place("desk chair", &chair(wood), at(x, 0.0, z + 0.8, 188.0));
        self.place("globe", &ball(0.16, 20, 10, glaze), at(x - 0.5, 0.97, z, 0.0));
        let foot = lathe(
            &[(0.0, 0.0), (0.1, 0.0), (0.1, 0.015), (0.02, 0.03), (0.0, 0.08)].map(|(r, y)| Vec2::new(r, y)),
            16,
            50.0,
            bronze,
        );
        self.place("globe foot", &foot, at(x - 0.5, 0.74, z, 0.0));
        // A shaded lamp with a bent neck.
        let mut lamp = Mesh::default();
        put(&mut lamp, &foot, Affine3A::IDENTITY);
        let neck: Vec<Vec3> = [(0.0, 0.05), (0.0, 0.28), (0.05, 0.38), (0.14, 0.40)]
            .map(|(x, y)| v(x, y, 0.0))
            .to_vec();
        put(&mut lamp, &sweep(&neck, |_| 0.01, 8, bronze), Affine3A::IDENTITY);
        let shade = [
            (0.0, 0.0),
            (0.03, 0.0),
            (0.08, -0.1),
            (0.074, -0.1),
            (0.026, -0.006),
            (0.0, -0.006),
        ];
        let mut shade = shade.map(|(r, y)| Vec2::new(r, y));
        shade.reverse();
        put(
            &mut lamp,
            &lathe(&shade, 20, 50.0, bronze),
            Affine3A::from_translation(v(0.16, 0.41, 0.0)),
        );
        self.place("desk lamp", &lamp, at(x + 0.45, 0.74, z - 0.1, 200.0));
        for (i, turn) in [12.0f32, -8.0, 30.0].into_iter().enumerate() {
            let book = block(v(-0.1, 0.0, -0.14), v(0.1, 0.04, 0.14), self.paint.books[i]);
            self.place("lying book", &book, at(x + 0.05, 0.74 + 0.04 * i as f32, z, turn));
        }
    }

    /// A case of two by four compartments, its back at `place`, full of books.
    fn shelf(&mut self, place: Affine3A, seed: i32) {
        let wood = self.paint.dark_wood;
        let (depth, back) = (0.15, -0.15);
        let x = [-1.0, -0.97, -0.015, 0.015, 0.97, 1.0];
        let y = [0.0, 0.08, 0.11, 0.54, 0.57, 1.00, 1.03, 1.46, 1.49, 1.92, 1.96];
        let z = [back, back + 0.015, depth];
        // Uprights, boards and the back.
        let filled = |[i, j, k]: [usize; 3]| i % 2 == 0 || j % 2 == 1 || j == 0 || k == 0;
        self.place("bookcase", &blocks([&x, &y, &z], filled, |_, _| wood), place);
        let mut number = seed;
        for row in 0..4 {
            for column in 0..2 {
                let floor = y[2 + 2 * row];
                let (mut from, to) = (x[1 + 2 * column] + 0.01, x[2 + 2 * column] - 0.01);
                let mut books = Mesh::default();
                loop {
                    number += 1;
                    let (a, b, c) = (hash(number, 1), hash(number, 2), hash(number, 3));
                    let width = 0.06 + 0.05 * a;
                    if from + width > to {
                        break;
                    }
                    // Now and then a gap.
                    if c > 0.06 {
                        let color = self.paint.books[(hash(number, 4) * 6.0) as usize];
                        let top = floor + 0.22 + 0.14 * b;
                        let book = block(
                            v(from, floor, back + 0.02),
                            v(from + width - 0.002, top, back + 0.16 + 0.07 * c),
                            color,
                        );
                        put(&mut books, &book, Affine3A::IDENTITY);
                    }
                    from += width;
                }
                self.place("books", &books, place);
            }
        }
    }

    /// A sofa at a low table on a rug, a plant and a tall lamp.
    pub(super) fn lounge(&mut self) {
        let Paint {
            wood,
            cloth,
            cushion,
            rug,
            china,
            glaze,
            bronze,
            leaf,
            stone,
            ..
        } = *self.paint;
        let sofa = blocks(
            [
                &[-1.0, -0.8, 0.8, 1.0],
                &[0.06, 0.42, 0.62, 0.85],
                &[-0.42, -0.2, 0.42],
            ],
            |[i, j, k]| j == 0 || k == 0 || j == 1 && i != 1,
            |_, _| cloth,
        );
        self.place("sofa", &sofa, at(-5.2, 0.0, INSIDE - 0.5, 180.0));
        self.place("settee", &sofa, at(-INSIDE + 0.5, 0.0, 4.6, 90.0));
        let pillow = lathe(
            &arc(Vec2::ZERO, 1.0, -90.0, 90.0, 8)
                .map(|p| Vec2::new(0.2 * p.x, 0.08 * p.y))
                .collect::<Vec<_>>(),
            12,
            180.0,
            cushion,
        );
        for (x, y, z, turn) in [
            (-4.75, 0.62, 6.56, 0.0),
            (-5.75, 0.62, 6.56, 0.0),
            (-6.56, 0.62, 4.3, 90.0),
        ] {
            let tilt = Quat::from_rotation_y(f32::to_radians(turn)) * Quat::from_rotation_x(-1.25);
            self.place(
                "cushion",
                &pillow,
                Affine3A::from_rotation_translation(tilt, v(x, y, z)),
            );
        }
        let mut carpet = block(v(-1.2, 0.0, -1.2), v(1.2, 0.012, 1.2), rug);
        for uv in &mut carpet.uvs {
            *uv += Vec2::splat(1.2);
        }
        self.place("rug", &carpet, at(-5.1, 0.0, 4.9, 0.0));
        self.place(
            "low table",
            &table(v(0.9, 0.4, 0.6), 0.05, wood),
            at(-5.2, 0.012, 5.1, 0.0),
        );
        self.place("teapot", &vase(0.18, 18, glaze), at(-5.4, 0.412, 5.1, 0.0));
        for (x, z) in [(-5.1, 5.25), (-5.0, 4.95)] {
            self.place("tea cup", &cup(12, china), at(x, 0.412, z, 0.0));
        }
        self.lamp(at(-6.5, 0.0, 6.5, 0.0), bronze, china);
        self.plant(at(-1.0, 0.0, 1.0, 0.0), stone, leaf);
        self.place(
            "pedestal",
            &block(v(-0.2, 0.0, -0.2), v(0.2, 0.7, 0.2), stone),
            at(-1.2, 0.0, 6.5, 0.0),
        );
        self.place("urn", &vase(0.5, 18, glaze), at(-1.2, 0.7, 6.5, 0.0));
    }

    /// A standing lamp.
    fn lamp(&mut self, place: Affine3A, stand: MaterialId, shade: MaterialId) {
        let post = [
            (0.0, 0.0),
            (0.16, 0.0),
            (0.16, 0.02),
            (0.02, 0.05),
            (0.015, 1.45),
            (0.0, 1.46),
        ]
        .map(|(r, y)| Vec2::new(r, y));
        self.place("lamp post", &lathe(&post, 16, 50.0, stand), place);
        // An open cone of some thickness.
        let cone = [
            (0.24, 1.30),
            (0.12, 1.62),
            (0.112, 1.62),
            (0.232, 1.30),
            (0.24, 1.30),
        ]
        .map(|(r, y)| Vec2::new(r, y));
        self.place("lamp shade", &lathe(&cone, 24, 50.0, shade), place);
    }

    /// Bent leaves in a pot.
    fn plant(&mut self, place: Affine3A, pot: MaterialId, leaf: MaterialId) {
        let profile = [
            (0.0, 0.0),
            (0.14, 0.0),
            (0.2, 0.36),
            (0.175, 0.36),
            (0.165, 0.3),
            (0.0, 0.3),
        ]
        .map(|(r, y)| Vec2::new(r, y));
        self.place("pot", &lathe(&profile, 20, 40.0, pot), place);
        let mut leaves = Mesh::default();
        for i in 0..7 {
            let (reach, height) = (0.25 + 0.25 * hash(i, 21), 0.5 + 0.7 * hash(i, 22));
            let path: Vec<Vec3> = (0..=6u8)
                .map(|k| {
                    let s = f32::from(k) / 6.0;
                    v(0.03 + reach * s * s, 0.29 + height * s * (1.25 - 0.5 * s), 0.0)
                })
                .collect();
            let width = |k: usize| [0.008, 0.016, 0.024, 0.028, 0.024, 0.014, 0.002][k];
            let turn = at(0.0, 0.0, 0.0, 360.0 * 0.381_966 * i as f32);
            put(&mut leaves, &sweep(&path, width, 6, leaf), turn);
        }
        self.place("leaves", &leaves, place);
    }
}

/// A top of that size, `top` thick, on four legs.
fn table(size: Vec3, top: f32, material: MaterialId) -> Mesh {
    let (x, z) = (0.5 * size.x, 0.5 * size.z);
    let planes = [
        &[-x, -x + 0.06, x - 0.06, x][..],
        &[0.0, size.y - top, size.y],
        &[-z, -z + 0.06, z - 0.06, z],
    ];
    blocks(planes, |[i, j, k]| j == 1 || i != 1 && k != 1, |_, _| material)
}

/// A chair that looks along its +z.
fn chair(material: MaterialId) -> Mesh {
    let across = [-0.22, -0.185, -0.03, 0.03, 0.185, 0.22];
    let along = [-0.22, -0.185, 0.185, 0.22];
    let up = [0.0, 0.43, 0.47, 0.86, 0.96];
    let filled = |[i, j, k]: [usize; 3]| match j {
        0 => (i == 0 || i == 4) && k != 1,
        1 => true,
        2 => k == 0 && i % 2 == 0,
        _ => k == 0,
    };
    blocks([&across, &up, &along], filled, |_, _| material)
}

/// A hollow vase of that height with a round belly.
fn vase(height: f32, segments: u32, material: MaterialId) -> Mesh {
    let outside = |i: u8| {
        let s = f32::from(i) / 10.0;
        let belly = 0.22 + 0.16 * (5.2 * s + 0.2).sin() + 0.05 * s * s;
        Vec2::new(height * belly, height * s)
    };
    let mut profile = vec![Vec2::ZERO];
    profile.extend((0..=10).map(outside));
    let wall = 0.03 * height;
    profile.extend((2..=10).rev().step_by(2).map(|i| outside(i) - Vec2::X * wall));
    profile.push(Vec2::new(0.0, height / 5.0));
    lathe(&profile, segments, 40.0, material)
}

fn plate(radius: f32, segments: u32, material: MaterialId) -> Mesh {
    let profile = [
        (0.0, 0.0),
        (0.55, 0.0),
        (1.0, 0.14),
        (1.0, 0.17),
        (0.6, 0.06),
        (0.0, 0.05),
    ]
    .map(|(r, y)| radius * Vec2::new(r, y));
    lathe(&profile, segments, 50.0, material)
}

fn cup(segments: u32, material: MaterialId) -> Mesh {
    let profile = [
        (0.0, 0.0),
        (0.022, 0.0),
        (0.036, 0.03),
        (0.042, 0.075),
        (0.038, 0.075),
        (0.03, 0.03),
        (0.0, 0.01),
    ]
    .map(|(r, y)| Vec2::new(r, y));
    lathe(&profile, segments, 50.0, material)
}
