//! `paper/table4/...` and `paper/table5/...`: prefiltering by integration over angles and in spherical
//! harmonics, at the settings of [RH02, sec. 7.4] ([`research::paper`]).
//!
//! Of table 5, `angular` is one map, to be taken 100 times; `shrm` goes from pixels and material to the SHRM;
//! `maps` makes all 100 maps of it, so that the whole frequency side is `shrm` plus `maps`.

use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use research::paper::{TABLE4, TABLE5, Table4, Table5};

/// One of the 100 views: 63 degrees from the central direction, 32 degrees from the normal.
const VIEW: usize = 35;

fn tables(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("paper");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500));
    for row in TABLE4 {
        let case = Table4::new(row.s);
        group.bench_function(format!("table4/angular/{}", row.s), |bencher| bencher.iter(|| case.angular()));
        group.bench_function(format!("table4/frequency/{}", row.s), |bencher| {
            bencher.iter(|| case.frequency())
        });
    }
    for row in TABLE5 {
        let case = Table5::new(row.sigma);
        let shrm = case.shrm();
        let view = case.maps(&shrm).views().directions()[VIEW];
        let name = |part: &str| format!("table5/{part}/{}", row.sigma);
        group.bench_function(name("angular"), |bencher| bencher.iter(|| case.angular(view)));
        group.bench_function(name("shrm"), |bencher| bencher.iter(|| case.shrm()));
        group.bench_function(name("maps"), |bencher| bencher.iter(|| case.maps(&shrm)));
    }
    group.finish();
}

criterion_group!(benches, tables);
criterion_main!(benches);
