//! Constants of the algorithms, each with its unit and reason.

/// Fewest points of a feature: ten per parameter of a cylinder.
pub const MIN_FEATURE_POINTS: usize = 50;

/// Smallest fraction of the evaluated points in a second feature; less is debris.
pub const MIN_FEATURE_FRACTION: f64 = 0.003;

/// A dominant plane with less than this fraction is not the table but a slice of something curved.
pub const MIN_TABLE_FRACTION: f64 = 0.2;

/// Points used to score hypotheses: enough to rank features of 1 % of the cloud.
pub const RANSAC_POINTS: usize = 3000;

/// Triples tried for a plane: finds one with 26 % of the points with 99.9 % probability.
pub const PLANE_HYPOTHESES: usize = 400;

/// Quadruples tried for a sphere: finds one with 25 % of the points off the table with 99.9 % probability.
pub const SPHERE_HYPOTHESES: usize = 2000;

/// Pairs of points with normals tried for a cylinder: 99.9 % probability for 8 % of the points off the table.
pub const CYLINDER_HYPOTHESES: usize = 1000;

/// Points whose normals are estimated for a cylinder; all pairs of them are compared.
pub const NORMAL_POINTS: usize = 1200;

/// Neighbours from which a normal is estimated: enough to average the noise, still local.
pub const NORMAL_NEIGHBOURS: usize = 14;

/// Band of a hypothesis, in the points' σ: contains 99.99 % of the points of a true one.
pub const RANSAC_BAND_SIGMAS: f64 = 4.0;

/// Trim of the refined fit, in robust standard deviations of its residuals: rejects 1 good point in 2000.
pub const TRIM_SIGMAS: f64 = 3.5;

/// Upper limit of the trim in predicted σ, so that a fit does not include neighbouring surfaces.
pub const MAX_TRIM_SIGMAS: f64 = 40.0;

/// Lower limit of the trim in predicted σ: rounding is not an outlier.
pub const MIN_TRIM_SIGMAS: f64 = 0.01;

/// Points used while the trim converges; the last iterations use all.
pub const TRIM_POINTS: usize = 20_000;

/// Most iterations for the trim to converge.
pub const TRIM_ROUNDS: usize = 15;

/// Points closer to the border of a feature than this many thicknesses (one σ) of the light sheet are left out: the
/// centre of a stripe that is cut or lit on two surfaces is displaced, by at most 3 µm beyond that distance (eq. 2).
pub const BORDER_SIGMAS: f64 = 3.0;

/// Assumed thickness of the light sheets where the cloud does not state it (one σ), relative to the distance to the
/// camera: a stripe of 5 px of a station at 400 mm, 0.35 mm. The uncertainty is then incomplete.
pub const DEFAULT_LINE_SIGMA_RELATIVE: f64 = 8.75e-4;

/// Points near the border (or viewed too steeply) are kept if fewer than this fraction would remain without them.
pub const MIN_INTERIOR_FRACTION: f64 = 0.35;

/// Planes within this angle count as parallel (degrees): a block on a table with dust under one edge.
pub const PARALLEL_DEGREES: f64 = 3.0;

/// A nominal height selects planes within this fraction of it.
pub const NOMINAL_HINT_RELATIVE: f64 = 0.5;

/// Lower limit of the cosine between ray and normal: beyond 73° of incidence the predicted σ no longer describes the
/// error, and the weight of a point must stay bounded.
pub const MIN_COSINE: f64 = 0.3;

/// Points of curved features viewed at a larger incidence are left out if enough others remain (cosine, 66°): there a
/// stripe is steep and foreshortened on one side, which displaces its centre along the slope; the error grows with the
/// tangent and is amplified in the radius.
pub const MIN_CURVED_COSINE: f64 = 0.4;

/// The same for points lit at more than this incidence (tangent, 56°) where the surface is curved across the sheet: across
/// the sheet's thickness the light then grows so fast towards the side facing the projector that the stripe's centre moves there, by
/// s²·tan(incidence)/R for a thickness of s on a radius R. Stricter than the limit for the view: this error has one
/// sign on the whole shaded side (rendered balls of 18.9 mm: radius +17 µm without, +2 µm with this limit). A larger
/// limit would leave more than the thickness itself does in a centroid, 3 s²/2R.
pub const MAX_CURVED_LIGHT_TANGENT: f64 = 1.5;

/// [`MIN_CURVED_COSINE`] where the calibration does not state the position of the light source (53°): the shaded side
/// can then be excluded only by a stricter limit everywhere.
pub const MIN_CURVED_COSINE_UNLIT: f64 = 0.6;

/// Lower limit of a point's σ relative to the median, so that no point dominates a fit.
pub const MIN_SIGMA_RATIO: f64 = 0.3;

/// σ relative to the extent of the cloud, used if no point has a σ; the residuals then set the scale.
pub const UNKNOWN_SIGMA_PER_EXTENT: f64 = 2.5e-4;

