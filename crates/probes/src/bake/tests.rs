//! Transport times a sky, next to a second bake under that sky.

use sh::{Expansion, rotate};
use sphere::Rotation;

use super::*;
use crate::{Emission, Material, Part, Scene, SceneParts};

/// The light of one sky alone, in three numbers, for paths and for points of the cache.
struct UnderSky<'a> {
    sky: &'a Expansion,
    /// The sky is turned: it is read in the direction turned back.
    back: Rotation,
    basis: &'a Basis,
    first: Vec<f64>,
    rows: Vec<[f64; 3]>,
    numbers: [f32; 3],
}

impl UnderSky<'_> {
    fn add(&mut self, light: [f64; 3]) {
        for (row, y) in self.rows.iter_mut().zip(&self.first) {
            (0..3).for_each(|channel| row[channel] += light[channel] * y);
        }
    }
}

impl Visitor for UnderSky<'_> {
    fn begin(&mut self, direction: Vec3) {
        self.basis.evaluate_into(double(direction), &mut self.first);
    }

    fn sky(&mut self, direction: Vec3, share: [f32; 3]) {
        let radiance = self.sky.evaluate(self.back.apply(double(direction)));
        let light = [0, 1, 2].map(|channel| f64::from(share[channel]) * radiance[channel]);
        (0..3).for_each(|channel| self.numbers[channel] += light[channel] as f32 / SKY_RAYS as f32);
        self.add(light);
    }

    fn emission(&mut self, _: usize, _: [f32; 3], _: u32) {}

    fn emission_from(&mut self, _: Vec3, _: usize, _: [f32; 3]) {}

    fn reflects(&mut self, _: &Surfaces<'_>, _: &Place, _: [f32; 3]) {}

    fn cached(&mut self, point: &PointOfCache<'_>, share: [f32; 3]) {
        self.add([0, 1, 2].map(|channel| f64::from(share[channel] * point.light[channel])));
    }
}

impl PointLight for UnderSky<'_> {
    const HAS_SKY: bool = true;

    fn numbers(self) -> Vec<f32> {
        self.numbers.to_vec()
    }
}

/// A room of three colours without a ceiling, with a table of two sides in it.
fn room() -> Scene {
    let square = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| [[a, b, c], [a, c, d]];
    let [p, q, r, s] = [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0], [2.0, 2.0, 0.0], [-2.0, 2.0, 0.0]];
    let up = |[x, y, _]: [f32; 3]| [x, y, 2.5];
    let pieces = [
        ([0.6, 0.5, 0.4], vec![square(p, q, r, s)]),
        ([0.8, 0.1, 0.1], vec![square(p, up(p), up(q), q), square(q, up(q), up(r), r)]),
        ([0.1, 0.7, 0.3], vec![square(r, up(r), up(s), s), square(s, up(s), up(p), p)]),
        (
            [0.5, 0.5, 0.9],
            vec![square([-1.0, -1.0, 1.0], [0.5, -1.0, 1.0], [0.5, 1.0, 1.1], [-1.0, 1.0, 1.1])],
        ),
    ];
    let mut parts = SceneParts::default();
    for (k, ([red, green, blue], squares)) in pieces.into_iter().enumerate() {
        let triangles = squares.concat();
        parts.material_of.extend(vec![k as u32; triangles.len()]);
        parts.attributes_of.extend(vec![SceneParts::NONE; triangles.len()]);
        parts.parts.push(Part { name: String::new(), triangles: triangles.len() });
        parts.triangles.extend(triangles);
        let base = [red, green, blue, 1.0];
        parts.materials.push(Material { base, is_double_sided: k == 3, ..Material::default() });
    }
    // An emitter next to the sky changes nothing of the sky's light.
    parts.materials[3].emission = Some(Emission { radiance: [1.0; 3], texture: None });
    Scene::new(parts).unwrap()
}

/// A sky of degree 4 from all around.
fn sky() -> Expansion {
    let row = |row: usize| {
        [0, 1, 2].map(|channel| match row {
            0 => 4.0,
            _ => (1.7 * (3 * row + channel) as f64).sin() / (1.0 + row as f64),
        })
    };
    Expansion::from_coefficients(sh::Degree::new(4).unwrap(), (0..25).map(row).collect()).unwrap()
}

/// The light of a sky, turned, at probes: the same paths, on which the sky is read instead of its harmonics.
fn under(surfaces: &Surfaces<'_>, at: &[[f32; 3]], options: &BakeOptions, turn: Rotation) -> Vec<[f64; 3]> {
    let (sky, basis) = (sky(), Basis::new(options.degree));
    let emitters = Emitters::of(surfaces);
    let paths = Paths { surfaces, emitters: Some(&emitters), bounces: options.bounces };
    let light = || UnderSky {
        sky: &sky,
        back: turn.inverse(),
        basis: &basis,
        first: vec![0.0; 9],
        rows: vec![[0.0; 3]; 9],
        numbers: [0.0; 3],
    };
    let (points, rays) = BakeOptions::cache_size(options.paths, surfaces.parts.triangles.len());
    let mut found = vec![[0.0; 3]; 9 * at.len()];
    let each = options.paths / BLOCKS as u32;
    for block in 0..BLOCKS {
        let seed = hash(options.seed) ^ block as u64;
        let of_cache =
            CacheOptions { points, rays, seed, with_direct: true, channels: &[0, 1, 2], cells: None };
        let cache = Cache::new(&paths, &of_cache, light, Stop::NEVER).unwrap();
        for (place, found) in at.iter().zip(found.chunks_exact_mut(9)) {
            let numbers = Numbers::new(hash(probe_seed(place, options.seed) ^ block as u64));
            let mut sums = light();
            for index in 0..each {
                paths.trace(Vec3::from(*place), &numbers, index, Some((&cache, each)), &mut sums);
            }
            for (found, row) in found.iter_mut().zip(&sums.rows) {
                (0..3).for_each(|channel| found[channel] += row[channel] / f64::from(options.paths));
            }
        }
    }
    found
}

/// Light is linear: a relit transport is a bake under that sky, also under the sky that is turned.
#[test]
fn a_relit_transport_is_a_bake_under_that_sky() {
    let scene = room();
    let surfaces = Surfaces::new(&scene);
    let at = [[0.0, 0.0, 1.6], [-0.9, 0.1, 0.5], [1.9, -1.9, 0.2], [0.4, 1.2, 3.0]];
    // How early the series of all reflections is continued depends on the columns.
    let options = BakeOptions { paths: 1024, bounces: Some(4), ..BakeOptions::default() };
    let transport = bake(&surfaces, &at, &options, Stop::NEVER).unwrap();
    for turn in [Rotation::IDENTITY, Rotation::from_yaw_pitch_roll(0.9, -0.4, 2.0)] {
        let expected = under(&surfaces, &at, &options, turn);
        let turned = rotate(&sky(), turn);
        let (mut difference, mut size) = (0.0, 0.0);
        for (probe, expected) in expected.chunks_exact(9).enumerate() {
            let mut rows = vec![[0.0; 3]; 9];
            transport.add_sky(probe, &turned, &mut rows);
            for (found, expected) in rows.as_flattened().iter().zip(expected.as_flattened()) {
                difference += (found - expected) * (found - expected);
                size += expected * expected;
            }
        }
        let error = (difference / size).sqrt();
        assert!(error < 1e-5, "{turn:?}: {error}");
    }
}
