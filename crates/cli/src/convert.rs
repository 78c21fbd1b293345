//! `specula convert`: environments in another layout, size or format, or as the light of compact maps,
//! without a manifest.
//!
//! It writes a manifest into a temporary folder, builds it, and moves what it made to its place: the same
//! kinds do the work as in a pipeline, and `--manifest` prints the manifest to keep.

use std::fs;
use std::path::{Path, PathBuf};

use engine::Kinds;

use crate::arguments::{ConvertArguments, ConvertTarget};
use crate::assets::{self, Assets};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::one_build::{self, StageOption};
use crate::standard_pipeline::Conversion;
use crate::{print, recognise};

/// The endings of what is written, with the formats of `export-environment`.
const ENDINGS: [(&str, &str); 6] =
    [("exr", "exr"), ("hdr", "rgbe"), ("pic", "rgbe"), ("png", "png"), ("ktx2", "ktx2"), ("dds", "dds")];

/// The options that are parameters of the stages of [`Conversion::manifest`].
const OPTIONS: [StageOption; 14] = [
    StageOption { stage: "environment", parameter: "layout", option: "--from" },
    StageOption { stage: "environment", parameter: "fill", option: "--fill" },
    StageOption { stage: "environment", parameter: "layer", option: "--layer" },
    StageOption { stage: "environment", parameter: "bad-pixels", option: "--bad-pixels" },
    StageOption { stage: "environment", parameter: "colour-space", option: "--colour-space" },
    StageOption { stage: "environment", parameter: "preset", option: "--preset" },
    StageOption { stage: "environment", parameter: "exposure", option: "--exposure" },
    StageOption { stage: "light", parameter: "resolution", option: "--resolution" },
    StageOption { stage: "light", parameter: "lights", option: "--lights" },
    StageOption { stage: "converted", parameter: "layout", option: "--layout" },
    StageOption { stage: "converted", parameter: "resolution", option: "--resolution" },
    StageOption { stage: "converted", parameter: "format", option: "--format" },
    StageOption { stage: "converted", parameter: "precision", option: "--precision" },
    StageOption { stage: "converted", parameter: "exposure", option: "--exposure" },
];

struct Request {
    /// The source of the import, absolute or relative to the current folder.
    files: Vec<PathBuf>,
    /// Whether the output is a folder with a file for each input.
    is_folder: bool,
    conversion: Conversion,
}

pub(crate) fn run(arguments: &ConvertArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let request = Request::of(arguments).map_err(|error| CommandError::usage([error]))?;
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
        // A folder is six faces if its layout or its names say so, and otherwise holds files. Six faces may
        // be written into a folder, too.
        let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let by_name =
            ENDINGS.iter().find(|(known, _)| ending.as_deref() == Some(known)).map(|(_, format)| *format);
        let says_cube = arguments.from.as_deref() == Some("cube");
        let files = if kind.is_dir() && !says_cube { Assets::in_folder(input)? } else { vec![input.clone()] };
        if files.is_empty() {
            return Err(format!("{} holds no image of an environment", input.display()));
        }
        let is_cube = kind.is_dir() && (says_cube || files == [input.clone()]);
        let is_light = arguments.to == ConvertTarget::Taps;
        let names_file = by_name.is_some() || is_light || arguments.layout.as_deref() == Some("cube");
        let is_folder = kind.is_dir() && !(is_cube && (says_cube || names_file));
        let format = if is_light {
            light_format(arguments, is_folder)?
        } else {
            match (arguments.format.as_deref(), by_name) {
                (Some(format), Some(by_name)) if format != by_name && !is_folder => {
                    return Err(format!(
                        "{} is not the name of a file in the format {format}",
                        output.display()
                    ));
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
            }
        };
        if arguments.lights.is_some() && !is_light {
            return Err("--lights is an option of --to taps".into());
        }
        let shown = match arguments.from {
            Some(_) => None,
            None => recognise::one_layout(&files).and_then(|environments| environments.layout),
        };
        if let Some(layout) = shown {
            print::message(&format!(
                "{} is taken for {layout} by its shape; --from names another layout",
                input.display()
            ));
        }
        let from = arguments.from.clone().or(shown.map(Into::into));
        let text = |key: &str, value: &Option<String>| {
            value.as_ref().map(|value| format!("{key} = {}", toml::Value::from(value.as_str())))
        };
        let number = |key: &str, value: f64| (value != 0.0).then(|| format!("{key} = {value:?}"));
        let import = [
            text("layout", &from),
            arguments.fill.as_deref().map(fill),
            text("layer", &arguments.layer),
            text("bad-pixels", &arguments.bad_pixels),
            text("colour-space", &arguments.colour_space),
            text("preset", &arguments.preset),
            number("exposure", arguments.exposure).filter(|_| is_light),
        ];
        let rotate =
            [number("yaw", arguments.yaw), number("pitch", arguments.pitch), number("roll", arguments.roll)];
        let resolution = arguments.resolution.map(|resolution| format!("resolution = {resolution}"));
        let layout = text("layout", &arguments.layout);
        let lines = |lines: &[Option<String>]| lines.iter().flatten().cloned().collect();
        let (light, export) = if is_light {
            let lights = arguments.lights.as_deref().map(|lights| match lights {
                "all" => "lights = \"all\"".into(),
                count => format!("lights = {count}"),
            });
            (Some(lines(&[resolution, lights])), lines(&[layout, text("format", &Some(format))]))
        } else {
            let export = [
                layout,
                resolution,
                text("format", &Some(format)),
                text("precision", &arguments.precision),
                number("exposure", arguments.exposure),
            ];
            (None, lines(&export))
        };
        let conversion = Conversion { import: lines(&import), rotate: lines(&rotate), light, export };
        Ok(Self { files, is_folder, conversion })
    }
}

/// The format of the light of compact maps: textures in a folder, or one file of tensors.
fn light_format(arguments: &ConvertArguments, is_folder: bool) -> Result<String, String> {
    const TENSORS: &str = "safetensors";
    let output = &arguments.output;
    if arguments.precision.is_some() {
        return Err("--precision is an option of --to environment".into());
    }
    let is_file = !is_folder && output.extension().is_some_and(|ending| ending == TENSORS);
    let format = match arguments.format.as_deref() {
        Some(format) => format,
        None if is_file => TENSORS,
        None => "ktx2",
    };
    if !is_folder && is_file != (format == TENSORS) {
        return Err(format!("{} is not the name of what the format {format} has", output.display()));
    }
    Ok(format.to_owned())
}

/// The parameter `fill`: a name, or a colour of numbers with commas between them.
fn fill(text: &str) -> String {
    let inside = text.trim().trim_start_matches('[').trim_end_matches(']');
    let numbers: Result<Vec<f64>, _> = inside.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok([grey]) => format!("fill = {grey:?}"),
        Ok(colour) => format!("fill = {colour:?}"),
        Err(_) => format!("fill = {}", toml::Value::from(text)),
    }
}

fn convert(request: &Request, arguments: &ConvertArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let files: Result<Vec<_>, _> = request.files.iter().map(std::path::absolute).collect();
    let files = files.map_err(|error| CommandError::system("cannot find the current folder", &error))?;
    let path = if request.is_folder { "{environment}" } else { "converted" };
    let text = |folder: &Path| request.conversion.manifest(&assets::source_of(&files, folder), path);
    let place = |file: &str| place(file, &arguments.output, request.is_folder);
    one_build::build(text, kinds, &arguments.output, place, &OPTIONS)
}

/// The place to which a file that was made belongs.
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
