//! State shared by camera and stage of a replay: whether frames play, and the position of the last one.

use parking_lot::{Mutex, MutexGuard};
use std::time::Instant;

use crate::StopHandle;

/// A move that ends when frames pass its target.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Move {
    from_mm: f64,
    target_mm: f64,
}

/// State shared by camera and stage.
#[derive(Debug)]
pub struct Playback {
    playing: bool,
    held: bool,
    position_mm: Option<f64>,
    measured_at: Instant,
    under_way: Option<Move>,
    /// Whether frames were delivered since playback started.
    begun: bool,
    sweep: Option<Sweep>,
}

/// Start and direction of the playback of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Position of the stage.
    pub from_mm: f64,
    /// Target of the stage.
    pub to_mm: f64,
}

/// The reported state of the stage.
#[derive(Debug, Clone, Copy)]
pub struct PlaybackState {
    /// Position of the last frame, or of the end of a move without frames.
    pub position_mm: Option<f64>,
    /// When it was delivered.
    pub measured_at: Instant,
    /// Whether a move waits for frames.
    pub moving: bool,
    /// Whether frames are held back.
    pub held: bool,
}

impl StopHandle for Mutex<Playback> {
    fn stop_now(&self) {
        lock(self).stop();
    }
}

impl Playback {
    pub fn new(position_mm: Option<f64>) -> Self {
        Self {
            playing: false,
            held: false,
            position_mm,
            measured_at: Instant::now(),
            under_way: None,
            begun: false,
            sweep: None,
        }
    }

    pub fn playback_state(&self) -> PlaybackState {
        let moving = self.under_way.is_some() && !self.held;
        let measured_at = if self.playing { self.measured_at } else { Instant::now() };
        PlaybackState { position_mm: self.position_mm, measured_at, moving, held: self.held }
    }

    pub fn under_way(&self) -> bool {
        self.under_way.is_some()
    }

    pub fn held(&self) -> bool {
        self.held
    }

    /// Starts the playback of frames.
    pub fn play(&mut self) {
        (self.playing, self.begun) = (true, false);
    }

    /// The sweep that begins with the next frame, returned once.
    pub fn take_sweep(&mut self) -> Option<Sweep> {
        self.sweep.take()
    }

    /// Ends the playback; a move still in progress then takes no time.
    pub fn end(&mut self) {
        (self.playing, self.held, self.sweep) = (false, false, None);
        if let Some(ended) = self.under_way.take() {
            self.arrive(ended.target_mm);
        }
    }

    /// Notes the delivery of a frame taken at `position_mm`.
    pub fn delivered(&mut self, position_mm: Option<f64>, at: Instant) {
        self.begun = true;
        let Some(position_mm) = position_mm else { return };
        (self.position_mm, self.measured_at) = (Some(position_mm), at);
        if self.under_way.is_some_and(|step| step.passed_at(position_mm)) {
            self.under_way = None;
        }
    }

    pub fn start_move(&mut self, target_mm: f64) {
        if self.playing {
            let from_mm = self.position_mm.unwrap_or(target_mm);
            self.under_way = Some(Move { from_mm, target_mm });
            if !self.begun {
                self.sweep = Some(Sweep { from_mm, to_mm: target_mm });
            }
        } else {
            self.arrive(target_mm);
        }
    }

    pub fn hold(&mut self) {
        self.held = self.under_way.is_some();
    }

    pub fn resume(&mut self) {
        self.held = false;
    }

    /// Ends the move; frames continue to play.
    pub fn stop(&mut self) {
        (self.held, self.under_way, self.sweep) = (false, None, None);
    }

    fn arrive(&mut self, target_mm: f64) {
        (self.position_mm, self.measured_at) = (Some(target_mm), Instant::now());
    }
}

impl Move {
    fn passed_at(&self, position_mm: f64) -> bool {
        if self.target_mm >= self.from_mm { position_mm >= self.target_mm } else { position_mm <= self.target_mm }
    }
}

/// The shared state; it stays consistent after a panic of the other owner, because each change is a single assignment.
pub fn lock(playback: &Mutex<Playback>) -> MutexGuard<'_, Playback> {
    playback.lock()
}
