//! `sample-directions`: directions follow their density, weights integrate, and errors name parameters.

use engine::Product;
use sphere::{DVec3, Direction, LatLong};
use stages::artifacts::{Brdf, Environment, Lighting, Material};

use crate::fixture::{Case, case, environment, pixels, sky, sky_lighting};
use crate::light_rig::{lit, sunny};

/// The coefficients of a glossy material.
fn glossy() -> Brdf {
    let rough = brdf::Microfacet::new(0.4, [1.0, 0.5, 0.2]).unwrap();
    let case = case("project-brdf", "degree = [8, 4]");
    (*case.input("material", Material(brdf::Material::Microfacet(rough))).artifact::<Brdf>()).clone()
}

const VIEW: &str = "normal = [0.2, 0.1, 1]\nview = [1, 0, 1]\n";

/// Directions of a lobe that rings below zero, seen from the side.
pub(crate) fn lobe(parameters: &str) -> Case {
    case("sample-directions", &format!("{VIEW}{parameters}")).input("function", glossy())
}

/// Directions of its product with the sky of the fixtures, whose sun is 16 texels.
pub(crate) fn product(parameters: &str) -> Case {
    lobe(parameters).input("environment", coarse())
}

fn coarse() -> Environment {
    let sun = Direction::from_angles(0.7, -1.0).vector();
    environment(16, |w| if w.dot(sun) > 0.95 { [40.0, 30.0, 20.0] } else { sky(w) })
}

fn texels(parameters: &str) -> Case {
    case("sample-directions", parameters).input("function", coarse())
}

fn series(parameters: &str) -> Case {
    case("sample-directions", parameters).input("function", sky_lighting())
}

/// A row of the table: the point, the direction, its density and its weight.
struct Row {
    point: [f64; 2],
    direction: DVec3,
    density: f64,
    weight: f64,
}

fn rows(case: &Case) -> Vec<Row> {
    let files = case.files();
    let text = str::from_utf8(&files[1]).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("u,v,x,y,z,pdf,weight"));
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|word| word.parse().unwrap()).collect();
        let &[u, v, x, y, z, density, weight] = &numbers[..] else { panic!("{line}") };
        Row { point: [u, v], direction: DVec3::new(x, y, z), density, weight }
    };
    lines.map(row).collect()
}

/// The numbers of the file beside the table.
fn numbers(case: &Case) -> [f64; 4] {
    let beside: serde_json::Value = serde_json::from_slice(&case.files()[0]).unwrap();
    assert!(beside["specula"].is_object(), "the recipe");
    ["count", "mean", "variance", "standard-error"]
        .map(|name| beside[name].as_str().unwrap().parse().unwrap())
}

/// The picture of the density, and cells of it: blocks of texels.
const ROWS: usize = 128;
const BLOCK: usize = 16;
const CELLS: [usize; 2] = [ROWS / BLOCK, 2 * ROWS / BLOCK];

/// The probability of each cell.
fn probabilities(density: &Case) -> Vec<f64> {
    let (width, height, pixels) = pixels(&density.files()[0]);
    let grid = LatLong { width, height };
    assert_eq!(grid, LatLong::with_rows(ROWS));
    let mut cells = vec![0.0; CELLS[0] * CELLS[1]];
    for (index, pixel) in pixels.iter().enumerate() {
        let (row, column) = (index / width, index % width);
        assert!(pixel[0] >= 0.0 && pixel[0] == pixel[1] && pixel[0] == pixel[2]);
        cells[row / BLOCK * CELLS[1] + column / BLOCK] += f64::from(pixel[0]) * grid.solid_angle(row);
    }
    cells
}

fn counts(rows: &[Row]) -> Vec<f64> {
    let mut cells = vec![0.0; CELLS[0] * CELLS[1]];
    for row in rows {
        let (x, y) = LatLong::with_rows(ROWS).position(Direction::normalised(row.direction));
        let cell = |place: f64, count: usize| (((place + 0.5) / BLOCK as f64) as usize).min(count - 1);
        cells[cell(y, CELLS[0]) * CELLS[1] + cell(x, CELLS[1])] += 1.0;
    }
    cells
}

