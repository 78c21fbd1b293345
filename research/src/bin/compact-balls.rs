//! Draws balls by brute force, by a compact map and by the split sum of engines, with the differences times
//! 8.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin compact-balls -- OUT.png [ENVIRONMENT...]`.
//! A second picture, OUT-few.png, has two of the rows. The environments are lat-long pictures, by default
//! those of `assets/environments`. A row is an environment and a material: brute force, compact map, split
//! sum, and the differences of the last two. The split sum prefilters the light by GGX about R, looks the
//! directional albedo up as F0 A + B, and adds the irradiance of a matte base.

use std::path::PathBuf;

use brdf::{Material, Visibility, environment_brdf};
use containers::{ReadOptions, read_image};
use envmap::{CubeMap, Environment, Layout, Texels as _, ToneMap, to_srgb8};
use rayon::prelude::*;
use research::compact_tables::material;
use research::sampling_figures::picture::Picture;
use sh::Stop;
use shrm::reference::LightTree;
use shrm::{Distribution, MethodChoice, prefilter};
use sphere::{DMat3, DVec3, Direction};
use taps::{AnyTable, ScaleSpace, SurfaceFrame, Taps as _, Widths, fit, fit_facets};

type Failure = Box<dyn std::error::Error>;

/// The materials: the name in `compact_tables`, the reflectance seen head on, the matte albedo and the
/// roughness.
const BALLS: [(&str, [f64; 3], [f64; 3], f64); 4] = [
    ("metal 0.3", [0.95, 0.64, 0.54], [0.0; 3], 0.3),
    ("metal 0.5", [0.95, 0.64, 0.54], [0.0; 3], 0.5),
    ("brushed copper", [0.92, 0.72, 0.61], [0.0; 3], 0.37),
    ("lacquer 0.3", [0.04; 3], [0.45, 0.03, 0.02], 0.3),
];

/// Pixels along the edge of a picture.
const SIZE: usize = 180;

/// The viewer is far away, in front and a little above.
const VIEW: DVec3 = DVec3::new(0.96, 0.0, 0.28);

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// The normals of the ball's pixels; `None` beside it.
fn normals() -> Vec<Option<Direction>> {
    let right = DVec3::Z.cross(VIEW).normalize();
    let up = VIEW.cross(right);
    let normal = |pixel: usize| {
        let place = |k: usize| 2.0 * (k as f64 + 0.5) / SIZE as f64 - 1.0;
        let (x, y) = (place(pixel % SIZE), -place(pixel / SIZE));
        let z = 1.0 - x * x - y * y;
        (z > 0.0).then(|| Direction::normalised(right * x + up * y + VIEW * z.sqrt()))
    };
    (0..SIZE * SIZE).map(normal).collect()
}

/// Light as engines have it.
struct SplitSum {
    specular: CubeMap,
    diffuse: CubeMap,
}

impl SplitSum {
    fn new(environment: &Environment, roughness: f64) -> Result<Self, Failure> {
        let level = |distribution, roughness| -> Result<CubeMap, Failure> {
            let choice = MethodChoice::Auto;
            let made = prefilter(environment, None, distribution, &[roughness], 64, choice, Stop::NEVER)?;
            Ok(made.levels[0].map.clone())
        };
        Ok(Self {
            specular: level(Distribution::Ggx, roughness)?,
            diffuse: level(Distribution::Lambert, 1.0)?,
        })
    }

    fn radiance(&self, normal: Direction, f_0: [f64; 3], matte: [f64; 3], roughness: f64) -> [f64; 3] {
        let cosine = normal.vector().dot(VIEW).max(1e-3);
        let r = Direction::normalised(2.0 * cosine * normal.vector() - VIEW);
        let albedo = environment_brdf(Visibility::Correlated, roughness, cosine);
        let look = |map: &CubeMap, at: Direction| map.cube().taps(at).blend(map.pixels());
        let (specular, diffuse) = (look(&self.specular, r), look(&self.diffuse, normal));
        std::array::from_fn(|c| {
            specular[c] * (f_0[c] * albedo.scale + albedo.bias) + diffuse[c] * matte[c] * (1.0 - f_0[c])
        })
    }
}

