//! Local maxima of all columns side by side; maxima too close to each other are merged.

use super::responses::Lanes;
use crate::centreline::view::{Level, Sum};
use crate::params::STRIP_WIDTH_PX;

/// The latest candidate of every column.
pub struct Latest<T: Level> {
    /// Row in the run.
    pub v: Lanes<T>,
    /// Response; zero while there is none.
    pub response: Lanes<T>,
    /// Row and response of the previous candidate.
    pub before: (Lanes<T>, Lanes<T>),
    separation: T::Sum,
}

impl<T: Level> Latest<T> {
    /// The state before the first row; of two candidates less than `separation` rows apart, one is kept.
    #[inline(always)]
    pub fn new(separation: u32) -> Self {
        let zero = [T::Sum::default(); STRIP_WIDTH_PX];
        Self { v: zero, response: zero, before: (zero, zero), separation: T::Sum::whole(separation as i32) }
    }

    /// `Some(true)` if every column has a candidate, `Some(false)` if none has, `None` otherwise.
    #[inline(always)]
    pub fn everywhere(&self) -> Option<bool> {
        let n = self.response.iter().map(|&response| u32::from(response > T::Sum::default())).sum::<u32>();
        match n as usize {
            0 => Some(false),
            STRIP_WIDTH_PX => Some(true),
            _ => None,
        }
    }

    /// Adds the responses of a row where `lead` is not negative; of two candidates that are too close, the stronger is
    /// kept. Returns non-negative lanes where the previous candidate became final.
    #[inline(always)]
    pub fn push_row(&mut self, lead: &Lanes<T>, response: &Lanes<T>, v: usize) -> Lanes<T> {
        let next = T::Sum::whole(v as i32 + 1).minus(self.separation);
        self.before = (self.v, self.response);
        let here = T::Sum::whole(v as i32);
        let mut done = *lead;
        for i in 0..STRIP_WIDTH_PX {
            // Negative where true.
            let is_far = self.v[i].minus(next);
            let is_stronger = self.response[i].minus(response[i]);
            let is_first = self.response[i].minus(T::Sum::ONE);
            let taken = is_far.or(is_stronger).or(is_first).and(lead[i].not()).sign();
            done[i] = is_far.and(is_first.not()).and(lead[i].not()).not();
            self.v[i] = here.and(taken).or(self.v[i].and(taken.not()));
            self.response[i] = response[i].and(taken).or(self.response[i].and(taken.not()));
        }
        done
    }
}

/// Whether any lane is zero or positive.
#[inline(always)]
pub fn any_from_zero<T: Level>(lanes: &Lanes<T>) -> bool {
    lanes.iter().fold(false, |any, &lane| any | (lane >= T::Sum::default()))
}

/// Lane by lane: the margin by which a response is at least the threshold, more than in the row before and at least
/// that of the row after; negative where it is not.
#[inline(always)]
pub fn lead<T: Level>(before: &Lanes<T>, here: &Lanes<T>, after: &Lanes<T>, threshold: T::Sum) -> Lanes<T> {
    let mut lead = *here;
    for i in 0..STRIP_WIDTH_PX {
        let over_rows = here[i].minus(before[i]).minus(T::Sum::ONE).min(here[i].minus(after[i]));
        lead[i] = here[i].minus(threshold).min(over_rows);
    }
    lead
}
