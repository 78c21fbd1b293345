//! What may complete a word of the command line: found by walking the words before it through the commands
//! and options that clap knows.

use std::collections::BTreeSet;
use std::fmt;
use std::path::{Path, PathBuf};

use ::preview::Mode;
use clap::{Arg, Command, CommandFactory, ValueHint};
use engine::{Kinds, Plan};
use stages::PreviewCatalog;

use crate::arguments::{Arguments, MANIFEST};
use crate::manifest;

/// A candidate to complete a word.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Candidate {
    /// A word, and what it means.
    Word(String, String),
    Files,
    Folders,
}

impl fmt::Display for Candidate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // A word is one line.
            Self::Word(word, help) => write!(f, "{word}\t{}", help.lines().next().unwrap_or_default()),
            Self::Files => f.write_str(":files"),
            Self::Folders => f.write_str(":folders"),
        }
    }
}

/// The candidates to complete the last of these words, the arguments so far.
pub(super) fn of(words: &[String], kinds: &Kinds) -> Vec<Candidate> {
    let Some((word, before)) = words.split_last() else { return Vec::new() };
    let mut root = Arguments::command();
    root.build();
    let place = Place::after(&root, before);
    let values = Values { place: &place, kinds };
    let begins = |candidate: &Candidate| match candidate {
        Candidate::Word(found, _) => found.starts_with(word.as_str()),
        Candidate::Files | Candidate::Folders => true,
    };
    let mut found = values.of_word(word);
    found.retain(begins);
    found
}

/// The place of a word on the command line.
struct Place<'c> {
    command: &'c Command,
    /// The option whose value the word is.
    option: Option<&'c Arg>,
    /// How many arguments without a name come before it.
    position: usize,
    /// Whether `--` comes before it.
    only_positions: bool,
    /// The folder of `-C` and the file of `--manifest`.
    folder: Option<PathBuf>,
    manifest: Option<PathBuf>,
}

impl<'c> Place<'c> {
    fn after(root: &'c Command, words: &[String]) -> Self {
        let mut place = Self {
            command: root,
            option: None,
            position: 0,
            only_positions: false,
            folder: None,
            manifest: None,
        };
        for word in words {
            place.follow(word);
        }
        place
    }

    fn follow(&mut self, word: &str) {
        if let Some(option) = self.option.take() {
            self.note(option, word);
        } else if self.only_positions {
            self.position += 1;
        } else if word == "--" {
            self.only_positions = true;
        } else if let Some(name) = word.strip_prefix("--") {
            match name.split_once('=') {
                Some((name, value)) => {
                    if let Some(option) = self.long(name) {
                        self.note(option, value);
                    }
                }
                None => self.option = self.long(name).filter(|option| needs_value(option)),
            }
        } else if let Some(letters) = word.strip_prefix('-').filter(|letters| !letters.is_empty()) {
            // Of `-vj4` the value is 4; of `-vj` it is the next word.
            for (at, letter) in letters.char_indices() {
                let Some(option) = self.short(letter).filter(|option| needs_value(option)) else { continue };
                match &letters[at + letter.len_utf8()..] {
                    "" => self.option = Some(option),
                    value => self.note(option, value),
                }
                break;
            }
        } else if let Some(command) = self.command.find_subcommand(word).filter(|_| self.position == 0) {
            self.command = command;
        } else {
            self.position += 1;
        }
    }

    fn note(&mut self, option: &Arg, value: &str) {
        match option.get_id().as_str() {
            "working_folder" => self.folder = Some(value.into()),
            "manifest" => self.manifest = Some(value.into()),
            _ => {}
        }
    }

    fn long(&self, name: &str) -> Option<&'c Arg> {
        self.command.get_arguments().find(|option| option.get_long() == Some(name))
    }

    fn short(&self, letter: char) -> Option<&'c Arg> {
        self.command.get_arguments().find(|option| option.get_short() == Some(letter))
    }

    /// The argument without a name that comes here.
    fn positional(&self) -> Option<&'c Arg> {
        let at = self.command.get_positionals().nth(self.position);
        at.or_else(|| self.command.get_positionals().last().filter(|last| is_repeated(last)))
    }

    /// The plan of the manifest that the command would work on; `None` if it has errors.
    fn plan(&self, kinds: &Kinds) -> Option<Plan> {
        let mut path = self.manifest.clone().unwrap_or_else(|| MANIFEST.into());
        match &self.folder {
            Some(folder) => path = folder.join(path),
            None => manifest::find(&mut path),
        }
        Plan::load(Path::new(&path), kinds).ok()
    }
}

