//! Stations of many kinds can be built, repeat exactly, and agree with the reference data's conventions.

use std::path::PathBuf;

use capture::{ChessboardTarget, Target};
use nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3};
use optics::{Camera, Grating, LightSurfaces};
use serde_json::Value;
use twin::poses::{board_poses, stage_board};
use twin::{Board, ProjectorShape, Renderer, Scene, SceneKind, StationError, StationModel, StationShape};
use vision::{CentrelineParams, GreyImage, LineDirection, find_centrelines};

fn small() -> StationShape {
    StationShape { width_px: 192, height_px: 160, ..StationShape::default() }
}

#[test]
fn the_same_seed_gives_the_same_bytes_for_any_number_of_threads() {
    let images = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let renderer = Renderer::new(&StationModel::seeded(3, &small()).unwrap());
            let part = SceneKind::Freeform.placed(renderer.model(), 1);
            let board = Scene::Board(board_poses(renderer.model(), 1).remove(0));
            [renderer.laser_image(&part, 1.0, 5), renderer.board_image(&board, 0.0, 6)]
        })
    };
    assert_eq!(images(1), images(3));
}

#[test]
fn other_seeds_and_other_frames_give_other_images() {
    let [a, b] = [3, 4].map(|seed| Renderer::new(&StationModel::seeded(seed, &small()).unwrap()));
    let part = SceneKind::Plate.placed(a.model(), 1);
    assert_ne!(a.laser_image(&part, 0.0, 0), b.laser_image(&part, 0.0, 0));
    assert_ne!(a.laser_image(&part, 0.0, 0), a.laser_image(&part, 0.0, 1));
    assert_ne!(a.model().grating, b.model().grating);
}

#[test]
fn speckle_belongs_to_the_surface_and_has_its_contrast_in_the_image() {
    // A ridge 2 px wide averages little; the sensor's noise adds under 2 % at half scale.
    let shape = StationShape { width_px: 640, height_px: 160, line_peak: 0.4, ..StationShape::default() };
    let shape = StationShape { orders: vec![0], ..shape };
    let renderer = Renderer::new(&StationModel::seeded(5, &shape).unwrap());
    let part = SceneKind::Plate.placed(renderer.model(), 1);
    let ridge = |image_number: u64, position_mm: f64| -> Vec<f64> {
        let image = renderer.laser_image(&part, position_mm, image_number);
        let at =
            |p: &twin::TruthPoint| f64::from(image.at(p.u_px.round() as usize, p.v_px.round() as usize)) - 3.0;
        renderer.truth_points(&part, position_mm).iter().map(at).collect()
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let covariance = |x: &[f64], y: &[f64]| {
        let (mean_x, mean_y) = (mean(x), mean(y));
        x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum::<f64>() / x.len().min(y.len()) as f64
    };
    let first = ridge(0, 0.0);
    let contrast = covariance(&first, &first).sqrt() / mean(&first);
    assert!((0.25..0.36).contains(&contrast), "{contrast}");
    let correlation = |image_number: u64, position_mm: f64| {
        let other = ridge(image_number, position_mm);
        covariance(&first, &other) / (covariance(&first, &first) * covariance(&other, &other)).sqrt()
    };
    // Another image at the same position: only the sensor's noise differs.
    assert!(correlation(1, 0.0) > 0.97, "{}", correlation(1, 0.0));
    // A step much shorter than the sheet's thickness (some 0.6 mm here), and one much longer; 640 columns contain some
    // 400 grains: 3σ of a chance correlation is 0.15.
    assert!(correlation(1, 0.1) > 0.85, "{}", correlation(1, 0.1));
    assert!(correlation(1, 10.0).abs() < 0.15, "{}", correlation(1, 10.0));
}

#[test]
fn stations_of_every_kind_can_be_built_and_show_all_their_orders() {
    let nine = (-4..=4).collect::<Vec<i8>>();
    let kinds = [
        StationShape { orders: vec![-1, 0, 1], wavelength_nm: 450.0, ..small() },
        StationShape { orders: nine, lines_per_mm: 30.0, ..small() },
        StationShape { orders: vec![3, 1, 2], field_half_width_mm: 170.0, ..small() },
        StationShape { orders: vec![0, -1, 1], field_half_width_mm: 15.0, lines_per_mm: 12.0, ..small() },
        StationShape { line_direction: LineDirection::Columns, grating_tilt_rad: 0.052, ..small() },
        StationShape { width_px: 2448, height_px: 2048, standoff_mm: 600.0, ..StationShape::default() },
    ];
    for (seed, shape) in kinds.iter().enumerate() {
        let model = StationModel::seeded(seed as u64, shape).unwrap();
        let renderer = Renderer::without_noise(&model);
        let points = renderer.truth_points(&SceneKind::Plate.placed(&model, 1), 0.0);
        let across = |order: i8| {
            let of_order: Vec<f64> = points
                .iter()
                .filter(|p| p.order == order)
                .map(|p| if shape.line_direction == LineDirection::Rows { p.v_px } else { p.u_px })
                .collect();
            of_order.iter().sum::<f64>() / of_order.len() as f64
        };
        let places: Vec<f64> = model.orders.iter().map(|&order| across(order)).collect();
        assert!(places.windows(2).all(|pair| pair[0] < pair[1]), "{shape:?}: {places:?}");
    }
}

#[test]
fn orders_outside_the_image_are_refused_by_name() {
    let narrow = StationShape { field_half_width_mm: 15.0, ..small() };
    let error = StationModel::seeded(1, &narrow).unwrap_err();
    assert!(matches!(&error, StationError::OutOfView { orders, .. } if orders == &[-2, -1, 1, 2]), "{error}");
    let twice = StationShape { orders: vec![0, 0], ..small() };
    assert!(matches!(StationModel::seeded(1, &twice), Err(StationError::Orders { .. })));
    let dark = StationShape { wavelength_nm: f64::NAN, ..small() };
    assert!(matches!(StationModel::seeded(1, &dark), Err(StationError::OutOfRange { name: "wavelength_nm", .. })));
}

#[test]
fn poses_tilt_in_all_directions_and_stay_within_the_image() {
    for (seed, field_half_width_mm) in [(1, 15.0), (2, 101.7), (3, 170.0)] {
        for line_direction in [LineDirection::Rows, LineDirection::Columns] {
            let orders = vec![0];
            let shape = StationShape { field_half_width_mm, line_direction, orders, ..StationShape::default() };
            let model = StationModel::seeded(seed, &shape).unwrap();
            let poses = board_poses(&model, 12);
            let inside = |point: &Vector3<f64>| {
                let pixel = model.camera.project(point).unwrap();
                (5.0..1274.0).contains(&pixel.x) && (5.0..1018.0).contains(&pixel.y)
            };
            let corners = |board: &Board| [(0, 0), (10, 0), (0, 7), (10, 7)].map(|(c, r)| board.corner_mm(c, r));
            assert!(poses.iter().all(|board| corners(board).iter().all(inside)));
            let scale = shape.field_scale();
            let positions = [-20.0 * scale, 20.0 * scale];
            let stage = stage_board(&model, &positions);
            for position in positions {
                assert!(corners(&stage.turned(&model.motion(position))).iter().all(inside));
            }
            // Tilt about x and about y, to both sides, by more than 10° somewhere.
            for axis in 0..2 {
                let lean: Vec<f64> = poses.iter().map(|board| board.axes[(axis, 2)]).collect();
                assert!(lean.iter().any(|l| *l > 0.17) && lean.iter().any(|l| *l < -0.17), "{lean:?}");
            }
            let depths: Vec<f64> = poses.iter().map(|board| board.centre_mm.z).collect();
            let spread =
                depths.iter().fold(f64::MIN, |a, b| a.max(*b)) - depths.iter().fold(f64::MAX, |a, b| a.min(*b));
            assert!(spread > 30.0, "{spread}");
        }
    }
}

/// The reference station's truth, if this machine has it.
fn rig_a() -> Option<(PathBuf, Value)> {
    let folder = reference::data("rig-a")?;
    let text = std::fs::read_to_string(folder.join("truth.json")).unwrap();
    Some((folder, serde_json::from_str(&text).unwrap()))
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap(), value[2].as_f64().unwrap())
}

