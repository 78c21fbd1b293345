//! Decoded artifacts that stay in memory after a build, so that the next one does not need to read and decode
//! them again.
//!
//! The key of a value is its type's name and the digest of its bytes, so a value is never out of date. The
//! least recently used values are dropped first. The weight of a value is the size of its encoded bytes; in
//! memory it may take several times as much if its container compresses.

use std::any::Any;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use parking_lot::Mutex;

use crate::Digest;

type Value = Arc<dyn Any + Send + Sync>;
type Name = (&'static str, Digest);

/// The values in memory.
pub(crate) struct Memory {
    limit: u64,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    values: HashMap<Name, Place>,
    /// The keys by the time of their last use, the oldest first.
    order: BTreeMap<u64, Name>,
    weight: u64,
    clock: u64,
}

struct Place {
    value: Value,
    weight: u64,
    used: u64,
}

impl Memory {
    /// A memory for values of at most `limit` encoded bytes; with 0 it keeps nothing.
    pub(crate) fn new(limit: u64) -> Self {
        Self { limit, kept: Mutex::default() }
    }

    /// The value of an artifact, if it is in memory.
    pub(crate) fn get(&self, type_name: &'static str, digest: Digest) -> Option<Value> {
        let mut kept = self.kept.lock();
        let kept = &mut *kept;
        let place = kept.values.get_mut(&(type_name, digest))?;
        kept.clock += 1;
        kept.order.remove(&place.used);
        kept.order.insert(kept.clock, (type_name, digest));
        place.used = kept.clock;
        Some(Arc::clone(&place.value))
    }

    /// Adds the value of an artifact of so many bytes, and drops others as needed. A value that alone exceeds
    /// the limit is not added, and no other is dropped for it.
    pub(crate) fn put(&self, type_name: &'static str, digest: Digest, bytes: u64, value: Value) {
        // Values without bytes take memory too.
        let weight = bytes.max(1);
        if weight > self.limit {
            return;
        }
        // Values are dropped after the lock is released: that can take a while.
        let mut gone = Vec::new();
        let mut kept = self.kept.lock();
        let kept = &mut *kept;
        kept.clock += 1;
        let place = Place { value, weight, used: kept.clock };
        kept.weight += weight;
        kept.order.insert(kept.clock, (type_name, digest));
        if let Some(before) = kept.values.insert((type_name, digest), place) {
            kept.order.remove(&before.used);
            kept.weight -= before.weight;
            gone.push(before);
        }
        while kept.weight > self.limit
            && let Some((_, name)) = kept.order.pop_first()
            && let Some(oldest) = kept.values.remove(&name)
        {
            kept.weight -= oldest.weight;
            gone.push(oldest);
        }
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
        let kept = memory.kept.lock();
        assert_eq!(kept.weight, kept.values.values().map(|place| place.weight).sum::<u64>());
        assert_eq!(kept.order.len(), kept.values.len());
        kept.order.values().map(|(_, digest)| digest.0[0]).collect()
    }

    #[test]
    fn what_was_not_used_longest_goes_first() {
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
    fn what_is_too_big_alone_is_not_kept() {
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
