//! The directions that importance sampling draws for a view: from the light, from the lobe, and from their
//! product.
//!
//! All three take the same [`COUNT`] points of the unit square, of the Sobol sequence with Owen's scrambling
//! or random ones.
//! What depends on the light or on the degree alone is kept: a turn of the light or of the camera gives the
//! samplers of lobe and product new coefficients.

use std::fmt;
use std::sync::{Arc, Weak};

use sampling::{Error, Options, Points, ProductSampler, ProductTables, SUM, Sampler, Tables, weigh};

use crate::light_points::LightPoints;
use crate::lobe::{Lobe, NO_LOBE, SurfaceFrame};
use crate::{Light, Look, PointSet};

/// The number of points of each set.
pub(crate) const COUNT: usize = 512;

/// The seed of the scrambling, and of random points.
const SEED: u32 = 1;

/// The directions of a set, or why there are none, as a caption.
pub(crate) type Drawn = Result<Vec<[f32; 3]>, &'static str>;

/// The sets of a view, in the light's frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SampleSets {
    pub(crate) light: Drawn,
    pub(crate) lobe: Drawn,
    pub(crate) product: Drawn,
    /// The factor that makes the product, with the lobe's largest value at 1, as bright as the light in the
    /// mean. The colours of light and lobe are taken to be independent.
    pub(crate) product_gain: f32,
}

/// Draws the sets of one view after another.
pub(crate) struct SampleSource {
    set: PointSet,
    points: Vec<[f32; 2]>,
    light: Option<(Weak<Light>, Result<LightPoints, &'static str>)>,
    lobe: Option<(Weak<Look>, Result<Lobe, &'static str>)>,
    lobe_sampler: Option<Sampler>,
    product_sampler: Option<ProductSampler>,
    tables: Option<Arc<Tables>>,
}

impl SampleSets {
    fn without_lobe(light: Drawn, why: &'static str) -> Self {
        Self { light, lobe: Err(why), product: Err(why), product_gain: 1.0 }
    }
}

impl Default for SampleSource {
    fn default() -> Self {
        let set = PointSet::default();
        Self {
            set,
            points: points_of(set),
            light: None,
            lobe: None,
            lobe_sampler: None,
            product_sampler: None,
            tables: None,
        }
    }
}

impl SampleSource {
    /// The sets of a look from these points, for a surface with this frame.
    pub(crate) fn draw(&mut self, look: &Arc<Look>, frame: SurfaceFrame, set: PointSet) -> SampleSets {
        if set != self.set {
            (self.set, self.points, self.light) = (set, points_of(set), None);
        }
        self.prepare(look);
        let Self { points, light, lobe, lobe_sampler, product_sampler, tables, .. } = self;
        let (Some((_, light)), Some((_, lobe))) = (light, lobe) else {
            return SampleSets::without_lobe(Err(UNKNOWN), UNKNOWN);
        };
        let drawn_light = light.as_ref().map(|light| light.directions.clone()).map_err(|why| *why);
        let lobe = match lobe {
            Ok(lobe) => lobe,
            Err(why) => return SampleSets::without_lobe(drawn_light, why),
        };
        let tables = tables.get_or_insert_with(|| Tables::new(lobe.degree()));
        let coefficients = weigh(&lobe.turned(frame), SUM);
        let sampler = with_coefficients(
            lobe_sampler,
            |sampler| sampler.replace(&coefficients),
            || Sampler::new(tables, &coefficients, Options::default()),
        );
        let drawn_lobe = sampler.map_err(|_| NO_LOBE).map(|sampler| {
            drawn(points, |directions, densities| sampler.sample_into(points, directions, densities))
        });
        let mut sets = SampleSets { lobe: drawn_lobe, ..SampleSets::without_lobe(drawn_light, "") };
        let light = match light {
            Ok(light) => light,
            Err(why) => return SampleSets { product: Err(why), ..sets },
        };
        let sampler = with_coefficients(
            product_sampler,
            |sampler| sampler.replace(&coefficients),
            || {
                let tables = ProductTables::new(&light.texels, tables);
                ProductSampler::new(&tables, &coefficients, Default::default())
            },
        );
        match sampler {
            Ok(sampler) => {
                sets.product = Ok(drawn(points, |directions, densities| {
                    sampler.sample_into(points, directions, densities);
                }));
                // The product of two sums of three channels is three times that of their means.
                let gain = 3.0 * light.integral * lobe.largest() / sampler.mass();
                sets.product_gain = if gain.is_finite() { gain as f32 } else { 1.0 };
            }
            Err(_) => sets.product = Err("light and lobe do not overlap"),
        }
        sets
    }

    /// The lobe that was drawn from last, if there is one.
    pub(crate) fn lobe(&self) -> Option<&Lobe> {
        self.lobe.as_ref().and_then(|(_, lobe)| lobe.as_ref().ok())
    }

    /// Makes the samplers of the light and of the look, and drops those of another light or degree.
    fn prepare(&mut self, look: &Arc<Look>) {
        let light = look.light();
        if !is_of(&self.light, light) {
            let made = LightPoints::new(light.environment(), &self.points);
            let made = made.map_err(|error| match error {
                Error::NoMass => "the light is black",
                _ => "the light is not finite",
            });
            self.light = Some((Arc::downgrade(light), made));
            self.product_sampler = None;
        }
        if !is_of(&self.lobe, look) {
            let lobe = Lobe::of(look);
            let degree = lobe.as_ref().ok().map(Lobe::degree);
            if degree != self.tables.as_ref().map(|tables| tables.degree()) {
                (self.tables, self.lobe_sampler, self.product_sampler) = (None, None, None);
            }
            self.lobe = Some((Arc::downgrade(look), lobe));
        }
    }
}

impl fmt::Debug for SampleSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let degree = self.tables.as_ref().map(|tables| tables.degree());
        f.debug_struct("SampleSource").field("degree", &degree).finish_non_exhaustive()
    }
}

fn points_of(set: PointSet) -> Vec<[f32; 2]> {
    let mut points = vec![[0.0; 2]; COUNT];
    let made = match set {
        PointSet::Even => Points::Sobol { seed: Some(SEED) },
        PointSet::Random => Points::Random { seed: SEED },
    };
    made.fill(0, &mut points);
    points
}

/// The caption of a set that was never prepared.
const UNKNOWN: &str = "nothing is shown";

/// Whether an entry is that of a shared object.
fn is_of<T, V>(entry: &Option<(Weak<T>, V)>, object: &Arc<T>) -> bool {
    entry.as_ref().is_some_and(|(of, _)| of.ptr_eq(&Arc::downgrade(object)))
}

/// Returns the sampler that is kept with new coefficients, or a new one. A failed one is dropped.
fn with_coefficients<S>(
    kept: &mut Option<S>,
    replace: impl FnOnce(&mut S) -> Result<(), Error>,
    make: impl FnOnce() -> Result<S, Error>,
) -> Result<&S, Error> {
    let made = match kept.take() {
        Some(mut sampler) => {
            replace(&mut sampler)?;
            sampler
        }
        None => make()?,
    };
    Ok(kept.insert(made))
}

fn drawn(points: &[[f32; 2]], sample: impl FnOnce(&mut [[f32; 3]], &mut [f32])) -> Vec<[f32; 3]> {
    let (mut directions, mut densities) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
    sample(&mut directions, &mut densities);
    directions
}
