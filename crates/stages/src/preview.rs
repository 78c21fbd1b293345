//! Draws a mesh under an environment, shaded with the maps that engines will use: a picture, or a turntable.
//!
//! `reflection` is what a material reflects (`reflection`), or a reflection map that was read back (`shrm`);
//! `environment` is the light that it was made of, which is seen behind the mesh and in mirrors. Where the lighting was
//! turned on its way, connect the environment turned alike: `rotate` turns both. `material` is needed by `brute-force` alone.
//! `mesh` is drawn in place of the built-in shape.
//!
//! ## Modes
//!
//! `modes` says how the surface is shaded. Several stand side by side in one picture, each with its name.
//!
//! | mode | the reflected light is known by |
//! | --- | --- |
//! | `local-shrm` | the local SHRM, evaluated at every pixel |
//! | `global-shrm` | the global SHRM, evaluated once a frame into a reflection map for a far viewer |
//! | `cabral` | Cabral's twelve maps, blended by the view |
//! | `kautz-mccool` | Kautz and McCool's texture, by the angle to the view |
//! | `prefiltered` | one reflection map, the mean over all views |
//! | `irradiance` | nine coefficients of the light, for a white matte surface |
//! | `mirror` | the environment, for a perfect mirror |
//! | `brute-force` | the sum of all light: `light-samples` samples at every sample of a pixel |
//!
//! `compare` names the mode that the others are judged by. Its picture comes first, and below each other mode stands its
//! absolute difference, amplified, with the root of the mean squared difference over the pixels that see only mesh, as a
//! share of that of what it is compared with. Brute force is noisy itself: more `light-samples` tell more.
//!
//! Maps are made as the exports make them, on cubes of `resolution`; Kautz and McCool's texture has `slices`.
//!
//! ## Camera and light
//!
//! The camera circles the mesh. At yaw 0 it stands on the +X side, before the front of glTF models, and has the centre of
//! the environment's image behind it; a positive yaw moves it toward +Y, a positive pitch up. At `zoom` 1 the ball around the
//! mesh touches the picture's shorter side, whatever the mesh's size. The light is turned as `rotate` turns it, by
//! `light-yaw` and then `light-pitch`.
//!
//! With `frames` there are so many pictures of one whole turn of the camera, or of the light around +Z, counter-clockwise
//! as seen from above: an animation, or a strip of all of them.
//!
//! ## Where it is drawn
//!
//! With `backend = "cpu"` outputs are the same to the bit, as those of all stages. A graphics device (`"gpu"`) draws the same within two
//! steps of 255 for all but a few pixels, and faster; what it draws depends on the device, which no key holds. Where there is none, or
//! where it cannot draw this, the CPU does, with a warning that says why. Its picture is kept like any result: once there is a
//! device, set `backend` to `"cpu"` or change another parameter, or move `.specula` away, to have it drawn anew.
//!
//! ## Files
//!
//! `.png`: 8-bit sRGB. An animation is an animated PNG, of which a program that knows of none shows the first frame.
//!
//! ## Example
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

use std::ops::RangeInclusive;
use std::sync::Arc;

use containers::{write_apng, write_png};
use engine::{Context, Failure, Kind, Output, Port, Product, choice, parameters};
use envmap::ToneMap;
use preview::{Camera, Light, Look, MapSizes, Mode, RenderError, Scene, Shot, Show};
use sphere::Rotation;

use crate::artifacts;
use crate::choices::{STOPS, ToneMapName};
use crate::contact_sheet::exposure_of;
use crate::sheet::percent;
use comparison::{ComparisonSheet, Panel};
use easel::Easel;
use values::{Behind, Size};

mod comparison;
mod easel;
mod light;
mod values;

choice! {
    /// A built-in mesh.
    pub(crate) enum Shape {
        /// A sphere.
        Sphere = "sphere",
        /// A trefoil knot, which shows every direction of the normal at several depths.
        TorusKnot = "torus-knot",
        /// A square that lies on the ground.
        Plane = "plane",
    }
}

