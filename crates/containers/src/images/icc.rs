//! ICC profiles: from a picture's codes to linear Rec. 709.
//!
//! A profile of curves and a matrix (sRGB, Display P3, Adobe RGB, Rec. 2020, linear ones) is applied as
//! ICC.1:2022, annex F says: a curve for each channel, then the matrix to the connection space, which is
//! relative to D50 as that of sRGB is. A profile of tables is applied by `moxcms`, to values from 0 to 1.

use std::sync::Arc;

use moxcms::{
    ColorProfile, DataColorSpace, Layout, ParametricCurve, ProfileText, ToneReprCurve, TransformF32Executor,
    TransformOptions,
};
use sphere::DMat3;

use super::chromaticity;
use super::colour_space::ColourSpace;
use super::outside_gamut::OutsideGamut;

/// The linear value of an encoded one.
pub(crate) type Curve = Box<dyn Fn(f64) -> f64 + Send + Sync>;

/// Pixels that `moxcms` converts at a time.
const BLOCK: usize = 4096;

/// How far the matrix of an sRGB profile may be from the identity: profiles round the primaries.
const ROUNDING: f64 = 2e-3;

/// How the values of a picture become linear Rec. 709.
pub(crate) struct Encoding {
    /// The curve of each channel, applied first.
    pub(crate) curves: [Curve; 3],
    primaries: Primaries,
    /// The name of the ICC profile, or PNG's cICP, if it comes from one.
    pub(crate) profile: Option<String>,
}

enum Primaries {
    Matrix(DMat3),
    Tables(Arc<TransformF32Executor>),
}

impl Encoding {
    /// The encoding of sRGB (IEC 61966-2-1).
    pub(crate) fn srgb() -> Self {
        Self::of_curve(srgb_to_linear)
    }

    /// The encoding of values that are linear Rec. 709 already.
    pub(crate) fn linear() -> Self {
        Self::of_curve(|value| value)
    }

    fn of_curve(curve: fn(f64) -> f64) -> Self {
        Self::of_curve_and_matrix(curve, DMat3::IDENTITY)
    }

    /// The encoding by one curve for all channels, then a matrix to linear Rec. 709.
    pub(crate) fn of_curve_and_matrix(curve: fn(f64) -> f64, matrix: DMat3) -> Self {
        let curves = [(); 3].map(|()| -> Curve { Box::new(curve) });
        Self { curves, primaries: Primaries::Matrix(matrix), profile: None }
    }

    /// The encoding that an ICC profile describes, for a grey picture or one in RGB, of integers or floats.
    ///
    /// # Errors
    /// If the profile is damaged, or is for other pictures: why it cannot be applied, for a warning.
    pub(crate) fn of_profile(bytes: &[u8], grey: bool, floats: bool) -> Result<Self, String> {
        let profile =
            ColorProfile::new_from_slice(bytes).map_err(|error| format!("it is damaged: {error}"))?;
        let wanted = if grey { DataColorSpace::Gray } else { DataColorSpace::Rgb };
        if profile.color_space != wanted {
            return Err(format!("it is for {:?}, and the pixels are {wanted:?}", profile.color_space));
        }
        let name = Some(name_of(&profile));
        if grey {
            let curves = [(); 3].map(|()| curve(profile.gray_trc.as_ref()));
            let [Some(r), Some(g), Some(b)] = curves else { return Err("it has no grey curve".into()) };
            let primaries = Primaries::Matrix(DMat3::IDENTITY);
            return Ok(Self { curves: [r, g, b], primaries, profile: name });
        }
        let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc].map(|trc| curve(trc.as_ref()));
        if let ([Some(r), Some(g), Some(b)], true) = (curves, profile.is_matrix_shaper()) {
            let primaries = Primaries::Matrix(matrix(&profile)?);
            return Ok(Self { curves: [r, g, b], primaries, profile: name });
        }
        if floats {
            return Err("it is made of tables, which hold values from 0 to 1 only".into());
        }
        let mut rec_709 = ColorProfile::new_srgb();
        rec_709.cicp = None;
        for curve in [&mut rec_709.red_trc, &mut rec_709.green_trc, &mut rec_709.blue_trc] {
            *curve = Some(ToneReprCurve::Lut(Vec::new()));
        }
        let options = TransformOptions::default();
        let tables = profile.create_transform_f32(Layout::Rgb, &rec_709, Layout::Rgb, options);
        let tables = tables.map_err(|error| format!("it cannot be applied: {error}"))?;
        Ok(Self { primaries: Primaries::Tables(tables), profile: name, ..Self::linear() })
    }

    /// Whether the primaries are those of another encoding; those of tables are unknown.
    pub(crate) fn has_primaries_of(&self, other: &Self) -> bool {
        match (&self.primaries, &other.primaries) {
            (Primaries::Matrix(one), Primaries::Matrix(other)) => one.abs_diff_eq(*other, ROUNDING),
            _ => false,
        }
    }

    /// The matrix to linear Rec. 709; `None` if tables stand for it.
    pub(crate) fn matrix(&self) -> Option<DMat3> {
        match &self.primaries {
            Primaries::Matrix(matrix) => Some(*matrix),
            Primaries::Tables(_) => None,
        }
    }

    /// Changes the primaries from those of one matrix to those of another, and with them pixels that the
    /// curves made linear.
    pub(crate) fn change_primaries(&mut self, [from, to]: [DMat3; 2], pixels: &mut [[f32; 3]]) {
        chromaticity::apply_linear(to.inverse() * from, pixels);
        self.primaries = Primaries::Matrix(to);
    }

    /// Returns these curves with the primaries of a colour space; a warning says if a profile or cICP has
    /// others. A profile of tables is left out: it has no curve of its own.
    #[must_use]
    pub(crate) fn with_primaries(self, space: ColourSpace, warnings: &mut Vec<String>) -> Self {
        let matrix = space.chromaticities().to_rec_709().unwrap_or(DMat3::IDENTITY);
        let wanted = Self { primaries: Primaries::Matrix(matrix), profile: None, ..Self::srgb() };
        if let Some(profile) = self.profile.as_ref().filter(|_| !self.has_primaries_of(&wanted)) {
            let name = space.name();
            let source = if profile.starts_with("cICP ") { "the chunk" } else { "the ICC profile" };
            warnings.push(format!(
                "{source} {profile} names other primaries than `{name}`, which were asked for; `{name}` was \
                 taken"
            ));
        }
        match self.primaries {
            Primaries::Matrix(_) => Self { curves: self.curves, profile: self.profile, ..wanted },
            Primaries::Tables(_) => wanted,
        }
    }

    /// Converts pixels that the curves made linear to the primaries of Rec. 709.
    pub(crate) fn convert_primaries(&self, pixels: &mut [[f32; 3]]) -> Result<OutsideGamut, String> {
        match &self.primaries {
            Primaries::Matrix(matrix) => return Ok(chromaticity::apply(*matrix, pixels)),
            Primaries::Tables(tables) => {
                let mut converted = [[0.0; 3]; BLOCK];
                for block in pixels.chunks_mut(BLOCK) {
                    let converted = &mut converted[..block.len()];
                    let done = tables.transform(block.as_flattened(), converted.as_flattened_mut());
                    done.map_err(|error| error.to_string())?;
                    block.copy_from_slice(converted);
                }
            }
        }
        Ok(OutsideGamut::default())
    }
}

