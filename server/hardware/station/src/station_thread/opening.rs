//! Opening devices: every driver on its own thread, so that one that hangs does not block the others.

use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::Instant;

use devices::{DeviceSet, OpenError, Opened};

use crate::params::OPENING_LIMIT;
use crate::parts::acquisition::Acquisition;
use crate::parts::devices::DriverDevices;
use crate::parts::faults::fault;
use crate::parts::light::Light;
use crate::parts::machine::Event;
use crate::parts::motion::Motion;
use crate::station_thread::station::Station;

/// Kind of the fault of a driver that hangs; cleared when the driver returns.
const OPENING: &str = "opening";

/// A driver that opens its devices.
pub struct Opening {
    group: DriverDevices,
    answer: Receiver<Result<Opened, OpenError>>,
    since: Instant,
    /// Its result, installed together with those of the others.
    done: Option<Result<Opened, OpenError>>,
    /// The wait for it has timed out; its devices may still arrive.
    overdue: bool,
}

impl Opening {
    fn begin(group: DriverDevices) -> Self {
        let (sender, answer) = sync_channel(1);
        let opened = group.clone();
        let open = move || drop(sender.send(opened.open()));
        // Without a thread the receiver reports that nothing arrived.
        let _ = std::thread::Builder::new().name("station-open".to_owned()).spawn(open);
        Self { group, answer, since: Instant::now(), done: None, overdue: false }
    }

    fn poll(&mut self) {
        if self.done.is_none() {
            self.done = match self.answer.try_recv() {
                Ok(answer) => Some(answer),
                Err(TryRecvError::Empty) => None,
                Err(TryRecvError::Disconnected) => Some(Ok(Opened::default())),
            };
        }
    }

    fn is_waited_for(&self) -> bool {
        self.done.is_none() && !self.overdue
    }
}

impl Station {
    /// Begins to open missing devices that are not being opened already.
    pub(crate) fn begin_opening(&mut self) {
        let missing =
            DeviceSet { camera: self.camera.is_none(), stage: self.stage.is_none(), laser: self.laser.is_none() };
        for group in self.devices.grouped_by_driver(missing) {
            let being_opened = |opening: &Opening| !opening.group.devices.and(group.devices).is_empty();
            if !self.openings.iter().any(being_opened) {
                self.openings.push(Opening::begin(group));
            }
        }
    }

    /// Whether devices are being waited for.
    pub(crate) fn is_opening(&self) -> bool {
        self.openings.iter().any(|opening| !opening.overdue)
    }

    /// Installs the opened devices once no driver is being waited for, and late ones afterwards.
    pub(crate) fn update_openings(&mut self) {
        self.openings.iter_mut().for_each(Opening::poll);
        let was_opening = self.is_opening();
        let mut late = Vec::new();
        for opening in self.openings.iter_mut().filter(|opening| opening.is_waited_for()) {
            if opening.since.elapsed() > OPENING_LIMIT {
                opening.overdue = true;
                late.extend(opening.group.devices.names().map(|device| (device, opening.group.driver.kind())));
            }
        }
        for (device, kind) in late {
            let waited_s = OPENING_LIMIT.as_secs();
            let detail = format!("the driver `{kind}` has been opening the {device} for more than {waited_s} s");
            self.note(fault(
                device,
                OPENING,
                detail,
                "check the device; it is used as soon as its driver has opened it",
            ));
        }
        if self.openings.iter().any(Opening::is_waited_for) {
            return;
        }
        let (done, hanging) = std::mem::take(&mut self.openings).into_iter().partition(|one| one.done.is_some());
        self.openings = hanging;
        let done: Vec<Opening> = done;
        if done.is_empty() && !was_opening {
            return;
        }
        for opening in done {
            let devices = opening.group.devices;
            let hung = |device| devices.names().any(|name| name == device);
            self.faults.retain(|fault| fault.kind != OPENING || !hung(fault.device));
            match opening.done {
                Some(Ok(opened)) => self.install(opened),
                Some(Err(error)) => opening.group.fault(error).into_iter().for_each(|fault| self.note(fault)),
                None => {}
            }
        }
        if self.resetting.is_none() {
            let all = self.camera.is_some() && self.stage.is_some() && self.laser.is_some();
            self.transition(if all { Event::DevicesConnected } else { Event::DeviceMissing });
        }
        // The caller waiting for the start reads the status next.
        self.publish();
        self.publisher.notify_opened();
    }

    fn install(&mut self, opened: Opened) {
        if let Some(camera) = opened.camera {
            self.publisher.publish_camera_details(camera.details());
            self.camera = Some(Acquisition::new(camera, self.drops.clone()));
        }
        if let Some(stage) = opened.stage {
            self.publisher.stop_latch.add(stage.stop_handle());
            self.stage = Some(Motion::new(stage));
        }
        if let Some(laser) = opened.laser {
            laser.stop_handle().into_iter().for_each(|handle| self.publisher.stop_latch.add(handle));
            let mut light = Light::new(laser);
            if let Err(error) = light.off() {
                self.fail(error.into());
            }
            self.laser = Some(light);
        }
    }
}
