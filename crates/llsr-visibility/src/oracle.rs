//! The yes/no oracle and a wrapper that counts its calls.

/// Answers whether the point at parameter `t` of a light is visible.
///
/// `t` is a light parameter in [0, 1]. Answers must be repeatable: the same `t` gives the same answer as long
/// as the point being shaded does not change. Closures `FnMut(f64) -> bool` are oracles.
pub trait Visibility {
    /// Is the point at `t` visible?
    fn visible(&mut self, t: f64) -> bool;

    /// Answers for every `t` of `ts`, into the same place of `answers`.
    ///
    /// The default asks one by one. A ray tracer overrides it where a packet of rays is cheaper; the answers
    /// must be those of [`visible`](Self::visible).
    ///
    /// # Panics
    /// If the slices differ in length.
    fn visible_each(&mut self, ts: &[f64], answers: &mut [bool]) {
        assert_eq!(ts.len(), answers.len(), "one answer per question");
        for (answer, &t) in answers.iter_mut().zip(ts) {
            *answer = self.visible(t);
        }
    }
}

impl<F: FnMut(f64) -> bool> Visibility for F {
    fn visible(&mut self, t: f64) -> bool {
        self(t)
    }
}

/// A borrowed oracle is an oracle, so that a wrapper can be put round it for a while.
///
/// A type of its own because `&mut V` may already be an oracle, for being a closure.
///
/// ```
/// use llsr_visibility::{ByRef, Counting, Visibility};
///
/// fn search(oracle: &mut impl Visibility) -> u32 {
///     let mut counting = Counting::new(ByRef(oracle));
///     counting.visible(0.5);
///     counting.tests()
/// }
/// assert_eq!(search(&mut |t: f64| t < 0.3), 1);
/// ```
#[derive(Debug)]
pub struct ByRef<'a, V: ?Sized>(pub &'a mut V);

impl<V: Visibility + ?Sized> Visibility for ByRef<'_, V> {
    fn visible(&mut self, t: f64) -> bool {
        self.0.visible(t)
    }

    fn visible_each(&mut self, ts: &[f64], answers: &mut [bool]) {
        self.0.visible_each(ts, answers);
    }
}

/// Wraps an oracle and counts the tests that it answers.
#[derive(Clone, Debug)]
pub struct Counting<V> {
    oracle: V,
    tests: u32,
}

impl<V: Visibility> Counting<V> {
    /// Wraps `oracle` with a count of zero.
    pub fn new(oracle: V) -> Self {
        Self { oracle, tests: 0 }
    }

    /// The number of points tested so far.
    pub fn tests(&self) -> u32 {
        self.tests
    }

    /// The wrapped oracle.
    pub fn inner(&self) -> &V {
        &self.oracle
    }

    /// Gives back the wrapped oracle.
    pub fn into_inner(self) -> V {
        self.oracle
    }
}

impl<V: Visibility> Visibility for Counting<V> {
    fn visible(&mut self, t: f64) -> bool {
        self.tests += 1;
        self.oracle.visible(t)
    }

    fn visible_each(&mut self, ts: &[f64], answers: &mut [bool]) {
        self.tests += ts.len() as u32;
        self.oracle.visible_each(ts, answers);
    }
}
