//! The energy of each degree of an expansion: bars on a logarithmic axis, and the running sum as a line.

use preview::drawing::{Align, Canvas, Rect, Style};

use super::number::power_of_ten;
use super::theme;
use crate::values::percent;
use crate::values::quantity::ticks;

/// The maximum number of decades on the logarithmic axis.
const DECADES: i32 = 8;

/// The plotted energies, as fractions of the energy of the image that was expanded.
pub(crate) struct EnergyPlot<'a> {
    /// The energy of degree l.
    pub(crate) energies: &'a [f64],
    /// The degrees to mark on the line.
    pub(crate) marks: &'a [usize],
}

/// The mapping from values to pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axes {
    /// The area of the data.
    area: Rect,
    degree: usize,
    /// The powers of ten at the bottom and at the top.
    decades: (i32, i32),
}

impl Axes {
    fn new(area: Rect, energies: &[f64]) -> Self {
        let positive = energies.iter().copied().filter(|energy| *energy > 0.0 && energy.is_finite());
        let (low, high) = positive.fold((f64::MAX, f64::MIN), |(low, high), e| (low.min(e), high.max(e)));
        let decades = if low > high {
            (-1, 0)
        } else {
            // Fractions are at most 1 except for rounding: 1 + 1e-12 does not start another decade.
            let top = (math::log10(high) - 1e-9).ceil() as i32;
            ((math::log10(low).floor() as i32).clamp(top - DECADES, top - 1), top)
        };
        Self { area, degree: energies.len().saturating_sub(1), decades }
    }

    /// The middle of a degree's column: each degree from 0 to the highest has an equal share of the width.
    fn x(&self, degree: f64) -> f64 {
        self.area.x as f64 + (degree + 0.5) * self.share()
    }

    fn share(&self) -> f64 {
        self.area.width as f64 / (self.degree + 1) as f64
    }

    /// The height of an energy on the logarithmic axis, kept within the area.
    fn y(&self, energy: f64) -> f64 {
        let (low, high) = (f64::from(self.decades.0), f64::from(self.decades.1));
        let fraction = ((math::log10(energy) - low) / (high - low)).clamp(0.0, 1.0);
        self.area.bottom() as f64 - fraction * self.area.height as f64
    }

    /// The height of a sum on the linear axis from 0 to 1.
    fn y_sum(&self, sum: f64) -> f64 {
        self.area.bottom() as f64 - sum.clamp(0.0, 1.0) * self.area.height as f64
    }
}

