//! The ground truth of a report: all light, added up for each pixel.
//!
//! An environment with suns cannot be made small without moving or blurring them, and at its full size the
//! sum takes minutes. The sum is linear, so the image is split: what a texel has above [`BRIGHTER`] times the
//! mean is summed at the image's own resolution, and the rest, which then has no peaks, as means over the
//! texels of a coarser grid. Black texels are not read, so the bright part costs no more than its few texels.

use brdf::Material;
use engine::Failure;
use envmap::Environment;
use sh::Tolerance;
use shrm::reference::{Cull, Reference};
use sphere::{Direction, LatLong};

/// What a texel has above this many times the mean radiance is summed at full resolution.
const BRIGHTER: f64 = 10.0;

/// The most bright texels that are summed one by one. If there are more, they are averaged over blocks of
/// texels: then they cover so much of the sphere of a large image that no single one matters.
const MOST_BRIGHT: usize = 1 << 13;

/// The share of a lobe that may be ignored in the coarse part, which has no peaks.
const CULLED: f64 = 1e-5;

/// The mean radiance over the sphere and the three channels.
pub(crate) fn mean(environment: &Environment) -> f64 {
    environment.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI)
}

/// An environment in two parts, whose sum has its light.
pub(crate) struct SplitEnvironment {
    bright: Option<Environment>,
    rest: Environment,
}

impl SplitEnvironment {
    /// The parts, the rest averaged to at most `rows` rows.
    pub(crate) fn new(environment: &Environment, rows: usize) -> Result<Self, Failure> {
        let (grid, threshold) = (environment.grid(), BRIGHTER * mean(environment));
        let (mut bright, mut rest) = (vec![[0.0; 3]; grid.len()], environment.pixels().to_vec());
        for (bright, rest) in bright.iter_mut().zip(&mut rest) {
            let radiance = rest.iter().map(|&value| f64::from(value)).sum::<f64>() / 3.0;
            if radiance > threshold && threshold > 0.0 {
                let kept = rest.map(|value| (f64::from(value) * threshold / radiance) as f32);
                *bright = std::array::from_fn(|channel| rest[channel] - kept[channel]);
                *rest = kept;
            }
        }
        let part =
            |pixels| Environment::new(grid, pixels).ok_or_else(|| Failure::new("a texel is not finite"));
        let (mut bright, rest) = (part(bright)?, part(rest)?);
        while lit(&bright) > MOST_BRIGHT {
            bright = bright.downsampled(LatLong::with_rows(bright.grid().height.div_ceil(2)))?;
        }
        let rest = if rows < grid.height { rest.downsampled(LatLong::with_rows(rows))? } else { rest };
        Ok(Self { bright: (lit(&bright) > 0).then_some(bright), rest })
    }

    /// The grid of the rest.
    pub(crate) fn grid(&self) -> LatLong {
        self.rest.grid()
    }

    /// The number of bright texels.
    pub(crate) fn bright(&self) -> usize {
        self.bright.as_ref().map_or(0, lit)
    }

    /// The sums for a material.
    pub(crate) fn reflected_by(&self, material: &Material) -> Result<Truth, Failure> {
        let culled = Cull::Energy(Tolerance::new(CULLED)?);
        // A sun is seen in the faintest part of a lobe, so nothing is left out there.
        let bright = self.bright.as_ref().map(|bright| Reference::new(bright, material, Cull::None));
        Ok(Truth { bright, rest: Reference::new(&self.rest, material, culled) })
    }
}

fn lit(environment: &Environment) -> usize {
    environment.pixels().iter().filter(|pixel| **pixel != [0.0; 3]).count()
}

/// The light that a material reflects, by brute force.
pub(crate) struct Truth {
    bright: Option<Reference>,
    rest: Reference,
}

impl Truth {
    /// Radiance toward `view` about a central direction, both in the world.
    pub(crate) fn radiance(&self, central: Direction, view: Direction) -> [f64; 3] {
        let mut sum = self.rest.radiance(central, view);
        if let Some(bright) = &self.bright {
            let bright = bright.radiance(central, view);
            (0..3).for_each(|channel| sum[channel] += bright[channel]);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gradient with a sun of two texels.
    fn sunny() -> Environment {
        let grid = LatLong::with_rows(64);
        let mut pixels: Vec<_> = (0..grid.len()).map(|i| [1.0 + (i / grid.width) as f32 / 64.0; 3]).collect();
        pixels[20 * grid.width + 30] = [9000.0, 8000.0, 7000.0];
        pixels[20 * grid.width + 31] = [4000.0, 4000.0, 3000.0];
        Environment::new(grid, pixels).unwrap()
    }

    #[test]
    fn a_sun_is_neither_blurred_nor_moved() {
        let environment = sunny();
        let material = Material::Microfacet(brdf::Microfacet::new(0.25, [1.0; 3]).unwrap());
        let split = SplitEnvironment::new(&environment, 16).unwrap();
        assert_eq!((split.bright(), split.grid().height), (2, 16));
        let truth = split.reflected_by(&material).unwrap();
        let whole = Reference::new(&environment, &material, Cull::None);
        let blurred = environment.downsampled(LatLong::with_rows(16)).unwrap();
        let blurred = Reference::new(&blurred, &material, Cull::None);
        let (view, mut worst) = (Direction::X, 0.0_f64);
        for k in 0..40 {
            let central = Direction::from_angles(0.5 + 0.03 * f64::from(k), 1.4 + 0.02 * f64::from(k));
            let stops = |value: f64| (value / whole.radiance(central, view)[1]).log2().abs();
            assert!(stops(truth.radiance(central, view)[1]) < 0.1);
            worst = worst.max(stops(blurred.radiance(central, view)[1]));
        }
        assert!(worst > 0.3, "the small image alone is off by {worst} stops");
    }

    #[test]
    fn very_many_bright_texels_are_averaged() {
        let grid = LatLong::with_rows(512);
        let bright = |i: usize| {
            if i / grid.width == 255 || i.is_multiple_of(16) && i / grid.width > 200 { 50.0 } else { 0.5 }
        };
        let environment = Environment::new(grid, (0..grid.len()).map(|i| [bright(i); 3]).collect()).unwrap();
        let split = SplitEnvironment::new(&environment, 32).unwrap();
        assert!(split.bright() <= MOST_BRIGHT, "{}", split.bright());
    }
}
