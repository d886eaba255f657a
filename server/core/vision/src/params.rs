//! Constants of the centreline extraction, each with its unit and reason.

/// Side of the square tiles in which the noise level is estimated: small compared with changes of ambient light, large
/// enough for 200 samples on a subsampled grid.
pub const NOISE_TILE_PX: usize = 64;
/// Distance between sampled pixels inside a noise tile: 256 samples give the noise to 5 %.
pub const NOISE_STRIDE_PX: usize = 4;
/// Smallest noise accepted, as a fraction of full scale: the rounding to 8 bits (1/√12 grey levels).
pub const NOISE_FLOOR: f32 = 0.29 / 255.0;
/// Neighbouring columns sampled in every noise tile by the fast extraction: 256 samples, as many as on the grid. With
/// half as many, faint lines break.
pub const NOISE_COLUMNS: usize = 16;

/// Largest ratio of a tile's box noise to that of the quieter tiles around it.
pub const NOISE_OVER_NEIGHBOURS: f32 = 3.0;

/// Largest width along the column, relative to the width its level searches for, for which a line belongs to a level:
/// the geometric mean between one level and the next is 1.41, and boxes of one width find lines up to 1.6 times as
/// wide.
pub const LEVEL_BAND: f32 = 1.25;
/// The same for the image itself, while it contains nothing wider: lines of up to 1.6 times the typical width, such as
/// some at 45°, measure 1.35 times, and a level costs as much time as the image.
pub const LEVEL_FIRST_BAND: f32 = 1.35;
/// Up to this ratio to the width its level searches for, a line always belongs to that level; above, a coarser level
/// that fits it as well takes precedence.
pub const LEVEL_SURE: f32 = 1.0;
/// Two crossings of one column closer than this, in widths of the wider, are detections of the same line.
pub const LEVEL_NEAR_WIDTHS: f32 = 0.75;
/// Fraction of a coarse line that may coincide with finer lines: beyond, it is several of them merged.
pub const LEVEL_CLAIMED_FRACTION: f32 = 0.3;
/// Largest step between pieces of one line from two levels, in line widths.
pub const LEVEL_STITCH_WIDTHS: f32 = 0.5;
/// Unexplained light in neighbouring strips that triggers another level, in units of what a line of that level lights
/// in one strip. Where lines touch or an edge is blurred it is less, and a level costs as much as the image.
pub const LEVEL_LEAST_LIGHT: f32 = 8.0;
/// Narrowest line, relative to the width its level searches for, that is accepted from a coarser level: narrower ones
/// belong to the finer level.
pub const LEVEL_NARROWEST: f32 = 0.5 * LEVEL_SURE;
/// Full width across the line, px, of the widest light accepted as a line: the widest supported line, 40 px, plus a
/// quarter. A part that is lit all over is wider.
pub const LEVEL_WIDEST_PX: f32 = 50.0;
/// Smallest length, in its own width, of a line from a coarser level: a glow is about as long as it is wide.
pub const LEVEL_LEAST_LENGTH_WIDTHS: f32 = 2.5;
/// Excess of a measured width's square over the square of the line's width along the column, rows² of the level: the
/// height is the mean of three rows, which is less than the line's (3 to 5 px: 4.4 to 4.7).
pub const LEVEL_MEASURED_PX2: f32 = 4.4;
/// Columns over which a line of a coarser level is tested for being two: enough to average speckle.
pub const TOUCHING_COLUMNS: usize = 256;
/// Columns averaged to one sample: speckle is not correlated over more.
pub const TOUCHING_BLOCK_COLUMNS: usize = 4;
/// Fewest of them: the scatter is then known to a quarter.
pub const TOUCHING_LEAST_BLOCKS: usize = 8;
/// Rows on either side that are tested, in widths of the coarse line: two maxima lie within half of it.
pub const TOUCHING_REACH_WIDTHS: f32 = 0.75;
/// Rows averaged to reduce speckle, in widths of the coarse line.
pub const TOUCHING_SMOOTH_WIDTHS: f32 = 0.12;
/// Depth of the minimum relative to the lower maximum: two Gaussian profiles a width apart have 6 %, less after
/// averaging over rows.
pub const TOUCHING_DIP: f32 = 0.03;
/// The same in standard deviations, for both maxima.
pub const TOUCHING_SIGMAS: f32 = 4.5;
/// Rows lit by a line, in its widths: a Gaussian profile does not exceed the noise over more.
pub const LEVEL_LIT_WIDTHS: f32 = 3.0;
/// Rows of the level that cells and their margins add to that.
pub const LEVEL_LIT_PX: f32 = 12.0;

