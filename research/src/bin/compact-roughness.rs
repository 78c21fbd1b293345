//! Prints how close the table of compact maps over roughness is to the sum over pixels, beside the split sum
//! of engines: a table of docs/taps.md.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin compact-roughness -- ENVIRONMENT...`, each
//! a lat-long picture. p95/p99 in stops toward 400 views as a ball shows them, half-way between the table's
//! rows: with eight lights, in brackets with none, for taps that are fitted to the roughness and F0 alone,
//! and for the split sum with all light in its cube.

use std::f64::consts::{PI, TAU};

use brdf::{Material, Part, ScaleBias, Standard, StandardParameters, Visibility, environment_brdf};
use containers::{ReadOptions, read_image};
use envmap::{Environment, Layout};
use sh::Stop;
use sphere::{DVec3, Direction, spiral};
use taps::{Accuracy, LightPoints, ScaleSpace, Truth, Widths, fit, fit_by_reflectance};

type Failure = Box<dyn std::error::Error>;

const VIEWS: usize = 400;
const ROWS: usize = 33;
const TAPS: usize = 6;

/// The steps of the integral of a prefilter's weight.
const STEPS: usize = 4000;

fn main() {
    if let Err(error) = run() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn run() -> Result<(), Failure> {
    let table = fit_by_reflectance(ROWS, TAPS, Widths::FINEST, Stop::NEVER)?.table;
    let widths = Widths::new(64).ok_or("64 is no edge")?;
    let text = |found: Accuracy| format!("{:.3}/{:.3}", found.p95, found.p99);
    println!("| environment | roughness | F0 | eight lights (none) | its own taps | split sum |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for path in std::env::args().skip(1) {
        let image = read_image(&std::fs::read(&path)?, &ReadOptions::default())?.image;
        let environment = Environment::from_image(image, Layout::LatLong, None)?;
        let lamps = environment.separate_lamps(Stop::NEVER)?.lights;
        let kept = &lamps[..lamps.len().min(8)];
        let lit = ScaleSpace::new(&environment, kept, widths, Stop::NEVER)?;
        let dark = ScaleSpace::new(&environment, &[], widths, Stop::NEVER)?;
        let points = LightPoints::new(&environment)?;
        for row in [6, 10, 14, 18, 22, 26, 32] {
            let roughness = ((row as f64 + 0.5) / (ROWS - 1) as f64).min(1.0);
            let prefiltered: Vec<DVec3> = (0..VIEWS)
                .map(|index| prefiltered(&points, spiral(index, VIEWS).vector(), roughness))
                .collect();
            for f0 in [0.04, 1.0] {
                let material = highlight(roughness, f0)?;
                let truth = Truth::new(&points, &material, VIEWS, Stop::NEVER)?;
                let shared = table.at_reflectance(roughness, [f0; 3]);
                let own = fit(&material, TAPS, Widths::FINEST, Stop::NEVER)?.table;
                let [found, none, own] = [(&shared, &lit), (&shared, &dark), (&own, &lit)]
                    .map(|(table, space)| text(truth.error(table, space, &material)));
                let split = text(split_sum(&points, &material, &prefiltered, roughness, f0));
                println!("| {path} | {roughness:.3} | {f0} | {found} ({none}) | {own} | {split} |");
            }
        }
    }
    Ok(())
}

fn highlight(roughness: f64, f0: f64) -> Result<Material, Failure> {
    let parameters =
        StandardParameters { base_color: [f0; 3], metallic: 1.0, roughness, ..StandardParameters::default() };
    let metal = Material::Standard(Standard::new(parameters)?);
    Ok(metal.part(Part::Specular).ok_or("a metal has a highlight")?)
}

/// The directions and fluxes of the points.
fn each(points: &LightPoints) -> impl Iterator<Item = (DVec3, DVec3)> {
    let vector = |values: &[f32; 3]| DVec3::from_array(values.map(f64::from));
    points.points().iter().map(move |(direction, flux)| (vector(direction), vector(flux)))
}

/// The light about a direction as engines prefilter it, with the normal and the view there.
fn prefiltered(points: &LightPoints, about: DVec3, roughness: f64) -> DVec3 {
    let alpha2 = roughness.powi(4);
    let weight = |cosine: f64| {
        let half = 0.5 * (1.0 + cosine);
        alpha2 / (half * (alpha2 - 1.0) + 1.0).powi(2) * cosine
    };
    let light = |(direction, flux): (DVec3, DVec3)| flux * weight(about.dot(direction).max(0.0));
    let step = |step: usize| weight((step as f64 + 0.5) / STEPS as f64) * TAU / STEPS as f64;
    each(points).map(light).sum::<DVec3>() / (0..STEPS).map(step).sum::<f64>()
}

/// The view of an index, as `taps::Truth` has it: the normal and the direction toward the viewer.
fn ball_view(index: usize) -> (DVec3, DVec3) {
    let r = spiral(index, VIEWS).vector();
    let part = |step: f64| (0.5 + step * index as f64).fract();
    let theta = part(0.754_877_666_246_692_8).sqrt().asin();
    let (u, w) = r.any_orthonormal_pair();
    let (y, x) = (TAU * part(0.569_840_290_998_053_2)).sin_cos();
    let (s, c) = theta.sin_cos();
    let normal = r * c + (u * x + w * y) * s;
    (normal, 2.0 * normal.dot(r) * normal - r)
}

/// The error of the split sum with exact prefiltered light.
fn split_sum(
    points: &LightPoints,
    material: &Material,
    prefiltered: &[DVec3],
    roughness: f64,
    f0: f64,
) -> Accuracy {
    let dark = 0.01 * each(points).map(|(_, flux)| flux.element_sum()).sum::<f64>() / (12.0 * PI);
    let mut stops: Vec<f64> = Vec::new();
    for (index, prefiltered) in prefiltered.iter().enumerate() {
        let (normal, view) = ball_view(index);
        let x = (view - normal.dot(view) * normal).try_normalize();
        let x = x.unwrap_or_else(|| normal.any_orthonormal_vector());
        let y = normal.cross(x);
        let local = |v: DVec3| Direction::normalised(DVec3::new(v.dot(x), v.dot(y), v.dot(normal)));
        let outgoing = local(view);
        let lit = each(points).filter(|(direction, _)| direction.dot(normal) > 0.0);
        let truth: DVec3 =
            lit.map(|(direction, flux)| flux * material.rho_hat(local(direction), outgoing)[0]).sum();
        let cosine = normal.dot(view).clamp(1e-3, 1.0);
        let ScaleBias { scale, bias } = environment_brdf(Visibility::Correlated, roughness, cosine);
        let found = *prefiltered * (f0 * scale + bias);
        stops.extend((0..3).map(|k| ((found[k] + dark) / (truth[k] + dark)).log2().abs()));
    }
    stops.sort_by(f64::total_cmp);
    let at = |share: f64| stops[(share * stops.len() as f64) as usize];
    Accuracy { p95: at(0.95), p99: at(0.99) }
}
