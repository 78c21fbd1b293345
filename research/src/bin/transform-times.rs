//! Times the spherical harmonic transform and rotations: medians in milliseconds, as JSON.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin transform-times -- THREADS`
//!
//! Without `THREADS` there is one for each processor. For each case `wall` is the time that passed, and `cpu`
//! that of all threads together, which says more on a machine that does other things as well. Images have
//! 1024 x 512 pixels of three channels. `research/peers/transforms.py` compares these times with those of
//! other libraries.

use std::hint::black_box;
use std::time::Instant;

use rustix::time::{ClockId, clock_gettime};
use serde_json::{Map, Value, json};
use sh::{Degree, Expansion, Transform, rotate_into};
use sphere::{LatLong, Rotation};

/// Seconds of each case.
const SECONDS: f64 = 0.3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    if let Some(threads) = std::env::args().nth(1) {
        rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build_global()?;
    }
    let mut times = Map::new();
    let grid = LatLong { width: 1024, height: 512 };
    let mut state = 1u32;
    let mut sample = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let image: Vec<[f32; 3]> = (0..grid.len()).map(|_| std::array::from_fn(|_| sample())).collect();
    let mut pixels = image.clone();
    for l in [30, 255, 511] {
        let transform = Transform::new(grid, Degree::new(l)?)?;
        let expansion = transform.analyse(&image);
        let mut analyse = || drop(black_box(transform.analyse(black_box(&image))));
        times.insert(format!("analysis/{l}"), median(&mut analyse));
        let mut synthesise = || transform.synthesise_into(black_box(&expansion), &mut pixels);
        times.insert(format!("synthesis/{l}"), median(&mut synthesise));
    }
    let rotation = Rotation::from_yaw_pitch_roll(0.4, -0.7, 1.9);
    for l in [64, 256] {
        let mut lighting = Expansion::zero(Degree::new(l)?);
        lighting.coefficients_mut().iter_mut().for_each(|row| *row = [0; 3].map(|_| f64::from(sample())));
        let mut rotated = lighting.clone();
        let mut rotate = || rotate_into(black_box(&lighting), rotation, &mut rotated);
        times.insert(format!("rotation/{l}"), median(&mut rotate));
    }
    println!("{}", Value::Object(times));
    Ok(())
}

/// The median of many runs.
fn median(run: &mut dyn FnMut()) -> Value {
    run();
    let (mut wall, mut cpu, begun) = (Vec::new(), Vec::new(), Instant::now());
    while wall.len() < 5 || begun.elapsed().as_secs_f64() < SECONDS {
        let (start, cpu_start) = (Instant::now(), cpu_seconds());
        run();
        wall.push(start.elapsed().as_secs_f64());
        cpu.push(cpu_seconds() - cpu_start);
    }
    let [wall, cpu] = [wall, cpu].map(|mut seconds| {
        seconds.sort_by(f64::total_cmp);
        1e3 * seconds[seconds.len() / 2]
    });
    json!({ "wall": wall, "cpu": cpu })
}

/// Seconds that all threads of this process have run.
fn cpu_seconds() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
