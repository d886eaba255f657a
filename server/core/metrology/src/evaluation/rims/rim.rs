//! Rims of planes: circles, slots and edges through the points where laser lines cross them.

use nalgebra::{Vector2, Vector3};
use rand_pcg::Pcg64Mcg;
use statistics::{SIGMA_PER_MAD, median};

use crate::evaluation::fitted::Fitted;
use crate::evaluation::geometry::Geometry;
use crate::evaluation::rims::contour::{self, Contour};
use crate::evaluation::rims::crossings::{Crossing, crossings};
use crate::fitting::features::FeatureFit;
use crate::fitting::sample::Samples;
use crate::interface::findings::Finding;
use crate::interface::request::MeasureError;
use crate::interface::shape::{Shape, across};
use crate::params::{
    FORM_RMS_RELATIVE, RIM_MAX_GAP_DEG, RIM_MIN_CROSSINGS_PER_PARAMETER, RIM_MIN_FADED_FRACTION, RIM_MIN_SINE,
    RIM_SIGMA_BLURS, TRIM_SIGMAS,
};
use crate::plan::feature::FeatureShape;

/// Iterations in which outliers and oblique crossings are excluded from a rim.
const TRIM_ROUNDS: usize = 8;

/// Largest variance of a contour's parameter (mm², rad²); above it the crossings do not determine the parameter.
const MAX_RIM_VARIANCE: f64 = 1.0;

/// Smallest trim, mm: smaller distances are rounding.
const MIN_TRIM_MM: f64 = 1e-6;

/// A contour in a plane.
pub(crate) struct Rim {
    /// Index of the plane among the features.
    pub(crate) plane_idx: usize,
    pub(crate) contour: Contour,
    pub(crate) axes: PlaneAxes,
    /// The crossings used by the fit.
    pub(crate) crossings: Vec<Crossing>,
    pub(crate) n_left_out: usize,
    /// RMS of the crossings across the rim, mm.
    pub(crate) rms_mm: f64,
    /// Standard uncertainty of the rim's position, common to all crossings, mm; `None` if it is unknown.
    pub(crate) threshold_mm: Option<f64>,
}

/// How the crossings of a rim are moved across it by their common uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RimShift {
    None,
    /// All alike.
    Threshold,
    /// Oblique crossings, up to the most oblique ones used: across the line, light fades over the thickness of the sheet
    /// rather than over the blur.
    Oblique,
}

impl RimShift {
    /// Shift of a crossing relative to the threshold; `sine`: of the angle between line and rim.
    fn fraction(self, sine: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Threshold => 1.0,
            Self::Oblique => ((1.0 - sine) / (1.0 - RIM_MIN_SINE)).min(1.0),
        }
    }
}

/// Coordinates in a plane; the axes stay fixed when the plane is perturbed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlaneAxes {
    origin: Vector3<f64>,
    axes: [Vector3<f64>; 2],
}

impl PlaneAxes {
    fn of(plane: &Shape) -> Option<Self> {
        match plane {
            Shape::Plane { point_mm, normal } => Some(Self { origin: *point_mm, axes: across(normal) }),
            _ => None,
        }
    }

    fn flat(&self, position: &Vector3<f64>) -> Vector2<f64> {
        let from = position - self.origin;
        Vector2::new(self.axes[0].dot(&from), self.axes[1].dot(&from))
    }

    fn direction(&self, flat: &Vector2<f64>) -> Vector3<f64> {
        self.axes[0] * flat.x + self.axes[1] * flat.y
    }

    /// Current estimate of a crossing, plane coordinates, mm.
    fn place(&self, samples: &Samples, crossing: &Crossing) -> Vector2<f64> {
        self.flat(&(samples.position(crossing.sample_idx) + crossing.offset))
    }

    /// Sine of the angle between a line and the rim it crosses, positive where the plane is on the contour's inside.
    fn sine(&self, normal: &Vector2<f64>, crossing: &Crossing) -> f64 {
        normal.dot(&self.flat_direction(&crossing.outwards))
    }

    /// Blur across the rim, one σ, mm: the same for all rims of a plane; `None` if the crossings do not determine it.
    fn blur_across_mm(&self, contour: &Contour, samples: &Samples, crossings: &[Crossing]) -> Option<f64> {
        let blurs = crossings.iter().filter_map(|crossing| {
            let (_, normal) = contour.distance_and_normal(&self.place(samples, crossing));
            let sine = self.sine(&normal, crossing).abs();
            Some(crossing.blur_along_mm? * sine).filter(|_| sine >= RIM_MIN_SINE)
        });
        median(&mut blurs.collect::<Vec<f64>>()).filter(|blur_mm| blur_mm.is_finite())
    }

    /// The crossings, located by their intensity for a rim near `contour`.
    fn of_rim(
        &self,
        contour: &Contour,
        samples: &Samples,
        crossings: &[Crossing],
        blur_mm: Option<f64>,
    ) -> Vec<Crossing> {
        let Some(blur_mm) = blur_mm else { return crossings.to_vec() };
        let of_one = |crossing: &Crossing| {
            let (_, normal) = contour.distance_and_normal(&self.place(samples, crossing));
            let off_plane = normal * self.sine(&normal, crossing).signum();
            crossing.of_rim(&self.direction(&off_plane), blur_mm)
        };
        crossings.iter().map(of_one).collect()
    }

