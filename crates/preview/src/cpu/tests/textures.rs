//! Textures of the base colour.

use brdf::{BaseColorTexture, Standard, StandardParameters, TexturePlacement, Wrap};

use super::*;

fn standard(parameters: StandardParameters) -> Material {
    Material::Standard(Standard::new(parameters).unwrap())
}

/// A dielectric with the base colour of a code.
fn dielectric(code: u8) -> StandardParameters {
    let base_color = [f64::from(envmap::srgb_decode(f32::from(code) / 255.0)); 3];
    StandardParameters { base_color, roughness: 0.4, ..StandardParameters::default() }
}

fn texture(size: [usize; 2], texels: &[[u8; 3]], placement: TexturePlacement) -> Arc<BaseColorTexture> {
    Arc::new(BaseColorTexture::new(size, texels.to_vec(), placement).unwrap())
}

/// The look of a material with a texture, with maps of degrees (6, 4).
fn textured(light: &Arc<Light>, material: &Material, texture: &Arc<BaseColorTexture>) -> Arc<Look> {
    let look = Arc::into_inner(look(light, material, [6, 4])).unwrap();
    Arc::new(look.with_base_color(Some(Arc::clone(texture))))
}

fn plane() -> Arc<Mesh> {
    Arc::new(mesh::shape("plane").unwrap())
}

fn from_above(size: [u32; 2], mode: Mode) -> Shot {
    let shot = shot(size, Show::One(mode));
    Shot { camera: Camera { pitch: 0.9, ..shot.camera }, light_samples: 64, ..shot }
}

/// The plane with other coordinates.
fn plane_with(coordinates: impl Fn([f32; 2]) -> [f32; 2]) -> Arc<Mesh> {
    let plane = plane();
    let coordinates = plane.coordinates().unwrap().iter().map(|at| coordinates(*at)).collect();
    let [positions, normals] = [plane.positions(), plane.normals()].map(<[_]>::to_vec);
    let made = Mesh::new(
        positions,
        normals,
        plane.tangents().to_vec(),
        Some(coordinates),
        plane.triangles().to_vec(),
    );
    Arc::new(made.unwrap())
}

const CODES: [u8; 4] = [40, 120, 180, 250];

/// The oracle is the plane in a material of the texel's own colour. Under a light of degree 2 a dielectric is
/// exact but for the noise of brute force and the little light that layers above the matte base keep from it
/// at grazing angles, and a metal but for the Fresnel edge: the reflectance of the light that the highlight
/// sees is taken to be that of a uniform light.
#[test]
fn every_quadrant_looks_as_a_material_of_its_colour() {
    let light = light(32, |w| [1.0 + 0.5 * w.z * w.x, 2.0 + w.y, 1.5 + w.z * w.z]);
    let checker = TexturePlacement { is_nearest: true, ..TexturePlacement::default() };
    let texels = CODES.map(|code| [code; 3]);
    let texture = texture([2, 2], &texels, checker);
    for (metallic, roughness, allowed) in [(0.0, 0.4, 0.01), (1.0, 0.5, 0.02), (0.5, 1.0, 0.02)] {
        let of = |code| StandardParameters { metallic, roughness, ..dielectric(code) };
        for mode in [Mode::BruteForce, Mode::LocalShrm] {
            let shot = from_above([60, 60], mode);
            let scene = Scene::of(plane(), textured(&light, &standard(of(140)), &texture));
            let found = render(&scene, &shot);
            let hits = seen(&scene, &shot);
            for (quadrant, code) in CODES.into_iter().enumerate() {
                let own = Scene::of(plane(), look(&light, &standard(of(code)), [6, 4]));
                let expected = render(&own, &shot);
                let (mut sums, mut count) = ([0.0; 2], 0);
                for (pixel, hit) in hits.iter().enumerate() {
                    let Some(spot) = hit.and_then(|hit| hit.spot) else { continue };
                    if usize::from(spot.at.x >= 0.5) + 2 * usize::from(spot.at.y >= 0.5) == quadrant {
                        sums[0] += f64::from(found.radiance[pixel][1]);
                        sums[1] += f64::from(expected.radiance[pixel][1]);
                        count += 1;
                    }
                }
                assert!(count > 100, "{count}");
                let error = (sums[0] - sums[1]).abs() / f64::from(count);
                assert!(error < allowed * 2.0, "{metallic} {mode:?} {code}: {sums:?} {count}");
            }
        }
    }
}

