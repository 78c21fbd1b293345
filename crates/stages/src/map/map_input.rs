//! The spherical harmonic reflection map that an export starts from: synthesised from a reflection, or the
//! map that arrives.

use std::sync::Arc;

use engine::{Artifact, Context, Failure, Port, Reporter, Steps};
use sh::Degree;
use shrm::{
    BAKED_AT_ONCE, ByteBudget, DegreeRule, LampTables, MapContent, MapDegree, MapGrid, MapLayout,
    MapTolerance, Reflection, Shrm, Terms, View,
};
use sphere::{Cube, LatLong};

use super::degree_choice::{ACCEPT, Accept, DegreeChoice, missed, reached};
use crate::values::quantity::size;
use crate::values::{LampsName, MAX_RESOLUTION, Resolution, UntilStopped, artifacts, percent};

/// The revisions of the kernels that make maps.
pub(crate) const KERNELS: &[u32] = &[
    sh::revisions::TRANSFORM,
    sh::revisions::ROTATION,
    shrm::revisions::SYNTHESIS,
    shrm::revisions::RESAMPLING,
    shrm::revisions::FIT,
    shrm::revisions::BAKING,
    shrm::revisions::MEAN_LOBE,
    brdf::revisions::MODELS,
];

/// The revisions of the kernels that make maps of the least P that is enough.
pub(crate) const SMALL_MAP_KERNELS: &[u32] = &[
    sh::revisions::TRANSFORM,
    sh::revisions::ROTATION,
    shrm::revisions::DEGREES,
    shrm::revisions::MEAN_LOBE,
    shrm::revisions::SYNTHESIS,
    shrm::revisions::RESAMPLING,
    shrm::revisions::FIT,
    shrm::revisions::BAKING,
    brdf::revisions::MODELS,
];

/// The most numbers of a map of `"auto"` resolution: 64 MB in 32 bits.
const MOST_AUTO: usize = 1 << 24;

/// The bytes of a file that `"auto"` resolution does not exceed unless accuracy needs more.
const SMALL_BYTES: usize = 1_000_000;

/// The bytes above which a file is worth a warning; `"auto"` resolution does not exceed them.
pub(crate) const MOST_BYTES: usize = 16_000_000;

/// The interpolation error that is accepted to keep a file small, if none is given.
const COARSE: f64 = 0.03;

/// The interpolation error for `"auto"`, if none is given.
pub(crate) const ERROR: f64 = 0.01;

/// The map that the parameters ask for. A missing value means the default for a reflection, and any value for
/// a map that arrives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MapInput {
    /// The layout of the map; by default a cube.
    pub(crate) layout: Option<MapLayout>,
    /// The resolution of the map; by default `"auto"`.
    pub(crate) resolution: Option<Resolution>,
    /// The error of interpolation for `"auto"`; by default [`ERROR`].
    pub(crate) error: Option<f64>,
    /// The frame of the views; by default local.
    pub(crate) view: Option<View>,
    /// Whether a reflection's lamps are in the map.
    pub(crate) lamps: LampsName,
    /// How a file of few bytes is made; without it the map has all that its field has.
    pub(crate) small: Option<SmallMap>,
}

/// The part of a material that a map is of.
#[derive(Clone, Copy, Debug)]
pub(crate) enum PartOfMaterial<'a> {
    /// All of it.
    All,
    /// The diffuse part.
    Diffuse,
    /// The specular part, beside this field of the diffuse one.
    Specular(&'a Reflection),
}

/// What a map that is to take few bytes is chosen by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmallMap {
    /// How P is chosen.
    pub(crate) degree: DegreeChoice,
    /// The bytes of a coefficient in the file.
    pub(crate) per_coefficient: usize,
    /// Whether the file holds the coefficients that are zero too.
    pub(crate) with_zeros: bool,
}

/// The texels of a map, the frame of its views, and its degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MapShape {
    pub(crate) grid: MapGrid,
    pub(crate) view: View,
    /// The degree P.
    pub(crate) p: Degree,
    /// The degree P of the field that it is fitted to, if the lamps are in it.
    pub(crate) field: Degree,
}

/// A degree P, and unless it is given the rule that asked for it, the tolerance of the part of the material
/// that the map is of, and what P reaches.
#[derive(Clone, Copy)]
struct ChosenDegree {
    p: Degree,
    found: Option<(DegreeRule, MapTolerance, MapDegree)>,
}

impl ChosenDegree {
    /// The degree P of the field that a map with the lamps in it is fitted to, if the field has this one.
    fn field(&self, own: Degree) -> Degree {
        self.found.as_ref().map_or(own, |(.., map)| map.field)
    }
}

