//! Verdicts of the watches: quiet, blind on this part, warning, or invalid.
//!
//! A watch warns where its value is significant. It invalidates where the error that it shows exceeds the expanded
//! uncertainty stated for the points, by more than its own uncertainty.

use crate::params::watches::{COVERAGE, REFERENCE_SCANS, WARN_FRACTION, WARN_SIGMAS};
use crate::watches::drift::{Drift, Estimate};
use crate::watches::order_powers::OrderPowers;
use crate::watches::power_verdicts::of_powers;
use crate::watches::{LostSteps, WatchReport};

/// A watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Watch {
    /// A jump between the observations of the orders before and after: mm.
    LostSteps,
    /// Relative change of λ/d.
    Wavelength,
    /// Logarithm of the change of an order's power.
    OrderPowers,
    /// Relative excess of the stage's true travel over the stated travel.
    StageScale,
}

/// State of a watch for a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum WatchState {
    /// Nothing significant.
    Quiet,
    /// Not detectable on this part or station.
    Blind,
    /// A significant deviation.
    Warning,
    /// The error exceeds the uncertainty stated for the points.
    Invalid,
}

/// Why a watch has its state, as a code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchReason {
    /// The stage lost steps.
    StepsLost,
    /// No steps were lost.
    NoStepsLost,
    /// Lost steps cannot be detected: two orders observed no changing slopes.
    LossUndetectable,
    /// Two orders observed too little common surface.
    LittleOverlap,
    /// The light model has no wavelength.
    NoWavelength,
    /// No significant change of the wavelength.
    WavelengthStable,
    /// The wavelength changed; the scan is corrected.
    WavelengthCorrected,
    /// The wavelength changed, or the stage is tilted; not corrected.
    WavelengthOrTilt,
    /// The part has no changing slopes along the travel.
    NoSlopes,
    /// No significant error of the stage scale.
    ScaleStable,
    /// The scale of the stage is wrong.
    ScaleWrong,
    /// Two orders observed too little common surface without saturation.
    LittleUnsaturatedOverlap,
    /// The reference powers are still being measured.
    ReferenceIncomplete,
    /// No significant change of the order powers.
    PowersStable,
    /// Positive and negative orders changed in opposite directions: the grating rotated.
    GratingRotated,
    /// Positive and negative orders changed equally: the grating is dirty.
    GratingDirty,
    /// Independent lines: one lost power against the others; its laser fades or is dirty.
    LineFaded,
    /// Independent lines: all but one lost power against it; their lasers fade or are dirty.
    OthersFaded,
    /// All orders lost power: the laser ages, or the parts are darker.
    PowerLoss,
    /// The watch compares light sheets, and the calibration has one.
    OneLine,
}

impl WatchReason {
    /// All of them.
    pub const ALL: [Self; 20] = [
        Self::StepsLost,
        Self::NoStepsLost,
        Self::LossUndetectable,
        Self::LittleOverlap,
        Self::NoWavelength,
        Self::WavelengthStable,
        Self::WavelengthCorrected,
        Self::WavelengthOrTilt,
        Self::NoSlopes,
        Self::ScaleStable,
        Self::ScaleWrong,
        Self::LittleUnsaturatedOverlap,
        Self::ReferenceIncomplete,
        Self::PowersStable,
        Self::GratingRotated,
        Self::GratingDirty,
        Self::LineFaded,
        Self::OthersFaded,
        Self::PowerLoss,
        Self::OneLine,
    ];

    /// The code in records, events and the API.
    pub fn code(self) -> &'static str {
        match self {
            Self::StepsLost => "steps_lost",
            Self::NoStepsLost => "no_steps_lost",
            Self::LossUndetectable => "loss_undetectable",
            Self::LittleOverlap => "little_overlap",
            Self::NoWavelength => "no_wavelength",
            Self::WavelengthStable => "wavelength_stable",
            Self::WavelengthCorrected => "wavelength_corrected",
            Self::WavelengthOrTilt => "wavelength_or_tilt",
            Self::NoSlopes => "no_slopes",
            Self::ScaleStable => "scale_stable",
            Self::ScaleWrong => "scale_wrong",
            Self::LittleUnsaturatedOverlap => "little_unsaturated_overlap",
            Self::ReferenceIncomplete => "reference_incomplete",
            Self::PowersStable => "powers_stable",
            Self::GratingRotated => "grating_rotated",
            Self::GratingDirty => "grating_dirty",
            Self::LineFaded => "line_faded",
            Self::OthersFaded => "others_faded",
            Self::PowerLoss => "power_loss",
            Self::OneLine => "one_line",
        }
    }
}

