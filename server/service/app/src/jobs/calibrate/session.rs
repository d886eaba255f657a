//! Calibration images from a session.

use std::path::{Path, PathBuf};

use capture::{CameraFormat, Manifest, Pose, StageDescription, StageView, params::FORMAT};
use store::{ArtifactId, StoreError};

use crate::camera::correction::ImageDarkFrame;
use crate::error::AppError;
use crate::error::disk_problem;
use crate::jobs::calibrate::station::{make_folders, write_capture};
use crate::jobs::progress::Phase;
use crate::jobs::{CalibrateInput, ComputeContext, JobEnd, JobInput, Source};
use crate::resources::calibrations::used_station::UsedStation;
use crate::resources::captures::{capture_stage, nominal_position};
use crate::sessions::{Session, SessionBody, SessionImage, Sessions};

/// Writes the usable images of the session as the capture folder `folder`; returns the dark frame of each.
pub(super) fn gather_pictures(
    session_id: &str,
    ctx: &ComputeContext,
    folder: &Path,
) -> Result<Vec<Option<ImageDarkFrame>>, JobEnd> {
    ctx.report(0.0, Phase::CollectingImages, "collecting the images of the session");
    let session = Session::try_from(ctx.wait(ctx.catalogue.read().session(session_id))?)?;
    make_folders(folder)?;
    let mut dark_frames = Vec::new();
    let mut put = |kind: &str, idx: usize, image: &SessionImage| -> Result<PathBuf, JobEnd> {
        ctx.check_cancelled()?;
        let path = PathBuf::from(format!("{kind}/{idx:03}.png"));
        let bytes = ctx.wait(ctx.artifacts.read(&artifact(image)?))?;
        std::fs::write(folder.join(&path), bytes).map_err(disk_problem)?;
        dark_frames.push(image.dark_frame.clone());
        Ok(path)
    };
    let mut poses = Vec::new();
    for pose in session.body.poses.iter().filter(|pose| pose.board.is_readable()) {
        let idx = poses.len();
        let board = put("board", idx, &pose.board.image)?;
        let found = pose.laser.as_ref().filter(|laser| laser.is_readable());
        let laser = found.map(|found| put("laser", idx, &found.image)).transpose()?;
        let background = found.and_then(|found| found.background.as_ref());
        let background = background.map(|image| put("background", idx, image)).transpose()?;
        poses.push(Pose { board, laser, lasers: Vec::new(), background });
    }
    let mut stage_views = Vec::new();
    for view in session.body.stage_views.iter().filter(|view| view.board.is_readable()) {
        let board = put("stage", stage_views.len(), &view.board.image)?;
        stage_views.push(StageView::new(board, nominal_position(view.position)));
    }
    let body = &session.body;
    let manifest = Manifest {
        format: FORMAT.to_owned(),
        stage: StageDescription { kind: stage_of(&session.body), ..StageDescription::default() },
        background: None,
        camera: CameraFormat::of_size(body.width_px, body.height_px),
        target: body.target.clone(),
        projector: body.projector.clone(),
        poses,
        stage_views,
        scans: Vec::new(),
    };
    write_capture(folder, &manifest)?;
    Ok(dark_frames)
}

/// The stage kind of the views; a mix of both kinds is refused on reading.
fn stage_of(body: &SessionBody) -> capture::StageKind {
    capture_stage(body.stage_views.first().map_or(optics::StageKind::Linear, |view| view.position.kind()))
}

fn artifact(image: &SessionImage) -> Result<ArtifactId, StoreError> {
    ArtifactId::parse(&image.artifact).ok_or_else(|| StoreError::Damaged { id: image.artifact.clone() })
}

/// Options of the calibration job.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SolveSession {
    /// `auto`, `planes`, `pencil`, `grating`.
    pub light_model: Option<String>,
    /// `auto`, `on`, `off`.
    pub k3: Option<String>,
    /// The station that captured the images.
    pub station: Option<UsedStation>,
}

/// The calibration job of the session with its usable images.
///
/// # Errors
/// If the session does not exist or its images are not sufficient.
pub async fn solve_input(sessions: &Sessions, id: &str, how: SolveSession) -> Result<JobInput, AppError> {
    sessions.check_suffices(id).await?;
    Ok(JobInput::Calibration(CalibrateInput {
        source: Source::Station,
        light_model: how.light_model,
        k3: how.k3,
        leave_out_unreadable: false,
        n_poses: None,
        session_id: Some(id.to_owned()),
        station: how.station,
    }))
}
