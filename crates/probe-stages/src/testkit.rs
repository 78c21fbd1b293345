//! Slow, obvious forms against which the formulas of engines are compared.

use probes::{PlacesParts, ProbePlaces, Repair, Volume};

/// Nine coefficients of radiance in red, green and blue, row l l + l + m.
type Rows = [[f32; 3]; 9];

/// A number from -1 to 1 for each index.
pub(crate) fn noise(index: usize) -> f32 {
    let mixed = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 40) as f32 / (1 << 23) as f32 - 1.0
}

/// A direction of length 1 for each index.
pub(crate) fn direction(index: usize) -> [f64; 3] {
    let d = [0, 1, 2].map(|k| f64::from(noise(7919 * k + index)) + 1e-3);
    let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
    d.map(|x| x / length)
}

/// The nine harmonics of a direction, as tables print them.
pub(crate) fn harmonics([x, y, z]: [f64; 3]) -> [f64; 9] {
    [
        0.282_094_791_773_878_1,
        0.488_602_511_902_919_9 * y,
        0.488_602_511_902_919_9 * z,
        0.488_602_511_902_919_9 * x,
        1.092_548_430_592_079 * x * y,
        1.092_548_430_592_079 * y * z,
        0.315_391_565_252_520_05 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079 * x * z,
        0.546_274_215_296_039_5 * (x * x - y * y),
    ]
}

/// The irradiance over pi of rows toward a normal, both in our axes.
pub(crate) fn exact(rows: &Rows, normal: [f64; 3]) -> [f64; 3] {
    let factor = |row: usize| match row {
        0 => 1.0,
        1..4 => 2.0 / 3.0,
        _ => 0.25,
    };
    let harmonics = harmonics(normal);
    [0, 1, 2].map(|channel| (0..9).map(|k| factor(k) * harmonics[k] * f64::from(rows[k][channel])).sum())
}

/// Rows whose irradiance is above 0 toward all normals.
pub(crate) fn bright_rows(count: usize) -> Vec<Rows> {
    let row = |probe: usize, row: usize| {
        [0, 1, 2].map(|channel| {
            let value = noise(100 * probe + 3 * row + channel);
            if row == 0 { 4.0 + value } else { 0.5 * value }
        })
    };
    (0..count).map(|probe| std::array::from_fn(|k| row(probe, k))).collect()
}

/// Light that changes evenly from place to place: the rows at a place of our world.
pub(crate) fn even_light() -> impl Fn([f64; 3]) -> Rows {
    let ends = bright_rows(4);
    move |at| {
        std::array::from_fn(|row| {
            [0, 1, 2].map(|channel| {
                let of = |end: usize| f64::from(ends[end][row][channel]);
                (of(0) + (0..3).map(|k| 0.1 * at[k] * of(k + 1)).sum::<f64>()) as f32
            })
        })
    }
}

/// The rows at a place of our world, blended between the eight probes around it; outside, those of the
/// nearest place inside.
pub(crate) fn blended(volume: &Volume, rows: &[Rows], at: [f64; 3]) -> Rows {
    let first = volume.position([0; 3]).map(f64::from);
    let next = volume.position([1; 3]).map(f64::from);
    let mut sum = [[0.0_f64; 3]; 9];
    for corner in 0..8 {
        let (mut weight, mut cell) = (1.0, [0; 3]);
        for axis in 0..3 {
            let last = volume.counts[axis] - 1;
            let place = (at[axis] - first[axis]) / (next[axis] - first[axis]);
            let place = place.clamp(0.0, last as f64);
            let below = (place.floor() as usize).min(last.saturating_sub(1));
            let upper = corner >> axis & 1;
            let within = place - below as f64;
            weight *= if upper == 1 { within } else { 1.0 - within };
            cell[axis] = (below + upper).min(last);
        }
        let own = &rows[volume.index(cell)];
        for (sum, row) in sum.iter_mut().zip(own) {
            (0..3).for_each(|channel| sum[channel] += weight * f64::from(row[channel]));
        }
    }
    sum.map(|row| row.map(|value| value as f32))
}

/// The texel of a texture of three dimensions at a texture coordinate, blended between eight texels and
/// clamped at the edges, as graphics devices do.
pub(crate) fn sample<const N: usize>(texels: &[[f32; N]], sizes: [usize; 3], uvw: [f64; 3]) -> [f64; N] {
    let mut sum = [0.0; N];
    for corner in 0..8 {
        let (mut weight, mut at) = (1.0, [0; 3]);
        for axis in 0..3 {
            let place = uvw[axis] * sizes[axis] as f64 - 0.5;
            let below = place.floor();
            let upper = corner >> axis & 1;
            weight *= if upper == 1 { place - below } else { 1.0 - place + below };
            at[axis] = (below as i64 + upper as i64).clamp(0, sizes[axis] as i64 - 1) as usize;
        }
        let texel = &texels[(at[2] * sizes[1] + at[1]) * sizes[0] + at[0]];
        (0..N).for_each(|k| sum[k] += weight * f64::from(texel[k]));
    }
    sum
}

/// Places of volumes and points in a world without walls.
pub(crate) fn places(volumes: Vec<Volume>, points: Vec<[f32; 3]>) -> ProbePlaces {
    let position = |volume: &Volume| {
        (0..volume.len()).map(|index| volume.position(volume.cell(index))).collect::<Vec<_>>()
    };
    let of_volumes: Vec<[f32; 3]> = volumes.iter().flat_map(position).collect();
    let count = of_volumes.len() + points.len();
    let parts = PlacesParts {
        reach: vec![u8::MAX; 256 * of_volumes.len()],
        positions: [of_volumes, points.clone()].concat(),
        volumes,
        points,
        back_share: vec![0.0; count],
        inside_of: vec![None; count],
        repairs: vec![Repair::None; count],
        visible: vec![0; count],
    };
    ProbePlaces::from_parts(parts).unwrap()
}
