//! Every layout against a function that is known everywhere, and against single bright pixels.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // a test may panic

use std::f64::consts::PI;

use envmap::{BadPixels, Environment, Error, Image, Layout, repair};
use sphere::{AngularProbe, Cube, Direction, LatLong, MirrorBall, OpenExrCube, OpenExrLatLong};

/// A constant and lobes a exp(k (cos t - 1)) of the angle t from a direction.
const CONSTANT: f64 = 0.2;
const LOBES: [([f64; 3], f64, f64); 4] = [
    ([-0.6324, -0.3229, -0.7042], 2.1, 3.0),
    ([0.7963, 0.5802, 0.1714], 11.8, 2.2),
    ([0.0620, -0.0739, -0.9953], 22.2, 1.5),
    ([-0.9656, -0.1848, 0.1828], 13.2, 3.4),
];

fn lobes(w: Direction) -> impl Iterator<Item = (f64, f64, f64)> {
    LOBES.into_iter().map(move |(axis, k, a)| {
        let c = w.dot(Direction::normalised(axis.into()));
        (c, k, a * (k * (c - 1.0)).exp())
    })
}

fn light(w: Direction) -> f64 {
    CONSTANT + lobes(w).map(|(_, _, value)| value).sum::<f64>()
}

/// (1 - c^2) f'' - 2 c f' for f(c) = exp(k (c - 1)).
fn laplacian(w: Direction) -> f64 {
    lobes(w).map(|(c, k, value)| (k * k * (1.0 - c * c) - 2.0 * c * k) * value).sum()
}

/// Bounds of the first and second derivatives along any great circle: a sqrt(k / e) and a k for each lobe.
fn derivatives() -> (f64, f64) {
    LOBES.iter().fold((0.0, 0.0), |(first, second), &(_, k, a)| {
        (first + a * (k / 1.0_f64.exp()).sqrt(), second + a * k)
    })
}

fn integral() -> f64 {
    let lobe = |k: f64, a: f64| a * (1.0 - (-2.0 * k).exp()) / (2.0 * k);
    4.0 * PI * (CONSTANT + LOBES.iter().map(|&(_, k, a)| lobe(k, a)).sum::<f64>())
}

/// A size for each layout, and its largest texels' side in radians.
const SIZES: [(Layout, usize, usize, f64); 10] = [
    (Layout::LatLong, 256, 128, PI / 128.0),
    (Layout::OpenExrLatLong, 257, 129, PI / 128.0),
    (Layout::OpenExrLatLong, 256, 128, PI / 127.0),
    (Layout::Probe, 256, 256, 2.0 * PI / 256.0),
    (Layout::MirrorBall, 256, 256, 4.0 / 256.0),
    (Layout::Cube, 64, 384, 2.0 / 64.0),
    (Layout::CubeStrip, 384, 64, 2.0 / 64.0),
    (Layout::CubeCross, 256, 192, 2.0 / 64.0),
    (Layout::CubeCross, 192, 256, 2.0 / 64.0),
    (Layout::OpenExrCube, 65, 390, 2.0 / 64.0),
];

/// A picture of a function; pixels that the layout does not use are NaN.
fn picture(layout: Layout, width: usize, height: usize, f: impl Fn(Direction) -> f64) -> Image {
    let pixels = (0..width * height)
        .map(|texel| match layout.direction(width, height, texel / width, texel % width) {
            Some(w) => [f(w) as f32, 1.0, (-f(w)) as f32],
            None => [f32::NAN; 3],
        })
        .collect();
    Image::new(width, height, pixels).unwrap()
}

/// The solid angle of a pixel, from `sphere`.
fn solid_angle(layout: Layout, width: usize, height: usize, row: usize, column: usize) -> f64 {
    match layout {
        Layout::LatLong => LatLong { width, height }.solid_angle(row),
        Layout::OpenExrLatLong => OpenExrLatLong { width, height }.solid_angle(row, column),
        Layout::Probe => AngularProbe { edge: width }.solid_angle(row, column),
        Layout::MirrorBall => MirrorBall { edge: width }.solid_angle(row, column),
        Layout::OpenExrCube => OpenExrCube { edge: width }.solid_angle(row, column),
        Layout::Cube | Layout::CubeCross | Layout::CubeStrip => {
            let edge = 64;
            // The turned face of the vertical cross is turned by half a turn, which keeps solid angles.
            Cube { edge }.solid_angle(row % edge, column % edge)
        }
    }
}

