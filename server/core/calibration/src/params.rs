//! Constants of the calibration, each with its unit and reason.

/// Images of the board needed for the camera: Zhang's closed form has two equations per view and five unknowns.
pub const MIN_CAMERA_VIEWS: usize = 3;

/// Board poses with laser light needed for the light sheets: with two, a sheet is a plane through two lines and nothing
/// is left to detect a wrong pose.
pub const MIN_LASER_POSES: usize = 3;

/// Boards with ranked lines needed to predict the lines of the others: two lines determine a sheet.
pub const MIN_RANKED_BOARDS: usize = 2;

/// Orders needed for a pencil or a grating: two planes share a line, and λ/d_g is the angle between them.
pub const MIN_TIED_ORDERS: usize = 2;

/// Positions of the stage needed if the board is observed on the stage at all: a line through two does not determine
/// straightness, and a variance from fewer than three degrees of freedom has no finite mean.
pub const MIN_STAGE_POSITIONS: usize = 3;

/// Stage views closer than this fraction of a square of the board count as one position: any stage is straight over
/// such a short distance.
pub const MIN_STAGE_SPACING_SQUARES: f64 = 0.01;

/// Angles of a turntable closer than this count as one angle.
pub const MIN_STAGE_ANGLE_DEG: f64 = 0.5;

/// Deviation from the stated rotation beyond which a board did not rotate as stated: a hundred times the error of usual
/// tables, far less than a mistyped angle or a board detected upside down.
pub const MAX_ROTATION_MISMATCH_RAD: f64 = 0.05;

/// Largest σ of an axis' direction: with more, a part of 50 mm would be off by 0.25 mm.
pub const MAX_AXIS_TILT_SIGMA_RAD: f64 = 0.005;

/// Largest σ of an axis' position, relative to its distance.
pub const MAX_RELATIVE_AXIS_SHIFT_SIGMA: f64 = 0.002;

/// Views needed to estimate the σ of a table's angle: with fewer its square has no finite mean.
pub const MIN_VIEWS_FOR_ANGLE_SIGMA: usize = 4;

/// Ratio of the boards' deviations from a pure rotation to their noise, above which there is a warning.
pub const PURE_ROTATION_MAX_NOISE_RATIO: f64 = 1.5;

/// Smallest spread of the boards' normals; with less, focal length and distance cannot be separated.
pub const MIN_TILT_SPREAD_RAD: f64 = 0.05;

/// Largest relative σ of the focal length (depth error 1 % at any distance).
pub const MAX_RELATIVE_FOCAL_SIGMA: f64 = 0.01;

/// Smallest depth range of a line over all poses, relative to the distance, that determines the sheet's direction.
pub const MIN_RELATIVE_DEPTH_SPAN: f64 = 0.01;

/// Corner residuals beyond this many σ count linearly, so that a few bad corners do not dominate the camera.
pub const CORNER_HUBER_SIGMAS: f64 = 4.0;

/// Laser residuals beyond this many σ count linearly.
pub const LASER_HUBER_SIGMAS: f64 = 3.0;

/// Laser points farther than this many σ from the first fit are rejected and counted.
pub const LASER_REJECT_SIGMAS: f64 = 6.0;

/// k3 is estimated only if it is this many σ away from zero; otherwise it would only add noise at the corners of the
/// image.
pub const K3_SIGNIFICANCE: f64 = 3.0;

/// Weak priors that keep unobservable distortion finite (σ of k1, k2, p1, p2, k3). Usual lenses are within them.
pub const DISTORTION_PRIOR_SIGMA: [f64; 5] = [1.0, 10.0, 0.1, 0.1, 100.0];

/// Weak prior on focal lengths, relative to the initial estimate.
pub const FOCAL_PRIOR_RELATIVE: f64 = 1.0;

/// Weak prior on the principal point around the image's centre, relative to the image's side.
pub const PRINCIPAL_POINT_PRIOR_RELATIVE: f64 = 0.25;

/// λ/d_g of the data sheets, relative σ: laser diodes vary by a few nm between samples and with temperature.
pub const WAVELENGTH_OVER_PERIOD_RELATIVE_SIGMA: f64 = 0.003;

/// Typical distance from a line generator to its grating, and its scatter between projectors (σ), mm: laser modules are
/// about equally large for any working distance. It has no influence if the images determine the gap.
pub const GAP_PRIOR_MM: (f64, f64) = (15.0, 20.0);

/// σ, over real projectors, of the grating's deviation from perpendicular to the axis, and of its grooves from the
/// line.
pub const GRATING_ANGLE_PRIOR_RAD: f64 = 0.1;

/// σ of the source's position along the line from the middle of the lit area, relative to the distance.
pub const SOURCE_ALONG_LINE_PRIOR_RELATIVE: f64 = 0.3;

/// Points closer to a square's edge than this many line widths (full width at half height) carry the edge's
/// intensity step in their centre and are left out: 1.1 for the line's own light, the rest for the board image's blur and
/// the smoothing of the centreline, both of which grow with the width.
pub const EDGE_MARGIN_WIDTHS: f64 = 1.5;

/// Ratio of the lines' scatter about the light model to the stated σ, above which there is a warning: real surfaces
/// scatter up to three times as much as smooth ones.
pub const MAX_LINE_NOISE_RATIO: f64 = 3.0;

/// Width of the blank margin around the squares that may have laser points, in squares: boards leave about this much
/// blank so that they can be detected.
pub const BOARD_MARGIN_SQUARES: f64 = 1.0;

/// A piece of line on the margin counts as on the board if its median distance from the predicted curve is below this
/// many σ (the median of |z| is 0.67 on the board; next to the board it is hundreds, due to its thickness).
pub const MARGIN_REJECT_SIGMAS: f64 = 1.5;

