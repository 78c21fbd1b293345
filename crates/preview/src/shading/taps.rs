//! The taps of a material into a scale space of the light (`taps::TapTable`):
//!
//! > sum over taps of a M(d, s) + sum over taps about the normal of b H(N, y)
//!
//! d lies in the plane of the view's mirror image R and the normal N, turned from R toward N. M is linear in
//! the variance between two levels, H between two kernels. Look-ups in a cube are bilinear, by
//! [`super::cube`] in both twins: the filters of a device have weights of eight bits, and their own rules at
//! a cube's corners.
//!
//! The elements of the light, of four f32:
//!
//! | elements | what |
//! | --- | --- |
//! | 1 | the logarithm to base 2 of the standard deviation of the sharpest level; the numbers of kernels and of levels |
//! | per cube 1 | the place of its texels, its edge; the kernels about the normal first, then the levels |
//! | per texel 1 | its radiance, faces and rows in the order of `sphere::Cube` |
//!
//! The elements of the material, of four f32:
//!
//! | elements | what |
//! | --- | --- |
//! | 1 | the numbers of taps, of taps about the normal, and of rows |
//! | per row and tap 2 | the angle from R toward N, the logarithm to base 2 of the standard deviation; the weight |
//! | per row and tap about the normal 1, after those | the weight, the kernel y |

use std::f32::consts::SQRT_2;

use glam::{Vec3, Vec4};
use taps::{ROWS, ScaleSpace, TapTable, Widths};

use super::cube;
use super::surface::{Surface, unit_or};

/// A scale space, as both twins read it.
#[derive(Clone, Debug)]
pub struct Levels<'a> {
    sharpest: f32,
    /// The number of kernels about the normal.
    kernels: usize,
    /// The edge and the texels of each cube: the kernels, then the levels.
    cubes: Vec<(u32, &'a [[f32; 3]])>,
}

impl<'a> Levels<'a> {
    /// The levels of a scale space.
    pub fn new(scales: &'a ScaleSpace) -> Self {
        let cubes = scales.normals().iter().chain(scales.levels());
        Self {
            sharpest: math::log2(scales.widths().std(0)) as f32,
            kernels: scales.normals().len(),
            cubes: cubes.map(|map| (map.cube().edge as u32, map.pixels())).collect(),
        }
    }

    /// The elements: the buffer `taps_levels` of the shader.
    pub fn elements(&self) -> Vec<[f32; 4]> {
        let (kernels, levels) = (self.kernels, self.cubes.len() - self.kernels);
        let mut elements = vec![[self.sharpest, kernels as f32, levels as f32, 0.0]];
        let mut place = 1 + self.cubes.len();
        for (edge, texels) in &self.cubes {
            // An f32 holds each place: there are fewer than 2^24 texels of the largest edge.
            elements.push([place as f32, *edge as f32, 0.0, 0.0]);
            place += texels.len();
        }
        let texels = self.cubes.iter().flat_map(|(_, texels)| texels.iter());
        elements.extend(texels.map(|[r, g, b]| [*r, *g, *b, 0.0]));
        elements
    }

    /// A bilinear look-up in a cube.
    fn cube(&self, index: usize, direction: Vec3) -> Vec3 {
        let (edge, texels) = self.cubes[index];
        cube::sample(edge, texels, direction)
    }

    /// The light about a normal: linear between two kernels.
    fn about_normal(&self, normal: Vec3, y: f32) -> Vec3 {
        let last = (self.kernels - 1) as f32;
        let place = (y * last).clamp(0.0, last - 1e-6);
        let low = place as usize;
        let a = self.cube(low, normal);
        a + (self.cube(low + 1, normal) - a) * (place - low as f32)
    }

    /// The light, blurred by a Gaussian with the logarithm `width` of its standard deviation: linear in the
    /// variance between two levels.
    fn blurred(&self, direction: Vec3, width: f32) -> Vec3 {
        let last = (self.cubes.len() - self.kernels - 1) as f32;
        let place = (Widths::PER_OCTAVE as f32 * (width - self.sharpest)).clamp(0.0, last - 1e-3);
        let low = place as usize;
        let share = (math::exp2(0.5 * (place - low as f32)) - 1.0) * (1.0 + SQRT_2);
        let first = self.kernels + low;
        let a = self.cube(first, direction);
        a + (self.cube(first + 1, direction) - a) * share
    }
}

/// The taps of a material, as both twins read them.
#[derive(Clone, Debug)]
pub struct PackedTaps {
    taps: usize,
    normals: usize,
    elements: Vec<[f32; 4]>,
}

impl PackedTaps {
    /// Packs a table.
    pub fn new(table: &TapTable) -> Self {
        let (taps, normals) = (table.taps(), table.normals());
        let mut elements = vec![[taps as f32, normals as f32, ROWS as f32, 0.0]];
        for row in table.rows() {
            for tap in &row.taps {
                let [r, g, b] = tap.weight.map(|weight| weight as f32);
                elements.push([tap.delta as f32, math::log2(tap.std) as f32, 0.0, 0.0]);
                elements.push([r, g, b, 0.0]);
            }
            for tap in &row.normals {
                let [r, g, b] = tap.weight.map(|weight| weight as f32);
                elements.push([r, g, b, tap.y as f32]);
            }
        }
        Self { taps, normals, elements }
    }

