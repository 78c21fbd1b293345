//! Makes the page from figures and pictures: one HTML file that refers to no other file.
//!
//! The text is also well-formed XML, so that tests and tools can read it.

use containers::{escape_html as escape, recipe_element};
use engine::Failure;

use crate::map::{COMPONENT_EDGE, RESOLUTION};
use crate::picture::report::advice::word;
use crate::picture::report::cuts::TablePictures;
use crate::picture::report::figures::{Advice, Export, Limits, Method, PairFigures, Report};
use crate::picture::report::markup::Markup;
use crate::picture::report::picture::{data_uri, difference};
use crate::picture::report::rig_pictures::RigPictures;
use crate::picture::report::{rigs_section, sampling_section, tables_section, trade_section};
use crate::values::percent;
use crate::values::quantity::size;

/// 8-bit sRGB pictures of one sphere, all with the same exposure and tone curve.
pub(crate) struct Pictures {
    /// The picture by brute force.
    pub(crate) truth: Vec<[u8; 3]>,
    /// The pictures in the order of [`PairFigures::exports`]: what each shows, and the truth, where it was
    /// measured.
    pub(crate) exports: Vec<[Vec<[u8; 3]>; 2]>,
}

/// The pictures of all sections.
#[derive(Default)]
pub(crate) struct PagePictures {
    /// The pictures of maps, in the order of the report's pairs.
    pub(crate) maps: Vec<Pictures>,
    pub(crate) tables: TablePictures,
    /// The pictures of rigs, in the order of the report's rigs.
    pub(crate) rigs: Vec<RigPictures>,
}

/// The HTML of a report.
pub(crate) fn page(
    title: &str,
    report: &Report,
    pictures: &PagePictures,
    recipe: &str,
) -> Result<String, Failure> {
    let mut page = Markup::default();
    page.put(format_args!(
        r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"/><meta name="viewport" content="width=device-width, initial-scale=1"/><title>{title}</title>{recipe}<style>
{style}</style></head><body>
"#,
        title = escape(title),
        recipe = recipe_element(recipe),
        style = include_str!("style.css")
    ));
    if !report.pairs.is_empty() {
        maps(&mut page, title, report, &pictures.maps)?;
    } else {
        page.put(format_args!("<h1>{}</h1>\n", escape(title)));
    }
    if !report.tables.is_empty() {
        tables_section::section(&mut page, report, &pictures.tables)?;
    }
    if !report.sampling.is_empty() {
        sampling_section::section(&mut page, report);
    }
    if !report.rigs.is_empty() {
        rigs_section::section(&mut page, report, &pictures.rigs)?;
    }
    if !report.pairs.is_empty() {
        terms(&mut page, report);
    }
    page.line("</body></html>");
    Ok(page.0)
}

/// The section on the exports of maps.
fn maps(page: &mut Markup, title: &str, report: &Report, pictures: &[Pictures]) -> Result<(), Failure> {
    summary(page, title, report);
    page.line("<h2 id=\"pairs\">Each material under each environment</h2>");
    page.put(format_args!(
        "<p>Every sphere is seen from far away along +X, so it shows the highlight from every angle. The ground truth \
         adds up all light for each pixel (brute force). Differences are between the pictures as shown; the second \
         row amplifies them {} times. All pictures of an environment have the same exposure.</p>\n",
        report.settings.amplify
    ));
    for (index, (pair, pictures)) in report.pairs.iter().zip(pictures).enumerate() {
        card(page, report, index, pair, pictures)?;
    }
    sizes(page, report);
    Ok(())
}

