//! Triangles with texture coordinates, and how a pixel's place becomes a place in the texture.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{DMat3, DMat4, DVec3, DVec4, Mat3, Vec2, Vec3};
use llsr_scene::{Bounds, Mesh, Wrap};

use crate::frame::texture::pyramid::{BLOCK, Footprint, Places};

/// Farther from the place where a run begins, in repeats of the texture, nothing is looked up: floats would not tell texels apart.
const MOST_REPEATS: f32 = 1e6;
/// Faces whose textures differ by less than about this many texels anywhere in the box of their mesh are one.
const ALIKE: f64 = 0.1;
/// A face without a texture.
const PLAIN: u32 = u32::MAX;

/// A triangle: a corner and two sides in the object's frame, and the same in the texture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    corner: [f32; 3],
    sides: [[f32; 3]; 2],
    uv: [f32; 2],
    uv_sides: [[f32; 2]; 2],
    /// Which texture.
    pub(crate) paint: u32,
}

/// Texture coordinates as seen: with (x, y) in pixels, u = (u . (x, y, 1)) / (s . (x, y, 1)), v alike. The divisor is one over the
/// depth where the face lies before the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    u: DVec3,
    v: DVec3,
    s: DVec3,
    pub(crate) paint: u32,
}

/// The same along a row of pixels, u and v moved by whole repeats so that they are small where the texture repeats.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// u, v and divisor at the first pixel.
    start: [f32; 3],
    right: [f32; 3],
    down: [f32; 3],
}

/// What the triangles of a mesh say about textures.
#[derive(Clone, Debug)]
pub(crate) struct Faces {
    /// Triangles in one plane with one continuous texture share a face, the largest of them.
    faces: Vec<Face>,
    /// For each triangle its face.
    of_triangle: Vec<u32>,
}

impl Faces {
    /// Those of a mesh, if one of its materials has a texture; for each material `paints` says which, the transform of its
    /// coordinates and its size in texels.
    pub(crate) fn new(mesh: &Mesh, paints: &[Option<(u32, Mat3, Vec2)>]) -> Option<Self> {
        if mesh.uvs.is_empty() || !mesh.materials.iter().any(|m| paints[m.index()].is_some()) {
            return None;
        }
        let plain = Face {
            corner: [0.0; 3],
            sides: [[0.0; 3]; 2],
            uv: [0.0; 2],
            uv_sides: [[0.0; 2]; 2],
            paint: PLAIN,
        };
        let bounds = Bounds::of(mesh.positions.iter().copied());
        let mut known: HashMap<Key, (u32, f32)> = HashMap::new();
        let mut all = Self {
            faces: vec![plain],
            of_triangle: Vec::with_capacity(mesh.triangles.len()),
        };
        for (triangle, material) in mesh.triangles.iter().zip(&mesh.materials) {
            let Some((paint, transform, texels)) = paints[material.index()] else {
                all.of_triangle.push(0);
                continue;
            };
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let [ta, tb, tc] = triangle.map(|vertex| transform.transform_point2(mesh.uvs[vertex as usize]));
            let face = Face {
                corner: a.into(),
                sides: [(b - a).into(), (c - a).into()],
                uv: ta.into(),
                uv_sides: [(tb - ta).into(), (tc - ta).into()],
                paint,
            };
            let size = (b - a).cross(c - a).length_squared();
            let next = all.faces.len() as u32;
            let number = match face.key(&bounds, texels).map(|key| known.entry(key)) {
                None => {
                    all.faces.push(face);
                    next
                }
                Some(Entry::Vacant(entry)) => {
                    entry.insert((next, size));
                    all.faces.push(face);
                    next
                }
                Some(Entry::Occupied(mut entry)) => {
                    let (number, largest) = entry.get_mut();
                    if size > *largest {
                        *largest = size;
                        all.faces[*number as usize] = face;
                    }
                    *number
                }
            };
            all.of_triangle.push(number);
        }
        Some(all)
    }

    /// The number of faces, one that stands for none among them.
    pub(crate) fn len(&self) -> usize {
        self.faces.len()
    }

    /// The face of a triangle; `None` if it has no texture, or there is no such triangle.
    pub(crate) fn of_triangle(&self, triangle: u32) -> Option<u32> {
        let face = *self.of_triangle.get(triangle as usize)?;
        (face != 0).then_some(face)
    }

    pub(crate) fn face(&self, number: u32) -> &Face {
        &self.faces[number as usize]
    }
}

/// Plane and texture of a face, rounded.
#[derive(PartialEq, Eq, Hash)]
struct Key {
    paint: u32,
    plane: [i64; 4],
    /// Texture coordinates at the feet of three places on the plane.
    places: [[i64; 2]; 3],
}

