//! The directional albedo of a microfacet lobe as a factor of F0 and a rest: what engines look up in a table
//! beside a prefiltered environment.
//!
//! With a = roughness^2, the half vector h and Schlick's Fresnel term F = F0 + (1 - F0) (1 - v.h)^5,
//!
//! > E = integral of D(h) V(v, l) F (n.l) dl = F0 A + B
//!
//! D is GGX (Walter et al. 2007), and V one of [`Visibility`]. Karis 2013, "Real Shading in Unreal Engine 4",
//! calls the pair the environment BRDF; glTF calls it DFG. Sheen has D of Estevez and Kulla 2017 ("Charlie")
//! and V of Neubelt and Pettineo 2013, and no Fresnel term.
//!
//! Both are integrals over half vectors, dl = 4 (v.h) dh. In their polar angle theta and azimuth phi about n,
//! n.l = c cos(2 theta - delta) with tan(delta) = tan(theta_v) cos(phi): the light is above the horizon up to
//! theta = (delta + pi / 2) / 2, and up to there the integrand is smooth. Gauss-Legendre rules over panels
//! that are graded toward the lobe, and toward phi = pi / 2 for a grazing view, do the rest.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

/// Raised when results change.
pub const REVISION: u32 = 1;

/// The masking and shadowing of GGX, over 4 (n.l) (n.v).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Visibility {
    /// Smith's masking of heights that are correlated (Heitz 2014): Filament, glTF, Bevy, Unity HDRP.
    Correlated,
    /// Smith's masking of light and view apart, G1(v) G1(l).
    Uncorrelated,
    /// Schlick's approximation with k = a / 2 (Karis 2013).
    Karis,
}

impl Visibility {
    /// V of these cosines of light and view, above the horizon.
    fn of(self, alpha: f64, light: f64, view: f64) -> f64 {
        let root = |cosine: f64| (alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine).sqrt();
        match self {
            Self::Correlated => 0.5 / (light * root(view) + view * root(light)),
            Self::Uncorrelated => 1.0 / ((light + root(light)) * (view + root(view))),
            Self::Karis => {
                let k = 0.5 * alpha;
                0.25 / ((light * (1.0 - k) + k) * (view * (1.0 - k) + k))
            }
        }
    }
}

/// The directional albedo F0 A + B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleBias {
    /// The factor A of F0.
    pub scale: f64,
    /// The summand B.
    pub bias: f64,
}

/// The directional albedo of GGX, for a roughness and the cosine between the view and the normal, both above
/// 0 and at most 1.
///
/// Accurate to 1e-6 (compared with values made without this code, and with four times the nodes).
///
/// # Example: a smooth surface reflects what Fresnel's term says
/// ```
/// use brdf::{Visibility, environment_brdf};
/// let found = environment_brdf(Visibility::Correlated, 0.01, 0.5);
/// assert!((found.bias - 0.5_f64.powi(5)).abs() < 1e-3 && (found.scale + found.bias - 1.0).abs() < 1e-3);
/// ```
pub fn environment_brdf(visibility: Visibility, roughness: f64, view: f64) -> ScaleBias {
    RULE.environment_brdf(visibility, roughness, view)
}

/// The directional albedo of sheen, for a roughness and the cosine between the view and the normal, both
/// above 0 and at most 1. It may pass 1, for the lobe is not normalised by its visibility.
///
/// # Example: sheen is bright at grazing angles
/// ```
/// use brdf::sheen_albedo;
/// assert!(sheen_albedo(0.3, 0.1) > 10.0 * sheen_albedo(0.3, 0.9));
/// ```
pub fn sheen_albedo(roughness: f64, view: f64) -> f64 {
    RULE.sheen_albedo(roughness, view)
}

/// Where an integrand is sharp.
#[derive(Clone, Copy)]
enum Sharpness {
    /// The integrand is sharp about theta = 0, as wide as alpha.
    Ggx { alpha: f64 },
    /// The integrand is sharp at the largest theta, as sin^power.
    Charlie { power: f64 },
}