/// Verdict of one watch on a scan.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchVerdict {
    /// The watch.
    pub watch: Watch,
    /// Its state.
    pub state: WatchState,
    /// Its value, in the unit of the watch.
    pub estimate: Option<Estimate>,
    /// The resulting error of points, mm.
    pub error_mm: Option<f64>,
    /// The stage position at which it begins.
    pub position_mm: Option<f64>,
    /// The line concerned, if it is one.
    pub line: Option<i8>,
    /// Why, as a code.
    pub reason_code: WatchReason,
    /// Why, as a sentence for the operator.
    pub reason: String,
}

/// Powers of the first scans after a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerReference {
    /// Scans used for it.
    pub n_scans: usize,
    /// Mean and scatter from scan to scan of the logarithm of every order's power over that of the reference order.
    pub log_ratios: Vec<(i8, Estimate)>,
    /// The same of the total.
    pub log_total: Estimate,
}

impl PowerReference {
    /// From the first scans; those beyond [`REFERENCE_SCANS`] are ignored, `None` while there are fewer.
    pub fn of(first: &[OrderPowers]) -> Option<Self> {
        let scans = first.get(..REFERENCE_SCANS)?;
        let of_order = |order: i8| {
            let values = scans.iter().filter_map(|scan| {
                scan.log_ratios.iter().find(|(other, _)| *other == order).map(|(_, ratio)| ratio.value)
            });
            mean_and_scatter(&values.collect::<Vec<_>>())
        };
        let mut orders: Vec<i8> =
            scans.iter().flat_map(|scan| &scan.log_ratios).map(|(order, _)| *order).collect();
        orders.sort_unstable();
        orders.dedup();
        let totals: Vec<f64> = scans.iter().map(|scan| scan.log_total).collect();
        Some(Self {
            n_scans: scans.len(),
            log_ratios: orders.into_iter().filter_map(|order| Some((order, of_order(order)?))).collect(),
            log_total: mean_and_scatter(&totals)?,
        })
    }
}

fn mean_and_scatter(values: &[f64]) -> Option<Estimate> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() >= 2).then(|| Estimate { value: mean, sigma: (squares / (n - 1.0)).sqrt() })
}

/// The verdicts, one per watch. `median_sigma_mm`: of the cloud's points. `reference`: powers since the calibration, at
/// the same exposure and laser power.
pub fn verdicts(
    report: &WatchReport,
    median_sigma_mm: f64,
    reference: Option<&PowerReference>,
) -> Vec<WatchVerdict> {
    if report.single_line {
        let watches = [Watch::LostSteps, Watch::Wavelength, Watch::OrderPowers, Watch::StageScale];
        let reason = "not available with one light sheet: the watch compares what two of them observed";
        return watches.map(|watch| verdict(watch, WatchState::Blind, WatchReason::OneLine, reason)).into();
    }
    let stated_mm = COVERAGE * median_sigma_mm;
    vec![
        of_lost_steps(report, stated_mm),
        of_wavelength(report.drift.as_ref(), stated_mm),
        of_powers(report, reference),
        of_scale(report.drift.as_ref(), report.length_mm, stated_mm),
    ]
}

pub(super) fn verdict(
    watch: Watch,
    state: WatchState,
    reason_code: WatchReason,
    reason: impl Into<String>,
) -> WatchVerdict {
    let reason = reason.into();
    WatchVerdict {
        watch,
        state,
        estimate: None,
        error_mm: None,
        position_mm: None,
        line: None,
        reason_code,
        reason,
    }
}

/// Whether an error is a warning, or invalidates the scan.
fn state_for_error(error_mm: f64, sigma_mm: f64, stated_mm: f64) -> WatchState {
    if error_mm - COVERAGE * sigma_mm > stated_mm { WatchState::Invalid } else { WatchState::Warning }
}

fn of_lost_steps(report: &WatchReport, stated_mm: f64) -> WatchVerdict {
    let largest = report.lost_steps.iter().max_by(|a, b| a.lag_mm.abs().total_cmp(&b.lag_mm.abs()));
    if let Some(&LostSteps { position_mm, lag_mm, sigma_mm, .. }) = largest {
        let reason = format!(
            "the stage has lost {:.0} ± {:.0} µm at {position_mm:.1} mm; home it, check load and speed",
            lag_mm.abs() * 1e3,
            sigma_mm * 1e3
        );
        return WatchVerdict {
            estimate: Some(Estimate { value: lag_mm, sigma: sigma_mm }),
            error_mm: Some(lag_mm.abs()),
            position_mm: Some(position_mm),
            ..verdict(
                Watch::LostSteps,
                state_for_error(lag_mm.abs(), sigma_mm, stated_mm),
                WatchReason::StepsLost,
                reason,
            )
        };
    }
    match report.smallest_loss_mm {
        None => verdict(
            Watch::LostSteps,
            WatchState::Blind,
            WatchReason::LossUndetectable,
            "no loss could be detected: this needs changing slopes, observed by two orders before and after",
        ),
        Some(smallest_mm) => WatchVerdict {
            estimate: Some(Estimate { value: 0.0, sigma: smallest_mm }),
            ..verdict(
                Watch::LostSteps,
                WatchState::Quiet,
                WatchReason::NoStepsLost,
                format!(
                    "no steps lost; {:.0} µm would be detected where two orders observe the same surface",
                    smallest_mm * 1e3
                ),
            )
        },
    }
}

