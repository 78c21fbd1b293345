//! A lobe and the taps that are fitted to it.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use brdf::Material;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use super::lobe::{Lobe, width};
use super::smooth::Smooth;
use super::spots::{Spots, spots};
use super::view::{Shape, ViewFit};
use crate::kernels::NORMAL_KERNELS;
use crate::table::{NormalTap, ROWS, Tap, TapRow};
use crate::widths::Widths;

/// The widths of the first taps, as shares of the lobe's: from the narrowest to the widest. The better fit
/// wins.
const STARTS: [[f64; 2]; 2] = [[0.6, 6.0], [0.5, 2.0]];

/// The last view, 88 degrees from the normal: beyond, taps stay as they are.
const LAST_VIEW: f64 = 0.9985;

/// The views that are fitted, in radians from the normal: as a ball shows them, and three grazing ones.
fn views() -> Vec<f64> {
    const COUNT: usize = 20;
    let even = (0..COUNT).map(|view| view as f64 / COUNT as f64);
    even.chain([0.975, 0.992, LAST_VIEW]).map(|squared| math::asin(squared.sqrt())).collect()
}

/// The sum of all channels, and each.
const CHANNELS: [Option<usize>; 4] = [None, Some(0), Some(1), Some(2)];

/// A lobe and what it reflects, which is the same for any number of taps.
struct Sampled<'a> {
    material: &'a Material,
    widths: Widths,
    /// The width of the lobe, in radians.
    width: f64,
    spots: Vec<Spots>,
    /// The views, in radians from the normal.
    thetas: Vec<f64>,
    /// What the sum of all channels reflects of each spot toward each view, and, if the lobe has not one
    /// shape in all of them, what each channel does.
    truths: Vec<Vec<Vec<f64>>>,
}

/// A lobe that is to be fitted by some taps.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    sampled: Arc<Sampled<'a>>,
    shape: Shape,
}

impl<'a> Problem<'a> {
    /// A problem with so many taps between levels, and one about the normal.
    pub(super) fn new(
        material: &'a Material,
        taps: usize,
        widths: Widths,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let shape = Shape { taps, normals: 1, levels: widths.len() };
        let width = if taps == 0 { 0.5 } else { width(material) };
        let spots = spots(width, widths);
        let thetas = views();
        let lobes: Vec<Lobe> = thetas.par_iter().map(|theta| Lobe::new(material, *theta, width)).collect();
        stop.check()?;
        let is_of_one_colour = lobes.iter().all(Lobe::is_of_one_colour);
        let mut truths = vec![Vec::new(); if is_of_one_colour { 1 } else { CHANNELS.len() }];
        let seen: Vec<Vec<Vec<f64>>> = lobes
            .par_iter()
            .map(|lobe| match is_of_one_colour {
                true => lobe.seen([None], &spots).into(),
                false => lobe.seen(CHANNELS, &spots).into(),
            })
            .collect();
        for of_view in seen {
            truths.iter_mut().zip(of_view).for_each(|(truths, truth)| truths.push(truth));
        }
        let sampled = Sampled { material, widths, width, spots, thetas, truths };
        Ok(Self { sampled: Arc::new(sampled), shape })
    }

    /// The same problem with another number of taps, which is not 0.
    pub(super) fn with_taps(&self, taps: usize) -> Self {
        Self { sampled: Arc::clone(&self.sampled), shape: Shape { taps, ..self.shape } }
    }

    /// The width of the lobe, in radians.
    pub(super) fn width(&self) -> f64 {
        self.sampled.width
    }

    /// Whether the lobe has one shape in all colours.
    pub(super) fn is_of_one_colour(&self) -> bool {
        self.sampled.truths.len() == 1
    }

    /// The fits at all views, of a channel or of the sum of all.
    pub(super) fn fits(&self, channel: Option<usize>) -> Vec<ViewFit<'_>> {
        let Sampled { spots, thetas, truths, .. } = &*self.sampled;
        let at = CHANNELS.iter().position(|known| *known == channel).filter(|at| *at < truths.len());
        let views = thetas.iter().zip(&truths[at.unwrap_or(0)]);
        views.map(|(theta, truth)| ViewFit::new(*theta, truth, spots, self.shape)).collect()
    }

    /// The parameters of the first view from which a fit starts, with taps whose widths are from the least to
    /// the greatest of these shares of the lobe's.
    fn start(&self, [least, most]: [f64; 2]) -> Vec<f64> {
        let Shape { taps, normals, .. } = self.shape;
        let weight = -math::ln((taps + normals) as f64);
        let tap = |tap: usize| {
            let part = if taps == 1 { 0.3 } else { tap as f64 / (taps - 1) as f64 };
            [
                0.0,
                self.sampled.widths.place(self.sampled.width * least * math::pow(most / least, part)),
                weight,
            ]
        };
        (0..taps).flat_map(tap).chain(std::iter::repeat_n([1.3, weight], normals).flatten()).collect()
    }

    /// The taps that fit best, and their cost.
    pub(super) fn solve(&self, fits: &[ViewFit<'_>], stop: Stop<'_>) -> Result<(Smooth, f64), Stopped> {
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

    /// The directional albedo toward the view of each row.
    pub(super) fn albedos(&self) -> Vec<[f64; 3]> {
        let albedo = |row: usize| {
            let theta = math::acos(row_cosine(row)).min(FRAC_PI_2 - 1e-3);
            Lobe::new(self.sampled.material, theta, self.sampled.width).albedo()
        };
        (0..ROWS).into_par_iter().map(albedo).collect()
    }

    /// The rows of the table with the taps of each colour, and these albedos.
    pub(super) fn rows(&self, colours: [&Smooth; 3], albedos: &[[f64; 3]]) -> Vec<TapRow> {
        let row = |(row, albedo): (usize, &[f64; 3])| {
            row_of(math::acos(row_cosine(row)), *albedo, colours, self.sampled.widths)
        };
        albedos.iter().enumerate().map(row).collect()
    }
}

/// The cosine from the normal of the view of a row.
pub(super) fn row_cosine(row: usize) -> f64 {
    1.0 - row as f64 / (ROWS - 1) as f64
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
            .map(|[x, _]| NormalTap { y: x / (NORMAL_KERNELS - 1) as f64, weight: weight() })
            .collect(),
    }
}
