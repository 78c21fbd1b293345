//! What a report says of light probes: what became of each, and how much leaks between them.

use engine::{Failure, Reporter};
use probes::{Blend, LEAK_POINTS, Leak, ProbePlaces, Repair, Scene, Surfaces, leaks};
use serde::Serialize;

use crate::values::UntilStopped;

/// The figures of the probes.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct ProbeFigures {
    pub(crate) probes: usize,
    /// The number of probes that stand where the grid has them, and of each repair.
    pub(crate) in_place: usize,
    pub(crate) moved: usize,
    pub(crate) filled: usize,
    pub(crate) lost: usize,
    /// Every probe that was repaired.
    pub(crate) repaired: Vec<RepairedProbe>,
    /// What leaks if engines blend the probes; none without a scene.
    pub(crate) leaks: Vec<LeakFigures>,
}

/// A probe that was repaired.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct RepairedProbe {
    pub(crate) probe: usize,
    /// Where the grid has it, in metres.
    pub(crate) place: [f32; 3],
    /// `moved`, `filled` or `lost`.
    pub(crate) repair: &'static str,
    /// How far it was moved, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) metres: Option<f32>,
    /// The probes whose light it has.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) from: Vec<u32>,
    /// The node and the material that it was inside of, if the scene is connected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) inside: Option<[String; 2]>,
}

/// How much leaks with a blend of an engine.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct LeakFigures {
    pub(crate) blend: &'static str,
    #[serde(skip)]
    pub(crate) label: &'static str,
    /// The points of surfaces that were looked at.
    pub(crate) points: usize,
    /// The share of the blend's weight that belongs to probes which cannot see the point: the mean over all
    /// points, and that of the worst.
    pub(crate) mean: f64,
    pub(crate) worst: f64,
}

/// The figures, and what leaks with the blend of three.js.
pub(crate) fn figures(
    places: &ProbePlaces,
    scene: Option<&Scene>,
    reporter: &Reporter,
) -> Result<(ProbeFigures, Vec<Leak>), Failure> {
    let repaired: Vec<RepairedProbe> =
        (0..places.len()).filter_map(|probe| repaired(places, scene, probe)).collect();
    let count = |word: &str| repaired.iter().filter(|probe| probe.repair == word).count();
    let [moved, filled, lost] = ["moved", "filled", "lost"].map(count);
    let (mut measured, mut shown) = (Vec::new(), Vec::new());
    if let Some(scene) = scene {
        let surfaces = Surfaces::new(scene);
        for blend in Blend::ALL {
            let found = reporter.until_stopped(|stop| leaks(&surfaces, places, blend, LEAK_POINTS, stop))?;
            let worst = found.points.iter().fold(0.0, |most: f32, leak| most.max(leak.share));
            let points = found.points.len();
            let (blend_word, blend_label) = (blend.word(), blend.label());
            measured.push(LeakFigures {
                blend: blend_word,
                label: blend_label,
                points,
                mean: found.mean(),
                worst: worst.into(),
            });
            if blend == Blend::Three {
                shown = found.worst().into_iter().cloned().collect();
            }
        }
    }
    let in_place = places.len() - repaired.len();
    let figures =
        ProbeFigures { probes: places.len(), in_place, moved, filled, lost, repaired, leaks: measured };
    Ok((figures, shown))
}

/// What became of a probe, unless it stands where the grid has it.
fn repaired(places: &ProbePlaces, scene: Option<&Scene>, probe: usize) -> Option<RepairedProbe> {
    let [from, to] = [places.grid()[probe], places.positions()[probe]];
    let (repair, metres, sources) = match &places.repairs()[probe] {
        Repair::None => return None,
        Repair::Moved => {
            let square: f32 = (0..3).map(|axis| (to[axis] - from[axis]) * (to[axis] - from[axis])).sum();
            ("moved", Some(square.sqrt()), Vec::new())
        }
        Repair::Filled(sources) => ("filled", None, sources.iter().map(|(source, _)| *source).collect()),
        Repair::Lost(source) => ("lost", None, vec![*source]),
    };
    let inside = places.inside_of(probe).zip(scene).and_then(|(triangle, scene)| {
        let parts = scene.parts();
        let material = parts.materials.get(*parts.material_of.get(triangle as usize)? as usize)?;
        Some([scene.part_of(triangle as usize).to_owned(), material.name.clone()])
    });
    Some(RepairedProbe { probe, place: from, repair, metres, from: sources, inside })
}
