//! Notes recorded in addition to the frames, and their queue.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use capture::NominalPosition;
use devices::{DeviceIdentity, StageKind};
use live::LiveFrame;
use recording::{
    DeviceNote, EventNote, PeakLine, PeaksNote, ProfilePoint, RecordedPosition, RowNote, SettingsNote, StageNote,
};
use serde_json::{Value, json};
use station::StationStatus;
use store::EventRecord;

use crate::recordings::params::NOTES;

/// A note.
pub enum Note {
    /// The stage position.
    Stage(StageNote),
    /// Which frame is a row of the scan.
    Row(RowNote),
    /// The device settings.
    Settings(Box<SettingsNote>),
    /// An event.
    Event(Box<EventNote>),
    /// The lines of a frame.
    Peaks(PeaksNote),
    /// The profile of a frame.
    Profile(Vec<ProfilePoint>),
}

/// A note and its time, nanoseconds since 1970.
pub type Timed = (u64, Note);

/// The note queue; clones share it. Adding never blocks: notes that do not fit are counted.
#[derive(Clone)]
pub struct Notes {
    queue: SyncSender<Timed>,
    lost: Arc<AtomicU64>,
    stage: StageKind,
    clock: Clock,
}

impl Notes {
    /// A queue, and its end.
    pub fn new(stage: StageKind, clock: Clock) -> (Self, Receiver<Timed>) {
        let (queue, notes) = sync_channel(NOTES);
        (Self { queue, lost: Arc::default(), stage, clock }, notes)
    }

    /// Adds a note with the current time.
    pub fn add(&self, note: Note) {
        self.add_at(self.clock.now_ns(), note);
    }

    /// Adds a note with the given time.
    pub fn add_at(&self, at_ns: u64, note: Note) {
        if self.queue.try_send((at_ns, note)).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Notes that a frame is row `row` of the scan, at `position_mm`.
    pub fn row(&self, row: usize, sequence: u64, position_mm: f64) {
        self.add(Note::Row(RowNote {
            sequence,
            row: row as u64,
            position: recorded_position(self.stage, Some(position_mm)),
        }));
    }

    /// Number of dropped notes.
    pub fn n_lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// The clock of this recording.
    pub fn clock(&self) -> Clock {
        self.clock
    }
}

/// Monotonic time as nanoseconds since 1970: the wall clock is read once, at the start of the recording.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    began: std::time::Instant,
    began_ns: u64,
}

impl Clock {
    /// Starts now.
    pub fn start() -> Self {
        let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Self { began: std::time::Instant::now(), began_ns: since_1970.map_or(0, |time| time.as_nanos() as u64) }
    }

    /// Now.
    pub fn now_ns(&self) -> u64 {
        self.at_ns(std::time::Instant::now())
    }

    /// A given time, also before the recording.
    pub fn at_ns(&self, at: std::time::Instant) -> u64 {
        let since = at.saturating_duration_since(self.began).as_nanos() as u64;
        let before = self.began.saturating_duration_since(at).as_nanos() as u64;
        (self.began_ns + since).saturating_sub(before)
    }
}

/// The position of a stage of this kind.
pub fn recorded_position(kind: StageKind, position: Option<f64>) -> RecordedPosition {
    match (kind, position) {
        (_, None) => RecordedPosition::default(),
        (StageKind::Linear, Some(position_mm)) => NominalPosition::PositionMm(position_mm).into(),
        (StageKind::Rotary, Some(angle_deg)) => NominalPosition::AngleDeg(angle_deg).into(),
    }
}

/// The stage from the station status.
pub fn stage_note(status: &StationStatus) -> StageNote {
    StageNote {
        position: recorded_position(status.stage.capabilities.kind, status.position_mm),
        moving: status.moving,
        homed: status.homed,
    }
}

/// The devices from the station status.
pub fn settings_note(status: &StationStatus) -> SettingsNote {
    let camera = &status.camera_settings;
    let camera_settings = [
        ("exposure_us", json!(camera.exposure_us)),
        ("gain_db", json!(camera.gain_db)),
        ("frame_rate_hz", json!(camera.frame_rate_hz)),
        ("trigger", json!(format!("{:?}", camera.trigger).to_lowercase())),
        ("pixel_format", json!(format!("{:?}", camera.pixel_format))),
        ("left_px", json!(camera.roi.left_px)),
        ("top_px", json!(camera.roi.top_px)),
        ("width_px", json!(camera.roi.width_px)),
        ("height_px", json!(camera.roi.height_px)),
    ];
    let stage = &status.stage.capabilities;
    let stage_settings = [
        ("kind", json!(stage.kind.name())),
        ("travel_low_mm", json!(stage.travel_mm.0)),
        ("travel_high_mm", json!(stage.travel_mm.1)),
        ("max_speed_mm_s", json!(stage.max_speed_mm_s)),
        ("resolution_mm", json!(stage.resolution_mm)),
    ];
    let laser_settings = [
        ("power", json!(status.laser_power)),
        ("switched", json!(status.laser.capabilities.switched)),
        ("interlock_closed", json!(status.interlock_closed)),
    ];
    SettingsNote {
        camera: device(status.camera.connected, &status.camera.identity, &camera_settings),
        stage: device(status.stage.connected, &status.stage.identity, &stage_settings),
        laser: device(status.laser.connected, &status.laser.identity, &laser_settings),
    }
}

fn device(connected: bool, identity: &DeviceIdentity, settings: &[(&str, Value)]) -> DeviceNote {
    DeviceNote {
        connected,
        driver: identity.driver.to_owned(),
        vendor: identity.vendor.clone(),
        model: identity.model.clone(),
        serial: identity.serial.clone(),
        firmware: identity.firmware.clone(),
        settings: settings.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect(),
    }
}

/// An event as in the log, with its wall-clock time in ns.
pub fn event_note(event: &EventRecord) -> Timed {
    let at_ns = (event.at_ms.max(0) as u64).saturating_mul(1_000_000);
    let note = EventNote { kind: event.kind.clone(), subject: event.subject.clone(), body: event.body.clone() };
    (at_ns, Note::Event(Box::new(note)))
}

/// The lines of a frame.
pub fn peaks_note(frame: &LiveFrame) -> PeaksNote {
    let line = |segment: &vision::Segment| PeakLine {
        u_px: segment.points.iter().map(|point| point.u_px as f32).collect(),
        v_px: segment.points.iter().map(|point| point.v_px as f32).collect(),
        sigma_px: segment.points.iter().map(|point| point.sigma_px as f32).collect(),
        intensity: segment.points.iter().map(|point| point.intensity).collect(),
    };
    PeaksNote { sequence: frame.frame.sequence, lines: frame.centrelines.segments.iter().map(line).collect() }
}

/// The profile of a frame in the camera frame, if there is a calibration.
pub fn profile_note(frame: &LiveFrame) -> Option<Vec<ProfilePoint>> {
    let point = |point: &scanning::ProfilePoint| ProfilePoint {
        position_mm: point.hit_in_camera.xyz.into(),
        order: point.order,
        sigma_mm: point.noise_sigma_mm as f32,
    };
    Some(frame.profile.as_ref()?.points.iter().map(point).collect())
}
