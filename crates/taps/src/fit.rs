//! Fits the taps of a material to its BRDF alone: no environment is looked at.
//!
//! At some views as a ball shows them, what the taps make of round spots of light is compared with what the
//! BRDF reflects of them, in stops. First each view is fitted by itself, from the one before it; then each
//! parameter becomes a polynomial in 1 - cos(theta_v), all views at once, so that the table can be
//! interpolated. Weights are those of a lobe whose albedo is 1, times the exact directional albedo toward
//! each view and in each colour.

mod facets;
mod family;
mod least_squares;
mod lobe;
mod problem;
mod residuals;
mod smooth;
mod spots;
mod view;

use brdf::{Material, Part};
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::facets::{FacetNode, FacetTable, view_at};
use crate::table::{ROWS, TapRow, TapTable};
use crate::widths::Widths;
use facets::{FacetFit, fit_facet_lobe};
pub use family::{FittedVaried, fit_by_reflectance, fit_varied};
pub(crate) use lobe::{turns, width as lobe_width};
use problem::Problem;
use smooth::Pull;
use view::ViewFit;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Taps and how well they fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The taps.
    pub table: TapTable,
    /// The root of the mean squared residual under spots of light, in stops.
    pub rms: f64,
}

/// The root mean square, in stops, up to which a tap about the normal is enough for a matte part.
const MATTE: f64 = 0.02;

/// The taps of a matte part for which it is not.
const MATTE_TAPS: usize = 2;

/// A channel whose squared residuals are more than this many times those of all channels together has weights
/// of its own.
const COLOURED: f64 = 1.1;

/// Fits `taps` taps for each highlight of a material, and one about the normal. A matte base, and any other
/// part whose light is taken about the normal, is one more tap about the normal, and if it is not as even as
/// a white wall, as that of a rough or dusty surface, two taps. A material that depends on the direction of
/// its tangent is replaced by its mean over all turns about the normal.
///
/// # Errors
/// If the work was stopped.
pub fn fit(material: &Material, taps: usize, widths: Widths, stop: Stop<'_>) -> Result<Fitted, Stopped> {
    let mut fits = fit_counts(material, &[taps], widths, stop)?;
    Ok(fits.pop().unwrap_or_else(|| unreachable!("there is a fit for each number")))
}

/// [`fit`] with each of these numbers of taps, of which none is 0 unless it is the only one.
fn fit_counts(
    material: &Material,
    counts: &[usize],
    widths: Widths,
    stop: Stop<'_>,
) -> Result<Vec<Fitted>, Stopped> {
    let gloss = material.part(Part::Specular);
    let problem = |layer| {
        let problem = Problem::new(layer, counts[0], widths, stop)?;
        let albedos = problem.albedos();
        Ok((problem, albedos))
    };
    let layers = gloss.iter().flat_map(Material::leaves).map(problem).collect::<Result<Vec<_>, _>>()?;
    let matte = material.part(Part::Diffuse);
    let even = matte.as_ref().map(|matte| fit_lobe(matte, 0, widths, stop)).transpose()?;
    let fit = |taps: &usize| {
        let mut whole = LobeFit { rows: vec![TapRow::default(); ROWS], squares: 0.0, residuals: 0 };
        for (layer, albedos) in &layers {
            whole.add(fit_problem(&layer.with_taps(*taps), albedos, stop)?);
        }
        if let (Some(matte), Some(even)) = (&matte, &even) {
            let is_enough = even.rms() <= MATTE;
            whole.add(if is_enough {
                even.clone()
            } else {
                fit_lobe(matte, (*taps).min(MATTE_TAPS), widths, stop)?
            });
        }
        Ok(Fitted { rms: whole.rms(), table: TapTable::from_rows(whole.rows) })
    };
    counts.par_iter().map(fit).collect()
}

/// Facet taps and how well they fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedFacets {
    /// The taps.
    pub table: FacetTable,
    /// The root of the mean squared residual under spots of light, in stops.
    pub rms: f64,
}

