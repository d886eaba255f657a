//! Figures of an artefact in the cloud of one position.
//!
//! The artefact is found by the robust fits of the tools. Its figures are those of the standards: a free least-squares
//! feature with equal weights through all points of the evaluated region but 3 ‰. The region does not depend on how far a
//! point is from the surface, so that an error of the station cannot exclude itself: on a ball, the rays that meet it at a
//! frontal place; on a plate, the inside of its outline.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use optics::Calibration;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use scanning::{Cloud, CloudPoint};

use super::dispersion::{Dispersion, dispersion, n_rejectable};
use super::figures::{Ball, Figures, OrderMean, Plate};
use super::plan::{AcceptancePlan, Procedure};
use crate::fitting::features::{FeatureFit, Search, light_in_camera};
use crate::fitting::fit::fit;
use crate::fitting::outline::Outline;
use crate::fitting::robust::within;
use crate::fitting::sample::Samples;
use crate::interface::region::Region;
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::measuring::form::EqualWeights;
use crate::params::{
    FLATNESS_TRIM_SIGMAS, MAX_CURVED_LIGHT_TANGENT, MIN_CURVED_COSINE, MIN_CURVED_COSINE_UNLIT,
    MIN_FEATURE_POINTS, SAME_PLACE_PX, TRIM_SIGMAS,
};

/// Where to look for an artefact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeRequest {
    /// Which procedure.
    pub procedure: Procedure,
    /// Region that contains the artefact, part frame; the whole cloud if `None`.
    pub region: Option<Region>,
    /// Seed of the random choices of the search; the same seed gives the same result.
    pub seed: u64,
}

/// The figures of the artefact of a procedure in a cloud; the diameters of the plan help to find its balls.
///
/// `calibration`: the one the scan was made with; it states where the light comes from, and with it which flanks of a
/// ball are lit too steeply.
///
/// # Errors
/// [`MeasureError`]: the procedure is not planned, or the artefact is not found.
pub fn probe(
    cloud: &Cloud,
    calibration: &Calibration,
    plan: &AcceptancePlan,
    request: &ProbeRequest,
) -> Result<Figures, MeasureError> {
    let samples = Samples::from_cloud(cloud, request.region.as_ref(), light_in_camera(calibration));
    if samples.len() < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: samples.len() });
    }
    let mut search = Search { samples: &samples, rng: Pcg64Mcg::seed_from_u64(request.seed) };
    let missing = |feature| MeasureError::FeatureNotFound { feature, n_points: samples.len() };
    match request.procedure {
        Procedure::Sphere => {
            let radius_mm = plan.sphere.as_ref().map(|test| test.diameter_mm / 2.0);
            let candidates = search.off_table();
            let found = search.sphere("sphere", &candidates, radius_mm).ok_or(missing("sphere"))?;
            Ok(Figures::Ball(ball(&samples, &found).ok_or(missing("sphere"))?))
        }
        Procedure::SpherePair => {
            let radius_mm = plan.sphere_pair.as_ref().map(|test| test.diameter_mm / 2.0);
            let candidates = search.off_table();
            let first = search.sphere("first sphere", &candidates, radius_mm).ok_or(missing("sphere"))?;
            let rest = search.without(&candidates, &first);
            let second = search.sphere("second sphere", &rest, radius_mm).ok_or(missing("second sphere"))?;
            let balls = [
                ball(&samples, &first).ok_or(missing("sphere"))?,
                ball(&samples, &second).ok_or(missing("second sphere"))?,
            ];
            let [a, b] = [&balls[0], &balls[1]].map(|ball| Vector3::from(ball.centre_mm));
            Ok(Figures::Pair { distance_mm: (b - a).norm(), balls })
        }
        Procedure::Plate | Procedure::Linearity | Procedure::Repeatability => {
            let found = search.plane("plane", &samples.indices()).ok_or(missing("plane"))?;
            Ok(Figures::Plate(plate(&samples, &found).ok_or(missing("plane"))?))
        }
    }
}