/// Points at the end of a piece that determine its slope: accurate to a hundredth at 0.3 px of noise.
pub const JOIN_END_POINTS: usize = 40;

/// Pieces are joined across gaps up to this many times their own lengths: one dark square between two bright ones.
pub const JOIN_MAX_GAP_LENGTHS: f64 = 1.5;

/// Pieces are joined if the distance between their extrapolations is at most this fraction of the distance between
/// neighbouring lines.
pub const JOIN_TOLERANCE_PITCHES: f64 = 0.06;

/// A line on the board needs this many columns to be used.
pub const MIN_LINE_COLUMNS: usize = 24;

/// This fraction of a line's columns with a full set of lines must agree on its rank.
pub const MIN_RANK_AGREEMENT: f64 = 0.8;

/// A line gets the label of a predicted curve within this fraction of the line pitch.
pub const PREDICTED_LABEL_PITCH_FRACTION: f64 = 0.2;

/// Images among which every three are tried as the start of a hypothesis about labels.
pub const SEED_IMAGES: usize = 6;

/// Points of a line that determine its position in the section: more would be redundant.
pub const SECTION_POINTS_PER_LINE: usize = 40;

/// A gap between lines is an integer multiple of the line pitch within this: tilted boards change the pitch by a fifth.
pub const STEP_ROUNDING: f64 = 0.3;

/// A line farther than this from every ray, in line pitches, belongs to none: half-way to the next.
pub const SECTION_CAP_PITCHES: f64 = 0.5;

/// Largest RMS distance of the lines from their rays of an accepted hypothesis, in line pitches; the bow of the sheets
/// gives some hundredths, a wrong assignment more than a quarter somewhere.
pub const HYPOTHESIS_MAX_RMS_PITCHES: f64 = 0.12;

/// Smallest ratio of the RMS distance of any other assignment to that of the accepted one.
pub const HYPOTHESIS_MARGIN: f64 = 2.0;

/// Smallest ratio of the RMS residuals of any other plausible assignment to those of the accepted one. Labels shifted
/// by one order assign the flat order 0 to a bowed sheet.
pub const BOW_MARGIN: f64 = 1.3;

/// Lines closer to each other than this fraction of the image's largest gap are one: lines of five orders are farther
/// apart.
pub const SAME_LINE_GAP_FRACTION: f64 = 0.15;

/// Fraction of the lines with different labels from which two assignments count as different.
pub const HYPOTHESIS_OTHER_FRACTION: f64 = 0.2;

/// Laser points kept for residual maps.
pub const MAX_REPORT_POINTS: usize = 6000;

/// Points per pose and order in cross-validation: enough for means to a thousandth of a pixel.
pub const CROSS_VALIDATION_POINTS: usize = 150;

/// Most folds of the cross-validation; with more poses, groups are left out.
pub const CROSS_VALIDATION_MAX_FOLDS: usize = 12;

/// The exact model is recommended unless the held-out error of a simpler one is below this fraction of its own: outside
/// the calibrated volume it is the least likely to be wrong.
pub const RECOMMEND_SIMPLER_BELOW: f64 = 0.95;

/// The travel of the stage is modelled as straight in the joint fit if its corners fit that within this multiple of the
/// corner noise.
pub const STRAIGHT_STAGE_MAX_NOISE_RATIO: f64 = 1.15;

/// Margin of the calibrated depth range beyond the lit boards, relative to their range.
pub const DEPTH_RANGE_MARGIN: f64 = 0.1;

/// Points kept per correlation length of the centreline noise: more would be redundant.
pub const POINTS_PER_CORRELATION: f64 = 2.0;

/// A parameter whose σ after the fit exceeds this fraction of its prior's σ was not determined by the data.
pub const UNDETERMINED_PRIOR_FRACTION: f64 = 0.7;

/// Range within which residuals are linear in lengths (relative to the boards' distance), focal lengths and λ/d_g.
pub const STEP_LENGTH_RELATIVE: f64 = 0.03;

/// Range within which residuals are approximately linear in angles.
pub const STEP_ANGLE_RAD: f64 = 0.05;

/// Ranges within which residuals are approximately linear in k1, k2, p1, p2, k3.
pub const STEP_DISTORTION: [f64; 5] = [0.1, 0.5, 0.01, 0.01, 5.0];

/// The constants that affect a result, by name, for the calibration document.
pub fn as_map() -> std::collections::BTreeMap<String, f64> {
    [
        ("corner_huber_sigmas", CORNER_HUBER_SIGMAS),
        ("laser_huber_sigmas", LASER_HUBER_SIGMAS),
        ("laser_reject_sigmas", LASER_REJECT_SIGMAS),
        ("k3_significance", K3_SIGNIFICANCE),
        ("wavelength_over_period_relative_sigma", WAVELENGTH_OVER_PERIOD_RELATIVE_SIGMA),
        ("gap_prior_mean_mm", GAP_PRIOR_MM.0),
        ("gap_prior_sigma_mm", GAP_PRIOR_MM.1),
        ("grating_angle_prior_rad", GRATING_ANGLE_PRIOR_RAD),
        ("source_along_line_prior_relative", SOURCE_ALONG_LINE_PRIOR_RELATIVE),
        ("edge_margin_widths", EDGE_MARGIN_WIDTHS),
        ("points_per_correlation", POINTS_PER_CORRELATION),
        ("straight_stage_max_noise_ratio", STRAIGHT_STAGE_MAX_NOISE_RATIO),
    ]
    .into_iter()
    .map(|(name, value)| (name.to_owned(), value))
    .collect()
}
