//! Runs a program of yours: a command line with declared inputs and a declared output.
//!
//! For tools that exist already: a grading script, a denoiser, an engine's texture packer. The inputs are written to
//! files, the command is run once for each item, and what it wrote is read back, checked, and goes on as an
//! artifact like any other, or is published.
//!
//! ## The command
//!
//! `command` is the program and its arguments. No shell looks at it; `["sh", "-c", "..."]` asks for one. In an argument
//! stand for something:
//!
//! | written | is |
//! | --- | --- |
//! | `{input.NAME}` | the file that holds what arrives at the port NAME of `inputs` |
//! | `{input}` | the same for the short form `input = "STAGE"` |
//! | `{output}` | the file that the program must write; for type `files`, an existing folder |
//! | `{folder}` | the manifest's folder |
//! | `{{`, `}}` | a brace |
//!
//! A program without a `/` is looked up in PATH; any other is relative to the manifest's folder. An argument
//! that names an existing file of the manifest's folder becomes its full path, as `tools/grade.py` in the example.
//! `inputs` may have any port names, or there may be none; a port takes every type of artifact, also the types of a
//! studio's own kinds. The command must use every port, and `{output}`.
//!
//! ## What a port's file holds
//!
//! | type | formats, the first is the default |
//! | --- | --- |
//! | `environment` | `exr`: the `lat-long` of `import-environment`, RGB, 32-bit float, every bit kept; `hdr`: Radiance RGBE, which rounds; `safetensors` |
//! | `lighting` | `safetensors`; `json`: that of `export-sh` with its preset `specula` |
//! | `material`, `brdf`, `reflection`, `shrm`, `mesh` | `safetensors` |
//! | a type of a studio's own kind | `bin`: the bytes as that kind encodes them |
//!
//! `formats = { NAME = "hdr" }` chooses another for a port. `specula inspect` and the manual pages of the exports tell
//! the tensors' names and shapes, CONVENTIONS.md the frame.
//!
//! ## What the program makes
//!
//! `output = { type = "environment", format = "exr" }` takes back an artifact, in a format of the table above. It must be
//! whole; an environment must be twice as wide as high (or have OpenEXR's `envmap` attribute), and no pixel NaN,
//! infinite or negative. Specula encodes the value anew, so that it does not matter whether the program writes the time
//! into its files: equal values are equal results, and nothing after them runs.
//!
//! `output = { type = "file", format = "png" }` publishes the file as it is, `.png` after the item's `path`, and before
//! it the recipe as `.png.json`. `output = { type = "files", names = ["px.dds", "nx.dds"] }` publishes a folder of
//! files and the recipe as `/recipe.json`; the last name is the index, which is replaced after the others. The same
//! inputs should make the same bytes here.
//!
//! ## When it is run again
//!
//! When an input, a parameter or a *tool file* changes: the program's own file, wherever PATH led to it; every
//! argument that names a file; and what `tools` lists: files, or folders with all that is in them but hidden files
//! and what Python leaves (`__pycache__`). A program that starts others, or a script that loads modules, should have these
//! in `tools`. Specula cannot see what a program reads besides, and nor can it see an input from the network.
//!
//! ## What the program finds
//!
//! - Its working folder is a scratch folder of the item, which is removed afterwards, also after a failure. Paths of
//!   inputs and output are relative to it, and are the same in each run.
//! - Its environment is empty but for `PATH`, as Specula has it; `HOME` and `TMPDIR` (`TEMP`, `TMP`), in the scratch
//!   folder; `LANG=C.UTF-8`, `TZ=UTC`, `SOURCE_DATE_EPOCH=0`, `PYTHONHASHSEED=0`, `PYTHONDONTWRITEBYTECODE=1`; on Windows what programs
//!   cannot start without (`SystemRoot`, `SystemDrive`, `ComSpec`, `PATHEXT`); and what `env` names.
//!   The value of a variable in `env` is part of the key; recipes and records hold its digest only.
//! - Standard input is empty. What it writes to standard output and standard error is shown when it fails.
//!   The scratch folder holds it meanwhile, 64 MiB at most.
//!
//! ## When it fails
//!
//! An exit status other than 0, a signal, `timeout`, or an output that is not there or not sound fails this item and what
//! needs it, and no other. When time is up or the build is cancelled, the program is killed with all
//! that it started (on Unix: its process group). What it started and left running is killed when it ends.
//!
//! ## Example
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

mod command;
mod exchange;
mod process;
mod tools;

