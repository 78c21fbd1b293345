//! A chart with logarithmic axes as SVG: series of points joined by lines, each with its name beside it.
//!
//! Colours are classes of the page's style sheet, so that the chart is light or dark as the page is.

use containers::escape_html as escape;

use crate::picture::report::markup::Markup;

/// Points that a line joins.
pub(crate) struct ChartSeries {
    /// The name beside the line.
    pub(crate) name: String,
    /// The classes of its colour and dashes.
    pub(crate) class: String,
    pub(crate) points: Vec<ChartPoint>,
}

/// A point and the text that is shown under the pointer.
pub(crate) struct ChartPoint {
    pub(crate) at: [f64; 2],
    pub(crate) title: String,
}

/// What a chart shows.
pub(crate) struct LogChart<'a> {
    pub(crate) title: &'a str,
    /// The name of the horizontal axis.
    pub(crate) axis: &'a str,
    /// Writes a value of the horizontal axis.
    pub(crate) tick: fn(f64) -> String,
    pub(crate) series: &'a [ChartSeries],
    /// A height at which a line is drawn.
    pub(crate) limit: f64,
}

/// The size of a chart in its own units.
const SIZE: [f64; 2] = [400.0, 380.0];

/// The margins left, top, right and bottom of the plot.
const MARGINS: [f64; 4] = [40.0, 30.0, 12.0, 40.0];

/// The errors between which the vertical axis ends.
const ERRORS: [f64; 2] = [0.005, 8.0];

/// The size of a letter: its mean width, and the height of a line.
const LETTER: [f64; 2] = [6.9, 13.0];

/// Half the edge of the square that a point takes.
const POINT: f64 = 4.0;

/// The distance between places of a line that a name should not cover.
const STEP: f64 = 7.0;

/// An axis from the logarithm of its first value to that of its last.
#[derive(Clone, Copy)]
struct Axis {
    from: f64,
    to: f64,
    /// The places of these values.
    places: [f64; 2],
}

impl Axis {
    fn at(self, value: f64) -> f64 {
        let share = (math::ln(value.max(f64::MIN_POSITIVE)) - self.from) / (self.to - self.from);
        let [first, last] = self.places;
        first + share.clamp(0.0, 1.0) * (last - first)
    }

    /// An axis over values, with some room at its ends.
    fn over(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let positive = values.filter(|value| *value > 0.0 && value.is_finite());
        let [least, most] =
            positive.fold([f64::INFINITY, 0.0], |[least, most], value| [value.min(least), value.max(most)]);
        let [least, most] = if least <= most { [least, most] } else { [1.0, 1.0] };
        let (from, to) = (math::ln(least), math::ln(most));
        // At least a factor of ten is shown.
        let room = (0.05 * (to - from)).max(0.5 * (math::ln(12.0) - (to - from)));
        Self { from: from - room, to: to + room, places }
    }

    /// Round values on the axis, of which each is a multiple of another by 10, or by about 2 if that gives
    /// few.
    fn ticks(self) -> Vec<f64> {
        let within = |digits: &'static [f64]| -> Vec<f64> {
            let powers = (-6..15).flat_map(|power| digits.iter().map(move |digit| (*digit, power)));
            let values = powers.map(|(digit, power)| digit * math::powi(10.0, power));
            let is_within = |value: &f64| (self.from..=self.to).contains(&math::ln(*value));
            values.filter(is_within).collect()
        };
        let decades = within(&[1.0]);
        if decades.len() >= 3 { decades } else { within(&[1.0, 2.0, 5.0]) }
    }
}

/// A rectangle: left, top, right and bottom.
#[derive(Clone, Copy)]
struct Area([f64; 4]);

impl Area {
    fn about([x, y]: [f64; 2], half: [f64; 2]) -> Self {
        Self([x - half[0], y - half[1], x + half[0], y + half[1]])
    }

    /// The area that both have in common.
    fn common(self, other: Self) -> f64 {
        let [a, b] = [self.0, other.0];
        let width = a[2].min(b[2]) - a[0].max(b[0]);
        let height = a[3].min(b[3]) - a[1].max(b[1]);
        if width > 0.0 && height > 0.0 { width * height } else { 0.0 }
    }

    fn holds(self, [x, y]: [f64; 2]) -> bool {
        let [left, top, right, bottom] = self.0;
        (left..=right).contains(&x) && (top..=bottom).contains(&y)
    }
}

