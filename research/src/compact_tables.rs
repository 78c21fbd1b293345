//! Errors of compact maps, from this module's own sums over pixels.
//!
//! Truth is the sum of rho_hat over the pixels of an environment, binned to 512 x 256 where it is bright and
//! to 256 x 128 elsewhere, toward random views as a ball shows them: the direction of reflection is uniform
//! over the sphere, the squared sine of the angle between normal and view is uniform. The error is
//! |log2((found + e) / (truth + e))| in stops, for each colour, e being 1 % of the environment's mean. The
//! lights beside a map are reflected by the material itself.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use brdf::Material;
use envmap::Environment;
use rayon::prelude::*;
use sh::Light;
use shrm::reference::LightTree;
use sphere::{DVec3, Direction, LatLong};
use taps::{ScaleSpace, TapTable};

/// Materials as files have them: a name, and the text of the file.
pub const MATERIALS: [(&str, &str); 25] = [
    ("microfacet 0.15", "model = \"microfacet\"\nsigma = 0.15"),
    ("microfacet 0.2", "model = \"microfacet\"\nsigma = 0.2"),
    ("microfacet 0.3", "model = \"microfacet\"\nsigma = 0.3"),
    ("microfacet 0.5", "model = \"microfacet\"\nsigma = 0.5"),
    ("copper 0.05", "model = \"ggx\"\nroughness = 0.05\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]"),
    ("copper 0.1", "model = \"ggx\"\nroughness = 0.1\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]"),
    ("copper 0.15", COPPER_15),
    ("copper 0.2", COPPER_20),
    ("copper 0.3", COPPER_30),
    ("copper 0.5", COPPER_50),
    ("copper 0.7", COPPER_70),
    ("copper 1", COPPER_100),
    ("gloss 0.3", "model = \"ggx\"\nroughness = 0.3\nior = 1.5"),
    ("metal 0.3", "model = \"standard\"\nbase_color = [0.95, 0.64, 0.54]\nmetallic = 1\nroughness = 0.3"),
    ("metal 0.5", "model = \"standard\"\nbase_color = [0.95, 0.64, 0.54]\nmetallic = 1\nroughness = 0.5"),
    ("lacquer 0.3", "model = \"standard\"\nbase_color = [0.45, 0.03, 0.02]\nroughness = 0.3"),
    ("plastic 0.6", "model = \"standard\"\nbase_color = [0.1, 0.3, 0.6]\nroughness = 0.6"),
    ("phong 32", "model = \"phong\"\nexponent = 32\nspecular = [0.8, 0.8, 0.8]"),
    ("blinn-phong 64", "model = \"blinn-phong\"\nexponent = 64\nspecular = [0.5, 0.5, 0.5]"),
    ("torrance-sparrow 0.3", "model = \"torrance-sparrow\"\nroughness = 0.3\nior = 1.5"),
    ("ward 0.45", "model = \"ward\"\nroughness = 0.45\nspecular = [0.6, 0.5, 0.3]"),
    ("brushed ward", "model = \"ward\"\nroughness = 0.25\nroughness_y = 0.55\nspecular = [0.6, 0.5, 0.3]"),
    ("oren-nayar 30", "model = \"oren-nayar\"\nalbedo = [0.6, 0.5, 0.4]\nsigma = 30"),
    ("lambert", "model = \"lambert\"\nalbedo = [0.6, 0.5, 0.4]"),
    (
        "brushed copper",
        "model = \"ggx\"\nroughness = 0.25\nroughness_y = 0.55\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]",
    ),
];

const COPPER_15: &str = "model = \"ggx\"\nroughness = 0.15\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]";
const COPPER_20: &str = "model = \"ggx\"\nroughness = 0.2\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]";
const COPPER_30: &str = "model = \"ggx\"\nroughness = 0.3\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]";
const COPPER_50: &str = "model = \"ggx\"\nroughness = 0.5\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]";
const COPPER_70: &str = "model = \"ggx\"\nroughness = 0.7\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]";
const COPPER_100: &str = "model = \"ggx\"\nroughness = 1.0\nn = [0.27, 0.68, 1.32]\nk = [3.61, 2.63, 2.29]";

/// One of [`MATERIALS`].
///
/// # Errors
/// If there is none of this name.
pub fn material(name: &str) -> Result<Material, Box<dyn std::error::Error>> {
    let text = MATERIALS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text);
    let text = text.ok_or_else(|| {
        let names: Vec<&str> = MATERIALS.iter().map(|(name, _)| *name).collect();
        format!("no material {name:?}; expected one of: {}", names.join(", "))
    })?;
    let no_file = |path: &Path| Err(engine::Failure::new(format!("{} is not read", path.display())));
    let file = stages::read_material("material.toml", text.as_bytes(), None, &no_file)
        .map_err(|error| format!("{name}: {error}"))?;
    Ok(file.material)
}

