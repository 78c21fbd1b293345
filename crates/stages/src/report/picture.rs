//! Pictures inside the page: PNG files as `data:` URIs.

use containers::write_png;
use engine::Failure;

/// The `src` of an image of 8-bit sRGB pixels, rows from the top.
pub(crate) fn data_uri(width: usize, height: usize, pixels: &[[u8; 3]]) -> Result<String, Failure> {
    let png = write_png(width, height, pixels, None)?;
    Ok(format!("data:image/png;base64,{}", base64(&png)))
}

/// The difference of two pictures as shown, times `amplify`, cut at white.
pub(crate) fn difference(a: &[[u8; 3]], b: &[[u8; 3]], amplify: f64) -> Vec<[u8; 3]> {
    let channel = |a: u8, b: u8| (f64::from(a.abs_diff(b)) * amplify).min(255.0).round() as u8;
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|i| channel(a[i], b[i]))).collect()
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().fold(0, |bits, byte| bits << 8 | u32::from(*byte)) << (8 * (3 - chunk.len()));
        for digit in 0..4 {
            let value = (bits >> (18 - 6 * digit)) as usize & 63;
            text.push(if digit <= chunk.len() { char::from(DIGITS[value]) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The test vectors of RFC 4648, section 10.
    #[test]
    fn base_64_is_that_of_the_standard() {
        let cases = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, encoded) in cases {
            assert_eq!(base64(plain.as_bytes()), encoded);
        }
    }

    #[test]
    fn differences_are_between_pictures_as_shown() {
        let found = difference(&[[10, 200, 0]], &[[20, 100, 0]], 8.0);
        assert_eq!(found, [[80, 255, 0]]);
    }
}
