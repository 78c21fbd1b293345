//! The nearest non-negative function in least squares.
//!
//! A series that is cut at degree F is negative where it rings. Of all functions of degree F without negative
//! values, g is the one that is nearest in the integral of (g - f)^2. It meets an inequality for each
//! direction w, g(w) = sum of g_lm Y_lm(w) >= 0, so that
//!
//! > g = f + sum of k_i K(w_i . w),  K(w_i . w) = sum of Y_lm(w_i) Y_lm(w),  k_i >= 0,
//!
//! where g touches zero in the directions w_i, which are found by [`crate::exchange`]. If the mean is kept,
//! l = 0 does not take part in the sum.
//!
//! A window ([`crate::non_negative`]) changes a function far more, but leaves it smooth, and is the same for
//! all channels.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::exchange::{Exchange, Mean, NoneNear, ROUNDS};
use crate::minimum::{Search, Starts};
use crate::{Basis, Expansion, Minimum, Stop, Stopped};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// The nearest non-negative function.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// The function: its minimum is 0 or more.
    pub expansion: Expansion,
    /// The root of the integral of (g - f)^2 over that of f^2, channels together; 0 for black.
    pub change: f64,
    /// The depth below zero that was lifted at the end, as a share of the channel's largest value: 1e-6 or
    /// less if the exchange ended.
    pub lifted: f64,
    /// The least value of the function as given.
    pub before: Minimum,
    /// The least value of the nearest function.
    pub after: Minimum,
}

/// A function that has no useful non-negative function near it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NearestError {
    /// A coefficient is infinite or not a number.
    #[error("the coefficient of (l, m) = ({l}, {m}) is not finite in channel {channel}")]
    NotFinite {
        /// The degree of the first such coefficient.
        l: usize,
        /// The order of the first such coefficient.
        m: isize,
        /// The channel of the first such coefficient: 0, 1, 2 for red, green, blue.
        channel: usize,
    },
    /// The nearest non-negative function is black, though the function is not.
    #[error("channel {channel} has no mass: black is the nearest non-negative function")]
    NoMass {
        /// The channel: 0, 1, 2 for red, green, blue.
        channel: usize,
    },
    /// The mean is to be kept, but it is not positive.
    #[error("channel {channel} has mean {mean}: no non-negative function has it")]
    NoPositiveMean {
        /// The channel: 0, 1, 2 for red, green, blue.
        channel: usize,
        /// The channel's mean over all directions.
        mean: f64,
    },
    /// The search was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The nearest non-negative function of the same degree, each channel for itself.
