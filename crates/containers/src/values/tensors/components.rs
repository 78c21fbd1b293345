//! Maps of components.

use sh::Light;
use shrm::components::{ComponentMap, FULL_SIZE_COMPONENTS, PackedComponents};

use super::file::{Writer, check_finite};
use crate::error::{Error, ErrorKind};
use crate::values::shrm_metadata::centre_name;

/// The texels along the edge of the square textures of a view's functions.
pub const WEIGHTS: usize = 64;

/// What a file with components says of itself, sorted by key; `kind` is left to the container.
///
/// | key | value |
/// | --- | --- |
/// | `centre` | what the map is looked up by: `reflection` or `normal` |
/// | `components` | K |
/// | `disc` | where a view lies in the weights |
/// | `edge` | the texels along the edge of a face, without its border |
/// | `frame` | the frame of directions, and that of a view on a face |
pub fn component_metadata(map: &ComponentMap) -> [(&'static str, String); 5] {
    let basis = map.basis();
    let frame = "right-handed, +Z up; cube coordinates (-y, z, x), faces +X -X +Y -Y +Z -Z as in KTX2, orientation rd, \
                 a border of one texel; on a face with centre a and axes u (to the right) and t (downward), about the \
                 central direction C, X = u - (C.u) / (1 + C.a) (C + a), and Y is the same of t";
    let disc = "D is the normal if the centre is reflection, the view if it is normal; \
                (D.X, D.Y) / sqrt(1 + D.C) within the unit circle, -1 at the left and at the top";
    [
        ("centre", centre_name(basis.centre()).to_owned()),
        ("components", basis.components().len().to_string()),
        ("disc", disc.to_owned()),
        ("edge", map.edge(0).to_string()),
        ("frame", frame.to_owned()),
    ]
}

/// A map of components: `components` [K, 6, edge + 2, edge + 2, 3] f32, and `weights` [K, 64, 64] f32, the
/// functions of the view ([`shrm::components::ComponentBasis::textures`]). `beside` are the lights that the
/// map does not hold: `lights` [n, 7] f64, if there are any.
///
/// # Errors
/// If a value is not finite, or components differ in resolution: [`encode_packed_components`] writes such a
/// map.
pub fn encode_components(
    map: &ComponentMap,
    beside: &[Light],
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let (mut file, count) = (writer(map, beside, recipe)?, map.basis().components().len());
    if (0..count).any(|k| map.edge(k) != map.edge(0)) {
        let text = "tensor `components`: expected components of one resolution";
        return Err(Error::new(ErrorKind::Unwritable, text));
    }
    for k in 0..count {
        check_finite("components", map.values(k).as_flattened(), ErrorKind::Unwritable)?;
        file.extend_f32(map.values(k).as_flattened());
    }
    let side = map.edge(0) + 2;
    file.tensor("components", "F32", &[count, 6, side, side, 3]);
    weights(&mut file, &map.basis().textures(WEIGHTS))?;
    Ok(file.finish())
}

/// A map of components in 8 bits: `sizes` [6, n, n, 3] f32 with n = edge + 2, `components` [4, 6, n, n, 3]
/// i8, `components_half` [K - 4, 6, m, m, 3] i8 with m = edge / 2 + 2, rounded up, if K is larger than 4, and
/// `weights` as [`encode_components`] has them, times s_k / 127 ([`PackedComponents`]).
///
/// # Errors
/// If a value is not finite.
pub fn encode_packed_components(
    map: &ComponentMap,
    beside: &[Light],
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    let count = map.basis().components().len();
    for k in 0..count {
        check_finite("components", map.values(k).as_flattened(), ErrorKind::Unwritable)?;
    }
    let (mut file, packed) = (writer(map, beside, recipe)?, PackedComponents::of(map));
    let side = |k: usize| map.edge(k) + 2;
    file.extend_f32(packed.sizes.as_flattened());
    file.tensor("sizes", "F32", &[6, side(0), side(0), 3]);
    let mut scaled = map.basis().textures(WEIGHTS);
    for (texture, scale) in scaled.chunks_exact_mut(WEIGHTS * WEIGHTS).zip(&packed.scales) {
        texture.iter_mut().for_each(|value| *value *= scale / 127.0);
    }
    weights(&mut file, &scaled)?;
    for (name, of_tensor) in [
        ("components", 0..FULL_SIZE_COMPONENTS.min(count)),
        ("components_half", FULL_SIZE_COMPONENTS.min(count)..count),
    ] {
        if of_tensor.is_empty() {
            continue;
        }
        for values in &packed.values[of_tensor.clone()] {
            file.data.extend(values.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        }
        let side = side(of_tensor.start);
        file.tensor(name, "I8", &[of_tensor.len(), 6, side, side, 3]);
    }
    Ok(file.finish())
}

/// A file with its entries and lights.
fn writer(map: &ComponentMap, beside: &[Light], recipe: Option<&str>) -> Result<Writer, Error> {
    let mut file = Writer::new("components", recipe);
    file.metadata.extend(component_metadata(map).map(|(key, value)| (key.to_owned(), value)));
    if !beside.is_empty() {
        file.entry("lamps", "separate");
        file.lights(beside)?;
    }
    Ok(file)
}

fn weights(file: &mut Writer, values: &[f32]) -> Result<(), Error> {
    check_finite("weights", values, ErrorKind::Unwritable)?;
    file.extend_f32(values);
    file.tensor("weights", "F32", &[values.len() / (WEIGHTS * WEIGHTS), WEIGHTS, WEIGHTS]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Lambert, Material, Phong, project};
    use safetensors::SafeTensors;
    use sh::{Degree, Expansion, Stop};
    use shrm::components::{ComponentBasis, ComponentCount, ComponentOptions, fit};
    use shrm::{Lamps, Reflection};
    use sphere::Direction;

    use super::*;

    fn map(material: Material, half: bool) -> ComponentMap {
        let degree = Degree::new(2).unwrap();
        let rows = (0..9).map(|row| [1.0 / (1.0 + f64::from(row)); 3]).collect();
        let light = Expansion::from_coefficients(degree, rows).unwrap();
        let brdf = project(&material, Choice::Degree { f: degree, p: degree }, Stop::NEVER).unwrap();
        let lamps = Lamps { lights: Vec::new(), material: material.clone() };
        let field = Reflection::convolve(&light, &brdf.coefficients).with_lamps(lamps);
        let basis = ComponentBasis::of(&material).unwrap();
        let options = ComponentOptions { edge: 5, count: ComponentCount::Fixed(6), half, bake: false };
        fit(&field, &basis, options, Stop::NEVER).unwrap().map
    }

    fn glossy() -> Material {
        let base = Material::Lambert(Lambert::new([0.2; 3]).unwrap());
        Material::layers(vec![base, Material::Phong(Phong::new(20.0, [0.5; 3]).unwrap())]).unwrap()
    }

    #[test]
    fn a_file_holds_the_texels_and_the_functions_of_the_view() {
        let map = map(glossy(), false);
        let light = Light::from_flux(Direction::X, 0.01, [1.0, 2.0, 3.0]);
        let bytes = encode_components(&map, &[light], Some("{}")).unwrap();
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let count = map.basis().components().len();
        let components = file.tensor("components").unwrap();
        assert_eq!(components.shape(), [count, 6, 7, 7, 3]);
        let expected: Vec<u8> = (0..count)
            .flat_map(|k| map.values(k).as_flattened().to_vec())
            .flat_map(f32::to_le_bytes)
            .collect();
        assert_eq!(components.data(), expected);
        assert_eq!(file.tensor("weights").unwrap().shape(), [count, 64, 64]);
        assert_eq!(file.tensor("lights").unwrap().shape(), [1, 7]);
        let described = super::super::describe(&bytes).unwrap().metadata;
        assert_eq!((&*described["kind"], &*described["centre"]), ("components", "reflection"));
        assert_eq!((&*described["edge"], &*described["lamps"]), ("5", "separate"));
    }

    #[test]
    fn a_packed_file_is_an_eighth_and_gives_the_texels_back() {
        let map = map(glossy(), true);
        let bytes = encode_packed_components(&map, &[], None).unwrap();
        let file = SafeTensors::deserialize(&bytes).unwrap();
        let count = map.basis().components().len();
        assert!(count > FULL_SIZE_COMPONENTS, "{count}");
        assert_eq!(file.tensor("components").unwrap().shape(), [4, 6, 7, 7, 3]);
        assert_eq!(file.tensor("components_half").unwrap().shape(), [count - 4, 6, 5, 5, 3]);
        let floats = |name: &str| -> Vec<f32> {
            let (words, _) = file.tensor(name).unwrap().data().as_chunks::<4>();
            words.iter().map(|word| f32::from_le_bytes(*word)).collect()
        };
        let (sizes, weights, plain) = (floats("sizes"), floats("weights"), map.basis().textures(WEIGHTS));
        // At the disc's centre the first component is about 1.
        let middle = 32 * WEIGHTS + 32;
        let bytes = file.tensor("components").unwrap().data();
        for (texel, value) in map.values(0).as_flattened().iter().enumerate() {
            let found = f32::from(bytes[texel] as i8) * sizes[texel] * weights[middle];
            assert!((found - value * plain[middle]).abs() < 0.01 * sizes[texel], "{texel}: {found} {value}");
        }
        assert!(encode_components(&map, &[], None).is_err(), "of two resolutions");
    }
}
