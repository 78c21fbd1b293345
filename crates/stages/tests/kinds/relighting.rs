//! docs/relighting.md: its tables and formulas, read from the text, against the harmonics.

use sh::{Basis, Degree, Expansion, rotate};
use sphere::{DVec3, Direction, Rotation, from_file};

const TEXT: &str = include_str!("../../../../docs/relighting.md");

fn harmonics(direction: DVec3) -> Vec<f64> {
    let mut y = vec![0.0; 25];
    Basis::new(Degree::new(4).unwrap()).evaluate_into(Direction::normalised(direction), &mut y);
    y
}

fn directions() -> impl Iterator<Item = DVec3> {
    (0..20).map(|k| {
        let k = f64::from(k);
        DVec3::new((1.3 * k).sin(), (2.1 * k + 0.4).cos(), (0.7 * k + 1.0).sin()).normalize()
    })
}

/// A light of degree 4 without symmetry, one channel.
fn light() -> Vec<f64> {
    (0..25).map(|row| (1.7 * f64::from(row) + 0.3).sin()).collect()
}

fn value(light: &[f64], direction: DVec3) -> f64 {
    light.iter().zip(harmonics(direction)).map(|(c, y)| c * y).sum()
}

/// The cells of the rows of the table whose header begins with these words.
fn table(header: &str) -> Vec<Vec<&'static str>> {
    let (_, after) = TEXT.split_once(header).unwrap();
    let rows = after.lines().skip(2).take_while(|line| line.starts_with('|'));
    let rows: Vec<Vec<_>> =
        rows.map(|line| line.trim_matches('|').split('|').map(str::trim).collect()).collect();
    assert!(!rows.is_empty(), "{header}");
    rows
}

/// `-X, Y, Z` as a choice of signed components.
fn axes(text: &str, of: DVec3) -> Option<DVec3> {
    let axis = |part: &str| {
        let (sign, name) = part.strip_prefix('-').map_or((1.0, part), |name| (-1.0, name));
        let index = ["X", "Y", "Z"].iter().position(|axis| *axis == name)?;
        Some(sign * of[index])
    };
    let parts: Option<Vec<f64>> = text.split(", ").map(axis).collect();
    Some(DVec3::from_array(parts?.try_into().ok()?))
}

#[test]
fn axes_of_engines_lead_back_to_ours() {
    let mut read = 0;
    for row in table("| engine | its axes after import |") {
        let ours = row[2].trim_matches(['(', ')']);
        for file in directions() {
            let engine = match row[1].split(" of glTF").next().and_then(|list| axes(list, file)) {
                Some(engine) => engine,
                None => {
                    assert_eq!(row[1], "those of glTF");
                    file
                }
            };
            assert_eq!(axes(ours, engine), Some(from_file(file)), "{}", row[0]);
            let mirrored = row[1].contains("mirrored");
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axes(ours, axis).unwrap());
            assert_eq!(x.cross(y).dot(z) < 0.0, mirrored, "{}", row[0]);
        }
        read += 1;
    }
    assert_eq!(read, 4);
}

#[test]
fn signs_of_mirrored_coefficients_are_those_of_the_table() {
    let rows = table("| Specula's L_l,m |");
    assert_eq!(rows.len(), 9);
    let number = |text: &str| text.parse::<isize>().unwrap();
    // What the engine calls (Z, X, Y) in Unity, and (X, Y, Z) in Unreal, of a direction of ours.
    let seen: [fn(DVec3) -> DVec3; 2] = [|d| DVec3::new(d.x, -d.y, d.z), |d| DVec3::new(d.y, d.x, d.z)];
    for (engine, seen) in seen.into_iter().enumerate() {
        let given = light();
        let mut ours = vec![0.0; 25];
        for row in &rows {
            let m = number(row[0].strip_prefix("m = ").unwrap());
            let cell = row[1 + engine];
            let (sign, from) = (if cell.starts_with('-') { -1.0 } else { 1.0 }, number(&cell[1..]));
            for l in m.unsigned_abs()..=4 {
                let middle = (l * l + l) as isize;
                ours[(middle + m) as usize] = sign * given[(middle + from) as usize];
            }
        }
        for direction in directions() {
            let error = value(&ours, direction) - value(&given, seen(direction));
            assert!(error.abs() < 1e-13, "{engine}: {error}");
        }
    }
}

