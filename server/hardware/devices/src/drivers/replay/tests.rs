//! The replay passes the contract suite, and plays what was recorded. Not covered: reading the capture folder of a real
//! station (see the tests of `capture`).

use std::path::{Path, PathBuf};
use std::time::Duration;

use capture::{
    CameraFormat, ChessboardTarget, Frame, GratingProjector, Manifest, NominalPosition, Pose, Scan,
    StageDescription, StageView,
};
use recording::{
    FrameLosses, FrameNote, RecordedPosition, RecordingEnd, RecordingHeader, RecordingWriter, RowNote,
};
use tempfile::TempDir;
use vision::{GreyImage, Pixels};

use super::{ImageSelection, Pace, ReplayConfig, ReplayDriver, ReplayError, ReplaySettings, ReplaySource, open};
use crate::contract::{self, CameraProfile, LaserProfile, StageProfile};
use crate::{Camera, CameraError, CameraRequest, DeviceSet, Driver, Stage, Trigger};

const WIDTH_PX: usize = 32;
const HEIGHT_PX: usize = 24;

/// Positions of the recorded scan; its frames have the grey levels 0, 1, 2, ….
const POSITIONS_MM: [f64; 5] = [-1.0, -0.5, 0.0, 0.5, 1.0];

#[test]
fn the_replay_passes_the_suite_of_cameras_from_files_and_from_memory() {
    let folder = recorded();
    for preload in [false, true] {
        let config = ReplayConfig { preload, ..repeated(folder.path()) };
        let profile =
            CameraProfile { frame_rate_hz: Some(200.0), frame_limit: Duration::from_millis(50), cable: None };
        contract::camera(&mut || Box::new(open(&config).unwrap().0), &profile);
        let settings = ReplaySettings {
            folder: folder.path().to_owned(),
            frame_rate_hz: 200.0,
            preload,
            ..ReplaySettings::default()
        };
        let driver = ReplayDriver(settings);
        contract::camera(&mut || driver.open(DeviceSet::ALL).unwrap().camera.unwrap(), &profile);
    }
}

#[test]
fn the_replay_passes_the_suite_of_stages() {
    let folder = recorded();
    let profile = StageProfile {
        speed_mm_s: 10.0,
        tolerance_mm: 1e-9,
        instant: true,
        motion_limit: Duration::from_millis(100),
        rest_limit: Duration::from_millis(100),
        reset_button: None,
        cable: None,
    };
    contract::stage(&mut || Box::new(open(&repeated(folder.path())).unwrap().1), &profile);
}

#[test]
fn the_replay_passes_the_suite_of_lasers() {
    let folder = recorded();
    let profile = LaserProfile { light: None, reaction_limit: Duration::from_millis(20), cable: None };
    contract::laser(&mut || Box::new(open(&repeated(folder.path())).unwrap().2), &profile);
}

#[test]
fn a_recording_passes_the_suites_of_cameras_and_stages() {
    let (_folder, file) = recorded_file(|_| 0);
    for preload in [false, true] {
        let settings =
            ReplaySettings { recording: file.clone(), frame_rate_hz: 200.0, preload, ..ReplaySettings::default() };
        let driver = ReplayDriver(settings);
        let profile =
            CameraProfile { frame_rate_hz: Some(200.0), frame_limit: Duration::from_millis(50), cable: None };
        contract::camera(&mut || driver.open(DeviceSet::ALL).unwrap().camera.unwrap(), &profile);
        let profile = StageProfile {
            speed_mm_s: 10.0,
            tolerance_mm: 1e-9,
            instant: true,
            motion_limit: Duration::from_millis(100),
            rest_limit: Duration::from_millis(100),
            reset_button: None,
            cable: None,
        };
        contract::stage(&mut || driver.open(DeviceSet::ALL).unwrap().stage.unwrap(), &profile);
    }
}

#[test]
fn the_rows_of_a_recorded_scan_are_played_with_their_positions_exposures_and_losses() {
    let (_folder, file) = recorded_file(|row| if row == 3 { 2 } else { 0 });
    let config = ReplayConfig { played: ReplaySource::Recording(file), ..scan(Path::new("")) };
    let (mut camera, stage, _) = open(&config).unwrap();
    assert_eq!((camera.settings().exposure_us, stage.capabilities().travel_mm), (700.0, (-1.0, 1.0)));
    camera.start().unwrap();
    let mut image = blank();
    for (row, position_mm) in POSITIONS_MM.into_iter().enumerate() {
        let info = camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
        assert_eq!((info.recorded_position_mm, info.exposure_us), (Some(position_mm), 700.0));
        assert_eq!(image.at(0, 0), row as f32, "another image than the recorded one");
        assert_eq!(info.lost_before, if row == 3 { 2 } else { 0 });
    }
    let end = camera.next_frame(&mut image, Duration::ZERO);
    assert!(matches!(end, Err(CameraError::EndOfRecording)), "{end:?}");
}

