//! Makes the page from figures and pictures: one HTML file that refers to no other file.
//!
//! The text is also well-formed XML, so that tests and tools can read it.

use std::fmt::Write as _;

use containers::{escape_html as escape, recipe_element};
use engine::Failure;

use crate::quantity::size;
use crate::report::figures::{Accuracy, MaterialFigures, Method, PairFigures, Report};
use crate::report::picture::{data_uri, difference};
use crate::report::plot::{Curve, Curves, Row, dots};
use crate::sheet::percent;

/// 8-bit sRGB pictures of one sphere, all with the same exposure and tone curve.
pub(crate) struct Pictures {
    /// By brute force.
    pub(crate) truth: Vec<[u8; 3]>,
    /// In the order of [`Method::ALL`].
    pub(crate) exports: Vec<Vec<[u8; 3]>>,
    /// In the order of [`PairFigures::per_p`].
    pub(crate) per_p: Vec<Vec<[u8; 3]>>,
}

/// The HTML of a report; `pictures` in the order of its pairs.
pub(crate) fn page(
    title: &str,
    report: &Report,
    pictures: &[Pictures],
    recipe: &str,
) -> Result<String, Failure> {
    let mut page = Page(String::new());
    page.put(format_args!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"/><meta name="viewport" content="width=device-width, initial-scale=1"/><title>{title}</title>{recipe}<style>
{style}</style></head><body>
"#,
        title = escape(title),
        recipe = recipe_element(recipe),
        style = include_str!("style.css")
    ));
    summary(&mut page, title, report);
    materials(&mut page, report);
    page.line("<h2 id=\"pairs\">Each material under each environment</h2>");
    page.put(format_args!(
        "<p>Every sphere is seen from far away along +X, so it shows the highlight from every angle. The ground truth \
         adds up all light for each pixel (brute force). Differences are between the pictures as shown; the second \
         row amplifies them {} times. All pictures of an environment have the same exposure.</p>\n",
        report.settings.amplify
    ));
    for (index, (pair, pictures)) in report.pairs.iter().zip(pictures).enumerate() {
        if let Some(material) = report.materials.iter().find(|material| material.name == pair.material) {
            card(&mut page, report, index, pair, material, pictures)?;
        }
    }
    sizes(&mut page, report);
    terms(&mut page, report);
    page.line("</body></html>");
    Ok(page.0)
}

/// Markup under construction.
struct Page(String);

impl Page {
    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.0.write_fmt(text);
    }

    fn line(&mut self, text: &str) {
        self.0.push_str(text);
        self.0.push('\n');
    }
}

/// The first screen: which export to use, for every pair.
fn summary(page: &mut Page, title: &str, report: &Report) {
    let settings = &report.settings;
    page.put(format_args!(
        "<h1>{}: which export to use</h1>\n<p class=\"soft\">For each material and environment, the error of each export \
         on a sphere, compared with the ground truth, and its size. An error of at most {} is good enough; the report \
         advises the smallest export that is good enough. Errors are RMS differences as a share of the RMS radiance; \
         sizes are those of the texels as RGBA half floats, with cube faces of {n} × {n}.</p>\n<h2 class=\"first\">Summary</h2>\n<dl>",
        escape(title),
        percent(settings.accept),
        n = settings.resolution
    ));
    for material in &report.materials {
        page.put(format_args!("<dt>{}</dt><dd>{}</dd>\n", escape(&material.name), escape(&material.verdict)));
    }
    page.line("</dl>");
    page.line("<h2>Each pair</h2>");
    page.line("<div class=\"scroll\"><table><thead><tr><th>Material</th><th>Environment</th><th>Use</th>");
    for method in Method::ALL {
        page.put(format_args!("<th class=\"number\">{}</th>", method.title()));
    }
    page.line("<th>Why</th></tr></thead><tbody>");
    for (index, pair) in report.pairs.iter().enumerate() {
        let class = if pair.advice.good { "badge" } else { "badge poor" };
        page.put(format_args!(
            "<tr><th scope=\"row\"><a href=\"#pair-{index}\">{material}</a></th><td>{environment}</td><td><span \
             class=\"{class}\">{use}</span>{poor}</td>",
            material = escape(&pair.material),
            environment = escape(&pair.environment),
            use = pair.advice.method.title(),
            poor = if pair.advice.good { "" } else { "<span class=\"size\">closest, not good enough</span>" },
        ));
        for export in &pair.exports {
            let class = match (export.method == pair.advice.method, pair.advice.good) {
                (true, true) => " pick",
                (true, false) => " poor",
                (false, _) => "",
            };
            page.put(format_args!(
                "<td class=\"number{class}\">{}<span class=\"size\">{}</span></td>",
                percent(export.rms),
                size(export.bytes)
            ));
        }
        page.put(format_args!("<td class=\"why\">{}</td></tr>\n", escape(&pair.advice.why)));
    }
    page.line("</tbody></table></div>");
}

