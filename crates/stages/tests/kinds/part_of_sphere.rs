//! Pictures of a part of the sphere, as their files say: crops of panoramas, domes and fisheyes.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::io::Cursor;

use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};
use sphere::{DVec3, LatLong};
use stages::artifacts::Environment;

use crate::fixture::{Case, case, difference, environment, sky};

/// An OpenEXR file of floats with GPano in its attributes: whole numbers, or texts.
fn exr(size: [usize; 2], pixels: &[[f32; 3]], gpano: &[(&str, &str)]) -> Vec<u8> {
    let mut attributes = LayerAttributes::default();
    for (name, value) in gpano {
        let value = match value.parse::<i32>() {
            Ok(number) => AttributeValue::I32(number),
            Err(_) => AttributeValue::Text(Text::from(*value)),
        };
        attributes.other.insert(Text::from(format!("GPano:{name}").as_str()), value);
    }
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [red, green, blue] = pixels[at.y() * size[0] + at.x()];
        (red, green, blue)
    });
    let layer = Layer::new((size[0], size[1]), attributes, Encoding::UNCOMPRESSED, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn import(parameters: &str, bytes: Vec<u8>) -> Case {
    case("import-environment", parameters).file("a.exr", bytes).source("a.exr")
}

/// The properties of a crop: the full panorama's size, the crop's, and its corner.
fn crop([full, size, corner]: [[i32; 2]; 3]) -> Vec<(&'static str, String)> {
    let names = [
        ("FullPanoWidthPixels", full[0]),
        ("FullPanoHeightPixels", full[1]),
        ("CroppedAreaImageWidthPixels", size[0]),
        ("CroppedAreaImageHeightPixels", size[1]),
        ("CroppedAreaLeftPixels", corner[0]),
        ("CroppedAreaTopPixels", corner[1]),
    ];
    let texts = names.into_iter().map(|(name, number)| (name, number.to_string()));
    texts.chain([("ProjectionType", "equirectangular".to_owned())]).collect()
}

/// A picture of `size` pixels out of the sky of `full` columns, whose corner is at `corner`, in pixels.
fn painted(size: [usize; 2], full: f64, corner: [f64; 2]) -> Vec<[f32; 3]> {
    (0..size[0] * size[1])
        .map(|index| {
            let (x, y) = ((index % size[0]) as f64 + 0.5, (index / size[0]) as f64 + 0.5);
            // To the right of the middle is -Y.
            let azimuth = -TAU * ((corner[0] + x) / full - 0.5);
            let elevation = FRAC_PI_2 - PI * (corner[1] + y) / (full / 2.0);
            let level = elevation.cos();
            let w = DVec3::new(level * azimuth.cos(), level * azimuth.sin(), elevation.sin());
            sky(w).map(|value| value as f32)
        })
        .collect()
}

fn cropped(parameters: &str, numbers: [[i32; 2]; 3]) -> Case {
    let [full, size, corner] = numbers;
    let size = size.map(|length| length as usize);
    let pixels = painted(size, f64::from(full[0]), corner.map(f64::from));
    import(parameters, with_gpano(size, &pixels, numbers))
}

fn with_gpano(size: [usize; 2], pixels: &[[f32; 3]], numbers: [[i32; 2]; 3]) -> Vec<u8> {
    let properties = crop(numbers);
    let properties: Vec<_> = properties.iter().map(|(name, value)| (*name, value.as_str())).collect();
    exr(size, pixels, &properties)
}

/// The pixels of a crop are those of the sky where they belong, and all others are black.
#[test]
fn a_crop_keeps_its_pixels_at_its_place() {
    let truth = environment(16, sky);
    for (size, corner, missing) in [
        // The middle quarter: 1/2 of a turn, sin 45 degrees of the heights.
        ([16, 8], [8, 4], 1.0 - 0.5 * 0.5_f64.sqrt()),
        // The upper half, 360 x 90 degrees.
        ([32, 8], [0, 0], 0.5),
        // 180 x 180 degrees, a square.
        ([16, 16], [8, 0], 0.5),
        // Across the seam.
        ([16, 8], [24, 4], 1.0 - 0.5 * 0.5_f64.sqrt()),
        ([4, 4], [-2, 12], 1.0 - 0.125 * (1.0 - (PI / 4.0).cos()) / 2.0),
    ] {
        let ran = cropped("", [[32, 16], size, corner]).run().unwrap();
        let placed = ran.artifact::<Environment>();
        assert_eq!(placed.0.grid(), LatLong::with_rows(16));
        let mut seen = 0.0;
        for (index, (found, whole)) in placed.0.pixels().iter().zip(truth.0.pixels()).enumerate() {
            let (column, row) = ((index % 32) as i32, (index / 32) as i32);
            let inside =
                (column - corner[0]).rem_euclid(32) < size[0] && (0..size[1]).contains(&(row - corner[1]));
            let expected = if inside { *whole } else { [0.0; 3] };
            assert!(difference(&[*found], &[expected]) < 1e-6, "{size:?} {corner:?} {column} {row}");
            let from = PI * f64::from(row) / 16.0;
            seen += if inside { (from.cos() - (from + PI / 16.0).cos()) / 64.0 } else { 0.0 };
        }
        assert!((1.0 - seen - missing).abs() < 1e-12, "{seen} {missing}");
        let percent = format!("The rest, {:.0} % of the sphere, is black", 100.0 * missing);
        assert!(
            ran.warnings.len() == 1 && ran.warnings[0].contains(&percent),
            "{:?} {percent}",
            ran.warnings
        );
    }
}

#[test]
fn the_warning_says_what_is_missing_and_what_helps() {
    let ran = cropped("", [[64, 32], [32, 16], [16, 8]]).run().unwrap();
    assert_eq!(
        ran.warnings,
        [
            "a.exr: XMP GPano says that the picture shows 180 x 90 degrees of a lat-long panorama, from -45 to \
          45 degrees of elevation. The rest, 65 % of the sphere, is black; fill = \"edge\" or \"mean\" or a \
          colour adds light there"
        ]
    );
    // The whole says nothing.
    let ran = cropped("", [[64, 32], [64, 32], [0, 0]]).run().unwrap();
    assert!(ran.warnings.is_empty() && ran.notes.is_empty(), "{:?} {:?}", ran.warnings, ran.notes);
    assert!(difference(ran.artifact::<Environment>().0.pixels(), environment(32, sky).0.pixels()) < 1e-6);
    // The manifest counts before the file.
    let ran = cropped("layout = \"lat-long\"", [[64, 32], [32, 16], [16, 8]]).run().unwrap();
    assert_eq!(ran.artifact::<Environment>().0.grid(), LatLong::with_rows(16));
    assert!(
        ran.warnings[0].contains("the manifest says layout = \"lat-long\", which overrides it"),
        "{:?}",
        ran.warnings
    );
}

/// A picture that was made larger or smaller later has pixels of its own, and the crop its angles.
#[test]
fn a_resized_crop_is_as_large_as_before() {
    for (size, full) in [([32, 16], 64), ([8, 4], 16)] {
        let scale = f64::from(full) / 32.0;
        let pixels = painted(size, f64::from(full), [8.0 * scale, 4.0 * scale]);
        let file = with_gpano(size, &pixels, [[32, 16], [16, 8], [8, 4]]);
        let placed = import("", file).artifact::<Environment>();
        assert_eq!(placed.0.grid(), LatLong::with_rows(full as usize / 2));
        for (index, found) in placed.0.pixels().iter().enumerate() {
            let (x, y) = (index % full as usize, index / full as usize);
            let expected = match (x.checked_sub(full as usize / 4), y.checked_sub(full as usize / 8)) {
                (Some(x), Some(y)) if x < size[0] && y < size[1] => pixels[y * size[0] + x],
                _ => [0.0; 3],
            };
            assert_eq!(*found, expected, "{x} {y}");
        }
    }
    // 10 of 16 columns: the full panorama has 20.0 x 10 pixels of this picture, but the corner lies between
    // two of them. Constant light keeps its flux: 1/2 of a turn, from 45 degrees above to 45 below.
    let file = with_gpano([10, 5], &[[1.0; 3]; 50], [[32, 16], [16, 8], [7, 4]]);
    let placed = import("", file).artifact::<Environment>();
    assert_eq!(placed.0.grid(), LatLong::with_rows(10));
    let expected = 4.0 * PI * 0.5 * 0.5_f64.sqrt();
    // Texels at the border are counted on 12 x 12 points.
    assert!((placed.0.integral()[0] / expected - 1.0).abs() < 0.01, "{} {expected}", placed.0.integral()[0]);
}

#[test]
fn fill_is_the_light_of_the_rest() {
    let numbers = [[32, 16], [16, 8], [8, 4]];
    let at = |environment: &Environment, row: usize, column: usize| environment.0.pixels()[row * 32 + column];
    let colour = cropped("fill = [0.25, 0.5, 1.0]", numbers).run().unwrap();
    assert_eq!(at(&colour.artifact(), 0, 0), [0.25, 0.5, 1.0]);
    assert!(colour.warnings[0].contains("65 % of the sphere, was filled with one colour"));
    assert_eq!(at(&cropped("fill = 2", numbers).artifact(), 15, 31), [2.0; 3]);
    assert_eq!(cropped("fill = \"grey\"", numbers).errors().len(), 1);
    assert_eq!(cropped("fill = -1", numbers).errors().len(), 1);

    // The nearest pixel: above it, and beside it on the shorter way around.
    let edge = cropped("fill = \"edge\"", numbers).artifact::<Environment>();
    assert_eq!(at(&edge, 0, 20), at(&edge, 4, 20));
    assert_eq!(at(&edge, 15, 9), at(&edge, 11, 9));
    assert_eq!(at(&edge, 6, 31), at(&edge, 6, 23));
    assert_eq!(at(&edge, 6, 0), at(&edge, 6, 8));

    // Red is 1 + z/2 + 0.3 x. Over the part, z cancels, and x is the mean of cos(elevation) cos(azimuth):
    // (2 over pi radians) x (integral of cos^2 from -45 to 45 degrees) / (integral of cos).
    let mean = at(&cropped("fill = \"mean\"", numbers).artifact(), 0, 0);
    let expected = 1.0 + 0.3 * (2.0 / PI) * (PI / 4.0 + 0.5) / 2.0_f64.sqrt();
    // Midpoints of 11 degrees: pi^2 / (24 x 16) for each factor.
    assert!((f64::from(mean[0]) - expected).abs() < 0.005, "{mean:?} {expected}");
    assert!((f64::from(mean[1]) - 1.0).abs() < 1e-6, "{mean:?}");
}

#[test]
fn exposure_resolution_and_bad_pixels_work_as_on_the_whole() {
    let numbers = [[32, 16], [16, 8], [8, 4]];
    let small = cropped("resolution = 8\nexposure = 1", numbers).artifact::<Environment>();
    let large = cropped("", numbers).artifact::<Environment>();
    assert_eq!(small.0.grid(), LatLong::with_rows(8));
    assert!((small.0.integral()[0] / large.0.integral()[0] / 2.0 - 1.0).abs() < 1e-6);

    let mut pixels = painted([16, 8], 32.0, [8.0, 4.0]);
    pixels[3 * 16 + 2][1] = f32::NAN;
    let file = with_gpano([16, 8], &pixels, numbers);
    let failure = import("", file.clone()).failure();
    // Row 7 of 16, and 3 of 16 columns to the left of -90 degrees.
    assert!(
        failure.contains("1 NaN, the first at row 3, column 2, green (theta 84.4, phi 61.9 degrees)"),
        "{failure}"
    );
    let zeroed = import("bad-pixels = \"zero\"", file).artifact::<Environment>();
    assert_eq!(zeroed.0.pixels()[7 * 32 + 10][1], 0.0);
}

/// The camera's forward direction was raised by the pitch, and its right side lowered by the roll: what the
/// picture shows at its centre comes from above the horizon.
#[test]
fn a_tilted_camera_is_levelled() {
    let lamp = |row: usize, column: usize| {
        let mut pixels = vec![[0.0; 3]; 64 * 32];
        pixels[row * 64 + column] = [100.0; 3];
        pixels
    };
    let direction = |pixels: &[[f32; 3]], pose: &[(&str, &str)]| {
        let file = exr([64, 32], pixels, &[&[("ProjectionType", "equirectangular")], pose].concat());
        let ran = import("", file).run().unwrap();
        let turned = ran.artifact::<Environment>();
        let grid = turned.0.grid();
        let weighed = turned.0.pixels().iter().enumerate().map(|(index, pixel)| {
            let (row, column) = (index / grid.width, index % grid.width);
            f64::from(pixel[0]) * grid.solid_angle(row) * grid.direction(row, column).vector()
        });
        (weighed.sum::<DVec3>().normalize(), ran.warnings, ran.notes)
    };
    // A pixel is 5.6 degrees; the centre is the corner of four.
    let front = lamp(16, 32);
    let (raised, warnings, _) = direction(&front, &[("PosePitchDegrees", "30.0")]);
    assert!((raised - DVec3::new(30_f64.to_radians().cos(), 0.0, 0.5)).length() < 0.08, "{raised}");
    assert!(warnings[0].contains("pitch 30, roll 0 degrees"), "{warnings:?}");
    // At the right, -Y, which was lowered.
    let (lowered, ..) = direction(&lamp(16, 48), &[("PoseRollDegrees", "30.0")]);
    assert!((lowered - DVec3::new(0.0, -30_f64.to_radians().cos(), -0.5)).length() < 0.08, "{lowered}");
    // The compass turns nothing.
    let (same, warnings, notes) = direction(&front, &[("PoseHeadingDegrees", "350")]);
    assert!((same - DVec3::X).length() < 0.08 && warnings.is_empty(), "{same} {warnings:?}");
    assert!(notes[0].contains("350 degrees of the compass"), "{notes:?}");
}

/// What a fisheye of the sky shows, by the formula of its lens: `angle` of a radius from 0 to 1, `looks` the
/// direction of (right, up, forward).
fn fisheye(edge: usize, angle: impl Fn(f64) -> f64, looks: impl Fn([f64; 3]) -> DVec3) -> Vec<[f32; 3]> {
    (0..edge * edge)
        .map(|index| {
            let at = |k: usize| (2 * k + 1) as f64 / edge as f64 - 1.0;
            let (right, up) = (at(index % edge), -at(index / edge));
            let radius = right.hypot(up);
            if radius > 1.0 {
                // Nothing may come of the corners.
                return [1e6; 3];
            }
            let (sine, cosine) = angle(radius).sin_cos();
            sky(looks([sine * right / radius, sine * up / radius, cosine])).map(|value| value as f32)
        })
        .collect()
}

/// Compares with the sky, and with black farther from `axis` than `reach`. Not within `rim` degrees of that:
/// texels there mix, and interpolation has pixels on one side only up to the diagonal of one from the rim.
#[track_caller]
fn check_part(found: &Environment, axis: DVec3, [reach, rim]: [f64; 2], tolerance: f64) {
    let grid = found.0.grid();
    let mut compared = 0;
    for (index, pixel) in found.0.pixels().iter().enumerate() {
        let w = grid.direction(index / grid.width, index % grid.width).vector();
        let angle = w.dot(axis).clamp(-1.0, 1.0).acos();
        if (angle - reach).abs() < rim.to_radians() {
            continue;
        }
        let expected = if angle < reach { sky(w) } else { [0.0; 3] };
        assert!(difference(&[*pixel], &[expected]) < tolerance, "{w}: {pixel:?} {expected:?}");
        compared += usize::from(angle < reach);
    }
    assert!(compared > 100);
}

fn forward([right, up, forward]: [f64; 3]) -> DVec3 {
    DVec3::new(forward, -right, up)
}

/// Bilinear interpolation and the mean over a texel blur by (h^2 / 12 + g^2 / 24) times the Laplacian, 1.8 at
/// most; pixels and texels have pi / 64 on the axis, and 5 times as much across the rim of the orthographic
/// one: 0.0005 and 0.01.
#[test]
fn fisheyes_of_each_lens_are_placed() {
    type Angle = fn(f64) -> f64;
    let lenses: [(&str, Angle, f64, f64); 4] = [
        ("fisheye", |r| r * FRAC_PI_2, 8.0, 0.002),
        ("Equisolid", |r| 2.0 * (r * 0.5_f64.sqrt()).asin(), 8.0, 0.002),
        ("stereographic-fisheye", |r| 2.0 * r.atan(), 8.0, 0.002),
        ("ORTHOGRAPHIC", |r| r.asin(), 18.0, 0.01),
    ];
    for (name, angle, rim, tolerance) in lenses {
        let file = exr([64; 2], &fisheye(64, angle, forward), &[("ProjectionType", name)]);
        let ran = import("", file).run().unwrap();
        check_part(&ran.artifact(), DVec3::X, [FRAC_PI_2, rim], tolerance);
        assert!(ran.warnings[0].contains("180 degrees were assumed"), "{:?}", ran.warnings);
        assert!(ran.warnings[1].contains("The rest, 50 % of the sphere, is black"), "{:?}", ran.warnings);
    }
    // Two fisheyes, or a part of one.
    let file = exr([32, 16], &[[1.0; 3]; 512], &[("ProjectionType", "fisheye")]);
    assert!(import("", file).failure().contains("a fisheye of 32 x 16 pixels is not square"));
}

/// A hemisphere of constant light has 2 pi of flux, and a lamp of one pixel the flux of the pixel.
#[test]
fn the_flux_of_a_dome_is_that_of_its_picture() {
    let mut pixels = vec![[1.0; 3]; 64 * 64];
    pixels[20 * 64 + 40] = [1001.0; 3];
    let file = exr([64; 2], &pixels, &[("ProjectionType", "domemaster")]);
    let dome = import("", file).artifact::<Environment>();
    // d_omega = sin(t) / t (pi / 64)^2 at the pixel's centre, t being pi / 64 times its distance in pixels.
    let t = PI / 64.0 * 8.5_f64.hypot(11.5);
    let expected = TAU + 1000.0 * t.sin() / t * (PI / 64.0).powi(2);
    assert!((dome.0.integral()[0] / expected - 1.0).abs() < 1e-3, "{} {expected}", dome.0.integral()[0]);
    let upper: f32 = dome.0.pixels()[..64 * 128 / 2].iter().map(|pixel| pixel[0]).sum();
    let lower: f32 = dome.0.pixels()[64 * 128 / 2..].iter().map(|pixel| pixel[0]).sum();
    // The edges of texels at the horizon touch it.
    assert!(lower < 1e-3 * upper, "{upper} {lower}");
    // The lower side of the picture is the front: what is right of its middle is right of the front.
    let brightest =
        (0..dome.0.pixels().len()).max_by(|a, b| dome.0.pixels()[*a][0].total_cmp(&dome.0.pixels()[*b][0]));
    let w = dome.0.grid().direction(brightest.unwrap() / 128, brightest.unwrap() % 128).vector();
    assert!(w.x < 0.0 && w.y < 0.0 && w.z > 0.0, "{w}");
}

/// A Radiance picture with these lines in its header.
fn radiance(edge: usize, pixels: &[[f32; 3]], lines: &str) -> Case {
    let image = envmap::Image::new(edge, edge, pixels.to_vec()).unwrap();
    let bytes = containers::write_rgbe(&image, None).unwrap().bytes;
    let rest = bytes.strip_prefix(b"#?RADIANCE\n").unwrap();
    let bytes = [b"#?RADIANCE\n", lines.as_bytes(), rest].concat();
    case("import-environment", "").file("a.hdr", bytes).source("a.hdr")
}

/// RGBE rounds by 1/256 of the largest channel: 0.004 of 1.9, beside the blur.
#[test]
fn a_view_of_radiance_is_a_fisheye() {
    // hdrgen writes the camera's view first; the last one counts.
    let lines = "VIEW= -vtv -vh 45 -vv 45\n\tVIEW= -vta -vh 90\nVIEW= -vta -vh 180 -vv 180\n";
    let ran = radiance(64, &fisheye(64, |r| r * FRAC_PI_2, forward), lines).run().unwrap();
    check_part(&ran.artifact(), DVec3::X, [FRAC_PI_2, 8.0], 0.02);
    assert!(
        ran.warnings[0].contains("an equidistant fisheye of 180 degrees toward 0 degrees"),
        "{:?}",
        ran.warnings
    );

    // Toward Radiance's -X, to the left of the front (+Y here), with its +Y to the right and +Z up.
    let left = |[right, up, forward]: [f64; 3]| DVec3::new(right, forward, up);
    let lines = "VIEW= -vth -vp 1 2 3 -vd -2 0 0 -vu 0 0 1 -vh 180 -vv 180\n";
    let ran = radiance(64, &fisheye(64, f64::asin, left), lines).run().unwrap();
    check_part(&ran.artifact(), DVec3::Y, [FRAC_PI_2, 18.0], 0.03);

    // Toward the zenith, north (+Y there) at the top, so that east is at the left.
    let above = |[right, up, forward]: [f64; 3]| DVec3::new(up, right, forward);
    let lines = "VIEW= -vts -vd 0 0 1 -vu 0 1 0 -vh 120 -vv 120\n";
    let angle = |r: f64| 2.0 * (r * 30_f64.to_radians().tan()).atan();
    let ran = radiance(64, &fisheye(64, angle, above), lines).run().unwrap();
    check_part(&ran.artifact(), DVec3::Z, [PI / 3.0, 8.0], 0.02);
    assert!(ran.warnings[0].contains("toward 90 degrees of elevation. The rest, 75 %"), "{:?}", ran.warnings);

    // The whole sphere.
    let ran = radiance(64, &fisheye(64, |r| r * PI, forward), "VIEW= -vta -vh 360 -vv 360\n").run().unwrap();
    check_part(&ran.artifact(), DVec3::X, [PI, 12.0], 0.03);
    assert!(ran.warnings.is_empty(), "{:?}", ran.warnings);

    for (lines, words) in [
        ("VIEW= -vta -vh x\n", "-vh lacks its numbers"),
        ("VIEW= -vth -vh 200 -vv 200\n", "-vh is 200; a field of an orthographic fisheye is up to 180"),
        ("VIEW= -vta -vd 0 0 1 -vh 180 -vv 180\n", "name no camera"),
        ("VIEW= -vtv -vh 90 -vv 90\n", "a lat-long image is twice as wide as high"),
    ] {
        let failure = radiance(8, &[[1.0; 3]; 64], lines).failure();
        assert!(failure.contains(words), "{lines}: {failure}");
    }
}

#[test]
fn what_cannot_be_placed_is_an_error() {
    let check = |size: [usize; 2], properties: &[(&str, &str)], words: &str| {
        let file = exr(size, &vec![[1.0; 3]; size[0] * size[1]], properties);
        let case = import("", file);
        let failure = case.failure();
        assert!(failure.contains(words), "{properties:?}: {failure}");
        // A check of the header finds it, too.
        assert!(case.check().is_some(), "{properties:?}");
    };
    let numbers = |full, size, corner| crop([full, size, corner]);
    let of = |size, properties: &[(&'static str, String)], words: &str| {
        let texts: Vec<_> = properties.iter().map(|(name, value)| (*name, value.as_str())).collect();
        check(size, &texts, words);
    };
    of([32, 16], &numbers([64, 32], [30, 10], [0, 0]), "the picture has another shape, 32 x 16");
    of([32, 16], &numbers([64, 64], [32, 16], [0, 0]), "the full panorama is 64 x 64 pixels");
    of(
        [32, 16],
        &numbers([64, 32], [32, 16], [16, 20]),
        "rows 20 to 36, is not inside the full panorama of 32",
    );
    of([32, 16], &numbers([64, 32], [32, 16], [16, -4]), "rows -4 to 12");
    of(
        [32, 16],
        &numbers([16, 8], [32, 16], [0, 0]),
        "32 x 16 pixels is larger than the full panorama of 16 x 8",
    );
    of([32, 16], &numbers([64, 32], [32, 0], [0, 0]), "GPano:CroppedAreaImageHeightPixels is 0");
    check(
        [32, 16],
        &[("FullPanoWidthPixels", "many")],
        "FullPanoWidthPixels is \"many\", which is not a number",
    );
    check([32, 16], &[("ProjectionType", "cubestrip")], "its projection is \"cubestrip\"");
    check(
        [32, 16],
        &[
            ("CroppedAreaImageWidthPixels", "32"),
            ("CroppedAreaImageHeightPixels", "16"),
            ("CroppedAreaLeftPixels", "4"),
        ],
        "FullPanoWidthPixels and FullPanoHeightPixels are missing",
    );
}

#[test]
fn what_is_missing_is_assumed_with_a_warning() {
    let pixels = painted([32, 8], 32.0, [0.0, 4.0]);
    let numbers = [[32, 16], [32, 8], [0, 4]];
    let expected = import("", with_gpano([32, 8], &pixels, numbers)).artifact::<Environment>();
    let full = crop(numbers);
    for (without, words) in [
        ("FullPanoHeightPixels", "GPano:FullPanoHeightPixels is missing; half of the width was taken"),
        ("FullPanoWidthPixels", "GPano:FullPanoWidthPixels is missing; twice the height was taken"),
        ("CroppedAreaImageWidthPixels", "the picture's own size was taken"),
        ("CroppedAreaTopPixels", "GPano:CroppedAreaTopPixels is missing; the middle was taken"),
    ] {
        let rest: Vec<_> = full
            .iter()
            .filter(|(name, _)| *name != without)
            .map(|(name, value)| (*name, value.as_str()))
            .collect();
        let ran = import("", exr([32, 8], &pixels, &rest)).run().unwrap();
        assert_eq!(*ran.artifact::<Environment>(), *expected, "{without}");
        assert!(ran.warnings[0].contains(words), "{:?}", ran.warnings);
    }
    // Stale numbers beside a picture that is whole again.
    let ran = import("", with_gpano([32, 16], &painted([32, 16], 32.0, [0.0; 2]), numbers)).run().unwrap();
    assert!(difference(ran.artifact::<Environment>().0.pixels(), environment(16, sky).0.pixels()) < 1e-6);
    assert!(
        ran.warnings[0].contains("as large as the full panorama: it was taken for that"),
        "{:?}",
        ran.warnings
    );
}
