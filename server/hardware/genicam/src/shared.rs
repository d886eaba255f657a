//! State shared by the camera and the readers of its features.

use parking_lot::Mutex;

use devices::features::CameraLink;

use crate::opened::OpenedCamera;

/// State shared by the camera and the readers of its features.
#[derive(Default)]
pub struct Shared {
    /// `None` while the camera is disconnected.
    pub opened: Mutex<Option<OpenedCamera>>,
    pub link: Mutex<CameraLink>,
    /// Features set by name, in their order; set again after a reconnection.
    pub set_by_name: Mutex<Vec<(String, String)>>,
}
