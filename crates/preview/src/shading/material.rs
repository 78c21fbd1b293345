//! rho_hat of materials, in the frame of the surface: +Z the normal, +X the tangent.
//!
//! rho_hat is the BRDF times the incident cosine, in 1/sr, RGB (`brdf::Model::rho_hat`; the texts of the
//! models' modules have the formulas and papers). On the CPU the models compute it in f64: with formulas in
//! f32, brute force takes 0.9 to 1.35 times as long. The shader, material.wgsl, has each formula in f32: the
//! function `material_` and the name of the model's module. It reads the material from words, which are u32:
//!
//! | words | what |
//! | --- | --- |
//! | 1 | the number of layers; a material that is not a sum is one layer |
//! | per layer 1 | its model: its place among `brdf::Constants` |
//! | 1 | the number of words that follow |
//! | | the constants of its formula, `brdf::Constants::pack` |
//!
//! The choice between the formulas is made from the list of models, and the functions that read the constants
//! from their declarations (readers.rs). What the formulas share is in terms.wgsl.
//!
//! The shader's formulas are written for f32: they take the power of a cosine near 1 from the square of its
//! sine and an angle from an arc tangent, and they decide before a division what would be 0 / 0 or out of
//! range. No value is infinite or NaN, for any two unit vectors.

mod readers;
pub(super) mod terms;
#[cfg(test)]
pub(super) mod tests;

use std::collections::BTreeSet;

use brdf::packed::{Layout, Shape};
use brdf::{Constants, MODELS, Material};
use glam::Vec3;
use sphere::Direction;

use crate::RenderError;

/// rho_hat(incident, outgoing) of a material on the CPU. `incident` is a unit vector up to the rounding of
/// f32, which sharp highlights would see.
pub fn rho_hat(material: &Material, incident: Vec3, outgoing: Direction) -> Vec3 {
    single(material.rho_hat(direction(incident), outgoing))
}

/// [`rho_hat`] of light from many directions toward one view: the same values, faster.
pub fn rho_hats(material: &Material, outgoing: Direction, incident: &[Direction]) -> Vec<Vec3> {
    let mut values = vec![[0.0; 3]; incident.len()];
    material.rho_hats_toward(outgoing, incident, &mut values);
    values.into_iter().map(single).collect()
}

/// A value of rho_hat in single precision.
fn single(value: [f64; 3]) -> Vec3 {
    // A conductor that reflects nothing, such as one like air, may be a rounding below 0.
    Vec3::from_array(value.map(|value| value as f32)).max(Vec3::ZERO)
}

/// The direction of a unit vector, without the rounding of its length to f32.
pub fn direction(unit: Vec3) -> Direction {
    Direction::normalised(unit.as_dvec3())
}

/// The constants of every model, by its number.
fn layouts() -> impl Iterator<Item = (u32, &'static Layout)> {
    (0..).zip(Constants::SHAPES.iter().filter_map(Shape::layout))
}

/// The text of the shader for layers of these models, by their numbers in [`PackedMaterial::models`]:
/// what the formulas share, the choice between them, the functions that read constants, and material.wgsl.
///
/// A shader chooses among the models of its material alone: some devices go through every formula that it
/// names, for each look at the material.
pub fn shader(models: &BTreeSet<u32>) -> String {
    let cases = layouts().filter(|(number, _)| models.contains(number)).map(|(number, layout)| {
        format!("        case {number}u: {{ return material_{}(at, light, view); }}\n", layout.name)
    });
    let choice = format!(
        "fn material_layer(model: u32, at: u32, light: vec3f, view: vec3f) -> vec3f {{\n    switch model {{\n{}\
         \x20       default: {{ return vec3f(0.0); }}\n    }}\n}}\n",
        cases.collect::<String>(),
    );
    let readers = readers::readers(layouts().map(|(_, layout)| layout));
    [&terms::shader(), &choice, &readers, include_str!("material.wgsl")].concat()
}

/// The numbers of all models.
#[cfg(test)]
pub(crate) fn all_models() -> BTreeSet<u32> {
    layouts().map(|(number, _)| number).collect()
}

/// The number of a layer's model.
fn number(layer: &Material) -> u32 {
    let of_table = MODELS.len() + usize::from(matches!(layer, Material::MeasuredAnisotropic(_)));
    MODELS.iter().position(|model| model.name == layer.name()).unwrap_or(of_table) as u32
}

/// A material as the shader reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedMaterial {
    words: Vec<u32>,
}

impl PackedMaterial {
    /// Packs a material; without one there is no layer.
    ///
    /// # Errors
    /// [`RenderError::Maps`] if its measured tables are too large for the shader to count their words.
    pub fn new(material: Option<&Material>) -> Result<Self, RenderError> {
        let layers = material.map(Material::leaves).unwrap_or_default();
        let mut words = vec![layers.len() as u32];
        for layer in layers {
            let mut constants = Vec::new();
            layer.constants().iter().for_each(|of| of.pack(&mut constants));
            words.extend([number(layer), constants.len() as u32]);
            words.append(&mut constants);
        }
        match u32::try_from(words.len()) {
            Ok(_) => Ok(Self { words }),
            Err(_) => {
                Err(RenderError::maps("the measured layers of a material are too large for brute force"))
            }
        }
    }

    /// The numbers of the layers' models.
    pub fn models(material: &Material) -> BTreeSet<u32> {
        material.leaves().into_iter().map(number).collect()
    }

    /// The words, for the buffer `material` of the shader.
    pub fn words(&self) -> &[u32] {
        &self.words
    }
}
