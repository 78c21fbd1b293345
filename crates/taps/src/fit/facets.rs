//! Fits facet taps to a lobe that depends on the direction of its tangent.
//!
//! As for taps about the reflection vector, what taps make of round spots of light is compared with what the
//! BRDF reflects of them, in stops, toward views on all sides of the normal. The slopes of the facets hardly
//! change with the view. The fit therefore begins with taps that fit the lobe seen head on, in several
//! arrangements, and lets each parameter become a polynomial over the disc of views, of a low degree first.

mod lobe;
mod smooth;
mod view;

use std::f64::consts::FRAC_PI_2;

use brdf::Material;
use rayon::prelude::*;
use sh::{Stop, Stopped};
use sphere::{DVec3, Direction};

use super::lobe::{albedo, is_of_one_colour};
use super::spots::{Spots, WIDEST};
use crate::facets::{FacetNode, FacetTable, FacetTap, disc, view_at};
use crate::kernels::NORMAL_KERNELS;
use crate::table::NormalTap;
use crate::widths::Widths;
use smooth::{LAST_ANGLE, Meaning, Orbit, Smooth};
use view::{OF_NORMAL, OF_TAP, View};

/// The taps of one lobe, or of several.
pub(super) struct FacetFit {
    /// The nodes of a table over the disc, or over a quarter of it.
    pub(super) nodes: Vec<FacetNode>,
    /// The sum of the squared residuals, in stops.
    pub(super) squares: f64,
    /// The number of residuals.
    pub(super) residuals: usize,
}

impl FacetFit {
    /// Adds the taps of another lobe.
    pub(super) fn add(&mut self, other: Self) {
        self.squares += other.squares;
        self.residuals += other.residuals;
        for (node, added) in self.nodes.iter_mut().zip(other.nodes) {
            node.taps.extend(added.taps);
            node.normals.extend(added.normals);
        }
    }

    pub(super) fn rms(&self) -> f64 {
        (self.squares / self.residuals.max(1) as f64).sqrt()
    }
}

/// The degree of the first polynomials, which choose among the arrangements, and of the last.
const DEGREES: [usize; 2] = [4, 10];

/// The arrangements that first polynomials are fitted to: those that fit best head on.
const TRIED: usize = 3;

/// The widths of the first taps at the centre, as shares of the lobe's shorter width: from the narrowest to
/// the widest.
const STARTS: [[f64; 2]; 2] = [[0.6, 6.0], [0.5, 2.0]];

/// The squared sines of the angles of views from the normal, but for the first and the last.
const ANGLES: [f64; 9] = [0.06, 0.14, 0.26, 0.4, 0.55, 0.69, 0.82, 0.92, 0.975];

/// The steps of the azimuths of views in a quarter turn.
const STEPS: usize = 4;

/// A channel whose squared residuals are more than this many times those of all channels together has weights
/// of its own.
const COLOURED: f64 = 1.1;

/// The views that are fitted; that along the normal is the first.
fn views(is_quarter: bool) -> Vec<DVec3> {
    let columns = if is_quarter { STEPS + 1 } else { 4 * STEPS };
    let angles = ANGLES.iter().map(|squared| math::asin(squared.sqrt())).chain([LAST_ANGLE]);
    let row = |theta: f64| {
        let phi = |column: usize| FRAC_PI_2 * column as f64 / STEPS as f64;
        (0..columns).map(move |column| Direction::from_angles(theta, phi(column)).vector())
    };
    std::iter::once(DVec3::Z).chain(angles.flat_map(row)).collect()
}

/// The ways to place so many taps on a lobe of some widths, in slopes: some at the centre, and the others in
/// pairs along the longer axis.
fn arrangements(taps: usize, slopes: [f64; 2], is_quarter: bool, widths: Widths) -> Vec<Vec<Vec<Orbit>>> {
    let long = usize::from(slopes[1] > slopes[0]);
    let narrow = 2.0 * slopes[1 - long];
    let weight = -math::ln((taps + 1) as f64);
    let arrangement = |centre: usize, [least, most]: [f64; 2]| {
        let pairs = (taps - centre) / 2;
        let own = (0..centre).map(|tap| {
            let part = if centre == 1 { 0.3 } else { tap as f64 / (centre - 1) as f64 };
            let std = narrow * least * math::pow(most / least, part);
            Orbit { is_own: [true; 2], images: vec![[1.0; 2]], start: [0.0, 0.0, widths.place(std), weight] }
        });
        let pair = (0..pairs).map(|pair| {
            let far = (pair as f64 + if centre > 0 { 1.0 } else { 0.5 }) / pairs as f64;
            let std = narrow * (1.0 + 0.3 * most * far);
            let (mut start, mut is_own, mut image) =
                ([0.0, 0.0, widths.place(std), weight], [true; 2], [1.0; 2]);
            start[long] = 2.5 * far * slopes[long];
            is_own[long] = false;
            image[long] = -1.0;
            Orbit { is_own, images: vec![[1.0; 2], image], start }
        });
        let orbits = own.chain(pair);
        if is_quarter { orbits.collect() } else { orbits.flat_map(|orbit| orbit.apart()).collect() }
    };
    let centres = (0..=taps).filter(|centre| (taps - centre).is_multiple_of(2));
    centres.map(|centre| STARTS.map(|shares| arrangement(centre, shares)).into()).collect()
}

/// The best of some fits.
fn best(fits: impl IntoIterator<Item = (f64, Smooth)>) -> (f64, Smooth) {
    let best = fits.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    best.unwrap_or_else(|| unreachable!("there are starts"))
}

