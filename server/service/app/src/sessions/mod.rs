//! Calibration sessions: a user moves the board, the server captures the images and reports the detections at once.
//!
//! Sessions are stored on the server and can be continued in another browser or after a restart. Solving one is a job; the
//! active calibration does not change until the result is activated.

mod body;
mod camera_so_far;
mod checks;
mod detection;
mod found;
pub mod image_capture;
mod needs;
mod stored;
pub mod virtual_operator;

use crate::camera::background::Background;
use crate::camera::correction::ImageDarkFrame;
use crate::events::{Event, SessionVersion, event};
use parking_lot::Mutex;
use std::sync::Arc;

use capture::{Projector, Target};
use optics::{StageKind, StagePosition};
use station::cancel::CancelFlag;
use station::wall_clock::now_ms;
use station::{Purpose, StampedFrame, StationHandle, StationLease};
use store::{Artifacts, Change, DamagedRow, FinishedFile, Listed, Page, SessionRecord, StoreError};

use crate::access::principal::Principal;
use crate::config::AppConfig;
use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::stored_scan::new_id;
use crate::sessions::checks::{check_exposures, check_kind, check_new, check_room};
use crate::sessions::image_capture::{Exposures, ImageCapture, LaserShot};
use crate::sessions::stored::to_stored;
use crate::sessions::virtual_operator::VirtualOperator;

pub use body::{
    BoardImage, CameraSoFar, LaserImage, Session, SessionBody, SessionImage, SessionPose, SessionStageView,
};
pub use detection::BoardDetection;
pub use needs::{Need, SessionNeeds};

/// Maximum number of images in a session: five times what any calibration needs.
const PICTURE_LIMIT: usize = 120;

/// Minimum number of usable boards for a calibration.
const FEWEST_BOARDS: usize = 3;

/// Request to create a session.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NewSession {
    /// Its name.
    pub name: Option<String>,
    /// The calibration board; default: the configured one.
    pub target: Option<Target>,
    /// The line projector; default: the configured one.
    pub projector: Option<Projector>,
    /// Exposure settings.
    pub exposures: Option<Exposures>,
}

/// Defaults of a new session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionDefaults {
    /// The configured board.
    pub target: Target,
    /// The configured line projector.
    pub projector: Projector,
    /// Exposure settings.
    pub exposures: Exposures,
}

/// Where the virtual operator of the simulated station holds the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VirtualBoard {
    /// In one of the predefined poses.
    Pose {
        /// Index of the pose, from 0.
        pose: usize,
    },
    /// On the stage, for stage views.
    Stage,
    /// Removed; the previous scene returns to the stage.
    Away,
}

/// The calibration sessions of the service.
#[derive(Clone)]
pub struct Sessions {
    config: Arc<AppConfig>,
    catalogue: EventedCatalogue,
    artifacts: Arc<dyn Artifacts>,
    station: StationHandle,
    /// Serialises changes: capturing takes too long for a version check alone.
    turn: Arc<tokio::sync::Mutex<()>>,
    operator: Arc<Mutex<Option<VirtualOperator>>>,
    /// Serialises detections: several browsers may request them.
    eye: Arc<tokio::sync::Mutex<()>>,
}

impl Sessions {
    /// Over the store, with this station.
    pub fn new(
        config: Arc<AppConfig>,
        catalogue: EventedCatalogue,
        artifacts: Arc<dyn Artifacts>,
        station: StationHandle,
    ) -> Self {
        Self {
            config,
            catalogue,
            artifacts,
            station,
            turn: Arc::default(),
            operator: Arc::default(),
            eye: Arc::default(),
        }
    }

    /// Defaults of a new session: the configured board and projector, and the exposures of the newest session, if it can
    /// be read.
    pub async fn defaults(&self) -> Result<SessionDefaults, AppError> {
        let newest = self.list(&Page { before: None, limit: 1 }).await?.records.pop();
        Ok(SessionDefaults {
            target: self.config.target.clone(),
            projector: self.config.projector.clone(),
            exposures: newest.map_or_else(Exposures::default, |session| session.body.exposures),
        })
    }

