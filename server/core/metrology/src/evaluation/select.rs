//! The points in which a feature is searched: by region, by order, by direction of the surface normal.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::Vector3;
use optics::{PartFrame, Rigid};
use rayon::prelude::*;

use crate::evaluation::alignment::DatumFrame;
use crate::fitting::sample::Samples;
use crate::params::NORMAL_BASE_SIGMAS;
use crate::plan::feature::Selection;

/// Points of the cloud by line, for surface normals.
pub(crate) struct Lines<'a> {
    samples: &'a Samples<'a>,
    by_place: OnceLock<HashMap<(u32, i8), Range<u32>>>,
}

impl<'a> Lines<'a> {
    pub(crate) fn new(samples: &'a Samples<'a>) -> Self {
        Self { samples, by_place: OnceLock::new() }
    }

    pub(crate) fn samples(&self) -> &'a Samples<'a> {
        self.samples
    }

    /// Indices of the points of a line; the cloud is ordered by frame, then order, then along the line.
    fn of(&self, frame: u32, order: i8) -> Range<u32> {
        let by_place = self.by_place.get_or_init(|| {
            let mut lines: HashMap<(u32, i8), Range<u32>> = HashMap::new();
            for idx in 0..self.samples.len() as u32 {
                let point = self.samples.point(idx);
                lines
                    .entry((point.frame, point.order))
                    .and_modify(|line| line.end = idx + 1)
                    .or_insert(idx..idx + 1);
            }
            lines
        });
        by_place.get(&(frame, order)).cloned().unwrap_or(0..0)
    }

    /// Unit normal of the surface at a point, towards the camera; `None` if there are no suitable neighbours.
    ///
    /// From chords along the line and along the travel, each as long as the excluded border of features.
    fn normal(&self, idx: u32, base_mm: f64) -> Option<Vector3<f64>> {
        let point = self.samples.point(idx);
        let along = self.chord(idx, &self.of(point.frame, point.order), base_mm)?;
        let beside = |step: i64| {
            (1..=MAX_FRAMES).find_map(|k| {
                let frame = u32::try_from(i64::from(point.frame) + step * k).ok()?;
                let near = self.nearest(idx, &self.of(frame, point.order))?;
                let reach = (self.samples.position(near) - self.samples.position(idx)).norm();
                (reach >= base_mm / 2.0 && reach <= 2.0 * base_mm).then_some(near)
            })
        };
        let (before, after) = (beside(-1), beside(1));
        let across = self.samples.position(after.unwrap_or(idx)) - self.samples.position(before.unwrap_or(idx));
        let normal = along.cross(&across).try_normalize(f64::MIN_POSITIVE)?;
        Some(if normal.dot(&self.samples.at(idx).ray) > 0.0 { -normal } else { normal })
    }

    fn chord(&self, idx: u32, line: &Range<u32>, base_mm: f64) -> Option<Vector3<f64>> {
        let at = self.samples.position(idx);
        let far = |candidate: &u32| (self.samples.position(*candidate) - at).norm() >= base_mm / 2.0;
        let (before, after) = ((line.start..idx).rev().find(far), (idx + 1..line.end).find(far));
        let near = |idx: u32| Some(idx).filter(|idx| (self.samples.position(*idx) - at).norm() <= base_mm);
        let (before, after) = (before.and_then(near), after.and_then(near));
        (before.is_some() || after.is_some())
            .then(|| self.samples.position(after.unwrap_or(idx)) - self.samples.position(before.unwrap_or(idx)))
    }

    /// The point of a line in nearly the same image column or row.
    fn nearest(&self, idx: u32, line: &Range<u32>) -> Option<u32> {
        let (first, last) = (self.samples.point(line.start.min(idx)), self.samples.point(line.end.max(1) - 1));
        if line.is_empty() {
            return None;
        }
        let by_column = (first.u_px - last.u_px).abs() >= (first.v_px - last.v_px).abs();
        let at = |idx: u32| {
            let point = self.samples.point(idx);
            if by_column { point.u_px } else { point.v_px }
        };
        let (mut low, mut high, rises) = (line.start, line.end - 1, at(line.end - 1) >= at(line.start));
        while high - low > 1 {
            let middle = low + (high - low) / 2;
            if (at(middle) < at(idx)) == rises { low = middle } else { high = middle }
        }
        [low, high].into_iter().min_by(|a, b| (at(*a) - at(idx)).abs().total_cmp(&(at(*b) - at(idx)).abs()))
    }
}

/// Frames searched for a neighbour along the travel.
const MAX_FRAMES: i64 = 64;

/// The points of a selection; its region and direction are in the datum frame if given, otherwise in the part frame.
pub(crate) fn candidates(
    lines: &Lines,
    selection: &Selection,
    datum_from_part: Option<&Rigid<DatumFrame, PartFrame>>,
) -> Vec<u32> {
    let samples = lines.samples;
    let is_inside = |idx: &u32| {
        let position = samples.position(*idx);
        let position = datum_from_part.map_or(position, |pose| pose.rotation * position + pose.translation_mm);
        let in_order = selection.orders.is_empty() || selection.orders.contains(&samples.point(*idx).order);
        in_order && selection.region.is_none_or(|region| region.contains(&position))
    };
    let mut inside: Vec<u32> = (0..samples.len() as u32).into_par_iter().filter(is_inside).collect();
    if let Some(facing) = selection.facing {
        let towards = Vector3::from(facing.normal).normalize();
        let towards = datum_from_part.map_or(towards, |pose| pose.rotation.inverse() * towards);
        let (least, base_mm) =
            (facing.within_deg.to_radians().cos(), NORMAL_BASE_SIGMAS / 3.0 * samples.border_margin_mm());
        let faces = |idx: &u32| lines.normal(*idx, base_mm).is_some_and(|normal| normal.dot(&towards) >= least);
        inside = inside.into_par_iter().filter(faces).collect();
    }
    inside
}
