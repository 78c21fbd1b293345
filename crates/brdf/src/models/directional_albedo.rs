//! Directional albedos, for models that also reflect the light which their highlight loses.
//!
//! The albedo of a lobe toward a view is the integral of its rho_hat over the light's directions. [`Facets`]
//! integrates that of GGX's facets when a model is made, with few nodes, because it takes the slopes t =
//! tan(theta_h) of the half vector as variables, in which the lobe is smooth:
//!
//! - D cos(theta_h) dw_h = sin(2 psi) d psi d phi / (2 pi) if t = alpha tan(psi), so the albedo is the
//!   integral of sin(2 psi) / (2 pi) G_2 (V.h) / (N.V N.h) F, here by q = tan(psi / 2),
//! - the light is above the horizon exactly if t is below s + sqrt(s^2 + 1), s = tan(theta_o) cos(phi), so
//!   that no node is lost and no step is integrated.
//!
//! An albedo is a function of N.V alone. [`Tables`] holds several such functions at the same nodes.

use std::f64::consts::PI;

use glam::Vec4;

use crate::packed;

/// The number of functions of the cosine that a table holds.
pub(crate) const COLUMNS: usize = 4;

/// The number of nodes. With these, the error between nodes is below 5e-4 for cosines above 0.012.
const NODES: usize = 96;

/// [`COLUMNS`] functions of a cosine, linear in sqrt(cosine) between nodes.
///
/// Albedos change fastest toward grazing, where the nodes are densest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tables(Vec<[f64; COLUMNS]>);

impl Tables {
    /// The values of functions at the nodes.
    pub(crate) fn new(functions: impl FnMut(f64) -> [f64; COLUMNS]) -> Self {
        Self((0..NODES).map(|node| math::powi(node as f64 / (NODES - 1) as f64, 2)).map(functions).collect())
    }

    /// The values of all functions at the nodes, for renderers.
    pub(crate) fn constants(&self) -> Vec<Vec4> {
        self.0.iter().map(|values| packed::four(*values)).collect()
    }

    /// The values of all functions at the nodes.
    pub(crate) fn nodes(&self) -> impl Iterator<Item = [f64; COLUMNS]> {
        self.0.iter().copied()
    }

    /// The zonal coefficients of degree 0, 1 and 2 of a function times the cosine on the hemisphere, divided
    /// by that of degree 0; 0 for a function that is 0.
    pub(crate) fn zonal(&self, column: usize) -> [f64; 3] {
        let mut sums = [0.0; 3];
        let step = 1.0 / (self.0.len() - 1) as f64;
        for (node, ends) in self.0.windows(2).enumerate() {
            for (share, weight) in FIVE {
                // d(x^2) = 2 x dx.
                let root = (node as f64 + share) * step;
                let cosine = root * root;
                let value = ends[0][column] + (ends[1][column] - ends[0][column]) * share;
                let scaled = weight * step * 2.0 * root * cosine * value;
                let legendre = [1.0, cosine, 1.5 * cosine * cosine - 0.5];
                sums.iter_mut().zip(legendre).for_each(|(sum, p)| *sum += scaled * p);
            }
        }
        if sums[0] > 0.0 { sums.map(|sum| sum / sums[0]) } else { [0.0; 3] }
    }

    /// The values of all functions at a cosine, 0 to 1.
    pub(crate) fn at(&self, cosine: f64) -> [f64; COLUMNS] {
        let ([low, high], share) = self.between(cosine.clamp(0.0, 1.0).sqrt() * self.last() as f64);
        std::array::from_fn(|column| low[column] + (high[column] - low[column]) * share)
    }

    /// The last node, which stands for a cosine of 1: node k stands for the square of k / last.
    #[inline(always)]
    pub(crate) fn last(&self) -> usize {
        self.0.len() - 1
    }

    /// The values at the nodes on both sides of a place among them, and the share of the way to the second.
    #[inline(always)]
    pub(crate) fn between(&self, place: f64) -> ([&[f64; COLUMNS]; 2], f64) {
        let node = (place as usize).min(self.last() - 1);
        ([&self.0[node], &self.0[node + 1]], place - node as f64)
    }

