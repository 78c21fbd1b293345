//! Edits of a manifest's text.

use engine::{Document, Entry, Table, Value, ValueKind};

use crate::values::{TomlText, is_integer, table_of, toml_text};

/// A value as it is written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Written {
    /// The name of a stage or a kind.
    Text(String),
    Number(f64),
    Numbers([f64; 4]),
}

/// A change of a manifest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ManifestEdit {
    /// Sets a key of a stage. If the stage lacks it, it is added after the others.
    Set { stage: String, key: &'static str, value: Written },
    /// Connects a port of a stage to another stage.
    Connect { stage: String, port: String, to: String },
    /// Adds a stage behind another, in the notation of that one.
    Add { behind: String, stage: String, entries: Vec<(&'static str, Written)> },
}

/// The keys that connect the first port of a stage, and ports by name.
const SHORT: &str = "input";
const LONG: &str = "inputs";

/// A manifest with these changes.
///
/// # Errors
/// If the manifest is not valid TOML, or written in a way that cannot be edited. One line.
pub(crate) fn edited(file: &str, text: &str, edits: &[ManifestEdit]) -> Result<String, String> {
    let (mark, body) = text.split_at(if text.starts_with('\u{feff}') { 3 } else { 0 });
    let parse = |text: &str| {
        let parsed = Document::parse(file, text.as_bytes());
        parsed.map_err(|errors| errors.to_string().lines().next().unwrap_or_default().to_owned())
    };
    let cannot = || format!("{file} is written in a way that cannot be edited here");
    let mut text = body.to_owned();
    let mut expected = parse(body)?.table;
    for edit in edits {
        let table = parse(&text)?.table;
        text = Text { text: TomlText(&text), table: &table }.edited(edit).ok_or_else(cannot)?;
        expect(&mut expected, edit).ok_or_else(cannot)?;
    }
    match parse(&text) {
        Ok(document) if document.table.text() == expected.text() => Ok(format!("{mark}{text}")),
        _ => Err(cannot()),
    }
}

/// Makes a change in the content of a manifest, to compare it with that of the edited text.
fn expect(manifest: &mut Table, edit: &ManifestEdit) -> Option<()> {
    let stages = entries_of(&mut manifest.entries, "stage")?;
    match edit {
        ManifestEdit::Set { stage, key, value } => {
            let table = entries_of(stages, stage)?;
            match table.iter_mut().find(|entry| entry.key == *key) {
                Some(entry) => entry.value = value.content(is_integer(&entry.value))?,
                None => table.push(entry(key, value.content(false)?)),
            }
        }
        ManifestEdit::Connect { stage, port, to } => {
            let table = entries_of(stages, stage)?;
            let short = table.iter().position(|entry| entry.key == SHORT);
            let connected = match short {
                Some(short) => &mut table[short],
                None => entries_of(table, LONG)?.iter_mut().find(|entry| entry.key == *port)?,
            };
            connected.value = Written::Text(to.clone()).content(false)?;
        }
        ManifestEdit::Add { stage, entries, .. } => {
            let entries = entries.iter().map(|(key, value)| Some(entry(key, value.content(false)?)));
            let kind = ValueKind::Table(Table { span: 0..0, entries: entries.collect::<Option<_>>()? });
            stages.push(entry(stage, Value { span: 0..0, kind }));
        }
    }
    Some(())
}

fn entry(key: &str, value: Value) -> Entry {
    Entry { key: key.into(), key_span: 0..0, value }
}

/// The entries of a table among others.
fn entries_of<'e>(entries: &'e mut [Entry], name: &str) -> Option<&'e mut Vec<Entry>> {
    match &mut entries.iter_mut().find(|entry| entry.key == name)?.value.kind {
        ValueKind::Table(table) => Some(&mut table.entries),
        _ => None,
    }
}

impl Written {
    /// The value as TOML. A whole number in place of a whole one stays without a point.
    pub(crate) fn toml(&self, in_place_of_integer: bool) -> String {
        match self {
            Self::Text(text) => format!("{text:?}"),
            Self::Number(number) => toml_text::number(*number, in_place_of_integer),
            Self::Numbers(numbers) => format!("{numbers:?}"),
        }
    }

