//! The value of a characteristic as a function of features: up to three correlated components.

use nalgebra::{Vector2, Vector3};
use optics::{PartFrame, Rigid};

use crate::evaluation::alignment::{DatumFrame, datum_from_part};
use crate::evaluation::fitted::Fitted;
use crate::evaluation::geometry::{Geometry, line_of, point_of};
use crate::evaluation::rims::contour::Contour;
use crate::interface::request::MeasureError;
use crate::interface::shape::{Shape, across};
use crate::measuring::value::{band_width, turn_rad};
use crate::params::FLATNESS_FRACTION;
use crate::plan::characteristic::{Axis, Measure};
use crate::plan::document::Plan;
use crate::plan::feature::FeatureShape;

/// The fitted geometry of a feature, without its points.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Primitive {
    Shape(Shape),
    Contour(Contour),
    /// Not fitted: constructed from other features, or failed.
    None,
}

/// All features for one perturbation of the calibration and the noise.
pub(crate) struct State {
    pub(crate) geometries: Vec<Option<Geometry>>,
    pub(crate) datum_from_part: Option<Rigid<DatumFrame, PartFrame>>,
    /// Points of features whose form is requested, part frame, mm.
    pub(crate) points: Vec<Vec<Vector3<f64>>>,
}

/// The features of a plan from the fitted primitives.
pub(crate) fn geometries(
    plan: &Plan,
    fitted: &[Result<Fitted, MeasureError>],
    primitives: &[Primitive],
) -> Vec<Option<Geometry>> {
    let mut geometries: Vec<Option<Geometry>> = Vec::with_capacity(primitives.len());
    for (idx, feature) in plan.features.iter().enumerate().take(primitives.len()) {
        let of = |id: &str| geometries.get(plan.feature_idx(id)?)?.as_ref();
        let geometry = match (&feature.shape, primitives[idx], fitted.get(idx)) {
            (FeatureShape::Line { of: rule }, ..) => line_of(rule, of),
            (FeatureShape::Point { of: rule }, ..) => point_of(rule, of),
            (_, Primitive::Shape(shape), _) => Some(Geometry::Surface(shape)),
            (_, Primitive::Contour(contour), Some(Ok(Fitted::Rim(rim)))) => match primitives[rim.plane_idx] {
                Primitive::Shape(plane) => rim.geometry(&contour, &plane),
                _ => None,
            },
            _ => None,
        };
        geometries.push(geometry);
    }
    geometries
}

/// The datum frame of a plan, if it has an alignment.
///
/// # Errors
/// [`MeasureError::Missing`], [`MeasureError::UnderconstrainedDatums`].
pub(crate) fn align(
    plan: &Plan,
    geometries: &[Option<Geometry>],
) -> Option<Result<Rigid<DatumFrame, PartFrame>, MeasureError>> {
    let datums = plan.alignment.as_ref()?.datums();
    let of = |id: &str| geometries.get(plan.feature_idx(id)?)?.as_ref();
    let missing = |id: &str| MeasureError::Missing { id: id.to_owned(), reason: "the datum was not found".into() };
    let found = datums.map(|id| of(id).ok_or_else(|| missing(id)));
    Some(match found {
        [Ok(a), Ok(b), Ok(c)] => datum_from_part([a, b, c]),
        [a, b, c] => Err([a, b, c].into_iter().find_map(Result::err).unwrap_or_else(|| missing(datums[0]))),
    })
}

/// The axes of an angle's components, fixed while the features are perturbed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AngleAxes {
    turn: Vector3<f64>,
    across: Vector3<f64>,
    is_supplement: bool,
}

