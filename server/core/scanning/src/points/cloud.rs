//! The point cloud of a scan, in the part frame.

/// One measured point, in the part frame (the camera frame at stage position 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Position, mm.
    pub x_mm: f64,
    /// Position, mm.
    pub y_mm: f64,
    /// Position, mm.
    pub z_mm: f64,
    /// Diffraction order of the line.
    pub order: i8,
    /// Index of the frame within the scan.
    pub frame: u32,
    /// Column of the centreline, raw sensor pixels.
    pub u_px: f32,
    /// Row of the centreline, raw sensor pixels.
    pub v_px: f32,
    /// Grey levels above the background.
    pub intensity: f32,
    /// Predicted standard deviation along the camera ray: image noise and calibration combined.
    pub sigma_mm: f32,
}

/// A scan's points with the comments needed to interpret them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cloud {
    /// Points, ordered by frame, then order, then along the line.
    pub points: Vec<CloudPoint>,
    /// Comments stored in file headers: calibration id, software version, units, noise correlation, the calibration
    /// itself.
    pub comments: Vec<String>,
}
