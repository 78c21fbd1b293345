//! The least value of a function on the sphere.
//!
//! A function of degree F bends no faster than a wave of length 2 pi / F along any great circle (Bernstein),
//! so that a grid of 3 (F + 1) rows puts some six samples on the shortest wave and cannot step over a valley.
//! The lowest valleys of each channel are then followed to their bottom by Newton's method.
//!
//! Next to a bottom the second derivative is at most F (F + 1) times the largest value M, and a pixel is
//! within 0.75 / (F + 1) of it, so that the lowest pixel of a valley lies at most 0.28 M above its bottom.
//!
//! A valley may have a long floor with several bottoms that differ by 1e-4 of the largest value, while the
//! pixels beside it differ by far more and do not show them all. Whoever needs every bottom follows every
//! pixel below M / 3: one of them is within half a pixel of each bottom near zero.

use rayon::prelude::*;
use sphere::{DVec3, Direction, LatLong};

use crate::{Basis, Expansion, Stop, Stopped, Synthesis};

/// The least value that a function takes, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum {
    /// The least value.
    pub value: f64,
    /// The channel that takes the least value: 0, 1, 2 for red, green, blue.
    pub channel: usize,
    /// The direction in which the least value is taken.
    pub direction: Direction,
}

/// Valleys of each channel that are followed to find the least value.
const VALLEYS: usize = 4;

/// The least value over all directions and channels.
///
/// Accuracy: 1e-9 of the function's size. Time O(F^3); memory 610 (F + 1)^2 bytes, 2.6 GB at degree 2048. The
/// result does not depend on the number of threads.
///
/// # Example: 1 + z is least at the south pole
/// ```
/// let f = sh::Expansion::from_coefficients(
///     sh::Degree::new(1)?,
///     vec![[3.5449077; 3], [0.0; 3], [2.0466534; 3], [0.0; 3]],
/// )
/// .unwrap();
/// let least = sh::minimum(&f);
/// assert!(least.value.abs() < 1e-7 && least.direction.vector().z < -0.999999);
/// # Ok::<(), sh::DegreeTooHigh>(())
/// ```
pub fn minimum(expansion: &Expansion) -> Minimum {
    Search::new(expansion).run(expansion)
}

/// The pixels from which bottoms are searched.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Starts {
    /// The pixels that are the lowest among their neighbours, and the bottoms that were found before.
    Lowest,
    /// All pixels that are low enough for a bottom beside them.
    All,
}

/// Bottoms nearer to each other than this, in pixels, are one.
const MERGED_WITHIN: f64 = 0.1;

/// The shares of the curvature that are added for steps on a floor, which is flat along the valley.
const FLOOR: [f64; 4] = [0.0, 1e-3, 1e-5, 1e-7];

/// The basis and the grid that all searches for one degree share.
pub(crate) struct Search {
    basis: Basis,
    grid: LatLong,
    synthesis: Option<Synthesis>,
}

impl Search {
    pub(crate) fn new(expansion: &Expansion) -> Self {
        let degree = expansion.degree();
        let grid = LatLong::with_rows(3 * (degree.get() + 1));
        Self { basis: Basis::new(degree), grid, synthesis: Synthesis::new(grid, degree).ok() }
    }

    pub(crate) fn basis(&self) -> &Basis {
        &self.basis
    }

    pub(crate) fn run(&self, expansion: &Expansion) -> Minimum {
        self.search(expansion, f64::NEG_INFINITY).unwrap_or_else(|least| least)
    }

    /// Returns the least value; `None`, found sooner, if it is negative.
    pub(crate) fn if_non_negative(&self, expansion: &Expansion) -> Option<Minimum> {
        self.search(expansion, 0.0).ok().filter(|least| least.value >= 0.0)
    }

    /// Returns the least value; or, as the error, the first one found to be below `floor`.
    fn search(&self, expansion: &Expansion, floor: f64) -> Result<Minimum, Minimum> {
        let start = Direction::Z;
        let values = self.basis.evaluate(expansion, start);
        let mut least = Minimum { value: f64::INFINITY, channel: 0, direction: start };
        for channel in 0..3 {
            least = lower(least, Minimum { value: values[channel], channel, direction: start });
        }
        // Every grid has pixels here, so that the synthesis exists.
        let Some(synthesis) = &self.synthesis else { return Ok(least) };
        let pixels: Vec<[f64; 3]> = synthesis.synthesise(expansion);
        let starts: Vec<Minimum> = (0..3)
            .flat_map(|channel| {
                let lowest = self.valleys(&pixels, channel, VALLEYS);
                lowest.into_iter().map(move |(row, column)| (row, column, channel))
            })
            .map(|(row, column, channel)| self.pixel(&pixels, channel, row, column))
            .collect();
        if let Some(&below) = starts.iter().find(|start| start.value < floor) {
            return Err(below);
        }
        let bottoms: Vec<Minimum> =
            starts.into_par_iter().map(|start| self.descend(expansion, start, &[0.0])).collect();
        Ok(bottoms.into_iter().fold(least, lower))
    }

