//! The texts of the shaders: the files of a pass, then those of `shading/`. A generated line calls the mode.

use std::collections::BTreeSet;

use shrm::Reflection;

use crate::shading::material::PackedMaterial;
use crate::shading::shadows::NO_SHADOWS;
use crate::shading::{lobe_sampling, material, product_samples, product_tables, sequence};
use crate::{Look, Mode};

const FRAME: &str = include_str!("frame.wgsl");
const MAP: &str = include_str!("map.wgsl");
pub(super) const RASTER: &str = include_str!("raster.wgsl");
const COLOURED: &str = include_str!("coloured.wgsl");
pub(super) const TEXTURED: &str = include_str!("textured.wgsl");
const SHADE: &str = include_str!("shade.wgsl");
const UPDATE: &str = include_str!("update.wgsl");
const PRODUCT: &str = include_str!("product.wgsl");
const DEVELOP_PASS: &str = include_str!("develop.wgsl");
pub(super) const TURNED_LIGHT: &str = include_str!("../shading/turned_light.wgsl");
const SHADED: &str = include_str!("shaded.wgsl");
pub(super) const TABLE: &str = include_str!("../shading/table.wgsl");
const TABLE_BUFFERS: &str = include_str!("table_buffers.wgsl");
pub(super) const PRESENT: &str = include_str!("present.wgsl");
const SURFACE: &str = include_str!("../shading/surface.wgsl");
const ANGLES: &str = include_str!("../shading/angles.wgsl");
const CUBE: &str = include_str!("../shading/cube.wgsl");
const LAT_LONG: &str = include_str!("../shading/lat_long.wgsl");
pub(super) const HARMONICS: &str = include_str!("../shading/harmonics.wgsl");
pub(super) const BACKGROUND: &str = include_str!("../shading/background.wgsl");
pub(super) const DIFFERENCE: &str = include_str!("../shading/difference.wgsl");
pub(super) const DEVELOP: &str = include_str!("../shading/develop.wgsl");
const LIGHT_SAMPLES: &str = include_str!("../shading/light_samples.wgsl");
pub(super) const TEXTURE: &str = include_str!("../shading/texture.wgsl");
pub(super) const BASE_COLOR: &str = include_str!("../shading/base_color.wgsl");
const BRUTE_FORCE: &str = include_str!("../shading/brute_force.wgsl");
const SHADOWS: &str = include_str!("../shading/shadows.wgsl");
pub(super) const LAMPS: &str = include_str!("../shading/lamps.wgsl");
const GLOBAL_SHRM: &str = include_str!("../shading/global_shrm.wgsl");

/// Every shader and its name.
#[cfg(test)]
pub(super) fn sources() -> Vec<(String, String)> {
    let mut sources = vec![
        ("raster".to_owned(), RASTER.to_owned()),
        ("update".to_owned(), update_source()),
        ("product".to_owned(), product_source()),
        ("develop".to_owned(), develop_source(&[UNTEXTURED])),
        ("coloured".to_owned(), coloured_source()),
        ("develop with textures".to_owned(), develop_source(&[BASE_COLOR, TEXTURED])),
        ("present".to_owned(), PRESENT.to_owned()),
        ("shaded".to_owned(), shaded_source()),
    ];
    let shaded = Mode::ALL.into_iter().filter(|mode| !mode.is_diagram());
    sources.extend(shaded.map(|mode| (mode.name().to_owned(), mode_source(mode, &material::all_models()))));
    sources.push(("shadowed lamps".to_owned(), shadowed_lamps_source(&material::all_models())));
    sources
}

pub(super) fn update_source() -> String {
    [MAP, SURFACE, CUBE, HARMONICS, GLOBAL_SHRM, UPDATE].concat()
}

pub(super) fn product_source() -> String {
    [ANGLES, &product_tables::shader(), PRODUCT].concat()
}

/// What development shows without textures.
pub(super) const UNTEXTURED: &str =
    "fn shown_radiance(pixel: vec2u, side: u32, radiance: vec3f) -> vec3f { return radiance; }\n";

/// Development with `shown_radiance` of these files.
pub(super) fn develop_source(shown: &[&str]) -> String {
    let files = [FRAME, MAP, ANGLES, SURFACE, CUBE, LAT_LONG, BACKGROUND, DIFFERENCE, DEVELOP, DEVELOP_PASS];
    files.concat() + &shown.concat()
}

pub(super) fn coloured_source() -> String {
    [RASTER, TEXTURE, COLOURED].concat()
}

pub(super) fn shaded_source() -> String {
    [RASTER, TURNED_LIGHT, TABLE, TABLE_BUFFERS, SHADED].concat()
}

/// The models that the shader of a mode looks at.
pub(super) fn models(mode: Mode, look: &Look) -> BTreeSet<u32> {
    let beside = look.reflection().and_then(Reflection::lamps).map(|lamps| &lamps.material);
    let has_suns = look.beside_cube().is_some();
    let compact_map = look.compact_map().ok().filter(|map| !map.scales.lights().is_empty());
    let material = match mode {
        Mode::Taps => compact_map.map(|map| &map.material),
        mode if mode.is_brute_force() => look.material(),
        Mode::Prefiltered => look.material().filter(|_| has_suns),
        Mode::Table => return table_models(look),
        mode if mode.adds_lamps() => beside,
        _ => None,
    };
    material.map(PackedMaterial::models).unwrap_or_default()
}

