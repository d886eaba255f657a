//! The points of a scan, for one client.

use std::sync::Arc;

use axum::extract::ws::Message;
use live::protocol::text::{ServerText, Subscription};
use live::{LiveBus, PointLog, PointsSeen};
use tokio::sync::watch;

use crate::ws::feeds::{Next, changed, text};

/// The points of a scan: every block, in order, at the client's own speed.
pub struct PointsFeed {
    seen: watch::Receiver<PointsSeen>,
    log: Option<Arc<PointLog>>,
    next_block: u32,
    begun: bool,
    ended: bool,
}

impl PointsFeed {
    /// From a given block on, or from now on.
    pub fn new(wanted: &Subscription, live: &LiveBus) -> Self {
        let seen = live.watch_points();
        let (log, n_blocks) = {
            let now = seen.borrow();
            (now.log.clone(), now.n_blocks)
        };
        let next_block = wanted.from_block.map_or(n_blocks, |block| block.min(n_blocks));
        Self { seen, log, next_block, begun: false, ended: false }
    }

    /// The next block, or the start or end of a scan.
    pub fn next(&mut self) -> Next {
        let seen = self.seen.borrow_and_update().clone();
        let same = |log: &Arc<PointLog>| seen.log.as_ref().is_some_and(|newest| Arc::ptr_eq(newest, log));
        if let Some(log) = &self.log {
            let over = !(same(log) && seen.running);
            let first = !std::mem::replace(&mut self.begun, true);
            if first && (!over || self.next_block < log.n_blocks()) {
                return said(log, true, self.next_block);
            }
            if let Some(block) = log.block(self.next_block) {
                self.next_block += 1;
                return Next::Message(Message::Binary(block));
            }
            if over && !std::mem::replace(&mut self.ended, true) {
                return said(log, false, self.next_block);
            }
            if same(log) {
                return Next::Nothing;
            }
        }
        if seen.log.is_none() {
            return Next::Nothing;
        }
        (self.log, self.next_block, self.begun, self.ended) = (seen.log, 0, false, false);
        self.next()
    }

    /// Waits for something newer.
    pub async fn changed(&mut self) {
        changed(&mut self.seen).await;
    }
}

fn said(log: &PointLog, running: bool, next_block: u32) -> Next {
    text(&ServerText::Scan { scan_id: log.scan_id(), running, n_blocks: log.n_blocks(), next_block })
}