/// Fits `taps` facet taps for each highlight of a material that depends on the direction of its tangent, and
/// one about the normal. Highlights that do not depend on it, and matte parts, have the taps of [`fit`]; a
/// material about the tangent, such as a fibre, is replaced by its mean over all turns there.
///
/// # Errors
/// If the work was stopped.
pub fn fit_facets(
    material: &Material,
    taps: usize,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<FittedFacets, Stopped> {
    let is_quarter = material.is_orthotropic();
    let nodes = vec![FacetNode::default(); FacetTable::nodes_of(is_quarter)];
    let mut whole = FacetFit { nodes, squares: 0.0, residuals: 0 };
    if let Some(gloss) = material.part(Part::Specular) {
        for layer in gloss.leaves() {
            if layer.turns() == 1 {
                whole.add(fit_lobe(layer, taps, widths, stop)?.tilted(is_quarter));
            } else {
                whole.add(fit_facet_lobe(layer, taps, is_quarter, widths, stop)?);
            }
        }
    }
    if let Some(matte) = material.part(Part::Diffuse) {
        whole.add(fit_matte(&matte, taps, widths, stop)?.tilted(is_quarter));
    }
    Ok(FittedFacets { rms: whole.rms(), table: FacetTable::from_nodes(whole.nodes) })
}

/// Fits a matte part: by a tap about the normal, or by a few taps if that is not enough.
fn fit_matte(matte: &Material, taps: usize, widths: Widths, stop: Stop<'_>) -> Result<LobeFit, Stopped> {
    let fitted = fit_lobe(matte, 0, widths, stop)?;
    if fitted.rms() > MATTE { fit_lobe(matte, taps.min(MATTE_TAPS), widths, stop) } else { Ok(fitted) }
}

/// The taps of one lobe, or of several.
#[derive(Clone, Default)]
struct LobeFit {
    rows: Vec<TapRow>,
    /// The sum of the squared residuals, in stops.
    squares: f64,
    /// The number of residuals.
    residuals: usize,
}

impl LobeFit {
    /// Adds the taps of another lobe.
    fn add(&mut self, other: Self) {
        self.squares += other.squares;
        self.residuals += other.residuals;
        for (row, added) in self.rows.iter_mut().zip(other.rows) {
            row.taps.extend(added.taps);
            row.normals.extend(added.normals);
        }
    }

    fn rms(&self) -> f64 {
        (self.squares / self.residuals.max(1) as f64).sqrt()
    }

    /// The fit with each tap as a facet that leans toward the viewer by half of its delta.
    fn tilted(self, is_quarter: bool) -> FacetFit {
        let table = TapTable::from_rows(self.rows);
        let node = |index| FacetNode::from_row(&table, view_at(FacetTable::place(is_quarter, index)));
        let nodes = (0..FacetTable::nodes_of(is_quarter)).map(node).collect();
        FacetFit { nodes, squares: self.squares, residuals: self.residuals }
    }
}

/// The numbers of taps that [`fit_each`] tries.
const TRIED: [usize; 6] = [1, 2, 3, 4, 6, 8];

/// The next number of taps has to lower the residual to this share to be worth its cost.
const WORTH: f64 = 0.75;

/// [`fit`] with 1, 2, 3, 4, 6 and 8 taps; one fit if a material has no highlight, since it has the same taps
/// always.
///
/// # Errors
/// If the work was stopped.
pub fn fit_each(material: &Material, widths: Widths, stop: Stop<'_>) -> Result<Vec<Fitted>, Stopped> {
    let counts = if material.part(Part::Specular).is_some() { &TRIED[..] } else { &TRIED[..1] };
    fit_counts(material, counts, widths, stop)
}

/// The index of the fit with the fewest taps, among fits with more and more of them ([`fit_each`]), whose
/// residual is at most `error`, in stops, or which the next number of taps does not lower by a quarter.
pub fn least_fit(fits: &[Fitted], error: f64) -> usize {
    let is_enough = |pair: &[Fitted]| pair[0].rms <= error || pair[1].rms > WORTH * pair[0].rms;
    fits.windows(2).position(is_enough).unwrap_or(fits.len().saturating_sub(1))
}

/// The least widths of a scale space that show the highlights of a material as sharp as they are.
pub fn widths_for(material: &Material) -> Widths {
    let gloss = material.part(Part::Specular);
    let leaves = gloss.iter().flat_map(Material::leaves).map(lobe_width);
    Widths::for_highlight(leaves.fold(f64::INFINITY, f64::min))
}

/// Fits one lobe by so many taps between levels, and one about the normal.
fn fit_lobe(material: &Material, taps: usize, widths: Widths, stop: Stop<'_>) -> Result<LobeFit, Stopped> {
    let problem = Problem::new(material, taps, widths, stop)?;
    fit_problem(&problem, &problem.albedos(), stop)
}

/// Fits the taps of a problem in each colour.
fn fit_problem(problem: &Problem<'_>, albedos: &[[f64; 3]], stop: Stop<'_>) -> Result<LobeFit, Stopped> {
    let all = problem.fits(None);
    let (best, cost) = problem.solve(&all, stop)?;
    let is_of_one_colour = problem.is_of_one_colour();
    let colours = [0, 1, 2].map(|channel| {
        if is_of_one_colour {
            return (best.clone(), cost);
        }
        let fits = problem.fits(Some(channel));
        let own = best.cost(&fits);
        let (smooth, own) = if own > COLOURED * cost {
            let smooth = best.with_weights_of(&fits, Pull::NONE);
            let own = smooth.cost(&fits);
            (smooth, own)
        } else {
            (best.clone(), own)
        };
        (smooth, own)
    });
    let squares = colours.iter().map(|(_, cost)| cost).sum::<f64>() / 3.0;
    let residuals = all.iter().map(ViewFit::len).sum();
    let rows = problem.rows(colours.each_ref().map(|(smooth, _)| smooth), albedos);
    Ok(LobeFit { rows, squares, residuals })
}
