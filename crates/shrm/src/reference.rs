//! Reflected radiance by brute force: the integral that everything else in this crate is a faster form of.
//!
//! B(C, V) = sum over the texels w of an environment of L(w) rho_hat(R^-1 w, R^-1 V) dOmega [RH02, eq. 2],
//! with C the central direction, R its frame and dOmega the exact solid angle of the texel. The sum takes
//! rho_hat at the centre of each texel, the midpoint rule: it errs by h^2 / 24 times the curvature of
//! rho_hat, h being the height of a row. If a lobe is less than 20 rows wide, that shows, and
//! [`Reference::new`] integrates over the areas of texels instead, each of one radiance, to an error of about
//! 5e-4 ([`LightTree`]). Spherical harmonics of the same image are made with the weights of Fejér's rule,
//! which differ from the solid angles by O(h^2).
//!
//! Summed over centres, [`Reference::radiance`] calls the material for every texel, in f64. Maps of lambert,
//! phong and microfacet come from vectorised sums (`lobes.rs`), which the tests compare with it; maps of
//! other materials come from the same sum as `radiance`. Work common to the texels of a row, to a row of a
//! map and to one view is done once; black texels are not read.
//!
//! A [`Cull`] leaves out directions in which a lobe is small [RH02, app. D]: for max(0, cos)^s it keeps the
//! cap about C with cos(theta) >= eps^(1 / (s + 1)), which holds 1 - eps of the lobe's integral. A Gaussian
//! of theta_h holds as much within theta_h <= sigma sqrt(-ln eps), to the order of sigma^2 and more where the
//! horizon cuts it; the incident directions of these lie within twice that angle of the reflection vector,
//! because L mirrors V about H and R mirrors it about N. The part W of the sphere that such a cap covers is
//! [`Reference::width`].
//!
//! [`Sampled`] estimates the same integral from a few directions at each texel, and how far it may be off:
//! for images of many texels.

mod lit_texels;
mod lobes;
mod sampled;
mod tree;
mod tree_blocks;

use std::f64::consts::PI;
use std::ops::Range;

use brdf::Material;
use envmap::Environment;
use rayon::prelude::*;
use sh::Tolerance;
use sh::f64x4::SimdLevel;
use sphere::Direction;

use crate::{MapGrid, View, frame};
use lit_texels::{LitTexels, Span};
pub use sampled::{BATCH, Estimate, Sampled};
pub use tree::LightTree;

use lobes::{Gaussian, Lobe, LobeSum, Power, Weight, WholePower};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// The texels that are summed over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cull {
    /// All texels that hold light.
    None,
    /// For lambert, phong and microfacet, the texels that hold all but this share of the lobe's energy in
    /// angle; for other models, and for lobes that are integrated over the areas of texels, all.
    Energy(Tolerance),
}

/// The width of a lobe, in rows of the environment, below which it is integrated over the areas of texels.
const NARROW_ROWS: f64 = 20.0;

/// The error of an integral over the areas of texels, as a share of the radiance: 7e-4 stops.
const SHARE: f64 = 5e-4;

/// The radiance below which the error of such an integral is not relative, as a share of the environment's
/// mean.
const DARKEST: f64 = 1e-3;

