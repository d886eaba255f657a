//! The kernel interface of a camera: one method per request, plain values, errors as returned by the kernel.

use std::fmt;
use std::io;
use std::time::{Duration, Instant};

/// A pixel format by its four letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FourCc(pub [u8; 4]);

impl fmt::Display for FourCc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", String::from_utf8_lossy(&self.0).trim_end())
    }
}

/// Description of a device file's device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Card {
    /// The kernel's driver: `uvcvideo`.
    pub driver: String,
    /// The device's name.
    pub name: String,
    /// Where it is plugged in: `usb-0000:00:14.0-2`.
    pub bus: String,
    /// Whether it captures images into kernel buffers.
    pub streams: bool,
}

/// Format of the images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format {
    /// Pixel format.
    pub pixels: FourCc,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Bytes from row to row; 0 for formats without rows, such as MJPG.
    pub row_bytes: usize,
}

/// Frame interval, a fraction of seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Numerator.
    pub numerator: u32,
    /// Denominator.
    pub denominator: u32,
}

impl Interval {
    /// Frames per second.
    pub fn rate_hz(self) -> f64 {
        f64::from(self.denominator) / f64::from(self.numerator.max(1))
    }
}

/// Frame intervals supported by a camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Intervals {
    /// Only these; empty if the camera reports none.
    Discrete(Vec<Interval>),
    /// From the shortest to the longest.
    Between(Interval, Interval),
}

/// The kernel's number of a control (`V4L2_CID_…`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ControlId(pub u32);

/// Current state of a control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Control {
    /// Smallest value.
    pub min: i32,
    /// Largest value.
    pub max: i32,
    /// Distance between two values.
    pub step: i32,
    /// Current value.
    pub value: i32,
}

/// The event marked by a frame's time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamped {
    /// Start of the exposure.
    ExposureStart,
    /// Arrival of the last byte.
    FrameEnd,
}

/// A filled buffer.
#[derive(Debug)]
pub struct Filled<'b> {
    /// The received bytes only.
    pub bytes: &'b [u8],
    /// The driver's frame count, 32 bits with wrap-around; a gap means lost frames.
    pub sequence: u32,
    /// Time stamp by this computer's monotonic clock; `None` if the driver uses another clock.
    pub stamped_at: Option<Instant>,
    /// The event marked by the time stamp.
    pub stamped: Stamped,
    /// Marked by the driver as damaged.
    pub is_damaged: bool,
}

/// An open device file of a camera.
///
/// # Errors
/// Every method returns the kernel's error: `ENODEV` if the camera was unplugged, `EBUSY` if another program streams
/// from it.
pub trait VideoDevice: Send {
    /// Describes the device; fails once the camera was unplugged.
    fn card(&self) -> io::Result<Card>;

    /// Supported pixel formats.
    fn formats(&self) -> io::Result<Vec<FourCc>>;

    /// Supported columns and rows in a pixel format; of a range only the largest.
    fn sizes(&self, pixels: FourCc) -> io::Result<Vec<(usize, usize)>>;

    /// Supported frame intervals for a format.
    fn intervals(&self, format: &Format) -> io::Result<Intervals>;

    /// Sets the image format and returns the format chosen by the driver. Not while streaming.
    fn set_format(&mut self, wanted: &Format) -> io::Result<Format>;

    /// The current frame interval; `None` if the device has none.
    fn interval(&self) -> io::Result<Option<Interval>>;

    /// Sets the frame interval and returns the one chosen by the driver. Not while streaming.
    fn set_interval(&mut self, wanted: Interval) -> io::Result<Interval>;

    /// A control with its range; `None` if the camera does not have it.
    fn control(&self, id: ControlId) -> io::Result<Option<Control>>;

    /// Sets a control.
    fn set_control(&mut self, id: ControlId, value: i32) -> io::Result<()>;

    /// Queues `n_buffers` buffers, or as many as the driver accepts, and starts streaming.
    fn start(&mut self, n_buffers: u32) -> io::Result<()>;

    /// Waits at most `timeout` for a filled buffer, passes it to `use_frame`, and queues it again.
    ///
    /// Returns `false` if none arrived in that time.
    fn take(&mut self, timeout: Duration, use_frame: &mut dyn FnMut(&Filled)) -> io::Result<bool>;

    /// Stops streaming and releases the buffers. Works in every state.
    fn stop(&mut self) -> io::Result<()>;
}