/// The degrees that each material needs (figure 8 of the paper).
fn materials(page: &mut Page, report: &Report) {
    page.line("<h2 id=\"materials\">What each material needs</h2>");
    page.line(
        "<p>Two degrees determine what a map can hold. F is the detail across the map: a sharper highlight needs a \
         larger F. P is the change with the view: P = 0 holds none.</p>",
    );
    page.put(format_args!(
        "<p>An error is the square root of an energy. A <code>tolerance</code> of 0.03 loses 3 % of the material's energy, \
         which is an error of {} under one small lamp, and less under soft light. An error of at most {} under any \
         light takes {} of the energy; the degrees suggested above are those for the light of each pair.</p>\n",
        percent(0.03_f64.sqrt()),
        percent(report.settings.accept),
        percent(1.0 - report.settings.accept.powi(2))
    ));
    page.line(
        "<div class=\"scroll\"><table><thead><tr><th>Material</th><th>Model</th><th class=\"number\">F</th><th \
         class=\"number\">P</th><th class=\"number\">Energy held</th><th>Why these degrees</th></tr></thead><tbody>",
    );
    for material in &report.materials {
        page.put(format_args!(
            "<tr><th scope=\"row\">{}</th><td>{}<span class=\"size\">about the {}</span></td><td \
             class=\"number\">{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>\n",
            escape(&material.name),
            escape(&material.model),
            material.centre,
            material.f,
            material.p,
            percent(material.captured),
            escape(&material.chosen)
        ));
    }
    page.line("</tbody></table></div>");
    let rows: Vec<_> = report
        .materials
        .iter()
        .map(|m| Row { name: &m.name, shares: &m.captured_per_p, chosen: m.p })
        .collect();
    let description = "The share of each material's energy that each degree in the view holds; the JSON file has \
                       the numbers";
    let svg = dots(&rows, description).replacen("<svg ", "<svg class=\"wide\" ", 1);
    let f = report.materials.iter().map(|m| m.high_f).min().unwrap_or_default();
    page.put(format_args!(
        "<h3>Energy held for each P</h3>\n<figure>{svg}<figcaption>The share of a material's energy that P = 0, 1, 2 \
         and more hold, from left to right: faint diamonds for low P, a circle for the highest. F = {f}, or that of the \
         exports if it is higher. A ring marks the P of the exports. If all marks coincide, the highlight does not \
         change with the view.</figcaption></figure>\n",
    ));
}

