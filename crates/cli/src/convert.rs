//! `specula convert`: environments in another layout, size or format, without a manifest.
//!
//! It writes a manifest into a temporary folder, builds it, and moves what it made to its place: the same
//! kinds do the work as in a pipeline, and `--manifest` prints the manifest to keep.

use std::fs;
use std::path::{Path, PathBuf};

use engine::{BuildOptions, Cancel, Event, Kinds, Plan};

use crate::arguments::{ConvertArguments, MANIFEST};
use crate::assets::{self, Assets};
use crate::build::{exit_of, stop_on_interrupt};
use crate::build_reporter::BuildReporter;
use crate::exit::Exit;
use crate::print::{self, say};
use crate::quantity::count;
use crate::standard_pipeline::Conversion;

/// The endings of what is written, with the formats of `export-environment`.
const ENDINGS: [(&str, &str); 6] =
    [("exr", "exr"), ("hdr", "rgbe"), ("pic", "rgbe"), ("png", "png"), ("ktx2", "ktx2"), ("dds", "dds")];

/// What is converted, and where to.
struct Request {
    /// The source of the import, absolute or relative to the current folder.
    files: Vec<PathBuf>,
    /// Whether the output is a folder with a file for each input.
    is_folder: bool,
    conversion: Conversion,
}

pub(crate) fn run(arguments: &ConvertArguments, kinds: &Kinds) -> Result<Exit, Exit> {
    let request = Request::of(arguments).map_err(|error| {
        print::error(&[error], None);
        Exit::Usage
    })?;
    if arguments.manifest {
        let source = assets::source_of(&request.files, Path::new(""));
        let path =
            if request.is_folder { "{environment}".into() } else { arguments.output.with_extension("") };
        let path = path.to_string_lossy().replace('\\', "/");
        return Ok(print::data(&request.conversion.manifest(&source, &path)));
    }
    convert(&request, arguments, kinds)
}

impl Request {
    fn of(arguments: &ConvertArguments) -> Result<Self, String> {
        let (input, output) = (&arguments.input, &arguments.output);
        let kind =
            fs::metadata(input).map_err(|error| format!("cannot read {}: {error}", input.display()))?;
        // A folder is six faces if its layout says so, and otherwise holds files.
        let is_folder = kind.is_dir() && arguments.from.as_deref() != Some("cube");
        let files = if is_folder { Assets::in_folder(input) } else { vec![input.clone()] };
        if files.is_empty() {
            return Err(format!("{} holds no image of an environment", input.display()));
        }
        let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let by_name =
            ENDINGS.iter().find(|(known, _)| ending.as_deref() == Some(known)).map(|(_, format)| *format);
        let format = match (arguments.format.as_deref(), by_name) {
            (Some(format), Some(by_name)) if format != by_name && !is_folder => {
                return Err(format!("{} is not the name of a file in the format {format}", output.display()));
            }
            (Some(format), _) => format.to_owned(),
            (None, Some(format)) if !is_folder => format.to_owned(),
            (None, _) if is_folder || arguments.layout.as_deref() == Some("cube") => "exr".into(),
            (None, _) => {
                return Err(format!(
                    "the ending of {} says no format; expected .exr, .hdr, .png, .ktx2 or .dds, or --format",
                    output.display()
                ));
            }
        };
        let text = |key: &str, value: &Option<String>| {
            value.as_ref().map(|value| format!("{key} = {}", toml::Value::from(value.as_str())))
        };
        let number = |key: &str, value: f64| (value != 0.0).then(|| format!("{key} = {value:?}"));
        let import = [text("layout", &arguments.from), text("bad-pixels", &arguments.bad_pixels)];
        let rotate =
            [number("yaw", arguments.yaw), number("pitch", arguments.pitch), number("roll", arguments.roll)];
        let export = [
            text("layout", &arguments.layout),
            arguments.resolution.map(|resolution| format!("resolution = {resolution}")),
            text("format", &Some(format)),
            text("precision", &arguments.precision),
            number("exposure", arguments.exposure),
        ];
        let lines = |lines: &[Option<String>]| lines.iter().flatten().cloned().collect();
        let conversion =
            Conversion { import: lines(&import), rotate: lines(&rotate), export: lines(&export) };
        Ok(Self { files, is_folder, conversion })
    }
}

fn convert(request: &Request, arguments: &ConvertArguments, kinds: &Kinds) -> Result<Exit, Exit> {
    let failed = |what: String, error: std::io::Error| {
        print::error(&[what, error.to_string()], None);
        Exit::System
    };
    let folder = tempfile::Builder::new().prefix("specula-convert-").tempdir();
    let folder = folder.map_err(|error| failed("cannot create a temporary folder".into(), error))?;
    let files: Result<Vec<_>, _> = request.files.iter().map(std::path::absolute).collect();
    let files = files.map_err(|error| failed("cannot find the current folder".into(), error))?;
    let path = if request.is_folder { "{environment}" } else { "converted" };
    let manifest = folder.path().join(MANIFEST);
    let text = request.conversion.manifest(&assets::source_of(&files, folder.path()), path);
    fs::write(&manifest, &text)
        .map_err(|error| failed(format!("cannot write {}", manifest.display()), error))?;
    let plan = Plan::load(&manifest, kinds).map_err(|diagnostics| {
        // The options are the parameters: whoever typed them knows no manifest.
        for diagnostic in diagnostics.shown() {
            let parts = [Some(&diagnostic.message), diagnostic.expected.as_ref()];
            let chain: Vec<String> = parts.into_iter().flatten().cloned().collect();
            print::error(&chain, diagnostic.help.as_deref());
        }
        Exit::Usage
    })?;
    let cancel = Cancel::default();
    stop_on_interrupt(&cancel, || {});
    let options = BuildOptions { keep_going: true, ..BuildOptions::default() };
    let reporter = BuildReporter::quiet();
    let summary = engine::build(&plan, &options, &cancel, &|event: Event| reporter.show(&event));
    reporter.show_failures();
    let summary = summary.map_err(print::failure)?;
    let mut written = 0;
    for item in plan.items.iter() {
        let made: Vec<_> = item.files.iter().filter(|file| plan.out.join(file).exists()).collect();
        if made.is_empty() || made.len() < item.files.len() {
            continue;
        }
        for file in made {
            let place = place(file, &arguments.output, request.is_folder);
            put(&plan.out.join(file), &place)
                .map_err(|error| failed(format!("cannot write {}", place.display()), error))?;
            written += 1;
        }
    }
    if written > 0 {
        say!("Wrote {} to {}.", count(written, "file"), arguments.output.display());
    }
    Ok(exit_of(&summary))
}

/// Where a file that was made belongs.
fn place(file: &str, output: &Path, is_folder: bool) -> PathBuf {
    if is_folder {
        return output.join(file);
    }
    match file.split_once('/') {
        // The faces of a cube.
        Some((_, face)) => output.join(face),
        None => output.to_path_buf(),
    }
}

/// Moves a file to a place, where it appears as a whole.
fn put(from: &Path, to: &Path) -> std::io::Result<()> {
    if let Some(parent) = to.parent() {
        fs::create_dir_all(parent)?;
    }
    engine::replace_file(to, &engine::read_file(from)?)
}
