//! The first screen of a report's page: a sentence for each material, and a table with a line for each pair.

use containers::escape_html as escape;

use crate::picture::report::figures::{Export, MaterialFigures, Method, PairFigures, Report};
use crate::picture::report::markup::Markup;

/// The most environments that a sentence names.
const NAMED: usize = 4;

/// The title, the sentences and the table.
pub(crate) fn section(page: &mut Markup, title: &str, report: &Report) {
    let (settings, limits) = (&report.settings, &report.settings.limits);
    page.put(format_args!("<h1>{}: which export to use</h1>\n<ul class=\"advice\">\n", escape(title)));
    for material in &report.materials {
        let own: Vec<_> = report.pairs.iter().filter(|pair| pair.material == material.name).collect();
        page.put(format_args!(
            "<li><p>{}</p><details><summary>Why</summary><p>{}</p><p class=\"small soft\">The model is {}; maps are \
             looked up by the {}.</p></details></li>\n",
            sentence(material, &own),
            escape(&material.advice.why),
            escape(&material.model),
            material.centre
        ));
    }
    page.put(format_args!(
        "</ul>\n<details><summary>How this was found</summary><p>Each export was compared with the ground truth on a \
         sphere. It is good if 95 % of the samples are within {:.2} stops of the truth and 99 % within {:.2}; advised is \
         the smallest one that is good. Sizes are those of the files that the pipeline writes; one with ~ is that of RGBA \
         half floats with cube faces of {n} × {n}, for an export that is not connected.</p></details>\n",
        limits.p95,
        limits.p99,
        n = settings.resolution
    ));
    table(page, report);
}

/// The export to use, its size under an environment, and how far it is off, such as: lacquer: use the SHRM
/// with 4 lights, 0.9 MB; within 0.11 stops under studio and sunrise.
fn sentence(material: &MaterialFigures, pairs: &[&PairFigures]) -> String {
    let advice = &material.advice;
    let exports: Vec<_> = pairs.iter().filter_map(|pair| advised(pair, advice.method)).collect();
    let lights = pairs.iter().map(|pair| pair.lamps);
    let (least, most) = (lights.clone().min().unwrap_or(0), lights.max().unwrap_or(0));
    let name = match (advice.method, least == most) {
        (Method::ShrmSeparate, true) if most == 1 => "SHRM with 1 light".to_owned(),
        (Method::ShrmSeparate, true) => format!("SHRM with {most} lights"),
        (Method::ShrmSeparate, false) if least == 0 && most == 1 => "SHRM with up to 1 light".to_owned(),
        (Method::ShrmSeparate, false) if least == 0 => format!("SHRM with up to {most} lights"),
        (Method::ShrmSeparate, false) => format!("SHRM with {least} to {most} lights"),
        (Method::ReflectionMap | Method::PartMaps | Method::Taps, _) => advice.method.title().to_lowercase(),
        (method, _) => method.title().to_owned(),
    };
    let largest = exports.iter().max_by_key(|export| export.size());
    let bytes = largest.map_or_else(String::new, |export| export.size_text()).replace(' ', "&#160;");
    let up_to = if pairs.len() > 1 { "up to " } else { "" };
    let p95 = exports.iter().map(|export| export.errors.p95).fold(0.0, f64::max);
    let material = escape(&material.name);
    if advice.good {
        return format!(
            "<strong>{material}</strong>: use the <span class=\"badge\">{name}</span>, {up_to}{bytes}; within {p95:.2} \
             stops under {}.",
            environments(pairs)
        );
    }
    let worst = pairs.iter().find(|pair| pair.environment == advice.environment);
    let worst = worst.and_then(|pair| advised(pair, advice.method)).map_or(p95, |export| export.errors.p95);
    format!(
        "<strong>{material}</strong>: nothing is good enough; the <span class=\"badge poor\">{name}</span> comes closest, \
         {up_to}{bytes}; within {worst:.2} stops at its worst, under {}.",
        escape(&advice.environment)
    )
}

/// An export of a pair. Without lamps, both forms of an SHRM are one.
fn advised(pair: &PairFigures, method: Method) -> Option<&Export> {
    let find = |method| pair.exports.iter().find(|export| export.method == method);
    find(method).or_else(|| if method == Method::ShrmSeparate { find(Method::Shrm) } else { None })
}

/// The names of the environments, or how many they are.
fn environments(pairs: &[&PairFigures]) -> String {
    let names: Vec<_> = pairs.iter().map(|pair| escape(&pair.environment)).collect();
    match names.split_last() {
        None => String::new(),
        Some((last, [])) => last.to_string(),
        Some((last, others)) if names.len() <= NAMED => format!("{} and {last}", others.join(", ")),
        Some(_) => format!("all {} environments", names.len()),
    }
}

