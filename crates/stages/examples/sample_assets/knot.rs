//! A trefoil of a thick tube, which casts shadows on itself: positions and normals in a binary glTF.

use std::f64::consts::TAU;

use sphere::DVec3;

/// The vertices around the knot, and around its tube.
const COLUMNS: u16 = 144;
const ROWS: u16 = 16;

/// The file.
pub(crate) fn glb() -> Vec<u8> {
    let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for column in 0..COLUMNS {
        for row in 0..ROWS {
            let (position, normal) = point(f64::from(column), f64::from(row));
            positions.push(position.as_vec3().to_array());
            normals.push(normal.as_vec3().to_array());
            let vertex = |column: u16, row: u16| column % COLUMNS * ROWS + row % ROWS;
            let [a, b] = [vertex(column, row), vertex(column + 1, row)];
            let [c, d] = [vertex(column + 1, row + 1), vertex(column, row + 1)];
            indices.extend([a, c, b, a, d, c]);
        }
    }
    let count = positions.len();
    let extreme = |pick: fn(f32, f32) -> f32, start: f32| {
        let fold = |axis: usize| positions.iter().fold(start, |most, at| pick(most, at[axis]));
        [fold(0), fold(1), fold(2)]
    };
    let (least, most) = (extreme(f32::min, f32::INFINITY), extreme(f32::max, f32::NEG_INFINITY));
    let mut bytes: Vec<u8> = Vec::new();
    let floats = positions.iter().chain(&normals).flatten().flat_map(|value| value.to_le_bytes());
    bytes.extend(floats);
    bytes.extend(indices.iter().flat_map(|index: &u16| index.to_le_bytes()));
    let (vertices, end) = (12 * count, bytes.len());
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}},"indices":2}}]}}],"buffers":[{{"byteLength":{end}}}],"bufferViews":[{{"buffer":0,"byteLength":{vertices},"target":34962}},{{"buffer":0,"byteOffset":{vertices},"byteLength":{vertices},"target":34962}},{{"buffer":0,"byteOffset":{},"byteLength":{},"target":34963}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":{least:?},"max":{most:?}}},{{"bufferView":1,"componentType":5126,"count":{count},"type":"VEC3"}},{{"bufferView":2,"componentType":5123,"count":{},"type":"SCALAR"}}]}}"#,
        2 * vertices,
        end - 2 * vertices,
        indices.len()
    );
    container(&json, &bytes)
}

/// The point of the tube at a column and a row, and its normal, in the file's frame.
fn point(column: f64, row: f64) -> (DVec3, DVec3) {
    let (about, around, tube) = (0.56, 0.26, 0.2);
    let t = TAU * column / f64::from(COLUMNS);
    let (sine, cosine) = (2.0 * t).sin_cos();
    let (rise, reach) = (3.0 * t).sin_cos();
    // The knot lies on a torus about +Z of the file, the front.
    let outward = DVec3::new(cosine, sine, 0.0);
    let centre = outward * (about + around * reach) + DVec3::Z * (around * rise);
    let along = DVec3::new(-sine, cosine, 0.0) * (2.0 * (about + around * reach))
        + (DVec3::Z * reach - outward * rise) * (3.0 * around);
    let up = outward * reach + DVec3::Z * rise;
    let (side, level) = (TAU * row / f64::from(ROWS)).sin_cos();
    let normal = up * level + along.normalize().cross(up) * side;
    (centre + normal * tube, normal)
}

/// A binary glTF of a document and its buffer.
fn container(json: &str, bytes: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let chunk =
        |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], &kind[..], data].concat();
    let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &bytes)].concat();
    let length = 12 + chunks.len() as u32;
    [b"glTF".to_vec(), 2_u32.to_le_bytes().to_vec(), length.to_le_bytes().to_vec(), chunks].concat()
}
