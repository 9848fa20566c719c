//! Bands of a picture on the threads of a pool.

/// Runs `work` on all bands, on the threads of the current rayon pool if there is more than one band, without allocating.
pub(crate) fn share<B: Send>(mut bands: impl Iterator<Item = B> + Send, work: &(impl Fn(B) + Sync)) {
    let Some(first) = bands.next() else { return };
    match bands.next() {
        None => work(first),
        Some(second) => {
            rayon::join(
                || work(first),
                || rayon::join(|| work(second), || share_rest(&mut bands, work)),
            );
        }
    }
}

/// The same for what an iterator still holds.
fn share_rest<B: Send>(bands: &mut (dyn Iterator<Item = B> + Send), work: &(impl Fn(B) + Sync)) {
    if let Some(band) = bands.next() {
        rayon::join(|| work(band), || share_rest(bands, work));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn every_band_runs_once() {
        for count in 0..7 {
            let sum = AtomicU32::new(0);
            super::share((0..count).map(|i| 1 << i), &|bit: u32| {
                sum.fetch_add(bit, Ordering::Relaxed);
            });
            assert_eq!(sum.into_inner(), (1 << count) - 1, "{count} bands");
        }
    }
}
