//! The datum frame of a plan on a cloud, and how it depends on the calibration and the noise, for comparisons aligned by
//! datums.

use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};
use optics::{Calibration, PartFrame, Rigid};
use scanning::Cloud;

use crate::evaluation::alignment::DatumFrame;
use crate::evaluation::chain::Chain;
use crate::evaluation::fitted::fit_features;
use crate::evaluation::forms::{retriangulation, sets};
use crate::evaluation::uncertainty;
use crate::fitting::features::light_in_camera;
use crate::fitting::sample::Samples;
use crate::interface::request::MeasureError;
use crate::plan::document::Plan;

/// The datum frame of a plan, and how it depends on the calibration and the noise.
pub(crate) struct DatumPose {
    pub(crate) pose: Rigid<DatumFrame, PartFrame>,
    /// The pose for each variant of the calibration, in the order of `Retriangulation::variants`, on both sides of
    /// `as_seen`.
    variants: Vec<[Option<Rigid<DatumFrame, PartFrame>>; 2]>,
    as_seen: Option<Rigid<DatumFrame, PartFrame>>,
    /// The pose for one σ of each independent component of the noise.
    by_noise: Vec<Rigid<DatumFrame, PartFrame>>,
}

impl DatumPose {
    /// Effect of a mode on the pose, as a motion about `middle`; `None` if the mode gave no pose.
    pub(crate) fn step(
        &self,
        mode: usize,
        side: usize,
        middle: &Vector3<f64>,
        lever_mm: f64,
    ) -> Option<Vector6<f64>> {
        motion(&self.as_seen?, &(*self.variants.get(mode)?.get(side)?)?, middle, lever_mm)
    }

    /// Covariance of the pose from the noise, as motions about `middle`.
    pub(crate) fn covariance(&self, middle: &Vector3<f64>, lever_mm: f64) -> Matrix6<f64> {
        let steps = self.by_noise.iter().filter_map(|moved| motion(&self.pose, moved, middle, lever_mm));
        steps.map(|step| step * step.transpose()).sum()
    }
}

/// The motion from one pose to another: translation of the point that `from` maps to `middle`, and rotation times
/// `lever_mm`.
fn motion<T>(
    from: &Rigid<T, PartFrame>,
    to: &Rigid<T, PartFrame>,
    middle: &Vector3<f64>,
    lever_mm: f64,
) -> Option<Vector6<f64>> {
    let in_part = from.rotation.inverse() * (middle - from.translation_mm);
    let shift = to.rotation * in_part + to.translation_mm - middle;
    // By the quaternion: the angle of a matrix is an arc cosine of its trace, whose argument rounding may put beyond 1.
    let turn = UnitQuaternion::from_rotation_matrix(&(to.rotation * from.rotation.inverse()));
    let turn = turn.scaled_axis() * lever_mm;
    Some(Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z))
        .filter(|step| step.iter().all(|x| x.is_finite()))
}

/// The datum frame of a plan on a cloud.
///
/// # Errors
/// Those of the alignment, and [`MeasureError::CalibrationMismatch`].
pub(crate) fn datum_pose(
    plan: &Plan,
    cloud: &Cloud,
    calibration: Option<&Calibration>,
) -> Result<DatumPose, MeasureError> {
    let of_alignment =
        plan.with_dependencies(&plan.alignment.as_ref().map_or(Vec::new(), |alignment| alignment.datums().into()));
    let mut features = plan.features.clone();
    let mut keep = of_alignment.iter();
    features.retain(|_| keep.next().copied().unwrap_or(false));
    let plan = Plan { features, characteristics: Vec::new(), ..plan.clone() };
    let samples = Samples::from_cloud(cloud, None, calibration.and_then(light_in_camera));
    let (fitted, alignment) = fit_features(&plan, &samples);
    let pose = alignment.unwrap_or(Err(MeasureError::NotDetermined { what: "datum frame" }))?;
    let mut chain = Chain::new(&plan, &samples, fitted);
    chain.sets = sets(&chain, &[]);
    let retriangulation = retriangulation(&chain, calibration)?;
    let (as_seen, variants) = match &retriangulation {
        None => (None, Vec::new()),
        Some(retriangulation) => uncertainty::pose_by_modes(&chain, retriangulation),
    };
    let noise = uncertainty::noise(&chain, retriangulation.as_ref());
    Ok(DatumPose { pose, variants, as_seen, by_noise: uncertainty::pose_by_noise(&chain, &noise) })
}
