//! The lobes of a material: a polar plot of rho_hat in the plane of incidence.
//!
//! The angle is that of the view from the normal, and the light comes from the left. The radius is
//! logarithmic, so that a mirror's peak and the matte part below it are both visible. The centre is a
//! hundredth of what a matte surface of the material's greatest albedo reflects, rounded down to a power of
//! ten: what lies below would not be seen.

use std::f64::consts::{FRAC_PI_2, PI};

use brdf::Material;
use envmap::luminance;
use preview::drawing::{Align, Canvas, Rect, Style};
use rayon::prelude::*;
use sphere::Direction;

use super::curve::{Curve, draw_curves};
use crate::picture::sheet::{power_of_ten, theme};

/// The angles of the light from the normal, in degrees, and the colours of their lobes.
const LIGHTS: [(f64, [u8; 3]); 4] =
    [(0.0, theme::BLUE), (30.0, theme::GREEN), (60.0, theme::AMBER), (80.0, theme::VIOLET)];

/// The steps of the view's angle away from highlights, in degrees.
const STEP: f64 = 0.5;
/// The factor by which the steps grow near a highlight, from [`MIN_STEP`] on.
const GROWTH: f64 = 1.08;
/// The finest step in degrees: a quarter of the width of the sharpest highlights.
const MIN_STEP: f64 = 1e-3;

/// The lobes in one plane through the normal.
pub(super) struct LobePlot {
    /// The lobe of each of [`LIGHTS`]: the view's angle from the normal in radians, positive away from the
    /// light, and the luminance of rho_hat.
    lobes: Vec<Vec<(f64, f64)>>,
    /// The powers of ten at the centre and at the outermost circle.
    decades: (i32, i32),
}

impl LobePlot {
    /// The lobes in the plane at this azimuth; `albedo` is the greatest luminance of the albedo.
    pub(super) fn new(material: &Material, azimuth: f64, albedo: f64) -> Self {
        let lobe = |&(light, _): &(f64, [u8; 3])| {
            let light = light.to_radians();
            let incident = Direction::from_angles(light, azimuth + PI);
            let value = |angle: f64| {
                let turn = if angle < 0.0 { PI } else { 0.0 };
                material.rho_hat(incident, Direction::from_angles(angle.abs(), azimuth + turn))
            };
            view_angles(light).into_iter().map(|angle| (angle, luminance(value(angle)))).collect()
        };
        let lobes: Vec<Vec<_>> = LIGHTS.par_iter().map(lobe).collect();
        let greatest = lobes.iter().flatten().fold(0.0, |most: f64, (_, value)| most.max(*value));
        Self { lobes, decades: decades(greatest, albedo) }
    }

