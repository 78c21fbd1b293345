//! The section of a report's page on BRDF tables.

use containers::escape_html as escape;
use engine::Failure;
use sh::Window;

use crate::picture::data_uri;
use crate::picture::report::cuts::{MAX_CUT, PICTURE, SHOWN, TablePictures};
use crate::picture::report::figures::{Cut, Report, TablePair};
use crate::picture::report::markup::Markup;
use crate::picture::report::picture::difference;
use crate::values::percent;

/// The section: advice, the spheres under each environment, and the energy of each degree.
pub(crate) fn section(text: &mut Markup, report: &Report, pictures: &TablePictures) -> Result<(), Failure> {
    let error = percent(report.settings.table_error);
    text.put(format_args!(
            "<h2 id=\"tables\"{}>BRDF tables: which degree a material needs</h2>\n<p>A sphere, brushed along +Z, is shaded \
             with a table of <code>tabulate-brdf</code>: light and table are cut at a degree F and have n = (F + 1)² \
             coefficients. A degree is good if the relative RMS error of the sphere, compared with brute force, is at \
             most {error}. Where none is, the material shows lamps that are sharper than F = {MAX_CUT}.</p>\n<div \
             class=\"scroll\"><table><thead><tr><th>Material</th><th>Use under all</th>",
            if report.pairs.is_empty() && report.degrees.pairs.is_empty() { " class=\"first\"" } else { "" }
        ),
    );
    let environments: Vec<&str> =
        report.tables.first().map_or(Vec::new(), |first| first.pairs.iter().map(name).collect());
    for environment in &environments {
        text.put(format_args!("<th>{}</th>", escape(environment)));
    }
    text.line("</tr></thead><tbody>");
    for table in &report.tables {
        text.put(format_args!(
            "<tr><th scope=\"row\">{}</th><td>{}</td>",
            escape(&table.material),
            badge(table.advised)
        ));
        for pair in &table.pairs {
            text.put(format_args!("<td>{}</td>", advice(pair)));
        }
        text.line("</tr>");
    }
    text.line("</tbody></table></div>");
    for index in 0..environments.len() {
        grid(text, report, pictures, index)?;
    }
    energies(text, report);
    Ok(())
}

fn name(pair: &TablePair) -> &str {
    &pair.environment
}

fn badge(advised: Option<usize>) -> String {
    match advised {
        Some(degree) => {
            format!(
                "<span class=\"badge\">F = {degree}</span><span class=\"size\">n = {}</span>",
                (degree + 1).pow(2)
            )
        }
        None => "<span class=\"badge poor\">none</span>".to_owned(),
    }
}

/// Says which degree is good under an environment, or what the highest reaches.
fn advice(pair: &TablePair) -> String {
    match pair.advised {
        Some(degree) => {
            let error = pair.cuts.get(degree).map_or(0.0, |cut| cut.errors.rms);
            format!("F = {degree}<span class=\"size\">RMS {}</span>", percent(error))
        }
        None => {
            let least = pair.cuts.iter().min_by(|a, b| a.errors.rms.total_cmp(&b.errors.rms));
            let cut = least.map_or(String::new(), |cut| {
                format!("RMS {} at F = {}, the least", percent(cut.errors.rms), cut.degree)
            });
            format!("none<span class=\"size\">{cut}</span>")
        }
    }
}

/// The figures of one of [`SHOWN`].
fn shown(pair: &TablePair, (degree, window): (usize, Window)) -> Option<&Cut> {
    pair.cuts.iter().find(|cut| cut.degree == degree && cut.windowed == (window != Window::None))
}

