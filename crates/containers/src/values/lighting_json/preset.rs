//! The conventions of engines for spherical-harmonic lighting, each read in that engine's own source.
//!
//! A preset fixes the frame (how w, a direction of ours, becomes the engine's), the yaw (where the centre of
//! a lat-long image looks when the engine itself loads it), the signs of the basis, the scale, and the
//! members of the file. `A_l` is Ramamoorthi and Hanrahan's cosine factor: pi, 2 pi / 3, pi / 4 for l = 0, 1,
//! 2.

use std::f64::consts::PI;

use sh::{Degree, Expansion, Light};
use sphere::{DVec3, Direction, from_cube, from_file, to_cube, to_file};

use super::frame;
use crate::error::Error;

/// An engine's convention for lighting in spherical harmonics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Preset {
    /// Ours, of any degree.
    Specula,
    /// DirectXMath and cmft.
    DirectX,
    /// Unreal Engine.
    Unreal,
    /// Unity.
    Unity,
    /// Filament.
    Filament,
    /// three.js.
    Three,
    /// Babylon.js.
    Babylon,
    /// The polynomial in an `.env` file of Babylon.js.
    BabylonEnv,
    /// EXT_lights_image_based of glTF.
    Gltf,
}

/// The definition of a preset, in the words of its files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Definition {
    /// Handedness, the axis up, and the engine's axes in terms of ours.
    pub frame: &'static str,
    /// The direction in which the centre of a lat-long image looks.
    pub yaw: &'static str,
    /// The signs of the basis, and the order of the coefficients.
    pub signs: &'static str,
    /// The function that is expanded, and the factors.
    pub scale: &'static str,
    /// The source that states the frame, the signs and the scale.
    pub source: &'static str,
}

impl Definition {
    pub(super) fn members(&self) -> [(&'static str, &'static str); 5] {
        [
            ("frame", self.frame),
            ("yaw", self.yaw),
            ("signs", self.signs),
            ("scale", self.scale),
            ("source", self.source),
        ]
    }
}

/// A named table of numbers of a preset's file.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// The member's name.
    pub name: &'static str,
    /// The rows of the table.
    pub rows: Vec<Vec<f64>>,
    /// Whether the one row stands alone, not in a table of one row.
    pub(super) single: bool,
}