fn is_repeated(argument: &Arg) -> bool {
    matches!(argument.get_action(), clap::ArgAction::Append)
}

/// Whether the word after an option is its value.
fn needs_value(option: &Arg) -> bool {
    option.get_action().takes_values() && option.get_num_args().is_none_or(|range| range.min_values() > 0)
}

/// Finds candidates.
struct Values<'p> {
    place: &'p Place<'p>,
    kinds: &'p Kinds,
}

impl Values<'_> {
    fn of_word(&self, word: &str) -> Vec<Candidate> {
        let Place { command, option, position, only_positions, .. } = self.place;
        if let Some(option) = option {
            return self.of_argument(option, word);
        }
        if !only_positions && word.starts_with('-') {
            let Some((name, value)) = word.split_once('=') else { return options(command) };
            let option = name.strip_prefix("--").and_then(|name| self.place.long(name));
            let found = option.map(|option| self.of_argument(option, value)).unwrap_or_default();
            let whole = |found| match found {
                Candidate::Word(value, help) => Candidate::Word(format!("{name}={value}"), help),
                files => files,
            };
            return found.into_iter().map(whole).collect();
        }
        let commands = command.get_subcommands().filter(|command| *position == 0 && !command.is_hide_set());
        let mut found: Vec<_> =
            commands.map(|command| described(command.get_name(), command.get_about())).collect();
        found.extend(
            self.place.positional().into_iter().flat_map(|argument| self.of_argument(argument, word)),
        );
        // There is nothing else that may come.
        if found.is_empty() { options(command) } else { found }
    }

    fn of_argument(&self, argument: &Arg, word: &str) -> Vec<Candidate> {
        let known = argument.get_possible_values();
        if !known.is_empty() {
            return known.iter().map(|value| described(value.get_name(), value.get_help())).collect();
        }
        match argument.get_id().as_str() {
            "kind" => self.kinds.iter().map(|kind| pair(kind.name(), kind.summary())).collect(),
            "mode" => Mode::ALL.iter().map(|mode| pair(mode.name(), mode.label())).collect(),
            "item" => self.subjects(word),
            "stages" => self.stages(word),
            "target" => [self.stages(word), vec![Candidate::Files]].concat(),
            _ => match argument.get_value_hint() {
                ValueHint::DirPath => vec![Candidate::Folders],
                ValueHint::AnyPath | ValueHint::FilePath => vec![Candidate::Files],
                _ => Vec::new(),
            },
        }
    }

    /// The stages of the manifest; once a stage is complete, its items.
    fn stages(&self, word: &str) -> Vec<Candidate> {
        let Some(plan) = self.place.plan(self.kinds) else { return Vec::new() };
        let of_stage = |stage: &str| word.strip_prefix(stage).is_some_and(|rest| rest.starts_with(' '));
        let items = (0..plan.items.len()).map(|item| plan.item_name(item));
        let items = items.filter(|item| of_stage(&item.stage)).map(|item| pair(item.to_string(), "item"));
        let stages = plan.stages.iter().map(|stage| pair(stage.name.as_str(), stage.kind.name()));
        stages.chain(items).collect()
    }

    /// The parts of a subject, `environment=sky,material=gold`: those that complete the last one.
    fn subjects(&self, word: &str) -> Vec<Candidate> {
        let Some(plan) = self.place.plan(self.kinds) else { return Vec::new() };
        let catalog = PreviewCatalog::of(plan);
        let before = word.rfind(',').map_or("", |comma| &word[..=comma]);
        let named: BTreeSet<&str> =
            before.split(',').filter_map(|part| Some(part.split_once('=')?.0)).collect();
        let parts = [
            ("environment", catalog.environments().to_vec()),
            ("material", catalog.materials().to_vec()),
            ("mesh", catalog.meshes()),
        ];
        let parts = parts.into_iter().filter(|(part, _)| !named.contains(part));
        parts
            .flat_map(|(part, names)| {
                names.into_iter().map(move |name| pair(format!("{before}{part}={name}"), part))
            })
            .collect()
    }
}

