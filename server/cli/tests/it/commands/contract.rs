//! The contract with scripts: commands, columns, order of rows, JSON on stdout, exit codes, reproducible bytes.
//!
//! Not shown here: accuracy; see `rig_a.rs`.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{SHEAF, err, out, path, sheaf, sheaf_json, sheaf_ok, small_calibration, small_capture};
use tempfile::TempDir;

fn triangulate(options: &[&str], rows: &str) -> std::process::Output {
    let calibration = small_calibration();
    let mut child = Command::new(SHEAF)
        .args(["triangulate", "--calibration", calibration.to_str().unwrap()])
        .args(options)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let rows = rows.to_owned();
    let writer = std::thread::spawn(move || stdin.write_all(rows.as_bytes()));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    output
}

/// A cloud of the small capture's scan.
pub fn scan(name: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let cloud = path(folder.path(), "cloud.ply");
    let (capture, calibration) = (small_capture(), small_calibration());
    sheaf_ok(&[
        "scan",
        capture.to_str().unwrap(),
        "-c",
        calibration.to_str().unwrap(),
        "--scan",
        name,
        "-o",
        &cloud,
        "-q",
    ]);
    (folder, cloud)
}

#[test]
fn help_states_the_exit_codes_and_every_command_of_the_contract() {
    let help = out(&sheaf_ok(&["--help"]));
    for word in [
        "Exit codes:",
        "calibrate",
        "scan",
        "triangulate",
        "centrelines",
        "corners",
        "measure",
        "compare",
        "study",
        "bench",
        "twin",
        "demo",
    ] {
        assert!(help.contains(word), "{word}");
    }
}

#[test]
fn triangulate_keeps_all_rows_in_order_and_leaves_fields_empty_without_an_intersection() {
    let rows = "frame,v_px,order,u_px\n9,250.50,0,320\n9,1e2,77,5\n9,255.0,-1,100.0\n";
    let output = triangulate(&[], rows);
    assert!(output.status.success(), "{}", err(&output));
    let text = out(&output);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "order,u_px,v_px,x_mm,y_mm,z_mm,sigma_mm");
    assert!(lines[1].starts_with("0,320,250.50,") && lines[3].starts_with("-1,100.0,255.0,"), "{text}");
    assert_eq!(lines[2], "77,5,1e2,,,,");
    assert_eq!(lines.len(), 4);
    assert!(lines[1].split(',').all(|field| field.parse::<f64>().is_ok_and(f64::is_finite)), "{text}");
    assert!(err(&output).contains("left empty: 1"), "{}", err(&output));
}

#[test]
fn pixel_noise_adds_to_sigma() {
    let sigma = |options: &[&str]| -> f64 {
        let text = out(&triangulate(options, "order,u_px,v_px\n0,320,250\n"));
        text.lines().nth(1).unwrap().rsplit(',').next().unwrap().parse().unwrap()
    };
    let (systematic, both) = (sigma(&[]), sigma(&["--pixel-sigma", "0.2"]));
    assert!(systematic > 0.0 && both > systematic, "{systematic} {both}");
}

#[test]
fn triangulate_streams_many_rows() {
    let mut rows = String::from("order,u_px,v_px\n");
    for idx in 0..40_000 {
        rows.push_str(&format!("0,{},{}\n", idx % 640, 250 + idx % 7));
    }
    let text = out(&triangulate(&[], &rows));
    assert_eq!(text.lines().count(), 40_001);
    let kept = text.lines().skip(1).zip(rows.lines().skip(1)).all(|(output, input)| output.starts_with(input));
    assert!(kept, "rows came back in another order");
}

