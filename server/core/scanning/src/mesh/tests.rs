//! Meshes of synthetic profiles whose surface is known.

use super::*;

/// Frames 0.5 mm apart, a point every 0.2 mm; order m is shifted along the travel by 3 mm per order.
fn scan(orders: &[i8], depth_mm: impl Fn(f64, f64) -> f64, columns: bool) -> Cloud {
    let mut points = Vec::new();
    for frame in 0..40u32 {
        for &order in orders {
            for step in 0..100u32 {
                let along = f64::from(step) * 0.2;
                let across = f64::from(frame) * 0.5 + f64::from(order) * 3.0;
                let (x_mm, y_mm) = if columns { (across, along) } else { (along, across) };
                let (u_px, v_px) = ((x_mm * 6.0 + 100.0) as f32, (y_mm * 6.0 + 100.0) as f32);
                let z_mm = depth_mm(x_mm, y_mm);
                let sigma_mm = 0.03 + 0.001 * f32::from(order.unsigned_abs());
                points.push(CloudPoint { x_mm, y_mm, z_mm, order, frame, u_px, v_px, intensity: 100.0, sigma_mm });
            }
        }
    }
    Cloud { points, comments: vec!["units mm".into()] }
}

fn area_mm2(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|t| mesh.area_normal(t).norm() / 2.0).sum()
}

#[test]
fn one_order_gives_one_closed_layer_facing_the_camera() {
    for columns in [false, true] {
        let mesh = mesh_from_cloud(&scan(&[0], |_, _| 400.0, columns), &MeshParams::default());
        assert_eq!(mesh.vertices_mm.len(), 4000);
        assert_eq!(mesh.triangles.len(), 39 * 99 * 2);
        assert!((area_mm2(&mesh) - 19.5 * 19.8).abs() < 1e-9);
        assert!(mesh.triangles.iter().all(|t| mesh.triangle_normal(t)[2] < -0.999));
        assert!(mesh.vertex_normals().iter().all(|normal| normal[2] < -0.999));
    }
}

#[test]
fn several_orders_give_one_layer() {
    let mesh = mesh_from_cloud(&scan(&[-2, -1, 0, 1, 2], |_, _| 400.0, false), &MeshParams::default());
    // Travel covers −6 … 25.5 mm; four seams may each gain or lose one frame step of 0.5 mm.
    let whole = 31.5 * 19.8;
    assert!((area_mm2(&mesh) - whole).abs() < 4.0 * 0.5 * 19.8, "{} of {whole}", area_mm2(&mesh));
    assert!(area_mm2(&mesh) > 0.95 * whole);
}

#[test]
fn a_step_interrupts_the_mesh_and_a_slope_does_not() {
    let step = |x: f64, _: f64| if x < 10.05 { 400.0 } else { 391.1 };
    let mesh = mesh_from_cloud(&scan(&[0], step, false), &MeshParams::default());
    let spans = |t: &[u32; 3]| {
        let depths = t.map(|idx| mesh.vertices_mm[idx as usize][2]);
        depths[0] != depths[1] || depths[1] != depths[2]
    };
    assert!(!mesh.triangles.iter().any(spans));
    assert_eq!(mesh.triangles.len(), 39 * 98 * 2);
    let slope = mesh_from_cloud(&scan(&[0], |x, y| 400.0 + 2.0 * x - y, false), &MeshParams::default());
    assert_eq!(slope.triangles.len(), 39 * 99 * 2);
}

#[test]
fn profiles_that_jump_across_the_line_stay_aligned() {
    // On a block the line is displaced by 4 mm across, and one frame is displaced where its neighbour is not.
    let mut cloud = scan(&[0], |_, _| 400.0, false);
    for point in &mut cloud.points {
        let end_mm = 10.0 + 0.3 * f64::from(point.frame % 3);
        if (6.0..end_mm).contains(&point.x_mm) {
            point.y_mm -= 4.0;
            point.z_mm -= 8.9;
        }
    }
    let mesh = mesh_from_cloud(&cloud, &MeshParams::default());
    let beyond = mesh.triangles.iter().filter(|t| t.iter().all(|&idx| mesh.vertices_mm[idx as usize][0] > 11.0));
    // From x = 11.2 to 19.8 mm: 43 steps of two triangles between 40 frames.
    assert_eq!(beyond.count(), 39 * 43 * 2);
}

#[test]
fn clouds_without_neighbours_give_an_empty_mesh() {
    assert!(mesh_from_cloud(&Cloud::default(), &MeshParams::default()).triangles.is_empty());
    let mut single = scan(&[0], |_, _| 400.0, false);
    single.points.truncate(100);
    assert!(mesh_from_cloud(&single, &MeshParams::default()).triangles.is_empty());
}
