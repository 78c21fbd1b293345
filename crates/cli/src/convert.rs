//! `specula convert`: environments in another layout, size or format, as the light that an engine loads, or
//! as the light of compact maps, without a manifest.
//!
//! It writes a manifest into a temporary folder, builds it, and moves what it made to its place: the same
//! kinds do the work as in a pipeline, and `--manifest` prints the manifest to keep.

use std::fs;
use std::path::{Path, PathBuf};

use engine::{Kinds, path_text};
use stages::{ENGINES, Engine};

use crate::arguments::{ConvertArguments, ConvertTarget};
use crate::assets::{self, Assets};
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::one_build::{self, StageOption};
use crate::standard_pipeline::{Conversion, Target};
use crate::{globs, print, recognise};

/// The endings of what is written, with the formats of `export-environment`.
const ENDINGS: [(&str, &str); 6] =
    [("exr", "exr"), ("hdr", "rgbe"), ("pic", "rgbe"), ("png", "png"), ("ktx2", "ktx2"), ("dds", "dds")];

/// The options that are parameters of the stages of [`Conversion::manifest`].
const OPTIONS: [StageOption; 23] = [
    StageOption { stage: "environment", parameter: "layout", option: "--from" },
    StageOption { stage: "environment", parameter: "fill", option: "--fill" },
    StageOption { stage: "environment", parameter: "layer", option: "--layer" },
    StageOption { stage: "environment", parameter: "bad-pixels", option: "--bad-pixels" },
    StageOption { stage: "environment", parameter: "colour-space", option: "--colour-space" },
    StageOption { stage: "environment", parameter: "preset", option: "--preset" },
    StageOption { stage: "environment", parameter: "exposure", option: "--exposure" },
    StageOption { stage: "environment", parameter: "white-balance", option: "--white-balance" },
    StageOption { stage: "environment", parameter: "grey-card", option: "--grey-card" },
    StageOption { stage: "light", parameter: "resolution", option: "--resolution" },
    StageOption { stage: "light", parameter: "lights", option: "--lights" },
    StageOption { stage: "converted", parameter: "preset", option: "--engine" },
    StageOption { stage: "converted", parameter: "skybox-resolution", option: "--sky" },
    StageOption { stage: "converted", parameter: "sun", option: "--sun" },
    StageOption { stage: "converted", parameter: "lights", option: "--lights" },
    StageOption { stage: "converted", parameter: "layout", option: "--layout" },
    StageOption { stage: "converted", parameter: "resolution", option: "--resolution" },
    StageOption { stage: "converted", parameter: "format", option: "--format" },
    StageOption { stage: "converted", parameter: "precision", option: "--precision" },
    StageOption { stage: "converted", parameter: "texels", option: "--texels" },
    StageOption { stage: "converted", parameter: "levels", option: "--levels" },
    StageOption { stage: "converted", parameter: "zstd", option: "--zstd" },
    StageOption { stage: "converted", parameter: "exposure", option: "--exposure" },
];

struct Request {
    /// The source of the import, absolute or relative to the current folder.
    files: Vec<PathBuf>,
    place: Place,
    conversion: Conversion,
}

/// Where what was made belongs.
enum Place {
    /// A folder with a file or a folder for each input.
    Each,
    /// The output: a file, or a folder with all that is made of the one input.
    One,
    /// The output is the file of an engine's light, which ends like this. The rest lies beside it, without
    /// its texts.
    Light(String),
}

pub(crate) fn run(arguments: &ConvertArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let request = Request::of(arguments)?;
    if arguments.manifest {
        let source = assets::source_of(&request.files, Path::new(""));
        let path = match request.place {
            Place::Each => "{environment}".into(),
            Place::One | Place::Light(_) => arguments.output.with_extension(""),
        };
        let path = path.to_string_lossy().replace('\\', "/");
        return Ok(print::data(&request.conversion.manifest(&source, path.trim_end_matches('/'))));
    }
    convert(&request, arguments, kinds)
}

