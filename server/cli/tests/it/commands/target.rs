//! `sheaf target`: its files and output.

use crate::common::{path, sheaf, sheaf_json};

#[test]
fn a_board_is_written_at_true_scale_with_its_capture_entry() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(folder.path(), "board.pdf");
    let (made, exit) = sheaf_json(&[
        "target",
        "--kind",
        "charuco",
        "--columns",
        "9",
        "--rows",
        "6",
        "--square-mm",
        "20",
        "-o",
        &file,
    ]);
    assert_eq!(exit, 0, "{made:#}");
    assert_eq!((made["page"].as_str(), made["target"]["marker_mm"].as_f64()), (Some("A4"), Some(14.0)));
    assert_eq!((made["target"]["kind"].as_str(), made["target"]["columns"].as_u64()), (Some("charuco"), Some(9)));
    let pdf = std::fs::read(&file).unwrap();
    let text = String::from_utf8_lossy(&pdf);
    // A4 landscape, and a square of 20 mm, in PDF points.
    for words in ["%PDF-", "/MediaBox [0 0 841.8898 595.27", "56.692917 56.692917 re"] {
        assert!(text.contains(words), "`{words}` is not in:\n{}", &text[..text.len().min(900)]);
    }
}

#[test]
fn a_board_with_too_few_markers_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = path(folder.path(), "board.pdf");
    let output =
        sheaf(&["target", "--kind", "charuco", "--dictionary", "DICT_4X4_50", "--columns", "20", "-o", &file]);
    let message = crate::common::err(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("90 markers") && message.contains("larger dictionary"), "{message}");
}

#[test]
fn a_circle_grid_is_written_and_detected_in_its_image() {
    let folder = tempfile::tempdir().unwrap();
    let (file, image_path) = (path(folder.path(), "grid.pdf"), path(folder.path(), "grid.png"));
    let (made, exit) = sheaf_json(&["target", "--kind", "asymmetric-circles", "--square-mm", "15", "-o", &file]);
    assert_eq!(exit, 0, "{made:#}");
    let target = &made["target"];
    assert_eq!((target["kind"].as_str(), target["columns"].as_u64()), (Some("asymmetric_circles"), Some(4)));
    let radius = target["diameter_mm"].as_f64().unwrap() / 2.0;
    // Three pixels per millimetre, edges two pixels wide.
    let discs: Vec<[f64; 2]> = (0..44)
        .map(|k| [60.0 + 45.0 * f64::from(2 * (k % 4) + k / 4 % 2), 50.0 + 45.0 * f64::from(k / 4)])
        .collect();
    let image = image::GrayImage::from_fn(480, 560, |u, v| {
        let distance = |at: &[f64; 2]| (f64::from(u) - at[0]).hypot(f64::from(v) - at[1]);
        let nearest = discs.iter().map(distance).fold(f64::INFINITY, f64::min);
        image::Luma([(125.0 + 90.0 * (nearest - 3.0 * radius).clamp(-1.0, 1.0)) as u8])
    });
    image.save(&image_path).unwrap();
    let csv = path(folder.path(), "csv");
    let arguments =
        ["corners", &image_path, "--kind", "asymmetric-circles", "--columns", "4", "--rows", "11", "--csv", &csv];
    let (found, exit) = sheaf_json(&arguments);
    assert_eq!((exit, found["images"][0]["n_corners"].as_u64()), (0, Some(44)), "{found:#}");
    let table = std::fs::read_to_string(std::path::Path::new(&csv).join("grid.csv")).unwrap();
    for (line, disc) in table.lines().skip(1).zip(&discs) {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        assert!((numbers[2] - disc[0]).hypot(numbers[3] - disc[1]) < 0.02, "{line}, not {disc:?}");
    }
}
