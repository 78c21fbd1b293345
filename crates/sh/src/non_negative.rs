//! The least window that leaves a function nowhere negative.
//!
//! Light is not negative, but a series cut at degree F around a small bright sun is. The family searched is
//! the Laplacian window, which has one strength, lambda, and loses the least for the smoothness that it buys
//! ([`crate::Window`]; Sloan 2008 raises lambda until the function is well-behaved). As lambda grows the
//! function tends to its mean, so that some lambda does; bisection then finds the strength at which its
//! minimum leaves zero.

use crate::minimum::Search;
use crate::{Expansion, Minimum, Penalty, Window, energy_per_degree};

/// A function that was made non-negative.
#[derive(Clone, Debug, PartialEq)]
pub struct NonNegative {
    /// The windowed function: its minimum is 0 or more.
    pub expansion: Expansion,
    /// The strength of the Laplacian window; 0 if the function was not negative.
    pub penalty: Penalty,
    /// The least value of the function as given.
    pub before: Minimum,
    /// The least value of the windowed function.
    pub after: Minimum,
}

/// A function whose mean is negative, or zero though the function is not: no window can make it non-negative.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("channel {channel} has mean {mean}: no window makes it non-negative")]
pub struct NoPositiveMean {
    /// The channel: 0, 1, 2 for red, green, blue.
    pub channel: usize,
    /// The channel's mean over all directions.
    pub mean: f64,
}

/// The ratio of the strengths between which bisection stops.
const CLOSE: f64 = 1.001;

/// Applies the weakest Laplacian window that makes every channel non-negative, to within 0.1 percent of its
/// strength.
///
/// One window serves all channels, so that colours do not shift. A black channel is left black. Takes some 10
/// searches for a minimum ([`crate::minimum`]) and as many syntheses on their grids.
///
/// # Errors
/// If a channel's mean is negative, or 0 (or next to it) though the channel is not black, or a coefficient is
/// not finite.
pub fn non_negative(expansion: &Expansion) -> Result<NonNegative, NoPositiveMean> {
    let energy = energy_per_degree(expansion);
    for channel in 0..3 {
        let total: f64 = energy.iter().map(|part| part[channel]).sum();
        let mean = expansion.get(0, 0)[channel] * 0.5 / std::f64::consts::PI.sqrt();
        if !(mean > 0.0 || total == 0.0) || !total.is_finite() {
            return Err(NoPositiveMean { channel, mean });
        }
    }
    let search = Search::new(expansion);
    let with = |lambda: f64| {
        let window = Window::Laplacian(Penalty::new(lambda).unwrap_or(Penalty::ZERO));
        let windowed = window.apply(expansion);
        search.if_non_negative(&windowed).map(|least| (windowed, least))
    };
    let before = search.run(expansion);
    if before.value >= 0.0 {
        let expansion = expansion.clone();
        return Ok(NonNegative { expansion, penalty: Penalty::ZERO, before, after: before });
    }
    // A strength at which the highest degree is halved, and up from there; past 1e300 nothing but the mean is
    // left.
    let degree = expansion.degree().get() as f64;
    let mut weak = 0.0;
    let mut strong = math::powi(degree * (degree + 1.0), -2);
    let mut best = loop {
        if let Some(found) = with(strong) {
            break found;
        }
        (weak, strong) = (strong, strong * 16.0);
        if strong > 1e300 {
            let mean = expansion.get(0, 0)[before.channel] * 0.5 / std::f64::consts::PI.sqrt();
            return Err(NoPositiveMean { channel: before.channel, mean });
        }
    };
    if weak == 0.0 {
        // The first strength was enough: look below it.
        weak = strong;
        while weak > 1e-300 {
            weak /= 16.0;
            let Some(tried) = with(weak) else { break };
            (strong, best) = (weak, tried);
        }
    }
    while strong / weak > CLOSE {
        let middle = (strong * weak).sqrt();
        match with(middle) {
            Some(tried) => (strong, best) = (middle, tried),
            None => weak = middle,
        }
    }
    let (expansion, after) = best;
    Ok(NonNegative { expansion, penalty: Penalty::new(strong).unwrap_or(Penalty::ZERO), before, after })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;
    use sphere::Direction;

    /// A sun of a few pixels on a dim sky, cut at a degree far too low for it.
    fn sun(top: usize) -> Expansion {
        let axis = Direction::from_angles(0.8, 0.3);
        let mut y_l0 = vec![0.0; top + 1];
        crate::zonal_into(1.0, &mut y_l0);
        let mut f =
            Expansion::zonal(axis, Degree::new(top).unwrap(), |l| [1.0, 0.9, 0.0].map(|v| v * y_l0[l]));
        f.coefficients_mut()[0][0] += 0.2;
        f
    }

    #[test]
    fn a_small_sun_rings_and_the_window_calms_it() {
        for top in [2, 4, 9, 20] {
            let result = non_negative(&sun(top)).unwrap();
            assert!(result.before.value < -1e-3, "{top}: {:?}", result.before);
            assert!(result.after.value >= 0.0, "{top}: {:?}", result.after);
            // The least: a window 1 percent weaker leaves the function negative.
            let weaker = Window::Laplacian(Penalty::new(result.penalty.get() * 0.99).unwrap());
            assert!(crate::minimum(&weaker.apply(&sun(top))).value < 0.0, "{top}");
            assert_eq!(result.expansion.get(0, 0), sun(top).get(0, 0), "the mean is kept");
            assert_eq!(result.expansion.get(1, 0)[2], 0.0, "a black channel stays black");
        }
    }

    #[test]
    fn a_function_that_is_not_negative_is_left_alone() {
        let mut f = Expansion::zero(Degree::new(3).unwrap());
        f.coefficients_mut()[0] = [1.0; 3];
        f.coefficients_mut()[5] = [0.2; 3];
        let result = non_negative(&f).unwrap();
        assert_eq!((result.penalty, &result.expansion), (Penalty::ZERO, &f));
    }

    #[test]
    fn a_mean_that_is_not_positive_is_an_error() {
        let mut f = Expansion::zero(Degree::new(1).unwrap());
        assert_eq!(non_negative(&f).unwrap().penalty, Penalty::ZERO, "black is not negative");
        f.coefficients_mut()[2][1] = 1.0;
        assert_eq!(non_negative(&f).unwrap_err().channel, 1);
        f.coefficients_mut()[0] = [1.0, -1.0, 1.0];
        assert!(non_negative(&f).unwrap_err().mean < 0.0);
        // Past any strength that a double holds: 1e-301 of the slope is left, and it is larger than this
        // mean.
        f.coefficients_mut()[0] = [1e-310; 3];
        assert!(non_negative(&f).is_err());
        f.coefficients_mut()[0] = [f64::NAN; 3];
        assert!(non_negative(&f).is_err());
    }
}
