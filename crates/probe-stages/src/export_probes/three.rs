//! Probes for three.js: the texture of `LightProbeGridWebGL` and of `LightProbeGrid`.
//!
//! three.js has no file for them. Texels without a container are loaded with the least code, and with no
//! loader that needs a renderer: a `fetch`, and a `Data3DTexture` for each volume.

use half::f16;
use serde::Serialize;

use engine::Failure;

use super::axes::{Grid, OF_FILES};
use super::light::{LitVolume, ProbeLight, check_halves, check_texture};
use super::packing::{PARTS, packed, stacked};
use crate::json::document;

/// The files, in the order of their contents.
pub(crate) const NAMES: [&str; 4] = ["/probes.bin", "/probes.js", "/README.txt", "/probes.json"];

/// The largest texture of three dimensions that every WebGL 2 device is known to have, except a few.
const MOST_TEXELS: usize = 2048;

/// The members of `probes.json`.
#[derive(Serialize)]
struct File {
    format: &'static str,
    frame: &'static str,
    scale: &'static str,
    precision: &'static str,
    texels: &'static str,
    grids: Vec<GridEntry>,
}

/// A grid in `probes.json`.
#[derive(Serialize)]
struct GridEntry {
    name: String,
    resolution: [usize; 3],
    cells: [[f32; 3]; 2],
    corners: [[f32; 3]; 2],
    offset: usize,
}

/// The files of some volumes, with 16-bit or 32-bit numbers.
///
/// # Errors
/// If there are points, a texture is larger than WebGL's, or a number has no half.
pub(crate) fn files(light: &ProbeLight<'_>, is_half: bool, recipe: &str) -> Result<Vec<Vec<u8>>, Failure> {
    let (mut texels, mut grids) = (Vec::new(), Vec::new());
    for lit in light.only_volumes("three.js", usize::MAX)? {
        let grid = Grid::of(lit.volume, OF_FILES);
        let [nx, ny, nz] = grid.counts;
        check_texture([nx, ny, PARTS * (nz + 2)], MOST_TEXELS, &lit.volume.name)?;
        let values = texture(&lit, &grid);
        let values = values.as_flattened();
        let in_metres = |ends: [[f64; 3]; 2]| ends.map(|end| end.map(|x| x as f32));
        grids.push(GridEntry {
            name: lit.volume.name.clone(),
            resolution: grid.counts,
            cells: in_metres(grid.box_of_centres()),
            corners: in_metres(grid.box_of_corners()),
            offset: texels.len(),
        });
        if is_half {
            check_halves(values, &lit.volume.name, "set format = \"float\", or a lower `scale`")?;
            texels.extend(values.iter().flat_map(|value| f16::from_f32(*value).to_le_bytes()));
        } else {
            texels.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        }
    }
    let file = File {
        format: "specula probes for three.js 1",
        frame: "right-handed, +Y up, metres: the axes of the glTF file",
        scale: "radiance, orthonormal harmonics without Condon-Shortley phase",
        precision: if is_half { "half" } else { "float" },
        texels: "probes.bin",
        grids,
    };
    let module = include_str!("three.js").as_bytes().to_vec();
    let readme = include_str!("three.txt").as_bytes().to_vec();
    Ok(vec![texels, module, readme, document(&file, recipe)?])
}

/// The texels of a volume: seven grids along z, each with its first and its last slice twice.
fn texture(lit: &LitVolume<'_>, grid: &Grid) -> Vec<[f32; 4]> {
    let probes: Vec<_> = grid.probes().map(|probe| packed(&OF_FILES.rows(&lit.rows[probe]), 0.0)).collect();
    stacked(&probes, grid.counts)
}

#[cfg(test)]
mod tests {
    use probes::{Lattice, Volume};

    use super::*;
    use crate::testkit::{blended, bright_rows, direction, exact, noise, sample};

    /// `getLightProbeGridIrradiance` of three.js: of revision 187 in a box of cells, of 186 in a box of
    /// corners. The world's axes are those of the file; over pi.
    fn irradiance(
        texels: &[[f32; 4]],
        [nx, ny, nz]: [usize; 3],
        [least, most]: [[f64; 3]; 2],
        has_cells: bool,
        [at, normal]: [[f64; 3]; 2],
    ) -> [f64; 3] {
        let res = [nx, ny, nz].map(|count| count as f64);
        let mut uvw = [0.0; 3];
        for k in 0..3 {
            let range = most[k] - least[k];
            let spacing = range / if has_cells { res[k] } else { res[k] - 1.0 };
            let place = (at[k] + 0.5 * spacing * normal[k] - least[k]) / range;
            uvw[k] = match has_cells {
                true => place.clamp(0.5 / res[k], 1.0 - 0.5 / res[k]),
                false => place.clamp(0.0, 1.0) * (res[k] - 1.0) / res[k] + 0.5 / res[k],
            };
        }
        let padded = res[2] + 2.0;
        let sizes = [nx, ny, 7 * (nz + 2)];
        let numbers: Vec<f64> = (0..7)
            .flat_map(|t| {
                let w = (uvw[2] * res[2] + 1.0 + f64::from(t) * padded) / (7.0 * padded);
                sample(texels, sizes, [uvw[0], uvw[1], w])
            })
            .collect();
        let [x, y, z] = normal;
        let (a, b) = (2.0 * 0.511664, 2.0 * 0.429043);
        let factors = [
            0.886227,
            a * y,
            a * z,
            a * x,
            b * x * y,
            b * y * z,
            0.743125 * z * z - 0.247708,
            b * x * z,
            0.429043 * (x * x - y * y),
        ];
        [0, 1, 2].map(|channel| {
            let sum: f64 = factors.iter().enumerate().map(|(k, f)| f * numbers[3 * k + channel]).sum();
            sum.max(0.0) / std::f64::consts::PI
        })
    }

    /// What three.js shows at 200 places with normals is the blended light half a spacing along the normal,
    /// for both placements of both lattices.
    #[test]
    fn the_shader_shows_the_light() {
        for lattice in [Lattice::Centres, Lattice::Corners] {
            let volume =
                Volume::new("hall".into(), [[-1.0, 2.0, 0.5], [3.0, 5.0, 2.5]], [5, 3, 4], lattice).unwrap();
            let rows = bright_rows(volume.len());
            let valid = vec![true; volume.len()];
            let lit = LitVolume { volume: &volume, rows: &rows, valid: &valid };
            let grid = Grid::of(&volume, OF_FILES);
            let texels = texture(&lit, &grid);
            assert_eq!(texels.len(), 7 * 3 * 4 * 7);
            let spacing = volume.spacing().map(f64::from);
            for k in 0..200 {
                let at = [0, 1, 2].map(|axis| {
                    let [least, most] = volume.bounds;
                    least[axis] + (0.6 + 0.6 * noise(900 * axis + k)) * (most[axis] - least[axis])
                });
                let normal = direction(k);
                let moved = [0, 1, 2].map(|axis| f64::from(at[axis]) + 0.5 * spacing[axis] * normal[axis]);
                let expected = exact(&blended(&volume, &rows, moved), normal);
                let normal = OF_FILES.vector(normal.map(|x| x as f32));
                for (has_cells, ends) in [(true, grid.box_of_centres()), (false, grid.box_of_corners())] {
                    let place = [OF_FILES.vector(at), normal];
                    let found = irradiance(&texels, grid.counts, ends, has_cells, place);
                    for channel in 0..3 {
                        let error = (found[channel] - expected[channel]).abs();
                        assert!(error < 1e-5, "{lattice:?} {has_cells}: {found:?} {expected:?}");
                    }
                }
            }
        }
    }
}
