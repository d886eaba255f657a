//! Calibrations on the simulated station, compared with its true parameters; sessions and activations.
//!
//! Not tested: other stations than these two, and boards held by people.

use crate::error::ErrorKind;
use calibration::CalibrationDocument;
use capture::{GratingProjector, PlanesProjector, Projector};
use optics::{Calibration, StageKind, StagePosition};
use store::ArtifactId;
use twin::{ProjectorShape, Scene};
use vision::LineDirection;

use super::*;
use crate::access::principal::Principal;
use crate::jobs::calibrate::{SolveSession, solve_input};
use crate::jobs::progress::Silent;
use crate::jobs::{CalibrateInput, JobInput, Source};
use crate::resources::calibrations::Calibrations;
use crate::sessions::image_capture::Exposures;
use crate::sessions::{NewSession, Sessions, VirtualBoard};
use pipeline::{calibrate_features, open_capture, read_features};

/// Best result of the joint fit of camera, boards and light with a corner noise of 0.02 px: the processing core's
/// own bound for calibrations (`server/cli/tests/it/rigs/rig_a.rs`).
const SYSTEMATIC_MM: f64 = 0.020;

fn from_station() -> CalibrateInput {
    CalibrateInput {
        source: Source::Station,
        light_model: None,
        k3: None,
        leave_out_unreadable: false,
        n_poses: None,
        session_id: None,
        station: None,
    }
}

async fn calibrated(jobs: &Jobs, input: CalibrateInput) -> String {
    let job = jobs.submit(JobInput::Calibration(input), "test").await.unwrap();
    let record = ended(jobs, &job.id).await.record;
    assert_eq!(record.state, JobState::Succeeded, "{record:?}");
    record.result.unwrap().id
}

async fn document(bench: &Bench, id: &str) -> (Vec<u8>, CalibrationDocument) {
    let record = bench.parts.catalogue.read().calibration(id).await.unwrap();
    let bytes = bench.parts.artifacts.read(&record.document).await.unwrap();
    let document = CalibrationDocument::parse(std::str::from_utf8(&bytes).unwrap()).unwrap();
    (bytes, document)
}

