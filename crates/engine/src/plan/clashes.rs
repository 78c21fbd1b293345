//! Items that cannot be published side by side: they write the same file, or one writes a file where another
//! needs a folder.
//!
//! Names that differ only in case are the same on Windows and macOS, and on macOS also names that differ only
//! in how their accents are encoded ([`folded`]).

use std::borrow::Cow;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::path::Path;

use unicode_normalization::UnicodeNormalization;

use super::graph::Graph;
use super::items::{Assets, Item};
use super::template::Template;
use crate::event::ItemName;
use crate::manifest::Diagnostic;
use crate::platform::folded;
use crate::storage::path_name;

/// The clashes, one for two stages.
pub(super) fn find(graph: &Graph, items: &[Item], assets: &Assets) -> Vec<Diagnostic> {
    let files = items.iter().map(|item| item.files.len()).sum();
    let mut writers: HashMap<Cow<'_, str>, (usize, &str)> = HashMap::with_capacity(files);
    let mut report = Report { graph, items, assets, reported: HashSet::new(), errors: Vec::new() };
    for (index, item) in items.iter().enumerate() {
        for file in &item.files {
            match writers.entry(folded(file)) {
                Entry::Vacant(entry) => {
                    entry.insert((index, file));
                }
                Entry::Occupied(entry) => {
                    let &(first, other) = entry.get();
                    report.add(first, index, |first, second| match () {
                        () if file == other => format!("{first} and {second} both write {file:?}"),
                        () if file.to_lowercase() == other.to_lowercase() => format!(
                            "{first} and {second} write {other:?} and {file:?}, which are the same file if case is \
                             ignored"
                        ),
                        () => format!(
                            "{first} and {second} write {other:?} and {file:?}, which are the same file on \
                             macOS: they have the same letters in different encodings"
                        ),
                    });
                }
            }
        }
    }
    let mut blocked: Vec<(usize, &str, usize, &str)> = Vec::new();
    for (path, &(index, file)) in &writers {
        let above = path.match_indices('/').filter_map(|(slash, _)| writers.get(&path[..slash]));
        blocked.extend(above.map(|&(other, folder)| (other, folder, index, file)));
    }
    // In the order of the items, not of the hash table.
    blocked.sort_unstable();
    for (other, folder, index, file) in blocked {
        report.add(other, index, |writer, other| {
            format!(
                "{writer} writes the file {folder:?}, but {other} needs a folder of that name for {file:?}"
            )
        });
    }
    report.errors
}

struct Report<'a> {
    graph: &'a Graph,
    items: &'a [Item],
    assets: &'a Assets,
    /// The pairs of stages with an error.
    reported: HashSet<(usize, usize)>,
    errors: Vec<Diagnostic>,
}

impl Report<'_> {
    /// Adds the clash of two items. One pair of files is enough for two stages.
    fn add(&mut self, first: usize, second: usize, message: impl FnOnce(ItemName, ItemName) -> String) {
        let (a, b) = (self.items[first].stage, self.items[second].stage);
        let stages = if b >= a { (a, b) } else { (b, a) };
        if !self.reported.insert(stages) {
            return;
        }
        let last = &self.graph.nodes[stages.1];
        let span = last.template.as_ref().map(|template: &Template| template.span.clone());
        let help = match self.similar_sources(first, second) {
            // Quoted, accents that are characters of their own show.
            Some((one, other)) if one.nfc().eq(other.nfc()) => format!("rename {one:?} or {other:?}"),
            Some((one, other)) => format!("rename {one} or {other}"),
            None if a == b => "separate the placeholders with a / or another character".into(),
            None => "change the path of one of the stages".into(),
        };
        let error =
            Diagnostic::at(span.unwrap_or(last.header.clone()), message(self.name(first), self.name(second)));
        self.errors.push(error.expected("expected a path that no other item has").help(help));
    }

    fn name(&self, item: usize) -> ItemName {
        let item = &self.items[item];
        ItemName { stage: self.graph.nodes[item.stage].name.clone(), key: item.key.clone() }
    }

    /// Two source files of the same stage, one of each item, whose names differ only in case or encoding.
    fn similar_sources(&self, first: usize, second: usize) -> Option<(String, String)> {
        let (one, other) = (&self.items[first].key, &self.items[second].key);
        one.iter().find_map(|(stage, stem)| {
            let (_, other) = other.iter().find(|(of_other, _)| *of_other == stage)?;
            let is_similar = stem != other && folded(stem) == folded(other);
            is_similar.then(|| Some((self.source(stage, stem)?, self.source(stage, other)?))).flatten()
        })
    }

    fn source(&self, stage: &str, stem: &str) -> Option<String> {
        let stage = self.graph.nodes.iter().position(|node| node.name == *stage)?;
        let asset = self.assets[stage].iter().find(|asset| *asset.stem == *stem)?;
        let folder = self.graph.manifest.parent().unwrap_or(Path::new("."));
        Some(path_name(folder, asset.path.as_deref()?))
    }
}
