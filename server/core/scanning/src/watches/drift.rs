//! Drift of the wavelength and of the stage's scale, from two orders observing the same surface
//! (`docs/maths/watches.md`).
//!
//! Where order b observes what order a observed, their depths differ by −Σ (J_b − J_a)·θ, where θ holds the deviations
//! from the calibration: λ/d, which shifts order m by m times as much; the stage's scale, which shifts positions along
//! the travel by the distance travelled between the two crossings and is therefore visible on slopes only; the tilt of
//! its travel, which shifts depths by the same distance; and the errors of the calibration itself, which are known to
//! ±1 of its modes. All are fitted together.
//!
//! λ/d and tilt have nearly the same effect: order m crosses a point of the surface at a distance of m·Z·λ/d along
//! the travel from order 0. So λ/d is estimated twice, with the stage as calibrated, and with a free tilt.

use nalgebra::Vector3;
use optics::{Calibration, LightSurfaces, Stage};

use crate::params::watches::{DRIFT_PLACES, DRIFT_STEP, MAX_SCALE_SIGMA, MIN_CORRECTION_RELATIVE, WARN_SIGMAS};
use crate::threads::map_with;
use crate::watches::fit::{Difference, Fitted, fit};
use crate::watches::places::{OrderSamples, Place};
use crate::watches::student::widened_sigma;

/// A value and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// One σ.
    pub sigma: f64,
}

impl Estimate {
    /// Its distance from 0 in σ.
    pub fn sigmas(&self) -> f64 {
        self.value.abs() / self.sigma.max(f64::MIN_POSITIVE)
    }

    /// Whether it is more than so many σ from 0.
    pub fn is_beyond(&self, sigmas: f64) -> bool {
        self.sigmas() > sigmas
    }
}

/// Deviations from the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Relative change of λ/d, with the stage as calibrated; `None` for light surfaces without a wavelength.
    pub wavelength: Option<Estimate>,
    /// The same with the tilt of the travel as a free parameter.
    pub wavelength_with_free_tilt: Option<Estimate>,
    /// The tilt of the travel, rad, towards greater depths, whose effect is most similar to that of `wavelength`.
    pub equivalent_tilt_rad: Option<f64>,
    /// Mean depth error of the order with the largest error, mm per unit of `wavelength`.
    pub depth_mm_by_wavelength: f64,
    /// Depth in the middle of the calibrated range, mm.
    pub depth_mm: f64,
    /// Relative excess of the stage's true travel over the stated travel; `None` without suitable slopes.
    pub stage_scale: Option<Estimate>,
    /// Number of points used.
    pub n_places: usize,
}

impl Drift {
    /// The change of λ/d by which a scan may be corrected: significant both with the stage as calibrated and with
    /// a free tilt, and large enough to matter.
    pub fn correction(&self) -> Option<Estimate> {
        let matters = |wavelength: &Estimate| {
            let error_mm = (wavelength.value * self.depth_mm_by_wavelength).abs();
            wavelength.is_beyond(WARN_SIGMAS) && error_mm >= MIN_CORRECTION_RELATIVE * self.depth_mm
        };
        self.wavelength.filter(matters)?;
        self.wavelength_with_free_tilt.filter(|wavelength| wavelength.is_beyond(WARN_SIGMAS))
    }
}

/// The calibration with its wavelength changed by `relative`; other light models are unchanged.
pub fn with_wavelength_changed(calibration: &Calibration, relative: f64) -> Calibration {
    let mut changed = calibration.clone();
    if let LightSurfaces::Grating(grating) = &mut changed.light {
        grating.wavelength_over_period *= 1.0 + relative;
    }
    changed
}

/// Indices of the parameters; the modes of the calibration follow.
const WAVELENGTH: usize = 0;
const TILT: usize = 1;
const SCALE: usize = 2;
const FIRST_MODE: usize = 3;

/// The drift since the calibration; `None` if two orders observed too little common surface.
pub fn drift(samples_of_orders: &OrderSamples, calibration: &Calibration) -> Option<Drift> {
    let stepped = Stepped::new(calibration)?;
    let places = samples_of_orders.places(DRIFT_PLACES);
    let evaluated = |(): &mut (), idx: usize| stepped.difference(samples_of_orders, &places[idx]);
    let evaluated: Vec<Evaluated> = map_with(places.len(), 16, || (), evaluated).into_iter().flatten().collect();
    let differences: Vec<Difference> = evaluated.iter().map(|place| place.difference.clone()).collect();
    let known: Vec<bool> = (0..stepped.to.len()).map(|idx| idx >= FIRST_MODE).collect();
    let with = |free: &[usize]| -> Option<Fitted> {
        let chosen: Vec<usize> = free.iter().copied().chain(FIRST_MODE..known.len()).collect();
        fit(&differences, &chosen, &known)
    };
    let has_wavelength = stepped.has_wavelength;
    let as_calibrated = has_wavelength.then(|| with(&[WAVELENGTH])).flatten();
    let wavelength = as_calibrated.as_ref().map(|fitted| estimate(fitted, 0));
    if has_wavelength && wavelength.is_none() {
        return None;
    }
    let with_free_tilt = has_wavelength.then(|| with(&[WAVELENGTH, TILT])).flatten();
    let free: &[usize] = if has_wavelength { &[SCALE, WAVELENGTH] } else { &[SCALE] };
    let determines_scale = |fitted: &Fitted| fitted.covariance[(0, 0)] <= MAX_SCALE_SIGMA.powi(2);
    let stage_scale = with(free).filter(determines_scale).map(|fitted| estimate(&fitted, 0));
    Some(Drift {
        wavelength,
        wavelength_with_free_tilt: with_free_tilt.map(|fitted| estimate(&fitted, 0)),
        equivalent_tilt_rad: wavelength
            .and_then(|wavelength| Some(wavelength.value * tilt_by_wavelength(&differences)?)),
        depth_mm_by_wavelength: if has_wavelength {
            largest_mean(&evaluated, samples_of_orders.orders().len())
        } else {
            0.0
        },
        depth_mm: calibration.depth_range_mm.middle_mm(),
        stage_scale,
        n_places: differences.len(),
    })
}