    /// The elements: the buffer `taps_table` of the shader.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }
}

/// Radiance toward the viewer, without the lights beside the scale space.
pub fn taps_radiance(levels: &Levels<'_>, table: &PackedTaps, surface: &Surface) -> Vec3 {
    let n = surface.normal;
    let cosine = n.dot(surface.view).max(0.0);
    let r = (n * (2.0 * cosine) - surface.view).normalize();
    let toward = unit_or(n - r * cosine, Vec3::ZERO);
    let last = ROWS - 1;
    let position = (1.0 - cosine).clamp(0.0, 1.0) * last as f32;
    let row = (position as usize).min(last - 1);
    let share = position - row as f32;
    let width = 2 * table.taps + table.normals;
    let [low, high] = [row, row + 1].map(|row| &table.elements[1 + row * width..][..width]);
    let mixed = |k: usize| -> Vec4 {
        let [low, high] = [low[k], high[k]].map(Vec4::from);
        low + (high - low) * share
    };
    let mut sum = Vec3::ZERO;
    for k in 0..table.taps {
        let (place, weight) = (mixed(2 * k), mixed(2 * k + 1));
        let (sine, cosine) = math::sin_cos(place.x);
        sum += weight.truncate() * levels.blurred(cosine * r + sine * toward, place.y);
    }
    for k in 0..table.normals {
        let tap = mixed(2 * table.taps + k);
        sum += tap.truncate() * levels.about_normal(n, tap.w);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shading::testkit::{ROUNDING, apart, scale_space, surfaces, tap_table};

    /// The edge of the finest level, and the numbers of taps.
    const CASES: [(usize, usize, usize); 4] = [(8, 1, 0), (16, 0, 1), (64, 4, 2), (128, 2, 1)];

    /// The error of radiance: texels are at most 1 and the weights of a row sum up to less than `size`. A
    /// direction is off by some 40 edge roundings in texels, and the place between rows and levels by some
    /// hundred.
    fn allowed(edge: usize, table: &TapTable) -> f64 {
        let weights = |row: &taps::TapRow| {
            let taps = row.taps.iter().map(|tap| tap.weight);
            taps.chain(row.normals.iter().map(|tap| tap.weight)).flatten().sum()
        };
        let size = table.rows().iter().map(weights).fold(0.0, f64::max);
        ROUNDING * size * (40 * edge + 500) as f64
    }

    #[test]
    fn radiance_matches_the_kernel() {
        for (edge, count, normals) in CASES {
            let (scales, table) = (scale_space(edge, Vec::new()), tap_table(count, normals));
            let (levels, packed) = (Levels::new(&scales), PackedTaps::new(&table));
            let allowed = allowed(edge, &table);
            for (surface, [normal, _, view]) in surfaces() {
                let expected = table.radiance(&scales, normal, view);
                let found = taps_radiance(&levels, &packed, &surface);
                assert!(apart(found, expected) < allowed, "{surface:?}: {found} {expected:?}, {allowed:e}");
            }
        }
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_matches_its_twin() {
        use crate::shading::on_device;
        let Some(device) = on_device::device("the_shader_matches_its_twin") else { return };
        let source = [
            include_str!("surface.wgsl"),
            include_str!("cube.wgsl"),
            include_str!("taps.wgsl"),
            "fn answer(k: u32) -> vec3f {
                return taps_radiance(Surface(asked[2u * k].xyz, vec3f(0.0), asked[2u * k + 1u].xyz));
            }",
        ]
        .concat();
        let surfaces: Vec<Surface> = surfaces().into_iter().map(|(surface, _)| surface).collect();
        let vectors = surfaces.iter().flat_map(|surface| [surface.normal, surface.view]);
        let asked: Vec<[f32; 4]> = vectors.map(|v| v.extend(0.0).to_array()).collect();
        for (edge, count, normals) in CASES {
            let (scales, table) = (scale_space(edge, Vec::new()), tap_table(count, normals));
            let (levels, packed) = (Levels::new(&scales), PackedTaps::new(&table));
            let elements = levels.elements();
            let [levels_bytes, table_bytes] =
                [bytemuck::cast_slice(&elements), bytemuck::cast_slice(packed.elements())];
            let buffers: [&[u8]; 8] = [&[], &[], &[], &[], &[], &[], levels_bytes, table_bytes];
            let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
            let allowed = allowed(edge, &table);
            for (surface, found) in surfaces.iter().zip(answers) {
                let expected = taps_radiance(&levels, &packed, surface).as_dvec3().to_array();
                let error = apart(found.into(), expected);
                assert!(error < allowed, "{surface:?}: {found:?} {expected:?}, {allowed:e}");
            }
        }
    }
}
