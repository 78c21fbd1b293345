//! Which lobes a material's layers have.

use brdf::{Material, Measured, ParameterError, Values};

use super::Lobe;
use crate::shading::material::packing::{along_and_across, layers};

/// The narrowest facets and the sharpest power that f32 directions follow.
const NARROWEST: f64 = 1e-4;
const SHARPEST: f64 = 1e7;

/// The lobes of all layers, each once; one at least.
pub(super) fn lobes(material: &Material) -> Vec<Lobe> {
    let mut lobes: Vec<Lobe> = Vec::new();
    for layer in layers(material) {
        // A parameter that is not there is found when the material is packed.
        for lobe in of_layer(layer).unwrap_or_default() {
            if !lobes.contains(&lobe) {
                lobes.push(lobe);
            }
        }
    }
    if lobes.is_empty() {
        lobes.push(Lobe::Cosine);
    }
    lobes
}

fn of_layer(layer: &Material) -> Result<Vec<Lobe>, ParameterError> {
    if let Material::Measured(measured) = layer {
        return Ok(vec![facets([width(measured); 2]), Lobe::Cosine]);
    }
    let values = &layer.values();
    Ok(match layer.name() {
        "phong" => vec![power(-1.0, 1.0, values.number("exponent")?)],
        "blinn-phong" => vec![facets([of_power(values.number("exponent")?); 2])],
        "microfacet" => vec![facets([values.number("sigma")?; 2])],
        "torrance-sparrow" => vec![facets([values.number("roughness")?; 2])],
        "ggx" => vec![facets([values.number("roughness")?.powi(2); 2])],
        "ward" => vec![facets(along_and_across(values, "roughness", ["roughness_x", "roughness_y"])?)],
        "ashikhmin-shirley" => {
            let exponents = along_and_across(values, "exponent", ["exponent_x", "exponent_y"])?;
            vec![facets(exponents.map(of_power)), Lobe::Cosine]
        }
        "lafortune" => lafortune(values)?,
        "kajiya-kay" => {
            let width = (values.number("exponent")? + 1.0).powf(-0.5);
            vec![Lobe::Band { width: width.max(NARROWEST) as f32 }]
        }
        _ => vec![Lobe::Cosine],
    })
}

/// A lobe of Lafortune's model is a power about its axis; the matte part is a cosine.
fn lafortune(values: &Values) -> Result<Vec<Lobe>, ParameterError> {
    let mut lobes = vec![Lobe::Cosine];
    for lobe in values.records("lobes")? {
        lobes.push(power(lobe.number("cx")?, lobe.number("cz")?, lobe.number("n")?));
    }
    Ok(lobes)
}

fn power(cx: f64, cz: f64, n: f64) -> Lobe {
    Lobe::Power { cx: cx as f32, cz: cz as f32, n: n.min(SHARPEST) as f32 }
}

fn facets([x, y]: [f64; 2]) -> Lobe {
    let width = |width: f64| width.clamp(NARROWEST, 1.0) as f32;
    Lobe::Facets { x: width(x), y: width(y) }
}

/// The width of facets like (N.h)^s: both fall as 1 - (s / 2 + 1) theta^2 when seen in the light's directions.
fn of_power(s: f64) -> f64 {
    (2.0 / (s + 2.0)).sqrt()
}

/// The width of facets that have fallen to a half where a measured table, seen head on, has fallen half way from its
/// peak to what it is at 60 degrees: GGX's D is a half at tan^2(theta_h) = a^2 (sqrt(2) - 1).
fn width(measured: &Measured) -> f64 {
    let shape = measured.shape();
    let [n_h, n_d, n_phi] = shape;
    let grey =
        |h: usize| measured.values()[h * n_d * n_phi].iter().map(|value| f64::from(*value)).sum::<f64>();
    let theta = |h: usize| Measured::node(shape, [h, 0, 0])[0];
    let base = (0..n_h).take_while(|h| theta(*h) < 60f64.to_radians()).last().map_or(0.0, grey);
    let half = 0.5 * (grey(0) + base);
    let fallen = (0..n_h).find(|h| grey(*h) < half).map_or(1.0, |h| theta(h).tan());
    fallen / (2f64.sqrt() - 1.0).sqrt()
}
