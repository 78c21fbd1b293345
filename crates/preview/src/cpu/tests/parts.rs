//! A mesh of several materials, which is drawn as several objects.

use mesh::MaterialRange;

use super::*;
use crate::ScenePart;

/// A knot of which every third triangle is of another material.
fn striped() -> Arc<Mesh> {
    let knot = mesh::shape("torus-knot").unwrap();
    let triangles = knot.triangles().len();
    let range =
        |triangle: usize| MaterialRange { material: triangle.is_multiple_of(3).then_some(0), triangles: 1 };
    let ranges: Vec<MaterialRange> = (0..triangles).map(range).collect();
    Arc::new(knot.with_materials(vec!["stripe".to_owned()], &ranges).unwrap())
}

fn in_parts(whole: &Arc<Mesh>, looks: [&Arc<Look>; 2]) -> Scene {
    let part = |(material, look): (Option<u32>, &Arc<Look>)| ScenePart {
        mesh: Arc::new(whole.of_materials(|of| of == material).0),
        look: Arc::clone(look),
        transfer: None,
        blend: None,
    };
    let parts = [Some(0), None].into_iter().zip(looks).map(part).collect();
    Scene::of_parts(whole, Arc::clone(looks[0].light()), parts)
}

/// In one look the parts are the whole, with the shadows of all of it on each.
#[test]
fn parts_in_one_look_are_the_whole() {
    let look = look(&light(16, uneven), &microfacet(0.4), [4, 4]);
    let whole = striped();
    let (one, parts) = (Scene::of(Arc::clone(&whole), Arc::clone(&look)), in_parts(&whole, [&look, &look]));
    assert_eq!(parts.framing(), one.framing());
    for mode in [Mode::LocalShrm, Mode::ShadowedBruteForce] {
        let shot = shot([40, 40], Show::One(mode));
        assert_eq!(render(&parts, &shot).codes, render(&one, &shot).codes, "{mode:?}");
    }
}

/// Each pixel is one of the whole in either look, except where it shows both.
#[test]
fn every_part_has_its_own_look() {
    let light = light(16, uneven);
    let looks = [0.2, 0.9].map(|albedo| look(&light, &lambert(albedo), [4, 0]));
    let whole = striped();
    let shot = shot([80, 80], Show::One(Mode::LocalShrm));
    let parts = render(&in_parts(&whole, [&looks[0], &looks[1]]), &shot);
    let [dark, bright] =
        looks.each_ref().map(|look| render(&Scene::of(Arc::clone(&whole), Arc::clone(look)), &shot));
    let (mut as_dark, mut as_bright) = (0, 0);
    for (pixel, found) in parts.radiance.iter().enumerate().filter(|(_, found)| found[3] > 0.0) {
        let is_dark = *found == dark.radiance[pixel];
        assert!(is_dark || *found == bright.radiance[pixel], "{found:?}");
        *(if is_dark { &mut as_dark } else { &mut as_bright }) += 1;
    }
    assert!(as_dark > 200 && as_bright > 2 * as_dark / 3, "{as_dark} {as_bright}");
}
