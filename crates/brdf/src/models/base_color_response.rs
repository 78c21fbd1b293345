//! How the light that a `standard` material reflects depends on its base colour.
//!
//! A renderer that shades with one base colour c0, such as the mean of a texture, shows another one c by
//! this. Under a uniform light of radiance 1, the material reflects toward a view at the cosine x
//!
//! > c t(x) (1 - `metallic`) + R(x, c),  R(x, c) = X(x) + F_0(c) A(x) + F_90 B(x) + M(c) w(x)
//!
//! with the functions t and w of [`super::Standard`], the albedo X of coat and sheen, the albedo F_0 A + F_90
//! B of the highlight, and the share M of the light that facets reflect several times. The matte base is
//! t(x) times c (1 - `metallic`) times the integral of the light with T(N.L) = t(N.L) N.L / (pi mean(t)),
//! whose zonal coefficients 2 pi integral(T P_l) stand beside.

/// Functions of the cosine of the view at a node: t, w, A, B, and the albedos of the coat and of white sheen.
pub type ResponseNode = [f64; 6];

/// The terms of a `standard` material that its base colour changes, and those that it does not.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseColorResponse {
    /// The base colour of the material.
    pub base_color: [f64; 3],
    /// The parameter `metallic`.
    pub metallic: f64,
    /// F_0 of the dielectric.
    pub dielectric: [f64; 3],
    /// F_90 of the mixture.
    pub f_90: f64,
    /// The colour of the sheen.
    pub sheen: [f64; 3],
    /// M of the dielectric.
    pub dielectric_several: [f64; 3],
    /// The mean albedo of facets that reflect everything.
    pub whole: f64,
    /// The zonal coefficients of T for the degrees 0, 1 and 2. The first is 1, unless t is 0 everywhere.
    pub matte: [f64; 3],
    /// The functions at equal steps of the cosine's root, from 0 to 1.
    pub nodes: Vec<ResponseNode>,
}

impl BaseColorResponse {
    /// The light of a uniform sky of radiance 1 that the material reflects toward a view at a cosine, if its
    /// base colour is this one: the matte base, and all else. Lines between the nodes.
    pub fn albedo(&self, base_color: [f64; 3], cosine: f64) -> [[f64; 3]; 2] {
        let [first, .., last] = self.nodes.as_slice() else { return [[0.0; 3]; 2] };
        let place = cosine.clamp(0.0, 1.0).sqrt() * (self.nodes.len() - 1) as f64;
        let node = (place as usize).min(self.nodes.len() - 2);
        let share = place - node as f64;
        let ends = [self.nodes.get(node).unwrap_or(first), self.nodes.get(node + 1).unwrap_or(last)];
        let at = |k: usize| ends[0][k] + (ends[1][k] - ends[0][k]) * share;
        let mix = |dielectric: f64, metal: f64| dielectric + (metal - dielectric) * self.metallic;
        let rest = |channel: usize| {
            let colour = base_color[channel];
            let several = mix(self.dielectric_several[channel], several(colour, 1.0, self.whole));
            at(4)
                + self.sheen[channel] * at(5)
                + mix(self.dielectric[channel], colour) * at(2)
                + self.f_90 * at(3)
                + several * at(1)
        };
        let matte = base_color.map(|colour| colour * (1.0 - self.metallic) * at(0));
        [matte, [0, 1, 2].map(rest)]
    }
}

/// The share of light that remains after several reflections between facets of these reflectances, of which
/// all would reflect `whole` at once.
pub(super) fn several(f_0: f64, f_90: f64, whole: f64) -> f64 {
    let average = f_0 + (f_90 - f_0) / 21.0;
    average * average * whole / (1.0 - average * (1.0 - whole))
}
