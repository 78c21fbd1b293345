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
mod smooth;
mod spots;
mod view;

use std::f64::consts::FRAC_PI_2;

use brdf::{Material, Part};
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::facets::{FacetNode, FacetTable, view_at};
use crate::table::{NormalTap, ROWS, Tap, TapRow, TapTable};
use crate::widths::Widths;
use facets::{FacetFit, fit_facet_lobe};
pub use family::{FittedVaried, fit_by_reflectance, fit_varied};
use lobe::Lobe;
pub(crate) use lobe::{turns, width as lobe_width};
use smooth::{Pull, Smooth};
use spots::Spots;
use view::{Shape, ViewFit};

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

/// The widths of the first taps, as shares of the lobe's: from the narrowest to the widest. The better fit
/// wins.
const STARTS: [[f64; 2]; 2] = [[0.6, 6.0], [0.5, 2.0]];

/// The root mean square, in stops, up to which a tap about the normal is enough for a matte part.
const MATTE: f64 = 0.02;

/// The taps of a matte part for which it is not.
const MATTE_TAPS: usize = 2;

/// A channel whose squared residuals are more than this many times those of all channels together has weights
/// of its own.
const COLOURED: f64 = 1.1;

/// The last view, 88 degrees from the normal: beyond, taps stay as they are.
const LAST_VIEW: f64 = 0.9985;

/// The views that are fitted, in radians from the normal: as a ball shows them, and three grazing ones.
fn views() -> Vec<f64> {
    const COUNT: usize = 20;
    let even = (0..COUNT).map(|view| view as f64 / COUNT as f64);
    even.chain([0.975, 0.992, LAST_VIEW]).map(|squared| math::asin(squared.sqrt())).collect()
}

/// Fits `taps` taps for each highlight of a material, and one about the normal. A matte base, and any other
/// part whose light is taken about the normal, is one more tap about the normal, and if it is not as even as
/// a white wall, as that of a rough or dusty surface, two taps. A material that depends on the direction of
/// its tangent is replaced by its mean over all turns about the normal.
///
/// # Errors
/// If the work was stopped.
pub fn fit(material: &Material, taps: usize, widths: Widths, stop: Stop<'_>) -> Result<Fitted, Stopped> {
    let mut whole = LobeFit { rows: vec![TapRow::default(); ROWS], squares: 0.0, residuals: 0 };
    if let Some(gloss) = material.part(Part::Specular) {
        for layer in gloss.leaves() {
            whole.add(fit_lobe(layer, taps, widths, stop)?);
        }
    }
    if let Some(matte) = material.part(Part::Diffuse) {
        whole.add(fit_matte(&matte, taps, widths, stop)?);
    }
    Ok(Fitted { rms: whole.rms(), table: TapTable::from_rows(whole.rows) })
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
#[derive(Default)]
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

    /// The same taps as facets.
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
    counts.par_iter().map(|taps| fit(material, *taps, widths, stop)).collect()
}

/// Of the fits of [`fit_each`], the index of the least whose residual is at most `error`, in stops, or which
/// the next number of taps does not lower by a quarter.
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
    let all = problem.fits(None);
    let (best, cost) = problem.solve(&all, stop)?;
    let is_of_one_colour = problem.lobes.iter().all(Lobe::is_of_one_colour);
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
    let rows = problem.rows(colours.each_ref().map(|(smooth, _)| smooth), None);
    Ok(LobeFit { rows, squares, residuals })
}

/// A lobe that is to be fitted.
struct Problem<'a> {
    material: &'a Material,
    shape: Shape,
    widths: Widths,
    /// The width of the lobe, in radians.
    width: f64,
    spots: Vec<Spots>,
    /// The views, in radians from the normal, and the lobe toward each.
    thetas: Vec<f64>,
    lobes: Vec<Lobe>,
}

impl<'a> Problem<'a> {
    fn new(material: &'a Material, taps: usize, widths: Widths, stop: Stop<'_>) -> Result<Self, Stopped> {
        let shape = Shape { taps, normals: 1, levels: widths.len() };
        let width = if taps == 0 { 0.5 } else { lobe::width(material) };
        let spots = spots::spots(width, widths);
        let thetas = views();
        let lobes = thetas.par_iter().map(|theta| Lobe::new(material, *theta, width)).collect();
        stop.check()?;
        Ok(Self { material, shape, widths, width, spots, thetas, lobes })
    }

