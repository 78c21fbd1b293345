//! The section of a report's page on degrees: which F and P hold how much of each reflection.

use containers::escape_html as escape;
use engine::Failure;

use crate::picture::data_uri;
use crate::picture::report::chart::{Axis, Chart, ChartMark, ChartPoint, ChartSeries, ChartSize};
use crate::picture::report::degree_figures::{
    BLURS, CAPTURED_F, CAPTURED_P, CapturedEnergy, DegreePair, Truncation,
};
use crate::picture::report::degree_pictures::{DegreePictures, PICTURE, PairPictures};
use crate::picture::report::figures::Report;
use crate::picture::report::markup::Markup;
use crate::picture::report::picture::difference;
use crate::values::percent;

/// The section: the energy that each material's low degrees hold, each environment blurred more and more, and
/// for each pair what truncations lose.
pub(crate) fn section(page: &mut Markup, report: &Report, pictures: &DegreePictures) -> Result<(), Failure> {
    page.put(format_args!(
        "<h2 id=\"degrees\"{}>Degrees: how much of a reflection F and P hold</h2>\n<p>F is the highest degree of the light \
         and of the material in the incident direction, P that in the view, as in Ramamoorthi and Hanrahan (2002). What \
         a series keeps is a share of energy, the integral of the square: 99 % kept is an RMS error of 10 %. \
         Energy is in the brightest places; the eye compares ratios, and so does the choice of degrees.</p>\n",
        if report.pairs.is_empty() { " class=\"first\"" } else { "" }
    ));
    captured(page, &report.degrees.materials);
    for (environment, lights) in &pictures.lights {
        blurred(page, report, pictures, environment, lights)?;
    }
    for (pair, pictures) in report.degrees.pairs.iter().zip(&pictures.pairs) {
        card(page, report, pair, pictures)?;
    }
    Ok(())
}

/// The chart of [RH02, fig. 8]: a row for each material, and a symbol for each P.
fn captured(page: &mut Markup, materials: &[CapturedEnergy]) {
    page.put(format_args!(
        "<h3>Energy of each material</h3>\n<p>The share of a material's energy that F = {CAPTURED_F} and each P from 0 to \
         {CAPTURED_P} hold, whatever the light: grey diamonds from P = 0 on, and a circle for P = {CAPTURED_P}. A narrow \
         highlight needs a higher F, and then no P holds all.</p>\n"
    ));
    let names = materials.iter().map(|material| material.material.chars().count()).max().unwrap_or(0);
    let (left, row) = (12.0 + 6.6 * names.min(24) as f64, 20.0);
    let (width, head) = (left + 330.0, 26.0);
    let foot = head + row * materials.len() as f64;
    let x = |share: f64| left + share.clamp(0.0, 1.0) * (width - left - 24.0);
    page.put(format_args!(
        "<svg class=\"captured\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {:.0}\" role=\"img\" \
         width=\"{width}\"><title>Energy of each material by P</title>\n",
        foot + 8.0
    ));
    for tick in [0.0, 0.25, 0.5, 0.75, 1.0] {
        page.put(format_args!(
            "<path class=\"grid\" d=\"M{0:.1} {head}V{foot}\"/><text x=\"{0:.1}\" y=\"16\" text-anchor=\"middle\">{1}{2}</text>",
            x(tick),
            100.0 * tick,
            if tick == 1.0 { " %" } else { "" }
        ));
    }
    for (index, material) in materials.iter().enumerate() {
        let middle = head + row * (index as f64 + 0.5);
        let name: String = material.material.chars().take(24).collect();
        page.put(format_args!(
            "\n<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            left - 8.0,
            middle + 4.0,
            escape(&name)
        ));
        let (least, most) = (material.by_p.first().copied(), material.by_p.last().copied());
        page.put(format_args!(
            "<path class=\"line\" d=\"M{:.1} {middle:.1}H{:.1}\"/>",
            x(least.unwrap_or(0.0)),
            x(most.unwrap_or(0.0))
        ));
        for (p, held) in material.by_p.iter().enumerate() {
            let (at, said) = (x(*held), format!("P = {p}: {}", percent(*held)));
            if p == CAPTURED_P {
                page.put(format_args!(
                    "<circle class=\"circle\" cx=\"{at:.1}\" cy=\"{middle:.1}\" r=\"4.5\"><title>{said}</title></circle>"
                ));
            } else {
                page.put(format_args!(
                    "<path class=\"diamond\" d=\"M{:.1} {middle:.1}l4.5 -5.5l4.5 5.5l-4.5 5.5z\"><title>{said}</title></path>",
                    at - 4.5
                ));
            }
        }
    }
    page.line("</svg>");
}

