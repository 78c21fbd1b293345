//! A chart as SVG: series of points joined by lines, each with its name beside it.
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

/// A place of the horizontal axis that a line marks.
pub(crate) struct ChartMark {
    pub(crate) at: f64,
    pub(crate) name: String,
}

/// What a chart shows.
pub(crate) struct Chart<'a> {
    pub(crate) title: &'a str,
    /// The name of the horizontal axis.
    pub(crate) axis: &'a str,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: &'a [ChartSeries],
    /// Whether the points are drawn, or only their lines.
    pub(crate) dots: bool,
    /// A height at which a line is drawn, and its name, which may be empty.
    pub(crate) limit: (f64, &'a str),
    pub(crate) marks: &'a [ChartMark],
    pub(crate) size: ChartSize,
}

/// The size of a chart in its own units.
#[derive(Clone, Copy)]
pub(crate) struct ChartSize {
    pub(crate) width: f64,
    pub(crate) height: f64,
    /// The size of letters, which is that of the page's style sheet.
    pub(crate) font: f64,
}

impl ChartSize {
    /// A chart of many series and points.
    pub(crate) const LARGE: Self = Self { width: 400.0, height: 380.0, font: 10.5 };
    /// A chart of a few lines, which are legible on a phone.
    pub(crate) const SMALL: Self = Self { width: 330.0, height: 300.0, font: 12.0 };

    /// The mean width of a letter, and the height of a line.
    fn letter(self) -> [f64; 2] {
        LETTER.map(|length| length * (self.font / Self::LARGE.font))
    }
}

/// The margins left, top, right and bottom of the plot.
const MARGINS: [f64; 4] = [40.0, 30.0, 12.0, 40.0];

/// The errors between which an axis of them ends.
const ERRORS: [f64; 2] = [0.005, 8.0];

/// The mean width of a letter of a large chart, and the height of a line.
const LETTER: [f64; 2] = [6.9, 13.0];

/// Half the edge of the square that a point takes.
const POINT: f64 = 4.0;

/// The distance between places of a line that a name should not cover.
const STEP: f64 = 7.0;

/// How values are spaced along an axis.
#[derive(Clone, Copy)]
enum Scale {
    Linear,
    Logarithmic,
    /// By the logarithm of the value, from 1 on downwards.
    Falling,
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => math::ln(value.max(f64::MIN_POSITIVE)),
            Self::Falling => -math::ln(value.max(f64::MIN_POSITIVE)),
        }
    }
}

/// An axis, and the values that it names.
pub(crate) struct Axis {
    scale: Scale,
    /// The first and the last value, on the scale.
    from: f64,
    to: f64,
    ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A logarithmic axis over values, with some room at its ends.
    pub(crate) fn over(values: impl Iterator<Item = f64>, tick: fn(f64) -> String) -> Self {
        let positive = values.filter(|value| *value > 0.0 && value.is_finite());
        let [least, most] =
            positive.fold([f64::INFINITY, 0.0], |[least, most], value| [value.min(least), value.max(most)]);
        let [least, most] = if least <= most { [least, most] } else { [1.0, 1.0] };
        let (from, to) = (math::ln(least), math::ln(most));
        // At least a factor of ten is shown.
        let room = (0.05 * (to - from)).max(0.5 * (math::ln(12.0) - (to - from)));
        let (from, to) = (from - room, to + room);
        let ticks = round_values(from, to).into_iter().map(|value| (value, tick(value)));
        Self { scale: Scale::Logarithmic, from, to, ticks: ticks.collect() }
    }

    /// A logarithmic axis over errors in stops.
    pub(crate) fn stops(errors: impl Iterator<Item = f64> + Clone) -> Self {
        let highest = errors.clone().fold(1.0, f64::max).min(ERRORS[1]);
        let lowest = errors.fold(0.05, f64::min).max(ERRORS[0]);
        let (from, to) = (math::ln(0.8 * lowest), math::ln(1.25 * highest));
        let all = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
        let within = all.into_iter().filter(|error| (from..=to).contains(&math::ln(*error)));
        let ticks = within.map(|error| (error, format!("{error}"))).collect();
        Self { scale: Scale::Logarithmic, from, to, ticks }
    }

    /// A linear axis over degrees from 0 to the highest.
    pub(crate) fn degrees(highest: usize) -> Self {
        let highest = highest.max(1);
        let steps = [1, 2, 5, 10, 20, 50, 100];
        let step = steps.into_iter().find(|step| highest / step <= 8).unwrap_or(100);
        let ticks = (0..=highest).step_by(step).map(|degree| (degree as f64, degree.to_string())).collect();
        Self { scale: Scale::Linear, from: 0.0, to: highest as f64, ticks }
    }

