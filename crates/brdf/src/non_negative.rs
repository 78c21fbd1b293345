//! The nearest transfer function without negative values.
//!
//! Coefficients that are cut at degrees [F, P] make rho_hat ring, also below zero. Of all functions with the
//! same degrees and without negative values, the nearest has the least integral of the squared difference
//! over both directions. With x_lpq = sqrt(2 - delta_q0) rho_lpq that integral is the sum of the squared
//! differences of x, since rho_lpq stands for q and -q; and with phi the azimuth between both directions,
//!
//! > rho_hat = sum of x_lpq sqrt(2 - delta_q0) f_lq(theta_i) f_pq(theta_o) cos(q phi),
//!
//! f_lq(theta) e^(i q phi) being Y_lq. So each (theta_i, theta_o, phi) is an inequality for x, and they are
//! found by [`sh::exchange`], as those of [`sh::nearest_non_negative`]. If the mean is kept, what is
//! reflected in total stays.
//!
//! Valleys are followed to their bottom by Newton's method, from places of a grid with six samples on the
//! shortest wave of each angle. The nearest function touches zero on the floors of long valleys, which are
//! steep across the grid: along one floor there may be several bottoms that differ by 1e-4 of the largest
//! value, and places of the grid are too far from the floor to tell them apart. So the places that are the
//! lowest among their neighbours, and the bottoms found before, are followed first. If no bottom is below
//! zero any more, every place is followed in whose cell of the grid a bottom can be. It is at most half a
//! step away along each angle, together 3 * 30 degrees of a wave, over which a function between 0 and M that
//! touches 0 rises to at most M / 2 (1 - cos(90 degrees)) (M. Riesz): higher places need not be followed.
//! Beyond a pole, theta goes on: f_lq(-theta) = (-1)^q f_lq(theta).

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use sh::exchange::{Exchange, NoneNear, ROUNDS};
use sh::{Basis, Degree, Mean, Stop, Stopped};

use crate::BrdfCoefficients;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// The most unknowns x_lpq: those of degrees [30, 8] and of [23, 10] are fewer.
pub const MOST_UNKNOWNS: usize = 1500;

/// The nearest transfer function without negative values.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestBrdf {
    /// The coefficients of the nearest function, with the centre and the degrees of those given.
    pub coefficients: BrdfCoefficients,
    /// The root of the integral of (g - rho_hat)^2 over that of rho_hat^2, channels together; 0 for black.
    pub change: f64,
    /// The least value of the function as given, in 1/sr.
    pub before: f64,
    /// The least value of the nearest function, in 1/sr: 0 or more.
    pub after: f64,
}

/// A transfer function that has no useful non-negative one near it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NearestBrdfError {
    /// There are more than [`MOST_UNKNOWNS`].
    #[error(
        "degrees [{f}, {p}] have {unknowns} coefficients, more than the {MOST_UNKNOWNS} for non-negative"
    )]
    TooMany {
        /// The degree F in the incident direction.
        f: usize,
        /// The degree P in the outgoing direction.
        p: usize,
        /// The number of [`unknowns`] of these degrees.
        unknowns: usize,
    },
    /// The nearest non-negative function is black, though the function is not.
    #[error("channel {channel} has no mass: black is the nearest non-negative function")]
    NoMass {
        /// The channel: 0, 1, 2 for red, green, blue.
        channel: usize,
    },
    /// The mean is to be kept, but it is not positive.
    #[error("channel {channel} has mean {mean} 1/sr: no non-negative function has it")]
    NoPositiveMean {
        /// The channel: 0, 1, 2 for red, green, blue.
        channel: usize,
        /// The mean of rho_hat over both directions, in 1/sr.
        mean: f64,
    },
    /// The search was stopped.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The number of rho_lpq with 0 <= q <= min(l, p), l up to `f` and p up to `p`.
