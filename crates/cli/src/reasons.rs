//! Why an item ran or would run, in words.

use engine::{Cause, Digest, ItemName, Reason, Timestamp, path_text};

/// The reasons of an item; the items that would run before it share the last line.
pub(crate) fn lines(reasons: &[Reason]) -> Vec<String> {
    let (mut lines, mut awaited) = (Vec::new(), Vec::new());
    for reason in reasons {
        match reason {
            Reason::Awaits { item: from, .. } => awaited.push(from.to_string()),
            known => lines.push(line(known)),
        }
    }
    if !awaited.is_empty() {
        lines.push(format!("after {}", awaited.join(", ")));
    }
    lines
}

/// The change that caused a rerun, and the items on the way: `gold.toml changed (...) -> material [gold] ->
/// map [gold]`.
pub(crate) fn cause(cause: &Cause) -> String {
    let via = match (&cause.reason, &cause.chain[..]) {
        (_, [_]) => &[],
        (Reason::File { .. }, chain) => chain,
        (_, chain) => chain.get(1..).unwrap_or_default(),
    };
    let via = via.iter().map(|item| format!(" -> {item}"));
    format!("{}{}", origin(cause), via.collect::<String>())
}

/// The change that caused a rerun, with its item unless it is a file.
pub(crate) fn origin(cause: &Cause) -> String {
    match &cause.chain[..] {
        [first, _, ..] if !matches!(cause.reason, Reason::File { .. }) => {
            format!("{first}: {}", line(&cause.reason))
        }
        _ => line(&cause.reason),
    }
}

pub(crate) fn line(reason: &Reason) -> String {
    // A port that has the name of the stage that feeds it is not repeated.
    let at = |port: &str, from: &ItemName| {
        if port == from.stage { from.to_string() } else { format!("{port} = {from}") }
    };
    match reason {
        Reason::NeverBuilt => "never built".into(),
        Reason::FailedBefore => "its last run failed".into(),
        Reason::Parameter { name, old, new } => format!("{name} changed from {old} to {new}"),
        Reason::Awaits { item, .. } => format!("after {item}"),
        Reason::Input { port, item, new: None, .. } => format!("{} is no longer an input", at(port, item)),
        Reason::Input { port, item, old: None, .. } => format!("{} is new", at(port, item)),
        Reason::Input { port, item, old, new } => {
            format!("{} changed ({} to {})", at(port, item), short(old.as_ref()), short(new.as_ref()))
        }
        Reason::File { path, new: None, .. } => format!("{} is gone", path_text(path)),
        Reason::File { path, old: None, .. } => format!("{} is new", path_text(path)),
        Reason::File { path, old, new, old_time, new_time } => {
            let (old, new) = (dated(old.as_ref(), *old_time), dated(new.as_ref(), *new_time));
            format!("{} changed ({old} to {new})", path_text(path))
        }
        Reason::Program { name, old, new } => program(name, old.as_deref(), new.as_deref()),
        Reason::Kind { old, new } => format!("the kind was {old} and is {new}"),
        Reason::ResultLost => "its stored result is gone or damaged".into(),
        Reason::Returned => "it was removed and is back".into(),
        Reason::Forced => "forced by --force".into(),
    }
}

/// Says what PATH finds for a program now, and what it found before.
pub(crate) fn program(name: &str, old: Option<&str>, new: Option<&str>) -> String {
    match (old, new) {
        (Some(old), Some(new)) => format!("PATH finds {new} instead of {old}"),
        (Some(old), None) => format!("PATH finds no {name} any more; it found {old}"),
        (None, Some(new)) => format!("PATH finds {new}; it found no {name} before"),
        (None, None) => format!("PATH finds no {name}"),
    }
}

/// One reason in a few words, for a line below the names of the changed files.
pub(crate) fn brief(reason: &Reason, changed: &[String]) -> String {
    match reason {
        Reason::Input { item, new: None, .. } => format!("{} is no longer an input", item.stage),
        Reason::Input { item, old: None, .. } => format!("{} is new", item.stage),
        Reason::Input { item, .. } => format!("{} changed", item.stage),
        Reason::File { path, old, new, .. } => {
            let name = path.rsplit('/').next().filter(|_| changed.contains(path)).unwrap_or(path);
            let name = path_text(name);
            match (old, new) {
                (_, None) => format!("{name} is gone"),
                (None, _) => format!("{name} is new"),
                _ => format!("{name} changed"),
            }
        }
        known => line(known),
    }
}

/// A digest and when the file was written: `9d2b0c6f1a34 of 2026-03-01 09:30:05 UTC`.
pub(crate) fn dated(digest: Option<&Digest>, time: Option<Timestamp>) -> String {
    time.map_or_else(|| short(digest), |time| format!("{} of {time}", short(digest)))
}

/// The first digits of a digest, enough for people to compare.
pub(crate) fn short(digest: Option<&Digest>) -> String {
    digest.map_or_else(|| "(none)".into(), |digest| digest.to_string()[..12].to_owned())
}
