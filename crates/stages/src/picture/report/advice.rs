//! Which export to use, and why, in plain language.
//!
//! An export stands for a material by its figures under one environment, the one under which it is worst:
//! figures of two environments are never combined. What would help is named only if it was measured.

use crate::picture::report::figures::{Advice, Change, Errors, Export, Limits, Method, PairFigures, Trial};
use crate::values::percent;
use crate::values::quantity::size;

/// If no export is good, exports whose errors are at most this share above the least count as equal: one
/// picture of one view cannot distinguish them.
const ALIKE: f64 = 0.1;

/// An export under the environment where it is worst.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    method: Method,
    environment: &'a str,
    export: &'a Export,
    /// The bytes of the export under all environments together.
    bytes: u64,
    /// The least and the most degree P under any environment.
    p: [usize; 2],
}

/// The smallest export that is good; if there is none, the smallest of those that come closest.
fn choose<'a>(candidates: &[Candidate<'a>], limits: &Limits) -> Option<Candidate<'a>> {
    let excess = |candidate: &Candidate<'_>| limits.excess(&candidate.export.errors);
    let least = candidates.iter().map(excess).fold(f64::INFINITY, f64::min);
    let enough = if least <= 1.0 { 1.0 } else { least * (1.0 + ALIKE) };
    candidates
        .iter()
        .filter(|candidate| excess(candidate) <= enough)
        .min_by_key(|candidate| candidate.bytes)
        .copied()
}

/// The export of a pair that is advised.
pub(crate) fn best<'a>(exports: &'a [Export], limits: &Limits) -> Option<&'a Export> {
    choose(&of_exports("", exports), limits).map(|candidate| candidate.export)
}

fn of_exports<'a>(environment: &'a str, exports: &'a [Export]) -> Vec<Candidate<'a>> {
    let of = |export: &'a Export| Candidate {
        method: export.method,
        environment,
        export,
        bytes: export.size(),
        p: [export.p; 2],
    };
    exports.iter().map(of).collect()
}

/// Advises on a pair; `given` are the degrees, unless they were chosen for the light.
pub(crate) fn of_pair(
    environment: &str,
    exports: &[Export],
    tried: &[Trial],
    given: Option<[usize; 2]>,
    limits: &Limits,
) -> Advice {
    let mut advice = advise(&of_exports(environment, exports), false, limits);
    if !tried.is_empty() {
        if let Some([f, p]) = given.filter(|_| tried[0].change.no_degree) {
            say(&mut advice.why, &format!("The cut at the given degrees, F = {f} and P = {p}, shows."));
        }
        say(&mut advice.why, &remedy(tried, limits));
    }
    advice
}

/// Advises on a material under all environments; `pairs` are those of the material.
pub(crate) fn of_material(pairs: &[&PairFigures], limits: &Limits) -> Advice {
    let candidates: Vec<_> =
        Method::ALL.into_iter().filter_map(|method| under_the_worst(method, pairs, limits)).collect();
    let mut advice = advise(&candidates, pairs.len() > 1, limits);
    for pair in pairs.iter().filter(|pair| !pair.tried.is_empty()) {
        if pairs.len() > 1 {
            say(&mut advice.why, &format!("Under {}:", pair.environment));
        }
        say(&mut advice.why, &remedy(&pair.tried, limits));
    }
    advice
}

/// An export under the environment where it is worst. Without lamps, both forms of an SHRM are one.
fn under_the_worst<'a>(method: Method, pairs: &[&'a PairFigures], limits: &Limits) -> Option<Candidate<'a>> {
    let find = |pair: &&'a PairFigures, method| pair.exports.iter().find(|export| export.method == method);
    pairs.iter().find_map(|pair| find(pair, method))?;
    let all = pairs.iter().map(|pair| {
        let same = || if method == Method::ShrmSeparate { find(pair, Method::Shrm) } else { None };
        let export = find(pair, method).or_else(same)?;
        Some(Candidate {
            method,
            environment: &pair.environment,
            export,
            bytes: export.size(),
            p: [export.p; 2],
        })
    });
    let all = all.collect::<Option<Vec<_>>>()?;
    let bytes = all.iter().map(|candidate| candidate.bytes).sum();
    let p = |candidate: &Candidate<'_>| candidate.export.p;
    let p = [all.iter().map(p).min()?, all.iter().map(p).max()?];
    let excess = |candidate: &Candidate<'_>| limits.excess(&candidate.export.errors);
    let worst = all.into_iter().max_by(|a, b| excess(a).total_cmp(&excess(b)))?;
    Some(Candidate { bytes, p, ..worst })
}

