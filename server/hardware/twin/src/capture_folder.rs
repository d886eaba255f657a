//! A capture folder as delivered by the simulated station, with the ground truth.

use parking_lot::Mutex;
use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use capture::{
    CameraFormat, CaptureError, Frame, GratingProjector, ImageFileError, Manifest, PlanesProjector, Pose,
    Projector, Scan, StageDescription, StageView, params::FORMAT, write_manifest, write_png,
};
use optics::StageKind;
use rayon::prelude::*;
use remedy::Remedy;

use crate::model::shape::ProjectorShape;
use crate::model::station::StationModel;
use crate::part::poses::{board_poses, stage_board, usual_target};
use crate::part::scene::{Scene, SceneKind};
use crate::render::renderer::Renderer;
use crate::truth::{CSV_HEADER, csv_rows, truth_json};

/// Truth is written for every fourth frame of a scan.
pub const TRUTH_EVERY_FRAMES: usize = 4;

/// Angles at which a board on a turntable is captured.
const STAGE_VIEWS_DEG: [f64; 7] = [-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0];

/// Random stream of the first part, derived from a station's seed.
const PART_STREAM: u64 = 0x100;

/// Contents of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct CaptureRequest {
    /// Number of board poses, each captured under ambient light and under laser light.
    pub n_poses: usize,
    /// Stage positions at which the board is captured, mm; on a turntable, degrees.
    pub stage_positions: Vec<f64>,
    /// Scans of parts.
    pub scans: Vec<ScanRequest>,
}

/// A scan to record; positions are centred on 0.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanRequest {
    /// Name of the scan and of its folder.
    pub name: String,
    /// The part on the stage.
    pub part: SceneKind,
    /// Number of frames.
    pub n_frames: usize,
    /// Travel between frames, mm; on a turntable, degrees.
    pub step: f64,
}

/// Progress of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Images written.
    pub done: usize,
    /// Total number of images.
    pub total: usize,
}

/// Why a capture folder was not completed.
#[derive(Debug, thiserror::Error)]
pub enum TwinCaptureError {
    /// The folder is not empty.
    #[error("{} is not empty", folder.display())]
    FolderNotEmpty {
        /// The folder.
        folder: PathBuf,
    },
    /// A name that is not valid for a folder.
    #[error("scan name \"{name}\" cannot name a folder")]
    ScanName {
        /// The name.
        name: String,
    },
    /// A folder or file cannot be written.
    #[error("cannot write {}", path.display())]
    Unwritable {
        /// The folder or file.
        path: PathBuf,
        /// The error of the operating system.
        #[source]
        cause: std::io::Error,
    },
    /// An image cannot be written.
    #[error("an image of the capture was not written")]
    Image {
        /// The underlying error.
        #[source]
        cause: ImageFileError,
    },
    /// The manifest cannot be written.
    #[error("the manifest of the capture was not written")]
    Manifest {
        /// The underlying error.
        #[source]
        cause: CaptureError,
    },
    /// The caller cancelled.
    #[error("recording was cancelled after {done} of {total} images")]
    Cancelled {
        /// Images written.
        done: usize,
        /// Total number of images.
        total: usize,
    },
}

impl Remedy for TwinCaptureError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::FolderNotEmpty { .. } => "give a new folder".into(),
            Self::ScanName { .. } => "use letters, digits, - and _, each name once".into(),
            Self::Unwritable { .. } => "check that the disk is not full and that its permissions allow it".into(),
            Self::Image { cause } => return cause.remedy(),
            Self::Manifest { cause } => return cause.remedy(),
            Self::Cancelled { .. } => return None,
        })
    }
}

impl CaptureRequest {
    /// The images for a calibration, and scans of a gauge block and a ball: 12 poses, 5 stage views (turntable: 7), 2 ×
    /// 40 frames (turntable: slightly more than one revolution).
    pub fn standard(model: &StationModel) -> Self {
        let scale = model.shape.field_scale().min(1.0);
        let scan = |part: SceneKind| ScanRequest {
            name: part.name().to_owned(),
            part,
            n_frames: 40,
            step: match model.shape.stage {
                StageKind::Linear => 0.8 * scale,
                StageKind::Rotary => 9.6,
            },
        };
        let stage_positions = match model.shape.stage {
            StageKind::Linear => [-20.0, -10.0, 0.0, 10.0, 20.0].map(|at: f64| at * scale).to_vec(),
            StageKind::Rotary => STAGE_VIEWS_DEG.to_vec(),
        };
        Self {
            n_poses: 12,
            stage_positions,
            scans: vec![scan(SceneKind::Gauge { height_mm: 8.9 }), scan(SceneKind::Sphere { radius_mm: 18.9 })],
        }
    }
}

