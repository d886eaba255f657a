//! The contract of a stage.

use std::time::Duration;

use super::Cable;
use super::calls::{SCHEDULING_SLACK, short, wait_for};
use crate::{Homing, Stage, StageError, StageState};

/// Properties of a stage for the suite.
pub struct StageProfile {
    /// Speed of the test's moves. For a stage with real durations, so low that a move over half its travel is observed
    /// in motion.
    pub speed_mm_s: f64,
    /// Largest distance from its target at which a move ends.
    pub tolerance_mm: f64,
    /// Whether moves are instantaneous, so that none is observed in motion.
    pub instant: bool,
    /// Longest homing or move of the tests.
    pub motion_limit: Duration,
    /// From a stop or hold to rest: braking, and its report.
    pub rest_limit: Duration,
    /// For a controller that is halted permanently by a stop during homing: presses its reset button.
    pub reset_button: Option<Box<dyn Fn()>>,
    /// Its cable, if the test can unplug it.
    pub cable: Option<Cable>,
}

/// The loss of a stage is detected within this time (`promises.md`: serial faults).
const GONE_LIMIT: Duration = Duration::from_secs(1);

/// Longest reconnection after the cable is plugged in again.
const RECONNECT_LIMIT: Duration = Duration::from_secs(5);

/// Number of polls that verify that a stage is at rest.
const N_POLLS: usize = 10;

type Open<'a> = &'a mut dyn FnMut() -> Box<dyn Stage>;

/// Runs every rule of a stage, each on a newly opened device.
pub fn stage(open: Open, profile: &StageProfile) {
    it_is_at_rest_when_opened(open());
    nothing_moves_before_homing(open(), profile);
    homing_gives_a_position(open(), profile);
    a_move_ends_at_the_accepted_target(open(), profile);
    a_speed_above_the_maximum_is_limited_to_it(open(), profile);
    targets_outside_the_travel_are_refused(open(), profile);
    invalid_numbers_are_refused(open(), profile);
    a_jog_covers_its_distance(open(), profile);
    a_jog_is_limited_to_the_travel(open(), profile);
    stop_works_at_rest(open(), profile);
    clearing_without_a_fault_changes_nothing(open(), profile);
    reconnecting_a_working_stage_leaves_it_at_rest(open(), profile);
    if !profile.instant {
        a_move_is_reported_in_motion(open(), profile);
        a_second_move_is_refused(open(), profile);
        stop_ends_a_move_for_good(open(), profile);
        stop_ends_a_jog_for_good(open(), profile);
        stop_ends_homing(open(), profile);
        a_held_move_continues_when_resumed(open(), profile);
        stop_ends_a_held_move(open(), profile);
    }
    stage_faults(open, profile);
}

/// Runs the rules of a stage that cannot be commanded: it refuses every motion by name, its position is that of the
/// exposures, and a stop succeeds.
pub fn uncommanded_stage(open: Open) {
    it_is_at_rest_when_opened(open());
    every_motion_is_refused_by_name(open());
    its_position_is_that_of_the_exposures(open());
    let mut stage = open();
    short("stop", || stage.stop()).expect("stop");
    stage.stop_handle().stop_now();
    short("clear_fault", || stage.clear_fault()).expect("no fault");
    short("reconnect", || stage.reconnect()).expect("nothing to reconnect");
}

fn every_motion_is_refused_by_name(mut stage: Box<dyn Stage>) {
    let refusals = [
        ("start_home", short("start_home", || stage.start_home())),
        ("start_move", short("start_move", || stage.start_move(1.0, 1.0)).map(drop)),
        ("start_jog", short("start_jog", || stage.start_jog(1.0, 1.0)).map(drop)),
        ("hold", short("hold", || stage.hold())),
        ("resume", short("resume", || stage.resume())),
    ];
    for (name, refusal) in refusals {
        assert!(matches!(refusal, Err(StageError::NotCommanded { .. })), "{name}: {refusal:?}");
    }
}