    /// A direction in the plane's coordinates.
    fn flat_direction(&self, direction: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(self.axes[0].dot(direction), self.axes[1].dot(direction))
    }

    /// A point in plane coordinates, projected onto the perturbed plane.
    fn on(&self, flat: &Vector2<f64>, plane: &Shape) -> Vector3<f64> {
        let at = self.origin + self.direction(flat);
        at - plane.normal_at(&at) * plane.distance_mm(&at)
    }
}

impl Rim {
    /// The contour on its plane, part frame.
    pub(crate) fn geometry(&self, contour: &Contour, plane: &Shape) -> Option<Geometry> {
        let Shape::Plane { normal, .. } = *plane else { return None };
        let direction = |angle_rad: f64| {
            let along = self.axes.direction(&Vector2::new(angle_rad.cos(), angle_rad.sin()));
            (along - normal * normal.dot(&along)).normalize()
        };
        Some(match contour {
            Contour::Line { at, angle_rad } => {
                Geometry::Line { point_mm: self.axes.on(at, plane), direction: direction(*angle_rad) }
            }
            Contour::Circle { centre, radius_mm } => {
                Geometry::Circle { centre_mm: self.axes.on(centre, plane), normal, radius_mm: *radius_mm }
            }
            Contour::Slot { centre, angle_rad, half_mm, radius_mm } => Geometry::Slot {
                centre_mm: self.axes.on(centre, plane),
                normal,
                direction: direction(*angle_rad),
                length_mm: 2.0 * (half_mm + radius_mm),
                width_mm: 2.0 * radius_mm,
            },
        })
    }

    /// The contour refitted to its perturbed crossings, moved outwards from the plane by `shift`.
    pub(crate) fn refit(&self, seen: &[(Vector3<f64>, &Crossing)], shift: RimShift) -> Option<Contour> {
        let flat: Vec<Vector2<f64>> = seen.iter().map(|(place, _)| self.axes.flat(place)).collect();
        let fitted = contour::fit(&self.contour, &flat)?;
        if shift == RimShift::None {
            return Some(fitted);
        }
        let threshold_mm = self.threshold_mm.unwrap_or(0.0);
        // Outwards from the plane: towards the centre of a hole, away from a plate.
        let shifted: Vec<Vector2<f64>> = flat
            .iter()
            .zip(seen)
            .map(|(place, (_, crossing))| {
                let (_, normal) = fitted.distance_and_normal(place);
                let sine = normal.dot(&self.axes.flat_direction(&crossing.outwards));
                place + normal * (sine.signum() * shift.fraction(sine.abs()) * threshold_mm)
            })
            .collect();
        contour::fit(&fitted, &shifted)
    }

    /// A finding if the crossings deviate more than the blur and a usual form error explain.
    pub(crate) fn misfit(&self, samples: &Samples, role: &'static str) -> Option<Finding> {
        let inliers: Vec<u32> = self.crossings.iter().map(|crossing| crossing.sample_idx).collect();
        let form_mm = FORM_RMS_RELATIVE * samples.mean_distance_mm(&inliers);
        let allowed_mm = form_mm.hypot(self.threshold_mm.unwrap_or(0.0));
        (self.rms_mm > allowed_mm).then_some(Finding::ModelMisfit { role, rms_mm: self.rms_mm, allowed_mm })
    }

    /// Covariance of the contour's parameters from the scatter of its crossings; `redundancy`: crossings per independent
    /// one.
    pub(crate) fn covariance(&self, places: &[Vector3<f64>], redundancy: f64) -> Option<contour::Covariance> {
        let flat: Vec<Vector2<f64>> = places.iter().map(|place| self.axes.flat(place)).collect();
        let freedom = flat.len().saturating_sub(self.contour.parameters()).max(1) as f64;
        let square: f64 = flat.iter().map(|place| self.contour.distance_and_normal(place).0.powi(2)).sum();
        contour::covariance(&self.contour, &flat, square / freedom * redundancy)
    }
}

