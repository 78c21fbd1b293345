//! Prints table 1 of Kautz, Sloan and Snyder (2002) beside this machine's: frames a second of five meshes
//! that a BRDF table shades in four ways.
//!
//! `cargo run --release -p bench --features gpu --bin shading-rates`
//!
//! Each mesh is a torus with as many vertices as the paper's, closed and of two triangles a vertex;
//! material, table (128 x 128 views, 25 coefficients) and picture (720 x 760) are as in the paper.
//! `vertices` are colours of all vertices by the kernels of `transfer` on all threads, without a picture.
//! The others are frames of the preview, which looks the table up at each pixel: on the CPU, and on the
//! graphics device if there is one, from the scene to sRGB codes. `WGPU_BACKEND` chooses the backend.
//!
//! The four ways: light and view move; the same with transfer matrices; only the view moves; only the light
//! moves. Without transfer the preview turns the light at each pixel in every way, so that its frames keep
//! nothing for the last two. The matrices are the same at each vertex, since their values do not change the
//! time.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bench::frames::{Times, studio};
use brdf::{AshikhminShirley, BrdfTable, Material, tabulate};
use envmap::ToneMap;
use glam::DVec3;
use mesh::{Mesh, MeshError};
use preview::{
    Background, Camera, Cpu, Gpu, Light, Look, MapSizes, Mode, PointSet, RenderError, Renderer, Scene, Shot,
    Show,
};
use sh::{Degree, Expansion, Stop};
use sphere::{Direction, Rotation};
use transfer::{FixedLight, FixedView, Frames, HalfTransfer, Transfer, Viewer, shade};

/// [KSS02, tab. 1]: the name, the number of vertices, and frames a second in the four ways.
const TABLE1: [(&str, usize, [f64; 4]); 5] = [
    ("teapot", 152_413, [2.0, 1.64, 9.5, 48.9]),
    ("head", 50_060, [5.24, 4.18, 25.3, 130.0]),
    ("Buddha", 49_990, [4.05, 3.22, 15.6, 127.0]),
    ("bird", 48_668, [6.04, 4.74, 28.4, 128.0]),
    ("Tyra", 100_000, [2.62, 2.08, 9.9, 71.5]),
];

/// A way to shade.
#[derive(Clone, Copy)]
struct Way {
    name: &'static str,
    mode: Mode,
    light_moves: bool,
    view_moves: bool,
}

/// The ways, in the order of the table.
const WAYS: [Way; 4] = [
    Way { name: "no transfer", mode: Mode::Table, light_moves: true, view_moves: true },
    Way { name: "transfer", mode: Mode::Transfer, light_moves: true, view_moves: true },
    Way { name: "fixed light", mode: Mode::Table, light_moves: false, view_moves: true },
    Way { name: "fixed view", mode: Mode::Table, light_moves: true, view_moves: false },
];

/// The fewest frames that are timed, after one to warm up.
const FRAMES: usize = 3;

/// How long frames are timed if there are enough.
const PERIOD: Duration = Duration::from_secs(1);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let degree = Degree::new(4)?;
    let metal = Material::AshikhminShirley(AshikhminShirley::new([24.0, 8.0], [0.0; 3], [0.9; 3])?);
    let table = Arc::new(tabulate(&metal, degree, 128, Stop::NEVER)?.0);
    let light = studio()?;
    let (mut cpu, mut gpu) = (Cpu::new(), Gpu::new());
    match &gpu {
        Ok(gpu) => println!("{}; the device: {}", cpu.name(), gpu.name()),
        Err(error) => println!("{}; no graphics device: {error}", cpu.name()),
    }
    println!("Frames a second, 720 x 760, medians");
    print!("{:>36}", "");
    WAYS.iter().for_each(|way| print!(" {:>12}", way.name));
    println!();
    for (name, count, paper) in TABLE1 {
        print_row(&format!("{name:>8} {count:>8}"), "the paper's", paper);
        let mesh = torus(count)?;
        let matrix: Vec<f32> = (0..625).map(|entry| if entry % 26 == 0 { 0.8 } else { 0.01 }).collect();
        let transfer = Transfer::new(degree, degree, matrix.repeat(count)).ok_or("625 numbers a vertex")?;
        let frames = Frames::of(&mesh)?;
        let low = light.lighting().to_degree(degree);
        print_row("", "vertices", vertices(&frames, &table, &low, &transfer)?);
        let scene = scene(mesh, &light, &metal, &table, transfer);
        let by_cpu = drawn(&scene, |scene, shot| {
            let start = Instant::now();
            cpu.render(scene, shot, Stop::NEVER).map(|_| start.elapsed())
        })?;
        print_row("", "drawn by the CPU", by_cpu);
        if let Ok(gpu) = &mut gpu {
            let by_device = drawn(&scene, |scene, shot| gpu.timed(scene, shot).map(|(took, _)| took))?;
            print_row("", "by the device", by_device);
        }
    }
    Ok(())
}

