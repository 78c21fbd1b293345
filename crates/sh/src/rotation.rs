//! Rotation of a function on the sphere, of any degree: (R f)(w) = f(R^-1 w).
//!
//! R = R_z(alpha) R_y(beta) R_z(gamma). A turn about +Z mixes cosine and sine of each m, c' = c cos(m a) - s
//! sin(m a), s' = c sin(m a) + s cos(m a); the turn about +Y mixes the m of each l by Wigner's d functions
//! ([`crate::wigner`]). They are needed for beta <= pi / 2 only, since R_y(beta) = R_z(pi) R_y(pi - beta)
//! R_z(-pi) R_y(pi), where the last two only change signs.
//!
//! The work is O(degree^3). For each block of adjacent m, the recurrence in l runs along with the sums it
//! feeds, so that no matrix is ever held; the blocks are independent, and the result does not depend on the
//! number of threads.

use std::f64::consts::FRAC_1_SQRT_2;

use rayon::prelude::*;
use sphere::{Rotation, Zyz};

use crate::Expansion;
use crate::f64x4::LANES;
use crate::rotation_about_y::{PARTS, RotationAboutY, Row};
use crate::wigner::triangle;

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// Below this degree a rotation takes less time than waking threads does.
const PARALLEL_FROM: usize = 40;

/// The function rotated by `rotation`: its value at R w is the old one at w.
///
/// Accuracy: a few units of rounding times the degree, relative to the largest coefficients; tests show
/// 1e-11 up to degree 256 for inverse, composition and evaluation at rotated directions.
///
/// # Example: a yaw of 90 degrees takes +X to +Y
/// ```
/// use sh::{Degree, Expansion, rotate};
/// let mut f = Expansion::zero(Degree::new(1)?);
/// f.coefficients_mut()[3] = [1.0; 3]; // Y_1,1, along x
/// let rotated = rotate(&f, sphere::Rotation::from_yaw_pitch_roll(std::f64::consts::FRAC_PI_2, 0.0, 0.0));
/// assert!((rotated.get(1, -1)[0] - 1.0).abs() < 1e-15); // Y_1,-1, along y
/// # Ok::<(), sh::DegreeTooHigh>(())
/// ```
pub fn rotate(expansion: &Expansion, rotation: Rotation) -> Expansion {
    let mut rotated = Expansion::zero(expansion.degree());
    rotate_into(expansion, rotation, &mut rotated);
    rotated
}

/// [`rotate`] into an expansion of the caller.
///
/// # Panics
/// If the two expansions differ in degree.
pub fn rotate_into(expansion: &Expansion, rotation: Rotation, rotated: &mut Expansion) {
    rotate_up_to(expansion, rotation, expansion.degree().get(), rotated);
}

/// The orders |m| <= `highest` of [`rotate`]'s result, which cost less than all; the others are zero.
pub fn rotate_orders(expansion: &Expansion, rotation: Rotation, highest: usize) -> Expansion {
    let mut rotated = Expansion::zero(expansion.degree());
    rotate_up_to(expansion, rotation, highest, &mut rotated);
    rotated
}

/// Sets the orders |m| <= `highest`.
fn rotate_up_to(expansion: &Expansion, rotation: Rotation, highest: usize, rotated: &mut Expansion) {
    assert_eq!(expansion.degree(), rotated.degree(), "a rotation keeps the degree");
    let degree = expansion.degree().get();
    let highest = highest.min(degree);
    let Zyz { alpha, beta, gamma } = rotation.zyz();
    let (sine, cosine) = math::sin_cos(beta / 2.0);
    let flip = sine > cosine;
    let (sine, cosine) = if flip { (cosine, sine) } else { (sine, cosine) };
    let about_y = RotationAboutY::new(degree, sine, cosine);

    let input = gather(expansion.coefficients(), degree, gamma, flip);
    let run = |block: usize| about_y.apply(block, &input);
    let count = highest / LANES + 1;
    let blocks: Vec<Vec<Row>> = if degree < PARALLEL_FROM {
        (0..count).map(run).collect()
    } else {
        // The first blocks are the longest: one task each keeps the threads evenly busy.
        (0..count).into_par_iter().with_max_len(1).map(run).collect()
    };
    scatter(&blocks, alpha, flip, rotated.coefficients_mut(), highest);
}

