//! The sensor: exposes on schedule, renders on its own thread, keeps a few frames until they are collected.

use parking_lot::{Condvar, Mutex, MutexGuard};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

use devices::{CameraSettings, FrameInfo, PixelFormat, Roi, Trigger};
use vision::{GreyImage, Pixels};

use crate::live::fault::TwinFault;
use crate::live::options::Timing;
use crate::live::params::{BELT_START_MM, BOARD_EXPOSURE_US, LASER_EXPOSURE_US, READ_OUT, RING_FRAMES};
use crate::live::sensor_defects::add_sensor_defects;
use crate::live::world::{SharedWorld, View};
use crate::model::random::derived_seed;
use crate::params::BOARD_WHITE_LEVEL;
use crate::render::exposure::{Exposure, ExposureBuffers};

/// Random stream of live images, derived from a station's seed.
const LIVE_STREAM: u64 = 6;

/// Longest sleep of the sensor's thread, so that a missed wake-up costs little.
const LONGEST_SLEEP: Duration = Duration::from_millis(100);

/// A pending exposure.
pub(super) struct Pending {
    frame_id: u64,
    /// Middle of the exposure.
    at: Instant,
    settings: CameraSettings,
    /// The view of the sensor, once the middle of the exposure has passed.
    view: Option<(View, u64)>,
}

/// A frame that waits to be collected.
pub(super) struct Finished {
    pub info: FrameInfo,
    pub image: GreyImage,
    pub roi: Roi,
    /// Columns and rows delivered while a fault of a wrong format is active.
    pub wrong_px: Option<(usize, usize)>,
}

/// One acquisition, from start to stop.
pub(super) struct Run {
    number: u64,
    next_id: u64,
    /// Time of the next exposure of a free-running sensor.
    due: Instant,
    lost: u64,
    pub pending: VecDeque<Pending>,
    frames: VecDeque<Finished>,
    /// View of the last exposure, and its number of consecutive repetitions.
    still: (u64, u64),
}

/// State shared between driver and thread.
pub(super) struct SensorState {
    pub settings: CameraSettings,
    pub run: Option<Run>,
    pub n_runs: u64,
    pub gone: bool,
    /// Whether the thread is rendering an image.
    rendering: bool,
    spare: Vec<GreyImage>,
    closed: bool,
}

/// The sensor.
pub(super) struct Sensor {
    world: SharedWorld,
    timing: Timing,
    switched_on: Instant,
    state: Mutex<SensorState>,
    to_do: Condvar,
    frame_ready: Condvar,
}

impl Run {
    pub(super) fn new(number: u64, now: Instant) -> Self {
        Self {
            number,
            next_id: 0,
            due: now,
            lost: 0,
            pending: VecDeque::new(),
            frames: VecDeque::with_capacity(RING_FRAMES),
            still: (0, 0),
        }
    }

    /// Discards pending exposures whose settings no longer apply; they count as lost.
    pub(super) fn discard(&mut self) {
        self.lost += (self.pending.len() + self.frames.len()) as u64;
        self.lost += self.frames.iter().map(|frame| frame.info.lost_before).sum::<u64>();
        self.pending.clear();
        self.frames.clear();
        self.due = Instant::now();
    }

    /// Numbers an image by its content and by how often it was exposed since the last change, so that the same
    /// procedure gets the same noise, regardless of earlier events.
    fn image_number(&mut self, view: &View, settings: &CameraSettings) -> u64 {
        let shown = [
            view.scene.fingerprint(),
            view.position_mm.to_bits(),
            view.laser_power.to_bits(),
            settings.exposure_us.to_bits(),
            settings.gain_db.to_bits(),
            view.stray_levels.to_bits(),
            u64::from(view.covered),
        ];
        let key = shown.into_iter().fold(LIVE_STREAM, derived_seed);
        self.still = if self.still.0 == key { (key, self.still.1 + 1) } else { (key, 0) };
        derived_seed(key, self.still.1)
    }
}

impl SensorState {
    pub(super) fn end_run(&mut self) {
        if let Some(run) = self.run.take() {
            self.spare.extend(run.frames.into_iter().map(|frame| frame.image));
        }
    }

    /// Whether an exposure of this run is not a frame yet, or is due but not started by the thread.
    pub(super) fn is_computing(&self, now: Instant) -> bool {
        let free = self.settings.trigger != Trigger::Software;
        let behind = |run: &Run| !run.pending.is_empty() || (free && run.due <= now);
        self.run.as_ref().is_some_and(|run| self.rendering || behind(run))
    }

