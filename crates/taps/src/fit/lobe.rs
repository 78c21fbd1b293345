//! The lobe of a material at one view, as many small shares of what it reflects.

use std::f64::consts::PI;

use brdf::Material;
use sphere::{DVec3, Direction};

/// Directions of light and what a material reflects from each, in the frame of R: x toward the normal, z along R.
#[derive(Clone, Debug)]
pub(crate) struct Lobe {
    /// Directions on one side of the plane of R and N, and the share of the albedo from each and its mirror image.
    pub(crate) shares: Vec<(DVec3, f64)>,
}

const ANGLES: usize = 64;
const AZIMUTHS: usize = 24;

/// Visits directions over a hemisphere of the plane of view and normal, in the surface's frame and in that of R,
/// with rho_hat times the solid angle, both sides together.
fn visit(material: &Material, theta: f64, width: f64, mut each: impl FnMut(DVec3, [f64; 3])) {
    let (sine, cosine) = math::sin_cos(theta);
    let view = Direction::from_unit(DVec3::new(sine, 0.0, cosine));
    let r = DVec3::new(-sine, 0.0, cosine);
    let toward = DVec3::new(cosine, 0.0, sine);
    let scale = 0.5 * width;
    let end = math::asinh(PI / scale);
    for i in 0..ANGLES {
        let ends = [i, i + 1].map(|i| math::cos(scale * math::sinh(end * i as f64 / ANGLES as f64)));
        let angle = scale * math::sinh(end * (i as f64 + 0.5) / ANGLES as f64);
        let (s, c) = math::sin_cos(angle);
        let solid_angle = 2.0 * PI * (ends[0] - ends[1]) / AZIMUTHS as f64;
        for j in 0..AZIMUTHS {
            let (y, x) = math::sin_cos(PI * (j as f64 + 0.5) / AZIMUTHS as f64);
            let local = DVec3::new(s * x, s * y, c);
            let world = local.x * toward + local.y * DVec3::Y + local.z * r;
            if world.z <= 0.0 {
                continue;
            }
            let rho = material.rho_hat(Direction::from_unit(world), view);
            each(local, rho.map(|rho| rho * solid_angle));
        }
    }
}

/// The albedo toward a view, RGB.
pub(crate) fn albedo(material: &Material, theta: f64, width: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    visit(material, theta, width, |_, rho| (0..3).for_each(|channel| sum[channel] += rho[channel]));
    sum
}

/// The width of the lobe seen head on, in radians: that of a Gaussian with its peak and its albedo.
pub(crate) fn width(material: &Material) -> f64 {
    let guess = material.highlight_width().clamp(0.01, 0.7);
    let whole: f64 = albedo(material, 0.0, guess).iter().sum();
    let peak: f64 = material.rho_hat(Direction::Z, Direction::Z).iter().sum();
    if peak <= 0.0 || whole <= 0.0 {
        return guess;
    }
    (whole / (2.0 * PI * peak)).sqrt().clamp(0.005, 0.7)
}

impl Lobe {
    pub(crate) fn new(material: &Material, theta: f64, width: f64) -> Self {
        let mut shares = Vec::new();
        let mut whole = 0.0;
        visit(material, theta, width, |local, rho| {
            let share = rho.iter().sum::<f64>().max(0.0);
            whole += share;
            shares.push((local, share));
        });
        if whole > 0.0 {
            shares.iter_mut().for_each(|(_, share)| *share /= whole);
        }
        Self { shares }
    }

    pub(crate) fn is_black(&self) -> bool {
        self.shares.iter().all(|(_, share)| *share <= 0.0)
    }
}
