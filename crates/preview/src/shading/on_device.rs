//! Runs a shader function for many inputs on a graphics device, for tests.

use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, MapMode, PollType};

/// The bindings of group 0: binding 0 has the inputs, binding 1 the results.
const ASKED: &str = "
@group(0) @binding(0) var<storage, read> asked: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> answers: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < arrayLength(&answers) {
        answers[id.x] = vec4f(answer(id.x), 0.0);
    }
}
";

/// A graphics device; without one the test is skipped with a message.
pub(crate) fn device(test: &str) -> Option<(wgpu::Device, wgpu::Queue)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let found = pollster::block_on(async {
        let adapter = instance.request_adapter(&wgpu::RequestAdapterOptions::default()).await.ok()?;
        adapter.request_device(&wgpu::DeviceDescriptor::default()).await.ok()
    });
    if found.is_none() {
        test_data::skip(test, "there is no graphics adapter");
    }
    found
}

/// The results of `fn answer(k: u32) -> vec3f` for each k below `count`. It may read `asked`, and the storage
/// buffers with these contents that `source` declares in group 3, from binding 0 on (empty ones are not
/// bound).
pub(crate) fn answers(
    (device, queue): &(wgpu::Device, wgpu::Queue),
    source: &str,
    asked: &[[f32; 4]],
    count: usize,
    buffers: &[&[u8]],
) -> Vec<[f32; 3]> {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl([source, ASKED].concat().into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let filled = |contents: &[u8]| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: BufferUsages::STORAGE,
        })
    };
    let size = 16 * count as u64;
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let written = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
    let read = buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ);
    let group = |index: u32, buffers: &[(u32, &wgpu::Buffer)]| {
        let entries: Vec<_> = buffers
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(index),
            entries: &entries,
        })
    };
    let asked = filled(bytemuck::cast_slice(asked));
    let given: Vec<_> = buffers.iter().map(|contents| filled(contents)).collect();
    let given: Vec<_> = (0..).zip(&given).filter(|(_, buffer)| buffer.size() > 0).collect();
    let groups = [group(0, &[(0, &asked), (1, &written)]), group(3, &given)];
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &groups[0], &[]);
    pass.set_bind_group(3, &groups[1], &[]);
    pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&written, 0, &read, 0, size);
    queue.submit([encoder.finish()]);
    read.map_async(MapMode::Read, .., |result| result.unwrap());
    device.poll(PollType::wait_indefinitely()).unwrap();
    let range = read.get_mapped_range(..).unwrap();
    let answers: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&range);
    answers.into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}
