//! Pictures that show a part of the sphere, as their files say: what is made of that, and what is said.

use containers::{OpenExrEnvmap, Panorama, Shows};
use engine::{Diagnostic, Failure, Parameter, Reporter, Value, ValueKind, unexpected};
use envmap::{Coverage, Fill, Layout, Part};
use serde_json::json;
use sphere::Rotation;

use crate::values::{Rgb, about};

/// Below this share of the sphere, nothing is missing.
const NOTHING: f64 = 1e-6;

/// The light from where a picture shows nothing: `"black"`, `"mean"`, `"edge"` or a colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FillName(pub(crate) Fill);

impl Parameter for FillName {
    fn expected() -> String {
        format!("\"black\", \"mean\", \"edge\", or {}", Rgb::expected())
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let fill = match &value.kind {
            ValueKind::String(name) => match name.as_str() {
                "black" => Fill::Black,
                "mean" => Fill::Mean,
                "edge" => Fill::Edge,
                _ => return Err(unexpected(value, &Self::expected())),
            },
            ValueKind::Array(_) | ValueKind::Float(_) | ValueKind::Integer(_) => {
                Fill::Colour(Rgb::parse(value)?.0.map(|channel| channel as f32))
            }
            _ => return Err(unexpected(value, &Self::expected())),
        };
        let finite = !matches!(fill, Fill::Colour(colour) if colour.iter().any(|value| !value.is_finite()));
        finite.then_some(Self(fill)).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        match self.0 {
            Fill::Black => "black".into(),
            Fill::Mean => "mean".into(),
            Fill::Edge => "edge".into(),
            Fill::Colour(colour) => Rgb(colour.map(f64::from)).canonical(),
        }
    }

    fn schema() -> serde_json::Value {
        json!({ "oneOf": [{ "type": "string", "enum": ["black", "mean", "edge"] }, Rgb::schema()] })
    }
}

/// The places of a picture's pixels, their description in words, and the turn of its light.
#[derive(Clone, Debug)]
pub(crate) struct Shown {
    pub(crate) coverage: Coverage,
    pub(crate) turn: Rotation,
    what: String,
}

impl Shown {
    /// A picture of the whole sphere.
    pub(crate) fn whole(layout: Layout) -> Self {
        Self { coverage: layout.into(), turn: Rotation::IDENTITY, what: String::new() }
    }

    /// The layout and turn of a file's picture: as the manifest says, or else the file.
    ///
    /// # Errors
    /// If the manifest says nothing, and what the file says is unclear.
    pub(crate) fn of(
        wanted: Option<Layout>,
        envmap: Option<OpenExrEnvmap>,
        panorama: Option<Panorama>,
        name: &str,
        reporter: &Reporter,
    ) -> Result<Self, Failure> {
        let envmap = envmap.map(|envmap| match envmap {
            OpenExrEnvmap::LatLong => Layout::OpenExrLatLong,
            OpenExrEnvmap::Cube => Layout::OpenExrCube,
        });
        if let (Some(envmap), Some(wanted)) = (envmap, wanted)
            && envmap != wanted
        {
            reporter.warn(format!(
                "the file's envmap attribute says {}, but it is read with layout = \"{}\"",
                envmap.name(),
                wanted.name()
            ));
        }
        let Some(panorama) = panorama else {
            return Ok(Self::whole(wanted.or(envmap).unwrap_or(Layout::LatLong)));
        };
        if let Some(layout) = wanted.or(envmap) {
            let by = if wanted.is_some() { "the manifest" } else { "the file's envmap attribute" };
            if let Shows::Part(_, what) = &panorama.shows {
                reporter.warn(format!(
                    "{name}: {} says that the picture shows {what}; {by} says layout = \"{}\", which \
                     overrides it",
                    panorama.source,
                    layout.name()
                ));
            }
            return Ok(Self::whole(layout));
        }
        let Panorama { source, shows, turn, warnings, notes } = panorama;
        warnings.iter().for_each(|warning| reporter.warn(format!("{name}: {source}: {warning}")));
        notes.iter().for_each(|note| reporter.note(format!("{name}: {source}: {note}")));
        match shows {
            Shows::Whole => Ok(Self { turn, ..Self::whole(Layout::LatLong) }),
            Shows::Part(part, what) => {
                let what = format!("{name}: {source} says that the picture shows {what}");
                Ok(Self { coverage: part.into(), turn, what })
            }
            Shows::Unclear(why) => Err(Failure::new(format!("{source}: {why}")).help(
                "correct the file's metadata, or remove them; layout = \"lat-long\" treats the picture as \
                 the whole sphere and ignores them",
            )),
        }
    }

    /// Reports the part of the sphere that a picture lacks, and the light that took its place.
    pub(crate) fn report(&self, part: &Part, fill: Fill, reporter: &Reporter) {
        let what = &self.what;
        let missing = part.missing();
        if missing < NOTHING {
            reporter.note(format!("{what}; no part of the sphere is missing"));
            return;
        }
        let missing = about(missing);
        let rest = match fill {
            Fill::Black => "is black; fill = \"edge\" or \"mean\" or a colour adds light there".to_owned(),
            Fill::Mean => "was filled with the picture's mean light".to_owned(),
            Fill::Edge => "was filled with the light at the picture's border".to_owned(),
            Fill::Colour(_) => "was filled with one colour".to_owned(),
        };
        reporter.warn(format!("{what}. The rest, {missing} of the sphere, {rest}"));
    }
}
