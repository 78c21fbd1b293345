//! Writes a light that was turned in a window into the manifest.
//!
//! The light of a subject is turned by the `rotate` stage that is nearest to the stage that reflects it: its
//! angles are changed. If there is none, one is added, which every reflection of that light reads from then
//! on.
//!
//! If there is no material, everything that is made of the light turns with it.
//!
//! Stages that take such a reflection together with its environment, as reports and previews do, get the
//! environment turned in the same way, and so does the scale space of a compact map beside it; other stages
//! do not turn.

use std::collections::{BTreeMap, BTreeSet};

use engine::{Artifact, Kind, Plan, Product, Stage, StageIndex};
use preview::Aim;
use sphere::Rotation;

use super::manifest_edit::{ManifestEdit, Written, edited};
use super::preview_catalog::{CatalogEntry, PreviewCatalog};
use crate::light::{Rotate, rotate};
use crate::values::artifacts;

/// A manifest in which a light is turned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightEdit {
    /// The changes to the manifest, in lines for whoever is asked.
    pub changes: Vec<String>,
    /// The manifest's text.
    pub text: String,
}

/// The place where light enters a stage: the stage, and the index of the input in [`engine::Stage::inputs`].
type Use = (StageIndex, usize);

/// The stage by which the light of another is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Turning {
    /// The light is turned by this `rotate` stage.
    By(StageIndex),
    /// The light is turned by no stage; one is needed behind this stage.
    Behind(StageIndex),
}

impl PreviewCatalog {
    /// The text of this catalog's manifest with the light of an entry turned further: by a pitch, and then by
    /// a yaw.
    ///
    /// # Errors
    /// If the angles are too small to be written, or the text is not one that can be edited. One line.
    pub fn with_turned_light(&self, entry: &CatalogEntry, by: Aim, text: &str) -> Result<LightEdit, String> {
        let by = [by.yaw, by.pitch].map(|angle| rounded(angle.to_degrees()));
        if by == [0.0; 2] {
            return Err("the light is not turned".into());
        }
        let plan = self.plan();
        let turns_reflection = |stage: &&Stage| {
            let is_reflection = stage.product == Product::Artifact(artifacts::Reflection::TYPE);
            stage.kind.name() == Rotate::NAME && is_reflection
        };
        let stages = entry.ancestry.iter().map(|item| &plan.stages[plan.items[*item].stage]);
        if let Some(stage) = stages.into_iter().find(turns_reflection) {
            let name = &stage.name;
            return Err(format!(
                "[stage.{name}] turns the reflection after its light: change its angles there"
            ));
        }
        let graph = LightGraph { plan, is_light_alone: entry.light_alone.is_some() };
        let light = plan.items[entry.lighting.unwrap_or(entry.environment)].stage;
        let turns = Turns::of(&graph, light);
        let file = plan.manifest.file_name().unwrap_or_default().to_string_lossy();
        let mut edits = Vec::new();
        let mut changes = Vec::new();
        for &stage in &turns.rotates {
            let values = angles(rotate::parameters_of(&plan.stages[stage]), by);
            let name = &plan.stages[stage].name;
            let shown = values.iter().map(|Angle { key, old, new }| {
                format!("{key} = {} (now {})", new.toml(false), old.toml(false))
            });
            changes.push(format!("[stage.{name}] gets {}", shown.collect::<Vec<_>>().join(", ")));
            edits.extend(values.into_iter().map(|Angle { key, new, .. }| ManifestEdit::Set {
                stage: name.clone(),
                key,
                value: new,
            }));
        }
        for (&behind, uses) in &turns.behind {
            let behind = &plan.stages[behind].name;
            let stage = self.free_name(behind);
            let entries =
                [("kind", Written::Text(Rotate::NAME.into())), ("input", Written::Text(behind.clone()))];
            let turn = ["yaw", "pitch"].into_iter().zip(by).filter(|(_, angle)| *angle != 0.0);
            let turn = turn.map(|(key, angle)| (key, Written::Number(angle))).collect::<Vec<_>>();
            let shown = turn.iter().map(|(key, angle)| format!("{key} = {}", angle.toml(false)));
            let shown = shown.collect::<Vec<_>>().join(", ");
            let readers = named(plan, uses.iter().map(|(reader, _)| *reader));
            changes.push(format!("[stage.{stage}] is new: it turns {behind} ({shown}) for {readers}"));
            let entries = entries.into_iter().chain(turn).collect();
            edits.push(ManifestEdit::Add { behind: behind.clone(), stage: stage.clone(), entries });
            edits.extend(uses.iter().map(|&(reader, input)| ManifestEdit::Connect {
                stage: plan.stages[reader].name.clone(),
                port: plan.stages[reader].inputs[input].0.clone(),
                to: stage.clone(),
            }));
        }
        let lights = self.lights_of(&graph, &turns);
        if lights.len() > 1 {
            changes.push(format!("this turns the light of {}", lights.join(", ")));
        }
        let others = turns.other_readers(&graph);
        if !others.is_empty() {
            changes.push(format!("the output of {} turns too", named(plan, others.into_iter())));
        }
        Ok(LightEdit { text: edited(&file, text, &edits)?, changes })
    }

