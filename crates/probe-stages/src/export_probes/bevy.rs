//! Probes for Bevy: ambient cubes in a KTX2 of three dimensions for each volume.
//!
//! The texture has three slabs along z, for the sides along x, y and z, and in each of them the positive
//! sides below the negative ones, along y. So it is in the shader, `irradiance_volume.wgsl`; the
//! documentation of the module has the halves the other way round.

use std::fmt::Write;

use containers::{Precision, Rounding, TexelEncoding, TexelFormat, Texture, read_ktx2, write_ktx2};
use engine::Failure;

use super::axes::{Grid, OF_FILES, Rows};
use super::light::{LitVolume, MaybeFiles, ProbeLight, check_halves, check_texture};

/// The volumes that Bevy shows in a view, `MAX_VIEW_LIGHT_PROBES`.
pub(crate) const MOST_VOLUMES: usize = 8;

/// The largest texture of three dimensions of wgpu's default limits.
const MOST_TEXELS: usize = 2048;

/// What was lost in the files.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Loss {
    /// Sides of probes with negative light, which became 0.
    pub(crate) negative: usize,
    /// The sides of all probes, in red, green and blue.
    pub(crate) all: usize,
    /// The largest error of a texel, as a share of its largest number.
    pub(crate) error: f64,
}

/// The names of the files of so many volumes at most, in the order of their contents.
pub(crate) fn names() -> Vec<String> {
    let volumes = (0..MOST_VOLUMES).map(|index| format!("/{}", ktx2_name(index)));
    volumes.chain(["/README.txt".into(), "/light_probes.rs".into()]).collect()
}

fn ktx2_name(index: usize) -> String {
    format!("volume-{index}.ktx2")
}

/// The files of some volumes in 16-bit floats or as RGB9E5, and what was lost.
///
/// # Errors
/// If there are points or too many volumes, a texture is larger than wgpu's, or a number has no half.
pub(crate) fn files(
    light: &ProbeLight<'_>,
    is_shared_exponent: bool,
    recipe: &str,
) -> Result<(MaybeFiles, Loss), Failure> {
    let format = if is_shared_exponent { TexelFormat::Rgb9E5 } else { TexelFormat::from(Precision::Half) };
    let volumes = light.only_volumes("Bevy", MOST_VOLUMES)?;
    let (mut files, mut loss, mut spawned) = (Vec::new(), Loss::default(), String::new());
    for (index, lit) in volumes.iter().enumerate() {
        let grid = Grid::of(lit.volume, OF_FILES);
        let mut texture = ambient_cubes(lit, &grid);
        let name = &lit.volume.name;
        check_texture([texture.width, texture.height, texture.depth], MOST_TEXELS, name)?;
        check_halves(texture.pixels.as_flattened(), name, "set a lower `scale`")?;
        for side in texture.pixels.as_flattened_mut() {
            loss.all += 1;
            if *side < 0.0 {
                loss.negative += 1;
                *side = 0.0;
            }
        }
        let encoding = TexelEncoding { format, rounding: Rounding::Nearest };
        let bytes = write_ktx2(&texture, encoding, Some(recipe), &[])?.bytes;
        loss.error = loss.error.max(largest_error(&texture, &read_ktx2(&bytes)?));
        files.push(Some(bytes));
        let [least, most] = grid.box_of_centres();
        let middle = [0, 1, 2].map(|k| 0.5 * (least[k] + most[k]));
        let size = [0, 1, 2].map(|k| most[k] - least[k]);
        let vector = |v: [f64; 3]| {
            let [x, y, z] = v.map(|x| x as f32);
            format!("Vec3::new({x:?}, {y:?}, {z:?})")
        };
        let file = ktx2_name(index);
        writeln!(spawned, "    (\"{file}\", {}, {}), // {}", vector(middle), vector(size), one_line(name))?;
    }
    files.resize(MOST_VOLUMES, None);
    files.push(Some(include_str!("bevy.txt").into()));
    let program = include_str!("bevy.rs.txt").replace("    // VOLUMES\n", &spawned);
    files.push(Some(program.into_bytes()));
    Ok((files, loss))
}

/// A text for a comment: without what would end its line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The sides of an ambient cube: E / pi toward x, y, z, -x, -y and -z.
fn sides(rows: &Rows) -> [[f32; 3]; 6] {
    let c = OF_FILES.rows(rows);
    let toward = |axis: usize, sign: f64| {
        [0, 1, 2].map(|channel| {
            let c = |row: usize| f64::from(c[row][channel]);
            // Along an axis, products of coordinates are 0.
            let linear = [c(3), c(1), c(2)][axis];
            let [of_6, of_8] = [[-1.0, 1.0], [-1.0, -1.0], [2.0, 0.0]][axis];
            let mean = 0.282_094_791_773_878_14 * c(0);
            let slope = sign * 0.325_735_007_935_279_9 * linear;
            let square = 0.078_847_891_313_130_01 * of_6 * c(6) + 0.136_568_553_824_009_88 * of_8 * c(8);
            (mean + slope + square) as f32
        })
    };
    [0, 1, 2, 3, 4, 5].map(|side| toward(side % 3, if side < 3 { 1.0 } else { -1.0 }))
}

/// The texture of a volume, of (Rx, 2 Ry, 3 Rz) texels.
fn ambient_cubes(lit: &LitVolume<'_>, grid: &Grid) -> Texture {
    let [rx, ry, rz] = grid.counts;
    let cubes: Vec<[[f32; 3]; 6]> = grid.probes().map(|probe| sides(&lit.rows[probe])).collect();
    let mut pixels = Vec::with_capacity(6 * cubes.len());
    for axis in 0..3 {
        for slice in cubes.chunks_exact(rx * ry) {
            for side in [axis, axis + 3] {
                pixels.extend(slice.iter().map(|cube| cube[side]));
            }
        }
    }
    Texture { width: rx, height: 2 * ry, depth: 3 * rz, pixels, ..Texture::default() }
}

