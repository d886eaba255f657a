//! A device file.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::{AsFd as _, AsRawFd as _, RawFd};
use std::os::raw::c_int;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::Path;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::libc::O_NONBLOCK;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::time::{ClockId, clock_gettime};

use super::mapping::Mapping;
use super::requests;
use super::structures::{self as kernel, Plain as _};
use crate::device::{Card, Control, ControlId, Filled, Format, FourCc, Interval, Intervals, Stamped, VideoDevice};

/// `V4L2_BUF_TYPE_VIDEO_CAPTURE`
const CAPTURE: u32 = 1;

/// `V4L2_MEMORY_MMAP`
const MAPPED: u32 = 1;

/// `V4L2_FIELD_NONE`: whole frames.
const PROGRESSIVE: u32 = 1;

/// `V4L2_CAP_VIDEO_CAPTURE`, `V4L2_CAP_STREAMING`, and `V4L2_CAP_DEVICE_CAPS`: the capabilities of this file alone are
/// given.
const CAN_CAPTURE: u32 = 0x1;
const CAN_STREAM: u32 = 0x0400_0000;
const HAS_OWN_CAPABILITIES: u32 = 0x8000_0000;

/// `V4L2_CAP_TIMEPERFRAME`
const HAS_INTERVAL: u32 = 0x1000;

/// `V4L2_CTRL_FLAG_DISABLED`
const DISABLED: u32 = 0x1;

/// `V4L2_FRMSIZE_TYPE_DISCRETE`, `V4L2_FRMIVAL_TYPE_DISCRETE`
const DISCRETE: u32 = 1;

/// `V4L2_BUF_FLAG_ERROR`, and the kind of time stamp: mask and value of the monotonic clock, mask and value of the
/// exposure's start.
const IS_DAMAGED: u32 = 0x40;
const CLOCK: (u32, u32) = (0xE000, 0x2000);
const SOURCE: (u32, u32) = (0x0007_0000, 0x0001_0000);

/// Longest list that is read: a driver with an endless list would block its caller.
const MAX_ENTRIES: u32 = 256;

/// A device file of the kernel.
pub struct KernelDevice {
    file: File,
    /// The buffers while it streams.
    mappings: Vec<Mapping>,
}

impl KernelDevice {
    /// Opens the device file without changing the device.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).custom_flags(O_NONBLOCK).open(path)?;
        Ok(Self { file, mappings: Vec::new() })
    }

    fn fd(&self) -> RawFd {
        self.file.as_raw_fd()
    }

    fn set_streaming(&self, on: bool) -> io::Result<()> {
        let kind = CAPTURE as c_int;
        // SAFETY: reads one number.
        let outcome = unsafe {
            if on { requests::stream_on(self.fd(), &kind) } else { requests::stream_off(self.fd(), &kind) }
        };
        Ok(outcome.map(drop)?)
    }

    fn request_buffers(&self, count: u32) -> io::Result<u32> {
        let mut wanted = kernel::RequestBuffers::zeroed();
        (wanted.count, wanted.type_, wanted.memory) = (count, CAPTURE, MAPPED);
        // SAFETY: one structure in and out.
        unsafe { requests::request_buffers(self.fd(), &mut wanted)? };
        Ok(wanted.count)
    }

    fn queue(&self, index: u32) -> io::Result<()> {
        let mut buffer = buffer_request(index);
        // SAFETY: one structure in and out; the memory it refers to is the kernel's.
        unsafe { requests::queue_buffer(self.fd(), &mut buffer)? };
        Ok(())
    }

    fn parameters(&self) -> io::Result<kernel::StreamParameters> {
        let mut parameters = kernel::StreamParameters::zeroed();
        parameters.type_ = CAPTURE;
        // SAFETY: one structure in and out.
        unsafe { requests::get_parameters(self.fd(), &mut parameters)? };
        Ok(parameters)
    }
}

impl VideoDevice for KernelDevice {
    fn card(&self) -> io::Result<Card> {
        let mut capability = kernel::Capability::zeroed();
        // SAFETY: one structure out.
        unsafe { requests::query_capability(self.fd(), &mut capability)? };
        let has_own = capability.capabilities & HAS_OWN_CAPABILITIES != 0;
        let capabilities = if has_own { capability.device_caps } else { capability.capabilities };
        Ok(Card {
            driver: text(&capability.driver),
            name: text(&capability.card),
            bus: text(&capability.bus_info),
            streams: capabilities & CAN_CAPTURE != 0 && capabilities & CAN_STREAM != 0,
        })
    }

    fn formats(&self) -> io::Result<Vec<FourCc>> {
        enumerate(|index| {
            let mut description = kernel::FormatDescription::zeroed();
            (description.index, description.type_) = (index, CAPTURE);
            // SAFETY: one structure in and out.
            unsafe { requests::enumerate_formats(self.fd(), &mut description)? };
            Ok(FourCc(description.pixelformat.to_le_bytes()))
        })
    }

