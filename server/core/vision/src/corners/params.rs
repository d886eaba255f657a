//! Constants of the corner search, each with its unit and its reason.

/// Refinement window, as a fraction of the neighbour distance to each side. Below one half so that the
/// next edge, blurred, stays outside.
pub(super) const WINDOW_SQUARES: f64 = 0.4;

/// Share of the white rim around a ChArUco marker that the windows of its corners take: the marker, blurred, stays outside.
pub(super) const CHARUCO_WINDOW_SHARE: f64 = 0.85;

/// A ChArUco corner that misses the smooth board by more than this many medians of all misses is none: of a Gaussian's
/// distances in the plane one in thirty million is.
pub(super) const CHARUCO_MAX_MISS_MEDIANS: f64 = 5.0;

/// Longest half-side of the refinement window. Beyond it light and edge curvature leave the model.
pub(super) const WINDOW_MAX_PX: f64 = 32.0;

/// Shortest half-side of the refinement window: fewer pixels do not determine the model.
pub(super) const WINDOW_MIN_PX: f64 = 3.0;

/// Half-side of the first, exploratory window, as a fraction of the neighbour distance.
pub(super) const FIRST_WINDOW_SQUARES: f64 = 0.4;

/// Longest half-side of the exploratory window: edges count as straight within it.
pub(super) const FIRST_WINDOW_MAX_PX: f64 = 9.0;

/// Pixels farther from both edges than this many blur sigmas (plus `EDGE_BAND_MIN_PX`) say nothing about
/// the position and are left out of the refinement window.
pub(super) const EDGE_BAND_SIGMAS: f64 = 3.0;

/// Smallest half-width of the band of used pixels along an edge: enough plateau to fix the grey levels.
pub(super) const EDGE_BAND_MIN_PX: f64 = 2.5;

/// Half-side of the exploratory window in blur sigmas, where that is more: a defocused edge must show its plateaus.
pub(super) const FIRST_WINDOW_BLURS: f64 = 4.0;

/// Blur (sigma) with which the first fit starts: wide, so that a start some pixels off still feels the edges.
pub(super) const BLUR_START_PX: f64 = 1.5;

/// Admitted blur (sigma): below, the pixel itself is wider (√(1/12) = 0.29); above, no edge is left.
pub(super) const BLUR_RANGE_PX: (f64, f64) = (0.25, 8.0);

/// Iterations of one corner fit; from a usable start fewer than ten are needed.
pub(super) const MAX_ITERATIONS: usize = 30;

/// A step shorter than this ends an exploratory fit: it is still taken, and the next one would be far below what the
/// checks resolve and what the refinement needs.
pub(super) const FIRST_STEP_TOLERANCE_PX: f64 = 0.05;

/// A step shorter than this ends a refinement: it is still taken, and what is then left to the minimum is 0.0008 px (RMS
/// over twenty rendered boards), a tenth of the best corners' sigma.
pub(super) const STEP_TOLERANCE_PX: f64 = 1e-3;

/// After a step shorter than this, of the crossing and of the blur, the normal matrix is that of the look before: it
/// changes by a twentieth of the blur's reach, and only the way to the minimum depends on it, not the minimum.
pub(super) const SAME_SLOPES_STEP_PX: f64 = 0.05;

/// Most by which a step is stretched for the M-estimator's sake; 1.13 with Gaussian noise, more where dirt is in sight.
pub(super) const MAX_STRETCH: f64 = 1.5;

/// An exploratory fit that moved farther than this is repeated in a window around its new place.
pub(super) const RECENTRE_PX: f64 = 1.0;

/// Pixels whose residual exceeds this many noise sigmas lose all weight (Tukey's bisquare).
pub(super) const TUKEY_SIGMAS: f64 = 6.0;

/// A fit that leaves more than this fraction of the corner's contrast unexplained (RMS, pixel noise apart) is no
/// chessboard corner.
pub(super) const MAX_MISFIT_RATIO: f64 = 0.22;

