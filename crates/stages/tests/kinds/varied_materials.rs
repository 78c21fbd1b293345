//! Tables of materials that vary over a mesh.

use stages::artifacts::{BrdfTable, Material, VertexBlend, VertexRadiance};

use crate::fixture::{case, lambert, sky_lighting};
use crate::vertices::{blend, picture, pit, pit_with_coordinates, radiance, table};

#[test]
fn a_surface_varies_between_the_materials_of_its_table() {
    let blended = blend("").artifact::<VertexBlend>();
    let values: Vec<f32> = blended.0.value.iter().map(|[first, _]| *first).collect();
    let expected = [0.0, 1.0, 0.2, 0.6, 0.45, 0.0, 1.0, 0.2, 0.6];
    assert!(values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{values:?}");
    let green = blend("channel = \"green\"").artifact::<VertexBlend>();
    assert!((green.0.value[2][0] - 0.8).abs() < 1e-6);
    // With tables of black, grey and white, the place halfway between black and white shows the grey. A table
    // of one material shows that material at every place.
    let greys = case("tabulate-brdf", "resolution = 16\ndegree = 2")
        .keyed_input("materials", &[("material", "a")], Material(lambert(0.0)))
        .keyed_input("materials", &[("material", "b")], Material(lambert(0.5)))
        .keyed_input("materials", &[("material", "c")], Material(lambert(1.0)));
    let ran = greys.run().unwrap();
    assert!(ran.notes[0].contains("16 x 16 views of 3 materials"), "{:?}", ran.notes);
    let shade = |table: BrdfTable| {
        case("shade-vertices", "camera = [-3, 1, 2]")
            .input("mesh", pit_with_coordinates())
            .input("table", table)
            .input("lighting", sky_lighting())
    };
    let greys = (*ran.artifact::<BrdfTable>()).clone();
    let varied = radiance(&shade(greys.clone()).input("blend", (*blended).clone()));
    let white = radiance(&shade(table(lambert(1.0))));
    for (vertex, value) in values.iter().enumerate() {
        let expected = white[vertex][1] * value;
        assert!((varied[vertex][1] - expected).abs() < 1e-4, "{vertex}: {varied:?} {white:?}");
    }
    assert_eq!(shade(greys).failure(), "the table has 3 materials, but nothing places them on the mesh");
    let other = case("vertex-blend", "texture = \"noise.png\"").file("noise.png", picture());
    let other = other.input("mesh", pit()).artifact::<VertexBlend>();
    let failure = shade(table(lambert(1.0))).input("blend", (*other).clone()).failure();
    assert_eq!(failure, "the blend belongs to another mesh");
}

/// The oracle is the bilinear sum of the pit in each of the four materials alone.
#[test]
fn two_parameters_vary_by_two_channels_of_a_picture() {
    let ward = |x: f64, y: f64| brdf::Ward::new([x, y], [1.0; 3]).unwrap();
    let tabulate = |text: &str, material| {
        case("tabulate-brdf", &format!("resolution = 16\ndegree = 3\n{text}"))
            .input("material", Material(brdf::Material::Ward(material)))
    };
    let both = "vary = \"roughness\"\nfrom = 0.2\nto = 0.8\ncount = 2\n\
                second-vary = \"roughness_y\"\nsecond-from = 0.3\nsecond-to = 0.9\nsecond-count = 2";
    let ran = tabulate(both, ward(0.5, 0.5)).run().unwrap();
    assert!(ran.notes[0].contains("16 x 16 views of 2 x 2 materials"), "{:?}", ran.notes);
    let grid = (*ran.artifact::<BrdfTable>()).clone();
    assert_eq!((grid.0.grid(), grid.0.count()), ([2, 2], 4));
    let shade = |table: BrdfTable| {
        case("shade-vertices", "camera = [-3, 1, 2]")
            .input("mesh", pit_with_coordinates())
            .input("table", table)
            .input("lighting", sky_lighting())
    };
    let placed = blend("second-channel = \"green\"").artifact::<VertexBlend>();
    let varied = shade(grid.clone()).input("blend", (*placed).clone()).run().unwrap();
    assert!(varied.warnings.iter().all(|warning| !warning.contains("blend")), "{:?}", varied.warnings);
    let varied = varied.artifact::<VertexRadiance>().0.value.clone();
    let [[aa, ab], [ba, bb]] = [0.2, 0.8].map(|x| {
        [0.3, 0.9].map(|y| {
            let alone = tabulate("", ward(x, y)).artifact::<BrdfTable>();
            radiance(&shade((*alone).clone()))
        })
    });
    for (vertex, [s, t]) in placed.0.value.iter().copied().enumerate() {
        assert!((s + t - 1.0).abs() < 1e-6, "green is 1 less red");
        for channel in 0..3 {
            let expected = (1.0 - s) * ((1.0 - t) * aa[vertex][channel] + t * ab[vertex][channel])
                + s * ((1.0 - t) * ba[vertex][channel] + t * bb[vertex][channel]);
            let found = varied[vertex][channel];
            assert!((found - expected).abs() < 1e-5, "{vertex}: {found} {expected}");
        }
    }
    // A picture of its own is read like another channel.
    let swapped = case("vertex-blend", "texture = \"a.png\"\nsecond-texture = \"noise.png\"")
        .file("a.png", picture())
        .file("noise.png", picture())
        .input("mesh", pit_with_coordinates())
        .artifact::<VertexBlend>();
    assert!(swapped.0.value.iter().all(|[first, second]| first == second));
    // What has no effect is said.
    let warned = |table: &BrdfTable, blend: &VertexBlend| {
        shade(table.clone()).input("blend", blend.clone()).run().unwrap().warnings
    };
    let one = blend("").artifact::<VertexBlend>();
    let warnings = warned(&grid, &one);
    assert!(warnings[0].contains("the table's second parameter does not vary"), "{warnings:?}");
    let row = tabulate("vary = \"roughness\"\nfrom = 0.2\nto = 0.8\ncount = 2", ward(0.5, 0.5));
    let warnings = warned(&row.artifact::<BrdfTable>(), &placed);
    assert!(warnings[0].contains("the second number of the blend has no effect"), "{warnings:?}");
}

#[test]
fn errors_of_a_second_parameter_name_it() {
    let errors = |kind: &'static str, text: &str| case(kind, text).errors();
    let first = "vary = \"exponent\"\nfrom = 3\nto = 9";
    for (text, expected) in [
        (
            "second-vary = \"exponent_y\"\nsecond-from = 1\nsecond-to = 2",
            "second-vary: also needs a first one",
        ),
        (
            &format!("{first}\nsecond-vary = \"exponent_y\"\nsecond-from = 1"),
            "second-vary: also needs `second-to`",
        ),
        (
            &format!("{first}\nsecond-count = 2"),
            "second-count: only a varying parameter uses it: second-vary",
        ),
        (
            &format!("{first}\nsecond-vary = \"exponent\"\nsecond-from = 1\nsecond-to = 2"),
            "second-vary: `vary` has \"exponent\" too: name another parameter",
        ),
        (
            &format!("{first}\ncount = 52\nsecond-vary = \"exponent_y\"\nsecond-from = 1\nsecond-to = 2"),
            "count: a table has at most 256 materials, and these are 260",
        ),
    ] {
        let found = errors("tabulate-brdf", text);
        assert!(found.len() == 1 && found[0].starts_with(expected), "{text}: {found:?}");
    }
    for (text, expected) in [
        ("second-channel = \"blue\"", "second-channel: also needs the picture of the first number"),
        ("second-attribute = \"_A\"", "second-attribute: also needs that of the first number and the file"),
        (
            "texture = \"a.png\"\nsecond-attribute = \"_A\"",
            "second-attribute: cannot be combined with `texture`",
        ),
    ] {
        let found = errors("vertex-blend", text);
        assert!(found.len() == 1 && found[0].starts_with(expected), "{text}: {found:?}");
    }
}

#[test]
fn one_parameter_of_a_material_varies() {
    let metal = || Material(brdf::Material::Ward(brdf::Ward::new([0.3, 0.3], [1.0; 3]).unwrap()));
    let vary = |text: &str, material: Material| {
        case("tabulate-brdf", &format!("resolution = 8\ndegree = 2\n{text}")).input("material", material)
    };
    let found = vary("vary = \"roughness_y\"\nfrom = 0.3\nto = 0.9\ncount = 3", metal());
    let found = found.artifact::<BrdfTable>();
    assert_eq!((found.0.count(), found.0.channels()), (3, 1));
    let rough = brdf::Material::Ward(brdf::Ward::new([0.3, 0.6], [1.0; 3]).unwrap());
    let middle = vary("", Material(rough)).artifact::<BrdfTable>();
    let each = middle.0.values().len();
    assert_eq!(found.0.values()[each..2 * each], *middle.0.values());
    for (text, material, expected) in [
        (
            "vary = \"roughnes_y\"\nfrom = 0.3\nto = 1",
            metal(),
            "ward has no numeric parameter \"roughnes_y\" that could vary",
        ),
        (
            "vary = \"specular\"\nfrom = 0\nto = 1",
            metal(),
            "ward has no numeric parameter \"specular\" that could vary",
        ),
        ("vary = \"roughness\"\nfrom = 0\nto = 1", metal(), "roughness: 0 is not a number from 0.01 to 1"),
    ] {
        assert_eq!(vary(text, material).failure(), expected);
    }
    let Err(failure) = vary("vary = \"albedo\"\nfrom = 0\nto = 1", Material(lambert(0.5))).run() else {
        panic!("it varied")
    };
    assert_eq!(failure.chain, ["lambert has no numeric parameter \"albedo\" that could vary"]);
    let help = "it has no numeric parameter: make a material file for each value, and connect them as \
                `materials`";
    assert_eq!(failure.help.as_deref(), Some(help));
    assert_eq!(vary("vary = \"roughness\"", metal()).errors().len(), 2);
    assert_eq!(
        vary("from = 1", metal()).errors(),
        ["from: only a varying parameter uses it: vary = \"roughness\""]
    );
    let both = vary("", metal()).keyed_input("materials", &[], metal());
    assert_eq!(both.failure(), "both material and materials are connected");
    assert_eq!(case("tabulate-brdf", "").failure(), "no material is connected");
}
