//! Comparison of the three light models by cross-validation over poses.

use optics::LightModelKind;
use rayon::prelude::*;

use crate::findings::report::{CrossValidation, ModelScore};
use crate::fits::light_fit::{Scene, fit_light};
use crate::params::{CROSS_VALIDATION_MAX_FOLDS, CROSS_VALIDATION_POINTS, RECOMMEND_SIMPLER_BELOW};
use crate::solving::bundle::sheet_residual;
use crate::solving::observation::LaserObservation;

/// Bins along a line whose means separate a wrong shape from noise.
const BINS_PER_LINE: usize = 6;

/// Scores every model by cross-validation over poses, with camera and poses fixed.
pub fn cross_validate(scene: &Scene, laser: &[LaserObservation]) -> CrossValidation {
    let laser = thinned(laser, scene.poses.len(), scene.orders.len());
    let scores: Vec<ModelScore> = scene.models().iter().map(|&kind| score(scene, &laser, kind)).collect();
    let (recommended, reason) = recommendation(&scores);
    CrossValidation { scores, recommended, reason }
}

fn score(scene: &Scene, laser: &[LaserObservation], model: LightModelKind) -> ModelScore {
    let failed = |failure: String| ModelScore {
        model,
        held_out_rms_px: f64::NAN,
        held_out_rms_mm: f64::NAN,
        held_out_bias_mm: f64::NAN,
        fit_rms_px: f64::NAN,
        failure: Some(failure),
    };
    let all = match fit_light(scene, laser, model, None) {
        Ok(fitted) => fitted.light,
        Err(error) => return failed(error.to_string()),
    };
    let fit = Errors::of(scene, &all, laser, |_| true);
    let blocks = used_blocks(laser);
    let n_folds = blocks.len().min(CROSS_VALIDATION_MAX_FOLDS);
    let folds: Vec<Result<Errors, String>> = (0..n_folds)
        .into_par_iter()
        .map(|fold| {
            let held_out =
                |block: usize| blocks.iter().position(|b| *b == block).is_some_and(|i| i % n_folds == fold);
            let train: Vec<LaserObservation> = laser.iter().filter(|p| !held_out(p.block)).copied().collect();
            let fitted = fit_light(scene, &train, model, Some(&all)).map_err(|error| error.to_string())?;
            Ok(Errors::of(scene, &fitted.light, laser, held_out))
        })
        .collect();
    let mut sum = Errors::default();
    for fold in folds {
        match fold {
            Ok(errors) => sum.add(&errors),
            Err(failure) => return failed(failure),
        }
    }
    ModelScore {
        model,
        held_out_rms_px: (sum.squares_px / sum.n).sqrt(),
        held_out_rms_mm: (sum.squares_mm / sum.n).sqrt(),
        held_out_bias_mm: (sum.bin_squares_mm / sum.n_bins).sqrt(),
        fit_rms_px: (fit.squares_px / fit.n).sqrt(),
        failure: None,
    }
}

/// Sums of squared errors over points and over bins of points.
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    n: f64,
    squares_px: f64,
    squares_mm: f64,
    n_bins: f64,
    bin_squares_mm: f64,
}

impl Errors {
    fn of(
        scene: &Scene,
        light: &optics::LightSurfaces,
        laser: &[LaserObservation],
        wanted: impl Fn(usize) -> bool,
    ) -> Self {
        let mut errors = Self::default();
        for block in 0..scene.poses.len() {
            if !wanted(block) {
                continue;
            }
            for &order in scene.orders {
                let line: Vec<_> = laser
                    .iter()
                    .filter(|p| p.block == block && p.order == order)
                    .filter_map(|p| sheet_residual(scene.camera, light, &scene.poses[block], p, None))
                    .collect();
                for residual in &line {
                    errors.n += 1.0;
                    errors.squares_px += residual.residual_px.powi(2);
                    errors.squares_mm += residual.depth_error_mm.powi(2);
                }
                for bin in line.chunks(line.len().div_ceil(BINS_PER_LINE).max(1)) {
                    let mean = bin.iter().map(|r| r.depth_error_mm).sum::<f64>() / bin.len() as f64;
                    errors.n_bins += 1.0;
                    errors.bin_squares_mm += mean * mean;
                }
            }
        }
        errors
    }

    fn add(&mut self, other: &Self) {
        self.n += other.n;
        self.squares_px += other.squares_px;
        self.squares_mm += other.squares_mm;
        self.n_bins += other.n_bins;
        self.bin_squares_mm += other.bin_squares_mm;
    }
}

/// At most [`CROSS_VALIDATION_POINTS`] points per pose and order, evenly.
fn thinned(laser: &[LaserObservation], n_blocks: usize, n_orders: usize) -> Vec<LaserObservation> {
    let most = CROSS_VALIDATION_POINTS * n_blocks * n_orders;
    let step = laser.len().div_ceil(most).max(1);
    laser.iter().step_by(step).copied().collect()
}

fn used_blocks(laser: &[LaserObservation]) -> Vec<usize> {
    let mut blocks: Vec<usize> = laser.iter().map(|p| p.block).collect();
    blocks.sort_unstable();
    blocks.dedup();
    blocks
}

/// The most exact model that could be fitted, unless a simpler one predicts held-out poses clearly better.
fn recommendation(scores: &[ModelScore]) -> (LightModelKind, String) {
    let fitted: Vec<&ModelScore> = scores.iter().filter(|s| s.failure.is_none()).collect();
    let Some(most_exact) = fitted.last() else {
        return (LightModelKind::Planes, "no model could be fitted".to_owned());
    };
    let best = fitted
        .iter()
        .filter(|s| s.held_out_bias_mm < RECOMMEND_SIMPLER_BELOW * most_exact.held_out_bias_mm)
        .min_by(|a, b| a.held_out_bias_mm.total_cmp(&b.held_out_bias_mm))
        .unwrap_or(most_exact);
    let others: Vec<String> = fitted
        .iter()
        .filter(|s| s.model != best.model)
        .map(|s| format!("`{}` {:.1} µm", s.model, 1e3 * s.held_out_bias_mm))
        .collect();
    let rest = match (others.is_empty(), scores.len()) {
        (false, _) => others.join(", "),
        (true, 1) => "and no other model applies to independent lines".to_owned(),
        (true, _) => "and no other model could be fitted".to_owned(),
    };
    let reason = format!(
        "on poses left out of the fit, `{}` has a depth error of {:.1} µm (means along the lines, RMS), {}",
        best.model,
        1e3 * best.held_out_bias_mm,
        rest
    );
    (best.model, reason)
}
