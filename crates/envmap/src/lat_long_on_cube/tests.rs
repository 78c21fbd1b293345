use super::*;

/// Compares every point with its arc tangents, on sizes at which the poles are and are not between
/// texels.
#[test]
fn points_are_where_their_directions_are() {
    for (edge, rows) in [(64, 100), (33, 64), (5, 8)] {
        let (picture, cube) = (LatLong::with_rows(rows), Cube { edge });
        let points = LatLongOnCube::new(picture, cube);
        // A function that is linear in the taps' coordinates everywhere but at the seam.
        let place = |taps: Taps| {
            let mut sum = [0.0; 2];
            for (index, weight) in taps.index.into_iter().zip(taps.weight) {
                let phi = TAU * (index % picture.width) as f64 / picture.width as f64;
                sum[0] += weight * (phi.sin() + 0.3 * phi.cos());
                sum[1] += weight * (index / picture.width) as f64 / picture.height as f64;
            }
            sum
        };
        let mut whole = 0.0;
        for row in 0..6 * edge {
            for column in 0..edge {
                let mut found = Vec::new();
                points.visit(row, column, |taps, solid_angle| found.push((place(taps), solid_angle)));
                let along = (found.len() as f64).sqrt() as usize;
                let mut expected = Vec::new();
                points.canvas.points(row, column, along, along, |direction, solid_angle| {
                    expected.push((place(picture.taps(direction)), solid_angle));
                });
                assert_eq!(found.len(), expected.len());
                for ((found, given), (expected, solid_angle)) in found.iter().zip(&expected) {
                    let limit = 2.0 / (edge * edge) as f64 + 0.02 / edge as f64;
                    for (found, expected) in found.iter().zip(expected) {
                        assert!((found - expected).abs() < limit, "{row} {column}: {found} {expected}");
                    }
                    assert!((given / solid_angle - 1.0).abs() < 2.0 * limit, "{given} {solid_angle}");
                    whole += given;
                }
            }
        }
        assert!((whole / (4.0 * PI) - 1.0).abs() < 1.0 / (edge * edge) as f64, "{edge}: {whole}");
    }
}

/// The means that several faces share are those of each texel's own points, also if a quarter turn is not
/// a whole number of columns.
#[test]
fn shared_points_are_those_of_each_texel() {
    for (edge, rows) in [(64, 100), (33, 65), (5, 9), (4, 2)] {
        let picture = LatLong::with_rows(rows);
        let noise = |texel: usize| ((texel * 2_654_435_761) % 65_536) as f32 / 65_536.0;
        let pixels: Vec<_> = (0..picture.len()).map(|i| [noise(i), 1.0, noise(7 * i)]).collect();
        let points = LatLongOnCube::new(picture, Cube { edge });
        let mut found = vec![[0.0; 3]; 6 * edge * edge];
        points.means(&Pixels::new(picture.width, pixels.clone()), &mut found, Stop::NEVER).unwrap();
        for (texel, found) in found.iter().enumerate() {
            let expected = by_taps(&points, |texel| pixels[texel], texel / edge, texel % edge);
            assert_eq!(found[1], 1.0);
            for channel in [0, 2] {
                let error = (found[channel] - expected[channel]).abs();
                assert!(error < 3e-6, "{edge} {rows} {texel}: {found:?} {expected:?}");
            }
        }
    }
}

/// A picture that is read in bands has the same means, to the last bit.
#[test]
fn bands_change_nothing() {
    for (edge, height) in [(64, 100), (33, 65), (5, 9), (4, 2), (16, 200)] {
        let picture = LatLong::with_rows(height);
        let noise = |texel: usize| ((texel * 2_654_435_761) % 65_536) as f32 / 65_536.0;
        let pixels: Vec<_> = (0..picture.len()).map(|i| [noise(i), noise(3 * i), noise(7 * i)]).collect();
        let pixels = Pixels::new(picture.width, pixels);
        let coded = Pixels::of_blocks(picture.width, height, pixels.blocks());
        let points = LatLongOnCube::new(picture, Cube { edge });
        let mut whole = vec![[0.0; 3]; 6 * edge * edge];
        points.means(&pixels, &mut whole, Stop::NEVER).unwrap();
        for rows in [1, 7, 32, height - 1] {
            let mut found = vec![[-1.0; 3]; 6 * edge * edge];
            points.means_by_bands(rows, &coded, &mut found, Stop::NEVER).unwrap();
            assert!(found == whole, "{edge} {height} {rows}");
        }
    }
}
