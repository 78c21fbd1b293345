//! The JSON index of explicit reflection maps: what a renderer, or `import-reflection-maps`, needs to know
//! about the files beside it. The manual of `import-reflection-maps` describes it.

use std::path::{Component, Path};

use brdf::Centre;
use engine::Failure;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use serde_json::json;
use shrm::{MapGrid, MapViews, View, icosahedron};
use sphere::{DVec3, Direction, from_file, to_file};

/// The member `format` of every index.
const FORMAT: &str = "explicit-reflection-maps";

/// The member `version` of every index.
const VERSION: u32 = 1;

/// The form in which a file holds the sphere of central directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum FileLayout {
    /// Six faces: stacked in a picture, or the faces of a texture.
    Cube,
    /// Latitude and longitude.
    LatLong,
    /// A mirror ball seen from the view.
    Sphere,
}

impl FileLayout {
    /// The faces of a map, below each other in a picture.
    pub(crate) fn faces(self) -> usize {
        if self == Self::Cube { 6 } else { 1 }
    }
}

impl From<MapGrid> for FileLayout {
    fn from(grid: MapGrid) -> Self {
        match grid {
            MapGrid::Cube(_) => Self::Cube,
            MapGrid::LatLong(_) => Self::LatLong,
        }
    }
}

/// The kind of views, or angles, that distinguish the maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Views {
    /// Views in the world.
    Global,
    /// Views in the frame of each texel.
    Local,
    /// Angles between central direction and view.
    Angles,
}

