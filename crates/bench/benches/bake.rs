//! `bake/flight_helmet`: shadows of a scanned mesh of 55,392 vertices, 1,024 directions, degree 4. The folder
//! of meshes is named by `SPECULA_CORPUS`; without it nothing runs.

use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use sh::{Degree, Stop};
use transfer::{Directions, Frames, Occluders, TransferDegrees, precompute};

fn bake(criterion: &mut Criterion) {
    let Some(corpus) = test_data::folder("bake/flight_helmet", "SPECULA_CORPUS") else { return };
    let folder = corpus.join("mesh/FlightHelmet");
    let file = std::fs::read(folder.join("FlightHelmet.gltf")).expect("the helmet's document");
    let mut beside = |name: &str| -> Result<Arc<Vec<u8>>, containers::Error> {
        Ok(Arc::new(std::fs::read(folder.join(name)).expect("a file beside the document")))
    };
    let mesh = containers::read_gltf(&file, &mut beside).expect("a mesh").mesh;
    let frames = Frames::of(&mesh).expect("orthonormal frames");
    let degree = |l| Degree::new(l).expect("a supported degree");
    let directions = Directions::new(1024, degree(8)).expect("enough directions");
    let above = |vertex: usize| {
        let [x, y, z] = frames.normal(vertex).map(f64::from);
        let is_above = |v: sphere::DVec3| x * v.x + y * v.y + z * v.z > 0.0;
        directions.directions().iter().filter(|direction| is_above(direction.vector())).count()
    };
    let rays: usize = (0..frames.len()).map(above).sum();
    let mut group = criterion.benchmark_group("bake");
    group.sample_size(10).throughput(criterion::Throughput::Elements(rays as u64));
    let occluders = Occluders::of(&mesh);
    group.bench_function("flight_helmet", |bencher| {
        bencher.iter(|| {
            precompute(
                &frames,
                &occluders,
                &directions,
                TransferDegrees { output: degree(4), input: degree(4) },
                Stop::NEVER,
            )
            .expect("a transfer")
        });
    });
    group.finish();
}

criterion_group!(benches, bake);
criterion_main!(benches);
