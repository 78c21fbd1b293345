//! Encodes the commands of a picture: drawing the surface buffer, shading it, and developing the sums.

use glam::{Mat3, Mat4, Vec4};
use wgpu::{BindGroupEntry, BindingResource, BufferUsages, CommandEncoder};

use super::canvas::DeviceCanvas;
use super::device::GROUP;
use super::identity_cache::address;
use super::memory::Uniforms;
use super::mesh::{Rectangle, Shape};
use super::resources::Resources;
use crate::shading::{numbers, sequence};
use crate::{Background, Mode, RenderError, Scene, Shot, Show, ViewTransform};

/// The struct `FrameUniforms` of frame.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct FrameUniforms {
    corner: [f32; 3],
    samples: u32,
    across: [f32; 4],
    down: [f32; 4],
    size: [u32; 2],
    chosen: [u32; 2],
}

/// The struct `PlacedUniforms` of raster.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct PlacedUniforms {
    clip: [[f32; 4]; 4],
    normal: [[f32; 4]; 3],
    tangent: [[f32; 4]; 3],
    number: f32,
    mirrored: u32,
    samples: f32,
    unused: u32,
}

/// The struct `PartUniforms` of shade.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct PartUniforms {
    origin: [u32; 2],
    extent: [u32; 2],
    number: u32,
    first: u32,
    count: u32,
    points: u32,
}

/// The struct `DevelopUniforms` of develop.wgsl.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct DevelopUniforms {
    flat_radiance: [f32; 3],
    background: u32,
    gain: f32,
    tone: u32,
    show: u32,
    divider: u32,
    amplify: f32,
    counts: [f32; 2],
    begins: u32,
    ends: u32,
    first_square: u32,
    shows_material: [u32; 2],
}

/// An object in the picture, and a rectangle that contains its pixels.
#[derive(Clone, Copy, Debug)]
struct Visible {
    object: usize,
    pixels: Rectangle,
}

impl Visible {
    /// The part of the rectangle in some columns of pixels.
    fn within(self, columns: std::ops::Range<u32>) -> Option<Self> {
        Some(Self { pixels: self.pixels.columns(columns)?, ..self })
    }
}

/// Encodes the passes of one picture.
pub(super) struct FrameEncoder<'a> {
    pub(super) scene: &'a Scene,
    pub(super) shot: &'a Shot,
    resources: &'a Resources,
    canvas: &'a DeviceCanvas,
    transform: ViewTransform,
    visible: Vec<Visible>,
    /// The place of each visible object at each sample of pixels.
    places: Uniforms,
    placed: wgpu::BindGroup,
    samples: Vec<wgpu::BindGroup>,
    background: &'a wgpu::BindGroup,
}

/// The objects that a pass shades, and the bindings of group 2.
struct Parts {
    seen: Vec<Visible>,
    uniforms: Uniforms,
    bound: wgpu::BindGroup,
}

