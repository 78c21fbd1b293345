//! The report for CI servers: JUnit XML, as Jenkins and GitLab read it.
//!
//! XML 1.0 has no form for most control characters, so that they are shown as they are in messages
//! (`escape.rs`).

use std::fmt::Write;

use super::timeline::{ItemOutcome, Nanoseconds, Timeline};
use crate::command_error::CommandError;
use crate::escape::escaped;

/// The report of a build: a test case for each item that was selected, and one for the reason why the build
/// could not begin or continue.
pub(super) fn report(manifest: &str, timeline: Option<&Timeline>, error: Option<&CommandError>) -> String {
    let (mut tests, mut failures, mut skipped) = (0, 0, 0);
    let mut cases = String::new();
    let mut case = |stage: &str, name: &str, time: Nanoseconds, outcome: &Outcome<'_>| {
        tests += 1;
        match outcome {
            Outcome::Passed(_) => {}
            Outcome::Failed { .. } => failures += 1,
            Outcome::Skipped(_) => skipped += 1,
        }
        let (stage, name) = (attribute(stage), attribute(name));
        let time = seconds(time);
        let _ = write!(cases, "<testcase classname=\"{stage}\" name=\"{name}\" time=\"{time}\"");
        cases += &match outcome {
            Outcome::Passed(None) => "/>\n".to_owned(),
            Outcome::Passed(Some(note)) => format!("><system-out>{note}</system-out></testcase>\n"),
            Outcome::Failed { error, hint } => {
                let summary = attribute(error.lines().next().unwrap_or_default());
                let hint = hint.map_or_else(String::new, |hint| format!("\nhint: {hint}"));
                let text = text(&format!("{error}{hint}"));
                format!(">\n<failure message=\"{summary}\">{text}</failure>\n</testcase>\n")
            }
            Outcome::Skipped(why) => format!("><skipped message=\"{}\"/></testcase>\n", attribute(why)),
        };
    };
    if let Some(timeline) = timeline {
        let costs = timeline.costs();
        for ((node, outcome), cost) in timeline.nodes.iter().zip(&timeline.outcomes).zip(costs) {
            let outcome = match outcome {
                ItemOutcome::NotReached => continue,
                ItemOutcome::UpToDate(_) => Outcome::Passed(Some("up to date")),
                ItemOutcome::Ran { .. } => Outcome::Passed(None),
                ItemOutcome::Failed { error, hint } => Outcome::Failed { error, hint: hint.as_deref() },
                ItemOutcome::Skipped(Some(failed)) => Outcome::Skipped(format!("{failed} failed")),
                ItemOutcome::Skipped(None) => Outcome::Skipped("the build was stopped".into()),
            };
            case(&node.stage, &node.name, cost, &outcome);
        }
    }
    if let Some(error) = error {
        let outcome = Outcome::Failed { error: &error.in_full(), hint: error.help() };
        case("build", manifest, 0, &outcome);
    }
    let time = seconds(timeline.map_or(0, Timeline::total));
    let counts = format!("tests=\"{tests}\" failures=\"{failures}\" errors=\"0\"");
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {counts} time=\"{time}\">\n\
         <testsuite name=\"{}\" {counts} skipped=\"{skipped}\" time=\"{time}\">\n{cases}</testsuite>\n\
         </testsuites>\n",
        attribute(manifest),
    )
}

/// What a test case says.
enum Outcome<'a> {
    Passed(Option<&'static str>),
    Failed { error: &'a str, hint: Option<&'a str> },
    Skipped(String),
}

fn seconds(time: Nanoseconds) -> String {
    format!("{:.3}", time as f64 / 1e9)
}

/// A text between tags.
fn text(text: &str) -> String {
    let mut xml = String::with_capacity(text.len());
    for character in escaped(text).chars() {
        match character {
            '&' => xml += "&amp;",
            '<' => xml += "&lt;",
            '>' => xml += "&gt;",
            '"' => xml += "&quot;",
            // The last that XML has no form for.
            '\u{fffe}' | '\u{ffff}' => xml.extend(character.escape_unicode()),
            other => xml.push(other),
        }
    }
    xml
}

/// The value of an attribute, in which readers turn line breaks and tabs into spaces unless they are written
/// as numbers.
fn attribute(value: &str) -> String {
    text(value).replace('\n', "&#10;").replace('\t', "&#9;")
}
