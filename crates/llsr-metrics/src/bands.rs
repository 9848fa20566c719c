//! Work on bands of rows, one after the other or, with the feature `rayon`, in parallel with the same bits.

/// Calls `work(scratch, first_row, rows)` for every band of `band` rows of `out`, whose rows hold `width`
/// values; `scratch` comes from `init` and is reused for the bands of one thread.
///
/// What `work` writes must depend on its band alone, not on what the scratch holds.
#[cfg(not(feature = "rayon"))]
pub(crate) fn for_each<T, S>(
    out: &mut [T],
    width: usize,
    band: usize,
    init: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, usize, &mut [T]) + Sync,
) {
    let mut scratch = init();
    for (i, rows) in out.chunks_mut(width * band).enumerate() {
        work(&mut scratch, i * band, rows);
    }
}

/// Calls `work(scratch, first_row, rows)` for every band of `band` rows of `out`, whose rows hold `width`
/// values; `scratch` comes from `init` and is reused for some of the bands of one thread.
///
/// What `work` writes must depend on its band alone, not on what the scratch holds.
#[cfg(feature = "rayon")]
pub(crate) fn for_each<T: Send, S>(
    out: &mut [T],
    width: usize,
    band: usize,
    init: impl Fn() -> S + Sync + Send,
    work: impl Fn(&mut S, usize, &mut [T]) + Sync + Send,
) {
    use rayon::prelude::*;
    out.par_chunks_mut(width * band)
        .enumerate()
        .for_each_init(init, |scratch, (i, rows)| work(scratch, i * band, rows));
}