impl<'a> FrameEncoder<'a> {
    /// The encoder for a scene whose resources are prepared.
    pub(super) fn new(
        scene: &'a Scene,
        shot: &'a Shot,
        resources: &'a Resources,
        canvas: &'a DeviceCanvas,
    ) -> Result<Self, RenderError> {
        let device = &resources.device;
        let transform = ViewTransform::new(shot);
        let count = canvas.samples;
        let samples: Vec<[u32; 2]> =
            (0..count * count).map(|sample| [sample % count, sample / count]).collect();
        let (mut visible, mut places) = (Vec::new(), Vec::new());
        for (index, object) in scene.objects.iter().enumerate() {
            let Some(Some(shape)) = resources.meshes.get(&object.mesh) else { continue };
            let at = transform.place(object);
            let Some(pixels) = shape.pixels(at.clip, canvas.size) else { continue };
            visible.push(Visible { object: index, pixels });
            places.extend(samples.iter().map(|&chosen| PlacedUniforms {
                clip: (shift(canvas.size, count, chosen) * at.clip).to_cols_array_2d(),
                normal: columns(at.normal),
                tangent: columns(at.tangent),
                number: (index + 1) as f32,
                mirrored: u32::from(at.mirrored),
                samples: count as f32,
                unused: 0,
            }));
        }
        let places = device.uniforms("where objects are", &places)?;
        let placed = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("an object"),
            layout: &resources.layouts.placed,
            entries: &[BindGroupEntry { binding: 0, resource: places.binding() }],
        });
        let samples = samples.into_iter().map(|chosen| chosen_sample(resources, canvas, &transform, chosen));
        let samples = samples.collect::<Result<_, _>>()?;
        let light = resources.lights.get(&scene.light);
        let map = match shot.background {
            Background::Environment => light.and_then(|light| light.environment.as_ref()),
            Background::Harmonics => light.and_then(|light| light.reconstruction.as_ref()),
            Background::Flat(_) => None,
        };
        let background = &map.unwrap_or(&resources.empty_map).bound;
        Ok(Self { scene, shot, resources, canvas, transform, visible, places, placed, samples, background })
    }

    /// Equation 12 for every visible look, if a mode needs it.
    pub(super) fn update(&self, encoder: &mut CommandEncoder) {
        if self.shot.show.modes().all(|mode| mode != Mode::GlobalShrm) {
            return;
        }
        let mut done = std::collections::HashSet::new();
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.resources.pipelines.update);
        for seen in &self.visible {
            let look = &self.scene.objects[seen.object].look;
            let Some(update) = self.resources.looks.get(look).and_then(|maps| maps.update.as_ref()) else {
                continue;
            };
            if done.insert(address(look)) {
                update.set_view(&self.resources.device, self.transform.view);
                pass.set_bind_group(1, &update.coefficients.bound, &[]);
                pass.set_bind_group(2, &update.bound, &[]);
                let groups = update.edge.div_ceil(GROUP);
                pass.dispatch_workgroups(groups, groups, update.faces);
            }
        }
    }

    /// Draws one sample of each pixel: the visible surfaces, the radiance of each side's mode, and the sums.
    /// `accumulate` adds light samples to a side in brute force and returns their total number.
    pub(super) fn sample(
        &self,
        encoder: &mut CommandEncoder,
        sample: usize,
        mut accumulate: impl FnMut(&mut CommandEncoder, usize) -> Result<u32, RenderError>,
    ) -> Result<(), RenderError> {
        self.raster(encoder, sample);
        self.raster_colours(encoder, sample);
        let mut counts = [1; 2];
        for (side, mode) in self.shot.show.sides().into_iter().enumerate() {
            let Some(mode) = mode else { continue };
            if draws_map(mode) {
                self.raster_map(encoder, sample, mode);
            }
            if mode.is_brute_force() {
                counts[side] = accumulate(encoder, side)?;
            } else {
                self.shade(encoder, side, mode, sample, self.columns(side), 0..1)?;
            }
            if mode == Mode::Transfer && !self.resources.shadowed_lamps.is_empty() {
                self.raster_map(encoder, sample, Mode::ShadowedBruteForce);
                self.add_shadowed_lamps(encoder, side, sample)?;
            }
        }
        self.develop(encoder, sample, counts)
    }

    /// Draws the meshes into the surface buffer at one sample of each pixel.
    fn raster(&self, encoder: &mut CommandEncoder, sample: usize) {
        let targets = [&self.canvas.normals, &self.canvas.tangents].map(cleared);
        let mut pass = self.raster_pass(encoder, &targets);
        pass.set_pipeline(&self.resources.pipelines.raster);
        self.draw_visible(&mut pass, sample, |pass, _, shape| shape.draw(pass));
    }

    /// Draws the map of a mode at one sample of each pixel: radiance by a table, or positions.
    fn raster_map(&self, encoder: &mut CommandEncoder, sample: usize, mode: Mode) {
        let Some((_, target)) = &self.canvas.drawn_map else { return };
        let mut pass = self.raster_pass(encoder, &[cleared(target)]);
        if mode == Mode::ShadowedBruteForce {
            pass.set_pipeline(&self.resources.pipelines.located);
            return self.draw_visible(&mut pass, sample, |pass, _, shape| shape.draw(pass));
        }
        pass.set_pipeline(&self.resources.pipelines.shaded);
        self.draw_visible(&mut pass, sample, |pass, object, shape| {
            let light = self.resources.vertex_lights.get(&(object, mode));
            if let Some(bound) = light.and_then(|light| light.bound.as_ref()) {
                // The shader finds the vertices of the corners.
                pass.set_bind_group(1, bound, &[]);
                pass.draw(0..shape.count, 0..1);
            }
        });
    }

    /// Draws the base colours of textures at one sample of each pixel, if the picture shows one.
    fn raster_colours(&self, encoder: &mut CommandEncoder, sample: usize) {
        let Resources { textures, pipelines, .. } = self.resources;
        let (Some(target), Some(pipelines)) = (self.colours(), &pipelines.textured) else { return };
        let mut pass = self.raster_pass(encoder, &[cleared(target)]);
        self.draw_visible(&mut pass, sample, |pass, object, shape| {
            match textures.of(object, &self.scene.objects[object].look) {
                Some((texture, coordinates)) => {
                    pass.set_pipeline(&pipelines.coloured);
                    pass.set_bind_group(1, texture, &[]);
                    pass.set_vertex_buffer(1, coordinates.slice(..));
                }
                None => pass.set_pipeline(&pipelines.uncoloured),
            }
            shape.draw(pass);
        });
    }

    /// The target of base colours, if the picture shows a texture.
    fn colours(&self) -> Option<&'a wgpu::TextureView> {
        self.canvas.colours.as_ref().filter(|_| self.resources.textures.is_shown)
    }

    /// Begins a pass that draws the nearest surfaces.
    fn raster_pass<'p>(
        &self,
        encoder: &'p mut CommandEncoder,
        targets: &[Option<wgpu::RenderPassColorAttachment<'_>>],
    ) -> wgpu::RenderPass<'p> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raster"),
            color_attachments: targets,
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.canvas.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        })
    }

    /// Binds where each visible object is, and draws it with a function of its number and shape.
    fn draw_visible(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        sample: usize,
        draw: impl Fn(&mut wgpu::RenderPass<'_>, usize, &Shape),
    ) {
        for (k, seen) in self.visible.iter().enumerate() {
            let mesh = &self.scene.objects[seen.object].mesh;
            let Some(Some(shape)) = self.resources.meshes.get(mesh) else { continue };
            let offset = self.places.offset(k * self.samples.len() + sample);
            pass.set_bind_group(0, &self.placed, &[offset]);
            draw(pass, seen.object, shape);
        }
    }

    /// The columns of pixels that show a side's mode.
    pub(super) fn columns(&self, side: usize) -> std::ops::Range<u32> {
        let (width, divider) = (self.canvas.size[0], self.shot.show.divider(self.canvas.size[0]));
        match (self.shot.show, side) {
            (Show::Split { .. }, 0) => 0..divider,
            (Show::Split { .. }, _) => divider..width,
            _ => 0..width,
        }
    }

    /// Sets the radiance of a side's mode at a sample of pixels to 0.
    pub(super) fn clear(&self, encoder: &mut CommandEncoder, side: usize, sample: usize) {
        if let Some(light) = self.canvas.light(side, sample) {
            encoder.clear_buffer(light, 0, None);
        }
    }

    /// Shades all surfaces in some columns of pixels. Brute force adds the light samples in `lights`.
    pub(super) fn shade(
        &self,
        encoder: &mut CommandEncoder,
        side: usize,
        mode: Mode,
        sample: usize,
        columns: std::ops::Range<u32>,
        lights: std::ops::Range<u32>,
    ) -> Result<(), RenderError> {
        let pipelines = &self.resources.pipelines;
        let Some(light) = self.canvas.light(side, sample) else { return Ok(()) };
        let Parts { seen, uniforms: parts, bound } = self.parts(light, columns, lights)?;
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &self.samples[sample], &[]);
        for (k, Visible { object, pixels }) in seen.into_iter().enumerate() {
            let look = &self.scene.objects[object].look;
            let Some(pipeline) = pipelines.mode(mode, look) else { continue };
            pass.set_pipeline(pipeline);
            let maps = self.resources.lights.get(look.light());
            if mode.adds_lamps() {
                let maps = self.resources.looks.get(look);
                let Some(lamps) = maps.and_then(|maps| maps.lamps.get(&mode)) else { continue };
                pass.set_bind_group(3, &lamps.bound, &[]);
            }
            match mode {
                Mode::BruteForce => {
                    let Some(samples) = self.resources.looks.get(look).and_then(|maps| maps.samples.as_ref())
                    else {
                        continue;
                    };
                    pass.set_bind_group(3, &samples.bound, &[]);
                }
                Mode::Taps => {
                    let Some(taps) = self.resources.looks.get(look).and_then(|maps| maps.taps.as_ref())
                    else {
                        continue;
                    };
                    pass.set_bind_group(3, taps, &[]);
                }
                Mode::ShadowedBruteForce => {
                    let (shadowed, drawn) = (self.resources.shadowed.get(&object), &self.canvas.drawn_map);
                    let (Some(shadowed), Some((map, _))) = (shadowed, drawn) else { continue };
                    pass.set_bind_group(1, &map.bound, &[]);
                    pass.set_bind_group(3, shadowed, &[]);
                }
                _ => {
                    let map = match mode {
                        Mode::Mirror => maps.and_then(|maps| maps.environment.as_ref()),
                        Mode::Table | Mode::Transfer => self.canvas.drawn_map.as_ref().map(|(map, _)| map),
                        Mode::Irradiance => maps.and_then(|maps| maps.irradiance.as_ref()),
                        _ => self.resources.looks.get(look).and_then(|maps| maps.modes.get(&mode)),
                    };
                    let Some(map) = map else { continue };
                    pass.set_bind_group(1, &map.bound, &[]);
                }
            }
            pass.set_bind_group(2, &bound, &[parts.offset(k)]);
            let [across, down] = pixels.extent.map(|side| side.div_ceil(GROUP));
            pass.dispatch_workgroups(across, down, 1);
        }
        Ok(())
    }

    /// Adds the lamps that meshes do not hide from themselves to the radiance of a side in
    /// [`Mode::Transfer`], one after another, as the rays of many would take long. Positions are drawn as its
    /// map.
    fn add_shadowed_lamps(
        &self,
        encoder: &mut CommandEncoder,
        side: usize,
        sample: usize,
    ) -> Result<(), RenderError> {
        let Resources { pipelines, shadowed_lamps, .. } = self.resources;
        let (Some(light), Some((map, _))) = (self.canvas.light(side, sample), &self.canvas.drawn_map) else {
            return Ok(());
        };
        let most = shadowed_lamps.values().map(|(count, _)| *count).max().unwrap_or_default();
        for lamp in 0..most {
            let Parts { seen, uniforms: parts, bound } =
                self.parts(light, self.columns(side), lamp..lamp + 1)?;
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_bind_group(0, &self.samples[sample], &[]);
            pass.set_bind_group(1, &map.bound, &[]);
            for (k, Visible { object, pixels }) in seen.into_iter().enumerate() {
                let pipeline = pipelines.shadowed_lamps(&self.scene.objects[object].look);
                let lamps = shadowed_lamps.get(&object).filter(|(count, _)| lamp < *count);
                let (Some(pipeline), Some((_, lamps))) = (pipeline, lamps) else { continue };
                pass.set_pipeline(pipeline);
                pass.set_bind_group(3, lamps, &[]);
                pass.set_bind_group(2, &bound, &[parts.offset(k)]);
                let [across, down] = pixels.extent.map(|side| side.div_ceil(GROUP));
                pass.dispatch_workgroups(across, down, 1);
            }
        }
        Ok(())
    }

    /// The visible objects in some columns of pixels, and what a pass over them reads and writes.
    fn parts(
        &self,
        light: &wgpu::Buffer,
        columns: std::ops::Range<u32>,
        lights: std::ops::Range<u32>,
    ) -> Result<Parts, RenderError> {
        let Resources { device, layouts, .. } = self.resources;
        let seen = self.visible.iter();
        let seen: Vec<Visible> = seen.filter_map(|seen| seen.within(columns.clone())).collect();
        let part = |&Visible { object, pixels }: &Visible| PartUniforms {
            origin: pixels.origin,
            extent: pixels.extent,
            number: object as u32 + 1,
            first: lights.start,
            count: lights.end - lights.start,
            points: sequence::number(self.shot.points),
        };
        let uniforms: Vec<PartUniforms> = seen.iter().map(part).collect();
        let uniforms = device.uniforms("parts of the picture", &uniforms)?;
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("parts of the picture"),
            layout: &layouts.shade,
            entries: &[
                BindGroupEntry { binding: 0, resource: uniforms.binding() },
                BindGroupEntry { binding: 1, resource: light.as_entire_binding() },
            ],
        });
        Ok(Parts { seen, uniforms, bound })
    }

    /// Adds one sample of each pixel to the sums, and computes the codes after the last one. `counts` are the
    /// light samples of each side, 1 for a mode without them.
    fn develop(
        &self,
        encoder: &mut CommandEncoder,
        sample: usize,
        counts: [u32; 2],
    ) -> Result<(), RenderError> {
        let Resources { device, layouts, pipelines, textures, .. } = self.resources;
        let (Some(first), Some(second)) = (self.canvas.light(0, sample), self.canvas.light(1, sample)) else {
            return Ok(());
        };
        let flat_radiance = match self.shot.background {
            Background::Environment | Background::Harmonics => [0.0; 3],
            Background::Flat(radiance) => radiance,
        };
        let amplify = match self.shot.show {
            Show::One(_) | Show::Split { .. } => 1.0,
            Show::Difference { amplify, .. } => amplify,
        };
        let [across, down] = self.canvas.groups();
        let uniforms = DevelopUniforms {
            flat_radiance,
            background: numbers::background(self.shot.background),
            gain: self.transform.gain,
            tone: numbers::tone(self.shot.tone),
            show: numbers::show(self.shot.show),
            divider: self.shot.show.divider(self.canvas.size[0]),
            amplify,
            counts: counts.map(|count| count as f32),
            begins: u32::from(sample == 0),
            ends: u32::from(sample + 1 == self.samples.len()),
            first_square: sample as u32 * across * down,
            shows_material: self
                .shot
                .show
                .sides()
                .map(|mode| u32::from(mode.is_some_and(Mode::shows_material))),
        };
        let uniforms = device.filled("developing", BufferUsages::UNIFORM, &[uniforms])?;
        let buffers = [
            &uniforms,
            first,
            second,
            &self.canvas.radiances,
            &self.canvas.displays,
            &self.canvas.squares,
            &self.canvas.codes,
        ];
        let mut entries: Vec<BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let (mut layout, mut pipeline) = (&layouts.develop, &pipelines.develop);
        if let (Some(colours), Some(responses), Some(textured)) =
            (self.colours(), textures.responses(), &pipelines.textured)
        {
            (layout, pipeline) = (&layouts.develop_textured, &textured.develop);
            let views = (7..).zip([colours, responses]);
            let entry =
                |(binding, view)| BindGroupEntry { binding, resource: BindingResource::TextureView(view) };
            entries.extend(views.map(entry));
        }
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("developing"),
            layout,
            entries: &entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.samples[sample], &[]);
        pass.set_bind_group(1, self.background, &[]);
        pass.set_bind_group(2, &bound, &[]);
        pass.dispatch_workgroups(across, down, 1);
        Ok(())
    }
}

