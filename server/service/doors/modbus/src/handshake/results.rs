//! The result that is shown, until it is acknowledged.

use std::collections::VecDeque;
use std::net::IpAddr;
use std::time::Instant;

use crate::handshake::params::LOW_AT_MOST;
use crate::registers::result_block::{ResultBlock, no_result};

/// The result that is shown, and those behind it.
pub struct Results {
    shown: Option<Shown>,
    nothing: Vec<u16>,
    /// Events of results behind the one shown.
    behind: VecDeque<i64>,
}

struct Shown {
    event_seq: i64,
    block: ResultBlock,
    /// Set once it is no longer valid.
    low: Option<Low>,
}

/// Valid is 0, until the PLC has seen that.
struct Low {
    since: Instant,
    acknowledged: bool,
    /// Who acknowledged; `None`: nobody.
    by: Option<IpAddr>,
    seen: bool,
}

/// The outcome of offering a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offer {
    /// It is shown, or waits until it can be.
    Waits,
    /// The PLC has acknowledged it.
    Acknowledged,
}

impl Default for Results {
    fn default() -> Self {
        Self { shown: None, nothing: no_result(), behind: VecDeque::new() }
    }
}

impl Results {
    /// Shows a result as soon as valid was 0 after the one before; to be repeated until it is acknowledged. An
    /// acknowledgement in between is remembered.
    pub fn offer(&mut self, event_seq: i64, block: &ResultBlock, now: Instant) -> Offer {
        if let Some(shown) = &mut self.shown {
            match &shown.low {
                None if shown.event_seq == event_seq => return Offer::Waits,
                Some(low) if shown.event_seq == event_seq && low.acknowledged => return Offer::Acknowledged,
                // It was given up for another one.
                None => {
                    shown.low = Some(Low { since: now, acknowledged: false, by: None, seen: false });
                    return Offer::Waits;
                }
                Some(low) if !low.seen && now.duration_since(low.since) < LOW_AT_MOST => return Offer::Waits,
                Some(_) => {}
            }
        }
        self.replace(event_seq, block);
        Offer::Waits
    }

    /// Shows a result at once, in place of the one before.
    pub fn replace(&mut self, event_seq: i64, block: &ResultBlock) {
        self.shown = Some(Shown { event_seq, block: block.clone(), low: None });
        self.behind.retain(|behind| *behind > event_seq);
    }

    /// The PLC has written `result_ack`. Any other number than that of a valid result changes nothing.
    pub fn acknowledge(&mut self, result_seq: u32, from: IpAddr, now: Instant) {
        if let Some(shown) = &mut self.shown
            && shown.low.is_none()
            && u32::from(shown.block.seq) == result_seq
        {
            shown.low = Some(Low { since: now, acknowledged: true, by: Some(from), seen: false });
        }
    }

    /// The status was read from this address.
    pub fn status_read(&mut self, from: IpAddr) {
        if let Some(low) = self.shown.as_mut().and_then(|shown| shown.low.as_mut()) {
            low.seen |= low.by.is_none_or(|by| by == from);
        }
    }

    /// A result that will be delivered.
    pub fn note(&mut self, event_seq: i64) {
        if self.shown.as_ref().is_none_or(|shown| shown.event_seq < event_seq) {
            self.behind.push_back(event_seq);
        }
    }

    /// Number of results behind the one shown.
    pub fn n_behind(&self) -> usize {
        self.behind.len()
    }

    /// Whether a result is shown and not acknowledged.
    pub fn is_valid(&self) -> bool {
        self.shown.as_ref().is_some_and(|shown| shown.low.is_none())
    }

    /// Whether the devices of the result shown were simulated.
    pub fn is_simulated(&self) -> bool {
        self.shown.as_ref().is_some_and(|shown| shown.block.simulated)
    }

    /// The registers of the result shown; an acknowledged one stays until the next one.
    pub fn image(&self) -> &[u16] {
        self.shown.as_ref().map_or(&self.nothing, |shown| &shown.block.image)
    }
}