impl AngleAxes {
    /// The axes of a measured angle; `is_supplement` if the supplement is closer to the nominal.
    pub(crate) fn of(plan: &Plan, measure: &Measure, state: &State, nominal_deg: Option<f64>) -> Option<Self> {
        let Measure::Angle { from, to, about: None } = measure else { return None };
        let direction = |id: &str| state.geometries.get(plan.feature_idx(id)?)?.as_ref()?.direction();
        let (a, b) = (direction(from)?, direction(to)?);
        let turn = turn_rad(&a, &b);
        let angle_deg = turn.norm().to_degrees();
        let nearer = |nominal: f64| (180.0 - angle_deg - nominal).abs() < (angle_deg - nominal).abs();
        let turn = turn.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(|| across(&a)[0]);
        Some(Self { turn, across: a.cross(&turn).normalize(), is_supplement: nominal_deg.is_some_and(nearer) })
    }

    pub(crate) fn is_supplement(&self) -> bool {
        self.is_supplement
    }
}

/// The components of a characteristic: a single value for most, the rotations about two axes (degrees) for an angle, the
/// deviations along the toleranced axes (mm) for a position. `None` if its features are missing or do not determine it.
pub(crate) fn components(
    plan: &Plan,
    measure: &Measure,
    state: &State,
    angle: Option<&AngleAxes>,
) -> Option<Vector3<f64>> {
    let of = |id: &str| state.geometries.get(plan.feature_idx(id)?)?.as_ref();
    let points = |id: &str| state.points.get(plan.feature_idx(id)?).filter(|points| !points.is_empty());
    let pose = state.datum_from_part.as_ref();
    let in_datums = |at: &Vector3<f64>| pose.map(|pose| pose.rotation * at + pose.translation_mm);
    let axis_in_part = |axis: Axis| {
        let mut unit = Vector3::zeros();
        unit[axis.idx()] = 1.0;
        pose.map(|pose| pose.rotation.inverse() * unit)
    };
    let value = match measure {
        Measure::Distance { from, to, along: Some(axis) } => {
            (reference_point(of(to)?) - reference_point(of(from)?)).dot(&axis_in_part(*axis)?)
        }
        Measure::Distance { from, to, along: None } => distance(of(from)?, of(to)?)?,
        Measure::Step { base, top } => {
            let ((p, n), (q, _)) = (of(base)?.plane()?, of(top)?.plane()?);
            n.dot(&(q - p))
        }
        Measure::Angle { from, to, about } => {
            let turn = turn_rad(&of(from)?.direction()?, &of(to)?.direction()?);
            match about {
                Some(axis) => turn.dot(&axis_in_part(*axis)?).to_degrees(),
                None => {
                    let axes = angle?;
                    return Some(
                        Vector3::new(turn.dot(&axes.turn), turn.dot(&axes.across), 0.0).map(f64::to_degrees),
                    );
                }
            }
        }
        Measure::Diameter { of: id } => 2.0 * of(id)?.radius_mm()?,
        Measure::Radius { of: id } => of(id)?.radius_mm()?,
        Measure::Coordinate { of: id, axis } => in_datums(&of(id)?.point()?)?[axis.idx()],
        Measure::Position { of: id, at_mm } => {
            let at = in_datums(&of(id)?.point()?)?;
            return Some(Vector3::from_fn(|axis, _| at_mm[axis].map_or(0.0, |nominal| at[axis] - nominal)));
        }
        Measure::Flatness { .. }
        | Measure::Parallelism { .. }
        | Measure::Perpendicularity { .. }
        | Measure::Profile { .. } => {
            let id = measure.features()[0];
            band(measure, &mut form_residuals(plan, measure, state, points(id)?)?)
        }
        Measure::Gap { from, to, surface } => gap(of(from)?, of(to)?, of(surface)?)?,
        Measure::Flush { reference, surface, at } => {
            let ((p, n), (centre, m)) = (of(reference)?.plane()?, of(surface)?.plane()?);
            let rim = match at {
                Some(id) => match of(id)? {
                    // The transition from the rolled edge to the surface.
                    Geometry::Surface(Shape::Cylinder { point_mm, radius_mm, .. }) => point_mm + m * *radius_mm,
                    other => other.line()?.0,
                },
                None => centre,
            };
            // The point of the surface directly above the rim.
            let on_surface = rim + n * (m.dot(&(centre - rim)) / m.dot(&n));
            n.dot(&(on_surface - p))
        }
        Measure::GrooveDepth { floor, shoulders: [left, right] } => {
            let ((c, _), (p, n), (q, m)) = (of(floor)?.plane()?, of(left)?.plane()?, of(right)?.plane()?);
            let normal = (n + m).try_normalize(f64::MIN_POSITIVE)?;
            let across = (q - p) - normal * normal.dot(&(q - p));
            let share = across.dot(&(c - p)) / across.norm_squared();
            normal.dot(&(p + (q - p) * share - c))
        }
        Measure::Width { of: id } => match of(id)? {
            Geometry::Slot { width_mm, .. } => *width_mm,
            _ => return None,
        },
        Measure::Length { of: id } => match of(id)? {
            Geometry::Slot { length_mm, .. } => *length_mm,
            _ => return None,
        },
        // Not a function of features.
        Measure::SurfaceProfile { .. } => return None,
    };
    value.is_finite().then(|| Vector3::new(value, 0.0, 0.0))
}

