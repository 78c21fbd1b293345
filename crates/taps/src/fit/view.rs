//! The fit at one view: what spots of light look like, and what some taps make of them.

use sphere::DVec3;

use super::least_squares::{Normal, minimise};
use super::residuals::{AMBIENT, Residuals};
use super::spots::{Between, Spots};

/// The number of taps of each sort, and the order of their parameters: delta, x and the logarithm of the
/// weight of each tap, then x and the logarithm of the weight of each tap about the normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    /// The taps about directions between R and N.
    pub(super) taps: usize,
    /// The taps about the normal.
    pub(super) normals: usize,
    /// The last place between the levels of the scale space.
    pub(super) levels: usize,
}

/// The last place between the kernels about the normal.
pub(super) const LAST_NORMAL: f64 = crate::kernels::NORMAL_KERNELS as f64 - 1.0 - 1e-6;

/// What a parameter means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// The angle from R toward the normal.
    Delta,
    /// The place between levels.
    Level,
    /// The place between kernels about the normal.
    Kernel,
    /// The logarithm of a weight.
    Weight,
}

impl Shape {
    /// The number of parameters.
    pub(super) fn len(self) -> usize {
        3 * self.taps + 2 * self.normals
    }

    /// What each parameter means.
    pub(super) fn meanings(self) -> impl Iterator<Item = Meaning> + Clone {
        let taps = std::iter::repeat_n([Meaning::Delta, Meaning::Level, Meaning::Weight], self.taps);
        let normals = std::iter::repeat_n([Meaning::Kernel, Meaning::Weight], self.normals);
        taps.flatten().chain(normals.flatten())
    }

    /// The indices of the logarithms of weights: those of the taps, then those of the taps about the normal.
    pub(super) fn weights(self) -> impl Iterator<Item = usize> + Clone {
        self.meanings().enumerate().filter(|(_, meaning)| *meaning == Meaning::Weight).map(|(index, _)| index)
    }

    /// Keeps parameters where a scale space has levels and kernels.
    pub(super) fn bound(self, parameters: &mut [f64]) {
        for (value, meaning) in parameters.iter_mut().zip(self.meanings()) {
            *value = match meaning {
                Meaning::Delta => value.clamp(-1.5, 1.5),
                Meaning::Level => value.clamp(0.0, (self.levels - 1) as f64 - 1e-3),
                Meaning::Kernel => value.clamp(0.0, LAST_NORMAL),
                Meaning::Weight => value.clamp(-14.0, 4.0),
            };
        }
    }
}

/// The pull of each parameter to its start.
const PULL: f64 = 0.05;

/// The lobe of one view, normalised to an albedo of 1, under every spot.
pub(super) struct ViewFit<'a> {
    pub(super) theta: f64,
    /// How much its residuals weigh beside those of another lobe.
    pub(super) importance: f64,
    spots: &'a [Spots],
    shape: Shape,
    /// What the lobe reflects of each spot, size by size.
    truth: &'a [f64],
}

/// A tap, ready for look-ups.
struct Placed {
    direction: DVec3,
    /// The derivative of the direction by delta.
    turned: DVec3,
    between: Between,
    weight: f64,
}

impl<'a> ViewFit<'a> {
    /// The fit of a lobe that reflects so much of each spot.
    pub(super) fn new(theta: f64, truth: &'a [f64], spots: &'a [Spots], shape: Shape) -> Self {
        Self { theta, importance: 1.0, spots, shape, truth }
    }

    /// The number of residuals.
    pub(super) fn len(&self) -> usize {
        self.truth.len() + 1
    }

    /// The sum of squared residuals in stops; adds to the normal equations, if they are given.
    pub(super) fn evaluate(&self, parameters: &[f64], normal: Option<&mut Normal>) -> f64 {
        let (taps, normals) = parameters.split_at(3 * self.shape.taps);
        let taps: Vec<Placed> = (taps.as_chunks::<3>().0.iter())
            .map(|[delta, x, weight]| {
                let (s, c) = math::sin_cos(*delta);
                Placed {
                    direction: DVec3::new(s, 0.0, c),
                    turned: DVec3::new(c, 0.0, -s),
                    between: Between::levels(*x),
                    weight: math::exp(*weight),
                }
            })
            .collect();
        let normals: Vec<(Between, f64)> = (normals.as_chunks::<2>().0.iter())
            .map(|[x, weight]| (Between::normals(*x), math::exp(*weight)))
            .collect();
        let (s, c) = math::sin_cos(self.theta);
        let about_normal = DVec3::new(s, 0.0, c);
        let mut row = vec![0.0; self.shape.len()];
        let has_rows = normal.is_some();
        let mut residuals = Residuals::new(normal);
        let mut truth = self.truth.iter();
        for spots in self.spots {
            for (centre, truth) in spots.centres.iter().zip(&mut truth) {
                let mut sum = AMBIENT;
                let (of_taps, of_normals) = row.split_at_mut(3 * taps.len());
                for (tap, row) in taps.iter().zip(of_taps.as_chunks_mut::<3>().0) {
                    let seen = spots.in_levels(tap.direction.dot(*centre), tap.between);
                    sum += tap.weight * seen.value;
                    if !has_rows {
                        continue;
                    }
                    *row = [
                        tap.weight * seen.by_cosine * tap.turned.dot(*centre),
                        tap.weight * seen.by_place,
                        tap.weight * seen.value,
                    ];
                }
                for ((between, weight), row) in normals.iter().zip(of_normals.as_chunks_mut::<2>().0) {
                    let seen = spots.about_normal(about_normal.dot(*centre), *between);
                    sum += weight * seen.value;
                    *row = [weight * seen.by_place, weight * seen.value];
                }
                residuals.add_spot(sum, *truth, &mut row);
            }
        }
        let weights = taps.iter().map(|tap| tap.weight).chain(normals.iter().map(|normal| normal.1));
        residuals.add_uniform(self.shape.weights().zip(weights), &mut row);
        residuals.cost
    }

    /// The parameters that fit best, from a start, to which each is weakly pulled.
    pub(super) fn solve(&self, start: &[f64]) -> Vec<f64> {
        let evaluate = |parameters: &[f64], normal: Option<&mut Normal>| {
            let pairs = || parameters.iter().zip(start).map(|(value, start)| PULL * (value - start));
            let pull: f64 = pairs().map(|pull| pull * pull).sum();
            let Some(normal) = normal else { return self.evaluate(parameters, None) + pull };
            let cost = self.evaluate(parameters, Some(normal));
            for (index, pull) in pairs().enumerate() {
                normal.add_one(index, PULL, pull);
            }
            cost + pull
        };
        minimise(start.to_vec(), evaluate, |parameters| self.shape.bound(parameters))
    }
}
