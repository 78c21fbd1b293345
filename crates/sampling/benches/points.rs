//! Points a second, into a slice that stays in the cache.

use std::hint::black_box;
use std::num::NonZeroU32;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use sampling::Points;

const POINTS: usize = 4096;

fn points(criterion: &mut Criterion) {
    let count = NonZeroU32::MIN.saturating_add(999_999);
    let mut group = criterion.benchmark_group("points");
    group.throughput(Throughput::Elements(POINTS as u64));
    for (name, set) in [
        ("random", Points::Random { seed: 1 }),
        ("halton", Points::Halton),
        ("hammersley", Points::Hammersley { count }),
        ("sobol", Points::Sobol { seed: Some(1) }),
        ("sobol unscrambled", Points::Sobol { seed: None }),
    ] {
        let mut block = vec![[0.0; 2]; POINTS];
        let mut first = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                set.fill(black_box(first), &mut block);
                first += POINTS as u64;
                black_box(block[0])
            });
        });
    }
    group.finish();
}

criterion_group!(benches, points);
criterion_main!(benches);
