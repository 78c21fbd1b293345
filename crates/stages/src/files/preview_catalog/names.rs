//! The names of what a preview can show: the shortest that distinguish it.

use std::collections::BTreeMap;

use engine::{ItemIndex, ItemKey, Plan, StageIndex};

use super::light_alone::WHITE_METAL;

/// A material as a stage reflects it, or tabulates it: the stage, and the part of an item's key that is not
/// the environment's.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct MaterialKey {
    made: StageIndex,
    rest: ItemKey,
    /// The stage of the material, if there is one.
    material: Option<StageIndex>,
    /// Whether there is no material, but a light that white metal shows.
    is_light: bool,
}

impl MaterialKey {
    /// The key of what an item made of a material, under the light of another item.
    pub(super) fn of(
        plan: &Plan,
        made: ItemIndex,
        environment: ItemIndex,
        material: Option<ItemIndex>,
    ) -> Self {
        let (item, environment) = (&plan.items[made], &plan.items[environment]);
        let rest = item.key.iter().filter(|(stage, _)| environment.key.get(stage).is_none()).collect();
        let material = material.map(|item| plan.items[item].stage);
        Self { made: item.stage, rest, material, is_light: false }
    }

    /// The key of the white metal that shows a light alone, as an item exports or makes it.
    pub(super) fn of_light(plan: &Plan, made: ItemIndex, environment: ItemIndex) -> Self {
        Self { is_light: true, ..Self::of(plan, made, environment, None) }
    }

    /// The name of the material, and the stages that distinguish it from others of that name.
    pub(super) fn label<'p>(&self, plan: &'p Plan) -> Label<'p> {
        let name = |stage: StageIndex| plan.stages[stage].name.as_str();
        let stages = self.material.into_iter().chain([self.made]).map(name).collect::<Vec<_>>();
        let name = match self.is_light {
            true => WHITE_METAL.into(),
            false if self.rest.is_empty() => stages[0].into(),
            false => self.rest.to_string(),
        };
        Label { name, stages }
    }
}

/// A name, and the stages that may distinguish it from others.
pub(super) struct Label<'p> {
    pub(super) name: String,
    pub(super) stages: Vec<&'p str>,
}

impl<'p> Label<'p> {
    /// Makes the label of an item, from its key.
    pub(super) fn of(plan: &'p Plan, item: ItemIndex) -> Self {
        let (stage, key) = (stage_name(plan, item), &plan.items[item].key);
        let name = if key.is_empty() { stage.to_owned() } else { key.to_string() };
        Self { name, stages: vec![stage] }
    }

    /// The forms of the name from the shortest to the longest: the name alone, with one stage, with all
    /// stages.
    fn forms(&self) -> Vec<String> {
        let Self { name, stages } = self;
        let with = |stages: &str| format!("{name} ({stages})");
        let mut forms = vec![name.clone()];
        forms.extend(stages.iter().map(|stage| with(stage)));
        forms.push(with(&stages.join(", ")));
        forms
    }
}

/// For each label the first of its forms that no other label has at the same length.
pub(super) fn distinct(labels: &[Label<'_>]) -> Vec<String> {
    let all = labels.iter().map(Label::forms).collect::<Vec<_>>();
    let mut counts = BTreeMap::<(usize, &str), usize>::new();
    for (length, form) in all.iter().flat_map(|forms| forms.iter().enumerate()) {
        *counts.entry((length, form)).or_default() += 1;
    }
    let is_unique = |(length, form): &(usize, &String)| counts[&(*length, form.as_str())] == 1;
    let chosen = all.iter().map(|forms| {
        let unique = forms.iter().enumerate().find(is_unique).map(|(_, form)| form);
        unique.or(forms.last()).cloned().unwrap_or_default()
    });
    chosen.collect()
}

/// The name of the stage of an item.
pub(super) fn stage_name(plan: &Plan, item: ItemIndex) -> &str {
    &plan.stages[plan.items[item].stage].name
}