impl Request {
    fn of(arguments: &ConvertArguments) -> Result<Self, CommandError> {
        let usage = |error: String| CommandError::usage([error]);
        let Inputs { files, is_cube, is_many } = Inputs::of(arguments)?;
        let shown = match arguments.from {
            Some(_) => None,
            None => recognise::one_layout(&files).and_then(|environments| environments.layout),
        };
        if let Some(layout) = shown {
            let input = path_text(&arguments.inputs[0]);
            print::message(&format!(
                "{input} is assumed to be {layout} because of its shape; --from sets another layout"
            ));
        }
        let from = arguments.from.clone().or(shown.map(Into::into));
        let export = match (engine_of(arguments), arguments.to) {
            (Some(engine), _) => Export::for_engine(engine, arguments, is_many),
            (None, ConvertTarget::Taps) => Export::for_taps(arguments, is_many),
            (None, ConvertTarget::Environment) => Export::image(arguments, is_many, is_cube),
        };
        let Export { place, target, lines: export } = export.map_err(usage)?;
        if arguments.lights.is_some() && target == Target::Environment {
            return Err(usage("--lights is an option of --to taps and --sun light".into()));
        }
        for (option, value) in [("--sun", &arguments.sun), ("--sky", &arguments.sky)] {
            if value.is_some() && target != Target::Engine {
                return Err(usage(format!("{option} is an option of --engine")));
            }
        }
        for (option, is_given) in [
            ("--texels", arguments.texels.is_some()),
            ("--levels", arguments.levels),
            ("--zstd", arguments.zstd),
        ] {
            if is_given && target != Target::Environment {
                return Err(usage(format!("{option} is an option of textures of an environment")));
            }
        }
        // An image is exposed where it is written, and other light where it is read.
        let exposure = number("exposure", arguments.exposure).filter(|_| target != Target::Environment);
        let import = [
            text("layout", from.as_deref()),
            arguments.fill.as_deref().map(|fill| numbers("fill", fill)),
            text("layer", arguments.layer.as_deref()),
            text("bad-pixels", arguments.bad_pixels.as_deref()),
            text("colour-space", arguments.colour_space.as_deref()),
            text("preset", arguments.preset.as_deref()),
            exposure,
            arguments.white_balance.as_deref().map(|balance| numbers("white-balance", balance)),
            arguments.grey_card.as_deref().map(|card| numbers("grey-card", card)),
        ];
        let rotate =
            [number("yaw", arguments.yaw), number("pitch", arguments.pitch), number("roll", arguments.roll)];
        let conversion = Conversion { import: lines(import), rotate: lines(rotate), target, export };
        Ok(Self { files, place, conversion })
    }
}

/// The environments that are converted.
struct Inputs {
    files: Vec<PathBuf>,
    /// Whether they are the six faces of one cube, in a folder that says so.
    is_cube: bool,
    /// Whether each of them has a place of its own in a folder.
    is_many: bool,
}

impl Inputs {
    /// A folder is six faces if its layout or its names say so, and otherwise holds files.
    fn of(arguments: &ConvertArguments) -> Result<Self, CommandError> {
        let usage = |error: String| CommandError::usage([error]);
        let says_cube = arguments.from.as_deref() == Some("cube");
        let mut files = Vec::new();
        for input in &arguments.inputs {
            if globs::is_glob(input) && !input.exists() {
                let found = globs::matching(input)?.into_iter().filter(|file| Assets::is_environment(file));
                let before = files.len();
                files.extend(found);
                if files.len() == before {
                    return Err(usage(format!("{} matches no image of an environment", path_text(input))));
                }
                continue;
            }
            let kind = fs::metadata(input)
                .map_err(|error| usage(format!("cannot read {}: {error}", path_text(input))))?;
            if kind.is_dir() && !says_cube {
                let found = Assets::in_folder(input).map_err(usage)?;
                if found.is_empty() {
                    return Err(usage(format!("{} contains no image of an environment", path_text(input))));
                }
                files.extend(found);
            } else {
                files.push(input.clone());
            }
        }
        files.sort();
        files.dedup();
        let [input] = &arguments.inputs[..] else { return Ok(Self { files, is_cube: false, is_many: true }) };
        let is_cube = input.is_dir() && files == [input.clone()];
        let is_many = !is_cube && files != [input.clone()];
        Ok(Self { files, is_cube, is_many })
    }
}

/// What is written, and where.
struct Export {
    place: Place,
    target: Target,
    /// Lines of the stage that writes it.
    lines: Vec<String>,
}