choice! {
    /// By what the reflected light is known.
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
    /// What is written of several frames.
    pub(crate) enum Format {
        /// One picture.
        Png = "png",
        /// An animated PNG.
        Apng = "apng",
        /// All frames in one picture.
        Strip = "strip",
    }
}

choice! {
    /// What draws.
    pub(crate) enum Backend {
        /// The CPU: the same to the bit.
        Cpu = "cpu",
        /// A graphics device, where there is one.
        Gpu = "gpu",
    }
}

parameters! {
    /// Parameters of `preview`.
    pub(crate) struct Parameters {
        /// The built-in mesh that is drawn where no mesh is connected.
        mesh: Shape = Shape::Sphere,
        /// Pixels of each picture: the edge of a square, or [width, height]. 16 to 4096.
        size: Size = Size([512; 2]),
        /// How the surface is shaded, side by side; see Modes.
        modes: Vec<ModeName> = vec![ModeName(Mode::LocalShrm)],
        /// The mode that the others are compared with. Without it, nothing is compared.
        compare: Option<ModeName> = None,
        /// How many times stronger differences are shown.
        #[range(1.0..=1000.0)]
        amplify: f64 = 8.0,
        /// Where the camera stands, in degrees around +Z.
        #[range(DEGREES)]
        camera_yaw: f64 = 0.0,
        /// How high the camera stands, in degrees.
        #[range(-90.0..=90.0)]
        camera_pitch: f64 = 10.0,
        /// How near the camera comes; see Camera and light.
        #[range(0.1..=100.0)]
        zoom: f64 = 0.9,
        /// The field of view over the shorter side of the picture, in degrees.
        #[range(1.0..=120.0)]
        field: f64 = 30.0,
        /// The turn of the light around +Z, in degrees.
        #[range(DEGREES)]
        light_yaw: f64 = 0.0,
        /// The turn of the light around +Y, in degrees; positive lowers what is at +X.
        #[range(DEGREES)]
        light_pitch: f64 = 0.0,
        /// Stops by which all radiance is multiplied before it is shown. Without it, from the environment, as in
        /// contact-sheet.
        #[range(STOPS)]
        exposure: Option<f64> = None,
        /// How exposed radiance is shown: with a film's shoulder, or cut at white.
        curve: ToneMapName = ToneMapName(ToneMap::Filmic),
        /// What lies behind the mesh: the environment, what its harmonics up to degree 30 hold of it, or a colour, which
        /// exposure leaves alone.
        background: Behind = Behind::Environment,
        /// Texels along the edge of a cube's face, of every map.
        #[range(4..=512)]
        resolution: usize = 64,
        /// Slices of Kautz and McCool's texture.
        #[range(2..=256)]
        slices: usize = 16,
        /// Samples along each side of a pixel.
        #[range(1..=4)]
        samples: usize = 2,
        /// Samples of light at each sample of a pixel in brute-force.
        #[range(1..=65536)]
        light_samples: usize = 64,
        /// Pictures of one whole turn.
        #[range(1..=360)]
        frames: usize = 1,
        /// With several frames: what turns.
        turn: Turn = Turn::Camera,
        /// What is written. Without it, "png" of one frame and "apng" of several.
        format: Option<Format> = None,
        /// With format "apng": seconds of one whole turn.
        #[range(0.1..=600.0)]
        seconds: f64 = 4.0,
        /// What draws; see there.
        backend: Backend = Backend::Cpu,
    }
}

/// Angles: any number of turns that keeps their fractions.
const DEGREES: RangeInclusive<f64> = -1e6..=1e6;

/// The most pixels of all frames together: 192 MiB of codes, and as much again where they become a strip.
const MOST_PIXELS: usize = 1 << 26;

impl Parameters {
    fn format(&self) -> Format {
        self.format.unwrap_or(if self.frames == 1 { Format::Png } else { Format::Apng })
    }

