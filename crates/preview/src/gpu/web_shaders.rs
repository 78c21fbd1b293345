//! Translates the shaders of [`crate::web`] to GLSL for WebGL 2, and compares them with its files.

mod conditions;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use wgpu::naga::back::glsl;
use wgpu::naga::compact::{KeepUnused, compact};
use wgpu::naga::front::wgsl::parse_str;
use wgpu::naga::proc::BoundsCheckPolicies;
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use wgpu::naga::{AddressSpace, ShaderStage};

use self::conditions::{NamedCases, with_conditions, words};
use super::shader_sources::{
    BACKGROUND, BASE_COLOR, DEVELOP, DIFFERENCE, HARMONICS, LAMPS, TABLE, TEXTURE, TURNED_LIGHT, common,
    mode_files,
};
use crate::Mode;
use crate::shading::material::{self, all_models};
use crate::shading::shadows::NO_SHADOWS;
use crate::web::elements::ARRAYS;
use crate::web::{ELEMENTS, program};

const PAGE: &str = include_str!("../web/page.wgsl");
const TAPS: &str = include_str!("../web/taps.wgsl");
const TABLE_MAP: &str = include_str!("../web/table.wgsl");
const TRANSFER: &str = include_str!("../web/transfer.wgsl");
const FRAGMENT: &str = include_str!("../web/fragment.wgsl");

/// Arrays that are always in textures.
const IN_TEXTURES: [&str; 2] = ["texture_texels", "transfer_vectors"];

/// A shader: its file, its entry point, and its text in WGSL.
struct WebShader {
    file: &'static str,
    entry: &'static str,
    source: String,
}

fn shaders() -> [WebShader; 5] {
    let common = common();
    let of = |file, entry, files: &[&str]| WebShader {
        file,
        entry,
        source: [&[common.as_str(), DEVELOP], files, &[PAGE]].concat().concat(),
    };
    [
        of("mesh.vert", "mesh_vertex", &[]),
        of("sky.vert", "sky_vertex", &[]),
        of("transfer.vert", "transfer_vertex", &[TURNED_LIGHT, TRANSFER]),
        of("transfer.frag", "transfer_fragment", &[TURNED_LIGHT, TRANSFER]),
        of("page.frag", "page_fragment", &[&fragment_files()]),
    ]
}

/// The files of all modes, each once, and the function that chooses one.
fn fragment_files() -> String {
    let material = material::shader(&all_models());
    // What modes share; other groups, since a shader has the bindings of all of them.
    let texture = TEXTURE.replace("@group(1)", "@group(4)");
    let table = TABLE_MAP.replace("@group(1)", "@group(5)");
    let shared = [HARMONICS, &material, NO_SHADOWS, LAMPS, &texture, BASE_COLOR, TURNED_LIGHT].concat();
    let mut files = [&shared, BACKGROUND, DIFFERENCE, TABLE, &table].concat();
    let mut cases = String::new();
    for (case, mode) in program::MODES.into_iter().enumerate() {
        let (own, value) = match mode {
            // The look-up of a compact map is the page's.
            Mode::Taps => (TAPS.to_owned(), "lamps_added(surface, taps_radiance(surface))"),
            Mode::Table => (String::new(), "lamps_added(surface, table_reflected(surface))"),
            mode => mode_files(mode, &all_models()),
        };
        files += own.strip_prefix(&[&material, NO_SHADOWS, LAMPS].concat()).unwrap_or(&own);
        cases += &format!("        case {case}u: {{ return {value}; }}\n");
    }
    let choice = format!(
        "fn shade_mode(surface: Surface) -> vec3f {{\n    switch MODE {{\n{cases}        \
         default: {{ return vec3f(); }}\n    }}\n}}\n"
    );
    files + &choice + FRAGMENT
}

/// The switches whose cases programs choose.
fn switches() -> [NamedCases; 4] {
    let of = |selector, names| NamedCases { selector, names };
    [
        of("SHOWN", program::SHOWN.map(str::to_owned).to_vec()),
        of("MODE", program::MODES.map(program::mode_name).to_vec()),
        of("TEXTURED", vec![program::TEXTURED.to_owned()]),
        of("model", all_models().into_iter().map(program::model_name).collect()),
    ]
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
        if let Some((_, name, _)) = declaration {
            assert!(ARRAYS.contains(&name) || IN_TEXTURES.contains(&name), "{name} is in no list");
        }
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
            width = ELEMENTS
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
    let (source, file) = (with_textures(&shader.source), shader.file);
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
    let text = text.replace("#version 300 es\n\n", "");
    let text = with_conditions(&text, &switches());
    with_arrays_in_blocks(&with_prototype(&text, "vec3 taps_radiance("))
}

/// The text with a function declared alone.
fn with_prototype(text: &str, beginning: &str) -> String {
    let Some((before, rest)) = text.split_once(beginning) else { return text.to_owned() };
    let (head, after) = rest.split_once(") {").expect("a function");
    let (_, after) = after.split_once("\n}\n").expect("the end of a function");
    format!("{before}{beginning}{head});\n{after}")
}