/// Advises on candidates, without remedies.
fn advise(candidates: &[Candidate<'_>], several: bool, limits: &Limits) -> Advice {
    let Some(chosen) = choose(candidates, limits) else {
        let (environment, why) = (String::new(), String::new());
        return Advice { method: Method::ReflectionMap, good: false, environment, why };
    };
    let good = limits.excess(&chosen.export.errors) <= 1.0;
    let (name, everywhere) = (named(&chosen, several), if several { " under every environment" } else { "" });
    let (word, figures) = (word(&chosen.export.errors, limits), figures(&chosen.export.errors));
    let environment = chosen.environment;
    let mut why = match (good, several) {
        (true, false) => format!("{name} is good: {figures}."),
        (true, true) => {
            format!("{name} is good{everywhere}. Where it is worst, under {environment}, {figures}.")
        }
        (false, false) => format!("No export is good. The best is {name}, and it is {word}: {figures}."),
        (false, true) => format!(
            "No export is good{everywhere}. The best is {name}. Where it is worst, under {environment}, it is \
             {word}: {figures}."
        ),
    };
    let brief = |candidate: &Candidate<'_>| {
        let errors = &candidate.export.errors;
        let under = if several { format!(" under {}", candidate.environment) } else { String::new() };
        format!("{}{under} ({})", self::word(errors, limits), reached(errors))
    };
    let others: Vec<_> = candidates.iter().filter(|other| !other.method.adds_lights()).copied().collect();
    let mut named_plain = chosen.method == Method::ReflectionMap;
    if chosen.method.adds_lights()
        && let Some(other) = choose(&others, limits)
    {
        named_plain |= other.method == Method::ReflectionMap;
        say(
            &mut why,
            &format!(
                "It needs a renderer that adds the lights by the material's own BRDF. For one that only looks maps \
                 up, {} is the best choice: it is {}.",
                named(&other, several),
                brief(&other)
            ),
        );
    }
    let plain = candidates.iter().find(|other| other.method == Method::ReflectionMap);
    if let Some(plain) = plain.filter(|_| !named_plain) {
        say(&mut why, &format!("A plain map is {}.", brief(plain)));
    }
    Advice { method: chosen.method, good, environment: environment.to_owned(), why }
}

/// Says what was tried beside the exports, and what it reached.
fn remedy(tried: &[Trial], limits: &Limits) -> String {
    let is_good = |trial: &&Trial| limits.excess(&trial.export.errors) <= 1.0;
    let what = |trial: &Trial| {
        let export = &trial.export;
        let (name, size) = (export.method.title(), size(export.bytes));
        format!("{name} (F = {}, P = {}, {size})", export.f, export.p)
    };
    if let Some(good) = tried.iter().filter(is_good).min_by_key(|trial| trial.export.bytes) {
        let mut text = format!(
            "With {}, {} is good: {}.",
            changed(&good.change),
            what(good),
            figures(&good.export.errors)
        );
        let other = tried.iter().find(|trial| {
            good.export.method == Method::ShrmSeparate
                && trial.change == good.change
                && trial.export.method == Method::Shrm
        });
        if let Some(other) = other {
            let errors = &other.export.errors;
            let (word, reached) = (word(errors, limits), reached(errors));
            say(&mut text, &format!("{} with the lamps in the map is {word} ({reached}).", what(other)));
        }
        return text;
    }
    let reached = |trial: &Trial| {
        format!("with {}, {} reaches {}", changed(&trial.change), what(trial), reached(&trial.export.errors))
    };
    let tried: Vec<_> = tried.iter().map(reached).collect();
    format!("Nothing that was tried is good: {}.", tried.join("; "))
}

/// The settings that a change asks for.
fn changed(change: &Change) -> String {
    let mut settings = Vec::new();
    if change.no_degree {
        settings.push("no degree, tolerance or window in project-sh and project-brdf".to_owned());
    }
    if let Some([f, p]) = change.degree {
        settings.push(format!("degree = [{f}, {p}] in project-brdf"));
    }
    if let (Some([p95, p99]), Some(most_p)) = (change.accept, change.most_p) {
        settings.push(format!("accept = [{p95}, {p99}], most-p = {most_p} in export-shrm"));
    }
    if let Some(resolution) = change.resolution {
        settings.push(format!("resolution = {resolution}"));
    }
    settings.join(" and ")
}

/// Says how far off errors are, in a word or two.
pub(crate) fn word(errors: &Errors, limits: &Limits) -> &'static str {
    match limits.excess(errors) {
        excess if excess <= 1.0 => "good",
        excess if excess <= 2.0 => "slightly off",
        excess if excess <= 5.0 => "visibly off",
        _ => "far off",
    }
}

