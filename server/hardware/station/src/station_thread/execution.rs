//! Execution of the commands.

use devices::{AcceptedMove, StageCapabilities, Trigger};

use crate::params::REPORT_ROUNDING_MM;
use crate::parts::faults::fault_of;
use crate::parts::machine::Event;
use crate::parts::motion::Motion;
use crate::parts::tap::Tap;
use crate::shared::refusal::StationRefusal;
use crate::shared::status::MachineState::{Error, Halted, Operational, Preoperational};
use crate::shared::status::OperationalState::SingleExecution;
use crate::shared::tap::FrameTap;
use crate::station_thread::command::{Command, JobCall, Reply};
use crate::station_thread::handle::{Manual, Purpose};
use crate::station_thread::station::{LeaseHolder, Revoked, Station};
use crate::station_thread::task::Task;

impl Station {
    /// Executes a command, or refuses it with a reason.
    pub(crate) fn execute(&mut self, command: Command) {
        match command {
            Command::Manual(manual, reply) => self.execute_manual(manual, reply),
            Command::Live(request, reply) => self.execute_live(request, reply),
            Command::Snapshot(reply) => self.begin_snapshot(reply),
            Command::Tap(reply) => self.open_tap(reply),
            Command::CloseTap(reply) => {
                self.tap = None;
                self.answer(reply, Ok(()));
            }
            Command::CalibrationChanged(active) => self.calibrated = active,
            Command::DarkFrame(dark) => self.dark_frame = dark,
            Command::Lease(purpose, reply) => self.grant_lease(purpose, reply),
            Command::Job(lease, call) => self.execute_job(lease, call),
            Command::Release(lease, reply) => {
                self.release_lease(lease);
                self.answer(reply, Ok(()));
            }
            Command::Alarm(fault) => self.raise(fault),
            Command::Wake => {}
            Command::ShutDown => self.ending = true,
        }
    }

    fn open_tap(&mut self, reply: Reply<FrameTap>) {
        if self.tap.is_some() {
            return self.answer(reply, Err(StationRefusal::Busy { activity: "recording".to_owned() }));
        }
        let (tap, frames) = Tap::new();
        self.tap = Some(tap);
        self.answer(reply, Ok(frames));
    }