/// The spheres of [RH02, fig. 5]: an environment that is blurred more and more, on each material.
fn blurred(
    page: &mut Markup,
    report: &Report,
    pictures: &DegreePictures,
    environment: &str,
    lights: &[Vec<[u8; 3]>],
) -> Result<(), Failure> {
    let (edge, limits) = (report.settings.sphere, &report.settings.limits);
    let own = || {
        let pairs = report.degrees.pairs.iter().zip(&pictures.pairs);
        pairs.filter(|(pair, _)| pair.environment == environment)
    };
    page.put(format_args!(
        "<section class=\"pair\"><h3>Blurred light: {name}</h3>\n<p>Each row has light of fewer degrees, smoothed by a \
         Hanning window. A sphere in a yellow ring looks like the one under the light itself: 95 % of its samples are \
         within {:.2} stops, 99 % within {:.2}. The sharper the material, the sooner it shows that the light is \
         blurred.</p>\n<div class=\"scroll\"><div class=\"spheres\" style=\"--columns: {}\">\n<div></div><div \
         class=\"head\">light</div>",
        limits.p95,
        limits.p99,
        own().count() + 1,
        name = escape(environment),
    ));
    for (pair, _) in own() {
        page.put(format_args!("<div class=\"head\">{}</div>", escape(&pair.material)));
    }
    for (row, light) in lights.iter().enumerate() {
        let degree = row.checked_sub(1).and_then(|row| BLURS.get(row));
        let what = degree.map_or("as it is".to_owned(), |degree| format!("degree {degree}"));
        page.put(format_args!(
            "\n<div class=\"side\">{what}</div><img class=\"light\" src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}: {what}\"/>",
            data_uri(PICTURE.width, PICTURE.height, light)?,
            PICTURE.width,
            PICTURE.height,
            escape(environment),
        ));
        for (pair, pictures) in own() {
            let (pixels, alike) = match row.checked_sub(1) {
                None => (Some(&pictures.truth), true),
                Some(row) => {
                    (pictures.blurred.get(row), pair.blurred.get(row).is_some_and(|found| found.alike))
                }
            };
            let Some(pixels) = pixels else { continue };
            page.put(format_args!(
                "<img{} src=\"{}\" width=\"{edge}\" height=\"{edge}\" alt=\"{}: {what}\"/>",
                if alike { " class=\"alike\"" } else { "" },
                data_uri(edge, edge, pixels)?,
                escape(&pair.material),
            ));
        }
    }
    page.line("</div></div></section>");
    Ok(())
}

/// One pair: both charts, the truncations that matter, and spheres at some P.
fn card(
    page: &mut Markup,
    report: &Report,
    pair: &DegreePair,
    pictures: &PairPictures,
) -> Result<(), Failure> {
    let [most_f, most_p] = pair.highest;
    let name = escape(&format!("{} under {}", pair.material, pair.environment));
    let lamps = match pair.lamps {
        0 => String::new(),
        1 => " Without its lamp, which is beside the series.".to_owned(),
        lamps => format!(" Without its {lamps} lamps, which are beside the series."),
    };
    page.put(format_args!(
        "<section class=\"pair\"><h3>{name}</h3>\n<p>The share of energy that a truncation keeps.{lamps} Truth is \
         measured in directions against brute force; the bound is that of appendix B with what P loses, which holds \
         always.</p>\n<div class=\"trade degrees\">\n"
    ));
    chart(page, pair, "Energy kept in %, by F", &format!("F, at P = {most_p}"), &pair.by_f, 0);
    if pair.by_p.len() > 1 {
        chart(page, pair, "Energy kept in %, by P", &format!("P, at F = {most_f}"), &pair.by_p, 1);
    }
    page.line("</div>");
    if pair.by_p.len() <= 1 {
        page.line("<p>The material is the same for every view: P = 0 keeps all.</p>");
    }
    table(page, pair);
    spheres(page, report, pair, pictures)?;
    page.line("</section>");
    Ok(())
}

/// What a curve is named, its class, and its value.
type Curve = (&'static str, &'static str, fn(&Truncation) -> f64);

/// The curves of a chart, the truth last, so that it is above the others.
const CURVES: [Curve; 6] = [
    ("light", "light", |cut| cut.light),
    ("material", "material", |cut| cut.material),
    ("min of both", "least dashed", |cut| cut.min),
    ("bound", "bound", |cut| cut.bound),
    ("printed bound", "bound dotted", |cut| cut.printed),
    ("truth", "truth", |cut| cut.truth),
];

/// The energy that is kept against the degree F (`axis` 0) or P (1).
fn chart(page: &mut Markup, pair: &DegreePair, title: &str, name: &str, cuts: &[Truncation], axis: usize) {
    let degree = |cut: &Truncation| [cut.f, cut.p][axis];
    let series = |(name, class, value): &Curve| ChartSeries {
        name: (*name).to_owned(),
        class: (*class).to_owned(),
        points: cuts
            .iter()
            .map(|cut| ChartPoint { at: [degree(cut) as f64, value(cut)], title: String::new() })
            .collect(),
    };
    // The printed bound does not see what P cuts.
    let drawn = CURVES.iter().filter(|(name, ..)| axis == 0 || *name != "printed bound");
    let series: Vec<ChartSeries> = drawn.map(series).collect();
    let letter = ["F", "P"][axis];
    let mark = |what: &str, cut: &Truncation| ChartMark {
        at: degree(cut) as f64,
        name: format!("{what}: {letter} = {}", degree(cut)),
    };
    let marks: Vec<ChartMark> = [mark(own(pair), &pair.chosen)]
        .into_iter()
        .chain(pair.rule.as_ref().map(|rule| mark("rule", rule)))
        .collect();
    let limit = (pair.tolerance, &*format!("tolerance {}", percent(pair.tolerance)));
    let (x, y) = (Axis::degrees(cuts.last().map_or(0, degree)), Axis::kept());
    let size = ChartSize::SMALL;
    Chart { title, axis: name, x, y, series: &series, dots: false, limit, marks: &marks, size }.draw(page);
}

