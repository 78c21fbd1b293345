//! Curves over an angle, as the plots draw them.

use preview::drawing::Canvas;

/// A curve over an angle in degrees: its colour, and its points in pixels by ascending angle.
pub(super) struct Curve {
    pub(super) colour: [u8; 3],
    pub(super) points: Vec<(f64, (f64, f64))>,
}

impl Curve {
    /// The part between two angles, ends interpolated.
    fn part(&self, from: f64, to: f64) -> Vec<(f64, f64)> {
        let inside = self.points.iter().filter(|(angle, _)| (from..to).contains(angle));
        let ends = [self.at(from), self.at(to)];
        ends[0].into_iter().chain(inside.map(|(_, place)| *place)).chain(ends[1]).collect()
    }

    fn at(&self, angle: f64) -> Option<(f64, f64)> {
        let next = self.points.partition_point(|(other, _)| *other < angle).max(1);
        let ((from, a), (to, b)) = (*self.points.get(next - 1)?, *self.points.get(next)?);
        let share = ((angle - from) / (to - from)).clamp(0.0, 1.0);
        Some((a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)))
    }
}

/// Draws curves in sections of `section` degrees, in each of which another curve lies on top: equal curves
/// look like one line of dashes in all their colours.
pub(super) fn draw_curves(canvas: &mut Canvas, curves: &[Curve], section: f64) {
    const THICKNESS: f64 = 2.5;
    let angles = || curves.iter().flat_map(|curve| curve.points.iter().map(|(angle, _)| *angle));
    let (first, last) = (angles().fold(f64::MAX, f64::min), angles().fold(f64::MIN, f64::max));
    let sections = ((last - first) / section).ceil().max(0.0) as usize;
    for index in 0..sections {
        let from = first + index as f64 * section;
        let to = (from + section).min(last);
        for order in 1..=curves.len() {
            let curve = &curves[(index + order) % curves.len()];
            canvas.line(&curve.part(from, to), THICKNESS, curve.colour);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::sheet::theme;

    #[test]
    fn equal_curves_show_all_their_colours() {
        let curve = |colour| Curve { colour, points: vec![(0.0, (10.0, 20.0)), (90.0, (100.0, 20.0))] };
        let colours = [theme::RED, theme::GREEN, theme::BLUE];
        let mut canvas = Canvas::new(110, 40, theme::BACKGROUND);
        draw_curves(&mut canvas, &colours.map(curve), 10.0);
        // The middles of the sections.
        let found: Vec<_> = (0..9).map(|section| canvas.pixels()[20 * 110 + 15 + 10 * section]).collect();
        assert_eq!(found, [colours, colours, colours].concat());
        let whole = curve(theme::RED).part(0.0, 90.0);
        assert_eq!(whole, [(10.0, 20.0), (10.0, 20.0), (100.0, 20.0)]);
        assert_eq!(curve(theme::RED).part(30.0, 60.0), [(40.0, 20.0), (70.0, 20.0)]);
    }
}
