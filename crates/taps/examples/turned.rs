use brdf::*;
use containers::{ReadOptions, read_image};
use envmap::{Environment, Layout};
use sh::Stop;
use taps::*;

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let names: Vec<&str> = a[1].split(',').collect();
    let counts: Vec<usize> = a[2].split(',').map(|t| t.parse().unwrap()).collect();
    let environments: Vec<&str> = a[3].split(',').filter(|t| !t.is_empty()).collect();
    let count: usize = a.get(4).map_or(1000, |t| t.parse().unwrap());
    let copper = Fresnel::Conductor { n: [0.27, 0.68, 1.32], k: [3.61, 2.63, 2.29] };
    let widths = Widths::new(std::env::var("EDGE").map_or(64, |t| t.parse().unwrap())).unwrap();
    let loaded: Vec<_> = environments.iter().map(|name| {
        let bytes = std::fs::read(format!("/work/shared/corpus/env/cc0/{name}.hdr")).unwrap();
        let image = read_image(&bytes, &ReadOptions::default()).unwrap().image;
        let environment = Environment::from_image(image, Layout::LatLong, None).unwrap();
        let lamps = environment.separate_lamps(Stop::NEVER).unwrap().lights;
        let space = ScaleSpace::new(&environment, &lamps[..std::env::var("LIGHTS").map_or(8, |t| t.parse().unwrap()).min(lamps.len())], widths, Stop::NEVER).unwrap();
        (LightPoints::new(&environment).unwrap(), space)
    }).collect();
    for name in names {
        let material = match name {
            "copper" => Material::Ggx(Ggx::stretched([0.25, 0.55], copper, [1.0; 3]).unwrap()),
            "copper2" => Material::Ggx(Ggx::stretched([0.3, 0.5], copper, [1.0; 3]).unwrap()),
            "round" => Material::Ggx(Ggx::new(0.4, copper, [1.0; 3]).unwrap()),
            "gloss" => Material::Ggx(Ggx::stretched([0.25, 0.55], Fresnel::Dielectric(1.5), [1.0; 3]).unwrap()),
            "ward" => Material::Ward(Ward::new([0.15, 0.4], [0.6, 0.5, 0.3]).unwrap()),
            "ward2" => Material::Ward(Ward::new([0.25, 0.55], [0.6, 0.5, 0.3]).unwrap()),
            "brass" => Material::AshikhminShirley(AshikhminShirley::new([60.0, 6.0], [0.0; 3], [0.8, 0.62, 0.28]).unwrap()),
            "as" => Material::AshikhminShirley(AshikhminShirley::new([100.0, 10.0], [0.1, 0.2, 0.3], [0.05; 3]).unwrap()),
            "pf" => Material::PoulinFournier(PoulinFournier::new(60.0, [0.0; 3], [0.5; 3], 2.0, 1.0).unwrap()),
            "pf2" => Material::PoulinFournier(PoulinFournier::new(60.0, [0.1; 3], [0.5; 3], 3.0, 0.1).unwrap()),
            _ => panic!(),
        };
        let truths: Vec<_> = loaded.iter().map(|(points, _)| Truth::turned(points, &material, count, Stop::NEVER).unwrap()).collect();
        let mean = fit(&material, 6, widths, Stop::NEVER).unwrap();
        let line: Vec<_> = loaded.iter().zip(&truths).map(|((_, space), truth)| {
            let e = truth.error(&mean.table, space, &material);
            format!("{:.3}/{:.3}", e.p95, e.p99)
        }).collect();
        println!("| {name} | mean | {} |", line.join(" | "));
        for taps in &counts {
            let start = std::time::Instant::now();
            let fitted = fit_facets(&material, *taps, widths, Stop::NEVER).unwrap();
            let took = start.elapsed();
            let line: Vec<_> = loaded.iter().zip(&truths).map(|((_, space), truth)| {
                let e = truth.error_of_facets(&fitted.table, space, &material);
                format!("{:.3}/{:.3}", e.p95, e.p99)
            }).collect();
            println!("| {name} | {taps} | {:.4} {:.2?} | {} |", fitted.rms, took, line.join(" | "));
        }
    }
}
