//! When records are made that a move has put in doubt, or that are missing while things move.

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};

/// When records that a move may concern are made anew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Renewal {
    /// Before they are next used. Points depend on the scene, the settings, the seed and the moves alone, so that frames in lockstep
    /// are the same to the bit for any number of threads; the first points after a light has moved wait for all records that they ask,
    /// a second or more.
    #[default]
    AtOnce,
    /// Little by little, for displays that do not wait. Direct light is always that of now. Light by way of other surfaces is taken
    /// from records of before the move at first, and each point that is shaded pays for a few rays of new ones; points whose records
    /// are not all of now say so ([`ShadedPoint::provisional`](crate::ShadedPoint::provisional)). Once nothing moves, the same
    /// points shaded again and again come to what a shader that never saw a move says, to the bit. Until
    /// then they depend on the order of work, and so on threads and time.
    Gradual,
}

/// Rays that the first points after a move pay for: about what such a point costs itself.
const FIRST: u64 = 12;
/// So many points after a move they pay for one more, up to this many: records are renewed faster when nothing moves, but points keep
/// a sixth of the time.
const FASTER: u64 = 256;
const MOST: u64 = 60;
/// Points after a move from which on the scene is at rest: records that are missing are made at once.
const REST: u64 = 4096;
/// Records that may be paid for in advance.
const SAVED: i64 = 6;

/// What a record is needed for, the more urgent the smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Need {
    /// There is none.
    Missing,
    /// It was made before a move.
    Old,
    /// It was made since, but of others that were not.
    Incomplete,
}

impl Need {
    /// Records' worth of rays that must be there.
    fn reserve(self) -> i64 {
        match self {
            Self::Missing => 0,
            Self::Old => 1,
            Self::Incomplete => SAVED - 2,
        }
    }
}

/// Rays that have been paid for and not been used. Shared by all threads; none of it needs to be exact.
#[derive(Debug)]
pub(crate) struct Purse {
    /// Points shaded since the last move.
    points: AtomicU64,
    /// Rays for records of one kind; below zero after one was made in advance.
    rays: [AtomicI64; 2],
    /// What one of each kind costs.
    costs: [i64; 2],
}

impl Purse {
    /// `costs` are the rays of a record for points and one for rays from afar.
    pub(crate) fn new(costs: [u32; 2]) -> Self {
        Self {
            // Nothing has moved yet.
            points: AtomicU64::new(REST),
            rays: Default::default(),
            costs: costs.map(|cost| i64::from(cost.max(1))),
        }
    }

    /// Something has moved.
    pub(crate) fn moved(&self) {
        self.points.store(0, Ordering::Relaxed);
    }

    /// Has nothing moved for long?
    pub(crate) fn at_rest(&self) -> bool {
        self.points.load(Ordering::Relaxed) >= REST
    }

    /// A point pays. Half goes to records of each kind.
    pub(crate) fn pay(&self) {
        let points = self.points.fetch_add(1, Ordering::Relaxed);
        let rays = (FIRST + points / FASTER).min(MOST).div_ceil(2) as i64;
        for (account, cost) in self.rays.iter().zip(self.costs) {
            if account.load(Ordering::Relaxed) < SAVED * cost {
                account.fetch_add(rays, Ordering::Relaxed);
            }
        }
    }

    /// Takes what a record costs, if there is enough; of the kind for rays from afar or the other.
    pub(crate) fn spend(&self, far: bool, need: Need) -> bool {
        let (account, cost) = (&self.rays[usize::from(far)], self.costs[usize::from(far)]);
        if account.load(Ordering::Relaxed) <= need.reserve() * cost {
            return false;
        }
        account.fetch_sub(cost, Ordering::Relaxed);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points until `need` can be paid once, and then for the next 20 times on average.
    fn points_for(purse: &Purse, far: bool, need: Need) -> (u32, f64) {
        let wait = || {
            (1..).find(|_| {
                purse.pay();
                purse.spend(far, need)
            })
        };
        let first = wait().unwrap_or(0);
        (
            first,
            (0..20).map(|_| f64::from(wait().unwrap_or(0))).sum::<f64>() / 20.0,
        )
    }

    #[test]
    fn each_point_pays_for_a_few_rays() {
        let purse = Purse::new([600, 120]);
        assert!(purse.at_rest(), "nothing has moved");
        purse.moved();
        assert!(!purse.at_rest());
        let (first, then) = points_for(&purse, true, Need::Missing);
        assert_eq!(first, 1, "one is made in advance");
        assert!(then > 17.0 && then < 20.1, "120 rays at 6 to 7 a point: {then}");
        let (first, then) = points_for(&purse, false, Need::Old);
        assert!(first < 40, "paid for meanwhile: {first}");
        assert!(then > 60.0 && then < 100.0, "600 rays at 6 to 9 a point: {then}");
    }

    #[test]
    fn what_is_urgent_goes_first_and_nothing_piles_up() {
        let purse = Purse::new([600, 600]);
        purse.moved();
        for _ in 0..REST {
            purse.pay();
        }
        assert!(purse.at_rest());
        let spent = |need| (0..20).filter(|_| purse.spend(false, need)).count();
        assert_eq!(spent(Need::Incomplete), 3, "what lies beyond the reserve");
        assert_eq!(spent(Need::Old), 3);
        assert_eq!(spent(Need::Missing), 1);
        assert!(
            points_for(&purse, false, Need::Old).1 < 45.0,
            "later points pay more"
        );
    }
}