fn of_wavelength(drift: Option<&Drift>, stated_mm: f64) -> WatchVerdict {
    let watch = Watch::Wavelength;
    let Some(drift) = drift else {
        return verdict(
            watch,
            WatchState::Blind,
            WatchReason::LittleOverlap,
            "too little of the surface was observed by two orders",
        );
    };
    let Some(wavelength) = drift.wavelength else {
        return verdict(
            watch,
            WatchState::Blind,
            WatchReason::NoWavelength,
            "the light model of this calibration has no wavelength",
        );
    };
    let by_mm = drift.depth_mm_by_wavelength;
    let (error_mm, sigma_mm) = ((wavelength.value * by_mm).abs(), wavelength.sigma * by_mm);
    let figure = format!("λ/d {:+.1} ± {:.1} ·10⁻⁴", wavelength.value * 1e4, wavelength.sigma * 1e4);
    let is_clear = wavelength.is_beyond(WARN_SIGMAS) && error_mm >= WARN_FRACTION * stated_mm;
    if !is_clear && drift.correction().is_none() {
        let quiet = verdict(watch, WatchState::Quiet, WatchReason::WavelengthStable, figure);
        return WatchVerdict { estimate: Some(wavelength), error_mm: Some(error_mm), ..quiet };
    }
    let remedy = "let the laser reach its temperature, or calibrate again";
    if let Some(corrected) = drift.correction() {
        let left_mm = corrected.sigma * by_mm;
        let reason = format!(
            "{figure} since the calibration, no tilt of the stage explains it: the scan is corrected by {:+.1} ± {:.1} ·10⁻⁴; {remedy}",
            corrected.value * 1e4,
            corrected.sigma * 1e4
        );
        let warning =
            verdict(watch, state_for_error(left_mm, 0.0, stated_mm), WatchReason::WavelengthCorrected, reason);
        return WatchVerdict { estimate: Some(corrected), error_mm: Some(left_mm), ..warning };
    }
    let reason = format!(
        "{figure} since the calibration, depth errors up to {:.0} µm; not corrected: a stage tilted by {:+.2} mrad would look the same, measure a known step to decide; {remedy}",
        error_mm * 1e3,
        drift.equivalent_tilt_rad.unwrap_or(0.0) * 1e3
    );
    let verdict =
        verdict(watch, state_for_error(error_mm, sigma_mm, stated_mm), WatchReason::WavelengthOrTilt, reason);
    WatchVerdict { estimate: Some(wavelength), error_mm: Some(error_mm), ..verdict }
}

fn of_scale(drift: Option<&Drift>, length_mm: f64, stated_mm: f64) -> WatchVerdict {
    let watch = Watch::StageScale;
    let Some(scale) = drift.and_then(|drift| drift.stage_scale) else {
        return verdict(
            watch,
            WatchState::Blind,
            WatchReason::NoSlopes,
            "the part has no changing slopes along the travel: scan a ball or a wavy surface",
        );
    };
    let (error_mm, sigma_mm) = ((scale.value * length_mm).abs(), scale.sigma * length_mm);
    let figure =
        format!("excess travel {:+.1} ± {:.1} ·10⁻⁴ of the stated distance", scale.value * 1e4, scale.sigma * 1e4);
    let is_clear = scale.is_beyond(WARN_SIGMAS) && error_mm >= WARN_FRACTION * stated_mm;
    let (state, code, reason) = if is_clear {
        (
            state_for_error(error_mm, sigma_mm, stated_mm),
            WatchReason::ScaleWrong,
            format!("{figure}, {:.0} µm over this part; check steps per mm, or calibrate again", error_mm * 1e3),
        )
    } else {
        (WatchState::Quiet, WatchReason::ScaleStable, figure)
    };
    WatchVerdict { estimate: Some(scale), error_mm: Some(error_mm), ..verdict(watch, state, code, reason) }
}