impl Face {
    /// What faces have in common that show one texture on one plane; `None` for those without area.
    fn key(&self, bounds: &Bounds, texels: Vec2) -> Option<Key> {
        let vector = |p: [f32; 3]| Vec3::from(p).as_dvec3();
        let (corner, [one, two]) = (vector(self.corner), self.sides.map(vector));
        let normal = one.cross(two).try_normalize()?;
        let size = f64::from(bounds.diagonal()).max(f64::MIN_POSITIVE);
        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let basis = DMat3::from_cols(one, two, normal).inverse();
        let places = [low, high, DVec3::new(low.x, high.y, low.z)].map(|place| {
            let at = basis * (place - corner);
            [0, 1].map(|i| {
                let uv = f64::from(self.uv[i])
                    + at.x * f64::from(self.uv_sides[0][i])
                    + at.y * f64::from(self.uv_sides[1][i]);
                (uv * f64::from(texels[i]) / ALIKE).round() as i64
            })
        });
        let round = |value: f64| (value * 1e4).round() as i64;
        let distance = normal.dot(corner) / size;
        basis.is_finite().then_some(Key {
            paint: self.paint,
            plane: [round(normal.x), round(normal.y), round(normal.z), round(distance)],
            places,
        })
    }

    /// The face as it is seen under a matrix from its object's frame to (column, row, depth) in pixels, homogeneous, without the third
    /// row of clip space; `None` if it is seen from its edge.
    pub(crate) fn view(&self, matrix: &DMat4) -> Option<View> {
        let place = |p: [f32; 3], w: f64| {
            let p = p.map(f64::from);
            let clip = *matrix * DVec4::new(p[0], p[1], p[2], w);
            DVec3::new(clip.x, clip.y, clip.w)
        };
        let [first, second] = self.sides;
        let columns = DMat3::from_cols(place(first, 0.0), place(second, 0.0), place(self.corner, 1.0));
        let inverse = columns.inverse();
        if !inverse.is_finite() {
            return None;
        }
        // Barycentrics, times one over the depth, are linear in the picture.
        let (one, two, rest) = (inverse.row(0), inverse.row(1), inverse.row(2));
        let along = |i: usize| {
            rest * f64::from(self.uv[i])
                + one * f64::from(self.uv_sides[0][i])
                + two * f64::from(self.uv_sides[1][i])
        };
        Some(View {
            u: along(0),
            v: along(1),
            s: rest,
            paint: self.paint,
        })
    }
}

impl View {
    /// From the centre of pixel (x, y) on.
    pub(crate) fn run(&self, x: usize, y: usize, wrap: [Wrap; 2]) -> Run {
        let centre = DVec3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0);
        let s = self.s.dot(centre);
        let small = |row: DVec3, wrap: Wrap| {
            if wrap == Wrap::Clamp {
                return row;
            }
            // An even number of repeats, which mirrored textures need.
            let repeats = 2.0 * (0.5 * row.dot(centre) / s).floor();
            if repeats.is_finite() {
                row - self.s * repeats
            } else {
                row
            }
        };
        let rows = [small(self.u, wrap[0]), small(self.v, wrap[1]), self.s];
        let [u, v, s] = rows;
        Run {
            start: [u.dot(centre) as f32, v.dot(centre) as f32, s.dot(centre) as f32],
            right: [u.x as f32, v.x as f32, s.x as f32],
            down: [u.y as f32, v.y as f32, s.y as f32],
        }
    }
}

impl Run {
    /// Texture coordinates of a block of pixels from the i-th on, and 1 for those whose rays meet the plane of the face before the eye,
    /// 0 for others.
    #[inline(always)]
    pub(crate) fn places(&self, i: usize) -> (Places, [f32; BLOCK]) {
        let mut places = Places {
            u: [0.0; BLOCK],
            v: [0.0; BLOCK],
        };
        let mut met = [0.0; BLOCK];
        for (k, met) in met.iter_mut().enumerate() {
            let at = (i + k) as f32;
            let s = self.start[2] + at * self.right[2];
            let inverse = 1.0 / s;
            let u = (self.start[0] + at * self.right[0]) * inverse;
            let v = (self.start[1] + at * self.right[1]) * inverse;
            let good = s > 0.0 && u.abs() < MOST_REPEATS && v.abs() < MOST_REPEATS;
            places.u[k] = if good { u } else { 0.0 };
            places.v[k] = if good { v } else { 0.0 };
            *met = if good { 1.0 } else { 0.0 };
        }
        (places, met)
    }

