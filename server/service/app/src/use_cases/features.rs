//! The camera's own features by name, for engineers.

use std::sync::Arc;

use devices::CameraRequest;
use devices::features::{CameraDetails, CameraLink, Feature, FeatureError};
use station::Manual;

use crate::App;
use crate::access::principal::Principal;
use crate::control::{Ask, admit};
use crate::error::{AppError, ErrorKind};
use crate::events::{CameraFeaturesSet, Event, FeatureSet, event};

/// How the camera's link does, and all its features. Takes as long as the camera does, seconds at most.
///
/// # Errors
/// A camera that has none, or does not answer.
pub async fn camera_features(app: &App) -> Result<(CameraLink, Vec<Feature>), AppError> {
    let details = details(app)?;
    blocking(move || Ok((details.link(), details.features()?))).await
}

/// Sets features of the camera one after the other; returns them as the camera says they are then. Its settings are read
/// again, since they may be what was set.
///
/// # Errors
/// Who may not command the station; a feature that does not exist or is refused: those before it are set.
pub async fn set_camera_features(
    app: &App,
    by: &Principal,
    wanted: Vec<(String, String)>,
) -> Result<Vec<Feature>, AppError> {
    admit(app, by, Ask::Command)?;
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
        let told = |feature: &Feature| FeatureSet { name: feature.name.clone(), value: feature.value.clone() };
        let body = CameraFeaturesSet { act: by.act(), features: set.iter().map(told).collect() };
        app.ledger.commit(vec![event("camera", Event::CameraFeaturesSet(body))]).await?;
    }
    refused.map_or(Ok(set), Err)
}

fn details(app: &App) -> Result<Arc<dyn CameraDetails>, AppError> {
    app.station.camera_details().ok_or_else(|| {
        AppError::new(ErrorKind::NotFound, "this camera has no features beyond its settings")
            .remedy("GET /api/v1/devices/camera/settings has what every camera can be set to")
    })
}

async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, AppError> + Send + 'static,
) -> Result<T, AppError> {
    tokio::task::spawn_blocking(work).await.unwrap_or_else(|cause| {
        tracing::error!(%cause, "reading the camera's features panicked");
        Err(AppError::new(ErrorKind::Internal, "the camera's features met a defect of the program")
            .remedy("report it with the log of the server"))
    })
}

impl From<FeatureError> for AppError {
    fn from(error: FeatureError) -> Self {
        let (kind, remedy) = match &error {
            FeatureError::Unknown { .. } => {
                (ErrorKind::Impossible, "GET /api/v1/devices/camera/features lists those it has")
            }
            FeatureError::Refused { .. } => (
                ErrorKind::Impossible,
                "look at its range, its entries and its access; some need the live view ended",
            ),
            FeatureError::Gone { .. } => (ErrorKind::DeviceFault, "check cable and power, then reset the station"),
        };
        Self::new(kind, error.to_string()).remedy(remedy)
    }
}
