//! Texels and leaves, one grid laid over the other: the pieces in which light is constant and that lie in
//! one leaf.
//!
//! Rows of pieces end at the parallels of texels (equal in theta) and of leaves (equal in z), columns at
//! the meridians of both. A leaf's edge that is nearer than a thousandth of a texel to a texel's takes its
//! place: leaves of the product are flat or have their masses by piece, so that nothing depends on where
//! exactly they end. No piece reaches over the equator or over an angle of pi/4 from the nearest axis.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use sphere::LatLong;

use crate::LeafGrid;
use crate::leaf_grid::sin_cos;

/// A leaf's edge nearer than this to a texel's edge is that edge, in the smaller of both.
const SNAP: f64 = 1e-3;

/// Pieces between two parallels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PieceRow {
    /// The row of texels.
    pub(crate) texel: usize,
    /// The row of leaves.
    pub(crate) leaf: usize,
    pub(crate) is_south: bool,
    /// 1 - |z| of the row's edges, from the nearer pole.
    pub(crate) near: f64,
    pub(crate) far: f64,
}

impl PieceRow {
    /// The height in z.
    pub(crate) fn height(&self) -> f64 {
        self.far - self.near
    }
}

/// Pieces between two meridians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PieceColumn {
    /// The column of texels.
    pub(crate) texel: usize,
    /// The column of leaves.
    pub(crate) leaf: usize,
    /// phi of the column's edges, in turns.
    pub(crate) start: f64,
    pub(crate) end: f64,
}

impl PieceColumn {
    /// The width in radians.
    pub(crate) fn width(&self) -> f64 {
        (self.end - self.start) * TAU
    }
}

/// A place: a piece, and the fractions of it that lie north and west.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PiecePlace {
    pub(crate) row: usize,
    pub(crate) column: usize,
    pub(crate) t: f32,
    pub(crate) s: f32,
}

/// The numbers of a row that drawing reads, in single precision.
#[derive(Clone, Copy)]
struct DrawnRow {
    near: f32,
    height: f32,
    margin: f32,
    is_south: bool,
}

/// The numbers of a column that drawing reads: its start from the nearest axis, and which axis that is.
#[derive(Clone, Copy)]
struct DrawnColumn {
    start: f32,
    width: f32,
    margin: f32,
    axis: u32,
}

/// The pieces of a grid of texels and a grid of leaves.
#[derive(Clone)]
pub(crate) struct Pieces {
    pub(crate) rows: Vec<PieceRow>,
    pub(crate) columns: Vec<PieceColumn>,
    drawn_rows: Vec<DrawnRow>,
    drawn_columns: Vec<DrawnColumn>,
}

impl Pieces {
    pub(crate) fn new(texels: LatLong, leaves: LeafGrid) -> Self {
        let rows = rows(texels.height, leaves.rows());
        let columns = columns(texels.width, leaves.columns());
        let drawn_rows = (rows.iter())
            .map(|row| DrawnRow {
                near: row.near as f32,
                height: row.height() as f32,
                margin: (6e-7 * row.far / row.height()).min(0.25) as f32,
                is_south: row.is_south,
            })
            .collect();
        let drawn_columns = (columns.iter())
            .map(|column| {
                let axis = (2.0 * (column.start + column.end)).round();
                DrawnColumn {
                    start: ((column.start - axis / 4.0) * TAU) as f32,
                    width: column.width() as f32,
                    margin: (4e-7 / column.width()).min(0.25) as f32,
                    axis: axis as u32 & 3,
                }
            })
            .collect();
        Self { rows, columns, drawn_rows, drawn_columns }
    }

    pub(crate) fn locate(&self, direction: [f32; 3]) -> PiecePlace {
        let [x, y, z] = direction.map(f64::from);
        let square = x * x + y * y;
        let length = (square + z * z).sqrt();
        // 1 - |z| = s^2 / (1 + |z|).
        let down = square / (length * (length + z.abs()));
        let half = self.rows.len() / 2;
        let from_pole = self.rows[1..half].partition_point(|row| row.near <= down);
        let PieceRow { near, far, .. } = self.rows[from_pole];
        let t = ((down - near) / (far - near)).clamp(0.0, 1.0);
        let (row, t) = if z < 0.0 { (self.rows.len() - 1 - from_pole, 1.0 - t) } else { (from_pole, t) };
        let turn = math::atan2(y, x) / TAU;
        let turn = turn - turn.floor();
        let column = self.columns[1..].partition_point(|column| column.start <= turn);
        let PieceColumn { start, end, .. } = self.columns[column];
        let s = ((turn - start) / (end - start)).clamp(0.0, 1.0);
        PiecePlace { row, column, t: t as f32, s: s as f32 }
    }

