//! `specula inspect`: describes a file: its format, shape, frame, range, and the recipe that made it.

mod facts;
mod in_words;
mod layers;
mod material;
mod mesh;
mod photograph;
mod picture;
mod probes;
mod shader;
mod texture;

use std::path::Path;

use brdf::BrdfCoefficients;
use containers::{
    DIRECTION_COLUMNS, Format, LIGHT_COLUMNS, OpenExrEnvmap, Panorama, ReadOptions, Shows, is_babylon_env,
    is_texture, is_web_page, lighting_json, read_image, read_recipe, tensors, texture_containers,
};
use sampling::LightMasses;
use serde_json::{Value, json};
use sh::Expansion;

use self::facts::{Facts, range};
use self::in_words::in_words;
pub(crate) use self::shader::print_shader;
use engine::path_text;

use crate::assets;
use crate::command_error::CommandError;
use crate::exit::Exit;
use crate::print;

const SH_FRAME: &str = "right-handed, +Z up; real, orthonormal, no Condon-Shortley phase, row l*l + l + m";
const IMAGE_FRAME: &str = "row 0 is the top of the image; the file does not say how it maps to the sphere";
const PHOTOGRAPH_FRAME: &str =
    "lat-long, as a width of twice the height suggests: row 0 toward +Z (up), image centre along +X";
const ENVIRONMENT_FRAME: &str = "lat-long, row 0 toward +Z, image centre along +X; linear Rec. 709 radiance";

