//! Constants of the corner search, each with its unit and reason.

use least_squares::Damping;

/// Half-side of the refinement window as a fraction of the neighbour distance: windows of neighbours meet and share no
/// pixel, so that their errors are independent.
pub(super) const WINDOW_SQUARES: f64 = 0.5;

/// Fraction of the white margin around a ChArUco marker covered by the windows of its corners: the marker, blurred,
/// stays outside.
pub(super) const CHARUCO_WINDOW_FRACTION: f64 = 0.85;

/// A ChArUco corner whose distance from the smooth board exceeds this many medians of all distances is rejected: for
/// Gaussian errors in the plane, one in thirty million does.
pub(super) const CHARUCO_MAX_MISS_MEDIANS: f64 = 5.0;

/// Longest half-side of the refinement window. Beyond it illumination and edge curvature depart from the model.
pub(super) const WINDOW_MAX_PX: f64 = 48.0;

/// Shortest half-side of the refinement window: fewer pixels do not determine the model.
pub(super) const WINDOW_MIN_PX: f64 = 3.0;

/// Half-side of the first, exploratory window, as a fraction of the neighbour distance.
pub(super) const FIRST_WINDOW_SQUARES: f64 = 0.4;

/// Longest half-side of the exploratory window: edges count as straight within it.
pub(super) const FIRST_WINDOW_MAX_PX: f64 = 9.0;

/// Pixels farther from both edges than this many blur sigmas (plus `EDGE_BAND_MIN_PX`) carry no information about the
/// position and are left out of the refinement window.
pub(super) const EDGE_BAND_SIGMAS: f64 = 3.0;

/// Smallest half-width of the band of used pixels along an edge: enough plateau to determine the grey levels.
pub(super) const EDGE_BAND_MIN_PX: f64 = 2.5;

/// Half-side of the exploratory window in blur sigmas, where that is more: a defocused edge must show its plateaus.
pub(super) const FIRST_WINDOW_BLURS: f64 = 4.0;

/// Initial blur (sigma) of the first fit: wide, so that a start some pixels off still overlaps the edges.
pub(super) const BLUR_START_PX: f64 = 1.5;

/// Admitted blur (sigma): below, the pixel itself is wider (√(1/12) = 0.29); above, no edge is left.
pub(super) const BLUR_RANGE_PX: (f64, f64) = (0.25, 8.0);

/// Damping of a fit, relative to the diagonal of its normal equations. It starts weak, since starts are usable; below the
/// minimum it has no effect, above the maximum a step moves nothing.
pub(super) fn first_damping() -> Damping {
    Damping::new(1e-3, 1e-9, 1e6)
}

/// Iterations of one corner fit; from a usable start fewer than ten are needed.
pub(super) const MAX_ITERATIONS: usize = 30;

/// A step shorter than this ends an exploratory fit. It is still applied; the next one would be far below what the
/// checks resolve and what the refinement needs.
pub(super) const FIRST_STEP_TOLERANCE_PX: f64 = 0.05;

/// A step shorter than this ends a refinement. It is still applied; the remaining distance to the minimum is 0.0008 px
/// (RMS over twenty rendered boards), a tenth of the best corners' sigma.
pub(super) const STEP_TOLERANCE_PX: f64 = 1e-3;

/// After a step of crossing and blur shorter than this, the normal matrix of the previous iteration is reused: it
/// changes by a twentieth of the blur's width, and affects only the path to the minimum, not the minimum.
pub(super) const SAME_SLOPES_STEP_PX: f64 = 0.05;

/// Largest factor by which a step is lengthened for the M-estimator; 1.13 with Gaussian noise, more with dirt in the
/// window.
pub(super) const MAX_STRETCH: f64 = 1.5;

/// An exploratory fit that moved farther than this is repeated in a window around its new position.
pub(super) const RECENTRE_PX: f64 = 1.0;

/// Pixels whose residual exceeds this many noise sigmas lose all weight (Tukey's bisquare).
pub(super) const TUKEY_SIGMAS: f64 = 6.0;