    /// An axis over the share that is lost, which rises as less is lost: each step upwards loses a tenth as
    /// much. Its ticks are the shares that are kept, in percent.
    pub(crate) fn kept() -> Self {
        let ticks = [(1.0, "0"), (0.5, "50"), (0.1, "90"), (0.01, "99"), (0.001, "99.9"), (1e-4, "99.99")];
        let ticks = ticks.map(|(lost, kept)| (lost, kept.to_owned()));
        Self { scale: Scale::Falling, from: 0.0, to: -math::ln(1e-4), ticks: ticks.into() }
    }
}

/// Round values between two logarithms, of which each is a multiple of another by 10, or by about 2 if that
/// gives few.
fn round_values(from: f64, to: f64) -> Vec<f64> {
    let within = |digits: &'static [f64]| -> Vec<f64> {
        let powers = (-6..15).flat_map(|power| digits.iter().map(move |digit| (*digit, power)));
        let values = powers.map(|(digit, power)| digit * math::powi(10.0, power));
        let is_within = |value: &f64| (from..=to).contains(&math::ln(*value));
        values.filter(is_within).collect()
    };
    let decades = within(&[1.0]);
    if decades.len() >= 3 { decades } else { within(&[1.0, 2.0, 5.0]) }
}

/// An axis between the places of its first and its last value.
#[derive(Clone, Copy)]
struct Placed<'a> {
    axis: &'a Axis,
    places: [f64; 2],
}