/// The class of an export: whether it is advised, and whether it is good.
pub(crate) fn mark(pair: &PairFigures, method: Method) -> &'static str {
    match (method == pair.advice.method, pair.advice.good) {
        (true, true) => "pick",
        (true, false) => "poor",
        (false, _) => "",
    }
}

/// A line for each pair: the export to use, its size, and the errors of all.
fn table(page: &mut Markup, report: &Report) {
    let has = |method: &Method| {
        report.pairs.iter().any(|pair| pair.exports.iter().any(|export| export.method == *method))
    };
    let methods: Vec<Method> = Method::ALL.into_iter().filter(has).collect();
    page.line("<h2>Each pair</h2>");
    page.line(
        "<p>Numbers are the stops within which 95 % of the samples are: 0.1 is hard to see, 1 is a factor of two. A \
         pair leads to its pictures and all other figures. An export marked as not good is the best there is.</p>",
    );
    page.put(format_args!(
        "<table class=\"pairs\"><thead><tr><th>Material</th><th>Environment</th><th>Use</th><th \
         class=\"number\">Size</th>"
    ));
    for method in &methods {
        page.put(format_args!("<th class=\"number\">{}</th>", method.title()));
    }
    page.line("</tr></thead><tbody>");
    for (index, pair) in report.pairs.iter().enumerate() {
        let (title, poor) = (pair.advice.method.title(), if pair.advice.good { "" } else { " poor" });
        let note = if pair.advice.good { "" } else { ", not good" };
        let bytes = advised(pair, pair.advice.method).map_or_else(String::new, Export::size_text);
        page.put(format_args!(
            "<tr><th scope=\"row\"><a href=\"#pair-{index}\">{}</a></th><td class=\"environment\">{}</td><td \
             class=\"use\"><span class=\"badge{poor}\">{title}{note}</span></td><td class=\"number size-of\">{bytes}</td>",
            escape(&pair.material),
            escape(&pair.environment)
        ));
        for method in &methods {
            let export = pair.exports.iter().find(|export| export.method == *method);
            let error = export.map_or_else(|| "–".to_owned(), |export| format!("{:.2}", export.errors.p95));
            page.put(format_args!(
                "<td class=\"number {}\" data-label=\"{}\">{error}</td>",
                mark(pair, *method),
                method.title()
            ));
        }
        page.line("</tr>");
    }
    page.line("</tbody></table>");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::report::figures::{Advice, Errors};

    fn pair(environment: &str, method: Method, p95: f64, lamps: usize) -> PairFigures {
        let errors = Errors { p95, p99: 2.0 * p95, ..Errors::default() };
        let export = Export {
            method,
            errors,
            f: 30,
            p: 8,
            bytes: 900_000,
            file: Some(812_345),
            texture: String::new(),
            maps: 1,
            one_of: 1,
        };
        PairFigures {
            environment: environment.into(),
            material: "lacquer".into(),
            f: 30,
            p: 8,
            lamps,
            for_light: true,
            exports: vec![export],
            tried: Vec::new(),
            advice: advice(method, true),
            trade: None,
        }
    }

    fn advice(method: Method, good: bool) -> Advice {
        Advice { method, good, environment: "sunrise".into(), why: String::new() }
    }

    fn said(method: Method, good: bool, pairs: &[&PairFigures]) -> String {
        let material = MaterialFigures {
            name: "lacquer".into(),
            model: "phong".into(),
            centre: "normal",
            advice: advice(method, good),
        };
        let sentence = sentence(&material, pairs);
        let sentence = sentence.replace("&#160;", " ");
        ["<strong>", "</strong>", "<span class=\"badge\">", "<span class=\"badge poor\">", "</span>"]
            .iter()
            .fold(sentence, |text, tag| text.replace(tag, ""))
    }

    #[test]
    fn a_sentence_names_the_export_its_size_and_its_largest_error() {
        let method = Method::ShrmSeparate;
        let [studio, sunrise] = [pair("studio", method, 0.05, 4), pair("sunrise", method, 0.11, 4)];
        assert_eq!(
            said(method, true, &[&studio, &sunrise]),
            "lacquer: use the SHRM with 4 lights, up to 812.3 kB; within 0.11 stops under \
             studio and sunrise."
        );
        let plain = pair("studio", Method::ReflectionMap, 0.5, 1);
        assert_eq!(
            said(Method::ReflectionMap, false, &[&plain]),
            "lacquer: nothing is good enough; the plain map comes closest, 812.3 kB; within 0.50 stops at its worst, \
             under sunrise."
        );
    }

    /// In light without lamps there is no other form of an SHRM.
    #[test]
    fn an_shrm_without_lamps_counts_as_one_with_lights() {
        let (day, sun) = (pair("day", Method::Shrm, 0.2, 0), pair("sun", Method::ShrmSeparate, 0.1, 3));
        let said = said(Method::ShrmSeparate, true, &[&day, &sun]);
        assert!(said.contains("SHRM with up to 3 lights") && said.contains("within 0.20 stops"), "{said}");
    }
}
