//! The part of a pair's card that shows the trade: a line of advice, a chart of the error against bytes and
//! one against look-ups, and the table of both.

use containers::escape_html as escape;

use crate::picture::report::chart::{Axis, Chart, ChartPoint, ChartSeries, ChartSize};
use crate::picture::report::figures::{Technique, Trade, TradePoint, TradeSeries};
use crate::picture::report::markup::Markup;
pub(crate) use crate::picture::report::trade_advice::LIMITS;
use crate::values::quantity::size;

/// Writes the trade of a pair.
pub(crate) fn section(page: &mut Markup, trade: &Trade) {
    page.put(format_args!(
        "<h4>Error against size and work</h4>\n<p>{}</p>\n<div class=\"trade\">\n",
        escape(&trade.advice.text)
    ));
    let chart = |page: &mut Markup, title, axis, tick, value: fn(&TradePoint) -> f64| {
        let series: Vec<ChartSeries> = trade.series.iter().map(|series| of_series(series, value)).collect();
        let at = |axis: usize| {
            series.iter().flat_map(move |series| &series.points).map(move |point| point.at[axis])
        };
        let (x, y) = (Axis::over(at(0), tick), Axis::stops(at(1)));
        let (limit, size) = ((LIMITS.p95, ""), ChartSize::LARGE);
        Chart { title, axis, x, y, series: &series, dots: true, limit, marks: &[], size }.draw(page);
    };
    chart(page, "Error (p95) in stops, by bytes", "bytes of textures and lights", bytes_tick, |point| {
        point.bytes as f64
    });
    chart(page, "Error (p95) in stops, by fetches", "bilinear fetches per pixel", fetches_tick, |point| {
        point.fetches as f64
    });
    page.line("</div>");
    if let Some(degrees) = degrees(&trade.series) {
        page.put(format_args!("<p class=\"small soft\">Points of a line: {degrees}.</p>\n"));
    }
    table(page, trade);
}

/// The degrees of each technique that has several.
fn degrees(series: &[TradeSeries]) -> Option<String> {
    let mut said: Vec<String> = Vec::new();
    for series in series {
        let degrees: Vec<String> =
            series.points.iter().filter_map(|point| Some(point.degree?.to_string())).collect();
        let Some(letter) = series.technique.letter().filter(|_| degrees.len() > 1) else { continue };
        let text = format!("{letter} = {}", degrees.join(", "));
        if !said.contains(&text) {
            said.push(text);
        }
    }
    (!said.is_empty()).then(|| said.join("; "))
}

/// A size without digits that say nothing.
fn bytes_tick(bytes: f64) -> String {
    size(bytes as u64).replace(".0 ", " ")
}

fn fetches_tick(fetches: f64) -> String {
    format!("{fetches}")
}

fn of_series(series: &TradeSeries, value: fn(&TradePoint) -> f64) -> ChartSeries {
    let point =
        |point: &TradePoint| ChartPoint { at: [value(point), point.errors.p95], title: said(series, point) };
    ChartSeries {
        name: name(series),
        class: class(series),
        points: series.points.iter().map(point).collect(),
    }
}

/// The name of a series with its lights.
fn name(series: &TradeSeries) -> String {
    match (series.technique, series.lights) {
        (Technique::Taps, 0) => "Taps, no lights".into(),
        (Technique::Taps, 1) => "Taps, 1 light".into(),
        (Technique::Taps, lights) => format!("Taps, {lights} lights"),
        (Technique::PartMaps, _) => "Map of each part".into(),
        (technique, _) => technique.title().into(),
    }
}

/// The classes of a series: its colour, and how its line is dashed.
fn class(series: &TradeSeries) -> String {
    let colour = match series.technique {
        Technique::ReflectionMap | Technique::PartMaps => "plain",
        Technique::SplitSum => "split",
        Technique::KautzMccool => "texture",
        Technique::Cabral => "views",
        Technique::Shrm => "shrm baked",
        Technique::ShrmSeparate => "shrm",
        Technique::Components => "components",
        Technique::Taps => "taps",
    };
    let dashes = match (series.technique, series.lights) {
        (Technique::Taps, 0) => " dotted",
        (Technique::Taps, 1..=4) => " dashed",
        _ => "",
    };
    format!("{colour}{dashes}")
}

/// A technique at a degree.
fn setting(series: &TradeSeries, point: &TradePoint) -> String {
    match (series.technique.letter(), point.degree) {
        (Some(letter), Some(degree)) => format!("{letter} = {degree}"),
        _ => "–".into(),
    }
}

/// The numbers of a point, for the pointer.
fn said(series: &TradeSeries, point: &TradePoint) -> String {
    let setting = match point.degree {
        Some(_) => format!(", {}", setting(series, point)),
        None => String::new(),
    };
    format!(
        "{}{setting}: {} and {} stops, {}, {} fetches",
        name(series),
        stops(point.errors.p95),
        stops(point.errors.p99),
        size(point.bytes),
        point.fetches
    )
}

fn stops(error: f64) -> String {
    format!("{error:.3}")
}

/// All numbers, folded up.
fn table(page: &mut Markup, trade: &Trade) {
    page.line(
        "<details><summary>All numbers</summary><div class=\"scroll\"><table><thead><tr><th>Technique</th><th>Degree</th><th \
         class=\"number\">p95</th><th class=\"number\">p99</th><th class=\"number\">Bytes</th><th \
         class=\"number\">Fetches</th><th>Once for</th></tr></thead><tbody>",
    );
    for series in &trade.series {
        for point in &series.points {
            let good = LIMITS.excess(&point.errors) <= 1.0;
            page.put(format_args!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"number{mark}\">{}</td><td class=\"number{mark}\">{}</td><td \
                 class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>\n",
                name(series),
                setting(series, point),
                stops(point.errors.p95),
                stops(point.errors.p99),
                size(point.bytes),
                point.fetches,
                if series.technique.is_shared() { "an environment" } else { "a pair" },
                mark = if good { " pick" } else { "" },
            ));
        }
    }
    page.line("</tbody></table></div></details>");
}
