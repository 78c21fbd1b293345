//! A command line with placeholders, which is parsed with the manifest.

use std::collections::HashSet;

use engine::{Diagnostic, Diagnostics, Parameter, Value, ValueKind, nearest, unexpected};

/// A program and its arguments.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Command(Vec<Argument>);

/// An argument as written, and its pieces.
#[derive(Clone, Debug, PartialEq)]
struct Argument {
    text: String,
    pieces: Vec<Piece>,
}

/// A part of an argument.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Piece {
    /// Literal text.
    Text(String),
    /// The file of an input port.
    Input(String),
    /// The output's file.
    Output,
    /// The manifest's folder.
    Folder,
}

impl Command {
    /// The pieces of the program.
    pub(crate) fn program(&self) -> &[Piece] {
        self.0.first().map_or(&[], |argument| &argument.pieces)
    }

    /// The pieces of each argument.
    pub(crate) fn arguments(&self) -> impl Iterator<Item = &[Piece]> {
        self.0.iter().skip(1).map(|argument| argument.pieces.as_slice())
    }

    /// Each argument for messages, and its pieces.
    pub(crate) fn shown_arguments(&self) -> impl Iterator<Item = (String, &[Piece])> {
        self.0.iter().skip(1).map(|argument| (shown(&argument.text), argument.pieces.as_slice()))
    }

    /// The ports that the arguments name, each once.
    pub(crate) fn inputs(&self) -> Vec<&str> {
        let mut seen = HashSet::new();
        let pieces = self.0.iter().flat_map(|argument| &argument.pieces);
        let names = pieces.filter_map(|piece| match piece {
            Piece::Input(name) => Some(name.as_str()),
            _ => None,
        });
        names.filter(|name| seen.insert(*name)).collect()
    }

    /// The command for messages: its beginning, on one line.
    pub(crate) fn name(&self) -> String {
        let texts: Vec<_> = self.0.iter().map(|argument| argument.text.as_str()).collect();
        format!("`{}`", shown(&texts.join(" ")))
    }

    /// The mismatches between the placeholders and the ports that are connected.
    pub(crate) fn mismatches(&self, ports: &[&str]) -> Vec<String> {
        /// The maximum number of ports that are named.
        const NAMED: usize = 8;
        let there = match ports {
            [] => "the stage has no inputs".to_owned(),
            _ if ports.len() <= NAMED => format!("inputs has {}", ports.join(", ")),
            _ => format!("inputs has {} and {} more", ports[..NAMED].join(", "), ports.len() - NAMED),
        };
        let used = self.inputs();
        let [is_used, is_port] = [&used, ports].map(|names| names.iter().copied().collect::<HashSet<_>>());
        let written = |port: &str| match port {
            "input" => "{input}".to_owned(),
            _ => format!("{{input.{port}}}"),
        };
        let unknown = used.iter().filter(|name| !is_port.contains(*name)).enumerate().map(|(index, name)| {
            // Further ports are not listed.
            let ports = if index < Diagnostics::SHOWN { ports } else { &[] };
            let near = nearest(name, ports.iter().copied());
            let near = near.map_or_else(String::new, |near| format!("; did you mean {}?", written(near)));
            format!("{} is not an input of the stage: {there}{near}", written(name))
        });
        let unused = ports
            .iter()
            .filter(|port| !is_used.contains(*port))
            .map(|port| format!("the input {port:?} is not used: expected {} in an argument", written(port)));
        unknown.chain(unused).collect()
    }
}

impl Parameter for Command {
    fn expected() -> String {
        "an array of strings: the program and its arguments, one of them with {output}".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let error = |value: &Value, message: String| Diagnostic::at(value.span.clone(), message);
        let ValueKind::Array(values) = &value.kind else { return Err(unexpected(value, &Self::expected())) };
        let mut arguments = Vec::new();
        for value in values {
            let ValueKind::String(text) = &value.kind else { return Err(unexpected(value, "a string")) };
            let pieces = pieces(text).map_err(|(message, help)| error(value, message).help(help))?;
            arguments.push(Argument { text: text.clone(), pieces });
        }
        let Some((program, rest)) = arguments.split_first() else {
            return Err(
                error(value, "there is no program".into()).expected(format!("expected {}", Self::expected()))
            );
        };
        if program.text.trim().is_empty()
            || program.pieces.iter().any(|piece| !matches!(piece, Piece::Text(_) | Piece::Folder))
        {
            return Err(error(&values[0], format!("{:?} is not a program", program.text))
                .expected("expected the name of a program in PATH or a path of one"));
        }
        if !rest.iter().any(|argument| argument.pieces.contains(&Piece::Output)) {
            return Err(error(value, "no argument is \"{output}\"".into())
                .expected("expected \"{output}\", the file that the program writes")
                .help(
                    "for a program that writes to standard output: [\"sh\", \"-c\", \"PROGRAM > {output}\"]",
                ));
        }
        Ok(Self(arguments))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(|argument| argument.text.as_str()).collect()
    }