/// Distance from a peak within which its base is searched while measuring widths. Lines wider than half of this are not
/// laser lines.
pub const WIDTH_SEARCH_PX: usize = 32;
/// Smallest prominence, in noise standard deviations, of peaks used for the width.
pub const WIDTH_MIN_SNR: f32 = 8.0;
/// Line width (full width at half height) assumed when there is no such peak, and the limits of accepted widths.
pub const WIDTH_DEFAULT_PX: f32 = 4.0;
/// See [`WIDTH_DEFAULT_PX`]: narrower than the pixel grid resolves.
pub const WIDTH_MIN_PX: f32 = 2.0;
/// See [`WIDTH_DEFAULT_PX`].
pub const WIDTH_MAX_PX: f32 = 12.0;

/// Number of strips from which the fast extraction samples one column each to estimate the line width: five lines then
/// give 80 widths, whose median is accurate to 3 %.
pub const WIDTH_FEW_COLUMNS: usize = 16;
/// Number of widths that is sufficient: their median is accurate to 4 %.
pub const WIDTH_ENOUGH: usize = 48;
/// Columns to either side over which the width of a crossing is averaged: single ones are dominated by speckle.
pub const WIDTH_NEIGHBOURS: usize = 4;

/// Columns of a cell, over which the pass over all pixels averages. As many as one vector of derivatives has lanes, and
/// few enough that a line at 45 degrees stays bright.
pub const CELL_WIDTH_PX: usize = 8;
/// Rows of a cell: half of the widest flank of a narrow line.
pub const CELL_HEIGHT_PX: usize = 4;
/// Columns searched together, a whole number of cells: with more, sloping lines cover more rows; with fewer, there are
/// more steps.
pub const STRIP_WIDTH_PX: usize = 16;
/// Smallest brightness of a searched cell over its surroundings, in its standard deviations. A line at the threshold of
/// candidates has seven; for pure noise one cell in three thousand passes.
pub const CELL_MIN_SNR: f32 = 5.0;
/// Rows beyond bright cells that are searched as well: the columns of a sloping line share a cell, so not all of its
/// middle lies in it.
pub const CELL_MARGIN_PX: usize = 2;
/// Cells above and below among which the darkest is used for comparison: farther than the flank of the widest line (37
/// pixels).
pub const CELLS_BESIDE: usize = 10;
/// Cells from the border within which only the side away from it is compared.
pub const CELLS_AT_BORDER: usize = 4;

/// Height of the detection box in line widths: nearly a matched filter for a Gaussian profile.
pub const BOX_HEIGHT_WIDTHS: f32 = 0.7;
/// Distance of the flanking boxes in line widths: the line's own light has fallen below 1 % there.
pub const FLANK_DISTANCE_WIDTHS: f32 = 1.5;
/// Detection threshold on box minus brighter flank, in its standard deviations. Pure noise exceeds it a few dozen times
/// per megapixel, never in [`MIN_SEGMENT_COLUMNS`] neighbouring columns.
pub const CANDIDATE_MIN_SNR: f32 = 4.0;
/// Two candidates of one column closer than this, in line widths, are detections of the same line.
pub const CANDIDATE_SEPARATION_WIDTHS: f32 = 0.75;

/// Largest distance of a candidate from the extrapolated segment, in line widths. Beyond it a new segment begins.
pub const LINK_GATE_WIDTHS: f32 = 0.5;
/// Smallest link gate: candidates are on whole pixels.
pub const LINK_GATE_MIN_PX: f32 = 2.0;
/// Columns without a candidate that a segment may bridge (a dark speckle); the line is still measured there.
pub const LINK_MAX_GAP_COLUMNS: usize = 3;
/// Columns over which the heading of a segment is averaged.
pub const LINK_HEADING_COLUMNS: usize = 6;
/// Shortest segment kept: a slot of 1 mm at 6 px/mm is as long.
pub const MIN_SEGMENT_COLUMNS: usize = 6;
/// Median signal-to-noise ratio required of a short segment.
pub const SHORT_SEGMENT_MIN_SNR: f32 = 8.0;
/// Segments longer than this are accepted at the candidate threshold.
pub const LONG_SEGMENT_COLUMNS: usize = 24;
/// At its ends a segment is trimmed to where the line has this fraction of its intensity further in: beyond is the blur
/// of the end, not a line.
pub const END_INTENSITY_FRACTION: f32 = 0.3;
/// Most columns examined for that: two widths of the widest line.
pub const END_MAX_COLUMNS: usize = 128;

/// Length of the blur of an end, in line widths: the columns within it are compared with the line further in.
pub const END_CHECK_WIDTHS: f32 = 1.2;
/// Length, in line widths, of the line further in with which an end is compared.
pub const END_REFERENCE_WIDTHS: f32 = 3.0;
/// An end is trimmed where it departs from the parabola through the line further in by this many standard deviations.
pub const END_DEPARTURE_SIGMAS: f64 = 3.0;
/// Smaller departures, in pixels, are kept: a bend, not a blurred end.
pub const END_DEPARTURE_MIN_PX: f64 = 0.5;

