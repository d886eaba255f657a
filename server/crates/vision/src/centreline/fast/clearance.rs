//! How far the nearest other line is, for every step of every trace.

use crate::centreline::reference::segments::Trace;
use crate::params::RIVAL_CONTRAST;

/// One step, where all steps of a column lie together.
#[derive(Clone, Copy, Default)]
struct Entry {
    v: f32,
    contrast: f32,
    trace: u32,
    step: u32,
}

/// All steps column by column; their memory is kept from image to image.
#[derive(Default)]
pub struct Columns {
    starts: Vec<u32>,
    entries: Vec<Entry>,
}

/// Notes at every step how far the nearest other trace is that is bright enough to matter.
#[inline(always)]
pub fn mark_clearances(traces: &mut [Trace], width: usize, columns: &mut Columns) {
    let Columns { starts, entries } = columns;
    starts.clear();
    starts.resize(width + 2, 0);
    for trace in &*traces {
        for n in &mut starts[trace.first_u + 2..trace.first_u + 2 + trace.len()] {
            *n += 1;
        }
    }
    // starts[u + 1] is where column u goes on; when all are placed, it is where column u ends.
    for u in 1..starts.len() {
        starts[u] += starts[u - 1];
    }
    entries.clear();
    entries.resize(starts[width + 1] as usize, Entry::default());
    for (trace_idx, trace) in traces.iter().enumerate() {
        for (idx, (&v, &contrast)) in trace.v.iter().zip(&trace.contrast).enumerate() {
            let place = &mut starts[trace.first_u + idx + 1];
            entries[*place as usize] = Entry { v, contrast, trace: trace_idx as u32, step: idx as u32 };
            *place += 1;
        }
    }
    for u in 0..width {
        let column = &mut entries[starts[u] as usize..starts[u + 1] as usize];
        if column.len() < 2 {
            continue;
        }
        if !column.is_sorted_by(|a, b| a.v <= b.v) {
            column.sort_by(|a, b| a.v.total_cmp(&b.v));
        }
        for i in 0..column.len() {
            let here = column[i];
            let distance = |other: Option<&Entry>| match other {
                Some(other) if other.contrast >= RIVAL_CONTRAST * here.contrast => (other.v - here.v).abs(),
                _ => f32::INFINITY,
            };
            let clearance_px = distance(i.checked_sub(1).map(|k| &column[k])).min(distance(column.get(i + 1)));
            traces[here.trace as usize].clearance_px[here.step as usize] = clearance_px;
        }
    }
}
