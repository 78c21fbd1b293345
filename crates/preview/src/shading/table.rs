//! A BRDF table at a point of a triangle: B = the sum of c_i(v) L_i [KSS02, eq. 1], with the table's
//! coefficients toward the view there, and the light's in the frame there.
//!
//! The light of a point is interpolated between the triangle's vertices in the coordinates of the mesh, and
//! then turned into the frame of the point, so that frames which differ much between vertices do no harm.
//!
//! The views lie on a parabolic map: x = v_x / (1 + v_z), y alike, row 0 at +y.

use brdf::{BelowHorizon, BrdfTable};
use glam::{UVec2, Vec2, Vec3};

use super::turned_light::{WIDTH, entries, turned_band};

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
    /// The number of materials of the table along the first parameter.
    pub along: u32,
    /// Their number along the second.
    pub across: u32,
}

impl TableUniforms {
    /// The uniforms of a table under a light of so many coefficients.
    pub fn new(table: &BrdfTable, light_rows: usize) -> Self {
        let [along, across] = table.grid().map(|count| count as u32);
        Self {
            size: table.size() as u32,
            rows: table.degree().rows() as u32,
            channels: table.channels() as u32,
            mirrored: u32::from(table.below() == BelowHorizon::Mirrored),
            light_rows: light_rows as u32,
            along,
            across,
        }
    }
}

/// How the light is turned into the frame of a point ([`turned_band`]).
#[derive(Clone, Copy, Debug)]
pub struct Turn<'a> {
    /// The turns about x of all bands from degree 1 on.
    pub quarter_turns: &'a [[f32; 2]],
    /// Cosine and sine of the angles of the frame.
    pub angles: [[f32; 2]; 3],
}

/// The radiance of a point of a triangle toward a view, a unit vector in the frame there, RGB. `values` are
/// the maps [Q, N, N, rows, channels], `lights` those of the triangle's vertices, [light_rows, 3] each, of
/// which the point has these shares. `blend` is where it is between the first material, 0, and the last, 1,
/// along both parameters.
pub fn table_radiance(
    table: TableUniforms,
    values: &[f32],
    (lights, shares): ([&[f32]; 3], [f32; 3]),
    Turn { quarter_turns, angles }: Turn<'_>,
    view: Vec3,
    blend: Vec2,
) -> Vec3 {
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
    let last = UVec2::new(table.along - 1, table.across - 1).as_vec2();
    let q = (blend * last).clamp(Vec2::ZERO, last);
    let (first, share) = (q.as_uvec2(), q.fract());
    let material = first.x * table.across + first.y;
    let both = share.x * share.y;
    // The three other materials about q, with the shares that they have in the blend of those up to them.
    let others = [
        (material + table.across, share.x),
        (material + 1, (share.y - both) / (1.0 - both)),
        (material + table.across + 1, both),
    ];
    let coefficient = |i: usize| {
        let of = |material: u32| {
            let mut c = Vec3::ZERO;
            for (row, column, weight) in taps {
                let texel = ((material * table.size + row) * table.size + column) as usize;
                let value = &values[(texel * rows + i) * channels..][..channels];
                c += weight * if let [r, g, b] = *value { Vec3::new(r, g, b) } else { Vec3::splat(value[0]) };
            }
            c
        };
        let mut c = of(material);
        for (other, share) in others {
            if share > 0.0 {
                c += share * (of(other) - c);
            }
        }
        c
    };
    let light = |i: usize| {
        let of = |light: &[f32]| Vec3::from_slice(&light[3 * i..][..3]);
        shares[0] * of(lights[0]) + shares[1] * of(lights[1]) + shares[2] * of(lights[2])
    };
    let known = rows.min(light_rows);
    let mut radiance = coefficient(0) * light(0);
    let (mut l, mut entry) = (1, 0);
    while l * l < known {
        let mut band = [Vec3::ZERO; WIDTH];
        (0..=2 * l).for_each(|row| band[row] = light(l * l + row));
        let band = turned_band(l, &quarter_turns[entry..], angles, band);
        radiance += (0..=2 * l).map(|row| coefficient(l * l + row) * band[row]).sum::<Vec3>();
        (l, entry) = (l + 1, entry + entries(l));
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
