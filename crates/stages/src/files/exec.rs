//! Runs your own program: a command line with declared inputs and a declared output.
//!
//! ```toml
//! [stage.graded]
//! kind = "exec"
//! command = ["python3", "tools/grade.py", "--stops", "0.5", "{input.environment}", "{output}"]
//! inputs = { environment = "environment" }
//! output = { type = "environment", format = "exr" }
//! tools = ["tools/lib"]
//! env = ["STUDIO_LUT"]
//! timeout = 120.0
//! ```
//!
//! Use it for existing tools: a grading script, a denoiser, an engine's texture packer. The inputs are
//! written to files, the command is run once for each item, and its output is read back and checked. The
//! output is an artifact like any other, or a file that is published.
//!
//! ## The command
//!
//! `command` is the program and its arguments. No shell interprets it; if you need one, use
//! `["sh", "-c", "..."]`. Arguments can contain placeholders:
//!
//! | placeholder | meaning |
//! | --- | --- |
//! | `{input.NAME}` | the file with the input at the port NAME of `inputs` |
//! | `{input}` | the same, for the short form `input = "STAGE"` |
//! | `{output}` | the file that the program must write; for type `files`, an existing folder |
//! | `{folder}` | the manifest's folder |
//! | `{{`, `}}` | a brace |
//!
//! A program without a `/` is looked up in PATH; any other is relative to the manifest's folder. An
//! argument that names an existing file in the manifest's folder, such as `tools/grade.py` in the example,
//! becomes its full path. All other relative paths are relative to the program's working folder, which is
//! not in the project: write `{folder}/...` for a folder, and for a path that is part of an argument. Ports
//! can have any names, and a stage can have no ports. A port takes every type of artifact, including the
//! types of a studio's own kinds. The command must use every port, and `{output}`.
//!
//! ## The files of ports
//!
//! | type | formats; the first is the default |
//! | --- | --- |
//! | `environment` | `exr`: the `lat-long` of `import-environment`, RGB, 32-bit float, every bit kept; `hdr`: Radiance RGBE, which rounds; `safetensors` |
//! | `lighting` | `safetensors`; `json`: that of `export-sh` with its preset `specula` |
//! | `material`, `brdf`, `reflection`, `shrm`, `mesh` | `safetensors` |
//! | a type of a studio's own kind | `bin`: the bytes as that kind encodes them |
//!
//! `formats = { NAME = "hdr" }` sets another format for a port. `specula inspect` and the manual pages of
//! the exports describe the tensors' names and shapes, CONVENTIONS.md the frame.
//!
//! ## The output
//!
//! `output = { type = "environment", format = "exr" }` reads back an artifact, in one of the formats above.
//! The file must be complete. An environment must be twice as wide as high (or have OpenEXR's `envmap`
//! attribute), and no pixel may be NaN, infinite or negative. Specula encodes the value again, so it does
//! not matter if the program writes the time into its files: if the values are equal, so are the results,
//! and no later stage reruns.
//!
//! `output = { type = "file", format = "png" }` publishes the file unchanged as `.png` after the item's
//! `path`, and before it the recipe as `.png.json`.
//! `output = { type = "files", names = ["px.dds", "nx.dds"] }` publishes a folder of files and the recipe
//! as `/recipe.json`; the last name is the index, which is replaced after the others. Here equal inputs
//! should give equal bytes.
//!
//! ## When it reruns
//!
//! The stage reruns when an input, a parameter or a *tool file* changes, appears or disappears. Tool files
//! are
//!
//! - the program's file and, if it is a script, the interpreters in its first line
//!   (`#!/usr/bin/env python3`). PATH counts too: the stage reruns if PATH leads to another file of that
//!   name, or to one in another folder;
//! - files and folders that are a whole argument, or the part of one after `=`
//!   (`--lut={folder}/tools/film.cube`; without `{folder}` the program would look in its working folder);
//! - `{folder}/...` anywhere in an argument, such as in `sh -c "{folder}/tools/run.sh {input} {output}"`.
//!   Files that a shell writes there (`> {folder}/log`) are not tool files;
//! - the files and folders in `tools`.
//!
//! All files in a folder are tool files, except hidden files and Python's caches (`__pycache__`). If a
//! program starts other programs, or a script loads modules, list those in `tools`. Specula does not see
//! other files that a program reads, or data that it receives from the network.
//!
//! If Specula cannot work out which files an argument means, a warning names the argument: the manifest's
//! folder as a whole (`--root={folder}`), a folder that contains `out` or more than 4096 files, a folder
//! elsewhere, a part of a path that a shell fills in (`{folder}/luts/$name.cube`), a word of a script that
//! is also a file of the project. List those files in `tools`, and the warning goes away.
//!
//! Nothing in `out` can be a tool file, because the stage would not wait for the stage that makes it. Such
//! a manifest is refused, even if the path leads there through a link or another spelling. Connect the
//! stage that makes the file as an input instead.
//!
//! ## Other machines
//!
//! A program may depend on its machine in ways that Specula does not see. So its results are not stored in
//! a shared cache (`--remote-cache`), unless `remote = true` promises that equal inputs and tool files give
//! equal results everywhere. Tool files must then be in the manifest's folder or in PATH. If the output is
//! an environment, the type of processor is part of the key, as with `import-environment`.
//!
//! With `remote = true` the program may also run on another machine (`--remote-executor`), which gets the
//! inputs and the tool files of the manifest's folder. A program in PATH must be the same file in the same
//! folder there; otherwise the item runs locally. `platform` sets the properties that the machine must
//! have, such as `platform = { container-image = "docker://studio/tools:7" }`; it is part of the key. A
//! stage with variables in `env` always runs locally.
//!
//! ## The program's environment
//!
//! - Its working folder is a scratch folder of the item, which is removed afterwards, even after a failure
//!   (but see `--keep-scratch` below). Paths of inputs and outputs are relative to it, and are the same in
//!   every run.
//! - Its environment variables are `PATH`, as Specula has it; `HOME` and `TMPDIR` (`TEMP`, `TMP`), in the
//!   scratch folder; `LANG=C.UTF-8`, `TZ=UTC`, `SOURCE_DATE_EPOCH=0`, `PYTHONHASHSEED=0`,
//!   `PYTHONDONTWRITEBYTECODE=1`; on Windows those that programs need to start (`SystemRoot`,
//!   `SystemDrive`, `ComSpec`, `PATHEXT`); and those that `env` lists. The value of a variable in `env` is
//!   part of the key; recipes and records contain only its digest.
//! - Standard input is empty. Standard output and standard error are kept in the scratch folder, at most 64
//!   MiB each, and shown if the program fails.
//!
//! ## When it fails
//!
//! An exit status other than 0, a signal, `timeout`, or a missing or invalid output fails this item and the
//! items that need it, and no others. After `timeout`, or when the build is cancelled, the program is
//! killed with all processes that it started (on Unix: its process group). Processes that it leaves running
//! are killed when it ends.
//!
//! The error message shows the command with its placeholders filled in, quoted for a shell. With
//! `specula build --keep-scratch` the scratch folder stays in `.specula/kept`, with the input files, and
//! the command sets the same environment: paste it into a shell to run the program again. Values of
//! variables in `env` are not shown; the command takes them from your shell. The folder stays until the
//! item fails again with that option, or until `specula cache gc`. It is not kept if the program ran on
//! another machine.

