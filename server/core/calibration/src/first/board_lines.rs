//! Order of each line on a board: by rank where all lines are side by side, otherwise by the predicted curves.

use nalgebra::Vector2;
use optics::{Camera, LightSurfaces};
use statistics::median;
use vision::{CentrelinePoint, Centrelines, LineDirection};

use crate::findings::report::Rejections;
use crate::input::BoardGeometry;
use crate::params::{
    BOARD_MARGIN_SQUARES, EDGE_MARGIN_WIDTHS, MARGIN_REJECT_SIGMAS, MIN_LINE_COLUMNS, MIN_RANK_AGREEMENT,
    PREDICTED_LABEL_PITCH_FRACTION,
};
use crate::solving::bundle::sheet_residual;
use crate::solving::bundle_state::BoardPose;
use crate::solving::observation::LaserObservation;

/// A connected run of centreline points on the board's pattern, away from its squares' edges.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardPiece {
    /// Pose block.
    pub block: usize,
    /// The points.
    pub points: Vec<CentrelinePoint>,
    /// Order, once known.
    pub order: Option<i8>,
    /// Whether the order is known because only this line was switched on.
    pub is_alone: bool,
    /// Whether it lies on the squares, as opposed to the margin of one square's width that most boards leave blank.
    pub on_pattern: bool,
}

/// The pieces of one image.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImageLines {
    /// Pieces on the board.
    pub pieces: Vec<BoardPiece>,
    /// Rejected points, by reason.
    pub rejections: Rejections,
    /// Most lines side by side in a column.
    pub most_side_by_side: usize,
    /// Distance between neighbouring lines, px; for a single line, the image's side across it.
    pub pitch_px: f64,
    /// Noise correlation along the lines, px.
    pub correlation_px: f64,
}

/// Cuts the centrelines of an image into pieces on the board and labels them by rank where all
/// `orders.len()` lines are side by side.
pub fn image_lines(
    block: usize,
    centrelines: &Centrelines,
    camera: &Camera,
    pose: &BoardPose,
    board: &BoardGeometry,
    orders: &[i8],
) -> ImageLines {
    let line_direction = centrelines.direction;
    let mut lines = ImageLines { correlation_px: centrelines.correlation_px.max(1.0), ..ImageLines::default() };
    let places: Vec<Vec<Place>> = centrelines
        .segments
        .iter()
        .map(|segment| segment.points.iter().map(|point| place_on_board(point, camera, pose, board)).collect())
        .collect();
    let columns = Columns::of(centrelines, &places, line_direction);
    lines.most_side_by_side = columns.most_side_by_side();
    lines.pitch_px = columns.pitch_px().unwrap_or(match line_direction {
        LineDirection::Rows => camera.height_px as f64,
        LineDirection::Columns => camera.width_px as f64,
    });
    for (segment, places) in centrelines.segments.iter().zip(&places) {
        let mut run = Run::new(block, orders);
        for (point, place) in segment.points.iter().zip(places) {
            match place {
                Place::OffBoard => lines.rejections.off_board += 1,
                Place::NearEdge => lines.rejections.square_edge += 1,
                Place::Square | Place::Margin => {}
            }
            if let Some(closed) = run.advance(point, place, columns.rank(point, orders.len())) {
                lines.pieces.push(closed);
            }
        }
        lines.pieces.extend(run.close());
    }
    lines
}

impl ImageLines {
    /// These lines for an image in which only the line `order` was switched on.
    pub fn of_line(mut self, order: i8) -> Self {
        for piece in &mut self.pieces {
            (piece.order, piece.is_alone) = (Some(order), true);
        }
        self
    }
}

/// A piece being built.
struct Run<'a> {
    orders: &'a [i8],
    piece: BoardPiece,
    votes: Vec<usize>,
}

impl<'a> Run<'a> {
    fn new(block: usize, orders: &'a [i8]) -> Self {
        let piece = BoardPiece { block, points: Vec::new(), order: None, is_alone: false, on_pattern: true };
        Self { orders, piece, votes: vec![0; orders.len()] }
    }

