//! Charlie: the sheen of upright fibres, for cloth.
//!
//! BRDF = D(h) / ((1 + Lambda(N.L) + Lambda(N.V)) 4 N.L N.V) with alpha = roughness^2 and
//!
//! - D = (2 + 1 / alpha) sin(theta_h)^(1 / alpha) / (2 pi),
//! - Lambda(x) = e^l(x) for x < 1/2, e^(2 l(1/2) - l(1 - x)) otherwise: the authors' fit of the masking, l(x)
//!   = a / (1 + b x^c) + d x + e, its constants between those of two widths by (1 - alpha)^2
//!
//! (Conty Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017; KHR_materials_sheen). The fit
//! is too low for narrow lobes: below a roughness of 0.25 a grazing view sees up to four times the light that
//! falls on the surface. A model that uses this lobe divides it by the excess.
//!
//! Cosines below 1e-4 count as 1e-4, so that the value is finite.

use std::f64::consts::PI;

use super::directional_albedo::gauss;
use crate::packed::packed;

/// The least cosine.
const MIN_COSINE: f64 = 1e-4;

/// The sheen of fibres of one roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Charlie {
    /// 1 / (2 alpha), the power of sin^2(theta_h).
    power: f64,
    /// The coefficients a, b, c, d and e of the fitted l.
    fit: [f64; 5],
    /// Twice the fitted l at 1/2.
    twice_middle: f64,
}

packed! {
    /// The constants of the sheen of fibres.
    pub struct CharlieConstants as charlie {
        /// The power of sin^2(theta_h).
        power: f32,
        /// A coefficient of the masking l(x) = a / (1 + b x^c) + d x + e.
        a: f32,
        /// A coefficient of the masking.
        b: f32,
        /// A power of the masking.
        c: f32,
        /// A coefficient of the masking.
        d: f32,
        /// A coefficient of the masking.
        e: f32,
        /// 2 l(1/2).
        twice_middle: f32,
    }
}

