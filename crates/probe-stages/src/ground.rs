//! Ground below the horizon of a sky.

use std::f64::consts::PI;

use engine::serde_json::{self, json};
use engine::{Diagnostic, Parameter, Value, ValueKind, unexpected};
use sh::quadrature::gauss_legendre;
use sh::{Basis, Degree, Expansion};
use sphere::{DVec3, Direction, LatLong};

/// What is below the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ground {
    /// What the sky has there.
    Sky,
    /// A plain, infinitely far below, with this albedo, under the half of the sky that is above it.
    Albedo([f64; 3]),
}

impl Parameter for Ground {
    fn expected() -> String {
        "\"sky\", or an albedo from 0 to 1 or [red, green, blue]".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let wrong = || unexpected(value, &Self::expected());
        let albedo = match &value.kind {
            ValueKind::String(word) if word == "sky" => return Ok(Self::Sky),
            ValueKind::Array(_) => {
                let channels = Vec::<f64>::parse(value).map_err(|_| wrong())?;
                <[f64; 3]>::try_from(channels).map_err(|_| wrong())?
            }
            _ => [f64::parse(value).map_err(|_| wrong())?; 3],
        };
        let is_albedo = albedo.iter().all(|channel| (0.0..=1.0).contains(channel));
        if is_albedo { Ok(Self::Albedo(albedo)) } else { Err(wrong()) }
    }

    fn canonical(&self) -> serde_json::Value {
        match self {
            Self::Sky => json!("sky"),
            Self::Albedo(albedo) => json!(albedo),
        }
    }

    fn schema() -> serde_json::Value {
        json!({
            "type": ["string", "number", "array"], "pattern": "^sky$", "minimum": 0, "maximum": 1,
            "items": { "type": "number", "minimum": 0, "maximum": 1 }, "minItems": 3, "maxItems": 3,
        })
    }
}

/// Replaces the lower half of an image by ground of an albedo. A row at the horizon is below it.
pub(crate) fn under_image(grid: LatLong, pixels: &mut [[f32; 3]], albedo: [f64; 3]) {
    let z = |row: usize| grid.direction(row, 0).vector().z;
    let mut irradiance = [0.0; 3];
    for (row, pixels) in pixels.chunks_exact(grid.width).enumerate() {
        let weight = grid.solid_angle(row) * z(row).max(0.0);
        for pixel in pixels {
            (0..3).for_each(|channel| irradiance[channel] += weight * f64::from(pixel[channel]));
        }
    }
    let ground = [0, 1, 2].map(|channel| (albedo[channel] * irradiance[channel] / PI) as f32);
    for (row, pixels) in pixels.chunks_exact_mut(grid.width).enumerate() {
        if z(row) <= 0.0 {
            pixels.fill(ground);
        }
    }
}

/// The rows up to a degree of a sky whose lower half is replaced by ground of an albedo.
///
/// Exact: in each half all products are polynomials, which Gauss' and the trapezoidal rule integrate.
pub(crate) fn under_series(sky: &Expansion, albedo: [f64; 3], degree: Degree) -> Expansion {
    let (own, highest) = (sky.degree().get(), sky.degree().max(degree).get());
    let (nodes, columns) = (highest + 2, 2 * highest + 3);
    let (of_sky, of_degree) = (Basis::new(sky.degree()), Basis::new(degree));
    let (mut in_sky, mut found) = (vec![0.0; (own + 1) * (own + 1)], vec![0.0; degree.rows()]);
    let (mut above, mut below) = (vec![[0.0; 3]; degree.rows()], vec![0.0; degree.rows()]);
    let mut irradiance = [0.0; 3];
    let (angles, weights) = gauss_legendre(nodes);
    for (angle, weight) in angles.into_iter().zip(weights) {
        // From -1 to 1 to the heights from 0 to 1.
        let (z, weight) = (0.5 * (math::cos(angle) + 1.0), 0.5 * weight * 2.0 * PI / columns as f64);
        let radius = (1.0 - z * z).max(0.0).sqrt();
        for column in 0..columns {
            let phi = 2.0 * PI * column as f64 / columns as f64;
            let (x, y) = (radius * math::cos(phi), radius * math::sin(phi));
            let direction = Direction::normalised(DVec3::new(x, y, z));
            of_sky.evaluate_into(direction, &mut in_sky);
            of_degree.evaluate_into(direction, &mut found);
            let mut radiance = [0.0; 3];
            for (row, y) in sky.coefficients().iter().zip(&in_sky) {
                (0..3).for_each(|channel| radiance[channel] += row[channel] * y);
            }
            (0..3).for_each(|channel| irradiance[channel] += weight * z * radiance[channel]);
            for (sum, y) in above.iter_mut().zip(&found) {
                (0..3).for_each(|channel| sum[channel] += weight * radiance[channel] * y);
            }
            of_degree.evaluate_into(Direction::normalised(DVec3::new(x, y, -z)), &mut found);
            below.iter_mut().zip(&found).for_each(|(sum, y)| *sum += weight * y);
        }
    }
    let ground = [0, 1, 2].map(|channel| albedo[channel] * irradiance[channel] / PI);
    let row = |(above, below): ([f64; 3], f64)| [0, 1, 2].map(|c| above[c] + ground[c] * below);
    let rows = above.into_iter().zip(below).map(row).collect();
    Expansion::from_coefficients(degree, rows).unwrap_or_else(|| Expansion::zero(degree))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degree(l: usize) -> Degree {
        Degree::new(l).unwrap()
    }

    /// Under a sky of 1 the ground has its albedo: half of the sphere each.
    #[test]
    fn ground_reflects_the_half_above_it() {
        let root = 2.0 * PI.sqrt();
        let sky = Expansion::from_coefficients(degree(0), vec![[root; 3]]).unwrap();
        let albedo = [0.0, 0.5, 1.0];
        let found = under_series(&sky, albedo, degree(4));
        let rows = found.coefficients();
        for channel in 0..3 {
            let expected = 0.5 * root * (1.0 + albedo[channel]);
            assert!((rows[0][channel] - expected).abs() < 1e-12);
            let along = 0.488_602_511_902_919_9 * PI * (1.0 - albedo[channel]);
            assert!((rows[2][channel] - along).abs() < 1e-12);
        }
        let grid = LatLong::with_rows(64);
        let mut pixels = vec![[1.0; 3]; grid.len()];
        under_image(grid, &mut pixels, albedo);
        let lower = pixels[grid.len() - 1];
        assert!(
            (0..3).all(|channel| (f64::from(lower[channel]) - albedo[channel]).abs() < 1e-3),
            "{lower:?}"
        );
        assert_eq!(pixels[0], [1.0; 3]);
        let of_image = sh::Transform::new(grid, degree(4)).unwrap().analyse(&pixels);
        for (a, b) in of_image.coefficients().iter().zip(rows) {
            assert!((0..3).all(|channel| (a[channel] - b[channel]).abs() < 3e-3), "{a:?} {b:?}");
        }
    }
}
