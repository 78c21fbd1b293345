//! A material: its models as JSON in the metadata, its tables as tensors.
//!
//! `material` in `__metadata__` is `{"model": "phong", "exponent": 64.0, "specular": [1.0, 0.8, 0.3]}`: a
//! model's name and its parameters by [`brdf::MODELS`], colours always three numbers. Of layers it is
//! `{"model": "layers", "layers": [...]}`, of a table `{"model": "measured", "scale": [1.0, 1.0, 1.0],
//! "table": 0}`, whose values are the tensor `table0` [n_h, n_d, n_phi, 3] f32 (see [`brdf::Measured`]);
//! tables are numbered in the order of the layers. The table of a `measured-anisotropic` is [n_h, n_phi, n_d,
//! n_psi, 3] (see [`brdf::MeasuredAnisotropic`]). `"part": "diffuse"` or `"specular"` beside the parameters
//! of `standard` says that the material is that part of it. A picture of its base colour may stand beside a
//! material (base_color.rs).

use brdf::{
    BaseColorTexture, MODELS, Material, Measured, MeasuredAnisotropic, MeasuredError, Parameter, Part, Value,
    ValueType, Values,
};
use safetensors::tensor::Dtype;
use serde_json::{Map, Value as Json, json};

use super::base_color;
use super::file::{TensorFile, Writer, colours, wrong_shape};
use crate::error::{Error, ErrorKind};

/// The entry of the metadata that holds the models.
const KEY: &str = "material";
/// The member of a `standard` model that is a part of one.
const PART: &str = "part";
const SHAPE: &str = "[n_h, n_d, n_phi, 3]";
const ANISOTROPIC_SHAPE: &str = "[n_h, n_phi, n_d, n_psi, 3]";

/// A material: models and parameters in the metadata, measured tables as `table0` [n_h, n_d, n_phi, 3] f32,
/// `table1` ...
///
/// # Errors
/// If the material is an empty sum.
pub fn encode_material(material: &Material, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    encode_textured_material(material, None, recipe)
}

/// A material as [`encode_material`] writes it, and beside it the picture of its base colour, if it has one:
/// `base_color` [height, width, 3] u8.
///
/// # Errors
/// If the material is an empty sum.
pub fn encode_textured_material(
    material: &Material,
    base_color: Option<&BaseColorTexture>,
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let mut file = Writer::new("material", recipe);
    add(material, &mut file)?;
    base_color.iter().for_each(|texture| base_color::add(texture, &mut file));
    Ok(file.finish())
}

/// Adds a material to a file: its tables come last.
pub(super) fn add(material: &Material, file: &mut Writer) -> Result<(), Error> {
    let tree = write(material, file)?;
    file.entry(KEY, tree.to_string());
    Ok(())
}

/// A material, from a file of kind `material`.
///
/// # Errors
/// If the file is not one that [`encode_material`] could have written; the message names the model, the
/// parameter or the tensor and what was expected.
pub fn decode_material(bytes: &[u8]) -> Result<Material, Error> {
    decode_textured_material(bytes).map(|(material, _)| material)
}

/// A material, from a file of kind `material`, and the picture of its base colour, if it has one.
///
/// # Errors
/// If the file is not one that [`encode_textured_material`] could have written.
pub fn decode_textured_material(bytes: &[u8]) -> Result<(Material, Option<BaseColorTexture>), Error> {
    let file = TensorFile::open_as(bytes, "material")?;
    let (material, tables) = of(&file)?.ok_or_else(|| Error::damaged("metadata `material`: missing"))?;
    let base_color = base_color::of(&file)?;
    let found = file.tensors.len() - usize::from(base_color.is_some());
    if found != tables {
        return Err(Error::damaged(format!("expected {tables} tensors, one for each table, found {found}")));
    }
    Ok((material, base_color))
}

/// The material of a file and the number of its tables; `None` if it has none.
pub(super) fn of(file: &TensorFile<'_>) -> Result<Option<(Material, usize)>, Error> {
    let Some(text) = file.metadata.get(KEY) else { return Ok(None) };
    let tree: Json = serde_json::from_str(text)
        .map_err(|error| Error::damaged(format!("metadata `material`: no sound JSON: {error}")))?;
    let mut tables = 0;
    let material = read(&tree, file, &mut tables)?;
    Ok(Some((material, tables)))
}

