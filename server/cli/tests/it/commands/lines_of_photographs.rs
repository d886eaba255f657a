//! `sheaf centrelines` and `sheaf corners` in practice: many images at once, pairs, mistakes. Findings are reported as text
//! and as JSON.
//!
//! Not shown here: how well lines are found; see `vision`, `twin/tests/it/colour` and `photographs.rs`.

use std::path::Path;

use crate::common::{
    copy_of_small, edit_manifest, err, path, sheaf, sheaf_json, sheaf_ok, small_calibration, small_capture,
};
use image::{GrayImage, Luma, RgbImage};
use serde_json::Value;

fn grey(name: &str) -> GrayImage {
    image::open(small_capture().join(name)).unwrap().into_luma8()
}

/// The sum of two images, as ambient and laser light add up on the sensor.
fn together(a: &GrayImage, b: &GrayImage) -> GrayImage {
    GrayImage::from_fn(a.width(), a.height(), |u, v| {
        Luma([a.get_pixel(u, v).0[0].saturating_add(b.get_pixel(u, v).0[0])])
    })
}

fn kinds(image: &Value) -> Vec<&str> {
    image["findings"].as_array().unwrap().iter().map(|finding| finding["kind"].as_str().unwrap()).collect()
}

#[test]
fn tables_and_overlays_with_visible_lines_are_written_to_one_folder() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(folder.path(), "out");
    let images = ["laser/000.png", "laser/001.png"].map(|name| path(&small_capture(), name));
    let (result, exit) = sheaf_json(&["centrelines", &images[0], &images[1], "-o", &out]);
    assert_eq!(exit, 0, "{result:#}");
    for name in ["000", "001"] {
        let table = std::fs::read_to_string(Path::new(&out).join(format!("{name}.csv"))).unwrap();
        let overlay: RgbImage =
            image::open(Path::new(&out).join(format!("{name}-lines.png"))).unwrap().into_rgb8();
        let zoom = overlay.width() / 640;
        let (mut n_seen, mut n_points) = (0, 0);
        for row in table.lines().skip(1) {
            let [u, v] = [0, 1].map(|field| row.split(',').nth(field).unwrap().parse::<f64>().unwrap());
            let place = |at: f64| ((at + 0.5) * f64::from(zoom)) as u32;
            let pixel = overlay.get_pixel(place(u), place(v)).0;
            let (brightest, darkest) = (*pixel.iter().max().unwrap(), *pixel.iter().min().unwrap());
            n_points += 1;
            n_seen += usize::from(brightest - darkest > 60);
        }
        // Every point is coloured, even on saturated stripes.
        assert!(n_points > 1500 && n_seen == n_points, "{n_seen} of {n_points} are seen");
    }
}

#[test]
fn a_wrong_line_direction_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(folder.path(), "");
    let image = path(&small_capture(), "laser/000.png");
    let (result, exit) = sheaf_json(&["centrelines", &image, "-o", &out, "--direction", "columns"]);
    assert_eq!((exit, kinds(&result["images"][0]).contains(&"other_direction")), (0, true), "{result:#}");
    let words = err(&sheaf(&["centrelines", &image, "-o", &out, "--line-direction", "columns", "-q"]));
    assert!(words.contains("--direction rows"), "{words}");
    // No finding with the correct direction; `both` gives the same lines.
    let count = |direction: &str| {
        let (result, _) = sheaf_json(&["centrelines", &image, "-o", &out, "--direction", direction]);
        assert_eq!(kinds(&result["images"][0]), Vec::<&str>::new(), "{direction}");
        result["images"][0]["n_points"].as_u64().unwrap()
    };
    let (rows, both) = (count("rows"), count("both"));
    assert!(both.abs_diff(rows) < rows / 50, "{rows} {both}");
}

#[test]
fn a_chessboard_without_laser_light_is_doubted() {
    let folder = tempfile::tempdir().unwrap();
    let images = ["board/000.png", "board/001.png", "laser/000.png"].map(|name| path(&small_capture(), name));
    let out = path(folder.path(), "out");
    // Both folders have a 000.png.
    let [board, other, _] = &images;
    let output = sheaf(&["centrelines", board, other, "-o", &out]);
    assert!(err(&output).contains("edges in an image without laser light"), "{}", err(&output));
    for (image, is_doubted) in images.iter().zip([true, true, false]) {
        let (result, _) = sheaf_json(&["centrelines", image, "-o", &path(folder.path(), "one")]);
        let found = kinds(&result["images"][0]);
        assert_eq!(found.contains(&"no_long_line"), is_doubted, "{image}: {result:#}");
    }
}

