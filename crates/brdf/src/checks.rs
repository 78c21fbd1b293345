//! Checks of a material before it is lit: albedo by angle, energy, reciprocity.
//!
//! The albedo toward a view w_o is the integral of rho_hat(w_i, w_o) over all w_i: the radiance that the view
//! sees under a constant sky of radiance 1. Above 1 the material makes light. The integral is taken over the
//! square that Shirley and Chiu's map ("A Low Distortion Map Between Disk and Square", 1997) maps to the
//! hemisphere with equal areas: the horizon is the edge of the square, and a panel is divided if two Gauss
//! rules differ on it. Panels at or near the mirror direction, the view and the normal are always
//! divided, so that no highlight falls between nodes, until a highlight as high as rho_hat there and as wide
//! as the panel would be negligible, or the panel is 1e-5 of the square. The lower half of the sphere counts
//! too, for the models that reflect light from there.
//!
//! Reciprocity is measured on the BRDF, rho_hat / cos(theta_i), at pairs of directions and at the same pairs
//! exchanged.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use sphere::Direction;

use crate::Material;

/// The result of [`checks`].
#[derive(Clone, Debug, PartialEq)]
pub struct Checks {
    /// The greatest difference of BRDF(L, V) and BRDF(V, L), relative to the greater of them: no more than
    /// rounding for a reciprocal model, near 1 for another.
    pub reciprocity: f64,
    /// The albedo by view. For isotropic materials all views are in one plane.
    pub albedo: Vec<Albedo>,
    /// Whether a turn about the normal changes nothing.
    pub isotropic: bool,
}

/// The albedo toward a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Albedo {
    /// The view's angle from the normal, in degrees.
    pub theta: f64,
    /// The view's angle from the tangent about the normal, in degrees.
    pub phi: f64,
    /// The radiance that the view sees under a constant sky of radiance 1, RGB.
    pub rgb: [f64; 3],
}

impl Albedo {
    /// The greatest channel.
    pub fn greatest(&self) -> f64 {
        self.rgb.into_iter().fold(0.0, f64::max)
    }
}

impl Checks {
    /// Returns the greatest albedo and its view; if several are equal within the accuracy, the one nearest to
    /// the normal.
    pub fn greatest(&self) -> Albedo {
        let none = Albedo { theta: 0.0, phi: 0.0, rgb: [0.0; 3] };
        self.albedo.iter().fold(none, |most, albedo| {
            let more = albedo.greatest() > (1.0 + 0.1 * ACCURACY) * most.greatest();
            if more { *albedo } else { most }
        })
    }

    /// Whether some view sees more light than falls on the surface, by more than the accuracy of the
    /// integrals.
    pub fn makes_light(&self) -> bool {
        self.greatest().greatest() > 1.0 + ACCURACY
    }

    /// Whether the BRDF is reciprocal.
    pub fn is_reciprocal(&self) -> bool {
        self.reciprocity < 1e-6
    }
}

/// The accuracy of an albedo: absolute up to 1, relative above.
pub(crate) const ACCURACY: f64 = 1e-3;

/// Angles of the views from the normal.
const THETA: [f64; 11] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 85.0, 89.0];
/// Azimuths of the views of an anisotropic material.
const PHI: [f64; 4] = [0.0, 45.0, 90.0, 135.0];

/// The albedo by view, reciprocity and isotropy of a material. Albedos are accurate to 1e-3 of themselves or
/// of 1, whichever is greater.
///
/// # Example: chalk reflects its albedo toward every view, and is reciprocal
/// ```
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([0.8, 0.8, 0.4])?);
/// let checks = brdf::checks(&chalk);
/// assert!(checks.albedo.iter().all(|albedo| (albedo.rgb[2] - 0.4).abs() < 1e-4));
/// assert!(checks.is_reciprocal() && checks.isotropic && !checks.makes_light());
/// # Ok::<(), brdf::ParameterError>(())
/// ```
pub fn checks(material: &Material) -> Checks {
    let azimuths = if material.is_isotropic() { &PHI[..1] } else { &PHI };
    let views: Vec<_> =
        THETA.iter().flat_map(|&theta| azimuths.iter().map(move |&phi| (theta, phi))).collect();
    let albedo = views.par_iter().map(|&(theta, phi)| {
        let view = Direction::from_angles(theta.to_radians(), phi.to_radians());
        Albedo { theta, phi, rgb: albedo(material, view) }
    });
    Checks {
        albedo: albedo.collect(),
        reciprocity: reciprocity(material),
        isotropic: material.is_isotropic(),
    }
}

