//! Decoded artifacts that stay in memory after a build, so that the next one does not need to read and decode
//! them again.
//!
//! The key of a value is its type's name and the digest of its bytes, so a value is never out of date. Of the
//! few least recently used values the largest is dropped first: a value of some kilobytes, which may have
//! taken seconds, is not given up for one of 60 MB. The weight of a value is the size of its encoded bytes;
//! in memory it may take several times as much if its container compresses.

use std::any::Any;
use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use parking_lot::Mutex;

use crate::key::Digest;

type StoredValue = Arc<dyn Any + Send + Sync>;
type ValueKey = (&'static str, Digest);

/// The number of the least recently used values of which the largest is dropped.
const CANDIDATES: usize = 8;

pub(crate) struct Memory {
    limit: u64,
    entries: Mutex<Entries>,
}

#[derive(Default)]
struct Entries {
    values: HashMap<ValueKey, MemoryEntry>,
    /// The keys by the time of their last use, the oldest first.
    by_use: BTreeMap<u64, ValueKey>,
    weight: u64,
    clock: u64,
}

struct MemoryEntry {
    value: StoredValue,
    weight: u64,
    used: u64,
}

impl Memory {
    /// A memory for values of at most `limit` encoded bytes; with 0 it keeps nothing.
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, entries: Mutex::default() }
    }

    pub(crate) fn get(&self, type_name: &'static str, digest: Digest) -> Option<StoredValue> {
        let mut entries = self.entries.lock();
        let entries = &mut *entries;
        let entry = entries.values.get_mut(&(type_name, digest))?;
        entries.clock += 1;
        entries.by_use.remove(&entry.used);
        entries.by_use.insert(entries.clock, (type_name, digest));
        entry.used = entries.clock;
        Some(Arc::clone(&entry.value))
    }

    /// Adds the value of an artifact of so many bytes, and drops others as needed. A value that alone exceeds
    /// the limit is not added, and no other is dropped for it.
    pub(crate) fn put(&self, type_name: &'static str, digest: Digest, bytes: u64, value: StoredValue) {
        // Values without bytes take memory too.
        let weight = bytes.max(1);
        if weight > self.limit {
            return;
        }
        // Values are dropped after the lock is released: that can take a while.
        let mut gone = Vec::new();
        let mut entries = self.entries.lock();
        let entries = &mut *entries;
        entries.clock += 1;
        let entry = MemoryEntry { value, weight, used: entries.clock };
        entries.weight += weight;
        entries.by_use.insert(entries.clock, (type_name, digest));
        if let Some(before) = entries.values.insert((type_name, digest), entry) {
            entries.by_use.remove(&before.used);
            entries.weight -= before.weight;
            gone.push(before);
        }
        while entries.weight > self.limit
            && let Some(dropped) = entries.largest_of_oldest()
        {
            entries.by_use.remove(&dropped.used);
            entries.weight -= dropped.weight;
            gone.push(dropped);
        }
    }
}

impl Entries {
    /// Removes from the values the one that is dropped next, which is never the newest.
    fn largest_of_oldest(&mut self) -> Option<MemoryEntry> {
        // If there are few values, only the older half may go: the latest stay, however large they are.
        let count = CANDIDATES.min(self.by_use.len() / 2);
        let weight = |name: &&ValueKey| self.values.get(*name).map_or(0, |entry| entry.weight);
        // If several values are equally large, the oldest goes.
        let largest = *self.by_use.values().take(count).min_by_key(|name| Reverse(weight(name)))?;
        self.values.remove(&largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(memory: &Memory, name: u8, bytes: u64) {
        memory.put("text", Digest([name; 32]), bytes, Arc::new(name));
    }

    /// The names of the values in memory, without using them.
    fn names(memory: &Memory) -> Vec<u8> {
        let entries = memory.entries.lock();
        assert_eq!(entries.weight, entries.values.values().map(|entry| entry.weight).sum::<u64>());
        assert_eq!(entries.by_use.len(), entries.values.len());
        entries.by_use.values().map(|(_, digest)| digest.0[0]).collect()
    }

    #[test]
    fn the_least_recently_used_value_is_dropped_first() {
        let memory = Memory::new(10);
        for name in 1..=3 {
            put(&memory, name, 3);
        }
        assert_eq!(names(&memory), [1, 2, 3]);
        let value = memory.get("text", Digest([1; 32])).unwrap();
        assert_eq!(value.downcast_ref::<u8>(), Some(&1));
        put(&memory, 4, 3);
        assert_eq!(names(&memory), [3, 1, 4]);
        put(&memory, 5, 7);
        assert_eq!(names(&memory), [4, 5], "as many go as have to");
        assert!(memory.get("text", Digest([3; 32])).is_none());
        assert!(memory.get("number", Digest([4; 32])).is_none(), "the same bytes of another type");
    }

    #[test]
    fn a_small_value_stays_while_larger_ones_are_dropped() {
        let memory = Memory::new(100);
        put(&memory, 0, 1);
        for name in 1..=6 {
            put(&memory, name, 40);
        }
        assert_eq!(names(&memory), [0, 5, 6]);
        put(&memory, 7, 2);
        for name in 8..=15 {
            put(&memory, name, 1);
        }
        put(&memory, 16, 60);
        assert_eq!(names(&memory), [0, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
    }

    #[test]
    fn a_value_beyond_the_limit_is_not_added() {
        let memory = Memory::new(10);
        put(&memory, 1, 10);
        put(&memory, 2, 11);
        assert_eq!(names(&memory), [1]);
        put(&memory, 1, 10);
        assert_eq!(names(&memory), [1], "what comes again is counted once");
        let nothing = Memory::new(0);
        put(&nothing, 1, 0);
        assert!(names(&nothing).is_empty());
    }
}
