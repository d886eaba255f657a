//! Status reports, build information and settings.

use std::time::Instant;

use super::{Firmware, Spindle, State};
use crate::simulators::grbl_simulator::Dialect;

impl Firmware {
    /// First field of a report.
    pub(in crate::simulators::grbl_simulator) fn state_text(&self) -> &'static str {
        let moving = self.motion.is_some();
        match self.state {
            State::Idle => "Idle",
            State::Run => "Run",
            State::Jog => "Jog",
            State::Hold if moving => "Hold:1",
            State::Hold => "Hold:0",
            State::Home => "Home",
            State::Alarm | State::Critical => "Alarm",
            State::Door if moving => "Door:2",
            State::Door if self.restored_at.is_some() => "Door:3",
            State::Door if self.door_open => "Door:1",
            State::Door => "Door:0",
            State::Check => "Check",
            State::Sleep => "Sleep",
        }
    }

    pub(super) fn report(&mut self, now: Instant) {
        let state = self.state_text();
        let mut axes_mm = [0.0; 3];
        axes_mm[self.config.axis_idx()] = self.snapped(self.at_mm);
        let [x, y, z] = axes_mm;
        let feed_mm_min = self.motion.map_or(0.0, |motion| motion.at(now).1 * 60.0);
        let speed = if self.modal.spindle == Spindle::Off { 0.0 } else { self.modal.speed };
        let hal = self.config.dialect == Dialect::GrblHal;
        let includes_offset = !hal || self.report_mask & (1 << 5) != 0;
        let offset = if includes_offset && self.reports % 30 == if hal { 9 } else { 0 } {
            "|WCO:0.000,0.000,0.000"
        } else {
            ""
        };
        let space = if self.report_mask & 1 != 0 { 'M' } else { 'W' };
        let buffers = if hal { "|Bf:100,1023" } else { "" };
        let [feed, rapid, spindle_share] = self.overrides;
        let overrides = if std::mem::take(&mut self.reports_overrides) || self.reports % 20 == 3 {
            format!("|Ov:{feed},{rapid},{spindle_share}")
        } else {
            String::new()
        };
        self.reports += 1;
        self.send_line(&format!(
            "<{state}|{space}Pos:{x:.3},{y:.3},{z:.3}{buffers}|FS:{feed_mm_min:.0},{speed:.0}{offset}{overrides}>"
        ));
    }

    pub(super) fn send_build(&mut self) {
        let name = self.config.name.clone();
        match self.config.dialect {
            Dialect::Grbl => {
                self.send_line(&format!("[VER:1.1h.20190825:{name}]"));
                self.send_line("[OPT:V,15,128]");
            }
            Dialect::GrblHal => {
                self.send_line(&format!("[VER:1.1f.20260817:{name}]"));
                self.send_line("[OPT:VNML+,100,1024,3,0]");
                self.send_line("[AXS:3:XYZ]");
                self.send_line("[FIRMWARE:grblHAL]");
                self.send_line("[BOARD:Simulated board 7]");
            }
            Dialect::FluidNc => {
                self.send_line(&format!("[VER:4.0 FluidNC v4.0.1 (esp32-wifi) :{name}]"));
                self.send_line("[OPT:PHS]");
                self.send_line("[MSG: Machine: Simulated board 7]");
            }
        }
        self.send_line("ok");
    }

    pub(super) fn send_settings(&mut self) {
        let config = &self.config;
        let flag = |on: bool| if on { 1.0 } else { 0.0 };
        let homing = flag(config.homing) + if config.homing_lock { 4.0 } else { 0.0 };
        let mut settings = vec![
            (10, f64::from(self.report_mask)),
            (13, flag(config.inches)),
            (20, flag(config.soft_limits)),
            (22, homing),
            (27, config.pull_off_mm),
            (30, config.max_spindle),
            (31, 0.0),
            (32, f64::from(config.laser_mode)),
        ];
        for axis in 0..3 {
            settings.push((100 + axis, config.steps_per_mm));
            settings.push((110 + axis, config.max_speed_mm_s * 60.0));
            settings.push((120 + axis, config.acceleration_mm_s2));
            settings.push((130 + axis, config.max_travel_mm));
        }
        match config.dialect {
            Dialect::Grbl => {}
            Dialect::GrblHal => {
                settings.extend([(39, flag(config.realtime_in_commands)), (62, flag(config.sleeps))])
            }
            Dialect::FluidNc => settings.retain(|(number, _)| ![13, 27, 31].contains(number)),
        }
        settings.sort_by_key(|(number, _)| *number);
        for (number, value) in settings {
            self.send_line(&format!("${number}={value:.3}"));
        }
        self.send_line("ok");
    }
}
