//! Lists of results: what a stage's items have, so that whoever has none of it asks once and not for each.
//!
//! The protocol has no call that finds several results. So beside the results themselves a client stores,
//! under a name that says whose they are, a list of them, in parts of a few hundred; a part's outputs are
//! those of its results, so a server that forgets one of them forgets the list. A list is only a shorter
//! way: what it has is checked like any other result, what it lacks is asked for by itself, and of several
//! machines that store a list the last one counts.

use std::collections::{BTreeMap, HashMap};

use engine::serde_json::{self, Value, json};
use engine::{Digest, SharedBlob, SharedResult};
use parking_lot::Mutex;

use crate::protocol::sha256;

/// A list is asked for if so many results are, and stored if so many have changed in it.
const FROM: usize = 16;

/// A part has at most so many results, and about so many bytes of descriptions.
const MOST_IN_PART: usize = 400;
const MOST_BYTES: usize = 1 << 20;

/// The most results of an item: an edit leaves older ones behind.
const MOST_OF_ITEM: usize = 4;

/// The most parts that are believed.
const MOST_PARTS: usize = 4096;

/// The lists that this client uses, by name.
#[derive(Debug, Default)]
pub(crate) struct Lists(Mutex<HashMap<Vec<u8>, List>>);

#[derive(Debug, Default)]
struct List {
    is_loaded: bool,
    /// The results by item: first the names of the files that it reads, if it reads further ones, then its
    /// result.
    items: BTreeMap<String, Vec<Listed>>,
    /// The items whose results are not those of the stored list.
    changed: BTreeMap<String, Vec<Listed>>,
}

#[derive(Clone, Debug, PartialEq)]
struct Listed {
    /// The SHA-256 of the action's text.
    action: Digest,
    result: SharedResult,
}

/// A part of a list, as it is stored.
#[derive(Debug, PartialEq)]
pub(crate) struct Part {
    pub(crate) name: Vec<u8>,
    pub(crate) text: Vec<u8>,
    pub(crate) outputs: Vec<SharedBlob>,
}

/// The action under which a part is stored.
pub(crate) fn part_name(list: &[u8], part: usize) -> Vec<u8> {
    json!({ "list": String::from_utf8_lossy(list), "part": part }).to_string().into_bytes()
}

impl Lists {
    /// Whether a list is worth its call, and not there yet.
    pub(crate) fn is_worth_loading(&self, list: &[u8], asked: usize) -> bool {
        asked >= FROM && !self.0.lock().get(list).is_some_and(|list| list.is_loaded)
    }

    /// Takes the stored parts of a list; those that are damaged or missing are left out.
    pub(crate) fn loaded(&self, list: &[u8], parts: Vec<SharedResult>) {
        let mut lists = self.0.lock();
        let list = lists.entry(list.to_vec()).or_default();
        list.is_loaded = true;
        for part in parts {
            for (item, listed) in decoded(&part).unwrap_or_default() {
                list.items.entry(item).or_default().push(listed);
            }
        }
    }

    /// The result of an action in a list; `None` if the list does not have it.
    pub(crate) fn find(&self, list: &[u8], item: &str, action: &[u8]) -> Option<SharedResult> {
        let lists = self.0.lock();
        let list = lists.get(list)?;
        let listed = list.changed.get(item).or_else(|| list.items.get(item))?;
        let digest = sha256(action);
        Some(listed.iter().find(|listed| listed.action == digest)?.result.clone())
    }

    /// Adds a result that was stored, or was found by itself.
    pub(crate) fn add(&self, list: &[u8], item: &str, action: &[u8], result: SharedResult) {
        let mut lists = self.0.lock();
        let list = lists.entry(list.to_vec()).or_default();
        let listed = list.changed.entry(item.into()).or_default();
        listed.push(Listed { action: sha256(action), result });
        if listed.len() > MOST_OF_ITEM {
            listed.remove(0);
        }
    }

    /// The lists that have changed so much that they are to be stored again, and whether each was loaded.
    pub(crate) fn changed(&self) -> Vec<(Vec<u8>, bool)> {
        let lists = self.0.lock();
        let lists = lists.iter().filter(|(_, list)| list.changed.len() >= FROM);
        lists.map(|(name, list)| (name.clone(), list.is_loaded)).collect()
    }

