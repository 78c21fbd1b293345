//! Frame times of the preview on this machine's graphics device, printed as a table.
//!
//! `cargo run --release -p bench --features gpu --bin preview-frame-times -- [OPTIONS] [MESH]`
//!
//! The options are `--size WIDTHxHEIGHT` and `--frames N`. MESH is a glTF file; without it, FlightHelmet of
//! the folder that `SPECULA_CORPUS` names, or else the torus knot. Every mode is timed with that one mesh,
//! and with sixteen torus knots of sixteen materials, each with a map and a BRDF table of its own; the camera
//! goes on by two degrees a frame. A frame is all from the scene to sRGB codes in a texture: its time begins
//! before commands are recorded and ends when the device has done them. `WGPU_BACKEND` chooses the backend.
//!
//! Brute force adds as many light samples to each frame as it has time for: the last column has the mean.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use bench::frames::{Times, studio};
use brdf::{Choice, Material, Microfacet, project, tabulate};
use envmap::ToneMap;
use glam::{DAffine3, DVec3};
use mesh::Mesh;
use preview::{
    Background, Camera, CompactMap, CompactTaps, Gpu, Light, Look, MapSizes, Mode, Object, PointSet,
    Renderer, Scene, Shot, Show,
};
use sh::{Degree, Stop, Tolerance};
use shrm::Reflection;
use sphere::Rotation;
use taps::{ScaleSpace, Widths, fit};
use transfer::{Directions, Frames, Occluders, Transfer, TransferDegrees, precompute};

/// What the command line says.
struct Order {
    size: [u32; 2],
    frames: usize,
    mesh: Option<PathBuf>,
}

fn main() {
    let order = match Order::parse(std::env::args().skip(1)) {
        Ok(order) => order,
        Err(message) => {
            eprintln!("{message}");
            std::process::exit(2);
        }
    };
    if let Err(message) = run(&order) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

impl Order {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let corpus = std::env::var_os("SPECULA_CORPUS").map(PathBuf::from);
        let helmet = corpus.map(|folder| folder.join("mesh/FlightHelmet/FlightHelmet.gltf"));
        let mut order = Self { size: [1920, 1080], frames: 100, mesh: helmet };
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{argument} wants a value"));
            match argument.as_str() {
                "--size" => {
                    let text = value()?;
                    let sides = text
                        .split_once('x')
                        .and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
                    order.size =
                        sides.ok_or_else(|| format!("--size {text}: expected 1920x1080 or the like"))?;
                }
                "--frames" => {
                    let text = value()?;
                    let count = text.parse().ok().filter(|count| *count > 0);
                    order.frames =
                        count.ok_or_else(|| format!("--frames {text}: expected a number above 0"))?;
                }
                unknown if unknown.starts_with('-') => {
                    return Err(format!("{unknown} is not known: expected --size, --frames or a glTF file"));
                }
                path => order.mesh = Some(path.into()),
            }
        }
        Ok(order)
    }
}

fn run(order: &Order) -> Result<(), String> {
    let mut gpu = Gpu::new().map_err(|error| error.to_string())?;
    let light = studio()?;
    let (name, mesh) = match &order.mesh {
        Some(path) => (path.display().to_string(), read(path)?),
        None => ("the torus knot".to_owned(), knot()),
    };
    let triangles = mesh.triangles().len();
    let transfer = transfer(&mesh)?;
    let scales = scales(&light)?;
    let one =
        Scene::of(Arc::new(mesh), look(&light, &scales, 0.2, [0.9, 0.8, 0.6])?).with_transfer(Some(transfer));
    let sixteen = sixteen(&light, &scales)?;
    let [width, height] = order.size;
    println!("{}", gpu.name());
    println!("{width} x {height}, {} frames each, milliseconds", order.frames);
    println!("one mesh: {name}, {triangles} triangles");
    println!();
    println!("{:>20} {:>9} {:>9}   {:>9} {:>9} {:>14}", "", "one mesh", "", "16 SHRMs", "", "light samples");
    println!("{:>20} {:>9} {:>9}   {:>9} {:>9} {:>14}", "", "median", "p95", "median", "p95", "a frame");
    for mode in Mode::ALL {
        let (alone, samples_alone) = times(&mut gpu, &one, mode, order)?;
        let (many, samples_of_many) = times(&mut gpu, &sixteen, mode, order)?;
        let light_samples = match mode {
            mode if mode.is_brute_force() => format!("{samples_alone:.1} {samples_of_many:.1}"),
            _ => String::new(),
        };
        println!(
            "{:>20} {:>9.2} {:>9.2}   {:>9.2} {:>9.2} {light_samples:>14}",
            mode.name(),
            1e3 * alone.percentile(0.5),
            1e3 * alone.percentile(0.95),
            1e3 * many.percentile(0.5),
            1e3 * many.percentile(0.95),
        );
    }
    Ok(())
}