impl From<&MapViews> for Views {
    fn from(views: &MapViews) -> Self {
        match (views, views.frame()) {
            (MapViews::Angles(_), _) => Self::Angles,
            (_, View::Global) => Self::Global,
            (_, View::Local) => Self::Local,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum CentreName {
    Reflection,
    Normal,
    Tangent,
}

impl From<Centre> for CentreName {
    fn from(centre: Centre) -> Self {
        match centre {
            Centre::Reflection => Self::Reflection,
            Centre::Normal => Self::Normal,
            Centre::Tangent => Self::Tangent,
        }
    }
}

impl From<CentreName> for Centre {
    fn from(name: CentreName) -> Self {
        match name {
            CentreName::Reflection => Self::Reflection,
            CentreName::Normal => Self::Normal,
            CentreName::Tangent => Self::Tangent,
        }
    }
}

/// One map: its place and its view.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with a `file` and a view")]
pub(crate) struct Entry {
    /// The file, relative to the index.
    pub(crate) file: String,
    /// The layer of an array texture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) layer: Option<usize>,
    /// The slice of a volume.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) slice: Option<usize>,
    /// The view, in Specula's frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    view: Option<[f64; 3]>,
    /// The view, in the file frame (+Y up).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    view_file: Option<[f64; 3]>,
    /// The image's right of a sphere map: up x view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    right: Option<[f64; 3]>,
    /// The image's right in the file frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    right_file: Option<[f64; 3]>,
    /// The image's up of a sphere map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    up: Option<[f64; 3]>,
    /// The image's up in the file frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    up_file: Option<[f64; 3]>,
    /// The angle between central direction and view, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) theta_o: Option<f64>,
}

impl Entry {
    /// Makes the entry of a map in a file of its own.
    pub(crate) fn of_file(file: &str) -> Self {
        Self { file: file.into(), ..Self::default() }
    }

    /// Returns the entry with the layer of an array texture that holds its map.
    pub(crate) fn in_layer(self, layer: Option<usize>) -> Self {
        Self { layer, ..self }
    }

    /// Returns the entry with the slice of a volume that holds its map.
    pub(crate) fn in_slice(self, slice: Option<usize>) -> Self {
        Self { slice, ..self }
    }

    /// The entries of a set's maps, each with its view or angle; `place` says where a map is.
    pub(crate) fn of_views(views: &MapViews, place: impl Fn(usize) -> Self) -> Vec<Self> {
        let directions = views.directions();
        let seen = directions.iter().enumerate().map(|(k, &view)| match views.frame() {
            View::Global => place(k).seen_from(view),
            // A view in the texel's frame has no second form.
            View::Local => Self { view: Some(view.vector().to_array()), ..place(k) },
        });
        let angles = views.angles().iter().enumerate();
        seen.chain(angles.map(|(k, &angle)| place(k).at_angle(angle))).collect()
    }

    /// Returns the entry with the angle between central direction and view, in radians.
    fn at_angle(self, angle: f64) -> Self {
        Self { theta_o: Some(angle), ..self }
    }

    /// Returns the entry with its view in the world.
    fn seen_from(self, view: Direction) -> Self {
        let [view, view_file] = both_frames(view);
        Self { view, view_file, ..self }
    }

    /// Returns the entry as a sphere map with these axes: right, up, view.
    pub(crate) fn with_axes(self, [right, up, _]: [Direction; 3]) -> Self {
        let ([right, right_file], [up, up_file]) = (both_frames(right), both_frames(up));
        Self { right, right_file, up, up_file, ..self }
    }

    /// The view, whichever frame it is given in.
    pub(crate) fn view(&self) -> Result<Direction, Failure> {
        if self.theta_o.is_some() {
            return Err(self.error("`theta_o` is for `views` \"angles\"; expected a `view` or `view_file`"));
        }
        let view = self.direction("view", self.view, self.view_file)?;
        view.ok_or_else(|| self.error("neither `view` nor `view_file` is given"))
    }

    /// The angle between central direction and view, in radians.
    pub(crate) fn angle(&self) -> Result<f64, Failure> {
        match self.theta_o {
            _ if self.view.or(self.view_file).is_some() => {
                Err(self.error("with `views` \"angles\" expected a `theta_o` and no view"))
            }
            Some(angle) if (0.0..=std::f64::consts::PI).contains(&angle) => Ok(angle),
            Some(angle) => Err(self.error(&format!("`theta_o` is {angle}; expected 0 to pi, in radians"))),
            None => Err(self.error("`theta_o` is missing; `views` \"angles\" needs it")),
        }
    }

    /// The axes of a sphere map: right, up, view.
    pub(crate) fn axes(&self) -> Result<[Direction; 3], Failure> {
        /// The least cosine between a given right and the right that follows from up: they agree within 2.6
        /// degrees.
        const ALIKE: f64 = 0.999;
        let view = self.view()?;
        let up = self.direction("up", self.up, self.up_file)?;
        let given = self.direction("right", self.right, self.right_file)?;
        let right = match (up, given) {
            (Some(up), _) => Direction::new(up.vector().cross(view.vector()))
                .ok_or_else(|| self.error("`up` is parallel to the view, so it gives no direction"))?,
            (None, Some(_)) => return Err(self.error("`right` is given without `up`")),
            (None, None) => return Ok(shrm::sphere_map_axes(view)),
        };
        if given.is_some_and(|given| given.dot(right) < ALIKE) {
            return Err(self.error("`right` is not up x view; mirrored images are not supported"));
        }
        Ok([right, Direction::normalised(view.vector().cross(right.vector())), view])
    }

    /// Takes a direction from whichever frame it is given in; `None` if it is not given.
    fn direction(
        &self,
        name: &str,
        ours: Option<[f64; 3]>,
        file: Option<[f64; 3]>,
    ) -> Result<Option<Direction>, Failure> {
        /// The least cosine between two equal directions: the digits of a text, 0.1 degrees.
        const ALIKE: f64 = 0.999_998;
        let parse = |name: &str, given: Option<[f64; 3]>| {
            let bad = |given| self.error(&format!("`{name}` is {given:?}, which is not a direction"));
            given.map(|given| Direction::new(DVec3::from_array(given)).ok_or_else(|| bad(given))).transpose()
        };
        let ours = parse(name, ours)?;
        let file = parse(&format!("{name}_file"), file)?;
        let file = file.map(|file| Direction::normalised(from_file(file.vector())));
        match (ours, file) {
            (Some(ours), Some(file)) if ours.dot(file) < ALIKE => Err(self.error(&format!(
                "`{name}` and `{name}_file` are different directions; give only one of them"
            ))),
            _ => Ok(ours.or(file)),
        }
    }

    fn error(&self, message: &str) -> Failure {
        Failure::new(format!("the map in {}: {message}", self.file))
    }
}

/// A direction in Specula's frame and in the file frame, as an index holds it.
fn both_frames(direction: Direction) -> [Option<[f64; 3]>; 2] {
    // Zeros of either sign are written as 0.
    [direction.vector(), to_file(direction.vector())].map(|v| Some((v + DVec3::ZERO).to_array()))
}

/// An index as it is written.
pub(crate) struct NewIndex<'a> {
    /// The method that made the maps.
    pub(crate) method: &'static str,
    pub(crate) centre: Centre,
    pub(crate) views: &'a MapViews,
    pub(crate) layout: FileLayout,
    pub(crate) resolution: usize,
    pub(crate) degree: usize,
    pub(crate) maps: Vec<Entry>,
}

impl NewIndex<'_> {
    /// The bytes, with one map on each line.
    pub(crate) fn encode(&self, recipe: &str) -> Result<Vec<u8>, Failure> {
        let rows = |rows: Vec<String>| format!("[\n    {}\n  ]", rows.join(",\n    "));
        let maps: Result<Vec<String>, _> = self.maps.iter().map(serde_json::to_string).collect();
        let central = match self.centre {
            Centre::Reflection => {
                "maps are looked up by the reflection vector R = 2 (N.V) N - V of the view V about the surface normal N"
            }
            Centre::Normal => "maps are looked up by the surface normal N",
            Centre::Tangent => "maps are looked up by the surface tangent T",
        };
        let mut members = vec![
            ("format", json!(FORMAT).to_string()),
            ("version", json!(VERSION).to_string()),
            ("method", json!(self.method).to_string()),
            ("centre", json!(CentreName::from(self.centre)).to_string()),
            ("central_direction", json!(central).to_string()),
            ("views", json!(Views::from(self.views)).to_string()),
            ("layout", json!(self.layout).to_string()),
            ("resolution", json!(self.resolution).to_string()),
            ("degree", json!(self.degree).to_string()),
            ("frame", json!(FRAME).to_string()),
            ("lookup", json!(lookup_text(self.layout)).to_string()),
            ("interpolation", json!(interpolation_text(self.views)).to_string()),
            ("maps", rows(maps?)),
        ];
        if *self.views == MapViews::Icosahedron {
            let triangles = icosahedron::TRIANGLES.iter().map(|t| json!(t).to_string());
            members.push(("triangles", rows(triangles.collect())));
        }
        // A recipe is JSON already.
        members.push(("specula", recipe.to_owned()));
        let lines: Vec<String> =
            members.iter().map(|(name, value)| format!("  \"{name}\": {value}")).collect();
        Ok(format!("{{\n{}\n}}\n", lines.join(",\n")).into_bytes())
    }
}

const FRAME: &str = "view, right and up: right-handed, +Z up, the centre of a lat-long image along +X, its left quarter along +Y. \
                     view_file, right_file and up_file: right-handed, +Y up, the image's centre along +Z: \
                     (x, y, z) = (y, z, x) of the first";

/// Says how to look up a direction of the first frame.
fn lookup_text(layout: FileLayout) -> &'static str {
    match layout {
        FileLayout::LatLong => {
            "with the central direction (x, y, z): u = 0.5 - atan2(y, x) / (2 pi), v = acos(z) / pi, v = 0 at the top; \
             repeat in u, clamp in v"
        }
        FileLayout::Cube => {
            "with the central direction (x, y, z): a cube map sampled along (-y, z, x), faces +X -X +Y -Y +Z -Z in the \
             orientation of D3D, GL and Vulkan; in a picture they are stacked"
        }
        FileLayout::Sphere => {
            "with the central direction C: a = C.right, b = C.up, c = C.view, s = 1 / sqrt(2 (1 + c)), \
             u = (1 + a s) / 2, v = (1 - b s) / 2, v = 0 at the top; the rim is C = -view"
        }
    }
}

