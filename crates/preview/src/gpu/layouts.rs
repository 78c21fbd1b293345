//! The bindings and the pipelines of the shaders, whose texts are in shader_sources.rs.
//!
//! Group 0 is one sample of each pixel (frame.wgsl), group 1 a map (map.wgsl), group 2 the inputs and outputs
//! of a pass, and group 3 the light and material of brute force, or the lamps beside a map and their
//! material, with the levels and the taps of a compact map.

use std::collections::{BTreeSet, HashMap};

use wgpu::{
    BindGroupLayoutEntry, BindingType, BufferBindingType, ShaderStages, StorageTextureAccess,
    TextureSampleType, TextureViewDimension,
};

use super::memory::TEXELS;
use super::mesh::Shape;
use super::shader_sources::{
    BASE_COLOR, PRESENT, RASTER, TEXTURED, UNTEXTURED, coloured_source, develop_source, mode_source, models,
    product_source, shaded_source, shadowed_lamps_source, table_models, update_source,
};
use crate::{Look, Mode};

/// The format of the depth buffer.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The layouts of bind groups.
#[derive(Debug)]
pub(super) struct Layouts {
    pub(super) placed: wgpu::BindGroupLayout,
    pub(super) frame: wgpu::BindGroupLayout,
    pub(super) map: wgpu::BindGroupLayout,
    pub(super) shade: wgpu::BindGroupLayout,
    pub(super) update: wgpu::BindGroupLayout,
    pub(super) develop: wgpu::BindGroupLayout,
    pub(super) develop_textured: wgpu::BindGroupLayout,
    pub(super) texture: wgpu::BindGroupLayout,
    pub(super) present: wgpu::BindGroupLayout,
    pub(super) vertex_light: wgpu::BindGroupLayout,
    pub(super) light: wgpu::BindGroupLayout,
    pub(super) product: wgpu::BindGroupLayout,
    pub(super) shadowed: wgpu::BindGroupLayout,
    pub(super) lamps: wgpu::BindGroupLayout,
    pub(super) shadowed_lamps: wgpu::BindGroupLayout,
    pub(super) taps: wgpu::BindGroupLayout,
}

/// The pipelines. That of a mode is compiled when the mode is first shown with materials of some models.
#[derive(Debug)]
pub(super) struct Pipelines {
    device: wgpu::Device,
    pub(super) raster: wgpu::RenderPipeline,
    pub(super) update: wgpu::ComputePipeline,
    pub(super) product: wgpu::ComputePipeline,
    pub(super) develop: wgpu::ComputePipeline,
    pub(super) present: wgpu::RenderPipeline,
    /// The pipeline that draws objects shaded by a BRDF table.
    pub(super) shaded: wgpu::RenderPipeline,
    /// The pipeline that draws positions in the mesh.
    pub(super) located: wgpu::RenderPipeline,
    /// The pipelines of textures, compiled when a texture is first shown.
    pub(super) textured: Option<TexturedPipelines>,
    /// The pipelines of modes, for the models of the materials that they look at.
    modes: HashMap<(Mode, BTreeSet<u32>), wgpu::ComputePipeline>,
    /// The pipelines that add shadowed lamps to the radiance of [`Mode::Transfer`], for the models of their
    /// materials.
    shadowed_lamps: HashMap<BTreeSet<u32>, wgpu::ComputePipeline>,
}

/// The pipelines of scenes with textures.
#[derive(Debug)]
pub(super) struct TexturedPipelines {
    /// The pipeline that draws the base colours of an object with a texture.
    pub(super) coloured: wgpu::RenderPipeline,
    /// The pipeline that draws an object without a texture.
    pub(super) uncoloured: wgpu::RenderPipeline,
    pub(super) develop: wgpu::ComputePipeline,
}

