//! BC6H makes no seam at the edges of a cube: two texels on both sides of an edge differ from what was given
//! by no more than two on both sides of a block's edge inside a face.

#![allow(clippy::unwrap_used)] // as in any test

use containers::{ReadOptions, TexelFormat, Texture, read_image, read_ktx2, write_ktx2};
use envmap::{Environment, Layout};
use sphere::{Cube, DVec3, Direction, Face};

const EDGE: usize = 128;

const CUBE: Cube = Cube { edge: EDGE };

fn place(face: Face, row: usize, column: usize) -> usize {
    (face as usize * EDGE + row) * EDGE + column
}

/// Neighbours on both sides of the cube's edges, and on both sides of blocks' edges inside faces.
fn pairs() -> [Vec<(usize, usize)>; 2] {
    let last = EDGE - 1;
    let plane = |face, row, column| {
        let v: DVec3 = CUBE.direction(face, row, column).vector();
        v / v.abs().max_element()
    };
    let (mut across, mut inside) = (Vec::new(), Vec::new());
    for face in Face::ALL {
        for k in 0..EDGE {
            let sides = [(0, k, 1, k), (last, k, last - 1, k), (k, 0, k, 1), (k, last, k, last - 1)];
            for (row, column, row_in, column_in) in sides {
                // Just past the edge, which is half a texel away.
                let border = plane(face, row, column);
                let past = border + 0.51 * (border - plane(face, row_in, column_in));
                let (other, s, t) = CUBE.position(Direction::normalised(past));
                let at = |share: f64| ((share * EDGE as f64) as usize).min(last);
                assert!(other != face);
                if (face as usize) < other as usize {
                    across.push((place(face, row, column), place(other, at(t), at(s))));
                }
            }
            for end in (3..last).step_by(4) {
                inside.push((place(face, k, end), place(face, k, end + 1)));
                inside.push((place(face, end, k), place(face, end + 1, k)));
            }
        }
    }
    assert_eq!(across.len(), 12 * EDGE);
    [across, inside]
}

fn stops(value: f32) -> f64 {
    // Smaller halves have steps of one size.
    math::log2(f64::from(value.clamp(6.2e-5, 65504.0)))
}

/// The RMS error of the differences of pairs, in stops.
fn seam(pairs: &[(usize, usize)], given: &[[f32; 3]], found: &[[f32; 3]]) -> f64 {
    let step =
        |texels: &[[f32; 3]], (a, b): (usize, usize), c: usize| stops(texels[a][c]) - stops(texels[b][c]);
    let squares = pairs
        .iter()
        .flat_map(|&pair| [0, 1, 2].map(|c| (step(found, pair, c) - step(given, pair, c)).powi(2)));
    (squares.sum::<f64>() / (3 * pairs.len()) as f64).sqrt()
}

fn check(name: &str, pixels: Vec<[f32; 3]>) {
    let texture = Texture { width: EDGE, height: EDGE, faces: 6, pixels, ..Texture::default() };
    let file = write_ktx2(&texture, TexelFormat::Bc6h, None, &[]).unwrap().bytes;
    let found = read_ktx2(&file).unwrap();
    let [across, inside] = pairs().map(|pairs| seam(&pairs, &texture.pixels, &found.pixels));
    assert!(across <= inside, "{name}: {across} across edges, {inside} inside faces");
}

/// Light of a direction at each texel.
fn cube(light: impl Fn(DVec3) -> [f64; 3]) -> Vec<[f32; 3]> {
    let texel = |index: usize| {
        let (face, row, column) = (index / (EDGE * EDGE), index / EDGE % EDGE, index % EDGE);
        light(CUBE.direction(Face::ALL[face], row, column).vector()).map(|value| value as f32)
    };
    (0..CUBE.len()).map(texel).collect()
}

#[test]
fn procedural_light_has_no_seam() {
    check("gradient", cube(|d| [0.3 + 0.2 * d.z, 0.4 + 0.3 * d.z, 0.9 + 0.4 * d.x]));
    // A lamp at a corner of the cube, before a blue sky.
    let lamp = DVec3::ONE.normalize();
    check(
        "lamp",
        cube(|d| {
            let near = 200.0 * math::exp(40.0 * (d.dot(lamp) - 1.0));
            [0.2 + near, 0.4 + 0.8 * near, 1.0 + 0.5 * near]
        }),
    );
    // Waves of three colours across all faces.
    check(
        "waves",
        cube(|d| {
            let wave = |v: DVec3| math::exp(1.5 * math::sin(30.0 * d.dot(v)));
            [
                wave(DVec3::new(0.6, 0.0, 0.8)),
                wave(DVec3::new(0.0, 0.8, 0.6)),
                wave(DVec3::new(0.8, 0.6, 0.0)),
            ]
        }),
    );
}

#[test]
fn photographs_have_no_seam() {
    let Some(corpus) = test_data::folder("photographs_have_no_seam", "SPECULA_CORPUS") else { return };
    for name in ["apartment", "forest", "night", "studio", "sunrise"] {
        let bytes = std::fs::read(corpus.join(format!("env/cc0/{name}.hdr"))).unwrap();
        let image = read_image(&bytes, &ReadOptions::default()).unwrap().image;
        let environment = Environment::from_image(image, Layout::LatLong, None).unwrap();
        check(name, environment.cube_map(CUBE).unwrap().pixels().to_vec());
    }
}
