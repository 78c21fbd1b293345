//! The words of shading languages, for the few that a look-up needs.

/// A shading language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaderLanguage {
    /// GLSL: OpenGL, Vulkan, WebGL 2.
    Glsl,
    /// WGSL: WebGPU.
    Wgsl,
    /// HLSL: Direct3D.
    Hlsl,
}

/// Words of WGSL, GLSL and HLSL.
const WORDS: [[&str; 3]; 7] = [
    ["f32", "float", "float"],
    ["i32", "int", "int"],
    ["vec2f", "vec2", "float2"],
    ["vec3f", "vec3", "float3"],
    ["vec2i", "ivec2", "int2"],
    ["atan2", "atan", "atan2"],
    ["fract", "fract", "frac"],
];

impl ShaderLanguage {
    /// All languages.
    pub const ALL: [Self; 3] = [Self::Glsl, Self::Wgsl, Self::Hlsl];

    /// Text in the words of WGSL, in which every variable has its type, in this language.
    pub(super) fn translated(self, wgsl: &str) -> String {
        let column = match self {
            Self::Wgsl => return wgsl.to_owned(),
            Self::Glsl => 1,
            Self::Hlsl => 2,
        };
        wgsl.lines().map(|line| worded(&declared(line), column) + "\n").collect()
    }
}

/// A line with its types before the names, as in C.
fn declared(line: &str) -> String {
    if let Some((name, rest)) = line.strip_prefix("fn ").and_then(|rest| rest.split_once('('))
        && let Some((parameters, result)) = rest.split_once(") -> ")
    {
        let typed = |parameter: &str| parameter.split_once(": ").map(|(name, of)| format!("{of} {name}"));
        let parameters: Vec<String> = parameters.split(", ").filter_map(typed).collect();
        let result = result.trim_end_matches(" {");
        return format!("{result} {name}({}) {{", parameters.join(", "));
    }
    for keyword in ["let ", "var "] {
        if let Some((before, rest)) = line.split_once(keyword)
            && let Some((name, rest)) = rest.split_once(": ")
            && let Some((of, value)) = rest.split_once(" = ")
        {
            return format!("{before}{of} {name} = {value}");
        }
    }
    line.to_owned()
}

/// A line with each word in the language of a column.
fn worded(line: &str, column: usize) -> String {
    let is_letter = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut text = String::new();
    let mut rest = line;
    while let Some(first) = rest.chars().next() {
        let is_word = is_letter(first);
        let end = rest.find(|letter: char| is_letter(letter) != is_word).unwrap_or(rest.len());
        let (piece, after) = rest.split_at(end);
        text.push_str(WORDS.iter().find(|words| words[0] == piece).map_or(piece, |words| words[column]));
        rest = after;
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_translated_word_by_word() {
        for (wgsl, glsl, hlsl) in [
            (
                "fn texel(at: vec2i, view: vec3f) -> vec3f {",
                "vec3 texel(ivec2 at, vec3 view) {",
                "float3 texel(int2 at, float3 view) {",
            ),
            (
                "    let part: vec2f = fract(place);",
                "    vec2 part = fract(place);",
                "    float2 part = frac(place);",
            ),
            (
                "    for (var k: i32 = 0; k < 4; k++) {",
                "    for (int k = 0; k < 4; k++) {",
                "    for (int k = 0; k < 4; k++) {",
            ),
            ("    let u: f32 = atan2(y, x);", "    float u = atan(y, x);", "    float u = atan2(y, x);"),
        ] {
            let [in_glsl, in_wgsl, in_hlsl] = ShaderLanguage::ALL.map(|language| language.translated(wgsl));
            assert_eq!([in_glsl.trim_end(), in_wgsl.trim_end(), in_hlsl.trim_end()], [glsl, wgsl, hlsl]);
        }
    }
}
