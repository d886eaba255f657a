//! The thread `live-encode`: encodes the newest frame once for all viewers.

use std::io;
use std::sync::Arc;

use bytes::Bytes;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};
use vision::LineDirection;

use live::jpeg::grey_jpeg;
use live::pace::Pace;
use live::protocol::header::{FrameStamp, PixelGrid};
use live::protocol::image::{Brightness, ImageMessage, shrink};
use live::protocol::profile::{ProfileMessage, calibration_mark};
use live::worker::Worker;
use live::{LiveBus, LiveFrame, StreamKind};

/// Image scales: divisors of the frame size.
pub const SCALES: [u8; 3] = [1, 2, 4];
/// JPEG quality, 1–100: laser lines keep their shape, a frame of 1280×1024 has 100–200 kB.
const JPEG_QUALITY: u8 = 80;

/// The newest message of a stream.
#[derive(Debug, Clone, Default)]
pub struct Published {
    /// Message number, from 1; 0: none yet.
    pub number: u64,
    /// The message.
    pub bytes: Bytes,
}

/// Receivers of the newest messages.
#[derive(Clone)]
pub struct Slots {
    images: [watch::Sender<Published>; SCALES.len()],
    profiles: watch::Sender<Published>,
}

impl Default for Slots {
    fn default() -> Self {
        Self {
            images: std::array::from_fn(|_| watch::Sender::new(Published::default())),
            profiles: watch::Sender::new(Published::default()),
        }
    }
}

impl Slots {
    /// The receiver for this kind of message.
    pub fn of(&self, kind: StreamKind) -> &watch::Sender<Published> {
        match kind {
            StreamKind::Profile => &self.profiles,
            StreamKind::Image { scale } => {
                &self.images[SCALES.iter().position(|known| *known == scale).unwrap_or_default()]
            }
        }
    }

    fn publish(&self, kind: StreamKind, encode: impl FnOnce(u32) -> Option<Bytes>) {
        let slot = self.of(kind);
        let number = slot.borrow().number + 1;
        if let Some(bytes) = encode(number as u32) {
            slot.send_replace(Published { number, bytes });
        }
    }
}

/// Starts the thread.
pub fn start(bus: LiveBus, slots: Slots, line_direction: LineDirection) -> io::Result<Worker> {
    Worker::spawn("live-encode", move || encode_frames(bus, slots, line_direction))
}

/// The state of one kind of message.
struct Line {
    kind: StreamKind,
    pace: Pace,
    /// The frame encoded last.
    done: u64,
}

async fn encode_frames(bus: LiveBus, slots: Slots, line_direction: LineDirection) {
    let mut frames = bus.watch_frames();
    let mut demands = bus.watch_demands();
    let mut encoding = Encoding { line_direction, grey: Vec::new() };
    let start = Instant::now();
    let kinds = SCALES.map(|scale| StreamKind::Image { scale }).into_iter().chain([StreamKind::Profile]);
    let mut lines: Vec<Line> = kinds.map(|kind| Line { kind, pace: Pace::new(1.0, start), done: 0 }).collect();
    loop {
        let newest = frames.borrow_and_update().clone();
        let wanted = demands.borrow_and_update().clone();
        let mut next: Option<Instant> = None;
        for line in &mut lines {
            let (Some(frame), Some(rate_hz)) = (&newest, wanted.rate_hz(line.kind)) else { continue };
            if frame.frame.sequence == line.done {
                continue;
            }
            line.pace.set_rate(rate_hz);
            let opens = line.pace.opens();
            if opens > Instant::now() {
                next = Some(next.map_or(opens, |next| next.min(opens)));
                continue;
            }
            line.pace.pass(Instant::now());
            line.done = frame.frame.sequence;
            slots.publish(line.kind, |number| encoding.encode(line.kind, frame, number));
        }
        drop(newest);
        let due = async {
            match next {
                Some(next) => sleep_until(next).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            changed = frames.changed() => if changed.is_err() { return },
            changed = demands.changed() => if changed.is_err() { return },
            () = due => {}
        }
    }
}

/// The encoder; reuses its buffers.
struct Encoding {
    line_direction: LineDirection,
    grey: Vec<u8>,
}

impl Encoding {
    /// The message; `None` for a profile without calibration or an image that JPEG cannot hold.
    fn encode(&mut self, kind: StreamKind, live: &Arc<LiveFrame>, number: u32) -> Option<Bytes> {
        let image = &live.frame.image;
        let stamp = FrameStamp::of(&live.frame, live.profile.is_some());
        let grid = PixelGrid::of(image.width(), image.height());
        match kind {
            StreamKind::Profile => {
                let (profile, id) = (live.profile.as_ref()?, live.calibration_id.as_deref()?);
                let calibration = calibration_mark(id);
                let line_direction = self.line_direction;
                Some(ProfileMessage { stamp, grid, calibration, line_direction, profile }.encode(number))
            }
            StreamKind::Image { scale } => {
                let jpeg_px = shrink(image, usize::from(scale), &mut self.grey);
                let jpeg = self.jpeg(jpeg_px)?;
                let message = ImageMessage {
                    stamp,
                    grid,
                    bit_depth: image.bit_depth() as u8,
                    scale,
                    exposure_us: live.frame.exposure_us as f32,
                    brightness: Brightness::of(image),
                    segments: &live.centrelines.segments,
                    labels: live.profile.as_ref().map_or(&[], |profile| &profile.labels),
                    jpeg_px,
                    jpeg: &jpeg,
                };
                Some(message.encode(number))
            }
        }
    }

    fn jpeg(&self, size_px: (u16, u16)) -> Option<Vec<u8>> {
        let (width, height) = size_px;
        grey_jpeg(&self.grey, size_px, JPEG_QUALITY)
            .inspect_err(|error| {
                tracing::error!("an image of {width}×{height} pixels could not be encoded: {error}");
            })
            .ok()
    }
}
