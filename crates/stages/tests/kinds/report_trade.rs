//! The report's trade of error against bytes and look-ups.

use envmap::Environment as Map;
use serde_json::Value;
use stages::artifacts::Environment;

use crate::fixture::{case, environment, lambert, phong, sky};
use crate::report::{
    SMALL, TRADE, check_page, export, microfacet, points, report, series, stops, with_environment,
    with_material,
};

fn number(value: &Value, name: &str) -> usize {
    value[name].as_u64().unwrap() as usize
}

/// A dim sky with ten lamps of a texel each, some stronger than others.
fn lamps() -> Environment {
    let map = environment(32, |w| [0.5 + 0.2 * w.z, 0.6 + 0.2 * w.z, 0.8 + 0.3 * w.z]).0;
    let (grid, mut pixels) = (map.grid(), map.pixels().to_vec());
    for lamp in 0..10 {
        pixels[(6 + 2 * (lamp % 5)) * grid.width + 6 * lamp] = [800.0 + 150.0 * lamp as f32; 3];
    }
    Environment(Map::new(grid, pixels).unwrap())
}

/// The chart's points, the table and the JSON file have the same numbers; the costs are those of the formats.
#[test]
fn the_trade_has_every_technique_at_every_degree() {
    let case = case("report", TRADE).keyed_input("environment", &[("environment", "lamps")], lamps());
    let case = with_material(case, "satin", microfacet(0.4));
    let (json, page) = report(&case);
    check_page(&page);
    let pair = &json["pairs"][0];
    assert_eq!(pair["lamps"], 10);
    let found: Vec<_> = series(pair)
        .iter()
        .map(|series| {
            let degrees: Vec<_> = points(series).iter().map(|point| point["degree"].as_u64()).collect();
            (series["technique"].as_str().unwrap(), number(series, "lights"), degrees)
        })
        .collect();
    let of = |degrees: &[u64]| degrees.iter().map(|degree| Some(*degree)).collect::<Vec<_>>();
    let (p, j) = (of(&[0, 1, 2, 3, 4, 6, 8, 16]), of(&[1, 2, 3, 4, 6, 8]));
    let expected = [
        ("reflection-map", 0, vec![None]),
        ("split-sum", 0, vec![None]),
        ("kautz-mccool", 0, vec![None]),
        ("cabral", 0, vec![None]),
        ("shrm", 0, p.clone()),
        ("shrm-separate", 10, p),
        ("components", 10, of(&[4, 8, 16])),
        ("taps", 0, j.clone()),
        ("taps", 4, j.clone()),
        ("taps", 8, j.clone()),
        ("taps", 10, j),
    ];
    assert_eq!(found, expected);
    for series in series(pair) {
        let (technique, lights) = (series["technique"].as_str().unwrap(), number(series, "lights"));
        for point in points(series) {
            let [p95, p99] = stops(point);
            let (bytes, fetches) = (number(point, "bytes"), number(point, "fetches"));
            let degree = point["degree"].as_u64().map(|degree| degree as usize);
            // The title of a point in both charts, and the row of the table.
            let said = format!("{p95:.3} and {p99:.3} stops, ");
            assert!(page.matches(&said).count() >= 2, "{said}");
            let cell =
                |mark: &str| format!("number{mark}\">{p95:.3}</td><td class=\"number{mark}\">{p99:.3}</td>");
            assert!(page.contains(&cell("")) || page.contains(&cell(" pick")), "{p95} {p99}");
            let texels = 8 * 6 * 12 * 12;
            match (technique, degree) {
                ("shrm", Some(p)) => assert_eq!((bytes, fetches), ((p + 1).pow(2) * texels, (p + 1).pow(2))),
                ("shrm-separate", Some(p)) => {
                    assert_eq!((bytes, fetches), ((p + 1).pow(2) * texels + 28 * lights, (p + 1).pow(2)));
                }
                ("components", Some(k)) => {
                    assert_eq!((bytes, fetches), (8 * 6 * 34 * 34 * k + 28 * lights, k + k / 4));
                }
                ("taps", Some(j)) => assert!(fetches == 2 * (j + 1) && bytes < 600_000, "{point}"),
                ("reflection-map", None) => assert_eq!((bytes, fetches), (texels, 1)),
                ("split-sum", None) => assert_eq!((bytes, fetches), (8 * 6 * (144 + 36 + 9 + 1), 2)),
                ("kautz-mccool", None) => assert_eq!((bytes, fetches), (16 * 24 * 48 * 8, 2)),
                ("cabral", None) => assert_eq!((bytes, fetches), (12 * texels, 3)),
                other => panic!("{other:?}"),
            }
        }
    }
    // Techniques of one degree are the exports of the same name.
    for method in ["reflection-map", "kautz-mccool", "cabral"] {
        let own = series(pair).iter().find(|series| series["technique"] == method).unwrap();
        assert_eq!(stops(&points(own)[0]), stops(export(pair, method)));
    }
    // At the reflection's own degree an SHRM of the trade is the export.
    let separate = series(pair).iter().find(|series| series["technique"] == "shrm-separate").unwrap();
    let own = export(pair, "shrm-separate");
    if let Some(point) = points(separate).iter().find(|point| point["degree"] == own["p"]) {
        assert!((stops(point)[0] - stops(own)[0]).abs() < 1e-4, "{point} {own}");
    }
    // The error of an SHRM falls with P, that of components with K, and that of taps with lights.
    for technique in ["shrm-separate", "components"] {
        let own = series(pair).iter().find(|series| series["technique"] == technique).unwrap();
        let errors: Vec<f64> = points(own).iter().map(|point| stops(point)[0]).collect();
        // As far as look-ups in maps of 12 texels allow.
        assert!(errors.windows(2).all(|pair| pair[1] <= 1.05 * pair[0] + 0.01), "{technique}: {errors:?}");
        assert!(errors[errors.len() - 1] < 0.8 * errors[0], "{technique}: {errors:?}");
    }
    let taps: Vec<_> = series(pair).iter().filter(|series| series["technique"] == "taps").collect();
    let error = |lights: usize, taps_of: usize| stops(&points(taps[lights])[taps_of])[0];
    assert!(error(3, 3) < 0.1 && error(3, 3) < 0.5 * error(0, 3), "{} {}", error(0, 3), error(3, 3));
    // The advice is the cheapest that is within 0.1 and 0.25 stops.
    let good = taps.iter().flat_map(|series| {
        let lights = number(series, "lights");
        points(series).iter().map(move |point| (lights, point))
    });
    let good = good.filter(|(_, point)| {
        let [p95, p99] = stops(point);
        p95 <= 0.1 && p99 <= 0.25
    });
    let (lights, point) =
        good.min_by_key(|(lights, point)| 20 * number(point, "degree") + 35 * lights).unwrap();
    let advice = &pair["trade"]["advice"];
    assert_eq!((number(advice, "lights"), &advice["taps"]), (lights, &point["degree"]));
    assert_eq!((stops(advice), &advice["good"]), (stops(point), &true.into()));
    let text = advice["text"].as_str().unwrap();
    assert!(page.contains(text), "{text}");
    assert!(text.contains(&format!("within {:.2} stops", stops(point)[0])), "{text}");
}