    /// The place in a piece, moved away from its edges by what the rounding of directions may move.
    #[inline(always)]
    pub(crate) fn inside(&self, row: usize, column: usize, [t, s]: [f32; 2]) -> [f32; 2] {
        let (edge_t, edge_s) = (self.drawn_rows[row].margin, self.drawn_columns[column].margin);
        [t.max(edge_t).min(1.0 - edge_t), s.max(edge_s).min(1.0 - edge_s)]
    }

    #[inline(always)]
    pub(crate) fn direction(&self, row: usize, column: usize, [t, s]: [f32; 2]) -> [f32; 3] {
        let DrawnRow { near, height, is_south, .. } = self.drawn_rows[row];
        let d = near + height * if is_south { 1.0 - t } else { t };
        let z = if is_south { d - 1.0 } else { 1.0 - d };
        let sine = (d * (2.0 - d)).max(0.0).sqrt();
        let DrawnColumn { start, width, axis, .. } = self.drawn_columns[column];
        let (a, b) = sin_cos(start + s * width);
        let (x, y) = if axis & 1 == 1 { (-a, b) } else { (b, a) };
        let sine = if axis & 2 == 2 { -sine } else { sine };
        [sine * x, sine * y, z]
    }

    /// One over the solid angle of a piece.
    #[inline(always)]
    pub(crate) fn inverse_area(&self, row: usize, column: usize) -> f32 {
        (self.drawn_rows[row].height * self.drawn_columns[column].width).recip()
    }
}

/// The rows from the north pole: the northern ones, then their mirror.
fn rows(texels: usize, leaves: usize) -> Vec<PieceRow> {
    // Edges in rows of texels, and 1 - z.
    let scale = texels as f64 / PI;
    let from_pole = |y: f64| {
        let sine = math::sin(0.5 * y / scale);
        2.0 * sine * sine
    };
    let snap = SNAP * (texels as f64 / leaves as f64).min(1.0);
    let mut edges: Vec<[f64; 2]> = (0..=texels / 2).map(|i| [i as f64, from_pole(i as f64)]).collect();
    // Where the rows of leaves end.
    let mut ends = Vec::new();
    for leaf in 1..=leaves / 2 {
        let d = 2.0 * leaf as f64 / leaves as f64;
        let angle = if 2 * leaf == leaves { FRAC_PI_2 } else { 2.0 * math::asin((0.5 * d).sqrt()) };
        let y = angle * scale;
        let near = y.round();
        if (y - near).abs() < snap && near as usize <= texels / 2 {
            ends.push(near);
        } else {
            edges.push([y, d]);
            ends.push(y);
        }
    }
    edges.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut rows: Vec<PieceRow> = (edges.windows(2))
        .map(|edge| {
            let middle = 0.5 * (edge[0][0] + edge[1][0]);
            let leaf = ends.partition_point(|end| *end < middle);
            PieceRow { texel: middle as usize, leaf, is_south: false, near: edge[0][1], far: edge[1][1] }
        })
        .collect();
    let south: Vec<PieceRow> = (rows.iter().rev())
        .map(|row| PieceRow {
            texel: texels - 1 - row.texel,
            leaf: leaves - 1 - row.leaf,
            is_south: true,
            ..*row
        })
        .collect();
    rows.extend(south);
    rows
}