/// Fits a circle, slot or edge to the ends of laser lines on a plane among the candidates.
pub(crate) fn fit(
    samples: &Samples,
    rng: &mut Pcg64Mcg,
    shape: &FeatureShape,
    (plane_idx, plane): (usize, &FeatureFit),
    candidates: &[u32],
) -> Result<Fitted, MeasureError> {
    let name = shape.name();
    let missing = || MeasureError::FeatureNotFound { feature: name, n_points: candidates.len() };
    let axes = PlaneAxes::of(&plane.shape).ok_or_else(missing)?;
    let mut crossings = crossings(samples, plane, candidates);
    let n_all = crossings.len();
    let flat = |crossing: &Crossing| axes.place(samples, crossing);
    let parameters = match shape {
        FeatureShape::Edge { .. } => 2,
        FeatureShape::Circle { .. } => 3,
        _ => 5,
    };
    let needed = RIM_MIN_CROSSINGS_PER_PARAMETER * parameters;
    let too_few = |got: usize| MeasureError::TooFewCrossings { feature: name, needed, got };
    if crossings.len() < needed {
        return Err(too_few(crossings.len()));
    }
    // A line that ends at full intensity has left the plane before it has reached the rim: at an oblique crossing, the
    // light left on one side of the line lies off the plane.
    let n_faded = crossings.iter().filter(|crossing| crossing.has_faded()).count();
    let has_faded = n_faded >= needed && n_faded as f64 >= RIM_MIN_FADED_FRACTION * n_all as f64;
    if has_faded {
        crossings.retain(Crossing::has_faded);
    }
    let places: Vec<Vector2<f64>> = crossings.iter().map(flat).collect();
    let first = match shape {
        FeatureShape::Circle { .. } => contour::first_circle(&places, rng),
        FeatureShape::Slot { .. } => contour::first_slot(&places),
        _ => {
            let outwards: Vector2<f64> = crossings.iter().map(|c| axes.flat_direction(&c.outwards)).sum();
            contour::first_line(&places, &outwards, rng)
        }
    };
    let mut contour = first.ok_or_else(missing)?;
    let mut trim_mm = f64::INFINITY;
    let mut blur_mm = None;
    for round in 0..TRIM_ROUNDS {
        blur_mm = axes.blur_across_mm(&contour, samples, &crossings);
        crossings = axes.of_rim(&contour, samples, &crossings, blur_mm);
        let is_good = |crossing: &Crossing| {
            let (distance, normal) = contour.distance_and_normal(&flat(crossing));
            let sine = axes.sine(&normal, crossing).abs();
            distance.abs() <= trim_mm && (sine >= RIM_MIN_SINE || round == 0)
        };
        let kept: Vec<Vector2<f64>> = crossings.iter().filter(|c| is_good(c)).map(flat).collect();
        if kept.len() < needed {
            return Err(too_few(kept.len()));
        }
        contour = contour::fit(&contour, &kept).ok_or_else(missing)?;
        let mut distances: Vec<f64> = kept.iter().map(|p| contour.distance_and_normal(p).0.abs()).collect();
        // The rim is known to a fraction of the blur at best: a better-fitting straight side must not exclude a round end.
        let least_mm = RIM_SIGMA_BLURS * blur_mm.unwrap_or(0.0);
        trim_mm =
            (TRIM_SIGMAS * SIGMA_PER_MAD * median(&mut distances).unwrap_or(0.0)).max(least_mm).max(MIN_TRIM_MM);
    }
    crossings.retain(|crossing| {
        let (distance, normal) = contour.distance_and_normal(&flat(crossing));
        distance.abs() <= trim_mm && axes.sine(&normal, crossing).abs() >= RIM_MIN_SINE
    });
    let places: Vec<Vector2<f64>> = crossings.iter().map(flat).collect();
    if places.len() < needed {
        return Err(too_few(places.len()));
    }
    if let Some(gap_deg) = gap_deg(&contour, &places).filter(|gap_deg| *gap_deg > RIM_MAX_GAP_DEG) {
        return Err(MeasureError::OpenRim { feature: name, gap_deg });
    }
    let outwards: Vector2<f64> = crossings.iter().map(|c| axes.flat_direction(&c.outwards)).sum();
    if let Contour::Line { at, angle_rad } = contour
        && contour.distance_and_normal(&at).1.dot(&outwards) < 0.0
    {
        contour = Contour::Line { at, angle_rad: angle_rad + std::f64::consts::PI };
    }
    let square: f64 = places.iter().map(|p| contour.distance_and_normal(p).0.powi(2)).sum();
    let rim = Rim {
        plane_idx,
        contour,
        axes,
        n_left_out: n_all - crossings.len(),
        rms_mm: (square / places.len() as f64).sqrt(),
        threshold_mm: blur_mm.filter(|_| has_faded).map(|blur_mm| RIM_SIGMA_BLURS * blur_mm),
        crossings,
    };
    let places: Vec<Vector3<f64>> =
        rim.crossings.iter().map(|crossing| samples.position(crossing.sample_idx) + crossing.offset).collect();
    let is_held =
        rim.covariance(&places, 1.0).is_some_and(|covariance| covariance.diagonal().max() < MAX_RIM_VARIANCE);
    if is_held { Ok(Fitted::Rim(rim)) } else { Err(MeasureError::NotDetermined { what: name }) }
}

/// The largest arc of a circle without crossings, degrees; `None` for other contours.
fn gap_deg(contour: &Contour, places: &[Vector2<f64>]) -> Option<f64> {
    let Contour::Circle { centre, .. } = contour else { return None };
    let mut angles: Vec<f64> = places.iter().map(|p| (p.y - centre.y).atan2(p.x - centre.x)).collect();
    angles.sort_unstable_by(f64::total_cmp);
    let around = angles.first()? + std::f64::consts::TAU;
    angles.push(around);
    angles.windows(2).map(|pair| (pair[1] - pair[0]).to_degrees()).reduce(f64::max)
}
