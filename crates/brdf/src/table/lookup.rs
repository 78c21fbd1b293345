//! Looking a table up: c_i(v) for one view, and for eight at once.

use sphere::Direction;

use super::{BelowHorizon, BrdfTable};

/// The views that [`BrdfTable::lookup_eight`] takes.
const LANES: usize = 8;

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
    /// between the materials next to its `blend`, from the first, 0, to the last, 1.
    ///
    /// Inlined, so that a caller compiled for wider vectors has these in its own.
    ///
    /// # Panics
    /// If `c` does not have eight times [`BrdfTable::texel`] elements.
    #[inline(always)]
    pub fn lookup_eight(&self, blend: &[f32; LANES], [x, y, z]: &[[f32; LANES]; 3], c: &mut [f32]) {
        assert_eq!(c.len(), LANES * self.texel(), "eight texels");
        for (lane, c) in c.chunks_exact_mut(self.texel()).enumerate() {
            self.blend(blend[lane], [x[lane], y[lane], z[lane]], c);
        }
    }

    /// c_i(v) between the materials next to `blend`, from the first, 0, to the last, 1.
    ///
    /// # Panics
    /// If `c` does not have [`BrdfTable::texel`] elements.
    #[inline(always)]
    pub fn blend_into(&self, blend: f32, view: Direction, c: &mut [f32]) {
        assert_eq!(c.len(), self.texel(), "a texel");
        self.blend(blend, view.vector().as_vec3().to_array(), c);
    }

    #[inline(always)]
    fn blend(&self, blend: f32, [x, y, z]: [f32; 3], c: &mut [f32]) {
        let last = self.count() - 1;
        let (corners, weights) = self.corners(x, y, z);
        // The cast takes NaN for 0.
        let q = (blend * last as f32).clamp(0.0, last as f32);
        let first = q as usize;
        interpolate(self.map(first), corners, weights, c);
        let share = q - first as f32;
        if share > 0.0 {
            let other = self.map(first + 1);
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
        let z = match self.below {
            BelowHorizon::Clamped => z.max(0.0),
            BelowHorizon::Mirrored => z.abs(),
        };
        // A view from below is moved to the rim along its meridian.
        let across = if z > 0.0 { 1.0 + z } else { (x * x + y * y).sqrt().max(f32::MIN_POSITIVE) };
        let last = self.size - 1;
        let scale = 0.5 * self.size as f32;
        let place = |x: f32| {
            let at = (scale * (x / across + 1.0) - 0.5).clamp(0.0, last as f32);
            let first = at as usize;
            (first, (first + 1).min(last), at - first as f32)
        };
        let ((left, right, u), (top, bottom, t)) = (place(x), place(-y));
        let texels = [(top, left), (top, right), (bottom, left), (bottom, right)];
        (
            texels.map(|(row, column)| (row * self.size + column) * self.texel()),
            [(1.0 - u) * (1.0 - t), u * (1.0 - t), (1.0 - u) * t, u * t],
        )
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
