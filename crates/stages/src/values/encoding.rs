//! How texels become the bytes of files: the container, the numbers in it, and what is reported if those
//! cannot hold the texels.

use containers::{
    Encoded, Error, Precision, Texture, write_dds, write_exr, write_exr_layers, write_ktx2, write_ktx2_rgba,
    write_ktx2_zstd, write_png, write_rgbe,
};
use engine::{Choice, Context, Failure, Reporter, choice, parameters};
use envmap::{Image, ToneMap, to_srgb8};
use sh::Stop;

use super::overflow::{Content, Excess, LARGEST_HALF, note_floats};

choice! {
    /// The numbers of a file.
    pub enum PrecisionName {
        /// 16 bits, or 32 if a value exceeds the largest half.
        Auto = "auto",
        /// 16 bits.
        Half = "half",
        /// 32 bits.
        Float = "float",
    }
}

choice! {
    /// What happens to values past the largest number of a file.
    pub enum Overflow {
        /// Each becomes the largest number, unless the file can have 32-bit floats and no precision is named.
        Clamp = "clamp",
        /// The item fails.
        Error = "error",
    }
}

parameters! {
    /// The parameters `precision` and `overflow` of exports.
    #[derive(Copy)]
    pub struct Numbers {
        /// Whether OpenEXR, KTX2 and DDS files hold 16-bit or 32-bit numbers. A half holds 3 digits, up to
        /// 65504. With "auto" all files of an item hold halves or, if a value exceeds that, 32-bit floats,
        ///        with a note.
        precision: PrecisionName = PrecisionName::Auto,
        /// What happens to values beyond +-65504 in files of halves: with precision "half" they become
        /// +-65504, with a warning that reports the lost share of each channel; with "error" here the item
        /// fails, also if precision is "auto".
        overflow: Overflow = Overflow::Clamp,
    }
}

/// A container of texels or coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// OpenEXR.
    Exr,
    /// Radiance.
    Rgbe,
    /// PNG, tone-mapped.
    Png,
    /// A KTX2 texture.
    Ktx2,
    /// A DDS texture.
    Dds,
    /// Safetensors.
    Safetensors,
}

impl Container {
    /// The ending of a file's name, with its dot.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Exr => ".exr",
            Self::Rgbe => ".hdr",
            Self::Png => ".png",
            Self::Ktx2 => ".ktx2",
            Self::Dds => ".dds",
            Self::Safetensors => ".safetensors",
        }
    }

    /// Whether one file holds all faces and maps, for a graphics device.
    pub fn is_texture(self) -> bool {
        matches!(self, Self::Ktx2 | Self::Dds)
    }

    /// Whether a file may hold floats of 16 or 32 bits, so that a precision can be chosen.
    fn has_precision(self) -> bool {
        matches!(self, Self::Exr | Self::Ktx2 | Self::Dds)
    }
}

/// The parameter `format` of a kind: the words of the containers that it writes.
pub trait FileFormat: Choice {
    /// The container that a word stands for.
    fn container(self) -> Container;
}

/// How a kind stores texels: its parameter `format` and the numbers of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoding<F> {
    format: F,
    numbers: Numbers,
    /// Stops by which the radiance of a tone-mapped picture is multiplied.
    exposure: f64,
}

impl<F: FileFormat> Encoding<F> {
    /// The encoding of a kind with these parameters.
    pub fn new(format: F, numbers: Numbers) -> Self {
        Self { format, numbers, exposure: 0.0 }
    }

    /// Multiplies the radiance of a tone-mapped picture by so many stops.
    pub fn with_exposure(self, exposure: f64) -> Self {
        Self { exposure, ..self }
    }

    /// The container of the files.
    pub fn container(self) -> Container {
        self.format.container()
    }

    /// The errors of parameters that files of this format do not use.
    pub fn check(self) -> Vec<(&'static str, String)> {
        let Numbers { precision, overflow } = self.numbers;
        let mut errors = Vec::new();
        if self.exposure != 0.0 && self.container() != Container::Png {
            errors.push(("exposure", "only format = \"png\" uses it".into()));
        }
        let holds_halves = self.container().has_precision() && precision != PrecisionName::Float;
        if overflow != Overflow::Clamp && !holds_halves {
            errors.push(("overflow", "only files of half floats use it".into()));
        }
        if precision != PrecisionName::Auto && !self.container().has_precision() {
            let formats = F::words().into_iter().map(|(.., format)| format);
            let formats = formats.filter(|other| other.container().has_precision()).collect::<Vec<_>>();
            errors.push(("precision", format!("only format = {} uses it", F::expected_among(&formats))));
        }
        errors
    }