impl Export {
    fn image(arguments: &ConvertArguments, is_many: bool, is_cube: bool) -> Result<Self, String> {
        let output = &arguments.output;
        let by_name = extension(output)
            .and_then(|extension| ENDINGS.iter().find(|(known, _)| *known == extension))
            .map(|(_, format)| *format);
        let is_faces = arguments.layout.as_deref() == Some("cube");
        // Six faces whose files are not named as such may be written into a folder, too.
        let is_many =
            is_many || is_cube && arguments.from.as_deref() != Some("cube") && by_name.is_none() && !is_faces;
        let format = match (arguments.format.as_deref(), by_name) {
            (Some(format), Some(by_name)) if format != by_name && !is_many => {
                return Err(format!("{} is not a file name for the format {format}", path_text(output)));
            }
            (Some(format), _) => format,
            (None, Some(format)) if !is_many => format,
            (None, _) if is_many || is_faces => "exr",
            (None, _) => return Err(no_format(arguments)),
        };
        let lines = [
            text("layout", arguments.layout.as_deref()),
            resolution(arguments),
            text("format", Some(format)),
            text("precision", arguments.precision.as_deref()),
            text("texels", arguments.texels.as_deref()),
            arguments.levels.then(|| "levels = true".into()),
            arguments.zstd.then(|| "zstd = true".into()),
            number("exposure", arguments.exposure),
        ];
        let place = if is_many { Place::Each } else { Place::One };
        Ok(Self { place, target: Target::Environment, lines: self::lines(lines) })
    }

    fn for_taps(arguments: &ConvertArguments, is_many: bool) -> Result<Self, String> {
        let format = light_format(arguments, is_many)?;
        let lines = [text("layout", arguments.layout.as_deref()), text("format", Some(&format))];
        let place = if is_many { Place::Each } else { Place::One };
        let target = Target::Taps(self::lines([resolution(arguments), lights(arguments)]));
        Ok(Self { place, target, lines: self::lines(lines) })
    }

    fn for_engine(engine: &Engine, arguments: &ConvertArguments, is_many: bool) -> Result<Self, String> {
        let output = &arguments.output;
        for (option, value) in [("--layout", &arguments.layout), ("--precision", &arguments.precision)] {
            if value.is_some() {
                return Err(format!("{option} is an option of images; {} has its own", engine.name));
            }
        }
        let extension = extension(output).filter(|_| !names_folder(output));
        let (place, by_name) = match extension {
            None => (if is_many { Place::Each } else { Place::One }, None),
            Some(extension) => {
                let known = engine.extensions();
                let Some((format, ending)) = engine.format_of_extension(&extension) else {
                    let known: Vec<_> = known.iter().map(|extension| format!(".{extension}")).collect();
                    return Err(format!(
                        "{} loads {}, not {}; name such a file, or a folder for all files that it loads",
                        engine.name,
                        known.join(" or "),
                        path_text(output)
                    ));
                };
                if is_many {
                    let file = path_text(output);
                    return Err(format!("{file} is one file; name a folder for several environments"));
                }
                // The preferred format needs no word.
                let is_first = known.first() == Some(&extension);
                (Place::Light(ending), Some(format).filter(|_| !is_first))
            }
        };
        let format = arguments.format.as_deref().or(by_name);
        let sky = match (arguments.sky.as_deref(), &place) {
            (None, Place::Light(_)) if engine.loads_cube() => Some("skybox = false".into()),
            (Some(_), Place::Light(_)) => {
                return Err(format!(
                    "{} is only the light; name a folder to get a sky too",
                    path_text(output)
                ));
            }
            (Some("none"), _) => Some("skybox = false".into()),
            (texels, _) => texels.map(|texels| format!("skybox-resolution = {texels}")),
        };
        let lines = [
            text("preset", Some(engine.name)),
            resolution(arguments),
            text("format", format),
            sky,
            text("sun", arguments.sun.as_deref()),
            lights(arguments),
        ];
        Ok(Self { place, target: Target::Engine, lines: self::lines(lines) })
    }
}

/// The engine for which light is written: the one that is named, or the only one whose files end like the
/// output.
fn engine_of(arguments: &ConvertArguments) -> Option<&'static Engine> {
    const OF_EXTENSION: [(&str, &str); 3] = [("env", "babylon"), ("ktx", "filament"), ("gltf", "gltf")];
    let by_extension = || {
        let is_image = arguments.to == ConvertTarget::Environment && !names_folder(&arguments.output);
        let extension = extension(&arguments.output).filter(|_| is_image)?;
        OF_EXTENSION.iter().find(|(known, _)| *known == extension).map(|(_, engine)| *engine)
    };
    let name = arguments.engine.as_deref().or_else(by_extension)?;
    ENGINES.iter().find(|engine| engine.name == name).copied()
}

