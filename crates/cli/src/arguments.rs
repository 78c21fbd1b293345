//! The command line: commands, arguments and options.

mod convert;
mod remote;
mod values;

use std::net::SocketAddr;
use std::path::PathBuf;

use ::preview::{Mode, SubjectRequest};
use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use clap_complete::Shell;

pub(crate) use self::convert::{ConvertArguments, ConvertTarget};
pub(crate) use self::remote::{RemoteArguments, RemoteDownload, RemoteUpload};
use crate::exit::Exit;

/// The usual name of a manifest.
pub(crate) const MANIFEST: &str = "pipeline.toml";

/// Turns light and materials into reflection maps, and keeps them up to date.
#[derive(Debug, Parser)]
#[command(name = "specula", version, after_help = Exit::HELP)]
pub(crate) struct Arguments {
    /// Work as if started in this folder
    #[arg(short = 'C', value_name = "DIR", global = true, value_hint = ValueHint::DirPath)]
    pub(crate) working_folder: Option<PathBuf>,
    /// Whether to colour messages
    #[arg(long, value_name = "WHEN", default_value = "auto", global = true)]
    pub(crate) color: Colour,
    /// With --version: also print the commit, the features, and the licences of all crates
    #[arg(long, requires = "version")]
    pub(crate) verbose: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Colour {
    /// On a terminal, unless NO_COLOR, FORCE_COLOR, CLICOLOR_FORCE or CLICOLOR say otherwise
    Auto,
    Always,
    Never,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run everything that is out of date and publish the results
    Build(BuildArguments),
    /// Build, and rebuild whenever a file that the graph reads changes, until Ctrl-C
    Watch(WatchArguments),
    /// Show materials on meshes under environments, in a window that follows every change
    Preview(PreviewArguments),
    /// Explain why a stage, an item or an exported file would run, or why it last ran
    Explain(ExplainArguments),
    /// Show the content of the cache, make it smaller, or check it
    Cache {
        #[command(subcommand)]
        command: CacheCommand,
    },
    /// Remove published files that no manifest exports any more (after a manifest was renamed or deleted,
    /// or its `out` changed)
    Prune {
        #[command(flatten)]
        query: QueryArguments,
        /// Show what would be removed, and remove nothing
        #[arg(long)]
        dry_run: bool,
    },
    /// Check that exported files match their recipes, and that their sources have not changed since
    Verify(VerifyArguments),
    /// Check the manifest, and the text and headers of its sources; or check that outputs do not depend on
    /// the number of threads
    Check(CheckArguments),
    /// Print the graph of the manifest
    Graph(GraphArguments),
    /// List the kinds of stage, or print the manual page of one
    Stages {
        /// The kind whose manual page to print
        kind: Option<String>,
    },
    /// Print the JSON Schema of a kind of file, for editors and programs
    Schema {
        /// The kind of file
        #[arg(value_enum, default_value = "pipeline")]
        subject: SchemaSubject,
    },
    /// Describe a file: a material in words, or its shape, frame, range and recipe
    Inspect {
        /// An exported file, an artifact in `.specula/blobs`, an image, a material, or a preset
        file: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
        /// Draw a material (lobes, albedo by angle, a ball) or a BRDF table (coefficients) to this PNG file
        #[arg(long, value_name = "PNG", value_parser = values::png_file)]
        picture: Option<PathBuf>,
        /// Print a shader that looks up this file, which must be a spherical harmonic reflection map
        #[arg(long, value_enum, value_name = "LANGUAGE", conflicts_with_all = ["json", "picture"])]
        shader: Option<ShaderName>,
    },
    /// Write environments in another layout, size or format, without a manifest
    Convert(ConvertArguments),
    /// Convert lighting in spherical harmonics from one engine's convention to another's
    ConvertSh(ConvertShArguments),
    /// Write files that show where an engine looks, which level it reads and how bright the result is
    TestPattern(TestPatternArguments),
    /// Write a manifest for the images, materials and meshes in a folder, or a starter manifest
    Init {
        /// The folder to write it into
        #[arg(default_value = ".", value_hint = ValueHint::DirPath)]
        folder: PathBuf,
        #[arg(long, value_name = "NAME", value_parser = values::engine, help = values::engine_of_a_project())]
        engine: Option<String>,
        /// Write the sample project with its assets
        #[arg(long, conflicts_with = "engine")]
        sample: bool,
        /// Write the preset materials to assets/materials too, even if there is a manifest
        #[arg(long, conflicts_with = "sample")]
        materials: bool,
    },
    /// Print a script that completes the arguments of specula in a shell
    Completions {
        /// The shell
        shell: Shell,
    },
    /// Print what may complete the last of some words, for the scripts of `specula completions`
    #[command(hide = true)]
    Complete {
        /// The arguments so far
        #[arg(last = true)]
        words: Vec<String>,
    },
    /// Run the item that a build with --remote-executor put into a folder, on a worker of its server
    #[command(hide = true)]
    RunItem {
        /// Its description; the folder that has it has its files
        item: PathBuf,
    },
    /// Write the manual pages of all commands, for `man`
    Man {
        /// The folder to write them into
        #[arg(value_hint = ValueHint::DirPath)]
        folder: PathBuf,
    },
}

impl Command {
    /// The manifest that the command works on, if it works on one.
    pub(crate) fn manifest_mut(&mut self) -> Option<&mut PathBuf> {
        let manifest = match self {
            Self::Build(arguments) => &mut arguments.manifest,
            Self::Watch(arguments) => &mut arguments.manifest,
            Self::Cache { command } => match command {
                CacheCommand::Stats { query }
                | CacheCommand::Gc { query, .. }
                | CacheCommand::Verify { query } => &mut query.manifest,
            },
            Self::Prune { query, .. } => &mut query.manifest,
            Self::Explain(arguments) => &mut arguments.query.manifest,
            Self::Verify(arguments) => &mut arguments.query.manifest,
            Self::Check(arguments) => &mut arguments.query.manifest,
            Self::Graph(arguments) => &mut arguments.manifest,
            Self::Stages { .. }
            | Self::Schema { .. }
            | Self::Inspect { .. }
            | Self::Convert(_)
            | Self::ConvertSh(_)
            | Self::TestPattern(_)
            | Self::Preview(_)
            | Self::Init { .. }
            | Self::Completions { .. }
            | Self::Complete { .. }
            | Self::RunItem { .. }
            | Self::Man { .. } => return None,
        };
        Some(&mut manifest.manifest)
    }

