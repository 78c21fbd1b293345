//! How `export-shrm` and `convolve` choose the degree P, and how large the files of `export-shrm` are.

use brdf::{Choice, Fresnel, Ggx, project};
use containers::tensors;
use sh::{Degree, Expansion, Light, Stop};
use shrm::SMALL_P;
use shrm::accuracy::Accuracy;
use sphere::Direction;
use stages::artifacts::{Brdf, Lighting, Material, Reflection};

use crate::fixture::{Case, Ran, case, sky_lighting};

/// A metal of this roughness.
fn metal(roughness: f64) -> brdf::Material {
    let gold = Fresnel::Conductor { n: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] };
    brdf::Material::Ggx(Ggx::new(roughness, gold, [1.0; 3]).unwrap())
}

/// Light of a contrast that a cut in P shows, with a sun beside it if that is asked for.
pub(crate) fn lighting(sunny: bool) -> Lighting {
    let degree = Degree::new(24).unwrap();
    let mut series = Expansion::zero(degree);
    series.coefficients_mut()[0] = [1.0; 3];
    // Windows of a tenth of a radian, each with as much light as all that is around them.
    for (theta, phi, flux) in [(0.7, 0.3, 4.0), (1.5, 2.5, 3.0), (2.2, -1.5, 2.0)] {
        let window = |l: usize| [flux * (-0.005 * (l * (l + 1)) as f64).exp(); 3];
        let window = Expansion::zonal(Direction::from_angles(theta, phi), degree, window);
        for (sum, more) in series.coefficients_mut().iter_mut().zip(window.coefficients()) {
            (0..3).for_each(|channel| sum[channel] += more[channel]);
        }
    }
    let sun = Light::from_flux(Direction::from_angles(0.9, 0.4), 0.01, [24.0, 20.0, 16.0]);
    Lighting(sh::Lighting { series, lights: if sunny { vec![sun] } else { Vec::new() } })
}

fn brdf(material: &brdf::Material, degrees: &str) -> Brdf {
    let case = case("project-brdf", degrees).input("material", Material(material.clone()));
    (*case.artifact::<Brdf>()).clone()
}

fn convolved(lighting: Lighting, brdf: Brdf, parameters: &str) -> Ran {
    case("convolve", parameters).input("lighting", lighting).input("brdf", brdf).run().unwrap()
}

/// A field whose degrees were chosen for its light.
fn field(sunny: bool) -> Reflection {
    let ran = convolved(lighting(sunny), brdf(&metal(0.35), ""), "");
    (*ran.artifact::<Reflection>()).clone()
}

fn export(parameters: &str, field: &Reflection) -> Case {
    case("export-shrm", parameters).input("reflection", field.clone())
}

fn p_of(ran: &Ran) -> usize {
    tensors::decode_shrm(ran.files()[0]).unwrap().p().get()
}

/// The two numbers of stops in `95 % of views are within A stops, 99 % within B`.
fn stops(text: &str) -> [f64; 2] {
    let number = |after: &str| -> f64 {
        let rest = text.split(after).nth(1).unwrap_or_else(|| panic!("{text}"));
        let word = rest.split([' ', ';']).next().unwrap();
        word.parse().unwrap_or_else(|_| panic!("{text}"))
    };
    [number("95 % of views are within "), number("99 % within ")]
}

/// The note on P, which is there if the map has another than its field.
fn note(ran: &Ran) -> &str {
    ran.notes.iter().find(|note| note.starts_with("the map takes P = ")).unwrap_or_else(|| {
        panic!("{:?} {:?}", ran.notes, ran.warnings);
    })
}

#[test]
fn the_least_p_that_meets_accept_is_taken() {
    let field = field(false);
    let own = field.0.brdf().p().get();
    assert!(own > SMALL_P, "the field has more degrees than a small map: {own}");
    let ran = export("resolution = 4\naccept = [9, 9]", &field).run().unwrap();
    assert_eq!(p_of(&ran), 0, "every error is accepted");
    // The errors at each P, as misses of an unreachable tolerance tell them.
    let errors: Vec<[f64; 2]> = (0..=SMALL_P)
        .map(|p| {
            let tight = format!("resolution = 4\naccept = [1e-6, 1e-6]\nmost-p = {p}");
            let ran = export(&tight, &field).run().unwrap();
            assert!(p_of(&ran) <= p);
            stops(note(&ran))
        })
        .collect();
    assert!(errors[0][0] > errors[SMALL_P][0], "{errors:?}");
    for p in 1..=SMALL_P {
        let [p95, p99] = errors[p].map(|stops| stops + 1e-3);
        let ran = export(&format!("resolution = 4\naccept = [{p95}, {p99}]"), &field).run().unwrap();
        let least = errors.iter().position(|found| found[0] <= p95 && found[1] <= p99).unwrap();
        assert_eq!(p_of(&ran), least, "{errors:?}");
        assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);
        let found = stops(note(&ran));
        assert!(found[0] <= p95 && found[1] <= p99, "{found:?}");
        // A cut holds the field's own coefficients.
        let (map, whole) = (tensors::decode_shrm(ran.files()[0]).unwrap(), &field.0);
        for texel in [0, 17, 95] {
            let expected = whole.coefficients(map.grid().direction(texel));
            for (row, value) in map.texel(texel).iter().enumerate() {
                assert!((f64::from(value[1]) - expected[row][1]).abs() < 1e-5, "{texel} {row}");
            }
        }
    }
}