    /// Gives the parts of a list as they are to be stored, one at a time: together they are large.
    pub(crate) fn parts(&self, list: &[u8], each: &mut dyn FnMut(Part)) {
        let mut lists = self.0.lock();
        let Some(found) = lists.get_mut(list) else { return };
        let changed = std::mem::take(&mut found.changed);
        found.items.extend(changed);
        let listed = found.items.iter().flat_map(|(item, all)| all.iter().map(move |one| (item, one)));
        let listed = listed.collect::<Vec<_>>();
        let mut parts = Vec::new();
        let mut rest = &listed[..];
        while !rest.is_empty() {
            let mut bytes = 0;
            let fits = rest.iter().take(MOST_IN_PART).take_while(|(_, listed)| {
                bytes += listed.result.description.len();
                bytes <= MOST_BYTES
            });
            let (part, others) = rest.split_at(fits.count().max(1));
            parts.push(part);
            rest = others;
        }
        for (index, part) in parts.iter().enumerate() {
            let entry = |(item, listed): &(&String, &Listed)| {
                let description = str::from_utf8(&listed.result.description).unwrap_or_default();
                json!([item, listed.action, description, listed.result.outputs.len()])
            };
            let entries = part.iter().map(entry).collect::<Vec<_>>();
            let outputs = part.iter().flat_map(|(_, listed)| &listed.result.outputs);
            each(Part {
                name: part_name(list, index),
                text: json!({ "parts": parts.len(), "results": entries }).to_string().into_bytes(),
                outputs: outputs.copied().collect(),
            });
        }
    }
}

/// How many parts the list has whose first part this is.
pub(crate) fn part_count(first: &SharedResult) -> usize {
    let value = serde_json::from_slice::<Value>(&first.description).unwrap_or_default();
    let count = value["parts"].as_u64().and_then(|count| usize::try_from(count).ok());
    count.unwrap_or(1).min(MOST_PARTS)
}

/// The results of a part, each with its item; `None` if it is not what [`Lists::parts`] makes.
fn decoded(part: &SharedResult) -> Option<Vec<(String, Listed)>> {
    let value = serde_json::from_slice::<Value>(&part.description).ok()?;
    let mut outputs = part.outputs.iter().copied();
    let mut all = Vec::new();
    for entry in value.get("results")?.as_array()? {
        let [item, action, description, count] = &entry.as_array()?[..] else { return None };
        let count = usize::try_from(count.as_u64()?).ok()?;
        let outputs = outputs.by_ref().take(count).collect::<Vec<_>>();
        if outputs.len() != count {
            return None;
        }
        let description = description.as_str()?.as_bytes().to_vec();
        let action = serde_json::from_value(action.clone()).ok()?;
        all.push((item.as_str()?.into(), Listed { action, result: SharedResult { description, outputs } }));
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn result(number: usize) -> SharedResult {
        let outputs = (0..number % 3).map(|output| SharedBlob {
            hash: sha256(format!("{number} {output}").as_bytes()),
            bytes: output as u64,
        });
        SharedResult { description: format!("{{\"n\":{number}}}").into_bytes(), outputs: outputs.collect() }
    }

    fn stored(lists: &Lists) -> Vec<SharedResult> {
        let mut stored = Vec::new();
        lists.parts(b"stage", &mut |part| {
            stored.push(SharedResult { description: part.text, outputs: part.outputs });
        });
        stored
    }

    #[test]
    fn a_list_returns_and_what_changes_takes_the_place_of_what_was() {
        let lists = Lists::default();
        for number in 0..1000 {
            lists.add(b"stage", &format!("item {number}"), &[1, (number % 7) as u8], result(number));
        }
        assert_eq!(lists.changed(), [(b"stage".to_vec(), false)]);
        let parts = stored(&lists);
        assert!(parts.len() == 3 && part_count(&parts[0]) == 3);
        assert!(lists.changed().is_empty());

        let other = Lists::default();
        assert!(other.is_worth_loading(b"stage", FROM) && !other.is_worth_loading(b"stage", FROM - 1));
        other.loaded(b"stage", parts);
        assert!(!other.is_worth_loading(b"stage", 1000));
        for number in [0, 1, 500, 999] {
            let item = format!("item {number}");
            assert_eq!(other.find(b"stage", &item, &[1, (number % 7) as u8]), Some(result(number)));
            assert_eq!(other.find(b"stage", &item, &[1, 8]), None, "an action of other contents");
        }
        for number in 0..FROM {
            other.add(b"stage", &format!("item {number}"), &[2], result(number + 1));
        }
        let third = Lists::default();
        third.loaded(b"stage", stored(&other));
        assert_eq!(third.find(b"stage", "item 3", &[2]), Some(result(4)));
        assert_eq!(third.find(b"stage", "item 3", &[1, 3]), None);
        assert_eq!(third.find(b"stage", "item 900", &[1, (900 % 7) as u8]), Some(result(900)));
    }

    #[test]
    fn a_damaged_list_is_left_out() {
        let whole = SharedResult {
            description: br#"{"parts":99999999,"results":[["a","00","{}",1]]}"#.to_vec(),
            outputs: vec![],
        };
        assert_eq!((decoded(&whole), part_count(&whole)), (None, MOST_PARTS));
        for text in ["", "[]", "{}", r#"{"results":[1]}"#, r#"{"results":[["a",1,2,3]]}"#] {
            let part = SharedResult { description: text.into(), outputs: vec![] };
            assert_eq!(decoded(&part), None, "{text}");
        }
    }
}
