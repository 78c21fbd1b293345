//! The taps of a material into a scale space of the light (`taps::TapTable`, `taps::FacetTable`):
//!
//! > sum over taps of a M(d, s) + sum over taps about the normal of b H(N, y)
//!
//! In a table by the angle of the view, d lies in the plane of the view's mirror image R and the normal N,
//! turned from R toward N. A material that depends on its tangent has a table over the disc of views, and d
//! is the view mirrored about a facet. M is linear in the variance between two levels, H between two kernels.
//! Look-ups in a cube are bilinear, by [`super::cube`] in both twins: the filters of a device have weights of
//! eight bits, and their own rules at a cube's corners.
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
//! | 1 | the numbers of taps, of taps about the normal, and of rows; the views: 0 by their angle, 1 a quarter of the disc, 2 the disc |
//! | per row and tap 2 | the angle from R toward N, the logarithm to base 2 of the standard deviation; the weight |
//! | per row and tap about the normal 1, after those | the weight, the kernel y |
//!
//! Over a disc each row has as many nodes as there are rows, and it is a node that has taps. In the place of
//! the angle there are two slopes of the facet, along the tangent and across it.

use std::f32::consts::SQRT_2;

use glam::{Mat3, Vec2, Vec3, Vec4};
use taps::{AnyTable, FacetTap, NormalTap, ROWS, ScaleSpace, Tap, Widths};

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

/// The views that a table lies over.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Views {
    /// The angles from the normal.
    Angles = 0,
    /// A quarter of the disc.
    Quarter = 1,
    /// The whole disc.
    Disc = 2,
}

/// The taps of a material, as both twins read them.
#[derive(Clone, Debug)]
pub struct PackedTaps {
    taps: usize,
    normals: usize,
    /// The number of rows.
    rows: usize,
    views: Views,
    elements: Vec<[f32; 4]>,
}

impl PackedTaps {
    /// Packs a table.
    pub fn new(table: AnyTable<'_>) -> Self {
        let (taps, normals) = (table.taps(), table.normals());
        let (rows, views) = match table {
            AnyTable::Angle(_) => (ROWS, Views::Angles),
            AnyTable::View(table) if table.is_quarter() => (table.side(), Views::Quarter),
            AnyTable::View(table) => (table.side(), Views::Disc),
        };
        let mut elements = vec![[taps as f32, normals as f32, rows as f32, f32::from(views as u8)]];
        match table {
            AnyTable::Angle(table) => {
                for row in table.rows() {
                    let tap = |tap: &Tap| tap_elements([tap.delta, math::log2(tap.std), 0.0], tap.weight);
                    elements.extend(row.taps.iter().flat_map(tap));
                    elements.extend(row.normals.iter().map(normal_element));
                }
            }
            AnyTable::View(table) => {
                for node in table.nodes() {
                    let tap = |FacetTap { slope: [p, q], std, weight }: &FacetTap| {
                        tap_elements([*p, *q, math::log2(*std)], *weight)
                    };
                    elements.extend(node.taps.iter().flat_map(tap));
                    elements.extend(node.normals.iter().map(normal_element));
                }
            }
        }
        Self { taps, normals, rows, views, elements }
    }

    /// The elements: the buffer `taps_table` of the shader.
    pub fn elements(&self) -> &[[f32; 4]] {
        &self.elements
    }
}

fn tap_elements(place: [f64; 3], weight: [f64; 3]) -> [[f32; 4]; 2] {
    [place, weight].map(|[x, y, z]| [x as f32, y as f32, z as f32, 0.0])
}

fn normal_element(NormalTap { y, weight: [r, g, b] }: &NormalTap) -> [f32; 4] {
    [*r as f32, *g as f32, *b as f32, *y as f32]
}

/// Radiance toward the viewer, without the lights beside the scale space.
pub fn taps_radiance(levels: &Levels<'_>, table: &PackedTaps, surface: &Surface) -> Vec3 {
    match table.views {
        Views::Angles => by_angle(levels, table, surface),
        Views::Quarter => by_view(levels, table, surface, true),
        Views::Disc => by_view(levels, table, surface, false),
    }
}

