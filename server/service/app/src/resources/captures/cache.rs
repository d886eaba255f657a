//! Cache of unpacked captures: folders that may be deleted whenever they are not in use.

use parking_lot::Mutex;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folders by the id of their archive.
#[derive(Clone)]
pub(super) struct Cache(Arc<Mutex<Shelf>>);

struct Shelf {
    folder: PathBuf,
    limit_bytes: u64,
    kept: HashMap<String, Kept>,
    clock: u64,
}

struct Kept {
    size_bytes: u64,
    n_users: usize,
    used_at: u64,
}

/// A folder in use; it is kept until this is dropped.
pub(super) struct InUse {
    cache: Cache,
    key: String,
}

impl Cache {
    /// A cache in `folder`; leftovers of an earlier process are removed.
    pub fn new(folder: &Path, limit_bytes: u64) -> std::io::Result<Self> {
        match std::fs::remove_dir_all(folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => std::fs::create_dir_all(folder)?,
        }
        let shelf = Shelf { folder: folder.to_owned(), limit_bytes, kept: HashMap::new(), clock: 0 };
        Ok(Self(Arc::new(Mutex::new(shelf))))
    }

    /// The folder of `key`, if cached.
    pub fn get(&self, key: &str) -> Option<(PathBuf, InUse)> {
        self.with(|shelf| {
            shelf.clock += 1;
            let folder = shelf.folder.join(key);
            let kept = shelf.kept.get_mut(key)?;
            if kept.n_users == 0 && !folder.is_dir() {
                // Deleted manually.
                shelf.kept.remove(key);
                return None;
            }
            (kept.used_at, kept.n_users) = (shelf.clock, kept.n_users + 1);
            Some((folder, InUse { cache: self.clone(), key: key.to_owned() }))
        })
    }

    /// A temporary folder for a new entry.
    pub fn draft(&self) -> PathBuf {
        self.with(|shelf| shelf.folder.join(format!("{}.part", uuid::Uuid::now_v7())))
    }

    /// Adds the finished `draft` as the folder of `key`, and evicts the least recently used folders beyond the limit.
    pub fn put(&self, key: &str, draft: &Path, size_bytes: u64) -> std::io::Result<(PathBuf, InUse)> {
        let target = self.with(|shelf| {
            let target = shelf.folder.join(key);
            if shelf.kept.contains_key(key) {
                std::fs::remove_dir_all(draft)?;
            } else {
                std::fs::rename(draft, &target)?;
            }
            shelf.clock += 1;
            let used_at = shelf.clock;
            let kept = shelf.kept.entry(key.to_owned()).or_insert(Kept { size_bytes, n_users: 0, used_at });
            (kept.used_at, kept.n_users) = (used_at, kept.n_users + 1);
            Ok::<PathBuf, std::io::Error>(target)
        })?;
        self.with(Shelf::shrink);
        Ok((target, InUse { cache: self.clone(), key: key.to_owned() }))
    }

    /// Removes the folders that are not in use and not in `keep`.
    pub fn retain(&self, keep: impl Fn(&str) -> bool) {
        self.with(|shelf| {
            let gone = shelf.kept.iter().filter(|(key, kept)| kept.n_users == 0 && !keep(key));
            let gone: Vec<String> = gone.map(|(key, _)| key.clone()).collect();
            gone.iter().for_each(|key| shelf.remove(key));
        });
    }

    fn with<T>(&self, act: impl FnOnce(&mut Shelf) -> T) -> T {
        act(&mut self.0.lock())
    }
}

impl Shelf {
    fn shrink(&mut self) {
        while self.kept.values().map(|kept| kept.size_bytes).sum::<u64>() > self.limit_bytes {
            let idle = self.kept.iter().filter(|(_, kept)| kept.n_users == 0);
            let Some(oldest) = idle.min_by_key(|(_, kept)| kept.used_at).map(|(key, _)| key.clone()) else {
                return;
            };
            self.remove(&oldest);
        }
    }

    fn remove(&mut self, key: &str) {
        self.kept.remove(key);
        if let Err(error) = std::fs::remove_dir_all(self.folder.join(key)) {
            tracing::warn!(%error, "an unpacked capture cannot be removed");
        }
    }
}

impl Drop for InUse {
    fn drop(&mut self) {
        self.cache.with(|shelf| {
            if let Some(kept) = shelf.kept.get_mut(&self.key) {
                kept.n_users -= 1;
            }
            shelf.shrink();
        });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn put(cache: &Cache, key: &str) -> InUse {
        let draft = cache.draft();
        std::fs::create_dir(&draft).unwrap();
        cache.put(key, &draft, 10).unwrap().1
    }

    #[test]
    fn beyond_the_limit_the_least_recently_used_folder_is_evicted_and_one_in_use_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(&folder.path().join("cache"), 20).unwrap();
        let in_use = put(&cache, "a");
        drop(put(&cache, "b"));
        drop(put(&cache, "c"));
        let there = |key: &str| folder.path().join("cache").join(key).is_dir();
        assert_eq!(["a", "b", "c"].map(there), [true, false, true]);
        cache.retain(|_| false);
        assert_eq!(["a", "b", "c"].map(there), [true, false, false], "folders in use are kept");
        drop(put(&cache, "c"));
        cache.retain(|key| key == "c");
        drop(in_use);
        drop(put(&cache, "d"));
        assert_eq!(["a", "c", "d"].map(there), [false, true, true]);
        assert!(cache.get("a").is_none() && cache.get("d").is_some());
    }
}
