//! A picture from one format to another, bytes to bytes.

use containers::{Precision, ReadOptions, read_image, write_exr, write_rgbe};
use envmap::Image;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Bytes of Radiance RGBE, as if they were read from a file.
    let picture = Image::new(2, 1, vec![[0.5, 0.25, 0.125], [64.0, 32.0, 16.0]]).expect("two pixels");
    let bytes = write_rgbe(&picture, None)?.bytes;

    // The format is known by the content.
    let decoded = read_image(&bytes, &ReadOptions::default())?;
    decoded.warnings.iter().for_each(|warning| println!("warning: {warning}"));

    let encoded = write_exr(&decoded.image, Precision::Half, None)?;
    println!("{} bytes of {:?} became {} of OpenEXR", bytes.len(), decoded.format, encoded.bytes.len());
    assert_eq!(read_image(&encoded.bytes, &ReadOptions::default())?.image.pixels(), picture.pixels());
    Ok(())
}