#[test]
fn a_scan_is_played_once_in_order_with_its_positions() {
    let folder = recorded();
    let (mut camera, mut stage, _) = open(&scan(folder.path())).unwrap();
    camera.start().unwrap();
    let mut image = blank();
    for (idx, position_mm) in POSITIONS_MM.into_iter().enumerate() {
        let info = camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
        assert_eq!((info.frame_id, info.recorded_position_mm), (idx as u64, Some(position_mm)));
        assert_eq!(image.at(0, 0), idx as f32, "another image than the recorded one");
        assert_eq!(stage.poll().unwrap().position_mm, Some(position_mm));
    }
    for _ in 0..2 {
        let end = camera.next_frame(&mut image, Duration::ZERO);
        assert!(matches!(end, Err(CameraError::EndOfRecording)), "{end:?}");
    }
    camera.stop().unwrap();
    camera.start().unwrap();
    assert_eq!(camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap().frame_id, 0);
}

#[test]
fn a_move_while_frames_play_ends_when_they_pass_its_target() {
    let folder = recorded();
    let (mut camera, mut stage, _) = open(&scan(folder.path())).unwrap();
    camera.start().unwrap();
    let mut image = blank();
    // Between two recorded positions the nearer one is accepted.
    assert_eq!(stage.start_move(0.3, 1.0).unwrap().target_mm, 0.5);
    let mut positions = Vec::new();
    while stage.poll().unwrap().moving {
        camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
        positions.push(stage.poll().unwrap().position_mm.unwrap());
    }
    assert_eq!(positions, [-1.0, -0.5, 0.0, 0.5]);
}

#[test]
fn a_move_before_the_first_frame_is_a_sweep_from_the_current_position() {
    let folder = recorded();
    for (from_mm, to_mm, expected_mm) in [
        (-1.0, 1.0, &POSITIONS_MM[..]),
        (-0.5, 0.5, &[-0.5, 0.0, 0.5]),
        (0.5, -0.5, &[0.5, 0.0, -0.5]),
        (1.0, -1.0, &[1.0, 0.5, 0.0, -0.5, -1.0]),
    ] {
        let (mut camera, mut stage, _) = open(&repeated(folder.path())).unwrap();
        let mut image = blank();
        stage.start_move(from_mm, 1.0).unwrap();
        camera.start().unwrap();
        stage.start_move(to_mm, 1.0).unwrap();
        let mut positions = Vec::new();
        while stage.poll().unwrap().moving {
            let info = camera.next_frame(&mut image, Duration::from_secs(1)).unwrap().unwrap();
            let position_mm = info.recorded_position_mm.unwrap();
            assert_eq!(
                f64::from(image.at(0, 0)),
                2.0 * (position_mm + 1.0),
                "another image than the recorded one"
            );
            positions.push(position_mm);
        }
        assert_eq!(positions, expected_mm);
    }
}

#[test]
fn a_triggered_image_is_the_one_recorded_at_the_stage_position() {
    let folder = recorded();
    let (mut camera, mut stage, _) = open(&scan(folder.path())).unwrap();
    assert_eq!(stage.capabilities().resolution_mm, 0.5);
    camera.configure(&CameraRequest { trigger: Some(Trigger::Software), ..Default::default() }).unwrap();
    camera.start().unwrap();
    let mut image = blank();
    // Grey levels number the images; back and forth, and twice at the same position.
    for (target_mm, position_mm, grey) in
        [(0.5, 0.5, 3.0), (-0.4, -0.5, 1.0), (-0.6, -0.5, 1.0), (1.0, 1.0, 4.0), (-1.0, -1.0, 0.0)]
    {
        assert_eq!(stage.start_move(target_mm, 1.0).unwrap().target_mm, position_mm);
        assert!(!stage.poll().unwrap().moving);
        camera.trigger().unwrap();
        let info = camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
        assert_eq!((info.recorded_position_mm, image.at(0, 0)), (Some(position_mm), grey));
    }
}