/// A fit whose brightness or contrast changes over half the window by more than this share of the contrast mistakes the
/// corner of a single square, or a border, for a crossing.
pub(super) const MAX_SLOPE_RATIO: f64 = 0.5;

/// A corner with less than this fraction of the board's median contrast is no corner of the board.
pub(super) const MIN_CONTRAST_RATIO: f64 = 0.2;

/// A fit that leaves its start by more than this fraction of the neighbour distance found something else.
pub(super) const MAX_SHIFT_SQUARES: f64 = 0.2;

/// Edges that turned by more than this from the directions of the neighbours belong to something else.
pub(super) const MAX_TURN_RAD: f64 = 0.3;

/// Share of a side's corners that must be verified for the row (column) to count as part of the board.
pub(super) const FULL_LINE_SHARE: f64 = 0.6;

/// A verdict (wrong size, incomplete) on at least this share of the configured corners is final when a second seed
/// confirms it; verdicts on less may come from clutter.
pub(super) const VERDICT_SHARE: f64 = 0.5;

/// Fewest corners of a detection worth growing from.
pub(super) const MIN_SEED_CORNERS: usize = 6;

/// Share of the darkest and of the brightest pixels clipped when the grey levels are stretched for detection.
pub(super) const STRETCH_CLIP_SHARE: f64 = 0.005;

/// ChESS response thresholds tried in turn, strict first: a blurred or dim board answers weakly.
pub(super) const DETECTION_THRESHOLDS: [f32; 2] = [20.0, 5.0];

/// Variance of an ideal quantiser in grey levels squared; no image is less noisy.
pub(super) const QUANTISATION_VARIANCE: f64 = 1.0 / 12.0;

/// Corners per term of the lens polynomial (and per image axis): with two, noise bends it less than the lens does.
pub(super) const CORNERS_PER_TERM: usize = 2;

/// Highest degree of the lens polynomial: radial distortion to the fifth power.
pub(super) const MAX_DEGREE: usize = 5;

/// Every how many pixels one is looked at for the grey-level stretch; a prime, so as not to fall in step with rows.
pub(super) const STRETCH_SAMPLE_STEP: usize = 31;

/// Largest image (pixels) that is looked at enlarged: in more pixels, squares this small are no calibration board.
pub(super) const DOUBLE_MAX_PIXELS: usize = 700_000;

/// Smallest side of a picture given to the detector: its corner kernel alone is eleven pixels wide.
pub(super) const DETECTION_MIN_SIDE_PX: usize = 24;

/// Neighbourhood (board squares) over which corners must agree with the smooth board as well as their sigmas say.
pub(super) const DISAGREEMENT_REACH: f64 = 2.0;

/// Differences needed for a local estimate of the corners' scatter: fewer say less than the noise model does.
pub(super) const DISAGREEMENT_MIN_SAMPLES: usize = 12;

/// Every how many pixels of a window one serves the estimate of the noise: a board leaves thousands, which know its
/// variance to some percent.
pub(super) const NOISE_SAMPLE_STEP: usize = 7;

/// Weakest answer of the quick look, in sums of four 8-bit pixels: a contrast of about five grey levels.
pub(super) const QUICK_MIN_RESPONSE: i16 = 100;

/// Weakest answer of the quick look as a share of the strongest: blur and dim light cost a corner less.
pub(super) const QUICK_MIN_RESPONSE_SHARE: f32 = 0.1;

/// Most crossings of the quick look: a large board and as many false ones.
pub(super) const QUICK_MAX_PEAKS: usize = 600;

/// Cosine within which an edge points at the next corner: the ring gives its direction to a few degrees.
pub(super) const QUICK_POINTING_COSINE: f32 = 0.96;

/// Cosine within which an edge goes straight through its corner.
pub(super) const QUICK_POINTING_BACK_COSINE: f32 = 0.9;

