//! Material files: TOML that names models by [`brdf::MODELS`], measured files, and materials of glTF and
//! MaterialX files.
//!
//! One mechanism reads every model: the model's list of parameters defines the keys, their types and their
//! ranges. All errors of a file are reported together, each with its place.

use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;

use brdf::{Absent, BaseColorTexture, MODELS, Material, ModelText, Parameter, Value, ValueType, Values};
use containers::measured::{self, CURET_FILES, MeasuredFormat, Reading};
use containers::{
    MaterialChoice, MaterialxMaterial, check_gltf_material, read_gltf_material, read_materialx_material,
};
use engine::{
    Diagnostic, Document, Entry, Failure, OpenFile, Parameter as _, Table, Value as Toml, ValueKind, nearest,
    unknown_keys,
};

use super::found_material::MaterialFile;
use super::material_messages::{failure, failure_of, is_not, looks_like, place, with_nearest};
use super::materialx_file::is_materialx_file;
use super::presets::{self, Preset};
use crate::values::ChosenMaterial;

/// The values of `model` that are not analytic models.
pub(crate) const MEASURED: &str = "measured";
pub(crate) const LAYERS: &str = "layers";
pub(crate) const GLTF: &str = "gltf";
pub(crate) const MATERIALX: &str = "materialx";

/// The depth to which layers may be nested: the JSON reader of material artifacts limits it to about 60.
const DEEPEST: usize = 32;

/// Reads a file. Relative paths start at the material file's folder.
pub type ReadFile<'a> = dyn Fn(&Path) -> Result<Arc<Vec<u8>>, Failure> + 'a;

/// The material of a file: a material file's text, or by its name's ending a measured BRDF or a material of a
/// glTF or MaterialX file, `choice` if there are several.
///
/// `name` is the file's name, for messages. Files that it names are read by `read`.
///
/// # Errors
/// If the file has errors: all of them, each on its own line with its place.
pub fn read_material(
    name: &str,
    bytes: &[u8],
    choice: Option<&MaterialChoice>,
    read: &ReadFile<'_>,
) -> Result<MaterialFile, Failure> {
    read_with(name, bytes, choice, Access::Whole(read))
}

/// The way in which the files that a material file names are read.
#[derive(Clone, Copy)]
enum Access<'a> {
    Whole(&'a ReadFile<'a>),
    /// For a check: the material that stands for such a file does not matter.
    Headers(&'a Open<'a>),
}

fn read_with(
    name: &str,
    bytes: &[u8],
    choice: Option<&MaterialChoice>,
    access: Access<'_>,
) -> Result<MaterialFile, Failure> {
    if let (true, Access::Whole(read)) = (is_gltf_file(name), access) {
        let found = read_gltf_material(bytes, choice, &mut |path: &str| read(Path::new(path)));
        return Ok(found.map_err(|failure| failure.context(name))?.into());
    }
    if is_materialx_file(name) {
        return read_materialx(bytes, choice).map_err(|failure| failure.context(name));
    }
    if choice.is_some() {
        return Err(Failure::new(format!(
            "{name} is not a glTF or MaterialX file, so there is no material to choose from"
        ))
        .help("remove `material`, or name a .gltf, .glb or .mtlx file"));
    }
    if MeasuredFormat::of_name(name).is_some() {
        let Reading { material, notes, .. } =
            measured::read_with_notes(name, bytes, None).map_err(|error| error.within(name))?;
        return Ok(MaterialFile { notes, ..material.into() });
    }
    let document = Document::parse(name, bytes).map_err(|errors| {
        if name.to_lowercase().ends_with(".toml") {
            return failure(&errors);
        }
        // Probably a picture or a table with another extension: its syntax errors would not help.
        let wrong = format!("{name} is not TOML, and does not have the extension of a measured BRDF");
        let chain = [wrong].into_iter().chain(errors.to_string().lines().next().map(str::to_owned)).collect();
        let help = format!("expected .toml, .gltf, .glb, .mtlx, or one of: {}", endings());
        Failure { help: Some(help), ..failure_of(chain) }
    })?;
    let mut reader = MaterialReader {
        access,
        errors: Vec::new(),
        notes: Vec::new(),
        warnings: Vec::new(),
        base_color: None,
        depth: 0,
    };
    match reader.material(&document.table) {
        Some(material) if reader.errors.is_empty() => {
            // A layer is one of several: the picture is that of the whole material.
            let base_color = reader.base_color.filter(|_| matches!(material, Material::Standard(_)));
            Ok(MaterialFile { material, base_color, notes: reader.notes, warnings: reader.warnings })
        }
        _ => Err(failure(&document.diagnostics(reader.errors))),
    }
}

