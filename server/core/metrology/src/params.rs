//! Constants of the algorithms, each with unit and reason.

/// Fewest points a feature may rest on: ten per parameter of a cylinder.
pub const MIN_FEATURE_POINTS: usize = 50;

/// A second feature must hold at least this share of the points looked at; less is debris.
pub const MIN_FEATURE_SHARE: f64 = 0.003;

/// A dominant plane with less than this share is no table but a slice of something curved.
pub const MIN_TABLE_SHARE: f64 = 0.2;

/// Points looked at while hypotheses are scored: enough to rank features of 1 % of the cloud.
pub const RANSAC_POINTS: usize = 3000;

/// Triples tried for a plane: 99.9 % sure to hit one that holds 26 % of the points.
pub const PLANE_HYPOTHESES: usize = 400;

/// Quadruples tried for a sphere: 99.9 % sure to hit one that holds 25 % of the points off the table.
pub const SPHERE_HYPOTHESES: usize = 2000;

/// Pairs of points with normals tried for a cylinder: 99.9 % sure at a share of 8 % off the table.
pub const CYLINDER_HYPOTHESES: usize = 1000;

/// Points whose normals are estimated for a cylinder; all pairs of them are compared.
pub const NORMAL_POINTS: usize = 1200;

/// Neighbours a normal is estimated from: three rings' worth of noise averaging, still local.
pub const NORMAL_NEIGHBOURS: usize = 14;

/// Band of a hypothesis, in the points' σ: keeps 99.99 % of the points of a true one.
pub const RANSAC_BAND_SIGMAS: f64 = 4.0;

/// Trim of the refined fit, in robust standard deviations of its residuals: loses 1 good point in 2000.
pub const TRIM_SIGMAS: f64 = 3.5;

/// The trim never opens further than this many predicted σ, so that a fit cannot swallow its neighbourhood.
pub const MAX_TRIM_SIGMAS: f64 = 40.0;

/// The trim never closes further than this many predicted σ: rounding is no outlier.
pub const MIN_TRIM_SIGMAS: f64 = 0.01;

/// Points used while the trim settles; the last rounds take all.
pub const TRIM_POINTS: usize = 20_000;

/// Rounds for the trim to settle.
pub const TRIM_ROUNDS: usize = 15;

/// Points nearer to the border of a feature than this many thicknesses (one σ) of the light sheet are left out: a stripe
/// that is cut or lit from two surfaces has its centre elsewhere, by 3 µm at most from there on (eq. 6).
pub const BORDER_SIGMAS: f64 = 3.0;

/// Thickness of the light sheets that a border is drawn for where the cloud does not state it (one σ), as a share of the
/// distance to the camera: a stripe of 5 px of a station at 400 mm, 0.35 mm. The uncertainty is then incomplete.
pub const USUAL_LINE_SIGMA_RELATIVE: f64 = 8.75e-4;

/// Points near the border (or seen too steeply) are kept if leaving them out would spare less than this share.
pub const MIN_INTERIOR_SHARE: f64 = 0.35;

/// Planes within this angle count as parallel (degrees): a block on a table with dust under one edge.
pub const PARALLEL_DEGREES: f64 = 3.0;

/// A nominal height selects planes within this share of it.
pub const NOMINAL_HINT_SHARE: f64 = 0.5;

/// Cosine between ray and normal is not taken smaller than this: beyond 73° of incidence the predicted σ no longer
/// describes the error, and the weight of a point must not grow without end.
pub const MIN_COSINE: f64 = 0.3;

/// Points of curved features seen at more than this incidence are left out if enough others remain (cosine, 66°):
/// there a stripe runs steeply and is foreshortened on one side, which pulls its centre along the slope; the error
/// grows with the tangent, and a radius feels it with a lever.
pub const MIN_CURVED_COSINE: f64 = 0.4;

/// The same for points lit at more than this incidence (tangent, 56°): across the thickness of the sheet the light
/// then grows so fast towards the side facing the projector that the stripe's centre moves there, by
/// s²·tan(incidence)/R for a thickness of s on a radius R. Stricter than the limit for the view: this error has one
/// sign on the whole shaded side (rendered balls of 18.9 mm: radius +17 µm without, +2 µm with this limit). What it
/// leaves is no more than U holds for the footprint: two of its σ, [`FOOTPRINT_SHARE`] · s²/2R each.
pub const MAX_CURVED_LIGHT_TANGENT: f64 = FOOTPRINT_SHARE;