/// The albedo of a material toward a view: the integral of rho_hat over the incident directions, RGB.
///
/// The view is in the frame of the surface, with z >= 0. Accurate to 1e-3 of itself or of 1, whichever is
/// greater.
///
/// # Example: a highlight of weight 1 reflects all light
/// ```
/// let phong = brdf::Material::Phong(brdf::Phong::new(64.0, [1.0; 3])?);
/// let view = sphere::Direction::from_angles(1.2, 0.0);
/// assert!(brdf::albedo(&phong, view).iter().all(|channel| (channel - 1.0).abs() < 1e-3));
/// # Ok::<(), brdf::ParameterError>(())
/// ```
pub fn albedo(material: &Material, view: Direction) -> [f64; 3] {
    let v = view.vector();
    let mirror = DVec3::new(-v.x, -v.y, v.z);
    let peaks = [mirror, v, DVec3::Z].map(|peak| {
        let rho_hat = material.rho_hat(Direction::from_unit(peak), view);
        (to_square(peak), rho_hat.into_iter().fold(0.0, f64::max))
    });
    let mut sum = [0.0; 3];
    for side in [1.0, -1.0] {
        let integral = Integral { material, view, side, peaks };
        let whole = SquarePanel { corner: DVec2::ZERO, size: 1.0 };
        integral.add(whole, &mut sum);
    }
    sum
}

/// A part of the square.
#[derive(Clone, Copy)]
struct SquarePanel {
    corner: DVec2,
    size: f64,
}

/// rho_hat over half of the sphere as a function on the square [0, 1]^2.
struct Integral<'a> {
    material: &'a Material,
    view: Direction,
    /// 1 above the horizon, -1 below.
    side: f64,
    /// The points whose panels are always divided, and the height of the function there.
    peaks: [(DVec2, f64); 3],
}

/// Nodes and weights on [0, 1] of Gauss' rules of four and six nodes.
const FOUR: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
const SIX: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_5, 0.233_956_967_286_345_53),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_53),
    (0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

impl Integral<'_> {
    /// Panels at a peak are divided down to this size.
    const MAX_PEAK_PANEL: f64 = 1.0 / 131_072.0;
    /// Panels at a peak that cannot hold more than this are not divided.
    const NEGLIGIBLE: f64 = 0.1 * ACCURACY;
    /// No panel is smaller than this.
    const MIN_PANEL: f64 = 1.0 / 1_048_576.0;

    fn add(&self, panel: SquarePanel, sum: &mut [f64; 3]) {
        if self.is_at_peak(panel) {
            return self.add_parts(panel, sum);
        }
        let fine = self.rule(panel, &SIX);
        let coarse = self.rule(panel, &FOUR);
        let [error, size] = [0, 1, 2].iter().fold([0.0f64; 2], |[error, size], &channel| {
            [error.max((fine[channel] - coarse[channel]).abs()), size.max(fine[channel].abs())]
        });
        // The kink along the diagonal of the mapping and the steps of a model leave errors in panels along a
        // line: in hundreds at most.
        let good = error <= 1e-4 * size + 1e-6 * (1.0 + sum[0].max(sum[1]).max(sum[2]));
        if good || panel.size <= Self::MIN_PANEL {
            (0..3).for_each(|channel| sum[channel] += fine[channel]);
        } else {
            self.add_parts(panel, sum);
        }
    }

    fn add_parts(&self, panel: SquarePanel, sum: &mut [f64; 3]) {
        let size = 0.5 * panel.size;
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            self.add(SquarePanel { corner: panel.corner + DVec2::new(x, y) * size, size }, sum);
        }
    }

    /// Whether a panel holds a peak or comes near one, and is large enough for it to matter. A highlight
    /// beside a panel may reach over its edge, between the nodes.
    fn is_at_peak(&self, panel: SquarePanel) -> bool {
        let near = DVec2::splat(0.25 * panel.size);
        let (corner, end) = (panel.corner - near, panel.corner + DVec2::splat(panel.size) + near);
        let solid_angle = TAU * panel.size * panel.size;
        panel.size > Self::MAX_PEAK_PANEL
            && self.peaks.iter().any(|(peak, height)| {
                height * solid_angle > Self::NEGLIGIBLE && corner.cmple(*peak).all() && end.cmpge(*peak).all()
            })
    }

    /// The sum over the nodes of a rule of at most six nodes in each direction.
    fn rule(&self, panel: SquarePanel, rule: &[(f64, f64)]) -> [f64; 3] {
        let mut pairs = [[self.view; 2]; SIX.len() * SIX.len()];
        let mut rho_hats = [[0.0; 3]; SIX.len() * SIX.len()];
        let count = rule.len() * rule.len();
        let (pairs, rho_hats) = (&mut pairs[..count], &mut rho_hats[..count]);
        let nodes = || rule.iter().flat_map(|x| rule.iter().map(move |y| (x, y)));
        for (pair, ((x, _), (y, _))) in pairs.iter_mut().zip(nodes()) {
            let w = to_hemisphere(panel.corner + DVec2::new(*x, *y) * panel.size);
            pair[0] = Direction::from_unit(DVec3::new(w.x, w.y, self.side * w.z));
        }
        self.material.rho_hats(pairs, rho_hats);
        let mut sum = [0.0; 3];
        for (rho_hat, ((_, weight_x), (_, weight_y))) in rho_hats.iter().zip(nodes()) {
            let weight = weight_x * weight_y * panel.size * panel.size * TAU;
            (0..3).for_each(|channel| sum[channel] += weight * rho_hat[channel]);
        }
        sum
    }
}

