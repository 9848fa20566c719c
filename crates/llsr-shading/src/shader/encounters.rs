//! What shaders met on the way.

use llsr_scene::{ObjectId, Triple};

/// Shadows and objects that a shader met: what the search for edges goes by (Bala et al. 2003, sections 3 and 6.5).
///
/// Both lists are sorted and without repetition after each call of [`Shader::shade`](crate::Shader::shade).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Encounters {
    /// Lights, objects that block them, and objects on which that shadow falls.
    pub triples: Vec<Triple>,
    /// Objects that were seen.
    pub objects: Vec<ObjectId>,
}

impl Encounters {
    /// Forgets everything and keeps the memory.
    pub fn clear(&mut self) {
        self.triples.clear();
        self.objects.clear();
    }

    /// True if nothing was met.
    pub fn is_empty(&self) -> bool {
        self.triples.is_empty() && self.objects.is_empty()
    }

    /// Adds what another shader met.
    pub fn merge(&mut self, other: &Self) {
        self.triples.extend_from_slice(&other.triples);
        self.objects.extend_from_slice(&other.objects);
        self.settle();
    }

    /// Adds a shadow, in whatever order; [`settle`](Self::settle) later.
    pub(crate) fn add_triple(&mut self, triple: Triple) {
        if self.triples.last() != Some(&triple) {
            self.triples.push(triple);
        }
    }

    /// Adds an object, in whatever order; [`settle`](Self::settle) later.
    pub(crate) fn add_object(&mut self, object: ObjectId) {
        if self.objects.last() != Some(&object) {
            self.objects.push(object);
        }
    }

    /// Sorts and takes out repetitions.
    pub fn settle(&mut self) {
        self.triples.sort_unstable();
        self.triples.dedup();
        self.objects.sort_unstable();
        self.objects.dedup();
    }
}
