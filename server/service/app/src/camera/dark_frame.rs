//! The camera's dark frame: captured with the laser off and the lens covered, stored in one file of the data directory, and
//! passed to the station, which corrects every frame with it (ADR 32).

use std::path::{Path, PathBuf};
use std::sync::Arc;

use devices::{CameraRequest, Roi, Trigger};
use remedy::Remedy as _;
use serde::{Deserialize, Serialize};
use station::cancel::CancelFlag;
use station::wall_clock::now_ms;
use station::{CameraDarkFrame, CameraName, Purpose, StationHandle};
use store::disk::write_durably;
use tokio::sync::Mutex;
use vision::{DarkFrame, DarkFrameAccumulator, DarkFrameStatistics, LineDirection};

use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::hash_hex;

/// The file in the data directory: a line of JSON, then pattern and hot pixels.
const FILE: &str = "dark-frame";

/// The format of the file.
const FORMAT: &str = "sheaf-dark-frame/1";

/// Drivers whose frames were corrected when they were recorded.
const RECORDED: &str = "replay";

/// The dark frame that is stored.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptDarkFrame {
    /// The dark frame.
    pub dark: Arc<CameraDarkFrame>,
}

/// The station's dark frame.
#[derive(Clone)]
pub struct DarkFrameStore {
    path: Arc<PathBuf>,
    kept: Arc<Mutex<Option<KeptDarkFrame>>>,
    station: StationHandle,
    direction: LineDirection,
}

/// The first line of the file.
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    sha256: String,
    camera: [String; 3],
    roi: [usize; 4],
    gain_db: f64,
    exposure_us: f64,
    taken_at_ms: i64,
    n_frames: usize,
    bit_depth: u32,
    level: f64,
    noise: f64,
    pattern: f64,
    hot_above: f64,
    hot_noise_above: f64,
}

impl DarkFrameStore {
    /// Reads the dark frame from the data directory and passes it to the station; a damaged one counts as none and is
    /// logged. `direction`: which way the laser lines run.
    pub fn open(data: &Path, station: &StationHandle, direction: LineDirection) -> Self {
        let path = data.join(FILE);
        let kept = match std::fs::read(&path) {
            Ok(bytes) => opened(&bytes, direction).or_else(|| {
                tracing::error!(
                    "the dark frame is damaged on the disk: frames are not corrected until it is retaken"
                );
                None
            }),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => None,
            Err(error) => {
                tracing::error!(%error, "the dark frame cannot be read: frames are not corrected");
                None
            }
        };
        station.set_dark_frame(kept.as_ref().map(|kept| kept.dark.clone()));
        Self { path: Arc::new(path), kept: Arc::new(Mutex::new(kept)), station: station.clone(), direction }
    }

    /// The current dark frame.
    pub async fn get(&self) -> Option<KeptDarkFrame> {
        self.kept.lock().await.clone()
    }

    /// Captures a new one from `n_frames` frames at the current settings, which replaces the old one.
    ///
    /// # Errors
    /// The laser cannot be turned off by the station, a device refuses, the frames show light, or a write error; the old
    /// one is then still used.
    pub async fn take(&self, n_frames: usize) -> Result<KeptDarkFrame, AppError> {
        let mut kept = self.kept.lock().await;
        let before = kept.as_ref().map(|kept| kept.dark.clone());
        let (station, direction, path) = (self.station.clone(), self.direction, self.path.clone());
        let taken = tokio::task::spawn_blocking(move || {
            let taken = KeptDarkFrame { dark: Arc::new(taken(&station, n_frames, direction)?) };
            write_durably(&path, &sealed(&taken)?).map_err(disk_problem)?;
            Ok(taken)
        })
        .await
        .map_err(disk_problem)
        .and_then(std::convert::identity);
        match taken {
            Ok(taken) => {
                self.station.set_dark_frame(Some(taken.dark.clone()));
                *kept = Some(taken.clone());
                Ok(taken)
            }
            Err(error) => {
                self.station.set_dark_frame(before);
                Err(error)
            }
        }
    }

    /// Removes it: frames are no longer corrected.
    ///
    /// # Errors
    /// There is none, or it cannot be deleted.
    pub async fn remove(&self) -> Result<(), AppError> {
        let mut kept = self.kept.lock().await;
        if kept.is_none() {
            return Err(no_dark_frame());
        }
        std::fs::remove_file(&*self.path).map_err(disk_problem)?;
        self.station.set_dark_frame(None);
        *kept = None;
        Ok(())
    }
}

/// The error without a dark frame.
pub fn no_dark_frame() -> AppError {
    AppError::new(ErrorKind::NotFound, "no dark frame was taken")
        .remedy("cover the lens and take one: POST /api/v1/devices/camera/dark-frame")
}

