//! The rendered images of a turntable are measured; the blocks of the tutorial are run on them unchanged, and the
//! messages it quotes are checked.
//!
//! Not shown here: photographs; line detection in those is tested in `vision` and `photographs.rs`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{SHEAF, err, out, path, sheaf, sheaf_json};
use crate::readme::tested_blocks;
use crate::rigs::turntable;
use drawn::{CYLINDER_MM, VIEWS_DEG};

/// Radius of the rendered part.
const RADIUS_MM: f64 = CYLINDER_MM[0];

fn tutorial() -> String {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/how-to/measure-with-a-hobby-rig.md");
    std::fs::read_to_string(page).unwrap()
}

/// The images under the names of the tutorial, without a manifest, and a pair in daylight.
fn photographs(drawn: &Path, folder: &Path) {
    let rig = folder.join("rig");
    std::fs::create_dir_all(rig.join("stage")).unwrap();
    for (from, to) in [("board", "board"), ("laser", "laser"), ("scan", "part")] {
        std::fs::rename(drawn.join(from), rig.join(to)).unwrap();
    }
    for (idx, angle_deg) in VIEWS_DEG.iter().enumerate() {
        let from = drawn.join(format!("stage/{idx:03}.png"));
        std::fs::rename(from, rig.join(format!("stage/{angle_deg}.png"))).unwrap();
    }
    let day = folder.join("day");
    std::fs::create_dir(&day).unwrap();
    for (name, pose, laser) in [("on", 0, true), ("off", 0, false), ("other", 4, false), ("dim", 0, true)] {
        let room = if name == "dim" { 0.2 } else { 0.3 };
        drawn::by_daylight(pose, room, laser, &day.join(format!("{name}.png")));
    }
}

/// Runs a block in `folder` and returns its output.
#[track_caller]
fn run(block: &str, folder: &Path) -> String {
    let programs = PathBuf::from(SHEAF).parent().unwrap().display().to_string();
    let search = format!("{programs}:{}", std::env::var("PATH").unwrap());
    let mut bash = Command::new("bash");
    let output = bash.args(["-eu", "-c", block]).current_dir(folder).env("PATH", search).output().unwrap();
    assert!(output.status.success(), "{block}\n{}{}", out(&output), err(&output));
    out(&output) + &err(&output)
}

#[test]
fn a_turntable_is_measured_accurately_and_its_tutorial_works_from_photographs() {
    let capture = tempfile::tempdir().unwrap();
    drawn::capture(capture.path());
    turntable::measures_true(capture.path());
    let folder = tempfile::tempdir().unwrap();
    photographs(capture.path(), folder.path());
    let blocks = tested_blocks(&tutorial());
    let said: Vec<String> = blocks.iter().map(|(_, block)| run(block, folder.path())).collect();
    let [_, looked, by_day, _, calibrated, scanned, _] = &said[..] else { panic!("{} blocks", said.len()) };
    // No findings for correct images.
    for words in ["seem", "no laser line", "yields no point"] {
        assert!(!looked.contains(words) && !by_day.contains(words), "{looked}{by_day}");
    }
    assert!(folder.path().join("lines/000-lines.png").is_file() && folder.path().join("board.pdf").is_file());
    assert!(calibrated.contains("axis") && scanned.contains("closure after a turn"), "{calibrated}{scanned}");
    let cloud = path(folder.path(), "part.ply");
    let (measured, _) = sheaf_json(&["measure", &cloud, "--tool", "cylinder", "-q"]);
    let [value, u] = ["value", "expanded_uncertainty"].map(|key| measured[key].as_f64().unwrap());
    assert!((value - RADIUS_MM).abs() < u && u < 0.2, "{measured:#}");
    let quoted = format!("cylinder {value:.3} mm, U = {u:.3} mm");
    assert!(tutorial().contains(&quoted), "the tutorial does not quote `{quoted}`");
    messages_quoted_in_the_tutorial_are_printed(folder.path());
    light_without_points_is_named(folder.path());
}

/// In two of the frames a lamp lights a strip along the lines, wider than any line.
fn light_without_points_is_named(folder: &Path) {
    for frame in ["003", "010"] {
        let file = folder.join(format!("rig/part/{frame}.png"));
        let mut image = image::open(&file).unwrap().to_luma8();
        for (u, _, level) in image.enumerate_pixels_mut() {
            if (295..385).contains(&u) {
                level.0 = [200];
            }
        }
        image.save(&file).unwrap();
    }
    let [rig, calibration, cloud] = ["rig", "rig.json", "lamp.ply"].map(|name| path(folder, name));
    let output = sheaf(&["scan", &rig, "-c", &calibration, "--scan", "part", "-o", &cloud]);
    let said = err(&output);
    assert!(output.status.success(), "{said}");
    for words in ["scan part: part/003.png (scans[0].frames[3]", "yields no point", "also in 1 other image"] {
        assert!(said.contains(words), "no `{words}` in {said}");
    }
}

/// Makes every mistake in the table of the tutorial.
fn messages_quoted_in_the_tutorial_are_printed(folder: &Path) {
    let page = tutorial();
    let [on, off, other, dim] = ["on", "off", "other", "dim"].map(|name| path(folder, &format!("day/{name}.png")));
    let laser = path(folder, "rig/laser/000.png");
    let lines = path(folder, "wrong");
    let mistakes: [(&str, &[&str]); 5] = [
        ("lines seem to run along columns", &[&laser]),
        ("laser on and off seem to be swapped", &[&off, "--background", &on, "--direction", "columns"]),
        ("the background seems to show another pose", &[&on, "--background", &other, "--direction", "columns"]),
        ("the room was darker than in the background", &[&dim, "--background", &off, "--direction", "columns"]),
        ("shows no laser line", &[&off, "--background", &off, "--direction", "columns"]),
    ];
    for (words, arguments) in mistakes {
        assert!(page.contains(words), "the tutorial no longer quotes `{words}`");
        let all: Vec<&str> = ["centrelines", "-o", &lines].into_iter().chain(arguments.iter().copied()).collect();
        let output = sheaf(&all);
        assert!(err(&output).contains(words), "{arguments:?}: {}", err(&output));
    }
}
