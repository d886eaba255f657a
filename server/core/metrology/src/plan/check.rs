//! Consistency checks of a plan.

use std::borrow::Cow;

use remedy::Remedy;

use crate::interface::measurement::Unit;
use crate::plan::characteristic::{Characteristic, Measure};
use crate::plan::document::Plan;
use crate::plan::feature::{FeatureShape, LineOf, PointOf, Selection};

/// What is wrong with a plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{pointer}: {detail}")]
pub struct PlanError {
    /// JSON pointer to the invalid part of the document.
    pub pointer: String,
    /// What is wrong.
    pub detail: String,
    remedy: &'static str,
}

impl Remedy for PlanError {
    fn remedy(&self) -> Option<Cow<'_, str>> {
        Some(self.remedy.into())
    }
}

/// The kind of geometry that a feature provides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Plane,
    Line,
    Point,
    Section,
}

fn kind(shape: &FeatureShape) -> Kind {
    match shape {
        FeatureShape::Plane { .. } => Kind::Plane,
        FeatureShape::Cylinder { .. } | FeatureShape::Edge { .. } | FeatureShape::Line { .. } => Kind::Line,
        FeatureShape::Sphere { .. }
        | FeatureShape::Circle { .. }
        | FeatureShape::Slot { .. }
        | FeatureShape::Point { .. } => Kind::Point,
        FeatureShape::Section { .. } => Kind::Section,
    }
}

impl Plan {
    /// Checks that every name is known, every feature of the right kind, and every limit in the right unit.
    ///
    /// # Errors
    /// [`PlanError`] for the first invalid part.
    pub fn check(&self) -> Result<(), PlanError> {
        for (idx, feature) in self.features.iter().enumerate() {
            self.check_feature(idx, &feature.id, &feature.shape)?;
        }
        if let Some(alignment) = &self.alignment {
            let [a, b, c] = alignment.datums();
            for (name, id) in ["primary", "secondary", "tertiary"].into_iter().zip([a, b, c]) {
                self.kind_of(
                    id,
                    self.features.len(),
                    || format!("/alignment/{name}"),
                    &[Kind::Plane, Kind::Line, Kind::Point],
                )?;
            }
            if a == b || b == c || a == c {
                return Err(error(
                    "/alignment".into(),
                    "three different features are needed".into(),
                    "name three different features",
                ));
            }
        }
        for (idx, characteristic) in self.characteristics.iter().enumerate() {
            self.check_characteristic(idx, characteristic)?;
        }
        Ok(())
    }

    /// Per feature: whether it is one of `ids`, or one of these depends on it.
    pub fn with_dependencies(&self, ids: &[&str]) -> Vec<bool> {
        let mut holds = vec![false; self.features.len()];
        ids.iter().filter_map(|id| self.feature_idx(id)).for_each(|idx| holds[idx] = true);
        // Features depend only on those above them.
        for idx in (0..self.features.len()).rev() {
            if holds[idx] {
                let below = self.features[idx].shape.depends_on();
                below.iter().filter_map(|id| self.feature_idx(id)).for_each(|below| holds[below] = true);
            }
        }
        holds
    }

    /// Index of a feature.
    pub(crate) fn feature_idx(&self, id: &str) -> Option<usize> {
        self.features.iter().position(|feature| feature.id == id)
    }

    fn kind_of(
        &self,
        id: &str,
        before: usize,
        pointer: impl Fn() -> String,
        allowed: &[Kind],
    ) -> Result<(), PlanError> {
        let idx = self.feature_idx(id).filter(|idx| *idx < before).ok_or_else(|| {
            error(
                pointer(),
                format!("there is no feature \"{id}\" above this one"),
                "name a feature defined further up",
            )
        })?;
        let shape = &self.features[idx].shape;
        if allowed.contains(&kind(shape)) {
            return Ok(());
        }
        Err(error(
            pointer(),
            format!("\"{id}\" is a {}, which cannot be used here", shape.name()),
            "name another feature",
        ))
    }

