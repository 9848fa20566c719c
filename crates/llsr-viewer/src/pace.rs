//! How fast frames come, and how many samples to ask for.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use llsr_epr::StageTimes;

/// Frames that count.
const FRAMES: usize = 60;
/// Requests may wait about that long (s), or so many frames if that is longer: beyond it they belong to a view that is gone.
const WAIT: f64 = 0.1;
const WAIT_FRAMES: f64 = 2.0;
/// Requests that may wait however slow the shader is.
const LEAST_WAITING: usize = 64;

/// Times of the last frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameTimes {
    ends: VecDeque<Instant>,
    busy: VecDeque<f64>,
    stages: VecDeque<StageTimes>,
}

impl FrameTimes {
    /// A frame ended at `end` and took the display thread `ms` milliseconds, its stages what `stages` says.
    pub(crate) fn push(&mut self, end: Instant, ms: f64, stages: StageTimes) {
        if self.ends.len() == FRAMES {
            self.ends.pop_front();
            self.busy.pop_front();
            self.stages.pop_front();
        }
        self.ends.push_back(end);
        self.busy.push_back(ms);
        self.stages.push_back(stages);
    }

    /// Frames a second over the last ones.
    pub(crate) fn per_second(&self) -> f64 {
        match (self.ends.front(), self.ends.back()) {
            (Some(&first), Some(&last)) if last > first => {
                (self.ends.len() - 1) as f64 / (last - first).as_secs_f64()
            }
            _ => 0.0,
        }
    }

    /// Seconds between the last frames.
    pub(crate) fn interval(&self) -> f64 {
        let rate = self.per_second();
        if rate > 0.0 { rate.recip() } else { 0.0 }
    }

    /// Median time of the display thread (ms).
    pub(crate) fn median_ms(&self) -> f64 {
        median(self.busy.iter().copied())
    }

    /// Median time of one stage (ms): times of a single frame jump too much to be read.
    pub(crate) fn stage_ms(&self, stage: impl Fn(&StageTimes) -> f64) -> f64 {
        median(self.stages.iter().map(stage))
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Watches how many samples come back, so that no more are asked for than will.
#[derive(Clone, Debug, Default)]
pub(crate) struct Budget {
    last: Option<(Instant, u64)>,
    /// Points a second.
    rate: f64,
}

impl Budget {
    /// `shaded` points have come back altogether by `now`.
    pub(crate) fn watch(&mut self, now: Instant, shaded: u64) {
        let Some((then, before)) = self.last else {
            self.last = Some((now, shaded));
            return;
        };
        let elapsed = now - then;
        if elapsed >= Duration::from_millis(100) {
            let rate = shaded.saturating_sub(before) as f64 / elapsed.as_secs_f64();
            self.rate = if self.rate == 0.0 {
                rate
            } else {
                0.5 * (self.rate + rate)
            };
            self.last = Some((now, shaded));
        }
    }

    /// Points a second.
    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// How many to ask for if at most `samples` are wanted, `waiting` wait already, and frames are `interval` seconds apart.
    pub(crate) fn ask(&self, samples: usize, waiting: usize, interval: f64) -> usize {
        // As long as nothing is known, what is wanted.
        let mut room = if self.rate > 0.0 {
            (self.rate * WAIT.max(WAIT_FRAMES * interval)) as usize
        } else {
            samples
        };
        if waiting == 0 {
            // The shader had nothing to do: it may be faster than it seems.
            room *= 2;
        }
        samples.min(room.max(LEAST_WAITING).saturating_sub(waiting))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_the_last_frames() {
        let mut times = FrameTimes::default();
        let start = Instant::now();
        for i in 0..200u32 {
            // Slow at first, then 50 a second.
            let at = if i < 100 { 100 * i } else { 10_000 + 20 * (i - 100) };
            times.push(
                start + Duration::from_millis(u64::from(at)),
                if i % 3 == 0 { 50.0 } else { 4.0 },
                StageTimes {
                    reach: if i % 4 == 0 { 9.0 } else { 0.25 },
                    ..StageTimes::default()
                },
            );
        }
        assert!((times.per_second() - 50.0).abs() < 1e-6, "{}", times.per_second());
        assert!((times.median_ms() - 4.0).abs() < 1e-12, "{}", times.median_ms());
        assert!(
            (times.stage_ms(|ms| ms.reach) - 0.25).abs() < 1e-12,
            "one in four is slow"
        );
    }

    #[test]
    fn a_slow_shader_is_asked_for_what_it_can_do() {
        let mut budget = Budget::default();
        let start = Instant::now();
        assert_eq!(budget.ask(4000, 0, 0.02), 4000, "nothing is known yet");
        for i in 0..40u64 {
            // 2000 a second.
            budget.watch(start + Duration::from_millis(50 * i), 100 * i);
        }
        assert!((budget.rate() - 2000.0).abs() < 1.0, "{}", budget.rate());
        assert_eq!(
            budget.ask(4000, 1, 0.02),
            199,
            "a tenth of a second's worth, less what waits"
        );
        assert_eq!(budget.ask(4000, 150, 0.02), 50, "less what waits");
        assert_eq!(budget.ask(4000, 500, 0.02), 0, "enough waits");
        assert_eq!(budget.ask(10, 1, 0.02), 10, "not more than wanted");
        assert_eq!(budget.ask(4000, 1, 0.2), 799, "two slow frames' worth");
    }

    #[test]
    fn a_fast_shader_beside_a_slow_display_is_kept_busy() {
        // A display of five frames a second, a shader of 10,000 points a second that was slow once.
        let mut budget = Budget::default();
        let start = Instant::now();
        let mut shaded = 0;
        budget.watch(start, 0);
        for frame in 1..=100u64 {
            let asked = budget.ask(4000, 0, 0.2);
            shaded += if frame < 10 { 10 } else { asked.min(2000) as u64 };
            budget.watch(start + Duration::from_millis(200 * frame), shaded);
        }
        assert!(budget.rate() > 9000.0, "{} points a second", budget.rate());
    }

    #[test]
    fn a_shader_that_stalls_is_still_asked() {
        let mut budget = Budget::default();
        let start = Instant::now();
        for i in 0..200u64 {
            budget.watch(start + Duration::from_millis(100 * i), 500.min(100 * i));
        }
        assert!(budget.ask(4000, 0, 0.02) >= LEAST_WAITING, "a few");
    }
}
