//! Lights and materials that need no files, and the looks of all pairs, made once.

use std::sync::{Arc, LazyLock};

use brdf::{
    BaseColorTexture, BrdfCoefficients, BrdfTable, Choice, Fresnel, Ggx, KajiyaKay, Lambert, Material, Phong,
    PoulinFournier, Standard, StandardParameters, TexturePlacement, Ward, Wrap, project, tabulate,
};
use envmap::Environment;
use mesh::Mesh;
use preview::{CompactMap, CompactTaps, Light, Look, MapSizes, PrefilteredCube};
use sh::{Degree, Expansion, Lighting, Stop, Transform};
use shrm::{Lamps, Reflection};
use sphere::{Cube, LatLong};
use taps::{ScaleSpace, Widths, fit, fit_facets};
use transfer::{Directions, Frames, LightField, Occluders, Transfer, TransferDegrees, precompute};

/// A look, and the names of its light and material.
pub(crate) type Named = (String, Arc<Look>);

const GRID: LatLong = LatLong::with_rows(48);
const F: usize = 12;
const P: usize = 5;
const SIZES: MapSizes = MapSizes { edge: 16, slices: 9 };

/// The looks of four materials under the first environment, then under the second, then under the third; and
/// under the second once more, with the lamps beside the lighting.
///
/// One material is centred on the normal, one on the tangent, and two on the reflection vector: one of them
/// is zonal, one has all terms.
pub(crate) fn looks() -> &'static [Named] {
    static LOOKS: LazyLock<Vec<Named>> = LazyLock::new(|| {
        let materials = materials();
        let degrees = Choice::Degree { f: degree(F), p: degree(P) };
        let pairs = materials.into_iter().map(|(name, material)| {
            let coefficients = project(&material, degrees, Stop::NEVER).unwrap().coefficients;
            (name, material, coefficients)
        });
        let pairs: Vec<_> = pairs.collect();
        let mut looks = Vec::new();
        for (light_name, environment) in environments() {
            let lighting = analysed(&environment);
            let light = Arc::new(Light::new(environment, Some(lighting.clone())));
            for (name, material, coefficients) in &pairs {
                let reflection = Reflection::convolve(&lighting, coefficients);
                let look = Look::new(Arc::clone(&light), reflection, Some(material.clone()), SIZES);
                looks.push((format!("{light_name} {name}"), Arc::new(look)));
            }
        }
        looks.extend(beside_lamps(&pairs));
        looks
    });
    &LOOKS
}

/// Brushed metal under each environment, of which there are no maps but a table, and hair with a table that
/// is mirrored at the horizon; both under an environment whose lamps they reflect by themselves;
/// and brushed metal under a light field.
pub(crate) fn tabulated() -> &'static [Named] {
    static LOOKS: LazyLock<Vec<Named>> = LazyLock::new(|| {
        let brushed = Material::Ward(Ward::new([0.2, 0.5], [0.9, 0.7, 0.4]).unwrap());
        let hair = Material::KajiyaKay(KajiyaKay::new(24.0, [0.9, 0.6, 0.3]).unwrap());
        let materials = [("brushed", brushed), ("hair", hair)].map(|(name, material)| {
            let (table, _) = tabulate(&material, degree(4), 32, Stop::NEVER).unwrap();
            (name, material, Arc::new(table))
        });
        let mut looks = Vec::new();
        for (light_name, environment) in environments() {
            let lighting = analysed(&environment);
            let light = Arc::new(Light::new(environment, Some(lighting)));
            let look = |(name, material, table): &(&str, Material, Arc<BrdfTable>)| {
                let look = Look::without_maps(Arc::clone(&light), material.clone(), SIZES);
                (format!("{light_name} {name}"), Arc::new(look.with_table(Some(Arc::clone(table)))))
            };
            looks.extend(materials.iter().map(look));
        }
        // Under the second environment once more, with its lamps beside the coefficients.
        let [_, (_, room), _] = environments();
        let lamps = room.separate_lamps(Stop::NEVER).unwrap().lights;
        let lighting = analysed(&room);
        let light = Arc::new(Light::new(room, Some(lighting)).with_lamps(lamps));
        let look = |(name, material, table): &(&str, Material, Arc<BrdfTable>)| {
            let look = Look::without_maps(Arc::clone(&light), material.clone(), SIZES);
            let look = look.with_table(Some(Arc::clone(table)));
            assert!(look.beside_table().is_some());
            (format!("lamps {name}"), Arc::new(look))
        };
        looks.extend(materials.iter().map(look));
        // Under light that differs from vertex to vertex.
        let lights = looks[..3].iter().map(|(_, look)| look.light().lighting().clone()).collect();
        let field =
            LightField::new(vec![[1.5, 0.2, 0.0], [-0.4, -1.0, 0.5], [0.0, 1.0, 1.0]], lights).unwrap();
        let near = Look::without_maps(Arc::clone(&light), materials[0].1.clone(), SIZES);
        let near = near.with_table(Some(Arc::clone(&materials[0].2)));
        looks.push(("near brushed".to_owned(), Arc::new(near.with_light_field(Some(Arc::new(field))))));
        // The last one blends both materials along two parameters.
        let [first, second] = materials.each_ref().map(|(_, _, table)| table.as_ref().clone());
        let light = Arc::clone(looks[0].1.light());
        let both = Look::without_maps(light, materials[0].1.clone(), SIZES);
        let tables = [first.clone(), second.clone(), second, first];
        let table = BrdfTable::joined(&tables).unwrap().with_grid([2, 2]).unwrap();
        looks.push(("both".to_owned(), Arc::new(both.with_table(Some(Arc::new(table))))));
        looks
    });
    &LOOKS
}

