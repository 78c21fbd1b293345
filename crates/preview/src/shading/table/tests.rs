use brdf::{Material, tabulate};
use sh::{Degree, Expansion, Stop};
use transfer::{FixedLight, Frames, Viewer, quarter_turns};

use super::*;
use crate::shading::turned_light::{angles_of, frame_at};

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// A grey table, one in colour, one that is mirrored at the horizon, one of three materials, and one of three
/// by two; with lights of more, of fewer and of as many degrees.
fn cases() -> [(BrdfTable, usize); 5] {
    let ward = |specular| Material::Ward(brdf::Ward::new([0.3, 0.6], specular).unwrap());
    let hair = Material::KajiyaKay(brdf::KajiyaKay::new(8.0, [0.9, 0.6, 0.3]).unwrap());
    let table = |material: &Material, l: usize| tabulate(material, degree(l), 16, Stop::NEVER).unwrap().0;
    let three = [ward([0.2; 3]), hair.clone(), ward([1.0; 3])].map(|material| table(&material, 3));
    [
        (table(&ward([1.0; 3]), 4), 5),
        (table(&ward([1.0, 0.5, 0.2]), 4), 3),
        (table(&hair, 3), 3),
        (BrdfTable::joined(&three).unwrap(), 4),
        (BrdfTable::joined(&[three.clone(), three].concat()).unwrap().with_grid([3, 2]).unwrap(), 3),
    ]
}

fn light(l: usize) -> Expansion {
    let value = |row: usize, channel: usize| ((row * 3 + channel) as f64 * 12.9898).sin();
    let rows = (0..degree(l).rows()).map(|row| [0, 1, 2].map(|channel| value(row, channel))).collect();
    Expansion::from_coefficients(degree(l), rows).unwrap()
}

/// A sphere with every place among materials, the ends and those in the middle included.
fn sphere() -> Frames {
    let frames = Frames::of(&mesh::shape("sphere").unwrap()).unwrap();
    let place = |vertex: usize| [(vertex % 9) as f32 / 8.0, (vertex % 7) as f32 / 6.0];
    let blend: Vec<[f32; 2]> = (0..frames.len()).map(place).collect();
    frames.with_blend(&blend)
}

/// The view in the frame of a vertex.
fn local(frames: &Frames, vertex: usize, viewer: [f64; 3]) -> Vec3 {
    let view = Vec3::from(viewer.map(|value| value as f32)) - Vec3::from(frames.positions()[vertex]);
    Vec3::from(frames.axes(vertex).map(|axis| Vec3::from(axis).dot(view.normalize())))
}

/// The light in the coordinates of the mesh, [rows, 3].
fn whole(l: usize) -> Vec<f32> {
    light(l).coefficients().iter().flat_map(|rgb| rgb.map(|value| value as f32)).collect()
}

/// The angles of the frame of a vertex.
fn angles(frames: &Frames, vertex: usize) -> [[f32; 2]; 3] {
    let [x, _, normal] = frames.axes(vertex).map(Vec3::from);
    angles_of(frame_at(x, normal))
}

/// Views from everywhere, below the horizon too. Both round in f32, a few times for each coefficient.
#[test]
fn it_shades_as_the_kernel_does() {
    let frames = sphere();
    let viewer = [2.0, -1.0, 0.5];
    for (table, l) in cases() {
        let expected = FixedLight::new(&frames, &light(l)).shade(&frames, &table, Viewer::At(viewer));
        let (whole, quarter_turns) = (whole(l), quarter_turns(degree(l)));
        let uniforms = TableUniforms::new(&table, degree(l).rows());
        for vertex in (0..frames.len()).step_by(13) {
            let (view, blend) = (local(&frames, vertex, viewer), Vec2::from(frames.blend(vertex)));
            let turn = Turn { quarter_turns: &quarter_turns, angles: angles(&frames, vertex) };
            let lights = ([&whole[..]; 3], [0.5, 0.3, 0.2]);
            let found = table_radiance(uniforms, table.values(), lights, turn, view, blend);
            let apart = (found - Vec3::from(expected[vertex])).length();
            assert!(apart < 2e-5, "{vertex}: {found} {:?}", expected[vertex]);
        }
    }
}

#[cfg(feature = "gpu")]
#[test]
fn the_shader_shades_alike() {
    use crate::shading::on_device::{answers, device};

    let Some(device) = device("the_shader_shades_alike") else { return };
    let frames = sphere();
    let count = 300;
    for (table, l) in cases() {
        let (rows, quarter_turns) = (degree(l).rows(), quarter_turns(degree(l)));
        // Each vertex has a light of its own.
        let of_vertex =
            |vertex: usize| whole(l).into_iter().map(move |value| value * (1.0 + 0.1 * (vertex % 7) as f32));
        let kept: Vec<f32> = (0..count).flat_map(of_vertex).collect();
        let uniforms = TableUniforms::new(&table, rows);
        let views: Vec<Vec3> = (0..count).map(|vertex| local(&frames, vertex, [2.0, -1.0, 0.5])).collect();
        let asked: Vec<[f32; 4]> = (0..)
            .zip(&views)
            .flat_map(|(vertex, view)| {
                let ([first, second], [x, _, normal]) = (frames.blend(vertex), frames.axes(vertex));
                let [x, normal] = [x, normal].map(|axis| Vec3::from(axis).extend(0.0).to_array());
                [view.extend(first).to_array(), [second, 0.0, 0.0, 0.0], x, normal]
            })
            .collect();
        let TableUniforms { size, rows: of_table, channels, mirrored, light_rows, along, across } = uniforms;
        let source = format!(
            "@group(3) @binding(0) var<storage, read> table_values: array<f32>;
            @group(3) @binding(1) var<storage, read> table_light: array<f32>;
            @group(3) @binding(2) var<storage, read> quarter_turns: array<vec2f>;
            {}
            {}
            {}
            fn answer(k: u32) -> vec3f {{
                let table = TableUniforms(
                    {size}u, {of_table}u, {channels}u, {mirrored}u, {light_rows}u, {along}u, {across}u
                );
                let vertices = vec3u(k, (k + 7u) % 300u, (k + 50u) % 300u);
                let frame = frame_at(asked[4u * k + 2u].xyz, asked[4u * k + 3u].xyz);
                let lookup =
                    table_lookup(table, asked[4u * k].xyz, vec2f(asked[4u * k].w, asked[4u * k + 1u].x));
                let at = TablePoint(lookup, vertices, vec3f(0.5, 0.3, 0.2));
                return table_radiance(table, at, frame);
            }}",
            include_str!("../turned_light.wgsl"),
            include_str!("../table.wgsl"),
            include_str!("../../gpu/table_buffers.wgsl")
        );
        let buffers = [
            bytemuck::cast_slice(table.values()),
            bytemuck::cast_slice(&kept),
            bytemuck::cast_slice(&quarter_turns),
        ];
        let found = answers(&device, &source, &asked, count, &buffers);
        for (vertex, view) in views.iter().enumerate() {
            let blend = Vec2::from(frames.blend(vertex));
            let light_of = |vertex: usize| &kept[vertex * 3 * rows..][..3 * rows];
            let lights = ([0, 7, 50].map(|step| light_of((vertex + step) % count)), [0.5, 0.3, 0.2]);
            let turn = Turn { quarter_turns: &quarter_turns, angles: angles(&frames, vertex) };
            let expected = table_radiance(uniforms, table.values(), lights, turn, *view, blend);
            let apart = (Vec3::from(found[vertex]) - expected).length();
            assert!(apart < 2e-5, "{vertex}: {:?} {expected}", found[vertex]);
        }
    }
}
