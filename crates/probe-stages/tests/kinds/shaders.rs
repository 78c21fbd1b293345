//! What engines show of exported probes: their shaders, rewritten from their sources, on the files.

use containers::{Texture, read_ktx2};
use probes::{Lattice, ProbePlaces};
use serde_json::Value;

use crate::fixture::ExportedContents;
use crate::reference::numbers;

/// A vector in the axes of the file, of one in ours.
fn of_file([x, y, z]: [f64; 3]) -> [f64; 3] {
    [y, z, x]
}

/// The texel of a texture of three dimensions, blended between eight and clamped at the edges.
fn sample<const N: usize>(texel: impl Fn(usize) -> [f32; N], sizes: [usize; 3], uvw: [f64; 3]) -> [f64; N] {
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
        // A device multiplies by a weight of 0, and so does this.
        let texel = texel((at[2] * sizes[1] + at[1]) * sizes[0] + at[0]);
        (0..N).for_each(|k| sum[k] += weight * f64::from(texel[k]));
    }
    sum
}

/// The grids of three.js 187, from the files of preset `three` with format `float`.
pub(crate) struct Three {
    texels: Vec<f32>,
    grids: Vec<Value>,
}

impl Three {
    pub(crate) fn new(files: &ExportedContents) -> Self {
        let texels = files[0].as_ref().unwrap().as_chunks::<4>().0;
        let json: Value = serde_json::from_slice(files[3].as_ref().unwrap()).unwrap();
        Self {
            texels: texels.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(),
            grids: json["grids"].as_array().unwrap().clone(),
        }
    }

    /// The irradiance: `isInsideLightProbeGrid` and `getLightProbeGridIrradiance`, in the first of the grids
    /// that the place is in, as `probes.js` gives the first one the highest priority. `None` in none.
    pub(crate) fn irradiance(&self, at: [f64; 3], normal: [f64; 3]) -> Option<[f64; 3]> {
        let (at, normal) = (of_file(at), of_file(normal));
        let found = self.grids.iter().find_map(|grid| {
            let res = numbers(&grid["resolution"]);
            let cells = numbers(&grid["cells"]);
            let (least, most) = cells.split_at(3);
            let spacing = [0, 1, 2].map(|k| (most[k] - least[k]) / res[k]);
            let moved = [0, 1, 2].map(|k| at[k] + normal[k] * spacing[k] * 0.5);
            let margin = spacing.map(|spacing| 0.01 * spacing);
            let is_inside =
                (0..3).all(|k| moved[k] >= least[k] - margin[k] && moved[k] <= most[k] + margin[k]);
            is_inside.then(|| {
                let uvw = [0, 1, 2].map(|k| {
                    ((moved[k] - least[k]) / (most[k] - least[k])).clamp(0.5 / res[k], 1.0 - 0.5 / res[k])
                });
                (res, uvw, grid["offset"].as_u64().unwrap() as usize / 4)
            })
        });
        let (res, uvw, offset) = found?;
        let padded = res[2] + 2.0;
        let sizes = [res[0] as usize, res[1] as usize, 7 * (res[2] as usize + 2)];
        let texel = |index: usize| [0, 1, 2, 3].map(|k| self.texels[offset + 4 * index + k]);
        let c: Vec<f64> = (0..7)
            .flat_map(|t| {
                let w = (uvw[2] * res[2] + 1.0 + f64::from(t) * padded) / (7.0 * padded);
                sample(texel, sizes, [uvw[0], uvw[1], w])
            })
            .collect();
        let [x, y, z] = normal;
        let factors = [
            0.886227,
            2.0 * 0.511664 * y,
            2.0 * 0.511664 * z,
            2.0 * 0.511664 * x,
            2.0 * 0.429043 * x * y,
            2.0 * 0.429043 * y * z,
            0.743125 * z * z - 0.247708,
            2.0 * 0.429043 * x * z,
            0.429043 * (x * x - y * y),
        ];
        Some([0, 1, 2].map(|channel| {
            factors.iter().enumerate().map(|(k, factor)| factor * c[3 * k + channel]).sum::<f64>().max(0.0)
        }))
    }
}

/// The volumes of Bevy, from the files of preset `bevy`, and where `light_probes.rs` spawns them.
pub(crate) struct Bevy {
    volumes: Vec<(Texture, [[f64; 3]; 2])>,
}

impl Bevy {
    pub(crate) fn new(files: &ExportedContents, places: &ProbePlaces) -> Self {
        let volume = |(file, volume): (&Option<Vec<u8>>, &probes::Volume)| {
            assert_eq!(volume.lattice, Lattice::Centres);
            let texture = read_ktx2(file.as_ref().unwrap()).unwrap();
            (texture, volume.bounds.map(|end| of_file(end.map(f64::from))))
        };
        Self { volumes: files.iter().zip(places.volumes()).map(volume).collect() }
    }

    /// The irradiance over pi: `irradiance_volume_light`. Each volume whose unit cube holds the place has
    /// the same weight, as none of them has a falloff. `None` in none.
    pub(crate) fn irradiance(&self, at: [f64; 3], normal: [f64; 3]) -> Option<[f64; 3]> {
        let (at, normal) = (of_file(at), of_file(normal));
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for (texture, [least, most]) in &self.volumes {
            let unit = [0, 1, 2].map(|k| (at[k] - 0.5 * (least[k] + most[k])) / (most[k] - least[k]));
            if unit.iter().any(|x| x.abs() > 0.5) {
                continue;
            }
            weights += 1.0;
            let atlas = [texture.width, texture.height, texture.depth];
            let resolution = [atlas[0], atlas[1] / 2, atlas[2] / 3].map(|count| count as f64);
            let uvw = [0, 1, 2]
                .map(|k| ((unit[k] + 0.5) * resolution[k]).clamp(0.5, resolution[k] - 0.5) / atlas[k] as f64);
            for axis in 0..3 {
                let negative = if normal[axis] < 0.0 { 0.5 } else { 0.0 };
                let place = [uvw[0], uvw[1] + negative, uvw[2] + axis as f64 / 3.0];
                let rgb = sample(|index| texture.pixels[index], atlas, place);
                (0..3).for_each(|channel| sum[channel] += rgb[channel] * normal[axis] * normal[axis]);
            }
        }
        (weights > 0.0).then(|| sum.map(|sum| sum / weights))
    }
}