/// The first screen: which export to use, for every pair.
fn summary(page: &mut Markup, title: &str, report: &Report) {
    let (settings, limits) = (&report.settings, &report.settings.limits);
    page.put(format_args!(
        "<h1>{}: which export to use</h1>\n<p class=\"soft\">For each material and environment, the error of each export \
         on a sphere, compared with the ground truth, and its size. An export is good if 95 % of the samples are within \
         {:.2} stops of the truth and 99 % within {:.2}; the report advises the smallest one that is good. Sizes are \
         those of the texels as RGBA half floats, with cube faces of {n} × {n}.</p>\n<h2 \
         class=\"first\">Summary</h2>\n<dl>",
        escape(title),
        limits.p95,
        limits.p99,
        n = settings.resolution
    ));
    for material in &report.materials {
        let (name, model) = (escape(&material.name), escape(&material.model));
        page.put(format_args!(
            "<dt>{name}<span class=\"size\">{model}, about the {}</span></dt><dd>{} {}</dd>\n",
            material.centre,
            badge(&material.advice),
            escape(&material.advice.why)
        ));
    }
    page.line("</dl>");
    page.line("<h2>Each pair</h2>");
    page.line(
        "<p>In each field: the stops within which 95 % and 99 % of the samples are; the share of negative samples; the \
         RMS error, which says little about rings and dark places; F, P and the size.</p>",
    );
    page.line("<div class=\"scroll\"><table><thead><tr><th>Material</th><th>Environment</th><th>Use</th>");
    for method in Method::ALL {
        page.put(format_args!("<th class=\"number\">{}</th>", method.title()));
    }
    page.line("<th>Why</th></tr></thead><tbody>");
    for (index, pair) in report.pairs.iter().enumerate() {
        page.put(format_args!(
            "<tr><th scope=\"row\"><a href=\"#pair-{index}\">{}</a></th><td>{}</td><td>{}</td>",
            escape(&pair.material),
            escape(&pair.environment),
            badge(&pair.advice),
        ));
        for method in Method::ALL {
            let Some(export) = pair.exports.iter().find(|export| export.method == method) else {
                page.put(format_args!("<td class=\"number\">–</td>"));
                continue;
            };
            let class = match (method == pair.advice.method, pair.advice.good) {
                (true, true) => " pick",
                (true, false) => " poor",
                (false, _) => "",
            };
            page.put(format_args!("<td class=\"number{class}\">"));
            figures(page, export, limits);
            page.put(format_args!("</td>"));
        }
        page.put(format_args!("<td class=\"why\">{}</td></tr>\n", escape(&pair.advice.why)));
    }
    page.line("</tbody></table></div>");
}

/// The name of the advised export, marked if it is not good.
fn badge(advice: &Advice) -> String {
    match advice.good {
        true => format!("<span class=\"badge\">{}</span>", advice.method.title()),
        false => format!(
            "<span class=\"badge poor\">{}</span><span class=\"size\">the best, but not good</span>",
            advice.method.title()
        ),
    }
}

/// The figures of an export, one below the other.
fn figures(page: &mut Markup, export: &Export, limits: &Limits) {
    let errors = &export.errors;
    page.put(format_args!(
        "{:.2} · {:.2}<span class=\"size\">{}</span>",
        errors.p95,
        errors.p99,
        word(errors, limits)
    ));
    if errors.negative > 0.0 {
        page.put(format_args!("<span class=\"size\">{} negative</span>", percent(errors.negative)));
    }
    page.put(format_args!("<span class=\"size\">RMS {}</span>", percent(errors.rms)));
    let degrees = match export.method {
        Method::Taps => export.texture.clone(),
        Method::ReflectionMap | Method::PartMaps => format!("F = {}", export.f),
        _ => format!("F = {}, P = {}", export.f, export.p),
    };
    page.put(format_args!("<span class=\"size\">{degrees} · {}</span>", size(export.bytes)));
}

