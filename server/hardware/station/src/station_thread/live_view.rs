//! The live view: the camera runs freely for whoever watches, and ends when nobody does.

use std::time::Instant;

use devices::{CameraRequest, CameraSettings, Trigger};

use crate::parts::light::Light;
use crate::parts::machine::Event;
use crate::shared::refusal::StationRefusal;
use crate::station_thread::command::Reply;
use crate::station_thread::handle::LiveRequest;
use crate::station_thread::owner::Station;

/// A running live view.
pub struct LiveView {
    /// When it was begun, lit, or asked for a picture.
    used_at: Instant,
    camera_before: CameraSettings,
}

impl Station {
    /// Starts, changes or ends the live view.
    pub(crate) fn obey_live(&mut self, request: LiveRequest, reply: Reply<()>) {
        if !request.running {
            self.end_live();
            return self.answer(reply, Ok(()));
        }
        let begun = self.person_may_act().and_then(|()| self.begin_live());
        let lit = begun.and_then(|()| self.shine_in_live_view(request.laser_power));
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
            return Err(StationRefusal::Busy { activity: "taking a picture".to_owned() });
        }
        let camera = self.camera.as_mut().ok_or(StationRefusal::Absent { device: "camera" })?;
        let camera_before = camera.settings();
        camera.configure(&CameraRequest { trigger: Some(Trigger::Free), ..CameraRequest::default() })?;
        camera.start()?;
        self.live = Some(LiveView { used_at: Instant::now(), camera_before });
        self.transition(Event::LiveBegins);
        Ok(())
    }

    /// Light for the live view; 0 is dark.
    pub(crate) fn shine_in_live_view(&mut self, power: f64) -> Result<(), StationRefusal> {
        let Some(laser) = &mut self.laser else { return Err(StationRefusal::Absent { device: "laser" }) };
        if power == 0.0 {
            return Ok(laser.off()?);
        }
        let Some(live) = &mut self.live else { return Err(StationRefusal::NoLiveView) };
        live.used_at = Instant::now();
        Ok(laser.want(power, Instant::now())?)
    }

    /// A picture was requested: somebody is watching.
    pub(crate) fn watched(&mut self) {
        if let Some(live) = &mut self.live {
            live.used_at = Instant::now();
        }
    }

    /// Ends light, then the view, when nobody watches any more. A viewer who comes back finds it dark: only a person
    /// lights it again.
    pub(crate) fn tend_live(&mut self) {
        let Some(live) = &self.live else { return };
        let unwatched = live.used_at.max(self.publisher.viewers.last_at()).elapsed();
        if unwatched > self.publisher.live_unwatched {
            return self.end_live();
        }
        if unwatched > self.publisher.live_light_unwatched && self.laser.as_ref().is_some_and(Light::is_wanted) {
            self.go_dark();
        }
    }

    /// Ends the live view: dark, the camera at rest and triggered as before.
    pub(crate) fn end_live(&mut self) {
        let Some(live) = self.live.take() else { return };
        self.go_dark();
        if let Some(camera) = &mut self.camera {
            // Only the trigger goes back: exposure and gain are what the person has set meanwhile.
            let now = camera.settings();
            let before = CameraSettings { trigger: live.camera_before.trigger, ..now };
            self.restore_camera(Some(before));
        }
        self.transition(Event::LiveEnds);
    }
}