/// The brute-force integral of one environment and one material.
#[derive(Debug)]
pub struct Reference {
    texels: LitTexels,
    /// The areas of the texels and the radiance below which nothing is seen, for a narrow lobe.
    areas: Option<(LightTree<'static>, f64)>,
    material: Material,
    lobe: Option<(Lobe, [f64; 3])>,
    /// The cosine of the radius of the cap that is summed over.
    cap: Option<f64>,
}

/// A texel of a map, with what follows from its place without trigonometry.
struct Central {
    direction: Direction,
    theta: f64,
    /// The column of the environment that the texel lies on.
    column: f64,
}

impl Reference {
    /// Prepares the integral: the sum over the centres of texels, or over their areas if a lobe of the
    /// material is less than 20 rows wide.
    ///
    /// # Example: a white surface reflects a constant sky unchanged
    /// ```
    /// use shrm::reference::{Cull, Reference};
    /// use sphere::{Direction, LatLong};
    /// let grid = LatLong::with_rows(64);
    /// let sky = envmap::Environment::new(grid, vec![[0.25, 0.5, 1.0]; grid.len()]).unwrap();
    /// let white = brdf::Material::Lambert(brdf::Lambert::new([1.0; 3])?);
    /// let radiance = Reference::new(&sky, &white, Cull::None).radiance(Direction::Z, Direction::Z);
    /// assert!((radiance[1] - 0.5).abs() < 1e-3, "{radiance:?}");
    /// # Ok::<(), brdf::ParameterError>(())
    /// ```
    pub fn new(environment: &Environment, material: &Material, cull: Cull) -> Self {
        let row = PI / environment.grid().height as f64;
        if tree::narrowest(material) >= NARROW_ROWS * row {
            return Self::at_centres(environment, material, cull);
        }
        let mean = environment.integral().iter().map(|value| value.abs()).sum::<f64>() / (12.0 * PI);
        let areas = Some((LightTree::of(environment.clone()), DARKEST * mean));
        Self { areas, ..Self::at_centres(environment, material, Cull::None) }
    }

    /// Prepares the sum over the centres of texels, however narrow the lobe, as in [RH02, sec. 6.2].
    pub fn at_centres(environment: &Environment, material: &Material, cull: Cull) -> Self {
        let lobe = Lobe::of(material);
        let cap = match cull {
            Cull::None => None,
            Cull::Energy(tolerance) => cap(material, tolerance.get()),
        };
        Self { texels: LitTexels::new(environment), areas: None, material: material.clone(), lobe, cap }
    }

    /// The number of texels that hold light.
    pub fn lit(&self) -> usize {
        self.texels.lit()
    }

    /// The part W of the sphere that is summed over: 1 if nothing is culled.
    pub fn width(&self) -> f64 {
        self.cap.map_or(1.0, |cosine| (1.0 - cosine) / 2.0)
    }

    /// B(C, V), RGB, in f64 with the material's own [`Material::rho_hat`].
    ///
    /// `central` is the material's central direction (R, N or T), `view` points toward the viewer; both in
    /// the world.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f64; 3] {
        if let Some((tree, dark)) = &self.areas {
            return tree.radiance(&self.material, central, view, SHARE, *dark);
        }
        let at =
            Central { direction: central, theta: central.theta(), column: self.texels.column(central.phi()) };
        self.integral(&at, frame(central).inverse().apply(view), &self.spans(at.theta))
    }

    /// The reflection map toward one view V of the world: B(C, V) at every texel's central direction C.
    ///
    /// If nothing is culled, it is [`Reference::radiance`] within 1e-5 of the map's largest value, and 1e-4
    /// for the sharpest lobes that are summed in f32 (exponent 1024, sigma 0.03); if something is culled, a
    /// few texels beside the cap count too.
    pub fn map(&self, grid: MapGrid, view: Direction) -> Vec<[f32; 3]> {
        self.rows(grid, 0..rows_of(grid), View::Global, view)
    }

    /// The map toward one local view: B(C, R w_o) at every texel, w_o in the frame of the texel's C.
    pub fn local_map(&self, grid: MapGrid, outgoing: Direction) -> Vec<[f32; 3]> {
        self.rows(grid, 0..rows_of(grid), View::Local, outgoing)
    }

    /// Some rows of a map, counted over the faces of a cube; `view` says in which frame `toward` is.
    ///
    /// Each texel is computed by itself: bit-identical for any number of threads and any ranges of rows.
    ///
    /// # Panics
    /// If a row is not one of the map.
    pub fn rows(&self, grid: MapGrid, rows: Range<usize>, view: View, toward: Direction) -> Vec<[f32; 3]> {
        assert!(rows.end <= rows_of(grid), "rows of the map");
        let [_, _, width] = grid.shape();
        let mut map = vec![[0.0; 3]; rows.len() * width];
        let level = SimdLevel::detect();
        map.par_chunks_mut(width.max(1)).zip(rows).for_each(|(texels, row)| {
            let mut spans: Option<(f64, Vec<Span>)> = None;
            for (texel, at) in texels.iter_mut().zip(self.centrals(grid, row)) {
                if spans.as_ref().is_none_or(|(theta, _)| *theta != at.theta && self.cap.is_some()) {
                    spans = Some((at.theta, self.spans(at.theta)));
                }
                let spans = spans.as_ref().map_or(&[][..], |(_, spans)| spans);
                *texel = self.texel(level, &at, view, toward, spans).map(|value| value as f32);
            }
        });
        map
    }

