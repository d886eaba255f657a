//! The three controllers, each over its simulated firmware.

use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;

use super::line::{LineControl, NoisyLine};
use super::{Act, REPORT_LIMIT, Rig};
use crate::drivers::{grbl, marlin, zaber};
use crate::simulators::grbl_simulator::{self, GrblSimulator};
use crate::simulators::marlin_simulator::{self, MarlinSimulator};
use crate::simulators::zaber_simulator::{self, ZaberSimulator};

/// GRBL 1.1h; the stage's zero is 6 mm before the switch.
pub fn grbl() -> Rig {
    let folder = TempDir::new().unwrap();
    let port_name = folder.path().join("controller");
    let kind = grbl_simulator::SimulatorConfig { homing_mm_s: 60.0, ..Default::default() };
    let simulator = Arc::new(GrblSimulator::start(kind.clone(), &port_name, None).unwrap());
    let config = grbl::GrblConfig {
        zero_at_machine_mm: -6.0,
        expected_name: Some("simulated stage".to_owned()),
        ..grbl::GrblConfig::new(port_name.to_str().unwrap(), 400.0, (-4.0, 4.0))
    };
    let line = LineControl::new();
    let (stage, laser) = grbl::open_line(&config, Box::new(NoisyLine::new(&config.port, &line))).unwrap();
    let (event_log, acting) = (simulator.event_log().clone(), simulator);
    let is_away = std::cell::Cell::new(false);
    Rig {
        stage: Box::new(stage),
        laser: Some(Box::new(laser)),
        event_log,
        line,
        act: Box::new(move |act| match act {
            Act::Restart => acting.restart(),
            Act::Alarm => acting.trigger_event(grbl_simulator::Event::Alarm(1)),
            Act::OtherDevice => {
                is_away.set(true);
                acting.replug_as(grbl_simulator::SimulatorConfig { name: "another".to_owned(), ..kind.clone() });
            }
            Act::Unplug => {
                is_away.set(true);
                acting.unplug();
            }
            Act::ResetButton => {}
            Act::Repair => {
                acting.repair();
                if is_away.replace(false) {
                    acting.replug_as(kind.clone());
                }
            }
        }),
        stage_from_machine: |machine_mm| machine_mm + 6.0,
        tolerance_mm: 0.01,
        reading_slack: Duration::from_millis(10),
        homing_report_limit: REPORT_LIMIT,
        unchecked: Vec::new(),
        _folder: folder,
    }
}

/// A Zaber device; the stage's zero is 6 mm from its home.
pub fn zaber() -> Rig {
    let folder = TempDir::new().unwrap();
    let port_name = folder.path().join("device");
    let kind = zaber_simulator::SimulatorConfig { homing_mm_s: 60.0, ..Default::default() };
    let simulator = Arc::new(ZaberSimulator::start(kind.clone(), &port_name, None).unwrap());
    let config = zaber::ZaberConfig {
        zero_at_device_mm: 6.0,
        expected_serial: Some(kind.serial),
        ..zaber::ZaberConfig::new(port_name.to_str().unwrap(), kind.travel_per_turn_mm, (-4.0, 4.0))
    };
    let line = LineControl::new();
    let stage = zaber::open_line(&config, Box::new(NoisyLine::new(&config.port, &line))).unwrap();
    let (event_log, acting) = (simulator.event_log().clone(), simulator);
    let is_away = std::cell::Cell::new(false);
    Rig {
        stage: Box::new(stage),
        laser: None,
        event_log,
        line,
        act: Box::new(move |act| match act {
            Act::Restart => acting.restart(),
            Act::Alarm => acting.trigger_event(zaber_simulator::Event::EmergencyStop),
            Act::OtherDevice => {
                is_away.set(true);
                acting.replug_as(zaber_simulator::SimulatorConfig { serial: 666, ..kind.clone() });
            }
            Act::Unplug => {
                is_away.set(true);
                acting.unplug();
            }
            Act::ResetButton => {}
            Act::Repair => {
                acting.trigger_event(zaber_simulator::Event::Repair);
                if is_away.replace(false) {
                    acting.replug_as(kind.clone());
                }
            }
        }),
        stage_from_machine: |machine_mm| machine_mm - 6.0,
        tolerance_mm: 0.002,
        reading_slack: Duration::from_millis(40),
        homing_report_limit: REPORT_LIMIT,
        unchecked: Vec::new(),
        _folder: folder,
    }
}

/// A Marlin controller built without the laser's safety timeout; the stage's zero is 6 mm from its switch.
pub fn marlin() -> Rig {
    let folder = TempDir::new().unwrap();
    let port_name = folder.path().join("controller");
    let kind = marlin_simulator::SimulatorConfig { homing_mm_s: 60.0, laser_timeout_ms: 0, ..Default::default() };
    let simulator = Arc::new(MarlinSimulator::start(kind.clone(), &port_name, None).unwrap());
    let config = marlin::MarlinConfig {
        zero_at_machine_mm: 6.0,
        expected_name: Some("Simulated stage".to_owned()),
        ..marlin::MarlinConfig::new(port_name.to_str().unwrap(), kind.steps_per_mm, (-4.0, 4.0))
    };
    let line = LineControl::new();
    let (stage, laser) = marlin::open_line(&config, Box::new(NoisyLine::new(&config.port, &line))).unwrap();
    let (event_log, acting) = (simulator.event_log().clone(), simulator);
    let is_away = std::cell::Cell::new(false);
    Rig {
        stage: Box::new(stage),
        laser: Some(Box::new(laser)),
        event_log,
        line,
        act: Box::new(move |act| match act {
            Act::Restart => acting.trigger_event(marlin_simulator::Event::ResetButton),
            Act::Alarm => acting.trigger_event(marlin_simulator::Event::Kill),
            Act::OtherDevice => {
                is_away.set(true);
                let name = "another".to_owned();
                acting.replug_as(marlin_simulator::SimulatorConfig { name, ..kind.clone() });
            }
            Act::Unplug => {
                is_away.set(true);
                acting.unplug();
            }
            Act::ResetButton => acting.trigger_event(marlin_simulator::Event::ResetButton),
            Act::Repair => {
                if is_away.replace(false) {
                    acting.replug_as(kind.clone());
                }
            }
        }),
        stage_from_machine: |machine_mm| machine_mm - 6.0,
        tolerance_mm: 0.03,
        // It reports the last commanded position, which is ahead of the motor.
        reading_slack: Duration::from_millis(500),
        // The firmware sends a message once per second while homing (`M113 S1`).
        homing_report_limit: Duration::from_millis(1700),
        unchecked: Vec::new(),
        _folder: folder,
    }
}
