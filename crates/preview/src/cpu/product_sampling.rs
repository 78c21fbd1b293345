//! Directions in proportion to light times material, for the many samples of a still by brute force.
//!
//! A sampler draws from the product of the light's texels and the series of rho_hat toward the view, turned
//! into the frame of a normal [JCJ09]. From [`OWN_SAMPLES`] on, each sample of a pixel has its own; drawing
//! them then takes longer than turning the lobe and multiplying it with the light. With fewer samples, one
//! serves a cell of normals, 0.06 radians wide, and the pixels of a band share those that they see: since the
//! viewer is distant, the product depends on the normal alone. The density of either is told exactly, so the
//! balance heuristic of [`crate::shading::brute_force`] stays unbiased however far the sampler is from the
//! product at a pixel.
//!
//! A lobe that the series does not hold ([`held_series`]) is sampled better by its own shape: then there is
//! no sampler. A device follows the product by tables of its own ([`crate::shading::product_tables`]): both
//! converge to the same integral.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

use brdf::BrdfCoefficients;
use glam::Vec3;
use sampling::{ProductOptions, ProductSampler, ProductTables, SUM, Tables, TexelLight, UniformShare, weigh};
use sphere::{Cube, Direction, Face};

use crate::shading::product_tables::{UNIFORM, held_series};
use crate::{Look, Shot};

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
    /// Prepares the samplers of a look; `None` if its light is black, or [`held_series`] is.
    pub(super) fn new(look: &Look) -> Option<Self> {
        let series = held_series(look)?;
        let light = TexelLight::new(look.light().environment(), SUM).ok()?;
        let tables = ProductTables::new(&light, &Tables::new(series.f()));
        Some(Self { series, tables })
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
