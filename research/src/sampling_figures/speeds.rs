//! Points a second against coefficients, and the chart of them.

use std::fmt::Write as _;
use std::time::Instant;

use envmap::Environment;
use sampling::{
    LeafShape, Options, Points, ProductOptions, ProductSampler, ProductTables, SUM, Sampler, Tables,
    TexelLight,
};
use sh::Degree;
use sphere::{Direction, LatLong};

use super::first;
use super::phong::Phong;

/// The degrees that are measured: 9, 25, 100 and 400 coefficients.
pub const DEGREES: [usize; 4] = [2, 4, 9, 19];

/// Points of one measurement.
const COUNT: usize = 1 << 18;

/// Measurements, of which the fastest counts.
const ROUNDS: usize = 9;

/// What one kind of sampler does.
#[derive(Clone, Debug)]
pub struct Line {
    /// `flat`, `bilinear`, `exact` or `product`.
    pub name: &'static str,
    /// Millions of points a second, direction and density, for each of [`DEGREES`].
    pub millions: [f64; 4],
}

/// Measures all kinds on this many threads.
///
/// # Errors
/// If a degree is too high.
pub fn measure(threads: usize) -> Result<Vec<Line>, Box<dyn std::error::Error>> {
    let axis = Direction::from_angles(0.9, 0.4);
    // A lobe that its degree holds to a percent or so.
    let lobe = |degree: Degree| {
        let exponent = (degree.get() * degree.get() / 8).max(1) as u32;
        Phong { exponent, axis }.coefficients(degree)
    };
    let grid = LatLong::with_rows(512);
    let sky = |index: usize| {
        let w = grid.direction(index / grid.width, index % grid.width).vector();
        [(1.2 + (7.0 * w.x).sin() * (9.0 * w.y).cos() + w.z) as f32; 3]
    };
    let environment = Environment::new(grid, (0..grid.len()).map(sky).collect()).ok_or("a sky")?;
    let light = TexelLight::new(&environment, SUM)?;
    let points = first(Points::Random { seed: 1 }, COUNT);
    let mut lines = Vec::new();
    for (name, shape) in
        [("flat", LeafShape::Flat), ("bilinear", LeafShape::Bilinear), ("exact", LeafShape::Exact)]
    {
        let mut millions = [0.0; 4];
        for (millions, degree) in millions.iter_mut().zip(DEGREES) {
            let degree = Degree::new(degree)?;
            let options = Options { shape, ..Options::default() };
            let sampler = Sampler::new(&Tables::new(degree), &lobe(degree), options)?;
            *millions = rate(threads, &points, |points, directions, densities| {
                sampler.sample_into(points, directions, densities);
            })?;
        }
        lines.push(Line { name, millions });
    }
    let mut millions = [0.0; 4];
    for (millions, degree) in millions.iter_mut().zip(DEGREES) {
        let degree = Degree::new(degree)?;
        let tables = ProductTables::new(&light, &Tables::new(degree));
        let sampler = ProductSampler::new(&tables, &lobe(degree), ProductOptions::default())?;
        *millions = rate(threads, &points, |points, directions, densities| {
            sampler.sample_into(points, directions, densities);
        })?;
    }
    lines.push(Line { name: "product", millions });
    Ok(lines)
}

/// Millions of points a second, of the fastest round.
fn rate(
    threads: usize,
    points: &[[f32; 2]],
    draw: impl Fn(&[[f32; 2]], &mut [[f32; 3]], &mut [f32]) + Send + Sync,
) -> Result<f64, rayon::ThreadPoolBuildError> {
    let (mut directions, mut densities) = (vec![[0.0; 3]; points.len()], vec![0.0; points.len()]);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut seconds = f64::INFINITY;
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        pool.install(|| draw(points, &mut directions, &mut densities));
        seconds = seconds.min(begin.elapsed().as_secs_f64());
    }
    Ok(points.len() as f64 / seconds / 1e6)
}

/// The colours of lines.
const COLOURS: [&str; 4] = ["#1f77b4", "#2ca02c", "#9467bd", "#d62728"];

/// A chart as SVG, both axes logarithmic: coefficients to the right, millions of points a second upward, and
/// the 5 million of the talk at 400 coefficients as a cross.
pub fn chart(lines: &[Line], threads: usize) -> String {
    let x = |coefficients: f64| 70.0 + 480.0 * (coefficients / 9.0).ln() / (400f64 / 9.0).ln();
    let y = |millions: f64| 300.0 - 280.0 * (millions / 1.0).max(1.0).ln() / 200f64.ln();
    let mut svg = String::new();
    let mut add = |line: std::fmt::Arguments<'_>| {
        // A String takes all.
        let _ = writeln!(svg, "{line}");
    };
    add(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 660 360\" font-family=\"sans-serif\" \
         font-size=\"13\">"
    ));
    add(format_args!("<rect width=\"660\" height=\"360\" fill=\"#fff\"/>"));
    for millions in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0] {
        let height = y(millions);
        add(format_args!("<path d=\"M70 {height:.1}H550\" stroke=\"#ddd\"/>"));
        add(format_args!("<text x=\"62\" y=\"{:.1}\" text-anchor=\"end\">{millions}</text>", height + 4.0));
    }
    for degree in DEGREES {
        let coefficients = (degree + 1) * (degree + 1);
        let at = x(coefficients as f64);
        add(format_args!("<text x=\"{at:.1}\" y=\"320\" text-anchor=\"middle\">{coefficients}</text>"));
    }
    add(format_args!("<text x=\"310\" y=\"346\" text-anchor=\"middle\">coefficients</text>"));
    add(format_args!(
        "<text x=\"20\" y=\"160\" text-anchor=\"middle\" transform=\"rotate(-90 20 160)\">\
         million points a second, {threads} threads</text>"
    ));
    for (line, colour) in lines.iter().zip(COLOURS) {
        let places = line.millions.iter().zip(DEGREES).map(|(millions, degree)| {
            format!("{:.1},{:.1}", x(((degree + 1) * (degree + 1)) as f64), y(*millions))
        });
        let places: Vec<String> = places.collect();
        add(format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
            places.join(" ")
        ));
    }
    // Names at the ends of lines, each at least a line of text below the one above.
    let mut ends: Vec<(f64, usize)> = lines.iter().map(|line| y(line.millions[3])).zip(0..).collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut above = f64::NEG_INFINITY;
    for (height, index) in ends {
        above = height.max(above + 15.0);
        let (colour, name) = (COLOURS[index % COLOURS.len()], lines[index].name);
        add(format_args!("<text x=\"558\" y=\"{:.1}\" fill=\"{colour}\">{name}</text>", above + 4.0));
    }
    let (left, middle) = (x(400.0), y(5.0));
    add(format_args!(
        "<path d=\"M{:.1} {:.1}l10 10m0 -10l-10 10\" stroke=\"#000\" stroke-width=\"2\"/>",
        left - 5.0,
        middle - 5.0
    ));
    add(format_args!("<text x=\"558\" y=\"{:.1}\">talk, 2009</text>", middle + 4.0));
    add(format_args!("</svg>"));
    svg
}
