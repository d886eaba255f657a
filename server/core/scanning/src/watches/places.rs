//! Points of a part observed by two orders.

use nalgebra::{Vector2, Vector3};
use optics::{Calibration, Stage, StagePosition};

use crate::params::watches::{CLUSTER_BINS, CLUSTER_TRAVEL_BINS};
use crate::watches::samples::{FrameSamples, LineSampler, Sample, SurfacePlace, surface_at};

/// The samples of all orders, bin by bin, in the order of travel.
#[derive(Debug)]
pub struct OrderSamples {
    sampler: LineSampler,
    /// By order, then bin.
    samples: Vec<Vec<Vec<Sample>>>,
}

/// A point that order `order` observed on the surface observed by `other`; indices of the calibration's orders.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// The observing order.
    pub order: usize,
    /// The order whose surface is used.
    pub other: usize,
    /// The sample of `order`.
    pub sample: Sample,
    /// The surface of `other`.
    pub surface: SurfacePlace,
    /// Points with the same number are neighbours and share noise.
    pub cluster: u64,
}

impl OrderSamples {
    /// No samples yet.
    pub fn new(sampler: LineSampler) -> Self {
        let samples = vec![vec![Vec::new(); sampler.n_bins]; sampler.orders.len()];
        Self { sampler, samples }
    }

    /// Adds a frame.
    pub fn add(&mut self, frame: &FrameSamples) {
        for (of_order, seen) in self.samples.iter_mut().zip(frame) {
            for (bin, sample) in seen {
                of_order[*bin].push(*sample);
            }
        }
    }

    /// The orders.
    pub fn orders(&self) -> &[i8] {
        &self.sampler.orders
    }

    /// Extent of the observed surface along the travel, mm.
    pub fn length_mm(&self) -> f64 {
        let along = self.samples.iter().flatten().flatten().map(|sample| sample.along_mm);
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
        (high - low).max(0.0)
    }

    /// About `n_wanted` points observed by two orders, spread over the part and the pairs.
    pub fn places(&self, n_wanted: usize) -> Vec<Place> {
        let n_orders = self.samples.len();
        let mut found = Vec::new();
        for (bin, order) in (0..self.sampler.n_bins).flat_map(|bin| (0..n_orders).map(move |order| (bin, order))) {
            for sample in &self.samples[order][bin] {
                for other in 0..order {
                    let surface = surface_at(&self.samples[other][bin], sample.along_mm);
                    let row = (sample.along_mm / (CLUSTER_TRAVEL_BINS * self.sampler.bin_mm)).floor() as i64;
                    let cluster = (bin / CLUSTER_BINS) as u64 | ((row as u64) << 32);
                    found.extend(surface.map(|surface| Place { order, other, sample: *sample, surface, cluster }));
                }
            }
        }
        let stride = found.len().div_ceil(n_wanted.max(1)).max(1);
        // A stride that shares a factor with the number of pairs would skip some of them.
        let stride = if stride > 1 { stride | 1 } else { 1 };
        found.into_iter().step_by(stride).collect()
    }

    /// Change of the surface's depth at a fixed lateral position, mm, from one calibration to others, for the
    /// pixel that observed it: the effect of a lateral shift on the depth is included.
    pub fn depth_changes(
        &self,
        from: &Calibration,
        to: &[Calibration],
        order: usize,
        (pixel, position_mm): ([f64; 2], f64),
        place: &Place,
    ) -> Option<Vec<f64>> {
        let [along, across, depth] = &self.sampler.axes;
        let slope = place.surface.slope;
        let slope_across = place.sample.by_across[1] - slope * place.sample.by_across[0];
        let up = depth - along * slope - across * slope_across;
        let order = self.sampler.orders[order];
        let at = in_part(from, order, pixel, position_mm)?;
        to.iter().map(|one| Some((in_part(one, order, pixel, position_mm)? - at).dot(&up))).collect()
    }
}

/// The point observed by a pixel, part frame.
fn in_part(calibration: &Calibration, order: i8, pixel: [f64; 2], position_mm: f64) -> Option<Vector3<f64>> {
    let stage: &Stage = calibration.stage.as_ref()?;
    let hit = calibration.triangulate(order, &Vector2::from(pixel), None)?;
    Some(stage.part_from_camera(&hit.hit_in_camera, StagePosition::LinearMm(position_mm))?.xyz)
}