///
/// # Example: a radially symmetric material has one for each l
/// ```
/// assert_eq!(brdf::unknowns(5, 0), 6);
/// assert_eq!(brdf::unknowns(1, 1), 5);
/// ```
pub fn unknowns(f: usize, p: usize) -> usize {
    (0..=f).map(|l| (0..=p).map(|p| l.min(p) + 1).sum::<usize>()).sum()
}

/// The nearest function of the same degrees without negative values, each channel for itself. `stop` is asked
/// every few milliseconds, on every thread.
///
/// Accuracy: the function is lifted by at most 1e-6 of the largest value, and is then 0 or more everywhere,
/// to 1e-8 of that, if 100 exchanges suffice. Its distance from the one given is the least to about 1e-5 of
/// the norm, and so its coefficients are those of the nearest to about 1e-3 of it; tests compare with
/// [`sh::nearest_non_negative`]. A black channel stays black. The result does not depend on the number of
/// threads.
///
/// # Errors
/// If there are too many unknowns, a channel is not black but the nearest function is, its mean is to be kept
/// and not positive, or it was stopped.
pub fn nearest_non_negative(
    coefficients: &BrdfCoefficients,
    mean: Mean,
    stop: Stop<'_>,
) -> Result<NearestBrdf, NearestBrdfError> {
    let (f, p) = (coefficients.f().get(), coefficients.p().get());
    let unknowns = unknowns(f, p);
    if unknowns > MOST_UNKNOWNS {
        return Err(NearestBrdfError::TooMany { f, p, unknowns });
    }
    let search = Search::new(coefficients);
    let given = [0, 1, 2].map(|channel| search.unknowns(coefficients, channel));
    let found: Vec<Result<Channel, NearestBrdfError>> =
        given.par_iter().enumerate().map(|(channel, x)| nearest(&search, channel, x, mean, stop)).collect();
    // The error of the first channel that has one, whichever ended first.
    let found = found.into_iter().collect::<Result<Vec<Channel>, _>>()?;
    let mut rho = vec![[0.0; 3]; coefficients.rho().len()];
    for (channel, found) in found.iter().enumerate() {
        for (term, x) in search.terms.iter().zip(&found.x) {
            rho[(term.l * (p + 1) + term.p) * (p + 1) + term.q][channel] = x / term.root;
        }
    }
    let total: f64 = given.iter().flatten().map(|x| x * x).sum();
    let pairs = given.iter().zip(&found).flat_map(|(x, found)| x.iter().zip(&found.x));
    let changed: f64 = pairs.map(|(f, g)| math::powi(f - g, 2)).sum();
    let least = |value: fn(&Channel) -> f64| found.iter().map(value).fold(f64::INFINITY, f64::min);
    let (before, after) = (least(|channel| channel.before), least(|channel| channel.after));
    let coefficients = BrdfCoefficients::new(coefficients.centre(), coefficients.f(), coefficients.p(), rho)
        .unwrap_or_else(|| coefficients.clone());
    let change = if total > 0.0 { (changed / total).sqrt() } else { 0.0 };
    Ok(NearestBrdf { coefficients, change, before, after })
}

impl NearestBrdfError {
    fn of(channel: usize, none: NoneNear) -> Self {
        match none {
            NoneNear::NoMass => Self::NoMass { channel },
            NoneNear::NoPositiveMean(mean) => Self::NoPositiveMean { channel, mean },
        }
    }
}

/// One channel of the nearest function.
struct Channel {
    x: Vec<f64>,
    before: f64,
    after: f64,
}

