//! Matte surfaces: what they reflect, emit and let through.

use crate::random::hash_words;
use crate::texture::TextureUse;

/// The highest albedo: in a closed room whose walls reflect everything, light never ends.
pub const MOST_ALBEDO: f32 = 0.95;

/// Which of the rays that meet a surface pass it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// No ray passes.
    Opaque,
    /// A ray passes if alpha is below this.
    Mask(f32),
    /// A share of 1 - alpha passes.
    Blend,
}

/// The light of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance for a texture of 1, RGB: factor times strength.
    pub radiance: [f32; 3],
    /// The texture that the radiance is multiplied by.
    pub texture: Option<TextureUse>,
}

/// A matte surface.
///
/// Its albedo is base (1 - metallic), at most [`MOST_ALBEDO`], where base is the factor times the texture
/// times the colour of the corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// The factor of the base colour, and of alpha.
    pub base: [f32; 4],
    /// The texture of the base colour and of alpha.
    pub base_texture: Option<TextureUse>,
    /// The share of the base colour that is not matte and black here, 0 to 1.
    pub metallic: f32,
    /// The texture whose red channel the metallic share is multiplied by.
    pub metallic_texture: Option<TextureUse>,
    /// The light that it emits, if it does.
    pub emission: Option<Emission>,
    /// Which rays pass it.
    pub alpha: Alpha,
    /// The share of light that passes straight through, with the base colour, 0 to 1.
    pub transmission: f32,
    /// Whether its back is as its front. Otherwise the back is black, opaque and dark.
    pub is_double_sided: bool,
    /// Whether it emits its base colour and reflects nothing: its emission has the texture and the
    /// coordinates of the base colour, and is multiplied by the colour of the corners.
    pub is_unlit: bool,
}

impl Default for Material {
    /// White, opaque, of one side.
    fn default() -> Self {
        Self {
            name: String::new(),
            base: [1.0; 4],
            base_texture: None,
            metallic: 0.0,
            metallic_texture: None,
            emission: None,
            alpha: Alpha::Opaque,
            transmission: 0.0,
            is_double_sided: false,
            is_unlit: false,
        }
    }
}

impl Material {
    /// What is out of its range, if anything is; there are `textures` textures.
    pub(crate) fn wrong(&self, textures: usize) -> Option<&'static str> {
        let is_share = |share: &f32| (0.0..=1.0).contains(share);
        let is_there = |how: &Option<TextureUse>| how.is_none_or(|how| (how.texture as usize) < textures);
        let radiance = |emission: &Emission| emission.radiance.iter().all(|x| *x >= 0.0 && x.is_finite());
        let emission_texture = self.emission.and_then(|emission| emission.texture);
        [
            (self.base.iter().all(is_share), "the base colour"),
            (is_share(&self.metallic), "the metallic share"),
            (is_share(&self.transmission), "the transmission"),
            (self.emission.as_ref().is_none_or(radiance), "the emission"),
            (
                !matches!(self.alpha, Alpha::Mask(cutoff) if cutoff.is_nan() || cutoff < 0.0),
                "the cut of the mask",
            ),
            ([self.base_texture, self.metallic_texture, emission_texture].iter().all(is_there), "a texture"),
        ]
        .into_iter()
        .find(|(is_right, _)| !is_right)
        .map(|(_, what)| what)
    }

    /// A hash of what transport depends on, for hashes of the scene's textures: that is for a radiance of 1.
    pub(crate) fn digest(&self, textures: &[u64]) -> u64 {
        let Self { name: _, base, base_texture, metallic, metallic_texture, .. } = self;
        let Self { emission, alpha, transmission, is_double_sided, is_unlit, .. } = self;
        let how = |how: &Option<TextureUse>| {
            how.map(|TextureUse { texture, wrap, is_nearest }| {
                (textures.get(texture as usize).copied(), wrap, is_nearest)
            })
        };
        let emission = emission.map(|Emission { radiance: _, texture }| how(&texture));
        let all = (
            (base, how(base_texture), metallic, how(metallic_texture)),
            (emission, alpha, transmission, is_double_sided, is_unlit),
        );
        hash_words(0, format!("{all:?}").bytes().map(u64::from))
    }

    /// Whether every ray that meets it ends there.
    pub(crate) fn is_opaque(&self) -> bool {
        self.alpha == Alpha::Opaque && self.transmission == 0.0
    }
}
