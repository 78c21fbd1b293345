//! From a file's primaries to linear Rec. 709.
//!
//! The primaries r, g, b and the white w, CIE 1931 (x, y), fix the matrix from RGB to XYZ: its columns are
//! the primaries' XYZ, scaled so that (1, 1, 1) gives the white at Y = 1 (SMPTE RP 177). A white that is not
//! Rec. 709's D65 is adapted with the Bradford cone response, so that white stays white:
//!
//! M = M_709^-1 B^-1 diag(B w_709 / B w) B M_file.
//!
//! Wider primaries hold colours that Rec. 709 cannot: the matrix makes a channel of theirs negative. Such a
//! pixel p moves toward its grey of the same luminance Y, by the least step that leaves no channel negative:
//!
//! p' = Y + t (p - Y), t = Y / (Y - min p).
//!
//! Its luminance and its hue in that sense stay. A pixel with a negative channel in the file's own primaries
//! stays as the matrix makes it, because the file itself is wrong there.

use sphere::{DMat3, DVec3};

use super::outside_gamut::OutsideGamut;

/// CIE 1931 (x, y) of the red, green and blue primaries and of the white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chromaticities(pub(crate) [[f64; 2]; 4]);

impl Chromaticities {
    /// ITU-R BT.709, white D65.
    pub(crate) const REC_709: Self = Self([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]]);

    /// ITU-R BT.2020, white D65.
    pub(crate) const REC_2020: Self =
        Self([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]]);

    /// SMPTE EG 432-1, white D65: Display P3.
    pub(crate) const P3_D65: Self = Self([[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], [0.3127, 0.3290]]);

    /// ACEScg, AP1 (Academy S-2014-004), white about D60.
    pub(crate) const ACES_CG: Self =
        Self([[0.713, 0.293], [0.165, 0.830], [0.128, 0.044], [0.32168, 0.33767]]);

    /// ACES2065-1, AP0 (SMPTE ST 2065-1), white about D60.
    pub(crate) const ACES_2065_1: Self =
        Self([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770], [0.32168, 0.33767]]);

    /// ROMM RGB (ISO 22028-2), called ProPhoto, white D50.
    pub(crate) const PRO_PHOTO: Self =
        Self([[0.7347, 0.2653], [0.1596, 0.8404], [0.0366, 0.0001], [0.3457, 0.3585]]);

    /// Adobe RGB (1998), white D65.
    pub(crate) const ADOBE_RGB: Self = Self([[0.64, 0.33], [0.21, 0.71], [0.15, 0.06], [0.3127, 0.3290]]);

    /// CIE XYZ in which D65 is white: (0.95, 1, 1.09), not (1, 1, 1).
    pub(crate) const XYZ_D65: Self = Self([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.3127, 0.3290]]);

    /// CIE XYZ itself, whose white has equal energy, as Radiance takes it.
    pub(crate) const XYZ: Self = Self([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]]);

    /// Whether all coordinates agree within 1e-4.
    pub(crate) fn is_near(self, other: Self) -> bool {
        let pairs = self.0.iter().flatten().zip(other.0.iter().flatten());
        pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-4)
    }

    /// The matrix to linear Rec. 709; the identity if they agree within 1e-4; `None` if the
    /// chromaticities span no colour space.
    pub(crate) fn to_rec_709(self) -> Option<DMat3> {
        if self.is_near(Self::REC_709) {
            return Some(DMat3::IDENTITY);
        }
        let to = Self::REC_709.to_xyz()?.inverse();
        if self == Self::XYZ_D65 {
            return Some(to);
        }
        let from = self.to_xyz()?;
        let bradford = DMat3::from_cols_array(&[
            0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
        ]);
        let gain = (bradford * white(Self::REC_709.0[3])?) / (bradford * white(self.0[3])?);
        let matrix = to * bradford.inverse() * DMat3::from_diagonal(gain) * bradford * from;
        matrix.is_finite().then_some(matrix)
    }

    /// The matrix to XYZ, white at Y = 1; `None` if the chromaticities span no colour space.
    pub(crate) fn to_xyz(self) -> Option<DMat3> {
        let [r, g, b, w] = self.0;
        // Columns at x + y + z = 1 rather than Y = 1: a primary may have y = 0, as X and Z have.
        let column = |[x, y]: [f64; 2]| DVec3::new(x, y, 1.0 - x - y);
        let primaries = DMat3::from_cols(column(r), column(g), column(b));
        if !primaries.is_finite() || primaries.determinant().abs() < 1e-6 {
            return None;
        }
        let scale = primaries.inverse() * white(w)?;
        scale.is_finite().then(|| primaries * DMat3::from_diagonal(scale))
    }
}

/// The XYZ of a white of Y = 1.
fn white([x, y]: [f64; 2]) -> Option<DVec3> {
    (x.is_finite() && y.is_finite() && y > 1e-6).then(|| DVec3::new(x / y, 1.0, (1.0 - x - y) / y))
}

/// Applies a matrix to every pixel; negative values that it makes are kept.
pub(crate) fn apply_linear(matrix: DMat3, pixels: &mut [[f32; 3]]) {
    if matrix == DMat3::IDENTITY {
        return;
    }
    for pixel in pixels {
        *pixel = (matrix * DVec3::from_array(pixel.map(f64::from))).to_array().map(|value| value as f32);
    }
}

