//! The weights of directions that were drawn: the integrand over the density, f / p.
//!
//! The mean of f(w) / p(w) over directions w of density p is an estimate of the integral of f over the
//! directions that can be drawn (Jarosz, Carr and Jensen 2009, section 2). Its variance is that of one weight
//! over the number of directions if they are independent, and is usually less if they are stratified.

use rayon::prelude::*;
use sh::{Basis, Degree};
use sphere::{DVec3, Direction};

use crate::{Density, TexelLight};

/// The directions that a thread weighs at a time. Blocks do not depend on the number of threads.
const BLOCK: usize = 1024;

/// What the weights of directions integrate: a function given by spherical harmonics, light, or the product
/// of both.
///
/// # Example: the mean weight of a lobe is its integral
/// ```
/// use sampling::{Density, Integrand, LeafShape, Moments, Options, Points, Sampler, Tables};
/// use sh::Degree;
///
/// // 1 + z, whose integral is 4 pi
/// let (degree, f) = (Degree::new(1)?, [3.544908, 0.0, 2.046653, 0.0]);
/// let options = Options { shape: LeafShape::Exact, ..Options::default() };
/// let sampler = Sampler::new(&Tables::new(degree), &f, options)?;
/// let mut points = [[0.0; 2]; 64];
/// Points::Sobol { seed: Some(1) }.fill(0, &mut points);
/// let (mut directions, mut densities) = ([[0.0; 3]; 64], [0.0; 64]);
/// sampler.sample_into(&points, &mut directions, &mut densities);
/// let mut weights = [0.0; 64];
/// Integrand::of_function(degree, &f, Density::Positive).weigh_into(&directions, &densities, &mut weights);
/// let Moments { mean, variance } = Moments::of(&weights);
/// assert!((mean / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-5 && variance < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Integrand<'a> {
    light: Option<&'a TexelLight>,
    function: Option<Function<'a>>,
}

/// A function given by spherical harmonics, and which function of it is the density.
struct Function<'a> {
    basis: Basis,
    coefficients: &'a [f64],
    density: Density,
}

impl<'a> Integrand<'a> {
    /// The function f with these coefficients, in order l*l + l + m: with [`Density::Absolute`] f itself, so
    /// that weights have its sign; with [`Density::Positive`] max(f, 0), the part that is drawn.
    ///
    /// # Panics
    /// If the number of coefficients is not that of the degree.
    pub fn of_function(degree: Degree, coefficients: &'a [f64], density: Density) -> Self {
        assert_eq!(coefficients.len(), degree.rows(), "one coefficient for each row");
        let function = Function { basis: Basis::new(degree), coefficients, density };
        Self { light: None, function: Some(function) }
    }

    /// The number of the texel that a direction looks at.
    pub fn of_light(light: &'a TexelLight) -> Self {
        Self { light: Some(light), function: None }
    }

    /// The integrand times light.
    #[must_use]
    pub fn times(self, light: &'a TexelLight) -> Self {
        Self { light: Some(light), ..self }
    }

    /// f / p of each direction, p being the density, in 1/sr, with which it was drawn: signed, in the unit of
    /// f times sr. 0 if p is 0. The directions are unit vectors.
    ///
    /// Runs on the threads of the rayon pool that it is called in; every weight is the same for any number of
    /// threads.
    ///
    /// # Panics
    /// If the slices have different lengths.
    pub fn weigh_into(&self, directions: &[[f32; 3]], densities: &[f32], weights: &mut [f64]) {
        assert!(directions.len() == weights.len() && densities.len() == weights.len(), "one of each");
        let drawn = directions.par_chunks(BLOCK).zip(densities.par_chunks(BLOCK));
        drawn.zip(weights.par_chunks_mut(BLOCK)).for_each(|((directions, densities), weights)| {
            let rows = self.function.as_ref().map_or(0, |function| function.coefficients.len());
            let mut harmonics = vec![0.0; rows];
            for ((direction, density), weight) in directions.iter().zip(densities).zip(weights) {
                *weight = match *density > 0.0 {
                    true => self.at(*direction, &mut harmonics) / f64::from(*density),
                    false => 0.0,
                };
            }
        });
    }

    fn at(&self, direction: [f32; 3], harmonics: &mut [f64]) -> f64 {
        let w = Direction::normalised(DVec3::from_array(direction.map(f64::from)));
        let function = self.function.as_ref().map_or(1.0, |function| function.at(w, harmonics));
        function * self.light.map_or(1.0, |light| light.toward(w))
    }
}

impl Function<'_> {
    fn at(&self, w: Direction, harmonics: &mut [f64]) -> f64 {
        self.basis.evaluate_into(w, harmonics);
        let value = harmonics.iter().zip(self.coefficients).map(|(y, f)| y * f).sum::<f64>();
        match self.density {
            Density::Positive => value.max(0.0),
            Density::Absolute => value,
        }
    }
}

/// The mean and the variance of weights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// The mean: an estimate of the integral.
    pub mean: f64,
    /// The variance of one weight, with n - 1 in the denominator; 0 for fewer than two weights.
    pub variance: f64,
}

