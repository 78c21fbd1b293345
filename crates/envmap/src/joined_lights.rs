//! One light in place of the parts of a disk.

use sh::Light;
use sphere::{DVec3, Direction};

/// The radius of the largest light that several touching ones become, in radians: that of a sun behind haze.
const LARGEST_SUN: f64 = 0.1;

/// Lights, the strongest first, of which those that touch are one, as long as its angular radius is at most
/// 0.1: the parts of a disk that is larger than [`crate::Environment::separate_lamps`] keeps together.
///
/// # Example: halves of a disk
/// ```
/// use sphere::{DVec3, Direction};
/// let half = |y| sh::Light::from_flux(Direction::normalised(DVec3::new(1.0, y, 0.0)), 0.03, [1.0; 3]);
/// let [sun] = &envmap::joined_lights(vec![half(0.02), half(-0.02)])[..] else { panic!("two suns") };
/// assert!((sun.flux()[0] - 2.0).abs() < 1e-12 && (sun.radius - 0.041).abs() < 1e-3);
/// assert_eq!(envmap::joined_lights(vec![half(0.5), half(-0.5)]).len(), 2);
/// ```
pub fn joined_lights(lights: Vec<Light>) -> Vec<Light> {
    let mut open = lights;
    let mut done: Vec<Light> = Vec::new();
    while !open.is_empty() {
        let mut sun = open.remove(0);
        let touching = |sun: &Light, other: &Light| {
            let (a, b) = (sun.direction.vector(), other.direction.vector());
            angle(a, b) <= sun.radius + other.radius
        };
        while let Some((index, larger)) = open.iter().enumerate().find_map(|(index, other)| {
            let larger = touching(&sun, other).then(|| both(&sun, other))?;
            (larger.radius <= LARGEST_SUN).then_some((index, larger))
        }) {
            open.remove(index);
            sun = larger;
        }
        done.push(sun);
    }
    let power = |light: &Light| light.flux().iter().sum::<f64>();
    done.sort_by(|a, b| power(b).total_cmp(&power(a)));
    done
}

/// The angle between two unit vectors.
fn angle(a: DVec3, b: DVec3) -> f64 {
    2.0 * math::asin((0.5 * (a - b).length()).min(1.0))
}

/// One disk with the light, the centre and the mean square of the width of two.
fn both(a: &Light, b: &Light) -> Light {
    let weights = [a, b].map(|light| light.flux().iter().sum::<f64>());
    let whole = weights[0] + weights[1];
    let directions = [a, b].map(|light| light.direction.vector());
    let direction = Direction::normalised(directions[0] * weights[0] + directions[1] * weights[1]);
    let square = |light: &Light| {
        // The mean square of the distance from a disk's centre is half of the square of its radius.
        math::powi(light.radius, 2) / 2.0 + math::powi(angle(light.direction.vector(), direction.vector()), 2)
    };
    let radius = (2.0 * (weights[0] * square(a) + weights[1] * square(b)) / whole).sqrt();
    let flux = [a.flux(), b.flux()];
    Light::from_flux(direction, radius, std::array::from_fn(|c| flux[0][c] + flux[1][c]))
}
