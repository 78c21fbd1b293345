//! Materials with two centres: a map for each part, which a renderer adds.

use containers::tensors::DegreeSource;
use shrm::frame;
use sphere::{Direction, LatLong};
use stages::artifacts::{Brdf, Lighting, Material, Reflection};

use crate::fixture::{Case, Ran, case, environment, lambert, phong, pixels, sky, sky_lighting};

/// Both parts look the same from every view, so that their maps lose nothing.
pub(crate) fn lacquer() -> brdf::Material {
    brdf::Material::layers(vec![lambert(0.6), phong(12.0)]).unwrap()
}

fn reflected(material: brdf::Material, degrees: &str) -> Reflection {
    reflected_under(sky_lighting(), material, degrees)
}

/// The reflection of a light, off a material to these degrees.
pub(crate) fn reflected_under(lighting: Lighting, material: brdf::Material, degrees: &str) -> Reflection {
    let brdf = case("project-brdf", degrees).input("material", Material(material)).artifact::<Brdf>();
    let convolved = case("convolve", "").input("lighting", lighting).input("brdf", (*brdf).clone());
    (*convolved.artifact::<Reflection>()).clone()
}

fn export(kind: &'static str, parameters: &str, material: brdf::Material) -> Case {
    case(kind, parameters).input("reflection", reflected(material, ""))
}

/// The sky that a material reflects toward a view, by a sum over its pixels.
fn brute_force(material: &brdf::Material, normal: Direction, view: Direction) -> [f64; 3] {
    let (grid, into) = (LatLong::with_rows(96), frame(normal).inverse());
    let (sky, view) = (environment(96, sky), into.apply(view));
    let mut sum = [0.0; 3];
    for (index, radiance) in sky.0.pixels().iter().enumerate() {
        let (row, column) = (index / grid.width, index % grid.width);
        let rho_hat = material.rho_hat(into.apply(grid.direction(row, column)), view);
        for channel in 0..3 {
            sum[channel] += f64::from(radiance[channel]) * rho_hat[channel] * grid.solid_angle(row);
        }
    }
    sum
}

#[test]
fn the_maps_of_both_parts_add_up_to_what_the_material_reflects() {
    let text = "resolution = 24\nprecision = \"float\"\n";
    let separate = export("export-reflection-map", text, lacquer());
    assert_eq!(separate.endings(), ["-diffuse.exr", ".exr"]);
    let [diffuse, specular] = [0, 1].map(|file| pixels(&separate.files()[file]).2);
    let together = export("export-reflection-map", &format!("{text}parts = \"together\""), lacquer());
    assert_eq!(together.endings(), [".exr"]);
    let one = pixels(&together.files()[0]).2;
    let grid = LatLong::with_rows(24);
    let at = |map: &[[f32; 3]], [row, column]: [usize; 2]| map[row * 48 + column].map(f64::from);
    let (mut worst, mut worst_of_one): (f64, f64) = (0.0, 0.0);
    for (normal, central) in [([3, 5], [7, 9]), ([12, 30], [12, 38]), ([20, 1], [15, 44])] {
        let [n, r] = [normal, central].map(|[row, column]| grid.direction(row, column));
        let view = Direction::new(n.vector() * (2.0 * n.dot(r)) - r.vector()).unwrap();
        let right = brute_force(&lacquer(), n, view);
        for channel in 0..3 {
            let sum = at(&diffuse, normal)[channel] + at(&specular, central)[channel];
            worst = worst.max((sum / right[channel] - 1.0).abs());
            worst_of_one = worst_of_one.max((at(&one, central)[channel] / right[channel] - 1.0).abs());
        }
    }
    // The sum over 96 rows of pixels errs by less than 1e-3.
    assert!(worst < 2e-3 && worst_of_one > 10.0 * worst, "{worst}, {worst_of_one}");
}

#[test]
fn a_material_with_one_centre_has_one_map() {
    let metal = brdf::StandardParameters { metallic: 1.0, roughness: 0.6, ..Default::default() };
    let metal = brdf::Material::Standard(brdf::Standard::new(metal).unwrap());
    for material in [lambert(0.5), phong(12.0), metal] {
        let case = export("export-reflection-map", "resolution = 4", material);
        assert_eq!(case.endings(), [".exr"]);
        assert!(case.files().iter().all(|file| !engine::stands_for_no_file(file)));
    }
    let plastic = brdf::Material::Standard(brdf::Standard::new(Default::default()).unwrap());
    assert_eq!(
        export("export-reflection-map", "resolution = 4", plastic).endings(),
        ["-diffuse.exr", ".exr"]
    );
}

