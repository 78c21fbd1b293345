//! Probes for Unity: places and `SphericalHarmonicsL2`, and the editor script that sets them.

use engine::Failure;
use serde::Serialize;

use super::axes::{OF_UNITY, Rows};
use super::light::ProbeLight;
use crate::json::document;

/// The files, in the order of their contents.
pub(crate) const NAMES: [&str; 3] = ["/SpeculaLightProbes.cs", "/README.txt", "/probes.json"];

/// The basis' constants times A_l / pi, by which Unity multiplies nothing but polynomials.
const FACTORS: [f64; 9] = [
    0.282_094_791_773_878_14,
    0.325_735_007_935_279_9,
    0.325_735_007_935_279_9,
    0.325_735_007_935_279_9,
    0.273_137_107_648_019_8,
    0.273_137_107_648_019_8,
    0.078_847_891_313_130_01,
    0.273_137_107_648_019_8,
    0.136_568_553_824_009_88,
];

/// The members of `probes.json`, flat, as Unity's `JsonUtility` reads them.
#[derive(Serialize)]
struct File {
    format: &'static str,
    frame: &'static str,
    scale: &'static str,
    positions: Vec<f32>,
    coefficients: Vec<f32>,
}

/// The files of all probes.
///
/// # Errors
/// If the recipe is not JSON, which never happens.
pub(crate) fn files(light: &ProbeLight<'_>, recipe: &str) -> Result<Vec<Vec<u8>>, Failure> {
    let place = |place: &[f32; 3]| OF_UNITY.vector(*place).map(|x| x as f32);
    let file = File {
        format: "specula probes for Unity 1",
        frame: "left-handed, +Y up, metres: the glTF file with x mirrored",
        scale: "SphericalHarmonicsL2, irradiance over pi: [probe, red green blue, 9]",
        positions: light.places.grid().iter().flat_map(place).collect(),
        coefficients: light.rows.iter().flat_map(coefficients).collect(),
    };
    let script = include_str!("unity.cs").as_bytes().to_vec();
    let readme = include_str!("unity.txt").as_bytes().to_vec();
    Ok(vec![script, readme, document(&file, recipe)?])
}

/// The elements of `SphericalHarmonicsL2`: nine of red, of green and of blue.
pub(crate) fn coefficients(rows: &Rows) -> [f32; 27] {
    let turned = OF_UNITY.rows(rows);
    std::array::from_fn(|index| {
        let (channel, row) = (index / 9, index % 9);
        (FACTORS[row] * f64::from(turned[row][channel])) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{bright_rows, direction, exact};

    /// `SHEvalLinearL0L1` and `SHEvalLinearL2` of Unity's `EntityLighting.hlsl`, after `PackCoefficients`.
    fn shaded(sh: &[f32], [x, y, z]: [f64; 3]) -> f64 {
        let sh = |index: usize| f64::from(sh[index]);
        let a = [sh(3), sh(1), sh(2), sh(0) - sh(6)];
        let b = [sh(4), sh(5), 3.0 * sh(6), sh(7)];
        let linear = a[0] * x + a[1] * y + a[2] * z + a[3];
        linear + b[0] * x * y + b[1] * y * z + b[2] * z * z + b[3] * z * x + sh(8) * (x * x - y * y)
    }

    #[test]
    fn the_shader_shows_the_irradiance() {
        for (k, rows) in bright_rows(200).iter().enumerate() {
            let normal = direction(k);
            let sh = coefficients(rows);
            let expected = exact(rows, normal);
            for channel in 0..3 {
                let found = shaded(&sh[9 * channel..], OF_UNITY.vector(normal.map(|x| x as f32)));
                assert!((found - expected[channel]).abs() < 1e-5, "{found} {expected:?}");
            }
        }
    }
}
