//! Binary glTF of one mesh, or of parts with materials.

/// The vertices and triangles of a mesh, in the file's frame (+Y up).
pub(crate) struct Shape {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
    /// Numbers for each vertex, with their names, `_BLEND` for instance.
    pub(crate) attributes: Vec<(&'static str, Vec<f32>)>,
    /// Corners of triangles, three each.
    pub(crate) indices: Vec<u16>,
}

/// The file of a shape.
pub(crate) fn glb(shape: &Shape) -> Vec<u8> {
    let Shape { positions, normals, attributes, indices } = shape;
    let count = positions.len();
    let extreme = |pick: fn(f32, f32) -> f32, start: f32| {
        let fold = |axis: usize| positions.iter().fold(start, |most, at| pick(most, at[axis]));
        [fold(0), fold(1), fold(2)]
    };
    let (least, most) = (extreme(f32::min, f32::INFINITY), extreme(f32::max, f32::NEG_INFINITY));
    let mut bytes: Vec<u8> = Vec::new();
    let floats = positions.iter().chain(normals).flatten().flat_map(|value| value.to_le_bytes());
    bytes.extend(floats);
    bytes.extend(indices.iter().flat_map(|index: &u16| index.to_le_bytes()));
    let (vertices, corners) = (12 * count, indices.len());
    let mut extra = [String::new(), String::new(), String::new()];
    for (index, (name, values)) in (3..).zip(attributes) {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let offset = bytes.len();
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        extra[0] += &format!(r#","{name}":{index}"#);
        extra[1] +=
            &format!(r#",{{"buffer":0,"byteOffset":{offset},"byteLength":{},"target":34962}}"#, 4 * count);
        extra[2] +=
            &format!(r#",{{"bufferView":{index},"componentType":5126,"count":{count},"type":"SCALAR"}}"#);
    }
    let [named, view, accessor] = extra;
    let end = bytes.len();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1{named}}},"indices":2}}]}}],"buffers":[{{"byteLength":{end}}}],"bufferViews":[{{"buffer":0,"byteLength":{vertices},"target":34962}},{{"buffer":0,"byteOffset":{vertices},"byteLength":{vertices},"target":34962}},{{"buffer":0,"byteOffset":{},"byteLength":{},"target":34963}}{view}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3","min":{least:?},"max":{most:?}}},{{"bufferView":1,"componentType":5126,"count":{count},"type":"VEC3"}},{{"bufferView":2,"componentType":5123,"count":{corners},"type":"SCALAR"}}{accessor}]}}"#,
        2 * vertices,
        2 * corners,
    );
    container(&json, &bytes)
}

/// A matte material; colours are linear.
pub(crate) struct Material {
    pub(crate) name: &'static str,
    pub(crate) colour: [f32; 3],
    pub(crate) emission: [f32; 3],
}

/// A shape and what it is made of.
pub(crate) struct Part {
    pub(crate) material: Material,
    pub(crate) shape: Shape,
}

/// The file of parts: a node, a mesh and a material of its name for each. Attributes are not written.
pub(crate) fn parts_as_glb(parts: &[Part]) -> Vec<u8> {
    let mut bytes: Vec<u8> = Vec::new();
    let [mut nodes, mut meshes, mut materials, mut views, mut accessors] =
        std::array::from_fn(|_| Vec::new());
    for (k, Part { material: Material { name, colour: [r, g, b], emission }, shape }) in
        parts.iter().enumerate()
    {
        let Shape { positions, normals, indices, .. } = shape;
        let mut view = |data: Vec<u8>, target: u32| {
            let (offset, length) = (bytes.len(), data.len());
            views.push(format!(
                r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"target":{target}}}"#
            ));
            bytes.extend(data);
            bytes.resize(bytes.len().next_multiple_of(4), 0);
        };
        view(positions.iter().flatten().flat_map(|value| value.to_le_bytes()).collect(), 34962);
        view(normals.iter().flatten().flat_map(|value| value.to_le_bytes()).collect(), 34962);
        view(indices.iter().flat_map(|index| index.to_le_bytes()).collect(), 34963);
        let [least, most] = [f32::min, f32::max].map(|pick: fn(f32, f32) -> f32| {
            [0, 1, 2].map(|axis| positions.iter().map(|at| at[axis]).reduce(pick).unwrap_or(0.0))
        });
        let (count, corners, at) = (positions.len(), indices.len(), 3 * k);
        accessors.push(format!(
            r#"{{"bufferView":{at},"componentType":5126,"count":{count},"type":"VEC3","min":{least:?},"max":{most:?}}},{{"bufferView":{},"componentType":5126,"count":{count},"type":"VEC3"}},{{"bufferView":{},"componentType":5123,"count":{corners},"type":"SCALAR"}}"#,
            at + 1,
            at + 2,
        ));
        let emissive =
            if emission == &[0.0; 3] { String::new() } else { format!(r#","emissiveFactor":{emission:?}"#) };
        materials.push(format!(
            r#"{{"name":"{name}","pbrMetallicRoughness":{{"baseColorFactor":[{r:?},{g:?},{b:?},1.0],"metallicFactor":0.0}}{emissive}}}"#
        ));
        meshes.push(format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":{at},"NORMAL":{}}},"indices":{},"material":{k}}}]}}"#,
            at + 1,
            at + 2,
        ));
        nodes.push(format!(r#"{{"name":"{name}","mesh":{k}}}"#));
    }
    let numbers: Vec<_> = (0..parts.len()).map(|k| k.to_string()).collect();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{}],"materials":[{}],"buffers":[{{"byteLength":{}}}],"bufferViews":[{}],"accessors":[{}]}}"#,
        numbers.join(","),
        nodes.join(","),
        meshes.join(","),
        materials.join(","),
        bytes.len(),
        views.join(","),
        accessors.join(","),
    );
    container(&json, &bytes)
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