/// Captures frames with the laser off. The current correction is disabled meanwhile.
fn taken(station: &StationHandle, n_frames: usize, direction: LineDirection) -> Result<CameraDarkFrame, AppError> {
    let status = station.status();
    if status.camera.identity.driver == RECORDED {
        return Err(AppError::new(ErrorKind::Impossible, "a recording was corrected when it was made")
            .remedy("take the dark frame on the station with the camera"));
    }
    if !status.laser.capabilities.switched {
        return Err(AppError::new(
            ErrorKind::Impossible,
            "the laser is not controlled by this station, so it cannot be turned off for a dark frame",
        )
        .remedy("use a laser that the station can turn off"));
    }
    let camera = CameraName::of(&status.camera.identity);
    let lease = station.lease(Purpose {
        job_id: "dark-frame".to_owned(),
        activity: "taking a dark frame".to_owned(),
        epoch: station.stop_epoch(),
    })?;
    lease.laser_off()?;
    station.set_dark_frame(None);
    let settings =
        lease.configure(&CameraRequest { trigger: Some(Trigger::Software), ..CameraRequest::default() })?;
    let (mut frames, cancel) = (DarkFrameAccumulator::default(), CancelFlag::default());
    for _ in 0..n_frames {
        frames.add(&lease.grab(&cancel)?.image).map_err(not_dark)?;
    }
    Ok(CameraDarkFrame {
        frame: frames.finish().map_err(not_dark)?,
        camera,
        roi: settings.roi,
        gain_db: settings.gain_db,
        exposure_us: settings.exposure_us,
        line_direction: direction,
        taken_at_ms: now_ms(),
    })
}

fn not_dark(error: vision::DarkFrameError) -> AppError {
    let remedy = error.remedy().unwrap_or_default().into_owned();
    AppError::new(ErrorKind::Impossible, error.to_string()).remedy(remedy)
}

fn sealed(kept: &KeptDarkFrame) -> Result<Vec<u8>, AppError> {
    let dark = &kept.dark;
    let (figures, roi, bytes) = (dark.frame.statistics(), dark.roi, dark.frame.to_bytes());
    let CameraName { driver, model, serial } = dark.camera.clone();
    let mut header = Header {
        format: FORMAT.to_owned(),
        sha256: String::new(),
        camera: [driver, model, serial],
        roi: [roi.left_px, roi.top_px, roi.width_px, roi.height_px],
        gain_db: dark.gain_db,
        exposure_us: dark.exposure_us,
        taken_at_ms: dark.taken_at_ms,
        n_frames: figures.n_frames,
        bit_depth: figures.bit_depth,
        level: figures.level,
        noise: figures.noise,
        pattern: figures.pattern,
        hot_above: figures.hot_above,
        hot_noise_above: figures.hot_noise_above,
    };
    header.sha256 = checksum(&header, &bytes)?;
    let mut text = serde_json::to_vec(&header).map_err(disk_problem)?;
    text.push(b'\n');
    text.extend(bytes);
    Ok(text)
}

/// Of the header without its checksum, and the rest.
fn checksum(header: &Header, bytes: &[u8]) -> Result<String, AppError> {
    let mut text = serde_json::to_vec(header).map_err(disk_problem)?;
    text.extend(bytes);
    Ok(hash_hex(&text))
}

/// `None` if the file is damaged.
fn opened(bytes: &[u8], direction: LineDirection) -> Option<KeptDarkFrame> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    let (text, bytes) = (&bytes[..end], &bytes[end + 1..]);
    let mut header: Header = serde_json::from_slice(text).ok()?;
    let sha256 = std::mem::take(&mut header.sha256);
    if header.format != FORMAT || checksum(&header, bytes).ok()? != sha256 {
        return None;
    }
    let [left_px, top_px, width_px, height_px] = header.roi;
    let figures = DarkFrameStatistics {
        n_frames: header.n_frames,
        bit_depth: header.bit_depth,
        level: header.level,
        noise: header.noise,
        pattern: header.pattern,
        hot_above: header.hot_above,
        hot_noise_above: header.hot_noise_above,
    };
    let [driver, model, serial] = header.camera;
    let dark = CameraDarkFrame {
        frame: DarkFrame::from_bytes(width_px, height_px, figures, bytes)?,
        camera: CameraName { driver, model, serial },
        roi: Roi { left_px, top_px, width_px, height_px },
        gain_db: header.gain_db,
        exposure_us: header.exposure_us,
        line_direction: direction,
        taken_at_ms: header.taken_at_ms,
    };
    Some(KeptDarkFrame { dark: Arc::new(dark) })
}