/// A dielectric, a metal and a mixture of both under coat and sheen, under each environment, each with a
/// texture in other ways; and at last a look without one.
pub(crate) fn textured() -> &'static [Named] {
    static LOOKS: LazyLock<Vec<Named>> = LazyLock::new(|| {
        let texel = |k: usize| {
            let (row, column) = (k / 40, k % 40);
            let tile = if (row / 6 + column / 8) % 2 == 0 { 60 } else { 200 };
            [tile, (6 * column) as u8, (9 * row) as u8]
        };
        let texels: Vec<_> = (0..40 * 27).map(texel).collect();
        let placements = [
            TexturePlacement::default(),
            TexturePlacement {
                factor: [1.0, 0.5, 0.8],
                transform: [[7.3, 2.0, 0.4], [-1.5, 6.1, -0.2]],
                wrap: [Wrap::Mirror, Wrap::Repeat],
                is_nearest: false,
            },
            TexturePlacement {
                transform: [[2.5, 0.0, -0.7], [0.0, 1.6, -0.3]],
                wrap: [Wrap::Clamp, Wrap::Mirror],
                is_nearest: true,
                ..TexturePlacement::default()
            },
        ];
        let plain = StandardParameters { base_color: [0.3, 0.2, 0.15], ..StandardParameters::default() };
        let materials = [
            ("dielectric", plain),
            ("metal", StandardParameters { metallic: 1.0, roughness: 0.4, ..plain }),
            ("coated", StandardParameters { metallic: 0.4, clearcoat: 0.6, sheen: [0.2, 0.1, 0.3], ..plain }),
        ];
        let mut looks = Vec::new();
        for (light_name, environment) in environments() {
            let lighting = analysed(&environment);
            let light = Arc::new(Light::new(environment, Some(lighting.clone())));
            for ((name, parameters), placement) in materials.into_iter().zip(placements) {
                let material = Material::Standard(Standard::new(parameters).unwrap());
                let degrees = Choice::Degree { f: degree(F), p: degree(P) };
                let coefficients = project(&material, degrees, Stop::NEVER).unwrap().coefficients;
                let reflection = Reflection::convolve(&lighting, &coefficients);
                let look = Look::new(Arc::clone(&light), reflection, Some(material), SIZES);
                let texture = BaseColorTexture::new([40, 27], texels.clone(), placement).unwrap();
                let look = look.with_base_color(Some(Arc::new(texture)));
                looks.push((format!("{light_name} {name}"), Arc::new(look)));
            }
        }
        looks.push(self::looks()[0].clone());
        looks
    });
    &LOOKS
}

/// Looks that have nothing but a compact map: of a matte, a glossy and a brushed material under each
/// environment, with its lamps beside the scale space, which all materials share.
pub(crate) fn compact() -> &'static [Named] {
    static LOOKS: LazyLock<Vec<Named>> = LazyLock::new(|| {
        let widths = Widths::new(32).unwrap();
        let materials =
            materials().into_iter().filter(|(name, _)| !["hair", "phong", "satin"].contains(name));
        let materials: Vec<_> = materials
            .map(|(name, material)| {
                let taps = if material.is_isotropic() {
                    CompactTaps::Angle(fit(&material, 3, widths, Stop::NEVER).unwrap().table)
                } else {
                    CompactTaps::View(fit_facets(&material, 3, widths, Stop::NEVER).unwrap().table)
                };
                (name, material, Arc::new(taps))
            })
            .collect();
        let mut looks = Vec::new();
        for (light_name, environment) in environments() {
            let lights = environment.separate_lamps(Stop::NEVER).unwrap().lights;
            let scales = Arc::new(ScaleSpace::new(&environment, &lights, widths, Stop::NEVER).unwrap());
            let light = Arc::new(Light::new(environment, None));
            for (name, material, taps) in &materials {
                let (scales, taps) = (Arc::clone(&scales), Arc::clone(taps));
                let map = CompactMap { scales, taps, material: material.clone() };
                let look = Look::without_maps(Arc::clone(&light), material.clone(), SIZES);
                let look = look.with_compact_map(Some(Arc::new(map)));
                looks.push((format!("{light_name} {name}"), Arc::new(look)));
            }
        }
        looks
    });
    &LOOKS
}