/// If no P up to `most-p` is enough, P is at most 4, and the remedy of the warning was tried.
#[test]
fn where_no_p_is_enough_the_best_small_one_is_taken_with_a_warning() {
    let field = field(false);
    let own = field.0.brdf().p().get();
    assert!(own > 6, "{own}");
    for (parameters, most) in [("", SMALL_P), ("most-p = 2", 2), ("most-p = 6", SMALL_P)] {
        let text = format!("resolution = 4\naccept = [1e-5, 1e-5]\n{parameters}");
        let ran = export(&text, &field).run().unwrap();
        assert!(p_of(&ran) <= most, "{parameters}");
        let [warning] = &ran.warnings[..] else { panic!("{:?}", ran.warnings) };
        let tried = if parameters.is_empty() { SMALL_P } else { parameters[9..].parse().unwrap() };
        let start =
            format!("no P up to {tried} meets accept = [0.00001, 0.00001]: at P = {} 95 %", p_of(&ran));
        assert!(warning.starts_with(&start), "{warning}");
        assert_eq!(stops(warning), stops(note(&ran)));
        let enough = format!("; most-p = {own} is enough");
        assert!(warning.ends_with(&enough), "{warning}");
    }
    let ran =
        export(&format!("resolution = 4\naccept = [1e-5, 1e-5]\nmost-p = {own}"), &field).run().unwrap();
    assert_eq!((p_of(&ran), ran.warnings.len()), (own, 0));
}

/// A fibre's map has one coefficient for each p, if its file does not store the zeros: 17 at P = 16.
#[test]
fn without_azimuth_p_is_as_high_as_is_needed() {
    let fibre = brdf::Material::KajiyaKay(brdf::KajiyaKay::new(32.0, [0.3; 3]).unwrap());
    let ran = convolved(lighting(false), brdf(&fibre, ""), "");
    let field = (*ran.artifact::<Reflection>()).clone();
    let noted = |parameters: &str| {
        let ran = export(&format!("resolution = 4\n{parameters}"), &field).run().unwrap();
        let p = note(&ran).trim_start_matches("the map takes P = ").split(':').next().unwrap();
        (p.parse::<usize>().unwrap(), stops(note(&ran)), ran.warnings.len())
    };
    let tight = "accept = [0.05, 0.1]";
    let (p, found, warnings) = noted(&format!("format = \"ktx2\"\n{tight}"));
    assert!(p > SMALL_P && p <= shrm::MOST_P && warnings == 0, "{p} {warnings}");
    assert!(found[0] <= 0.05 && found[1] <= 0.1, "{found:?}");
    // Files with all (P + 1)^2 coefficients stay small.
    for parameters in ["", "format = \"ktx2\"\nview = \"global\""] {
        let (p, found, warnings) = noted(&format!("{parameters}\n{tight}"));
        assert!(p <= SMALL_P && found[0] > 0.05 && warnings == 1, "{parameters}: {p} {found:?}");
    }
}

#[test]
fn an_error_is_that_of_the_paper() {
    let field = field(false);
    let accuracy = Accuracy::of(&field.0, [0.0; 3], 0.0);
    let rms = |p: usize| accuracy.at(accuracy.f(), p).truth.sqrt();
    for p in 1..=SMALL_P {
        let error = 1.001 * rms(p);
        let ran = export(&format!("resolution = 4\nerror = {error}"), &field).run().unwrap();
        let least = (0..=SMALL_P).find(|p| rms(*p) <= error).unwrap();
        assert_eq!(p_of(&ran), least);
        let said = note(&ran).split("the RMS error is ").nth(1).unwrap();
        let said: f64 = said.split(' ').next().unwrap().parse().unwrap();
        assert!((said / 100.0 / rms(least) - 1.0).abs() < 0.06, "{said} {}", rms(least));
    }
    let ran = export("resolution = 4\nerror = 0.000001", &field).run().unwrap();
    assert!(ran.warnings[0].starts_with("no P up to 4 meets error = 0.000001: "), "{:?}", ran.warnings);
}

