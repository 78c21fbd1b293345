//! What Bevy shows of the files that `export-engine` and `test-pattern` write for it: the sky, the mirror
//! level, the level of each roughness, and a matte surface, read back from the renderer without a window.
//!
//! run.sh beside this crate makes the files and calls it with their folder: `pattern`, the patterns of
//! `test-pattern`, and `sky`, pattern-orient as `convert --engine bevy` writes it. It ends with 1 if
//! something is farther from what is expected than halves and the filter of a small cube explain.

use std::process::ExitCode;
use std::sync::{Arc, Mutex};

use bevy::asset::{AssetPlugin, LoadState};
use bevy::camera::{Exposure, Hdr, RenderTarget};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::light::{EnvironmentMapLight, Skybox};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::render_resource::{TextureFormat, TextureUsages};

/// Pixels along each edge of the picture.
const SIZE: u32 = 16;

/// The unit of the light in candelas per square metre, as README.txt has it.
const UNIT: f32 = 1000.0;

/// A camera at the origin, and a disk before it that faces it.
struct Stage {
    app: App,
    camera: Entity,
    disk: Entity,
    material: Handle<StandardMaterial>,
    pixels: Arc<Mutex<Vec<u8>>>,
}

impl Stage {
    fn new(folder: &str) -> Self {
        let mut app = App::new();
        let folder = std::fs::canonicalize(folder).expect("the folder of the files");
        app.add_plugins(
            DefaultPlugins
                .set(AssetPlugin { file_path: folder.to_string_lossy().into_owned(), ..default() })
                .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
                .set(WindowPlugin {
                    primary_window: None,
                    exit_condition: bevy::window::ExitCondition::DontExit,
                    ..default()
                }),
        );
        app.insert_resource(ClearColor(Color::BLACK));
        // Bevy adds 80 cd/m2 to every scene otherwise.
        app.insert_resource(GlobalAmbientLight { brightness: 0.0, ..default() });
        while app.plugins_state() == bevy::app::PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();

        let world = app.world_mut();
        let mut target = Image::new_target_texture(SIZE, SIZE, TextureFormat::Rgba32Float, None);
        target.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = world.resource_mut::<Assets<Image>>().add(target);
        let pixels = Arc::new(Mutex::new(Vec::new()));
        let found = pixels.clone();
        world.spawn(Readback::texture(target.clone())).observe(move |event: On<ReadbackComplete>| {
            found.lock().unwrap().clone_from(&event.data);
        });
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
        let circle = world.resource_mut::<Assets<Mesh>>().add(Circle::new(1.0));
        let disk = world
            .spawn((
                Mesh3d(circle),
                MeshMaterial3d(material.clone()),
                Transform::default(),
                Visibility::Hidden,
            ))
            .id();
        let camera = world
            .spawn((
                Camera3d::default(),
                Hdr,
                Msaa::Off,
                Tonemapping::None,
                RenderTarget::Image(target.into()),
                // UNIT becomes 1 in the picture.
                Exposure { ev100: (UNIT / 1.2).log2() },
                Projection::Perspective(PerspectiveProjection { fov: 0.1, ..default() }),
                Transform::default(),
            ))
            .id();
        Self { app, camera, disk, material, pixels }
    }

    fn load(&mut self, name: &str) -> Handle<Image> {
        let server = self.app.world().resource::<AssetServer>().clone();
        let image: Handle<Image> = server.load(name.to_owned());
        loop {
            self.app.update();
            match server.load_state(&image) {
                LoadState::Loaded => return image,
                LoadState::Failed(error) => panic!("{name}: {error}"),
                _ => {}
            }
        }
    }

    /// A cube of one colour.
    fn solid(&mut self, color: Color) -> Handle<Image> {
        let mut images = self.app.world_mut().resource_mut::<Assets<Image>>();
        EnvironmentMapLight::solid_color(&mut images, color).specular_map
    }

    fn light(&mut self, specular_map: &Handle<Image>, diffuse_map: &Handle<Image>) {
        let light = EnvironmentMapLight {
            specular_map: specular_map.clone(),
            diffuse_map: diffuse_map.clone(),
            intensity: UNIT,
            ..default()
        };
        self.app.world_mut().entity_mut(self.camera).insert(light);
    }

    fn show(&mut self, is_disk_shown: bool, change: impl FnOnce(&mut StandardMaterial)) {
        let world = self.app.world_mut();
        let shown = if is_disk_shown { Visibility::Visible } else { Visibility::Hidden };
        world.entity_mut(self.disk).insert(shown);
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        if let Some(mut material) = materials.get_mut(&self.material) {
            change(&mut material);
        }
    }

    /// What is in the middle of the picture if the camera looks in a direction of the world.
    fn look(&mut self, direction: Vec3) -> Vec3 {
        let up = if direction.y.abs() > 0.9 { Vec3::Z } else { Vec3::Y };
        let camera = Transform::default().looking_to(direction, up);
        // A circle's normal is +Z.
        let disk = Transform::from_translation(3.0 * direction).with_rotation(camera.rotation);
        let world = self.app.world_mut();
        world.entity_mut(self.camera).insert(camera);
        world.entity_mut(self.disk).insert(disk);
        // A picture is read back some frames after it was drawn.
        for _ in 0..8 {
            self.app.update();
        }
        let pixels = self.pixels.lock().unwrap();
        let at = 16 * (SIZE / 2 * SIZE + SIZE / 2) as usize;
        let channel = |c: usize| f32::from_le_bytes(pixels[at + 4 * c..][..4].try_into().unwrap());
        Vec3::new(channel(0), channel(1), channel(2))
    }
}