fn nearest(
    search: &Search,
    channel: usize,
    x: &[f64],
    mean: Mean,
    stop: Stop<'_>,
) -> Result<Channel, NearestBrdfError> {
    let none_near = |none| NearestBrdfError::of(channel, none);
    let mut starts = Starts::Lowest;
    let (mut bottoms, largest) = search.bottoms(x, starts, &[], stop)?;
    let least = |bottoms: &[Bottom]| bottoms.first().map_or(0.0, |bottom| bottom.value);
    let before = least(&bottoms);
    // The first unknown is x_000, and Y_00^2 is 1 / (4 pi).
    let mut exchange = Exchange::new(x.to_vec(), largest, 0.25 * FRAC_1_PI, mean).map_err(none_near)?;
    for _ in 0..ROUNDS {
        stop.check()?;
        let rows = bottoms.iter().map(|bottom| (bottom.value, search.row(bottom.place)));
        starts = match (exchange.add(rows, stop)?, starts) {
            (true, _) => Starts::Lowest,
            (false, Starts::Lowest) => Starts::All,
            (false, Starts::All) => break,
        };
        bottoms = search.bottoms(exchange.coefficients(), starts, &bottoms, stop)?.0;
    }
    if starts == Starts::Lowest {
        bottoms = search.bottoms(exchange.coefficients(), Starts::All, &bottoms, stop)?.0;
    }
    let found = exchange.finish(least(&bottoms)).map_err(none_near)?;
    Ok(Channel { x: found.coefficients, before, after: found.least })
}

/// theta_i, theta_o and the azimuth between both directions.
type Place = [f64; 3];

/// Samples of an angle for each degree, and one more: six on the shortest wave.
const SAMPLES: usize = 3;

/// Bottoms nearer to each other than this, in steps of the grid, are one.
const MERGED_WITHIN: f64 = 0.1;

/// The places of the grid from which valleys are followed.
#[derive(Clone, Copy, PartialEq)]
enum Starts {
    /// The places of the grid that are the lowest among their neighbours, and the bottoms that were found
    /// before.
    Lowest,
    /// All places of the grid that are low enough for a bottom beside them.
    All,
}

/// The bottom of a valley.
#[derive(Clone, Copy)]
struct Bottom {
    value: f64,
    place: Place,
}

/// An unknown, with sqrt(2 - delta_q0).
struct Term {
    l: usize,
    p: usize,
    q: usize,
    root: f64,
    /// The places of f_lq and f_pq in [`harmonics`].
    incident: usize,
    outgoing: usize,
}

/// The unknowns of one pair of degrees, and a grid of places.
struct Search {
    terms: Vec<Term>,
    incident: Basis,
    outgoing: Basis,
    /// The number of samples of theta_i, theta_o, phi, and their spacing. The first two are at the middle of
    /// their steps, phi goes from 0 to pi.
    counts: [usize; 3],
    spacing: Place,
    /// Y_lq at phi = 0 for each theta_i and each theta_o.
    incident_rows: Vec<Vec<f64>>,
    outgoing_rows: Vec<Vec<f64>>,
}

impl Search {
    fn new(coefficients: &BrdfCoefficients) -> Self {
        Self::with_samples(coefficients, SAMPLES)
    }

    /// A search on a grid with so many samples for each degree, and one more, of each angle.
    fn with_samples(coefficients: &BrdfCoefficients, samples: usize) -> Self {
        let (f, p) = (coefficients.f(), coefficients.p());
        let mut terms = Vec::new();
        // Column after column of q.
        let index =
            |top: Degree, l: usize, q: usize| q * (top.get() + 1) - q * q.saturating_sub(1) / 2 + l - q;
        for l in 0..=f.get() {
            for p in 0..=p.get() {
                for q in 0..=l.min(p) {
                    let root = if q == 0 { 1.0 } else { 2f64.sqrt() };
                    let (incident, outgoing) = (index(coefficients.f(), l, q), index(coefficients.p(), p, q));
                    terms.push(Term { l, p, q, root, incident, outgoing });
                }
            }
        }
        let turns = samples * (f.min(p).get() + 1) + 1;
        let counts = [samples * (f.get() + 1), samples * (p.get() + 1), turns];
        let spacing = [PI / counts[0] as f64, PI / counts[1] as f64, PI / (turns - 1) as f64];
        let (incident, outgoing) = (Basis::new(f), Basis::new(p));
        let rows = |basis: &Basis, axis: usize| {
            (0..counts[axis]).map(|i| harmonics(basis, (i as f64 + 0.5) * spacing[axis])).collect()
        };
        let (incident_rows, outgoing_rows) = (rows(&incident, 0), rows(&outgoing, 1));
        Self { terms, incident, outgoing, counts, spacing, incident_rows, outgoing_rows }
    }

