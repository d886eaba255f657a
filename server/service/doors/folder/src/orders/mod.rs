//! Orders: files in a folder that start inspections, each order exactly once.
//!
//! A file is read once it has not changed between two polls. Each of its orders is started together with a stored key,
//! then the file is moved to `accepted/`, then the keys are freed. After a crash at any point the file is read again, and
//! what has a key is not started again. Before anything is started, it is made sure that the file can be moved. A file
//! with an order that is refused goes to `refused/`, with a text that says why; the keys of its other orders remain, so
//! that the corrected file does not repeat them. An order that the station cannot accept now waits, and those after it.

mod files;
mod inspections;
mod order;
mod refused;
#[cfg(test)]
mod tests;

pub use inspections::{AppInspections, Inspections};

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use app::error::AppError;

use crate::disk::{Disk, DiskError};
use crate::orders::files::{Found, Stamp};
use crate::orders::inspections::{is_temporary, key};
use crate::orders::order::{Order, Refusal};
use crate::params::{DISK_LIMIT, POLL_PERIOD};
use crate::time_limit::{Hung, TimeLimit};

/// The folder of orders.
pub struct Orders {
    door: String,
    folder: PathBuf,
    disk: Arc<dyn Disk>,
    inspections: Arc<dyn Inspections>,
    limit: TimeLimit,
    /// The files as the last poll found them.
    seen: HashMap<PathBuf, Stamp>,
    /// The file that can be moved, as checked before its first order was started.
    movable: Option<Found>,
    /// Keys of what was started and is not known to be moved.
    started: HashSet<String>,
    /// What the log says about waiting orders.
    waiting: Option<String>,
}

/// Why a file stays in the folder.
struct Waits {
    /// The same for the same cause: it is logged once.
    cause: String,
    reason: String,
    /// Whether the files after it wait, too.
    holds_up_others: bool,
}

impl Orders {
    /// Orders in this folder, started on behalf of a door.
    pub fn new(door: &str, folder: PathBuf, disk: Arc<dyn Disk>, inspections: Arc<dyn Inspections>) -> Self {
        let limit = TimeLimit::new(folder.display().to_string(), DISK_LIMIT);
        Self {
            door: door.to_owned(),
            folder,
            disk,
            inspections,
            limit,
            seen: HashMap::new(),
            movable: None,
            started: HashSet::new(),
            waiting: None,
        }
    }

    /// Reads orders until it is dropped.
    pub async fn watch(&mut self) {
        loop {
            self.poll().await;
            tokio::time::sleep(POLL_PERIOD).await;
        }
    }

    /// Takes the files that have not changed since the last poll, oldest first.
    async fn poll(&mut self) {
        let mut waiting = None;
        match self.ready().await {
            Err(waits) => waiting = Some(waits),
            Ok(ready) => {
                for file in ready {
                    let Err(waits) = self.take(file).await else { continue };
                    let holds_up_others = waits.holds_up_others;
                    waiting.get_or_insert(waits);
                    if holds_up_others {
                        break;
                    }
                }
            }
        }
        self.log(waiting);
    }

    async fn ready(&mut self) -> Result<Vec<Found>, Waits> {
        let folder = self.folder.clone();
        let found = self.on_disk(move |_| files::found(&folder)).await?;
        let seen = found.iter().map(|file| (file.path.clone(), file.stamp)).collect();
        let before = std::mem::replace(&mut self.seen, seen);
        let is_unchanged = |file: &Found| before.get(&file.path) == Some(&file.stamp);
        Ok(found.into_iter().filter(is_unchanged).collect())
    }

    async fn take(&mut self, file: Found) -> Result<(), Waits> {
        let (found, folder) = (file.clone(), self.folder.clone());
        let read = self.on_disk(move |_| Ok(files::read(&found))).await?;
        // One unreadable file, perhaps still locked by its writer, does not hold up the others.
        let unreadable = |error: DiskError| Waits { holds_up_others: false, ..error.into() };
        let Some(content) = read.map_err(unreadable)? else { return Ok(()) };
        let orders = match content.and_then(|bytes| order::orders(file.format, &bytes)) {
            Ok(orders) => orders,
            Err(refusal) => return self.refuse(file, &[refusal], &[]).await,
        };
        if self.movable.as_ref() != Some(&file) {
            self.on_disk(move |disk| files::check_movable(disk, &folder)).await?;
            self.movable = Some(file.clone());
        }
        let (keys, refusals) = self.start_all(&file, &orders).await?;
        match refusals.is_empty() {
            true => self.accept(file, keys).await,
            false => self.refuse(file, &refusals, &keys).await,
        }
    }