    /// A writer of the files of an item, which hold these texels. If halves do not hold them, it is noted
    /// that the files are of 32-bit floats, or a warning says what is lost.
    ///
    /// # Errors
    /// If a value does not fit a half and `overflow` says that the item fails.
    pub fn writer<'c>(
        self,
        texels: &[[f32; 3]],
        content: Content,
        context: &'c Context<'_>,
    ) -> Result<Writer<'c>, Failure> {
        let precision = self.precision(texels, content, &context.reporter)?;
        let (container, exposure) = (self.container(), self.exposure);
        Ok(Writer { container, precision, exposure, recipe: context.recipe() })
    }

    /// The precision of all files of an item. A container that has none gets values as they are.
    fn precision(
        self,
        texels: &[[f32; 3]],
        content: Content,
        reporter: &Reporter,
    ) -> Result<Precision, Failure> {
        let Numbers { precision, overflow } = self.numbers;
        if precision == PrecisionName::Float || !self.container().has_precision() {
            return Ok(Precision::Float);
        }
        let excess = Excess::of(texels, content, LARGEST_HALF);
        if excess.count == 0 {
            return Ok(Precision::Half);
        }
        if overflow == Overflow::Error {
            return Err(Failure::new(format!("{} values exceed 65504, the largest half", excess.count))
                .help("precision = \"float\" keeps them"));
        }
        if precision == PrecisionName::Auto {
            note_floats(&excess, reporter);
            return Ok(Precision::Float);
        }
        let text = excess.text(content);
        reporter.warn(format!(
            "{text}; half floats end at 65504, and 32-bit floats keep it: leave out `precision`, or choose \"float\""
        ));
        Ok(Precision::Half)
    }
}

/// Writes the files of one item, all of the same container and precision.
pub struct Writer<'c> {
    container: Container,
    precision: Precision,
    exposure: f64,
    recipe: &'c str,
}

impl Writer<'_> {
    /// The file of a picture.
    pub fn picture(&self, image: &Image) -> Result<Encoded, Failure> {
        let (width, height, recipe) = (image.width(), image.height(), Some(self.recipe));
        match self.container {
            Container::Exr => Ok(write_exr(image, self.precision, recipe)?),
            Container::Rgbe => Ok(write_rgbe(image, recipe)?),
            Container::Png => {
                let codes = to_srgb8(image.pixels(), self.exposure, ToneMap::Filmic);
                let bytes = write_png(width, height, &codes, recipe)?;
                Ok(Encoded { bytes, ..Encoded::default() })
            }
            Container::Ktx2 | Container::Dds => {
                let pixels = image.pixels().to_vec();
                self.texture(&Texture { width, height, pixels, ..Texture::default() }, &[])
            }
            Container::Safetensors => Err(Failure::new("safetensors cannot hold pictures")),
        }
    }

    /// The file of a texture, with entries where the container has some: the texture itself, or a picture in
    /// which all its faces and maps lie below each other.
    pub fn texture(&self, texture: &Texture, entries: &[(&str, &str)]) -> Result<Encoded, Failure> {
        match self.container {
            Container::Ktx2 => Ok(write_ktx2(texture, self.precision, Some(self.recipe), entries)?),
            Container::Dds => Ok(write_dds(texture, self.precision)?),
            Container::Exr | Container::Rgbe | Container::Png | Container::Safetensors => {
                let rows = texture.pixels.len() / texture.width.max(1);
                self.picture(&image(texture.width, rows, texture.pixels.clone())?)
            }
        }
    }

    /// The KTX2 file of a texture whose levels are compressed by Zstandard.
    pub(crate) fn texture_zstd(
        &self,
        texture: &Texture,
        entries: &[(&str, &str)],
    ) -> Result<Encoded, Failure> {
        Ok(write_ktx2_zstd(texture, self.precision, Some(self.recipe), entries)?)
    }

    /// The files of a texture of maps: the texture itself, or a picture for each map.
    pub fn maps(&self, texture: &Texture, entries: &[(&str, &str)]) -> Result<Vec<Encoded>, Failure> {
        if self.container.is_texture() {
            return Ok(vec![self.texture(texture, entries)?]);
        }
        let (width, height) = (texture.width, texture.faces * texture.height);
        let maps = texture.pixels.chunks_exact(width * height);
        maps.map(|pixels| self.picture(&image(width, height, pixels.to_vec())?)).collect()
    }

    /// An OpenEXR picture with named layers, and with entries.
    pub fn exr_layers(
        &self,
        [width, height]: [usize; 2],
        layers: &[(String, Vec<[f32; 3]>)],
        entries: &[(&str, &str)],
        stop: Stop<'_>,
    ) -> Result<Encoded, Error> {
        write_exr_layers(width, height, layers, self.precision, Some(self.recipe), entries, stop)
    }

    /// A KTX2 texture of these sizes with four channels, and with entries.
    pub fn ktx2_rgba(
        &self,
        sizes: &Texture,
        rgba: &[[f32; 4]],
        entries: &[(&str, &str)],
    ) -> Result<Encoded, Error> {
        write_ktx2_rgba(sizes, rgba, self.precision, Some(self.recipe), entries)
    }
}

