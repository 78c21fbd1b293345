//! `specula completions` and `specula man`: what shells and `man` know of the command line.

use std::fs;
use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::arguments::Arguments;
use crate::exit::Exit;
use crate::print::{self, say};

/// Prints the script that completes the command line in a shell.
pub(crate) fn run(shell: Shell) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "specula", &mut script);
    print::data(&String::from_utf8_lossy(&script))
}

/// Writes the manual pages of all commands into a folder.
pub(crate) fn write_manual(folder: &Path) -> Exit {
    let written =
        fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(Arguments::command(), folder));
    match written {
        Ok(()) => {
            say!(
                "Wrote the manual pages to {}; `man -l {}/specula.1` shows the first.",
                folder.display(),
                folder.display()
            );
            Exit::Success
        }
        Err(error) => {
            print::error(
                &[format!("cannot write manual pages to {}", folder.display()), error.to_string()],
                None,
            );
            Exit::System
        }
    }
}
