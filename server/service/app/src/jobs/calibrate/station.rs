//! Calibration images from the simulated station, where a virtual operator moves the board.

use std::path::{Path, PathBuf};

use capture::{
    CameraFormat, Manifest, Pose, StageDescription, StageView, params::FORMAT, write_manifest, write_png,
};
use station::StampedFrame;

use crate::camera::correction::ImageDarkFrame;
use crate::config::AppConfig;
use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::jobs::calibrate::N_POSES;
use crate::jobs::progress::{Phase, Step};
use crate::jobs::{CalibrateInput, JobEnd, StationContext};
use crate::resources::captures::{capture_stage, nominal_position, without_folder};
use crate::resources::scan_run::stage_kind;
use crate::sessions::image_capture::{Exposures, ImageCapture, LaserShot};
use crate::sessions::virtual_operator::VirtualOperator;

/// Folders of the images of a calibration.
pub(super) const FOLDERS: [&str; 4] = ["board", "laser", "background", "stage"];

/// Captures all images of a calibration into the capture folder `folder`; `share` is its part of the job. Returns the dark
/// frame of each image.
pub(super) fn take_pictures(
    input: &CalibrateInput,
    ctx: &StationContext,
    folder: &Path,
    share: f64,
) -> Result<Vec<Option<ImageDarkFrame>>, JobEnd> {
    let twin = ctx.station.simulation().ok_or_else(nobody_moves_the_board)?;
    let operator = VirtualOperator::new(twin, ctx.config.target.clone());
    let lease = ctx.take_station("calibrating")?;
    let camera = ImageCapture::new(lease, ctx.cancel.clone(), Exposures::default());
    let n_poses = input.n_poses.unwrap_or(N_POSES);
    let positions = operator.stage_positions();
    let mut album = Album::new(folder, 2 * n_poses + positions.len(), ctx, share)?;
    if !ctx.station.status().homed {
        album.report_activity(&camera, Phase::Homing, "homing the stage");
        camera.home()?;
    }
    camera.go_to(operator.zero())?;
    for pose_idx in 0..n_poses {
        let number = pose_idx + 1;
        let pose = format!("pose {number} of {n_poses}");
        operator.hold_board(pose_idx, n_poses);
        album.report_activity(
            &camera,
            Phase::ExposingBoard.counted(number, n_poses),
            &format!("{pose}: exposing the board"),
        );
        let board = album.add("board", &*camera.board()?)?;
        album.report_activity(
            &camera,
            Phase::ExposingLaser.counted(number, n_poses),
            &format!("{pose}: exposing the laser lines"),
        );
        let LaserShot { lines, background } = camera.laser()?;
        let laser = album.add("laser", &lines)?;
        let background = background.map(|frame| album.keep("background", &frame)).transpose()?;
        album.poses.push(Pose { board, laser: Some(laser), lasers: Vec::new(), background });
    }
    operator.lay_board(&positions);
    for (idx, position) in positions.iter().enumerate() {
        let (number, of) = (idx + 1, positions.len());
        let words = format!("stage position {number} of {of}: exposing the board");
        album.report_activity(&camera, Phase::ExposingStage.counted(number, of), &words);
        let position = camera.go_to(*position)?;
        let board = album.add("stage", &*camera.board()?)?;
        album.stage_views.push(StageView::new(board, nominal_position(position)));
    }
    album.finish()
}

fn nobody_moves_the_board() -> AppError {
    AppError::new(ErrorKind::Impossible, "this station has no virtual operator to move the board")
        .remedy("start a calibration session and capture the board in several poses")
}

/// Images being written to a capture folder.
struct Album<'a> {
    ctx: &'a StationContext,
    folder: &'a Path,
    share: f64,
    n_images: usize,
    n_taken: usize,
    size_px: Option<(usize, usize)>,
    poses: Vec<Pose>,
    stage_views: Vec<StageView>,
    dark_frames: Vec<Option<ImageDarkFrame>>,
}

impl<'a> Album<'a> {
    fn new(folder: &'a Path, n_images: usize, ctx: &'a StationContext, share: f64) -> Result<Self, JobEnd> {
        make_folders(folder)?;
        let (poses, stage_views, dark_frames) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { ctx, folder, share, n_images, n_taken: 0, size_px: None, poses, stage_views, dark_frames })
    }

    fn report_activity(&self, camera: &ImageCapture, step: impl Into<Step>, words: &str) {
        camera.report_activity(words);
        self.ctx.report(self.share * self.n_taken as f64 / self.n_images as f64, step, words);
    }

    /// Adds one of the expected images.
    fn add(&mut self, folder: &str, frame: &StampedFrame) -> Result<PathBuf, JobEnd> {
        self.n_taken += 1;
        self.keep(folder, frame)
    }

    fn keep(&mut self, folder: &str, frame: &StampedFrame) -> Result<PathBuf, JobEnd> {
        self.ctx.check_cancelled()?;
        let n_before = match folder {
            "stage" => self.stage_views.len(),
            _ => self.poses.len(),
        };
        let path = PathBuf::from(format!("{folder}/{n_before:03}.png"));
        write_png(&self.folder.join(&path), &frame.image).map_err(disk_problem)?;
        self.dark_frames.push(ImageDarkFrame::of(frame));
        self.size_px = Some((frame.image.width(), frame.image.height()));
        Ok(path)
    }

    fn finish(self) -> Result<Vec<Option<ImageDarkFrame>>, JobEnd> {
        let size_px = self.size_px.unwrap_or_default();
        let stage = stage_kind(&self.ctx.station.status());
        let manifest = manifest(&self.ctx.config, size_px, stage, self.poses, self.stage_views);
        write_capture(self.folder, &manifest)?;
        Ok(self.dark_frames)
    }
}

/// Creates the image folders.
pub(super) fn make_folders(folder: &Path) -> Result<(), JobEnd> {
    FOLDERS
        .iter()
        .try_for_each(|name| std::fs::create_dir(folder.join(name)))
        .map_err(|error| disk_problem(error).into())
}

/// Writes the manifest.
pub(super) fn write_capture(folder: &Path, manifest: &Manifest) -> Result<(), JobEnd> {
    write_manifest(folder, manifest).map_err(|error| without_folder(error.into(), folder).into())
}

fn manifest(
    config: &AppConfig,
    size_px: (usize, usize),
    stage: optics::StageKind,
    poses: Vec<Pose>,
    stage_views: Vec<StageView>,
) -> Manifest {
    Manifest {
        format: FORMAT.to_owned(),
        stage: StageDescription { kind: capture_stage(stage), ..StageDescription::default() },
        background: None,
        camera: CameraFormat::of_size(size_px.0, size_px.1),
        target: config.target.clone(),
        projector: config.projector.clone(),
        poses,
        stage_views,
        scans: Vec::new(),
    }
}