/// A fit whose residual (RMS, pixel noise excluded) exceeds this fraction of the corner's contrast is not a chessboard
/// corner.
pub(super) const MAX_RESIDUAL_RATIO: f64 = 0.22;

/// A fit whose brightness or contrast changes over half the window by more than this fraction of the contrast is on the
/// corner of a single square, or on a border.
pub(super) const MAX_SLOPE_RATIO: f64 = 0.5;

/// A corner with less than this fraction of the board's median contrast does not belong to the board.
pub(super) const MIN_CONTRAST_RATIO: f64 = 0.2;

/// A fit that moves from its initial position by more than this fraction of the neighbour distance is not on the
/// expected corner.
pub(super) const MAX_SHIFT_SQUARES: f64 = 0.2;

/// Edges rotated by more than this from the directions of the neighbours are not the board's.
pub(super) const MAX_TURN_RAD: f64 = 0.3;

/// Fraction of a side's corners that must be verified for the row (column) to count as part of the board.
pub(super) const FULL_LINE_FRACTION: f64 = 0.6;

/// A result (wrong size, incomplete) on at least this fraction of the configured corners is final when a second seed
/// confirms it; results on less may come from clutter.
pub(super) const CONCLUSIVE_FRACTION: f64 = 0.5;

/// Fewest corners of a detection to grow from.
pub(super) const MIN_SEED_CORNERS: usize = 6;

/// Fraction of the darkest and of the brightest pixels clipped when the grey levels are stretched for detection.
pub(super) const STRETCH_CLIP_FRACTION: f64 = 0.005;

/// ChESS response thresholds tried in turn, strict first: the response of a blurred or dim board is weak.
pub(super) const DETECTION_THRESHOLDS: [f32; 2] = [20.0, 5.0];

/// Variance of an ideal quantiser in grey levels squared; no image is less noisy.
pub(super) const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;

/// Corners per term of the lens polynomial (and per image axis): with two, noise distorts it less than the lens does.
pub(super) const CORNERS_PER_TERM: usize = 2;

/// Highest degree of the lens polynomial: radial distortion to the fifth power.
pub(super) const MAX_DEGREE: usize = 5;

/// Sampling step, in pixels, for the grey-level stretch; a prime, to avoid aliasing with rows.
pub(super) const STRETCH_SAMPLE_STEP: usize = 31;

/// Largest image (pixels) that is also searched enlarged: in larger images, squares this small are not a calibration
/// board.
pub(super) const DOUBLE_MAX_PIXELS: usize = 700_000;

/// Smallest side of an image passed to the detector: its corner kernel alone is eleven pixels wide.
pub(super) const DETECTION_MIN_SIDE_PX: usize = 24;

/// Neighbourhood (board squares) over which the corners' scatter about the smooth board is compared with their sigmas.
pub(super) const DISAGREEMENT_REACH: f64 = 2.0;

/// Differences needed for a local estimate of the corners' scatter: with fewer the noise model is more reliable.
pub(super) const DISAGREEMENT_MIN_SAMPLES: usize = 12;

/// Sampling step, in pixels of a window, for the noise estimate: a board leaves thousands, which give its variance to a
/// few per cent.
pub(super) const NOISE_SAMPLE_STEP: usize = 7;

/// Smallest response in the fast search, in sums of four 8-bit pixels: a contrast of about five grey levels.
pub(super) const FAST_MIN_RESPONSE: i16 = 100;

/// Smallest response in the fast search relative to the strongest: blur and dim light reduce it less.
pub(super) const FAST_MIN_RESPONSE_FRACTION: f32 = 0.1;

/// Most crossings in the fast search: those of a large board and as many false ones.
pub(super) const FAST_MAX_PEAKS: usize = 600;

/// Cosine within which an edge points at the next corner: the ring gives its direction to a few degrees.
pub(super) const FAST_POINTING_COSINE: f32 = 0.96;

/// Cosine within which an edge is straight through its corner.
pub(super) const FAST_POINTING_BACK_COSINE: f32 = 0.9;

