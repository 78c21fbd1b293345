//! What a photographer would say of an environment.

use envmap::{Environment, joined_lights};
use sh::{Light, Stop};
use sphere::LatLong;

use super::facts::Facts;

/// The facts of a lat-long image: where the sun is, how far the radiances reach, and
/// whether the brightest are cut off.
pub(super) fn describe(pixels: &[[f32; 3]], rows: usize) -> Facts {
    let Some(environment) = Environment::new(LatLong::with_rows(rows), pixels.to_vec()) else {
        return Vec::new();
    };
    let whole = environment.integral();
    let mean = whole.map(|light| light / (4.0 * std::f64::consts::PI));
    let mut facts = vec![(
        "mean light",
        format!("{:.3}, {:.3}, {:.3} over the sphere", mean[0], mean[1], mean[2]).into(),
    )];
    let sum = |rgb: [f64; 3]| rgb.iter().sum::<f64>();
    let mut values: Vec<f32> = pixels.iter().map(|rgb| rgb.iter().sum()).collect();
    values.sort_by(f32::total_cmp);
    let (dark, bright) = (values[values.len() / 100], values[values.len() - 1]);
    if dark > 0.0 {
        let stops = math::log2(f64::from(bright / dark));
        facts.push((
            "range",
            format!("{stops:.1} stops from the darkest percent to the brightest pixel").into(),
        ));
    }
    let same = values.iter().rev().take_while(|value| **value == bright).count();
    let clips = same > 1 && f64::from(bright) > 4.0 * sum(mean);
    facts.push((
        "clips",
        match clips {
            true => {
                format!("{same} pixels have the largest value: brighter light may have been clipped").into()
            }
            false => "no".into(),
        },
    ));
    let separated = environment.separate_lamps(Stop::NEVER).map(|found| joined_lights(found.lights));
    let lights = separated.unwrap_or_default();
    let share = |lights: &[Light]| {
        let light: f64 = lights.iter().map(|light| sum(light.flux())).sum();
        format!("{:.1} %", 100.0 * light / sum(whole))
    };
    if let Some((sun, others)) = lights.split_first() {
        let height = 90.0 - sun.direction.theta().to_degrees();
        let azimuth = sun.direction.phi().to_degrees();
        let azimuth = if azimuth > 180.0 { azimuth - 360.0 } else { azimuth };
        let side = if azimuth > 0.0 { "left" } else { "right" };
        let place = format!(
            "{:.1} degrees {} the horizon, {:.1} to the {side} of the centre, {:.1} wide, {} of the light",
            height.abs(),
            if height < 0.0 { "below" } else { "above" },
            azimuth.abs(),
            2.0 * sun.radius.to_degrees(),
            share(std::slice::from_ref(sun)),
        );
        facts.push(("brightest", place.into()));
        if !others.is_empty() {
            facts.push(("other lights", format!("{}, {} of the light", others.len(), share(others)).into()));
        }
    } else {
        facts.push(("brightest", "no suns or lamps".into()));
    }
    facts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sun of one pixel, a quarter of a turn to the right of the centre and 45 degrees high.
    #[test]
    fn the_sun_is_where_it_is() {
        let rows = 64;
        let mut pixels = vec![[0.5; 3]; 2 * rows * rows];
        let fact = |pixels: &[[f32; 3]], name: &str| {
            let facts = describe(pixels, rows);
            facts.iter().find(|(known, _)| *known == name).unwrap().1.as_str().unwrap().to_owned()
        };
        assert_eq!(fact(&pixels, "brightest"), "no suns or lamps");
        assert_eq!(fact(&pixels, "clips"), "no");
        pixels[rows / 4 * 2 * rows + rows / 2 * 3] = [1e5; 3];
        let sun = fact(&pixels, "brightest");
        assert!(sun.starts_with("43.6 degrees above the horizon, 91.4 to the right of the centre"), "{sun}");
        assert!(sun.ends_with(" % of the light") && fact(&pixels, "clips") == "no", "{sun}");
        assert_eq!(fact(&pixels, "range"), "17.6 stops from the darkest percent to the brightest pixel");
        pixels[rows / 4 * 2 * rows + rows / 2 * 3 + 1] = [1e5; 3];
        assert!(fact(&pixels, "clips").starts_with("2 pixels have the largest value"));
    }
}
