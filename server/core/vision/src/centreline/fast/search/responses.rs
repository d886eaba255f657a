//! Contrast of the boxes of a strip against both flanks, row by row.

use std::ops::Range;

use super::cells::Strip;
use crate::centreline::lines::candidates::Boxes;
use crate::centreline::view::{Level, Sum, View};
use crate::params::STRIP_WIDTH_PX;

/// The columns of a strip side by side.
pub type Lanes<T> = [<T as Level>::Sum; STRIP_WIDTH_PX];

/// The responses of some rows of a strip; its memory is reused.
#[derive(Default)]
pub struct Responses<T: Level> {
    prefix: Vec<Lanes<T>>,
    response: Vec<Lanes<T>>,
}

impl<T: Level> Responses<T> {
    /// Box sum minus the brighter flank's, for the rows and one beyond either end, zero outside the image; near the
    /// upper and lower edge only the flank inside the image counts.
    #[inline(always)]
    pub fn find(&mut self, view: &View<T>, boxes: Boxes, strip: &Strip, rows: &Range<usize>) {
        let Boxes { half_height: half, flank } = boxes;
        let last = view.height - 1;
        let (from, to) = (rows.start.saturating_sub(1), (rows.end + 1).min(last + 1));
        let top = from.saturating_sub(flank);
        let bottom = (to - 1 + flank).min(last);
        self.sum_up(view, strip, top, half, bottom - top + 2 * half + 1);
        let zero = [T::Sum::default(); STRIP_WIDTH_PX];
        self.response.resize(rows.len() + 2, zero);
        self.response[0] = zero;
        self.response[rows.len() + 1] = zero;
        let (n, height) = (to - from, 2 * half + 1);
        let responses = &mut self.response[from + 1 - rows.start..][..n];
        let sums = |first: usize| self.prefix[first..first + n].as_flattened();
        if from >= flank && to + flank <= last + 1 {
            let here = (sums(flank + height), sums(flank));
            let beside = [(sums(height), sums(0)), (sums(2 * flank + height), sums(2 * flank))];
            contrasts::<T>(here, beside, responses.as_flattened_mut());
        } else {
            for (response, v) in responses.iter_mut().zip(from..to) {
                let boxed = |v: usize| (&self.prefix[v - top + height][..], &self.prefix[v - top][..]);
                let above = boxed(if v >= flank { v - flank } else { (v + flank).min(last) });
                let below = boxed(if v + flank <= last { v + flank } else { v.saturating_sub(flank) });
                contrasts::<T>(boxed(v), [above, below], response);
            }
        }
    }

    /// The responses of the rows and of one row beyond either end.
    pub fn rows(&self) -> &[Lanes<T>] {
        &self.response
    }

    /// `prefix[k]` is the sum of the rows before top − half + k; rows beyond the image repeat its border.
    #[inline(always)]
    fn sum_up(&mut self, view: &View<T>, strip: &Strip, top: usize, half: usize, n: usize) {
        let last = view.height - 1;
        let mut sum = [T::Sum::default(); STRIP_WIDTH_PX];
        self.prefix.resize(n + 1, sum);
        self.prefix[0] = sum;
        let (first, beyond) = (top.wrapping_sub(half), top + n - half);
        let is_whole = strip.u1 - strip.u0 == STRIP_WIDTH_PX;
        if top >= half && beyond <= last + 1 && is_whole {
            let rows = view.pixels[first * view.width..].chunks_exact(view.width);
            for (prefix, row) in self.prefix[1..].iter_mut().zip(rows) {
                let levels = &row[strip.u0..strip.u0 + STRIP_WIDTH_PX];
                for i in 0..STRIP_WIDTH_PX {
                    sum[i] = sum[i].plus(levels[i].sum());
                }
                *prefix = sum;
            }
        } else {
            for (k, prefix) in self.prefix[1..].iter_mut().enumerate() {
                let v = (top + k).saturating_sub(half).min(last);
                let row = &view.pixels[v * view.width + strip.u0..v * view.width + strip.u1];
                sum.iter_mut().zip(row).for_each(|(sum, level)| *sum = sum.plus(level.sum()));
                *prefix = sum;
            }
        }
    }
}

/// Box sums minus the brighter of the two neighbouring boxes, each given by the running sums after and before it,
/// element by element.
#[inline(always)]
fn contrasts<T: Level>(here: Ends<T>, beside: [Ends<T>; 2], contrasts: &mut [T::Sum]) {
    let n = contrasts.len();
    let [above, below] = beside;
    let (behind, before) = (&here.0[..n], &here.1[..n]);
    let (behind_above, before_above) = (&above.0[..n], &above.1[..n]);
    let (behind_below, before_below) = (&below.0[..n], &below.1[..n]);
    for i in 0..n {
        let flank = behind_above[i].minus(before_above[i]).max(behind_below[i].minus(before_below[i]));
        contrasts[i] = behind[i].minus(before[i]).minus(flank);
    }
}

/// Running sums after and before boxes.
type Ends<'a, T> = (&'a [<T as Level>::Sum], &'a [<T as Level>::Sum]);
