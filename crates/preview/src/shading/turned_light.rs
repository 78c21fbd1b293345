//! A light turned from the coordinates of a mesh into the frame of a point, whose axes are R_z(alpha)
//! R_y(beta) R_z(gamma).
//!
//! R_y(beta) = R_x(-90) R_z(beta) R_x(90) (the second method of [KSS02, app.]). A turn about z mixes the
//! pairs of each m. The turn about x by 90 degrees takes functions that are even in y to such that are even
//! in z, and back, so that only a quarter of its entries is not zero.

use glam::Vec3;

/// The greatest degree that the shader turns: that of the largest table.
pub const MAX_DEGREE: usize = 14;

/// The entries of the widest band.
pub const WIDTH: usize = 2 * MAX_DEGREE + 1;

/// The axes x, y and N of the frame at a point: x the tangent and N the normal, of any length and at nearly a
/// right angle, as interpolation leaves them.
pub fn frame_at(x: Vec3, normal: Vec3) -> [Vec3; 3] {
    let normal = normal.try_normalize().unwrap_or(Vec3::Z);
    let across = normal.cross(x);
    // A tangent along the normal says nothing.
    let y = across.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    [y.cross(normal), y, normal]
}

/// Cosine and sine of the angles alpha, beta and gamma of a frame: its axes are R_z(alpha) R_y(beta)
/// R_z(gamma).
pub fn angles_of([x, _, normal]: [Vec3; 3]) -> [[f32; 2]; 3] {
    let sine = normal.truncate().length();
    let alpha = if sine > 0.0 { [normal.x / sine, normal.y / sine] } else { [1.0, 0.0] };
    // Gamma is what is left of x after the other two, which is well known near the poles too.
    let along = alpha[0] * x.x + alpha[1] * x.y;
    let gamma = [normal.z * along - sine * x.z, alpha[0] * x.y - alpha[1] * x.x];
    [alpha, [normal.z, sine], gamma]
}

/// The number of entries of the turns of a band.
pub fn entries(l: usize) -> usize {
    (2 * l + 1) * (l / 2 + 1)
}

/// The coefficients of degree l of a light in a frame, RGB in the first 2 l + 1 places, from those outside of
/// it.
/// `quarter_turns` has the entries [2 l + 1, l / 2 + 1] of the turns about x by 90 degrees and by -90 that
/// `quarter_turn_column` names, and `angles` cosine and sine of alpha, beta and gamma.
pub fn turned_band(
    l: usize,
    quarter_turns: &[[f32; 2]],
    angles: [[f32; 2]; 3],
    light: [Vec3; WIDTH],
) -> [Vec3; WIDTH] {
    let mut band = light;
    turn_about_z(l, angles[0], &mut band);
    band = turned_about_x(l, quarter_turns, 0, &band);
    turn_about_z(l, angles[1], &mut band);
    band = turned_about_x(l, quarter_turns, 1, &band);
    turn_about_z(l, angles[2], &mut band);
    band
}

/// The turn by the negative angle.
fn turn_about_z(l: usize, [cosine, sine]: [f32; 2], band: &mut [Vec3; WIDTH]) {
    let mut multiple = [1.0, 0.0];
    for m in 1..=l {
        let [x, y] = multiple;
        multiple = [x * cosine + y * sine, y * cosine - x * sine];
        let ([x, y], even, odd) = (multiple, band[l + m], band[l - m]);
        band[l + m] = even * x - odd * y;
        band[l - m] = even * y + odd * x;
    }
}

fn turned_about_x(l: usize, quarter_turns: &[[f32; 2]], back: usize, band: &[Vec3; WIDTH]) -> [Vec3; WIDTH] {
    let (mut turned, count) = ([Vec3::ZERO; WIDTH], l / 2 + 1);
    for row in 0..=2 * l {
        for k in 0..count {
            let column = quarter_turn_column(l, row, k);
            if column <= 2 * l {
                turned[row] += quarter_turns[row * count + k][back] * band[column];
            }
        }
    }
    turned
}

