//! From a material to the words of [`super::PackedMaterial`].

use std::f64::consts::PI;

use brdf::{Material, Measured, ParameterError, Values};

use super::{
    ASHIKHMIN_SHIRLEY, BLINN_PHONG, GGX, KAJIYA_KAY, LAFORTUNE, LAMBERT, MEASURED, MICROFACET, OREN_NAYAR,
    PHONG, TORRANCE_SPARROW, WARD,
};
use crate::RenderError;

/// The words of a material; see the text of [`super`].
///
/// # Errors
/// [`RenderError::Maps`], with the model's name, where it has no shader.
pub(super) fn words(material: &Material) -> Result<Vec<u32>, RenderError> {
    let layers = layers(material);
    let mut words = Words(vec![layers.len() as u32]);
    let mut tables: Vec<(usize, &Measured)> = Vec::new();
    for layer in layers {
        if let Material::Measured(measured) = layer {
            tables.push((words.0.len() + 4, measured));
            words.measured(measured);
        } else {
            let faulty = |error: ParameterError| {
                RenderError::maps(format!("brute force, material {}: {error}", layer.name()))
            };
            let known = words.analytic(layer.name(), &layer.values()).map_err(faulty)?;
            known.ok_or_else(|| {
                let name = layer.name();
                RenderError::maps(format!(
                    "brute force has no shader for the model {name}: choose another mode"
                ))
            })?;
        }
    }
    for (place, measured) in tables {
        words.0[place] = u32::try_from(words.0.len()).map_err(|_| {
            RenderError::maps("the measured layers of a material are too many for brute force")
        })?;
        words.0.extend(measured.values().as_flattened().iter().map(|value| value.to_bits()));
    }
    Ok(words.0)
}

/// The layers of a material in order, those of layers too.
pub(in crate::shading) fn layers(material: &Material) -> Vec<&Material> {
    let mut layers = Vec::new();
    let mut waiting = vec![material];
    while let Some(next) = waiting.pop() {
        match next {
            Material::Layers(inner) => waiting.extend(inner.iter().rev()),
            layer => layers.push(layer),
        }
    }
    layers
}

struct Words(Vec<u32>);

impl Words {
    fn numbers<const N: usize>(&mut self, values: [f64; N]) {
        self.0.extend(values.map(|value| (value as f32).to_bits()));
    }

    /// The model's number and parameters; `None` where it has no shader.
    fn analytic(&mut self, name: &str, values: &Values) -> Result<Option<()>, ParameterError> {
        let times = |rgb: [f64; 3], factor: f64| rgb.map(|value| value * factor);
        match name {
            "lambert" => {
                self.0.push(LAMBERT);
                self.numbers(times(values.colour("albedo")?, 1.0 / PI));
            }
            "oren-nayar" => {
                let s2 = values.number("sigma")?.to_radians().powi(2);
                let (a, b) = (1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09));
                let albedo = values.colour("albedo")?;
                self.0.push(OREN_NAYAR);
                self.numbers(times(albedo, a / PI));
                self.numbers(times(albedo, b / PI));
            }
            "phong" => {
                let s = values.number("exponent")?;
                self.0.push(PHONG);
                self.numbers([s]);
                self.numbers(times(values.colour("specular")?, (s + 1.0) / (2.0 * PI)));
            }
            "blinn-phong" => {
                let s = values.number("exponent")?;
                let factor = (s + 2.0) * (s + 4.0) / (8.0 * PI * ((-0.5 * s).exp2() + s));
                self.0.push(BLINN_PHONG);
                self.numbers([0.5 * s]);
                self.numbers(times(values.colour("specular")?, factor));
            }
            "microfacet" => {
                let sigma = values.number("sigma")?;
                self.0.push(MICROFACET);
                self.numbers([sigma]);
                self.numbers(times(values.colour("specular")?, 0.25 / (PI * sigma * sigma)));
            }
            "torrance-sparrow" => {
                let m = values.number("roughness")?;
                self.0.push(TORRANCE_SPARROW);
                self.numbers([m]);
                self.numbers(times(values.colour("specular")?, 0.25 / (PI * m * m)));
                self.fresnel(values)?;
            }
            "ggx" => {
                let alpha2 = values.number("roughness")?.powi(4);
                self.0.push(GGX);
                self.numbers([alpha2]);
                self.numbers(times(values.colour("specular")?, 0.5 * alpha2 / PI));
                self.fresnel(values)?;
            }
            "ward" => {
                let [x, y] = along_and_across(values, "roughness", ["roughness_x", "roughness_y"])?;
                self.0.push(WARD);
                self.numbers([x, y]);
                self.numbers(times(values.colour("specular")?, 1.0 / (PI * x * y)));
            }
            "ashikhmin-shirley" => {
                let [x, y] = along_and_across(values, "exponent", ["exponent_x", "exponent_y"])?;
                let (diffuse, specular) = (values.colour("diffuse")?, values.colour("specular")?);
                self.0.push(ASHIKHMIN_SHIRLEY);
                self.numbers([0.5 * x, 0.5 * y, ((x + 1.0) * (y + 1.0)).sqrt() / (8.0 * PI)]);
                self.numbers(specular);
                let base = |channel: usize| diffuse[channel] * (1.0 - specular[channel]);
                self.numbers(times([base(0), base(1), base(2)], 28.0 / (23.0 * PI)));
            }
            "lafortune" => {
                let lobes = values.records("lobes")?;
                self.0.push(LAFORTUNE);
                self.numbers(times(values.colour("diffuse")?, 1.0 / PI));
                self.0.push(lobes.len() as u32);
                for lobe in lobes {
                    self.numbers([lobe.number("cx")?, lobe.number("cz")?, lobe.number("n")?]);
                    self.numbers(lobe.colour("weight")?);
                }
            }
            "kajiya-kay" => {
                self.0.push(KAJIYA_KAY);
                self.numbers([values.number("exponent")?]);
                self.numbers(values.colour("specular")?);
            }
            _ => return Ok(None),
        }
        Ok(Some(()))
    }

    /// What a facet is made of.
    fn fresnel(&mut self, values: &Values) -> Result<(), ParameterError> {
        if let Some(ior) = values.optional_number("ior") {
            self.0.push(0);
            self.numbers([ior, ior, ior, 0.0, 0.0, 0.0]);
        } else {
            self.0.push(1);
            self.numbers(values.colour("n")?);
            self.numbers(values.colour("k")?);
        }
        Ok(())
    }

    /// A table's shape and scale; its place is not known yet.
    fn measured(&mut self, measured: &Measured) {
        self.0.push(MEASURED);
        self.0.extend(measured.shape().map(|n| n as u32));
        self.0.push(0);
        self.numbers(measured.scale());
    }
}

/// A parameter that may be another across the tangent.
pub(in crate::shading) fn along_and_across(
    values: &Values,
    both: &'static str,
    each: [&str; 2],
) -> Result<[f64; 2], ParameterError> {
    let both = values.number(both)?;
    Ok(each.map(|name| values.optional_number(name).unwrap_or(both)))
}
