//! Exchange: the nearest non-negative function of a linear space, from the bottoms of its valleys.
//!
//! The values of a function g are linear in its coefficients x, at a place w: g(w) = r(w) . x. That g is
//! nowhere negative is an inequality for every w. They are found by exchange: the bottoms of all valleys
//! below zero become inequalities, the nearest function that meets all inequalities so far is found
//! ([`NearestInHalfSpaces`]), and so on until no bottom is below -1e-6 of the largest value. What is left is
//! lifted by a constant. The first coefficient must be that of the constant function.
//!
//! If the mean is kept, the first coefficient does not take part, and a function is lifted by scaling what
//! varies.

use crate::{HalfSpace, NearestInHalfSpaces, Stop, Stopped};

/// Values above minus this share of the largest one are left to the lift.
const CLOSE: f64 = 1e-6;

/// The accuracy of a minimum that is found, as a share of the largest value.
const SEARCH: f64 = 1e-9;

/// Exchanges after which the rest is left to the lift. A free mean takes 10 to 30 of them.
pub const ROUNDS: usize = 100;

/// Whether the mean of a function may change, each channel for itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mean {
    /// The mean may change, and never falls: the function is the nearest of all.
    Free,
    /// The mean stays.
    Kept,
}

/// Why no useful non-negative function is near the one given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoneNear {
    /// The nearest non-negative function is black, though the function is not.
    NoMass,
    /// The mean is to be kept, but it has this value, which is not positive.
    NoPositiveMean(f64),
}

/// The nearest non-negative function of one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// The coefficients of the function.
    pub coefficients: Vec<f64>,
    /// The share of the largest value by which the function was lifted: 1e-6 or less if the exchange ended.
    pub lifted: f64,
    /// The least value of the function, 0 or more.
    pub least: f64,
}

/// The search for the nearest non-negative function of one channel.
#[derive(Clone, Debug)]
pub struct Exchange {
    point: NearestInHalfSpaces,
    /// The length of the coefficients as given.
    length: f64,
    largest: f64,
    constant: f64,
    mean: Mean,
}

impl Exchange {
    /// Starts the search for a function of these coefficients whose largest value is `largest`; `constant` is
    /// the value of the constant function whose first coefficient is 1.
    ///
    /// # Errors
    /// If the function is not black but nowhere positive, or its mean is to be kept and not positive.
    pub fn new(coefficients: Vec<f64>, largest: f64, constant: f64, mean: Mean) -> Result<Self, NoneNear> {
        let length = length(&coefficients);
        if length > 0.0 {
            let value = coefficients[0] * constant;
            if largest <= 0.0 {
                return Err(NoneNear::NoMass);
            }
            if mean == Mean::Kept && value <= 0.0 {
                return Err(NoneNear::NoPositiveMean(value));
            }
        }
        Ok(Self { point: NearestInHalfSpaces::new(coefficients), length, largest, constant, mean })
    }

    /// The coefficients of the nearest function under the inequalities so far.
    pub fn coefficients(&self) -> &[f64] {
        self.point.point()
    }

    /// Makes the valleys' bottoms that are below zero inequalities: for each bottom, its value and its row
    /// r(w), lowest first. Whether that moved the function. `stop` is asked for each inequality.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn add(
        &mut self,
        bottoms: impl IntoIterator<Item = (f64, Vec<f64>)>,
        stop: Stop<'_>,
    ) -> Result<bool, Stopped> {
        let below: Vec<(f64, Vec<f64>)> = bottoms.into_iter().take_while(|(value, _)| *value < 0.0).collect();
        let worst = below.first().map_or(0.0, |(value, _)| -value);
        if worst <= CLOSE * self.largest {
            return Ok(false);
        }
        let longest = below.iter().map(|(_, row)| length(row)).fold(0.0, f64::max);
        let half_space = |(_, mut normal): (f64, Vec<f64>)| match self.mean {
            Mean::Free => HalfSpace { normal, bound: 0.0 },
            Mean::Kept => {
                let bound = -normal[0] * self.point.point()[0];
                normal[0] = 0.0;
                HalfSpace { normal, bound }
            }
        };
        let half_spaces = below.into_iter().map(half_space).collect();
        // The inequalities move until the end: to meet them closely before is in vain.
        self.point.add(half_spaces, 0.1 * worst / longest, stop)
    }

    /// The function at the end of the exchange, if `least` is its least value: lifted, if that is below zero.
    ///
    /// # Errors
    /// If the function is black and was not.
    pub fn finish(self, least: f64) -> Result<Found, NoneNear> {
        let mut coefficients = self.point.point().to_vec();
        if self.length > 0.0 && length(&coefficients) < 1e-6 * self.length {
            return Err(NoneNear::NoMass);
        }
        if least >= 0.0 {
            return Ok(Found { coefficients, lifted: 0.0, least });
        }
        let lifted = -least / self.largest;
        let height = SEARCH * self.largest - least;
        let share = match self.mean {
            Mean::Free => {
                coefficients[0] += height / self.constant;
                1.0
            }
            Mean::Kept => {
                let mean = coefficients[0] * self.constant;
                let share = mean / (mean + height);
                coefficients[1..].iter_mut().for_each(|value| *value *= share);
                share
            }
        };
        Ok(Found { coefficients, lifted, least: share * SEARCH * self.largest })
    }
}

fn length(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}
