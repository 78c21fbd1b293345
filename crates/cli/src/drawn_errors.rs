//! The errors of a text file, drawn at their places.

use std::fmt;
use std::ops::Range;

use engine::{Diagnostic, Diagnostics, line_and_column};
use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents, SourceCode,
    SourceSpan, SpanContents,
};

use crate::escape::{Painted, escaped};
use crate::lists::more;
use crate::quantity::count;
use crate::terminal;

/// The first errors, each with its place, what was expected there and what to do.
pub(crate) fn drawn(diagnostics: &Diagnostics, width: usize) -> Painted {
    let theme = match (terminal::shows_unicode(), terminal::shows_colour()) {
        (true, true) => GraphicalTheme::unicode(),
        (true, false) => GraphicalTheme::unicode_nocolor(),
        (false, _) => GraphicalTheme::none(),
    };
    drawn_with(theme, width, diagnostics)
}

fn drawn_with(theme: GraphicalTheme, width: usize, diagnostics: &Diagnostics) -> Painted {
    let handler = GraphicalReportHandler::new_themed(theme).with_width(width);
    let drawn = diagnostics.shown().iter().map(|diagnostic| {
        let mut text = String::new();
        let report = MietteDiagnostic::new(diagnostics, diagnostic);
        // If the report cannot be drawn, its message is left.
        if handler.render_report(&mut text, &report).is_err() {
            text = format!("{}: {}", escaped(&diagnostics.file), report.message);
        }
        text.trim_end_matches('\n').to_owned()
    });
    let mut drawn = drawn.collect::<Vec<_>>();
    drawn.extend(more(diagnostics.more(), "more error"));
    Painted::of_escaped(drawn.join("\n"))
}

/// `pipeline.toml: 2 errors`
pub(crate) fn counted(diagnostics: &Diagnostics) -> String {
    format!("{}: {}", diagnostics.file, count(diagnostics.errors.len(), "error"))
}

/// A diagnostic for miette, in which all text from outside is escaped.
#[derive(Debug)]
struct MietteDiagnostic {
    message: String,
    label: Option<String>,
    help: Option<String>,
    excerpt: Option<Excerpt>,
}

impl MietteDiagnostic {
    fn new(diagnostics: &Diagnostics, diagnostic: &Diagnostic) -> Self {
        let shown = |text: &String| escaped(text).into_owned();
        Self {
            message: shown(&diagnostic.message),
            label: diagnostic.expected.as_ref().map(shown),
            help: diagnostic.help.as_ref().map(shown),
            excerpt: diagnostic.span.clone().map(|span| Excerpt::new(diagnostics, span)),
        }
    }
}

impl fmt::Display for MietteDiagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for MietteDiagnostic {}

impl miette::Diagnostic for MietteDiagnostic {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.excerpt.as_ref().map(|excerpt| excerpt as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.excerpt.as_ref()?.span.clone();
        let label = LabeledSpan::new(self.label.clone(), span.start, span.len());
        Some(Box::new(std::iter::once(label)))
    }
}

/// The lines around a place.
#[derive(Debug)]
struct Excerpt {
    file: String,
    text: String,
    /// The place in `text`.
    span: Range<usize>,
    /// The line where `text` begins, counted from 0.
    line: usize,
    /// The line and column of the place in the file, counted from 1.
    place: (usize, usize),
}

impl Excerpt {
    /// At most this many bytes of a place are drawn, and before and after it: a line may be as long as a
    /// file.
    const MAX_DRAWN: usize = 200;

    fn new(diagnostics: &Diagnostics, span: Range<usize>) -> Self {
        let text = diagnostics.text.as_str();
        let start = text.floor_char_boundary(span.start);
        let end = text.ceil_char_boundary(span.end.clamp(start, start + Self::MAX_DRAWN));
        let (first, last) = lines_around(text, start..end);
        let from = text.ceil_char_boundary(first.max(start.saturating_sub(Self::MAX_DRAWN)));
        let to = text.floor_char_boundary(last.min(end + Self::MAX_DRAWN));
        let [before, at, after] = [from..start, start..end, end..to].map(|part| shown(text, part));
        let before = if from > first { format!("...{before}") } else { before };
        let after = if to < last { after + "..." } else { after };
        Self {
            file: escaped(&diagnostics.file).into_owned(),
            span: before.len()..before.len() + at.len(),
            // miette does not draw a place after the last line.
            text: before + &at + &after + "\n",
            line: line_and_column(text, from).0 - 1,
            place: line_and_column(text, start),
        }
    }
}

/// The bounds of the lines around a place, from the one before it to the one after it.
fn lines_around(text: &str, place: Range<usize>) -> (usize, usize) {
    let breaks = text[..place.start].match_indices('\n').map(|(at, _)| at + 1);
    let first = breaks.rev().nth(1).unwrap_or(0);
    let mut breaks = text[place.end..].match_indices('\n').map(|(at, _)| place.end + at);
    (first, breaks.nth(1).unwrap_or(text.len()))
}