fn its_position_is_that_of_the_exposures(mut stage: Box<dyn Stage>) {
    let pitch_mm = stage.capabilities().frame_pitch_mm.expect("a stage that cannot be commanded has a pitch");
    stage.begin_count();
    assert_eq!(stage.count_exposures(1), Some(0.0), "the first exposure is at 0");
    assert_eq!(stage.count_exposures(4), Some(4.0 * pitch_mm), "lost exposures count");
    assert_eq!(poll_stage(&mut *stage).position_mm, Some(4.0 * pitch_mm));
}

/// Runs the rules about an unplugged cable, if the profile has one.
pub fn stage_faults(open: Open, profile: &StageProfile) {
    if let Some(cable) = &profile.cable {
        an_unplugged_stage_reports_the_loss_until_it_is_reconnected(open(), profile, cable, false);
        if !profile.instant {
            an_unplugged_stage_reports_the_loss_until_it_is_reconnected(open(), profile, cable, true);
        }
    }
}

fn it_is_at_rest_when_opened(mut stage: Box<dyn Stage>) {
    let state = poll_stage(&mut *stage);
    assert!(!state.moving && !state.held, "it moves when opened: {state:?}");
    if stage.capabilities().homing == Homing::Required {
        assert!(!state.homed && state.position_mm.is_none(), "it reports a position before homing: {state:?}");
    }
}

fn nothing_moves_before_homing(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    if stage.capabilities().homing != Homing::Required {
        return;
    }
    let refusal = short("start_move", || stage.start_move(middle(&*stage), profile.speed_mm_s));
    assert!(matches!(refusal, Err(StageError::NotHomed)), "moved without homing: {refusal:?}");
    let refusal = short("start_jog", || stage.start_jog(1.0, profile.speed_mm_s));
    assert!(matches!(refusal, Err(StageError::NotHomed)), "jogged without homing: {refusal:?}");
    short("stop", || stage.stop()).expect("stop before homing");
    at_rest(&mut *stage, profile.rest_limit);
}

fn homing_gives_a_position(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let state = poll_stage(&mut *stage);
    assert!(state.homed && state.position_mm.is_some(), "homed, and its position is unknown: {state:?}");
}

fn a_move_ends_at_the_accepted_target(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = targets(&*stage);
    for target_mm in [near_mm, far_mm, near_mm] {
        let accepted = short("start_move", || stage.start_move(target_mm, profile.speed_mm_s)).expect("in travel");
        let off_mm = (accepted.target_mm - target_mm).abs();
        assert!(off_mm <= profile.tolerance_mm, "requested {target_mm} mm, accepted {} mm", accepted.target_mm);
        assert!(accepted.speed_mm_s > 0.0, "accepted a speed of {} mm/s", accepted.speed_mm_s);
        arrives(&mut *stage, accepted.target_mm, profile);
    }
}

fn a_speed_above_the_maximum_is_limited_to_it(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let fastest_mm_s = stage.capabilities().max_speed_mm_s;
    if !fastest_mm_s.is_finite() {
        return;
    }
    let accepted = stage.start_move(targets(&*stage).0, 10.0 * fastest_mm_s).expect("too fast is accepted slower");
    assert_eq!(accepted.speed_mm_s, fastest_mm_s, "a speed beyond the fastest is not accepted as the fastest");
    at_rest(&mut *stage, profile.motion_limit);
}

fn targets_outside_the_travel_are_refused(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let before = poll_stage(&mut *stage).position_mm;
    let (low_mm, high_mm) = stage.capabilities().travel_mm;
    for target_mm in [low_mm - 1.0, high_mm + 1.0] {
        let refusal = short("start_move", || stage.start_move(target_mm, profile.speed_mm_s));
        assert!(
            matches!(refusal, Err(StageError::OutOfTravel { .. })),
            "a move to {target_mm} mm gave {refusal:?}"
        );
    }
    expect_at_rest(&mut *stage, before, profile, "it moved though the move was refused");
}

