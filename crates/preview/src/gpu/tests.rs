use std::sync::Arc;

use brdf::{Choice, Lambert, Material, project};
use envmap::{Environment, ToneMap};
use sh::{Degree, Stop, Transform};
use shrm::Reflection;
use sphere::{LatLong, Rotation};

use super::*;
use crate::shading::material::all_models;
use crate::shading::product_samples;
use crate::shading::product_tables::{CELLS, ProductTables, ViewAxes};
use crate::{Background, Light, Look, MapSizes};

/// A device; without one the test is skipped with a message.
fn gpu(test: &str) -> Option<Gpu> {
    if Gpu::adapters().is_empty() {
        test_data::skip(test, "there is no graphics adapter");
        return None;
    }
    Some(Gpu::new().unwrap())
}

fn light() -> Arc<Light> {
    let grid = LatLong::with_rows(16);
    let pixel = |k: usize| [0.2 + (k % 7) as f32 / 7.0, 0.5, 0.1 * (k / grid.width) as f32];
    let pixels = (0..grid.len()).map(pixel).collect();
    Arc::new(Light::new(Environment::new(grid, pixels).unwrap(), None))
}

fn look(light: &Arc<Light>, sizes: MapSizes) -> Arc<Look> {
    let grey = Material::Lambert(Lambert::new([0.5; 3]).unwrap());
    let degree = Degree::new(3).unwrap();
    let coefficients =
        project(&grey, Choice::Degree { f: degree, p: Degree::ZERO }, Stop::NEVER).unwrap().coefficients;
    let transform = Transform::new(light.environment().grid(), degree).unwrap();
    let reflection = Reflection::convolve(&transform.analyse(light.environment().pixels()), &coefficients);
    Arc::new(Look::new(Arc::clone(light), reflection, Some(grey), sizes))
}

fn scene() -> Scene {
    let mesh = Arc::new(::mesh::shape("torus-knot").unwrap());
    Scene::of(mesh, look(&light(), MapSizes { edge: 8, slices: 4 }))
}

fn shot(scene: &Scene, mode: Mode) -> Shot {
    Shot {
        size: [60, 44],
        samples: 1,
        camera: Camera::new(scene.framing()),
        turn: Rotation::IDENTITY,
        show: Show::One(mode),
        background: Background::Environment,
        exposure: 0.0,
        tone: ToneMap::Filmic,
        light_samples: 12,
        points: PointSet::Even,
    }
}

