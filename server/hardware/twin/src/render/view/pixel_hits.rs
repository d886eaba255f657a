//! Ray casting of a scene along a segment of an image row, many pixels at a time.

use multiversion::multiversion;
use nalgebra::Vector3;

use crate::arithmetic::floor;
use crate::params::{BACKDROP_REFLECTANCE, BLACK_REFLECTANCE, PART_REFLECTANCE, WHITE_REFLECTANCE};
use crate::part::board::Board;
use crate::part::mesh_corners::PlacedCorners;
use crate::part::print::Print;
use crate::part::scene::{Ball, Plate, Scene};
use crate::render::light::trace::trace;
use crate::render::renderer::Renderer;
use crate::render::view::ball_block::{cast_ball, rays_near, shadow_rays_near, shadow_rays_past_ball};
use crate::render::view::block::{Block, NOTHING};
use crate::render::view::freeform_block::Above;
use crate::render::view::laser_image::Placed;
use crate::render::view::lit_pixels::{LitPixels, lanes};
use crate::render::view::mesh_view::MeshView;

/// First hits of the camera's rays (x, y, 1); the camera is the origin.
#[derive(Debug, Clone)]
pub(crate) struct PixelHits {
    /// x and y of the rays.
    pub rays: [Block; 2],
    /// The hit is reach · ray; NaN without a hit.
    pub ray_length: Block,
    /// Unit normals, out of the material.
    pub normal: [Block; 3],
    /// Fractions of the light that a white, matt surface would reflect.
    pub reflectance: Block,
}

impl PixelHits {
    pub(crate) fn nothing() -> Self {
        Self { rays: [NOTHING; 2], ray_length: NOTHING, normal: [NOTHING; 3], reflectance: NOTHING }
    }

    pub(crate) fn rays_mut(&mut self, n: usize) -> [&mut [f64]; 2] {
        self.rays.each_mut().map(|axis| &mut axis[..n])
    }

    pub(crate) fn ray(&self, lane: usize) -> Vector3<f64> {
        Vector3::new(self.rays[0][lane], self.rays[1][lane], 1.0)
    }

    pub(crate) fn normal(&self, lane: usize) -> Vector3<f64> {
        Vector3::new(self.normal[0][lane], self.normal[1][lane], self.normal[2][lane])
    }

    /// The surface point of a pixel.
    #[inline]
    fn point(&self, lane: usize) -> Vector3<f64> {
        self.ray(lane) * self.ray_length[lane]
    }

    /// Replaces the normal of a pixel's hit.
    #[inline]
    pub(crate) fn set_normal(&mut self, lane: usize, normal: &Vector3<f64>) {
        (0..3).for_each(|axis| self.normal[axis][lane] = normal[axis]);
    }

    /// Replaces a pixel's hit.
    pub(crate) fn set_hit(&mut self, lane: usize, ray_length: f64, normal: &Vector3<f64>, reflectance: f64) {
        self.ray_length[lane] = ray_length;
        self.set_normal(lane, normal);
        self.reflectance[lane] = reflectance;
    }
}

/// Reusable buffers for meshes.
#[derive(Debug, Default)]
pub(crate) struct MeshMemory {
    view: MeshView,
    placed: PlacedCorners,
}

/// A scene prepared for many segments of one image.
pub(crate) struct View<'s> {
    scene: Placed<'s>,
    part: Option<Ball>,
    above: Above,
    memory: &'s mut MeshMemory,
    words_per_row: usize,
}

impl<'s> View<'s> {
    pub(crate) fn new(scene: Placed<'s>, memory: &'s mut MeshMemory) -> Self {
        Self { scene, part: scene.part_ball(), above: Above::default(), memory, words_per_row: 0 }
    }

    /// Marks the pixels of `lit` that light of an order may reach.
    pub(crate) fn mark_lit(&mut self, renderer: &Renderer, order_idx: usize, lit: &mut LitPixels) {
        trace(renderer, self.scene, order_idx, lit, &mut self.memory.placed);
    }

