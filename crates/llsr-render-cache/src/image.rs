//! The picture of points: what falls into each pixel.

use crate::filter::{DepthFilter, FilterScratch};
use crate::project::{
    self, EIGHTH_SHIFT, Entries, Level, List, ListMut, REGION_SHIFT, SETTLED, SLOT_MASK, Task,
};
use crate::store::{LANES, PointStore};
use crate::view::View;
use crate::{Error, finish};

/// Set in a region byte if the pixel has a point; the region is in the four bits below, the place within the region in the two above.
pub const OCCUPIED: u8 = 16;

/// Lowest bit of the place within the region in a region byte.
const EIGHTHS_BIT: u32 = 5;

/// The slot of a pixel without a point.
pub const NO_SLOT: u32 = u32::MAX;

/// The key of a pixel without a point: infinitely far, no slot.
pub(crate) const NO_KEY: u64 = (f32::INFINITY.to_bits() as u64) << 32 | u32::MAX as u64;

/// Points projected at a time where one thread does everything: their list stays in the first-level cache.
pub(crate) const BLOCK: usize = 1024;

/// The picture of points: for each pixel the nearest point that falls into it, in planes.
///
/// Rows are [`stride`](Self::stride) pixels apart; `row_*` show the picture only, `*_plane` everything. The memory is
/// kept from frame to frame and grows only with the picture or the store.
#[derive(Clone, Debug)]
pub struct PointImage {
    pub(crate) view: View,
    filter: DepthFilter,
    stride: usize,
    /// Depth bits << 32 | tag of the nearest point, whether it is hidden or not.
    pub(crate) keys: Vec<u64>,
    pub(crate) planes: Planes,
    scratch: Vec<FilterScratch>,
    list: List,
    /// Scratch of the bands in which the nearest points are found.
    selected: Vec<List>,
    /// Entries of each list, of each chunk.
    lists: Vec<ChunkList>,
    /// Entries that a chunk's list has room for.
    chunk_room: usize,
    counts: Vec<Counts>,
}

/// What the picture shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Planes {
    pub(crate) region: Vec<u8>,
    pub(crate) age: Vec<u8>,
    pub(crate) depth: Vec<f32>,
    pub(crate) colour: Vec<u32>,
    pub(crate) fine: Vec<u16>,
    pub(crate) surface: Vec<u32>,
    pub(crate) slot: Vec<u32>,
}

/// How many points were found where.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Pixels with a point.
    pub occupied: usize,
    /// Pixels whose nearest point was dropped because it shone through a nearer surface.
    pub hidden: usize,
}

#[derive(Clone, Copy, Debug, Default)]
struct ChunkList {
    len: usize,
}

impl PointImage {
    /// An empty picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// [`Error::Size`] if a side is 0 or above [`MAX_SIDE`](crate::MAX_SIDE).
    pub fn new(width: u32, height: u32) -> Result<Self, Error> {
        let mut image = Self {
            view: View::new(&glam::Mat4::ZERO, width, height)?,
            filter: DepthFilter::default(),
            stride: 0,
            keys: Vec::new(),
            planes: Planes::default(),
            scratch: Vec::new(),
            list: List::default(),
            selected: Vec::new(),
            lists: Vec::new(),
            chunk_room: 0,
            counts: Vec::new(),
        };
        image.set_view(image.view);
        Ok(image)
    }

    /// Reprojects all points and drops those that shine through nearer surfaces, on one thread.
    ///
    /// The picture takes the size of the view. Of several points in a pixel the nearest is kept; of equally near ones
    /// that of the lower region and slot.
    ///
    /// # Cost
    /// Proportional to the slots of the store plus the pixels. No memory is allocated unless picture or store grew.
    pub fn reproject(&mut self, store: &PointStore, view: &View, filter: &DepthFilter) {
        self.set_view(*view);
        self.filter = *filter;
        self.keys.fill(NO_KEY);
        self.list.reserve(BLOCK + LANES);
        let level = Level::detect();
        let task = self.task(store);
        let room = self.list.pixel.len();
        for mut list in self.list.chunks_mut(room) {
            for first in (0..store.slots()).step_by(BLOCK) {
                let range = (first, (first + BLOCK).min(store.slots()));
                let count = project::project(level, &task, range, &mut list);
                resolve(&mut self.keys, list.entries(count));
            }
        }
        for band in self.finish_bands(store, 1) {
            band.run();
        }
    }

