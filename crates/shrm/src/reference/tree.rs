//! The same integral to a stated error, for single directions: light in a tree of blocks.
//!
//! A block of texels reflects about what its light would from the mean direction of that light. How far that
//! is off shows once the block is split: the parts reflect something else. So the sum begins with few blocks
//! and splits the one whose parts differ most, until what is left is below the error asked for. Blocks are
//! small from the start where a lobe may be narrower than they are: about the central direction, in
//! proportion to the angle from it. A highlight elsewhere (a grazing one lies lower than R) is wide in
//! proportion to that angle, too, so it is seen.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

use brdf::Material;
use envmap::Environment;
use rayon::prelude::*;
use sphere::{DMat3, DVec3, Direction};

use crate::frame;

/// Rows of the finest level. What finer texels hold lies at their mean direction: a sun stays where it is.
const ROWS: usize = 1024;

/// Rows of the coarsest level.
const COARSEST: usize = 4;

/// A block is split beforehand if its height is more than this share of its angle from the central direction.
const NEAR: f64 = 0.8;

/// The share of what its top reflects by which a block at the horizon may be off.
const ABOVE: f64 = 0.1;

/// The share of a block's error that each of its parts is expected to have at least: where one split makes no
/// difference by chance, the next one may.
const INHERITED: f64 = 0.05;

/// An environment in blocks of blocks.
#[derive(Debug)]
pub struct LightTree {
    /// The coarsest first.
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    /// Of a block, in radians.
    extent: f64,
    blocks: Vec<Block>,
}

/// Light that comes from one block.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Radiance times solid angle.
    flux: [f32; 3],
    /// The mean direction, of length 1 or less: the shorter, the wider the light is spread.
    direction: [f32; 3],
}

impl Block {
    fn new(flux: [f64; 3], weighted: DVec3) -> Self {
        let weight = flux.iter().sum::<f64>();
        let direction = if weight > 0.0 { weighted / weight } else { DVec3::ZERO };
        Self { flux: flux.map(|value| value as f32), direction: direction.as_vec3().to_array() }
    }

    fn direction(&self) -> DVec3 {
        DVec3::from_array(self.direction.map(f64::from))
    }

    fn flux(&self) -> [f64; 3] {
        self.flux.map(f64::from)
    }

    fn is_dark(&self) -> bool {
        self.flux == [0.0; 3]
    }
}

impl Level {
    /// Blocks of a grid of light, `rows` x `columns` to each.
    fn new(width: usize, height: usize, extent: f64, part: impl Fn(usize) -> Parts + Sync) -> Self {
        let block = |index: usize| {
            let (mut flux, mut weighted) = ([0.0; 3], DVec3::ZERO);
            for (own, direction) in part(index) {
                (0..3).for_each(|channel| flux[channel] += own[channel]);
                weighted += direction * own.iter().sum::<f64>();
            }
            Block::new(flux, weighted)
        };
        let blocks = (0..width * height).into_par_iter().map(block).collect();
        Self { width, height, extent, blocks }
    }
}

/// The light of the parts of a block, each with its direction.
type Parts = Vec<([f64; 3], DVec3)>;

/// The indices of the blocks or texels below a block, `factor` x `factor` or fewer at the end of a row or a
/// column.
fn below(index: usize, own: usize, below: [usize; 2], factor: usize) -> impl Iterator<Item = usize> {
    let [width, height] = below;
    let (row, column) = (index / own * factor, index % own * factor);
    (row..(row + factor).min(height))
        .flat_map(move |row| (column..(column + factor).min(width)).map(move |column| row * width + column))
}

impl LightTree {
    /// The tree of an environment.
    pub fn new(environment: &Environment) -> Self {
        let grid = environment.grid();
        let factor = grid.height.div_ceil(ROWS);
        let texel = |index: usize| {
            let (row, column) = (index / grid.width, index % grid.width);
            let solid_angle = grid.solid_angle(row);
            let radiance = environment.pixels()[index];
            (radiance.map(|value| f64::from(value) * solid_angle), grid.direction(row, column).vector())
        };
        let [width, height] = [grid.width, grid.height].map(|size| size.div_ceil(factor));
        let finest = Level::new(width, height, factor as f64 * PI / grid.height as f64, |index| {
            below(index, width, [grid.width, grid.height], factor).map(texel).collect()
        });
        let mut levels = vec![finest];
        while let Some(last) = levels.last().filter(|last| last.height > COARSEST) {
            let [width, height] = [last.width, last.height].map(|size| size.div_ceil(2));
            levels.push(Level::new(width, height, 2.0 * last.extent, |index| {
                let block = |part: usize| (last.blocks[part].flux(), last.blocks[part].direction());
                below(index, width, [last.width, last.height], 2).map(block).collect()
            }));
        }
        levels.reverse();
        Self { levels }
    }