/// Describes a file. With a `picture`, a material or a BRDF table is drawn to that file too.
pub(crate) fn run(file: &Path, as_json: bool, picture: Option<&Path>) -> Result<Exit, CommandError> {
    let failed = |chain: &[String], help: Option<&str>| CommandError::usage(chain).with_help(help);
    let read = assets::file_or_preset(file);
    let (file, bytes) = read.map_err(|(message, help)| failed(&[message], help.as_deref()))?;
    let file = &*file;
    let of_material = table(&bytes).is_none().then(|| material::read(file, &bytes));
    let material = of_material.flatten().transpose();
    let material = material.map_err(|failure| failed(&failure.chain, failure.help.as_deref()))?;
    let by_name = match &material {
        Some(material) => Some(Ok(material::facts(file, &bytes, material))),
        None => mesh::of_file(file, &bytes),
    };
    let by_name = by_name.transpose().map_err(|failure| failed(&failure.chain, failure.help.as_deref()))?;
    let mut facts = by_name.map_or_else(|| describe(&bytes), Ok).map_err(|error| {
        let pictures = Format::ALL.iter().map(|format| format.name());
        let pictures = pictures.chain(texture_containers()).collect::<Vec<_>>().join(", ");
        let help = format!(
            "inspect reads {pictures}, .env, safetensors, glTF, JSON lighting, material files, MaterialX and \
             measured BRDFs"
        );
        failed(&[format!("{}: {error}", path_text(file))], Some(&help))
    })?;
    if let Some(place) = picture {
        let material = material.map(|found| found.material).or_else(|| material::of_artifact(&bytes));
        let drawn = |name: &str| match &material {
            Some(material) => Some(stages::material_picture(name, material)),
            None => Some(stages::table_picture(name, &tensors::decode_brdf_table(&bytes).ok()?)),
        };
        let Some(found) = picture::draw(file, drawn, place) else {
            let message = format!(
                "{} is not a material: --picture draws only materials and BRDF tables",
                path_text(file)
            );
            let help = "name a material file, a measured BRDF, a BRDF table as safetensors, or one of these in \
                        `.specula/blobs`; a material file with model = \"gltf\" names a material of a glTF file";
            return Err(failed(&[message], Some(help)));
        };
        facts.extend(found?);
    }
    Ok(if as_json {
        let object = facts.into_iter().map(|(label, value)| (label.to_owned(), value)).collect();
        print::json(Value::Object(object))
    } else {
        let lines = facts.iter().map(|(label, value)| format!("{label:<13} {}\n", text_of(value)));
        print::data(&lines.collect::<String>())
    })
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
            // A material's model stands before its parameters, and its layers or lobes stand last.
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

/// What a table of numbers that a stage wrote has in its lines, and its columns; `None` for another file.
fn table(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let tables = [("directions that were drawn", DIRECTION_COLUMNS), ("lights", LIGHT_COLUMNS)];
    let first = bytes.split(|byte| *byte == b'\n').next().map(<[u8]>::trim_ascii_end)?;
    tables.into_iter().find(|(_, columns)| first == columns.as_bytes())
}

fn describe(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let mut facts = match Format::sniff(bytes) {
        Some(Format::OpenExr) => layers::reflection_map(bytes).unwrap_or_else(|| image(bytes))?,
        Some(_) => image(bytes)?,
        None if is_texture(bytes) => texture::texture(bytes)?,
        None if is_babylon_env(bytes) => texture::babylon_env(bytes)?,
        None if is_web_page(bytes) => {
            vec![("what", "web page, for a browser".into()), ("format", "HTML".into())]
        }
        None if bytes.starts_with(b"#usda ") => {
            let count = String::from_utf8_lossy(bytes).matches("def DistantLight ").count();
            vec![("what", "scene of lights".into()), ("format", "USD text".into()), ("lights", count.into())]
        }
        None if engine::stands_for_no_file(bytes) => {
            vec![("what", "placeholder for a declared file that its item does not export".into())]
        }
        None if let Some((what, columns)) = table(bytes) => vec![
            ("what", what.into()),
            ("format", "CSV".into()),
            ("columns", columns.into()),
            (
                "rows",
                bytes.split(|byte| *byte == b'\n').skip(1).filter(|line| !line.is_empty()).count().into(),
            ),
        ],
        None if bytes.first() == Some(&b'{') => json_object(bytes)?,
        None if looks_like_safetensors(bytes) => tensor_file(bytes)?,
        None => image(bytes)?,
    };
    facts.push(("bytes", bytes.len().into()));
    let recipe = read_recipe(bytes);
    facts.push(match recipe {
        Some(recipe) => ("recipe", serde_json::from_str(&recipe).unwrap_or(Value::String(recipe))),
        None if bytes.starts_with(b"DDS ") => {
            ("recipe", "none: DDS cannot store text; see the .json beside it".into())
        }
        None => ("recipe", "none: not written by Specula, or removed".into()),
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
    let is_part = matches!(&decoded.panorama, Some(Panorama { shows: Shows::Part(..), .. }));
    let is_photograph = decoded.high_dynamic_range && width == 2 * height && !is_part;
    let mut facts = vec![
        ("what", "image".into()),
        ("format", decoded.format.name().into()),
        ("shape", format!("{width} x {height}, RGB").into()),
        ("frame", if is_photograph { PHOTOGRAPH_FRAME } else { IMAGE_FRAME }.into()),
    ];
    if let Some(envmap) = decoded.openexr_envmap {
        let layout = match envmap {
            OpenExrEnvmap::LatLong => "OpenEXR lat-long",
            OpenExrEnvmap::Cube => "OpenEXR cube",
        };
        facts.push(("envmap", layout.into()));
    }
    if let Some(Panorama { source, shows, .. }) = &decoded.panorama {
        let shows = match shows {
            Shows::Whole => "the whole sphere",
            Shows::Part(_, what) => what,
            Shows::Unclear(why) => why,
        };
        facts.push(("panorama", format!("{shows}, as {source} says").into()));
    }
    let range_of_format = match (decoded.high_dynamic_range, &decoded.profile) {
        (true, _) => "high",
        (false, None) => "low, decoded from sRGB",
        (false, Some(_)) => "low",
    };
    facts.push(("dynamic range", range_of_format.into()));
    if let Some(map) = &decoded.gain_map {
        facts.push(("gain map", map.as_str().into()));
    }
    if let Some(profile) = &decoded.profile {
        facts.push(("ICC profile", profile.as_str().into()));
    }
    let pixels = decoded.image.pixels();
    facts.extend(range("linear Rec. 709", pixels.iter().map(|pixel| pixel.map(f64::from))));
    if is_photograph {
        facts.extend(photograph::describe(pixels, height));
    }
    if !decoded.warnings.is_empty() {
        facts.push(("warnings", json!(decoded.warnings)));
    }
    if !decoded.notes.is_empty() {
        facts.push(("notes", json!(decoded.notes)));
    }
    Ok(facts)
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
            facts.extend(negative(&lighting));
            Ok(facts)
        }
        // Another engine's convention, which the file names.
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
                ("what", "numbers or an index, for programs".into()),
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
            facts.extend(range("coefficients of radiance", lighting.series.coefficients().iter().copied()));
            facts.extend(negative(&lighting.series));
            facts.extend(lights(&lighting.lights));
        }
        "light-field" => {
            let field = tensors::decode_light_field(bytes)?;
            let rows = field.lights().iter().flat_map(|light| light.coefficients());
            facts.push(("points", field.points().len().into()));
            facts.push(("degree", field.degree().get().into()));
            facts.push(("frame", SH_FRAME.into()));
            facts.extend(range("coefficients of radiance", rows.copied()));
        }
        "brdf" => {
            let tensors::Brdf { coefficients: brdf, parts, .. } = tensors::decode_brdf(bytes)?;
            facts.push(("degrees", degrees(&brdf).into()));
            facts.extend(parts.as_ref().map(|parts| parts_fact(parts.each_ref())));
            facts.extend(range("coefficients in 1/sr", brdf.rho().iter().copied()));
        }
        "reflection" => {
            let reflection = tensors::decode_reflection(bytes)?;
            let (lighting, brdf) = (reflection.lighting(), reflection.brdf());
            facts.push(("degrees", degrees(brdf).into()));
            let parts = reflection.parts();
            facts.extend(parts.map(|parts| parts_fact(parts.each_ref().map(|part| part.brdf()))));
            facts.push(("frame", SH_FRAME.into()));
            facts.extend(range("coefficients of radiance", lighting.coefficients().iter().copied()));
            facts.extend(reflection.lamps().and_then(|lamps| lights(&lamps.lights)));
        }
        "material" => {
            let material = tensors::decode_material(bytes)?;
            facts.insert(0, ("material", in_words(&material).into()));
            facts.extend(material::checked(&material));
        }
        "environment" => {
            let environment = tensors::decode_environment(bytes)?;
            facts.push(("frame", ENVIRONMENT_FRAME.into()));
            facts.extend(range("radiance", environment.pixels().iter().map(|pixel| pixel.map(f64::from))));
        }
        "scene" => facts.extend(probes::scene(bytes)?),
        "probe-places" => facts.extend(probes::places(&tensors::decode_probe_places(bytes)?.0)),
        "probe-transport" => facts.extend(probes::transport(bytes)?),
        "probe-lamps" => facts.extend(probes::lamps(bytes)?),
        "probes" => facts.extend(probes::lit(bytes)?),
        "mesh" => facts.extend(mesh::size(&tensors::decode_mesh(bytes)?)),
        "shrm" => facts.extend(texture::reflection_map(bytes)?),
        "brdf-table" => {
            let table = tensors::decode_brdf_table(bytes)?;
            let (count, size, channels) = (table.count(), table.size(), table.channels());
            facts.push(("degree", table.degree().get().into()));
            facts.push(("views", format!("{size} x {size}").into()));
            facts.push((
                "materials",
                match table.grid() {
                    [_, 1] => count.into(),
                    [along, across] => format!("{count}, {along} x {across}").into(),
                },
            ));
            facts.push(("colour", if channels == 1 { "grey" } else { "RGB" }.into()));
            let rows = table.values().chunks_exact(channels);
            facts.extend(range(
                "coefficients in 1/sr",
                rows.map(|row| [0, 1, 2].map(|channel| f64::from(row[channel.min(channels - 1)]))),
            ));
        }
        _ => {}
    }
    Ok(facts)
}

