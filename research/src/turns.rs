//! Times of runs on a machine that does other things as well, and the power laws that such times follow.
//!
//! Runs take turns, and what counts is the processor time of all threads: the work that a run costs.

use std::hint::black_box;
use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};

/// The fewest rounds.
const ROUNDS: usize = 5;

/// Seconds that a run has for its rounds, on average.
const SECONDS: f64 = 0.5;

/// Something to time.
pub type Run<'a> = Box<dyn FnMut() + 'a>;

/// A run of a function, whose value is dropped.
pub fn run<'a, T>(mut function: impl FnMut() -> T + 'a) -> Run<'a> {
    Box::new(move || drop(black_box(function())))
}

/// The median processor seconds of each run, after a round to warm up.
pub fn median_seconds(runs: &mut [Run<'_>]) -> Vec<f64> {
    runs.iter_mut().for_each(|run| run());
    let (mut seconds, begun) = (vec![Vec::new(); runs.len()], Instant::now());
    while seconds[0].len() < ROUNDS || begun.elapsed().as_secs_f64() < SECONDS * runs.len() as f64 {
        for (run, seconds) in runs.iter_mut().zip(&mut seconds) {
            let start = processor_seconds();
            run();
            seconds.push(processor_seconds() - start);
        }
    }
    seconds.into_iter().map(median).collect()
}

/// The seconds that all threads have computed.
fn processor_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// The median; of an even number of values the upper one.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// y = factor x^exponent.
#[derive(Clone, Copy, Debug)]
pub struct PowerLaw {
    /// The value at x = 1.
    pub factor: f64,
    /// The slope in logarithms.
    pub exponent: f64,
    /// The RMS of the relative differences of the points from the law.
    pub residual: f64,
}

impl PowerLaw {
    /// The law that fits points (x, y) best, by least squares of logarithms.
    ///
    /// # Example: a square has the exponent 2
    /// ```
    /// let law = research::turns::PowerLaw::of(&[(1.0, 3.0), (2.0, 12.0), (4.0, 48.0)]);
    /// assert!((law.exponent - 2.0).abs() < 1e-12 && (law.factor - 3.0).abs() < 1e-12);
    /// ```
    pub fn of(points: &[(f64, f64)]) -> Self {
        let count = points.len() as f64;
        let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
        let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / count;
        let (x, y) = (mean(|log| log.0), mean(|log| log.1));
        let along: f64 = logs.iter().map(|log| (log.0 - x).powi(2)).sum();
        let exponent = logs.iter().map(|log| (log.0 - x) * (log.1 - y)).sum::<f64>() / along;
        let law = Self { factor: (y - exponent * x).exp(), exponent, residual: 0.0 };
        let squares = points.iter().map(|&(x, y)| (y / law.at(x) - 1.0).powi(2)).sum::<f64>();
        Self { residual: (squares / count).sqrt(), ..law }
    }

    /// The value at `x`.
    pub fn at(&self, x: f64) -> f64 {
        self.factor * x.powf(self.exponent)
    }

    /// Where two laws have the same value.
    pub fn crossing(&self, other: &Self) -> f64 {
        (self.factor / other.factor).powf((other.exponent - self.exponent).recip())
    }
}