/// Squares larger than this show their brightness between the edges: a place where the four squares do not alternate
/// is no corner and is not fitted (px).
pub(super) const GLANCE_MIN_SQUARE_PX: f64 = 12.0;

/// Least step between the dark and the bright squares seen by the glance, as a share of the board's contrast (half the
/// step between its squares): half of what a corner needs.
pub(super) const GLANCE_MIN_CONTRAST_RATIO: f64 = 0.2;

/// Half-sides of the square whose mean a disc's pixels are compared with, as the share 1/n of the picture's longer side.
pub(super) const BLOB_WINDOW_SHARES: [usize; 4] = [24, 48, 12, 6];

/// A pixel belongs to a spot from this share of its surroundings' spread on.
pub(super) const BLOB_THRESHOLD_SPREADS: f64 = 0.3;

/// Smallest area of a spot: below, its rim has too few pixels for the ten parameters of a disc.
pub(super) const BLOB_MIN_AREA_PX: f64 = 20.0;

/// Most by which a spot's area may differ from that of the ellipse with its spread: a square differs by 5 %, a small disc
/// on its raster by as much.
pub(super) const BLOB_MAX_FILL_ERROR: f64 = 0.15;

/// Longest spot, length by width: a disc tilted by 75°.
pub(super) const BLOB_MAX_ASPECT: f64 = 4.0;

/// Fewest spots worth looking at.
pub(super) const CIRCLES_MIN: usize = 4;

/// Spots that the search for the grid starts from, and neighbours of each that may be a step.
pub(super) const GRID_SEEDS: usize = 6;
/// See [`GRID_SEEDS`].
pub(super) const GRID_NEIGHBOURS: usize = 8;

/// Most by which the next disc misses the place that the last step promises, as a share of the step.
pub(super) const GRID_MAX_MISS_STEPS: f64 = 0.3;

/// Half-width of the band of pixels along a disc's rim, and most of the gap to the next disc that it takes.
pub(super) const DISC_BAND_PX: f64 = 5.0;
/// See [`DISC_BAND_PX`].
pub(super) const DISC_GAP_SHARE: f64 = 0.45;

/// Iterations of a disc's fit, both stages.
pub(super) const DISC_MAX_ITERATIONS: usize = 60;

/// A fit that leaves more than this share of half the contrast unexplained is no disc.
pub(super) const DISC_MAX_MISFIT_RATIO: f64 = 0.25;

/// A fit that leaves its spot's centroid by more found something else.
pub(super) const DISC_MAX_SHIFT_PX: f64 = 2.0;

/// Rounds in which the correction of the discs' centres and the map through them are taken from each other: the second
/// changes it by a hundredth of itself.
pub(super) const ECCENTRICITY_ROUNDS: usize = 3;

/// Points of a rim, an even number.
pub(super) const RIM_POINTS: usize = 32;

/// Fewest corners, share of the board's and lines both ways of a part of a board: less is found in clutter as well.
pub(super) const PART_MIN_CORNERS: usize = 12;
/// See [`PART_MIN_CORNERS`].
pub(super) const PART_MIN_SHARE: f64 = 0.25;
/// See [`PART_MIN_CORNERS`].
pub(super) const PART_MIN_LINES: usize = 3;

/// A corner nearer to the picture's rim than this share of a square need not be seen: its window is cut off.
pub(super) const PART_MARGIN_SQUARES: f64 = 0.5;

/// Most corners that a part leaves unexplained, as a share of those seen: covered by something.
pub(super) const PART_MAX_UNEXPLAINED_SHARE: f64 = 0.4;

/// Every other way to lay a part into the board must leave so much more unexplained, as a share of the board's shorter
/// line: a line beyond the board's rim, seen nearly whole.
pub(super) const PART_RUNNER_UP_LINES: f64 = 0.6;

/// A corner of a part of a board whose sigma is more medians of all than this is cut off by what covers the board.
pub(super) const PART_MAX_SIGMA_MEDIANS: f64 = 4.0;