/// The direction of a point of the square; equal areas have equal solid angles.
fn to_hemisphere(point: DVec2) -> DVec3 {
    let [a, b] = [2.0 * point.x - 1.0, 2.0 * point.y - 1.0];
    let (r, phi) = match (a == 0.0 && b == 0.0, a.abs() > b.abs()) {
        (true, _) => (0.0, 0.0),
        (_, true) => (a, FRAC_PI_4 * b / a),
        _ => (b, FRAC_PI_2 - FRAC_PI_4 * a / b),
    };
    // z = 1 - r^2: equal areas of the disk are equal heights of the sphere.
    let across = r * (2.0 - r * r).sqrt();
    DVec3::new(across * math::cos(phi), across * math::sin(phi), 1.0 - r * r)
}

/// The point of the square of a direction above the horizon.
fn to_square(w: DVec3) -> DVec2 {
    let r = (1.0 - w.z).max(0.0).sqrt();
    let (a, b) = if w.x.abs() > w.y.abs() {
        let a = r.copysign(w.x);
        (a, a * math::atan(w.y / w.x) / FRAC_PI_4)
    } else if w.y == 0.0 {
        (0.0, 0.0)
    } else {
        let b = r.copysign(w.y);
        (b * math::atan(w.x / w.y) / FRAC_PI_4, b)
    };
    DVec2::new(0.5 * (a + 1.0), 0.5 * (b + 1.0))
}

