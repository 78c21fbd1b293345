//! Places light probes in the volumes of a scene, and repairs those that stand inside of something.
//!
//! ```toml
//! [stage.places]
//! kind = "place-probes"
//! input = "scene"
//! spacing = 0.5
//!
//! [stage.halls]
//! kind = "place-probes"
//! input = "scene"
//! boxes = [{ name = "hall", from = [0, 0, 0], to = [8, 5, 3] }]
//! counts = [16, 10, 6]
//! lattice = "corners"
//! ```
//!
//! The volumes are `boxes` of the manifest, in Specula's frame (+Z up, metres), or else the boxes of the
//! scene's nodes (`extras.specula_probes`, or `volumes` of `import-scene`), or else one box, the bounds of
//! the scene; a note says which. Each has a regular grid of probes: about `spacing` metres apart, or
//! `counts` along x, y and z. They stand in the middle of cells (`lattice = "centres"`, as three.js 0.187
//! and Bevy have them) or at their corners (`"corners"`, as three.js 0.184 to 0.186). `points` are single
//! probes beside them.
//!
//! ## Repairs
//!
//! A probe in a wall is black, and makes what is near it black, or leaks light from the other side. Each
//! probe looks around in 256 directions:
//!
//! | what | when | then |
//! | --- | --- | --- |
//! | moved | more than a quarter of what it sees are backs of solids: it is inside of one | it is moved out through the nearest back, by at most 0.75 of the spacing, to where it sees the free part of its own cell |
//! | moved | it is nearer than 2 cm to a surface | it is moved off it |
//! | filled | it cannot be moved | it has the mean light of valid neighbours that reach it without crossing geometry, by distance, from up to 3 probes away; never from both sides of a wall |
//! | lost | no neighbour reaches it | it has the light of the nearest valid probe of its volume, and a warning lists it |
//!
//! A sheet, such as a floor of one side, is not a solid: a probe below it is dark, not wrong. Notes, which
//! `specula explain` shows, name the probes that were repaired, by their number and their place in the grid,
//! together with those inside of the same node and material: up to 64 of each, and how many more there are.
//! `places` of `report` draws and lists all of them. If all probes of a box are inside of something, the item
//! fails and names the node whose backs they see: often the winding of a room is turned.
//!
//! The result also has which of its 26 neighbours each probe sees, and how far it sees in each direction,
//! with which light is blended later. Albedo, emission and lamps have no part in it: connect the part
//! `shape` of `scene-part`, and a change of these does not even run this stage. Connected to the whole
//! scene it runs, but its result stays the same, so that it makes nothing else run.

use std::collections::BTreeMap;

use engine::serde_json::{self, json};
use engine::{
    Artifact, Context, Diagnostic, Failure, Kind, Output, Parameter, Parameters as _, Port, Product,
    Reporter, Steps, Value, ValueKind, choice, parameters, unexpected,
};
use probes::{Lattice, PlacesError, ProbePlaces, Repair, Scene, ScenePart, Surfaces, Volume};
use stages::artifacts;
use stages::plugin::{Place, UntilStopped};

use crate::baking::{first, listed, place_text};
use crate::scene_port::check;

/// The notes of repaired probes, and the probes that each of them names.
const GROUPS: usize = 32;
const NAMED: usize = 64;

/// The most probes that are placed: each takes more than a kilobyte of memory until it is repaired.
const MOST_PLACED: usize = 1 << 21;

choice! {
    /// Where the probes of a volume stand.
    pub(crate) enum LatticeName {
        /// In the middle of cells.
        Centres = "centres",
        /// At the corners of cells.
        Corners = "corners",
    }
}

parameters! {
    /// A box in the manifest.
    pub(crate) struct BoxParameters {
        /// Its name in messages and files.
        name: String = String::new(),
        /// The corner with the least coordinates, in metres.
        from: Place,
        /// The corner with the greatest coordinates.
        to: Place,
    }
}

/// A box in the manifest, as a parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ProbeBox(BoxParameters);

impl Parameter for ProbeBox {
    fn expected() -> String {
        "{ name = \"...\", from = [x, y, z], to = [x, y, z] }".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let ValueKind::Table(table) = &value.kind else { return Err(unexpected(value, &Self::expected())) };
        let mut errors = Vec::new();
        match BoxParameters::parse(table, &mut errors) {
            Some(parameters) => Ok(Self(parameters)),
            None => Err(errors.into_iter().next().unwrap_or_else(|| unexpected(value, &Self::expected()))),
        }
    }