/// The name of what lights a row of balls, and their looks.
type NamedRow = (&'static str, Vec<Arc<Look>>);

/// White metals under each environment, with a cube of four levels: the first metal reads the first level,
/// the second one between two, with a sun and a lamp beside the cube, the last one past the end.
pub(crate) fn white_metals() -> &'static [NamedRow] {
    static LOOKS: LazyLock<Vec<NamedRow>> = LazyLock::new(|| {
        let metals = |(name, environment): (&'static str, Environment)| {
            let level = |edge| environment.cube_map(Cube { edge }).unwrap();
            let cube = Arc::new(PrefilteredCube::new([16, 8, 4, 2].map(level).into()).unwrap());
            let light = Arc::new(Light::new(environment, None));
            let look = |(roughness, level, suns): (f64, f64, &[sh::Light])| {
                let cube = Some((Arc::clone(&cube), level));
                let look = Look::of_white_metal(Arc::clone(&light), roughness, cube).unwrap();
                Arc::new(look.with_suns(suns.to_vec()))
            };
            let sun = |z, radius| sh::Light {
                direction: sphere::Direction::new(sphere::DVec3::new(1.0, 0.3, z)).unwrap(),
                radius,
                irradiance: [2.0, 1.5, 1.0],
            };
            let suns = [sun(0.6, 0.0), sun(0.1, 0.3)];
            (name, [(0.4, 0.0, &[][..]), (0.6, 1.3, &suns), (1.0, 7.0, &[])].map(look).into())
        };
        environments().into_iter().map(metals).collect()
    });
    &LOOKS
}

/// The transfer matrices of a mesh, with few directions.
pub(crate) fn transfer(mesh: &Mesh) -> Arc<Vec<Transfer>> {
    let directions = Directions::new(128, degree(6)).unwrap();
    let frames = Frames::of(mesh).unwrap();
    let degrees = TransferDegrees { output: degree(3), input: degree(3) };
    let made = precompute(&frames, &Occluders::of(mesh), &directions, degrees, Stop::NEVER);
    Arc::new(vec![made.unwrap().0])
}

/// A look without its material.
pub(crate) fn without_material() -> Arc<Look> {
    let (_, look) = &looks()[0];
    let reflection = look.reflection().unwrap().clone();
    Arc::new(Look::new(Arc::clone(look.light()), reflection, None, SIZES))
}

/// The looks of materials in the room, with its lamps beside the lighting.
fn beside_lamps(pairs: &[(&str, Material, BrdfCoefficients)]) -> Vec<Named> {
    let [_, (_, room), _] = environments();
    let separated = room.separate_lamps(Stop::NEVER).unwrap();
    let lighting = Lighting { series: analysed(&separated.soft), lights: separated.lights };
    assert!(lighting.lights.len() > 1, "{:?}", lighting.lights);
    let light = Arc::new(Light::new(room, Some(lighting.whole())));
    let look = |(name, material, coefficients): &(&str, Material, BrdfCoefficients)| {
        let (reflection, _) = Reflection::for_light(&lighting, coefficients, material, Stop::NEVER).unwrap();
        let look = Look::new(Arc::clone(&light), reflection, Some(material.clone()), SIZES);
        (format!("lamps {name}"), Arc::new(look))
    };
    pairs.iter().map(look).collect()
}

