//! The figures of a report, which the page shows and the JSON file holds.

use serde::Serialize;
use serde_json::value::RawValue;

use crate::picture::report::degree_figures::DegreeFigures;
pub(crate) use crate::picture::report::errors::{Errors, Limits};
use crate::picture::report::probe_figures::ProbeFigures;
use crate::values::quantity::size;

/// Everything that was measured.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Report {
    /// The version of this file's schema, [`crate::picture::report_schema::REPORT_SCHEMA`].
    pub(crate) schema: u64,
    /// The recipe: how this file was made.
    pub(crate) specula: Box<RawValue>,
    pub(crate) settings: Settings,
    pub(crate) materials: Vec<MaterialFigures>,
    pub(crate) pairs: Vec<PairFigures>,
    /// The losses of degrees of BRDF tables with `sections = ["tables"]`. Empty otherwise.
    pub(crate) tables: Vec<TableFigures>,
    /// The noise of samples with `sections = ["sampling"]`. Empty otherwise.
    pub(crate) sampling: Vec<NoisePair>,
    /// The losses of a few lights for each environment, with `sections = ["rigs"]`. Empty otherwise.
    pub(crate) rigs: Vec<RigFigures>,
    /// What truncations to degrees lose, with `sections = ["degrees"]`. Empty otherwise.
    pub(crate) degrees: DegreeFigures,
    /// Light probes, if `places` is connected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) probes: Option<ProbeFigures>,
}

/// The settings of the measurement.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Settings {
    pub(crate) limits: Limits,
    /// The number of texels along the edge of a face of the exported maps.
    pub(crate) resolution: usize,
    /// The number of pixels along the edge of a picture of the sphere.
    pub(crate) sphere: usize,
    /// The factor by which the second row of differences is amplified.
    pub(crate) amplify: f64,
    /// The relative RMS error up to which the degree of a table is good.
    pub(crate) table_error: f64,
}

/// A material under all environments.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MaterialFigures {
    pub(crate) name: String,
    /// The name of the model and of its centre.
    pub(crate) model: String,
    pub(crate) centre: &'static str,
    pub(crate) advice: Advice,
}

/// A material under an environment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct PairFigures {
    pub(crate) environment: String,
    pub(crate) material: String,
    /// The degrees of the reflection.
    pub(crate) f: usize,
    pub(crate) p: usize,
    /// The number of lamps beside the reflection.
    pub(crate) lamps: usize,
    /// Whether the reflection's degrees were chosen for this light; otherwise they were given.
    pub(crate) for_light: bool,
    /// The exports in the order of [`Method::ALL`]; [`Method::ShrmSeparate`] only if there are lamps, and
    /// [`Method::PartMaps`] only of a material of two parts.
    pub(crate) exports: Vec<Export>,
    /// The other exports that were measured, because no export is good or given degrees show.
    pub(crate) tried: Vec<Trial>,
    pub(crate) advice: Advice,
    /// What techniques of every size cost, and how far they are off; none with `trade = false`.
    pub(crate) trade: Option<Trade>,
}

/// The errors of techniques against what they cost.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Trade {
    pub(crate) series: Vec<TradeSeries>,
    pub(crate) advice: TapAdvice,
}

/// One technique at every degree that was measured.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TradeSeries {
    pub(crate) technique: Technique,
    /// The number of lights beside the maps, which the renderer adds.
    pub(crate) lights: usize,
    /// In the order of their degrees.
    pub(crate) points: Vec<TradePoint>,
}

/// A technique at one degree.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct TradePoint {
    /// P of an SHRM, the number of components, or that of taps; none of other techniques.
    pub(crate) degree: Option<usize>,
    #[serde(flatten)]
    pub(crate) errors: Errors,
    /// The bytes of textures and lights.
    pub(crate) bytes: u64,
    /// The bilinear look-ups of a pixel, one for each layer or level.
    pub(crate) fetches: usize,
    /// The number of the picture's pixels of which one was measured.
    pub(crate) one_of: usize,
}

