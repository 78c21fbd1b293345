//! Edits of TOML texts. Only the edited places change: comments, order, spaces, line ends and the notation of
//! everything else stay, byte for byte.

use std::ops::Range;

use engine::{Entry, Table, Value, ValueKind};

/// A TOML text without a byte order mark, to which the spans of its content refer.
pub(crate) struct TomlText<'t>(pub(crate) &'t str);

impl TomlText<'_> {
    /// The text before a key in its line: spaces, or `stage.turned.`.
    pub(crate) fn before(&self, entry: &Entry) -> &str {
        &self.0[self.start(entry.key_span.start)..entry.key_span.start]
    }

    /// The start of the line of a place.
    fn start(&self, at: usize) -> usize {
        self.0[..at].rfind('\n').map_or(0, |newline| newline + 1)
    }

    /// The end of the line of a place, before its line end.
    fn end(&self, at: usize) -> usize {
        let end = self.0[at..].find('\n').map_or(self.0.len(), |newline| at + newline);
        if self.0[at..end].ends_with('\r') { end - 1 } else { end }
    }

    /// The end of the lines of comments that directly follow a line, unless they lead over to what is below
    /// them.
    pub(crate) fn with_comments(&self, at: usize) -> usize {
        let own = self.end(at);
        let mut end = own;
        while let Some(newline) = self.0[end..].find('\n') {
            let next = end + newline + 1;
            let next_end = self.end(next);
            match self.0[next..next_end].trim() {
                "" => return end,
                comment if comment.starts_with('#') => end = next_end,
                _ => return own,
            }
        }
        end
    }

    /// The spaces before the header that a line is under.
    pub(crate) fn indent_of_header(&self, at: usize) -> &str {
        let header = self.0[..at].lines().rfind(|line| line.trim_start().starts_with('['));
        header.map_or("", |line| &line[..line.len() - line.trim_start().len()])
    }

    /// Whether a table is between braces itself.
    pub(crate) fn is_inline(&self, table: &Table) -> bool {
        self.0[table.span.start..].starts_with('{')
    }

    pub(crate) fn replaced(&self, span: Range<usize>, new: &str) -> String {
        format!("{}{new}{}", &self.0[..span.start], &self.0[span.end..])
    }

    /// The text with an entry behind the last value of a table, in the notation of that one. `is_inline` says
    /// whether the table, or one around it, is between braces.
    pub(crate) fn with_entry(
        &self,
        table: &Table,
        is_inline: bool,
        key: &str,
        value: &str,
    ) -> Option<String> {
        let values = table.entries.iter().filter(|entry| table_of(&entry.value).is_none());
        let last = values.max_by_key(|entry| entry.value.span.end)?;
        let (before, end) = (self.before(last), last.value.span.end);
        if is_inline {
            let path = before.rfind(['{', ',']).map_or(before, |start| &before[start + 1..]);
            return Some(self.inserted(end, &format!(", {}{key} = {value}", path.trim_start())));
        }
        Some(self.with_lines(end, &format!("{before}{key} = {value}")))
    }

    pub(crate) fn inserted(&self, at: usize, new: &str) -> String {
        self.replaced(at..at, new)
    }

    /// The text with further lines behind the line of a place, whose line end they have.
    pub(crate) fn with_lines(&self, at: usize, lines: &str) -> String {
        let end = self.end(at);
        let rest = &self.0[end..];
        let is_windows = rest.starts_with('\r') || rest.is_empty() && self.0.contains("\r\n");
        let newline = if is_windows { "\r\n" } else { "\n" };
        let lines = lines.split('\n').map(|line| format!("{newline}{line}")).collect::<String>();
        self.inserted(end, &lines)
    }
}

pub(crate) fn table_of(value: &Value) -> Option<&Table> {
    match &value.kind {
        ValueKind::Table(table) => Some(table),
        _ => None,
    }
}

pub(crate) fn is_integer(value: &Value) -> bool {
    matches!(value.kind, ValueKind::Integer(_))
}

/// Writes a number as TOML has it. A whole number in place of a whole one stays without a point.
pub(crate) fn number(number: f64, in_place_of_integer: bool) -> String {
    match in_place_of_integer && number.fract() == 0.0 && number.abs() < 1e15 {
        true => format!("{number:.0}"),
        false => format!("{number:?}"),
    }
}
