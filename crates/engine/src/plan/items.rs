//! The items of a graph: the instances of each stage.
//!
//! A source stage has an item for each asset. Every other stage has the natural join of the items that arrive
//! at its single ports: keys that name the same source stage agree, others multiply. Since every stage that
//! descends from a source descends from all of its assets, a join never drops an item: a stage's items are
//! the full product of the assets of its keys' source stages. So an item is a number in mixed radix with one
//! digit for each key (the most significant first, keys sorted by name), and the item at the other end of an
//! edge is computed, not searched for. The order of these numbers is the order of the keys, because assets
//! are sorted by stem.
//!
//! A `many` port receives the items that agree: the digits that the stage keeps are fixed, and the others
//! take all their values.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use rayon::prelude::*;

use super::folders::Folders;
use super::graph::{Graph, Node};
use super::index::{ItemIndex, StageIndex};
use super::search::Search;
use super::source::{Asset, listed};
use super::template;
use crate::key::ItemKey;
use crate::kinds::{NamedPath, Product};
use crate::manifest::{Diagnostic, ValueKind};
use crate::platform::path_text;
use crate::storage::lies_in;

const MOST_ITEMS: usize = 1_000_000;
/// The most inputs of a plan's items, those at `many` ports included.
const MOST_INPUTS: usize = 16_000_000;

/// One instance of a stage.
#[derive(Clone, Debug)]
pub struct Item {
    /// The stage.
    pub stage: StageIndex,
    /// The key that distinguishes the item from the others of its stage.
    pub key: ItemKey,
    /// For each of the stage's inputs, in order: the items that arrive there, sorted by key.
    pub inputs: Vec<Vec<ItemIndex>>,
    /// The source file or folder, for a kind that has one. Absolute.
    pub source: Option<PathBuf>,
    /// The exported files, relative to `out`, with `/` between folders, in the order of [`Product::Files`].
    pub files: Vec<String>,
}

/// The assets of each stage; empty if it has no source or its source is invalid.
pub(crate) type Assets = Vec<Vec<Asset>>;

/// The files and folders of the source stages, and what is built in.
pub(crate) fn assets(graph: &Graph, search: &mut Search<'_>) -> Arc<Assets> {
    search.errors.extend(linked_out(graph, search.folders));
    search.errors.extend(graph.nodes.iter().flat_map(|node| exports_read(graph, node, search.folders)));
    let found = graph.nodes.iter().map(|node| match &node.built_in {
        Some(name) => Some(vec![Asset { stem: name.as_str().into(), path: None }]),
        None => node.source.as_ref()?.assets(search),
    });
    Arc::new(found.map(Option::unwrap_or_default).collect())
}

/// The items of the stages whose keys and assets are known.
pub(crate) fn expand(graph: &Graph, assets: &Assets, errors: &mut Vec<Diagnostic>) -> Vec<Item> {
    let mut items = Vec::new();
    let (mut firsts, mut inputs) = (vec![0; graph.nodes.len()], 0_usize);
    let mut known = vec![false; graph.nodes.len()];
    let mut item_keys = HashMap::<&[StageIndex], Vec<ItemKey>>::new();
    for (stage, node) in graph.nodes.iter().enumerate() {
        firsts[stage] = items.len();
        known[stage] = node.edges.iter().all(|edge| known[edge.from]);
        let keys = node.keys.as_deref().filter(|keys| keys.iter().all(|&key| !assets[key].is_empty()));
        let (Some(keys), true) = (keys, known[stage]) else {
            known[stage] = false;
            continue;
        };
        let count = count(keys, assets);
        let gathered = node.edges.iter().map(|edge| gathered(graph, keys, edge.from, assets));
        inputs = gathered.fold(inputs, |sum, each| sum.saturating_add(each.saturating_mul(count)));
        if items.len().saturating_add(count) > MOST_ITEMS || inputs > MOST_INPUTS {
            errors.push(too_many(graph, node, keys, assets));
            // All stages that follow would have too many as well.
            return Vec::new();
        }
        // Stages with the same keys share them.
        let item_keys = item_keys.entry(keys).or_insert_with(|| self::item_keys(graph, keys, count, assets));
        let made = (0..count).into_par_iter().map(|number| {
            let key = item_keys[number].clone();
            item(graph, stage, keys, key, number, assets, &firsts)
        });
        items.par_extend(made);
    }
    add_files(graph, &known, &mut items, assets, errors);
    items
}