    /// The central directions of a row of a map.
    fn centrals(&self, grid: MapGrid, row: usize) -> impl Iterator<Item = Central> {
        let [_, _, width] = grid.shape();
        let theta = match grid {
            MapGrid::LatLong(grid) => Some(grid.theta(row)),
            MapGrid::Cube(_) => None,
        };
        (0..width).map(move |column| {
            let direction = grid.direction(row * width + column);
            let theta = theta.unwrap_or_else(|| direction.theta());
            let phi = match grid {
                MapGrid::LatLong(grid) => grid.phi(column),
                MapGrid::Cube(_) => direction.phi(),
            };
            Central { direction, theta, column: self.texels.column(phi) }
        })
    }

    /// The texels of the environment that a central direction at this colatitude sums over.
    fn spans(&self, theta: f64) -> Vec<Span> {
        self.cap.map_or_else(|| self.texels.whole(), |cosine| self.texels.within(theta, cosine))
    }

    /// One texel of a map.
    fn texel(
        &self,
        level: SimdLevel,
        at: &Central,
        view: View,
        toward: Direction,
        spans: &[Span],
    ) -> [f64; 3] {
        if self.areas.is_some() {
            return self.radiance(at.direction, view.to_world(at.direction, toward));
        }
        let axis = at.direction.vector();
        let (sum, scale) = match self.lobe {
            Some((Lobe::WholePower(exponent), scale)) => {
                let weight = WholePower { axis, exponent };
                (LobeSum { texels: &self.texels, spans, column: at.column, weight }.run(level), scale)
            }
            Some((Lobe::Power(exponent), scale)) => {
                (self.sum(level, at, spans, Power { axis, exponent }), scale)
            }
            Some((Lobe::Gaussian { sigma }, scale)) => {
                let view = view.to_world(at.direction, toward);
                let both = axis + view.vector();
                // Toward the mirrored central direction the normal has no side of its own: see
                // Centre::surface.
                let normal = if both.length_squared() > 1e-12 {
                    both.normalize()
                } else {
                    frame(at.direction).matrix().x_axis
                };
                (self.sum(level, at, spans, Gaussian { normal, view: view.vector(), sigma }), scale)
            }
            None => {
                let outgoing = match view {
                    View::Global => frame(at.direction).inverse().apply(toward),
                    View::Local => toward,
                };
                return self.integral(at, outgoing, spans);
            }
        };
        std::array::from_fn(|channel| sum[channel] * scale[channel])
    }

    fn sum<W: Weight>(&self, level: SimdLevel, at: &Central, spans: &[Span], weight: W) -> [f64; 3] {
        level.run(LobeSum { texels: &self.texels, spans, column: at.column, weight })
    }

    /// The sum with the material's own transfer function. What depends on the view alone, the surface's
    /// frame, is found once.
    fn integral(&self, at: &Central, outgoing: Direction, spans: &[Span]) -> [f64; 3] {
        let centre = self.material.centre();
        let from_local = centre.surface_frame(outgoing);
        let to_surface = from_local * frame(at.direction).matrix().transpose();
        let outgoing = Direction::normalised(from_local * outgoing.vector());
        let mut total = [0.0; 3];
        for &span in spans {
            for segment in self.texels.segments(span, at.column, 0) {
                for index in segment {
                    let (direction, radiance) = self.texels.texel(span.row, index);
                    let incident = Direction::from_unit(to_surface * direction);
                    let rho_hat = self.material.rho_hat(incident, outgoing);
                    for channel in 0..3 {
                        total[channel] += rho_hat[channel] * radiance[channel];
                    }
                }
            }
        }
        total
    }
}

/// The rows of all faces.
fn rows_of(grid: MapGrid) -> usize {
    let [faces, height, _] = grid.shape();
    faces * height
}