/// Says how to look up a view between those of the maps.
fn interpolation_text(views: &MapViews) -> String {
    match views {
        MapViews::Icosahedron => {
            "a view V lies in the triangle (a, b, c), three indices into maps, where w_a = V.(b x c), w_b = V.(c x a) and \
             w_c = V.(a x b) are 0 or more; divided by their sum they weigh the three maps, all looked up at \
             the same central direction"
                .into()
        }
        MapViews::Angles(angles) => format!(
            "linear in theta_o, the angle in radians between central direction and view, clamped; in a volume of \
             {0} slices at w = (theta_o / pi * {1} + 0.5) / {0}",
            angles.len(),
            angles.len().saturating_sub(1)
        ),
        MapViews::Table { side, view } => {
            let frame = match view {
                View::Global => "with the view (x, y, z) in the frame of `view`",
                View::Local => {
                    "with (x, y, z) = R^-1 V of the view V separately for each texel, R = R_z(beta) R_y(alpha), (alpha, beta) \
                     the angles of the texel's central direction"
                }
            };
            format!(
                "{frame}: column = {side} (0.5 - atan2(y, x) / (2 pi)) - 0.5, row = {side} acos(z) / pi - 0.5, map = {side} \
                 row + column, bilinear; columns repeat, past a pole the same row at column + {} (half a turn)",
                *side as f64 / 2.0
            )
        }
    }
}

