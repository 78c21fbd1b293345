//! Bad input ends with a message that says what is wrong, where, and what to do.

use engine::Cancel;
use probes::{Lattice, PlacesParts, Repair, Volume};
use serde_json::json;
use stages::artifacts::{ProbePlaces, ProbeTransport, Scene};

use crate::fixture::{case, part};
use crate::relighting::Baked;
use crate::room::Room;

#[test]
fn files_that_are_no_scene_say_why() {
    let failure = |change: fn(&mut serde_json::Value)| Room::new().with(change).import("").failure();
    let no_mesh = failure(|json| json["scenes"][0]["nodes"] = json!([3, 4]));
    let expected =
        "cannot import room.gltf: the scene has no triangles; expected a mesh in a node of the scene";
    assert_eq!(no_mesh, expected);
    let missing = failure(|json| json["buffers"][0]["uri"] = json!("gone.bin"));
    assert!(missing.starts_with("cannot import room.gltf: ") && missing.contains("gone.bin"), "{missing}");
    let flat = failure(|json| {
        json["scenes"][0]["nodes"] = json!([0]);
        json["nodes"][0]["scale"] = json!([1, 0, 0]);
    });
    assert_eq!(flat, "cannot import room.gltf: none of the 12 triangles of the scene has an area");
    let picture = failure(|json| {
        json["images"] = json!([{ "uri": "gone.png" }]);
        json["textures"] = json!([{ "source": 0 }]);
        json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    });
    assert!(picture.contains("gone.png"), "{picture}");
    let unread = Room::new().with(|json| {
        json["images"] = json!([{ "uri": "a.png" }]);
        json["textures"] = json!([{ "source": 0 }]);
        json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0 });
    });
    let unread = unread.import("").file("a.png", "no picture").failure();
    assert!(unread.contains("a.png"), "{unread}");
    let scene = Room::new().import("scene = \"attic\"").failure();
    assert_eq!(scene, "cannot import room.gltf: there is no scene \"attic\"; expected one of: main");
    let mut nan = Room::new();
    nan.buffer[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let nan = nan.import("").failure();
    assert!(nan.contains("not finite") || nan.contains("NaN"), "{nan}");
    let dark = Room::new().with(|json| {
        json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(0);
    });
    let notes = dark.import("").run::<stages::artifacts::Scene>().unwrap().notes;
    assert_eq!(notes, ["lamps without light, whose intensity or colour is 0: bulb"]);
}

#[test]
fn places_without_a_valid_probe_say_why() {
    let place =
        |room: &Room, parameters: &str| case("place-probes", parameters).input("scene", &*room.scene());
    let room = Room::new();
    // The crate reaches from -0.75 to 0.35 in the file's x and z, and stands on the floor.
    let inside =
        "boxes = [{ name = \"hall\", from = [-0.6, -0.6, 0.1], to = [0.2, 0.2, 0.9] }]\ncounts = [2, 2, 2]";
    let failure = place(&room, inside).failure();
    let expected = "no probe of the box hall is outside of a solid: crate shows its back to ";
    assert!(failure.starts_with(expected), "{failure}");
    assert!(failure.ends_with("| turn the triangles of that node around, or make its material double-sided"));
    let many = place(&room, "spacing = 0.02").failure();
    let expected = "there are 5000000 probes, and at most 2097152 are placed | a larger spacing gives fewer; half as \
                    dense along each axis is an eighth";
    assert_eq!(many, expected);
    let many = place(&room, "spacing = 0.001").failure();
    assert!(many.starts_with("the box scene has [4000, 4000, 2500] probes along x, y and z"), "{many}");
    let errors = |parameters: &str| case("place-probes", parameters).errors();
    assert_eq!(
        errors("spacing = 1.0\ncounts = [1, 1, 1]"),
        ["counts: is given with spacing; give one of them"]
    );
    let [error] = &errors("boxes = [{ from = [0, 0, 0], to = [1, 0, 1] }]")[..] else { panic!() };
    assert!(error.starts_with("boxes: the box box 1 is not one; expected finite coordinates"), "{error}");
    let [error] = &errors("counts = [1, 4096, 1]\nboxes = [{ from = [0, 0, 0], to = [1, 1, 1] }]")[..] else {
        panic!()
    };
    assert!(error.contains("expected 1 to 2048 of cells' centres"), "{error}");
    let [error] = &errors("boxes = [{ to = [1, 1, 1] }]")[..] else { panic!() };
    assert!(error.contains("from"), "{error}");
}

