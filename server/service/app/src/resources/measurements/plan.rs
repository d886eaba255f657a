//! The measurement plan of the station: what *Start* scans and measures, stored on the server.
//!
//! One file in the data directory, replaced atomically; a checksum detects corruption.

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use store::disk::write_durably;
use tokio::sync::Mutex;
use twin::TwinDriver;

use crate::config::AppConfig;
use crate::error::disk_problem;
use crate::error::{AppError, ErrorKind};
use crate::hash_hex;
use crate::resources::measurements::MeasureInput;

/// The file in the data directory.
const FILE: &str = "measurement-plan.json";

/// Range of the first scan of a new station, mm.
const FIRST_RANGE_MM: (f64, f64) = (-20.0, 20.0);

/// Distance of its rows, mm.
const FIRST_STEP_MM: f64 = 0.2;

/// The same on a turntable: a full turn plus the overlap that shows the closure.
const FIRST_TURN_DEG: (f64, f64) = (0.0, 375.0);

/// Angle between its rows.
const FIRST_STEP_DEG: f64 = 1.5;

/// Tolerance of the sphere on the simulated stage, mm.
const FIRST_TOLERANCE_MM: f64 = 0.05;

/// A measurement plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasurementPlan {
    /// The scan range.
    #[serde(flatten)]
    pub range: PlannedRange,
    /// Exposure time of the frames, µs; `None`: chosen by the station.
    pub exposure_us: Option<f64>,
    /// What is measured on every part.
    pub measure: Vec<MeasureInput>,
}

/// Range and row spacing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PlannedRange {
    /// For a linear stage.
    Linear {
        /// First stage position.
        from_mm: f64,
        /// Last stage position.
        to_mm: f64,
        /// Distance between rows.
        step_mm: f64,
    },
    /// For a turntable.
    Rotary {
        /// First angle.
        from_deg: f64,
        /// Last angle of a turntable.
        to_deg: f64,
        /// Angle between rows.
        step_deg: f64,
    },
}

/// A plan with its version.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeptPlan {
    /// Version; 0: never changed.
    pub version: u64,
    /// The plan.
    pub plan: MeasurementPlan,
}

/// The form in the file.
#[derive(Serialize, Deserialize)]
struct Sealed {
    sha256: String,
    kept: KeptPlan,
}

/// The plan of the station.
#[derive(Clone)]
pub struct MeasurementPlans {
    path: Arc<PathBuf>,
    kept: Arc<Mutex<Result<KeptPlan, AppError>>>,
}

impl MeasurementPlan {
    /// The plan of a new station: the simulated one measures the sphere on its stage, a real one only scans.
    fn first(config: &AppConfig) -> Self {
        let twin = config.station.twin.as_deref().map(TwinDriver::settings);
        let range = if twin.is_some_and(|twin| twin.rotary) {
            let (from_deg, to_deg) = FIRST_TURN_DEG;
            PlannedRange::Rotary { from_deg, to_deg, step_deg: FIRST_STEP_DEG }
        } else {
            let (from_mm, to_mm) = FIRST_RANGE_MM;
            PlannedRange::Linear { from_mm, to_mm, step_mm: FIRST_STEP_MM }
        };
        let ball = MeasureInput {
            tool: metrology::Tool::Sphere.name().to_owned(),
            name: None,
            nominal_mm: Some(config.known_sizes_mm().1),
            tolerance_mm: Some(FIRST_TOLERANCE_MM),
            region_mm: None,
            seed: None,
        };
        let measure = if twin.is_some() { vec![ball] } else { Vec::new() };
        Self { range, exposure_us: None, measure }
    }

    fn check(&self) -> Result<(), AppError> {
        let range = match self.range {
            PlannedRange::Linear { from_mm, to_mm, step_mm } => {
                [("from_mm", from_mm, false), ("to_mm", to_mm, false), ("step_mm", step_mm, true)]
            }
            PlannedRange::Rotary { from_deg, to_deg, step_deg } => {
                [("from_deg", from_deg, false), ("to_deg", to_deg, false), ("step_deg", step_deg, true)]
            }
        };
        let numbers = range.map(|(field, value, positive)| (field, Some(value), positive));
        for (field, value, positive) in numbers.into_iter().chain([("exposure_us", self.exposure_us, true)]) {
            if let Some(value) = value.filter(|value| !value.is_finite() || (positive && *value <= 0.0)) {
                let remedy = if positive { "give a number above 0" } else { "give a number" };
                return Err(AppError::new(ErrorKind::Impossible, format!("{field} is {value}"))
                    .at(format!("/{field}"))
                    .remedy(remedy));
            }
        }
        crate::resources::measurements::check_measurements(&self.measure)
    }
}

