//! Draws a mesh under an environment, shaded with the maps that engines will use: a picture, or a turntable.
//!
//! ```toml
//! [stage.preview]
//! kind = "preview"
//! inputs = { reflection = "reflection", environment = "environment", material = "material" }
//! modes = ["prefiltered", "cabral", "kautz-mccool", "local-shrm"]
//! compare = "brute-force"
//! mesh = "torus-knot"
//! size = 320
//!
//! [stage.turntable]
//! kind = "preview"
//! inputs = { reflection = "reflection", environment = "environment", mesh = "mesh" }
//! frames = 24
//! turn = "light"
//! ```
//!
//! `reflection` is the reflected light of a material (`reflection`), or a reflection map that was read back
//! (`shrm`). `environment` is the light that the reflection was made from; it is visible behind the mesh
//! and in mirrors. If you turned the lighting, connect the environment turned in the same way: `rotate`
//! turns both. Lighting without an environment, such as that of `circular-lights`, is drawn as a picture of
//! its lights. The table below lists the other inputs that each mode needs. `mesh` replaces the built-in
//! shape.
//!
//! ## Modes
//!
//! `modes` sets how the surface is shaded. Several modes are drawn side by side in one picture, each with
//! its name.
//!
//! | mode | the reflected light comes from |
//! | --- | --- |
//! | `local-shrm` | the local SHRM, evaluated at every pixel, and the lamps |
//! | `global-shrm` | the global SHRM, evaluated once per frame into a reflection map for a distant viewer, and the lamps |
//! | `cabral` | Cabral's twelve maps, blended by the view |
//! | `kautz-mccool` | Kautz and McCool's texture, by the angle to the view |
//! | `prefiltered` | the plain reflection map, the mean over all views |
//! | `irradiance` | nine coefficients of the light, for a white matte surface, with the least window that leaves nothing negative |
//! | `mirror` | the environment, for a perfect mirror |
//! | `brute-force` | the sum of all light: `light-samples` samples at every sample of a pixel; needs `material` |
//! | `table` | a BRDF table at every pixel, under the light at the vertices; needs `table` (`tabulate-brdf`) |
//! | `transfer` | the same with the shadows of the mesh on itself; also needs `transfer` (`precompute-transfer`) of the `mesh` |
//! | `shadowed-brute-force` | the sum of all light that the mesh does not block, with traced shadows; needs `material` |
//! | `samples` | none: a diagram of the points that importance sampling draws; needs `reflection` or `material` |
//! | `taps` | a few look-ups into the blurred light at every pixel, and the lights beside it; needs `scale-space` (`scale-space`) and `taps` (`fit-taps`) |
//!
//! A material with a matte base under a highlight has a map of each part in the first five modes, each about
//! its own direction, as the files of the exports have by default. What both show is added.
//!
//! If `material` has the texture of a glTF file, a connected `mesh` is shown with it, by its own coordinates:
//! connect the mesh of the same file. The maps are those of the texture's mean; each sample changes their
//! radiance by its own base colour.
//!
//! If a table has several materials, `blend`, a number at each vertex of the `mesh` (`vertex-blend`), or
//! two, blends between them. The first five modes need `reflection`. `table` and `transfer` use the light's
//! coefficients up to the degree of the table or the transfer, at most 30; their references are
//! `brute-force` and `shadowed-brute-force`. The back of a surface is black in both.
//!
//! Suns and lamps that are separate from the coefficients, those of `reflection` or of lighting without an
//! environment, are reflected by the `material` itself in these two modes, as sharp as they are; in
//! `transfer` with at least 16 rays toward each, which the mesh may block. Connect `material` for that, or a
//! `reflection` that keeps it. A table of several materials has the lamps in the coefficients.
//!
//! `light-field` (a stage of that kind, or `light-probes`) lights the mesh in `table` and `transfer` in place
//! of the environment: each vertex has the light of its own place. Probes are blended by what they see of the
//! vertex. The field turns with the light, about the origin. The background and the other modes show the
//! environment, so their difference from these two is no error.
//!
//! `samples` shows three mirror balls with the environment, the lobe of the material toward the camera, and
//! their product, and 512 points drawn from each: of the light, its texels; of the lobe, the coefficients
//! of `reflection`, or those of `material` to degree 19. The surface of the lobe leans back from the camera
//! by 30 degrees, regardless of the mesh. This mode is not compared with others.
//!
//! The points that directions are made from fill the unit square evenly. With `points = "random"` they are
//! independent, in the diagram as well as in brute force, where each sample of a pixel has its own: that
//! shows how much noise even points save.
//!
//! Separate suns and lamps (see `project-sh`) are not in the local and the global SHRM: the material of the
//! reflection adds each of them at every sample, as an engine can do with files of `export-shrm` with
//! `lamps = "separate"`; before that, negative values of a map become 0. With `lamps = "baked"` the two
//! maps include them, as the files of `export-shrm` do by default, with the degrees P of those. The maps of
//! `cabral`, `kautz-mccool` and `prefiltered` contain all light, as their exports do.
//!
//! `taps` looks like a renderer that reads the files of `export-taps`, in 32-bit numbers. Connect the scale
//! space of `environment` and the taps of the material. The material itself reflects the separate lights of
//! the scale space at every sample. Brushed metal has taps that follow its tangent, and shows its streak,
//! as in `brute-force`; `export-taps` may find that fewer of them are enough. This mode needs neither
//! `reflection` nor `resolution`.
//!
//! `compare` sets the mode that the others are compared with. Its picture comes first, and below each other
//! mode is the absolute difference, amplified, with the 95th and 99th percentile of the error in stops, as
//! `report` measures it: |log2((value + e) / (reference + e))| over the channels of the pixels that show
//! only the mesh, with e = 1 % of the light's mean radiance. The relative RMS follows: the root of the mean
//! squared difference, divided by the RMS of the reference. In it one bright lamp can outweigh everything
//! else that the eye compares. Brute force itself is noisy; more `light-samples` reduce the noise.
//!
//! Maps are made as in the exports, on cubes with an edge of `resolution`; Kautz and McCool's texture has
//! `slices` slices.
//!
//! ## Camera and light
//!
//! The camera circles the mesh. At yaw 0 it is on the +X side, in front of glTF models, with the centre of
//! the environment's image behind it; a positive yaw moves it toward +Y, a positive pitch moves it up. At
//! `zoom` 1 the bounding ball of a mesh of any size fits the picture's shorter side. `light-yaw` and then
//! `light-pitch` turn the light, as in `rotate`.
//!
//! `frames` is the number of pictures in one full turn of the camera, or of the light around +Z,
//! counter-clockwise as seen from above. They become an animation, or a strip of all frames.
//!
//! ## CPU and GPU
//!
//! With `backend = "cpu"` the output is bit-identical on every run, as for all stages. A graphics device
//! (`"gpu"`) is faster and draws the same to within two steps of 255 for all but a few pixels; its output
//! depends on the device, which is not part of the key. If there is no device, or it cannot draw the scene,
//! the CPU draws instead, with a warning that says why. That picture is cached like any result: to redraw
//! it later on a device, build the stage with `--force`.
//!
//! ## Files
//!
//! `.png`: 8-bit sRGB. An animation is an animated PNG; programs that do not support those show the first
//! frame.