/// The cosine of the radius of the cap about the central direction that holds all but `eps` of a lobe.
fn cap(material: &Material, eps: f64) -> Option<f64> {
    let power = |s: f64| math::pow(eps, 1.0 / (s + 1.0));
    match material {
        Material::Lambert(_) => Some(power(1.0)),
        Material::Phong(phong) => Some(power(phong.exponent())),
        Material::Microfacet(microfacet) => {
            let theta_h = microfacet.sigma() * (-math::ln(eps)).sqrt();
            Some(math::cos((2.0 * theta_h).min(PI)))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use brdf::{KajiyaKay, Lambert, Microfacet, Phong};
    use sphere::{Cube, DVec3, LatLong};

    /// Returns the same light in texels of a `factor`-th of the size: sums at their centres approach the
    /// integral.
    pub(super) fn subdivided(environment: &Environment, factor: usize) -> Environment {
        let coarse = environment.grid();
        let grid = LatLong { width: factor * coarse.width, height: factor * coarse.height };
        let texel = |i: usize| (i / grid.width / factor) * coarse.width + i % grid.width / factor;
        Environment::new(grid, (0..grid.len()).map(|i| environment.pixels()[texel(i)]).collect()).unwrap()
    }

    pub(super) fn environment(rows: usize, radiance: impl Fn(DVec3) -> [f64; 3]) -> Environment {
        let grid = LatLong::with_rows(rows);
        let looks = |i: usize| grid.direction(i / grid.width, i % grid.width).vector();
        let pixels = (0..grid.len()).map(|i| radiance(looks(i)).map(|value| value as f32)).collect();
        Environment::new(grid, pixels).unwrap()
    }

    /// Hard light: a few bright spots, black between them, so that rows are gathered from pieces.
    fn lamps(w: DVec3) -> [f64; 3] {
        let stripes = (7.0 * w.x + 3.0 * w.y).sin() * (5.0 * w.z).cos();
        if stripes > 0.3 { [stripes, 1.0 + w.z, 50.0 * stripes.powi(8)] } else { [0.0; 3] }
    }

    fn phong(exponent: f64) -> Material {
        Material::Phong(Phong::new(exponent, [1.0, 0.5, 0.25]).unwrap())
    }

    fn materials() -> Vec<Material> {
        let mut all = vec![
            Material::Lambert(Lambert::new([0.8, 0.4, 0.0]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(8.0, [1.0; 3]).unwrap()),
        ];
        all.extend([0.0, 0.4, 1.0, 12.0, 33.0, 100.5, 1023.0, 5000.0].map(phong));
        all.extend([0.02, 0.05, 0.2, 0.5, 3.0].map(microfacet));
        all
    }

    fn microfacet(sigma: f64) -> Material {
        Material::Microfacet(Microfacet::new(sigma, [0.25, 0.5, 1.0]).unwrap())
    }

    fn views() -> impl Iterator<Item = Direction> {
        [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.2, -0.9, -0.3]]
            .into_iter()
            .map(|v| Direction::normalised(DVec3::from_array(v)))
    }

    /// The largest difference of a map from [`Reference::radiance`], of the map's largest value.
    fn error(reference: &Reference, grid: MapGrid, view: Direction) -> f64 {
        let map = reference.map(grid, view);
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for (texel, found) in map.iter().enumerate() {
            let expected = reference.radiance(grid.direction(texel), view);
            for channel in 0..3 {
                worst = worst.max((f64::from(found[channel]) - expected[channel]).abs());
                largest = largest.max(expected[channel]);
            }
        }
        worst / largest
    }

    fn grids() -> [MapGrid; 2] {
        [MapGrid::LatLong(LatLong { width: 11, height: 9 }), MapGrid::Cube(Cube { edge: 4 })]
    }

    /// A texel's weight errs by s * 6e-8 or 6e-8 / sigma^2 and its roundings (lobes.rs); sums add a few more.
    #[test]
    fn maps_are_the_sums_of_the_material_itself() {
        let sky = environment(32, lamps);
        for material in materials() {
            let reference = Reference::at_centres(&sky, &material, Cull::None);
            for (grid, view) in grids().into_iter().flat_map(|grid| views().map(move |view| (grid, view))) {
                let error = error(&reference, grid, view);
                let sharpness = match &material {
                    Material::Phong(phong) => phong.exponent(),
                    Material::Microfacet(microfacet) => microfacet.sigma().powi(-2),
                    _ => 1.0,
                };
                assert!(error < 2e-6 + 1e-7 * sharpness, "{material:?}: {error:e}");
            }
        }
    }

    /// [`Reference::radiance`] against the plain sum over `Material::rho_hat`, which shares no code with it.
    #[test]
    fn radiance_is_the_plain_sum() {
        let sky = environment(16, lamps);
        let grid = sky.grid();
        for material in materials() {
            let reference = Reference::at_centres(&sky, &material, Cull::None);
            for central in views() {
                for view in views() {
                    let to_local = frame(central).inverse();
                    let mut expected = [0.0; 3];
                    for (i, pixel) in sky.pixels().iter().enumerate() {
                        let (row, column) = (i / grid.width, i % grid.width);
                        let incident = to_local.apply(grid.direction(row, column));
                        let rho_hat = material.rho_hat_about_centre(incident, to_local.apply(view));
                        for channel in 0..3 {
                            expected[channel] +=
                                rho_hat[channel] * f64::from(pixel[channel]) * grid.solid_angle(row);
                        }
                    }
                    let found = reference.radiance(central, view);
                    for channel in 0..3 {
                        let allowed = 1e-10 * (1.0 + expected[0]);
                        assert!((found[channel] - expected[channel]).abs() < allowed, "{material:?}");
                    }
                }
            }
        }
    }

    /// Under a constant sky, a normalised lobe reflects its share. The midpoint rule errs by h^2 / 24 times
    /// the second derivative of the lobe, about s, over its integral; h = pi / 128.
    #[test]
    fn a_constant_sky_is_reflected_as_the_share() {
        let sky = environment(128, |_| [1.0, 2.0, 4.0]);
        for exponent in [2.0, 7.5, 64.0, 256.0] {
            let reference = Reference::at_centres(&sky, &phong(exponent), Cull::None);
            let allowed = exponent * (PI / 128.0).powi(2);
            for view in views() {
                for texel in reference.map(grids()[1], view) {
                    for value in texel {
                        assert!((f64::from(value) - 1.0).abs() < allowed, "{exponent}: {texel:?}");
                    }
                }
            }
        }
    }

    /// A cap of [RH02, app. D] under a constant sky keeps 1 - eps, and a little more with the texels beside
    /// it; the texels on its edge make that uncertain by their share of the cap.
    #[test]
    fn a_cap_leaves_out_the_stated_share_of_energy() {
        let sky = environment(256, |_| [1.0; 3]);
        for eps in [0.05, 0.2] {
            for exponent in [1.0, 8.0, 32.0, 128.0] {
                let cull = Cull::Energy(Tolerance::new(eps).unwrap());
                let material = phong(exponent);
                let culled = Reference::at_centres(&sky, &material, cull);
                let width = (1.0 - eps.powf(1.0 / (exponent + 1.0))) / 2.0;
                assert!((culled.width() - width).abs() < 1e-14);
                let whole = Reference::at_centres(&sky, &material, Cull::None);
                for view in views() {
                    let kept = culled.radiance(view, view)[0] / whole.radiance(view, view)[0];
                    assert!((kept - (1.0 - eps)).abs() < 0.01, "{eps} {exponent}: {kept}");
                    let maps = [&culled, &whole].map(|reference| reference.map(grids()[0], view));
                    for (culled, whole) in maps[0].iter().zip(&maps[1]) {
                        let kept = culled[0] / whole[0];
                        assert!(kept > 0.99 - eps as f32 && kept < 1.000_01, "{eps} {exponent}: {kept}");
                    }
                }
            }
        }
    }

    /// A map of a narrow lobe: the sum over centres of a sixteenth of the size, which has 37 rows in a lobe
    /// of exponent 400, and the one of whole texels.
    #[test]
    fn a_narrow_lobe_is_integrated_over_the_areas_of_texels() {
        let sky = environment(24, lamps);
        let (material, grid) = (phong(400.0), grids()[1]);
        let fine = Reference::at_centres(&subdivided(&sky, 16), &material, Cull::None);
        let cull = Cull::Energy(Tolerance::new(0.1).unwrap());
        let found = Reference::new(&sky, &material, cull);
        assert!(found.width() == 1.0, "nothing is left out");
        let coarse = Reference::at_centres(&sky, &material, Cull::None);
        let [found, fine, coarse] =
            [&found, &fine, &coarse].map(|reference| reference.map(grid, Direction::X));
        let stops = |map: &[[f32; 3]]| {
            let stops = map.as_flattened().iter().zip(fine.as_flattened());
            stops.map(|(a, b)| ((a + 0.01) / (b + 0.01)).log2().abs()).fold(0.0, f32::max)
        };
        assert!(stops(&found) < 0.01 && stops(&coarse) > 1.0, "{} {}", stops(&found), stops(&coarse));
    }

    /// The Gaussian's caps, toward every view from the normal to grazing: a constant sky loses the share or
    /// less.
    #[test]
    fn a_cap_about_a_gaussian_leaves_out_no_more_than_stated() {
        let sky = environment(256, |_| [1.0; 3]);
        for eps in [0.05, 0.2] {
            for sigma in [0.1, 0.2, 0.35, 0.5] {
                let cull = Cull::Energy(Tolerance::new(eps).unwrap());
                let culled = Reference::at_centres(&sky, &microfacet(sigma), cull);
                let whole = Reference::at_centres(&sky, &microfacet(sigma), Cull::None);
                let mut most = 0.0_f64;
                for degrees in [0.0, 20.0, 60.0, 100.0, 140.0, 165.0, 178.0] {
                    let central = Direction::from_angles(1.1, 0.3);
                    let view = frame(central).apply(Direction::from_angles(f64::to_radians(degrees), 0.7));
                    let kept = culled.radiance(central, view)[0] / whole.radiance(central, view)[0];
                    most = most.max(1.0 - kept);
                }
                assert!(most < eps + 0.01, "{eps} {sigma}: {most}");
            }
        }
    }

    #[test]
    fn a_local_map_is_the_map_toward_each_texels_own_view() {
        let sky = environment(16, lamps);
        let outgoing = Direction::from_angles(0.8, 2.0);
        for material in materials() {
            let reference = Reference::at_centres(&sky, &material, Cull::None);
            for grid in grids() {
                for (texel, found) in reference.local_map(grid, outgoing).into_iter().enumerate() {
                    let central = grid.direction(texel);
                    let expected = reference.radiance(central, frame(central).apply(outgoing));
                    for channel in 0..3 {
                        let allowed = 1e-4 * (expected[channel] + 0.1);
                        assert!(
                            (f64::from(found[channel]) - expected[channel]).abs() < allowed,
                            "{material:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn threads_and_ranges_of_rows_change_no_bit() {
        let sky = environment(32, lamps);
        let cull = Cull::Energy(Tolerance::new(0.05).unwrap());
        for material in materials() {
            let reference = Reference::at_centres(&sky, &material, cull);
            for grid in grids() {
                let view = Direction::X;
                let whole = reference.map(grid, view);
                let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
                assert!(one.install(|| reference.map(grid, view)) == whole);
                let parts = [0..2, 2..7, 7..rows_of(grid)];
                let parts = parts.map(|rows| reference.rows(grid, rows, View::Global, view));
                assert!(parts.concat() == whole);
            }
        }
    }

    #[test]
    fn a_black_sky_is_not_read_and_reflects_nothing() {
        let sky = environment(8, |w| if w.z > 0.99 { [1.0; 3] } else { [0.0; 3] });
        let reference = Reference::at_centres(&sky, &phong(3.0), Cull::None);
        assert_eq!(reference.lit(), 0, "row 0 lies at 11 degrees");
        assert_eq!(reference.radiance(Direction::Z, Direction::Z), [0.0; 3]);
        assert_eq!(reference.map(grids()[0], Direction::Z)[0], [0.0; 3]);
    }
}