    /// What the i-th pixel covers.
    #[inline(always)]
    pub(crate) fn footprint(&self, i: usize) -> Footprint {
        let at = i as f32;
        let inverse = 1.0 / (self.start[2] + at * self.right[2]);
        let u = (self.start[0] + at * self.right[0]) * inverse;
        let v = (self.start[1] + at * self.right[1]) * inverse;
        let (right, down) = (self.right, self.down);
        Footprint {
            right: [
                (right[0] - u * right[2]) * inverse,
                (right[1] - v * right[2]) * inverse,
            ],
            down: [
                (down[0] - u * down[2]) * inverse,
                (down[1] - v * down[2]) * inverse,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Affine3A;
    use llsr_scene::{Camera, FieldOfView, MaterialId, Viewport};

    use super::*;
    use crate::frame::texture::to_pixels;

    /// A strip of four triangles in one plane, and one turned out of it; coordinates go on over the first three.
    fn strip() -> Mesh {
        let mut mesh = Mesh::new(
            "strip",
            vec![
                Vec3::new(0.0, 0.0, 0.0),
                Vec3::new(0.0, 1.0, 0.0),
                Vec3::new(1.0, 0.0, 0.0),
                Vec3::new(1.0, 1.0, 0.0),
                Vec3::new(3.0, 0.0, 0.0),
                Vec3::new(3.0, 1.0, 0.0),
                Vec3::new(3.5, 0.0, 1.0),
            ],
            vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5], [4, 6, 5]],
            MaterialId(0),
        );
        mesh.uvs = mesh
            .positions
            .iter()
            .map(|p| Vec2::new(0.5 * p.x + p.z, p.y))
            .collect();
        mesh.uvs[5] = Vec2::new(0.9, 0.9);
        mesh
    }

    #[test]
    fn triangles_share_a_face_where_the_texture_goes_on() {
        let paints = [Some((0, Mat3::IDENTITY, Vec2::splat(64.0)))];
        let faces = Faces::new(&strip(), &paints).expect("textured");
        let of = |triangle| faces.of_triangle(triangle).expect("a face");
        assert_eq!([of(0), of(0)], [of(1), of(2)], "one plane, one texture");
        assert_ne!(of(3), of(0), "its coordinates go elsewhere");
        assert_ne!(of(4), of(3), "another plane");
        assert_eq!(faces.of_triangle(5), None, "there is none");
        assert_eq!(faces.len(), 4, "three and none");
        assert!(Faces::new(&strip(), &[None]).is_none(), "nothing is textured");
    }

    /// A pixel's ray met with the plane in other words: by the camera's rays and barycentrics.
    #[test]
    fn pixels_see_what_their_rays_meet() {
        let mesh = strip();
        let paints = [Some((0, Mat3::IDENTITY, Vec2::splat(64.0)))];
        let faces = Faces::new(&mesh, &paints).expect("textured");
        let viewport = Viewport {
            width: 90,
            height: 60,
        };
        let eye = DVec3::new(0.4, 2.0, 3.0);
        let camera = Camera::look_at(
            "eye",
            eye,
            DVec3::new(1.0, 0.5, 0.0),
            DVec3::Y,
            FieldOfView::vertical_degrees(50.0),
        );
        let transform = Affine3A::from_rotation_y(0.3) * Affine3A::from_scale(Vec3::new(1.0, 1.2, 1.0));
        let matrix = to_pixels(&camera.view_projection(viewport, 1e-3), viewport)
            * glam::Mat4::from(transform).as_dmat4();
        let view = faces
            .face(faces.of_triangle(0).expect("a face"))
            .view(&matrix)
            .expect("not from its edge");
        let place = |p: Vec3| transform.transform_point3(p).as_dvec3();
        let [a, b, c] = [0, 2, 1].map(|i: usize| place(mesh.positions[i]));
        let basis = DMat3::from_cols(b - a, c - a, (b - a).cross(c - a)).inverse();
        let mut met = 0;
        for y in (0..60).step_by(7) {
            let run = view.run(20, y, [Wrap::Repeat, Wrap::Clamp]);
            let (places, good) = run.places(0);
            for (k, good) in good.into_iter().enumerate() {
                let (origin, direction) = camera.ray(viewport, (20 + k) as f64 + 0.5, y as f64 + 0.5);
                let normal = (b - a).cross(c - a);
                let t = normal.dot(a - origin) / normal.dot(direction);
                assert_eq!(good > 0.0, t > 0.0, "({k}, {y})");
                if t > 0.0 {
                    met += 1;
                    let at = basis * (origin + direction * t - a);
                    let expected = [0.5 * at.x, at.y];
                    let found = [f64::from(places.u[k]), f64::from(places.v[k])];
                    for (found, expected) in found.into_iter().zip(expected) {
                        // Whole repeats, an even number of them, may be missing.
                        let off = (found - expected) / 2.0;
                        assert!(
                            (off - off.round()).abs() < 1e-4,
                            "({k}, {y}): {found} for {expected}"
                        );
                    }
                }
            }
        }
        assert!(met > 100, "{met}");
    }
}
