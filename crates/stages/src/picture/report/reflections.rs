//! The reflections of a report: those that are connected, or one made for each pair.

use std::sync::Arc;

use brdf::Choice;
use engine::{Failure, ItemKey, Reporter};
use shrm::Reflection;

use crate::light::light_mismatch;
use crate::picture::report::exported::{Unnamed, names};
use crate::picture::report::lit::Lit;
use crate::picture::report::studied::{Studied, reflection_of};
use crate::values::artifacts;

/// The reflections that are compared.
pub(crate) struct Reflections {
    /// The reflections that are connected.
    pub(crate) all: Vec<(ItemKey, Arc<artifacts::Reflection>)>,
    /// The given degrees, if any, for reflections that are not connected.
    pub(crate) choice: Option<Choice>,
}

impl Reflections {
    /// Returns the reflection of a pair.
    pub(crate) fn of(
        &self,
        lit: &Lit<'_>,
        environment: &ItemKey,
        material: &Studied<'_>,
        material_key: &ItemKey,
        reporter: &Reporter,
    ) -> Result<Reflection, Failure> {
        if self.all.is_empty() {
            return reflection_of(lit, material, self.choice, reporter);
        }
        let found = self.all.iter().find(|(key, _)| {
            [environment, material_key].into_iter().all(|part| names(key, part, Unnamed::Misses))
        });
        let Some((_, reflection)) = found else {
            let (material, environment) = (&material.name, &lit.name);
            return Err(Failure::new(format!(
                "the port reflection receives no reflection of {material} under {environment}"
            ))
            .help(
                "connect a convolve of the same environments and materials, or leave reflection unconnected",
            ));
        };
        if let Some(difference) = light_mismatch::difference(lit.environment, &reflection.0) {
            reporter.warn(format!("{} under {}: {difference}", material.name, lit.name));
        }
        if reflection.0.brdf().centre() != material.material.centre() {
            return Err(Failure::new(format!("the reflection of {} is of another material", material.name))
                .help("connect the material that was projected"));
        }
        Ok(reflection.0.clone())
    }
}
