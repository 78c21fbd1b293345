//! Why something ran or would run, in words.

use engine::{Digest, ItemName, Reason};

/// Why an item ran, in one line.
pub(crate) fn past(reasons: &[Reason]) -> String {
    lines(reasons, "no longer arrives").join("; ")
}

/// Why an item would run, in one line.
pub(crate) fn planned(reasons: &[Reason]) -> String {
    planned_lines(reasons).join("; ")
}

/// Why an item would run: inputs whose new content is not known yet share the last line.
pub(crate) fn planned_lines(reasons: &[Reason]) -> Vec<String> {
    let (waiting, known): (Vec<_>, Vec<_>) =
        reasons.iter().cloned().partition(|reason| matches!(reason, Reason::Input { new: None, .. }));
    let mut lines = lines(&known, "");
    let names = waiting.iter().filter_map(|reason| match reason {
        Reason::Input { item, .. } => Some(item.to_string()),
        _ => None,
    });
    let names = names.collect::<Vec<_>>();
    if !names.is_empty() {
        lines.push(format!("after {}", names.join(", ")));
    }
    lines
}

fn lines(reasons: &[Reason], gone: &str) -> Vec<String> {
    reasons.iter().map(|reason| line(reason, gone)).collect()
}

fn line(reason: &Reason, gone: &str) -> String {
    let at = |port: &str, item: &ItemName| {
        if port == item.stage { item.to_string() } else { format!("{port} = {item}") }
    };
    match reason {
        Reason::NeverBuilt => "never built".into(),
        Reason::FailedBefore => "its last run failed".into(),
        Reason::Parameter { name, old, new } => format!("{name} changed from {old} to {new}"),
        Reason::Input { port, item, new: None, .. } => format!("{} {gone}", at(port, item)),
        Reason::Input { port, item, old: None, .. } => format!("{} is new", at(port, item)),
        Reason::Input { port, item, old, new } => {
            format!("{} changed ({} to {})", at(port, item), short(old.as_ref()), short(new.as_ref()))
        }
        Reason::File { path, new: None, .. } => format!("{path} is gone"),
        Reason::File { path, old: None, .. } => format!("{path} is new"),
        Reason::File { path, old, new } => {
            format!("{path} changed ({} to {})", short(old.as_ref()), short(new.as_ref()))
        }
        Reason::Kind { old, new } => format!("the kind was {old} and is {new}"),
        Reason::ResultLost => "its stored result is gone or damaged".into(),
    }
}

/// The first digits of a digest, enough to compare by eye.
pub(crate) fn short(digest: Option<&Digest>) -> String {
    digest.map_or_else(|| "(none)".into(), |digest| digest.to_string()[..12].to_owned())
}
