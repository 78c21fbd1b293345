use super::*;

/// A file of one `standard_surface` with these inputs, from line 3 on.
fn standard(inputs: &str) -> String {
    let shader = format!("<standard_surface name=\"S\" type=\"surfaceshader\">\n{inputs}</standard_surface>");
    format!("<?xml version=\"1.0\"?><materialx version=\"1.39\">\n{shader}\n{}", of("S"))
}

/// A file of one `open_pbr_surface` with these inputs, from line 3 on.
fn open_pbr(inputs: &str) -> String {
    standard(inputs).replace("standard_surface", "open_pbr_surface")
}

/// The end of a file: its material, whose shader has this name.
fn of(shader: &str) -> String {
    format!(
        "<surfacematerial name=\"Paint\" type=\"material\">\n<input name=\"surfaceshader\" type=\"surfaceshader\" \
         nodename=\"{shader}\"/>\n</surfacematerial>\n</materialx>\n"
    )
}

fn input(name: &str, value: &str) -> String {
    let kind = if value.contains(',') { "color3" } else { "float" };
    format!("<input name=\"{name}\" type=\"{kind}\" value=\"{value}\"/>\n")
}

fn inputs(of: &[(&str, &str)]) -> String {
    of.iter().map(|(name, value)| input(name, value)).collect()
}

fn read(text: &str) -> MaterialxMaterial {
    read_materialx_material(text.as_bytes(), None).unwrap()
}

fn error(text: &str) -> String {
    read_materialx_material(text.as_bytes(), None).unwrap_err().to_string()
}

#[track_caller]
fn check(value: f64, expected: f64) {
    assert!((value - expected).abs() < 1e-9, "{value} is not {expected}");
}

#[test]
fn the_defaults_are_those_of_the_definitions() {
    let found = read(&standard(""));
    let parameters = found.material.parameters();
    assert_eq!((parameters.base_color, parameters.metallic, parameters.roughness), ([0.8; 3], 0.0, 0.2));
    assert_eq!((parameters.ior, parameters.specular, parameters.clearcoat), (1.5, 1.0, 0.0));
    assert_eq!((parameters.sheen, found.warnings), ([0.0; 3], Vec::<String>::new()));
    // The base of version 1.0.0 is 0.8 times white.
    let old = standard("").replace("name=\"S\" type", "name=\"S\" version=\"1.0.0\" type");
    assert_eq!(read(&old).material.parameters().base_color, [0.8; 3]);
    let old = old.replace("surfaceshader\">\n</", "surfaceshader\">\n<input name=\"base\" value=\"0.5\"/></");
    assert_eq!(read(&old).material.parameters().base_color, [0.5; 3]);

    let found = read(&open_pbr(""));
    let parameters = found.material.parameters();
    assert_eq!((parameters.base_color, parameters.roughness, parameters.specular), ([0.8; 3], 0.3, 1.0));
    check(parameters.ior, 1.5);
    assert_eq!(found.warnings, Vec::<String>::new());
}

#[test]
fn a_standard_surface_becomes_our_layers() {
    let text = standard(&inputs(&[
        ("base", "0.5"),
        ("base_color", "0.2, 0.4, 1"),
        ("specular", "0.7"),
        ("specular_color", "1, 0.5, 0.5"),
        ("specular_roughness", "0.4"),
        ("specular_IOR", "1.7"),
        ("coat", "0.5"),
        ("coat_color", "1, 0.5, 0"),
        ("coat_roughness", "0.2"),
        ("coat_affect_roughness", "1"),
        ("sheen", "0.5"),
        ("sheen_color", "1, 0, 0.5"),
        ("sheen_roughness", "0.36"),
    ]));
    let found = read(&text);
    let parameters = found.material.parameters();
    // The tint of the coat is 1, 0.75 and 0.5.
    parameters.base_color.iter().zip([0.1, 0.15, 0.25]).for_each(|(value, expected)| check(*value, expected));
    let specular = parameters.specular_color;
    specular.iter().zip([1.0, 0.375, 0.25]).for_each(|(value, expected)| check(*value, expected));
    check(parameters.roughness, 0.4 + 0.6 * 0.5 * 0.2);
    assert_eq!((parameters.ior, parameters.specular), (1.7, 0.7));
    assert_eq!((parameters.clearcoat, parameters.clearcoat_roughness), (0.5, 0.2));
    assert_eq!(parameters.sheen, [0.5, 0.0, 0.25]);
    check(parameters.sheen_roughness, 0.6);
    assert_eq!(found.warnings, Vec::<String>::new());
}

