//! The inspections that belong to a study.

use capability::gauge_rr::{GaugeRr, Reading, Study as CrossedStudy, anova};
use capability::type_1::{self, Study as Type1Study};
use store::{Catalogue, InspectionFilter};

use crate::error::{AppError, ErrorKind};
use crate::resources::statistics::{Series, SeriesReading, SeriesRequest, series};
use crate::resources::studies::{GaugeRrPlan, Study, Type1Plan};

/// Inspections read for a study: 50 parts by 20 operators need fewer.
const MOST_INSPECTIONS: u32 = 5000;

/// The operator of inspections without that attribute.
const STATION: &str = "station";

/// The inspections of a study, and how many are missing of each part.
#[derive(Debug, Clone, PartialEq)]
pub struct Selected {
    /// Those that belong to it, oldest first.
    pub series: Series,
    /// Part, operator (`None`: any), inspections present; in the order of the plan.
    pub cells: Vec<(String, Option<String>, usize)>,
}

/// The inspections since the study began, with the version of its recipe; `None`: there are none.
pub(super) async fn all_since(
    read: &dyn Catalogue,
    study: &Study,
    (recipe, version, characteristic): (&str, Option<i64>, &str),
) -> Result<Option<Series>, AppError> {
    let filter = InspectionFilter {
        recipe_id: Some(recipe.to_owned()),
        recipe_version: version,
        from_ms: Some(study.created_at_ms),
        ..InspectionFilter::default()
    };
    let request = SeriesRequest { filter, characteristic: characteristic.to_owned(), limit: MOST_INSPECTIONS };
    match series(read, &request).await {
        Ok(found) => Ok(Some(found)),
        Err(error) if error.kind == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

impl Type1Plan {
    /// The first `n_values` inspections of the part.
    pub(super) fn select(&self, mut series: Series) -> Selected {
        series.readings.retain(|reading| reading.serial == self.serial);
        series.readings.truncate(self.n_values as usize);
        let n_present = series.readings.len();
        Selected { series, cells: vec![(self.serial.clone(), None, n_present)] }
    }

    /// The figures of a complete selection.
    pub(super) fn evaluate(&self, selected: &Selected) -> Result<Type1Study, String> {
        let series = &selected.series;
        let tolerance = series.limits.upper.zip(series.limits.lower).map(|(upper, lower)| upper - lower);
        let tolerance = tolerance.ok_or("the characteristic has no lower or no upper limit")?;
        let values: Vec<Option<f64>> = series.readings.iter().map(|reading| reading.value).collect();
        let request = type_1::Request {
            values: &values,
            reference: self.reference,
            tolerance,
            resolution: None,
            factors: self.factors(),
        };
        type_1::evaluate(&request).map_err(|error| error.to_string())
    }
}

impl GaugeRrPlan {
    /// Every part with every operator, without inspections.
    pub(super) fn no_cells(&self) -> Vec<(String, Option<String>, usize)> {
        let operators: Vec<Option<String>> = match self.operators.is_empty() {
            true => vec![None],
            false => self.operators.iter().cloned().map(Some).collect(),
        };
        let of_part = |part: &String| -> Vec<_> {
            operators.iter().map(|operator| (part.clone(), operator.clone(), 0)).collect()
        };
        self.parts.iter().flat_map(of_part).collect()
    }

    /// The first `n_trials` inspections of each part by each operator.
    pub(super) fn select(&self, mut series: Series) -> Selected {
        let mut cells = self.no_cells();
        series.readings.retain(|reading| {
            let cell = cells.iter_mut().find(|(part, operator, _)| {
                *part == reading.serial && (operator.is_none() || *operator == reading.operator)
            });
            match cell {
                Some((_, _, n_present)) if *n_present < self.n_trials as usize => {
                    *n_present += 1;
                    true
                }
                _ => false,
            }
        });
        Selected { series, cells }
    }

    /// The figures of a complete selection.
    pub(super) fn evaluate(&self, selected: &Selected) -> Result<GaugeRr, String> {
        let series = &selected.series;
        let operator = |reading: &'_ SeriesReading| match self.operators.is_empty() {
            true => STATION.to_owned(),
            false => reading.operator.clone().unwrap_or_default(),
        };
        let operators: Vec<String> = series.readings.iter().map(operator).collect();
        let readings: Vec<Reading> = series
            .readings
            .iter()
            .zip(&operators)
            .map(|(reading, operator)| Reading { part: &reading.serial, operator, value: reading.value })
            .collect();
        let tolerance = series.limits.upper.zip(series.limits.lower).map(|(upper, lower)| upper - lower);
        let study = CrossedStudy::new(&readings).map_err(|error| error.to_string())?;
        anova(&study, tolerance).map_err(|error| error.to_string())
    }
}
