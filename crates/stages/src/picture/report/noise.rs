//! Noise in a report: the error of a few samples that follow the light, the material's lobe, both, or their
//! product, at surfaces that face all ways.
//!
//! An estimate is the mean of radiance times rho_hat over the density of a direction, channels together. All
//! weigh by the light and the material themselves; only the densities differ: the texels' radiance, the
//! material's series of degree 19 at the view with a tenth of it uniform, half of the samples each weighed by
//! the mean of both densities (the balance heuristic), and the product of light and series.

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::Arc;

use brdf::{BrdfCoefficients, Choice, Material, project};
use engine::{Failure, Steps};
use envmap::Environment;
use rayon::prelude::*;
use sampling::{
    Error, Options, Points, ProductOptions, ProductSampler, ProductTables, SUM, Sampler, Tables, TexelLight,
    UniformShare, weigh,
};
use sh::Degree;
use sphere::{DMat3, DVec3, Direction, LatLong};

use crate::picture::report::figures::{Follows, Noise, NoisePair, PointSet, SAMPLES};
use crate::picture::report::lit::Lit;
use crate::values::UntilStopped;

/// The number of surfaces, each with [`ROUNDS`] estimates.
const SURFACES: u32 = 16;
const ROUNDS: u32 = 8;

/// The degrees of the material's series.
const F: usize = 19;
const P: usize = 16;

/// The share of a series' density that is uniform, for what the series lacks of the material.
const UNIFORM: f32 = 0.1;

/// The most rows of an environment: those with more are averaged to this many.
const ROWS: usize = 512;

/// A surface and a view of it.
struct Surface {
    to_local: DMat3,
    normal: Direction,
    tangent: Direction,
    view: Direction,
    /// The radiance toward the view, channels together: the sum over all texels.
    exact: f64,
}

/// The inputs that all estimates of a pair share.
struct NoiseScene<'a> {
    environment: Cow<'a, Environment>,
    material: &'a Material,
    series: &'a BrdfCoefficients,
    surfaces: Vec<Surface>,
    /// The radiance below which a value counts as black.
    dark: f64,
    light: ProductSampler,
    tables: Arc<Tables>,
    product_tables: Arc<ProductTables>,
}

