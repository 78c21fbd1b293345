//! The charts of `docs/scale.md`.

use std::fmt::Write as _;

use super::Outcome;

/// The colours of lines.
const COLOURS: [&str; 2] = ["#1f77b4", "#d62728"];

/// The names of the cases whose workers are more and more.
const BY_WORKERS: [&str; 3] = ["100 workers", "300 workers", "1000 workers"];

/// The names of the cases whose jobs are more and more, and whose items take no time.
const BY_JOBS: [&str; 4] =
    ["no work, 30 jobs", "no work, 100 jobs", "no work, 300 jobs", "no work, 1000 jobs"];

/// A line: its name, and its points.
type Line<'a> = (&'a str, Vec<[f64; 2]>);

/// An axis: its title, its numbers, and whether it is logarithmic.
struct Axis {
    title: String,
    ticks: Vec<f64>,
    is_logarithmic: bool,
}

impl Axis {
    /// An axis from 0 to a round number that is at least `most`.
    fn to(title: &str, most: f64) -> Self {
        let power = 10f64.powf(most.max(1e-9).log10().floor());
        let step = [0.2, 0.5, 1.0, 2.0].map(|step| step * power).into_iter().find(|step| 6.0 * step >= most);
        let step = step.unwrap_or(2.0 * power);
        let ticks = (0..=(most / step).ceil() as usize).map(|index| index as f64 * step).collect();
        Self { title: title.into(), ticks, is_logarithmic: false }
    }

    /// Where a number is, from 0 to 1.
    fn place(&self, number: f64) -> f64 {
        let scaled = |number: f64| if self.is_logarithmic { number.max(1e-9).ln() } else { number };
        let ends = [self.ticks.first(), self.ticks.last()].map(|end| scaled(end.copied().unwrap_or(1.0)));
        (scaled(number) - ends[0]) / (ends[1] - ends[0])
    }
}

/// A chart as SVG.
fn chart(across: &Axis, up: &Axis, lines: &[Line<'_>], has_points: bool) -> String {
    let x = |number: f64| 80.0 + 440.0 * across.place(number);
    let y = |number: f64| 260.0 - 240.0 * up.place(number);
    let mut svg = String::new();
    let mut add = |line: std::fmt::Arguments<'_>| {
        // A String takes all.
        let _ = writeln!(svg, "{line}");
    };
    add(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 660 320\" font-family=\"sans-serif\" \
         font-size=\"13\">"
    ));
    add(format_args!("<rect width=\"660\" height=\"320\" fill=\"#fff\"/>"));
    for tick in &up.ticks {
        let height = y(*tick);
        add(format_args!("<path d=\"M80 {height:.1}H520\" stroke=\"#ddd\"/>"));
        add(format_args!("<text x=\"72\" y=\"{:.1}\" text-anchor=\"end\">{tick}</text>", height + 4.0));
    }
    for tick in &across.ticks {
        add(format_args!("<text x=\"{:.1}\" y=\"280\" text-anchor=\"middle\">{tick}</text>", x(*tick)));
    }
    add(format_args!("<text x=\"300\" y=\"306\" text-anchor=\"middle\">{}</text>", across.title));
    add(format_args!(
        "<text x=\"20\" y=\"140\" text-anchor=\"middle\" transform=\"rotate(-90 20 140)\">{}</text>",
        up.title
    ));
    let mut ends = Vec::new();
    for ((name, points), colour) in lines.iter().zip(COLOURS) {
        let places = points.iter().map(|[right, high]| format!("{:.1},{:.1}", x(*right), y(*high)));
        add(format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            places.collect::<Vec<_>>().join(" ")
        ));
        for [right, high] in points.iter().filter(|_| has_points) {
            add(format_args!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{colour}\"/>",
                x(*right),
                y(*high)
            ));
        }
        ends.extend(points.last().map(|end| (y(end[1]), *name, colour)));
    }
    // Names at the ends of lines, each at least a line of text below the one above.
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut above = f64::NEG_INFINITY;
    for (height, name, colour) in ends {
        above = height.max(above + 15.0);
        add(format_args!("<text x=\"528\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>", above + 4.0));
    }
    add(format_args!("</svg>"));
    svg
}

/// The charts of these outcomes, each with its file name; without those whose cases were not simulated.
pub fn charts(outcomes: &[Outcome]) -> Vec<(&'static str, String)> {
    let find = |names: &[&str]| -> Vec<&Outcome> {
        let named = |name: &&str| outcomes.iter().find(|outcome| outcome.0["name"] == **name);
        names.iter().filter_map(named).collect()
    };
    let numbers = |case: &Outcome, path: &[&str]| -> Vec<f64> {
        let values = path.iter().fold(&case.0, |value, name| &value[*name]).as_array();
        values.into_iter().flatten().filter_map(|value| value.as_f64()).collect()
    };
    let most = |lines: &[Line<'_>], axis: usize| {
        lines.iter().flat_map(|(_, points)| points).map(|point| point[axis]).fold(0.0, f64::max)
    };
    let mut all = Vec::new();

    let by_workers = find(&BY_WORKERS);
    let line = |of: &dyn Fn(&Outcome) -> f64| -> Vec<[f64; 2]> {
        by_workers.iter().map(|case| [case.number(&["workers"]), of(case)]).collect()
    };
    let lines = [
        ("measured", line(&|case| case.number(&["client", "seconds"]))),
        ("ideal", line(&Outcome::ideal_seconds)),
    ];
    let workers = Axis { title: "workers".into(), ticks: vec![100.0, 300.0, 1000.0], is_logarithmic: true };
    all.push((
        "scale-makespan.svg",
        chart(&workers, &Axis::to("seconds", most(&lines, 1)), &lines, true),
        by_workers.len(),
    ));

    let by_jobs = find(&BY_JOBS);
    let rate = |case: &&Outcome| {
        let seconds = case.number(&["client", "processor_seconds"]);
        [case.number(&["jobs"]), 1e3 * seconds / case.number(&["client", "items"])]
    };
    let lines = [("client", by_jobs.iter().map(rate).collect::<Vec<_>>())];
    let jobs = Axis { title: "jobs".into(), ticks: vec![30.0, 100.0, 300.0, 1000.0], is_logarithmic: true };
    let title = "milliseconds of processor time an item";
    all.push((
        "scale-cost.svg",
        chart(&jobs, &Axis::to(title, most(&lines, 1)), &lines, true),
        by_jobs.len(),
    ));

    let memory = find(&["1000 workers", "100 workers"]);
    let line = |case: &&Outcome| {
        let values = numbers(case, &["client", "mebibytes"]);
        let seconds = case.number(&["client", "seconds"]);
        let count = values.len().max(1) as f64;
        values.iter().enumerate().map(|(index, value)| [index as f64 * seconds / count, *value]).collect()
    };
    let lines = memory.iter().zip(["1000 jobs", "100 jobs"]).map(|(case, name)| (name, line(case)));
    let lines = lines.collect::<Vec<_>>();
    let (across, up) = (Axis::to("seconds", most(&lines, 0)), Axis::to("MiB", most(&lines, 1)));
    all.push(("scale-memory.svg", chart(&across, &up, &lines, false), memory.len()));
    all.into_iter().filter(|(.., cases)| *cases > 1).map(|(name, svg, _)| (name, svg)).collect()
}
