//! How many texels a map needs for a stated error of interpolation.
//!
//! A renderer blends texels bilinearly at a fixed view V in the world. Between nodes a step h apart, a linear
//! interpolant misses x (h - x) g'' / 2, whose mean square is h^4 g''^2 / 120 and whose mean is h^2 g'' / 12.
//! For a field without a preferred direction, of wave number k, <g_aa^2> = 3/8 k^4 <g^2> along any direction
//! a and <g_aa g_bb> = k^4 <g^2> (1 + 2 cos^2(a, b)) / 8. Over the sphere, with the steps of each grid,
//!
//! > RMS error = c k^2 RMS(g) / texels^2,
//!
//! c = 0.7612 for the rows of a lat-long map (steps pi / H and sin(theta) pi / H) and c = 0.2306 for the edge
//! of a cube (steps 2 / S in the planes of its faces), with a margin of 7 percent: there gradients count too,
//! at low degrees and at the faces' edges.
//!
//! The field is not of one wave number, and its frames turn: one term of B at a fixed V is D^l_mq(C) times
//! Y_pq(R^-1 V), a product of degrees l and p whose scalar degrees lambda run from |l - p| to l + p. The mean
//! of k^4 = (lambda (lambda + 1))^2 over all C and V is that of the square of (L + P)^2 in the state |l q> |p
//! -q>:
//!
//! > <k^4> = (a - 2 q^2)^2 + u(q) + u(-q), a = l (l+1) + p (p+1),
//! > u(q) = (l (l+1) - q (q+1)) (p (p+1) - q (q+1)),
//!
//! weighted by the energy Lambda_l^2 |L_lm|^2 |rho_lpq|^2 of the term.

use sh::{energy_per_degree, lambda};
use sphere::{Cube, LatLong};

use crate::{MapGrid, Reflection};

/// The kind of grid that a resolution is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MapLayout {
    /// Rows of constant colatitude, twice as many columns.
    LatLong,
    /// Six square faces.
    Cube,
}

/// A resolution, and what it costs in accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Rows of a lat-long map, or the edge of a cube face.
    pub texels: usize,
    /// The estimated error of interpolation at that resolution: RMS over all central directions and views,
    /// divided by RMS radiance.
    pub estimated_error: f64,
}

/// The size of a map's file: what is aimed at, and what is the most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByteBudget {
    /// The bytes of a texel.
    pub per_texel: usize,
    /// The size that a file should not exceed unless accuracy needs more.
    pub small: usize,
    /// The size that a file never exceeds.
    pub most: usize,
    /// The error that is accepted for a file that is small.
    pub coarse: f64,
}

impl ByteBudget {
    /// The highest resolution, a multiple of 4, at which a file has at most so many bytes; at least 4.
    fn texels(&self, layout: MapLayout, bytes: usize) -> usize {
        let shapes = match layout {
            MapLayout::Cube => 6,
            MapLayout::LatLong => 2,
        };
        ((bytes / (shapes * self.per_texel.max(1))).isqrt() / 4 * 4).max(4)
    }
}

impl MapLayout {
    /// The grid with this many rows, or texels along the edge of a cube's face.
    pub fn grid(self, texels: usize) -> MapGrid {
        match self {
            Self::LatLong => MapGrid::LatLong(LatLong::with_rows(texels)),
            Self::Cube => MapGrid::Cube(Cube { edge: texels }),
        }
    }

    /// The constant c of the module text.
    fn constant(self) -> f64 {
        match self {
            Self::LatLong => 0.761_245,
            Self::Cube => 1.07 * 0.230_625,
        }
    }

    /// 10 F texels from pole to pole serve in general [RH02, sec. 5.2]; a face of a cube spans half of that.
    /// Seen from the world, the field varies with the central direction as fast as with the view: P counts if
    /// it is higher.
    fn most(self, degree: usize) -> usize {
        match self {
            Self::LatLong => 10 * degree,
            Self::Cube => 5 * degree,
        }
    }
}