/// The material of a MaterialX file, `choice` if there are several.
fn read_materialx(bytes: &[u8], choice: Option<&MaterialChoice>) -> Result<MaterialFile, Failure> {
    let MaterialxMaterial { material, warnings } = read_materialx_material(bytes, choice)?;
    Ok(MaterialFile { warnings, ..Material::Standard(material).into() })
}

/// Opens a file. Relative paths start at the material file's folder.
pub(crate) type Open<'a> = dyn Fn(&Path) -> Result<Box<dyn OpenFile>, Failure> + 'a;

/// Checks what [`read_material`] would read of a file: all of its text, and of the files that it names the
/// headers. Nothing is fitted or averaged.
///
/// # Errors
/// For what [`read_material`] refuses, if text and headers show it.
pub(crate) fn check_material(
    path: &Path,
    choice: Option<&MaterialChoice>,
    open: &Open<'_>,
) -> Result<(), Failure> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let mut file = open(path)?;
    if is_gltf_file(&name) {
        let find = &mut |other: &str| open(Path::new(other)).map(drop);
        return check_gltf_material(&mut file, choice, find)
            .map_err(|failure: Failure| failure.context(name));
    }
    if choice.is_none() && is_measured_file(&name) {
        return Ok(measured::check(&name, &mut file, None).map_err(|error| error.within(&*name))?);
    }
    let mut bytes = Vec::new();
    if is_materialx_file(&name) {
        file.read_to_end(&mut bytes)?;
        return read_with(&name, &bytes, choice, Access::Headers(open)).map(drop);
    }
    file.take(Document::MAX_BYTES as u64 + 1).read_to_end(&mut bytes)?;
    read_with(&name, &bytes, choice, Access::Headers(open)).map(drop)
}

/// Whether a file's name is that of a measured BRDF.
pub fn is_measured_file(name: &str) -> bool {
    MeasuredFormat::of_name(name).is_some()
}

/// Whether a file's name is that of a glTF file.
pub fn is_gltf_file(name: &str) -> bool {
    let ending = Path::new(name).extension().unwrap_or_default();
    ["gltf", "glb"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// The extensions of measured files, with their formats.
pub(crate) fn endings() -> String {
    MeasuredFormat::ALL.map(|format| format!(".{} ({})", format.ending(), format.name())).join(", ")
}

/// Every name that `model` may have.
fn names() -> impl Iterator<Item = &'static str> {
    MODELS.iter().map(|model| model.name).chain([MEASURED, GLTF, MATERIALX, LAYERS])
}

struct MaterialReader<'a> {
    access: Access<'a>,
    errors: Vec<Diagnostic>,
    notes: Vec<String>,
    warnings: Vec<String>,
    /// The picture of the base colour of the glTF material that was read last.
    base_color: Option<BaseColorTexture>,
    /// The number of layers that the current one is nested in.
    depth: usize,
}

