//! The contract suite over grblHAL's simulator as its authors publish it, with other settings than ours.
//!
//! It has no limit switch: without homing (`$22=0`) the zero is where the stage is. Light and motion are those that the
//! firmware reports; the simulated firmware of this project checks them independently.

use std::time::Duration;

use super::controller::Controller;
use super::{GRBL_HAL_SETTINGS, MOTION_LIMIT, SETTINGS, home, wait_until};
use crate::contract::{self, LaserProfile, StageProfile};
use crate::drivers::grbl::{Axis, GrblConfig, open};
use crate::{Laser as _, Stage as _, StageError};

/// Longest delay of a dialogue: the simulator reads a byte per frame of 20 ms, on a computer that it shares. Times are
/// measured with a faster one, see `server/docs/devices/grbl.md`.
const REPLY_DELAY: Duration = Duration::from_secs(3);

/// Settings of a controller, and the configuration that belongs to them.
struct Case {
    name: &'static str,
    settings: &'static [&'static str],
    configure: fn(GrblConfig) -> GrblConfig,
}

const CASES: [Case; 7] = [
    Case { name: "without homing", settings: &[], configure: |config| config },
    Case { name: "work positions", settings: &["$10=510", "G10L2P1X12.5"], configure: |config| config },
    Case {
        name: "reports without being queried, G-code units inches, relative, another work offset",
        settings: &["$481=200", "G20G91G55", "G10L2P2X-1"],
        configure: |config| config,
    },
    Case { name: "every item in reports", settings: &["$10=8191"], configure: |config| config },
    Case {
        name: "axis Y, reversed, few steps, another laser scale",
        settings: &["$101=26.667", "$111=1500", "$121=200", "$30=255", "$31=1"],
        configure: |config| GrblConfig { axis: Axis::Y, reversed: true, steps_per_mm: 26.667, ..config },
    },
    Case { name: "a travel shorter than the stage's", settings: &["$130=10"], configure: |config| config },
    Case {
        name: "motors always on, long pulses, reversed motor, sleep",
        settings: &["$1=255", "$0=20", "$3=1", "$62=1"],
        configure: |config| config,
    },
];

fn start(case: &Case) -> Option<(Controller, GrblConfig)> {
    let controller = Controller::start("SHEAF_TEST_GRBLHAL")?;
    controller.set(&SETTINGS);
    controller.set(&GRBL_HAL_SETTINGS);
    controller.set(&["$22=0"]);
    controller.set(case.settings);
    let config = GrblConfig { travel_mm: (-8.0, 8.0), zero_at_machine_mm: 0.0, ..controller.config() };
    let config = (case.configure)(config);
    Some((controller, config))
}

#[test]
fn the_stage_of_real_grbl_hal_passes_the_suite_with_other_settings() {
    for case in &CASES {
        let Some((_controller, config)) = start(case) else { return };
        println!("{}", case.name);
        let profile = StageProfile {
            speed_mm_s: 10.0,
            tolerance_mm: 0.5 / config.steps_per_mm + 0.001,
            instant: false,
            motion_limit: Duration::from_secs(5),
            rest_limit: Duration::from_millis(300) + REPLY_DELAY,
            reset_button: None,
            cable: None,
        };
        contract::stage(&mut || Box::new(open(&config).unwrap().0), &profile);
    }
}

#[test]
fn the_laser_of_real_grbl_hal_passes_the_suite_with_other_settings() {
    for case in &CASES {
        let Some((_controller, config)) = start(case) else { return };
        println!("{}", case.name);
        let profile =
            LaserProfile { light: None, reaction_limit: Duration::from_millis(500) + REPLY_DELAY, cable: None };
        contract::laser(&mut || Box::new(open(&config).unwrap().1), &profile);
    }
}

#[test]
fn real_grbl_hal_with_unusable_settings_is_refused_with_the_line_to_send() {
    let cases = [
        ("$32=0", "send $32=1"),
        ("$32=2", "send $32=1"),
        ("$13=1", "send $13=0"),
        ("$10=0", "send $10=1"),
        ("$39=0", "send $39=1"),
        ("$100=80", "80"),
        ("$130=20", "$130"),
    ];
    for (setting, expected) in cases {
        let Some(controller) = Controller::start("SHEAF_TEST_GRBLHAL") else { return };
        controller.set(&SETTINGS);
        controller.set(&[setting]);
        let refusal = open(&controller.config()).map(drop).unwrap_err();
        assert!(matches!(refusal, StageError::WrongDevice { .. }), "{setting}: {refusal}");
        assert!(refusal.to_string().contains(expected), "{setting}: {refusal}");
    }
}

#[test]
fn homing_of_real_grbl_hal_without_a_switch_fails_by_name_and_is_cleared() {
    let Some(controller) = Controller::start("SHEAF_TEST_GRBLHAL") else { return };
    controller.set(&SETTINGS);
    controller.set(&GRBL_HAL_SETTINGS);
    controller.set(&["$130=20"]);
    let config = GrblConfig { travel_mm: (-8.0, 8.0), zero_at_machine_mm: -10.0, ..controller.config() };
    let (mut stage, mut laser) = open(&config).unwrap();
    assert!(!home(&mut stage), "homed without a switch");
    wait_until(MOTION_LIMIT, "it rests", || !stage.poll().unwrap().moving);
    // Moves are refused without a reference; the laser works.
    let refusal = stage.start_move(1.0, 1.0).unwrap_err();
    assert!(matches!(refusal, StageError::NotHomed), "{refusal}");
    assert!(laser.switch_on(0.5, Duration::from_secs(1)).unwrap().emitting);
}
