//! Fits facet taps to materials that depend on the direction of their tangent.
//!
//! As for taps about the reflection vector, what taps make of round spots of light is compared with what the
//! BRDF reflects of them, in stops, toward views in a fan about the normal. The slopes of the facets hardly
//! change with the view. The fit therefore begins with taps that fit the lobe seen head on, and lets each
//! parameter become a polynomial over the disc of views, of a low degree first.

mod lobe;
mod smooth;
mod view;

use std::f64::consts::{FRAC_PI_2, TAU};

use brdf::{Material, Part};
use rayon::prelude::*;
use sh::{Stop, Stopped};
use sphere::{DVec3, Direction};

use super::spots::Spots;
use super::{LAST_VIEW, MATTE, MATTE_TAPS, fit_lobe};
use crate::facets::{FacetNode, FacetTable, FacetTap, disc, view_at};
use crate::table::{NormalTap, TapTable};
use crate::widths::Widths;
use lobe::{Lobe, widths as lobe_widths};
use smooth::{Meaning, Orbit, Smooth, weights};
use view::{OF_NORMAL, OF_TAP, View};

/// Facet taps and how well they fit.
#[derive(Clone, Debug, PartialEq)]
pub struct FittedFacets {
    /// The taps.
    pub table: FacetTable,
    /// The root of the mean squared residual under spots of light, in stops.
    pub rms: f64,
}

/// The degrees of the polynomials, one after the other.
const DEGREES: [usize; 2] = [4, 10];

/// The squared sines of the angles of views from the normal.
const ANGLES: [f64; 10] = [0.06, 0.14, 0.26, 0.4, 0.55, 0.69, 0.82, 0.92, 0.975, LAST_VIEW];

/// The azimuths of views in a quarter turn, both ends included.
const AZIMUTHS: usize = 5;

/// The widest spots, in radians.
const WIDEST: f64 = 0.577;

/// A channel whose squared residuals are more than this many times those of all channels together has weights
/// of its own.
const COLOURED: f64 = 1.1;

/// The views that are fitted, without that along the normal.
fn views(is_symmetric: bool) -> Vec<DVec3> {
    let columns = if is_symmetric { AZIMUTHS } else { 4 * (AZIMUTHS - 1) };
    let view = |squared: f64, column: usize| {
        let phi = FRAC_PI_2 * column as f64 / (AZIMUTHS - 1) as f64;
        Direction::from_angles(math::asin(squared.sqrt()), phi).vector()
    };
    ANGLES.iter().flat_map(|squared| (0..columns).map(move |column| view(*squared, column))).collect()
}

pub fn fit_facets(material: &Material, taps: usize, widths: Widths, stop: Stop<'_>) -> Result<FittedFacets, Stopped> {
    let (table, rms) = fit_facet_lobe(material, taps, widths, stop)?;
    let table = FacetTable::new(table).unwrap();
    Ok(FittedFacets { table, rms })
}

/// The ways to place so many taps: how many lie at the centre, where each is its own mirror image; the others
/// are pairs along the longer axis of the lobe.
fn arrangements(taps: usize, widths: [f64; 2]) -> Vec<Vec<Orbit>> {
    let long = usize::from(widths[1] > widths[0]);
    let narrow = 2.0 * widths[1 - long];
    let mut all = Vec::new();
    for centre in (0..=taps).filter(|centre| (taps - centre) % 2 == 0) {
        for [least, most] in [[0.6, 6.0], [0.5, 2.0]] {
            let weight = -math::ln((taps + 1) as f64);
            let own = (0..centre).map(|i| {
                let part = if centre == 1 { 0.3 } else { i as f64 / (centre - 1) as f64 };
                let std = narrow * least * math::pow(most / least, part);
                Orbit { is_own: [true; 2], images: vec![[1.0; 2]], start: [0.0, 0.0, std, weight] }
            });
            let pairs = (taps - centre) / 2;
            let pair = (0..pairs).map(|i| {
                let far = (i as f64 + if centre > 0 { 1.0 } else { 0.5 }) / pairs as f64;
                let mut slope = [0.0; 2];
                slope[long] = 2.5 * far * widths[long];
                let std = narrow * (1.0 + most * 0.3 * far);
                let mut is_own = [true; 2];
                is_own[long] = false;
                let mut image = [1.0; 2];
                image[long] = -1.0;
                Orbit { is_own, images: vec![[1.0; 2], image], start: [slope[0], slope[1], std, weight] }
            });
            all.push(own.chain(pair).collect());
        }
    }
    all
}

