//! The file as read by other programs: the reader of the MCAP project and the message types published by Foxglove,
//! both for Python (`mcap`, `mcap-protobuf-support`, `foxglove-schemas-protobuf`). Not covered: how Foxglove
//! displays it.

use std::process::Command;

use serde_json::Value;
use vision::Pixels;

use crate::common::*;

#[test]
fn another_reader_finds_topics_schemas_counts_and_the_same_pixels() {
    let Some(python) = reference::python() else { return };
    for bits in [8, 16] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        write(&path, bits, nothing_lost, true);
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/other_readers.py");
        let output = Command::new(&python).arg(script).arg(&path).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let seen: Value = serde_json::from_slice(&output.stdout).unwrap();
        let rows = N_FRAMES - FIRST_ROW;
        let expected = [
            ("/camera/image", "foxglove.RawImage", "protobuf", N_FRAMES),
            ("/camera/frame", "sheaf.Frame", "jsonschema", N_FRAMES),
            ("/profile", "foxglove.PointCloud", "protobuf", N_FRAMES),
            ("/peaks", "sheaf.Peaks", "jsonschema", N_FRAMES),
            ("/stage", "sheaf.Stage", "jsonschema", N_FRAMES),
            ("/scan/row", "sheaf.ScanRow", "jsonschema", rows),
            ("/devices/settings", "sheaf.DeviceSettings", "jsonschema", 1),
            ("/events", "sheaf.Event", "jsonschema", 1),
        ];
        for (topic, schema, encoding, n_messages) in expected {
            let found = &seen["topics"][topic];
            assert_eq!(
                (found["schema"].as_str(), found["encoding"].as_str(), found["n_messages"].as_u64()),
                (Some(schema), Some(encoding), Some(n_messages as u64)),
                "{topic}: {found}"
            );
        }
        assert_eq!(seen["topics"].as_object().unwrap().len(), expected.len());
        assert_eq!(seen["first_records"], serde_json::json!(["Header", "Metadata", "Attachment"]));
        assert_eq!(
            seen["attachments"],
            serde_json::json!({ "calibration.json": String::from_utf8_lossy(CALIBRATION) })
        );
        assert_eq!(seen["metadata"]["sheaf.recording"]["calibration_id"], "c0ffee");
        assert_eq!(seen["same_as_published"], serde_json::json!({ "RawImage": true, "PointCloud": true }));
        for (idx, image) in seen["images"].as_array().unwrap().iter().enumerate() {
            let expected: Vec<u8> = match test_image(idx, bits).pixels() {
                Pixels::Eight(pixels) => pixels.to_vec(),
                Pixels::Sixteen(pixels) => pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect(),
            };
            assert_eq!(image["hex"], expected.iter().map(|byte| format!("{byte:02x}")).collect::<String>());
            assert_eq!((&image["encoding"], &image["width"]), (&format!("mono{bits}").into(), &WIDTH_PX.into()));
            assert_eq!(image["log_time_ns"], at_ns(idx));
            assert_eq!(image["timestamp_ns"], at_ns(idx));
        }
        let point = seen["points"][0].as_array().unwrap();
        let metres: Vec<f64> = point.iter().map(|number| number.as_f64().unwrap()).collect();
        let expected = [0.001, -0.002, 0.4, 0.000_02, -1.0];
        assert!(metres.iter().zip(expected).all(|(got, wanted)| (got - wanted).abs() < 1e-7), "{metres:?}");
    }
}
