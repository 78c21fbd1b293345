//! Reflected radiance by importance sampling, with its standard error.
//!
//! B(C, V) is the integral of L(w) rho_hat(w, V) over the sphere. L is constant in each texel of the
//! environment; unlike the sum over texels, which takes rho_hat at their centres, this is the integral over
//! their areas. Three techniques draw directions: the product of the light with the expansion of rho_hat at
//! the view, the light alone, and the lobes of the material (`brdf::Material::lobes`). n_k directions of
//! density p_k each,
//!
//! > B = sum over all drawn w of L(w) rho_hat(w, V) / sum over k of n_k p_k(w)
//!
//! is the balance heuristic (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo
//! Rendering", 1995). L and rho_hat are exact and the light alone reaches all light, so the estimate is
//! unbiased whatever the expansion lacks of the material.
//!
//! A batch is [`BATCH`] points of a Sobol sequence in one Owen scrambling, divided among the techniques. Each
//! batch has a scrambling of its own, and so the batches of a texel are independent estimates: their mean is
//! the result, and what they differ by is its standard error.

use std::ops::Range;
use std::sync::Arc;

use brdf::{BrdfCoefficients, Lobe, Material};
use envmap::Environment;
use rayon::prelude::*;
use sampling::{
    Points, ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight, UniformShare, weigh,
};
use sh::Degree;
use sphere::{DMat3, DVec3, Direction};

use crate::{MapGrid, View, frame};

/// The number of directions in one batch.
pub const BATCH: usize = 32;

/// The number of a batch's directions that follow the product; they are the first.
const OF_PRODUCT: usize = 16;

/// The number that follow the light alone, after those of the product; the last follow the material's lobes.
const OF_LIGHT: usize = 8;
const OF_LOBES: usize = BATCH - OF_PRODUCT - OF_LIGHT;

/// The share of the product's directions that takes the material as uniform: for what the expansion lacks.
const UNIFORM: f32 = 0.1;

/// The highest degrees of the expansion: higher ones follow a sharp lobe more closely, and take longer at
/// each texel.
const F: usize = 19;
const P: usize = 16;

/// An estimate of radiance, RGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The mean over batches.
    pub radiance: [f64; 3],
    /// The standard deviation of [`Estimate::radiance`], estimated from the differences of batches.
    pub standard_error: [f64; 3],
}

/// The light, prepared for sampling.
struct SampledLight {
    tables: Arc<ProductTables>,
    alone: ProductSampler,
}

/// The integral of one environment and one material by importance sampling.
pub struct Sampled<'a> {
    environment: &'a Environment,
    material: &'a Material,
    coefficients: BrdfCoefficients,
    lobes: Vec<Lobe>,
    /// The light to draw from; `None` if all texels are black.
    light: Option<SampledLight>,
    batches: usize,
    seed: u32,
}

