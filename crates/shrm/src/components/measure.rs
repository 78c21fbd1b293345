//! The error of a map of components, as a ball shows it, in stops.

use brdf::{Centre, Material};
use rayon::prelude::*;
use sh::Stop;
use sphere::{Cube, Direction, Face, spiral};

use super::basis::ComponentBasis;
use super::chart::{bordered_taps, disc, face_frame};
use super::field::{harmonics, toward, turns};
use super::lobes::Lobes;
use super::map::{ComponentMap, Fit, GOLDEN_TURN};
use super::options::{CENTRALS, ComponentError};
use crate::degrees::BLACK_SHARE;
use crate::stops::{error, quantiles};
use crate::{Lamps, Reflection};

/// Views of each central direction.
const ANGLES: usize = 24;

/// What is reflected, at central directions between the texels and views as a ball shows them.
pub(super) struct Samples {
    samples: Vec<Sample>,
    dark: f64,
}

struct Sample {
    face: Face,
    place: [f64; 2],
    views: Vec<SampleView>,
}

struct SampleView {
    /// The place on the disc.
    disc: [f64; 2],
    truth: [f64; 3],
    /// The light that is added to what the map has.
    beside: [f64; 3],
}

impl Samples {
    pub(super) fn new(
        reflection: &Reflection,
        material: &Material,
        bake: bool,
        stop: Stop<'_>,
    ) -> Result<Self, ComponentError> {
        let lighting = reflection.lighting();
        // The squared sine is uniform.
        let cosine = |j: usize| (1.0 - (j as f64 + 0.5) / ANGLES as f64).sqrt();
        let angles: Vec<f64> = (0..ANGLES).map(|j| math::acos(cosine(j))).collect();
        let lobes = Lobes::new(material, &angles, lighting.degree(), lighting.degree().get())?;
        let lamps = reflection.lamps().map(Lamps::for_views);
        let sample = |index: usize| {
            stop.check()?;
            let central = spiral(index, CENTRALS);
            let (face, s, t) = Cube { edge: 1 }.position(central);
            let frame = face_frame(face, central);
            let sums = harmonics(lighting, &lobes, &frame);
            let mut values = vec![0.0; 3 * ANGLES];
            let view = |(j, angle): (usize, &f64)| {
                let phi = (index * ANGLES + j) as f64 * GOLDEN_TURN;
                toward(&sums, ANGLES, &turns(phi, lobes.orders()), &mut values);
                let soft: [f64; 3] = std::array::from_fn(|channel| values[channel * ANGLES + j].max(0.0));
                let other = frame * Direction::from_angles(*angle, phi).vector();
                let view = match material.centre() {
                    Centre::Reflection => other * (2.0 * other.dot(central.vector())) - central.vector(),
                    _ => other,
                };
                let lit = lamps
                    .as_ref()
                    .map_or([0.0; 3], |lamps| lamps.radiance(central, Direction::normalised(view)));
                let truth = std::array::from_fn(|channel| soft[channel] + lit[channel]);
                SampleView { disc: disc(&frame, other), truth, beside: if bake { [0.0; 3] } else { lit } }
            };
            Ok(Sample { face, place: [s, t], views: angles.iter().enumerate().map(view).collect() })
        };
        let samples: Result<_, ComponentError> = (0..CENTRALS).into_par_iter().map(sample).collect();
        Ok(Self { samples: samples?, dark: BLACK_SHARE * reflection.light_mean() })
    }

    /// The errors of a map.
    pub(super) fn error(&self, map: &ComponentMap) -> [f64; 2] {
        let of_sample = |sample: &Sample| -> Vec<f64> {
            let seen = |view: &SampleView| {
                let found = map.at(sample.face, sample.place, &map.basis().at(view.disc));
                self.stops(view, found)
            };
            sample.views.iter().flat_map(seen).collect()
        };
        let mut stops: Vec<f64> = self.samples.par_iter().flat_map_iter(of_sample).collect();
        quantiles(&mut stops)
    }

    fn stops(&self, view: &SampleView, found: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|channel| {
            error(found[channel].max(0.0) + view.beside[channel], view.truth[channel], self.dark)
        })
    }

    /// The errors of fits of the first components, for each number of them that parts no pair; texels are
    /// fitted about the samples alone.
    pub(super) fn by_count(
        &self,
        fit: &Fit<'_>,
        stop: Stop<'_>,
    ) -> Result<Vec<(usize, [f64; 2])>, ComponentError> {
        let basis: &ComponentBasis = fit.basis;
        let counts: Vec<usize> = basis.counts().collect();
        let most = basis.components().len();
        let of_sample = |sample: &Sample| {
            stop.check()?;
            let mut edges = vec![fit.edge(0), fit.edge(most.saturating_sub(1))];
            edges.dedup();
            // For each number of components, U_k at the sample's place.
            let mut blended = vec![vec![[0.0; 3]; most]; counts.len()];
            for edge in edges {
                for (index, weight) in bordered_taps(edge, sample.place[0], sample.place[1]) {
                    let texel = fit.texel(edge, sample.face, index, None);
                    for (count, blended) in counts.iter().zip(&mut blended) {
                        let solution = texel.solution(*count);
                        let of_edge = (0..*count).filter(|k| fit.edge(*k) == edge);
                        for k in of_edge {
                            (0..3).for_each(|channel| blended[k][channel] += weight * solution[k][channel]);
                        }
                    }
                }
            }
            let mut stops = vec![Vec::with_capacity(3 * ANGLES); counts.len()];
            for view in &sample.views {
                let w = basis.at(view.disc);
                for (blended, stops) in blended.iter().zip(&mut stops) {
                    let mut found = [0.0; 3];
                    for (u, w) in blended.iter().zip(&w) {
                        (0..3).for_each(|channel| found[channel] += u[channel] * w);
                    }
                    stops.extend(self.stops(view, found));
                }
            }
            Ok(stops)
        };
        let found: Result<Vec<Vec<Vec<f64>>>, ComponentError> =
            self.samples.par_iter().map(of_sample).collect();
        let found = found?;
        let of_count = |(index, count): (usize, &usize)| {
            let mut stops: Vec<f64> = found.iter().flat_map(|sample| sample[index].iter().copied()).collect();
            (*count, quantiles(&mut stops))
        };
        Ok(counts.iter().enumerate().map(of_count).collect())
    }
}
