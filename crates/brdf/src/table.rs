//! BRDF tables: the coefficients of rho_hat over the incident direction, for every view.
//!
//! Kautz, Sloan and Snyder, "Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical
//! Harmonics" [KSS02, sec. 3]:
//!
//! > c_i(v) = integral of rho_hat(s, v) Y_i(s) ds
//!
//! in the frame of the surface (+X the tangent, +Z the normal), for any material, anisotropic or not. rho_hat
//! is the BRDF times the cosine. A surface under light of coefficients L_i in that frame has the radiance sum
//! of L_i c_i(v).
//!
//! The views are the texels of a parabolic map of the hemisphere, N x N: x = v_x / (1 + v_z), y alike, so
//! that v = (2 x, 2 y, 1 - x^2 - y^2) / (1 + x^2 + y^2); column c has its centre at x = 2 (c + 1/2) / N - 1,
//! row r at y = 1 - 2 (r + 1/2) / N. Texels outside the unit disk repeat its rim.
//! Views lower than 0.25 degrees above the horizon are taken at that height.

mod azimuths;
mod captured;
mod hemisphere;
mod lookup;
mod several;
#[cfg(test)]
mod tests;
mod zonal;

use std::collections::BTreeMap;
use std::f64::consts::PI;

use rayon::prelude::*;
use sh::{Basis, Degree, Stop, Stopped};
use sphere::{DVec3, Direction};

use crate::projection::reaches_below;
use crate::{Centre, Material};
use hemisphere::{Half, Hemisphere, NotFiniteIncident, turn};
use zonal::{add_zonal, is_zonal};

pub use captured::captured;
pub use hemisphere::ViewCoefficients;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// The lowest view of a table, in radians: 0.25 degrees above the horizon. Below it models limit the values
/// that have no bound at grazing, each in its way; the coefficients themselves go on to a limit.
const LOWEST: f64 = 1.566_433;

/// A material's coefficients toward single views: the entries of a table before any interpolation.
///
/// # Example: a matte surface holds a third of its series in degree 1
/// ```
/// use brdf::{Lambert, Material, Views};
/// use sphere::Direction;
/// let chalk = Material::Lambert(Lambert::new([1.0; 3])?);
/// let c = Views::new(&chalk, sh::Degree::new(2)?).coefficients(Direction::Z)?.c;
/// // 1 / pi times the integral of z Y_10, which is sqrt(3 / (4 pi)) times 2 pi / 3.
/// assert!((c[2][0] - (1.0 / (3.0 * std::f64::consts::PI)).sqrt()).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Views<'a> {
    material: &'a Material,
    zonal: Vec<&'a Material>,
    others: Vec<&'a Material>,
    basis: Basis,
    hemisphere: Hemisphere,
}

impl<'a> Views<'a> {
    /// Prepares the coefficients of degree 0 to `degree`.
    pub fn new(material: &'a Material, degree: Degree) -> Self {
        let (zonal, others) = material.leaves().into_iter().partition(|leaf| is_zonal(leaf));
        let hemisphere = Hemisphere::new(material, degree);
        Self { material, zonal, others, basis: Basis::new(degree), hemisphere }
    }

    /// c_i toward a view with z >= 0 in the frame of the surface.
    ///
    /// Accurate to 1e-7 of the greatest coefficient if rho_hat is smooth above the horizon, near grazing too,
    /// and to the stated error if it has kinks or is a table of measured values. The tests compare with
    /// brute-force integrals.
    ///
    /// # Errors
    /// If rho_hat has a value that is not finite.
    pub fn coefficients(&self, view: Direction) -> Result<ViewCoefficients, TableError> {
        let not_finite = |NotFiniteIncident(incident)| TableError::NotFinite { incident, view };
        let mut sum = ViewCoefficients { c: vec![[0.0; 3]; self.basis.degree().rows()], error: 0.0 };
        if !self.others.is_empty() {
            let rho_hat = |incident| sum_of(&self.others, incident, view);
            sum = self.hemisphere.integrate(Half::Upper, view, &rho_hat).map_err(not_finite)?;
        }
        for leaf in &self.zonal {
            add_zonal(leaf, view, &self.basis, &mut sum).map_err(not_finite)?;
        }
        Ok(sum)
    }

    /// The integral of rho_hat^2 over all incident directions, RGB, in 1/sr: the energy that the squares of
    /// c_i, summed over all degrees, reach.
    ///
    /// # Errors
    /// If rho_hat has a value that is not finite.
    pub fn energy(&self, view: Direction) -> Result<[f64; 3], TableError> {
        let hemisphere = Hemisphere::new(self.material, Degree::ZERO);
        let square = |incident| self.material.rho_hat(incident, view).map(|value| value * value);
        let mut energy = [0.0; 3];
        let halves = if self.zonal.is_empty() { &[Half::Upper][..] } else { &[Half::Upper, Half::Lower] };
        for half in halves {
            let found = hemisphere.integrate(*half, view, &square);
            let found =
                found.map_err(|NotFiniteIncident(incident)| TableError::NotFinite { incident, view })?;
            (0..3).for_each(|channel| energy[channel] += found.c[0][channel] * (4.0 * PI).sqrt());
        }
        Ok(energy)
    }
}

