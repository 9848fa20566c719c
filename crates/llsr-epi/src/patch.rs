//! Colours for single pixels, worked out from a picture before they change it.

use glam::Vec3;

use crate::picture::{Picture, PictureBand};

/// New colours of some pixels: what a pass over a picture that reads neighbours may leave behind, to be applied when all bands
/// have been read. Keep and reuse.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patches {
    /// Pixel number in the padded picture, and colour.
    list: Vec<(u32, Vec3)>,
}

impl Patches {
    /// Number of pixels.
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// Drops all patches and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.list.clear();
    }

    #[inline]
    pub(crate) fn push(&mut self, index: usize, colour: Vec3) {
        self.list.push((index as u32, colour));
    }
}

impl Picture {
    /// Sets the patched pixels and marks them as coloured.
    pub(crate) fn apply(&mut self, patches: &Patches) {
        let rows = self.height;
        for mut band in self.bands_mut(rows) {
            band.apply(patches);
        }
    }
}

impl PictureBand<'_> {
    /// Sets the patched pixels, all of which lie in the band.
    pub(crate) fn apply(&mut self, patches: &Patches) {
        let first = self.first_row * self.stride;
        for &(index, colour) in &patches.list {
            let i = index as usize - first;
            (self.red[i], self.green[i], self.blue[i]) = colour.into();
            let (x, row) = (i % self.stride, i / self.stride);
            self.coloured.row_mut(row)[x / 64 + 1] |= 1 << (x % 64);
        }
    }
}