    fn sizes(&self, pixels: FourCc) -> io::Result<Vec<(usize, usize)>> {
        let mut is_range = false;
        enumerate(|index| {
            if is_range {
                return Err(Errno::EINVAL);
            }
            let mut size = kernel::FrameSize::zeroed();
            (size.index, size.pixel_format) = (index, u32::from_le_bytes(pixels.0));
            // SAFETY: one structure in and out.
            unsafe { requests::enumerate_frame_sizes(self.fd(), &mut size)? };
            is_range = size.type_ != DISCRETE;
            let [width, largest_width, _, _, largest_height, _] = size.sizes;
            let (width, height) = if is_range { (largest_width, largest_height) } else { (width, size.sizes[1]) };
            Ok((width as usize, height as usize))
        })
    }

    fn intervals(&self, format: &Format) -> io::Result<Intervals> {
        let mut range = None;
        let discrete = enumerate(|index| {
            let mut interval = kernel::FrameInterval::zeroed();
            (interval.index, interval.pixel_format) = (index, u32::from_le_bytes(format.pixels.0));
            (interval.width, interval.height) = (format.width_px as u32, format.height_px as u32);
            // SAFETY: one structure in and out.
            unsafe { requests::enumerate_frame_intervals(self.fd(), &mut interval)? };
            let [first, second, _] = interval.intervals.map(interval_from);
            if interval.type_ != DISCRETE {
                range = Some((first, second));
                return Err(Errno::EINVAL);
            }
            Ok(first)
        })?;
        Ok(range
            .map_or(Intervals::Discrete(discrete), |(shortest, longest)| Intervals::Between(shortest, longest)))
    }

    fn set_format(&mut self, wanted: &Format) -> io::Result<Format> {
        let mut format = kernel::Format::zeroed();
        format.type_ = CAPTURE;
        let mut pix = kernel::PixelFormat {
            width: wanted.width_px as u32,
            height: wanted.height_px as u32,
            pixelformat: u32::from_le_bytes(wanted.pixels.0),
            field: PROGRESSIVE,
            ..kernel::PixelFormat::zeroed()
        };
        format.fmt.pix = pix;
        // SAFETY: one structure in and out.
        unsafe { requests::set_format(self.fd(), &mut format)? };
        // SAFETY: the kernel wrote this member, since the type is that of a capture; any numbers are valid.
        pix = unsafe { format.fmt.pix };
        Ok(Format {
            pixels: FourCc(pix.pixelformat.to_le_bytes()),
            width_px: pix.width as usize,
            height_px: pix.height as usize,
            row_bytes: pix.bytesperline as usize,
        })
    }

