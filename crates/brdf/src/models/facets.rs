//! The half vector of light and view, for the models of small facets.

use std::f64::consts::PI;

use glam::DVec3;
use sphere::Direction;

/// The half vector h = (L + V) / |L + V| over a surface with normal +Z, and the cosines that facets which
/// face it see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfVector {
    /// The sum L + V.
    pub(crate) sum: DVec3,
    /// |L + V|^2.
    pub(crate) length_squared: f64,
    /// N.L, above 0.
    pub(crate) light: f64,
    /// N.V, 0 or more.
    pub(crate) view: f64,
}

impl HalfVector {
    /// The half vector; `None` if the light is below the horizon, or light and view are opposite.
    pub(crate) fn new(incident: Direction, outgoing: Direction) -> Option<Self> {
        let (light, view) = (incident.vector(), outgoing.vector());
        let sum = light + view;
        let length_squared = sum.length_squared();
        // A view at the horizon may be a hair below it.
        (light.z > 0.0 && sum.z > 0.0 && length_squared > 0.0).then_some(Self {
            sum,
            length_squared,
            light: light.z,
            view: view.z.max(0.0),
        })
    }

    /// (N.h)^2.
    pub(crate) fn cos2(&self) -> f64 {
        self.sum.z * self.sum.z / self.length_squared
    }

    /// 1 - (N.h)^2, without cancellation.
    pub(crate) fn sin2(&self) -> f64 {
        (self.sum.x * self.sum.x + self.sum.y * self.sum.y) / self.length_squared
    }

    /// L.h = V.h, above 0.
    pub(crate) fn facet(&self) -> f64 {
        0.5 * self.length_squared.sqrt()
    }

    /// D G / (4 N.V) of facets that reflect everything: GGX's distribution and Smith's masking, correlated by
    /// height, with alpha^2 as in `ggx`. Finite at grazing.
    pub(crate) fn ggx(&self, alpha2: f64) -> f64 {
        let (light, view) = (self.light, self.view);
        let across = self.sin2() + alpha2 * self.cos2();
        let d = alpha2 / (PI * across * across);
        let masked = |cosine: f64| (alpha2 + (1.0 - alpha2) * cosine * cosine).sqrt();
        d * 0.5 * light / (light * masked(view) + view * masked(light))
    }

    /// D G / (4 N.V) of facets that reflect everything and are `x` wide along +X and `y` along +Y (alpha of
    /// `ggx` each).
    pub(crate) fn ggx_stretched(&self, [x, y]: [f64; 2], [light, view]: [DVec3; 2]) -> f64 {
        let across = math::powi(self.sum.x / x, 2) + math::powi(self.sum.y / y, 2) + self.sum.z * self.sum.z;
        let across = across / self.length_squared;
        let d = 1.0 / (PI * x * y * across * across);
        let masked = |v: DVec3| DVec3::new(x * v.x, y * v.y, v.z).length();
        d * 0.5 * self.light / (self.light * masked(view) + self.view * masked(light))
    }

    /// tan^2(theta_h) weighted by 1 / `x`^2 along +X and 1 / `y`^2 along +Y; infinite if h is on the horizon.
    pub(crate) fn tan2(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (self.sum.x / x, self.sum.y / y);
        (x * x + y * y) / (self.sum.z * self.sum.z)
    }
}
