//! The nearest point of an intersection of half-spaces: the least change of a vector that meets linear
//! inequalities.
//!
//! The g nearest to f with a_i . g >= b_i for all i is g = f + sum of k_i a_i, k >= 0, where k_i > 0 only if
//! a_i . g = b_i (Karush, Kuhn and Tucker). The k minimise |f + sum k_i a_i|^2 / 2 - sum k_i b_i, which is a
//! non-negative least squares problem. The active-set method of Lawson and Hanson (1974, "Solving least
//! squares problems", chapter 23) solves it: inequalities that g misses join the active ones, for which the
//! linear system is solved; on the way to its solution, those whose k becomes negative leave. Unlike theirs,
//! this form keeps the active set and its Cholesky factor when more inequalities arrive, and lets all that
//! are missed join at once. Only if none of these stays, the one that is missed most joins alone: then the
//! objective must fall, so that no active set can return.

use crate::{Stop, Stopped};

/// a . g >= b for a vector g.
#[derive(Clone, Debug, PartialEq)]
pub struct HalfSpace {
    /// The normal a, not zero.
    pub normal: Vec<f64>,
    /// The bound b.
    pub bound: f64,
}

/// The point that is nearest to a target among those that meet the inequalities given so far.
///
/// Memory: all inequalities, and half the square of the number of active ones.
///
/// # Example: the nearest to (-1, 2, -3) without negative elements
/// ```
/// let mut nearest = sh::NearestInHalfSpaces::new(vec![-1.0, 2.0, -3.0]);
/// let axis = |i: usize| sh::HalfSpace { normal: (0..3).map(|j| f64::from(i == j)).collect(), bound: 0.0 };
/// nearest.add((0..3).map(axis).collect(), 1e-12, sh::Stop::NEVER)?;
/// assert_eq!(nearest.point(), [0.0, 2.0, 0.0]);
/// assert_eq!(nearest.active(), 2);
/// # Ok::<(), sh::Stopped>(())
/// ```
#[derive(Clone, Debug)]
pub struct NearestInHalfSpaces {
    target: Vec<f64>,
    point: Vec<f64>,
    /// The inequalities that the point meets with equality and that hold it, with normals of length 1.
    active: Vec<HalfSpace>,
    /// The inequalities that the point meets without being held by them.
    inactive: Vec<HalfSpace>,
    /// The weight k of each active inequality.
    weights: Vec<f64>,
    /// b_i - a_i . f of each active inequality.
    right: Vec<f64>,
    /// Rows of the lower Cholesky factor of a_i . a_j.
    lower: Vec<Vec<f64>>,
}

/// A normal joins if at least this share of its squared length is not in the span of the active ones.
///
/// What is missed by less, g misses by 3e-7 of its length at most; solving the linear system costs g 1e-9 of
/// it.
const INDEPENDENT: f64 = 1e-13;

impl NearestInHalfSpaces {
    /// Starts with the target itself, before any inequality.
    pub fn new(target: Vec<f64>) -> Self {
        let point = target.clone();
        Self {
            target,
            point,
            active: Vec::new(),
            inactive: Vec::new(),
            weights: Vec::new(),
            right: Vec::new(),
            lower: Vec::new(),
        }
    }

    /// The nearest point.
    pub fn point(&self) -> &[f64] {
        &self.point
    }

    /// The number of active inequalities: those that the point meets with equality and that hold it.
    pub fn active(&self) -> usize {
        self.active.len()
    }

    /// Takes more inequalities into account, to within `tolerance` of the distance to their planes. Whether
    /// the point has moved. `stop` is asked for each inequality that joins or leaves.
    ///
    /// # Errors
    /// If it was stopped; then the point is not the nearest.
    ///
    /// # Panics
    /// If a normal does not have the target's length.
    pub fn add(
        &mut self,
        half_spaces: Vec<HalfSpace>,
        tolerance: f64,
        stop: Stop<'_>,
    ) -> Result<bool, Stopped> {
        let mut waiting = std::mem::take(&mut self.inactive);
        waiting.extend(half_spaces.into_iter().filter_map(unit));
        let (mut moved, mut alone) = (false, false);
        loop {
            let mut missed: Vec<(f64, usize)> = (0..waiting.len())
                .map(|i| (dot(&waiting[i].normal, &self.point) - waiting[i].bound, i))
                .filter(|(slack, _)| *slack < -tolerance)
                .collect();
            missed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if alone {
                missed.truncate(1);
            }
            if missed.is_empty() {
                self.inactive = waiting;
                return Ok(moved);
            }
            let mut taken: Vec<Option<HalfSpace>> = waiting.into_iter().map(Some).collect();
            let mut joined = 0;
            for (_, i) in missed {
                stop.check()?;
                joined += usize::from(taken[i].take().is_some_and(|half_space| self.join(half_space)));
            }
            waiting = taken.into_iter().flatten().collect();
            let before = self.active.len() - joined;
            let (progress, left) = self.settle(before, stop)?;
            moved |= progress;
            // Alone and yet dropped: only rounding has it missed.
            if progress || !alone {
                waiting.extend(left);
            }
            alone = !progress && joined > 0;
        }
    }