const PHASE: &str = "Condon-Shortley phase: odd m carry a minus; row l*l + l + m";
const NO_PHASE: &str = "no Condon-Shortley phase: l = 1 rows are 0.488603 (y, z, x); row l*l + l + m";

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 9] = [
        Self::Specula,
        Self::DirectX,
        Self::Unreal,
        Self::Unity,
        Self::Filament,
        Self::Three,
        Self::Babylon,
        Self::BabylonEnv,
        Self::Gltf,
    ];

    /// The name in manifests and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Specula => "specula",
            Self::DirectX => "directx",
            Self::Unreal => "unreal",
            Self::Unity => "unity",
            Self::Filament => "filament",
            Self::Three => "three",
            Self::Babylon => "babylon",
            Self::BabylonEnv => "babylon-env",
            Self::Gltf => "gltf",
        }
    }

    /// The preset of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// The definition of the preset.
    pub const fn definition(self) -> &'static Definition {
        match self {
            Self::Specula => &Definition {
                frame: "right-handed, +Z up",
                yaw: "the centre of a lat-long image looks along +X, its left quarter along +Y",
                signs: NO_PHASE,
                scale: "radiance, orthonormal basis",
                source: "Specula, CONVENTIONS.md",
            },
            Self::DirectX => &Definition {
                frame: "left-handed, +Y up: x = -y, y = z, z = x of Specula's frame",
                yaw: "the centre of a lat-long image looks along +Z, its right quarter along +X (cmft, latLongFromVec)",
                signs: PHASE,
                scale: "radiance, orthonormal basis; degree 1 to 5 (order 2 to 6)",
                source: "DirectXMath SHMath/DirectXSH.cpp, sh_eval_basis; cmft src/cmft/cubemapfilter.cpp, evalSHBasis5, and cubemaputils.h",
            },
            Self::Unreal => &Definition {
                frame: "left-handed, +Z up: x = -y, y = -x, z = z of Specula's frame",
                yaw: "the centre of a lat-long image looks along -Y, its right quarter along +X (long-lat textures)",
                signs: PHASE,
                scale: "radiance, orthonormal basis",
                source: "Unreal Engine Shaders/Private/SHCommon.ush, SHBasisFunction3; TextureCompressorModule.cpp, LookupLongLat and TransformSideToWorldSpace",
            },
            Self::Unity => &Definition {
                frame: "left-handed, +Y up: x = x, y = z, z = y of Specula's frame",
                yaw: "the centre of a lat-long image looks along +X, its left quarter along +Z (Skybox/Panoramic)",
                signs: "coefficients of polynomials: SHA of (x, y, z, 1), SHB of (xy, yz, zz, zx), SHC of xx - yy",
                scale: "A_l / pi times radiance: what a white diffuse surface reflects",
                source: "Unity EntityLighting.hlsl, SHEvalLinearL0L1 and SHEvalLinearL2; HDRP SphericalHarmonics.cs, PackCoefficients; Skybox-Panoramic.shader, ToRadialCoords",
            },
            Self::Filament => &Definition {
                frame: "right-handed, +Y up: x = y, y = z, z = x of Specula's frame",
                yaw: "the centre of a lat-long image looks along +Z, its left quarter along +X (cmgen, mirrored as by default)",
                signs: "coefficients of 1, y, z, x, xy, yz, 3zz - 1, zx, xx - yy",
                scale: "A_l / pi times radiance times the basis' constants: what a white diffuse surface reflects, ready for IndirectLight::Builder::irradiance(3, sh)",
                source: "Filament libs/ibl/src/CubemapSH.cpp, computeIrradianceSH3Bands and renderPreScaledSH3Bands; CubemapUtils.cpp, equirectangularToCubemap; cmgen.cpp",
            },
            Self::Three => &Definition {
                frame: "right-handed, +Y up: x = x, y = z, z = -y of Specula's frame",
                yaw: "the centre of a lat-long image looks along +X, its right quarter along +Z (equirectUv)",
                signs: NO_PHASE,
                scale: "radiance, orthonormal basis; getIrradianceAt applies A_l",
                source: "three.js src/math/SphericalHarmonics3.js; ShaderChunk/common.glsl.js, equirectUv",
            },
            Self::Babylon => &Definition {
                frame: "left-handed, +Y up: x = -y, y = z, z = x of Specula's frame",
                yaw: "the centre of a lat-long image looks along +Z, its right quarter along +X (panoramaToCubemap.ts)",
                signs: PHASE,
                scale: "A_l / pi times radiance, orthonormal basis: SphericalPolynomial.FromHarmonics(SphericalHarmonics.FromArray(coefficients)); preScaledHarmonics then applies the basis' constants",
                source: "Babylon.js Maths/sphericalPolynomial.ts; Misc/HighDynamicRange/cubemapToSphericalPolynomial.ts; harmonicsFunctions.fx, computeEnvironmentIrradiance",
            },
            Self::BabylonEnv => &Definition {
                frame: "left-handed, +Y up: x = -y, y = z, z = x of Specula's frame, the frame of a cube's faces",
                yaw: "the centre of a lat-long image looks along +Z, its right quarter along +X (panoramaToCubemap.ts)",
                signs: "coefficients of x, y, z, xx, yy, zz, yz, zx, xy; a constant is in xx, yy and zz",
                scale: "(A_l / pi)^2 times radiance: what a white diffuse surface reflects, convolved with the cosine once more, as the files of Babylon.js have it",
                source: "Babylon.js Misc/environmentTextureTools.ts, CreateEnvTextureAsync; Maths/sphericalPolynomial.ts; seen in the engine",
            },
            Self::Gltf => &Definition {
                frame: "left-handed, +Y up: x = -y, y = z, z = x of Specula's frame, the frame of a cube's faces",
                yaw: "the centre of a lat-long image looks along +Z, its right quarter along +X, as in Babylon.js, the extension's reader",
                signs: PHASE,
                scale: "A_l times radiance: irradiance, orthonormal basis; irradianceCoefficients",
                source: "glTF EXT_lights_image_based; Babylon.js loaders/glTF/2.0/Extensions/EXT_lights_image_based.ts; seen in the engine",
            },
        }
    }

    /// The degree that lighting of degree `given` is written with.
    pub fn degree(self, given: Degree) -> usize {
        match self {
            Self::Specula => given.get(),
            Self::DirectX => given.get().clamp(1, 5),
            _ => 2,
        }
    }

    /// The numbers of the preset's file.
    pub fn convert(self, lighting: &Expansion) -> Vec<Table> {
        let degree = Degree::new(self.degree(lighting.degree())).unwrap_or(lighting.degree());
        let mut lighting = lighting.to_degree(degree);
        if let Some(to) = self.frame() {
            lighting = frame::seen_in(&lighting, to);
        }
        scale(&mut lighting, |l, m| self.factor(l, m));
        match self {
            Self::Unity => unity(&lighting),
            Self::BabylonEnv => babylon_env(&lighting),
            _ => vec![Table {
                name: "coefficients",
                rows: lighting.coefficients().iter().map(|row| row.to_vec()).collect(),
                single: false,
            }],
        }
    }

    /// The factor of the coefficient (l, m) of radiance, in the engine's frame.
    fn factor(self, l: usize, m: isize) -> f64 {
        match self {
            Self::Specula | Self::Three => 1.0,
            Self::DirectX | Self::Unreal => phase(l, m),
            Self::Babylon => phase(l, m) * reflected(l),
            Self::BabylonEnv => math::powi(reflected(l), 2) * constant(l, m),
            Self::Gltf => phase(l, m) * PI * reflected(l),
            Self::Unity | Self::Filament => reflected(l) * constant(l, m),
        }
    }

    /// Whether the coefficients are of irradiance: A_3 is 0, so that radiance past degree 2 is lost.
    pub fn is_irradiance(self) -> bool {
        !matches!(self, Self::Specula | Self::Three | Self::DirectX | Self::Unreal)
    }

    /// The names of the tables of the preset's file, and how many rows each has for a degree.
    pub fn tables(self, degree: Degree) -> Vec<(&'static str, usize)> {
        self.convert(&Expansion::zero(degree)).iter().map(|table| (table.name, table.rows.len())).collect()
    }

    /// The lighting whose file has these tables, in the order of [`Preset::tables`]: the inverse of
    /// [`Preset::convert`].
    ///
    /// # Errors
    /// If the rows are not those of a degree that the preset has, or not of three numbers (of four in Unity's
    /// first six tables), or a number is not finite.
    pub fn revert(self, tables: &[Vec<Vec<f64>>]) -> Result<Expansion, Error> {
        let damaged = |message: String| Error::damaged(format!("preset {}: {message}", self.name()));
        let mut rows = Vec::new();
        for row in tables.iter().flatten() {
            if let Some(wrong) = row.iter().find(|value| !value.is_finite()) {
                return Err(damaged(format!("{wrong} is not finite")));
            }
            // Unity has a constant in the fourth number.
            let wanted = if self == Self::Unity { 4 } else { 3 };
            let row = <[f64; 4]>::try_from([row.as_slice(), &vec![0.0; 4 - row.len().min(4)]].concat())
                .ok()
                .filter(|_| row.len() == wanted);
            let row = row.ok_or_else(|| damaged(format!("expected rows of {wanted} numbers")))?;
            rows.push(row);
        }
        let rows = match (self, rows.as_slice()) {
            (Self::Unity, &[red, green, blue, red2, green2, blue2, last]) => {
                unity_rows([[red, red2], [green, green2], [blue, blue2]], last)
            }
            (Self::Unity, rows) => return Err(damaged(format!("expected 7 rows, found {}", rows.len()))),
            _ => rows.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        };
        let rows = match <[[f64; 3]; 9]>::try_from(rows) {
            Ok(rows) if self == Self::BabylonEnv => babylon_env_rows(rows),
            Ok(rows) => rows.to_vec(),
            Err(rows) => rows,
        };
        let count = rows.len();
        let degree =
            Degree::new(count.isqrt().saturating_sub(1)).ok().filter(|degree| degree.rows() == count);
        let Some(degree) = degree else {
            return Err(damaged(format!("{count} rows are not (degree + 1)^2 of a degree")));
        };
        if degree.get() > 2 && self.is_irradiance() {
            return Err(damaged(format!(
                "degree {}: radiance past degree 2 is not in irradiance, for A_3 is 0; give the first 9 rows",
                degree.get()
            )));
        }
        if self.degree(degree) != degree.get() {
            return Err(damaged(format!("expected degree {}, found {}", self.degree(degree), degree.get())));
        }
        let mut lighting = Expansion::from_coefficients(degree, rows)
            .ok_or_else(|| damaged("the rows do not fit".into()))?;
        scale(&mut lighting, |l, m| 1.0 / self.factor(l, m));
        Ok(match self.frame_back() {
            Some(to) => frame::seen_in(&lighting, to),
            None => lighting,
        })
    }

    /// A light from a row of its file: direction, angular radius in radians, irradiance.
    pub(super) fn light([x, y, z, radius, r, g, b]: [f64; 7], preset: Self) -> Option<Light> {
        let direction = DVec3::new(x, y, z);
        let direction = preset.frame_back().map_or(direction, |to| to(direction));
        let finite = [radius, r, g, b].iter().all(|value| value.is_finite());
        let direction = Direction::new(direction).filter(|_| finite)?;
        Some(Light { direction, radius, irradiance: [r, g, b] })
    }

    /// Lights in the engine's frame: direction, angular radius in radians, irradiance.
    pub(super) fn lights(self, lights: &[Light]) -> Table {
        let row = |light: &Light| {
            let direction = light.direction.vector();
            let direction = self.frame().map_or(direction, |to| to(direction));
            [&direction.to_array()[..], &[light.radius], &light.irradiance].concat()
        };
        Table { name: "lights", rows: lights.iter().map(row).collect(), single: false }
    }

    /// The map from the engine's frame to ours.
    fn frame_back(self) -> Option<fn(DVec3) -> DVec3> {
        match self {
            Self::Specula => None,
            Self::DirectX | Self::Babylon | Self::BabylonEnv | Self::Gltf => Some(from_cube),
            Self::Unreal => Some(|v| DVec3::new(-v.y, -v.x, v.z)),
            Self::Unity => Some(|v| DVec3::new(v.x, v.z, v.y)),
            Self::Filament => Some(from_file),
            Self::Three => Some(|v| DVec3::new(v.x, -v.z, v.y)),
        }
    }

    /// The map from our frame to the engine's.
    fn frame(self) -> Option<fn(DVec3) -> DVec3> {
        match self {
            Self::Specula => None,
            Self::DirectX | Self::Babylon | Self::BabylonEnv | Self::Gltf => Some(to_cube),
            Self::Unreal => Some(|w| DVec3::new(-w.y, -w.x, w.z)),
            Self::Unity => Some(|w| DVec3::new(w.x, w.z, w.y)),
            Self::Filament => Some(to_file),
            Self::Three => Some(|w| DVec3::new(w.x, w.z, -w.y)),
        }
    }
}