/// The columns from phi = 0 upward.
fn columns(texels: usize, leaves: usize) -> Vec<PieceColumn> {
    let snap = SNAP * (texels as f64 / leaves as f64).min(1.0);
    // Edges in columns of texels: phi = pi and the edges to both sides of it.
    let offset = 0.5 * (texels % 2) as f64;
    let mut edges: Vec<f64> =
        (0..=texels).map(|i| i as f64 + offset).filter(|x| *x <= texels as f64).collect();
    let mut ends = Vec::new();
    for leaf in 0..=leaves {
        let x = leaf as f64 * texels as f64 / leaves as f64;
        let near = (x - offset).round() + offset;
        if (x - near).abs() < snap {
            ends.push(near);
        } else {
            edges.push(x);
            ends.push(x);
        }
    }
    edges.sort_by(f64::total_cmp);
    (edges.windows(2))
        .map(|edge| {
            let middle = 0.5 * (edge[0] + edge[1]);
            // u = 1/2 - phi / (2 pi).
            let texel = (0.5 * texels as f64 - middle).rem_euclid(texels as f64) as usize;
            let leaf = ends[1..].partition_point(|end| *end < middle);
            let [start, end] = [edge[0], edge[1]].map(|x| x / texels as f64);
            PieceColumn { texel: texel.min(texels - 1), leaf, start, end }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sh::Degree;
    use sphere::{DVec3, Direction};

    fn grids() -> Vec<(LatLong, LeafGrid)> {
        let leaves = |degree| LeafGrid::for_degree(Degree::new(degree).unwrap());
        let texels = [(64, 32), (1, 1), (5, 3), (100, 50), (1000, 500), (1024, 512), (33, 511)];
        let all = texels.iter().map(|&(width, height)| LatLong { width, height });
        all.flat_map(|texels| [0, 7, 19].map(|degree| (texels, leaves(degree)))).collect()
    }

    #[test]
    fn pieces_lie_in_one_texel_and_one_leaf_and_fill_the_sphere() {
        for (texels, leaves) in grids() {
            let pieces = Pieces::new(texels, leaves);
            let height: f64 = pieces.rows.iter().map(PieceRow::height).sum();
            let width: f64 = pieces.columns.iter().map(PieceColumn::width).sum();
            assert!((height - 2.0).abs() < 1e-12 && (width - TAU).abs() < 1e-12, "{texels:?}");
            for row in &pieces.rows {
                for column in &pieces.columns {
                    let z = 1.0 - 0.5 * (row.near + row.far);
                    let z = if row.is_south { -z } else { z };
                    let direction = Direction::from_angles(z.acos(), PI * (column.start + column.end));
                    let (x, y) = texels.position(direction);
                    assert_eq!((y + 0.5).floor() as usize, row.texel, "{texels:?} {row:?}");
                    assert_eq!((x + 0.5).floor() as usize, column.texel, "{texels:?} {column:?}");
                    let place = leaves.locate(direction.vector().to_array().map(|x| x as f32));
                    assert_eq!((place.row, place.column), (row.leaf, column.leaf), "{texels:?}");
                }
            }
        }
    }

    #[test]
    fn directions_return_to_their_place() {
        for (texels, leaves) in grids() {
            let pieces = Pieces::new(texels, leaves);
            for index in 0..20_000u32 {
                // Golden ratios: every part of the grid, and the edges of pieces.
                let of = |ratio: f64| (f64::from(index) * ratio).fract();
                let row = (of(0.618_034) * pieces.rows.len() as f64) as usize;
                let column = (of(0.754_878) * pieces.columns.len() as f64) as usize;
                let place = match index % 4 {
                    0 => [0.0, 1.0],
                    1 => [1.0, 0.0],
                    _ => [of(0.569_84), of(0.324_718)].map(|x| x as f32),
                };
                let [t, s] = pieces.inside(row, column, place);
                let direction = pieces.direction(row, column, [t, s]);
                let length = DVec3::from_array(direction.map(f64::from)).length();
                assert!((length - 1.0).abs() < 2e-7, "{length}");
                let back = pieces.locate(direction);
                assert_eq!((back.row, back.column), (row, column), "{texels:?} {t} {s} {direction:?}");
                let (edge_t, edge_s) = (pieces.drawn_rows[row].margin, pieces.drawn_columns[column].margin);
                assert!((back.t - t).abs() < edge_t && (back.s - s).abs() < edge_s, "{back:?} {t} {s}");
            }
        }
    }
}
