//! What the kinds that take a series as it is, cell by cell, require of it.

use engine::{Failure, Reporter};
use sh::{Degree, Light, Lighting};

use crate::values::percent;

/// The highest degree: tables of the next power of two would have gigabytes.
const MAX_DEGREE: usize = 255;

/// Warns of the light that is beside the series, and not `done`: sampled, for example.
pub(crate) fn warn_of_lights(lighting: &Lighting, done: &str, reporter: &Reporter) {
    if lighting.lights.is_empty() {
        return;
    }
    let flux: f64 = lighting.lights.iter().flat_map(Light::flux).sum();
    let whole = lighting.mean() * 3.0 * 4.0 * std::f64::consts::PI;
    let share =
        if whole > 0.0 { format!(" ({} of the light)", percent(flux / whole)) } else { String::new() };
    let lights = match lighting.lights.len() {
        1 => "1 light beside the series is".into(),
        count => format!("{count} lights beside the series are"),
    };
    reporter.warn(format!(
        "{lights} not {done}{share}; set lamps = \"series\" in project-sh, or connect the \
         environment itself"
    ));
}

/// Refuses a series of a higher degree than [`MAX_DEGREE`]; `kind` made it.
pub(crate) fn check_degree(degree: Degree, kind: &str) -> Result<(), Failure> {
    if degree.get() <= MAX_DEGREE {
        return Ok(());
    }
    let failure = Failure::new(format!(
        "the series has degree {}, above {MAX_DEGREE}, the highest whose cells have a table",
        degree.get()
    ));
    Err(failure.help(format!("set degree = {MAX_DEGREE} or less in {kind}")))
}