/// The column of the k-th entry that is not zero in a row of the turns about x by 90 degrees and by -90, in
/// the band of degree l; beyond its last column if there are fewer.
fn quarter_turn_column(l: usize, row: usize, k: usize) -> usize {
    // Row l + m is even in z if l + m is even, in y if m >= 0.
    let odd = (l + usize::from(row < l)) % 2;
    let m = if row.is_multiple_of(2) { odd + 2 * k } else { 2 - odd + 2 * k };
    match (m <= l, row.is_multiple_of(2)) {
        (false, _) => 2 * l + 1,
        (true, true) => l + m,
        (true, false) => l - m,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DMat3;
    use sh::{Degree, Expansion};
    use sphere::{Rotation, Zyz};
    use transfer::{FixedLight, Frames, quarter_turns};

    use super::*;

    const L: usize = 9;

    fn light() -> Expansion {
        let degree = Degree::new(L).unwrap();
        let value = |row: usize, channel: usize| ((row * 3 + channel) as f64 * 12.9898).sin();
        let rows = (0..degree.rows()).map(|row| [0, 1, 2].map(|channel| value(row, channel))).collect();
        Expansion::from_coefficients(degree, rows).unwrap()
    }

    /// Frames of every direction: both poles, next to them, and some turned about them.
    fn frames() -> Frames {
        let sphere = Frames::of(&mesh::shape("sphere").unwrap()).unwrap();
        let axes =
            (0..sphere.len()).step_by(17).map(|vertex| sphere.axes(vertex).map(|axis| axis.map(f64::from)));
        let mut axes: Vec<DMat3> = axes.map(|axes| DMat3::from_cols_array_2d(&axes)).collect();
        for theta in [0.0, 1e-7, 1e-5, 1e-3, 3.1, PI - 1e-6, PI] {
            for k in 0..5 {
                let (tilt, about) = (f64::from(k), 1.3 * f64::from(k));
                axes.push(Rotation::from_zyz(Zyz { alpha: tilt, beta: theta, gamma: about }).matrix());
            }
        }
        Frames::from_axes(&axes)
    }

    /// The first entry of a band.
    fn first(l: usize) -> usize {
        (1..l).map(entries).sum()
    }

    /// A band of the light in the world.
    fn band_of(l: usize) -> [Vec3; WIDTH] {
        let light = light();
        let rows = &light.coefficients()[l * l..][..2 * l + 1];
        std::array::from_fn(|row| {
            rows.get(row).map_or(Vec3::ZERO, |rgb| rgb.map(|value| value as f32).into())
        })
    }

    /// What the light is in the frame of a vertex, by the twin.
    fn turned(frames: &Frames, turns: &[[f32; 2]], vertex: usize, l: usize) -> [Vec3; WIDTH] {
        let [x, _, normal] = frames.axes(vertex).map(Vec3::from);
        turned_band(l, &turns[first(l)..], angles_of(frame_at(x, normal)), band_of(l))
    }

    #[test]
    fn it_turns_as_the_kernel_does() {
        let (frames, rows) = (frames(), light().degree().rows());
        let (expected, turns) =
            (FixedLight::new(&frames, &light()).values(), quarter_turns(light().degree()));
        for vertex in 0..frames.len() {
            for (of, l) in (0..3).flat_map(|of| (1..=L).map(move |l| (of, l))) {
                let expected = &expected[(vertex * 3 + of) * rows + l * l..][..2 * l + 1];
                for (found, expected) in turned(&frames, &turns, vertex, l).iter().zip(expected) {
                    let found = found[of];
                    assert!((found - expected).abs() < 1e-5, "{vertex} {of} {l}: {found} {expected}");
                }
            }
        }
    }

    /// A frame of interpolated axes is right-handed and of length 1, whatever they are.
    #[test]
    fn a_frame_is_orthonormal() {
        for (x, normal) in [
            (Vec3::X, Vec3::Z),
            (Vec3::new(0.5, 0.1, 0.3), Vec3::new(0.0, 0.2, 0.4)),
            (Vec3::Z, Vec3::Z),
            (Vec3::ZERO, Vec3::new(0.1, -0.2, 0.0)),
            (Vec3::ZERO, Vec3::ZERO),
        ] {
            let [x, y, n] = frame_at(x, normal);
            let lengths = [x, y, n].map(|axis| (axis.length() - 1.0).abs());
            assert!(lengths.iter().all(|off| *off < 1e-6), "{x} {y} {n}");
            assert!((x.cross(y) - n).length() < 1e-6, "{x} {y} {n}");
        }
    }

    #[cfg(feature = "gpu")]
    #[test]
    fn the_shader_turns_alike() {
        use crate::shading::on_device::{answers, device};

        let Some(device) = device("the_shader_turns_alike") else { return };
        let (frames, turns) = (frames(), quarter_turns(light().degree()));
        let asked: Vec<[usize; 3]> = (0..frames.len())
            .flat_map(|vertex| (1..=L).flat_map(move |l| (0..=2 * l).map(move |row| [vertex, l, row])))
            .collect();
        let rows = light().degree().rows();
        let source = format!(
            "@group(3) @binding(0) var<storage, read> quarter_turns: array<vec2f>;
            @group(3) @binding(1) var<storage, read> world_light: array<f32>;
            @group(3) @binding(2) var<storage, read> axes: array<vec4f>;
            {}
            fn answer(k: u32) -> vec3f {{
                let vertex = u32(asked[k].x);
                let l = u32(asked[k].y);
                let turn = turned_angles(frame_at(axes[2u * vertex].xyz, axes[2u * vertex + 1u].xyz));
                var entry = 0u;
                for (var j = 1u; j < l; j++) {{
                    entry += turned_entries(j);
                }}
                var band: array<vec3f, TURNED_WIDTH>;
                for (var row = 0u; row <= 2u * l; row++) {{
                    let i = l * l + row;
                    band[row] = vec3f(world_light[i], world_light[{rows}u + i], world_light[2u * {rows}u + i]);
                }}
                turn_band(l, entry, turn, &band);
                return band[u32(asked[k].z)];
            }}",
            include_str!("turned_light.wgsl"),
        );
        let axes: Vec<[f32; 4]> = (0..frames.len())
            .flat_map(|vertex| {
                let [x, _, n] = frames.axes(vertex);
                [x, n].map(|[x, y, z]| [x, y, z, 0.0])
            })
            .collect();
        let channel = |of: usize| light().coefficients().iter().map(|rgb| rgb[of] as f32).collect::<Vec<_>>();
        let world = [0, 1, 2].map(channel).concat();
        let buffers =
            [bytemuck::cast_slice(&turns), bytemuck::cast_slice(&world), bytemuck::cast_slice(&axes)];
        let numbers: Vec<[f32; 4]> =
            asked.iter().map(|[vertex, l, row]| [*vertex as f32, *l as f32, *row as f32, 0.0]).collect();
        let found = answers(&device, &source, &numbers, asked.len(), &buffers);
        for (found, [vertex, l, row]) in found.iter().zip(asked) {
            let expected = turned(&frames, &turns, vertex, l)[row];
            for (found, expected) in found.iter().zip(expected.to_array()) {
                assert!((found - expected).abs() < 1e-5, "{vertex} {l} {row}: {found} {expected}");
            }
        }
    }
}