    /// A name for a stage that turns what another makes.
    fn free_name(&self, behind: &str) -> String {
        let is_free = |name: &String| self.plan().stages.iter().all(|stage| stage.name != *name);
        let numbered = (2..).map(|number| format!("{behind}-turned-{number}"));
        std::iter::once(format!("{behind}-turned")).chain(numbered).find(is_free).unwrap_or_default()
    }

    /// The names of the environments whose light is turned.
    fn lights_of(&self, graph: &LightGraph<'_>, turns: &Turns) -> Vec<String> {
        let is_turned = |entry: &CatalogEntry| {
            let light = self.plan().items[entry.lighting.unwrap_or(entry.environment)].stage;
            match graph.turning(light) {
                Turning::By(stage) => turns.rotates.contains(&stage),
                Turning::Behind(stage) => turns.behind.contains_key(&stage),
            }
        };
        let turned = self.entries().filter(|(_, entry)| is_turned(entry)).map(|(environment, _)| environment);
        turned.collect::<BTreeSet<_>>().into_iter().map(str::to_owned).collect()
    }
}

/// The stages that turn a light, wherever it is reflected.
struct Turns {
    /// The `rotate` stages to change.
    rotates: BTreeSet<StageIndex>,
    /// The stages behind which one is added, and the uses of light that will read it.
    behind: BTreeMap<StageIndex, BTreeSet<Use>>,
    /// All uses of light that turn.
    uses: BTreeSet<Use>,
}

impl Turns {
    /// Finds the stages for the light that this stage gives to the one that reflects it.
    fn of(graph: &LightGraph<'_>, light: StageIndex) -> Self {
        let (turning, origins) = (graph.turning(light), graph.origins(light));
        let mut turns = Self { rotates: BTreeSet::new(), behind: BTreeMap::new(), uses: BTreeSet::new() };
        for (at, from) in graph.uses().filter(|((stage, _), _)| graph.is_lit(*stage)) {
            let of = graph.turning(from);
            let is_unturned = |turning| matches!(turning, Turning::Behind(_));
            let is_same_light = || !graph.origins(from).is_disjoint(&origins);
            if of == turning || is_unturned(of) && is_unturned(turning) && is_same_light() {
                turns.add(at, of);
            }
        }
        // What else reads the light beside a reflection of it must see it from the same side.
        let reflecting = turns.uses.iter().map(|(stage, _)| *stage).collect::<BTreeSet<_>>();
        let above = graph.upstream(&reflecting);
        let below = graph.downstream(&reflecting);
        let scale_spaces = graph.scale_spaces_of(&below);
        let beside = graph.uses().filter(|((stage, _), _)| {
            (below.contains(stage) || scale_spaces.contains(stage)) && !reflecting.contains(stage)
        });
        for (at, from) in beside.collect::<Vec<_>>() {
            if graph.origins(from).is_disjoint(&origins) {
                continue;
            }
            let of = match graph.turning(from) {
                // Changed, it would turn the reflections a second time.
                Turning::By(stage) if above.contains(&stage) && !turns.rotates.contains(&stage) => {
                    Turning::Behind(from)
                }
                of => of,
            };
            turns.add(at, of);
        }
        turns
    }

    fn add(&mut self, at: Use, of: Turning) {
        self.uses.insert(at);
        match of {
            Turning::By(stage) => _ = self.rotates.insert(stage),
            Turning::Behind(stage) => _ = self.behind.entry(stage).or_default().insert(at),
        }
    }

    /// The stages that read a `rotate` stage to change for another purpose.
    fn other_readers(&self, graph: &LightGraph<'_>) -> BTreeSet<StageIndex> {
        let readers =
            graph.uses().filter(|(at, from)| self.rotates.contains(from) && !self.uses.contains(at));
        readers.map(|((stage, _), _)| stage).collect()
    }
}

/// The stages of a plan, as far as light goes through them.
struct LightGraph<'p> {
    plan: &'p Plan,
    /// Whether there is no material.
    is_light_alone: bool,
}

