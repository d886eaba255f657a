//! Deleting frees disk space and keeps shared artifacts; the server does not start with a catalogue that lacks the files.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::common::server::Server;
use crate::common::{SHEAF, small_capture};

/// Longest time until a sweep on a busy machine.
const SWEPT_WITHIN: Duration = Duration::from_secs(60);

/// Space for a catalogue with its reserve, and for the free space that an upload requires.
const DISK_MIB: u32 = 400;

/// The names of all artifacts.
fn artifacts(data: &Path) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut folders = vec![data.join("artifacts")];
    while let Some(folder) = folders.pop() {
        // A folder or file may be deleted meanwhile.
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.path().is_dir() {
                folders.push(entry.path());
            } else if name.len() == 64 {
                found.insert(name);
            }
        }
    }
    found
}

fn file_of(data: &Path, name: &str) -> PathBuf {
    data.join("artifacts").join(&name[..2]).join(&name[2..4]).join(name)
}

#[track_caller]
fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !done() {
        assert!(begun.elapsed() < SWEPT_WITHIN, "never: {what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[track_caller]
fn delete(server: &Server, path: &str) {
    server.send("DELETE", path, &[], &[]).expect(204);
}

#[test]
fn deleting_frees_disk_space_and_keeps_shared_artifacts_across_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let server = Server::start(&data, &[]);
    let capture = server.upload(&small_capture());
    let source = json!({ "kind": "capture", "capture_id": capture });
    let calibration = server.result_of("/api/v1/calibrations", &json!({ "source": source }));
    let scan = |scan: &str| {
        let source = json!({ "kind": "capture", "capture_id": capture, "scan": scan });
        server.result_of("/api/v1/scans", &json!({ "source": source, "calibration_id": calibration }))
    };
    let (kept, gone) = (scan("gauge"), scan("sphere"));
    let before = artifacts(&data);
    for (id, format) in [(&kept, "csv"), (&gone, "pcd")] {
        let job =
            server.run_job(&format!("/api/v1/scans/{id}/exports"), &json!({ "what": "cloud", "format": format }));
        assert_eq!(job["state"], "succeeded", "{job}");
    }
    let exported = server.get(&format!("/api/v1/scans/{kept}/exports/cloud.csv")).body;
    // A format of meshes; the answer lists those of clouds.
    let refused =
        server.post(&format!("/api/v1/scans/{kept}/exports"), &json!({ "what": "cloud", "format": "stl" }));
    assert!(refused.expect(422).to_string().contains("e57"), "{refused:?}");
    let both = artifacts(&data);
    assert_eq!(both.len(), before.len() + 2, "two exports");

    delete(&server, &format!("/api/v1/scans/{gone}"));
    let events = server.get("/api/v1/events?limit=200").expect(200);
    let event = events["items"].as_array().unwrap().iter().find(|event| event["kind"] == "scan.deleted").unwrap();
    assert_eq!(event["body"], json!({ "principal": "local", "actor": "rest", "source": "127.0.0.1" }));
    // Peaks, cloud, display points and export of one scan.
    wait_until("the scan's files go", || artifacts(&data).len() == both.len() - 4);
    let left = artifacts(&data);
    server.terminate();
    let orphan = data.join("work").join("0190-gone");
    std::fs::create_dir_all(orphan.join("pictures")).unwrap();
    let unnamed = file_of(&data, &"ab".repeat(32));
    std::fs::create_dir_all(unnamed.parent().unwrap()).unwrap();
    std::fs::write(&unnamed, "left by a crash").unwrap();

    let server = Server::start(&data, &[]);
    wait_until("what a dead process left goes", || !unnamed.exists() && !orphan.exists());
    assert_eq!(artifacts(&data), left, "the export is named by no record, and stays");
    assert_eq!(server.get(&format!("/api/v1/scans/{kept}/exports/cloud.csv")).body, exported);
    assert_eq!(server.get(&format!("/api/v1/scans/{kept}/cloud")).status, 200);
    delete(&server, &format!("/api/v1/scans/{kept}"));
    delete(&server, &format!("/api/v1/captures/{capture}"));
    // Document, report and residuals of the calibration.
    wait_until("only the calibration's files are left", || artifacts(&data).len() == 3);
    assert!(artifacts(&data).is_subset(&left));
    assert_eq!(server.get(&format!("/api/v1/calibrations/{calibration}/report")).status, 200);
    wait_until("the unpacked capture goes", || std::fs::read_dir(data.join("unpacked")).unwrap().count() == 0);
}

#[test]
fn on_a_full_disk_a_running_server_frees_space_by_deleting() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let Some(server) = Server::start_on_small_disk(&data, DISK_MIB) else { return };
    let capture = server.upload(&small_capture());
    // The disk in the mount namespace of the server.
    let inside = PathBuf::from(format!("/proc/{}/root", server.pid())).join(data.strip_prefix("/").unwrap());
    let mut fill = std::fs::File::create(inside.join("fill")).unwrap();
    let zeros = vec![0; 1 << 16];
    while fill.write_all(&zeros).is_ok() {}
    let session = || server.post("/api/v1/calibration-sessions", &json!({}));
    let mut n_sessions = 0;
    while session().status == 201 {
        n_sessions += 1;
        assert!(n_sessions < 10_000, "the disk is not full");
    }
    assert_eq!(session().expect(507)["type"], "urn:sheaf:problem:storage-full");
    delete(&server, &format!("/api/v1/captures/{capture}"));
    wait_until("the archive goes", || artifacts(&inside).is_empty());
    session().expect(201);
    drop(fill);
    std::fs::remove_file(inside.join("fill")).unwrap();
    // The next sweep restores the reserve.
    let session = session().expect(201);
    delete(&server, &format!("/api/v1/calibration-sessions/{}", session["id"].as_str().unwrap()));
    wait_until("the reserve is there", || inside.join("reserve").exists());
}

