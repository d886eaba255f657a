//! Order labelling: assigns a diffraction order to each line (`docs/maths/labelling.md`).
//!
//! A pairwise Markov random field over pieces of lines, solved by mean field and iterated conditional modes. Every
//! piece of a line is tried with every order. Four kinds of evidence support or contradict a label: the stated depths,
//! the order of the lines across the image, the same line in the next frame or across a gap, and, most important,
//! whether another order observes the same surface at the same place of the part from another stage position.

mod columns;
mod cuts;
mod gather;
mod kinks;
mod pieces;
mod sections;
mod solve;
mod travel;
mod union_find;

use optics::{Calibration, DepthRangeMm, Triangulator};
use vision::{CentrelinePoint, LineDirection};

use crate::error::ScanError;
use crate::input::frames::{Frames, lines_of};
use crate::input::line_widths::LineWidths;
use crate::input::motions::FrameMotion;
use crate::params::{CONFIRMATION, OUTSIDE_COST, PIECES_PER_TASK, SAMPLE_STRIDE_PX, STUB_WIDTHS, UNLABELLED_COST};
use crate::threads::for_each_chunk;
use gather::evidence::Evidence;
use gather::hypotheses::Samples;
use solve::interval_bounds::IntervalBounds;

pub use gather::agreement::gradient;
pub use gather::patches::{PatchGrid, ViewPoint};
pub use gather::reference_view::ReferenceView;
pub use pieces::Piece;
pub use solve::inference::LabelOutcome;
pub use travel::{Travel, reference_view};

/// Pieces of all frames with the outcome of each.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    /// Ordered by frame, segment, then along the line.
    pub pieces: Vec<Piece>,
    /// One per piece.
    pub outcomes: Vec<LabelOutcome>,
    /// Per piece: its best label, even if doubtful; an index into the calibration's orders.
    pub labels: Vec<Option<usize>>,
    /// Direction of the lines; for a cross, that of the first frame.
    pub direction: LineDirection,
    /// The line of a cross with the other direction.
    pub crossing: Option<i8>,
    /// Full width of lines in focus, px.
    pub line_width_px: f64,
    /// Whether the labels are given rather than inferred, since lines were lit one by one.
    pub are_certain: bool,
}

impl Labels {
    /// Direction of the line of an order.
    pub fn direction_of(&self, order: i8) -> LineDirection {
        match (self.crossing == Some(order), self.direction) {
            (false, direction) => direction,
            (true, LineDirection::Rows) => LineDirection::Columns,
            (true, LineDirection::Columns) => LineDirection::Rows,
        }
    }

    /// Position of a point along and across its line of this order, px.
    pub fn along_across(&self, order: i8, point: &CentrelinePoint) -> (f64, f64) {
        point.along_across(self.direction_of(order))
    }
}

/// Marks short pieces whose label differs from that of an adjoining piece as doubtful: their evidence is too weak.
/// `before`: the outcomes before any were changed. Pieces of `least_points` or more are not short.
fn doubt_stubs(
    features: &gather::features::FrameFeatures,
    outcomes: &mut [LabelOutcome],
    before: &[LabelOutcome],
    least_points: f64,
) {
    let gather::features::FrameFeatures { pieces, joined, .. } = features;
    for idx in 1..pieces.len() {
        if before[idx - 1] == before[idx] || !joined[idx] {
            continue;
        }
        for stub in [idx - 1, idx] {
            let is_labelled = matches!(before[stub], LabelOutcome::Order(_));
            if is_labelled && (pieces[stub].n_points() as f64) < least_points {
                outcomes[stub] = LabelOutcome::Doubtful;
            }
        }
    }
}

/// Size of one sample of a piece in full samples: densely sampled pieces still count by their length.
pub(crate) fn sample_weight(piece: &Piece) -> f64 {
    piece.stride as f64 / SAMPLE_STRIDE_PX as f64
}