impl MaterialReader<'_> {
    /// The material that a table describes; `None` after an error.
    fn material(&mut self, table: &Table) -> Option<Material> {
        let expected = || format!("expected one of: {}", names().collect::<Vec<_>>().join(", "));
        let Some(entry) = table.get("model") else {
            if table.get(LAYERS).is_some() {
                return self.layers(table);
            }
            if let Some(entry) = table.get(presets::KEY) {
                return self.preset(entry, table);
            }
            let error = Diagnostic::at(table.span.clone(), "\"model\" is missing").expected(expected());
            let mut near = table.entries.iter().filter_map(|entry| {
                Some((&entry.key, nearest(&entry.key.to_lowercase(), ["model", LAYERS, presets::KEY])?))
            });
            self.errors.push(match near.next() {
                Some((key, near)) => error.help(format!("did you mean {near:?} instead of {key:?}?")),
                None => error,
            });
            return None;
        };
        let name = match String::parse(&entry.value) {
            Ok(name) => name,
            Err(error) => {
                self.errors.push(error.expected(expected()));
                return None;
            }
        };
        let mut rest = Table { span: entry.key_span.clone(), entries: table.entries.clone() };
        rest.entries.retain(|entry| entry.key != "model");
        if name != LAYERS
            && let Some(layers) = table.get(LAYERS)
        {
            let error = Diagnostic::at(
                layers.key_span.clone(),
                format!("`layers` cannot be combined with model = {name:?}"),
            );
            self.errors.push(error.help("make the model one of the layers"));
            rest.entries.retain(|entry| entry.key != LAYERS);
        }
        match name.as_str() {
            MEASURED => self.measured(&rest),
            GLTF | MATERIALX => self.of_several(&rest, name == MATERIALX),
            LAYERS => self.layers(&rest),
            _ => match MODELS.iter().find(|model| model.name == name) {
                Some(model) => self.analytic(model, &rest),
                None => {
                    let error =
                        Diagnostic::at(entry.value.span.clone(), format!("there is no model {name:?}"));
                    let error = error.expected(expected());
                    self.errors.push(match Preset::named(&name) {
                        Ok(_) => error.help(format!("{name} is a preset: {} = {name:?}", presets::KEY)),
                        Err(_) => with_nearest(error, &name, names()),
                    });
                    None
                }
            },
        }
    }

    /// The material of a table that names a preset.
    fn preset(&mut self, entry: &Entry, table: &Table) -> Option<Material> {
        let ValueKind::String(name) = &entry.value.kind else {
            return self.refuse(is_not(&entry.value, "the name of a preset"), presets::KEY);
        };
        match Preset::named(name) {
            Ok(preset) => self.material(&preset.with(table)?),
            Err(message) => {
                let error = Diagnostic::at(entry.value.span.clone(), message);
                self.refuse(error.help("`specula stages import-material` lists the presets"), presets::KEY)
            }
        }
    }

    fn analytic(&mut self, model: &ModelText, table: &Table) -> Option<Material> {
        let values = self.values(model.parameters, table, "")?;
        match Material::analytic(model.name, &values)? {
            Ok(material) => Some(material),
            Err(error) => {
                self.errors.push(Diagnostic::at(place(&error, table), error.to_string()));
                None
            }
        }
    }

    /// The values of a table; `within` is the prefix of names in messages.
    fn values(&mut self, parameters: &[Parameter], table: &Table, within: &str) -> Option<Values> {
        let before = self.errors.len();
        let known: Vec<_> = parameters.iter().map(|parameter| parameter.name.to_owned()).collect();
        unknown_keys(table, &known, &mut self.errors);
        let mut values = Values::default();
        for parameter in parameters {
            let name = format!("{within}{}", parameter.name);
            let value = match table.get(parameter.name) {
                Some(entry) => self.value(&parameter.value_type, &entry.value, &name),
                None => parameter.default(),
            };
            match value {
                Some(value) => values.set(parameter.name, value),
                None if table.get(parameter.name).is_none() && is_required(parameter, table) => {
                    let mut expected =
                        format!("expected {} = {}", parameter.name, looks_like(&parameter.value_type));
                    if let Absent::RequiredUnless([x, y]) = parameter.absent {
                        expected += &format!(", or both {x} and {y}");
                    }
                    let error = Diagnostic::at(table.span.clone(), format!("\"{name}\" is missing"));
                    self.errors.push(error.expected(expected));
                }
                None => {}
            }
        }
        (self.errors.len() == before).then_some(values)
    }

    /// A value; `None` after an error.
    fn value(&mut self, value_type: &ValueType, value: &Toml, name: &str) -> Option<Value> {
        match value_type {
            ValueType::Number(range) => self.number(range, value, name).map(Value::Number),
            ValueType::Colour(range) => self.colour(range, value, name).map(Value::Colour),
            ValueType::Records(parameters) => {
                let ValueKind::Array(records) = &value.kind else {
                    return self.refuse(is_not(value, &looks_like(value_type)), name);
                };
                let mut all = Vec::new();
                for (index, record) in records.iter().enumerate() {
                    let name = format!("{name}[{index}]");
                    match &record.kind {
                        ValueKind::Table(table) => {
                            all.push(self.values(parameters, table, &format!("{name}.")))
                        }
                        _ => all.push(self.refuse(is_not(record, "a table"), &name)),
                    }
                }
                all.into_iter().collect::<Option<_>>().map(Value::Records)
            }
        }
    }

    fn number(&mut self, range: &brdf::Range, value: &Toml, name: &str) -> Option<f64> {
        match f64::parse(value) {
            Ok(number) if (range.least..=range.most).contains(&number) => Some(number),
            Ok(number) => {
                let error = Diagnostic::at(value.span.clone(), format!("{number} is not {}", range.words));
                self.refuse(error, name)
            }
            Err(_) => self.refuse(is_not(value, range.words), name),
        }
    }

    fn colour(&mut self, range: &brdf::Range, value: &Toml, name: &str) -> Option<[f64; 3]> {
        let looks_like = || looks_like(&ValueType::Colour(*range));
        match &value.kind {
            ValueKind::Array(channels) => match channels.as_slice() {
                [red, green, blue] => {
                    let rgb = [red, green, blue].map(|channel| self.number(range, channel, name));
                    Some([rgb[0]?, rgb[1]?, rgb[2]?])
                }
                _ => {
                    let error = Diagnostic::at(
                        value.span.clone(),
                        format!("{} numbers are not a colour", channels.len()),
                    );
                    self.refuse(error.expected(format!("expected {}", looks_like())), name)
                }
            },
            ValueKind::Float(_) | ValueKind::Integer(_) => {
                self.number(range, value, name).map(|grey| [grey; 3])
            }
            _ => self.refuse(is_not(value, &looks_like()), name),
        }
    }

    /// Reports an error of a named value.
    fn refuse<T>(&mut self, error: Diagnostic, name: &str) -> Option<T> {
        self.errors.push(Diagnostic { message: format!("{name}: {}", error.message), ..error });
        None
    }

    /// Reads `layers = [{ model = "...", ... }, ...]`.
    fn layers(&mut self, table: &Table) -> Option<Material> {
        unknown_keys(table, &[LAYERS.to_owned()], &mut self.errors);
        const EXPECTED: &str = "an array of tables { model, ... }";
        let Some(entry) = table.get(LAYERS) else {
            let error = Diagnostic::at(table.span.clone(), "\"layers\" is missing");
            self.errors.push(error.expected(format!("expected layers = {EXPECTED}")));
            return None;
        };
        let ValueKind::Array(items) = &entry.value.kind else {
            return self.refuse(is_not(&entry.value, EXPECTED), LAYERS);
        };
        if self.depth == DEEPEST {
            let message = format!("layers are nested more than {DEEPEST} deep");
            self.errors.push(
                Diagnostic::at(entry.key_span.clone(), message)
                    .help("put all of them into one list, because layers are summed"),
            );
            return None;
        }
        self.depth += 1;
        let mut layers = Vec::new();
        for (index, item) in items.iter().enumerate() {
            layers.push(match &item.kind {
                ValueKind::Table(table) => self.material(table),
                _ => self.refuse(is_not(item, "a table { model, ... }"), &format!("{LAYERS}[{index}]")),
            });
        }
        self.depth -= 1;
        let layers = layers.into_iter().collect::<Option<_>>()?;
        match Material::layers(layers) {
            Ok(material) => Some(material),
            Err(error) => self.refuse(Diagnostic::at(entry.value.span.clone(), error.to_string()), LAYERS),
        }
    }

    /// Reads `file`, `format`, `sample` and `scale`.
    fn measured(&mut self, table: &Table) -> Option<Material> {
        let before = self.errors.len();
        let keys = ["file", "format", "sample", "scale"];
        unknown_keys(table, &keys.map(str::to_owned), &mut self.errors);
        let scale = match table.get("scale") {
            Some(entry) => self.colour(&brdf::WEIGHT, &entry.value, "scale"),
            None => Some([1.0; 3]),
        };
        let format = table.get("format").and_then(|entry| self.format(&entry.value));
        let sample = table.get("sample").and_then(|entry| self.sample(&entry.value, format));
        let Some(entry) = table.get("file") else {
            let error = Diagnostic::at(table.span.clone(), "\"file\" is missing");
            self.errors
                .push(error.expected("expected file = the path of a measured BRDF, from this file's folder"));
            return None;
        };
        let file = match String::parse(&entry.value) {
            Ok(file) => file,
            Err(error) => return self.refuse(error, "file"),
        };
        let says_format = ["format", "sample"].iter().any(|key| table.get(key).is_some());
        if !says_format && !is_measured_file(&file) {
            let error = Diagnostic::at(
                entry.value.span.clone(),
                format!("{file:?} does not have the extension of a measured BRDF"),
            )
            .expected(format!("expected one of: {}", endings()))
            .help("or name the format, such as format = \"merl\"");
            return self.refuse(error, "file");
        }
        if self.errors.len() > before {
            return None;
        }
        let scaled = match self.table(&file, entry, format, sample)? {
            Material::Measured(measured) => measured.scaled(scale?).map(Material::Measured),
            Material::MeasuredAnisotropic(measured) => {
                measured.scaled(scale?).map(Material::MeasuredAnisotropic)
            }
            other => Ok(other),
        };
        scaled.map_err(|error| self.errors.push(Diagnostic::at(place(&error, table), error.to_string()))).ok()
    }

    /// Reads `file` and `material` of a glTF or a MaterialX file.
    fn of_several(&mut self, table: &Table, is_materialx: bool) -> Option<Material> {
        let before = self.errors.len();
        unknown_keys(table, &["file", "material"].map(str::to_owned), &mut self.errors);
        let choice = match table.get("material").map(|entry| ChosenMaterial::parse(&entry.value)) {
            Some(Ok(ChosenMaterial(choice))) => Some(choice),
            Some(Err(error)) => return self.refuse(Diagnostic { expected: None, ..error }, "material"),
            None => None,
        };
        let Some(entry) = table.get("file") else {
            let error = Diagnostic::at(table.span.clone(), "\"file\" is missing");
            let endings = if is_materialx { ".mtlx" } else { ".gltf or .glb" };
            let expected = format!("expected file = the path of a {endings} file, from this file's folder");
            self.errors.push(error.expected(expected));
            return None;
        };
        let file = match String::parse(&entry.value) {
            Ok(file) => file,
            Err(error) => return self.refuse(error, "file"),
        };
        if self.errors.len() > before {
            return None;
        }
        let folder = Path::new(&file).parent().unwrap_or(Path::new(""));
        let found = match self.access {
            Access::Whole(read) if is_materialx => {
                read(Path::new(&file)).and_then(|bytes| read_materialx(&bytes, choice.as_ref())).map(Some)
            }
            Access::Headers(open) if is_materialx => open(Path::new(&file)).and_then(|mut file| {
                let mut bytes = Vec::new();
                file.read_to_end(&mut bytes)?;
                read_materialx(&bytes, choice.as_ref()).map(|_| None)
            }),
            Access::Whole(read) => read(Path::new(&file)).and_then(|bytes| {
                let found =
                    read_gltf_material(&bytes, choice.as_ref(), &mut |path: &str| read(&folder.join(path)));
                Ok(Some(found?.into()))
            }),
            Access::Headers(open) => open(Path::new(&file)).and_then(|mut file| {
                let find = &mut |path: &str| open(&folder.join(path)).map(drop);
                check_gltf_material(&mut file, choice.as_ref(), find).map(|()| None)
            }),
        };
        match found {
            Ok(None) => stand_in(),
            Ok(Some(MaterialFile { material, base_color, notes, warnings })) => {
                self.base_color = base_color;
                self.notes.extend(notes.into_iter().map(|note| format!("{file}: {note}")));
                self.warnings.extend(warnings.into_iter().map(|warning| format!("{file}: {warning}")));
                Some(material)
            }
            Err(failure) => {
                let error = Diagnostic::at(entry.value.span.clone(), failure.chain.join(": "));
                self.refuse(error, "file")
            }
        }
    }

    /// The content of a measured file, or a sample of the files in a folder.
    fn table(
        &mut self,
        file: &str,
        entry: &Entry,
        format: Option<MeasuredFormat>,
        sample: Option<usize>,
    ) -> Option<Material> {
        let read = match (self.access, sample) {
            (Access::Whole(read), Some(sample)) => published(file, &|path| read(path)).and_then(|files| {
                Ok(Some(measured::read_curet(files.each_ref().map(|file| &file[..]), sample)?))
            }),
            (Access::Headers(open), Some(sample)) => {
                let read = |path: &Path| {
                    let mut bytes = Vec::new();
                    open(path)?.take(MOST_PUBLISHED).read_to_end(&mut bytes)?;
                    Ok(Arc::new(bytes))
                };
                published(file, &read).and_then(|files| {
                    measured::check_curet(files.each_ref().map(|file| &file[..]), sample)?;
                    Ok(None)
                })
            }
            (Access::Whole(read), None) => read(Path::new(file))
                .and_then(|bytes| Ok(Some(measured::read_with_notes(file, &bytes, format)?))),
            (Access::Headers(open), None) => open(Path::new(file))
                .and_then(|mut opened| Ok(measured::check(file, &mut opened, format).map(|()| None)?)),
        };
        match read {
            Ok(None) => stand_in(),
            Ok(Some(reading)) => {
                self.notes.extend(reading.notes.into_iter().map(|note| format!("{file}: {note}")));
                Some(reading.material)
            }
            Err(failure) => {
                let error = Diagnostic::at(entry.value.span.clone(), failure.chain.join(": "));
                self.refuse(error, "file")
            }
        }
    }

    /// The number of a sample of CURET.
    fn sample(&mut self, value: &Toml, format: Option<MeasuredFormat>) -> Option<usize> {
        if !matches!(format, None | Some(MeasuredFormat::Curet)) {
            let error = Diagnostic::at(value.span.clone(), "only format = \"curet\" has samples");
            return self.refuse(error, "sample");
        }
        match usize::parse(value) {
            Ok(sample) => Some(sample),
            Err(_) => self.refuse(is_not(value, "the number of a sample, from 1 on"), "sample"),
        }
    }

    fn format(&mut self, value: &Toml) -> Option<MeasuredFormat> {
        let names = || MeasuredFormat::ALL.iter().map(|format| format.name());
        let expected = names().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", ");
        let error = is_not(value, &format!("one of: {expected}"));
        let ValueKind::String(word) = &value.kind else { return self.refuse(error, "format") };
        let named = MeasuredFormat::ALL.into_iter().find(|format| format.name() == word);
        named.or_else(|| self.refuse(with_nearest(error, word, names()), "format"))
    }
}

/// What is read of a file of CURET: the largest has 100 kB.
const MOST_PUBLISHED: u64 = 1 << 20;

/// The files that CURET publishes, in a folder.
fn published(folder: &str, read: &ReadFile<'_>) -> Result<[Arc<Vec<u8>>; 4], Failure> {
    let [table, red, green, blue] = CURET_FILES.map(|name| read(&Path::new(folder).join(name)));
    Ok([table?, red?, green?, blue?])
}

/// The material in place of one in another file whose header was checked.
fn stand_in() -> Option<Material> {
    brdf::Lambert::new([0.0; 3]).ok().map(Material::Lambert)
}

/// Whether a table must have a parameter.
fn is_required(parameter: &Parameter, table: &Table) -> bool {
    match parameter.absent {
        Absent::Required => true,
        Absent::RequiredUnless(others) => others.iter().any(|other| table.get(other).is_none()),
        Absent::Optional | Absent::Default(_) => false,
    }
}
