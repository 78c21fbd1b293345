//! Which export to use, and why, in plain words.

use crate::report::figures::{Advice, Export, Method, PerP};
use crate::sheet::percent;

/// Exports whose errors differ by less than this share are equally close: resampling alone makes it.
const ALIKE: f64 = 0.02;

/// The smallest export that is good enough; where none is, the smallest of the closest.
///
/// `p` is the degree of the view that the exports have; `per_p` what an SHRM of degree `high_f` would bring.
pub(crate) fn advise(p: usize, exports: &[Export], high_f: usize, per_p: &[PerP], accept: f64) -> Advice {
    let least = exports.iter().map(|export| export.rms).fold(f64::INFINITY, f64::min);
    let enough = if least <= accept { accept } else { least * (1.0 + ALIKE) };
    let chosen = exports.iter().filter(|export| export.rms <= enough).min_by_key(|export| export.bytes);
    let Some((chosen, plain)) = chosen.zip(exports.iter().find(|e| e.method == Method::ReflectionMap)) else {
        return Advice { method: Method::ReflectionMap, good: false, why: String::new() };
    };
    let good = chosen.rms <= accept;
    let off = |export: &Export| percent(export.rms);
    let mut why = match (p, good) {
        (0, true) => {
            "P = 0: it looks the same from every side, and one plain map holds all of it.".to_owned()
        }
        (0, false) => "P = 0: it looks the same from every side, and every export shows the same.".to_owned(),
        _ => format!("P = {p}: the highlight changes with the view."),
    };
    let mut say = |text: String| {
        why.push(' ');
        why.push_str(&text);
    };
    if !good {
        say(format!(
            "None here stays within {}; {} comes closest and is off by {}.",
            percent(accept),
            chosen.method.title(),
            off(chosen)
        ));
        say(match per_p.iter().find(|other| other.p >= p.min(2) && other.rms <= accept) {
            Some(other) if other.p <= p => {
                format!("Finer detail helps: F = {high_f} brings an SHRM to {}.", percent(other.rms))
            }
            Some(other) => {
                format!("F = {high_f} and P = {} bring an SHRM to {}.", other.p, percent(other.rms))
            }
            None => match per_p.last() {
                Some(last) => format!(
                    "Even F = {high_f} and P = {} leave an SHRM off by {}: light or highlight are sharper.",
                    last.p,
                    percent(last.rms)
                ),
                None => String::new(),
            },
        });
    } else if p > 0 && chosen.method == Method::ReflectionMap {
        say(format!("Yet a plain map is off by {} only, for a fraction of the size.", off(plain)));
    } else if p > 0 {
        say(format!("A plain map is off by {}, {} by {}.", off(plain), chosen.method.title(), off(chosen)));
        let larger = exports.iter().filter(|e| e.bytes > chosen.bytes && e.rms < 0.5 * chosen.rms);
        if let Some(better) = larger.min_by(|a, b| a.rms.total_cmp(&b.rms)) {
            say(format!("{} is larger and off by {}.", better.method.title(), off(better)));
        }
    }
    Advice { method: chosen.method, good, why }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exports(rms: [f64; 4]) -> Vec<Export> {
        let of = |(method, (rms, bytes))| Export { method, rms, bytes, texture: String::new() };
        Method::ALL.into_iter().zip(rms.into_iter().zip([1, 16, 12, 9])).map(of).collect()
    }

    #[test]
    fn the_smallest_that_is_good_enough_is_advised() {
        let mirror = advise(0, &exports([0.01; 4]), 30, &[], 0.05);
        assert_eq!((mirror.method, mirror.good), (Method::ReflectionMap, true));
        let satin = advise(2, &exports([0.12, 0.04, 0.04, 0.01]), 30, &[], 0.05);
        assert_eq!((satin.method, satin.good), (Method::Shrm, true));
        assert_eq!(
            satin.why,
            "P = 2: the highlight changes with the view. A plain map is off by 12.0 %, SHRM by 1.0 %."
        );
        let mild = advise(2, &exports([0.04, 0.04, 0.04, 0.01]), 30, &[], 0.05);
        assert_eq!(mild.method, Method::ReflectionMap);
        assert!(mild.why.contains("off by 4.0 % only"), "{}", mild.why);
    }

    #[test]
    fn where_none_is_good_enough_it_says_what_would_be() {
        let per_p = [PerP { p: 4, captured: 0.9, rms: 0.1 }, PerP { p: 8, captured: 0.99, rms: 0.03 }];
        let rms = [0.5, 0.11, 0.4, 0.1];
        let hair = advise(4, &exports(rms), 30, &per_p, 0.05);
        assert_eq!((hair.method, hair.good), (Method::Shrm, false));
        assert!(hair.why.ends_with("F = 30 and P = 8 bring an SHRM to 3.0 %."), "{}", hair.why);
        let sharp = advise(4, &exports(rms), 30, &per_p[..1], 0.05);
        assert!(sharp.why.contains("Even F = 30 and P = 4 leave an SHRM off by 10.0 %"), "{}", sharp.why);
        let coarse = advise(8, &exports(rms), 30, &per_p, 0.05);
        assert!(coarse.why.ends_with("F = 30 brings an SHRM to 3.0 %."), "{}", coarse.why);
    }

    #[test]
    fn of_those_alike_the_smallest_is_advised() {
        let chalk = advise(0, &exports([0.081, 0.08, 0.0801, 0.081]), 30, &[], 0.05);
        assert_eq!((chalk.method, chalk.good), (Method::ReflectionMap, false));
    }
}
