//! Values on which IEEE 1788-2015 is exact, and the width of everything else.

use llsr_intervals::{Interval, IntervalSlices, IntervalVec3};
use llsr_testkit::intervals::Dyadic;
use proptest::prelude::*;

fn i(lo: f64, hi: f64) -> Interval<f64> {
    Interval::new(lo, hi).expect("ends in order")
}

const INF: f64 = f64::INFINITY;

#[test]
fn constructor_refuses_what_is_no_interval() {
    assert_eq!(Interval::new(2.0, 1.0), None, "ends out of order");
    assert_eq!(Interval::new(f64::NAN, 1.0), None, "NaN end");
    assert_eq!(Interval::new(INF, INF), None, "no real number is infinite");
    assert!(Interval::point(f64::NAN).is_empty(), "NaN is no number");
    assert!(Interval::point(-INF).is_empty(), "infinity is no number");
    assert!(
        !i(0.0, INF).contains(INF),
        "an unbounded interval holds no infinity"
    );
}

#[test]
fn division_by_zero_follows_the_standard() {
    let zero = Interval::ZERO;
    assert!((i(1.0, 2.0) / zero).is_empty(), "no divisor");
    assert!((zero / zero).is_empty(), "no divisor, even of zero");
    assert_eq!(zero / i(-1.0, 1.0), zero, "zero over anything else");
    assert!((i(1.0, 2.0) / i(-1.0, 1.0)).is_entire(), "a pole inside");
    assert_eq!(
        i(-1.0, 2.0) / i(0.0, 4.0),
        Interval::ENTIRE,
        "a pole at the end, both signs"
    );
    let right = i(1.0, 2.0) / i(0.0, 4.0);
    assert!(
        right.hi() == INF && right.lo() <= 0.25 && right.lo() > 0.2499,
        "a pole at the end"
    );
    let left = i(1.0, 2.0) / i(-4.0, 0.0);
    assert!(
        left.lo() == -INF && left.hi() >= -0.25 && left.hi() < -0.2499,
        "a pole at the upper end"
    );
    assert_eq!(
        i(1.0, 1.0) / i(1.0, INF),
        i(0.0, 1f64.next_up()),
        "an unbounded divisor"
    );
    assert_eq!(
        i(1.0, INF).recip(),
        i(0.0, 1f64.next_up()),
        "reciprocals of large numbers"
    );
}

#[test]
fn zero_times_unbounded_is_zero() {
    assert_eq!(
        Interval::<f64>::ZERO * Interval::ENTIRE,
        Interval::ZERO,
        "zero is exact"
    );
    assert_eq!(i(0.0, 1.0) * i(2.0, INF), i(0.0, INF), "from zero up");
    assert_eq!(
        Interval::ZERO.mul_add(Interval::ENTIRE, i(1.0, 2.0)),
        i(1.0, 2.0),
        "only the addend"
    );
}

#[test]
fn exact_sums_stay_points_and_overflow_stays_finite() {
    assert!((i(1.0, 1.0) + i(2.0, 2.0)).is_point(), "1 + 2 has no error");
    assert!(!(i(1.0, 1.0) + i(1e-20, 1e-20)).is_point(), "1 + 1e-20 has one");
    assert_eq!(
        i(f64::MAX, f64::MAX) + i(f64::MAX, f64::MAX),
        i(f64::MAX, INF),
        "beyond the largest"
    );
    assert_eq!(i(-f64::MAX, f64::MAX).width(), INF, "the width overflows upwards");
}

#[test]
fn roots_squares_and_sets() {
    assert!(i(-2.0, -1.0).sqrt().is_empty(), "no real root");
    assert_eq!(i(-2.0, 0.0).sqrt(), Interval::ZERO, "only zero has one");
    assert!(i(-1.0, 2.0).sqr().lo() == 0.0, "squares are not negative");
    assert_eq!(i(-3.0, 2.0).abs(), i(0.0, 3.0), "absolute values");
    assert!(i(0.0, 1.0).intersection(i(2.0, 3.0)).is_empty(), "disjoint");
    assert_eq!(i(0.0, 1.0).hull(Interval::EMPTY), i(0.0, 1.0), "nothing added");
    assert!(
        (Interval::EMPTY + i(0.0, 1.0)).is_empty(),
        "nothing plus something"
    );
    assert_eq!(
        Interval::<f64>::ENTIRE.midpoint(),
        Some(0.0),
        "middle of everything"
    );
    assert_eq!(
        i(f64::MAX, f64::MAX).midpoint(),
        Some(f64::MAX),
        "the middle does not overflow"
    );
    assert_eq!(Interval::<f64>::EMPTY.midpoint(), None, "nothing has no middle");
}

#[test]
fn comparison_speaks_of_all_or_some() {
    let (low, high) = (i(0.0, 2.0), i(1.0, 3.0));
    assert!(low.possibly_lt(high) && !low.certainly_lt(high), "they overlap");
    assert!(
        i(0.0, 1.0).certainly_le(high) && !i(0.0, 1.0).certainly_lt(high),
        "they touch"
    );
    assert!(Interval::<f64>::EMPTY.certainly_lt(low), "all numbers of nothing");
    assert!(!Interval::<f64>::EMPTY.possibly_lt(low), "no number of nothing");
}