/// Environments that nothing was tuned to, by their names.
pub const PROCEDURAL: [&str; 3] = ["low-sun", "window", "street"];

/// One of [`PROCEDURAL`]; `None` of another name.
pub fn procedural(name: &str) -> Option<Environment> {
    let radiance: fn(DVec3) -> [f64; 3] = match name {
        "low-sun" => |d| {
            let sun = Direction::from_angles(1.45, -2.0).vector();
            let height = d.z.max(0.0);
            let sky = [0.25 + 0.5 * (1.0 - height), 0.45 + 0.35 * (1.0 - height), 0.9];
            let ground = [0.12, 0.1, 0.08];
            let glow = 3.0 * (8.0 * (d.dot(sun) - 1.0)).exp();
            let disk = if d.dot(sun) > 0.012_f64.cos() { 20_000.0 } else { 0.0 };
            let base = if d.z > 0.0 { sky } else { ground };
            [base[0] + glow + disk, base[1] + 0.7 * glow + 0.8 * disk, base[2] + 0.4 * glow + 0.5 * disk]
        },
        "window" => |d| {
            let is_window = d.y > 0.0 && (d.x / d.y).abs() < 0.5 && (d.z / d.y - 0.2).abs() < 0.4;
            let bars = ((d.x / d.y.abs().max(1e-9)) * 12.0).sin().abs() < 0.15;
            let strip = d.z > 0.0 && (d.x / d.z + 0.6).abs() < 0.04 && (d.y / d.z).abs() < 1.2;
            let wall = [0.2 + 0.05 * d.x, 0.18, 0.16 - 0.03 * d.z];
            let light = if is_window && !bars { 12.0 } else { 0.0 } + if strip { 160.0 } else { 0.0 };
            wall.map(|wall| wall + light)
        },
        "street" => |d| {
            let mut sum = [0.004, 0.005, 0.012];
            for lamp in 0..24 {
                let at =
                    Direction::from_angles(1.2 + 0.02 * f64::from(lamp % 7), 0.9 + 0.26 * f64::from(lamp));
                let colour = [[1.0, 0.6, 0.25], [0.7, 0.8, 1.0], [1.0, 0.2, 0.15]][lamp as usize % 3];
                if d.dot(at.vector()) > (0.008 + 0.004 * f64::from(lamp % 4)).cos() {
                    (0..3).for_each(|channel| sum[channel] += 400.0 * colour[channel]);
                }
            }
            let facade = if d.z.abs() < 0.3 && (9.0 * d.x.atan2(d.y)).sin() > 0.4 { 0.05 } else { 0.0 };
            [sum[0] + facade, sum[1] + 0.8 * facade, sum[2] + 0.5 * facade]
        },
        _ => return None,
    };
    let grid = LatLong::with_rows(512);
    let pixel = |index: usize| {
        // Four samples, so that edges are not jagged.
        let (row, column) = (index / grid.width, index % grid.width);
        let mut sum = [0.0; 3];
        for (y, x) in [(-0.25, -0.25), (-0.25, 0.25), (0.25, -0.25), (0.25, 0.25)] {
            let rgb = radiance(grid.direction_at(column as f64 + x, row as f64 + y).vector());
            (0..3).for_each(|channel| sum[channel] += 0.25 * rgb[channel]);
        }
        sum.map(|value| value as f32)
    };
    Environment::new(grid, (0..grid.len()).into_par_iter().map(pixel).collect())
}

/// A normal, a direction toward the viewer, and the angle between them.
struct BallView {
    normal: DVec3,
    view: DVec3,
}

/// Random views as a ball shows them.
fn views(count: usize, seed: u64) -> Vec<BallView> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut view = || {
        let (z, phi) = (2.0 * next() - 1.0, TAU * next());
        let s = (1.0 - z * z).sqrt();
        let r = DVec3::new(s * phi.cos(), s * phi.sin(), z);
        let (theta, turn) = (next().sqrt().asin(), TAU * next());
        let (u, w) = r.any_orthonormal_pair();
        let normal = r * theta.cos() + (u * turn.cos() + w * turn.sin()) * theta.sin();
        BallView { normal, view: 2.0 * normal.dot(r) * normal - r }
    };
    (0..count).map(|_| view()).collect()
}

/// An environment as points, each with its flux.
pub struct Points {
    points: Vec<(DVec3, [f64; 3])>,
    dark: f64,
}