fn target(gpu: &Gpu, size: [u32; 2]) -> wgpu::TextureView {
    let [width, height] = size.map(u64::from);
    let device = &gpu.resources.device;
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
    let texture = device.texture("a target", Gpu::TARGET, usage, [width, height, 1]).unwrap();
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

#[test]
fn a_destroyed_device_is_an_error_of_every_call() {
    let Some(mut gpu) = gpu("a_destroyed_device_is_an_error_of_every_call") else { return };
    let scene = scene();
    let shot = shot(&scene, Mode::LocalShrm);
    let target = target(&gpu, shot.size);
    assert!(gpu.render(&scene, &shot, Stop::NEVER).is_ok());
    assert!(gpu.draw(&scene, &shot, &target).is_ok());
    gpu.resources.device.device.destroy();
    for _ in 0..2 {
        let of_the_device =
            |error: RenderError| matches!(error, RenderError::Device(message) if message.contains("lost"));
        assert!(of_the_device(gpu.render(&scene, &shot, Stop::NEVER).unwrap_err()));
        assert!(of_the_device(gpu.draw(&scene, &shot, &target).unwrap_err()));
    }
}

#[test]
fn exceeded_limits_are_errors_before_anything_is_allocated() {
    let Some(mut gpu) = gpu("exceeded_limits_are_errors_before_anything_is_allocated") else { return };
    let scene = scene();
    let limits = gpu.resources.device.device.limits();
    let wide = limits.max_texture_dimension_2d + 1;
    let shot = Shot { size: [wide, 1], ..shot(&scene, Mode::Mirror) };
    let limit = u64::from(limits.max_texture_dimension_2d);
    match gpu.render(&scene, &shot, Stop::NEVER).unwrap_err() {
        RenderError::Limit { what, asked, limit: allowed } => {
            assert_eq!((asked, allowed), (limit + 1, limit), "{what}");
        }
        other => panic!("{other}"),
    }
    // The device still works.
    assert!(gpu.render(&scene, &Shot { size: [8, 8], ..shot }, Stop::NEVER).is_ok());
}

/// A device with exactly the required limits is sufficient, and one with lower limits is not.
#[test]
fn a_device_with_the_required_limits_is_sufficient() {
    let Some(adapter) = device::adapters().into_iter().next() else {
        return test_data::skip(
            "a_device_with_the_required_limits_is_sufficient",
            "there is no graphics adapter",
        );
    };
    let made = |lower: fn(&mut wgpu::Limits)| {
        let mut limits = wgpu::Limits {
            max_storage_buffers_per_shader_stage: device::STORAGE_BUFFERS,
            max_bind_groups: device::BIND_GROUPS,
            max_color_attachment_bytes_per_sample: device::COLOUR_BYTES,
            max_compute_invocations_per_workgroup: device::GROUP * device::GROUP,
            ..adapter.limits()
        };
        lower(&mut limits);
        let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..device::descriptor(&adapter) };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).unwrap();
        let device = Device::new(adapter.get_info(), device, queue);
        let resources = device.guarded(|| {
            let mut resources = Resources::new(device.clone(), Gpu::TARGET)?;
            let Resources { pipelines, layouts, .. } = &mut resources;
            Mode::ALL.into_iter().for_each(|mode| pipelines.prepare(layouts, mode, all_models()));
            pipelines.prepare_textured(layouts);
            Ok(())
        });
        resources.map_err(|error| error.to_string())
    };
    assert_eq!(made(|_| {}), Ok(()));
    for lower in [
        (|limits| limits.max_storage_buffers_per_shader_stage -= 1) as fn(&mut wgpu::Limits),
        |limits| limits.max_bind_groups -= 1,
        |limits| limits.max_color_attachment_bytes_per_sample -= 1,
        |limits| limits.max_compute_invocations_per_workgroup -= 1,
    ] {
        assert!(made(lower).is_err());
    }
}

#[test]
fn every_adapter_is_tried() {
    let names = Gpu::adapters();
    let tried = std::cell::Cell::new(0);
    let reject = |device: Device| {
        tried.set(tried.get() + 1);
        Err::<(), _>(device.error("it is not wanted"))
    };
    let message = Device::best(reject).unwrap_err().to_string();
    assert_eq!(message.matches("it is not wanted").count(), tried.get());
    assert!(names.iter().all(|name| message.contains(name)), "{message} {names:?}");
}

#[test]
fn a_texture_of_too_many_bytes_exceeds_the_limits() {
    let Some(gpu) = gpu("a_texture_of_too_many_bytes_exceeds_the_limits") else { return };
    let device = &gpu.resources.device;
    let side = u64::from(device.device.limits().max_texture_dimension_2d);
    let usage = wgpu::TextureUsages::TEXTURE_BINDING;
    let error = device.texture("a large map", memory::TEXELS, usage, [side, side, 48]).unwrap_err();
    assert!(
        matches!(&error, RenderError::Limit { asked, limit, .. } if (*asked, *limit) == (16 * 48 * side * side, 2 << 30)),
        "{error}"
    );
}