use std::ops::RangeInclusive;

use containers::{write_apng, write_png};
use engine::{Context, Failure, Kind, Output, Port, Product, Steps, choice, parameters};
use envmap::ToneMap;
use preview::{Camera, MapSizes, Mode, PointSet, Scene, Shot, Show};
use sphere::Rotation;

use super::sheet::described;
use crate::values::{LampsName, STOPS, ToneMapName, artifacts, percent};
use comparison::{ComparisonPanel, ComparisonSheet};
use fallback_renderer::FallbackRenderer;
use scene::{SceneSettings, scene};
use values::{Backend, BackgroundChoice, BuiltInMesh, Size};

mod comparison;
mod fallback_renderer;
mod probes_at_places;
mod scene;
mod values;

choice! {
    /// What the reflected light comes from.
    pub(crate) enum ModeName: Mode {
        /// The local SHRM at every pixel.
        LocalShrm,
        /// The global SHRM, once a frame.
        GlobalShrm,
        /// Cabral's twelve maps.
        Cabral,
        /// Kautz and McCool's texture.
        KautzMcCool,
        /// One reflection map, the mean over all views.
        Prefiltered,
        /// Nine coefficients of the light, for a white matte surface.
        Irradiance,
        /// The environment, for a perfect mirror.
        Mirror,
        /// The sum of all light, by many samples.
        BruteForce,
        /// A BRDF table, looked up at every pixel.
        Table,
        /// A BRDF table, with the shadows of the mesh on itself.
        Transfer,
        /// The sum of all light that the mesh does not hide, with traced shadows.
        ShadowedBruteForce,
        /// A diagram of the points that importance sampling draws.
        Samples,
        /// The taps of the material into the scale space of the light.
        Taps,
    }
}

