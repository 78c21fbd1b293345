//! Points on spheres: a function on the ball of directions, and the points that follow it.

use sampling::{Options, Sampler, Tables};
use sh::{Basis, Degree};
use sphere::{DVec3, Direction};

use super::phong::Phong;
use super::picture::{Picture, grey, mix};
use super::{POINTS, first, vector};

/// The number of points on a ball.
pub const COUNT: usize = 1024;

/// The width of a ball in pixels.
const SIZE: usize = 280;

/// Where the series is negative.
const NEGATIVE: [u8; 3] = [70, 110, 220];

/// A row of balls for each of [`POINTS`], random ones above: Phong's lobe with exponent 10 at degree 7, with
/// exponent 20 at degree 12, and a lobe stretched across at degree 12.
///
/// # Errors
/// If a degree is too high.
pub fn draw() -> Result<Picture, Box<dyn std::error::Error>> {
    let axis = Direction::from_angles(1.2, 0.5);
    let phong = |exponent, degree| -> Result<_, sh::DegreeTooHigh> {
        Ok(Phong { exponent, axis }.coefficients(Degree::new(degree)?))
    };
    // The product of two lobes side by side is long in their plane.
    let stretched = {
        let lobe = |phi| -> Result<_, sh::DegreeTooHigh> {
            Ok(Phong { exponent: 30, axis: Direction::from_angles(1.2, phi) }.coefficients(Degree::new(12)?))
        };
        let lobes = [lobe(0.0)?, lobe(0.25)?, lobe(0.5)?, lobe(0.75)?, lobe(1.0)?];
        (0..lobes[0].len()).map(|k| lobes.iter().map(|lobe| lobe[k]).sum()).collect()
    };
    let functions = [phong(10, 7)?, phong(20, 12)?, stretched];
    let mut rows = Vec::new();
    for points in POINTS {
        let mut row = Vec::new();
        for coefficients in &functions {
            let degree = Degree::new(coefficients.len().isqrt() - 1)?;
            let sampler = Sampler::new(&Tables::new(degree), coefficients, Options::default())?;
            let points = first(points, COUNT);
            let (mut directions, mut densities) = (vec![[0.0; 3]; COUNT], vec![0.0; COUNT]);
            sampler.sample_into(&points, &mut directions, &mut densities);
            row.push(ball(axis, degree, coefficients, &directions));
        }
        rows.push(row);
    }
    Ok(Picture::sheet(&rows))
}

/// The ball seen from 40 degrees beside the axis.
fn ball(axis: Direction, degree: Degree, coefficients: &[f64], directions: &[[f32; 3]]) -> Picture {
    let side = axis.vector().cross(DVec3::Z).normalize();
    let eye = (axis.vector() * 40f64.to_radians().cos() + side * 40f64.to_radians().sin()).normalize();
    let right = DVec3::Z.cross(eye).normalize();
    let up = eye.cross(right);
    let radius = SIZE as f64 / 2.0 - 1.0;
    let basis = Basis::new(degree);
    let value = |w: DVec3| {
        let mut harmonics = vec![0.0; degree.rows()];
        basis.evaluate_into(Direction::normalised(w), &mut harmonics);
        harmonics.iter().zip(coefficients).map(|(y, f)| y * f).sum::<f64>()
    };
    let largest = value(axis.vector());
    let mut picture = Picture::new(SIZE, SIZE, |column, row| {
        let x = (column as f64 + 0.5 - SIZE as f64 / 2.0) / radius;
        let y = (SIZE as f64 / 2.0 - row as f64 - 0.5) / radius;
        let Some(depth) = (1.0 - x * x - y * y > 0.0).then(|| (1.0 - x * x - y * y).sqrt()) else {
            return [255; 3];
        };
        let f = value(right * x + up * y + eye * depth) / largest;
        if f < 0.0 { mix(grey(0.0), NEGATIVE, (-10.0 * f).min(1.0)) } else { grey(f) }
    });
    for w in directions.iter().map(|w| vector(*w)).filter(|w| w.dot(eye) > 0.0) {
        let middle = SIZE as f64 / 2.0;
        picture.dot([middle + radius * w.dot(right), middle - radius * w.dot(up)], 1.6);
    }
    picture
}
