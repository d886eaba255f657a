//! The contract of a laser.

use std::time::Duration;

use super::Cable;
use super::calls::{SCHEDULING_SLACK, short, wait_for};
use crate::{LASER_LEASE_LIMIT, Laser, LaserError};

/// Properties of a laser for the suite.
pub struct LaserProfile {
    /// Whether light is really on, from a source other than the driver.
    pub light: Option<Box<dyn Fn() -> bool>>,
    /// From the end of a lease, or from a command, to its effect on the light.
    pub reaction_limit: Duration,
    /// Its cable, if the test can unplug it.
    pub cable: Option<Cable>,
}

/// A lease for the rules in which one expires.
const SHORT_LEASE: Duration = Duration::from_millis(120);

/// A lease longer than every rule except the one on the longest lease.
const LONG_LEASE: Duration = LASER_LEASE_LIMIT;

/// The loss of a laser is detected within this time (`promises.md`: serial faults).
const GONE_LIMIT: Duration = Duration::from_secs(1);

/// Longest reconnection after the cable is plugged in again.
const RECONNECT_LIMIT: Duration = Duration::from_secs(5);

type Open<'a> = &'a mut dyn FnMut() -> Box<dyn Laser>;

/// Runs every rule of a laser, each on a newly opened device.
pub fn laser(open: Open, profile: &LaserProfile) {
    the_laser_is_off_when_opened(open(), profile);
    it_emits_as_accepted(open(), profile);
    impossible_powers_are_refused(open(), profile);
    the_laser_goes_off_when_the_lease_expires(open(), profile);
    renewing_keeps_it_on(open(), profile);
    renewing_does_not_switch_on(open(), profile);
    no_lease_is_longer_than_the_limit(open(), profile);
    switching_off_works_in_every_state(open(), profile);
    the_laser_goes_off_when_it_is_dropped(open(), profile);
    reconnecting_a_working_laser_turns_it_off(open(), profile);
    laser_faults(open, profile);
}

/// Runs the rules about an unplugged cable, if the profile has one.
pub fn laser_faults(open: Open, profile: &LaserProfile) {
    if let Some(cable) = &profile.cable {
        an_unplugged_laser_is_reported_and_reconnected_off(open(), profile, cable);
    }
}

fn the_laser_is_off_when_opened(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let state = short("poll", || laser.poll()).expect("a working laser");
    assert!(!state.emitting && state.power == 0.0, "it is on when opened: {state:?}");
    expect_light(profile, false, "it is on when opened");
}

fn it_emits_as_accepted(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let power = some_power(&*laser);
    let accepted = short("switch_on", || laser.switch_on(power, LONG_LEASE)).expect("off, working and in range");
    assert!(accepted.emitting, "switched on, but it reports off");
    assert!(accepted.power > 0.0 && accepted.power <= 1.0, "accepted a power of {}", accepted.power);
    let polled = laser.poll().expect("a working laser");
    assert_eq!((polled.emitting, polled.power), (true, accepted.power), "`poll` differs from what was accepted");
    expect_light(profile, true, "switched on, but there is no light");
    laser.switch_off().expect("switch off");
}

fn impossible_powers_are_refused(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    for power in [0.0, -0.5, 1.5, f64::NAN, f64::INFINITY] {
        let refusal = laser.switch_on(power, LONG_LEASE);
        assert!(matches!(refusal, Err(LaserError::BadPower { .. })), "a power of {power} gave {refusal:?}");
        assert!(!laser.poll().expect("a working laser").emitting, "it is on after a refused power of {power}");
    }
    expect_light(profile, false, "it is on after a refused power");
}

fn the_laser_goes_off_when_the_lease_expires(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let power = some_power(&*laser);
    laser.switch_on(power, SHORT_LEASE).expect("a working device");
    expect_light(profile, true, "switched on, but there is no light");
    // The caller hangs: the driver is not called until the light is off.
    crate::time::sleep(SHORT_LEASE);
    expect_light(profile, false, "the lease expired while its caller hung, and it is still on");
    wait_for(profile.reaction_limit + SCHEDULING_SLACK, "the lease's end shows in `poll`", || {
        (!laser.poll().expect("the end of a lease is not a fault").emitting).then_some(())
    });
}

