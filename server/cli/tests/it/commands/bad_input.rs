//! Bad input is refused with an exit code and a message with place and remedy.
//!
//! Not shown here: results from valid input; see `contract.rs` and `rig_a.rs`.

use std::path::Path;

use crate::common::{copy_of_small, edit_manifest, err, path, replace, sheaf, sheaf_json, small_calibration};
use image::{DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma};
use serde_json::json;

const BAD_INPUT: i32 = 3;
const INSUFFICIENT_DATA: i32 = 4;

/// Asserts that calibrating the damaged capture ends with `exit` and a message with all of `words` and a remedy.
#[track_caller]
fn refused(damage: impl FnOnce(&Path), exit: i32, words: &[&str]) {
    let copy = copy_of_small();
    damage(copy.path());
    let output_file = path(copy.path(), "cal.json");
    let output = sheaf(&["calibrate", copy.path().to_str().unwrap(), "-o", &output_file, "--quiet"]);
    let message = err(&output);
    assert_eq!(output.status.code(), Some(exit), "{message}");
    for word in words.iter().chain(&["error: ", "remedy: "]) {
        assert!(message.contains(word), "`{word}` is not in:\n{message}");
    }
    assert!(output.stdout.is_empty(), "a refusal leaves stdout empty");
    assert!(!Path::new(&output_file).exists(), "a refusal leaves no document");
}

fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn open(folder: &Path, name: &str) -> GrayImage {
    image::open(folder.join(name)).unwrap().into_luma8()
}

#[test]
fn a_missing_image() {
    let damage = |folder: &Path| std::fs::remove_file(folder.join("laser/002.png")).unwrap();
    refused(damage, BAD_INPUT, &["laser/002.png", "poses[2].laser", "restore"]);
}

#[test]
fn a_truncated_png() {
    let damage = |folder: &Path| {
        let bytes = std::fs::read(folder.join("board/001.png")).unwrap();
        replace(folder, "board/001.png", &bytes[..bytes.len() / 2]);
    };
    refused(damage, BAD_INPUT, &["board/001.png", "poses[1].board", "truncated", "record it again"]);
}

#[test]
fn a_board_of_the_wrong_size() {
    let damage = |folder: &Path| {
        edit_manifest(folder, |manifest| manifest["target"]["inner_columns"] = json!(9));
    };
    let words = ["board/000.png", "poses[0].board", "11×8", "expected 9×8", "target.inner_columns"];
    refused(damage, BAD_INPUT, &words);
}

#[test]
fn two_poses_only() {
    let damage = |folder: &Path| {
        edit_manifest(folder, |manifest| {
            manifest["poses"].as_array_mut().unwrap().truncate(2);
            manifest["stage_views"] = json!([]);
        });
    };
    refused(damage, INSUFFICIENT_DATA, &["got 2", "add poses", "capture.json"]);
}

#[test]
fn all_boards_parallel() {
    let damage = |folder: &Path| {
        edit_manifest(folder, |manifest| {
            // The board on the stage keeps its direction.
            let boards: Vec<_> = (0..5).map(|idx| json!({ "board": format!("stage/{idx:03}.png") })).collect();
            manifest["poses"] = json!(boards);
            manifest["stage_views"] = json!([]);
        });
    };
    refused(damage, INSUFFICIENT_DATA, &["focal length is unobservable", "parallel", "tilt the board"]);
}

/// Darkens the laser images from the third on.
fn darken(folder: &Path, n_images: usize) {
    for idx in 2..2 + n_images {
        replace(folder, &format!("laser/{idx:03}.png"), &png(GrayImage::from_pixel(640, 512, Luma([4]))));
    }
}

#[test]
fn more_laser_images_without_a_line_than_with_one() {
    refused(
        |folder| darken(folder, 4),
        BAD_INPUT,
        &["laser/002.png", "poses[2].laser", "no laser line", "exposed"],
    );
}

#[test]
fn images_without_a_board_or_a_line_are_excluded_and_named() {
    let copy = copy_of_small();
    darken(copy.path(), 2);
    replace(copy.path(), "board/005.png", &png(GrayImage::from_pixel(640, 512, Luma([90]))));
    let folder = copy.path().to_str().unwrap().to_owned();
    let (result, exit) = sheaf_json(&["calibrate", &folder, "-o", &path(copy.path(), "cal.json"), "-q"]);
    assert_eq!(exit, 0, "{result:#}");
    let left_out = result["left_out"].as_array().unwrap();
    let named = |name: &str| left_out.iter().any(|entry| entry.as_str().unwrap().contains(name));
    assert_eq!(left_out.len(), 3, "{left_out:?}");
    assert!(named("laser/002.png") && named("laser/003.png") && named("board/005.png"), "{left_out:?}");
}

#[test]
fn lines_out_of_order() {
    let damage = |folder: &Path| {
        edit_manifest(folder, |manifest| manifest["projector"]["orders"] = json!([-2, 0, -1, 1, 2]));
    };
    refused(damage, BAD_INPUT, &["capture.json", "projector.orders[2]", "increasing or decreasing"]);
}

