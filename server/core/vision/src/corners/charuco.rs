//! The corners of a ChArUco board. Its markers identify the corners, so that a part of the board is enough.
//!
//! Markers and the corners between them are detected by `calib-targets`; each corner is then fitted like those of a
//! chessboard, in a window that ends before the markers.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use calib_targets::aruco::{Dictionary, resolve_dictionary};
use calib_targets::charuco::{
    CharucoBoardSpec, CharucoDetection, CharucoDetector, CharucoParams as DetectorParams,
};
use calib_targets::core::GrayImageView;
use remedy::Remedy;
use statistics::median;

use crate::GreyImage;

use super::finding::detect::bytes_of;
use super::fitting::fit::{CornerFit, fit_corner, start_at};
use super::fitting::model::CrossShape;
use super::fitting::refine::refine;
use super::fitting::warp::BoardWarp;
use super::fitting::window::{Reach, window_around};
use super::params::{
    BLUR_START_PX, CHARUCO_MAX_MISS_MEDIANS, CHARUCO_WINDOW_FRACTION, FIRST_WINDOW_MAX_PX, MAX_RESIDUAL_RATIO,
    MIN_SEED_CORNERS, RECENTRE_PX, WINDOW_MAX_PX,
};
use super::{BoardCorners, Corner, CornerError};

/// A ChArUco board as OpenCV prints it: the square at the top left is black, the markers are in the white squares,
/// numbered row by row. With an even number of rows, it may as well be one of OpenCV before 4.6, whose square at the top
/// left is white (its legacy pattern).
#[derive(Debug, Clone, PartialEq)]
pub struct CharucoParams {
    /// Squares along a row.
    pub columns: usize,
    /// Squares along a column.
    pub rows: usize,
    /// Side of a marker over the side of a square.
    pub marker_ratio: f64,
    /// OpenCV's name of the dictionary, such as `DICT_4X4_50`.
    pub dictionary: String,
}

/// Why a ChArUco board is not possible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CharucoError {
    /// No dictionary has this name.
    #[error("there is no marker dictionary \"{name}\"")]
    UnknownDictionary {
        /// As given.
        name: String,
    },
    /// Fewer markers than white squares.
    #[error("the board needs {needed} markers, {name} has {available}")]
    TooFewMarkers {
        /// The dictionary.
        name: String,
        /// White squares.
        needed: usize,
        /// Markers of the dictionary.
        available: usize,
    },
}

impl Remedy for CharucoError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(match self {
            Self::UnknownDictionary { .. } => "use one of OpenCV's, such as DICT_4X4_50 or DICT_5X5_100".into(),
            Self::TooFewMarkers { .. } => "use a larger dictionary".into(),
        })
    }
}

impl CharucoParams {
    /// Checks that the dictionary exists and has enough markers.
    ///
    /// # Errors
    /// [`CharucoError`].
    pub fn check(&self) -> Result<(), CharucoError> {
        let name = || self.dictionary.clone();
        let dictionary = resolve_dictionary(&self.dictionary)
            .ok_or_else(|| CharucoError::UnknownDictionary { name: name() })?;
        let (needed, available) = (self.columns * self.rows / 2, dictionary.codes().len());
        if needed > available {
            return Err(CharucoError::TooFewMarkers { name: name(), needed, available });
        }
        Ok(())
    }

    /// The cells of marker `id`, row by row from its top left, including its border: true where black. `None` if there
    /// is no such marker.
    pub fn marker_cells(&self, id: usize) -> Option<Vec<Vec<bool>>> {
        let dictionary = resolve_dictionary(&self.dictionary)?;
        let code = *dictionary.codes().get(id)?;
        let n = dictionary.marker_size();
        let black = |row: usize, column: usize| {
            let inside = (1..=n).contains(&row) && (1..=n).contains(&column);
            !inside || (code >> ((row - 1) * n + column - 1)) & 1 == 1
        };
        Some((0..n + 2).map(|row| (0..n + 2).map(|column| black(row, column)).collect()).collect())
    }

