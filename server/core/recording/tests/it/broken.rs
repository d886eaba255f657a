//! Files that were broken off anywhere, and files with flipped bits.

use recording::{RecordingError, RecordingFile, repair};

use crate::common::*;

/// The bytes of a recording whose process died, and the file to put them into.
fn broken_off() -> (tempfile::TempDir, std::path::PathBuf, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 8, nothing_lost, false);
    let bytes = std::fs::read(&path).unwrap();
    (folder, path, bytes)
}

#[test]
fn a_recording_whose_process_died_holds_every_frame_that_was_flushed() {
    let (folder, path, _) = broken_off();
    let file = RecordingFile::open(&path).unwrap();
    assert_eq!((file.frames.len(), file.is_whole, file.end.is_none()), (N_FRAMES, false, true));
    assert!(!file.is_lossy(), "it ends between two records: nothing that was flushed is missing");
    let whole = folder.path().join("whole.mcap");
    let repaired = repair(&path, &whole).unwrap();
    assert_eq!((repaired.is_lossy(), repaired.was_whole), (false, false));
    let file = RecordingFile::open(&whole).unwrap();
    assert_eq!((file.frames.len(), file.is_whole), (N_FRAMES, true));
    assert_eq!((file.header.clone(), file.calibration.as_deref()), (header(), Some(CALIBRATION)));
    (0..N_FRAMES).for_each(|idx| assert_eq!(file.image(idx).unwrap(), picture(idx, 8)));
}

#[test]
fn cut_off_at_any_byte_it_opens_with_all_that_lies_before_or_says_why_not() {
    let (folder, path, bytes) = broken_off();
    let cut = folder.path().join("cut.mcap");
    let mut n_frames_before = 0;
    for length in (0..bytes.len()).step_by(61).chain([bytes.len()]) {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        match RecordingFile::open(&cut) {
            Ok(file) => {
                assert!(file.frames.len() >= n_frames_before, "fewer frames in more bytes");
                n_frames_before = file.frames.len();
                (0..file.frames.len()).for_each(|idx| assert_eq!(file.image(idx).unwrap(), picture(idx, 8)));
            }
            Err(error) => {
                assert!(n_frames_before == 0, "{length}: {error}");
                let is_told =
                    matches!(error, RecordingError::NotMcap { .. } | RecordingError::NotARecording { .. });
                assert!(is_told, "{error}");
            }
        }
    }
    assert_eq!(n_frames_before, N_FRAMES);
    drop(path);
}

#[test]
fn a_flipped_bit_costs_the_chunk_it_is_in_and_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 8, nothing_lost, true);
    let bytes = std::fs::read(&path).unwrap();
    let whole = RecordingFile::open(&path).unwrap();
    let flipped = folder.path().join("flipped.mcap");
    let mended = folder.path().join("mended.mcap");
    let (mut n_noticed, mut n_lost) = (0, 0);
    for at in (64..bytes.len()).step_by(211) {
        let mut bytes = bytes.clone();
        bytes[at] ^= 0x10;
        std::fs::write(&flipped, &bytes).unwrap();
        let Ok(file) = RecordingFile::open(&flipped) else {
            n_noticed += 1;
            continue;
        };
        // What is still there is what was written.
        for (idx, frame) in file.frames.iter().enumerate() {
            let original = (frame.note.sequence - 100) as usize;
            assert_eq!(file.image(idx).unwrap(), picture(original, 8), "byte {at}");
        }
        if file.frames.len() < whole.frames.len() {
            assert!(
                !file.damages.is_empty() || !file.is_whole,
                "byte {at}: frames are missing and nobody says so"
            );
            n_lost += 1;
        }
        let _ = std::fs::remove_file(&mended);
        if let Ok(repaired) = repair(&flipped, &mended) {
            let again = RecordingFile::open(&mended);
            let n_again = again.map_or(0, |file| file.frames.len());
            assert!(n_again >= file.frames.len(), "byte {at}: mending lost frames");
            assert!(repaired.is_lossy() || n_again == whole.frames.len(), "byte {at}: lossy, and not said");
        }
    }
    assert!(n_lost > 3, "{n_lost} of the flipped bits hit a frame, {n_noticed} the header");
}

#[test]
fn what_is_no_recording_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    std::fs::write(&path, b"a picture").unwrap();
    assert!(matches!(RecordingFile::open(&path), Err(RecordingError::NotMcap { .. })));
    let mut other = mcap::Writer::new(std::fs::File::create(&path).unwrap()).unwrap();
    other.finish().unwrap();
    assert!(matches!(RecordingFile::open(&path), Err(RecordingError::NotARecording { .. })));
    assert!(matches!(
        RecordingFile::open(&folder.path().join("none")),
        Err(RecordingError::File { act: "open", .. })
    ));
    let repaired = repair(&path, &folder.path().join("b.mcap")).unwrap();
    assert_eq!((repaired.n_messages, repaired.was_whole), (0, true));
}