/// Fits one lobe by so many facet taps, and one about the normal. `is_quarter` says that mirrors along the
/// tangent and across it change nothing.
pub(super) fn fit_facet_lobe(
    material: &Material,
    taps: usize,
    is_quarter: bool,
    widths: Widths,
    stop: Stop<'_>,
) -> Result<FacetFit, Stopped> {
    let slopes = lobe::widths(material);
    let narrow = 2.0 * slopes[0].min(slopes[1]);
    let sizes = [(0.5 * narrow).min(0.2), narrow.min(0.4), WIDEST];
    let spots: Vec<Spots> = sizes.par_iter().map(|tau| Spots::new(*tau, narrow, widths)).collect();
    let scales = sizes.map(|tau| (tau < WIDEST).then(|| slopes.map(|slope| 1.5 * slope.max(0.5 * tau))));
    let directions = views(is_quarter);
    let lobes: Vec<Vec<(DVec3, [f64; 3])>> =
        directions.par_iter().map(|direction| lobe::shares(material, *direction, slopes)).collect();
    stop.check()?;
    let of_channel = |channel: Option<usize>| -> Vec<View<'_>> {
        let view = |(direction, lobe): (&DVec3, &Vec<(DVec3, [f64; 3])>)| {
            View::new(*direction, lobe, channel, &spots, &scales, taps)
        };
        directions.par_iter().zip(&lobes).map(view).collect()
    };
    let all = of_channel(None);
    stop.check()?;
    let head_on = |orbits: Vec<Orbit>| {
        let smooth = Smooth::constant(orbits, is_quarter, widths).fitted(&all[..1], |_| true);
        (smooth.cost(&all[..1]), smooth)
    };
    let placed = arrangements(taps, slopes, is_quarter, widths).into_par_iter();
    let mut tries: Vec<_> = placed.map(|starts| best(starts.into_iter().map(head_on))).collect();
    tries.sort_by(|a, b| a.0.total_cmp(&b.0));
    tries.truncate(TRIED);
    stop.check()?;
    let low = tries.into_par_iter().map(|(_, smooth)| {
        let smooth = smooth.raised(DEGREES[0]).fitted(&all, |_| true);
        (smooth.cost(&all), smooth)
    });
    let (_, low) = best(low.collect::<Vec<_>>());
    stop.check()?;
    let smooth = low.raised(DEGREES[1]).fitted(&all, |_| true);
    let cost = smooth.cost(&all);
    stop.check()?;
    let is_of_one_colour = lobes.iter().all(|lobe| is_of_one_colour(lobe));
    let colours = [0, 1, 2].map(|channel| {
        if is_of_one_colour {
            return (smooth.clone(), cost);
        }
        let views = of_channel(Some(channel));
        let own = smooth.cost(&views);
        if own <= COLOURED * cost {
            return (smooth.clone(), own);
        }
        let smooth = smooth.fitted(&views, |meaning| meaning == Meaning::Weight);
        let own = smooth.cost(&views);
        (smooth, own)
    });
    stop.check()?;
    let squares = colours.iter().map(|(_, cost)| cost).sum::<f64>() / 3.0;
    let colours = colours.each_ref().map(|(smooth, _)| smooth);
    let node = |index: usize| {
        let view = view_at(FacetTable::place(is_quarter, index));
        // At the horizon itself a material may have no value.
        let theta = math::acos(view.z).min(FRAC_PI_2 - 1e-3);
        let seen = Direction::from_angles(theta, math::atan2(view.y, view.x)).vector();
        node_of(colours, disc(view), albedo(&lobe::shares(material, seen, slopes)), widths)
    };
    let nodes = (0..FacetTable::nodes_of(is_quarter)).into_par_iter().map(node).collect();
    Ok(FacetFit { nodes, squares, residuals: all.iter().map(View::len).sum() })
}

/// A node of the table: the taps, and in each colour their weights, which add up to the albedo.
fn node_of(colours: [&Smooth; 3], place: [f64; 2], albedo: [f64; 3], widths: Widths) -> FacetNode {
    let parameters = colours.map(|smooth| smooth.at(place));
    let (of_taps, of_normals) = parameters[0].split_at(OF_TAP * colours[0].taps());
    let (of_taps, of_normals) = (of_taps.as_chunks::<OF_TAP>().0, of_normals.as_chunks::<OF_NORMAL>().0);
    let last = |index: usize| {
        OF_TAP * (index + 1).min(of_taps.len()) + OF_NORMAL * (index + 1).saturating_sub(of_taps.len()) - 1
    };
    let count = of_taps.len() + of_normals.len();
    let scales: [f64; 3] = std::array::from_fn(|channel| {
        albedo[channel] / (0..count).map(|index| math::exp(parameters[channel][last(index)])).sum::<f64>()
    });
    let weight = |index: usize| {
        std::array::from_fn(|channel| scales[channel] * math::exp(parameters[channel][last(index)]))
    };
    let tap = |(index, [p, q, x, _]): (usize, &[f64; OF_TAP])| FacetTap {
        slope: [*p, *q],
        std: widths.std_at(*x),
        weight: weight(index),
    };
    let normal = |(index, [x, _]): (usize, &[f64; OF_NORMAL])| NormalTap {
        y: x / (NORMAL_KERNELS - 1) as f64,
        weight: weight(of_taps.len() + index),
    };
    FacetNode {
        taps: of_taps.iter().enumerate().map(tap).collect(),
        normals: of_normals.iter().enumerate().map(normal).collect(),
    }
}
