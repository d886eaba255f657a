//! USB cameras of the video class (UVC) and every other camera that Linux provides as `/dev/video…`.
//!
//! [`V4l2Driver`] is the row of the driver table; it finds cameras and opens one by its device file. The kernel
//! interface is the trait [`VideoDevice`], implemented by the kernel in `kernel/`, which contains all unsafe code and
//! is compiled with the feature `kernel`, or by a scripted device in tests. Other interfaces of cameras do not belong
//! here.

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
