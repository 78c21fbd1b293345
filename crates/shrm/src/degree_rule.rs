//! The rule by which a degree P is chosen where coefficients cost memory.
//!
//! It is the least P that meets a [`MapTolerance`]: in stops, or in the RMS error of [RH02, sec. 5]. Where
//! none up to the highest that is allowed does, it is the best of those up to [`Terms::small_p`]: further
//! coefficients cost much and would not be enough.

use brdf::BrdfCoefficients;
use sh::{Degree, Expansion, energy_per_degree, lambda};

use crate::Terms;
use crate::reflection::MOST_P;

/// The highest P of a map with all terms that does not meet its tolerance: 25 coefficients.
pub const SMALL_P: usize = 4;

/// The error that a map may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapTolerance {
    /// The errors in stops that 5 of 100 views, and 1 of 100, may exceed.
    Stops([f64; 2]),
    /// The RMS error, as a share of the RMS radiance.
    Rms(f64),
}

/// How the degree P of a map is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DegreeRule {
    /// The error that the map may have.
    pub tolerance: MapTolerance,
    /// The highest P that is tried.
    pub most_p: usize,
    /// The coefficients that the map keeps, which say what a P costs.
    pub terms: Terms,
}

/// A degree P, and the errors of a map at it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapDegree {
    /// The degree in the view.
    pub p: Degree,
    /// The error in stops that 95 of 100 samples stay below.
    pub p95: f64,
    /// The error in stops that 99 of 100 samples stay below.
    pub p99: f64,
    /// The RMS error, as a share of the RMS radiance.
    pub rms: f64,
    /// Whether it meets the tolerance.
    pub is_met: bool,
    /// The least P above the highest allowed one that would meet the tolerance, if it is known.
    pub enough: Option<usize>,
    /// The degree P of the field that a map with the lamps in it is fitted to: what is above it is lost in
    /// what the fit misses.
    pub field: Degree,
}

impl MapTolerance {
    /// The factor by which errors exceed the tolerance: at most 1 if they meet it.
    pub(crate) fn excess(&self, [p95, p99]: [f64; 2], rms: f64) -> f64 {
        let over = |error: f64, limit: f64| if error > 0.0 { error / limit } else { 0.0 };
        match *self {
            Self::Stops(limits) => over(p95, limits[0]).max(over(p99, limits[1])),
            Self::Rms(limit) => over(rms, limit),
        }
    }

    /// Returns a share of the tolerance.
    #[must_use]
    pub fn scaled(self, share: f64) -> Self {
        match self {
            Self::Stops(limits) => Self::Stops(limits.map(|limit| share * limit)),
            Self::Rms(limit) => Self::Rms(share * limit),
        }
    }
}

impl Terms {
    /// The highest P of a map that does not meet its tolerance: [`SMALL_P`] with all terms, and [`MOST_P`] if
    /// the map has one coefficient for each p, which are fewer.
    pub fn small_p(self) -> usize {
        match self {
            Self::All => SMALL_P,
            Self::Zonal => MOST_P,
        }
    }
}

impl DegreeRule {
    /// The least degree up to [`DegreeRule::most_p`] that meets the tolerance, otherwise the best up to
    /// [`Terms::small_p`]. `measured` are errors at ascending degrees from 0 on, of which the last may meet
    /// it; degrees above the highest allowed one only say what would be enough.
    pub(crate) fn choose(&self, measured: &[MapDegree]) -> Option<MapDegree> {
        let excess = |map: &MapDegree| self.tolerance.excess([map.p95, map.p99], map.rms);
        let is_met = |map: &&MapDegree| excess(map) <= 1.0;
        let allowed = |most: usize| measured.iter().filter(move |map| map.p.get() <= most);
        if let Some(least) = allowed(self.most_p).find(is_met) {
            return Some(MapDegree { is_met: true, ..*least });
        }
        let best =
            allowed(self.most_p.min(self.terms.small_p())).min_by(|a, b| excess(a).total_cmp(&excess(b)))?;
        let enough = measured.iter().find(is_met).map(|map| map.p.get());
        Some(MapDegree { enough, ..*best })
    }
}

