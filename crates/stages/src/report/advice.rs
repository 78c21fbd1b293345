//! Which export to use, and why, in plain language.

use crate::quantity::size;
use crate::report::figures::{Advice, Export, Help, MaterialFigures, Method, PairFigures, ShrmError};
use crate::sheet::percent;

/// If no export is good enough, exports whose errors are at most this share above the least count as equally
/// close: one picture of one view cannot distinguish them.
const ALIKE: f64 = 0.1;

/// The smallest export that is good enough; if there is none, the one that comes closest, and of several as
/// close the smallest.
pub(crate) fn advise(
    material: &MaterialFigures,
    exports: &[Export],
    shrm: &ShrmError,
    help: Option<&Help>,
    accept: f64,
) -> Advice {
    let least = exports.iter().map(|export| export.rms).fold(f64::INFINITY, f64::min);
    let enough = if least <= accept { accept } else { least * (1.0 + ALIKE) };
    let chosen = exports.iter().filter(|export| export.rms <= enough).min_by_key(|export| export.bytes);
    let Some((chosen, plain)) = chosen.zip(exports.iter().find(|e| e.method == Method::ReflectionMap)) else {
        return Advice { method: Method::ReflectionMap, good: false, why: String::new() };
    };
    let good = chosen.rms <= accept;
    let off = |export: &Export| percent(export.rms);
    let mut why = if material.view_dependent {
        "The highlight changes with the view.".to_owned()
    } else {
        "It looks the same from every side, so all exports give the same picture.".to_owned()
    };
    let mut say = |text: String| {
        why.push(' ');
        why.push_str(&text);
    };
    if !good {
        say(format!(
            "No export meets {}; {} comes closest, with an error of {}.",
            percent(accept),
            chosen.method.title(),
            off(chosen)
        ));
        if shrm.degrees > accept {
            say(format!("degree = [{}, {}] is too low.", material.f, material.p));
        }
        if let Some(help) = help {
            say(sentence(help, material));
        }
    } else if !material.view_dependent {
        say("One plain map is enough.".to_owned());
    } else if chosen.method == Method::ReflectionMap {
        say(format!("Even so, a plain map has an error of only {}, for a fraction of the size.", off(plain)));
    } else {
        say(format!(
            "A plain map has an error of {}, {} of {}.",
            off(plain),
            chosen.method.title(),
            off(chosen)
        ));
        let larger = exports.iter().filter(|e| e.bytes > chosen.bytes && e.rms < 0.5 * chosen.rms);
        if let Some(better) = larger.min_by(|a, b| a.rms.total_cmp(&b.rms)) {
            say(format!("{} is larger and has an error of {}.", better.method.title(), off(better)));
        }
    }
    Advice { method: chosen.method, good, why }
}

/// What would help, as a sentence.
fn sentence(help: &Help, material: &MaterialFigures) -> String {
    let what = what(material.view_dependent);
    match *help {
        Help::Degrees { f, p, rms } => {
            format!("With degree = [{f}, {p}] {what} has an error of {}.", percent(rms))
        }
        Help::Resolution { texels } => {
            format!("The texels are too coarse: {what} is good enough at about resolution = {texels}.")
        }
        Help::Missed { f, p, rms } => {
            format!(
                "At degree = [{f}, {p}], the highest tried, {what} still has an error of {}.",
                percent(rms)
            )
        }
    }
}

/// The export that higher degrees make good enough.
fn what(view_dependent: bool) -> &'static str {
    if view_dependent { "an SHRM" } else { "a plain map" }
}

