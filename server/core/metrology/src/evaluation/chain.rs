//! The computation from fitted features to components, repeatable with perturbed inputs.

use nalgebra::Vector3;

use crate::evaluation::fitted::Fitted;
use crate::evaluation::values::{AngleAxes, Primitive, State, align, components, geometries};
use crate::fitting::sample::Samples;
use crate::interface::request::MeasureError;
use crate::interface::shape::Shape;
use crate::plan::document::Plan;

/// Purpose of a set of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PointSetUse {
    /// To fit a feature.
    Fit,
    /// To evaluate a feature's form.
    Form,
}

/// Points of a feature that are re-triangulated.
pub(crate) struct PointSet {
    pub(crate) feature: usize,
    pub(crate) what: PointSetUse,
    pub(crate) indices: Vec<u32>,
    /// The surface near which they lie.
    pub(crate) shape: Shape,
    /// Whether they have equal weights, regardless of their noise.
    pub(crate) equal_weights: bool,
}

/// A plan with its fitted features.
pub(crate) struct Chain<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) samples: &'a Samples<'a>,
    pub(crate) fitted: Vec<Result<Fitted, MeasureError>>,
    pub(crate) sets: Vec<PointSet>,
    /// Axes of every angle, by characteristic.
    pub(crate) angles: Vec<Option<AngleAxes>>,
    /// For every characteristic, whether it depends on each feature.
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
            if measure.needs_datum_frame() {
                ids.extend(plan.alignment.iter().flat_map(|alignment| alignment.datums()));
            }
            plan.with_dependencies(&ids)
        });
        let closures = closures.collect();
        Self { plan, samples, fitted, sets: Vec::new(), angles: vec![None; plan.characteristics.len()], closures }
    }

    /// Whether a characteristic depends on a feature.
    pub(crate) fn depends_on(&self, characteristic: usize, feature: usize) -> bool {
        self.closures[characteristic][feature]
    }

    /// Index of the set with a feature's points.
    pub(crate) fn set_of(&self, feature: usize, what: PointSetUse) -> Option<usize> {
        self.sets.iter().position(|set| set.feature == feature && set.what == what)
    }

    /// The fitted primitives.
    pub(crate) fn primitives(&self) -> Vec<Primitive> {
        let of = |fitted: &Result<Fitted, MeasureError>| match fitted {
            Ok(Fitted::Surface(found)) => Primitive::Shape(found.shape),
            Ok(Fitted::Rim(rim)) => Primitive::Contour(rim.contour),
            _ => Primitive::None,
        };
        self.fitted.iter().map(of).collect()
    }

    /// All features and the datum frame, from the fitted primitives.
    pub(crate) fn state(&self, primitives: &[Primitive], points: Vec<Vec<Vector3<f64>>>) -> State {
        let geometries = geometries(self.plan, &self.fitted, primitives);
        let datum_from_part = align(self.plan, &geometries).and_then(Result::ok);
        State { geometries, datum_from_part, points }
    }

    /// The components of the requested characteristics.
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
