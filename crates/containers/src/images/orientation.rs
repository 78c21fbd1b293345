//! Turning a picture upright: the eight orientations of Exif and TIFF (TIFF 6.0, tag 274).

use ::image::metadata::Orientation;

/// The size of a picture once it is upright.
pub(crate) fn upright_size([width, height]: [usize; 2], orientation: Orientation) -> [usize; 2] {
    match orientation {
        Orientation::Rotate90
        | Orientation::Rotate270
        | Orientation::Rotate90FlipH
        | Orientation::Rotate270FlipH => [height, width],
        _ => [width, height],
    }
}

/// The upright picture, row by row, of one that is stored with this size.
pub(crate) fn upright(
    pixels: Vec<[f32; 3]>,
    size @ [width, height]: [usize; 2],
    orientation: Orientation,
) -> Vec<[f32; 3]> {
    if orientation == Orientation::NoTransforms || pixels.len() != width * height {
        return pixels;
    }
    let [columns, rows] = upright_size(size, orientation);
    let stored = |x: usize, y: usize| match orientation {
        Orientation::NoTransforms => [x, y],
        Orientation::FlipHorizontal => [width - 1 - x, y],
        Orientation::Rotate180 => [width - 1 - x, height - 1 - y],
        Orientation::FlipVertical => [x, height - 1 - y],
        Orientation::Rotate90FlipH => [y, x],
        Orientation::Rotate90 => [y, height - 1 - x],
        Orientation::Rotate270FlipH => [width - 1 - y, height - 1 - x],
        Orientation::Rotate270 => [width - 1 - y, x],
    };
    let mut turned = Vec::with_capacity(pixels.len());
    for y in 0..rows {
        turned.extend((0..columns).map(|x| {
            let [x, y] = stored(x, y);
            pixels[y * width + x]
        }));
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where the first row and the first column of the stored picture lie, in the words of TIFF 6.0.
    #[test]
    fn rows_and_columns_lie_where_tiff_says() {
        // 3 x 2: 0 1 2 / 3 4 5.
        let stored: Vec<[f32; 3]> = (0..6).map(|i| [i as f32; 3]).collect();
        for (tag, size, expected) in [
            (1, [3, 2], [0, 1, 2, 3, 4, 5]),
            (2, [3, 2], [2, 1, 0, 5, 4, 3]),
            (3, [3, 2], [5, 4, 3, 2, 1, 0]),
            (4, [3, 2], [3, 4, 5, 0, 1, 2]),
            (5, [2, 3], [0, 3, 1, 4, 2, 5]),
            (6, [2, 3], [3, 0, 4, 1, 5, 2]),
            (7, [2, 3], [5, 2, 4, 1, 3, 0]),
            (8, [2, 3], [2, 5, 1, 4, 0, 3]),
        ] {
            let orientation = Orientation::from_exif(tag).unwrap();
            assert_eq!(upright_size([3, 2], orientation), size, "{tag}");
            let found = upright(stored.clone(), [3, 2], orientation);
            assert_eq!(found, expected.map(|i: u8| [f32::from(i); 3]), "{tag}");
        }
    }
}
