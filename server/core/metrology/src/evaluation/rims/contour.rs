//! Lines, circles and slots in a plane, fitted to points on their rim by geometric least squares.

use least_squares::{Damping, Termination};
use nalgebra::{DMatrix, DVector, SMatrix, SVector, Vector2};
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use statistics::median;

/// Parameters of the largest contour.
pub(crate) const MAX_PARAMETERS: usize = 5;
pub(crate) type Step = [f64; MAX_PARAMETERS];
pub(crate) type Covariance = SMatrix<f64, MAX_PARAMETERS, MAX_PARAMETERS>;

/// Hypotheses tried: with 40 % inliers, one with three inliers is drawn with 99.9 % probability.
const HYPOTHESES: usize = 120;

/// Most steps of a fit; a good start needs 4–8.
const MAX_STEPS: usize = 60;

/// Converged when the undamped step would change the distances by less than this, RMS, mm.
const GRADIENT_TOLERANCE_MM: f64 = 1e-9;

/// Converged when no parameter moves by more than this (mm, rad), which is below anything measurable.
const STEP_TOLERANCE: f64 = 1e-10;

/// A cost that rounding keeps from falling is accepted if the undamped step would change the distances by less than this,
/// RMS, mm.
const COST_TOLERANCE_MM: f64 = 1e-6;

/// Initial damping, in squares of each parameter's own unit, and its range.
const FIRST_DAMPING: f64 = 1e-6;
const MIN_DAMPING: f64 = 1e-12;
const MAX_DAMPING: f64 = 1e8;

/// Step of the numerical derivatives, mm and rad.
const DERIVATIVE_STEP: f64 = 1e-6;

/// A rim in coordinates of the plane, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Contour {
    /// Through `at`, along `angle_rad`; the right-hand side is outside.
    Line { at: Vector2<f64>, angle_rad: f64 },
    /// A circle; outside is away from the centre.
    Circle { centre: Vector2<f64>, radius_mm: f64 },
    /// Half circles of `radius_mm` about two centres, at ±`half_mm` from `centre` along `angle_rad`.
    Slot { centre: Vector2<f64>, angle_rad: f64, half_mm: f64, radius_mm: f64 },
}

fn unit(angle_rad: f64) -> Vector2<f64> {
    Vector2::new(angle_rad.cos(), angle_rad.sin())
}

impl Contour {
    pub(crate) fn parameters(&self) -> usize {
        match self {
            Self::Line { .. } => 2,
            Self::Circle { .. } => 3,
            Self::Slot { .. } => 5,
        }
    }

    /// Signed distance, positive outside, and the direction in which it grows.
    pub(crate) fn distance_and_normal(&self, place: &Vector2<f64>) -> (f64, Vector2<f64>) {
        match *self {
            Self::Line { at, angle_rad } => {
                let along = unit(angle_rad);
                let outside = Vector2::new(along.y, -along.x);
                (outside.dot(&(place - at)), outside)
            }
            Self::Circle { centre, radius_mm } => away(&(place - centre), radius_mm),
            Self::Slot { centre, angle_rad, half_mm, radius_mm } => {
                let along = unit(angle_rad);
                let from = place - centre;
                let reach = along.dot(&from).clamp(-half_mm.max(0.0), half_mm.max(0.0));
                away(&(from - along * reach), radius_mm)
            }
        }
    }

    /// Moved by a small step: line: outwards (mm), angle (rad); circle: centre, radius (mm); slot: centre (mm), angle
    /// (rad), half distance of the ends' centres, radius (mm).
    pub(crate) fn stepped(&self, step: &Step) -> Self {
        match *self {
            Self::Line { at, angle_rad } => {
                let along = unit(angle_rad);
                Self::Line { at: at + Vector2::new(along.y, -along.x) * step[0], angle_rad: angle_rad + step[1] }
            }
            Self::Circle { centre, radius_mm } => {
                Self::Circle { centre: centre + Vector2::new(step[0], step[1]), radius_mm: radius_mm + step[2] }
            }
            Self::Slot { centre, angle_rad, half_mm, radius_mm } => Self::Slot {
                centre: centre + Vector2::new(step[0], step[1]),
                angle_rad: angle_rad + step[2],
                half_mm: half_mm + step[3],
                radius_mm: radius_mm + step[4],
            },
        }
    }