/// A part of a text as it is drawn.
fn shown(text: &str, part: Range<usize>) -> String {
    let mut shown = text[part.clone()].replace("\r\n", "\n");
    if shown.ends_with('\r') && text[part.end..].starts_with('\n') {
        shown.pop();
    }
    escaped(&shown).into_owned()
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        _lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        // If miette asks for no lines around the place, it wants to know where the place is.
        let (data, span, line, column) = if lines_before == 0 {
            let (line, column) = self.place;
            let data = self.text.get(self.span.clone()).unwrap_or_default();
            (data, *span, line - 1, column - 1)
        } else {
            (self.text.as_str(), (0..self.text.len()).into(), self.line, 0)
        };
        let lines = data.matches('\n').count() + 1;
        let contents =
            MietteSpanContents::new_named(self.file.clone(), data.as_bytes(), span, line, column, lines);
        Ok(Box::new(contents))
    }
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use super::*;

    fn drawn_for(theme: GraphicalTheme, diagnostics: &Diagnostics) -> String {
        drawn_with(theme, terminal::PLAIN_WIDTH, diagnostics).to_string()
    }

    fn check(text: &str, diagnostics: Vec<Diagnostic>, expected: Expect) {
        let diagnostics = Diagnostics::new("a\u{1b}b.toml", text, diagnostics);
        let plain = drawn_for(GraphicalTheme::unicode_nocolor(), &diagnostics);
        assert_eq!(escaped(&plain), plain, "no control character is left");
        let lines = plain.lines().map(|line| format!("{}\n", format!("|{line}").trim_end()));
        expected.assert_eq(&lines.collect::<String>());
    }

    #[test]
    fn a_diagnostic_is_drawn_at_its_place_with_hostile_text_escaped() {
        let text = "x = 1\r\nkind = \"a\u{1b}[31m\u{202e}é\" # \u{9b}\r\nlast\u{7f} = 2\r\nmore = 3\r\n";
        let place = text.find("\u{202e}").unwrap()..text.find("\" #").unwrap();
        let diagnostic =
            Diagnostic::at(place, "there is no \u{1b}[31mkind").expected("a \u{9b}").help("try \u{7}");
        check(
            text,
            vec![diagnostic],
            expect![[r#"
                |  × there is no \u{1b}[31mkind
                |   ╭─[a\u{1b}b.toml:2:15]
                | 1 │ x = 1
                | 2 │ kind = "a\u{1b}[31m\u{202e}é" # \u{9b}
                |   ·                    ────┬────
                |   ·                        ╰── a \u{9b}
                | 3 │ last\u{7f} = 2
                |   ╰────
                |  help: try \u{7}
            "#]],
        );
    }

    #[test]
    fn places_at_the_ends_of_a_text_and_of_its_lines_are_drawn() {
        let text = "a = \r\n\r\nb = 1";
        let at =
            |place: Range<usize>| Diagnostic::at(place.clone(), format!("at {place:?}")).expected("here");
        check(
            text,
            vec![at(0..1), at(4..4), at(5..5), at(6..7), at(8..9), at(13..13)],
            expect![[r#"
                |  × at 0..1
                |   ╭─[a\u{1b}b.toml:1:1]
                | 1 │ a =
                |   · ┬
                |   · ╰── here
                | 2 │
                |   ╰────
                |  × at 4..4
                |   ╭─[a\u{1b}b.toml:1:5]
                | 1 │ a =
                |   ·     ▲
                |   ·     ╰── here
                | 2 │
                |   ╰────
                |  × at 5..5
                |   ╭─[a\u{1b}b.toml:1:6]
                | 1 │ a =
                |   ·     ▲
                |   ·     ╰── here
                | 2 │
                |   ╰────
                |  × at 6..7
                |   ╭─[a\u{1b}b.toml:2:1]
                | 1 │ a =
                | 2 │
                |   · ▲
                |   · ╰── here
                | 3 │ b = 1
                |   ╰────
                |  × at 8..9
                |   ╭─[a\u{1b}b.toml:3:1]
                | 2 │
                | 3 │ b = 1
                |   · ┬
                |   · ╰── here
                |   ╰────
                |  × at 13..13
                |   ╭─[a\u{1b}b.toml:3:6]
                | 2 │
                | 3 │ b = 1
                |   ·      ▲
                |   ·      ╰── here
                |   ╰────
            "#]],
        );
        check(
            "",
            vec![at(0..0)],
            expect![[r#"
                |  × at 0..0
                |   ╭─[a\u{1b}b.toml:1:1]
                | 1 │
                |   · ▲
                |   · ╰── here
                |   ╰────
            "#]],
        );
    }

    #[test]
    fn a_part_of_a_very_long_line_is_drawn() {
        let text = format!("a = [{}]\nb = 1\n", "\u{1b}ü, ".repeat(100_000));
        let wrong = |span| Diagnostic::at(span, "wrong").expected("something else");
        let diagnostics = Diagnostics::new("x.toml", text, vec![wrong(0..300_000), wrong(300_005..300_009)]);
        let drawn = drawn_for(GraphicalTheme::unicode_nocolor(), &diagnostics);
        assert!(drawn.contains("[x.toml:1:1]") && drawn.contains("[x.toml:1:240006]"), "{drawn}");
        assert_eq!(drawn.matches("something else").count(), 2, "{drawn}");
        assert!(drawn.len() < 20_000, "{} bytes", drawn.len());
    }

    #[test]
    fn the_colours_of_the_program_are_kept() {
        let wrong = Diagnostic::at(0..1, "wrong").expected("right");
        let diagnostics = Diagnostics::new("x.toml", "a\u{1b}[31m", vec![wrong]);
        let drawn = drawn_for(GraphicalTheme::unicode(), &diagnostics);
        assert!(drawn.contains("\u{1b}[") && drawn.contains(r"a\u{1b}[31m"), "{drawn:?}");
    }
}