#[test]
fn corners_and_centrelines_write_one_table_per_image() {
    let capture = small_capture();
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().to_str().unwrap();
    let image = |name: &str| path(&capture, name);
    sheaf_ok(&[
        "corners",
        &image("board/000.png"),
        &image("stage/000.png"),
        "--columns",
        "11",
        "--rows",
        "8",
        "--csv",
        csv,
    ]);
    for name in ["board-000.csv", "stage-000.csv"] {
        let table = std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert!(table.starts_with("row,column,u_px,v_px,sigma_px\n0,0,"), "{table}");
        assert_eq!(table.lines().count(), 1 + 88);
    }
    let overlays = path(folder.path(), "overlays");
    sheaf_ok(&["centrelines", &image("laser/001.png"), "--csv", csv, "--overlay", &overlays]);
    let table = std::fs::read_to_string(folder.path().join("001.csv")).unwrap();
    assert!(table.starts_with("u_px,v_px,sigma_px,intensity,width_px\n"), "{table}");
    assert!(
        table.lines().count() > 5 * 300,
        "five lines across 640 columns give more points than {}",
        table.lines().count()
    );
    assert!(Path::new(&overlays).join("001.png").is_file());
}

#[test]
fn the_classic_method_finds_the_same_lines() {
    let capture = small_capture();
    let folder = tempfile::tempdir().unwrap();
    let count = |method: &str| -> f64 {
        let (result, exit) = sheaf_json(&[
            "centrelines",
            &path(&capture, "scan-gauge/00008.png"),
            "--method",
            method,
            "--csv",
            folder.path().to_str().unwrap(),
        ]);
        assert_eq!(exit, 0);
        result["images"][0]["n_points"].as_f64().unwrap()
    };
    let (steger, classic) = (count("steger"), count("centre-of-gravity"));
    assert!((steger / classic - 1.0).abs() < 0.05, "{steger} {classic}");
}

#[test]
fn a_sixteen_bit_image_gives_the_same_corners() {
    let capture = small_capture();
    let folder = tempfile::tempdir().unwrap();
    let grey = image::open(capture.join("board/000.png")).unwrap().into_luma8();
    let wide = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_fn(grey.width(), grey.height(), |u, v| {
        image::Luma([u16::from(grey.get_pixel(u, v).0[0]) * 257])
    });
    wide.save(folder.path().join("wide.png")).unwrap();
    let corners = |image: &str, name: &str| -> Vec<f64> {
        let csv = folder.path().to_str().unwrap();
        sheaf_ok(&["corners", image, "--columns", "11", "--rows", "8", "--csv", csv]);
        let table = std::fs::read_to_string(folder.path().join(name)).unwrap();
        let pixels = |line: &str| -> Vec<f64> {
            line.split(',').skip(2).take(2).map(|field| field.parse().unwrap()).collect()
        };
        table.lines().skip(1).flat_map(pixels).collect()
    };
    let eight = corners(&path(&capture, "board/000.png"), "000.csv");
    let sixteen = corners(&path(folder.path(), "wide.png"), "wide.csv");
    // The same grey levels on a finer scale: differences are due to rounding only.
    let largest = eight.iter().zip(&sixteen).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(eight.len() == 176 && largest < 1e-3, "{largest} px");
}

#[test]
fn corner_sigma_covers_the_error_of_jpeg_compression() {
    let folder = tempfile::tempdir().unwrap();
    let png = small_capture().join("board/000.png");
    let grey = image::open(&png).unwrap().into_luma8();
    let csv = path(folder.path(), "out");
    // u, v and sigma of every corner.
    let corners = |image: &str, name: &str| -> Vec<[f64; 3]> {
        sheaf_ok(&["corners", image, "--columns", "11", "--rows", "8", "--csv", &csv]);
        let table = std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
        let row = |line: &str| {
            let fields: Vec<f64> = line.split(',').skip(2).map(|field| field.parse().unwrap()).collect();
            [fields[0], fields[1], fields[2]]
        };
        table.lines().skip(1).map(row).collect()
    };
    let intact = corners(png.to_str().unwrap(), "000.csv");
    for quality in [75, 40] {
        let file = folder.path().join(format!("{quality}.jpg"));
        let out = std::fs::File::create(&file).unwrap();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(out, quality);
        encoder.encode_image(&grey).unwrap();
        let lossy = corners(file.to_str().unwrap(), &format!("{quality}.csv"));
        assert_eq!((intact.len(), lossy.len()), (88, 88));
        let square =
            |[a, b]: [&[f64; 3]; 2]| ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)) / (2.0 * b[2] * b[2]);
        let mean = intact.iter().zip(&lossy).map(|(a, b)| square([a, b])).sum::<f64>() / 88.0;
        eprintln!("quality {quality}: moved by {:.2} sigma", mean.sqrt());
        assert!(mean.sqrt() > 0.05, "quality {quality}: nothing moved, {mean}");
        assert!(mean.sqrt() < 1.15, "quality {quality}: moved by {:.2} sigma", mean.sqrt());
    }
}

