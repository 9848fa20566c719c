//! Every instruction set against the portable twin.

use super::*;

struct Probe {
    a: [f32; 16],
    b: [f32; 16],
    c: [f32; 16],
    indices: [u8; 16],
    mask: u32,
}

#[derive(Debug, PartialEq)]
struct Answers {
    floats: Vec<f32>,
    masks: Vec<u32>,
    kept: Vec<ChildRef>,
    bytes: Vec<u8>,
    spread: u64,
}

/// All operations of one width.
#[inline(always)]
fn all<F: Floats>(
    token: F::Token,
    a: &F::Array,
    b: &F::Array,
    c: &F::Array,
    first: f32,
) -> ([F; 14], [u32; 2]) {
    let (a, b, c) = (F::load(token, a), F::load(token, b), F::load(token, c));
    let floats = [
        F::splat(token, first),
        a.add(b),
        a.sub(b),
        a.mul(b),
        a.div(b),
        a.mul_add(b, c),
        a.mul_sub(b, c),
        a.neg_mul_add(b, c),
        a.min(b),
        a.max(b),
        a.abs(),
        a.copysign(b),
        a.min_bits(b),
        a.max_bits(b),
    ];
    (floats, [a.le(b), a.lt(b)])
}

impl Kernel for Probe {
    type Output = Answers;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Answers {
        let half = |x: &[f32; 16]| -> [f32; 8] { std::array::from_fn(|i| x[i]) };
        let (narrow, masks) = all::<S::F>(s, &half(&self.a), &half(&self.b), &half(&self.c), self.a[3]);
        let (wide, more) = all::<S::W>(s, &self.a, &self.b, &self.c, self.a[3]);
        let mut floats: Vec<f32> = narrow.iter().flat_map(|x| x.store()).collect();
        floats.extend(wide.iter().flat_map(|x| x.store()));
        floats.extend(s.permute(S::W::load(s, &self.a), &self.indices).store());
        let from: [ChildRef; 8] = std::array::from_fn(|i| ChildRef(100 + i as u32));
        let to = s.compress(&from, self.mask);
        let bytes = s
            .compress_byte_lanes(0x0807_0605_0403_0201, self.mask)
            .to_le_bytes();
        Answers {
            floats,
            masks: [masks, more].concat(),
            spread: s.bits_to_bytes(self.mask),
            bytes: bytes[..self.mask.count_ones() as usize].to_vec(),
            kept: to[..self.mask.count_ones() as usize].to_vec(),
        }
    }
}

#[test]
fn all_instruction_sets_agree() {
    // Small integers and quarters: products are exact, so that fused and unfused operations agree.
    let a = [
        1.0,
        -2.5,
        0.0,
        3.25,
        f32::INFINITY,
        -7.0,
        f32::NAN,
        4.0,
        0.5,
        9.0,
        -1.0,
        2.0,
        -0.0,
        6.0,
        7.0,
        8.0,
    ];
    let b = [
        1.0,
        4.0,
        -0.5,
        3.0,
        2.0,
        -7.0,
        1.0,
        f32::NAN,
        0.5,
        8.0,
        1.0,
        -2.0,
        0.0,
        5.0,
        7.5,
        8.0,
    ];
    let c = [
        0.5, -1.0, 8.0, 2.0, 1.0, 0.25, 3.0, 1.0, 0.0, 1.0, -1.0, 4.0, 2.0, 3.0, 1.5, -8.0,
    ];
    let indices = [3, 1, 4, 1, 5, 9, 2, 15, 14, 0, 8, 7, 6, 10, 12, 12];
    for mask in 0..256 {
        let probe = || Probe {
            a,
            b,
            c,
            indices,
            mask,
        };
        let expected = Level::new(Instructions::Portable).run(probe());
        let selected: Vec<u8> = (0..8).filter(|i| mask >> i & 1 == 1).map(|i| i + 1).collect();
        assert_eq!(expected.bytes, selected, "bytes selected by {mask:08b}");
        let places: Vec<u8> = (0..8).map(|i| (mask >> i & 1) as u8).collect();
        assert_eq!(
            expected.spread.to_le_bytes(),
            *places,
            "bits of {mask:08b} in bytes"
        );
        for instructions in [Instructions::Avx2, Instructions::Avx512] {
            let got = Level::new(instructions).run(probe());
            assert_eq!(got.masks, expected.masks, "comparisons, {instructions:?}");
            assert_eq!(
                got.kept, expected.kept,
                "compression by {mask:08b}, {instructions:?}"
            );
            assert_eq!(got.spread, expected.spread, "bits in bytes, {instructions:?}");
            assert_eq!(
                got.bytes, expected.bytes,
                "bytes selected by {mask:08b}, {instructions:?}"
            );
            for (lane, (x, y)) in got.floats.iter().zip(&expected.floats).enumerate() {
                let same = x == y || (x.is_nan() && y.is_nan());
                assert!(same, "lane {lane} of all, {instructions:?}: {x} against {y}");
            }
        }
    }
}

