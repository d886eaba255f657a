//! Constants of labelling, triangulation and statistics, each with its unit and reason.

/// Distance between the samples of a piece, scan columns (rows). Neighbours share their noise over a few columns
/// anyway; 16 keeps forty frames of a megapixel below 20 000 samples. Decisions do not depend on it: a sample is
/// weighted by the length that it represents.
pub const SAMPLE_STRIDE_PX: usize = 16;
/// Fewest samples of a piece; shorter pieces are sampled more densely.
pub const MIN_SAMPLES: usize = 4;

/// Length on either side over which the slope of a line is computed to find kinks, in line widths: about the
/// smoothing length of the extraction.
pub const KINK_SPAN_WIDTHS: f64 = 1.0;
/// Change of slope (across per along, px/px) at which a segment is cut in two: two lines may have been joined
/// there. Cutting a line that merely bends does no harm: its pieces get the same label.
pub const KINK_SLOPE: f64 = 0.3;
/// Smallest change of slope in its standard deviations, so that speckle does not cut lines into fragments.
pub const KINK_SIGMAS: f64 = 5.0;
/// Largest step between neighbouring points of one line, in line widths along the scan column (row): the linking
/// distance of the extraction.
pub const KINK_STEP_WIDTHS: f64 = 0.5;
/// Steps at which a segment is cut: lines of two orders that touch end to end are extracted as one. Per entry:
/// length on either side to which a line is fitted, and the smallest step, both in line widths.
pub const STEP_LIMITS: [(f64, f64); 2] = [(1.6, 0.06), (3.2, 0.04)];
/// Smallest step in its standard deviations; σ may be understated, and noise correlated.
pub const STEP_LIMIT_SIGMAS: f64 = 5.0;
/// Length excluded on either side of a cut, in line widths: the uncertainty of the position of a joint.
pub const CUT_TRIM_WIDTHS: f64 = 0.4;
/// Frames before and after a frame whose joints also cut its lines.
pub const JOINT_FRAMES: usize = 2;
/// Largest distance of a line from the end of a line in a neighbouring frame at which it is cut, in line widths.
pub const JOINT_REACH_WIDTHS: f64 = 0.4;
/// Smallest distance between such cuts, in line widths: an end that moves from frame to frame must not leave tiny
/// pieces.
pub const JOINT_SPACING_WIDTHS: f64 = 2.4;
/// Largest offset across the line, in line widths, at which two ends that face each other across one or two
/// missing points are not a joint.
pub const JOINT_GAP_WIDTHS: f64 = 0.06;
/// The same in standard deviations of the offset, for a gap of up to one correlation length: a dark speckle.
pub const JOINT_GAP_SIGMAS: f64 = 4.0;
/// Shortest piece that is labelled, points: fewer do not determine a slope.
pub const MIN_PIECE_POINTS: usize = 4;

/// Largest movement of a line between frames, as a fraction of the line pitch, at which it is tracked as the same
/// line.
pub const TRACK_GATE_PITCHES: f64 = 0.15;
/// Weight of one sample's bond to the same line in the next frame. Two bonds (before, after) weigh as much as one
/// agreement with another order: continuity propagates a label, but does not overrule a repeated observation.
pub const TRACK_WEIGHT: f64 = 0.5;

/// Weight of the bond between pieces cut at a kink, per sample, for at most one sample: a bend is more likely than
/// two joined lines.
pub const JOINT_WEIGHT: f64 = 1.0;
/// Length below which a piece does not keep a label that differs from that of the adjoining piece, in line widths.
pub const STUB_WIDTHS: f64 = 6.4;

/// Longest gap across which a line is continued within its frame, in line pitches (an object on a plate).
pub const CONTINUATION_GAP_PITCHES: f64 = 4.0;
/// Largest deviation of the continued line, in line pitches.
pub const CONTINUATION_GATE_PITCHES: f64 = 0.06;
/// Points at the end of a piece to which the continuation is fitted.
pub const CONTINUATION_POINTS: usize = 40;
/// Weight of a continuation at gap zero, in samples' worth of bonds; it decreases with the gap.
pub const CONTINUATION_WEIGHT: f64 = 2.0;

/// Weight of the bond between two sections of one piece, in samples' worth: little more than one repeated
/// observation, so that two samples separate them and a single one does not.
pub const SECTION_WEIGHT: f64 = 1.25;

/// Repeated observations per sample with which sections may form a missed surface: a third of those on a
/// well-observed surface.
pub const OVERLOOKED_PER_SAMPLE: f64 = 0.4;
/// Iterations of the search for missed surfaces: one reveals the next at most a few times.
pub const OVERLOOKED_ROUNDS: usize = 4;