mod command;
mod exchange;
mod interpreter;
mod paths;
mod process;
mod tools;

use std::ffi::OsString;
use std::fs;
use std::io;
use std::ops::Bound;
use std::path::{Path, PathBuf};
use std::time::Duration;

use engine::{Context, Failure, ItemFiles, Kind, NamedPath, Output, Port, Product, parameters, path_text};

use crate::values::artifacts::{Environment, Lighting};
use command::{Command, Piece};
use exchange::{Formats, ProgramOutput};
use process::Process;
use tools::{Platform, Variables};

parameters! {
    /// Parameters of `exec`.
    pub(crate) struct Parameters {
        /// The program and its arguments; see The command.
        command: Command,
        /// What the program makes; see The output.
        output: ProgramOutput,
        /// The format of an input's file, by port; see The files of ports.
        formats: Formats = Formats::default(),
        /// Files and folders, relative to the manifest, that the program uses in addition to those in the
        /// command; see When it reruns.
        tools: Vec<String> = Vec::new(),
        /// The environment variables that the program may see.
        env: Variables = Variables::default(),
        /// Seconds after which the program is killed.
        #[range((Bound::Excluded(0.0), Bound::Included(MAX_TIMEOUT)))]
        timeout: f64 = 60.0,
        /// Whether other machines may use its results, and run it; see Other machines.
        remote: bool = false,
        /// The properties that another machine must have to run it; see Other machines.
        platform: Platform = Platform::default(),
    }
}

