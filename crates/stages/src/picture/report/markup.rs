//! Markup under construction.

use std::fmt::{Arguments, Write as _};

/// The text of a page.
#[derive(Default)]
pub(crate) struct Markup(pub(crate) String);

impl Markup {
    pub(crate) fn put(&mut self, text: Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.0.write_fmt(text);
    }

    pub(crate) fn line(&mut self, text: &str) {
        self.0.push_str(text);
        self.0.push('\n');
    }
}
