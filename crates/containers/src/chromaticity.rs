//! From a file's primaries to linear Rec. 709.
//!
//! The primaries r, g, b and the white w, CIE 1931 (x, y), fix the matrix from RGB to XYZ: its columns are
//! the primaries' XYZ, scaled so that (1, 1, 1) gives the white at Y = 1 (SMPTE RP 177). A white that is not
//! Rec. 709's D65 is adapted with the Bradford cone response, so that white stays white:
//!
//! M = M_709^-1 B^-1 diag(B w_709 / B w) B M_file.

use sphere::{DMat3, DVec3};

/// CIE 1931 (x, y) of the red, green and blue primaries and of the white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chromaticities(pub(crate) [[f64; 2]; 4]);

impl Chromaticities {
    /// ITU-R BT.709, white D65.
    pub(crate) const REC_709: Self = Self([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]]);

    /// CIE XYZ itself, whose white has equal energy, as Radiance takes it.
    pub(crate) const XYZ: Self = Self([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.0 / 3.0, 1.0 / 3.0]]);

    /// The matrix to linear Rec. 709; the identity if they agree within 1e-4; `None` if the
    /// chromaticities span no colour space.
    pub(crate) fn to_rec_709(self) -> Option<DMat3> {
        let same = self.0.iter().flatten().zip(Self::REC_709.0.iter().flatten());
        if same.clone().all(|(a, b)| (a - b).abs() < 1e-4) {
            return Some(DMat3::IDENTITY);
        }
        let from = self.to_xyz()?;
        let to = Self::REC_709.to_xyz()?.inverse();
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

/// XYZ of a white of Y = 1.
fn white([x, y]: [f64; 2]) -> Option<DVec3> {
    (x.is_finite() && y.is_finite() && y > 1e-6).then(|| DVec3::new(x / y, 1.0, (1.0 - x - y) / y))
}

/// Applies a matrix to every pixel.
pub(crate) fn apply(matrix: DMat3, pixels: &mut [[f32; 3]]) {
    if matrix == DMat3::IDENTITY {
        return;
    }
    for pixel in pixels {
        *pixel = (matrix * DVec3::from_array(pixel.map(f64::from))).to_array().map(|value| value as f32);
    }
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