/// The spheres of all materials under an environment, below the light.
fn grid(text: &mut Markup, report: &Report, pictures: &TablePictures, index: usize) -> Result<(), Failure> {
    let environment = report.tables.first().and_then(|first| first.pairs.get(index)).map_or("", name);
    let edge = report.settings.sphere;
    text.put(format_args!(
            "<section class=\"pair\"><h3>Under {}</h3>\n<div class=\"scroll\"><div class=\"spheres\" style=\"--columns: \
             {}\">\n<div></div>",
            escape(environment),
            SHOWN.len() + 1
        ),
    );
    for (degree, window) in SHOWN {
        let how = if window == Window::None { String::new() } else { ", windowed".to_owned() };
        let rows = (degree + 1).pow(2);
        text.put(format_args!("<div class=\"head\">n = {rows}<span>degree {degree}{how}</span></div>"));
    }
    text.line(
        "<div class=\"head\">Ground truth<span>brute force</span></div>\n<div class=\"side\">light</div>",
    );
    let image =
        |text: &mut Markup, (width, height): (usize, usize), pixels: &[[u8; 3]], class: &str, what: &str| {
            let source = data_uri(width, height, pixels)?;
            text.put(format_args!(
                "<img{class} src=\"{source}\" width=\"{width}\" height=\"{height}\" alt=\"{}\"/>",
                escape(what)
            ));
            Ok::<(), Failure>(())
        };
    let what = |place: usize| match SHOWN.get(place) {
        Some((degree, Window::None)) => format!("degree {degree}"),
        Some((degree, _)) => format!("degree {degree} with a window"),
        None => "brute force".to_owned(),
    };
    for (place, pixels) in pictures.lights.get(index).into_iter().flatten().enumerate() {
        let of = format!("{environment}: {}", what(place));
        image(text, (PICTURE.width, PICTURE.height), pixels, " class=\"light\"", &of)?;
    }
    for (table, spheres) in report.tables.iter().zip(&pictures.spheres) {
        let (Some(pair), Some(spheres)) = (table.pairs.get(index), spheres.get(index)) else { continue };
        text.put(format_args!("\n<div class=\"side\">{}</div>", escape(&table.material)));
        for (place, pixels) in spheres.iter().enumerate() {
            let of = format!("{} under {environment}: {}", table.material, what(place));
            image(text, (edge, edge), pixels, "", &of)?;
        }
        text.put(format_args!("\n<div class=\"side\">difference<br/>× {}</div>", report.settings.amplify));
        let truth = spheres.last().map_or(&[][..], |truth| truth);
        for (place, pixels) in spheres.iter().enumerate().take(SHOWN.len()) {
            let of = format!("{} under {environment}, difference: {}", table.material, what(place));
            image(text, (edge, edge), &difference(pixels, truth, report.settings.amplify), "", &of)?;
        }
        text.line("<div></div>\n<div class=\"side\">RMS error</div>");
        for cut in SHOWN.iter().filter_map(|of| shown(pair, *of)) {
            text.put(format_args!("<div class=\"head\"><span>{}</span></div>", percent(cut.errors.rms)));
        }
        text.line("<div></div>");
    }
    text.line("\n</div></div></section>");
    Ok(())
}

/// The share of each material's energy that the degrees up to each hold.
fn energies(text: &mut Markup, report: &Report) {
    text.line(
        "<h3>Captured energy</h3>\n<p>The share of the energy of a material, over all views within 75 degrees of the \
         normal, that the degrees up to each hold. A material with less at a degree than another needs a higher one \
         in the same light.</p>\n<div class=\"scroll\"><table><thead><tr><th>Material</th>",
    );
    for degree in (0..=MAX_CUT).step_by(2) {
        text.put(format_args!("<th class=\"number\">F = {degree}</th>"));
    }
    text.line("</tr></thead><tbody>");
    for table in &report.tables {
        text.put(format_args!("<tr><th scope=\"row\">{}</th>", escape(&table.material)));
        for share in table.captured.iter().step_by(2) {
            text.put(format_args!("<td class=\"number\">{}</td>", percent(*share)));
        }
        text.line("</tr>");
    }
    text.line("</tbody></table></div>");
}
