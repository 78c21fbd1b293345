//! `specula inspect`: what a file is: format, shape, frame, range, and the recipe that made it.

mod material;
mod mesh;
mod texture;

use std::path::Path;

use containers::{
    Format, OpenExrEnvmap, ReadOptions, is_texture, is_web_page, lighting_json, read_image, read_recipe,
    tensors,
};
use serde_json::{Value, json};

use crate::print::say;
use crate::{Exit, print};

/// What is said of a file, in order: a label and its value.
type Facts = Vec<(&'static str, Value)>;

const SH_FRAME: &str = "right-handed, +Z up; real, orthonormal, no Condon-Shortley phase, row l*l + l + m";
const IMAGE_FRAME: &str = "row 0 is the image's top; the recipe or the maker knows the layout on the sphere";
const ENVIRONMENT_FRAME: &str = "lat-long, row 0 toward +Z, image centre along +X; linear Rec. 709 radiance";

pub(crate) fn run(file: &Path, as_json: bool) -> Exit {
    let bytes = match engine::read_file(file) {
        Ok(bytes) => bytes,
        Err(error) => {
            say!("error: cannot read {}: {error}", file.display());
            return Exit::Usage;
        }
    };
    let named = material::of_file(file, &bytes).or_else(|| mesh::of_file(file, &bytes));
    if let Some(Err(failure)) = &named {
        print::error(&failure.chain, failure.help.as_deref());
        return Exit::Usage;
    }
    let found = named.and_then(Result::ok).map_or_else(|| facts(&bytes), Ok);
    match found {
        Ok(facts) if as_json => {
            let object = facts.into_iter().map(|(label, value)| (label.to_owned(), value)).collect();
            print::json(Value::Object(object))
        }
        Ok(facts) => {
            let lines = facts.iter().map(|(label, value)| format!("{label:<13} {}\n", text_of(value)));
            print::data(&lines.collect::<String>())
        }
        Err(error) => {
            say!("error: {}: {error}", file.display());
            say!(
                "hint: inspect reads OpenEXR, Radiance, PNG, JPEG, KTX2, DDS, safetensors, glTF, the JSON of lighting, material files and measured BRDFs"
            );
            Exit::Usage
        }
    }
}

/// A value on one line; strings without quotes.
fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) if values.iter().all(Value::is_string) => {
            values.iter().map(text_of).collect::<Vec<_>>().join("; ")
        }
        Value::Array(values) if values.iter().all(Value::is_object) => {
            values.iter().map(|value| format!("\n  {}", text_of(value))).collect()
        }
        Value::Object(members) if members.values().all(|member| !member.is_object()) => {
            // What a material is, before its parameters; lists of its layers or lobes last.
            let mut members: Vec<_> = members.iter().collect();
            members.sort_by_key(|(name, value)| match name.as_str() {
                "model" => 0,
                _ if value.as_array().is_some_and(|values| values.iter().any(Value::is_object)) => 2,
                _ => 1,
            });
            let each = members.iter().map(|(name, value)| format!("{name} {}", text_of(value)));
            each.collect::<Vec<_>>().join(", ")
        }
        value => value.to_string(),
    }
}

fn facts(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let mut facts = match Format::sniff(bytes) {
        Some(_) => image(bytes)?,
        None if is_texture(bytes) => texture::texture(bytes)?,
        None if is_web_page(bytes) => {
            vec![("what", "web page, for a browser".into()), ("format", "HTML".into())]
        }
        None if bytes.first() == Some(&b'{') => json_object(bytes)?,
        None if looks_like_safetensors(bytes) => tensor_file(bytes)?,
        None => image(bytes)?,
    };
    facts.push(("bytes", bytes.len().into()));
    let recipe = read_recipe(bytes);
    facts.push(match recipe {
        Some(recipe) => ("recipe", serde_json::from_str(&recipe).unwrap_or(Value::String(recipe))),
        None if bytes.starts_with(b"DDS ") => {
            ("recipe", "none: DDS holds no texts; see the .json beside it".into())
        }
        None => ("recipe", "none: not made by this program, or stripped".into()),
    });
    Ok(facts)
}

/// A safetensors file begins with the length of its header (8 bytes, little endian) and the header's brace.
fn looks_like_safetensors(bytes: &[u8]) -> bool {
    bytes.get(8) == Some(&b'{')
}

fn image(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let decoded = read_image(bytes, &ReadOptions::default())?;
    let (width, height) = (decoded.image.width(), decoded.image.height());
    let mut facts = vec![
        ("what", "image".into()),
        ("format", decoded.format.name().into()),
        ("shape", format!("{width} x {height}, RGB").into()),
        ("frame", IMAGE_FRAME.into()),
    ];
    if let Some(envmap) = decoded.openexr_envmap {
        let layout = match envmap {
            OpenExrEnvmap::LatLong => "OpenEXR lat-long",
            OpenExrEnvmap::Cube => "OpenEXR cube",
        };
        facts.push(("envmap", layout.into()));
    }
    facts.push((
        "dynamic range",
        if decoded.high_dynamic_range { "high" } else { "low, decoded from sRGB" }.into(),
    ));
    let pixels = decoded.image.pixels();
    facts.extend(range("linear Rec. 709", pixels.iter().map(|pixel| pixel.map(f64::from))));
    if !decoded.warnings.is_empty() {
        facts.push(("warnings", json!(decoded.warnings)));
    }
    Ok(facts)
}