/// Iterations of joint shifts by one order: one reveals the next at most a few times.
pub const SHIFT_ROUNDS: usize = 4;

/// Cost per sample and line of its column on the wrong side. On solid parts the order of lines never changes, so
/// this weighs more than a single agreement.
pub const RANK_COST: f64 = 1.5;

/// Cost of a sample whose ray misses the light sheet or whose depth is out of range. No more than a rank: parts
/// may exceed the stated depths, and neighbours of such a line must not be forced to another order.
pub const OUTSIDE_COST: f64 = 1.5;
/// Cost of leaving a piece unlabelled, per sample. A piece is treated as a ghost if the score of every order is
/// lower.
pub const UNLABELLED_COST: f64 = 0.4;

/// Agreement tolerance between two orders in standard deviations of their difference.
pub const AGREEMENT_SIGMAS: f64 = 5.0;
/// Fraction of the tolerance within which a repeated observation supports a label: 3 σ. On a part one wrap high
/// the depth under the next label differs by 0.8 mm, and chance agreement within 5 σ must not outweigh agreement
/// within 1 σ.
pub const CLOSE_TOLERANCES: f64 = 0.6;
/// Smallest tolerance as a fraction of depth: errors of stage, straightness and model (0.06 mm at 400 mm).
pub const AGREEMENT_FLOOR_GRATING: f64 = 1.5e-4;
/// The same for plane models, which do not represent the bow of the outer lines (0.4 mm at 400 mm).
pub const AGREEMENT_FLOOR_PLANES: f64 = 1.0e-3;
/// Contribution of the calibration's systematic error to the tolerance, in its standard deviations: orders share
/// most of that error.
pub const SYSTEMATIC_SIGMAS: f64 = 2.0;
/// Smallest radius of curvature allowed for when a patch is extended, as a fraction of the depth: 10 mm at 400 mm.
/// The size of parts scales with the field of view.
pub const PATCH_RADIUS_RELATIVE: f64 = 0.025;
/// Distance in tolerances beyond which two surfaces contradict each other; closer ones that do not agree are no
/// evidence.
pub const CONTRADICTION_TOLERANCES: f64 = 2.0;
/// Steepest patch (mm of depth per mm across the view) used as evidence: on steeper surfaces depth is not a
/// function of position.
pub const PATCH_MAX_GRADIENT: f64 = 3.0;
/// Radius of a patch in sample spacings: patches overlap their neighbours without extending beyond them.
pub const PATCH_RADIUS_SPACINGS: f64 = 0.8;
/// Frame distance from which lines of one order are independent observations; closer lines are neighbours on a
/// slope.
pub const SAME_ORDER_MIN_FRAMES: usize = 3;

/// Iterations of the mean field; marginals converge within twenty.
pub const MEAN_FIELD_ITERATIONS: usize = 40;
/// Sharpness of marginals in the first and in the last iteration (inverse temperature, per sample).
pub const MEAN_FIELD_SHARPNESS: [f64; 2] = [0.7, 12.0];
/// Fraction of the iterations after which "none" takes part: by then the ranks have converged.
pub const UNLABELLED_FROM: f64 = 0.5;
/// Most sweeps of ICM.
pub const MAX_SWEEPS: usize = 30;
/// Smallest margin per sample of a label over the next best; with less it is doubtful.
pub const LABEL_MARGIN: f64 = 0.3;
/// Margin per sample by which another order may lead in depth, ranks and repeated observations alone; if it leads
/// by more, the label results from continuity alone.
pub const OVERRULED_MARGIN: f64 = 0.2;
/// Score per sample required from continuity where nothing else prefers an order: the same line before and after,
/// not on one side only.
pub const CONTINUITY_ALONE: f64 = 0.7;
/// Smallest margin per sample of a connected group over the same group shifted by an order. A fifth of a repeated
/// observation: the group is observed twice over a good part of its area.
pub const GROUP_MARGIN: f64 = 0.1;

