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
//! the scene; a note says which. Each has a regular grid of probes: about `spacing` metres apart, or `counts`
//! along x, y and z. They stand in the middle of cells (`lattice = "centres"`, as three.js 0.187 and Bevy
//! have them) or at their corners (`"corners"`, as three.js 0.184 to 0.186). `points` are single probes
//! beside them, as are the nodes that `points` of `import-scene` names; with such points and no box, the
//! bounds of the scene are a box only for `split` and `scatter`.
//!
//! ## Rooms
//!
//! ```toml
//! [stage.rooms]
//! kind = "place-probes"
//! input = "scene"
//! spacing = 0.5
//! split = "rooms"
//! ```
//!
//! Engines blend the eight probes around a place whether there is a wall between them or not, and clamp at
//! the end of a box: light of one room gets into the other through a wall in a box, and not between boxes.
//! `split = "rooms"` makes a volume for each room in a box, which ends in the middle of its walls. A room is
//! a free space in which a cube with a side of `opening` metres can move about: doors and windows that are
//! narrower or lower end it, and the boxes of two rooms meet in the doorway. Narrower spaces beside such
//! rooms, as corridors, are rooms of their own, if they are at least half a metre wide; so is what is
//! outside, if the box holds it. A room that is no box, as an L, gets several. Walls are found by rays
//! between places 10 cm apart, and farther apart in boxes of more than 2 million such places, which a note
//! says. Walls without thickness end the boxes on both sides, and Bevy blends both where they touch: give
//! walls a thickness.
//! Use `lattice = "centres"`: boxes with probes at the corners grow by half a spacing in three.js 187.
//!
//! A note has the share of light from probes that cannot see the surface that they light, before and after:
//! the mean at 2,000 points of surfaces, by the formulas of three.js 187 and Bevy. Points that no probe
//! nearby sees, as on the outer side of a wall, do not count.
//!
//! ## Scattered points
//!
//! ```toml
//! [stage.scattered]
//! kind = "place-probes"
//! input = "scene"
//! spacing = 0.5
//! scatter = "adaptive"
//! ```
//!
//! Boxes are divided into cells about four spacings long; those that a surface meets are halved, twice at
//! most. The middle of each cell that is not inside of a solid is a probe: they are about a spacing apart at
//! surfaces, and four in the open. They are in no volume: `export-probes` takes them for `godot`, `unity` and
//! `gltf`, and other presets load grids, which `check-probes`, `shade-vertices` and `preview` need, too.
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
    Reporter, Value, ValueKind, choice, parameters, unexpected,
};
use probes::{Lattice, ProbePlaces, Repair, SCATTER_RATIO, Scene, ScenePart, Surfaces, Volume, scatter};
use stages::artifacts;
use stages::plugin::{Place, UntilStopped};

use crate::baking::{first, listed, place_text};
use crate::scene_port::check;

mod arrange;

use arrange::{Arrangement, NamedBounds, check_count, failure};

/// The notes of repaired probes, and the probes that each of them names.
const GROUPS: usize = 32;
const NAMED: usize = 64;

choice! {
    /// Where the probes of a volume stand.
    pub(crate) enum LatticeName {
        /// In the middle of cells.
        Centres = "centres",
        /// At the corners of cells.
        Corners = "corners",
    }
}

choice! {
    /// What boxes become.
    pub(crate) enum Split {
        /// Volumes, each as it is.
        None = "none",
        /// A volume for each room in them.
        Rooms = "rooms",
    }
}

choice! {
    /// Whether boxes hold grids or points.
    pub(crate) enum Scatter {
        /// Grids.
        None = "none",
        /// Points, denser at surfaces.
        Adaptive = "adaptive",
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
        /// Single probes, in metres, beside those of the scene's nodes.
        points: Vec<Place> = Vec::new(),
        /// Whether a box becomes a volume for each room in it; see Rooms.
        split: Split = Split::None,
        /// With `split = "rooms"`, spaces that are connected by an opening narrower or lower than this are
        /// two rooms, in metres.
        #[range(0.1..=100.0)]
        opening: f64 = OPENING,
        /// Whether boxes hold grids, or points that are denser at surfaces; see Scattered points.
        scatter: Scatter = Scatter::None,
    }
}

/// The distance between probes if none is given, in metres.
const SPACING: f64 = 1.0;

/// The openings that end a room if none are given, in metres: doors and most windows.
const OPENING: f64 = 1.25;

/// The kind `place-probes`.
pub(crate) struct PlaceProbes;

impl Kind for PlaceProbes {
    type Parameters = Parameters;

