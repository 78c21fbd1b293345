//! The section of a report's page on light rigs.

use containers::escape_html as escape;
use engine::Failure;

use crate::picture::data_uri;
use crate::picture::report::figures::{Report, RigFigures, RigMethod, RigSphere};
use crate::picture::report::markup::Markup;
use crate::picture::report::picture::difference;
use crate::picture::report::rig_pictures::{LIGHTS, PICTURE, RigPictures, SHOWN};
use crate::values::{percent, quantity};

/// The section: for each environment, the errors of all rigs and the spheres of one method.
pub(crate) fn section(page: &mut Markup, report: &Report, pictures: &[RigPictures]) -> Result<(), Failure> {
    page.line("<h2 id=\"rigs\">Light rigs: how many lights stand for an environment</h2>");
    page.put(format_args!(
        "<p>A sphere, brushed along +Z, under the lights of <code>sample-light</code> in place of the environment, \
         compared with brute force. A matte surface needs few lights; a glossy one shows each of them. Numbers are the \
         relative RMS error of the sphere. Spheres are those of <code>{}</code>, with the lights marked above.</p>\n",
        SHOWN.name()
    ));
    for (figures, pictures) in report.rigs.iter().zip(pictures) {
        page.put(format_args!("<section class=\"pair\"><h3>Under {}</h3>\n", escape(&figures.environment)));
        table(page, figures);
        spheres(page, report, figures, pictures)?;
        page.line("</section>");
    }
    Ok(())
}

fn table(page: &mut Markup, figures: &RigFigures) {
    page.line("<div class=\"scroll\"><table><thead><tr><th></th><th>Method</th>");
    for count in LIGHTS {
        page.put(format_args!("<th class=\"number\">{}</th>", lights(count)));
    }
    page.line("</tr></thead><tbody>");
    let mut row = |name: &str, method: RigMethod, of: &dyn Fn(&RigSphere) -> f64, all: &[RigSphere]| {
        page.put(format_args!("<tr><th scope=\"row\">{}</th><td>{}</td>", escape(name), method.name()));
        for sphere in all.iter().filter(|sphere| sphere.method == method) {
            page.put(format_args!("<td class=\"number\">{}</td>", percent(of(sphere))));
        }
        page.line("</tr>");
    };
    for method in RigMethod::ALL {
        if let Some(first) = figures.materials.first() {
            row("irradiance", method, &|sphere| sphere.irradiance, &first.spheres);
        }
        for material in &figures.materials {
            row(&material.material, method, &|sphere| sphere.errors.rms, &material.spheres);
        }
    }
    page.line("</tbody></table></div>");
}

fn lights(count: u32) -> String {
    quantity::count(count as usize, "light")
}

fn spheres(
    page: &mut Markup,
    report: &Report,
    figures: &RigFigures,
    pictures: &RigPictures,
) -> Result<(), Failure> {
    page.put(format_args!(
        "<div class=\"scroll\"><div class=\"spheres\" style=\"--columns: {}\">\n<div></div>",
        LIGHTS.len() + 1
    ));
    for count in LIGHTS {
        page.put(format_args!("<div class=\"head\">{}</div>", lights(count)));
    }
    page.line(
        "<div class=\"head\">Ground truth<span>brute force</span></div>\n<div class=\"side\">light</div>",
    );
    let what = |place: usize| match LIGHTS.get(place) {
        Some(count) => lights(*count),
        None => "brute force".to_owned(),
    };
    for (place, pixels) in pictures.lights.iter().enumerate() {
        page.put(format_args!(
            "<img class=\"light\" src=\"{}\" width=\"{}\" height=\"{}\" alt=\"{}: {}\"/>",
            data_uri(PICTURE.width, PICTURE.height, pixels)?,
            PICTURE.width,
            PICTURE.height,
            escape(&figures.environment),
            what(place)
        ));
    }
    let edge = report.settings.sphere;
    for (material, spheres) in figures.materials.iter().zip(&pictures.spheres) {
        page.put(format_args!("\n<div class=\"side\">{}</div>", escape(&material.material)));
        let image = |page: &mut Markup, pixels: &[[u8; 3]], what: &str| {
            let source = data_uri(edge, edge, pixels)?;
            page.put(format_args!(
                "<img src=\"{source}\" width=\"{edge}\" height=\"{edge}\" alt=\"{} under {}, {what}\"/>",
                escape(&material.material),
                escape(&figures.environment)
            ));
            Ok::<(), Failure>(())
        };
        for (place, pixels) in spheres.iter().enumerate() {
            image(page, pixels, &what(place))?;
        }
        page.put(format_args!("\n<div class=\"side\">difference<br/>× {}</div>", report.settings.amplify));
        let truth = spheres.last().map_or(&[][..], |truth| truth);
        for (place, pixels) in spheres.iter().enumerate().take(LIGHTS.len()) {
            let pixels = difference(pixels, truth, report.settings.amplify);
            image(page, &pixels, &format!("difference: {}", what(place)))?;
        }
        page.line("<div></div>");
    }
    page.line("</div></div>");
    Ok(())
}
