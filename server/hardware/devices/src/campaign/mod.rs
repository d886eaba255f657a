//! Campaigns of serial faults: at random times in random states, over the simulated firmwares.
//!
//! Counted are hangs (a call that blocks its caller, a stage that neither comes to rest nor reports a fault, one that
//! does not recover), wrong positions accepted, and lasers left on; each must be 0. The long version is ignored and run
//! by `cargo xtask campaign`. Not covered: faults that neither end of a line detects, and real firmware.

mod line;
mod rigs;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::contract::Stopwatch;
use crate::time;
use line::{LineControl, Noise};

/// The fault injected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum FaultKind {
    Garbage,
    FlippedBit,
    Silence,
    HalfLines,
    LostCommand,
    Restart,
    Alarm,
    OtherDevice,
    EndOfFile,
}

const ALL: [FaultKind; 9] = [
    FaultKind::Garbage,
    FaultKind::FlippedBit,
    FaultKind::Silence,
    FaultKind::HalfLines,
    FaultKind::LostCommand,
    FaultKind::Restart,
    FaultKind::Alarm,
    FaultKind::OtherDevice,
    FaultKind::EndOfFile,
];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum When {
    Ready,
    Moving,
    Homing,
    Emitting,
    EmittingAndMoving,
}

/// Stage and laser on a line with a disturbance.
#[allow(clippy::type_complexity)]
struct Rig {
    stage: Box<dyn crate::Stage>,
    laser: Option<Box<dyn crate::Laser>>,
    event_log: crate::simulators::simulator::EventLog,
    line: LineControl,
    /// Requests to the firmware: restart, alarm, another device, end of file, repair.
    act: Box<dyn Fn(Act)>,
    /// Stage position of a machine position, mm.
    stage_from_machine: fn(f64) -> f64,
    /// Tolerance of positions: steps, decimals.
    tolerance_mm: f64,
    /// Tolerance of the time of a reading in motion.
    reading_slack: Duration,
    /// Time limit for reporting a fault that occurs during homing.
    homing_report_limit: Duration,
    /// Readings in motion that are checked once the motion of the axis is known: position, time.
    unchecked: Vec<(f64, Instant)>,
    _folder: tempfile::TempDir,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Act {
    Restart,
    Alarm,
    OtherDevice,
    Unplug,
    ResetButton,
    Repair,
}

/// Time after which an operation counts as a hang.
const HANG: Duration = Duration::from_secs(12);

/// Laser off after a fault was reported, or after `switch_off` (`promises.md` 3), plus the latency of a loaded machine.
const LASER_OFF_LIMIT: Duration = Duration::from_millis(500 + 700);

/// Serial faults are reported within this time (`promises.md`), counted from their effect.
const REPORT_LIMIT: Duration = Duration::from_secs(1);

/// Number of attempts to make a station ready, as a person would.
const N_ATTEMPTS: usize = 4;

/// A call may take 20 ms, which the contract suite checks; this is a hang even on a machine that stalls.
const CALL_HANG: Duration = Duration::from_secs(5);

#[derive(Debug, Default)]
struct Tally {
    n_faults: usize,
    n_reported: BTreeMap<FaultKind, usize>,
    longest: BTreeMap<FaultKind, Duration>,
    failures: Vec<String>,
}

/// A pseudo-random sequence (xorshift).
struct Xorshift(u64);

impl Xorshift {
    fn roll(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

impl Rig {
    fn poll(&mut self, tally: &mut Tally) -> Result<crate::StageState, crate::StageError> {
        let watch = Stopwatch::start();
        let state = self.stage.poll();
        if watch.own_time() > CALL_HANG {
            tally.failures.push(format!("hang: a poll took {:?}", watch.own_time()));
        }
        if let Ok(state) = &state {
            self.check_position(state, tally);
        }
        let (checked, unchecked) = std::mem::take(&mut self.unchecked)
            .into_iter()
            .partition(|(_, at)| time::since(*at) > self.reading_slack);
        self.unchecked = unchecked;
        let checked: Vec<_> = checked;
        checked.into_iter().for_each(|(position_mm, at)| self.check_position_in_motion(position_mm, at, tally));
        state
    }

    /// A position at rest must be where the motion ended according to the event log; one in motion must be on the path.
    fn check_position(&mut self, state: &crate::StageState, tally: &mut Tally) {
        use crate::simulators::simulator::LogEvent::{MotionBegan, MotionEnded};
        let Some(position_mm) = state.position_mm else { return };
        // The switch is 6 mm from the stage's zero; homing backs off from it to 5 mm.
        if position_mm.abs() > 6.0 + self.tolerance_mm {
            tally.failures.push(format!("wrong position: {position_mm} mm is outside all commanded positions"));
        }
        if state.moving || self.event_log.moving() {
            self.unchecked.push((position_mm, state.measured_at));
            return;
        }
        let last = self
            .event_log
            .entries()
            .into_iter()
            .rev()
            .find(|entry| matches!(entry.what, MotionEnded(_) | MotionBegan(_)));
        // A reading from before the end of the motion is not checked: the stage was not at rest.
        if let Some(entry) = last.filter(|entry| entry.at < state.measured_at)
            && let MotionEnded(machine_mm) = entry.what
        {
            let true_mm = (self.stage_from_machine)(machine_mm);
            if (position_mm - true_mm).abs() > self.tolerance_mm {
                tally.failures.push(format!("wrong position: reported {position_mm} mm, it is at {true_mm} mm"));
            }
        }
    }

    /// A position in motion must be one that the axis had at about that time.
    fn check_position_in_motion(&self, position_mm: f64, at: Instant, tally: &mut Tally) {
        let (from, to) = (at - self.reading_slack, at + self.reading_slack);
        let Some((low_mm, high_mm)) = self.event_log.positions_between(from, to) else { return };
        let (one_mm, other_mm) = ((self.stage_from_machine)(low_mm), (self.stage_from_machine)(high_mm));
        let (low_mm, high_mm) = (one_mm.min(other_mm), one_mm.max(other_mm));
        if position_mm < low_mm - self.tolerance_mm || position_mm > high_mm + self.tolerance_mm {
            tally.failures.push(format!(
                "wrong position: reported {position_mm} mm during a move, it was at {low_mm} to {high_mm} mm"
            ));
        }
    }

    /// Waits until `condition` holds; otherwise it is a hang.
    fn wait(
        &mut self,
        what: &str,
        tally: &mut Tally,
        mut condition: impl FnMut(&mut Self, &mut Tally) -> bool,
    ) -> bool {
        let watch = Stopwatch::start();
        while !condition(self, tally) {
            if watch.own_time() > HANG {
                tally.failures.push(format!("hang: {what}"));
                return false;
            }
            time::sleep(Duration::from_millis(3));
        }
        true
    }

    /// The last bytes received by the firmware.
    fn received(&self) -> String {
        let entries = self.event_log.entries();
        let bytes = entries.iter().rev().filter_map(|entry| match entry.what {
            crate::simulators::simulator::LogEvent::Byte(byte) => Some(char::from(byte)),
            _ => None,
        });
        bytes.take(80).collect::<Vec<_>>().into_iter().rev().collect()
    }

    /// Waits for the end of a motion; returns whether it ended without a fault. Neither is a hang.
    fn rests(&mut self, what: &str, tally: &mut Tally) -> bool {
        let mut ended_well = false;
        self.wait(what, tally, |rig, tally| {
            let state = rig.poll(tally);
            ended_well = state.as_ref().is_ok_and(|state| !state.moving);
            ended_well || state.is_err()
        });
        ended_well
    }

    /// Makes the stage ready, homed and at -3 mm. Data left in the line by a fault may cause a fault at first.
    fn make_ready(&mut self, tally: &mut Tally) -> bool {
        let is_ready = |rig: &mut Self, tally: &mut Tally| {
            rig.reconnects(tally)
                && rig.rests("it is not at rest after the reconnection", tally)
                && rig.stage.start_home().is_ok()
                && rig.rests("homing does not end", tally)
                && rig.stage.start_move(-3.0, 100.0).is_ok()
                && rig.rests("a move does not end", tally)
        };
        (0..N_ATTEMPTS).any(|_| is_ready(self, tally))
    }

    fn reconnects(&mut self, tally: &mut Tally) -> bool {
        self.line.set(Noise::None);
        (self.act)(Act::Repair);
        let mut requested_at: Option<Instant> = None;
        self.wait("it is not reconnected", tally, |rig, tally| {
            let Err(fault) = rig.poll(tally) else { return true };
            if requested_at.is_none_or(|at| time::since(at) > Duration::from_millis(1500)) {
                requested_at = Some(time::now());
                if rig.stage.clear_fault().is_err() {
                    // As a person who follows the remedy.
                    if fault.to_string().contains("reset button")
                        || matches!(fault, crate::StageError::NoResponse { .. })
                    {
                        (rig.act)(Act::ResetButton);
                    }
                    rig.stage.reconnect().ok();
                }
                if let Some(laser) = &mut rig.laser
                    && laser.poll().is_err()
                {
                    laser.reconnect().ok();
                }
            }
            false
        })
    }

    fn bring_to(&mut self, when: When, tally: &mut Tally) {
        if matches!(when, When::Emitting | When::EmittingAndMoving)
            && let Some(laser) = &mut self.laser
        {
            let is_on = laser.switch_on(0.5, Duration::from_secs(1)).is_ok();
            // A lease that ends before the laser was reported on is not a hang.
            self.wait("the laser does not turn on", tally, |rig, _| {
                let ended = rig.laser.as_mut().is_none_or(|laser| !laser.poll().is_ok_and(|state| state.emitting));
                !is_on || rig.event_log.light() || ended
            });
        }
        match when {
            When::Moving | When::EmittingAndMoving => drop(self.stage.start_move(3.5, 3.0)),
            When::Homing => drop(self.stage.start_home()),
            When::Ready | When::Emitting => {}
        }
    }

    fn inject(&mut self, what: FaultKind, rng: &mut Xorshift) {
        let some = 1 + rng.roll(6);
        match what {
            FaultKind::Garbage => self.line.set(Noise::Garbage),
            FaultKind::FlippedBit => self.line.set(Noise::Flips(some)),
            FaultKind::Silence => self.line.set(Noise::Silence),
            FaultKind::HalfLines => self.line.set(Noise::Halves),
            FaultKind::LostCommand => self.line.set(Noise::LostWrites(some)),
            FaultKind::Restart => (self.act)(Act::Restart),
            FaultKind::Alarm => (self.act)(Act::Alarm),
            FaultKind::OtherDevice => (self.act)(Act::OtherDevice),
            FaultKind::EndOfFile => (self.act)(Act::Unplug),
        }
    }

    /// Injects one fault and checks the recovery.
    fn run_fault(&mut self, what: FaultKind, when: When, rng: &mut Xorshift, tally: &mut Tally) {
        let was_on = matches!(when, When::Emitting | When::EmittingAndMoving) && self.laser.is_some();
        self.bring_to(when, tally);
        time::sleep(Duration::from_millis(rng.roll(150) as u64));
        let injected = Stopwatch::start();
        self.inject(what, rng);
        tally.n_faults += 1;
        let injected_at = time::now();
        let limit = if when == When::Homing { self.homing_report_limit } else { REPORT_LIMIT };
        // Until it is reported, or, if it has no effect, for longer than the limit.
        let mut reported = None;
        while reported.is_none() && injected.own_time() < REPORT_LIMIT + Duration::from_millis(800) {
            if was_on && let Some(laser) = &mut self.laser {
                laser.renew(Duration::from_secs(1)).ok();
            }
            reported = self.poll(tally).err();
            time::sleep(Duration::from_millis(3));
        }
        if let Some(fault) = &reported {
            let took = time::since(self.line.effective_at().unwrap_or(injected_at));
            *tally.n_reported.entry(what).or_default() += 1;
            let longest = tally.longest.entry(what).or_default();
            *longest = (*longest).max(took);
            if took > limit {
                tally.failures.push(format!("late: reported after {took:?}: {fault}"));
            }
        } else if let Some(laser) = &mut self.laser {
            laser.switch_off().ok();
        }
        let watch = Stopwatch::start();
        while self.event_log.light() {
            if watch.own_time() > LASER_OFF_LIMIT {
                let received = self.received();
                tally
                    .failures
                    .push(format!("laser left on, reported as {reported:?}, received last: {received:?}"));
                break;
            }
            time::sleep(Duration::from_millis(2));
        }
    }
}

/// `n` faults on one rig; returns the tally.
fn run(open: fn() -> Rig, n: usize, seed: u64) -> Tally {
    let (mut tally, mut rng) = (Tally::default(), Xorshift(seed));
    let mut rig = open();
    for _ in 0..n {
        let what = ALL[rng.roll(ALL.len())];
        let states = [When::Ready, When::Moving, When::Homing, When::Emitting, When::EmittingAndMoving];
        let when = states[rng.roll(if rig.laser.is_some() { 5 } else { 3 })];
        let before = tally.failures.len();
        if !rig.make_ready(&mut tally) {
            tally.failures.push("hang: it does not become ready again".to_owned());
            rig = open();
            continue;
        }
        rig.run_fault(what, when, &mut rng, &mut tally);
        for failure in &mut tally.failures[before..] {
            failure.push_str(&format!(" ({what:?} while {when:?})"));
        }
    }
    rig.make_ready(&mut tally);
    tally
}

/// Rigs tested in parallel, each under its own clock.
const N_RIGS: usize = 10;

/// Number of faults: a thousand, or `N_FAULTS` of the environment.
fn n_faults() -> usize {
    std::env::var("N_FAULTS").map_or(1000, |n| n.parse().expect("N_FAULTS is a number"))
}

fn campaign(name: &str, open: fn() -> Rig, n_faults: usize, n_rigs: usize) {
    let each = n_faults.div_ceil(n_rigs);
    let rigs = (0..n_rigs).map(|idx| {
        let seed = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(idx as u64 + 1);
        std::thread::spawn(move || time::simulated(|| run(open, each, seed)))
    });
    let rigs: Vec<_> = rigs.collect();
    let mut all = Tally::default();
    for rig in rigs {
        let one = rig.join().expect("a rig panics for a fault of the campaign only");
        all.n_faults += one.n_faults;
        all.failures.extend(one.failures);
        one.n_reported.into_iter().for_each(|(what, n)| *all.n_reported.entry(what).or_default() += n);
        for (what, longest) in one.longest {
            let before = all.longest.entry(what).or_default();
            *before = (*before).max(longest);
        }
    }
    let count = |word: &str| all.failures.iter().filter(|failure| failure.starts_with(word)).count();
    println!(
        "{name}: {} faults; {} reported late, {} hangs, {} wrong positions accepted, laser left on {} times",
        all.n_faults,
        count("late"),
        count("hang"),
        count("wrong position"),
        count("laser")
    );
    for (what, n) in &all.n_reported {
        println!("  {what:?}: {n} reported, the last after {:?}", all.longest[what]);
    }
    assert!(all.failures.is_empty(), "{name}: {:#?}", all.failures);
}

macro_rules! campaigns {
    ($($name:ident, $short:ident, $long:ident;)*) => {$(
        #[test]
        fn $short() {
            campaign(stringify!($name), rigs::$name, 12, 2);
        }

        #[test]
        #[ignore = "a thousand faults take minutes: `cargo xtask campaign`"]
        fn $long() {
            campaign(stringify!($name), rigs::$name, n_faults(), N_RIGS);
        }
    )*};
}

campaigns! {
    grbl, a_dozen_faults_of_grbl, a_thousand_faults_of_grbl;
    zaber, a_dozen_faults_of_zaber, a_thousand_faults_of_zaber;
    marlin, a_dozen_faults_of_marlin, a_thousand_faults_of_marlin;
}
