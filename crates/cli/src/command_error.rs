//! Why a command cannot continue, and the one place that reports it: to people on standard error and, with
//! `--json`, to programs on standard output.

use std::fmt;

use engine::{Diagnostics, Error, ErrorKind, Event};
use serde_json::json;

use crate::arguments::JsonOutput;
use crate::drawn_errors;
use crate::exit::Exit;
use crate::print::{self, EventStream, say};
use crate::terminal;

/// An error that ends a command.
#[derive(Debug, PartialEq)]
pub(crate) struct CommandError {
    exit: Exit,
    /// What happened, then its causes.
    chain: Vec<String>,
    help: Option<String>,
    /// The errors of a text file, if the command cannot continue because of them.
    diagnostics: Option<Box<Diagnostics>>,
    /// Whether the lines of that file are not shown, because they may hold secrets.
    hides_text: bool,
}

impl CommandError {
    /// The error of a command line that names something that does not exist or is of no use.
    pub(crate) fn usage(chain: impl Into<Vec<String>>) -> Self {
        Self::new(Exit::Usage, chain.into())
    }

    /// The error of an operation that the system refused.
    pub(crate) fn system(message: impl Into<String>, cause: &dyn std::error::Error) -> Self {
        Self::new(Exit::System, vec![message.into(), cause.to_string()])
    }

    pub(crate) fn manifest(diagnostics: Diagnostics) -> Self {
        let chain = vec![drawn_errors::counted(&diagnostics)];
        Self { diagnostics: Some(Box::new(diagnostics)), ..Self::new(Exit::Manifest, chain) }
    }

    pub(crate) fn settings(diagnostics: Diagnostics) -> Self {
        let chain = diagnostics.to_string().lines().map(str::to_owned).collect();
        Self {
            diagnostics: Some(Box::new(diagnostics)),
            hides_text: true,
            ..Self::new(Exit::Manifest, chain)
        }
    }

    fn new(exit: Exit, chain: Vec<String>) -> Self {
        Self { exit, chain, help: None, diagnostics: None, hides_text: false }
    }

    #[must_use]
    pub(crate) fn with_help(self, help: Option<impl Into<String>>) -> Self {
        Self { help: help.map(Into::into), ..self }
    }

    /// What happened with its causes, or each error of a file with its place.
    pub(crate) fn in_full(&self) -> String {
        self.diagnostics.as_ref().map_or_else(|| self.to_string(), |diagnostics| diagnostics.to_string())
    }

    /// What to do.
    pub(crate) fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Reports the error, and returns the exit code of the command.
    pub(crate) fn report(self, json: Option<JsonOutput>) -> Exit {
        json.iter().for_each(|json| self.report_json(*json));
        self.print()
    }

    pub(crate) fn report_json(&self, json: JsonOutput) {
        let Self { chain, help, diagnostics, .. } = self;
        match json {
            JsonOutput::Object => {
                print::json(json!({ "error": chain, "help": help, "diagnostics": diagnostics }));
            }
            JsonOutput::Events => EventStream::default().write(match diagnostics {
                Some(diagnostics) => Event::Rejected { diagnostics: Diagnostics::clone(diagnostics) },
                None => Event::BuildError { error: chain.clone(), help: help.clone() },
            }),
        }
    }

    /// Prints the error for people, and returns the exit code of the command.
    pub(crate) fn print(self) -> Exit {
        match &self.diagnostics {
            Some(diagnostics) if !self.hides_text => {
                print::painted(&drawn_errors::drawn(diagnostics, terminal::width()));
                say!("{}; nothing ran.", self.chain.join(": "));
                self.help.iter().for_each(|help| say!("hint: {help}"));
            }
            _ => print::error(&self.chain, self.help.as_deref()),
        }
        self.exit
    }
}

impl From<Error> for CommandError {
    fn from(error: Error) -> Self {
        let exit = if error.kind() == ErrorKind::UnknownTarget { Exit::Usage } else { Exit::System };
        Self::new(exit, error.chain().to_vec()).with_help(error.help())
    }
}

impl fmt::Display for CommandError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.chain.join(": "))
    }
}