impl EnergyPlot<'_> {
    /// Draws the plot in a rectangle.
    pub(crate) fn draw(&self, canvas: &mut Canvas, place: Rect) {
        canvas.fill(place, theme::SURFACE);
        let area = Rect::new(
            place.x + 62,
            place.y + 58,
            place.width.saturating_sub(62 + 62),
            place.height.saturating_sub(58 + 58),
        );
        let axes = Axes::new(area, self.energies);
        self.draw_axes(canvas, place, &axes);
        self.draw_energies(canvas, &axes);
        self.draw_sum(canvas, &axes);
    }

    fn draw_axes(&self, canvas: &mut Canvas, place: Rect, axes: &Axes) {
        let area = axes.area;
        let title = |colour| Style { colour, ..theme::NAME };
        let head = Rect::new(place.x + 16, place.y + 16, (place.width - 32) / 2, 22);
        title(theme::AMBER).draw(canvas, head, Align::Left, "Energy of degree ℓ");
        let right = Rect { x: head.right(), ..head };
        title(theme::BLUE).draw(canvas, right, Align::Right, "Sum up to ℓ");

        let every = (axes.decades.1 - axes.decades.0 + 7) / 8;
        for decade in (axes.decades.0..=axes.decades.1).rev().step_by(every.max(1) as usize) {
            let y = axes.y(math::powi(10_f64, decade)).round() as usize;
            canvas.fill(Rect::new(area.x, y.min(area.bottom() - 1), area.width, 1), theme::GRID);
            let label = Rect::new(place.x + 4, y.saturating_sub(10), 50, 20);
            theme::TICK.draw(canvas, label, Align::Right, &power_of_ten(decade));
        }
        for quarter in 0..=4 {
            let sum = f64::from(quarter) / 4.0;
            let y = axes.y_sum(sum).round() as usize;
            canvas.fill(Rect::new(area.right(), y.min(area.bottom() - 1), 5, 1), theme::RULE);
            let label = Rect::new(area.right() + 9, y.saturating_sub(10), 50, 20);
            theme::TICK.draw(canvas, label, Align::Left, &format!("{} %", 25 * quarter));
        }
        for degree in ticks(axes.degree as u64, 10).map(|degree| degree as usize) {
            let x = axes.x(degree as f64);
            canvas.fill(Rect::new(x as usize, area.bottom(), 1, 5), theme::RULE);
            let label = Rect::new((x as usize).saturating_sub(29), area.bottom() + 8, 60, 20);
            theme::TICK.draw(canvas, label, Align::Centre, &degree.to_string());
        }
        canvas.fill(Rect::new(area.x, area.bottom(), area.width, 1), theme::RULE);
        let foot = Rect::new(area.x, place.bottom() - 30, area.width, 20);
        theme::TICK.draw(canvas, foot, Align::Centre, "degree ℓ");
    }

    fn draw_energies(&self, canvas: &mut Canvas, axes: &Axes) {
        // A narrow gap between bars if there is room for one; otherwise whole pixels, so that there is no
        // seam.
        let gap = if axes.share() >= 3.0 { (0.25 * axes.share()).min(6.0) } else { 0.0 };
        let half = (axes.share() - gap) / 2.0;
        for (degree, energy) in self.energies.iter().enumerate() {
            if *energy > 0.0 {
                let (x, y) = (axes.x(degree as f64), axes.y(*energy));
                let (mut left, mut right) = (x - half, x + half);
                if gap == 0.0 {
                    left = left.round();
                    right = right.round().max(left + 1.0);
                }
                canvas.fill_between(left, y, right, axes.area.bottom() as f64, theme::AMBER);
            }
        }
    }

    fn draw_sum(&self, canvas: &mut Canvas, axes: &Axes) {
        let sums: Vec<f64> = self
            .energies
            .iter()
            .scan(0.0, |sum, energy| {
                *sum += energy.max(0.0);
                Some(*sum)
            })
            .collect();
        let point = |degree: usize| (axes.x(degree as f64), axes.y_sum(sums[degree]));
        let points: Vec<_> = (0..sums.len()).map(point).collect();
        // A dark edge keeps the line legible over the bars.
        canvas.line(&points, 5.0, theme::SURFACE);
        canvas.line(&points, 2.5, theme::BLUE);
        for (x, y) in self.marks.iter().filter(|degree| **degree < sums.len()).map(|degree| point(*degree)) {
            canvas.line(&[(x, y), (x, y)], 10.0, theme::SURFACE);
            canvas.line(&[(x, y), (x, y)], 7.0, theme::BLUE);
        }
        if let (Some((x, y)), Some(sum)) = (points.last(), sums.last()) {
            let above = if *y > axes.area.y as f64 + 30.0 { y - 26.0 } else { y + 8.0 };
            let label = Rect::new((*x as usize).saturating_sub(120), above as usize, 120, 20);
            let text = percent(*sum);
            let style = Style { colour: theme::BLUE, ..theme::NAME };
            let width = f64::from(style.width(&text)) + 8.0;
            let right = label.right() as f64;
            canvas.fill_between(right - width, above, right + 4.0, above + 20.0, theme::SURFACE);
            style.draw(canvas, label, Align::Right, &text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Rect = Rect::new(100, 50, 400, 200);

    #[test]
    fn values_map_to_the_right_pixels() {
        let axes = Axes::new(AREA, &[0.9, 0.01, 0.002, 0.0]);
        assert_eq!(axes.decades, (-3, 0));
        // Four degrees in 400 pixels.
        assert_eq!(axes.x(0.0), 150.0);
        assert_eq!(axes.x(3.0), 450.0);
        assert_eq!(axes.y(1.0), 50.0);
        assert_eq!(axes.y(1e-3), 250.0);
        assert!((axes.y(10_f64.powf(-1.5)) - 150.0).abs() < 1e-9);
        assert_eq!((axes.y(1e-9), axes.y(7.0)), (250.0, 50.0));
        assert_eq!((axes.y_sum(0.0), axes.y_sum(0.25), axes.y_sum(1.0)), (250.0, 200.0, 50.0));
    }

    #[test]
    fn the_logarithmic_axis_shows_whole_decades() {
        assert_eq!(Axes::new(AREA, &[1.0]).decades, (-1, 0));
        assert_eq!(Axes::new(AREA, &[1.0 + 1e-12, 0.3]).decades, (-1, 0));
        assert_eq!(Axes::new(AREA, &[1.0, 1e-30]).decades, (-8, 0));
        assert_eq!(Axes::new(AREA, &[0.04, 0.03]).decades, (-2, -1));
        assert_eq!(Axes::new(AREA, &[0.0, 0.0]).decades, (-1, 0));
        assert_eq!(Axes::new(AREA, &[f64::NAN]).decades, (-1, 0));
        assert_eq!(Axes::new(AREA, &[]).degree, 0);
    }

    #[test]
    fn a_bar_is_drawn_from_its_energy_down() {
        let energies = [1.0, 0.1, 0.01];
        let place = Rect::new(0, 0, 424, 216);
        let mut canvas = Canvas::new(424, 216, theme::BACKGROUND);
        let axes = Axes::new(Rect::new(62, 58, 300, 100), &energies);
        let plot = EnergyPlot { energies: &energies, marks: &[] };
        plot.draw_energies(&mut canvas, &axes);
        // Two decades over 100 pixels; the middle bar starts half-way.
        for (degree, top) in [(0, 58), (1, 108), (2, 158)] {
            let x = axes.x(f64::from(degree)) as usize;
            for y in 58..158 {
                let lit = canvas.pixels()[y * 424 + x] == theme::AMBER;
                assert_eq!(lit, y >= top, "degree {degree}, row {y}");
            }
        }
        plot.draw(&mut canvas, place);
    }

    #[test]
    fn many_bars_make_one_area_without_seams() {
        for count in [101, 256, 300, 2049] {
            let mut canvas = Canvas::new(424, 216, theme::BACKGROUND);
            let energies = vec![0.1; count];
            let axes = Axes { area: Rect::new(62, 58, 300, 100), degree: count - 1, decades: (-2, 0) };
            EnergyPlot { energies: &energies, marks: &[] }.draw_energies(&mut canvas, &axes);
            let row = &canvas.pixels()[130 * 424..][..424];
            assert!(row[62..362].iter().all(|pixel| *pixel == theme::AMBER), "{count}");
            assert!(row[..62].iter().chain(&row[363..]).all(|pixel| *pixel == theme::BACKGROUND), "{count}");
        }
    }

    #[test]
    fn unusual_spectra_can_be_drawn() {
        let mut canvas = Canvas::new(628, 476, theme::BACKGROUND);
        let spectra = [vec![], vec![1.0], vec![0.0; 4], vec![f64::NAN, 1.0, f64::INFINITY], vec![1e-3; 2049]];
        for energies in spectra {
            EnergyPlot { energies: &energies, marks: &[0, 2, 5000] }
                .draw(&mut canvas, Rect::new(0, 0, 628, 476));
        }
    }
}
