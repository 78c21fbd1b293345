//! The two streams, and the only place that writes to them. `println!` and its like panic where the reader has gone
//! away (`specula stages | head -1`), so Clippy forbids them here as everywhere.

use std::io::{self, ErrorKind, Write};

use engine::{Event, EventLine};

use crate::Exit;

/// Writes a command's whole result to standard output. A reader that wants no more of it is no error.
pub(crate) fn data(text: &str) -> Exit {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Ok(()) => Exit::Success,
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Exit::Success,
        Err(error) => {
            message(&format!("error: cannot write to standard output: {error}"));
            Exit::Machine
        }
    }
}

/// Writes one event on a line of its own. A reader that has gone away does not stop the build, nor does a full disk.
pub(crate) fn event(event: Event) -> Exit {
    serde_json::to_string(&EventLine::now(event)).map_or(Exit::Machine, |line| data(&(line + "\n")))
}

/// Writes a line to standard error. Where even that fails, nobody is left to be told.
pub(crate) fn message(line: &str) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// [`message`] with the arguments of `format!`.
macro_rules! say {
    ($($argument:tt)*) => { crate::print::message(&format!($($argument)*)) };
}
pub(crate) use say;
