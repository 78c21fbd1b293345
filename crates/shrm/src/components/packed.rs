//! Components in 8 bits: relative to the size of each texel, with one scale for each component.
//!
//! > U_k(C) = size(C) s_k q_k(C) / 127,   q_k from -127 to 127
//!
//! The size of a texel is the root of the sum of the squares of its components with full resolution. That is
//! about its root mean square over views, for the functions w_k are orthonormal. It is an image of its own. A
//! reader filters the size and q_k apart and multiplies; s_k / 127 goes into the texture of w_k.

use sphere::Face;

use super::chart::bordered_taps;
use super::map::ComponentMap;

/// A map of components in 8 bits.
#[derive(Clone, Debug, PartialEq)]
pub struct PackedComponents {
    /// The root mean square over views, RGB, at the texels of the first component.
    pub sizes: Vec<[f32; 3]>,
    /// s_k.
    pub scales: Vec<f32>,
    /// q_k, RGB, of each component, at its texels: see [`ComponentMap::values`].
    pub values: Vec<Vec<[i8; 3]>>,
    edges: Vec<usize>,
}

impl PackedComponents {
    /// The map in 8 bits.
    ///
    /// Tests: in a studio the error of look-ups grows by less than a hundredth of a stop.
    pub fn of(map: &ComponentMap) -> Self {
        let edges: Vec<usize> = (0..map.basis().components().len()).map(|k| map.edge(k)).collect();
        let mut whole = vec![[0.0_f32; 3]; map.values(0).len()];
        for k in (0..edges.len()).filter(|k| edges[*k] == edges[0]) {
            for (sum, value) in whole.iter_mut().zip(map.values(k)) {
                (0..3).for_each(|channel| sum[channel] += value[channel] * value[channel]);
            }
        }
        whole.as_flattened_mut().iter_mut().for_each(|value| *value = value.sqrt());
        let largest = whole.as_flattened().iter().fold(0.0, |most: f32, value| most.max(*value));
        let least = (largest * MIN_SIZE).max(f32::MIN_POSITIVE);
        whole.as_flattened_mut().iter_mut().for_each(|value| *value = value.max(least));
        let (mut scales, mut values) = (Vec::new(), Vec::new());
        for (k, edge) in edges.iter().enumerate() {
            let at = |index: usize| size_at(&whole, edges[0], *edge, index);
            let relative: Vec<[f32; 3]> = (0..map.values(k).len())
                .map(|index| {
                    let (value, size) = (map.values(k)[index], at(index));
                    std::array::from_fn(|channel| value[channel] / size[channel])
                })
                .collect();
            let scale = relative.as_flattened().iter().fold(f32::MIN_POSITIVE, |most, x| most.max(x.abs()));
            scales.push(scale);
            let step = |value: f32| (value / scale * 127.0).round() as i8;
            values.push(relative.iter().map(|texel| texel.map(step)).collect());
        }
        Self { sizes: whole, scales, values, edges }
    }

    /// The texels along the edge of a face of a component.
    ///
    /// # Panics
    /// If there is no such component.
    pub fn edge(&self, k: usize) -> usize {
        self.edges[k]
    }

    /// The radiance at (s, t) of a face for these values of w_k, each image filtered by itself.
    pub fn at(&self, face: Face, [s, t]: [f64; 2], w: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (k, (values, w)) in self.values.iter().zip(w).enumerate() {
            let first = face as usize * (self.edges[k] + 2) * (self.edges[k] + 2);
            for (index, weight) in bordered_taps(self.edges[k], s, t) {
                let q = values[first + index];
                let scale = w * weight * f64::from(self.scales[k]) / 127.0;
                (0..3).for_each(|channel| sum[channel] += scale * f64::from(q[channel]));
            }
        }
        let mut size = [0.0; 3];
        let first = face as usize * (self.edges[0] + 2) * (self.edges[0] + 2);
        for (index, weight) in bordered_taps(self.edges[0], s, t) {
            let value = self.sizes[first + index];
            (0..3).for_each(|channel| size[channel] += weight * f64::from(value[channel]));
        }
        std::array::from_fn(|channel| (sum[channel] * size[channel]).max(0.0))
    }
}

/// The least size, as a share of the largest: a texel may be black.
const MIN_SIZE: f32 = 1e-6;

/// The size of a texel of bordered faces of `edge` texels, from those of `full` texels.
fn size_at(whole: &[[f32; 3]], full: usize, edge: usize, index: usize) -> [f32; 3] {
    if full == edge {
        return whole[index];
    }
    let (side, texels) = (edge + 2, (full + 2) * (full + 2));
    let (face, rest) = (index / (side * side), index % (side * side));
    let place = |at: usize| (at as f64 - 0.5) / edge as f64;
    let mut size = [0.0_f64; 3];
    for (texel, weight) in bordered_taps(full, place(rest % side), place(rest / side)) {
        let value = whole[face * texels + texel];
        (0..3).for_each(|channel| size[channel] += weight * f64::from(value[channel]));
    }
    // Past the border the taps extrapolate.
    size.map(|value| (value as f32).max(f32::MIN_POSITIVE))
}
