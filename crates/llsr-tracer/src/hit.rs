//! What a ray meets.

use glam::DVec3;
use llsr_scene::ObjectId;

/// Where on an object a [`Hit`] lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surface {
    /// On a triangle of the object's mesh.
    Triangle {
        /// Position in [`Mesh::triangles`](llsr_scene::Mesh::triangles).
        index: u32,
        /// Weights of the second and third corner; the first has the rest.
        barycentrics: [f64; 2],
    },
    /// On an analytic primitive.
    Primitive,
}

/// A point where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in lengths of the ray's direction: metres, if that has unit length.
    pub t: f64,
    /// The point in the scene's recentred frame (m). It is on the surface up to a few roundings in double
    /// precision, closer than `origin + t * direction`.
    pub position: DVec3,
    /// Geometric unit normal: of a triangle, on the side from which its corners run counter-clockwise; of a primitive,
    /// outwards.
    pub normal: DVec3,
    /// The object.
    pub object: ObjectId,
    /// Where on the object.
    pub surface: Surface,
    /// How far from [`position`](Self::position) along the normal a point is certainly off the surface (m); it is derived
    /// from the error of the position.
    pub offset: f64,
}

impl Hit {
    /// The point to start visibility queries from: moved off the surface by [`offset`](Self::offset), to the side to
    /// which `direction` points.
    ///
    /// The surface that was hit never shadows this point from its own side, at whatever angle. The offset is a few
    /// units in the last place in double precision, so that nothing leaks through a surface in contact.
    pub fn leave(&self, direction: DVec3) -> DVec3 {
        self.position + self.normal * self.offset.copysign(self.normal.dot(direction))
    }
}
