//! Makes the page from figures and pictures: one HTML file that refers to no other file.
//!
//! The text is also well-formed XML, so that tests and tools can read it.

use containers::{escape_html as escape, recipe_element};
use engine::Failure;

use crate::map::{COMPONENT_EDGE, RESOLUTION};
use crate::picture::data_uri;
use crate::picture::report::advice::word;
use crate::picture::report::cuts::TablePictures;
use crate::picture::report::degree_pictures::DegreePictures;
use crate::picture::report::figures::{Method, PairFigures, Report};
use crate::picture::report::markup::Markup;
use crate::picture::report::picture::difference;
use crate::picture::report::probes_section::ProbePicture;
use crate::picture::report::rig_pictures::RigPictures;
use crate::picture::report::{
    degrees_section, probes_section, rigs_section, sampling_section, summary_section, tables_section,
    trade_section,
};
use crate::values::percent;

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
pub(crate) struct PagePictures<'a> {
    /// The pictures of maps, in the order of the report's pairs.
    pub(crate) maps: Vec<Pictures>,
    pub(crate) tables: TablePictures,
    /// The pictures of rigs, in the order of the report's rigs.
    pub(crate) rigs: Vec<RigPictures>,
    pub(crate) degrees: DegreePictures,
    /// The picture of the probes, if there are any.
    pub(crate) probes: Option<ProbePicture<'a>>,
}