/// A half vector of the rule.
struct RuleHalfVector {
    /// The sine of the half vector's theta.
    sine: f64,
    cosine: f64,
    /// The cosine n.l.
    light: f64,
    /// The cosine v.h.
    view: f64,
    /// The weight d theta d phi, both signs of phi included.
    weight: f64,
}

/// Gauss-Legendre rules over [0, 1], as pairs of place and weight.
struct Rule {
    /// The rule of phi, on each side of pi / 2.
    azimuth: Vec<(f64, f64)>,
    /// The rule of theta.
    polar: Vec<(f64, f64)>,
}

static RULE: LazyLock<Rule> = LazyLock::new(|| Rule::new(32, 40));

impl Rule {
    fn new(azimuths: usize, polar: usize) -> Self {
        let unit = |nodes: usize| {
            let (thetas, weights) = sh::quadrature::gauss_legendre(nodes);
            let node = |(theta, weight): (f64, f64)| (0.5 + 0.5 * math::cos(theta), 0.5 * weight);
            thetas.into_iter().zip(weights).map(node).collect()
        };
        Self { azimuth: unit(azimuths), polar: unit(polar) }
    }

    fn environment_brdf(&self, visibility: Visibility, roughness: f64, view: f64) -> ScaleBias {
        let alpha = roughness * roughness;
        let (mut whole, mut bias) = (0.0, 0.0);
        self.over_half_vectors(view, Sharpness::Ggx { alpha }, |half| {
            let RuleHalfVector { sine, cosine, .. } = half;
            // GGX' cos^2 (a^2 - 1) + 1, without cancellation.
            let spread = alpha * alpha * cosine * cosine + sine * sine;
            let d = alpha * alpha / (PI * spread * spread);
            let v = visibility.of(alpha, half.light, view);
            let value = d * v * half.light * 4.0 * half.view * sine * half.weight;
            whole += value;
            bias += value * math::powi((1.0 - half.view).max(0.0), 5);
        });
        ScaleBias { scale: whole - bias, bias }
    }

    fn sheen_albedo(&self, roughness: f64, view: f64) -> f64 {
        let power = 1.0 / (roughness * roughness);
        let mut sum = 0.0;
        self.over_half_vectors(view, Sharpness::Charlie { power }, |half| {
            let RuleHalfVector { sine, .. } = half;
            let d = (2.0 + power) * math::pow(sine, power) / (2.0 * PI);
            let v = 0.25 / (half.light + view - half.light * view);
            sum += d * v * half.light * 4.0 * half.view * sine * half.weight;
        });
        sum
    }

    /// Visits every half vector whose light is above the horizon.
    fn over_half_vectors(&self, view: f64, sharpness: Sharpness, mut visit: impl FnMut(RuleHalfVector)) {
        let sine_view = (1.0 - view * view).max(0.0).sqrt();
        for side in [-1.0, 1.0] {
            for (from_side, weight_phi) in graded(&self.azimuth, view, FRAC_PI_2) {
                // The cosine of phi, by its distance from pi / 2.
                let along = side * sine_view * math::sin(from_side);
                let delta = math::atan2(along, view);
                let (most, length) = (0.5 * (delta + FRAC_PI_2), math::hypot(view, along));
                let mut point = |theta: f64, weight: f64| {
                    let light = length * math::cos(2.0 * theta - delta);
                    let (sine, cosine) = math::sin_cos(theta);
                    let half_view = along * sine + view * cosine;
                    if light > 0.0 && half_view > 0.0 {
                        visit(RuleHalfVector {
                            sine,
                            cosine,
                            light,
                            view: half_view,
                            weight: 2.0 * weight * weight_phi,
                        });
                    }
                };
                match sharpness {
                    Sharpness::Ggx { alpha } => {
                        // At the light's horizon V n.l rises within n.v or alpha, whichever is smaller.
                        let rise = (view.min(alpha) / (2.0 * length)).min(most);
                        let middle = 0.5 * most;
                        graded(&self.polar, alpha, middle).for_each(|(at, w)| point(at, w));
                        graded(&self.polar, rise, middle).for_each(|(below, w)| point(most - below, w));
                    }
                    Sharpness::Charlie { power } => {
                        // Below the largest theta sin^p falls as e^(-p cot(theta) x) and, near pi / 2, as
                        // e^(-p x^2 / 2), and V n.l rises within n.v.
                        let width = 1.0 / (power.sqrt() + power / math::tan(most) + 2.0 * length / view);
                        graded(&self.polar, width, most).for_each(|(below, w)| point(most - below, w));
                    }
                }
            }
        }
    }
}

