//! Directions drawn from a [`Lobe`], and their density, in f64.
//!
//! | lobe | density over incident directions |
//! | --- | --- |
//! | cosine | cos(theta_i) / pi |
//! | power | (n + 1) / (2 pi) cos^n from the axis (cx V_x, cx V_y, cz V_z) |
//! | facets | D(h) / (2 (N.V + sqrt(a_x^2 V_x^2 + a_y^2 V_y^2 + (N.V)^2))), D being GGX of the widths (a_x, a_y) |
//! | band | Cauchy's in theta_i - theta_o, angles from the tangent, over 2 pi sin(theta_i) |
//!
//! The facets are those that the viewer sees (Heitz 2018, "Sampling the GGX Distribution of Visible
//! Normals"), by Dupuy and Benyoub's cap of the sphere ("Sampling Visible GGX Normals with Spherical Caps",
//! 2023).

use std::f64::consts::{PI, TAU};

use sphere::{DVec3, Direction};

use super::lobe::Lobe;

impl Lobe {
    /// The incident direction for a point of the unit square, in the frame of the surface; it may lie below
    /// the horizon.
    pub fn sample(&self, point: [f64; 2], outgoing: Direction) -> Direction {
        let (sine, cosine) = math::sin_cos(TAU * point[0]);
        let view = outgoing.vector();
        Direction::normalised(match *self {
            Self::Cosine => {
                let level = point[1].sqrt();
                DVec3::new(level * cosine, level * sine, (1.0 - point[1]).sqrt())
            }
            Self::Power { cx, cz, n } => {
                // 1 - e^x without cancellation.
                let sin2 = -math::exp_m1(2.0 * math::ln(1.0 - point[1]) / (f64::from(n) + 1.0));
                let level = sin2.sqrt();
                let axis = axis(cx, cz, view);
                let right = axis.any_orthonormal_vector();
                let up = axis.cross(right);
                right * (level * cosine) + up * (level * sine) + axis * (1.0 - sin2).max(0.0).sqrt()
            }
            Self::Facets { x, y } => {
                let (x, y) = (f64::from(x), f64::from(y));
                let flat = DVec3::new(x * view.x, y * view.y, view.z.max(0.0)).try_normalize();
                let flat = flat.unwrap_or(DVec3::Z);
                let z = (1.0 - point[1]) * (1.0 + flat.z) - flat.z;
                let level = (1.0 - z * z).max(0.0).sqrt();
                let facet = DVec3::new(level * cosine, level * sine, z) + flat;
                let facet = DVec3::new(x * facet.x, y * facet.y, facet.z).try_normalize();
                let facet = facet.unwrap_or(DVec3::Z);
                facet * (2.0 * facet.dot(view)) - view
            }
            Self::Band { width } => {
                let (width, theta_o) = (f64::from(width), from_tangent(view));
                let [low, high] = band_ends(width, theta_o);
                let away = math::tan(low + (high - low) * point[1]);
                let (level, along) = math::sin_cos((theta_o + width * away).clamp(0.0, PI));
                DVec3::new(along, level * cosine, level * sine)
            }
        })
    }

    /// The density of [`Lobe::sample`] at an incident direction, in 1/sr.
    pub fn density(&self, incident: Direction, outgoing: Direction) -> f64 {
        let (incident, view) = (incident.vector(), outgoing.vector());
        match *self {
            Self::Cosine => incident.z.max(0.0) / PI,
            Self::Power { cx, cz, n } => {
                let n = f64::from(n);
                (n + 1.0) / TAU * math::pow(incident.dot(axis(cx, cz, view)).max(0.0), n)
            }
            Self::Facets { x, y } => {
                let (x, y) = (f64::from(x), f64::from(y));
                let sum = incident + view;
                let length_squared = sum.length_squared();
                if sum.z <= 0.0 || length_squared <= 1e-20 {
                    return 0.0;
                }
                let spread = (math::powi(sum.x / x, 2) + math::powi(sum.y / y, 2) + math::powi(sum.z, 2))
                    / length_squared;
                let d = 1.0 / (PI * x * y * spread * spread);
                let height = view.z.max(0.0);
                let flat = DVec3::new(x * view.x, y * view.y, height).length();
                d / (2.0 * (height + flat)).max(1e-12)
            }
            Self::Band { width } => {
                let (width, theta_o) = (f64::from(width), from_tangent(view));
                let [low, high] = band_ends(width, theta_o);
                let away = (from_tangent(incident) - theta_o) / width;
                let sine = math::hypot(incident.y, incident.z).max(1e-9);
                1.0 / (width * (1.0 + away * away) * (high - low) * TAU * sine)
            }
        }
    }
}

