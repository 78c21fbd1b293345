//! Directions, surfaces and maps for the tests of shading, including the difficult cases.

use glam::Vec3;
use sh::Stop;
use sphere::{DVec3, Direction};

use super::surface::Surface;

/// Half a unit of rounding of f32.
pub(crate) const ROUNDING: f64 = 6e-8;

/// Irregular numbers in [0, 1).
pub(crate) fn noise(k: usize) -> f32 {
    ((k.wrapping_mul(2_654_435_761) >> 7) % 65_521) as f32 / 65_521.0
}

/// An irregular map.
pub(crate) fn noise_map(len: usize) -> Vec<[f32; 3]> {
    (0..len).map(|k| [noise(3 * k), noise(3 * k + 1), noise(3 * k + 2)]).collect()
}

/// Directions everywhere, including those at and next to the poles and the axes, edges and corners of a cube.
pub(crate) fn directions() -> Vec<Direction> {
    let mut all = Vec::new();
    for k in 0..2000 {
        let z = 1.0 - (f64::from(k) + 0.5) / 1000.0;
        all.push(Direction::from_angles(z.acos(), 2.399_963 * f64::from(k)));
    }
    for signs in 0..27 {
        let part = |power: i32| f64::from(signs / 3_i32.pow(power as u32) % 3 - 1);
        let v = DVec3::new(part(0), part(1), part(2));
        if v == DVec3::ZERO {
            continue;
        }
        for step in [0.0, 1e-6, 1e-3] {
            for aside in [DVec3::X, -DVec3::Y, DVec3::new(0.3, 0.9, -0.7)] {
                all.push(Direction::normalised(v + aside * step));
            }
        }
    }
    all
}

/// A direction as the shaders have it, and the same in f64.
pub(crate) fn rounded(direction: Direction) -> (Vec3, Direction) {
    let short = direction.vector().as_vec3();
    (short, Direction::normalised(short.as_dvec3()))
}

/// Surfaces from all sides, some close to grazing, and their normal, tangent and view in f64.
pub(crate) fn surfaces() -> Vec<(Surface, [Direction; 3])> {
    let directions = directions();
    (0..directions.len())
        .map(|k| {
            let (normal, _) = rounded(directions[k]);
            let (ray, _) = rounded(directions[(k * 7 + 3) % directions.len()]);
            let surface = Surface::new(normal, Vec3::new(0.3, -0.5, 0.8), ray, normal.dot(ray) < 0.0);
            let exact = |v: Vec3| Direction::normalised(v.as_dvec3());
            (surface, [exact(surface.normal), exact(surface.tangent), exact(surface.view)])
        })
        .collect()
}

/// The largest difference of two colours.
pub(crate) fn apart(found: Vec3, expected: [f64; 3]) -> f64 {
    (0..3).map(|channel| (f64::from(found[channel]) - expected[channel]).abs()).fold(0.0, f64::max)
}

/// A reflection with every term, with coefficients of about 1 that fall off with l.
pub(crate) fn reflection(centre: brdf::Centre, f: usize, p: usize) -> shrm::Reflection {
    let degree = |l| sh::Degree::new(l).unwrap();
    let wave = |row: usize| [0, 1, 2].map(|channel| ((row * 37 + channel * 11) as f64).sin());
    let rows = (0..(f + 1) * (f + 1)).map(|row| wave(row).map(|value| value / (1.0 + row.isqrt() as f64)));
    let sky = sh::Expansion::from_coefficients(degree(f), rows.collect()).unwrap();
    let mut rho = vec![[0.0; 3]; (f + 1) * (p + 1) * (p + 1)];
    for l in 0..=f {
        for p_ in 0..=p {
            for q in 0..=p_.min(l) {
                let place = (l * (p + 1) + p_) * (p + 1) + q;
                rho[place] = wave(place + 1).map(|value| value / (1.0 + l as f64));
            }
        }
    }
    let brdf = brdf::BrdfCoefficients::new(centre, degree(f), degree(p), rho).unwrap();
    shrm::Reflection::convolve(&sky, &brdf)
}