#[test]
fn smooth_light_survives_every_layout() {
    let grid = LatLong::with_rows(100);
    let g = PI / 100.0;
    let (first, second) = derivatives();
    for (layout, width, height, h) in SIZES {
        let environment =
            Environment::from_image(picture(layout, width, height, light), layout, Some(grid)).unwrap();
        let (mut worst, mut squares, mut expected_squares): (f64, f64, f64) = (0.0, 0.0, 0.0);
        let mut worst_on_rim: f64 = 0.0;
        for row in 0..grid.height {
            // Bilinear interpolation is off by h^2 / 8 of the second derivative along each side of a texel,
            // and the mean over a new texel by g^2 / 24. A side that is not a great circle adds the first
            // derivative times its bend, no more than 1 here. Near a pole the mean is that of a triangle,
            // whose centre of mass is g^2 / (12 tan theta) from the centre of the texel.
            let shift = g * g / (12.0 * grid.theta(row).tan().abs());
            for column in 0..grid.width {
                let w = grid.direction(row, column);
                let pixel = environment.pixels()[row * grid.width + column];
                assert_eq!(pixel[1], 1.0, "a constant stays constant");
                assert_eq!(pixel[2], -pixel[0], "channels do not mix");
                let error = (f64::from(pixel[0]) - light(w)).abs();
                // On a mirror ball texels grow along the radius to h / c, c = cos(t / 2), and bend by 1 / (2
                // c). In the last two texels, where c < sqrt(8 / edge), a picture varies faster than its
                // texels: there the error is at most the first derivative times twice that cap.
                let c = match layout {
                    Layout::MirrorBall => ((1.0 + w.vector().x) / 2.0).sqrt() - g / 2.0,
                    _ => 1.0,
                };
                let rim = (8.0 / width as f64).sqrt();
                if c < rim {
                    worst_on_rim = worst_on_rim.max(error / (first * 4.0 * (rim + g)));
                    continue;
                }
                let bound = (h * h / (4.0 * c * c) + g * g / 12.0) * (second + first / c) + shift * first;
                worst = worst.max(error / bound);
                squares += error * error * grid.solid_angle(row);
                // On average over the places of a point between its texels, h^2 / 12.
                let step = 1e-4;
                let (theta, phi) = (grid.theta(row), grid.phi(column));
                let slope = (light(Direction::from_angles(theta + step, phi))
                    - light(Direction::from_angles(theta - step, phi)))
                    / (2.0 * step);
                let blur = (h * h / (12.0 * c * c) + g * g / 24.0) * laplacian(w).abs() + shift * slope.abs();
                expected_squares += blur * blur * grid.solid_angle(row);
            }
        }
        let (rms, expected) = ((squares / (4.0 * PI)).sqrt(), (expected_squares / (4.0 * PI)).sqrt());
        let kept = environment.integral()[0] / integral() - 1.0;
        eprintln!(
            "{} {width} x {height}: rms error {rms:.1e} (expected up to {expected:.1e}), worst {worst:.2} of its bound, \
             on the rim {worst_on_rim:.2}; integral off by {kept:.1e}",
            layout.name()
        );
        assert!(worst < 1.0 && worst_on_rim < 1.0 && rms < expected, "{}", layout.name());
        // Sums over a smooth periodic function converge faster than h^2: the first order of the blur, a
        // Laplacian, integrates to 0. The rim of the ball and the edges of cubes remain.
        assert!(kept.abs() < 1e-3, "{}: {kept:e}", layout.name());
    }
}

#[test]
fn a_single_bright_pixel_keeps_its_energy() {
    for (layout, width, height, h) in SIZES {
        // Corners, the middle, a pole, the rim and the seam, and arbitrary pixels.
        let mut texels = vec![0, width - 1, width / 2, width * height - 1, width * height / 2];
        texels.extend([width * (height / 2), width * (height / 2) + width / 2, width * 63 + 63]);
        texels.extend((1..14).map(|k| k * 7919 * 31 % (width * height)));
        let mut tested = 0;
        for texel in texels {
            let (row, column) = (texel / width, texel % width);
            let Some(lamp) = layout.direction(width, height, row, column) else { continue };
            let mut pixels = vec![[0.0; 3]; width * height];
            pixels[texel] = [1e6, 1.0, 0.25];
            let image = Image::new(width, height, pixels).unwrap();
            let grid = LatLong::with_rows(40);
            let environment = Environment::from_image(image, layout, Some(grid)).unwrap();
            let own = solid_angle(layout, width, height, row, column);
            let kept = environment.integral().map(|energy| energy / own);
            // Values are rounded to f32 twice, by 6e-8 each.
            for (kept, radiance) in kept.into_iter().zip([1e6, 1.0, 0.25]) {
                assert!((kept / radiance - 1.0).abs() < 2e-7, "{} {row} {column}: {kept}", layout.name());
            }
            // It also stays at its place: within two texels of each picture, with the ball's 1 / cos(t / 2).
            let stretch = match layout {
                Layout::MirrorBall => (width as f64 / 2.0).sqrt(),
                _ => 1.5,
            };
            for (k, pixel) in environment.pixels().iter().enumerate() {
                let away = grid.direction(k / grid.width, k % grid.width).dot(lamp).clamp(-1.0, 1.0).acos();
                assert!(pixel[0] >= 0.0 && (pixel[0] == 0.0 || away < 2.0 * (h * stretch + PI / 40.0)));
            }
            tested += 1;
        }
        assert!(tested >= 6, "{}", layout.name());
    }
}