/// Without lamps there is one SHRM and one line of taps; a matte surface needs no degree.
#[test]
fn the_trade_of_light_without_lamps_has_no_lights() {
    let both = with_environment(case("report", TRADE), "day", sky);
    let both = with_material(with_material(both, "chalk", lambert(0.8)), "lacquer", {
        brdf::Material::layers(vec![lambert(0.6), phong(20.0)]).unwrap()
    });
    let (json, page) = report(&both);
    check_page(&page);
    let [chalk, lacquer] = [0, 1].map(|index| &json["pairs"][index]);
    for pair in [chalk, lacquer] {
        assert!(series(pair).iter().all(|series| series["lights"] == 0), "{pair}");
        let of =
            |technique: &str| series(pair).iter().filter(|series| series["technique"] == technique).count();
        assert_eq!(["shrm", "shrm-separate", "taps", "split-sum", "components"].map(of), [1, 0, 1, 1, 1]);
    }
    let degrees = |pair: &Value, technique: &str| -> Vec<u64> {
        let own = series(pair).iter().find(|series| series["technique"] == technique).unwrap();
        points(own).iter().map(|point| point["degree"].as_u64().unwrap()).collect()
    };
    assert_eq!((degrees(chalk, "shrm"), degrees(chalk, "taps")), (vec![0], vec![0]));
    assert_eq!(degrees(lacquer, "taps").len(), 6);
    // The split sum of a matte surface is its irradiance, and a map of each part is there for two parts.
    let split = series(chalk).iter().find(|series| series["technique"] == "split-sum").unwrap();
    assert!(stops(&points(split)[0])[1] < 0.05, "{split}");
    assert!(series(lacquer).iter().any(|series| series["technique"] == "part-maps"));
    // `trade = false` leaves the trade out.
    let off = with_environment(case("report", SMALL), "day", sky);
    let (json, page) = report(&with_material(off, "chalk", lambert(0.8)));
    assert!(json["pairs"][0]["trade"].is_null() && !page.contains("fetches"));
}

/// A sphere of brushed metal is brushed, and taps alone know the direction: there are those of `fit-taps`.
#[test]
fn taps_of_brushed_metal_know_its_tangent() {
    let brushed = brdf::Material::Ward(brdf::Ward::new([0.2, 0.5], [0.6, 0.5, 0.3]).unwrap());
    let case = case("report", TRADE).keyed_input("environment", &[("environment", "lamps")], lamps());
    let (json, page) = report(&with_material(case, "brushed", brushed));
    check_page(&page);
    let pair = &json["pairs"][0];
    let [compact, _] = stops(export(pair, "taps"));
    for method in ["reflection-map", "kautz-mccool", "cabral", "shrm", "shrm-separate"] {
        let [other, _] = stops(export(pair, method));
        assert!(other > 3.0 * compact, "{method}: {other} {compact}");
    }
    let taps: Vec<_> = series(pair).iter().filter(|series| series["technique"] == "taps").collect();
    assert_eq!(taps.iter().map(|series| number(series, "lights")).collect::<Vec<_>>(), [0, 4, 8, 10]);
    for series in &taps {
        for (point, taps) in points(series).iter().zip([4, 8]) {
            assert_eq!(number(point, "degree"), taps);
            assert_eq!(number(point, "fetches"), 2 * (taps + 1));
            // 25 x 25 nodes of two texels of four halves for each tap, and one for that about the normal.
            let (table, lights) = (8 * 625 * (2 * taps + 1), 28 * number(series, "lights"));
            assert!((table + lights..600_000 + table).contains(&number(point, "bytes")), "{point}");
        }
    }
    let error = |lights: usize| stops(&points(taps[lights])[1])[0];
    assert!(error(3) < 0.25 && error(3) < 0.5 * error(0), "{} {}", error(0), error(3));
}