    /// First of three steps that do the work of [`reproject`](Self::reproject) on several threads: projects the points
    /// in `chunks` parts. Run all of them, in any order or at once, then those of [`resolve_bands`](Self::resolve_bands),
    /// then those of [`finish_bands`](Self::finish_bands). The result has the same bits.
    ///
    /// ```
    /// # use llsr_render_cache::{DepthFilter, PointImage, PointStore, View};
    /// # let (store, mut image) = (PointStore::new(1000)?, PointImage::new(64, 64)?);
    /// # let view = View::new(&glam::Mat4::IDENTITY, 64, 64)?;
    /// # let filter = DepthFilter::default();
    /// std::thread::scope(|scope| {
    ///     for chunk in image.project_chunks(&store, &view, &filter, 2) {
    ///         scope.spawn(|| chunk.run());
    ///     }
    /// });
    /// std::thread::scope(|scope| {
    ///     for band in image.resolve_bands(2) {
    ///         scope.spawn(|| band.run());
    ///     }
    /// });
    /// std::thread::scope(|scope| {
    ///     for band in image.finish_bands(&store, 2) {
    ///         scope.spawn(|| band.run());
    ///     }
    /// });
    /// # Ok::<(), llsr_render_cache::Error>(())
    /// ```
    pub fn project_chunks<'a>(
        &'a mut self,
        store: &'a PointStore,
        view: &View,
        filter: &DepthFilter,
        chunks: usize,
    ) -> impl Iterator<Item = ProjectChunk<'a>> {
        self.set_view(*view);
        self.filter = *filter;
        let points = store.slots().div_ceil(chunks.max(1)).next_multiple_of(LANES);
        let chunks = store.slots().div_ceil(points);
        self.chunk_room = points + LANES;
        self.list.reserve(chunks * self.chunk_room);
        self.lists.clear();
        self.lists.resize(chunks, ChunkList::default());
        let task = self.task(store);
        let rooms = self
            .list
            .chunks_mut(self.chunk_room)
            .zip(&mut self.lists)
            .enumerate();
        rooms.map(move |(i, (list, out))| ProjectChunk {
            task,
            range: (i * points, ((i + 1) * points).min(store.slots())),
            list,
            out,
        })
    }

    /// Second step: finds the nearest point of each pixel, in about `bands` bands of rows. See
    /// [`project_chunks`](Self::project_chunks).
    ///
    /// Each band looks through all lists, which is a small part of the work as long as there are no more bands than
    /// threads.
    pub fn resolve_bands(&mut self, bands: usize) -> impl Iterator<Item = ResolveBand<'_>> {
        let pixels = self.rows_in_band(bands) * self.stride;
        let count = self.keys.len().div_ceil(pixels);
        if self.selected.len() < count {
            self.selected.resize_with(count, List::default);
        }
        let (list, lists, room) = (&self.list, &self.lists[..], self.chunk_room);
        let bands = self.keys.chunks_mut(pixels).zip(&mut self.selected).enumerate();
        bands.map(move |(i, (keys, scratch))| ResolveBand {
            list,
            lists,
            room,
            first: i * pixels,
            keys,
            scratch,
        })
    }

    /// Last step: drops hidden points and fills the planes, in about `bands` bands of rows. See
    /// [`project_chunks`](Self::project_chunks).
    pub fn finish_bands<'a>(
        &'a mut self,
        store: &'a PointStore,
        bands: usize,
    ) -> impl Iterator<Item = FinishBand<'a>> {
        let rows = self.rows_in_band(bands);
        let (stride, width) = (self.stride, self.view.width as usize);
        let pixels = rows * stride;
        let count = (self.view.height as usize).div_ceil(rows);
        if self.scratch.len() < count {
            self.scratch.resize_with(count, FilterScratch::default);
        }
        self.counts.clear();
        self.counts.resize(count, Counts::default());
        let keys = &self.keys[..];
        let planes = &mut self.planes;
        let filter = self.filter;
        let region = planes
            .region
            .chunks_mut(pixels)
            .zip(planes.age.chunks_mut(pixels));
        let depth = planes
            .depth
            .chunks_mut(pixels)
            .zip(planes.colour.chunks_mut(pixels));
        let slot = planes.slot.chunks_mut(pixels).zip(planes.fine.chunks_mut(pixels));
        let planes = region.zip(depth).zip(slot.zip(planes.surface.chunks_mut(pixels)));
        let rest = self.scratch.iter_mut().zip(&mut self.counts);
        planes.zip(rest).enumerate().map(
            move |(i, ((((region, age), (depth, colour)), ((slot, fine), surface)), (scratch, counts)))| {
                FinishBand {
                    store,
                    filter,
                    keys,
                    stride,
                    width,
                    first: i * rows,
                    region,
                    age,
                    depth,
                    colour,
                    fine,
                    surface,
                    slot,
                    scratch,
                    counts,
                }
            },
        )
    }

    /// How many pixels have a point, and how many lost theirs to the filter.
    pub fn counts(&self) -> Counts {
        let add = |a: Counts, b: &Counts| Counts {
            occupied: a.occupied + b.occupied,
            hidden: a.hidden + b.hidden,
        };
        self.counts.iter().fold(Counts::default(), add)
    }

    /// The view that the picture shows.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.view.size()
    }

    /// Pixels from one row to the next in the planes: the width rounded up to a multiple of 64. Pixels beyond the width
    /// have no point.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// For each pixel the quarter-pixel region of its point (bits 0-3, as [`Projected::region`](crate::Projected)),
    /// [`OCCUPIED`], and the place within the region (bits 5-6, as [`Projected::eighth`](crate::Projected)); 0 without a point.
    pub fn region_plane(&self) -> &[u8] {
        &self.planes.region
    }

    /// For each pixel the age of its point in ticks; 0 without a point.
    pub fn age_plane(&self) -> &[u8] {
        &self.planes.age
    }

    /// For each pixel the depth of its point; infinite without a point.
    pub fn depth_plane(&self) -> &[f32] {
        &self.planes.depth
    }

    /// For each pixel with a point the high bits of its colour (see [`PackedColour`](crate::PackedColour)); elsewhere anything.
    pub fn colour_plane(&self) -> &[u32] {
        &self.planes.colour
    }

    /// For each pixel with a point [`Point::surface`](crate::Point::surface); elsewhere anything.
    pub fn surface_plane(&self) -> &[u32] {
        &self.planes.surface
    }

    /// The low bits of the same colours; elsewhere anything.
    pub fn fine_plane(&self) -> &[u16] {
        &self.planes.fine
    }

    /// For each pixel the slot of its point; [`NO_SLOT`] without a point.
    pub fn slot_plane(&self) -> &[u32] {
        &self.planes.slot
    }

    /// Takes the point of a pixel out of the picture and out of `store`, for callers who know better than the filter that it
    /// is hidden. Does nothing where there is none. `store` must be that of the last
    /// [`reproject`](Self::reproject), unchanged since then but for this.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn discard(&mut self, store: &mut PointStore, x: u32, y: u32) {
        if let Some(slot) = self.hide(x, y) {
            store.discard(slot);
        }
    }

    /// Takes the point of a pixel out of the picture alone: it may be seen again in another view. Returns its slot, or
    /// `None` where there is no point.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn hide(&mut self, x: u32, y: u32) -> Option<u32> {
        let (width, height) = self.size();
        assert!(
            x < width && y < height,
            "pixel ({x}, {y}) outside {width}x{height}"
        );
        let i = y as usize * self.stride + x as usize;
        let planes = &mut self.planes;
        let slot = std::mem::replace(&mut planes.slot[i], NO_SLOT);
        if slot == NO_SLOT {
            return None;
        }
        planes.region[i] = 0;
        planes.age[i] = 0;
        planes.depth[i] = f32::INFINITY;
        self.keys[i] = NO_KEY;
        let rows = (height as usize).div_ceil(self.counts.len().max(1));
        if let Some(counts) = self.counts.get_mut(y as usize / rows.max(1)) {
            counts.occupied = counts.occupied.saturating_sub(1);
            counts.hidden += 1;
        }
        Some(slot)
    }

    /// The slot of the nearest point that fell into a pixel, even if it was dropped as hidden. It may have been replaced
    /// since.
    pub(crate) fn nearest_slot(&self, x: u32, y: u32) -> Option<usize> {
        let slot = self.keys[y as usize * self.stride + x as usize] as u32 & SLOT_MASK;
        (slot != SLOT_MASK).then_some(slot as usize)
    }

    fn task<'a>(&self, store: &'a PointStore) -> Task<'a> {
        Task {
            store,
            view: self.view,
            stride: self.stride as u32,
            fresh: self.filter.fresh,
        }
    }

    fn rows_in_band(&self, bands: usize) -> usize {
        (self.view.height as usize).div_ceil(bands.max(1))
    }

    fn set_view(&mut self, view: View) {
        if self.stride == 0 || view.size() != self.view.size() {
            self.stride = (view.width as usize).next_multiple_of(64);
            let pixels = self.stride * view.height as usize;
            let planes = &mut self.planes;
            refill(&mut self.keys, pixels, NO_KEY);
            refill(&mut planes.region, pixels, 0);
            refill(&mut planes.age, pixels, 0);
            refill(&mut planes.depth, pixels, f32::INFINITY);
            refill(&mut planes.colour, pixels, 0);
            refill(&mut planes.fine, pixels, 0);
            refill(&mut planes.surface, pixels, 0);
            refill(&mut planes.slot, pixels, NO_SLOT);
            self.counts.clear();
        }
        self.view = view;
    }
}

