//! The folder as a door.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use app::App;
use app::doors::{BadSetting, Delivery, Door, EventFilter, EventRecord, Undelivered};
use app::inspections::offset_now;
use async_trait::async_trait;

use crate::disk::{Disk, LocalDisk, probe, remove_abandoned};
use crate::orders::{AppInspections, Orders};
use crate::params::DISK_LIMIT;
use crate::results::{FileName, documents, write_all};
use crate::settings::{Format, Settings};
use crate::time_limit::TimeLimit;

/// The event that announces an inspection.
const INSPECTION_FINISHED: &str = "inspection.finished";

/// Opens the door. The folders need not exist yet.
///
/// # Errors
/// A setting cannot be used.
pub fn open(settings: Settings) -> Result<Arc<dyn Door>, BadSetting> {
    Ok(Arc::new(Folder::new(settings, Arc::new(LocalDisk), DISK_LIMIT)?))
}

struct Folder {
    settings: Settings,
    file_name: FileName,
    filter: EventFilter,
    disk: Arc<dyn Disk>,
    limit: TimeLimit,
    /// Whether files of an earlier run were removed.
    is_clean: Arc<AtomicBool>,
}

impl Folder {
    fn new(settings: Settings, disk: Arc<dyn Disk>, limit: Duration) -> Result<Self, BadSetting> {
        settings.check()?;
        let file_name = FileName::parse(&settings.file_name)?;
        let filter = EventFilter::new(vec![INSPECTION_FINISHED.to_owned()], settings.recipes.clone())?;
        if settings.formats.contains(&Format::Dfq) {
            let zone = offset_now().map_or("unknown: UTC is used".to_owned(), |offset| format!("UTC{offset}"));
            tracing::info!(door = settings.name, zone, "times in Q-DAS files are local times");
        }
        let limit = TimeLimit::new(settings.path.display().to_string(), limit);
        Ok(Self { settings, file_name, filter, disk, limit, is_clean: Arc::default() })
    }

    /// Runs on a thread of its own.
    fn work(&self, delivery: &Delivery) -> impl FnOnce() -> Result<(), Undelivered> + Send + 'static {
        let (disk, folder, is_clean) = (self.disk.clone(), self.settings.path.clone(), self.is_clean.clone());
        let files = delivery.inspection.as_ref().map(|inspection| {
            (self.file_name.stem(inspection), documents(&self.settings.formats, delivery, inspection))
        });
        move || {
            clean(&folder, &is_clean);
            match files {
                Some((stem, Some(documents))) => write_all(&*disk, &folder, &stem, &documents),
                Some((_, None)) => Err(Undelivered::Refused("the report is missing".to_owned())),
                // A test leaves no file that somebody would read as a result.
                None => probe(&*disk, &folder).map_err(|error| Undelivered::unreachable(error.to_string())),
            }
        }
    }
}

/// Once after the start, as soon as the folder can be read.
fn clean(folder: &Path, is_clean: &AtomicBool) {
    if is_clean.load(Ordering::SeqCst) {
        return;
    }
    match remove_abandoned(folder) {
        Ok(()) => is_clean.store(true, Ordering::SeqCst),
        Err(error) => tracing::debug!(%error, "abandoned files remain"),
    }
}

#[async_trait]
impl Door for Folder {
    fn name(&self) -> &str {
        &self.settings.name
    }

    fn kind(&self) -> &'static str {
        "folder"
    }

    fn target(&self) -> String {
        self.settings.path.display().to_string()
    }

    fn wants(&self, event: &EventRecord) -> bool {
        self.filter.matches(event)
    }

    fn wants_report(&self) -> bool {
        self.settings.formats.contains(&Format::Pdf)
    }

    async fn deliver(&self, delivery: &Delivery) -> Result<(), Undelivered> {
        match self.limit.run(self.work(delivery)).await {
            Ok(outcome) => outcome,
            Err(hung) => Err(Undelivered::unreachable(hung.to_string())),
        }
    }

    async fn serve(self: Arc<Self>, app: App) {
        let Some(folder) = self.settings.orders.clone() else { return };
        let (closing, inspections) = (app.closing.clone(), AppInspections::new(app, self.name()));
        let mut orders = Orders::new(self.name(), folder, self.disk.clone(), Arc::new(inspections));
        tokio::select! {
            () = closing.cancelled() => {}
            () = orders.watch() => {}
        }
    }
}

#[cfg(test)]
mod tests;