/// The models that shade lamps beside a BRDF table.
pub(super) fn table_models(look: &Look) -> BTreeSet<u32> {
    look.beside_table().map(|lamps| PackedMaterial::models(&lamps.material)).unwrap_or_default()
}

/// The complete shader of a mode for materials of these models.
pub(super) fn mode_source(mode: Mode, models: &BTreeSet<u32>) -> String {
    let (files, value) = mode_files(mode, models);
    shading_source(&[&files], value)
}

/// The files of a mode for materials of these models, and the radiance that it shows.
pub(super) fn mode_files(mode: Mode, models: &BTreeSet<u32>) -> (String, &'static str) {
    let (material, lobe_sampling) = (material::shader(models), lobe_sampling::shader());
    let (sequence, product_samples) = (sequence::shader(), product_samples::shader());
    let (files, value): (&[&str], _) = match mode {
        Mode::LocalShrm => (
            &[
                &material,
                NO_SHADOWS,
                LAMPS,
                include_str!("../shading/local_shrm.wgsl"),
                &sum_of_parts("local_shrm"),
            ],
            "lamps_added(surface, local_shrm_of_parts(surface))",
        ),
        Mode::GlobalShrm => (
            &[&material, NO_SHADOWS, LAMPS, GLOBAL_SHRM, &sum_of_parts("global_shrm")],
            "lamps_added(surface, global_shrm_of_parts(surface))",
        ),
        Mode::Cabral => {
            (&[include_str!("../shading/cabral.wgsl"), &sum_of_parts("cabral")], "cabral_of_parts(surface)")
        }
        Mode::KautzMcCool => (
            &[include_str!("../shading/kautz_mccool.wgsl"), &sum_of_parts("kautz_mccool")],
            "kautz_mccool_of_parts(surface)",
        ),
        Mode::Taps => (
            &[&material, NO_SHADOWS, LAMPS, include_str!("../shading/taps.wgsl")],
            "lamps_added(surface, taps_radiance(surface))",
        ),
        Mode::Irradiance => (&[include_str!("../shading/irradiance.wgsl")], "irradiance(surface)"),
        Mode::Prefiltered => (
            &[
                &material,
                NO_SHADOWS,
                LAMPS,
                include_str!("../shading/prefiltered.wgsl"),
                &sum_of_parts("prefiltered"),
            ],
            "lamps_added(surface, prefiltered_of_parts(surface))",
        ),
        Mode::Mirror => (&[include_str!("../shading/mirror.wgsl")], "mirror(surface)"),
        // Radiance by tables, and for shadows positions, are drawn as the map of the mode.
        Mode::Table => (
            &[&material, NO_SHADOWS, LAMPS],
            "select(vec3f(), lamps_added(surface, textureLoad(map, pixel, 0, 0).rgb), \
             textureLoad(map, pixel, 0, 0).a > 0.0)",
        ),
        // Its lamps are added by `shadowed_lamps_source`.
        Mode::Transfer => (&[], "textureLoad(map, pixel, 0, 0).rgb"),
        Mode::BruteForce => (
            &[&sequence, LIGHT_SAMPLES, &material, &lobe_sampling, &product_samples, BRUTE_FORCE, NO_SHADOWS],
            "before + brute_force(surface, sequence_new(part.points, frame_number(pixel)), part.first, part.count)",
        ),
        // The CPU draws diagrams.
        Mode::Samples => (&[], "vec3f()"),
        Mode::ShadowedBruteForce => (
            &[&sequence, LIGHT_SAMPLES, &material, &lobe_sampling, &product_samples, BRUTE_FORCE, SHADOWS],
            "before + brute_force(shadows_at(surface, textureLoad(map, pixel, 0, 0).xyz), \
             sequence_new(part.points, frame_number(pixel)), part.first, part.count)",
        ),
    };
    (files.concat(), value)
}

/// The function that adds what another reads of each part of a map.
fn sum_of_parts(function: &str) -> String {
    format!(
        "fn {function}_of_parts(surface: Surface) -> vec3f {{\n    var sum = vec3f(0.0);\n    \
         for (var k = 0u; k < map_uniforms.count; k++) {{\n        \
         sum += map_uniforms.parts[k].weight * {function}(surface, map_uniforms.parts[k]);\n    }}\n    \
         return sum;\n}}\n"
    )
}

/// The shader that adds lamps that the mesh may hide, by the positions that are drawn as its map.
pub(super) fn shadowed_lamps_source(models: &BTreeSet<u32>) -> String {
    shading_source(
        &[&material::shader(models), LAMPS, SHADOWS],
        "select(before, lamps_some(shadows_at(surface, textureLoad(map, pixel, 0, 0).xyz), before, part.first, \
         part.count), textureLoad(map, pixel, 0, 0).a > 0.0)",
    )
}

/// The shader that sets the radiance of each sample to a value.
fn shading_source(files: &[&str], value: &str) -> String {
    let one = format!(
        "fn shade_mode(surface: Surface, pixel: vec2u, before: vec3f) -> vec3f {{ return {value}; }}\n"
    );
    [&[FRAME, &common(), HARMONICS], files, &[&one, SHADE]].concat().concat()
}

/// What the look-ups of maps share.
pub(super) fn common() -> String {
    [MAP, ANGLES, SURFACE, CUBE, LAT_LONG].concat()
}
