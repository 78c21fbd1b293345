//! Prefilters of engines against quadrature to 1e-13 that knows nothing of series.

use serde_json::Value;
use sh::{Basis, Degree, Expansion, Transform};
use shrm::{Distribution, LightBlocks, PrefilterKernel};
use sphere::{DVec3, Direction, LatLong};
use test_data::reference;

fn vector(value: &Value) -> [f64; 3] {
    std::array::from_fn(|index| value[index].as_f64().unwrap())
}

fn distribution(name: &str) -> Distribution {
    match name {
        "ggx" => Distribution::Ggx,
        "charlie" => Distribution::Charlie,
        "cosine" => Distribution::Lambert,
        _ => panic!("unknown kernel {name}"),
    }
}

/// The reference lighting, from its formula.
fn radiance(lighting: &Value, direction: Direction) -> [f64; 3] {
    let mut sum = vector(&lighting["constant"]);
    for lobe in lighting["lobes"].as_array().unwrap() {
        let axis = DVec3::from_array(vector(&lobe["direction"]));
        let sharpness = lobe["sharpness"].as_f64().unwrap();
        let falloff = (sharpness * (direction.vector().dot(axis) - 1.0)).exp();
        let amplitude = vector(&lobe["amplitude"]);
        (0..3).for_each(|channel| sum[channel] += amplitude[channel] * falloff);
    }
    sum
}

fn pixels(lighting: &Value, grid: LatLong) -> Vec<[f64; 3]> {
    (0..grid.len())
        .map(|index| radiance(lighting, grid.direction(index / grid.width, index % grid.width)))
        .collect()
}

/// The reference lighting is smooth: past degree 100 its coefficients are below rounding.
fn series(lighting: &Value) -> Expansion {
    let grid = LatLong::with_rows(256);
    Transform::new(grid, Degree::new(100).unwrap()).unwrap().analyse(&pixels(lighting, grid))
}

#[test]
fn zonal_factors_are_those_of_the_reference() {
    let Some(file) = reference("zonal_factors", "engines/zonal.json") else { return };
    let rows = file["rows"].as_array().unwrap();
    for row in rows {
        let roughness = row["roughness"].as_f64().unwrap_or(1.0);
        let kernel = PrefilterKernel::new(distribution(row["kernel"].as_str().unwrap()), roughness).unwrap();
        let expected = row["k"].as_array().unwrap();
        let found = kernel.factors(expected.len() - 1);
        for (l, (found, expected)) in found.iter().zip(expected).enumerate() {
            let error = (found - expected.as_f64().unwrap()).abs();
            assert!(error < 1e-12, "{kernel:?}, l = {l}: {error:e}");
        }
    }
    assert!(rows.len() >= 10, "{} rows", rows.len());
}

#[test]
fn prefiltered_radiance_is_that_of_the_reference() {
    let Some(lighting) = reference("prefiltered_radiance", "lighting.json") else { return };
    let (series, basis) = (series(&lighting), Basis::new(Degree::new(100).unwrap()));
    let mut count = 0;
    for (name, file) in [("ggx", "prefilter-ggx"), ("charlie", "prefilter-charlie"), ("cosine", "irradiance")]
    {
        let file = reference("prefiltered_radiance", &format!("engines/{file}.json")).unwrap();
        let mut worst = 0.0_f64;
        for row in file["rows"].as_array().unwrap() {
            let roughness = row["roughness"].as_f64().unwrap_or(1.0);
            let kernel = PrefilterKernel::new(distribution(name), roughness).unwrap();
            let normal = Direction::normalised(DVec3::from_array(vector(&row["normal"])));
            let expected = match name {
                "cosine" => vector(&row["irradiance_over_pi"]),
                _ => vector(&row["radiance"]),
            };
            let found = basis.evaluate(&kernel.convolve(&series), normal);
            (0..3).for_each(|channel| worst = worst.max((found[channel] - expected[channel]).abs()));
            count += 1;
        }
        test_data::say(&format!("{name}: at most {worst:.1e} from the reference"));
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
    assert!(count > 50, "{count} rows");
}

/// Blocks have an error of their own: about a thousandth.
#[test]
fn quadrature_is_near_the_reference() {
    let Some(lighting) = reference("quadrature", "lighting.json") else { return };
    let grid = LatLong::with_rows(256);
    let pixels = pixels(&lighting, grid).into_iter().map(|rgb| rgb.map(|value| value as f32)).collect();
    let environment = envmap::Environment::new(grid, pixels).unwrap();
    let blocks = LightBlocks::new(&environment);
    for (name, file) in [("ggx", "prefilter-ggx"), ("charlie", "prefilter-charlie")] {
        let file = reference("quadrature", &format!("engines/{file}.json")).unwrap();
        let (mut worst, mut peak) = (0.0_f64, 0.0_f64);
        for row in file["rows"].as_array().unwrap() {
            let kernel =
                PrefilterKernel::new(distribution(name), row["roughness"].as_f64().unwrap()).unwrap();
            let normal = Direction::normalised(DVec3::from_array(vector(&row["normal"])));
            let expected = vector(&row["radiance"]);
            let found = blocks.prefilter_at(&kernel, normal, LightBlocks::SHARE);
            (0..3).for_each(|channel| {
                worst = worst.max((found[channel] - expected[channel]).abs());
                peak = peak.max(expected[channel]);
            });
        }
        test_data::say(&format!("{name} by quadrature: at most {:.1e} of the peak", worst / peak));
        assert!(worst < 2e-3 * peak, "{name}: {:e}", worst / peak);
    }
}