fn write(material: &Material, file: &mut Writer) -> Result<Json, Error> {
    let mut object = match json_of(&material.values()) {
        Json::Object(object) => object,
        _ => Map::new(),
    };
    match material {
        Material::Layers(layers) => {
            if layers.is_empty() {
                return Err(Error::new(
                    ErrorKind::Unwritable,
                    "a material of no layers; expected one or more",
                ));
            }
            let layers = layers.iter().map(|layer| write(layer, file)).collect::<Result<_, _>>()?;
            object.insert("layers".into(), Json::Array(layers));
        }
        Material::Measured(measured) => {
            let number = add_table(file, &measured.shape(), measured.values());
            object.insert("table".into(), number.into());
        }
        Material::MeasuredAnisotropic(measured) => {
            let number = add_table(file, &measured.shape(), measured.values());
            object.insert("table".into(), number.into());
        }
        Material::Standard(standard) => {
            if let Some(part) = standard.part() {
                object.insert(PART.into(), name_of(part).into());
            }
        }
        _ => {}
    }
    object.insert("model".into(), material.name().into());
    Ok(Json::Object(object))
}

/// Adds a table of this shape; its number.
fn add_table(file: &mut Writer, shape: &[usize], values: &[[f32; 3]]) -> usize {
    let number = file.tensors.iter().filter(|(name, _)| name.starts_with("table")).count();
    file.extend_f32(values.as_flattened());
    file.tensor(format!("table{number}"), "F32", &[shape, &[3]].concat());
    number
}

fn name_of(part: Part) -> &'static str {
    match part {
        Part::Diffuse => "diffuse",
        Part::Specular => "specular",
    }
}

fn json_of(values: &Values) -> Json {
    let json = |value: &Value| match value {
        Value::Number(number) => json!(number),
        Value::Colour(rgb) => json!(rgb),
        Value::Records(records) => records.iter().map(json_of).collect(),
    };
    Json::Object(values.iter().map(|(name, value)| (name.to_owned(), json(value))).collect())
}

fn read(tree: &Json, file: &TensorFile<'_>, tables: &mut usize) -> Result<Material, Error> {
    let wrong = |expected: &str, found: &Json| {
        Error::damaged(format!("metadata `material`: expected {expected}, found {found}"))
    };
    let object = tree.as_object().ok_or_else(|| wrong("a model", tree))?;
    let name =
        object.get("model").and_then(Json::as_str).ok_or_else(|| wrong("the name of a model", tree))?;
    let known = |names: &[&str]| match object.keys().find(|key| !names.contains(&key.as_str())) {
        Some(key) => Err(Error::damaged(format!("metadata `material`: {name} has no parameter `{key}`"))),
        None => Ok(()),
    };
    match name {
        "layers" => {
            known(&["model", "layers"])?;
            let layers =
                object.get("layers").and_then(Json::as_array).ok_or_else(|| wrong("layers", tree))?;
            let layers = layers.iter().map(|layer| read(layer, file, tables)).collect::<Result<_, _>>()?;
            Material::layers(layers).map_err(|error| Error::damaged(format!("metadata `material`: {error}")))
        }
        "measured" | "measured-anisotropic" => {
            known(&["model", "scale", "table"])?;
            let number = *tables;
            *tables += 1;
            if object.get("table").and_then(Json::as_u64) != Some(number as u64) {
                return Err(wrong(&format!("table {number}"), tree));
            }
            let scale =
                object.get("scale").and_then(colour).ok_or_else(|| wrong("a `scale` colour", tree))?;
            let name = format!("table{number}");
            let table = match object["model"].as_str() {
                Some("measured") => {
                    let (shape, values) = table(file, &name, SHAPE)?;
                    Measured::new(shape, values).map(|table| table.scaled(scale).map(Material::Measured))
                }
                _ => {
                    let (shape, values) = table(file, &name, ANISOTROPIC_SHAPE)?;
                    let table = MeasuredAnisotropic::new(shape, values);
                    table.map(|table| table.scaled(scale).map(Material::MeasuredAnisotropic))
                }
            };
            table
                .map_err(|error: MeasuredError| Error::damaged(format!("tensor `{name}`: {error}")))?
                .map_err(|error| Error::damaged(format!("metadata `material`: {error}")))
        }
        _ => {
            let text = MODELS.iter().find(|model| model.name == name);
            let text = text.ok_or_else(|| wrong("a model of this version", tree))?;
            let values = values(object, text.parameters, &["model", PART])?;
            let material = Material::analytic(name, &values);
            match material.map(|material| material.map(|whole| part_of(whole, object.get(PART)))) {
                Some(Ok(Some(material))) => Ok(material),
                Some(Ok(None)) => Err(wrong("`part` of a model that has it", tree)),
                Some(Err(error)) => Err(Error::damaged(format!("metadata `material`: {name}: {error}"))),
                None => Err(wrong("a model of this version", tree)),
            }
        }
    }
}

