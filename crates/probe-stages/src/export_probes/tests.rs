//! The limits of engines: what is refused, with what the message says.

use probes::{Lattice, ProbePlaces, Volume};
use sh::Stop;

use super::axes::Rows;
use super::light::ProbeLight;
use super::*;
use crate::testkit::{bright_rows, places};

fn room(name: &str, at: f32, counts: [usize; 3], lattice: Lattice) -> Volume {
    Volume::new(name.into(), [[at, 0.0, 0.0], [at + 1.0, 1.0, 1.0]], counts, lattice).unwrap()
}

fn cells(name: &str, at: f32, counts: [usize; 3]) -> Volume {
    room(name, at, counts, Lattice::Centres)
}

/// Exports light with a preset; the files, or the chain of the failure and its help.
fn export(preset: ProbePreset, places: &ProbePlaces, rows: &[Rows]) -> Result<Vec<Option<Vec<u8>>>, String> {
    let valid = vec![true; rows.len()];
    let light = ProbeLight { places, rows, valid: &valid };
    let all = |files: Vec<Vec<u8>>| files.into_iter().map(Some).collect();
    let files = match preset {
        ProbePreset::Three => three::files(&light, true, "{}").map(all),
        ProbePreset::Bevy => bevy::files(&light, false, "{}").map(|(files, _)| files),
        ProbePreset::Godot => godot::files(&light, "{}", Stop::NEVER),
        ProbePreset::Unity => unity::files(&light, "{}").map(all),
        ProbePreset::VrcLightVolumes => vrc::files(&light, "{}").map(all),
        ProbePreset::Ktx2 => ktx2::files(&light, Precision::Half, false, "{}"),
        ProbePreset::Gltf => gltf::file(&light, "{}").map(|file| vec![Some(file)]),
        ProbePreset::Transport => unreachable!("it takes no light"),
    };
    files.map_err(|failure| format!("{failure}; {}", failure.help.clone().unwrap_or_default()))
}

const GRIDS: [ProbePreset; 4] =
    [ProbePreset::Three, ProbePreset::Bevy, ProbePreset::VrcLightVolumes, ProbePreset::Ktx2];

const ALL: [ProbePreset; 7] = [
    ProbePreset::Three,
    ProbePreset::Bevy,
    ProbePreset::Godot,
    ProbePreset::Unity,
    ProbePreset::VrcLightVolumes,
    ProbePreset::Ktx2,
    ProbePreset::Gltf,
];

/// Each preset gives as many contents as it declares names, and the last file is always there.
#[test]
fn files_are_those_that_are_declared() {
    let places = places(vec![cells("a", 0.0, [2, 1, 3]), cells("b", 2.0, [1, 1, 1])], Vec::new());
    for preset in ALL {
        let files = export(preset, &places, &bright_rows(7)).unwrap();
        let names = preset.names();
        assert_eq!(files.len(), names.len(), "{preset:?}");
        assert!(files.last().unwrap().is_some());
        let mut unique = names.clone();
        unique.sort();
        unique.dedup();
        assert_eq!(unique.len(), names.len());
    }
}

#[test]
fn points_are_refused_by_presets_of_grids() {
    let places = places(vec![cells("a", 0.0, [2, 2, 2])], vec![[0.5, 0.5, 0.5]]);
    for preset in GRIDS {
        let text = export(preset, &places, &bright_rows(9)).unwrap_err();
        assert!(text.contains("1 of the probes are scattered points"), "{text}");
        assert!(text.contains("preset = \"gltf\""), "{text}");
    }
    for preset in [ProbePreset::Godot, ProbePreset::Unity, ProbePreset::Gltf] {
        assert!(export(preset, &places, &bright_rows(9)).is_ok());
    }
}

/// Godot has a file for each volume, and one with all probes if some are at points.
#[test]
fn points_are_one_more_file_for_godot() {
    for (counts, points) in [([2, 2, 2], 0), ([2, 2, 2], 1), ([0; 3], 3)] {
        let volumes = if counts == [0; 3] { Vec::new() } else { vec![cells("a", 0.0, counts)] };
        let count = volumes.iter().map(Volume::len).sum::<usize>() + points;
        let at = (0..points).map(|k| [0.5 + k as f32, 0.5, 0.5]).collect();
        let has_volume = !volumes.is_empty();
        let files = export(ProbePreset::Godot, &places(volumes, at), &bright_rows(count)).unwrap();
        let text = |name: &str| {
            let index = ProbePreset::Godot.names().iter().position(|own| own == name).unwrap();
            files[index].as_ref().map(|file| String::from_utf8(file.clone()).unwrap())
        };
        assert_eq!(text("/volume-0.tres").is_some(), has_volume);
        let scene = text("/light_probes.tscn").unwrap();
        assert_eq!(
            scene.matches("type=\"LightmapGI\"").count(),
            usize::from(has_volume) + usize::from(points > 0)
        );
        assert_eq!(scene.contains("path=\"points.tres\" id=\"points\""), points > 0);
        assert_eq!(text("/README.txt").unwrap().contains("points.tres"), points > 0);
        let Some(file) = text("/points.tres") else {
            assert_eq!(points, 0);
            continue;
        };
        let colours = file.lines().find(|line| line.starts_with("\"sh\"")).unwrap();
        assert_eq!(colours.split(", ").count(), 36 * (8 + count));
    }
}

