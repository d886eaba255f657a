//! Constants of labelling, triangulation and statistics, each with its unit and reason.

/// Distance between the points of a piece that speak for its label, scan columns (rows). Neighbours share their
/// noise over a few columns anyway; 16 keeps forty frames of a megapixel below 20 000 samples. How densely is looked, no
/// limit of a decision: a sample counts by the length that it stands for.
pub const SAMPLE_STRIDE_PX: usize = 16;
/// Fewest samples of a piece; shorter pieces are sampled more densely.
pub const MIN_SAMPLES: usize = 4;

/// Length on either side over which the slope of a line is taken when looking for kinks, in line widths: the extraction
/// smooths over about as much.
pub const KINK_SPAN_WIDTHS: f64 = 1.0;
/// Change of slope (across per along, px/px) at which a segment is cut in two: two lines may have been joined
/// there. Cutting a line that merely bends costs nothing, its pieces are labelled alike.
pub const KINK_SLOPE: f64 = 0.3;
/// The same in standard deviations of the change of slope, so that speckle does not cut lines into fragments.
pub const KINK_SIGMAS: f64 = 5.0;
/// Largest step between neighbouring points that stays one line, in line widths along the scan column (row): as far as
/// the extraction links.
pub const KINK_STEP_WIDTHS: f64 = 0.5;
/// Steps at which a segment is cut: lines of two orders that touch end to end are extracted as one. Per entry: length on
/// either side through which a line is laid, and the smallest step that counts, both in line widths.
pub const STEP_LIMITS: [(f64, f64); 2] = [(1.6, 0.06), (3.2, 0.04)];
/// The same in standard deviations of the step; σ may be understated and correlated.
pub const STEP_LIMIT_SIGMAS: f64 = 5.0;
/// What is left out on either side of a cut, in line widths: the place of a joint is known no better.
pub const CUT_TRIM_WIDTHS: f64 = 0.4;
/// Frames before and after in which the joints of a line are looked for.
pub const JOINT_FRAMES: usize = 2;
/// How near to the end of a line in a neighbouring frame a line must pass to be cut there, in line widths.
pub const JOINT_REACH_WIDTHS: f64 = 0.4;
/// Least distance between such cuts: an end that wanders from frame to frame shall not leave crumbs, in line widths.
pub const JOINT_SPACING_WIDTHS: f64 = 2.4;
/// Two ends that face each other across one or two lost points, this far apart across the line, are no joint, in line
/// widths.
pub const JOINT_GAP_WIDTHS: f64 = 0.06;
/// The same in standard deviations of their difference, over a gap of up to one correlation length: a dark speckle.
pub const JOINT_GAP_SIGMAS: f64 = 4.0;
/// Shortest piece that is labelled, points: fewer do not determine a slope.
pub const MIN_PIECE_POINTS: usize = 4;

/// A line that moves by less than this fraction of the line pitch between frames is the same line.
pub const TRACK_GATE_PITCHES: f64 = 0.15;
/// Weight of one sample's bond to the same line in the next frame. Two bonds (before, after) weigh as much as one
/// agreement with another order: continuity propagates a label, it does not overrule a second look.
pub const TRACK_WEIGHT: f64 = 0.5;

/// Weight of the bond between pieces cut at a kink, per sample and at most one sample: a bend is more likely than two
/// joined lines.
pub const JOINT_WEIGHT: f64 = 1.0;
/// Pieces shorter than this do not hold a label against the line they hang on, in line widths.
pub const STUB_WIDTHS: f64 = 6.4;

/// Longest gap across which a line is continued within its frame, in line pitches (an object on a plate).
pub const CONTINUATION_GAP_PITCHES: f64 = 4.0;
/// Largest deviation of the continued line, in line pitches.
pub const CONTINUATION_GATE_PITCHES: f64 = 0.06;
/// Points at the end of a piece to which the continuation is fitted.
pub const CONTINUATION_POINTS: usize = 40;
/// Weight of a continuation at gap zero, in samples' worth of bonds; it decreases with the gap.
pub const CONTINUATION_WEIGHT: f64 = 2.0;

