//! A memory for things that are functions of their keys.
//!
//! Whether something is remembered or worked out anew makes no difference to anyone but the clock: that is what makes
//! results independent of the order of work. Forgetting is therefore always allowed.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hash, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::random::mix;

/// Parts with a lock of their own; threads seldom meet in one.
const SHARDS: usize = 64;

/// A value that says how much memory hangs on it.
pub(crate) trait Footprint {
    /// Bytes that the value owns besides its own size.
    fn heap_bytes(&self) -> usize;
}

/// A hash of a few numbers. Keys come from the scene, not from somebody who wants them to collide, and a point asks for dozens.
#[derive(Clone, Copy, Debug, Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        mix(self.0)
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(u64::from(byte));
        }
    }

    fn write_u8(&mut self, word: u8) {
        self.write_u64(u64::from(word));
    }

    fn write_u32(&mut self, word: u32) {
        self.write_u64(u64::from(word));
    }

    fn write_i32(&mut self, word: i32) {
        self.write_u64(u64::from(word as u32));
    }

    fn write_u64(&mut self, word: u64) {
        // An odd number without pattern: the golden ratio's digits.
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }
}

/// A map from keys to values, with a limit on the memory that it takes. What was not asked for longest goes first.
#[derive(Debug)]
pub(crate) struct Memory<K, V> {
    shards: Vec<Mutex<Shard<K, V>>>,
    /// Bytes of one generation of a shard.
    limit: usize,
    /// How often everything has been forgotten.
    epoch: AtomicU64,
}

/// Two generations: when the young one is full it becomes the old one, and what was old and not asked for since is gone.
#[derive(Debug)]
struct Shard<K, V> {
    young: Generation<K, V>,
    old: Generation<K, V>,
    /// That of the memory when it was last asked.
    epoch: u64,
}

#[derive(Debug)]
struct Generation<K, V> {
    values: HashMap<K, Arc<V>, BuildHasherDefault<KeyHasher>>,
    bytes: usize,
}

impl<K, V> Default for Generation<K, V> {
    fn default() -> Self {
        Self {
            values: HashMap::default(),
            bytes: 0,
        }
    }
}

/// Bytes for an entry: the value with its counts and the bookkeeping of two allocations, and two places in a table, which is
/// half full on average.
fn entry_bytes<K, V: Footprint>(value: &V) -> usize {
    size_of::<V>() + value.heap_bytes() + 6 * size_of::<usize>() + 2 * (size_of::<(K, Arc<V>)>() + 1)
}

impl<K: Copy + Eq + Hash, V: Footprint> Memory<K, V> {
    /// Holds values of up to `limit` bytes, table and bookkeeping included; but one in each of the parts at least.
    pub(crate) fn new(limit: usize) -> Self {
        let shard = || {
            Mutex::new(Shard {
                young: Generation::default(),
                old: Generation::default(),
                epoch: 0,
            })
        };
        Self {
            shards: (0..SHARDS).map(|_| shard()).collect(),
            limit: limit / (2 * SHARDS),
            epoch: AtomicU64::new(0),
        }
    }

    /// Forgets everything. Returns at once: each part frees its memory when it is next asked.
    pub(crate) fn forget(&self) {
        self.epoch.fetch_add(1, Ordering::Relaxed);
    }