    fn compare(&self) -> Option<Mode> {
        self.compare.map(|name| name.0)
    }

    /// The modes as they stand side by side: what the others are compared with comes first.
    fn columns(&self) -> Vec<Mode> {
        let others = self.modes.iter().map(|name| name.0);
        self.compare().into_iter().chain(others.filter(|mode| Some(*mode) != self.compare())).collect()
    }

    /// The frames as they lie in the written picture: columns and rows.
    fn strip(&self) -> [usize; 2] {
        match self.format() {
            // A single picture is laid beside the next; a row of them below.
            Format::Strip if self.columns().len() == 1 => [self.frames, 1],
            Format::Strip => [1, self.frames],
            Format::Png | Format::Apng => [1, 1],
        }
    }

    fn board(&self) -> ComparisonSheet {
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
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        sh::revisions::ROTATION,
        brdf::revisions::MODELS,
        shrm::revisions::SYNTHESIS,
        shrm::revisions::RESAMPLING,
        envmap::revisions::RESAMPLING,
    ];
    const TEXT: &'static str = include_str!("preview.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::Reflection>("reflection").or::<artifacts::Shrm>(),
            Port::one::<artifacts::Environment>("environment"),
            Port::one::<artifacts::Material>("material").optional(),
            Port::one::<artifacts::Mesh>("mesh").optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".png".into()])
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        check(parameters)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let scene = scene(parameters, context)?;
        context.check_cancelled()?;
        let (exposure, reason) = match parameters.exposure {
            Some(exposure) => (exposure, "as given"),
            None => exposure_of(scene.light.environment()),
        };
        context.note(format!("exposure {} {reason}", crate::sheet::stops(exposure)));
        let mut easel = Easel::new(parameters.backend, context);
        let board = parameters.board();
        let mut frames = Vec::new();
        let mut worst = Vec::new();
        for frame in 0..parameters.frames {
            let turned = 360.0 * frame as f64 / parameters.frames as f64;
            let shot = shot(parameters, &scene, exposure, turned);
            frames.push(board.draw(&panels(parameters, &scene, &shot, &mut easel, &mut worst)?));
            context.check_cancelled()?;
        }
        for (mode, rms) in worst {
            let most = if parameters.frames > 1 { " at most" } else { "" };
            context.note(format!("{}: relative RMS {}{most}", mode.label(), percent(rms)));
        }
        let [width, height] = board.size();
        let recipe = Some(context.recipe());
        let bytes = match parameters.format() {
            Format::Apng => {
                let milliseconds = (1000.0 * parameters.seconds / parameters.frames as f64).round();
                write_apng(width, height, &frames, milliseconds.clamp(1.0, 65535.0) as u16, recipe)?
            }
            Format::Png | Format::Strip => {
                let [columns, rows] = parameters.strip();
                let strip = comparison::strip(&frames, board.size(), columns);
                write_png(columns * width, rows * height, &strip, recipe)?
            }
        };
        Ok(Output::Files(vec![bytes]))
    }
}

fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
    let mut faults = Vec::new();
    if parameters.modes.is_empty() {
        faults.push(("modes", "there is none; name one, such as \"local-shrm\"".into()));
    }
    for (place, mode) in parameters.modes.iter().enumerate() {
        if parameters.modes[..place].contains(mode) {
            faults.push(("modes", format!("{:?} is there twice", mode.0.name())));
        }
    }
    if parameters.compare.is_some() && parameters.columns().len() == 1 {
        faults.push(("compare", "modes names no other mode to compare with it".into()));
    }
    match parameters.format() {
        Format::Png if parameters.frames > 1 => {
            let frames = parameters.frames;
            faults.push(("format", format!("{frames} frames are an \"apng\" or a \"strip\"")));
        }
        Format::Apng | Format::Strip if parameters.frames == 1 => {
            faults.push(("format", "one frame is a \"png\"; frames says how many there are".into()));
        }
        _ => {}
    }
    let [width, height] = parameters.board().size();
    let pixels = width.saturating_mul(height).saturating_mul(parameters.frames);
    if pixels > MOST_PIXELS {
        faults.push(("size", format!("all pictures together have {pixels} pixels, more than {MOST_PIXELS}")));
    }
    faults
}