/// Weight of the bond between two sections of one piece, in samples' worth: little more than one second look, so that
/// two samples separate them and a single one does not.
pub const SECTION_WEIGHT: f64 = 1.25;

/// Second looks per sample with which sections may form an overlooked surface: a third of a good one.
pub const OVERLOOKED_SHARE: f64 = 0.4;
/// Iterations of the search for overlooked surfaces: one uncovers the next at most a few times.
pub const OVERLOOKED_ROUNDS: usize = 4;

/// Iterations of joint shifts by one order: one uncovers the next at most a few times.
pub const SHIFT_ROUNDS: usize = 4;

/// Cost of one sample per line of its own column that is on the wrong side. The order of lines never changes on solid
/// parts, so this weighs more than a single agreement.
pub const RANK_COST: f64 = 1.5;

/// Cost of a sample that misses the light sheet or lies outside the depth range. Not more than a rank: parts may exceed
/// the stated depths, and the neighbours of such a line must not be forced into another order.
pub const OUTSIDE_COST: f64 = 1.5;
/// Cost of leaving a piece unlabelled, per sample. The evidence must be this much against every label before the piece
/// is treated as a ghost.
pub const UNLABELLED_COST: f64 = 0.4;

/// Agreement tolerance between two orders in standard deviations of their difference.
pub const AGREEMENT_SIGMAS: f64 = 5.0;
/// Fraction of the tolerance within which a second look supports a label: 3 σ. On a part one wrap high the next label
/// is 0.8 mm off, and chance agreement within 5 σ must not outweigh agreement within one.
pub const CLOSE_TOLERANCES: f64 = 0.6;
/// Smallest tolerance as a fraction of depth: errors of stage, straightness and model (0.06 mm at 400 mm).
pub const AGREEMENT_FLOOR_GRATING: f64 = 1.5e-4;
/// The same for plane models, which do not represent the bow of the outer lines (0.4 mm at 400 mm).
pub const AGREEMENT_FLOOR_PLANES: f64 = 1.0e-3;
/// Contribution of the calibration's own error to the tolerance, in its standard deviations: orders share most of that
/// error.
pub const SYSTEMATIC_SIGMAS: f64 = 2.0;
/// Smallest radius of a surface that is allowed for when a patch is extended, as a share of the depth: 10 mm at 400 mm.
/// Parts are as large as a station sees.
pub const PATCH_RADIUS_RELATIVE: f64 = 0.025;
/// Beyond this many tolerances apart two surfaces contradict each other; in between they say nothing.
pub const CONTRADICTION_TOLERANCES: f64 = 2.0;
/// Steepest patch (mm of depth per mm across the view) used as evidence: on steeper ones depth is not a function.
pub const PATCH_MAX_GRADIENT: f64 = 3.0;
/// Radius of a patch in sample distances: patches overlap their neighbours without extending past them.
pub const PATCH_RADIUS_SPACINGS: f64 = 0.8;
/// Frame distance from which lines of one order observe different places; closer ones are neighbours on a slope.
pub const SAME_ORDER_MIN_FRAMES: usize = 3;

/// Iterations of the relaxation; marginals converge within twenty.
pub const RELAX_ROUNDS: usize = 40;
/// Sharpness of marginals in the first and in the last iteration (inverse temperature, per sample).
pub const RELAX_SHARPNESS: [f64; 2] = [0.7, 12.0];
/// Fraction of the iterations after which "none" takes part: by then lines have converged to their ranks.
pub const UNLABELLED_FROM: f64 = 0.5;
/// Most sweeps of hard assignment after relaxation.
pub const MAX_SWEEPS: usize = 30;
/// Smallest margin per sample of a label over the next best one; with less it is doubtful.
pub const LABEL_MARGIN: f64 = 0.3;
/// Margin per sample by which another order may lead in depths, ranks and second looks alone; if it leads by more, the
/// label came from continuity alone.
pub const OVERRULED_MARGIN: f64 = 0.2;
/// Support per sample required from continuity where nothing else prefers an order: the same line before and after, not
/// on one side only.
pub const CONTINUITY_ALONE: f64 = 0.7;
/// Smallest margin per sample of a connected group over the same group shifted by an order. A fifth of a second look:
/// the group is observed twice over a good part of its area.
pub const GROUP_MARGIN: f64 = 0.1;