/// The points on a ball: those whose ray meets it where it is neither viewed nor lit too steeply, and the number of others
/// on its surface.
fn on_ball(samples: &Samples, feature: &FeatureFit) -> (Vec<u32>, usize) {
    let Shape::Sphere { centre_mm, radius_mm } = feature.shape else { return (Vec::new(), 0) };
    let least_lit = 1.0 / 1f64.hypot(MAX_CURVED_LIGHT_TANGENT);
    let is_frontal = |idx: u32| {
        let sample = samples.at(idx);
        let to_centre = centre_mm - sample.in_part.xyz;
        let along = to_centre.dot(&sample.ray);
        let beside_square = to_centre.norm_squared() - along * along;
        let cosine = (1.0 - beside_square / (radius_mm * radius_mm)).max(0.0).sqrt();
        match samples.to_light(idx) {
            Some(to_light) => {
                let hit = sample.in_part.xyz + sample.ray * (along - radius_mm * cosine);
                cosine >= MIN_CURVED_COSINE && feature.shape.normal_at(&hit).dot(&to_light) >= least_lit
            }
            None => cosine >= MIN_CURVED_COSINE_UNLIT,
        }
    };
    let inside: Vec<u32> = samples.indices().into_iter().filter(|&idx| is_frontal(idx)).collect();
    let on_surface = within(samples, &samples.indices(), &feature.shape, feature.trim);
    let n_frontal = on_surface.iter().filter(|idx| inside.binary_search(idx).is_ok()).count();
    (inside, on_surface.len() - n_frontal)
}

/// The points inside the outline of a plate, whatever their distance from it, and the number of others on its surface.
/// The outline is that of all points within the form that a plate may have, so that a bent corner belongs to it.
fn on_plate(samples: &Samples, feature: &FeatureFit) -> (Vec<u32>, usize) {
    let Shape::Plane { normal, .. } = feature.shape else { return (Vec::new(), 0) };
    let trim = feature.trim * FLATNESS_TRIM_SIGMAS / TRIM_SIGMAS;
    let on_surface = within(samples, &samples.indices(), &feature.shape, trim);
    let Some(outline) = Outline::of(samples, &on_surface, &normal) else { return (on_surface, 0) };
    let is_inside = |&idx: &u32| outline.contains(&samples.position(idx));
    let inside: Vec<u32> = samples.indices().into_iter().filter(is_inside).collect();
    let n_interior = on_surface.iter().filter(|idx| inside.binary_search(idx).is_ok()).count();
    (inside, on_surface.len() - n_interior)
}

/// The free least-squares feature of all points but 3 ‰, and how they scatter about it.
struct Fitted {
    shape: Shape,
    dispersion: Dispersion,
    per_order: Vec<OrderMean>,
}

/// `start`: the robust fit, from which the farthest points are determined.
fn fitted(samples: &Samples, inside: &[u32], start: &Shape) -> Option<Fitted> {
    if inside.len() < MIN_FEATURE_POINTS {
        return None;
    }
    let distance_mm = |idx: u32| start.distance_mm(&samples.position(idx)).abs();
    let mut ranked: Vec<(f64, u32)> = inside.iter().map(|&idx| (distance_mm(idx), idx)).collect();
    ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let rejected = ranked.split_off(ranked.len() - n_rejectable(ranked.len()));
    let mut kept: Vec<u32> = ranked.into_iter().map(|(_, idx)| idx).collect();
    kept.sort_unstable();
    let shape = fit(start, &EqualWeights { samples, indices: &kept })?;
    let residual = |idx: u32| shape.distance_mm(&samples.position(idx));
    let kept_mm: Vec<f64> = kept.iter().map(|&idx| residual(idx)).collect();
    let rejected_mm: Vec<f64> = rejected.iter().map(|&(_, idx)| residual(idx)).collect();
    let mut sums: BTreeMap<i8, (usize, f64)> = BTreeMap::new();
    for (&idx, residual_mm) in kept.iter().zip(&kept_mm) {
        let (n_points, sum_mm) = sums.entry(samples.point(idx).order).or_default();
        *n_points += 1;
        *sum_mm += residual_mm;
    }
    let mean =
        |(order, (n_points, sum_mm))| OrderMean { order, n_points, mean_mm: sum_mm / n_points.max(1) as f64 };
    Some(Fitted {
        shape,
        dispersion: dispersion(&kept_mm, &rejected_mm)?,
        per_order: sums.into_iter().map(mean).collect(),
    })
}

