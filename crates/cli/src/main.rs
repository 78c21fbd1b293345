//! The `specula` command with the kinds of this workspace.

use std::process::ExitCode;

/// The allocator of musl has one lock for all threads: the sample takes five times the system time.
#[cfg(target_env = "musl")]
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    cli::main(cli::kinds())
}