    /// Adds the next point of the segment; returns a piece if one ends here.
    fn advance(&mut self, point: &CentrelinePoint, place: &Place, rank: Option<usize>) -> Option<BoardPiece> {
        let on_pattern = match place {
            Place::OffBoard => return self.close(),
            Place::NearEdge => None,
            Place::Square => Some(true),
            Place::Margin => Some(false),
        };
        let closed = on_pattern.filter(|on| *on != self.piece.on_pattern).and_then(|_| self.close());
        if let Some(on_pattern) = on_pattern {
            self.piece.on_pattern = on_pattern;
            self.piece.points.push(*point);
        }
        if let Some(rank) = rank {
            self.votes[rank] += 1;
        }
        closed
    }

    fn close(&mut self) -> Option<BoardPiece> {
        let order = voted(&self.votes).map(|rank| self.orders[rank]);
        self.votes.fill(0);
        let points = std::mem::take(&mut self.piece.points);
        (!points.is_empty()).then(|| BoardPiece { points, order, ..self.piece.clone() })
    }
}

/// Labels every piece of unknown order by the predicted curves of `light`; pieces between two curves lose their label.
pub fn label_by_prediction(
    pieces: &mut [BoardPiece],
    camera: &Camera,
    poses: &[BoardPose],
    light: &LightSurfaces,
    orders: &[i8],
) {
    for piece in pieces.iter_mut().filter(|piece| !piece.is_alone) {
        let mut distances: Vec<(f64, i8)> = orders
            .iter()
            .filter_map(|&order| Some((median_distance(piece, camera, &poses[piece.block], light, order)?, order)))
            .collect();
        distances.sort_by(|a, b| a.0.total_cmp(&b.0));
        piece.order = match distances.as_slice() {
            [(near, order), (next, _), ..] if *near < PREDICTED_LABEL_PITCH_FRACTION * (near + next) => {
                Some(*order)
            }
            [(_, order)] => Some(*order),
            _ => None,
        };
    }
}

/// Labelled pieces as observations, thinned to `spacing` columns.
pub fn observations(pieces: &[BoardPiece], spacing: usize, correlation_px: f64) -> Vec<LaserObservation> {
    let effective_weight = (spacing as f64 / correlation_px).min(1.0);
    pieces
        .iter()
        .filter_map(|piece| Some((piece, piece.order?)))
        .flat_map(|(piece, order)| {
            piece.points.iter().step_by(spacing).map(move |point| LaserObservation {
                block: piece.block,
                order,
                pixel: Vector2::new(point.u_px, point.v_px),
                sigma_px: point.sigma_px,
                effective_weight,
            })
        })
        .collect()
}

/// Removes the label of pieces on the board's margin that are not on the predicted curve within the noise: the board
/// may have ended before them.
pub fn unlabel_beyond_board(
    pieces: &mut [BoardPiece],
    camera: &Camera,
    poses: &[BoardPose],
    light: &LightSurfaces,
) {
    for piece in pieces.iter_mut().filter(|piece| !piece.on_pattern) {
        let Some(order) = piece.order else { continue };
        let sigma = piece.points.iter().map(|p| p.sigma_px).sum::<f64>() / piece.points.len() as f64;
        let distance = median_distance(piece, camera, &poses[piece.block], light, order);
        if distance.is_none_or(|distance| distance > MARGIN_REJECT_SIGMAS * sigma) {
            piece.order = None;
        }
    }
}

/// Median |distance| of a piece's points to the curve of `order` on its board, px.
fn median_distance(
    piece: &BoardPiece,
    camera: &Camera,
    pose: &BoardPose,
    light: &LightSurfaces,
    order: i8,
) -> Option<f64> {
    let step = (piece.points.len() / 16).max(1);
    let mut distances: Vec<f64> = piece
        .points
        .iter()
        .step_by(step)
        .filter_map(|point| {
            let pixel = Vector2::new(point.u_px, point.v_px);
            let seen = LaserObservation {
                block: piece.block,
                order,
                pixel,
                sigma_px: point.sigma_px,
                effective_weight: 1.0,
            };
            Some(sheet_residual(camera, light, pose, &seen, None)?.residual_px.abs())
        })
        .collect();
    median(&mut distances)
}

enum Place {
    OffBoard,
    NearEdge,
    Square,
    Margin,
}