/// Scale of the Gaussian derivatives across the line, in standard deviations of the line's profile. 1 is best for pure
/// camera noise, ∞ for pure speckle; 1.6 loses 18 % for the former and 27 % for the latter.
pub const STEGER_SIGMA_PER_LINE_SIGMA: f32 = 1.6;
/// Ratio of consecutive precomputed kernel scales.
pub const STEGER_SCALE_STEP: f32 = 1.25;
/// Smallest scale across the line: below it the sampled derivatives are no longer Gaussian ones.
pub const STEGER_SIGMA_MIN_PX: f32 = 1.2;
/// Largest scale across the line.
pub const STEGER_SIGMA_MAX_PX: f32 = 16.0;
/// Kernels are truncated at this many standard deviations.
pub const STEGER_CUT_SIGMAS: f32 = 3.0;
/// Steps allowed from a candidate to the pixel that holds the ridge.
pub const STEGER_MAX_STEPS: usize = 6;
/// Offset from a pixel's centre within which derivatives there give the ridge to 0.01 px; beyond, the window is moved.
pub const RIDGE_TRUSTED_PX: f32 = 1.5;
/// Crossings nearer than this, in line widths, to the first or last row are left out: part of the line's
/// profile is outside the image, and what remains is off-centre.
pub const BORDER_WIDTHS: f32 = 1.0;
/// Contrast, relative to a line's own, above which a neighbour matters; fainter ones are the line's own speckled
/// flanks.
pub const RIVAL_CONTRAST: f32 = 0.2;
/// If another line is closer than this, in line widths, the two merge and neither centre is accepted.
pub const CLEARANCE_MIN_WIDTHS: f32 = 1.7;
/// Lines farther apart than this, in line widths, do not disturb each other: the kernel of a line twice as wide as the
/// typical one ends there.
pub const CLEARANCE_MATTERS_WIDTHS: f32 = 6.0;
/// Near another line the kernel is that of a line with a width of this fraction of the distance: the neighbour is then
/// four standard deviations away.
pub const CLEARANCE_KERNEL_WIDTH: f32 = 0.37;
/// Largest difference of the two flanks, in contrasts, that is treated as a gradient of ambient light; beyond, the
/// flank contains other light and the kernel avoids it.
pub const FLANK_STEP_EVEN: f32 = 0.2;
/// Difference of the two flanks, in contrasts, beyond which another line or a bright edge touches this one and
/// no centre is accepted.
pub const FLANK_STEP_MAX: f32 = 0.6;
/// Half-height of the centroid window in line widths.
pub const CENTROID_HALF_HEIGHT_WIDTHS: f32 = 1.2;

/// Excess of the square of a measured width over that of the line, px², as a polynomial in 1 over that square: fitted
/// to the widths of Gaussian profiles from 1.5 to 60 px.
pub const HEIGHT_EXCESS: [f32; 3] = [4.913, -21.55, 243.4];
/// Measured width of a line of 1.5 px, the narrowest that is resolved.
pub const HEIGHT_LEAST_PX: f32 = 2.86;

/// Half-length of the longest window of the fit along the line, in line widths.
pub const ALONG_HALF_LENGTH_WIDTHS: f32 = 2.2;
/// Largest half-length of that window, in columns.
pub const ALONG_MAX_HALF_LENGTH: usize = 32;
/// Half-length of the shortest window, in columns: six points for three unknowns.
pub const ALONG_MIN_HALF_LENGTH: usize = 3;
/// A longer window is used while its estimate agrees with the shorter one's within this many standard deviations of
/// their difference; otherwise the line bends there and the shorter one keeps the detail.
pub const ALONG_AGREEMENT_SIGMAS: f64 = 3.0;
/// Least variance of that difference, as a fraction of the shorter window's: near the end of a line both windows hold
/// nearly the same crossings.
pub const ALONG_MIN_DIFFERENCE: f64 = 0.1;

/// Lag, in columns, of the third differences that measure the scatter of the points.
pub const SCATTER_LAG: usize = 4;
/// Lag of the third differences that measure the correlation of the noise between columns.
pub const SCATTER_SHORT_LAG: usize = 2;
/// Most third differences used per image, in runs of eight columns: they give the scatter to about 5 %.
pub const SCATTER_MAX_SAMPLES: usize = 2000;
/// Fewest third differences for an estimate; with fewer the prior is used.
pub const SCATTER_MIN_SAMPLES: usize = 40;
/// Squared normalised differences are clipped here (3σ), so that corners and jumps are not counted as noise.
pub const SCATTER_CLIP: f32 = 9.0;
/// Speckle coefficient assumed when an image holds too few points to measure it: contrast 0.3, grain 2 px.
pub const SPECKLE_PRIOR: f64 = 0.2;