fn renewing_keeps_it_on(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let power = some_power(&*laser);
    let lease = 4 * SHORT_LEASE;
    laser.switch_on(power, lease).expect("a working device");
    let begin = crate::time::now();
    while crate::time::since(begin) < 2 * lease {
        let state = short("renew", || laser.renew(lease)).expect("emitting");
        assert!(state.emitting, "it went off although its lease was renewed");
        crate::time::sleep(lease / 8);
    }
    expect_light(profile, true, "it went off although its lease was renewed");
    laser.switch_off().expect("switch off");
}

fn renewing_does_not_switch_on(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let state = laser.renew(LONG_LEASE).expect("renewing nothing is not a fault");
    assert!(!state.emitting, "renewing switched on a laser that was never on");
    let power = some_power(&*laser);
    laser.switch_on(power, SHORT_LEASE).expect("a working device");
    wait_for(SHORT_LEASE + profile.reaction_limit + SCHEDULING_SLACK, "the lease ends", || {
        (!laser.poll().expect("a working device").emitting).then_some(())
    });
    let state = laser.renew(LONG_LEASE).expect("renewing an ended lease is not a fault");
    assert!(!state.emitting, "renewing switched on a laser that had gone off");
    expect_light(profile, false, "renewing switched on a laser that had gone off");
}

fn no_lease_is_longer_than_the_limit(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let power = some_power(&*laser);
    laser.switch_on(power, 60 * LASER_LEASE_LIMIT).expect("a working device");
    crate::time::sleep(LASER_LEASE_LIMIT);
    expect_light(profile, false, "a lease of a minute was granted");
    wait_for(profile.reaction_limit + SCHEDULING_SLACK, "a lease of a minute ends after a second", || {
        (!laser.poll().expect("a working device").emitting).then_some(())
    });
}

fn switching_off_works_in_every_state(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    short("switch_off", || laser.switch_off()).expect("off while off");
    let power = some_power(&*laser);
    laser.switch_on(power, LONG_LEASE).expect("a working device");
    short("switch_off", || laser.switch_off()).expect("off while emitting");
    short("switch_off", || laser.switch_off()).expect("off twice");
    wait_for(profile.reaction_limit + SCHEDULING_SLACK, "switched off shows in `poll`", || {
        (!laser.poll().expect("a working device").emitting).then_some(())
    });
    expect_light(profile, false, "it is on after `switch_off`");
}

fn the_laser_goes_off_when_it_is_dropped(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let power = some_power(&*laser);
    laser.switch_on(power, LONG_LEASE).expect("a working device");
    expect_light(profile, true, "switched on, but there is no light");
    drop(laser);
    expect_light(profile, false, "it was dropped, and it is still on");
}

fn reconnecting_a_working_laser_turns_it_off(mut laser: Box<dyn Laser>, profile: &LaserProfile) {
    let power = some_power(&*laser);
    laser.switch_on(power, LONG_LEASE).expect("a working device");
    short("reconnect", || laser.reconnect()).expect("nothing prevents it");
    wait_for(RECONNECT_LIMIT, "the laser is reconnected and off", || {
        laser.poll().ok().filter(|state| !state.emitting)
    });
    expect_light(profile, false, "the laser is on after the reconnection");
}

fn an_unplugged_laser_is_reported_and_reconnected_off(
    mut laser: Box<dyn Laser>,
    profile: &LaserProfile,
    cable: &Cable,
) {
    let power = some_power(&*laser);
    laser.switch_on(power, LONG_LEASE).expect("a working device");
    (cable.unplug)();
    wait_for(GONE_LIMIT + SCHEDULING_SLACK, "the unplugged cable is detected", || {
        laser.poll().is_err().then_some(())
    });
    assert!(laser.poll().is_err(), "the loss is reported once only");
    assert!(laser.switch_on(power, LONG_LEASE).is_err(), "a disconnected laser was switched on");
    short("switch_off", || laser.switch_off()).ok();
    (cable.replug)();
    short("reconnect", || laser.reconnect()).ok();
    let state = wait_for(RECONNECT_LIMIT, "the laser is reconnected", || laser.poll().ok());
    assert!(!state.emitting, "the laser is on after the reconnection");
    expect_light(profile, false, "the laser is on after the reconnection");
}

/// A power that every laser of its kind accepts.
fn some_power(laser: &dyn Laser) -> f64 {
    laser.capabilities().power.map_or(1.0, |range| 0.5 * (range.min + range.max))
}

fn expect_light(profile: &LaserProfile, is_on: bool, otherwise: &str) {
    if let Some(light) = &profile.light {
        wait_for(profile.reaction_limit + SCHEDULING_SLACK, otherwise, || (light() == is_on).then_some(()));
    }
}
