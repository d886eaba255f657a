//! Files truncated at any byte, and files with flipped bits.

use recording::{RecordingError, RecordingFile, repair};

use crate::common::*;

/// An interrupted recording: its folder, path and bytes.
fn interrupted() -> (tempfile::TempDir, std::path::PathBuf, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 8, nothing_lost, false);
    let bytes = std::fs::read(&path).unwrap();
    (folder, path, bytes)
}

#[test]
fn a_recording_of_a_killed_process_contains_every_flushed_frame() {
    let (folder, path, _) = interrupted();
    let file = RecordingFile::open(&path).unwrap();
    assert_eq!((file.frames.len(), file.is_complete, file.end.is_none()), (N_FRAMES, false, true));
    assert!(!file.is_lossy(), "it ends between two records: nothing that was flushed is missing");
    let whole = folder.path().join("whole.mcap");
    let repaired = repair(&path, &whole).unwrap();
    assert_eq!((repaired.is_lossy(), repaired.was_complete), (false, false));
    let file = RecordingFile::open(&whole).unwrap();
    assert_eq!((file.frames.len(), file.is_complete), (N_FRAMES, true));
    assert_eq!((file.header.clone(), file.calibration.as_deref()), (header(), Some(CALIBRATION)));
    (0..N_FRAMES).for_each(|idx| assert_eq!(file.image(idx).unwrap(), test_image(idx, 8)));
}

#[test]
fn a_file_truncated_at_any_byte_opens_with_its_intact_part_or_is_refused() {
    let (folder, path, bytes) = interrupted();
    let cut = folder.path().join("cut.mcap");
    let mut n_frames_before = 0;
    for length in (0..bytes.len()).step_by(61).chain([bytes.len()]) {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        match RecordingFile::open(&cut) {
            Ok(file) => {
                assert!(file.frames.len() >= n_frames_before, "fewer frames in more bytes");
                n_frames_before = file.frames.len();
                (0..file.frames.len()).for_each(|idx| assert_eq!(file.image(idx).unwrap(), test_image(idx, 8)));
            }
            Err(error) => {
                assert!(n_frames_before == 0, "{length}: {error}");
                let is_expected =
                    matches!(error, RecordingError::NotMcap { .. } | RecordingError::NotARecording { .. });
                assert!(is_expected, "{error}");
            }
        }
    }
    assert_eq!(n_frames_before, N_FRAMES);
    drop(path);
}

#[test]
fn a_flipped_bit_loses_its_chunk_and_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 8, nothing_lost, true);
    let bytes = std::fs::read(&path).unwrap();
    let whole = RecordingFile::open(&path).unwrap();
    let flipped = folder.path().join("flipped.mcap");
    let repaired_path = folder.path().join("repaired.mcap");
    let (mut n_refused, mut n_lost) = (0, 0);
    for at in (64..bytes.len()).step_by(211) {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x10;
        std::fs::write(&flipped, &bytes).unwrap();
        let Ok(file) = RecordingFile::open(&flipped) else {
            n_refused += 1;
            continue;
        };
        // The remaining frames equal those written.
        for (idx, frame) in file.frames.iter().enumerate() {
            let original = (frame.note.sequence - 100) as usize;
            assert_eq!(file.image(idx).unwrap(), test_image(original, 8), "byte {at}");
        }
        if file.frames.len() < whole.frames.len() {
            assert!(
                !file.damaged_parts.is_empty() || !file.is_complete,
                "byte {at}: frames are missing without a report"
            );
            n_lost += 1;
        }
        let _ = std::fs::remove_file(&repaired_path);
        if let Ok(repaired) = repair(&flipped, &repaired_path) {
            let again = RecordingFile::open(&repaired_path);
            let n_again = again.map_or(0, |file| file.frames.len());
            assert!(n_again >= file.frames.len(), "byte {at}: repair lost frames");
            assert!(repaired.is_lossy() || n_again == whole.frames.len(), "byte {at}: a loss was not reported");
        }
    }
    assert!(n_lost > 3, "{n_lost} of the flipped bits hit a frame, {n_refused} the header");
}

#[test]
fn a_file_that_is_not_a_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    std::fs::write(&path, b"an image").unwrap();
    assert!(matches!(RecordingFile::open(&path), Err(RecordingError::NotMcap { .. })));
    let mut other = mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
    other.finish().unwrap();
    assert!(matches!(RecordingFile::open(&path), Err(RecordingError::NotARecording { .. })));
    assert!(matches!(
        RecordingFile::open(&folder.path().join("none")),
        Err(RecordingError::File { action: "open", .. })
    ));
    let repaired = repair(&path, &folder.path().join("b.mcap")).unwrap();
    assert_eq!((repaired.n_messages, repaired.was_complete), (0, true));
}