/// The mesh with its look.
fn scene(parameters: &Parameters, context: &Context<'_>) -> Result<Scene, Failure> {
    let environment = context.get::<artifacts::Environment>("environment")?;
    let material = context.optional::<artifacts::Material>("material")?.map(|material| material.0.clone());
    if material.is_none() && parameters.columns().contains(&Mode::BruteForce) {
        return Err(Failure::new("brute-force needs the material, and the port material is not connected")
            .help("add material = \"...\" to the stage's inputs"));
    }
    let mesh = match context.optional::<artifacts::Mesh>("mesh")? {
        Some(mesh) => mesh.0.clone(),
        None => built_in(parameters.mesh)?,
    };
    if mesh.triangles().is_empty() {
        context.warn("the mesh has no triangles: only the background is seen");
    }
    let light = Arc::new(Light::new(environment.0.clone(), None));
    let sizes = MapSizes { edge: parameters.resolution, slices: parameters.slices };
    let look = match context.type_at("reflection") {
        Some(name) if name == <artifacts::Shrm as engine::Artifact>::TYPE => {
            let map = context.get::<artifacts::Shrm>("reflection")?.0.clone();
            Look::from_map(light, map, material, sizes)
        }
        _ => {
            let reflection = context.get::<artifacts::Reflection>("reflection")?.0.clone();
            if let Some(difference) = light::difference(light.environment(), reflection.lighting()) {
                context.warn(difference);
            }
            Look::new(light, reflection, material, sizes)
        }
    };
    Ok(Scene::of(Arc::new(mesh), Arc::new(look)))
}

fn built_in(shape: Shape) -> Result<mesh::Mesh, Failure> {
    let name = match shape {
        Shape::Sphere => "sphere",
        Shape::TorusKnot => "torus-knot",
        Shape::Plane => "plane",
    };
    mesh::shape(name).ok_or_else(|| Failure::new(format!("there is no shape {name:?}")))
}

/// How a frame is seen, its camera or light turned by so many degrees.
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
    }
}

/// The pictures of a frame. `worst` gathers the greatest relative RMS of each mode.
fn panels(
    parameters: &Parameters,
    scene: &Scene,
    shot: &Shot,
    easel: &mut Easel<'_, '_>,
    worst: &mut Vec<(Mode, f64)>,
) -> Result<Vec<Panel>, Failure> {
    let mut panels = Vec::new();
    let mut first = None;
    for mode in parameters.columns() {
        let picture = easel.draw(scene, &Shot { show: Show::One(mode), ..shot.clone() })?;
        let mut panel = Panel {
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
                if let Some(rms) = difference.relative_rms {
                    panel.detail = format!("relative RMS {}", percent(rms));
                    match worst.iter_mut().find(|(known, _)| *known == mode) {
                        Some((_, most)) => *most = most.max(rms),
                        None => worst.push((mode, rms)),
                    }
                }
                panel.difference = Some((format!("difference × {}", parameters.amplify), difference.codes));
            }
        }
        panels.push(panel);
    }
    Ok(panels)
}

/// The failure of an item whose picture could not be drawn.
fn failure(error: RenderError) -> Failure {
    match error {
        RenderError::Cancelled => Failure::cancelled(),
        error => Failure::from(error),
    }
}

#[cfg(test)]
mod tests {
    use engine::Parameter;

    use super::*;

    #[test]
    fn every_shape_has_its_word() {
        let shapes = mesh::SHAPES.map(|name| format!("{name:?}"));
        assert_eq!(Shape::expected(), shapes.join(" or "));
        for shape in [Shape::Sphere, Shape::TorusKnot, Shape::Plane] {
            assert!(built_in(shape).is_ok());
        }
    }
}