#[test]
fn volumes_are_counted() {
    let of = |count: usize| {
        let volumes = (0..count).map(|k| cells(&format!("room {k}"), 2.0 * k as f32, [1, 1, 1])).collect();
        places(volumes, Vec::new())
    };
    for (preset, most) in [
        (ProbePreset::Bevy, 8),
        (ProbePreset::VrcLightVolumes, 32),
        (ProbePreset::Ktx2, 32),
        (ProbePreset::Godot, 32),
    ] {
        assert!(export(preset, &of(most), &bright_rows(most)).is_ok());
        let text = export(preset, &of(most + 1), &bright_rows(most + 1)).unwrap_err();
        assert!(text.contains(&format!("at most {most} volumes, and there are {}", most + 1)), "{text}");
    }
}

#[test]
fn textures_have_sides_of_2048_texels() {
    // Ours is x, the z of files, which three.js stacks seven times and Bevy three times.
    for (preset, most) in [(ProbePreset::Three, 290), (ProbePreset::Ktx2, 290), (ProbePreset::Bevy, 682)] {
        let of = |count: usize| places(vec![cells("hall", 0.0, [count, 1, 1])], Vec::new());
        assert!(export(preset, &of(most), &bright_rows(most)).is_ok());
        let text = export(preset, &of(most + 1), &bright_rows(most + 1)).unwrap_err();
        assert!(text.contains("the texture of hall has 1 x") && text.contains("at most 2048"), "{text}");
    }
}

#[test]
fn light_without_a_half_is_refused() {
    let places = places(vec![cells("hall", 0.0, [2, 2, 2])], Vec::new());
    let mut rows = bright_rows(8);
    rows[5][0] = [1e6; 3];
    for preset in [ProbePreset::Three, ProbePreset::Bevy, ProbePreset::VrcLightVolumes, ProbePreset::Ktx2] {
        let text = export(preset, &places, &rows).unwrap_err();
        assert!(text.contains("hall has light of") && text.contains("65504") && text.contains("`scale`"));
    }
    for preset in [ProbePreset::Godot, ProbePreset::Unity, ProbePreset::Gltf] {
        assert!(export(preset, &places, &rows).is_ok());
    }
}

/// Bevy has no negative light: it is 0 and counted.
#[test]
fn negative_light_is_counted_for_bevy() {
    let places = places(vec![cells("hall", 0.0, [2, 1, 1])], Vec::new());
    let mut rows = vec![[[0.0; 3]; 9]; 2];
    // Below 0 toward -x, -y and -z of one probe in red.
    for (row, value) in [(0, 1.0), (1, 3.0), (2, 3.0), (3, 3.0)] {
        rows[1][row][0] = value;
    }
    let valid = [true; 2];
    let light = ProbeLight { places: &places, rows: &rows, valid: &valid };
    for is_shared in [false, true] {
        let (files, loss) = bevy::files(&light, is_shared, "{}").unwrap();
        assert_eq!((loss.negative, loss.all), (3, 2 * 6 * 3));
        let texture = containers::read_ktx2(files[0].as_ref().unwrap()).unwrap();
        assert!(texture.pixels.as_flattened().iter().all(|value| *value >= 0.0));
    }
}

/// Boxes with probes at the corners grow in three.js 187: rooms with a thin wall between them overlap there.
#[test]
fn growing_boxes_that_overlap_are_noted() {
    let notes = |lattice| {
        let rooms = [room("a", 0.0, [3; 3], lattice), room("b", 1.1, [3; 3], lattice)];
        let places = places(rooms.to_vec(), Vec::new());
        let mut notes = Vec::new();
        note_overlaps(&ProbeLight { places: &places, rows: &[], valid: &[] }, |note| notes.push(note));
        notes
    };
    assert_eq!(notes(Lattice::Centres), Vec::<String>::new());
    assert!(notes(Lattice::Corners)[0].starts_with("a and b overlap in three.js 187"));
}

/// A name of a box cannot end the comment of a program or of a scene.
#[test]
fn names_of_boxes_stay_text() {
    let places = places(vec![cells("a\nfn main() {} \"b\"", 0.0, [1, 1, 1])], Vec::new());
    let files = export(ProbePreset::Bevy, &places, &bright_rows(1)).unwrap();
    let program = String::from_utf8(files.last().unwrap().clone().unwrap()).unwrap();
    assert!(program.lines().any(|line| line.ends_with("// a fn main() {} \"b\"")));
    assert!(!program.lines().any(|line| line.starts_with("fn main")));
}
