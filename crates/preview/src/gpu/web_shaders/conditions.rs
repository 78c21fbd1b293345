//! A shader as one text for many programs: what only some of them need is between conditions of the
//! preprocessor.
//!
//! The cases of some switches have a name each. A program defines the names of its cases, and has those
//! functions and uniforms that `main` needs then.

use std::collections::{BTreeMap, BTreeSet};

/// A switch whose cases have names.
pub(super) struct NamedCases {
    /// What is switched over.
    pub(super) selector: &'static str,
    /// The names of the cases 0, 1 and so on.
    pub(super) names: Vec<String>,
}

/// Names of which a program defines one at least; empty if all programs are meant.
type Names = BTreeSet<String>;

/// A function, a uniform, or other lines.
#[derive(Default)]
struct Part<'a> {
    /// The name of a function or a uniform.
    name: Option<&'a str>,
    /// The lines, and the named case that they are in.
    lines: Vec<(&'a str, Option<&'a str>)>,
}

/// The text with conditions around what only some cases of the switches need. Switches over constants become
/// blocks, of which a program has at most one beside the default.
pub(super) fn with_conditions(text: &str, switches: &[NamedCases]) -> String {
    let parts = parts(text, switches);
    let places: BTreeMap<&str, usize> =
        parts.iter().enumerate().filter_map(|(place, part)| Some((part.name?, place))).collect();
    let mut needed: Vec<Option<Names>> = vec![None; parts.len()];
    // The names of which one at least is defined if this one is.
    let mut implied: BTreeMap<&str, Names> = BTreeMap::new();
    // What calls a function is after it.
    for (place, part) in parts.iter().enumerate().rev() {
        let names = match (part.name, needed[place].take()) {
            (None | Some("main"), _) => Names::new(),
            (Some(_), Some(names)) => without_implied(names, &implied),
            (Some(name), None) => panic!("nothing needs {name}"),
        };
        for (line, case) in &part.lines {
            implied.extend(case.map(|case| (case, names.clone())));
            let own = case.map_or_else(|| names.clone(), |case| Names::from([case.to_owned()]));
            for other in words(line).filter_map(|word| places.get(word)).filter(|other| **other < place) {
                needed[*other] = Some(match needed[*other].take() {
                    Some(known) if known.is_empty() || own.is_empty() => Names::new(),
                    Some(known) => &known | &own,
                    None => own.clone(),
                });
            }
        }
        needed[place] = Some(names);
    }
    let mut written = String::new();
    let mut before = Names::new();
    for (part, names) in parts.iter().zip(needed.into_iter().flatten()) {
        if names != before {
            written += if before.is_empty() { "" } else { "#endif\n" };
            written += &condition(&names);
            before = names;
        }
        written += &part.written(switches);
    }
    assert!(before.is_empty(), "main is last");
    written
}

/// The names without those that are never defined without another of them.
fn without_implied(names: Names, implied: &BTreeMap<&str, Names>) -> Names {
    let is_implied = |name: &String| {
        implied.get(name.as_str()).is_some_and(|others| !others.is_empty() && others.is_subset(&names))
    };
    names.iter().filter(|name| !is_implied(name)).cloned().collect()
}

/// The line that begins a condition; none if all programs are meant.
fn condition(names: &Names) -> String {
    let defined: Vec<_> = names.iter().map(|name| format!("defined({name})")).collect();
    if defined.is_empty() { String::new() } else { format!("#if {}\n", defined.join(" || ")) }
}

/// The parts of a text, in its order.
fn parts<'a>(text: &'a str, switches: &'a [NamedCases]) -> Vec<Part<'a>> {
    let mut parts: Vec<Part<'_>> = Vec::new();
    let (mut is_inside, mut cases, mut case): (_, Option<&NamedCases>, _) = (false, None, None);
    for line in text.lines() {
        let is_constant = switches.iter().any(|of| line.starts_with(&constant(of)));
        if is_constant || line.is_empty() {
            continue;
        }
        let is_uniform = line.starts_with("uniform ") || line.starts_with("layout(std140) uniform ");
        let is_function = line.ends_with(") {") && !line.starts_with(' ');
        if is_uniform {
            let name = line.trim_end_matches([';', '}', ' ']).rsplit(' ').next();
            parts.push(Part { name, lines: vec![(line, None)] });
            continue;
        }
        if is_function {
            let name = line.split('(').next().and_then(|head| head.rsplit(' ').next());
            parts.push(Part { name, lines: Vec::new() });
            is_inside = true;
        } else if !is_inside && parts.last().is_none_or(|part| part.name.is_some()) {
            parts.push(Part::default());
        }
        if let Some(selector) = line.strip_prefix("    switch(").and_then(|rest| rest.strip_suffix(") {")) {
            cases = switches.iter().find(|of| of.selector == selector);
        }
        if let (Some(of), Some(number)) = (cases, line.strip_prefix("        case ")) {
            let number: Option<usize> = number.strip_suffix("u: {").and_then(|number| number.parse().ok());
            case = Some(of.names[number.expect("the number of a case")].as_str());
        }
        parts.last_mut().expect("a part was added").lines.push((line, case));
        match line {
            "        }" => case = None,
            "    }" => cases = None,
            "}" => is_inside = false,
            _ => {}
        }
    }
    parts
}

/// How the declaration of a constant begins whose cases are blocks.
fn constant(of: &NamedCases) -> String {
    format!("const uint {} =", of.selector)
}

impl Part<'_> {
    /// Its lines, with conditions around named cases.
    fn written(&self, switches: &[NamedCases]) -> String {
        let mut text = String::new();
        let mut is_block = false;
        for (line, case) in &self.lines {
            let of = switches.iter().find(|of| *line == format!("    switch({}) {{", of.selector));
            // The names of constants are in capitals.
            is_block |= of.is_some_and(|of| of.selector.chars().all(|letter| letter.is_ascii_uppercase()));
            let is_label = line.starts_with("        case ") || *line == "        default: {";
            text += &match case {
                Some(case) if is_label => format!("#ifdef {case}\n"),
                _ => String::new(),
            };
            text += match () {
                () if is_block && is_label => "        {",
                () if is_block && of.is_some() => "    {",
                () => line,
            };
            text += if case.is_some() && *line == "        }" { "\n#endif\n" } else { "\n" };
            is_block &= *line != "    }";
        }
        text
    }
}

/// The names, keywords and numbers of a text.
pub(super) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')
}
