//! What a preview shows of light without a material: white metal of a few roughnesses under what is exported.

use engine::{Artifact, ItemIndex, Plan};

use super::origin::{artifact, single_inputs};
use crate::engines::ExportedLight;
use crate::values::artifacts;

/// The roughness of each piece of white metal, from the left to the right.
pub const ROUGHNESSES: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// The name of what shows a light alone.
pub(super) const WHITE_METAL: &str = "white metal";

/// What lights the metal that shows a light alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightAlone {
    /// The item that exports the light; `None` if the environment lights it.
    pub export: Option<ItemIndex>,
}

/// What an item exports, if a surface can be lit by it.
pub(super) fn exported_light(plan: &Plan, item: ItemIndex) -> Option<ExportedLight> {
    let details = plan.stages[plan.items[item].stage].configured.details()?;
    let light = *details.downcast::<ExportedLight>().ok()?;
    match light {
        ExportedLight::Engine { .. } => Some(light),
        ExportedLight::Texture => prefiltered(plan, item).map(|_| light),
    }
}

/// The item that makes the prefiltered cube that another receives.
pub(super) fn prefiltered(plan: &Plan, item: ItemIndex) -> Option<ItemIndex> {
    single_inputs(plan, item).find(|input| artifact(plan, *input) == Some(artifacts::Prefiltered::TYPE))
}
