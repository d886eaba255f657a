//! Hold of the inspection queue: waiting inspections are not started, other jobs are.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use station::wall_clock::now_ms;
use store::{Change, SettingRecord};

use crate::access::principal::Principal;
use crate::error::AppError;
use crate::evented_catalogue::EventedCatalogue;
use crate::events::{Event, InspectionsHeld, event};
use crate::jobs::queue::Queue;
use crate::jobs::{JobInput, Jobs, Waiting};

/// The setting that persists across restarts.
const HOLD: &str = "inspections.hold";

/// Why no inspection starts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InspectionHold {
    /// Who holds them.
    pub actor: String,
    /// Why.
    pub reason: Option<String>,
    /// Since when.
    pub since_ms: i64,
}

/// The hold stored by an earlier process. An unreadable one counts as a hold.
pub(in crate::jobs) async fn stored_hold(catalogue: &EventedCatalogue) -> Option<InspectionHold> {
    let unreadable = |cause: String| {
        tracing::error!(cause, "the hold of inspections cannot be read: they are held");
        InspectionHold { actor: "server".to_owned(), reason: None, since_ms: now_ms() }
    };
    match catalogue.read().setting(HOLD).await {
        Ok(None) => None,
        Ok(Some(SettingRecord { value: Value::Null, .. })) => None,
        Ok(Some(setting)) => {
            Some(serde_json::from_value(setting.value).unwrap_or_else(|cause| unreadable(cause.to_string())))
        }
        Err(error) => Some(unreadable(error.to_string())),
    }
}

/// Whether a hold applies to this job.
pub(in crate::jobs) fn is_inspection(waiting: &Waiting) -> bool {
    matches!(waiting.input, JobInput::Inspection(_))
}

impl Jobs {
    /// The hold, if there is one.
    pub fn inspection_hold(&self) -> Option<InspectionHold> {
        self.0.hold.lock().clone()
    }

    /// Starts no further inspection until [`Jobs::resume_inspections`], across restarts too.
    ///
    /// # Errors
    /// The store cannot be written; then they are not held.
    pub async fn hold_inspections(&self, by: &Principal, reason: Option<String>) -> Result<(), AppError> {
        let hold = InspectionHold { actor: by.actor.clone(), reason: reason.clone(), since_ms: now_ms() };
        let held = Event::InspectionsHeld(InspectionsHeld { initiator: by.initiator(), reason });
        self.0.set_hold(Some(hold), held).await
    }

    /// Starts waiting inspections again.
    ///
    /// # Errors
    /// The store cannot be written; then they stay held.
    pub async fn resume_inspections(&self, by: &Principal) -> Result<(), AppError> {
        if self.inspection_hold().is_none() {
            return Ok(());
        }
        self.0.set_hold(None, Event::InspectionsResumed(by.initiator())).await
    }
}

impl Queue {
    async fn set_hold(&self, hold: Option<InspectionHold>, what: Event) -> Result<(), AppError> {
        let _turn = self.turn.lock().await;
        let before = self.hold.lock().clone();
        // The hold is effective at once: nothing starts while it is being stored.
        if hold.is_some() {
            self.hold.lock().clone_from(&hold);
        }
        let value = serde_json::to_value(&hold).unwrap_or_default();
        let setting = SettingRecord { name: HOLD.to_owned(), value, changed_at_ms: now_ms() };
        if let Err(error) =
            self.parts.catalogue.commit(vec![Change::PutSetting(setting), event("inspections", what)]).await
        {
            *self.hold.lock() = before;
            return Err(error.into());
        }
        *self.hold.lock() = hold;
        self.advance();
        Ok(())
    }
}