    /// Starts what has not been started yet; returns the keys of all that was, and what is refused.
    async fn start_all(&mut self, file: &Found, orders: &[Order]) -> Result<(Vec<String>, Vec<Refusal>), Waits> {
        let (mut keys, mut refusals, mut n_equal) = (Vec::new(), Vec::new(), HashMap::new());
        for order in orders {
            let n: &mut usize = n_equal.entry(order.identity.as_str()).or_default();
            *n += 1;
            let key = key(&self.door, &file.name, order, *n);
            match self.start(file, order, &key).await {
                Ok(()) => keys.push(key),
                Err(error) if is_temporary(error.kind) => return Err(error.into()),
                Err(error) => refusals.push(Refusal::from_error(order.row, error)),
            }
        }
        Ok((keys, refusals))
    }

    async fn start(&mut self, file: &Found, order: &Order, key: &str) -> Result<(), AppError> {
        if self.started.contains(key) {
            return Ok(());
        }
        if !self.inspections.is_started(key).await? {
            self.inspections.start(&file.name, order, key).await?;
            tracing::info!(
                door = self.door,
                file = file.name,
                serial = order.part.serial,
                "an order was accepted"
            );
        }
        self.started.insert(key.to_owned());
        Ok(())
    }

    async fn accept(&mut self, file: Found, keys: Vec<String>) -> Result<(), Waits> {
        let folder = self.folder.clone();
        let is_moved = self.on_disk(move |disk| files::accept(disk, &folder, &file)).await?;
        if !is_moved {
            return Ok(());
        }
        for key in keys {
            self.started.remove(&key);
            // It expires later; until then the same order in a file of the same name is taken for a repetition.
            if let Err(error) = self.inspections.release(&key).await {
                tracing::warn!(door = self.door, key, error = error.detail, "the key of an order remains stored");
            }
        }
        Ok(())
    }

    async fn refuse(&mut self, file: Found, refusals: &[Refusal], accepted: &[String]) -> Result<(), Waits> {
        let (folder, name) = (self.folder.clone(), file.name.clone());
        let why = refused::note(&name, refusals, accepted.len());
        if self.on_disk(move |disk| files::refuse(disk, &folder, &file, &why)).await? {
            // The stored keys remain.
            self.started.retain(|key| !accepted.contains(key));
            let reason = refusals.first().map(ToString::to_string);
            tracing::warn!(door = self.door, file = name, reason, "a file with orders was refused");
        }
        Ok(())
    }

    async fn on_disk<T: Send + 'static>(
        &self,
        work: impl FnOnce(&dyn Disk) -> Result<T, DiskError> + Send + 'static,
    ) -> Result<T, Waits> {
        let disk = self.disk.clone();
        Ok(self.limit.run(move || work(&*disk)).await??)
    }

    /// One line when orders begin to wait for another reason, and one when they no longer do.
    fn log(&mut self, waits: Option<Waits>) {
        let (door, folder) = (&self.door, folder_name(&self.folder));
        match &waits {
            Some(waits) if self.waiting.as_ref() == Some(&waits.cause) => return,
            Some(waits) => tracing::warn!(door, folder, reason = waits.reason, "orders wait"),
            None if self.waiting.is_some() => tracing::info!(door, folder, "orders no longer wait"),
            None => {}
        }
        self.waiting = waits.map(|waits| waits.cause);
    }
}

fn folder_name(folder: &Path) -> String {
    folder.display().to_string()
}

impl From<AppError> for Waits {
    fn from(error: AppError) -> Self {
        let reason =
            error.cause.as_ref().map_or_else(|| error.detail.clone(), |why| format!("{}: {why}", error.detail));
        Self { cause: format!("{:?}", error.kind), reason, holds_up_others: true }
    }
}

impl From<DiskError> for Waits {
    fn from(error: DiskError) -> Self {
        Self { cause: error.to_string(), reason: error.to_string(), holds_up_others: true }
    }
}

impl From<Hung> for Waits {
    fn from(hung: Hung) -> Self {
        Self { cause: hung.to_string(), reason: hung.to_string(), holds_up_others: true }
    }
}