    fn interval(&self) -> io::Result<Option<Interval>> {
        match self.parameters() {
            Ok(parameters) if parameters.capability & HAS_INTERVAL != 0 => {
                Ok(Some(interval_from(parameters.timeperframe)))
            }
            Ok(_) => Ok(None),
            Err(error) if is_not_offered(&error) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn set_interval(&mut self, wanted: Interval) -> io::Result<Interval> {
        let mut parameters = kernel::StreamParameters::zeroed();
        parameters.type_ = CAPTURE;
        parameters.timeperframe =
            kernel::Fraction { numerator: wanted.numerator, denominator: wanted.denominator };
        // SAFETY: one structure in and out.
        unsafe { requests::set_parameters(self.fd(), &mut parameters)? };
        Ok(interval_from(parameters.timeperframe))
    }

    fn control(&self, id: ControlId) -> io::Result<Option<Control>> {
        let mut query = kernel::QueryControl::zeroed();
        query.id = id.0;
        // SAFETY: one structure in and out.
        match unsafe { requests::query_control(self.fd(), &mut query) } {
            Ok(_) if query.flags & DISABLED != 0 => return Ok(None),
            Ok(_) => {}
            Err(Errno::EINVAL | Errno::ENOTTY) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
        let mut now = kernel::ControlValue { id: id.0, value: 0 };
        // SAFETY: one structure in and out.
        unsafe { requests::get_control(self.fd(), &mut now)? };
        Ok(Some(Control { min: query.minimum, max: query.maximum, step: query.step, value: now.value }))
    }

    fn set_control(&mut self, id: ControlId, value: i32) -> io::Result<()> {
        let mut wanted = kernel::ControlValue { id: id.0, value };
        // SAFETY: one structure in and out.
        unsafe { requests::set_control(self.fd(), &mut wanted)? };
        Ok(())
    }

    fn start(&mut self, n_buffers: u32) -> io::Result<()> {
        let granted = self.request_buffers(n_buffers)?;
        for index in 0..granted {
            let mut buffer = buffer_request(index);
            // SAFETY: one structure in and out.
            unsafe { requests::query_buffer(self.fd(), &mut buffer)? };
            // SAFETY: for mapped memory the kernel writes this member; any number is valid.
            let offset = unsafe { buffer.m.offset };
            self.mappings.push(Mapping::new(&self.file, offset, buffer.length)?);
            self.queue(index)?;
        }
        self.set_streaming(true)
    }

    fn take(&mut self, timeout: Duration, use_frame: &mut dyn FnMut(&Filled)) -> io::Result<bool> {
        let limit = PollTimeout::try_from(timeout).unwrap_or(PollTimeout::MAX);
        match poll(&mut [PollFd::new(self.file.as_fd(), PollFlags::POLLIN)], limit) {
            Ok(0) | Err(Errno::EINTR) => return Ok(false),
            // The next request returns the error of a device in error.
            Ok(_) => {}
            Err(error) => return Err(error.into()),
        }
        let mut buffer = buffer_request(0);
        // SAFETY: one structure in and out.
        match unsafe { requests::dequeue_buffer(self.fd(), &mut buffer) } {
            Ok(_) => {}
            Err(Errno::EAGAIN) => return Ok(false),
            Err(error) => return Err(error.into()),
        }
        let mapping = self.mappings.get(buffer.index as usize).ok_or(io::ErrorKind::InvalidData)?;
        use_frame(&Filled {
            // SAFETY: dequeued above, and queued again below, when nothing refers to it.
            bytes: unsafe { mapping.bytes(buffer.bytesused as usize) },
            sequence: buffer.sequence,
            stamped_at: (buffer.flags & CLOCK.0 == CLOCK.1).then(|| stamped_at(&buffer)).flatten(),
            stamped: if buffer.flags & SOURCE.0 == SOURCE.1 { Stamped::ExposureStart } else { Stamped::FrameEnd },
            is_damaged: buffer.flags & IS_DAMAGED != 0,
        });
        self.queue(buffer.index)?;
        Ok(true)
    }

    fn stop(&mut self) -> io::Result<()> {
        if self.mappings.is_empty() {
            return Ok(());
        }
        self.set_streaming(false)?;
        self.mappings.clear();
        self.request_buffers(0).map(drop)
    }
}

fn buffer_request(index: u32) -> kernel::Buffer {
    kernel::Buffer { index, type_: CAPTURE, memory: MAPPED, ..kernel::Buffer::zeroed() }
}

fn interval_from(fraction: kernel::Fraction) -> Interval {
    Interval { numerator: fraction.numerator, denominator: fraction.denominator }
}

/// Requests one entry after the other until there are none; empty if the device does not have the list.
fn enumerate<T>(mut entry: impl FnMut(u32) -> nix::Result<T>) -> io::Result<Vec<T>> {
    let mut list = Vec::new();
    for index in 0..MAX_ENTRIES {
        match entry(index) {
            Ok(one) => list.push(one),
            Err(Errno::EINVAL | Errno::ENOTTY) => break,
            Err(error) => return Err(error.into()),
        }
    }
    Ok(list)
}

fn is_not_offered(error: &io::Error) -> bool {
    matches!(error.raw_os_error(), Some(code) if code == Errno::EINVAL as i32 || code == Errno::ENOTTY as i32)
}

/// A text that ends with a zero byte or with its field.
fn text(field: &[u8]) -> String {
    let end = field.iter().position(|&byte| byte == 0).unwrap_or(field.len());
    String::from_utf8_lossy(&field[..end]).into_owned()
}

/// A time stamp of the monotonic clock, which `Instant` uses on Linux.
fn stamped_at(buffer: &kernel::Buffer) -> Option<Instant> {
    let now = Instant::now();
    let clock = Duration::from(clock_gettime(ClockId::CLOCK_MONOTONIC).ok()?);
    let seconds = u64::try_from(buffer.timestamp.tv_sec).ok()?;
    let micros = u64::try_from(buffer.timestamp.tv_usec).ok()?;
    instant_from_stamp(Duration::from_secs(seconds) + Duration::from_micros(micros), clock, now)
}

/// Converts a stamp of a clock that reads `clock` at `now`; a stamp in the future belongs to another clock.
fn instant_from_stamp(stamp: Duration, clock: Duration, now: Instant) -> Option<Instant> {
    now.checked_sub(clock.checked_sub(stamp)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_a_video_device_is_an_error() {
        let device = KernelDevice::open("/dev/null".as_ref()).unwrap();
        assert_eq!(device.card().unwrap_err().raw_os_error(), Some(Errno::ENOTTY as i32));
        assert_eq!(device.formats().unwrap(), []);
        assert_eq!(device.control(ControlId(1)).unwrap(), None);
    }

    #[test]
    fn a_time_stamp_is_converted_by_its_age() {
        let (clock, now) = (Duration::from_secs(100), Instant::now());
        let ago = Duration::from_millis(30);
        assert_eq!(instant_from_stamp(clock - ago, clock, now), now.checked_sub(ago));
        assert_eq!(instant_from_stamp(clock + ago, clock, now), None, "a stamp of the future");
        assert!(
            stamped_at(&buffer_request(0)).is_none_or(|at| at <= Instant::now()),
            "zero is when the computer started"
        );
    }

    #[test]
    fn texts_end_at_a_zero_byte_or_at_the_end_of_their_field() {
        assert_eq!(text(b"uvcvideo\0\0junk"), "uvcvideo");
        assert_eq!(text(b"full"), "full");
    }
}
