//! The brute-force reference against integrals that other code made of a smooth lighting, with 24 central
//! directions and views for each material.

use envmap::Environment;
use serde_json::Value;
use shrm::reference::{Cull, Reference};
use sphere::{DVec3, LatLong};
use test_data::reference;

use crate::given::{direction, material, triple};

/// constant + sum of amplitude exp(sharpness (w . direction - 1)), as an image.
fn image(file: &Value, rows: usize) -> Environment {
    let grid = LatLong::with_rows(rows);
    let lobes: Vec<_> = file["lobes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|lobe| {
            let direction = DVec3::from(triple(&lobe["direction"]));
            (direction, lobe["sharpness"].as_f64().unwrap(), triple(&lobe["amplitude"]))
        })
        .collect();
    let pixels = (0..grid.len()).map(|texel| {
        let w = grid.direction(texel / grid.width, texel % grid.width).vector();
        let mut sum = triple(&file["constant"]);
        for (direction, sharpness, amplitude) in &lobes {
            let lobe = (sharpness * (w.dot(*direction) - 1.0)).exp();
            (0..3).for_each(|channel| sum[channel] += amplitude[channel] * lobe);
        }
        sum.map(|value| value as f32)
    });
    Environment::new(grid, pixels.collect()).unwrap()
}

/// With 512 rows, h = 6.1e-3. The midpoint rule with exact solid angles errs by h^2 / 24 = 1.6e-6 times the
/// second derivative relative to the largest radiance, below 50 for lighting times lobe: 8e-5. The microfacet
/// model jumps at the horizon: the texels on that great circle, h of 4 pi sr each side, are wrong by up to a
/// half of the jump with signs that mostly cancel along it, which is allowed as much again.
#[test]
fn all_six_reference_tables_come_back_from_an_image() {
    let test = "all_six_reference_tables_come_back_from_an_image";
    let Some(light) = reference(test, "lighting.json") else { return };
    let sky = image(&light, 512);
    for name in ["lambert-0", "phong-1", "microfacet-2", "microfacet-3", "kajiya-kay-4", "lafortune-5"] {
        let Some(file) = reference(test, &format!("{name}.json")) else { return };
        let brute_force = Reference::new(&sky, &material(&file), Cull::None);
        let rows = file["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 24);
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for row in rows {
            let [central, view] = ["central", "view"].map(|name| direction(&row[name]));
            let found = brute_force.radiance(central, view);
            for (found, expected) in found.into_iter().zip(triple(&row["radiance"])) {
                worst = worst.max((found - expected).abs());
                largest = largest.max(expected);
            }
        }
        println!("{name}: within {:.1e} of the largest radiance", worst / largest);
        assert!(worst < 2e-4 * largest, "{name}: {:e}", worst / largest);
    }
}
