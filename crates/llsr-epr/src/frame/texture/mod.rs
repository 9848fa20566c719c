//! Textures at full sharpness over interpolated light.
//!
//! Points on textures carry the light as the texture's typical colour would reflect it, and the triangle on which they lie. A pixel
//! takes the triangle of the nearest point that it reaches, and looks the texture up where its own ray meets the plane of it.
//! So no point is needed for what the texture does between points. BWG03 interpolates finished colours.

mod cells;
mod face;
mod level;
mod pyramid;

use glam::{Affine3A, DMat4, DVec4, Mat4, Vec2, Vec3};
use llsr_epi::{ColourRow, DonorRow, EdgePointImage, Picture, SampleValues};
use llsr_render_cache::PointImage;
use llsr_scene::{Geometry, ObjectId, Scene, Viewport};

use crate::frame::share::share;
use cells::Cells;
use face::{Faces, View};
use level::Level;
use pyramid::{BLOCK, Between, Pyramid, Sampling};

/// Pixels of a row that are looked up with one footprint, a multiple of a block.
const ALIKE: usize = 64;
/// Projected faces that are remembered while a band is drawn.
const REMEMBERED: usize = 256;

/// The textures of a scene and the triangles they lie on.
#[derive(Debug, Default)]
pub(crate) struct Textures {
    paints: Vec<Paint>,
    /// Of each mesh with textures.
    meshes: Vec<Faces>,
    /// In the order of their numbers.
    objects: Vec<Object>,
    /// For each object of the scene its position in `objects`.
    position: Vec<Option<u32>>,
}

/// Working memory, and what the last picture leaves.
#[derive(Debug, Default)]
pub(crate) struct TextureScratch {
    bands: Vec<BandScratch>,
    /// What the sample of each complex pixel is to be multiplied by: red, green, blue; elsewhere anything.
    factors: [Vec<f32>; 3],
    width: u32,
    cells: Cells,
}

/// A texture.
#[derive(Debug)]
struct Paint {
    pyramid: Pyramid,
    /// Takes what the pyramid gives to factors of the plain colour.
    scale: [f32; 3],
}

#[derive(Clone, Copy, Debug)]
struct Object {
    id: ObjectId,
    mesh: usize,
    /// The surface number of its first face.
    first: u32,
}

#[derive(Debug, Default)]
pub(crate) struct BandScratch {
    surfaces: Vec<u32>,
    views: Vec<(u32, Option<View>)>,
}

/// What is looked at.
pub(crate) struct Shown<'a> {
    pub(crate) points: &'a PointImage,
    pub(crate) matrix: &'a Mat4,
    pub(crate) viewport: Viewport,
}

impl Textures {
    /// Those of a scene. Cost: a pass over the pixels of its textures, about eleven bytes for each; 4 for each triangle of
    /// meshes with textures, and 64 for each that has a plane or a texture of its own.
    pub(crate) fn new(scene: &Scene) -> Self {
        // Materials may share a texture.
        let mut number_of = vec![None; scene.textures.len()];
        let mut paint_of = vec![None; scene.materials.len()];
        let mut textures = Self::default();
        for (material, paint_of) in scene.materials.iter().zip(&mut paint_of) {
            if let Some(texture) = &material.base_color_texture {
                let image = &scene.textures[texture.texture.index()];
                let number = *number_of[texture.texture.index()].get_or_insert_with(|| {
                    textures.paints.push(Paint {
                        pyramid: Pyramid::new(image),
                        scale: (Vec3::ONE / (65535.0 * image.typical())).into(),
                    });
                    textures.paints.len() as u32 - 1
                });
                let texels = Vec2::new(image.width as f32, image.height as f32);
                *paint_of = Some((number, texture.transform, texels));
            }
        }
        let meshes: Vec<Option<usize>> = scene
            .meshes
            .iter()
            .map(|mesh| {
                let faces = Faces::new(mesh, &paint_of)?;
                textures.meshes.push(faces);
                Some(textures.meshes.len() - 1)
            })
            .collect();
        textures.position = vec![None; scene.objects.len()];
        // 0 is no surface.
        let mut first = 1u32;
        for (i, object) in scene.objects.iter().enumerate() {
            if let Geometry::Mesh(mesh) = object.geometry
                && let Some(mesh) = meshes[mesh.index()]
                && let Ok(count) = u32::try_from(textures.meshes[mesh].len())
                && let Some(end) = first.checked_add(count)
            {
                textures.position[i] = Some(textures.objects.len() as u32);
                let id = ObjectId::from(i);
                textures.objects.push(Object { id, mesh, first });
                first = end;
            }
        }
        textures
    }