fn invalid_numbers_are_refused(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let before = poll_stage(&mut *stage).position_mm;
    for (target_mm, speed_mm_s, wrong) in [
        (f64::NAN, profile.speed_mm_s, "target_mm"),
        (f64::INFINITY, profile.speed_mm_s, "target_mm"),
        (middle(&*stage), f64::NAN, "speed_mm_s"),
        (middle(&*stage), 0.0, "speed_mm_s"),
        (middle(&*stage), -1.0, "speed_mm_s"),
    ] {
        let refusal = stage.start_move(target_mm, speed_mm_s);
        assert!(
            matches!(refusal, Err(StageError::BadNumber { name, .. }) if name == wrong),
            "a move to {target_mm} mm at {speed_mm_s} mm/s gave {refusal:?}, not a refusal of {wrong}"
        );
    }
    let refusal = stage.start_jog(f64::NAN, profile.speed_mm_s);
    assert!(matches!(refusal, Err(StageError::BadNumber { .. })), "a jog over NaN gave {refusal:?}");
    expect_at_rest(&mut *stage, before, profile, "it moved though the move was refused");
}

fn a_jog_covers_its_distance(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = targets(&*stage);
    let distance_mm = 0.5 * (far_mm - near_mm);
    stage.start_move(near_mm, profile.speed_mm_s).expect("in travel");
    arrives(&mut *stage, near_mm, profile);
    let accepted = short("start_jog", || stage.start_jog(distance_mm, profile.speed_mm_s)).expect("in travel");
    let off_mm = (accepted.target_mm - near_mm - distance_mm).abs();
    assert!(off_mm <= 2.0 * profile.tolerance_mm, "jogs {off_mm} mm off the requested distance");
    arrives(&mut *stage, accepted.target_mm, profile);
}

fn a_jog_is_limited_to_the_travel(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (low_mm, high_mm) = stage.capabilities().travel_mm;
    let accepted = stage.start_jog(10.0 * (high_mm - low_mm), profile.speed_mm_s).expect("limited, not refused");
    assert!(accepted.target_mm <= high_mm, "a jog to {} mm leaves the travel", accepted.target_mm);
    short("stop", || stage.stop()).expect("stop");
    at_rest(&mut *stage, profile.rest_limit);
}

fn stop_works_at_rest(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    for _ in 0..2 {
        short("stop", || stage.stop()).expect("stop before homing");
        at_rest(&mut *stage, profile.rest_limit);
    }
    home(&mut *stage, profile);
    let before = poll_stage(&mut *stage).position_mm;
    for _ in 0..2 {
        short("stop", || stage.stop()).expect("stop at rest");
        at_rest(&mut *stage, profile.rest_limit);
    }
    expect_at_rest(&mut *stage, before, profile, "a stop at rest moved it or lost its position");
    let target_mm = targets(&*stage).1;
    stage.start_move(target_mm, profile.speed_mm_s).expect("a stop at rest leaves it ready");
    arrives(&mut *stage, target_mm, profile);
}

fn clearing_without_a_fault_changes_nothing(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let before = poll_stage(&mut *stage).position_mm;
    short("clear_fault", || stage.clear_fault()).expect("there is none");
    expect_at_rest(&mut *stage, before, profile, "clearing without a fault lost the position");
}

fn reconnecting_a_working_stage_leaves_it_at_rest(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    short("reconnect", || stage.reconnect()).expect("nothing prevents it");
    let state = wait_for(RECONNECT_LIMIT, "the stage is reconnected", || stage.poll().ok());
    assert!(!state.moving, "the stage moves after the reconnection");
}

fn a_move_is_reported_in_motion(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = far_move(&mut *stage, profile);
    assert!(poll_stage(&mut *stage).moving, "a move was started, but it reports rest");
    under_way(&mut *stage, near_mm, far_mm, profile);
    arrives(&mut *stage, far_mm, profile);
}

fn a_second_move_is_refused(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = far_move(&mut *stage, profile);
    let refusal = short("start_move", || stage.start_move(near_mm, profile.speed_mm_s));
    assert!(matches!(refusal, Err(StageError::Moving)), "a second move gave {refusal:?}");
    arrives(&mut *stage, far_mm, profile);
}

fn stop_ends_a_move_for_good(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = far_move(&mut *stage, profile);
    under_way(&mut *stage, near_mm, far_mm, profile);
    short("stop", || stage.stop()).expect("stop while moving");
    at_rest(&mut *stage, profile.rest_limit);
    stays_short_of(&mut *stage, far_mm, profile);
    short("resume", || stage.resume()).ok();
    stays_short_of(&mut *stage, far_mm, profile);
}

