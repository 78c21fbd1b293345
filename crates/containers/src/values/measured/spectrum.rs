//! Reflectance spectra to linear Rec. 709.
//!
//! X, Y, Z = sum of D65(lambda) (x, y, z)(lambda) f(lambda) over 380, 385 .. 780 nm, divided by the same sums
//! for f = 1 and times the XYZ of Rec. 709's white; then Rec. 709's matrix. So a perfect white reflector is
//! (1, 1, 1): colours are what they are under D65, given as reflectances. Between its wavelengths f is
//! linear, past the first and the last it stays.
//!
//! The colour-matching functions of the CIE 1931 standard observer and the illuminant D65 are the values at 5
//! nm of CIE publication 15 (tables T.4 and T.1).

use sphere::{DMat3, DVec3};

use crate::images::Chromaticities;

/// The first wavelength of the table, which has a row every 5 nm from 380 nm to 780 nm.
const FIRST: f64 = 380.0;
const STEP: f64 = 5.0;

/// Converts spectra at fixed wavelengths to Rec. 709.
pub(super) struct Observer {
    weights: Vec<DVec3>,
    matrix: DMat3,
}

impl Observer {
    /// An observer of spectra at these rising wavelengths in nm; `None` if they do not span 450 to 630 nm.
    pub(super) fn new(wavelengths: &[f64]) -> Option<Self> {
        let (first, last) = (*wavelengths.first()?, *wavelengths.last()?);
        if first > 450.0 || last < 630.0 {
            return None;
        }
        let mut weights = vec![DVec3::ZERO; wavelengths.len()];
        let mut white = DVec3::ZERO;
        for (row, [light, x, y, z]) in CIE.iter().enumerate() {
            let wavelength = FIRST + STEP * row as f64;
            let seen = DVec3::new(*x, *y, *z) * *light;
            white += seen;
            let after = wavelengths.partition_point(|sample| *sample <= wavelength);
            if after == 0 {
                weights[0] += seen;
            } else if after == wavelengths.len() {
                weights[after - 1] += seen;
            } else {
                let (low, high) = (wavelengths[after - 1], wavelengths[after]);
                let share = (wavelength - low) / (high - low);
                weights[after - 1] += seen * (1.0 - share);
                weights[after] += seen * share;
            }
        }
        let to_xyz = Chromaticities::REC_709.to_xyz()?;
        // The tabulated white differs from (0.3127, 0.3290) by some 1e-4.
        let matrix = to_xyz.inverse() * DMat3::from_diagonal(to_xyz * DVec3::ONE / white);
        Some(Self { weights, matrix })
    }

    /// The colour of a spectrum with one value a wavelength; channels are negative out of the gamut.
    pub(super) fn rec_709(&self, spectrum: &[f64]) -> [f64; 3] {
        let sum = self
            .weights
            .iter()
            .zip(spectrum)
            .fold(DVec3::ZERO, |sum, (weight, value)| sum + *weight * *value);
        (self.matrix * sum).to_array()
    }
}