#[test]
fn swapped_pairs_and_backgrounds_of_another_pose_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, image: &GrayImage| {
        let file = folder.path().join(name);
        image.save(&file).unwrap();
        file.display().to_string()
    };
    let (board, other) = (grey("board/000.png"), grey("board/001.png"));
    let on = file("on.png", &together(&board, &grey("laser/000.png")));
    let (off, of_other) = (file("off.png", &board), file("other.png", &other));
    let dimmer = GrayImage::from_fn(640, 512, |u, v| Luma([board.get_pixel(u, v).0[0] / 4 * 3]));
    let dimmer = file("dimmer.png", &together(&dimmer, &grey("laser/000.png")));
    // Without a clipped pixel.
    let times = |image: &GrayImage, eighths: u16| {
        GrayImage::from_fn(640, 512, |u, v| Luma([(u16::from(image.get_pixel(u, v).0[0]) * eighths / 8) as u8]))
    };
    let dark = file("dark.png", &times(&board, 2));
    let brighter = file("brighter.png", &together(&times(&board, 3), &times(&grey("laser/000.png"), 4)));
    let out = path(folder.path(), "out");
    for (on, off, expected) in [
        (&on, &off, &[][..]),
        (&off, &on, &["swapped_pair"][..]),
        (&on, &of_other, &["background_of_another_pose"][..]),
        (&dimmer, &off, &["dimmer_room"][..]),
        (&brighter, &dark, &["brighter_room"][..]),
    ] {
        let (result, _) = sheaf_json(&["centrelines", on, "--background", off, "-o", &out]);
        let mut found = kinds(&result["images"][0]);
        found.retain(|kind| !["no_line", "no_long_line", "light_without_line", "clipped"].contains(kind));
        assert_eq!(found, expected, "{on} minus {off}: {result:#}");
    }
    // The same as a list of pairs, relative to the list.
    let list = folder.path().join("pairs.csv");
    std::fs::write(&list, "# laser on, laser off\non.png, off.png\non.png,other.png\n").unwrap();
    let (result, exit) = sheaf_json(&["centrelines", "--pairs", list.to_str().unwrap(), "-o", &out]);
    assert_eq!(exit, 0, "{result:#}");
    assert_eq!(kinds(&result["images"][0]), ["clipped"]);
    assert!(kinds(&result["images"][1]).contains(&"background_of_another_pose"), "{result:#}");
    std::fs::write(&list, "on.png\n").unwrap();
    let output = sheaf(&["centrelines", "--pairs", list.to_str().unwrap(), "-o", &out]);
    assert!(output.status.code() == Some(3) && err(&output).contains("line 1"), "{}", err(&output));
    let output = sheaf(&["centrelines", &on, &on, &on, "--background", &off, &off, "-o", &out]);
    assert!(output.status.code() == Some(2) && err(&output).contains("3 images and 2 backgrounds"));
}

#[test]
fn a_capture_subtracts_backgrounds_and_reports_those_of_another_pose() {
    let folder = copy_of_small();
    let dim = |name: &str| {
        let image = grey(name);
        GrayImage::from_fn(image.width(), image.height(), |u, v| Luma([image.get_pixel(u, v).0[0] / 3]))
    };
    let put = |name: &str, image: &GrayImage| image.save(folder.path().join(name)).unwrap();
    // Pose 0 in ambient light with and without the laser; frame 0 of the scan with a wrong background.
    std::fs::remove_file(folder.path().join("laser/000.png")).unwrap();
    put("laser/000.png", &together(&dim("board/000.png"), &grey("laser/000.png")));
    put("off.png", &dim("board/000.png"));
    put("other.png", &dim("board/001.png"));
    let set = |key: &'static str, name: &'static str| {
        edit_manifest(folder.path(), |manifest| match key {
            "pose" => manifest["poses"][0]["background"] = name.into(),
            _ => manifest["scans"][0]["frames"][0]["background"] = name.into(),
        });
    };
    let (capture, output) = (path(folder.path(), ""), path(folder.path(), "cal.json"));
    let left_out = || {
        let (result, exit) = sheaf_json(&["calibrate", &capture, "-o", &output, "-q"]);
        assert_eq!(exit, 0, "{result:#}");
        result["left_out"].clone()
    };
    set("pose", "off.png");
    assert_eq!(left_out(), serde_json::json!([]));
    set("pose", "other.png");
    let named = left_out();
    assert_eq!(named.as_array().unwrap().len(), 1, "{named:#}");
    let words = named[0].as_str().unwrap();
    assert!(words.contains("laser/000.png") && words.contains("another pose"), "{words}");
    // The pair the wrong way round.
    std::fs::rename(folder.path().join("laser/000.png"), folder.path().join("lit.png")).unwrap();
    std::fs::copy(folder.path().join("off.png"), folder.path().join("laser/000.png")).unwrap();
    set("pose", "lit.png");
    let words = left_out()[0].as_str().unwrap_or_default().to_owned();
    assert!(words.contains("laser/000.png") && words.contains("seem to be swapped"), "{words}");
    set("frame", "other.png");
    let (calibration, cloud) = (small_calibration().display().to_string(), path(folder.path(), "part.ply"));
    let (result, exit) =
        sheaf_json(&["scan", &capture, "-c", &calibration, "--scan", "gauge", "-o", &cloud, "-q"]);
    let words = result["warnings"].to_string();
    assert!(exit == 0 && words.contains("scans[0].frames[0].image") && words.contains("left out"), "{result:#}");
}