/// The errors of parameters that name something in the folder for exports.
fn exports_read(graph: &Graph, node: &Node, folders: &dyn Folders) -> Vec<Diagnostic> {
    let Some(configured) = &node.configured else { return Vec::new() };
    let folder = graph.manifest.parent().unwrap_or(&graph.manifest);
    let error = |named: NamedPath| {
        let path = folder.join(&named.path);
        if named.is_word && path == graph.out {
            return None;
        }
        // A watcher notices when a link on the way changes.
        folders.find(&path);
        let what = if lies_in(&path, &graph.out, |path| folders.leads_to(path)) {
            "is inside"
        } else if named.is_read_whole && lies_in(&graph.out, &path, |path| folders.leads_to(path)) {
            "contains"
        } else {
            return None;
        };
        let entry = node.parameters.get(named.parameter);
        let span = entry.map_or(node.header.clone(), |entry| match &entry.value.kind {
            ValueKind::Array(values) => {
                values.get(named.index).map_or(entry.value.span.clone(), |value| value.span.clone())
            }
            _ => entry.value.span.clone(),
        });
        let shown = named.path.to_string_lossy();
        let message = format!("{}: {shown:?} {what} \"out\", the folder for exports", named.parameter);
        Some(Diagnostic::at(span, message).help(match what {
            "contains" => "list the files and folders in it that are read",
            _ => {
                "connect the stage that makes the file instead, inputs = { NAME = \"STAGE\" }, or move the file"
            }
        }))
    };
    configured.named_paths().into_iter().filter_map(error).collect()
}

/// The folder for exports is inside the manifest's folder even when links are followed: a project that
/// somebody else prepared must not publish elsewhere.
fn linked_out(graph: &Graph, folders: &dyn Folders) -> Option<Diagnostic> {
    let folder = graph.manifest.parent()?;
    let mut above = graph.out.ancestors().take_while(|above| *above != folder);
    let (above, real) = above.find_map(|above| Some((above, folders.real(above)?)))?;
    let inside = folders
        .real(folder)
        .is_none_or(|folder| real.starts_with(&folder) && (above != graph.out || real != folder));
    (!inside).then(|| {
        let above = above.strip_prefix(folder).unwrap_or(above);
        let message = format!("{:?} leads out of the manifest's folder, to {}", above, path_text(real));
        Diagnostic::of_file(message)
            .expected("expected a folder inside the manifest's folder, not a link out of it")
            .help("remove the link; to keep exports on another disk, mount the disk there")
    })
}

fn count(keys: &[StageIndex], assets: &Assets) -> usize {
    keys.iter().fold(1, |product: usize, &key| product.saturating_mul(assets[key].len()))
}

/// The number of items of `from` that arrive at an item with these keys.
fn gathered(graph: &Graph, keys: &[StageIndex], from: StageIndex, assets: &Assets) -> usize {
    let free = graph.nodes[from].keys.iter().flatten().filter(|key| !keys.contains(key));
    free.fold(1, |product: usize, key| product.saturating_mul(assets[*key].len()))
}

fn too_many(graph: &Graph, node: &Node, keys: &[StageIndex], assets: &Assets) -> Diagnostic {
    let factors = keys.iter().map(|&key| format!("{} of {}", assets[key].len(), graph.nodes[key].name));
    let factors = listed(factors).replace(", ", " times ");
    let message = format!("stage {:?} makes too many items: {factors}", node.name);
    Diagnostic::at(node.header.clone(), message)
        .expected(format!("expected at most {MOST_ITEMS} items with {MOST_INPUTS} inputs in all stages"))
}

