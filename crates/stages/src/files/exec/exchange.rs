//! Writes artifacts to files for other programs, and reads them back.

use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::Path;

use containers::{OpenExrEnvmap, Precision, ReadOptions, lighting_json, read_image, write_exr, write_rgbe};
use engine::{
    Artifact, Context, Diagnostic, Failure, Output, Parameter, Product, Reporter, Table, Value, ValueKind,
    choice, nearest, unexpected, unknown_keys,
};
use envmap::{BadPixels, Image, Layout};
use serde_json::{Map, json};

use super::command::is_word;
use crate::light::repaired;
use crate::values::artifacts::{Brdf, Environment, Lighting, Material, Mesh, Reflection, Shrm};

choice! {
    /// The container of an artifact.
    pub(crate) enum ExchangeFormat {
        /// OpenEXR.
        Exr = "exr",
        /// Radiance RGBE.
        Hdr = "hdr",
        /// JSON.
        Json = "json",
        /// Safetensors.
        Safetensors = "safetensors",
        /// The bytes of an artifact whose type only another kind knows.
        Bin = "bin",
    }
}

impl ExchangeFormat {
    fn name(self) -> String {
        self.canonical().as_str().unwrap_or_default().to_owned()
    }
}

/// The largest file that is read back: 4 GiB. The largest environment has 1.5 GiB of floats.
const MOST_BYTES: u64 = 4 << 30;

/// The formats of a type of artifact, the default first.
fn formats_of(type_name: &str) -> &'static [ExchangeFormat] {
    match type_name {
        Environment::TYPE => &[ExchangeFormat::Exr, ExchangeFormat::Hdr, ExchangeFormat::Safetensors],
        Lighting::TYPE => &[ExchangeFormat::Safetensors, ExchangeFormat::Json],
        _ if ARTIFACTS.iter().any(|(name, _)| *name == type_name) => &[ExchangeFormat::Safetensors],
        _ => &[ExchangeFormat::Bin],
    }
}

fn listed(formats: &[ExchangeFormat]) -> String {
    let names: Vec<String> = formats.iter().map(|format| format!("{:?}", format.name())).collect();
    names.join(" or ")
}

/// The formats of inputs, by port.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Formats(Vec<(String, ExchangeFormat)>);

impl Formats {
    fn of(&self, port: &str, type_name: &str) -> ExchangeFormat {
        let chosen = self.0.iter().find(|(name, _)| name == port).map(|(_, format)| *format);
        chosen.unwrap_or(formats_of(type_name)[0])
    }

    /// The formats that do not fit the artifacts that arrive.
    pub(super) fn mismatches(&self, types: &[(&str, &'static str)]) -> Vec<String> {
        let types: HashMap<&str, &str> = types.iter().copied().collect();
        let mismatch = |(port, format): &(String, ExchangeFormat)| {
            let Some(arrives) = types.get(port.as_str()) else {
                return Some(format!("the stage has no input {port:?}"));
            };
            let expected = formats_of(arrives);
            (!expected.contains(format)).then(|| {
                format!(
                    "{port} is {arrives}: expected {}, not {format:?}",
                    listed(expected),
                    format = format.name()
                )
            })
        };
        self.0.iter().filter_map(mismatch).collect()
    }
}

impl Parameter for Formats {
    fn expected() -> String {
        format!("a table of ports, each {}", ExchangeFormat::expected())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let ValueKind::Table(table) = &value.kind else { return Err(unexpected(value, &Self::expected())) };
        let entries = table.entries.iter();
        entries
            .map(|entry| Ok((entry.key.clone(), ExchangeFormat::parse(&entry.value)?)))
            .collect::<Result<_, _>>()
            .map(Self)
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(|(port, format)| (port.clone(), format.canonical())).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "object", "additionalProperties": ExchangeFormat::schema() })
    }
}

