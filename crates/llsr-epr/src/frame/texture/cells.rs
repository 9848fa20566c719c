//! A surface for pixels without a point anywhere near, as in the first frames: that of some point close by.

use llsr_epi::NO_DONOR;
use llsr_render_cache::{OCCUPIED, PointImage};

/// Pixels along each side of a cell.
const CELL: usize = 8;

/// One surface for each cell of 8x8 pixels.
#[derive(Debug, Default)]
pub(crate) struct Cells {
    surfaces: Vec<u32>,
    across: usize,
}

impl Cells {
    /// Takes the surface of the first point of each cell; cells without one take that of a cell beside them.
    ///
    /// Cost: some pixels of each cell are looked at until a point is found.
    pub(crate) fn update(&mut self, points: &PointImage) {
        let (width, height) = points.size();
        let (width, height) = (width as usize, height as usize);
        self.across = width.div_ceil(CELL);
        self.surfaces.clear();
        let (region, surfaces, stride) = (points.region_plane(), points.surface_plane(), points.stride());
        for top in (0..height).step_by(CELL) {
            for left in (0..width).step_by(CELL) {
                let rows = top..(top + CELL).min(height);
                let found = rows.into_iter().find_map(|y| {
                    let row = y * stride + left..y * stride + (left + CELL).min(width);
                    let there = |pixel: &usize| region[*pixel] & OCCUPIED != 0;
                    row.into_iter().find(there).map(|pixel| surfaces[pixel])
                });
                self.surfaces.push(found.unwrap_or(NO_DONOR));
            }
        }
        // In the order of scan lines, down and back: one cell with a point is enough to reach all.
        for i in 0..self.surfaces.len() {
            let beside = [(i % self.across != 0).then(|| i - 1), i.checked_sub(self.across)];
            self.take(i, beside);
        }
        for i in (0..self.surfaces.len()).rev() {
            let right = ((i + 1) % self.across != 0).then_some(i + 1);
            self.take(i, [right, Some(i + self.across)]);
        }
    }

    fn take(&mut self, i: usize, beside: [Option<usize>; 2]) {
        if self.surfaces[i] == NO_DONOR {
            let known = |i: &usize| self.surfaces.get(*i).is_some_and(|s| *s != NO_DONOR);
            if let Some(from) = beside.into_iter().flatten().find(known) {
                self.surfaces[i] = self.surfaces[from];
            }
        }
    }

    /// Puts surfaces where a row of pixels has none; 0 if there is no point at all.
    pub(crate) fn complete(&self, y: usize, surfaces: &mut [u32]) {
        let cells = &self.surfaces[y / CELL * self.across..][..self.across];
        for (surfaces, &cell) in surfaces.chunks_mut(CELL).zip(cells) {
            let cell = if cell == NO_DONOR { 0 } else { cell };
            for surface in surfaces {
                if *surface == NO_DONOR {
                    *surface = cell;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec3, Vec4};
    use llsr_render_cache::{DepthFilter, Point, PointStore, Replacement, View};

    use super::*;

    #[test]
    fn every_pixel_gets_the_surface_of_a_point_if_there_is_one() {
        let matrix = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::new(0.0, 0.0, 0.0, -1.0), Vec4::ZERO);
        let (width, height) = (61, 45);
        let view = View::new(&matrix, width, height).expect("size");
        let mut store = PointStore::new(100).expect("capacity");
        let mut image = PointImage::new(width, height).expect("size");
        let mut cells = Cells::default();
        let row = |cells: &Cells, y: usize| {
            let mut row = vec![NO_DONOR; width as usize];
            row[7] = 9;
            cells.complete(y, &mut row);
            row
        };
        image.reproject(&store, &view, &DepthFilter::default());
        cells.update(&image);
        assert_eq!(row(&cells, 44)[6..9], [0, 9, 0], "nothing to take");
        for (x, surface) in [(-0.9, 3), (0.9, 4)] {
            let point = Point {
                position: Vec3::new(x, 0.0, -1.0),
                colour: Vec3::ONE,
                surface,
                object: 0,
                lights: 0,
            };
            store
                .insert(&point, &image, &Replacement::default())
                .expect("finite");
        }
        image.reproject(&store, &view, &DepthFilter::default());
        cells.update(&image);
        for y in 0..height as usize {
            let row = row(&cells, y);
            assert!(row.iter().all(|s| [3, 4, 9].contains(s)), "row {y}: {row:?}");
        }
        let middle = row(&cells, 22);
        assert_eq!((middle[0], middle[7], middle[60]), (3, 9, 4), "their own cells");
    }
}