#[test]
fn calibrate_prints_its_results_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let capture = small_capture();
    let (cal, report) = (path(folder.path(), "cal.json"), path(folder.path(), "report.html"));
    let (result, exit) = sheaf_json(&["calibrate", capture.to_str().unwrap(), "-o", &cal, "--report", &report]);
    assert_eq!(exit, 0);
    assert_eq!(result["camera"]["images"].as_array().unwrap().len(), 6 + 5);
    assert_eq!(result["models"]["scores"].as_array().unwrap().len(), 3);
    assert_eq!(result["models"]["recommended"], "grating");
    for pointer in
        ["/camera/rms_px", "/camera/parameters/fx_px/sigma", "/light/systematic_sigma_mm", "/stage/scale_error"]
    {
        assert!(result.pointer(pointer).unwrap().is_f64(), "{pointer}");
    }
    let html = std::fs::read_to_string(report).unwrap();
    assert!(
        html.starts_with("<!DOCTYPE html>") && html.contains("<svg") && html.contains("data:image/jpeg;base64,")
    );
    assert!(!html.contains("http://") && !html.contains("https://"), "the report needs no other file");
}

#[test]
fn calibrate_writes_a_certificate_by_the_configuration_and_refuses_before_it_computes_without_one() {
    let folder = tempfile::tempdir().unwrap();
    let (capture, names) = (small_capture(), ["cal.json", "certificate.xml", "sheaf.toml"]);
    let [cal, certificate, config] = names.map(|name| path(folder.path(), name));
    let arguments = ["calibrate", capture.to_str().unwrap(), "-o", &cal, "--certificate", &certificate, "-q"];
    let with_config = |text: &str| {
        std::fs::write(&config, text).unwrap();
        sheaf(&[&arguments[..], &["--config", &config]].concat())
    };
    let refused = with_config("[certificate]\nstation_number = \"INV-7\"\n");
    assert_eq!(refused.status.code(), Some(3), "{}", err(&refused));
    assert!(err(&refused).contains("certificate.customer.city"), "{}", err(&refused));
    assert!(!Path::new(&cal).exists() && !Path::new(&certificate).exists());
    let contact = "name = \"Works\"\ncity = \"Ort\"\ncountry = \"DE\"\n";
    let written = with_config(&format!(
        "[certificate]\nstation_number = \"INV-7\"\nresponsible = [\"A. B.\"]\n\
         [certificate.laboratory]\n{contact}[certificate.customer]\n{contact}"
    ));
    assert!(written.status.success(), "{}", err(&written));
    let document: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(cal).unwrap()).unwrap();
    let certificate = std::fs::read_to_string(certificate).unwrap();
    for text in [document["id"].as_str().unwrap(), "INV-7", "A. B.", "<si:coverageProbability>0.95<"] {
        assert!(certificate.contains(text), "{text} in {certificate}");
    }
}

