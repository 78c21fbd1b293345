//! The look-up in Metal's language, compiled as C++, against the kernel.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may panic")]

use envmap::Environment;
use sh::Stop;
use sphere::{Direction, LatLong, spiral};
use taps::{
    Language, LookUp, NormalTap, ROWS, ScaleSpace, Source, TableShape, Tap, TapRow, TapTable, Widths,
    atlas_picture, table_texels,
};

/// Answers for pairs of directions that follow the texels of three pictures.
const MAIN: &str = "
int main() {
    const std::vector<float> all = given();
    const float4 *texels = (const float4 *)all.data();
    texture2d<float> levels, normals, table;
    texture2d<float> *pictures[] = { &levels, &normals, &table };
    const int sizes[][2] = { SIZES };
    for (int k = 0; k < 3; k++) {
        pictures[k]->texels = texels;
        pictures[k]->width = sizes[k][0];
        pictures[k]->height = sizes[k][1];
        texels += sizes[k][0] * sizes[k][1];
    }
    for (const float *v = (const float *)texels; v < all.data() + all.size(); v += 6) {
        answer(tap_reflected(levels, normals, table, sampler(), float3(v[0], v[1], v[2]), float3(v[3], v[4], v[5])));
    }
}
";

#[test]
fn pictures_of_levels_are_looked_up_as_the_kernel_does() {
    let grid = LatLong::with_rows(64);
    let lamp = Direction::from_angles(1.0, 0.7);
    let radiance = |index: usize| {
        let d = grid.direction(index / grid.width, index % grid.width);
        let glow = if d.dot(lamp) > 0.95 { 20.0 } else { 0.0 };
        [1.0 + 0.5 * d.vector().z as f32 + glow, 1.0, 0.2]
    };
    let environment = Environment::new(grid, (0..grid.len()).map(radiance).collect()).unwrap();
    let widths = Widths::new(16).unwrap();
    let space = ScaleSpace::new(&environment, &[], widths, Stop::NEVER).unwrap();
    let row = |i: usize| {
        let u = i as f64 / 64.0;
        TapRow {
            taps: vec![
                Tap { delta: 0.2 * u, std: 0.3, weight: [0.5, 0.25, 0.125] },
                Tap { delta: -0.1, std: 0.2 + 0.1 * u, weight: [0.2 * u, 0.3, 0.1] },
            ],
            normals: vec![NormalTap { y: 0.75, weight: [0.1, 0.2, 0.3] }],
        }
    };
    let table = TapTable::new((0..ROWS).map(row).collect()).unwrap();
    let look_up = LookUp {
        language: Language::Metal,
        source: Source::Atlas,
        cube_coordinates: LookUp::SPECULA,
        rows_from_bottom: false,
        widths,
        taps: 2,
        normals: 1,
        lights: 0,
        table: TableShape::Angle,
    };
    let (mut input, mut sizes) = (Vec::new(), Vec::new());
    for levels in [space.levels(), space.normals()] {
        let picture = atlas_picture(levels).unwrap();
        sizes.push(format!("{{ {}, {} }}", picture.width(), picture.height()));
        input.extend(picture.pixels().iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]));
    }
    let texels = table_texels(&table);
    sizes.push(format!("{{ {ROWS}, {} }}", texels.len() / ROWS));
    input.extend(texels.as_flattened());
    let pairs: Vec<_> = (0..500).map(|k| (spiral(k, 500), spiral((37 * k + 11) % 500, 500))).collect();
    for (normal, view) in &pairs {
        input.extend([normal, view].map(|d| d.vector().as_vec3().to_array()).as_flattened());
    }
    let program = look_up.text() + &MAIN.replace("SIZES", &sizes.join(", "));
    let test = "pictures_of_levels_are_looked_up_as_the_kernel_does";
    let Some(found) = test_data::run_metal(test, &program, &input) else { return };
    assert_eq!(found.len(), pairs.len());
    for ((normal, view), found) in pairs.iter().zip(found) {
        let expected = table.radiance(&space, *normal, *view);
        for channel in 0..3 {
            let error = (f64::from(found[channel]) - expected[channel]).abs();
            assert!(error < 1e-3 * (1.0 + expected[channel]), "{normal:?} {view:?}: {found:?} {expected:?}");
        }
    }
}