/// The longest `timeout`: one day.
const MAX_TIMEOUT: f64 = 86400.0;

/// The kind `exec`.
pub(crate) struct Exec;

impl Kind for Exec {
    type Parameters = Parameters;

    const NAME: &'static str = "exec";
    const REVISION: u32 = 2;
    const RUNS_PROGRAMS: bool = true;
    const TEXT: &'static str = include_str!("exec.rs");

    fn ports() -> Vec<Port> {
        vec![port("input").optional()]
    }

    fn ports_named(names: &[&str]) -> Vec<Port> {
        names.iter().filter(|name| command::is_word(name)).map(|name| port(name)).collect()
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        parameters.output.product()
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.tools.iter().any(|tool| tool.is_empty() || tool.contains('\0')) {
            errors.push(("tools", "a name is empty or contains a NUL".into()));
        }
        if !parameters.platform.0.is_empty() && !parameters.remote {
            errors.push(("platform", "only a stage with remote = true runs on another machine".into()));
        }
        errors
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let ports: Vec<&str> = types.iter().map(|(port, _)| *port).collect();
        let errors = parameters.command.mismatches(&ports).into_iter().map(|error| ("command", error));
        errors
            .chain(parameters.formats.mismatches(types).into_iter().map(|error| ("formats", error)))
            .collect()
    }

    fn named_paths(parameters: &Parameters) -> Vec<NamedPath> {
        let tools = parameters.tools.iter().enumerate().map(|(index, tool)| NamedPath {
            parameter: "tools",
            index,
            path: tool.into(),
            is_word: false,
            is_read_whole: true,
        });
        paths::spelled(&parameters.command).chain(tools).collect()
    }

    fn is_shared(parameters: &Parameters) -> bool {
        parameters.remote
    }

