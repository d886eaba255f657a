//! Statistics of a characteristic over inspections: control chart, capability of the process, and of the station as a
//! measuring system.

use capability::gauge_rr::{GaugeRr, Reading, Study as CrossedStudy, anova};
use capability::spc::{
    Grouping, IndividualsChart, ProcessCapability, ProcessRequest, Rule, SpecificationLimits, Violation,
    individuals_chart, process_capability, violations,
};
use capability::type_1::{self, Factors, Study as Type1Study};
use store::{Catalogue, InspectionFilter, Page};

use crate::error::{AppError, ErrorKind};
use crate::resources::inspections::InspectionMessage;

/// Attribute of an inspection that names the operator of a gauge R&R study.
pub const OPERATOR: &str = "operator";

/// Inspections of a statistic unless another number is requested: enough for a process capability study (125 in five months
/// of a production line).
pub const CHART_VALUES: u32 = 125;

/// Selects the inspections of a statistic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeriesRequest {
    /// Which inspections; the recipe is required.
    pub filter: InspectionFilter,
    /// Id of the characteristic in the plan.
    pub characteristic: String,
    /// At most so many, the newest.
    pub limit: u32,
}

/// The values of a characteristic, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// `mm` or `°`.
    pub unit: String,
    /// Nominal value of the newest inspection.
    pub nominal: Option<f64>,
    /// Limits of the newest inspection, as values.
    pub limits: SpecificationLimits,
    /// The values.
    pub readings: Vec<SeriesReading>,
}

/// A value of a series.
#[derive(Debug, Clone, PartialEq)]
pub struct SeriesReading {
    /// Number of the inspection.
    pub seq: i64,
    /// Its id.
    pub inspection_id: String,
    /// Serial number of the part.
    pub serial: String,
    /// The operator, if the inspection has that attribute.
    pub operator: Option<String>,
    /// When.
    pub at_ms: i64,
    /// The value, in the unit of the series; `None` if it was not measured or is invalid.
    pub value: Option<f64>,
}

/// Reads a series; re-evaluations are left out, since they are not further measurements.
///
/// # Errors
/// No selected inspection has the characteristic, or a record is damaged.
pub async fn series(read: &dyn Catalogue, request: &SeriesRequest) -> Result<Series, AppError> {
    let page = Page { before: None, limit: request.limit };
    let records = read.inspections(&request.filter, &page).await?.whole()?;
    let mut series = Series {
        unit: String::new(),
        nominal: None,
        limits: SpecificationLimits { lower: None, upper: None },
        readings: Vec::new(),
    };
    for record in records.into_iter().filter(|record| record.re_evaluated_from.is_none()) {
        let mut inspection: InspectionMessage = record.try_into()?;
        let Some(idx) = inspection.results.iter().position(|result| result.id == request.characteristic) else {
            continue;
        };
        let result = inspection.results.swap_remove(idx);
        if series.readings.is_empty() {
            let (lower, upper) = result.limits();
            (series.nominal, series.limits) = (result.nominal, SpecificationLimits { lower, upper });
            series.unit.clone_from(&result.unit);
        }
        series.readings.push(SeriesReading {
            seq: inspection.seq,
            inspection_id: inspection.id,
            serial: inspection.serial,
            operator: inspection.attributes.remove(OPERATOR),
            at_ms: inspection.inspected_at_ms,
            value: result.charted(),
        });
    }
    if series.readings.is_empty() {
        let what = format!("no selected inspection has a characteristic {}", request.characteristic);
        return Err(AppError::new(ErrorKind::NotFound, what).remedy("check recipe, characteristic and filter"));
    }
    series.readings.reverse();
    Ok(series)
}

/// A control chart with its violations and the capability of the process.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlChart {
    /// Limits and moving ranges.
    pub chart: IndividualsChart,
    /// Violations of Nelson's rules.
    pub violations: Vec<Violation>,
    /// Capability; `Err`: why it cannot be stated.
    pub capability: Result<ProcessCapability, String>,
}

impl Series {
    fn values(&self) -> Vec<Option<f64>> {
        self.readings.iter().map(|reading| reading.value).collect()
    }

    /// Upper minus lower limit; `None` unless there are both.
    fn tolerance(&self) -> Option<f64> {
        self.limits.upper.zip(self.limits.lower).map(|(upper, lower)| upper - lower)
    }

    /// The chart of individual values and moving ranges, whose limits come from the series itself.
    ///
    /// # Errors
    /// There are too few values.
    pub fn control_chart(&self) -> Result<ControlChart, AppError> {
        let values = self.values();
        let chart = individuals_chart(&values).map_err(|error| impossible(&error))?;
        let violations = violations(&values, chart.individuals.centre, chart.sigma.sigma, &Rule::NELSON);
        let request = ProcessRequest { values: &values, limits: self.limits, grouping: Grouping::Individuals };
        let capability = process_capability(&request).map_err(|error| error.to_string());
        Ok(ControlChart { chart, violations, capability })
    }

