use brdf::{Material, tabulate};
use sh::{Degree, Expansion, Stop};
use transfer::{FixedLight, Frames, Viewer};

use super::*;

fn degree(l: usize) -> Degree {
    Degree::new(l).unwrap()
}

/// A grey table, one in colour, one that is mirrored at the horizon, and one of three materials; with lights
/// of more, of fewer and of as many degrees.
fn cases() -> [(BrdfTable, usize); 4] {
    let ward = |specular| Material::Ward(brdf::Ward::new([0.3, 0.6], specular).unwrap());
    let hair = Material::KajiyaKay(brdf::KajiyaKay::new(8.0, [0.9, 0.6, 0.3]).unwrap());
    let table = |material: &Material, l: usize| tabulate(material, degree(l), 16, Stop::NEVER).unwrap().0;
    let three = [ward([0.2; 3]), hair.clone(), ward([1.0; 3])].map(|material| table(&material, 3));
    [
        (table(&ward([1.0; 3]), 4), 5),
        (table(&ward([1.0, 0.5, 0.2]), 4), 3),
        (table(&hair, 3), 3),
        (BrdfTable::joined(&three).unwrap(), 4),
    ]
}

fn light(l: usize) -> Expansion {
    let value = |row: usize, channel: usize| ((row * 3 + channel) as f64 * 12.9898).sin();
    let rows = (0..degree(l).rows()).map(|row| [0, 1, 2].map(|channel| value(row, channel))).collect();
    Expansion::from_coefficients(degree(l), rows).unwrap()
}

/// A sphere with every place between materials, both ends and the one in the middle included.
fn sphere() -> Frames {
    let frames = Frames::of(&mesh::shape("sphere").unwrap()).unwrap();
    let blend: Vec<f32> = (0..frames.len()).map(|vertex| (vertex % 9) as f32 / 8.0).collect();
    frames.with_blend(&blend)
}

/// The view in the frame of a vertex.
fn local(frames: &Frames, vertex: usize, viewer: [f64; 3]) -> Vec3 {
    let view = Vec3::from(viewer.map(|value| value as f32)) - Vec3::from(frames.positions()[vertex]);
    Vec3::from(frames.axes(vertex).map(|axis| Vec3::from(axis).dot(view.normalize())))
}

/// Views from everywhere, below the horizon too. Both round in f32, a few times for each coefficient.
#[test]
fn it_shades_as_the_kernel_does() {
    let frames = sphere();
    let viewer = [2.0, -1.0, 0.5];
    for (table, l) in cases() {
        let kept = FixedLight::new(&frames, &light(l));
        let expected = kept.shade(&frames, &table, Viewer::At(viewer));
        let kept = kept.values();
        let rows = degree(l).rows();
        let uniforms = TableUniforms::new(&table, rows);
        for vertex in (0..frames.len()).step_by(13) {
            let light = &kept[vertex * 3 * rows..][..3 * rows];
            let (view, blend) = (local(&frames, vertex, viewer), frames.blend(vertex));
            let found = table_radiance(uniforms, table.values(), light, view, blend);
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
        let rows = degree(l).rows();
        let kept = FixedLight::new(&frames, &light(l)).values();
        let uniforms = TableUniforms::new(&table, rows);
        let views: Vec<Vec3> = (0..count).map(|vertex| local(&frames, vertex, [2.0, -1.0, 0.5])).collect();
        let asked: Vec<[f32; 4]> =
            (0..).zip(&views).map(|(vertex, view)| view.extend(frames.blend(vertex)).to_array()).collect();
        let TableUniforms { size, rows: of_table, channels, mirrored, light_rows, count: q } = uniforms;
        let source = format!(
            "@group(3) @binding(0) var<storage, read> table_values: array<f32>;
            @group(3) @binding(1) var<storage, read> table_light: array<f32>;
            {}
            fn answer(k: u32) -> vec3f {{
                let table = TableUniforms({size}u, {of_table}u, {channels}u, {mirrored}u, {light_rows}u, {q}u);
                return table_radiance(table, k, asked[k].xyz, asked[k].w);
            }}",
            include_str!("../table.wgsl")
        );
        let buffers = [bytemuck::cast_slice(table.values()), bytemuck::cast_slice(&kept)];
        let found = answers(&device, &source, &asked, count, &buffers);
        for (vertex, view) in views.iter().enumerate() {
            let light = &kept[vertex * 3 * rows..][..3 * rows];
            let blend = frames.blend(vertex);
            let expected = table_radiance(uniforms, table.values(), light, *view, blend);
            let apart = (Vec3::from(found[vertex]) - expected).length();
            assert!(apart < 2e-5, "{vertex}: {:?} {expected}", found[vertex]);
        }
    }
}
