//! Simple distributions of the directions that a model reflects from, for a renderer to sample.

/// A distribution of incident directions, which a renderer samples in place of rho_hat. It need not follow
/// rho_hat closely; it must only be dense where rho_hat is large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// The cosine of the angle from the normal.
    Cosine,
    /// A power of the cosine of the angle from the axis (cx V_x, cx V_y, cz V_z).
    Power {
        /// The factor of the view's part along the surface.
        cx: f32,
        /// The factor of the view's height.
        cz: f32,
        /// The power of the cosine.
        n: f32,
    },
    /// The mirror direction about facets that are distributed as GGX's.
    Facets {
        /// The width of the facets along the tangent: alpha of GGX.
        x: f32,
        /// The width of the facets across the tangent.
        y: f32,
    },
    /// The cone about the tangent that the view lies on.
    Band {
        /// Half the width of the band, in radians.
        width: f32,
    },
}

/// The narrowest facets and the sharpest power that directions in f32 can resolve.
const NARROWEST: f64 = 1e-4;
const SHARPEST: f64 = 1e7;

impl Lobe {
    pub(crate) fn power(cx: f64, cz: f64, n: f64) -> Self {
        Self::Power { cx: cx as f32, cz: cz as f32, n: n.min(SHARPEST) as f32 }
    }

    pub(crate) fn facets(widths: [f64; 2]) -> Self {
        let [x, y] = widths.map(|width| width.clamp(NARROWEST, 1.0) as f32);
        Self::Facets { x, y }
    }

    /// Facets as wide as those with (N.h)^s: both fall as 1 - (s / 2 + 1) theta^2, seen in the light's
    /// directions.
    pub(crate) fn facets_of_powers(powers: [f64; 2]) -> Self {
        Self::facets(powers.map(|s| (2.0 / (s + 2.0)).sqrt()))
    }

    pub(crate) fn band(width: f64) -> Self {
        Self::Band { width: width.max(NARROWEST) as f32 }
    }
}