impl LogChart<'_> {
    /// Draws the chart.
    pub(crate) fn draw(&self, page: &mut Markup) {
        let [width, height] = SIZE;
        let [left, top, right, bottom] = MARGINS;
        let points = || self.series.iter().flat_map(|series| &series.points);
        let x = Axis::over(points().map(|point| point.at[0]), [left, width - right]);
        let highest = points().map(|point| point.at[1]).fold(1.0, f64::max).min(ERRORS[1]);
        let lowest = points().map(|point| point.at[1]).fold(0.05, f64::min).max(ERRORS[0]);
        let y = Axis {
            from: math::ln(0.8 * lowest),
            to: math::ln(1.25 * highest),
            places: [height - bottom, top],
        };
        page.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\"><title>{}</title>\n",
            escape(self.title)
        ));
        page.put(format_args!("<text class=\"name\" x=\"{left}\" y=\"16\">{}</text>", escape(self.title)));
        self.axes(page, x, y);
        let placed: Vec<Vec<[f64; 2]>> = self
            .series
            .iter()
            .map(|series| series.points.iter().map(|point| [x.at(point.at[0]), y.at(point.at[1])]).collect())
            .collect();
        for (series, places) in self.series.iter().zip(&placed) {
            let line: Vec<String> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            page.put(format_args!("<g class=\"{}\"><polyline points=\"{}\"/>", series.class, line.join(" ")));
            for ([x, y], point) in places.iter().zip(&series.points) {
                page.put(format_args!(
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"><title>{}</title></circle>",
                    escape(&point.title)
                ));
            }
            page.line("</g>");
        }
        self.names(page, &placed);
        page.line("</svg>");
    }

    /// The lines and numbers of both axes.
    fn axes(&self, page: &mut Markup, x: Axis, y: Axis) {
        let [width, height] = SIZE;
        let [left, top, right, bottom] = MARGINS;
        let (end, foot) = (width - right, height - bottom);
        for error in [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0] {
            if (y.from..=y.to).contains(&math::ln(error)) {
                let at = y.at(error);
                page.put(format_args!(
                    "<path class=\"grid\" d=\"M{left} {at:.1}H{end}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
                     text-anchor=\"end\">{error}</text>",
                    left - 5.0,
                    at + 4.0
                ));
            }
        }
        for value in x.ticks() {
            let at = x.at(value);
            page.put(format_args!(
                "<path class=\"grid\" d=\"M{at:.1} {top}V{foot}\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
                 text-anchor=\"middle\">{}</text>",
                foot + 15.0,
                (self.tick)(value)
            ));
        }
        page.put(format_args!(
            "<path class=\"limit\" d=\"M{left} {:.1}H{end}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text>\n",
            y.at(self.limit),
            0.5 * (left + end),
            height - 6.0,
            escape(self.axis)
        ));
    }

    /// The names, each near a point of its series and where it covers little.
    fn names(&self, page: &mut Markup, placed: &[Vec<[f64; 2]>]) {
        let points: Vec<Area> =
            placed.iter().flatten().map(|place| Area::about(*place, [POINT; 2])).collect();
        let lines: Vec<[f64; 2]> = placed.iter().flat_map(|places| along(places)).collect();
        // Short series first: a name has fewer places there.
        let mut order: Vec<usize> = (0..placed.len()).collect();
        order.sort_by_key(|series| placed[*series].len());
        let mut taken: Vec<Area> = Vec::new();
        for (series, places) in order.into_iter().map(|index| (&self.series[index], &placed[index])) {
            let half = [0.5 * LETTER[0] * series.name.chars().count() as f64, 0.5 * LETTER[1]];
            let Some((centre, anchor)) = best(places, half, &taken, &points, &lines) else { continue };
            let area = Area::about(centre, half);
            taken.push(area);
            page.put(format_args!("<g class=\"{} label\">", series.class));
            let near = [anchor[0].clamp(area.0[0], area.0[2]), anchor[1].clamp(area.0[1], area.0[3])];
            if distance(near, anchor) > 9.0 {
                page.put(format_args!(
                    "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>",
                    anchor[0], anchor[1], near[0], near[1]
                ));
            }
            page.put(format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text></g>\n",
                centre[0],
                centre[1] + 4.0,
                escape(&series.name)
            ));
        }
    }
}