    /// A type-1 study: the series must be repeated measurements of one part with a known value.
    ///
    /// # Errors
    /// Values of several parts, a characteristic without two limits, or too few values.
    pub fn type_1_study(&self, reference: f64, factors: Factors) -> Result<Type1Study, AppError> {
        let mut serials: Vec<_> = self.readings.iter().map(|reading| reading.serial.as_str()).collect();
        serials.sort_unstable();
        serials.dedup();
        if serials.len() > 1 {
            let what = format!("a type-1 study needs one part, but {} were selected", serials.len());
            return Err(AppError::new(ErrorKind::Impossible, what)
                .at("query/serial")
                .remedy("give its serial number"));
        }
        let Some(tolerance) = self.tolerance() else {
            return Err(AppError::new(ErrorKind::Impossible, "the characteristic has no lower or no upper limit")
                .remedy("a type-1 study needs a tolerance: publish a version of the recipe with both limits"));
        };
        let request = type_1::Request { values: &self.values(), reference, tolerance, resolution: None, factors };
        type_1::evaluate(&request).map_err(|error| impossible(&error))
    }

    /// A gauge R&R study by analysis of variance: parts are serial numbers, operators the attribute `operator` of the
    /// inspections, trials their repetitions. Without that attribute the station itself is the one operator.
    ///
    /// # Errors
    /// The series is not a balanced study.
    pub fn gauge_rr(&self) -> Result<GaugeRr, AppError> {
        let readings: Vec<Reading> = self
            .readings
            .iter()
            .map(|SeriesReading { serial, operator, value, .. }| Reading {
                part: serial,
                operator: operator.as_deref().unwrap_or("station"),
                value: *value,
            })
            .collect();
        let study = CrossedStudy::new(&readings).map_err(|error| impossible(&error))?;
        anova(&study, self.tolerance()).map_err(|error| impossible(&error))
    }
}

fn impossible(error: &dyn std::error::Error) -> AppError {
    AppError::new(ErrorKind::Impossible, error.to_string())
        .remedy("inspect more parts, or select the inspections of one study by time, serial number or order")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn series(parts: &[(&str, Option<&str>, Option<f64>)]) -> Series {
        let reading =
            |(seq, (serial, operator, value)): (i64, &(&str, Option<&str>, Option<f64>))| SeriesReading {
                seq,
                inspection_id: seq.to_string(),
                serial: (*serial).to_owned(),
                operator: operator.map(str::to_owned),
                at_ms: seq,
                value: *value,
            };
        Series {
            unit: "mm".to_owned(),
            nominal: Some(10.0),
            limits: SpecificationLimits { lower: Some(9.0), upper: Some(11.0) },
            readings: (1..).zip(parts).map(reading).collect(),
        }
    }

    #[test]
    fn a_chart_marks_what_is_beyond_its_limits_and_states_capability() {
        let stable =
            |idx: usize| Some(10.0 + if idx.is_multiple_of(2) { 0.01 } else { -0.01 } * (1 + idx % 3) as f64);
        let mut parts: Vec<_> = (0..40).map(|idx| ("S", None, stable(idx))).collect();
        parts[30].2 = Some(10.5);
        let chart = series(&parts).control_chart().unwrap();
        let beyond: Vec<_> =
            chart.violations.iter().filter(|found| found.rule == Rule::BeyondThreeSigma).collect();
        assert_eq!((beyond.len(), beyond[0].first_idx), (1, 30));
        assert!(chart.capability.unwrap().potential.nearest_index > 1.33);
        series(&[("S", None, Some(1.0))]).control_chart().unwrap_err();
    }

    #[test]
    fn a_type_1_study_is_about_one_part() {
        let of_one: Vec<_> = (0..50).map(|idx| ("REF", None, Some(10.0 + 0.001 * f64::from(idx % 5)))).collect();
        let study = series(&of_one).type_1_study(10.002, Factors::SIX_SIGMA).unwrap();
        assert_eq!(study.verdict, capability::Verdict::Capable, "{study:?}");
        let mut of_two = of_one;
        of_two[3].0 = "OTHER";
        let refused = series(&of_two).type_1_study(10.0, Factors::SIX_SIGMA).unwrap_err();
        assert_eq!(refused.pointer.as_deref(), Some("query/serial"));
    }

    #[test]
    fn operators_are_an_attribute_and_the_station_is_the_only_one_without_it() {
        let value = |part: usize, trial: usize| Some(10.0 + 0.1 * part as f64 + 0.001 * trial as f64);
        let names = ["A", "B", "C"];
        let all = |operators: &[Option<&'static str>]| -> Vec<(&str, Option<&str>, Option<f64>)> {
            let cells = operators.iter().flat_map(|operator| (0..3).map(move |part| (*operator, part)));
            cells.flat_map(|(op, part)| (0..2).map(move |trial| (names[part], op, value(part, trial)))).collect()
        };
        let automatic = series(&all(&[None])).gauge_rr().unwrap();
        assert_eq!((automatic.n_operators, automatic.n_parts, automatic.reproducibility), (1, 3, None));
        let crossed = series(&all(&[Some("Anna"), Some("Ben")])).gauge_rr().unwrap();
        assert_eq!((crossed.n_operators, crossed.n_trials), (2, 2));
        let mut missing = all(&[Some("Anna"), Some("Ben")]);
        missing.pop();
        assert!(series(&missing).gauge_rr().unwrap_err().detail.contains("operator Ben measured part C 1 times"));
    }
}