    /// B(C, V), RGB, as [`super::Reference::radiance`] has it. The error is estimated: most results are
    /// within about `share` of the sum of B and `dark`, the radiance below which nothing is seen, and 95 of
    /// 100 within four times that.
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
        self.sum(material, to_surface, (central, view), share, dark)
    }

    /// The same for a surface that may be brushed: `frame` has its tangent, N x tangent, and its normal N as
    /// columns, in the world.
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
        self.sum(material, frame.transpose(), (central, view), share, dark)
    }

    fn sum(
        &self,
        material: &Material,
        to_surface: DMat3,
        (central, view): (Direction, Direction),
        share: f64,
        dark: f64,
    ) -> [f64; 3] {
        let outgoing = Direction::normalised(to_surface * view.vector());
        let mut sum = Sum {
            tree: self,
            material,
            to_surface,
            outgoing,
            open: BinaryHeap::new(),
            total: [0.0; 3],
            left: 0.0,
        };
        sum.begin(central.vector());
        let enough =
            |sum: &Sum<'_>| sum.left.max(0.0).sqrt() <= share * (sum.total.iter().sum::<f64>() + 3.0 * dark);
        while !enough(&sum) && sum.split_worst() {}
        sum.total
    }

    /// The blocks below one.
    fn parts(&self, level: usize, index: usize) -> impl Iterator<Item = usize> {
        let (own, next) = (&self.levels[level], &self.levels[level + 1]);
        below(index, own.width, [next.width, next.height], 2)
    }
}

/// A sum in work.
struct Sum<'a> {
    tree: &'a LightTree,
    material: &'a Material,
    to_surface: DMat3,
    outgoing: Direction,
    /// The blocks that may be split.
    open: BinaryHeap<Open>,
    total: [f64; 3],
    /// The sum of the squared errors of these blocks, which are as often above as below.
    left: f64,
}

/// A block whose parts count in the sum.
struct Open {
    error: f64,
    level: usize,
    index: usize,
    /// What its parts reflect.
    parts: [[f64; 3]; 4],
}