/// Writes the artifact that arrives at a port into the working folder, and returns the file's name from
/// there.
pub(super) fn write_input(
    port: &str,
    formats: &Formats,
    context: &Context<'_>,
    work: &Path,
) -> Result<String, Failure> {
    let arrives = context.inputs.type_at(port).unwrap_or_default();
    let format = formats.of(port, arrives);
    let image = |environment: &Environment| {
        let grid = environment.0.grid();
        let image = Image::new(grid.width, grid.height, environment.0.pixels().to_vec());
        image.ok_or_else(|| Failure::new("an environment has no pixels"))
    };
    let bytes = match (arrives, format) {
        (Environment::TYPE, ExchangeFormat::Exr) => {
            write_exr(&image(&*context.inputs.get::<Environment>(port)?)?, Precision::Float, None)?.bytes
        }
        (Environment::TYPE, ExchangeFormat::Hdr) => {
            let encoded = write_rgbe(&image(&*context.inputs.get::<Environment>(port)?)?, None)?;
            if encoded.negative > 0 {
                context.reporter.warn(format!(
                    "{port}: {} negative values became 0, because RGBE cannot hold them",
                    encoded.negative
                ));
            }
            encoded.bytes
        }
        (Lighting::TYPE, ExchangeFormat::Json) => {
            let lighting = context.inputs.get::<Lighting>(port)?;
            lighting_json::encode(&lighting.0.whole().into(), lighting_json::Preset::Specula, None)?
        }
        (Environment::TYPE, ExchangeFormat::Safetensors) => {
            containers::tensors::encode_environment(&context.inputs.get::<Environment>(port)?.0, None)?
        }
        _ => context.inputs.bytes(port)?,
    };
    let name = format!("input/{port}.{}", format.name());
    let written = fs::create_dir_all(work.join("input")).and_then(|()| fs::write(work.join(&name), bytes));
    written.map_err(|error| {
        Failure::from(error).context(format!("cannot write {name} to the scratch folder")).system_error()
    })?;
    Ok(name)
}

/// Decodes the bytes of an artifact.
type Decode = fn(&[u8]) -> Result<Output, Failure>;

/// The artifacts that a program can make: their types, and how the default format's bytes become one.
const ARTIFACTS: [(&str, Decode); 7] = [
    (Environment::TYPE, decoded::<Environment>),
    (Lighting::TYPE, decoded::<Lighting>),
    (Material::TYPE, decoded::<Material>),
    (Brdf::TYPE, decoded::<Brdf>),
    (Reflection::TYPE, decoded::<Reflection>),
    (Shrm::TYPE, decoded::<Shrm>),
    (Mesh::TYPE, decoded::<Mesh>),
];

fn decoded<T: Artifact>(bytes: &[u8]) -> Result<Output, Failure> {
    Output::artifact(T::decode(bytes)?)
}

/// The output that a program makes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ProgramOutput {
    /// An artifact of this type.
    Artifact(&'static str, ExchangeFormat),
    /// A file with this ending, without the dot.
    File(String),
    /// A folder of files of these names; the last is the index.
    Files(Vec<String>),
}

impl ProgramOutput {
    pub(super) fn is_environment(&self) -> bool {
        matches!(self, Self::Artifact(Environment::TYPE, _))
    }

    pub(super) fn product(&self) -> Product {
        match self {
            Self::Artifact(name, _) => Product::Artifact(name),
            Self::File(ending) => Product::Files(vec![format!(".{ending}.json"), format!(".{ending}")]),
            Self::Files(names) => {
                let files = names.iter().map(|name| format!("/{name}"));
                Product::Files(["/recipe.json".to_owned()].into_iter().chain(files).collect())
            }
        }
    }

    /// The value of `{output}`, relative to the working folder.
    fn place(&self) -> String {
        match self {
            Self::Artifact(_, format) => format!("output.{}", format.name()),
            Self::File(ending) => format!("output.{ending}"),
            Self::Files(_) => "output".into(),
        }
    }

    /// Prepares the place of the output, and returns the value of `{output}`.
    pub(super) fn prepare(&self, work: &Path) -> Result<String, Failure> {
        if matches!(self, Self::Files(_)) {
            fs::create_dir(work.join(self.place())).map_err(|error| {
                Failure::from(error).context("cannot create the folder for the output").system_error()
            })?;
        }
        Ok(self.place())
    }

