//! Distant light as the integrals of its radiance over the texels of a lat-long grid.

use std::f64::consts::{PI, TAU};

use envmap::Environment;
use sh::{CellGrid, CellTransform, Degree, Light, Lighting};
use sphere::{DVec3, LatLong};

use super::mean;
use crate::Error;

/// The integral of radiance over each texel, RGB, and of radiance times direction.
///
/// Nothing is negative. Of light that has negative parts (a series that rings), each channel's positive part
/// is scaled so that its integral is that of the whole.
#[derive(Clone, Debug)]
pub struct LightMasses {
    grid: LatLong,
    flux: Vec<[f64; 3]>,
    moments: Vec<DVec3>,
    negative: f64,
}

/// The least rows for a series: fine enough that its regions have smooth borders.
const LEAST_ROWS: usize = 64;

/// The most rows: finer regions than any rig has. The integrals over them are exact for any degree.
const MOST_ROWS: usize = 1024;

/// A disk beside a series is divided into this many points.
const POINTS: usize = 256;

impl LightMasses {
    /// The texels of an environment: radiance times solid angle.
    ///
    /// # Errors
    /// [`Error::NoMass`] if no texel is positive.
    pub fn of_environment(environment: &Environment) -> Result<Self, Error> {
        let grid = environment.grid();
        let rows = environment.pixels().chunks(grid.width).enumerate();
        let flux = rows.flat_map(|(row, texels)| {
            let solid_angle = grid.solid_angle(row);
            texels.iter().map(move |texel| texel.map(|value| f64::from(value) * solid_angle))
        });
        let masses = Self::of_flux(grid, flux.collect());
        if masses.has_mass() { Ok(masses) } else { Err(Error::NoMass) }
    }

    /// The exact integrals of a series over the texels of a grid, a power of two of rows, at least three
    /// for each degree but at most 1024, and the lights beside it, each in the texels that its disk covers.
    ///
    /// # Errors
    /// [`Error::NotFinite`] and [`Error::LightNotFinite`] with the first number that is not finite;
    /// [`Error::NoMass`] if nothing is positive.
    ///
    /// # Example: the flux of a constant series
    /// ```
    /// use std::f64::consts::PI;
    /// let one = vec![[(4.0 * PI).sqrt(); 3]];
    /// let one = sh::Expansion::from_coefficients(sh::Degree::ZERO, one).expect("one coefficient");
    /// let masses = sampling::LightMasses::of_lighting(&one.into())?;
    /// assert!((masses.total()[0] - 4.0 * PI).abs() < 1e-12);
    /// # Ok::<(), sampling::Error>(())
    /// ```
    pub fn of_lighting(lighting: &Lighting) -> Result<Self, Error> {
        check(lighting)?;
        let degree = lighting.series.degree();
        let grid = LatLong::with_rows(rows(degree));
        let cells = CellTransform::new(CellGrid::lat_long(grid), degree);
        let mut masses = Self::of_flux(grid, cells.masses(lighting.series.coefficients()));
        lighting.lights.iter().for_each(|light| masses.add(light));
        if masses.has_mass() { Ok(masses) } else { Err(Error::NoMass) }
    }

    /// Makes masses of integrals over texels of either sign.
    fn of_flux(grid: LatLong, mut flux: Vec<[f64; 3]>) -> Self {
        let (mut positive, mut total) = ([0.0; 3], [0.0; 3]);
        for rgb in &flux {
            for c in 0..3 {
                positive[c] += rgb[c].max(0.0);
                total[c] += rgb[c];
            }
        }
        let negative: f64 = (0..3).map(|c| positive[c] - total[c]).sum();
        let all = positive.iter().sum::<f64>() + negative;
        // If the whole is negative, there is only the positive part.
        let is_positive = total.iter().sum::<f64>() > 0.0;
        let scale: [f64; 3] = std::array::from_fn(|c| match is_positive {
            true if positive[c] > 0.0 => total[c].max(0.0) / positive[c],
            _ => 1.0,
        });
        let centres = Centres::new(grid);
        let mut moments = Vec::with_capacity(flux.len());
        for (index, rgb) in flux.iter_mut().enumerate() {
            *rgb = std::array::from_fn(|c| rgb[c].max(0.0) * scale[c]);
            moments.push(centres.of(index) * mean(*rgb));
        }
        Self { grid, flux, moments, negative: if all > 0.0 { negative / all } else { 0.0 } }
    }

