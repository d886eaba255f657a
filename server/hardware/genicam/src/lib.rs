//! GigE Vision and USB3 Vision cameras.
//!
//! [`GenicamDriver`] is the entry of the driver table; it discovers cameras and opens one by its serial number.
//! Everything that communicates with a camera uses the C library aravis and is compiled with the feature `aravis`;
//! computations (pixels, clocks, counts) are plain Rust and always available. Only `aravis/` contains unsafe code. Other
//! interfaces of cameras do not belong here.

pub mod driver;
pub mod settings;

#[cfg(feature = "aravis")]
mod camera;
#[cfg(feature = "aravis")]
mod details;
#[cfg(feature = "aravis")]
mod laser;
#[cfg(feature = "aravis")]
mod opened;
#[cfg(feature = "aravis")]
mod running;
#[cfg(feature = "aravis")]
mod shared;

#[cfg(feature = "aravis")]
pub mod aravis;
#[cfg(feature = "aravis")]
mod names;

#[cfg_attr(not(feature = "aravis"), allow(dead_code))]
mod gvcp;
#[cfg_attr(not(feature = "aravis"), allow(dead_code))]
mod pixels;
#[cfg_attr(not(feature = "aravis"), allow(dead_code))]
mod stamps;

pub mod fake_camera;

#[cfg(feature = "aravis")]
pub use camera::GenicamCamera;
pub use driver::GenicamDriver;
pub use settings::GenicamSettings;