/// The HTML of a report.
pub(crate) fn page(
    title: &str,
    report: &Report,
    pictures: &PagePictures<'_>,
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
    if !report.degrees.pairs.is_empty() {
        degrees_section::section(&mut page, report, &pictures.degrees)?;
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
    if let (Some(figures), Some(picture)) = (&report.probes, &pictures.probes) {
        let is_first = report.pairs.is_empty() && report.tables.is_empty() && report.rigs.is_empty();
        probes_section::section(&mut page, is_first, figures, picture);
    }
    if !report.pairs.is_empty() {
        terms(&mut page, report);
    }
    page.line("</body></html>");
    Ok(page.0)
}

/// The section on the exports of maps.
fn maps(page: &mut Markup, title: &str, report: &Report, pictures: &[Pictures]) -> Result<(), Failure> {
    summary_section::section(page, title, report);
    page.line("<h2 id=\"pairs\">Pictures of each pair</h2>");
    page.put(format_args!(
        "<p>Every sphere is seen from far away along +X, so it shows the highlight from every angle. The ground truth \
         adds up all light for each pixel (brute force). Below each picture is its difference from the truth as shown, \
         and the same times {}. Small spheres were measured at fewer pixels. All pictures of an environment have the \
         same exposure.</p>\n",
        report.settings.amplify
    ));
    for (index, (pair, pictures)) in report.pairs.iter().zip(pictures).enumerate() {
        card(page, report, index, pair, pictures)?;
    }
    Ok(())
}

/// One pair: its advice, spheres and differences, and all figures.
fn card(
    page: &mut Markup,
    report: &Report,
    index: usize,
    pair: &PairFigures,
    pictures: &Pictures,
) -> Result<(), Failure> {
    let edge = report.settings.sphere;
    let name = escape(&format!("{} under {}", pair.material, pair.environment));
    // A picture of fewer pixels is smaller, so that it is as sharp as the others.
    let finest = pair.exports.iter().map(|export| export.one_of).min().unwrap_or(1);
    let image = |page: &mut Markup, pixels: &[[u8; 3]], one_of: usize, what: &str| -> Result<(), Failure> {
        let source = data_uri(edge, edge, pixels)?;
        let width = 100.0 * (finest as f64 / one_of as f64).sqrt();
        page.put(format_args!(
            "<img src=\"{source}\" style=\"width: {width:.0}%\" alt=\"{name}: {}\"/>",
            escape(what)
        ));
        Ok(())
    };
    page.put(format_args!(
        "<section class=\"pair\" id=\"pair-{index}\"><h3>{name}</h3>\n<p>{}</p>\n<div class=\"exports\">\n\
         <figure><figcaption>Ground truth<span>brute force</span></figcaption>",
        escape(&pair.advice.why)
    ));
    image(page, &pictures.truth, finest, "brute force")?;
    page.line("</figure>");
    for (export, [picture, truth]) in pair.exports.iter().zip(&pictures.exports) {
        let title = export.method.title();
        let class = summary_section::mark(pair, export.method);
        page.put(format_args!(
            "<figure class=\"{class}\"><figcaption>{title}<span>{:.2} stops</span><span>{}</span></figcaption>",
            export.errors.p95,
            export.size_text()
        ));
        image(page, picture, export.one_of, title)?;
        for amplify in [1.0, report.settings.amplify] {
            let what = format!("difference of {title} from brute force, times {amplify}");
            image(page, &difference(picture, truth, amplify), export.one_of, &what)?;
        }
        page.line("</figure>");
    }
    page.line("</div>");
    let degrees = if pair.for_light { "chosen for this light" } else { "given" };
    let lamps = match pair.lamps {
        0 => "no lamps are kept as lights".to_owned(),
        1 => "1 lamp is kept as a light".to_owned(),
        lamps => format!("{lamps} lamps are kept as lights"),
    };
    page.put(format_args!(
        "<p class=\"small soft\">F = {} and P = {}, {degrees}; {lamps}.</p>\n",
        pair.f, pair.p,
    ));
    figures(page, report, pair);
    if let Some(trade) = &pair.trade {
        trade_section::section(page, trade);
    }
    page.line("</section>");
    Ok(())
}

/// All figures of the exports of a pair, folded.
fn figures(page: &mut Markup, report: &Report, pair: &PairFigures) {
    page.line(
        "<details><summary>All figures of these exports</summary><div class=\"scroll\"><table><thead><tr>\
         <th>Export</th><th class=\"number\">95 %</th><th class=\"number\">99 %</th><th></th><th \
         class=\"number\">Negative</th><th class=\"number\">RMS</th><th class=\"number\">Size</th><th>Textures</th><th \
         class=\"number\">F, P</th><th>Pixels measured</th></tr></thead><tbody>",
    );
    for export in &pair.exports {
        let errors = &export.errors;
        let degrees = match export.method {
            Method::Taps => "–".to_owned(),
            Method::ReflectionMap | Method::PartMaps => export.f.to_string(),
            _ => format!("{}, {}", export.f, export.p),
        };
        let pixels = if export.one_of == 1 { "all".to_owned() } else { format!("1 of {}", export.one_of) };
        page.put(format_args!(
            "<tr><th scope=\"row\">{}<span class=\"size\">{}</span></th><td class=\"number\">{:.2}</td><td \
             class=\"number\">{:.2}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td \
             class=\"number\">{}</td><td>{}</td><td class=\"number\">{degrees}</td><td>{pixels}</td></tr>\n",
            export.method.title(),
            escape(export.method.kind()),
            errors.p95,
            errors.p99,
            word(errors, &report.settings.limits),
            percent(errors.negative),
            percent(errors.rms),
            export.size_text(),
            escape(&export.texture)
        ));
    }
    page.line("</tbody></table></div></details>");
}

/// Explains the terms that a reader may not know.
fn terms(page: &mut Markup, report: &Report) {
    page.line(
        r#"<h2 id="terms">Terms</h2>
<dl class="terms">
<dt>Compact map</dt><dd>The light of the environment, blurred by many widths, and a table of a few look-ups, or taps, that make the reflection of a material from it. One such map serves every material. Its table has the fewest look-ups with which 95 % of the samples are within 0.1 stops and 99 % within 0.25, or the best. The strongest lights are beside it, and the renderer adds them by the material's own BRDF.</dd>
<dt>Plain map</dt><dd>One reflection map, looked up by one direction. For a material that changes with the view it holds the mean over all views.</dd>
<dt>Plain map of each part</dt><dd>Two such maps, which a renderer adds: that of the matte part, looked up by the normal, and that of the highlight, looked up by the reflection vector.</dd>
<dt>Kautz-McCool</dt><dd>A 3D texture, looked up by a direction and by the angle between it and the view. It does not hold what changes around the direction. Of a material with a matte base under a highlight, this and the next two are maps of each part, which a renderer adds.</dd>
<dt>Cabral</dt><dd>Twelve maps for the views at the vertices of an icosahedron, blended between them.</dd>
<dt>SHRM</dt><dd>A spherical harmonic reflection map: each texel holds (P + 1)² coefficients, which give its colour for any view. It holds suns and lamps too, which takes long to fit: the report does so for some pixels and measures these alone.</dd>
<dt>SHRM with lights</dt><dd>The same without suns and lamps, which the file lists as lights (lamps = "separate"). The renderer adds them by the material's own BRDF.</dd>
<dt>F and P</dt><dd>The degrees of the coefficients: F is the detail across the map, P the change with the view. A file of an SHRM has the P at which it is near enough, which may be less than that of the reflection.</dd>
<dt>Size</dt><dd>The bytes of the files that the pipeline writes, where the stage is connected to the report. A size with ~ is that of the texels as RGBA half floats, uncompressed and without levels, and of the lights. That of an SHRM grows with (P + 1)², or with P + 1 if nothing changes around the central direction. The texels of a compact map have four bytes.</dd>
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
<dt>Fetches</dt><dd>Bilinear look-ups of a pixel, one for each layer or level: 1 for a plain map; 2 for two levels of the split sum, or two slices of Kautz-McCool, and 3 for three of Cabral's views, twice that for a map of each part; (P + 1)² for an SHRM, or P + 1 if nothing changes around the central direction; K and K / 4 for components and their functions of the view; 2 for each tap, also about the normal. Small tables that stay in the cache (of taps, and of the split sum's albedo) and the work of lights are not counted. An SHRM's frames spin, so that a shader filters it itself, by four fetches for each one here.</dd>
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
