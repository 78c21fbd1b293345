//! An integral over light that is given by spherical harmonics, by samples in proportion to the light.

use sampling::{Options, Sampler, Tables};
use sh::Degree;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // f = 1 + z, in coefficients.
    let light = [3.544_908, 0.0, 2.046_653, 0.0];
    let sampler = Sampler::new(&Tables::new(Degree::new(1)?), &light, Options::default())?;

    // The irradiance of a surface that faces up: the integral of f times the clamped cosine.
    let count = 64;
    let mut sum = 0.0;
    for k in 0..count * count {
        let point = [(k / count) as f32 + 0.5, (k % count) as f32 + 0.5].map(|at| at / count as f32);
        let sample = sampler.sample(point);
        let z = f64::from(sample.direction[2]);
        sum += (1.0 + z) * z.max(0.0) / f64::from(sample.density);
    }
    let found = sum / f64::from(count * count);
    println!("irradiance facing up: {found:.3}");
    assert!((found - 5.0 / 3.0 * std::f64::consts::PI).abs() < 0.05);
    Ok(())
}
