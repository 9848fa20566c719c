//! Reachability over the 5x5 window, 64 pixels or more at a time (BWG03 section 5.2).
//!
//! The 4-bit reachability between neighbours and the chaining of such masks are Boolean functions, so they are evaluated as such on bit
//! planes instead of through tables, for all pixels of a word at once; [`paper`](crate::paper) has the form with tables, and
//! tests compare the two. Reachability is symmetric: only the twelve neighbours that come later in scan order are
//! worked out and kept, one and a half bytes a pixel; the others are the same bits seen from the other end.

use crate::classify::{CLASS_PLANES, COMPLEX, CORNER, CROSSED};
use crate::lanes::Lanes;
use crate::planes::{BandPlanes, PlaneRow, Planes};

/// Number of planes: neighbours later in scan order.
pub(crate) const REACH_PLANES: usize = 12;

/// The neighbours later in scan order (dx, dy), in scan order.
pub(crate) const FORWARD: [(isize, isize); REACH_PLANES] = [
    (1, 0),
    (2, 0),
    (-2, 1),
    (-1, 1),
    (0, 1),
    (1, 1),
    (2, 1),
    (-2, 2),
    (-1, 2),
    (0, 2),
    (1, 2),
    (2, 2),
];

/// Links of one row of pixels to their right neighbours, or to those below: planes PP, PS, SP, SS with guards.
type Links = [Vec<u64>; 4];

/// Scratch memory of [`reach`]: the links of the rows of the window.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReachScratch {
    right: [Links; 3],
    down: [Links; 2],
}

impl ReachScratch {
    fn prepare(&mut self, len: usize) {
        for plane in self.right.iter_mut().chain(&mut self.down).flatten() {
            // The guards must be zero, the rest is written before it is read.
            plane.clear();
            plane.resize(len, 0);
        }
    }
}

/// Works out the reachability of rows `first_row..end_row` from the classes of these and the next two rows.
#[inline(always)]
pub(crate) fn reach<W: Lanes>(
    classes: &Planes<CLASS_PLANES>,
    width: usize,
    (first_row, end_row): (usize, usize),
    scratch: &mut ReachScratch,
    band: &mut BandPlanes<'_, REACH_PLANES>,
) {
    let words = classes.words;
    scratch.prepare(words + 2);
    let row = |y: usize| classes.row(y as isize);
    // Links of a row to the right live in slot row % 3, downwards in slot row % 2.
    for y in [first_row, first_row + 1] {
        links_right::<W>(row(y), words, &mut scratch.right[y % 3]);
    }
    links_down::<W>(
        row(first_row),
        row(first_row + 1),
        words,
        &mut scratch.down[first_row % 2],
    );
    for y in first_row..end_row {
        links_right::<W>(row(y + 2), words, &mut scratch.right[(y + 2) % 3]);
        links_down::<W>(row(y + 1), row(y + 2), words, &mut scratch.down[(y + 1) % 2]);
        let window = Window {
            right: [
                &scratch.right[y % 3],
                &scratch.right[(y + 1) % 3],
                &scratch.right[(y + 2) % 3],
            ],
            down: [&scratch.down[y % 2], &scratch.down[(y + 1) % 2]],
        };
        let crossed = [row(y), row(y + 1), row(y + 2)].map(|row| row.plane(CROSSED));
        let inner = y + 2 < classes.height();
        let out = band.row_mut(y - first_row);
        let mut at = 1;
        while at <= words {
            let count = if at + W::WORDS <= words + 1 { W::WORDS } else { 1 };
            // The words that pixels of these words see, one to the left and one to the right included.
            if inner
                && crossed
                    .iter()
                    .all(|row| row[at - 1..=at + count].iter().all(|&bits| bits == 0))
            {
                fill_free(out, at, count, words, width);
            } else if count == W::WORDS {
                window.reach::<W>(out, at);
            } else {
                window.reach::<u64>(out, at);
            }
            at += count;
        }
    }
}

/// Everything is reachable but what lies outside the picture on the left and on the right.
fn fill_free(out: &mut [u64], at: usize, count: usize, words: usize, width: usize) {
    let len = words + 2;
    for (plane, (dx, _)) in FORWARD.into_iter().enumerate() {
        let plane = &mut out[plane * len..][..len];
        plane[at..at + count].fill(u64::MAX);
        // The words at both ends, and the last but one where the last holds less than the window sees.
        for border in [1, words.max(2) - 1, words] {
            if (at..at + count).contains(&border) {
                plane[border] = inside(border, 0, width) & inside(border, dx, width);
            }
        }
    }
}

/// The bits of the pixels x of word `at` for which x + dx lies in the picture.
fn inside(at: usize, dx: isize, width: usize) -> u64 {
    let first = 64 * (at as isize - 1) + dx;
    let bits_below = |end: isize| match end.clamp(0, 64) {
        64 => u64::MAX,
        count => (1 << count) - 1,
    };
    bits_below(width as isize - first) & !bits_below(-first)
}