    /// Twice the integral of each function times the cosine, over cosines from 0 to 1: its mean over the
    /// hemisphere, weighted by projected area.
    pub(crate) fn means(&self) -> [f64; COLUMNS] {
        let mut means = [0.0; COLUMNS];
        let step = 1.0 / (self.0.len() - 1) as f64;
        for (node, ends) in self.0.windows(2).enumerate() {
            // A line in x = sqrt(cosine) times 4 x^3: exact.
            for (share, weight) in THREE {
                let x = (node as f64 + share) * step;
                let scale = weight * step * 4.0 * x * x * x;
                for (column, mean) in means.iter_mut().enumerate() {
                    *mean += scale * (ends[0][column] + (ends[1][column] - ends[0][column]) * share);
                }
            }
        }
        means
    }
}

/// Nodes and weights on [0, 1] of Gauss' rule of three nodes, which is exact to degree 5.
const THREE: [(f64, f64); 3] =
    [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Nodes and weights on [0, 1] of Gauss' rule of five nodes, which is exact to degree 9.
const FIVE: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 64.0 / 225.0),
    (0.769_234_655_052_841_6, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

/// Nodes and weights on [0, 1] of Gauss' rule.
pub(crate) fn gauss(nodes: usize) -> Vec<(f64, f64)> {
    let (theta, weights) = sh::quadrature::gauss_legendre(nodes);
    theta.iter().zip(weights).map(|(theta, weight)| (0.5 * (1.0 - math::cos(*theta)), 0.5 * weight)).collect()
}

/// The albedo of GGX's facets toward a view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FacetAlbedo {
    /// The part that grows with F_0: facets with Schlick's F = F_0 + (F_90 - F_0) (1 - L.h)^5 reflect
    /// F_0 `scale` + F_90 `bias`, each light weighted by the caller's function.
    pub(crate) scale: f64,
    /// The part that grows with F_90.
    pub(crate) bias: f64,
    /// The albedo of facets that reflect everything, without the caller's weight.
    pub(crate) whole: f64,
}

/// The quadrature of GGX's facets of one width.
pub(crate) struct Facets {
    alpha: f64,
    /// The cosines of half of the azimuths, and their weights.
    turns: Vec<(f64, f64)>,
    slopes: Vec<(f64, f64)>,
}

impl Facets {
    pub(crate) fn new(alpha: f64) -> Self {
        Self::with_nodes(alpha, 12)
    }

    /// The quadrature with `nodes` azimuths in each quarter of the circle and twice as many slopes.
    fn with_nodes(alpha: f64, nodes: usize) -> Self {
        let quarter = |from: f64| {
            gauss(nodes)
                .into_iter()
                .map(move |(share, weight)| (math::cos(0.5 * PI * (from + share)), 0.5 * weight))
        };
        // For grazing views the integrand is steep where the facets turn away, at a right angle.
        Self { alpha, turns: quarter(0.0).chain(quarter(1.0)).collect(), slopes: gauss(2 * nodes) }
    }