/// D65, x, y, z.
#[rustfmt::skip]
const CIE: [[f64; 4]; 81] = [
    [49.9755, 0.001368, 3.9e-05, 0.00645], [52.3118, 0.002236, 6.4e-05, 0.01055],
    [54.6482, 0.004243, 0.00012, 0.02005], [68.7015, 0.00765, 0.000217, 0.03621],
    [82.7549, 0.01431, 0.000396, 0.06785], [87.1204, 0.02319, 0.00064, 0.1102],
    [91.486, 0.04351, 0.00121, 0.2074], [92.4589, 0.07763, 0.00218, 0.3713],
    [93.4318, 0.13438, 0.004, 0.6456], [90.057, 0.21477, 0.0073, 1.03905],
    [86.6823, 0.2839, 0.0116, 1.3856], [95.7736, 0.3285, 0.01684, 1.62296],
    [104.865, 0.34828, 0.023, 1.74706], [110.936, 0.34806, 0.0298, 1.7826],
    [117.008, 0.3362, 0.038, 1.77211], [117.41, 0.3187, 0.048, 1.7441],
    [117.812, 0.2908, 0.06, 1.6692], [116.336, 0.2511, 0.0739, 1.5281],
    [114.861, 0.19536, 0.09098, 1.28764], [115.392, 0.1421, 0.1126, 1.0419],
    [115.923, 0.09564, 0.13902, 0.81295], [112.367, 0.05795, 0.1693, 0.6162],
    [108.811, 0.03201, 0.20802, 0.46518], [109.082, 0.0147, 0.2586, 0.3533],
    [109.354, 0.0049, 0.323, 0.272], [108.578, 0.0024, 0.4073, 0.2123],
    [107.802, 0.0093, 0.503, 0.1582], [106.296, 0.0291, 0.6082, 0.1117],
    [104.79, 0.06327, 0.71, 0.07825], [106.239, 0.1096, 0.7932, 0.05725],
    [107.689, 0.1655, 0.862, 0.04216], [106.047, 0.22575, 0.91485, 0.02984],
    [104.405, 0.2904, 0.954, 0.0203], [104.225, 0.3597, 0.9803, 0.0134],
    [104.046, 0.43345, 0.99495, 0.00875], [102.023, 0.51205, 1.0, 0.00575],
    [100.0, 0.5945, 0.995, 0.0039], [98.1671, 0.6784, 0.9786, 0.00275],
    [96.3342, 0.7621, 0.952, 0.0021], [96.0611, 0.8425, 0.9154, 0.0018],
    [95.788, 0.9163, 0.87, 0.00165], [92.2368, 0.9786, 0.8163, 0.0014],
    [88.6856, 1.0263, 0.757, 0.0011], [89.3459, 1.0567, 0.6949, 0.001],
    [90.0062, 1.0622, 0.631, 0.0008], [89.8026, 1.0456, 0.5668, 0.0006],
    [89.5991, 1.0026, 0.503, 0.00034], [88.6489, 0.9384, 0.4412, 0.00024],
    [87.6987, 0.85445, 0.381, 0.00019], [85.4936, 0.7514, 0.321, 0.0001],
    [83.2886, 0.6424, 0.265, 5e-05], [83.4939, 0.5419, 0.217, 3e-05],
    [83.6992, 0.4479, 0.175, 2e-05], [81.863, 0.3608, 0.1382, 1e-05],
    [80.0268, 0.2835, 0.107, 0.0], [80.1207, 0.2187, 0.0816, 0.0],
    [80.2146, 0.1649, 0.061, 0.0], [81.2462, 0.1212, 0.04458, 0.0],
    [82.2778, 0.0874, 0.032, 0.0], [80.281, 0.0636, 0.0232, 0.0],
    [78.2842, 0.04677, 0.017, 0.0], [74.0027, 0.0329, 0.01192, 0.0],
    [69.7213, 0.0227, 0.00821, 0.0], [70.6652, 0.01584, 0.005723, 0.0],
    [71.6091, 0.011359, 0.004102, 0.0], [72.979, 0.008111, 0.002929, 0.0],
    [74.349, 0.00579, 0.002091, 0.0], [67.9765, 0.004109, 0.001484, 0.0],
    [61.604, 0.002899, 0.001047, 0.0], [65.7448, 0.002049, 0.00074, 0.0],
    [69.8856, 0.00144, 0.00052, 0.0], [72.4863, 0.001, 0.000361, 0.0],
    [75.087, 0.00069, 0.000249, 0.0], [69.3398, 0.000476, 0.000172, 0.0],
    [63.5927, 0.000332, 0.00012, 0.0], [55.0054, 0.000235, 8.5e-05, 0.0],
    [46.4182, 0.000166, 6e-05, 0.0], [56.6118, 0.000117, 4.2e-05, 0.0],
    [66.8054, 8.3e-05, 3e-05, 0.0], [65.0941, 5.9e-05, 2.1e-05, 0.0],
    [63.3828, 4.2e-05, 1.5e-05, 0.0],
];

#[cfg(test)]
mod tests {
    use super::*;

    fn visible(step: f64) -> Vec<f64> {
        (0..).map(|i| 400.0 + step * f64::from(i)).take_while(|wavelength| *wavelength <= 700.0).collect()
    }

    #[test]
    fn white_is_white_and_light_is_linear() {
        for step in [5.0, 10.0, 25.0] {
            let wavelengths = visible(step);
            let observer = Observer::new(&wavelengths).unwrap();
            let white = observer.rec_709(&vec![1.0; wavelengths.len()]);
            assert!(white.iter().all(|channel| (channel - 1.0).abs() < 1e-12), "{white:?}");
            let grey = observer.rec_709(&vec![0.18; wavelengths.len()]);
            assert!(grey.iter().all(|channel| (channel - 0.18).abs() < 1e-12), "{grey:?}");
        }
    }

    /// CIE 15: the columns of the observer add up to 21.371524, 21.371327 and 21.371540 (a digit that is
    /// wrong in one row shows); the white of D65 is x = 0.31272, y = 0.32903 (2 degrees); y is 1 at 555 nm,
    /// where D65 is 102.023.
    #[test]
    fn the_tables_have_their_published_sums() {
        let white = [1, 2, 3].map(|column| CIE.iter().map(|row| row[0] * row[column]).sum::<f64>());
        let [x, y] = [0, 1].map(|axis| white[axis] / white.iter().sum::<f64>());
        assert!((x - 0.31272).abs() < 2e-5 && (y - 0.32903).abs() < 2e-5, "{x} {y}");
        for (column, expected) in [(1, 21.371_524), (2, 21.371_327), (3, 21.371_540)] {
            let found: f64 = CIE.iter().map(|row| row[column]).sum();
            assert!((found - expected).abs() < 5e-7, "{column}: {found}");
        }
        assert_eq!(CIE[35], [102.023, 0.51205, 1.0, 0.00575]);
    }

    #[test]
    fn thirds_of_the_spectrum_are_blue_green_and_red() {
        let wavelengths = visible(10.0);
        let observer = Observer::new(&wavelengths).unwrap();
        let band = |low: f64, high: f64| {
            let spectrum: Vec<f64> =
                wavelengths.iter().map(|w| if (low..high).contains(w) { 1.0 } else { 0.0 }).collect();
            observer.rec_709(&spectrum)
        };
        let [blue, green, red] = [band(400.0, 490.0), band(490.0, 580.0), band(580.0, 701.0)];
        assert!(blue[2] > 0.8 && green[1] > 0.8 && red[0] > 0.8, "{blue:?} {green:?} {red:?}");
        for channel in 0..3 {
            assert!((blue[channel] + green[channel] + red[channel] - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn wavelengths_must_span_the_visible() {
        assert!(Observer::new(&[500.0, 700.0]).is_none());
        assert!(Observer::new(&[400.0, 600.0]).is_none());
        assert!(Observer::new(&[]).is_none());
    }
}