/// The largest error of a texel that came back from a file, as a share of its largest number.
fn largest_error(given: &Texture, found: &Texture) -> f64 {
    let error = |(given, found): (&[f32; 3], &[f32; 3])| {
        let largest = given.iter().fold(0.0_f32, |a, b| a.max(*b));
        let error = given.iter().zip(found).fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()));
        // Below the least half there is nothing to see.
        if largest > 1e-4 { f64::from(error / largest) } else { 0.0 }
    };
    given.pixels.iter().zip(&found.pixels).map(error).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use probes::{Lattice, Volume};

    use super::*;
    use crate::testkit::{blended, bright_rows, direction, exact, noise, sample};

    /// `irradiance_volume_light` of Bevy's `irradiance_volume.wgsl`, of one volume.
    fn irradiance(texture: &Texture, middle: [f64; 3], size: [f64; 3], place: [[f64; 3]; 2]) -> [f64; 3] {
        let [at, normal] = place;
        let atlas = [texture.width, texture.height, texture.depth];
        let resolution = [atlas[0] as f64, (atlas[1] / 2) as f64, (atlas[2] / 3) as f64];
        let mut uvw = [0.0; 3];
        for k in 0..3 {
            let unit = (at[k] - middle[k]) / size[k];
            let stp = ((unit + 0.5) * resolution[k]).clamp(0.5, resolution[k] - 0.5);
            uvw[k] = stp / atlas[k] as f64;
        }
        let mut sum = [0.0; 3];
        for axis in 0..3 {
            let negative = if normal[axis] < 0.0 { 0.5 } else { 0.0 };
            let place = [uvw[0], uvw[1] + negative, uvw[2] + axis as f64 / 3.0];
            let rgb = sample(&texture.pixels, atlas, place);
            (0..3).for_each(|channel| sum[channel] += rgb[channel] * normal[axis] * normal[axis]);
        }
        sum
    }

    fn volume(lattice: Lattice) -> Volume {
        Volume::new("hall".into(), [[-1.0, 2.0, 0.5], [3.0, 5.0, 2.5]], [5, 3, 4], lattice).unwrap()
    }

    /// At 200 places with normals, Bevy blends the exact irradiance toward three sides with the squares of
    /// the normal; toward the axes it is the exact irradiance.
    #[test]
    fn the_shader_shows_the_light() {
        for (lattice, format) in [
            (Lattice::Centres, TexelFormat::Rgba16F),
            (Lattice::Corners, TexelFormat::Rgba16F),
            (Lattice::Centres, TexelFormat::Rgb9E5),
        ] {
            let volume = volume(lattice);
            let rows = bright_rows(volume.len());
            let valid = vec![true; volume.len()];
            let lit = LitVolume { volume: &volume, rows: &rows, valid: &valid };
            let grid = Grid::of(&volume, OF_FILES);
            let file = write_ktx2(&ambient_cubes(&lit, &grid), format.nearest(), None, &[]).unwrap();
            let texture = read_ktx2(&file.bytes).unwrap();
            assert_eq!([texture.width, texture.height, texture.depth], [3, 8, 15]);
            let [least, most] = grid.box_of_centres();
            let middle = [0, 1, 2].map(|k| 0.5 * (least[k] + most[k]));
            let size = [0, 1, 2].map(|k| most[k] - least[k]);
            for k in 0..200 {
                let at = [0, 1, 2].map(|axis| {
                    let [least, most] = volume.bounds;
                    least[axis] + (0.5 + 0.6 * noise(900 * axis + k)) * (most[axis] - least[axis])
                });
                let mut normal = direction(k);
                if k < 6 {
                    normal = [0.0; 3];
                    normal[k % 3] = if k < 3 { 1.0 } else { -1.0 };
                }
                let rows = blended(&volume, &rows, at.map(f64::from));
                let mut expected = [0.0; 3];
                for axis in 0..3 {
                    let mut side = [0.0; 3];
                    side[axis] = if normal[axis] < 0.0 { -1.0 } else { 1.0 };
                    let light = exact(&rows, side);
                    (0..3).for_each(|c| expected[c] += light[c] * normal[axis] * normal[axis]);
                }
                let place = [at, normal.map(|x| x as f32)].map(|v| OF_FILES.vector(v));
                let found = irradiance(&texture, middle, size, place);
                // Half a step of RGB9E5 is 1 / 512 of the largest number.
                let most = if format == TexelFormat::Rgb9E5 { 1.0 / 512.0 } else { 5e-4 };
                let largest = expected.iter().fold(0.0, |a: f64, b| a.max(*b));
                for channel in 0..3 {
                    let error = (found[channel] - expected[channel]).abs();
                    assert!(error <= 2.0 * most * largest, "{format:?}: {found:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn the_error_of_shared_exponents_is_measured() {
        let pixels = (0..48).map(|k| [0, 1, 2].map(|c| 1.0 + noise(3 * k + c))).collect();
        let texture = Texture { width: 4, height: 4, depth: 3, pixels, ..Texture::default() };
        let error = |format: TexelFormat| {
            let file = write_ktx2(&texture, format.nearest(), None, &[]).unwrap();
            largest_error(&texture, &read_ktx2(&file.bytes).unwrap())
        };
        assert!(error(TexelFormat::Rgba16F) < 5e-4);
        assert!((5e-4..2.0 / 511.0).contains(&error(TexelFormat::Rgb9E5)));
    }
}