fn degrees(brdf: &BrdfCoefficients) -> String {
    format!("F = {}, P = {}", brdf.f().get(), brdf.p().get())
}

/// The degrees of the two parts of a material with two centres.
fn parts_fact([diffuse, specular]: [&BrdfCoefficients; 2]) -> (&'static str, Value) {
    ("parts", format!("diffuse {}; specular {}", degrees(diffuse), degrees(specular)).into())
}

/// How much of a series rings below zero; `None` if it is nowhere positive.
fn negative(series: &Expansion) -> Option<(&'static str, Value)> {
    let share = LightMasses::of_lighting(&series.clone().into()).ok()?.negative_share();
    let text = format!("{:.3} % of the integral of the absolute value", 100.0 * share);
    Some(("below zero", text.into()))
}

/// The lights beside a series; `None` if there are none.
fn lights(lights: &[sh::Light]) -> Option<(&'static str, Value)> {
    let line = |light: &sh::Light| {
        let ([x, y, z], [r, g, b]) = (light.direction.vector().to_array(), light.irradiance);
        let radius = light.radius.to_degrees();
        format!(
            "toward ({x:.3}, {y:.3}, {z:.3}), radius {radius:.2} degrees, irradiance {r:.4} {g:.4} {b:.4}"
        )
    };
    let lines: Vec<String> = lights.iter().map(line).collect();
    (!lines.is_empty()).then(|| ("lights", lines.into()))
}