impl Sum<'_> {
    /// Adds the coarsest blocks, and smaller ones about the central direction.
    fn begin(&mut self, central: DVec3) {
        let mut blocks: Vec<(usize, usize)> =
            (0..self.tree.levels[0].blocks.len()).map(|index| (0, index)).collect();
        while let Some((level, index)) = blocks.pop() {
            let (own, block) = (&self.tree.levels[level], self.tree.levels[level].blocks[index]);
            if block.is_dark() {
                continue;
            }
            let last = level + 1 == self.tree.levels.len();
            let angle = math::acos(block.direction().normalize_or_zero().dot(central).clamp(-1.0, 1.0));
            if !last && own.extent > NEAR * angle {
                blocks.extend(self.tree.parts(level, index).map(|part| (level + 1, part)));
            } else {
                let reflected = self.reflected(&block);
                (0..3).for_each(|channel| self.total[channel] += reflected[channel]);
                self.open(level, index, reflected, 0.0);
            }
        }
    }

    /// What a block reflects from its mean direction.
    fn reflected(&self, block: &Block) -> [f64; 3] {
        if block.is_dark() {
            return [0.0; 3];
        }
        let incident = Direction::normalised(self.to_surface * block.direction());
        let (rho_hat, flux) = (self.material.rho_hat(incident, self.outgoing), block.flux());
        std::array::from_fn(|channel| rho_hat[channel] * flux[channel])
    }

    /// Replaces what a block reflects by what its parts do. `above` is the error of the block that it is part
    /// of.
    fn open(&mut self, level: usize, index: usize, whole: [f64; 3], above: f64) {
        if level + 1 == self.tree.levels.len() {
            return;
        }
        let mut parts = [[0.0; 3]; 4];
        let mut difference = whole.map(|value| -value);
        for (value, part) in parts.iter_mut().zip(self.tree.parts(level, index)) {
            *value = self.reflected(&self.tree.levels[level + 1].blocks[part]);
            (0..3).for_each(|channel| difference[channel] += value[channel]);
        }
        (0..3).for_each(|channel| self.total[channel] += difference[channel]);
        let error = difference.iter().map(|value| value.abs()).sum::<f64>();
        let error = error.max(self.above_horizon(level, index)).max(INHERITED * above);
        if error > 0.0 && level + 2 < self.tree.levels.len() {
            self.left += math::powi(error, 2);
            self.open.push(Open { error, level, index, parts });
        }
    }

    /// What the part of a block above the horizon may reflect, of a block whose mean direction lies about
    /// there or lower: none of its parts need see it.
    fn above_horizon(&self, level: usize, index: usize) -> f64 {
        let (level, block) = (&self.tree.levels[level], self.tree.levels[level].blocks[index]);
        let direction = (self.to_surface * block.direction()).normalize_or_zero();
        if direction.z.abs() > level.extent {
            return 0.0;
        }
        let top = Direction::normalised(direction.with_z(direction.z + level.extent));
        let (rho_hat, flux) = (self.material.rho_hat(top, self.outgoing), block.flux());
        ABOVE * (0..3).map(|channel| rho_hat[channel].abs() * flux[channel]).sum::<f64>()
    }

    /// Splits the parts of the block whose error is the largest; false if there is none.
    fn split_worst(&mut self) -> bool {
        let Some(worst) = self.open.pop() else { return false };
        self.left -= math::powi(worst.error, 2);
        for (part, reflected) in self.tree.parts(worst.level, worst.index).zip(worst.parts) {
            self.open(worst.level + 1, part, reflected, worst.error);
        }
        true
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error
            .total_cmp(&other.error)
            .then_with(|| (self.level, self.index).cmp(&(other.level, other.index)))
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
    use brdf::{Fresnel, Ggx, KajiyaKay, Lambert, Microfacet, Phong};

    use sphere::{LatLong, spiral};

    use super::*;
    use crate::degrees::seen;
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
            Material::Ggx(Ggx::new(0.1, metal, [1.0; 3]).unwrap()),
            Material::Ggx(Ggx::new(0.5, metal, [1.0; 3]).unwrap()),
        ]
    }

    /// Errors relative to the plain sum, in order, at directions and views spread over the sphere.
    fn errors(
        tree: &LightTree,
        environment: &Environment,
        material: &Material,
        share: f64,
        dark: f64,
    ) -> Vec<f64> {
        let reference = Reference::new(environment, material, Cull::None);
        let mut errors: Vec<f64> = (0..100)
            .map(|index| {
                let central = spiral(index, 100);
                let view = frame(central).apply(seen(material.centre(), index));
                let found = tree.radiance(material, central, view, share, dark);
                let wanted = reference.radiance(central, view);
                let difference: f64 = (0..3).map(|channel| (found[channel] - wanted[channel]).abs()).sum();
                difference / (wanted.iter().sum::<f64>() + 3.0 * dark)
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        errors
    }

    #[test]
    fn the_sum_is_that_of_all_texels_within_the_error_asked_for() {
        // Neither a power of two nor even.
        for rows in [96, 77] {
            let environment = environment(rows);
            let tree = LightTree::new(&environment);
            for material in materials() {
                for share in [0.02, 0.005] {
                    let errors = errors(&tree, &environment, &material, share, 0.01);
                    assert!(
                        errors[50] < 1.25 * share && errors[95] < 4.0 * share,
                        "{rows} {share} {material:?}: {} {}",
                        errors[50],
                        errors[95]
                    );
                }
            }
        }
    }

    #[test]
    fn asked_for_no_error_it_reads_every_texel() {
        let environment = environment(24);
        let tree = LightTree::new(&environment);
        for material in materials() {
            assert!(errors(&tree, &environment, &material, 0.0, 0.0)[99] < 1e-5, "{material:?}");
        }
    }

    /// The oracle adds every texel.
    #[test]
    fn a_brushed_surface_has_the_sum_in_its_own_frame() {
        let environment = environment(48);
        let (tree, grid) = (LightTree::new(&environment), environment.grid());
        let brushed = Material::Ward(brdf::Ward::new([0.15, 0.5], [1.0, 0.7, 0.3]).unwrap());
        let view = Direction::normalised(DVec3::new(0.3, -0.8, 0.6));
        let mut errors = Vec::new();
        for index in 0..60 {
            let normal = Direction::normalised(spiral(index, 60).vector() + view.vector()).vector();
            let tangent = (DVec3::Z - normal * normal.z).normalize();
            let frame = DMat3::from_cols(tangent, normal.cross(tangent), normal);
            let local = |direction: DVec3| Direction::normalised(frame.transpose() * direction);
            let mut wanted = [0.0; 3];
            for (texel, radiance) in environment.pixels().iter().enumerate() {
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
    fn the_light_of_a_large_image_is_all_there() {
        let grid = LatLong { width: 8, height: 2 * ROWS + 3 };
        let environment = Environment::new(grid, vec![[1.0, 2.0, 3.0]; grid.len()]).unwrap();
        let tree = LightTree::new(&environment);
        assert!(tree.levels.last().unwrap().height <= ROWS);
        let flux: f64 = tree.levels[0].blocks.iter().map(|block| f64::from(block.flux[1])).sum();
        assert!((flux - 8.0 * PI).abs() < 1e-4, "{flux}");
    }

    #[test]
    fn a_black_sky_reflects_nothing() {
        let grid = LatLong::with_rows(16);
        let tree = LightTree::new(&Environment::new(grid, vec![[0.0; 3]; grid.len()]).unwrap());
        let black = tree.radiance(&materials()[0], Direction::Z, Direction::Z, 0.01, 0.0);
        assert_eq!(black, [0.0; 3]);
    }
}