/// Radiance by a table over the angles of views.
fn by_angle(levels: &Levels<'_>, table: &PackedTaps, surface: &Surface) -> Vec3 {
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

/// Radiance by a table over the disc of views, or over a quarter of it, in which mirrors change nothing.
fn by_view(levels: &Levels<'_>, table: &PackedTaps, surface: &Surface, is_quarter: bool) -> Vec3 {
    let n = surface.normal;
    let frame = Mat3::from_cols(surface.tangent, n.cross(surface.tangent), n);
    let local = frame.transpose() * surface.view;
    let v = local.with_z(local.z.max(0.0)).normalize();
    let disc = v.truncate() / ((1.0 + v.z) * (1.0 + v.z.sqrt())).sqrt();
    let (mirror, first) = if is_quarter {
        (Vec2::from(disc.to_array().map(|value| if value < 0.0 { -1.0 } else { 1.0 })), 0.0)
    } else {
        (Vec2::ONE, -1.0)
    };
    let last = (table.rows - 1) as f32;
    let position = ((mirror * disc - first) / (1.0 - first)).clamp(Vec2::ZERO, Vec2::ONE) * last;
    let node = position.floor().min(Vec2::splat(last - 1.0));
    let share = position - node;
    let width = 2 * table.taps + table.normals;
    let first = node.y as usize * table.rows + node.x as usize;
    let nodes =
        [0, 1, table.rows, table.rows + 1].map(|step| &table.elements[1 + (first + step) * width..][..width]);
    let mixed = |k: usize| -> Vec4 {
        let [a, b, c, d] = nodes.map(|node| Vec4::from(node[k]));
        let (low, high) = (a + (b - a) * share.x, c + (d - c) * share.x);
        low + (high - low) * share.y
    };
    let mut sum = Vec3::ZERO;
    for k in 0..table.taps {
        let (place, weight) = (mixed(2 * k), mixed(2 * k + 1));
        let h = (mirror * place.truncate().truncate()).extend(1.0);
        let toward = h * (2.0 * v.dot(h) / h.dot(h)) - v;
        sum += weight.truncate() * levels.blurred(frame * toward, place.z);
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
    use crate::CompactTaps;
    use crate::shading::testkit::{ROUNDING, apart, facet_table, scale_space, surfaces, tap_table};
    use sphere::Direction;
    use taps::{SurfaceFrame, Taps};

    /// The edge of the finest level, and the numbers of taps.
    const CASES: [(usize, usize, usize); 4] = [(8, 1, 0), (16, 0, 1), (64, 4, 2), (128, 2, 1)];

    /// Tables by the angle, over a quarter of the disc and over all of it.
    fn tables(taps: usize, normals: usize) -> [CompactTaps; 3] {
        let facets = |is_quarter| CompactTaps::View(facet_table(is_quarter, taps, normals));
        [CompactTaps::Angle(tap_table(taps, normals)), facets(true), facets(false)]
    }

    /// The error of radiance: texels are at most 1 and the weights of a row or node sum up to less than
    /// `size`. A direction is off by some 40 edge roundings in texels, and the place between rows and levels
    /// by some hundred; toward the horizon, where the disc takes the root of a small cosine, by less than
    /// 500.
    fn allowed(edge: usize, packed: &PackedTaps) -> f64 {
        let weights = |row: &[[f32; 4]]| -> f32 {
            let taps = (0..packed.taps).map(|k| row[2 * k + 1]);
            taps.chain(row[2 * packed.taps..].iter().copied()).map(|[r, g, b, _]| r + g + b).sum()
        };
        let rows = packed.elements[1..].chunks(2 * packed.taps + packed.normals);
        let size = f64::from(rows.map(weights).fold(0.0, f32::max));
        ROUNDING * size * (40 * edge + 500) as f64
    }

    #[test]
    fn radiance_matches_the_kernel() {
        for (edge, count, normals) in CASES {
            let scales = scale_space(edge, Vec::new());
            let levels = Levels::new(&scales);
            for table in tables(count, normals) {
                let (table, packed) = (table.table(), PackedTaps::new(table.table()));
                let allowed = allowed(edge, &packed);
                for (surface, [normal, tangent, view]) in surfaces() {
                    let expected = table.reflected(&scales, SurfaceFrame::new(normal, tangent), view);
                    let found = taps_radiance(&levels, &packed, &surface);
                    let off = apart(found, expected);
                    assert!(off < allowed, "{surface:?}: {found} {expected:?}, {off:e} {allowed:e}");
                }
            }
        }
    }

    /// A tangent that is turned by a quarter of a turn turns what a facet sees.
    #[test]
    fn facets_turn_with_the_tangent() {
        let scales = scale_space(64, Vec::new());
        let (levels, table) = (Levels::new(&scales), facet_table(true, 2, 0));
        let packed = PackedTaps::new(AnyTable::View(&table));
        let view = Vec3::new(0.6, 0.0, 0.8);
        let [along, across] = [Vec3::X, Vec3::Y]
            .map(|tangent| taps_radiance(&levels, &packed, &Surface { normal: Vec3::Z, tangent, view }));
        let frame = SurfaceFrame::new(Direction::Z, Direction::Y);
        let view = Direction::normalised(view.as_dvec3());
        assert!(along.distance(across) > 1e-2, "{along} {across}");
        assert!(apart(across, table.radiance(&scales, frame, view)) < 1e-4, "{across}");
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
                let surface = Surface(asked[3u * k].xyz, asked[3u * k + 1u].xyz, asked[3u * k + 2u].xyz);
                return taps_radiance(surface);
            }",
        ]
        .concat();
        let surfaces: Vec<Surface> = surfaces().into_iter().map(|(surface, _)| surface).collect();
        let vectors = surfaces.iter().flat_map(|surface| [surface.normal, surface.tangent, surface.view]);
        let asked: Vec<[f32; 4]> = vectors.map(|v| v.extend(0.0).to_array()).collect();
        for (edge, count, normals) in CASES {
            let scales = scale_space(edge, Vec::new());
            let levels = Levels::new(&scales);
            let elements = levels.elements();
            for table in tables(count, normals) {
                let packed = PackedTaps::new(table.table());
                let [levels_bytes, table_bytes] =
                    [bytemuck::cast_slice(&elements), bytemuck::cast_slice(packed.elements())];
                let buffers: [&[u8]; 8] = [&[], &[], &[], &[], &[], &[], levels_bytes, table_bytes];
                let answers = on_device::answers(&device, &source, &asked, surfaces.len(), &buffers);
                let allowed = allowed(edge, &packed);
                for (surface, found) in surfaces.iter().zip(answers) {
                    let expected = taps_radiance(&levels, &packed, surface).as_dvec3().to_array();
                    let error = apart(found.into(), expected);
                    assert!(error < allowed, "{surface:?}: {found:?} {expected:?}, {error:e} {allowed:e}");
                }
            }
        }
    }
}
