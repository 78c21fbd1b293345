//! A lobe in as many spherical harmonics as wavelets: what the points of each miss.
//!
//! Where a series or a sum of few wavelets is zero or negative, no point is drawn, though the lobe is
//! positive there: an estimate of the lobe that these points make lacks that share of it, always.

use sampling::{Haar, Options, Sampler};
use sampling::{ProductOptions, ProductSampler, ProductTables, Sample, Tables, TexelLight};
use sh::Degree;
use sphere::{DVec3, Direction, LatLong, spiral};

use super::phong::Phong;
use super::picture::{Picture, grey, mix};
use super::{first, vector};

/// A lobe of the talk.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Phong's exponent.
    pub exponent: u32,
    /// The degree of its series: (degree + 1)^2 coefficients, and as many wavelets.
    pub degree: usize,
}

/// The lobes of the talk: 64, 169 and 25 coefficients.
pub const CASES: [Case; 3] =
    [Case { exponent: 10, degree: 7 }, Case { exponent: 20, degree: 12 }, Case { exponent: 3, degree: 4 }];

/// The map that wavelets divide.
pub const GRID: LatLong = LatLong { width: 128, height: 64 };

/// Axes over which what wavelets lose is averaged: it depends on where the lobe lies on the map.
const AXES: usize = 64;

/// The share of a lobe where its density is zero or negative.
#[derive(Clone, Copy, Debug)]
pub struct Lost {
    /// The share of the series: the same for every axis.
    pub harmonics: f64,
    /// The share of the wavelets, in the mean over axes.
    pub wavelets: f64,
    /// The share of the wavelets, for the axis where they lose most.
    pub wavelets_at_worst: f64,
    /// The axis where the wavelets lose most.
    pub worst: Direction,
}

impl Case {
    fn degree(self) -> Result<Degree, sh::DegreeTooHigh> {
        Degree::new(self.degree)
    }

    /// The shares of the lobe that no point reaches.
    ///
    /// # Errors
    /// If the degree is too high.
    pub fn lost(self) -> Result<Lost, Box<dyn std::error::Error>> {
        let harmonics = Phong { exponent: self.exponent, axis: Direction::Z }.lost(self.degree()?);
        let of = |axis| {
            let phong = Phong { exponent: self.exponent, axis };
            Ok((lost(&phong, &wavelets(&phong, self.degree()?.rows())), axis))
        };
        let shares = (0..AXES)
            .map(|index| of(spiral(index, AXES)))
            .collect::<Result<Vec<_>, Box<dyn std::error::Error>>>()?;
        let worst = shares.iter().max_by(|a, b| a.0.total_cmp(&b.0)).ok_or("there are axes")?;
        Ok(Lost {
            harmonics,
            wavelets: shares.iter().map(|(share, _)| share).sum::<f64>() / shares.len() as f64,
            wavelets_at_worst: worst.0,
            worst: worst.1,
        })
    }
}

/// The `count` largest wavelets of a lobe's texels, as the values they add up to.
pub(super) fn wavelets(phong: &Phong, count: usize) -> Vec<f64> {
    let texel = |index: usize| [phong.value(texel_direction(index)) as f32];
    let texels: Vec<[f32; 1]> = (0..GRID.len()).map(texel).collect();
    let mut haar = Haar::new(&[1.0; GRID.height], &[1.0; GRID.width], texels);
    haar.keep(&haar.by_size()[..count]);
    haar.values().into_iter().map(|[value]| value.into()).collect()
}

fn texel_direction(index: usize) -> DVec3 {
    GRID.direction(index / GRID.width, index % GRID.width).vector()
}

/// The share of the lobe in texels that are zero or negative.
fn lost(phong: &Phong, values: &[f64]) -> f64 {
    let (mut lost, mut all) = (0.0, 0.0);
    for (index, value) in values.iter().enumerate() {
        let mass = phong.value(texel_direction(index)) * GRID.solid_angle(index / GRID.width);
        all += mass;
        if *value <= 0.0 {
            lost += mass;
        }
    }
    lost / all
}

/// The number of points on a map.
const COUNT: usize = 512;

/// Texels of the map to pixels.
const SCALE: usize = 3;