/// By how many standard deviations chi-square is above its mean, cells that expect less than 5 pooled: a
/// chi-square of k degrees of freedom has the mean k and the variance 2 k.
fn excess(counts: &[f64], probabilities: &[f64]) -> f64 {
    let total: f64 = counts.iter().sum();
    let (mut chi, mut cells, mut pooled) = (0.0, 0, [0.0; 2]);
    let mut add = |count: f64, expected: f64| {
        chi += (count - expected).powi(2) / expected;
        cells += 1;
    };
    for (count, probability) in counts.iter().zip(probabilities) {
        if total * probability < 5.0 {
            pooled = [pooled[0] + count, pooled[1] + total * probability];
        } else {
            add(*count, total * probability);
        }
    }
    assert!(pooled[0] == 0.0 || pooled[1] > 0.0, "a direction that has no density");
    if pooled[1] > 0.0 {
        add(pooled[0], pooled[1]);
    }
    let degrees = f64::from(cells - 1).max(1.0);
    (chi - degrees) / (2.0 * degrees).sqrt()
}

const POINTS: [&str; 5] = ["sobol", "plain-sobol", "random", "halton", "hammersley"];

#[test]
fn a_thousand_directions_of_each_kind_follow_their_density() {
    let both = |of: fn(&str) -> Case, options: &str, name: String| {
        let density = of(&format!("{options}format = \"exr\"\nresolution = {ROWS}"));
        let density = probabilities(&density);
        let whole: f64 = density.iter().sum();
        assert!((whole - 1.0).abs() < 0.01, "{name}: {whole}");
        for points in POINTS {
            let drawn = rows(&of(&format!("{options}count = 1000\npoints = \"{points}\"")));
            assert_eq!(drawn.len(), 1000);
            let excess = excess(&counts(&drawn), &density);
            // 4 deviations: about one in 10^4, for independent points; even points have less.
            assert!(excess < 4.0, "{name} {points}: {excess}");
        }
    };
    for warp in ["rows", "hierarchical"] {
        for leaves in ["flat", "bilinear", "analytic"] {
            for density in ["absolute", "positive"] {
                let options = format!(
                    "warp = \"{warp}\"\nleaves = \"{leaves}\"\ndensity = \"{density}\"\nuniform-share = 0.1\n"
                );
                both(series, &options, format!("series {options}"));
                both(lobe, &options, format!("lobe {options}"));
            }
        }
    }
    both(texels, "", "texels".into());
    for masses in ["leaves", "texels\"\nleaves = \"flat", "texels\"\nleaves = \"bilinear"] {
        let options = format!("masses = \"{masses}\"\n");
        both(product, &options, format!("product {options}"));
    }
}

#[test]
fn another_density_is_rejected() {
    let drawn = counts(&rows(&lobe("count = 1000\npoints = \"random\"")));
    let density = |of: Case| probabilities(&of);
    let picture = format!("format = \"exr\"\nresolution = {ROWS}");
    assert!(excess(&drawn, &density(lobe(&picture))) < 4.0);
    assert!(excess(&drawn, &density(product(&picture))) > 20.0);
    assert!(excess(&drawn, &density(series(&picture))) > 20.0);
}