/// The errors count the lamps that the map holds; if no P is enough, the map is small all the same.
#[test]
fn with_lamps_in_the_map_the_same_rule_holds() {
    let field = field(true);
    assert!(field.0.lamps().is_some());
    let ran = export("resolution = 4", &field).run().unwrap();
    let found = stops(note(&ran));
    assert!(p_of(&ran) <= SMALL_P && ran.warnings.is_empty(), "{:?}", ran.warnings);
    assert!(found[0] <= 0.15 && found[1] <= 0.4, "{found:?}");

    let ran = export("resolution = 4\naccept = [0.05, 0.1]", &field).run().unwrap();
    assert!(p_of(&ran) <= SMALL_P);
    let [warning] = &ran.warnings[..] else { panic!("{:?}", ran.warnings) };
    assert!(warning.starts_with("no P up to 4 meets accept = [0.05, 0.1]: at P = "), "{warning}");
    assert_eq!(stops(warning), stops(note(&ran)));
    assert!(warning.contains("; lamps = \"separate\" leaves the suns and lamps"), "{warning}");
    // More degrees come nearer.
    let ran = export("resolution = 4\naccept = [0.1, 0.3]\nmost-p = 16", &field).run().unwrap();
    assert!(ran.warnings.is_empty() && p_of(&ran) > SMALL_P, "{:?}", ran.warnings);
    let found = stops(note(&ran));
    assert!(found[0] <= 0.1 && found[1] <= 0.3, "{found:?}");
}

#[test]
fn degrees_that_the_manifest_names_are_kept_and_can_be_cut() {
    let ran = convolved(lighting(false), brdf(&metal(0.35), "degree = [12, 7]"), "window = \"none\"");
    let field = (*ran.artifact::<Reflection>()).clone();
    assert_eq!(p_of(&export("resolution = 4", &field).run().unwrap()), 7);
    assert_eq!(p_of(&export("resolution = 4\nmost-p = 2\naccept = [9, 9]", &field).run().unwrap()), 0);
    let ran = export("resolution = 4\nmost-p = 2\naccept = [1e-5, 1e-5]", &field).run().unwrap();
    assert!(p_of(&ran) <= 2 && ran.warnings.len() == 1);
}

/// `convolve` moves no lamp into a series that is cut, unless it does not know who reflects it.
#[test]
fn lamps_stay_beside_a_field_of_named_degrees() {
    let lit = lighting(true);
    let ran = convolved(lit.clone(), brdf(&metal(0.35), "degree = [12, 3]"), "");
    let field = &ran.artifact::<Reflection>().0;
    assert_eq!(field.lamps().unwrap().lights, lit.0.lights);
    let degree = Degree::new(12).unwrap();
    assert!(*field.lighting() == lit.0.series.to_degree(degree) && !field.is_for_light());
    assert!(ran.notes[0].ends_with("; 1 lamp is kept separate"), "{:?}", ran.notes);
    let separate = export("resolution = 4\nlamps = \"separate\"", &Reflection(field.clone())).run().unwrap();
    assert_eq!(tensors::decode_lights(separate.files()[0]).unwrap(), lit.0.lights);
    assert_eq!(p_of(&separate), 3);
    // In the map they are fitted, at the degree that was named.
    let baked = export("resolution = 4", &Reflection(field.clone())).run().unwrap();
    assert_eq!(p_of(&baked), 3);

    // Both parts of a lacquer reflect them.
    let lacquer = brdf::Material::Standard(brdf::Standard::new(Default::default()).unwrap());
    let ran = convolved(lit.clone(), brdf(&lacquer, "degree = [12, 3]"), "");
    let field = ran.artifact::<Reflection>();
    let parts = field.0.parts().unwrap();
    assert!(parts.iter().all(|part| part.lamps().unwrap().lights == lit.0.lights));

    let mut unknown = brdf(&metal(0.35), "degree = [12, 3]");
    unknown.0.material = None;
    let ran = convolved(lit.clone(), unknown, "");
    assert!(ran.artifact::<Reflection>().0.lamps().is_none());
    let warning =
        "the coefficients arrive without their material, so the lamps of the lighting (1) go into its series";
    assert!(ran.warnings[0].starts_with(warning), "{:?}", ran.warnings);
}

