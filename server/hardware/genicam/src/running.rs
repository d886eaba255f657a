//! A running acquisition: circulating buffers, and the accounting of frames and times.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use devices::features::CameraLink;
use devices::{CameraError, CameraSettings, FrameInfo, Trigger};
use vision::GreyImage;

use crate::aravis::{AravisError, Buffer, BufferStatus, Stream, StreamOptions};
use crate::opened::OpenedCamera;
use crate::pixels::SourceFormat;
use crate::settings::{GenicamSettings, SensorColour, Timestamp};
use crate::stamps::block_ids::BlockIds;
use crate::stamps::clock::DeviceClock;

/// Frames for which the socket's buffer is sized.
const SOCKET_FRAMES: usize = 4;

/// Time after its exposure from which a software trigger without a frame counts as lost, if later frames have arrived.
/// Shorter than a station waits for a triggered frame.
const TRIGGER_ANSWER: Duration = Duration::from_millis(600);

/// Longest latency of a packet in this computer that is accepted; a wall clock that was set appears as more.
const MAX_LATENCY: Duration = Duration::from_secs(1);

/// Longest wait for one frame, even if the caller would wait longer: a driver that is blocked for longer counts as
/// hung.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// A first id above this belongs to a camera that continues the count of the previous acquisition.
const SMALL_ID: u64 = 256;

/// A running acquisition.
pub struct Running {
    stream: Stream,
    ids: BlockIds,
    clock: DeviceClock,
    format: SourceFormat,
    colour: SensorColour,
    settings: CameraSettings,
    timestamp: Timestamp,
    /// The last id of the previous acquisition.
    last_id_before: Option<u64>,
    last_id: Option<u64>,
    /// Id that the camera gives the first frame of an acquisition.
    first_id: u64,
    /// Frames lost since the last delivered one, and how many of them arrived incomplete.
    lost: u64,
    lost_incomplete: u64,
    /// Incomplete frames since the last complete one.
    incomplete: u64,
    /// Software triggers sent before the first frame.
    triggers: VecDeque<Instant>,
    last_exposed_at: Option<Instant>,
    /// When anything was last received.
    pub received_at: Instant,
}

impl Running {
    /// Creates a stream with buffers and starts the camera. `last_id_before`: see [`Running::last_id`].
    pub fn start(
        opened: &OpenedCamera,
        settings: &GenicamSettings,
        set: CameraSettings,
        last_id_before: Option<u64>,
    ) -> Result<Self, AravisError> {
        let format = opened.source_format()?;
        let payload_bytes = opened.device.payload_bytes()?;
        let options =
            StreamOptions { resend: settings.packet_resend, socket_buffer_bytes: SOCKET_FRAMES * payload_bytes };
        let stream = Stream::new(&opened.device, options)?;
        for _ in 0..settings.buffers {
            let no_memory = || AravisError(format!("no memory for buffers of {payload_bytes} bytes"));
            stream.push(Buffer::allocate(payload_bytes).ok_or_else(no_memory)?);
        }
        opened.device.start()?;
        Ok(Self {
            stream,
            ids: BlockIds::default(),
            clock: DeviceClock::default(),
            format,
            colour: settings.sensor_colour,
            settings: set,
            timestamp: settings.timestamp,
            last_id_before,
            last_id: None,
            first_id: u64::from(opened.device.is_gige()),
            lost: 0,
            lost_incomplete: 0,
            incomplete: 0,
            triggers: VecDeque::new(),
            last_exposed_at: None,
            received_at: Instant::now(),
        })
    }

    /// Incomplete frames since the last complete one.
    pub fn n_incomplete(&self) -> u64 {
        self.incomplete
    }

    /// The last id received.
    pub fn last_id(&self) -> Option<u64> {
        self.last_id.or(self.last_id_before)
    }

    /// Changes settings that may change while it runs: exposure, gain, rate.
    pub fn set(&mut self, settings: CameraSettings) {
        self.settings = settings;
    }

    /// Records that a software trigger was sent.
    pub fn note_trigger(&mut self, now: Instant) {
        if self.last_id.is_none() {
            self.triggers.push_back(now);
        }
    }

    /// Duration of silence that is normal, during which no probe is needed.
    pub fn normal_silence(&self) -> Duration {
        let exposure = exposure(&self.settings);
        match self.settings.trigger {
            Trigger::Free => exposure + Duration::from_secs_f64(3.0 / self.settings.frame_rate_hz.max(0.1)),
            Trigger::Software | Trigger::Hardware => exposure,
        }
    }