/// Where the lobe is positive and its density is not.
const MISSED: [u8; 3] = [70, 110, 220];

/// Maps of the lobes of [`CASES`], about the axes where wavelets lose most: the points of harmonics above,
/// those of wavelets below; blue where there is more than 1 % of the lobe's largest value and no point can
/// be.
///
/// # Errors
/// If a degree is too high.
pub fn draw() -> Result<Picture, Box<dyn std::error::Error>> {
    let points = first(super::POINTS[1], COUNT);
    let (mut above, mut below) = (Vec::new(), Vec::new());
    for case in CASES {
        let phong = Phong { exponent: case.exponent, axis: case.lost()?.worst };
        let degree = case.degree()?;
        let coefficients = phong.coefficients(degree);
        let harmonics = Sampler::new(&Tables::new(degree), &coefficients, Options::default())?;
        let basis = sh::Basis::new(degree);
        let mut rows = vec![0.0; degree.rows()];
        let series: Vec<f64> = (0..GRID.len())
            .map(|index| {
                basis.evaluate_into(Direction::normalised(texel_direction(index)), &mut rows);
                rows.iter().zip(&coefficients).map(|(y, f)| y * f).sum()
            })
            .collect();
        above.push(map(&phong, &series, points.iter().map(|point| harmonics.sample(*point))));
        let values = wavelets(&phong, degree.rows());
        let sampler = texel_sampler(&values)?;
        below.push(map(&phong, &values, points.iter().map(|point| sampler.sample(*point))));
    }
    Ok(Picture::sheet(&[above, below]))
}

/// Draws texels by the positive part of their values.
pub(super) fn texel_sampler(values: &[f64]) -> Result<ProductSampler, Box<dyn std::error::Error>> {
    let pixels = values.iter().map(|value| [value.max(0.0) as f32, 0.0, 0.0]).collect();
    let environment = envmap::Environment::new(GRID, pixels).ok_or("a value is not finite")?;
    let light = TexelLight::new(&environment, sampling::SUM)?;
    let tables = ProductTables::new(&light, &Tables::new(Degree::new(0)?));
    Ok(ProductSampler::new(&tables, &[1.0], ProductOptions::default())?)
}

fn map(phong: &Phong, density: &[f64], samples: impl Iterator<Item = Sample>) -> Picture {
    let largest = phong.largest();
    let mut picture = Picture::new(SCALE * GRID.width, SCALE * GRID.height, |column, row| {
        let index = row / SCALE * GRID.width + column / SCALE;
        let value = phong.value(texel_direction(index)) / largest;
        let shown = grey(value);
        if density[index] <= 0.0 && value > 0.01 { mix(shown, MISSED, 0.8) } else { shown }
    });
    for sample in samples {
        let (column, row) = GRID.position(Direction::normalised(vector(sample.direction)));
        let place = |texel: f64| (texel + 0.5) * SCALE as f64;
        picture.dot([place(column), place(row)], 1.6);
    }
    picture
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may panic")]

    use super::*;

    #[test]
    fn all_wavelets_are_the_lobe_and_few_lose_some_of_it() {
        let phong = Phong { exponent: 20, axis: Direction::from_angles(1.1, 0.4) };
        let all = wavelets(&phong, GRID.len());
        for (index, value) in all.iter().enumerate() {
            assert!((value - phong.value(texel_direction(index))).abs() < 1e-12);
        }
        assert!(lost(&phong, &all) < 1e-12);
        let few = lost(&phong, &wavelets(&phong, 169));
        assert!((1e-5..1e-2).contains(&few), "{few}");
    }

    #[test]
    fn the_points_of_wavelets_are_where_their_sum_is_positive() {
        let phong = Phong { exponent: 10, axis: Direction::from_angles(1.1, 0.4) };
        let values = wavelets(&phong, 64);
        let sampler = texel_sampler(&values).unwrap();
        for point in first(super::super::POINTS[0], 2000) {
            let w = Direction::normalised(vector(sampler.sample(point).direction));
            let (column, row) = GRID.position(w);
            let index = |x: f64, count: usize| ((x + 0.5).max(0.0) as usize).min(count - 1);
            assert!(values[index(row, GRID.height) * GRID.width + index(column, GRID.width)] > 0.0);
        }
    }
}
