//! The features that a tool needs.

use nalgebra::Vector3;

use crate::fitting::features::{FeatureFit, Search};
use crate::fitting::sample::Samples;
use crate::interface::request::{MeasureError, MeasureRequest, Tool};
use crate::interface::shape::{Shape, across};
use crate::measuring::form::keep_form;
use crate::params::BASE_SPREAD_RATIO;

/// Fraction of the points left out at each end when the extent of a face is measured, so that outliers do not widen it.
const SPREAD_TAIL_FRACTION: f64 = 0.02;

/// Finds the features of a tool, in the order [`value`](super::value::value) expects.
pub(crate) fn find(
    search: &mut Search,
    request: &MeasureRequest,
    notes: &mut Vec<String>,
) -> Result<Vec<FeatureFit>, MeasureError> {
    let all = search.samples.indices();
    let missing = |feature| MeasureError::FeatureNotFound { feature, n_points: all.len() };
    let nominal = request.nominal_mm;
    match request.tool {
        Tool::Plane => Ok(vec![search.plane("plane", &all).ok_or(missing("plane"))?]),
        Tool::Flatness => {
            let mut plane = search.plane("plane", &all).ok_or(missing("plane"))?;
            keep_form(search.samples, &mut plane).ok_or(missing("plane"))?;
            Ok(vec![plane])
        }
        Tool::Sphere => {
            let off_table = search.off_table();
            Ok(vec![search.sphere("sphere", &off_table, nominal).ok_or(missing("sphere"))?])
        }
        Tool::Cylinder => {
            let off_table = search.off_table();
            Ok(vec![search.cylinder("cylinder", &off_table, nominal).ok_or(missing("cylinder"))?])
        }
        Tool::Step => {
            let base = search.plane("base", &all).ok_or(missing("plane"))?;
            let top =
                second_plane(search, &base, nominal, notes).ok_or(missing("second plane parallel to the base"))?;
            let (base, top) = base_first(search.samples, base, top);
            if base.shape.distance_mm(&centroid(search.samples, &top)) < 0.0 {
                notes.push("the second plane is below the base plane: the value is a depth, negative".into());
            }
            Ok(vec![base, top])
        }
        Tool::Distance => distance_features(search, nominal, notes).ok_or(missing("pair of planes or spheres")),
        Tool::Angle => {
            let first = search.plane("first plane", &all).ok_or(missing("plane"))?;
            let rest = search.without(&all, &first);
            let second = search.plane("second plane", &rest).ok_or(missing("second plane"))?;
            Ok(vec![first, second])
        }
    }
}

fn second_plane(
    search: &mut Search,
    base: &FeatureFit,
    height_mm: Option<f64>,
    notes: &mut Vec<String>,
) -> Option<FeatureFit> {
    let rest = search.without(&search.samples.indices(), base);
    if let Some(height) = height_mm {
        let above = |idx: &u32| base.shape.distance_mm(&search.samples.position(*idx)) * height > 0.0;
        let same_side: Vec<u32> = rest.iter().copied().filter(above).collect();
        for candidates in [&same_side, &rest] {
            if let Some(found) = search.parallel_plane("top", candidates, &base.shape, height_mm) {
                return Some(found);
            }
        }
        notes.push("no plane near the nominal height; the largest parallel plane was used".into());
    }
    search.parallel_plane("top", &rest, &base.shape, None)
}

/// Two parallel planes, or two spheres if they hold more than twice the points of the second plane.
fn distance_features(
    search: &mut Search,
    nominal: Option<f64>,
    notes: &mut Vec<String>,
) -> Option<Vec<FeatureFit>> {
    let all = search.samples.indices();
    let off_table = search.off_table();
    let first = search.sphere("first sphere", &off_table, None);
    let rest = first.as_ref().map(|first| search.without(&off_table, first)).unwrap_or_default();
    let second = first.as_ref().and_then(|_| search.sphere("second sphere", &rest, None));
    let planes = search.plane("first plane", &all).and_then(|base| {
        let top = second_plane(search, &base, nominal, notes)?;
        Some((base, FeatureFit { role: "second plane", ..top }))
    });
    let n_spheres = first.as_ref().zip(second.as_ref()).map_or(0, |(a, b)| a.inliers.len() + b.inliers.len());
    match planes {
        Some((base, top)) if n_spheres <= 2 * top.inliers.len() => {
            notes.push("distance between two parallel planes".into());
            Some(vec![base, top])
        }
        _ => {
            notes.push("distance between the centres of two spheres".into());
            Some(vec![first?, second?])
        }
    }
}

/// Orders two parallel faces, the wider first: the surface around a boss or a pocket is its base, even if it has fewer
/// points.
fn base_first(samples: &Samples, base: FeatureFit, top: FeatureFit) -> (FeatureFit, FeatureFit) {
    let Shape::Plane { normal, .. } = base.shape else { return (base, top) };
    let axes = across(&normal);
    if spread_mm2(samples, &top, &axes) > BASE_SPREAD_RATIO * spread_mm2(samples, &base, &axes) {
        return (FeatureFit { role: "base", ..top }, FeatureFit { role: "top", ..base });
    }
    (base, top)
}

/// Area of the rectangle along two directions that contains a face.
fn spread_mm2(samples: &Samples, face: &FeatureFit, axes: &[Vector3<f64>; 2]) -> f64 {
    axes.iter()
        .map(|axis| {
            let mut along: Vec<f64> = face.inliers.iter().map(|&idx| axis.dot(&samples.position(idx))).collect();
            along.sort_unstable_by(f64::total_cmp);
            let tail = (SPREAD_TAIL_FRACTION * along.len() as f64) as usize;
            along[along.len() - 1 - tail] - along[tail]
        })
        .product()
}

fn centroid(samples: &Samples, feature: &FeatureFit) -> Vector3<f64> {
    let sum: Vector3<f64> = feature.inliers.iter().map(|&idx| samples.position(idx)).sum();
    sum / feature.inliers.len() as f64
}
