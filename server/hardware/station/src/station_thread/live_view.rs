//! The live view: the camera runs freely while it is watched.

use std::time::Instant;

use devices::{CameraRequest, CameraSettings, Trigger};

use crate::parts::light::Light;
use crate::parts::machine::Event;
use crate::shared::refusal::StationRefusal;
use crate::station_thread::command::Reply;
use crate::station_thread::handle::LiveRequest;
use crate::station_thread::station::Station;

/// A running live view.
pub struct LiveView {
    /// When it was started, lit, or last watched.
    used_at: Instant,
    camera_before: CameraSettings,
}

impl Station {
    /// Starts, changes or ends the live view.
    pub(crate) fn execute_live(&mut self, request: LiveRequest, reply: Reply<()>) {
        if !request.running {
            self.end_live();
            return self.answer(reply, Ok(()));
        }
        let begun = self.check_manual_allowed().and_then(|()| self.begin_live());
        let lit = begun.and_then(|()| self.light_live_view(request.laser_power));
        match lit {
            Ok(()) => self.answer(reply, Ok(())),
            Err(refusal) => self.refuse(reply, refusal),
        }
    }

    fn begin_live(&mut self) -> Result<(), StationRefusal> {
        if self.live.is_some() {
            return Ok(());
        }
        if self.task.is_some() {
            return Err(StationRefusal::Busy { activity: "taking a snapshot".to_owned() });
        }
        let camera = self.camera.as_mut().ok_or(StationRefusal::Absent { device: "camera" })?;
        let camera_before = camera.settings();
        camera.configure(&CameraRequest { trigger: Some(Trigger::Free), ..CameraRequest::default() })?;
        camera.start()?;
        self.live = Some(LiveView { used_at: Instant::now(), camera_before });
        self.transition(Event::LiveBegins);
        Ok(())
    }

    /// Sets the laser power of the live view; 0 is off.
    pub(crate) fn light_live_view(&mut self, power: f64) -> Result<(), StationRefusal> {
        let Some(laser) = &mut self.laser else { return Err(StationRefusal::Absent { device: "laser" }) };
        if power == 0.0 {
            return Ok(laser.off()?);
        }
        let Some(live) = &mut self.live else { return Err(StationRefusal::NoLiveView) };
        live.used_at = Instant::now();
        Ok(laser.request(power, Instant::now())?)
    }

    /// An image was requested: the view is watched.
    pub(crate) fn watched(&mut self) {
        if let Some(live) = &mut self.live {
            live.used_at = Instant::now();
        }
    }

    /// Turns off the light, then ends the view, when there is no viewer. The light stays off for a returning viewer until a
    /// person turns it on.
    pub(crate) fn update_live_view(&mut self) {
        let Some(live) = &self.live else { return };
        let unwatched = live.used_at.max(self.publisher.viewers.last_at()).elapsed();
        if unwatched > self.publisher.live_unwatched {
            return self.end_live();
        }
        if unwatched > self.publisher.live_light_unwatched && self.laser.as_ref().is_some_and(Light::is_requested)
        {
            self.turn_laser_off();
        }
    }

    /// Ends the live view: laser off, camera stopped, trigger mode restored.
    pub(crate) fn end_live(&mut self) {
        let Some(live) = self.live.take() else { return };
        self.turn_laser_off();
        if let Some(camera) = &mut self.camera {
            // Only the trigger mode is restored: the person may have changed exposure and gain.
            let now = camera.settings();
            let before = CameraSettings { trigger: live.camera_before.trigger, ..now };
            self.restore_camera(Some(before));
        }
        self.transition(Event::LiveEnds);
    }
}