/// cos(m angle) and sin(m angle), for m = 0 to `degree`, by repeated multiplication.
fn turns(angle: f64, degree: usize) -> Vec<[f64; 2]> {
    let (sine, cosine) = math::sin_cos(angle);
    let mut turns = Vec::with_capacity(degree + 1);
    let mut turn = [1.0, 0.0];
    for _ in 0..=degree {
        turns.push(turn);
        turn = [turn[0] * cosine - turn[1] * sine, turn[1] * cosine + turn[0] * sine];
    }
    turns
}

/// The first turn about +Z, and the sign changes of R_z(-pi) R_y(pi) if asked for: [cosine RGB, sine RGB] at
/// `triangle(l) + m`. Order 0 takes the factor 1 / sqrt(2) that makes its matrix like the others.
fn gather(coefficients: &[[f64; 3]], degree: usize, gamma: f64, flip: bool) -> Vec<[f64; PARTS]> {
    let mut parts = Vec::with_capacity(triangle(degree + 1));
    let turns = turns(gamma, degree);
    for l in 0..=degree {
        for (m, [x, y]) in turns[..=l].iter().enumerate() {
            let (c, s) = (coefficients[l * l + l + m], coefficients[l * l + l - m]);
            let sign = if flip && (l + m) % 2 == 1 { -1.0 } else { 1.0 };
            let mut part = [0.0; PARTS];
            for channel in 0..3 {
                if m == 0 {
                    part[channel] = sign * FRAC_1_SQRT_2 * c[channel];
                } else {
                    part[channel] = sign * (c[channel] * x - s[channel] * y);
                    part[channel + 3] = (if flip { -sign } else { sign }) * (c[channel] * y + s[channel] * x);
                }
            }
            parts.push(part);
        }
    }
    parts
}