impl Layouts {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let vertex = ShaderStages::VERTEX_FRAGMENT;
        let compute = ShaderStages::COMPUTE;
        let layout = |label: &str, entries: &[BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let developing = [
            entry(0, compute, uniform()),
            entry(1, compute, read()),
            entry(2, compute, read()),
            entry(3, compute, write()),
            entry(4, compute, write()),
            entry(5, compute, write()),
            entry(6, compute, write()),
            entry(7, compute, texture(TextureViewDimension::D2)),
            entry(8, compute, texture(TextureViewDimension::D2)),
        ];
        Self {
            placed: layout("an object", &[entry(0, vertex, one_of_many())]),
            frame: layout(
                "a sample of each pixel",
                &[
                    entry(0, compute, uniform()),
                    entry(1, compute, texture(TextureViewDimension::D2)),
                    entry(2, compute, texture(TextureViewDimension::D2)),
                    entry(3, compute, read()),
                ],
            ),
            map: layout(
                "a map",
                &[entry(0, compute, uniform()), entry(1, compute, texture(TextureViewDimension::D2Array))],
            ),
            shade: layout("a mode", &[entry(0, compute, one_of_many()), entry(1, compute, write())]),
            update: layout(
                "equation 12",
                &[
                    entry(
                        0,
                        compute,
                        BindingType::StorageTexture {
                            access: StorageTextureAccess::WriteOnly,
                            format: TEXELS,
                            view_dimension: TextureViewDimension::D2Array,
                        },
                    ),
                    entry(2, compute, read()),
                ],
            ),
            develop: layout("developing", &developing[..7]),
            develop_textured: layout("developing", &developing),
            texture: layout(
                "a texture",
                &[entry(0, ShaderStages::FRAGMENT, uniform()), entry(1, ShaderStages::FRAGMENT, read())],
            ),
            present: layout(
                "codes",
                &[entry(0, ShaderStages::FRAGMENT, uniform()), entry(1, ShaderStages::FRAGMENT, read())],
            ),
            vertex_light: layout(
                "the light of vertices",
                &[
                    entry(0, vertex, uniform()),
                    entry(1, vertex, read()),
                    entry(2, vertex, read()),
                    entry(3, vertex, read()),
                    entry(4, vertex, read()),
                    entry(5, vertex, read()),
                ],
            ),
            light: layout("light and material", &[0, 1, 2, 8].map(|binding| entry(binding, compute, read()))),
            product: layout("the product of light and material", &[entry(0, compute, write())]),
            shadowed: layout(
                "light, material and shadows",
                &[
                    entry(0, compute, read()),
                    entry(1, compute, read()),
                    entry(2, compute, read()),
                    entry(4, compute, read()),
                    entry(5, compute, uniform()),
                    entry(8, compute, read()),
                ],
            ),
            lamps: layout("lamps and material", &[1, 3].map(|binding| entry(binding, compute, read()))),
            shadowed_lamps: layout(
                "lamps, material and shadows",
                &[
                    entry(1, compute, read()),
                    entry(3, compute, read()),
                    entry(4, compute, read()),
                    entry(5, compute, uniform()),
                ],
            ),
            taps: layout("a compact map", &[1, 3, 6, 7].map(|binding| entry(binding, compute, read()))),
        }
    }
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device, layouts: &Layouts, target: wgpu::TextureFormat) -> Self {
        let placed = Drawing { groups: &[Some(&layouts.placed)], source: RASTER };
        let shaded = Drawing {
            groups: &[Some(&layouts.placed), Some(&layouts.vertex_light)],
            source: &shaded_source(),
        };
        Self {
            raster: raster(device, &placed, ["vertex", "fragment"], &[Some(Shape::LAYOUT)], 2),
            shaded: raster(device, &shaded, ["shaded_vertex", "shaded_fragment"], &[], 1),
            located: raster(
                device,
                &placed,
                ["located_vertex", "located_fragment"],
                &[Some(Shape::LAYOUT)],
                1,
            ),
            update: compute(
                device,
                "update",
                &[None, Some(&layouts.map), Some(&layouts.update)],
                &update_source(),
            ),
            product: compute(device, "make_product_tables", &[Some(&layouts.product)], &product_source()),
            develop: compute(
                device,
                "develop_samples",
                &[Some(&layouts.frame), Some(&layouts.map), Some(&layouts.develop)],
                &develop_source(&[UNTEXTURED]),
            ),
            present: present(device, layouts, target),
            textured: None,
            modes: HashMap::new(),
            shadowed_lamps: HashMap::new(),
            device: device.clone(),
        }
    }

    /// The pipeline of a mode for a look, if it was prepared.
    pub(super) fn mode(&self, mode: Mode, look: &Look) -> Option<&wgpu::ComputePipeline> {
        self.modes.get(&(mode, models(mode, look)))
    }

    /// The pipeline that adds the shadowed lamps of a look, if it was prepared.
    pub(super) fn shadowed_lamps(&self, look: &Look) -> Option<&wgpu::ComputePipeline> {
        self.shadowed_lamps.get(&table_models(look))
    }

    /// Compiles the pipeline that adds the shadowed lamps of a look unless that was done before.
    pub(super) fn prepare_shadowed_lamps(&mut self, layouts: &Layouts, look: &Look) {
        let device = &self.device;
        self.shadowed_lamps.entry(table_models(look)).or_insert_with_key(|models| {
            let Layouts { frame, map, shade, shadowed_lamps, .. } = layouts;
            let groups = [frame, map, shade, shadowed_lamps].map(Some);
            compute(device, "shade", &groups, &shadowed_lamps_source(models))
        });
    }

    /// Compiles the pipelines of textures unless that was done before.
    pub(super) fn prepare_textured(&mut self, layouts: &Layouts) {
        let device = &self.device;
        self.textured.get_or_insert_with(|| {
            let source = &coloured_source();
            let placed = Drawing { groups: &[Some(&layouts.placed)], source };
            let textured = Drawing { groups: &[Some(&layouts.placed), Some(&layouts.texture)], source };
            TexturedPipelines {
                coloured: raster(
                    device,
                    &textured,
                    ["coloured_vertex", "coloured_fragment"],
                    &[Some(Shape::LAYOUT), Some(Shape::COORDINATES)],
                    1,
                ),
                uncoloured: raster(
                    device,
                    &placed,
                    ["uncoloured_vertex", "uncoloured_fragment"],
                    &[Some(Shape::LAYOUT)],
                    1,
                ),
                develop: compute(
                    device,
                    "develop_samples",
                    &[Some(&layouts.frame), Some(&layouts.map), Some(&layouts.develop_textured)],
                    &develop_source(&[BASE_COLOR, TEXTURED]),
                ),
            }
        });
    }

    /// Compiles the pipeline of a mode for materials of these models unless that was done before.
    pub(super) fn prepare(&mut self, layouts: &Layouts, mode: Mode, models: BTreeSet<u32>) {
        let device = &self.device;
        self.modes.entry((mode, models)).or_insert_with_key(|(mode, models)| {
            let mode = *mode;
            let Layouts { frame, map, shade, light, shadowed, lamps, taps, .. } = layouts;
            let groups = match mode {
                Mode::BruteForce => &[Some(frame), None, Some(shade), Some(light)][..],
                Mode::ShadowedBruteForce => &[Some(frame), Some(map), Some(shade), Some(shadowed)],
                Mode::Taps => &[Some(frame), None, Some(shade), Some(taps)],
                mode if mode.adds_lamps() => &[Some(frame), Some(map), Some(shade), Some(lamps)],
                _ => &[Some(frame), Some(map), Some(shade)],
            };
            compute(device, "shade", groups, &mode_source(mode, models))
        });
    }
}

