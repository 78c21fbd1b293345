//! Parameters of every type are parsed, refused with their places, and described.

use std::ops::Bound;

use expect_test::{Expect, expect};
use serde_json::json;

use super::*;
use crate::choice;
use crate::manifest::diagnostic::Diagnostics;
use crate::manifest::range::OrAuto;
use crate::testkit::shown;

choice! {
    /// A filter.
    enum Filter {
        /// Nothing is done.
        None = "none",
        /// A raised cosine.
        Hanning = "hanning",
        /// A sinc.
        Lanczos = "lanczos",
    }
}

parameters! {
    /// Parameters of a test.
    struct Everything {
        /// How much.
        exposure: f64 = 0.0,
        /// How many.
        /// Or how few.
        count: usize,
        /// Whether to mirror.
        mirrored: bool = false,
        /// What it is called.
        layer_name: Option<String> = None,
        /// The weights.
        weights: Vec<f64> = vec![1.0, 2.0],
        /// The filter.
        filter: Filter = Filter::None,
        /// Samples of a pixel.
        #[range(1..=64)]
        samples: OrAuto<usize> = OrAuto::Auto,
        /// The share that may be lost.
        #[range((Bound::Excluded(0.0), Bound::Excluded(1.0)))]
        share: Option<f64> = None,
        /// The filter of the edges.
        #[words(Filter::Lanczos, Filter::None)]
        edges: Filter = Filter::None,
        /// What colours are multiplied with.
        #[range(0.0..)]
        #[was("gain")]
        scale: f64 = 1.0,
    }
}

parameters! {
    /// Parameters that several kinds share.
    struct Shared {
        /// The depth.
        #[range(1..)]
        #[was("thickness")]
        depth: usize = 2,
        /// The name.
        name: String,
    }
}

parameters! {
    /// Parameters of a kind.
    struct Whole {
        /// The width.
        width: usize = 1,
        ..shared: Shared,
    }
}

fn parse(text: &str) -> Result<Everything, Diagnostics> {
    let table = Table::parse(text).unwrap();
    let mut errors = Vec::new();
    let parsed = Everything::parse(&table, &mut errors);
    assert_eq!(parsed.is_none(), !errors.is_empty());
    parsed.ok_or_else(|| Diagnostics::new("x.toml", text, errors))
}

#[test]
fn canonical_json_is_read_back() {
    let given = "count = 0\nexposure = -1\nmirrored = true\nlayer-name = \"a\"\nweights = [3, 0.5]\nfilter = \"lanczos\"\n\
                 samples = 64\nshare = 0.5\nedges = \"lanczos\"\nscale = 1e300";
    for text in ["count = 3", given] {
        let parsed = parse(text).unwrap();
        assert_eq!(Everything::from_canonical(&parsed.canonical()), Some(parsed), "{text}");
    }
    let whole = Whole { width: 5, shared: Shared { depth: 3, name: "n".into() } };
    assert_eq!(Whole::from_canonical(&whole.canonical()), Some(whole));
    for other in [json!(3), json!({}), json!({ "count": 3, "size": 1 }), json!({ "count": -1 })] {
        assert_eq!(Everything::from_canonical(&other), None, "{other}");
    }
}

fn check(text: &str, expected: Expect) {
    expected.assert_eq(&shown(&parse(text).unwrap_err()));
}

#[test]
fn defaults_are_filled_in() {
    let parsed = parse("count = 3").unwrap();
    let expected = Everything {
        exposure: 0.0,
        count: 3,
        mirrored: false,
        layer_name: None,
        weights: vec![1.0, 2.0],
        filter: Filter::None,
        samples: OrAuto::Auto,
        share: None,
        edges: Filter::None,
        scale: 1.0,
    };
    assert_eq!(parsed, expected);
    let text = "count = 0\nexposure = -1\nmirrored = true\nlayer-name = \"a\"\nweights = []\nfilter = \"lanczos\"\n\
                samples = 64\nshare = 0.5\nedges = \"lanczos\"\nscale = 0";
    let expected = Everything {
        exposure: -1.0,
        count: 0,
        mirrored: true,
        layer_name: Some("a".into()),
        weights: vec![],
        filter: Filter::Lanczos,
        samples: OrAuto::Fixed(64),
        share: Some(0.5),
        edges: Filter::Lanczos,
        scale: 0.0,
    };
    assert_eq!(parse(text).unwrap(), expected);
}