#[test]
fn unbounded_and_empty_boxes_have_dot_products() {
    let wide = IntervalVec3::new(Interval::ENTIRE, i(1.0, 1.0), i(1.0, 1.0));
    let unit = IntervalVec3::point(1.0, 0.0, 0.0);
    assert!(wide.dot(&unit).is_entire(), "unbounded");
    assert!(IntervalVec3::EMPTY.dot(&unit).is_empty(), "nothing");
    let huge = IntervalVec3::point(f64::MAX, f64::MAX, 0.0);
    assert!(huge.dot(&huge).is_entire(), "overflow");
    assert!(huge.cross(&wide).x.is_entire(), "overflow in a cross product");
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::num::f64::NORMAL,
        -10.0..10.0f64,
        (-8i32..9).prop_map(f64::from),
        Just(0.0)
    ]
}

fn interval() -> impl Strategy<Value = Interval<f64>> {
    (number(), number()).prop_map(|(x, y)| Interval::of([x, y]))
}

/// `end` is at most one number below the largest number that is not above `exact`.
fn close_below(end: f64, exact: &Dyadic) -> bool {
    Dyadic::new(end.next_up().next_up()).is_none_or(|above| above > *exact)
}

fn exact(x: f64) -> Dyadic {
    Dyadic::new(x).expect("finite")
}

proptest! {
    #[test]
    fn sums_and_products_are_one_step_wider_at_most(a in interval(), b in interval(), c in interval()) {
        let sum = &exact(a.lo()) + &exact(b.lo());
        prop_assert!(close_below((a + b).lo(), &sum), "{a:?} + {b:?}");
        let corners = |f: &dyn Fn(f64, f64) -> Dyadic| {
            [(a.lo(), b.lo()), (a.lo(), b.hi()), (a.hi(), b.lo()), (a.hi(), b.hi())]
                .map(|(x, y)| f(x, y)).into_iter().min().expect("four corners")
        };
        let product = corners(&|x, y| &exact(x) * &exact(y));
        prop_assert!(close_below((a * b).lo(), &product), "{a:?} * {b:?}");
        let fused = corners(&|x, y| &(&exact(x) * &exact(y)) + &exact(c.lo()));
        prop_assert!(close_below(a.mul_add(b, c).lo(), &fused), "{a:?} * {b:?} + {c:?}");
        let square = exact(a.mignitude());
        prop_assert!(close_below(a.sqr().lo(), &(&square * &square)), "{a:?} squared");
    }

    #[test]
    fn quotients_and_roots_are_one_step_wider_at_most(x in number(), y in number()) {
        let (a, b) = (Interval::point(x), Interval::point(y));
        if y > 0.0 {
            // Beyond the largest number any end is close enough.
            let end = Dyadic::new((a / b).lo().next_up().next_up());
            prop_assert!(end.is_none_or(|end| &end * &exact(y) > exact(x)), "{x} / {y}");
        }
        if x > 0.0 {
            let end = exact(a.sqrt().lo().next_up().next_up());
            prop_assert!(&end * &end > exact(x), "root of {x}");
        }
    }

    #[test]
    fn dot_products_are_as_narrow_as_promised(v in prop::array::uniform6(-1e3..1e3f64)) {
        let a = IntervalVec3::point(v[0], v[1], v[2]);
        let b = IntervalVec3::point(v[3], v[4], v[5]);
        let magnitude = (v[0] * v[3]).abs() + (v[1] * v[4]).abs() + (v[2] * v[5]).abs();
        let allowed = 12.0 * 0.5 * f64::EPSILON * magnitude + 1e-300;
        prop_assert!(a.dot(&b).width() <= allowed, "{:?}", a.dot(&b));
    }

    #[test]
    fn slices_give_the_bits_of_single_boxes(
        ends in prop::collection::vec(prop::array::uniform6(-1e3..1e3f32), 0..70),
        v in prop::array::uniform6(-1e3..1e3f32),
    ) {
        let range = |x: f32, y: f32| Interval::of([x, y]);
        let vector = |e: &[f32; 6]| IntervalVec3::new(range(e[0], e[1]), range(e[2], e[3]), range(e[4], e[5]));
        let boxes: Vec<_> = ends.iter().map(vector).collect();
        let column = |f: &dyn Fn(&IntervalVec3<f32>) -> f32| boxes.iter().map(f).collect::<Vec<f32>>();
        let lo = [column(&|b| b.x.lo()), column(&|b| b.y.lo()), column(&|b| b.z.lo())];
        let hi = [column(&|b| b.x.hi()), column(&|b| b.y.hi()), column(&|b| b.z.hi())];
        let slices = IntervalSlices::new(lo.each_ref().map(Vec::as_slice), hi.each_ref().map(Vec::as_slice));
        let (mut low, mut high) = (vec![0.0; boxes.len()], vec![0.0; boxes.len()]);
        slices.dot_into(&vector(&v), &mut low, &mut high);
        for (k, b) in boxes.iter().enumerate() {
            let single = b.dot(&vector(&v));
            prop_assert_eq!((single.lo(), single.hi()), (low[k], high[k]), "box {}", k);
        }
    }
}
