//! `sheaf centrelines` on photographs as hobby rigs take them: noise, overexposure, edges of the scene.

use std::path::Path;

use image::{GrayImage, Luma};
use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use serde_json::Value;

use crate::common::{path, sheaf_json};

const SIZE_PX: [u32; 2] = [640, 320];
/// Full width of the lines at half height.
const WIDTH_PX: f64 = 5.0;

/// An image of these levels with Gaussian noise.
fn noisy(sigma: f64, level: impl Fn(f64, f64) -> f64) -> GrayImage {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    GrayImage::from_fn(SIZE_PX[0], SIZE_PX[1], |u, v| {
        let noise = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        Luma([(level(f64::from(u), f64::from(v)) + sigma * noise).round().clamp(0.0, 255.0) as u8])
    })
}

/// A Gaussian line at a distance.
fn line(distance_px: f64) -> f64 {
    (-(distance_px / WIDTH_PX).powi(2) * 4.0 * 2.0_f64.ln()).exp()
}

/// The answer about an image, and (u, v, σ) of its points.
fn found(image: &GrayImage) -> (Value, Vec<[f64; 3]>) {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("photograph.png"), path(folder.path(), "out"));
    image.save(&file).unwrap();
    let (result, _) = sheaf_json(&["centrelines", file.to_str().unwrap(), "-o", &out]);
    let table = std::fs::read_to_string(Path::new(&out).join("photograph.csv")).unwrap();
    let number = |row: &str, field: usize| row.split(',').nth(field).unwrap().parse().unwrap();
    let points = table.lines().skip(1).map(|row| [0, 1, 2].map(|field| number(row, field))).collect();
    (result["images"][0].clone(), points)
}

/// The text of a finding of an image.
fn finding(image: &Value, kind: &str) -> Option<String> {
    let findings = image["findings"].as_array().unwrap();
    let found = findings.iter().find(|finding| finding["kind"] == kind)?;
    Some(found["text"].as_str().unwrap().to_owned())
}

#[test]
fn a_line_that_noise_hides_column_by_column_is_found_by_averaging_along_it() {
    let middle = |u: f64| 150.0 + 0.02 * u;
    let (image, points) = found(&noisy(14.0, |u, v| 60.0 + 45.0 * line(v - middle(u))));
    let text = finding(&image, "smoothed").expect("the image is noisy");
    assert!(text.contains("5 pixels along the lines were averaged"), "{text}");
    let errors: Vec<[f64; 2]> = points.iter().map(|[u, v, sigma]| [v - middle(*u), *sigma]).collect();
    let on_line = errors.iter().filter(|[error, _]| error.abs() < WIDTH_PX).count();
    assert!(on_line as f64 > 0.9 * f64::from(SIZE_PX[0]), "{on_line} columns");
    assert!(errors.len() - on_line < 10, "{} points elsewhere", errors.len() - on_line);
    let normalised =
        errors.iter().map(|[error, sigma]| (error / sigma).powi(2)).sum::<f64>() / errors.len() as f64;
    println!("{on_line} columns, error/σ {:.2}", normalised.sqrt());
    assert!((0.8..1.25).contains(&normalised.sqrt()), "error/σ {:.2}", normalised.sqrt());
}

#[test]
fn a_line_in_little_noise_is_not_averaged() {
    let (image, points) = found(&noisy(3.0, |_, v| 60.0 + 45.0 * line(v - 150.3)));
    assert!(points.len() > 600 && finding(&image, "smoothed").is_none(), "{image:#}");
}

#[test]
fn overexposed_lines_are_reported() {
    let (image, points) = found(&noisy(2.0, |_, v| 30.0 + 700.0 * line(v - 150.3)));
    let text = finding(&image, "clipped").expect("the line is clipped");
    assert!(points.len() > 600 && text.contains("100 % of the points are clipped"), "{text}");
    let (image, _) = found(&noisy(2.0, |_, v| 30.0 + 150.0 * line(v - 150.3)));
    assert_eq!(finding(&image, "clipped"), None);
}

#[test]
fn what_all_images_have_in_common_is_said_once() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["a.png", "b.png", "c.png"].map(|name| path(folder.path(), name));
    for file in &files {
        noisy(2.0, |_, v| 30.0 + 700.0 * line(v - 150.3)).save(file).unwrap();
    }
    let (result, _) =
        sheaf_json(&["centrelines", &files[0], &files[1], &files[2], "--csv", &path(folder.path(), "")]);
    let warnings = result["warnings"].as_array().unwrap();
    let [warning] = &warnings[..] else { panic!("{warnings:#?}") };
    let text = warning.as_str().unwrap();
    assert!(text.contains("a.png") && text.ends_with("expose shorter; also in 2 other images"), "{text}");
    assert!(result["images"].as_array().unwrap().iter().all(|image| finding(image, "clipped").is_some()));
}

/// An upright laser over a chessboard, whose edges are fainter and run in both directions.
#[test]
fn edges_of_the_scene_do_not_hide_that_the_lines_run_the_other_way() {
    let square = |u: f64, v: f64| f64::from(((u / 40.0) as i32 + (v / 40.0) as i32) % 2);
    let ridge = |at: f64| line((at.rem_euclid(40.0) - 20.0).abs() - 20.0);
    let scene =
        |u: f64, v: f64| 60.0 + 6.0 * square(u, v) + 12.0 * (ridge(u) + ridge(v)) + 120.0 * line(u - 310.0);
    let (image, _) = found(&noisy(1.5, scene));
    let text = finding(&image, "other_direction").unwrap_or_else(|| panic!("{image:#}"));
    assert!(text.contains("--direction columns"), "{text}");
}
