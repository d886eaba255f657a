//! The table by diffraction orders, in the form used in the paper.

use std::collections::BTreeMap;

use crate::fitting::features::FeatureFit;
use crate::fitting::fit::fit;
use crate::fitting::robust::Near;
use crate::fitting::sample::Samples;
use crate::interface::measurement::{ErrorSummary, OrderRow};
use crate::interface::request::Tool;
use crate::interface::shape::Shape;
use crate::params::MIN_FEATURE_POINTS;

/// Errors of all points and of each order's.
///
/// `reference`: the value with which a step's heights are compared.
pub(crate) fn table(
    samples: &Samples,
    tool: Tool,
    features: &[FeatureFit],
    reference: f64,
) -> (ErrorSummary, Vec<OrderRow>) {
    let mut by_order: BTreeMap<i8, Vec<f64>> = BTreeMap::new();
    let mut all = Vec::new();
    let evaluated = if tool == Tool::Step { &features[1..] } else { features };
    for feature in evaluated {
        for &idx in &feature.inliers {
            let sample = samples.at(idx);
            let error = match tool {
                Tool::Step => features[0].shape.distance_mm(&sample.in_part.xyz).abs() - reference,
                _ => feature.shape.distance_mm(&sample.in_part.xyz),
            };
            by_order.entry(sample.order).or_default().push(error);
            all.push(error);
        }
    }
    let rows = by_order
        .into_iter()
        .map(|(order, errors)| row(samples, tool, features, reference, order, ErrorSummary::from_errors(&errors)))
        .collect();
    (ErrorSummary::from_errors(&all), rows)
}

fn row(
    samples: &Samples,
    tool: Tool,
    features: &[FeatureFit],
    reference: f64,
    order: i8,
    errors: ErrorSummary,
) -> OrderRow {
    let own = match tool {
        Tool::Sphere | Tool::Cylinder => own_fit(samples, &features[0], order),
        _ => None,
    };
    let (value_mm, centre_mm) = match own {
        Some(Shape::Sphere { centre_mm, radius_mm }) => (Some(radius_mm), Some(centre_mm.into())),
        Some(Shape::Cylinder { radius_mm, .. }) => (Some(radius_mm), None),
        _ if tool == Tool::Step => (Some(reference + errors.mean_mm), None),
        _ => (None, None),
    };
    OrderRow { order, errors, value_mm, centre_mm }
}

/// The feature fitted to one order's points alone; `None` if they are too few or do not determine it.
fn own_fit(samples: &Samples, feature: &FeatureFit, order: i8) -> Option<Shape> {
    let own: Vec<u32> = feature.inliers.iter().copied().filter(|&idx| samples.at(idx).order == order).collect();
    if own.len() < MIN_FEATURE_POINTS {
        return None;
    }
    fit(&feature.shape, &Near { samples, indices: &own, shape: &feature.shape })
}
