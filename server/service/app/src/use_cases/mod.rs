//! Use cases that change something, as functions of `(Principal, Input)`.
//!
//! Interfaces change state only through these functions. Each checks the permission, carries out the action, and stores
//! it together with the event that names the caller.

mod calibrations;
mod camera;
mod captures;
mod control;
mod doors;
mod inspections;
mod jobs;
mod manual;
mod measurements;
mod recipes;
mod recordings;
mod scans;
mod sessions;
mod simulation;

pub use calibrations::{Activate, activate, roll_back};
pub use camera::{camera_features, remove_dark_frame, set_camera_features, take_dark_frame};
pub use captures::{Upload, delete_capture, upload};
pub use control::{TakeControl, release_control, renew_control, reset, stop, take_control};
pub use doors::{Resend, delete_delivery, resend};
pub use inspections::{
    Evaluation, InspectionQueue, deviations, evaluate_plan, hold_inspections, inspect, inspect_from,
    inspection_queue, re_evaluate, resume_inspections, wait_for_job,
};
pub use jobs::{cancel_job, start_job};
pub use manual::{auto_expose, configure_camera, move_stage, set_live_view, switch_laser};
pub use measurements::{
    NewPosition, add_position, change_measurement_plan, create_study, delete_study, find_features, measure,
};
pub use recipes::{
    NewVersion, add_model, archive_recipe, delete_model, import_recipe, publish_recipe, roll_back_recipe,
};
pub use recordings::{delete_recording, start_recording, stop_recording};
pub use scans::delete_scan;
pub use sessions::{
    capture_pose, capture_stage_view, create_session, delete_pose, delete_session, delete_stage_view,
    set_session_exposures, solve_session,
};
pub use simulation::{
    disable_fault, enable_fault, idle_simulation, place_board, place_part, place_scene, simulation,
};