/// An index as it is read. Members that only people and `specula` read are ignored.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an object with the members of an index")]
pub(crate) struct Index {
    format: String,
    version: u32,
    #[serde(default, rename = "method")]
    _method: IgnoredAny,
    #[serde(default = "reflection")]
    pub(crate) centre: CentreName,
    #[serde(default, rename = "central_direction")]
    _central_direction: IgnoredAny,
    pub(crate) views: Views,
    pub(crate) layout: FileLayout,
    #[serde(default, rename = "resolution")]
    _resolution: IgnoredAny,
    #[serde(default)]
    pub(crate) degree: Option<usize>,
    #[serde(default, rename = "frame")]
    _frame: IgnoredAny,
    #[serde(default, rename = "lookup")]
    _lookup: IgnoredAny,
    #[serde(default, rename = "interpolation")]
    _interpolation: IgnoredAny,
    pub(crate) maps: Vec<Entry>,
    #[serde(default, rename = "triangles")]
    _triangles: IgnoredAny,
    #[serde(default, rename = "specula")]
    _specula: IgnoredAny,
}

fn reflection() -> CentreName {
    CentreName::Reflection
}

impl Index {
    /// An index from its bytes, with or without a byte order mark.
    ///
    /// # Errors
    /// If it is not JSON of this shape, is of another version, names no map, or names a file by an absolute
    /// path.
    pub(crate) fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let index: Self = serde_json::from_slice(bytes)
            .map_err(|error| Failure::new(format!("not an index of reflection maps: {error}")))?;
        if index.format != FORMAT {
            return Err(Failure::new(format!("`format` is {:?}; expected {FORMAT:?}", index.format)));
        }
        if index.version != VERSION {
            return Err(Failure::new(format!(
                "`version` is {}; this program reads {VERSION}",
                index.version
            )));
        }
        if index.maps.is_empty() {
            return Err(Failure::new("`maps` is empty; expected a map for each view"));
        }
        if index.layout == FileLayout::Sphere && index.views != Views::Global {
            return Err(Failure::new(
                "layout \"sphere\" is a ball seen from its view in the world: expected `views` \"global\"",
            ));
        }
        for entry in &index.maps {
            let path = Path::new(&entry.file);
            if entry.file.is_empty()
                || path.components().any(|part| matches!(part, Component::RootDir | Component::Prefix(_)))
            {
                return Err(Failure::new(format!(
                    "`file` is {:?}; expected a path relative to the index",
                    entry.file
                )));
            }
        }
        Ok(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(maps: Vec<Entry>) -> Vec<u8> {
        let index = NewIndex {
            method: "cabral",
            centre: Centre::Normal,
            views: &MapViews::Icosahedron,
            layout: FileLayout::Sphere,
            resolution: 8,
            degree: 2,
            maps,
        };
        index.encode("{\"kind\":\"x\"}").unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let view = Direction::from_angles(0.5, 2.0);
        let entry = Entry::of_file("a.exr").seen_from(view).with_axes(shrm::sphere_map_axes(view));
        let bytes = written(vec![entry.clone()]);
        assert_eq!(containers::read_recipe(&bytes).as_deref(), Some("{\"kind\":\"x\"}"));
        let index = Index::decode(&bytes).unwrap();
        assert_eq!(
            (index.centre, index.views, index.layout),
            (CentreName::Normal, Views::Global, FileLayout::Sphere)
        );
        assert_eq!(index.degree, Some(2));
        assert_eq!(index.maps, [entry]);
        for (found, expected) in index.maps[0].axes().unwrap().iter().zip(shrm::sphere_map_axes(view)) {
            assert!((found.vector() - expected.vector()).length() < 1e-15);
        }
    }

    /// +Y of the file frame is up: +Z of ours.
    #[test]
    fn a_view_may_be_given_in_the_file_frame() {
        let text = r#"{"format": "explicit-reflection-maps", "version": 1, "views": "global", "layout": "cube",
            "maps": [{"file": "up.exr", "view_file": [0, 2, 0]}]}"#;
        let index = Index::decode(text.as_bytes()).unwrap();
        assert_eq!(index.maps[0].view().unwrap(), Direction::Z);
        assert_eq!(index.centre, CentreName::Reflection);
        assert_eq!(index.maps[0].axes().unwrap()[0], Direction::Y);
    }

