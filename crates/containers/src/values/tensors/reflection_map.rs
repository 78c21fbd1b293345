//! A spherical harmonic reflection map, with what a person needs to read it in the metadata.

use safetensors::tensor::Dtype;
use sh::Light;
use shrm::{MapGrid, Shrm, Terms, View};
use sphere::{Cube, LatLong};

use super::file::{TensorFile, Writer, check_finite, colours, degree, wrong_shape};
use crate::error::{Error, ErrorKind};
use crate::values::shrm_metadata::shrm_metadata;

/// A spherical harmonic reflection map: `shrm` [faces, height, width, (P+1)^2, 3] f32, zeros included.
/// `beside` are the lights that the map does not hold: `lights` [n, 7] f64, if there are any.
///
/// # Errors
/// If a value is not finite.
pub fn encode_shrm(map: &Shrm, beside: &[Light], recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let rows = map.p().rows();
    let [faces, height, width] = map.grid().shape();
    if let Some(first) = map.values().as_flattened().iter().position(|value| !value.is_finite()) {
        let (texel, rest) = (first / (3 * map.rows()), first % (3 * map.rows()));
        return Err(Error::new(
            ErrorKind::Unwritable,
            format!(
                "tensor `shrm`: expected finite values; texel {texel}, coefficient {}, channel {} is not",
                rest / 3,
                rest % 3
            ),
        ));
    }
    let mut file = Writer::new("shrm", recipe);
    file.metadata.extend(shrm_metadata(map).map(|(key, value)| (key.to_owned(), value)));
    if !beside.is_empty() {
        file.entry("lamps", "separate");
        file.lights(beside)?;
    }
    file.data.reserve_exact(4 * 3 * rows * map.grid().len());
    for texel in 0..map.grid().len() {
        let values = map.texel(texel);
        match map.terms() {
            Terms::All => file.extend_f32(values.as_flattened()),
            Terms::Zonal => {
                for (p, value) in values.iter().enumerate() {
                    file.extend_f32([[0.0; 3]].repeat(p).as_flattened());
                    file.extend_f32(value);
                    file.extend_f32([[0.0; 3]].repeat(p).as_flattened());
                }
            }
        }
    }
    file.tensor("shrm", "F32", &[faces, height, width, rows, 3]);
    Ok(file.finish())
}

/// A spherical harmonic reflection map, from a file of kind `shrm`.
///
/// # Errors
/// The errors of [`super::decode_lighting`], and errors if the shape is not that of the `layout`, or if
/// `terms` is `zonal` and a coefficient with q other than 0 is not zero.
pub fn decode_shrm(bytes: &[u8]) -> Result<Shrm, Error> {
    const NAME: &str = "shrm";
    const SHAPE: &str = "[faces, height, width, (P+1)^2, 3]";
    let file = TensorFile::open_as(bytes, "shrm")?;
    let centre = file.centre("")?;
    let cube = file.choice("layout", [("lat-long", false), ("cube", true)])?;
    let view = file.choice("view", [("local", View::Local), ("global", View::Global)])?;
    let terms = file.choice("terms", [("all", Terms::All), ("zonal", Terms::Zonal)])?;
    let tensor = file.tensor(NAME, Dtype::F32, SHAPE)?;
    let wrong = |expected: &str| wrong_shape(NAME, expected, tensor.shape());
    let &[faces, height, width, rows, 3] = tensor.shape() else { return Err(wrong(SHAPE)) };
    let grid = match (cube, faces) {
        (true, 6) if height == width => MapGrid::Cube(Cube { edge: width }),
        (true, _) => return Err(wrong("[6, edge, edge, (P+1)^2, 3] of a cube")),
        (false, 1) => MapGrid::LatLong(LatLong { width, height }),
        (false, _) => return Err(wrong("[1, height, width, (P+1)^2, 3] of a lat-long map")),
    };
    let side = rows.isqrt();
    if side == 0 || side * side != rows {
        return Err(wrong(SHAPE));
    }
    let p = degree(NAME, side - 1)?;
    let mut values = colours(&tensor);
    check_finite(NAME, values.as_flattened(), ErrorKind::Damaged)?;
    if terms == Terms::Zonal {
        let mut zonal = Vec::with_capacity(values.len() / rows * side);
        for (texel, values) in values.chunks_exact(rows).enumerate() {
            for (row, value) in values.iter().enumerate() {
                let p = row.isqrt();
                if row == p * p + p {
                    zonal.push(*value);
                } else if *value != [0.0; 3] {
                    return Err(Error::damaged(format!(
                        "tensor `shrm`: `terms` is `zonal`: expected 0 where q is not 0, found {value:?} in row {row} of texel {texel}"
                    )));
                }
            }
        }
        values = zonal;
    }
    Shrm::new(grid, view, centre, p, terms, values).ok_or_else(|| {
        Error::damaged(
            "`shrm`: expected a texel, and `terms` `all` where `view` is `global`; a rotation mixes q",
        )
    })
}