#[test]
fn every_error_has_its_place() {
    check(
        "exposure = \"much\"\ncount = -1\nmirored = true\nlayer-name = 3\nweights = [1, \"two\"]\nfilter = \"hannin\"\nq = 1",
        expect![[r#"
            1:12 exposure: "much" is not a finite number | expected a finite number
            2:9 count: -1 is not a whole number, 0 or more | expected a whole number, 0 or more
            3:1 unknown key "mirored" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale | did you mean "mirrored"?
            4:14 layer-name: 3 is not a string | expected a string
            5:15 weights: "two" is not a finite number | expected a finite number
            6:10 filter: "hannin" is not "none" or "hanning" or "lanczos" | expected "none" or "hanning" or "lanczos" | did you mean "hanning"?
            7:1 unknown key "q" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale
        "#]],
    );
    check(
        "count = 1.0\nexposure = nan\nmirrored = 1\nweights = 1\nfilter = 2024-01-01",
        expect![[r#"
            1:9 count: 1.0 is not a whole number, 0 or more | expected a whole number, 0 or more
            2:12 exposure: NaN is not a finite number | expected a finite number
            3:12 mirrored: 1 is not true or false | expected true or false
            4:11 weights: 1 is not an array, each a finite number | expected an array, each a finite number
            5:10 filter: the date 2024-01-01 is not "none" or "hanning" or "lanczos" | expected "none" or "hanning" or "lanczos"
        "#]],
    );
    check(
        "",
        expect![[r#"
        1:1 "count" is missing | expected count = a whole number, 0 or more
    "#]],
    );
    check(
        "count = 1\nlayer_name = \"a\"",
        expect![[r#"
        2:1 unknown key "layer_name" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale | did you mean "layer-name"?
    "#]],
    );
}

#[test]
fn a_key_that_was_renamed_is_an_error_that_names_the_new_one() {
    check(
        "count = 1\ngain = 2",
        expect![[r#"
            2:1 unknown key "gain" | expected one of: exposure, count, mirrored, layer-name, weights, filter, samples, share, edges, scale | it is now called "scale"
        "#]],
    );
}

#[test]
fn numbers_outside_their_range_are_errors() {
    check(
        "count = 1\nsamples = 65\nshare = 1\nscale = -0.5",
        expect![[r#"
        2:11 samples: 65 is not a whole number from 1 to 64 or "auto" | expected a whole number from 1 to 64 or "auto"
        3:9 share: 1 is not a number above 0 and below 1 | expected a number above 0 and below 1
        4:9 scale: -0.5 is not a number, 0 or more | expected a number, 0 or more
    "#]],
    );
    check(
        "count = 1\nsamples = \"autp\"\nshare = \"half\"\nscale = nan",
        expect![[r#"
        2:11 samples: "autp" is not a whole number from 1 to 64 or "auto" | expected a whole number from 1 to 64 or "auto" | did you mean "auto"?
        3:9 share: "half" is not a number above 0 and below 1 | expected a number above 0 and below 1
        4:9 scale: NaN is not a number, 0 or more | expected a number, 0 or more
    "#]],
    );
}

#[test]
fn shared_parameters_are_parameters_like_others() {
    let parse = |text: &str| {
        let mut errors = Vec::new();
        let parsed = Whole::parse(&Table::parse(text).unwrap(), &mut errors);
        parsed.ok_or_else(|| shown(&Diagnostics::new("x.toml", text, errors)))
    };
    let parsed = parse("width = 5\nname = \"a\"").unwrap();
    assert_eq!(parsed, Whole { width: 5, shared: Shared { depth: 2, name: "a".into() } });
    assert_eq!(parsed.canonical(), json!({ "depth": 2, "name": "a", "width": 5 }));
    let names = Whole::fields().into_iter().map(|field| field.name);
    assert_eq!(names.collect::<Vec<_>>(), ["width", "depth", "name"]);
    expect![[r#"
        1:1 unknown key "thickness" | expected one of: width, depth, name | it is now called "depth"
        1:1 "name" is missing | expected name = a string
        2:9 depth: 0 is not a whole number, 1 or more | expected a whole number, 1 or more
    "#]]
    .assert_eq(&parse("thickness = 3\ndepth = 0").unwrap_err());
}

#[test]
fn a_choice_may_be_limited_to_some_of_its_words() {
    check(
        "count = 1\nedges = \"hanning\"",
        expect![[r#"
            2:9 edges: "hanning" is not "lanczos" or "none" | expected "lanczos" or "none"
        "#]],
    );
    check(
        "count = 1\nedges = \"lanczo\"",
        expect![[r#"
            2:9 edges: "lanczo" is not "lanczos" or "none" | expected "lanczos" or "none" | did you mean "lanczos"?
        "#]],
    );
    let edges = Everything::fields().into_iter().find(|field| field.name == "edges").unwrap();
    assert_eq!(edges.expected, "\"lanczos\" or \"none\"");
    assert_eq!(edges.schema["enum"], json!(["lanczos", "none"]));
}

#[test]
fn ranges_are_in_the_schema() {
    let ranged = ["samples", "share", "scale"];
    let fields = Everything::fields().into_iter().filter(|field| ranged.contains(&field.name.as_str()));
    let schemas = fields.map(|field| field.schema);
    let expected = [
        json!({ "type": ["integer", "string"], "minimum": 1, "maximum": 64, "pattern": "^auto$" }),
        json!({ "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1 }),
        json!({ "type": "number", "minimum": 0 }),
    ];
    assert_eq!(schemas.collect::<Vec<_>>(), expected);
}

#[test]
fn equal_parameters_have_one_canonical_form() {
    let canonical = |text: &str| parse(text).unwrap().canonical().to_string();
    let whole = canonical("count = 1\nexposure = 30\nweights = [0]");
    assert_eq!(whole, canonical("weights = [-0.0]\nexposure = 3e1\ncount = 0x1\nfilter = \"none\""));
    assert_ne!(whole, canonical("count = 1\nexposure = 30.000000000000004\nweights = [0]"));
    assert_eq!(
        parse("count = 2").unwrap().canonical(),
        json!({
            "count": 2, "edges": "none", "exposure": 0.0, "filter": "none", "layer-name": null, "mirrored": false,
            "samples": "auto", "scale": 1.0, "share": null, "weights": [1.0, 2.0],
        })
    );
}

#[test]
fn the_manual_has_every_field() {
    let fields = Everything::fields();
    let names: Vec<_> = fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "exposure",
            "count",
            "mirrored",
            "layer-name",
            "weights",
            "filter",
            "samples",
            "share",
            "edges",
            "scale"
        ]
    );
    assert_eq!(fields[1].doc, "How many. Or how few.");
    assert_eq!(fields[1].default, None);
    assert_eq!(fields[3].default, Some(serde_json::Value::Null));
    assert_eq!(fields[5].expected, "\"none\" or \"hanning\" or \"lanczos\"");
    assert_eq!(fields[5].default, Some(json!("none")));
}