/// One pair: spheres and differences.
fn card(
    page: &mut Markup,
    report: &Report,
    index: usize,
    pair: &PairFigures,
    pictures: &Pictures,
) -> Result<(), Failure> {
    let edge = report.settings.sphere;
    let name = escape(&format!("{} under {}", pair.material, pair.environment));
    let image = |page: &mut Markup, pixels: &[[u8; 3]], what: &str| -> Result<(), Failure> {
        let source = data_uri(edge, edge, pixels)?;
        page.put(format_args!(
            "<img src=\"{source}\" width=\"{edge}\" height=\"{edge}\" alt=\"{name}: {}\"/>",
            escape(what)
        ));
        Ok(())
    };
    page.put(format_args!(
        "<section class=\"pair\" id=\"pair-{index}\"><h3>{name}</h3>\n<p>{}</p>\n<div class=\"scroll\"><div \
         class=\"spheres\" style=\"--columns: {}\">\n<div></div><div class=\"head\">Ground truth<span>brute \
         force</span></div>",
        escape(&pair.advice.why),
        1 + pair.exports.len()
    ));
    for export in &pair.exports {
        let part = match export.one_of {
            1 => String::new(),
            pixels => format!("<span>at 1 of {pixels} pixels</span>"),
        };
        page.put(format_args!(
            "<div class=\"head\">{}<span>{:.2} · {:.2} stops</span><span>{}</span>{part}</div>",
            export.method.title(),
            export.errors.p95,
            export.errors.p99,
            size(export.bytes)
        ));
    }
    page.line("\n<div class=\"side\">picture</div>");
    image(page, &pictures.truth, "brute force")?;
    for (export, [picture, _]) in pair.exports.iter().zip(&pictures.exports) {
        image(page, picture, export.method.title())?;
    }
    for (label, amplify) in [("difference", 1.0), ("difference", report.settings.amplify)] {
        page.put(format_args!("\n<div class=\"side\">{label}<br/>× {amplify}</div><div></div>"));
        for (export, [picture, truth]) in pair.exports.iter().zip(&pictures.exports) {
            let what = format!("difference of {} from brute force, times {amplify}", export.method.title());
            image(page, &difference(picture, truth, amplify), &what)?;
        }
    }
    page.line("\n</div></div>");
    let degrees = if pair.for_light { "chosen for this light" } else { "given" };
    let lamps = match pair.lamps {
        0 => "no lamps beside the coefficients".to_owned(),
        1 => "1 lamp beside the coefficients".to_owned(),
        lamps => format!("{lamps} lamps beside the coefficients"),
    };
    page.put(format_args!(
        "<p class=\"small soft\">F = {} and P = {}, {degrees}; {lamps}.</p>\n",
        pair.f, pair.p,
    ));
    if let Some(trade) = &pair.trade {
        trade_section::section(page, trade);
    }
    page.line("</section>");
    Ok(())
}

/// The textures and sizes of each export of a pair.
fn sizes(page: &mut Markup, report: &Report) {
    page.line("<h2 id=\"sizes\">File sizes</h2>");
    page.put(format_args!(
        "<p>The sizes are for texels of RGBA half floats (8 bytes), uncompressed and without mip levels, with cube faces \
         of {n} × {n}. The size of an SHRM grows with (P + 1)², or with P + 1 if nothing changes around the central \
         direction; the sizes of the others do not depend on P.</p>\n",
        n = report.settings.resolution
    ));
    page.line("<div class=\"scroll\"><table><thead><tr><th>Material</th><th>Environment</th>");
    for method in Method::ALL {
        page.put(format_args!(
            "<th>{}<span class=\"size\">{}</span></th>",
            method.title(),
            escape(method.kind())
        ));
    }
    page.line("</tr></thead><tbody>");
    for pair in &report.pairs {
        page.put(format_args!(
            "<tr><th scope=\"row\">{}</th><td>{}</td>",
            escape(&pair.material),
            escape(&pair.environment)
        ));
        for method in Method::ALL {
            match pair.exports.iter().find(|export| export.method == method) {
                Some(export) => page.put(format_args!(
                    "<td>{}<span class=\"size\">{}</span></td>",
                    size(export.bytes),
                    escape(&export.texture)
                )),
                None => page.put(format_args!("<td>–</td>")),
            }
        }
        page.line("</tr>");
    }
    page.line("</tbody></table></div>");
}

