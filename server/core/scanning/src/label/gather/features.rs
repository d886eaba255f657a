//! The features of every frame needed for labelling, extracted in a few passes, so that a scan's points need not
//! be in memory together.

use statistics::median;
use vision::{Centrelines, LineDirection};

use super::hypotheses::{Samples, View};
use super::ranks::{SharedColumns, shared_columns};
use super::tracks::{End, ends_of, joined};
use crate::error::ScanError;
use crate::input::frames::{Frames, in_order, lines_of, of_every_frame};
use crate::input::line_step::in_focus_width_px;
use crate::input::motions::FrameMotion;
use crate::label::columns::pieces_of;
use crate::label::pieces::{self, Joint, Piece};

/// The pieces of all frames with their features.
pub struct FrameFeatures {
    /// Ordered by frame, segment, then along the line.
    pub pieces: Vec<Piece>,
    /// Their samples.
    pub samples: Samples,
    /// Per piece: its ends.
    pub ends: Vec<(End, End)>,
    /// Per piece: whether it follows the one before it without a jump.
    pub joined: Vec<bool>,
    /// Per piece of a scan: full width of the line at half its height.
    pub widths_px: Vec<f64>,
    /// Per frame: the columns that its pieces share.
    pub shared_columns: Vec<SharedColumns>,
}

impl FrameFeatures {
    /// The pieces alone; the other features are dropped.
    pub fn into_pieces(self) -> Vec<Piece> {
        self.pieces
    }
}

/// Extracts the features of every frame.
pub fn extract_features(
    frames: &dyn Frames,
    motions: &[FrameMotion],
    view: &View,
    pieces: Vec<Piece>,
) -> Result<FrameFeatures, ScanError> {
    let mut features = FrameFeatures {
        samples: Samples::new(view.triangulator.calibration().orders.len()),
        ends: Vec::with_capacity(pieces.len()),
        joined: Vec::with_capacity(pieces.len()),
        widths_px: Vec::with_capacity(pieces.len()),
        shared_columns: Vec::with_capacity(frames.n_frames()),
        pieces: Vec::new(),
    };
    let of_frame =
        |frame| Ok(OneFrameFeatures::new(view, &pieces, frame, &*lines_of(frames, frame)?, &motions[frame]));
    in_order(frames.n_frames(), of_frame, |of_frame| {
        features.samples.append(of_frame.samples);
        features.ends.extend(of_frame.ends);
        features.joined.extend(of_frame.joined);
        features.widths_px.extend(of_frame.widths_px);
        features.shared_columns.push(of_frame.shared_columns);
        Ok(())
    })?;
    features.pieces = pieces;
    Ok(features)
}

/// The lines of all frames, cut into pieces.
pub struct CutLines {
    /// Ordered by frame, segment, then along the line.
    pub pieces: Vec<Piece>,
    /// Per frame: direction of its lines.
    pub directions: Vec<LineDirection>,
    /// Per frame: full width of its lines in focus, px; 0 without lines.
    pub widths_px: Vec<f64>,
}

impl CutLines {
    /// Full width of lines in focus, px: the median over the frames with lines.
    pub fn width_px(&self) -> f64 {
        let mut widths_px: Vec<f64> = self.widths_px.iter().copied().filter(|width_px| *width_px > 0.0).collect();
        median(&mut widths_px).unwrap_or(0.0)
    }
}

/// The lines of all frames, cut at their own kinks and at the joints of their neighbours. `travel_order`: the frames in
/// the sequence of their stage positions.
pub fn cut_pieces(frames: &dyn Frames, travel_order: &[usize]) -> Result<CutLines, ScanError> {
    let has_neighbours = frames.n_frames() > 1;
    let found = of_every_frame(frames, |frame, lines| {
        let width_px = in_focus_width_px(lines);
        let pieces = pieces::pieces_of_frame(lines, frame, width_px);
        let joints = match has_neighbours {
            true => pieces::joints_of_frame(&pieces, lines, width_px),
            false => Vec::new(),
        };
        ((pieces, joints), (lines.direction, width_px))
    })?;
    let (found, properties): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    let (directions, widths_px): (Vec<LineDirection>, Vec<f64>) = properties.into_iter().unzip();
    let (pieces, joints): (Vec<Vec<Piece>>, Vec<Vec<Joint>>) = found.into_iter().unzip();
    let nearby = pieces::joints_nearby(&joints, travel_order);
    let cut = of_every_frame(frames, |frame, lines| {
        pieces::cut_at_joints(&pieces[frame], lines, widths_px[frame], &nearby[frame])
    })?;
    Ok(CutLines { pieces: cut.into_iter().flatten().collect(), directions, widths_px })
}

/// The features of one frame.
struct OneFrameFeatures {
    samples: Samples,
    ends: Vec<(End, End)>,
    joined: Vec<bool>,
    widths_px: Vec<f64>,
    shared_columns: SharedColumns,
}

impl OneFrameFeatures {
    fn new(view: &View, pieces: &[Piece], frame: usize, lines: &Centrelines, motion: &FrameMotion) -> Self {
        let own = pieces_of(pieces, frame);
        let samples = view.samples(&pieces[own.clone()], own.start, lines, motion);
        let follows = |idx: usize| {
            idx > own.start && joined(&pieces[idx - 1], &pieces[idx], lines, view.widths_px[frame], view.direction)
        };
        let joined = own.clone().map(follows).collect();
        let pieces = &pieces[own.clone()];
        Self {
            shared_columns: shared_columns(&samples, pieces, own.start, (lines, view.direction)),
            ends: pieces.iter().map(|piece| ends_of(piece.points(lines), view.direction)).collect(),
            joined,
            widths_px: pieces.iter().filter(|_| view.is_scan).map(|piece| mean_width_px(piece, lines)).collect(),
            samples,
        }
    }
}

/// Mean over the points of a piece.
fn mean_width_px(piece: &Piece, lines: &Centrelines) -> f64 {
    let widths = piece.points(lines).iter().map(|point| f64::from(point.width_px));
    widths.sum::<f64>() / piece.n_points() as f64
}