use std::ffi::OsString;
use std::fs;
use std::ops::Bound;
use std::path::Path;
use std::time::Duration;

use engine::{Context, Failure, Kind, Output, Port, Product, parameters};

use self::command::{Command, Piece};
use self::exchange::{Formats, Made};
use self::process::Process;
use self::tools::Variables;

parameters! {
    /// Parameters of `exec`.
    pub(crate) struct Parameters {
        /// The program and its arguments; see The command.
        command: Command,
        /// What the program makes; see there.
        output: Made,
        /// The format of an input's file, by port; see What a port's file holds.
        formats: Formats = Formats::default(),
        /// Files and folders, relative to the manifest, that the program uses besides those in the command.
        tools: Vec<String> = Vec::new(),
        /// The environment variables that the program may see.
        env: Variables = Variables::default(),
        /// Seconds after which the program is killed.
        #[range((Bound::Excluded(0.0), Bound::Included(LONGEST)))]
        timeout: f64 = 60.0,
    }
}

/// The longest `timeout`: a day.
const LONGEST: f64 = 86400.0;

/// The kind `exec`.
pub(crate) struct Exec;

impl Kind for Exec {
    type Parameters = Parameters;

    const NAME: &'static str = "exec";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("exec.rs");

    fn ports() -> Vec<Port> {
        vec![Port::any("input").optional()]
    }

    fn ports_named(names: &[&str]) -> Vec<Port> {
        names.iter().filter(|name| command::is_word(name)).map(|name| Port::any(*name)).collect()
    }

    fn product(parameters: &Parameters, _: &[(&str, &'static str)]) -> Product {
        parameters.output.product()
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match parameters.tools.iter().any(|tool| tool.is_empty() || tool.contains('\0')) {
            true => vec![("tools", "a name is empty or has a NUL".into())],
            false => Vec::new(),
        }
    }

    fn check_inputs(parameters: &Parameters, types: &[(&str, &'static str)]) -> Vec<(&'static str, String)> {
        let ports: Vec<&str> = types.iter().map(|(port, _)| *port).collect();
        let faults = parameters.command.misfits(&ports).into_iter().map(|fault| ("command", fault));
        faults.chain(parameters.formats.misfits(types).into_iter().map(|fault| ("formats", fault))).collect()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let program = tools::program(&parameters.command, context)?;
        tools::read(parameters, context)?;
        let scratch = Scratch::new(context)?;
        let work = scratch.folder.path().join(WORK);
        let mut written = Vec::new();
        for name in parameters.command.inputs() {
            let file = exchange::write_input(name, &parameters.formats, context, &work)?;
            written.push((name, file));
        }
        let output = parameters.output.prepare(&work)?;
        let manifest = context.resolve(Path::new(""));
        let argument = |pieces: &[Piece]| -> OsString {
            let file = tools::named_file(pieces, context);
            file.map_or_else(|| filled(pieces, &written, &output, &manifest), OsString::from)
        };
        let process = Process {
            program,
            arguments: parameters.command.arguments().map(argument).collect(),
            environment: tools::environment(&parameters.env, scratch.folder.path(), context),
            name: parameters.command.name(),
            limit: Duration::from_secs_f64(parameters.timeout),
        };
        process.run(scratch.folder.path(), &work, context).map_err(|failure| {
            let absent = parameters.command.arguments().find_map(|pieces| tools::absent(pieces, context));
            match absent.filter(|_| failure.help.is_none()) {
                Some(file) => failure.help(format!("there is no file {}", file.display())),
                None => failure,
            }
        })?;
        // Read a second time: where a tool file changed meanwhile, the engine sees two contents and keeps neither's result.
        tools::program(&parameters.command, context)?;
        tools::read(parameters, context)?;
        parameters.output.read(&work, &process.name, context)
    }
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

/// The folders of a run; removed at the end of it, however it ends.
struct Scratch {
    folder: tempfile::TempDir,
}

/// The program's working folder in the scratch folder.
const WORK: &str = "work";

impl Scratch {
    fn new(context: &Context<'_>) -> Result<Self, Failure> {
        let made =
            tempfile::Builder::new().prefix("exec-").tempdir_in(context.scratch()).and_then(|folder| {
                for name in [WORK, tools::HOME, tools::TEMPORARY] {
                    fs::create_dir(folder.path().join(name))?;
                }
                Ok(Self { folder })
            });
        let place = context.scratch().display();
        made.map_err(|error| {
            let failure = Failure::from(error).context(format!("cannot make a scratch folder in {place}"));
            failure.system_error()
        })
    }
}
