//! A laser in colour photographs by daylight, and the cost of compression; rendered with known ground truth.
//!
//! Not covered: the colour filters and the processing of a particular camera.

mod photograph;

use capture::{LaserChannel, read_photograph};
use nalgebra::Vector2;
use photograph::{Agreement, GREEN_LASER, RED_LASER, agreement, photograph, write_jpeg};
use twin::{Renderer, Scene, StationModel, StationShape, poses::board_poses};
use vision::{CameraImage, CentrelineParams, Channel, find_centrelines};

const WIDTH: usize = 800;
const HEIGHT: usize = 640;
/// Brightness of white paper in daylight, of 255: the laser on it is clipped.
const DAYLIGHT: f64 = 150.0;
/// Fraction of the lines' columns: lines end where they leave the board and are interrupted by black squares.
const ALL: f64 = 0.95;
/// Points off the lines, as a fraction of all.
const ELSEWHERE: f64 = 0.01;

/// One pose of the board: with the laser on and off, and the ground truth.
struct Pose {
    renderer: Renderer,
    scene: Scene,
}

impl Pose {
    fn new(idx: usize) -> Self {
        let shape = StationShape { width_px: WIDTH, height_px: HEIGHT, ..StationShape::default() };
        let renderer = Renderer::new(&StationModel::seeded(23, &shape).unwrap());
        let scene = Scene::Board(board_poses(renderer.model(), 4).remove(idx));
        Self { renderer, scene }
    }

    fn image(&self, level: f64, laser: [f32; 3], picture: u64) -> image::RgbImage {
        photograph(&self.renderer, &self.scene, level, laser, picture)
    }

    fn picture(&self, level: f64, laser: [f32; 3], picture: u64) -> CameraImage {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photograph.png");
        self.image(level, laser, picture).save(&path).unwrap();
        read_photograph(&path).unwrap().image
    }

    fn compressed(&self, level: f64, quality: u8) -> CameraImage {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("photograph.jpg");
        write_jpeg(&path, &self.image(level, RED_LASER, 1), quality);
        read_photograph(&path).unwrap().image
    }

    fn lines(&self, picture: &CameraImage, channel: Channel) -> Agreement {
        let lines = find_centrelines(&picture.channel(channel), &CentrelineParams::default());
        let points: Vec<_> = lines.segments.iter().flat_map(|segment| segment.points.clone()).collect();
        let truth = self.renderer.truth_points(&self.scene, 0.0);
        let found = agreement(&points, &truth, Vector2::new(WIDTH as f64, HEIGHT as f64));
        println!("{}: {found:.3?}", channel.name());
        found
    }
}

fn auto(picture: &CameraImage) -> Channel {
    LaserChannel::decided(1, |_| Some(picture.clone()), &[CentrelineParams::default()]).channel
}

#[test]
fn a_laser_by_daylight_is_found_in_the_automatically_chosen_channel() {
    for (laser, expected) in [(RED_LASER, Channel::RedMinusOthers), (GREEN_LASER, Channel::GreenMinusOthers)] {
        for idx in 0..4 {
            let pose = Pose::new(idx);
            let picture = pose.picture(DAYLIGHT, laser, 1);
            assert_eq!(auto(&picture), expected, "pose {idx}");
            let found = pose.lines(&picture, expected);
            assert!(found.found >= ALL, "pose {idx}: {found:?}");
            assert!((found.n_elsewhere as f64) < ELSEWHERE * found.n_points as f64, "pose {idx}: {found:?}");
            assert!((0.8..1.25).contains(&found.normalised), "pose {idx}: {found:?}");
            // The result of brightness; otherwise the choice would not matter.
            assert!(pose.lines(&picture, Channel::Luma).found < 0.6, "pose {idx}");
        }
    }
}

#[test]
fn in_the_dark_the_plain_channel_of_the_laser_is_taken() {
    let pose = Pose::new(0);
    for (laser, expected) in [(RED_LASER, Channel::Red), (GREEN_LASER, Channel::Green)] {
        let picture = pose.picture(0.0, laser, 1);
        assert_eq!(auto(&picture), expected);
        assert!(pose.lines(&picture, expected).found >= ALL);
    }
}

#[test]
fn a_grey_laser_image_in_a_colour_file_is_read_as_grey() {
    let pose = Pose::new(0);
    let picture = pose.picture(0.0, [0.0; 3], 1);
    let CameraImage::Colour(_) = &picture else { panic!("every colour has its own noise") };
    // Without any coloured line it is brightness.
    assert_eq!(auto(&picture), Channel::Luma);
}

#[test]
fn with_the_background_subtracted_daylight_does_not_matter() {
    let pose = Pose::new(1);
    let on = pose.picture(DAYLIGHT, RED_LASER, 1);
    let off = pose.picture(DAYLIGHT, [0.0; 3], 2);
    let difference = on.minus(&off).unwrap();
    let channel = auto(&difference);
    let found = pose.lines(&difference, channel);
    assert!(found.found >= ALL && (0.8..1.25).contains(&found.normalised), "{channel:?} {found:?}");
}

#[test]
fn compression_costs_accuracy_that_sigma_does_not_state() {
    let pose = Pose::new(0);
    // JPEG quality, and the highest permitted distance in standard deviations: the reason for the warning about such
    // images.
    for (quality, most) in [(95, 1.6), (90, 1.9), (75, 2.8)] {
        let picture = pose.compressed(0.0, quality);
        let found = pose.lines(&picture, auto(&picture));
        assert!(found.found >= 0.9 && found.normalised < most, "{quality}: {found:?}");
        // Half a pixel would be missing here if the decoder averaged the colours of two by two pixels into one.
        assert!(found.spread_px < 0.4, "{quality}: {found:?}");
    }
}
