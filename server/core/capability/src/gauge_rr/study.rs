//! A balanced study of parts × operators × trials.

use crate::sample::{mean, range, valid};

/// One measurement of one part by one operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading<'a> {
    /// Name of the part.
    pub part: &'a str,
    /// Name of the operator.
    pub operator: &'a str,
    /// Measured value; `None` if the measurement is missing.
    pub value: Option<f64>,
}

/// A balanced study. Parts and operators are in the order of their first reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    parts: Vec<String>,
    operators: Vec<String>,
    n_trials: usize,
    /// Values of one cell (part, operator) after the other, the operators of one part together.
    cells: Vec<Vec<f64>>,
}

/// Why readings are not a balanced study.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// No part variation.
    #[error("a gauge R&R study needs at least 2 parts, got {n}")]
    TooFewParts {
        /// Number of parts.
        n: usize,
    },
    /// No repeatability.
    #[error("a gauge R&R study needs at least 2 trials, got {n}")]
    TooFewTrials {
        /// Largest number of readings of one part by one operator.
        n: usize,
    },
    /// A reading without a finite value.
    #[error("the measurement of part {part} by operator {operator}, trial {trial}, is missing")]
    MissingMeasurement {
        /// Name of the part.
        part: String,
        /// Name of the operator.
        operator: String,
        /// Number of the trial, from 1.
        trial: usize,
    },
    /// A cell with fewer readings than others.
    #[error("operator {operator} measured part {part} {n} times instead of {n_trials}")]
    Unbalanced {
        /// Name of the part.
        part: String,
        /// Name of the operator.
        operator: String,
        /// Number of readings in the cell.
        n: usize,
        /// Largest number of readings in a cell.
        n_trials: usize,
    },
}

fn idx_of(names: &mut Vec<String>, name: &str) -> usize {
    names.iter().position(|known| known == name).unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    })
}

impl Study {
    /// Groups readings, in any order of parts and operators; trials are in the order of the list.
    ///
    /// # Errors
    /// [`StudyError`] for fewer than two parts or trials, and for the first cell with a missing measurement or fewer
    /// readings than the others.
    pub fn new(readings: &[Reading]) -> Result<Self, StudyError> {
        let (mut parts, mut operators) = (Vec::new(), Vec::new());
        let places: Vec<(usize, usize)> = readings
            .iter()
            .map(|reading| (idx_of(&mut parts, reading.part), idx_of(&mut operators, reading.operator)))
            .collect();
        if parts.len() < 2 {
            return Err(StudyError::TooFewParts { n: parts.len() });
        }
        let mut cells: Vec<Vec<f64>> = vec![Vec::new(); parts.len() * operators.len()];
        for (reading, (part_idx, operator_idx)) in readings.iter().zip(places) {
            let cell = &mut cells[part_idx * operators.len() + operator_idx];
            cell.push(valid(reading.value).ok_or_else(|| StudyError::MissingMeasurement {
                part: reading.part.to_owned(),
                operator: reading.operator.to_owned(),
                trial: cell.len() + 1,
            })?);
        }
        let n_trials = cells.iter().map(Vec::len).max().unwrap_or(0);
        if n_trials < 2 {
            return Err(StudyError::TooFewTrials { n: n_trials });
        }
        if let Some(idx) = cells.iter().position(|cell| cell.len() < n_trials) {
            return Err(StudyError::Unbalanced {
                part: parts[idx / operators.len()].clone(),
                operator: operators[idx % operators.len()].clone(),
                n: cells[idx].len(),
                n_trials,
            });
        }
        Ok(Self { parts, operators, n_trials, cells })
    }

    /// Number of parts, at least 2.
    pub fn n_parts(&self) -> usize {
        self.parts.len()
    }

    /// Number of operators, at least 1.
    pub fn n_operators(&self) -> usize {
        self.operators.len()
    }

    /// Number of trials: measurements of each part by each operator, at least 2.
    pub fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// The values of each cell, the operators of one part together.
    pub(super) fn cells(&self) -> impl Iterator<Item = &[f64]> {
        self.cells.iter().map(Vec::as_slice)
    }

    /// Mean of each cell, in the order of `cells`.
    pub(super) fn cell_means(&self) -> Vec<f64> {
        self.cells().map(mean).collect()
    }

    /// Mean of each part.
    pub(super) fn part_means(&self) -> Vec<f64> {
        self.cell_means().chunks(self.n_operators()).map(mean).collect()
    }

    /// Mean of each operator.
    pub(super) fn operator_means(&self) -> Vec<f64> {
        let means = self.cell_means();
        let of = |operator_idx: usize| -> Vec<f64> {
            means.iter().skip(operator_idx).step_by(self.n_operators()).copied().collect()
        };
        (0..self.n_operators()).map(|operator_idx| mean(&of(operator_idx))).collect()
    }

    /// Mean range of the cells.
    pub(super) fn mean_range(&self) -> f64 {
        mean(&self.cells().map(range).collect::<Vec<f64>>())
    }
}
