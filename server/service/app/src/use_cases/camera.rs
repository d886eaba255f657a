//! The camera: its dark frame, and features by name (GenICam) for engineers.

use std::sync::Arc;

use devices::CameraRequest;
use devices::features::{CameraDetails, CameraLink, Feature, FeatureError};
use station::Manual;

use crate::App;
use crate::access::principal::Principal;
use crate::camera::dark_frame::KeptDarkFrame;
use crate::control::{Request, admit};
use crate::error::{AppError, ErrorKind};
use crate::events::{CameraDarkFrameTaken, CameraFeaturesSet, Event, FeatureSet, event};

/// Takes a dark frame at the current camera settings with the laser off; the lens must be covered.
///
/// # Errors
/// The caller may not use the station, the laser is not controlled by the station, the frames show light, or a device
/// refuses; the dark frame so far is then still used.
pub async fn take_dark_frame(app: &App, by: &Principal, n_frames: usize) -> Result<KeptDarkFrame, AppError> {
    admit(app, by, Request::SessionImage)?;
    let taken = app.dark_frames.take(n_frames).await?;
    let n_hot_pixels = taken.dark.frame.hot_pixels().len();
    let body = CameraDarkFrameTaken { initiator: by.initiator(), n_hot_pixels };
    app.catalogue.commit(vec![event("camera", Event::CameraDarkFrameTaken(body))]).await?;
    Ok(taken)
}

/// Removes the dark frame: frames are no longer corrected.
///
/// # Errors
/// The caller may not use the station, or there is none.
pub async fn remove_dark_frame(app: &App, by: &Principal) -> Result<(), AppError> {
    admit(app, by, Request::SessionImage)?;
    app.dark_frames.remove().await?;
    app.catalogue.commit(vec![event("camera", Event::CameraDarkFrameRemoved(by.initiator()))]).await?;
    Ok(())
}

/// The camera link and all features. Takes as long as the camera needs, seconds at most.
///
/// # Errors
/// The camera has none, or does not respond.
pub async fn camera_features(app: &App) -> Result<(CameraLink, Vec<Feature>), AppError> {
    let details = details(app)?;
    blocking(move || Ok((details.link(), details.features()?))).await
}

/// Sets camera features one after the other; returns them as read back. The camera settings are read again, since features
/// may change them.
///
/// # Errors
/// The caller may not use the station; a feature does not exist or is refused: those before it are set.
pub async fn set_camera_features(
    app: &App,
    by: &Principal,
    wanted: Vec<(String, String)>,
) -> Result<Vec<Feature>, AppError> {
    admit(app, by, Request::Command)?;
    let details = details(app)?;
    let outcome = blocking(move || {
        let (mut set, mut refused) = (Vec::new(), None);
        for (idx, (name, value)) in wanted.iter().enumerate() {
            match details.set_feature(name, value) {
                Ok(feature) => set.push(feature),
                Err(error) => {
                    refused = Some(AppError::from(error).at(format!("/features/{idx}")));
                    break;
                }
            }
        }
        Ok((set, refused))
    });
    let (set, refused) = outcome.await?;
    if !set.is_empty() {
        app.station.manual(Manual::Configure(CameraRequest::default())).await?;
        let read_back =
            |feature: &Feature| FeatureSet { name: feature.name.clone(), value: feature.value.clone() };
        let body = CameraFeaturesSet { initiator: by.initiator(), features: set.iter().map(read_back).collect() };
        app.catalogue.commit(vec![event("camera", Event::CameraFeaturesSet(body))]).await?;
    }
    refused.map_or(Ok(set), Err)
}

fn details(app: &App) -> Result<Arc<dyn CameraDetails>, AppError> {
    app.station.camera_details().ok_or_else(|| {
        AppError::new(ErrorKind::NotFound, "this camera has no named features")
            .remedy("use GET /api/v1/devices/camera/settings for the common settings")
    })
}

async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, AppError> + Send + 'static,
) -> Result<T, AppError> {
    tokio::task::spawn_blocking(work).await.unwrap_or_else(|cause| {
        tracing::error!(%cause, "reading the camera's features panicked");
        Err(AppError::new(ErrorKind::Internal, "an internal error occurred while accessing camera features")
            .remedy("report it together with the server log"))
    })
}

impl From<FeatureError> for AppError {
    fn from(error: FeatureError) -> Self {
        let (kind, remedy) = match &error {
            FeatureError::Unknown { .. } => {
                (ErrorKind::Impossible, "GET /api/v1/devices/camera/features lists the available ones")
            }
            FeatureError::Refused { .. } => (
                ErrorKind::Impossible,
                "check its range, entries and access mode; some features need the live view to be ended",
            ),
            FeatureError::Disconnected { .. } => {
                (ErrorKind::DeviceFault, "check cable and power, then reset the station")
            }
        };
        Self::new(kind, error.to_string()).remedy(remedy)
    }
}