    /// Reads what the program wrote.
    ///
    /// # Errors
    /// If it is missing or invalid.
    pub(super) fn read(&self, work: &Path, program: &str, context: &Context<'_>) -> Result<Output, Failure> {
        let place = self.place();
        match self {
            Self::Artifact(name, format) => {
                let bytes = read_file(work, &place, program)?;
                decode(name, *format, &bytes, &context.reporter)
                    .map_err(|failure| failure.context(format!("{program} did not write a valid {name}")))
            }
            Self::File(_) => {
                let recipe = containers::texture_sidecar(Some(context.recipe()), &[])?;
                Ok(Output::files(vec![recipe, read_file(work, &place, program)?]))
            }
            Self::Files(names) => {
                let mut files = vec![containers::texture_sidecar(Some(context.recipe()), &[])?];
                for name in names {
                    files.push(read_file(work, &format!("{place}/{name}"), program)?);
                }
                Ok(Output::files(files))
            }
        }
    }
}

impl Parameter for ProgramOutput {
    fn expected() -> String {
        "{ type = \"environment\", format = \"exr\" }, { type = \"file\", format = \"png\" } or \
         { type = \"files\", names = [\"...\"] }"
            .into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let ValueKind::Table(table) = &value.kind else { return Err(unexpected(value, &Self::expected())) };
        let types = ARTIFACTS.iter().map(|(name, _)| *name).chain(["file", "files"]).collect::<Vec<_>>();
        let expected = types.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(" or ");
        let Some(what) = table.get("type") else {
            return Err(Diagnostic::at(value.span.clone(), "\"type\" is missing")
                .expected(format!("expected type = {expected}")));
        };
        match String::parse(&what.value)?.as_str() {
            "file" => {
                only(table, &["type", "format"])?;
                let format = wanted(table, "format", "the file's extension, such as \"png\"")?;
                let ending = String::parse(format)?;
                match ending.split('.').all(is_word) {
                    true => Ok(Self::File(ending)),
                    false => Err(unexpected(format, "an extension without its dot, such as \"png\"")),
                }
            }
            "files" => {
                only(table, &["type", "names"])?;
                let value = wanted(table, "names", "the names of the files")?;
                let names = Vec::<String>::parse(value)?;
                let expected = "expected file names of A-Z, a-z, 0-9, _, - and single dots, each once";
                let error =
                    |message: String| Err(Diagnostic::at(value.span.clone(), message).expected(expected));
                let mut lower = vec!["recipe.json".to_owned()];
                for name in &names {
                    if !name.split('.').all(is_word) {
                        return error(format!("{name:?} is not a valid file name"));
                    }
                    if lower.contains(&name.to_ascii_lowercase()) {
                        return error(format!("{name:?} is listed twice, or is the recipe's name"));
                    }
                    lower.push(name.to_ascii_lowercase());
                }
                if names.is_empty() { error("the list is empty".into()) } else { Ok(Self::Files(names)) }
            }
            given => match ARTIFACTS.iter().find(|(name, _)| *name == given) {
                Some((name, _)) => artifact(name, table),
                None => {
                    let error = unexpected(&what.value, &expected);
                    Err(match nearest(given, types) {
                        Some(near) => error.help(format!("did you mean {near:?}?")),
                        None => error,
                    })
                }
            },
        }
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::Artifact(name, format) => json!({ "type": name, "format": format.canonical() }),
            Self::File(ending) => json!({ "type": "file", "format": ending }),
            Self::Files(names) => json!({ "type": "files", "names": names }),
        }
    }

    fn schema() -> serde_json::Value {
        let object = |types: &[&str], more: serde_json::Value, required: &[&str]| {
            let mut properties = Map::new();
            properties.insert("type".into(), json!({ "enum": types }));
            properties.extend(more.as_object().cloned().unwrap_or_default());
            json!({
                "type": "object", "properties": properties, "required": required, "additionalProperties": false,
            })
        };
        let artifact = |name: &str| {
            let formats: Vec<String> = formats_of(name).iter().map(|format| format.name()).collect();
            object(&[name], json!({ "format": { "enum": formats } }), &["type"])
        };
        let mut choices: Vec<_> = ARTIFACTS.iter().map(|(name, _)| artifact(name)).collect();
        choices.push(object(&["file"], json!({ "format": { "type": "string" } }), &["type", "format"]));
        let names =
            json!({ "type": "array", "items": { "type": "string" }, "minItems": 1, "uniqueItems": true });
        choices.push(object(&["files"], json!({ "names": names }), &["type", "names"]));
        json!({ "type": "object", "oneOf": choices })
    }
}