    const NAME: &'static str = "place-probes";
    const REVISION: u32 = 3;
    const KERNELS: &'static [u32] = &[probes::revisions::PROBES, probes::revisions::LEAKS];
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
        let is_scattered = parameters.scatter == Scatter::Adaptive;
        if parameters.counts.is_some() && (is_scattered || parameters.split == Split::Rooms) {
            errors.push(("counts", "are those of a box as it is; give spacing".into()));
        }
        if is_scattered && parameters.split == Split::Rooms {
            errors.push(("split", "has no effect on scattered points, which are in no volume".into()));
        }
        if is_scattered && parameters.lattice == LatticeName::Corners {
            errors.push(("lattice", "has no effect on scattered points, which are in no volume".into()));
        }
        if parameters.opening != OPENING && parameters.split != Split::Rooms {
            errors.push(("opening", "has an effect only with split = \"rooms\"".into()));
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
        let connected = context.inputs.get::<artifacts::Scene>("scene")?;
        check(&connected.0, ScenePart::Shape)?;
        let scene = connected.0.scene.part(ScenePart::Shape);
        let (mut boxes, mut from) = parameters.boxes(&scene);
        let mut points: Vec<[f32; 3]> =
            parameters.points.iter().map(|point| point.0.map(|x| x as f32)).collect();
        points.extend(&scene.parts().points);
        let surfaces = Surfaces::new(&scene);
        if parameters.scatter == Scatter::Adaptive {
            points.extend(parameters.scattered(&surfaces, &boxes, reporter)?);
            from = format!("the octree of {from}");
            boxes.clear();
        }
        let arrangement = Arrangement {
            volumes: &|boxes| parameters.volumes(boxes),
            opening: (parameters.split == Split::Rooms).then_some(parameters.opening as f32),
        };
        let places = arrangement.places(&surfaces, &boxes, &points, reporter)?;
        let at_points = match points.len() {
            0 => String::new(),
            points => format!(", {points} of them at points"),
        };
        reporter.note(format!("{} probes in {from}{at_points}", places.len()));
        report(&places, &scene, reporter);
        Output::artifact(artifacts::ProbePlaces(places, connected.triangles_digest()))
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

    /// The boxes, and in words where they are from.
    fn boxes(&self, scene: &Scene) -> (Vec<NamedBounds>, String) {
        let own = self.boxes.iter().enumerate().map(|(index, ProbeBox(own))| {
            (name_of(index, own), [own.from.0, own.to.0].map(|corner| corner.map(|x| x as f32)))
        });
        let of_nodes = &scene.parts().boxes;
        let has_points = !self.points.is_empty() || !scene.parts().points.is_empty();
        if !self.boxes.is_empty() {
            (own.collect(), format!("{} of the manifest", boxes_text(self.boxes.len())))
        } else if !of_nodes.is_empty() {
            let boxes = of_nodes.iter().map(|named| (named.name.clone(), named.bounds)).collect();
            (boxes, format!("{} of nodes", boxes_text(of_nodes.len())))
        } else if !has_points || self.scatter == Scatter::Adaptive || self.split == Split::Rooms {
            (vec![("scene".to_owned(), scene.bounds())], "one box, the bounds of the scene".into())
        } else {
            (Vec::new(), "no box".into())
        }
    }

    /// The volumes of boxes.
    fn volumes(&self, boxes: &[NamedBounds]) -> Result<Vec<Volume>, Failure> {
        let volume = |(name, bounds): &NamedBounds| {
            self.volume(name.clone(), *bounds).map_err(|error| {
                Failure::from(error).help("name a box in `boxes`, or another `spacing` or `counts`")
            })
        };
        boxes.iter().map(volume).collect()
    }

    /// The points of octrees in boxes; where two of them overlap, those of the first.
    fn scattered(
        &self,
        surfaces: &Surfaces<'_>,
        boxes: &[NamedBounds],
        reporter: &Reporter,
    ) -> Result<Vec<[f32; 3]>, Failure> {
        let spacing = self.spacing.unwrap_or(SPACING) as f32;
        let mut points: Vec<[f32; 3]> = Vec::new();
        for (index, (name, bounds)) in boxes.iter().enumerate() {
            // The coarse cells, each of which becomes a point at least.
            let coarse = Volume::with_spacing(
                name.clone(),
                *bounds,
                spacing * SCATTER_RATIO as f32,
                Lattice::Centres,
            )?;
            check_count(points.len() + coarse.len())?;
            let own = reporter.until_stopped(|stop| {
                scatter(surfaces, *bounds, spacing, stop).map_err(|stopped| failure(stopped.into()))
            })?;
            let is_before = |point: &[f32; 3]| {
                boxes[..index].iter().any(|(_, [least, most])| {
                    (0..3).all(|axis| (least[axis]..=most[axis]).contains(&point[axis]))
                })
            };
            points.extend(own.into_iter().filter(|point| !is_before(point)));
            check_count(points.len())?;
        }
        Ok(points)
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
