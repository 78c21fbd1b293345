//! What the kinds that bake have in common: how many paths they trace, and what they say of the errors.

use engine::serde_json::{self, json};
use engine::{Diagnostic, Failure, Parameter, Reporter, Value, ValueKind, parameters, unexpected};
use probes::{BakeOptions, ProbePlaces};
use sh::Degree;

/// A number of reflections, or all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bounces {
    /// No reflection is left out.
    All,
    /// At most this many.
    Most(u32),
}

/// The most reflections that can be named.
const MOST_BOUNCES: usize = 64;

impl Parameter for Bounces {
    fn expected() -> String {
        format!("an integer from 0 to {MOST_BOUNCES} or \"all\"")
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        match &value.kind {
            ValueKind::String(word) if word == "all" => Ok(Self::All),
            _ => match usize::parse(value) {
                Ok(count) if count <= MOST_BOUNCES => Ok(Self::Most(count as u32)),
                _ => Err(unexpected(value, &Self::expected())),
            },
        }
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::All => json!("all"),
            Self::Most(count) => json!(count),
        }
    }

    fn schema() -> serde_json::Value {
        json!({ "type": ["integer", "string"], "pattern": "^all$", "minimum": 0, "maximum": MOST_BOUNCES })
    }
}

parameters! {
    /// The parameters that the kinds share which trace paths.
    pub(crate) struct Baking {
        /// The most reflections that a path has; `"all"` leaves none out.
        bounces: Bounces = Bounces::All,
        /// The paths of a probe.
        #[range(16..=16777216)]
        paths: usize = 4096,
        /// The standard error of a probe's irradiance, as a share of it, until which its paths are doubled.
        /// Default: all probes have `paths`.
        #[range(0.0001..=1.0)]
        error: Option<f64> = None,
        /// With `error`: the most paths of a probe.
        #[range(16..=67108864)]
        paths_most: usize = 1048576,
        /// Another seed makes other errors of the same size.
        #[range(0..=4294967295)]
        seed: usize = 0,
    }
}

impl Baking {
    /// The errors of combinations of them.
    pub(crate) fn check(&self) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if self.error.is_some() && self.paths_most < self.paths {
            errors.push(("paths-most", format!("is below paths, which is {}", self.paths)));
        }
        errors
    }

    /// The options of the kernel, for light of a degree under a sky of another.
    pub(crate) fn options(&self, degree: usize, sky: usize) -> Result<BakeOptions, Failure> {
        Ok(BakeOptions {
            degree: Degree::new(degree)?,
            sky: Degree::new(sky)?,
            bounces: match self.bounces {
                Bounces::All => None,
                Bounces::Most(count) => Some(count),
            },
            paths: self.paths as u32,
            error: self.error.map(|error| error as f32),
            most_paths: self.paths_most as u32,
            seed: self.seed as u64,
        })
    }

    /// Notes how exact `what` is; a wanted error that probes missed is a warning, which names them.
    pub(crate) fn report(&self, what: &str, errors: &[f32], places: &ProbePlaces, reporter: &Reporter) {
        let own: Vec<usize> = (0..errors.len()).filter(|probe| places.is_valid(*probe)).collect();
        let Some(worst) = own.iter().copied().max_by(|a, b| errors[*a].total_cmp(&errors[*b])) else {
            return;
        };
        let squares = own.iter().map(|probe| f64::from(errors[*probe]) * f64::from(errors[*probe]));
        let mean = (squares.sum::<f64>() / own.len() as f64).sqrt();
        reporter.note(format!(
            "{what}: the standard error of irradiance is {:.2} % (RMS), {:.2} % at the worst, probe {}",
            100.0 * mean,
            100.0 * errors[worst],
            place_text(places, worst)
        ));
        let Some(wanted) = self.error else { return };
        let missed: Vec<usize> = own.into_iter().filter(|probe| f64::from(errors[*probe]) > wanted).collect();
        if !missed.is_empty() {
            reporter.warn(format!(
                "{what}: {} of {} probes missed error = {wanted} with {} paths: {}; raise `paths-most`, or allow a \
                 larger error",
                missed.len(),
                places.len(),
                self.paths_most,
                listed(missed.len(), missed.iter().map(|probe| place_text(places, *probe)))
            ));
            if missed.len() > LISTED {
                let named = |probe: &usize| format!("{probe} {:.2} %", 100.0 * errors[*probe]);
                let all = first(NAMED, missed.len(), missed.iter().map(named));
                reporter.note(format!("{what}: the probes that missed error = {wanted}: {all}"));
            }
        }
    }
}

/// The names that a warning lists, and those of a note.
const LISTED: usize = 8;
const NAMED: usize = 200;

/// The first names of a list of `count`, and how many more there are.
pub(crate) fn listed(count: usize, names: impl Iterator<Item = String>) -> String {
    first(LISTED, count, names)
}

/// The first `most` names of a list of `count`, and how many more there are.
pub(crate) fn first(most: usize, count: usize, names: impl Iterator<Item = String>) -> String {
    let first = names.take(most).collect::<Vec<_>>().join(", ");
    if count > most { format!("{first} and {} more", count - most) } else { first }
}

/// A probe in a message: its number, its volume and its place in it.
pub(crate) fn place_text(places: &ProbePlaces, probe: usize) -> String {
    let mut first = 0;
    for volume in places.volumes() {
        if probe < first + volume.len() {
            let [x, y, z] = volume.cell(probe - first);
            return format!("{probe} ({} [{x}, {y}, {z}])", volume.name);
        }
        first += volume.len();
    }
    let [x, y, z] = places.grid().get(probe).copied().unwrap_or_default();
    format!("{probe} (point [{x:.2}, {y:.2}, {z:.2}])")
}
