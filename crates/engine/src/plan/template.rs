//! Where an item's files land: `path` templates, and the names that every system can hold.
//!
//! A template is text with `{source stage}` in it, which stands for the stem of the item's file of that stage. The
//! kind's endings are put after it. The result is a path below `out` that Linux, macOS and Windows can all hold.

use std::collections::HashMap;
use std::ops::Range;

use super::manifest::Written;
use super::source::listed;
use crate::Diagnostic;
use crate::spelling::Spelling;

/// A `path`, taken apart.
#[derive(Clone, Debug)]
pub(crate) struct Template {
    /// The place of `path`, or of the stage's header for the default.
    pub(crate) span: Range<usize>,
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
enum Part {
    Text(String),
    /// The stem of a key, by its place among the stage's keys.
    Stem(usize),
}

impl Template {
    /// The default: the stage's name, then the stems, in the order of their keys.
    pub(crate) fn of_stage(name: &str, header: Range<usize>, keys: usize) -> Self {
        let stems = (0..keys).flat_map(|key| [Part::Text("/".into()), Part::Stem(key)]);
        Self { span: header, parts: std::iter::once(Part::Text(name.into())).chain(stems).collect() }
    }

    /// Parses a `path` of a stage that has these keys.
    pub(crate) fn parse(
        written: &Written<String>,
        stage: &str,
        keys: &[&str],
        spelling: &Spelling,
        faults: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let before = faults.len();
        let places: HashMap<&str, usize> = keys.iter().copied().zip(0..).collect();
        let mut parts = Vec::new();
        let mut rest = written.value.as_str();
        while let Some(brace) = rest.find(['{', '}']) {
            parts.push(Part::Text(rest[..brace].into()));
            let end = rest[brace..].find('}').filter(|_| rest.as_bytes()[brace] == b'{');
            let Some(name) = end.map(|end| &rest[brace + 1..brace + end]).filter(|name| !name.contains('{'))
            else {
                let message = format!("{:?} has a brace without its partner", written.value);
                faults
                    .push(Diagnostic::at(written.span.clone(), message).expected("expected {SOURCE STAGE}"));
                return None;
            };
            match places.get(name) {
                Some(key) => parts.push(Part::Stem(*key)),
                None => faults.push(unknown_placeholder(name, written.span.clone(), stage, keys, spelling)),
            }
            rest = &rest[brace + name.len() + 2..];
        }
        parts.push(Part::Text(rest.into()));
        let template = Self { span: written.span.clone(), parts };
        if faults.len() == before {
            // With a plain word for every stem, what is wrong is the template's own fault.
            if let Err(problem) = check(&template.path(|_| "stem"), "\"out\"") {
                let message = format!("{:?} {}", written.value, problem.message);
                faults.push(Diagnostic::at(written.span.clone(), message).expected(problem.expected));
            }
        }
        (faults.len() == before).then_some(template)
    }

    /// The path of the item with these stems, without an ending.
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

    /// Whether a key is in it.
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
    let fault = Diagnostic::at(span, format!("{{{name}}} names no source stage of this stage's items"));
    let fault = match keys {
        [] => fault.expected("expected no {...}: the stage has one item, without a key"),
        _ => fault
            .expected(format!("expected one of: {}", listed(keys.iter().map(|key| format!("{{{key}}}"))))),
    };
    match spelling.nearest(name, keys.iter().copied()) {
        Some(near) => fault.help(format!("did you mean {{{near}}}?")),
        None if name == "stage" => fault.help(format!("write the stage's name itself: {stage}")),
        None => fault,
    }
}

/// What is wrong with a path.
#[derive(Debug)]
pub(crate) struct Problem {
    /// Goes after the path in a sentence.
    pub(crate) message: String,
    pub(crate) expected: String,
}

/// Whether a relative path with `/` between folders can be held by every system and stays within a folder.
pub(crate) fn check(path: &str, within: &str) -> Result<(), Problem> {
    /// A name's length in bytes: the limit of Linux; Windows and macOS allow as many units.
    const LONGEST: usize = 255;

    let problem =
        |message: &str, expected: &str| Err(Problem { message: message.into(), expected: expected.into() });
    let inside = &format!("expected a path inside {within}");
    let bytes = path.as_bytes();
    if path.is_empty() {
        return problem("is empty", inside);
    }
    if path.contains('\\') {
        return problem("has a \\", "expected / between folders");
    }
    if path.starts_with('/') || (bytes[0].is_ascii_alphabetic() && bytes.get(1) == Some(&b':')) {
        return problem(&format!("is absolute and leaves {within}"), inside);
    }
    for name in path.split('/') {
        if name == ".." {
            return problem(&format!("leaves {within}"), inside);
        }
        if name.is_empty() || name == "." {
            return problem("has a folder without a name", "expected one / between names");
        }
        if name.starts_with('.') {
            return problem(
                "has a hidden name; those are kept for what is being written",
                "expected a name without a dot before it",
            );
        }
        if let Some(bad) = name.chars().find(|c| c.is_control() || "<>:\"|?*".contains(*c)) {
            return problem(
                &format!("has {bad:?}, which Windows cannot have in a name"),
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
            return problem(&format!("has {name:?}, which is a device on Windows"), "expected another name");
        }
        if name.len() > LONGEST {
            return problem(&format!("has a name of more than {LONGEST} bytes"), "expected a shorter name");
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