#[test]
fn an_empty_catalogue_beside_artifacts_prevents_the_start_and_nothing_is_deleted() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let server = Server::start(&data, &[]);
    server.upload(&small_capture());
    server.terminate();
    // Opening merges the write-ahead log into the database.
    Server::start(&data, &[]).terminate();
    let there = artifacts(&data);
    let catalogue = data.join("catalogue.sqlite3");
    let backup = data.join("backups").join("catalogue-schema-3-1.sqlite3");
    std::fs::copy(&catalogue, &backup).unwrap();
    for ruin in ["emptied", "missing"] {
        match ruin {
            "emptied" => std::fs::write(&catalogue, "").unwrap(),
            _ => std::fs::remove_file(&catalogue).unwrap(),
        }
        let output = Command::new(SHEAF)
            .args(["serve", "--listen", "127.0.0.1:0", "--data"])
            .arg(&data)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{stderr}");
        for word in ["artifacts", "copy the newest backup", backup.to_str().unwrap()] {
            assert!(stderr.contains(word), "{ruin}: {stderr}");
        }
        assert_eq!(artifacts(&data), there, "{ruin}");
    }
    std::fs::copy(&backup, &catalogue).unwrap();
    for ending in ["-wal", "-shm"] {
        let _ = std::fs::remove_file(data.join(format!("catalogue.sqlite3{ending}")));
    }
    let server = Server::start(&data, &[]);
    assert_eq!(server.get("/api/v1/captures").expect(200)["items"].as_array().map(Vec::len), Some(1));
}

#[test]
fn damaged_and_missing_files_give_the_same_error_before_a_byte_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let server = Server::start(&data, &[]);
    let capture = server.upload(&small_capture());
    let names = artifacts(&data);
    let file = file_of(&data, names.first().unwrap());
    let report = || -> Value {
        let mut problem = server.get(&format!("/api/v1/captures/{capture}/archive")).expect(503);
        problem.as_object_mut().unwrap().remove("cause").unwrap();
        problem
    };
    let mut bytes = std::fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&file, bytes).unwrap();
    let damaged = report();
    std::fs::remove_file(&file).unwrap();
    assert_eq!(report(), damaged);
    assert_eq!(damaged["type"], "urn:sheaf:problem:damaged");
    assert!(damaged["detail"].as_str().unwrap().contains(&format!("archive of capture {capture}")), "{damaged}");
    assert!(damaged["remedy"].as_str().unwrap().contains("restore"), "{damaged}");
}