/// The reference point of a feature.
fn reference_point(geometry: &Geometry) -> Vector3<f64> {
    let middle = || geometry.plane().or(geometry.line()).map(|(at, _)| at);
    geometry.point().or_else(middle).unwrap_or_default()
}

fn distance(from: &Geometry, to: &Geometry) -> Option<f64> {
    Some(match (from.plane(), to.plane(), from.line(), to.line()) {
        (Some((p, n)), Some((q, m)), ..) => (n.dot(&(q - p)).abs() + m.dot(&(p - q)).abs()) / 2.0,
        (Some((p, n)), ..) => n.dot(&(reference_point(to) - p)),
        (_, Some((q, m)), ..) => m.dot(&(reference_point(from) - q)),
        (_, _, Some(a), Some(b)) => {
            let across = |(p, l): (Vector3<f64>, Vector3<f64>), at: Vector3<f64>| l.cross(&(at - p)).norm();
            (across(a, b.0) + across(b, a.0)) / 2.0
        }
        (_, _, Some((p, l)), None) => l.cross(&(to.point()? - p)).norm(),
        (_, _, None, Some((q, m))) => m.cross(&(from.point()? - q)).norm(),
        _ => (to.point()? - from.point()?).norm(),
    })
}

/// (G_B − G_A)·e with G = c ± r·e and e along the reference surface, across the seam.
fn gap(from: &Geometry, to: &Geometry, surface: &Geometry) -> Option<f64> {
    let ((a, seam), (b, _), (_, normal)) = (from.line()?, to.line()?, surface.plane()?);
    let across = normal.cross(&seam).try_normalize(f64::MIN_POSITIVE)?;
    let across = if across.dot(&(b - a)) < 0.0 { -across } else { across };
    Some(across.dot(&(b - a)) - from.radius_mm().unwrap_or(0.0) - to.radius_mm().unwrap_or(0.0))
}

/// Deviations of points from the ideal form, mm; `None` if the features do not determine it.
pub(crate) fn form_residuals(
    plan: &Plan,
    measure: &Measure,
    state: &State,
    points: &[Vector3<f64>],
) -> Option<Vec<f64>> {
    let of = |id: &str| state.geometries.get(plan.feature_idx(id)?)?.as_ref();
    let along = |normal: Vector3<f64>| points.iter().map(|p| normal.dot(&(p - points[0]))).collect();
    Some(match measure {
        Measure::Flatness { of: id } => {
            let (p, n) = of(id)?.plane()?;
            points.iter().map(|at| n.dot(&(at - p))).collect()
        }
        Measure::Parallelism { to, .. } => along(of(to)?.plane()?.1),
        Measure::Perpendicularity { to, .. } => along(least_spread(points, &of(to)?.plane()?.1)?),
        Measure::Profile { of: id } => {
            let FeatureShape::Section { origin_mm, x, y, contour_mm, .. } =
                &plan.features[plan.feature_idx(id)?].shape
            else {
                return None;
            };
            let (pose, origin) = (state.datum_from_part?, Vector3::from(*origin_mm));
            let [x, y] = [x, y].map(|axis| Vector3::from(*axis).normalize());
            let flat = |at: &Vector3<f64>| {
                let from = pose.rotation * at + pose.translation_mm - origin;
                Vector2::new(x.dot(&from), y.dot(&from))
            };
            // Points beyond the ends of the contour are ignored.
            points.iter().map(|at| signed_distance_to_contour(contour_mm, &flat(at)).unwrap_or(0.0)).collect()
        }
        _ => return None,
    })
}