    fn canonical(&self) -> serde_json::Value {
        engine::Parameters::canonical(&self.0)
    }

    fn schema() -> serde_json::Value {
        json!({
            "type": "object",
            "properties": { "name": String::schema(), "from": Place::schema(), "to": Place::schema() },
            "required": ["from", "to"],
            "additionalProperties": false,
        })
    }
}

/// The probes along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counts([usize; 3]);

impl Parameter for Counts {
    fn expected() -> String {
        "[x, y, z], numbers of probes".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let counts = Vec::<usize>::parse(value).ok().and_then(|counts| <[usize; 3]>::try_from(counts).ok());
        counts.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        json!(self.0)
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": usize::schema(), "minItems": 3, "maxItems": 3 })
    }
}

parameters! {
    /// Parameters of `place-probes`.
    pub(crate) struct Parameters {
        /// The distance between probes, in metres. Default: 1, unless there are `counts`.
        #[range(0.001..=10000.0)]
        spacing: Option<f64> = None,
        /// The probes of each volume along x, y and z, instead of `spacing`.
        counts: Option<Counts> = None,
        /// Where the probes of a volume stand.
        lattice: LatticeName = LatticeName::Centres,
        /// The volumes. Default: the boxes of the scene's nodes or, without any, the bounds of the scene.
        boxes: Vec<ProbeBox> = Vec::new(),
        /// Single probes, in metres.
        points: Vec<Place> = Vec::new(),
    }
}

/// The distance between probes if none is given, in metres.
const SPACING: f64 = 1.0;

/// The kind `place-probes`.
pub(crate) struct PlaceProbes;

impl Kind for PlaceProbes {
    type Parameters = Parameters;

    const NAME: &'static str = "place-probes";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[probes::revisions::PROBES];
    const TEXT: &'static str = include_str!("place_probes.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Scene>("scene")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::ProbePlaces::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = Vec::new();
        if parameters.counts.is_some() && parameters.spacing.is_some() {
            errors.push(("counts", "is given with spacing; give one of them".into()));
        }
        // Boxes of the manifest are known before anything runs.
        for (index, ProbeBox(own)) in parameters.boxes.iter().enumerate() {
            let bounds = [own.from.0, own.to.0].map(|corner| corner.map(|x| x as f32));
            if let Err(error) = parameters.volume(name_of(index, own), bounds) {
                errors.push(("boxes", error.to_string()));
            }
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let stored = &context.inputs.get::<artifacts::Scene>("scene")?.0;
        check(stored, ScenePart::Shape)?;
        let scene = stored.scene.part(ScenePart::Shape);
        let (volumes, from) = parameters.volumes(&scene)?;
        let points: Vec<[f32; 3]> = parameters.points.iter().map(|point| point.0.map(|x| x as f32)).collect();
        let count = volumes.iter().map(Volume::len).sum::<usize>() + points.len();
        if count > MOST_PLACED {
            return Err(Failure::new(format!(
                "there are {count} probes, and at most {MOST_PLACED} are placed"
            ))
            .help("a larger spacing gives fewer; half as dense along each axis is an eighth"));
        }
        reporter.note(format!(
            "{count} probes in {from}{}",
            match points.len() {
                0 => String::new(),
                points => format!(", {points} of them at points"),
            }
        ));
        let surfaces = Surfaces::new(&scene);
        let steps = Steps::new(reporter, 2 * count);
        let places = steps
            .until_stopped(|stop| ProbePlaces::new(&surfaces, volumes, &points, stop).map_err(failure))?;
        report(&places, &scene, reporter);
        Output::artifact(artifacts::ProbePlaces(places))
    }
}

fn failure(error: PlacesError) -> Failure {
    let help = match &error {
        PlacesError::AllInside { .. } => {
            Some("turn the triangles of that node around, or make its material double-sided")
        }
        PlacesError::Nothing | PlacesError::NotFinite(_) | PlacesError::Stopped(_) => None,
    };
    let failure = Failure::from(error);
    match help {
        Some(help) => failure.help(help),
        None => failure,
    }
}

fn name_of(index: usize, own: &BoxParameters) -> String {
    if own.name.is_empty() { format!("box {}", index + 1) } else { own.name.clone() }
}