/// Explains the terms that a reader may not know.
fn terms(page: &mut Markup, report: &Report) {
    page.line(
        r#"<h2 id="terms">Terms</h2>
<dl>
<dt>Compact map</dt><dd>The light of the environment, blurred by many widths, and a table of a few look-ups, or taps, that make the reflection of a material from it. One such map serves every material. Its table has the fewest look-ups with which 95 % of the samples are within 0.1 stops and 99 % within 0.25, or the best. The strongest lights are beside it, and the renderer adds them by the material's own BRDF.</dd>
<dt>Plain map</dt><dd>One reflection map, looked up by one direction. For a material that changes with the view it holds the mean over all views.</dd>
<dt>Plain map of each part</dt><dd>Two such maps, which a renderer adds: that of the matte part, looked up by the normal, and that of the highlight, looked up by the reflection vector.</dd>
<dt>Kautz-McCool</dt><dd>A 3D texture, looked up by a direction and by the angle between it and the view. It does not hold what changes around the direction.</dd>
<dt>Cabral</dt><dd>Twelve maps for the views at the vertices of an icosahedron, blended between them.</dd>
<dt>SHRM</dt><dd>A spherical harmonic reflection map: each texel holds (P + 1)² coefficients, which give its colour for any view. It holds suns and lamps too, which takes long to fit: the report does so for some pixels and measures these alone.</dd>
<dt>SHRM with lights</dt><dd>The same without suns and lamps, which the file lists as lights (lamps = "separate"). The renderer adds them by the material's own BRDF.</dd>
<dt>F and P</dt><dd>The degrees of the coefficients: F is the detail across the map, P the change with the view.</dd>
<dt>Error in stops</dt><dd>|log2((value + e) / (truth + e))| for each pixel and channel, a sample; e is 1 % of the environment's mean radiance, below which black is black. One stop is a factor of two; 0.1 stops are hard to see. A negative value counts as 0.</dd>
<dt>Negative</dt><dd>The share of samples below -e / 10, which a renderer shows as black. They come from rings around highlights where a series is cut.</dd>
<dt>RMS</dt><dd>The root of the mean squared difference of radiance, divided by the root of the mean squared radiance of the truth. The brightest pixels decide it: rings and dark places hardly count.</dd>
<dt>Ground truth</dt><dd>The sum over all light of the environment for each pixel, by the material's own BRDF, to about 0.01 stops. Where the reflection is smooth, blocks of texels are added as one. A sphere of brushed metal is brushed upward; of the exports only the compact map knows that direction.</dd>"#,
    );
    if report.pairs.iter().any(|pair| pair.trade.is_some()) {
        page.put(format_args!(
            r#"
<dt>Error against size and work</dt><dd>The same error of techniques of every degree: P of an SHRM, K components, J taps. {lights} The dashed line is at {limit} stops. The advice is the cheapest number of taps and lights, at 20 operations for a tap and 35 for a light, that is within {limit} stops at 95 % and {limit_99} at 99 %, or the best. An SHRM with its lamps in it is measured at fewer pixels.</dd>
<dt>Bytes</dt><dd>Half floats with cube faces of {n} × {n}; components {components} × {components}; for taps 4 bytes a texel with faces of {taps} × {taps}. Those of taps and of the split sum are once for an environment, and a material adds its table of taps, 1 to 9 kB, which they hold; all others are once for each pair.</dd>
<dt>Fetches</dt><dd>Bilinear look-ups of a pixel, one for each layer or level: 1 for a plain map; 2 for two levels of the split sum, or two slices of Kautz-McCool, and 3 for three of Cabral's views; (P + 1)² for an SHRM, or P + 1 if nothing changes around the central direction; K and K / 4 for components and their functions of the view; 2 for each tap, also about the normal. Small tables that stay in the cache (of taps, and of the split sum's albedo) and the work of lights are not counted. An SHRM's frames spin, so that a shader filters it itself, by four fetches for each one here.</dd>
<dt>Split sum</dt><dd>What engines do: the light, lamps included, as the lobe that is seen head on blurs it, times the directional albedo toward the view.</dd>
<dt>Components</dt><dd>Principal components of the material as functions of the view (form = "components" of export-shrm), each with an image of the light.</dd>"#,
            lights = "Lights beside a map are in the error and not in the fetches.",
            limit = trade_section::LIMITS.p95,
            limit_99 = trade_section::LIMITS.p99,
            n = report.settings.resolution,
            components = COMPONENT_EDGE,
            taps = RESOLUTION,
        ));
    }
    page.line("\n</dl>");
}
