//! A function on the leaves: from coefficients to rows, from rows to columns, eight rows at a time.
//!
//! The table of a row serves its mirror with E + O and E - O, the sums over even and odd l - m. The table of
//! a column serves its mirrors -phi, pi - phi and pi + phi with signs of the sums over even and odd m of
//! cosines and sines. Lanes are rows, so no value crosses lanes, and the results are the same on every CPU.

use pulp::{Simd, WithSimd};
use sh::f64x4::{Lanes, SimdLevel, WithLanes};

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
            let tables = &values[start * groups..][..groups * length];
            let mut write = |group: usize, [even, odd]: Parities<S>| {
                let at = group * orders + m;
                for part in 0..2 {
                    store(simd, simd.add_f32s(even[part], odd[part]), &mut north[at][part]);
                    store(simd, simd.sub_f32s(even[part], odd[part]), &mut south[at][part]);
                }
            };
            // Two groups side by side: one alone has fewer sums than multiply-adds are under way.
            let pairs = tables.chunks_exact(2 * length);
            if !pairs.remainder().is_empty() {
                let [sums] = sums_over_l(simd, [pairs.remainder()], f);
                write(groups - 1, sums);
            }
            for (pair, tables) in pairs.enumerate() {
                let (first, second) = tables.split_at(length);
                let [first, second] = sums_over_l(simd, [first, second], f);
                write(2 * pair, first);
                write(2 * pair + 1, second);
            }
            start += length;
        }
    }
}

/// The sums over even and odd l - m: A and B of each.
type Parities<S> = [[<S as Simd>::f32s; 2]; 2];

/// The sums over l of one m for some groups of rows.
#[inline(always)]
fn sums_over_l<S: Simd, const GROUPS: usize>(
    simd: S,
    tables: [&[F32x8]; GROUPS],
    f: &[[f32; 2]],
) -> [Parities<S>; GROUPS] {
    let mut sums = [[[simd.splat_f32s(0.0); 2]; 2]; GROUPS];
    let tables = tables.map(|table| &table[..f.len()]);
    let mut add = |l: usize, parity: usize| {
        let f = f[l].map(|value| simd.splat_f32s(value));
        for group in 0..GROUPS {
            let table = load(simd, &tables[group][l]);
            for part in 0..2 {
                let sum = &mut sums[group][parity][part];
                *sum = simd.mul_add_f32s(table, f[part], *sum);
            }
        }
    };
    for pair in 0..f.len() / 2 {
        add(2 * pair, 0);
        add(2 * pair + 1, 1);
    }
    if f.len() % 2 == 1 {
        add(f.len() - 1, 0);
    }
    sums
}

/// The values of two groups of eight rows in all columns.
pub(crate) struct Columns<'a> {
    pub(crate) table: &'a ColumnTable,
    /// A_m and B_m of each group for each m.
    pub(crate) rows: [&'a [Fourier]; 2],
    /// Whether columns are edges, the first of which mirrors itself.
    pub(crate) at_edges: bool,
    pub(crate) output: [&'a mut [F32x8]; 2],
}

impl WithSimd for Columns<'_> {
    /// The least value.
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f32 {
        let Self { table, rows, at_edges, mut output } = self;
        let columns = output[0].len();
        let mut least = simd.splat_f32s(f32::INFINITY);
        // Where -phi, pi - phi and pi + phi of column j are.
        let mirrored = usize::from(!at_edges);
        for (tile, factors) in table.tiles.chunks_exact(rows[0].len()).enumerate() {
            let even_cos = sums_over_m::<S, 0, 0>(simd, rows, factors);
            let even_sin = sums_over_m::<S, 0, 1>(simd, rows, factors);
            let odd_cos = sums_over_m::<S, 1, 0>(simd, rows, factors);
            let odd_sin = sums_over_m::<S, 1, 1>(simd, rows, factors);
            for (group, output) in output.iter_mut().enumerate() {
                for (k, j) in (tile * TILE..table.columns).take(TILE).enumerate() {
                    let (even_cos, odd_cos) = (even_cos[group][k], odd_cos[group][k]);
                    let (even_sin, odd_sin) = (even_sin[group][k], odd_sin[group][k]);
                    let (cos, sin) = (simd.add_f32s(even_cos, odd_cos), simd.add_f32s(even_sin, odd_sin));
                    let (cos_pi, sin_pi) =
                        (simd.sub_f32s(even_cos, odd_cos), simd.sub_f32s(even_sin, odd_sin));
                    let values = [
                        simd.add_f32s(cos, sin),
                        simd.sub_f32s(cos, sin),
                        simd.sub_f32s(cos_pi, sin_pi),
                        simd.add_f32s(cos_pi, sin_pi),
                    ];
                    // Columns are a power of two.
                    store(simd, values[0], &mut output[j]);
                    store(simd, values[1], &mut output[(columns - mirrored - j) & (columns - 1)]);
                    store(simd, values[2], &mut output[columns / 2 - mirrored - j]);
                    store(simd, values[3], &mut output[columns / 2 + j]);
                    let [a, b, c, d] = values;
                    least = simd.min_f32s(least, simd.min_f32s(simd.min_f32s(a, b), simd.min_f32s(c, d)));
                }
            }
        }
        simd.reduce_min_f32s(least)
    }
}