/// A map has six layers for each row: more than any device allows.
#[test]
fn a_map_of_too_many_rows_exceeds_the_limits() {
    let Some(mut gpu) = gpu("a_map_of_too_many_rows_exceeds_the_limits") else { return };
    let p = Degree::new(20).unwrap();
    let layers = 6 * p.rows() as u64;
    let most = u64::from(gpu.resources.device.device.limits().max_texture_array_layers);
    if layers <= most {
        return test_data::skip(
            "a_map_of_too_many_rows_exceeds_the_limits",
            "this device has that many layers",
        );
    }
    let grid = shrm::MapGrid::Cube(sphere::Cube { edge: 2 });
    let values = vec![[0.0; 3]; grid.len() * p.rows()];
    let (view, centre, terms) = (shrm::View::Local, brdf::Centre::Reflection, shrm::Terms::All);
    let map = shrm::Shrm::new(grid, view, centre, p, terms, values).unwrap();
    let light = light();
    let look = Arc::new(Look::from_map(Arc::clone(&light), map, None, MapSizes { edge: 2, slices: 2 }));
    let scene = Scene::of(Arc::new(::mesh::shape("plane").unwrap()), look);
    let error = gpu.render(&scene, &shot(&scene, Mode::LocalShrm), Stop::NEVER).unwrap_err();
    assert!(
        matches!(&error, RenderError::Limit { asked, limit, .. } if (*asked, *limit) == (layers, most)),
        "{error}"
    );
}

#[test]
fn empty_scenes_and_pictures_are_drawn() {
    let Some(mut gpu) = gpu("empty_scenes_and_pictures_are_drawn") else { return };
    let empty = Arc::new(::mesh::Mesh::new(vec![], vec![], vec![], None, vec![]).unwrap());
    let alone =
        ::mesh::Mesh::new(vec![[0.0; 3]], vec![[0.0, 0.0, 1.0]], vec![[1.0, 0.0, 0.0, 1.0]], None, vec![]);
    let full = scene();
    let none = Scene { light: Arc::clone(&full.light), objects: vec![] };
    let look = &full.objects[0].look;
    for scene in
        [Scene::of(empty, Arc::clone(look)), Scene::of(Arc::new(alone.unwrap()), Arc::clone(look)), none]
    {
        for mode in [Mode::LocalShrm, Mode::GlobalShrm, Mode::BruteForce] {
            let shot = shot(&scene, mode);
            let picture = gpu.render(&scene, &shot, Stop::NEVER).unwrap();
            assert!(picture.radiance.iter().all(|pixel| pixel[3] == 0.0 && pixel[0] > 0.0));
        }
    }
    for size in [[0, 0], [0, 7], [7, 0]] {
        let shot = Shot { size, ..shot(&full, Mode::Mirror) };
        let picture = gpu.render(&full, &shot, Stop::NEVER).unwrap();
        assert!(picture.size == size && picture.codes.is_empty() && picture.radiance.is_empty());
        assert_eq!(gpu.draw(&full, &shot, &target(&gpu, [1, 1])).unwrap(), DrawProgress::default());
    }
}

#[test]
fn unused_resources_are_dropped() {
    let Some(mut gpu) = gpu("unused_resources_are_dropped") else { return };
    let counts = |gpu: &Gpu| {
        let Resources { meshes, looks, lights, .. } = &gpu.resources;
        [meshes.len(), looks.len(), lights.len()]
    };
    let first = scene();
    let mut both = first.clone();
    both.objects.extend(scene().objects);
    let render =
        |gpu: &mut Gpu, scene: &Scene| gpu.render(scene, &shot(scene, Mode::LocalShrm), Stop::NEVER).unwrap();
    render(&mut gpu, &both);
    assert_eq!(counts(&gpu), [2, 2, 2]);
    let again = render(&mut gpu, &first);
    assert_eq!(counts(&gpu), [1, 1, 1]);
    assert_eq!(again, render(&mut gpu, &first));
    let other = scene();
    render(&mut gpu, &other);
    assert_eq!(counts(&gpu), [1, 1, 1]);
    assert!(gpu.resources.meshes.get(&first.objects[0].mesh).is_none());
}