#[test]
fn a_turn_about_the_vertical_is_that_of_the_text() {
    for formula in ["L'_l,m = cos(m a) L_l,m - sin(m a) L_l,-m", "L'_l,-m = sin(m a) L_l,m + cos(m a) L_l,-m"]
    {
        assert!(TEXT.contains(formula), "{formula}");
    }
    let (given, a) = (light(), 0.6_f64);
    let mut turned = given.clone();
    for l in 1..=4_usize {
        for m in 1..=l {
            let (s, c) = (m as f64 * a).sin_cos();
            let middle = l * l + l;
            turned[middle + m] = c * given[middle + m] - s * given[middle - m];
            turned[middle - m] = s * given[middle + m] + c * given[middle - m];
        }
    }
    let rows = given.iter().map(|c| [*c; 3]).collect();
    let series = Expansion::from_coefficients(Degree::new(4).unwrap(), rows).unwrap();
    let expected = rotate(&series, Rotation::from_yaw_pitch_roll(a, 0.0, 0.0));
    for (found, expected) in turned.iter().zip(expected.coefficients()) {
        assert!((found - expected[0]).abs() < 1e-13);
    }
}

#[test]
fn harmonics_of_the_text_are_ours() {
    let (_, after) = TEXT.split_once("export function harmonics").unwrap();
    let lines = after.lines().skip_while(|line| !line.contains("return [")).skip(1).take(25);
    // Each line is a constant times a polynomial.
    let constants: Vec<f64> = lines
        .map(|line| line.trim().trim_end_matches(',').split(" * ").next().unwrap().parse().unwrap())
        .collect();
    for d in directions() {
        let DVec3 { x, y, z } = d;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let polynomials = [
            1.0,
            y,
            z,
            x,
            x * y,
            y * z,
            3.0 * zz - 1.0,
            z * x,
            xx - yy,
            y * (3.0 * xx - yy),
            x * y * z,
            y * (5.0 * zz - 1.0),
            z * (5.0 * zz - 3.0),
            x * (5.0 * zz - 1.0),
            z * (xx - yy),
            x * (xx - 3.0 * yy),
            x * y * (xx - yy),
            y * z * (3.0 * xx - yy),
            x * y * (7.0 * zz - 1.0),
            y * z * (7.0 * zz - 3.0),
            35.0 * zz * zz - 30.0 * zz + 3.0,
            z * x * (7.0 * zz - 3.0),
            (xx - yy) * (7.0 * zz - 1.0),
            z * x * (xx - 3.0 * yy),
            xx * (xx - 3.0 * yy) - yy * (3.0 * xx - yy),
        ];
        for (row, expected) in harmonics(d).into_iter().enumerate() {
            assert!((constants[row] * polynomials[row] - expected).abs() < 1e-14, "{row}");
        }
    }
}

/// Both shaders multiply component k of attribute n with coefficient 4 n + k.
#[test]
fn shaders_sum_all_coefficients_in_order() {
    for name in ["_transfer_", "v.t"] {
        for part in 0..7 {
            let term = format!("four({}, {name}{part})", 4 * part);
            assert_eq!(TEXT.matches(&term).count(), 1, "{term}");
        }
    }
    let sums = TEXT.matches("light[first]").count() + TEXT.matches("_Light[first]").count();
    assert_eq!((sums, TEXT.matches("Light.Load(int3(4 * part + k, 0, 0))").count()), (2, 1));
}