    /// Creates a session.
    #[cfg(test)]
    pub async fn create(&self, by: &Principal, new: NewSession) -> Result<Session, AppError> {
        self.create_with(by, new, |_| Vec::new()).await
    }

    /// Creates a session, with further changes in the same transaction.
    pub async fn create_with(
        &self,
        by: &Principal,
        new: NewSession,
        and: impl FnOnce(&Session) -> Vec<Change>,
    ) -> Result<Session, AppError> {
        let now = now_ms();
        let defaults = self.defaults().await?;
        let body = SessionBody {
            name: new.name.unwrap_or_else(|| "calibration".to_owned()),
            target: new.target.unwrap_or(defaults.target),
            projector: new.projector.unwrap_or(defaults.projector),
            exposures: new.exposures.unwrap_or(defaults.exposures),
            width_px: 0,
            height_px: 0,
            poses: Vec::new(),
            stage_views: Vec::new(),
            camera: CameraSoFar::default(),
            job_id: None,
        };
        check_new(&body)?;
        let session = Session { id: new_id(), version: 1, body, created_at_ms: now, changed_at_ms: now };
        let entry = event(
            &session.id,
            Event::SessionCreated(SessionVersion { actor: by.actor.clone(), version: session.version }),
        );
        let mut changes = and(&session);
        changes.extend([Change::InsertSession(record(&session)), entry]);
        self.catalogue.commit(changes).await?;
        Ok(session)
    }

    /// A session.
    pub async fn get(&self, id: &str) -> Result<Session, AppError> {
        self.catalogue.read().session(id).await?.try_into()
    }

    /// Sessions, newest first; those that cannot be read count as damaged.
    pub async fn list(&self, page: &Page) -> Result<Listed<Session>, AppError> {
        let Listed { records, mut damaged, next } = self.catalogue.read().sessions(page).await?;
        let mut readable = Vec::with_capacity(records.len());
        for record in records {
            let id = record.id.clone();
            match Session::try_from(record) {
                Ok(session) => readable.push(session),
                Err(_) => damaged.push(DamagedRow { kind: "session", id }),
            }
        }
        Ok(Listed { records: readable, damaged, next })
    }

    /// Detects the board in the newest frame of a running live view, else in a single frame; the session is not changed.
    pub async fn detect_board(&self, id: &str) -> Result<BoardDetection, AppError> {
        let _eye = self.eye.lock().await;
        let body = self.get(id).await?.body;
        let frame = self.station.snapshot().await?;
        tokio::task::block_in_place(|| detection::detect_in_frame(&frame, body))
    }

    /// Captures the board as held now, with the laser off and on. `expected`: refused unless the session has this version.
    pub async fn add_pose(&self, by: &Principal, id: &str, expected: Option<i64>) -> Result<Session, AppError> {
        self.change(by, id, expected, |sessions, body| {
            check_room(body)?;
            let camera = sessions.image_capture(id, body, "capturing a calibration pose")?;
            let board = camera.board()?;
            let LaserShot { lines, background } = camera.laser()?;
            drop(camera);
            let board = sessions.keep_board(&board, body)?;
            let stored = sessions.keep(&lines)?;
            let background = match background {
                Some(frame) => Some((Background::new(&frame), sessions.keep(&frame)?)),
                None => None,
            };
            let laser = found::lines_in(&lines.image, stored, background, body.projector.direction_of(0));
            body.poses.push(SessionPose { id: new_id(), board, laser: Some(laser) });
            camera_so_far::learn_camera(body);
            Ok(())
        })
        .await
    }

    /// Changes the exposure settings of the images to come.
    pub async fn set_exposures(
        &self,
        by: &Principal,
        id: &str,
        exposures: Exposures,
        expected: Option<i64>,
    ) -> Result<Session, AppError> {
        check_exposures(&exposures, "")?;
        self.change(by, id, expected, move |_, body| {
            body.exposures = exposures;
            Ok(())
        })
        .await
    }