#[test]
fn an_open_pbr_surface_becomes_our_layers() {
    let metal = read(&open_pbr(&inputs(&[
        ("base_weight", "0.5"),
        ("base_color", "0.9, 0.6, 0.2"),
        ("base_metalness", "1"),
        ("specular_weight", "0.5"),
        ("specular_roughness", "0.25"),
        ("fuzz_weight", "0.5"),
        ("fuzz_color", "1, 1, 0"),
        ("fuzz_roughness", "0.6"),
    ])));
    let parameters = metal.material.parameters();
    parameters
        .base_color
        .iter()
        .zip([0.225, 0.15, 0.05])
        .for_each(|(value, expected)| check(*value, expected));
    assert_eq!((parameters.metallic, parameters.roughness, parameters.sheen), (1.0, 0.25, [0.5, 0.5, 0.0]));
    check(parameters.sheen_roughness, 0.6_f64.powf(1.25));
    assert_eq!(metal.warnings, Vec::<String>::new());

    // Half the weight is half of F_0, which has an index of its own.
    let parameters = read(&open_pbr(&input("specular_weight", "0.75"))).material.parameters();
    check(((parameters.ior - 1.0) / (parameters.ior + 1.0)).powi(2) * parameters.specular, 0.03);
    // Under a coat of the same index the base has no highlight; a rough coat blurs what is below it.
    let coated = read(&open_pbr(&inputs(&[
        ("specular_ior", "1.6"),
        ("coat_weight", "1"),
        ("coat_roughness", "0.5"),
        ("coat_ior", "1.6"),
    ])));
    let parameters = coated.material.parameters();
    assert_eq!((parameters.specular, parameters.clearcoat), (0.0, 1.0));
    check(parameters.roughness, (0.3_f64.powi(4) + 2.0 * 0.5_f64.powi(4)).powf(0.25));
    assert_eq!(
        coated.warnings,
        [
            "line 2: coat_darkening: the coat does not darken what is below it here",
            "line 6: coat_ior: the coat reflects as one of index 1.5",
        ]
    );
}

#[test]
fn what_is_left_out_is_named_with_its_line() {
    let text = standard(&inputs(&[
        ("transmission", "0.5"),
        ("subsurface", "0.5"),
        ("subsurface_color", "1, 0, 0"),
        ("thin_film_thickness", "500"),
        ("emission", "2"),
        ("opacity", "0.5, 0.5, 0.5"),
        ("specular_anisotropy", "0.5"),
        ("base_colour", "1, 1, 1"),
        ("specular_IOR", "0.5"),
        ("metalness", "1.5"),
    ]));
    let metal = read(&text);
    assert_eq!(
        metal.warnings,
        [
            "line 6: thin_film_thickness: the thin film is left out",
            "line 7: emission: emitted light is left out",
            "line 8: opacity: the material is opaque here",
            "line 9: specular_anisotropy: the highlight is not stretched here",
            "line 10: standard_surface has no input \"base_colour\", which is not read",
            "line 12: metalness: 1.5 is limited to 1",
        ]
    );
    let plastic = read(&text.replace("\"1.5\"", "\"0\""));
    assert_eq!(
        plastic.warnings[..2],
        [
            "line 3: transmission: light that passes through is left out, and the base is darker by its share",
            "line 4: subsurface: light that scatters below the surface leaves it where it entered",
        ]
    );
    let parameters = plastic.material.parameters();
    parameters.base_color.iter().zip([0.45, 0.2, 0.2]).for_each(|(value, expected)| check(*value, expected));
    assert_eq!(parameters.ior, 2.0);
}

#[test]
fn connected_values_are_followed_and_textures_are_named() {
    let graph = r#"<nodegraph name="NG">
<constant name="red" type="color3"><input name="value" type="color3" value="0.5, 0, 0" colorspace="srgb_texture"/></constant>
<tiledimage name="scratches" type="float"/>
<output name="colour" type="color3" nodename="red"/>
<output name="rough" type="float" nodename="scratches"/>
</nodegraph>
"#;
    let shader = standard(
        "<input name=\"base_color\" type=\"color3\" nodegraph=\"NG\" output=\"colour\"/>\n\
         <input name=\"specular_roughness\" type=\"float\" nodegraph=\"NG\" output=\"rough\"/>\n\
         <input name=\"normal\" type=\"vector3\" nodename=\"bumps\"/>\n",
    );
    let found = read(&shader.replace("<standard_surface", &format!("{graph}<standard_surface")));
    let parameters = found.material.parameters();
    assert!((parameters.base_color[0] - 0.2140).abs() < 1e-4 && parameters.base_color[1] == 0.0);
    assert_eq!(parameters.roughness, 0.2);
    assert_eq!(
        found.warnings,
        [
            "line 10: specular_roughness is <tiledimage> \"scratches\", which is not read; the default 0.2 is used",
            "line 11: normal is a node \"bumps\", which does not exist, which is not read",
        ]
    );
    // The space of a colour is that of the nearest element that has one.
    let of = |space: &str| {
        let text = standard(&input("base_color", "0.5, 0.4, 0.3"));
        read(&text.replace("\"1.39\"", &format!("\"1.39\" colorspace=\"{space}\"")))
    };
    let expected = ["line 3: base_color is in the colour space adobergb, and is taken as lin_rec709"];
    assert_eq!(of("adobergb").warnings, expected);
    // By the primaries of ACEScg and Rec. 709, and Bradford's transform.
    let (found, expected) = (of("acescg").material.parameters().base_color, [0.57883, 0.38803, 0.28230]);
    assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-4), "{found:?}");
}