/// Lower limit of the noise part of σ, relative to σ.
pub const MIN_NOISE_RATIO: f64 = 0.25;

/// Columns over which neighbouring points share their noise, unless the cloud states it (px).
pub const NOISE_CORRELATION_PX: f64 = 7.0;

/// Key of the cloud comment that states it.
pub const NOISE_CORRELATION_KEY: &str = "noise_correlation_px";

/// Points re-triangulated per calibration mode, over all features of a measurement.
pub const SYSTEMATIC_POINTS: usize = 3000;

/// Largest median distance between the cloud and its re-triangulated pixels, relative to the distance to the camera;
/// more means another calibration. 20 µm at 400 mm.
pub const MAX_MISMATCH_RELATIVE: f64 = 5e-5;

/// Fraction of the residuals between the two quantiles whose difference is the robust peak-to-peak flatness.
pub const FLATNESS_FRACTION: f64 = 0.999;

/// Flatness keeps points up to this many robust standard deviations off the plane: form belongs to the value, outliers
/// do not.
pub const FLATNESS_TRIM_SIGMAS: f64 = 8.0;

/// Coverage factor of the expanded uncertainty (ISO 14253-1).
pub const COVERAGE_FACTOR: f64 = 2.0;

/// Key of the cloud comment with the thickness of its light sheets (one σ, mm).
pub const LINE_SIGMA_KEY: &str = "line_sigma_mm ";

/// Displacement of a line's centre on a curved surface in units of δ: 0 for a centre at the peak, 3 for a centroid, 1.5
/// for an extraction whose kernel is as wide as the line. Values of features are corrected for it; comparisons with CAD
/// models, whose curvature varies, contain it in their uncertainty.
pub const FOOTPRINT_FACTOR: f64 = 1.5;
/// σ of that correction as a fraction of it: saturation and blur may move the centre anywhere between peak and centroid,
/// a rectangular distribution.
pub const FOOTPRINT_SIGMA: f64 = 0.577;

/// σ of the correction for averaging along curved lines and for the lens's blur as a fraction of it: the length of the
/// windows is known to half a column of ten, which the bias follows with the fourth power (0.2), the ends of lines to a
/// column or two, and the square of the blur to 0.58 of what is assumed.
pub const AVERAGING_SIGMA: f64 = 0.5;
/// Square of the blur of the lens and its pixels, px²: between nothing and one pixel (one σ), a rectangular distribution.
pub const BLUR_SQUARED_PX2: f64 = 0.5;
/// Largest gap in a line of the cloud that was one line to the extraction, as a fraction of the columns that affect a
/// point: cutting a line into pieces removes 0.8 line widths, of the 3.3 that the longest window has on either side.
pub const COURSE_MAX_GAP: f64 = 0.3;
/// Largest slope of a line, rows per column: the extraction detects lines of up to 75°.
pub const COURSE_MAX_SLOPE: f64 = 4.0;
/// Least brightness of a line relative to a surface that faces the light, near its shadow.
pub const COURSE_MIN_BRIGHTNESS: f64 = 0.05;

/// Number of frames with the same speckle, times their distance, in thicknesses of the sheet: the integral 2√π of the
/// correlation exp(−Δ²/4s²) over the travel (eq. 5).
pub const SPECKLE_SUM: f64 = 3.545;

/// Temperature difference of the station from its calibration, one σ, K: warmed up, in a room with a temperature within
/// 1 K. Assumed; there is no sensor.
pub const TEMPERATURE_SIGMA_K: f64 = 0.5;

/// Relative drift of a laser diode's wavelength, 1/K: 0.13 nm/K at 650 nm.
pub const WAVELENGTH_DRIFT_PER_K: f64 = 2e-4;

/// Coefficient of thermal expansion of a part, 1/K: steel.
pub const EXPANSION_PER_K: f64 = 11.5e-6;

/// RMS of the residuals explained by a part's form error, relative to the distance to the camera: a worse surface does
/// not have the assumed shape. 50 µm at 400 mm; parts are as large as a station's field.
pub const FORM_RMS_RELATIVE: f64 = 1.25e-4;

/// RMS of the residuals explained by noise, in predicted σ: real surfaces scatter up to three times as much.
pub const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// Largest fraction of the points inside an outline that may be off the surface: dust and outliers are fewer.
pub const MAX_OFF_SURFACE_FRACTION: f64 = 0.25;

/// Smallest arc that determines a radius, degrees.
pub const MIN_ARC_DEG: f64 = 60.0;

/// Fraction of the normals left out at the ends of an arc, so that outliers do not lengthen it.
pub const ARC_TAIL_FRACTION: f64 = 0.02;

/// A radius with a relative standard uncertainty above this is not determined.
pub const MAX_RADIUS_UNCERTAINTY: f64 = 0.1;

/// A face is the base if its area is this many times that of the other, even if it has fewer points.
pub const BASE_SPREAD_RATIO: f64 = 1.2;