/// Lacquer under the second environment, with maps of its two parts, of degrees P that differ: alone, with
/// the lamps beside the maps, and with the lamps in them.
pub(crate) fn of_two_parts() -> [(&'static str, Arc<Look>); 3] {
    let [_, (_, room), _] = environments();
    let whole = Lighting { series: analysed(&room), lights: Vec::new() };
    let separated = room.separate_lamps(Stop::NEVER).unwrap();
    let apart = Lighting { series: analysed(&separated.soft), lights: separated.lights };
    let parameters = StandardParameters { base_color: [0.7, 0.1, 0.1], roughness: 0.4, ..Default::default() };
    let lacquer = Material::Standard(Standard::new(parameters).unwrap());
    let look = |lighting: &Lighting| {
        let reflected = |material: &Material, p: usize| {
            let degrees = Choice::Degree { f: degree(F), p: degree(p) };
            let coefficients = project(material, degrees, Stop::NEVER).unwrap().coefficients;
            let reflection = Reflection::convolve(&lighting.series, &coefficients);
            if lighting.lights.is_empty() {
                return reflection;
            }
            reflection.with_lamps(Lamps { lights: lighting.lights.clone(), material: material.clone() })
        };
        let [diffuse, specular] = lacquer.split().unwrap();
        let parts = [reflected(&diffuse, 1), reflected(&specular, P)];
        let reflection = reflected(&lacquer, P).with_parts(parts);
        let light = Arc::new(Light::new(room.clone(), Some(lighting.whole())));
        Look::new(light, reflection, Some(lacquer.clone()), SIZES)
    };
    let degrees = vec![[degree(2), degree(2)], [degree(3), degree(P)]];
    let baked = look(&apart).with_lamps_in_maps(true).with_degrees_in_view(Some(degrees));
    [("lacquer", look(&whole)), ("beside lamps", look(&apart)), ("with lamps", baked)]
        .map(|(name, look)| (name, Arc::new(look)))
}

/// The look of a material under an environment, both read from files.
pub(crate) fn look(environment: Environment, material: Material, f: usize, p: usize) -> Arc<Look> {
    let choice = Choice::Degree { f: degree(f), p: degree(p) };
    let coefficients = project(&material, choice, Stop::NEVER).unwrap().coefficients;
    let transform = Transform::new(environment.grid(), degree(f)).unwrap();
    let lighting = transform.analyse(environment.pixels());
    let reflection = Reflection::convolve(&lighting, &coefficients);
    let light = Arc::new(Light::new(environment, Some(lighting)));
    Arc::new(Look::new(light, reflection, Some(material), MapSizes { edge: 32, slices: 9 }))
}

fn degree(degree: usize) -> Degree {
    Degree::new(degree).unwrap()
}

fn analysed(environment: &Environment) -> Expansion {
    Transform::new(GRID, degree(F)).unwrap().analyse(environment.pixels())
}

fn materials() -> [(&'static str, Material); 6] {
    let gold = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    [
        ("chalk", Material::Lambert(Lambert::new([0.8, 0.7, 0.6]).unwrap())),
        ("hair", Material::KajiyaKay(KajiyaKay::new(24.0, [0.9, 0.6, 0.3]).unwrap())),
        ("phong", Material::Phong(Phong::new(20.0, [0.7, 0.8, 0.9]).unwrap())),
        ("gold", Material::Ggx(Ggx::new(0.5, gold, [1.0; 3]).unwrap())),
        ("brushed gold", Material::Ggx(Ggx::stretched([0.4, 0.8], gold, [1.0; 3]).unwrap())),
        ("satin", Material::PoulinFournier(PoulinFournier::new(20.0, [0.2; 3], [0.5; 3], 2.0, 1.0).unwrap())),
    ]
}

/// A soft sky over a dark ground, a dark room with a few lamps, and noise with texels of all brightnesses.
fn environments() -> [(&'static str, Environment); 3] {
    let of = |radiance: &dyn Fn(usize, usize) -> [f32; 3]| {
        let pixels = (0..GRID.len()).map(|k| radiance(k / GRID.width, k % GRID.width)).collect();
        Environment::new(GRID, pixels).unwrap()
    };
    let sky = |row: usize, column: usize| {
        let direction = GRID.direction(row, column).vector();
        let sun = (12.0 * (direction.dot(sphere::DVec3::new(0.6, -0.48, 0.64)) - 1.0)).exp();
        let up = 0.5 + 0.5 * direction.z;
        [0.1 + 0.4 * up + 6.0 * sun, 0.1 + 0.5 * up + 5.0 * sun, 0.08 + 0.8 * up + 3.0 * sun]
            .map(|v| v as f32)
    };
    let room = |row: usize, column: usize| match (row, column) {
        (10..14, 20..26) => [30.0, 28.0, 20.0],
        (20..22, 60..61) => [200.0, 220.0, 260.0],
        (0..2, _) => [2.0, 2.0, 2.5],
        (30..48, 0..4 | 92..96) => [6.0, 1.0, 0.5],
        _ => [0.03, 0.04, 0.05],
    };
    let noise = |row: usize, column: usize| {
        let hash = |k: usize| ((row * 7919 + column * 104_729 + k * 1_299_709) * 2_654_435_761) % 4096;
        [0, 1, 2].map(|channel| (hash(channel) as f32 / 2048.0 - 1.0).exp2())
    };
    [("sky", of(&sky)), ("room", of(&room)), ("noise", of(&noise))]
}
