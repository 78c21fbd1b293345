//! The same integral to a stated error, for single directions: light in a tree of blocks.
//!
//! A block reflects about what its light would from the mean direction of that light. How far that is off
//! shows once the block is split: the parts reflect something else. So the sum begins with few blocks and
//! splits the one whose parts differ most, until what is left is below the error asked for. The blocks go on
//! inside the texels ([`super::tree_blocks`]), so a lobe that is narrower than a texel is integrated over
//! its area.
//!
//! A lobe that is narrower than a block may not show in its parts either. So blocks are small from the start
//! where lobes are: about the central direction in proportion to the angle from it, down to a share of the
//! narrowest lobe; and wherever the lobes of the material (`brdf::Material::lobes`) send one of [`DRAWN`]
//! directions, down to a share of that lobe's width. So streaks, the cone about a tangent, and highlights
//! that lie lower than R are found.
//!
//! Inside a texel only rho_hat varies: there the difference of a block from its parts says what is left
//! (Richardson's extrapolation of the midpoint rule), and a third of it is added.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

use brdf::{Lobe, Material};
use envmap::Environment;
use sphere::{DMat3, DVec3, Direction};

use super::tree_blocks::{TreeBlock, TreeBlocks, TreePlace};
use crate::frame;

/// A block is split beforehand if its height is more than this share of its angle from the central direction.
const MAX_HEIGHT_SHARE: f64 = 0.8;

/// Directions that each lobe draws: a round one, and a streak or a cone.
const DRAWN: [usize; 2] = [32, 256];

/// The share of a lobe's width below which blocks are not split for its drawn directions.
const ALONG: f64 = 0.5;

/// The share of the narrowest lobe's width below which blocks are not split beforehand, and the one below
/// which they are not split at all.
const BEFOREHAND: f64 = 0.125;
const AT_ALL: f64 = 0.004;

/// The share of what its top reflects by which a block at the horizon may be off.
const ABOVE: f64 = 0.1;

/// The share of a block's error that each of its parts is expected to have at least: where one split makes no
/// difference by chance, the next one may.
const INHERITED: f64 = 0.05;

/// An environment in blocks of blocks.
#[derive(Debug)]
pub struct LightTree<'a> {
    blocks: TreeBlocks<'a>,
}

/// The width of a lobe across its narrowest side, in radians: of a round one, the edge of a square whose area
/// times the highest density is 1 where the lobe is narrow.
fn width(lobe: &Lobe) -> f64 {
    match *lobe {
        Lobe::Cosine => PI.sqrt(),
        Lobe::Power { n, .. } => (TAU / (f64::from(n) + 1.0)).sqrt(),
        Lobe::Facets { x, y } => 2.0 * PI.sqrt() * f64::from(x.min(y)),
        Lobe::Band { width } => PI.sqrt() * f64::from(width),
    }
}

/// The width of the narrowest lobe of a material, in radians.
pub(super) fn narrowest(material: &Material) -> f64 {
    material.lobes().iter().map(width).fold(PI.sqrt(), f64::min)
}

impl<'a> LightTree<'a> {
    /// The tree of an environment.
    pub fn new(environment: &'a Environment) -> Self {
        Self { blocks: TreeBlocks::new(Cow::Borrowed(environment)) }
    }

    /// The tree of an environment that it keeps.
    pub(super) fn of(environment: Environment) -> LightTree<'static> {
        LightTree { blocks: TreeBlocks::new(Cow::Owned(environment)) }
    }

    /// B(C, V), RGB, as [`super::Reference::radiance`] has it. The error is estimated: most results are
    /// within about `share` of the sum of B and `dark`, the radiance below which nothing is seen, and 95 of
    /// 100 within five times that.
    ///
    /// `central` is the material's central direction (R, N or T), `view` points toward the viewer; both in
    /// the world.
    pub fn radiance(
        &self,
        material: &Material,
        central: Direction,
        view: Direction,
        share: f64,
        dark: f64,
    ) -> [f64; 3] {
        let to_local = frame(central).matrix().transpose();
        let outgoing = Direction::normalised(to_local * view.vector());
        let to_surface = material.centre().surface_frame(outgoing) * to_local;
        self.sum(material, to_surface, central, view, share, dark)
    }

    /// Returns the radiance of a surface that may be brushed: `frame` has its tangent, N x tangent, and its
    /// normal N as columns, in the world.
    pub fn surface_radiance(
        &self,
        material: &Material,
        frame: DMat3,
        view: Direction,
        share: f64,
        dark: f64,
    ) -> [f64; 3] {
        let [tangent, normal] = [frame.x_axis, frame.z_axis].map(Direction::normalised);
        let central = material.centre().central(normal, tangent, view);
        self.sum(material, frame.transpose(), central, view, share, dark)
    }

    fn sum(
        &self,
        material: &Material,
        to_surface: DMat3,
        central: Direction,
        view: Direction,
        share: f64,
        dark: f64,
    ) -> [f64; 3] {
        let outgoing = Direction::normalised(to_surface * view.vector());
        let mut sum = TreeSum {
            blocks: &self.blocks,
            material,
            to_surface,
            outgoing,
            width: narrowest(material),
            open: BinaryHeap::new(),
            total: [0.0; 3],
            left: 0.0,
        };
        sum.begin(central.vector());
        let size = |sum: &TreeSum<'_>| sum.total.iter().map(|value| value.abs()).sum::<f64>() + 3.0 * dark;
        while sum.left.max(0.0).sqrt() > share * size(&sum) && sum.split_worst() {}
        sum.total
    }
}