/// Angles below this many standard uncertainties fold at 0°: their mean is biased.
pub const FOLD_SIGMAS: f64 = 5.0;

/// Length of the chords from which a local normal is estimated, in thicknesses (one σ) of the light sheet.
pub const NORMAL_BASE_SIGMAS: f64 = 3.0;

/// Points within this distance of a plane (in thicknesses, one σ, of the light sheet) may belong to its rim: a stripe cut
/// by an edge is displaced from the surface by up to that much (eq. 2).
pub const RIM_REACH_LINE_SIGMAS: f64 = 1.5;

/// A line is interrupted where its points are further apart than this many spacings.
pub const RIM_GAP_SPACINGS: f64 = 2.5;

/// Fewest points in a row that end at a rim.
pub const RIM_MIN_RUN_POINTS: usize = 5;

/// Points of a line, counted from its end, that show its full intensity: beyond the blur, and close enough to be equally
/// bright.
pub const RIM_FULL_LIGHT_POINTS: std::ops::Range<usize> = 8..24;

/// Lines that cross a rim at less than this angle do not locate it (sine, 40°).
pub const RIM_MIN_SINE: f64 = 0.64;

/// Fewest crossings per parameter of a contour.
pub const RIM_MIN_CROSSINGS_PER_PARAMETER: usize = 3;

/// Largest part of a circle without crossings, degrees.
pub const RIM_MAX_GAP_DEG: f64 = 120.0;

/// Standard uncertainty of the place of three quarters of the intensity, in blurs (one σ): the reflectance may differ by a
/// tenth between the rim and the surface further in.
pub const RIM_SIGMA_BLURS: f64 = 0.25;

/// Smallest fraction of crossings whose intensity falls before they end: only these locate the rim, and with fewer its
/// position is unknown.
pub const RIM_MIN_FADED_FRACTION: f64 = 0.25;

/// Points from which the noise of a feature is estimated.
pub const NOISE_POINTS: usize = 5000;

/// Fewest points of every feature of a plan that are re-triangulated per calibration mode.
pub const MIN_SYSTEMATIC_POINTS: usize = 400;

/// Points used to align a scan with its nominal surface: the pose is then known far better than any single deviation.
pub const BEST_FIT_POINTS: usize = 20_000;

/// Fewest of them with a surface point within reach.
pub const BEST_FIT_MIN_POINTS: usize = 100;

/// A degree of freedom is locked if its eigenvalue is below this fraction of the largest (rotations as lengths at the RMS
/// distance of the points): the facets of a round part would otherwise appear to constrain its rotation.
pub const BEST_FIT_LOCK_RATIO: f64 = 1e-3;

/// Residual with half the weight, in robust standard deviations: 95 % efficient for normal noise.
pub const CAUCHY_SIGMAS: f64 = 2.385;

/// Default reach: points within this fraction of the part's diagonal of its surface belong to it.
pub const DEFAULT_REACH_RELATIVE: f64 = 0.02;

/// Default capture range: a fit begins with this fraction of the diagonal, so that the start pose may be off by as much.
pub const DEFAULT_CAPTURE_RELATIVE: f64 = 0.06;

/// Cells of a comparison along the diagonal of a part, unless a scan is too coarse for so many.
pub const CELLS_PER_DIAGONAL: f64 = 150.0;

/// Average number of points of a covered cell, at least: the noise of their mean is a third of theirs, half of it if correlated.
pub const CELL_POINTS: f64 = 12.0;

/// Fewest points of a cell that is judged: almost half of the average.
pub const MIN_CELL_POINTS: usize = 5;

/// Points of a comparison that are re-triangulated per calibration mode.
pub const COMPARED_SYSTEMATIC_POINTS: usize = 2000;

/// Number of worst deviations that are listed.
pub const N_WORST_DEVIATIONS: usize = 10;

/// Smallest distance between listed worst deviations, in cells.
pub const WORST_DEVIATION_CELLS: f64 = 6.0;

/// Largest fraction of an artefact's points that an acceptance test may leave out (VDI/VDE 2634: 3 ‰).
pub const REJECTED_FRACTION: f64 = 0.003;

/// Fraction of an artefact's points in the band of D95 (ISO 10360-13).
pub const DISPERSION_FRACTION: f64 = 0.95;

/// Temperature at which calibrated lengths apply, °C (ISO 1).
pub const REFERENCE_TEMPERATURE_C: f64 = 20.0;

/// Expanded uncertainty of the temperature of an artefact (k = 2), K: a contact thermometer, and an artefact that has not
/// fully taken the temperature of the room.
pub const THERMOMETER_UNCERTAINTY_K: f64 = 0.5;

/// Expanded relative uncertainty of a coefficient of thermal expansion (k = 2): a material from a data sheet.
pub const EXPANSION_UNCERTAINTY_RELATIVE: f64 = 0.1;

/// Points of repeated scans correspond if they are at most this far apart along their line, px: half the spacing of the points.
pub const SAME_PLACE_PX: f32 = 0.5;
