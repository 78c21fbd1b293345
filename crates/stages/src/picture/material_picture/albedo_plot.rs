//! The albedo of a material by the angle of the view: a curve for each of red, green and blue.

use brdf::Material;
use envmap::luminance;
use preview::drawing::{Align, Canvas, Rect, Style};
use rayon::prelude::*;
use sphere::Direction;

use super::curve::{Curve, draw_curves};
use crate::picture::sheet::{short, theme};

/// The angles of the views from the normal, in degrees: closer together toward the horizon, where Fresnel's
/// formula makes curves steep.
const ANGLES: [f64; 23] = [
    0.0, 6.0, 12.0, 18.0, 24.0, 30.0, 36.0, 42.0, 48.0, 54.0, 60.0, 64.0, 68.0, 72.0, 75.0, 78.0, 80.0, 82.0,
    84.0, 86.0, 87.0, 88.0, 89.0,
];

/// The names and colours of the curves.
const CHANNELS: [(&str, [u8; 3]); 3] = [("red", theme::RED), ("green", theme::GREEN), ("blue", theme::BLUE)];

/// The albedo toward views in one plane through the normal.
pub(super) struct AlbedoPlot {
    /// The albedo at each of [`ANGLES`], RGB.
    albedo: Vec<[f64; 3]>,
}

impl AlbedoPlot {
    /// The albedo toward views at this azimuth.
    pub(super) fn new(material: &Material, azimuth: f64) -> Self {
        let view = |angle: f64| Direction::from_angles(angle.to_radians(), azimuth);
        Self { albedo: ANGLES.par_iter().map(|angle| brdf::albedo(material, view(*angle))).collect() }
    }

    /// The greatest luminance of the albedo.
    pub(super) fn greatest_luminance(&self) -> f64 {
        self.albedo.iter().map(|rgb| luminance(*rgb)).fold(0.0, f64::max)
    }

    /// Draws the plot in a rectangle.
    pub(super) fn draw(&self, canvas: &mut Canvas, place: Rect) {
        canvas.fill(place, theme::SURFACE);
        let area = Rect::new(
            place.x + 62,
            place.y + 52,
            place.width.saturating_sub(62 + 26),
            place.height.saturating_sub(52 + 58),
        );
        let greatest = self.albedo.iter().flatten().copied().fold(0.0, f64::max);
        let axes = AlbedoAxes { area, step: step(greatest), top: top(greatest) };
        axes.draw(canvas, place);
        draw_curves(canvas, &self.curves(&axes), 3.0);
        let mut x = place.x + 16;
        for (name, colour) in CHANNELS {
            let style = Style { colour, ..theme::NAME };
            let label = Rect::new(x, place.y + 14, place.right() - x, 22);
            x += style.draw(canvas, label, Align::Left, name).ceil() as usize + 16;
        }
    }

    fn curves(&self, axes: &AlbedoAxes) -> [Curve; 3] {
        [0, 1, 2].map(|channel| {
            let place = |rgb: &[f64; 3], angle: f64| (axes.x(angle), axes.y(rgb[channel]));
            let points = ANGLES.iter().zip(&self.albedo).map(|(angle, rgb)| (*angle, place(rgb, *angle)));
            Curve { colour: CHANNELS[channel].1, points: points.collect() }
        })
    }
}

/// The mapping from values to pixels.
struct AlbedoAxes {
    /// The area of the data.
    area: Rect,
    /// The distance between two labels of the albedo.
    step: f64,
    /// The albedo at the top.
    top: f64,
}

/// The distance between two labels: a fifth of 1, or a round number if the axis is longer.
fn step(greatest: f64) -> f64 {
    let least = greatest.min(f64::MAX) / 6.0;
    let steps = (-1..309).flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * math::powi(10f64, power)));
    steps.skip(1).find(|step| *step >= least).unwrap_or(1e308)
}

/// The albedo at the top of the axis: 1, or the next label above the greatest. An integral is accurate to
/// 1e-3, so that an albedo of 1 may be a little more.
fn top(greatest: f64) -> f64 {
    if greatest <= 1.001 { 1.0 } else { (greatest / step(greatest)).ceil() * step(greatest) }
}

impl AlbedoAxes {
    fn x(&self, degrees: f64) -> f64 {
        self.area.x as f64 + degrees / 90.0 * self.area.width as f64
    }

    fn y(&self, albedo: f64) -> f64 {
        self.area.bottom() as f64 - (albedo / self.top).clamp(0.0, 1.0) * self.area.height as f64
    }