    pub(super) fn take_frame(&mut self) -> Option<Finished> {
        self.run.as_mut()?.frames.pop_front()
    }
}

impl Sensor {
    pub(super) fn new(world: SharedWorld, timing: Timing, settings: CameraSettings) -> Self {
        let state = SensorState {
            settings,
            run: None,
            n_runs: 0,
            gone: false,
            rendering: false,
            spare: Vec::new(),
            closed: false,
        };
        Self {
            world,
            timing,
            switched_on: Instant::now(),
            state: Mutex::new(state),
            to_do: Condvar::new(),
            frame_ready: Condvar::new(),
        }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, SensorState> {
        self.state.lock()
    }

    /// Wakes the thread.
    pub(super) fn wake(&self) {
        self.to_do.notify_all();
        self.frame_ready.notify_all();
    }

    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.wake();
    }

    pub(super) fn recycle(&self, image: GreyImage) {
        self.lock().spare.push(image);
    }

    /// Waits until a frame is available, the deadline has passed (`None`) or something changed.
    pub(super) fn wait_for_frame<'s>(
        &self,
        mut state: MutexGuard<'s, SensorState>,
        deadline: Instant,
    ) -> Option<MutexGuard<'s, SensorState>> {
        if state.run.as_ref().is_some_and(|run| !run.frames.is_empty()) {
            return Some(state);
        }
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return None;
        }
        self.frame_ready.wait_for(&mut state, left.min(LONGEST_SLEEP));
        Some(state)
    }

    /// Starts an exposure now.
    pub(super) fn expose(&self, run: &mut Run, settings: &CameraSettings) {
        let half = Duration::from_secs_f64(settings.exposure_us / 2e6);
        let now = Instant::now();
        let at = if self.timing == Timing::Realistic { now + half } else { now };
        let mut exposure = Pending { frame_id: run.next_id, at, settings: *settings, view: None };
        run.next_id += 1;
        if self.timing == Timing::Instant {
            self.look(run, &mut exposure);
        }
        run.pending.push_back(exposure);
    }

    fn look(&self, run: &mut Run, exposure: &mut Pending) {
        let world = self.world.lock();
        let mut view = world.view(exposure.at);
        if let Some(pitch_mm) = world.belt_pitch_mm.filter(|_| exposure.settings.trigger == Trigger::Hardware) {
            view.position_mm = BELT_START_MM + exposure.frame_id as f64 * pitch_mm;
        }
        drop(world);
        let image_number = run.image_number(&view, &exposure.settings);
        exposure.view = Some((view, image_number));
    }

    /// The thread: exposes, renders and delivers until the camera is closed.
    pub(super) fn run(&self) {
        let mut buffers = ExposureBuffers::default();
        let mut state = self.lock();
        while !state.closed {
            let now = Instant::now();
            match self.next_exposure(&mut state, now) {
                Ok((number, exposure, mut image)) => {
                    state.rendering = true;
                    drop(state);
                    self.render(&exposure, &mut buffers, &mut image);
                    self.read_out(&exposure);
                    state = self.lock();
                    state.rendering = false;
                    self.deliver(&mut state, number, &exposure, image);
                }
                Err(wait) => {
                    let sleep = wait.min(LONGEST_SLEEP);
                    self.to_do.wait_for(&mut state, sleep);
                }
            }
        }
    }

    /// The next exposure to render and memory for it, or the time until there is one.
    fn next_exposure(&self, state: &mut SensorState, now: Instant) -> Result<(u64, Pending, GreyImage), Duration> {
        let settings = state.settings;
        let Some(run) = &mut state.run else { return Err(LONGEST_SLEEP) };
        let hangs = self.world.lock().has(TwinFault::CameraHang);
        if hangs {
            run.pending.clear();
            return Err(LONGEST_SLEEP);
        }
        if settings.trigger == Trigger::Hardware && self.world.lock().has(TwinFault::ConveyorStopped) {
            // Nothing is due, so that nothing is being computed either.
            run.due = now + 2 * LONGEST_SLEEP;
            return Err(LONGEST_SLEEP / 4);
        }
        // A belt triggers at the same rate.
        if settings.trigger != Trigger::Software && run.pending.is_empty() {
            if now < run.due {
                return Err(run.due - now);
            }
            self.expose(run, &settings);
            // A late sensor does not catch up: its next exposure is one period after this one was due, or now.
            run.due = (run.due + Duration::from_secs_f64(1.0 / settings.frame_rate_hz)).max(now);
        }
        let Some(first) = run.pending.front() else { return Err(LONGEST_SLEEP) };
        if first.at > now {
            return Err(first.at - now);
        }
        let mut exposure = run.pending.pop_front().expect("it was looked at just before");
        if exposure.view.is_none() {
            self.look(run, &mut exposure);
        }
        let every = self
            .world
            .lock()
            .fault(|fault| if let TwinFault::LostFrames { every } = *fault { Some(every) } else { None });
        if every.is_some_and(|every| (exposure.frame_id + 1).is_multiple_of(every))
            || run.frames.len() >= RING_FRAMES
        {
            run.lost += 1;
            return Err(Duration::ZERO);
        }
        let blank = || GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image");
        Ok((run.number, exposure, state.spare.pop().unwrap_or_else(blank)))
    }

    fn render(&self, exposure: &Pending, buffers: &mut ExposureBuffers, image: &mut GreyImage) {
        if let Some((view, image_number)) = &exposure.view {
            view.renderer.expose(&light_of(view, &exposure.settings, *image_number), buffers, image);
            if view.defect_levels > 0.0 {
                add_sensor_defects(image, view.renderer.model().seed, view.defect_levels);
            }
        }
    }

    /// Waits until the frame would be read out.
    fn read_out(&self, exposure: &Pending) {
        if self.timing == Timing::Realistic {
            let half = Duration::from_secs_f64(exposure.settings.exposure_us / 2e6);
            std::thread::sleep((exposure.at + half + READ_OUT).saturating_duration_since(Instant::now()));
        }
    }

    fn deliver(&self, state: &mut SensorState, number: u64, exposure: &Pending, image: GreyImage) {
        let world = self.world.lock();
        let (half_height, wide) = (world.has(TwinFault::WrongFrameSize), world.has(TwinFault::WrongPixelFormat));
        drop(world);
        let settings = exposure.settings;
        let roi = settings.roi;
        let wrong_px = match (half_height, wide) {
            (true, _) => Some((roi.width_px, roi.height_px / 2)),
            (_, true) => Some((bytes_of_other_format(settings.pixel_format, roi.width_px), roi.height_px)),
            _ => None,
        };
        let Some(run) = state.run.as_mut().filter(|run| run.number == number) else {
            state.spare.push(image);
            return;
        };
        let info = FrameInfo {
            frame_id: exposure.frame_id,
            device_timestamp_ns: Some((exposure.at - self.switched_on).as_nanos() as u64),
            exposed_at: exposure.at,
            lost_before: std::mem::take(&mut run.lost),
            lost_incomplete: 0,
            exposure_us: settings.exposure_us,
            recorded_position_mm: None,
        };
        run.frames.push_back(Finished { info, image, roi, wrong_px });
        self.frame_ready.notify_all();
    }
}