/// The last turn about +Z, by `alpha` and by pi if asked for, from blocks of four orders; of orders up to
/// `highest`.
fn scatter(blocks: &[Vec<Row>], alpha: f64, flip: bool, coefficients: &mut [[f64; 3]], highest: usize) {
    let turns = turns(alpha, highest);
    for (first, block) in (0..).step_by(LANES).zip(blocks) {
        for (l, row) in (first..).zip(block) {
            let middle = l * l + l;
            for m in first..(first + LANES).min(l + 1).min(highest + 1) {
                let part = |i: usize| row[i].0[m - first];
                let [mut x, mut y] = turns[m];
                if flip && m % 2 == 1 {
                    (x, y) = (-x, -y);
                }
                for channel in 0..3 {
                    let (c, s) = (part(channel), part(channel + 3));
                    if m == 0 {
                        coefficients[middle][channel] = FRAC_1_SQRT_2 * c;
                    } else {
                        coefficients[middle + m][channel] = c * x - s * y;
                        coefficients[middle - m][channel] = c * y + s * x;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Basis, Degree};
    use sphere::Direction;

    /// Numbers in [-1, 1] that look random, the same each time.
    fn noise(degree: usize) -> Expansion {
        let degree = Degree::new(degree).unwrap();
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let rows = (0..degree.rows()).map(|_| [next(), next(), next()]).collect();
        Expansion::from_coefficients(degree, rows).unwrap()
    }

    fn rotations() -> Vec<Rotation> {
        let mut all = vec![Rotation::IDENTITY];
        for (yaw, pitch, roll) in [
            (0.3, 0.0, 0.0),
            (0.0, 0.7, 0.0),
            (0.0, 0.0, -1.1),
            (1.0, -0.4, 2.5),
            (-2.0, 1.5, 0.1),
            (0.1, 1e-3, 0.0),
            (0.4, 4e-3, 1e-9),
            (0.2, std::f64::consts::PI - 1e-4, 0.0),
            (0.0, std::f64::consts::PI, 0.0),
            (0.0, std::f64::consts::FRAC_PI_2, 0.0),
        ] {
            all.push(Rotation::from_yaw_pitch_roll(yaw, pitch, roll));
        }
        all
    }

    fn largest_difference(a: &Expansion, b: &Expansion) -> f64 {
        let pairs = a.coefficients().iter().flatten().zip(b.coefficients().iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, |x, y| if y.is_nan() { y } else { x.max(y) })
    }

    #[test]
    fn degree_one_turns_as_a_vector_does() {
        for rotation in rotations() {
            let f = noise(1);
            let rotated = rotate(&f, rotation);
            for channel in 0..3 {
                let vector = |f: &Expansion| {
                    sphere::DVec3::new(f.get(1, 1)[channel], f.get(1, -1)[channel], f.get(1, 0)[channel])
                };
                let error = vector(&rotated) - rotation.matrix() * vector(&f);
                assert!(error.length() < 1e-15, "{rotation:?}: {error}");
            }
        }
    }

    /// The value at R w is the old one at w. Coefficients are at most 1 and sum over m of Y_lm^2 is (2l+1)/(4
    /// pi), so values reach about F^1.5; the positions of both directions carry rounding errors of 1e-16
    /// times a gradient F times larger. Errors are taken relative to the root mean square value, about F /
    /// sqrt(12 pi).
    #[test]
    fn a_rotated_function_has_the_old_values_at_rotated_directions() {
        for degree in [0, 1, 2, 3, 4, 5, 8, 16, 33, 64, 100, 255, 256] {
            let f = noise(degree);
            let basis = Basis::new(f.degree());
            let size = (degree as f64 + 1.0) / 6.0;
            for rotation in rotations() {
                let rotated = rotate(&f, rotation);
                for i in 0..12 {
                    let w = Direction::from_angles(0.1 + 0.26 * f64::from(i), 2.4 * f64::from(i));
                    let (old, new) = (basis.evaluate(&f, w), basis.evaluate(&rotated, rotation.apply(w)));
                    for channel in 0..3 {
                        let error = (old[channel] - new[channel]).abs() / size;
                        assert!(error < 1e-11, "degree {degree}, {rotation:?}: {error:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn rotations_compose_and_invert_to_degree_256() {
        let mut worst: f64 = 0.0;
        for degree in [0, 1, 2, 7, 31, 64, 128, 256] {
            let f = noise(degree);
            let all = rotations();
            for (i, &a) in all.iter().enumerate() {
                let there = rotate(&f, a);
                worst = worst.max(largest_difference(&rotate(&there, a.inverse()), &f));
                assert!(worst < 1e-11, "degree {degree}, {a:?} undone: {worst:e}");
                let b = all[(i + 4) % all.len()];
                worst = worst.max(largest_difference(&rotate(&there, b), &rotate(&f, b.after(a))));
                assert!(worst < 1e-11, "degree {degree}, {b:?} after {a:?}: {worst:e}");
            }
        }
        println!("largest error of a coefficient: {worst:e}");
    }

    #[test]
    fn a_part_of_the_orders_is_that_of_the_whole() {
        for (degree, highest) in [(0, 0), (3, 0), (30, 5), (64, 24), (10, 30)] {
            let f = noise(degree);
            for rotation in rotations() {
                let (whole, part) = (rotate(&f, rotation), rotate_orders(&f, rotation, highest));
                for l in 0..=degree as i32 {
                    for m in -l..=l {
                        let inside = m.unsigned_abs() as usize <= highest;
                        let get = |f: &Expansion| f.coefficients()[(l * l + l + m) as usize];
                        assert_eq!(get(&part), if inside { get(&whole) } else { [0.0; 3] }, "{l} {m}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_rotation_is_the_same_with_any_number_of_threads() {
        let f = noise(90);
        let rotation = Rotation::from_yaw_pitch_roll(1.0, -0.4, 2.5);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| rotate(&f, rotation))
        };
        assert_eq!(with(1), with(3));
    }

    /// sin(beta / 2) = 1/e is where starts are smallest among those that come to matter: 1e-327 at degree
    /// 1024, 1e-654 at 2048.
    #[test]
    fn rotations_of_high_degree_keep_energy_and_invert() {
        for (degree, beta) in [(700, 2.2), (1024, 0.7534)] {
            let f = noise(degree);
            let rotation = Rotation::from_zyz(Zyz { alpha: 0.4, beta, gamma: -1.3 });
            let rotated = rotate(&f, rotation);
            keeps_energy(&f, &rotated);
            let error = largest_difference(&rotate(&rotated, rotation.inverse()), &f);
            assert!(error < 1e-11, "degree {degree}, beta {beta}: {error:e}");
        }
    }

    /// A turn about +Y takes the harmonics at w, as a function of (l, m), to those at R w: by the addition
    /// theorem they are the coefficients of a spike. Some orders m, in the blocks of `rotate`, stand for all.
    #[test]
    fn orders_of_the_highest_degree_turn_a_spike() {
        let top = Degree::MAX.get();
        let basis = Basis::new(Degree::MAX);
        let at = |w: Direction| {
            let mut rows = vec![0.0; Degree::MAX.rows()];
            basis.evaluate_into(w, &mut rows);
            rows
        };
        for (theta, phi, beta) in [(0.9, 0.7, 0.7534_f64), (0.4, 0.01, 1.5), (1.5, -2.0, 0.01)] {
            let w = Direction::from_angles(theta, phi);
            let rotated = Rotation::from_zyz(Zyz { alpha: 0.0, beta, gamma: 0.0 }).apply(w);
            let (before, after) = (at(w), at(rotated));
            let spike: Vec<[f64; 3]> = before.iter().map(|y| [*y, -y, 2.0 * y]).collect();
            let input = gather(&spike, top, 0.0, false);
            let (sine, cosine) = (beta / 2.0).sin_cos();
            let about_y = RotationAboutY::new(top, sine, cosine);
            for m in [0, 1, 30, 400, 1024, 1500, 1900, 2047, 2048] {
                let first = m / LANES * LANES;
                let block = about_y.apply(m / LANES, &input);
                for l in m..=top {
                    // The sum over n of the squares of Y_ln is (2l+1) / (4 pi).
                    let size = ((2 * l + 1) as f64).sqrt() * 0.282;
                    let part = |i: usize| block[l - first][i].0[m - first];
                    let middle = l * l + l;
                    let pairs = if m == 0 {
                        [(part(0) * FRAC_1_SQRT_2, after[middle]); 2]
                    } else {
                        [(part(0), after[middle + m]), (part(3), after[middle - m])]
                    };
                    for (found, expected) in pairs {
                        let error = (found - expected) / size;
                        assert!(error.abs() < 1e-11, "l {l}, m {m}, beta {beta}: {error:e}");
                    }
                }
            }
        }
    }

    /// Rotations are orthogonal within each degree. Each coefficient is good to 1e-12; so is the sum,
    /// relatively.
    fn keeps_energy(f: &Expansion, rotated: &Expansion) {
        let (before, after) = (crate::energy_per_degree(f), crate::energy_per_degree(rotated));
        for (l, (before, after)) in before.iter().zip(after).enumerate() {
            for channel in 0..3 {
                let error = after[channel] / before[channel] - 1.0;
                assert!(error.abs() < 1e-11, "degree {l} of {:?}: {error:e}", f.degree());
            }
        }
    }
}
