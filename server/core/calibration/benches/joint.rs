//! The joint refinement of 15 boards with five lines each: `cargo bench --package sheaf-calibration --bench joint`. The
//! target is 1,000 columns within a second, with a time per point that does not grow with their number;
//! `RAYON_NUM_THREADS=1` measures one thread.

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

use calibration::solver::minimise;
use common::refinement::refinement;

#[allow(dead_code, clippy::unwrap_used)] // The tests use more of it.
#[path = "../tests/it/common/mod.rs"]
mod common;

/// Columns of the image with a point of every line.
const COLUMNS: [usize; 4] = [250, 500, 1000, 2000];

/// Refinements of each size: criterion's minimum, because each takes up to a second.
const SAMPLES: usize = 10;

fn joint_refinement(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("joint refinement");
    group.sample_size(SAMPLES);
    for n_columns in COLUMNS {
        let (bundle, start) = refinement(n_columns);
        group.throughput(Throughput::Elements(bundle.laser.len() as u64));
        group.bench_function(BenchmarkId::new("columns", n_columns), |bencher| {
            bencher.iter_batched(|| start.clone(), |start| minimise(&bundle, start), BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(joint, joint_refinement);
criterion_main!(joint);
