//! The spherical harmonic reflection map that an export starts from: synthesised from a reflection, or the
//! map that arrives.

use std::sync::Arc;

use engine::{Artifact, Context, Failure, Port, Steps};
use sh::Degree;
use shrm::{BAKED_AT_ONCE, MOST_P, MapGrid, MapLayout, Reflection, Shrm, Terms, View};
use sphere::{Cube, LatLong};

use crate::values::{LampsName, MAX_RESOLUTION, Resolution, UntilStopped, artifacts, percent};

/// The revisions of the kernels that make maps.
pub(crate) const KERNELS: &[u32] = &[
    sh::revisions::TRANSFORM,
    sh::revisions::ROTATION,
    shrm::revisions::SYNTHESIS,
    shrm::revisions::RESAMPLING,
    shrm::revisions::FIT,
    shrm::revisions::BAKING,
    brdf::revisions::MODELS,
];

/// The most numbers of a map of `"auto"` resolution: 64 MB in 32 bits.
const MOST_AUTO: usize = 1 << 24;

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
}

impl MapInput {
    /// The port, which takes a reflection or a map.
    pub(crate) fn port() -> Port {
        Port::one::<artifacts::Reflection>("reflection").or::<artifacts::Shrm>()
    }

    /// Parameters that contradict each other.
    pub(crate) fn check(&self) -> Vec<(&'static str, String)> {
        match (self.error, self.resolution) {
            (Some(_), Some(Resolution::Fixed(_))) => {
                vec![("error", "only resolution = \"auto\" uses it".into())]
            }
            _ => Vec::new(),
        }
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
            &Steps::new(&context.reporter, 1),
        )
    }

    /// [`MapInput::map`] of a reflection, in one of the steps.
    pub(crate) fn map_of(
        &self,
        reflection: &Reflection,
        steps: &Steps<'_>,
    ) -> Result<Arc<artifacts::Shrm>, Failure> {
        let reporter = steps.reporter();
        let (grid, error_note, missed) = self.grid(reflection);
        missed.into_iter().for_each(|missed| reporter.warn(missed));
        let view = self.view.unwrap_or(View::Local);
        let map = match self.lamps {
            LampsName::Baked => {
                let soft = reporter.until_stopped(|stop| reflection.synthesise(grid, View::Local, stop))?;
                let steps = steps.part(1, grid.len().div_ceil(BAKED_AT_ONCE));
                let texels: Vec<usize> = (0..grid.len()).collect();
                let p = soft.p().max(Degree::new(MOST_P).unwrap_or(Degree::MAX));
                let local = steps.until_stopped(|stop| reflection.bake_texels(&soft, p, &texels, stop))?;
                if view == View::Global { local.to_global() } else { local }
            }
            LampsName::Separate => reporter.until_stopped(|stop| reflection.synthesise(grid, view, stop))?,
        };
        reporter.check_cancelled()?;
        let (f, p) = (reflection.brdf().f().get(), reflection.brdf().p().get());
        reporter.note(format!("F = {f}, P = {p}: {}{error_note}", describe(&map)));
        Ok(Arc::new(artifacts::Shrm(map)))
    }

    /// The texels to synthesise, a note on the error of look-ups, and a warning if it misses the tolerance.
    fn grid(&self, reflection: &Reflection) -> (MapGrid, String, Option<String>) {
        let layout = self.layout.unwrap_or(MapLayout::Cube);
        let error = self.error.unwrap_or(ERROR);
        let auto = match (self.lamps, reflection.lamps()) {
            (LampsName::Baked, Some(_)) => reflection.with_whole_light().resolution(layout, error),
            _ => reflection.resolution(layout, error),
        };
        let resolution = match self.resolution.unwrap_or(Resolution::Auto) {
            Resolution::Fixed(resolution) => resolution,
            Resolution::Auto => auto.texels.min(MAX_RESOLUTION).min(self.affordable(reflection)),
        };
        // The error falls with the square of the resolution.
        let estimate = auto.estimated_error * math::powi(auto.texels as f64 / resolution as f64, 2);
        let error_note = format!(
            "; bilinear look-ups have an estimated error of {} of the RMS radiance",
            percent(estimate)
        );
        let is_auto = self.resolution.unwrap_or(Resolution::Auto) == Resolution::Auto;
        let missed = (estimate > error && (is_auto || self.error.is_some())).then(|| {
            let way = if is_auto { "\"auto\" stops at" } else { "it has" };
            format!(
                "the map is too coarse for what it reflects: between its texels it is off by about {} of the RMS radiance, \
                 and {} was allowed; {way} {resolution} texels along an edge, and {} would do; {}",
                percent(estimate),
                percent(error),
                (auto.texels as f64 * (auto.estimated_error / error).max(1.0).sqrt()).ceil(),
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

    /// The highest resolution at which a map has [`MOST_AUTO`] numbers, a multiple of 4.
    fn affordable(&self, reflection: &Reflection) -> usize {
        let p = match (self.lamps, reflection.lamps(), reflection.brdf().p().get()) {
            (LampsName::Baked, Some(_), p @ 1..) => p.max(MOST_P),
            (_, _, p) => p,
        };
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
            Err(Failure::new(format!("{parameter} = {asked}, but the map that arrives is {found}"))
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