impl MeasurementPlans {
    /// Reads the plan from the data directory.
    pub fn open(config: &AppConfig) -> Self {
        let path = config.data.join(FILE);
        let kept = match std::fs::read(&path) {
            Ok(bytes) => opened(&bytes),
            Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
                Ok(KeptPlan { version: 0, plan: MeasurementPlan::first(config) })
            }
            Err(cause) => Err(disk_problem(cause)),
        };
        if let Err(problem) = &kept {
            tracing::error!(detail = problem.detail, cause = problem.cause, "the measurement plan cannot be read");
        }
        Self { path: Arc::new(path), kept: Arc::new(Mutex::new(kept)) }
    }

    /// The current plan.
    ///
    /// # Errors
    /// A problem if its file is damaged.
    pub async fn get(&self) -> Result<KeptPlan, AppError> {
        self.kept.lock().await.clone()
    }

    /// Replaces the plan durably if `may` accepts its version (`None`: the file is damaged); returns the next version.
    ///
    /// # Errors
    /// A refusal of `may`, an impossible plan, or a write error.
    pub async fn put<E: From<AppError>>(
        &self,
        plan: MeasurementPlan,
        may: impl FnOnce(Option<u64>) -> Result<(), E>,
    ) -> Result<KeptPlan, E> {
        plan.check()?;
        let mut kept = self.kept.lock().await;
        let version = kept.as_ref().ok().map(|kept| kept.version);
        may(version)?;
        let next = KeptPlan { version: version.unwrap_or(0) + 1, plan };
        let (path, bytes) = (self.path.clone(), sealed(&next)?);
        tokio::task::spawn_blocking(move || write_durably(&path, &bytes))
            .await
            .map_err(disk_problem)?
            .map_err(disk_problem)?;
        *kept = Ok(next.clone());
        Ok(next)
    }
}

fn sealed(kept: &KeptPlan) -> Result<Vec<u8>, AppError> {
    let text = serde_json::to_vec(kept).map_err(disk_problem)?;
    let sealed = Sealed { sha256: hash_hex(&text), kept: kept.clone() };
    serde_json::to_vec_pretty(&sealed).map_err(disk_problem)
}

fn opened(bytes: &[u8]) -> Result<KeptPlan, AppError> {
    let damaged = |cause: String| {
        AppError::new(ErrorKind::Internal, "the measurement plan is damaged on the disk")
            .because(cause)
            .remedy("set it again, or restore the data directory from a backup")
    };
    let sealed: Sealed = serde_json::from_slice(bytes).map_err(|cause| damaged(cause.to_string()))?;
    let text = serde_json::to_vec(&sealed.kept).map_err(|cause| damaged(cause.to_string()))?;
    if hash_hex(&text) != sealed.sha256 {
        return Err(damaged("its checksum differs".to_owned()));
    }
    Ok(sealed.kept)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn plans(folder: &Path) -> MeasurementPlans {
        MeasurementPlans::open(&AppConfig::simulated(folder.to_owned()))
    }

    fn changed(plan: &MeasurementPlan) -> MeasurementPlan {
        let range = PlannedRange::Linear { from_mm: -20.0, to_mm: 7.5, step_mm: 0.2 };
        MeasurementPlan { range, measure: Vec::new(), ..plan.clone() }
    }

    #[tokio::test]
    async fn a_stored_plan_survives_a_restart_and_a_flipped_bit_is_detected() {
        let folder = tempfile::tempdir().unwrap();
        let first = plans(folder.path()).get().await.unwrap();
        assert_eq!((first.version, first.plan.measure[0].nominal_mm), (0, Some(18.9)));
        let put = plans(folder.path()).put::<AppError>(changed(&first.plan), |_| Ok(())).await.unwrap();
        assert_eq!(put.version, 1);
        assert_eq!(plans(folder.path()).get().await.unwrap(), put);

        let path = folder.path().join(FILE);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace("7.5", "7.4")).unwrap();
        let damaged = plans(folder.path());
        assert_eq!(damaged.get().await.unwrap_err().kind, ErrorKind::Internal);
        // Its version is unknown; it can be set again.
        let may =
            |version: Option<u64>| if version.is_none() { Ok::<(), AppError>(()) } else { panic!("{version:?}") };
        assert_eq!(damaged.put(first.plan, may).await.unwrap().version, 1);
    }

    #[tokio::test]
    async fn an_invalid_plan_is_refused_and_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let plans = plans(folder.path());
        let first = plans.get().await.unwrap();
        let mut plan = first.plan.clone();
        plan.measure[0].nominal_mm = None;
        let problem = plans.put::<AppError>(plan, |_| Ok(())).await.unwrap_err();
        assert_eq!(
            (problem.kind, problem.pointer.as_deref()),
            (ErrorKind::Impossible, Some("/measure/0/tolerance_mm"))
        );
        let range = PlannedRange::Linear { from_mm: -20.0, to_mm: 7.5, step_mm: 0.0 };
        let step = MeasurementPlan { range, ..first.plan.clone() };
        assert_eq!(
            plans.put::<AppError>(step, |_| Ok(())).await.unwrap_err().pointer.as_deref(),
            Some("/step_mm")
        );
        assert_eq!(plans.get().await.unwrap(), first);
    }
}