impl ScanRequest {
    /// Stage position of a frame, rounded to the nanometre, so that manifests are readable.
    fn position(&self, frame: usize) -> f64 {
        let at = (frame as f64 - (self.n_frames as f64 - 1.0) / 2.0) * self.step;
        (at * 1e6).round() / 1e6
    }
}

/// Illumination of an image.
#[derive(Clone, Copy)]
enum Light {
    Ambient,
    Laser,
}

/// One image to write.
struct Shot {
    path: PathBuf,
    scene_idx: usize,
    position: f64,
    light: Light,
}

/// Records the content of `request` into the new folder `folder`: images, `capture.json`, `truth.json` and
/// `truth-<scan>.csv`.
///
/// `on_progress` is called after every image and may cancel. The bytes do not depend on the number of threads.
///
/// # Errors
/// [`TwinCaptureError`]; an incomplete folder has no `capture.json`.
pub fn capture_folder(
    model: &StationModel,
    request: &CaptureRequest,
    folder: &Path,
    on_progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<(), TwinCaptureError> {
    check_names(request)?;
    make_folders(request, folder)?;
    let renderer = Renderer::new(model);
    let poses = board_poses(model, request.n_poses);
    let stage = (!request.stage_positions.is_empty()).then(|| stage_board(model, &request.stage_positions));
    let parts: Vec<(String, Scene)> = request
        .scans
        .iter()
        .zip(PART_STREAM..)
        .map(|(scan, stream)| (scan.name.clone(), scan.part.placed(model, stream)))
        .collect();
    let boards = poses.iter().chain(&stage).map(|board| Scene::Board(board.clone()));
    let scenes: Vec<Scene> = boards.chain(parts.iter().map(|(_, scene)| scene.clone())).collect();
    let manifest = manifest(model, request);
    write_images(&renderer, &scenes, &shots(request, &manifest), folder, on_progress)?;
    for (scan, (_, scene)) in request.scans.iter().zip(&parts) {
        write_truth_points(&renderer, scan, scene, folder)?;
    }
    let truth = truth_json(model, &poses, stage.as_ref(), &parts);
    write_text(&folder.join("truth.json"), &format!("{truth:#}\n"))?;
    write_manifest(folder, &manifest).map_err(|cause| TwinCaptureError::Manifest { cause })
}

fn check_names(request: &CaptureRequest) -> Result<(), TwinCaptureError> {
    let mut seen = std::collections::HashSet::new();
    for ScanRequest { name, .. } in &request.scans {
        let plain = name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_'));
        if name.is_empty() || !plain || !seen.insert(name) {
            return Err(TwinCaptureError::ScanName { name: name.clone() });
        }
    }
    Ok(())
}

fn make_folders(request: &CaptureRequest, folder: &Path) -> Result<(), TwinCaptureError> {
    let unwritable = |path: &Path, cause| TwinCaptureError::Unwritable { path: path.to_owned(), cause };
    std::fs::create_dir_all(folder).map_err(|cause| unwritable(folder, cause))?;
    if std::fs::read_dir(folder).map_err(|cause| unwritable(folder, cause))?.next().is_some() {
        return Err(TwinCaptureError::FolderNotEmpty { folder: folder.to_owned() });
    }
    let scans = request.scans.iter().map(|scan| format!("scan-{}", scan.name));
    for name in ["board", "laser", "stage"].map(String::from).into_iter().chain(scans) {
        let path = folder.join(name);
        std::fs::create_dir(&path).map_err(|cause| unwritable(&path, cause))?;
    }
    Ok(())
}

fn manifest(model: &StationModel, request: &CaptureRequest) -> Manifest {
    let shape = &model.shape;
    Manifest {
        format: FORMAT.to_owned(),
        stage: StageDescription { kind: capture_kind(shape.stage), ..StageDescription::default() },
        background: None,
        camera: CameraFormat::of_size(shape.width_px, shape.height_px),
        target: usual_target(model),
        projector: projector(model),
        poses: (0..request.n_poses)
            .map(|idx| Pose {
                board: format!("board/{idx:03}.png").into(),
                laser: Some(format!("laser/{idx:03}.png").into()),
                lasers: Vec::new(),
                background: None,
            })
            .collect(),
        stage_views: (0..)
            .zip(&request.stage_positions)
            .map(|(idx, &at)| {
                StageView::new(format!("stage/{idx:03}.png"), capture_kind(shape.stage).position(at))
            })
            .collect(),
        scans: request.scans.iter().map(|scan| scan_entry(scan, shape.stage)).collect(),
    }
}

/// Nominal values of the station's projector.
pub fn projector(model: &StationModel) -> Projector {
    let shape = &model.shape;
    let line_direction = GratingProjector::name_of(shape.line_direction);
    match shape.projector {
        ProjectorShape::Grating => Projector::Grating(GratingProjector {
            wavelength_nm: shape.wavelength_nm,
            grating_lines_per_mm: shape.lines_per_mm,
            orders: model.orders.clone(),
            line_direction,
        }),
        ProjectorShape::Lasers { lines } => {
            Projector::Planes(PlanesProjector { lines, line_direction, switched: false })
        }
    }
}

/// The same in a manifest.
fn capture_kind(kind: StageKind) -> capture::StageKind {
    match kind {
        StageKind::Linear => capture::StageKind::Linear,
        StageKind::Rotary => capture::StageKind::Rotary,
    }
}

fn scan_entry(scan: &ScanRequest, stage: StageKind) -> Scan {
    let frame = |idx| {
        Frame::new(format!("scan-{}/{idx:05}.png", scan.name), capture_kind(stage).position(scan.position(idx)))
    };
    Scan { name: scan.name.clone(), frames: (0..scan.n_frames).map(frame).collect() }
}

/// All images of the manifest. Scenes: the poses, the board on the stage (if any), the parts.
fn shots(request: &CaptureRequest, manifest: &Manifest) -> Vec<Shot> {
    let mut shots = Vec::new();
    for (scene_idx, pose) in manifest.poses.iter().enumerate() {
        shots.push(Shot { path: pose.board.clone(), scene_idx, position: 0.0, light: Light::Ambient });
        if let Some(laser) = &pose.laser {
            shots.push(Shot { path: laser.clone(), scene_idx, position: 0.0, light: Light::Laser });
        }
    }
    let mut scene_idx = request.n_poses;
    for view in &manifest.stage_views {
        let (path, position) = (view.board.clone(), view.position().value());
        shots.push(Shot { path, scene_idx, position, light: Light::Ambient });
    }
    scene_idx += usize::from(!manifest.stage_views.is_empty());
    for (scene_idx, scan) in (scene_idx..).zip(&manifest.scans) {
        shots.extend(scan.frames.iter().map(|frame| Shot {
            path: frame.image.clone(),
            scene_idx,
            position: frame.position().value(),
            light: Light::Laser,
        }));
    }
    shots
}

fn write_images(
    renderer: &Renderer,
    scenes: &[Scene],
    shots: &[Shot],
    folder: &Path,
    on_progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<(), TwinCaptureError> {
    let total = shots.len();
    let done = Mutex::new(0);
    shots.par_iter().enumerate().try_for_each(|(image_number, shot)| {
        let scene = &scenes[shot.scene_idx];
        let image = match shot.light {
            Light::Ambient => renderer.board_image(scene, shot.position, image_number as u64),
            Light::Laser => renderer.laser_image(scene, shot.position, image_number as u64),
        };
        write_png(&folder.join(&shot.path), &image).map_err(|cause| TwinCaptureError::Image { cause })?;
        let mut done = done.lock();
        *done += 1;
        match on_progress(Progress { done: *done, total }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(TwinCaptureError::Cancelled { done: *done, total }),
        }
    })
}

fn write_truth_points(
    renderer: &Renderer,
    scan: &ScanRequest,
    scene: &Scene,
    folder: &Path,
) -> Result<(), TwinCaptureError> {
    let frames: Vec<usize> = (0..scan.n_frames).step_by(TRUTH_EVERY_FRAMES).collect();
    let rows: Vec<String> = frames
        .par_iter()
        .map(|&frame| csv_rows(frame, &renderer.truth_points(scene, scan.position(frame))))
        .collect();
    write_text(&folder.join(format!("truth-{}.csv", scan.name)), &(CSV_HEADER.to_owned() + &rows.concat()))
}

fn write_text(path: &Path, text: &str) -> Result<(), TwinCaptureError> {
    std::fs::write(path, text).map_err(|cause| TwinCaptureError::Unwritable { path: path.to_owned(), cause })
}
