//! What a material that depends on its tangent reflects toward one view, in many small shares.

use std::f64::consts::TAU;

use brdf::Material;
use sphere::{DVec3, Direction};

use crate::facets::mirrored;
use crate::fit::lobe::albedo;

/// The slopes and the azimuths of the half vectors that light is taken from.
const SLOPES: usize = 48;
const AZIMUTHS: usize = 48;

/// The steepest slope of a half vector.
const STEEPEST: f64 = 40.0;

/// The least half width that is looked for, in slopes.
const LEAST_HALF_WIDTH: f64 = 0.004;

/// The places of slopes: a grid of ellipses that are as long as a lobe near the centre, and circles far from
/// it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipses {
    /// The slopes, along the tangent and across it, within which ellipses are dense.
    scale: [f64; 2],
    end: [f64; 2],
}

impl Ellipses {
    /// Ellipses out to the steepest slope.
    pub(super) fn new(scale: [f64; 2], steepest: f64) -> Self {
        Self { scale, end: scale.map(|scale| math::asinh(steepest / scale)) }
    }

    /// The slope at a part from the centre (0) to the steepest (1) and an azimuth, and the area there of a
    /// unit of both.
    pub(super) fn at(&self, part: f64, azimuth: f64) -> ([f64; 2], f64) {
        let (s, c) = math::sin_cos(azimuth);
        let radii = [0, 1].map(|axis| self.scale[axis] * math::sinh(self.end[axis] * part));
        let rates = [0, 1].map(|axis| {
            self.end[axis] * (self.scale[axis] * self.scale[axis] + radii[axis] * radii[axis]).sqrt()
        });
        ([radii[0] * c, radii[1] * s], rates[0] * radii[1] * c * c + radii[0] * rates[1] * s * s)
    }
}

/// What a material reflects toward a view in the frame of the surface: directions of light there, and rho_hat
/// times their solid angle, RGB. Directions are dense within `scale` of the mirror image, in slopes of the
/// half vector.
pub(super) fn shares(material: &Material, view: DVec3, scale: [f64; 2]) -> Vec<(DVec3, [f64; 3])> {
    let outgoing = Direction::normalised(view);
    let ellipses = Ellipses::new(scale.map(|scale| 0.5 * scale), STEEPEST);
    let mut shares = Vec::new();
    for i in 0..SLOPES {
        let part = (i as f64 + 0.5) / SLOPES as f64;
        for j in 0..AZIMUTHS {
            let (slope, area) = ellipses.at(part, TAU * (j as f64 + 0.5) / AZIMUTHS as f64);
            let squared = 1.0 + slope[0] * slope[0] + slope[1] * slope[1];
            let facing = view.dot(DVec3::new(slope[0], slope[1], 1.0)) / squared.sqrt();
            let light = mirrored(view, slope);
            if facing <= 0.0 || light.z <= 0.0 {
                continue;
            }
            // dL = 4 (V.h) dh, and dh = dp dq / (1 + p^2 + q^2)^(3/2).
            let cell = area * TAU / (SLOPES * AZIMUTHS) as f64;
            let solid_angle = 4.0 * facing * cell / (squared * squared.sqrt());
            let rho = material.rho_hat(Direction::normalised(light), outgoing);
            if rho != [0.0; 3] {
                shares.push((light, rho.map(|rho| rho.max(0.0) * solid_angle)));
            }
        }
    }
    shares
}

/// The widths of a material's lobe seen head on, in slopes along the tangent and across it: those of a
/// Gaussian with its peak, its albedo and its ratio of half widths.
pub(super) fn widths(material: &Material) -> [f64; 2] {
    let at = |slope: [f64; 2]| -> f64 {
        material.rho_hat(Direction::normalised(mirrored(DVec3::Z, slope)), Direction::Z).iter().sum()
    };
    let peak = at([0.0; 2]);
    let half = [[1.0, 0.0], [0.0, 1.0]].map(|[x, y]| {
        let is_bright = |slope: &f64| {
            *slope < 0.7 && at([slope * x, slope * y]).max(at([-slope * x, -slope * y])) > 0.5 * peak
        };
        let slopes = std::iter::successors(Some(LEAST_HALF_WIDTH), |slope| Some(1.06 * slope));
        // A Gaussian has fallen to half at 1.18 standard deviations.
        slopes.take_while(is_bright).last().unwrap_or(LEAST_HALF_WIDTH) / 1.18
    });
    let whole: f64 = albedo(&shares(material, DVec3::Z, half)).iter().sum();
    // A slope turns the reflection by twice its own angle.
    let area = whole / (TAU * 4.0 * peak.max(1e-30));
    let scale = (area / (half[0] * half[1])).sqrt().clamp(0.8, 1.6);
    half.map(|half| (scale * half).clamp(0.0025, 0.5))
}