#[test]
fn a_picture_is_cancelled() {
    let Some(mut gpu) = gpu("a_picture_is_cancelled") else { return };
    let scene = scene();
    let calls = std::sync::atomic::AtomicU32::new(0);
    let stop = || calls.fetch_add(1, std::sync::atomic::Ordering::Relaxed) >= 2;
    let shot = Shot { light_samples: u32::MAX, ..shot(&scene, Mode::BruteForce) };
    assert_eq!(gpu.render(&scene, &shot, Stop::when(&stop)), Err(RenderError::Cancelled));
}

/// A picture refined over several calls equals one drawn at once, with samples of the product and without.
/// The tables of another view are made again.
#[test]
fn brute_force_accumulates_while_the_view_stays() {
    let Some(mut gpu) = gpu("brute_force_accumulates_while_the_view_stays") else { return };
    let scene = scene();
    let show = Show::Difference { of: Mode::LocalShrm, from: Mode::BruteForce, amplify: 1.0 };
    let plain = Shot { show, samples: 2, ..shot(&scene, Mode::BruteForce) };
    let target = target(&gpu, plain.size);
    for light_samples in [12, 100] {
        let shot = Shot { light_samples, ..plain.clone() };
        assert_eq!(product_samples::is_worth(&shot), light_samples == 100);
        assert_draws_as_it_renders(&mut gpu, &scene, &shot, &target);
        // Another exposure keeps the light samples, another view does not.
        let brighter = Shot { exposure: 1.0, ..shot.clone() };
        assert_eq!(gpu.draw(&scene, &brighter, &target).unwrap().light_samples, light_samples);
        let mut turned = shot.clone();
        turned.camera.yaw += 0.1;
        // A fast device would draw all of them at once.
        gpu.sample_budget = SampleBudget::default();
        assert_eq!(gpu.draw(&scene, &turned, &target).unwrap().light_samples, 1);
        assert_draws_as_it_renders(&mut gpu, &scene, &turned, &target);
    }
}

/// Draws until a picture is finished: its RMS is that of one rendered at once, by a renderer that has drawn
/// nothing before.
fn assert_draws_as_it_renders(gpu: &mut Gpu, scene: &Scene, shot: &Shot, target: &wgpu::TextureView) {
    let start = std::time::Instant::now();
    let mut last = DrawProgress::default();
    loop {
        let drawn = gpu.draw(scene, shot, target).unwrap();
        assert!(
            drawn.light_samples >= last.light_samples.max(1) && drawn.light_samples <= shot.light_samples
        );
        last = drawn;
        if !drawn.unfinished {
            break;
        }
        assert!(start.elapsed().as_secs() < 300, "it never ends: {drawn:?}");
    }
    assert_eq!(last.light_samples, shot.light_samples);
    let whole = Gpu::new().unwrap().render(scene, shot, Stop::NEVER).unwrap();
    let (found, expected) = (last.relative_rms.unwrap(), whole.relative_rms.unwrap());
    // Partial sums of other lengths: rounding of f32.
    assert!((found - expected).abs() < 1e-5 * expected, "{found} {expected}");
}

