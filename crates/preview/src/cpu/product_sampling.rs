//! Directions in proportion to light times material, for the many samples of a still by brute force.
//!
//! A sampler draws from the product of the light's texels and the series of rho_hat toward the view, turned
//! into the frame of a normal [JCJ09]. From [`OWN_SAMPLES`] on, each sample of a pixel has its own; drawing
//! them then takes longer than turning the lobe and multiplying it with the light. With fewer samples, one
//! serves a cell of normals, 0.06 radians wide, and the pixels of a band share those that they see: since the
//! viewer is distant, the product depends on the normal alone. The density of either is told exactly, so the
//! balance heuristic of [`crate::shading::brute_force`] stays unbiased however far the sampler is from the
//! product at a pixel. On a sphere under photographs both have the same noise within a few percent.
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

/// The number of samples from which on each sample of a pixel has its own sampler.
pub(super) const OWN_SAMPLES: u32 = 4096;

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

    /// The sum of the channels of the lobe of a surface with this normal, toward a view.
    fn lobe(&self, normal: Direction, view: Vec3) -> Option<Vec<f64>> {
        // About the normal or the reflection vector, the tangent has no part.
        let tangent = Direction::new(normal.vector().any_orthogonal_vector())?;
        let view = Direction::new(view.as_dvec3())?;
        Some(weigh(&self.series.at_view(normal, tangent, view), SUM))
    }

    /// A sampler of the product for a normal; `None` where it is black.
    fn sampler(&self, normal: Direction, view: Vec3) -> Option<ProductSampler> {
        let f = self.lobe(normal, view)?;
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

/// The samplers of a band of a picture.
pub(super) struct BandSamplers {
    /// Whether each sample of a pixel has its own sampler.
    has_own: bool,
    by_cell: HashMap<(*const ProductSampling, Cell), Option<ProductSampler>>,
    /// The sampler of the last sample of a pixel that had its own.
    own: Option<(*const ProductSampling, ProductSampler)>,
}

impl BandSamplers {
    /// No samplers yet, for the samples of a shot.
    pub(super) fn new(shot: &Shot) -> Self {
        Self { has_own: shot.light_samples >= OWN_SAMPLES, by_cell: HashMap::new(), own: None }
    }

    /// The sampler for a normal, both in the light's frame.
    pub(super) fn get(&mut self, of: &ProductSampling, normal: Vec3, view: Vec3) -> Option<&ProductSampler> {
        let normal = Direction::new(normal.as_dvec3())?;
        if self.has_own {
            return self.own(of, normal, view);
        }
        let (face, s, t) = CELLS.position(normal);
        let place = |share: f64| ((share * CELLS.edge as f64) as usize).min(CELLS.edge - 1);
        let cell = (face, place(t), place(s));
        let middle = || of.sampler(CELLS.direction(cell.0, cell.1, cell.2), view);
        self.by_cell.entry((std::ptr::from_ref(of), cell)).or_insert_with(middle).as_ref()
    }

    /// The sampler of this normal alone. A new lobe takes the place of the one before.
    fn own(&mut self, of: &ProductSampling, normal: Direction, view: Vec3) -> Option<&ProductSampler> {
        let kept = self.own.take().filter(|(last, _)| std::ptr::eq(*last, of));
        let sampler = match kept {
            Some((_, mut sampler)) => {
                sampler.replace(&of.lobe(normal, view)?).ok()?;
                sampler
            }
            None => of.sampler(normal, view)?,
        };
        Some(&self.own.insert((std::ptr::from_ref(of), sampler)).1)
    }
}
