//! Images agree with the truth: lines, edges, shadows, in raw pixels whose centres are whole numbers.
//!
//! Positions are measured here by areas (centroids, integrals across an edge), independently of the renderer. Not
//! covered: that real speckle, lenses and paint behave so.

use nalgebra::Vector3;
use optics::LightSurfaces;
use twin::{Renderer, Scene, SceneKind, StationModel, StationShape, TruthPoint, poses::board_poses};
use vision::{GreyImage, LineDirection};

/// A small, deep station: 16 bits, so that rounding to grey levels stays below the tolerances.
fn shape() -> StationShape {
    StationShape { width_px: 320, height_px: 256, bits: 16, line_sigma_px: 1.6, ..StationShape::default() }
}

fn renderer(shape: &StationShape) -> Renderer {
    Renderer::without_noise(&StationModel::seeded(11, shape).unwrap())
}

/// Centroid across the line around a truth point, above the darkest level of the window.
fn centroid_error_px(image: &GreyImage, point: &TruthPoint, direction: LineDirection) -> Option<f64> {
    const HALF_PX: i64 = 8;
    let (along, across) = match direction {
        LineDirection::Rows => (point.u_px, point.v_px),
        LineDirection::Columns => (point.v_px, point.u_px),
    };
    let centre = across.round() as i64;
    let size = if direction == LineDirection::Rows { image.height() } else { image.width() } as i64;
    if centre < HALF_PX || centre + HALF_PX >= size {
        return None;
    }
    let level = |offset: i64| {
        let (a, b) = (along.round() as usize, (centre + offset) as usize);
        f64::from(if direction == LineDirection::Rows { image.at(a, b) } else { image.at(b, a) })
    };
    let dark = (-HALF_PX..=HALF_PX).map(level).fold(f64::INFINITY, f64::min);
    let sum: f64 = (-HALF_PX..=HALF_PX).map(|k| level(k) - dark).sum();
    let moment: f64 = (-HALF_PX..=HALF_PX).map(|k| (level(k) - dark) * k as f64).sum();
    Some(centre as f64 + moment / sum - across)
}

#[test]
fn the_centroid_of_a_line_on_a_plate_is_the_true_centre() {
    // A sheet of even thickness looks thicker on its near side: at a focal length of 1 260 px the centroid of a line of
    // 1.6 px is biased by 0.002 px. Lens blur extends the image border, which shifts slanted lines by 0.01 px in the
    // outermost columns; these are left out.
    const TOLERANCE_PX: f64 = 0.003;
    const BORDER_PX: f64 = 4.0;
    for line_direction in [LineDirection::Rows, LineDirection::Columns] {
        let renderer = renderer(&StationShape { line_direction, width_px: 640, height_px: 512, ..shape() });
        let scene = SceneKind::Plate.placed(renderer.model(), 1);
        let image = renderer.laser_image(&scene, 3.0, 0);
        let points = renderer.truth_points(&scene, 3.0);
        let columns = if line_direction == LineDirection::Rows { 640 } else { 512 };
        let inner = |point: &&TruthPoint| {
            let along = if line_direction == LineDirection::Rows { point.u_px } else { point.v_px };
            (BORDER_PX..columns as f64 - BORDER_PX).contains(&along)
        };
        let inner_points = points.iter().filter(inner);
        let errors: Vec<f64> =
            inner_points.filter_map(|point| centroid_error_px(&image, point, line_direction)).collect();
        assert!(errors.len() > 5 * columns * 9 / 10, "{} columns visible", errors.len());
        let worst = errors.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        assert!(worst < TOLERANCE_PX, "{line_direction:?}: {worst}");
    }
}

#[test]
fn edges_of_the_target_lie_where_they_project() {
    // Single edges: the curvature of the light and of the lens within 15 px.
    const EDGE_TOLERANCE_PX: f64 = 0.003;
    const MEAN_TOLERANCE_PX: f64 = 0.0002;
    const HALF_PX: i64 = 7;
    let renderer = renderer(&StationShape { width_px: 640, height_px: 512, ..shape() });
    let camera = renderer.model().camera;
    let mut errors: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
    for board in board_poses(renderer.model(), 4) {
        let image = renderer.board_image(&Scene::Board(board.clone()), 0.0, 0);
        for (axis, errors) in errors.iter_mut().enumerate() {
            for (column, row) in (0..10).flat_map(|column| (0..7).map(move |row| (column, row))) {
                // The edge from this corner to the next along the board's other axis, crossed along u (v).
                let next = if axis == 0 { (column, row + 1) } else { (column + 1, row) };
                let (from, to) = (board.corner_mm(column, row), board.corner_mm(next.0, next.1));
                let on_edge = |fraction: f64| camera.project(&(from + (to - from) * fraction)).unwrap();
                let line = on_edge(0.5)[1 - axis].round();
                // Newton steps to the crossing of the edge, bent by the lens, with that row (column) of pixels.
                let fraction = (0..5).fold(0.5, |fraction, _| {
                    let (here, ahead) = (on_edge(fraction), on_edge(fraction + 1e-4));
                    fraction + 1e-4 * (line - here[1 - axis]) / (ahead[1 - axis] - here[1 - axis])
                });
                let across = on_edge(fraction)[axis];
                let level = |offset: i64| {
                    let at = (across.round() as i64 + offset) as usize;
                    f64::from(if axis == 0 { image.at(at, line as usize) } else { image.at(line as usize, at) })
                };
                // Both sides are extrapolated as straight lines, because the light changes across the image.
                let line_through = |a: i64, b: i64| {
                    let slope = (level(b) - level(a)) / (b - a) as f64;
                    move |k: i64, at_a: f64| at_a + slope * (k - a) as f64
                };
                let (low, high) = (line_through(-HALF_PX, 2 - HALF_PX), line_through(HALF_PX, HALF_PX - 2));
                let (at_low, at_high) = (level(-HALF_PX), level(HALF_PX));
                let fraction = |k: i64| (high(k, at_high) - level(k)) / (high(k, at_high) - low(k, at_low));
                let area: f64 = (-HALF_PX..=HALF_PX).map(fraction).sum();
                errors.push(across.round() - HALF_PX as f64 - 0.5 + area - across);
            }
        }
    }
    for errors in errors {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let worst = errors.iter().fold(0.0_f64, |worst, error| worst.max(error.abs()));
        assert!(mean.abs() < MEAN_TOLERANCE_PX && worst < EDGE_TOLERANCE_PX, "mean {mean}, worst {worst}");
    }
}