    /// Makes an inequality active, unless its normal is nearly in the span of the active ones.
    fn join(&mut self, half_space: HalfSpace) -> bool {
        let mut row: Vec<f64> = Vec::with_capacity(self.active.len() + 1);
        for (other, lower) in self.active.iter().zip(&self.lower) {
            let i = row.len();
            let sum = dot(&half_space.normal, &other.normal) - dot(&lower[..i], &row);
            row.push(sum / lower[i]);
        }
        let pivot = 1.0 - dot(&row, &row);
        if pivot < INDEPENDENT {
            return false;
        }
        row.push(pivot.sqrt());
        self.right.push(half_space.bound - dot(&half_space.normal, &self.target));
        self.lower.push(row);
        self.weights.push(0.0);
        self.active.push(half_space);
        true
    }

    /// Moves to the solution of the active system, and drops what would become negative on the way. Returns
    /// whether an inequality after the first `before` helped to move, and the dropped ones.
    fn settle(&mut self, before: usize, stop: Stop<'_>) -> Result<(bool, Vec<HalfSpace>), Stopped> {
        let (mut progress, mut dropped) = (false, Vec::new());
        loop {
            let solution = self.solve();
            let pairs = self.weights.iter().zip(&solution).filter(|(_, next)| **next <= 0.0);
            let ratio = |(now, next): (&f64, &f64)| if *now > 0.0 { now / (now - next) } else { 0.0 };
            let step = pairs.map(ratio).fold(1.0, f64::min);
            progress |= step > 0.0 && self.active.len() > before;
            let mut stays = true;
            for i in (0..solution.len()).rev() {
                let (now, next) = (self.weights[i], solution[i]);
                // Rounding must not keep the one that ended the step.
                if next <= 0.0 && now <= step * (now - next) * (1.0 + 1e-12) {
                    stays = false;
                    dropped.push(self.leave(i));
                } else {
                    self.weights[i] = if step < 1.0 { now + step * (next - now) } else { next };
                }
            }
            if stays {
                break;
            }
            stop.check()?;
        }
        self.point.copy_from_slice(&self.target);
        for (half_space, k) in self.active.iter().zip(&self.weights) {
            for (value, normal) in self.point.iter_mut().zip(&half_space.normal) {
                *value += k * normal;
            }
        }
        Ok((progress, dropped))
    }

    /// Solves for k of the active inequalities, met with equality: L L^T k = b - a . f.
    fn solve(&self) -> Vec<f64> {
        let count = self.active.len();
        let mut k = Vec::with_capacity(count);
        for (lower, right) in self.lower.iter().zip(&self.right) {
            let i = k.len();
            k.push((right - dot(&lower[..i], &k)) / lower[i]);
        }
        for i in (0..count).rev() {
            k[i] /= self.lower[i][i];
            let value = k[i];
            for (above, lower) in k[..i].iter_mut().zip(&self.lower[i]) {
                *above -= value * lower;
            }
        }
        k
    }

    fn leave(&mut self, i: usize) -> HalfSpace {
        self.weights.remove(i);
        self.right.remove(i);
        self.lower.remove(i);
        // Turns of columns j and j + 1, so that each row ends at its diagonal again.
        let mut turns: Vec<(f64, f64)> = Vec::with_capacity(self.lower.len() - i);
        for row in &mut self.lower[i..] {
            let end = i + turns.len();
            for (j, (cosine, sine)) in (i..).zip(&turns) {
                let (a, b) = (row[j], row[j + 1]);
                (row[j], row[j + 1]) = (cosine * a + sine * b, cosine * b - sine * a);
            }
            let length = math::hypot(row[end], row[end + 1]);
            turns.push((row[end] / length, row[end + 1] / length));
            row[end] = length;
            row.truncate(end + 1);
        }
        self.active.remove(i)
    }
}