/// A picture of these pixels.
pub(crate) fn image(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Image, Failure> {
    let found = pixels.len();
    Image::new(width, height, pixels)
        .ok_or_else(|| Failure::new(format!("{found} pixels do not fill {width} x {height}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::NoFiles;

    choice! {
        /// A format for each container.
        enum AnyFormat {
            /// OpenEXR.
            Exr = "exr",
            /// Radiance.
            Rgbe = "rgbe",
            /// PNG.
            Png = "png",
            /// KTX2.
            Ktx2 = "ktx2",
            /// DDS.
            Dds = "dds",
            /// Safetensors.
            Safetensors = "safetensors",
        }
    }

    impl FileFormat for AnyFormat {
        fn container(self) -> Container {
            match self {
                Self::Exr => Container::Exr,
                Self::Rgbe => Container::Rgbe,
                Self::Png => Container::Png,
                Self::Ktx2 => Container::Ktx2,
                Self::Dds => Container::Dds,
                Self::Safetensors => Container::Safetensors,
            }
        }
    }

    fn encoding(format: AnyFormat, precision: PrecisionName, overflow: Overflow) -> Encoding<AnyFormat> {
        Encoding::new(format, Numbers { precision, overflow })
    }

    #[test]
    fn a_parameter_that_the_container_does_not_use_is_an_error() {
        let errors = |format, precision, overflow| {
            let errors = encoding(format, precision, overflow).check().into_iter();
            errors.map(|(key, text)| format!("{key}: {text}")).collect::<Vec<_>>()
        };
        let (only_halves, only_floats) = (
            "overflow: only files of half floats use it",
            "precision: only format = \"exr\" or \"ktx2\" or \"dds\" uses it",
        );
        for format in [AnyFormat::Exr, AnyFormat::Ktx2, AnyFormat::Dds] {
            assert!(errors(format, PrecisionName::Half, Overflow::Error).is_empty());
            assert_eq!(errors(format, PrecisionName::Float, Overflow::Error), [only_halves]);
        }
        for format in [AnyFormat::Rgbe, AnyFormat::Png, AnyFormat::Safetensors] {
            assert!(errors(format, PrecisionName::Auto, Overflow::Clamp).is_empty());
            assert_eq!(errors(format, PrecisionName::Half, Overflow::Error), [only_halves, only_floats]);
        }
        let exposed = |format| encoding(format, PrecisionName::Auto, Overflow::Clamp).with_exposure(1.0);
        assert!(exposed(AnyFormat::Png).check().is_empty());
        assert_eq!(exposed(AnyFormat::Exr).check()[0].0, "exposure");
    }

    #[test]
    fn a_value_past_the_largest_half_is_kept_clamped_or_refused() {
        let bright = [[7e4, 1.0, 1.0], [1.0; 3]];
        let of = |texels: &[[f32; 3]], format, precision, overflow| {
            let reporter = Reporter::default();
            let found = encoding(format, precision, overflow).precision(texels, Content::Values, &reporter);
            (found.map_err(|failure| failure.to_string()), reporter.notes().len(), reporter.warnings().len())
        };
        let exr = |precision, overflow| of(&bright, AnyFormat::Exr, precision, overflow);
        assert_eq!(exr(PrecisionName::Auto, Overflow::Clamp), (Ok(Precision::Float), 1, 0));
        assert_eq!(exr(PrecisionName::Half, Overflow::Clamp), (Ok(Precision::Half), 0, 1));
        assert_eq!(exr(PrecisionName::Float, Overflow::Clamp), (Ok(Precision::Float), 0, 0));
        for precision in [PrecisionName::Auto, PrecisionName::Half] {
            let refused = Err("1 values exceed 65504, the largest half".to_owned());
            assert_eq!(exr(precision, Overflow::Error), (refused, 0, 0));
            let dark = of(&bright[1..], AnyFormat::Exr, precision, Overflow::Error);
            assert_eq!(dark, (Ok(Precision::Half), 0, 0));
        }
        let rgbe = of(&bright, AnyFormat::Rgbe, PrecisionName::Auto, Overflow::Clamp);
        assert_eq!(rgbe, (Ok(Precision::Float), 0, 0));
    }

    #[test]
    fn maps_are_one_texture_or_a_picture_each() {
        let texture = Texture { width: 2, layers: 3, pixels: vec![[0.5; 3]; 6], ..Texture::default() };
        let context = Context::new(&NoFiles).with_recipe("{}".into());
        for (.., format) in AnyFormat::words() {
            let encoding = encoding(format, PrecisionName::Auto, Overflow::Clamp);
            let writer = encoding.writer(&texture.pixels, Content::Values, &context).unwrap();
            let count = writer.maps(&texture, &[]).map(|files| files.len()).ok();
            let expected = match format {
                AnyFormat::Ktx2 | AnyFormat::Dds => Some(1),
                AnyFormat::Exr | AnyFormat::Rgbe | AnyFormat::Png => Some(3),
                AnyFormat::Safetensors => None,
            };
            assert_eq!(count, expected, "{format:?}");
            assert_eq!(writer.texture(&texture, &[]).is_ok(), expected.is_some(), "{format:?}");
        }
    }
}