fn sum_of(leaves: &[&Material], incident: Direction, view: Direction) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for leaf in leaves {
        let value = leaf.rho_hat(incident, view);
        (0..3).for_each(|channel| sum[channel] += value[channel]);
    }
    sum
}

/// Why there is no table.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TableError {
    /// The material has a value that is NaN or infinite.
    #[error(
        "the material has no finite value for light from {} and the view {}, in the surface's frame",
        place(incident),
        place(view)
    )]
    NotFinite {
        /// The incident direction.
        incident: Direction,
        /// The direction toward the viewer.
        view: Direction,
    },
    /// The tabulation was stopped before its end.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// `theta 89.50, phi -120.00 degrees`
fn place(direction: &Direction) -> String {
    format!("theta {:.2}, phi {:.2} degrees", direction.theta().to_degrees(), direction.phi().to_degrees())
}

/// Coefficients c_i(v) of one material or several, over a parabolic map of the view v.
///
/// `values` has shape [Q, N, N, (F+1)^2, channels], row l*l + l + m, one channel if every entry is grey, else
/// three; row 0 of the map is at +y. Q counts materials between which a surface may vary, in a row or on a
/// grid ([`BrdfTable::grid`]).
#[derive(Clone, Debug, PartialEq)]
pub struct BrdfTable {
    degree: Degree,
    size: usize,
    channels: usize,
    below: BelowHorizon,
    lit_from_below: bool,
    /// The number of materials across the grid; 1 if they are in a row.
    across: usize,
    values: Vec<f32>,
}

/// The values that a table shows to a view from below the horizon, which interpolated normals can make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BelowHorizon {
    /// A view from below sees the same as the nearest view at the horizon.
    Clamped,
    /// A view from below sees the same as its mirror image above the horizon: right for fibres, which have
    /// none.
    Mirrored,
}

impl BelowHorizon {
    /// The rule for the table of a material: mirrored about the tangent, clamped about other centres.
    pub fn of(material: &Material) -> Self {
        if material.centre() == Centre::Tangent { Self::Mirrored } else { Self::Clamped }
    }

    /// The view that a table holds for a view, in the frame of the surface: at least 0.25 degrees above the
    /// horizon.
    pub fn view(self, view: Direction) -> Direction {
        let DVec3 { x, y, z } = view.vector();
        let z = if self == Self::Mirrored { z.abs() } else { z.max(0.0) };
        let across = math::hypot(x, y);
        let theta = math::atan2(across, z).min(LOWEST);
        Direction::from_angles(theta, if across > 0.0 { math::atan2(y, x) } else { 0.0 })
    }
}

impl BrdfTable {
    /// A table of its values, shape [Q, `size`, `size`, (F+1)^2, `channels`]; `None` if there is none of a
    /// dimension, `channels` is neither 1 nor 3, or the length does not fit.
    pub fn new(
        degree: Degree,
        size: usize,
        channels: usize,
        below: BelowHorizon,
        values: Vec<f32>,
    ) -> Option<Self> {
        let one = size.checked_mul(size)?.checked_mul(degree.rows())?.checked_mul(channels)?;
        let fits = one > 0 && !values.is_empty() && values.len().is_multiple_of(one);
        (fits && matches!(channels, 1 | 3)).then_some(Self {
            degree,
            size,
            channels,
            below,
            lit_from_below: false,
            across: 1,
            values,
        })
    }

    /// The degree F, the highest l.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The edge N of the map of views.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The number of materials Q.
    pub fn count(&self) -> usize {
        self.values.len() / (self.size * self.size * self.texel())
    }

    /// The number of materials along the first and the second parameter, [Q_a, Q_b]: material a Q_b + b is at
    /// (a, b). Q_b is 1 if only one parameter varies.
    pub fn grid(&self) -> [usize; 2] {
        [self.count() / self.across, self.across]
    }

    /// Returns the table with its materials on a grid of Q_a x Q_b; `None` if that is not their number.
    #[must_use]
    pub fn with_grid(self, [along, across]: [usize; 2]) -> Option<Self> {
        (along.checked_mul(across) == Some(self.count())).then_some(Self { across, ..self })
    }

    /// The number of channels: 1 if the table is grey, else 3.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The values that the table shows to a view from below the horizon.
    pub fn below(&self) -> BelowHorizon {
        self.below
    }

    /// Whether the material reflects light from below the horizon, as phong and kajiya-kay do.
    pub fn lit_from_below(&self) -> bool {
        self.lit_from_below
    }

    /// Returns the same table, marked as that of a material that reflects light from below the horizon, or
    /// does not; a new one does not.
    #[must_use]
    pub fn with_lit_from_below(self, lit_from_below: bool) -> Self {
        Self { lit_from_below, ..self }
    }

