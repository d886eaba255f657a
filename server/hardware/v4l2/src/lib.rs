//! USB cameras of the video class (UVC) and every other camera that Linux shows as `/dev/video…`.
//!
//! [`V4l2Driver`] is the row of the driver table; it finds cameras and opens one by its device file. What the kernel is
//! asked for is the trait [`VideoDevice`]: behind it stands the kernel in `kernel/`, which alone holds unsafe code and is
//! compiled with the feature `kernel`, or a scripted device in tests.

pub mod camera;
pub mod device;
pub mod driver;
pub mod settings;

mod acquisition;
mod controls;
mod discovery;
#[cfg(feature = "kernel")]
pub mod kernel;
mod opened;
mod pixels;

pub use camera::V4l2Camera;
pub use device::VideoDevice;
pub use driver::V4l2Driver;
pub use settings::V4l2Settings;
