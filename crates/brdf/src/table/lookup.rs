//! Looking a table up: c_i(v) for one view, and for eight at once.

use pulp::Simd;
use sphere::Direction;

use super::{BelowHorizon, BrdfTable};

/// The views that [`BrdfTable::lookup_eight`] takes.
const LANES: usize = 8;

/// The four texels about each of eight views.
struct CornersOfEight {
    /// The numbers of the texels within a map, by corner and view.
    texels: [[u32; LANES]; 4],
    /// The share of each texel, by corner and view.
    weights: [[f32; LANES]; 4],
}

impl BrdfTable {
    /// c_i(v) of material `q`, interpolated between the four nearest texels, into [(F+1)^2, channels].
    ///
    /// # Panics
    /// If `q` is not below Q, or `c` does not have [`BrdfTable::texel`] elements.
    pub fn lookup_into(&self, q: usize, view: Direction, c: &mut [f32]) {
        let [x, y, z] = view.vector().as_vec3().to_array();
        let map = self.map(q);
        let (corners, weights) = self.corners(x, y, z);
        interpolate(map, corners, weights, c);
    }

    /// c_i toward eight views, given by their x, y and z: eight times [(F+1)^2, channels]. Each is blended
    /// between the materials about its place q, of which `blend` has both numbers.
    ///
    /// A part of kernels that are compiled for vectors of eight; its multiply-adds are fused, so that it
    /// differs from [`BrdfTable::blend_into`] by rounding.
    ///
    /// # Panics
    /// If `c` does not have eight times [`BrdfTable::texel`] elements.
    #[inline(always)]
    pub fn lookup_eight<S: Simd>(
        &self,
        simd: S,
        blend: &[[f32; LANES]; 2],
        views: &[[f32; LANES]; 3],
        c: &mut [f32],
    ) {
        assert_eq!(c.len(), LANES * self.texel(), "eight texels");
        let corners = self.corners_of_eight(views);
        // With a known length, loops over a texel are unrolled.
        match self.texel() {
            25 => self.eight(simd, blend, &corners, c, 25),
            texel => self.eight(simd, blend, &corners, c, texel),
        }
    }

    #[inline(always)]
    fn eight<S: Simd>(
        &self,
        simd: S,
        blend: &[[f32; LANES]; 2],
        CornersOfEight { texels, weights }: &CornersOfEight,
        c: &mut [f32],
        texel: usize,
    ) {
        let several = self.count() > 1;
        for (lane, c) in c.chunks_exact_mut(texel).enumerate() {
            let corners = [0, 1, 2, 3].map(|corner| texels[corner][lane] as usize * texel);
            let weights = [0, 1, 2, 3].map(|corner| weights[corner][lane]);
            if !several {
                interpolate_wide(simd, &self.values, corners, weights, c);
                continue;
            }
            let [(first, _), others @ ..] = self.about(blend.map(|blend| blend[lane]));
            interpolate_wide(simd, self.map(first), corners, weights, c);
            self.add_shares(others, corners, weights, c);
        }
    }

    /// c_i(v, q) between the materials about a place q of the grid: for each parameter a number from the
    /// first material, 0, to the last, 1. The second counts only if the grid has several materials across.
    ///
    /// # Panics
    /// If `c` does not have [`BrdfTable::texel`] elements.
    #[inline(always)]
    pub fn blend_into(&self, blend: [f32; 2], view: Direction, c: &mut [f32]) {
        assert_eq!(c.len(), self.texel(), "a texel");
        self.blend(blend, view.vector().as_vec3().to_array(), c);
    }

    #[inline(always)]
    fn blend(&self, blend: [f32; 2], [x, y, z]: [f32; 3], c: &mut [f32]) {
        let (corners, weights) = self.corners(x, y, z);
        let [(first, _), others @ ..] = self.about(blend);
        interpolate(self.map(first), corners, weights, c);
        self.add_shares(others, corners, weights, c);
    }

    /// The four materials about a place of the grid, to be blended one after the other: each has its share
    /// in the blend of those up to it. Materials of no share may be beyond the end.
    #[inline(always)]
    fn about(&self, blend: [f32; 2]) -> [(usize, f32); 4] {
        let [along, across] = self.grid();
        let ((first, s), (second, t)) = (between(blend[0], along - 1), between(blend[1], across - 1));
        let corner = first * across + second;
        [
            (corner, 1.0),
            (corner + across, s),
            (corner + 1, (1.0 - s) * t / (1.0 - s * t)),
            (corner + across + 1, s * t),
        ]
    }

    /// Blends the shares of other materials in, one after the other.
    #[inline(always)]
    fn add_shares(&self, others: [(usize, f32); 3], corners: [usize; 4], weights: [f32; 4], c: &mut [f32]) {
        // The share of a place that is NaN is not above 0.
        for (other, share) in others.into_iter().filter(|(_, share)| *share > 0.0) {
            let other = self.map(other);
            for (k, c) in c.iter_mut().enumerate() {
                let mut value = 0.0;
                for (corner, weight) in corners.iter().zip(weights) {
                    value += weight * other[corner + k];
                }
                *c += share * (value - *c);
            }
        }
    }

    /// The texels of a material.
    #[inline(always)]
    fn map(&self, q: usize) -> &[f32] {
        let length = self.size * self.size * self.texel();
        &self.values[q * length..][..length]
    }