    /// Prepares the words that contain the set `lit`; required before any segment is evaluated.
    pub(crate) fn prepare(&mut self, renderer: &Renderer, lit: &LitPixels) {
        self.words_per_row = lit.words_per_row();
        if let Scene::Mesh(mesh) = self.scene.scene {
            let MeshMemory { view, placed } = &mut *self.memory;
            view.draw(renderer, mesh, &self.scene.moved_mm, lit, placed);
        }
    }

    /// Fills in the first `n` rays of a segment that begins at column `u` of row `v`.
    pub(crate) fn fill_rays(&self, renderer: &Renderer, u: usize, v: usize, n: usize, hits: &mut PixelHits) {
        match self.scene.scene {
            Scene::Mesh(_) => self.memory.view.fill_rays(self.words_per_row, (u, v), n, hits),
            _ => renderer.rays.read(u, v, hits.rays_mut(n)),
        }
    }

    /// Fills in the first `n` hits of a segment that begins at column `u` of row `v`.
    pub(crate) fn cast(&mut self, u: usize, v: usize, n: usize, hits: &mut PixelHits) {
        let moved = &self.scene.moved_mm;
        match self.scene.scene {
            Scene::Board(board) => {
                let moved_board = board.moved(moved);
                cast_board(&moved_board, board.backdrop_z_mm + moved.z, n, hits);
                cast_print(&moved_board, n, hits);
            }
            Scene::Plate(plate) => cast_plate(plate, moved, n, hits),
            Scene::Gauge(gauge) => {
                cast_plate(&gauge.plate, moved, n, hits);
                let near = self.part.map_or(0, |part| rays_near(&part, &hits.rays, n));
                lanes(near).for_each(|lane| self.cast_one(lane, hits));
            }
            Scene::Sphere(ball) => {
                cast_plate(&ball.plate, moved, n, hits);
                let near = self.part.map_or(0, |part| rays_near(&part, &hits.rays, n));
                if near != 0 {
                    cast_ball(ball, moved, n, near, hits);
                }
            }
            Scene::Freeform(part) => self.above.cast(part, moved, (u, v), n, hits),
            Scene::Mesh(mesh) => {
                cast_plate(&mesh.plate, moved, n, hits);
                self.memory.view.cast(mesh, self.words_per_row, (u, v), n, hits);
            }
        }
    }

    /// The pixels of `bits` (from bit 0) in a segment of `n` that light from `source` reaches: points on the lit side
    /// of their surfaces. Only the part can shadow a plate.
    pub(crate) fn lights(&self, source: &[Block; 3], hits: &PixelHits, n: usize, bits: u64) -> u64 {
        if matches!(self.scene.scene, Scene::Plate(_)) {
            return bits;
        }
        let near = self.part.map_or(u64::MAX, |part| shadow_rays_near(&part, source, hits, n)) & bits;
        let beside = match self.scene.scene {
            Scene::Sphere(ball) if near != 0 => {
                near & shadow_rays_past_ball(ball, &self.scene.moved_mm, source, hits, n)
            }
            Scene::Mesh(mesh) => {
                let from = |lane: usize| Vector3::new(source[0][lane], source[1][lane], source[2][lane]);
                mesh.lit(near, |lane| [from(lane), hits.point(lane)].map(|at| at - self.scene.moved_mm))
            }
            _ => lanes(near).fold(0, |lit, lane| lit | u64::from(self.lights_one(source, hits, lane)) << lane),
        };
        bits & !near | beside
    }

    /// The same for one pixel.
    #[inline]
    fn lights_one(&self, source: &[Block; 3], hits: &PixelHits, lane: usize) -> bool {
        let from = Vector3::new(source[0][lane], source[1][lane], source[2][lane]);
        self.scene.lights(&from, &hits.point(lane), &hits.normal(lane))
    }