/// What to use for a material under all environments; `pairs` are those of the material.
pub(crate) fn verdict(material: &MaterialFigures, pairs: &[&PairFigures], accept: f64) -> String {
    // An export, its largest error, its size, and the environment of that error.
    let worst = |method: Method| {
        let of = |pair: &&PairFigures| {
            let export = pair.exports.iter().find(|export| export.method == method)?;
            Some((export.rms, export.bytes, pair.environment.clone()))
        };
        pairs.iter().filter_map(of).max_by(|a, b| a.0.total_cmp(&b.0)).map(|worst| (method, worst))
    };
    let worst: Vec<_> = Method::ALL.into_iter().filter_map(worst).collect();
    let good = worst.iter().filter(|(_, (rms, ..))| *rms <= accept).min_by_key(|(_, (_, bytes, _))| *bytes);
    let everywhere = if pairs.len() > 1 { " under every environment" } else { "" };
    if let Some((method, (rms, bytes, _))) = good {
        let from = if material.view_dependent { "" } else { " It looks the same from every side." };
        return format!(
            "{}: an error of at most {}{everywhere}, for {}.{from}",
            method.title(),
            percent(*rms),
            size(*bytes)
        );
    }
    let least = worst.iter().map(|(_, (rms, ..))| *rms).fold(f64::INFINITY, f64::min);
    let close = worst.iter().filter(|(_, (rms, ..))| *rms <= least * (1.0 + ALIKE));
    let Some((method, (rms, _, environment))) = close.min_by_key(|(_, (_, bytes, _))| *bytes) else {
        return String::new();
    };
    let mut text = format!(
        "No export is good enough{everywhere} with degree = [{}, {}]: {} comes closest, with an error of {} under {environment}.",
        material.f,
        material.p,
        method.title(),
        percent(*rms)
    );
    let helps: Vec<&Help> = pairs.iter().filter_map(|pair| pair.help.as_ref()).collect();
    let (mut degrees, mut texels) = ([0, 0], 0);
    if helps.len() < pairs.len() && helps.iter().any(|help| matches!(help, Help::Degrees { .. })) {
        // Some pairs are good enough already, with these degrees.
        degrees = [material.f, material.p];
    }
    for help in &helps {
        match **help {
            Help::Degrees { f, p, .. } => degrees = [degrees[0].max(f), degrees[1].max(p)],
            Help::Resolution { texels: most } => texels = texels.max(most),
            Help::Missed { .. } => {}
        }
    }
    if let Some(missed) = helps.iter().find(|help| matches!(help, Help::Missed { .. })) {
        text = format!("{text} {}", sentence(missed, material));
    } else {
        let mut set = Vec::new();
        if degrees != [0, 0] {
            set.push(format!("degree = [{}, {}] in project-brdf", degrees[0], degrees[1]));
        }
        if texels > 0 {
            set.push(format!("resolution = {texels} in the exports"));
        }
        if !set.is_empty() {
            text = format!("{text} Set {} and use {}.", set.join(" and "), what(material.view_dependent));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figures::Accuracy;

    const EXACT: ShrmError = ShrmError { degrees: 0.0, texels: 0.0 };
    const CUT: ShrmError = ShrmError { degrees: 0.2, texels: 0.0 };

    fn exports(rms: [f64; 4]) -> Vec<Export> {
        let of = |(method, (rms, bytes))| Export { method, rms, bytes, texture: String::new() };
        Method::ALL.into_iter().zip(rms.into_iter().zip([1, 16, 12, 9])).map(of).collect()
    }

    fn material(f: usize, p: usize) -> MaterialFigures {
        MaterialFigures {
            name: "satin".into(),
            model: "ggx".into(),
            centre: "normal",
            f,
            p,
            captured: 1.0,
            chosen: String::new(),
            view_dependent: p > 0,
            high_f: 30,
            captured_per_p: Vec::new(),
            verdict: String::new(),
        }
    }

    fn pair(environment: &str, rms: [f64; 4], help: Option<Help>) -> PairFigures {
        PairFigures {
            environment: environment.into(),
            material: "satin".into(),
            rendered: [2, 1],
            exports: exports(rms),
            shrm: EXACT,
            help,
            per_p: Vec::new(),
            accuracy: Accuracy::default(),
            accuracy_per_p: Accuracy::default(),
            advice: Advice { method: Method::Shrm, good: true, why: String::new() },
        }
    }

    #[test]
    fn the_smallest_that_is_good_enough_is_advised() {
        let mirror = advise(&material(9, 0), &exports([0.01; 4]), &EXACT, None, 0.05);
        assert_eq!((mirror.method, mirror.good), (Method::ReflectionMap, true));
        let satin = advise(&material(9, 2), &exports([0.12, 0.04, 0.04, 0.01]), &EXACT, None, 0.05);
        assert_eq!((satin.method, satin.good), (Method::Shrm, true));
        assert_eq!(
            satin.why,
            "The highlight changes with the view. A plain map has an error of 12.0 %, SHRM of 1.0 %."
        );
        let mild = advise(&material(9, 2), &exports([0.04, 0.04, 0.04, 0.01]), &EXACT, None, 0.05);
        assert_eq!(mild.method, Method::ReflectionMap);
        assert!(mild.why.contains("an error of only 4.0 %"), "{}", mild.why);
    }

    #[test]
    fn if_none_is_good_enough_it_says_what_would_be() {
        let rms = [0.5, 0.11, 0.4, 0.1];
        let hair = |shrm, help| advise(&material(9, 4), &exports(rms), &shrm, Some(&help), 0.05).why;
        let more = hair(CUT, Help::Degrees { f: 12, p: 8, rms: 0.03 });
        assert!(
            more.ends_with(
                "degree = [9, 4] is too low. With degree = [12, 8] an SHRM has an error of 3.0 %."
            ),
            "{more}"
        );
        let texels = hair(EXACT, Help::Resolution { texels: 96 });
        assert!(texels.ends_with("too coarse: an SHRM is good enough at about resolution = 96."), "{texels}");
        let sharp = hair(CUT, Help::Missed { f: 30, p: 9, rms: 0.1 });
        assert!(
            sharp.ends_with("At degree = [30, 9], the highest tried, an SHRM still has an error of 10.0 %."),
            "{sharp}"
        );
    }

    #[test]
    fn of_equally_close_exports_the_smallest_is_advised() {
        let chalk = advise(&material(2, 0), &exports([0.081, 0.08, 0.0801, 0.081]), &CUT, None, 0.05);
        assert_eq!((chalk.method, chalk.good), (Method::ReflectionMap, false));
        let silk = advise(&material(9, 5), &exports([0.5, 0.114, 0.33, 0.119]), &CUT, None, 0.05);
        assert_eq!(silk.method, Method::Shrm, "a third of the texture's size");
    }

    #[test]
    fn a_verdict_holds_under_every_environment() {
        let satin = material(9, 2);
        let (day, night) =
            (pair("day", [0.03, 0.04, 0.04, 0.01], None), pair("night", [0.2, 0.1, 0.04, 0.02], None));
        let said = |pairs: &[&PairFigures]| verdict(&satin, pairs, 0.05);
        assert_eq!(said(&[&day]), "Plain map: an error of at most 3.0 %, for 1 B.");
        assert_eq!(
            said(&[&day, &night]),
            "SHRM: an error of at most 2.0 % under every environment, for 9 B."
        );
        let dusk = pair("dusk", [0.3; 4], Some(Help::Degrees { f: 12, p: 1, rms: 0.04 }));
        let dawn = pair("dawn", [0.2; 4], Some(Help::Degrees { f: 7, p: 4, rms: 0.04 }));
        assert_eq!(
            said(&[&dusk, &dawn]),
            "No export is good enough under every environment with degree = [9, 2]: Plain map comes closest, with an error \
             of 30.0 % under dusk. Set degree = [12, 4] in project-brdf and use an SHRM."
        );
        let good = pair("noon", [0.3, 0.3, 0.3, 0.04], None);
        assert!(said(&[&dusk, &good]).ends_with("Set degree = [12, 2] in project-brdf and use an SHRM."));
    }
}
