//! Rules that hold for every kind of the list.

use std::collections::HashSet;

use engine::{Product, Table, ValueKind};

use crate::fixture::kinds;

/// The TOML blocks of a manual, each with its stage tables.
fn examples(manual: &str) -> Vec<Table> {
    let blocks = manual.split("```toml\n").skip(1);
    blocks.map(|block| Table::parse(block.split("```").next().unwrap()).unwrap()).collect()
}

/// The keys of a stage that the engine owns.
const OWNED: [&str; 6] = ["kind", "source", "input", "inputs", "path", "per"];

#[test]
fn names_are_unique_and_in_kebab_case() {
    let kinds = kinds();
    let names: HashSet<_> = kinds.iter().map(|kind| kind.name()).collect();
    assert_eq!(names.len(), kinds.iter().count());
    assert!(names.iter().all(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '-')), "{names:?}");
}

#[test]
fn every_manual_has_an_example_that_parses_with_its_kind() {
    for kind in kinds().iter() {
        let mut found = 0;
        for example in examples(&kind.manual()) {
            let Some(entry) = example.get("stage") else { continue };
            let ValueKind::Table(stages) = &entry.value.kind else { panic!("{}: stage", kind.name()) };
            for stage in &stages.entries {
                let ValueKind::Table(table) = &stage.value.kind else { panic!("{}: stage", kind.name()) };
                let name = &table.get("kind").unwrap().value.kind;
                assert_eq!(*name, ValueKind::String(kind.name().into()));
                let is_built_in = kind.built_in_parameter().is_some_and(|name| table.get(name).is_some());
                let reads = table.get("source").is_some() || is_built_in;
                assert_eq!(reads, kind.has_source(), "{}", kind.name());
                let own = table.entries.iter().filter(|entry| !OWNED.contains(&entry.key.as_str()));
                let parameters = Table { span: table.span.clone(), entries: own.cloned().collect() };
                let errors = kind.configure(&parameters).err();
                assert!(errors.is_none(), "{}: {errors:?}", kind.name());
                if let Some(inputs) = table.get("inputs") {
                    let ValueKind::Table(inputs) = &inputs.value.kind else { panic!("inputs") };
                    let names: Vec<_> = inputs.entries.iter().map(|entry| entry.key.as_str()).collect();
                    let ports: Vec<_> = kind.ports_named(&names).into_iter().map(|port| port.name).collect();
                    assert!(inputs.entries.iter().all(|entry| ports.contains(&entry.key)));
                }
                found += 1;
            }
        }
        assert!(found > 0, "the manual of {} has no example", kind.name());
    }
}

#[test]
fn every_manual_begins_with_a_sentence() {
    for kind in kinds().iter() {
        let manual = kind.manual();
        let first = manual.split("\n\n").next().unwrap();
        assert!(first.ends_with('.') && first.len() < 200 && !first.starts_with('#'), "{first}");
        assert!(kind.revision() > 0);
    }
}

#[test]
fn no_parameter_has_the_name_of_a_key_that_the_engine_owns() {
    for kind in kinds().iter() {
        for field in kind.fields() {
            let owned = ["kind", "source", "input", "inputs", "per", "path"].contains(&field.name.as_str());
            assert!(!owned, "{}: the engine would hide {:?}", kind.name(), field.name);
        }
    }
}

#[test]
fn a_key_that_was_renamed_is_an_error_that_names_the_new_one() {
    let mut renamed = Vec::new();
    for kind in kinds().iter() {
        let fields = kind.fields();
        for (was, field) in fields.iter().filter_map(|field| Some((field.was?, field))) {
            assert!(fields.iter().all(|field| field.name != was), "{}: {was} is a key", kind.name());
            let errors = kind.configure(&Table::parse(&format!("{was} = 1")).unwrap()).err().unwrap();
            let [error] = &errors[..] else { panic!("{}: {errors:?}", kind.name()) };
            assert_eq!(error.message, format!("unknown key {was:?}"));
            assert_eq!(error.help, Some(format!("it is now called {:?}", field.name)));
            renamed.push(format!("{}: {was} -> {}", kind.name(), field.name));
        }
    }
    renamed.sort();
    let expected = [
        "circular-lights: lights -> lamps",
        "dfg: size -> resolution",
        "export-light-rig: rows -> resolution",
        "reference: rows -> environment-resolution",
    ];
    assert_eq!(renamed, expected);
}

#[test]
fn every_parameter_is_documented() {
    for kind in kinds().iter() {
        for field in kind.fields() {
            assert!(field.doc.len() > 10 && field.doc.ends_with('.'), "{} {}", kind.name(), field.name);
        }
    }
}

/// The product of a kind with its defaults, for each type that may arrive at its first port; none if its user
/// chooses the product.
fn products(kind: &dyn engine::ErasedKind) -> Vec<Product> {
    if kind.name() == "exec" {
        return Vec::new();
    }
    let configured = kind.configure(&Table::default()).unwrap();
    let Some(first) = kind.ports().into_iter().next() else { return vec![configured.product(&[])] };
    first.types().map(|arrives| configured.product(&[(&first.name, arrives)])).collect()
}

#[test]
fn every_type_that_a_port_takes_has_a_producer() {
    let kinds = kinds();
    let made: HashSet<_> =
        kinds.iter().flat_map(|kind| products(kind.as_ref())).map(|product| product.type_name()).collect();
    for kind in kinds.iter() {
        for port in kind.ports() {
            assert!(port.types().all(|name| made.contains(name)), "{} {}", kind.name(), port.name);
        }
    }
}

#[test]
fn every_default_is_in_its_range() {
    for kind in kinds().iter() {
        for field in kind.fields() {
            let Some(default) = field.default.as_ref().and_then(serde_json::Value::as_f64) else { continue };
            let bound = |name: &str| field.schema[name].as_f64();
            let is_inside = bound("minimum").is_none_or(|least| default >= least)
                && bound("maximum").is_none_or(|most| default <= most)
                && bound("exclusiveMinimum").is_none_or(|least| default > least)
                && bound("exclusiveMaximum").is_none_or(|most| default < most);
            assert!(is_inside, "{} {}: {default}", kind.name(), field.name);
        }
    }
}

#[test]
fn every_default_is_one_of_its_words() {
    for kind in kinds().iter() {
        for field in kind.fields() {
            let (Some(words), Some(default)) = (field.schema["enum"].as_array(), &field.default) else {
                continue;
            };
            let is_one = default.is_null() || words.contains(default);
            assert!(is_one, "{} {}: {default}", kind.name(), field.name);
        }
    }
}

#[test]
fn the_schema_has_ranges_and_the_words_of_kernels() {
    let schema = kinds().schema();
    let parameter = |kind: &str, name: &str| schema["$defs"][kind]["properties"][name].clone();
    let resolution = parameter("import-environment", "resolution");
    assert_eq!((&resolution["minimum"], &resolution["maximum"]), (&1.into(), &8192.into()));
    let tolerance = parameter("project-brdf", "tolerance");
    assert_eq!((&tolerance["exclusiveMinimum"], &tolerance["exclusiveMaximum"]), (&0.into(), &1.into()));
    let layouts = envmap::Layout::ALL.map(envmap::Layout::name);
    let words = parameter("import-environment", "layout")["enum"].clone();
    let words: Vec<_> =
        words.as_array().unwrap().iter().map(|word| word.as_str().unwrap().to_owned()).collect();
    assert!(layouts.iter().chain(&["auto"]).all(|name| words.iter().any(|word| word == name)), "{words:?}");
    assert_eq!(words.len(), layouts.len() + 1);
}