/// Depth error on noise-free pixels of sphere and gauge, whose true positions the twin provides.
fn systematic_rmse_mm(bench: &Bench, calibration: &Calibration) -> f64 {
    let twin = bench.parts.station.simulation().unwrap();
    let (model, renderer) = (twin.model(), twin.renderer());
    let parts = [twin::SceneKind::Sphere { radius_mm: 18.9 }, twin::SceneKind::Gauge { height_mm: 8.9 }];
    let mut squares = Vec::new();
    for (part, position_mm) in parts.iter().flat_map(|part| [-8.0, 0.0, 8.0].map(|at| (part, at))) {
        for point in renderer.truth_points(&part.placed(&model, 0x100), position_mm) {
            let pixel = nalgebra::Vector2::new(point.u_px, point.v_px);
            if let Some(hit) = calibration.triangulate(point.order, &pixel, None) {
                squares.push((hit.hit_in_camera.xyz.z - point.hit_in_camera_mm.z).powi(2));
            }
        }
    }
    assert!(squares.len() > 1000);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_virtual_operator_calibrates_a_station_to_a_few_micrometres_and_restores_the_part() {
    let bench = Bench::new(&StationShape::default()).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let id = calibrated(&jobs, from_station()).await;
    let (_, document) = document(&bench, &id).await;
    let rmse_mm = systematic_rmse_mm(&bench, &document.calibration());
    let summary = bench.parts.catalogue.read().calibration(&id).await.unwrap().summary;
    let sigma_mm = summary["systematic_sigma_mm"].as_f64().unwrap();
    println!("systematic depth error {rmse_mm:.4} mm, its own sigma {sigma_mm:.4} mm");
    // The error is one sample of a distribution with its stated σ: 2 σ covers 95 %.
    assert!(rmse_mm < SYSTEMATIC_MM && rmse_mm < 2.0 * sigma_mm, "{rmse_mm} mm, σ {sigma_mm} mm");
    assert!(!matches!(&*bench.parts.station.simulation().unwrap().scene(), Scene::Board(_)));
}

#[tokio::test(flavor = "multi_thread")]
async fn independent_lasers_are_calibrated_as_one_plane_each() {
    for (lines, line_direction) in [(1, LineDirection::Rows), (2, LineDirection::Columns)] {
        let projector = ProjectorShape::Lasers { lines };
        let shape = StationShape { projector, line_direction, ..StationShape::default() };
        let direction = GratingProjector::name_of(line_direction);
        let planes = PlanesProjector { lines, line_direction: direction, switched: false };
        let bench = Bench::with(&shape, |config| config.projector = Projector::Planes(planes)).await;
        let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
        let id = calibrated(&jobs, from_station()).await;
        let (_, document) = document(&bench, &id).await;
        let calibration = document.calibration();
        let optics::LightSurfaces::Planes(found) = &calibration.light else { panic!("{:?}", calibration.light) };
        assert_eq!(found.len(), lines);
        let rmse_mm = systematic_rmse_mm(&bench, &calibration);
        let summary = bench.parts.catalogue.read().calibration(&id).await.unwrap().summary;
        let sigma_mm = summary["systematic_sigma_mm"].as_f64().unwrap();
        println!("{lines} lasers: systematic depth error {rmse_mm:.4} mm, its own sigma {sigma_mm:.4} mm");
        assert!(rmse_mm < SYSTEMATIC_MM && rmse_mm < 2.0 * sigma_mm, "{rmse_mm} mm, σ {sigma_mm} mm");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stored_calibration_equals_that_of_the_command_line_from_the_same_images() {
    let bench = Bench::new(&small()).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let id = calibrated(&jobs, from_station()).await;
    let record = bench.parts.catalogue.read().calibration(&id).await.unwrap();
    let (bytes, _) = document(&bench, &id).await;
    let capture_id = record.capture_id.unwrap();
    let captures = bench.parts.captures.clone();
    let by_command_line = tokio::task::spawn_blocking(move || {
        let out = captures.check_out(&capture_id).unwrap();
        let quiet = Silent;
        let capture = open_capture(&out.folder, &quiet).unwrap();
        let features = read_features(&capture, false, &quiet).unwrap();
        calibrate_features(&capture, &features, &Default::default(), &quiet).unwrap().document.to_json()
    });
    assert_eq!(String::from_utf8(bytes).unwrap(), by_command_line.await.unwrap());
    // And once more from the stored capture: the same content is the same calibration.
    let capture_id = bench.parts.catalogue.read().calibration(&id).await.unwrap().capture_id.unwrap();
    let again = CalibrateInput { source: Source::Capture { capture_id }, ..from_station() };
    assert_eq!(calibrated(&jobs, again).await, id);
    let page = bench.parts.artifacts.read(&record.report.unwrap()).await.unwrap();
    let page = String::from_utf8(page).unwrap();
    assert!(page.contains("Calibration report") && !page.contains("/tmp"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_calibration_leaves_nothing_and_frees_the_station() {
    let bench = Bench::new(&small()).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let job = jobs.submit(JobInput::Calibration(from_station()), "test").await.unwrap();
    let begun = Instant::now();
    while !jobs.view(&job.id).await.unwrap().record.message.contains("pose 2 of 12") {
        assert!(begun.elapsed() < PATIENCE);
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    jobs.cancel(&job.id, "test").await.unwrap();
    assert_eq!(ended(&jobs, &job.id).await.record.state, JobState::Cancelled);
    let page = store::Page { before: None, limit: 10 };
    assert!(bench.parts.catalogue.read().calibrations(&page).await.unwrap().records.is_empty());
    assert_eq!(std::fs::read_dir(bench.parts.artifacts.workbench().scratch()).unwrap().count(), 0);
    assert!(!matches!(&*bench.parts.station.simulation().unwrap().scene(), Scene::Board(_)));
    assert_eq!(bench.parts.station.status().job_id, None);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_collects_poses_step_by_step_and_solves_them() {
    let bench = Bench::new(&small()).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let parts = bench.parts.clone();
    let open = || {
        Sessions::new(
            parts.config.clone(),
            parts.catalogue.clone(),
            parts.artifacts.clone(),
            parts.station.clone(),
        )
    };
    let sessions = open();
    let session = sessions.create(&by(), NewSession::default()).await.unwrap();
    let id = session.id.clone();
    // Without a board nothing is detected, and the response says so.
    let blind = sessions.add_pose(&by(), &id, Some(1)).await.unwrap();
    assert!(blind.body.poses[0].board.problem.is_some() && !blind.body.poses[0].board.is_readable());
    assert_eq!(
        solve_input(&sessions, &id, SolveSession::default()).await.unwrap_err().kind,
        ErrorKind::Impossible
    );
    let stale = sessions.add_pose(&by(), &id, Some(1)).await.unwrap_err();
    assert_eq!(stale.kind, ErrorKind::Changed);
    sessions.delete_pose(&by(), &id, &blind.body.poses[0].id, Some(2)).await.unwrap();
    for pose in 0..8 {
        sessions.place_virtual_board(VirtualBoard::Pose { pose }).unwrap();
        let now = sessions.add_pose(&by(), &id, None).await.unwrap();
        let taken = now.body.poses.last().unwrap();
        assert_eq!((taken.board.corners.len(), taken.board.problem.as_deref()), (88, None));
        assert!(taken.laser.as_ref().unwrap().n_segments > 0);
    }
    // Another browser, or a restarted server, continues the session.
    let sessions = open();
    sessions.place_virtual_board(VirtualBoard::Stage).unwrap();
    for position_mm in [-20.0, 0.0, 20.0] {
        let early = solve_input(&sessions, &id, SolveSession::default()).await;
        let has_too_few = position_mm > -20.0;
        assert_eq!(
            early.err().map(|problem| problem.kind),
            has_too_few.then_some(ErrorKind::Impossible),
            "{position_mm} mm"
        );
        sessions.add_stage_view(&by(), &id, StagePosition::LinearMm(position_mm), None).await.unwrap();
    }
    sessions.place_virtual_board(VirtualBoard::Away).unwrap();
    let gathered = sessions.get(&id).await.unwrap().body;
    assert_eq!((gathered.poses.len(), gathered.stage_views.len()), (8, 3));
    // The twin tilts its boards by 11 to 28° and holds them near its standoff of 400 mm.
    for pose in &gathered.poses {
        assert!((5.0..35.0).contains(&pose.board.tilt_deg.unwrap()), "{:?}", pose.board.tilt_deg);
        assert!((340.0..440.0).contains(&pose.board.distance_mm.unwrap()), "{:?}", pose.board.distance_mm);
    }
    let input = solve_input(&sessions, &id, SolveSession::default()).await.unwrap();
    let job = jobs.submit(input, "test").await.unwrap();
    sessions.note_job(&by(), &id, &job.id).await.unwrap();
    let record = ended(&jobs, &job.id).await.record;
    let (_, document) = document(&bench, &record.result.unwrap().id).await;
    // Eight poses instead of twelve.
    let rmse_mm = systematic_rmse_mm(&bench, &document.calibration());
    assert!(rmse_mm < SYSTEMATIC_MM * (12.0_f64 / 8.0).sqrt(), "{rmse_mm}");
    assert_eq!(sessions.get(&id).await.unwrap().body.job_id, Some(job.id));
    let artifact = ArtifactId::parse(&gathered.poses[0].board.image.artifact).unwrap();
    bench.parts.artifacts.read(&artifact).await.unwrap();
    sessions.delete(&by(), &id).await.unwrap();
    assert_eq!(sessions.get(&id).await.unwrap_err().kind, ErrorKind::NotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_axis_of_a_turntable_is_found_by_the_virtual_operator_and_in_a_session() {
    let shape = StationShape { stage: StageKind::Rotary, ..small() };
    let bench = Bench::new(&shape).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let id = calibrated(&jobs, CalibrateInput { n_poses: Some(8), ..from_station() }).await;
    check_axis(&bench, &document(&bench, &id).await.1.calibration());

    let sessions = sessions_of(&bench);
    let session = sessions.create(&by(), NewSession::default()).await.unwrap().id;
    for pose in 0..8 {
        sessions.place_virtual_board(VirtualBoard::Pose { pose }).unwrap();
        sessions.add_pose(&by(), &session, None).await.unwrap();
    }
    sessions.place_virtual_board(VirtualBoard::Stage).unwrap();
    let travel = sessions.add_stage_view(&by(), &session, StagePosition::LinearMm(1.0), None).await.unwrap_err();
    assert!(travel.detail.contains("stage turns"), "{travel:?}");
    for angle_deg in [-30.0, -15.0, 15.0, 30.0] {
        sessions.add_stage_view(&by(), &session, StagePosition::RotaryDeg(angle_deg), None).await.unwrap();
        let suffices = sessions.check_suffices(&session).await.is_ok();
        assert_eq!(suffices, angle_deg > 0.0, "{angle_deg}°: two angles do not determine the axis");
    }
    sessions.place_virtual_board(VirtualBoard::Away).unwrap();
    let input = solve_input(&sessions, &session, SolveSession::default()).await.unwrap();
    let job = jobs.submit(input, "test").await.unwrap();
    let record = ended(&jobs, &job.id).await.record;
    check_axis(&bench, &document(&bench, &record.result.unwrap().id).await.1.calibration());
}

fn sessions_of(bench: &Bench) -> Sessions {
    let parts = bench.parts.clone();
    Sessions::new(parts.config.clone(), parts.catalogue.clone(), parts.artifacts.clone(), parts.station.clone())
}

/// A session with this many poses; its id, and the number of line points in them.
async fn session_of(sessions: &Sessions, exposures: Exposures, n_poses: usize) -> (String, usize) {
    let new = NewSession { exposures: Some(exposures), ..NewSession::default() };
    let session = sessions.create(&by(), new).await.unwrap().id;
    let mut n_points = 0;
    for pose in 0..n_poses {
        sessions.place_virtual_board(VirtualBoard::Pose { pose }).unwrap();
        let poses = sessions.add_pose(&by(), &session, None).await.unwrap().body.poses;
        let laser = poses[pose].laser.as_ref().unwrap();
        n_points += laser.n_points;
        assert_eq!((laser.problem.as_deref(), poses[pose].board.problem.as_deref()), (None, None));
    }
    sessions.place_virtual_board(VirtualBoard::Away).unwrap();
    (session, n_points)
}

#[tokio::test(flavor = "multi_thread")]
async fn ambient_light_is_subtracted_from_the_laser_images_of_a_session() {
    // White has 90 of 255 levels in the laser images, and 180 in those of the board.
    let shape = StationShape { ambient_levels: 90.0, ..StationShape::default() };
    let in_light = Exposures { board_exposure_us: 2.0 * twin::live::LASER_EXPOSURE_US, ..Exposures::default() };
    let without = Exposures { background_above_levels: None, ..in_light };
    let (bench, dark) = (Bench::new(&shape).await, Bench::new(&StationShape::default()).await);
    let (sessions, dark_sessions) = (sessions_of(&bench), sessions_of(&dark));
    let (_, n_in_the_dark) = session_of(&dark_sessions, Exposures::default(), 3).await;
    let (_, n_without) = session_of(&sessions, without, 3).await;
    let (_, n_points) = session_of(&sessions, in_light, 3).await;
    println!("{n_points} points in the light, {n_without} without subtraction, {n_in_the_dark} in the dark");
    assert!(100 * n_points > 98 * n_in_the_dark, "{n_points} of {n_in_the_dark}");
    assert!(100 * n_without < 90 * n_in_the_dark, "the light does not matter: {n_without} of {n_in_the_dark}");

    let (session, _) = session_of(&sessions, in_light, 8).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let input = solve_input(&sessions, &session, SolveSession::default()).await.unwrap();
    let job = jobs.submit(input, "test").await.unwrap();
    let record = ended(&jobs, &job.id).await.record;
    assert!(!record.message.contains("Warning"), "{}", record.message);
    let id = record.result.unwrap().id;
    let (_, document) = document(&bench, &id).await;
    let rmse_mm = systematic_rmse_mm(&bench, &document.calibration());
    println!("systematic depth error {rmse_mm:.4} mm");
    assert!(rmse_mm < SYSTEMATIC_MM, "{rmse_mm} mm");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_laser_off_image_is_not_subtracted_in_the_dark_nor_from_another_scene() {
    let bench = Bench::new(&small()).await;
    let sessions = sessions_of(&bench);
    let (session, _) = session_of(&sessions, Exposures::default(), 1).await;
    let laser_of =
        async |session: &str| sessions.get(session).await.unwrap().body.poses.swap_remove(0).laser.unwrap();
    assert_eq!(laser_of(&session).await.background, None);
    // The simulated station illuminates the board only while the laser is off.
    let always = Exposures { background_above_levels: Some(0.0), ..Exposures::default() };
    let new = NewSession { exposures: Some(always), ..NewSession::default() };
    let session = sessions.create(&by(), new).await.unwrap().id;
    sessions.place_virtual_board(VirtualBoard::Pose { pose: 0 }).unwrap();
    sessions.add_pose(&by(), &session, None).await.unwrap();
    let laser = laser_of(&session).await;
    assert!(laser.problem.is_some_and(|problem| problem.contains("keep the light as it is")));
    assert_eq!(laser.background, None);
    let bad = Exposures { background_above_levels: Some(-1.0), ..Exposures::default() };
    let new = NewSession { exposures: Some(bad), ..NewSession::default() };
    let refused = sessions.create(&by(), new).await.unwrap_err();
    assert_eq!(refused.pointer.as_deref(), Some("/exposures/background_above_levels"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_cannot_be_read_is_listed_as_damaged_and_prevents_no_new_one() {
    let bench = Bench::new(&small()).await;
    let sessions = sessions_of(&bench);
    let body = serde_json::json!({ "name": 1 });
    let unreadable =
        store::SessionRecord { id: "u".to_owned(), version: 1, body, created_at_ms: 1, changed_at_ms: 1 };
    bench.parts.catalogue.commit(vec![store::Change::InsertSession(unreadable)]).await.unwrap();
    let created = sessions.create(&by(), NewSession::default()).await.unwrap();
    assert_eq!(created.body.exposures, Exposures::default());
    let listed = sessions.list(&store::Page { before: None, limit: 10 }).await.unwrap();
    assert_eq!((listed.records.len(), listed.damaged.len()), (1, 1));
    assert_eq!((listed.damaged[0].kind, listed.damaged[0].id.as_str()), ("session", "u"));
}

/// Direction and position of the axis are within 4 σ of the truth.
fn check_axis(bench: &Bench, calibration: &Calibration) {
    let found = calibration.stage.unwrap().rotary().unwrap();
    let truth = bench.parts.station.simulation().unwrap().model().stage.rotary().unwrap();
    let (first, second) = optics::rotation::completing_frame(&found.direction);
    let off = truth.with_point_near(&found.point_mm).point_mm - found.point_mm;
    let n = calibration.covariance.nrows() - 4;
    let errors = [first.dot(&truth.direction), second.dot(&truth.direction), first.dot(&off), second.dot(&off)];
    for (idx, error) in errors.into_iter().enumerate() {
        let sigma = calibration.covariance[(n + idx, n + idx)].sqrt();
        println!("axis, step {idx}: {error:.2e} = {:.2} σ", error / sigma);
        assert!(error.abs() < 4.0 * sigma, "step {idx}: {error} of σ {sigma}");
    }
    // Accurate enough to measure: 0.1 mm on a part is about 1 mrad at this size.
    assert!(errors[2].hypot(errors[3]) < 0.1, "{off:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn activations_are_logged_and_can_be_rolled_back_one_by_one() {
    let bench = Bench::new(&small()).await;
    let jobs = Jobs::start_with(bench.parts.clone(), Arc::new(as_if_elsewhere)).await.unwrap();
    let parts = &bench.parts;
    let calibrations = Calibrations::new(
        parts.catalogue.clone(),
        parts.artifacts.clone(),
        parts.live.clone(),
        parts.station.clone(),
    );
    let one = calibrated(&jobs, CalibrateInput { n_poses: Some(8), ..from_station() }).await;
    let capture_id = parts.catalogue.read().calibration(&one).await.unwrap().capture_id.unwrap();
    let planes = CalibrateInput {
        source: Source::Capture { capture_id },
        light_model: Some("planes".to_owned()),
        ..from_station()
    };
    let two = calibrated(&jobs, planes).await;
    let in_use = || parts.live.watch_calibration().borrow().as_ref().map(|tables| tables.calibration().id.clone());
    let last_act = async || calibrations.active().await.unwrap().map(|act| act.seq);
    assert_eq!(in_use(), None);
    calibrations.activate(&one, Some(None), "Anna", None).await.unwrap();
    let seq = last_act().await;
    calibrations.activate(&one, None, "Anna", None).await.unwrap();
    assert_eq!(last_act().await, seq, "activating the active calibration is not logged");
    assert_eq!(calibrations.activate(&two, Some(None), "Bert", None).await.unwrap_err().kind, ErrorKind::Changed);
    calibrations.activate(&two, Some(Some(one.clone())), "Bert", None).await.unwrap();
    assert_eq!(in_use().as_ref(), Some(&two));
    // A new process restores the active calibration.
    let reborn = LiveBus::default();
    let later =
        Calibrations::new(parts.catalogue.clone(), parts.artifacts.clone(), reborn.clone(), parts.station.clone());
    later.load_active().await.unwrap();
    assert_eq!(reborn.watch_calibration().borrow().as_ref().unwrap().calibration().id, two);
    assert_eq!(calibrations.roll_back("Anna").await.unwrap().calibration_id.as_ref(), Some(&one));
    assert_eq!(in_use().as_ref(), Some(&one));
    assert_eq!(calibrations.roll_back("Anna").await.unwrap().calibration_id, None);
    assert_eq!(in_use(), None);
    assert_eq!(calibrations.roll_back("Anna").await.unwrap_err().kind, ErrorKind::Conflict);
    assert_eq!(calibrations.activate("nowhere", None, "Anna", None).await.unwrap_err().kind, ErrorKind::NotFound);
    // Planes miss the curvature of the sheets by far more than noise.
    let difference = calibrations.difference(&one, &two).await.unwrap();
    assert!(difference.total.rms_mm > 0.05, "{:?}", difference.total);
    assert_eq!(calibrations.difference(&one, &one).await.unwrap().total.max_mm, 0.0);
}

fn by() -> Principal {
    Principal::local("test", "test", None)
}