/// The error of an output whose extension is no image's: the command that writes such files, if there is one.
fn no_format(arguments: &ConvertArguments) -> String {
    let output = path_text(&arguments.output);
    let inputs = arguments.inputs.iter().map(path_text).collect::<Vec<_>>().join(" ");
    let other = match extension(&arguments.output).as_deref() {
        None => format!(
            "`specula convert {inputs} --engine three -o {output}` writes the files that an engine loads"
        ),
        Some("safetensors") => {
            format!("`specula convert {inputs} --to taps -o {output}` writes the light of compact maps")
        }
        Some("json" | "txt") => format!(
            "`specula convert {inputs} --engine unity -o FOLDER` writes an image and its irradiance as JSON, and \
             `specula convert-sh` converts spherical harmonics"
        ),
        Some("glb") => format!("`specula convert {inputs} --engine gltf -o FOLDER` writes it as .gltf"),
        Some("usda" | "usdc" | "usd" | "tscn") => {
            "a stage of kind export-light-rig writes suns and lamps (`specula stages export-light-rig`)"
                .into()
        }
        Some("toml") => "`specula init` writes a manifest".into(),
        Some(_) => "or --format".into(),
    };
    format!(
        "{output} does not have the extension of an image; expected .exr, .hdr, .png, .ktx2 or .dds; {other}"
    )
}

/// The extension of a path, in small letters.
fn extension(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase())
}

/// Whether a path says that it is a folder, or is one.
fn names_folder(path: &Path) -> bool {
    path.is_dir() || path.to_string_lossy().ends_with(['/', std::path::MAIN_SEPARATOR])
}

fn text(key: &str, value: Option<&str>) -> Option<String> {
    value.map(|value| format!("{key} = {}", toml::Value::from(value)))
}

/// A line of a number that is not 0.
fn number(key: &str, value: f64) -> Option<String> {
    (value != 0.0).then(|| format!("{key} = {value:?}"))
}

fn resolution(arguments: &ConvertArguments) -> Option<String> {
    arguments.resolution.map(|resolution| format!("resolution = {resolution}"))
}

fn lights(arguments: &ConvertArguments) -> Option<String> {
    arguments.lights.as_deref().map(|lights| match lights {
        "all" => "lights = \"all\"".into(),
        count => format!("lights = {count}"),
    })
}

fn lines<const N: usize>(lines: [Option<String>; N]) -> Vec<String> {
    lines.into_iter().flatten().collect()
}

/// The format of the light of compact maps: textures in a folder, or one file of tensors.
fn light_format(arguments: &ConvertArguments, is_many: bool) -> Result<String, String> {
    const TENSORS: &str = "safetensors";
    let output = &arguments.output;
    if arguments.precision.is_some() {
        return Err("--precision is an option of --to environment".into());
    }
    let is_file = !is_many && output.extension().is_some_and(|ending| ending == TENSORS);
    let format = match arguments.format.as_deref() {
        Some(format) => format,
        None if is_file => TENSORS,
        None => "ktx2",
    };
    if !is_many && is_file != (format == TENSORS) {
        return Err(format!("{} does not have a name that fits the format {format}", path_text(output)));
    }
    Ok(format.to_owned())
}

/// A parameter that is a name, a number, or several numbers with commas between them.
fn numbers(key: &str, text: &str) -> String {
    let inside = text.trim().trim_start_matches('[').trim_end_matches(']');
    let numbers: Vec<&str> = inside.split(',').map(str::trim).collect();
    match &numbers[..] {
        all if all.iter().any(|number| number.parse::<f64>().is_err()) => {
            format!("{key} = {}", toml::Value::from(text))
        }
        [number] => format!("{key} = {number}"),
        _ => format!("{key} = [{}]", numbers.join(", ")),
    }
}

fn convert(request: &Request, arguments: &ConvertArguments, kinds: &Kinds) -> Result<Exit, CommandError> {
    let files: Result<Vec<_>, _> = request.files.iter().map(std::path::absolute).collect();
    let files = files.map_err(|error| CommandError::system("cannot find the current folder", &error))?;
    let path = if matches!(request.place, Place::Each) { "{environment}" } else { "converted" };
    let text = |folder: &Path| request.conversion.manifest(&assets::source_of(&files, folder), path);
    let place = |file: &str| request.place.of(file, &arguments.output);
    one_build::build(text, kinds, &arguments.output, place, &OPTIONS)
}

impl Place {
    /// The place to which a file that was made belongs.
    fn of(&self, file: &str, output: &Path) -> Option<PathBuf> {
        let inner = file.split_once('/').map(|(_, inner)| inner);
        match (self, inner) {
            (Self::Each, _) => Some(output.join(file)),
            (Self::One, Some(inner)) => Some(output.join(inner)),
            (Self::One, None) => Some(output.to_path_buf()),
            (Self::Light(ending), inner) => {
                let rest = inner?.strip_prefix(stages::ENGINE_FILE_STEM)?;
                if rest == ending {
                    return Some(output.to_path_buf());
                }
                let stem = output.file_stem().unwrap_or_default().to_string_lossy();
                Some(output.with_file_name(format!("{stem}{rest}")))
            }
        }
    }
}
