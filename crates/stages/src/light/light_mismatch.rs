//! Whether a reflection or a scale space was made from an environment.

use envmap::Environment;
use sh::{Degree, Lighting, Transform};
use shrm::Reflection;
use taps::ScaleSpace;

/// If the cosine between their coefficients of one degree is below this, two lights are different. A window
/// scales all coefficients of a degree alike, and a turn by 20 degrees leaves 0.94 of a lamp on the horizon.
const ALIKE: f64 = 0.97;

/// The degrees that are compared: every lighting holds them, and a turn changes them least.
const DEGREES: usize = 3;

/// Returns the warning, if an environment and the lighting of a reflection, lamps included, differ by more
/// than a window makes them differ.
pub(crate) fn difference(environment: &Environment, reflection: &Reflection) -> Option<String> {
    let degree = Degree::new(DEGREES.min(reflection.lighting().degree().get())).ok()?;
    let lights = reflection.lamps().map(|lamps| lamps.lights.clone()).unwrap_or_default();
    let lighting = Lighting { series: reflection.lighting().to_degree(degree), lights };
    is_of_another(environment, lighting).then(|| {
        "the reflection was not made from this environment: connect the one that was projected, turned in \
         the same way as the lighting"
            .into()
    })
}

/// Returns the warning, if an environment and the light of a scale space, lights included, differ as much.
pub(crate) fn difference_from_scales(environment: &Environment, scales: &ScaleSpace) -> Option<String> {
    let mut series = scales.diffuse().clone();
    // A white diffuse surface keeps these shares of the degrees [RH02, app. A].
    for (row, rgb) in series.coefficients_mut().iter_mut().enumerate() {
        let share = [1.0, 2.0 / 3.0, 0.25][row.isqrt().min(2)];
        rgb.iter_mut().for_each(|value| *value /= share);
    }
    is_of_another(environment, Lighting { series, lights: scales.lights().to_vec() }).then(|| {
        "the scale space was not made from this environment: connect the input of `scale-space`".into()
    })
}

/// Whether an environment and a lighting differ in a degree of the lighting's series.
fn is_of_another(environment: &Environment, lighting: Lighting) -> bool {
    let lighting = lighting.whole();
    let degree = lighting.degree();
    let Ok(transform) = Transform::new(environment.grid(), degree) else { return false };
    let own = transform.analyse(environment.pixels());
    let rows =
        |expansion: &sh::Expansion, l: usize| expansion.coefficients()[l * l..(l + 1) * (l + 1)].to_vec();
    let energy = |values: &[[f64; 3]]| values.as_flattened().iter().map(|value| value * value).sum::<f64>();
    let whole = energy(own.coefficients());
    (1..=degree.get()).any(|l| {
        let (ours, theirs) = (rows(&own, l), rows(&lighting, l));
        let product: f64 = ours.as_flattened().iter().zip(theirs.as_flattened()).map(|(a, b)| a * b).sum();
        let cosine = product / (energy(&ours) * energy(&theirs)).sqrt();
        // Coefficients that are almost zero have no direction.
        energy(&ours) > 1e-4 * whole && cosine < ALIKE
    })
}

#[cfg(test)]
mod tests {
    use brdf::{BrdfCoefficients, Centre, Lambert, Material};
    use sh::{Expansion, Stop};
    use shrm::Lamps;
    use sphere::{DVec3, LatLong, Rotation};

    use super::*;

    fn reflection(lighting: &Expansion) -> Reflection {
        let degree = lighting.degree();
        let rho = vec![[1.0; 3]; degree.get() + 1];
        let brdf = BrdfCoefficients::new(Centre::Normal, degree, Degree::ZERO, rho).unwrap();
        Reflection::convolve(lighting, &brdf)
    }

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
        let lighting = Transform::new(lit.grid(), degree).unwrap().analyse(lit.pixels());
        assert_eq!(difference(&lit, &reflection(&lighting)), None);
        assert_eq!(difference(&lit, &reflection(&sh::Window::Lanczos.apply(&lighting))), None);
        let turned = |degrees: f64| {
            let turn = Rotation::from_yaw_pitch_roll(degrees.to_radians(), 0.0, 0.0);
            difference(&lit.rotated(turn, Stop::NEVER).unwrap(), &reflection(&lighting))
        };
        assert_eq!(turned(1.0), None);
        assert!(turned(30.0).unwrap().contains("turned in the same way as the lighting"));
        // Light from everywhere has no direction to compare.
        let even = environment(|_| 0.7);
        let flat = Transform::new(even.grid(), degree).unwrap().analyse(even.pixels());
        assert_eq!(difference(&even, &reflection(&flat)), None);
        let black = environment(|_| 0.0);
        assert_eq!(difference(&black, &reflection(&Expansion::zero(degree))), None);
    }

    #[test]
    fn a_scale_space_is_of_its_environment() {
        let lit = environment(|w| 0.5 + 0.4 * w.x + if w.z > 0.97 { 300.0 } else { 0.0 });
        let widths = taps::Widths::new(8).unwrap();
        let lights = lit.separate_lamps(Stop::NEVER).unwrap().lights;
        assert!(!lights.is_empty());
        let turn = Rotation::from_yaw_pitch_roll(0.0, 0.6, 0.0);
        let turned = lit.rotated(turn, Stop::NEVER).unwrap();
        for lights in [&lights[..], &[]] {
            let scales = ScaleSpace::new(&lit, lights, widths, Stop::NEVER).unwrap();
            assert_eq!(difference_from_scales(&lit, &scales), None);
            assert!(difference_from_scales(&turned, &scales).unwrap().contains("`scale-space`"));
        }
    }

    #[test]
    fn lamps_beside_the_series_are_part_of_the_light() {
        let lit = environment(|w| if w.x > 0.98 { 300.0 } else { 0.1 });
        let separated = lit.separate_lamps(Stop::NEVER).unwrap();
        let degree = Degree::new(8).unwrap();
        let soft = Transform::new(lit.grid(), degree).unwrap().analyse(separated.soft.pixels());
        let material = Material::Lambert(Lambert::new([1.0; 3]).unwrap());
        assert!(!separated.lights.is_empty());
        let whole = reflection(&soft).with_lamps(Lamps { lights: separated.lights, material });
        assert_eq!(difference(&lit, &whole), None);
    }
}