impl<'a> Sampled<'a> {
    /// Prepares the integral.
    ///
    /// `coefficients` are those of the material, at any degrees. They say where directions are drawn, and
    /// change the standard error, not what the estimates tend to. Each texel of a map takes
    /// `directions`, rounded up to whole batches, two at least. Other seeds have other directions.
    ///
    /// # Example: a white surface reflects a constant sky unchanged
    /// ```
    /// use brdf::{Choice, Lambert, Material, project};
    /// use shrm::reference::Sampled;
    /// use sphere::{Direction, LatLong};
    /// let grid = LatLong::with_rows(8);
    /// let sky = envmap::Environment::new(grid, vec![[0.25, 0.5, 1.0]; grid.len()]).unwrap();
    /// let white = Material::Lambert(Lambert::new([1.0; 3])?);
    /// let coefficients = project(&white, Choice::Full, sh::Stop::NEVER)?.coefficients;
    /// let sampled = Sampled::new(&sky, &white, &coefficients, 256, 0);
    /// let estimate = sampled.radiance(0, Direction::Z, Direction::Z);
    /// assert!((estimate.radiance[1] - 0.5).abs() < 4.0 * estimate.standard_error[1]);
    /// assert!(estimate.standard_error[1] < 0.01);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(
        environment: &'a Environment,
        material: &'a Material,
        coefficients: &BrdfCoefficients,
        directions: usize,
        seed: u32,
    ) -> Self {
        let highest = |l, given: Degree| Degree::new(l).unwrap_or(given);
        let coefficients = coefficients.cut_to(highest(F, coefficients.f()), highest(P, coefficients.p()));
        let batches = directions.div_ceil(BATCH).max(2);
        let light = SampledLight::new(environment, coefficients.f());
        Self { environment, material, coefficients, lobes: material.lobes(), light, batches, seed }
    }

    /// The directions at each texel of a map.
    pub fn directions(&self) -> usize {
        BATCH * self.batches
    }

    /// B(C, V) by the directions of a texel: other texels have other directions.
    ///
    /// `central` is the material's central direction (R, N or T), `view` points toward the viewer; both in
    /// the world.
    pub fn radiance(&self, texel: usize, central: Direction, view: Direction) -> Estimate {
        let Some(light) = &self.light else { return Estimate::default() };
        let local = frame(central);
        let outgoing = local.inverse().apply(view);
        let to_surface = self.material.centre().surface_frame(outgoing) * local.matrix().transpose();
        let [tangent, normal] =
            [DVec3::X, DVec3::Z].map(|axis| Direction::normalised(to_surface.transpose() * axis));
        let coefficients = weigh(&self.coefficients.at_view(normal, tangent, view), SUM);
        let uniform_share = UniformShare::new(UNIFORM).unwrap_or_default();
        let options = ProductOptions { uniform_share, ..Default::default() };
        // Without mass in the product, the others draw all that there is.
        let product = ProductSampler::new(&light.tables, &coefficients, options).ok();
        let mut techniques: Vec<(Range<usize>, &dyn Technique)> = Vec::with_capacity(3);
        if let Some(product) = &product {
            techniques.push((0..OF_PRODUCT, product));
        }
        techniques.push((OF_PRODUCT..OF_PRODUCT + OF_LIGHT, &light.alone));
        let outgoing = Direction::normalised(to_surface * view.vector());
        let lobes = Lobes { lobes: &self.lobes, to_surface, outgoing };
        techniques.push((BATCH - OF_LOBES..BATCH, &lobes));
        let reflected = |w: [f32; 3]| {
            let direction = exact(w);
            let radiance = self.texel(direction);
            if radiance == [0.0; 3] {
                return [0.0; 3];
            }
            let rho_hat =
                self.material.rho_hat(Direction::normalised(to_surface * direction.vector()), outgoing);
            std::array::from_fn(|channel| f64::from(radiance[channel]) * rho_hat[channel])
        };
        let mut means = Means::default();
        for batch in 0..self.batches {
            means.add(one_batch(&techniques, scrambling(self.seed, texel, batch), &reflected));
        }
        means.estimate()
    }

    /// Some rows of a map, counted over the faces of a cube; `view` says in which frame `toward` is.
    ///
    /// Each texel is computed by itself: bit-identical for any number of threads and any ranges of rows.
    ///
    /// # Panics
    /// If a row is not one of the map.
    pub fn rows(&self, grid: MapGrid, rows: Range<usize>, view: View, toward: Direction) -> Vec<Estimate> {
        let [faces, height, width] = grid.shape();
        assert!(rows.end <= faces * height, "rows of the map");
        (rows.start * width..rows.end * width)
            .into_par_iter()
            .map(|texel| {
                let central = grid.direction(texel);
                self.radiance(texel, central, view.to_world(central, toward))
            })
            .collect()
    }

    /// The radiance of the texel in which a direction lies.
    fn texel(&self, direction: Direction) -> [f32; 3] {
        let grid = self.environment.grid();
        let (column, row) = grid.position(direction);
        let inside = |x: f64, count: usize| ((x + 0.5) as usize).min(count - 1);
        self.environment.pixels()[inside(row, grid.height) * grid.width + inside(column, grid.width)]
    }
}