/// Scales a half-space's normal to length 1; `None` if the normal has no length.
fn unit(half_space: HalfSpace) -> Option<HalfSpace> {
    let length = dot(&half_space.normal, &half_space.normal).sqrt();
    let scale = 1.0 / length;
    let normal = half_space.normal.into_iter().map(|value| value * scale).collect();
    (length > 0.0 && scale.is_finite()).then_some(HalfSpace { normal, bound: half_space.bound * scale })
}

/// The scalar product in eight sums, which the compiler vectorises.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::Noise;

    fn random(noise: &mut Noise, count: usize, length: usize, bound: f64) -> Vec<HalfSpace> {
        let mut vector = || (0..length).map(|_| noise.next()).collect::<Vec<_>>();
        (0..count).map(|_| HalfSpace { normal: vector(), bound }).collect()
    }

    /// The method of Hildreth 1957: each k in turn is set to what its own inequality asks for. Slow, and one
    /// line.
    fn hildreth(target: &[f64], half_spaces: &[HalfSpace]) -> Vec<f64> {
        let mut point = target.to_vec();
        let mut k = vec![0.0; half_spaces.len()];
        for _ in 0..20_000 {
            for (k, HalfSpace { normal, bound }) in k.iter_mut().zip(half_spaces) {
                let change = ((bound - dot(normal, &point)) / dot(normal, normal)).max(-*k);
                *k += change;
                point.iter_mut().zip(normal).for_each(|(value, normal)| *value += change * normal);
            }
        }
        point
    }

    fn distance(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn the_nearest_point_is_hildreths() {
        let mut noise = Noise::new(1);
        for (length, count, bound) in
            [(5, 8, 0.0), (12, 40, -0.3), (12, 11, 0.5), (30, 45, 0.0), (3, 50, -0.5)]
        {
            let target: Vec<f64> = (0..length).map(|_| noise.next()).collect();
            let all = random(&mut noise, count, length, bound);
            let expected = hildreth(&target, &all);
            // At once, and in pieces of which later ones end what earlier ones held.
            for size in [count, 7, 1] {
                let mut nearest = NearestInHalfSpaces::new(target.clone());
                for _ in 0..20 {
                    for piece in all.chunks(size) {
                        nearest.add(piece.to_vec(), 1e-12, Stop::NEVER).unwrap();
                    }
                }
                let error = distance(nearest.point(), &expected);
                assert!(error < 1e-8, "{count} in {length}, {size} at once: {error:e}");
                assert!(nearest.active() <= length);
                let moved = nearest.add(all.clone(), 1e-9, Stop::NEVER);
                assert_eq!(moved, Ok(false), "nothing is missed any more");
            }
        }
    }

    #[test]
    fn inequalities_that_nearly_repeat_do_not_harm() {
        let mut noise = Noise::new(2);
        let target: Vec<f64> = (0..6).map(|_| noise.next()).collect();
        let mut all = random(&mut noise, 9, 6, 0.0);
        let expected = hildreth(&target, &all);
        for size in [0.0, 1e-15, 1e-9, 1e-7] {
            for i in 0..9 {
                let near = all[i].normal.iter().map(|value| value + size * noise.next()).collect();
                all.push(HalfSpace { normal: near, bound: 0.0 });
            }
        }
        let mut nearest = NearestInHalfSpaces::new(target);
        nearest.add(all, 1e-12, Stop::NEVER).unwrap();
        assert!(distance(nearest.point(), &expected) < 1e-5);
    }

    #[test]
    fn what_is_met_moves_nothing() {
        let mut nearest = NearestInHalfSpaces::new(vec![1.0, 2.0]);
        let met = HalfSpace { normal: vec![1.0, 0.0], bound: 0.5 };
        let empty = HalfSpace { normal: vec![0.0, 0.0], bound: 0.0 };
        assert_eq!(nearest.add(vec![met, empty], 0.0, Stop::NEVER), Ok(false));
        assert_eq!((nearest.point(), nearest.active()), (&[1.0, 2.0][..], 0));
    }
}