/// The energy of the field at one l and p, over all central directions and views [Ram02, eq. 5.15]; `light`
/// has the energies of the lighting by degree.
fn energy_at(light: &[[f64; 3]], brdf: &BrdfCoefficients, l: usize, p: usize) -> f64 {
    let of_q = |q: usize| -> f64 {
        let (rho, signs) = (brdf.get(l, p, q), if q == 0 { 1.0 } else { 2.0 });
        (0..3).map(|channel| signs * light[l][channel] * rho[channel] * rho[channel]).sum()
    };
    math::powi(lambda(l), 2) * (0..=l.min(p)).map(of_q).sum::<f64>()
}

/// The energy of the field at each degree l.
pub(crate) fn energy_per_central_degree(lighting: &Expansion, brdf: &BrdfCoefficients) -> Vec<f64> {
    let light = energy_per_degree(lighting);
    let of = |l| (0..=brdf.p().get()).map(|p| energy_at(&light, brdf, l, p)).sum();
    (0..=brdf.f().get().min(light.len() - 1)).map(of).collect()
}

/// The RMS of what a cut at each P leaves out, as a share of the RMS of the field, over all central
/// directions and views [RH02, sec. 5; Ram02, eq. 5.15].
pub(crate) fn rms_of_cuts(lighting: &Expansion, brdf: &BrdfCoefficients) -> Vec<f64> {
    let light = energy_per_degree(lighting);
    let energy = |p: usize| -> f64 {
        (0..=brdf.f().get().min(light.len() - 1)).map(|l| energy_at(&light, brdf, l, p)).sum()
    };
    let energies: Vec<f64> = (0..=brdf.p().get()).map(energy).collect();
    let whole: f64 = energies.iter().sum();
    let mut left = whole;
    let mut of_p = |energy: &f64| {
        left -= energy;
        if whole > 0.0 { (left / whole).max(0.0).sqrt() } else { 0.0 }
    };
    let mut shares: Vec<f64> = energies.iter().map(&mut of_p).collect();
    // Rounding must not leave an error where nothing is cut.
    if let Some(last) = shares.last_mut() {
        *last = 0.0;
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(p: usize, p95: f64) -> MapDegree {
        let p = Degree::new(p).unwrap();
        MapDegree { p, p95, p99: 2.0 * p95, rms: 0.5 * p95, is_met: false, enough: None, field: p }
    }

    #[test]
    fn the_least_degree_that_is_enough_is_taken_or_the_best_small_one() {
        let measured: Vec<MapDegree> = [0.9, 0.5, 0.3, 0.35, 0.31, 0.2, 0.1, 0.05]
            .into_iter()
            .enumerate()
            .map(|(p, e)| at(p, e))
            .collect();
        let chosen = |tolerance, most_p| {
            let map = DegreeRule { tolerance, most_p, terms: Terms::All }.choose(&measured).unwrap();
            (map.p.get(), map.is_met, map.enough)
        };
        let stops = MapTolerance::Stops;
        assert_eq!(chosen(stops([0.5, 1.0]), 4), (1, true, None));
        // Both numbers count, and RMS in their place.
        assert_eq!(chosen(stops([0.5, 0.6]), 4), (2, true, None));
        assert_eq!(chosen(MapTolerance::Rms(0.25), 4), (1, true, None));
        // None up to 4 is enough, and 6 is; if 6 is allowed, it is taken.
        assert_eq!(chosen(stops([0.1, 0.4]), 4), (2, false, Some(6)));
        assert_eq!(chosen(stops([0.1, 0.4]), 6), (6, true, None));
        // What is allowed and not enough is not taken either, and less than 4 may be allowed.
        assert_eq!(chosen(stops([0.01, 0.02]), 7), (2, false, None));
        assert_eq!(chosen(stops([0.01, 0.02]), 1), (1, false, None));
        // Zonal terms are few at any P.
        let zonal = DegreeRule { tolerance: stops([0.01, 0.02]), most_p: 6, terms: Terms::Zonal };
        assert_eq!(zonal.choose(&measured).map(|map| map.p.get()), Some(6));
        assert!(zonal.choose(&[]).is_none());
    }
}
