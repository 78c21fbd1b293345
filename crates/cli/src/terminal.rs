//! What the terminal on standard error can show.

use std::io::IsTerminal;
use std::sync::OnceLock;

use console::Term;

use crate::arguments::Colour;

/// The columns that are filled if standard error is not a terminal.
pub(crate) const PLAIN_WIDTH: usize = 100;

/// Whether standard error is a terminal, so that a progress bar can move there.
pub(crate) fn is_terminal() -> bool {
    std::io::stderr().is_terminal()
}

/// What `--color` says.
static COLOUR: OnceLock<Colour> = OnceLock::new();

/// Sets whether messages have colours.
pub(crate) fn want_colour(colour: Colour) {
    let _ = COLOUR.set(colour);
}

/// Whether messages have colours: as `--color` says, or on a terminal, unless `NO_COLOR` is set.
pub(crate) fn shows_colour() -> bool {
    match COLOUR.get() {
        Some(Colour::Always) => return true,
        Some(Colour::Never) => return false,
        Some(Colour::Auto) | None => {}
    }
    is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// Whether lines and corners can be drawn.
pub(crate) fn shows_unicode() -> bool {
    let locale =
        ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().filter_map(std::env::var_os).find(|v| !v.is_empty());
    cfg!(windows) || locale.is_some_and(|locale| locale.to_string_lossy().to_lowercase().contains("utf"))
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