/// The twin with the reference station's truth.
fn reference_model(truth: &Value) -> StationModel {
    let number = |value: &Value| value.as_f64().unwrap();
    let k: Vec<f64> = truth["K"].as_array().unwrap().iter().map(number).collect();
    let distortion: Vec<f64> = truth["dist"].as_array().unwrap().iter().map(number).collect();
    let camera =
        Camera::from_opencv(1280, 1024, [[k[0], 0.0, k[2]], [0.0, k[1], k[3]], [0.0, 0.0, 1.0]], &distortion);
    let grating = Grating {
        source_mm: vector(&truth["S"]),
        axis: vector(&truth["axis"]),
        fan: vector(&truth["fan"]),
        normal: vector(&truth["normal"]),
        groove: vector(&truth["groove"]),
        gap_mm: number(&truth["gap"]),
        wavelength_over_period: 0.033,
    };
    let model = StationModel::seeded(1, &StationShape::default()).unwrap();
    StationModel { camera, grating, ..model }
}

#[test]
fn the_reference_pixels_lie_on_the_sheets_of_the_twin() {
    let Some((folder, truth)) = rig_a() else { return };
    let model = reference_model(&truth);
    let table = std::fs::read_to_string(folder.join("truth-sphere.csv")).unwrap();
    for row in table.lines().skip(1) {
        let values: Vec<f64> = row.split(',').map(|word| word.parse().unwrap()).collect();
        let ray = model.camera.ray_from_pixel(&Vector2::new(values[2], values[3])).unwrap();
        let hit = LightSurfaces::Grating(model.grating).hit(values[1] as i8, &ray, None).unwrap();
        // The table is rounded to 1e-5 px and mm; 1 px is 0.4 mm of depth.
        assert!((ray * hit.depth_mm - Vector3::new(values[4], values[5], values[6])).norm() < 3e-5, "{row}");
    }
}