    /// The values, [Q, N, N, (F+1)^2, channels].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The number of values of a texel: (F+1)^2 times the channels.
    pub fn texel(&self) -> usize {
        self.degree.rows() * self.channels
    }

    /// The view at the centre of a texel; one on the rim for texels outside the disk.
    pub fn view(size: usize, row: usize, column: usize) -> Direction {
        let [x, y] = [2 * column + 1, 2 * (size - 1 - row) + 1].map(|k| k as f64 / size as f64 - 1.0);
        let square = x * x + y * y;
        Direction::normalised(if square < 1.0 {
            DVec3::new(2.0 * x, 2.0 * y, 1.0 - square)
        } else {
            DVec3::new(x, y, 0.0)
        })
    }
}

/// The table of one material, N x N views, and the error of its entries ([`ViewCoefficients::error`]), the
/// greatest of all.
///
/// Entries are accurate as [`Views::coefficients`] are, before they are rounded to f32. Isotropic materials
/// are integrated at one azimuth for each distance from the centre and turned, which is exact; anisotropic
/// ones in a quarter of the map, which mirrors the others if the material is orthotropic, as every model is.
/// Uses all threads; the result does not depend on their number. `stop` is asked for each view, on every
/// thread.
///
/// # Errors
/// If rho_hat has a value that is not finite, or it was stopped.
///
/// # Panics
/// If `size` is 0.
pub fn tabulate(
    material: &Material,
    degree: Degree,
    size: usize,
    stop: Stop<'_>,
) -> Result<(BrdfTable, f64), TableError> {
    assert!(size > 0, "a map has texels");
    let (isotropic, orthotropic) = (material.is_isotropic(), material.is_orthotropic());
    // Each distinct view once, in an order that does not depend on threads.
    let mut distinct: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let mut views = Vec::new();
    let texels: Vec<(usize, Direction)> = (0..size * size)
        .map(|texel| {
            let view = BrdfTable::view(size, texel / size, texel % size);
            let [x, y] = [texel % size, texel / size].map(|k| (2 * k + 1).abs_diff(size));
            let inside = x * x + y * y < size * size;
            let key = match (isotropic, inside) {
                (true, true) => [x * x + y * y, 0],
                (true, false) => [size * size, 0],
                (false, _) if orthotropic => [x, y],
                (false, _) => [texel, 0],
            };
            let index = *distinct.entry(key).or_insert_with(|| {
                let v = view.vector();
                let phi = match (isotropic, orthotropic) {
                    (true, _) => 0.0,
                    (false, true) => math::atan2(v.y.abs(), v.x.abs()),
                    (false, false) => view.phi(),
                };
                views.push(Direction::from_angles(view.theta().min(LOWEST), phi));
                views.len() - 1
            });
            (index, view)
        })
        .collect();
    let at = Views::new(material, degree);
    let one = |view: &Direction| {
        stop.check()?;
        at.coefficients(*view)
    };
    // Views at the rim take the longest; small pieces keep the threads evenly busy.
    let found: Vec<ViewCoefficients> =
        views.par_iter().with_max_len(8).map(one).collect::<Result<_, TableError>>()?;
    let error = found.iter().map(|found| found.error).fold(0.0, f64::max);
    let grey = found.iter().flat_map(|found| &found.c).all(|rgb| rgb[0] == rgb[1] && rgb[0] == rgb[2]);
    let channels = if grey { 1 } else { 3 };
    let mut values = vec![0.0; size * size * degree.rows() * channels];
    values.par_chunks_exact_mut(degree.rows() * channels).zip(&texels).for_each(|(entry, (index, view))| {
        let mut c = found[*index].c.clone();
        if isotropic {
            turn(&mut c, view.phi());
        } else if orthotropic {
            mirror(&mut c, view.vector().x < 0.0, view.vector().y < 0.0);
        }
        for (numbers, rgb) in entry.chunks_exact_mut(channels).zip(&c) {
            numbers.iter_mut().zip(rgb).for_each(|(number, value)| *number = *value as f32);
        }
    });
    let below = BelowHorizon::of(material);
    let lit_from_below = reaches_below(&|incident, outgoing| material.rho_hat(incident, outgoing));
    Ok((BrdfTable { degree, size, channels, below, lit_from_below, across: 1, values }, error))
}

/// The coefficients after a change of the sign of x, and of y.
fn mirror(c: &mut [[f64; 3]], x: bool, y: bool) {
    for l in 0..c.len().isqrt() {
        for m in 1..=l {
            // cos(m (pi - phi)) = (-1)^m cos(m phi), sin(m (pi - phi)) = -(-1)^m sin(m phi).
            let odd = m % 2 == 1;
            if x && odd {
                c[l * l + l + m] = c[l * l + l + m].map(|value| -value);
            }
            if (x && !odd) != y {
                c[l * l + l - m] = c[l * l + l - m].map(|value| -value);
            }
        }
    }
}