/// Length two pieces must share to hang together, in line widths, and the share of the shorter one's length: where a step
/// runs askew to the lines, the pieces on either side overlap a little from frame to frame.
pub const STRIP_LINK_OVERLAP_WIDTHS: f64 = 2.0;
/// See [`STRIP_LINK_OVERLAP_WIDTHS`].
pub const STRIP_LINK_SHARE: f64 = 0.5;
/// The same fraction of the longer one: the end of a block's top must not be linked to the long line beyond it.
pub const STRIP_LINK_SHARE_OF_LONGER: f64 = 0.3;
/// Bend of a strip from frame to frame that the stage's own errors explain, as a share of the depth: 0.02 mm at 400 mm.
pub const STRIP_LINK_FLOOR_RELATIVE: f64 = 5e-5;
/// Largest movement between two frames that passes for smooth where no third frame decides, line pitches.
pub const STRIP_LINK_PITCHES: f64 = 0.03;
/// Smallest margin per sample of a strip's label over every other one once all other strips have adapted. As for single
/// pieces: a fifth of a rank, a quarter of a second look.
pub const CHALLENGE_MARGIN: f64 = 0.3;
/// The same for short strips without the ranks, which tall narrow parts can reverse.
pub const CHALLENGE_MARGIN_WITHOUT_RANKS: f64 = 0.05;
/// The same for short strips whose label hardly any other strip confirms: twice that.
pub const CHALLENGE_MARGIN_UNSEEN: f64 = 2.0 * CHALLENGE_MARGIN;
/// Second looks per sample below which a strip counts as unconfirmed: a fifth of a good one's.
pub const SEEN_SHARE: f64 = 0.3;
/// Most strips updated while the others adapt to a challenge; chains of lines converge within a few dozen; a limit
/// reached only makes the challenge weaker.
pub const CHALLENGE_STEPS: usize = 100;
/// Largest cost of other strips shifted along with a challenged strip, before they adapt, in limits of the challenge:
/// adapting saves at most a good part of it.
pub const CHALLENGE_SHIFT_LIMITS: f64 = 3.0;
/// Second looks by other strips that make a rival label plausible: per sample, and in total at least this many samples'
/// worth.
pub const SECOND_LOOK_SHARE: f64 = 0.1;
/// See [`SECOND_LOOK_SHARE`].
pub const SECOND_LOOK_SAMPLES: f64 = 2.0;
/// Strips shorter than this many line pitches are also challenged without their ranks, and need second looks: tall
/// narrow parts, which may change places with their ground, tops of blocks, and most reflections are shorter.
pub const RANK_ONLY_LENGTH_PITCHES: f64 = 4.0;

/// Support per sample that a label needs from other frames or orders in a scan: a third of one bond to the next frame.
/// A chance row of speckles has none.
pub const CONFIRMATION: f64 = 0.15;

/// Steps of the table of systematic σ along the image's longer side. Interpolation error below 2 %.
pub const SIGMA_TABLE_STEPS: f64 = 27.0;

/// Distance along the line, in columns, between the points that are checked and compared between orders: neighbours share
/// their noise over about as many.
pub const COMPARE_STRIDE_PX: usize = 4;
/// Differences after a full turn that deviate from their median by more than this many median deviations are outliers:
/// 4 σ for normal ones.
pub const CLOSURE_MAD_LIMIT: f64 = 6.0;
/// Number of contradicting surfaces of other orders at which a point is dropped: one, because a wrong order is far
/// worse than a missing point.
pub const CONTRADICTING_SURFACES: usize = 1;
/// Length along its line over which a point makes its neighbours doubtful, in line widths: the half-length over which
/// the extraction smooths wide lines, and so continues a line beyond a depth step.
pub const END_WIDTHS: f64 = 2.2;
/// If more than this fraction of a run of neighbouring points is contradicted, the rest is dropped, too.
pub const RUN_DENIED_SHARE: f64 = 0.5;
/// Largest bend of a line within a comparison patch, in standard deviations, that counts as smooth.
pub const SMOOTH_SIGMAS: f64 = 4.0;

