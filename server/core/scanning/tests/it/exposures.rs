//! Lines of a plate, one half of which is forty times darker than the other, from a short and a long exposure, compared
//! with the truth.

use std::collections::HashMap;

use scanning::{ExposureLines, fuse_exposures};
use twin::{Exposure, ExposureBuffers, Renderer, Scene, SceneKind, StationModel, StationShape};
use vision::{CentrelineParams, Centrelines, GreyImage, Pixels, find_centrelines};

/// Ratio of the brightness of the two halves.
const DARKER: f64 = 40.0;

/// Exposures relative to the nominal one: the bright half is unsaturated in the short one, and saturated in the long
/// one.
const SHARES: [f64; 2] = [0.7, 14.0];

/// Largest distance, px, of a point from the true line it is on.
const ON_LINE_PX: f64 = 2.5;

/// The lines of a part whose right half is [`DARKER`] times darker than its left one: an image is linear in
/// reflectance.
fn lines_of(renderer: &Renderer, scene: &Scene, laser_share: f64, image_idx: u64) -> Centrelines {
    let [bright, dark] = [1.0, 1.0 / DARKER].map(|reflectance| {
        let exposure = Exposure {
            scene,
            position: 0.0,
            ambient_level: 0.0,
            ambient_exposure: 0.0,
            laser_exposure: (laser_share * reflectance) as f32,
            gain: 1.0,
            bits: 8,
            image_number: image_idx,
        };
        let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).unwrap();
        renderer.expose(&exposure, &mut ExposureBuffers::default(), &mut image);
        image
    });
    let (Pixels::Eight(bright), Pixels::Eight(dark)) = (bright.pixels(), dark.pixels()) else { panic!("8 bits") };
    let camera = &renderer.model().camera;
    let rows = bright.chunks(camera.width_px).zip(dark.chunks(camera.width_px));
    let half = camera.width_px / 2;
    let pixels = rows.flat_map(|(bright, dark)| bright[..half].iter().chain(&dark[half..])).copied().collect();
    let image = GreyImage::new(camera.width_px, camera.height_px, Pixels::Eight(pixels)).unwrap();
    find_centrelines(&image, &CentrelineParams::default())
}

/// Comparison of points with true lines.
#[derive(Debug, Default)]
struct Comparison {
    n_true: usize,
    /// True points with an unsaturated point.
    n_found: usize,
    /// Errors in units of their own σ, and errors, px.
    in_sigmas: Vec<f64>,
    errors_px: Vec<f64>,
}

impl Comparison {
    fn add(&mut self, lines: &Centrelines, truth: &[twin::TruthPoint]) {
        let mut by_column: HashMap<i64, Vec<&vision::CentrelinePoint>> = HashMap::new();
        for point in lines.segments.iter().flat_map(|segment| &segment.points) {
            by_column.entry(point.u_px.round() as i64).or_default().push(point);
        }
        for of in truth {
            self.n_true += 1;
            let apart = |point: &vision::CentrelinePoint| {
                (point.v_px - of.v_px) * point.normal[1] + (point.u_px - of.u_px) * point.normal[0]
            };
            let near = by_column.get(&(of.u_px as i64)).into_iter().flatten();
            let nearest = near.min_by(|a, b| apart(a).abs().total_cmp(&apart(b).abs()));
            let Some(point) = nearest.filter(|point| apart(point).abs() < ON_LINE_PX && !point.saturated) else {
                continue;
            };
            self.n_found += 1;
            self.errors_px.push(apart(point));
            self.in_sigmas.push(apart(point) / point.sigma_px);
        }
    }

    fn recovered(&self) -> f64 {
        self.n_found as f64 / self.n_true as f64
    }

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }
}

#[test]
fn bright_and_dark_halves_are_both_measured_and_sigma_matches_the_errors() {
    let shape = StationShape { width_px: 640, height_px: 512, ..StationShape::default() };
    let model = StationModel::seeded(7, &shape).unwrap();
    let renderer = Renderer::new(&model);
    let mut held: [Comparison; 3] = Default::default();
    let mut counts = scanning::FusionCounts::default();
    for image_idx in 0..4 {
        let scene = SceneKind::Plate.placed(&model, 0x300 + image_idx);
        let truth = renderer.truth_points(&scene, 0.0);
        let alone = SHARES.map(|share| lines_of(&renderer, &scene, share, image_idx * 10 + (10.0 * share) as u64));
        let exposed: Vec<ExposureLines> = SHARES
            .iter()
            .zip(&alone)
            .map(|(share, centrelines)| ExposureLines { exposure_us: share * 1000.0, centrelines })
            .collect();
        let (fused, of_frame) = fuse_exposures(&exposed);
        counts.add(&of_frame);
        for (held, lines) in held.iter_mut().zip([&alone[0], &alone[1], &fused]) {
            held.add(lines, &truth);
        }
    }
    let [short, long, fused] = held;
    // Each exposure alone measures its half; the fused lines miss only the seam between the halves.
    assert!(short.recovered() < 0.55 && long.recovered() < 0.55, "{} {}", short.recovered(), long.recovered());
    assert!(fused.recovered() > 0.96, "{}", fused.recovered());
    // σ of some ten thousand points whose noise is correlated over a few columns.
    let in_sigmas = Comparison::rms(&fused.in_sigmas);
    assert!((0.85..1.15).contains(&in_sigmas), "{in_sigmas}");
    // No point is worse than those of its own exposure.
    let [fused_px, worst_px] = [
        Comparison::rms(&fused.errors_px),
        Comparison::rms(&short.errors_px).max(Comparison::rms(&long.errors_px)),
    ];
    assert!(fused_px <= worst_px, "{fused_px} px, {worst_px} px");
    assert!(2 * counts.n_replaced > counts.n_points, "{counts:?}");
    assert!(100 * counts.n_disagreeing < counts.n_points, "{counts:?}");
}