/// Smallest overlap along the line, in line widths, at which two pieces are linked to a strip: where a step runs
/// obliquely to the lines, the pieces on either side overlap a little from frame to frame.
pub const STRIP_LINK_OVERLAP_WIDTHS: f64 = 2.0;
/// The same as a fraction of the length of the shorter piece.
pub const STRIP_LINK_FRACTION: f64 = 0.5;
/// The same as a fraction of the length of the longer piece: the end of a block's top must not be linked to the
/// long line beyond it.
pub const STRIP_LINK_FRACTION_OF_LONGER: f64 = 0.3;
/// Bend of a strip from frame to frame that stage errors explain, as a fraction of the depth: 0.02 mm at 400 mm.
pub const STRIP_LINK_FLOOR_RELATIVE: f64 = 5e-5;
/// Largest movement of a line between two frames that counts as smooth if there is no third frame, line pitches.
pub const STRIP_LINK_PITCHES: f64 = 0.03;
/// Smallest margin per sample of a strip's label over every other one once all other strips have adapted. As for
/// single pieces: a fifth of a rank.
pub const STRIP_TEST_MARGIN: f64 = 0.3;
/// The same for short strips without the ranks, which tall narrow parts can reverse.
pub const STRIP_TEST_MARGIN_WITHOUT_RANKS: f64 = 0.05;
/// The same for short strips whose label few other strips confirm.
pub const STRIP_TEST_MARGIN_UNCONFIRMED: f64 = 2.0 * STRIP_TEST_MARGIN;
/// Repeated observations per sample below which a strip counts as unconfirmed: a fifth of those on a well-observed
/// strip.
pub const CONFIRMED_PER_SAMPLE: f64 = 0.3;
/// Most updates while the other strips adapt to a tested label. Chains of lines converge within a few dozen;
/// stopping early only makes the test less strict.
pub const STRIP_TEST_MAX_UPDATES: usize = 100;
/// Largest cost of a joint shift of other strips before they adapt, relative to the limit of the test: adapting
/// reduces it by no more than that.
pub const STRIP_TEST_SHIFT_LIMITS: f64 = 3.0;
/// Repeated observations by other strips that make a rival label plausible, per sample.
pub const REPEATED_OBSERVATIONS_PER_SAMPLE: f64 = 0.1;
/// The same in total, in samples.
pub const REPEATED_OBSERVATION_SAMPLES: f64 = 2.0;
/// Length, in line pitches, below which strips are also tested without their ranks, and need repeated
/// observations: tall narrow parts, which may exchange ranks with the ground, tops of blocks, and most reflections
/// are shorter.
pub const RANK_ONLY_LENGTH_PITCHES: f64 = 4.0;

/// Score per sample that a label needs from other frames or orders of a scan: a third of one bond to the next
/// frame. A chance row of speckles has none.
pub const CONFIRMATION: f64 = 0.15;

/// Steps of the table of systematic σ along the image's longer side. Interpolation error below 2 %.
pub const SIGMA_TABLE_STEPS: f64 = 27.0;

/// Distance along the line, in columns, between the points that are checked and compared between orders:
/// neighbours share their noise over about as many columns.
pub const COMPARE_STRIDE_PX: usize = 4;
/// Differences after a full turn that deviate from their median by more than this many median absolute deviations
/// are outliers: 4 σ of a normal distribution.
pub const CLOSURE_MAD_LIMIT: f64 = 6.0;
/// Number of contradicting surfaces of other orders at which a point is rejected: one, because a wrong order is
/// far worse than a missing point.
pub const CONTRADICTING_SURFACES: usize = 1;
/// Length along its line over which a point makes its neighbours doubtful, in line widths: the half-length over
/// which the extraction smooths wide lines and so extends them beyond a depth step.
pub const END_WIDTHS: f64 = 2.2;
/// If more than this fraction of a run of neighbouring points is contradicted, the whole run is rejected.
pub const RUN_REJECTED_FRACTION: f64 = 0.5;
/// Largest bend of a line within a comparison patch, in standard deviations, that counts as smooth.
pub const SMOOTH_SIGMAS: f64 = 4.0;

/// Length of the lines fitted before and after a point to detect a step, in line widths.
pub const STEP_WINDOW_WIDTHS: f64 = 3.5;
/// Fewest points of such a line.
pub const STEP_MIN_POINTS: usize = 4;
/// Smoothing length of the extraction on either side of a step, in line widths.
pub const STEP_BLUR_WIDTHS: f64 = 1.2;
/// Smallest step detected, in line widths; smaller ones are bends.
pub const STEP_MIN_WIDTHS: f64 = 0.08;
/// Smallest step in its standard deviations.
pub const STEP_SIGMAS: f64 = 3.0;
/// Fraction of a stretch that must be confirmed for it to keep its label beyond a step.
pub const STEP_CONFIRMED_FRACTION: f64 = 0.2;
/// Fraction of a stretch for which the ranks must admit another order for its label to be doubtful.
pub const OPEN_FRACTION: f64 = 0.5;
/// Number of points whose profiles are cached between steps: 200 MB, which no usual scan exceeds. Other profiles
/// are computed four times, so that a scan of any size fits into memory.
pub const KEPT_POINTS: usize = 2_000_000;

