//! Disk operations with a time limit: a hung network share blocks a thread, never the door.

use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::sync::Semaphore;

/// The disk did not answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Hung {
    /// Not within the limit. The thread is abandoned; it goes on when the share answers again.
    #[error("the folder {folder} has not answered for {} s: the share hangs or is disconnected", limit.as_secs())]
    Silent {
        /// Which.
        folder: String,
        /// The limit.
        limit: Duration,
    },
    /// The operation panicked.
    #[error("an operation on the folder {folder} failed: see the log of the server")]
    Failed {
        /// Which.
        folder: String,
    },
}

/// Runs disk operations one at a time. While an abandoned one still hangs, no further thread is started.
#[derive(Debug, Clone)]
pub struct TimeLimit {
    folder: String,
    limit: Duration,
    turn: Arc<Semaphore>,
}

impl TimeLimit {
    /// For operations on this folder.
    pub fn new(folder: String, limit: Duration) -> Self {
        Self { folder, limit, turn: Arc::new(Semaphore::new(1)) }
    }

    /// Runs `work` on a thread of its own, after those before it.
    ///
    /// # Errors
    /// It did not end within the limit, including the time that it waited for its turn.
    pub async fn run<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Result<T, Hung> {
        let Self { folder, limit, turn } = self.clone();
        let in_turn = async {
            // Never closed.
            let permit = turn.acquire_owned().await;
            let name = folder.clone();
            let timed = move || {
                let (begun, _permit) = (Instant::now(), permit);
                let done = work();
                if begun.elapsed() > limit {
                    let seconds = begun.elapsed().as_secs();
                    tracing::warn!(folder = name, seconds, "an abandoned disk operation has ended");
                }
                done
            };
            tokio::task::spawn_blocking(timed).await
        };
        match tokio::time::timeout(limit, in_turn).await {
            Ok(Ok(done)) => Ok(done),
            Ok(Err(error)) => {
                tracing::error!(folder, %error, "a disk operation failed");
                Err(Hung::Failed { folder })
            }
            Err(_) => {
                tracing::warn!(
                    folder,
                    seconds = limit.as_secs(),
                    "a disk operation hangs; its thread is abandoned"
                );
                Err(Hung::Silent { folder, limit })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::mpsc::channel;

    use super::*;

    const SHORT: Duration = Duration::from_millis(50);

    #[tokio::test]
    async fn a_hung_operation_is_abandoned_and_no_second_one_starts_beside_it() {
        let limit = TimeLimit::new("/mnt/mes".to_owned(), SHORT);
        let (answer, hanging) = channel::<()>();
        let hung = limit.run(move || hanging.recv().ok()).await.unwrap_err();
        assert!(hung.to_string().contains("/mnt/mes"), "{hung}");
        let n_started = Arc::new(AtomicUsize::new(0));
        for _ in 0..3 {
            let counter = n_started.clone();
            limit.run(move || counter.fetch_add(1, Ordering::SeqCst)).await.unwrap_err();
        }
        assert_eq!(n_started.load(Ordering::SeqCst), 0);
        answer.send(()).unwrap();
        let counter = n_started.clone();
        while limit
            .run({
                let counter = counter.clone();
                move || counter.fetch_add(1, Ordering::SeqCst)
            })
            .await
            .is_err()
        {}
        assert_eq!(n_started.load(Ordering::SeqCst), 1);
    }

    #[tokio::test]
    async fn a_panic_is_an_error_and_the_next_operation_runs() {
        let limit = TimeLimit::new("/mnt/mes".to_owned(), Duration::from_secs(60));
        let failed = limit.run(|| panic!("planted")).await.unwrap_err();
        assert_eq!(failed, Hung::Failed { folder: "/mnt/mes".to_owned() });
        assert_eq!(limit.run(|| 7).await, Ok(7));
    }
}
