//! `specula cache`: what the cache holds, how it is made smaller, whether it is intact.

use std::path::Path;

use engine::cache::{self, Amount, CollectOptions, Freed, Lost, Stats, Verified};
use engine::{Error, ItemName, Patience};

use crate::arguments::{CacheCommand, ManifestArgument};
use crate::print::say;
use crate::reasons::short;
use crate::{Exit, exit, print, terminal};

pub(crate) fn run(command: &CacheCommand) -> Exit {
    let outcome = match command {
        CacheCommand::Stats { manifest, json } => cache::stats(folder(manifest)).map(|stats| match json {
            true => data(serde_json::to_string(&stats)),
            false => print::data(&describe(&stats)),
        }),
        CacheCommand::Gc { manifest, max_size, dry_run, json } => {
            let patience = Patience::default();
            let options = CollectOptions { limit: *max_size, dry_run: *dry_run, patience };
            cache::collect(folder(manifest), &options, &tell_wait).map(|freed| match json {
                true => data(serde_json::to_string(&freed)),
                false => print::data(&describe_freed(&freed, &options)),
            })
        }
        CacheCommand::Verify { manifest, json } => verify(folder(manifest), *json),
    };
    outcome.unwrap_or_else(|error| exit::of_error(&error))
}

fn verify(folder: &Path, json: bool) -> Result<Exit, Error> {
    let verified = cache::verify(folder, Patience::default(), &tell_wait)?;
    let printed = match json {
        true => data(serde_json::to_string(&verified)),
        false => print::data(&describe_verified(&verified)),
    };
    let is_intact = verified.lost.is_empty();
    Ok(if printed == Exit::Success && !is_intact { Exit::ItemsFailed } else { printed })
}

/// JSON on a line of its own.
fn data(json: serde_json::Result<String>) -> Exit {
    json.map_or(Exit::Machine, |line| print::data(&format!("{line}\n")))
}

/// The folder of a manifest, which need not exist any more.
fn folder(manifest: &ManifestArgument) -> &Path {
    match manifest.manifest.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

fn tell_wait(holder: String) {
    say!("{:>13}  for {holder}", "waiting");
}

fn describe(stats: &Stats) -> String {
    let all = stats.in_effect + stats.earlier + stats.garbage;
    let mut text = format!("{:<16}{}\n", "results", amount(all, "file"));
    for (label, part, meaning) in [
        ("in effect", stats.in_effect, "the last good outputs; they always stay"),
        ("earlier", stats.earlier, "for edits that are taken back; gc --max-size removes the oldest"),
        ("garbage", stats.garbage, "no record names it; gc removes it"),
        ("unfinished", stats.temporary, "being written now, or left by a killed process"),
    ] {
        text += &format!("  {label:<14}{:<28}{meaning}\n", amount(part, "file"));
    }
    text += &format!("{:<16}{}\n", "journal", amount(stats.journal, "line"));
    for share in &stats.stages {
        let (name, manifest) = (&share.stage, &share.manifest);
        text += &format!(
            "stage {name} ({manifest}): {} in effect, {} earlier\n",
            terminal::size(share.in_effect.bytes),
            terminal::size(share.earlier.bytes)
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
        ("unfinished files", freed.temporary),
    ];
    for (label, part) in parts.iter().filter(|(_, part)| part.count > 0) {
        text += &format!("  {label:<18}{}\n", amount(*part, "file"));
    }
    let (left, in_effect) = (amount(freed.left, "file"), terminal::size(freed.in_effect.bytes));
    text += &format!("{left} are left, {in_effect} of it the last good outputs\n");
    if let Some(limit) = options.limit.filter(|limit| freed.left.bytes > *limit) {
        text += &format!("that is more than {}: the last good outputs always stay\n", terminal::size(limit));
    }
    text
}

fn describe_verified(verified: &Verified) -> String {
    let mut text = String::new();
    for lost in &verified.lost {
        let what = if lost.damaged { "damaged, dropped" } else { "missing" };
        text += &format!("{what}: {} {}\n", short(Some(&lost.digest)), owner(lost));
    }
    let intact = amount(verified.intact, "file");
    text += &match verified.lost.len() {
        0 => format!("{intact}: every one has the bytes that it was stored with\n"),
        n => format!("{intact} are intact, {n} not; `specula build` makes again what of them is in effect\n"),
    };
    text
}

fn owner(lost: &Lost) -> String {
    let list = |items: &[ItemName]| items.iter().map(ItemName::to_string).collect::<Vec<_>>().join("; ");
    match (lost.items.as_slice(), lost.earlier.as_slice()) {
        ([], []) => "no record names it".into(),
        ([], earlier) => format!("an earlier result of {}", list(earlier)),
        (items, _) => format!("the result of {}", list(items)),
    }
}

/// `12 files, 3.4 MB`
fn amount(amount: Amount, what: &str) -> String {
    let s = if amount.count == 1 { "" } else { "s" };
    format!("{} {what}{s}, {}", amount.count, terminal::size(amount.bytes))
}

/// A size as people write it: `500M`, `2GiB`, `1.5 GB`, `1000000`. K, M, G and T are powers of 1000, Ki to Ti of 1024.
pub(crate) fn parse_size(text: &str) -> Result<u64, String> {
    let wrong =
        || format!("{text:?} is no size: write a number and K, M, G, T, KiB, MiB, GiB or TiB, as in 500M");
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let number: f64 = text[..split].parse().map_err(|_| wrong())?;
    let unit = text[split..].trim_start().to_ascii_lowercase();
    let (letter, base) = match unit.strip_suffix('b').unwrap_or(&unit) {
        "" => return whole(number).ok_or_else(wrong),
        unit => unit.strip_suffix('i').map_or((unit, 1000.0), |letter| (letter, 1024.0)),
    };
    let power = ["k", "m", "g", "t"].iter().position(|known| *known == letter).ok_or_else(wrong)?;
    whole(number * f64::powi(base, i32::try_from(power).unwrap_or_default() + 1)).ok_or_else(wrong)
}

fn whole(bytes: f64) -> Option<u64> {
    // Up to here every whole number is a f64.
    (bytes < 9e15).then(|| bytes.round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        for (text, bytes) in [
            ("0", 0),
            ("1000000", 1_000_000),
            ("12b", 12),
            ("500M", 500_000_000),
            ("500MB", 500_000_000),
            ("2GiB", 2 << 30),
            ("2gi", 2 << 30),
            ("1.5 GB", 1_500_000_000),
            ("4KiB", 4096),
            ("1T", 1_000_000_000_000),
        ] {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
        for text in ["", "M", "5X", "-5M", "5MM", "1e3", "1.2.3G", "99999999T", "5iB"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
