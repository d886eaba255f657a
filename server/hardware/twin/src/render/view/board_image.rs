//! Ambient light on a scene: the target at normal exposure, or the ambient contribution to a laser image.

use std::array::from_fn;

use nalgebra::{Matrix2, Vector2, Vector3};

use crate::params::{
    BACKDROP_REFLECTANCE, EDGE_SAMPLES, ILLUMINATION_GRADIENT, MAP_STEP_PX, VIGNETTING, WHITE_REFLECTANCE,
};
use crate::part::board::Board;
use crate::part::pattern::Averages;
use crate::part::scene::Scene;
use crate::render::renderer::Renderer;
use crate::render::view::laser_image::Placed;
use crate::render::view::lit_pixels::{LitPixels, WORD_PX};
use crate::render::view::pixel_hits::{MeshMemory, PixelHits, View};

/// Rows prepared together: few enough to stay in a processor's cache.
const BAND_PX: usize = 32;

/// Upper bound of the segment of a pixel's ray by lens distortion.
const LENS_STRETCH: f64 = 1.3;

/// Light of a whole image before lens blur: `white_level` (of 255) on white at the image centre.
pub(crate) fn ambient_light(
    renderer: &Renderer,
    scene: Placed<'_>,
    white_level: f64,
    memory: &mut MeshMemory,
) -> Vec<f32> {
    let (width, height) = (renderer.model.camera.width_px, renderer.model.camera.height_px);
    let (mut view, mut hits) = (View::new(scene, memory), PixelHits::nothing());
    let mut levels = vec![0.0; width * height];
    let mut band = LitPixels::none(width, height);
    let board = match scene.scene {
        Scene::Board(board) => Some(board.moved(&scene.moved_mm)),
        _ => None,
    };
    for (v, row) in levels.chunks_exact_mut(width).enumerate() {
        if v % BAND_PX == 0 {
            let last = (v + BAND_PX - 1).min(height - 1);
            band.clear();
            band.add_rectangle([0.0, v as f64], [width as f64, last as f64], 0.0);
            view.prepare(renderer, &band);
        }
        for (word, segment) in row.chunks_mut(WORD_PX).enumerate() {
            let (u, n) = (word * WORD_PX, segment.len().next_multiple_of(MAP_STEP_PX));
            renderer.rays.read(u, v, hits.rays_mut(n));
            if board.is_none() {
                view.cast(u, v, n, &mut hits);
            }
            for (lane, slot) in segment.iter_mut().enumerate() {
                let reflectance = visible_reflectance(renderer, board.as_ref(), &hits, lane);
                *slot =
                    (white_level / WHITE_REFLECTANCE * reflectance * illumination(renderer, u + lane, v)) as f32;
            }
        }
    }
    levels
}

/// Light on the scene around a pixel relative to the image centre: a smooth gradient and vignetting.
fn illumination(renderer: &Renderer, u: usize, v: usize) -> f64 {
    let (width, height) = (renderer.model.camera.width_px as f64, renderer.model.camera.height_px as f64);
    let at = Vector2::new(2.0 * u as f64 / width - 1.0, 2.0 * v as f64 / height - 1.0);
    (1.0 + ILLUMINATION_GRADIENT * renderer.brighter_side.dot(&at)) * (1.0 - VIGNETTING / 2.0 * at.norm_squared())
}

/// Mean reflectance within a pixel; of the board if it is the visible surface.
fn visible_reflectance(renderer: &Renderer, board: Option<&Board>, hits: &PixelHits, lane: usize) -> f64 {
    let ray = hits.ray(lane);
    if let Some(board) = board {
        return board_reflectance(renderer, board, &ray);
    }
    if hits.ray_length[lane].is_nan() {
        0.0
    } else {
        hits.reflectance[lane] * -hits.normal(lane).dot(&ray.normalize())
    }
}

/// One sample where the target is uniform around the pixel, elsewhere a square of samples with soft edges.
fn board_reflectance(renderer: &Renderer, board: &Board, ray: &Vector3<f64>) -> f64 {
    let Some((ray_length, at)) = board.plane_hit(&Vector3::zeros(), ray) else { return BACKDROP_REFLECTANCE };
    if !board.edge_within(&at, &widest_pixel_mm(renderer, board, ray, ray_length)) {
        return mixed_reflectance(board, &[at], &Vector2::repeat(f64::MIN_POSITIVE));
    }
    let Some(per_pixel) = board_per_pixel(renderer, board, ray) else { return BACKDROP_REFLECTANCE };
    let span = Vector2::new(per_pixel.row(0).abs().sum(), per_pixel.row(1).abs().sum());
    if !board.edge_within(&at, &span) {
        return mixed_reflectance(board, &[at], &span);
    }
    let n = EDGE_SAMPLES as f64;
    let offset = |idx: usize| (idx as f64 + 0.5) / n - 0.5;
    let samples: [Vector2<f64>; EDGE_SAMPLES * EDGE_SAMPLES] =
        from_fn(|idx| at + per_pixel * Vector2::new(offset(idx % EDGE_SAMPLES), offset(idx / EDGE_SAMPLES)));
    mixed_reflectance(board, &samples, &(span / n))
}

/// Mean reflectance of the board and of the backdrop beside it over small areas, weighted by their fractions.
fn mixed_reflectance<const N: usize>(board: &Board, at: &[Vector2<f64>; N], span: &Vector2<f64>) -> f64 {
    let Averages { reflectance, board } = board.averages(at, span);
    let mixed = reflectance.iter().zip(&board);
    mixed.map(|(one, fraction)| BACKDROP_REFLECTANCE + (one - BACKDROP_REFLECTANCE) * fraction).sum::<f64>()
        / N as f64
}

/// Upper bound of a pixel's extent on the board, along x and y: avoids the exact span for most pixels.
fn widest_pixel_mm(renderer: &Renderer, board: &Board, ray: &Vector3<f64>, ray_length: f64) -> Vector2<f64> {
    let camera = &renderer.model.camera;
    let steepness = board.axes.column(2).dot(ray).abs();
    let ray_step = LENS_STRETCH * 2.0 / camera.fx_px.min(camera.fy_px);
    Vector2::repeat(ray_step * ray_length * (1.0 + ray.norm() / steepness))
}

/// d(x, y on the board) / d(u, v), mm/px.
fn board_per_pixel(renderer: &Renderer, board: &Board, ray: &Vector3<f64>) -> Option<Matrix2<f64>> {
    let ideal_by_pixel = renderer.model.camera.pixel_by_ideal(&ray.xy()).try_inverse()?;
    let normal = board.axes.column(2);
    let steepness = normal.dot(ray);
    let ray_length = normal.dot(&board.centre_mm) / steepness;
    // X = λ·D with n·X fixed: dX = λ·(dD − D·(n·dD)/(n·D)).
    let column = |axis: usize| {
        let ray_step = Vector3::new(ideal_by_pixel[(0, axis)], ideal_by_pixel[(1, axis)], 0.0);
        let point_step = (ray_step - ray * (normal.dot(&ray_step) / steepness)) * ray_length;
        Vector2::new(board.axes.column(0).dot(&point_step), board.axes.column(1).dot(&point_step))
    };
    Some(Matrix2::from_columns(&[column(0), column(1)]))
}
