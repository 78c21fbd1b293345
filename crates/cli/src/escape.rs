//! Text from outside, made safe for a terminal.
//!
//! File names, manifests, and text that kinds quote from files may contain anything: sequences that colour
//! the terminal, move its cursor or set its title, and characters that reverse the direction of writing, so
//! that one name looks like another. `print.rs` and `screen.rs` therefore escape everything that they write,
//! except [`Painted`]: text that this program coloured after it escaped everything from outside.

use std::borrow::Cow;
use std::fmt;

/// Text that is safe for a terminal.
pub(crate) struct Painted(String);

impl Painted {
    /// Text with colours of this program, in which text from outside is [`escaped`].
    pub(crate) fn of_escaped(text: String) -> Self {
        Self(text)
    }

    /// Text from outside, which is escaped.
    pub(crate) fn plain(text: &str) -> Self {
        Self(escaped(text).into_owned())
    }
}

impl fmt::Display for Painted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Writes every character that a terminal acts on, except line feeds and tabs, as `\u{1b}`.
pub(crate) fn escaped(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c.escape_unicode().to_string())
}

/// Writes every character of JSON that a terminal acts on as `\u001b`. The meaning stays the same, because
/// JSON can have such characters only in its strings.
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

/// Whether a terminal acts on a character: control characters (C0 except line feed and tab, DEL, C1), and
/// those that embed, override or isolate a direction.
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
    fn characters_that_a_terminal_acts_on_are_escaped_and_others_stay() {
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