    /// A line with its point moved next to the centroid of the points; other contours unchanged.
    fn anchored(&self, places: &[Vector2<f64>]) -> Self {
        match *self {
            Self::Line { at, angle_rad } => {
                let middle = places.iter().sum::<Vector2<f64>>() / places.len().max(1) as f64;
                let along = unit(angle_rad);
                Self::Line { at: at + along * along.dot(&(middle - at)), angle_rad }
            }
            other => other,
        }
    }

    fn slopes(&self, place: &Vector2<f64>) -> [f64; MAX_PARAMETERS] {
        let mut slopes = [0.0; MAX_PARAMETERS];
        for (parameter, slope) in slopes.iter_mut().enumerate().take(self.parameters()) {
            let at = |size: f64| {
                let mut step = [0.0; MAX_PARAMETERS];
                step[parameter] = size;
                self.stepped(&step).distance_and_normal(place).0
            };
            *slope = (at(DERIVATIVE_STEP) - at(-DERIVATIVE_STEP)) / (2.0 * DERIVATIVE_STEP);
        }
        slopes
    }
}

fn away(from: &Vector2<f64>, radius_mm: f64) -> (f64, Vector2<f64>) {
    let reach = from.norm();
    (reach - radius_mm, if reach > 0.0 { from / reach } else { Vector2::x() })
}

/// Minimises Σ distance² with equal weights. `None` if the points do not determine the contour, or the fit does not
/// converge.
pub(crate) fn fit(start: &Contour, places: &[Vector2<f64>]) -> Option<Contour> {
    let (contour, termination) = solve(start, places, MAX_STEPS)?;
    let has_size = match contour {
        Contour::Line { .. } => true,
        Contour::Circle { radius_mm, .. } => radius_mm > 0.0,
        Contour::Slot { half_mm, radius_mm, .. } => radius_mm > 0.0 && half_mm > 0.0,
    };
    (termination != Termination::NotConverged && has_size).then_some(contour)
}

/// [`fit`] with the termination reason.
fn solve(start: &Contour, places: &[Vector2<f64>], max_steps: usize) -> Option<(Contour, Termination)> {
    let mut contour = start.anchored(places);
    let mut equations = Equations::at(&contour, places);
    let mut damping = Damping::new(FIRST_DAMPING, MIN_DAMPING, MAX_DAMPING);
    for _ in 0..max_steps {
        let whole_step_mm = equations.whole_step_mm(places.len())?;
        if whole_step_mm <= GRADIENT_TOLERANCE_MM {
            return Some((contour.anchored(places), Termination::Gradient));
        }
        let step = equations.damped_step(damping.value())?;
        let candidate = contour.stepped(&step);
        let next = Equations::at(&candidate, places);
        let is_free = damping.is_weak();
        if next.cost < equations.cost {
            (contour, equations) = (candidate, next);
            damping.decrease();
            if is_free && step.iter().all(|part| part.abs() <= STEP_TOLERANCE) {
                return Some((contour.anchored(places), Termination::Step));
            }
        } else if is_free && whole_step_mm <= COST_TOLERANCE_MM {
            return Some((contour.anchored(places), Termination::Cost));
        } else if !damping.increase() {
            break;
        }
    }
    Some((contour, Termination::NotConverged))
}

/// Normal equations of the distances at a contour.
struct Equations {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Σ of squared distances, mm².
    cost: f64,
}

impl Equations {
    fn at(contour: &Contour, places: &[Vector2<f64>]) -> Self {
        let n = contour.parameters();
        let mut equations = Self { hessian: DMatrix::zeros(n, n), gradient: DVector::zeros(n), cost: 0.0 };
        for place in places {
            let (distance, _) = contour.distance_and_normal(place);
            let slopes = DVector::from_row_slice(&contour.slopes(place)[..n]);
            equations.hessian.ger(1.0, &slopes, &slopes, 1.0);
            equations.gradient.axpy(distance, &slopes, 1.0);
            equations.cost += distance * distance;
        }
        equations
    }