    /// What the command prints on standard output for programs, if `--json` asks for it.
    pub(crate) fn json(&self) -> Option<JsonOutput> {
        let (is_wanted, output) = match self {
            Self::Build(BuildArguments { json, .. }) | Self::Watch(WatchArguments { json, .. }) => {
                (*json, JsonOutput::Events)
            }
            Self::Inspect { json, .. } => (*json, JsonOutput::Object),
            Self::Cache { command } => (command.query().json, JsonOutput::Object),
            Self::Explain(ExplainArguments { query, .. })
            | Self::Verify(VerifyArguments { query, .. })
            | Self::Prune { query, .. }
            | Self::Check(CheckArguments { query, .. }) => (query.json, JsonOutput::Object),
            Self::Preview(_)
            | Self::Graph(_)
            | Self::Stages { .. }
            | Self::Schema { .. }
            | Self::Convert(_)
            | Self::ConvertSh(_)
            | Self::TestPattern(_)
            | Self::Init { .. }
            | Self::Completions { .. }
            | Self::Complete { .. }
            | Self::RunItem { .. }
            | Self::Man { .. } => return None,
        };
        is_wanted.then_some(output)
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum CacheCommand {
    /// Show how large the cache is, and how much of it is needed
    Stats {
        #[command(flatten)]
        query: QueryArguments,
    },
    /// Remove unused files, and optionally the oldest earlier results; the last good outputs always stay
    Gc {
        #[command(flatten)]
        query: QueryArguments,
        /// Also remove earlier results, the oldest first, until the cache is no larger than SIZE, such as
        /// 500M
        #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
        max_size: Option<u64>,
        /// Show what would be removed, and remove nothing
        #[arg(long)]
        dry_run: bool,
    },
    /// Compare every result with its digest, and remove damaged ones; the next build makes them again
    Verify {
        #[command(flatten)]
        query: QueryArguments,
    },
}

/// What a command with `--json` prints on standard output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JsonOutput {
    /// One object.
    Object,
    /// A line for each event.
    Events,
}

impl CacheCommand {
    fn query(&self) -> &QueryArguments {
        match self {
            Self::Stats { query } | Self::Gc { query, .. } | Self::Verify { query } => query,
        }
    }
}

#[derive(Args, Clone, Debug)]
pub(crate) struct ManifestArgument {
    /// The manifest, searched for here and in the folders above
    #[arg(long, value_name = "FILE", default_value = MANIFEST)]
    pub(crate) manifest: PathBuf,
}

// The options of commands that report results; clap would print a doc comment as help.
#[derive(Args, Debug)]
pub(crate) struct QueryArguments {
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct BuildArguments {
    /// The stages and items (`"map [sky, gold]"`) to build; those that they need are built too [default: all]
    #[arg(value_name = "STAGE|ITEM")]
    pub(crate) stages: Vec<String>,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// Run the named stages and items, or all, even if they are up to date; those that they need are not
    /// forced
    #[arg(long)]
    pub(crate) force: bool,
    /// The number of threads [default: one per processor]
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Show what would run and why, without writing anything
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// After a failure, continue with the items that do not need the failed one (the default)
    #[arg(long, conflicts_with = "fail_fast")]
    pub(crate) keep_going: bool,
    /// After the first failure, do not start other items
    #[arg(long)]
    pub(crate) fail_fast: bool,
    /// Keep the scratch folder of each failed `exec` in .specula/kept, and print a command to run it by hand
    #[arg(long)]
    pub(crate) keep_scratch: bool,
    /// If another process works in the folder, wait without a limit, or at most SECONDS [default: 10]
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, require_equals = true)]
    pub(crate) wait: Option<Option<u32>>,
    /// Print every event as a line of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// List every item, including those that are up to date, with all warnings, failures and notes
    #[arg(long, short)]
    pub(crate) verbose: bool,
    /// Show only warnings and failures
    #[arg(long, short, conflicts_with_all = ["verbose", "dry_run"])]
    pub(crate) quiet: bool,
    /// Write a timeline of the workers: timings.html, and timings.json for Perfetto [default: into .specula]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, require_equals = true, conflicts_with = "dry_run",
          value_hint = ValueHint::DirPath)]
    pub(crate) timings: Option<Option<PathBuf>>,
    /// Write a report for CI servers in the format of JUnit, even if the build fails: a test case for each
    /// item
    #[arg(long, value_name = "FILE", conflicts_with = "dry_run", value_hint = ValueHint::FilePath)]
    pub(crate) junit: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) remote: RemoteArguments,
}

