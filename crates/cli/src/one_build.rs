//! Building a manifest that only exists for one command.

use std::fs;
use std::path::{Path, PathBuf};

use engine::{BuildOptions, Cancel, Event, Kinds, Plan, path_text};

use crate::arguments::MANIFEST;
use crate::build::{exit_of, stop_on_interrupt};
use crate::build_reporter::BuildReporter;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print::say;
use crate::quantity::count;

/// Builds a manifest in a temporary folder, and moves what it made to its places, where each file appears as
/// a whole. `text` is the manifest, given that folder; `place` says where a file of its output belongs, if
/// anywhere, and `options` which options of the command are parameters of its stages: messages name those.
pub(crate) fn build(
    text: impl FnOnce(&Path) -> String,
    kinds: &Kinds,
    output: &Path,
    place: impl Fn(&str) -> Option<PathBuf>,
    options: &[StageOption],
) -> Result<Exit, CommandError> {
    let failed = |what: String, error: std::io::Error| CommandError::system(what, &error);
    let folder = tempfile::Builder::new().prefix("specula-").tempdir();
    let folder = folder.map_err(|error| failed("cannot create a temporary folder".into(), error))?;
    let manifest = folder.path().join(MANIFEST);
    fs::write(&manifest, text(folder.path()))
        .map_err(|error| failed(format!("cannot write {}", path_text(&manifest)), error))?;
    let plan = Plan::load(&manifest, kinds).map_err(|diagnostics| {
        // The options are the parameters: whoever typed them knows no manifest.
        let mut errors = diagnostics.shown().iter().map(|diagnostic| {
            let message = as_option(&diagnostic.message, options);
            let chain: Vec<String> = [message].into_iter().chain(diagnostic.expected.clone()).collect();
            CommandError::usage(chain).with_help(diagnostic.help.as_deref())
        });
        let last = errors.next_back();
        errors.for_each(|error| _ = error.print());
        last.unwrap_or_else(|| CommandError::manifest(diagnostics.clone()))
    })?;
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let build_options = BuildOptions { keep_going: true, ..BuildOptions::default() };
    let reporter = BuildReporter::quiet();
    let show = |event: Event| reporter.show(&in_words_of_options(event, options));
    let summary = engine::build(&plan, &build_options, &cancel, &show);
    reporter.show_failures();
    let summary = summary?;
    let mut written = 0;
    for item in plan.items.iter() {
        let made: Vec<_> = item.files.iter().filter(|file| plan.out.join(file).exists()).collect();
        // The last file is published after the others; an export may leave out some of these.
        if made.last() != item.files.last().as_ref() {
            continue;
        }
        for file in made {
            let Some(place) = place(file) else { continue };
            put(&plan.out.join(file), &place)
                .map_err(|error| failed(format!("cannot write {}", path_text(place)), error))?;
            written += 1;
        }
    }
    if written > 0 {
        say!("Wrote {} to {}.", count(written, "file"), path_text(output));
    }
    Ok(exit_of(&summary))
}

/// A parameter of a stage, and the option of the command that gives it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StageOption {
    pub(crate) stage: &'static str,
    pub(crate) parameter: &'static str,
    pub(crate) option: &'static str,
}

/// A message about a parameter, `fill: ...`, about the option that gives it. A parameter of several stages
/// has one option.
fn as_option(message: &str, options: &[StageOption]) -> String {
    let named = message.split_once(": ");
    let option = |name: &str| options.iter().find(|option| option.parameter == name);
    match named.and_then(|(name, rest)| Some((option(name)?.option, rest))) {
        Some((option, rest)) => format!("{option}: {rest}"),
        None => message.to_owned(),
    }
}

/// The event of an item, its texts in the words of the command line.
fn in_words_of_options(event: Event, options: &[StageOption]) -> Event {
    let of = |stage: &str, text: String| {
        let options = options.iter().filter(|option| option.stage == stage);
        options.fold(text, |text, option| named(&text, option.parameter, option.option))
    };
    match event {
        Event::Failed { item, error, help } => Event::Failed {
            error: error.into_iter().map(|text| of(&item.stage, text)).collect(),
            help: help.map(|text| of(&item.stage, text)),
            item,
        },
        Event::Warning { item, message } => Event::Warning { message: of(&item.stage, message), item },
        Event::Note { item, message } => Event::Note { message: of(&item.stage, message), item },
        other => other,
    }
}

/// A text with an option in place of a parameter: `layout = "probe" or "cube"` becomes
/// `--from probe or cube`, and what names it alone names the option.
fn named(text: &str, parameter: &str, option: &str) -> String {
    let text = text.replace(&format!("`{parameter}`"), &format!("`{option}`"));
    let pattern = format!("{parameter} = ");
    let (mut done, mut rest) = (String::new(), text.as_str());
    while let Some(at) = rest.find(&pattern) {
        let (before, after) = (&rest[..at], &rest[at + pattern.len()..]);
        done += before;
        rest = after;
        if before.ends_with(|letter: char| letter.is_alphanumeric() || letter == '-') {
            done += &pattern;
            continue;
        }
        done += &format!("{option} ");
        while let Some((value, further)) = rest.strip_prefix('"').and_then(|rest| rest.split_once('"')) {
            done += value;
            rest = further;
            match rest.strip_prefix(" or ").filter(|rest| rest.starts_with('"')) {
                Some(further) => {
                    done += " or ";
                    rest = further;
                }
                None => break,
            }
        }
    }
    done + rest
}

/// Moves a file to a place.
fn put(from: &Path, to: &Path) -> std::io::Result<()> {
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent)?;
    }
    engine::replace_file(to, &engine::read_file(from)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_named_by_their_options() {
        for (text, expected) in [
            ("is it layout = \"probe\"?", "is it --from probe?"),
            (
                "layout = \"cube\" or \"probe\" fits, else layout = 3",
                "--from cube or probe fits, else --from 3",
            ),
            ("tone-layout = \"cube\"", "tone-layout = \"cube\""),
            ("the layout cube-cross", "the layout cube-cross"),
            ("leave out `layout`", "leave out `--from`"),
            ("layout = \"cut", "--from \"cut"),
        ] {
            assert_eq!(named(text, "layout", "--from"), expected);
        }
    }
}