    fn check_feature(&self, idx: usize, id: &str, shape: &FeatureShape) -> Result<(), PlanError> {
        let at = |rest: &str| format!("/features/{idx}{rest}");
        if id.is_empty() || self.feature_idx(id) != Some(idx) {
            return Err(error(
                at("/id"),
                format!("\"{id}\" is empty or already used"),
                "give every feature a unique name",
            ));
        }
        if let Some(fault) = shape.selection().and_then(fault_of) {
            return Err(error(at("/shape/select"), fault.into(), "correct the numbers"));
        }
        let needs = |id: &str, allowed: &[Kind]| self.kind_of(id, idx, || at("/shape"), allowed);
        match shape {
            FeatureShape::Plane { .. } => Ok(()),
            FeatureShape::Sphere { radius_mm, .. } | FeatureShape::Cylinder { radius_mm, .. } => match radius_mm {
                Some(radius_mm) if !(radius_mm.is_finite() && *radius_mm > 0.0) => Err(error(
                    at("/shape/radius_mm"),
                    format!("{radius_mm} is not a valid radius"),
                    "give a number above 0",
                )),
                _ => Ok(()),
            },
            FeatureShape::Circle { plane, .. }
            | FeatureShape::Slot { plane, .. }
            | FeatureShape::Edge { plane, .. } => needs(plane, &[Kind::Plane]),
            FeatureShape::Section { x, y, contour_mm, origin_mm, .. } => {
                let numbers = || contour_mm.iter().flatten().chain(x).chain(y).chain(origin_mm);
                let [x, y] = [x, y].map(|v| nalgebra::Vector3::from(*v));
                let is_good = numbers().all(|number| number.is_finite())
                    && contour_mm.len() >= 2
                    && x.cross(&y).norm() > 0.9 * x.norm() * y.norm()
                    && x.norm() > 0.0;
                let fault = "a contour needs at least two corners and two perpendicular directions";
                if is_good { Ok(()) } else { Err(error(at("/shape"), fault.into(), "correct the numbers")) }
            }
            FeatureShape::Line { of } => match of {
                LineOf::Planes(ids) => ids.iter().try_for_each(|id| needs(id, &[Kind::Plane])),
                LineOf::Axis(id) => {
                    needs(id, &[Kind::Line, Kind::Point])?;
                    let has_axis = |idx: usize| {
                        matches!(
                            self.features[idx].shape,
                            FeatureShape::Cylinder { .. }
                                | FeatureShape::Circle { .. }
                                | FeatureShape::Slot { .. }
                        )
                    };
                    match self.feature_idx(id).filter(|idx| has_axis(*idx)) {
                        Some(_) => Ok(()),
                        None => Err(error(
                            at("/shape"),
                            format!("\"{id}\" has no axis"),
                            "name a cylinder, circle or slot",
                        )),
                    }
                }
                LineOf::Points(ids) => ids.iter().try_for_each(|id| needs(id, &[Kind::Point])),
            },
            FeatureShape::Point { of } => match of {
                PointOf::Centre(id) => needs(id, &[Kind::Point, Kind::Plane]),
                PointOf::LineAndPlane([line, plane]) => {
                    needs(line, &[Kind::Line])?;
                    needs(plane, &[Kind::Plane])
                }
                PointOf::Planes(ids) => ids.iter().try_for_each(|id| needs(id, &[Kind::Plane])),
                PointOf::Lines(ids) => ids.iter().try_for_each(|id| needs(id, &[Kind::Line])),
            },
        }
    }

    fn check_characteristic(&self, idx: usize, characteristic: &Characteristic) -> Result<(), PlanError> {
        let at = |rest: &str| format!("/characteristics/{idx}{rest}");
        let (id, measure) = (&characteristic.id, &characteristic.measure);
        if id.is_empty() || self.characteristics.iter().position(|other| other.id == *id) != Some(idx) {
            return Err(error(
                at("/id"),
                format!("\"{id}\" is empty or already used"),
                "give every characteristic a unique name",
            ));
        }
        let needs = |id: &str, allowed: &[Kind]| self.kind_of(id, self.features.len(), || at("/measure"), allowed);
        let any = [Kind::Plane, Kind::Line, Kind::Point];
        match measure {
            Measure::Distance { from, to, .. } => [from, to].iter().try_for_each(|id| needs(id, &any))?,
            Measure::Angle { from, to, .. } => {
                [from, to].iter().try_for_each(|id| needs(id, &[Kind::Plane, Kind::Line]))?;
            }
            Measure::Step { .. }
            | Measure::Parallelism { .. }
            | Measure::Perpendicularity { .. }
            | Measure::Flatness { .. }
            | Measure::GrooveDepth { .. } => {
                measure.features().iter().try_for_each(|id| needs(id, &[Kind::Plane]))?;
            }
            Measure::Diameter { of } | Measure::Radius { of } => {
                needs(of, &any)?;
                self.shape_is(of, &["sphere", "cylinder", "circle"], at("/measure/of"))?;
            }
            Measure::Coordinate { of, .. } | Measure::Position { of, .. } => needs(of, &[Kind::Point])?,
            Measure::Profile { of } => needs(of, &[Kind::Section])?,
            Measure::SurfaceProfile { .. } => self.check_surface_profile(measure, at)?,
            Measure::Gap { from, to, surface } => {
                [from, to].iter().try_for_each(|id| needs(id, &[Kind::Line]))?;
                needs(surface, &[Kind::Plane])?;
            }
            Measure::Flush { reference, surface, at: rim } => {
                [reference, surface].iter().try_for_each(|id| needs(id, &[Kind::Plane]))?;
                rim.iter().try_for_each(|id| needs(id, &[Kind::Line]))?;
            }
            Measure::Width { of } | Measure::Length { of } => {
                needs(of, &[Kind::Point])?;
                self.shape_is(of, &["slot"], at("/measure/of"))?;
            }
        }
        if let Measure::Position { at_mm, .. } = measure
            && !(at_mm.iter().any(Option::is_some) && at_mm.iter().flatten().all(|mm| mm.is_finite()))
        {
            return Err(error(
                at("/measure/at_mm"),
                "no nominal coordinate".into(),
                "give at least one coordinate",
            ));
        }
        if measure.needs_datum_frame() && self.alignment.is_none() {
            return Err(error(at("/measure"), "there is no datum frame to measure in".into(), "add an alignment"));
        }
        check_limits(characteristic, at)
    }