/// The named part of a model, or the whole.
fn part_of(whole: Material, name: Option<&Json>) -> Option<Material> {
    let Some(name) = name else { return Some(whole) };
    let part = [Part::Diffuse, Part::Specular].into_iter().find(|part| *name == name_of(*part))?;
    whole
        .part(part)
        .filter(|material| matches!(material, Material::Standard(standard) if standard.part().is_some()))
}

/// The values of an object's members, `besides` some that are none of them.
fn values(object: &Map<String, Json>, parameters: &[Parameter], besides: &[&str]) -> Result<Values, Error> {
    let mut values = Values::default();
    for (key, json) in object.iter().filter(|(key, _)| !besides.contains(&key.as_str())) {
        let parameter = parameters.iter().find(|parameter| parameter.name == key);
        let value = parameter.and_then(|parameter| match parameter.value_type {
            ValueType::Number(_) => json.as_f64().map(Value::Number),
            ValueType::Colour(_) => colour(json).map(Value::Colour),
            ValueType::Records(inner) => {
                let records = json.as_array()?.iter();
                let records = records.map(|record| self::values(record.as_object()?, inner, &[]).ok());
                records.collect::<Option<_>>().map(Value::Records)
            }
        });
        match (parameter, value) {
            (Some(parameter), Some(value)) => values.set(parameter.name, value),
            _ => {
                let message =
                    format!("metadata `material`: `{key}` = {json} is not a parameter of the model");
                return Err(Error::damaged(message));
            }
        }
    }
    Ok(values)
}

fn colour(json: &Json) -> Option<[f64; 3]> {
    match json.as_array()?.as_slice() {
        [red, green, blue] => Some([red.as_f64()?, green.as_f64()?, blue.as_f64()?]),
        _ => None,
    }
}

/// The shape of a table, without its channels, and its values.
fn table<const N: usize>(
    file: &TensorFile<'_>,
    name: &str,
    expected: &str,
) -> Result<([usize; N], Vec<[f32; 3]>), Error> {
    let tensor = file.tensor(name, Dtype::F32, expected)?;
    let wrong = || wrong_shape(name, expected, tensor.shape());
    let (Some((3, shape)), true) = (tensor.shape().split_last(), tensor.shape().len() == N + 1) else {
        return Err(wrong());
    };
    Ok((shape.try_into().map_err(|_| wrong())?, colours(&tensor)))
}

#[cfg(test)]
mod tests {
    use brdf::{Fresnel, Ggx, Lafortune, LafortuneLobe, Lambert, Phong, Standard, StandardParameters};

    use super::super::describe;
    use super::*;

    fn measured(scale: f64) -> Material {
        let values = (0..24).map(|i| [i as f32, 0.1, 1e-30]).collect();
        Material::Measured(Measured::new([2, 3, 4], values).unwrap().scaled([scale; 3]).unwrap())
    }

    /// All kinds of parameter: numbers, colours, some left out, arrays of tables; two tables, and layers in
    /// layers.
    fn rich() -> Material {
        let lobe = LafortuneLobe { cx: -0.95, cz: 0.1 + 0.2, n: 12.0, weight: [1.0, 0.5, 1.0 / 3.0] };
        let gold = Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
        let inner = Material::layers(vec![
            Material::Ggx(Ggx::new(0.3, gold, [0.5; 3]).unwrap()),
            Material::Lafortune(Lafortune::new([0.1; 3], vec![lobe, lobe]).unwrap()),
            measured(0.25),
        ]);
        Material::layers(vec![
            Material::Lambert(Lambert::new([0.1, 0.2, 0.3]).unwrap()),
            inner.unwrap(),
            measured(2.0),
        ])
        .unwrap()
    }