/// The options of a command, by their long names, or else their letters.
fn options(command: &Command) -> Vec<Candidate> {
    let options = command.get_arguments().filter(|option| !option.is_positional() && !option.is_hide_set());
    let name = |option: &Arg| match (option.get_long(), option.get_short()) {
        (Some(long), _) => Some(format!("--{long}")),
        (None, Some(short)) => Some(format!("-{short}")),
        (None, None) => None,
    };
    options.filter_map(|option| Some(described(&name(option)?, option.get_help()))).collect()
}

fn described(word: &str, help: Option<&clap::builder::StyledStr>) -> Candidate {
    pair(word, help.map(ToString::to_string).unwrap_or_default())
}

fn pair(word: impl Into<String>, help: impl Into<String>) -> Candidate {
    Candidate::Word(word.into(), help.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words that complete a command line, whose words are separated by spaces.
    fn completed(line: &str) -> Vec<String> {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let found = of(&words, &crate::kinds());
        found.iter().map(|found| found.to_string().split('\t').next().unwrap_or_default().into()).collect()
    }

    #[test]
    fn commands_options_and_values_are_completed() {
        for (line, words) in [
            ("bu", &["build"][..]),
            ("-C here bu", &["build"]),
            ("cache g", &["gc"]),
            ("help cache", &["cache"]),
            ("build --fail", &["--fail-fast"]),
            ("build -j 2 --fail", &["--fail-fast"]),
            ("build --fo", &["--force"]),
            ("graph --format ", &["mermaid", "dot"]),
            ("graph --format=d", &["--format=dot"]),
            ("preview --mode global", &["global-shrm"]),
            ("preview --mode=br", &["--mode=brute-force"]),
            ("stages export-sh", &["export-shrm", "export-sh"]),
            ("completions z", &["zsh"]),
            ("schema pipe", &["pipeline"]),
            ("build -- --fail", &[]),
            ("no-such-command x", &[]),
        ] {
            assert_eq!(completed(line), words, "{line}");
        }
        let commands = completed("");
        assert!(
            commands.contains(&"preview".into()) && !commands.contains(&"complete".into()),
            "{commands:?}"
        );
        assert!(completed("preview -").contains(&"--mode".into()));
        assert!(completed("cache stats ").contains(&"--json".into()), "nothing else may come");
    }

    #[test]
    fn files_and_folders_are_left_to_the_shell() {
        for line in ["inspect a", "preview a.hdr b", "preview --still ", "build --manifest=", "convert "] {
            assert_eq!(completed(line), [":files"], "{line}");
        }
        for line in ["-C ", "init x", "man ", "build --timings="] {
            assert_eq!(completed(line), [":folders"], "{line}");
        }
        assert_eq!(completed("preview --size "), [""; 0]);
    }

    #[test]
    fn stages_items_and_subjects_are_those_of_the_manifest() {
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../pipeline.toml");
        let with = |rest: &str| completed(&format!("build --manifest {manifest} {rest}"));
        assert_eq!(with("envi"), ["environment"]);
        assert_eq!(with("environment refl"), ["reflection"], "several may be named");
        assert_eq!(with("--force envi"), ["environment"], "what is forced is named as what is built");
        let words = ["build", "--manifest", manifest, "environment ["].map(str::to_owned);
        let items = of(&words, &crate::kinds());
        assert!(items.contains(&pair("environment [sky]", "item")), "{items:?}");
        let explain = completed(&format!("explain --manifest={manifest} refl"));
        assert_eq!(explain, ["reflection", ":files"]);
        assert_eq!(completed("build --manifest none.toml x"), [""; 0], "there is no such manifest");
        let here = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
        let subject = |word: &str| completed(&format!("-C {here} preview --item {word}"));
        assert_eq!(subject("mat"), subject("material="));
        assert_eq!(subject("environment=sky,mesh=pl"), ["environment=sky,mesh=plane"]);
    }
}