/// One pair: spheres, differences, accuracy against F, spheres against P.
fn card(
    page: &mut Page,
    report: &Report,
    index: usize,
    pair: &PairFigures,
    material: &MaterialFigures,
    pictures: &Pictures,
) -> Result<(), Failure> {
    let edge = report.settings.sphere;
    let name = escape(&format!("{} under {}", pair.material, pair.environment));
    let image = |page: &mut Page, pixels: &[[u8; 3]], what: &str| -> Result<(), Failure> {
        let source = data_uri(edge, edge, pixels)?;
        page.put(format_args!(
            "<img src=\"{source}\" width=\"{edge}\" height=\"{edge}\" alt=\"{name}: {}\"/>",
            escape(what)
        ));
        Ok(())
    };
    page.put(format_args!(
        "<section class=\"pair\" id=\"pair-{index}\"><h3>{name}</h3>\n<p>{}</p>\n<div class=\"scroll\"><div \
         class=\"spheres\">\n<div></div><div class=\"head\">Ground truth<span>brute force</span></div>",
        escape(&pair.advice.why)
    ));
    for export in &pair.exports {
        page.put(format_args!(
            "<div class=\"head\">{}<span>{} · {}</span></div>",
            export.method.title(),
            percent(export.rms),
            size(export.bytes)
        ));
    }
    page.line("\n<div class=\"side\">picture</div>");
    image(page, &pictures.truth, "brute force")?;
    for (export, picture) in pair.exports.iter().zip(&pictures.exports) {
        image(page, picture, export.method.title())?;
    }
    for (label, amplify) in [("difference", 1.0), ("difference", report.settings.amplify)] {
        page.put(format_args!("\n<div class=\"side\">{label}<br/>× {amplify}</div><div></div>"));
        for (export, picture) in pair.exports.iter().zip(&pictures.exports) {
            let what = format!("difference of {} from brute force, times {amplify}", export.method.title());
            image(page, &difference(picture, &pictures.truth, amplify), &what)?;
        }
    }
    page.line("\n</div></div>");
    page.put(format_args!(
        "<p class=\"small soft\">The SHRM's error: {degrees} because of its degrees, F = {} and P = {}; {texels} because of its \
         {n} × {n} texels.</p>\n",
        material.f,
        material.p,
        degrees = percent(pair.shrm.degrees),
        texels = percent(pair.shrm.texels),
        n = report.settings.resolution
    ));
    if pair.per_p.len() > 1 {
        let f = material.high_f;
        // A row holds five; if there are more, the highest are shown.
        let from = pair.per_p.len().saturating_sub(5);
        let (per_p, spheres) = (&pair.per_p[from..], pictures.per_p.get(from..).unwrap_or_default());
        page.put(format_args!(
            "<h4>SHRM with higher and lower degrees in the view, F = {f}</h4>\n<div class=\"scroll\"><div \
             class=\"spheres\">\n<div></div>"
        ));
        for per_p in per_p {
            page.put(format_args!(
                "<div class=\"head\">P = {}<span>error {}</span><span>energy {}</span></div>",
                per_p.p,
                percent(per_p.rms),
                percent(per_p.captured)
            ));
        }
        let fill = |page: &mut Page| {
            for _ in per_p.len()..5 {
                page.line("<div></div>");
            }
        };
        fill(page);
        page.line("\n<div class=\"side\">picture</div>");
        for (per_p, picture) in per_p.iter().zip(spheres) {
            image(page, picture, &format!("SHRM with P = {}", per_p.p))?;
        }
        fill(page);
        page.line("\n<div class=\"side\">difference<br/>× 1</div>");
        for (per_p, picture) in per_p.iter().zip(spheres) {
            let what = format!("difference of the SHRM with P = {} from brute force", per_p.p);
            image(page, &difference(picture, &pictures.truth, 1.0), &what)?;
        }
        fill(page);
        page.line("\n</div></div>");
    }
    if pair.per_p.len() <= 1 {
        page.line("<p class=\"soft\">Nothing changes with the view, so P = 0 holds everything and a higher P would not help.</p>");
    }
    page.line("<h4>Accuracy against the degrees</h4>");
    accuracy(page, report, pair, material);
    page.line("</section>");
    Ok(())
}

