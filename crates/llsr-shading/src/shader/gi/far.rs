//! Records that serve rays from afar.
//!
//! A path that goes on by chance from surface to surface brings a noisy number. So what a surface far away gets by way of others is
//! taken from a record near it: of the four lines of the coarsest level around, one is picked by its bilinear weight, so that the mean of
//! many rays is an interpolation. Such records are few, made with few rays along whole paths, and a record that asks them averages
//! over dozens. From nearby their coarseness would show: there, and where no record is seen, the path goes on.
//!
//! After H. W. Jensen, "Global illumination using photon maps", Eurographics Workshop on Rendering 1996, section 4: what is seen only
//! by way of a diffuse reflection needs no exact answer, unless the surface is near.

use glam::DVec3;
use llsr_tracer::Hit;
use rand_pcg::Pcg64Mcg;

use crate::SurfacePoint;
use crate::shader::ShaderScratch;
use crate::shader::gi::gather::unit;
use crate::shader::gi::lattice::PlaceKey;
use crate::shader::gi::{Batch, Choice, GiShader, Side, axis_weights};

/// From nearer than this share of their distance they are not asked.
const NEAR: f64 = 0.5;

/// Rays of such a record.
pub(crate) const RAYS: [u32; 2] = [4, 12];

impl Batch<'_> {
    /// Irradiance by way of other surfaces at a surface that a ray has met, if a record says it: that of one record nearby, picked
    /// so that the mean of many rays is interpolated.
    pub(crate) fn seen_from_afar(
        &self,
        surface: &SurfacePoint,
        random: &mut Pcg64Mcg,
        scratch: &mut ShaderScratch,
    ) -> Option<DVec3> {
        let GiShader {
            lattice,
            far_records,
            far_fan,
            settings,
            ..
        } = self.shader;
        let spacing = lattice.spacing(0);
        if surface.distance < NEAR * spacing {
            return None;
        }
        let (point, normal) = (surface.position, surface.shading_normal);
        let axes = axis_weights(normal);
        let mut left = unit(random);
        let axis = (0..3).find(|&axis| {
            left -= axes[axis];
            left < 0.0
        })?;
        let mut left = unit(random);
        let (key, _) = lattice.around(axis, 0, point).into_iter().find(|&(_, share)| {
            left -= share;
            left < 0.0
        })?;
        let line = self.line(key);
        let away = |hit: &Hit| (hit.position[axis] - point[axis]).abs();
        let hit = line.hits.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let Side {
            upper,
            outwards,
            face,
        } = Side::of(hit, axis, normal);
        // The same surface, or one that goes on in about its plane.
        let offset = point - hit.position;
        let distance = offset.length();
        if face.dot(normal) < 0.8 || offset.dot(face).abs() > 0.3 * distance || distance > 2.0 * spacing {
            return None;
        }
        let lift = 0.2 * distance;
        let (from, to) = (
            surface.origin + normal * lift,
            hit.position + face * (lift + hit.offset),
        );
        let world = self.paths.world;
        if world.tracer().occluded(from, to) {
            return None;
        }
        let place = PlaceKey::new(key, hit, upper);
        let at = || world.surface(hit, -outwards);
        let record = match self.choose(true, &place, at, scratch) {
            Choice::Take(record) => record,
            Choice::Make => {
                // Random numbers of its own: a record for points may lie at the same place.
                let hash = place.hash(!settings.seed);
                far_records.put(place, self.make(&at(), hash, far_fan, scratch))
            }
            Choice::Pass => return None,
        };
        Some(record.gathered.irradiance.as_dvec3())
    }
}