/// The greatest relative difference of the BRDF with light and view exchanged, over pairs up to 85 degrees
/// from the normal: some anywhere, some near each other's mirror image, at many distances.
fn reciprocity(material: &Material) -> f64 {
    const PAIRS: usize = 4000;
    // Differences of values this far below the greatest one are invisible.
    const NEGLIGIBLE: f64 = 1e-6;

    let pairs: Vec<[[f64; 3]; 2]> = (0..PAIRS)
        .map(|index| {
            // Multiples of the powers of x, x^-6 = 1 / x + 1, spread evenly over five dimensions (Roberts,
            // 2018).
            let at = |k: i32| (index as f64 * math::powi(0.881_271_461_633_569_6f64, k) + 0.5).fract();
            let above = |u: f64, v: f64| {
                Direction::from_angles(math::acos(1.0 - u * (1.0 - math::cos(85f64.to_radians()))), TAU * v)
            };
            let view = above(at(1), at(2));
            let light = if index % 2 == 0 {
                above(at(3), at(4))
            } else {
                let v = view.vector();
                let away = above(at(3), at(4)).vector() * math::pow(10f64, -4.0 * at(5));
                Direction::normalised(DVec3::new(-v.x, -v.y, v.z) + away)
            };
            let brdf = |incident: Direction, outgoing: Direction| {
                material.rho_hat(incident, outgoing).map(|value| value / incident.vector().z)
            };
            [brdf(light, view), brdf(view, light)]
        })
        .collect();
    let most = pairs.iter().flatten().flatten().fold(0.0, |most: f64, value| most.max(*value));
    let difference = |one: f64, other: f64| {
        let size = one.max(other);
        if size > NEGLIGIBLE * most { (one - other).abs() / size } else { 0.0 }
    };
    let differences = pairs
        .iter()
        .flat_map(|[one, other]| [0, 1, 2].map(|channel| difference(one[channel], other[channel])));
    differences.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{KajiyaKay, Lambert, Microfacet, Phong};

    #[test]
    fn the_square_and_the_hemisphere_round_trip() {
        for i in 0..20 {
            for j in 0..20 {
                let point = DVec2::new((f64::from(i) + 0.3) / 20.0, (f64::from(j) + 0.6) / 20.0);
                let w = to_hemisphere(point);
                assert!((w.length() - 1.0).abs() < 1e-14 && w.z >= 0.0);
                assert!((to_square(w) - point).length() < 1e-12, "{point} {w}");
            }
        }
        assert_eq!(to_square(DVec3::Z), DVec2::splat(0.5));
        assert_eq!(to_hemisphere(DVec2::splat(0.5)), DVec3::Z);
    }

    /// Phong's lobe is normalised over the whole sphere, from every view and at every sharpness.
    #[test]
    fn a_highlight_of_weight_1_has_albedo_1() {
        for exponent in [0.0, 1.5, 32.0, 1e4, 1e8] {
            let checks = checks(&Material::Phong(Phong::new(exponent, [1.0, 0.5, 0.0]).unwrap()));
            for albedo in &checks.albedo {
                let [red, green, blue] = albedo.rgb;
                assert!(
                    (red - 1.0).abs() < 2e-4 && (green - 0.5).abs() < 1e-4 && blue == 0.0,
                    "{exponent} {albedo:?}"
                );
            }
            assert!(!checks.makes_light());
        }
    }

    /// Toward some of these views the mirror direction is just outside of a large panel.
    #[test]
    fn a_highlight_at_the_edge_of_a_panel_counts_in_full() {
        let phong = Material::Phong(Phong::new(1e7, [1.0; 3]).unwrap());
        for step in 0..720 {
            let theta = f64::from(step) / 8.0;
            let found = albedo(&phong, Direction::from_angles(theta.to_radians(), 0.0));
            assert!((found[0] - 1.0).abs() < ACCURACY, "{theta}: {found:?}");
        }
    }

    /// Head on theta_h = theta_i / 2; with h = theta_h and dw_i = 4 cos(h) dw_h the albedo is 8 pi times the
    /// integral of cos(h) sin(h) e^(-(h / sigma)^2) / (4 pi sigma^2) over [0, pi/4]: here by the midpoint
    /// rule, which is accurate to 1e-8.
    #[test]
    fn equation_11_head_on() {
        for sigma in [0.001, 0.1, 0.4] {
            let found = checks(&Material::Microfacet(Microfacet::new(sigma, [1.0; 3]).unwrap()));
            let steps = 400_000;
            let sum: f64 = (0..steps)
                .map(|step| {
                    let h = (f64::from(step) + 0.5) / f64::from(steps) * FRAC_PI_4;
                    h.sin() * h.cos() * (-(h / sigma).powi(2)).exp()
                })
                .sum();
            let expected = 2.0 * sum * FRAC_PI_4 / f64::from(steps) / (sigma * sigma);
            let head_on = found.albedo[0].rgb[0];
            assert!((head_on - expected).abs() < 1e-4, "{sigma}: {head_on} {expected}");
        }
    }

    /// Across the fibre cos(theta_i - pi/2) = sin(theta_i), and the integral of sin^s over the sphere is
    /// known for s = 2: 8 pi / 3.
    #[test]
    fn a_fibre_makes_light_and_is_anisotropic() {
        let found = checks(&Material::KajiyaKay(KajiyaKay::new(2.0, [1.0; 3]).unwrap()));
        assert!((found.albedo[0].rgb[0] - 8.0 * PI / 3.0).abs() < 1e-3);
        assert_eq!((found.albedo.len(), found.isotropic, found.makes_light()), (44, false, true));
    }

    #[test]
    fn an_albedo_above_1_makes_light() {
        let lambert = |albedo: f64| checks(&Material::Lambert(Lambert::new([0.2, albedo, 0.2]).unwrap()));
        assert!(!lambert(1.0).makes_light());
        let bright = lambert(1.5);
        assert!(bright.makes_light() && (bright.greatest().greatest() - 1.5).abs() < 1e-4);
        assert!(bright.greatest().rgb[0] < 0.2001);
    }

    #[test]
    fn the_greatest_difference_from_reciprocity_is_found() {
        let difference = |material: Material| checks(&material).reciprocity;
        assert!(difference(Material::Lambert(Lambert::new([0.5; 3]).unwrap())) < 1e-13);
        assert_eq!(difference(Material::Lambert(Lambert::new([0.0; 3]).unwrap())), 0.0);
        let phong = difference(Material::Phong(Phong::new(8.0, [0.5; 3]).unwrap()));
        assert!((0.5..=1.0).contains(&phong), "{phong}");
    }
}