    /// Is there no texture?
    pub(crate) fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// The number of a triangle of an object, for [`llsr_render_cache::Point::surface`]; `None` if no texture is known there.
    pub(crate) fn surface(&self, object: ObjectId, triangle: u32) -> Option<u32> {
        let object = self.objects[(*self.position.get(object.index())?)? as usize];
        let face = self.meshes[object.mesh].of_triangle(triangle)?;
        Some(object.first + face)
    }

    /// Multiplies a picture of plain colours by the textures.
    pub(crate) fn apply(
        &self,
        (image, picture): (&mut EdgePointImage, &mut Picture),
        shown: &Shown<'_>,
        transform: impl Fn(ObjectId) -> Affine3A + Sync,
        bands: usize,
        scratch: &mut TextureScratch,
    ) {
        self.apply_at(
            Level::detect(),
            (image, picture),
            shown,
            transform,
            bands,
            scratch,
        );
    }

    fn apply_at(
        &self,
        level: Level,
        (image, picture): (&mut EdgePointImage, &mut Picture),
        shown: &Shown<'_>,
        transform: impl Fn(ObjectId) -> Affine3A + Sync,
        bands: usize,
        scratch: &mut TextureScratch,
    ) {
        let (width, height) = (shown.viewport.width as usize, shown.viewport.height as usize);
        let TextureScratch {
            bands: memory,
            factors,
            cells,
            width: columns,
        } = scratch;
        *columns = shown.viewport.width;
        cells.update(shown.points);
        let cells = &*cells;
        for factors in &mut *factors {
            factors.resize(width * height, 1.0);
        }
        let [red, green, blue] = factors;
        let rows = image.rows_in_band(bands);
        let count = height.div_ceil(rows);
        if memory.len() < count {
            memory.resize_with(count, BandScratch::default);
        }
        let to_pixels = to_pixels(shown.matrix, shown.viewport);
        let painter = Painter {
            textures: self,
            cells,
            matrix: &|object| to_pixels * Mat4::from(transform(object)).as_dmat4(),
        };
        let of_samples = SampleValues {
            values: shown.points.surface_plane(),
            stride: shown.points.stride(),
        };
        let factors = red
            .chunks_mut(rows * width)
            .zip(green.chunks_mut(rows * width))
            .zip(blue.chunks_mut(rows * width));
        let parts = image
            .donor_bands(picture, of_samples, bands)
            .zip(memory.iter_mut().zip(factors))
            .enumerate();
        share(parts, &|(i, (band, (scratch, ((red, green), blue))))| {
            scratch.views.clear();
            scratch.views.resize(REMEMBERED, (0, None));
            scratch.surfaces.resize(width, 0);
            band.run(|donors| {
                let start = (donors.y as usize - i * rows) * width;
                let row = start..start + width;
                let factors = [&mut red[row.clone()], &mut green[row.clone()], &mut blue[row]];
                level.row(&painter, scratch, &mut Row { donors, factors });
            });
        });
    }
}

impl TextureScratch {
    /// What the sample of complex pixel (x, y) is to be multiplied by.
    pub(crate) fn factor(&self, x: u32, y: u32) -> Vec3 {
        let i = y as usize * self.width as usize + x as usize;
        let [red, green, blue] = &self.factors;
        Vec3::new(red[i], green[i], blue[i])
    }
}

/// From the scene's frame to pixels, homogeneous.
fn to_pixels(matrix: &Mat4, viewport: Viewport) -> DMat4 {
    let (w, h) = (f64::from(viewport.width), f64::from(viewport.height));
    DMat4::from_cols(
        DVec4::new(0.5 * w, 0.0, 0.0, 0.0),
        DVec4::new(0.0, -0.5 * h, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 1.0, 0.0),
        DVec4::new(0.5 * w, 0.5 * h, 0.0, 1.0),
    ) * matrix.as_dmat4()
}

