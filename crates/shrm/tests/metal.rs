//! The look-up in Metal's language, compiled as C++, against the kernel.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use brdf::{Centre, Choice, Fresnel, Ggx, Lambert, Material, project};
use sh::{Degree, Expansion, Lighting, Stop};
use shrm::components::{ComponentBasis, ComponentCount, ComponentOptions, fit};
use shrm::shader::{ComponentShader, Language, MapShader};
use shrm::{MapGrid, Reflection, Shrm, Terms, View};
use sphere::{Cube, Direction, LatLong, spiral};

/// Answers for pairs of directions that follow the texels.
const MAIN: &str = "
int main() {
    const std::vector<float> all = given();
    const texture2d_array<float> map = { (const float4 *)all.data(), WIDTH, HEIGHT };
    for (size_t i = 4 * WIDTH * HEIGHT * LAYERS; i < all.size(); i += 6) {
        const float *v = &all[i];
        answer(reflected(map, float3(v[0], v[1], v[2]), float3(v[3], v[4], v[5])));
    }
}
";

fn with_sizes(program: &str, sizes: &[(&str, usize)]) -> String {
    let with = |text: String, (name, size): &(&str, usize)| text.replace(name, &size.to_string());
    sizes.iter().fold(program.to_owned(), with)
}

/// Look-ups are those of [`shrm::Lookup`] everywhere: between texels, over the edges and corners of a cube,
/// and over the poles and the seam of a lat-long map.
#[test]
fn local_maps_are_looked_up_as_the_kernel_does() {
    let test = "local_maps_are_looked_up_as_the_kernel_does";
    for (grid, terms, p) in [
        (MapGrid::Cube(Cube { edge: 5 }), Terms::All, 3),
        (MapGrid::Cube(Cube { edge: 4 }), Terms::Zonal, 6),
        (MapGrid::LatLong(LatLong { width: 10, height: 5 }), Terms::All, 2),
    ] {
        let p = Degree::new(p).unwrap();
        let rows = if terms == Terms::All { p.rows() } else { p.get() + 1 };
        let value = |i: usize| (((i * 2_654_435_761) >> 7) % 1000) as f32 / 500.0 - 1.0;
        let values: Vec<[f32; 3]> =
            (0..grid.len() * rows).map(|i| [0, 1, 2].map(|channel| value(3 * i + channel))).collect();
        let map = Shrm::new(grid, View::Local, Centre::Reflection, p, terms, values).unwrap();
        let [faces, height, width] = grid.shape();
        // The texture has a layer for each face of each row.
        let face = |layer: usize| (layer / faces, layer % faces);
        let texels = (0..rows * faces).map(face).flat_map(|(row, face)| {
            let first = face * height * width;
            let of_row = (first..first + height * width).map(move |texel| texel * rows + row);
            of_row.map(|index| map.values()[index])
        });
        let mut input: Vec<f32> = texels.flat_map(|[r, g, b]| [r, g, b, 1.0]).collect();
        let pairs: Vec<_> = (0..300).map(|k| (spiral(k, 300), spiral(77 * k % 300, 300))).collect();
        for (central, view) in &pairs {
            input.extend([central, view].map(|d| d.vector().as_vec3().to_array()).as_flattened());
        }
        let sizes = [("WIDTH", width), ("HEIGHT", height), ("LAYERS", rows * faces)];
        let program = MapShader::of(&map).text(Language::Metal) + &with_sizes(MAIN, &sizes);
        let Some(found) = test_data::run_metal(test, &program, &input) else { return };
        assert_eq!(found.len(), pairs.len());
        let mut lookup = map.lookup();
        for ((central, view), found) in pairs.iter().zip(found) {
            let expected = lookup.radiance(*central, *view);
            for channel in 0..3 {
                let error = (found[channel] - expected[channel]).abs();
                assert!(error < 2e-4 * (1 + p.get()) as f32, "{grid:?} {terms:?}: {found:?} {expected:?}");
            }
        }
    }
}

