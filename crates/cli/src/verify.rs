//! `specula verify`: whether exported files match their recipes, and whether they are up to date.

mod many;

use std::fmt::Write;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use engine::{ContentState, Kinds, Plan, ReadKind, RecipeState, SourceFile, Verification, path_text};
use serde_json::json;

use crate::arguments::VerifyArguments;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::reasons::{cause, dated, program, short};
use crate::{manifest, print};

pub(crate) fn run(arguments: &VerifyArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let plan = manifest::load(&arguments.query.manifest, kinds)?;
    let json = arguments.query.json;
    let (printed, is_current) = match &arguments.files[..] {
        [file] if !many::is_many(&plan, file) => verify_file(&plan, file, json)?,
        files => many::verify(&plan, files, json)?,
    };
    Ok(if printed == Exit::Success && !is_current { Exit::Failed } else { printed })
}

/// A path as it is given, or, as for `explain`, relative to `out`.
fn in_place(plan: &Plan, file: &Path) -> PathBuf {
    let below = plan.out.join(file);
    if !file.exists() && below.exists() { below } else { file.into() }
}

/// Prints how one file is; returns whether it is current.
fn verify_file(plan: &Plan, file: &Path, json: bool) -> Result<(Exit, bool), CommandError> {
    let file = in_place(plan, file);
    let bytes = engine::read_file(&file).map_err(|error| unreadable(&file, &error))?;
    let found = engine::verify(plan, &file, &bytes, &containers::read_recipe)?;
    let printed = match json {
        true => print::json(json!({ "current": found.is_current(), "verification": found })),
        false => print::data(&describe(&found)),
    };
    Ok((printed, found.is_current()))
}

fn unreadable(file: &Path, error: &io::Error) -> CommandError {
    let is_gone = error.kind() == ErrorKind::NotFound;
    let help = is_gone.then_some("`specula build` restores a published file that is gone");
    CommandError::usage([format!("cannot read {}: {error}", path_text(file))]).with_help(help)
}

/// The verdict on a file, which is printed first.
fn verdict(found: &Verification) -> &'static str {
    match &found.content {
        ContentState::Altered { .. } => "ALTERED: its bytes differ from the published ones",
        _ if matches!(found.recipe, RecipeState::Differs { .. }) => {
            "ALTERED: its recipe differs from its record"
        }
        ContentState::Earlier => "stale: its item has a newer result",
        ContentState::Current if found.item.is_none() || !found.gone.is_empty() => {
            "stale: the manifest no longer makes it"
        }
        ContentState::Current if changed(found).next().is_some() => "stale: its sources have changed since",
        ContentState::Current if !found.revised.is_empty() => "stale: parameters or kinds have changed since",
        ContentState::Current if found.would_run => "stale: a build would make it again",
        ContentState::Current => "current: a build would leave it unchanged",
    }
}

/// The sources that are not as they were.
fn changed(found: &Verification) -> impl Iterator<Item = &SourceFile> {
    found.sources.iter().filter(|source| source.old != source.new)
}

fn describe(found: &Verification) -> String {
    let mut text = format!("{}: {}\n", path_text(&found.file), verdict(found));
    let item =
        found.item.as_ref().map_or_else(|| "an item that no longer exists".into(), ToString::to_string);
    let _ = match &found.item {
        Some(taker) if *taker != found.maker => {
            let (maker, made) = (&found.maker, found.made);
            writeln!(text, "  made by   {maker}, in the run of {made}; {item} took it from the cache")
        }
        _ => writeln!(text, "  made by   {item}, in the run of {}", found.made),
    };
    let now = short(Some(&found.digest));
    let _ = match &found.content {
        ContentState::Current => writeln!(text, "  contents  match the last build ({now})"),
        ContentState::Earlier => writeln!(text, "  contents  match an earlier build ({now})"),
        ContentState::Altered { made } => {
            writeln!(text, "  contents  {now}, but {} was published", short(made.as_ref()))
        }
    };
    let _ = match &found.recipe {
        RecipeState::AsRecorded { beside: None } => writeln!(text, "  recipe    as recorded"),
        RecipeState::AsRecorded { beside: Some(place) } => {
            writeln!(text, "  recipe    as recorded, in {}", path_text(place))
        }
        RecipeState::Differs { found, recorded } => {
            writeln!(text, "  recipe    in the file  {found}\n            recorded     {recorded}")
        }
        RecipeState::Absent => writeln!(text, "  recipe    none in the file or next to it"),
    };
    // A path that did not exist then and does not exist now is not worth a line.
    let worth = |source: &&SourceFile| source.old.is_some() || source.new.is_some();
    for source in found.sources.iter().filter(worth) {
        let _ = writeln!(text, "  {}", describe_source(source));
    }
    for revised in &found.revised {
        let _ = writeln!(text, "  revised   {}", cause(revised));
    }
    for gone in &found.gone {
        let _ = writeln!(text, "  gone      {gone}: the manifest no longer has this item");
    }
    for forgotten in &found.forgotten {
        let _ =
            writeln!(text, "  unknown   {forgotten}: the record of the run that made this result is gone");
    }
    if found.would_run {
        for first in &found.causes {
            let _ = writeln!(text, "  would run {}", cause(first));
        }
    }
    text
}

fn describe_source(source: &SourceFile) -> String {
    if source.kind == ReadKind::Lookup {
        let [old, new] = [&source.old_found, &source.new_found].map(Option::as_deref);
        return match new {
            _ if source.new == source.old => format!("unchanged PATH finds {}", old.unwrap_or("nothing")),
            _ => format!("changed   {}", program(&source.path, old, new)),
        };
    }
    let what = if source.kind == ReadKind::Names { "names in " } else { "" };
    let path = path_text(&source.path);
    let old = dated(source.old.as_ref(), source.old_time);
    match source.new {
        new if new == source.old => format!("unchanged {what}{path} ({old})"),
        None => format!("gone      {what}{path} (was {old})"),
        Some(new) => {
            format!("changed   {what}{path} ({old} to {})", dated(Some(&new), source.new_time))
        }
    }
}