impl MapInput {
    /// The port, which takes a reflection or a map.
    pub(crate) fn port() -> Port {
        Port::one::<artifacts::Reflection>("reflection").or::<artifacts::Shrm>()
    }

    /// Parameters that contradict each other.
    pub(crate) fn check(&self) -> Vec<(&'static str, String)> {
        self.small.map_or_else(Vec::new, |small| small.degree.check())
    }

    /// The map. Its degrees and size are noted.
    ///
    /// # Errors
    /// If the parameters ask for a map other than the one that arrives, or for one that is too large.
    pub(crate) fn map(&self, context: &Context<'_>) -> Result<Arc<artifacts::Shrm>, Failure> {
        if context.inputs.type_at("reflection") == Some(artifacts::Shrm::TYPE) {
            let map = self.arriving(context.inputs.get::<artifacts::Shrm>("reflection")?)?;
            context.reporter.note(format!("P = {}: {}", map.0.p().get(), describe(&map.0)));
            return Ok(map);
        }
        self.map_of(
            &context.inputs.get::<artifacts::Reflection>("reflection")?.0,
            PartOfMaterial::All,
            &Steps::new(&context.reporter, 1),
        )
    }

    /// [`MapInput::map`] of a reflection, in one of the steps.
    pub(crate) fn map_of(
        &self,
        reflection: &Reflection,
        part: PartOfMaterial<'_>,
        steps: &Steps<'_>,
    ) -> Result<Arc<artifacts::Shrm>, Failure> {
        let reporter = steps.reporter();
        let mut tables = LampTables::default();
        let chosen = self.degree(reflection, part, &mut tables, reporter)?;
        let p = chosen.p;
        let cut = reflection.cut_in_view(p);
        let (grid, error_note, missed) = self.grid(&cut, p);
        missed.into_iter().for_each(|missed| reporter.warn(missed));
        let view = self.view.unwrap_or(View::Local);
        let map = match self.lamps {
            LampsName::Baked if reflection.lamps().is_some() => {
                let field = reflection.cut_in_view(chosen.field(reflection.brdf().p()));
                let soft = reporter.until_stopped(|stop| field.synthesise(grid, View::Local, stop))?;
                let steps = steps.part(1, grid.len().div_ceil(BAKED_AT_ONCE));
                let texels: Vec<usize> = (0..grid.len()).collect();
                let local = steps
                    .until_stopped(|stop| reflection.bake_texels(&soft, p, &texels, &mut tables, stop))?;
                if view == View::Global { local.to_global() } else { local }
            }
            LampsName::Baked | LampsName::Separate => {
                reporter.until_stopped(|stop| cut.synthesise(grid, view, stop))?
            }
        };
        reporter.check_cancelled()?;
        let (f, p) = (reflection.brdf().f().get(), map.p().get());
        reporter.note(format!("F = {f}, P = {p}: {}{error_note}", describe(&map)));
        Ok(Arc::new(artifacts::Shrm(map)))
    }

    /// The texels, the frame and the degree P of [`MapInput::map_of`]'s map.
    pub(crate) fn shape(
        &self,
        reflection: &Reflection,
        part: PartOfMaterial<'_>,
        reporter: &Reporter,
    ) -> Result<MapShape, Failure> {
        let chosen = self.chosen_degree(reflection, part, &mut LampTables::default(), reporter)?;
        let (p, field) = (chosen.p, chosen.field(reflection.brdf().p()));
        let (grid, ..) = self.grid(&reflection.cut_in_view(p), p);
        Ok(MapShape { grid, view: self.view.unwrap_or(View::Local), p, field })
    }

    /// The degree P of the map of a reflection. What was chosen is noted, with a warning if that misses the
    /// tolerance.
    fn degree(
        &self,
        reflection: &Reflection,
        part: PartOfMaterial<'_>,
        tables: &mut LampTables,
        reporter: &Reporter,
    ) -> Result<ChosenDegree, Failure> {
        let (own, bakes) = (reflection.brdf().p(), self.bakes(reflection));
        let chosen = self.chosen_degree(reflection, part, tables, reporter)?;
        let ChosenDegree { p, found: Some((asked, tolerance, map)) } = chosen else { return Ok(chosen) };
        if p < own || bakes {
            let lamps = if bakes { " and its lamps" } else { "" };
            reporter.note(format!(
                "the map takes P = {}: compared with the field at P = {}{lamps}, {}",
                p.get(),
                own.get(),
                reached(tolerance, &map)
            ));
        }
        if !map.is_met {
            let lamps = if bakes {
                "; lamps = \"separate\" leaves the suns and lamps, which cause most of it, to the renderer"
            } else {
                ""
            };
            reporter.warn(format!("{}{lamps}", missed(asked, &map)));
        }
        Ok(chosen)
    }

