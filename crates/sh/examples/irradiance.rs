//! The irradiance of surfaces under a sky, from nine coefficients.

use sh::{Degree, Expansion, Transform, lambda};
use sphere::{Direction, LatLong};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A sky as bright as the height above the horizon, and black ground.
    let grid = LatLong::with_rows(64);
    let height = |k: usize| grid.direction(k / grid.width, k % grid.width).vector().z;
    let sky: Vec<[f32; 3]> = (0..grid.len()).map(|k| [height(k).max(0.0) as f32; 3]).collect();

    let light = Transform::new(grid, Degree::new(2)?)?.analyse(&sky);

    // A convolution with the clamped cosine: its zonal coefficients times Lambda_l.
    let cosine = [0.886_227, 1.023_327, 0.495_416];
    let row = |k: usize| light.coefficients()[k].map(|value| value * lambda(k.isqrt()) * cosine[k.isqrt()]);
    let irradiance =
        Expansion::from_coefficients(light.degree(), (0..9).map(row).collect()).expect("nine rows");

    // Facing up: the integral of cos^2 over the upper half, 2 pi / 3.
    let [red, ..] = irradiance.evaluate(Direction::Z);
    println!("irradiance facing up: {red:.3}");
    assert!((red - 2.094).abs() < 0.02);
    Ok(())
}
