//! The depth range in which a line's image position alone determines its order (`docs/maths/labelling.md`,
//! "Problem").

use nalgebra::Vector2;
use optics::{Calibration, DepthRangeMm};

/// Nodes along each side of the image; depths change smoothly over it.
const N_NODES: usize = 20;

/// Depth range in which geometry alone determines the labels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthEnvelope {
    /// The depth range of the scan.
    pub stated_mm: DepthRangeMm,
    /// The widest range around the middle of the stated one in which no pixel could belong to two orders.
    pub unambiguous_mm: DepthRangeMm,
}

impl DepthEnvelope {
    /// Whether geometry alone determines every label within the stated depths.
    pub fn geometry_suffices(&self) -> bool {
        self.unambiguous_mm.near_mm <= self.stated_mm.near_mm
            && self.unambiguous_mm.far_mm >= self.stated_mm.far_mm
    }
}

impl std::fmt::Display for DepthEnvelope {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (stated, unambiguous) = (self.stated_mm, self.unambiguous_mm);
        write!(f, "depths {:.1}–{:.1} mm allowed; ", stated.near_mm, stated.far_mm)?;
        if self.geometry_suffices() {
            return write!(f, "a line's image position alone determines its order");
        }
        write!(
            f,
            "a line's image position alone determines its order within {:.1}–{:.1} mm, beyond it another order must observe the same surface",
            unambiguous.near_mm, unambiguous.far_mm
        )
    }
}

/// The envelope of a station for the stated depths.
pub fn depth_envelope(calibration: &Calibration, stated_mm: DepthRangeMm) -> DepthEnvelope {
    let middle = stated_mm.middle_mm();
    let camera = &calibration.camera;
    let nodes = |size_px: usize| (0..N_NODES).map(move |i| (size_px - 1) as f64 * i as f64 / (N_NODES - 1) as f64);
    let mut half = middle;
    for v_px in nodes(camera.height_px) {
        for u_px in nodes(camera.width_px) {
            let depths: Vec<f64> = calibration
                .orders
                .iter()
                .filter_map(|&order| calibration.triangulate(order, &Vector2::new(u_px, v_px), None))
                .map(|hit| (hit.hit.depth_mm - middle).abs())
                .collect();
            half = half.min(second_smallest(&depths));
        }
    }
    DepthEnvelope { stated_mm, unambiguous_mm: DepthRangeMm { near_mm: middle - half, far_mm: middle + half } }
}

/// The range ends where a second order becomes possible.
fn second_smallest(values: &[f64]) -> f64 {
    let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
    for &value in values {
        if value < first {
            (first, second) = (value, first);
        } else {
            second = second.min(value);
        }
    }
    second
}
