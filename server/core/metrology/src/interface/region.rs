//! Regions of space that select points.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A region of space; points outside are ignored. Millimetres, in the frame of the points it is applied to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Region {
    /// An axis-aligned box.
    Box {
        /// Smallest x, y, z, mm.
        min_mm: [f64; 3],
        /// Largest x, y, z, mm.
        max_mm: [f64; 3],
    },
    /// A ball.
    Sphere {
        /// Its centre, mm.
        centre_mm: [f64; 3],
        /// Its radius, mm.
        radius_mm: f64,
    },
    /// A cylinder of limited length.
    Cylinder {
        /// The middle of its axis, mm.
        centre_mm: [f64; 3],
        /// The direction of its axis, of any length.
        axis: [f64; 3],
        /// Its radius, mm.
        radius_mm: f64,
        /// Half its length, mm.
        half_length_mm: f64,
    },
}

impl Region {
    /// The box between two opposite corners, mm.
    pub fn between(corner_mm: [f64; 3], opposite_mm: [f64; 3]) -> Self {
        let pick = |choose: fn(f64, f64) -> f64| [0, 1, 2].map(|axis| choose(corner_mm[axis], opposite_mm[axis]));
        Self::Box { min_mm: pick(f64::min), max_mm: pick(f64::max) }
    }

    /// Whether a point lies inside.
    pub fn contains(&self, position: &Vector3<f64>) -> bool {
        match self {
            Self::Box { min_mm, max_mm } => {
                (0..3).all(|axis| (min_mm[axis]..=max_mm[axis]).contains(&position[axis]))
            }
            Self::Sphere { centre_mm, radius_mm } => {
                (position - Vector3::from(*centre_mm)).norm_squared() <= radius_mm * radius_mm
            }
            Self::Cylinder { centre_mm, axis, radius_mm, half_length_mm } => {
                let (from_centre, axis) = (position - Vector3::from(*centre_mm), Vector3::from(*axis).normalize());
                let along = axis.dot(&from_centre);
                along.abs() <= *half_length_mm
                    && (from_centre - axis * along).norm_squared() <= radius_mm * radius_mm
            }
        }
    }

    /// What is wrong with its numbers; `None` if nothing is.
    pub(crate) fn fault(&self) -> Option<&'static str> {
        let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
        match self {
            Self::Box { min_mm, max_mm } => {
                (!(finite(min_mm) && finite(max_mm) && (0..3).all(|k| min_mm[k] < max_mm[k])))
                    .then_some("a box needs finite corners, min_mm below max_mm along every axis")
            }
            Self::Sphere { centre_mm, radius_mm } => {
                (!(finite(centre_mm) && radius_mm.is_finite() && *radius_mm > 0.0))
                    .then_some("a sphere needs a finite centre and a radius above 0")
            }
            Self::Cylinder { centre_mm, axis, radius_mm, half_length_mm } => {
                let sizes = [*radius_mm, *half_length_mm];
                let is_good = finite(centre_mm)
                    && finite(axis)
                    && Vector3::from(*axis).norm() > 0.0
                    && sizes.iter().all(|size| size.is_finite() && *size > 0.0);
                (!is_good)
                    .then_some("a cylinder needs a finite centre, an axis, and radius and half length above 0")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_contain_the_points_inside_them() {
        let regions = [
            Region::between([1.0, -1.0, 5.0], [-1.0, 1.0, 3.0]),
            Region::Sphere { centre_mm: [0.0, 0.0, 4.0], radius_mm: 1.0 },
            Region::Cylinder {
                centre_mm: [0.0, 0.0, 4.0],
                axis: [0.0, 0.0, -7.0],
                radius_mm: 1.0,
                half_length_mm: 1.0,
            },
        ];
        for (region, in_corner) in regions.iter().zip([true, false, false]) {
            assert_eq!(region.fault(), None);
            assert!(region.contains(&Vector3::new(0.0, 0.0, 4.9)), "{region:?}");
            assert!(!region.contains(&Vector3::new(0.0, 0.0, 5.1)), "{region:?}");
            assert!(!region.contains(&Vector3::new(1.1, 0.0, 4.0)), "{region:?}");
            assert_eq!(region.contains(&Vector3::new(0.9, 0.9, 4.9)), in_corner, "{region:?}");
        }
        assert!(Region::Box { min_mm: [0.0; 3], max_mm: [0.0, 1.0, 1.0] }.fault().is_some());
    }
}
