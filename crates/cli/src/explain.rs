//! `specula explain`: why an item would run or not, and why it last ran. The first line is the answer.

use std::fmt::Write;

use engine::{
    Cause, Explanation, FileState, FromCache, InputOrigin, ItemName, Kinds, LastRun, Place, ReadKind,
    path_text,
};
use serde_json::json;

use crate::arguments::ExplainArguments;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::lists::{NAMED, list};
use crate::print::say;
use crate::reasons::{cause, dated, lines, origin, short};
use crate::{manifest, print, quantity};

pub(crate) fn run(arguments: &ExplainArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let plan = manifest::load(&arguments.query.manifest, kinds)?;
    let explanations = engine::explain(&plan, &arguments.target)?;
    if arguments.query.json {
        return Ok(print::json(json!({ "items": explanations })));
    }
    if explanations.len() > 1 && !arguments.verbose && are_of_one_stage(&explanations) {
        let exit = print::data(&grouped(&explanations));
        say!("hint: `specula explain \"{}\"` explains one of them in full", explanations[0].item);
        return Ok(exit);
    }
    let manifest = plan.manifest.file_name().unwrap_or_default().to_string_lossy();
    let texts = explanations.iter().map(|found| full(found, &manifest));
    Ok(print::data(&texts.collect::<Vec<_>>().join("\n")))
}

fn are_of_one_stage(explanations: &[Explanation]) -> bool {
    explanations.windows(2).all(|two| two[0].item.stage == two[1].item.stage)
}

/// The items of a stage: those with the same explanation share a paragraph.
fn grouped(explanations: &[Explanation]) -> String {
    let mut groups = Vec::<(String, Vec<&ItemName>)>::new();
    for found in explanations {
        let verdict = verdict(found, origin);
        match groups.iter_mut().find(|(other, _)| *other == verdict) {
            Some((_, items)) => items.push(&found.item),
            None => groups.push((verdict, vec![&found.item])),
        }
    }
    let would_run = explanations.iter().filter(|found| found.would_run).count();
    let stage = explanations.first().map_or("", |found| found.item.stage.as_str());
    let mut text = format!("{stage}: {} items, {would_run} would run\n", explanations.len());
    for (verdict, items) in groups {
        let keys = items.iter().map(|item| format!("[{}]", item.key)).collect::<Vec<_>>();
        let _ = writeln!(text, "  {}: {}", list(&keys, " ", LISTED), verdict.replace('\n', "\n  "));
    }
    text
}

/// This many items of a paragraph are named.
const LISTED: usize = 8;

/// Whether an item would run and why, or why it has its present result.
fn verdict(found: &Explanation, describe: fn(&Cause) -> String) -> String {
    let because = |causes: &[Cause]| match causes {
        [only] => format!(" {}", describe(only)),
        causes => causes.iter().map(|cause| format!("\n    {}", describe(cause))).collect(),
    };
    match &found.last {
        _ if found.would_run => format!("would run:{}", because(&found.causes)),
        _ if found.restored => "an earlier result applies again; a build takes it from the cache".into(),
        Some(last) => {
            let missing = found.files.iter().find(|file| file.state != FileState::AsPublished);
            let missing = missing.map_or_else(String::new, |missing| {
                format!(", but {} is {}", path_text(&missing.file), state(&missing.state))
            });
            let came = match &last.from_cache {
                Some(FromCache { shared: Some(shared), .. }) => {
                    format!("its result came from the cache at {}, made on {},", shared.host, shared.machine)
                }
                Some(_) => "its result came from the cache".into(),
                None => match &last.place {
                    Some(Place::Worker { host, name }) => format!("it last ran on {name} of {host}"),
                    _ => "it last ran".into(),
                },
            };
            format!("up to date{missing}; {came} because:{}", because(&last.causes))
        }
        None => "up to date".into(),
    }
}

