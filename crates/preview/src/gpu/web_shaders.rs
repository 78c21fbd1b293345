//! Translates the shaders of [`crate::web`] to GLSL for WebGL 2, and compares them with its files.

use std::collections::BTreeSet;
use std::path::Path;

use wgpu::naga::back::glsl;
use wgpu::naga::compact::{KeepUnused, compact};
use wgpu::naga::front::wgsl::parse_str;
use wgpu::naga::proc::BoundsCheckPolicies;
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use wgpu::naga::{AddressSpace, ShaderStage};

use super::layouts::{
    BACKGROUND, BASE_COLOR, DEVELOP, DIFFERENCE, HARMONICS, LAMPS, TABLE, TEXTURE, TURNED_LIGHT, common,
    mode_files,
};
use crate::shading::material::{self, all_models};
use crate::shading::shadows::NO_SHADOWS;
use crate::{Mode, web};

const PAGE: &str = include_str!("../web/page.wgsl");
const TAPS: &str = include_str!("../web/taps.wgsl");
const TABLE_MAP: &str = include_str!("../web/table.wgsl");
const TRANSFER: &str = include_str!("../web/transfer.wgsl");
const MESH: &str = include_str!("../web/mesh.wgsl");
const TEXTURED: &str = include_str!("../web/textured.wgsl");

/// What a mode shows if it shows no material.
const UNTEXTURED: &str = "fn mesh_radiance(at: PageVertex, surface: Surface, radiance: vec3f) -> vec3f { \
                          return radiance; }\n";

/// A shader: its file, its entry point, and its text in WGSL.
struct WebShader {
    file: String,
    entry: &'static str,
    source: String,
}

fn shaders() -> Vec<WebShader> {
    let common = common();
    let of = |file: &str, entry, files: &[&str]| WebShader {
        file: file.to_owned(),
        entry,
        source: [&[common.as_str(), DEVELOP], files, &[PAGE]].concat().concat(),
    };
    let mut shaders = vec![
        of("mesh.vert", "mesh_vertex", &[]),
        of("sky.vert", "sky_vertex", &[]),
        of("sky.frag", "sky_fragment", &[BACKGROUND, include_str!("../web/sky.wgsl")]),
        of("transfer.vert", "transfer_vertex", &[TURNED_LIGHT, TRANSFER]),
        of("transfer.frag", "transfer_fragment", &[TURNED_LIGHT, TRANSFER]),
        of("difference.frag", "difference_fragment", &[DIFFERENCE, include_str!("../web/difference.wgsl")]),
    ];
    for mode in Mode::ALL.into_iter().filter(|mode| web::fragment(*mode).is_some()) {
        let (files, value) = match mode {
            // The look-up of a compact map takes the place of this function.
            Mode::Taps => (
                [&material::shader(&all_models()), NO_SHADOWS, LAMPS, TAPS].concat(),
                "lamps_added(surface, taps_radiance(surface))",
            ),
            Mode::Table => (
                [&material::shader(&all_models()), NO_SHADOWS, LAMPS, TURNED_LIGHT, TABLE, TABLE_MAP]
                    .concat(),
                "lamps_added(surface, table_reflected(surface))",
            ),
            mode => mode_files(mode, &all_models()),
        };
        let one = format!("fn shade_mode(surface: Surface) -> vec3f {{ return {value}; }}\n");
        // A map has the bindings of the texture, too.
        let texture = [&TEXTURE.replace("@group(1)", "@group(4)"), BASE_COLOR, TEXTURED].concat();
        let shown = if mode.shows_material() { &texture } else { UNTEXTURED };
        let files = [HARMONICS, &files, &one, shown, MESH];
        shaders.push(of(&format!("{}.frag", mode.name()), "mesh_fragment", &files));
    }
    shaders
}

