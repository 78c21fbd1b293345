//! Samples of the product of light and material, and their density in a direction.
//!
//! On a device, the tables of a view ([`super::product_tables`]) give the distribution of blocks of the
//! sphere for the cell of a surface's normal. A point of the unit square goes through five distributions: a
//! row of blocks, a block, a row of texels in it, a texel of that row by the light's own distribution
//! ([`super::light_samples`]), and the uniform one inside the texel. Each is monotone, so that even points
//! stay even. The density comes from the same f32 steps.

use glam::Vec3;
use sampling::ProductSampler;

use super::light_samples::{LightSample, LightSamples};
use super::product_tables::{self, ProductTables, ViewAxes, block_of, block_start};
use super::shader_constants::shader_constants;
use super::surface::Surface;
use crate::Shot;

shader_constants!("PRODUCT_SAMPLES_":
    /// The number of light samples before those that follow the product, on a device: while the view changes,
    /// a slow device draws no more, and makes no tables.
    pub FIRST: u32 = 4;
    /// The share of samples that follow the product, if there is a sampler of it.
    pub(crate) SHARE: f32 = 0.9;
);

/// The number of light samples of a pixel from which on it is worth following the product on the CPU. With
/// fewer, devices follow none either, so that both draw the same samples.
const MIN_SAMPLES: u32 = 256;

/// Whether a shot takes so many samples that it is worth following the product.
pub(crate) fn is_worth(shot: &Shot) -> bool {
    shot.light_samples.saturating_mul(shot.samples.clamp(1, 4).pow(2)) >= MIN_SAMPLES
}

/// The text of the shader: its constants, those of the tables, and product_samples.wgsl.
pub fn shader() -> String {
    [product_tables::constants(), WGSL_CONSTANTS, include_str!("product_samples.wgsl")].concat()
}

/// Draws directions that follow the product of light and material, in the light's frame.
pub trait ProductDirections {
    /// The sample for a point of the unit square.
    fn sample(&self, light: &LightSamples, point: [f32; 2]) -> LightSample;

    /// The density of [`ProductDirections::sample`] at a direction, in 1/sr; `lit` is the light from there.
    fn density(&self, light: &LightSamples, direction: Vec3, lit: &LightSample) -> f32;
}

impl ProductDirections for ProductSampler {
    fn sample(&self, light: &LightSamples, point: [f32; 2]) -> LightSample {
        light.at(Vec3::from_array(ProductSampler::sample(self, point).direction))
    }

    fn density(&self, _: &LightSamples, direction: Vec3, _: &LightSample) -> f32 {
        ProductSampler::density(self, direction.to_array())
    }
}

/// The table of a cell of normals.
#[derive(Debug)]
pub struct ProductCell<'a> {
    tables: &'a ProductTables,
    table: Vec<f32>,
}

impl<'a> ProductCell<'a> {
    /// The table for a surface, as a device makes it for a view.
    pub fn new(tables: &'a ProductTables, axes: ViewAxes, surface: &Surface) -> Self {
        Self { tables, table: tables.table(axes, tables.cell(axes, surface)) }
    }

    /// The distribution of the blocks of a row.
    fn blocks(&self, row: usize) -> &[f32] {
        let [rows, columns] = self.tables.blocks();
        &self.table[rows + 1 + row * (columns + 1)..][..columns + 1]
    }
}

impl ProductDirections for ProductCell<'_> {
    fn sample(&self, light: &LightSamples, point: [f32; 2]) -> LightSample {
        let ([rows, columns], [width, height]) = (self.tables.blocks(), light.size());
        let [mut x, mut y] = point;
        let row = draw(&self.table, rows, &mut y);
        let column = draw(self.blocks(row), columns, &mut x);
        let [first, end] = [row, row + 1].map(|row| block_start(row, rows, height));
        let of_rows = self.tables.texel_rows([row, column], first);
        let texel_row = first + draw(of_rows, end - first, &mut y);
        let columns = [column, column + 1].map(|column| block_start(column, columns, width));
        light.sample_between(texel_row, columns[0]..columns[1], [x, y])
    }

    fn density(&self, light: &LightSamples, _: Vec3, lit: &LightSample) -> f32 {
        let ([rows, columns], [width, height]) = (self.tables.blocks(), light.size());
        let [texel_row, texel] = lit.texel.map(|place| place as usize);
        let (row, column) = (block_of(texel_row, rows, height), block_of(texel, columns, width));
        let of_rows = self.tables.texel_rows([row, column], texel_row);
        let columns = [column, column + 1].map(|column| block_start(column, columns, width));
        step(&self.table, row)
            * step(self.blocks(row), column)
            * step(of_rows, 0)
            * light.density_between(texel_row, columns[0]..columns[1], texel)
    }
}

fn step(distribution: &[f32], place: usize) -> f32 {
    distribution[place + 1] - distribution[place]
}

/// The last of `count` places whose distribution is at most `share`, which becomes the share inside it.
fn draw(distribution: &[f32], count: usize, share: &mut f32) -> usize {
    let (mut place, mut left) = (0, count);
    while left > 1 {
        let middle = place + left / 2;
        if distribution[middle] <= *share {
            place = middle;
        }
        left -= left / 2;
    }
    let inside = (*share - distribution[place]) / step(distribution, place).max(1e-30);
    *share = inside.clamp(0.0, 1.0 - f32::EPSILON / 2.0);
    place
}