    /// Returns the unknowns x of a channel.
    fn unknowns(&self, coefficients: &BrdfCoefficients, channel: usize) -> Vec<f64> {
        let value = |term: &Term| term.root * coefficients.get(term.l, term.p, term.q)[channel];
        self.terms.iter().map(value).collect()
    }

    /// The factor of each unknown at a place.
    fn row(&self, [theta_i, theta_o, phi]: Place) -> Vec<f64> {
        let (incident, outgoing) = (harmonics(&self.incident, theta_i), harmonics(&self.outgoing, theta_o));
        let turns: Vec<f64> =
            (0..=self.terms.last().map_or(0, |term| term.q)).map(|q| math::cos(q as f64 * phi)).collect();
        let value =
            |term: &Term| incident[term.incident] * outgoing[term.outgoing] * turns[term.q] / term.root;
        self.terms.iter().map(value).collect()
    }

    fn value(&self, x: &[f64], place: Place) -> f64 {
        self.row(place).iter().zip(x).map(|(row, x)| row * x).sum()
    }

    /// The bottoms to which some places lead, lowest first, at most twice as many as there are unknowns: more
    /// cannot hold the nearest function; and the largest value on the grid. `stop` is asked for each place.
    fn bottoms(
        &self,
        x: &[f64],
        starts: Starts,
        known: &[Bottom],
        stop: Stop<'_>,
    ) -> Result<(Vec<Bottom>, f64), Stopped> {
        let values = self.grid(x);
        let size = values.iter().map(|value| value.abs()).fold(0.0, f64::max);
        let [_, outgoing, turns] = self.counts;
        let bottoms: Result<Vec<Bottom>, Stopped> = (0..values.len())
            .into_par_iter()
            .filter(|&i| values[i] < size / 2.0 && (starts == Starts::All || self.is_lowest(&values, i)))
            .map(|i| {
                let [a, b, c] = [i / (outgoing * turns), i / turns % outgoing, i % turns];
                let [si, so, sphi] = self.spacing;
                let place = [(a as f64 + 0.5) * si, (b as f64 + 0.5) * so, c as f64 * sphi];
                Bottom { value: values[i], place }
            })
            .chain(known.par_iter().map(|bottom| Bottom { value: self.value(x, bottom.place), ..*bottom }))
            .map(|start| stop.check().map(|()| self.descend(x, start, size)))
            .collect();
        let mut bottoms = bottoms?;
        bottoms.sort_by(|a, b| a.value.total_cmp(&b.value));
        Ok((self.distinct(bottoms), values.into_iter().fold(f64::NEG_INFINITY, f64::max)))
    }

    /// The lowest of the bottoms that are one, in the order given.
    fn distinct(&self, bottoms: Vec<Bottom>) -> Vec<Bottom> {
        let mut distinct: Vec<Bottom> = Vec::new();
        for bottom in bottoms {
            let is_near = |other: &Bottom| {
                (0..3).all(|axis| {
                    (bottom.place[axis] - other.place[axis]).abs() < MERGED_WITHIN * self.spacing[axis]
                })
            };
            if distinct.len() == 2 * self.terms.len() {
                break;
            }
            if !distinct.iter().any(is_near) {
                distinct.push(bottom);
            }
        }
        distinct
    }

