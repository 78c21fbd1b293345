//! The end-to-end tests of the program, one file each.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod support;

mod cache_commands;
mod ci;
mod completions;
mod convert;
mod corpus;
mod errors_as_data;
mod events;
mod full_disk;
#[cfg(unix)]
mod hostile_names;
mod inspect_picture;
mod junit;
mod killed;
mod killed_watching;
mod manifest_errors;
mod many_failures;
mod preview;
mod preview_page;
#[cfg(all(target_os = "linux", feature = "window"))]
mod preview_window;
#[cfg(unix)]
mod programs;
#[cfg(unix)]
mod random_edits;
#[cfg(feature = "remote")]
mod remote;
#[cfg(feature = "remote")]
mod remote_execution;
#[cfg(feature = "remote")]
mod remote_faults;
#[cfg(feature = "remote")]
mod remote_servers;
mod removed_files;
mod sample;
mod schema;
mod timings;
mod two_processes;
mod watching;
mod why;
#[cfg(windows)]
mod windows;
mod without_manifest;