impl SampledLight {
    /// The light of an environment by its absolute value, since negative light is reflected too.
    fn new(environment: &Environment, degree: Degree) -> Option<Self> {
        let pixels = environment.pixels().iter().map(|rgb| rgb.map(f32::abs)).collect();
        let absolute = Environment::new(environment.grid(), pixels)?;
        let light = TexelLight::new(&absolute, SUM).ok()?;
        let constant = ProductTables::new(&light, &Tables::new(Degree::ZERO));
        let alone = ProductSampler::new(&constant, &[1.0], ProductOptions::default()).ok()?;
        Some(Self { tables: ProductTables::new(&light, &Tables::new(degree)), alone })
    }
}

/// Draws directions, and says how densely it does.
trait Technique {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]]);

    /// The density of drawn directions, in 1/sr.
    fn density(&self, direction: [f32; 3]) -> f64;
}

impl Technique for ProductSampler {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]]) {
        self.sample_into(points, directions, &mut [0.0; BATCH][..points.len()]);
    }

    fn density(&self, direction: [f32; 3]) -> f64 {
        f64::from(self.density(direction))
    }
}

/// The lobes of a material at a view, with equal shares.
struct Lobes<'a> {
    lobes: &'a [Lobe],
    to_surface: DMat3,
    outgoing: Direction,
}

impl Technique for Lobes<'_> {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]]) {
        for (point, direction) in points.iter().zip(directions) {
            // The first coordinate chooses the lobe.
            let along = f64::from(point[0]) * self.lobes.len() as f64;
            let index = (along as usize).min(self.lobes.len() - 1);
            let point = [along - index as f64, f64::from(point[1])];
            let incident = self.lobes[index].sample(point, self.outgoing);
            *direction = (self.to_surface.transpose() * incident.vector()).as_vec3().to_array();
        }
    }

    fn density(&self, direction: [f32; 3]) -> f64 {
        let incident = Direction::normalised(self.to_surface * exact(direction).vector());
        let densities = self.lobes.iter().map(|lobe| lobe.density(incident, self.outgoing));
        densities.sum::<f64>() / self.lobes.len() as f64
    }
}

/// The direction of a vector whose length is 1 to single precision.
fn exact(direction: [f32; 3]) -> Direction {
    Direction::normalised(DVec3::from_array(direction.map(f64::from)))
}

/// The estimate of one batch. Each technique takes its range of the points.
fn one_batch(
    techniques: &[(Range<usize>, &dyn Technique)],
    scrambling: u32,
    reflected: &impl Fn([f32; 3]) -> [f64; 3],
) -> [f64; 3] {
    let (mut points, mut directions) = ([[0.0; 2]; BATCH], [[0.0; 3]; BATCH]);
    Points::Sobol { seed: Some(scrambling) }.fill(0, &mut points);
    let mut sum = [0.0; 3];
    for (range, technique) in techniques {
        let directions = &mut directions[range.clone()];
        technique.draw(&points[range.clone()], directions);
        for &mut direction in directions {
            let value = reflected(direction);
            if value == [0.0; 3] {
                continue;
            }
            let density: f64 = techniques
                .iter()
                .map(|(range, technique)| range.len() as f64 * technique.density(direction))
                .sum();
            if density > 0.0 {
                (0..3).for_each(|channel| sum[channel] += value[channel] / density);
            }
        }
    }
    sum
}

/// The mean of batches and the sum of their squared differences from it, without cancellation (Welford 1962).
#[derive(Default)]
struct Means {
    count: f64,
    mean: [f64; 3],
    squares: [f64; 3],
}

impl Means {
    fn add(&mut self, batch: [f64; 3]) {
        self.count += 1.0;
        for channel in 0..3 {
            let before = batch[channel] - self.mean[channel];
            self.mean[channel] += before / self.count;
            self.squares[channel] += before * (batch[channel] - self.mean[channel]);
        }
    }