fn stop_ends_a_jog_for_good(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = targets(&*stage);
    stage.start_move(near_mm, profile.speed_mm_s).expect("in travel");
    arrives(&mut *stage, near_mm, profile);
    stage.start_jog(far_mm - near_mm, profile.speed_mm_s).expect("in travel");
    under_way(&mut *stage, near_mm, far_mm, profile);
    short("stop", || stage.stop()).expect("stop while jogging");
    at_rest(&mut *stage, profile.rest_limit);
    stays_short_of(&mut *stage, far_mm, profile);
}

fn stop_ends_homing(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    if stage.capabilities().homing != Homing::Required {
        return;
    }
    short("start_home", || stage.start_home()).expect("a working device");
    assert!(poll_stage(&mut *stage).moving, "homing was started, but it reports rest");
    short("stop", || stage.stop()).expect("stop while homing");
    let mut button = profile.reset_button.as_ref();
    let limit = if button.is_some() { RECONNECT_LIMIT } else { profile.rest_limit + SCHEDULING_SLACK };
    let state = wait_for(limit, "homing ends after a stop", || {
        match stage.poll() {
            Ok(state) => (!state.moving).then_some(state),
            // A controller for which a stopped homing is an alarm reports it until it is cleared.
            Err(_) => {
                if stage.clear_fault().is_err()
                    && let Some(press) = &mut button
                {
                    press();
                    stage.reconnect().ok();
                    button = None;
                }
                None
            }
        }
    });
    assert!(
        !state.homed && state.position_mm.is_none(),
        "homing was stopped, and it reports a position: {state:?}"
    );
    home(&mut *stage, profile);
}

fn a_held_move_continues_when_resumed(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = far_move(&mut *stage, profile);
    under_way(&mut *stage, near_mm, far_mm, profile);
    short("hold", || stage.hold()).expect("hold while moving");
    let held = wait_for(profile.rest_limit + SCHEDULING_SLACK, "a held move rests", || {
        let state = poll_stage(&mut *stage);
        (state.held && !state.moving).then_some(state)
    });
    expect_at_rest(&mut *stage, held.position_mm, profile, "a held stage moved");
    short("resume", || stage.resume()).expect("resume");
    arrives(&mut *stage, far_mm, profile);
}

fn stop_ends_a_held_move(mut stage: Box<dyn Stage>, profile: &StageProfile) {
    home(&mut *stage, profile);
    let (near_mm, far_mm) = far_move(&mut *stage, profile);
    under_way(&mut *stage, near_mm, far_mm, profile);
    stage.hold().expect("hold while moving");
    wait_for(profile.rest_limit + SCHEDULING_SLACK, "a held move rests", || {
        poll_stage(&mut *stage).held.then_some(())
    });
    short("stop", || stage.stop()).expect("stop while held");
    at_rest(&mut *stage, profile.rest_limit);
    short("resume", || stage.resume()).ok();
    stays_short_of(&mut *stage, far_mm, profile);
}

fn an_unplugged_stage_reports_the_loss_until_it_is_reconnected(
    mut stage: Box<dyn Stage>,
    profile: &StageProfile,
    cable: &Cable,
    while_moving: bool,
) {
    home(&mut *stage, profile);
    if while_moving {
        far_move(&mut *stage, profile);
    }
    (cable.unplug)();
    let gone =
        |fault: &StageError| matches!(fault, StageError::Disconnected { .. } | StageError::NoResponse { .. });
    wait_for(GONE_LIMIT + SCHEDULING_SLACK, "the unplugged cable is detected", || stage.poll().err().filter(gone));
    let again = stage.poll();
    assert!(again.is_err(), "the loss is reported once, then {again:?}");
    let refusal = short("start_move", || stage.start_move(middle(&*stage), profile.speed_mm_s));
    assert!(refusal.is_err(), "a disconnected stage accepted {refusal:?}");
    short("stop", || stage.stop()).ok();
    (cable.replug)();
    short("reconnect", || stage.reconnect()).ok();
    let state = wait_for(RECONNECT_LIMIT, "the stage is reconnected", || stage.poll().ok());
    // It may still brake from the interrupted move; a repeated move would take longer.
    at_rest(&mut *stage, profile.rest_limit);
    if stage.capabilities().homing == Homing::Required {
        assert!(
            !state.homed && state.position_mm.is_none(),
            "a position is reported after the reconnection: {state:?}"
        );
    }
    home(&mut *stage, profile);
}

