//! Time the simulated sensor takes per image, on one thread.
//!
//! `cargo run --release -p sheaf-twin --example frames_per_second [SCENE [laser|moving|still]]`: all scenes, or one for
//! a profiler.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;

use twin::poses::board_poses;
use twin::{Exposure, ExposureBuffers, Renderer, Scene, SceneKind, Solid, StationModel, StationShape};
use vision::{GreyImage, Pixels};

/// Images per row of the table.
const N_FRAMES: u32 = 40;

/// Squares along each side of the wavy part: 2 · 158² triangles are 50 thousand.
const SQUARES: usize = 158;

/// Side of the wavy part, mm.
const SIDE_MM: f64 = 120.0;

fn main() {
    let model = StationModel::seeded(7, &StationShape::default()).expect("the default station exists");
    let renderer = Renderer::new(&model);
    let solid = Solid::new(&waves()).expect("waves are a part");
    let mut scenes = vec![("mesh, 50 k triangles", Scene::mesh(Arc::new(solid), &model, 1))];
    for (name, kind) in [
        ("plate", SceneKind::Plate),
        ("gauge", SceneKind::Gauge { height_mm: 8.9 }),
        ("sphere", SceneKind::Sphere { radius_mm: 18.9 }),
        ("freeform", SceneKind::Freeform),
    ] {
        scenes.push((name, kind.placed(&model, 1)));
    }
    scenes.push(("board", Scene::Board(board_poses(&model, 1).remove(0))));
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let requested =
        |idx: usize, name: &str| wanted.get(idx).is_none_or(|wanted| name.starts_with(wanted.as_str()));
    println!("1280×1024, one thread; ms of computing per frame (and of waiting)\n");
    println!("{:<22} {:>16} {:>22} {:>18}", "scene", "laser", "ambient, stage moves", "ambient, at rest");
    for (name, scene) in scenes.iter().filter(|(name, _)| requested(0, name)) {
        let column = |light: &str, laser: bool, step_mm: f64| {
            if requested(1, light) { measured(&renderer, scene, laser, step_mm) } else { "-".to_owned() }
        };
        let (laser, moving) = (column("laser", true, 0.4), column("moving", false, 0.4));
        println!("{name:<22} {laser:>16} {moving:>22} {:>18}", column("still", false, 0.0));
    }
}

fn measured(renderer: &Renderer, scene: &Scene, laser: bool, step_mm: f64) -> String {
    let mut buffers = ExposureBuffers::default();
    let mut image = GreyImage::new(1, 1, Pixels::Eight(vec![0])).expect("one pixel is an image");
    let mut take = |image_number: u32| {
        let exposure = Exposure {
            scene,
            position: -8.0 + step_mm * f64::from(image_number),
            ambient_level: if laser { 0.0 } else { twin::params::BOARD_WHITE_LEVEL },
            ambient_exposure: 1.0,
            laser_exposure: if laser { 1.0 } else { 0.0 },
            gain: 1.0,
            bits: 8,
            image_number: u64::from(image_number),
        };
        renderer.expose(&exposure, &mut buffers, &mut image);
    };
    take(0);
    let n_frames = if laser || step_mm == 0.0 { N_FRAMES } else { N_FRAMES / 8 };
    let (began, computed) = (Instant::now(), computed_ns());
    (1..=n_frames).for_each(&mut take);
    let wall_ms = began.elapsed().as_secs_f64() * 1e3 / f64::from(n_frames);
    match computed.zip(computed_ns()) {
        Some((from, to)) => format!("{:.1} ({wall_ms:.1})", (to - from) as f64 / 1e6 / f64::from(n_frames)),
        None => format!("({wall_ms:.1})"),
    }
}

/// Processor time of this thread, where the system reports it; excludes other programs.
fn computed_ns() -> Option<u64> {
    std::fs::read_to_string("/proc/thread-self/schedstat").ok()?.split_whitespace().next()?.parse().ok()
}

fn waves() -> Vec<[[f64; 3]; 3]> {
    let at = |i: usize, j: usize| {
        let (x, y) = (SIDE_MM * i as f64 / SQUARES as f64, SIDE_MM * j as f64 / SQUARES as f64);
        [x, y, 8.0 + 4.0 * (TAU * x / 40.0).sin() * (TAU * y / 60.0).cos()]
    };
    let squares = (0..SQUARES).flat_map(|i| (0..SQUARES).map(move |j| (i, j)));
    squares
        .flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        .collect()
}
