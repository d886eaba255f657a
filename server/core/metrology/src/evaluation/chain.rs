//! The chain from fitted features to components, ready to be gone through again and again.

use nalgebra::Vector3;

use crate::evaluation::fitted::Fitted;
use crate::evaluation::values::{AngleAxes, Primitive, State, align, components, geometries};
use crate::fitting::sample::Samples;
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::plan::document::Plan;

/// What a set of points serves for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SetUse {
    /// A feature is fitted to them.
    Fit,
    /// A feature's form is seen on them.
    Form,
}

/// Points of a feature that are triangulated anew.
pub(crate) struct Set {
    pub(crate) feature: usize,
    pub(crate) what: SetUse,
    pub(crate) indices: Vec<u32>,
    /// The surface they are near.
    pub(crate) shape: Shape,
    /// Whether they count alike, whatever their noise.
    pub(crate) counts_alike: bool,
}

/// A plan with its fitted features.
pub(crate) struct Chain<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) samples: &'a Samples<'a>,
    pub(crate) fitted: Vec<Result<Fitted, MeasureError>>,
    pub(crate) sets: Vec<Set>,
    /// Axes of every angle.
    pub(crate) angles: Vec<Option<AngleAxes>>,
    /// Features that every characteristic rests on.
    closures: Vec<Vec<bool>>,
}

impl<'a> Chain<'a> {
    pub(crate) fn new(
        plan: &'a Plan,
        samples: &'a Samples<'a>,
        fitted: Vec<Result<Fitted, MeasureError>>,
    ) -> Self {
        let closures = plan.characteristics.iter().map(|characteristic| {
            let measure = &characteristic.measure;
            let mut ids = measure.features();
            if measure.is_in_part_frame() {
                ids.extend(plan.alignment.iter().flat_map(|alignment| alignment.datums()));
            }
            closure(plan, &ids)
        });
        let closures = closures.collect();
        Self { plan, samples, fitted, sets: Vec::new(), angles: vec![None; plan.characteristics.len()], closures }
    }

    /// Whether a characteristic rests on a feature.
    pub(crate) fn rests_on(&self, characteristic: usize, feature: usize) -> bool {
        self.closures[characteristic][feature]
    }

    /// The place of a feature's points among the sets.
    pub(crate) fn set_of(&self, feature: usize, what: SetUse) -> Option<usize> {
        self.sets.iter().position(|set| set.feature == feature && set.what == what)
    }

    /// What was fitted.
    pub(crate) fn primitives(&self) -> Vec<Primitive> {
        let of = |fitted: &Result<Fitted, MeasureError>| match fitted {
            Ok(Fitted::Surface(found)) => Primitive::Shape(found.shape),
            Ok(Fitted::Rim(rim)) => Primitive::Contour(rim.contour),
            _ => Primitive::None,
        };
        self.fitted.iter().map(of).collect()
    }

    /// All features, and the datum frame, from what was fitted.
    pub(crate) fn state(&self, primitives: &[Primitive], points: Vec<Vec<Vector3<f64>>>) -> State {
        let geometries = geometries(self.plan, &self.fitted, primitives);
        let datum_from_part = align(self.plan, &geometries).and_then(Result::ok);
        State { geometries, datum_from_part, points }
    }

    /// The components of the characteristics that are wanted.
    pub(crate) fn components(
        &self,
        state: &State,
        is_wanted: impl Fn(usize) -> bool,
    ) -> Vec<Option<Vector3<f64>>> {
        let of = |(idx, angle): (usize, &Option<AngleAxes>)| {
            let measure = &self.plan.characteristics[idx].measure;
            is_wanted(idx).then(|| components(self.plan, measure, state, angle.as_ref())).flatten()
        };
        self.angles.iter().enumerate().map(of).collect()
    }
}

/// Which features some rest on, themselves among them.
pub(crate) fn closure(plan: &Plan, ids: &[&str]) -> Vec<bool> {
    let mut holds = vec![false; plan.features.len()];
    ids.iter().filter_map(|id| plan.feature_idx(id)).for_each(|idx| holds[idx] = true);
    // Features rest on those above them alone.
    for idx in (0..plan.features.len()).rev().collect::<Vec<_>>() {
        if holds[idx] {
            let below = plan.features[idx].shape.rests_on();
            below.iter().filter_map(|id| plan.feature_idx(id)).for_each(|below| holds[below] = true);
        }
    }
    holds
}
