//! The `specula` command of a studio: all kinds of Specula, and one of its own.

mod clamp_fireflies;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main(cli::kinds().with(clamp_fireflies::ClampFireflies))
}