#[test]
fn a_capture_with_the_wrong_direction_says_which_one_its_lines_seem_to_have() {
    let folder = copy_of_small();
    edit_manifest(folder.path(), |manifest| manifest["projector"]["line_direction"] = "columns".into());
    let (capture, output) = (path(folder.path(), ""), path(folder.path(), "cal.json"));
    let words = err(&sheaf(&["calibrate", &capture, "-o", &output, "-q"]));
    assert!(words.contains("lines seem to run along rows"), "{words}");
}

#[test]
fn strong_light_without_a_point_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wide.png");
    let band = GrayImage::from_fn(640, 480, |u, v| {
        Luma([if (200..290).contains(&v) && (100..500).contains(&u) {
            200
        } else {
            10 + ((u * 7 + v * 13) % 3) as u8
        }])
    });
    band.save(&file).unwrap();
    let out = path(folder.path(), "out");
    let (result, exit) = sheaf_json(&["centrelines", file.to_str().unwrap(), "-o", &out]);
    let image = &result["images"][0];
    assert!(kinds(image).contains(&"light_without_line"), "{result:#}");
    let words = image["findings"].to_string();
    assert!(words.contains("px wide at columns") && words.contains("wider than 40 px"), "{words}");
    if image["n_points"] == 0 {
        assert_eq!(exit, 4, "{result:#}");
    }
}

#[test]
fn options_select_region_length_and_contrast() {
    let folder = tempfile::tempdir().unwrap();
    let out = path(folder.path(), "");
    let image = path(&small_capture(), "laser/000.png");
    let points = |options: &[&str]| -> Vec<[f64; 4]> {
        let mut arguments = vec!["centrelines", &image, "--csv", &out, "-q"];
        arguments.extend(options);
        sheaf_ok(&arguments);
        let table = std::fs::read_to_string(folder.path().join("000.csv")).unwrap();
        let number = |row: &str, field: usize| row.split(',').nth(field).unwrap().parse().unwrap();
        table.lines().skip(1).map(|row| [0, 1, 2, 3].map(|field| number(row, field))).collect()
    };
    let all = points(&[]);
    let inside = points(&["--roi", "100,50,200,400"]);
    let expected =
        all.iter().filter(|[u, v, ..]| (100.0..=299.0).contains(u) && (50.0..=449.0).contains(v)).count();
    assert_eq!(inside.len(), expected);
    assert!(points(&["--min-length", "100000"]).is_empty());
    let bright = points(&["--min-contrast", "60"]);
    assert!(!bright.is_empty() && bright.len() < all.len(), "{} of {}", bright.len(), all.len());
    assert_eq!(sheaf(&["centrelines", &image, "-o", &out, "--roi", "1,2,3"]).status.code(), Some(2));
    assert_eq!(sheaf(&["centrelines", &image, "-o", &out, "--channel", "infrared"]).status.code(), Some(2));
}

#[test]
fn good_boards_are_reported_despite_a_bad_one() {
    let folder = tempfile::tempdir().unwrap();
    let csv = path(folder.path(), "");
    let images = ["board/000.png", "laser/000.png", "board/001.png"].map(|name| path(&small_capture(), name));
    let mut arguments = vec!["corners"];
    arguments.extend(images.iter().map(String::as_str));
    arguments.extend(["--columns", "11", "--rows", "8", "--csv", &csv]);
    let (result, exit) = sheaf_json(&arguments);
    assert_eq!(exit, 3);
    let entries = result["images"].as_array().unwrap();
    assert_eq!(entries.len(), 3);
    for idx in [0, 2] {
        assert_eq!(
            (&entries[idx]["image"], &entries[idx]["n_corners"]),
            (&images[idx].as_str().into(), &88.into())
        );
    }
    assert_eq!(entries[1]["image"], images[1].as_str());
    assert_eq!(entries[1]["problem"]["exit_code"], 3);
    assert_eq!(result["problem"], entries[1]["problem"]);
    let output = sheaf(&arguments);
    let (text, words) = (crate::common::out(&output), err(&output));
    assert_eq!(text.lines().filter(|line| line.contains("88 corners")).count(), 2, "{text}");
    assert!(words.contains("laser/000.png") && words.contains("1 of 3 images gave no result"), "{words}");
}

#[test]
fn a_jpeg_causes_a_warning_and_its_artefacts_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("laser.jpg");
    grey("laser/000.png").save(&file).unwrap();
    let (file, out) = (file.display().to_string(), path(folder.path(), "out"));
    let (result, exit) = sheaf_json(&["centrelines", &file, "-o", &out]);
    assert_eq!((exit, &result["images"][0]["lossy"]), (0, &true.into()), "{result:#}");
    let words = err(&sheaf(&["centrelines", &file, "-o", &out, "-q"]));
    assert!(words.contains("JPEG") && words.contains("0.05 to 0.4 px"), "{words}");
    let ripples = result["images"][0]["n_points"].as_u64().unwrap();
    let (all, _) = sheaf_json(&["centrelines", &file, "-o", &out, "--min-contrast", "0"]);
    assert!(all["images"][0]["n_points"].as_u64().unwrap() >= ripples);
}