/// One row of the picture, and the factors of its pixels' samples.
pub(crate) struct Row<'a> {
    donors: DonorRow<'a>,
    factors: [&'a mut [f32]; 3],
}

/// What all bands read.
pub(crate) struct Painter<'a, M> {
    textures: &'a Textures,
    cells: &'a Cells,
    /// From an object's frame to pixels.
    matrix: &'a M,
}

impl<M: Fn(ObjectId) -> DMat4> Painter<'_, M> {
    /// Multiplies one row.
    #[inline(always)]
    pub(crate) fn row<B: Between>(&self, scratch: &mut BandScratch, row: &mut Row<'_>) {
        let BandScratch { surfaces, views } = scratch;
        surfaces.copy_from_slice(row.donors.values);
        self.cells.complete(row.donors.y as usize, surfaces);
        let mut start = 0;
        while start < surfaces.len() {
            let surface = surfaces[start];
            let mut end = start + 1;
            while end < surfaces.len() && surfaces[end] == surface {
                end += 1;
            }
            let view = if surface == 0 {
                None
            } else {
                self.view(surface, views)
            };
            match view {
                Some(view) => self.run::<B>(&view, start..end, row),
                None if complex(row.donors.complex, start, end) => {
                    for factors in &mut row.factors {
                        factors[start..end].fill(1.0);
                    }
                }
                None => {}
            }
            start = end;
        }
    }

    /// Multiplies the pixels of a row that show the same surface.
    #[inline(always)]
    fn run<B: Between>(&self, view: &View, pixels: std::ops::Range<usize>, row: &mut Row<'_>) {
        let paint = &self.textures.paints[view.paint as usize];
        let run = view.run(pixels.start, row.donors.y as usize, paint.pyramid.wrap());
        let mut texels = [[0.0; BLOCK]; 3];
        let mut sampling = Sampling::default();
        for first in pixels.clone().step_by(BLOCK) {
            let count = BLOCK.min(pixels.end - first);
            let i = first - pixels.start;
            if i.is_multiple_of(ALIKE) {
                let middle = i + ALIKE.min(pixels.end - first) / 2;
                sampling = paint.pyramid.sampling(run.footprint(middle));
            }
            let (places, met) = run.places(i);
            paint.pyramid.look_up::<B>(&places, count, &sampling, &mut texels);
            let block = first..first + count;
            let ColourRow { red, green, blue } = &mut row.donors.colours;
            let colours = [
                &mut red[block.clone()],
                &mut green[block.clone()],
                &mut blue[block.clone()],
            ];
            for (texels, scale) in texels.iter_mut().zip(paint.scale) {
                for (texel, met) in texels.iter_mut().zip(met) {
                    *texel = 1.0 + met * (*texel * scale - 1.0);
                }
            }
            for (colours, factors) in colours.into_iter().zip(&texels) {
                for (colour, factor) in colours.iter_mut().zip(factors) {
                    *colour *= factor;
                }
            }
            if complex(row.donors.complex, block.start, block.end) {
                for (factors, found) in row.factors.iter_mut().zip(&texels) {
                    factors[block.clone()].copy_from_slice(&found[..count]);
                }
            }
        }
    }

    /// How a surface is seen.
    fn view(&self, surface: u32, views: &mut [(u32, Option<View>)]) -> Option<View> {
        let remembered = &mut views[surface as usize % REMEMBERED];
        if remembered.0 != surface {
            let Textures { meshes, objects, .. } = self.textures;
            let after = objects.partition_point(|object| object.first <= surface);
            let object = &objects[after - 1];
            let face = meshes[object.mesh].face(surface - object.first);
            *remembered = (surface, face.view(&(self.matrix)(object.id)));
        }
        remembered.1
    }
}