#[derive(Args, Clone, Debug)]
pub(crate) struct WatchArguments {
    /// The stages and items to keep up to date, with those that they need [default: all]
    #[arg(value_name = "STAGE|ITEM")]
    pub(crate) stages: Vec<String>,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// In the first build, run the named stages and items, or all, even if they are up to date
    #[arg(long)]
    pub(crate) force: bool,
    /// Print every event as a line of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// End after the first rebuild that a change causes, with the exit code of that build
    #[arg(long)]
    pub(crate) once: bool,
    /// Keep the scratch folder of each failed `exec` in .specula/kept, and print a command to run it by hand
    #[arg(long)]
    pub(crate) keep_scratch: bool,
    /// Show the results in a window, as `specula preview` does
    #[arg(long, conflicts_with = "once")]
    pub(crate) preview: bool,
    /// Serve a page that shows the results in browsers, and print its link [default address: 127.0.0.1, any
    /// free port]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:0",
          conflicts_with_all = ["once", "preview"], value_parser = values::address)]
    pub(crate) serve: Option<SocketAddr>,
    #[command(flatten)]
    pub(crate) watching: WatchingArguments,
}

// The options of commands that watch.
#[derive(Args, Clone, Debug)]
pub(crate) struct WatchingArguments {
    /// The number of threads [default: one per processor]
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// How long files must stay unchanged before a rebuild starts, so that programs can finish saving
    #[arg(long, value_name = "MS", default_value_t = 20,
          value_parser = clap::value_parser!(u64).range(..=60_000))]
    pub(crate) debounce: u64,
    /// Poll the files this often instead of listening for events [default without a value: 500]
    #[arg(long, value_name = "MS", num_args = 0..=1, default_missing_value = "500",
          value_parser = clap::value_parser!(u64).range(10..=3_600_000))]
    pub(crate) poll: Option<u64>,
    /// List every item, file and warning
    #[arg(long, short)]
    pub(crate) verbose: bool,
    /// The most memory for decoded artifacts, such as 512MiB; 0 keeps none
    #[arg(long, value_name = "SIZE", default_value = "1GiB", value_parser = values::bytes)]
    pub(crate) memory: u64,
    /// Trim the cache to this size while idle, such as 20GiB [default: no limit]
    #[arg(long, value_name = "SIZE", value_parser = values::bytes)]
    pub(crate) max_cache: Option<u64>,
    #[command(flatten)]
    pub(crate) remote: RemoteArguments,
}