/// Whether a mode reads a map that is drawn for each sample of pixels.
pub(super) fn draws_map(mode: Mode) -> bool {
    mode.looks_up_table() || mode == Mode::ShadowedBruteForce
}

/// A target that a pass begins with zeros.
fn cleared(view: &wgpu::TextureView) -> Option<wgpu::RenderPassColorAttachment<'_>> {
    Some(wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        },
    })
}

/// The bind group of all passes over one sample of each pixel.
fn chosen_sample(
    resources: &Resources,
    canvas: &DeviceCanvas,
    transform: &ViewTransform,
    chosen: [u32; 2],
) -> Result<wgpu::BindGroup, RenderError> {
    let Resources { device, layouts, harmonics, .. } = resources;
    let uniforms = FrameUniforms {
        corner: transform.corner.into(),
        samples: canvas.samples,
        across: transform.across.extend(0.0).into(),
        down: transform.down.extend(0.0).into(),
        size: canvas.size,
        chosen,
    };
    let uniforms = device.filled("a sample of each pixel", BufferUsages::UNIFORM, &[uniforms])?;
    Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("a sample of each pixel"),
        layout: &layouts.frame,
        entries: &[
            BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() },
            BindGroupEntry { binding: 1, resource: BindingResource::TextureView(&canvas.normals) },
            BindGroupEntry { binding: 2, resource: BindingResource::TextureView(&canvas.tangents) },
            BindGroupEntry { binding: 3, resource: harmonics.as_entire_binding() },
        ],
    }))
}

/// A shift in clip coordinates that moves one of a pixel's samples to the pixel's centre.
fn shift(size: [u32; 2], samples: u32, chosen: [u32; 2]) -> Mat4 {
    let aside = |axis: usize| {
        let place = (chosen[axis] as f32 + 0.5) / samples as f32 - 0.5;
        -2.0 * place / size[axis] as f32
    };
    Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::Z, Vec4::new(aside(0), -aside(1), 0.0, 1.0))
}

/// A matrix in WGSL's layout: each column fills four numbers.
fn columns(matrix: Mat3) -> [[f32; 4]; 3] {
    matrix.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0])
}