#[test]
fn the_reference_boards_are_rendered_where_the_reference_shows_them() {
    // The mean of 88 corners, each shifted by 0.0065 px by image noise: 3σ is 0.002 px.
    const TOLERANCE_PX: f64 = 0.0025;
    let Some((folder, truth)) = rig_a() else { return };
    let renderer = Renderer::without_noise(&reference_model(&truth));
    let target = Target::from(ChessboardTarget { inner_columns: 11, inner_rows: 8, square_mm: 12.0.into() });
    for idx in [0, 3] {
        let rotation = &truth[format!("pose{idx}_R")];
        let board = Board {
            axes: Matrix3::from_rows(&[0, 1, 2].map(|row| vector(&rotation[row]).transpose())),
            centre_mm: vector(&truth[format!("pose{idx}_c")]),
            backdrop_z_mm: 600.0,
            ..Board::of(&target)
        };
        let ours = renderer.board_image(&Scene::Board(board.clone()), 0.0, 0);
        let theirs = capture::read_grey_image(&folder.join(format!("board/{idx:03}.png"))).unwrap();
        let corners: Vec<Vector2<f64>> = (0..11)
            .flat_map(|column| (0..8).map(move |row| (column, row)))
            .map(|(column, row)| renderer.model().camera.project(&board.corner_mm(column, row)).unwrap())
            .collect();
        let shifts = corners.iter().map(|corner| shift_px(&ours, &theirs, corner));
        let mean = shifts.sum::<Vector2<f64>>() / corners.len() as f64;
        eprintln!("pose {idx}: ({:.4}, {:.4}) px", mean.x, mean.y);
        assert!(mean.amax() < TOLERANCE_PX, "pose {idx}: {mean}");
    }
}

/// Shift of `b` against `a` around a corner, from their difference along the gradient (least squares; gain and offset
/// free and varying across the window).
fn shift_px(a: &GreyImage, b: &GreyImage, corner: &Vector2<f64>) -> Vector2<f64> {
    const HALF_PX: i64 = 9;
    let mut normal = SMatrix::<f64, 8, 8>::zeros();
    let mut right = SVector::<f64, 8>::zeros();
    for (x, y) in (-HALF_PX..=HALF_PX).flat_map(|y| (-HALF_PX..=HALF_PX).map(move |x| (x, y))) {
        let (u, v) = ((corner.x.round() as i64 + x) as usize, (corner.y.round() as i64 + y) as usize);
        let level = |u: usize, v: usize| f64::from(a.at(u, v));
        let slope_u = (level(u + 1, v) - level(u - 1, v)) / 2.0;
        let slope_v = (level(u, v + 1) - level(u, v - 1)) / 2.0;
        let (x, y, here) = (x as f64, y as f64, level(u, v));
        let row = SVector::<f64, 8>::from([-slope_u, -slope_v, here, 1.0, x * here, y * here, x, y]);
        normal += row * row.transpose();
        right += row * f64::from(b.at(u, v));
    }
    (normal.try_inverse().unwrap() * right).fixed_rows::<2>(0).into()
}

#[test]
fn independent_lasers_make_one_plane_each_across_the_lines_direction() {
    for (line_direction, lines) in
        [(LineDirection::Rows, 1), (LineDirection::Rows, 2), (LineDirection::Columns, 3)]
    {
        let size = StationShape { width_px: 640, height_px: 512, ..StationShape::default() };
        let shape = StationShape { projector: ProjectorShape::Lasers { lines }, line_direction, ..size };
        let model = StationModel::seeded(3, &shape).unwrap();
        let numbers: Vec<i8> = (0..).take(lines).collect();
        assert_eq!((model.orders.clone(), model.lasers.len()), (numbers, lines));
        let renderer = Renderer::without_noise(&model);
        let scene = SceneKind::Sphere { radius_mm: 18.9 }.placed(&model, 1);
        let points = renderer.truth_points(&scene, 2.0);
        let image = renderer.laser_image(&scene, 2.0, 0);
        let found = find_centrelines(&image, &CentrelineParams { line_direction, ..Default::default() });
        let n_found: usize = found.segments.iter().map(|segment| segment.points.len()).sum();
        assert!(n_found as f64 > 0.95 * points.len() as f64, "{n_found} of {}", points.len());
        for line in &model.orders {
            let laser = &model.lasers[*line as usize];
            let normal = laser.axis.cross(&laser.fan);
            let of_line: Vec<_> = points.iter().filter(|point| point.order == *line).collect();
            assert!(of_line.len() > 200, "line {line}: {}", of_line.len());
            for point in of_line {
                let off_mm = normal.dot(&(point.hit_in_camera_mm - laser.source_mm));
                assert!(off_mm.abs() < 1e-9, "line {line}: {off_mm} mm off its plane");
            }
        }
    }
    let none = StationShape { projector: ProjectorShape::Lasers { lines: 0 }, ..small() };
    assert!(matches!(StationModel::seeded(3, &none), Err(StationError::OutOfRange { name: "lines", .. })));
}