/// The light of a view: the board illumination if the laser is off, else the laser with the ambient light of the room
/// and the light scattered by dirt. In a room with ambient light there is no board illumination: the ambient light is
/// independent of the laser.
fn light_of<'v>(view: &'v View, settings: &CameraSettings, image_number: u64) -> Exposure<'v> {
    if view.covered {
        return Exposure {
            scene: &view.scene,
            position: view.position_mm,
            ambient_level: 0.0,
            ambient_exposure: 0.0,
            laser_exposure: 0.0,
            gain: 1.0,
            bits: if settings.pixel_format == PixelFormat::Mono16 { 16 } else { 8 },
            image_number,
        };
    }
    let dark = view.laser_power <= 0.0;
    let ambient = view.renderer.model().shape.ambient_levels;
    let by_board_light = dark && ambient <= 0.0;
    let nominal_us = if by_board_light { BOARD_EXPOSURE_US } else { LASER_EXPOSURE_US };
    let fraction = settings.exposure_us / nominal_us;
    let room = ambient + view.stray_levels * view.laser_power;
    Exposure {
        scene: &view.scene,
        position: view.position_mm,
        ambient_level: if by_board_light { BOARD_WHITE_LEVEL } else { room },
        ambient_exposure: fraction as f32,
        laser_exposure: if dark { 0.0 } else { (view.laser_power * fraction) as f32 },
        gain: 10.0_f64.powf(settings.gain_db / 20.0) as f32,
        bits: if settings.pixel_format == PixelFormat::Mono16 { 16 } else { 8 },
        image_number,
    }
}

/// Width of a row when its bytes are interpreted as pixels of the agreed format.
fn bytes_of_other_format(agreed: PixelFormat, width_px: usize) -> usize {
    match agreed {
        PixelFormat::Mono8 => 2 * width_px,
        PixelFormat::Mono16 => width_px.div_ceil(2),
    }
}
