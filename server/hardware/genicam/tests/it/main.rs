//! The driver with third-party cameras: aravis' simulated in-process camera, and its GigE Vision camera as a separate
//! process, reached over the local network stack. Not covered: physical cameras.

#![allow(clippy::unwrap_used)]

#[cfg(feature = "aravis")]
mod by_name;
#[cfg(feature = "aravis")]
mod contract;
#[cfg(feature = "aravis")]
mod faults;
#[cfg(feature = "aravis")]
mod frames;
#[cfg(feature = "aravis")]
mod lines;
#[cfg(feature = "aravis")]
mod measured;
#[cfg(feature = "aravis")]
mod rig;

#[cfg(not(feature = "aravis"))]
#[test]
fn cameras_over_aravis() {
    reference::without_feature("aravis", "the Debian packages libaravis-dev and libusb-1.0-0-dev");
}
