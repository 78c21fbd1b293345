//! Buffers and textures, checked against the device's limits before they are allocated.

use wgpu::{BufferUsages, Extent3d, TextureDimension, TextureFormat, TextureUsages};

use super::device::Device;
use crate::RenderError;

/// The format of all colour textures. Devices need not filter it.
pub(super) const TEXELS: TextureFormat = TextureFormat::Rgba32Float;

/// The most bytes of a texture: on some devices a failed allocation ends the program.
const MOST_BYTES: u64 = 2 << 30;

/// Values of one type in a uniform buffer, each at a dynamic offset.
pub(super) struct Uniforms {
    buffer: wgpu::Buffer,
    size: usize,
    stride: usize,
}

impl Uniforms {
    /// The binding of one value.
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: 0,
            size: wgpu::BufferSize::new(self.size as u64),
        })
    }

    /// The dynamic offset of a value.
    pub(super) fn offset(&self, index: usize) -> u32 {
        (self.stride * index) as u32
    }
}

impl Device {
    /// A buffer of some bytes, at least 16.
    pub(super) fn buffer(
        &self,
        what: &str,
        usage: BufferUsages,
        bytes: u64,
    ) -> Result<wgpu::Buffer, RenderError> {
        let limits = self.device.limits();
        let bound = if usage.contains(BufferUsages::STORAGE) {
            limits.max_storage_buffer_binding_size
        } else {
            u64::MAX
        };
        within(format!("{what}: the bytes of the buffer"), bytes, limits.max_buffer_size.min(bound))?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size: bytes.max(16).next_multiple_of(16),
            usage,
            mapped_at_creation: false,
        }))
    }

    /// A buffer that holds these values.
    pub(super) fn filled<T: bytemuck::NoUninit>(
        &self,
        what: &str,
        usage: BufferUsages,
        values: &[T],
    ) -> Result<wgpu::Buffer, RenderError> {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        let buffer = self.buffer(what, usage | BufferUsages::COPY_DST, bytes.len() as u64)?;
        // The size of a copy is a multiple of 4.
        match bytes.len() % 4 {
            0 => self.queue.write_buffer(&buffer, 0, bytes),
            _ => {
                let mut whole = bytes.to_vec();
                whole.resize(bytes.len().next_multiple_of(4), 0);
                self.queue.write_buffer(&buffer, 0, &whole);
            }
        }
        Ok(buffer)
    }

    /// A uniform buffer of several values, of which a pass reads one.
    pub(super) fn uniforms<T: bytemuck::NoUninit>(
        &self,
        what: &str,
        values: &[T],
    ) -> Result<Uniforms, RenderError> {
        let size = size_of::<T>();
        let alignment = self.device.limits().min_uniform_buffer_offset_alignment.max(16) as usize;
        let stride = size.next_multiple_of(alignment);
        let mut bytes = vec![0; stride * values.len().max(1)];
        for (place, value) in bytes.chunks_exact_mut(stride).zip(values) {
            place[..size].copy_from_slice(bytemuck::bytes_of(value));
        }
        let buffer = self.filled(what, BufferUsages::UNIFORM, &bytes)?;
        Ok(Uniforms { buffer, size, stride })
    }

    /// A texture with layers.
    pub(super) fn texture(
        &self,
        what: &str,
        format: TextureFormat,
        usage: TextureUsages,
        [width, height, layers]: [u64; 3],
    ) -> Result<wgpu::Texture, RenderError> {
        let limits = self.device.limits();
        let side = u64::from(limits.max_texture_dimension_2d);
        within(format!("{what}: the width of the texture"), width, side)?;
        within(format!("{what}: the height of the texture"), height, side)?;
        within(
            format!("{what}: the layers of the texture"),
            layers,
            u64::from(limits.max_texture_array_layers),
        )?;
        let texel = u64::from(format.block_copy_size(None).unwrap_or(16));
        within(format!("{what}: the bytes of the texture"), width * height * layers * texel, MOST_BYTES)?;
        Ok(self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(what),
            size: Extent3d {
                width: width as u32,
                height: height as u32,
                depth_or_array_layers: layers as u32,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        }))
    }

    /// Writes some layers of a texture of [`TEXELS`], rows from the top.
    pub(super) fn write_layers(&self, texture: &wgpu::Texture, first: u32, texels: &[[f32; 4]]) {
        let Extent3d { width, height, .. } = texture.size();
        let layers = texels.len() as u32 / (width * height).max(1);
        self.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: 0, z: first },
                ..texture.as_image_copy()
            },
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(16 * width),
                rows_per_image: Some(height),
            },
            Extent3d { width, height, depth_or_array_layers: layers },
        );
    }
}

/// # Errors
/// [`RenderError::Limit`] if a value exceeds its limit.
pub(super) fn within(what: String, asked: u64, limit: u64) -> Result<(), RenderError> {
    if asked <= limit { Ok(()) } else { Err(RenderError::Limit { what, asked, limit }) }
}