    /// Waits for the next complete frame and writes it into `image`; incomplete ones are counted.
    pub fn next_frame(
        &mut self,
        image: &mut GreyImage,
        timeout: Duration,
        link: &mut CameraLink,
    ) -> Result<Option<FrameInfo>, CameraError> {
        let deadline = Instant::now() + timeout.min(MAX_WAIT);
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Some(buffer) = self.stream.pop(left) else { return Ok(None) };
            self.received_at = Instant::now();
            let received = self.use_buffer(&buffer, image, link);
            self.stream.push(buffer);
            self.count_packets(link);
            if let Some(info) = received? {
                return Ok(Some(info));
            }
        }
    }

    fn use_buffer(
        &mut self,
        buffer: &Buffer,
        image: &mut GreyImage,
        link: &mut CameraLink,
    ) -> Result<Option<FrameInfo>, CameraError> {
        let status = buffer.status();
        if status == BufferStatus::Ended {
            return Ok(None);
        }
        if status == BufferStatus::MissingPackets {
            // Its id cannot be trusted, because it may have been in the missing part: the gap before the next complete
            // frame counts it.
            self.incomplete += 1;
            link.frames_incomplete += 1;
            return Ok(None);
        }
        let id = buffer.frame_id();
        let expected = self.ids.next().unwrap_or(0);
        let first = if self.last_id.is_none() { self.lost_before_first(id).max(self.incomplete) } else { 0 };
        let Some(count) = self.ids.count(id, first) else { return Ok(None) };
        self.last_id = Some(id);
        self.triggers.clear();
        let lost = count - expected;
        let lost_incomplete = std::mem::take(&mut self.incomplete).min(lost);
        (self.lost, self.lost_incomplete) = (self.lost + lost, self.lost_incomplete + lost_incomplete);
        link.frames_missing += lost - lost_incomplete;
        self.unpack(buffer, image)?;
        link.frames_complete += 1;
        let (device_timestamp_ns, exposed_at) = self.times(buffer);
        link.clock_uncertainty = self.clock.uncertainty();
        Ok(Some(FrameInfo {
            frame_id: count,
            device_timestamp_ns,
            exposed_at,
            lost_before: std::mem::take(&mut self.lost),
            lost_incomplete: std::mem::take(&mut self.lost_incomplete),
            exposure_us: self.settings.exposure_us,
            recorded_position_mm: None,
        }))
    }

    fn unpack(&self, buffer: &Buffer, image: &mut GreyImage) -> Result<(), CameraError> {
        let roi = self.settings.roi;
        let wrong_frame = |got_width_px, got_height_px| CameraError::WrongFrame {
            width_px: roi.width_px,
            height_px: roi.height_px,
            got_width_px,
            got_height_px,
        };
        let sent = buffer.image().ok_or_else(|| wrong_frame(0, 0))?;
        let size = (sent.width_px, sent.height_px);
        if size != (roi.width_px, roi.height_px) {
            return Err(wrong_frame(sent.width_px, sent.height_px));
        }
        let format = match SourceFormat::from_code(sent.format) {
            Some(format) if format.is_deep() == self.format.is_deep() => format,
            other => {
                return Err(CameraError::Unsupported {
                    setting: "pixel_format",
                    value: other.map_or_else(|| format!("{:#010x}", sent.format), |other| other.name.to_owned()),
                    expected: format!("{}, as it was started with; start it again", self.format.name),
                });
            }
        };
        let unpacked = format.unpack(sent.bytes, size, sent.padding_bytes, self.colour, image);
        unpacked.map_err(|_| wrong_frame(sent.width_px, sent.height_px))
    }

    /// Frames lost before the first received one, as far as its id and the triggers show.
    fn lost_before_first(&self, id: u64) -> u64 {
        if self.settings.trigger == Trigger::Software {
            let limit = exposure(&self.settings) + TRIGGER_ANSWER;
            let unanswered = self.triggers.iter().take_while(|sent| sent.elapsed() > limit).count();
            return unanswered.min(self.triggers.len().saturating_sub(1)) as u64;
        }
        // A camera that has restarted its count began with its first id.
        let count_restarted = self.last_id_before.is_some_and(|last| id <= last) && id <= SMALL_ID;
        if count_restarted { id.saturating_sub(self.first_id) } else { 0 }
    }

    /// The camera's time stamp, and the middle of the exposure by this computer's clock.
    fn times(&mut self, buffer: &Buffer) -> (Option<u64>, Instant) {
        let received_at = received_at(buffer.received_wall_ns());
        let exposure = exposure(&self.settings);
        let stamped_ns = Some(buffer.device_timestamp_ns()).filter(|&ns| ns > 0);
        let stamped_at = stamped_ns.and_then(|ns| {
            self.clock.observe(ns, received_at);
            self.clock.host_time(ns)
        });
        let middle = match (stamped_at, self.timestamp) {
            (Some((at, _)), Timestamp::ExposureStart) => at + exposure / 2,
            (Some((at, _)), Timestamp::ExposureEnd) => at.checked_sub(exposure / 2).unwrap_or(at),
            // Without a clock: a frame is assumed to arrive when it was exposed.
            (None, _) => received_at.checked_sub(exposure / 2).unwrap_or(received_at),
        };
        // No frame is exposed after its arrival, nor before the previous one.
        let middle = middle.min(received_at).max(self.last_exposed_at.unwrap_or(middle));
        self.last_exposed_at = Some(middle);
        (stamped_ns, middle)
    }

    fn count_packets(&self, link: &mut CameraLink) {
        link.underruns = self.stream.count(c"n_underruns");
        link.packets_missing = self.stream.count(c"n_missing_packets");
        link.resend_requests = self.stream.count(c"n_resend_requests");
        link.packets_resent = self.stream.count(c"n_resent_packets");
    }
}

fn exposure(settings: &CameraSettings) -> Duration {
    Duration::from_secs_f64((settings.exposure_us * 1e-6).clamp(0.0, 60.0))
}

/// Converts a recent wall-clock time to the monotonic clock.
fn received_at(wall_ns: u64) -> Instant {
    let (now, wall_now) = (Instant::now(), SystemTime::now());
    let since = wall_now.duration_since(UNIX_EPOCH + Duration::from_nanos(wall_ns));
    let latency = since.ok().filter(|latency| *latency < MAX_LATENCY).unwrap_or_default();
    now.checked_sub(latency).unwrap_or(now)
}