/// The times of frames, after some to warm up, and the light samples of each.
fn times(gpu: &mut Gpu, scene: &Scene, mode: Mode, order: &Order) -> Result<(Times, f64), String> {
    let mut shot = Shot {
        size: order.size,
        samples: 1,
        camera: Camera::new(scene.framing()),
        turn: Rotation::IDENTITY,
        show: Show::One(mode),
        background: Background::Environment,
        exposure: 0.0,
        tone: ToneMap::Filmic,
        light_samples: u32::MAX,
        points: PointSet::Even,
    };
    let warm = order.frames.div_ceil(10);
    let (mut times, mut light_samples, mut before) = (Vec::new(), 0.0, 0);
    for frame in 0..warm + order.frames {
        // Brute force gathers light while nothing moves.
        if !mode.is_brute_force() {
            shot.camera.yaw += 2.0_f64.to_radians();
        }
        let (took, drawn) = gpu.timed(scene, &shot).map_err(|error| error.to_string())?;
        if frame >= warm {
            times.push(took);
            light_samples += f64::from(drawn.light_samples - before) / order.frames as f64;
        }
        before = drawn.light_samples;
    }
    Ok((Times::new(times), light_samples))
}

fn knot() -> Mesh {
    mesh::shape("torus-knot").expect("a shape")
}

/// Sixteen knots in rows of four, each with its own material.
fn sixteen(light: &Arc<Light>, scales: &Arc<ScaleSpace>) -> Result<Scene, String> {
    let mesh = Arc::new(knot());
    let transfer = transfer(&mesh)?;
    let mut objects = Vec::new();
    for k in 0..16 {
        let (row, column) = (f64::from(k / 4), f64::from(k % 4));
        let share = f64::from(k) / 15.0;
        objects.push(Object {
            mesh: Arc::clone(&mesh),
            whole: None,
            place: DAffine3::from_translation(DVec3::new(0.0, 2.0 * column - 3.0, 3.0 - 2.0 * row)),
            look: look(light, scales, 0.1 + 0.4 * share, [1.0 - 0.5 * share, 0.8, 0.5 + 0.5 * share])?,
            transfer: Some(Arc::clone(&transfer)),
            blend: None,
        });
    }
    Ok(Scene { light: Arc::clone(light), objects })
}

/// The transfer of a mesh, of degree 4.
fn transfer(mesh: &Mesh) -> Result<Arc<Vec<Transfer>>, String> {
    let degrees = [4, 8].map(|degree| Degree::new(degree).map_err(|error| error.to_string()));
    let [degree, exact] = degrees;
    let (degree, directions) = (degree?, Directions::new(256, exact?).ok_or("too few directions")?);
    let frames = Frames::of(mesh).map_err(|error| error.to_string())?;
    let degrees = TransferDegrees { output: degree, input: degree };
    let made = precompute(&frames, &Occluders::of(mesh), &directions, degrees, Stop::NEVER);
    Ok(Arc::new(vec![made.map_err(|error| error.to_string())?.0]))
}

/// A microfacet material of a roughness, with the degrees of the tolerance of [RH02, tab. 5], on faces of 64
/// texels.
fn look(
    light: &Arc<Light>,
    scales: &Arc<ScaleSpace>,
    sigma: f64,
    specular: [f64; 3],
) -> Result<Arc<Look>, String> {
    let material = Microfacet::new(sigma, specular).map_err(|error| error.to_string())?;
    let material = Material::Microfacet(material);
    let tolerance = Tolerance::new(0.03).map_err(|error| error.to_string())?;
    let projection =
        project(&material, Choice::Tolerance(tolerance), Stop::NEVER).map_err(|error| error.to_string())?;
    let reflection = Reflection::convolve(light.lighting(), &projection.coefficients);
    let degree = Degree::new(4).map_err(|error| error.to_string())?;
    let (table, _) = tabulate(&material, degree, 64, Stop::NEVER).map_err(|error| error.to_string())?;
    let fitted = fit(&material, 6, scales.widths(), Stop::NEVER).map_err(|error| error.to_string())?;
    let taps = Arc::new(CompactTaps::Angle(fitted.table));
    let map = CompactMap { scales: Arc::clone(scales), taps, material: material.clone() };
    let look = Look::new(Arc::clone(light), reflection, Some(material), MapSizes::default());
    Ok(Arc::new(look.with_table(Some(Arc::new(table))).with_compact_map(Some(Arc::new(map)))))
}

/// The scale space of a light on faces of 64 texels, with eight lights beside it.
fn scales(light: &Light) -> Result<Arc<ScaleSpace>, String> {
    let environment = light.environment();
    let mut lamps = environment.separate_lamps(Stop::NEVER).map_err(|error| error.to_string())?.lights;
    lamps.truncate(8);
    let widths = Widths::new(64).ok_or("no widths")?;
    let made = ScaleSpace::new(environment, &lamps, widths, Stop::NEVER);
    Ok(Arc::new(made.map_err(|error| error.to_string())?))
}

/// The mesh of a glTF file.
fn read(path: &Path) -> Result<Mesh, String> {
    let load = |path: &Path| std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()));
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut beside = |name: &str| load(&folder.join(name)).map(Arc::new).map_err(Failed);
    let model = containers::read_gltf(&load(path)?, &mut beside);
    model.map(|model| model.mesh).map_err(|Failed(message)| format!("{}: {message}", path.display()))
}

/// Why a mesh is not read.
struct Failed(String);

impl From<containers::Error> for Failed {
    fn from(error: containers::Error) -> Self {
        Self(error.to_string())
    }
}