/// What pattern-orient holds in a direction of Bevy's world, in which the centre of a lat-long image lies
/// along +X. A lobe keeps a share of the part that depends on the direction.
fn orient(d: Vec3, kept: f32) -> Vec3 {
    Vec3::splat(2.0) + 1.5 * kept * Vec3::new(-d.z, d.y, d.x)
}

/// The share of a linear function of direction that the GGX lobe of a level keeps, with N = V = R: the mean
/// of the cosine of light that half vectors of density D(h) h.n reflect, weighted by the cosine.
fn kept_by_ggx(roughness: f32) -> f32 {
    const STEPS: usize = 100_000;
    let alpha2 = f64::from(roughness).powi(4);
    if alpha2 == 0.0 {
        return 1.0;
    }
    let (mut sum, mut weights) = (0.0, 0.0);
    for step in 0..STEPS {
        // Half vectors beyond 45 degrees reflect light from below.
        let theta = (step as f64 + 0.5) / STEPS as f64 * std::f64::consts::FRAC_PI_4;
        let cosine = theta.cos();
        let d = alpha2 / (cosine * cosine * (alpha2 - 1.0) + 1.0).powi(2);
        let light = (2.0 * theta).cos();
        let weight = d * cosine * theta.sin() * light;
        weights += weight;
        sum += weight * light;
    }
    (sum / weights) as f32
}

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: bevy-reads-light FOLDER");
        return ExitCode::from(2);
    };
    let mut stage = Stage::new(&folder);
    let mut is_right = true;
    let mut report = |what: &str, error: f32, most: f32| {
        is_right &= error <= most;
        println!("{what}: largest error {error:.1e}{}", if error <= most { "" } else { " WRONG" });
    };
    let directions: Vec<Vec3> = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.91, 0.83, 0.77],
        [-0.97, 0.51, 0.31],
        [0.23, -0.81, 0.97],
    ]
    .into_iter()
    .flat_map(|d| [Vec3::from(d).normalize(), -Vec3::from(d).normalize()])
    .collect();
    let worst = |stage: &mut Stage, scale: Vec3, wanted: &dyn Fn(Vec3) -> Vec3| {
        directions
            .iter()
            .fold(0.0_f32, |worst, d| worst.max((stage.look(*d) / scale - wanted(*d)).abs().max_element()))
    };

    let sky = stage.load("sky/environment-skybox.ktx2");
    let shown = Skybox { image: Some(sky), brightness: UNIT, ..default() };
    stage.app.world_mut().entity_mut(stage.camera).insert(shown);
    report("sky, 0.5 to 3.5", worst(&mut stage, Vec3::ONE, &|d| orient(d, 1.0)), 0.01);
    stage.app.world_mut().entity_mut(stage.camera).remove::<Skybox>();

    let [black, white] = [Color::BLACK, Color::WHITE].map(|color| stage.solid(color));
    let specular = stage.load("pattern/pattern-orient-specular.ktx2");
    let diffuse = stage.load("pattern/pattern-orient-diffuse.ktx2");
    let levels = stage.load("pattern/pattern-lod-specular.ktx2");
    let count = {
        let images = stage.app.world().resource::<Assets<Image>>();
        images.get(&levels).map_or(0, |image| image.texture_descriptor.mip_level_count)
    };
    let metal = |roughness: f32| {
        move |material: &mut StandardMaterial| {
            *material = StandardMaterial {
                base_color: Color::WHITE,
                metallic: 1.0,
                perceptual_roughness: roughness,
                ..default()
            };
        }
    };
    let ahead = Vec3::new(0.36, 0.48, 0.8);
    for roughness in [0.1, 0.3, 0.5, 0.8, 1.0] {
        stage.show(true, metal(roughness));
        stage.light(&white, &black);
        // What a single reflection keeps of white light; Bevy takes the rest of the diffuse map.
        let kept = stage.look(ahead);
        stage.light(&levels, &black);
        let level = stage.look(ahead) / kept - 1.0;
        let wanted = roughness * (count.max(1) - 1) as f32;
        report(
            &format!("level at roughness {roughness}, {wanted:.2}"),
            (level - wanted).abs().max_element(),
            0.02,
        );
        stage.light(&specular, &black);
        // A surface that faces the camera mirrors what is behind it.
        let [below, above] = [wanted.floor(), wanted.ceil()];
        let [sharp, rough] = [below, above].map(|level| kept_by_ggx(level / (count.max(2) - 1) as f32));
        let amplitude = sharp + (wanted - below) * (rough - sharp);
        let error = worst(&mut stage, kept, &|d| orient(-d, amplitude));
        report(&format!("reflection at roughness {roughness}, 0.5 to 3.5"), error, 0.02);
    }
    stage.show(true, |material| {
        *material = StandardMaterial {
            base_color: Color::WHITE,
            metallic: 0.0,
            reflectance: 0.0,
            perceptual_roughness: 1.0,
            ..default()
        };
    });
    stage.light(&black, &white);
    let kept = stage.look(ahead);
    report("white matte surface under white light", (kept - 1.0).abs().max_element(), 0.01);
    stage.light(&black, &diffuse);
    // A cosine keeps two thirds.
    report("white matte surface, 0.5 to 3.5", worst(&mut stage, kept, &|d| orient(-d, 2.0 / 3.0)), 0.02);
    if is_right { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
