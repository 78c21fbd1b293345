//! Names of nodes and lamps, with `*` for any characters.

use engine::serde_json::{self, json};
use engine::{Diagnostic, Parameter, Value, unexpected};

/// A name in a manifest in which `*` stands for any characters, or none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NamePattern(String);

impl NamePattern {
    /// Whether a name is meant.
    pub(crate) fn matches(&self, name: &str) -> bool {
        let mut parts = self.0.split('*');
        let Some(rest) = parts.next().and_then(|first| name.strip_prefix(first)) else { return false };
        let parts: Vec<&str> = parts.collect();
        let Some((last, between)) = parts.split_last() else { return rest.is_empty() };
        let mut rest = rest;
        for part in between {
            let Some(at) = rest.find(part) else { return false };
            rest = &rest[at + part.len()..];
        }
        rest.ends_with(last)
    }
}

impl Parameter for NamePattern {
    fn expected() -> String {
        "a name, with * for any characters".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let name = String::parse(value).ok().filter(|name| !name.is_empty());
        name.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        json!(self.0)
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "string", "minLength": 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_characters() {
        let matches = |pattern: &str, name: &str| NamePattern(pattern.into()).matches(name);
        for (pattern, name) in
            [("sun", "sun"), ("*", ""), ("probes_*", "probes_"), ("*_box*", "a_box.001"), ("a*b*b", "abab b")]
        {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in [("sun", "sun.001"), ("a*a", "a"), ("probes_*", "Probes_1"), ("a*b*b", "ab")] {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }
}