/// The noise of each material under each environment: none under a black one. It takes a step for each pair.
pub(crate) fn study(
    lit: &[&Lit<'_>],
    materials: &[(String, &Material)],
    steps: &Steps<'_>,
) -> Result<Vec<NoisePair>, Failure> {
    let tables = Tables::new(Degree::new(F)?);
    let mut pairs = Vec::new();
    for (name, material) in materials {
        let degrees = Choice::Degree { f: Degree::new(F)?, p: Degree::new(P)? };
        let projection = steps.reporter().until_stopped(|stop| project(material, degrees, stop))?;
        let series = projection.coefficients;
        for lit in lit {
            let steps = steps.part(1, SURFACES as usize + Follows::ALL.len());
            if let Some(scene) = NoiseScene::new(lit, material, &series, &tables, &steps)? {
                let noise = scene.noise(&steps)?;
                pairs.push(NoisePair { material: name.clone(), environment: lit.name.clone(), noise });
            }
        }
    }
    Ok(pairs)
}

impl<'a> NoiseScene<'a> {
    /// Prepares a pair's estimates; `None` under a black environment.
    fn new(
        lit: &Lit<'a>,
        material: &'a Material,
        series: &'a BrdfCoefficients,
        tables: &Arc<Tables>,
        steps: &Steps<'_>,
    ) -> Result<Option<Self>, Failure> {
        let environment = if lit.environment.grid().height > ROWS {
            Cow::Owned(lit.environment.resized(LatLong::with_rows(ROWS))?)
        } else {
            Cow::Borrowed(lit.environment)
        };
        let light = match TexelLight::new(&environment, SUM) {
            Ok(light) => light,
            Err(Error::NoMass) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let constant = Tables::new(Degree::ZERO);
        let of_light = ProductTables::new(&light, &constant);
        let mut scene = Self {
            environment,
            material,
            series,
            surfaces: (1..=SURFACES).map(Surface::new).collect(),
            dark: 3.0 * lit.dark,
            light: ProductSampler::new(&of_light, &[1.0], ProductOptions::default())?,
            product_tables: ProductTables::new(&light, tables),
            tables: tables.clone(),
        };
        for index in 0..scene.surfaces.len() {
            steps.step()?;
            scene.surfaces[index].exact = scene.exact(&scene.surfaces[index]);
        }
        Ok(Some(scene))
    }

    /// The exact radiance as the sum over all texels.
    fn exact(&self, surface: &Surface) -> f64 {
        let grid = self.environment.grid();
        let rows: Vec<f64> = (self.environment.pixels().par_chunks_exact(grid.width).enumerate())
            .map(|(row, texels)| {
                let mut sum = 0.0;
                for (column, texel) in texels.iter().enumerate() {
                    sum += self.reflected(surface, grid.direction(row, column), *texel);
                }
                sum * grid.solid_angle(row)
            })
            .collect();
        rows.iter().sum()
    }

    /// Radiance times rho_hat, channels together.
    fn reflected(&self, surface: &Surface, w: Direction, radiance: [f32; 3]) -> f64 {
        let local = |w: Direction| Direction::normalised(surface.to_local * w.vector());
        let rho_hat = self.material.rho_hat(local(w), local(surface.view));
        rho_hat.iter().zip(radiance).map(|(rho, light)| rho * f64::from(light)).sum()
    }

    /// Radiance times rho_hat over a density.
    fn weight(&self, surface: &Surface, direction: [f32; 3], density: f64) -> f64 {
        if density <= 0.0 {
            return 0.0;
        }
        let grid = self.environment.grid();
        let w = Direction::normalised(DVec3::from_array(direction.map(f64::from)));
        let (column, row) = grid.position(w);
        let nearest = |x: f64, count: usize| ((x + 0.5).max(0.0) as usize).min(count - 1);
        let texel = nearest(row, grid.height) * grid.width + nearest(column, grid.width);
        self.reflected(surface, w, self.environment.pixels()[texel]) / density
    }

    /// The noise of every density, by every set of points.
    fn noise(&self, steps: &Steps<'_>) -> Result<Vec<Noise>, Failure> {
        let mut noise = Vec::new();
        for follows in Follows::ALL {
            steps.step()?;
            for points in PointSet::ALL {
                let rms = SAMPLES.map(|samples| self.rms(follows, points, samples));
                noise.push(Noise { follows, points, rms: rms.into() });
            }
        }
        Ok(noise)
    }

    /// The root of the mean square of the relative error, over surfaces and estimates.
    fn rms(&self, follows: Follows, points: PointSet, samples: usize) -> f64 {
        let squares: Vec<f64> = (self.surfaces.par_iter().enumerate())
            .map(|(index, surface)| {
                let estimator = Estimator::new(self, surface, follows);
                let square = |round: u32| {
                    let points = points.points(index as u32 * ROUNDS + round + 1);
                    let error = estimator.of(points, samples) - surface.exact;
                    math::powi(error / surface.exact.max(self.dark), 2)
                };
                (0..ROUNDS).map(square).sum::<f64>()
            })
            .collect();
        (squares.iter().sum::<f64>() / f64::from(SURFACES * ROUNDS)).sqrt()
    }
}

impl Surface {
    /// Surfaces that face all ways, seen from up to 60 degrees; their radiance is still to be found.
    fn new(k: u32) -> Self {
        let turn = |step: f64| (f64::from(k) * step).fract();
        let normal = Direction::from_angles(math::acos(1.0 - 2.0 * turn(0.618_034)), TAU * turn(0.754_878));
        let tangent = normal.vector().cross(DVec3::new(0.3, 0.5, 0.8)).normalize();
        let frame = DMat3::from_cols(tangent, normal.vector().cross(tangent), normal.vector());
        let view = Direction::from_angles(1.05 * turn(0.324_718), TAU * turn(0.569_84));
        Self {
            to_local: frame.transpose(),
            normal,
            tangent: Direction::normalised(tangent),
            view: Direction::normalised(frame * view.vector()),
            exact: 0.0,
        }
    }
}

impl PointSet {
    fn points(self, seed: u32) -> Points<'static> {
        match self {
            Self::Random => Points::Random { seed },
            Self::Stratified => Points::Sobol { seed: Some(seed) },
        }
    }
}

/// The samplers of a surface; `None` where nothing is positive.
struct Estimator<'a> {
    scene: &'a NoiseScene<'a>,
    surface: &'a Surface,
    /// One sampler, or the two whose samples are weighed together.
    samplers: Vec<Box<dyn Draw + Send + Sync + 'a>>,
}