/// The lights beside a map, from a file of kind `shrm`; none if the map holds them all.
///
/// A reader adds, for each, its irradiance times rho_hat of the light's direction and the view.
///
/// # Errors
/// The errors of [`super::decode_lighting`].
pub fn decode_lights(bytes: &[u8]) -> Result<Vec<Light>, Error> {
    TensorFile::open_as(bytes, "shrm")?.lights()
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use safetensors::SafeTensors;
    use sh::Degree;
    use sphere::Direction;

    use super::*;
    use crate::values::tensors::{describe, read_recipe};

    fn map(grid: MapGrid, view: View, terms: Terms) -> Shrm {
        let p = Degree::new(2).unwrap();
        let rows = if terms == Terms::All { 9 } else { 3 };
        let values = (0..grid.len() * rows).map(|i| [i as f32, -0.1 * i as f32, 1e-30]).collect();
        Shrm::new(grid, view, Centre::Normal, p, terms, values).unwrap()
    }

    const CUBE: MapGrid = MapGrid::Cube(Cube { edge: 2 });
    const LAT_LONG: MapGrid = MapGrid::LatLong(LatLong { width: 5, height: 3 });

    #[test]
    fn a_map_comes_back_bit_for_bit() {
        for grid in [CUBE, LAT_LONG] {
            for (view, terms) in
                [(View::Local, Terms::All), (View::Local, Terms::Zonal), (View::Global, Terms::All)]
            {
                let map = map(grid, view, terms);
                let bytes = encode_shrm(&map, &[], Some("{}")).unwrap();
                assert_eq!(decode_shrm(&bytes).unwrap(), map);
                assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"));
                let description = describe(&bytes).unwrap();
                // All rows, whatever the map keeps.
                let [faces, height, width] = grid.shape();
                assert_eq!(
                    description.tensors,
                    [("shrm".into(), "F32".into(), vec![faces, height, width, 9, 3])]
                );
                assert_eq!(description.metadata["degree"], "2");
            }
        }
    }

    #[test]
    fn lights_beside_a_map_come_back_bit_for_bit() {
        let map = map(CUBE, View::Local, Terms::All);
        let light = |theta, irradiance| {
            let direction = Direction::normalised(Direction::from_angles(theta, 0.3).vector());
            Light { direction, radius: 0.01 * theta, irradiance }
        };
        let lights = [light(0.4, [3.0, 2.0, 0.1]), light(2.0, [0.0, 1e-3, 5e4])];
        let bytes = encode_shrm(&map, &lights, None).unwrap();
        assert_eq!(decode_lights(&bytes).unwrap(), lights);
        assert_eq!(decode_shrm(&bytes).unwrap(), map);
        assert_eq!(describe(&bytes).unwrap().metadata["lamps"], "separate");
        assert_eq!(decode_lights(&encode_shrm(&map, &[], None).unwrap()).unwrap(), []);
    }

    #[test]
    fn zonal_rows_stand_at_q_zero() {
        let map = map(CUBE, View::Local, Terms::Zonal);
        let bytes = encode_shrm(&map, &[], None).unwrap();
        let tensors = SafeTensors::deserialize(&bytes).unwrap();
        let data = tensors.tensor("shrm").unwrap().data();
        let value = |texel: usize, row: usize| {
            let at = 12 * (9 * texel + row);
            f32::from_le_bytes(data[at..at + 4].try_into().unwrap())
        };
        for texel in 0..24 {
            for row in 0..9 {
                let expected = match row {
                    0 => map.texel(texel)[0][0],
                    2 => map.texel(texel)[1][0],
                    6 => map.texel(texel)[2][0],
                    _ => 0.0,
                };
                assert_eq!(value(texel, row), expected, "texel {texel}, row {row}");
            }
        }
    }

    /// A file of a map with one text of its header replaced by another of the same length.
    fn changed(map: &Shrm, from: &str, to: &str) -> String {
        let mut bytes = encode_shrm(map, &[], None).unwrap();
        assert_eq!(from.len(), to.len());
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        decode_shrm(&bytes).unwrap_err().to_string()
    }

    #[test]
    fn errors_of_a_map_name_what_was_expected() {
        let cube = map(CUBE, View::Local, Terms::All);
        for (from, to, message) in [
            (
                "[6,2,2,9,3]",
                "[2,6,2,9,3]",
                "tensor `shrm`: expected the shape [6, edge, edge, (P+1)^2, 3] of a cube",
            ),
            (
                "[6,2,2,9,3]",
                "[6,2,2,3,9]",
                "tensor `shrm`: expected the shape [faces, height, width, (P+1)^2, 3]",
            ),
            (
                "\"view\":\"local\"",
                "\"view\":\"lokal\"",
                "metadata `view`: expected local or global, found `lokal`",
            ),
            (
                "\"layout\":\"cube\"",
                "\"layout\":\"dome\"",
                "metadata `layout`: expected lat-long or cube, found `dome`",
            ),
            (
                "\"centre\":\"normal\"",
                "\"centre\":\"middle\"",
                "metadata `centre`: expected reflection, normal or tangent",
            ),
            (
                "\"terms\":\"all\"",
                "\"terms\":\"few\"",
                "metadata `terms`: expected all or zonal, found `few`",
            ),
            ("\"kind\":\"shrm\"", "\"kind\":\"shrn\"", "expected a file of kind `shrm`, found kind `shrn`"),
        ] {
            let found = changed(&cube, from, to);
            assert!(found.contains(message), "{found}");
        }
        let lat_long = changed(&map(LAT_LONG, View::Local, Terms::All), "[1,3,5,9,3]", "[5,3,1,9,3]");
        assert!(lat_long.contains("[1, height, width, (P+1)^2, 3] of a lat-long map, found [5, 3, 1, 9, 3]"));
        let mut values = cube.values().to_vec();
        values[13][1] = f32::NAN;
        let broken = Shrm::new(CUBE, View::Local, Centre::Normal, cube.p(), Terms::All, values).unwrap();
        assert_eq!(
            encode_shrm(&broken, &[], None).unwrap_err().to_string(),
            "tensor `shrm`: expected finite values; texel 1, coefficient 4, channel 1 is not"
        );
    }

    #[test]
    fn zonal_terms_are_held_to_their_word() {
        let all = map(CUBE, View::Local, Terms::All);
        let bytes = encode_shrm(&all, &[], None).unwrap();
        let zonal = replace_word(&bytes, "\"terms\":\"all\"", "\"terms\":\"zonal\"");
        let message = decode_shrm(&zonal).unwrap_err().to_string();
        assert!(message.contains("`terms` is `zonal`: expected 0 where q is not 0"), "{message}");
        assert!(message.contains("in row 1 of texel 0"), "{message}");
        let local = encode_shrm(&map(CUBE, View::Local, Terms::Zonal), &[], None).unwrap();
        let global = replace_word(&local, "\"view\":\"local\"", "\"view\":\"global\"");
        assert!(decode_shrm(&global).unwrap_err().to_string().contains("a rotation mixes q"));
    }

    /// A file with one word of its header replaced by another of any length.
    fn replace_word(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
        let length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let header = std::str::from_utf8(&bytes[8..8 + length]).unwrap().replace(from, to);
        let header = header.trim_end();
        let padded = header.len().next_multiple_of(8);
        let mut changed = (padded as u64).to_le_bytes().to_vec();
        changed.extend_from_slice(format!("{header:padded$}").as_bytes());
        changed.extend_from_slice(&bytes[8 + length..]);
        changed
    }
}
