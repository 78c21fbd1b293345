//! Reads a material: a TOML file that names a reflection model and its parameters.
//!
//! Every file that `source` matches gives one item. The faults of a file are told together, each with its line and
//! column. Where a colour is wanted, `[red, green, blue]` is linear Rec. 709 and one number means grey.
//!
//! ## Models
//!
//! `model = "lambert"`: matte, the same from every view. The transfer function about the normal N is
//!
//! > rho_hat(theta_i) = albedo / pi * max(cos theta_i, 0)
//!
//! `model = "phong"`: a highlight about the reflection vector R, of one shape from every view:
//!
//! > rho_hat(theta_i) = specular * (exponent + 1) / (2 pi) * max(cos theta_i, 0)^exponent
//!
//! | model | key | value |
//! | --- | --- | --- |
//! | `lambert` | `albedo` | a colour, the share of light that is reflected; must be given |
//! | `phong` | `exponent` | a number from 0 to 1e9, the sharpness of the highlight; must be given |
//! | `phong` | `specular` | a colour, the share of light that is reflected; 1 where it is left out |
//!
//! A colour above 1 (at most 1e6) is taken with a warning, because such a material reflects more light than falls on it. Otherwise
//! a constant environment of radiance 1 is reflected as `albedo` or `specular`: neither model makes light.
//!
//! ```toml
//! # gold.toml
//! model = "phong"
//! exponent = 64
//! specular = [1.0, 0.77, 0.34]
//! ```
//!
//! ## Example
//!
//! ```toml
//! [stage.material]
//! kind = "import-material"
//! source = "assets/materials/*.toml"
//! ```

use brdf::{Lambert, Material, Model as _, ParameterError, Phong};
use engine::{
    Artifact, Context, Document, Failure, Fault, Faults, Kind, Output, Parameter, Parameters as _, Port,
    Product, Table, nearest, parameters,
};

use crate::artifacts;
use crate::colour::Rgb;

parameters! {
    /// `import-material` has no parameters: a material's are in its file.
    pub(crate) struct Parameters {}
}

/// The kind `import-material`.
pub(crate) struct ImportMaterial;

impl Kind for ImportMaterial {
    type Parameters = Parameters;

    const NAME: &'static str = "import-material";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("import_material.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&'static str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Material::TYPE)
    }

    fn run(_: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let path = context.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let bytes = context.read(path).map_err(|failure| match context.is_folder(path) {
            true => Failure::new(format!("{file} is a folder, not a material"))
                .help("name a file, or every file in it: source = \"folder/*.toml\""),
            false => failure,
        })?;
        let document = Document::parse(file, &bytes).map_err(|faults| failure(&faults))?;
        let mut faults = Vec::new();
        match material(&document.table, &mut faults) {
            Some(material) if faults.is_empty() => {
                tell_excess(&material, context);
                Output::artifact(artifacts::Material(material))
            }
            _ => Err(failure(&document.faults(faults))),
        }
    }
}

/// A model's name in material files, and how its parameters are parsed.
type Model = (&'static str, fn(&Table, &mut Vec<Fault>) -> Option<Material>);

/// Every model.
const MODELS: [Model; 2] = [(Lambert::NAME, lambert), (Phong::NAME, phong)];

parameters! {
    /// Parameters of `model = "lambert"`.
    pub(crate) struct LambertParameters {
        /// The share of light that is reflected, 0 to 1.
        albedo: Rgb,
    }
}

fn lambert(table: &Table, faults: &mut Vec<Fault>) -> Option<Material> {
    let parameters = LambertParameters::parse(table, faults)?;
    checked(Lambert::new(parameters.albedo.0).map(Material::Lambert), table, faults)
}

parameters! {
    /// Parameters of `model = "phong"`.
    pub(crate) struct PhongParameters {
        /// The sharpness of the highlight: the power of the cosine, 0 or more.
        exponent: f64,
        /// The share of light that is reflected, 0 to 1.
        specular: Rgb = Rgb::grey(1.0),
    }
}

fn phong(table: &Table, faults: &mut Vec<Fault>) -> Option<Material> {
    let parameters = PhongParameters::parse(table, faults)?;
    checked(Phong::new(parameters.exponent, parameters.specular.0).map(Material::Phong), table, faults)
}

/// A model that the kernel accepts, or the fault of the parameter that it does not.
fn checked(
    model: Result<Material, ParameterError>,
    table: &Table,
    faults: &mut Vec<Fault>,
) -> Option<Material> {
    model
        .map_err(|error| {
            let entry = table.get(error.parameter);
            let span = entry.map_or(table.span.clone(), |entry| entry.value.span.clone());
            faults.push(Fault::at(span, error.to_string()));
        })
        .ok()
}

/// The material that a file's table describes; `None` where that left a fault.
fn material(table: &Table, faults: &mut Vec<Fault>) -> Option<Material> {
    let models = || MODELS.iter().map(|(name, _)| *name);
    let expected = format!("expected one of: {}", models().collect::<Vec<_>>().join(", "));
    let Some(entry) = table.get("model") else {
        faults.push(Fault::at(0..0, "\"model\" is missing").expected(expected));
        return None;
    };
    let name = match String::parse(&entry.value) {
        Ok(name) => name,
        Err(fault) => {
            faults.push(fault.expected(expected));
            return None;
        }
    };
    let Some((_, parse)) = MODELS.iter().find(|(model, _)| *model == name) else {
        let fault =
            Fault::at(entry.value.span.clone(), format!("there is no model {name:?}")).expected(expected);
        faults.push(match nearest(&name, models()) {
            Some(near) => fault.help(format!("did you mean {near:?}?")),
            None => fault,
        });
        return None;
    };
    let rest = table.entries.iter().filter(|entry| entry.key != "model").cloned().collect();
    parse(&Table { span: entry.key_span.clone(), entries: rest }, faults)
}

/// Warns of a material that reflects more than it receives.
fn tell_excess(material: &Material, context: &Context<'_>) {
    let (name, colour) = match material {
        Material::Lambert(model) => ("albedo", model.albedo()),
        Material::Phong(model) => ("specular", model.specular()),
        _ => return,
    };
    if let Some(channel) = colour.into_iter().find(|channel| *channel > 1.0) {
        context.warn(format!(
            "{name} {channel} is more than 1: the material reflects more light than falls on it"
        ));
    }
}

/// All faults of a file, each on a line of its own.
fn failure(faults: &Faults) -> Failure {
    let mut chain = vec![format!("{}: {} faults", faults.file, faults.faults.len())];
    if faults.faults.len() == 1 {
        chain.clear();
    }
    chain.extend(faults.to_string().lines().map(str::to_owned));
    Failure { chain, help: None, cancelled: false }
}