/// Heavy-tailed noise: 10^(6 x^4) for x uniform in [0, 1].
fn noise(texel: usize) -> f32 {
    let mut x = (texel as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    let x = ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64;
    10.0_f64.powf(6.0 * x.powi(4)) as f32
}

#[test]
fn noise_of_six_decades_keeps_its_energy() {
    for (layout, width, height, _) in SIZES {
        let mut energy = 0.0;
        let pixels = (0..width * height)
            .map(|texel| {
                let (row, column) = (texel / width, texel % width);
                // Columns and edges that OpenEXR repeats need not agree here.
                if layout.direction(width, height, row, column).is_some() {
                    energy += f64::from(noise(texel)) * solid_angle(layout, width, height, row, column);
                }
                [noise(texel); 3]
            })
            .collect();
        let image = Image::new(width, height, pixels).unwrap();
        let environment = Environment::from_image(image, layout, Some(LatLong::with_rows(100))).unwrap();
        let kept = environment.integral()[0] / energy - 1.0;
        eprintln!("{}: energy of noise off by {kept:.1e}", layout.name());
        // Most of the energy is in lamps and exact. A texel that is not a lamp may be off by 2 percent either
        // way if the points fall badly; over 10^4 texels that averages out. A disk also loses the texels on
        // its rim whose centres lie outside: 0.1 percent.
        assert!(kept.abs() < 3e-3, "{}: {kept:e}", layout.name());
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            SIZES.map(|(layout, width, height, _)| {
                let pixels = (0..width * height).map(|texel| [noise(texel), 1.0, noise(texel + 1)]).collect();
                let image = Image::new(width, height, pixels).unwrap();
                Environment::from_image(image, layout, Some(LatLong::with_rows(50))).unwrap()
            })
        })
    };
    assert!(with_threads(1) == with_threads(3));
}

#[test]
fn a_lat_long_image_is_not_resampled() {
    let image = picture(Layout::LatLong, 64, 32, light);
    let environment = Environment::from_image(image.clone(), Layout::LatLong, None).unwrap();
    assert_eq!(environment.grid(), LatLong::with_rows(32));
    assert_eq!(environment.pixels(), image.pixels());
}

#[test]
fn bad_values_are_refused_and_unused_ones_ignored() {
    let mut image = picture(Layout::CubeCross, 16, 12, light);
    assert!(Environment::from_image(image.clone(), Layout::CubeCross, None).is_ok());
    image.pixels_mut()[5 * 16 + 3][1] = f32::NAN;
    let error = Environment::from_image(image.clone(), Layout::CubeCross, None).unwrap_err();
    assert!(error.to_string().contains("1 NaN, the first at face nx, row 5, column 3, green"), "{error}");
    let (image, _) = repair(image, Layout::CubeCross, BadPixels::Zero).unwrap();
    assert!(Environment::from_image(image, Layout::CubeCross, None).is_ok());

    let image = picture(Layout::Probe, 8, 8, light);
    let empty = Some(LatLong { width: 0, height: 4 });
    let error = Environment::from_image(image.clone(), Layout::Probe, empty).unwrap_err();
    assert!(matches!(error, Error::Resolution { .. }), "{error}");
    let huge = Some(LatLong { width: usize::MAX, height: 2 });
    let error = Environment::from_image(image.clone(), Layout::Probe, huge).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("a resolution of {} x 2 is not between 1 and 268435456 texels", usize::MAX)
    );
    assert!(matches!(Environment::from_image(image, Layout::LatLong, None), Err(Error::Shape { .. })));
}

#[test]
fn the_smallest_pictures_convert() {
    for (layout, width, height) in [
        (Layout::LatLong, 2, 1),
        (Layout::OpenExrLatLong, 3, 2),
        (Layout::Probe, 1, 1),
        (Layout::Probe, 2, 2),
        (Layout::MirrorBall, 1, 1),
        (Layout::MirrorBall, 2, 2),
        (Layout::Cube, 1, 6),
        (Layout::CubeCross, 4, 3),
        (Layout::CubeStrip, 6, 1),
        (Layout::OpenExrCube, 2, 12),
    ] {
        let image = picture(layout, width, height, |_| 1.0);
        for grid in [None, Some(LatLong { width: 1, height: 1 }), Some(LatLong { width: 7, height: 3 })] {
            let environment = Environment::from_image(image.clone(), layout, grid).unwrap();
            assert!(environment.pixels().iter().all(|pixel| *pixel == [1.0, 1.0, -1.0]), "{}", layout.name());
        }
    }
}