/// The place for a name near one of some points, and that point: where it covers no other name, few points
/// and little of lines.
fn best(
    places: &[[f64; 2]],
    half: [f64; 2],
    names: &[Area],
    points: &[Area],
    lines: &[[f64; 2]],
) -> Option<([f64; 2], [f64; 2])> {
    const DISTANCES: [f64; 10] = [5.0, 8.0, 14.0, 21.0, 30.0, 41.0, 54.0, 70.0, 90.0, 115.0];
    const SIDES: [[f64; 2]; 12] = [
        [1.0, 0.0],
        [-1.0, 0.0],
        [0.0, -1.0],
        [0.0, 1.0],
        [0.9, -0.5],
        [0.9, 0.5],
        [-0.9, -0.5],
        [-0.9, 0.5],
        [0.5, -0.9],
        [0.5, 0.9],
        [-0.5, -0.9],
        [-0.5, 0.9],
    ];
    let [width, height] = SIZE;
    let [left, top, right, bottom] = MARGINS;
    let inside = |centre: [f64; 2]| {
        centre[0] - half[0] >= left
            && centre[0] + half[0] <= width - right + 8.0
            && centre[1] - half[1] >= top - 6.0
            && centre[1] + half[1] <= height - bottom
    };
    let mut found: Option<(f64, [f64; 2], [f64; 2])> = None;
    for anchor in places {
        for side in SIDES {
            for away in DISTANCES {
                let reach = [half[0] + POINT + away, half[1] + POINT + away];
                let centre = [anchor[0] + side[0] * reach[0], anchor[1] + side[1] * reach[1]];
                if !inside(centre) {
                    continue;
                }
                let area = Area::about(centre, half);
                let covered: f64 = names.iter().map(|name| name.common(area)).sum();
                let hidden: f64 = points.iter().map(|point| point.common(area)).sum();
                let crossed = lines.iter().filter(|place| area.holds(**place)).count() as f64;
                let cost = 40.0 * covered + 6.0 * hidden + 12.0 * crossed + away;
                if found.is_none_or(|(least, ..)| cost < least) {
                    found = Some((cost, centre, *anchor));
                }
            }
        }
    }
    found.map(|(_, centre, anchor)| (centre, anchor))
}

/// Places along the line that joins some points.
fn along(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let between = |ends: &[[f64; 2]]| {
        let [a, b] = [ends[0], ends[1]];
        let count = (distance(a, b) / STEP) as usize + 1;
        (0..count).map(move |step| {
            let share = step as f64 / count as f64;
            [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
        })
    };
    places.windows(2).flat_map(between).collect()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    math::hypot(a[0] - b[0], a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_on_the_axis() {
        let ticks = |least: f64, most: f64| Axis::over([least, most].into_iter(), [0.0, 1.0]).ticks();
        assert_eq!(ticks(50e3, 60e6), [1e5, 1e6, 1e7]);
        assert_eq!(ticks(1.0, 12.0), [1.0, 2.0, 5.0, 10.0]);
        // One value alone is in the middle.
        assert_eq!(ticks(3.0, 3.0), [1.0, 2.0, 5.0, 10.0]);
    }

    #[test]
    fn names_do_not_cover_each_other_where_there_is_room() {
        let series = |name: &str, y: f64| ChartSeries {
            name: name.into(),
            class: "plain".into(),
            points: vec![ChartPoint { at: [1e6, y], title: String::new() }],
        };
        let series: Vec<_> =
            (0..8).map(|k| series(&format!("series {k}"), 0.1 + 0.001 * f64::from(k))).collect();
        let chart =
            LogChart { title: "Bytes", axis: "bytes", tick: |_| String::new(), series: &series, limit: 0.1 };
        let mut page = Markup::default();
        chart.draw(&mut page);
        let mut areas: Vec<Area> = Vec::new();
        for label in page.0.split(" label\">").skip(1) {
            let text = label.split("<text ").nth(1).unwrap();
            let number = |key: &str| -> f64 {
                let rest = text.split(&format!("{key}=\"")).nth(1).unwrap();
                rest.split('"').next().unwrap().parse().unwrap()
            };
            let half = [0.5 * LETTER[0] * 8.0, 0.5 * LETTER[1]];
            areas.push(Area::about([number("x"), number("y") - 4.0], half));
        }
        assert_eq!(areas.len(), 8);
        for (index, area) in areas.iter().enumerate() {
            assert!(areas[..index].iter().all(|other| other.common(*area) < 1.0), "{index}");
        }
    }
}