    /// The values at the 27 places a step of h on either side along each angle, [theta_i, theta_o, phi].
    fn stencil(&self, x: &[f64], centre: Place, h: f64) -> [f64; 27] {
        let angle = |axis: usize, side: usize| centre[axis] + (side as f64 - 1.0) * h * self.spacing[axis];
        let incident = [0, 1, 2].map(|side| harmonics(&self.incident, angle(0, side)));
        let outgoing = [0, 1, 2].map(|side| harmonics(&self.outgoing, angle(1, side)));
        let orders = self.terms.last().map_or(0, |term| term.q) + 1;
        let cosines = [0, 1, 2].map(|side| {
            let phi = angle(2, side);
            (0..orders).map(|q| math::cos(q as f64 * phi)).collect::<Vec<_>>()
        });
        // Sums over l: [theta_i, p, q].
        let degrees = self.outgoing.degree().get() + 1;
        let mut sums = vec![[0.0; 3]; degrees * orders];
        for (term, x) in self.terms.iter().zip(x) {
            let sum = &mut sums[term.p * orders + term.q];
            let x = x / term.root;
            (0..3).for_each(|side| sum[side] += x * incident[side][term.incident]);
        }
        let mut values = [0.0; 27];
        for (i, values) in values.chunks_exact_mut(3).enumerate() {
            let mut row = outgoing[i % 3].iter();
            for q in 0..orders {
                let sums = sums[q..].iter().step_by(orders).skip(q);
                let wave: f64 =
                    sums.zip(row.by_ref().take(degrees - q)).map(|(sum, row)| sum[i / 3] * row).sum();
                (0..3).for_each(|side| values[side] += wave * cosines[side][q]);
            }
        }
        values
    }

    /// The function's values on the grid, [theta_i, theta_o, phi].
    fn grid(&self, x: &[f64]) -> Vec<f64> {
        let [_, outgoing, turns] = self.counts;
        let top = self.terms.last().map_or(0, |term| term.q);
        let cosines: Vec<f64> = (0..turns * (top + 1))
            .map(|i| math::cos((i % (top + 1)) as f64 * self.spacing[2] * (i / (top + 1)) as f64))
            .collect();
        // Sum over p, for each theta_o: [l, q].
        let sums: Vec<Vec<f64>> = self
            .outgoing_rows
            .iter()
            .map(|row| {
                let mut sum = vec![0.0; (self.incident.degree().get() + 1) * (top + 1)];
                for (term, x) in self.terms.iter().zip(x) {
                    sum[term.l * (top + 1) + term.q] += x * row[term.outgoing] / term.root;
                }
                sum
            })
            .collect();
        let degrees = self.incident.degree().get() + 1;
        let mut values = Vec::with_capacity(self.incident_rows.len() * outgoing * turns);
        for row in &self.incident_rows {
            for sum in &sums {
                let mut waves = vec![0.0; top + 1];
                let mut row = row.iter();
                for (q, wave) in waves.iter_mut().enumerate() {
                    let sums = sum[q..].iter().step_by(top + 1).skip(q);
                    *wave = sums.zip(row.by_ref().take(degrees - q)).map(|(sum, row)| sum * row).sum();
                }
                values.extend(
                    cosines
                        .chunks_exact(top + 1)
                        .map(|row| row.iter().zip(&waves).map(|(c, w)| c * w).sum::<f64>()),
                );
            }
        }
        values
    }

    /// Whether no neighbour of a place is lower. Over a pole lies the place that is turned by pi.
    fn is_lowest(&self, values: &[f64], index: usize) -> bool {
        let [incident, outgoing, turns] = self.counts;
        let [a, b, c] = [index / (outgoing * turns), index / turns % outgoing, index % turns];
        let at = |a: usize, b: usize, c: usize| values[(a * outgoing + b) * turns + c];
        let across = turns - 1 - c;
        let neighbours = [
            if a == 0 { at(0, b, across) } else { at(a - 1, b, c) },
            if a + 1 == incident { at(a, b, across) } else { at(a + 1, b, c) },
            if b == 0 { at(a, 0, across) } else { at(a, b - 1, c) },
            if b + 1 == outgoing { at(a, b, across) } else { at(a, b + 1, c) },
            at(a, b, c.abs_diff(1)),
            at(a, b, if c + 1 == turns { c - 1 } else { c + 1 }),
        ];
        neighbours.iter().all(|other| values[index] <= *other)
    }

