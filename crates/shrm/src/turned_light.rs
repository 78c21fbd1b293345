//! A light in the frames of central directions that are spread over the sphere: what the choice of degrees
//! computes from the light alone. It is most of the work of that choice, and the same for every material, so
//! a caller may keep it.

use brdf::BrdfCoefficients;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::{F64x4, LANES, load, store};
use sh::{Degree, Expansion, Stop, Stopped, rotate_orders};
use sphere::spiral;

use crate::frame;

/// F is rounded up to a multiple of this, so that a material whose degree is a little higher needs no other
/// light.
const STEP: usize = 32;

/// Views of a central direction that are summed at once.
pub(crate) const VIEWS: usize = 16;

/// One number of each view.
pub(crate) type OfViews = [F64x4; VIEWS / LANES];

/// A light's series in the frames of its central directions, in the orders that a material of some degrees
/// reflects.
#[derive(Debug)]
pub struct TurnedLight {
    /// F and P.
    degrees: [Degree; 2],
    centrals: Vec<LightOrders>,
}

/// The orders |m| <= P of a series.
#[derive(Debug)]
pub(crate) struct LightOrders {
    /// P.
    highest: usize,
    /// The coefficients of the cosines and of the sines, l after l, m = 0 ..= min(l, P).
    parts: [Vec<[f64; 3]>; 2],
}

impl TurnedLight {
    /// The degrees F and P that the turned light has to have for these coefficients of a material: the same
    /// for coefficients whose F differs little.
    pub fn needed(series: &Expansion, brdf: &BrdfCoefficients) -> [Degree; 2] {
        let f = brdf.f().get().next_multiple_of(STEP);
        [series.degree().min(Degree::new(f).unwrap_or(Degree::MAX)), brdf.p()]
    }

    /// The degrees F and P that it has. The coefficients of each degree are the same, to the bit, in a light
    /// that has more of them.
    pub fn degrees(&self) -> [Degree; 2] {
        self.degrees
    }

    /// The light at so many central directions. `stop` is asked for each, every few milliseconds on every
    /// thread.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn new(
        series: &Expansion,
        [f, p]: [Degree; 2],
        centrals: usize,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let series = series.to_degree(f);
        let turned = |index: usize| {
            stop.check()?;
            let frame = frame(spiral(index, centrals)).inverse();
            Ok(LightOrders::of(&rotate_orders(&series, frame, p.get()), p.get()))
        };
        let centrals: Result<_, Stopped> =
            (0..centrals).into_par_iter().with_max_len(2).map(turned).collect();
        Ok(Self { degrees: [f, p], centrals: centrals? })
    }

    /// The bytes that it takes.
    pub fn bytes(&self) -> usize {
        let parts = self.centrals.iter().flat_map(|orders| &orders.parts);
        parts.map(|part| size_of_val(&part[..])).sum()
    }

    /// The number of central directions.
    pub(crate) fn len(&self) -> usize {
        self.centrals.len()
    }

    pub(crate) fn at(&self, central: usize) -> &LightOrders {
        &self.centrals[central]
    }
}

impl LightOrders {
    fn of(series: &Expansion, highest: usize) -> Self {
        let mut parts = [Vec::new(), Vec::new()];
        for l in 0..=series.degree().get() {
            for m in 0..=l.min(highest) {
                parts[0].push(series.coefficients()[l * l + l + m]);
                parts[1].push(series.coefficients()[l * l + l - m]);
            }
        }
        Self { highest, parts }
    }

    /// The place of the first entry of l.
    fn start(&self, l: usize) -> usize {
        let short = l.min(self.highest + 1);
        short * (short + 1) / 2 + (l - short) * (self.highest + 1)
    }
}

/// Sums a reflection at views of one central direction, for each of some F and P.
pub(crate) struct Sums<'a> {
    pub(crate) light: &'a LightOrders,
    pub(crate) brdf: &'a BrdfCoefficients,
    /// The degrees F, from the lowest on.
    pub(crate) f: &'a [usize],
    /// The degrees P, from the lowest on.
    pub(crate) p: &'a [usize],
    /// The harmonics of the views, row after row up to the material's P.
    pub(crate) views: &'a [OfViews],
}