/// Position of a centreline point on the board's pattern, with the squares' edges widened by the line's own width.
fn place_on_board(point: &CentrelinePoint, camera: &Camera, pose: &BoardPose, board: &BoardGeometry) -> Place {
    let pixel = Vector2::new(point.u_px, point.v_px);
    let Some(here) = squares_from_pixel(&pixel, camera, pose, board) else { return Place::OffBoard };
    let limit = board.extent_squares();
    let outside = |margin: f64| {
        here.x < -1.0 - margin || here.y < -1.0 - margin || here.x > limit.x + margin || here.y > limit.y + margin
    };
    if outside(BOARD_MARGIN_SQUARES) {
        return Place::OffBoard;
    }
    let reach_px = EDGE_MARGIN_WIDTHS * f64::from(point.width_px);
    for axis in [Vector2::x(), Vector2::y()] {
        let Some(ahead) = squares_from_pixel(&(pixel + axis * reach_px), camera, pose, board) else {
            return Place::OffBoard;
        };
        let Some(behind) = squares_from_pixel(&(pixel - axis * reach_px), camera, pose, board) else {
            return Place::OffBoard;
        };
        if board.field(ahead) != board.field(behind) {
            return Place::NearEdge;
        }
    }
    match outside(0.0) {
        true => Place::Margin,
        false if board.field(here).holds_marker => Place::NearEdge,
        false => Place::Square,
    }
}

/// Board coordinates in squares from corner (0, 0) of a pixel.
fn squares_from_pixel(
    pixel: &Vector2<f64>,
    camera: &Camera,
    pose: &BoardPose,
    board: &BoardGeometry,
) -> Option<Vector2<f64>> {
    let ray = camera.ray_from_pixel(pixel)?;
    let normal = pose.axes().column(2);
    let depth = normal.dot(&pose.translation_mm) / normal.dot(&ray);
    if !(depth.is_finite() && depth > 0.0) {
        return None;
    }
    let on_board = pose.rotation.inverse() * (ray * depth - pose.translation_mm);
    Some(on_board.xy().component_div(&board.square_mm))
}

/// The rank with the most votes, if there are enough votes and they agree.
fn voted(votes: &[usize]) -> Option<usize> {
    let total: usize = votes.iter().sum();
    let (rank, &most) = votes.iter().enumerate().max_by_key(|(_, count)| **count)?;
    (total >= MIN_LINE_COLUMNS && most as f64 >= MIN_RANK_AGREEMENT * total as f64).then_some(rank)
}

/// Crossings of every scan column with lines on the board, sorted across the lines. The background behind the board
/// shows the lines displaced by several pitches, between those of the board.
struct Columns {
    line_direction: LineDirection,
    across_px: Vec<Vec<f64>>,
}

impl Columns {
    fn of(centrelines: &Centrelines, places: &[Vec<Place>], line_direction: LineDirection) -> Self {
        let mut across_px: Vec<Vec<f64>> = Vec::new();
        let points = centrelines.segments.iter().flat_map(|segment| &segment.points);
        let on_board = points.zip(places.iter().flatten()).filter(|(_, place)| !matches!(place, Place::OffBoard));
        for (point, _) in on_board {
            let (along, across) = point.along_across(line_direction);
            let column = along.round().max(0.0) as usize;
            if column >= across_px.len() {
                across_px.resize(column + 1, Vec::new());
            }
            across_px[column].push(across);
        }
        for column in &mut across_px {
            column.sort_by(f64::total_cmp);
        }
        Self { line_direction, across_px }
    }

    /// Rank of a point in its column, if exactly `full` lines cross it.
    fn rank(&self, point: &CentrelinePoint, full: usize) -> Option<usize> {
        let (along, across) = point.along_across(self.line_direction);
        let column = self.across_px.get(along.round().max(0.0) as usize)?;
        (column.len() == full).then(|| column.iter().filter(|other| **other < across).count())
    }

    /// Median distance between neighbouring lines; `None` where no column is crossed by two.
    fn pitch_px(&self) -> Option<f64> {
        let mut gaps: Vec<f64> =
            self.across_px.iter().flat_map(|column| column.windows(2).map(|pair| pair[1] - pair[0])).collect();
        median(&mut gaps)
    }

    /// The largest number of crossings that at least [`MIN_LINE_COLUMNS`] columns have.
    fn most_side_by_side(&self) -> usize {
        let mut counts: Vec<usize> = self.across_px.iter().map(Vec::len).collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.get(MIN_LINE_COLUMNS - 1).copied().unwrap_or(0)
    }
}