/// The text that has arrays in uniform blocks if their numbers of vectors are defined.
fn with_arrays_in_blocks(text: &str) -> String {
    let (mut written, mut element) = (String::new(), "");
    for line in text.lines() {
        if let Some((_, rest)) = line.split_once("_element(uint ") {
            element = rest.split(')').next().unwrap_or_default();
        }
        let in_block = ARRAYS.into_iter().find_map(|name| {
            let (vectors, sampler) = (program::vectors_name(name), format!(" {name};"));
            if let Some(kind) = line.strip_prefix("uniform highp ").and_then(|of| of.strip_suffix(&sampler)) {
                let vector = if kind == "usampler2D" { "uvec4" } else { "vec4" };
                let block = format!("layout(std140) uniform {name}_block {{ {vector} {name}[{vectors}]; }};");
                return Some((vectors, block));
            }
            let (before, _) = line.split_once(&format!("texelFetch({name}, "))?;
            let value = match before.contains("uvec4") {
                true => format!("uvec4({name}[{element} >> 2u][{element} & 3u])"),
                false => format!("{name}[{element}]"),
            };
            Some((vectors, format!("{before}{value};")))
        });
        written += &match in_block {
            Some((vectors, block)) => format!("#ifdef {vectors}\n{block}\n#else\n{line}\n#endif\n"),
            None => format!("{line}\n"),
        };
    }
    written
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

/// The text that is left if these names are defined.
fn preprocessed(text: &str, defined: &BTreeSet<String>) -> String {
    let mut kept = String::new();
    let mut conditions = Vec::new();
    for line in text.lines() {
        if let Some(condition) = line.strip_prefix("#if") {
            let mut names = condition.split(" || ").flat_map(words);
            conditions.push(names.any(|name| defined.contains(name)));
        } else if line == "#else" {
            let last = conditions.last_mut().unwrap();
            *last = !*last;
        } else if line == "#endif" {
            conditions.pop().unwrap();
        } else if conditions.iter().all(|holds| *holds) {
            kept += &format!("{line}\n");
        }
    }
    assert!(conditions.is_empty());
    kept
}

/// The names of the functions and uniforms that a text declares.
fn declared(text: &str) -> BTreeSet<&str> {
    let name = |line: &'_ str| -> Option<std::ops::Range<usize>> {
        let end = match () {
            () if line.starts_with([' ', '#']) || line.starts_with("const ") => return None,
            () if line.ends_with(") {") || line.ends_with(");") => line.find('(')?,
            () if line.contains("uniform ") => {
                line.rfind('[').unwrap_or(line.trim_end_matches([';', '}', ' ']).len())
            }
            () => return None,
        };
        Some(line[..end].rfind(' ')? + 1..end)
    };
    text.lines().filter_map(|line| line.get(name(line)?)).collect()
}

#[test]
fn a_program_has_all_that_it_calls_and_nothing_else() {
    let shaders = shaders();
    let whole = translated(shaders.iter().find(|shader| shader.file == "page.frag").unwrap());
    let all = declared(&whole);
    let check = |names: &[&str]| {
        let defined = names.iter().map(|name| (*name).to_owned()).collect();
        let text = preprocessed(&whole, &defined);
        let declared = declared(&text);
        let mut mentions: BTreeMap<&str, usize> = BTreeMap::new();
        for word in words(&text) {
            *mentions.entry(word).or_default() += 1;
        }
        for name in all.iter().filter(|name| **name != "main") {
            // Local variables have the names of some uniforms, but nothing has that of a function.
            let is_right = match declared.contains(name) {
                true => mentions[name] > 1,
                false => !whole.contains(&format!(" {name}(")) || !mentions.contains_key(name),
            };
            assert!(is_right, "{names:?}: {name}");
        }
        text
    };
    check(&["SHOWS_SKY"]);
    check(&["SHOWS_DIFFERENCE"]);
    assert!(!check(&[]).contains("page_shown"), "depth needs no colour");
    for mode in program::MODES {
        let mode_name = program::mode_name(mode);
        let plain = check(&["SHOWS_MESH", &mode_name]);
        let textured = check(&["SHOWS_MESH", &mode_name, program::TEXTURED]);
        assert!(textured.contains("texture_texels") && !plain.contains("texture_texels"));
        let has_lamps = plain.contains("vec3 material_layer(");
        assert_eq!(has_lamps, matches!(mode, Mode::Taps | Mode::Table) || mode.adds_lamps(), "{mode:?}");
        for model in all_models().into_iter().filter(|_| has_lamps) {
            let text = check(&["SHOWS_MESH", &mode_name, &program::model_name(model)]);
            let (_, layer) = text.split_once("vec3 material_layer(").unwrap();
            let (layer, _) = layer.split_once("\n}\n").unwrap();
            assert_eq!(layer.matches("        case ").count(), 1, "{mode:?} {model}");
        }
    }
}
