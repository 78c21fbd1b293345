//! Prints what prefiltering costs: the validation with Phong of [RH02, sec. 6.3], and the costs of [RH02,
//! tab. 3] as exponents of F, P, S and T, each fitted to times of this machine.
//!
//! `cargo run --release --manifest-path research/Cargo.toml --bin paper-costs`
//!
//! A power law is fitted by least squares of logarithms; its residual is the RMS of the relative
//! differences. Runs of one law take turns, and their medians count. Both sides are those of `paper-ratios`:
//! kernels on all threads, with what depends on the grid alone made before. BRDF coefficients are made
//! before, too, except in the validation: table 3 leaves out what is not dominant.

use brdf::{BrdfCoefficients, Choice, project};
use research::paper::{GRID, TABLE4, Table4, cull, environment, material, phong_degree};
use research::turns::{PowerLaw, Run, median_seconds, run};
use sh::{Degree, Stop, Tolerance, Transform, unstopped};
use shrm::reference::Reference;
use shrm::{MapGrid, MapViews, Reflection, View, ViewSet};
use sphere::{Direction, LatLong};

/// The error for which the harmonic side of the paper chooses its degree.
const EPSILON: f64 = 0.01;

fn main() {
    validation();
    println!();
    table3();
}

/// F and the two costs over the exponent s, and the s at which both ways cost the same.
fn validation() {
    let tolerance = Choice::Tolerance(Tolerance::new(EPSILON).expect("between 0 and 1"));
    let degree = |s: usize| {
        let phong = material("phong", "exponent", s as f64);
        project(&phong, tolerance, Stop::NEVER).expect("a series").coefficients.f().get()
    };
    let exponents = TABLE4.map(|row| row.s);
    let cases = exponents.map(Table4::new);
    let sides = cases.iter().flat_map(|case| [run(move || case.angular()), run(move || case.frequency())]);
    let seconds = median_seconds(&mut sides.collect::<Vec<_>>());

    println!("Section 6.3: phong, {} x {}; milliseconds of processor time", GRID.width, GRID.height);
    println!("F(1 %) is the least degree that holds 99 % of the energy; the harmonic side takes F.");
    println!(
        "{:>5} {:>6} {:>4} {:>8} {:>9} {:>10} {:>7}",
        "s", "F(1 %)", "F", "W", "angular", "harmonics", "ratio"
    );
    let (mut degrees, mut widths, mut angular, mut harmonic) = (vec![], vec![], vec![], vec![]);
    for ((s, case), times) in exponents.into_iter().zip(&cases).zip(seconds.chunks(2)) {
        let (at, found) = (s as f64, degree(s));
        println!(
            "{s:>5} {found:>6} {:>4} {:>8.4} {:>9.2} {:>10.3} {:>7.1}",
            phong_degree(s),
            case.width(),
            1e3 * times[0],
            1e3 * times[1],
            times[0] / times[1],
        );
        degrees.push((at, found as f64));
        widths.push((at, case.width()));
        angular.push((at, times[0]));
        harmonic.push((at, times[1]));
    }

    let papers = |of: fn(&research::paper::Row4) -> f64| {
        PowerLaw::of(&TABLE4.each_ref().map(|row| (row.s as f64, of(row))))
    };
    let (paper_angular, paper_harmonic) = (papers(|row| row.angular), papers(|row| row.frequency));
    println!();
    println!(
        "{:>14} {:>9} {:>9} {:>10} {:>15} {:>9}",
        "", "exponent", "residual", "in theory", "paper's table 4", "residual"
    );
    let law = |name: &str, points: &[(f64, f64)], theory: f64, paper: Option<PowerLaw>| {
        let law = PowerLaw::of(points);
        let paper = paper.map(|paper| format!("{:>15.2} {:>9}", paper.exponent, percent(paper.residual)));
        println!(
            "{name:>14} {:>9.2} {:>9} {theory:>10.2} {}",
            law.exponent,
            percent(law.residual),
            paper.unwrap_or_default()
        );
        law
    };
    let found = law("F(1 %) over s", &degrees, 0.5, None);
    law("W over s", &widths, -1.0, None);
    let angular_law = law("C_a over s", &angular, -1.0, Some(paper_angular));
    law("C_a over W", &pairs(&widths, &angular), 1.0, None);
    let harmonic_law = law("C_f over s", &harmonic, 0.5, Some(paper_harmonic));
    println!(
        "F(1 %) = {:.2} sqrt(s) by the law at s = 128; in theory sqrt(-ln 0.01) = {:.2}",
        found.at(128.0) / 128.0_f64.sqrt(),
        (-EPSILON.ln()).sqrt()
    );
    // The octaves that are nearest to the crossing, since the laws bend. No larger s is timed: its degree
    // would need more than 128 columns.
    let last = exponents.len() - 3;
    let sharp = PowerLaw::of(&angular[last..]).crossing(&PowerLaw::of(&harmonic[last..]));
    println!(
        "s* = {:.0} by the laws over all s, {sharp:.0} by those over s >= {}; the paper's table 4: {:.0}; \
         S_L^(4/3) = {:.0}",
        angular_law.crossing(&harmonic_law),
        exponents[last],
        paper_angular.crossing(&paper_harmonic),
        (GRID.height as f64).powf(4.0 / 3.0)
    );
}

/// The second values of both lists, as points.
fn pairs(one: &[(f64, f64)], other: &[(f64, f64)]) -> Vec<(f64, f64)> {
    one.iter().zip(other).map(|(x, y)| (x.1, y.1)).collect()
}

