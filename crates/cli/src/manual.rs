//! `specula stages`: the manual pages of the kinds.

use engine::{ErasedKind, Kinds};

use crate::exit::Exit;
use crate::print::{self, say};

pub(crate) fn run(name: Option<&str>, kinds: &Kinds) -> Exit {
    let Some(name) = name else {
        let lines = kinds.iter().map(|kind| format!("{:<24} {}\n", kind.name(), kind.summary()));
        return print::data(&lines.collect::<String>());
    };
    match kinds.get(name) {
        Some(kind) => print::data(&page(kind.as_ref())),
        None => {
            say!("error: there is no kind {name:?}");
            match engine::nearest(name, kinds.iter().map(|kind| kind.name())) {
                Some(near) => say!("hint: did you mean {near:?}?"),
                None => say!("hint: `specula stages` lists the kinds"),
            }
            Exit::Usage
        }
    }
}

/// The whole page, Markdown.
fn page(kind: &dyn ErasedKind) -> String {
    let mut text = format!("# {}\n\n{}\n", kind.name(), kind.manual().trim_end());
    text += "\n## Ports\n\n";
    if kind.has_source() {
        let or = kind.built_in_parameter().map(|name| format!(" `{name}` can take its place."));
        text += "- `source`: a path relative to the manifest, or a glob that makes an item of each file.";
        text += &format!("{}\n", or.unwrap_or_default());
    }
    for port in kind.ports() {
        let many = if port.many { ", all items with matching keys" } else { "" };
        let optional = if port.optional { ", optional" } else { "" };
        text += &format!("- `{}`: {}{many}{optional}.\n", port.name, port.takes_text());
    }
    text += "\n## Parameters\n\n";
    let fields = kind.fields();
    if fields.is_empty() {
        text += "None.\n";
    }
    for field in fields {
        let default = match &field.default {
            Some(serde_json::Value::Null) => "optional".to_owned(),
            Some(value) => format!("default {value}"),
            None => "required".to_owned(),
        };
        text += &format!("- `{}` ({}; {default}): {}\n", field.name, field.expected, field.doc);
    }
    text += &format!("\nRevision {}.\n", kind.revision());
    text
}
