//! Constants of the simulation, each with its unit and reason.

/// Grey levels the sensor adds in the dark, of 255; keeps the read noise from being clipped.
pub const BLACK_LEVEL: f32 = 3.0;

/// Read noise, grey levels of 255: an ordinary 8-bit machine vision camera.
pub const READ_NOISE_LEVELS: f32 = 1.2;

/// Electrons per grey level of 255: a full well of 10 000 electrons.
pub const ELECTRONS_PER_LEVEL: f32 = 40.0;

/// Lens blur: standard deviation of the point spread on top of the pixel's own square, pixels.
pub const PSF_SIGMA_PX: f32 = 0.8;

/// Half-width of the sampled point spread, pixels: at 4 px a Gaussian of 0.8 px holds 1e-6 of its peak.
pub const PSF_RADIUS_PX: usize = 4;

/// Light sheets are followed to this many standard deviations; beyond, less than 0.1 grey levels remain.
pub const SHEET_REACH_SIGMAS: f64 = 4.0;

/// Share of the standoff up to which light that is out of focus is followed as wide as it is: parts and boards lie within a
/// fifth of it.
pub const FOLLOWED_DEPTH_SHARE: f64 = 0.2;

/// Spacing of the nodes of the precomputed ray and sheet maps, pixels; cubic interpolation between them is
/// exact to 1e-4 px for fields up to ±170 mm at 400 mm (test `interpolated_sheets_match_exact_ones`).
pub const MAP_STEP_PX: usize = 8;

/// Side of the periodic speckle pattern, pixels.
pub const SPECKLE_TILE_PX: usize = 512;

/// Side of the blocks of an image that look into the speckle pattern at independent places, pixels.
pub const SPECKLE_BLOCK_PX: usize = 128;

/// Most independent speckle patterns averaged; below a contrast of 1/8 the mean is mixed with a constant.
pub const SPECKLE_LOOKS_MAX: usize = 64;

/// Bits of the index into the table of normal quantiles: 2¹⁴ values reach ±4.0 standard deviations.
pub const QUANTILE_BITS: u32 = 14;

/// Length of the strip of unlit pixels that dark words of a picture are copied from, at random places: each quantile
/// four times, and short enough for a processor's cache.
pub const DARK_STRIP_PX: usize = 4 << QUANTILE_BITS;

/// Reflectance of the target's white.
pub const WHITE_REFLECTANCE: f64 = 0.8;

/// Reflectance of the target's black.
pub const BLACK_REFLECTANCE: f64 = 0.08;

/// Reflectance of the backdrop behind the target.
pub const BACKDROP_REFLECTANCE: f64 = 0.22;

/// Distance of the backdrop behind the target's centre as a fraction of the standoff: 80 mm at 400 mm,
/// so that light beyond the target never lies in the target's plane.
pub const BACKDROP_GAP_FRACTION: f64 = 0.2;

/// Reflectance of plates, gauge blocks, spheres and freeform parts: matt grey paint.
pub const PART_REFLECTANCE: f64 = 0.7;

/// Grey levels of the target's white in a board image, of 255: bright and clear of saturation.
pub const BOARD_WHITE_LEVEL: f64 = 170.0;

/// How much the light on a board image changes from the centre to an edge of the picture.
pub const ILLUMINATION_GRADIENT: f64 = 0.06;

/// Loss of light from the centre to a corner of a board image.
pub const VIGNETTING: f64 = 0.08;

/// Samples along each side of a pixel that an edge of the target crosses.
pub const EDGE_SAMPLES: usize = 6;

/// The fan reaches this much farther than the picture at the standoff, so that lines cross the whole of it.
pub const FAN_MARGIN: f64 = 1.35;

/// Distance from a light ray's hit, mm, within which a second hit counts as the same: above the rounding of a
/// path of a metre and far below a pixel.
pub const SAME_HIT_MM: f64 = 1e-6;

/// How steeply the camera looks down on a turntable, radians.
pub const LOOK_DOWN_RAD: f64 = 0.3;

/// How far a turntable's top lies below the middle of the working volume, as a share of half the field's width: parts of
/// twice that height stand in the middle of the picture.
pub const TABLE_BELOW_SHARE: f64 = 0.25;

/// Height of the gauge block beside a station, mm: that of the paper.
pub const GAUGE_HEIGHT_MM: f64 = 8.9;

/// Radius of the ball beside a station, mm: that of the paper.
pub const SPHERE_RADIUS_MM: f64 = 18.9;
