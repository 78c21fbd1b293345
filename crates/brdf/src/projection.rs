//! Projection of a material into spherical harmonics, and the choice of its degrees.
//!
//! rho_hat(w_i, w_o) = sum of rho_lpq Y*_lq(w_i) Y_pq(w_o) about the material's central direction
//! [RH02, eq. 13]. Neither a turn of both directions about it nor a mirror image changes rho_hat, so that
//! rho_lpq is real and rho_l,p,-q = rho_lpq: with phi the azimuth between both directions,
//!
//! > rho_lpq = 2 pi * integral of rho_hat f_lq(theta_i) f_pq(theta_o) cos(q phi) over sin(theta_i) dtheta_i,
//! > sin(theta_o) dtheta_o and phi from 0 to 2 pi,
//!
//! in the three steps of [RH02, app. C] and [Ram02, eq. 5.22]. The energy, 2 pi times the same integral of
//! rho_hat^2 [Ram02, eq. 5.18], is the sum of all |rho_lpq|^2 and comes from the same samples.
//!
//! Radially symmetric models have p = q = 0 only, and their coefficients have a closed form.

mod choice;
mod error;
mod full;
mod incident;
mod legendre;
mod slice;
mod tabulation;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use sh::{Degree, Stop, Tolerance, degree_holding};
use sphere::Direction;

use crate::{BrdfCoefficients, Centre, ClampedCosine, Material};
use choice::least;
use full::Grid;
use slice::{RhoHats, Source};
use tabulation::{ACCURACY, AllowedDifference, coarse, energies, tabulate};

pub use error::{MOST_COEFFICIENTS, ProjectionError};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 3;

/// How the degrees of a projection are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// The least degrees that lose at most this share of the energy: first P is lowered as far as that
    /// allows, then F [RH02, app. C]. If that needs degrees that make no usable map (P above 32, or more than
    /// 131072 coefficients), they are the least degrees that lose at most this share of what the highest ones
    /// tried hold, provided that these hold half of the energy: [`Projection::captured`] reports what they
    /// hold.
    Tolerance(Tolerance),
    /// Degrees that are high enough to be cut later, when the light is known: P = 24 and the least F, at most
    /// 255, that loses at most 1e-7 of what F = 255 holds. Fast, because every material is sampled on the
    /// same nodes; tests: within 0.2 % of the norm of the exact coefficients, for all models that 255 degrees
    /// hold.
    Full,
    /// Degrees for an estimate of what a cut loses, when the light has a degree F: that F and P = 20, at
    /// a third of the samples of [`Choice::Full`]. Tests: within 1 % of the norm of the exact coefficients
    /// up to F.
    Sketch {
        /// The highest degree F that the light has.
        f: Degree,
    },
    /// The given degrees, whatever they lose.
    Degree {
        /// The degree F in the incident direction.
        f: Degree,
        /// The degree P in the outgoing direction. If it is above F, the coefficients with q > F are zero.
        p: Degree,
    },
}

impl Choice {
    /// The number of times that [`project`] asks whether to stop; `None` if that is not known
    /// beforehand.
    pub fn steps(self) -> Option<usize> {
        (self == Self::Full).then(full::steps)
    }
}

/// A material in spherical harmonics, and the share of its energy that they hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Projection {
    /// rho_lpq up to the chosen degrees.
    pub coefficients: BrdfCoefficients,
    /// Sum over p, q and channels of |rho_lpq|^2, for l = 0 ..= F; both signs of q count.
    pub energy: Vec<f64>,
    /// Sum over q, both signs, and channels of |rho_lpq|^2, shape [F+1, P+1].
    pub energy_lp: Vec<f64>,
    /// The material's energy, the integral of rho_hat^2 over both directions, summed over channels.
    pub total: f64,
    /// The share of the material's energy that the coefficients hold, 0 to 1; 1 for a black material.
    pub captured: f64,
    /// The difference of two quadrature rules in the energy, summed over all panels and relative to it: many
    /// times the error if rho_hat is smooth, about the error if it is not. 0 for a closed form.
    pub uncertainty: f64,
    /// Whether the material changes when it is turned about its normal. If so, the coefficients are those of
    /// its mean over all turns.
    pub anisotropic: bool,
}

/// The coefficients of a material, exact in closed form for the radially symmetric models.
///
/// For the others they are accurate to 1e-6 of their norm if rho_hat is smooth above its horizon, and to
/// [`Projection::uncertainty`] if it has kinks or is a table. If rho_hat does not depend on the azimuth, the
/// coefficients with q > 0 are exactly zero. Uses all threads; the result does not depend on their number.
/// `stop` is asked every few milliseconds, on every thread.
///
/// # Errors
/// If the degrees tried for a tolerance hold too little of the energy, the given degrees have too many
/// coefficients, the material has a value that is not finite, or it was stopped.
///
/// # Example: degree 2 captures 99 percent of a Lambertian surface
/// ```
/// use brdf::{Choice, Lambert, Material, project};
/// let chalk = Material::Lambert(Lambert::new([0.9; 3])?);
/// let choice = Choice::Tolerance(sh::Tolerance::new(0.01)?);
/// let projection = project(&chalk, choice, sh::Stop::NEVER)?;
/// assert_eq!(projection.coefficients.f().get(), 2);
/// assert!(projection.captured > 0.99);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn project(material: &Material, choice: Choice, stop: Stop<'_>) -> Result<Projection, ProjectionError> {
    if let Choice::Degree { f, p } = choice {
        let (f, p) = (f.get(), p.get());
        if (f + 1) * (p + 1) * (p + 1) > MOST_COEFFICIENTS {
            return Err(ProjectionError::TooMany { f, p });
        }
    }
    if let Some(lobe) = material.radial() {
        return radial(material.centre(), &lobe, choice);
    }
    let centre = material.centre();
    // Models about the tangent do not depend on the azimuth about it: a turn about the normal does not
    // matter.
    let anisotropic = !material.is_isotropic() && centre != Centre::Tangent;
    let turns = material.turns();
    let rho_hats = |outgoing: Direction, incident: &[Direction], values: &mut [[f64; 3]]| {
        material.means_over_turns(turns, outgoing, incident, values);
    };
    let mut projection = general(centre, &rho_hats, !material.has_horizon(), choice, stop)?;
    projection.anisotropic = anisotropic;
    Ok(projection)
}