    /// The degree P of the map of a reflection: its own, or the least that is enough.
    fn chosen_degree(
        &self,
        reflection: &Reflection,
        part: PartOfMaterial<'_>,
        tables: &mut LampTables,
        reporter: &Reporter,
    ) -> Result<ChosenDegree, Failure> {
        let (own, bakes) = (reflection.brdf().p(), self.bakes(reflection));
        let given = ChosenDegree { p: own, found: None };
        let Some(SmallMap { degree, .. }) = self.small else { return Ok(given) };
        // Degrees that the manifest names are kept, unless it asks for less here.
        let is_chosen = reflection.is_for_light() || degree.accept.is_some() || degree.most_p.is_some();
        let is_exact = own.get() == 0 && reflection.is_for_light();
        if is_exact || !(is_chosen || bakes) {
            return Ok(given);
        }
        let (share, base) = match part {
            PartOfMaterial::All => (1.0, None),
            PartOfMaterial::Diffuse => (shrm::degrees::DIFFUSE, None),
            PartOfMaterial::Specular(base) => (1.0, Some(base)),
        };
        let terms = self.terms(reflection);
        let asked = degree.rule(ACCEPT, terms.small_p(), terms);
        let asked = if is_chosen { asked } else { DegreeRule { most_p: own.get(), ..asked } };
        let tolerance = asked.tolerance.scaled(share);
        let (rule, content) =
            (DegreeRule { tolerance, ..asked }, MapContent { lamps: self.lamps == LampsName::Baked, base });
        let map = reporter.until_stopped(|stop| match is_chosen {
            true => reflection.map_degree(content, rule, tables, stop),
            false => reflection.baked_error(content, own, rule, tables, stop),
        })?;
        Ok(ChosenDegree { p: map.p, found: Some((asked, tolerance, map)) })
    }

    /// Whether lamps that are beside a reflection are to be in its map.
    fn bakes(&self, reflection: &Reflection) -> bool {
        self.lamps == LampsName::Baked && reflection.lamps().is_some()
    }

    /// The texels to synthesise, a note on the error of look-ups, and a warning if it misses the tolerance.
    /// The map has degree `p`, which may exceed that of the field if the lamps are in it.
    fn grid(&self, reflection: &Reflection, p: Degree) -> (MapGrid, String, Option<String>) {
        let layout = self.layout.unwrap_or(MapLayout::Cube);
        let given = self.error.unwrap_or(ERROR);
        let whole = match (self.lamps, reflection.lamps()) {
            (LampsName::Baked, Some(_)) => &reflection.with_whole_light(),
            _ => reflection,
        };
        let auto = whole.resolution(layout, given);
        let is_auto = self.resolution.unwrap_or(Resolution::Auto) == Resolution::Auto;
        let wanted = auto.texels.min(MAX_RESOLUTION);
        let resolution = match (self.resolution.unwrap_or(Resolution::Auto), self.budget(reflection, p)) {
            (Resolution::Fixed(resolution), _) => resolution,
            (Resolution::Auto, None) => wanted.min(self.affordable(reflection)),
            (Resolution::Auto, Some(budget)) => {
                whole.resolution_within(layout, given, budget).texels.min(MAX_RESOLUTION)
            }
        };
        // What keeps a file small is no error that is missed.
        let error = if is_auto && self.error.is_none() && self.small.is_some() { COARSE } else { given };
        let enough = whole.resolution(layout, error);
        // The error falls with the square of the resolution.
        let estimate = auto.estimated_error * math::powi(auto.texels as f64 / resolution as f64, 2);
        let mut error_note = format!(
            "; bilinear look-ups have an estimated error of {} of the RMS radiance",
            percent(estimate)
        );
        if let Some(budget) = self.budget(reflection, p).filter(|_| is_auto && resolution < wanted) {
            error_note.push_str(&format!(
                ", so that the file stays small: resolution = {wanted} has {} and takes {}",
                percent(estimate * math::powi(resolution as f64 / wanted as f64, 2)),
                size((layout.grid(wanted).len() * budget.per_texel) as u64)
            ));
        }
        let missed = (estimate > error && (is_auto || self.error.is_some())).then(|| {
            let way = if is_auto { "\"auto\" stops at" } else { "it has" };
            format!(
                "the map is too coarse for its reflection: between its texels it is off by about {} of the \
                 RMS radiance, and {} was allowed; {way} {resolution} texels along an edge, and {} would be \
                 enough; {}",
                percent(estimate),
                percent(error),
                (enough.texels as f64 * (enough.estimated_error / error).max(1.0).sqrt()).ceil(),
                self.remedy(reflection)
            )
        });
        (layout.grid(resolution), error_note, missed)
    }

