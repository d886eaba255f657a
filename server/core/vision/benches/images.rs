//! Lines and board corners of one image: `cargo bench --package sheaf-vision --bench images`. The images are those of
//! the reference station under `SHEAF_DATA`.

use std::hint::black_box;
use std::path::{Path, PathBuf};

use criterion::{Criterion, criterion_group, criterion_main};
use vision::{CentrelineExtractor, CentrelineParams, Centrelines, CornerParams, GreyImage, Pixels, find_corners};

/// An image of the reference station; `path` is relative to `rig-a`.
fn image_file(path: &str) -> GreyImage {
    let data = std::env::var_os("SHEAF_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/data"), PathBuf::from);
    let file = data.join("rig-a").join(path);
    let decoded = image::open(&file)
        .unwrap_or_else(|error| panic!("{}: {error}; set SHEAF_DATA to the data folder", file.display()))
        .into_luma8();
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    GreyImage::new(width, height, Pixels::Eight(decoded.into_raw())).expect("a decoded image has all its pixels")
}

fn lines(criterion: &mut Criterion) {
    let image = image_file("scan-sphere/00020.png");
    let params = CentrelineParams::default();
    let (mut extractor, mut found) = (CentrelineExtractor::default(), Centrelines::default());
    criterion.bench_function("centrelines of the sphere", |bencher| {
        bencher.iter(|| extractor.find(black_box(&image), &params, black_box(&mut found)));
    });
}

fn corners(criterion: &mut Criterion) {
    let image = image_file("board/000.png");
    let board = CornerParams { inner_columns: 11, inner_rows: 8 };
    criterion.bench_function("corners of a board", |bencher| {
        bencher.iter(|| find_corners(black_box(&image), &board));
    });
}

criterion_group!(images, lines, corners);
criterion_main!(images);