/// A texture of the material's own colour changes no bit.
#[test]
fn a_texture_of_the_mean_changes_nothing() {
    let light = light(16, uneven);
    let material = standard(StandardParameters { clearcoat: 0.5, metallic: 0.3, ..dielectric(100) });
    let texture = texture([8, 5], &[[100; 3]; 40], TexturePlacement::default());
    let (table, _) = brdf::tabulate(&material, Degree::new(6).unwrap(), 16, Stop::NEVER).unwrap();
    let table = Arc::new(table);
    let with = |base_color| {
        let look = Arc::into_inner(look(&light, &material, [6, 2])).unwrap();
        let look = look.with_table(Some(Arc::clone(&table))).with_base_color(base_color);
        Scene::of(sphere(), Arc::new(look))
    };
    let (plain, textured) = (with(None), with(Some(texture)));
    for mode in Mode::ALL.into_iter().filter(|mode| plain.offers(*mode)) {
        let shot = Shot { samples: 2, ..shot([24, 24], Show::One(mode)) };
        assert_eq!(render(&textured, &shot), render(&plain, &shot), "{mode:?}");
    }
}

/// The modes that show no material do not change, and a difference compares the textured pictures.
#[test]
fn only_modes_that_show_the_material_show_its_texture() {
    let light = light(16, uneven);
    let material = standard(dielectric(140));
    let texture = texture([2, 2], &CODES.map(|code| [code; 3]), TexturePlacement::default());
    let textured = Scene::of(sphere(), textured(&light, &material, &texture));
    let plain = Scene::of(sphere(), look(&light, &material, [6, 4]));
    for mode in Mode::ALL.into_iter().filter(|mode| plain.offers(*mode)) {
        let shot = shot([24, 24], Show::One(mode));
        let is_same = render(&textured, &shot) == render(&plain, &shot);
        assert_eq!(is_same, matches!(mode, Mode::Irradiance | Mode::Mirror | Mode::Samples), "{mode:?}");
    }
    let show = Show::Difference { of: Mode::LocalShrm, from: Mode::LocalShrm, amplify: 1.0 };
    assert_eq!(render(&textured, &shot([24, 24], show)).relative_rms, Some(0.0));
}

/// Black and white texels far below the size of a pixel show their mean, which is code 188, up to half of a
/// code, while the nearest texels alone would be black or white.
#[test]
fn a_far_texture_shows_its_mean() {
    let light = light(8, |_| [1.0; 3]);
    let material = StandardParameters { specular: 0.0, base_color: [0.5; 3], ..dielectric(0) };
    let texels: Vec<[u8; 3]> = (0..128 * 128).map(|k| [255 * ((k + k / 128) % 2) as u8; 3]).collect();
    for is_nearest in [false, true] {
        let placement = TexturePlacement {
            transform: [[16.0, 0.0, 0.0], [0.0, 16.0, 0.0]],
            is_nearest,
            ..TexturePlacement::default()
        };
        let texture = texture([128, 128], &texels, placement);
        let scene = Scene::of(plane(), textured(&light, &standard(material), &texture));
        let picture = render(&scene, &from_above([40, 40], Mode::LocalShrm));
        let expected = envmap::srgb_decode(188.0 / 255.0);
        let covered: Vec<_> = picture.radiance.iter().filter(|pixel| pixel[3] == 1.0).collect();
        assert!(covered.len() > 200);
        for pixel in covered {
            assert!((pixel[1] - expected).abs() < 0.002, "{pixel:?} {expected}");
        }
    }
}

/// The steps are the differences to the neighbours, up to the curvature of perspective: the plane is seen
/// under 0.9, from 3.7 radii away, so that the step changes by less than 2 percent from pixel to pixel.
#[test]
fn steps_lead_to_the_coordinates_of_the_neighbours() {
    let light = light(8, |_| [1.0; 3]);
    let texture = texture([1, 1], &[[9; 3]], TexturePlacement::default());
    let scene = Scene::of(plane(), textured(&light, &standard(dielectric(9)), &texture));
    let shot = from_above([60, 50], Mode::LocalShrm);
    let hits = seen(&scene, &shot);
    let spot = |pixel: usize| hits.get(pixel).copied().flatten().and_then(|hit| hit.spot);
    let mut count = 0;
    for pixel in 0..hits.len() {
        let (Some(here), Some(right), Some(below)) = (spot(pixel), spot(pixel + 1), spot(pixel + 60)) else {
            continue;
        };
        if pixel % 60 == 59 {
            continue;
        }
        for (step, next) in [(here.across, right.at), (here.down, below.at)] {
            let error = (next - here.at - step).length();
            assert!(error < 0.02 * step.length() + 1e-5, "{here:?} {next}");
        }
        count += 1;
    }
    assert!(count > 500, "{count}");
}