/// Full width at half height of a Gaussian, in standard deviations.
pub const FWHM_PER_SIGMA: f64 = 2.354_82;
/// Number of points from whose widths the thickness of the light sheets is computed: a quantile of thousands has
/// an error of about 1 %.
pub const THICKNESS_SAMPLES: usize = 4000;
/// Which quantile of them it is. On a plate all are equal to 5 %; on a ball before a turntable the median is a fifth below
/// the true thickness.
pub const THICKNESS_QUANTILE: f64 = 0.75;
/// Least cosine of the angle between a line and its direction in the image for which the width of the line is used to
/// determine its thickness: 20°.
pub const MIN_THICKNESS_COSINE: f64 = 0.94;

/// Pieces or strips per parallel task of the labelling: with fewer, the overhead of a thread exceeds the gain.
pub const PIECES_PER_TASK: usize = 64;

/// Sampling step along a profile for widths, in points: the correlation length of a line's noise.
pub const WIDTH_STRIDE_POINTS: usize = 16;
/// Bins of the depth range in which widths are learned: each is an eighth of a wrap if the range is four wraps.
pub const WIDTH_BINS: usize = 32;
/// Fewest samples of such a bin: the noise of the median is then a quarter of a sample's.
pub const WIDTH_BIN_SAMPLES: usize = 24;
/// Alternations between medians over depths and over orders.
pub const WIDTH_FIT_ROUNDS: usize = 4;
/// Smallest relative scatter of widths: the effect of slopes.
pub const WIDTH_SIGMA_FLOOR: f64 = 0.04;
/// Cost of a sample whose line width does not fit the depth of its label but fits that of another: as much as a
/// repeated observation.
pub const WIDTH_COST: f64 = 1.0;
/// Deviation in σ from which the width of a line rejects its label.
pub const WIDTH_REJECTED_SIGMAS: f64 = 3.5;
/// The same where another order confirms the label: errors shared by three orders agree with each other.
pub const WIDTH_REJECTED_CONFIRMED_SIGMAS: f64 = 5.0;
/// Smallest ratio of the deviation from the width of its own label to that from a rival's: a line smoothed over a
/// step has a width in between.
pub const WIDTH_REJECTED_RATIO: f64 = 1.6;
/// Largest deviation in σ at which the width of a line supports its label, if [`WIDTH_RIVAL_SIGMAS`] excludes the
/// others.
pub const WIDTH_HELD_SIGMAS: f64 = 2.0;
/// Smallest deviation in σ from every other label at which the width of a line supports its own.
pub const WIDTH_RIVAL_SIGMAS: f64 = 5.0;
/// Largest deviation in σ at which a width fits a label.
pub const WIDTH_FITS_SIGMAS: f64 = 2.5;
/// The width at a point is the median over this many line widths to either side.
pub const WIDTH_WINDOW_WIDTHS: f64 = 1.5;

/// Constants common to all watches.
pub mod watches {
    /// Columns averaged to one position and depth: a mean over sixteen has a fifth of a point's noise, since
    /// neighbours share their noise over two to three columns.
    pub const BIN_COLUMNS: usize = 16;
    /// Steepest slope used, and largest change of slope from frame to frame; larger ones are edges.
    pub const MAX_SLOPE: f64 = 1.0;
    /// Size of a cluster of differences that share their noise, in bins across the travel: speckle is correlated
    /// over the thickness of a line, errors by the surface over the distance in which its curvature changes.
    pub const CLUSTER_BINS: usize = 4;
    /// The same along the travel, in widths of a bin; 5 mm at 400 mm.
    pub const CLUSTER_TRAVEL_BINS: f64 = 2.0;
    /// Approximate number of differences that share their noise, for their weight against the prior: all pairs of
    /// five orders have only four independent differences, and neighbouring frames share a speckle pattern.
    pub const SHARED_DIFFERENCES: f64 = 16.0;
    /// Differences beyond this many σ (from their median absolute deviation) are outliers: they are not on the
    /// same surface.
    pub const OUTLIER_SIGMAS: f64 = 4.0;
    /// Iterations of fitting and outlier removal.
    pub const FIT_ROUNDS: usize = 4;
    /// Number of points used for the drift of the station: noise is then a hundredth of the uncertainty of the
    /// calibration.
    pub const DRIFT_PLACES: usize = 1500;
    /// Relative step, and step in rad, of derivatives: changes of depth are far below a line's width and far above
    /// rounding.
    pub const DRIFT_STEP: f64 = 1e-4;
    /// σ above which a surface does not determine the scale of the stage: 0.05 mm in 50 mm; a plate gives an
    /// apparent σ of 1.6e-3 by the noise of its slopes.
    pub const MAX_SCALE_SIGMA: f64 = 1e-3;
    /// Number of points used to compare the powers of orders.
    pub const POWER_PLACES: usize = 8000;
    /// Scans after a calibration that define the normal powers.
    pub const REFERENCE_SCANS: usize = 5;
    /// Normal variation of the ratio of two orders' powers from part to part, as a logarithm: tilt and finish of
    /// surfaces.
    pub const POWER_SIGMA_FLOOR: f64 = 0.03;
    /// Deviation in σ from which a value is significant: normally distributed values give one false warning in 150,000.
    pub const WARN_SIGMAS: f64 = 4.5;
    /// Errors below this fraction of the expanded uncertainty do not cause a warning.
    pub const WARN_FRACTION: f64 = 0.25;
    /// Errors of depth by the wavelength below this fraction of the depth are not corrected: 10 µm at 400 mm, a quarter
    /// of the expanded uncertainty on matt grey paint.
    pub const MIN_CORRECTION_RELATIVE: f64 = 2.5e-5;
    /// Coverage factor of expanded uncertainties (GUM).
    pub const COVERAGE: f64 = 2.0;
}