#[test]
fn frames_arrive_at_the_requested_rate() {
    let folder = recorded();
    let (mut camera, _, _) = open(&ReplayConfig { pace: Pace::Hz(50.0), ..repeated(folder.path()) }).unwrap();
    camera.start().unwrap();
    let mut image = blank();
    let mut exposed_at = Vec::new();
    for _ in 0..5 {
        exposed_at.push(camera.next_frame(&mut image, Duration::from_secs(1)).unwrap().unwrap().exposed_at);
    }
    let took = exposed_at[4] - exposed_at[0];
    // Four periods of 20 ms; on a busy machine later frames keep their due times unless they are very late.
    assert!(took >= Duration::from_millis(80), "five frames at 50 Hz within {took:?}");
}

#[test]
fn board_images_laser_images_and_stage_views_are_played() {
    let folder = recorded();
    let of = |images| ReplaySource::Folder { folder: folder.path().to_owned(), images };
    for (images, greys, position_mm) in [
        (ImageSelection::Boards, vec![100.0, 101.0], None),
        (ImageSelection::LaserImages, vec![200.0], None),
        (ImageSelection::StageViews, vec![150.0], Some(-20.0)),
    ] {
        let (mut camera, _, _) = open(&ReplayConfig { played: of(images), ..scan(folder.path()) }).unwrap();
        camera.start().unwrap();
        let mut image = blank();
        for grey in greys {
            let info = camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
            assert_eq!((image.at(3, 3), info.recorded_position_mm), (grey, position_mm));
        }
        assert!(camera.next_frame(&mut image, Duration::ZERO).is_err());
    }
}

#[test]
fn an_unreadable_image_is_reported_and_counted_as_lost() {
    let folder = recorded();
    let (mut camera, _, _) = open(&scan(folder.path())).unwrap();
    std::fs::write(folder.path().join("scan/1.png"), b"no image").unwrap();
    camera.configure(&CameraRequest { trigger: Some(Trigger::Free), ..Default::default() }).unwrap();
    camera.start().unwrap();
    let mut image = blank();
    camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
    let error = camera.next_frame(&mut image, Duration::ZERO).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("scans[0].frames[1].image"), "{error}: {cause}");
    let next = camera.next_frame(&mut image, Duration::ZERO).unwrap().unwrap();
    assert_eq!((next.frame_id, next.lost_before), (2, 1));
}

#[test]
fn invalid_recordings_are_refused_when_opened() {
    let folder = recorded();
    let of = |images| ReplaySource::Folder { folder: folder.path().to_owned(), images };
    let unknown = ReplayConfig { played: of(ImageSelection::Scan("plate".into())), ..scan(folder.path()) };
    assert!(matches!(open(&unknown), Err(ReplayError::Capture(_))));
    let timeless = ReplayConfig { pace: Pace::Hz(f64::NAN), ..scan(folder.path()) };
    assert!(matches!(open(&timeless), Err(ReplayError::BadPace { .. })));
    std::fs::write(folder.path().join("scan/4.png"), b"no image").unwrap();
    let unreadable = ReplayConfig { preload: true, ..scan(folder.path()) };
    let Err(ReplayError::Capture(cause)) = open(&unreadable) else { panic!("opened") };
    assert!(cause.to_string().contains("scans[0].frames[4].image"), "{cause}");
}

/// A recording of the same scan as [`recorded`], after one frame of the approach, with lost frames before some rows.
fn recorded_file(lost_before_row: impl Fn(usize) -> u64) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("scan.mcap");
    let header = RecordingHeader {
        name: "plane".into(),
        origin: "scan".into(),
        scan_id: None,
        calibration_id: None,
        software_version: "0".into(),
        simulated: None,
        started_at_ms: 0,
        target: ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() }.into(),
        projector: GratingProjector {
            wavelength_nm: 660.0,
            grating_lines_per_mm: 50.0,
            orders: vec![-1, 0, 1],
            line_direction: None,
        }
        .into(),
        stage: StageDescription::default(),
    };
    let mut writer = RecordingWriter::create(std::fs::File::create(&path).unwrap(), &header, None).unwrap();
    let image_of = |grey: u8| GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(vec![grey; WIDTH_PX * HEIGHT_PX]));
    let note = |sequence: u64, recorder: u64| FrameNote {
        sequence,
        captured_at_ns: 0,
        position: RecordedPosition::default(),
        exposure_us: 700.0,
        laser_on: true,
        lost_before: FrameLosses { recorder, ..FrameLosses::default() },
    };
    writer.frame(1, &note(7, 0), &image_of(255).unwrap()).unwrap();
    for (row, position_mm) in POSITIONS_MM.into_iter().enumerate() {
        let (sequence, position) = (10 + row as u64, NominalPosition::PositionMm(position_mm).into());
        writer.note(1, &RowNote { sequence, row: row as u64, position }).unwrap();
        let note = note(sequence, lost_before_row(row));
        writer.frame(2 + row as u64, &note, &image_of(row as u8).unwrap()).unwrap();
    }
    let (reason, lost) = (String::new(), FrameLosses::default());
    writer.finish(&RecordingEnd { reason, n_frames: 6, lost, n_notes_lost: 0 }).unwrap();
    (folder, path)
}