/// Converts every pixel of light to Rec. 709 by a matrix, and brings colours in that lie outside of it. What
/// the file has below zero is converted apart, so that it stays below zero. A pixel that is not finite stays
/// as it is.
pub(crate) fn apply(matrix: DMat3, pixels: &mut [[f32; 3]]) -> OutsideGamut {
    let mut outside = OutsideGamut::default();
    outside.of = pixels.len();
    let Some(to_xyz) = Chromaticities::REC_709.to_xyz().filter(|_| matrix != DMat3::IDENTITY) else {
        return outside;
    };
    let luminance = to_xyz.row(1);
    for pixel in pixels {
        let given = DVec3::from_array(pixel.map(f64::from));
        if !given.is_finite() {
            continue;
        }
        let converted = matrix * given.max(DVec3::ZERO);
        let (grey, least) = (luminance.dot(converted), converted.min_element());
        let is_outside = least < 0.0 && grey > 0.0;
        let kept = if is_outside {
            // The least channel becomes 0 up to rounding.
            (grey + grey / (grey - least) * (converted - grey)).max(DVec3::ZERO)
        } else {
            converted
        };
        let moved = (kept - converted).abs().element_sum();
        outside.add(is_outside, grey.max(0.0), moved, kept.abs().element_sum());
        let negative = matrix * given.min(DVec3::ZERO);
        *pixel = (kept + negative).to_array().map(|value| value as f32);
    }
    outside
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published matrix of Rec. 2020 to Rec. 709 (ITU-R BT.2087, printed to four decimals).
    #[test]
    fn rec_2020_gives_the_published_matrix() {
        let matrix = Chromaticities([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], [0.3127, 0.3290]])
            .to_rec_709()
            .unwrap();
        let published = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
        for (row, expected) in published.iter().enumerate() {
            for (column, value) in expected.iter().enumerate() {
                assert!((matrix.col(column)[row] - value).abs() < 5.1e-5, "{matrix}");
            }
        }
    }

    /// Values of the Python package colour-science: RGB_to_RGB of (0.8, 0.4, 0.2) with the Bradford
    /// transform. It takes the matrices as the standards print them, to four digits.
    #[test]
    fn spaces_agree_with_colour_science() {
        for (space, expected) in [
            (Chromaticities::REC_2020, [1.078_766, 0.351_85, 0.168_994]),
            (Chromaticities::P3_D65, [0.889_976, 0.383_177, 0.172_49]),
            (Chromaticities::ACES_CG, [1.098_672, 0.350_007, 0.159_804]),
            (Chromaticities::ACES_2065_1, [1.486_186, 0.308_656, 0.160_178]),
            (Chromaticities::PRO_PHOTO, [1.275, 0.309_045, 0.164_157]),
            (Chromaticities::ADOBE_RGB, [0.959_357, 0.399_988, 0.191_415]),
        ] {
            let matrix = space.to_rec_709().unwrap();
            let found = matrix * DVec3::new(0.8, 0.4, 0.2);
            assert!((found - DVec3::from_array(expected)).abs().max_element() < 3e-4, "{space:?} {found}");
        }
    }

    #[test]
    fn a_colour_outside_moves_to_its_grey_until_no_channel_is_negative() {
        let matrix = Chromaticities::ACES_CG.to_rec_709().unwrap();
        let luminance = Chromaticities::REC_709.to_xyz().unwrap().row(1);
        let given = [[0.02, 2.0, 0.02], [0.8, 0.4, 0.2], [-0.1, 2.0, 0.02], [f32::INFINITY, 1.0, 1.0]];
        let mut pixels = given;
        let outside = apply(matrix, &mut pixels);
        assert_eq!((outside.pixels, outside.of), (2, 4));
        let linear = matrix * DVec3::new(0.02, 2.0, 0.02);
        assert!(linear.min_element() < 0.0);
        let moved = DVec3::from_array(pixels[0].map(f64::from));
        assert_eq!(moved.min_element(), 0.0);
        assert!((luminance.dot(moved) / luminance.dot(linear) - 1.0).abs() < 1e-6);
        // On the line from the colour to its grey.
        let grey = luminance.dot(linear);
        let t = (moved - grey) / (linear - grey);
        assert!((t - t.x).abs().max_element() < 1e-6 && (0.0..1.0).contains(&t.x), "{t}");
        // What is inside and what is not finite are as the matrix makes them. What was negative in the file
        // stays so beside the colour that is moved: the speck takes nothing else from it.
        assert!(pixels[1].iter().all(|value| *value > 0.0));
        let mut without = [[0.0, 2.0, 0.02]];
        apply(matrix, &mut without);
        let speck = matrix * DVec3::new(-0.1, 0.0, 0.0);
        for channel in 0..3 {
            assert!((f64::from(pixels[2][channel] - without[0][channel]) - speck[channel]).abs() < 1e-6);
        }
        assert!(pixels[2].iter().any(|value| *value < 0.0));
        assert_eq!(pixels[3], given[3]);
    }

    #[test]
    fn white_stays_white_and_nonsense_is_refused() {
        let equal_energy = Chromaticities([[0.64, 0.33], [0.29, 0.60], [0.15, 0.06], [1.0 / 3.0, 1.0 / 3.0]]);
        for chromaticities in [equal_energy, Chromaticities::XYZ] {
            let white = chromaticities.to_rec_709().unwrap() * DVec3::ONE;
            assert!((white - DVec3::ONE).abs().max_element() < 1e-12, "{white}");
        }
        assert_eq!(Chromaticities([[0.0; 2]; 4]).to_rec_709(), None);
        assert_eq!(Chromaticities([[f64::NAN; 2]; 4]).to_rec_709(), None);
    }
}
