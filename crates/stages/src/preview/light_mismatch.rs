//! Whether a reflection was made from an environment.

use envmap::Environment;
use sh::{Degree, Expansion, Lighting, Transform};

/// If the cosine between their coefficients of one degree is below this, two lights are different. A window
/// scales all coefficients of a degree alike, and a turn by 20 degrees leaves 0.94 of a lamp on the horizon.
const ALIKE: f64 = 0.97;

/// The degrees that are compared: every lighting holds them, and a turn changes them least.
const DEGREES: usize = 3;

/// The warning, if an environment and the lighting of a reflection, series and lights together, differ by more
/// than a window makes them differ.
pub(super) fn difference(environment: &Environment, lighting: &Lighting) -> Option<String> {
    let degree = Degree::new(DEGREES.min(lighting.series.degree().get())).ok()?;
    let series = lighting.series.to_degree(degree);
    let lighting = Lighting { series, lights: lighting.lights.clone() }.whole();
    let own = Transform::new(environment.grid(), degree).ok()?.analyse(environment.pixels());
    let rows = |expansion: &Expansion, l: usize| expansion.coefficients()[l * l..(l + 1) * (l + 1)].to_vec();
    let energy = |values: &[[f64; 3]]| values.as_flattened().iter().map(|value| value * value).sum::<f64>();
    let whole = energy(own.coefficients());
    (1..=degree.get()).find_map(|l| {
        let (ours, theirs) = (rows(&own, l), rows(&lighting, l));
        let product: f64 = ours.as_flattened().iter().zip(theirs.as_flattened()).map(|(a, b)| a * b).sum();
        let cosine = product / (energy(&ours) * energy(&theirs)).sqrt();
        // Coefficients that are almost zero have no direction.
        (energy(&ours) > 1e-4 * whole && cosine < ALIKE).then(|| {
            "the reflection was not made from this environment: connect the one that was projected, turned as the lighting was".into()
        })
    })
}

#[cfg(test)]
mod tests {
    use sphere::{DVec3, LatLong, Rotation};

    use super::*;

    fn environment(radiance: impl Fn(DVec3) -> f64) -> Environment {
        let grid = LatLong::with_rows(32);
        let pixel = |texel: usize| [radiance(grid.direction(texel / 64, texel % 64).vector()) as f32; 3];
        Environment::new(grid, (0..grid.len()).map(pixel).collect()).unwrap()
    }

    #[test]
    fn only_another_light_is_reported() {
        let lamp = |w: DVec3| 0.1 + (8.0 * (w.x - 1.0)).exp();
        let lit = environment(lamp);
        let degree = Degree::new(8).unwrap();
        let series = Transform::new(lit.grid(), degree).unwrap().analyse(lit.pixels());
        assert_eq!(difference(&lit, &sh::Window::Lanczos.apply(&series).into()), None);
        let lighting = Lighting::from(series);
        assert_eq!(difference(&lit, &lighting), None);
        let turned = |degrees: f64| {
            let turn = Rotation::from_yaw_pitch_roll(degrees.to_radians(), 0.0, 0.0);
            difference(&lit.rotated(turn), &lighting)
        };
        assert_eq!(turned(1.0), None);
        assert!(turned(30.0).unwrap().contains("turned as the lighting was"));
        // Light from everywhere has no direction to compare.
        let even = environment(|_| 0.7);
        let flat = Transform::new(even.grid(), degree).unwrap().analyse(even.pixels());
        assert_eq!(difference(&even, &flat.into()), None);
        let black = environment(|_| 0.0);
        assert_eq!(difference(&black, &Expansion::zero(degree).into()), None);
    }

    /// The series is the same in every direction; only the sun tells one turn from another.
    #[test]
    fn the_lights_beside_the_series_are_compared_too() {
        let sunny = environment(|w: DVec3| if w.x > 0.99 { 500.0 } else { 0.5 });
        let separated = sunny.separate_lamps();
        let series = Transform::new(sunny.grid(), Degree::new(6).unwrap()).unwrap();
        let lighting = Lighting { series: series.analyse(separated.soft.pixels()), lights: separated.lights };
        assert!(!lighting.lights.is_empty());
        assert_eq!(difference(&sunny, &lighting), None);
        let turn = Rotation::from_yaw_pitch_roll(0.6, 0.0, 0.0);
        assert!(difference(&sunny.rotated(turn), &lighting).is_some());
        assert_eq!(difference(&sunny.rotated(turn), &lighting.rotated(turn)), None);
    }
}
