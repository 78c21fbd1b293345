//! Maps of components against the integral by brute force, with the look-ups of a renderer.

#![allow(clippy::unwrap_used)] // a test may panic

use brdf::{Choice, Fresnel, Ggx, Lambert, Material, Microfacet, project};
use envmap::Environment;
use sh::{Degree, Lighting, Stop, Transform};
use shrm::components::{
    ComponentBasis, ComponentCount, ComponentMap, ComponentOptions, PackedComponents, face_frame, fit,
    fit_counts,
};
use shrm::reference::{Cull, Reference};
use shrm::{Lamps, Reflection, frame, stops};
use sphere::{Cube, DVec3, Direction, LatLong};

fn copper(roughness: f64) -> Material {
    let metal = Fresnel::Conductor { n: [0.2, 0.92, 1.1], k: [3.91, 2.45, 2.14] };
    Material::Ggx(Ggx::new(roughness, metal, [1.0; 3]).unwrap())
}

fn gauss(sigma: f64) -> Material {
    Material::Microfacet(Microfacet::new(sigma, [1.0; 3]).unwrap())
}

/// A scene: the light without its lamps as an image that sums go over, and the whole light.
struct Scene {
    soft: Environment,
    lighting: Lighting,
}

impl Scene {
    fn new(environment: &Environment, rows: usize) -> Self {
        let separated = environment.separate_lamps(Stop::NEVER).unwrap();
        let transform = Transform::new(environment.grid(), Degree::new(120).unwrap()).unwrap();
        let series = transform.analyse(separated.soft.pixels());
        let soft = separated.soft.downsampled(LatLong::with_rows(rows)).unwrap();
        Self { soft, lighting: Lighting { series, lights: separated.lights } }
    }

    /// A sky over grass with a window, a wall and two lamps.
    fn procedural() -> Self {
        let grid = LatLong::with_rows(256);
        let radiance = |w: DVec3| {
            let sky = if w.z > 0.0 { [0.3, 0.5, 0.9].map(|x| x * (0.4 + w.z)) } else { [0.10, 0.12, 0.04] };
            let window = if w.x > 0.8 && w.y.abs() < 0.3 && w.z.abs() < 0.35 { 6.0 } else { 0.0 };
            let wall = if w.y < -0.7 { 0.05 } else { 1.0 };
            let near = |x: f64, y: f64, z: f64, cosine: f64| w.dot(DVec3::new(x, y, z).normalize()) > cosine;
            let lamps = if near(-1.0, 0.5, 1.0, 0.9993) { 900.0 } else { 0.0 }
                + if near(0.2, 1.0, 0.4, 0.998) { 120.0 } else { 0.0 };
            sky.map(|sky| wall * sky + window + lamps)
        };
        let looks = |i: usize| grid.direction(i / grid.width, i % grid.width).vector();
        let pixels = (0..grid.len()).map(|i| radiance(looks(i)).map(|value| value as f32)).collect();
        Self::new(&Environment::new(grid, pixels).unwrap(), 128)
    }

    fn field(&self, material: &Material) -> Reflection {
        let coefficients = project(material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        Reflection::for_light(&self.lighting, &coefficients, material, Stop::NEVER).unwrap().0
    }

    /// Random central directions and views as a ball shows them, with what the lamps and all light reflect.
    fn pairs(&self, material: &Material, count: usize) -> Vec<Pair> {
        let reference = Reference::at_centres(&self.soft, material, Cull::None);
        let lamps = Lamps { lights: self.lighting.lights.clone(), material: material.clone() };
        let lamps = lamps.for_views();
        let mut state = 17_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let turn = std::f64::consts::TAU;
        let pair = |_| {
            let central = Direction::from_angles((1.0 - 2.0 * next()).acos(), turn * next());
            let normal = frame(central).apply(Direction::from_angles(next().sqrt().asin(), turn * next()));
            let mirrored = normal.vector() * (2.0 * normal.dot(central)) - central.vector();
            let view = Direction::normalised(mirrored);
            let lit = lamps.radiance(central, view);
            let soft = reference.radiance(central, view);
            Pair { central, view, lit, truth: std::array::from_fn(|channel| soft[channel] + lit[channel]) }
        };
        (0..count).map(pair).collect()
    }

    /// p95 and p99 of the errors, in stops.
    fn error(&self, pairs: &[Pair], found: impl Fn(&Pair) -> [f64; 3]) -> [f64; 2] {
        let dark = stops::BLACK_SHARE * self.lighting.mean();
        let of_pair = |pair: &Pair| {
            let found = found(pair);
            let of_channel = |channel: usize| stops::error(found[channel], pair.truth[channel], dark);
            [of_channel(0), of_channel(1), of_channel(2)]
        };
        stops::quantiles(&mut pairs.iter().flat_map(of_pair).collect::<Vec<_>>())
    }
}

struct Pair {
    central: Direction,
    view: Direction,
    lit: [f64; 3],
    truth: [f64; 3],
}

impl Pair {
    /// A look-up of the map with the lamps beside it.
    fn beside(&self, map: &ComponentMap) -> [f64; 3] {
        let soft = map.radiance(self.central, self.view);
        std::array::from_fn(|channel| soft[channel] + self.lit[channel])
    }