/// Is one of these pixels complex?
#[inline(always)]
fn complex(bits: &[u64], start: usize, end: usize) -> bool {
    let (first, last) = (start / 64, (end - 1) / 64);
    bits[first..=last].iter().any(|word| *word != 0)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use llsr_render_cache::{DepthFilter, Point, PointStore, Replacement, View};
    use llsr_scene::{Camera, FieldOfView, Material, Mesh, Texture, TextureUse, Wrap};

    use super::*;
    use crate::frame::renderer::planes;

    /// Two crossing textured quads and one without a texture.
    fn scene() -> Scene {
        let mut scene = Scene::new("quads");
        let texture = scene.add_texture(Texture {
            name: String::new(),
            width: 7,
            height: 5,
            pixels: (0..35u32)
                .map(|i| [i * 7, 255 - i * 5, i * i % 251].map(|c| c as u8))
                .collect(),
            wrap: [Wrap::Repeat, Wrap::Mirror],
        });
        let mut paper = Material::diffuse("paper", Vec3::ONE);
        paper.base_color_texture = Some(TextureUse::plain(texture));
        let paper = scene.add_material(paper);
        let grey = scene.add_material(Material::diffuse("grey", Vec3::splat(0.5)));
        for (name, material, tilt) in [("one", paper, 0.3), ("other", paper, -0.8), ("grey", grey, 0.0)] {
            let corners = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];
            let corners = corners.map(|[x, y]| Vec3::new(x, y, x * tilt + 0.1 * y));
            let mut quad = Mesh::quad(name, corners, material);
            quad.uvs = quad
                .positions
                .iter()
                .map(|p| Vec2::new(2.0 * p.x, p.y - p.x))
                .collect();
            scene.add_mesh(quad);
        }
        scene
    }

    #[test]
    fn all_levels_give_the_same_bits() {
        let scene = scene();
        let textures = Textures::new(&scene);
        assert_eq!(textures.surface(ObjectId(2), 0), None, "grey has no texture");
        let viewport = Viewport {
            width: 83,
            height: 50,
        };
        let (eye, fov) = (DVec3::new(0.5, 1.0, 4.0), FieldOfView::vertical_degrees(50.0));
        let camera = Camera::look_at("eye", eye, DVec3::ZERO, DVec3::Y, fov);
        let matrix = camera.view_projection(viewport, 1e-3);
        let view = View::new(&matrix, viewport.width, viewport.height).expect("size");
        let mut store = PointStore::new(2000).expect("capacity");
        let mut points = PointImage::new(viewport.width, viewport.height).expect("size");
        points.reproject(&store, &view, &DepthFilter::default());
        for i in 0..1500u32 {
            let [x, y] = [0.618_034, 0.754_877_7].map(|step| (i as f32 * step).fract() * 4.0 - 2.0);
            let object = i % 3;
            let tilt = [0.3, -0.8, 0.0][object as usize];
            let point = Point {
                position: Vec3::new(x, y, x * tilt + 0.1 * y),
                colour: Vec3::new(1.0, 2.0, 0.5),
                surface: textures.surface(ObjectId(object), 1).unwrap_or(0),
                object,
                lights: 0,
            };
            store
                .insert(&point, &points, &Replacement::default())
                .expect("finite");
        }
        points.reproject(&store, &view, &DepthFilter::default());
        let mut image = EdgePointImage::new(viewport.width, viewport.height, llsr_epi::Settings::default())
            .expect("size");
        image.load_samples(planes(&points, points.depth_plane(), points.region_plane()));
        image.classify();
        image.reach();
        let mut run = |level: Level, bands: usize| {
            let mut picture = Picture::new(viewport.width, viewport.height);
            image.interpolate(&mut picture);
            let shown = Shown {
                points: &points,
                matrix: &matrix,
                viewport,
            };
            let mut scratch = TextureScratch::default();
            let pictures = (&mut image, &mut picture);
            textures.apply_at(
                level,
                pictures,
                &shown,
                |_| Affine3A::IDENTITY,
                bands,
                &mut scratch,
            );
            let rows = (0..viewport.height)
                .flat_map(|y| picture.row(y).into_iter().flatten().copied().collect::<Vec<_>>());
            rows.map(f32::to_bits).collect::<Vec<_>>()
        };
        let expected = run(Level::Portable, 1);
        let values: std::collections::HashSet<u32> = expected.iter().copied().collect();
        assert!(values.len() > 1000, "textures vary: {}", values.len());
        for level in Level::available() {
            for bands in [1, 2] {
                assert_eq!(run(level, bands), expected, "{level:?}, {bands} bands");
            }
        }
    }
}
