//! Pictures that both the tests and an evaluator in another language can make to the last bit, and a slow FLIP.

/// Pixels of `width` x `height` by formula.
pub(crate) fn picture(
    width: usize,
    height: usize,
    pixel: impl Fn(usize, usize) -> [f32; 3],
) -> Vec<[f32; 3]> {
    (0..width * height).map(|i| pixel(i % width, i / width)).collect()
}

/// Busy detail at all scales: multiples of 1/64 below 1.
pub(crate) fn busy(width: usize, height: usize, seed: usize) -> Vec<[f32; 3]> {
    picture(width, height, |x, y| {
        [0, 1, 2].map(|c| ((x * x * 3 + y * 7 + x * y * seed + c * 53 + seed * 29) % 64) as f32 / 64.0)
    })
}

/// One slanted edge between two warm greys.
pub(crate) fn step(width: usize, height: usize, offset: usize) -> Vec<[f32; 3]> {
    picture(width, height, |x, y| {
        let v = if 2 * x + y < offset { 0.125 } else { 0.75 };
        [v, 0.5 * v, 0.25 * v]
    })
}

/// FLIP written down from the paper with two-dimensional filters in f64, no step shared with the crate.
pub(crate) fn slow_flip(width: usize, height: usize, a: &[[f32; 3]], b: &[[f32; 3]], ppd: f64) -> Vec<f64> {
    let clamped = |i: isize, n: usize| i.clamp(0, n as isize - 1) as usize;
    let filter = |plane: &dyn Fn(usize) -> f64, radius: isize, kernel: &dyn Fn(f64, f64) -> f64, i: usize| {
        let (x, y) = ((i % width) as isize, (i / width) as isize);
        let (mut sum, mut positive, mut negative) = (0.0, 0.0, 0.0);
        let mut terms = Vec::new();
        for dy in -radius..=radius {
            for dx in -radius..=radius {
                let k = kernel(dx as f64, dy as f64);
                if k > 0.0 {
                    positive += k
                } else {
                    negative -= k
                }
                terms.push((k, plane(clamped(y + dy, height) * width + clamped(x + dx, width))));
            }
        }
        for (k, value) in terms {
            sum += value * if k > 0.0 { k / positive } else { k / negative };
        }
        sum
    };
    // IEC 61966-2-1, printed matrix; white is its row sums.
    const M: [[f64; 3]; 3] = [
        [0.4123908, 0.3575843, 0.1804808],
        [0.2126390, 0.7151687, 0.0721923],
        [0.0193308, 0.1191948, 0.9505322],
    ];
    let white = M.map(|row| row.iter().sum::<f64>());
    let xyz = |p: [f64; 3]| [0, 1, 2].map(|r| (M[r][0] * p[0] + M[r][1] * p[1] + M[r][2] * p[2]) / white[r]);
    let to_opponent = |p: [f64; 3]| {
        let [x, y, z] = xyz(p);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    };
    // Inverts by Cramer's rule.
    let to_rgb = |n: [f64; 3]| {
        let v = [n[0] * white[0], n[1] * white[1], n[2] * white[2]];
        let det = |m: [[f64; 3]; 3]| {
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
                - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
                + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        };
        [0, 1, 2].map(|c| {
            let mut m = M;
            for r in 0..3 {
                m[r][c] = v[r];
            }
            (det(m) / det(M)).clamp(0.0, 1.0)
        })
    };
    let lab = |p: [f64; 3]| {
        let f = xyz(p).map(|t| {
            if t > 216.0 / 24389.0 {
                t.powf(1.0 / 3.0)
            } else {
                t * 841.0 / 108.0 + 4.0 / 29.0
            }
        });
        let l = 116.0 * f[1] - 16.0;
        [
            l,
            0.01 * l * 500.0 * (f[0] - f[1]),
            0.01 * l * 200.0 * (f[1] - f[2]),
        ]
    };
    let hyab = |p: [f64; 3], q: [f64; 3]| (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2]);
    let largest = hyab(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0])).powf(0.7);

    let pi2 = std::f64::consts::PI.powi(2);
    let sensitivity = |terms: [(f64, f64); 2]| {
        move |dx: f64, dy: f64| {
            let d2 = (dx * dx + dy * dy) / (ppd * ppd);
            let term = |(a, b): (f64, f64)| a * (pi2.sqrt() / b).sqrt() * (-pi2 * d2 / b).exp();
            term(terms[0]) + term(terms[1])
        }
    };
    let radius = (3.0 * (0.04 / (2.0 * pi2)).sqrt() * ppd).ceil() as isize;
    let sigma = 0.5 * 0.082 * ppd;
    let feature_radius = (3.0 * sigma).ceil() as isize;
    let bell = |dx: f64, dy: f64| (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp();

    let analyse = |pixels: &[[f32; 3]]| -> Vec<([f64; 3], f64, f64)> {
        let opponent: Vec<[f64; 3]> = pixels
            .iter()
            .map(|p| to_opponent(p.map(|v| f64::from(v).clamp(0.0, 1.0))))
            .collect();
        (0..pixels.len())
            .map(|i| {
                let y = |j: usize| opponent[j][0];
                let (cx, cz) = (|j: usize| opponent[j][1], |j: usize| opponent[j][2]);
                let seen = [
                    filter(&y, radius, &sensitivity([(1.0, 0.0047), (0.0, 1e-5)]), i),
                    filter(&cx, radius, &sensitivity([(1.0, 0.0053), (0.0, 1e-5)]), i),
                    filter(&cz, radius, &sensitivity([(34.1, 0.04), (13.5, 0.025)]), i),
                ];
                let luminance = |j: usize| (opponent[j][0] + 16.0) / 116.0;
                let detect = |kernel: &dyn Fn(f64, f64) -> f64| {
                    let across = filter(&luminance, feature_radius, kernel, i);
                    across.hypot(filter(&luminance, feature_radius, &|dx, dy| kernel(dy, dx), i))
                };
                let edge = detect(&|dx, dy| -dx * bell(dx, dy));
                let point = detect(&|dx, dy| (dx * dx / (sigma * sigma) - 1.0) * bell(dx, dy));
                let ly = (seen[0] + 16.0) / 116.0;
                (
                    lab(to_rgb([ly + seen[1] / 500.0, ly, ly - seen[2] / 200.0])),
                    edge,
                    point,
                )
            })
            .collect()
    };
    let pairs = analyse(a).into_iter().zip(analyse(b));
    pairs
        .map(|((lab_a, edge_a, point_a), (lab_b, edge_b, point_b))| {
            let d = hyab(lab_a, lab_b).powf(0.7);
            let knee = 0.4 * largest;
            let colour = if d < knee {
                0.95 * d / knee
            } else {
                0.95 + 0.05 * (d - knee) / (largest - knee)
            };
            let feature = ((edge_a - edge_b).abs().max((point_a - point_b).abs()) / 2f64.sqrt()).sqrt();
            colour.powf(1.0 - feature)
        })
        .collect()
}
