//! The `specula` command line over a list of kinds.
//!
//! A studio that writes its own kinds makes a binary whose `main` calls [`main`] with
//! `cli::kinds().with(ItsKind)`.
//!
//! Data (`--json` events, graphs, manual pages, explanations) goes to standard output, everything else to
//! standard error. [`Exit`] lists the exit codes.

#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arguments;
mod assets;
mod build;
mod build_reporter;
mod cache;
mod check;
mod command_error;
mod completions;
mod convert;
mod convert_sh;
mod drawn_errors;
mod escape;
mod exit;
mod explain;
mod globs;
mod gltf_materials;
mod graph;
mod init;
mod inspect;
mod lists;
mod manifest;
mod manual;
mod one_build;
mod outstanding;
mod panics;
mod png_file;
mod preview;
mod print;
mod process_arguments;
mod prune;
mod quantity;
mod reasons;
mod recognise;
mod remote_options;
mod removals;
mod run_item;
mod sample;
mod schema;
mod screen;
mod settings;
mod standard_pipeline;
mod terminal;
mod test_pattern;
mod timings;
mod verify;
mod version;
mod warning_groups;
mod watch;
mod watch_reporter;
mod working_folder;

use std::process::ExitCode;

use engine::{Kinds, path_text};

use crate::arguments::{Arguments, Command};
use crate::command_error::CommandError;

pub use crate::exit::Exit;

/// Every kind of Specula: those of `stages`, then those of `mesh-stages` and of `probe-stages`, each in the
/// order in which a pipeline uses them.
pub fn kinds() -> Kinds {
    probe_stages::add_to(mesh_stages::add_to(stages::kinds()))
}

/// Runs the command line of this process with a list of kinds, and returns its exit code.
pub fn main(kinds: Kinds) -> ExitCode {
    match process_arguments::parse() {
        Ok(arguments) => panics::reported_once(|| run(arguments, &kinds)).into(),
        Err(exit) => exit,
    }
}

fn run(arguments: Arguments, kinds: &Kinds) -> Exit {
    let Arguments { working_folder, color, mut command, .. } = arguments;
    let json = command.json();
    terminal::want_colour(color);
    if let Some(folder) = working_folder
        && let Err(error) = working_folder::enter(&folder)
    {
        let message = format!("cannot work in {}: {error}", path_text(folder));
        return CommandError::usage([message]).report(json);
    }
    if let Some(manifest) = command.manifest_mut() {
        manifest::find(manifest);
    }
    let result = match command {
        Command::Build(arguments) => build::run(&arguments, kinds),
        Command::Watch(arguments) if arguments.preview || arguments.serve.is_some() => {
            Ok(preview::run_with_watch(&arguments, kinds))
        }
        Command::Watch(arguments) => Ok(watch::run(&arguments, kinds)),
        Command::Preview(arguments) => {
            let (Ok(exit) | Err(exit)) = preview::run(&arguments, kinds);
            Ok(exit)
        }
        Command::Cache { command } => cache::run(&command),
        Command::Prune { query, dry_run } => prune::run(&query, dry_run),
        Command::Explain(arguments) => explain::run(&arguments, kinds),
        Command::Verify(arguments) => verify::run(&arguments, kinds),
        Command::Check(arguments) => check::run(&arguments, kinds),
        Command::Graph(arguments) => graph::run(&arguments, kinds),
        Command::Stages { kind } => Ok(manual::run(kind.as_deref(), kinds)),
        Command::Schema { subject } => Ok(schema::run(subject, kinds)),
        Command::Inspect { file, shader: Some(language), .. } => inspect::print_shader(&file, language),
        Command::Inspect { file, json, picture, shader: None } => {
            inspect::run(&file, json, picture.as_deref())
        }
        Command::Convert(arguments) => convert::run(&arguments, kinds),
        Command::ConvertSh(arguments) => convert_sh::run(&arguments),
        Command::TestPattern(arguments) => test_pattern::run(&arguments, kinds),
        Command::Init { folder, engine, sample, materials } => {
            Ok(init::run(&folder, engine.as_deref(), sample, materials, kinds))
        }
        Command::Completions { shell } => Ok(completions::run(shell)),
        Command::Complete { words } => Ok(completions::complete(&words, kinds)),
        Command::RunItem { item } => run_item::run(&item, kinds),
        Command::Man { folder } => Ok(completions::write_manual(&folder)),
    };
    result.unwrap_or_else(|error| error.report(json))
}