    fn processor(parameters: &Parameters) -> Option<&'static str> {
        parameters.output.is_environment().then(containers::decoder_level)
    }

    fn properties(parameters: &Parameters) -> Option<Vec<(String, String)>> {
        parameters.env.is_empty().then(|| parameters.platform.0.clone())
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let (program, warnings) = tools::read(&parameters.command, &parameters.tools, context)?;
        warnings.into_iter().for_each(|warning| reporter.warn(warning));
        let scratch = Scratch::new(&context.files)?;
        let work = scratch.folder.path().join(WORK);
        let mut written = Vec::new();
        for name in parameters.command.inputs() {
            let file = exchange::write_input(name, &parameters.formats, context, &work)?;
            written.push((name, file));
        }
        let output = parameters.output.prepare(&work)?;
        let manifest = context.files.resolve(Path::new("")).components().collect::<PathBuf>();
        let argument = |pieces: &[Piece]| -> OsString {
            let file = tools::named_file(pieces, &context.files);
            file.map_or_else(|| filled(pieces, &written, &output, &manifest), OsString::from)
        };
        let process = Process {
            program,
            arguments: parameters.command.arguments().map(argument).collect(),
            environment: tools::environment(&parameters.env, scratch.folder.path(), reporter),
            name: parameters.command.name(),
            limit: Duration::from_secs_f64(parameters.timeout),
            scratch: scratch.folder.path().to_path_buf(),
        };
        let ran = process.run(&work, reporter).map_err(|failure| {
            let absent =
                parameters.command.arguments().find_map(|pieces| tools::absent(pieces, &context.files));
            match absent.filter(|_| failure.help.is_none()) {
                Some(file) => failure.help(format!("the file {} does not exist", path_text(file))),
                None => failure,
            }
        });
        let made = ran.and_then(|()| {
            // Read a second time: if a tool file changed meanwhile, the engine sees two contents and discards
            // the result.
            tools::read(&parameters.command, &parameters.tools, context)?;
            parameters.output.read(&work, &process.name, context)
        });
        made.map_err(|failure| {
            if failure.cancelled { failure } else { scratch.report(failure, &process, &context.files) }
        })
    }
}

/// A port for any artifact; those that have formats other than their own bytes are decoded.
fn port(name: &str) -> Port {
    Port::any(name).or::<Environment>().or::<Lighting>()
}

/// An argument with its placeholders filled in.
fn filled(pieces: &[Piece], inputs: &[(&str, String)], output: &str, manifest: &Path) -> OsString {
    let mut argument = OsString::new();
    for piece in pieces {
        match piece {
            Piece::Text(text) => argument.push(text),
            Piece::Output => argument.push(output),
            Piece::Folder => argument.push(manifest),
            Piece::Input(name) => {
                let file = inputs.iter().find(|(port, _)| port == name).map(|(_, file)| file.as_str());
                argument.push(file.unwrap_or_default());
            }
        }
    }
    argument
}

/// The folders of a run; removed at the end of it, unless it fails and they are kept.
struct Scratch {
    folder: tempfile::TempDir,
}

/// The program's working folder in the scratch folder.
const WORK: &str = "work";

impl Scratch {
    /// Adds to the failure the command that can be run by hand, in this folder if it is kept.
    fn report(self, mut failure: Failure, process: &Process, files: &ItemFiles<'_>) -> Failure {
        let shown = match files.kept_scratch().map(|kept| self.keep(kept)) {
            Some(Ok(kept)) => {
                let command = process.command_line_in(kept, WORK);
                format!("its files are kept in {}; the command:\n{command}", path_text(kept))
            }
            Some(Err(error)) => {
                format!("its files cannot be kept: {error}; the command:\n{}", process.command_line())
            }
            None => format!(
                "the command (specula build --keep-scratch keeps its files):\n{}",
                process.command_line()
            ),
        };
        failure.chain.insert(1.min(failure.chain.len()), shown);
        failure
    }

    /// Moves the folder to a place where it stays, instead of the one before it.
    fn keep(self, place: &Path) -> io::Result<&Path> {
        if place.exists() {
            fs::remove_dir_all(place)?;
        }
        fs::create_dir_all(place.parent().unwrap_or(place))?;
        fs::rename(self.folder.path(), place)?;
        // Nothing is left to remove.
        drop(self.folder.keep());
        Ok(place)
    }

    fn new(files: &ItemFiles<'_>) -> Result<Self, Failure> {
        let made = tempfile::Builder::new().prefix("exec-").tempdir_in(files.scratch()).and_then(|folder| {
            for name in [WORK, tools::HOME, tools::TEMPORARY] {
                fs::create_dir(folder.path().join(name))?;
            }
            Ok(Self { folder })
        });
        let place = path_text(files.scratch());
        made.map_err(|error| {
            let failure = Failure::from(error).context(format!("cannot create a scratch folder in {place}"));
            failure.system_error()
        })
    }
}
