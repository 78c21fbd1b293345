//! Metal's textures, which functions take.

use std::collections::BTreeSet;

use super::resource::{Resource, ResourceKind};
use super::words::{code_and_comment, pieces};

/// The beginning of a text, with what functions take in a comment.
pub(super) fn declarations(resources: &[Resource]) -> String {
    let mut text = String::from("#include <metal_stdlib>\nusing namespace metal;\n");
    if !resources.is_empty() {
        text += "// Functions that read textures take first, in this order:\n";
    }
    for resource in resources {
        let comment = match resource.kind {
            ResourceKind::Sampler(comment) => format!("  // {comment}"),
            _ => String::new(),
        };
        text += &format!("//   {}{comment}\n", resource.metal());
    }
    text
}

/// The text in which functions that read resources take them, and so do those that call these.
pub(super) fn with_resources(text: &str, resources: &[Resource]) -> String {
    let takers = takers(text, resources);
    let parameters: Vec<_> = resources.iter().map(Resource::metal).collect();
    let arguments: Vec<_> = resources.iter().map(|resource| resource.name).collect();
    let lines = text.lines().map(|line| {
        let (code, comment) = code_and_comment(line);
        let list = if declared(code).is_some() { parameters.join(", ") } else { arguments.join(", ") };
        let mut found = String::new();
        let mut is_taker = false;
        for piece in pieces(code) {
            match piece.strip_prefix('(').filter(|_| is_taker) {
                Some(rest) => {
                    let comma = if rest.starts_with(')') { "" } else { ", " };
                    found += &format!("({list}{comma}{rest}");
                }
                None => found += piece,
            }
            is_taker = takers.contains(piece);
        }
        found + comment + "\n"
    });
    lines.collect()
}

/// The name of the function that a line begins.
fn declared(code: &str) -> Option<&str> {
    let is_head = !code.starts_with([' ', '}']) && code.trim_end().ends_with('{');
    code.split_once('(').filter(|_| is_head)?.0.rsplit(' ').next()
}

/// The functions that read a resource, also through others.
fn takers<'a>(text: &'a str, resources: &[Resource]) -> BTreeSet<&'a str> {
    let mut words: Vec<(&str, BTreeSet<&str>)> = Vec::new();
    for line in text.lines() {
        let (code, _) = code_and_comment(line);
        match (declared(code), words.last_mut()) {
            (Some(name), _) => words.push((name, BTreeSet::new())),
            (None, Some((_, of))) => of.extend(pieces(code)),
            (None, None) => {}
        }
    }
    let mut takers = BTreeSet::new();
    loop {
        let takes = |of: &BTreeSet<&str>| {
            resources.iter().any(|resource| of.contains(resource.name)) || !of.is_disjoint(&takers)
        };
        let found: BTreeSet<_> = words.iter().filter(|(_, of)| takes(of)).map(|(name, _)| *name).collect();
        if found == takers {
            return takers;
        }
        takers = found;
    }
}