/// The sum of channels of the sky is 3 + 1.5 z + 0.5 x + 0.3 y + 0.2 x y.
#[test]
fn the_mean_of_the_weights_is_the_integral() {
    let integral = 12.0 * std::f64::consts::PI;
    for points in POINTS {
        for leaves in ["flat", "bilinear", "analytic"] {
            let case = series(&format!("points = \"{points}\"\nleaves = \"{leaves}\""));
            let [count, mean, variance, error] = numbers(&case);
            assert_eq!(count, 1024.0);
            assert!((error - (variance / count).sqrt()).abs() < 1e-12);
            assert!((mean - integral).abs() < 4.0 * error + 1e-5 * integral, "{points} {leaves}: {mean}");
            let bound = [8e-3, 1e-3, 1e-9]
                [["flat", "bilinear", "analytic"].iter().position(|l| *l == leaves).unwrap()];
            assert!(variance < bound * integral * integral, "{points} {leaves}: {variance}");
        }
    }
    for (channels, share) in [("red", 1.0 / 3.0), ("green", 1.0 / 3.0), ("luminance", 1.0 / 3.0)] {
        let [_, mean, ..] = numbers(&series(&format!("channels = \"{channels}\"")));
        assert!((mean - share * integral).abs() < 1e-3 * integral, "{channels}: {mean}");
    }
    // Texels that are constant have the same weight everywhere, the light's integral.
    let whole: f64 = coarse().0.integral().iter().sum();
    let weights = rows(&texels("points = \"random\""));
    assert!(weights.iter().all(|row| (row.weight / whole - 1.0).abs() < 1e-5));
    // A series that rings has negative weights, which the mean needs.
    let f = glossy().0.coefficients;
    let normal = Direction::new(DVec3::new(0.2, 0.1, 1.0)).unwrap();
    let view = Direction::new(DVec3::new(1.0, 0.0, 1.0)).unwrap();
    let series = f.at_view(normal, Direction::X, view);
    let expected: f64 = series.get(0, 0).iter().sum::<f64>() * (4.0 * std::f64::consts::PI).sqrt();
    for density in ["absolute", "positive"] {
        let case = lobe(&format!("count = 65536\npoints = \"random\"\ndensity = \"{density}\""));
        let [_, mean, _, error] = numbers(&case);
        let is_signed = rows(&case).iter().any(|row| row.weight < 0.0);
        assert_eq!(is_signed, density == "absolute");
        assert_eq!((mean - expected).abs() < 4.0 * error, is_signed, "{mean} {expected} {error}");
        for row in rows(&case).iter().step_by(997) {
            let f: f64 = series.evaluate(Direction::normalised(row.direction)).iter().sum();
            let f = if is_signed { f } else { f.max(0.0) };
            assert!((row.weight * row.density - f).abs() < 1e-5 * f.abs() + 1e-6);
        }
    }
}

/// One of a texel's light times the lobe, against the sum over texels.
#[test]
fn the_mean_of_a_product_is_the_sum_over_texels() {
    let (light, f) = (coarse().0, glossy().0.coefficients);
    let normal = Direction::new(DVec3::new(0.2, 0.1, 1.0)).unwrap();
    let series = f.at_view(normal, Direction::X, Direction::new(DVec3::new(1.0, 0.0, 1.0)).unwrap());
    let fine = LatLong::with_rows(256);
    let mut expected = 0.0;
    for index in 0..fine.len() {
        let (row, column) = (index / fine.width, index % fine.width);
        let texel = row / 16 * 32 + column / 16;
        let radiance: f64 = light.pixels()[texel].iter().map(|value| f64::from(*value)).sum();
        let rho: f64 = series.evaluate(fine.direction(row, column)).iter().sum();
        expected += radiance * rho * fine.solid_angle(row);
    }
    for options in ["", "leaves = \"flat\"", "masses = \"leaves\"", "uniform-share = 0.3"] {
        let [_, mean, _, error] =
            numbers(&product(&format!("count = 16384\npoints = \"random\"\n{options}")));
        assert!((mean - expected).abs() < 4.0 * error + 1e-4 * expected, "{options}: {mean} {expected}");
    }
}

#[test]
fn a_file_of_points_is_what_is_drawn_from() {
    let set = rows(&series("points = \"halton\"\ncount = 50"));
    let lines: Vec<String> = set.iter().map(|row| format!("{},{}", row.point[0], row.point[1])).collect();
    let from = |parameters: &str, text: &str| {
        series(&format!("points-file = \"sets/p.csv\"\n{parameters}")).file("sets/p.csv", text)
    };
    let case = from("", &lines.join("\n"));
    let drawn = rows(&case);
    assert_eq!(drawn.len(), 50);
    assert!(drawn.iter().zip(&set).all(|(a, b)| a.direction == b.direction && a.weight == b.weight));
    assert_eq!(case.run().unwrap().reads.len(), 1);
    assert_eq!(rows(&from("count = 7", &lines.join("\n"))).len(), 7);
    let failure = from("count = 51", &lines.join("\n")).run().err().unwrap();
    assert_eq!(failure.to_string(), "points-file \"sets/p.csv\": it has 50 points, not 51");
    assert!(format!("{failure:?}").contains("set count = 50 or less"), "{failure:?}");
    let bad = from("", "u,v\n0.5,0.5\n0.5,nan\n").failure();
    let expected =
        "points-file \"sets/p.csv\": line 3: v is nan; expected a number that is 0 or more and below 1";
    assert_eq!(bad, expected);
    let absent = series("points-file = \"absent.csv\"").failure();
    assert!(
        absent.contains("points-file \"absent.csv\"") && absent.contains("/memory/absent.csv"),
        "{absent}"
    );
}

