//! What the kernel is asked about a camera: one method a request, plain values, errors as the kernel gives them.

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

/// What a device file says about its device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Card {
    /// The kernel's driver: `uvcvideo`.
    pub driver: String,
    /// The device's name.
    pub name: String,
    /// Where it is plugged in: `usb-0000:00:14.0-2`.
    pub bus: String,
    /// Whether it delivers pictures into buffers of the kernel.
    pub streams: bool,
}

/// The pictures that are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Format {
    /// How pixels lie in bytes.
    pub pixels: FourCc,
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// Bytes from row to row; 0 where a picture has no rows, as in MJPG.
    pub row_bytes: usize,
}

/// Time from frame to frame, seconds as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// Above the line.
    pub numerator: u32,
    /// Below the line.
    pub denominator: u32,
}

impl Interval {
    /// Frames per second.
    pub fn rate_hz(self) -> f64 {
        f64::from(self.denominator) / f64::from(self.numerator.max(1))
    }
}

/// The frame intervals a camera can be set to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Intervals {
    /// These alone; none where the camera does not say.
    Discrete(Vec<Interval>),
    /// From the shortest to the longest.
    Between(Interval, Interval),
}

/// The kernel's number of a control (`V4L2_CID_…`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ControlId(pub u32);

/// A control as it is now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Control {
    /// Smallest value.
    pub min: i32,
    /// Largest value.
    pub max: i32,
    /// Distance between two values.
    pub step: i32,
    /// Its value.
    pub value: i32,
}

/// Which moment of a frame its time stamp marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stamped {
    /// The exposure began.
    ExposureStart,
    /// The last byte arrived.
    FrameEnd,
}

/// A buffer that was filled.
#[derive(Debug)]
pub struct Filled<'b> {
    /// What was sent; no more than that.
    pub bytes: &'b [u8],
    /// The driver's count of frames, 32 bits, which turns over; a gap is frames that were lost.
    pub sequence: u32,
    /// The time stamp by this computer's monotonic clock; `None` if the driver stamps by another clock.
    pub stamped_at: Option<Instant>,
    /// What the time stamp marks.
    pub stamped: Stamped,
    /// The driver says that its content is damaged.
    pub is_damaged: bool,
}

/// A camera's device file, open.
///
/// # Errors
/// Every method passes on the kernel's error: `ENODEV` where the camera was unplugged, `EBUSY` where another program
/// streams from it.
pub trait VideoDevice: Send {
    /// What it is; fails once the camera was unplugged.
    fn card(&self) -> io::Result<Card>;

    /// Pixel formats it offers.
    fn formats(&self) -> io::Result<Vec<FourCc>>;

    /// Columns and rows of the pictures it offers in a format; of a range the largest alone.
    fn sizes(&self, pixels: FourCc) -> io::Result<Vec<(usize, usize)>>;

    /// Frame intervals it offers for pictures of a format.
    fn intervals(&self, format: &Format) -> io::Result<Intervals>;

    /// Sets the pictures to be sent and returns what the driver made of it. Not while it streams.
    fn set_format(&mut self, wanted: &Format) -> io::Result<Format>;

    /// The frame interval that is set; `None` if there is none to be set.
    fn interval(&self) -> io::Result<Option<Interval>>;

    /// Sets the frame interval and returns what the driver made of it. Not while it streams.
    fn set_interval(&mut self, wanted: Interval) -> io::Result<Interval>;

    /// A control with its range; `None` if the camera does not have it.
    fn control(&self, id: ControlId) -> io::Result<Option<Control>>;

    /// Sets a control.
    fn set_control(&mut self, id: ControlId, value: i32) -> io::Result<()>;

    /// Hands over `n_buffers` buffers, or as many as the driver admits, and starts to stream.
    fn start(&mut self, n_buffers: u32) -> io::Result<()>;

    /// Waits at most `timeout` for a filled buffer, shows it to `see`, and hands it back to be filled again.
    ///
    /// Returns `false` if none came in that time.
    fn take(&mut self, timeout: Duration, see: &mut dyn FnMut(&Filled)) -> io::Result<bool>;

    /// Ends streaming and takes the buffers back. Works in every state.
    fn stop(&mut self) -> io::Result<()>;
}
