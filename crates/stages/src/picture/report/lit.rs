//! An environment of a report, the light that is made from it once, and surfaces under it by brute force.

use std::cell::OnceCell;

use engine::{Failure, Reporter, Steps};
use envmap::Environment;
use rayon::prelude::*;
use sh::Lighting;
use shrm::degrees::BLACK_SHARE;
use shrm::reference::LightTree;
use sphere::DMat3;
use taps::{ScaleSpace, Widths};

use crate::light::full;
use crate::map::{RESOLUTION, default_scale_space, scale_space_of};
use crate::picture::report::sphere::Sphere;
use crate::values::{LIGHTS, LightCount};

/// The number of pixels between two checks for cancellation.
pub(crate) const BAND: usize = 512;

/// The error of the ground truth: 0.003 stops.
pub(crate) const TRUTH: f64 = 0.002;

/// An environment, and the light that is made from it once.
pub(crate) struct Lit<'a> {
    pub(crate) name: String,
    pub(crate) environment: &'a Environment,
    /// The exposure in stops.
    pub(crate) exposure: f64,
    pub(crate) tree: LightTree<'a>,
    /// The radiance below which a value counts as black.
    pub(crate) dark: f64,
    full: OnceCell<Lighting>,
    space: OnceCell<ScaleSpace>,
    /// Scale spaces with more and more lights beside them.
    spaces: OnceCell<Vec<ScaleSpace>>,
}

/// The numbers of lights beside a scale space whose errors are compared, where there are so many; the last
/// scale space has all.
const KEPT: [usize; 3] = [0, 4, 8];

impl<'a> Lit<'a> {
    pub(crate) fn new(name: String, environment: &'a Environment, exposure: f64) -> Self {
        let tree = LightTree::new(environment);
        // Over the sphere and the three channels.
        let mean = environment.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
        Self {
            name,
            environment,
            exposure,
            tree,
            dark: BLACK_SHARE * mean,
            full: OnceCell::new(),
            space: OnceCell::new(),
            spaces: OnceCell::new(),
        }
    }

    /// The scale space that the kind of that name makes by default.
    pub(crate) fn space(&self, reporter: &Reporter) -> Result<&ScaleSpace, Failure> {
        if let Some(space) = self.space.get() {
            return Ok(space);
        }
        let made = default_scale_space(self.environment, reporter)?;
        Ok(self.space.get_or_init(|| made))
    }

    /// The scale spaces with 0, 4, 8 and all lights beside them, of which none has as many as another.
    pub(crate) fn spaces(&self, reporter: &Reporter) -> Result<&[ScaleSpace], Failure> {
        if let Some(spaces) = self.spaces.get() {
            return Ok(spaces);
        }
        let widths = Widths::new(RESOLUTION).unwrap_or(Widths::FINEST);
        let (whole, lights) = scale_space_of(self.environment, widths, LightCount::All, reporter)?;
        let fewer = KEPT.into_iter().filter(|count| *count < lights);
        let mut spaces = Vec::new();
        for count in fewer {
            reporter.check_cancelled()?;
            spaces.push(if LIGHTS == LightCount::Most(count) {
                self.space(reporter)?.clone()
            } else {
                whole.keeping(count)
            });
        }
        spaces.push(whole);
        Ok(self.spaces.get_or_init(|| spaces))
    }

    /// The lighting that `project-sh` makes by default.
    pub(crate) fn full(&self, reporter: &Reporter) -> Result<&Lighting, Failure> {
        if let Some(full) = self.full.get() {
            return Ok(full);
        }
        let made = full(self.environment, reporter)?;
        Ok(self.full.get_or_init(|| made))
    }
}

/// The radiance of surfaces by brute force, seen from [`Sphere::view`]: frames with their tangents, other
/// directions in the surface and normals as columns. It takes a step.
pub(crate) fn brute_force(
    lit: &Lit<'_>,
    material: &brdf::Material,
    axes: &[DMat3],
    steps: &Steps<'_>,
) -> Result<Vec<[f32; 3]>, Failure> {
    let steps = steps.part(1, axes.len().div_ceil(BAND));
    let (tree, dark) = (&lit.tree, lit.dark);
    let mut truth = vec![[0.0_f32; 3]; axes.len()];
    for (values, axes) in truth.chunks_mut(BAND).zip(axes.chunks(BAND)) {
        steps.step()?;
        values.par_iter_mut().zip(axes).for_each(|(value, axes)| {
            let radiance = tree.surface_radiance(material, *axes, Sphere::view(), TRUTH, dark);
            *value = radiance.map(|value| value as f32);
        });
    }
    Ok(truth)
}