#[test]
fn nan_in_the_manifest() {
    let damage = |folder: &Path| {
        let text = std::fs::read_to_string(folder.join("capture.json")).unwrap();
        let at = text.find("\"square_mm\":").unwrap();
        let end = at + text[at..].find(['\n', '}']).unwrap();
        let text = format!("{}\"square_mm\": NaN\n{}", &text[..at], &text[end..]);
        replace(folder, "capture.json", text.as_bytes());
    };
    refused(damage, BAD_INPUT, &["capture.json", "target.square_mm", "NaN"]);
}

#[test]
fn nan_in_the_calibration_document() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(small_calibration()).unwrap();
    let at = text.find("\"fx_px\": ").unwrap() + "\"fx_px\": ".len();
    let end = at + text[at..].find(',').unwrap();
    let file = folder.path().join("cal.json");
    std::fs::write(&file, format!("{}NaN{}", &text[..at], &text[end..])).unwrap();
    let output = sheaf(&["triangulate", "--calibration", file.to_str().unwrap()]);
    let message = err(&output);
    assert_eq!(output.status.code(), Some(BAD_INPUT), "{message}");
    for word in ["cal.json", "cause: ", "line ", "remedy: "] {
        assert!(message.contains(word), "`{word}` is not in:\n{message}");
    }
}

#[test]
fn a_sixteen_bit_image_among_eight_bit_ones() {
    let damage = |folder: &Path| {
        let image = open(folder, "board/004.png");
        let wide = ImageBuffer::<Luma<u16>, Vec<u16>>::from_fn(640, 512, |u, v| {
            Luma([u16::from(image.get_pixel(u, v).0[0]) * 257])
        });
        replace(folder, "board/004.png", &png(wide));
    };
    refused(damage, BAD_INPUT, &["board/004.png", "poses[4].board", "16 bits", "one bit depth"]);
}

#[test]
fn an_image_of_another_size() {
    let damage = |folder: &Path| {
        let image = DynamicImage::from(open(folder, "board/004.png")).crop_imm(0, 0, 600, 512);
        replace(folder, "board/004.png", &png(image));
    };
    refused(damage, BAD_INPUT, &["board/004.png", "poses[4].board", "600×512", "640×512"]);
}

#[test]
fn a_folder_that_is_not_a_capture() {
    let folder = tempfile::tempdir().unwrap();
    let output = sheaf(&["calibrate", folder.path().to_str().unwrap(), "-o", "/dev/null"]);
    let message = err(&output);
    assert_eq!(output.status.code(), Some(BAD_INPUT), "{message}");
    assert!(message.contains("capture.json") && message.contains("remedy: "), "{message}");
}

#[test]
fn a_missing_scan() {
    let capture = crate::common::small_capture();
    let calibration = small_calibration();
    let (problem, exit) = sheaf_json(&[
        "scan",
        capture.to_str().unwrap(),
        "-c",
        calibration.to_str().unwrap(),
        "--scan",
        "cup",
        "-o",
        "/tmp/x.ply",
    ]);
    assert_eq!(exit, BAD_INPUT);
    let problem = &problem["problem"];
    assert_eq!(problem["exit_code"], BAD_INPUT);
    assert_eq!(problem["kind"], "bad_input");
    let words = format!("{} {}", problem["what"], problem["remedy"]);
    assert!(words.contains("cup") && words.contains("gauge"), "{words}");
}

#[test]
fn a_scan_without_light() {
    let copy = copy_of_small();
    for idx in 0..16 {
        let name = format!("scan-gauge/{idx:05}.png");
        replace(copy.path(), &name, &png(GrayImage::from_pixel(640, 512, Luma([4]))));
    }
    let calibration = small_calibration();
    let cloud = path(copy.path(), "cloud.ply");
    let output = sheaf(&[
        "scan",
        copy.path().to_str().unwrap(),
        "-c",
        calibration.to_str().unwrap(),
        "--scan",
        "gauge",
        "-o",
        &cloud,
    ]);
    let message = err(&output);
    assert_eq!(output.status.code(), Some(INSUFFICIENT_DATA), "{message}");
    assert!(message.contains("no frame shows a laser line") && message.contains("remedy: "), "{message}");
}

#[test]
fn a_wrong_command_line_has_its_own_exit_code() {
    for arguments in [&["calibrate"][..], &["triangulate"], &["fly"], &["measure", "x.ply", "--tool", "cup"]] {
        assert_eq!(sheaf(arguments).status.code(), Some(2), "{arguments:?}");
    }
    let (problem, exit) = sheaf_json(&["calibrate"]);
    assert_eq!((exit, &problem["problem"]["kind"]), (2, &json!("usage")));
}

#[test]
fn a_malformed_row_is_reported_with_its_line_number() {
    let calibration = small_calibration();
    for (rows, word) in [
        ("order,u_px,v_px\n0,10,20\n0,ten,20\n", "line 3"),
        ("order,u_px,v_px\n0,NaN,20\n", "line 2"),
        ("order,u,v\n0,1,2\n", "u_px"),
        ("", "order"),
    ] {
        let output = triangulate(calibration.to_str().unwrap(), rows);
        let message = err(&output);
        assert_eq!(output.status.code(), Some(BAD_INPUT), "{message}");
        assert!(message.contains(word) && message.contains("remedy: "), "{message}");
    }
}

fn triangulate(calibration: &str, rows: &str) -> std::process::Output {
    use std::io::Write as _;
    let mut child = std::process::Command::new(crate::common::SHEAF)
        .args(["triangulate", "--calibration", calibration])
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(rows.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}