    fn draw(&self, canvas: &mut Canvas, place: Rect) {
        let area = self.area;
        let labels = (self.top / self.step).round() as usize;
        for label in 0..=labels {
            let albedo = label as f64 * self.step;
            let y = self.y(albedo).round() as usize;
            canvas.fill(Rect::new(area.x, y, area.width, 1), theme::GRID);
            let at = Rect::new(place.x + 4, y.saturating_sub(10), 50, 20);
            theme::TICK.draw(canvas, at, Align::Right, &number(albedo));
        }
        // More than 1 makes light.
        let one = self.y(1.0).round() as usize;
        canvas.fill(Rect::new(area.x, one.saturating_sub(1), area.width, 2), theme::DIM);
        if self.top > 1.0 && one + 40 < area.bottom() {
            let at = Rect::new(area.x + 8, one + 4, area.width, 20);
            theme::TICK.draw(canvas, at, Align::Left, "1: all light");
        }
        for degree in (0..=90).step_by(15) {
            let x = self.x(f64::from(degree)) as usize;
            canvas.fill(Rect::new(x, area.bottom(), 1, 5), theme::RULE);
            let at = Rect::new(x.saturating_sub(29), area.bottom() + 8, 60, 20);
            theme::TICK.draw(canvas, at, Align::Centre, &format!("{degree}°"));
        }
        canvas.fill(Rect::new(area.x, area.bottom(), area.width, 1), theme::RULE);
        let foot = Rect::new(area.x, place.bottom() - 30, area.width, 20);
        theme::TICK.draw(canvas, foot, Align::Centre, "angle of the view from the normal");
    }
}

/// A label: `0`, `0.2`, `3`, `5000`, `2.00×10⁵`.
fn number(albedo: f64) -> String {
    if albedo < 1e4 { format!("{}", (10.0 * albedo).round() / 10.0) } else { short(albedo) }
}

#[cfg(test)]
mod tests {
    use brdf::{Lambert, Phong};

    use super::*;

    const PLACE: Rect = Rect::new(0, 0, 480, 380);

    fn lambert(albedo: [f64; 3]) -> Material {
        Material::Lambert(Lambert::new(albedo).unwrap())
    }

    /// Phong's lobe of weight 1 reflects all light toward every view, as a white matte surface does.
    #[test]
    fn a_white_furnace_lies_on_the_line_at_1() {
        let phong = Material::Phong(Phong::new(32.0, [1.0; 3]).unwrap());
        for material in [lambert([1.0; 3]), phong] {
            let plot = AlbedoPlot::new(&material, 0.0);
            assert!((plot.greatest_luminance() - 1.0).abs() < 1e-3);
            let axes = AlbedoAxes { area: Rect::new(62, 52, 392, 270), step: 0.2, top: 1.0 };
            for (_, (x, y)) in plot.curves(&axes).iter().flat_map(|curve| &curve.points) {
                // 1e-3 of 270 pixels.
                assert!((y - 52.0).abs() < 0.27 && (62.0..=454.0).contains(x), "{x} {y}");
            }
            let mut canvas = Canvas::new(480, 380, theme::BACKGROUND);
            plot.draw(&mut canvas, PLACE);
            let colours = CHANNELS.map(|(_, colour)| colour);
            // The middle of a section.
            let drawn = |y: &usize| colours.contains(&canvas.pixels()[y * 480 + 251]);
            // Two and a half pixels thick about the line at y = 52.
            assert_eq!((48..380).filter(drawn).collect::<Vec<_>>(), [51, 52]);
        }
    }

    #[test]
    fn channels_are_drawn_at_their_albedo() {
        let plot = AlbedoPlot::new(&lambert([0.8, 0.5, 0.2]), 0.0);
        let mut canvas = Canvas::new(480, 380, theme::BACKGROUND);
        plot.draw(&mut canvas, PLACE);
        // The area is 270 pixels high and starts at row 52.
        for (albedo, colour) in [(0.8, theme::RED), (0.5, theme::GREEN), (0.2, theme::BLUE)] {
            let row = 52.0 + (1.0 - albedo) * 270.0;
            assert_eq!(canvas.pixels()[(row as usize) * 480 + 256], colour, "{albedo}");
        }
    }

    #[test]
    fn the_axis_grows_past_1_by_round_steps() {
        assert_eq!((top(0.3), step(0.3)), (1.0, 0.2));
        assert_eq!((top(1.0005), step(1.0)), (1.0, 0.2));
        assert!((top(1.1) - 1.2).abs() < 1e-12);
        assert_eq!((top(8.4), step(8.4)), (10.0, 2.0));
        assert_eq!((top(2e4), step(2e4)), (20_000.0, 5000.0));
        let labels = [0.0, 0.2, 0.6 + 1e-12, 3.0, 5000.0, 2e5].map(number);
        assert_eq!(labels, ["0", "0.2", "0.6", "3", "5000", "2.00×10⁵"]);
    }
}