#[derive(Args, Debug)]
pub(crate) struct PreviewArguments {
    /// A manifest [default: the nearest pipeline.toml]; or images, materials, presets and meshes to show
    #[arg(value_name = "MANIFEST|FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// With files: print the manifest that shows them, without opening a window
    #[arg(long, requires = "files", conflicts_with = "still")]
    pub(crate) manifest: bool,
    /// What to show first, such as environment=sky,material=gold,mesh=sphere; parts that you leave out stay
    /// as they were
    #[arg(long, value_name = "PART=NAME,...", value_parser = values::subject)]
    pub(crate) item: Option<SubjectRequest>,
    #[arg(long, help = values::modes(), value_parser = values::mode)]
    pub(crate) mode: Option<Mode>,
    /// Write one picture to this PNG file, without opening a window
    #[arg(long, value_name = "FILE", value_parser = values::png_file)]
    pub(crate) still: Option<PathBuf>,
    /// With --still: width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", requires = "still",
          value_parser = values::picture_size)]
    pub(crate) size: [u32; 2],
    /// The renderer [default: cpu for a still, which is then bit-identical everywhere; gpu for the window]
    #[arg(long, value_enum)]
    pub(crate) backend: Option<Backend>,
    /// With --still: stops to brighten the usual exposure for the environment, from -24 to 24, such as -1.5
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, requires = "still",
          allow_negative_numbers = true, value_parser = values::exposure)]
    pub(crate) exposure: f64,
    #[command(flatten)]
    pub(crate) page: PageArguments,
    #[command(flatten)]
    pub(crate) watching: WatchingArguments,
}

// The options of a page in place of a window.
#[derive(Args, Clone, Debug)]
pub(crate) struct PageArguments {
    /// Serve a page for browsers in place of a window, and open it [default address: 127.0.0.1, any free
    /// port]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:0",
          conflicts_with = "still", value_parser = values::address)]
    pub(crate) serve: Option<SocketAddr>,
    /// Serve the page and print its link, without opening a browser
    #[arg(long, conflicts_with = "still")]
    pub(crate) no_open: bool,
}