    fn estimate(&self) -> Estimate {
        let degrees_of_freedom = self.count - 1.0;
        let standard_error = self.squares.map(|squares| (squares / degrees_of_freedom / self.count).sqrt());
        Estimate { radiance: self.mean, standard_error }
    }
}

/// The seed of a batch's scrambling: a hash of all three numbers (Steele et al. 2014, "Fast splittable
/// pseudorandom number generators").
fn scrambling(seed: u32, texel: usize, batch: usize) -> u32 {
    [texel, batch].iter().fold(mixed(u64::from(seed)), |state, &number| mixed(state ^ number as u64)) as u32
}

fn mixed(state: u64) -> u64 {
    let mut bits = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Phong, Ward, project};
    use sh::Stop;
    use sphere::{Cube, LatLong, spiral};

    use super::*;
    use crate::degrees::seen;
    use crate::reference::tests::{environment, subdivided};
    use crate::reference::{Cull, Reference};

    /// A sky with a gradient, a dark half, and the sun in one or two texels.
    fn sunny(w: DVec3) -> [f64; 3] {
        let sky = if w.z < -0.4 { 0.0 } else { 0.5 + 0.4 * w.z + 0.1 * (9.0 * w.x).sin() };
        let sun = if w.dot(DVec3::new(0.6, 0.48, 0.64)) > 0.9985 { 3000.0 } else { 0.0 };
        [sky + sun, sky + 0.8 * sun, 1.2 * sky + 0.5 * sun]
    }

    /// Light of which more was taken out in places than there was.
    fn partly_negative(w: DVec3) -> [f64; 3] {
        let stripes = (7.0 * w.x + 3.0 * w.y).sin() * (5.0 * w.z).cos();
        [stripes, 0.3 + stripes, 2.0 * stripes - 0.5]
    }

    fn materials() -> Vec<Material> {
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        vec![
            Material::Lambert(Lambert::new([0.8, 0.4, 0.1]).unwrap()),
            Material::Phong(Phong::new(50.0, [1.0, 0.7, 0.2]).unwrap()),
            Material::Microfacet(Microfacet::new(0.2, [1.0, 0.5, 0.2]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(16.0, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.2, metal, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.5, metal, [1.0; 3]).unwrap()),
            Material::Ward(Ward::new([0.2, 0.5], [1.0, 0.7, 0.3]).unwrap()),
        ]
    }

    fn coefficients(material: &Material) -> BrdfCoefficients {
        project(material, Choice::Full, Stop::NEVER).unwrap().coefficients
    }

    /// Picks a texel's central direction and a view of it.
    fn seen_from(material: &Material, index: usize, count: usize) -> (Direction, Direction) {
        let central = spiral(index, count);
        (central, frame(central).apply(seen(material.centre(), index)))
    }

    /// Errors of estimates over their standard errors, of three channels at `count` directions. Where next to
    /// nothing is reflected, rare directions carry it, and few batches have one: 1e-4 of the root mean square
    /// of all is added to the standard errors.
    fn ratios(sampled: &Sampled<'_>, truth: &Reference, count: usize) -> Vec<f64> {
        let found: Vec<(Estimate, [f64; 3])> = (0..count)
            .map(|index| {
                let (central, view) = seen_from(sampled.material, index, count);
                (sampled.radiance(index, central, view), truth.radiance(central, view))
            })
            .collect();
        let square: f64 = found.iter().flat_map(|(_, wanted)| wanted).map(|value| value * value).sum();
        let floor = 1e-4 * (square / (3 * count) as f64).sqrt();
        let ratio = |(estimate, wanted): &(Estimate, [f64; 3]), channel: usize| {
            (estimate.radiance[channel] - wanted[channel]) / (estimate.standard_error[channel] + floor)
        };
        found.iter().flat_map(|found| [0, 1, 2].map(|channel| ratio(found, channel))).collect()
    }

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }

    /// The truth is the sum at the centres of texels of a sixth of the size. With 31 degrees of freedom a
    /// ratio has the variance 31/29, and past 6 once in a million.
    #[test]
    fn estimates_are_right_to_their_standard_errors() {
        for light in [sunny, partly_negative] {
            let environment = environment(24, light);
            let fine = subdivided(&environment, 6);
            let mut all = Vec::new();
            for material in materials() {
                let truth = Reference::at_centres(&fine, &material, Cull::None);
                let coefficients = coefficients(&material);
                let sampled = Sampled::new(&environment, &material, &coefficients, 1024, 1);
                let ratios = ratios(&sampled, &truth, 40);
                let largest = ratios.iter().fold(0.0, |largest: f64, ratio| largest.max(ratio.abs()));
                assert!(largest < 6.0 && rms(&ratios) < 1.5, "{material:?}: {largest} {}", rms(&ratios));
                all.extend(ratios);
            }
            assert!((0.8..1.25).contains(&rms(&all)), "{}", rms(&all));
        }
    }

    /// The expansion of another material, and none at all: then the light alone draws, which needs light that
    /// is not all in one place.
    #[test]
    fn a_wrong_expansion_costs_directions_and_changes_no_mean() {
        let rough = &materials()[5];
        let zero = BrdfCoefficients::new(rough.centre(), Degree::ZERO, Degree::ZERO, vec![[0.0; 3]]).unwrap();
        for (light, coefficients) in [
            (environment(24, sunny), coefficients(&materials()[1])),
            (environment(24, partly_negative), zero),
        ] {
            let truth = Reference::at_centres(&subdivided(&light, 6), rough, Cull::None);
            let sampled = Sampled::new(&light, rough, &coefficients, 2048, 1);
            let rms = rms(&ratios(&sampled, &truth, 60));
            assert!((0.75..1.3).contains(&rms), "{rms}");
        }
    }

    /// Stratified points are better than the square root of their number, but never much worse.
    #[test]
    fn more_directions_have_a_smaller_error() {
        let environment = environment(24, sunny);
        let material = &materials()[4];
        let coefficients = coefficients(material);
        let error = |directions| {
            let sampled = Sampled::new(&environment, material, &coefficients, directions, 1);
            assert_eq!(sampled.directions(), directions);
            let errors = (0..60).map(|index| {
                let (central, view) = seen_from(material, index, 60);
                sampled.radiance(index, central, view).standard_error[1]
            });
            rms(&errors.collect::<Vec<_>>())
        };
        let ratio = error(4096) / error(256);
        assert!(ratio < 0.35, "{ratio}");
    }

    #[test]
    fn threads_and_ranges_of_rows_change_no_bit_and_seeds_do() {
        let sky = environment(16, sunny);
        let material = &materials()[5];
        let coefficients = coefficients(material);
        let sampled = Sampled::new(&sky, material, &coefficients, 64, 1);
        let other = Sampled::new(&sky, material, &coefficients, 64, 2);
        for (grid, count) in
            [(MapGrid::LatLong(LatLong { width: 7, height: 5 }), 5), (MapGrid::Cube(Cube { edge: 2 }), 12)]
        {
            let rows = |rows| sampled.rows(grid, rows, View::Global, Direction::X);
            let whole = rows(0..count);
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert!(one.install(|| rows(0..count)) == whole);
            assert!([rows(0..2), rows(2..count)].concat() == whole);
            assert!(other.rows(grid, 0..count, View::Global, Direction::X) != whole);
            for (texel, found) in whole.iter().enumerate() {
                assert_eq!(*found, sampled.radiance(texel, grid.direction(texel), Direction::X));
            }
        }
    }

    #[test]
    fn nothing_is_reflected_without_light_or_by_black() {
        let black = Material::Lambert(Lambert::new([0.0; 3]).unwrap());
        for (sky, material) in
            [(environment(8, |_| [0.0; 3]), &materials()[0]), (environment(8, sunny), &black)]
        {
            let sampled = Sampled::new(&sky, material, &coefficients(material), 64, 1);
            assert_eq!(sampled.radiance(0, Direction::Z, Direction::X), Estimate::default());
        }
    }
}