fn estimate(fitted: &Fitted, idx: usize) -> Estimate {
    let (value, sigma) = (fitted.parameters[idx], fitted.covariance[(idx, idx)].max(0.0).sqrt());
    Estimate { value, sigma: widened_sigma(value, sigma, fitted.degrees_of_freedom[idx]) }
}

/// The tilt whose effect on the differences is most similar to one unit of wavelength.
fn tilt_by_wavelength(differences: &[Difference]) -> Option<f64> {
    let product = |one: usize, other: usize| -> f64 {
        differences.iter().map(|of| of.by_parameters[one] * of.by_parameters[other]).sum()
    };
    Some(product(WAVELENGTH, TILT) / product(TILT, TILT)).filter(|ratio| ratio.is_finite())
}

/// Mean change of depth per unit of wavelength, of the order whose depths change most.
fn largest_mean(evaluated: &[Evaluated], n_orders: usize) -> f64 {
    let mut sums = vec![(0.0, 0.0); n_orders];
    for (order, change) in evaluated.iter().flat_map(|evaluated| evaluated.by_wavelength) {
        sums[order].0 += change;
        sums[order].1 += 1.0;
    }
    sums.into_iter().filter(|(_, n)| *n > 0.0).map(|(sum, n): (f64, f64)| (sum / n).abs()).fold(0.0, f64::max)
}

/// Evaluation of one point.
struct Evaluated {
    difference: Difference,
    /// Index and change of depth per unit of wavelength of both orders.
    by_wavelength: [(usize, f64); 2],
}

/// A calibration and its variants with a small step of every parameter.
struct Stepped<'a> {
    from: &'a Calibration,
    to: Vec<Calibration>,
    /// Size of the steps.
    sizes: Vec<f64>,
    has_wavelength: bool,
}

impl<'a> Stepped<'a> {
    fn new(from: &'a Calibration) -> Option<Self> {
        let Some(Stage::Linear(stage)) = from.stage else { return None };
        let along = stage.direction;
        let depth = (Vector3::z() - along * (along.z / along.norm_squared())).try_normalize(1e-3)?;
        let moved = |by: Vector3<f64>| {
            let mut stage = stage;
            stage.direction += by * DRIFT_STEP;
            Calibration { stage: Some(stage.into()), ..from.clone() }
        };
        let wavelength_stepped = with_wavelength_changed(from, DRIFT_STEP);
        let has_wavelength = matches!(from.light, LightSurfaces::Grating(_));
        let modes = from.sigma_modes();
        let sizes = [DRIFT_STEP; FIRST_MODE].into_iter().chain(modes.iter().map(|_| 1.0)).collect();
        let to = [wavelength_stepped, moved(depth), moved(along)].into_iter();
        Some(Self {
            from,
            to: to.chain(modes.iter().map(|mode| from.stepped(mode))).collect(),
            sizes,
            has_wavelength,
        })
    }

    fn difference(&self, samples_of_orders: &OrderSamples, place: &Place) -> Option<Evaluated> {
        let changes = |order, seen| samples_of_orders.depth_changes(self.from, &self.to, order, seen, place);
        let own = changes(place.order, (place.sample.pixel, place.sample.position_mm))?;
        let others = changes(place.other, (place.surface.pixel, place.surface.position_mm))?;
        let per_step = |(own, other): (&f64, &f64), size: &f64| (other - own) / size;
        let by_parameters =
            own.iter().zip(&others).zip(&self.sizes).map(|(both, size)| per_step(both, size)).collect();
        let value = place.sample.depth_mm - place.surface.depth_mm;
        let by_wavelength =
            [(place.order, own[WAVELENGTH] / DRIFT_STEP), (place.other, others[WAVELENGTH] / DRIFT_STEP)];
        Some(Evaluated { difference: Difference { by_parameters, value, cluster: place.cluster }, by_wavelength })
    }
}