    /// The bottoms of each channel to which some pixels and `known` bottoms lead, as far as they may be below
    /// zero: lowest first, at most twice as many as there are coefficients. `stop` is asked for each start.
    pub(crate) fn bottoms(
        &self,
        expansion: &Expansion,
        starts: Starts,
        known: &[Vec<Minimum>; 3],
        stop: Stop<'_>,
    ) -> Result<[Vec<Minimum>; 3], Stopped> {
        let Some(synthesis) = &self.synthesis else { return Ok(Default::default()) };
        let pixels: Vec<[f64; 3]> = synthesis.synthesise(expansion);
        let of_channel = |channel: usize| {
            let largest = pixels.iter().map(|pixel| pixel[channel].abs()).fold(0.0, f64::max);
            let places = match starts {
                Starts::Lowest => self.valleys(&pixels, channel, usize::MAX),
                Starts::All => {
                    (0..self.grid.len()).map(|i| (i / self.grid.width, i % self.grid.width)).collect()
                }
            };
            let known = known[channel].par_iter().map(|bottom| {
                let value = self.basis.evaluate(expansion, bottom.direction)[channel];
                Minimum { value, ..*bottom }
            });
            let bottoms: Result<Vec<Minimum>, Stopped> = places
                .into_par_iter()
                .map(|(row, column)| self.pixel(&pixels, channel, row, column))
                .filter(|start| start.value < largest / 3.0)
                .chain(known)
                .map(|start| stop.check().map(|()| self.descend(expansion, start, &FLOOR)))
                .collect();
            let mut bottoms = bottoms?;
            bottoms.sort_by(|a, b| a.value.total_cmp(&b.value));
            Ok(self.distinct(bottoms))
        };
        Ok([of_channel(0)?, of_channel(1)?, of_channel(2)?])
    }

    /// The lowest of the bottoms that are one, in the order given.
    fn distinct(&self, bottoms: Vec<Minimum>) -> Vec<Minimum> {
        let apart = MERGED_WITHIN * std::f64::consts::PI / self.grid.height as f64;
        let mut distinct: Vec<Minimum> = Vec::new();
        for bottom in bottoms {
            if distinct.len() == 2 * self.basis.degree().rows() {
                break;
            }
            let place = bottom.direction.vector();
            if !distinct.iter().any(|other| (other.direction.vector() - place).length() < apart) {
                distinct.push(bottom);
            }
        }
        distinct
    }

    /// The largest value of each channel on the grid.
    pub(crate) fn largest(&self, expansion: &Expansion) -> [f64; 3] {
        let Some(synthesis) = &self.synthesis else { return [0.0; 3] };
        let pixels: Vec<[f64; 3]> = synthesis.synthesise(expansion);
        [0, 1, 2].map(|channel| pixels.iter().map(|pixel| pixel[channel]).fold(f64::NEG_INFINITY, f64::max))
    }

    fn pixel(&self, pixels: &[[f64; 3]], channel: usize, row: usize, column: usize) -> Minimum {
        let value = pixels[row * self.grid.width + column][channel];
        Minimum { value, channel, direction: self.grid.direction(row, column) }
    }

    /// The pixels that are the lowest among their neighbours, lowest first, at most `most`.
    fn valleys(&self, pixels: &[[f64; 3]], channel: usize, most: usize) -> Vec<(usize, usize)> {
        let LatLong { width, height } = self.grid;
        let at = |row: usize, column: usize| pixels[row * width + column][channel];
        // Over a pole lies the opposite column of the same row.
        let across = |column: usize| (column + width / 2) % width;
        let mut lowest: Vec<(f64, usize, usize)> = Vec::new();
        for row in 0..height {
            for column in 0..width {
                let value = at(row, column);
                if lowest.len() == most && value >= lowest[most - 1].0 {
                    continue;
                }
                let north = if row == 0 { at(0, across(column)) } else { at(row - 1, column) };
                let south = if row + 1 == height { at(row, across(column)) } else { at(row + 1, column) };
                let (west, east) = (at(row, (column + width - 1) % width), at(row, (column + 1) % width));
                if value <= north && value <= south && value <= west && value <= east {
                    let place = lowest.partition_point(|other| other.0 <= value);
                    lowest.insert(place, (value, row, column));
                    lowest.truncate(most);
                }
            }
        }
        lowest.into_iter().map(|(_, row, column)| (row, column)).collect()
    }