/// The axis of a power lobe; the normal if it has none.
fn axis(cx: f32, cz: f32, view: DVec3) -> DVec3 {
    let (cx, cz) = (f64::from(cx), f64::from(cz));
    DVec3::new(cx * view.x, cx * view.y, cz * view.z).try_normalize().unwrap_or(DVec3::Z)
}

/// The angle from the tangent, +X.
fn from_tangent(direction: DVec3) -> f64 {
    math::atan2(math::hypot(direction.y, direction.z), direction.x)
}

/// The arc tangents of the ends of the band, where theta_i is 0 and pi.
fn band_ends(width: f64, theta_o: f64) -> [f64; 2] {
    [-math::atan2(theta_o, width), math::atan2(PI - theta_o, width)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOBES: [Lobe; 6] = [
        Lobe::Cosine,
        Lobe::Power { cx: -1.0, cz: 1.0, n: 20.0 },
        Lobe::Power { cx: -0.7, cz: 0.9, n: 3.0 },
        Lobe::Facets { x: 0.3, y: 0.3 },
        Lobe::Facets { x: 0.2, y: 0.6 },
        Lobe::Band { width: 0.3 },
    ];

    /// Rows of equal height of z by columns of equal width of phi.
    const CELLS: [usize; 2] = [12, 16];

    fn cell(w: DVec3) -> usize {
        let row = ((1.0 - w.z) / 2.0 * CELLS[0] as f64) as usize;
        let column = ((w.y.atan2(w.x) / TAU + 0.5) * CELLS[1] as f64) as usize;
        row.min(CELLS[0] - 1) * CELLS[1] + column.min(CELLS[1] - 1)
    }

    /// The share of directions in each cell, of 200 000 evenly spread points, is the integral of the density
    /// over it by 60 x 60 midpoints.
    #[test]
    fn directions_are_drawn_with_the_density_told() {
        for lobe in LOBES {
            for theta in [0.0, 0.6, 1.4] {
                let view = Direction::from_angles(theta, 0.8);
                let mut found = [0.0; CELLS[0] * CELLS[1]];
                let count = 200_000;
                for i in 0..count {
                    let point = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
                    let point = point.map(|step| (0.5 + step * f64::from(i)).fract());
                    found[cell(lobe.sample(point, view).vector())] += 1.0 / f64::from(count);
                }
                let mut expected = [0.0; CELLS[0] * CELLS[1]];
                let fine = CELLS.map(|cells| 60 * cells);
                for index in 0..fine[0] * fine[1] {
                    let (row, column) = (index / fine[1], index % fine[1]);
                    let z = 1.0 - 2.0 * (row as f64 + 0.5) / fine[0] as f64;
                    let phi = TAU * ((column as f64 + 0.5) / fine[1] as f64 - 0.5);
                    let w = Direction::from_angles(z.acos(), phi);
                    expected[cell(w.vector())] +=
                        lobe.density(w, view) * 2.0 * TAU / (fine[0] * fine[1]) as f64;
                }
                let total: f64 = expected.iter().sum();
                assert!((total - 1.0).abs() < 4e-3, "{lobe:?} {theta}: {total}");
                let worst = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-3, "{lobe:?} {theta}: {worst}");
            }
        }
    }
}