    /// Answers with a refusal; an underlying device failure becomes a fault of the station.
    pub(crate) fn refuse<T: Send + 'static>(&mut self, reply: Reply<T>, refusal: StationRefusal) {
        let fault = fault_of(&refusal);
        self.answer(reply, Err(refusal));
        if let Some(fault) = fault {
            self.raise(fault);
        }
    }

    fn execute_manual(&mut self, manual: Manual, reply: Reply<Option<AcceptedMove>>) {
        let done = match manual {
            Manual::Reset => return self.begin_reset(reply),
            Manual::Configure(wanted) => self.configure_manually(wanted),
            Manual::Laser { power: 0.0 } => self.turn_laser_off_manually(),
            _ => match self.check_manual_allowed() {
                Ok(()) => self.move_manually(manual),
                Err(refusal) => Err(refusal),
            },
        };
        match done {
            Ok(accepted) => self.answer(reply, Ok(accepted)),
            Err(refusal) => self.refuse(reply, refusal),
        }
    }

    /// Whether a person may move the stage or use the laser now.
    pub(crate) fn check_manual_allowed(&self) -> Result<(), StationRefusal> {
        match self.machine {
            _ if self.publisher.stop_latch.is_latched() => Err(StationRefusal::Halted),
            Preoperational | Error => Err(self.in_error()),
            Halted => Err(StationRefusal::Halted),
            Operational(SingleExecution) => Err(StationRefusal::Busy { activity: self.activity().to_owned() }),
            Operational(_) => Ok(()),
        }
    }

    fn move_manually(&mut self, manual: Manual) -> Result<Option<AcceptedMove>, StationRefusal> {
        let stage = self.stage.as_mut().ok_or(StationRefusal::Absent { device: "stage" })?;
        match manual {
            Manual::Home => Ok(stage.start_home().map(|()| None)?),
            Manual::Move { target_mm, speed_mm_s } => {
                let speed_mm_s = speed_mm_s.unwrap_or(stage.device().capabilities().max_speed_mm_s);
                check_speed(speed_mm_s, &stage.device().capabilities())?;
                Ok(Some(stage.start_move(target_mm, speed_mm_s)?))
            }
            Manual::Jog { velocity_mm_s } => {
                if velocity_mm_s != 0.0 {
                    check_speed(velocity_mm_s.abs(), &stage.device().capabilities())?;
                }
                Ok(stage.jog(velocity_mm_s)?)
            }
            Manual::Laser { power } => self.light_live_view(power).map(|()| None),
            Manual::Configure(_) | Manual::Reset => Ok(None),
        }
    }

    fn turn_laser_off_manually(&mut self) -> Result<Option<AcceptedMove>, StationRefusal> {
        if let Operational(SingleExecution) = self.machine {
            return Err(StationRefusal::Busy { activity: self.activity().to_owned() });
        }
        let laser = self.laser.as_mut().ok_or(StationRefusal::Absent { device: "laser" })?;
        Ok(laser.off().map(|()| None)?)
    }

    fn configure_manually(
        &mut self,
        mut wanted: devices::CameraRequest,
    ) -> Result<Option<AcceptedMove>, StationRefusal> {
        if let Operational(SingleExecution) = self.machine {
            return Err(StationRefusal::Busy { activity: self.activity().to_owned() });
        }
        if self.is_faulted("camera") {
            return Err(self.in_error());
        }
        if self.live.is_some() && wanted.trigger.is_some_and(|trigger| trigger != Trigger::Free) {
            // A live view runs freely; the trigger mode is restored when it ends.
            wanted.trigger = None;
        }
        let camera = self.camera.as_mut().ok_or(StationRefusal::Absent { device: "camera" })?;
        Ok(camera.configure(&wanted).map(|_| None)?)
    }

    fn grant_lease(&mut self, purpose: Purpose, reply: Reply<u64>) {
        let by_hand = self.task.is_some() || self.stage.as_ref().is_some_and(Motion::is_under_way);
        let stopped_since = purpose.epoch != self.publisher.stop_latch.epoch();
        let refusal = match self.machine {
            _ if stopped_since => Some(StationRefusal::Stopped { actor: self.stopped_by.clone() }),
            Halted => Some(StationRefusal::Halted),
            Preoperational | Error => Some(self.in_error()),
            Operational(SingleExecution) => Some(StationRefusal::Busy { activity: self.activity().to_owned() }),
            _ if by_hand => Some(StationRefusal::Busy { activity: self.activity().to_owned() }),
            _ => None,
        };
        if let Some(refusal) = refusal {
            return self.answer(reply, Err(refusal));
        }
        self.end_live();
        self.transition(Event::JobBegins);
        self.leases += 1;
        let camera_before = self.camera.as_ref().map(|camera| camera.settings());
        self.holder = Some(LeaseHolder { lease: self.leases, purpose, camera_before });
        self.answer(reply, Ok(self.leases));
    }

    /// The job releases the station: laser off, stage at rest, camera settings restored.
    fn release_lease(&mut self, lease: u64) {
        if self.holder.as_ref().is_none_or(|holder| holder.lease != lease) {
            return;
        }
        self.end_work(|_| StationRefusal::Cancelled);
        self.turn_laser_off();
        self.come_to_rest();
        self.revoke_lease(None);
        self.transition(Event::JobEnds);
    }

    /// Ends the current lease and restores the camera; `why` is the answer to later calls of that job.
    pub(crate) fn revoke_lease(&mut self, why: Option<Revoked>) {
        let Some(holder) = self.holder.take() else { return };
        self.revoked = why.map(|why| (holder.lease, why));
        self.restore_camera(holder.camera_before);
    }

    fn execute_job(&mut self, lease: u64, call: JobCall) {
        if self.holder.as_ref().is_none_or(|holder| holder.lease != lease) {
            return call.refuse(self.revoked_reason(lease));
        }
        if let JobCall::Activity(activity) = call {
            if let Some(holder) = &mut self.holder {
                holder.purpose.activity = activity;
            }
            return;
        }
        let by_run = self.run.is_some() && !matches!(call, JobCall::Light(..));
        if self.task.is_some() || by_run {
            return call.refuse(StationRefusal::Busy { activity: self.activity().to_owned() });
        }
        self.begin(call);
    }

    fn begin(&mut self, call: JobCall) {
        match call {
            JobCall::Configure(wanted, reply) => {
                let camera = self.camera.as_mut().ok_or(StationRefusal::Absent { device: "camera" });
                match camera.and_then(|camera| Ok(camera.configure(&wanted)?)) {
                    Ok(settings) => self.answer(reply, Ok(settings)),
                    Err(refusal) => self.refuse(reply, refusal),
                }
            }
            JobCall::Light(power, reply) => self.begin_light(power, reply),
            JobCall::Home(cancel, reply) => self.task = Some(Task::Home { started: false, cancel, reply }),
            JobCall::MoveTo { target_mm, speed_mm_s, cancel, reply } => {
                self.task = Some(Task::Move { target_mm, speed_mm_s, started: false, cancel, reply });
            }
            JobCall::Grab(cancel, reply) => self.begin_grab(Some(cancel), reply),
            JobCall::Sweep(sweep, cancel, reply) => self.begin_run(sweep, cancel, reply),
            JobCall::Activity(_) => {}
        }
    }

    fn revoked_reason(&self, lease: u64) -> StationRefusal {
        match &self.revoked {
            Some((revoked, Revoked::Stopped { actor })) if *revoked == lease => {
                StationRefusal::Stopped { actor: actor.clone() }
            }
            Some((revoked, Revoked::Fault)) if *revoked == lease => self.in_error(),
            _ => StationRefusal::Busy { activity: self.activity().to_owned() },
        }
    }
}

/// Checks that the stage supports the speed: neither too slow ever to arrive, nor too fast.
fn check_speed(speed_mm_s: f64, capabilities: &StageCapabilities) -> Result<(), StationRefusal> {
    let (min_mm_s, max_mm_s) = (capabilities.resolution_mm.max(REPORT_ROUNDING_MM), capabilities.max_speed_mm_s);
    if (min_mm_s..=max_mm_s).contains(&speed_mm_s) {
        return Ok(());
    }
    Err(StationRefusal::SpeedOutOfRange { speed_mm_s, min_mm_s, max_mm_s })
}