/// Every export of a reflection has both maps, with its index last; the manifest's degrees keep them too.
#[test]
fn every_export_writes_a_map_of_each_part() {
    for (kind, parameters, endings) in [
        ("export-shrm", "resolution = 4\nformat = \"ktx2\"", vec!["-diffuse.ktx2", ".ktx2"]),
        (
            "export-kautz-mccool",
            "resolution = 4",
            vec!["-diffuse/texture.dds", "-diffuse/kautz-mccool.json", "/texture.dds", "/kautz-mccool.json"],
        ),
        (
            "export-view-maps",
            "resolution = 4\nviews = 3",
            vec!["-diffuse/maps.ktx2", "-diffuse/view-maps.json", "/maps.ktx2", "/view-maps.json"],
        ),
    ] {
        let case = export(kind, parameters, lacquer());
        assert_eq!(case.endings(), endings, "{kind}");
    }
    let cabral = export("export-cabral", "resolution = 4", lacquer());
    let endings = cabral.endings();
    assert_eq!((endings.len(), &*endings[12], &*endings[25]), (26, "-diffuse/cabral.json", "/cabral.json"));
    let index: serde_json::Value = serde_json::from_slice(&cabral.files()[12]).unwrap();
    assert_eq!(index["centre"], "normal");
    let fixed =
        case("export-shrm", "resolution = 4").input("reflection", reflected(lacquer(), "degree = [2, 2]"));
    assert_eq!(fixed.endings(), ["-diffuse.safetensors", ".safetensors"]);
    let [diffuse, specular] =
        [0, 1].map(|file| containers::tensors::decode_shrm(&fixed.files()[file]).unwrap().centre());
    assert_eq!([diffuse, specular], [brdf::Centre::Normal, brdf::Centre::Reflection]);
}

/// Lights beside two maps are added once: only the map of the highlight has them.
#[test]
fn lights_are_beside_one_of_the_maps() {
    let mut lighting = sky_lighting();
    lighting.0.lights.push(sh::Light {
        direction: Direction::from_angles(0.4, 1.0),
        radius: 0.01,
        irradiance: [9.0; 3],
    });
    let brdf = case("project-brdf", "").input("material", Material(lacquer())).artifact::<Brdf>();
    let reflection = case("convolve", "")
        .input("lighting", lighting)
        .input("brdf", (*brdf).clone())
        .artifact::<Reflection>();
    let exported = case("export-shrm", "resolution = 4\nlamps = \"separate\"")
        .input("reflection", (*reflection).clone());
    let lights =
        exported.files().into_iter().map(|file| containers::tensors::decode_lights(&file).unwrap().len());
    assert_eq!(lights.collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn the_loss_of_one_map_is_noted() {
    let ran = |parameters: &str| -> Ran {
        export("export-reflection-map", &format!("resolution = 4\n{parameters}"), lacquer()).run().unwrap()
    };
    assert_eq!(
        ran("").notes[0],
        "a map of each part: add the diffuse one, looked up by the normal (P = 0), to the other (P = 0)"
    );
    let together = ran("parts = \"together\"");
    let (notes, said) = (&together.notes, [&together.notes[..], &together.warnings].concat());
    assert!(notes[0].starts_with("one map holds both parts about the reflection vector: P = "), "{notes:?}");
    let stops = said.iter().find_map(|text| text.strip_prefix("95 % of the views of a ball are within "));
    let stops: f64 = stops.unwrap().split(' ').next().unwrap().parse().unwrap();
    // A base of 0.6 under a sky that changes by a factor of 3 from the zenith to the ground.
    assert!((0.05..2.0).contains(&stops), "{notes:?}");
}

/// Neither the whole nor a part has negative values, and each is the nearest to its own projection.
#[test]
fn the_nearest_non_negative_function_is_found_for_each_part() {
    let run = |parameters: &str| {
        let case = case("project-brdf", parameters).input("material", Material(lacquer()));
        let ran = case.run().unwrap();
        let brdf = ran.artifact::<Brdf>().0.clone();
        (ran.notes, brdf)
    };
    let (_, plain) = run("degree = [4, 2]");
    let (notes, brdf) = run("degree = [4, 2]\nnon-negative = \"nearest\"");
    assert_eq!(brdf.degrees, DegreeSource::Named);
    let ([diffuse, specular], [plain_diffuse, _]) = (brdf.parts.unwrap(), plain.parts.unwrap());
    for (before, after) in [(&plain.coefficients, &brdf.coefficients), (&plain_diffuse, &diffuse)] {
        assert_ne!(before, after);
        let expected = brdf::nearest_non_negative(before, sh::Mean::Free, sh::Stop::NEVER).unwrap();
        assert_eq!(after, &expected.coefficients);
    }
    for coefficients in [&brdf.coefficients, &diffuse, &specular] {
        let again = brdf::nearest_non_negative(coefficients, sh::Mean::Free, sh::Stop::NEVER).unwrap();
        assert!(again.before >= 0.0 && again.change == 0.0, "{again:?}");
    }
    let told = notes.iter().filter(|note| note.contains(" % in L2; minimum -")).count();
    assert!(told >= 2, "{notes:?}");
    let (_, same) = run("degree = [4, 2]\nnon-negative = \"nearest-same-mean\"");
    assert_ne!(same.coefficients, brdf.coefficients);
    assert_eq!(same.coefficients.get(0, 0, 0), plain.coefficients.get(0, 0, 0));
}

#[test]
fn non_negative_coefficients_need_degrees_that_stay() {
    let case = |parameters| case("project-brdf", parameters).input("material", Material(lacquer()));
    assert_eq!(case("non-negative = \"nearest\"").errors(), ["non-negative: needs a degree or a tolerance"]);
    assert_eq!(
        case("non-negative = \"nearest\"\ndegree = [40, 8]").errors(),
        ["degree: 1725 coefficients are more than the 1500 for non-negative"]
    );
    assert!(case("non-negative = \"nearest\"\ntolerance = 0.2").run().is_ok());
}