/// Squares larger than this (px) are checked before the fit: where the brightness of the four squares does not
/// alternate there is no corner.
pub(super) const PRECHECK_MIN_SQUARE_PX: f64 = 12.0;

/// Smallest step between the dark and the bright squares in that check, relative to the board's contrast (half the step
/// between its squares): half of what a corner needs.
pub(super) const PRECHECK_MIN_CONTRAST_RATIO: f64 = 0.2;

/// Half-side of the square with whose mean a disc's pixels are compared: the image's longer side divided by each of
/// these in turn.
pub(super) const BLOB_WINDOW_DIVISORS: [usize; 4] = [24, 48, 12, 6];

/// A pixel belongs to a blob if it differs from the mean by more than this fraction of its surroundings' standard
/// deviation.
pub(super) const BLOB_THRESHOLD_SPREADS: f64 = 0.3;

/// Smallest area of a blob: below, its rim has too few pixels for the ten parameters of a disc.
pub(super) const BLOB_MIN_AREA_PX: f64 = 20.0;

/// Largest relative difference between a blob's area and that of the ellipse with its spread: a square differs by 5 %,
/// and so does a small rasterised disc.
pub(super) const BLOB_MAX_FILL_ERROR: f64 = 0.15;

/// Largest length-to-width ratio of a blob: a disc tilted by 75°.
pub(super) const BLOB_MAX_ASPECT: f64 = 4.0;

/// Fewest blobs for a grid search.
pub(super) const CIRCLES_MIN: usize = 4;

/// Number of seed blobs of the grid search, and of neighbours of each that may be a step.
pub(super) const GRID_SEEDS: usize = 6;
/// See [`GRID_SEEDS`].
pub(super) const GRID_NEIGHBOURS: usize = 8;

/// Largest distance of the next disc from the position predicted by the last step, relative to the step.
pub(super) const GRID_MAX_MISS_STEPS: f64 = 0.3;

/// Half-width of the band of pixels along a disc's rim, and the largest fraction of the gap to the next disc that it
/// may cover.
pub(super) const DISC_BAND_PX: f64 = 5.0;
/// See [`DISC_BAND_PX`].
pub(super) const DISC_GAP_FRACTION: f64 = 0.45;

/// Iterations of a disc's fit, both stages.
pub(super) const DISC_MAX_ITERATIONS: usize = 60;

/// A fit whose residual exceeds this fraction of half the contrast is not a disc.
pub(super) const DISC_MAX_RESIDUAL_RATIO: f64 = 0.25;

/// A fit that moves farther than this from its blob's centroid is not on the disc.
pub(super) const DISC_MAX_SHIFT_PX: f64 = 2.0;

/// Iterations between the correction of the discs' centres and the map fitted to them: the second changes the
/// correction by a hundredth of itself.
pub(super) const ECCENTRICITY_ROUNDS: usize = 3;

/// Sample points on a rim, an even number.
pub(super) const RIM_POINTS: usize = 32;

/// Fewest corners, fraction of the board's corners, and lines in both directions of a partial board: clutter has fewer.
pub(super) const PART_MIN_CORNERS: usize = 12;
/// See [`PART_MIN_CORNERS`].
pub(super) const PART_MIN_FRACTION: f64 = 0.25;
/// See [`PART_MIN_CORNERS`].
pub(super) const PART_MIN_LINES: usize = 3;

/// A corner closer to the image's border than this fraction of a square may be missing: its window is cut off.
pub(super) const PART_MARGIN_SQUARES: f64 = 0.5;

/// Most undetected corners of a partial board, relative to those detected: they are assumed to be covered.
pub(super) const PART_MAX_UNEXPLAINED_FRACTION: f64 = 0.4;

/// Margin by which every other placement of a partial board must leave more corners unexplained, relative to the
/// board's shorter line: a shift by one line leaves nearly a whole line unexplained.
pub(super) const PART_RUNNER_UP_LINES: f64 = 0.6;

/// A corner of a partial board whose sigma exceeds this many medians of all sigmas is affected by the occlusion.
pub(super) const PART_MAX_SIGMA_MEDIANS: f64 = 4.0;