    /// Change of the distances by the undamped step, RMS, mm; `None` if the points do not determine the contour.
    fn whole_step_mm(&self, n_places: usize) -> Option<f64> {
        let step = self.hessian.clone().cholesky()?.solve(&self.gradient);
        let square = self.gradient.dot(&step) / n_places as f64;
        square.is_finite().then(|| square.max(0.0).sqrt())
    }

    fn damped_step(&self, damping: f64) -> Option<Step> {
        let mut damped = self.hessian.clone();
        for k in 0..damped.nrows() {
            damped[(k, k)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&self.gradient);
        let mut full = [0.0; MAX_PARAMETERS];
        full.iter_mut().zip(step.iter()).for_each(|(slot, part)| *slot = -part);
        full.iter().all(|part| part.is_finite()).then_some(full)
    }
}

/// Covariance of the parameters if every point has the same `variance_mm2` across the rim.
pub(crate) fn covariance(contour: &Contour, places: &[Vector2<f64>], variance_mm2: f64) -> Option<Covariance> {
    let n = contour.parameters();
    let mut normal = Covariance::identity();
    normal.view_mut((0, 0), (n, n)).fill(0.0);
    for place in places {
        let slopes = SVector::from(contour.slopes(place));
        normal += slopes * slopes.transpose();
    }
    let mut covariance = normal.try_inverse()? * variance_mm2;
    covariance.view_mut((n, n), (MAX_PARAMETERS - n, MAX_PARAMETERS - n)).fill(0.0);
    Some(covariance)
}

/// The hypothesis with the least median distance of all points (LMedS).
fn hypothesis(
    places: &[Vector2<f64>],
    needed: usize,
    through: impl Fn(&[Vector2<f64>]) -> Option<Contour>,
    rng: &mut Pcg64Mcg,
) -> Option<Contour> {
    let mut best: Option<(f64, Contour)> = None;
    for _ in 0..HYPOTHESES {
        let drawn: Vec<Vector2<f64>> = (0..needed).map(|_| places[rng.random_range(0..places.len())]).collect();
        let Some(contour) = through(&drawn) else { continue };
        let mut distances: Vec<f64> = places.iter().map(|p| contour.distance_and_normal(p).0.abs()).collect();
        let score = median(&mut distances)?;
        if best.is_none_or(|(least, _)| score < least) {
            best = Some((score, contour));
        }
    }
    best.map(|(_, contour)| contour)
}

/// Initial line; `outwards`: direction towards its outside.
pub(crate) fn first_line(places: &[Vector2<f64>], outwards: &Vector2<f64>, rng: &mut Pcg64Mcg) -> Option<Contour> {
    let through = |drawn: &[Vector2<f64>]| {
        let along = (drawn[1] - drawn[0]).try_normalize(f64::MIN_POSITIVE)?;
        let along = if Vector2::new(along.y, -along.x).dot(outwards) > 0.0 { along } else { -along };
        Some(Contour::Line { at: drawn[0], angle_rad: along.y.atan2(along.x) })
    };
    hypothesis(places, 2, through, rng)
}

/// Initial circle.
pub(crate) fn first_circle(places: &[Vector2<f64>], rng: &mut Pcg64Mcg) -> Option<Contour> {
    let through = |drawn: &[Vector2<f64>]| {
        let (a, b) = (drawn[1] - drawn[0], drawn[2] - drawn[0]);
        let double = 2.0 * a.perp(&b);
        let from = Vector2::new(
            b.y * a.norm_squared() - a.y * b.norm_squared(),
            a.x * b.norm_squared() - b.x * a.norm_squared(),
        ) / double;
        from.iter()
            .all(|x| x.is_finite())
            .then(|| Contour::Circle { centre: drawn[0] + from, radius_mm: from.norm() })
    };
    hypothesis(places, 3, through, rng)
}

/// Initial slot, from the principal axes of the points.
pub(crate) fn first_slot(places: &[Vector2<f64>]) -> Option<Contour> {
    let middle = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
    let spread = places.iter().map(|p| (p - middle) * (p - middle).transpose()).sum::<nalgebra::Matrix2<f64>>();
    let eigen = spread.symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let across = Vector2::new(-along.y, along.x);
    let ends = |axis: &Vector2<f64>| {
        let all = places.iter().map(|p| axis.dot(&(p - middle)));
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let ((low, high), (left, right)) = (ends(&along), ends(&across));
    let radius_mm = (right - left) / 2.0;
    let half_mm = ((high - low) / 2.0 - radius_mm).max(0.1 * radius_mm);
    let centre = middle + along * ((low + high) / 2.0) + across * ((left + right) / 2.0);
    radius_mm.is_finite().then(|| Contour::Slot { centre, angle_rad: along.y.atan2(along.x), half_mm, radius_mm })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// Points all around a contour.
    fn around(contour: &Contour, n: usize) -> Vec<Vector2<f64>> {
        let towards = |k: usize| unit(std::f64::consts::TAU * k as f64 / n as f64);
        (0..n)
            .map(|k| {
                // Projected onto the rim from far outside.
                let mut place = Vector2::new(3.0, -2.0) + towards(k) * 40.0;
                for _ in 0..20 {
                    let (distance, normal) = contour.distance_and_normal(&place);
                    place -= normal * distance;
                }
                place
            })
            .collect()
    }

    #[test]
    fn exact_points_reproduce_the_contour() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let slot = Contour::Slot { centre: Vector2::new(3.0, -2.0), angle_rad: 0.4, half_mm: 5.0, radius_mm: 2.0 };
        let places = around(&slot, 60);
        let found = fit(&first_slot(&places).unwrap(), &places).unwrap();
        let Contour::Slot { half_mm, radius_mm, .. } = found else { panic!("{found:?}") };
        assert!((half_mm - 5.0).abs() < 1e-8 && (radius_mm - 2.0).abs() < 1e-8, "{found:?}");
        let circle = Contour::Circle { centre: Vector2::new(3.0, -2.0), radius_mm: 4.5 };
        let mut places = around(&circle, 40);
        let clean = fit(&first_circle(&places, &mut rng).unwrap(), &places).unwrap();
        assert!(clean.distance_and_normal(&Vector2::new(7.5, -2.0)).0.abs() < 1e-9, "{clean:?}");
        // A third of outliers does not move the initial circle far.
        places.extend((0..20).map(|k| Vector2::new(f64::from(k), 9.0)));
        let Some(Contour::Circle { radius_mm, .. }) = first_circle(&places, &mut rng) else { panic!("no circle") };
        assert!((radius_mm - 4.5).abs() < 1e-6, "{radius_mm}");
    }

    #[test]
    fn a_fit_converges_before_its_steps_run_out() {
        let circle = Contour::Circle { centre: Vector2::new(3.0, -2.0), radius_mm: 4.5 };
        let off = |k: usize| Vector2::new(0.01 * (k % 3) as f64, 0.02 * (k % 5) as f64);
        let places: Vec<Vector2<f64>> = around(&circle, 40).iter().enumerate().map(|(k, p)| p + off(k)).collect();
        let start = Contour::Circle { centre: Vector2::new(1.0, 0.0), radius_mm: 9.0 };
        let (found, end) = solve(&start, &places, MAX_STEPS).unwrap();
        assert_ne!(end, Termination::NotConverged);
        assert_eq!(solve(&start, &places, 1).unwrap().1, Termination::NotConverged);
        // Starting from its own result it does not move.
        let again = fit(&found, &places).unwrap();
        let rim = Vector2::new(7.5, -2.0);
        assert!((again.distance_and_normal(&rim).0 - found.distance_and_normal(&rim).0).abs() < 1e-8);
        // Coincident points determine no circle.
        assert_eq!(fit(&start, &vec![places[0]; 40]), None);
    }

    #[test]
    fn outside_a_line_is_on_its_right() {
        let line = Contour::Line { at: Vector2::zeros(), angle_rad: 0.0 };
        assert_eq!(line.distance_and_normal(&Vector2::new(3.0, -2.0)).0, 2.0);
    }
}
