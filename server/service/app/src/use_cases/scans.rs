//! Stored scans.

use store::Change;

use crate::App;
use crate::access::principal::Principal;
use crate::error::AppError;
use crate::events::{Event, event};

/// Deletes a scan and its measurements.
///
/// # Errors
/// If it does not exist.
pub async fn delete_scan(app: &App, by: &Principal, id: String) -> Result<(), AppError> {
    let gone = event(&id, Event::ScanDeleted(by.initiator()));
    app.catalogue.commit(vec![Change::DeleteScan(id), gone]).await?;
    Ok(())
}