/// The taps and lights that a pair needs.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TapAdvice {
    pub(crate) taps: usize,
    pub(crate) lights: usize,
    pub(crate) bytes: u64,
    pub(crate) p95: f64,
    pub(crate) p99: f64,
    /// Whether these errors are within 0.1 and 0.25 stops.
    pub(crate) good: bool,
    /// The advice in plain language.
    pub(crate) text: String,
}

/// A technique whose costs are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Technique {
    /// [`Method::ReflectionMap`].
    ReflectionMap,
    /// [`Method::PartMaps`].
    PartMaps,
    /// The light, blurred by the lobe that is seen head on, times the albedo toward the view.
    SplitSum,
    /// [`Method::KautzMccool`].
    KautzMccool,
    /// [`Method::Cabral`].
    Cabral,
    /// [`Method::Shrm`], at each degree P.
    Shrm,
    /// [`Method::ShrmSeparate`], at each degree P.
    ShrmSeparate,
    /// Principal components, `form = "components"` of `export-shrm`.
    Components,
    /// [`Method::Taps`], with each number of taps.
    Taps,
}

impl Technique {
    /// The technique's name in headings.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::ReflectionMap => Method::ReflectionMap.title(),
            Self::PartMaps => Method::PartMaps.title(),
            Self::SplitSum => "Split sum",
            Self::KautzMccool => Method::KautzMccool.title(),
            Self::Cabral => Method::Cabral.title(),
            Self::Shrm => Method::Shrm.title(),
            Self::ShrmSeparate => Method::ShrmSeparate.title(),
            Self::Components => "Components",
            Self::Taps => "Taps",
        }
    }

    /// The letter of the technique's degree, if it has one.
    pub(crate) fn letter(self) -> Option<char> {
        match self {
            Self::Shrm | Self::ShrmSeparate => Some('P'),
            Self::Components => Some('K'),
            Self::Taps => Some('J'),
            _ => None,
        }
    }

    /// Whether one set of maps serves all materials under an environment.
    pub(crate) fn is_shared(self) -> bool {
        matches!(self, Self::Taps | Self::SplitSum)
    }
}

/// A material as a BRDF table.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TableFigures {
    pub(crate) material: String,
    /// The share of the energy of rho_hat that the degrees 0 to l hold, for l = 0, 1, ...
    pub(crate) captured: Vec<f64>,
    /// The degree that is good under every environment; none if no degree is.
    pub(crate) advised: Option<usize>,
    pub(crate) pairs: Vec<TablePair>,
}

/// A sphere of a material, shaded with a table under an environment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TablePair {
    pub(crate) environment: String,
    /// The least degree with an error of at most [`Settings::table_error`]; none if no degree has.
    pub(crate) advised: Option<usize>,
    /// The cuts at every degree, and at the highest with a window.
    pub(crate) cuts: Vec<Cut>,
}

/// Light and table cut at a degree.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Cut {
    pub(crate) degree: usize,
    /// The number of coefficients, (degree + 1)^2.
    pub(crate) rows: usize,
    /// Whether a Hanning window smoothed the light.
    pub(crate) windowed: bool,
    #[serde(flatten)]
    pub(crate) errors: Errors,
}

/// The numbers of samples of an estimate.
pub(crate) const SAMPLES: [usize; 4] = [4, 16, 64, 256];

/// The number of samples of which the note says what has the least noise.
pub(crate) const NOTED: usize = 64;

/// The noise of a material's samples under an environment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct NoisePair {
    pub(crate) material: String,
    pub(crate) environment: String,
    /// The noise of each of [`Follows::ALL`] with each of [`PointSet::ALL`].
    pub(crate) noise: Vec<Noise>,
}

impl NoisePair {
    /// The density that has the least noise at one of [`SAMPLES`], by random points.
    pub(crate) fn least(&self, samples: usize) -> Option<Follows> {
        let place = SAMPLES.iter().position(|count| *count == samples)?;
        let random = self.noise.iter().filter(|noise| noise.points == PointSet::Random);
        let least = random.min_by(|a, b| a.rms[place].total_cmp(&b.rms[place]));
        Some(least?.follows)
    }
}

