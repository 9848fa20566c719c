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
    for at in at..at + count {
        let border = at == 1 || at + 1 >= words;
        for (plane, (dx, _)) in FORWARD.into_iter().enumerate() {
            out[plane * len + at] = if border {
                inside(at, 0, width) & inside(at, dx, width)
            } else {
                u64::MAX
            };
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
///
/// The boundary has two ends. At each, one region of the left pixel meets one of the right pixel (see the tables' generator).
#[inline(always)]
fn links_right<W: Lanes>(row: PlaneRow<'_, CLASS_PLANES>, words: usize, links: &mut Links) {
    let plane = |i| row.plane(i);
    let (complex, top_left, top_right) = (plane(COMPLEX), plane(CORNER), plane(CORNER + 1));
    let (bottom_right, bottom_left) = (plane(CORNER + 2), plane(CORNER + 3));
    in_words::<W>(words, |at, wide| {
        if wide {
            meet(
                W::load(complex, at).or(W::load_right_1(complex, at)),
                [W::load(top_right, at), W::load(bottom_right, at)],
                [W::load_right_1(top_left, at), W::load_right_1(bottom_left, at)],
                links,
                at,
            );
        } else {
            meet(
                u64::load(complex, at).or(u64::load_right_1(complex, at)),
                [u64::load(top_right, at), u64::load(bottom_right, at)],
                [
                    u64::load_right_1(top_left, at),
                    u64::load_right_1(bottom_left, at),
                ],
                links,
                at,
            );
        }
    });
}

/// Links between the pixels of a row and those below.
#[inline(always)]
fn links_down<W: Lanes>(
    row: PlaneRow<'_, CLASS_PLANES>,
    below: PlaneRow<'_, CLASS_PLANES>,
    words: usize,
    links: &mut Links,
) {
    // The corners at the left and at the right end of the boundary.
    let (upper, lower) = ([CORNER + 3, CORNER + 2], [CORNER, CORNER + 1]);
    in_words::<W>(words, |at, wide| {
        if wide {
            meet(
                W::load(row.plane(COMPLEX), at).or(W::load(below.plane(COMPLEX), at)),
                upper.map(|i| W::load(row.plane(i), at)),
                lower.map(|i| W::load(below.plane(i), at)),
                links,
                at,
            );
        } else {
            meet(
                row.plane(COMPLEX)[at] | below.plane(COMPLEX)[at],
                upper.map(|i| row.plane(i)[at]),
                lower.map(|i| below.plane(i)[at]),
                links,
                at,
            );
        }
    });
}

/// Runs over words 1..=words: `wide` where `W::WORDS` of them are left, one by one after that.
#[inline(always)]
fn in_words<W: Lanes>(words: usize, mut body: impl FnMut(usize, bool)) {
    let mut at = 1;
    while at + W::WORDS <= words + 1 {
        body(at, true);
        at += W::WORDS;
    }
    while at <= words {
        body(at, false);
        at += 1;
    }
}

/// Stores the four links over a boundary: `a` and `b` are set where the end lies in the secondary region.
#[inline(always)]
fn meet<W: Lanes>(blocked: W, a: [W; 2], b: [W; 2], links: &mut Links, at: usize) {
    let [pp, ps, sp, ss] = links;
    let either = |x: W, y: W| x.or(y).without(blocked);
    let neither = |a: W, b: W| W::ones().without(a.or(b));
    either(neither(a[0], b[0]), neither(a[1], b[1])).store(pp, at);
    either(b[0].without(a[0]), b[1].without(a[1])).store(ps, at);
    either(a[0].without(b[0]), a[1].without(b[1])).store(sp, at);
    either(a[0].and(b[0]), a[1].and(b[1])).store(ss, at);
}

/// What the primary region of a pixel reaches in another pixel.
#[derive(Clone, Copy)]
struct Reached<W> {
    primary: W,
    secondary: W,
}

impl<W: Lanes> Reached<W> {
    /// On to the next pixel, over a link that leads there.
    #[inline(always)]
    fn then(self, link: Link<W>) -> Self {
        Self {
            primary: self.primary.and(link.pp).or(self.secondary.and(link.sp)),
            secondary: self.primary.and(link.ps).or(self.secondary.and(link.ss)),
        }
    }

    #[inline(always)]
    fn or(self, other: Self) -> Self {
        Self {
            primary: self.primary.or(other.primary),
            secondary: self.secondary.or(other.secondary),
        }
    }
}

/// A link in the direction in which it is followed.
#[derive(Clone, Copy)]
struct Link<W> {
    pp: W,
    ps: W,
    sp: W,
    ss: W,
}

impl<W: Lanes> Link<W> {
    #[inline(always)]
    fn load(links: &Links, load: impl Fn(&[u64]) -> W) -> Self {
        let [pp, ps, sp, ss] = links;
        Self {
            pp: load(pp),
            ps: load(ps),
            sp: load(sp),
            ss: load(ss),
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
    fn back(self) -> Self {
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
        // Link between column dx and dx + 1 of row dy.
        let right = |dy: usize, dx: isize| {
            Link::load(self.right[dy], |plane| match dx {
                -2 => W::load_left_2(plane, at),
                -1 => W::load_left_1(plane, at),
                0 => W::load(plane, at),
                _ => W::load_right_1(plane, at),
            })
        };
        // Link between rows dy and dy + 1 in column dx.
        let down = |dy: usize, dx: isize| {
            Link::load(self.down[dy], |plane| match dx {
                -2 => W::load_left_2(plane, at),
                -1 => W::load_left_1(plane, at),
                0 => W::load(plane, at),
                1 => W::load_right_1(plane, at),
                _ => W::load_right_2(plane, at),
            })
        };
        let len = out.len() / REACH_PLANES;
        let mut keep = |plane: usize, reached: Reached<W>| reached.primary.store(&mut out[plane * len..], at);

        let below = down(0, 0).start();
        let below2 = below.then(down(1, 0));
        keep(4, below);
        keep(9, below2);

        // Right of the centre: r1 is (1, 0), r11 (1, 1), r21 (2, 1), ...
        let r1 = right(0, 0).start();
        let r2 = r1.then(right(0, 1));
        keep(0, r1);
        keep(1, r2);
        let r11 = r1.then(down(0, 1)).or(below.then(right(1, 0)));
        keep(5, r11);
        let r21 = r2.then(down(0, 2)).or(r11.then(right(1, 1)));
        keep(6, r21);
        let r12 = r11.then(down(1, 1)).or(below2.then(right(2, 0)));
        keep(10, r12);
        keep(11, r21.then(down(1, 2)).or(r12.then(right(2, 1))));

        // Left of the centre, whose own row is known from the pixels on the left.
        let l1 = right(0, -1).back().start();
        let l2 = l1.then(right(0, -2).back());
        let l11 = l1.then(down(0, -1)).or(below.then(right(1, -1).back()));
        keep(3, l11);
        let l21 = l2.then(down(0, -2)).or(l11.then(right(1, -2).back()));
        keep(2, l21);
        let l12 = l11.then(down(1, -1)).or(below2.then(right(2, -1).back()));
        keep(8, l12);
        keep(7, l21.then(down(1, -2)).or(l12.then(right(2, -2).back())));
    }
}

/// The 24-bit mask of one pixel: bit i stands for neighbour i of the 5x5 window in scan order, the centre left out.
pub(crate) fn mask(planes: &Planes<REACH_PLANES>, x: usize, y: usize) -> u32 {
    let mut mask = 0;
    for (plane, (dx, dy)) in FORWARD.into_iter().enumerate() {
        let forward = planes.row(y as isize).bit(plane, x as isize);
        // The same pair of pixels, seen from the later one.
        let backward = planes.row(y as isize - dy).bit(plane, x as isize - dx);
        mask |= u32::from(forward) << (12 + plane) | u32::from(backward) << (11 - plane);
    }
    mask
}