#[test]
fn truth_lies_on_the_sheets_and_on_the_part() {
    let renderer = renderer(&shape());
    let model = renderer.model().clone();
    let (gauge, position_mm) = (SceneKind::Gauge { height_mm: 8.9 }.placed(&model, 1), 2.0);
    let Scene::Gauge(block) = &gauge else { panic!("a gauge was requested") };
    let mut on_top = 0;
    for point in renderer.truth_points(&gauge, position_mm) {
        let pixel = nalgebra::Vector2::new(point.u_px, point.v_px);
        let ray = model.camera.ray_from_pixel(&pixel).unwrap();
        let hit = LightSurfaces::Grating(model.grating).hit(point.order, &ray, None).unwrap();
        assert!((ray * hit.depth_mm - point.hit_in_camera_mm).norm() < 1e-7);
        let on_stage = point.hit_in_camera_mm - *model.motion(position_mm).shift_mm();
        let height = block.plate.normal().dot(&(on_stage - block.plate.point_mm));
        let top = (height - 8.9).abs() < 1e-9;
        on_top += usize::from(top);
        let at_side = (0.0..8.9).contains(&height);
        assert!(top || height.abs() < 1e-9 || at_side, "{height}");
    }
    assert!(on_top > 20, "{on_top} points on the block");
}

#[test]
fn the_plate_behind_a_block_lies_in_shadow() {
    // Lens blur and rounding leave less than this of a line's light two pixels inside a shadow.
    const LEAK: f32 = 0.05;
    let renderer = renderer(&StationShape { width_px: 640, height_px: 512, ..shape() });
    let block = SceneKind::Gauge { height_mm: 8.9 }.placed(renderer.model(), 1);
    let plate = SceneKind::Plate.placed(renderer.model(), 1);
    let mut in_shadow = 0;
    for position_mm in [-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0] {
        let from = -*renderer.model().motion(position_mm).shift_mm();
        let lit = renderer.truth_points(&block, position_mm);
        let (with_block, bare) =
            (renderer.laser_image(&block, position_mm, 0), renderer.laser_image(&plate, position_mm, 0));
        for point in renderer.truth_points(&plate, position_mm) {
            // The camera still sees the plate there, but no light of this order arrives nearby.
            let ray = point.hit_in_camera_mm / point.hit_in_camera_mm.z;
            let ray_length = |scene: &Scene| scene.hit(&from, &ray).unwrap().ray_length;
            let near = |p: &TruthPoint| (p.u_px - point.u_px).abs() < 4.0 && (p.v_px - point.v_px).abs() < 8.0;
            let dark = !lit.iter().any(|p| p.order == point.order && near(p));
            if dark && ray_length(&block) == ray_length(&plate) {
                let level = |image: &GreyImage| {
                    image.at(point.u_px.round() as usize, point.v_px.round() as usize)
                        - 257.0 * twin::params::BLACK_LEVEL
                };
                assert!(level(&with_block) < LEAK * level(&bare), "{position_mm} {point:?}");
                in_shadow += 1;
            }
        }
    }
    assert!(in_shadow > 20, "{in_shadow} columns in shadow");
}

#[test]
fn light_that_misses_the_target_falls_on_a_backdrop_far_behind() {
    let renderer = renderer(&shape());
    let board = board_poses(renderer.model(), 1).remove(0);
    let points = renderer.truth_points(&Scene::Board(board.clone()), 0.0);
    let behind = |p: &&TruthPoint| board.axes.column(2).dot(&(p.hit_in_camera_mm - board.centre_mm)) > 1e-6;
    assert!(points.iter().filter(behind).count() > 10);
    for point in points.iter().filter(behind) {
        assert!((point.hit_in_camera_mm.z - board.backdrop_z_mm).abs() < 1e-9);
    }
    let farthest = board.centre_mm.z + 50.0;
    assert!(board.backdrop_z_mm > farthest, "{} {farthest}", board.backdrop_z_mm);
}

#[test]
fn ambient_light_shows_the_target_in_laser_images() {
    let renderer = renderer(&StationShape { ambient_levels: 40.0, ..shape() });
    let board = board_poses(renderer.model(), 1).remove(0);
    let image = renderer.laser_image(&Scene::Board(board.clone()), 0.0, 0);
    let level = |x: f64, y: f64| {
        let at = board.centre_mm + board.axes * Vector3::new(x, y, 0.0) * board.square_mm.x;
        let pixel = renderer.model().camera.project(&at).unwrap();
        image.at(pixel.x.round() as usize, pixel.y.round() as usize) / 257.0
    };
    // Squares far from the lines: the first is black, its neighbour white; 3 levels are the sensor's own.
    assert!(level(-5.5, -4.0) < 15.0 && level(-4.5, -4.0) > 30.0, "{} {}", level(-5.5, -4.0), level(-4.5, -4.0));
}