#[cfg(test)]
mod tests {
    use sh::Degree;

    use super::*;

    #[track_caller]
    fn fact(bytes: &[u8], name: &str) -> Value {
        let facts = describe(bytes).unwrap();
        facts.into_iter().find(|(found, _)| *found == name).unwrap().1
    }

    #[test]
    fn lighting_says_how_much_of_it_is_negative() {
        // 1 + 3 z: the integrals of its parts over z are 8/3 and 2/3.
        let rows = vec![[1.0; 3], [0.0; 3], [3f64.sqrt(); 3], [0.0; 3]];
        let series = Expansion::from_coefficients(Degree::new(1).unwrap(), rows).unwrap();
        let bytes = tensors::encode_lighting(&series.into(), None).unwrap();
        let text = fact(&bytes, "below zero").as_str().unwrap().to_owned();
        let share: f64 = text.split(' ').next().unwrap().parse().unwrap();
        assert!(
            (share - 20.0).abs() < 0.05 && text.ends_with("% of the integral of the absolute value"),
            "{text}"
        );
    }

    #[test]
    fn files_of_lights_say_how_many() {
        let lights = [sh::Light::from_flux(sphere::Direction::Z, 0.1, [1.0; 3]); 3];
        let recipe = Some("{\"kind\":\"export-light-rig\"}");
        let gltf = containers::write_gltf_lights(&lights, containers::SceneAxes::IDENTITY, recipe).unwrap();
        let facts = mesh::of_file(Path::new("a.gltf"), &gltf).unwrap().unwrap();
        assert!(facts.contains(&("lights", 3.into())), "{facts:?}");
        let usda =
            containers::write_usda_lights(&lights, containers::SceneAxes::IDENTITY, None, recipe).unwrap();
        assert_eq!(fact(&usda, "lights"), 3);
        assert_eq!(fact(&usda, "recipe")["kind"], "export-light-rig");
        let table = containers::write_csv_lights(&lights).unwrap();
        assert_eq!((fact(&table, "what"), fact(&table, "rows")), ("lights".into(), 3.into()));
    }

    /// Its name is that of a measured BRDF, too.
    #[test]
    fn a_table_of_directions_is_no_material() {
        let table = b"u,v,x,y,z,pdf,weight\r\n0,0.5,1,0,0,0.25,-3\r\n0.25,0.1,0,-0.6,0.8,0.1,0.1\r\n";
        assert_eq!(
            (fact(table, "what"), fact(table, "rows")),
            ("directions that were drawn".into(), 2.into())
        );
        assert_eq!(super::table(b"theta_i,theta_o,phi,r,g,b\n"), None);
    }
}
