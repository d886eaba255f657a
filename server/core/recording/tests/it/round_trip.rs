//! Written data is read back exactly. Not covered: that other programs can read it (`other_readers`).

use recording::{FrameLosses, RecordingFile};

use crate::common::*;

#[test]
fn frames_are_read_back_exactly_with_their_data() {
    for bits in [8, 16] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        write(&path, bits, nothing_lost, true);
        let file = RecordingFile::open(&path).unwrap();
        assert_eq!(file.header, header());
        assert_eq!(file.calibration.as_deref(), Some(CALIBRATION));
        assert_eq!(file.frames.len(), N_FRAMES);
        // Forwards and backwards: frames can be read in any order.
        for idx in (0..N_FRAMES).chain((0..N_FRAMES).rev()) {
            let frame = &file.frames[idx];
            assert_eq!(
                (frame.note, frame.at_ns, frame.shape),
                (note(idx), at_ns(idx), (WIDTH_PX, HEIGHT_PX, bits))
            );
            assert_eq!(file.image(idx).unwrap(), test_image(idx, bits));
        }
        assert_eq!((file.is_complete, file.is_lossy(), file.damaged_parts.len()), (true, false, 0));
        assert_eq!(file.settings[0].1.camera.settings["exposure_us"], 812.5);
        assert_eq!((file.events[0].1.kind.as_str(), file.events.len()), ("stage.moved", 1));
    }
}

#[test]
fn the_frames_of_a_scan_are_its_rows_at_their_positions() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, 8, nothing_lost, true);
    let (frames, n_missing) = RecordingFile::open(&path).unwrap().scan_frames();
    let positions: Vec<_> = frames.iter().map(|(idx, position)| (*idx, position.unwrap().value())).collect();
    let expected: Vec<_> = (FIRST_ROW..N_FRAMES).map(|idx| (idx, position_mm(idx))).collect();
    assert_eq!((positions, n_missing), (expected, 0));
}

#[test]
fn losses_are_reported_by_reason_and_position() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let lost = |idx: usize| match idx {
        2 => FrameLosses { camera: 3, ..FrameLosses::default() },
        4 => FrameLosses { incomplete: 1, recorder: 2, ..FrameLosses::default() },
        _ => FrameLosses::default(),
    };
    write(&path, 8, lost, true);
    let file = RecordingFile::open(&path).unwrap();
    let summary = file.summary();
    assert_eq!(summary.lost, FrameLosses { camera: 3, incomplete: 1, recorder: 2, ..FrameLosses::default() });
    let gaps: Vec<_> = summary.gaps.iter().map(|gap| (gap.after_frame, gap.lost.total())).collect();
    assert_eq!(gaps, [(Some(1), 3), (Some(3), 3)]);
    assert_eq!(summary.gaps[0].position.unwrap().value(), position_mm(2) + 0.001);
    assert!(file.is_lossy());
}