/// The costs of table 3, each over one variable.
fn table3() {
    println!("Table 3: what each cost grows with; milliseconds of processor time");
    println!(
        "{:>26} {:>5} {:>15} {:>19} {:>9} {:>8} {:>9}",
        "cost", "over", "from .. to", "milliseconds", "exponent", "table's", "residual"
    );
    angular_map();
    harmonic_map();
    shrm();
    view_maps();
}

/// W S_L^2 S_B^2, with the W of s = 32.
fn angular_map() {
    let phong = material("phong", "exponent", 32.0);
    let over = |name: &str, sides: [usize; 4], case: &dyn Fn(usize) -> [usize; 2]| {
        print_law("a map by angles", name, 2.0, &sides, |side| {
            let [light, map] = case(side);
            let reference = Reference::at_centres(&environment(square(light)), &phong, cull());
            run(move || reference.map(MapGrid::LatLong(square(map)), Direction::Z))
        });
    };
    over("S_L", [32, 64, 128, 256], &|side| [side, 64]);
    over("S_B", [32, 64, 128, 256], &|side| [64, side]);
}

/// F S^2, from pixels to pixels: a map of a radially symmetric material.
fn harmonic_map() {
    let map = |f: usize, side: usize| {
        let (grid, brdf) = (square(side), coefficients("phong", "exponent", 32.0, [f, 0]));
        let (environment, transform) = (environment(grid), transform(grid, f));
        run(move || {
            let lighting = transform.analyse(environment.pixels());
            let field = Reflection::convolve(&lighting, &brdf).radial().expect("phong is radially symmetric");
            transform.synthesise::<f32>(&field)
        })
    };
    print_law("a map by harmonics", "F", 1.0, &[4, 8, 16, 32, 63], |f| map(f, 128));
    print_law("a map by harmonics", "S", 2.0, &[64, 128, 256, 512], |side| map(12, side));
}

/// F (P + 1)^2 S^2, from the environment's pixels to the SHRM.
fn shrm() {
    let map = |f: usize, p: usize, side: usize| {
        let (grid, brdf) = (square(side), coefficients("microfacet", "sigma", 0.2, [f, p]));
        let (environment, transform) = (environment(grid), transform(grid, f));
        run(move || {
            let field = Reflection::convolve(&transform.analyse(environment.pixels()), &brdf);
            field.synthesise(MapGrid::LatLong(grid), View::Local, Stop::NEVER).expect("a map")
        })
    };
    print_law("an SHRM", "F", 1.0, &[8, 16, 32, 63], |f| map(f, 2, 128));
    print_law("an SHRM", "P+1", 2.0, &[2, 3, 4, 6, 9], |terms| map(12, terms - 1, 128));
    print_law("an SHRM", "S", 2.0, &[32, 64, 128, 256], |side| map(12, 2, side));
}

/// P T^2 S^2, from an SHRM.
fn view_maps() {
    let maps = |p: usize, views: usize, side: usize| {
        let (grid, brdf) = (square(side), coefficients("microfacet", "sigma", 0.2, [12, p]));
        let field = Reflection::convolve(&transform(grid, 12).analyse(environment(grid).pixels()), &brdf);
        let shrm = field.synthesise(MapGrid::LatLong(grid), View::Local, Stop::NEVER).expect("a map");
        run(move || {
            let views = MapViews::Table { side: views, view: View::Local };
            unstopped(|stop| ViewSet::from_shrm(&shrm, views, stop)).expect("maps for views")
        })
    };
    print_law("T x T maps of an SHRM", "P+1", 1.0, &[2, 3, 4, 6, 9], |terms| maps(terms - 1, 10, 64));
    print_law("T x T maps of an SHRM", "T", 2.0, &[4, 8, 16, 32], |views| maps(2, views, 64));
    print_law("T x T maps of an SHRM", "S", 2.0, &[32, 64, 128, 256], |side| maps(2, 10, side));
}

/// Times a run for each value of a variable, and prints the law of their medians.
fn print_law<'a>(
    cost: &str,
    variable: &str,
    expected: f64,
    values: &[usize],
    case: impl Fn(usize) -> Run<'a>,
) {
    let seconds = median_seconds(&mut values.iter().map(|value| case(*value)).collect::<Vec<_>>());
    let points = values.iter().zip(&seconds).map(|(value, seconds)| (*value as f64, *seconds));
    let law = PowerLaw::of(&points.collect::<Vec<_>>());
    let [first, last] = [0, values.len() - 1];
    println!(
        "{cost:>26} {variable:>5} {:>15} {:>19} {:>9.2} {expected:>8} {:>9}",
        format!("{} .. {}", values[first], values[last]),
        format!("{:.3} .. {:.2}", 1e3 * seconds[first], 1e3 * seconds[last]),
        law.exponent,
        percent(law.residual),
    );
}

fn square(side: usize) -> LatLong {
    LatLong { width: side, height: side }
}

fn transform(grid: LatLong, f: usize) -> Transform {
    Transform::new(grid, Degree::new(f).expect("a degree")).expect("the grid holds the degree")
}

fn coefficients(model: &str, parameter: &'static str, value: f64, [f, p]: [usize; 2]) -> BrdfCoefficients {
    let [f, p] = [f, p].map(|degree| Degree::new(degree).expect("a degree"));
    let material = material(model, parameter, value);
    project(&material, Choice::Degree { f, p }, Stop::NEVER).expect("the degrees are low").coefficients
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}