fn artifact(name: &'static str, table: &Table) -> Result<ProgramOutput, Diagnostic> {
    only(table, &["type", "format"])?;
    let Some(entry) = table.get("format") else {
        return Ok(ProgramOutput::Artifact(name, formats_of(name)[0]));
    };
    let expected = listed(formats_of(name));
    match ExchangeFormat::parse(&entry.value) {
        Ok(format) if formats_of(name).contains(&format) => Ok(ProgramOutput::Artifact(name, format)),
        _ => Err(unexpected(&entry.value, &expected).help(format!("the type is {name}"))),
    }
}

fn only(table: &Table, known: &[&str]) -> Result<(), Diagnostic> {
    let mut errors = Vec::new();
    unknown_keys(table, &known.iter().map(|&key| key.to_owned()).collect::<Vec<_>>(), &mut errors);
    errors.into_iter().next().map_or(Ok(()), Err)
}

fn wanted<'a>(table: &'a Table, key: &str, what: &str) -> Result<&'a Value, Diagnostic> {
    let missing = || {
        Diagnostic::at(table.span.clone(), format!("\"{key}\" is missing"))
            .expected(format!("expected {key}: {what}"))
    };
    table.get(key).map(|entry| &entry.value).ok_or_else(missing)
}

/// A file that the program wrote.
fn read_file(work: &Path, place: &str, program: &str) -> Result<Vec<u8>, Failure> {
    let path = work.join(place);
    let bytes = fs::symlink_metadata(&path).and_then(|file| match file.len() {
        _ if !file.is_file() => Err(io::Error::other("it is not a regular file")),
        0 => Err(io::Error::other("it is empty")),
        MOST_BYTES.. => Err(io::Error::other("it is larger than 4 GiB")),
        _ => fs::read(&path),
    });
    bytes.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => Failure::new(format!("{program} succeeded, but did not write {place}"))
            .help("{output} is a path relative to the program's working folder"),
        _ => Failure::from(error).context(format!("{program} wrote {place}, which cannot be used")),
    })
}

fn decode(name: &str, format: ExchangeFormat, bytes: &[u8], reporter: &Reporter) -> Result<Output, Failure> {
    match (name, format) {
        (Environment::TYPE, ExchangeFormat::Exr) => image(containers::Format::OpenExr, bytes, reporter),
        (Environment::TYPE, ExchangeFormat::Hdr) => image(containers::Format::Radiance, bytes, reporter),
        (Lighting::TYPE, ExchangeFormat::Json) => {
            Output::artifact(Lighting(lighting_json::decode(bytes)?.into()))
        }
        _ => match ARTIFACTS.iter().find(|(known, _)| *known == name) {
            Some((_, decode)) => decode(bytes),
            None => Err(Failure::new(format!("{name} is not an artifact that a program can make"))),
        },
    }
}

fn image(format: containers::Format, bytes: &[u8], reporter: &Reporter) -> Result<Output, Failure> {
    if let Some(found) = containers::Format::sniff(bytes).filter(|found| *found != format) {
        let message = format!("the file is {}, not {}", found.name(), format.name());
        return Err(Failure::new(message).help("output: format must be the format that the program writes"));
    }
    let decoded = read_image(bytes, &ReadOptions::default())?;
    decoded.warnings.iter().for_each(|warning| reporter.warn(format!("the output: {warning}")));
    let layout = match decoded.openexr_envmap {
        None => Layout::LatLong,
        Some(OpenExrEnvmap::LatLong) => Layout::OpenExrLatLong,
        Some(OpenExrEnvmap::Cube) => Layout::OpenExrCube,
    };
    let image = repaired(decoded.image, layout, BadPixels::default(), reporter)
        .map_err(|error| Failure::from(error).help("the program must write finite values"))?;
    Output::artifact(Environment(envmap::Environment::from_image(image, layout, None)?))
}