    /// The fits at all views, of a channel or of the sum of all.
    fn fits(&self, channel: Option<usize>) -> Vec<ViewFit<'_>> {
        let fit = |(theta, lobe): (&f64, &Lobe)| ViewFit::new(*theta, lobe, channel, &self.spots, self.shape);
        self.thetas.par_iter().zip(&self.lobes).map(fit).collect()
    }

    /// The parameters of the first view from which a fit starts, with taps whose widths are from the least to
    /// the greatest of these shares of the lobe's.
    fn start(&self, [least, most]: [f64; 2]) -> Vec<f64> {
        let Shape { taps, normals, .. } = self.shape;
        let weight = -math::ln((taps + normals) as f64);
        let tap = |tap: usize| {
            let part = if taps == 1 { 0.3 } else { tap as f64 / (taps - 1) as f64 };
            [0.0, self.widths.place(self.width * least * math::pow(most / least, part)), weight]
        };
        (0..taps).flat_map(tap).chain(std::iter::repeat_n([1.3, weight], normals).flatten()).collect()
    }

    /// The taps that fit best, and their cost.
    fn solve(&self, fits: &[ViewFit<'_>], stop: Stop<'_>) -> Result<(Smooth, f64), Stopped> {
        let tries = STARTS.par_iter().map(|shares| {
            let mut before = self.start(*shares);
            let mut parameters = Vec::with_capacity(fits.len());
            for fit in fits {
                stop.check()?;
                before = fit.solve(&before);
                parameters.push(before.clone());
            }
            let smooth = Smooth::new(self.shape, fits, &parameters);
            let cost = smooth.cost(fits);
            Ok((smooth, cost))
        });
        let tries = tries.collect::<Result<Vec<_>, Stopped>>()?;
        let best = tries.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best.unwrap_or_else(|| unreachable!("there are starts")))
    }

    /// The rows of the table with the taps of each colour. Without an albedo by the cosine from the normal it
    /// is that of the lobe.
    fn rows(&self, colours: [&Smooth; 3], albedo: Option<&(dyn Fn(f64) -> [f64; 3] + Sync)>) -> Vec<TapRow> {
        let row = |row: usize| {
            let cosine = 1.0 - row as f64 / (ROWS - 1) as f64;
            let of_lobe = || {
                let theta = math::acos(cosine).min(FRAC_PI_2 - 1e-3);
                Lobe::new(self.material, theta, self.width).albedo()
            };
            let albedo = albedo.map_or_else(of_lobe, |albedo| albedo(cosine));
            row_of(math::acos(cosine), albedo, colours, self.widths)
        };
        (0..ROWS).into_par_iter().map(row).collect()
    }
}

/// The row of the table toward a view: the places of the taps, and in each colour their weights, which add up
/// to the albedo.
fn row_of(theta: f64, albedo: [f64; 3], colours: [&Smooth; 3], widths: Widths) -> TapRow {
    let shape = colours[0].shape();
    let parameters = colours.map(|smooth| smooth.at(theta.min(math::asin(LAST_VIEW.sqrt()))));
    let weights: Vec<usize> = shape.weights().collect();
    let scales: [f64; 3] = std::array::from_fn(|channel| {
        albedo[channel] / weights.iter().map(|index| math::exp(parameters[channel][*index])).sum::<f64>()
    });
    let mut weights = weights
        .into_iter()
        .map(|index| std::array::from_fn(|channel| scales[channel] * math::exp(parameters[channel][index])));
    let mut weight = || weights.next().unwrap_or_default();
    let (taps, normals) = parameters[0].split_at(3 * shape.taps);
    TapRow {
        taps: (taps.as_chunks::<3>().0.iter())
            .map(|[delta, x, _]| Tap { delta: *delta, std: widths.std_at(*x), weight: weight() })
            .collect(),
        normals: (normals.as_chunks::<2>().0.iter())
            .map(|[x, _]| NormalTap { y: x / (crate::NORMAL_KERNELS - 1) as f64, weight: weight() })
            .collect(),
    }
}
