//! How people set the camera, kept over restarts and lost cables.
//!
//! Only what somebody asked for is kept, with the value that the camera accepted; jobs set the camera for themselves and
//! give it back as it was.

use devices::CameraRequest;
use serde_json::{Map, Value, json};
use station::wall_clock::now_ms;
use station::{Manual, StationHandle};
use store::{Change, SettingRecord, StoreError};

use crate::http::dto::devices::{CameraSettingsDto, ChangeCameraDto};
use crate::ledger::Ledger;

/// The name of the setting.
const SETTING: &str = "camera.settings";

/// Keeps what was `asked` for, as it was `accepted`.
pub async fn remember(
    ledger: &Ledger,
    asked: &ChangeCameraDto,
    accepted: &CameraSettingsDto,
) -> Result<(), StoreError> {
    let (asked, accepted) = (json!(asked), json!(accepted));
    let kept = ledger.read().setting(SETTING).await?;
    let mut kept = kept.map_or_else(|| Value::Object(Map::new()), |setting| setting.value);
    let names = asked.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null());
    for (name, _) in names {
        kept[name] = accepted[name].clone();
    }
    let setting = SettingRecord { name: SETTING.to_owned(), value: kept, changed_at_ms: now_ms() };
    ledger.commit(vec![Change::PutSetting(setting)]).await?;
    Ok(())
}

/// Sets the camera as it was kept; one that is not there is set once it is.
pub async fn restore(ledger: &Ledger, station: &StationHandle) {
    let kept = match ledger.read().setting(SETTING).await {
        Ok(Some(setting)) => setting.value,
        Ok(None) => return,
        Err(error) => return tracing::error!(%error, "how the camera was set cannot be read"),
    };
    let wanted = match serde_json::from_value::<ChangeCameraDto>(kept) {
        Ok(wanted) => CameraRequest::from(wanted),
        Err(error) => return tracing::error!(%error, "how the camera was set cannot be used"),
    };
    if let Err(refusal) = station.manual(Manual::Configure(wanted)).await {
        tracing::warn!(%refusal, "the camera is not set as it was");
    }
}

/// Sets the camera anew whenever it comes back; ends with the station.
pub async fn follow(ledger: Ledger, station: StationHandle) {
    let mut status = station.watch_status();
    loop {
        if status.wait_for(|status| !status.camera.connected).await.is_err()
            || status.wait_for(|status| status.camera.connected).await.is_err()
        {
            return;
        }
        restore(&ledger, &station).await;
    }
}
