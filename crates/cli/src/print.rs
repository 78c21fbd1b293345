//! The two streams, and the only place that writes to them.
//!
//! `println!` and its like panic if the reader has gone away (`specula stages | head -1`), so Clippy forbids
//! them here as everywhere. Everything is escaped for a terminal (`escape.rs`), whether or not there is one.

use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use engine::{Event, EventLine};
use serde_json::Value;

use crate::escape::{Painted, escaped, escaped_json};
use crate::exit::Exit;

/// [`message`] with the arguments of `format!`.
macro_rules! say {
    ($($argument:tt)*) => { crate::print::message(&format!($($argument)*)) };
}
pub(crate) use say;

/// Writes a command's whole result to standard output. It is not an error if the reader stops reading.
pub(crate) fn data(text: &str) -> Exit {
    exit_of(written(&escaped(text)))
}

fn exit_of(written: io::Result<()>) -> Exit {
    match written {
        Ok(()) => Exit::Success,
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Exit::Success,
        Err(error) => {
            say!("error: cannot write to standard output: {error}");
            Exit::System
        }
    }
}

/// Writes to standard output, at once.
fn written(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
}

/// The version of the JSON that commands print: raised if a field goes or changes its meaning, not if one is
/// added.
const VERSION: u32 = 1;

/// Writes a command's result as one line of JSON: an object, with the version of its format as `v`.
pub(crate) fn json(mut result: Value) -> Exit {
    if let Some(object) = result.as_object_mut() {
        object.insert("v".into(), VERSION.into());
    }
    exit_of(written(&escaped_json(&format!("{result}\n"))))
}

/// The events of a command on standard output, each as a line of JSON. Neither a reader that has gone away
/// nor a full disk stops the build: a write error is reported once, and the rest of the events is dropped.
#[derive(Default)]
pub(crate) struct EventStream {
    reader_gone: AtomicBool,
    failed: AtomicBool,
}

impl EventStream {
    pub(crate) fn write(&self, event: Event) {
        if self.reader_gone() || self.failed() {
            return;
        }
        let line = serde_json::to_string(&EventLine::now(event)).map_err(io::Error::other);
        let result = line.and_then(|line| written(&escaped_json(&(line + "\n"))));
        if result.as_ref().is_err_and(|error| error.kind() == ErrorKind::BrokenPipe) {
            self.reader_gone.store(true, Ordering::Relaxed);
        }
        if exit_of(result) != Exit::Success {
            self.failed.store(true, Ordering::Relaxed);
        }
    }

    /// Whether the reader has gone away.
    pub(crate) fn reader_gone(&self) -> bool {
        self.reader_gone.load(Ordering::Relaxed)
    }

    /// Whether events were lost because they could not be written.
    pub(crate) fn failed(&self) -> bool {
        self.failed.load(Ordering::Relaxed)
    }
}

/// Writes what went wrong, its causes, and what to do.
pub(crate) fn error(chain: &[String], help: Option<&str>) {
    for (index, cause) in chain.iter().enumerate() {
        say!("{}{cause}", if index == 0 { "error: " } else { "  " });
    }
    if let Some(help) = help {
        say!("hint: {help}");
    }
}

/// Writes a line to standard error.
pub(crate) fn message(line: &str) {
    painted(&Painted::plain(line));
}

/// Writes a line that has colours to standard error. If even that fails, there is no other place for a
/// message.
pub(crate) fn painted(line: &Painted) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
