//! Random windows of edges that agree on shared boundaries.

/// A small repeatable stream of numbers (a linear congruential generator).
#[derive(Clone, Debug)]
pub struct Stream(u64);

impl Stream {
    /// A stream of its own for each seed.
    pub fn new(seed: u64) -> Self {
        let mut stream = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def0);
        stream.next_bits();
        stream
    }

    fn next_bits(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 ^ self.0 >> 29) >> 11
    }

    /// A number below `end`, which must be positive.
    pub fn below(&mut self, end: u32) -> u32 {
        (self.next_bits() % u64::from(end)) as u32
    }

    /// A number in [0, 1), a multiple of 2^-24.
    pub fn unit(&mut self) -> f32 {
        self.below(1 << 24) as f32 / (1 << 24) as f32
    }
}

/// Crossings of the boundaries of `columns` x `rows` pixels, as masks of eighths.
#[derive(Clone, Debug)]
pub struct Boundaries {
    /// Pixels in a row.
    pub columns: usize,
    /// Rows of pixels.
    pub rows: usize,
    /// Above each pixel, row by row; one row more for the lower border.
    pub above: Vec<u8>,
    /// Left of each pixel, row by row; one more in each row for the right border.
    pub left: Vec<u8>,
}

impl Boundaries {
    /// No crossings.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self {
            columns,
            rows,
            above: vec![0; columns * (rows + 1)],
            left: vec![0; (columns + 1) * rows],
        }
    }

    /// The boundary of a pixel on one side (0 top, 1 right, 2 bottom, 3 left).
    pub fn side_mut(&mut self, column: usize, row: usize, side: usize) -> &mut u8 {
        match side {
            0 => &mut self.above[row * self.columns + column],
            1 => &mut self.left[row * (self.columns + 1) + column + 1],
            2 => &mut self.above[(row + 1) * self.columns + column],
            _ => &mut self.left[row * (self.columns + 1) + column],
        }
    }

    /// The crossings of a pixel as boundary segments in 0..32.
    pub fn crossings(&self, column: usize, row: usize) -> Vec<u8> {
        let mut boundaries = self.clone();
        let masks: [u8; 4] = std::array::from_fn(|side| *boundaries.side_mut(column, row, side));
        (0..32)
            .filter(|&segment| masks[usize::from(segment / 8)] >> (segment % 8) & 1 != 0)
            .collect()
    }

    /// Curves that wander from pixel to pixel, each pixel crossed by at most one of them unless two happen to meet, and
    /// now and then a crossing from nowhere.
    pub fn wander(&mut self, stream: &mut Stream) {
        for _ in 0..stream.below(5) {
            let (mut column, mut row) = (
                stream.below(self.columns as u32) as usize,
                stream.below(self.rows as u32) as usize,
            );
            let mut side = stream.below(4) as usize;
            *self.side_mut(column, row, side) |= 1 << stream.below(8);
            for _ in 0..stream.below(12) {
                let next = (side + 1 + stream.below(3) as usize) % 4;
                *self.side_mut(column, row, next) |= 1 << stream.below(8);
                let (dx, dy) = [(0, -1), (1, 0), (0, 1), (-1, 0)][next];
                let (c, r) = (column.wrapping_add_signed(dx), row.wrapping_add_signed(dy));
                if c >= self.columns || r >= self.rows {
                    break;
                }
                (column, row, side) = (c, r, (next + 2) % 4);
            }
        }
        if stream.below(4) == 0 {
            let (column, row) = (stream.below(self.columns as u32), stream.below(self.rows as u32));
            *self.side_mut(column as usize, row as usize, stream.below(4) as usize) |= 1 << stream.below(8);
        }
    }
}
