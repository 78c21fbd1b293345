//! A light rig as samples of the light, for renderers that importance-sample an environment.

use std::f64::consts::{PI, TAU};

use sh::Light;

use super::file::Writer;
use crate::error::Error;
use crate::values::light_rig::check;

/// Lights as one sample each, all f32: `direction` [n, 3], toward the light, +Z up; `radiance` [n, 3], the
/// mean over its solid angle; `pdf` \[n\], in 1/sr; `mip` \[n\].
///
/// The sample of a light of solid angle W has the density 1 / (n W), so that 1/n times the sum of radiance
/// times f(direction) / pdf is the sum of the lights' flux times f. W is at least that of a texel of a
/// lat-long map of `rows` rows, 2 pi / rows^2, and `mip` is that map's level whose texels are as large as W,
///
/// > log2(W / (2 pi / rows^2)) / 2
///
/// (Krivanek and Colbert 2008, "Real-time shading with filtered importance sampling"; GPU Gems 3, chapter 20,
/// has it with W = 1 / (n pdf)).
///
/// # Errors
/// If an irradiance is negative or not finite.
///
/// # Panics
/// If `rows` is 0.
pub fn encode_light_rig(lights: &[Light], rows: usize, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    assert!(rows > 0, "a map has rows");
    check(lights, recipe).map_err(|error| error.within("safetensors"))?;
    let texel = TAU / (rows * rows) as f64;
    let solid_angle = |light: &Light| (4.0 * PI * math::powi(math::sin(light.radius / 2.0), 2)).max(texel);
    let mut file = Writer::new("light-rig", recipe);
    file.entry("rows", rows.to_string());
    let mut tensor = |name: &str, width: usize, values: Vec<f64>| {
        let values: Vec<f32> = values.iter().map(|value| *value as f32).collect();
        file.extend_f32(&values);
        let shape = [lights.len(), width];
        file.tensor(name, "F32", &shape[..if width == 1 { 1 } else { 2 }]);
    };
    let directions = lights.iter().flat_map(|light| light.direction.vector().to_array());
    tensor("direction", 3, directions.collect());
    let radiance = lights.iter().flat_map(|light| light.flux().map(|flux| flux / solid_angle(light)));
    tensor("radiance", 3, radiance.collect());
    tensor("pdf", 1, lights.iter().map(|light| 1.0 / (lights.len() as f64 * solid_angle(light))).collect());
    tensor("mip", 1, lights.iter().map(|light| math::log2(solid_angle(light) / texel) / 2.0).collect());
    Ok(file.finish())
}

#[cfg(test)]
mod tests {
    use safetensors::SafeTensors;
    use sphere::Direction;

    use super::*;

    #[test]
    fn samples_have_the_flux_of_their_lights() {
        let light = |theta, radius, flux| Light::from_flux(Direction::from_angles(theta, 1.0), radius, flux);
        let lights = [
            light(0.3, 0.2, [3.0, 2.0, 1.0]),
            light(2.0, PI / 2.0, [0.5; 3]),
            light(1.0, 0.0, [9.0, 0.0, 1.0]),
        ];
        let bytes = encode_light_rig(&lights, 64, Some("{}")).unwrap();
        assert_eq!(crate::read_recipe::read_recipe(&bytes).as_deref(), Some("{}"));
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let numbers = |name: &str| -> Vec<f64> {
            let words = file.tensor(name).unwrap().data().chunks(4);
            words.map(|word| f32::from_le_bytes(word.try_into().unwrap()).into()).collect()
        };
        assert_eq!(file.tensor("radiance").unwrap().shape(), [3, 3]);
        assert_eq!(file.tensor("pdf").unwrap().shape(), [3]);
        let [directions, radiance] = ["direction", "radiance"].map(numbers);
        let [pdf, mip] = ["pdf", "mip"].map(numbers);
        for (k, light) in lights.iter().enumerate() {
            let flux = light.flux();
            for c in 0..3 {
                assert!((directions[3 * k + c] - light.direction.vector()[c]).abs() < 1e-7);
                assert!((radiance[3 * k + c] / (3.0 * pdf[k]) - flux[c]).abs() < 1e-6 * flux[0], "{k} {c}");
            }
        }
        // A hemisphere is half of the map's texels (rows^2 = 4^6 of 2 rows^2), a point one of them.
        assert!((mip[1] - 6.0).abs() < 1e-6 && mip[2] == 0.0, "{mip:?}");
        assert!((pdf[1] - 1.0 / (3.0 * 2.0 * PI)).abs() < 1e-7);
    }
}
