//! A BRDF table at a vertex: B = the sum of c_i(v) L_i [KSS02, eq. 1], with the table's coefficients toward
//! the view and the light's in the frame of the vertex.
//!
//! The CPU shades vertices with the kernels of `transfer`. These functions are the shader's formulas one by
//! one, which the tests hold against both. The views lie on a parabolic map: x = v_x / (1 + v_z), y alike,
//! row 0 at +y.

use brdf::{BelowHorizon, BrdfTable};
use glam::Vec3;

/// The struct `TableUniforms` of table.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "gpu", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub struct TableUniforms {
    /// The edge N of the map, which has N x N views.
    pub size: u32,
    /// The number of coefficients of a view.
    pub rows: u32,
    /// 1 if the table is grey, else 3.
    pub channels: u32,
    /// 1 if a view from below the horizon is looked up at its mirror image, 0 if at the horizon.
    pub mirrored: u32,
    /// The number of coefficients of a channel of the light.
    pub light_rows: u32,
    /// The number Q of materials of the table.
    pub count: u32,
}

impl TableUniforms {
    /// The uniforms of a table under a light of so many coefficients.
    pub fn new(table: &BrdfTable, light_rows: usize) -> Self {
        Self {
            size: table.size() as u32,
            rows: table.degree().rows() as u32,
            channels: table.channels() as u32,
            mirrored: u32::from(table.below() == BelowHorizon::Mirrored),
            light_rows: light_rows as u32,
            count: table.count() as u32,
        }
    }
}

/// The radiance of a vertex toward a view, a unit vector in its frame, RGB. `values` are the maps [Q, N, N,
/// rows, channels], `light` the vertex' light [3, light_rows]; `blend` is where the vertex is between the
/// first material, 0, and the last, 1.
pub fn table_radiance(table: TableUniforms, values: &[f32], light: &[f32], view: Vec3, blend: f32) -> Vec3 {
    let z = if table.mirrored == 1 { view.z.abs() } else { view.z.max(0.0) };
    let across = if z > 0.0 { 1.0 + z } else { view.truncate().length().max(1e-30) };
    let (column, row) = (place(table, view.x, across), place(table, -view.y, across));
    let taps = [
        (row.first, column.first, (1.0 - column.share) * (1.0 - row.share)),
        (row.first, column.second, column.share * (1.0 - row.share)),
        (row.second, column.first, (1.0 - column.share) * row.share),
        (row.second, column.second, column.share * row.share),
    ];
    let [rows, channels, light_rows] =
        [table.rows, table.channels, table.light_rows].map(|count| count as usize);
    let last = (table.count - 1) as f32;
    let q = (blend * last).clamp(0.0, last);
    let (first, share) = (q as u32, q.fract());
    let mut radiance = Vec3::ZERO;
    for i in 0..rows.min(light_rows) {
        for channel in 0..3 {
            let value = |material: u32, row: u32, column: u32| {
                let texel = ((material * table.size + row) * table.size + column) as usize;
                values[(texel * rows + i) * channels + channel.min(channels - 1)]
            };
            let of = |material: u32| -> f32 {
                taps.iter().map(|&(row, column, weight)| weight * value(material, row, column)).sum()
            };
            let mut c = of(first);
            if share > 0.0 {
                c += share * (of(first + 1) - c);
            }
            radiance[channel] += c * light[channel * light_rows + i];
        }
    }
    radiance
}

/// The place of a coordinate between two texels: the first, the second, and the share of the second.
struct Place {
    first: u32,
    second: u32,
    share: f32,
}

fn place(table: TableUniforms, along: f32, across: f32) -> Place {
    let at = (0.5 * (along / across + 1.0) * table.size as f32 - 0.5).clamp(0.0, (table.size - 1) as f32);
    let first = at as u32;
    Place { first, second: (first + 1).min(table.size - 1), share: at - first as f32 }
}

#[cfg(test)]
mod tests;