/// The sums of cosines (part 0) or of sines (part 1) over even or odd m, of two groups in four columns.
#[inline(always)]
fn sums_over_m<S: Simd, const PARITY: usize, const PART: usize>(
    simd: S,
    rows: [&[Fourier]; 2],
    factors: &[[f32; 2 * TILE]],
) -> [[S::f32s; TILE]; 2] {
    let (mut first, mut second) = ([simd.splat_f32s(0.0); TILE], [simd.splat_f32s(0.0); TILE]);
    let rows = rows.map(|rows| &rows[..factors.len()]);
    // `step_by` would not be inlined.
    let mut m = PARITY;
    while m < factors.len() {
        let (a, b) = (load(simd, &rows[0][m][PART]), load(simd, &rows[1][m][PART]));
        for k in 0..TILE {
            let factor = simd.splat_f32s(factors[m][PART * TILE + k]);
            first[k] = simd.mul_add_f32s(a, factor, first[k]);
            second[k] = simd.mul_add_f32s(b, factor, second[k]);
        }
        m += 2;
    }
    [first, second]
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
/// Each hemisphere has `groups` groups of eight rows; `columns` has room for two. Returns the least of all
/// values.
pub(crate) fn for_each_group(
    level: SimdLevel,
    ColumnPlaces { table, at_edges }: ColumnPlaces<'_>,
    fourier: &[Fourier],
    groups: usize,
    columns: &mut [F32x8],
    mut f: impl FnMut(bool, usize, &mut [F32x8]),
) -> f32 {
    let orders = fourier.len() / (2 * groups);
    let (north, south) = fourier.split_at(groups * orders);
    let (north_columns, south_columns) = columns.split_at_mut(columns.len() / 2);
    let mut least = f32::INFINITY;
    for (group, rows) in north.chunks_exact(orders).zip(south.chunks_exact(orders)).enumerate() {
        let output = [&mut *north_columns, &mut *south_columns];
        least = least.min(level.run(Columns { table, rows: [rows.0, rows.1], at_edges, output }));
        f(false, group * LANES, north_columns);
        f(true, group * LANES, south_columns);
    }
    least
}

/// Writes lane i of all columns into a row that begins at `starts[i]`.
pub(crate) struct WriteLanes<'a> {
    pub(crate) columns: &'a [F32x8],
    pub(crate) starts: [usize; LANES],
    pub(crate) output: &'a mut [f32],
}

impl WithLanes for WriteLanes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_lanes<L: Lanes>(self, lanes: L) {
        let Self { columns, starts, output } = self;
        for (block, columns) in columns.as_chunks::<LANES>().0.iter().enumerate() {
            let rows = lanes.transpose_f32s(columns.map(|column| column.0));
            for (start, row) in starts.iter().zip(rows) {
                output[start + block * LANES..][..LANES].copy_from_slice(&row);
            }
        }
    }
}