/// Labels all frames of a scan together. `motions[frame]` is the motion of the part.
///
/// With a single frame, or a stage that does not move, only the geometry within `depth_range_mm` and the ranks are
/// used.
///
/// # Errors
/// [`ScanError::UnreadableFrame`].
pub fn label_frames(
    frames: &dyn Frames,
    motions: &[FrameMotion],
    triangulator: &Triangulator,
    depth_range_mm: DepthRangeMm,
) -> Result<Labels, ScanError> {
    let lit = lit_lines(frames, triangulator.calibration())?;
    let travel = Travel::of(motions, lit.as_deref());
    let direction = lines_of(frames, 0)?.direction;
    let cut = gather::features::cut_pieces(frames, &travel.order)?;
    let line_width_px = cut.width_px();
    let gather::features::CutLines { mut pieces, directions, widths_px } = cut;
    if let Some(lit) = lit {
        let orders = &triangulator.calibration().orders;
        let crossing =
            directions.iter().zip(&lit).find(|(other, _)| **other != direction).map(|(_, &idx)| orders[idx]);
        // A single line cannot be contradicted; points outside the depth range are dropped one by one.
        let labels: Vec<Option<usize>> = pieces.iter().map(|piece| Some(lit[piece.frame])).collect();
        let outcomes = labels.iter().flatten().map(|&label| LabelOutcome::Order(label)).collect();
        let are_certain = triangulator.calibration().orders.len() > 1;
        return Ok(Labels { pieces, outcomes, labels, direction, crossing, line_width_px, are_certain });
    }
    let is_scan = frames.n_frames() > 1;
    let view =
        gather::hypotheses::View { triangulator, depth_range_mm, direction, widths_px: &widths_px, is_scan };
    let mut widths = None;
    if is_scan {
        let gather = |pieces, widths| gather_evidence(frames, motions, &travel, &view, (pieces, widths));
        let (whole, of_pieces, learned) = whole_pieces(gather(pieces, None)?, &view);
        let sections = sections::sections(&whole);
        let start = sections::labels_of(&sections, &of_pieces);
        let (features, evidence, _) = gather(sections, Some(&learned))?;
        // The samples of all sections are a third of all memory in use here, and are no longer needed.
        let sections = features.into_pieces();
        pieces = sections::merged(&sections, &solve::inference::best_labels_from(&evidence, start));
        widths = Some(learned);
    }
    let (features, evidence, partners) =
        gather_evidence(frames, motions, &travel, &view, (pieces, widths.as_ref()))?;
    let pieces = &features.pieces;
    let confirmation = is_scan.then_some(CONFIRMATION);
    let bounds = match is_scan {
        true => None,
        false => Some(IntervalBounds::new(&evidence, pieces, &*lines_of(frames, 0)?, direction)),
    };
    let doubtful_by_strip = |labels: &[usize]| {
        let (strips, lengths) = match is_scan {
            true => strips_with_lengths(&view, &travel, labels, (&features, &partners), line_width_px),
            false => ((0..pieces.len()).collect(), Vec::new()),
        };
        solve::strip_test::doubtful_by_strip(&evidence, labels, &strips, &lengths, bounds.as_ref())
    };
    let (labels, accepted) =
        solve::inference::label_outcomes(&evidence, confirmation, bounds.as_ref(), doubtful_by_strip);
    let mut labels: Vec<Option<usize>> =
        labels.into_iter().map(|label| (label != evidence.none()).then_some(label)).collect();
    let mut outcomes = accepted.clone();
    doubt_stubs(&features, &mut outcomes, &accepted, STUB_WIDTHS * line_width_px);
    let gather::features::FrameFeatures { mut pieces, widths_px, .. } = features;
    if is_scan {
        cuts::close(&mut pieces, &outcomes);
        (pieces, outcomes, labels) = sections::doubt_seams(&pieces, &outcomes, &labels, &widths_px);
    }
    Ok(Labels { pieces, outcomes, labels, direction, crossing: None, line_width_px, are_certain: false })
}

/// Per frame the index of the only possible order of its lines, if there is one in every frame: lines switched on one
/// by one, or a calibration with a single order.
///
/// # Errors
/// [`ScanError::UnknownLine`], [`ScanError::MissingLitLine`].
pub fn lit_lines(frames: &dyn Frames, calibration: &Calibration) -> Result<Option<Vec<usize>>, ScanError> {
    let orders = &calibration.orders;
    let lit: Vec<Option<i8>> = (0..frames.n_frames()).map(|frame| frames.lit_line(frame)).collect();
    if lit.iter().all(Option::is_none) {
        return Ok((orders.len() == 1).then(|| vec![0; lit.len()]));
    }
    let index = |(frame, line): (usize, &Option<i8>)| {
        let line = line.ok_or(ScanError::MissingLitLine { frame })?;
        let unknown = ScanError::UnknownLine { calibration: calibration.id.clone(), frame, line };
        orders.iter().position(|order| *order == line).ok_or(unknown)
    };
    lit.iter().enumerate().map(index).collect::<Result<Vec<usize>, ScanError>>().map(Some)
}

