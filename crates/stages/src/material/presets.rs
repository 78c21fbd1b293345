//! Presets: materials by name, whose colours were measured.
//!
//! Each is the text of a material file, which says where its numbers come from. The colours are linear sRGB.
//! A test computes those of metals from their n and k, and the others from measured reflectances.

use engine::{Document, Table, nearest};

/// A material by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// The name in material files, manifests and commands.
    pub name: &'static str,
    /// The text of its material file, which begins with a comment.
    pub text: &'static str,
}

macro_rules! presets {
    ($($name:literal),* $(,)?) => {
        &[$(Preset { name: $name, text: include_str!(concat!("presets/", $name, ".toml")) }),*]
    };
}

/// Every preset: metals, plastics, cloths, paints and others.
pub const PRESETS: &[Preset] = presets![
    "aluminium",
    "brass",
    "chromium",
    "copper",
    "gold",
    "iron",
    "silver",
    "titanium",
    "polystyrene",
    "rubber",
    "white-pvc",
    "blue-nylon",
    "burlap",
    "cotton",
    "red-nylon",
    "blue-paint",
    "red-paint",
    "white-paint",
    "concrete",
    "snow",
];

impl Preset {
    /// The preset of a name.
    ///
    /// # Errors
    /// If there is none: a message that names those with a similar name, or all of them.
    pub fn named(name: &str) -> Result<&'static Self, String> {
        let found = PRESETS.iter().find(|preset| preset.name == name);
        found.ok_or_else(|| {
            let names = || PRESETS.iter().map(|preset| preset.name);
            let word = name.to_lowercase().replace([' ', '_'], "-");
            // Part of a name is not similar to it as a whole.
            let near: Vec<_> = names().filter(|known| known.split('-').any(|part| part == word)).collect();
            let near = if near.is_empty() { nearest(&word, names()).into_iter().collect() } else { near };
            let near: Vec<_> = near.into_iter().map(|near| format!("{near:?}")).collect();
            match &near[..] {
                [] => {
                    let all = names().collect::<Vec<_>>().join(", ");
                    format!("there is no preset {name:?}; the presets are {all}")
                }
                near => format!("there is no preset {name:?}; did you mean {}?", near.join(" or ")),
            }
        })
    }

    /// What it is, in a few words: `Copper, satin: a metal`.
    pub fn summary(&self) -> &'static str {
        self.text.lines().next().unwrap_or_default().trim_start_matches(['#', ' ']).trim_end_matches('.')
    }

    /// The keys of its material file.
    fn table(&self) -> Option<Table> {
        Document::parse(self.name, self.text.as_bytes()).ok().map(|document| document.table)
    }

    /// A table of a material file that names the preset: the preset's keys, replaced by those of the table.
    pub(crate) fn with(&self, table: &Table) -> Option<Table> {
        let own = |key: &str| table.entries.iter().any(|entry| entry.key == key);
        let mut entries = self.table()?.entries;
        entries.retain(|entry| !own(&entry.key));
        entries.extend(table.entries.iter().filter(|entry| entry.key != KEY).cloned());
        Some(Table { span: table.span.clone(), entries })
    }
}

/// The key of a material file that names a preset.
pub(crate) const KEY: &str = "material";

#[cfg(test)]
mod tests;
