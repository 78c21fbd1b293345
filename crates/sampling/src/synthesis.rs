//! A function on the leaves: from coefficients to rows, from rows to columns, eight rows at a time.
//!
//! The table of a row serves its mirror with E + O and E - O, the sums over even and odd l - m. The table of
//! a column serves its mirrors -phi, pi - phi and pi + phi with signs of the sums over even and odd m of
//! cosines and sines. Lanes are rows, so no value crosses lanes, and the results are the same on every CPU.

use pulp::{Simd, WithSimd};
use sh::f64x4::SimdLevel;

use crate::f32x8::{F32x8, LANES, load, store};
use crate::tables::{ColumnTable, RowTable, TILE};

/// A_m and B_m of eight rows.
pub(crate) type Fourier = [F32x8; 2];

/// The Fourier coefficients of all rows: by hemisphere (north first), then group, then m. Lane i of group g
/// is row 8 g + i from the pole of its hemisphere.
///
/// `packed` holds f_lm and f_l,-m of every m and l = m ..= degree.
pub(crate) struct Rows<'a> {
    pub(crate) table: &'a RowTable,
    pub(crate) packed: &'a [[f32; 2]],
    pub(crate) orders: usize,
    pub(crate) output: &'a mut [Fourier],
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table: RowTable { groups, values }, packed, orders, output } = self;
        let (north, south) = output.split_at_mut(groups * orders);
        let mut start = 0;
        for m in 0..orders {
            let length = orders - m;
            let f = &packed[start..][..length];
            for group in 0..*groups {
                let table = &values[start * groups + group * length..][..length];
                // Even and odd l - m, of A and of B.
                let mut sums = [[simd.splat_f32s(0.0); 2]; 2];
                for (table, f) in table.chunks(2).zip(f.chunks(2)) {
                    for ((sums, table), f) in sums.iter_mut().zip(table).zip(f) {
                        let table = load(simd, table);
                        sums[0] = simd.mul_add_f32s(table, simd.splat_f32s(f[0]), sums[0]);
                        sums[1] = simd.mul_add_f32s(table, simd.splat_f32s(f[1]), sums[1]);
                    }
                }
                let [even, odd] = sums;
                for part in 0..2 {
                    let at = group * orders + m;
                    store(simd, simd.add_f32s(even[part], odd[part]), &mut north[at][part]);
                    store(simd, simd.sub_f32s(even[part], odd[part]), &mut south[at][part]);
                }
            }
            start += length;
        }
    }
}

/// The values of eight rows in all columns.
pub(crate) struct Columns<'a> {
    pub(crate) table: &'a ColumnTable,
    /// A_m and B_m of the rows for each m.
    pub(crate) rows: &'a [Fourier],
    /// Whether columns are edges, the first of which mirrors itself.
    pub(crate) at_edges: bool,
    pub(crate) output: &'a mut [F32x8],
}

impl WithSimd for Columns<'_> {
    /// The least value.
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let Self { table, rows, at_edges, output } = self;
        let columns = output.len();
        let mut least = simd.splat_f32s(f32::INFINITY);
        // Where -phi, pi - phi and pi + phi of column j are.
        let mirrored = usize::from(!at_edges);
        for (tile, trigonometric) in table.tiles.chunks_exact(rows.len()).enumerate() {
            let zero = simd.splat_f32s(0.0);
            // Even and odd m; cosines and sines of four columns.
            let mut sums = [[[zero; TILE]; 2]; 2];
            for (parity, sums) in sums.iter_mut().enumerate() {
                let mut m = parity;
                while m < rows.len() {
                    let (a, b) = (load(simd, &rows[m][0]), load(simd, &rows[m][1]));
                    let factors = &trigonometric[m];
                    for k in 0..TILE {
                        sums[0][k] = simd.mul_add_f32s(a, simd.splat_f32s(factors[k]), sums[0][k]);
                        sums[1][k] = simd.mul_add_f32s(b, simd.splat_f32s(factors[k + TILE]), sums[1][k]);
                    }
                    m += 2;
                }
            }
            let [[even_cos, even_sin], [odd_cos, odd_sin]] = sums;
            for k in 0..TILE {
                let j = tile * TILE + k;
                if j >= table.columns {
                    break;
                }
                let (cos, sin) =
                    (simd.add_f32s(even_cos[k], odd_cos[k]), simd.add_f32s(even_sin[k], odd_sin[k]));
                let (cos_pi, sin_pi) =
                    (simd.sub_f32s(even_cos[k], odd_cos[k]), simd.sub_f32s(even_sin[k], odd_sin[k]));
                let values = [
                    (simd.add_f32s(cos, sin), j),
                    // Columns are a power of two.
                    (simd.sub_f32s(cos, sin), (columns - mirrored - j) & (columns - 1)),
                    (simd.sub_f32s(cos_pi, sin_pi), columns / 2 - mirrored - j),
                    (simd.add_f32s(cos_pi, sin_pi), columns / 2 + j),
                ];
                for (value, column) in values {
                    least = simd.min_f32s(least, value);
                    store(simd, value, &mut output[column]);
                }
            }
        }
        simd.reduce_min_f32s(least)
    }
}

/// Where the columns are.
#[derive(Clone, Copy)]
pub(crate) struct ColumnPlaces<'a> {
    /// The factors of A_m and B_m in each column.
    pub(crate) table: &'a ColumnTable,
    /// Whether columns are edges, the first of which mirrors itself.
    pub(crate) at_edges: bool,
}

/// Runs `f` with the values of eight rows in all columns: `f(is_south, first row from the pole, values)`.
/// Each hemisphere has `groups` groups of eight rows. Returns the least of all values.
pub(crate) fn for_each_group(
    level: SimdLevel,
    ColumnPlaces { table, at_edges }: ColumnPlaces<'_>,
    fourier: &[Fourier],
    groups: usize,
    columns: &mut [F32x8],
    mut f: impl FnMut(bool, usize, &mut [F32x8]),
) -> f32 {
    let orders = fourier.len() / (2 * groups);
    let mut least = f32::INFINITY;
    for (index, rows) in fourier.chunks_exact(orders).enumerate() {
        least = least.min(level.run(Columns { table, rows, at_edges, output: columns }));
        f(index >= groups, index % groups * LANES, columns);
    }
    least
}

/// Writes lane i of all columns into a row that begins at `starts[i]`.
pub(crate) struct WriteLanes<'a> {
    pub(crate) columns: &'a [F32x8],
    pub(crate) starts: [usize; LANES],
    pub(crate) output: &'a mut [f32],
}

impl WithSimd for WriteLanes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { columns, starts, output } = self;
        for (block, columns) in columns.as_chunks::<LANES>().0.iter().enumerate() {
            for lane in 0..LANES {
                let mut row = [0.0; LANES];
                for k in 0..LANES {
                    row[k] = columns[k].0[lane];
                }
                output[starts[lane] + block * LANES..][..LANES].copy_from_slice(&row);
            }
        }
    }
}