fn fit_facet_lobe(
    material: &Material,
    taps: usize,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<(Vec<FacetNode>, f64), Stopped> {
    let normals = 1;
    let debug = std::env::var_os("DEBUG").is_some();
    let t0 = std::time::Instant::now();
    let is_symmetric = material.is_orthotropic();
    let slopes = lobe_widths(material);
    let narrow = 2.0 * slopes[0].min(slopes[1]);
    let sizes = [(0.5 * narrow).min(0.2), narrow.min(0.4), WIDEST];
    let spots: Vec<Spots> = sizes.par_iter().map(|tau| Spots::new(*tau, narrow, widths)).collect();
    let scales = sizes.map(|tau| {
        (tau < WIDEST).then(|| slopes.map(|slope| 1.5 * slope.max(0.5 * tau)))
    });
    let head_on = [DVec3::Z];
    let directions: Vec<DVec3> = head_on.into_iter().chain(views(is_symmetric)).collect();
    let lobes: Vec<Lobe> =
        directions.par_iter().map(|direction| Lobe::new(material, *direction, slopes)).collect();
    stop.check()?;
    let of_channel = |channel: Option<usize>| -> Vec<View<'_>> {
        let view = |(direction, lobe): (&DVec3, &Lobe)| {
            View::new(*direction, lobe, channel, &spots, &scales, taps)
        };
        directions.par_iter().zip(&lobes).map(view).collect()
    };
    let all = of_channel(None);
    if debug { eprintln!("slopes {slopes:?}, tests {}, set up {:?}", all.iter().map(View::len).sum::<usize>(), t0.elapsed()); }
    let to_levels = |mut orbit: Orbit| {
        orbit.start[2] = widths.place(orbit.start[2]);
        orbit
    };
    let starts = arrangements(taps, slopes);
    let tries: Vec<Smooth> = starts.into_par_iter().map(|orbits| {
        let orbits = orbits.into_iter().map(to_levels).collect();
        let smooth = Smooth::constant(orbits, normals, is_symmetric, widths.len());
        smooth.fitted(&all[..1], |_| true)
    }).collect();
    stop.check()?;
    if debug { eprintln!("head on {:?}", t0.elapsed()); }
    let rms = |cost: f64, views: &[View<'_>]| (cost / views.iter().map(View::len).sum::<usize>() as f64).sqrt();
    let mut tries: Vec<(f64, Smooth)> = tries.into_iter().map(|smooth| (smooth.cost(&all[..1]), smooth)).collect();
    tries.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Option<(f64, Smooth)> = None;
    let most: usize = std::env::var("TRIES").ok().map_or(3, |text| text.parse().unwrap());
    for (cost, smooth) in tries.into_iter().take(most) {
        let low = smooth.raised(DEGREES[0]).fitted(&all, |_| true);
        let low_cost = low.cost(&all);
        if debug { eprintln!("head on {:.4}, all at once {:.4}, degree 4: {:.4} {:?} {}", rms(cost, &all[..1]), rms(smooth.cost(&all), &all), rms(low_cost, &all), t0.elapsed(), smooth.describe()); }
        if best.as_ref().is_none_or(|best| low_cost < best.0) {
            best = Some((low_cost, low));
        }
    }
    let (_, low) = best.unwrap();
    let best = low.raised(std::env::var("DEGREE").map_or(DEGREES[1], |t| t.parse().unwrap())).fitted(&all, |_| true);
    let cost = best.cost(&all);
    if debug {
        eprintln!("degree 10: {:.4} {:?}", rms(cost, &all), t0.elapsed());
        for view in &all {
            let rms = rms(best.cost(std::slice::from_ref(view)), std::slice::from_ref(view));
            let d = Direction::normalised(view.direction);
            let parameters = best.at(disc(view.direction));
            let orbits = parameters[..OF_TAP * taps].as_chunks::<OF_TAP>().0.iter().map(|start| Orbit { is_own: [false; 2], images: vec![[1.0; 2]], start: *start }).collect();
            let free = Smooth::constant(orbits, normals, false, widths.len()).fitted(std::slice::from_ref(view), |_| true).cost(std::slice::from_ref(view));
            let free = (free / view.len() as f64).sqrt();
            eprint!("{:.0}/{:.0}: {rms:.3} {free:.3}  ", d.theta().to_degrees(), d.phi().to_degrees());
        }
        eprintln!();
    }
    let is_of_one_colour = lobes.iter().all(Lobe::is_of_one_colour);
    let mut squares = 0.0;
    let colours: [Smooth; 3] = [0, 1, 2].map(|channel| {
        if is_of_one_colour {
            squares += cost;
            return best.clone();
        }
        let views = of_channel(Some(channel));
        let own = best.cost(&views);
        let smooth = if own > COLOURED * cost { best.fitted(&views, |meaning| meaning == Meaning::Weight) } else { best.clone() };
        squares += smooth.cost(&views);
        smooth
    });
    if debug { eprintln!("colours {:?}", t0.elapsed()); }
    let side = if is_symmetric { FacetTable::QUARTER } else { FacetTable::WHOLE };
    let node = |index: usize| {
        let place = FacetTable::place(is_symmetric, index);
        let view = view_at(place);
        let place = disc(view);
        let theta = math::acos(view.z).min(FRAC_PI_2 - 1e-3);
        let view = if view.z < 1.0 { Direction::from_angles(theta, math::atan2(view.y, view.x)).vector() } else { view };
        let albedo = Lobe::new(material, view, slopes).albedo();
        let parameters = colours.each_ref().map(|smooth| smooth.at(place));
        let indices: Vec<usize> = weights(taps, normals).collect();
        let scales: [f64; 3] = std::array::from_fn(|channel| {
            albedo[channel] / indices.iter().map(|index| math::exp(parameters[channel][*index])).sum::<f64>()
        });
        let weight = |tap: usize| {
            std::array::from_fn(|channel| scales[channel] * math::exp(parameters[channel][indices[tap]]))
        };
        let (of_taps, of_normals) = parameters[0].split_at(OF_TAP * taps);
        FacetNode {
            taps: (of_taps.as_chunks::<OF_TAP>().0.iter().enumerate())
                .map(|(j, [p, q, x, _])| FacetTap { slope: [*p, *q], std: widths.std_at(*x), weight: weight(j) })
                .collect(),
            normals: (of_normals.as_chunks::<OF_NORMAL>().0.iter().enumerate())
                .map(|(j, [x, _])| NormalTap { y: x / (crate::NORMAL_KERNELS - 1) as f64, weight: weight(taps + j) })
                .collect(),
        }
    };
    let nodes = (0..side * side).into_par_iter().map(node).collect();
    if debug { eprintln!("table {:?}", t0.elapsed()); }
    let residuals: usize = all.iter().map(View::len).sum();
    Ok((nodes, (squares / 3.0 / residuals as f64).sqrt()))
}
