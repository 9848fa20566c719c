//! Containment trials of the interval operations.

use llsr_intervals::{Interval, IntervalVec3, Real};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::Dyadic;

/// An operation of the interval crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// `-x`
    Neg,
    /// `x + y`
    Add,
    /// `x - y`
    Sub,
    /// `x * y`
    Mul,
    /// `x / y`
    Div,
    /// `1 / x`
    Recip,
    /// `x * x`
    Sqr,
    /// Square root.
    Sqrt,
    /// Absolute value.
    Abs,
    /// Smaller of two.
    Min,
    /// Larger of two.
    Max,
    /// `x * y + z`
    MulAdd,
    /// Numbers in both.
    Intersection,
    /// Numbers in either, and between.
    Hull,
    /// Dot product of vectors.
    Dot,
    /// Cross product of vectors.
    Cross,
}

/// Every operation.
pub const OPERATIONS: [Operation; 16] = [
    Operation::Neg,
    Operation::Add,
    Operation::Sub,
    Operation::Mul,
    Operation::Div,
    Operation::Recip,
    Operation::Sqr,
    Operation::Sqrt,
    Operation::Abs,
    Operation::Min,
    Operation::Max,
    Operation::MulAdd,
    Operation::Intersection,
    Operation::Hull,
    Operation::Dot,
    Operation::Cross,
];

/// A trial whose result did not hold the exact one.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The trial's index, which is its seed.
    pub trial: u64,
    /// What was computed from what.
    pub message: String,
}

/// A type that the trials know how to draw and to read exactly.
trait Tested: Real + Into<f64> {
    /// A number with exponents of the whole range or, mostly, near 0.
    fn draw(random: &mut Pcg64Mcg) -> Self;
    /// `steps` representable numbers further up.
    fn stepped(self, steps: u32) -> Self {
        (0..steps).fold(self, |x, _| x.next_up())
    }
    fn exact(self) -> Dyadic {
        Dyadic::new(self.into()).expect("witnesses are finite")
    }
}

macro_rules! tested {
    ($type:ident, $bits:ident, $fraction:expr, $bias:expr) => {
        impl Tested for $type {
            fn draw(random: &mut Pcg64Mcg) -> Self {
                let bits = random.next_u64() as $bits;
                match random.next_u32() % 8 {
                    // Any finite pattern, subnormal and huge ones too.
                    0 => {
                        let x = $type::from_bits(bits);
                        if x.is_finite() { x } else { 0.0 }
                    }
                    1 => [
                        0.0,
                        -0.0,
                        1.0,
                        -1.0,
                        0.5,
                        $type::MAX,
                        -$type::MAX,
                        $type::MIN_POSITIVE,
                    ][bits as usize % 8],
                    // Small integers, where results are exact and cancel.
                    2 => (bits % 17) as $type - 8.0,
                    _ => {
                        let sign = bits & (1 << ($bits::BITS - 1));
                        let fraction = bits >> 3 & ((1 << $fraction) - 1);
                        let exponent = $bits::from(random.next_u32() as u8 % 41) + ($bias - 20);
                        $type::from_bits(sign | exponent << $fraction | fraction)
                    }
                }
            }
        }
    };
}

tested!(f32, u32, 23, 127);
tested!(f64, u64, 52, 1023);

/// An interval around a drawn number, as wide as nothing, some steps, or many times the number.
fn draw_interval<F: Tested>(random: &mut Pcg64Mcg) -> Interval<F> {
    let x = F::draw(random);
    let y = match random.next_u32() % 4 {
        0 => x,
        1 => x.stepped(random.next_u32() % 5),
        _ => F::draw(random),
    };
    let lo = if random.next_u32().is_multiple_of(64) {
        F::NEG_INFINITY
    } else {
        x.smaller(y)
    };
    let hi = if random.next_u32().is_multiple_of(64) {
        F::INFINITY
    } else {
        x.larger(y)
    };
    Interval::new(lo, hi).unwrap_or(Interval::ENTIRE)
}

/// A number in `interval`: an end two times out of three.
fn witness<F: Tested>(random: &mut Pcg64Mcg, interval: Interval<F>) -> F {
    let lo = interval.lo().larger(-F::MAX);
    let hi = interval.hi().smaller(F::MAX);
    match random.next_u32() % 3 {
        0 => lo,
        1 => hi,
        _ => {
            // A drawn number, forced inside: near 0, at an end or anywhere between.
            F::draw(random).larger(lo).smaller(hi)
        }
    }
}

/// Does `[lo, hi]` hold `exact`?
fn holds<F: Tested>(interval: Interval<F>, exact: &Dyadic) -> bool {
    let above = |end: F| Dyadic::new(end.into()).is_none_or(|end| *exact >= end);
    let below = |end: F| Dyadic::new(end.into()).is_none_or(|end| *exact <= end);
    !interval.is_empty() && above(interval.lo()) && below(interval.hi())
}

