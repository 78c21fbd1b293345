//! The shaders of users' maps on a graphics device: what `specula inspect --shader` prints.

use brdf::Centre;
use bytemuck::cast_slice;
use sh::Degree;
use shrm::shader::{ComponentShader, Language, MapShader};
use shrm::{MapGrid, Shrm, Terms, View};
use sphere::{Cube, LatLong, spiral};

use super::on_device;

const GRIDS: [MapGrid; 2] =
    [MapGrid::Cube(Cube { edge: 5 }), MapGrid::LatLong(LatLong { width: 10, height: 5 })];

/// A map of noise; `None` if there is none with these terms.
fn map(grid: MapGrid, view: View, terms: Terms, p: usize) -> Option<Shrm> {
    let p = Degree::new(p).unwrap();
    let rows = if terms == Terms::All { p.rows() } else { p.get() + 1 };
    let value = |i: usize| (((i * 2_654_435_761) >> 7) % 1000) as f32 / 500.0 - 1.0;
    let values = (0..grid.len() * rows).map(|i| [0, 1, 2].map(|channel| value(3 * i + channel))).collect();
    Shrm::new(grid, view, Centre::Reflection, p, terms, values)
}

fn check(source: &str) {
    use wgpu::naga::front::wgsl::parse_str;
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
    let module = parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let valid = validator.validate(&module);
    assert!(valid.is_ok(), "{}", valid.unwrap_err().emit_to_string(source));
}

#[test]
fn the_shaders_of_maps_are_valid() {
    for grid in GRIDS {
        for (view, terms) in
            [(View::Local, Terms::All), (View::Local, Terms::Zonal), (View::Global, Terms::All)]
        {
            for p in 0..=16 {
                check(&MapShader::of(&map(grid, view, terms, p).unwrap()).text(Language::Wgsl));
            }
        }
    }
    for centre in [Centre::Reflection, Centre::Normal] {
        check(&ComponentShader { centre, count: 9, edge: 32 }.text(Language::Wgsl));
    }
}

/// Local maps, whose texels the shader blends itself, with the coefficients in a buffer in place of a
/// texture: also over edges, corners, poles and the seam.
#[test]
fn the_shaders_of_local_maps_look_them_up_as_the_kernel_does() {
    let Some(device) = on_device::device("the_shaders_of_local_maps_look_them_up_as_the_kernel_does") else {
        return;
    };
    let answer = "
        fn answer(k: u32) -> vec3f { return reflected(asked[2u * k].xyz, asked[2u * k + 1u].xyz); }
    ";
    let pairs: Vec<_> = (0..300).map(|k| (spiral(k, 300), spiral(77 * k % 300, 300))).collect();
    let asked: Vec<[f32; 4]> = pairs
        .iter()
        .flat_map(|(central, view)| [central.vector(), view.vector()])
        .map(|v| v.as_vec3().extend(0.0).to_array())
        .collect();
    for grid in GRIDS {
        for terms in [Terms::All, Terms::Zonal] {
            for p in [0, 1, 2, 5, 16] {
                let map = map(grid, View::Local, terms, p).unwrap();
                let [faces, height, width] = grid.shape();
                let text = MapShader::of(&map).text(Language::Wgsl);
                let texture = "@group(0) @binding(0) var map: texture_2d_array<f32>;";
                let buffer = "@group(3) @binding(0) var<storage, read> values: array<vec4f>;";
                let fetch = "return textureLoad(map, at, layer, 0).rgb;";
                let read = format!(
                    "let texel = ((layer % {faces}) * {height} + at.y) * {width} + at.x;
                    return values[texel * {} + layer / {faces}].rgb;",
                    map.rows()
                );
                assert!(text.contains(texture) && text.contains(fetch), "{text}");
                let source = text.replace(texture, buffer).replace(fetch, &read) + answer;
                let values: Vec<[f32; 4]> = map.values().iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
                let found = on_device::answers(&device, &source, &asked, pairs.len(), &[cast_slice(&values)]);
                let mut lookup = map.lookup();
                for ((central, view), found) in pairs.iter().zip(found) {
                    let expected = lookup.radiance(*central, *view);
                    for channel in 0..3 {
                        let error = (found[channel] - expected[channel]).abs();
                        assert!(
                            error < 2e-4 * (1 + p) as f32,
                            "{grid:?} {terms:?} {p}: {found:?} {expected:?}"
                        );
                    }
                }
            }
        }
    }
}
