//! Threads of the live view: named, with their own timer, ended when their owner is dropped.

use std::io;
use std::thread::JoinHandle;

use tokio::sync::watch;

/// A running thread.
pub struct Worker {
    ended: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// Runs the future of `work` on a named thread until it completes or this is dropped; then the future is dropped at
    /// its next await point.
    pub fn spawn<W, F>(name: &str, work: W) -> io::Result<Self>
    where
        W: FnOnce() -> F + Send + 'static,
        F: Future<Output = ()>,
    {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build()?;
        let ended = watch::Sender::new(false);
        let mut end = ended.subscribe();
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    () = work() => {}
                    _ = end.wait_for(|ended| *ended) => {}
                }
            });
        })?;
        Ok(Self { ended, thread: Some(thread) })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.ended.send_replace(true);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("a thread of the live view ended with a panic");
        }
    }
}
