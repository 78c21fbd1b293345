//! The `specula` command with the kinds of this workspace.

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main(cli::kinds())
}
