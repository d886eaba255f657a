//! Parts on rendered stations: every station is calibrated from its images, scans two parts, and measures each
//! characteristic of a plan, compared with the true value.
//!
//! Not covered: shiny parts, form errors of real parts and stages, other light than the twin's.

mod formed;
mod machined;
mod part;
mod solid;

use calibration::CalibrationOptions;
use metrology::{Models, evaluate};
use optics::Calibration;
use pipeline::{calibrate_features, open_capture, read_features};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use serde_json::Value;
use twin::{CaptureRequest, StationModel, StationShape};

use crate::warnings::WarningCollector;

/// Half of the field's width, mm.
const FIELD_MM: f64 = 62.0;

/// Random stream of the first part, derived from a station's seed.
const FIRST_PART_STREAM: u64 = 0x200;

fn station(seed: u64) -> StationModel {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let shape = StationShape {
        field_half_width_mm: FIELD_MM,
        line_sigma_px: between(1.5, 2.5),
        speckle_contrast: between(0.15, 0.35),
        speckle_grain_px: between(1.3, 2.0),
        line_peak: between(0.5, 0.85),
        ..StationShape::default()
    };
    StationModel::seeded(seed, &shape).unwrap()
}

/// Calibrates the station from its images.
fn calibrated(model: &StationModel) -> Calibration {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("capture");
    let request = CaptureRequest { scans: Vec::new(), ..CaptureRequest::standard(model) };
    let proceed = |_| std::ops::ControlFlow::Continue(());
    twin::capture_folder(model, &request, &capture, &proceed).unwrap();
    let warnings = WarningCollector::default();
    let capture = open_capture(&capture, &warnings).unwrap();
    let features = read_features(&capture, false, &warnings).unwrap();
    calibrate_features(&capture, &features, &CalibrationOptions::default(), &warnings)
        .unwrap()
        .document
        .calibration()
}

/// Errors and U of one characteristic on all stations.
struct Errors {
    measure: Value,
    truth: f64,
    of: Vec<(f64, f64)>,
}

impl Errors {
    fn n_inside(&self) -> usize {
        self.of.iter().filter(|(error, u)| error.abs() <= *u).count()
    }

    fn mean(&self, of: impl Fn(&(f64, f64)) -> f64) -> f64 {
        self.of.iter().map(of).sum::<f64>() / self.of.len() as f64
    }
}

impl std::fmt::Display for Errors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} of {} inside U, bias {:+.5}, U {:.5}, normalised RMS {:.2}: {}",
            self.n_inside(),
            self.of.len(),
            self.mean(|(error, _)| *error),
            self.mean(|(_, u)| *u),
            self.mean(|(error, u)| (2.0 * error / u).powi(2)).sqrt(),
            self.measure
        )
    }
}

fn measured(seeds: std::ops::Range<u64>) -> Vec<Errors> {
    let parts = [machined::part(), formed::part()];
    let all = parts.iter().flat_map(|part| &part.characteristics);
    let mut errors: Vec<Errors> =
        all.map(|(measure, truth)| Errors { measure: measure.clone(), truth: *truth, of: Vec::new() }).collect();
    for seed in seeds {
        let model = station(seed);
        let calibration = calibrated(&model);
        let results = parts.iter().zip(FIRST_PART_STREAM..).flat_map(|(part, stream)| {
            let (cloud, plan) = part.scan(&model, &calibration, stream);
            evaluate(&plan, &cloud, Some(&calibration), &Models::new()).unwrap().characteristics
        });
        for (errors, result) in errors.iter_mut().zip(results) {
            let (Some(value), Some(u)) = (result.value, result.expanded_uncertainty) else {
                panic!("station {seed}: {} {:?}", errors.measure, result.failure)
            };
            assert!(result.missing.is_empty(), "station {seed}: {} {:?}", errors.measure, result.missing);
            errors.of.push((value - errors.truth, u));
        }
    }
    errors.iter().for_each(|errors| eprintln!("{errors}"));
    errors
}

fn share_inside(errors: &[Errors]) -> f64 {
    let n_inside: usize = errors.iter().map(Errors::n_inside).sum();
    n_inside as f64 / errors.iter().map(|errors| errors.of.len()).sum::<usize>() as f64
}

/// On one station the errors of all characteristics are correlated by its calibration.
#[test]
fn the_characteristics_of_two_parts_lie_near_their_true_values() {
    let errors = measured(0..1);
    assert!(share_inside(&errors) >= 0.85);
    let far: Vec<&Errors> =
        errors.iter().filter(|e| e.of.iter().any(|(error, u)| error.abs() > 2.0 * u)).collect();
    assert!(far.is_empty(), "{}", far[0]);
}

/// The figures: `docs/maths/metrology.md`, with the forms, whose bias exceeds U/4.
#[test]
#[ignore = "eight minutes: cargo xtask campaign"]
fn campaign_of_all_characteristics_on_rendered_stations() {
    let errors = measured(0..60);
    let share = share_inside(&errors);
    eprintln!("{:.1} % of all inside U", 100.0 * share);
    assert!(share >= 0.93, "{share}");
    // Of sixty, fewer than 52 inside at 95 % has a probability of 0.4 %.
    let rarely: Vec<&Errors> = errors.iter().filter(|errors| errors.n_inside() < 52).collect();
    assert!(rarely.is_empty(), "{}", rarely[0]);
    let biased = |errors: &&Errors| {
        let kind = errors.measure["type"].as_str().unwrap_or_default();
        let is_form = ["flatness", "parallelism", "perpendicularity", "profile"].contains(&kind);
        !is_form && errors.mean(|(error, _)| *error).abs() > errors.mean(|(_, u)| *u) / 4.0
    };
    let biased: Vec<&Errors> = errors.iter().filter(biased).collect();
    assert!(biased.is_empty(), "{}", biased[0]);
}