/// A look of rough gold in a dim room with windows.
fn gold_in_a_room() -> Arc<Look> {
    let grid = LatLong::with_rows(48);
    let pixel = |k: usize| {
        let w = grid.direction(k / grid.width, k % grid.width).vector();
        let pane = (5.0 * w.x + 1.0).sin() > 0.6 && (4.0 * w.z).cos() > 0.3 && w.y > -0.4;
        [0.2, 0.2, 0.3].map(|dim| if pane { 30.0 } else { dim })
    };
    let room = Environment::new(grid, (0..grid.len()).map(pixel).collect()).unwrap();
    let light = Arc::new(Light::new(room, None));
    let gold = brdf::Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
    let gold = Material::Ggx(brdf::Ggx::new(0.45, gold, [1.0; 3]).unwrap());
    let choice = Choice::Degree { f: Degree::new(19).unwrap(), p: Degree::new(16).unwrap() };
    let coefficients = project(&gold, choice, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection::convolve(light.lighting(), &coefficients);
    Arc::new(Look::new(light, reflection, Some(gold), MapSizes { edge: 8, slices: 4 }))
}

/// The tables that the device makes are those of the twin, but for texels of lobes at whose edge a rounded
/// direction lies, and those of a view that was drawn before.
#[test]
fn the_tables_of_the_product_match_their_twin() {
    let Some(gpu) = gpu("the_tables_of_the_product_match_their_twin") else { return };
    let Resources { device, layouts, pipelines, .. } = &gpu.resources;
    let (look, tables) = (gold_in_a_room(), |look: &Look| ProductTables::new(look).unwrap());
    let mut buffer = product::ProductBuffer::new(device, layouts, tables(&look)).unwrap();
    let expected = tables(&look);
    for view in [glam::Vec3::Z, glam::Vec3::new(0.48, -0.36, -0.8)] {
        buffer.update(device, pipelines, view);
        let readback = Readback::start(device, &buffer.buffer).unwrap();
        device.wait().unwrap();
        let found = readback.take::<f32>(device).unwrap();
        let axes = ViewAxes::new(view);
        let header = expected.header(axes);
        assert_eq!(found[..header.len()], header);
        let cells = found[header.len() + expected.fixed().len()..].chunks_exact(expected.stride());
        let (mut apart, mut count) = (0, 0);
        for (cell, found) in cells.take((CELLS * CELLS) as usize).enumerate() {
            // A cell whose middle is in the disc of normals that face the viewer.
            let middle = |place: usize| (place as f32 + 0.5) * 2.0 / CELLS as f32 - 1.0;
            if middle(cell % CELLS as usize).hypot(middle(cell / CELLS as usize)) > 1.0 {
                continue;
            }
            for (found, expected) in found.iter().zip(expected.table(axes, cell)) {
                apart += usize::from((found - expected).abs() > 1e-5);
                count += 1;
            }
        }
        assert!(count > (CELLS * CELLS) as usize * expected.stride() * 3 / 4, "{count}");
        assert!(apart < count / 100, "{apart} of {count}");
    }
}

/// Pictures of two sizes, whose pixels have other points. The oracle has many even points and follows no
/// product, nor do the pictures that the noise is compared with.
#[test]
fn pictures_by_the_product_have_a_third_of_the_noise_and_the_same_mean() {
    let test = "pictures_by_the_product_have_a_third_of_the_noise_and_the_same_mean";
    let Some(mut gpu) = gpu(test) else { return };
    let look = gold_in_a_room();
    let plain = Look::without_maps(Arc::clone(look.light()), look.material().unwrap().clone(), look.sizes());
    let ball = Arc::new(::mesh::shape("sphere").unwrap());
    let [followed, plain] = [look, Arc::new(plain)].map(|look| Scene::of(Arc::clone(&ball), look));
    for mode in [Mode::BruteForce, Mode::ShadowedBruteForce] {
        let (mut squares, mut error_sum, mut truth_sum) = ([0.0; 2], 0.0, 0.0);
        for side in [32, 37] {
            let shot = Shot {
                size: [side, side],
                light_samples: 256,
                points: PointSet::Random,
                ..shot(&plain, mode)
            };
            let many = Shot {
                light_samples: 1 << 14,
                points: PointSet::Even,
                show: Show::One(Mode::BruteForce),
                ..shot.clone()
            };
            let truth = crate::Cpu::new().render(&plain, &many, Stop::NEVER).unwrap();
            for (place, scene) in [&followed, &plain].into_iter().enumerate() {
                let picture = gpu.render(scene, &shot, Stop::NEVER).unwrap();
                for (found, truth) in picture.radiance.iter().zip(&truth.radiance) {
                    if found[3] < 1.0 || truth[3] < 1.0 {
                        continue;
                    }
                    let all = |radiance: &[f32; 4]| radiance[..3].iter().map(|v| f64::from(*v)).sum::<f64>();
                    let error = all(found) - all(truth);
                    squares[place] += error * error;
                    if place == 0 {
                        error_sum += error;
                        truth_sum += all(truth);
                    }
                }
            }
        }
        let [by_product, without] = squares.map(f64::sqrt);
        assert!(3.0 * by_product < without, "{mode:?}: {by_product} {without}");
        // Errors of pixels are independent: their sum is within 4 of its deviations, and the truth's 0.1 %.
        let allowed = 4.0 * by_product + 1e-3 * truth_sum;
        assert!(f64::abs(error_sum) < allowed, "{mode:?}: {error_sum} {by_product} {truth_sum}");
    }
}

/// Tables of a shot with many samples are not followed by one with few.
#[test]
fn few_samples_follow_no_product() {
    let Some(mut gpu) = gpu("few_samples_follow_no_product") else { return };
    let scene = Scene::of(Arc::new(::mesh::shape("sphere").unwrap()), gold_in_a_room());
    let few = Shot { light_samples: 200, ..shot(&scene, Mode::BruteForce) };
    let many = Shot { light_samples: 300, ..few.clone() };
    let before = gpu.render(&scene, &few, Stop::NEVER).unwrap();
    let by_product = gpu.render(&scene, &many, Stop::NEVER).unwrap();
    assert_eq!(gpu.render(&scene, &few, Stop::NEVER).unwrap(), before);
    assert_eq!(gpu.render(&scene, &many, Stop::NEVER).unwrap(), by_product);
}

/// Compares the codes that are presented in the columns of the diagram with those that the CPU draws, before
/// and after a mode that a shader draws, and beside one.
#[test]
fn a_diagram_is_presented_as_the_cpu_draws_it() {
    let Some(mut gpu) = gpu("a_diagram_is_presented_as_the_cpu_draws_it") else { return };
    let scene = scene();
    let target = target(&gpu, [60, 44]);
    let split = |left, right| Show::Split { left, right, at: 0.5 };
    for (show, columns) in [
        (Show::One(Mode::Samples), 0..60),
        (Show::One(Mode::Mirror), 0..0),
        (split(Mode::Samples, Mode::Mirror), 0..30),
        (split(Mode::LocalShrm, Mode::Samples), 30..60),
        (Show::One(Mode::Samples), 0..60),
    ] {
        let shot = Shot { show, ..shot(&scene, Mode::Samples) };
        let drawn = gpu.draw(&scene, &shot, &target).unwrap();
        assert_eq!((drawn.light_samples, drawn.unfinished), (0, false));
        let device = gpu.resources.device.clone();
        let readback = Readback::start(&device, &gpu.canvas.as_ref().unwrap().codes).unwrap();
        device.wait().unwrap();
        let found = readback.take::<[u8; 4]>(&device).unwrap();
        let expected = crate::Cpu::new().render(&scene, &shot, Stop::NEVER).unwrap().codes;
        for (place, ([red, green, blue, alpha], expected)) in found.into_iter().zip(expected).enumerate() {
            if columns.contains(&(place % 60)) {
                assert_eq!(([red, green, blue], alpha), (expected, 255), "{show:?} {place}");
            }
        }
    }
}

#[test]
fn the_target_has_the_size_and_format_of_the_picture() {
    let Some(mut gpu) = gpu("the_target_has_the_size_and_format_of_the_picture") else { return };
    let scene = scene();
    let wrong = target(&gpu, [61, 44]);
    let error = gpu.draw(&scene, &shot(&scene, Mode::Mirror), &wrong).unwrap_err();
    assert!(error.to_string().contains("61 x 44") && error.to_string().contains("60 x 44"), "{error}");
}

#[test]
fn every_shader_is_valid() {
    for (name, source) in shader_sources::sources() {
        let module = wgpu::naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&source)));
        use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
        let info = validator
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&source)));
        translate(&name, &module, &info);
    }
}