fn scan(folder: &Path) -> ReplayConfig {
    ReplayConfig {
        played: ReplaySource::Folder { folder: folder.to_owned(), images: ImageSelection::Scan("plane".into()) },
        pace: Pace::Unlimited,
        repeat: false,
        preload: false,
    }
}

fn repeated(folder: &Path) -> ReplayConfig {
    ReplayConfig { repeat: true, ..scan(folder) }
}

/// The background of the second frame is brighter than the frame itself: it shows another scene.
#[test]
fn a_frame_whose_background_differs_is_reported_as_lost() {
    let folder = recorded();
    let image_of = |levels: u8| {
        GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(vec![levels; WIDTH_PX * HEIGHT_PX])).unwrap()
    };
    // Dark except for its left half, unlike the frame.
    let elsewhere = (0..WIDTH_PX * HEIGHT_PX).map(|idx| if idx % WIDTH_PX < WIDTH_PX / 2 { 200 } else { 0 });
    let elsewhere = GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(elsewhere.collect())).unwrap();
    for (name, image) in [("off/same.png", image_of(0)), ("off/other.png", elsewhere)] {
        std::fs::create_dir_all(folder.path().join("off")).unwrap();
        capture::write_png(&folder.path().join(name), &image).unwrap();
    }
    let mut manifest = capture::Capture::open(folder.path()).unwrap().manifest;
    for (idx, frame) in manifest.scans[0].frames.iter_mut().enumerate() {
        frame.background = Some(if idx == 1 { "off/other.png" } else { "off/same.png" }.into());
    }
    capture::write_manifest(folder.path(), &manifest).unwrap();
    for preload in [true, false] {
        let (mut camera, _, _) = open(&ReplayConfig { preload, ..scan(folder.path()) }).unwrap();
        camera.start().unwrap();
        let mut image = blank();
        let mut next = || camera.next_frame(&mut image, Duration::from_secs(1));
        assert_eq!(next().unwrap().unwrap().lost_before, 0);
        let CameraError::Unreadable { cause, .. } = next().unwrap_err() else { panic!("it was played") };
        let message = cause.to_string();
        assert!(
            message.contains("scans[0].frames[1].background")
                && message.contains("cannot be subtracted from scans[0].frames[1].image"),
            "{message}"
        );
        assert_eq!(next().unwrap().unwrap().lost_before, 1);
    }
}

fn blank() -> GreyImage {
    GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap()
}

/// A capture folder of small images of one grey level each.
fn recorded() -> TempDir {
    let folder = TempDir::new().unwrap();
    let put = |name: &str, grey: u8| -> std::path::PathBuf {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let image = GreyImage::new(WIDTH_PX, HEIGHT_PX, Pixels::Eight(vec![grey; WIDTH_PX * HEIGHT_PX])).unwrap();
        capture::write_png(&path, &image).unwrap();
        name.into()
    };
    let frames = POSITIONS_MM.into_iter().enumerate();
    let frame = |(idx, position_mm): (usize, f64)| {
        Frame::new(put(&format!("scan/{idx}.png"), idx as u8), NominalPosition::PositionMm(position_mm))
    };
    let manifest = Manifest {
        format: "sheaf-capture/1".into(),
        stage: StageDescription::default(),
        background: None,
        camera: CameraFormat::of_size(WIDTH_PX, HEIGHT_PX),
        target: ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() }.into(),
        projector: GratingProjector {
            wavelength_nm: 660.0,
            grating_lines_per_mm: 50.0,
            orders: vec![-1, 0, 1],
            line_direction: None,
        }
        .into(),
        poses: vec![
            Pose {
                board: put("board/0.png", 100),
                laser: Some(put("laser/0.png", 200)),
                lasers: Vec::new(),
                background: None,
            },
            Pose { board: put("board/1.png", 101), laser: None, lasers: Vec::new(), background: None },
        ],
        stage_views: vec![StageView::new(put("stage/0.png", 150), NominalPosition::PositionMm(-20.0))],
        scans: vec![Scan { name: "plane".into(), frames: frames.map(frame).collect() }],
    };
    capture::write_manifest(folder.path(), &manifest).unwrap();
    folder
}