    fn check_surface_profile(&self, measure: &Measure, at: impl Fn(&str) -> String) -> Result<(), PlanError> {
        let Measure::SurfaceProfile { model, best_fit, start, region, reach_mm } = measure else { return Ok(()) };
        let is_hash = model.sha256.len() == 64 && model.sha256.bytes().all(|byte| byte.is_ascii_hexdigit());
        let is_file_name = !model.name.is_empty() && !model.name.contains(['/', '\\']);
        if !is_hash || !is_file_name {
            let detail =
                "a model has the name of a file, without a folder, and a SHA-256 of 64 hexadecimal digits";
            return Err(error(at("/measure/model"), detail.into(), "give both as the list of models shows them"));
        }
        if self.alignment.is_none() && !best_fit {
            let detail = "there is no datum frame in which the model lies";
            return Err(error(at("/measure"), detail.into(), "add an alignment, or align by best_fit"));
        }
        if start.is_some() && (self.alignment.is_some() || !best_fit) {
            let detail = "a start pose serves a best fit in a plan without an alignment";
            return Err(error(at("/measure/start"), detail.into(), "omit it"));
        }
        let is_number = |start: &[f64; 6]| start.iter().all(|number| number.is_finite());
        if !start.as_ref().is_none_or(is_number) {
            return Err(error(at("/measure/start"), "a number is not finite".into(), "give finite numbers"));
        }
        if let Some(fault) = region.and_then(|region| region.fault()) {
            return Err(error(at("/measure/region"), fault.into(), "correct the numbers"));
        }
        if reach_mm.is_some_and(|reach_mm| !(reach_mm.is_finite() && reach_mm > 0.0)) {
            return Err(error(at("/measure/reach_mm"), "not a distance".into(), "give a number above 0"));
        }
        Ok(())
    }

    fn shape_is(&self, id: &str, allowed: &[&str], pointer: String) -> Result<(), PlanError> {
        let name = self.feature_idx(id).map_or("feature", |idx| self.features[idx].shape.name());
        if allowed.contains(&name) {
            return Ok(());
        }
        Err(error(pointer, format!("\"{id}\" is a {name}, which has no such dimension"), "name another feature"))
    }
}

/// Checks nominal and limits: right unit, finite, in order, with a nominal.
fn check_limits(characteristic: &Characteristic, at: impl Fn(&str) -> String) -> Result<(), PlanError> {
    let Characteristic { measure, nominal_mm, nominal_deg, lower, upper, .. } = characteristic;
    let (wrong, place) = match measure.unit() {
        Unit::Mm => (nominal_deg, "/nominal_deg"),
        Unit::Degree => (nominal_mm, "/nominal_mm"),
    };
    if wrong.is_some() {
        let detail = format!("a {} is given in {}", measure.name(), measure.unit().symbol());
        return Err(error(at(place), detail, "use the nominal of the right unit"));
    }
    let numbers = [nominal_mm, nominal_deg, lower, upper];
    if numbers.iter().any(|number| number.is_some_and(|number| !number.is_finite())) {
        return Err(error(at(""), "a number is not finite".into(), "give finite numbers"));
    }
    let has_limits = lower.is_some() || upper.is_some();
    if measure.is_deviation() {
        if nominal_mm.is_some_and(|nominal| nominal != 0.0)
            || lower.is_some()
            || upper.is_some_and(|upper| upper <= 0.0)
        {
            let detail = format!("a {} is never below 0, which is its nominal", measure.name());
            return Err(error(at(""), detail, "give only an upper limit, above 0"));
        }
    } else if has_limits && nominal_mm.or(*nominal_deg).is_none() {
        return Err(error(at(""), "limits need a nominal".into(), "give the nominal value"));
    }
    if lower.zip(*upper).is_some_and(|(lower, upper)| lower >= upper) {
        return Err(error(at("/lower"), "the lower limit is not below the upper one".into(), "swap the limits"));
    }
    Ok(())
}

fn fault_of(selection: &Selection) -> Option<&'static str> {
    let of_facing = selection.facing.and_then(|facing| {
        let normal = nalgebra::Vector3::from(facing.normal).norm();
        let is_good = normal.is_finite() && normal > 0.0 && (0.0..=90.0).contains(&facing.within_deg);
        (!is_good).then_some("facing needs a direction, and an angle from 0 to 90 degrees")
    });
    selection.region.and_then(|region| region.fault()).or(of_facing)
}

fn error(pointer: String, detail: String, remedy: &'static str) -> PlanError {
    PlanError { pointer, detail, remedy }
}
