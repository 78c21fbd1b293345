//! Fits the taps of a material to its BRDF alone.

mod least_squares;
mod lights;
mod lobe;
mod smooth;
mod view;

use brdf::Material;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::widths::Widths;
use crate::{ROWS, Tap, TapTable};
use lights::TestLights;
use lobe::Lobe;
use view::{Parameters, ViewFit};

/// How taps are fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// The number J of taps.
    pub taps: usize,
    /// The widths of the scale space that the taps look into.
    pub widths: Widths,
}

/// The taps could not be fitted.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The material reflects nothing toward any view.
    #[error("the material reflects nothing")]
    Black,
    /// The work was stopped, because the caller did not want it any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The squared sines of the views that are fitted: as a ball shows them, and two grazing ones.
fn views() -> Vec<f64> {
    const COUNT: usize = 20;
    let even = (0..COUNT).map(|view| view as f64 / COUNT as f64);
    even.chain([0.975, 0.992, 0.9985]).map(|squared| math::asin(squared.sqrt())).collect()
}

/// Fits taps to a material.
///
/// # Errors
/// If the material is black, or the work was stopped.
pub fn fit(material: &Material, options: &FitOptions, stop: Stop<'_>) -> Result<(TapTable, f64), FitError> {
    let thetas = views();
    let width = lobe::width(material);
    let lights = TestLights::new(width, options.widths);
    let lobes: Vec<Lobe> = thetas.par_iter().map(|theta| Lobe::new(material, *theta, width)).collect();
    if lobes.iter().all(|lobe| lobe.is_black()) {
        return Err(FitError::Black);
    }
    let problems: Vec<ViewFit> = (thetas.par_iter().zip(&lobes))
        .map(|(theta, lobe)| ViewFit::new(*theta, lobe, &lights))
        .collect();
    stop.check()?;
    let starts = [(0.6, 6.0), (0.9, 1.1), (0.5, 2.0)];
    let tries = starts.par_iter().map(|(least, most)| {
        let start = Parameters::start(options.taps, width * least, width * most, options.widths);
        let mut per_view: Vec<Parameters> = Vec::new();
        for problem in &problems {
            stop.check()?;
            let before = per_view.last().unwrap_or(&start);
            per_view.push(problem.solve(before));
        }
        let smooth = smooth::refine(&problems, &thetas, &per_view, stop)?;
        let cost = smooth.cost(&problems);
        if std::env::var("DEBUG").is_ok() {
            let rms = |taps: &[[f64; 3]], p: &ViewFit<'_>| (p.evaluate(taps, None) / p.len() as f64).sqrt();
            let a: Vec<String> = problems.iter().zip(&per_view).map(|(p, v)| format!("{:.3}", rms(&v.0, p))).collect();
            let b: Vec<String> = problems.iter().map(|p| { let mut t = smooth.at(p.theta); p.bound(&mut t); format!("{:.3}", rms(&t, p)) }).collect();
            println!("start {least} {most}: {cost:.4}\n  views  {}\n  smooth {}", a.join(" "), b.join(" "));
        }
        Ok::<_, Stopped>((smooth, cost))
    });
    let tries = tries.collect::<Result<Vec<_>, _>>()?;
    let Some((best, cost)) = tries.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return Err(FitError::Black);
    };
    let rows = (0..ROWS).map(|row| {
        let u = row as f64 / (ROWS - 1) as f64;
        let theta = math::acos(1.0 - u);
        let albedo = lobe::albedo(material, theta.min(std::f64::consts::FRAC_PI_2 - 0.01), width);
        let parameters = best.at(theta.min(thetas[thetas.len() - 1]));
        let whole: f64 = parameters.iter().map(|tap| math::exp(tap[2])).sum();
        let tap = |[delta, x, log]: &[f64; 3]| Tap {
            delta: *delta,
            std: options.widths.std(0) * math::exp2(x / Widths::PER_OCTAVE as f64),
            weight: albedo.map(|albedo| albedo * math::exp(*log) / whole),
        };
        parameters.iter().map(tap).collect()
    });
    let table = TapTable::new(rows.collect()).ok_or(FitError::Black)?;
    Ok((table, cost))
}