fn print_row(head: &str, what: &str, rates: [f64; 4]) {
    print!("{head:>17} {what:>18}");
    for rate in rates {
        let digits = if rate < 100.0 { 1 } else { 0 };
        print!(" {rate:>12.digits$}");
    }
    println!();
}

/// Frames a second of the vertices alone.
fn vertices(
    frames: &Frames,
    table: &BrdfTable,
    light: &Expansion,
    transfer: &Transfer,
) -> Result<[f64; 4], RenderError> {
    let viewer = Viewer::Distant(Direction::from_angles(1.0, 0.3));
    let half = HalfTransfer::of(transfer);
    let (fixed_light, fixed_view) = (FixedLight::new(frames, light), FixedView::new(frames, table, viewer));
    Ok([
        rate(|_| timed(|| shade(frames, table, viewer, light)))?,
        rate(|_| timed(|| half.shade(frames, table, viewer, light)))?,
        rate(|_| timed(|| fixed_light.shade(frames, table, viewer)))?,
        rate(|_| timed(|| fixed_view.shade(light)))?,
    ])
}

/// Frames a second of a picture in each way.
fn drawn(
    scene: &Scene,
    mut draw: impl FnMut(&Scene, &Shot) -> Result<Duration, RenderError>,
) -> Result<[f64; 4], RenderError> {
    let mut rates = [0.0; 4];
    for (found, way) in rates.iter_mut().zip(WAYS) {
        let mut shot = Shot {
            size: [720, 760],
            samples: 1,
            camera: Camera::new(scene.framing()),
            turn: Rotation::IDENTITY,
            show: Show::One(way.mode),
            background: Background::MIDDLE_GREY,
            exposure: 0.0,
            tone: ToneMap::Filmic,
            light_samples: 1,
            points: PointSet::Even,
        };
        *found = rate(|frame| {
            let angle = (2.0 * frame as f64).to_radians();
            if way.view_moves {
                shot.camera.yaw = angle;
            }
            if way.light_moves {
                shot.turn = Rotation::from_yaw_pitch_roll(angle, 0.0, 0.0);
            }
            draw(scene, &shot)
        })?;
    }
    Ok(rates)
}

/// How many frames of the median time pass in a second; each frame is given its number.
fn rate(mut frame: impl FnMut(usize) -> Result<Duration, RenderError>) -> Result<f64, RenderError> {
    frame(0)?;
    let (mut times, begun) = (Vec::new(), Instant::now());
    while times.len() < FRAMES || begun.elapsed() < PERIOD {
        times.push(frame(1 + times.len())?);
    }
    Ok(Times::new(times).percentile(0.5).recip())
}

fn timed<T>(run: impl FnOnce() -> T) -> Result<Duration, RenderError> {
    let start = Instant::now();
    drop(black_box(run()));
    Ok(start.elapsed())
}

/// A scene of one mesh with the table and the transfer.
fn scene(
    mesh: Mesh,
    light: &Arc<Light>,
    metal: &Material,
    table: &Arc<BrdfTable>,
    transfer: Transfer,
) -> Scene {
    let look = Look::without_maps(Arc::clone(light), metal.clone(), MapSizes::default());
    let look = Arc::new(look.with_table(Some(Arc::clone(table))));
    Scene::of(Arc::new(mesh), look).with_transfer(Some(Arc::new(vec![transfer])))
}

/// A torus with a number of vertices: they lie on one thread that is wound around it and closes, so that any
/// number is possible. Tangents run along the torus.
fn torus(count: usize) -> Result<Mesh, MeshError> {
    let (about, tube) = (0.7, 0.3);
    // Neighbours on the thread are about as far from each other as neighbouring windings.
    let windings = (count as f64 * about / tube).sqrt().round();
    let next = (count as f64 / windings).round() as usize;
    let (mut positions, mut normals, mut tangents) = (vec![], vec![], vec![]);
    for k in 0..count {
        let share = k as f64 / count as f64;
        let (sine, cosine) = (TAU * share).sin_cos();
        let (rise, reach) = (TAU * (windings * share).fract()).sin_cos();
        let outward = DVec3::new(cosine, sine, 0.0);
        let normal = outward * reach + DVec3::Z * rise;
        positions.push((outward * about + normal * tube).as_vec3().to_array());
        normals.push(normal.as_vec3().to_array());
        tangents.push(DVec3::new(-sine, cosine, 0.0).as_vec3().extend(1.0).to_array());
    }
    let triangles = (0..count).flat_map(|k| {
        let at = |step: usize| ((k + step) % count) as u32;
        [[at(0), at(next), at(1)], [at(1), at(next), at(next + 1)]]
    });
    Mesh::new(positions, normals, tangents, None, triangles.collect())
}