/// Homes and waits for the end.
fn home(stage: &mut dyn Stage, profile: &StageProfile) {
    short("start_home", || stage.start_home()).expect("at rest and working");
    wait_for(profile.motion_limit + SCHEDULING_SLACK, "homing ends", || {
        let state = poll_stage(stage);
        (!state.moving && state.homed).then_some(())
    });
}

/// Starts a move from the near target to the far one; returns both.
fn far_move(stage: &mut dyn Stage, profile: &StageProfile) -> (f64, f64) {
    let (near_mm, far_mm) = targets(stage);
    stage.start_move(near_mm, profile.speed_mm_s).expect("in travel");
    arrives(stage, near_mm, profile);
    let accepted = stage.start_move(far_mm, profile.speed_mm_s).expect("in travel");
    (near_mm, accepted.target_mm)
}

/// Waits until a position strictly between the ends is reported.
fn under_way(stage: &mut dyn Stage, near_mm: f64, far_mm: f64, profile: &StageProfile) {
    wait_for(profile.motion_limit + SCHEDULING_SLACK, "positions during the move are reported", || {
        let at_mm = poll_stage(stage).position_mm?;
        (at_mm > near_mm + profile.tolerance_mm && at_mm < far_mm - profile.tolerance_mm).then_some(())
    });
}

fn arrives(stage: &mut dyn Stage, target_mm: f64, profile: &StageProfile) {
    at_rest(stage, profile.motion_limit);
    let at_mm = poll_stage(stage).position_mm.expect("a homed stage reports its position");
    assert!(
        (at_mm - target_mm).abs() <= profile.tolerance_mm,
        "rests at {at_mm} mm, not at its target {target_mm} mm"
    );
}

fn at_rest(stage: &mut dyn Stage, limit: Duration) {
    wait_for(limit + SCHEDULING_SLACK, "it comes to rest", || {
        let state = poll_stage(stage);
        (!state.moving && !state.held).then_some(())
    });
}

/// Asserts that it is at rest and short of `far_mm`: a stopped move is not continued.
fn stays_short_of(stage: &mut dyn Stage, far_mm: f64, profile: &StageProfile) {
    let stopped_at = poll_stage(stage).position_mm;
    if let Some(at_mm) = stopped_at {
        assert!(at_mm < far_mm - profile.tolerance_mm, "stopped, and it is at its target of {far_mm} mm");
    }
    expect_at_rest(stage, stopped_at, profile, "a stopped move continued");
}

fn expect_at_rest(stage: &mut dyn Stage, at_mm: Option<f64>, profile: &StageProfile, otherwise: &str) {
    for _ in 0..N_POLLS {
        crate::time::sleep(Duration::from_millis(5));
        let now = poll_stage(stage);
        let same = match (now.position_mm, at_mm) {
            (Some(now_mm), Some(at_mm)) => (now_mm - at_mm).abs() <= profile.tolerance_mm,
            (now, before) => now == before,
        };
        assert!(same && !now.moving, "{otherwise}: was at {at_mm:?} mm, now {now:?}");
    }
}

fn poll_stage(stage: &mut dyn Stage) -> StageState {
    short("poll", || stage.poll()).unwrap_or_else(|fault| panic!("a working stage reports a fault: {fault}"))
}

/// Two targets far apart within the travel.
fn targets(stage: &dyn Stage) -> (f64, f64) {
    let (low_mm, high_mm) = stage.capabilities().travel_mm;
    (low_mm + 0.25 * (high_mm - low_mm), low_mm + 0.75 * (high_mm - low_mm))
}

fn middle(stage: &dyn Stage) -> f64 {
    let (low_mm, high_mm) = stage.capabilities().travel_mm;
    0.5 * (low_mm + high_mm)
}
