//! Where an item's files are written: `path` templates, and the names that are valid on every system.
//!
//! A template is text with placeholders `{source stage}`, which stand for the stem of the item's file of that
//! stage. The kind's endings are appended. The result is a path below `out` that is valid on Linux, macOS and
//! Windows.

use std::collections::HashMap;
use std::ops::Range;

use super::manifest::Written;
use super::source::listed;
use crate::manifest::{Diagnostic, Spelling};

/// A parsed `path`.
#[derive(Clone, Debug)]
pub(crate) struct Template {
    /// The place of `path`, or of the stage's name for the default.
    pub(crate) span: Range<usize>,
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
enum Part {
    Text(String),
    /// The stem of a key, by its index among the stage's keys.
    Stem(usize),
}

impl Template {
    /// The default: the stage's name, then the stems, in the order of their keys.
    pub(crate) fn of_stage(name: &str, span: Range<usize>, keys: usize) -> Self {
        let stems = (0..keys).flat_map(|key| [Part::Text("/".into()), Part::Stem(key)]);
        Self { span, parts: std::iter::once(Part::Text(name.into())).chain(stems).collect() }
    }

    pub(crate) fn parse(
        written: &Written<String>,
        stage: &str,
        keys: &[&str],
        spelling: &Spelling,
        errors: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let before = errors.len();
        let indices: HashMap<&str, usize> = keys.iter().copied().zip(0..).collect();
        let mut parts = Vec::new();
        let mut rest = written.value.as_str();
        while let Some(brace) = rest.find(['{', '}']) {
            parts.push(Part::Text(rest[..brace].into()));
            let end = rest[brace..].find('}').filter(|_| rest.as_bytes()[brace] == b'{');
            let Some(name) = end.map(|end| &rest[brace + 1..brace + end]).filter(|name| !name.contains('{'))
            else {
                let message = format!("{:?} has an unmatched brace", written.value);
                errors
                    .push(Diagnostic::at(written.span.clone(), message).expected("expected {SOURCE STAGE}"));
                return None;
            };
            match indices.get(name) {
                Some(key) => parts.push(Part::Stem(*key)),
                None => errors.push(unknown_placeholder(name, written.span.clone(), stage, keys, spelling)),
            }
            rest = &rest[brace + name.len() + 2..];
        }
        parts.push(Part::Text(rest.into()));
        let template = Self { span: written.span.clone(), parts };
        if errors.len() == before {
            // With a plain word for every stem, only the template itself can be wrong.
            if let Err(problem) = check(&template.path(|_| "stem"), "\"out\"") {
                let message = format!("{:?} {}", written.value, problem.message);
                errors.push(Diagnostic::at(written.span.clone(), message).expected(problem.expected));
            }
        }
        (errors.len() == before).then_some(template)
    }

    /// The path of the item that has these stems, without an ending.
    pub(crate) fn path<'a>(&self, stem: impl Fn(usize) -> &'a str) -> String {
        let mut path = String::new();
        for part in &self.parts {
            path += match part {
                Part::Text(text) => text,
                Part::Stem(key) => stem(*key),
            };
        }
        path
    }

    pub(crate) fn has(&self, key: usize) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Stem(own) if *own == key))
    }
}

fn unknown_placeholder(
    name: &str,
    span: Range<usize>,
    stage: &str,
    keys: &[&str],
    spelling: &Spelling,
) -> Diagnostic {
    let error = Diagnostic::at(span, format!("{{{name}}} is not a key of this stage's items"));
    let error = match keys {
        [] => error.expected("expected no {...}: the stage has a single item without a key"),
        _ => error
            .expected(format!("expected one of: {}", listed(keys.iter().map(|key| format!("{{{key}}}"))))),
    };
    match spelling.nearest(name, keys.iter().copied()) {
        Some(near) => error.help(format!("did you mean {{{near}}}?")),
        None if name == "stage" => error.help(format!("to use the stage's name, write it: {stage}")),
        None => error,
    }
}

#[derive(Debug)]
pub(crate) struct Problem {
    /// The end of a sentence that begins with the path.
    pub(crate) message: String,
    pub(crate) expected: String,
}

/// Whether a relative path with `/` between folders is valid on every system and stays within a folder.
pub(crate) fn check(path: &str, within: &str) -> Result<(), Problem> {
    /// The length of a name in bytes that Linux allows; Windows and macOS allow as many UTF-16 units.
    const MAX_NAME: usize = 255;

    let problem =
        |message: &str, expected: &str| Err(Problem { message: message.into(), expected: expected.into() });
    let inside = &format!("expected a path inside {within}");
    let bytes = path.as_bytes();
    if path.is_empty() {
        return problem("is empty", inside);
    }
    if path.contains('\\') {
        return problem("contains a \\", "expected / between folders");
    }
    if path.starts_with('/') || (bytes[0].is_ascii_alphabetic() && bytes.get(1) == Some(&b':')) {
        return problem(&format!("is absolute and leaves {within}"), inside);
    }
    for name in path.split('/') {
        if name == ".." {
            return problem(&format!("leaves {within}"), inside);
        }
        if name.is_empty() || name == "." {
            return problem("has an empty folder name", "expected a single / between names");
        }
        if name.starts_with('.') {
            return problem(
                "has a hidden name, which is reserved for temporary files",
                "expected a name that does not start with a dot",
            );
        }
        if let Some(bad) = name.chars().find(|c| c.is_control() || "<>:\"|?*".contains(*c)) {
            return problem(
                &format!("contains {bad:?}, which Windows does not allow in names"),
                "expected another character",
            );
        }
        if name.ends_with(['.', ' ']) {
            return problem(
                "has a name that ends with a dot or a space, which Windows drops",
                "expected another ending",
            );
        }
        if is_reserved(name) {
            return problem(
                &format!("contains {name:?}, which is a device on Windows"),
                "expected another name",
            );
        }
        if name.len() > MAX_NAME {
            return problem(&format!("has a name longer than {MAX_NAME} bytes"), "expected a shorter name");
        }
    }
    Ok(())
}

/// `CON`, `nul.txt`, `Com1.exr`: names that Windows opens as devices, in every folder.
fn is_reserved(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().trim_end().to_ascii_uppercase();
    let numbered = stem.strip_prefix("COM").or_else(|| stem.strip_prefix("LPT"));
    matches!(stem.as_str(), "CON" | "PRN" | "AUX" | "NUL" | "CONIN$" | "CONOUT$")
        || numbered.is_some_and(|number| {
            matches!(number, "0" | "1" | "2" | "3" | "4" | "5" | "6" | "7" | "8" | "9" | "¹" | "²" | "³")
        })
}