/// A sum in work.
struct TreeSum<'a> {
    blocks: &'a TreeBlocks<'a>,
    material: &'a Material,
    to_surface: DMat3,
    outgoing: Direction,
    /// The width of the material's narrowest lobe.
    width: f64,
    /// The blocks that may be split.
    open: BinaryHeap<Open>,
    total: [f64; 3],
    /// The sum of the squared errors of the open blocks, which are as often above as below.
    left: f64,
}

/// A block whose parts count in the sum.
struct Open {
    error: f64,
    place: TreePlace,
    /// The light that the block's parts reflect.
    parts: [[f64; 3]; 4],
    /// The light that was added beyond that of the parts.
    beyond: [f64; 3],
}

impl TreeSum<'_> {
    /// Directions that the lobes draw, as positions of the image, each with the height of blocks that is
    /// small enough there.
    fn drawn(&self) -> Vec<([f64; 2], f64)> {
        let to_world = self.to_surface.transpose();
        // R2, a sequence of low discrepancy: Roberts 2018, powers of the inverse root of x^3 = x + 1.
        let point = |index: usize| {
            [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| (0.5 + step * index as f64).fract())
        };
        let mut drawn = Vec::new();
        for lobe in self.material.lobes() {
            let is_round = match lobe {
                Lobe::Facets { x, y } => x == y,
                Lobe::Band { .. } => false,
                Lobe::Cosine | Lobe::Power { .. } => true,
            };
            for index in 0..DRAWN[usize::from(!is_round)] {
                let incident = lobe.sample(point(index), self.outgoing);
                if self.material.rho_hat(incident, self.outgoing) != [0.0; 3] {
                    let direction = Direction::normalised(to_world * incident.vector());
                    drawn.push((self.blocks.position(direction), ALONG * width(&lobe)));
                }
            }
        }
        drawn
    }

    /// Adds the coarsest blocks, and smaller ones about the central direction and where the lobes are.
    fn begin(&mut self, central: DVec3) {
        type Drawn = Vec<([f64; 2], f64)>;
        let drawn = self.drawn();
        // Those in a block that are not yet in a small enough one.
        let within = |place: TreePlace, drawn: &Drawn, extent: f64| -> Drawn {
            let counts = |drawn: &&([f64; 2], f64)| drawn.1 < extent && TreeBlocks::holds(place, drawn.0);
            drawn.iter().filter(counts).copied().collect()
        };
        let mut places: Vec<(TreePlace, Drawn)> =
            self.blocks.coarsest().map(|place| (place, drawn.clone())).collect();
        while let Some((place, drawn)) = places.pop() {
            let (extent, block) = (self.blocks.extent(place), self.blocks.block(place));
            if block.is_dark() {
                continue;
            }
            let drawn = within(place, &drawn, extent);
            let angle = math::acos(block.direction().normalize_or_zero().dot(central).clamp(-1.0, 1.0));
            let is_near = extent > BEFOREHAND * self.width && extent > MAX_HEIGHT_SHARE * angle;
            if (is_near || !drawn.is_empty()) && self.blocks.has_parts(place) {
                places.extend(self.blocks.parts(place).map(|part| (part, drawn.clone())));
            } else {
                let [reflected] = self.reflected([block]);
                (0..3).for_each(|channel| self.total[channel] += reflected[channel]);
                self.open(place, reflected, 0.0);
            }
        }
    }

    /// The light that blocks reflect, each from its mean direction.
    fn reflected<const N: usize>(&self, blocks: [TreeBlock; N]) -> [[f64; 3]; N] {
        let incident = |block: &TreeBlock| match block.is_dark() {
            true => Direction::Z,
            false => Direction::normalised(self.to_surface * block.direction()),
        };
        let mut values = [[0.0; 3]; N];
        self.material.rho_hats_toward(self.outgoing, &blocks.each_ref().map(incident), &mut values);
        for (value, block) in values.iter_mut().zip(&blocks) {
            let flux = block.flux();
            (0..3).for_each(|channel| value[channel] *= flux[channel]);
        }
        values
    }

    /// Replaces what a block reflects by what its parts do. `above` is the error of the block that it is part
    /// of.
    fn open(&mut self, place: TreePlace, whole: [f64; 3], above: f64) {
        if !self.blocks.has_parts(place) {
            return;
        }
        let mut blocks = [TreeBlock::default(); 4];
        for (block, part) in blocks.iter_mut().zip(self.blocks.parts(place)) {
            *block = self.blocks.block(part);
        }
        let parts = self.reflected(blocks);
        let mut difference = whole.map(|value| -value);
        for value in &parts {
            (0..3).for_each(|channel| difference[channel] += value[channel]);
        }
        let beyond = if place.is_of_texels() { [0.0; 3] } else { difference.map(|value| value / 3.0) };
        (0..3).for_each(|channel| self.total[channel] += difference[channel] + beyond[channel]);
        let error = difference.iter().map(|value| value.abs()).sum::<f64>();
        let error = error.max(self.above_horizon(place)).max(INHERITED * above);
        if error > 0.0 && (place.is_of_texels() || self.blocks.extent(place) > AT_ALL * self.width) {
            self.left += math::powi(error, 2);
            self.open.push(Open { error, place, parts, beyond });
        }
    }

    /// The light that the part of a block above the horizon may reflect, of a block whose mean direction lies
    /// about there or lower: none of its parts need see it.
    fn above_horizon(&self, place: TreePlace) -> f64 {
        let (extent, block) = (self.blocks.extent(place), self.blocks.block(place));
        let direction = (self.to_surface * block.direction()).normalize_or_zero();
        if direction.z.abs() > extent {
            return 0.0;
        }
        let top = Direction::normalised(direction.with_z(direction.z + extent));
        let (rho_hat, flux) = (self.material.rho_hat(top, self.outgoing), block.flux());
        ABOVE * (0..3).map(|channel| rho_hat[channel].abs() * flux[channel].abs()).sum::<f64>()
    }

    /// Splits the parts of the block whose error is the largest; false if there is none.
    fn split_worst(&mut self) -> bool {
        let Some(worst) = self.open.pop() else { return false };
        self.left -= math::powi(worst.error, 2);
        (0..3).for_each(|channel| self.total[channel] -= worst.beyond[channel]);
        for (part, reflected) in self.blocks.parts(worst.place).zip(worst.parts) {
            self.open(part, reflected, worst.error);
        }
        true
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then_with(|| self.place.cmp(&other.place))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Eq for Open {}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Phong, Standard, StandardParameters};

    use rayon::prelude::*;
    use sphere::{LatLong, spiral};

    use super::*;
    use crate::degrees::seen;
    use crate::reference::tests::subdivided;
    use crate::reference::{Cull, Reference};

    /// A sky with a gradient, a sun of three texels and a row of lamps.
    fn environment(rows: usize) -> Environment {
        let grid = LatLong::with_rows(rows);
        let pixels = (0..grid.len()).map(|i| {
            let (row, column) = (i / grid.width, i % grid.width);
            let w = grid.direction(row, column).vector();
            let sky = 0.5 + 0.4 * w.z + 0.1 * (9.0 * w.x).sin() * (7.0 * w.y).cos();
            let sun = if row == rows / 3 && (20..23).contains(&column) { 8000.0 } else { 0.0 };
            let lamp = if row == rows / 4 && column % 12 < 2 { 300.0 } else { 0.0 };
            [sky + sun, sky + 0.8 * sun + lamp, 1.2 * sky + 0.5 * sun].map(|value| value as f32)
        });
        Environment::new(grid, pixels.collect()).unwrap()
    }

    fn materials() -> Vec<Material> {
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        vec![
            Material::Lambert(Lambert::new([0.8, 0.4, 0.1]).unwrap()),
            Material::Phong(Phong::new(150.0, [1.0; 3]).unwrap()),
            Material::Microfacet(Microfacet::new(0.15, [1.0; 3]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(32.0, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.3, metal, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.5, metal, [1.0; 3]).unwrap()),
        ]
    }

    /// Errors relative to the sum over texels of a quarter of the size, in order, at directions and views
    /// spread over the sphere.
    fn errors(
        tree: &LightTree<'_>,
        fine: &Environment,
        material: &Material,
        share: f64,
        dark: f64,
    ) -> Vec<f64> {
        let reference = Reference::at_centres(fine, material, Cull::None);
        let error = |index| {
            let central = spiral(index, 40);
            let view = frame(central).apply(seen(material.centre(), index));
            let found = tree.radiance(material, central, view, share, dark);
            let wanted = reference.radiance(central, view);
            let difference: f64 = (0..3).map(|channel| (found[channel] - wanted[channel]).abs()).sum();
            difference / (wanted.iter().sum::<f64>() + 3.0 * dark)
        };
        let mut errors: Vec<f64> = (0..40).into_par_iter().map(error).collect();
        errors.sort_by(f64::total_cmp);
        errors
    }

    #[test]
    fn the_sum_is_that_of_all_areas_within_the_error_asked_for() {
        // Neither a power of two nor even.
        for rows in [48, 37] {
            let environment = environment(rows);
            let (tree, fine) = (LightTree::new(&environment), subdivided(&environment, 4));
            for material in materials() {
                for share in [0.02, 0.005] {
                    let errors = errors(&tree, &fine, &material, share, 0.01);
                    assert!(
                        errors[20] < 1.25 * share && errors[38] < 5.0 * share,
                        "{rows} {share} {material:?}: {} {}",
                        errors[20],
                        errors[38]
                    );
                }
            }
        }
    }

    fn gold(roughness: f64) -> Material {
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        Material::Ggx(Ggx::new(roughness, metal, [1.0; 3]).unwrap())
    }

    /// A red plastic under the clearcoat that files ask for without its roughness.
    fn lacquer() -> Material {
        let parameters = StandardParameters {
            base_color: [0.6, 0.02, 0.02],
            roughness: 0.5,
            clearcoat: 1.0,
            ..Default::default()
        };
        Material::Standard(Standard::new(parameters).unwrap())
    }

    /// The sum over texels of a sixteenth of the size; within twelve of these about the mirror direction,
    /// over ones of an eighth of that, and again. A tail that falls with the fourth power of the angle is
    /// then exact to 16 / (24 12^2).
    fn finest(
        environment: &Environment,
        material: &Material,
        central: Direction,
        view: Direction,
    ) -> [f64; 3] {
        let to_local = frame(central).matrix().transpose();
        let outgoing = Direction::normalised(to_local * view.vector());
        let to_surface = material.centre().surface_frame(outgoing) * to_local;
        let outgoing = Direction::normalised(to_surface * view.vector());
        let grid = environment.grid();
        // A cell's row and column, their numbers, and the radiance.
        fn add(
            [row, column, height, width]: [usize; 4],
            levels: &[usize],
            central: DVec3,
            flux: &mut impl FnMut(DVec3, f64),
        ) {
            let theta = PI * (row as f64 + 0.5) / height as f64;
            let phi = std::f64::consts::TAU * (0.5 - (column as f64 + 0.5) / width as f64);
            let direction = Direction::from_angles(theta, phi).vector();
            let is_near = (direction - central).length() < 12.0 * PI / height as f64;
            match levels {
                [factor, rest @ ..] if is_near || rest.len() == 2 => {
                    for part in 0..factor * factor {
                        let [row, column] = [factor * row + part / factor, factor * column + part % factor];
                        add([row, column, factor * height, factor * width], rest, central, flux);
                    }
                }
                _ => {
                    let across = 2.0 * theta.sin() * (PI / height as f64 / 2.0).sin();
                    flux(direction, across * std::f64::consts::TAU / width as f64);
                }
            }
        }
        let mut total = [0.0; 3];
        for (texel, radiance) in environment.pixels().iter().enumerate() {
            let cell = [texel / grid.width, texel % grid.width, grid.height, grid.width];
            add(cell, &[16, 8, 8], central.vector(), &mut |direction, solid_angle| {
                let rho_hat = material.rho_hat(Direction::normalised(to_surface * direction), outgoing);
                for channel in 0..3 {
                    total[channel] += f64::from(radiance[channel]) * rho_hat[channel] * solid_angle;
                }
            });
        }
        total
    }

    /// Lobes of 1e-4 to 2e-2 radians under texels of 6e-2: in the sun, beside it, and in the sky.
    #[test]
    fn lobes_narrower_than_a_texel_are_integrated_over_it() {
        let environment = environment(48);
        let tree = LightTree::new(&environment);
        let grid = environment.grid();
        let sun = grid.direction(16, 21).vector();
        let toward = |k: usize| {
            let away = spiral(k, 12).vector();
            Direction::normalised(if k < 8 { sun + 0.015 * k as f64 * away } else { away })
        };
        for material in [gold(0.02), gold(0.05), gold(0.1), lacquer()] {
            let stops = |k: usize| {
                let central = toward(k);
                let view = frame(central).apply(seen(material.centre(), k));
                let found = tree.radiance(&material, central, view, 0.002, 0.01);
                let wanted = finest(&environment, &material, central, view);
                (0..3).map(|c| ((found[c] + 0.01) / (wanted[c] + 0.01)).log2().abs()).fold(0.0, f64::max)
            };
            let stops: Vec<f64> = (0..12).into_par_iter().map(stops).collect();
            assert!(stops.iter().all(|stops| *stops < 0.01), "{material:?}: {stops:?}");
        }
    }

    /// Compares streaks of a brushed surface, 1e-2 radians wide, and cones of a strand, 4e-2, with sums.
    #[test]
    fn a_thin_streak_is_found_away_from_the_central_direction() {
        let environment = environment(48);
        let tree = LightTree::new(&environment);
        let metal = Fresnel::Conductor { n: [0.2, 0.9, 1.1], k: [3.9, 2.4, 2.1] };
        for material in [
            Material::Ggx(Ggx::stretched([0.08, 0.5], metal, [1.0; 3]).unwrap()),
            Material::KajiyaKay(KajiyaKay::new(500.0, [1.0; 3]).unwrap()),
        ] {
            let fine = subdivided(&environment, 16);
            let reference = Reference::at_centres(&fine, &material, Cull::None);
            let stops = |k: usize| {
                let central = spiral(k, 8);
                let view = frame(central).apply(seen(material.centre(), k));
                let found = tree.radiance(&material, central, view, 0.002, 0.01);
                let wanted = reference.radiance(central, view);
                (0..3).map(|c| ((found[c] + 0.01) / (wanted[c] + 0.01)).log2().abs()).fold(0.0, f64::max)
            };
            let stops: Vec<f64> = (0..8).into_par_iter().map(stops).collect();
            assert!(stops.iter().all(|stops| *stops < 0.03), "{material:?}: {stops:?}");
        }
    }

    /// Compares the radiance with a sum over every texel.
    #[test]
    fn a_brushed_surface_has_the_sum_in_its_own_frame() {
        let environment = environment(48);
        let fine = subdivided(&environment, 4);
        let (tree, grid) = (LightTree::new(&environment), fine.grid());
        let brushed = Material::Ward(brdf::Ward::new([0.15, 0.5], [1.0, 0.7, 0.3]).unwrap());
        let view = Direction::normalised(DVec3::new(0.3, -0.8, 0.6));
        let mut errors = Vec::new();
        for index in 0..60 {
            let normal = Direction::normalised(spiral(index, 60).vector() + view.vector()).vector();
            let tangent = (DVec3::Z - normal * normal.z).normalize();
            let frame = DMat3::from_cols(tangent, normal.cross(tangent), normal);
            let local = |direction: DVec3| Direction::normalised(frame.transpose() * direction);
            let mut wanted = [0.0; 3];
            for (texel, radiance) in fine.pixels().iter().enumerate() {
                let (row, column) = (texel / grid.width, texel % grid.width);
                let incident = local(grid.direction(row, column).vector());
                let rho_hat = brushed.rho_hat(incident, local(view.vector()));
                for channel in 0..3 {
                    wanted[channel] +=
                        f64::from(radiance[channel]) * rho_hat[channel] * grid.solid_angle(row);
                }
            }
            let found = tree.surface_radiance(&brushed, frame, view, 0.005, 0.01);
            let difference: f64 = (0..3).map(|channel| (found[channel] - wanted[channel]).abs()).sum();
            errors.push(difference / (wanted.iter().sum::<f64>() + 0.03));
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors[30] < 0.00625 && errors[57] < 0.02, "{} {}", errors[30], errors[57]);
    }

    #[test]
    fn a_black_sky_reflects_nothing() {
        let grid = LatLong::with_rows(16);
        let environment = Environment::new(grid, vec![[0.0; 3]; grid.len()]).unwrap();
        let tree = LightTree::new(&environment);
        let black = tree.radiance(&materials()[0], Direction::Z, Direction::Z, 0.01, 0.0);
        assert_eq!(black, [0.0; 3]);
    }
}
