//! The parts of compact maps with the parameters that the kinds have by default, for reports too.

use std::sync::Arc;

use brdf::{Centre, Material};
use containers::tensors::MaterialTaps;
use engine::{Artifact, DerivedValues, Digest, Failure, Reporter};
use envmap::Environment;
use rayon::prelude::*;
use taps::{Fitted, FittedFacets, ScaleSpace, ScaleSpaceError, Widths, fit, fit_each, fit_facets, least_fit};

use crate::values::{LIGHTS, LightCount, UntilStopped, artifacts};

/// The default resolution.
pub(crate) const RESOLUTION: usize = 64;

/// The residual of taps that is accepted by default.
pub(crate) const ERROR: f64 = 0.02;

/// The scale space of an environment with the default parameters.
pub(crate) fn default_scale_space(
    environment: &Environment,
    reporter: &Reporter,
) -> Result<ScaleSpace, Failure> {
    let widths = Widths::new(RESOLUTION).unwrap_or(Widths::FINEST);
    Ok(scale_space_of(environment, widths, LIGHTS, reporter)?.0)
}

/// The scale space with the strongest lights beside it, and the number of lights that were found.
pub(crate) fn scale_space_of(
    environment: &Environment,
    widths: Widths,
    lights: LightCount,
    reporter: &Reporter,
) -> Result<(ScaleSpace, usize), Failure> {
    let lamps = match lights {
        LightCount::Most(0) => Vec::new(),
        _ => reporter.until_stopped(|stop| environment.separate_lamps(stop))?.lights,
    };
    let space = reporter.until_stopped(|stop| {
        ScaleSpace::new(environment, lights.of(&lamps), widths, stop).map_err(|error| match error {
            ScaleSpaceError::Stopped(stopped) => Failure::from(stopped),
            other => Failure::new(other.to_string()),
        })
    })?;
    Ok((space, lamps.len()))
}

/// The taps of a material with the default parameters.
pub(crate) fn default_taps(
    material: &Material,
    derived: &DerivedValues<'_>,
    reporter: &Reporter,
) -> Result<Arc<MaterialTaps>, Failure> {
    fits(material, ERROR, derived, reporter)
}

/// Whether there are taps of a material that know its tangent: it depends on it, and does not reflect in a
/// cone about it.
pub(crate) fn has_facets(material: &Material) -> bool {
    !material.is_isotropic() && material.centre() != Centre::Tangent
}

/// Fits, the one first that is the least whose residual is at most `error`, or past which more do not help.
fn chosen(material: &Material, mut others: Vec<Fitted>, error: f64) -> MaterialTaps {
    let fitted = others.remove(least_fit(&others, error));
    MaterialTaps { material: material.clone(), fitted, others, varied: None, facets: Vec::new() }
}

/// Fits of a material with several numbers of taps, of which `fitted` is the least whose residual is at most
/// `error`, or past which more of them do not help. A build fits a material once: a report compares the taps
/// that `fit-taps` made.
pub(crate) fn fits(
    material: &Material,
    error: f64,
    derived: &DerivedValues<'_>,
    reporter: &Reporter,
) -> Result<Arc<MaterialTaps>, Failure> {
    let of = Digest::of(&artifacts::Material(material.clone()).encode()?);
    derived.get("fits of taps", of, &[error.to_bits()], || {
        let made = new_fits(material, error, reporter)?;
        let bytes = artifacts::Taps(made.clone()).encode()?.len();
        Ok((made, bytes))
    })
}

fn new_fits(material: &Material, error: f64, reporter: &Reporter) -> Result<MaterialTaps, Failure> {
    let facets = facet_fits(material, &FACET_COUNTS, reporter)?;
    let others = match facets.last() {
        None => reporter.until_stopped(|stop| fit_each(material, Widths::FINEST, stop))?,
        // The mean over all turns is off by more than any number of taps.
        Some(_) => vec![reporter.until_stopped(|stop| fit(material, MEAN_TAPS, Widths::FINEST, stop))?],
    };
    Ok(MaterialTaps { facets, ..chosen(material, others, error) })
}

/// Fits that know the tangent, with these numbers of taps; none of a material that has none.
pub(crate) fn facet_fits(
    material: &Material,
    counts: &[usize],
    reporter: &Reporter,
) -> Result<Vec<FittedFacets>, Failure> {
    if !has_facets(material) {
        return Ok(Vec::new());
    }
    let fits = reporter.until_stopped(|stop| {
        counts
            .par_iter()
            .map(|taps| fit_facets(material, *taps, Widths::FINEST, stop))
            .collect::<Result<_, _>>()
    })?;
    Ok(fits)
}

/// The taps of materials that depend on their tangent, and of their mean over all turns.
const FACET_COUNTS: [usize; 2] = [4, 8];
const MEAN_TAPS: usize = 4;
