//! Where lines of light cross the rim of a plane.
//!
//! A line that ends at a rim fades over its blur: it has half of its light where it crosses the rim (eq. 12 of
//! `docs/maths/metrology.md`), whatever share of it the extraction still takes for a line. The point after the last one is
//! lost below that share. A rim that lines cross at a small angle cuts the sheet along its thickness, where neither
//! height nor light say where the rim is; such crossings are left out later.

use nalgebra::Vector3;
use statistics::median;

use crate::fitting::features::Found;
use crate::fitting::robust::normalised_distance;
use crate::fitting::sample::Samples;
use crate::params::{
    LOST_LIGHT_SHARE, RIM_FULL_LIGHT_POINTS, RIM_GAP_SPACINGS, RIM_MIN_RUN_POINTS, RIM_REACH_LINE_SIGMAS,
};

/// Points within this many trims of a plane lie on it when its rim is looked for.
const ON_PLANE_TRIMS: f64 = 2.0;

/// A line that crosses a rim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// The last point on the plane.
    pub(crate) sample_idx: u32,
    /// From that point to the rim, part frame, mm.
    pub(crate) offset: Vector3<f64>,
    /// Unit vector along the line, off the plane.
    pub(crate) outwards: Vector3<f64>,
    /// Blur of the end (one σ, mm); `None` if the light did not fall by half before the point was lost.
    pub(crate) blur_mm: Option<f64>,
}

/// The ends of lines on a plane, among the candidates. A line that goes on outside of them has no end there.
pub(crate) fn crossings(samples: &Samples, plane: &Found, candidates: &[u32]) -> Vec<Crossing> {
    let reach_mm = RIM_REACH_LINE_SIGMAS / 3.0 * samples.border_margin_mm();
    let is_on_plane = |idx: u32| {
        let sample = samples.at(idx);
        normalised_distance(&plane.shape, &sample).abs() <= ON_PLANE_TRIMS * plane.trim
            || plane.shape.distance_mm(&sample.in_part.xyz).abs() <= reach_mm
    };
    let mut spacings: Vec<f64> = candidates
        .windows(2)
        .filter(|pair| pair[1] == pair[0] + 1)
        .filter_map(|pair| crate::measuring::noise::spacing_px(samples, pair[0], pair[1]))
        .collect();
    let Some(spacing_px) = median(&mut spacings) else { return Vec::new() };
    let walk = Walk { samples, is_on_plane: &is_on_plane, gap_px: RIM_GAP_SPACINGS * spacing_px };
    candidates
        .iter()
        .filter(|idx| is_on_plane(**idx))
        .flat_map(|idx| [1, -1].map(|step| walk.crossing(*idx, step)))
        .flatten()
        .collect()
}

struct Walk<'a> {
    samples: &'a Samples<'a>,
    is_on_plane: &'a dyn Fn(u32) -> bool,
    gap_px: f64,
}

impl Walk<'_> {
    /// The next point of the same line on the plane.
    fn next(&self, idx: u32, step: i64) -> Option<u32> {
        let next = u32::try_from(i64::from(idx) + step).ok().filter(|next| (*next as usize) < self.samples.len())?;
        let px = crate::measuring::noise::spacing_px(self.samples, idx, next)?;
        (px <= self.gap_px && (self.is_on_plane)(next)).then_some(next)
    }

    /// The crossing beyond a point that is the last of its line in the direction of `step`.
    fn crossing(&self, last: u32, step: i64) -> Option<Crossing> {
        if self.next(last, step).is_some() {
            return None;
        }
        let mut run = vec![last];
        while run.len() < RIM_FULL_LIGHT_POINTS.end
            && let Some(inwards) = self.next(run[run.len() - 1], -step)
        {
            run.push(inwards);
        }
        if run.len() < RIM_MIN_RUN_POINTS {
            return None;
        }
        let at = |k: usize| self.samples.position(run[k]);
        let chord = at(0) - at(run.len() - 1);
        let (outwards, spacing_mm) = (chord.try_normalize(f64::MIN_POSITIVE)?, chord.norm() / (run.len() - 1) as f64);
        let light = |k: usize| f64::from(self.samples.point(run[k]).intensity);
        let mut further_in: Vec<f64> = (RIM_FULL_LIGHT_POINTS.start.min(run.len() / 2)..run.len()).map(light).collect();
        let full = median(&mut further_in)?;
        let half = full / 2.0;
        let (inner, before) = (0..run.len()).find(|k| light(*k) >= half).map(|k| (k, light(k)))?;
        let beyond = if inner == 0 { LOST_LIGHT_SHARE * full } else { light(inner - 1) };
        let share = ((before - half) / (before - beyond)).clamp(0.0, 1.0);
        let from_last_mm = (share - inner as f64) * spacing_mm;
        // The slope of Φ(a/σ) where it is one half.
        let fell = light(0) < 0.9 * full;
        let blur_mm = fell.then(|| full * spacing_mm / ((std::f64::consts::TAU).sqrt() * (before - beyond)));
        Some(Crossing { sample_idx: last, offset: outwards * from_last_mm, outwards, blur_mm })
    }
}
