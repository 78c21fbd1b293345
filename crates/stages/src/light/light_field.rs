//! Places lightings at points: light that is near, so that it differs over an object.
//!
//! ```toml
//! [stage.near]
//! kind = "light-field"
//! inputs = { lightings = "lighting" }
//! points = { window = [0, -2, 1], door = [0, 2, 1] }
//! ```
//!
//! Each lighting is the light that arrives at one point, measured or rendered there (Kautz, Sloan and
//! Snyder 2002, section 4). `lightings` receives all items of a stage, and `points` gives the place of each
//! by its name: the stem of its file, or of several files, `"sky, gold"`. Places are in the mesh's unit, +Z
//! up. Every lighting needs a point, and every point a lighting.
//!
//! `shade-vertices` and `export-gltf` take the result as their `lighting`, `preview` as its `light-field`.
//! Between the points x_k light is blended by the squares of the inverse distances (Shepard 1968),
//!
//! > L(p) = sum over k of w_k L_k, w_k = |p - x_k|^-2 / sum over j of |p - x_j|^-2
//!
//! which is L_k at the point itself, smooth, never brighter than the brightest point, and the mean of all
//! far away. A single point gives the same light everywhere. Points can be anywhere, preferably around the
//! object rather than in it.
//!
//! Separate lights (`project-sh`, `circular-lights`) are added to the series, up to its degree, so they are
//! not sharp. If the lightings have different degrees, the lower ones are padded with zeros.

use std::collections::BTreeMap;

use engine::{
    Artifact, Context, Diagnostic, Failure, Kind, Output, Parameter, Port, Product, Value, ValueKind,
    nearest, parameters, unexpected,
};
use serde_json::json;

use crate::values::{Place, artifacts};

parameters! {
    /// Parameters of `light-field`.
    pub(crate) struct Parameters {
        /// The place of each lighting, by its name.
        points: Points = Points::default(),
    }
}

/// Places by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Points(BTreeMap<String, Place>);

impl Parameter for Points {
    fn expected() -> String {
        format!("a table of places, each {}", Place::expected())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let ValueKind::Table(table) = &value.kind else { return Err(unexpected(value, &Self::expected())) };
        let place = |entry: &engine::Entry| Ok((entry.key.clone(), Place::parse(&entry.value)?));
        table.entries.iter().map(place).collect::<Result<_, _>>().map(Self)
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(|(name, place)| (name.clone(), place.canonical())).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "object", "additionalProperties": Place::schema() })
    }
}

/// The kind `light-field`.
pub(crate) struct LightFieldKind;

impl Kind for LightFieldKind {
    type Parameters = Parameters;

    const NAME: &'static str = "light-field";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("light_field.rs");
    const SHOWS_KEYS: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::many::<artifacts::Lighting>("lightings")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::LightField::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let Points(points) = &parameters.points;
        let lightings = context.inputs.many::<artifacts::Lighting>("lightings")?;
        let named: BTreeMap<String, _> =
            lightings.iter().map(|(key, lighting)| (key.to_string(), &lighting.0)).collect();
        if let Some(name) = named.keys().find(|name| !points.contains_key(*name)) {
            return Err(unmatched(&format!("the lighting {name:?} has no point"), name, points));
        }
        if let Some(name) = points.keys().find(|name| !named.contains_key(*name)) {
            return Err(unmatched(&format!("the point {name:?} has no lighting"), name, &named));
        }
        let degrees = || named.values().map(|lighting| lighting.series.degree().get());
        if let (Some(least), Some(most)) = (degrees().min(), degrees().max())
            && least < most
        {
            reporter.note(format!("degrees {least} to {most}: the light field has degree {most}"));
        }
        let beside: usize = named.values().map(|lighting| lighting.lights.len()).sum();
        match beside {
            0 => {}
            1 => reporter.note("1 separate light is added to its series, up to its degree"),
            _ => reporter
                .note(format!("{beside} separate lights are added to their series, up to their degrees")),
        }
        let places = points.values().map(|Place(place)| *place).collect();
        let lights = named.values().map(|lighting| lighting.whole()).collect();
        let field = transfer::LightField::new(places, lights);
        let field = field.map_err(|error| Failure::from(error).help("points = { NAME = [x, y, z], ... }"))?;
        Output::artifact(artifacts::LightField(field))
    }
}

/// A failure with the names that there are.
fn unmatched<T>(message: &str, name: &str, known: &BTreeMap<String, T>) -> Failure {
    let names = || known.keys().map(String::as_str);
    let help = match nearest(name, names()) {
        Some(near) => format!("did you mean {near:?}?"),
        None if known.is_empty() => format!("points = {{ {name:?} = [x, y, z] }}"),
        None => format!("there are: {}", names().collect::<Vec<_>>().join(", ")),
    };
    Failure::new(message).help(help)
}
