//! What can be typed after `specula`.

use std::env;
use std::path::PathBuf;
use std::process::ExitCode;

use ::preview::Mode;
use ::preview::SubjectRequest;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::escape::escaped;
use crate::{Exit, preview, print, quantity};

/// Turns light and materials into reflection maps, and keeps them up to date.
#[derive(Debug, Parser)]
#[command(name = "specula", version, after_help = Exit::HELP)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

impl Arguments {
    /// What was typed. If that asks for help or cannot be understood, this is printed, and the exit code is given.
    pub(crate) fn of_process() -> Result<Self, ExitCode> {
        let typed = env::args_os().collect::<Vec<_>>();
        Self::try_parse_from(&typed).map_err(|error| {
            // clap colours what it quotes, so that it has to be escaped before clap sees it.
            let shown = typed.iter().map(|argument| escaped(&argument.to_string_lossy()).into_owned());
            match Self::try_parse_from(shown) {
                Err(shown) if shown.kind() == error.kind() => _ = shown.print(),
                _ => print::message(error.to_string().trim_end()),
            }
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(Exit::Usage as u8))
        })
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run what is out of date and publish the results
    Build(BuildArguments),
    /// Build, then build again whenever a file changes that the graph reads, until Ctrl-C
    Watch(WatchArguments),
    /// Show materials under environments on meshes, in a window that follows every change
    Preview(PreviewArguments),
    /// Say why a stage or an exported file would run, or why it did
    Explain(ExplainArguments),
    /// Say what the cache holds, make it smaller, or check it
    Cache {
        #[command(subcommand)]
        command: CacheCommand,
    },
    /// Say whether an exported file is what its recipe says, and whether its sources have changed since
    Verify(VerifyArguments),
    /// Say whether the manifest is sound, or whether outputs depend on the number of threads
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
        /// What is described
        #[arg(value_enum, default_value = "pipeline")]
        subject: SchemaSubject,
    },
    /// Say what a file is: shape, frame, range, recipe
    Inspect {
        /// An exported file, an artifact in `.specula/blobs`, or an image from elsewhere
        file: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Write a starter manifest
    Init {
        /// The folder to write it into
        #[arg(default_value = ".")]
        folder: PathBuf,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum CacheCommand {
    /// Say how large the cache is, and what of it is needed
    Stats {
        #[command(flatten)]
        manifest: ManifestArgument,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Remove what no record names and, for a size, the oldest earlier results; never the last good outputs
    Gc {
        #[command(flatten)]
        manifest: ManifestArgument,
        /// Remove the results of earlier builds too, the oldest first, until the cache is no larger than SIZE, such as 500M
        #[arg(long, value_name = "SIZE", value_parser = quantity::parse_size)]
        max_size: Option<u64>,
        /// Say what would be removed; remove nothing
        #[arg(long)]
        dry_run: bool,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Compare every result with its digest; a damaged one is dropped, and the next build makes it again
    Verify {
        #[command(flatten)]
        manifest: ManifestArgument,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
}

#[derive(Args, Debug)]
pub(crate) struct ManifestArgument {
    /// The manifest
    #[arg(long, value_name = "FILE", default_value = "pipeline.toml")]
    pub(crate) manifest: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct BuildArguments {
    /// The stages to build, with all that they need; none means all
    #[arg(value_name = "STAGE")]
    pub(crate) stages: Vec<String>,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// How many threads work [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Say what would run and why; write nothing
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Go on with everything that does not need a failed item (the default)
    #[arg(long, conflicts_with = "fail_fast")]
    pub(crate) keep_going: bool,
    /// Start nothing more after the first failure
    #[arg(long)]
    pub(crate) fail_fast: bool,
    /// Wait for another process at work in the folder, as long as it takes or at most SECONDS [default: 10 seconds]
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, require_equals = true)]
    pub(crate) wait: Option<Option<u32>>,
    /// Print every event as a line of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Name the items that were up to date too, all that failed, and facts about results
    #[arg(long, short)]
    pub(crate) verbose: bool,
    /// Write what every worker did when, as timings.html and (for Perfetto) timings.json [default: into .specula]
    #[arg(long, value_name = "FOLDER", num_args = 0..=1, require_equals = true, conflicts_with = "dry_run")]
    pub(crate) timings: Option<Option<PathBuf>>,
}

#[derive(Args, Debug)]
pub(crate) struct WatchArguments {
    /// The stages to keep fresh, with all that they need; none means all
    #[arg(value_name = "STAGE")]
    pub(crate) stages: Vec<String>,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// Print every event as a line of JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Return after the first rebuild that a change caused, with its exit code
    #[arg(long)]
    pub(crate) once: bool,
    /// Show what is made in a window, as `specula preview` does
    #[arg(long, conflicts_with = "once")]
    pub(crate) preview: bool,
    #[command(flatten)]
    pub(crate) way: WayOfWatching,
}

/// How changes are noticed and worked off.
#[derive(Args, Clone, Debug)]
pub(crate) struct WayOfWatching {
    /// How many threads work [default: one per processor]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// The quiet time after a change before it is acted on, so that a file is written to its end
    #[arg(long, value_name = "MS", default_value_t = 20, value_parser = clap::value_parser!(u64).range(..=60_000))]
    pub(crate) debounce: u64,
    /// Look at the files this often rather than listen for events [default, where no time is given: 500]
    #[arg(long, value_name = "MS", num_args = 0..=1, default_missing_value = "500", value_parser = clap::value_parser!(u64).range(10..=3_600_000))]
    pub(crate) poll: Option<u64>,
    /// Name every item and every file
    #[arg(long, short)]
    pub(crate) verbose: bool,
    /// Keep decoded artifacts of at most this size in memory, such as 512MiB; 0 keeps none
    #[arg(long, value_name = "SIZE", default_value = "1GiB", value_parser = quantity::parse_size)]
    pub(crate) memory: u64,
    /// Trim the cache to this size when nothing is to be done, such as 20GiB [default: it grows]
    #[arg(long, value_name = "SIZE", value_parser = quantity::parse_size)]
    pub(crate) max_cache: Option<u64>,
}

#[derive(Args, Debug)]
pub(crate) struct PreviewArguments {
    /// The manifest
    #[arg(value_name = "MANIFEST", default_value = "pipeline.toml")]
    pub(crate) manifest: PathBuf,
    /// What to show first, such as environment=sky,material=gold,mesh=sphere; what is left out is as it was
    #[arg(long, value_name = "PART=NAME,...", value_parser = preview::parse_item)]
    pub(crate) item: Option<SubjectRequest>,
    /// The map that shades it first: local-shrm, global-shrm, cabral, kautz-mccool, prefiltered, irradiance, mirror or brute-force
    #[arg(long, value_parser = preview::parse_mode)]
    pub(crate) mode: Option<Mode>,
    /// Write one picture to this file, a PNG, and open no window
    #[arg(long, value_name = "FILE", value_parser = preview::parse_still)]
    pub(crate) still: Option<PathBuf>,
    /// With --still: width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", requires = "still", value_parser = preview::parse_size)]
    pub(crate) size: [u32; 2],
    /// What draws [default: cpu for a still, which is the same to the bit everywhere, gpu for the window]
    #[arg(long, value_enum)]
    pub(crate) backend: Option<Backend>,
    /// With --still: how many stops brighter, -24 to 24, such as -1.5
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, requires = "still", allow_negative_numbers = true, value_parser = preview::parse_exposure)]
    pub(crate) exposure: f64,
    #[command(flatten)]
    pub(crate) way: WayOfWatching,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Backend {
    /// The processor
    Cpu,
    /// The graphics device; where there is none, the processor, with a warning
    Gpu,
}

#[derive(Args, Debug)]
pub(crate) struct ExplainArguments {
    /// A stage, one of its items (`"map [sky, gold]"`), a file in the output folder, or one that a stage has as source
    #[arg(value_name = "STAGE|ITEM|FILE")]
    pub(crate) target: String,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// Tell every item of a stage in full, rather than together with those like it
    #[arg(long, short)]
    pub(crate) verbose: bool,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct VerifyArguments {
    /// A file in the output folder, or a copy of one anywhere
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct CheckArguments {
    /// The stages to run, with all that they need; none means all
    #[arg(value_name = "STAGE", requires = "determinism")]
    pub(crate) stages: Vec<String>,
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// Run stages from nothing with several numbers of threads, in a temporary folder, and compare every byte
    #[arg(long)]
    pub(crate) determinism: bool,
    /// The numbers of threads [default: 1, 2, and one more than there are processors]
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', requires = "determinism",
          value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Vec<u16>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Args, Debug)]
pub(crate) struct GraphArguments {
    #[command(flatten)]
    pub(crate) manifest: ManifestArgument,
    /// The language of the graph
    #[arg(long, value_enum, default_value = "mermaid")]
    pub(crate) format: GraphFormat,
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
    /// `pipeline.toml`, made of the kinds
    Pipeline,
    /// Material files
    Material,
    /// The lines of `--json`
    Events,
}