    fn cast_one(&self, lane: usize, hits: &mut PixelHits) {
        match self.scene.hit(&Vector3::zeros(), &hits.ray(lane)) {
            Some(hit) => hits.set_hit(lane, hit.ray_length, &hit.normal, hit.reflectance),
            None => hits.ray_length[lane] = f64::NAN,
        }
    }
}

fn cast_plate(plate: &Plate, moved: &Vector3<f64>, n: usize, hits: &mut PixelHits) {
    let normal = plate.normal();
    cast_plane(&normal, normal.dot(&(plate.point_mm + moved)), n, hits);
}

/// The plane of all points X with normal · X = `offset_mm`.
#[multiversion(targets("x86_64+avx2"))]
fn cast_plane(normal: &Vector3<f64>, offset_mm: f64, n: usize, hits: &mut PixelHits) {
    let [x, y] = &hits.rays;
    for ((ray_length, x), y) in hits.ray_length[..n].iter_mut().zip(x).zip(y) {
        let met = offset_mm / (normal.x * x + normal.y * y + normal.z);
        *ray_length = if met > 0.0 && met < f64::INFINITY { met } else { f64::NAN };
    }
    for (axis, block) in hits.normal.iter_mut().enumerate() {
        block[..n].fill(normal[axis]);
    }
    hits.reflectance[..n].fill(PART_REFLECTANCE);
}

/// Adds the print of a board that [`cast_board`] evaluates as a plain chessboard.
fn cast_print(board: &Board, n: usize, hits: &mut PixelHits) {
    if board.print == Print::Squares {
        return;
    }
    for lane in 0..n.min(hits.rays[0].len()) {
        let ray = Vector3::new(hits.rays[0][lane], hits.rays[1][lane], 1.0);
        if let Some(hit) = board.hit(&Vector3::zeros(), &ray) {
            hits.reflectance[lane] = hit.reflectance;
        }
    }
}

/// The board, or the backdrop behind it.
#[multiversion(targets("x86_64+avx2"))]
fn cast_board(board: &Board, backdrop_z_mm: f64, n: usize, hits: &mut PixelHits) {
    let [across, down, normal] = [0, 1, 2].map(|axis| board.axes.column(axis).into_owned());
    let (half, inner) = (board.half_mm(), [board.inner_columns as f64, board.inner_rows as f64]);
    let ([square_x, square_y], centre) = (board.square_mm.into(), board.centre_mm);
    let offset = normal.dot(&centre);
    let PixelHits { rays: [x, y], ray_length, normal: [nx, ny, nz], reflectance, .. } = hits;
    for lane in 0..n.min(x.len()) {
        let met = offset / (normal.x * x[lane] + normal.y * y[lane] + normal.z);
        let at = [x[lane] * met - centre.x, y[lane] * met - centre.y, met - centre.z];
        let a = across.x * at[0] + across.y * at[1] + across.z * at[2];
        let b = down.x * at[0] + down.y * at[1] + down.z * at[2];
        let on_board = (met > 0.0) & (a.abs() <= half.x + square_x) & (b.abs() <= half.y + square_y);
        let (column, row) = (floor((a + half.x) / square_x), floor((b + half.y) / square_y));
        let inside = (column >= 0.0) & (column <= inner[0]) & (row >= 0.0) & (row <= inner[1]);
        let squares = column + row;
        let black = inside & (squares - 2.0 * floor(squares / 2.0) < 0.5);
        let board_reflectance = if black { BLACK_REFLECTANCE } else { WHITE_REFLECTANCE };
        ray_length[lane] = if on_board { met } else { backdrop_z_mm };
        nx[lane] = if on_board { -normal.x } else { 0.0 };
        ny[lane] = if on_board { -normal.y } else { 0.0 };
        nz[lane] = if on_board { -normal.z } else { -1.0 };
        reflectance[lane] = if on_board { board_reflectance } else { BACKDROP_REFLECTANCE };
    }
}