fn named(candidate: &Candidate<'_>, several: bool) -> String {
    let (title, size) = (candidate.method.title(), size(candidate.bytes));
    let all = if several { " in all" } else { "" };
    match (candidate.method, candidate.p) {
        (Method::Taps | Method::ReflectionMap | Method::PartMaps, _) => format!("{title} ({size}{all})"),
        (_, [least, most]) if least < most => format!("{title} (P = {least} to {most}, {size}{all})"),
        (_, [p, _]) => format!("{title} (P = {p}, {size}{all})"),
    }
}

/// Errors as the rest of a sentence.
fn figures(errors: &Errors) -> String {
    let negative = if errors.negative >= 5e-4 {
        format!(", and {} are negative", percent(errors.negative))
    } else {
        String::new()
    };
    format!("95 % of samples are within {:.2} stops and 99 % within {:.2}{negative}", errors.p95, errors.p99)
}

/// Errors in brackets.
fn reached(errors: &Errors) -> String {
    format!("{:.2} and {:.2} stops", errors.p95, errors.p99)
}

fn say(text: &mut String, more: &str) {
    if !text.is_empty() {
        text.push(' ');
    }
    text.push_str(more);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> Limits {
        Limits::new(0.15)
    }

    fn export(method: Method, p95: f64, bytes: u64) -> Export {
        let errors = Errors { rms: p95, p95, p99: 2.0 * p95, ..Errors::default() };
        Export { method, errors, f: 30, p: 8, bytes, file: None, texture: String::new(), maps: 1, one_of: 1 }
    }

    /// A plain map, a texture, Cabral, an SHRM and, if it is given, one with lights.
    fn exports(p95: &[f64]) -> Vec<Export> {
        let of = |(method, (p95, bytes)): (Method, (&f64, u64))| export(method, *p95, bytes);
        let methods =
            Method::ALL.into_iter().filter(|method| !matches!(method, Method::Taps | Method::PartMaps));
        methods.zip(p95.iter().zip([1, 16, 12, 60, 9])).map(of).collect()
    }

    fn pair(environment: &str, p95: &[f64], tried: Vec<Trial>) -> PairFigures {
        let exports = exports(p95);
        PairFigures {
            environment: environment.into(),
            material: "satin".into(),
            f: 30,
            p: 8,
            lamps: p95.len() - 4,
            for_light: true,
            advice: of_pair(environment, &exports, &tried, None, &limits()),
            exports,
            tried,
            trade: None,
        }
    }

    fn trial(change: Change, method: Method, p95: f64) -> Trial {
        Trial { change, export: export(method, p95, 240) }
    }

    const NONE: Change =
        Change { no_degree: false, degree: None, resolution: None, accept: None, most_p: None };
    const FINER: Change = Change { resolution: Some(64), ..NONE };
    const NO_DEGREE: Change = Change { no_degree: true, ..NONE };

    #[test]
    fn the_smallest_export_that_is_good_is_advised() {
        let mirror = pair("day", &[0.02; 4], vec![]).advice;
        assert_eq!((mirror.method, mirror.good), (Method::ReflectionMap, true));
        assert_eq!(
            mirror.why,
            "Plain map (1 B) is good: 95 % of samples are within 0.02 stops and 99 % within 0.04."
        );
        let satin = pair("day", &[0.9, 0.3, 0.4, 0.1], vec![]).advice;
        assert_eq!((satin.method, satin.good), (Method::Shrm, true));
        assert!(satin.why.ends_with("A plain map is far off (0.90 and 1.80 stops)."), "{}", satin.why);
    }

    #[test]
    fn lights_beside_a_map_are_advised_with_what_other_renderers_take() {
        let sunny = pair("sun", &[0.9, 0.6, 0.7, 0.14, 0.05], vec![]).advice;
        assert_eq!((sunny.method, sunny.good), (Method::ShrmSeparate, true));
        assert!(
            sunny.why.contains(
                "It needs a renderer that adds the lights by the material's own BRDF. For one that only looks maps up, \
                 SHRM (P = 8, 60 B) is the best choice: it is good (0.14 and 0.28 stops)."
            ),
            "{}",
            sunny.why
        );
    }

    /// 99 of 100 samples count too: a small bright spot in the wrong place is not good.
    #[test]
    fn both_limits_count_and_words_fit_the_error() {
        let limits = limits();
        let said = |p95: f64, p99: f64| word(&Errors { p95, p99, ..Errors::default() }, &limits);
        assert_eq!(said(0.15, 0.499), "good");
        assert_eq!(said(0.10, 0.6), "slightly off");
        assert_eq!(said(0.6, 0.6), "visibly off");
        assert_eq!(said(0.1, 3.0), "far off");
    }

    #[test]
    fn of_equally_bad_exports_the_smallest_is_the_best() {
        let chalk = pair("day", &[0.81, 0.80, 0.801, 0.81], vec![]).advice;
        assert_eq!((chalk.method, chalk.good), (Method::ReflectionMap, false));
        assert!(chalk.why.starts_with("No export is good. The best is Plain map (1 B), and it is far off:"));
    }

    #[test]
    fn a_material_is_judged_by_each_exports_worst_environment() {
        let (day, night) =
            (pair("day", &[0.1, 0.1, 0.1, 0.05], vec![]), pair("night", &[2.0, 1.0, 0.9, 0.12], vec![]));
        let satin = of_material(&[&day, &night], &limits());
        assert_eq!((satin.method, satin.good, satin.environment.as_str()), (Method::Shrm, true, "night"));
        assert!(
            satin.why.starts_with(
                "SHRM (P = 8, 120 B in all) is good under every environment. Where it is worst, under night, 95 % of \
                 samples are within 0.12 stops"
            ),
            "{}",
            satin.why
        );
        // The first miss is not the worst one, and the order of environments does not matter.
        let (dusk, dawn) = (pair("dusk", &[0.3; 4], vec![]), pair("dawn", &[3.0, 2.0, 2.5, 1.0], vec![]));
        for pairs in [[&dusk, &dawn], [&dawn, &dusk]] {
            let advice = of_material(&pairs, &limits());
            assert_eq!((advice.method, advice.environment.as_str()), (Method::Shrm, "dawn"));
            assert!(advice.why.contains("under dawn, it is far off: 95 % of samples are within 1.00 stops"));
            assert!(!advice.why.contains("0.30"), "a figure of another environment: {}", advice.why);
        }
    }

    #[test]
    fn lamps_under_one_environment_alone_still_make_one_choice() {
        let (sun, cloud) =
            (pair("sun", &[0.9, 0.8, 0.8, 0.4, 0.05], vec![]), pair("cloud", &[0.9, 0.8, 0.8, 0.06], vec![]));
        let advice = of_material(&[&sun, &cloud], &limits());
        assert_eq!(
            (advice.method, advice.good, advice.environment.as_str()),
            (Method::ShrmSeparate, true, "cloud")
        );
        assert!(advice.why.contains("it is visibly off under sun (0.40 and 0.80 stops)"), "{}", advice.why);
    }

    #[test]
    fn what_helps_was_measured() {
        let missed = [0.9, 0.8, 0.8, 0.4];
        let advice = pair("day", &missed, vec![trial(FINER, Method::Shrm, 0.1)]).advice;
        assert!(
            advice.why.ends_with(
                "With resolution = 64, SHRM (F = 30, P = 8, 240 B) is good: 95 % of samples are within 0.10 stops and \
                 99 % within 0.20."
            ),
            "{}",
            advice.why
        );
        let both = Change { degree: Some([255, 16]), ..FINER };
        let failed = vec![trial(FINER, Method::Shrm, 0.4), trial(both, Method::Shrm, 0.3)];
        let advice = pair("day", &missed, failed.clone()).advice;
        assert!(
            advice.why.ends_with(
                "Nothing that was tried is good: with resolution = 64, SHRM (F = 30, P = 8, 240 B) reaches 0.40 and 0.80 \
                 stops; with degree = [255, 16] in project-brdf and resolution = 64, SHRM (F = 30, P = 8, 240 B) \
                 reaches 0.30 and 0.60 stops."
            ),
            "{}",
            advice.why
        );
        // A material names the environment of each remedy.
        let (day, night) = (pair("day", &[0.1; 4], vec![]), pair("night", &missed, failed));
        let advice = of_material(&[&day, &night], &limits());
        assert!(advice.why.contains("Under night: Nothing that was tried is good"), "{}", advice.why);
        assert!(!advice.why.contains("Under day:"), "{}", advice.why);
    }

    #[test]
    fn given_degrees_that_show_are_named_with_the_remedy() {
        let exports = exports(&[0.9, 0.8, 0.8, 0.4]);
        let tried = [trial(NO_DEGREE, Method::ShrmSeparate, 0.05), trial(NO_DEGREE, Method::Shrm, 0.2)];
        let advice = of_pair("sun", &exports, &tried, Some([12, 4]), &limits());
        assert!(
            advice.why.contains("The cut at the given degrees, F = 12 and P = 4, shows. With no degree, tolerance or window in"),
            "{}",
            advice.why
        );
        assert!(
            advice.why.ends_with("with the lamps in the map is slightly off (0.20 and 0.40 stops)."),
            "{}",
            advice.why
        );
    }
}