#[derive(Args, Debug)]
pub(crate) struct ConvertShArguments {
    /// JSON of export-sh, an .env file, a glTF document with EXT_lights_image_based, or text with 27 numbers
    pub(crate) input: PathBuf,
    /// The convention of the input: specula, directx, unreal, unity, filament, three, babylon, babylon-env
    /// or gltf [default: as the file says]
    #[arg(long, value_name = "PRESET")]
    pub(crate) from: Option<String>,
    /// The convention to write
    #[arg(long, value_name = "PRESET")]
    pub(crate) to: String,
    /// The file to write: JSON, or rows of numbers if it ends with .txt [default: JSON to standard output]
    #[arg(long, short, value_name = "OUT")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Args, Debug)]
pub(crate) struct TestPatternArguments {
    /// The folder to write the files into
    pub(crate) output: PathBuf,
    #[arg(long, value_name = "NAME", help = values::engines())]
    pub(crate) preset: String,
    /// How texels are stored, such as rgba16f or bc6h [default: what the engine prefers]
    #[arg(long, value_name = "FORMAT")]
    pub(crate) format: Option<String>,
    /// Texels along the edge of a face, or rows of a lat-long image [default: 64]
    #[arg(long, short, value_name = "N")]
    pub(crate) resolution: Option<u32>,
    /// Write a volume of light probes, for a preset of the kind export-probes
    #[arg(long, conflicts_with = "resolution")]
    pub(crate) probes: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Backend {
    /// The processor
    Cpu,
    /// The graphics device; if there is none, the processor, with a warning
    Gpu,
}

#[derive(Args, Debug)]
pub(crate) struct ExplainArguments {
    /// A stage, an item (`"map [sky, gold]"`), a file in the output folder, or a source file
    #[arg(value_name = "STAGE|ITEM|FILE")]
    pub(crate) target: String,
    #[command(flatten)]
    pub(crate) query: QueryArguments,
    /// Explain every item of a stage in full, instead of grouping similar ones
    #[arg(long, short)]
    pub(crate) verbose: bool,
}

#[derive(Args, Debug)]
pub(crate) struct VerifyArguments {
    /// Files in the output folder, or copies of them anywhere; folders and globs stand for the files in
    /// them [default: the whole output folder]
    #[arg(value_name = "FILE|FOLDER|GLOB")]
    pub(crate) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) query: QueryArguments,
}

#[derive(Args, Debug)]
pub(crate) struct CheckArguments {
    /// The stages to run, with the stages that they need [default: all]
    #[arg(value_name = "STAGE", requires = "determinism")]
    pub(crate) stages: Vec<String>,
    #[command(flatten)]
    pub(crate) query: QueryArguments,
    /// Run stages from scratch with several numbers of threads, in a temporary folder, and compare every byte
    #[arg(long)]
    pub(crate) determinism: bool,
    /// The numbers of threads [default: 1, 2, and one more than there are processors]
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', requires = "determinism",
          value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Vec<u16>,
}

#[derive(Args, Debug)]
pub(crate) struct GraphArguments {
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// The language to write the graph in
    #[arg(long, value_enum, default_value = "mermaid")]
    pub(crate) format: GraphFormat,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ShaderName {
    /// GLSL: OpenGL, Vulkan, WebGL 2
    Glsl,
    /// WGSL: WebGPU
    Wgsl,
    /// HLSL: Direct3D
    Hlsl,
    /// Metal: Apple's devices
    Metal,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum GraphFormat {
    /// Mermaid: shown by many Markdown viewers
    Mermaid,
    /// DOT: drawn by Graphviz
    Dot,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SchemaSubject {
    /// Manifests: `pipeline.toml`
    Pipeline,
    /// Material files
    Material,
    /// The lines of `--json`
    Events,
    /// Light probes: `probes.json` of export-probes with preset = "ktx2"
    Probes,
}