/// The noise of samples of one density by one set of points.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Noise {
    pub(crate) follows: Follows,
    pub(crate) points: PointSet,
    /// The relative RMS error of 4, 16, 64 and 256 samples.
    pub(crate) rms: Vec<f64>,
}

/// The function that the density of directions follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Follows {
    /// The texels of the environment.
    Light,
    /// The material at the view.
    Lobe,
    /// Half of the samples follow the light and half the material, in the balance heuristic.
    Both,
    /// The product of light and lobe.
    Product,
}

impl Follows {
    pub(crate) const ALL: [Self; 4] = [Self::Light, Self::Lobe, Self::Both, Self::Product];

    /// The density's name in headings.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Lobe => "lobe",
            Self::Both => "both",
            Self::Product => "product",
        }
    }
}

/// Points of the unit square that become directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum PointSet {
    /// Independent points.
    Random,
    /// The Sobol (0, 2)-sequence in Owen's scrambling.
    Stratified,
}

impl PointSet {
    pub(crate) const ALL: [Self; 2] = [Self::Random, Self::Stratified];
}

/// Spheres under the light rigs of an environment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RigFigures {
    pub(crate) environment: String,
    pub(crate) materials: Vec<RigSpheres>,
}

/// A material under the rigs of an environment.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RigSpheres {
    pub(crate) material: String,
    /// The spheres of each number of lights by each of [`RigMethod::ALL`].
    pub(crate) spheres: Vec<RigSphere>,
}

/// A sphere under a rig.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RigSphere {
    pub(crate) method: RigMethod,
    /// The number of lights that were asked for; there may be fewer.
    pub(crate) asked: u32,
    pub(crate) lights: usize,
    /// The relative RMS error of the rig's irradiance, as `sample-light` reports it.
    pub(crate) irradiance: f64,
    #[serde(flatten)]
    pub(crate) errors: Errors,
}

/// The way in which a rig is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum RigMethod {
    MedianCut,
    Warped,
}

impl RigMethod {
    pub(crate) const ALL: [Self; 2] = [Self::MedianCut, Self::Warped];

    /// The name that `sample-light` has for it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::MedianCut => "median-cut",
            Self::Warped => "warped",
        }
    }
}

/// A form in which a renderer receives reflected light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Method {
    /// A few look-ups into a scale space of the light, `export-taps`.
    Taps,
    /// One reflection map, `export-reflection-map`.
    ReflectionMap,
    /// A reflection map of each part, for a material that has both: the diffuse one looked up by the normal.
    PartMaps,
    /// The 3D texture, `export-kautz-mccool`.
    KautzMccool,
    /// Twelve view maps, `export-cabral`.
    Cabral,
    /// The spherical harmonic reflection map with all light in it, `export-shrm`.
    Shrm,
    /// The spherical harmonic reflection map with the lamps as lights beside it, `export-shrm` with `lamps =
    /// "separate"`.
    ShrmSeparate,
}

impl Method {
    /// The methods: the compact map, then those that make maps for each pair, from the plainest to the most
    /// exact.
    pub(crate) const ALL: [Self; 7] = [
        Self::Taps,
        Self::ReflectionMap,
        Self::PartMaps,
        Self::KautzMccool,
        Self::Cabral,
        Self::Shrm,
        Self::ShrmSeparate,
    ];

    /// The method's name in headings.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Taps => "Compact map",
            Self::ReflectionMap => "Plain map",
            Self::PartMaps => "Plain map of each part",
            Self::KautzMccool => "Kautz-McCool",
            Self::Cabral => "Cabral",
            Self::Shrm => "SHRM",
            Self::ShrmSeparate => "SHRM with lights",
        }
    }

    /// Whether a renderer adds lights beside the map by the material's own BRDF.
    pub(crate) fn adds_lights(self) -> bool {
        matches!(self, Self::Taps | Self::ShrmSeparate)
    }

    /// The port to which the stage that writes the export can be connected. That of the plain map writes the
    /// maps of parts, too.
    pub(crate) fn port(self) -> Option<&'static str> {
        match self {
            Self::Taps => Some("taps"),
            Self::ReflectionMap => Some("reflection-map"),
            Self::PartMaps => None,
            Self::KautzMccool => Some("kautz-mccool"),
            Self::Cabral => Some("cabral"),
            Self::Shrm => Some("shrm"),
            Self::ShrmSeparate => Some("shrm-separate"),
        }
    }

    /// The kind of stage that writes the export.
    pub(crate) fn kind(self) -> &'static str {
        match self {
            Self::Taps => "export-taps",
            Self::ReflectionMap => "export-reflection-map",
            Self::PartMaps => "export-reflection-map, parts = \"separate\"",
            Self::KautzMccool => "export-kautz-mccool",
            Self::Cabral => "export-cabral",
            Self::Shrm => "export-shrm",
            Self::ShrmSeparate => "export-shrm, lamps = \"separate\"",
        }
    }
}