#[test]
fn one_of_several_materials_is_chosen() {
    let two = standard("").replace(
        "</materialx>",
        "<open_pbr_surface name=\"O\"/><surfacematerial name=\"Metal\"><input name=\"surfaceshader\" \
         nodename=\"O\"/></surfacematerial></materialx>",
    );
    assert_eq!(error(&two), "the file has 2 materials; expected `material` to be one of: 0: Paint, 1: Metal");
    let chosen = |choice| read_materialx_material(two.as_bytes(), Some(&choice));
    assert_eq!(chosen(MaterialChoice::Name("Metal".into())).unwrap().material.parameters().roughness, 0.3);
    assert_eq!(chosen(MaterialChoice::Index(0)).unwrap().material.parameters().roughness, 0.2);
    let wrong = chosen(MaterialChoice::Name("Gold".into())).unwrap_err();
    assert_eq!(wrong.kind(), ErrorKind::NoSuchMaterial);
    // A shader without a material is one.
    let alone = "<materialx version=\"1.39\"><open_pbr_surface name=\"O\"/></materialx>";
    assert_eq!(read(alone).material.parameters().roughness, 0.3);
}

#[test]
fn bad_files_are_errors_with_their_lines() {
    let shader = standard(&input("base", "white"));
    for (text, expected) in [
        (shader.clone(), "line 3: base is \"white\"; expected a number"),
        (
            standard(&input("base_color", "1, 2")),
            "line 3: base_color is \"1, 2\"; expected three numbers, such as \"0.8, 0.2, 0.1\"",
        ),
        (standard(&input("base", "NaN")), "line 3: base is \"NaN\"; expected a number"),
        (
            standard("").replace("standard_surface", "gltf_pbr"),
            "line 2: the surface shader of \"Paint\" is <gltf_pbr>; expected <standard_surface> or <open_pbr_surface>",
        ),
        (
            standard("").replace("nodename=\"S\"", "nodename=\"T\""),
            "line 4: the surface shader of \"Paint\" is a node \"T\", which does not exist",
        ),
        (standard("").replace("surfaceshader\" type", "x\" type"), "line 4: \"Paint\" has no surface shader"),
        ("<a/>".into(), "the root element is <a>; expected <materialx>"),
        (
            "<materialx/>".into(),
            "the file has no <surfacematerial>, <standard_surface> or <open_pbr_surface>",
        ),
        (
            "<materialx xmlns:xi=\"http://www.w3.org/2001/XInclude\"><xi:include href=\"a.mtlx\"/></materialx>".into(),
            "the file has no <surfacematerial>, <standard_surface> or <open_pbr_surface>; it includes a.mtlx, which can \
             be named itself",
        ),
        (
            "<materialx>\n<material name=\"M\"/></materialx>".into(),
            "line 2: <material> is of MaterialX before 1.38; expected <surfacematerial>",
        ),
    ] {
        assert_eq!(error(&text), expected);
    }
    for (text, begin) in [
        ("<materialx>\n<a></b></materialx>", "line 2, column "),
        ("", "line 1, column 1: not valid XML: "),
        ("<!DOCTYPE a [<!ENTITY b \"c\">]><materialx/>", "line 1, column 1: not valid XML: "),
    ] {
        assert!(error(text).starts_with(begin), "{}", error(text));
    }
    assert_eq!(read_materialx_material(&[0xff], None).unwrap_err().to_string(), "the text is not UTF-8");
    // A file may end anywhere.
    for end in 0..shader.len() {
        assert!(read_materialx_material(&shader.as_bytes()[..end], None).is_err());
    }
    // Nodes that pass a value on in a circle.
    let circle = standard("<input name=\"base\" type=\"float\" nodename=\"a\"/>").replace(
        "<standard_surface",
        "<dot name=\"a\"><input name=\"in\" nodename=\"b\"/></dot><dot name=\"b\"><input name=\"in\" \
         nodename=\"a\"/></dot><standard_surface",
    );
    assert_eq!(read(&circle).warnings.len(), 1);
}
