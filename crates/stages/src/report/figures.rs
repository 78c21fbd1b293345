//! The figures of a report, which the page shows and the JSON file holds.

use serde::Serialize;
use serde_json::value::RawValue;

/// Everything that was measured.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Report {
    /// The version of this file's schema; it changes when a field changes its meaning or is removed.
    pub(crate) schema: u32,
    /// The recipe: how this file was made.
    pub(crate) specula: Box<RawValue>,
    pub(crate) settings: Settings,
    pub(crate) materials: Vec<MaterialFigures>,
    pub(crate) pairs: Vec<PairFigures>,
}

/// How it was measured.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Settings {
    /// The relative RMS error up to which an export is called good enough.
    pub(crate) accept: f64,
    /// Texels along the edge of a face of the exported maps.
    pub(crate) resolution: usize,
    /// Pixels along the edge of a picture of the sphere.
    pub(crate) sphere: usize,
    /// The most rows of an environment under which everything was rendered.
    pub(crate) reference_rows: usize,
    /// The factor by which the second row of differences is amplified.
    pub(crate) amplify: f64,
}

/// A material by itself.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MaterialFigures {
    pub(crate) name: String,
    /// The model and what it is centred on.
    pub(crate) model: String,
    pub(crate) centre: &'static str,
    /// The degrees that the exports have.
    pub(crate) f: usize,
    pub(crate) p: usize,
    /// The share of the BRDF's energy that they hold.
    pub(crate) captured: f64,
    /// Why these degrees.
    pub(crate) chosen: String,
    /// Whether any coefficient with p > 0 is not zero.
    pub(crate) view_dependent: bool,
    /// The F of `captured_per_p`.
    pub(crate) high_f: usize,
    /// The share of the BRDF's energy that F = `high_f` and P = 0, 1, 2 ... hold.
    pub(crate) captured_per_p: Vec<f64>,
    /// What to use under all environments, in plain language.
    pub(crate) verdict: String,
}

/// A material under an environment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PairFigures {
    pub(crate) environment: String,
    pub(crate) material: String,
    /// The grid of the environment that was rendered: columns and rows.
    pub(crate) rendered: [usize; 2],
    /// In the order of [`Method::ALL`].
    pub(crate) exports: Vec<Export>,
    pub(crate) shrm: ShrmError,
    /// What would help, if no export is good enough.
    pub(crate) help: Option<Help>,
    /// The SHRM with F = `high_f` and lower and higher P.
    pub(crate) per_p: Vec<PerP>,
    /// Cut at degrees F = 0, 1, 2 ..., with the P of the exports.
    pub(crate) accuracy: Accuracy,
    /// Cut at degrees P = 0, 1, 2 ..., with the F of the exports.
    pub(crate) accuracy_per_p: Accuracy,
    pub(crate) advice: Advice,
}

/// A form in which a renderer receives reflected light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Method {
    /// One reflection map, `export-reflection-map`.
    ReflectionMap,
    /// The 3D texture, `export-kautz-mccool`.
    KautzMccool,
    /// Twelve view maps, `export-cabral`.
    Cabral,
    /// The spherical harmonic reflection map, `export-shrm`.
    Shrm,
}

impl Method {
    /// From the plainest to the most exact.
    pub(crate) const ALL: [Self; 4] = [Self::ReflectionMap, Self::KautzMccool, Self::Cabral, Self::Shrm];

    /// The name in headings.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::ReflectionMap => "Plain map",
            Self::KautzMccool => "Kautz-McCool",
            Self::Cabral => "Cabral",
            Self::Shrm => "SHRM",
        }
    }

    /// The kind that writes it.
    pub(crate) fn kind(self) -> &'static str {
        match self {
            Self::ReflectionMap => "export-reflection-map",
            Self::KautzMccool => "export-kautz-mccool",
            Self::Cabral => "export-cabral",
            Self::Shrm => "export-shrm",
        }
    }
}

/// One export of a pair.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Export {
    pub(crate) method: Method,
    /// RMS difference from brute force over the sphere's pixels, divided by the RMS radiance.
    pub(crate) rms: f64,
    /// Bytes of its texels as RGBA half floats.
    pub(crate) bytes: u64,
    /// What the bytes are made of.
    pub(crate) texture: String,
}

/// The parts of the SHRM's error, each as [`Export::rms`], over some of the sphere's pixels.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct ShrmError {
    /// The error of the coefficients themselves, without texels: what the degrees cut off.
    pub(crate) degrees: f64,
    /// The error of the map against its coefficients: what the texels blur.
    pub(crate) texels: f64,
}

/// What would make an SHRM good enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "by")]
pub(crate) enum Help {
    /// These degrees, with an error as [`Export::rms`].
    Degrees { f: usize, p: usize, rms: f64 },
    /// About this many texels along the edge of a face.
    Resolution { texels: usize },
    /// No degrees that were tried; these came closest.
    Missed { f: usize, p: usize, rms: f64 },
}

/// An SHRM cut at a degree in the view.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PerP {
    pub(crate) p: usize,
    /// The share of the BRDF's energy up to this P.
    pub(crate) captured: f64,
    /// As [`Export::rms`].
    pub(crate) rms: f64,
}

/// Accuracies of the reflected light cut at each degree 0, 1, 2 ...: 1 less the share of its energy that is
/// lost.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Accuracy {
    /// Measured against the light field at the highest degree.
    pub(crate) truth: Vec<f64>,
    /// The estimate from the BRDF's captured energy.
    pub(crate) brdf: Vec<f64>,
    /// The estimate from whichever of BRDF and lighting is captured better.
    pub(crate) better: Vec<f64>,
    /// The guarantee of the bound on the residual energy, with the part that P cuts off.
    pub(crate) bound: Vec<f64>,
    /// The same bound as the thesis prints it, without that part.
    pub(crate) bound_as_printed: Vec<f64>,
}

/// The advised export.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Advice {
    pub(crate) method: Method,
    /// Whether its error is at most `accept`.
    pub(crate) good: bool,
    /// The reason in plain language.
    pub(crate) why: String,
}