choice! {
    /// The points of the unit square that samples are made from.
    pub(crate) enum PointsName: PointSet {
        /// Points that fill the square evenly.
        Even = "even",
        /// Independent points.
        Random = "random",
    }
}

choice! {
    /// What turns from frame to frame.
    pub(crate) enum Turn {
        /// The camera circles the mesh.
        Camera = "camera",
        /// The light turns around +Z.
        Light = "light",
    }
}

choice! {
    /// How several frames are written.
    pub(crate) enum PreviewFormat {
        /// One picture.
        Png = "png",
        /// An animated PNG.
        Apng = "apng",
        /// All frames in one picture.
        Strip = "strip",
    }
}

parameters! {
    /// Parameters of `preview`.
    pub(crate) struct Parameters {
        /// The built-in mesh that is drawn if no mesh is connected.
        mesh: BuiltInMesh = BuiltInMesh::Sphere,
        /// Pixels of each picture: the edge of a square, or [width, height].
        size: Size = Size([512; 2]),
        /// How the surface is shaded, side by side; see Modes.
        modes: Vec<ModeName> = vec![ModeName(Mode::LocalShrm)],
        /// The mode that the others are compared with. Default: none.
        compare: Option<ModeName> = None,
        /// The factor by which differences are amplified.
        #[range(1.0..=1000.0)]
        amplify: f64 = 8.0,
        /// The camera's yaw around +Z, in degrees.
        #[range(DEGREES)]
        camera_yaw: f64 = 0.0,
        /// The camera's pitch, in degrees: up is positive.
        #[range(-90.0..=90.0)]
        camera_pitch: f64 = 10.0,
        /// The size of the mesh in the picture; see Camera and light.
        #[range(0.1..=100.0)]
        zoom: f64 = 0.9,
        /// The field of view over the shorter side of the picture, in degrees.
        #[range(1.0..=120.0)]
        field: f64 = 30.0,
        /// The turn of the light around +Z, in degrees.
        #[range(DEGREES)]
        light_yaw: f64 = 0.0,
        /// The turn of the light around +Y, in degrees; a positive pitch tilts the horizon at +X down.
        #[range(DEGREES)]
        light_pitch: f64 = 0.0,
        /// How many stops brighter than usual the picture is; see Exposure in contact-sheet.
        #[range(STOPS)]
        exposure: f64 = 0.0,
        /// The tone curve of exposed radiance: with a film's shoulder, or cut at white.
        curve: ToneMapName = ToneMapName(ToneMap::Filmic),
        /// The background: the environment, its reconstruction from harmonics up to degree 30, or a colour,
        /// which exposure does not change.
        background: BackgroundChoice = BackgroundChoice::Environment,
        /// Texels along the edge of a cube's face, for every map.
        #[range(4..=512)]
        resolution: usize = 64,
        /// Slices of Kautz and McCool's texture.
        #[range(2..=256)]
        slices: usize = 16,
        /// Whether separate lamps are added at every pixel, or are part of the local and the global SHRM.
        lamps: LampsName = LampsName::Separate,
        /// Samples along each side of a pixel.
        #[range(1..=4)]
        samples: usize = 2,
        /// Samples of light at each sample of a pixel in brute-force.
        #[range(1..=65536)]
        light_samples: usize = 64,
        /// The points that light samples and the diagram of `samples` are made from; see Modes.
        points: PointsName = PointsName(PointSet::Even),
        /// The number of pictures in one full turn.
        #[range(1..=360)]
        frames: usize = 1,
        /// With several frames: what turns.
        turn: Turn = Turn::Camera,
        /// What is written. Default: "png" for one frame and "apng" for several.
        format: Option<PreviewFormat> = None,
        /// With format "apng": seconds for one full turn.
        #[range(0.1..=600.0)]
        seconds: f64 = 4.0,
        /// What draws; see CPU and GPU.
        backend: Backend = Backend::Cpu,
    }
}

/// The range of angles: any number of turns, as long as fractions of a degree stay exact.
const DEGREES: RangeInclusive<f64> = -1e6..=1e6;

/// The most pixels of all frames together: 192 MiB of codes, and as much again if they become a strip.
const MOST_PIXELS: usize = 1 << 26;

impl Parameters {
    fn format(&self) -> PreviewFormat {
        self.format.unwrap_or(if self.frames == 1 { PreviewFormat::Png } else { PreviewFormat::Apng })
    }

    fn compare(&self) -> Option<Mode> {
        self.compare.map(|name| name.0)
    }

