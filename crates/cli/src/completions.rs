//! `specula completions` and `specula man`: what shells and `man` know of the command line.
//!
//! The scripts for bash, zsh and fish ask the program itself, by the hidden command `complete`, so that all
//! three complete the same: commands, options and their values, kinds, stages, items. Only files are left to
//! the shell, which quotes and colours them in its own way.

mod candidates;

use std::fs;
use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;
use engine::{Kinds, path_text};

use crate::arguments::Arguments;
use crate::exit::Exit;
use crate::print::{self, say};

const BASH: &str = include_str!("completions/specula.bash");
const ZSH: &str = include_str!("completions/specula.zsh");
const FISH: &str = include_str!("completions/specula.fish");

/// Prints the script that completes the command line in a shell.
pub(crate) fn run(shell: Shell) -> Exit {
    let script = match shell {
        Shell::Bash => BASH.into(),
        Shell::Zsh => ZSH.into(),
        Shell::Fish => FISH.into(),
        other => {
            let mut script = Vec::new();
            clap_complete::generate(other, &mut Arguments::command(), "specula", &mut script);
            String::from_utf8_lossy(&script).into_owned()
        }
    };
    print::data(&script)
}

/// Prints what may complete the last of these words, for the scripts: on each line a word, a tab and what it
/// means; `:files` or `:folders` if the shell's own names fit.
pub(crate) fn complete(words: &[String], kinds: &Kinds) -> Exit {
    let found = candidates::of(words, kinds);
    print::data(&found.iter().map(|found| format!("{found}\n")).collect::<String>())
}

/// Writes the manual pages of all commands into a folder.
pub(crate) fn write_manual(folder: &Path) -> Exit {
    let written =
        fs::create_dir_all(folder).and_then(|()| clap_mangen::generate_to(Arguments::command(), folder));
    match written {
        Ok(()) => {
            say!(
                "Wrote the manual pages to {}; `man -l {}/specula.1` shows the first.",
                path_text(folder),
                path_text(folder)
            );
            Exit::Success
        }
        Err(error) => {
            print::error(
                &[format!("cannot write manual pages to {}", path_text(folder)), error.to_string()],
                None,
            );
            Exit::System
        }
    }
}
