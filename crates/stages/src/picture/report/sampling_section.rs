//! The section of a report's page on the noise of samples.

use containers::escape_html as escape;

use crate::picture::report::figures::{Follows, Noise, NoisePair, PointSet, Report, SAMPLES};
use crate::picture::report::markup::Markup;
use crate::values::percent;

/// The section: for each pair, a chart of the error against samples and a table.
pub(crate) fn section(page: &mut Markup, report: &Report) {
    page.line("<h2 id=\"sampling\">Sampling: how noisy a few rays are</h2>");
    page.line(
        "<p>The relative RMS error of a pixel whose light is the mean of a few directions, over surfaces that face all \
         ways. Directions follow the light, the material (lobe), both with half of the samples each, or the product of \
         both. Lines are of stratified points, dashes of random ones.</p>",
    );
    for pair in &report.sampling {
        page.put(format_args!(
            "<section class=\"pair\"><h3>{} under {}</h3>\n",
            escape(&pair.material),
            escape(&pair.environment)
        ));
        chart(page, pair);
        table(page, pair);
        page.line("</section>");
    }
}

fn table(page: &mut Markup, pair: &NoisePair) {
    page.line("<div class=\"scroll\"><table><thead><tr><th>Directions follow</th><th>Points</th>");
    for samples in SAMPLES {
        page.put(format_args!("<th class=\"number\">{samples} samples</th>"));
    }
    page.line("</tr></thead><tbody>");
    for noise in &pair.noise {
        let points = match noise.points {
            PointSet::Random => "random",
            PointSet::Stratified => "stratified",
        };
        page.put(format_args!("<tr><th scope=\"row\">{}</th><td>{points}</td>", noise.follows.title()));
        for rms in &noise.rms {
            page.put(format_args!("<td class=\"number\">{}</td>", percent(*rms)));
        }
        page.line("</tr>");
    }
    page.line("</tbody></table></div>");
}

/// The places of a chart in its own units.
const WIDTH: f64 = 560.0;
const HEIGHT: f64 = 240.0;

/// The errors at the foot and the head of a chart.
const ERRORS: [f64; 2] = [0.003, 10.0];

/// The error against samples, both axes logarithmic.
fn chart(page: &mut Markup, pair: &NoisePair) {
    let between =
        |value: f64, [from, to]: [f64; 2]| math::ln(value.clamp(from, to) / from) / math::ln(to / from);
    let ends = [SAMPLES[0] as f64, SAMPLES[SAMPLES.len() - 1] as f64];
    let x = |samples: usize| 70.0 + (WIDTH - 160.0) * between(samples as f64, ends);
    let y = |rms: f64| HEIGHT - 30.0 - (HEIGHT - 45.0) * between(rms, ERRORS);
    page.put(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         font-size=\"12\" role=\"img\" fill=\"currentColor\"><title>Error against samples</title>"
    ));
    for rms in [0.01, 0.1, 1.0, 10.0] {
        let (height, end) = (y(rms), WIDTH - 90.0);
        page.put(format_args!(
            "<path d=\"M70 {height:.1}H{end}\" stroke=\"currentColor\" stroke-opacity=\"0.2\"/><text x=\"64\" y=\"{:.1}\" \
             text-anchor=\"end\">{}</text>",
            height + 4.0,
            percent(rms)
        ));
    }
    for samples in SAMPLES {
        page.put(format_args!(
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{samples}</text>",
            x(samples),
            HEIGHT - 10.0
        ));
    }
    page.put(format_args!("<text x=\"{}\" y=\"{}\">samples</text>", WIDTH - 70.0, HEIGHT - 10.0));
    for noise in &pair.noise {
        page.put(format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{}/>",
            line(noise, x, y),
            colour(noise.follows),
            if noise.points == PointSet::Random { " stroke-dasharray=\"5 4\"" } else { "" }
        ));
    }
    // Names at the ends of lines, each at least a line of text below the one above.
    let stratified = pair.noise.iter().filter(|noise| noise.points == PointSet::Stratified);
    let mut names: Vec<(f64, Follows)> =
        stratified.map(|noise| (noise.rms.last().map_or(0.0, |rms| y(*rms)), noise.follows)).collect();
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut above = f64::NEG_INFINITY;
    for (height, follows) in names {
        above = height.max(above + 14.0);
        page.put(format_args!(
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{}\">{}</text>",
            WIDTH - 84.0,
            above + 4.0,
            colour(follows),
            follows.title()
        ));
    }
    page.line("</svg>");
}

fn line(noise: &Noise, x: impl Fn(usize) -> f64, y: impl Fn(f64) -> f64) -> String {
    let places =
        SAMPLES.iter().zip(&noise.rms).map(|(samples, rms)| format!("{:.1},{:.1}", x(*samples), y(*rms)));
    places.collect::<Vec<_>>().join(" ")
}

/// The colour of a density, legible on light and dark paper.
fn colour(follows: Follows) -> &'static str {
    match follows {
        Follows::Light => "#c98500",
        Follows::Lobe => "#2f80d8",
        Follows::Both => "#9a5fd0",
        Follows::Product => "#17956b",
    }
}