    /// The first elements of the four texels about a view, and their weights.
    #[inline(always)]
    fn corners(&self, x: f32, y: f32, z: f32) -> ([usize; 4], [f32; 4]) {
        let (left, top, u, t) = self.place(x, y, z);
        let last = self.size as i32 - 1;
        let (right, bottom) = ((left + 1).min(last), (top + 1).min(last));
        let texels = [(top, left), (top, right), (bottom, left), (bottom, right)];
        (
            texels.map(|(row, column)| (row as usize * self.size + column as usize) * self.texel()),
            [(1.0 - u) * (1.0 - t), u * (1.0 - t), (1.0 - u) * t, u * t],
        )
    }

    /// The corners about eight views, in loops that become vectors.
    #[inline(always)]
    fn corners_of_eight(&self, [x, y, z]: &[[f32; LANES]; 3]) -> CornersOfEight {
        let (mut texels, mut weights) = ([[0; LANES]; 4], [[0.0; LANES]; 4]);
        let (size, last) = (self.size as i32, self.size as i32 - 1);
        for lane in 0..LANES {
            let (left, top, u, t) = self.place(x[lane], y[lane], z[lane]);
            let (right, bottom) = ((left + 1).min(last), (top + 1).min(last));
            texels[0][lane] = (top * size + left) as u32;
            texels[1][lane] = (top * size + right) as u32;
            texels[2][lane] = (bottom * size + left) as u32;
            texels[3][lane] = (bottom * size + right) as u32;
            weights[0][lane] = (1.0 - u) * (1.0 - t);
            weights[1][lane] = u * (1.0 - t);
            weights[2][lane] = (1.0 - u) * t;
            weights[3][lane] = u * t;
        }
        CornersOfEight { texels, weights }
    }

    /// The left column and the top row of the four texels about a view, and how far it is from them.
    #[inline(always)]
    fn place(&self, x: f32, y: f32, z: f32) -> (i32, i32, f32, f32) {
        let z = match self.below {
            BelowHorizon::Clamped => z.max(0.0),
            BelowHorizon::Mirrored => z.abs(),
        };
        // A view from below is moved to the rim along its meridian.
        let across = if z > 0.0 { 1.0 + z } else { (x * x + y * y).sqrt().max(f32::MIN_POSITIVE) };
        let (scale, last) = (0.5 * self.size as f32, self.size as f32 - 1.0);
        let place = |x: f32| {
            // NaN becomes 0.
            let at = (scale * (x / across + 1.0) - 0.5).max(0.0).min(last);
            // The whole part: next to 1.5 * 2^23 numbers have no fraction, and the integer in their bits. A
            // cast would be one lane at a time.
            let nearest = at + WHOLE;
            let above = nearest - WHOLE > at;
            let first = (nearest.to_bits() & 0x3f_ffff) as i32 - i32::from(above);
            (first, at - first as f32)
        };
        let ((left, u), (top, t)) = (place(x), place(-y));
        (left, top, u, t)
    }
}

/// Numbers that are added to this are rounded to integers.
const WHOLE: f32 = 12_582_912.0;

/// The material at or before `blend`, of those from 0 to `last`, and the share of the next one.
#[inline(always)]
fn between(blend: f32, last: usize) -> (usize, f32) {
    // The cast takes NaN for 0.
    let q = (blend * last as f32).clamp(0.0, last as f32);
    let first = q as usize;
    (first, q - first as f32)
}

/// [`interpolate`] in vectors of a kernel.
#[inline(always)]
fn interpolate_wide<S: Simd>(simd: S, map: &[f32], corners: [usize; 4], weights: [f32; 4], c: &mut [f32]) {
    let length = c.len();
    let texels = corners.map(|first| &map[first..][..length]);
    let vectors = weights.map(|weight| simd.splat_f32s(weight));
    let whole = length - length % LANES;
    for start in (0..whole).step_by(LANES) {
        let part = |corner: usize| -> S::f32s {
            let mut part = [0.0; LANES];
            part.copy_from_slice(&texels[corner][start..start + LANES]);
            pulp::cast(part)
        };
        let mut sum = simd.mul_f32s(vectors[0], part(0));
        for corner in 1..4 {
            sum = simd.mul_add_f32s(vectors[corner], part(corner), sum);
        }
        c[start..start + LANES].copy_from_slice(&pulp::cast::<_, [f32; LANES]>(sum));
    }
    // No vector over the end of the one before it: processors wait when they read from two that overlap.
    for k in whole..length {
        let mut sum = weights[0] * texels[0][k];
        for corner in 1..4 {
            sum = weights[corner].mul_add(texels[corner][k], sum);
        }
        c[k] = sum;
    }
}

/// The weighted sum of four texels that begin at `corners`.
#[inline(always)]
fn interpolate(map: &[f32], corners: [usize; 4], weights: [f32; 4], c: &mut [f32]) {
    let texels = corners.map(|first| &map[first..][..c.len()]);
    if c.len() < LANES {
        for (k, c) in c.iter_mut().enumerate() {
            *c = 0.0;
            for (texel, weight) in texels.iter().zip(weights) {
                *c += weight * texel[k];
            }
        }
        return;
    }
    // Whole vectors; the last one goes back over what the one before it has done.
    let length = c.len();
    for start in (0..length).step_by(LANES) {
        let start = start.min(length - LANES);
        let mut sums = [0.0; LANES];
        for (texel, weight) in texels.iter().zip(weights) {
            let texel = &texel[start..start + LANES];
            for k in 0..LANES {
                sums[k] += weight * texel[k];
            }
        }
        c[start..start + LANES].copy_from_slice(&sums);
    }
}