fn refill<T: Copy>(plane: &mut Vec<T>, pixels: usize, value: T) {
    plane.clear();
    plane.resize(pixels, value);
}

/// Keeps the nearer of what is there and what is in the list.
#[inline]
fn resolve(keys: &mut [u64], [pixel, depth, tag]: Entries<'_>) {
    let (depth, tag) = (&depth[..pixel.len()], &tag[..pixel.len()]);
    for i in 0..pixel.len() {
        let key = &mut keys[pixel[i] as usize];
        // Written in any case: a store costs less than a wrong guess.
        *key = (*key).min(u64::from(depth[i]) << 32 | u64::from(tag[i]));
    }
}

/// A part of the points to be projected; see [`PointImage::project_chunks`].
#[derive(Debug)]
pub struct ProjectChunk<'a> {
    task: Task<'a>,
    range: (usize, usize),
    list: ListMut<'a>,
    out: &'a mut ChunkList,
}

impl ProjectChunk<'_> {
    /// Does this part of the work.
    pub fn run(mut self) {
        self.out.len = project::project(Level::detect(), &self.task, self.range, &mut self.list);
    }
}

/// A band of rows in which the nearest points are to be found; see [`PointImage::resolve_bands`].
#[derive(Debug)]
pub struct ResolveBand<'a> {
    list: &'a List,
    lists: &'a [ChunkList],
    room: usize,
    first: usize,
    keys: &'a mut [u64],
    /// Entries of the band, a block at a time.
    scratch: &'a mut List,
}