#[test]
fn a_field_of_fewer_coefficients_is_made_by_accept_or_error() {
    let lit = lighting(false);
    let of = |parameters: &str| convolved(lit.clone(), brdf(&metal(0.35), ""), parameters);
    let p = |ran: &Ran| ran.artifact::<Reflection>().0.brdf().p().get();
    let whole = p(&of(""));
    let small = of("accept = [0.3, 0.6]");
    assert!(p(&small) < whole && small.warnings.is_empty(), "{whole} {:?}", small.warnings);
    let [p95, p99] = stops(&small.notes[0]);
    // F adds at most 0.015 and 0.05.
    assert!(p95 <= 0.315 && p99 <= 0.65, "{:?}", small.notes);
    let missed = of("accept = [1e-5, 1e-5]\nmost-p = 3");
    assert!(p(&missed) <= 3);
    assert!(missed.warnings[0].starts_with("no P up to 3 meets accept = "), "{:?}", missed.warnings);

    let material = metal(0.35);
    let full = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
    let accuracy = Accuracy::of(&shrm::Reflection::convolve(&lit.0.series, &full), [0.0; 3], 0.0);
    let rms = |p: usize| accuracy.at(accuracy.f(), p).truth.sqrt();
    let by_error = of(&format!("error = {}", 1.001 * rms(3)));
    assert_eq!(p(&by_error), (0..=3).find(|p| rms(*p) <= 1.001 * rms(3)).unwrap());
    assert!(by_error.notes[0].contains("; the RMS error of P is "), "{:?}", by_error.notes);

    let named = case("convolve", "accept = [0.1, 0.2]").input("lighting", sky_lighting());
    assert_eq!(
        named.input("brdf", brdf(&material, "degree = [4, 2]")).failure(),
        "accept chooses P, but the coefficients already have a given P"
    );
    for (parameters, expected) in [
        ("accept = [0.1, 0.2]\nerror = 0.1", "error: accept already sets the allowed error"),
        ("most-p = 4", "most-p: only accept or error uses it"),
    ] {
        assert_eq!(case("convolve", parameters).errors(), [expected]);
    }
}

/// 6 faces of 200 x 200 texels of 9 coefficients, 12 bytes each.
#[test]
fn a_file_of_more_than_16_mb_has_a_warning() {
    let two = crate::export_shrm::made_up(true);
    let ran = export("resolution = 200", &two).run().unwrap();
    let [warning] = &ran.warnings[..] else { panic!("{:?}", ran.warnings) };
    assert_eq!(
        warning,
        "the file has 25.9 MB, more than 16.0 MB: resolution = \"auto\" takes what accuracy needs; format = \"ktx2\" \
         holds halves"
    );
    assert!(export("resolution = 120", &two).run().unwrap().warnings.is_empty());
}

/// `"auto"` lowers the resolution for a file of 1 MB, down to an error of 0.03, unless an error is given.
#[test]
fn an_automatic_resolution_counts_bytes() {
    let field = field(false);
    let ran = export("accept = [1e-5, 1e-5]", &field).run().unwrap();
    let map = tensors::decode_shrm(ran.files()[0]).unwrap();
    let cut = field.0.cut_in_view(map.p());
    let layout = shrm::MapLayout::Cube;
    let [fine, coarse] = [0.01, 0.03].map(|error| cut.resolution(layout, error).texels);
    let bytes = |edge: usize| 6 * edge * edge * 12 * map.p().rows();
    let small = (4..=fine).step_by(4).filter(|edge| bytes(*edge) <= 1_000_000).max().unwrap();
    assert_eq!(map.grid().shape()[1], fine.min(small.max(coarse)), "{small} {coarse} {fine}");
    assert!(small < fine, "the file would not be small: {small} {fine}");
    let said = format!(", so that the file stays small: resolution = {fine} has ");
    assert!(ran.notes.iter().any(|note| note.contains(&said)), "{:?}", ran.notes);
    assert!(!ran.warnings.iter().any(|warning| warning.contains("too coarse")), "{:?}", ran.warnings);
    // An error that is given is met.
    let cut = export("error = 0.005", &field).run().unwrap();
    let estimate = cut.notes.iter().find_map(|note| note.split("estimated error of ").nth(1)).unwrap();
    let estimate: f64 = estimate.split(' ').next().unwrap().parse().unwrap();
    assert!(estimate <= 0.5, "{:?}", cut.notes);
}