/// The coefficients of 1; y, z, x; xy, yz, 3zz - 1, zx, xx - yy from Unity's vectors.
fn unity_rows(channels: [[[f64; 4]; 2]; 3], last: [f64; 4]) -> Vec<[f64; 3]> {
    let of = |of: &dyn Fn(&[[f64; 4]; 2]) -> f64| channels.each_ref().map(of);
    vec![
        of(&|[linear, quadratic]| linear[3] + quadratic[2] / 3.0),
        of(&|[linear, _]| linear[1]),
        of(&|[linear, _]| linear[2]),
        of(&|[linear, _]| linear[0]),
        of(&|[_, quadratic]| quadratic[0]),
        of(&|[_, quadratic]| quadratic[1]),
        of(&|[_, quadratic]| quadratic[2] / 3.0),
        of(&|[_, quadratic]| quadratic[3]),
        [last[0], last[1], last[2]],
    ]
}

/// The rows of an expansion from the polynomial of an `.env` file.
fn babylon_env_rows([x, y, z, xx, yy, zz, yz, zx, xy]: [[f64; 3]; 9]) -> Vec<[f64; 3]> {
    let of = |of: &dyn Fn(usize) -> f64| std::array::from_fn(of);
    vec![
        of(&|k| (xx[k] + yy[k] + zz[k]) / 3.0),
        y,
        z,
        x,
        xy,
        yz,
        of(&|k| (2.0 * zz[k] - xx[k] - yy[k]) / 6.0),
        zx,
        of(&|k| 0.5 * (xx[k] - yy[k])),
    ]
}