/// Links between the pixels of a row and their right neighbours.
#[inline(always)]
fn links_right<W: Lanes>(row: PlaneRow<'_, CLASS_PLANES>, words: usize, links: &mut Links) {
    let mut at = 1;
    while at + W::WORDS <= words + 1 {
        links_right_at::<W>(row, at, links);
        at += W::WORDS;
    }
    for at in at..=words {
        links_right_at::<u64>(row, at, links);
    }
}

#[inline(always)]
fn links_right_at<W: Lanes>(row: PlaneRow<'_, CLASS_PLANES>, at: usize, links: &mut Links) {
    link_right::<W>(row, at, 0).store(links, at);
}

/// The link between the pixels dx beside those of words `at..` and their right neighbours, for dx in -2..=1.
#[inline(always)]
pub(crate) fn link_right<W: Lanes>(row: PlaneRow<'_, CLASS_PLANES>, at: usize, dx: isize) -> Link<W> {
    let load = |plane: usize, dx: isize| W::load_beside(row.plane(plane), at, dx);
    meet(
        load(COMPLEX, dx).or(load(COMPLEX, dx + 1)),
        [load(CORNER + 1, dx), load(CORNER + 2, dx)],
        [load(CORNER, dx + 1), load(CORNER + 3, dx + 1)],
    )
}

/// Links between the pixels of a row and those below.
#[inline(always)]
fn links_down<W: Lanes>(
    row: PlaneRow<'_, CLASS_PLANES>,
    below: PlaneRow<'_, CLASS_PLANES>,
    words: usize,
    links: &mut Links,
) {
    let mut at = 1;
    while at + W::WORDS <= words + 1 {
        links_down_at::<W>(row, below, at, links);
        at += W::WORDS;
    }
    for at in at..=words {
        links_down_at::<u64>(row, below, at, links);
    }
}

#[inline(always)]
fn links_down_at<W: Lanes>(
    row: PlaneRow<'_, CLASS_PLANES>,
    below: PlaneRow<'_, CLASS_PLANES>,
    at: usize,
    links: &mut Links,
) {
    link_down::<W>(row, below, at, 0).store(links, at);
}

/// The link between the pixels dx beside those of words `at..` and those below, for dx in -2..=2.
#[inline(always)]
pub(crate) fn link_down<W: Lanes>(
    row: PlaneRow<'_, CLASS_PLANES>,
    below: PlaneRow<'_, CLASS_PLANES>,
    at: usize,
    dx: isize,
) -> Link<W> {
    let load = |row: PlaneRow<'_, CLASS_PLANES>, plane: usize| W::load_beside(row.plane(plane), at, dx);
    meet(
        load(row, COMPLEX).or(load(below, COMPLEX)),
        [load(row, CORNER + 3), load(row, CORNER + 2)],
        [load(below, CORNER), load(below, CORNER + 1)],
    )
}

/// The link over a boundary, which has two ends; `a` and `b` are set where an end lies in the secondary
/// region. At each end one region of the first pixel meets one of the second (see the tables' generator).
#[inline(always)]
fn meet<W: Lanes>(blocked: W, a: [W; 2], b: [W; 2]) -> Link<W> {
    let neither = W::ones()
        .without(a[0].or(b[0]))
        .or(W::ones().without(a[1].or(b[1])));
    Link {
        pp: neither.without(blocked),
        ps: b[0].without(a[0]).or(b[1].without(a[1])).without(blocked),
        sp: a[0].without(b[0]).or(a[1].without(b[1])).without(blocked),
        ss: a[0].and(b[0]).or(a[1].and(b[1])).without(blocked),
    }
}

/// What a region of a pixel reaches in another pixel.
#[derive(Clone, Copy)]
pub(crate) struct Reached<W> {
    pub(crate) primary: W,
    pub(crate) secondary: W,
}

impl<W: Lanes> Reached<W> {
    /// On to the next pixel, over a link that leads there.
    #[inline(always)]
    pub(crate) fn then(self, link: Link<W>) -> Self {
        Self {
            primary: self.primary.and(link.pp).or(self.secondary.and(link.sp)),
            secondary: self.primary.and(link.ps).or(self.secondary.and(link.ss)),
        }
    }

    #[inline(always)]
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            primary: self.primary.or(other.primary),
            secondary: self.secondary.or(other.secondary),
        }
    }
}

/// A link in the direction in which it is followed.
#[derive(Clone, Copy)]
pub(crate) struct Link<W> {
    pub(crate) pp: W,
    pub(crate) ps: W,
    pub(crate) sp: W,
    pub(crate) ss: W,
}

impl<W: Lanes> Link<W> {
    /// The links of the pixels dx beside those of words `at..`.
    #[inline(always)]
    fn load(links: &Links, at: usize, dx: isize) -> Self {
        let [pp, ps, sp, ss] = links;
        Self {
            pp: W::load_beside(pp, at, dx),
            ps: W::load_beside(ps, at, dx),
            sp: W::load_beside(sp, at, dx),
            ss: W::load_beside(ss, at, dx),
        }
    }

    /// Keeps the links of words `at..`.
    #[inline(always)]
    fn store(self, [pp, ps, sp, ss]: &mut Links, at: usize) {
        self.pp.store(pp, at);
        self.ps.store(ps, at);
        self.sp.store(sp, at);
        self.ss.store(ss, at);
    }

