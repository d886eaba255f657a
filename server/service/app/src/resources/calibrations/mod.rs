//! The active calibration and its history; comparison of two calibrations.
//!
//! A calibration is a draft until it is activated. Activations and roll-backs are logged; the live view and the station
//! follow the log.

pub mod certificate;
pub mod residuals;
pub mod stored;
pub mod used_station;

use crate::events::{Activation, Event, event};
use std::sync::Arc;

use calibration::{CalibrationDifference, difference};
use live::LiveBus;
use metrology::PartVerdict;
use optics::{Calibration, LightSurfaces, Triangulator};
use station::StationHandle;
use station::wall_clock::now_ms;
use store::{ActivationRecord, Artifacts, Change, ExpectedActive, Page, StoreError};
use tokio::sync::Mutex;

use crate::error::{AppError, ErrorKind};
use crate::evented_catalogue::EventedCatalogue;
use crate::resources::calibrations::stored::stored_document;

/// Page size of the log when searching for the roll-back target.
const ACTS_AT_A_TIME: u32 = 100;

/// The calibrations of the service.
#[derive(Clone)]
pub struct Calibrations {
    catalogue: EventedCatalogue,
    artifacts: Arc<dyn Artifacts>,
    live: LiveBus,
    station: StationHandle,
    /// Serialises activations, so that log, live view and station agree.
    turn: Arc<Mutex<()>>,
}

impl Calibrations {
    /// Over the store, for this live view and station.
    pub fn new(
        catalogue: EventedCatalogue,
        artifacts: Arc<dyn Artifacts>,
        live: LiveBus,
        station: StationHandle,
    ) -> Self {
        Self { catalogue, artifacts, live, station, turn: Arc::default() }
    }

    /// Restores the calibration that was active when the service ended.
    ///
    /// # Errors
    /// If its document cannot be read; then none is active.
    pub async fn load_active(&self) -> Result<(), AppError> {
        let _turn = self.turn.lock().await;
        match self.active().await?.and_then(|act| act.calibration_id) {
            Some(id) => self.put_in_use(Some(self.usable(&id).await?)),
            None => self.put_in_use(None),
        }
        Ok(())
    }

    /// The last entry of the log; `None` if nothing was ever activated.
    pub async fn active(&self) -> Result<Option<ActivationRecord>, AppError> {
        Ok(self.catalogue.read().active().await?)
    }

    /// Activates `id`. `expected`: refused unless this one is currently active. Activating the calibration that is
    /// active already changes nothing.
    pub async fn activate(
        &self,
        id: &str,
        expected: Option<Option<String>>,
        actor: &str,
        verified: Option<PartVerdict>,
    ) -> Result<ActivationRecord, AppError> {
        let _turn = self.turn.lock().await;
        let active = self.active().await?;
        let active_id = active.as_ref().and_then(|act| act.calibration_id.clone());
        if expected.as_ref().is_some_and(|expected| *expected != active_id) {
            return Err(changed());
        }
        if let Some(act) = active.filter(|act| act.calibration_id.as_deref() == Some(id)) {
            return Ok(act);
        }
        let calibration = self.usable(id).await?;
        self.act(Some(id.to_owned()), active_id, "activate", actor, verified).await?;
        self.put_in_use(Some(calibration));
        self.newest_act().await
    }

    /// Rolls back the last activation that has not been rolled back.
    pub async fn roll_back(&self, actor: &str) -> Result<ActivationRecord, AppError> {
        let _turn = self.turn.lock().await;
        let undone = self.last_standing_activation().await?.ok_or_else(|| {
            AppError::new(ErrorKind::Conflict, "there is no activation to roll back")
                .remedy("activate the desired calibration")
        })?;
        let calibration = match &undone.previous_id {
            Some(id) => Some(self.usable(id).await?),
            None => None,
        };
        self.act(undone.previous_id, undone.calibration_id, "roll_back", actor, None).await?;
        self.put_in_use(calibration);
        self.newest_act().await
    }

    /// Depth difference of `other` minus `one`, in mm over the working volume of `one`.
    pub async fn difference(&self, one: &str, other: &str) -> Result<CalibrationDifference, AppError> {
        let one = self.document(one).await?;
        let other = self.document(other).await?;
        let compared = tokio::task::spawn_blocking(move || difference(&one, &other)).await;
        let compared = compared.map_err(|cause| {
            AppError::new(ErrorKind::Internal, "the comparison failed with an internal error")
                .because(cause.to_string())
        })?;
        Ok(compared?)
    }

    async fn document(&self, id: &str) -> Result<Calibration, AppError> {
        Ok(stored_document(&self.catalogue, &*self.artifacts, Some(id)).await?.calibration())
    }

    /// A calibration that can be used for scanning.
    async fn usable(&self, id: &str) -> Result<Calibration, AppError> {
        let calibration = self.document(id).await?;
        if matches!(&calibration.light, LightSurfaces::Planes(planes) if planes.is_empty()) {
            return Err(AppError::new(ErrorKind::Impossible, format!("calibration {id} covers the camera only"))
                .remedy("calibrate with laser images, then activate the result"));
        }
        Ok(calibration)
    }

    async fn act(
        &self,
        to: Option<String>,
        from: Option<String>,
        act: &str,
        actor: &str,
        verified: Option<PartVerdict>,
    ) -> Result<(), AppError> {
        let subject = to.clone().unwrap_or_default();
        let body = Activation {
            calibration_id: to.clone(),
            previous_id: from.clone(),
            actor: actor.to_owned(),
            verification: verified.map(|verdict| verdict.name().to_owned()),
        };
        let is_new = act == "activate";
        let activated =
            if is_new { Event::CalibrationActivated(body) } else { Event::CalibrationRolledBack(body) };
        let append_event = event(&subject, activated);
        let change = Change::Activate {
            calibration_id: to,
            expected_previous: ExpectedActive::Is(from),
            act: act.to_owned(),
            actor: actor.to_owned(),
            at_ms: now_ms(),
        };
        match self.catalogue.commit(vec![change, append_event]).await {
            Ok(_) => Ok(()),
            Err(StoreError::Changed { .. }) => Err(changed()),
            Err(error) => Err(error.into()),
        }
    }

    async fn newest_act(&self) -> Result<ActivationRecord, AppError> {
        self.active()
            .await?
            .ok_or_else(|| AppError::new(ErrorKind::Internal, "the activation log is inconsistent"))
    }

    /// Walks back through the log: every roll-back cancels the latest activation before it that is still in effect.
    async fn last_standing_activation(&self) -> Result<Option<ActivationRecord>, AppError> {
        let (mut rolled_back, mut before) = (0, None);
        loop {
            let page = Page { before: before.clone(), limit: ACTS_AT_A_TIME };
            let acts = self.catalogue.read().activations(&page).await?.whole()?;
            let Some(last) = acts.last() else { return Ok(None) };
            before = Some(last.seq.to_string());
            for act in acts {
                match (act.act.as_str(), rolled_back) {
                    ("roll_back", _) => rolled_back += 1,
                    (_, 0) => return Ok(Some(act)),
                    _ => rolled_back -= 1,
                }
            }
        }
    }

    fn put_in_use(&self, calibration: Option<Calibration>) {
        self.station.calibration_changed(calibration.is_some());
        self.live.set_calibration(calibration.map(|calibration| Arc::new(Triangulator::new(calibration))));
    }
}

fn changed() -> AppError {
    AppError::new(ErrorKind::Changed, "another calibration was activated in the meantime")
        .remedy("check the active calibration, then decide")
}
