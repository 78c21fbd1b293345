//! What a build is asked for: stages and items by name, and all that they need.

use super::{Item, ItemIndex, Plan, StageIndex};
use crate::error::{Error, ErrorKind};
use crate::manifest::nearest;

/// The items that a build makes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Selection {
    items: Vec<bool>,
    /// The stages that are selected as a whole, even if they have no items.
    stages: Vec<bool>,
    /// The items that run even if they are up to date; empty if none do.
    forced: Vec<bool>,
}

impl Selection {
    pub(crate) fn all(plan: &Plan) -> Self {
        Self {
            items: vec![true; plan.items.len()],
            stages: vec![true; plan.stages.len()],
            forced: Vec::new(),
        }
    }

    /// The stages and the items with these names, and all that they need; no names mean everything.
    pub(crate) fn of(plan: &Plan, names: &[String]) -> Result<Self, Error> {
        if names.is_empty() {
            return Ok(Self::all(plan));
        }
        let mut selected = Self::named(plan, names)?;
        // Stages come after those that they need, and so do items.
        for stage in (0..plan.stages.len()).rev() {
            if selected.stages[stage] {
                plan.stages[stage].inputs.iter().for_each(|(_, from)| selected.stages[*from] = true);
            }
        }
        for (index, item) in plan.items.iter().enumerate().rev() {
            selected.items[index] |= selected.stages[item.stage];
            if selected.items[index] {
                item.inputs.iter().flatten().for_each(|input| selected.items[*input] = true);
            }
        }
        Ok(selected)
    }

    /// The stages and items with these names, without what they need.
    fn named(plan: &Plan, names: &[String]) -> Result<Self, Error> {
        let (items, stages) = (vec![false; plan.items.len()], vec![false; plan.stages.len()]);
        let mut selected = Self { items, stages, forced: Vec::new() };
        for name in names {
            match (plan.stages.iter().position(|stage| stage.name == *name), item_named(plan, name)) {
                (Some(stage), _) => selected.stages[stage] = true,
                (None, Some(item)) => selected.items[item] = true,
                (None, None) => return Err(unknown(plan, name)),
            }
        }
        Ok(selected)
    }

    /// Makes the items with these names (no names mean all) run even if they are up to date, but not those
    /// that they need.
    pub(crate) fn forced(mut self, plan: &Plan, names: &[String]) -> Result<Self, Error> {
        let named = if names.is_empty() { Self::all(plan) } else { Self::named(plan, names)? };
        let is_named = |(index, item): (ItemIndex, &Item)| named.items[index] || named.stages[item.stage];
        self.forced = plan.items.iter().enumerate().map(is_named).collect();
        Ok(self)
    }

    pub(crate) fn is_forced(&self, item: ItemIndex) -> bool {
        self.forced.get(item).copied().unwrap_or(false)
    }

    pub(crate) fn has(&self, item: ItemIndex) -> bool {
        self.items[item]
    }

    /// Whether a stage is selected as a whole.
    pub(crate) fn has_stage(&self, stage: StageIndex) -> bool {
        self.stages[stage]
    }

    pub(crate) fn items(&self) -> usize {
        self.items.iter().filter(|selected| **selected).count()
    }

    /// The number of stages of which something is selected.
    pub(crate) fn stages(&self, plan: &Plan) -> usize {
        let mut stages = self.stages.clone();
        let items = plan.items.iter().zip(&self.items);
        items.filter(|(_, selected)| **selected).for_each(|(item, _)| stages[item.stage] = true);
        stages.into_iter().filter(|selected| *selected).count()
    }
}

/// The item with a name, as events write it: `map [sky, gold]`. Spaces are easily forgotten; if they tell
/// items apart, they count.
pub(crate) fn item_named(plan: &Plan, name: &str) -> Option<ItemIndex> {
    let named = |spelled: fn(&str) -> String| {
        let name = spelled(name);
        (0..plan.items.len()).find(|item| spelled(&plan.item_name(*item).to_string()) == name)
    };
    named(str::to_owned).or_else(|| named(|name| name.replace(' ', "")))
}

/// The first item of the stage that a name begins with, in quotes, as help.
pub(crate) fn first_item(plan: &Plan, name: &str) -> Option<String> {
    let (stage, _) = name.split_once('[')?;
    let mut items = (0..plan.items.len()).map(|item| plan.item_name(item));
    items.find(|item| item.stage == stage.trim()).map(|item| format!("the stage's first item is \"{item}\""))
}

fn unknown(plan: &Plan, name: &str) -> Error {
    let what = if name.contains('[') { "item" } else { "stage" };
    let error =
        Error::new(ErrorKind::UnknownTarget, format!("{} has no {what} {name:?}", plan.manifest_name()));
    let names = plan.stages.iter().map(|stage| stage.name.as_str());
    error.with_help(match (first_item(plan, name), nearest(name, names.clone())) {
        (Some(first), _) => first,
        (None, Some(near)) => format!("did you mean {near:?}?"),
        (None, None) if plan.stages.is_empty() => "it has no stages".to_owned(),
        (None, None) => format!("its stages are: {}", names.collect::<Vec<_>>().join(", ")),
    })
}