/// [`MIN_CURVED_COSINE`] where the calibration does not say where the light comes from (53°): the shaded side can
/// then be kept out only by keeping out more of everything.
pub const MIN_CURVED_COSINE_UNLIT: f64 = 0.6;

/// σ of a point is not taken smaller than this share of the median: no point may rule a fit.
pub const MIN_SIGMA_SHARE: f64 = 0.3;

/// If no point carries a σ, the extent of the cloud times this stands in; residuals then set the scale.
pub const UNKNOWN_SIGMA_PER_EXTENT: f64 = 2.5e-4;

/// The noise part of σ is not taken smaller than this share of it.
pub const MIN_NOISE_SHARE: f64 = 0.25;

/// Columns over which neighbouring points share their noise, unless the cloud says otherwise (px).
pub const NOISE_CORRELATION_PX: f64 = 7.0;

/// Key of the cloud comment that says otherwise.
pub const NOISE_CORRELATION_KEY: &str = "noise_correlation_px";

/// Points triangulated anew per calibration mode, over all features of a measurement.
pub const SYSTEMATIC_POINTS: usize = 3000;

/// Largest median distance between the cloud and its pixels triangulated anew, as a share of the distance to the camera;
/// more means another calibration. 20 µm at 400 mm.
pub const MAX_MISMATCH_RELATIVE: f64 = 5e-5;

/// Share of the residuals between the two quantiles whose difference is the robust peak-to-peak flatness.
pub const FLATNESS_SHARE: f64 = 0.999;

/// Flatness keeps points up to this many robust standard deviations off the plane: form belongs to the value,
/// stray points do not.
pub const FLATNESS_TRIM_SIGMAS: f64 = 8.0;

/// Coverage factor of the expanded uncertainty (ISO 14253-1).
pub const COVERAGE_FACTOR: f64 = 2.0;

/// How a cloud's comments introduce the thickness of its light sheets (one σ, mm).
pub const LINE_SIGMA_KEY: &str = "line_sigma_mm ";

/// Pull of a curved surface on a line's centre, one σ, in units of δ: a centre on the peak feels 0, a centroid 3; an
/// extraction whose kernel is as wide as the line stands between, and where exactly depends on saturation and blur.
pub const FOOTPRINT_SHARE: f64 = 1.5;

/// Frames that show the same speckle, times their distance, in thicknesses of the sheet: the integral 2√π of the
/// correlation exp(−Δ²/4s²) over the travel (eq. 5).
pub const SPECKLE_SUM: f64 = 3.545;

/// How far the station's temperature may be from that of its calibration, one σ, K: warmed up, in a hall whose
/// temperature is kept within 1 K. Assumed; there is no sensor.
pub const TEMPERATURE_SIGMA_K: f64 = 0.5;

/// Relative drift of a laser diode's wavelength, 1/K: 0.13 nm/K at 650 nm.
pub const WAVELENGTH_DRIFT_PER_K: f64 = 2e-4;

/// Relative expansion of a part, 1/K: steel.
pub const EXPANSION_PER_K: f64 = 11.5e-6;

/// RMS of the residuals that a part's own form explains, as a share of the distance to the camera: worse surfaces are not
/// the shape they are measured as. 50 µm at 400 mm; parts are as large as a station sees.
pub const FORM_RMS_RELATIVE: f64 = 1.25e-4;

/// RMS of the residuals that noise explains, in predicted σ: real surfaces scatter up to three times as much.
pub const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// Share of the points inside an outline that may be off the surface: dust and strays are less.
pub const MAX_OFF_SURFACE_SHARE: f64 = 0.25;

/// Smallest arc that holds a radius, degrees.
pub const MIN_ARC_DEG: f64 = 60.0;

/// Share of the normals left out at the ends of an arc: strays do not make it longer.
pub const ARC_TAIL_SHARE: f64 = 0.02;

/// A radius whose standard uncertainty is more than this share of it is not determined.
pub const MAX_RADIUS_UNCERTAINTY: f64 = 0.1;

/// A face is the base if it spreads over this many times the area of the other, even if it has fewer points.
pub const BASE_SPREAD_RATIO: f64 = 1.2;

/// Angles below this many standard uncertainties fold at 0°: their mean is not the angle's.
pub const FOLD_SIGMAS: f64 = 5.0;
