//! From WGSL with a type at every declaration to other languages, line by line.

use super::language::Language;
use super::words::{code_and_comment, pieces};

/// The words of WGSL that other languages have another word for: those of GLSL, HLSL and Metal.
const WORDS: [(&str, [&str; 3]); 12] = [
    ("f32", ["float", "float", "float"]),
    ("i32", ["int", "int", "int"]),
    ("vec2f", ["vec2", "float2", "float2"]),
    ("vec3f", ["vec3", "float3", "float3"]),
    ("vec4f", ["vec4", "float4", "float4"]),
    ("vec2i", ["ivec2", "int2", "int2"]),
    ("vec3i", ["ivec3", "int3", "int3"]),
    ("vec4i", ["ivec4", "int4", "int4"]),
    ("mix", ["mix", "lerp", "mix"]),
    ("inverseSqrt", ["inversesqrt", "rsqrt", "rsqrt"]),
    ("fract", ["fract", "frac", "fract"]),
    ("atan2", ["atan", "atan2", "atan2"]),
];

/// How textures are read.
pub(super) struct Reading<'a> {
    /// The name of the sampler.
    pub(super) sampler: &'a str,
    /// Whether places in pictures are to be turned over.
    pub(super) rows_from_bottom: bool,
}

/// The text in a language.
pub(super) fn translate(text: &str, language: Language, reading: &Reading<'_>) -> String {
    let lines = text.lines().map(|line| {
        let (code, comment) = code_and_comment(line);
        let code = with_look_ups(code, language, reading);
        let column = match language {
            Language::Wgsl => return code + comment + "\n",
            Language::Glsl => 0,
            Language::Hlsl => 1,
            Language::Metal => 2,
        };
        let code = turned_round(&code, language);
        let word = |piece| WORDS.iter().find(|(wgsl, _)| *wgsl == piece).map_or(piece, |(_, of)| of[column]);
        pieces(&code).map(word).collect::<String>() + comment + "\n"
    });
    lines.collect()
}

/// The line with its look-ups in textures, whose arguments are names or numbers.
fn with_look_ups(line: &str, language: Language, reading: &Reading<'_>) -> String {
    let functions = ["load_layer", "sample_2d", "sample_layer", "sample_cube"];
    functions.into_iter().fold(line.to_owned(), |line, function| {
        let call = format!("{function}(");
        let mut pieces = line.split(call.as_str());
        let mut text = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            let (arguments, after) = piece.split_once(')').unwrap_or((piece, ""));
            let arguments: Vec<&str> = arguments.split(", ").collect();
            text += &look_up(function, &arguments, language, reading)
                .unwrap_or_else(|| unreachable!("a look-up has its arguments in its line: {line}"));
            text += after;
        }
        text
    })
}

fn look_up(
    function: &str,
    arguments: &[&str],
    language: Language,
    Reading { sampler, rows_from_bottom }: &Reading<'_>,
) -> Option<String> {
    let placed = |at: &str| match rows_from_bottom {
        true => format!("vec2f({at}.x, 1.0 - {at}.y)"),
        false => at.to_owned(),
    };
    Some(match (function, arguments) {
        ("load_layer", [texture, at, layer]) => match language {
            Language::Glsl => format!("texelFetch({texture}, vec3i({at}, {layer}), 0)"),
            Language::Hlsl => format!("{texture}.Load(vec4i({at}, {layer}, 0))"),
            Language::Metal => format!("{texture}.read(uint2({at}), uint({layer}))"),
            Language::Wgsl => format!("textureLoad({texture}, {at}, {layer}, 0)"),
        },
        ("sample_2d", [texture, at]) => {
            let place = placed(at);
            match language {
                Language::Glsl => format!("textureLod({texture}, {place}, 0.0)"),
                Language::Hlsl => format!("{texture}.SampleLevel({sampler}, {place}, 0.0)"),
                Language::Metal => format!("{texture}.sample({sampler}, {place}, level(0.0))"),
                Language::Wgsl => format!("textureSampleLevel({texture}, {sampler}, {place}, 0.0)"),
            }
        }
        ("sample_layer", [texture, at, layer]) => {
            let place = placed(at);
            match language {
                Language::Glsl => format!("textureLod({texture}, vec3f({place}, {layer}), 0.0)"),
                Language::Hlsl => format!("{texture}.SampleLevel({sampler}, vec3f({place}, {layer}), 0.0)"),
                Language::Metal => format!("{texture}.sample({sampler}, {place}, uint({layer}), level(0.0))"),
                Language::Wgsl => format!("textureSampleLevel({texture}, {sampler}, {place}, {layer}, 0.0)"),
            }
        }
        ("sample_cube", [texture, c, layer, mip]) => match language {
            Language::Glsl => format!("textureLod({texture}, vec4f({c}, {layer}), {mip})"),
            Language::Hlsl => format!("{texture}.SampleLevel({sampler}, vec4f({c}, {layer}), {mip})"),
            Language::Metal => format!("{texture}.sample({sampler}, {c}, uint({layer}), level({mip}))"),
            Language::Wgsl => format!("textureSampleLevel({texture}, {sampler}, {c}, i32({layer}), {mip})"),
        },
        _ => return None,
    })
}

/// The line with types before names.
fn turned_round(line: &str, language: Language) -> String {
    let indent = &line[..line.len() - line.trim_start().len()];
    let code = line.trim_start();
    let pair = |declaration: &str| {
        let (name, kind) = declaration.split_once(": ").unwrap_or((declaration, ""));
        format!("{kind} {name}")
    };
    if let Some(rest) = code.strip_prefix("fn ") {
        let parts = rest.split_once('(').and_then(|(name, rest)| {
            let (parameters, result) = rest.split_once(") -> ")?;
            Some((name, parameters, result))
        });
        if let Some((name, parameters, result)) = parts {
            let parameters = parameters.split(", ").map(pair).collect::<Vec<_>>().join(", ");
            let result = result.trim_end_matches(" {");
            return format!("{indent}{result} {name}({parameters}) {{");
        }
    }
    if let Some(rest) = code.strip_prefix("for (var ")
        && let Some((declaration, rest)) = rest.split_once(" = ")
    {
        return format!("{indent}for ({} = {rest}", pair(declaration));
    }
    let constant = match language {
        Language::Hlsl => "static const ",
        Language::Metal => "constant ",
        Language::Glsl | Language::Wgsl => "const ",
    };
    for (word, replacement) in [("let ", ""), ("var ", ""), ("const ", constant)] {
        if let Some(rest) = code.strip_prefix(word)
            && let Some((declaration, value)) = rest.split_once(" = ")
        {
            return format!("{indent}{replacement}{} = {value}", pair(declaration));
        }
    }
    line.to_owned()
}