    fn content(&self, in_place_of_integer: bool) -> Option<Value> {
        let table = Table::parse(&format!("value = {}", self.toml(in_place_of_integer))).ok()?;
        Some(table.entries.into_iter().next()?.value)
    }
}

/// The text of a manifest, and its content, whose spans refer to the text.
struct Text<'t> {
    text: TomlText<'t>,
    table: &'t Table,
}

impl Text<'_> {
    fn edited(&self, edit: &ManifestEdit) -> Option<String> {
        match edit {
            ManifestEdit::Set { stage, key, value } => self.set(stage, key, value),
            ManifestEdit::Connect { stage, port, to } => self.connect(stage, port, to),
            ManifestEdit::Add { behind, stage, entries } => self.add(behind, stage, entries),
        }
    }

    fn set(&self, stage: &str, key: &str, value: &Written) -> Option<String> {
        let stages = table_of(&self.table.get("stage")?.value)?;
        let table = table_of(&self.stage(stage)?.value)?;
        if let Some(entry) = table.get(key) {
            return Some(self.text.replaced(entry.value.span.clone(), &value.toml(is_integer(&entry.value))));
        }
        let is_inline = [stages, table].into_iter().any(|table| self.text.is_inline(table));
        self.text.with_entry(table, is_inline, key, &value.toml(false))
    }

    fn connect(&self, stage: &str, port: &str, to: &str) -> Option<String> {
        let table = table_of(&self.stage(stage)?.value)?;
        let connected = match table.get(SHORT) {
            Some(short) => short,
            None => table_of(&table.get(LONG)?.value)?.get(port)?,
        };
        let span = connected.value.span.clone();
        let is_literal = self.text.0[span.clone()].starts_with('\'');
        let new = if is_literal { format!("'{to}'") } else { Written::Text(to.into()).toml(false) };
        Some(self.text.replaced(span, &new))
    }

    fn add(&self, behind: &str, stage: &str, entries: &[(&'static str, Written)]) -> Option<String> {
        let at = self.stage(behind)?;
        let kind = table_of(&at.value)?.get("kind")?;
        let lines = entries.iter().map(|(key, value)| format!("{key} = {}", value.toml(false)));
        let lines = lines.collect::<Vec<_>>();
        let inline = format!("{stage} = {{ {} }}", lines.join(", "));
        let text = &self.text;
        if text.is_inline(table_of(&self.table.get("stage")?.value)?) {
            return Some(text.inserted(at.value.span.end, &format!(", {inline}")));
        }
        if text.is_inline(table_of(&at.value)?) {
            return Some(text.with_lines(at.value.span.end, &format!("{}{inline}", text.before(at))));
        }
        let indent = text.before(kind);
        if !indent.trim().is_empty() {
            // Its lines are `stage.lighting.kind = ...`, or the same without `stage.` under a header.
            return Some(text.with_lines(last_place(&at.value), &format!("{}{inline}", text.before(at))));
        }
        let end = text.with_comments(last_place(&at.value));
        let body = lines.iter().map(|line| format!("\n{indent}{line}")).collect::<String>();
        let header = text.indent_of_header(kind.key_span.start);
        Some(text.with_lines(end, &format!("\n{header}[stage.{stage}]{body}")))
    }

    fn stage(&self, name: &str) -> Option<&Entry> {
        table_of(&self.table.get("stage")?.value)?.get(name)
    }
}

/// The place where the last value in a table ends.
fn last_place(value: &Value) -> usize {
    match &value.kind {
        ValueKind::Table(table) => table.entries.iter().map(|entry| last_place(&entry.value)).max(),
        _ => None,
    }
    .unwrap_or(value.span.end)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(stage: &str, key: &'static str, value: Written) -> ManifestEdit {
        ManifestEdit::Set { stage: stage.into(), key, value }
    }

    fn yaw(degrees: f64) -> ManifestEdit {
        set("turned", "yaw", Written::Number(degrees))
    }

    /// A stage that turns `lighting`, which `reflection` reads in its place.
    fn turned() -> [ManifestEdit; 2] {
        let entries = vec![
            ("kind", Written::Text("rotate".into())),
            ("input", Written::Text("lighting".into())),
            ("yaw", Written::Number(45.0)),
        ];
        let (behind, stage) = ("lighting".into(), "lighting-turned".into());
        [
            ManifestEdit::Add { behind, stage, entries },
            ManifestEdit::Connect {
                stage: "reflection".into(),
                port: "lighting".into(),
                to: "lighting-turned".into(),
            },
        ]
    }

    #[track_caller]
    fn check(before: &str, edits: &[ManifestEdit], after: &str) {
        for mark in ["", "\u{feff}"] {
            for newline in ["\n", "\r\n"] {
                let in_file = |text: &str| format!("{mark}{}", text.replace('\n', newline));
                let found = edited("pipeline.toml", &in_file(before), edits).unwrap();
                assert_eq!(found, in_file(after), "{found}");
                // The same again changes nothing.
                let others = edits.iter().filter(|edit| !matches!(edit, ManifestEdit::Add { .. })).cloned();
                let again = edited("pipeline.toml", &found, &others.collect::<Vec<_>>()).unwrap();
                assert_eq!(again, found);
            }
        }
    }

    #[test]
    fn an_angle_is_replaced_in_place() {
        for (before, after) in [
            (
                "# Light.\n\n[stage.turned]   # a set\nkind='rotate'\n  yaw   =   30 # degrees\ninput = \"l\"\n",
                "75",
            ),
            ("[stage]\nturned = { kind = \"rotate\", yaw = 30, input = \"l\" } # a set\n", "75"),
            ("stage.turned.kind = \"rotate\"\nstage.turned.yaw = 30\nstage.turned.input = \"l\"", "75"),
            ("stage = { turned = { yaw = 30 } }", "75"),
            ("stage = { turned.kind = \"rotate\", turned.yaw = 30, x.kind = \"y\" }", "75"),
            ("[ stage . \"turned\" ]\n\n\nyaw=+30\n\n# the end", "75"),
        ] {
            check(before, &[yaw(75.0)], &before.replace("+30", after).replace("30", after));
            check(before, &[yaw(-7.25)], &before.replace("+30", "-7.25").replace("30", "-7.25"));
        }
        check("[stage.turned]\nyaw = 30.0\n", &[yaw(75.0)], "[stage.turned]\nyaw = 75.0\n");
        let quaternion = set("turned", "quaternion", Written::Numbers([0.0, 0.0, 0.6, 0.8]));
        check(
            "[stage.turned]\nquaternion = [0, 0, # up\n  1, 0]\n",
            &[quaternion],
            "[stage.turned]\nquaternion = [0.0, 0.0, 0.6, 0.8]\n",
        );
    }

    #[test]
    fn an_angle_that_is_not_there_is_added_in_the_notation_of_the_stage() {
        for (before, after) in [
            (
                "[stage.turned]\nkind = \"rotate\" # a set\ninput = \"l\" # light\n\n# Next.\n[stage.x]\nkind = \"y\"\n",
                "[stage.turned]\nkind = \"rotate\" # a set\ninput = \"l\" # light\nyaw = 75.0\n\n# Next.\n[stage.x]\nkind = \"y\"\n",
            ),
            ("[stage.turned]\n  kind = \"rotate\"", "[stage.turned]\n  kind = \"rotate\"\n  yaw = 75.0"),
            (
                "[stage.turned]\nkind = \"rotate\"\n[stage.turned.inputs]\nlighting = \"l\"\n",
                "[stage.turned]\nkind = \"rotate\"\nyaw = 75.0\n[stage.turned.inputs]\nlighting = \"l\"\n",
            ),
            (
                "[stage]\nturned = { kind = \"rotate\", input = \"l\" } # a set\n",
                "[stage]\nturned = { kind = \"rotate\", input = \"l\", yaw = 75.0 } # a set\n",
            ),
            (
                "stage = { x.kind = \"y\", turned.kind = \"rotate\", z.kind = \"y\" }",
                "stage = { x.kind = \"y\", turned.kind = \"rotate\", turned.yaw = 75.0, z.kind = \"y\" }",
            ),
            (
                "[stage]\nturned.kind = \"rotate\"\nturned.input = \"l\"\n\nx.kind = \"y\"\n",
                "[stage]\nturned.kind = \"rotate\"\nturned.input = \"l\"\nturned.yaw = 75.0\n\nx.kind = \"y\"\n",
            ),
            (
                "stage.turned.kind = \"rotate\"\nout = \"x\"\n",
                "stage.turned.kind = \"rotate\"\nstage.turned.yaw = 75.0\nout = \"x\"\n",
            ),
        ] {
            check(before, &[yaw(75.0)], after);
        }
    }

    #[test]
    fn a_stage_is_added_behind_another_in_its_notation_and_read_in_its_place() {
        for (before, after) in [
            (
                "[stage.lighting]   # light\nkind = \"project-sh\"\ninput = \"environment\"  # suns\n# degree = 3\n\n\n# Next.\n[stage.reflection]\ninputs = { lighting = \"lighting\", brdf = \"b\" } # both\n",
                "[stage.lighting]   # light\nkind = \"project-sh\"\ninput = \"environment\"  # suns\n# degree = 3\n\n[stage.lighting-turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 45.0\n\n\n# Next.\n[stage.reflection]\ninputs = { lighting = \"lighting-turned\", brdf = \"b\" } # both\n",
            ),
            (
                "[stage.lighting]\nkind = \"project-sh\"\n[stage.reflection]\ninput = \"lighting\"",
                "[stage.lighting]\nkind = \"project-sh\"\n\n[stage.lighting-turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 45.0\n[stage.reflection]\ninput = \"lighting-turned\"",
            ),
            (
                "[stage.reflection.inputs]\nlighting = 'lighting'\n[stage.lighting]\nkind = \"project-sh\"",
                "[stage.reflection.inputs]\nlighting = 'lighting-turned'\n[stage.lighting]\nkind = \"project-sh\"\n\n[stage.lighting-turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 45.0",
            ),
            (
                "[stage.lighting]\nkind = \"project-sh\"\n# Both.\n[stage.reflection]\ninputs.lighting = \"lighting\"\n",
                "[stage.lighting]\nkind = \"project-sh\"\n\n[stage.lighting-turned]\nkind = \"rotate\"\ninput = \"lighting\"\nyaw = 45.0\n# Both.\n[stage.reflection]\ninputs.lighting = \"lighting-turned\"\n",
            ),
            (
                "  [stage.lighting]\n    kind = \"project-sh\"\n    [stage.lighting.inputs]\n      environment = \"e\"\n  [stage.reflection]\n    inputs = { lighting = \"lighting\" }\n",
                "  [stage.lighting]\n    kind = \"project-sh\"\n    [stage.lighting.inputs]\n      environment = \"e\"\n\n  [stage.lighting-turned]\n    kind = \"rotate\"\n    input = \"lighting\"\n    yaw = 45.0\n  [stage.reflection]\n    inputs = { lighting = \"lighting-turned\" }\n",
            ),
            (
                "[stage]\nlighting = { kind = \"project-sh\" } # light\nreflection = { inputs = { lighting = \"lighting\" } }\n",
                "[stage]\nlighting = { kind = \"project-sh\" } # light\nlighting-turned = { kind = \"rotate\", input = \"lighting\", yaw = 45.0 }\nreflection = { inputs = { lighting = \"lighting-turned\" } }\n",
            ),
            (
                "stage.lighting.kind = \"project-sh\"\nstage.lighting.degree = 3\nstage.reflection.inputs.lighting = \"lighting\"\n",
                "stage.lighting.kind = \"project-sh\"\nstage.lighting.degree = 3\nstage.lighting-turned = { kind = \"rotate\", input = \"lighting\", yaw = 45.0 }\nstage.reflection.inputs.lighting = \"lighting-turned\"\n",
            ),
            (
                "stage = { lighting = { kind = \"project-sh\" }, reflection = { inputs = { lighting = \"lighting\" } } }\n",
                "stage = { lighting = { kind = \"project-sh\" }, lighting-turned = { kind = \"rotate\", input = \"lighting\", yaw = 45.0 }, reflection = { inputs = { lighting = \"lighting-turned\" } } }\n",
            ),
        ] {
            check(before, &turned(), after);
        }
    }

    #[test]
    fn what_cannot_be_edited_is_refused() {
        let refused = |text: &str| edited("pipeline.toml", text, &[yaw(1.0)]).unwrap_err();
        assert!(
            refused("[stage.turned]\nyaw = \n").starts_with("pipeline.toml:2:"),
            "{}",
            refused("yaw = \n")
        );
        assert_eq!(refused("schema = 1\n"), "pipeline.toml is written in a way that cannot be edited here");
    }
}
