//! A transfer in one of the forms in which it is stored and shaded with.
//!
//! | form | a vertex takes (O = F = 4) | holds |
//! | --- | --- | --- |
//! | [`HalfTransfer`] | 1,250 bytes | any material, shadows and interreflection, rounded to 11 bits |
//! | [`Visibility`] | 324 | any material, shadows alone, exactly |
//! | [`MatteTransfer`] | 100 | matte materials |
//!
//! Interreflection of a coloured material has a transfer for each of red, green and blue.

use brdf::BrdfTable;
use sh::{Degree, Expansion};

use crate::frames::{Frames, Viewer};
use crate::half_transfer::HalfTransfer;
use crate::matte::{MatteTransfer, NotMatte};
use crate::transfer::Transfer;
use crate::visibility::Visibility;

/// A transfer in one form.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// Matrices of 16-bit numbers.
    Matrices(HalfTransfer),
    /// The coefficients of the visibility.
    Visibility(Visibility),
    /// The response of a white matte surface.
    Matte(MatteTransfer),
}

impl Form {
    /// The number of vertices.
    pub fn len(&self) -> usize {
        match self {
            Self::Matrices(transfer) => transfer.len(),
            Self::Visibility(visibility) => visibility.len(),
            Self::Matte(matte) => matte.len(),
        }
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The degree F of the light of the world.
    pub fn input(&self) -> Degree {
        match self {
            Self::Matrices(transfer) => transfer.input(),
            Self::Visibility(visibility) => visibility.input(),
            Self::Matte(matte) => matte.input(),
        }
    }

    /// The degree O of the light that arrives; none for a matte transfer.
    pub fn output(&self) -> Option<Degree> {
        match self {
            Self::Matrices(transfer) => Some(transfer.output()),
            Self::Visibility(visibility) => Some(visibility.output()),
            Self::Matte(_) => None,
        }
    }

    /// The radiance of each vertex.
    ///
    /// # Errors
    /// If the transfer is matte and the table is not.
    ///
    /// # Panics
    /// If there are not as many vertices as frames.
    pub fn shade(
        &self,
        frames: &Frames,
        table: &BrdfTable,
        viewer: Viewer,
        light: &Expansion,
    ) -> Result<Vec<[f32; 3]>, NotMatte> {
        Ok(match self {
            Self::Matrices(transfer) => transfer.shade(frames, table, viewer, light),
            Self::Visibility(visibility) => visibility.shade(frames, table, viewer, light),
            Self::Matte(matte) => matte.shade(frames, table, light)?,
        })
    }

    /// The number of bytes of the transfer's numbers.
    fn bytes(&self) -> usize {
        match self {
            Self::Matrices(transfer) => size_of_val(transfer.values()),
            Self::Visibility(visibility) => size_of_val(visibility.values()),
            Self::Matte(matte) => size_of_val(matte.values()),
        }
    }

    fn matrices(&self, frames: &Frames) -> Option<Transfer> {
        match self {
            Self::Matrices(transfer) => transfer.matrices(),
            Self::Visibility(visibility) => visibility.matrices(frames),
            Self::Matte(_) => None,
        }
    }
}

/// One transfer for all channels, or one for each of red, green and blue.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredTransfer {
    channels: Vec<Form>,
}

impl StoredTransfer {
    /// One or three transfers of the same form, degrees and number of vertices; `None` otherwise.
    pub fn new(channels: Vec<Form>) -> Option<Self> {
        let first = channels.first()?;
        let same = channels.iter().all(|form| {
            std::mem::discriminant(form) == std::mem::discriminant(first)
                && (form.len(), form.input(), form.output()) == (first.len(), first.input(), first.output())
        });
        (same && matches!(channels.len(), 1 | 3)).then_some(Self { channels })
    }

    /// The transfers: one for all channels, or one for each of red, green and blue.
    pub fn channels(&self) -> &[Form] {
        &self.channels
    }

    /// The first channel; all have its form and sizes.
    pub fn form(&self) -> &Form {
        &self.channels[0]
    }

    /// The number of vertices.
    pub fn len(&self) -> usize {
        self.form().len()
    }

    /// Whether there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.form().is_empty()
    }

    /// The number of bytes of the transfer's numbers.
    pub fn bytes(&self) -> usize {
        self.channels.iter().map(Form::bytes).sum()
    }

    /// The matrices that the transfer stands for, one for all channels or one for each; `None` for a matte
    /// transfer, or if the frames are not as many as the vertices.
    pub fn matrices(&self, frames: &Frames) -> Option<Vec<Transfer>> {
        self.channels.iter().map(|form| form.matrices(frames)).collect()
    }

    /// The radiance of each vertex, with what the mesh hides and, if that was baked, reflects.
    ///
    /// # Errors
    /// If the transfer is matte and the table is not.
    ///
    /// # Panics
    /// If there are not as many vertices as frames.
    pub fn shade(
        &self,
        frames: &Frames,
        table: &BrdfTable,
        viewer: Viewer,
        light: &Expansion,
    ) -> Result<Vec<[f32; 3]>, NotMatte> {
        let mut radiance = self.form().shade(frames, table, viewer, light)?;
        for (channel, form) in self.channels.iter().enumerate().skip(1) {
            let own = form.shade(frames, table, viewer, light)?;
            radiance.iter_mut().zip(own).for_each(|(rgb, own)| rgb[channel] = own[channel]);
        }
        Ok(radiance)
    }
}