    fn inner(&self) -> (usize, usize) {
        (self.columns - 1, self.rows - 1)
    }
}

/// Finds the visible inner corners of a ChArUco board and their standard deviations.
///
/// # Errors
/// [`CornerError::NotFound`] without readable markers, [`CornerError::Incomplete`] with fewer than
/// `MIN_SEED_CORNERS` corners or with collinear ones.
pub fn find_charuco(image: &GreyImage, params: &CharucoParams) -> Result<BoardCorners, CornerError> {
    let (inner_columns, inner_rows) = params.inner();
    let missed = CornerError::NotFound { inner_columns, inner_rows };
    let places = marked_places(image, params).ok_or(missed)?;
    let incomplete =
        |found| CornerError::Incomplete { inner_columns, inner_rows, found, needed: inner_columns * inner_rows };
    let reach_squares = CHARUCO_WINDOW_FRACTION * 0.5 * (1.0 - params.marker_ratio);
    let (indices, first) = first_fits(image, &places, reach_squares).ok_or_else(|| incomplete(places.len()))?;
    if first.len() < MIN_SEED_CORNERS {
        return Err(incomplete(first.len()));
    }
    let fits = refine(image, &first, &indices, Reach { squares: reach_squares, max_px: WINDOW_MAX_PX });
    let corner = |(index, fit): (&[usize; 2], &CornerFit)| Corner {
        column: index[0],
        row: index[1],
        u_px: fit.position_px[0],
        v_px: fit.position_px[1],
        sigma_px: fit.sigma_px,
    };
    let agreeing = agreeing(&indices, &fits);
    let corners =
        indices.iter().zip(&fits).zip(agreeing).filter(|(_, agrees)| *agrees).map(|(pair, _)| corner(pair));
    Ok(BoardCorners { inner_columns, inner_rows, corners: corners.collect() })
}

/// Which corners agree with the smooth board model; fits to a marker's edge do not.
pub(super) fn agreeing(indices: &[[usize; 2]], fits: &[CornerFit]) -> Vec<bool> {
    let place = |index: &[usize; 2]| index.map(|at| at as f64);
    let pairs: Vec<_> = indices.iter().zip(fits).map(|(index, fit)| (place(index), fit.position_px)).collect();
    let Some(warp) = BoardWarp::fit(&pairs) else { return vec![true; fits.len()] };
    let miss = |(index, pixel): &([f64; 2], [f64; 2])| {
        let smooth = warp.at(*index);
        (pixel[0] - smooth[0]).hypot(pixel[1] - smooth[1])
    };
    let misses: Vec<f64> = pairs.iter().map(miss).collect();
    let limit_px = CHARUCO_MAX_MISS_MEDIANS * median(&mut misses.clone()).unwrap_or_default();
    misses.into_iter().map(|miss_px| miss_px <= limit_px).collect()
}

/// A board in the pattern of the detector, which knows only that with a black square at the top left.
struct Layout {
    dictionary: Dictionary,
    /// Rows above the board that only the detector assumes.
    rows_above: usize,
}

impl Layout {
    /// The patterns in which the board may be printed, the usual one first.
    ///
    /// With an even number of rows, the legacy pattern is another: the usual one without its first row, whose markers
    /// the board does not have. Taken for the usual one, it would be put one square aside.
    fn of(params: &CharucoParams) -> Vec<Self> {
        let Some(dictionary) = resolve_dictionary(&params.dictionary) else { return Vec::new() };
        let usual = Self { dictionary, rows_above: 0 };
        if !params.rows.is_multiple_of(2) {
            return vec![usual];
        }
        let n_markers = params.columns * params.rows / 2;
        vec![
            usual,
            Self { dictionary: with_others_first(&dictionary, params.columns / 2, n_markers), rows_above: 1 },
        ]
    }
}

