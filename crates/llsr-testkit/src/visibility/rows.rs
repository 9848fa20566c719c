//! Rows of pixels: what a search with coherence sees as it walks along an image.

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::Steps;

/// A row of neighbouring pixels under one light.
#[derive(Clone, Debug)]
pub struct Row {
    /// What casts the shadow.
    pub name: &'static str,
    /// The light as each pixel sees it, from left to right.
    pub pixels: Vec<Steps>,
}

/// `count` rows of 256 pixels of every kind, from a fixed seed.
///
/// Kinds: `lit`; `wall` (one change crosses the light); `post` (a blocker a tenth to a half of the light wide
/// crosses it); `slit` (the same, visible and hidden exchanged); `rail` (a wall's change and a blocker 0.05 to
/// 0.15 wide cross in opposite directions: three changes); `fence` (four blockers and gaps of about a tenth
/// cross); `wire` (a blocker a fiftieth wide crosses); `noise` (up to six changes anywhere, no coherence).
pub fn rows(count: usize) -> Vec<Row> {
    const WIDTH: usize = 256;
    type Kind = (
        &'static str,
        fn(&mut dyn FnMut() -> f64) -> Box<dyn FnMut(f64) -> Steps + '_>,
    );
    let kinds: [Kind; 8] = [
        ("lit", |_| Box::new(|_| Steps::behind(&[]))),
        ("wall", |random| {
            let penumbra = 0.2 + 0.8 * random();
            let start = (1.0 - penumbra) * random();
            Box::new(move |x| Steps::behind(&[[-1.0, (x - start) / penumbra]]))
        }),
        ("post", |random| {
            let (width, speed, start) = (0.1 + 0.4 * random(), 1.0 + 2.0 * random(), 0.5 * random());
            Box::new(move |x| {
                let lo = speed * (x - start) - width;
                Steps::behind(&[[lo, lo + width]])
            })
        }),
        ("slit", |random| {
            let (width, speed, start) = (0.1 + 0.4 * random(), 1.0 + 2.0 * random(), 0.5 * random());
            Box::new(move |x| {
                let lo = speed * (x - start) - width;
                Steps::behind(&[[-1.0, lo], [lo + width, 2.0]])
            })
        }),
        ("rail", |random| {
            let (width, speed) = (0.05 + 0.1 * random(), 0.5 + random());
            Box::new(move |x| {
                let rail = 0.9 - speed * x;
                Steps::behind(&[[-1.0, 0.6 * x], [rail, rail + width]])
            })
        }),
        ("fence", |random| {
            let (pitch, start) = (0.18 + 0.06 * random(), random());
            Box::new(move |x| {
                let at = |i: f64| pitch * (i + start) + 0.5 * x - 0.3;
                let posts = [0.0, 1.0, 2.0, 3.0].map(|i| [at(i), at(i + 0.5)]);
                Steps::behind(&posts)
            })
        }),
        ("wire", |random| {
            let speed = 1.0 + random();
            Box::new(move |x| {
                let lo = speed * x - 0.1;
                Steps::behind(&[[lo, lo + 0.02]])
            })
        }),
        ("noise", |random| {
            Box::new(move |_| {
                let count = (7.0 * random()) as usize;
                Steps::new(random() < 0.5, (0..count).map(|_| random()).collect::<Vec<_>>())
            })
        }),
    ];
    let mut rng = Pcg64Mcg::seed_from_u64(1999);
    let mut random = move || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let mut rows = Vec::new();
    for (name, kind) in kinds {
        for _ in 0..count {
            let mut pixel = kind(&mut random);
            let pixels = (0..WIDTH)
                .map(|i| pixel((i as f64 + 0.5) / WIDTH as f64))
                .collect();
            rows.push(Row { name, pixels });
        }
    }
    rows
}