    /// The modes from left to right: the one that the others are compared with comes first.
    fn columns(&self) -> Vec<Mode> {
        let others = self.modes.iter().map(|name| name.0);
        self.compare().into_iter().chain(others.filter(|mode| Some(*mode) != self.compare())).collect()
    }

    /// The arrangement of the frames in the written picture: columns and rows.
    fn strip(&self) -> [usize; 2] {
        match self.format() {
            // Frames of a single picture are side by side; rows of several pictures are stacked.
            PreviewFormat::Strip if self.columns().len() == 1 => [self.frames, 1],
            PreviewFormat::Strip => [1, self.frames],
            PreviewFormat::Png | PreviewFormat::Apng => [1, 1],
        }
    }

    fn scene(&self) -> SceneSettings {
        SceneSettings {
            modes: self.columns(),
            mesh: self.mesh,
            sizes: MapSizes { edge: self.resolution, slices: self.slices },
            holds_lamps: self.lamps == LampsName::Baked,
        }
    }

    fn sheet(&self) -> ComparisonSheet {
        ComparisonSheet {
            picture: self.size.0,
            columns: self.columns().len(),
            compared: self.compare.is_some(),
        }
    }
}

/// The kind `preview`.
pub(crate) struct Preview;

impl Kind for Preview {
    type Parameters = Parameters;

    const NAME: &'static str = "preview";
    const REVISION: u32 = 9;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        sh::revisions::WINDOW,
        sh::revisions::ROTATION,
        brdf::revisions::MODELS,
        shrm::revisions::SYNTHESIS,
        shrm::revisions::RESAMPLING,
        shrm::revisions::BAKING,
        shrm::revisions::DEGREES,
        shrm::revisions::MEAN_LOBE,
        envmap::revisions::RESAMPLING,
        transfer::revisions::SHADING,
        probes::revisions::BLEND,
    ];
    const TEXT: &'static str = include_str!("preview.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Reflection>("reflection").or::<artifacts::Shrm>().optional(),
            Port::one::<artifacts::Environment>("environment").or::<artifacts::Lighting>(),
            Port::one::<artifacts::Material>("material").optional(),
            Port::one::<artifacts::Mesh>("mesh").optional(),
            Port::one::<artifacts::BrdfTable>("table").optional(),
            Port::one::<artifacts::Transfer>("transfer").optional(),
            Port::one::<artifacts::VertexBlend>("blend").optional(),
            Port::one::<artifacts::LightField>("light-field").or::<artifacts::Probes>().optional(),
            Port::one::<artifacts::ScaleSpace>("scale-space").optional(),
            Port::one::<artifacts::Taps>("taps").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".png".into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        check(parameters)
    }

    /// Whether the picture is the same everywhere: devices draw pictures that are alike, and not the same.
    fn is_shared(parameters: &Parameters) -> bool {
        parameters.backend == Backend::Cpu
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let scene = scene(&parameters.scene(), context)?;
        reporter.check_cancelled()?;
        let usual = scene.light.exposure();
        let exposure = usual.stops + parameters.exposure;
        reporter.note(described(usual, parameters.exposure));
        let pictures = Steps::new(reporter, parameters.frames * parameters.columns().len());
        let mut renderer = FallbackRenderer::new(parameters.backend, &pictures);
        let sheet = parameters.sheet();
        let mut frames = Vec::new();
        let mut worst = Vec::new();
        for frame in 0..parameters.frames {
            let turned = 360.0 * frame as f64 / parameters.frames as f64;
            let shot = shot(parameters, &scene, exposure, turned);
            frames.push(sheet.draw(&panels(parameters, &scene, &shot, &mut renderer, &mut worst)?));
            reporter.check_cancelled()?;
        }
        for (mode, error) in worst {
            let most = if parameters.frames > 1 { " at most" } else { "" };
            reporter.note(format!("{}: {}", mode.label(), said(error, most)));
        }
        let [width, height] = sheet.size();
        let recipe = Some(context.recipe());
        let bytes = match parameters.format() {
            PreviewFormat::Apng => {
                let milliseconds = (1000.0 * parameters.seconds / parameters.frames as f64).round();
                write_apng(width, height, &frames, milliseconds.clamp(1.0, 65535.0) as u16, recipe)?
            }
            PreviewFormat::Png | PreviewFormat::Strip => {
                let [columns, rows] = parameters.strip();
                let strip = comparison::strip(&frames, sheet.size(), columns);
                write_png(columns * width, rows * height, &strip, recipe)?
            }
        };
        Ok(Output::files(vec![bytes]))
    }
}

fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
    let mut errors = Vec::new();
    if parameters.modes.is_empty() {
        errors.push(("modes", "the list is empty; name one, such as \"local-shrm\"".into()));
    }
    for (place, mode) in parameters.modes.iter().enumerate() {
        if parameters.modes[..place].contains(mode) {
            errors.push(("modes", format!("{:?} is listed twice", mode.0.name())));
        }
    }
    if parameters.compare.is_some() && parameters.columns().len() == 1 {
        errors.push(("compare", "`modes` has no other mode to compare with it".into()));
    }
    if parameters.compare.is_some() && parameters.columns().iter().any(|mode| mode.is_diagram()) {
        errors.push(("compare", "\"samples\" is a diagram, which no other mode is compared with".into()));
    }
    match parameters.format() {
        PreviewFormat::Png if parameters.frames > 1 => {
            let frames = parameters.frames;
            errors.push(("format", format!("{frames} frames need \"apng\" or \"strip\"")));
        }
        PreviewFormat::Apng | PreviewFormat::Strip if parameters.frames == 1 => {
            errors.push(("format", "one frame needs \"png\"; set frames to the number of frames".into()));
        }
        _ => {}
    }
    let [width, height] = parameters.sheet().size();
    let pixels = width.saturating_mul(height).saturating_mul(parameters.frames);
    if pixels > MOST_PIXELS {
        errors.push((
            "size",
            format!("all pictures together have {pixels} pixels, which is more than {MOST_PIXELS}"),
        ));
    }
    errors
}

/// The shot of a frame, with the camera or the light turned by this many degrees.
fn shot(parameters: &Parameters, scene: &Scene, exposure: f64, turned: f64) -> Shot {
    let [around, about] = match parameters.turn {
        Turn::Camera => [turned, 0.0],
        Turn::Light => [0.0, turned],
    };
    let own = Rotation::from_yaw_pitch_roll(
        (parameters.light_yaw + about).to_radians(),
        parameters.light_pitch.to_radians(),
        0.0,
    );
    Shot {
        size: parameters.size.0.map(|side| side as u32),
        samples: parameters.samples as u32,
        camera: Camera {
            yaw: (parameters.camera_yaw + around).to_radians(),
            pitch: parameters.camera_pitch.to_radians(),
            zoom: parameters.zoom,
            field: parameters.field.to_radians(),
            ..Camera::new(scene.framing())
        },
        turn: own,
        show: Show::One(Mode::LocalShrm),
        background: parameters.background.background(),
        exposure,
        tone: parameters.curve.0,
        light_samples: parameters.light_samples as u32,
        points: parameters.points.0,
    }
}

/// Says the error of a picture: `95 % within 0.03 stops, 99 % within 0.12; RMS 4.5 %`.
fn said([p95, p99, rms]: [f64; 3], most: &str) -> String {
    format!("95 % within {p95:.2} stops, 99 % within {p99:.2}; RMS {}{most}", percent(rms))
}

/// The pictures of a frame. `worst` collects the greatest errors of each mode: two in stops, and the relative
/// RMS.
fn panels(
    parameters: &Parameters,
    scene: &Scene,
    shot: &Shot,
    renderer: &mut FallbackRenderer<'_>,
    worst: &mut Vec<(Mode, [f64; 3])>,
) -> Result<Vec<ComparisonPanel>, Failure> {
    let mut panels = Vec::new();
    let mut first = None;
    for mode in parameters.columns() {
        let picture = renderer.draw(scene, &Shot { show: Show::One(mode), ..shot.clone() })?;
        let mut panel = ComparisonPanel {
            label: mode.label(),
            detail: String::new(),
            picture: picture.codes.clone(),
            difference: None,
        };
        match &first {
            None if parameters.compare.is_some() => {
                panel.detail = "the reference".into();
                first = Some(picture);
            }
            None => {}
            Some(from) => {
                let difference = picture.difference(from, parameters.amplify as f32, shot);
                if let Some(stops) = picture.stops(from, scene.light.dark()) {
                    let error = [stops[0], stops[1], difference.relative_rms.unwrap_or(0.0)];
                    panel.detail = said(error, "");
                    match worst.iter_mut().find(|(known, _)| *known == mode) {
                        Some((_, most)) => (0..3).for_each(|k| most[k] = most[k].max(error[k])),
                        None => worst.push((mode, error)),
                    }
                }
                panel.difference = Some((format!("difference × {}", parameters.amplify), difference.codes));
            }
        }
        panels.push(panel);
    }
    Ok(panels)
}
