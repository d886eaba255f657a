//! `sheaf doctor`: checks a configuration, first without motion and laser, then with both.

mod camera_checks;
mod check;
mod examination;
mod figures;
mod light_checks;
mod limits;
mod stage_checks;

#[cfg(test)]
mod tests;

use std::io::{BufRead as _, Write as _};
use std::time::{Duration, Instant};

use pipeline::{Failure, FailureKind, Reporter};
use station::cancel::CancelFlag;
use station::{LaserLight, StationHandle};
use tokio::runtime::Handle;
use tokio::signal::unix::{SignalKind, signal};
use vision::LineDirection;

use crate::answer::exit::Exit;
use crate::arguments::DoctorArgs;
use crate::commands::Answer;
use crate::commands::service::config::effective_of;
use check::{Check, Outcome};
use examination::{Cancelled, Examination, ExaminationSettings, POLL_PERIOD};
use limits::{CANCELLED_WAIT, MOVE_MM, REST_WAIT};

/// Longest time for threads to end once laser and motion are off; one may be waiting at the prompt.
const END_LIMIT: Duration = Duration::from_millis(200);

/// Examines the configured station; the output is the table.
pub fn run(args: &DoctorArgs, reporter: &dyn Reporter) -> Result<Answer, Failure> {
    let config = effective_of(&args.settings)?.config.app;
    let settings = ExaminationSettings {
        exposure_us: args.exposure_us,
        gain_db: args.gain_db,
        frame_rate_hz: args.frame_rate_hz,
        power: args.power,
        lines_along_rows: config.projector.direction_of(0) == LineDirection::Rows,
        board: config.target,
    };
    let threads = |cause| Failure::new(FailureKind::Internal, "no threads can be started").because(&cause);
    let runtime =
        tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().map_err(threads)?;
    let (station, cancel) = (StationHandle::start(&config.station, false), CancelFlag::default());
    watch_signals(&runtime, station.clone(), cancel.clone())?;
    let examination = Examination {
        station: &station,
        settings: &settings,
        cancel: &cancel,
        reporter,
        runtime: runtime.handle().clone(),
    };
    let yes = args.yes;
    let checks = examine(&examination, || yes || has_consent(&settings));
    let ended = checks.map(|checks| answer(&checks)).map_err(|Cancelled| {
        Failure::cancelled().remedy(format!("{}; run the command again", reported_state(&station)))
    });
    station.shut_down();
    runtime.shutdown_timeout(END_LIMIT);
    ended
}

/// The whole examination; `may_use_laser_and_motion` is called between its two parts.
fn examine(
    examination: &Examination,
    may_use_laser_and_motion: impl FnOnce() -> bool,
) -> Result<Vec<Check>, Cancelled> {
    let mut checks = examination.at_rest()?;
    if checks
        .iter()
        .any(|check| check.outcome == Outcome::NotOk && ["camera", "stage", "laser"].contains(&check.name))
    {
        checks.push(not_run("a device does not respond", "fix this first"));
    } else if may_use_laser_and_motion() {
        checks.extend(examination.emitting_and_moving()?);
    } else {
        checks.push(not_run("no consent", "answer y, or give --yes"));
    }
    if examination.cancel.is_cancelled() { Err(Cancelled) } else { Ok(checks) }
}

fn not_run(why: &str, remedy: &str) -> Check {
    Check::stated("laser and motion", Outcome::NotRun, why).remedy(remedy)
}

fn answer(checks: &[Check]) -> Answer {
    let is_ok = checks.iter().all(|check| check.outcome != Outcome::NotOk);
    let exit = if is_ok { Exit::Done } else { Exit::VerdictFail };
    Answer { text: check::table(checks), json: check::to_json(checks), exit }
}

/// Asks for consent; anything but yes means no.
fn has_consent(settings: &ExaminationSettings) -> bool {
    eprint!(
        "\nThe laser will be turned on at {:.0} % power, and the stage will home and move by {MOVE_MM} mm.\n\
         Check that the area is clear and eyes are protected. Continue? [y/N] ",
        100.0 * settings.power
    );
    let _ = std::io::stderr().flush();
    let mut line = String::new();
    let is_read = std::io::stdin().lock().read_line(&mut line).is_ok();
    is_read && matches!(line.trim().to_ascii_lowercase().as_str(), "y" | "yes")
}

/// Stops the station immediately at the first signal. At the prompt, a signal also ends the process, since the thread that
/// reads the answer cannot be interrupted.
fn watch_signals(
    runtime: &tokio::runtime::Runtime,
    station: StationHandle,
    cancel: CancelFlag,
) -> Result<(), Failure> {
    let failed = |cause| Failure::new(FailureKind::Internal, "signals cannot be received").because(&cause);
    let _guard = runtime.enter();
    let mut interrupt = signal(SignalKind::interrupt()).map_err(failed)?;
    let mut terminate = signal(SignalKind::terminate()).map_err(failed)?;
    let handle: &Handle = runtime.handle();
    handle.spawn(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
        stop(&station, &cancel).await;
        // The examination ends within this time unless it waits at the prompt.
        tokio::time::sleep(CANCELLED_WAIT).await;
        let state = reported_state(&station);
        station.shut_down();
        eprintln!("\ncancelled: {state}");
        std::process::exit(Exit::Internal as i32);
    });
    Ok(())
}

/// What a stopped station reports of laser and stage; waits until both have confirmed the Stop.
fn reported_state(station: &StationHandle) -> String {
    let began = Instant::now();
    let (laser, stage) = loop {
        let status = station.status();
        let laser = match status.laser_light {
            LaserLight::Off | LaserLight::Armed => Some("the laser is off"),
            LaserLight::NotControlled => Some("the laser is not controlled by the station"),
            LaserLight::On | LaserLight::Unknown => None,
        };
        let is_known = !status.faults.iter().any(|fault| fault.device == "stage");
        let stage = (is_known && !status.moving).then_some("the stage is at rest");
        if (laser.is_some() && stage.is_some()) || began.elapsed() > REST_WAIT {
            break (laser, stage);
        }
        std::thread::sleep(POLL_PERIOD);
    };
    let laser = laser.unwrap_or("the laser is not reported off: treat it as on");
    format!("{laser}, {}", stage.unwrap_or("the stage is not reported at rest: check it"))
}

/// Turns the laser off, stops the stage and lets the examination end.
async fn stop(station: &StationHandle, cancel: &CancelFlag) {
    cancel.cancel();
    // Fails only if the station has ended, with laser and motion off.
    let _ = station.stop("Ctrl-C").await;
}
