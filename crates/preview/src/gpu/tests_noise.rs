use super::*;
use std::sync::Arc;
use crate::*;
fn photo(name: &str) -> Arc<Light> {
    let corpus = std::env::var("SPECULA_CORPUS").unwrap();
    let path = if name == "assets" { format!("{}/../../assets/environments/studio.exr", env!("CARGO_MANIFEST_DIR")) } else { format!("{corpus}/env/cc0/{name}.hdr") };
    let bytes = std::fs::read(path).unwrap();
    let image = containers::read_image(&bytes, &containers::ReadOptions::default()).unwrap().image;
    Arc::new(Light::new(envmap::Environment::from_image(image, envmap::Layout::LatLong, None).unwrap(), None))
}
#[test]
fn noise_table() {
    let mut gpu = Gpu::new().unwrap();
    let gold = brdf::Fresnel::Conductor { n: [0.14, 0.43, 1.4], k: [4.1, 2.4, 1.9] };
    let ggx = |r| brdf::Material::Ggx(brdf::Ggx::new(r, gold, [1.0; 3]).unwrap());
    let only = std::env::var("ONLY").unwrap_or_default();
    for (lname, light) in [("studio", photo("studio")), ("sunrise", photo("sunrise")), ("assets", photo("assets"))] {
        if !only.is_empty() && !only.contains(lname) { continue; }
        for (mname, material) in [("ggx.45", ggx(0.45)), ("ggx.7", ggx(0.7)), ("lambert", brdf::Material::Lambert(brdf::Lambert::new([0.5;3]).unwrap()))] {
            let degree = |l| sh::Degree::new(l).unwrap();
            let brdf = brdf::project(&material, brdf::Choice::Degree { f: degree(19), p: degree(16) }, Stop::NEVER).unwrap().coefficients;
            let transform = sh::Transform::new(light.environment().grid(), degree(19)).unwrap();
            let reflection = shrm::Reflection::convolve(&transform.analyse(light.environment().pixels()), &brdf);
            let sizes = MapSizes { edge: 8, slices: 4 };
            let with = Arc::new(Look::new(Arc::clone(&light), reflection, Some(material.clone()), sizes));
            let without = Arc::new(Look::without_maps(Arc::clone(&light), material.clone(), sizes));
            let mesh = Arc::new(::mesh::shape("sphere").unwrap());
            let side: u32 = std::env::var("SIDE").map_or(64, |s| s.parse().unwrap());
            let shot = |n, scene: &Scene, points| Shot { size: [side, side], samples: 1, camera: Camera::new(scene.framing()),
                turn: sphere::Rotation::IDENTITY, show: Show::One(Mode::BruteForce), background: Background::Environment,
                exposure: 0.0, tone: envmap::ToneMap::Filmic, light_samples: n, points };
            let scenes = [&with, &without].map(|look| Scene::of(Arc::clone(&mesh), Arc::clone(look)));
            let truth = crate::Cpu::new().render(&scenes[0], &shot(16384, &scenes[0], PointSet::Even), Stop::NEVER).unwrap();
            for points in [PointSet::Random, PointSet::Even] {
            for n in [16, 32, 64, 128, 256, 1024] {
                let mut line = format!("{lname} {mname} {points:?} {n:5}: ");
                let mut works = [0.0; 2];
                for (k, scene) in scenes.iter().enumerate() {
                    let mut times = vec![];
                    let mut noise = 0.0;
                    for rep in 0..5 {
                        let mut shot = shot(n, scene, points);
                        shot.camera.yaw += 1e-6 * rep as f64;
                        let t = std::time::Instant::now();
                        let picture = gpu.render(scene, &shot, Stop::NEVER).unwrap();
                        times.push(t.elapsed().as_secs_f64());
                        let (mut e, mut s, mut b) = (0.0, 0.0, 0.0);
                        for (p, q) in picture.radiance.iter().zip(&truth.radiance) {
                            if q[3] < 1.0 || p[3] < 1.0 { continue; }
                            for c in 0..3 { e += f64::from(p[c]-q[c]).powi(2); s += f64::from(q[c]).powi(2); b += f64::from(p[c]-q[c]); }
                        }
                        let _ = b;
                        noise = (e/s).sqrt();
                    }
                    times.sort_by(f64::total_cmp);
                    works[k] = noise*noise*times[2];
                    line += &format!(" noise {:.4} t {:.4}", noise, times[2]);
                }
                println!("{line}  ratio {:.2}", works[1]/works[0]);
            }
            }
        }
    }
}
