//! Probes for VRC Light Volumes: three textures of three dimensions a volume, and the editor script that
//! makes them.

use half::f16;
use serde::Serialize;

use engine::Failure;

use super::axes::{Grid, OF_UNITY};
use super::light::{LitVolume, ProbeLight, check_halves, check_texture};
use super::unity::coefficients;
use crate::json::document;

/// The files, in the order of their contents.
pub(crate) const NAMES: [&str; 4] =
    ["/volumes.bytes", "/SpeculaLightVolumes.cs", "/README.txt", "/volumes.json"];

/// The most volumes of a world.
const MOST_VOLUMES: usize = 32;

/// The longest side of a texture.
const MOST_TEXELS: usize = 2048;

/// What the packing of volumes divides slopes by: 1 / (0.5 * 1.13), of `LinearizeSingleSH`.
const SLOPE: f32 = 1.769_911_5;

/// The members of `volumes.json`.
#[derive(Serialize)]
struct File {
    format: &'static str,
    frame: &'static str,
    scale: &'static str,
    texels: &'static str,
    volumes: Vec<VolumeEntry>,
}

/// A volume in `volumes.json`.
#[derive(Serialize)]
struct VolumeEntry {
    name: String,
    resolution: [usize; 3],
    center: [f32; 3],
    size: [f32; 3],
    offset: usize,
}

/// The files of some volumes.
///
/// # Errors
/// If there are points or more than 32 volumes, a texture is too large, or a number has no half.
pub(crate) fn files(light: &ProbeLight<'_>, recipe: &str) -> Result<Vec<Vec<u8>>, Failure> {
    let (mut texels, mut volumes) = (Vec::new(), Vec::new());
    for lit in light.only_volumes("VRC Light Volumes", MOST_VOLUMES)? {
        let grid = Grid::of(lit.volume, OF_UNITY);
        check_texture(grid.counts, MOST_TEXELS, &lit.volume.name)?;
        let offset = texels.len();
        for texture in textures(&lit, &grid) {
            check_halves(texture.as_flattened(), &lit.volume.name, "set a lower `scale`")?;
            let numbers = texture.as_flattened().iter();
            texels.extend(numbers.flat_map(|value| f16::from_f32(*value).to_le_bytes()));
        }
        let [least, most] = grid.box_of_centres();
        volumes.push(VolumeEntry {
            name: lit.volume.name.clone(),
            resolution: grid.counts,
            center: [0, 1, 2].map(|k| (0.5 * (least[k] + most[k])) as f32),
            size: [0, 1, 2].map(|k| (most[k] - least[k]) as f32),
            offset,
        });
    }
    let file = File {
        format: "specula probes for VRC Light Volumes 1",
        frame: "left-handed, +Y up, metres: the glTF file with x mirrored",
        scale: "irradiance over pi; slopes times 1.7699",
        texels: "volumes.bytes",
        volumes,
    };
    let script = include_str!("vrc.cs").as_bytes().to_vec();
    let readme = include_str!("vrc.txt").as_bytes().to_vec();
    Ok(vec![texels, script, readme, document(&file, recipe)?])
}

/// The three textures of a volume: L0 and slopes along x, y and z of red, green and blue.
fn textures(lit: &LitVolume<'_>, grid: &Grid) -> [Vec<[f32; 4]>; 3] {
    let probes: Vec<[f32; 27]> = grid.probes().map(|probe| coefficients(&lit.rows[probe])).collect();
    let texture = |texel: fn(&dyn Fn(usize, usize) -> f32) -> [f32; 4]| {
        let of = |sh: &[f32; 27]| {
            // Row 1, 2 and 3 are those of y, z and x.
            texel(&|channel, row| sh[9 * channel + row] * if row == 0 { 1.0 } else { SLOPE })
        };
        probes.iter().map(of).collect()
    };
    [
        texture(|sh| [sh(0, 0), sh(1, 0), sh(2, 0), sh(0, 2)]),
        texture(|sh| [sh(0, 3), sh(1, 3), sh(2, 3), sh(1, 2)]),
        texture(|sh| [sh(0, 1), sh(1, 1), sh(2, 1), sh(2, 2)]),
    ]
}

#[cfg(test)]
mod tests {
    use probes::{Lattice, Volume};

    use super::*;
    use crate::testkit::{blended, bright_rows, direction, exact, noise, sample};

    /// `LVUtils.LinearizeSingleSH`, which packs a volume into the atlas.
    fn linearised(mean: f64, slope: [f64; 3]) -> [f64; 3] {
        let slope = slope.map(|x| 0.5 * x);
        let length = slope.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 && mean > 0.0 { slope.map(|x| x * (mean / length).min(1.13)) } else { slope }
    }

    /// `LV_SampleVolume` and `LightVolumeEvaluate` of `LightVolumes.cginc`: what is shown is the irradiance
    /// of degree 1, exactly.
    #[test]
    fn the_shader_shows_degree_1() {
        let bounds = [[-1.0, 2.0, 0.5], [3.0, 5.0, 2.5]];
        let volume = Volume::new("hall".into(), bounds, [5, 3, 4], Lattice::Centres).unwrap();
        let rows = bright_rows(volume.len());
        let lit = LitVolume { volume: &volume, rows: &rows, valid: &[true; 60] };
        let grid = Grid::of(&volume, OF_UNITY);
        let mut atlas = textures(&lit, &grid);
        for texel in 0..60 {
            let [a, b, c] = [0, 1, 2].map(|k| atlas[k][texel].map(f64::from));
            let slopes = [[b[0], c[0], a[3]], [b[1], c[1], b[3]], [b[2], c[2], c[3]]];
            let [r, g, b] = [0, 1, 2].map(|k| linearised(a[k], slopes[k]).map(|x| x as f32));
            atlas[0][texel][3] = r[2];
            atlas[1][texel] = [r[0], g[0], b[0], g[2]];
            atlas[2][texel] = [r[1], g[1], b[1], b[2]];
        }
        let [least, most] = grid.box_of_centres();
        for k in 0..200 {
            // Where eight probes are blended; at the border the atlas repeats the outer ones.
            let at = [0, 1, 2].map(|axis| {
                let [least, most] = [bounds[0][axis], bounds[1][axis]];
                least + (0.5 + 0.3 * noise(900 * axis + k)) * (most - least)
            });
            let normal = direction(k);
            let [place, n] = [at, normal.map(|x| x as f32)].map(|v| OF_UNITY.vector(v));
            let uvw = [0, 1, 2].map(|axis| (place[axis] - least[axis]) / (most[axis] - least[axis]));
            let [a, b, c] = [0, 1, 2].map(|k| sample(&atlas[k], grid.counts, uvw));
            let slopes = [[b[0], c[0], a[3]], [b[1], c[1], b[3]], [b[2], c[2], c[3]]];
            let mut light = blended(&volume, &rows, at.map(f64::from));
            light[4..].fill([0.0; 3]);
            let expected = exact(&light, normal);
            for channel in 0..3 {
                let found = a[channel] + (0..3).map(|k| slopes[channel][k] * n[k]).sum::<f64>();
                assert!((found - expected[channel]).abs() < 1e-5, "{found} {expected:?}");
            }
        }
    }
}
