//! A memory for things that are functions of their keys.
//!
//! Whether something is remembered or worked out anew makes no difference to anyone but the clock: that is what makes
//! results independent of the order of work. Forgetting is therefore always allowed.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hash, RandomState};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Parts with a lock of their own; threads seldom meet in one.
const SHARDS: usize = 64;

/// A map from keys to values, with a limit.
#[derive(Debug)]
pub(crate) struct Memory<K, V> {
    shards: Vec<Mutex<Shard<K, V>>>,
    /// Only picks the shard.
    hasher: RandomState,
    /// Entries of one generation of a shard.
    limit: usize,
}

/// Two generations: when the young one is full it becomes the old one, and what was old and not asked for since is gone.
#[derive(Debug)]
struct Shard<K, V> {
    young: HashMap<K, Arc<V>>,
    old: HashMap<K, Arc<V>>,
}

impl<K: Copy + Eq + Hash, V> Memory<K, V> {
    /// Holds up to about `limit` values.
    pub(crate) fn new(limit: usize) -> Self {
        let shard = || {
            Mutex::new(Shard {
                young: HashMap::new(),
                old: HashMap::new(),
            })
        };
        Self {
            shards: (0..SHARDS).map(|_| shard()).collect(),
            hasher: RandomState::new(),
            limit: (limit / (2 * SHARDS)).max(1),
        }
    }

    fn shard(&self, key: &K) -> MutexGuard<'_, Shard<K, V>> {
        let shard = &self.shards[self.hasher.hash_one(key) as usize % SHARDS];
        shard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The value of a key, if it is remembered and `holds` says that it still holds.
    pub(crate) fn get(&self, key: &K, holds: impl FnOnce(&V) -> bool) -> Option<Arc<V>> {
        let value = {
            let mut shard = self.shard(key);
            if let Some(value) = shard.young.get(key) {
                Arc::clone(value)
            } else {
                let value = shard.old.remove(key)?;
                shard.insert(*key, Arc::clone(&value), self.limit);
                value
            }
        };
        holds(&value).then_some(value)
    }

    /// Remembers a value.
    pub(crate) fn put(&self, key: K, value: V) -> Arc<V> {
        let value = Arc::new(value);
        self.shard(&key).insert(key, Arc::clone(&value), self.limit);
        value
    }

    /// How many values are remembered.
    pub(crate) fn len(&self) -> usize {
        let count = |shard: &Mutex<Shard<K, V>>| {
            let shard = shard.lock().unwrap_or_else(PoisonError::into_inner);
            shard.young.len() + shard.old.len()
        };
        self.shards.iter().map(count).sum()
    }
}

impl<K: Copy + Eq + Hash, V> Shard<K, V> {
    fn insert(&mut self, key: K, value: Arc<V>, limit: usize) {
        if self.young.len() >= limit {
            self.old = std::mem::take(&mut self.young);
        }
        self.young.insert(key, value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remembers_what_is_asked_for_and_never_more_than_the_limit() {
        let memory: Memory<u32, u32> = Memory::new(1280);
        for key in 0..100_000 {
            memory.put(key, key * 2);
            if let Some(value) = memory.get(&7, |_| true) {
                assert_eq!(*value, 14, "the value of its key");
            }
            assert!(memory.len() <= 1280, "{} values", memory.len());
        }
        assert!(memory.get(&7, |_| true).is_some(), "asked for all the time");
        assert!(memory.get(&8, |_| true).is_none(), "never asked for");
        assert!(memory.get(&99_999, |_| true).is_some(), "put last");
        assert!(memory.get(&99_999, |_| false).is_none(), "no longer holds");
    }
}