impl WithSimd for Sums<'_> {
    /// The radiance of the three channels for each F and P, [F, P], and that of all degrees.
    type Output = Vec<[OfViews; 3]>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { light, brdf, f, p, views } = self;
        let side = brdf.p().get() + 1;
        let mut rows = [0, 1].map(|_| vec![[0.0; 3]; side * side]);
        let mut radiance = Vec::with_capacity(f.len() * p.len() + 1);
        let mut done = 0;
        for (index, f) in f.iter().enumerate() {
            for l in done..=*f {
                let rho = &brdf.rho()[l * side * side..][..side * side];
                for (rows, light) in rows.iter_mut().zip(&light.parts) {
                    add(rows, rho, &light[self.light.start(l)..], l, side);
                }
            }
            done = f + 1;
            let is_last = index + 1 == self.f.len();
            let most = if is_last { side } else { p.last().map_or(0, |p| p + 1) };
            let mut sums = [[simd.splat_f64s(0.0); VIEWS / LANES]; 3];
            let mut tried = p.iter().peekable();
            for degree in 0..most {
                for row in degree * degree..(degree + 1) * (degree + 1) {
                    let middle = degree * degree + degree;
                    let value = match row < middle {
                        true => rows[1][degree * side + middle - row],
                        false => rows[0][degree * side + row - middle],
                    };
                    for channel in 0..3 {
                        let value = simd.splat_f64s(value[channel]);
                        for k in 0..VIEWS / LANES {
                            sums[channel][k] =
                                simd.mul_add_f64s(value, load(simd, &views[row][k]), sums[channel][k]);
                        }
                    }
                }
                if tried.next_if_eq(&&degree).is_some() {
                    radiance.push(stored(simd, &sums));
                }
            }
            if is_last {
                radiance.push(stored(simd, &sums));
            }
        }
        radiance
    }
}

/// Adds the terms of one l to the coefficients b_pq: see `evaluation.rs`.
#[inline(always)]
fn add(rows: &mut [[f64; 3]], rho: &[[f64; 3]], light: &[[f64; 3]], l: usize, side: usize) {
    for (p, (rows, rho)) in rows.chunks_exact_mut(side).zip(rho.chunks_exact(side)).enumerate() {
        let count = p.min(l) + 1;
        let rows = rows[..count].as_flattened_mut();
        let (rho, light) = (rho[..count].as_flattened(), light[..count].as_flattened());
        for ((row, rho), light) in rows.iter_mut().zip(rho).zip(light) {
            *row += rho * light;
        }
    }
}

#[inline(always)]
fn stored<S: Simd>(simd: S, sums: &[[S::f64s; VIEWS / LANES]; 3]) -> [OfViews; 3] {
    let mut values = [[F64x4::ZERO; VIEWS / LANES]; 3];
    for (values, sums) in values.iter_mut().zip(sums) {
        for (value, sum) in values.iter_mut().zip(sums) {
            store(simd, *sum, value);
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A light that is kept grows with what materials need of it: outputs may not depend on what was built
    /// before.
    #[test]
    fn a_light_of_higher_degrees_has_the_same_bits_at_the_lower_ones() {
        let degree = |l: usize| Degree::new(l).unwrap();
        let rows = (0..degree(90).rows()).map(|row| [1.0, 0.3, -0.7].map(|a| a / (1.0 + (row % 37) as f64)));
        let series = Expansion::from_coefficients(degree(90), rows.collect()).unwrap();
        let light = |f, p| TurnedLight::new(&series, [degree(f), degree(p)], 5, Stop::NEVER).unwrap();
        let (low, high) = (light(32, 9), light(90, 24));
        assert_eq!((low.degrees(), high.degrees()), ([degree(32), degree(9)], [degree(90), degree(24)]));
        for (low, high) in low.centrals.iter().zip(&high.centrals) {
            for l in 0..=32 {
                for m in 0..=l.min(9) {
                    let at = |orders: &LightOrders| {
                        orders.parts.each_ref().map(|part| part[orders.start(l) + m].map(f64::to_bits))
                    };
                    assert_eq!(at(low), at(high), "{l} {m}");
                }
            }
        }
    }
}