    /// Newton's method from a pixel, with differences over ever shorter distances: an error of h^2 in the
    /// slope moves the value by h^4 only, and h falls fourfold each time from a twelfth of the shortest wave.
    /// A step is tried with each of some shares of the curvature added to it along both axes.
    fn descend(&self, expansion: &Expansion, start: Minimum, added: &[f64]) -> Minimum {
        let channel = start.channel;
        let spacing = std::f64::consts::PI / self.grid.height as f64;
        let mut least = start;
        let mut h = spacing / 2.0;
        for _ in 0..5 {
            let centre = least.direction.vector();
            let (u, v) = centre.any_orthonormal_pair();
            let at = |x: f64, y: f64| {
                let direction = Direction::normalised(centre + u * x + v * y);
                let value = self.basis.evaluate(expansion, direction)[channel];
                Minimum { value, channel, direction }
            };
            let (east, west, north, south) = (at(h, 0.0), at(-h, 0.0), at(0.0, h), at(0.0, -h));
            let sides = [east.value, west.value, north.value, south.value];
            let corners = [at(h, h).value, at(-h, -h).value, at(h, -h).value, at(-h, h).value];
            let middle = at(0.0, 0.0).value;
            for candidate in [east, west, north, south] {
                least = lower(least, candidate);
            }
            for added in added {
                let (x, y) = newton_step(h, sides, corners, middle, *added);
                let length = math::hypot(x, y);
                let shorten = if length > spacing { spacing / length } else { 1.0 };
                least = lower(least, at(x * shorten, y * shorten));
            }
            h /= 4.0;
        }
        least
    }
}

fn lower(a: Minimum, b: Minimum) -> Minimum {
    if b.value < a.value { b } else { a }
}

/// The step to the bottom of the paraboloid through a stencil of spacing h, the share `added` of its largest
/// curvature added along both axes; zero if it has no bottom.
fn newton_step(
    h: f64,
    [east, west, north, south]: [f64; 4],
    corners: [f64; 4],
    centre: f64,
    added: f64,
) -> (f64, f64) {
    let slope = DVec3::new(east - west, north - south, 0.0) / (2.0 * h);
    let xx = (east + west - 2.0 * centre) / (h * h);
    let yy = (north + south - 2.0 * centre) / (h * h);
    let xy = (corners[0] + corners[1] - corners[2] - corners[3]) / (4.0 * h * h);
    let added = added * xx.abs().max(yy.abs());
    let (xx, yy) = (xx + added, yy + added);
    let determinant = xx * yy - xy * xy;
    if determinant > 0.0 && xx > 0.0 {
        ((xy * slope.y - yy * slope.x) / determinant, (xy * slope.x - xx * slope.y) / determinant)
    } else {
        (0.0, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Degree, zonal_into};

    /// A zonal function of one channel about a tilted axis, whose least value is found along its profile.
    #[test]
    fn the_minimum_of_a_zonal_function_is_that_of_its_profile() {
        for (top, theta) in [(2, 0.0), (5, 0.9), (13, 1.6), (30, 2.9), (60, 0.01)] {
            let axis = Direction::from_angles(theta, 1.0);
            let u = |l: usize| [0.0, 0.3 * ((l * 7 % 11) as f64 - 5.0), 0.0];
            let f = Expansion::zonal(axis, Degree::new(top).unwrap(), u);
            let mut values = vec![0.0; top + 1];
            // 1e5 steps: the profile's curvature is below F^2 times its size, here (1e-5 pi F)^2 / 8 = 4e-7.
            let mut expected = f64::INFINITY;
            for i in 0..=100_000 {
                zonal_into((f64::from(i) * 1e-5 * std::f64::consts::PI).cos(), &mut values);
                expected = expected.min((0..=top).map(|l| u(l)[1] * values[l]).sum());
            }
            let least = minimum(&f);
            let size = expected.abs() + f.get(0, 0)[1].abs();
            assert_eq!(least.channel, usize::from(expected < 0.0));
            assert!((least.value - expected).abs() < 1e-6 * size, "{top}: {least:?} {expected}");
            assert!((f.evaluate(least.direction)[1] - least.value).abs() < 1e-12 * size);
        }
    }

    #[test]
    fn a_constant_is_its_own_minimum() {
        let f = Expansion::from_coefficients(Degree::ZERO, vec![[(4.0 * std::f64::consts::PI).sqrt(); 3]])
            .unwrap();
        assert!((minimum(&f).value - 1.0).abs() < 1e-15);
    }
}
