//! Formats shares of energy and relative errors, and reports what is lost.

use engine::Reporter;
use sh::Light;

/// The share of the light above which a loss is a warning.
pub(crate) const LOSS: f64 = 0.01;

/// Notes what a result loses; above [`LOSS`] it is a warning, with what helps.
pub(crate) fn report_loss(reporter: &Reporter, lost: f64, what: &str, help: &str) {
    if lost > LOSS {
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

/// Writes a share with three decimals, rounded down so that only the whole is 100 %: `98.765 %`.
pub(crate) fn share(part: f64) -> String {
    format!("{} %", (part * 1e5).floor() / 1e3)
}

/// Writes two digits of an error: `0.012 %`.
pub(crate) fn percent(error: f64) -> String {
    if error == 0.0 {
        return "0 %".into();
    }
    if error < 1e-8 {
        return "less than 0.000001 %".into();
    }
    let digits = (1.0 - math::log10((100.0 * error).max(1e-9)).floor()).clamp(0.0, 6.0) as usize;
    format!("{:.digits$} %", 100.0 * error)
}

/// `2 lamps hold 75.1 % of the light, beside the series`; `rest` is the integral of what is not theirs, over
/// the sphere and all channels.
pub(crate) fn lamps_text(lights: &[Light], rest: f64) -> Option<String> {
    let flux: f64 = lights.iter().flat_map(Light::flux).sum();
    let count = match lights.len() {
        0 => return None,
        1 => "1 lamp holds".to_owned(),
        count => format!("{count} lamps hold"),
    };
    Some(format!("{count} {} of the light, beside the series", share(flux / (flux + rest))))
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
    fn an_error_has_two_digits() {
        assert_eq!(percent(0.12345), "12 %");
        assert_eq!(percent(0.000_123_45), "0.012 %");
        assert_eq!(percent(1.2345), "123 %");
        assert_eq!(percent(0.0), "0 %");
        assert_eq!(percent(1e-9), "less than 0.000001 %");
    }

    #[test]
    fn only_the_whole_is_100_percent() {
        assert_eq!(share(0.98765432), "98.765 %");
        assert_eq!(share(0.999_999_9), "99.999 %");
        assert_eq!(share(1.0), "100 %");
    }
}
