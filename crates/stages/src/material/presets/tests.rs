use brdf::{Material, StandardParameters};

use super::*;
use crate::material::read_material;

/// The rows of a table of `tests/data/spectra`: words, without its comments and its head.
fn rows(text: &'static str) -> impl Iterator<Item = Vec<&'static str>> {
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    rows.map(|line| line.split(',').collect())
}

fn number(word: &str) -> f64 {
    word.parse().unwrap()
}

/// From XYZ to linear sRGB (IEC 61966-2-1), of which D65 is the white.
const TO_SRGB: [[f64; 3]; 3] = [
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
];

fn apply(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The colour of a reflectance, a function of the wavelength in nm; that of a perfect white is 1.
fn seen(reflectance: impl Fn(f64) -> f64) -> [f64; 3] {
    let (mut xyz, mut white) = ([0.0; 3], [0.0; 3]);
    for row in rows(include_str!("../../../tests/data/spectra/observer.csv")) {
        let [nm, x, y, z, d65] = row[..].try_into().map(|row: [&str; 5]| row.map(number)).unwrap();
        for (channel, weight) in [x, y, z].into_iter().enumerate() {
            white[channel] += weight * d65;
            xyz[channel] += weight * d65 * reflectance(nm);
        }
    }
    let [xyz, white] = [xyz, white].map(|sum| apply(&TO_SRGB, sum));
    [0, 1, 2].map(|channel| xyz[channel] / white[channel])
}

/// The value at `x` between the rows of a table, which are sorted by their first numbers.
fn between(table: &[(f64, f64)], x: f64) -> f64 {
    let after = table.partition_point(|(at, _)| *at < x).clamp(1, table.len() - 1);
    let [(x0, y0), (x1, y1)] = [table[after - 1], table[after]];
    y0 + (y1 - y0) * ((x - x0) / (x1 - x0)).clamp(0.0, 1.0)
}

fn parameters(preset: &Preset) -> StandardParameters {
    let read = read_material("a.toml", preset.text.as_bytes(), None, &|_| unreachable!()).unwrap();
    match read.material {
        Material::Standard(material) => material.parameters(),
        other => panic!("{}: {other:?}", preset.name),
    }
}

#[track_caller]
fn check_colour(name: &str, measured: [f64; 3]) {
    let colour = parameters(Preset::named(name).unwrap()).base_color;
    for (channel, measured) in colour.into_iter().zip(measured) {
        // Presets have three digits; the observer's own table has rounded ones.
        assert!((channel - measured.clamp(0.0, 1.0)).abs() < 0.0011, "{name}: {colour:?} is not {measured}");
    }
}

/// The names of a table's materials, each once.
fn names(text: &'static str) -> Vec<&'static str> {
    let mut names: Vec<_> = rows(text).map(|row| row[0]).collect();
    names.dedup();
    names
}

#[test]
fn metals_have_the_reflectance_of_their_n_and_k() {
    let text = include_str!("../../../tests/data/spectra/metals.csv");
    for name in names(text) {
        let of = |column: usize| {
            let rows = rows(text).filter(|row| row[0] == name);
            rows.map(|row| (1000.0 * number(row[1]), number(row[column]))).collect::<Vec<_>>()
        };
        let (n, k) = (of(2), of(3));
        let reflectance = |nm: f64| {
            let (n, k) = (between(&n, nm), between(&k, nm));
            ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
        };
        check_colour(name, seen(reflectance));
        assert_eq!(parameters(Preset::named(name).unwrap()).metallic, 1.0);
    }
    assert_eq!(names(text).len(), 8);
}

#[test]
fn other_materials_have_their_measured_colour() {
    let text = include_str!("../../../tests/data/spectra/reflectances.csv");
    for name in names(text) {
        let rows = rows(text).filter(|row| row[0] == name);
        let table: Vec<_> = rows.map(|row| (number(row[1]), number(row[2]))).collect();
        check_colour(name, seen(|nm| between(&table, nm)));
    }
    let tristimulus = include_str!("../../../tests/data/spectra/tristimulus.csv");
    for row in rows(tristimulus) {
        let mut xyz = [row[2], row[3], row[4]].map(number);
        if row[1] == "D50" {
            xyz = from_d50(xyz);
        }
        let measured = apply(&TO_SRGB, xyz);
        let colour = parameters(Preset::named(row[0]).unwrap()).base_color;
        // The measuring device rounds, and converts for an observer of 10 degrees.
        let tolerance = if row[1] == "D50" { 0.0015 } else { 0.005 };
        let is_near = colour.iter().zip(measured).all(|(a, b)| (a - b).abs() < tolerance);
        assert!(is_near, "{}: {colour:?} is not {measured:?}", row[0]);
    }
    assert_eq!(names(text).len() + names(tristimulus).len() + 8, PRESETS.len());
}

/// Bradford's transform from D50 to D65 (Lindbloom).
fn from_d50(xyz: [f64; 3]) -> [f64; 3] {
    let bradford = [
        [0.9555766, -0.0230393, 0.0631636],
        [-0.0282895, 1.0099416, 0.0210077],
        [0.0122982, -0.0204830, 1.3299098],
    ];
    apply(&bradford, xyz)
}

#[test]
fn every_preset_says_what_it_is_and_where_its_numbers_are_from() {
    for preset in PRESETS {
        assert!(!preset.summary().is_empty() && preset.summary().len() < 60, "{}", preset.summary());
        assert!(
            preset.text.contains("\n# base_color ") && preset.text.contains("CC0")
                || preset.text.contains("X-Rite")
        );
        assert!(preset.text.contains("choice"), "{}: nothing measured says how rough it is", preset.name);
        assert!(
            !brdf::checks(&Material::Standard(brdf::Standard::new(parameters(preset)).unwrap()))
                .makes_light()
        );
    }
    let names: std::collections::BTreeSet<_> = PRESETS.iter().map(|preset| preset.name).collect();
    assert_eq!(names.len(), 20);
}

#[test]
fn an_unknown_name_is_answered_by_those_that_are_near() {
    for (name, answer) in [
        ("coper", "did you mean \"copper\"?"),
        ("Gold", "did you mean \"gold\"?"),
        ("aluminum", "did you mean \"aluminium\"?"),
        ("nylon", "did you mean \"blue-nylon\" or \"red-nylon\"?"),
        ("red paint", "did you mean \"red-paint\"?"),
        ("oak", "the presets are aluminium, brass, "),
    ] {
        let error = Preset::named(name).unwrap_err();
        assert!(error.contains(answer), "{error}");
    }
}