    #[test]
    fn errors_say_what_was_expected() {
        let check = |from: &str, to: &str, expected: &str| {
            let text = String::from_utf8(written(vec![Entry::of_file("a.exr")])).unwrap();
            assert!(text.contains(from), "{from}");
            let message = Index::decode(text.replace(from, to).as_bytes()).unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        };
        check(
            "explicit-reflection-maps",
            "gltf",
            "`format` is \"gltf\"; expected \"explicit-reflection-maps\"",
        );
        check("\"version\": 1", "\"version\": 7", "`version` is 7; this program reads 1");
        check("\"a.exr\"", "\"/a.exr\"", "`file` is \"/a.exr\"; expected a path relative to the index");
        check("\"views\": \"global\"", "\"views\": \"local\"", "expected `views` \"global\"");
        check("\"views\"", "\"veiws\"", "unknown field `veiws`");
        check("{\"file\":\"a.exr\"}", "", "`maps` is empty");
        check("]", "", "not an index of reflection maps");
        let list = Index::decode(b"[]").unwrap_err().to_string();
        assert!(list.contains("expected an object with the members of an index"), "{list}");
        let marked = [&b"\xef\xbb\xbf"[..], &written(vec![Entry::of_file("a.exr")])].concat();
        assert!(Index::decode(&marked).is_ok());
        let entry = Entry::of_file("a.exr");
        let view = |entry: Entry| entry.view().unwrap_err().to_string();
        assert_eq!(view(entry.clone()), "the map in a.exr: neither `view` nor `view_file` is given");
        let nowhere = Entry { view_file: Some([0.0; 3]), ..entry.clone() };
        assert_eq!(
            view(nowhere),
            "the map in a.exr: `view_file` is [0.0, 0.0, 0.0], which is not a direction"
        );
        let up = Entry { view: Some([0.0, 0.0, 2.0]), ..entry.clone() };
        let two = Entry { view_file: Some([0.0, 0.0, 1.0]), ..up.clone() };
        assert!(
            view(two).ends_with("`view` and `view_file` are different directions; give only one of them")
        );
        let same = Entry { view_file: Some([0.0, 1.0, 0.0]), ..up.clone() };
        assert_eq!(same.view().unwrap(), Direction::Z);
        let angle = |entry: Entry| entry.angle().unwrap_err().to_string();
        assert!(view(up.clone().at_angle(1.0)).contains("`theta_o` is for `views` \"angles\""));
        assert!(angle(up.clone().at_angle(1.0)).ends_with("expected a `theta_o` and no view"));
        assert!(angle(entry.clone().at_angle(4.0)).ends_with("`theta_o` is 4; expected 0 to pi, in radians"));
        assert!(angle(entry).contains("`theta_o` is missing"));
        let axes = |entry: Entry| entry.axes().unwrap_err().to_string();
        let along = Entry { up: Some([0.0, 0.0, 1.0]), ..up.clone() };
        assert!(axes(along).contains("is parallel to the view"));
        // Up x view: +X x +Z is -Y.
        let ball = Entry { up: Some([1.0, 0.0, 0.0]), right: Some([0.0, -1.0, 0.0]), ..up.clone() };
        assert_eq!(ball.axes().unwrap()[0].vector().to_array(), [0.0, -1.0, 0.0]);
        assert!(axes(Entry { right: Some([0.0, 1.0, 0.0]), ..ball }).contains("mirrored"));
        assert!(axes(Entry { right: Some([0.0, 1.0, 0.0]), ..up }).contains("`right` is given without `up`"));
    }
}
