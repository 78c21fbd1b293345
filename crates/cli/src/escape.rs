//! Text from outside, made fit for a terminal.
//!
//! The names of files, manifests, and what kinds quote from files may hold anything: sequences that colour the terminal,
//! move its cursor or set its title, and characters that turn the direction of writing, so that a name reads as another
//! one. `print.rs` and `screen.rs` therefore escape all that they write. [`Painted`] alone is written as it is: text that
//! this program coloured, in which everything from outside was escaped before.

use std::borrow::Cow;
use std::fmt;

/// Text that a terminal may get as it is.
pub(crate) struct Painted(String);

impl Painted {
    /// Text with colours of our own; what is from outside in it has gone through [`escaped`].
    pub(crate) fn of_escaped(text: String) -> Self {
        Self(text)
    }

    /// Text from wherever, without colours.
    pub(crate) fn plain(text: &str) -> Self {
        Self(escaped(text).into_owned())
    }
}

impl fmt::Display for Painted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A text in which every character that a terminal acts on rather than shows is written as `\u{1b}`; lines and tabs stay.
pub(crate) fn escaped(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c.escape_unicode().to_string())
}

/// The same for JSON, which stays the same JSON: outside of its strings it has no such characters.
pub(crate) fn escaped_json(json: &str) -> Cow<'_, str> {
    replaced(json, |c| format!("\\u{:04x}", u32::from(c)))
}

fn replaced(text: &str, escape: impl Fn(char) -> String) -> Cow<'_, str> {
    let Some(first) = text.find(is_acted_on) else { return Cow::Borrowed(text) };
    let (clean, rest) = text.split_at(first);
    let mut escaped = clean.to_owned();
    for c in rest.chars() {
        if is_acted_on(c) { escaped += &escape(c) } else { escaped.push(c) }
    }
    Cow::Owned(escaped)
}

/// Control characters (C0 but line feed and tab, DEL, C1), and those that embed, override or isolate a direction.
fn is_acted_on(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        c => c.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_acts_on_is_escaped_and_all_else_stays() {
        let plain = "gold, Röhre, \u{627}\u{644}, 金\n\tline";
        assert!(matches!(escaped(plain), Cow::Borrowed(same) if same == plain));
        let hostile = "a\u{1b}[31mb\u{9b}c\u{7f}\r\u{202e}txt\u{2066}\0";
        assert_eq!(escaped(hostile), r"a\u{1b}[31mb\u{9b}c\u{7f}\u{d}\u{202e}txt\u{2066}\u{0}");
        for c in '\0'..=char::MAX {
            assert_eq!(is_acted_on(c), escaped(c.encode_utf8(&mut [0; 4])) != c.to_string(), "{c:?}");
            assert!(!escaped(c.encode_utf8(&mut [0; 4])).contains(is_acted_on), "{c:?}");
        }
    }

    #[test]
    fn json_stays_the_same_json() {
        let value = serde_json::json!({ "\u{202e}\u{7f}": ["\u{1b}\u{9b}\n", 1], "ü": null });
        for text in [value.to_string(), format!("{value:#}\n")] {
            let shown = escaped_json(&text);
            assert!(!shown.contains(is_acted_on), "{shown:?}");
            assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).unwrap(), value);
        }
    }
}