impl ResolveBand<'_> {
    /// Does this part of the work.
    pub fn run(self) {
        self.keys.fill(NO_KEY);
        let level = Level::detect();
        let pixels = (self.first as u32, self.keys.len() as u32);
        self.scratch.reserve(BLOCK + LANES);
        let room = self.scratch.pixel.len();
        for mut selected in self.scratch.chunks_mut(room) {
            for (i, chunk) in self.lists.iter().enumerate() {
                let end = i * self.room + chunk.len;
                for start in (i * self.room..end).step_by(BLOCK) {
                    let from = self.list.entries(start..end.min(start + BLOCK));
                    let count = project::select(level, from, pixels, &mut selected);
                    resolve(self.keys, selected.entries(count));
                }
            }
        }
    }
}

/// A band of rows to be filtered; see [`PointImage::finish_bands`].
#[derive(Debug)]
pub struct FinishBand<'a> {
    pub(crate) store: &'a PointStore,
    pub(crate) filter: DepthFilter,
    pub(crate) keys: &'a [u64],
    pub(crate) stride: usize,
    pub(crate) width: usize,
    pub(crate) first: usize,
    pub(crate) region: &'a mut [u8],
    pub(crate) age: &'a mut [u8],
    pub(crate) depth: &'a mut [f32],
    pub(crate) colour: &'a mut [u32],
    pub(crate) fine: &'a mut [u16],
    pub(crate) surface: &'a mut [u32],
    pub(crate) slot: &'a mut [u32],
    pub(crate) scratch: &'a mut FilterScratch,
    pub(crate) counts: &'a mut Counts,
}