/// Points over (0, to) that crowd within about `width` of 0: width sinh(s), with a rule for s.
fn graded(rule: &[(f64, f64)], width: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
    let end = math::asinh(to / width);
    rule.iter().map(move |(share, weight)| {
        let s = share * end;
        (width * math::sinh(s), weight * end * width * math::cosh(s))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over stratified directions of the light.
    fn by_directions(visibility: Visibility, roughness: f64, view: f64) -> ScaleBias {
        let (steps, alpha) = (1500, roughness * roughness);
        let sine_view = (1.0 - view * view).sqrt();
        let (mut whole, mut bias) = (0.0, 0.0);
        for i in 0..steps {
            let light = (f64::from(i) + 0.5) / f64::from(steps);
            let sine = (1.0 - light * light).sqrt();
            for j in 0..steps {
                let phi = PI * (f64::from(j) + 0.5) / f64::from(steps);
                let along = sine_view * sine * phi.cos() + view * light;
                // |v + l| and the cosines of the half vector.
                let length = (2.0 + 2.0 * along).sqrt();
                let (half, half_view) = ((light + view) / length, (1.0 + along) / length);
                let spread = half * half * (alpha * alpha - 1.0) + 1.0;
                let d = alpha * alpha / (PI * spread * spread);
                let value =
                    d * visibility.of(alpha, light, view) * light * 2.0 * PI / f64::from(steps * steps);
                whole += value;
                bias += value * (1.0 - half_view).powi(5);
            }
        }
        ScaleBias { scale: whole - bias, bias }
    }

    #[test]
    fn the_integral_over_directions_of_the_light_is_the_same() {
        for visibility in [Visibility::Correlated, Visibility::Uncorrelated, Visibility::Karis] {
            for (roughness, view) in [(0.4, 0.1), (0.7, 0.5), (1.0, 0.9)] {
                let (found, expected) = (
                    environment_brdf(visibility, roughness, view),
                    by_directions(visibility, roughness, view),
                );
                let error = (found.scale - expected.scale).abs().max((found.bias - expected.bias).abs());
                assert!(error < 3e-5, "{visibility:?} {roughness} {view}: {found:?} {expected:?}");
            }
        }
    }

    /// At the corners of a table of 256 x 256, too.
    #[test]
    fn four_times_the_nodes_agree() {
        let fine = Rule::new(128, 128);
        for roughness in [0.5 / 256.0, 0.03, 0.2, 0.6, 1.0] {
            for view in [0.5 / 256.0, 0.02, 0.1, 0.5, 1.0] {
                for visibility in [Visibility::Correlated, Visibility::Uncorrelated, Visibility::Karis] {
                    let found = environment_brdf(visibility, roughness, view);
                    let expected = fine.environment_brdf(visibility, roughness, view);
                    let error = (found.scale - expected.scale).abs().max((found.bias - expected.bias).abs());
                    assert!(error < 1e-6, "{visibility:?} {roughness} {view}: {found:?} {expected:?}");
                }
                let (found, expected) = (sheen_albedo(roughness, view), fine.sheen_albedo(roughness, view));
                let error = (found - expected).abs() / expected.max(1.0);
                assert!(error < 1e-6, "sheen {roughness} {view}: {found} {expected}");
            }
        }
    }

    /// Masking loses light, and never makes any.
    #[test]
    fn albedos_stay_within_1() {
        for visibility in [Visibility::Correlated, Visibility::Uncorrelated, Visibility::Karis] {
            for i in 0..24 {
                for j in 0..24 {
                    let (roughness, view) = ((f64::from(i) + 0.5) / 24.0, (f64::from(j) + 0.5) / 24.0);
                    let ScaleBias { scale, bias } = environment_brdf(visibility, roughness, view);
                    assert!(scale > 0.0 && bias > 0.0 && scale + bias < 1.0 + 1e-6, "{roughness} {view}");
                }
            }
        }
    }
}
