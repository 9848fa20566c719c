//! Every instruction set against the portable twin.

use super::*;

struct Probe {
    a: [f32; 8],
    b: [f32; 8],
    c: [f32; 8],
    mask: u32,
}

#[derive(Debug, PartialEq)]
struct Answers {
    floats: Vec<[u32; 8]>,
    masks: [u32; 2],
    kept: Vec<ChildRef>,
}

impl Kernel for Probe {
    type Output = Answers;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Answers {
        let (a, b, c) = (s.load(&self.a), s.load(&self.b), s.load(&self.c));
        let floats = [
            s.splat(self.a[3]),
            s.add(a, b),
            s.sub(a, b),
            s.mul(a, b),
            s.div(a, b),
            s.mul_add(a, b, c),
            s.mul_sub(a, b, c),
            s.neg_mul_add(a, b, c),
            s.min(a, b),
            s.max(a, b),
            s.abs(a),
        ];
        let from: [ChildRef; 8] = std::array::from_fn(|i| ChildRef(100 + i as u32));
        let mut to = [ChildRef::default(); 8];
        s.compress(&from, self.mask, &mut to);
        Answers {
            floats: floats.map(|x| s.store(x).map(f32::to_bits)).to_vec(),
            masks: [s.le(a, b), s.lt(a, b)],
            kept: to[..self.mask.count_ones() as usize].to_vec(),
        }
    }
}

#[test]
fn all_instruction_sets_agree() {
    // Small integers and quarters: products are exact, so that fused and unfused operations agree.
    let a = [1.0, -2.5, 0.0, 3.25, f32::INFINITY, -7.0, f32::NAN, 4.0];
    let b = [1.0, 4.0, -0.5, 3.0, 2.0, -7.0, 1.0, f32::NAN];
    let c = [0.5, -1.0, 8.0, 2.0, 1.0, 0.25, 3.0, 1.0];
    for mask in 0..256 {
        let probe = || Probe { a, b, c, mask };
        let expected = Level::new(Instructions::Portable).run(probe());
        for instructions in [Instructions::Avx2, Instructions::Avx512] {
            let got = Level::new(instructions).run(probe());
            assert_eq!(got.masks, expected.masks, "comparisons, {instructions:?}");
            assert_eq!(
                got.kept, expected.kept,
                "compression by {mask:08b}, {instructions:?}"
            );
            for (op, (x, y)) in got.floats.iter().zip(&expected.floats).enumerate() {
                for lane in 0..8 {
                    let (x, y) = (f32::from_bits(x[lane]), f32::from_bits(y[lane]));
                    assert!(
                        x == y || (x.is_nan() && y.is_nan()),
                        "operation {op}, lane {lane}, {instructions:?}: {x} against {y}"
                    );
                }
            }
        }
    }
}
