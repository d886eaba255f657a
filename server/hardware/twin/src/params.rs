//! Constants of the simulation, each with its unit and reason.

/// Black level of the sensor, of 255; keeps the read noise from being clipped.
pub const BLACK_LEVEL: f32 = 3.0;

/// Read noise, grey levels of 255: a typical 8-bit machine vision camera.
pub const READ_NOISE_LEVELS: f32 = 1.2;

/// Electrons per grey level of 255: a full well of 10 000 electrons.
pub const ELECTRONS_PER_LEVEL: f32 = 40.0;

/// Lens blur: standard deviation of the point spread in addition to the pixel's square, pixels.
pub const PSF_SIGMA_PX: f32 = 0.8;

/// Half-width of the sampled point spread, pixels: at 4 px a Gaussian of 0.8 px has 1e-6 of its peak.
pub const PSF_RADIUS_PX: usize = 4;

/// Light sheets are evaluated up to this many standard deviations; beyond, less than 0.1 grey levels remain.
pub const SHEET_REACH_SIGMAS: f64 = 4.0;

/// Fraction of the standoff up to which out-of-focus light is evaluated at its full width: parts and boards lie within
/// a fifth of it.
pub const EVALUATED_DEPTH_FRACTION: f64 = 0.2;

/// Spacing of the nodes of the precomputed ray and sheet maps, pixels; cubic interpolation between them is exact to
/// 1e-4 px for fields up to ±170 mm at 400 mm (test `interpolated_sheets_match_exact_ones`).
pub const MAP_STEP_PX: usize = 8;

/// Side of the periodic speckle pattern, pixels.
pub const SPECKLE_TILE_PX: usize = 512;

/// Side of the image blocks that sample the speckle pattern at independent offsets, pixels.
pub const SPECKLE_BLOCK_PX: usize = 128;

/// Greatest number of independent speckle patterns averaged; below a contrast of 1/8 the mean is mixed with a constant.
pub const SPECKLE_LOOKS_MAX: usize = 64;

/// Bits of the index into the table of normal quantiles: 2¹⁴ values reach ±4.0 standard deviations.
pub const QUANTILE_BITS: u32 = 14;

/// Length of the strip of unlit pixels from which dark words of an image are copied, at random offsets: each quantile
/// four times, and short enough for a processor's cache.
pub const DARK_STRIP_PX: usize = 4 << QUANTILE_BITS;

/// Reflectance of the target's white.
pub const WHITE_REFLECTANCE: f64 = 0.8;

/// Reflectance of the target's black.
pub const BLACK_REFLECTANCE: f64 = 0.08;

/// Reflectance of the backdrop behind the target.
pub const BACKDROP_REFLECTANCE: f64 = 0.22;

/// Distance of the backdrop behind the target's centre as a fraction of the standoff: 80 mm at 400 mm, so that light
/// beyond the target never lies in the target's plane.
pub const BACKDROP_GAP_FRACTION: f64 = 0.2;

/// Reflectance of plates, gauge blocks, spheres and freeform parts: matt grey paint.
pub const PART_REFLECTANCE: f64 = 0.7;

/// Grey level of the target's white in a board image, of 255: bright and without saturation.
pub const BOARD_WHITE_LEVEL: f64 = 170.0;

/// Change of the light in a board image from the centre to an edge.
pub const ILLUMINATION_GRADIENT: f64 = 0.06;

/// Loss of light from the centre to a corner of a board image.
pub const VIGNETTING: f64 = 0.08;

/// Samples along each side of a pixel that is crossed by an edge of the target.
pub const EDGE_SAMPLES: usize = 6;

/// Width of the fan relative to the image at the standoff, so that lines cross all of it.
pub const FAN_MARGIN: f64 = 1.35;

/// Distance from a light ray's hit, mm, within which a second hit counts as the same: above the rounding of a path of a
/// metre and far below a pixel.
pub const SAME_HIT_MM: f64 = 1e-6;

/// Angle at which the camera looks down on a turntable, radians.
pub const LOOK_DOWN_RAD: f64 = 0.3;

/// Depth of a turntable's top below the middle of the working volume, as a fraction of half the field's width: parts of
/// twice that height are centred in the image.
pub const TABLE_BELOW_FRACTION: f64 = 0.25;

/// Default height of the gauge block, mm: that of the paper.
pub const GAUGE_HEIGHT_MM: f64 = 8.9;

/// Default radius of the ball, mm: that of the paper.
pub const SPHERE_RADIUS_MM: f64 = 18.9;

/// Part of the field's height over which independent lasers are aimed: boards held for calibration fill it.
pub const LASER_FIELD_FRACTION: f64 = 0.5;