/// The coding-independent code points of a profile (ICC.1:2022, section 9.2.17) whose transfer is PQ or HLG:
/// its curves and tables are made for a display in SDR.
pub(crate) fn code_points_in_hdr(bytes: &[u8]) -> Option<[u8; 4]> {
    let found = ColorProfile::new_from_slice(bytes).ok()?.cicp?;
    let transfer = found.transfer_characteristics as u8;
    [16, 18].contains(&transfer).then_some([
        found.color_primaries as u8,
        transfer,
        found.matrix_coefficients as u8,
        u8::from(found.full_range),
    ])
}

/// The matrix from a profile's primaries to those of Rec. 709.
fn matrix(profile: &ColorProfile) -> Result<DMat3, String> {
    let rows = profile.transform_matrix(&ColorProfile::new_srgb()).v;
    let matrix = DMat3::from_cols_array_2d(&rows).transpose();
    if !matrix.is_finite() || matrix.determinant().abs() < 1e-6 {
        return Err("its primaries span no colour space".into());
    }
    let same = matrix.abs_diff_eq(DMat3::IDENTITY, ROUNDING);
    Ok(if same { DMat3::IDENTITY } else { matrix })
}

/// A profile's curve (ICC.1:2022, sections 10.6 and 10.18), continued beyond [0, 1] for pictures in floats.
fn curve(curve: Option<&ToneReprCurve>) -> Option<Curve> {
    match curve? {
        ToneReprCurve::Lut(values) if values.is_empty() => Some(Box::new(|value| value)),
        ToneReprCurve::Lut(values) if values.len() == 1 => {
            let gamma = f64::from(values[0]) / 256.0;
            Some(Box::new(move |value| math::pow(value.abs(), gamma).copysign(value)))
        }
        ToneReprCurve::Lut(values) => {
            let values: Vec<f64> = values.iter().map(|&value| f64::from(value) / 65535.0).collect();
            let last = values.len() - 1;
            Some(Box::new(move |value| {
                let place = value * last as f64;
                let below = (place as usize).min(last - 1);
                let [a, b] = [values[below], values[below + 1]];
                a + (b - a) * (place - below as f64)
            }))
        }
        ToneReprCurve::Parametric(numbers) => {
            numbers.first()?;
            let curve = ParametricCurve::new(numbers)?;
            Some(Box::new(move |value| curve.eval(value as f32).into()))
        }
    }
}

/// The name that a profile gives itself.
fn name_of(profile: &ColorProfile) -> String {
    let name = match &profile.description {
        Some(ProfileText::PlainString(name)) => name.clone(),
        Some(ProfileText::Localizable(names)) => {
            names.first().map(|name| name.value.clone()).unwrap_or_default()
        }
        Some(ProfileText::Description(name)) => name.ascii_string.clone(),
        None => String::new(),
    };
    let name: String = name.chars().filter(|character| !character.is_control()).take(80).collect();
    if name.is_empty() { "without a name".into() } else { name }
}

pub(crate) fn srgb_to_linear(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { math::pow((value + 0.055) / 1.055, 2.4) }
}