impl FinishBand<'_> {
    /// Does this part of the work.
    pub fn run(mut self) {
        finish::finish(Level::detect(), &mut self);
    }

    #[inline(always)]
    pub(crate) fn rows(&mut self) {
        let (keys, stride, width) = (self.keys, self.stride, self.width);
        let row = move |y: isize| {
            let start = usize::try_from(y).ok()? * stride;
            keys.get(start..start + width)
        };
        let keep = 1.0 - self.filter.tolerance;
        let scratch = &mut *self.scratch;
        scratch.start(self.filter.reach(), width, self.first, row);
        let mut counts = Counts::default();
        for i in 0..self.region.len() / stride {
            let y = self.first + i;
            let keys = &keys[y * stride..][..width];
            let at = i * stride..i * stride + width;
            let (depths, tags) = (&mut scratch.depth[..width], &mut scratch.tag[..width]);
            for ((key, depth), tag) in keys.iter().zip(depths).zip(tags) {
                (*depth, *tag) = (f32::from_bits((key >> 32) as u32), *key as u32);
            }
            scratch.row(y, keep, row);
            let (depths, tags) = (&scratch.depth[..width], &mut scratch.tag[..width]);
            let hidden = &scratch.hidden[..width];
            let out_depth = &mut self.depth[at.clone()][..width];
            let out_slot = &mut self.slot[at.clone()][..width];
            let (mut there, mut shown) = (0, 0);
            for x in 0..width {
                let found = depths[x] < f32::INFINITY;
                let show = found & ((hidden[x] == 0) | (tags[x] & SETTLED == 0));
                there += u32::from(found);
                shown += u32::from(show);
                out_depth[x] = if show { depths[x] } else { f32::INFINITY };
                out_slot[x] = if show { tags[x] & SLOT_MASK } else { NO_SLOT };
                tags[x] = if show { tags[x] } else { 0 };
            }
            counts.occupied += shown as usize;
            counts.hidden += (there - shown) as usize;

            let out_region = &mut self.region[at.clone()][..width];
            for ((region, tag), slot) in out_region.iter_mut().zip(&*tags).zip(&*out_slot) {
                let occupied = if *slot == NO_SLOT { 0 } else { u32::from(OCCUPIED) };
                *region = (tag >> REGION_SHIFT | occupied | (tag >> EIGHTH_SHIFT & 3) << EIGHTHS_BIT) as u8;
            }
            let colours = &self.store.colour[..];
            // Of the same length, so that one check of bounds serves both.
            let ages = &self.store.age[..colours.len()];
            let out_colour = &mut self.colour[at.clone()][..width];
            let out_fine = &mut self.fine[at.clone()][..width];
            let out_surface = &mut self.surface[at.clone()][..width];
            let out_age = &mut self.age[at][..width];
            out_age.fill(0);
            // Colours and ages lie all over the store: they are fetched for pixels that show a point, and for no others.
            let columns = &mut scratch.shown[..width];
            let mut count = 0;
            for (x, slot) in out_slot.iter().enumerate() {
                columns[count] = x as u32;
                count += usize::from(*slot != NO_SLOT);
            }
            for &x in &columns[..count] {
                let x = x as usize;
                let slot = out_slot[x] as usize;
                out_colour[x] = colours[slot] as u32;
                out_fine[x] = (colours[slot] >> 32) as u16;
                out_age[x] = ages[slot];
            }
            if self.store.on_surfaces {
                let surfaces = &self.store.surface[..];
                for &x in &columns[..count] {
                    out_surface[x as usize] = surfaces[out_slot[x as usize] as usize];
                }
            }
        }
        *self.counts = counts;
    }
}