    fn add(&mut self, light: &Light) {
        let count = if light.radius > 1e-9 { POINTS } else { 1 };
        let part = light.flux().map(|flux| flux.max(0.0) / count as f64);
        for direction in light.directions(count) {
            let (column, row) = self.grid.position(direction);
            let nearest = |at: f64, count: usize| (at.round().max(0.0) as usize).min(count - 1);
            let index = nearest(row, self.grid.height) * self.grid.width + nearest(column, self.grid.width);
            (0..3).for_each(|c| self.flux[index][c] += part[c]);
            self.moments[index] += direction.vector() * mean(part);
        }
    }

    fn has_mass(&self) -> bool {
        self.flux.iter().flatten().any(|value| *value > 0.0)
    }

    /// The grid of the texels.
    pub fn grid(&self) -> LatLong {
        self.grid
    }

    /// The integral over the sphere.
    pub fn total(&self) -> [f64; 3] {
        self.flux.iter().fold([0.0; 3], |sum, rgb| std::array::from_fn(|c| sum[c] + rgb[c]))
    }

    /// The share of the light's absolute value, integrated over texels and channels, that was negative.
    pub fn negative_share(&self) -> f64 {
        self.negative
    }

    /// The integral over a texel.
    pub(super) fn flux_of(&self, texel: usize) -> [f64; 3] {
        self.flux[texel]
    }

    /// The integral of the direction times the mean of the channels over a texel.
    pub(super) fn moment_of(&self, texel: usize) -> DVec3 {
        self.moments[texel]
    }

    /// The mean of the channels of a texel's integral.
    pub(super) fn weight(&self, texel: usize) -> f64 {
        mean(self.flux[texel])
    }

    /// The irradiance of a surface; a texel is above its horizon or below it as a whole.
    pub(super) fn irradiance(&self, normal: DVec3) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (flux, moment) in self.flux.iter().zip(&self.moments) {
            let weight = mean(*flux);
            if weight > 0.0 {
                let cosine = (normal.dot(*moment) / weight).max(0.0);
                (0..3).for_each(|c| sum[c] += flux[c] * cosine);
            }
        }
        sum
    }
}

/// Rows that resolve a series.
fn rows(degree: Degree) -> usize {
    (3 * (degree.get() + 1)).next_power_of_two().clamp(LEAST_ROWS, MOST_ROWS)
}

fn check(lighting: &Lighting) -> Result<(), Error> {
    let values = lighting.series.coefficients().as_flattened().iter();
    if let Some((index, value)) = values.enumerate().find(|(_, value)| !value.is_finite()) {
        let (row, l) = (index / 3, (index / 3).isqrt());
        return Err(Error::NotFinite { l, m: row as isize - (l * l + l) as isize, value: *value });
    }
    let sound =
        |light: &Light| light.radius.is_finite() && light.irradiance.iter().all(|value| value.is_finite());
    match lighting.lights.iter().position(|light| !sound(light)) {
        Some(index) => Err(Error::LightNotFinite { index }),
        None => Ok(()),
    }
}

/// The mean direction over each texel; not a unit vector.
struct Centres {
    grid: LatLong,
    /// The part along the horizon and the height of each row.
    rows: Vec<[f64; 2]>,
    columns: Vec<[f64; 2]>,
}

impl Centres {
    fn new(grid: LatLong) -> Self {
        let (step, half) = (PI / grid.height as f64, PI / grid.width as f64);
        let row = |row: usize| {
            // Integrals of sin^2 and of sin cos over the row, and of cos(phi) over a column: 2 sin(w / 2).
            let twice = 2.0 * grid.theta(row);
            let along = (step - math::cos(twice) * math::sin(step)) / 2.0 * 2.0 * math::sin(half);
            let up = math::sin(twice) * math::sin(step) / 2.0 * TAU / grid.width as f64;
            [along / grid.solid_angle(row), up / grid.solid_angle(row)]
        };
        let column = |column: usize| {
            let (sine, cosine) = math::sin_cos(grid.phi(column));
            [cosine, sine]
        };
        Self {
            grid,
            rows: (0..grid.height).map(row).collect(),
            columns: (0..grid.width).map(column).collect(),
        }
    }

    fn of(&self, texel: usize) -> DVec3 {
        let [along, up] = self.rows[texel / self.grid.width];
        let [cosine, sine] = self.columns[texel % self.grid.width];
        DVec3::new(along * cosine, along * sine, up)
    }
}
