//! The camera's dark frame.

use crate::App;
use crate::access::principal::Principal;
use crate::camera::dark_frame::KeptDarkFrame;
use crate::control::{Request, admit};
use crate::error::AppError;
use crate::events::{CameraDarkFrameTaken, Event, event};

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
