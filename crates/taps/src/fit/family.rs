//! The fit of a family of lobes, such as those of all roughnesses, by taps that change as smoothly from
//! member to member as the lobes do, so that a look-up may interpolate between them.
//!
//! One member is fitted by itself. From there outward, each starts at its neighbour's taps,
//! widened as the lobe is, and is pulled to them. Then every other member is fitted again, pulled to the mean
//! of its neighbours, and the others after them.

use brdf::{Material, Part, ScaleBias, Standard, StandardParameters, Visibility, environment_brdf};
use rayon::prelude::*;
use sh::{Stop, Stopped};

use super::problem::{Problem, row_cosine};
use super::smooth::{Pull, Smooth};
use super::view::ViewFit;
use super::{COLOURED, LobeFit, MATTE, MATTE_TAPS};
use crate::table::{ROWS, TapRow, TapTable};
use crate::varied::{VariedTable, Weights};
use crate::widths::Widths;

/// How strongly a member is pulled to its neighbours.
const PULL: f64 = 0.5;

/// The member that is fitted first, as a share of all: a lobe that is neither a mirror nor cut by the
/// horizon.
const FIRST: f64 = 0.3;

/// How often all members are fitted again.
const SWEEPS: usize = 3;

/// The reflectance head on of the least reflective surfaces, such as water. A table by reflectance is fitted
/// to it and to 1, between which it is a mean of both with weights of 0 and more.
const LEAST_REFLECTANCE: f64 = 0.02;

/// How much the highlight of a surface with F = 1 weighs beside that of the least reflective one. Taps fit it
/// better the rougher it is, and the other does not spoil that.
fn importance(roughness: f64) -> f64 {
    1.5 + 8.0 * math::powi(roughness, 3)
}

/// Taps over a parameter and how well they fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedVaried {
    /// The taps.
    pub table: VariedTable,
    /// The root of the mean squared residual of each table under spots of light, in stops.
    pub rms: Vec<f64>,
}

