//! A scan measured in its own job: the verdict needs no browser, and no interruption loses the scan.

use metrology::PartVerdict;
use store::ScanState;

use super::bench::{Bench, from_station, resumed, run};
use crate::jobs::plan::{Pace, TIMING};
use crate::jobs::scan::recover;
use crate::jobs::{JobEnd, ScanInput, ScanMode};
use crate::resources::measurements::MeasureInput;
use crate::resources::measurements::parts::{Part, part};

pub fn sphere(nominal_mm: f64) -> MeasureInput {
    MeasureInput {
        tool: "sphere".into(),
        name: None,
        nominal_mm: Some(nominal_mm),
        tolerance_mm: Some(0.5),
        region_mm: None,
        seed: None,
    }
}

/// Rows that show enough of the sphere.
fn ball(measure: Vec<MeasureInput>) -> ScanInput {
    ScanInput { measure, ..from_station(-8.0, 8.0, 0.5) }
}

impl Bench {
    pub fn part(&self, id: &str) -> Part {
        self.runtime.block_on(part(&self.catalogue, self.record(id))).unwrap().0
    }
}

#[test]
fn the_verdict_is_made_in_the_job_and_the_next_plan_uses_its_durations() {
    let bench = Bench::new();
    let mut job = bench.job();
    let (reports, fractions) = bench.following(&mut job);
    let done = run(ball(vec![sphere(18.9)]), &job.ctx).unwrap_or_else(|end| panic!("{end:?}"));
    assert!(done.message.ends_with("; OK"), "{}", done.message);
    let id = bench.finish(Ok(done));
    let part = bench.part(&id);
    assert_eq!((part.verdict, part.measured.len()), (Some(PartVerdict::Ok), 1));
    // Every phase reported.
    let reports = reports.lock();
    for words in ["row 33 of 33", "computing the cloud", "storing the cloud", "measuring: 1 of 1"] {
        assert!(reports.iter().any(|said| said == words), "{words}: {reports:?}");
    }
    let fractions = fractions.lock();
    assert!(fractions.iter().filter(|at| **at > 0.0 && **at < 1.0).count() > 66, "{}", fractions.len());
    let timing = &part.scan.report[TIMING];
    assert!(timing["evaluation_s"].as_f64().unwrap() > 0.0 && timing["n_measured"] == 1, "{timing}");
    let pace = bench.runtime.block_on(Pace::learned(&bench.catalogue, ScanMode::StopAndGo));
    let evaluation_s = timing["evaluation_s"].as_f64().unwrap() / timing["n_frames"].as_f64().unwrap();
    assert_eq!(pace.evaluation_s_per_frame, evaluation_s);
    assert_ne!(pace.row_overhead_s, Pace::unknown(ScanMode::StopAndGo).row_overhead_s);
}

#[test]
fn a_stopped_part_is_invalid_until_it_is_resumed_and_measured() {
    let bench = Bench::new();
    let job = bench.job_cancelled_at(|words| words.starts_with("row 20 of"));
    assert!(matches!(run(ball(vec![sphere(18.9)]), &job.ctx), Err(JobEnd::Cancelled)));
    let id = bench.scans()[0].id.clone();
    assert_eq!(
        (bench.record(&id).state, bench.part(&id).verdict),
        (ScanState::Partial, Some(PartVerdict::Invalid))
    );
    assert_eq!(bench.finish(run(resumed(&id), &bench.job().ctx)), id);
    assert_eq!((bench.record(&id).state, bench.part(&id).verdict), (ScanState::Complete, Some(PartVerdict::Ok)));
}

#[test]
fn a_job_cancelled_while_it_measures_keeps_its_scan_as_invalid() {
    let bench = Bench::new();
    let job = bench.job_cancelled_at(|words| words == "measuring");
    let id = bench.cut_short(run(ball(vec![sphere(18.9)]), &job.ctx));
    assert_eq!(
        (bench.record(&id).state, bench.part(&id).verdict),
        (ScanState::Complete, Some(PartVerdict::Invalid))
    );
}

#[test]
fn a_crash_during_measurement_leaves_a_scan_that_can_be_completed() {
    let bench = Bench::new();
    // The job completed, and the process crashed before that was stored.
    drop(run(ball(vec![sphere(18.9)]), &bench.job().ctx).unwrap_or_else(|end| panic!("{end:?}")));
    assert!(bench.scans().is_empty());
    bench.runtime.block_on(recover(&bench.catalogue, &*bench.store.artifacts));
    let id = bench.scans()[0].id.clone();
    assert_eq!(
        (bench.record(&id).state, bench.part(&id).verdict),
        (ScanState::Partial, Some(PartVerdict::Invalid))
    );
    assert_eq!(bench.finish(run(resumed(&id), &bench.job().ctx)), id);
    assert_eq!(bench.part(&id).verdict, Some(PartVerdict::Ok));
    // The work folder is gone, and the next start changes nothing.
    bench.runtime.block_on(recover(&bench.catalogue, &*bench.store.artifacts));
    assert_eq!(bench.record(&id).state, ScanState::Complete);
}