/// Multiplies each row by a factor of (l, m).
fn scale(lighting: &mut Expansion, factor: impl Fn(usize, isize) -> f64) {
    for l in 0..=lighting.degree().get() {
        for m in -(l as isize)..=l as isize {
            let row = &mut lighting.coefficients_mut()[(l * l + l).wrapping_add_signed(m)];
            *row = row.map(|value| value * factor(l, m));
        }
    }
}

/// The Condon-Shortley phase.
fn phase(_: usize, m: isize) -> f64 {
    if m % 2 == 0 { 1.0 } else { -1.0 }
}

/// A_l / pi, l <= 2.
fn reflected(l: usize) -> f64 {
    [1.0, 2.0 / 3.0, 0.25][l]
}

/// The constant of Y_lm, l <= 2, before the polynomials 1; y, z, x; xy, yz, 3zz - 1, zx, xx - yy.
fn constant(l: usize, m: isize) -> f64 {
    match (l, m) {
        (0, _) => (0.25 / PI).sqrt(),
        (1, _) => (0.75 / PI).sqrt(),
        (_, 0) => (5.0 / (16.0 * PI)).sqrt(),
        (_, 2) => (15.0 / (16.0 * PI)).sqrt(),
        _ => (15.0 / (4.0 * PI)).sqrt(),
    }
}