    /// Deletes a pose.
    pub async fn delete_pose(
        &self,
        by: &Principal,
        id: &str,
        pose_id: &str,
        expected: Option<i64>,
    ) -> Result<Session, AppError> {
        let pose_id = pose_id.to_owned();
        self.change(by, id, expected, move |_, body| {
            remove(&mut body.poses, "pose", &pose_id, |pose| &pose.id)?;
            camera_so_far::learn_camera(body);
            Ok(())
        })
        .await
    }

    /// Moves the stage to a position and captures the board on it.
    pub async fn add_stage_view(
        &self,
        by: &Principal,
        id: &str,
        position: StagePosition,
        expected: Option<i64>,
    ) -> Result<Session, AppError> {
        self.change(by, id, expected, move |sessions, body| {
            check_room(body)?;
            check_kind(position, &sessions.station.status())?;
            let camera = sessions.image_capture(id, body, "capturing a stage view")?;
            let position = camera.go_to(position)?;
            let frame = camera.board()?;
            drop(camera);
            let board = sessions.keep_board(&frame, body)?;
            body.stage_views.push(SessionStageView { id: new_id(), position, board });
            Ok(())
        })
        .await
    }

    /// Deletes a stage view.
    pub async fn delete_stage_view(
        &self,
        by: &Principal,
        id: &str,
        view_id: &str,
        expected: Option<i64>,
    ) -> Result<Session, AppError> {
        let view_id = view_id.to_owned();
        self.change(by, id, expected, move |_, body| {
            remove(&mut body.stage_views, "stage view", &view_id, |view| &view.id)
        })
        .await
    }

    /// Sets where the virtual operator of a simulated station holds the board.
    pub fn place_virtual_board(&self, place: VirtualBoard) -> Result<(), AppError> {
        let twin = self.station.simulation().ok_or_else(|| {
            AppError::new(ErrorKind::Conflict, "this station is not simulated").remedy("move the board by hand")
        })?;
        let mut operator = self.operator.lock();
        if place == VirtualBoard::Away {
            *operator = None;
            return Ok(());
        }
        let operator = operator.get_or_insert_with(|| VirtualOperator::new(twin, self.config.target.clone()));
        match place {
            VirtualBoard::Pose { pose } if pose >= PICTURE_LIMIT => {
                return Err(AppError::new(ErrorKind::Impossible, format!("pose {pose} does not exist"))
                    .remedy(format!("give a number below {PICTURE_LIMIT}")));
            }
            VirtualBoard::Pose { pose } => operator.hold_board(pose, virtual_operator::N_POSES),
            VirtualBoard::Stage | VirtualBoard::Away => operator.lay_board(&operator.stage_positions()),
        }
        Ok(())
    }

    /// Refuses a session without enough usable images for a calibration.
    pub async fn check_suffices(&self, id: &str) -> Result<(), AppError> {
        let session = self.get(id).await?;
        let n_readable = session.body.poses.iter().filter(|pose| pose.board.is_readable()).count();
        if n_readable < FEWEST_BOARDS {
            return Err(AppError::new(
                ErrorKind::Impossible,
                format!("a calibration needs {FEWEST_BOARDS} readable boards, the session has {n_readable}"),
            )
            .remedy("capture the board in more poses with different tilts"));
        }
        let views = session.body.stage_views.iter().filter(|view| view.board.is_readable());
        let positions: Vec<StagePosition> = views.map(|view| view.position).collect();
        let (travels, angles): (Vec<StagePosition>, Vec<StagePosition>) =
            positions.iter().partition(|position| position.kind() == StageKind::Linear);
        let travels_mm: Vec<f64> = travels.iter().map(|position| position.value()).collect();
        let square = session.body.target.square_mm();
        calibration::check_stage_positions(&travels_mm, square.x_mm.min(square.y_mm))
            .map_err(pipeline::Failure::from)?;
        if !angles.is_empty() {
            calibration::check_stage_angles(angles.iter().map(|angle| angle.value()))
                .map_err(pipeline::Failure::from)?;
        }
        Ok(())
    }

    /// Records the job that was started to solve a session.
    pub async fn note_job(&self, by: &Principal, id: &str, job_id: &str) -> Result<(), AppError> {
        let job_id = job_id.to_owned();
        self.change(by, id, None, move |_, body| {
            body.job_id = Some(job_id);
            Ok(())
        })
        .await?;
        Ok(())
    }