impl Moments {
    /// The moments of weights, added in their order.
    pub fn of(weights: &[f64]) -> Self {
        let count = weights.len() as f64;
        if weights.is_empty() {
            return Self::default();
        }
        let mean = weights.iter().sum::<f64>() / count;
        let squares = weights.iter().map(|weight| (weight - mean) * (weight - mean)).sum::<f64>();
        Self { mean, variance: if weights.len() > 1 { squares / (count - 1.0) } else { 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use envmap::Environment;
    use sphere::LatLong;

    use super::*;
    use crate::{
        LeafShape, Options, Points, ProductMasses, ProductOptions, ProductSampler, ProductTables, SUM,
        Sampler, Tables,
    };

    const COUNT: usize = 4096;

    fn points() -> Vec<[f32; 2]> {
        let mut points = vec![[0.0; 2]; COUNT];
        Points::Random { seed: 3 }.fill(0, &mut points);
        points
    }

    /// 0.3 + z, negative in a third of all directions: coefficients, degree, integral, positive part's.
    fn signed() -> (Degree, [f64; 4], f64, f64) {
        let pi = std::f64::consts::PI;
        let f = [0.3 * (4.0 * pi).sqrt(), 0.0, (4.0 * pi / 3.0).sqrt(), 0.0];
        // 2 pi times the integral of 0.3 + z from -0.3 to 1.
        (Degree::new(1).unwrap(), f, 0.3 * 4.0 * pi, pi * 1.3 * 1.3)
    }

    fn lit() -> TexelLight {
        let grid = LatLong::with_rows(16);
        let texel = |index: usize| [(index * 7 % 5) as f32, 1.0, if index == 200 { 50.0 } else { 0.0 }];
        TexelLight::new(&Environment::new(grid, (0..grid.len()).map(texel).collect()).unwrap(), SUM).unwrap()
    }

    #[test]
    fn signed_weights_estimate_the_integral_and_positive_ones_that_of_the_positive_part() {
        let (degree, f, integral, positive) = signed();
        let tables = Tables::new(degree);
        for (density, expected) in [(Density::Absolute, integral), (Density::Positive, positive)] {
            let options = Options { density, shape: LeafShape::Exact, ..Options::default() };
            let sampler = Sampler::new(&tables, &f, options).unwrap();
            let (mut directions, mut densities) = (vec![[0.0; 3]; COUNT], vec![0.0; COUNT]);
            sampler.sample_into(&points(), &mut directions, &mut densities);
            let mut weights = vec![0.0; COUNT];
            let integrand = Integrand::of_function(degree, &f, density);
            integrand.weigh_into(&directions, &densities, &mut weights);
            let Moments { mean, variance } = Moments::of(&weights);
            let error = (variance / COUNT as f64).sqrt();
            assert!((mean - expected).abs() < 4.0 * error, "{density:?}: {mean} {expected} {error}");
            assert_eq!(weights.iter().any(|weight| *weight < 0.0), density == Density::Absolute);
        }
    }

    #[test]
    fn texels_alone_have_equal_weights_and_the_product_has_its_integral() {
        let light = lit();
        let grid = light.grid();
        let (degree, f, ..) = signed();
        let sum = |f: &dyn Fn(Direction) -> f64| -> f64 {
            (0..grid.len())
                .map(|index| {
                    let (row, column) = (index / grid.width, index % grid.width);
                    light.value(row, column) * f(grid.direction(row, column)) * grid.solid_angle(row)
                })
                .sum()
        };
        let draw = |tables: &[f64], degree: Degree| {
            let of_light = ProductTables::new(&light, &Tables::new(degree));
            let options = ProductOptions {
                density: Density::Absolute,
                masses: ProductMasses::BilinearTexels,
                ..ProductOptions::default()
            };
            let sampler = ProductSampler::new(&of_light, tables, options).unwrap();
            let (mut directions, mut densities) = (vec![[0.0; 3]; COUNT], vec![0.0; COUNT]);
            sampler.sample_into(&points(), &mut directions, &mut densities);
            (directions, densities)
        };
        let mut weights = vec![0.0; COUNT];
        let (directions, densities) = draw(&[1.0], Degree::ZERO);
        Integrand::of_light(&light).weigh_into(&directions, &densities, &mut weights);
        let whole = sum(&|_| 1.0);
        assert!(weights.iter().all(|weight| (weight / whole - 1.0).abs() < 1e-5), "{whole}");
        let (directions, densities) = draw(&f, degree);
        let product = Integrand::of_function(degree, &f, Density::Absolute).times(&light);
        product.weigh_into(&directions, &densities, &mut weights);
        let Moments { mean, variance } = Moments::of(&weights);
        // Linear functions are off by (pi / 16)^2 / 24 = 0.2 % at the centres of texels.
        let (expected, error) = (sum(&|w| 0.3 + w.vector().z), (variance / COUNT as f64).sqrt());
        assert!((mean - expected).abs() < 4.0 * error + 2e-3 * whole, "{mean} {expected} {error}");
    }

    #[test]
    fn moments_are_those_of_the_definition() {
        assert_eq!(Moments::of(&[]), Moments::default());
        assert_eq!(Moments::of(&[3.0]), Moments { mean: 3.0, variance: 0.0 });
        assert_eq!(Moments::of(&[1.0, -1.0, 3.0]), Moments { mean: 1.0, variance: 4.0 });
    }
}