#[test]
fn every_light_model_can_be_selected() {
    let folder = tempfile::tempdir().unwrap();
    let capture = small_capture();
    for model in ["planes", "pencil", "grating"] {
        let cal = path(folder.path(), "cal.json");
        let (result, exit) =
            sheaf_json(&["calibrate", capture.to_str().unwrap(), "-o", &cal, "--light-model", model, "-q"]);
        assert_eq!((exit, result["light"]["model"].as_str()), (0, Some(model)));
        let document: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(cal).unwrap()).unwrap();
        assert_eq!(document["light"]["model"], model);
    }
}

#[test]
fn the_same_input_gives_the_same_bytes_with_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let capture = small_capture();
    let run = |threads: &str| -> (Vec<u8>, Vec<u8>) {
        let (cal, cloud) = (path(folder.path(), "cal.json"), path(folder.path(), "cloud.ply"));
        let run = |arguments: &[&str]| {
            let status = Command::new(SHEAF)
                .args(arguments)
                .env("RAYON_NUM_THREADS", threads)
                .stdout(Stdio::null())
                .status()
                .unwrap();
            assert!(status.success());
        };
        run(&["calibrate", capture.to_str().unwrap(), "-o", &cal, "-q"]);
        run(&["scan", capture.to_str().unwrap(), "-c", &cal, "--scan", "sphere", "-o", &cloud, "-q"]);
        (std::fs::read(cal).unwrap(), std::fs::read(cloud).unwrap())
    };
    let (one, three) = (run("1"), run("3"));
    assert!(one.0 == three.0, "the calibration depends on the number of threads");
    assert!(one.1 == three.1, "the cloud depends on the number of threads");
}

#[test]
fn a_cloud_contains_its_calibration_and_is_measured_with_complete_uncertainty() {
    let (_folder, cloud) = scan("gauge");
    let (result, exit) = sheaf_json(&["measure", &cloud, "--tool", "step", "--nominal-mm", "8.9"]);
    assert_eq!(exit, 0);
    let document: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(small_calibration()).unwrap()).unwrap();
    assert_eq!(result["calibration_id"], document["id"]);
    assert!(result["u_systematic"].as_f64().unwrap() > 0.0);
    assert!(!result["per_order"].as_array().unwrap().is_empty());
    assert!(result["verdict"].is_null());
}

#[test]
fn the_exit_code_is_the_verdict() {
    let (_folder, cloud) = scan("gauge");
    let (free, _) = sheaf_json(&["measure", &cloud, "--tool", "step", "--nominal-mm", "8.9"]);
    let uncertainty = free["expanded_uncertainty"].as_f64().unwrap();
    let value = free["value"].as_f64().unwrap();
    let verdict = |nominal: f64, tolerance: f64| {
        let output = sheaf(&[
            "measure",
            &cloud,
            "--tool",
            "step",
            "--nominal-mm",
            &nominal.to_string(),
            "--tolerance-mm",
            &tolerance.to_string(),
        ]);
        (output.status.code().unwrap(), out(&output))
    };
    for (nominal, tolerance, exit, word) in [
        (value, 3.0 * uncertainty, 0, "  OK (ISO 14253-1)"),
        (value + 8.0 * uncertainty, 3.0 * uncertainty, 5, "  NOT OK (ISO 14253-1)"),
        (value + 3.0 * uncertainty, 3.0 * uncertainty, 6, "  UNDECIDED (ISO 14253-1)"),
    ] {
        let (code, text) = verdict(nominal, tolerance);
        assert_eq!(code, exit, "{text}");
        assert!(text.contains(word), "{text}");
    }
}