/// One export of a pair.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Export {
    pub(crate) method: Method,
    #[serde(flatten)]
    pub(crate) errors: Errors,
    /// The degree in the central direction.
    pub(crate) f: usize,
    /// The degree in the view that the file holds, or that its views were made from; of an SHRM of each part
    /// that of the highlight.
    pub(crate) p: usize,
    /// The bytes of the export's texels as RGBA half floats, and of its lights.
    pub(crate) bytes: u64,
    /// The bytes of the files that a connected stage exports; `None` if no stage of the export is connected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) file: Option<u64>,
    /// The textures that the bytes are made of.
    pub(crate) texture: String,
    /// The number of maps that a renderer adds: 2 of a material with two parts, unless one map holds both.
    pub(crate) maps: usize,
    /// The number of the picture's pixels of which one was measured: 1, 2, 4, 8, ...
    pub(crate) one_of: usize,
}

impl Export {
    /// The bytes by which exports are compared: of its files, or else of its texels and lights.
    pub(crate) fn size(&self) -> u64 {
        self.file.unwrap_or(self.bytes)
    }

    /// The size for people; what no file has is marked as approximate.
    pub(crate) fn size_text(&self) -> String {
        let mark = if self.file.is_some() { "" } else { "~" };
        format!("{mark}{}", size(self.size()))
    }
}

/// The bytes of the files of each of [`Method::ALL`] that the pipeline exports for a pair.
pub(crate) type FileSizes = [Option<u64>; Method::ALL.len()];

/// An export with other settings than those of the report.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Trial {
    pub(crate) change: Change,
    pub(crate) export: Export,
}

/// The settings that were changed for a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Change {
    /// No degree, tolerance or window was given: lamps are kept beside the series, and F and P are what
    /// shows.
    pub(crate) no_degree: bool,
    /// The degrees that were given, if the change was of degrees.
    pub(crate) degree: Option<[usize; 2]>,
    /// The edge of a face.
    pub(crate) resolution: Option<usize>,
    /// The errors in stops that `export-shrm` accepts, and the highest P that it tries.
    pub(crate) accept: Option<[f64; 2]>,
    pub(crate) most_p: Option<usize>,
}

/// The advised export.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Advice {
    pub(crate) method: Method,
    /// Whether the export's errors are within the limits, under every environment.
    pub(crate) good: bool,
    /// The environment under which the export is worst.
    pub(crate) environment: String,
    /// The reason in plain language.
    pub(crate) why: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_known_to_2_percent_where_they_matter() {
        let limits = Limits::new(0.15);
        let known = |p95: f64, p95_uncertainty: f64, p99: f64, p99_uncertainty: f64| {
            let errors = Errors { p95, p99, p95_uncertainty, p99_uncertainty, ..Errors::default() };
            limits.are_known(&errors)
        };
        assert!(known(1.0, 0.019, 2.0, 0.01) && !known(1.0, 0.021, 2.0, 0.01));
        // Of a small error the limit's share.
        assert!(known(0.01, 0.0029, 0.02, 0.001) && !known(0.01, 0.0031, 0.02, 0.001));
        // Far from its limit of 0.5, the second figure may be less certain.
        assert!(known(0.1, 0.001, 2.0, 0.3) && known(0.1, 0.001, 0.3, 0.05));
        assert!(!known(0.1, 0.001, 0.48, 0.02) && known(0.1, 0.001, 0.48, 0.009));
    }
}