/// How the reflection has its degrees.
fn own(pair: &DegreePair) -> &'static str {
    if pair.for_light { "chosen" } else { "given" }
}

/// What the truncations at the chosen degrees and at those of the paper's rule lose.
fn table(page: &mut Markup, pair: &DegreePair) {
    page.line(
        "<div class=\"scroll\"><table><thead><tr><th>Share lost at</th><th class=\"number\">F, P</th><th \
         class=\"number\">Coefficients</th><th class=\"number\">Light</th><th class=\"number\">Material</th><th \
         class=\"number\">Min of both</th><th class=\"number\">Printed bound</th><th class=\"number\">Bound</th><th \
         class=\"number\">Truth</th></tr></thead><tbody>",
    );
    let mut row = |what: &str, cut: &Truncation| {
        page.put(format_args!(
            "<tr><th scope=\"row\">{what}</th><td class=\"number\">{}, {}</td><td class=\"number\">{}</td>",
            cut.f, cut.p, cut.coefficients
        ));
        for lost in [cut.light, cut.material, cut.min, cut.printed, cut.bound, cut.truth] {
            page.put(format_args!("<td class=\"number\">{}</td>", rounded(lost)));
        }
        page.line("</tr>");
    };
    row(&format!("the {} degrees", own(pair)), &pair.chosen);
    if let Some(rule) = &pair.rule {
        row("the paper's rule", rule);
    }
    page.line("</tbody></table></div>");
    let [f, p] = pair.highest;
    let tolerance = percent(pair.tolerance);
    match &pair.rule {
        Some(_) => page.put(format_args!(
            "<p class=\"small soft\">The paper's rule takes the least P, then the least F, with which the material alone \
             loses at most {tolerance}. The {} degrees are those of the reflection.</p>\n",
            own(pair)
        )),
        None => page.put(format_args!(
            "<p class=\"small soft\">The paper's rule finds no degrees: at F = {f} and P = {p} the material still loses \
             more than {tolerance}. The {} degrees are those of the reflection.</p>\n",
            own(pair)
        )),
    }
}

/// A share without digits that were not measured.
fn rounded(share: f64) -> String {
    if share < 1e-5 { "below 0.001 %".to_owned() } else { percent(share) }
}

/// The spheres of [RH02, fig. 7]: the reflection at some P, and brute force.
fn spheres(
    page: &mut Markup,
    report: &Report,
    pair: &DegreePair,
    pictures: &PairPictures,
) -> Result<(), Failure> {
    let (edge, amplify) = (report.settings.sphere, report.settings.amplify);
    let name = escape(&format!("{} under {}", pair.material, pair.environment));
    page.put(format_args!(
        "<p>The reflection at F = {}, cut at some P, with the share of the material's energy that P holds.</p>\n<div \
         class=\"scroll\"><div class=\"spheres\" style=\"--columns: {}\">\n<div></div>",
        pair.chosen.f,
        pair.spheres.len() + 1
    ));
    for sphere in &pair.spheres {
        page.put(format_args!(
            "<div class=\"head\">P = {}<span>{} kept</span><span>{:.2} stops</span></div>",
            sphere.p,
            percent(sphere.held),
            sphere.errors.p95
        ));
    }
    page.line("<div class=\"head\">Ground truth<span>brute force</span></div>");
    let image = |page: &mut Markup, pixels: &[[u8; 3]], what: &str| -> Result<(), Failure> {
        let source = data_uri(edge, edge, pixels)?;
        page.put(format_args!(
            "<img src=\"{source}\" width=\"{edge}\" height=\"{edge}\" alt=\"{name}: {what}\"/>"
        ));
        Ok(())
    };
    page.line("<div class=\"side\">reflection</div>");
    for (sphere, pixels) in pair.spheres.iter().zip(&pictures.cuts) {
        image(page, pixels, &format!("P = {}", sphere.p))?;
    }
    image(page, &pictures.truth, "brute force")?;
    for amplify in [1.0, amplify] {
        page.put(format_args!("\n<div class=\"side\">difference × {amplify}</div>"));
        for (sphere, pixels) in pair.spheres.iter().zip(&pictures.cuts) {
            let what = format!("difference at P = {}, times {amplify}", sphere.p);
            image(page, &difference(pixels, &pictures.truth, amplify), &what)?;
        }
        page.line("<div></div>");
    }
    page.line("</div></div>");
    Ok(())
}