    /// The place of the normal on the disc.
    fn disc(&self) -> [f64; 2] {
        let (face, ..) = Cube { edge: 1 }.position(self.central);
        let normal = (self.central.vector() + self.view.vector()).normalize();
        let local = face_frame(face, self.central).transpose() * normal;
        let scale = (1.0 + local.z).sqrt().recip();
        [local.x * scale, local.y * scale]
    }
}

fn options(edge: usize, count: usize) -> ComponentOptions {
    ComponentOptions { edge, count: ComponentCount::Fixed(count), half: false, bake: false }
}

fn is_within(found: [f64; 2], limits: [f64; 2]) -> bool {
    found[0] <= limits[0] && found[1] <= limits[1]
}

/// Prints a figure: `cargo test -p shrm --test components -- --nocapture` shows them.
fn show(what: &str, error: [f64; 2]) {
    println!("{what}: {:.3}/{:.3}", error[0], error[1]);
}

#[test]
fn look_ups_are_near_brute_force_and_more_components_are_nearer() {
    let scene = Scene::procedural();
    for (material, limits) in [
        (copper(0.3), [(9, [0.15, 0.52]), (24, [0.08, 0.29])]),
        (gauss(0.2), [(10, [0.27, 0.63]), (24, [0.07, 0.23])]),
    ] {
        let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
        let pairs = scene.pairs(&material, 800);
        for (count, limits) in limits {
            let fitted = fit(&field, &basis, options(32, count), Stop::NEVER).unwrap();
            let error = scene.error(&pairs, |pair| pair.beside(&fitted.map));
            show(&format!("{} K = {count}", material.name()), error);
            assert!(is_within(error, limits), "{} {count}: {error:?}", material.name());
            // Its own measure, which samples other pairs, agrees.
            let own = fitted.error;
            assert!((own[0] / error[0] - 1.0).abs() < 0.25, "{} {count}: {own:?} {error:?}", material.name());
        }
    }
}

#[test]
fn one_fit_serves_every_number_of_components() {
    let (scene, material) = (Scene::procedural(), gauss(0.3));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let maps = fit_counts(&field, &basis, 6, &[3, 9, 99], Stop::NEVER).unwrap();
    for (map, count) in maps.iter().zip([3, 9, basis.components().len()]) {
        assert_eq!(map, &fit(&field, &basis, options(6, count), Stop::NEVER).unwrap().map);
    }
}

#[test]
fn half_resolution_and_eight_bits_lose_little() {
    let (scene, material) = (Scene::procedural(), copper(0.3));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let pairs = scene.pairs(&material, 800);
    let whole = fit(&field, &basis, options(32, 9), Stop::NEVER).unwrap();
    let halved = fit(&field, &basis, ComponentOptions { half: true, ..options(32, 9) }, Stop::NEVER).unwrap();
    assert_eq!((halved.map.edge(3), halved.map.edge(4), halved.map.values(4).len()), (32, 16, 6 * 18 * 18));
    let [full, half] = [&whole, &halved].map(|fitted| scene.error(&pairs, |pair| pair.beside(&fitted.map)));
    show("full", full);
    show("half", half);
    assert!(half[0] < full[0] + 0.01 && half[1] < full[1] + 0.03, "{full:?} {half:?}");
    for fitted in [&whole, &halved] {
        let packed = PackedComponents::of(&fitted.map);
        let bits = scene.error(&pairs, |pair| {
            let (face, s, t) = Cube { edge: 1 }.position(pair.central);
            let soft = packed.at(face, [s, t], &fitted.map.basis().at(pair.disc()));
            std::array::from_fn(|channel| soft[channel] + pair.lit[channel])
        });
        show("8 bits", bits);
        let full = scene.error(&pairs, |pair| pair.beside(&fitted.map));
        assert!(bits[0] < full[0] + 0.005 && bits[1] < full[1] + 0.02, "{full:?} {bits:?}");
    }
}

#[test]
fn the_least_number_that_meets_the_tolerance_is_taken() {
    let (scene, material) = (Scene::procedural(), gauss(0.3));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let accept = ComponentOptions { count: ComponentCount::Accept([0.15, 0.4]), ..options(16, 0) };
    let fitted = fit(&field, &basis, accept, Stop::NEVER).unwrap();
    let count = fitted.map.basis().components().len();
    assert!(is_within(fitted.error, [0.16, 0.42]), "{:?}", fitted.error);
    for (fewer, error) in fitted.by_count.iter().filter(|(other, _)| *other < count) {
        assert!(!is_within(*error, [0.15, 0.4]), "{fewer} would do, not {count}");
    }
    let none = ComponentOptions { count: ComponentCount::Accept([0.0, 0.0]), ..accept };
    assert_eq!(fit(&field, &basis, none, Stop::NEVER).unwrap().map.basis(), &basis);
}

#[test]
fn baked_lamps_are_in_the_map() {
    let (scene, material) = (Scene::procedural(), gauss(0.4));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let pairs = scene.pairs(&material, 400);
    let fitted =
        fit(&field, &basis, ComponentOptions { bake: true, ..options(16, 24) }, Stop::NEVER).unwrap();
    let error = scene.error(&pairs, |pair| fitted.map.radiance(pair.central, pair.view));
    show("baked", error);
    assert!(is_within(error, [0.28, 0.62]), "{error:?}");
    let without = fit(&field, &basis, options(16, 24), Stop::NEVER).unwrap();
    let error = scene.error(&pairs, |pair| without.map.radiance(pair.central, pair.view));
    assert!(error[0] > 1.0, "the lamps are missing there: {error:?}");
}

/// The look-up of the manual of `export-shrm`, in cube coordinates, from textures alone.
struct Shader {
    count: usize,
    side: usize,
    /// A layer for each face of each component.
    map: Vec<[f32; 3]>,
    weights: Vec<f32>,
}

/// Texels along the edge of the textures of weights.
const WEIGHTS: usize = 64;

impl Shader {
    fn new(map: &ComponentMap) -> Self {
        let count = map.basis().components().len();
        let texels = (0..count).flat_map(|k| map.values(k).iter().copied()).collect();
        Self { count, side: map.edge(0) + 2, map: texels, weights: map.basis().textures(WEIGHTS) }
    }