impl LightGraph<'_> {
    fn makes_light(&self, stage: StageIndex) -> bool {
        let lights = [artifacts::Lighting::TYPE, artifacts::Environment::TYPE];
        matches!(self.plan.stages[stage].product, Product::Artifact(name) if lights.contains(&name))
    }

    /// Whether a stage reflects the light or, without a material, makes anything else of it.
    fn is_lit(&self, stage: StageIndex) -> bool {
        if self.is_light_alone {
            return !self.makes_light(stage);
        }
        let reflected = [artifacts::Reflection::TYPE, artifacts::Shrm::TYPE, artifacts::VertexRadiance::TYPE];
        matches!(self.plan.stages[stage].product, Product::Artifact(name) if reflected.contains(&name))
    }

    /// All uses of light, each with the stage that makes it.
    fn uses(&self) -> impl Iterator<Item = (Use, StageIndex)> {
        (0..self.plan.stages.len())
            .flat_map(|stage| {
                let inputs = self.plan.stages[stage].inputs.iter().enumerate();
                inputs.map(move |(input, (_, from))| ((stage, input), *from))
            })
            .filter(|(_, from)| self.makes_light(*from))
    }

    /// The stages whose light a stage reads.
    fn lights(&self, stage: StageIndex) -> impl Iterator<Item = StageIndex> {
        let inputs = self.plan.stages[stage].inputs.iter().map(|(_, from)| *from);
        inputs.filter(|from| self.makes_light(*from))
    }

    /// The stage that turns the light that another makes, or passes on: all of it, and as the last.
    fn turning(&self, light: StageIndex) -> Turning {
        let mut stage = light;
        loop {
            if self.plan.stages[stage].kind.name() == Rotate::NAME {
                return Turning::By(stage);
            }
            let mut lights = self.lights(stage);
            match (lights.next(), lights.next()) {
                (Some(only), None) => stage = only,
                _ => return Turning::Behind(light),
            }
        }
    }

    /// The stages that a light comes from.
    fn origins(&self, light: StageIndex) -> BTreeSet<StageIndex> {
        let all = self.upstream(&BTreeSet::from([light]));
        let is_origin = |stage: &StageIndex| self.makes_light(*stage) && self.lights(*stage).next().is_none();
        all.into_iter().filter(is_origin).collect()
    }

    /// The scale spaces that some stages read.
    fn scale_spaces_of(&self, stages: &BTreeSet<StageIndex>) -> BTreeSet<StageIndex> {
        let inputs = stages.iter().flat_map(|stage| &self.plan.stages[*stage].inputs);
        let makes = |stage: &StageIndex| {
            matches!(self.plan.stages[*stage].product, Product::Artifact(artifacts::ScaleSpace::TYPE))
        };
        inputs.map(|(_, from)| *from).filter(makes).collect()
    }

    /// Adds to some stages those that they need.
    fn upstream(&self, stages: &BTreeSet<StageIndex>) -> BTreeSet<StageIndex> {
        let mut found = stages.clone();
        // Each stage comes after those that it needs.
        for (index, stage) in self.plan.stages.iter().enumerate().rev() {
            if found.contains(&index) {
                found.extend(stage.inputs.iter().map(|(_, from)| *from));
            }
        }
        found
    }

    /// Adds to some stages those that need them.
    fn downstream(&self, stages: &BTreeSet<StageIndex>) -> BTreeSet<StageIndex> {
        let mut found = stages.clone();
        for (index, stage) in self.plan.stages.iter().enumerate() {
            if stage.inputs.iter().any(|(_, from)| found.contains(from)) {
                found.insert(index);
            }
        }
        found
    }
}

/// A parameter of a `rotate` stage, and its value before and after a turn.
struct Angle {
    key: &'static str,
    old: Written,
    new: Written,
}

/// The parameters of a `rotate` stage that change if its light is turned further, by a yaw and a pitch in
/// degrees.
fn angles(now: rotate::Parameters, [yaw, pitch]: [f64; 2]) -> Vec<Angle> {
    let by = Rotation::from_yaw_pitch_roll(yaw.to_radians(), pitch.to_radians(), 0.0);
    let turned = by.after(now.rotation());
    if let Some(old) = now.quaternion() {
        let new = turned.quaternion().map(|number| (number * 1e6).round() / 1e6 + 0.0);
        return vec![Angle { key: "quaternion", old: Written::Numbers(old), new: Written::Numbers(new) }];
    }
    let old = now.angles();
    let new = match pitch {
        // A turn about +Z is only added.
        0.0 => [old[0] + yaw, old[1], old[2]],
        _ => turned.yaw_pitch_roll().map(f64::to_degrees),
    };
    let angles = ["yaw", "pitch", "roll"].into_iter().zip(old).zip(new);
    let changed = angles.filter(|((_, old), new)| (new - old).abs() > 0.005);
    changed
        .map(|((key, old), new)| Angle {
            key,
            old: Written::Number(old),
            new: Written::Number(rounded(wrapped(new))),
        })
        .collect()
}

/// Wraps an angle to between -180 and 180 degrees.
fn wrapped(degrees: f64) -> f64 {
    degrees - 360.0 * (degrees / 360.0).round()
}

/// Rounds an angle to hundredths of a degree: a hand is not more accurate.
fn rounded(degrees: f64) -> f64 {
    (degrees * 100.0).round() / 100.0 + 0.0
}

/// The names of stages, in the order of the plan.
fn named(plan: &Plan, stages: impl Iterator<Item = StageIndex>) -> String {
    let stages = stages.collect::<BTreeSet<_>>();
    stages.into_iter().map(|stage| plan.stages[stage].name.as_str()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests;
