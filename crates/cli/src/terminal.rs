//! What the terminal on standard error can show.

use std::io::IsTerminal;
use std::sync::OnceLock;

use console::Term;

use crate::arguments::Colour;

/// The columns that are filled if standard error is not a terminal.
pub(crate) const PLAIN_WIDTH: usize = 100;

/// Whether standard error is a terminal.
pub(crate) fn is_terminal() -> bool {
    std::io::stderr().is_terminal()
}

/// Whether a progress bar can move on standard error, and colours be seen: an old console of Windows shows
/// their control sequences as characters. On Windows `NO_COLOR` asks for neither.
pub(crate) fn understands_sequences() -> bool {
    is_terminal() && (cfg!(unix) || Term::stderr().features().colors_supported())
}

/// The choice of `--color`.
static COLOUR: OnceLock<Colour> = OnceLock::new();

/// Sets whether messages have colours.
pub(crate) fn want_colour(colour: Colour) {
    let _ = COLOUR.set(colour);
}

/// Whether messages have colours: as the user asks, or else on a terminal.
pub(crate) fn shows_colour() -> bool {
    requested_colour().unwrap_or_else(understands_sequences)
}

/// Whether `--color` or the environment asks for colours or for none.
pub(crate) fn requested_colour() -> Option<bool> {
    match COLOUR.get() {
        Some(Colour::Always) => Some(true),
        Some(Colour::Never) => Some(false),
        Some(Colour::Auto) | None => colour_of(|name| std::env::var(name).ok()),
    }
}

/// Whether the environment asks for colours. `NO_COLOR` (no-color.org) goes before `FORCE_COLOR`
/// (force-color.org) and `CLICOLOR_FORCE`, and these go before `CLICOLOR` (bixense.com/clicolors). An empty
/// variable says nothing.
fn colour_of(variable: impl Fn(&str) -> Option<String>) -> Option<bool> {
    let value = |name: &str| variable(name).filter(|value| !value.is_empty());
    let is_on = |value: &String| value != "0" && value != "false";
    let forced =
        || ["FORCE_COLOR", "CLICOLOR_FORCE"].into_iter().filter_map(value).any(|value| is_on(&value));
    let off = || ["FORCE_COLOR", "CLICOLOR"].into_iter().filter_map(value).any(|value| !is_on(&value));
    match value("NO_COLOR") {
        Some(_) => Some(false),
        None if forced() => Some(true),
        None => off().then_some(false),
    }
}

/// Whether lines and corners can be drawn. The reader of a pipe on Windows may take them for characters of an
/// old code page.
pub(crate) fn shows_unicode() -> bool {
    let locale =
        ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().filter_map(std::env::var_os).find(|v| !v.is_empty());
    cfg!(windows) && is_terminal()
        || locale.is_some_and(|locale| locale.to_string_lossy().to_lowercase().contains("utf"))
}

/// The columns to fill: those of the terminal, from 40 to 160, or [`PLAIN_WIDTH`].
pub(crate) fn width() -> usize {
    let size = Term::stderr().size_checked().filter(|_| is_terminal());
    size.map_or(PLAIN_WIDTH, |(_, columns)| usize::from(columns).clamp(40, 160))
}

/// The time of day where the user is: `14:03:12`.
pub(crate) fn time_of_day() -> String {
    jiff::Zoned::now().strftime("%H:%M:%S").to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_colour_goes_before_forced_colours_and_these_before_clicolor() {
        let check = |set: &[(&str, &str)], expected: Option<bool>| {
            let variable = |name: &str| {
                set.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
            };
            assert_eq!(colour_of(variable), expected, "{set:?}");
        };
        check(&[], None);
        for forcing in ["FORCE_COLOR", "CLICOLOR_FORCE"] {
            check(&[(forcing, "1")], Some(true));
            check(&[(forcing, "true"), ("CLICOLOR", "0")], Some(true));
            check(&[(forcing, "1"), ("NO_COLOR", "1")], Some(false));
            check(&[(forcing, "1"), ("NO_COLOR", "")], Some(true));
            check(&[(forcing, "")], None);
        }
        check(&[("FORCE_COLOR", "0")], Some(false));
        check(&[("FORCE_COLOR", "0"), ("CLICOLOR_FORCE", "1")], Some(true));
        check(&[("CLICOLOR_FORCE", "0")], None);
        check(&[("CLICOLOR", "0")], Some(false));
        check(&[("CLICOLOR", "1")], None);
        check(&[("NO_COLOR", "0")], Some(false));
    }
}
