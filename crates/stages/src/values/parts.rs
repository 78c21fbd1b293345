//! Maps of a material with two centres: engines look its diffuse part up by the normal and its highlight by
//! the reflection vector, so that an export writes a map for each.

use brdf::Part;
use engine::{ExportedFiles, Failure, Output, Reporter, Steps, choice};
use shrm::Reflection;

choice! {
    /// The maps of a material with a matte base under a highlight.
    pub(crate) enum PartsName {
        /// One for each part, about its own centre.
        Separate = "separate",
        /// One for both, about the reflection vector.
        Together = "together",
    }
}

/// Whether one exported map holds both parts of a material that has two.
pub(crate) fn are_together(files: &ExportedFiles) -> bool {
    files.parameters["parts"] == "together"
}

/// The prefix of the endings of the diffuse part's files.
const DIFFUSE: &str = "-diffuse";

/// The endings of all files, if those of one map are `one`: the diffuse part's come first, so that the last
/// is an index in either case.
pub(crate) fn endings(parts: PartsName, one: Vec<String>) -> Vec<String> {
    let diffuse =
        one.iter().filter(|_| parts == PartsName::Separate).map(|ending| format!("{DIFFUSE}{ending}"));
    diffuse.chain(one.iter().cloned()).collect()
}

/// The files of a field's maps. `split` are the fields of its two parts, if it has them, and `write` makes
/// the files of one map, of the whole or of a part, as many for each, in one of the steps.
pub(crate) fn export<T>(
    parts: PartsName,
    whole: &T,
    split: Option<[T; 2]>,
    reporter: &Reporter,
    write: impl Fn(&T, Option<Part>, &Steps<'_>) -> Result<Vec<Vec<u8>>, Failure>,
) -> Result<Output, Failure> {
    let maps = if parts == PartsName::Separate && split.is_some() { 2 } else { 1 };
    let steps = &Steps::new(reporter, maps);
    let (diffuse, files) = match (parts, split) {
        (PartsName::Together, _) => (Vec::new(), write(whole, None, steps)?),
        (PartsName::Separate, Some([diffuse, specular])) => {
            let diffuse = write(&diffuse, Some(Part::Diffuse), steps)?;
            (diffuse.into_iter().map(Some).collect(), write(&specular, Some(Part::Specular), steps)?)
        }
        (PartsName::Separate, None) => {
            let files = write(whole, None, steps)?;
            (vec![None; files.len()], files)
        }
    };
    Ok(Output::Files(diffuse.into_iter().chain(files.into_iter().map(Some)).collect()))
}

/// A note on the maps of a reflection that has two parts, and a warning of one that loses its direction.
pub(crate) fn note(parts: PartsName, reflection: &Reflection, reporter: &Reporter) {
    if reflection.material().is_some_and(|material| material.turns() > 1) {
        reporter.warn(
            "the material is anisotropic, but maps are looked up without the tangent: the map holds the mean \
             over all rotations of the surface, a round highlight, including lamps; for a highlight that \
             follows the brushing, use tabulate-brdf with shade-vertices, or shade lamps separately with \
             lamps = \"separate\"",
        );
    }
    let Some([diffuse, specular]) = reflection.parts() else { return };
    let p = |field: &Reflection| field.brdf().p().get();
    reporter.note(match parts {
        PartsName::Separate => format!(
            "a map of each part: add the diffuse one, looked up by the normal (P = {}), to the other (P = {})",
            p(diffuse),
            p(specular)
        ),
        PartsName::Together => format!(
            "one map holds both parts about the reflection vector: P = {}; separate maps have P = {} and {}",
            p(reflection),
            p(diffuse),
            p(specular)
        ),
    });
}
