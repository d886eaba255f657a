//! Many rays against a ball at once, with the same arithmetic and therefore the same bits as a single ray.

use multiversion::multiversion;
use nalgebra::Vector3;

use crate::params::{PART_REFLECTANCE, SAME_HIT_MM};
use crate::part::scene::{Ball, Sphere};
use crate::render::view::block::Block;
use crate::render::view::lit_pixels::WORD_PX;
use crate::render::view::pixel_hits::PixelHits;

/// Which of the first `n` camera rays pass near the ball ([`Ball::is_near`]), from bit 0.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn rays_near(ball: &Ball, rays: &[Block; 2], n: usize) -> u64 {
    let centre = array(&ball.centre_mm);
    let [x, y] = rays;
    let mut bits = 0;
    for lane in 0..n.min(WORD_PX) {
        bits |= u64::from(is_near(ball.radius_mm, centre, [x[lane], y[lane], 1.0])) << lane;
    }
    bits
}

/// Which of the first `n` shadow rays to the pixel hits pass near the ball ([`Ball::is_near`]), from bit 0.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn shadow_rays_near(ball: &Ball, from: &[Block; 3], to: &PixelHits, n: usize) -> u64 {
    let centre = array(&ball.centre_mm);
    let mut bits = 0;
    for lane in 0..n.min(WORD_PX) {
        let from = [from[0][lane], from[1][lane], from[2][lane]];
        let dir = minus(point(to, lane), from);
        bits |= u64::from(is_near(ball.radius_mm, minus(centre, from), dir)) << lane;
    }
    bits
}

/// Replaces the hits of the pixels `near` of the first `n` by the moved ball where it is nearer.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn cast_ball(ball: &Sphere, moved: &Vector3<f64>, n: usize, near: u64, hits: &mut PixelHits) {
    let to_centre = array(&(ball.centre_mm + moved));
    let PixelHits { rays: [x, y], ray_length, normal: [nx, ny, nz], reflectance, .. } = hits;
    for lane in 0..n.min(WORD_PX) {
        let ray = [x[lane], y[lane], 1.0];
        let (meets, at) = ball_hit(ball.radius_mm, to_centre, ray);
        // Without a plate the value is NaN, and no comparison holds.
        let behind = at > ray_length[lane];
        let first = (near >> lane & 1 == 1) & meets & !behind;
        let normal = [0, 1, 2].map(|axis: usize| (ray[axis] * at - to_centre[axis]) / ball.radius_mm);
        ray_length[lane] = if first { at } else { ray_length[lane] };
        nx[lane] = if first { normal[0] } else { nx[lane] };
        ny[lane] = if first { normal[1] } else { ny[lane] };
        nz[lane] = if first { normal[2] } else { nz[lane] };
        reflectance[lane] = if first { PART_REFLECTANCE } else { reflectance[lane] };
    }
}

/// Which of the first `n` shadow rays to the pixel hits are not blocked by the moved ball or plate
/// ([`crate::part::scene::Scene::reaches`]), from bit 0.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn shadow_rays_past_ball(
    ball: &Sphere,
    moved: &Vector3<f64>,
    from: &[Block; 3],
    to: &PixelHits,
    n: usize,
) -> u64 {
    let (moved, normal) = (array(moved), array(&ball.plate.normal()));
    let (centre, on_plate) = (array(&ball.centre_mm), array(&ball.plate.point_mm));
    let mut bits = 0;
    for lane in 0..n.min(WORD_PX) {
        let from = minus([from[0][lane], from[1][lane], from[2][lane]], moved);
        let dir = minus(minus(point(to, lane), moved), from);
        let length = dot(dir, dir).sqrt();
        let dir = dir.map(|part| part / length);
        let limit = length - SAME_HIT_MM * if length > 1.0 { length } else { 1.0 };
        let plate = dot(normal, minus(on_plate, from)) / dot(normal, dir);
        let meets_plate = (plate > 0.0) & (plate < f64::INFINITY);
        let (meets_ball, at) = ball_hit(ball.radius_mm, minus(centre, from), dir);
        let free = (!meets_plate | (plate > limit)) & (!meets_ball | (at > limit));
        bits |= u64::from(free) << lane;
    }
    bits
}