    fn shard(&self, key: &K) -> MutexGuard<'_, Shard<K, V>> {
        let mut hasher = KeyHasher::default();
        key.hash(&mut hasher);
        // Tables go by the lowest and highest bits.
        let shard = &self.shards[(hasher.finish() >> 32) as usize % SHARDS];
        let mut shard = shard.lock().unwrap_or_else(PoisonError::into_inner);
        let epoch = self.epoch.load(Ordering::Relaxed);
        if shard.epoch != epoch {
            *shard = Shard {
                young: Generation::default(),
                old: Generation::default(),
                epoch,
            };
        }
        shard
    }

    /// The value of a key, if it is remembered and `holds` says that it still holds.
    pub(crate) fn get(&self, key: &K, holds: impl FnOnce(&V) -> bool) -> Option<Arc<V>> {
        let value = {
            let mut shard = self.shard(key);
            if let Some(value) = shard.young.values.get(key) {
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

    /// How many values are remembered, and the bytes that they take.
    pub(crate) fn size(&self) -> (usize, usize) {
        self.shards.iter().fold((0, 0), |(count, bytes), shard| {
            let shard = shard.lock().unwrap_or_else(PoisonError::into_inner);
            let both = [&shard.young, &shard.old];
            let more: usize = both.iter().map(|generation| generation.values.len()).sum();
            (count + more, bytes + both.iter().map(|g| g.bytes).sum::<usize>())
        })
    }
}

impl<K: Copy + Eq + Hash, V: Footprint> Shard<K, V> {
    fn insert(&mut self, key: K, value: Arc<V>, limit: usize) {
        // One that no longer holds is replaced.
        self.young.remove(&key);
        let bytes = entry_bytes::<K, V>(&value);
        if self.young.bytes + bytes > limit {
            self.old = std::mem::take(&mut self.young);
        }
        self.young.bytes += bytes;
        self.young.values.insert(key, value);
    }
}

impl<K: Eq + Hash, V: Footprint> Generation<K, V> {
    fn remove(&mut self, key: &K) -> Option<Arc<V>> {
        let value = self.values.remove(key)?;
        self.bytes -= entry_bytes::<K, V>(&value);
        Some(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Footprint for Vec<u8> {
        fn heap_bytes(&self) -> usize {
            self.capacity()
        }
    }

    #[test]
    fn remembers_what_is_asked_for_and_never_more_than_the_limit() {
        let limit = 256 << 10;
        let memory: Memory<u32, Vec<u8>> = Memory::new(limit);
        let mut most = 0;
        for key in 0..20_000 {
            memory.put(key, vec![key as u8; key as usize % 97]);
            if let Some(value) = memory.get(&7, |_| true) {
                assert_eq!(*value, [7; 7], "the value of its key");
            }
            let (count, bytes) = memory.size();
            assert!(bytes <= limit, "{bytes} bytes");
            assert!(bytes >= count * 100, "{bytes} bytes for {count} values");
            most = most.max(bytes);
        }
        assert!(most > limit / 4 * 3, "the limit is used: {most} bytes");
        assert!(memory.get(&7, |_| true).is_some(), "asked for all the time");
        assert!(memory.get(&8, |_| true).is_none(), "never asked for");
        assert!(memory.get(&19_999, |_| true).is_some(), "put last");
        assert!(memory.get(&19_999, |_| false).is_none(), "no longer holds");
    }

    /// Keys as those of lines, neighbours in space.
    #[test]
    fn hashes_of_neighbours_differ_and_fill_all_parts() {
        let mut seen = std::collections::HashSet::new();
        let mut parts = [0u32; SHARDS];
        for (i, j) in (-100..100).flat_map(|i| (-100..100).map(move |j| (i, j))) {
            let mut hasher = KeyHasher::default();
            (2u8, 1u8, i, j).hash(&mut hasher);
            seen.insert(hasher.finish());
            parts[(hasher.finish() >> 32) as usize % SHARDS] += 1;
        }
        assert_eq!(seen.len(), 40_000, "none twice");
        // 625 on average with a standard deviation of 25.
        assert!(parts.iter().all(|&n| n.abs_diff(625) < 125), "{parts:?}");
    }

    #[test]
    fn what_is_put_again_and_again_counts_once() {
        let memory: Memory<u32, Vec<u8>> = Memory::new(256 << 10);
        for _ in 0..1000 {
            memory.put(3, vec![0; 100]);
        }
        let (count, bytes) = memory.size();
        assert_eq!(count, 1);
        assert!(bytes < 400, "{bytes} bytes");
    }

    #[test]
    fn without_memory_there_is_still_the_last_value_of_each_part() {
        let memory: Memory<u32, Vec<u8>> = Memory::new(0);
        for key in 0..10_000 {
            memory.put(key, vec![1]);
            assert!(memory.get(&key, |_| true).is_some());
        }
        assert!(memory.size().0 <= 2 * SHARDS);
    }

    #[test]
    fn what_is_forgotten_is_gone() {
        let memory: Memory<u32, Vec<u8>> = Memory::new(1 << 20);
        for key in 0..1000 {
            memory.put(key, vec![1]);
        }
        memory.forget();
        assert!((0..1000).all(|key| memory.get(&key, |_| true).is_none()));
        assert_eq!(memory.size(), (0, 0), "and so is its memory");
        memory.put(3, vec![1]);
        assert!(memory.get(&3, |_| true).is_some(), "new values are kept");
    }
}