    /// The albedo toward a view at this cosine, with a weight by the light's cosine. Accurate to 6e-4, and if
    /// the view is not within 1 degree of the horizon and the weight is smooth, to 3e-4.
    pub(crate) fn albedo(&self, view: f64, weight: impl Fn(f64) -> f64) -> FacetAlbedo {
        let (alpha, view) = (self.alpha, view.clamp(1e-6, 1.0));
        let masked = |cosine: f64| (alpha * alpha + (1.0 - alpha * alpha) * cosine * cosine).sqrt();
        let (masked_view, tangent) = (masked(view), (1.0 - view * view).sqrt() / view);
        let mut sum = FacetAlbedo::default();
        for (turn, part) in &self.turns {
            let s = tangent * turn;
            let root = (s * s + 1.0).sqrt();
            // The root of t^2 - 2 s t - 1 without cancellation.
            let steepest = if s > 0.0 { s + root } else { 1.0 / (root - s) };
            // q = tan(psi / 2), up to its value for the steepest slope.
            let end = steepest / (alpha + (alpha * alpha + steepest * steepest).sqrt());
            for (share, portion) in &self.slopes {
                let q = end * share;
                let (less, more) = ((1.0 - q) * (1.0 + q), 1.0 + q * q);
                let t = 2.0 * alpha * q / less;
                let cos2 = 1.0 / (1.0 + t * t);
                let light = (view * cos2 * (1.0 + 2.0 * t * s - t * t)).clamp(0.0, 1.0);
                if light <= 0.0 {
                    continue;
                }
                // V.h / N.V N.h.
                let slant = 1.0 + t * s;
                let g2 = 2.0 * light * view / (light * masked_view + view * masked(light));
                let density = 8.0 * q * less / (more * more * more);
                let value = density * end * part * portion * g2 * slant;
                let grazing = math::powi((1.0 - view * slant * cos2.sqrt()).max(0.0), 5);
                let weighted = value * weight(light);
                sum.scale += weighted * (1.0 - grazing);
                sum.bias += weighted * grazing;
                sum.whole += value;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More nodes give the same albedos, also for the narrowest and the widest facets.
    #[test]
    fn few_nodes_are_enough_for_facets() {
        for roughness in [0.01f64, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0] {
            let alpha = roughness * roughness;
            let [few, many] = [Facets::new(alpha), Facets::with_nodes(alpha, 80)];
            for view in [0.0, 1e-4, 0.002, 0.02, 0.05, 0.1, 0.3, 0.6, 1.0] {
                let [found, expected] = [&few, &many].map(|rule| rule.albedo(view, |_| 1.0));
                let allowed = if view < 0.017 { 6e-4 } else { 3e-4 };
                for (found, expected) in [(found.whole, expected.whole), (found.bias, expected.bias)] {
                    assert!((found - expected).abs() < allowed, "{roughness} {view}: {found} {expected}");
                }
                assert!((found.scale + found.bias - found.whole).abs() < 1e-12);
            }
        }
    }

    /// The split sums of engines: F_0 scale + F_90 bias.
    #[test]
    fn albedos_are_those_of_the_reference_tables() {
        const TEST: &str = "albedos_are_those_of_the_reference_tables";
        let Some(reference) = test_data::reference(TEST, "engines/dfg.json") else { return };
        let rows = reference["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 36);
        let mut worst: f64 = 0.0;
        for row in rows {
            let number = |value: &serde_json::Value| value.as_f64().unwrap();
            let roughness = number(&row["roughness"]);
            let found = Facets::new(roughness * roughness).albedo(number(&row["NoV"]), |_| 1.0);
            let expected = &row["correlated"];
            worst = worst.max((found.scale - number(&expected["scale"])).abs());
            worst = worst.max((found.bias - number(&expected["bias"])).abs());
        }
        eprintln!("GGX's albedo differs by {worst:.1e}");
        assert!(worst < 3e-4, "{worst:e}");
    }

    #[test]
    fn a_table_is_exact_for_lines_in_the_root_of_the_cosine() {
        let tables = Tables::new(|cosine| [1.0, cosine.sqrt(), 2.0 - cosine.sqrt(), 0.0]);
        for cosine in [0.0f64, 1e-6, 0.013, 0.5, 0.9999, 1.0] {
            let expected = [1.0, cosine.sqrt(), 2.0 - cosine.sqrt(), 0.0];
            for (found, expected) in tables.at(cosine).iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14, "{cosine}: {found} {expected}");
            }
        }
        for (found, expected) in tables.means().iter().zip([1.0, 0.8, 1.2, 0.0]) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        assert_eq!(tables.constants().len(), NODES);
        // The clamped cosine has pi, 2 pi / 3 and pi / 4.
        for (found, expected) in tables.zonal(0).iter().zip([1.0, 2.0 / 3.0, 0.25]) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        assert_eq!(tables.zonal(3), [0.0; 3]);
    }
}