    fn reflected(&self, n: DVec3, v: DVec3) -> [f64; 3] {
        let r = n * (2.0 * n.dot(v)) - v;
        let (c, d) = (DVec3::new(-r.y, r.z, r.x), DVec3::new(-n.y, n.z, n.x));
        let (m, sign) = (c.abs(), |x: f64| if x > 0.0 { 1.0 } else { -1.0 });
        let (face, a, s, t) = if m.x >= m.y && m.x >= m.z {
            let a = DVec3::X * sign(c.x);
            (if c.x > 0.0 { 0 } else { 1 }, a, DVec3::new(0.0, 0.0, -a.x), DVec3::new(0.0, -1.0, 0.0))
        } else if m.y >= m.z {
            let a = DVec3::Y * sign(c.y);
            (if c.y > 0.0 { 2 } else { 3 }, a, DVec3::X, DVec3::new(0.0, 0.0, a.y))
        } else {
            let a = DVec3::Z * sign(c.z);
            (if c.z > 0.0 { 4 } else { 5 }, a, DVec3::new(a.z, 0.0, 0.0), DVec3::new(0.0, -1.0, 0.0))
        };
        let (near, up) = (c.dot(a), d.dot(c).max(0.0));
        let turn = (d.dot(a) + up) / (1.0 + near);
        let scale = (1.0 + up).sqrt().recip();
        let place = [(d.dot(s) - c.dot(s) * turn) * scale, (d.dot(t) - c.dot(t) * turn) * scale];
        let side = self.side as f64;
        let uv = [s, t].map(|axis| ((c.dot(axis) / near * 0.5 + 0.5) * (side - 2.0) + 1.0) / side);
        let mut sum = [0.0; 3];
        for k in 0..self.count {
            let layer = &self.weights[k * WEIGHTS * WEIGHTS..][..WEIGHTS * WEIGHTS];
            let at = place.map(|x| x * 0.5 + 0.5);
            let w: f64 = bilinear(WEIGHTS, at).map(|(index, share)| share * f64::from(layer[index])).sum();
            let layer = &self.map[(6 * k + face) * self.side * self.side..];
            for (index, share) in bilinear(self.side, uv) {
                (0..3).for_each(|channel| sum[channel] += w * share * f64::from(layer[index][channel]));
            }
        }
        sum.map(|value| value.max(0.0))
    }
}

/// The texels of a square texture about (u, v) and their shares, clamped at the edges.
fn bilinear(size: usize, uv: [f64; 2]) -> impl Iterator<Item = (usize, f64)> {
    let [x, y] = uv.map(|u| (u * size as f64 - 0.5).clamp(0.0, size as f64 - 1.0));
    let (column, row) = ((x as usize).min(size - 2), (y as usize).min(size - 2));
    let (x, y) = (x - column as f64, y - row as f64);
    let first = row * size + column;
    [(first, (1.0 - x) * (1.0 - y)), (first + 1, x * (1.0 - y))]
        .into_iter()
        .chain([(first + size, (1.0 - x) * y), (first + size + 1, x * y)])
}

#[test]
fn the_shader_of_the_manual_sees_what_the_map_holds() {
    let (scene, material) = (Scene::procedural(), copper(0.3));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let map = fit(&field, &basis, options(32, 15), Stop::NEVER).unwrap().map;
    let (shader, pairs) = (Shader::new(&map), scene.pairs(&material, 800));
    let from_textures = |pair: &Pair| {
        let normal = (pair.central.vector() + pair.view.vector()).normalize();
        let soft = shader.reflected(normal, pair.view.vector());
        std::array::from_fn(|channel| soft[channel] + pair.lit[channel])
    };
    let [exact, textures] =
        [scene.error(&pairs, |pair| pair.beside(&map)), scene.error(&pairs, from_textures)];
    show("the map", exact);
    show("its textures", textures);
    // What 64 texels of w_k, filtered linearly, lose.
    assert!(textures[0] < exact[0] + 0.01 && textures[1] < exact[1] + 0.03, "{exact:?} {textures:?}");
}

/// Faces meet: the frames differ, what is seen does not.
#[test]
fn no_edge_of_a_face_shows() {
    let (scene, material) = (Scene::procedural(), copper(0.5));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let map = fit(&field, &basis, options(24, 13), Stop::NEVER).unwrap().map;
    let mut most: f64 = 0.0;
    for step in 0..60 {
        let along = f64::from(step) / 30.0 - 1.0;
        for edge in [DVec3::new(1.0, 1.0, along), DVec3::new(1.0, along, -1.0), DVec3::new(-1.0, along, -1.0)]
        {
            let [a, b] =
                [1.0 - 1e-9, 1.0 + 1e-9].map(|x| Direction::normalised(edge * DVec3::new(x, 1.0, 1.0)));
            let [face, other] = [a, b].map(|c| Cube { edge: 1 }.position(c).0);
            assert!(face != other || along.abs() == 1.0);
            for view in 0..8 {
                let angle = 0.15 * f64::from(view);
                let normal = frame(a).apply(Direction::from_angles(angle, f64::from(view)));
                let view = |c: Direction| {
                    Direction::normalised(normal.vector() * (2.0 * normal.dot(c)) - c.vector())
                };
                let [x, y] = [a, b].map(|c| map.radiance(c, view(c)));
                for channel in 0..3 {
                    most = most.max(stops::error(x[channel], y[channel], 0.01 * scene.lighting.mean()));
                }
            }
        }
    }
    println!("edges: {most:.4}");
    assert!(most < 0.02, "{most}");
}

#[test]
fn a_matte_surface_is_looked_up_by_its_normal() {
    let (scene, material) = (Scene::procedural(), Material::Lambert(Lambert::new([0.8, 0.5, 0.2]).unwrap()));
    let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
    let map = fit(&field, &basis, options(16, 1), Stop::NEVER).unwrap().map;
    let reference = Reference::at_centres(&scene.soft, &material, Cull::None);
    let normal = Direction::from_angles(1.1, 0.7);
    let truth = reference.radiance(normal, Direction::Z);
    for view in [normal, Direction::Z, Direction::X] {
        let found = map.radiance(normal, view);
        assert!((0..3).all(|c| (found[c] / truth[c] - 1.0).abs() < 0.01), "{found:?} {truth:?}");
    }
}

#[test]
fn a_black_surface_has_a_component() {
    let black = Material::Lambert(Lambert::new([0.0; 3]).unwrap());
    let field = Scene::procedural().field(&black);
    for count in [ComponentCount::Fixed(8), ComponentCount::Accept([0.15, 0.4])] {
        let options = ComponentOptions { edge: 4, count, half: false, bake: false };
        let fitted = fit(&field, &ComponentBasis::of(&black).unwrap(), options, Stop::NEVER).unwrap();
        assert!(!fitted.map.basis().components().is_empty());
        assert_eq!(fitted.map.radiance(Direction::X, Direction::X), [0.0; 3]);
    }
}

#[test]
fn a_fibre_has_no_components() {
    let material = Material::KajiyaKay(brdf::KajiyaKay::new(8.0, [0.5; 3]).unwrap());
    let field = Scene::procedural().field(&material);
    let basis = ComponentBasis::of(&copper(0.5)).unwrap();
    let error = fit(&field, &basis, options(8, 4), Stop::NEVER).unwrap_err().to_string();
    assert!(error.contains("about the tangent"), "{error}");
    let unknown = Reflection::convolve(field.lighting(), field.brdf());
    let error = fit(&unknown, &basis, options(8, 4), Stop::NEVER).unwrap_err().to_string();
    assert!(error.contains("material"), "{error}");
}

/// The studio, the sunrise and the forest of the corpus, 1024 x 512 pixels in Radiance's format.
#[test]
fn photographs_are_near_brute_force() {
    let name = "photographs_are_near_brute_force";
    let Some(corpus) = test_data::folder(name, "SPECULA_CORPUS") else { return };
    for (photograph, material, count, limits) in [
        ("studio", copper(0.3), 9, [0.235, 0.50]),
        ("studio", copper(0.3), 24, [0.105, 0.19]),
        ("studio", gauss(0.2), 24, [0.08, 0.18]),
        ("sunrise", copper(0.3), 9, [0.065, 0.18]),
        ("forest", copper(0.3), 9, [0.115, 0.31]),
        ("forest", gauss(0.2), 24, [0.065, 0.13]),
    ] {
        let pixels =
            radiance_pixels(&std::fs::read(corpus.join(format!("env/cc0/{photograph}.hdr"))).unwrap());
        let environment = Environment::new(LatLong::with_rows(512), pixels).unwrap();
        let scene = Scene::new(&environment, 128);
        let (field, basis) = (scene.field(&material), ComponentBasis::of(&material).unwrap());
        let fitted = fit(&field, &basis, options(32, count), Stop::NEVER).unwrap();
        let pairs = scene.pairs(&material, 700);
        let error = scene.error(&pairs, |pair| pair.beside(&fitted.map));
        show(&format!("{photograph} {} K = {count}", material.name()), error);
        assert!(is_within(error, limits), "{photograph} {count}: {error:?}");
    }
}

/// Reads run-length coded RGBE, as the corpus has it: enough of the format for these files.
fn radiance_pixels(bytes: &[u8]) -> Vec<[f32; 3]> {
    let start = bytes.windows(4).position(|four| four == b"\n-Y ").unwrap() + 1;
    let end = start + bytes[start..].iter().position(|byte| *byte == b'\n').unwrap();
    let size: Vec<&str> = std::str::from_utf8(&bytes[start..end]).unwrap().split(' ').collect();
    let (height, width): (usize, usize) = (size[1].parse().unwrap(), size[3].parse().unwrap());
    let mut rest = bytes[end + 1..].iter().copied();
    let mut pixels = Vec::with_capacity(width * height);
    for _ in 0..height {
        assert_eq!([0; 4].map(|_| rest.next().unwrap())[..2], [2, 2]);
        let planes = [0; 4].map(|_| {
            let mut plane = Vec::with_capacity(width);
            while plane.len() < width {
                match rest.next().unwrap() {
                    run @ 129.. => plane.extend([rest.next().unwrap()].repeat(usize::from(run) - 128)),
                    count => plane.extend(rest.by_ref().take(usize::from(count))),
                }
            }
            plane
        });
        let scale = |column: usize| 2f32.powi(i32::from(planes[3][column]) - 136);
        pixels
            .extend((0..width).map(|column| [0, 1, 2].map(|c| f32::from(planes[c][column]) * scale(column))));
    }
    pixels
}