#[test]
fn an_incomplete_uncertainty_gives_no_verdict_and_states_what_is_missing() {
    let (folder, cloud) = scan("gauge");
    for (missing, lines) in [
        ("calibration", &["calibration_json"][..]),
        ("stage_positions", &["frame_positions_mm"]),
        ("line_thickness", &["line_sigma_mm"]),
    ] {
        let mut less = scanning::files::read_cloud(Path::new(&cloud)).unwrap();
        less.comments.retain(|comment| !lines.iter().any(|line| comment.starts_with(line)));
        let path = path(folder.path(), &format!("{missing}.ply"));
        scanning::files::write_cloud(Path::new(&path), scanning::CloudFormat::Ply, &less).unwrap();
        // Clearly outside, if U were complete.
        let asked = ["measure", &path, "--tool", "step", "--nominal-mm", "8.9", "--tolerance-mm", "5"];
        let (result, exit) = sheaf_json(&asked);
        assert_eq!((exit, result["verdict"].as_str()), (6, Some("undecided")), "{missing}");
        assert_eq!(result["uncertainty_missing"], serde_json::json!([missing]));
        assert_eq!(result["uncertainty_complete"], false);
        let text = out(&sheaf(&asked));
        assert!(text.contains("U incomplete") && text.contains("missing "), "{text}");
    }
}

#[test]
fn clouds_and_meshes_are_written_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let (capture, calibration) = (small_capture(), small_calibration());
    let arguments =
        ["scan", capture.to_str().unwrap(), "-c", calibration.to_str().unwrap(), "--scan", "gauge", "-q"];
    for (cloud, mesh) in [("c.ply", "m.stl"), ("c.csv", "m.glb"), ("c.pcd", "m.ply"), ("c.e57", "m.stl")] {
        let (cloud, mesh) = (path(folder.path(), cloud), path(folder.path(), mesh));
        let all: Vec<&str> = arguments.iter().copied().chain(["-o", &cloud, "--mesh", &mesh]).collect();
        sheaf_ok(&all);
        assert!(
            std::fs::metadata(&cloud).unwrap().len() > 10_000 && std::fs::metadata(&mesh).unwrap().len() > 10_000
        );
        // Every format contains the calibration.
        let (result, exit) = sheaf_json(&["measure", &cloud, "--tool", "flatness"]);
        assert_eq!(exit, 0, "{result:#}");
        assert!(result["u_systematic"].is_f64(), "{cloud}");
    }
    let output = sheaf(&[&arguments[..], &["-o", "cloud.xyz"]].concat());
    assert_eq!(output.status.code(), Some(3));
    assert!(err(&output).contains(".ply"), "{}", err(&output));
}

#[test]
fn progress_and_notes_go_to_stderr_and_quiet_suppresses_them() {
    let (capture, calibration) = (small_capture(), small_calibration());
    let folder = tempfile::tempdir().unwrap();
    let cloud = path(folder.path(), "cloud.ply");
    let arguments =
        ["scan", capture.to_str().unwrap(), "-c", calibration.to_str().unwrap(), "--scan", "gauge", "-o", &cloud];
    let loud = sheaf_ok(&arguments);
    assert!(err(&loud).contains("reading scan gauge"), "{}", err(&loud));
    assert!(out(&loud).starts_with("scan gauge: "), "{}", out(&loud));
    assert!(!err(&loud).contains('\u{1b}'), "no terminal, no control codes");
    let quiet = sheaf_ok(&[&arguments[..], &["--quiet"]].concat());
    assert_eq!(err(&quiet), "");
}

#[test]
fn the_capture_of_the_twin_depends_only_on_the_seed() {
    let folder = tempfile::tempdir().unwrap();
    let render = |name: &str, seed: &str| -> Vec<u8> {
        let capture = path(folder.path(), name);
        sheaf_ok(&[
            "twin",
            "capture",
            "--scene",
            "plate",
            "--seed",
            seed,
            "--width-px",
            "320",
            "--height-px",
            "256",
            "--poses",
            "3",
            "--frames",
            "2",
            "-q",
            "-o",
            &capture,
        ]);
        std::fs::read(Path::new(&capture).join("laser/001.png")).unwrap()
    };
    let (a, b, c) = (render("a", "11"), render("b", "11"), render("c", "12"));
    assert!(a == b && a != c);
    let again = sheaf(&["twin", "capture", "-o", &path(folder.path(), "a")]);
    assert_eq!(again.status.code(), Some(3), "a folder with content is never overwritten");
}