/// The text with textures in place of storage buffers, whose elements are texels.
fn with_textures(source: &str) -> String {
    let mut text = String::new();
    let mut buffers = Vec::new();
    for line in source.lines() {
        let declaration = line.split_once(" var<storage, read> ").and_then(|(binding, rest)| {
            let (name, of) = rest.split_once(": array<")?;
            Some((binding, name, of.strip_suffix(">;")?))
        });
        let Some((binding, name, of)) = declaration else {
            text += &format!("{line}\n");
            continue;
        };
        let (texel, part) = match of {
            "vec4f" => ("f32", ""),
            "vec2f" => ("f32", ".xy"),
            "u32" => ("u32", ".x"),
            other => panic!("a buffer of {other}"),
        };
        text += &format!(
            "{binding} var {name}: texture_2d<{texel}>;\nfn {name}_element(i: u32) -> {of} {{\n    \
             return textureLoad({name}, vec2u(i % {width}u, i / {width}u), 0){part};\n}}\n",
            width = web::ELEMENTS
        );
        buffers.push(name);
    }
    buffers.into_iter().fold(text, |text, name| with_calls(&text, name))
}

/// The text with `name[i]` as `name_element(i)`.
fn with_calls(source: &str, name: &str) -> String {
    let index = format!("{name}[");
    let (mut text, mut rest) = (String::new(), source);
    while let Some(start) = rest.find(&index) {
        let (before, found) = rest.split_at(start);
        let inner = &found[index.len()..];
        let mut depth = 1;
        let end = inner.find(|letter| {
            depth += match letter {
                '[' => 1,
                ']' => -1,
                _ => 0,
            };
            depth == 0
        });
        let end = end.unwrap_or_else(|| panic!("{name}[ is not closed"));
        text += &format!("{before}{name}_element({})", with_calls(&inner[..end], name));
        rest = &inner[end + 1..];
    }
    text + rest
}

/// The shader in GLSL ES 3.00, in which uniforms, textures and blocks have the names that they have in WGSL.
fn translated(shader: &WebShader) -> String {
    let (source, file) = (with_textures(&shader.source), &shader.file);
    let mut module =
        parse_str(&source).unwrap_or_else(|error| panic!("{file}: {}", error.emit_to_string(&source)));
    module.entry_points.retain(|entry| entry.name == shader.entry);
    compact(&mut module, KeepUnused::No);
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
    let info = validator
        .validate(&module)
        .unwrap_or_else(|error| panic!("{file}: {}", error.emit_to_string(&source)));
    let shader_stage = match file.ends_with(".vert") {
        true => ShaderStage::Vertex,
        false => ShaderStage::Fragment,
    };
    let options = glsl::Options {
        version: glsl::Version::Embedded { version: 300, is_webgl: true },
        writer_flags: glsl::WriterFlags::empty(),
        ..glsl::Options::default()
    };
    let entry = glsl::PipelineOptions { shader_stage, entry_point: shader.entry.into(), multiview: None };
    let mut text = String::new();
    let policies = BoundsCheckPolicies::default();
    let writer = glsl::Writer::new(&mut text, &module, &info, &options, &entry, policies);
    let names =
        writer.and_then(|mut writer| writer.write()).unwrap_or_else(|error| panic!("{file}: {error}"));
    for (_, variable) in module.global_variables.iter() {
        if let (Some(name), Some(at)) = (&variable.name, &variable.binding) {
            let stage = if shader_stage == ShaderStage::Vertex { "vs" } else { "fs" };
            text = text.replace(&format!("_group_{}_binding_{}_{stage}", at.group, at.binding), name);
        }
    }
    for (handle, block) in names.uniforms {
        let variable = &module.global_variables[handle];
        if variable.space == AddressSpace::Uniform {
            let name = variable.name.as_deref().unwrap_or_default();
            text = text.replace(&block, &format!("{name}_block"));
        }
    }
    text
}

#[test]
fn the_shaders_of_pages_are_those_of_the_device() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/web");
    let mut files: BTreeSet<String> = BTreeSet::new();
    for shader in shaders() {
        let file = format!("{}.glsl", shader.file);
        let (path, text) = (folder.join(&file), translated(&shader));
        if std::env::var_os("UPDATE_EXPECT").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(kept == text, "{file} is another; UPDATE_EXPECT=1 writes it");
        files.insert(file);
    }
    let all = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name());
    let glsl = all.filter_map(|name| name.into_string().ok()).filter(|name| name.ends_with(".glsl"));
    assert_eq!(glsl.collect::<BTreeSet<_>>(), files);
}
