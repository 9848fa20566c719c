//! Looking ahead: which parts of a coming view no point will fall into.
//!
//! While the camera moves, the rim of the picture and what comes out from behind objects has no points when it
//! appears. A view predicted for the time at which samples requested now will be shown tells these parts beforehand
//! (B. Walter, G. Drettakis, D. P. Greenberg, "Enhancing and Optimizing the Render Cache", Eurographics Workshop on
//! Rendering 2002, section 4). It only needs to be known roughly: a share of the points is projected into cells of 8x8
//! pixels.

use crate::Error;
use crate::image::BLOCK;
use crate::priority::Priorities;
use crate::project::{self, Level, List, Task};
use crate::request::{Chooser, Request};
use crate::store::{LANES, PointStore};
use crate::view::View;

/// Pixels along the side of a cell.
const CELL: u32 = 8;

/// How a predicted view is covered by the points there are.
#[derive(Clone, Debug)]
pub struct Prediction {
    view: View,
    cells: Priorities,
    chooser: Chooser,
    list: List,
    counts: Vec<u8>,
    chosen: Vec<Request>,
}

impl Prediction {
    /// For pictures of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::Size`] if a side is 0 or above [`MAX_SIDE`](crate::MAX_SIDE).
    pub fn new(width: u32, height: u32) -> Result<Self, Error> {
        let view = View::new(&glam::Mat4::ZERO, width, height)?;
        let (columns, rows) = (width.div_ceil(CELL), height.div_ceil(CELL));
        let cells = Priorities::new(columns, rows)?;
        Ok(Self {
            view,
            counts: vec![0; cells.stride() * rows as usize],
            chooser: Chooser::new(columns, rows)?,
            cells,
            list: List::default(),
            chosen: Vec::new(),
        })
    }

    /// Counts the points in each cell of `view` and sets the priorities of the cells: 255 for a cell without a point,
    /// 0 for one with `enough` points or more.
    ///
    /// Of the points one group of 16 in `share` is looked at, up to 8 for cells to get an even share; which ones depends
    /// on `start`: let it be the number of the frame, so that all are looked at in turn. `enough` counts all points of the
    /// cell: 13 is one in five pixels.
    ///
    /// # Panics
    /// If the size of `view` is another one.
    pub fn update(&mut self, store: &PointStore, view: &View, share: usize, start: usize, enough: usize) {
        assert_eq!(
            view.size(),
            self.view.size(),
            "sizes of the view and the prediction"
        );
        self.view = *view;
        let (columns, rows) = self.cells.size();
        let mut coarse = *view;
        for row in &mut coarse.rows[..2] {
            *row /= CELL as f32;
        }
        (coarse.width, coarse.height) = (columns, rows);

        self.counts.fill(0);
        self.list.reserve(BLOCK + LANES);
        let level = Level::detect();
        let stride = self.cells.stride();
        let share = share.max(1);
        // Slots follow the scan lines, so the groups that are looked at are staggered from line to line.
        let (groups, lines) = (store.groups(), view.height as usize);
        let task = Task {
            store,
            view: coarse,
            stride: stride as u32,
            fresh: 0,
        };
        let room = self.list.pixel.len();
        for mut list in self.list.chunks_mut(room) {
            for line in 0..lines {
                let (first, end) = (line * groups / lines, (line + 1) * groups / lines);
                let skip = (start + line + share - first % share) % share;
                for group in (first + skip..end).step_by(share) {
                    let range = (group * LANES, (group + 1) * LANES);
                    let found = project::project(level, &task, range, &mut list);
                    for &cell in &list.pixel[..found] {
                        let count = &mut self.counts[cell as usize];
                        *count = count.saturating_add(1);
                    }
                }
            }
        }
        let enough = (enough / share).clamp(1, 255) as u32;
        for y in 0..rows {
            let counts = &self.counts[y as usize * stride..];
            for (priority, &count) in self.cells.row_mut(y).iter_mut().zip(counts) {
                *priority = (255 * enough.saturating_sub(u32::from(count)) / enough) as u8;
            }
        }
    }

    /// The share of the cells without any of the points looked at.
    pub fn uncovered(&self) -> f32 {
        let (columns, rows) = self.cells.size();
        let empty = |y: u32| self.cells.row(y).iter().filter(|&&p| p == 255).count();
        (0..rows).map(empty).sum::<usize>() as f32 / (columns * rows) as f32
    }

    /// Replaces the contents of `out` by up to `count` pixels of the predicted view in cells that lack points, at most
    /// one a cell; fewer if fewer cells lack any. `phase` as for [`Chooser::choose`]; it also moves the pixel
    /// within the cell.
    pub fn choose(&mut self, count: usize, phase: f64, out: &mut Vec<Request>) {
        self.chooser
            .choose(&mut self.cells, count, phase, 0, &mut self.chosen);
        out.clear();
        let (width, height) = self.view.size();
        let start = (phase.clamp(0.0, 1.0) * f64::from(CELL * CELL)) as u32;
        for cell in &self.chosen {
            // A stride through the 64 pixels of a cell that differs from cell to cell.
            let i = start
                .wrapping_add(cell.x.wrapping_mul(23))
                .wrapping_add(cell.y.wrapping_mul(41));
            let (dx, dy) = (i * 5 % CELL, i * 13 / CELL % CELL);
            out.push(Request {
                x: (cell.x * CELL + dx).min(width - 1),
                y: (cell.y * CELL + dy).min(height - 1),
            });
        }
    }
}
