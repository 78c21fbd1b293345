//! The integral over all light with many samples: B(V) = the integral of L(w) rho_hat(w, V) over the sphere
//! [RH02, eq. 2].
//!
//! There are two kinds of samples: directions in which the light is bright ([`super::light_samples`]), and
//! directions from which the material reflects ([`super::lobe_sampling`]). The first coordinate of a sample's
//! point ([`super::sequence`]) chooses one. Each sample contributes L rho_hat / (c p_light + (1 - c)
//! p_lobes), where c is the share of the first kind: the one-sample balance heuristic (Veach and Guibas,
//! "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995). It is unbiased, and no sample
//! is larger than 1 / c or 1 / (1 - c) times that of either kind alone.
//!
//! Where many samples are taken, nine of ten follow the product of light and material, in the same heuristic:
//! on the CPU by [`sampling::ProductSampler`], on a device by tables ([`super::product_samples`]). Their
//! contributions are nearly equal where the others' are not, so most of the noise is that of the tenth.
//!
//! Light is distant, and surfaces cast no shadows, unless those of [`super::shadows`] are wanted. The sum
//! converges to `shrm::reference::Reference`, which integrates over the same texels.

#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::Arc;

use brdf::Material;
use glam::{Mat3, Vec3};

use super::light_samples::LightSamples;
use super::lobe_sampling::LobeSampling;
use super::material;
use super::product_samples::{ProductDirections, SHARE};
use super::sequence::Sequence;
use super::surface::Surface;
use crate::{Look, RenderError};

/// A look prepared for sampling.
#[derive(Clone, Debug)]
pub struct Prepared {
    light: Arc<LightSamples>,
    material: Material,
    lobes: LobeSampling,
}

impl Prepared {
    /// Prepares the material of a look. All looks of one light share its samples.
    ///
    /// # Errors
    /// [`RenderError::Missing`] without a material.
    pub fn new(look: &Look) -> Result<Self, RenderError> {
        let material = look
            .material()
            .ok_or(RenderError::Missing { what: "brute force", missing: "the material of the reflection" })?;
        Ok(Self::of(Arc::clone(look.light().samples()), material))
    }

    /// Prepares a material under a light.
    pub fn of(light: Arc<LightSamples>, material: &Material) -> Self {
        let share = if light.is_lit() { 0.5 } else { 0.0 };
        Self::with_light_share(light, material, share)
    }

    /// Prepares a material under a light, with this share of samples of the light.
    pub(crate) fn with_light_share(light: Arc<LightSamples>, material: &Material, share: f32) -> Self {
        Self { light, material: material.clone(), lobes: LobeSampling::new(material, share) }
    }

    /// The light: the buffer `light_samples`.
    pub fn light(&self) -> &Arc<LightSamples> {
        &self.light
    }

    /// The material, which a [`PackedMaterial`](material::PackedMaterial) brings into the buffer `material`.
    pub fn material(&self) -> &Material {
        &self.material
    }

    /// The lobes that samples follow: the buffer `lobe_sampling`.
    pub fn lobes(&self) -> &LobeSampling {
        &self.lobes
    }
}

/// The sum over some light samples at a point of a surface. Divided by their number it is the reflected
/// radiance, RGB.
///
/// `sequence` has the points of the sample of a pixel. `samples` is a range of light samples, from 0 on;
/// adjacent ranges add up to the sum over the whole range but for rounding. The result is never NaN or
/// infinite.
pub fn brute_force(prepared: &Prepared, surface: &Surface, sequence: Sequence, samples: Range<u32>) -> Vec3 {
    brute_force_past(prepared, None, surface, sequence, samples, |_| true)
}

/// Directions that follow the product of light and material from some light sample on.
#[derive(Clone, Copy)]
pub(crate) struct Product<'a> {
    pub(crate) directions: &'a dyn ProductDirections,
    /// The number of samples before.
    pub(crate) first: u32,
}

impl<'a> Product<'a> {
    /// Directions that the samples follow from the first on.
    pub(crate) fn always(directions: &'a dyn ProductDirections) -> Self {
        Self { directions, first: 0 }
    }
}

/// [`brute_force`] of the light that arrives: `sees` says for a direction, in the light's frame, whether
/// light from there does. Most samples follow a `product` of light and material, if there is one; the density
/// of all is then c' p_product + (1 - c') (c p_light + (1 - c) p_lobes).
pub(crate) fn brute_force_past(
    prepared: &Prepared,
    product: Option<Product<'_>>,
    surface: &Surface,
    sequence: Sequence,
    samples: Range<u32>,
    sees: impl Fn(Vec3) -> bool,
) -> Vec3 {
    let Prepared { light, material: of, lobes } = prepared;
    let frame = Mat3::from_cols(surface.tangent, surface.normal.cross(surface.tangent), surface.normal);
    let to_surface = frame.transpose();
    let view = to_surface * surface.view;
    let outgoing = material::direction(view);
    let share = lobes.light();
    let mut sum = Vec3::ZERO;
    for i in samples {
        let product = product.filter(|product| i >= product.first).map(|product| product.directions);
        let product_share = if product.is_some() { SHARE } else { 0.0 };
        let [choice, along] = sequence.point(i);
        let rest = below_1((choice - product_share) / (1.0 - product_share));
        let (incident, lit) = if let Some(product) = product.filter(|_| choice < product_share) {
            let lit = product.sample(light, [below_1(choice / product_share), along]);
            (to_surface * lit.direction, lit)
        } else if rest < share {
            let lit = light.sample([below_1(rest / share), along]);
            (to_surface * lit.direction, lit)
        } else {
            let choice = below_1((rest - share) / (1.0 - share));
            let incident = lobes.sample([choice, along], view);
            (incident, light.at(frame * incident))
        };
        let rho_hat = material::rho_hat(of, incident, outgoing);
        if rho_hat == Vec3::ZERO || !sees(frame * incident) {
            continue;
        }
        let mut density = share * lit.density + (1.0 - share) * lobes.density(incident, view);
        if let Some(product) = product {
            let of_product = product.density(light, frame * incident, &lit);
            density = product_share * of_product + (1.0 - product_share) * density;
        }
        if density > 0.0 {
            sum += lit.radiance * rho_hat / density;
        }
    }
    sum
}

/// Keeps a coordinate below 1 that rounding brought to 1.
fn below_1(coordinate: f32) -> f32 {
    coordinate.min(1.0 - f32::EPSILON / 2.0)
}
