//! Building a manifest that only exists for one command.

use std::fs;
use std::path::{Path, PathBuf};

use engine::{BuildOptions, Cancel, Event, Kinds, Plan};

use crate::arguments::MANIFEST;
use crate::build::{exit_of, stop_on_interrupt};
use crate::build_reporter::BuildReporter;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print::say;
use crate::quantity::count;

/// Builds a manifest in a temporary folder, and moves what it made to its places, where each file appears as
/// a whole. `text` is the manifest, given that folder; `place` says where a file of its output belongs.
pub(crate) fn build(
    text: impl FnOnce(&Path) -> String,
    kinds: &Kinds,
    output: &Path,
    place: impl Fn(&str) -> PathBuf,
) -> Result<Exit, CommandError> {
    let failed = |what: String, error: std::io::Error| CommandError::system(what, &error);
    let folder = tempfile::Builder::new().prefix("specula-").tempdir();
    let folder = folder.map_err(|error| failed("cannot create a temporary folder".into(), error))?;
    let manifest = folder.path().join(MANIFEST);
    fs::write(&manifest, text(folder.path()))
        .map_err(|error| failed(format!("cannot write {}", manifest.display()), error))?;
    let plan = Plan::load(&manifest, kinds).map_err(|diagnostics| {
        // The options are the parameters: whoever typed them knows no manifest.
        let mut errors = diagnostics.shown().iter().map(|diagnostic| {
            let parts = [Some(&diagnostic.message), diagnostic.expected.as_ref()];
            let chain: Vec<String> = parts.into_iter().flatten().cloned().collect();
            CommandError::usage(chain).with_help(diagnostic.help.as_deref())
        });
        let last = errors.next_back();
        errors.for_each(|error| _ = error.print());
        last.unwrap_or_else(|| CommandError::manifest(diagnostics.clone()))
    })?;
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let options = BuildOptions { keep_going: true, ..BuildOptions::default() };
    let reporter = BuildReporter::quiet();
    let summary = engine::build(&plan, &options, &cancel, &|event: Event| reporter.show(&event));
    reporter.show_failures();
    let summary = summary?;
    let mut written = 0;
    for item in plan.items.iter() {
        let made: Vec<_> = item.files.iter().filter(|file| plan.out.join(file).exists()).collect();
        if made.is_empty() || made.len() < item.files.len() {
            continue;
        }
        for file in made {
            let place = place(file);
            put(&plan.out.join(file), &place)
                .map_err(|error| failed(format!("cannot write {}", place.display()), error))?;
            written += 1;
        }
    }
    if written > 0 {
        say!("Wrote {} to {}.", count(written, "file"), output.display());
    }
    Ok(exit_of(&summary))
}

/// Moves a file to a place.
fn put(from: &Path, to: &Path) -> std::io::Result<()> {
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent)?;
    }
    engine::replace_file(to, &engine::read_file(from)?)
}