/// Accuracy against F and against P with the three estimates (figure 6 of the paper).
fn accuracy(page: &mut Page, report: &Report, pair: &PairFigures, material: &MaterialFigures) {
    let plot = |accuracy: &Accuracy, letter: &str, other: String, at: usize| {
        let curve = |name, class, values| Curve { name, class, values };
        let curves = vec![
            curve("measured", "truth", accuracy.truth.as_slice()),
            curve("BRDF", "by-brdf", &accuracy.brdf),
            curve("better of both", "by-better", &accuracy.better),
            curve("guaranteed", "by-bound", &accuracy.bound),
        ];
        let what = if letter == "F" { "detail across the map" } else { "change with the view" };
        Curves {
            description: &format!("{} under {}: accuracy against {letter}", pair.material, pair.environment),
            x_label: &format!("{letter}, the degree for {what}"),
            y_label: &format!("accuracy in %, {other}"),
            least: 0.0,
            curves,
            mark: Some((at, format!("{letter} = {at}"))),
        }
        .svg()
    };
    let against_f = plot(&pair.accuracy, "F", format!("P = {}", material.p), material.f);
    page.put(format_args!("<div class=\"sides\"><figure>{against_f}</figure>"));
    if pair.per_p.len() > 1 {
        let against_p = plot(&pair.accuracy_per_p, "P", format!("F = {}", material.f), material.p);
        page.put(format_args!("<figure>{against_p}</figure>"));
    }
    page.line("</div>");
    let at = |values: &[f64]| values.get(material.f).or(values.last()).copied().map_or("–".into(), percent);
    page.put(format_args!(
        "<p class=\"small soft\">Accuracy is 1 minus the share of the reflected energy that is lost by truncating at this degree. The \
         thick line is measured against the light field at F = {}, P = {}. The others are estimates without it: from \
         the energy that the BRDF holds, from the better of BRDF and lighting, and from a guaranteed bound. At \
         F = {}, P = {}: measured {}, BRDF {}, better of both {}, guaranteed {}. Rendered and measured under the \
         environment at {} × {} pixels, with at most {} rows.</p>\n",
        pair.accuracy.truth.len().saturating_sub(1),
        pair.accuracy_per_p.truth.len().saturating_sub(1),
        material.f,
        material.p,
        at(&pair.accuracy.truth),
        at(&pair.accuracy.brdf),
        at(&pair.accuracy.better),
        at(&pair.accuracy.bound),
        pair.rendered[0],
        pair.rendered[1],
        report.settings.reference_rows
    ));
}

/// The textures and sizes of each export of a material.
fn sizes(page: &mut Page, report: &Report) {
    page.line("<h2 id=\"sizes\">File sizes</h2>");
    page.put(format_args!(
        "<p>The sizes are for texels of RGBA half floats (8 bytes), uncompressed and without mip levels, with cube faces \
         of {n} × {n}. The size of an SHRM grows with (P + 1)², or with P + 1 if nothing changes around the central \
         direction; the sizes of the others do not depend on the material.</p>\n",
        n = report.settings.resolution
    ));
    page.line("<div class=\"scroll\"><table><thead><tr><th>Material</th>");
    for method in Method::ALL {
        page.put(format_args!("<th>{}<span class=\"size\">{}</span></th>", method.title(), method.kind()));
    }
    page.line("</tr></thead><tbody>");
    for material in &report.materials {
        let Some(pair) = report.pairs.iter().find(|pair| pair.material == material.name) else { continue };
        page.put(format_args!("<tr><th scope=\"row\">{}</th>", escape(&material.name)));
        for export in &pair.exports {
            page.put(format_args!(
                "<td>{}<span class=\"size\">{}</span></td>",
                size(export.bytes),
                escape(&export.texture)
            ));
        }
        page.line("</tr>");
    }
    page.line("</tbody></table></div>");
}

/// Explains the terms that a reader may not know.
fn terms(page: &mut Page, report: &Report) {
    page.put(format_args!(
        r#"<h2 id="terms">Terms</h2>
<dl>
<dt>Plain map</dt><dd>One reflection map, looked up by one direction. For a material that changes with the view it holds the mean over all views.</dd>
<dt>Kautz-McCool</dt><dd>A 3D texture, looked up by a direction and by the angle between it and the view. It does not hold what changes around the direction.</dd>
<dt>Cabral</dt><dd>Twelve maps for the views at the vertices of an icosahedron, blended between them. They hold the same as the SHRM; blending blurs the change with the view, which sometimes hides the errors of too low degrees.</dd>
<dt>SHRM</dt><dd>A spherical harmonic reflection map: each texel holds (P + 1)² coefficients, which give its colour for any view.</dd>
<dt>Error</dt><dd>The root of the mean squared difference of radiance over the sphere's pixels and channels, divided by the root of the mean squared radiance of the truth. 1 % is hard to see, 10 % is obvious.</dd>
<dt>Ground truth</dt><dd>The sum over all pixels of the environment, scaled to at most {} rows for this report. Every export is made from that same environment, without a turn.</dd>
<dt>Energy held</dt><dd>The share of the energy of rho_hat, the BRDF with its cosine, that its coefficients up to F and P hold.</dd>
</dl>
"#,
        report.settings.reference_rows
    ));
}