/// Length of the lines fitted before and after a point to detect a step, in line widths.
pub const STEP_WINDOW_WIDTHS: f64 = 3.5;
/// Fewest points of such a line; shorter runs are left out with their neighbours anyway.
pub const STEP_LEAST_POINTS: usize = 4;
/// Smoothing length of the extraction on either side of a step, in line widths.
pub const STEP_BLUR_WIDTHS: f64 = 1.2;
/// Smallest step detected, in line widths; smaller ones are bends.
pub const STEP_LEAST_WIDTHS: f64 = 0.08;
/// The same in standard deviations of the step.
pub const STEP_SIGMAS: f64 = 3.0;
/// Fraction of a stretch that must be confirmed for it to keep its label beyond a step.
pub const STEP_SEEN_SHARE: f64 = 0.2;
/// Fraction of a stretch for which the ranks must admit another order for its label to be doubtful.
pub const OPEN_SHARE: f64 = 0.5;
/// Points whose profiles are kept between steps: 200 MB, which no usual scan exceeds. The others are computed four
/// times, so that a scan of any size fits into memory.
pub const KEPT_POINTS: usize = 2_000_000;

/// Full width at half height of a Gaussian, in standard deviations.
pub const FWHM_PER_SIGMA: f64 = 2.354_82;
/// Points from whose widths the thickness of the light sheets is computed: a median of thousands is good to a per cent.
pub const THICKNESS_SAMPLES: usize = 4000;

/// Pieces or strips per task of the labelling: fewer are not worth another thread.
pub const PIECES_PER_TASK: usize = 64;

/// Sampling step along a profile for widths, in points: the correlation length of a line's noise.
pub const WIDTH_STRIDE_POINTS: usize = 16;
/// Bins of the depth range in which widths are learned: an eighth of a wrap each where the range is four wraps.
pub const WIDTH_BINS: usize = 32;
/// Fewest samples of such a bin: the noise of the median is then a quarter of a sample's.
pub const WIDTH_BIN_SAMPLES: usize = 24;
/// Alternations between medians over depths and over orders.
pub const WIDTH_FIT_ROUNDS: usize = 4;
/// Smallest relative scatter of widths: the effect of slopes.
pub const WIDTH_SIGMA_FLOOR: f64 = 0.04;
/// Cost of a sample whose line width does not fit the depth of its label but fits that of another: as much as a second
/// look.
pub const WIDTH_COST: f64 = 1.0;
/// Deviation in σ from which a line's width does not fit a label.
pub const WIDTH_DENIED_SIGMAS: f64 = 3.5;
/// The same where another order confirms the label: errors shared by three orders agree with each other.
pub const WIDTH_DENIED_SEEN_SIGMAS: f64 = 5.0;
/// Smallest ratio of the deviation from its own width to that from a rival's: a line smoothed over a step has a width
/// in between.
pub const WIDTH_DENIED_RATIO: f64 = 1.6;
/// Largest deviation in σ at which the width of a line supports its label,
pub const WIDTH_HELD_SIGMAS: f64 = 2.0;
/// if it deviates by at least this much from that of every other label.
pub const WIDTH_RIVAL_SIGMAS: f64 = 5.0;
/// Largest deviation in σ at which a width fits a label.
pub const WIDTH_FITS_SIGMAS: f64 = 2.5;
/// The width at a point is the median over this many line widths to either side.
pub const WIDTH_WINDOW_WIDTHS: f64 = 1.5;