/// The closed form of a function of theta_i.
fn radial(centre: Centre, lobe: &ClampedCosine, choice: Choice) -> Result<Projection, ProjectionError> {
    let total = lobe.energy();
    let (f, p) = match choice {
        Choice::Degree { f, p } => (f, p),
        Choice::Full | Choice::Sketch { .. } => {
            let f = full::enough(&energies(&lobe.coefficients(full::F), 0));
            (Degree::new(f).unwrap_or(Degree::MAX), Degree::ZERO)
        }
        Choice::Tolerance(tolerance) => {
            let highest = Degree::MAX.get();
            let energy = energies(&lobe.coefficients(highest), 0);
            let f = degree_holding(&energy, total, tolerance).and_then(|l| Degree::new(l).ok());
            let captured = energy.iter().sum::<f64>() / total;
            let tolerance = tolerance.get();
            (f.ok_or(ProjectionError::TooSharp { f: highest, p: 0, captured, tolerance })?, Degree::ZERO)
        }
    };
    let per_l = (p.get() + 1) * (p.get() + 1);
    let mut rho = vec![[0.0; 3]; (f.get() + 1) * per_l];
    for (l, value) in lobe.coefficients(f.get()).into_iter().enumerate() {
        rho[l * per_l] = value;
    }
    Projection::new(centre, f, p, rho, total)
}

/// The coefficients of any rho_hat, which is given in the frame of the surface, and reflects light from below
/// the horizon or not.
fn general(
    centre: Centre,
    rho_hats: RhoHats<'_>,
    below: bool,
    choice: Choice,
    stop: Stop<'_>,
) -> Result<Projection, ProjectionError> {
    let source = Source { centre, rho_hats, below, stop };
    let (table, f, p) = match choice {
        Choice::Degree { f, p } => {
            let scale = coarse(source)?;
            (
                tabulate(source, f.get(), p.get(), AllowedDifference { scale, accuracy: ACCURACY })?,
                f.get(),
                p.get(),
            )
        }
        Choice::Tolerance(tolerance) => least(source, tolerance)?,
        Choice::Full => full::full(source, Grid::full())?,
        Choice::Sketch { f } => full::full(source, Grid::sketch(f.get()))?,
    };
    let count = (f + 1) * (p + 1) * (p + 1);
    let rho = if table.p == p {
        let mut rho = table.rho;
        rho.truncate(count);
        rho
    } else {
        let mut rho = Vec::with_capacity(count);
        for rows in table.rho.chunks_exact((table.p + 1) * (table.p + 1)).take(f + 1) {
            for row in rows.chunks_exact(table.p + 1).take(p + 1) {
                rho.extend_from_slice(&row[..=p]);
            }
        }
        rho
    };
    let degree = |l| Degree::new(l).map_err(|_| ProjectionError::TooMany { f, p });
    let projection = Projection::new(centre, degree(f)?, degree(p)?, rho, table.total)?;
    Ok(Projection { uncertainty: table.error, ..projection })
}

impl Projection {
    fn new(
        centre: Centre,
        f: Degree,
        p: Degree,
        rho: Vec<[f64; 3]>,
        total: f64,
    ) -> Result<Self, ProjectionError> {
        let energy_lp = energies(&rho, p.get());
        let energy: Vec<f64> = energy_lp.chunks_exact(p.get() + 1).map(|row| row.iter().sum()).collect();
        let captured = if total > 0.0 { (energy.iter().sum::<f64>() / total).min(1.0) } else { 1.0 };
        let coefficients = BrdfCoefficients::new(centre, f, p, rho)
            .ok_or(ProjectionError::TooMany { f: f.get(), p: p.get() })?;
        Ok(Self { coefficients, energy, energy_lp, total, captured, uncertainty: 0.0, anisotropic: false })
    }

    /// The share of the energy that each p holds, p = 0 ..= P; 1 at p = 0 for a black material.
    pub fn energy_per_p(&self) -> Vec<f64> {
        let side = self.coefficients.p().get() + 1;
        let share = |p: usize| {
            let sum: f64 = self.energy_lp.iter().skip(p).step_by(side).sum();
            if self.total > 0.0 { sum / self.total } else { f64::from(u8::from(p == 0)) }
        };
        (0..side).map(share).collect()
    }
}

/// Whether light from below the horizon is reflected, tested at a few hundred directions.
pub(crate) fn reaches_below(rho_hat: &dyn Fn(Direction, Direction) -> [f64; 3]) -> bool {
    let step = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    (0..7 * 7 * 7).any(|i| {
        let view = Direction::from_angles(TAU / 4.0 * step(i % 7, 7), 0.0);
        let incident =
            Direction::from_angles(TAU / 4.0 * (1.0 + step(i / 7 % 7, 7)), TAU / 2.0 * step(i / 49, 7));
        rho_hat(incident, view) != [0.0; 3]
    })
}