/// Constants of the lost-step watch.
pub mod lost_steps {
    /// If only losses larger than this fraction of the depth could be detected, the watch is blind: twice the
    /// 50 µm that must be detected at 400 mm. Noise of the slopes on a plate feigns 180 µm.
    pub const BLIND_RELATIVE: f64 = 2.5e-4;
    /// Fewest bins for a line fitted to differences over slopes.
    pub const MIN_DIFFERENCES: usize = 12;
    /// Differences farther than this from the fitted line, in its standard deviations, are outliers.
    pub const OUTLIER_SIGMAS: f64 = 3.0;
    /// Fewest bins that determine a step together: from fewer, its standard deviation is not known well enough.
    pub const MIN_EFFECTIVE_BINS: f64 = 8.0;
    /// Standard deviation, relative to the depth, of an order's constant deviation in one bin: 5 µm at 400 mm. If a
    /// calibration has larger ones, the bins scatter more, and so the stated standard deviation of a step is larger.
    pub const OFFSET_PRIOR_RELATIVE: f64 = 1.25e-5;
    /// Standard deviation of the scale of the stage, which shifts the orders' surfaces constantly: twenty times that of a
    /// calibration.
    pub const SCALE_PRIOR: f64 = 1e-3;
    /// Number of frames within which a jump can be detected.
    pub const DETECTION_FRAMES: usize = 20;
    /// Frames before a possible jump that define the baseline.
    pub const BASELINE_FRAMES: usize = 40;
    /// Fewest frames on either side of a jump.
    pub const MIN_FRAMES: usize = 3;
    /// Smallest step that is reported, as a fraction of the depth: half of what must be detected, 25 µm at 400 mm.
    pub const ALARM_RELATIVE: f64 = 6.25e-5;
    /// Smallest step that is reported, in its standard deviations: about two thousand correlated steps are tried in a scan
    /// of 110 frames, and in clean ones the largest is typically 2.8 and rarely more than 3.7.
    pub const ALARM_SIGMAS: f64 = 4.5;
    /// Variance of a step, relative to that of independent differences, expected before a scan: the mean of rendered scans.
    pub const DESIGN_EFFECT_PRIOR: f64 = 1.56;
    /// Number of frames of a scan that count as much as this expectation: neighbouring frames share most of their
    /// differences, so those of one detection time say little.
    pub const DESIGN_EFFECT_PRIOR_FRAMES: f64 = 40.0;
    /// Smallest variance of a step, relative to that from its own residuals: these come from few bins, and the mean over
    /// the scan is known better, but a sudden change of the part or of its lines is in them alone.
    pub const OWN_VARIANCE_SHARE: f64 = 0.5;
    /// By how much residuals are smaller than what they are residuals of: the standard deviation of clean steps relative to
    /// that from their scatter, in rendered scans.
    pub const SCATTER_WIDENING: f64 = 1.25;
}

/// Constants for lines from several exposures.
pub mod exposures {
    /// Lines of different exposures closer than this, in line widths, are the same line: the largest displacement
    /// by saturation.
    pub const SAME_LINE_WIDTHS: f64 = 0.5;
    /// Difference in σ beyond which exposures disagree.
    pub const DISAGREE_SIGMAS: f64 = 3.0;
}