/// The mesh's place (x, y) is (2 u - 1, 1 - 2 v), wherever perspective and clipping put it.
#[test]
fn coordinates_are_those_of_the_place_also_of_clipped_triangles() {
    let light = light(8, |_| [1.0; 3]);
    let texture = texture([1, 1], &[[9; 3]], TexturePlacement::default());
    let scene = Scene::of(plane(), textured(&light, &standard(dielectric(9)), &texture));
    // From 0.08 above the plane, which reaches behind the eye.
    for radius in [1.0, 0.02] {
        let still = from_above([40, 40], Mode::LocalShrm);
        let framing = Framing::ball(DVec3::ZERO, radius);
        let camera = Camera { framing, pitch: 0.3, ..still.camera };
        let hits = seen(&scene, &Shot { camera, ..still });
        let mut count = 0;
        for hit in hits.iter().flatten() {
            let spot = hit.spot.unwrap();
            let at = [2.0 * spot.at.x - 1.0, 1.0 - 2.0 * spot.at.y];
            assert!((at[0] - hit.position.x).abs() + (at[1] - hit.position.y).abs() < 1e-4, "{hit:?}");
            count += 1;
        }
        assert!(count > 100, "{count}");
    }
}

/// A mesh holds no NaN, but numbers of any size.
#[test]
fn bad_coordinates_and_none_make_no_bad_picture() {
    let light = light(8, |_| [1.0; 3]);
    let placement = TexturePlacement { wrap: [Wrap::Mirror, Wrap::Clamp], ..TexturePlacement::default() };
    let texture = texture([3, 2], &[[7; 3], [90; 3], [250; 3], [0; 3], [255; 3], [30; 3]], placement);
    let look = textured(&light, &standard(dielectric(140)), &texture);
    let shot = from_above([30, 30], Mode::LocalShrm);
    let mut meshes: Vec<Arc<Mesh>> = [f32::MAX, f32::MIN, -3e9, 1e-40]
        .map(|bad| plane_with(|[u, v]| [u * bad, if v > 0.5 { bad } else { v }]))
        .into();
    meshes.push(plane_with(|_| [0.25; 2]));
    for mesh in meshes {
        let picture = render(&Scene::of(mesh, Arc::clone(&look)), &shot);
        assert!(picture.radiance.as_flattened().iter().all(|value| value.is_finite()));
    }
    let plane = plane();
    let [positions, normals] = [plane.positions(), plane.normals()].map(<[_]>::to_vec);
    let bare = Mesh::new(positions, normals, plane.tangents().to_vec(), None, plane.triangles().to_vec());
    let bare = Arc::new(bare.unwrap());
    let plain = super::look(&light, &standard(dielectric(140)), [6, 4]);
    assert_eq!(render(&Scene::of(bare, look), &shot), render(&Scene::of(plane, plain), &shot));
}

/// One of two parts has a texture: the other stays as it is.
#[test]
fn each_object_has_its_own_texture() {
    let light = light(16, uneven);
    let material = standard(dielectric(140));
    let texture = texture([2, 2], &CODES.map(|code| [code; 3]), TexturePlacement::default());
    let looks = [textured(&light, &material, &texture), look(&light, &material, [6, 4])];
    let place = |y: f64| {
        let shift = DVec3::new(0.0, y, 0.0);
        DAffine3::from_scale_rotation_translation(DVec3::splat(0.5), glam::DQuat::IDENTITY, shift)
    };
    let objects = |chosen: [usize; 2]| {
        let object = |k: usize| placed(&sphere(), place([-0.6, 0.6][k]), &looks[chosen[k]]);
        Scene { light: Arc::clone(&light), objects: vec![object(0), object(1)] }
    };
    let still = shot([60, 40], Show::One(Mode::LocalShrm));
    let shot = Shot { camera: Camera { yaw: 0.0, ..still.camera }, ..still };
    let [mixed, both, none] = [[0, 1], [0, 0], [1, 1]].map(|chosen| render(&objects(chosen), &shot));
    let numbers: Vec<_> = seen(&objects([0, 1]), &shot).iter().map(|hit| hit.map(|hit| hit.object)).collect();
    for (pixel, number) in numbers.iter().enumerate() {
        let expected = if *number == Some(0) { &both } else { &none };
        assert_eq!(mixed.radiance[pixel], expected.radiance[pixel]);
    }
    assert!(mixed != both && mixed != none);
}
