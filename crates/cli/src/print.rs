//! The two streams, and the only place that writes to them. `println!` and its like panic where the reader has gone
//! away (`specula stages | head -1`), so Clippy forbids them here as everywhere. What is written is fit for a terminal,
//! whether or not there is one: `escape.rs` has gone over it.

use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use engine::{Event, EventLine};
use serde_json::Value;

use crate::Exit;
use crate::escape::{Painted, escaped, escaped_json};

/// [`message`] with the arguments of `format!`.
macro_rules! say {
    ($($argument:tt)*) => { crate::print::message(&format!($($argument)*)) };
}
pub(crate) use say;

/// Writes a command's whole result to standard output. A reader that wants no more of it is no error.
pub(crate) fn data(text: &str) -> Exit {
    finished(written(&escaped(text)))
}

fn finished(written: io::Result<()>) -> Exit {
    match written {
        Ok(()) => Exit::Success,
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Exit::Success,
        Err(error) => {
            message(&format!("error: cannot write to standard output: {error}"));
            Exit::Machine
        }
    }
}

/// Writes to standard output, at once.
fn written(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
}

/// The version of what [`json`] writes: raised where a field goes or means something else, not where one is added.
const VERSION: u32 = 1;

/// Writes what a command found as one line of JSON, an object that holds its version as `v`.
pub(crate) fn json(mut found: Value) -> Exit {
    if let Some(object) = found.as_object_mut() {
        object.insert("v".into(), VERSION.into());
    }
    finished(written(&escaped_json(&format!("{found}\n"))))
}

/// The events of a command on standard output, a line of JSON each. A reader that has gone away does not stop the build,
/// nor does a full disk: that is told once, and the rest is not written.
#[derive(Default)]
pub(crate) struct EventStream {
    is_unheard: AtomicBool,
    is_torn: AtomicBool,
}

impl EventStream {
    pub(crate) fn write(&self, event: Event) {
        if self.is_unheard() || self.is_torn() {
            return;
        }
        let line = serde_json::to_string(&EventLine::now(event)).map_err(io::Error::other);
        match line.and_then(|line| written(&escaped_json(&(line + "\n")))) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::BrokenPipe => {
                self.is_unheard.store(true, Ordering::Relaxed);
            }
            Err(error) => {
                self.is_torn.store(true, Ordering::Relaxed);
                message(&format!("error: cannot write to standard output: {error}"));
            }
        }
    }

    /// Whether its reader has gone away.
    pub(crate) fn is_unheard(&self) -> bool {
        self.is_unheard.load(Ordering::Relaxed)
    }

    /// Whether its reader lacks something.
    pub(crate) fn is_torn(&self) -> bool {
        self.is_torn.load(Ordering::Relaxed)
    }
}

/// Writes what went wrong, what led to it, and what to do.
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

/// Writes a line that has colours to standard error. If even that fails, nobody is left to be told.
pub(crate) fn painted(line: &Painted) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}