fn ball(samples: &Samples, feature: &FeatureFit) -> Option<Ball> {
    let (inside, n_excluded) = on_ball(samples, feature);
    let Fitted { shape, dispersion, per_order } = fitted(samples, &inside, &feature.shape)?;
    let Shape::Sphere { centre_mm, radius_mm } = shape else { return None };
    Some(Ball { centre_mm: centre_mm.into(), diameter_mm: 2.0 * radius_mm, dispersion, n_excluded, per_order })
}

fn plate(samples: &Samples, feature: &FeatureFit) -> Option<Plate> {
    let (inside, n_excluded) = on_plate(samples, feature);
    let Fitted { shape, dispersion, per_order } = fitted(samples, &inside, &feature.shape)?;
    let Shape::Plane { point_mm, normal } = shape else { return None };
    Some(Plate { point_mm: point_mm.into(), normal: normal.into(), dispersion, n_excluded, per_order })
}

/// RMS of the differences of single points between the first scan of a plate and a later one, mm, along the normal of the
/// plate in the first. Points correspond if they are on the same line at the same place of the image.
///
/// # Errors
/// [`MeasureError::TooFewPoints`] if the scans have too few points in common: they were made with different settings, or
/// the plate was moved.
pub fn repeat_difference_mm(first: &Cloud, other: &Cloud, plate: &Plate) -> Result<f64, MeasureError> {
    let plane = Shape::Plane { point_mm: plate.point_mm.into(), normal: plate.normal.into() };
    let distance_mm = |point: &CloudPoint| plane.distance_mm(&Vector3::new(point.x_mm, point.y_mm, point.z_mm));
    let is_on_plate = |distance_mm: f64| distance_mm.abs() <= plate.dispersion.range_mm;
    let along = coordinate_along_lines(first);
    let mut lines: BTreeMap<(u32, i8), Vec<(f32, f64)>> = BTreeMap::new();
    for point in &first.points {
        let distance_mm = distance_mm(point);
        if is_on_plate(distance_mm) {
            lines.entry((point.frame, point.order)).or_default().push((along(point), distance_mm));
        }
    }
    for line in lines.values_mut() {
        line.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    }
    let (mut n_points, mut sum) = (0, 0.0);
    for point in &other.points {
        let (at, distance_mm) = (along(point), distance_mm(point));
        let line = lines.get(&(point.frame, point.order)).filter(|_| is_on_plate(distance_mm));
        if let Some(before_mm) = line.and_then(|line| nearest_mm(line, at)) {
            n_points += 1;
            sum += (distance_mm - before_mm).powi(2);
        }
    }
    if n_points < MIN_FEATURE_POINTS {
        return Err(MeasureError::TooFewPoints { needed: MIN_FEATURE_POINTS, got: n_points });
    }
    Ok((sum / n_points as f64).sqrt())
}

/// The coordinate in which lines extend: the one in which successive points of a line are further apart.
fn coordinate_along_lines(cloud: &Cloud) -> fn(&CloudPoint) -> f32 {
    let of_one_line = |pair: &&[CloudPoint]| pair[0].frame == pair[1].frame && pair[0].order == pair[1].order;
    let (u_px, v_px) = cloud.points.windows(2).filter(of_one_line).fold((0.0, 0.0), |(u_px, v_px), pair| {
        (
            u_px + f64::from((pair[1].u_px - pair[0].u_px).abs()),
            v_px + f64::from((pair[1].v_px - pair[0].v_px).abs()),
        )
    });
    if u_px >= v_px { |point| point.u_px } else { |point| point.v_px }
}

/// The distance of the point of a sorted line that is nearest to a place, if it is close enough.
fn nearest_mm(line: &[(f32, f64)], at_px: f32) -> Option<f64> {
    let after = line.partition_point(|(px, _)| *px < at_px);
    let near = line[after.saturating_sub(1)..(after + 1).min(line.len())].iter();
    let (px, distance_mm) = near.min_by(|a, b| (a.0 - at_px).abs().total_cmp(&(b.0 - at_px).abs()))?;
    ((px - at_px).abs() <= SAME_PLACE_PX).then_some(*distance_mm)
}
