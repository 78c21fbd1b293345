//! Formats shares of energy and relative errors, and reports what is lost.

use engine::Reporter;
use sh::Light;

/// The share of a whole above which a loss is a warning.
pub const WARNED_LOSS: f64 = 0.01;

/// Notes the share of something that a result loses: `0.4 % of ` and then `what`, such as `the vertices are
/// below zero`. If the share is above [`WARNED_LOSS`], this is a warning, which ends with `help`.
pub fn report_loss(reporter: &Reporter, lost: f64, what: &str, help: &str) {
    if lost > WARNED_LOSS {
        reporter.warn(format!("{} of {what}; {help}", about(lost)));
    } else {
        reporter.note(format!("{} of {what}", about(lost)));
    }
}

/// Writes a share as somebody says it: `28 %`, `0.4 %`.
pub(crate) fn about(part: f64) -> String {
    match 100.0 * part {
        percent if percent >= 10.0 => format!("{percent:.0} %"),
        percent if percent >= 0.1 => format!("{percent:.1} %"),
        percent if percent > 0.0 => "less than 0.1 %".to_owned(),
        _ => "0 %".to_owned(),
    }
}

/// Writes a share of a whole: `43.6 %`. Only the whole is 100 %.
pub(crate) fn share(part: f64) -> String {
    if (0.999_99..1.0).contains(&part) { "over 99.999 %".into() } else { percent(part) }
}

/// Writes a share, or a relative error, with two digits of it or of the rest, whichever is smaller:
/// `0.021 %`, `99.997 %`.
pub(crate) fn percent(part: f64) -> String {
    let percent = 100.0 * part;
    let small = percent.abs().min((100.0 - percent).abs());
    if (1e-9..1e-6).contains(&percent) {
        return "less than 0.000001 %".into();
    }
    let decimals = if small < 1e-9 { 0 } else { (1.0 - math::log10(small).floor()).clamp(1.0, 6.0) as usize };
    format!("{percent:.decimals$} %")
}

/// `2 lamps hold 75.1 % of the light`; `rest` is the integral of what is not theirs, over the sphere and all
/// channels. `None` if there are no lamps.
pub(crate) fn lamps_text(lights: &[Light], rest: f64) -> Option<String> {
    let flux: f64 = lights.iter().flat_map(Light::flux).sum();
    let count = match lights.len() {
        0 => return None,
        1 => "1 lamp holds".to_owned(),
        count => format!("{count} lamps hold"),
    };
    Some(format!("{count} {} of the light", share(flux / (flux + rest))))
}

#[cfg(test)]
mod tests {
    use super::{about, percent, share};

    #[test]
    fn a_share_is_said_in_two_digits() {
        let said = [0.2812, 0.0549, 0.001, 2e-5, 0.0].map(about);
        assert_eq!(said, ["28 %", "5.5 %", "0.1 %", "less than 0.1 %", "0 %"]);
    }

    #[test]
    fn a_percentage_shows_what_is_missing() {
        let cases = [
            (0.5, "50.0 %"),
            (0.973_2, "97.3 %"),
            (0.999_71, "99.971 %"),
            (1.0, "100 %"),
            (0.000_214, "0.021 %"),
            (0.123_45, "12.3 %"),
            (1.234_6, "123.5 %"),
            (1e-9, "less than 0.000001 %"),
            (0.0, "0 %"),
        ];
        for (fraction, text) in cases {
            assert_eq!(percent(fraction), text);
        }
    }

    #[test]
    fn only_the_whole_is_100_percent() {
        assert_eq!(share(0.43598), "43.6 %");
        assert_eq!(share(0.999_999_9), "over 99.999 %");
        assert_eq!(share(1.0), "100 %");
    }
}
