//! A scanned part: the scan, the current measurement of each characteristic, and its verdict.
//!
//! The only place that derives a part's verdict from measurements.

use metrology::{CharacteristicKey, PartVerdict, part_verdict};
use serde_json::Value;
use store::{DamagedRow, Listed, MeasurementFilter, MeasurementRecord, Page, ScanFilter, ScanRecord, ScanState};

use crate::error::AppError;
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::measurements::{MeasureInput, ScanPurpose};
use crate::resources::scan_run::ScanRun;

/// A scan with its verdict.
#[derive(Debug, Clone)]
pub struct Part {
    /// The scan.
    pub scan: ScanRecord,
    /// The current measurement of each characteristic, newest first: the newest with a verdict, else the newest.
    pub measured: Vec<MeasurementRecord>,
    /// The verdict on the part; `None` if no characteristic has a tolerance.
    pub verdict: Option<PartVerdict>,
}

/// Filter for parts.
#[derive(Debug, Clone, Default)]
pub struct PartFilter {
    /// Of the scan.
    pub scan: ScanFilter,
    /// Only scans with this purpose.
    pub purpose: Option<ScanPurpose>,
    /// Only those with this verdict.
    pub verdict: Option<PartVerdict>,
    /// Only those with any verdict, or only those without.
    pub judged: Option<bool>,
    /// Only those with a measurement, or only those without.
    pub measured: Option<bool>,
}

impl PartFilter {
    fn accepts(&self, part: &Part) -> bool {
        (self.verdict.is_none() || self.verdict == part.verdict)
            && self.judged.is_none_or(|judged| judged == part.verdict.is_some())
            && self.measured.is_none_or(|measured| measured != part.measured.is_empty())
    }
}

/// Purpose of a scan; scans of earlier versions count as production.
pub fn purpose_of(scan: &ScanRecord) -> ScanPurpose {
    ScanRun::of(scan).map_or_else(|_| ScanPurpose::default(), |run| run.purpose)
}

/// The measurements of a scan plan.
pub fn planned_measurements(plan: &Value) -> Vec<MeasureInput> {
    ScanRun::from_stored(plan).map_or_else(|_| Vec::new(), |run| run.measure)
}

/// The verdict on the part of a scan from all its measurements, newest first.
pub fn verdict_of(scan: &ScanRecord, newest_first: &[MeasurementRecord]) -> Option<PartVerdict> {
    if scan.state == ScanState::Invalid {
        return Some(PartVerdict::Invalid);
    }
    let planned = planned_measurements(&scan.plan);
    let required: Vec<CharacteristicKey<'_>> = planned
        .iter()
        .filter(|planned| planned.tolerance_mm.is_some())
        .map(|planned| CharacteristicKey { tool: &planned.tool, name: planned.name.as_deref() })
        .collect();
    part_verdict(newest_first.iter().map(|record| (key_of(record), verdict_in(record))), &required)
}

/// The verdict of one measurement.
pub fn verdict_in(record: &MeasurementRecord) -> Option<PartVerdict> {
    record.result["verdict"].as_str().and_then(PartVerdict::from_name)
}

fn key_of(record: &MeasurementRecord) -> CharacteristicKey<'_> {
    let text = |key: &str| record.request[key].as_str();
    CharacteristicKey { tool: text("tool").unwrap_or_default(), name: text("name") }
}

/// A scan with its verdict, considering damaged measurement records: their content is unknown, so the part is at best
/// invalid.
pub async fn part(catalogue: &EventedCatalogue, scan: ScanRecord) -> Result<(Part, Vec<DamagedRow>), AppError> {
    let filter = MeasurementFilter { scan_id: Some(scan.id.clone()), ..MeasurementFilter::default() };
    let all = Page { before: None, limit: u32::MAX };
    let Listed { records, damaged, .. } = catalogue.read().measurements(&filter, &all).await?;
    let unknown = (!damaged.is_empty()).then_some(PartVerdict::Invalid);
    let verdict = verdict_of(&scan, &records).max(unknown);
    Ok((Part { scan, measured: standing(records), verdict }, damaged))
}

/// For each characteristic the newest measurement with a verdict, else the newest.
fn standing(newest_first: Vec<MeasurementRecord>) -> Vec<MeasurementRecord> {
    let mut standing: Vec<MeasurementRecord> = Vec::new();
    for record in newest_first {
        match standing.iter_mut().find(|known| key_of(known) == key_of(&record)) {
            None => standing.push(record),
            Some(known) if verdict_in(known).is_none() && verdict_in(&record).is_some() => *known = record,
            Some(_) => {}
        }
    }
    standing
}

/// Parts, newest first. Verdicts are derived from stored measurements, so that lists and parts always agree.
pub async fn parts(
    catalogue: &EventedCatalogue,
    filter: &PartFilter,
    page: &Page,
) -> Result<Listed<Part>, AppError> {
    let mut list = Listed { records: Vec::new(), damaged: Vec::new(), next: None };
    let mut from = page.clone();
    loop {
        let scans = catalogue.read().scans(&filter.scan, &from).await?;
        list.damaged.extend(scans.damaged);
        for scan in scans.records {
            if filter.purpose.is_some_and(|purpose| purpose != purpose_of(&scan)) {
                continue;
            }
            let (part, damaged) = part(catalogue, scan).await?;
            list.damaged.extend(damaged);
            if !filter.accepts(&part) {
                continue;
            }
            list.records.push(part);
            if list.records.len() as u64 >= u64::from(page.limit) {
                list.next = list.records.last().map(|part| part.scan.id.clone());
                return Ok(list);
            }
        }
        match scans.next {
            Some(before) => from.before = Some(before),
            None => return Ok(list),
        }
    }
}

/// The latest verification of a calibration; `None` if there is none.
pub async fn newest_verification(
    catalogue: &EventedCatalogue,
    calibration_id: &str,
) -> Result<Option<Part>, AppError> {
    let filter = PartFilter {
        scan: ScanFilter { calibration_id: Some(calibration_id.to_owned()), ..ScanFilter::default() },
        purpose: Some(ScanPurpose::Verification),
        ..PartFilter::default()
    };
    let newest = Page { before: None, limit: 1 };
    Ok(parts(catalogue, &filter, &newest).await?.records.pop())
}