impl Reflection {
    /// The least resolution, a multiple of 4, whose estimated error of bilinear interpolation is at most
    /// `error`, the RMS over all central directions and views divided by RMS radiance; at least 4, and at
    /// most the 10 F rows of [RH02, sec. 5.2] (5 F along the edge of a cube), at which the estimate may stay
    /// above `error`.
    ///
    /// The estimate counts interpolation alone, not what the degrees F and P leave out. Tests: the measured
    /// error is 0.8 to 1 times the estimate if that is 0.012 or less, and 0.5 to 1 times if it is 0.1 or
    /// less.
    ///
    /// # Example: twice as many rows make a quarter of the error
    /// ```
    /// use brdf::{Choice, Material, Phong, project};
    /// use sh::{Degree, Expansion};
    /// use shrm::MapLayout;
    /// let degree = Degree::new(9)?;
    /// let sun = Expansion::zonal(sphere::Direction::X, degree, |_| [1.0; 3]);
    /// let satin = Material::Phong(Phong::new(16.0, [1.0; 3])?);
    /// let degrees = Choice::Degree { f: degree, p: Degree::ZERO };
    /// let brdf = project(&satin, degrees, sh::Stop::NEVER)?.coefficients;
    /// let reflection = shrm::Reflection::convolve(&sun, &brdf);
    /// let [coarse, fine] = [0.04, 0.01].map(|error| reflection.resolution(MapLayout::LatLong, error));
    /// assert!(coarse.estimated_error <= 0.04 && fine.estimated_error <= 0.01);
    /// assert!((fine.texels as f64 / coarse.texels as f64 - 2.0).abs() < 0.5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn resolution(&self, layout: MapLayout, error: f64) -> Resolution {
        let scale = layout.constant() * self.curvature();
        let degree = self.brdf().f().max(self.brdf().p()).get();
        let most = layout.most(degree).next_multiple_of(4).max(4);
        // An error of zero, or one that is not a number, gets the highest resolution.
        let wanted = (scale / error).sqrt();
        let texels =
            if wanted < most as f64 { (wanted.ceil() as usize).next_multiple_of(4).max(4) } else { most };
        Resolution { texels, estimated_error: scale / (texels * texels) as f64 }
    }

    /// The resolution for a file of few bytes: that of [`Reflection::resolution`] if the file is then small.
    /// If not, it is lowered until the file is small, or until the estimated error is that which is accepted
    /// for a small file, and in any case to the most bytes.
    pub fn resolution_within(&self, layout: MapLayout, error: f64, budget: ByteBudget) -> Resolution {
        let wanted = self.resolution(layout, error);
        let coarse = self.resolution(layout, error.max(budget.coarse));
        let [small, most] = [budget.small, budget.most].map(|bytes| budget.texels(layout, bytes));
        let texels = wanted.texels.min(small.max(coarse.texels)).min(most);
        let scale = layout.constant() * self.curvature();
        Resolution { texels, estimated_error: scale / (texels * texels) as f64 }
    }

    /// sqrt(<k^4>) over the energies of all terms; 0 for a black field.
    fn curvature(&self) -> f64 {
        let (brdf, light) = (self.brdf(), energy_per_degree(self.lighting()));
        let (mut sum, mut total) = (0.0, 0.0);
        for l in 0..=brdf.f().get() {
            for p in 0..=brdf.p().get() {
                for q in 0..=l.min(p) {
                    let rho = brdf.get(l, p, q);
                    let both_signs = if q == 0 { 1.0 } else { 2.0 };
                    let energy: f64 =
                        (0..3).map(|channel| light[l][channel] * math::powi(rho[channel], 2)).sum();
                    let energy = energy * both_signs * math::powi(lambda(l), 2);
                    sum += energy * fourth_power(l as f64, p as f64, q as f64);
                    total += energy;
                }
            }
        }
        if total > 0.0 { (sum / total).sqrt() } else { 0.0 }
    }
}

/// The mean <k^4> of one term, as the module text has it.
fn fourth_power(l: f64, p: f64, q: f64) -> f64 {
    let (l, p) = (l * (l + 1.0), p * (p + 1.0));
    let step = |q: f64| (l - q * (q + 1.0)) * (p - q * (q + 1.0));
    math::powi(l + p - 2.0 * q * q, 2) + step(q) + step(-q)
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Material, Phong, project};
    use sh::{Degree, Expansion, Stop};

    use super::*;

    /// A sharp highlight under a sun: 0.01 needs 80 texels, 0.03 half of them.
    #[test]
    fn a_file_is_small_unless_accuracy_needs_more() {
        let degree = Degree::new(40).unwrap();
        let sun = Expansion::zonal(sphere::Direction::X, degree, |_| [1.0; 3]);
        let gloss = Material::Phong(Phong::new(200.0, [1.0; 3]).unwrap());
        let degrees = Choice::Degree { f: degree, p: Degree::ZERO };
        let field = Reflection::convolve(&sun, &project(&gloss, degrees, Stop::NEVER).unwrap().coefficients);
        let layout = MapLayout::Cube;
        let [fine, coarse] = [0.01, 0.03].map(|error| field.resolution(layout, error).texels);
        assert!(coarse + 20 < fine, "{coarse} {fine}");
        let bytes = |texels: usize| 6 * texels * texels * 8;
        let within = |small: usize, most: usize, error: f64| {
            let budget = ByteBudget { per_texel: 8, small, most, coarse: 0.03 };
            field.resolution_within(layout, error, budget)
        };
        let far = usize::MAX;
        assert_eq!(within(far, far, 0.01), field.resolution(layout, 0.01));
        // Small, in between, and what accuracy needs.
        let between = (coarse + fine) / 8 * 4;
        assert_eq!(within(bytes(between), far, 0.01).texels, between);
        assert_eq!(within(bytes(between + 4) - 1, far, 0.01).texels, between);
        assert_eq!(within(1, far, 0.01), field.resolution(layout, 0.03));
        // An error that is larger than the accepted one is not made smaller, and the most is kept.
        assert_eq!(within(1, far, 0.2), field.resolution(layout, 0.2));
        let least = within(1, bytes(8), 0.01);
        assert!(least.texels == 8 && least.estimated_error > 0.03, "{least:?}");
    }

    /// States of one degree only: p = 0 leaves lambda = l; l = p = 1 with q = 0 is 1/3 of lambda = 0 and 2/3
    /// of 2, with q = 1 it is 1/3, 1/2 and 1/6 of 0, 1 and 2 (Clebsch-Gordan).
    #[test]
    fn the_mean_wave_number_is_that_of_the_scalar_degrees() {
        for l in [0.0, 1.0, 7.0] {
            assert_eq!(fourth_power(l, 0.0, 0.0), (l * (l + 1.0)).powi(2));
            assert_eq!(fourth_power(0.0, l, 0.0), (l * (l + 1.0)).powi(2));
        }
        assert!((fourth_power(1.0, 1.0, 0.0) - 2.0 / 3.0 * 36.0).abs() < 1e-12);
        assert!((fourth_power(1.0, 1.0, 1.0) - (4.0 / 2.0 + 36.0 / 6.0)).abs() < 1e-12);
    }
}