/// A dictionary whose markers follow `n` others that a board with its first `n_used` markers does not have: its last
/// ones or, if there are too few, negatives. The detector demands static codes: each dictionary is made once.
fn with_others_first(dictionary: &Dictionary, n: usize, n_used: usize) -> Dictionary {
    static MADE: Mutex<BTreeMap<(&'static str, usize, usize), Dictionary>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    *made.entry((dictionary.name(), n, n_used)).or_insert_with(|| {
        let used = &dictionary.codes()[..n_used];
        let all_bits = u64::MAX >> (u64::BITS as usize - dictionary.bit_count());
        let negatives = used.iter().map(|code| !code & all_bits);
        let others = dictionary.codes()[n_used..].iter().rev().copied().chain(negatives).take(n);
        let codes: Vec<u64> = others.chain(used.iter().copied()).collect();
        let (size, correction) = (dictionary.marker_size(), dictionary.max_correction_bits());
        Dictionary::from_static_codes(dictionary.name(), size, correction, Box::leak(codes.into_boxed_slice()))
            .expect("the codes have the bits of the dictionary")
    })
}

/// Corners identified by the markers, (column, row) and pixel, row by row.
fn marked_places(image: &GreyImage, params: &CharucoParams) -> Option<Vec<([usize; 2], [f64; 2])>> {
    let bytes = bytes_of(image);
    let view = GrayImageView { width: image.width(), height: image.height(), data: &bytes };
    let mut corners = None;
    let detected = Layout::of(params).into_iter().filter_map(|layout| {
        let board = CharucoBoardSpec::new(
            (params.rows + layout.rows_above) as u32,
            params.columns as u32,
            1.0,
            params.marker_ratio as f32,
            layout.dictionary,
        );
        let detector = CharucoDetector::new(DetectorParams::for_board(board)).ok()?;
        let corners = corners.get_or_insert_with(|| detector.detect_corners(&view));
        Some((detector.detect_with_corners(&view, corners).ok()?, layout.rows_above))
    });
    // With an odd number of columns all markers fit both patterns, and the wrong one has no place for the last column.
    let fits = |(found, rows_above): &(CharucoDetection, usize)| {
        (found.markers.len(), found.corners.len(), Reverse(*rows_above))
    };
    let (found, rows_above) = detected.max_by_key(fits)?;
    let (columns, rows) = params.inner();
    let mut places: Vec<([usize; 2], [f64; 2])> = found
        .corners
        .iter()
        .filter_map(|corner| {
            let id = (corner.id as usize).checked_sub(rows_above * columns)?;
            (id < columns * rows).then(|| {
                ([id % columns, id / columns], [f64::from(corner.position.x), f64::from(corner.position.y)])
            })
        })
        .collect();
    places.sort_by_key(|(index, _)| (index[1], index[0]));
    Some(places)
}

/// Fits a corner at every position and drops those that are not saddle points. `None` if the positions do not span a
/// board.
fn first_fits(
    image: &GreyImage,
    places: &[([usize; 2], [f64; 2])],
    reach_squares: f64,
) -> Option<(Vec<[usize; 2]>, Vec<CornerFit>)> {
    let pairs: Vec<_> = places.iter().map(|(index, pixel)| (index.map(|i| i as f64), *pixel)).collect();
    let warp = BoardWarp::fit(&pairs)?;
    let fitted = places.iter().filter_map(|(index, pixel)| {
        let local = warp.shape_at(index.map(|i| i as f64));
        let shape = CrossShape {
            normal_rad: local.normal_rad,
            curvature_per_px: local.curvature_per_px,
            blur_px: BLUR_START_PX,
        };
        let reach = Reach { squares: reach_squares, max_px: FIRST_WINDOW_MAX_PX };
        let window = window_around(image, *pixel, local.square_px, reach, None);
        let fit = fit_corner(&window, start_at(&window, *pixel, shape)?, None)?;
        let shift_px = (fit.position_px[0] - pixel[0]).hypot(fit.position_px[1] - pixel[1]);
        let is_corner = fit.residual_rms <= MAX_RESIDUAL_RATIO * fit.contrast.abs();
        (is_corner && shift_px <= 2.0 * RECENTRE_PX).then_some((*index, fit))
    });
    Some(fitted.unzip())
}