/// Unity's seven vectors: the constant of 3zz - 1 joins that of 1.
fn unity(polynomial: &Expansion) -> Vec<Table> {
    let c = polynomial.coefficients();
    let single = |name, row: Vec<f64>| Table { name, rows: vec![row], single: true };
    let linear = |name, k: usize| single(name, vec![c[3][k], c[1][k], c[2][k], c[0][k] - c[6][k]]);
    let quadratic = |name, k: usize| single(name, vec![c[4][k], c[5][k], 3.0 * c[6][k], c[7][k]]);
    vec![
        linear("SHAr", 0),
        linear("SHAg", 1),
        linear("SHAb", 2),
        quadratic("SHBr", 0),
        quadratic("SHBg", 1),
        quadratic("SHBb", 2),
        single("SHC", vec![c[8][0], c[8][1], c[8][2], 1.0]),
    ]
}

/// The polynomial of an `.env` file. On the sphere 1 is xx + yy + zz, and 3zz - 1 is 2zz - xx - yy.
fn babylon_env(polynomial: &Expansion) -> Vec<Table> {
    let c = polynomial.coefficients();
    let single =
        |name, of: &dyn Fn(usize) -> f64| Table { name, rows: vec![(0..3).map(of).collect()], single: true };
    vec![
        single("x", &|k| c[3][k]),
        single("y", &|k| c[1][k]),
        single("z", &|k| c[2][k]),
        single("xx", &|k| c[0][k] - c[6][k] + c[8][k]),
        single("yy", &|k| c[0][k] - c[6][k] - c[8][k]),
        single("zz", &|k| c[0][k] + 2.0 * c[6][k]),
        single("yz", &|k| c[5][k]),
        single("zx", &|k| c[7][k]),
        single("xy", &|k| c[4][k]),
    ]
}

#[cfg(test)]
mod tests;
