//! `specula explain`: why an item would run or not, and what its last run did.

use engine::{Explanation, Kinds, LastRun};

use crate::arguments::ExplainArguments;
use crate::reasons::{lines, short};
use crate::{Exit, exit, manifest, print, terminal};

pub(crate) fn run(arguments: &ExplainArguments, kinds: &Kinds) -> Exit {
    let plan = match manifest::load(&arguments.manifest, kinds) {
        Ok(plan) => plan,
        Err(exit) => return exit,
    };
    match engine::explain(&plan, &arguments.target) {
        Ok(explanations) => {
            let texts = explanations.iter().map(describe).collect::<Vec<_>>();
            print::data(&texts.join("\n"))
        }
        Err(error) => exit::of_error(&error),
    }
}

fn describe(explanation: &Explanation) -> String {
    let mut text = format!("{}\n", explanation.item);
    if explanation.would_run {
        text += "  would run now, because\n";
        for line in lines(&explanation.reasons) {
            text += &format!("    {line}\n");
        }
    } else {
        text +=
            "  up to date: parameters, kind, inputs and files read are those of the result in the cache\n";
    }
    if let Some(last) = &explanation.last {
        text += &describe_run(last);
    }
    for file in &explanation.files {
        let state = if file.intact { "as published" } else { "not there as published; a build puts it back" };
        text += &format!("  file {} {} ({state})\n", short(file.digest.as_ref()), file.file);
    }
    text
}

fn describe_run(run: &LastRun) -> String {
    let time = terminal::duration(run.milliseconds);
    let mut text =
        format!("  last ran {} for {time} as {}, by version {}\n", run.started, run.kind, run.version);
    text += &format!("    because {}\n", lines(&run.reasons).join("; "));
    for input in &run.inputs {
        text += &format!("    input {} {} = {}\n", short(Some(&input.digest)), input.port, input.item);
    }
    for read in &run.reads {
        let what = if read.listing { "names in" } else { "read" };
        text += &format!("    {what} {} {}\n", short(read.digest.as_ref()), read.path);
    }
    for digest in &run.results {
        text += &format!("    made {}\n", short(Some(digest)));
    }
    for warning in &run.warnings {
        text += &format!("    warning: {warning}\n");
    }
    for note in &run.notes {
        text += &format!("    note: {note}\n");
    }
    for line in run.failure.iter().flatten() {
        text += &format!("    failed: {line}\n");
    }
    text += &format!("    recipe {}\n", run.recipe);
    text
}