    /// Deletes a session; its results are kept.
    pub async fn delete(&self, by: &Principal, id: &str) -> Result<(), AppError> {
        let _turn = self.turn.lock().await;
        self.catalogue.read().session(id).await?;
        let entry = event(id, Event::SessionDeleted(by.initiator()));
        self.catalogue.commit(vec![Change::DeleteSession(id.to_owned()), entry]).await?;
        Ok(())
    }

    /// Changes a session on a blocking thread and stores it as its next version.
    async fn change(
        &self,
        by: &Principal,
        id: &str,
        expected: Option<i64>,
        act: impl FnOnce(&Self, &mut SessionBody) -> Result<(), AppError> + Send,
    ) -> Result<Session, AppError> {
        let _turn = self.turn.lock().await;
        let mut session = self.get(id).await?;
        if expected.is_some_and(|expected| expected != session.version) {
            return Err(changed());
        }
        tokio::task::block_in_place(|| act(self, &mut session.body))?;
        session.version += 1;
        session.changed_at_ms = now_ms();
        let entry =
            event(id, Event::SessionChanged(SessionVersion { actor: by.actor.clone(), version: session.version }));
        match self.catalogue.commit(vec![Change::UpdateSession(record(&session)), entry]).await {
            Ok(_) => Ok(session),
            Err(StoreError::Changed { .. }) => Err(changed()),
            Err(error) => Err(error.into()),
        }
    }

    fn image_capture(&self, id: &str, body: &SessionBody, activity: &str) -> Result<ImageCapture, AppError> {
        let epoch = self.station.stop_epoch();
        let purpose = Purpose { job_id: id.to_owned(), activity: activity.to_owned(), epoch };
        let lease: StationLease = self.station.lease(purpose)?;
        // A laser that cannot be switched off would be subtracted from its own lines.
        let is_switched = self.station.status().laser.capabilities.switched;
        let background_above_levels = body.exposures.background_above_levels.filter(|_| is_switched);
        let exposures = Exposures { background_above_levels, ..body.exposures };
        Ok(ImageCapture::new(lease, CancelFlag::default(), exposures))
    }

    fn keep_board(&self, frame: &StampedFrame, body: &mut SessionBody) -> Result<BoardImage, AppError> {
        let size_px = (frame.image.width(), frame.image.height());
        detection::check_size(body, size_px)?;
        (body.width_px, body.height_px) = size_px;
        Ok(found::board_in(&frame.image, self.keep(frame)?, &body.target))
    }

    fn keep(&self, frame: &StampedFrame) -> Result<SessionImage, AppError> {
        let path = self.artifacts.workbench().scratch().join(format!("{}.png", new_id()));
        capture::write_png(&path, &frame.image).map_err(disk_problem)?;
        let artifact =
            tokio::runtime::Handle::current().block_on(self.artifacts.adopt(FinishedFile::at(&path)))?;
        Ok(SessionImage {
            artifact: artifact.as_str().to_owned(),
            exposure_us: frame.exposure_us,
            taken_at_ms: now_ms(),
            dark_frame: ImageDarkFrame::of(frame),
        })
    }
}

fn record(session: &Session) -> SessionRecord {
    SessionRecord {
        id: session.id.clone(),
        version: session.version,
        body: to_stored(&session.body),
        created_at_ms: session.created_at_ms,
        changed_at_ms: session.changed_at_ms,
    }
}

fn remove<T>(list: &mut Vec<T>, what: &str, id: &str, id_of: impl Fn(&T) -> &String) -> Result<(), AppError> {
    match list.iter().position(|item| id_of(item) == id) {
        Some(idx) => {
            list.remove(idx);
            Ok(())
        }
        None => Err(AppError::new(ErrorKind::NotFound, format!("the session has no {what} {id}"))),
    }
}

fn changed() -> AppError {
    AppError::new(ErrorKind::Changed, "the session was changed in the meantime").remedy("read it again and repeat")
}
