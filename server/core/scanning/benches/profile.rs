//! Points of a frame after line extraction: `cargo bench --package sheaf-scanning --bench profile`. One frame of a
//! synthetic ribbed sheet, five lines of 1,000 points.

use std::hint::black_box;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use optics::{Hits, Triangulator};
use scanning::Profile;
use scanning::synthetic::SyntheticScan;

/// Points of the frame.
const N_POINTS: usize = 5000;

fn labels(criterion: &mut Criterion) {
    let scan = SyntheticScan::new(1, N_POINTS);
    let lines = scan.frame(0).centrelines;
    let triangulator = Triangulator::new(scan.calibration.clone());
    let range_mm = scan.calibration.depth_range_mm;
    criterion.bench_function("labels and points of a frame", |bencher| {
        let mut profile = Profile::default();
        bencher.iter(|| black_box(&mut profile).fill(black_box(&lines), &triangulator, range_mm));
    });
}

/// One line with filled tables, and with new ones, which call the exact solution.
fn triangulation(criterion: &mut Criterion) {
    let scan = SyntheticScan::new(1, N_POINTS);
    let triangulator = Triangulator::new(scan.calibration.clone());
    let line = &scan.frame(0).centrelines.segments[0];
    let (u_px, v_px): (Vec<f64>, Vec<f64>) = line.points.iter().map(|point| (point.u_px, point.v_px)).unzip();
    let mut group = criterion.benchmark_group("undistortion and triangulation of a line");
    group.throughput(Throughput::Elements(u_px.len() as u64));
    let mut hits = Hits::default();
    group.bench_function("by tables", |bencher| {
        bencher.iter(|| triangulator.triangulate_all(0, black_box(&u_px), &v_px, black_box(&mut hits)));
    });
    group.bench_function("with tables to fill", |bencher| {
        let empty = || Triangulator::new(scan.calibration.clone());
        bencher.iter_batched_ref(
            empty,
            |triangulator| triangulator.triangulate_all(0, black_box(&u_px), &v_px, black_box(&mut hits)),
            BatchSize::LargeInput,
        );
    });
}

criterion_group!(profile, labels, triangulation);
criterion_main!(profile);