impl Points {
    /// The points of an environment.
    ///
    /// # Errors
    /// If it cannot be made smaller.
    pub fn new(environment: &Environment) -> Result<Self, envmap::Error> {
        let fine = environment.downsampled(LatLong::with_rows(256))?;
        let coarse = LatLong::with_rows(128);
        let mean = environment.integral().iter().sum::<f64>() / (12.0 * PI);
        let mut points = Vec::new();
        let mut sums = vec![[0.0; 3]; coarse.len()];
        for (index, rgb) in fine.pixels().iter().enumerate() {
            let (row, column) = (index / 512, index % 512);
            let flux = rgb.map(|value| f64::from(value) * fine.grid().solid_angle(row));
            if rgb.iter().map(|value| f64::from(*value)).sum::<f64>() > 18.0 * mean {
                points.push((fine.grid().direction(row, column).vector(), flux));
            } else {
                let sum = &mut sums[row / 2 * 256 + column / 2];
                (0..3).for_each(|channel| sum[channel] += flux[channel]);
            }
        }
        let directions = (0..coarse.len()).map(|index| coarse.direction(index / 256, index % 256).vector());
        points.extend(directions.zip(sums));
        Ok(Self { points, dark: 0.01 * mean })
    }
}

/// What a surface reflects toward a view of points of light, in the mean over its turns about the normal.
fn reflected(material: &Material, view: &BallView, points: &[(DVec3, [f64; 3])]) -> [f64; 3] {
    let (z, turns) = (view.normal, material.turns());
    let across = view.view - z.dot(view.view) * z;
    let x = across.try_normalize().unwrap_or_else(|| z.any_orthonormal_vector());
    let y = z.cross(x);
    let local = |v: DVec3| Direction::normalised(DVec3::new(v.dot(x), v.dot(y), v.dot(z)));
    let outgoing = local(view.view);
    let mut sum = [0.0; 3];
    for (direction, flux) in points {
        let rho = material.mean_over_turns(turns, local(*direction), outgoing);
        (0..3).for_each(|channel| sum[channel] += rho[channel] * flux[channel]);
    }
    sum
}

/// A material under an environment toward random views.
pub struct Truth {
    views: Vec<BallView>,
    radiance: Vec<[f64; 3]>,
    dark: f64,
}

impl Truth {
    /// The sums toward so many views.
    pub fn new(points: &Points, material: &Material, count: usize, seed: u64) -> Self {
        let views = views(count, seed);
        let radiance = views.par_iter().map(|view| reflected(material, view, &points.points)).collect();
        Self { views, radiance, dark: points.dark }
    }

    /// The integrals over the areas of an environment's pixels, for highlights that are about as narrow as
    /// these. The material is isotropic and its highlight lies about R.
    pub fn of_areas(environment: &Environment, material: &Material, count: usize, seed: u64) -> Self {
        let tree = LightTree::new(environment);
        let dark = environment.integral().iter().sum::<f64>() / (12.0 * PI) * 0.01;
        let views = views(count, seed);
        let integral = |view: &BallView| {
            let r = 2.0 * view.normal.dot(view.view) * view.normal - view.view;
            let [r, toward] = [r, view.view].map(Direction::normalised);
            tree.radiance(material, r, toward, 0.002, dark)
        };
        let radiance = views.par_iter().map(integral).collect();
        Self { views, radiance, dark }
    }

    /// The errors in stops that 95 and 99 of 100 values stay below.
    pub fn error(&self, table: &TapTable, space: &ScaleSpace, material: &Material) -> [f64; 2] {
        let width = material.highlight_width();
        let point = |light: &Light| {
            let flux = light.flux();
            let each = light.points(width).into_iter();
            each.map(move |(direction, share)| (direction.vector(), flux.map(|flux| flux * share)))
                .collect::<Vec<_>>()
        };
        let lights: Vec<_> = space.lights().iter().flat_map(point).collect();
        let stops = self.views.par_iter().zip(&self.radiance).map(|(view, truth)| {
            let [normal, toward] = [view.normal, view.view].map(Direction::normalised);
            let found = table.radiance(space, normal, toward);
            let lit = reflected(material, view, &lights);
            std::array::from_fn(|c| ((found[c] + lit[c] + self.dark) / (truth[c] + self.dark)).log2().abs())
        });
        let mut stops = stops.collect::<Vec<[f64; 3]>>().into_flattened();
        stops.sort_by(f64::total_cmp);
        [0.95, 0.99].map(|share| stops[(share * stops.len() as f64) as usize])
    }
}