/// The shaders for Direct3D 12 and OpenGL. wgpu includes Metal's language only on Apple's systems.
#[cfg(any(target_os = "linux", target_os = "windows"))]
fn translate(name: &str, module: &wgpu::naga::Module, info: &wgpu::naga::valid::ModuleInfo) {
    use wgpu::naga::back::{glsl, hlsl};
    let mut text = String::new();
    let (options, whole) = (hlsl::Options::default(), hlsl::PipelineOptions { entry_point: None });
    let written = hlsl::Writer::new(&mut text, &options, &whole).write(module, info, None).map(|_| ());
    written.unwrap_or_else(|error| panic!("{name} in HLSL: {error}"));
    for entry in &module.entry_points {
        let options = glsl::Options::default();
        let one = glsl::PipelineOptions {
            shader_stage: entry.stage,
            entry_point: entry.name.clone(),
            multiview: None,
        };
        let policies = wgpu::naga::proc::BoundsCheckPolicies::default();
        let writer = glsl::Writer::new(&mut text, module, info, &options, &one, policies);
        let written = writer.and_then(|mut writer| writer.write().map(|_| ()));
        written.unwrap_or_else(|error| panic!("{name} in GLSL: {error}"));
    }
    assert!(text.contains("#version 310 es"), "{text}");
}