#[test]
fn files_are_of_the_format() {
    let endings = |format: &str| series(&format!("format = \"{format}\"")).endings();
    assert_eq!(endings("csv"), [".json", ".csv"]);
    assert_eq!(endings("safetensors"), [".safetensors"]);
    assert_eq!(endings("exr"), [".exr"]);
    assert_eq!(series("").product(), Product::Files(vec![".json".into(), ".csv".into()]));
    let file = series("format = \"safetensors\"\ncount = 5").files();
    let found = containers::tensors::describe(&file[0]).unwrap();
    let [count, mean, ..] = numbers(&series("count = 5"));
    assert_eq!((count, found.metadata["count"].as_str()), (5.0, "5"));
    assert_eq!(found.metadata["mean"].parse(), Ok(mean));
    let size = |case: Case| pixels(&case.files()[0]).1;
    assert_eq!(size(series("format = \"exr\"")), 256);
    assert_eq!(size(texels("format = \"exr\"")), 16, "the environment's own rows");
    let ran = series("count = 5").run().unwrap();
    assert!(ran.notes[0].starts_with("5 directions: mean weight 37."), "{:?}", ran.notes);
    // An environment is sampled at either port.
    let alone = case("sample-directions", "").input("environment", coarse());
    assert_eq!(alone.files()[1], texels("").files()[1]);
}

#[test]
fn lights_beside_a_series_are_told() {
    let mut lighting: Lighting = sky_lighting();
    lighting.0.lights = lit().0.lights;
    let ran = case("sample-directions", "").input("function", lighting).run().unwrap();
    assert!(
        ran.warnings[0].starts_with("5 lights beside the series are not sampled ("),
        "{:?}",
        ran.warnings
    );
    let error = case("sample-directions", "").input("function", lit()).failure();
    assert!(error.contains("no mass"), "{error}");
    assert!(series("").run().unwrap().warnings.is_empty());
}

#[test]
fn parameters_that_nothing_uses_are_errors() {
    for (parameters, error) in [
        ("format = \"exr\"\ncount = 5", "count: format = \"exr\" is the density, without directions"),
        ("resolution = 5", "resolution: only format = \"exr\" uses it"),
        ("points = \"halton\"\nseed = 1", "seed: only points = \"sobol\" or \"random\" uses it"),
        (
            "points = \"sobol\"\npoints-file = \"a.csv\"",
            "points: points-file already gives the points; leave out one of the two",
        ),
        (
            "masses = \"leaves\"\nleaves = \"bilinear\"",
            "leaves: masses = \"leaves\" needs \"flat\": leave out one of the two",
        ),
        (
            "view = [1, 0, -0.1]",
            "view: is not above the surface; expected less than 90 degrees between it and `normal`",
        ),
        ("tangent = [0, 0, 2]", "tangent: has the direction of `normal`; expected another one"),
        ("count = 0", "count: 0 is not a whole number from 1 to 1048576"),
    ] {
        assert_eq!(series(parameters).errors(), [error], "{parameters}");
    }
    let series_only = "only a series uses it; texels are constant: connect a lighting or a brdf";
    for (case, error) in [
        (series("view = [0, 0, 1]"), "view: only a material uses it: connect `project-brdf`".to_owned()),
        (
            series("masses = \"leaves\""),
            "masses: only a product uses it: connect a series and an environment".into(),
        ),
        (texels("density = \"positive\""), format!("density: {series_only}")),
        (texels("leaves = \"flat\""), format!("leaves: {series_only}")),
        (texels("warp = \"rows\""), "warp: only a series without an environment uses it".into()),
        (product("warp = \"rows\""), "warp: only a series without an environment uses it".into()),
        (product("leaves = \"analytic\""), "leaves: a product knows \"flat\" and \"bilinear\"".into()),
        (
            texels("").input("environment", sunny()),
            "inputs: a product needs a lighting or a brdf as `function`, not a second environment".into(),
        ),
        (
            case("sample-directions", ""),
            "inputs: connect a lighting, a brdf or an environment: input = \"STAGE\"".into(),
        ),
    ] {
        assert_eq!(case.input_errors(), [error]);
    }
}
