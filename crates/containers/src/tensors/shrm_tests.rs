use super::*;

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
            let bytes = encode_shrm(&map, Some("{}")).unwrap();
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
fn zonal_rows_stand_at_q_zero() {
    let map = map(CUBE, View::Local, Terms::Zonal);
    let bytes = encode_shrm(&map, None).unwrap();
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
    let mut bytes = encode_shrm(map, None).unwrap();
    assert_eq!(from.len(), to.len());
    let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
    bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
    decode_shrm(&bytes).unwrap_err().to_string()
}

#[test]
fn faults_of_a_map_name_what_was_expected() {
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
        ("\"terms\":\"all\"", "\"terms\":\"few\"", "metadata `terms`: expected all or zonal, found `few`"),
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
        encode_shrm(&broken, None).unwrap_err().to_string(),
        "tensor `shrm`: expected finite values; texel 1, coefficient 4, channel 1 is not"
    );
}

#[test]
fn zonal_terms_are_held_to_their_word() {
    let all = map(CUBE, View::Local, Terms::All);
    let bytes = encode_shrm(&all, None).unwrap();
    let zonal = replace_word(&bytes, "\"terms\":\"all\"", "\"terms\":\"zonal\"");
    let message = decode_shrm(&zonal).unwrap_err().to_string();
    assert!(message.contains("`terms` is `zonal`: expected 0 where q is not 0"), "{message}");
    assert!(message.contains("in row 1 of texel 0"), "{message}");
    let local = encode_shrm(&map(CUBE, View::Local, Terms::Zonal), None).unwrap();
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