    fn schema() -> serde_json::Value {
        serde_json::json!({
            "type": "array",
            "items": { "type": "string" },
            "minItems": 2,
            "contains": { "pattern": "\\{output\\}" },
        })
    }
}

/// The beginning of a text, on one line: a script in an argument is not shown in full.
fn shown(text: &str) -> String {
    const MAX_SHOWN: usize = 80;
    let text = text.replace(char::is_control, " ");
    match text.char_indices().nth(MAX_SHOWN) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

/// Whether a port may have this name, which becomes the name of a file.
pub(super) fn is_word(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    !name.is_empty() && name.len() <= 64 && name.chars().all(plain)
}

/// The pieces of an argument, or the error and a hint.
pub(super) fn pieces(text: &str) -> Result<Vec<Piece>, (String, String)> {
    let braces = || "write {{ or }} for a literal brace".to_owned();
    if text.contains('\0') {
        return Err(("an argument cannot hold a NUL".into(), "remove it".into()));
    }
    let mut pieces = Vec::new();
    let mut plain = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(['{', '}']) {
        plain += &rest[..at];
        let brace = &rest[at..at + 1];
        rest = &rest[at + 1..];
        if rest.starts_with(brace) {
            plain += brace;
            rest = &rest[1..];
            continue;
        }
        let Some((name, after)) = (brace == "{").then(|| rest.split_once('}')).flatten() else {
            return Err((format!("{brace:?} has no matching brace"), braces()));
        };
        let piece = match name {
            "output" => Piece::Output,
            "folder" => Piece::Folder,
            "input" => Piece::Input(name.into()),
            _ => match name.strip_prefix("input.") {
                Some(port) if is_word(port) => Piece::Input(port.into()),
                _ => {
                    let near = nearest(name, ["output", "folder", "input"]);
                    let near = near.map(|near| format!("did you mean {{{near}}}?"));
                    let message =
                        format!("{{{name}}} is not {{input.NAME}}, {{input}}, {{output}} or {{folder}}");
                    return Err((message, near.unwrap_or_else(braces)));
                }
            },
        };
        if !plain.is_empty() {
            pieces.push(Piece::Text(std::mem::take(&mut plain)));
        }
        pieces.push(piece);
        rest = after;
    }
    plain += rest;
    if !plain.is_empty() || pieces.is_empty() {
        pieces.push(Piece::Text(plain));
    }
    Ok(pieces)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(words: &[&str]) -> Result<Command, Diagnostic> {
        let value = |kind| Value { span: 0..1, kind };
        let words = words.iter().map(|word| value(ValueKind::String((*word).into()))).collect();
        Command::parse(&value(ValueKind::Array(words)))
    }

    #[test]
    fn arguments_are_split_into_pieces() {
        let text = |text: &str| Piece::Text(text.into());
        assert_eq!(pieces("a{{b}}c"), Ok(vec![text("a{b}c")]));
        assert_eq!(pieces("{output}"), Ok(vec![Piece::Output]));
        assert_eq!(
            pieces("--in={input.sky}:{input}:{folder}/x"),
            Ok(vec![
                text("--in="),
                Piece::Input("sky".into()),
                text(":"),
                Piece::Input("input".into()),
                text(":"),
                Piece::Folder,
                text("/x")
            ])
        );
        assert_eq!(pieces(""), Ok(vec![text("")]));
        for bad in ["{outptu}", "{", "}", "a}b", "{output", "{input.}", "{input.a/b}", "{}", "a\0"] {
            assert!(pieces(bad).is_err(), "{bad:?}");
        }
        assert_eq!(pieces("{outptu}").unwrap_err().1, "did you mean {output}?");
    }

    #[test]
    fn a_command_has_a_program_and_an_output() {
        assert!(parse(&["tool", "{output}"]).is_ok());
        for bad in [&[][..], &["tool"], &["{output}"], &["", "{output}"], &["{input}", "{output}"]] {
            assert!(parse(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn placeholders_and_ports_agree() {
        let command = parse(&["tool", "{input.sky}", "{input.sky}", "{output}"]).unwrap();
        assert_eq!(command.mismatches(&["sky"]), Vec::<String>::new());
        let errors = command.mismatches(&["sly"]);
        assert!(errors[0].contains("did you mean {input.sly}?"), "{errors:?}");
        assert!(errors[1].contains("\"sly\" is not used"), "{errors:?}");
        assert!(command.mismatches(&[])[0].contains("no inputs"));
    }
}
