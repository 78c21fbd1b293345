//! The light that a glossy surface reflects, as a spherical harmonic reflection map on a cube.

use brdf::{Choice, Material, Phong, project};
use sh::{Degree, Expansion, Stop};
use shrm::{MapGrid, Reflection, View};
use sphere::{Cube, Direction};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Light that is 1 + z, in coefficients.
    let sky = vec![[3.544_908; 3], [0.0; 3], [2.046_653; 3], [0.0; 3]];
    let sky = Expansion::from_coefficients(Degree::new(1)?, sky).expect("four rows");

    let glossy = Material::Phong(Phong::new(20.0, [0.8; 3])?);
    let choice = Choice::Degree { f: Degree::new(1)?, p: Degree::ZERO };
    let reflection = Reflection::convolve(&sky, &project(&glossy, choice, Stop::NEVER)?.coefficients);
    let map = reflection.synthesise(MapGrid::Cube(Cube { edge: 16 }), View::Local, Stop::NEVER)?;

    // A map is looked up by the reflection vector; the second direction is the view's in its frame.
    let [up, down] = [Direction::Z, Direction::new(-Direction::Z.vector()).expect("a direction")]
        .map(|direction| map.radiance(direction, Direction::Z)[0]);
    println!("reflected from above {up:.3}, from below {down:.3}");
    assert!(up > 1.4 && down < 0.2);
    Ok(())
}
