//! Light fields in the window's catalog.

use std::sync::Arc;

use preview::Mode;
use stages::{PreviewCatalog, SceneCache};

use crate::preview_catalog::{build, described, shaded, stage_name, tabulated};

#[test]
fn a_table_is_shown_under_a_light_field() {
    let stages = "[stage.near]\nkind = \"light-field\"\ninputs = { lightings = \"lighting\" }\n\
                  points = { north = [1, 0, 0.5], east = [0, 1, 0.5] }\n";
    let (_folder, plan) = tabulated(&format!("{stages}{}", shaded("seen", "near")));
    let catalog = PreviewCatalog::of(plan.clone());
    assert_eq!(described(&catalog), "steel under east: table -> \n");
    let entry = catalog.entry("east", "steel").unwrap().unwrap();
    let field = entry.light_field.unwrap();
    let lightings: Vec<_> =
        entry.ancestry.iter().filter(|item| stage_name(catalog.plan(), **item) == "lighting").collect();
    assert!(lightings.len() == 2 && entry.maps.contains(&field), "{lightings:?}");
    let results = build(&plan);
    let mut scenes = SceneCache::default();
    let scene = scenes.scene(&catalog, &results, entry, "plane").unwrap();
    assert_eq!(scene.objects[0].look.light_field().unwrap().points().len(), 2);
    assert!(scene.offers(Mode::Table));
    let again = scenes.scene(&catalog, &results, entry, "plane").unwrap();
    assert!(Arc::ptr_eq(&scene.objects[0].look, &again.objects[0].look));
}