/// The width of a form's tolerance zone, mm.
pub(crate) fn band(measure: &Measure, residuals: &mut [f64]) -> f64 {
    if !matches!(measure, Measure::Profile { .. }) {
        return band_width(residuals);
    }
    residuals.iter_mut().for_each(|residual| *residual = residual.abs());
    residuals.sort_unstable_by(f64::total_cmp);
    let rank = FLATNESS_FRACTION * residuals.len().saturating_sub(1) as f64;
    residuals.get(rank.round() as usize).map_or(0.0, |widest| 2.0 * widest)
}

/// The direction perpendicular to `datum` along which the points spread least.
fn least_spread(points: &[Vector3<f64>], datum: &Vector3<f64>) -> Option<Vector3<f64>> {
    let [a, b] = across(datum);
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let flat = |p: &Vector3<f64>| Vector2::new(a.dot(&(p - middle)), b.dot(&(p - middle)));
    let spread = points.iter().map(|p| flat(p) * flat(p).transpose()).sum::<nalgebra::Matrix2<f64>>();
    let eigen = spread.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    (a * least.x + b * least.y).try_normalize(f64::MIN_POSITIVE)
}

/// Signed distance from an open contour, positive on its left; `None` beyond its ends.
pub(crate) fn signed_distance_to_contour(contour_mm: &[[f64; 2]], at: &Vector2<f64>) -> Option<f64> {
    let last = contour_mm.len().checked_sub(2)?;
    let mut nearest: Option<(f64, f64, bool)> = None;
    for (idx, pair) in contour_mm.windows(2).enumerate() {
        let [from, to] = [Vector2::from(pair[0]), Vector2::from(pair[1])];
        let along = to - from;
        let share = along.dot(&(at - from)) / along.norm_squared();
        let is_end = (idx == 0 && share < 0.0) || (idx == last && share > 1.0);
        let way = at - (from + along * share.clamp(0.0, 1.0));
        let side = along.perp(&way);
        let reach = way.norm();
        // At a corner the two sides may disagree: the one the point is more perpendicular to decides.
        let squareness = side.abs() / along.norm();
        if nearest.is_none_or(|(least, square, _)| {
            reach < least - 1e-12 || (reach < least + 1e-12 && squareness > square.abs())
        }) {
            nearest = Some((reach, side.signum() * squareness, is_end));
        }
    }
    nearest.filter(|(_, _, is_end)| !is_end).map(|(reach, side, _)| reach * side.signum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contour_has_a_left_a_right_and_two_ends() {
        let contour = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0]];
        let cases = [
            ([4.0, 2.0], Some(2.0)),
            ([4.0, -2.0], Some(-2.0)),
            ([13.0, -4.0], Some(-5.0)),
            ([9.0, 3.0], Some(1.0)),
            ([-1.0, 2.0], None),
            ([12.0, 7.0], None),
        ];
        for (at, expected) in cases {
            let found = signed_distance_to_contour(&contour, &Vector2::from(at));
            assert_eq!(found.map(|d| (d * 1e9).round() / 1e9), expected, "{at:?}");
        }
    }
}