    /// Advises how to make a map smooth enough.
    fn remedy(&self, reflection: &Reflection) -> &'static str {
        match (self.lamps, reflection.lamps()) {
            (LampsName::Baked, Some(_)) => {
                "lamps = \"separate\" leaves the suns and lamps, which need it, to the renderer"
            }
            _ => "a larger roughness or a lower `degree` needs fewer, and `resolution` sets more",
        }
    }

    /// The coefficients that the file of a map has, zeros included.
    fn terms(&self, reflection: &Reflection) -> Terms {
        let with_zeros = self.small.is_some_and(|small| small.with_zeros) || self.view == Some(View::Global);
        if reflection.is_azimuth_free() && !with_zeros { Terms::Zonal } else { Terms::All }
    }

    /// The bytes that a file may take, if they count.
    fn budget(&self, reflection: &Reflection, p: Degree) -> Option<ByteBudget> {
        let SmallMap { per_coefficient, .. } = self.small?;
        let per_texel = per_coefficient
            * match self.terms(reflection) {
                Terms::Zonal => p.get() + 1,
                Terms::All => p.rows(),
            };
        // An error that is given is kept, whatever the file takes, up to the most.
        let small = if self.error.is_some() { MOST_BYTES } else { SMALL_BYTES };
        Some(ByteBudget { per_texel, small, most: MOST_BYTES, coarse: COARSE })
    }

    /// The highest resolution at which a map has [`MOST_AUTO`] numbers, a multiple of 4.
    fn affordable(&self, reflection: &Reflection) -> usize {
        let p = reflection.brdf().p().get();
        let rows = if reflection.is_azimuth_free() { p + 1 } else { (p + 1) * (p + 1) };
        let shapes = match self.layout.unwrap_or(MapLayout::Cube) {
            MapLayout::Cube => 6,
            MapLayout::LatLong => 2,
        };
        ((MOST_AUTO / (3 * rows * shapes)).isqrt() / 4 * 4).max(4)
    }

    /// The map that arrives, made global if that is asked for.
    fn arriving(&self, map: Arc<artifacts::Shrm>) -> Result<Arc<artifacts::Shrm>, Failure> {
        let mismatch = |parameter: &str, asked: &str| {
            let found = shape(&map.0);
            Err(Failure::new(format!("{parameter} = {asked}, but the connected map is {found}"))
                .help(format!("remove {parameter}, or make a new map from a reflection")))
        };
        let (layout, resolution) = match map.0.grid() {
            MapGrid::Cube(cube) => (MapLayout::Cube, cube.edge),
            MapGrid::LatLong(grid) => (MapLayout::LatLong, grid.height),
        };
        match self.layout {
            Some(MapLayout::Cube) if layout != MapLayout::Cube => return mismatch("layout", "\"cube\""),
            Some(MapLayout::LatLong) if layout != MapLayout::LatLong => {
                return mismatch("layout", "\"lat-long\"");
            }
            _ => {}
        }
        match self.resolution {
            Some(Resolution::Auto) => return mismatch("resolution", "\"auto\""),
            Some(Resolution::Fixed(asked)) if asked != resolution => {
                return mismatch("resolution", &asked.to_string());
            }
            _ => {}
        }
        if let Some(error) = self.error {
            return mismatch("error", &error.to_string());
        }
        let DegreeChoice { accept, most_p, .. } = self.small.map(|small| small.degree).unwrap_or_default();
        if let Some(Accept([p95, p99])) = accept {
            return mismatch("accept", &format!("[{p95}, {p99}]"));
        }
        if let Some(most_p) = most_p {
            return mismatch("most-p", &most_p.to_string());
        }
        match (self.view, map.0.view()) {
            (Some(View::Local), View::Global) => mismatch("view", "\"local\""),
            (Some(View::Global), View::Local) => Ok(Arc::new(artifacts::Shrm(map.0.to_global()))),
            _ => Ok(map),
        }
    }
}

/// `a local cube of 64`.
fn shape(map: &Shrm) -> String {
    let view = match map.view() {
        View::Local => "local",
        View::Global => "global",
    };
    match map.grid() {
        MapGrid::Cube(Cube { edge }) => format!("a {view} cube of {edge}"),
        MapGrid::LatLong(LatLong { width, height }) => format!("a {view} lat-long map of {width} x {height}"),
    }
}

fn describe(map: &Shrm) -> String {
    let kept = match map.terms() {
        Terms::All => "",
        Terms::Zonal => " with q = 0; all others are zero",
    };
    format!("{}, {} texels of {} coefficients{kept}", shape(map), map.grid().len(), map.rows())
}