fn item_keys(graph: &Graph, keys: &[StageIndex], count: usize, assets: &Assets) -> Vec<ItemKey> {
    let stages = keys.iter().map(|&key| Arc::<str>::from(graph.nodes[key].name.as_str())).collect::<Vec<_>>();
    let item_keys = (0..count).into_par_iter().map(|number| {
        let digits = digits(keys, number, assets);
        let pairs = (0..keys.len())
            .map(|index| (Arc::clone(&stages[index]), Arc::clone(&assets[keys[index]][digits[index]].stem)));
        pairs.collect()
    });
    item_keys.collect()
}

/// Which asset of each key an item stands for.
fn digits(keys: &[StageIndex], number: usize, assets: &Assets) -> Vec<usize> {
    let mut digits = vec![0; keys.len()];
    let mut rest = number;
    for (digit, &key) in digits.iter_mut().zip(keys).rev() {
        (*digit, rest) = (rest % assets[key].len(), rest / assets[key].len());
    }
    digits
}

fn item(
    graph: &Graph,
    stage: StageIndex,
    keys: &[StageIndex],
    key: ItemKey,
    number: usize,
    assets: &Assets,
    firsts: &[ItemIndex],
) -> Item {
    let node = &graph.nodes[stage];
    let digits = digits(keys, number, assets);
    let asset = |index: usize| &assets[keys[index]][digits[index]];
    let own = keys.iter().position(|key| *key == stage);
    Item {
        stage,
        key,
        inputs: node
            .edges
            .iter()
            .map(|edge| arriving(&graph.nodes[edge.from], firsts[edge.from], keys, &digits, assets))
            .collect(),
        source: own.and_then(|own| asset(own).path.clone()),
        files: Vec::new(),
    }
}

/// The items of a stage, the first of which is `first`, that agree with these digits of these keys.
fn arriving(
    from: &Node,
    first: ItemIndex,
    keys: &[StageIndex],
    digits: &[usize],
    assets: &Assets,
) -> Vec<ItemIndex> {
    let mut found = vec![first];
    let mut stride = 1;
    // From the least significant key up: each value of a free key repeats what was found so far.
    for &key in from.keys.iter().flatten().rev() {
        let radix = assets[key].len();
        match keys.iter().position(|&own| own == key) {
            Some(own) => found.iter_mut().for_each(|index| *index += digits[own] * stride),
            None => {
                let below = std::mem::take(&mut found);
                found = (0..radix)
                    .flat_map(|digit| below.iter().map(move |index| index + digit * stride))
                    .collect();
            }
        }
        stride *= radix;
    }
    found
}

/// Gives the items their files, and reports those that cannot be written side by side.
fn add_files(
    graph: &Graph,
    known: &[bool],
    items: &mut [Item],
    assets: &Assets,
    errors: &mut Vec<Diagnostic>,
) {
    let mut done = vec![false; graph.nodes.len()];
    for (stage, node) in graph.nodes.iter().enumerate() {
        let (Some(template), Some(keys), true) = (&node.template, &node.keys, known[stage]) else { continue };
        let several = (0..keys.len()).filter(|&key| assets[keys[key]].len() > 1 && !template.has(key));
        let several: Vec<_> = several.map(|key| format!("{{{}}}", graph.nodes[keys[key]].name)).collect();
        done[stage] = several.is_empty();
        if !several.is_empty() {
            let message = format!("the path is the same for several items of {:?}", node.name);
            let error = Diagnostic::at(template.span.clone(), message);
            errors.push(error.expected(format!("expected {} in the path", several.join(" and "))));
        }
    }
    for item in items.iter_mut() {
        let node = &graph.nodes[item.stage];
        let (Some(template), Some(Product::Files(endings)), true) =
            (&node.template, &node.product, done[item.stage])
        else {
            continue;
        };
        let stems: Vec<_> = item.key.stems().collect();
        let path = template.path(|key| stems[key]);
        item.files = endings.iter().map(|ending| format!("{path}{ending}")).collect();
        if let Some((file, problem)) =
            item.files.iter().find_map(|file| Some((file, template::check(file, "\"out\"").err()?)))
        {
            // One error for each stage is enough.
            done[item.stage] = false;
            let message = format!("the file {file:?} of item [{}] {}", item.key, problem.message);
            errors.push(Diagnostic::at(template.span.clone(), message).expected(problem.expected));
            item.files.clear();
        }
    }
}