/// Answers for pairs of directions that follow the texels of two textures.
const OF_COMPONENTS: &str = "
int main() {
    const std::vector<float> all = given();
    const float4 *texels = (const float4 *)all.data();
    texture2d_array<float> map, weights;
    map.texels = texels;
    map.width = map.height = SIDE;
    weights.texels = texels + SIDE * SIDE * 6 * COUNT;
    weights.width = weights.height = WEIGHTS;
    const size_t first = 4 * (SIDE * SIDE * 6 * COUNT + WEIGHTS * WEIGHTS * ((COUNT + 3) / 4));
    for (size_t i = first; i < all.size(); i += 6) {
        const float *v = &all[i];
        answer(reflected(map, weights, sampler(), float3(v[0], v[1], v[2]), float3(v[3], v[4], v[5])));
    }
}
";

/// The texels along an edge of the weights: more than a file has, since they are linear between texels.
const WEIGHTS: usize = 256;

/// The components of a metal, and of a matte surface, whose centre is the normal.
#[test]
fn components_are_looked_up_as_the_kernel_does() {
    let metal = Fresnel::Conductor { n: [0.2, 0.92, 1.1], k: [3.91, 2.45, 2.14] };
    let metal = Material::Ggx(Ggx::new(0.4, metal, [1.0; 3]).unwrap());
    let matte = Material::Lambert(Lambert::new([0.8, 0.5, 0.2]).unwrap());
    let degree = Degree::new(6).unwrap();
    let noise = |i: usize| [0, 1, 2].map(|c| ((((3 * i + c) * 2_654_435_761) >> 7) % 1000) as f64 / 4000.0);
    let rows = (0..degree.rows()).map(|i| if i == 0 { [8.0, 7.0, 6.0] } else { noise(i) }).collect();
    let series = Expansion::from_coefficients(degree, rows).unwrap();
    let light = Lighting { series, lights: Vec::new() };
    for (material, centre) in [(metal, Centre::Reflection), (matte, Centre::Normal)] {
        let coefficients = project(&material, Choice::Full, Stop::NEVER).unwrap().coefficients;
        let reflection = Reflection::for_light(&light, &coefficients, &material, Stop::NEVER).unwrap().0;
        let basis = ComponentBasis::of(&material).unwrap();
        let (edge, count) = (8, 6.min(basis.components().len()));
        let options =
            ComponentOptions { edge, count: ComponentCount::Fixed(count), half: false, bake: false };
        let map = fit(&reflection, &basis, options, Stop::NEVER).unwrap().map;
        let count = map.basis().components().len();
        assert_eq!(map.basis().centre(), centre);
        let values = (0..count).flat_map(|k| map.values(k).iter().copied());
        let mut input: Vec<f32> = values.flat_map(|[r, g, b]| [r, g, b, 1.0]).collect();
        let weights = map.basis().textures(WEIGHTS);
        let all = WEIGHTS * WEIGHTS;
        let of_layer = |index: usize| {
            let (layer, place) = (index / all, index % all);
            [0, 1, 2, 3].map(|part| weights.get((4 * layer + part) * all + place).copied().unwrap_or(0.0))
        };
        input.extend((0..all * count.div_ceil(4)).flat_map(of_layer));
        let views = (0..400).map(|k| (spiral(k, 400), spiral(77 * k % 400, 400)));
        let pairs: Vec<_> = views.filter(|(normal, view)| normal.dot(*view) > 0.05).collect();
        for (normal, view) in &pairs {
            input.extend([normal, view].map(|d| d.vector().as_vec3().to_array()).as_flattened());
        }
        let sizes = [("SIDE", edge + 2), ("COUNT", count), ("WEIGHTS", WEIGHTS)];
        let shader = ComponentShader { centre, count, edge };
        let program = shader.text(Language::Metal) + &with_sizes(OF_COMPONENTS, &sizes);
        let test = "components_are_looked_up_as_the_kernel_does";
        let Some(found) = test_data::run_metal(test, &program, &input) else { return };
        assert!(found.len() == pairs.len() && pairs.len() > 100);
        for ((normal, view), found) in pairs.iter().zip(found) {
            let (n, v) = (normal.vector(), view.vector());
            let mirrored = Direction::normalised(2.0 * n.dot(v) * n - v);
            let central = if centre == Centre::Reflection { mirrored } else { *normal };
            let expected = map.radiance(central, *view);
            for channel in 0..3 {
                let error = (f64::from(found[channel]) - expected[channel]).abs();
                assert!(error < 1e-3 * expected[channel].max(1.0), "{centre:?}: {found:?} {expected:?}");
            }
        }
    }
}
