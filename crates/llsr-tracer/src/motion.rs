//! Objects that move: their geometry stays, only the small tree over the parts is built anew.

use std::error::Error;
use std::fmt;
use std::sync::Arc;

use glam::Affine3A;
use llsr_scene::{Bounds, ObjectId, Shape};

use crate::Tracer;
use crate::part::{Geometry, Placement, double};
use crate::tracer::{in_range, placed_shape};

/// An object that may be moved, and the part that shows it.
#[derive(Clone, Debug)]
pub(crate) struct Movable {
    pub(crate) object: ObjectId,
    pub(crate) part: usize,
    /// For a primitive, which is placed anew each time.
    pub(crate) shape: Option<Shape>,
}

/// Why an object could not be moved; it stays where it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MoveError {
    /// The object was not named as movable when the tracer was built, or had nothing that could be traced.
    NotMovable(ObjectId),
    /// The transform is not finite or not invertible, or takes the object out of range.
    BadTransform(ObjectId),
}

impl fmt::Display for MoveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotMovable(object) => write!(f, "object {} cannot be moved", object.0),
            Self::BadTransform(object) => {
                write!(f, "object {}: the transform is not usable", object.0)
            }
        }
    }
}

impl Error for MoveError {}

impl Tracer {
    /// The objects that [`set_transform`](Self::set_transform) can move, in no particular order.
    pub fn movable(&self) -> impl Iterator<Item = ObjectId> + '_ {
        self.movable.iter().map(|movable| movable.object)
    }

    /// A box around a movable object where it stands now (m, recentred frame); for a mesh it may be larger than needed.
    pub fn movable_bounds(&self, object: ObjectId) -> Option<Bounds> {
        let movable = self.movable.iter().find(|movable| movable.object == object)?;
        Some(self.parts[movable.part].bounds())
    }

    /// Moves an object: `transform` maps its own frame to the scene's recentred frame.
    ///
    /// Answers from now on are those of a tracer built with [`with_movable`](Self::with_movable) from the scene after the
    /// move. Cost: some microseconds for each part of the scene, whatever the size of the object.
    ///
    /// # Errors
    /// [`MoveError`]; the tracer then is as it was.
    pub fn set_transform(&mut self, object: ObjectId, transform: Affine3A) -> Result<(), MoveError> {
        self.set_transforms(&[(object, transform)])
    }

    /// Moves several objects at the cost of one.
    ///
    /// # Errors
    /// [`MoveError`] for the first that cannot be moved; none is moved then.
    pub fn set_transforms(&mut self, moves: &[(ObjectId, Affine3A)]) -> Result<(), MoveError> {
        let mut placed = Vec::with_capacity(moves.len());
        for &(object, transform) in moves {
            let movable = self
                .movable
                .iter()
                .find(|movable| movable.object == object)
                .ok_or(MoveError::NotMovable(object))?;
            let bad = MoveError::BadTransform(object);
            if !is_invertible(&transform) {
                return Err(bad);
            }
            let mut part = self.parts[movable.part].clone();
            match &movable.shape {
                None => part.placement = Some(Placement::new(&transform, object)),
                Some(shape) => {
                    let shape = placed_shape(shape, &transform, object).ok_or(bad)?;
                    part.geometry = Arc::new(Geometry::new(&[], &[], &[], vec![shape]));
                }
            }
            let bounds = part.bounds();
            if !(in_range(bounds.min) && in_range(bounds.max)) {
                return Err(bad);
            }
            placed.push((movable.part, part));
        }
        for (index, part) in placed {
            self.parts[index] = part;
        }
        self.rebuild_top();
        Ok(())
    }
}

/// Whether a transform and its inverse are finite.
pub(crate) fn is_invertible(transform: &Affine3A) -> bool {
    let transform = double(transform);
    transform.is_finite() && transform.inverse().is_finite()
}