/// [`fit`](super::fit) of materials that differ in one parameter, in even steps over its `range`: so many
/// taps for each highlight, which change smoothly from material to material. `None` if there are fewer than
/// two materials, or some have parts that others lack.
///
/// # Errors
/// If the work was stopped.
pub fn fit_varied(
    materials: &[Material],
    range: [f64; 2],
    taps: usize,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<Option<FittedVaried>, Stopped> {
    let gloss = |material: &Material| -> Vec<Material> {
        let gloss = material.part(Part::Specular);
        gloss.iter().flat_map(|gloss| gloss.leaves()).cloned().collect()
    };
    let glosses: Vec<Vec<Material>> = materials.iter().map(gloss).collect();
    let mattes: Vec<Material> =
        materials.iter().filter_map(|material| material.part(Part::Diffuse)).collect();
    let layers = glosses.first().map_or(0, Vec::len);
    if glosses.iter().any(|gloss| gloss.len() != layers) || ![0, materials.len()].contains(&mattes.len()) {
        return Ok(None);
    }
    let mut families = Vec::new();
    for layer in 0..layers {
        let members: Vec<Material> = glosses.iter().map(|gloss| gloss[layer].clone()).collect();
        families.push(fit_colours(&members, taps, widths, stop)?);
    }
    if !mattes.is_empty() {
        let mut family = fit_colours(&mattes, 0, widths, stop)?;
        if family.iter().any(|member| member.rms() > MATTE) {
            family = fit_colours(&mattes, taps.min(MATTE_TAPS), widths, stop)?;
        }
        families.push(family);
    }
    let none = || LobeFit { rows: vec![TapRow::default(); ROWS], ..LobeFit::default() };
    let mut whole: Vec<LobeFit> = materials.iter().map(|_| none()).collect();
    for family in families {
        whole.iter_mut().zip(family).for_each(|(whole, member)| whole.add(member));
    }
    Ok(joined(whole, range, Weights::Colour))
}

/// The highlight of `standard`, and of every engine's metals and dielectrics, over roughness: `rows` tables,
/// from roughness 0 to 1, whose weights are [`Weights::ScaleBias`]. Toward each view they add up to
/// [`environment_brdf`] with [`Visibility::Correlated`].
///
/// # Errors
/// If the work was stopped.
///
/// # Panics
/// If there are fewer than two rows.
pub fn fit_by_reflectance(
    rows: usize,
    taps: usize,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<FittedVaried, Stopped> {
    assert!(rows >= 2, "a table over roughness has two rows or more");
    let roughness = |row: usize| (row as f64 / (rows - 1) as f64).max(0.01);
    let highlight = |row: usize| {
        let parameters = StandardParameters {
            base_color: [1.0, LEAST_REFLECTANCE, LEAST_REFLECTANCE],
            metallic: 1.0,
            roughness: roughness(row),
            ..StandardParameters::default()
        };
        let metal = Standard::new(parameters).ok().map(Material::Standard);
        let highlight = metal.and_then(|metal| metal.part(Part::Specular));
        highlight.unwrap_or_else(|| unreachable!("a metal of any roughness has a highlight"))
    };
    let members: Vec<Material> = (0..rows).map(highlight).collect();
    let problems = problems(&members, taps, widths, stop)?;
    let fits: Vec<Vec<Vec<ViewFit<'_>>>> = (problems.par_iter().enumerate())
        .map(|(row, problem)| {
            let mut bright = problem.fits(Some(0));
            bright.iter_mut().for_each(|fit| fit.importance = importance(roughness(row)));
            vec![bright, problem.fits(Some(1))]
        })
        .collect();
    let places = places(&problems, &fits, stop)?;
    let member = |(row, problem): (usize, &Problem<'_>)| {
        let lobes = [0, 1].map(|lobe| places[row].lobe(lobe));
        let albedo = |cosine: f64| {
            let ScaleBias { scale, bias } =
                environment_brdf(Visibility::Correlated, roughness(row), cosine.max(1e-3));
            let dull = LEAST_REFLECTANCE * scale + bias;
            [scale + bias, dull, dull]
        };
        let albedos: Vec<[f64; 3]> = (0..ROWS).map(|row| albedo(row_cosine(row))).collect();
        let [bright, dull] = &lobes;
        LobeFit {
            rows: problem.rows([bright, dull, dull], &albedos),
            squares: lobes.iter().zip(&fits[row]).map(|(lobe, fits)| lobe.cost(fits)).sum(),
            residuals: fits[row].iter().flatten().map(ViewFit::len).sum(),
        }
    };
    let mut whole: Vec<LobeFit> = problems.par_iter().enumerate().map(member).collect();
    let by_reflectance = |[bright, dull, _]: [f64; 3]| {
        let scale = (bright - dull) / (1.0 - LEAST_REFLECTANCE);
        [scale, bright - scale, 0.0]
    };
    for row in whole.iter_mut().flat_map(|fit| &mut fit.rows) {
        row.taps.iter_mut().for_each(|tap| tap.weight = by_reflectance(tap.weight));
        row.normals.iter_mut().for_each(|tap| tap.weight = by_reflectance(tap.weight));
    }
    stop.check()?;
    let joined = joined(whole, [0.0, 1.0], Weights::ScaleBias);
    Ok(joined.unwrap_or_else(|| unreachable!("the rows were made alike")))
}

fn joined(fits: Vec<LobeFit>, range: [f64; 2], weights: Weights) -> Option<FittedVaried> {
    let rms = fits.iter().map(LobeFit::rms).collect();
    let tables = fits.into_iter().map(|fit| TapTable::from_rows(fit.rows)).collect();
    Some(FittedVaried { table: VariedTable::new(range, tables, weights)?, rms })
}

fn problems<'a>(
    members: &'a [Material],
    taps: usize,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<Vec<Problem<'a>>, Stopped> {
    members.par_iter().map(|member| Problem::new(member, taps, widths, stop)).collect()
}

/// Fits one lobe of each member, in its colours.
fn fit_colours(
    members: &[Material],
    taps: usize,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<Vec<LobeFit>, Stopped> {
    let problems = problems(members, taps, widths, stop)?;
    let fits: Vec<Vec<_>> = problems.par_iter().map(|problem| vec![problem.fits(None)]).collect();
    let places = places(&problems, &fits, stop)?;
    let is_of_one_colour = problems.iter().all(Problem::is_of_one_colour);
    let costs: Vec<f64> = places.iter().zip(&fits).map(|(place, fits)| place.cost(&fits[0])).collect();
    // A channel has weights of its own at every member, or at none, for the family has to be smooth.
    let channels: Vec<Vec<(Smooth, f64)>> = (0..3)
        .map(|channel| {
            let whole = || places.iter().cloned().zip(costs.iter().copied()).collect();
            if is_of_one_colour {
                return Ok(whole());
            }
            stop.check()?;
            let fits: Vec<_> = problems.par_iter().map(|problem| problem.fits(Some(channel))).collect();
            let own: Vec<f64> = places.iter().zip(&fits).map(|(place, fits)| place.cost(fits)).collect();
            if own.iter().zip(&costs).all(|(own, cost)| *own <= COLOURED * cost) {
                return Ok(places.iter().cloned().zip(own).collect());
            }
            let member = |((place, fits), problem): ((&Smooth, &Vec<ViewFit<'_>>), &Problem<'_>)| {
                let smooth = place.with_weights_of(fits, pull_to(place, problem));
                let cost = smooth.cost(fits);
                (smooth, cost)
            };
            Ok(places.par_iter().zip(&fits).zip(&problems).map(member).collect())
        })
        .collect::<Result<_, Stopped>>()?;
    let member = |(member, problem): (usize, &Problem<'_>)| {
        let colours = [0, 1, 2].map(|channel| &channels[channel][member]);
        LobeFit {
            rows: problem.rows(colours.map(|(smooth, _)| smooth), &problem.albedos()),
            squares: colours.iter().map(|(_, cost)| cost).sum::<f64>() / 3.0,
            residuals: fits[member].iter().flatten().map(ViewFit::len).sum(),
        }
    };
    Ok(problems.iter().enumerate().map(member).collect())
}

fn pull_to<'a>(to: &'a Smooth, problem: &Problem<'_>) -> Pull<'a> {
    Pull { to: Some(to), strength: PULL, width: problem.width() }
}

/// The taps of all members, each of which has one lobe, or several whose taps have the same places.
fn places(
    problems: &[Problem<'_>],
    fits: &[Vec<Vec<ViewFit<'_>>>],
    stop: Stop<'_>,
) -> Result<Vec<Smooth>, Stopped> {
    let start = (FIRST * problems.len() as f64) as usize;
    let (first, _) = problems[start].solve(&fits[start][0], stop)?;
    let first = first.refined(&fits[start], Pull::NONE);
    // The taps of a member as those of another would be.
    let widened = |smooth: &Smooth, from: usize, to: usize| {
        smooth.widened(problems[to].width() / problems[from].width())
    };
    let outward = |members: Vec<usize>| -> Result<Vec<Smooth>, Stopped> {
        let (mut before, mut last) = (first.clone(), start);
        let mut found = Vec::with_capacity(members.len());
        for member in members {
            stop.check()?;
            let near = widened(&before, last, member);
            before = near.refined(&fits[member], pull_to(&near, &problems[member]));
            last = member;
            found.push(before.clone());
        }
        Ok(found)
    };
    let (down, up) = rayon::join(
        || outward((0..start).rev().collect()),
        || outward((start + 1..problems.len()).collect()),
    );
    let mut places: Vec<Smooth> = down?.into_iter().rev().chain([first.clone()]).chain(up?).collect();
    for _ in 0..SWEEPS {
        for parity in 0..2 {
            stop.check()?;
            let again = |member: usize| {
                let near = |other: usize| widened(&places[other], other, member);
                let neighbours = match (member.checked_sub(1), member + 1) {
                    (Some(before), after) if after < places.len() => near(before).mean(&near(after)),
                    (Some(before), _) => near(before),
                    (None, after) => near(after),
                };
                let pull = pull_to(&neighbours, &problems[member]);
                (member, places[member].refined(&fits[member], pull))
            };
            let members: Vec<usize> = (parity..places.len()).step_by(2).collect();
            let found: Vec<_> = members.into_par_iter().map(again).collect();
            found.into_iter().for_each(|(member, smooth)| places[member] = smooth);
        }
    }
    Ok(places)
}
