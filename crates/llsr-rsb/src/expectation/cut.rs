//! Random cut: mean square error in closed form, length of the bracket by its integral equation.

use std::f64::consts::PI;

/// Expected square of estimate minus `lambda` after `tests` cuts.
///
/// A cut at s maps the error on [0, s] or [s, 1] to the whole by a factor s or 1 - s. The map takes
/// a + b lambda (1 - lambda) to a / 3 + (a + b / 2) lambda (1 - lambda); the error without a cut is
/// (1/2 - lambda)^2 = 1/4 - lambda (1 - lambda).
pub(super) fn mean_square_error(tests: u32, lambda: f64) -> f64 {
    let (thirds, halves) = (3f64.powi(-(tests as i32)), 0.5f64.powi(tests as i32));
    0.25 * thirds * (1.0 - 2.0 * lambda).powi(2) + 0.5 * (halves - thirds) * lambda * (1.0 - lambda)
}

/// Panels [2^-(k+1), 2^-k], k = 1 .. PANELS, cover [2^-(PANELS+1), 1/2]; below, the length does not change.
const PANELS: usize = 52;
/// Chebyshev nodes a panel: the functions integrated are analytic but for 0 and 1, so the error falls by a
/// factor 5.8 a node.
const NODES: usize = 22;

/// Expected length after `tests` cuts of the bracket that holds `lambda`.
///
/// The length l_n is a symmetric function of lambda and follows from l_(n-1) by
/// l_n(x) = x^2 (integral from x to 1 of l u^-3 du) + (1-x)^2 (integral from 0 to x of l (1-u)^-3 du).
pub(super) fn expected_length(tests: u32, lambda: f64) -> f64 {
    let x = lambda.min(1.0 - lambda);
    let lowest = 0.5f64.powi(PANELS as i32 + 1);
    if x <= lowest {
        return 0.5f64.powi(tests as i32);
    }
    let rule = Rule::new();
    let mut length = [[1.0; NODES]; PANELS];
    for _ in 0..tests {
        length = cut_once(&rule, &length);
    }
    let panel = ((-x.log2()).floor() as usize).clamp(1, PANELS) - 1;
    let left = 0.5f64.powi(panel as i32 + 2);
    rule.interpolate(&length[panel], 2.0 * (x - left) / left - 1.0)
}

/// One application of the integral equation.
fn cut_once(rule: &Rule, length: &[[f64; NODES]; PANELS]) -> [[f64; NODES]; PANELS] {
    let mut next = [[0.0; NODES]; PANELS];
    // Upwards: the integral of l (1-u)^-3 from 0 to each node. Below the lowest panel l (1-u)^-3 is constant.
    let mut below = length[PANELS - 1][NODES - 1] * 0.5f64.powi(PANELS as i32 + 1);
    for panel in (0..PANELS).rev() {
        let (nodes, half) = rule.nodes_of(panel);
        let mut weighted = [0.0; NODES];
        for i in 0..NODES {
            weighted[i] = length[panel][i] * (1.0 - nodes[i]).powi(-3) * half;
        }
        for i in 0..NODES {
            next[panel][i] = (1.0 - nodes[i]).powi(2) * (below + rule.up_to(i, &weighted));
        }
        below += rule.whole(&weighted);
    }
    // Downwards: the integral of l u^-3 from each node to 1. From 1/2 to 1 it mirrors what was just summed.
    let mut above = below;
    for panel in 0..PANELS {
        let (nodes, half) = rule.nodes_of(panel);
        let mut weighted = [0.0; NODES];
        for i in 0..NODES {
            weighted[i] = length[panel][i] * nodes[i].powi(-3) * half;
        }
        let whole = rule.whole(&weighted);
        for i in 0..NODES {
            next[panel][i] += nodes[i].powi(2) * (above + (whole - rule.up_to(i, &weighted)));
        }
        above += whole;
    }
    next
}

/// Integration and interpolation on the Chebyshev nodes of [-1, 1].
struct Rule {
    /// Nodes, descending.
    nodes: [f64; NODES],
    /// Row i integrates from -1 to node i.
    cumulative: [[f64; NODES]; NODES],
    /// Integrates from -1 to 1.
    full: [f64; NODES],
}

impl Rule {
    fn new() -> Self {
        let angle = |i: usize| (i as f64 + 0.5) * PI / NODES as f64;
        let mut rule = Self {
            nodes: std::array::from_fn(|i| angle(i).cos()),
            cumulative: [[0.0; NODES]; NODES],
            full: [0.0; NODES],
        };
        for j in 0..NODES {
            // The interpolant through 1 at node j and 0 at the others is a sum of Chebyshev polynomials.
            let coefficient = |k: usize| {
                let scale = if k == 0 { 1.0 } else { 2.0 };
                scale / NODES as f64 * (k as f64 * angle(j)).cos()
            };
            for i in 0..NODES {
                rule.cumulative[i][j] = (0..NODES).map(|k| coefficient(k) * primitive(k, angle(i))).sum();
            }
            rule.full[j] = (0..NODES).map(|k| coefficient(k) * primitive(k, 0.0)).sum();
        }
        rule
    }

    /// The nodes of a panel and half its width.
    fn nodes_of(&self, panel: usize) -> ([f64; NODES], f64) {
        let half = 0.5f64.powi(panel as i32 + 3);
        (self.nodes.map(|x| (3.0 + x) * half), half)
    }

    fn up_to(&self, i: usize, values: &[f64; NODES]) -> f64 {
        dot(&self.cumulative[i], values)
    }

    fn whole(&self, values: &[f64; NODES]) -> f64 {
        dot(&self.full, values)
    }

    /// The polynomial through `values` at `x` in [-1, 1] (barycentric form).
    fn interpolate(&self, values: &[f64; NODES], x: f64) -> f64 {
        let (mut above, mut below) = (0.0, 0.0);
        for (i, (&node, &value)) in self.nodes.iter().zip(values).enumerate() {
            if x == node {
                return value;
            }
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            let weight = sign * ((i as f64 + 0.5) * PI / NODES as f64).sin() / (x - node);
            above += weight * value;
            below += weight;
        }
        above / below
    }
}

/// The integral of the Chebyshev polynomial of degree `k` from -1 to the cosine of `angle`.
fn primitive(k: usize, angle: f64) -> f64 {
    let degree = k as f64;
    let antiderivative = |angle: f64| match k {
        0 => angle.cos(),
        1 => 0.25 * (2.0 * angle).cos(),
        _ => {
            0.5 * (((degree + 1.0) * angle).cos() / (degree + 1.0)
                - ((degree - 1.0) * angle).cos() / (degree - 1.0))
        }
    };
    antiderivative(angle) - antiderivative(PI)
}

fn dot(a: &[f64; NODES], b: &[f64; NODES]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
