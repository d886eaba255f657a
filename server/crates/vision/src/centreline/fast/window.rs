//! Parts of columns laid side by side, each about its own row.

use crate::centreline::view::{Level, View};

/// Columns measured side by side.
pub const LANES: usize = 16;

/// A column and the row about which it is looked at.
#[derive(Debug, Clone, Copy, Default)]
pub struct Place {
    /// Column.
    pub u: usize,
    /// Row.
    pub v: usize,
}

/// Fills `rows` with the pixels of every place from `reach` rows above to `reach` below it. Beyond the image its border
/// is repeated.
#[inline(always)]
pub fn straighten<T: Level>(view: &View<T>, places: &[Place; LANES], reach: usize, rows: &mut [[T; LANES]]) {
    let n = 2 * reach + 1;
    let rows = &mut rows[..n];
    let inside = |place: &Place| place.v >= reach && place.v + reach < view.height;
    if !places.iter().all(inside) {
        for (k, row) in rows.iter_mut().enumerate() {
            for (level, place) in row.iter_mut().zip(places) {
                let v = (place.v + k).saturating_sub(reach).min(view.height - 1);
                *level = view.pixels[v * view.width + place.u];
            }
        }
        return;
    }
    let starts: [usize; LANES] = std::array::from_fn(|i| (places[i].v - reach) * view.width + places[i].u);
    if (1..LANES).all(|i| starts[i] == starts[0] + i) {
        for (k, row) in rows.iter_mut().enumerate() {
            row.copy_from_slice(&view.pixels[starts[0] + k * view.width..][..LANES]);
        }
        return;
    }
    let last = starts.iter().fold(0, |a, &b| a.max(b)) + 1;
    for (k, row) in rows.iter_mut().enumerate() {
        // One slice per row of windows: its end bounds every lane.
        let levels = &view.pixels[k * view.width..k * view.width + last];
        *row = std::array::from_fn(|lane| levels[starts[lane]]);
    }
}