impl Parameters {
    fn volume(&self, name: String, bounds: [[f32; 3]; 2]) -> Result<Volume, probes::VolumeError> {
        let lattice = match self.lattice {
            LatticeName::Centres => Lattice::Centres,
            LatticeName::Corners => Lattice::Corners,
        };
        match self.counts {
            Some(Counts(counts)) => Volume::new(name, bounds, counts, lattice),
            None => Volume::with_spacing(name, bounds, self.spacing.unwrap_or(SPACING) as f32, lattice),
        }
    }

    /// The volumes, and in words where they are from.
    fn volumes(&self, scene: &Scene) -> Result<(Vec<Volume>, String), Failure> {
        let own = self.boxes.iter().enumerate().map(|(index, ProbeBox(own))| {
            (name_of(index, own), [own.from.0, own.to.0].map(|corner| corner.map(|x| x as f32)))
        });
        let of_nodes = || scene.parts().boxes.iter().map(|named| (named.name.clone(), named.bounds));
        let (boxes, from): (Vec<_>, String) = if !self.boxes.is_empty() {
            (own.collect(), format!("{} of the manifest", boxes_text(self.boxes.len())))
        } else if !scene.parts().boxes.is_empty() {
            (of_nodes().collect(), format!("{} of nodes", boxes_text(scene.parts().boxes.len())))
        } else if self.points.is_empty() {
            (vec![("scene".to_owned(), scene.bounds())], "one box, the bounds of the scene".into())
        } else {
            (Vec::new(), "no box".into())
        };
        let volume = |(name, bounds)| {
            self.volume(name, bounds).map_err(|error| {
                Failure::from(error).help("name a box in `boxes`, or another `spacing` or `counts`")
            })
        };
        Ok((boxes.into_iter().map(volume).collect::<Result<_, _>>()?, from))
    }
}

fn boxes_text(count: usize) -> String {
    if count == 1 { "a box".into() } else { format!("{count} boxes") }
}

/// Notes which probes were repaired and why, a note for each thing that they were inside of; lost ones are a
/// warning, too.
fn report(places: &ProbePlaces, scene: &Scene, reporter: &Reporter) {
    let inside = |probe: usize| {
        let Some(triangle) = places.inside_of(probe) else { return "near a surface".to_owned() };
        let parts = scene.parts();
        let material = parts.material_of.get(triangle as usize);
        let material = material.and_then(|at| parts.materials.get(*at as usize));
        let material = material.map_or("", |material| material.name.as_str());
        format!("inside {}, material {material}", scene.part_of(triangle as usize))
    };
    let mut groups: BTreeMap<(usize, String), Vec<String>> = BTreeMap::new();
    let mut lost = Vec::new();
    for (probe, repair) in places.repairs().iter().enumerate() {
        let (order, detail) = match repair {
            Repair::None => continue,
            Repair::Moved => {
                let [from, to] = [places.grid()[probe], places.positions()[probe]];
                let square = (0..3).map(|axis| (to[axis] - from[axis]) * (to[axis] - from[axis]));
                (0, format!("{:.2} m", square.sum::<f32>().sqrt()))
            }
            Repair::Filled(sources) if sources.len() == 1 => (1, "from 1".to_owned()),
            Repair::Filled(sources) => (1, format!("from {}", sources.len())),
            Repair::Lost(source) => {
                lost.push(probe);
                (2, format!("has the light of {source}"))
            }
        };
        let group = groups.entry((order, inside(probe))).or_default();
        group.push(format!("{} {detail}", place_text(places, probe)));
    }
    let all = groups.len();
    for ((order, inside), probes) in groups.iter().take(GROUPS) {
        let what = ["were moved", "were filled from neighbours", "found nothing"][*order];
        let list = first(NAMED, probes.len(), probes.iter().cloned());
        reporter.note(format!("{inside}: {}: {list}", counted(probes.len(), what)));
    }
    if all > GROUPS {
        let rest: usize = groups.values().skip(GROUPS).map(Vec::len).sum();
        reporter.note(format!("{} in {} other things", counted(rest, "were repaired"), all - GROUPS));
    }
    if !lost.is_empty() {
        let named = |probe: &usize| format!("{} {}", place_text(places, *probe), inside(*probe));
        reporter.warn(format!(
            "{} probes are inside of something, and no neighbour reaches them: {}; another spacing or box may place \
             them outside",
            lost.len(),
            listed(lost.len(), lost.iter().map(named))
        ));
    }
}

/// `1 probe was moved`, `24 probes were moved`.
fn counted(count: usize, what: &str) -> String {
    if count == 1 {
        format!("1 probe {}", what.replacen("were", "was", 1))
    } else {
        format!("{count} probes {what}")
    }
}
