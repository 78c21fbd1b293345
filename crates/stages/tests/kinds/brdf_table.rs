//! `tabulate-brdf` and `export-brdf-table`.

use brdf::{BelowHorizon, Ward};
use containers::{read_exr_layers, tensors};
use engine::Artifact;
use sh::Degree;
use sphere::Direction;
use stages::artifacts::{BrdfTable, Material};

use crate::fixture::{Case, Ran, case, lambert};

/// A brushed metal of two colours.
pub(crate) fn brushed() -> Material {
    Material(brdf::Material::Ward(Ward::new([0.3, 0.6], [0.9, 0.5, 0.9]).unwrap()))
}

fn tabulate(parameters: &str, material: Material) -> Ran {
    case("tabulate-brdf", parameters).input("material", material).run().unwrap()
}

fn export(parameters: &str, table: &BrdfTable) -> Case {
    case("export-brdf-table", parameters).input("table", table.clone())
}

/// A white sky is L_00 = sqrt(4 pi) alone: the surface shows its albedo toward the view.
#[test]
fn a_table_under_a_white_sky_shows_the_albedo() {
    let ran = tabulate("resolution = 16", Material(lambert(0.75)));
    let table = &ran.artifact::<BrdfTable>().0;
    assert_eq!((table.size(), table.degree().get(), table.channels(), table.count()), (16, 4, 1, 1));
    assert_eq!(ran.notes, ["25 coefficients, grey, for 16 x 16 views: 25.6 kB, within 0e0"]);
    let sky = (4.0 * std::f64::consts::PI).sqrt();
    for texel in table.values().chunks_exact(25) {
        assert!((f64::from(texel[0]) * sky - 0.75).abs() < 1e-6);
    }
    let rough = tabulate("resolution = 8\ndegree = 0", brushed());
    let table = &rough.artifact::<BrdfTable>().0;
    assert_eq!((table.channels(), table.texel(), table.below()), (3, 3, BelowHorizon::Clamped));
    let mut c = [0.0; 3];
    table.lookup_into(0, Direction::Z, &mut c);
    let found = brdf::albedo(&brushed().0, Direction::Z);
    assert!((f64::from(c[0]) * sky / found[0] - 1.0).abs() < 0.02, "{c:?} {found:?}");
    assert!(rough.notes[0].contains("RGB, for 8 x 8 views"), "{:?}", rough.notes);
}

#[test]
fn the_containers_hold_the_table() {
    let table = tabulate("resolution = 4\ndegree = 2", brushed()).artifact::<BrdfTable>();
    let same = export("", &table).files();
    assert_eq!(tensors::decode_brdf_table(&same[0]).unwrap(), table.0);
    let exr = read_exr_layers(&export("format = \"exr\"\nprecision = \"float\"", &table).files()[0]).unwrap();
    assert_eq!(exr.layers.len(), 9);
    let texel = |q: usize, row: usize| -> [f32; 3] {
        let first = (q * 9 + row) * 3;
        table.0.values()[first..first + 3].try_into().unwrap()
    };
    for (name, row) in [("", 0), ("l1mm1", 1), ("l2m2", 8)] {
        let (_, pixels) = exr.layers.iter().find(|(found, _)| found == name).unwrap();
        assert!((0..16).all(|place| pixels[place] == texel(place, row)), "{name}");
    }
    let ktx2 = export("format = \"ktx2\"\nprecision = \"float\"", &table).files();
    let read = containers::read_texture(&ktx2[0]).unwrap();
    // Three layers of four for each channel, the last of them row 8 and zeros.
    assert_eq!((read.texture.layers, read.texture.width), (9, 4));
    assert_eq!(read.texture.pixels[16 * 3 + 5], [4, 5, 6].map(|row| texel(5, row - 4)[1]));
    assert_eq!(read.texture.pixels[16 * 2 + 5], [texel(5, 8)[0], 0.0, 0.0]);
    assert_eq!(read.metadata["specula.degree"], "2");
    assert_eq!(read.metadata["specula.rows"].split(' ').count(), 9);
    // The fourth coefficient is where an opacity would be.
    let alpha = &ktx2[0][ktx2[0].len() - 9 * 16 * 16..][12..16];
    assert_eq!(f32::from_le_bytes(alpha.try_into().unwrap()), texel(0, 3)[0]);
}

#[test]
fn what_no_half_holds_is_counted() {
    let values = vec![1e5; 4];
    let table = brdf::BrdfTable::new(Degree::ZERO, 2, 1, BelowHorizon::Clamped, values).unwrap();
    let table = BrdfTable(table);
    let ran = export("format = \"ktx2\"", &table).run().unwrap();
    assert!(ran.warnings.is_empty() && ran.notes[0].starts_with("written in 32-bit floats"));
    let ran = export("format = \"ktx2\"\nprecision = \"half\"", &table).run().unwrap();
    assert!(ran.warnings[0].starts_with("the largest values are clamped: 34.5 % of the sum is lost"));
    let failure = export("format = \"exr\"\noverflow = \"error\"", &table).failure();
    assert!(failure.contains("exceed 65504, the largest half"), "{failure}");
    assert_eq!(export("precision = \"float\"", &table).errors().len(), 1);
    assert_eq!(export("overflow = \"error\"", &table).errors().len(), 1);
    assert_eq!(BrdfTable::TYPE, "brdf-table");
}
