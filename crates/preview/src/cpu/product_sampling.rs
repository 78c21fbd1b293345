//! Directions in proportion to light times material, for the many samples of a still by brute force.
//!
//! The product of the light's texels and the series of rho_hat toward the view depends on the normal alone,
//! since the viewer is distant. So a sampler is made for each cell of normals, 0.06 radians wide, and the
//! pixels of a band share those that they see. Its density is told exactly, so the balance heuristic of
//! [`crate::shading::brute_force`] stays unbiased however far the sampler is from the product at a pixel.
//!
//! A lobe that degree [`DEGREE`] does not hold is sampled better by its own shape: then there is no sampler.
//! Shaders of the device have none either: both converge to the same integral.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_6, PI};
use std::fmt;
use std::sync::Arc;

use brdf::{BrdfCoefficients, Centre};
use glam::Vec3;
use sampling::{ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight, UniformShare, weigh};
use sh::Degree;
use sphere::{Cube, Direction, Face, spiral};

use crate::{Look, Shot};

/// The highest degrees of the series.
const DEGREE: usize = 19;
const VIEW_DEGREE: usize = 16;

/// The share of a lobe's energy that its series must hold.
const HELD: f64 = 0.95;

/// The share of the series' density that is uniform, for what the series lacks of the material.
const UNIFORM: f32 = 0.1;

/// The number of samples of a pixel from which on samplers are worth making.
const MIN_SAMPLES: u32 = 256;

/// The cells of normals: texels of a cube.
const CELLS: Cube = Cube { edge: 26 };

/// A face, a row and a column of [`CELLS`].
type Cell = (Face, usize, usize);

/// The series and tables that the samplers of a look share.
pub(super) struct ProductSampling {
    series: BrdfCoefficients,
    tables: Arc<ProductTables>,
}

impl ProductSampling {
    /// Prepares the samplers of a look; `None` if its light is black, its series is not known, depends on the
    /// tangent, or does not hold the lobe.
    pub(super) fn new(look: &Look) -> Option<Self> {
        let series = look.reflection()?.brdf();
        if series.centre() == Centre::Tangent || !is_held(look, series) {
            return None;
        }
        let most = |degree: Degree, most: usize| Some(degree.min(Degree::new(most).ok()?));
        let series = series.cut_to(most(series.f(), DEGREE)?, most(series.p(), VIEW_DEGREE)?);
        let light = TexelLight::new(look.light().environment(), SUM).ok()?;
        let tables = ProductTables::new(&light, &Tables::new(series.f()));
        Some(Self { series, tables })
    }

    /// Whether a shot takes so many samples that samplers are worth making.
    pub(super) fn is_worth(shot: &Shot) -> bool {
        shot.light_samples.saturating_mul(shot.samples.saturating_mul(shot.samples)) >= MIN_SAMPLES
    }

    /// A sampler of the product at the middle of a cell of normals; `None` where it is black.
    fn sampler(&self, (face, row, column): Cell, view: Vec3) -> Option<ProductSampler> {
        let normal = CELLS.direction(face, row, column);
        // About the normal or the reflection vector, the tangent has no part.
        let tangent = Direction::new(normal.vector().any_orthogonal_vector())?;
        let view = Direction::new(view.as_dvec3())?;
        let f = weigh(&self.series.at_view(normal, tangent, view), SUM);
        let uniform_share = UniformShare::new(UNIFORM)?;
        let options = ProductOptions { uniform_share, ..ProductOptions::default() };
        ProductSampler::new(&self.tables, &f, options).ok()
    }
}

/// The share of the lobe's energy, seen 30 degrees from the normal, that the degrees up to [`DEGREE`] hold:
/// by its values all around, not by the series, which may have been cut for a soft light.
fn is_held(look: &Look, series: &BrdfCoefficients) -> bool {
    const DIRECTIONS: usize = 8192;
    let Some(material) = look.material() else { return false };
    let view = Direction::from_angles(FRAC_PI_6, 0.0);
    let square = |rgb: [f64; 3]| rgb.iter().map(|value| value * value).sum::<f64>();
    let whole = (0..DIRECTIONS).map(|index| square(material.rho_hat(spiral(index, DIRECTIONS), view)));
    let whole = whole.sum::<f64>() * 4.0 * PI / DIRECTIONS as f64;
    let lobe = series.at_view(Direction::Z, Direction::X, view);
    let rows = (DEGREE + 1) * (DEGREE + 1);
    let held: f64 = lobe.coefficients().iter().take(rows).map(|rgb| square(*rgb)).sum();
    held >= HELD * whole
}

impl fmt::Debug for ProductSampling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ProductSampling").field("degree", &self.series.f()).finish_non_exhaustive()
    }
}

#[derive(Default)]
pub(super) struct BandSamplers(HashMap<(*const ProductSampling, Cell), Option<ProductSampler>>);

impl BandSamplers {
    /// The sampler for a normal, both in the light's frame.
    pub(super) fn get(&mut self, of: &ProductSampling, normal: Vec3, view: Vec3) -> Option<&ProductSampler> {
        let (face, s, t) = CELLS.position(Direction::new(normal.as_dvec3())?);
        let place = |share: f64| ((share * CELLS.edge as f64) as usize).min(CELLS.edge - 1);
        let cell = (face, place(t), place(s));
        let key = (std::ptr::from_ref(of), cell);
        self.0.entry(key).or_insert_with(|| of.sampler(cell, view)).as_ref()
    }
}