    #[test]
    fn a_material_is_what_its_bytes_decode_to() {
        let phong = Material::Phong(Phong::new(64.0, [1.0, 0.77, 0.34]).unwrap());
        for material in [phong, rich(), measured(1.0)] {
            let bytes = encode_material(&material, None).unwrap();
            assert_eq!(decode_material(&bytes).unwrap(), material);
            assert_eq!(bytes, encode_material(&decode_material(&bytes).unwrap(), None).unwrap());
        }
        let lacquer =
            StandardParameters { base_color: [0.5, 0.1, 0.1], sheen: [0.1; 3], ..Default::default() };
        let lacquer = Material::Standard(Standard::new(lacquer).unwrap());
        for part in [Part::Diffuse, Part::Specular] {
            let material = lacquer.part(part).unwrap();
            assert_eq!(decode_material(&encode_material(&material, None).unwrap()).unwrap(), material);
        }
        assert!(encode_material(&Material::Layers(Vec::new()), None).is_err());
    }

    #[test]
    fn a_texture_is_what_its_bytes_decode_to() {
        use brdf::{TexturePlacement, Wrap};
        let material = Material::Standard(Standard::new(StandardParameters::default()).unwrap());
        let texels: Vec<[u8; 3]> = (0..6).map(|k| [40 * k, 255 - k, 7]).collect();
        let placement = TexturePlacement {
            factor: [0.1 + 0.2, 1.0, 0.0],
            transform: [[0.1, -2.0, 1e-9], [1.0 / 3.0, 4.0, -7.5]],
            wrap: [Wrap::Mirror, Wrap::Clamp],
            is_nearest: true,
        };
        for placement in [placement, TexturePlacement::default()] {
            let texture = BaseColorTexture::new([3, 2], texels.clone(), placement).unwrap();
            let bytes = encode_textured_material(&material, Some(&texture), None).unwrap();
            let found = decode_textured_material(&bytes).unwrap();
            assert_eq!(found, (material.clone(), Some(texture)));
            assert_eq!(decode_material(&bytes).unwrap(), material);
            (0..bytes.len()).for_each(|length| assert!(decode_textured_material(&bytes[..length]).is_err()));
        }
        let bare = encode_material(&material, None).unwrap();
        assert_eq!(decode_textured_material(&bare).unwrap(), (material, None));
    }