    /// The distance from the centre at which a value is drawn, as a fraction of the outermost circle's.
    fn radius(&self, value: f64) -> f64 {
        let (low, high) = (f64::from(self.decades.0), f64::from(self.decades.1));
        ((math::log10(value) - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// Draws the plot in a rectangle.
    pub(super) fn draw(&self, canvas: &mut Canvas, place: Rect) {
        canvas.fill(place, theme::SURFACE);
        let polar = Polar {
            centre: (place.x as f64 + place.width as f64 / 2.0, place.bottom() as f64 - 68.0),
            radius: place.height as f64 - 68.0 - 34.0,
        };
        self.draw_grid(canvas, &polar);
        let mut curves = Vec::new();
        for (lobe, (light, colour)) in self.lobes.iter().zip(&LIGHTS) {
            draw_light(canvas, &polar, -light.to_radians(), *colour);
            let place = |angle: f64, value: f64| polar.point(angle, self.radius(value));
            let points = lobe.iter().map(|(angle, value)| (angle.to_degrees(), place(*angle, *value)));
            curves.push(Curve { colour: *colour, points: points.collect() });
        }
        draw_curves(canvas, &curves, 3.0);
        draw_legend(canvas, place);
    }

    fn draw_grid(&self, canvas: &mut Canvas, polar: &Polar) {
        let (low, high) = self.decades;
        let every = (high - low + 5) / 6;
        for decade in (low..=high).rev().step_by(every.max(1) as usize) {
            let radius = f64::from(decade - low) / f64::from(high - low);
            let colour = if decade == high { theme::RULE } else { theme::GRID };
            let arc = (-90..=90).map(|degree| polar.point(f64::from(degree).to_radians(), radius));
            canvas.line(&arc.collect::<Vec<_>>(), 1.5, colour);
            let sides: &[f64] = if decade == low { &[0.0] } else { &[-1.0, 1.0] };
            for side in sides {
                let (x, y) = polar.point(side * FRAC_PI_2, radius);
                theme::TICK.draw(canvas, around(x, y + 14.0), Align::Centre, &power_of_ten(decade));
            }
        }
        for degree in (-90..=90_i32).step_by(30) {
            let angle = f64::from(degree).to_radians();
            canvas.line(&[polar.point(angle, 0.0), polar.point(angle, 1.0)], 1.0, theme::RULE);
            let gap = 1.0 + (10.0 + 8.0 * math::sin(angle).abs()) / polar.radius;
            let (x, y) = polar.point(angle, gap);
            theme::TICK.draw(canvas, around(x, y), Align::Centre, &format!("{}°", degree.abs()));
        }
    }
}

/// The powers of ten at the centre and at the outermost circle.
fn decades(greatest: f64, albedo: f64) -> (i32, i32) {
    if !(greatest > 0.0 && greatest.is_finite() && albedo > 0.0 && albedo.is_finite()) {
        return (-2, 0);
    }
    let top = (math::log10(greatest) - 1e-9).ceil() as i32;
    let matte = math::log10(albedo / PI);
    (((matte - 2.0).floor() as i32).min(top - 2), top)
}

/// Angles from -90 to 90 degrees, in radians, dense about the mirror direction and about the light.
fn view_angles(light: f64) -> Vec<f64> {
    let even = (0..=(180.0 / STEP) as i32).map(|step| f64::from(step) * STEP - 90.0);
    let away =
        std::iter::successors(Some(MIN_STEP), |step| Some(step * GROWTH)).take_while(|step| *step < 30.0);
    let away: Vec<f64> = away.collect();
    let near = [light.to_degrees(), -light.to_degrees()].into_iter().flat_map(|peak| {
        let sides = away.iter().flat_map(move |step| [peak - step, peak + step]);
        sides.chain([peak]).collect::<Vec<_>>()
    });
    let mut angles: Vec<f64> = even.chain(near).filter(|angle| angle.abs() <= 90.0).collect();
    angles.sort_by(f64::total_cmp);
    // Steps of both kinds may meet but for rounding.
    angles.dedup_by(|next, angle| *next - *angle < 1e-6 * MIN_STEP);
    angles.into_iter().map(f64::to_radians).collect()
}

/// The half disk of the plot, in pixels.
struct Polar {
    centre: (f64, f64),
    radius: f64,
}

impl Polar {
    /// The place at an angle from the normal, to the right if positive, and at a fraction of the radius.
    fn point(&self, angle: f64, radius: f64) -> (f64, f64) {
        let radius = radius * self.radius;
        (self.centre.0 + radius * math::sin(angle), self.centre.1 - radius * math::cos(angle))
    }
}

/// The box of a short label around a point.
fn around(x: f64, y: f64) -> Rect {
    Rect::new((x - 30.0).max(0.0) as usize, (y - 10.0).max(0.0) as usize, 60, 20)
}

/// A dashed ray from the outermost circle to the centre, with an arrow head outside of the lobes.
fn draw_light(canvas: &mut Canvas, polar: &Polar, angle: f64, colour: [u8; 3]) {
    const DASHES: usize = 24;
    for dash in 0..DASHES {
        let [from, to] = [0.0, 0.5].map(|part| (dash as f64 + part) / DASHES as f64);
        canvas.line(&[polar.point(angle, from), polar.point(angle, to)], 1.2, colour);
    }
    let tip = polar.point(angle, 0.94);
    for side in [-0.025, 0.025] {
        canvas.line(&[polar.point(angle + side, 0.985), tip], 2.0, colour);
    }
}

fn draw_legend(canvas: &mut Canvas, place: Rect) {
    let share = (place.width - 32) / LIGHTS.len();
    for (index, (light, colour)) in LIGHTS.iter().enumerate() {
        let label = Rect::new(place.x + 16 + index * share, place.bottom() - 32, share, 20);
        let style = Style { colour: *colour, ..theme::NAME };
        style.draw(canvas, label, Align::Centre, &format!("light from {light}°"));
    }
}

#[cfg(test)]
mod tests {
    use brdf::{Lambert, Phong};

    use super::*;

    /// Phong's rho_hat depends on the angle from the mirror direction alone, where it is (n + 1) / (2 pi).
    #[test]
    fn the_peak_of_a_mirrored_lobe_is_at_the_mirror_angle() {
        for exponent in [8.0, 1e4, 1e8] {
            let phong = Material::Phong(Phong::new(exponent, [1.0; 3]).unwrap());
            let plot = LobePlot::new(&phong, 0.4, 1.0);
            for ((light, _), lobe) in LIGHTS.iter().zip(&plot.lobes) {
                let most = lobe.iter().fold((0.0, 0.0), |most, at| if at.1 > most.1 { *at } else { most });
                assert!((most.0.to_degrees() - light).abs() < 1e-6, "{exponent} {light}: {most:?}");
                let expected = (exponent + 1.0) / (2.0 * PI);
                assert!((most.1 / expected - 1.0).abs() < 1e-6, "{exponent} {light}: {most:?}");
            }
        }
    }

    /// The lobe of a matte material is albedo cos(theta_i) / pi, at every view.
    #[test]
    fn a_matte_lobe_is_a_half_circle() {
        let plot = LobePlot::new(&Material::Lambert(Lambert::new([0.9; 3]).unwrap()), 0.0, 0.9);
        assert_eq!(plot.decades, (-3, 0));
        for ((light, _), lobe) in LIGHTS.iter().zip(&plot.lobes) {
            let expected = 0.9 / PI * light.to_radians().cos();
            assert!(lobe.iter().all(|(_, value)| (value - expected).abs() < 1e-12), "{light}");
        }
        let radius = plot.radius(0.9 / PI);
        assert!((radius - ((0.9 / PI).log10() + 3.0) / 3.0).abs() < 1e-12, "{radius}");
    }

    #[test]
    fn the_scale_shows_peaks_and_matte_parts() {
        // A mirror's peak of 3e4 over albedo 1: six decades, and a matte part of 0.3 stands two above the
        // centre.
        assert_eq!(decades(3e4, 1.0), (-3, 5));
        assert_eq!(decades(0.3, 0.9), (-3, 0));
        assert_eq!(decades(1.0, 0.9), (-3, 0));
        assert_eq!(decades(0.0, 0.0), (-2, 0));
        // A lobe that is dark where it is greatest still has two circles.
        assert_eq!(decades(1e-3, 1.0), (-5, -3));
    }

    #[test]
    fn views_are_dense_about_the_mirror_direction() {
        for (light, _) in LIGHTS {
            let angles = view_angles(light.to_radians());
            assert!(angles.windows(2).all(|pair| pair[0] < pair[1]));
            assert_eq!((angles[0], *angles.last().unwrap()), (-FRAC_PI_2, FRAC_PI_2));
            for (pair, middle) in angles.windows(2).map(|pair| (pair, (pair[0] + pair[1]) / 2.0)) {
                let away = (middle - light.to_radians()).abs().to_degrees();
                let step = (pair[1] - pair[0]).to_degrees();
                assert!(step < (0.1 * away).clamp(2.0 * MIN_STEP, STEP + 1e-9), "{step} at {away}");
            }
        }
    }

    /// The circle of a matte material in the drawn picture, straight up.
    #[test]
    fn a_lobe_is_drawn_at_its_radius() {
        let plot = LobePlot::new(&Material::Lambert(Lambert::new([0.9; 3]).unwrap()), 0.0, 0.9);
        let mut canvas = Canvas::new(680, 380, theme::BACKGROUND);
        plot.draw(&mut canvas, Rect::new(0, 0, 680, 380));
        let radius = 380.0 - 68.0 - 34.0;
        // Light from 60 degrees: cos is a half. Ten degrees beside the normal, where no other line runs.
        let away = 10f64.to_radians();
        let drawn = radius * plot.radius(0.45 / PI);
        let (x, y) = (340.0 + drawn * away.sin(), 380.0 - 68.0 - drawn * away.cos());
        assert_eq!(canvas.pixels()[y as usize * 680 + x as usize], theme::AMBER);
    }
}