///
/// Accuracy: the function is lifted by at most 1e-6 of the largest value, and is then 0 or more everywhere,
/// to 1e-8 of that. If the mean is kept and the lobe is narrow for its degree, 100 exchanges may not suffice,
/// so that the function is not quite the nearest ([`Nearest::lifted`]). Tests compare with another method,
/// and with the defining property of a projection. A black channel stays black. The result does not depend on
/// the number of threads.
///
/// Time, on one thread: for three channels of a sky with a sun, 6 s at degree 16 and a minute and a half at
/// degree 32; it grows by up to the sixth power of the degree. `stop` is asked every few milliseconds, on
/// every thread.
///
/// # Errors
/// If a coefficient is not finite, a channel is not black but the nearest function is, its mean is to be kept
/// and not positive, or it was stopped.
///
/// # Example: the nearest function to a lobe that rings touches zero
/// ```
/// let degree = sh::Degree::new(2)?;
/// let lobe = sh::Expansion::zonal(sphere::Direction::X, degree, |l| [(2 * l + 1) as f64; 3]);
/// let nearest = sh::nearest_non_negative(&lobe, sh::Mean::Free, sh::Stop::NEVER)?;
/// assert!(nearest.before.value < -0.5);
/// assert!((0.0..1e-5).contains(&nearest.after.value));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn nearest_non_negative(
    expansion: &Expansion,
    mean: Mean,
    stop: Stop<'_>,
) -> Result<Nearest, NearestError> {
    check_finite(expansion)?;
    let search = Search::new(expansion);
    let largest = search.largest(expansion);
    let channel_of = |channel: usize| {
        let target = expansion.coefficients().iter().map(|rgb| rgb[channel]).collect();
        Exchange::new(target, largest[channel], y_00(), mean).map_err(|none| NearestError::of(channel, none))
    };
    let mut channels = [channel_of(0)?, channel_of(1)?, channel_of(2)?];
    let mut nearest = expansion.clone();
    let mut starts = Starts::Lowest;
    let mut bottoms = search.bottoms(&nearest, starts, &Default::default(), stop)?;
    let before = search.run(expansion);
    stop.check()?;
    for _ in 0..ROUNDS {
        let moved: Result<Vec<bool>, Stopped> = channels
            .par_iter_mut()
            .zip(&bottoms)
            .map(|(channel, bottoms)| {
                let row = |bottom: &Minimum| (bottom.value, row(search.basis(), bottom));
                channel.add(bottoms.iter().map(row), stop)
            })
            .collect();
        // What is left when the lowest pixels lead to nothing below zero, only a search from all finds.
        starts = match (moved?.contains(&true), starts) {
            (true, _) => Starts::Lowest,
            (false, Starts::Lowest) => Starts::All,
            (false, Starts::All) => break,
        };
        for (row, rgb) in nearest.coefficients_mut().iter_mut().enumerate() {
            *rgb = [0, 1, 2].map(|channel| channels[channel].coefficients()[row]);
        }
        bottoms = search.bottoms(&nearest, starts, &bottoms, stop)?;
    }
    if starts == Starts::Lowest {
        bottoms = search.bottoms(&nearest, Starts::All, &bottoms, stop)?;
    }
    let mut lifted: f64 = 0.0;
    for (channel, exchange) in channels.into_iter().enumerate() {
        let least = bottoms[channel].first().map_or(0.0, |bottom| bottom.value);
        let found = exchange.finish(least).map_err(|none| NearestError::of(channel, none))?;
        lifted = lifted.max(found.lifted);
        let rows = nearest.coefficients_mut().iter_mut().zip(found.coefficients);
        rows.for_each(|(rgb, value)| rgb[channel] = value);
    }
    let after = search.run(&nearest);
    let parts = |f: fn(f64, f64) -> f64| {
        let pairs = nearest.coefficients().as_flattened().iter().zip(expansion.coefficients().as_flattened());
        pairs.map(|(g, f_lm)| f(*g, *f_lm)).sum::<f64>()
    };
    let (changed, total) = (parts(|g, f| math::powi(g - f, 2)), parts(|_, f| f * f));
    let change = if total > 0.0 { (changed / total).sqrt() } else { 0.0 };
    Ok(Nearest { expansion: nearest, change, lifted, before, after })
}

impl NearestError {
    fn of(channel: usize, none: NoneNear) -> Self {
        match none {
            NoneNear::NoMass => Self::NoMass { channel },
            NoneNear::NoPositiveMean(mean) => Self::NoPositiveMean { channel, mean },
        }
    }
}

/// The value of each Y_lm at a bottom.
fn row(basis: &Basis, bottom: &Minimum) -> Vec<f64> {
    let mut row = vec![0.0; basis.degree().rows()];
    basis.evaluate_into(bottom.direction, &mut row);
    row
}

fn check_finite(expansion: &Expansion) -> Result<(), NearestError> {
    for l in 0..=expansion.degree().get() {
        for m in -(l as isize)..=l as isize {
            if let Some(channel) = expansion.get(l, m).iter().position(|value| !value.is_finite()) {
                return Err(NearestError::NotFinite { l, m, channel });
            }
        }
    }
    Ok(())
}

fn y_00() -> f64 {
    0.5 / PI.sqrt()
}

#[cfg(test)]
mod tests;