    /// Newton's method with differences over ever shorter distances, in steps of the grid. A place in the
    /// cell of a bottom near zero is on its floor after three steps: what is higher than a twentieth of the
    /// largest value `size` then is not followed further.
    fn descend(&self, x: &[f64], start: Bottom, size: f64) -> Bottom {
        let mut least = start;
        let mut h = 0.5;
        for round in 0..7 {
            if round == 3 && least.value > size / 20.0 {
                break;
            }
            let centre = least.place;
            let at = |step: DVec3| {
                let step = step.to_array();
                [0, 1, 2].map(|axis| centre[axis] + step[axis] * self.spacing[axis])
            };
            let values = self.stencil(x, centre, h);
            let (middle, strides) = (13, [9, 3, 1]);
            let mut slope = DVec3::ZERO;
            let mut bend = DMat3::ZERO;
            for a in 0..3 {
                let [plus, minus] = [values[middle + strides[a]], values[middle - strides[a]]];
                slope[a] = (plus - minus) / (2.0 * h);
                bend.col_mut(a)[a] = (plus + minus - 2.0 * values[middle]) / (h * h);
                for b in 0..a {
                    let (same, other) = (strides[b] + strides[a], strides[b] - strides[a]);
                    let same = values[middle + same] + values[middle - same];
                    let mixed = (same - values[middle + other] - values[middle - other]) / (4.0 * h * h);
                    bend.col_mut(a)[b] = mixed;
                    bend.col_mut(b)[a] = mixed;
                }
            }
            for (i, &value) in values.iter().enumerate() {
                if value < least.value {
                    let side = |stride: usize| (i / stride % 3) as f64 - 1.0;
                    least = Bottom { value, place: at(DVec3::from_array(strides.map(side)) * h) };
                }
            }
            let step = newton_step(bend, slope);
            let place = at(step / step.length().max(1.0));
            let value = self.value(x, place);
            if value < least.value {
                least = Bottom { value, place };
            }
            if round > 1 && step.length() < 1e-4 {
                break;
            }
            h /= 3.0;
        }
        least
    }
}

/// The step to the bottom of a paraboloid, which is bent upward as far as it needs to have one: next to a
/// pole, and for functions of fewer angles, it is flat in some direction.
fn newton_step(bend: DMat3, slope: DVec3) -> DVec3 {
    let size = bend.to_cols_array().iter().map(|value| value.abs()).fold(0.0, f64::max);
    for share in [1e-7, 1e-3, 0.1, 1.0, 3.0] {
        let bend = bend + DMat3::from_diagonal(DVec3::splat(share * size));
        let minor = bend.x_axis.x * bend.y_axis.y - bend.x_axis.y * bend.y_axis.x;
        if bend.x_axis.x > 0.0 && minor > 0.0 && bend.determinant() > 0.0 {
            let step = bend.inverse() * -slope;
            return if step.is_finite() { step } else { DVec3::ZERO };
        }
    }
    DVec3::ZERO
}

/// Y_lq at phi = 0 for q of 0 or more, column after column of q.
fn harmonics(basis: &Basis, theta: f64) -> Vec<f64> {
    let degrees = basis.degree().get() + 1;
    let mut values = vec![0.0; degrees * (degrees + 1) / 2];
    let (sine, cosine) = math::sin_cos(theta);
    basis.legendre_into(cosine, sine, &mut values);
    values
}

#[cfg(test)]
mod tests;