#[test]
fn a_transport_that_is_too_large_is_refused_before_the_first_ray() {
    let scene = Room::new().scene();
    let volume = Volume::new("air".into(), [[0.0; 3], [9.0; 3]], [64, 64, 48], Lattice::Centres).unwrap();
    let count = volume.len();
    let places = probes::ProbePlaces::from_parts(PlacesParts {
        positions: (0..count).map(|probe| volume.position(volume.cell(probe))).collect(),
        volumes: vec![volume],
        points: Vec::new(),
        back_share: vec![0.0; count],
        inside_of: vec![None; count],
        repairs: vec![Repair::None; count],
        visible: vec![0; count],
        reach: vec![0; 256 * count],
    });
    let places = ProbePlaces(places.unwrap(), scene.triangles_digest());
    let failure = case("bake-probes", "degree = 4\nsky-degree = 8")
        .input("scene", &*scene)
        .input("places", &places)
        .run::<ProbeTransport>();
    let failure = failure.err().unwrap();
    let text = failure.to_string();
    assert!(text.starts_with("the transport of 196608 probes is ") && text.contains("at most 4"), "{text}");
    assert!(failure.help.unwrap().contains("a lower sky-degree (it is 8)"));
    assert_eq!(
        case("bake-probes", "error = 0.01\npaths = 4096\npaths-most = 64").errors(),
        ["paths-most: is below paths, which is 4096"]
    );
    assert_eq!(
        case("bake-probes", "bounces = \"some\"").errors(),
        ["bounces: \"some\" is not an integer from 0 to 64 or \"all\""]
    );
}

#[test]
fn a_bake_that_is_cancelled_leaves_nothing() {
    let scene = Room::new().scene();
    let places = case("place-probes", "").input("scene", &*scene).artifact::<ProbePlaces>();
    let cancel = Cancel::default();
    cancel.cancel();
    for kind in ["bake-probes", "bake-lamps"] {
        let case = case(kind, "").input("scene", &*scene).input("places", &*places);
        let failure = case.cancelled_by(&cancel).run::<ProbeTransport>().err().unwrap();
        assert!(failure.cancelled, "{kind}: {failure}");
    }
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let baked = Baked::of(&Room::new(), "paths = 16");
    let other = Baked::of(
        &Room::new().with(|json| {
            json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.1, 0.2, 0.9, 1.0]);
        }),
        "paths = 16\ndegree = 3",
    );
    let light = |transport: &Baked, lamps: &Baked, scene: &Baked| {
        case("light-probes", "")
            .input("transport", &*transport.transport)
            .input("lamps", &*lamps.lamps)
            .input("scene", &*scene.scene)
            .failure()
    };
    let failure = light(&baked, &baked, &other);
    assert!(failure.starts_with("the transport is that of another scene | connect `scene` to"), "{failure}");
    let failure = light(&baked, &other, &baked);
    assert!(failure.starts_with("the lamps were baked in another scene than the transport"), "{failure}");
    let mut lamps = (*other.lamps).clone();
    lamps.0.surfaces = baked.lamps.0.surfaces.clone();
    let of_degree = Baked { lamps: lamps.clone().into(), ..Baked::of(&Room::new(), "paths = 16") };
    let failure = light(&baked, &of_degree, &baked);
    let expected = "the lamps have degree 3, and the transport has degree 2 | give bake-lamps and bake-probes the \
                    same `degree`";
    assert_eq!(failure, expected);
    lamps.0.places_digest = "another".into();
    let elsewhere = Baked { lamps: lamps.into(), ..of_degree };
    let failure = light(&baked, &elsewhere, &baked);
    assert!(failure.starts_with("the lamps were baked at other places than the transport"), "{failure}");
    let surfaces = part(&baked.scene, "surfaces");
    let failure =
        case("light-probes", "").input("transport", &*baked.transport).input("scene", &*surfaces).failure();
    assert!(failure.ends_with("connect the stage of import-scene itself"), "{failure}");
}

/// Probes of another scene would stand in its walls: a crate that is an inch further makes another one, a
/// colour does not.
#[test]
fn places_of_another_scene_are_refused() {
    let room = Room::new().scene();
    let places = case("place-probes", "spacing = 1").input("scene", &*room).artifact::<ProbePlaces>();
    let with = |kind, scene: &Scene| case(kind, "").input("places", &*places).input("scene", scene);
    let moved = Room::new().with(|json| json["nodes"][0]["translation"] = json!([-0.7246, 0, -0.75])).scene();
    let painted = Room::new().with(|json| {
        json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([0.1, 0.2, 0.9, 1.0]);
    });
    let painted = painted.scene();
    for kind in ["check-probes", "bake-probes", "bake-lamps"] {
        let expected = "the probes were placed in a scene with other triangles than that at port scene | connect the \
                        scene of place-probes, or another part of the same stage of import-scene";
        assert_eq!(with(kind, &moved).failure(), expected, "{kind}");
    }
    assert!(with("check-probes", &painted).files_of().is_ok());
}

#[test]
fn light_above_the_largest_number_is_refused() {
    let bright = Baked::of(
        &Room::new().with(|json| {
            json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(1e35);
        }),
        "paths = 16",
    );
    for window in ["none", "non-negative"] {
        let failure = case("light-probes", &format!("lamps-scale = 1e9\nwindow = \"{window}\""))
            .input("transport", &*bright.transport)
            .input("lamps", &*bright.lamps)
            .input("scene", &*bright.scene)
            .failure();
        assert!(failure.starts_with("the light of probe "), "{failure}");
        assert!(failure.contains("lower `lamps-scale` or `emission-scale`"), "{failure}");
    }
}