/// Everything about an item of this manifest.
fn full(explanation: &Explanation, manifest: &str) -> String {
    let mut text = format!("{}: {}\n", explanation.item, verdict(explanation, cause));
    if explanation.causes.iter().any(|cause| cause.chain.len() > 1) {
        text += "  what changed for the item itself\n";
        for line in lines(&explanation.reasons) {
            let _ = writeln!(text, "    {line}");
        }
    }
    if let Some(last) = &explanation.last {
        text += &describe_run(last, explanation, manifest);
    }
    for file in &explanation.files {
        let digest = short(file.digest.as_ref());
        let _ = writeln!(text, "  file {digest} {}: {}", path_text(&file.file), state(&file.state));
    }
    text
}

fn state(state: &FileState) -> String {
    match state {
        FileState::AsPublished => "as published".into(),
        FileState::Gone => "gone since it was published (a build restores it)".into(),
        FileState::Altered { digest, modified, made_by } => format!(
            "changed by another program since it was published, now {}{} (a build restores it)",
            dated(digest.as_ref(), *modified),
            made_by.as_ref().map_or_else(String::new, |origin| {
                format!(", the result of {}{}", origin.item, from(&origin.sources))
            })
        ),
        FileState::NeverPublished => "not published yet".into(),
    }
}

/// `, from assets/environments/sky.exr, assets/materials/gold.toml`
fn from(sources: &[String]) -> String {
    let sources = sources.iter().map(path_text).collect::<Vec<_>>();
    if sources.is_empty() { String::new() } else { format!(", from {}", list(&sources, ", ", NAMED)) }
}

fn describe_run(run: &LastRun, explanation: &Explanation, manifest: &str) -> String {
    let mut text = match &run.from_cache {
        None => match &run.place {
            Some(Place::Worker { host, name }) => format!("  last ran on {name} of {host}"),
            Some(Place::Here { .. }) => "  last ran here".into(),
            None => "  last ran".to_owned(),
        },
        Some(from) => {
            let of = if from.manifest == manifest { "" } else { &format!(" of {}", from.manifest) };
            let (at, on) = match &from.shared {
                Some(shared) => (format!(" at {}", shared.host), format!(" on {}", shared.machine)),
                None => (String::new(), String::new()),
            };
            format!("  came from the cache{at} {}\n  made by {}{of}{on}, which ran", from.since, from.item)
        }
    };
    let time = quantity::duration(run.milliseconds);
    let _ = writeln!(text, " {} for {time} as {}, by version {}", run.started, run.kind, run.version);
    if let (Some(Place::Here { because }), None) = (&run.place, &run.from_cache) {
        let _ = writeln!(text, "    runs on this machine only: {because}");
    }
    if explanation.would_run {
        for first in &run.causes {
            let _ = writeln!(text, "    because {}", cause(first));
        }
    }
    if run.causes.iter().any(|cause| cause.chain.len() > 1) {
        let _ = writeln!(text, "    what changed for the item itself: {}", lines(&run.reasons).join("; "));
    }
    for InputOrigin { used, sources } in &run.inputs {
        let digest = short(Some(&used.digest));
        let _ = writeln!(text, "    input {digest} {} = {}{}", used.port, used.item, from(sources));
    }
    for read in &run.reads {
        if read.kind == ReadKind::Lookup {
            let found = read.found.as_deref().unwrap_or("nothing");
            let _ = writeln!(text, "    PATH finds {found} for {}", read.path);
            continue;
        }
        let what = if read.kind == ReadKind::Names { "names in" } else { "read" };
        let time = read.modified.map_or_else(String::new, |time| format!(", changed {time}"));
        let _ = writeln!(text, "    {what} {} {}{time}", short(read.digest.as_ref()), path_text(&read.path));
    }
    for (output, digest) in run.results.iter().enumerate() {
        let file = explanation.outputs.get(output);
        // Only what is published is in `files`.
        if file.is_none_or(|file| explanation.files.iter().any(|known| known.file == *file)) {
            let file = file.map_or_else(String::new, |file| format!(" {}", path_text(file)));
            let _ = writeln!(text, "    made {}{file}{}", short(Some(digest)), from(&run.sources));
        }
    }
    for warning in &run.warnings {
        let _ = writeln!(text, "    warning: {warning}");
    }
    for note in &run.notes {
        let _ = writeln!(text, "    note: {note}");
    }
    for line in run.failure.iter().flatten() {
        let _ = writeln!(text, "    failed: {line}");
    }
    let _ = writeln!(text, "    recipe {}", run.recipe);
    text
}