/// Draws directions with a density.
trait Draw {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]);
    fn density(&self, direction: [f32; 3]) -> f32;
}

impl Draw for &ProductSampler {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]) {
        self.sample_into(points, directions, densities);
    }

    fn density(&self, direction: [f32; 3]) -> f32 {
        ProductSampler::density(self, direction)
    }
}

impl Draw for ProductSampler {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]) {
        self.sample_into(points, directions, densities);
    }

    fn density(&self, direction: [f32; 3]) -> f32 {
        self.density(direction)
    }
}

impl Draw for Sampler {
    fn draw(&self, points: &[[f32; 2]], directions: &mut [[f32; 3]], densities: &mut [f32]) {
        self.sample_into(points, directions, densities);
    }

    fn density(&self, direction: [f32; 3]) -> f32 {
        self.density(direction)
    }
}

impl<'a> Estimator<'a> {
    fn new(scene: &'a NoiseScene<'a>, surface: &'a Surface, follows: Follows) -> Self {
        let mut samplers: Vec<Box<dyn Draw + Send + Sync + 'a>> = Vec::new();
        let uniform_share = UniformShare::new(UNIFORM).unwrap_or_default();
        let lobe = || weigh(&scene.series.at_view(surface.normal, surface.tangent, surface.view), SUM);
        // What has nothing positive draws nothing.
        if matches!(follows, Follows::Light | Follows::Both) {
            samplers.push(Box::new(&scene.light));
        }
        if matches!(follows, Follows::Lobe | Follows::Both) {
            let options = Options { uniform_share, ..Options::default() };
            if let Ok(sampler) = Sampler::new(&scene.tables, &lobe(), options) {
                samplers.push(Box::new(sampler));
            }
        }
        if follows == Follows::Product {
            let options = ProductOptions { uniform_share, ..ProductOptions::default() };
            if let Ok(sampler) = ProductSampler::new(&scene.product_tables, &lobe(), options) {
                samplers.push(Box::new(sampler));
            }
        }
        Self { scene, surface, samplers }
    }

    /// The estimate by the first `count` of some points, an equal part of them for each sampler.
    fn of(&self, points: Points<'_>, count: usize) -> f64 {
        let part = count / self.samplers.len().max(1);
        let (mut places, mut directions) = (vec![[0.0; 2]; part], vec![[0.0; 3]; part]);
        let mut densities = vec![0.0; part];
        let mut sum = 0.0;
        for (place, sampler) in self.samplers.iter().enumerate() {
            points.fill((place * part) as u64, &mut places);
            sampler.draw(&places, &mut directions, &mut densities);
            for (direction, density) in directions.iter().zip(&densities) {
                let mut all = f64::from(*density);
                for (other, sampler) in self.samplers.iter().enumerate() {
                    if other != place {
                        all += f64::from(sampler.density(*direction));
                    }
                }
                sum += self.scene.weight(self.surface, *direction, all * part as f64);
            }
        }
        sum
    }
}