/// Lights in irregular directions, strong and weak, some of them below most surfaces.
pub(crate) fn lights() -> Vec<sh::Light> {
    let light = |k: usize| {
        let direction = Direction::from_angles(0.35 + 0.37 * k as f64, 1.3 + 2.4 * k as f64);
        let flux = [0, 1, 2].map(|channel| 0.1 + 10.0 * f64::from(noise(3 * k + channel + 1)).powi(4));
        sh::Light::from_flux(direction, 0.004 * k as f64, flux)
    };
    (0..8).map(light).collect()
}

/// A map of [`reflection`] on a cube.
pub(crate) fn map(centre: brdf::Centre, edge: usize, p: usize, view: shrm::View) -> shrm::Shrm {
    let grid = shrm::MapGrid::Cube(sphere::Cube { edge });
    reflection(centre, 8, p).synthesise(grid, view, Stop::NEVER).unwrap()
}

/// A scale space of irregular levels, the finest with this edge.
pub(crate) fn scale_space(edge: usize, lights: Vec<sh::Light>) -> taps::ScaleSpace {
    let widths = taps::Widths::new(edge).unwrap();
    let cube = |(seed, edge): (usize, usize)| {
        let texel = |k: usize| [0, 1, 2].map(|channel| noise(7919 * seed + 3 * k + channel));
        envmap::CubeMap::new(sphere::Cube { edge }, (0..6 * edge * edge).map(texel).collect()).unwrap()
    };
    let levels = (0..widths.len()).map(|k| cube((k, widths.edge_of(k)))).collect();
    let normals = (0..taps::NORMAL_KERNELS).map(|k| cube((100 + k, 16))).collect();
    let diffuse = sh::Expansion::zero(sh::Degree::new(2).unwrap());
    taps::ScaleSpace::from_parts(widths, levels, normals, diffuse, lights).unwrap()
}

/// A table of so many taps, and so many about the normal, which move, widen and brighten toward the horizon.
/// The widths reach from below the finest level of an edge of 64 to beyond the last level.
pub(crate) fn tap_table(count: usize, normals: usize) -> taps::TapTable {
    let row = |row: usize| {
        let u = row as f64 / (taps::ROWS - 1) as f64;
        let sine = (1.0 - (1.0 - u).powi(2)).sqrt();
        let weight = |k: usize| [0.2 + 0.5 * u, 0.3, 0.1 * (k + 1) as f64];
        let tap = |k: usize| taps::Tap {
            delta: (0.9 - 0.3 * k as f64) * sine,
            std: 0.02 * 5_f64.powi(k as i32) * (1.0 + u),
            weight: weight(k),
        };
        let normal = |k: usize| taps::NormalTap { y: (0.8 * u + 0.5 * k as f64).min(1.0), weight: weight(k) };
        taps::TapRow { taps: (0..count).map(tap).collect(), normals: (0..normals).map(normal).collect() }
    };
    taps::TapTable::new((0..taps::ROWS).map(row).collect()).unwrap()
}

/// A table of so many facets over a quarter of the disc of views or all of it, and so many taps about the
/// normal, which tilt, widen and brighten toward the rim.
pub(crate) fn facet_table(is_quarter: bool, count: usize, normals: usize) -> taps::FacetTable {
    use taps::FacetTable;
    let (side, first) = if is_quarter { (FacetTable::QUARTER, 0.0) } else { (FacetTable::WHOLE, -1.0) };
    let node = |index: usize| {
        let place = |step: usize| first + (1.0 - first) * step as f64 / (side - 1) as f64;
        let (x, y) = (place(index % side), place(index / side));
        let u = (x * x + y * y).min(1.0);
        // A mirror along an axis changes the sign of the slope along it.
        let tilt = if is_quarter { [0.5 * x, 0.3 * y] } else { [0.2 + 0.3 * x, 0.4 * x * y - 0.1] };
        let weight = |k: usize| [0.2 + 0.5 * u, 0.3, 0.1 * (k + 1) as f64];
        let tap = |k: usize| taps::FacetTap {
            slope: tilt.map(|slope| slope * (1.0 - 0.4 * k as f64)),
            std: 0.02 * 5_f64.powi(k as i32) * (1.0 + u),
            weight: weight(k),
        };
        let normal = |k: usize| taps::NormalTap { y: (0.8 * u + 0.5 * k as f64).min(1.0), weight: weight(k) };
        taps::FacetNode { taps: (0..count).map(tap).collect(), normals: (0..normals).map(normal).collect() }
    };
    FacetTable::new((0..side * side).map(node).collect()).unwrap()
}