/// Operations of double precision and of bytes and bits.
struct DoubleProbe {
    a: [f64; 8],
    b: [f64; 8],
    narrow: [f32; 8],
    indices: [u8; 16],
    mask: u32,
}

#[derive(Debug, PartialEq)]
struct DoubleAnswers {
    /// Bits, so that signs of zero count.
    doubles: Vec<u64>,
    bits: Vec<u64>,
}

impl Kernel for DoubleProbe {
    type Output = DoubleAnswers;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> DoubleAnswers {
        let (a, b) = (S::D::load(s, &self.a), S::D::load(s, &self.b));
        let widened = S::D::widen(s, &self.narrow);
        let picks = u64::from_le_bytes(std::array::from_fn(|i| self.indices[i]));
        let all = [
            S::D::splat(s, self.a[2]),
            widened,
            a.add(b),
            a.sub(b),
            a.mul(b),
            a.div(b),
            a.abs(),
            a.or_else(self.mask & 0xff, b),
            s.pick(&[a, widened], picks),
        ];
        let few = self.mask & (self.mask >> 4);
        s.prefetch(&self.a);
        DoubleAnswers {
            doubles: all.iter().flat_map(|x| x.store()).map(f64::to_bits).collect(),
            bits: vec![
                u64::from(a.lt(b)),
                u64::from(a.le(b)),
                u64::from(s.permute_bits(self.mask, &self.indices)),
                s.compress_bytes(&self.indices, if few.count_ones() > 8 { 0xff00 } else { few }),
                u64::from(s.compress_bits(self.mask, few)),
                s.spread(self.mask),
            ],
        }
    }
}

#[test]
fn double_lanes_have_the_same_bits_everywhere() {
    let a = [0.0, -0.0, 1.5, -2.25, f64::INFINITY, 1e-300, 3.0, f64::NAN];
    let b = [-0.0, 0.0, 1.5, 3.0, 2.0, 1e300, -7.0, 1.0];
    let narrow = [0.1, -0.0, 3e38, 1e-40, -7.5, 2.0, 1.0, 0.3];
    let indices = [3, 1, 4, 1, 5, 9, 2, 15, 14, 0, 8, 7, 6, 10, 12, 12];
    for step in 0..512u32 {
        let probe = || DoubleProbe {
            a,
            b,
            narrow,
            indices,
            // All kinds of masks of sixteen bits.
            mask: step.wrapping_mul(0x9e37_79b1) >> 16,
        };
        let expected = Level::new(Instructions::Portable).run(probe());
        for instructions in [Instructions::Avx2, Instructions::Avx512] {
            let mut got = Level::new(instructions).run(probe());
            for (x, y) in got.doubles.iter_mut().zip(&expected.doubles) {
                if f64::from_bits(*x).is_nan() && f64::from_bits(*y).is_nan() {
                    *x = *y;
                }
            }
            assert_eq!(got, expected, "{instructions:?}, step {step}");
        }
    }
}