/// The least, mean and greatest finite value of each channel, and how many values are no light at all.
fn range(unit: &str, values: impl Iterator<Item = [f64; 3]>) -> Facts {
    let (mut least, mut greatest, mut sum) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], [0.0; 3]);
    let mut count = [0_usize; 3];
    let (mut not_finite, mut negative) = (0_usize, 0_usize);
    for value in values {
        for channel in 0..3 {
            let number = value[channel];
            if !number.is_finite() {
                not_finite += 1;
                continue;
            }
            count[channel] += 1;
            negative += usize::from(number < 0.0);
            least[channel] = least[channel].min(number);
            greatest[channel] = greatest[channel].max(number);
            sum[channel] += number;
        }
    }
    let shown = |values: [f64; 3]| {
        let texts = values.iter().zip(count);
        let texts = texts.map(|(value, count)| if count > 0 { format!("{value:.6}") } else { "none".into() });
        format!("[{}]", texts.collect::<Vec<_>>().join(", "))
    };
    let mean = [0, 1, 2].map(|channel| sum[channel] / count[channel] as f64);
    vec![
        ("values", unit.into()),
        ("least", shown(least).into()),
        ("mean", shown(mean).into()),
        ("greatest", shown(greatest).into()),
        ("negative", negative.into()),
        ("not finite", not_finite.into()),
    ]
}

fn json_object(bytes: &[u8]) -> Result<Facts, containers::Error> {
    match lighting_json::decode(bytes) {
        Ok(lighting) => {
            let mut facts = vec![
                ("what", "lighting in spherical harmonics".into()),
                ("format", "JSON".into()),
                (
                    "shape",
                    format!(
                        "degree {}, {} rows, RGB",
                        lighting.degree().get(),
                        lighting.coefficients().len()
                    )
                    .into(),
                ),
                ("frame", SH_FRAME.into()),
            ];
            facts.extend(range("coefficients of radiance", lighting.coefficients().iter().copied()));
            Ok(facts)
        }
        // Another engine's convention: its file says what it holds.
        Err(error) => match serde_json::from_slice::<Value>(bytes) {
            Ok(Value::Object(object)) if object.contains_key("preset") => {
                let members = ["preset", "frame", "scale", "source", "degree"];
                let mut facts: Facts = vec![
                    ("what", "lighting in spherical harmonics, for another engine".into()),
                    ("format", "JSON".into()),
                ];
                facts.extend(members.iter().filter_map(|name| Some((*name, object.get(*name)?.clone()))));
                Ok(facts)
            }
            Ok(Value::Object(object)) if object.contains_key("specula") => Ok(vec![
                ("what", "figures or an index, for programs".into()),
                ("format", "JSON".into()),
                (
                    "members",
                    object.keys().filter(|name| *name != "specula").cloned().collect::<Vec<_>>().into(),
                ),
            ]),
            _ => Err(error),
        },
    }
}

fn tensor_file(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let description = tensors::describe(bytes)?;
    let kind = description.metadata.get("kind").map_or("tensors", String::as_str);
    let mut facts = vec![("what", kind.into()), ("format", "safetensors".into())];
    let shapes = description.tensors.iter().map(|(name, dtype, shape)| format!("{name} {shape:?} {dtype}"));
    facts.push(("shape", shapes.collect::<Vec<_>>().into()));
    if let Some(centre) = description.metadata.get("centre") {
        facts.push(("centre", centre.as_str().into()));
    }
    match kind {
        "lighting" => {
            let lighting = tensors::decode_lighting(bytes)?;
            facts.push(("frame", SH_FRAME.into()));
            facts.extend(range("coefficients of radiance", lighting.coefficients().iter().copied()));
        }
        "brdf" => {
            let brdf = tensors::decode_brdf(bytes)?;
            facts.push(("degrees", format!("F = {}, P = {}", brdf.f().get(), brdf.p().get()).into()));
            facts.extend(range("coefficients in 1/sr", brdf.rho().iter().copied()));
        }
        "reflection" => {
            let (lighting, brdf) = tensors::decode_reflection(bytes)?;
            facts.push(("degrees", format!("F = {}, P = {}", brdf.f().get(), brdf.p().get()).into()));
            facts.push(("frame", SH_FRAME.into()));
            facts.extend(range("coefficients of radiance", lighting.coefficients().iter().copied()));
        }
        "material" => facts.extend(material::checked(&tensors::decode_material(bytes)?)),
        "environment" => {
            let environment = tensors::decode_environment(bytes)?;
            facts.push(("frame", ENVIRONMENT_FRAME.into()));
            facts.extend(range("radiance", environment.pixels().iter().map(|pixel| pixel.map(f64::from))));
        }
        "mesh" => facts.extend(mesh::measured(&tensors::decode_mesh(bytes)?)),
        "shrm" => facts.extend(texture::reflection_map(bytes)?),
        _ => {}
    }
    Ok(facts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_is_that_of_the_finite_values() {
        let values = [[1.0, f64::NAN, -1.0], [3.0, f64::INFINITY, f64::NAN]];
        let facts: std::collections::BTreeMap<_, _> =
            range("units", values.into_iter()).into_iter().collect();
        assert_eq!(facts["least"], "[1.000000, none, -1.000000]");
        assert_eq!(facts["mean"], "[2.000000, none, -1.000000]");
        assert_eq!((&facts["negative"], &facts["not finite"]), (&json!(1), &json!(3)));
    }
}