/// Features of the pieces, the evidence for their labels, and the same line in neighbouring frames.
type Gathered = (gather::features::FrameFeatures, Evidence, gather::tracks::Partners);

fn gather_evidence(
    frames: &dyn Frames,
    motions: &[FrameMotion],
    travel: &Travel,
    view: &gather::hypotheses::View,
    (pieces, widths): (Vec<Piece>, Option<&LineWidths>),
) -> Result<Gathered, ScanError> {
    let (direction, calibration) = (view.direction, view.triangulator.calibration());
    let features = gather::features::extract_features(frames, motions, view, pieces)?;
    let gather::features::FrameFeatures { pieces, samples, ends, joined, shared_columns, .. } = &features;
    let mut evidence = depth_evidence(samples, pieces, calibration.orders.len());
    if let Some(widths) = widths {
        gather::widths::add_widths(&mut evidence, samples, pieces, (widths, &calibration.orders));
    }
    let partners = gather::tracks::add_tracks(&mut evidence, samples, pieces, frames, direction, &travel.order)?;
    gather::tracks::add_continuations(&mut evidence, samples, pieces, ends);
    gather::tracks::add_joints(&mut evidence, joined);
    shared_columns.iter().for_each(|shared| gather::ranks::add_ranks(&mut evidence, shared));
    if !view.is_scan {
        return Ok((features, evidence, partners));
    }
    let reference_view = reference_view(travel, calibration, view.depth_range_mm, direction);
    let scene = gather::agreement::Scene {
        samples,
        pieces,
        partners: &partners,
        travel_rank: &travel.rank,
        motions,
        reference_view: &reference_view,
    };
    gather::agreement::add_repeated_observations(&mut evidence, &scene);
    Ok((features, evidence, partners))
}

/// Per piece of a scan: its strip; and per strip: its length in line pitches.
fn strips_with_lengths(
    view: &gather::hypotheses::View,
    travel: &Travel,
    labels: &[usize],
    (features, partners): (&gather::features::FrameFeatures, &gather::tracks::Partners),
    line_width_px: f64,
) -> (Vec<usize>, Vec<f64>) {
    let gather::features::FrameFeatures { pieces, samples, .. } = features;
    let calibration = view.triangulator.calibration();
    let reference_view = reference_view(travel, calibration, view.depth_range_mm, view.direction);
    let strips = gather::strips::strips(labels, samples, pieces, line_width_px, partners, &reference_view);
    let lengths = lengths_pitches(samples, pieces, &strips);
    (strips, lengths)
}

/// Per strip: the longest of its pieces in line pitches.
fn lengths_pitches(samples: &Samples, pieces: &[Piece], strips: &[usize]) -> Vec<f64> {
    let mut lengths = vec![0.0f64; strips.iter().max().map_or(0, |last| last + 1)];
    for (idx, piece) in pieces.iter().enumerate() {
        let pitch = samples.of_piece(idx).first().map_or(f64::INFINITY, |sample| sample.pitch_px);
        lengths[strips[idx]] = lengths[strips[idx]].max(piece.n_points() as f64 / pitch);
    }
    lengths
}

/// The pieces with their labels by the first evidence, and the widths of lines under these labels.
fn whole_pieces(
    (features, evidence, _): Gathered,
    view: &gather::hypotheses::View,
) -> (Vec<Piece>, Vec<usize>, LineWidths) {
    let (labels, _) = solve::inference::best_labels(&evidence, None);
    let orders = &view.triangulator.calibration().orders;
    let widths = gather::widths::learned(&features.samples, &labels, orders, view.depth_range_mm);
    (features.pieces, labels, widths)
}

/// Evidence with the sizes of the pieces and the costs of depths outside the range.
fn depth_evidence(samples: &Samples, pieces: &[Piece], n_orders: usize) -> Evidence {
    let size = |(idx, piece): (usize, &Piece)| samples.range(idx).len() as f64 * sample_weight(piece);
    let sizes = pieces.iter().enumerate().map(size).map(|size| size.max(f64::MIN_POSITIVE)).collect();
    let mut evidence = Evidence::new(n_orders, sizes, UNLABELLED_COST);
    for_each_chunk(&mut evidence.unary, n_orders + 1, PIECES_PER_TASK, |idx, unary| {
        for (label, unary) in unary[..n_orders].iter_mut().enumerate() {
            let n_outside = samples.range(idx).filter(|&sample| samples.by_order(sample)[label].is_none()).count();
            *unary -= OUTSIDE_COST * n_outside as f64 * sample_weight(&pieces[idx]);
        }
    });
    evidence
}