/// Constants common to all watches.
pub mod watches {
    /// Columns averaged to one position and depth: a mean over sixteen has a fifth of a point's noise, since neighbours
    /// share theirs over two to three.
    pub const BIN_COLUMNS: usize = 16;
    /// Steepest slope used, and largest change of slope from frame to frame: beyond are edges.
    pub const MAX_SLOPE: f64 = 1.0;
    /// Places whose neighbours within so many bins across the travel and bins' widths along it share noise: speckle reaches
    /// a line's thickness, what a surface does to lines reaches as far as its curvature changes.
    pub const CLUSTER_BINS: usize = 4;
    /// See [`CLUSTER_BINS`]; 5 mm at 400 mm.
    pub const CLUSTER_TRAVEL_BINS: f64 = 2.0;
    /// Differences that share their noise, about, as far as weights against prior knowledge go: all pairs of five orders
    /// stand on four differences, and neighbouring frames on one speckle pattern.
    pub const SHARED_DIFFERENCES: f64 = 16.0;
    /// Differences beyond this many σ, by their median absolute deviation, do not belong to the same surface.
    pub const CUT_SIGMAS: f64 = 4.0;
    /// Iterations of fitting and outlier removal.
    pub const FIT_ROUNDS: usize = 4;
    /// Positions used for the drift of the station: noise is then a hundredth of the calibration's own uncertainty.
    pub const DRIFT_PLACES: usize = 1500;
    /// Relative step, and step in rad, of derivatives: changes of depth are far below a line's width and far above
    /// rounding.
    pub const DRIFT_STEP: f64 = 1e-4;
    /// σ from which a surface does not determine the stage's scale: a twentieth of a millimetre in 50; the noise of a
    /// plate's slopes simulates 1.6e-3.
    pub const SCALE_BLIND: f64 = 1e-3;
    /// Positions used to compare the powers of orders.
    pub const POWER_PLACES: usize = 8000;
    /// Scans after a calibration that define the normal powers.
    pub const REFERENCE_SCANS: usize = 5;
    /// Normal variation of the ratio of two orders' powers from part to part, as a logarithm: tilt and finish of
    /// surfaces.
    pub const POWER_SIGMA_FLOOR: f64 = 0.03;
    /// Deviation in σ from which a value is significant: normally distributed values give one false warning in 150,000.
    pub const WARN_SIGMAS: f64 = 4.5;
    /// Errors below this fraction of the expanded uncertainty are reported as values only.
    pub const WARN_SHARE: f64 = 0.25;
    /// Errors of depth by the wavelength below this share of the depth are not corrected: 10 µm at 400 mm, a quarter of the
    /// expanded uncertainty on matt grey paint.
    pub const CORRECTION_LEAST_RELATIVE: f64 = 2.5e-5;
    /// Expanded uncertainties are so many σ.
    pub const COVERAGE: f64 = 2.0;
}

/// Constants of the lost-step watch.
pub mod lost_steps {
    /// A watch that would notice only losses larger than this share of the depth is blind: four times the 50 µm that must be
    /// noticed at 400 mm.
    pub const BLIND_RELATIVE: f64 = 5e-4;
    /// Fewest bins that give a line of differences over slopes.
    pub const FEWEST_DIFFERENCES: usize = 12;
    /// Differences this far from the fitted line, in its own scatter, are left out.
    pub const OUTLIER_SIGMAS: f64 = 3.0;
    /// Smallest scatter of slopes in a frame: below, they are noise, which is 0.006 per slope.
    pub const LEAST_SLOPE_SPREAD: f64 = 0.03;
    /// Fewest earlier differences for the usual difference of two orders in a column.
    pub const FEWEST_USUAL: u32 = 6;
    /// Number of frames within which a jump can be detected.
    pub const REACH_FRAMES: usize = 20;
    /// Frames before a possible jump that define the baseline.
    pub const BASELINE_FRAMES: usize = 40;
    /// Fewest frames on either side of a jump.
    pub const FEWEST_FRAMES: usize = 3;
    /// Ratio of the stated standard deviation to that of independent frames: neighbouring frames and pairs of orders
    /// share speckle and surface.
    pub const NOISE_INFLATION: f64 = 1.4;
    /// Smallest step that is reported, as a share of the depth: half of what must be noticed, 25 µm at 400 mm.
    pub const ALARM_RELATIVE: f64 = 6.25e-5;
    /// Smallest step that is reported, in its standard deviations; rendered scans without losses stay below 3.
    pub const ALARM_SIGMAS: f64 = 4.5;
}

/// Constants for lines from several exposures.
pub mod exposures {
    /// Lines of different exposures nearer than this, in line widths, are the same line: what saturation displaces them by.
    pub const SAME_LINE_WIDTHS: f64 = 0.5;
    /// Exposures that differ by more than so many σ disagree.
    pub const DISAGREE_SIGMAS: f64 = 3.0;
}
