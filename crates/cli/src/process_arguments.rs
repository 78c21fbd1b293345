//! The arguments of this process, and what is printed if they are not valid.

use std::borrow::Cow;
use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{ArgMatches, ColorChoice, CommandFactory, Parser, ValueEnum};

use crate::arguments::{Arguments, Colour, JsonOutput};
use crate::command_error::CommandError;
use crate::escape::escaped;
use crate::exit::Exit;
use crate::{print, terminal, version};

/// The arguments of this process. A request for help, or an error, is printed and returned as an exit code.
pub(crate) fn parse() -> Result<Arguments, ExitCode> {
    let typed = env::args_os().collect::<Vec<_>>();
    Arguments::try_parse_from(&typed).map_err(|error| {
        // clap stops at the first error, but the options after it still say how to report it.
        let words = typed.iter().map(|word| word.to_string_lossy()).take_while(|word| word != "--");
        let words = words.collect::<Vec<_>>();
        colour(&words).into_iter().for_each(terminal::want_colour);
        if error.exit_code() != 0 && words.iter().any(|word| word == "--json") {
            command_error(&error).report_json(json_output(&typed));
        }
        if error.kind() == ErrorKind::DisplayVersion && words.iter().any(|word| word == "--verbose") {
            return print::data(&version::in_full()).into();
        }
        print_error(&typed, &error);
        ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(Exit::Usage as u8))
    })
}

fn colour(words: &[Cow<'_, str>]) -> Option<Colour> {
    let value = words.iter().enumerate().find_map(|(index, word)| match word.strip_prefix("--color")? {
        "" => words.get(index + 1).map(Cow::as_ref),
        value => value.strip_prefix('='),
    });
    value.and_then(|value| Colour::from_str(value, false).ok())
}

/// The form in which the command prints with `--json`.
fn json_output(typed: &[OsString]) -> JsonOutput {
    let understood = Arguments::command().ignore_errors(true).try_get_matches_from(typed).ok();
    match understood.as_ref().and_then(ArgMatches::subcommand_name) {
        Some("build" | "watch") => JsonOutput::Events,
        _ => JsonOutput::Object,
    }
}

/// clap's error without its decoration: the message, and its tips or else the usage as help.
fn command_error(error: &clap::Error) -> CommandError {
    let text = error.render().to_string();
    let mut paragraphs = text.split("\n\n").map(str::trim);
    let message = paragraphs.next().unwrap_or_default().trim_start_matches("error: ");
    let (tips, others): (Vec<_>, Vec<_>) = paragraphs.partition(|text| text.starts_with("tip: "));
    let tips = tips.iter().map(|tip| tip.trim_start_matches("tip: ")).collect::<Vec<_>>().join("; ");
    let usage = || others.into_iter().find(|text| text.starts_with("Usage: ")).map(str::to_owned);
    let help = if tips.is_empty() { usage() } else { Some(tips) };
    CommandError::usage([message.to_owned()]).with_help(help)
}

/// Prints a request for help, or an error.
fn print_error(typed: &[OsString], error: &clap::Error) {
    let choice = match terminal::requested_colour() {
        None => ColorChoice::Auto,
        Some(true) => ColorChoice::Always,
        Some(false) => ColorChoice::Never,
    };
    // clap colours what it quotes, so the arguments have to be escaped before clap sees them.
    let shown = typed.iter().map(|argument| escaped(&argument.to_string_lossy()).into_owned());
    match Arguments::command().color(choice).try_get_matches_from(shown) {
        Err(shown) if shown.kind() == error.kind() => _ = shown.print(),
        _ => print::message(error.to_string().trim_end()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_clap_is_a_message_and_help() {
        let check = |words: &[&str], message: &str, help: &str| {
            let error = Arguments::try_parse_from(words).unwrap_err();
            let expected = CommandError::usage([message.to_owned()]).with_help(Some(help));
            assert_eq!(command_error(&error), expected, "{words:?}");
        };
        let usage = "Usage: specula explain [OPTIONS] <STAGE|ITEM|FILE>";
        check(
            &["specula", "explain"],
            "the following required arguments were not provided:\n  <STAGE|ITEM|FILE>",
            &usage.replace("[OPTIONS] ", ""),
        );
        check(
            &["specula", "check", "--jso"],
            "unexpected argument '--jso' found",
            "a similar argument exists: '--json'",
        );
    }
}
