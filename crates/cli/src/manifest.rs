//! The manifest as every command loads it: a plan, or its faults drawn at their places.

use std::fmt;
use std::sync::Arc;

use engine::{Fault, Faults, Kinds, Plan};
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode};

use crate::arguments::ManifestArgument;
use crate::print::say;
use crate::quantity::count;
use crate::{Exit, terminal};

/// The plan of a manifest; where it has faults, they are printed and the exit code is given.
pub(crate) fn load(argument: &ManifestArgument, kinds: &Kinds) -> Result<Plan, Exit> {
    Plan::load(&argument.manifest, kinds).map_err(|found| {
        say!("{}", drawn(&found));
        say!("{}; nothing ran.", counted(&found));
        let manifest = &argument.manifest;
        if !manifest.exists() && !manifest.with_file_name("pipeline.toml").exists() {
            say!("hint: `specula init` writes a starter manifest");
        }
        Exit::Manifest
    })
}

/// Every fault with its place, what was expected there and what to do.
pub(crate) fn drawn(faults: &Faults) -> String {
    let source = Arc::new(NamedSource::new(&faults.file, faults.text.clone()).with_language("TOML"));
    let theme = match (terminal::shows_unicode(), terminal::shows_colour()) {
        (true, true) => GraphicalTheme::unicode(),
        (true, false) => GraphicalTheme::unicode_nocolor(),
        (false, _) => GraphicalTheme::none(),
    };
    let handler = GraphicalReportHandler::new_themed(theme).with_width(terminal::width());
    let drawn = faults.faults.iter().map(|fault| {
        let mut text = String::new();
        let report = Report { fault, source: Arc::clone(&source) };
        // A report that cannot be drawn is still told, without its picture.
        if handler.render_report(&mut text, &report).is_err() {
            text = format!("{}: {}", faults.file, fault.message);
        }
        text.trim_end_matches('\n').to_owned()
    });
    drawn.collect::<Vec<_>>().join("\n")
}

/// `pipeline.toml: 2 faults`
pub(crate) fn counted(faults: &Faults) -> String {
    format!("{}: {}", faults.file, count(faults.faults.len(), "fault"))
}

struct Report<'a> {
    fault: &'a Fault,
    source: Arc<NamedSource<String>>,
}

impl fmt::Debug for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self.fault, f)
    }
}

impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.fault.message)
    }
}

impl std::error::Error for Report<'_> {}

impl Diagnostic for Report<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        // No place of an empty file can be drawn, so that its label would be lost.
        let expected = self.fault.expected.as_ref().filter(|_| self.source.inner().is_empty());
        let lines = expected.into_iter().chain(&self.fault.help).cloned().collect::<Vec<_>>();
        (!lines.is_empty()).then(|| Box::new(lines.join("; ")) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(self.source.as_ref())
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = self.fault.span.clone()?;
        let label = LabeledSpan::new(self.fault.expected.clone(), span.start, span.len());
        Some(Box::new(std::iter::once(label)))
    }
}