/// Does `interval` hold the quotient `x / y`, compared without dividing?
fn holds_quotient<F: Tested>(interval: Interval<F>, x: &Dyadic, y: &Dyadic) -> bool {
    let (x, y) = if y.signum() < 0 {
        (-x, -y)
    } else {
        (x.clone(), y.clone())
    };
    let scaled = |end: F| Dyadic::new(end.into()).map(|end| &end * &y);
    !interval.is_empty()
        && scaled(interval.lo()).is_none_or(|end| end <= x)
        && scaled(interval.hi()).is_none_or(|end| end >= x)
}

/// Does `interval` hold the root of `x`, compared by squares?
fn holds_root<F: Tested>(interval: Interval<F>, x: &Dyadic) -> bool {
    let square = |end: F| Dyadic::new(end.into()).map(|end| &end * &end);
    !interval.is_empty()
        && (interval.lo() <= F::ZERO || square(interval.lo()).is_some_and(|s| s <= *x))
        && interval.hi() >= F::ZERO
        && square(interval.hi()).is_none_or(|s| s >= *x)
}

fn trial<F: Tested>(operation: Operation, seed: u64) -> Result<(), String> {
    let random = &mut Pcg64Mcg::seed_from_u64(seed);
    let [a, b, c] = [(); 3].map(|()| draw_interval::<F>(random));
    let (x, y, z) = (witness(random, a), witness(random, b), witness(random, c));
    let (p, q, r) = (x.exact(), y.exact(), z.exact());
    let expect = |result: Interval<F>, good: bool| {
        good.then_some(()).ok_or_else(|| {
            format!("{operation:?} of {a:?}, {b:?}, {c:?} at {x:?}, {y:?}, {z:?} is not in {result:?}")
        })
    };
    let exactly = |result: Interval<F>, exact: &Dyadic| expect(result, holds(result, exact));
    match operation {
        Operation::Neg => exactly(-a, &-&p),
        Operation::Add => exactly(a + b, &(&p + &q)),
        Operation::Sub => exactly(a - b, &(&p - &q)),
        Operation::Mul => exactly(a * b, &(&p * &q)),
        Operation::Div if q.signum() == 0 => Ok(()),
        Operation::Div => expect(a / b, holds_quotient(a / b, &p, &q)),
        Operation::Recip if p.signum() == 0 => Ok(()),
        Operation::Recip => expect(a.recip(), holds_quotient(a.recip(), &F::ONE.exact(), &p)),
        Operation::Sqr => exactly(a.sqr(), &(&p * &p)),
        Operation::Sqrt if p.signum() < 0 => Ok(()),
        Operation::Sqrt => expect(a.sqrt(), holds_root(a.sqrt(), &p)),
        Operation::Abs => exactly(a.abs(), &if p.signum() < 0 { -&p } else { p.clone() }),
        Operation::Min => exactly(a.min(b), (&p).min(&q)),
        Operation::Max => exactly(a.max(b), (&p).max(&q)),
        Operation::MulAdd => exactly(a.mul_add(b, c), &(&(&p * &q) + &r)),
        Operation::Intersection => {
            let both = a.intersection(b);
            expect(
                both,
                both.contains(x) == b.contains(x) && both.contains(y) == a.contains(y),
            )
        }
        Operation::Hull => {
            let hull = a.hull(b);
            expect(hull, hull.contains(x) && hull.contains(y))
        }
        Operation::Dot | Operation::Cross => vectors::<F>(operation, random),
    }
}

fn vectors<F: Tested>(operation: Operation, random: &mut Pcg64Mcg) -> Result<(), String> {
    let mut draw = || {
        let ranges = [(); 3].map(|()| draw_interval::<F>(random));
        let inside = ranges.map(|range| witness(random, range));
        let vector = IntervalVec3::new(ranges[0], ranges[1], ranges[2]);
        (vector, inside, inside.map(Tested::exact))
    };
    let ((a, x, p), (b, y, q)) = (draw(), draw());
    let minor = |i: usize, j: usize| &(&p[i] * &q[j]) - &(&p[j] * &q[i]);
    let results: Vec<(Interval<F>, Dyadic)> = if operation == Operation::Dot {
        let dot = &(&(&p[0] * &q[0]) + &(&p[1] * &q[1])) + &(&p[2] * &q[2]);
        vec![(a.dot(&b), dot)]
    } else {
        let cross = a.cross(&b);
        vec![
            (cross.x, minor(1, 2)),
            (cross.y, minor(2, 0)),
            (cross.z, minor(0, 1)),
        ]
    };
    for (result, exact) in results {
        if !holds(result, &exact) {
            return Err(format!(
                "{operation:?} of {a:?} and {b:?} at {x:?}, {y:?} is not in {result:?}"
            ));
        }
    }
    Ok(())
}

/// One trial in single (`double` false) or double precision; `Err` says what escaped.
pub fn run_trial(operation: Operation, double: bool, seed: u64) -> Result<(), Failure> {
    let outcome = if double {
        trial::<f64>(operation, seed)
    } else {
        trial::<f32>(operation, seed)
    };
    outcome.map_err(|message| Failure { trial: seed, message })
}

/// Trials `0..trials` of an operation in both precisions; the first that fails.
///
/// Cost: about 2 µs a trial.
pub fn containment(operation: Operation, trials: u64) -> Result<(), Failure> {
    (0..trials).try_for_each(|seed| {
        run_trial(operation, false, seed)?;
        run_trial(operation, true, seed)
    })
}
