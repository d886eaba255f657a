//! Surface strips: pieces of the same line, tracked from frame to frame without a weak joint.

use std::collections::BTreeMap;

use super::hypotheses::Samples;
use super::reference_view::ReferenceView;
use super::tracks::Partners;
use crate::label::pieces::Piece;
use crate::label::union_find::UnionFind;
use crate::params::{
    SMOOTH_SIGMAS, STRIP_LINK_FLOOR_RELATIVE, STRIP_LINK_FRACTION, STRIP_LINK_FRACTION_OF_LONGER,
    STRIP_LINK_OVERLAP_WIDTHS, STRIP_LINK_PITCHES,
};

/// Per piece: its strip, numbered by first piece.
///
/// Pieces of one label are linked if their common samples continue from one frame to the next as a smooth surface
/// does: without a mean bend beyond noise and curvature. Joints at kinks and continuations beyond gaps do not
/// link: a part that rises by exactly one wrap looks the same.
///
/// `line_width_px`: width of lines in focus.
pub fn strips(
    labels: &[usize],
    samples: &Samples,
    pieces: &[Piece],
    line_width_px: f64,
    partners: &Partners,
    reference_view: &ReferenceView,
) -> Vec<usize> {
    let curvature_per_mm = reference_view.curvature_per_mm();
    let floor_mm = STRIP_LINK_FLOOR_RELATIVE * reference_view.reference_depth_mm;
    let bend = |chain, label| bend(chain, label, samples, curvature_per_mm);
    let mut links: BTreeMap<(usize, usize), Link> = BTreeMap::new();
    for (idx, sample) in samples.all.iter().enumerate() {
        let Some(next) = partners.next[idx] else { continue };
        let other = &samples.all[next];
        if labels[sample.piece] == labels[other.piece] {
            let link = links.entry((sample.piece, other.piece)).or_default();
            let label = labels[sample.piece];
            link.add(partners.previous[idx].and_then(|before| bend([before, idx, next], label)), 0);
            link.add(partners.next[next].and_then(|after| bend([idx, next, after], label)), 1);
            link.moved_pitches =
                link.moved_pitches.max((sample.across_px - other.across_px).abs() / sample.pitch_px);
        }
    }
    let mut unions = UnionFind::new(pieces.len());
    let overlaps = |&(a, b): &(usize, usize)| {
        let (a, b) = (&pieces[a], &pieces[b]);
        let end = |piece: &Piece| piece.along + piece.n_points() as i64;
        let shared = (end(a).min(end(b)) - a.along.max(b.along)) as f64;
        shared >= STRIP_LINK_OVERLAP_WIDTHS * line_width_px
            && shared >= STRIP_LINK_FRACTION * a.n_points().min(b.n_points()) as f64
            && shared >= STRIP_LINK_FRACTION_OF_LONGER * a.n_points().max(b.n_points()) as f64
    };
    for ((a, b), _) in links.iter().filter(|(pair, link)| overlaps(pair) && link.is_smooth(floor_mm)) {
        unions.join(*a, *b);
    }
    let mut number = BTreeMap::new();
    (0..pieces.len())
        .map(|piece| {
            let fresh = number.len();
            *number.entry(unions.first_of(piece)).or_insert(fresh)
        })
        .collect()
}

/// Smoothness of the surface between two pieces, from their common samples.
#[derive(Debug, Clone, Copy, Default)]
struct Link {
    /// Bends at the first and at the second piece.
    bends: [Bend; 2],
    moved_pitches: f64,
}

/// A bend of the surface along the travel: second difference of depth.
#[derive(Debug, Clone, Copy, Default)]
struct Bend {
    n: f64,
    sum_mm: f64,
    sigma_mm: f64,
    /// Bend explained by the largest curvature.
    allowed_mm: f64,
}

impl Link {
    fn add(&mut self, bend: Option<Bend>, place: usize) {
        let Some(bend) = bend else { return };
        let sum = &mut self.bends[place];
        sum.n += bend.n;
        sum.sum_mm += bend.sum_mm;
        sum.sigma_mm += bend.sigma_mm;
        sum.allowed_mm += bend.allowed_mm;
    }

    fn is_smooth(&self, floor_mm: f64) -> bool {
        let known = self.bends.iter().filter(|bend| bend.n > 0.0);
        if known.clone().count() == 0 {
            return self.moved_pitches <= STRIP_LINK_PITCHES;
        }
        known.into_iter().all(|bend| {
            // Samples are statistically independent.
            let noise = SMOOTH_SIGMAS * bend.sigma_mm / bend.n / bend.n.sqrt();
            bend.sum_mm.abs() / bend.n <= noise + bend.allowed_mm / bend.n + floor_mm
        })
    }
}

/// `None` if one of the three has no hypothesis of this label ("none" included).
fn bend(chain: [usize; 3], label: usize, samples: &Samples, curvature_per_mm: f64) -> Option<Bend> {
    let [before, here, after] = chain.map(|idx| samples.by_order(idx).get(label).and_then(Option::as_ref));
    let (before, here, after) = (before?, here?, after?);
    let (back, ahead) = (here.in_part_mm - before.in_part_mm, after.in_part_mm - here.in_part_mm);
    let (reach_back, reach_ahead) = (back.xy().norm(), ahead.xy().norm());
    let ratio = if reach_back > 0.0 { reach_ahead / reach_back } else { 1.0 };
    let reach = 0.5 * reach_ahead * (reach_back + reach_ahead);
    Some(Bend {
        n: 1.0,
        sum_mm: ahead.z - back.z * ratio,
        sigma_mm: 6f64.sqrt() * here.sigma_mm,
        allowed_mm: curvature_per_mm * reach,
    })
}
