//! What the camera shares with those who read its features.

use parking_lot::{Mutex, MutexGuard};

use devices::features::CameraLink;

use crate::opened::OpenedCamera;

/// What the camera shares with those who read its features.
#[derive(Default)]
pub struct Shared {
    /// `None` while it is gone.
    pub opened: Mutex<Option<OpenedCamera>>,
    pub link: Mutex<CameraLink>,
    /// Features set by name, in their order; set again when it was away.
    pub set_by_name: Mutex<Vec<(String, String)>>,
}

/// Takes a lock whatever happened to who held it.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock()
}