fn run() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("expected the path of a PNG")?;
    let mut sources: Vec<PathBuf> = arguments.map(PathBuf::from).collect();
    if sources.is_empty() {
        let assets = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../assets/environments");
        sources = ["studio.exr", "sky.exr"].map(|name| assets.join(name)).into();
    }
    let normals = normals();
    let view = Direction::normalised(VIEW);
    let mut rows = Vec::new();
    for source in sources {
        let bytes = std::fs::read(&source).map_err(|error| format!("{}: {error}", source.display()))?;
        let image = read_image(&bytes, &ReadOptions::default())?.image;
        let environment = Environment::from_image(image, Layout::LatLong, None)?;
        let exposure = environment.exposure().stops;
        let mean = environment.integral().iter().sum::<f64>() / (12.0 * std::f64::consts::PI);
        let tree = LightTree::new(&environment);
        let lamps = environment.separate_lamps(Stop::NEVER)?.lights;
        let kept = &lamps[..lamps.len().min(8)];
        let widths = Widths::new(64).ok_or("64 is a power of two")?;
        let space = ScaleSpace::new(&environment, kept, widths, Stop::NEVER)?;
        for (name, f_0, matte, roughness) in BALLS {
            let material: Material = material(name)?;
            let fitted = fit(&material, 6, Widths::FINEST, Stop::NEVER)?.table;
            let facets = match material.is_isotropic() {
                true => None,
                false => Some(fit_facets(&material, 12, Widths::FINEST, Stop::NEVER)?.table),
            };
            let table = facets.as_ref().map_or(AnyTable::Angle(&fitted), AnyTable::View);
            let split = SplitSum::new(&environment, roughness)?;
            let pixel = |radiance: &(dyn Fn(Direction) -> [f64; 3] + Sync)| -> Vec<[f32; 3]> {
                let of = |normal: &Option<Direction>| normal.map_or([0.0; 3], radiance);
                normals.par_iter().map(of).map(|rgb| rgb.map(|value| value as f32)).collect()
            };
            let truth = pixel(&|normal| {
                let (z, x) = (normal.vector(), tangent(normal).vector());
                let frame = DMat3::from_cols(x, z.cross(x), z);
                tree.surface_radiance(&material, frame, view, 0.002, 0.01 * mean)
            });
            let compact = pixel(&|normal| lit(table, &space, &material, normal, view));
            let engine = pixel(&|normal| split.radiance(normal, f_0, matte, roughness));
            let errors = |found: &[[f32; 3]]| {
                let pairs = found.as_flattened().iter().zip(truth.as_flattened());
                let stops = |(found, truth): (&f32, &f32)| {
                    ((f64::from(*found) + 0.01 * mean) / (f64::from(*truth) + 0.01 * mean)).log2().abs()
                };
                let lit = pairs.zip(normals.iter().flat_map(|normal| [normal.is_some(); 3]));
                let mut all: Vec<f64> = lit.filter(|(_, lit)| *lit).map(|(pair, _)| stops(pair)).collect();
                all.sort_by(f64::total_cmp);
                [0.95, 0.99].map(|share| all[(share * all.len() as f64) as usize])
            };
            println!(
                "{} {name}: compact {:.3?}, split sum {:.3?} stops",
                source.display(),
                errors(&compact),
                errors(&engine)
            );
            let shown = |values: &[[f32; 3]]| to_srgb8(values, exposure, ToneMap::Filmic);
            let codes = [&truth, &compact, &engine].map(|values| shown(values));
            let difference = |found: &[[u8; 3]]| -> Vec<[u8; 3]> {
                let amplified = |a: u8, b: u8| (128 + 8 * (i32::from(a) - i32::from(b))).clamp(0, 255) as u8;
                let pairs = found.iter().zip(&codes[0]);
                pairs.map(|(a, b)| std::array::from_fn(|c| amplified(a[c], b[c]))).collect()
            };
            let differences = [difference(&codes[1]), difference(&codes[2])];
            let picture = |codes: &Vec<[u8; 3]>| Picture::new(SIZE, SIZE, |x, y| codes[y * SIZE + x]);
            rows.push(codes.iter().chain(&differences).map(picture).collect::<Vec<_>>());
        }
    }
    std::fs::write(&out, Picture::sheet(&rows).png()?)?;
    // The first and the last material of the first environment, for a page that has less room.
    let few = [rows[0].clone(), rows[BALLS.len() - 1].clone()];
    let beside = format!("{}-few.png", out.trim_end_matches(".png"));
    std::fs::write(beside, Picture::sheet(&few).png()?)?;
    Ok(())
}

/// The tangent of the ball at a normal: scratches run around it.
fn tangent(normal: Direction) -> Direction {
    Direction::normalised(DVec3::Z.cross(normal.vector()).try_normalize().unwrap_or(DVec3::X))
}

/// A compact map and the lights beside it.
fn lit(
    table: AnyTable<'_>,
    space: &ScaleSpace,
    material: &Material,
    normal: Direction,
    view: Direction,
) -> [f64; 3] {
    let frame = SurfaceFrame::new(normal, tangent(normal));
    let mut sum = table.reflected(space, frame, view);
    for light in space.lights() {
        let flux = light.flux();
        for (point, share) in light.points(material.highlight_width()) {
            let rho_hat = material.rho_hat(frame.to_local(point), frame.to_local(view));
            (0..3).for_each(|c| sum[c] += rho_hat[c] * flux[c] * share);
        }
    }
    sum
}