impl Charlie {
    pub(crate) fn new(roughness: f64) -> Self {
        const ROUGH: [f64; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
        const SMOOTH: [f64; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
        let alpha = roughness * roughness;
        let share = (1.0 - alpha) * (1.0 - alpha);
        let fit = std::array::from_fn(|k| ROUGH[k] + (SMOOTH[k] - ROUGH[k]) * share);
        let charlie = Self { power: 0.5 / alpha, fit, twice_middle: 0.0 };
        Self { twice_middle: 2.0 * charlie.l(0.5), ..charlie }
    }

    /// The factor of sin^2(theta_h)^power / ((1 + Lambda + Lambda) N.L N.V).
    pub(crate) fn scale(&self) -> f64 {
        (1.0 + self.power) / (4.0 * PI)
    }

    /// The constants of the formula, without its scale.
    pub(crate) fn constants(&self) -> CharlieConstants {
        let [a, b, c, d, e] = self.fit.map(|value| value as f32);
        CharlieConstants { power: self.power as f32, a, b, c, d, e, twice_middle: self.twice_middle as f32 }
    }

    /// The BRDF, in 1/sr, from sin^2(theta_h), N.L and N.V.
    pub(crate) fn brdf(&self, sin2: f64, light: f64, view: f64) -> f64 {
        self.masked(sin2, [light, self.lambda(light)], [view, self.lambda(view)])
    }

    /// The BRDF, in 1/sr, from sin^2(theta_h) and the cosines of light and view with their Lambda.
    fn masked(&self, sin2: f64, [light, lambda_light]: [f64; 2], [view, lambda_view]: [f64; 2]) -> f64 {
        let masked = (1.0 + lambda_light + lambda_view) * light.max(MIN_COSINE) * view.max(MIN_COSINE);
        self.scale() * math::pow(sin2, self.power) / masked
    }

    fn l(&self, x: f64) -> f64 {
        let [a, b, c, d, e] = self.fit;
        a / (1.0 + b * math::pow(x, c)) + d * x + e
    }

    fn lambda(&self, cosine: f64) -> f64 {
        let cosine = cosine.max(MIN_COSINE);
        if cosine < 0.5 {
            math::exp(self.l(cosine))
        } else {
            math::exp(self.twice_middle - self.l((1.0 - cosine).max(0.0)))
        }
    }
}

/// The quadrature of one sheen: by the light's height, denser toward the horizon, and its azimuth.
pub(crate) struct CharlieQuadrature {
    charlie: Charlie,
    /// Cosine, sine, Lambda and weight of the heights.
    heights: Vec<[f64; 4]>,
    /// Cosine and weight of the azimuths.
    turns: Vec<(f64, f64)>,
}

impl CharlieQuadrature {
    pub(crate) fn new(charlie: Charlie) -> Self {
        Self::with_nodes(charlie, 24)
    }

    /// The quadrature with this many heights and half as many azimuths.
    fn with_nodes(charlie: Charlie, heights: usize) -> Self {
        let turns = gauss(heights / 2).into_iter().map(|(share, weight)| (math::cos(PI * share), weight));
        // The cosine is the square of the node: d cosine = 2 node d node.
        let heights = gauss(heights).into_iter().map(|(node, weight)| {
            let cosine = node * node;
            let weight = 2.0 * PI * 2.0 * node * weight;
            [cosine, (1.0 - cosine * cosine).sqrt(), charlie.lambda(cosine), weight]
        });
        Self { charlie, heights: heights.collect(), turns: turns.collect() }
    }

    /// The albedo toward a view at this cosine, each light weighted by a function of its cosine. Accurate to
    /// 1e-3, and for a roughness from 0.1 on to 2e-4.
    pub(crate) fn albedo(&self, view: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let sine = (1.0 - view * view).max(0.0).sqrt();
        let seen = [view, self.charlie.lambda(view)];
        let mut sum = 0.0;
        for &[light, across, lambda, portion] in &self.heights {
            let portion = portion * light * weight(light);
            for (turn, part) in &self.turns {
                // |L + V|^2 along the surface and in all.
                let flat = sine * sine + across * across + 2.0 * sine * across * turn;
                let whole = flat + (light + view) * (light + view);
                let sin2 = (flat / whole).max(0.0);
                sum += portion * part * self.charlie.masked(sin2, [light, lambda], seen);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values are converged: three times as many nodes give the same albedo.
    #[test]
    fn few_nodes_are_enough_for_sheen() {
        for (roughness, allowed) in [(0.05, 1e-3), (0.1, 2e-4), (0.3, 2e-4), (0.6, 2e-4), (1.0, 2e-4)] {
            let charlie = Charlie::new(roughness);
            let [few, many] = [CharlieQuadrature::new(charlie), CharlieQuadrature::with_nodes(charlie, 64)];
            for view in [0.0, 0.003, 0.02, 0.1, 0.3, 0.6, 1.0] {
                let [found, expected] = [&few, &many].map(|rule| rule.albedo(view, |_| 1.0));
                assert!((found - expected).abs() < allowed, "{roughness} {view}: {found} {expected}");
            }
        }
    }

    /// The published tables use Neubelt's masking, 1 / (4 (N.L + N.V - N.L N.V)), in place of Lambda.
    #[test]
    fn the_distribution_is_that_of_the_reference_tables() {
        const TEST: &str = "the_distribution_is_that_of_the_reference_tables";
        let Some(reference) = test_data::reference(TEST, "engines/dfg.json") else { return };
        let rows = reference["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 36);
        let mut worst: f64 = 0.0;
        for row in rows {
            let [view, roughness, expected] =
                ["NoV", "roughness", "charlie"].map(|key| row[key].as_f64().unwrap());
            let charlie = Charlie::new(roughness);
            let mut rule = CharlieQuadrature::with_nodes(charlie, 128);
            // 1 / (4 (l + v - l v)) is 1 / (4 l v (1 + x)) with x = (1 - l) / l + (1 - v) / v.
            rule.heights.iter_mut().for_each(|height| height[2] = (1.0 - height[0]) / height[0]);
            let sine = (1.0 - view * view).sqrt();
            let mut found = 0.0;
            for &[light, across, lambda, portion] in &rule.heights {
                for (turn, part) in &rule.turns {
                    let flat = sine * sine + across * across + 2.0 * sine * across * turn;
                    let sin2 = flat / (flat + (light + view) * (light + view));
                    let brdf = charlie.masked(sin2, [light, lambda], [view, (1.0 - view) / view]);
                    found += portion * part * light * brdf;
                }
            }
            worst = worst.max((found - expected).abs());
        }
        eprintln!("Charlie's albedo differs by {worst:.1e}");
        // The least cosine here is 1e-4; below it less than 1e-6 of the light is reflected.
        assert!(worst < 2e-5, "{worst:e}");
    }
}