/// Whether a ray hits a ball, and its ray length: origin + reach · ray; NaN if it misses.
#[inline(always)]
fn ball_hit(radius_mm: f64, to_centre: [f64; 3], ray: [f64; 3]) -> (bool, f64) {
    let square = dot(ray, ray);
    let along = dot(to_centre, ray) / square;
    let beside = [0, 1, 2].map(|axis: usize| to_centre[axis] - ray[axis] * along);
    let inside = radius_mm * radius_mm - dot(beside, beside);
    let ray_length = along - (inside / square).sqrt();
    (ray_length > 0.0, ray_length)
}

#[inline(always)]
fn is_near(radius_mm: f64, to_centre: [f64; 3], ray: [f64; 3]) -> bool {
    let beside = [
        to_centre[1] * ray[2] - to_centre[2] * ray[1],
        to_centre[2] * ray[0] - to_centre[0] * ray[2],
        to_centre[0] * ray[1] - to_centre[1] * ray[0],
    ];
    dot(beside, beside) <= radius_mm * radius_mm * dot(ray, ray) * (1.0 + SAME_HIT_MM)
}

/// The surface point of a pixel.
#[inline(always)]
fn point(hits: &PixelHits, lane: usize) -> [f64; 3] {
    let ray_length = hits.ray_length[lane];
    [hits.rays[0][lane] * ray_length, hits.rays[1][lane] * ray_length, ray_length]
}

#[inline(always)]
fn array(vector: &Vector3<f64>) -> [f64; 3] {
    [vector.x, vector.y, vector.z]
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::shape::StationShape;
    use crate::model::station::StationModel;
    use crate::part::scene::{Scene, SceneKind};
    use crate::render::view::laser_image::Placed;

    /// A plate seen by 64 rays of a row through the ball, two thousandths apart.
    fn row_of_plate(ball: &Sphere, moved: &Vector3<f64>, row: i32) -> PixelHits {
        let mut hits = PixelHits::nothing();
        for lane in 0..WORD_PX {
            let ray = Vector3::new((lane as f64 - 31.5) * 0.002, f64::from(row) * 0.002, 1.0);
            (hits.rays[0][lane], hits.rays[1][lane]) = (ray.x, ray.y);
            let plate = ball.plate.hit(&-moved, &ray).unwrap();
            hits.set_hit(lane, plate.ray_length, &plate.normal, plate.reflectance);
        }
        hits
    }

    #[test]
    fn rays_together_meet_a_ball_as_each_alone() {
        let model = StationModel::seeded(3, &StationShape::default()).unwrap();
        let scene = SceneKind::Sphere { radius_mm: 18.9 }.placed(&model, 1);
        let Scene::Sphere(ball) = &scene else { panic!("a ball was requested") };
        let placed = Placed { scene: &scene, moved_mm: Vector3::new(0.3, -4.0, 0.1) };
        let part = placed.part_ball().unwrap();
        let from = Vector3::new(20.0, -120.0, 5.0);
        let source = [0, 1, 2].map(|axis: usize| [from[axis]; WORD_PX]);
        let (mut n_ball, mut n_dark) = (0, 0);
        for row in -45..45 {
            let mut hits = row_of_plate(ball, &placed.moved_mm, row);
            let near = rays_near(&part, &hits.rays, WORD_PX);
            cast_ball(ball, &placed.moved_mm, WORD_PX, near, &mut hits);
            let shadow_rays = shadow_rays_near(&part, &source, &hits, WORD_PX);
            let beside = shadow_rays_past_ball(ball, &placed.moved_mm, &source, &hits, WORD_PX);
            for lane in 0..WORD_PX {
                let hit = placed.hit(&Vector3::zeros(), &hits.ray(lane)).unwrap();
                assert_eq!(
                    (hit.ray_length, hit.normal),
                    (hits.ray_length[lane], hits.normal(lane)),
                    "{row} {lane}"
                );
                let to = hits.ray(lane) * hits.ray_length[lane];
                assert_eq!(part.is_near(&from, &(to - from)), shadow_rays >> lane & 1 == 1, "{row} {lane}");
                assert_eq!(placed.reaches(&from, &to), beside >> lane & 1 == 1, "{row} {lane}");
                n_ball += usize::from(hit.normal != ball.plate.normal());
                n_dark += usize::from(beside >> lane & 1 == 0);
            }
        }
        assert!(n_ball > 1000 && n_dark > 300, "{n_ball} pixels of the ball, {n_dark} in its shadow");
    }
}
