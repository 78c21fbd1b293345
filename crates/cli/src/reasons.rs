//! Why something ran or would run, in words.

use std::collections::HashSet;

use engine::{Digest, ItemName, Plan, Reason};

/// Why an item ran, in one line.
pub(crate) fn past(reasons: &[Reason]) -> String {
    reasons.iter().map(line).collect::<Vec<_>>().join("; ")
}

/// What a plan connects: it tells an input that is still to be made from one that has gone.
pub(crate) struct Connections {
    /// The stage, the port and the stage whose items arrive there.
    ports: HashSet<(String, String, String)>,
    items: HashSet<ItemName>,
}

impl Connections {
    pub(crate) fn of(plan: &Plan) -> Self {
        let name = |stage: usize| plan.stages[stage].name.clone();
        let ports = plan.stages.iter().flat_map(|stage| {
            stage.inputs.iter().map(move |(port, from)| (stage.name.clone(), (*port).to_owned(), name(*from)))
        });
        let items = plan.items.iter().map(|item| ItemName { stage: name(item.stage), key: item.key.clone() });
        Self { ports: ports.collect(), items: items.collect() }
    }

    fn awaits(&self, item: &ItemName, port: &str, from: &ItemName) -> bool {
        self.items.contains(from)
            && self.ports.contains(&(item.stage.clone(), port.to_owned(), from.stage.clone()))
    }

    /// Why an item would run: inputs whose new content is not known yet share the last line.
    pub(crate) fn planned(&self, item: &ItemName, reasons: &[Reason]) -> Vec<String> {
        let (mut lines, mut awaited) = (Vec::new(), Vec::new());
        for reason in reasons {
            match reason {
                Reason::Input { port, item: from, new: None, .. } if self.awaits(item, port, from) => {
                    awaited.push(from.to_string());
                }
                known => lines.push(line(known)),
            }
        }
        if !awaited.is_empty() {
            lines.push(format!("after {}", awaited.join(", ")));
        }
        lines
    }
}

fn line(reason: &Reason) -> String {
    let at = |port: &str, item: &ItemName| {
        if port == item.stage { item.to_string() } else { format!("{port} = {item}") }
    };
    match reason {
        Reason::NeverBuilt => "never built".into(),
        Reason::FailedBefore => "its last run failed".into(),
        Reason::Parameter { name, old, new } => format!("{name} changed from {old} to {new}"),
        Reason::Input { port, item, new: None, .. } => format!("{} no longer arrives", at(port, item)),
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