fn compute(
    device: &wgpu::Device,
    entry_point: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
    source: &str,
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry_point),
        layout: Some(&pipeline_layout(device, groups)),
        module: &module(device, entry_point, source),
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// The bindings and the shader of a pass that draws meshes.
struct Drawing<'a> {
    groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    source: &'a str,
}

/// Draws meshes with a depth test into so many colours.
fn raster(
    device: &wgpu::Device,
    drawing: &Drawing<'_>,
    [vertex, fragment]: [&str; 2],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    colours: usize,
) -> wgpu::RenderPipeline {
    let module = module(device, "raster", drawing.source);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("raster"),
        layout: Some(&pipeline_layout(device, drawing.groups)),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &vec![Some(TEXELS.into()); colours],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn present(device: &wgpu::Device, layouts: &Layouts, target: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = module(device, "present", PRESENT);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("present"),
        layout: Some(&pipeline_layout(device, &[Some(&layouts.present)])),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(target.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn module(device: &wgpu::Device, label: &str, source: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    })
}

fn pipeline_layout(device: &wgpu::Device, groups: &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: groups,
        immediate_size: 0,
    })
}

fn entry(binding: u32, visibility: ShaderStages, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn buffer(ty: BufferBindingType, has_dynamic_offset: bool) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None }
}

fn uniform() -> BindingType {
    buffer(BufferBindingType::Uniform, false)
}

/// One of the values of a [`super::memory::Uniforms`].
fn one_of_many() -> BindingType {
    buffer(BufferBindingType::Uniform, true)
}

fn read() -> BindingType {
    buffer(BufferBindingType::Storage { read_only: true }, false)
}

fn write() -> BindingType {
    buffer(BufferBindingType::Storage { read_only: false }, false)
}

fn texture(view_dimension: TextureViewDimension) -> BindingType {
    let sample_type = TextureSampleType::Float { filterable: false };
    BindingType::Texture { sample_type, view_dimension, multisampled: false }
}