#[cfg(not(any(target_os = "linux", target_os = "windows")))]
fn translate(_: &str, _: &wgpu::naga::Module, _: &wgpu::naga::valid::ModuleInfo) {}

#[test]
fn enumerations_have_the_same_numbers_in_shaders() {
    let sources = shader_sources::sources();
    for (name, value) in crate::shading::numbers::ALL {
        let definition = format!("const {name} = {value}u;");
        assert!(sources.iter().any(|(_, source)| source.contains(&definition)), "no {definition}");
    }
}

/// Every shader of `shading` has a twin and is part of some shader of the device.
#[test]
fn every_shader_has_its_twin() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shading");
    let sources = shader_sources::sources();
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "wgsl") {
            continue;
        }
        count += 1;
        assert!(path.with_extension("rs").exists(), "{} has no twin", path.display());
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(sources.iter().any(|(_, source)| source.contains(&text)), "{} is not used", path.display());
    }
    assert!(count >= 14, "{count} shaders");
}

/// The CPU's picture is the oracle, each time by a renderer that has drawn nothing before.
#[test]
fn the_light_is_brought_to_the_vertices_only_if_it_moved() {
    let Some(mut gpu) = gpu("the_light_is_brought_to_the_vertices_only_if_it_moved") else { return };
    let grey = Material::Lambert(Lambert::new([0.5; 3]).unwrap());
    let (table, _) = brdf::tabulate(&grey, Degree::new(3).unwrap(), 16, Stop::NEVER).unwrap();
    let look = Look::without_maps(light(), grey, MapSizes { edge: 8, slices: 4 });
    let mesh = Arc::new(::mesh::shape("torus-knot").unwrap());
    let scene = Scene::of(mesh, Arc::new(look.with_table(Some(Arc::new(table)))));
    let mut shot = shot(&scene, Mode::Table);
    let mut expect = |shot: &Shot, passes| {
        let found = gpu.render(&scene, shot, Stop::NEVER).unwrap();
        let expected = crate::Cpu::new().render(&scene, shot, Stop::NEVER).unwrap();
        let error = found.difference(&expected, 1.0, shot).relative_rms.unwrap();
        assert!(error < crate::SAME_PICTURE.relative_rms, "{error}");
        assert_eq!(gpu.light_passes(), passes);
    };
    expect(&shot, 1);
    shot.camera.yaw += 0.3;
    expect(&shot, 1);
    shot.turn = Rotation::from_yaw_pitch_roll(0.4, 0.1, 0.0);
    expect(&shot, 2);
    shot.exposure += 1.0;
    expect(&shot, 2);
    shot.camera.yaw += 0.3;
    shot.turn = Rotation::IDENTITY;
    expect(&shot, 3);
}
