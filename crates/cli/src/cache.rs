//! `specula cache`: shows what the cache holds, makes it smaller, checks it.

use std::path::Path;

use engine::cache::{self, Amount, CollectOptions, Freed, LostBlob, Stats, Verified};
use engine::{Error, ItemName, LockTimeout};
use serde_json::json;

use crate::arguments::{CacheCommand, QueryArguments};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print::{self, say};
use crate::quantity::{count, size};
use crate::reasons::short;

pub(crate) fn run(command: &CacheCommand) -> Result<Exit, CommandError> {
    let result = match command {
        CacheCommand::Stats { query } => cache::stats(folder(query)).map(|stats| match query.json {
            true => print::json(json!(stats)),
            false => print::data(&describe(&stats)),
        }),
        CacheCommand::Gc { query, max_size, dry_run } => {
            let lock_timeout = LockTimeout::default();
            let options = CollectOptions { limit: *max_size, dry_run: *dry_run, lock_timeout };
            cache::collect(folder(query), &options, &show_wait).map(|freed| match query.json {
                true => print::json(json!(freed)),
                false => print::data(&describe_freed(&freed, &options)),
            })
        }
        CacheCommand::Verify { query } => verify(folder(query), query.json),
    };
    Ok(result?)
}

fn verify(folder: &Path, json: bool) -> Result<Exit, Error> {
    let verified = cache::verify(folder, LockTimeout::default(), &show_wait)?;
    let printed = match json {
        true => print::json(json!(verified)),
        false => print::data(&describe_verified(&verified)),
    };
    let is_intact = verified.lost.is_empty();
    Ok(if printed == Exit::Success && !is_intact { Exit::Failed } else { printed })
}

/// The folder of a manifest, even if the manifest no longer exists.
pub(crate) fn folder(query: &QueryArguments) -> &Path {
    match query.manifest.manifest.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

pub(crate) fn show_wait(holder: String) {
    say!("{:>13}  for {holder}", "waiting");
}

fn describe(stats: &Stats) -> String {
    let all = stats.in_effect + stats.earlier + stats.garbage;
    let mut text = format!("{:<16}{}\n", "results", amount(all, "file"));
    for (label, part, meaning) in [
        ("in effect", stats.in_effect, "the last good outputs, which always stay"),
        ("earlier", stats.earlier, "kept for edits that are undone; gc --max-size removes the oldest"),
        ("garbage", stats.garbage, "not used by any record; gc removes it"),
        ("unfinished", stats.temporary, "being written, or left by a killed process"),
    ] {
        text += &format!("  {label:<14}{:<28}{meaning}\n", amount(part, "file"));
    }
    text += &format!("{:<16}{}\n", "journal", amount(stats.journal, "line"));
    for share in &stats.stages {
        let (name, manifest) = (&share.stage, &share.manifest);
        text += &format!(
            "stage {name} ({manifest}): {} in effect, {} earlier\n",
            size(share.in_effect.bytes),
            size(share.earlier.bytes)
        );
    }
    text
}

fn describe_freed(freed: &Freed, options: &CollectOptions) -> String {
    let gone = freed.garbage + freed.earlier + freed.temporary;
    let removed = if options.dry_run { "would remove" } else { "removed" };
    let mut text = format!("{removed} {}\n", amount(gone, "file"));
    let parts = [
        ("earlier results", freed.earlier),
        ("garbage", freed.garbage),
        ("temporary files", freed.temporary),
    ];
    for (label, part) in parts.iter().filter(|(_, part)| part.count > 0) {
        text += &format!("  {label:<18}{}\n", amount(*part, "file"));
    }
    let (left, in_effect) = (amount(freed.left, "file"), size(freed.in_effect.bytes));
    text += &format!("{left} left, of which {in_effect} are the last good outputs\n");
    if let Some(limit) = options.limit.filter(|limit| freed.left.bytes > *limit) {
        text += &format!("this is more than {}, because the last good outputs always stay\n", size(limit));
    }
    text
}

fn describe_verified(verified: &Verified) -> String {
    let mut text = String::new();
    for lost in &verified.lost {
        let what = if lost.damaged { "damaged, removed" } else { "missing" };
        text += &format!("{what}: {}, {}\n", short(Some(&lost.digest)), owner(lost));
    }
    let intact = amount(verified.intact, "file");
    text += &match verified.lost.len() {
        0 => format!("{intact}: all intact\n"),
        n => format!("{intact} intact, {n} not; `specula build` remakes those that it needs\n"),
    };
    text
}

fn owner(lost: &LostBlob) -> String {
    let list = |items: &[ItemName]| items.iter().map(ItemName::to_string).collect::<Vec<_>>().join("; ");
    match (lost.items.as_slice(), lost.earlier.as_slice()) {
        ([], []) => "not used by any record".into(),
        ([], earlier) => format!("an earlier result of {}", list(earlier)),
        (items, _) => format!("the result of {}", list(items)),
    }
}

/// `12 files, 3.4 MB`
fn amount(amount: Amount, what: &str) -> String {
    format!("{}, {}", count(amount.count, what), size(amount.bytes))
}