    #[test]
    fn what_no_texture_has_is_an_error() {
        let sound =
            r#"{"factor":[1,1,1],"transform":[[1,0,0],[0,1,0]],"wrap":["repeat","clamp"],"filter":"linear"}"#;
        let error_of = |placement: &str, shape: &[usize]| {
            let mut file = Writer::new("material", None);
            file.entry(KEY, r#"{"model": "lambert", "albedo": [1, 1, 1]}"#);
            file.entry("base_color", placement);
            file.data.extend(vec![0; shape.iter().product()]);
            file.tensor("base_color", "U8", shape);
            decode_textured_material(&file.finish()).map(|_| ()).map_err(|error| error.to_string())
        };
        assert_eq!(error_of(sound, &[2, 1, 3]), Ok(()));
        for (placement, shape) in [
            (sound, &[2, 1, 4][..]),
            (sound, &[6]),
            (sound, &[0, 1, 3]),
            (sound, &[1, 1025, 3]),
            ("7", &[2, 1, 3]),
            (&sound.replace("clamp", "once"), &[2, 1, 3]),
            (&sound.replace("linear", "cubic"), &[2, 1, 3]),
            (&sound.replace("[1,1,1]", "[1,1]"), &[2, 1, 3]),
            (&sound.replace("[1,1,1]", "[1,2,1]"), &[2, 1, 3]),
            (&sound.replace("[0,1,0]", "[0,1]"), &[2, 1, 3]),
        ] {
            let error = error_of(placement, shape).unwrap_err();
            assert!(error.contains("base_color"), "{placement} {shape:?}: {error}");
        }
    }

    #[test]
    fn tables_that_depend_on_the_tangent_come_back() {
        let values = (0..24).map(|i| [0.5 * i as f32, 0.25, 1.0]).collect();
        let table = MeasuredAnisotropic::new([2, 3, 2, 2], values).unwrap().scaled([0.5, 1.0, 2.0]).unwrap();
        let both = Material::layers(vec![Material::MeasuredAnisotropic(table), measured(1.0)]).unwrap();
        let bytes = encode_material(&both, None).unwrap();
        assert_eq!(decode_material(&bytes).unwrap(), both);
        let tensors = describe(&bytes).unwrap().tensors;
        let shapes: Vec<_> = tensors.iter().map(|(name, _, shape)| (name.as_str(), shape)).collect();
        assert_eq!(shapes, [("table0", &vec![2, 3, 2, 2, 3]), ("table1", &vec![2, 3, 4, 3])]);
        let mut file = Writer::new("material", None);
        file.entry(KEY, r#"{"model": "measured-anisotropic", "scale": [1, 1, 1], "table": 0}"#);
        file.extend_f32(&[0.0; 24]);
        file.tensor("table0", "F32", &[2, 2, 2, 3]);
        let expected = "tensor `table0`: expected the shape [n_h, n_phi, n_d, n_psi, 3], found [2, 2, 2, 3]";
        assert_eq!(decode_material(&file.finish()).unwrap_err().to_string(), expected);
    }

    #[test]
    fn the_metadata_can_be_read_by_people() {
        let phong = Material::Phong(Phong::new(64.0, [1.0, 0.77, 0.34]).unwrap());
        let description = describe(&encode_material(&phong, None).unwrap()).unwrap();
        let expected = r#"{"exponent":64.0,"model":"phong","specular":[1.0,0.77,0.34]}"#;
        assert_eq!(description.metadata["material"], expected);
        let description = describe(&encode_material(&rich(), None).unwrap()).unwrap();
        let tables: Vec<_> =
            description.tensors.iter().map(|(name, _, shape)| (name.as_str(), shape)).collect();
        assert_eq!(tables, [("table0", &vec![2, 3, 4, 3]), ("table1", &vec![2, 3, 4, 3])]);
    }

    #[test]
    fn what_no_material_has_is_an_error() {
        let error_of = |tree: Json| {
            let mut file = Writer::new("material", None);
            file.entry(KEY, tree.to_string());
            decode_material(&file.finish()).unwrap_err().to_string()
        };
        let standard = Material::Standard(Standard::new(StandardParameters::default()).unwrap());
        let written = describe(&encode_material(&standard, None).unwrap()).unwrap().metadata;
        let mut matte: Json = serde_json::from_str(&written["material"]).unwrap();
        matte["part"] = "matte".into();
        for (tree, expected) in [
            (json!(3), "expected a model, found 3"),
            (json!({ "model": "fong" }), "expected a model of this version"),
            (json!({ "model": "phong" }), "phong: exponent is missing"),
            (json!({ "model": "phong", "exponent": -1, "specular": [1, 1, 1] }), "exponent: -1 is not"),
            (json!({ "model": "phong", "exponent": "a" }), "`exponent` = \"a\" is not a parameter"),
            (json!({ "model": "phong", "albedo": 1 }), "`albedo` = 1 is not a parameter"),
            (
                json!({ "model": "phong", "exponent": 1, "specular": [1, 1, 1], "part": "specular" }),
                "expected `part`",
            ),
            (matte, "expected `part`"),
            (json!({ "model": "layers", "layers": [] }), "there is no layer"),
            (json!({ "model": "layers" }), "expected layers"),
            (json!({ "model": "measured", "scale": [1, 1, 1], "table": 1 }), "expected table 0"),
            (json!({ "model": "measured", "scale": [1, 1, 1], "table": 0 }), "expected a tensor `table0`"),
            (json!({ "model": "measured", "table": 0 }), "a `scale` colour"),
            (json!({ "model": "measured", "file": 0 }), "measured has no parameter `file`"),
        ] {
            let found = error_of(tree);
            assert!(found.contains(expected), "{found}");
        }
    }
}