impl Placed<'_> {
    fn at(self, value: f64) -> f64 {
        let Axis { scale, from, to, .. } = *self.axis;
        let share = (scale.of(value) - from) / (to - from);
        let [first, last] = self.places;
        first + share.clamp(0.0, 1.0) * (last - first)
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

impl Chart<'_> {
    /// Draws the chart.
    pub(crate) fn draw(&self, page: &mut Markup) {
        let ChartSize { width, height, .. } = self.size;
        let [left, top, right, bottom] = MARGINS;
        let x = Placed { axis: &self.x, places: [left, width - right] };
        let y = Placed { axis: &self.y, places: [height - bottom, top] };
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
            for ([x, y], point) in places.iter().zip(&series.points).filter(|_| self.dots) {
                page.put(format_args!(
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\"><title>{}</title></circle>",
                    escape(&point.title)
                ));
            }
            page.line("</g>");
        }
        let taken = self.marks(page, x, y);
        self.names(page, &placed, taken);
        page.line("</svg>");
    }

    /// The lines and numbers of both axes.
    fn axes(&self, page: &mut Markup, x: Placed<'_>, y: Placed<'_>) {
        let ChartSize { width, height, .. } = self.size;
        let [left, top, right, bottom] = MARGINS;
        let (end, foot) = (width - right, height - bottom);
        for (value, name) in &y.axis.ticks {
            let at = y.at(*value);
            page.put(format_args!(
                "<path class=\"grid\" d=\"M{left} {at:.1}H{end}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{name}</text>",
                left - 5.0,
                at + 4.0
            ));
        }
        for (value, name) in &x.axis.ticks {
            let at = x.at(*value);
            page.put(format_args!(
                "<path class=\"grid\" d=\"M{at:.1} {top}V{foot}\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
                 text-anchor=\"middle\">{name}</text>",
                foot + 15.0,
            ));
        }
        let (limit, name) = self.limit;
        if !name.is_empty() {
            page.put(format_args!(
                "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                end - 3.0,
                y.at(limit) + 13.0,
                escape(name)
            ));
        }
        page.put(format_args!(
            "<path class=\"limit\" d=\"M{left} {:.1}H{end}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text>\n",
            y.at(limit),
            0.5 * (left + end),
            height - 6.0,
            escape(self.axis)
        ));
    }

    /// The lines of the marks, each with its name at the foot, one above the other; returns what these names
    /// and that of the limit take.
    fn marks(&self, page: &mut Markup, x: Placed<'_>, y: Placed<'_>) -> Vec<Area> {
        let ChartSize { width, height, .. } = self.size;
        let [letter, line] = self.size.letter();
        let (foot, end) = (height - MARGINS[3], width - MARGINS[2]);
        let (limit, name) = self.limit;
        let (at, length) = (y.at(limit), letter * name.chars().count() as f64);
        let mut taken = Vec::new();
        if !name.is_empty() {
            taken.push(Area([end - 3.0 - length, at - 2.0, end, at + line + 3.0]));
        }
        for (index, mark) in self.marks.iter().enumerate() {
            let (at, length) = (x.at(mark.at), letter * mark.name.chars().count() as f64);
            let (from, anchor) = match at + 4.0 + length <= end {
                true => (at + 4.0, "start"),
                false => (at - 4.0 - length, "end"),
            };
            let base = foot - 6.0 - index as f64 * (line + 2.0);
            page.put(format_args!(
                "<path class=\"mark\" d=\"M{at:.1} {}V{foot}\"/><text class=\"name halo\" x=\"{:.1}\" y=\"{base:.1}\" \
                 text-anchor=\"{anchor}\">{}</text>\n",
                MARGINS[1],
                if anchor == "start" { at + 4.0 } else { at - 4.0 },
                escape(&mark.name)
            ));
            taken.push(Area([from, base - line, from + length, base + 3.0]));
        }
        taken
    }

    /// The names, each near a point of its series and where it covers little.
    fn names(&self, page: &mut Markup, placed: &[Vec<[f64; 2]>], mut taken: Vec<Area>) {
        let [letter, line] = self.size.letter();
        let points: Vec<Area> =
            placed.iter().flatten().map(|place| Area::about(*place, [POINT; 2])).collect();
        let lines: Vec<[f64; 2]> = placed.iter().flat_map(|places| along(places)).collect();
        // Short series first: a name has fewer places there.
        let mut order: Vec<usize> = (0..placed.len()).collect();
        order.sort_by_key(|series| placed[*series].len());
        for (series, places) in order.into_iter().map(|index| (&self.series[index], &placed[index])) {
            let half = [0.5 * letter * series.name.chars().count() as f64, 0.5 * line];
            let place = NamePlace { size: self.size, half, names: &taken, points: &points, lines: &lines };
            let Some((centre, anchor)) = place.best(places) else { continue };
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

/// What a name of a series must fit into.
struct NamePlace<'a> {
    size: ChartSize,
    /// Half the width and the height of the name.
    half: [f64; 2],
    names: &'a [Area],
    points: &'a [Area],
    lines: &'a [[f64; 2]],
}

impl NamePlace<'_> {
    /// The place for a name near one of some points, and that point: where it covers no other name, few
    /// points and little of lines.
    fn best(&self, places: &[[f64; 2]]) -> Option<([f64; 2], [f64; 2])> {
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
        let Self { size: ChartSize { width, height, .. }, half, names, points, lines } = *self;
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
        let ticks = |least: f64, most: f64| -> Vec<f64> {
            let axis = Axis::over([least, most].into_iter(), |_| String::new());
            axis.ticks.into_iter().map(|(value, _)| value).collect()
        };
        assert_eq!(ticks(50e3, 60e6), [1e5, 1e6, 1e7]);
        assert_eq!(ticks(1.0, 12.0), [1.0, 2.0, 5.0, 10.0]);
        // One value alone is in the middle.
        assert_eq!(ticks(3.0, 3.0), [1.0, 2.0, 5.0, 10.0]);
    }

    #[test]
    fn a_tenth_of_the_loss_is_one_step_up() {
        let axis = Axis::kept();
        let placed = Placed { axis: &axis, places: [400.0, 0.0] };
        for (lost, place) in
            [(2.0, 400.0), (1.0, 400.0), (0.1, 300.0), (1e-3, 100.0), (1e-6, 0.0), (0.0, 0.0)]
        {
            assert!((placed.at(lost) - place).abs() < 1e-9, "{lost}: {}", placed.at(lost));
        }
        let ticks = |highest| Axis::degrees(highest).ticks.iter().map(|tick| tick.0).collect::<Vec<_>>();
        assert_eq!(ticks(5), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(ticks(30), [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]);
        assert_eq!(ticks(0), [0.0, 1.0]);
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
        let at = |axis: usize| series.iter().flat_map(move |series| &series.points).map(move |p| p.at[axis]);
        let chart = Chart {
            title: "Bytes",
            axis: "bytes",
            x: Axis::over(at(0), |_| String::new()),
            y: Axis::stops(at(1)),
            series: &series,
            dots: true,
            limit: (0.1, ""),
            marks: &[],
            size: ChartSize::LARGE,
        };
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