    /// The first step, from a secondary region.
    #[inline(always)]
    pub(crate) fn start_secondary(self) -> Reached<W> {
        Reached {
            primary: self.sp,
            secondary: self.ss,
        }
    }

    /// The first step, from a primary region.
    #[inline(always)]
    fn start(self) -> Reached<W> {
        Reached {
            primary: self.pp,
            secondary: self.ps,
        }
    }

    /// Followed the other way.
    #[inline(always)]
    pub(crate) fn back(self) -> Self {
        Self {
            ps: self.sp,
            sp: self.ps,
            ..self
        }
    }
}

/// The links that a row of pixels needs for its window.
struct Window<'a> {
    /// Rows y, y + 1 and y + 2.
    right: [&'a Links; 3],
    /// Rows y and y + 1.
    down: [&'a Links; 2],
}

impl Window<'_> {
    /// Propagates away from the centre: to the direct neighbours, then from pixel to pixel over each shared boundary that
    /// leads away from the centre (the arrows of BWG03 figure 6).
    #[inline(always)]
    fn reach<W: Lanes>(&self, out: &mut [u64], at: usize) {
        // Links between columns dx and dx + 1 of rows 0 to 2, and between rows 0 and 1, 1 and 2.
        let [right0, right1, right2] = self.right;
        let [down0, down1] = self.down;
        let len = out.len() / REACH_PLANES;

        let below = Link::<W>::load(down0, at, 0).start();
        let below2 = below.then(Link::<W>::load(down1, at, 0));
        keep(out, len, at, 4, below);
        keep(out, len, at, 9, below2);

        // Right of the centre: r1 is (1, 0), r11 (1, 1), r21 (2, 1), ...
        let r1 = Link::<W>::load(right0, at, 0).start();
        let r2 = r1.then(Link::<W>::load(right0, at, 1));
        keep(out, len, at, 0, r1);
        keep(out, len, at, 1, r2);
        let r11 = r1
            .then(Link::<W>::load(down0, at, 1))
            .or(below.then(Link::<W>::load(right1, at, 0)));
        keep(out, len, at, 5, r11);
        let r21 = r2
            .then(Link::<W>::load(down0, at, 2))
            .or(r11.then(Link::<W>::load(right1, at, 1)));
        keep(out, len, at, 6, r21);
        let r12 = r11
            .then(Link::<W>::load(down1, at, 1))
            .or(below2.then(Link::<W>::load(right2, at, 0)));
        keep(out, len, at, 10, r12);
        keep(
            out,
            len,
            at,
            11,
            r21.then(Link::<W>::load(down1, at, 2))
                .or(r12.then(Link::<W>::load(right2, at, 1))),
        );

        // Left of the centre, whose own row is known from the pixels on the left.
        let l1 = Link::<W>::load(right0, at, -1).back().start();
        let l2 = l1.then(Link::<W>::load(right0, at, -2).back());
        let l11 = l1
            .then(Link::<W>::load(down0, at, -1))
            .or(below.then(Link::<W>::load(right1, at, -1).back()));
        keep(out, len, at, 3, l11);
        let l21 = l2
            .then(Link::<W>::load(down0, at, -2))
            .or(l11.then(Link::<W>::load(right1, at, -2).back()));
        keep(out, len, at, 2, l21);
        let l12 = l11
            .then(Link::<W>::load(down1, at, -1))
            .or(below2.then(Link::<W>::load(right2, at, -1).back()));
        keep(out, len, at, 8, l12);
        keep(
            out,
            len,
            at,
            7,
            l21.then(Link::<W>::load(down1, at, -2))
                .or(l12.then(Link::<W>::load(right2, at, -2).back())),
        );
    }
}

#[inline(always)]
fn keep<W: Lanes>(out: &mut [u64], len: usize, at: usize, plane: usize, reached: Reached<W>) {
    reached.primary.store(&mut out[plane * len..], at);
}

/// The 24-bit mask of one pixel: bit i stands for neighbour i of the 5x5 window in scan order, the centre left out.
pub(crate) fn mask(planes: &Planes<REACH_PLANES>, x: usize, y: usize) -> u32 {
    mask_among(planes, x, y, (1 << (2 * REACH_PLANES)) - 1)
}

/// The bits of [`mask`] that are also in `wanted`. Costs the less the fewer these are.
pub(crate) fn mask_among(planes: &Planes<REACH_PLANES>, x: usize, y: usize, wanted: u32) -> u32 {
    let (x, y) = (x as isize, y as isize);
    let (mut left, mut mask) = (wanted, 0);
    while left != 0 {
        let i = left.trailing_zeros();
        left &= left - 1;
        let plane = i as usize % REACH_PLANES;
        let reached = if i as usize >= REACH_PLANES {
            planes.bit(plane, x, y)
        } else {
            // The same pair of pixels, seen from the later one.
            let plane = REACH_PLANES - 1 - plane;
            let (dx, dy) = FORWARD[plane];
            planes.bit(plane, x - dx, y - dy)
        };
        mask |= u32::from(reached) << i;
    }
    mask
}
