//! How long items of the sample take, and how many bytes they make.

use std::collections::HashMap;

use engine::serde_json::Value;
use engine::{Plan, serde_json};

/// The table, which says how it was made.
const TABLE: &str = include_str!("../../frozen-workers/measured.tsv");

/// An item of the sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// How long it took.
    pub milliseconds: f64,
    /// The bytes of its outputs.
    pub outputs: Vec<usize>,
}

/// The items of the sample, by kind and parameters.
#[derive(Clone, Debug, Default)]
pub struct Measured(HashMap<(String, String), Vec<Item>>);

impl Measured {
    /// The table, for the stages of this plan.
    ///
    /// # Errors
    /// If the table cannot be read.
    pub fn new(plan: &Plan) -> Result<Self, String> {
        let mut items = HashMap::<_, Vec<Item>>::new();
        for line in TABLE.lines().filter(|line| !line.starts_with('#')) {
            let wrong = || format!("measured.tsv: {line:?}");
            let columns = line.split('\t').collect::<Vec<_>>();
            let [stage, kind, milliseconds, outputs] = columns[..] else { return Err(wrong()) };
            let stage = plan.stages.iter().find(|known| known.name == stage).ok_or_else(wrong)?;
            let outputs = outputs.split(' ').map(|bytes| bytes.parse().map_err(|_| wrong()));
            let item = Item {
                milliseconds: milliseconds.parse().map_err(|_| wrong())?,
                outputs: outputs.collect::<Result<_, _>>()?,
            };
            let parameters = text_of(&stage.configured.canonical());
            items.entry((kind.to_owned(), parameters)).or_default().push(item);
        }
        Ok(Self(items))
    }

    /// One of the items of a kind with these parameters, chosen by a number.
    pub fn item(&self, kind: &str, parameters: &Value, number: u64) -> Option<&Item> {
        let items = self.0.get(&(kind.to_owned(), text_of(parameters)))?;
        items.get(usize::try_from(number % items.len() as u64).ok()?)
    }
}

/// A text that equal values have, in whatever order their entries are.
fn text_of(value: &Value) -> String {
    match value {
        Value::Object(entries) => {
            let mut entries = entries.iter().map(|(name, value)| (name, text_of(value))).collect::<Vec<_>>();
            entries.sort();
            format!("{entries:?}")
        }
        Value::Array(values) => format!("{:?}", values.iter().map(text_of).collect::<Vec<_>>()),
        other => serde_json::to_string(other).unwrap_or_default(),
    }
}
