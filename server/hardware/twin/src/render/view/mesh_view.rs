//! Rendering of a mesh: triangles are rasterised into the requested words of pixels, the nearest wins. Each pixel's ray
//! is tested exactly; rasterisation only selects the triangles it is tested against.

use multiversion::multiversion;
use nalgebra::{Vector2, Vector3};
use optics::Camera;

use crate::arithmetic::{ceil, floor};
use crate::params::MAP_STEP_PX;
use crate::part::mesh::{Mesh, SEAM};
use crate::part::mesh_corners::PlacedCorners;
use crate::render::renderer::Renderer;
use crate::render::view::block::{Block, NOTHING};
use crate::render::view::lit_pixels::{FilledCells, LitPixels, WORD_PX, bits_between, lanes};
use crate::render::view::pixel_hits::PixelHits;

/// Upper bound of the segment of a step in the ideal image by lens distortion.
const LENS_STRETCH: f64 = 1.3;

/// Margin around the corners of a triangle, pixels.
const MARGIN_PX: f64 = 0.5;

/// Lens distortion curves the side of a triangle by less than this times its length squared, pixels: a third of it at
/// the corners of a field as wide as the standoff.
const BOW_PER_PX: f64 = 1e-4;

/// Boxes larger than this in the image are searched without an occlusion test, and triangles as large are first
/// searched in cells.
const LARGE_PX: f64 = 256.0;

/// Pixels tested together: as many as fit a vector register.
const STEP_PX: usize = 4;

/// No word of pixels.
const NONE: u32 = u32::MAX;

/// No triangle.
const NO_TRIANGLE: u32 = u32::MAX;

/// The part within a word of pixels.
#[derive(Debug, Clone)]
struct Word {
    /// The requested pixels.
    lit: u64,
    rays: [Block; 2],
    ray_length: Block,
    triangle: [u32; WORD_PX],
}

/// The part within some words of an image.
#[derive(Debug, Default)]
pub(crate) struct MeshView {
    word_idx: Vec<u32>,
    words: Vec<Word>,
    filled: FilledCells,
}

/// Ray intersection with a triangle (Möller & Trumbore 1997, sorted by the ray): with D = (x, y, 1) the barycentric u =
/// U·D/G·D, v = V·D/G·D, and the ray length is `height`/G·D. The products of `within` with D are not negative for rays
/// that hit: U, V and G − U − V, each with the seam tolerance.
struct Facet {
    within: [Vector3<f64>; 3],
    scale: Vector3<f64>,
    height: f64,
    idx: u32,
}

impl MeshView {
    /// Rasterises the part at the stage's position into the words that contain the set `lit`.
    pub(crate) fn draw(
        &mut self,
        renderer: &Renderer,
        mesh: &Mesh,
        moved: &Vector3<f64>,
        lit: &LitPixels,
        placed: &mut PlacedCorners,
    ) {
        self.lay_out(renderer, lit);
        let camera = &renderer.model.camera;
        placed.prepare(camera, mesh, moved);
        let origin = mesh.plate.point_mm + moved;
        let Self { word_idx, words, filled } = self;
        filled.count(lit);
        let may_be_seen = |centre: &Vector3<f64>, radius_mm: f64| {
            rectangle_around(camera, &(origin + mesh.plate.axes * centre), radius_mm)
                .is_none_or(|(low, high)| filled.any_within(lit, low, high))
        };
        mesh.solid.for_each_in(may_be_seen, |idx| {
            let triangle = placed.triangle(mesh, idx);
            let Some((left, right, top, bottom)) = pixels_around(camera, &triangle.pixels) else { return };
            let large = bottom - top > LARGE_PX as usize;
            if (!large || filled.any_within(lit, [left as f64, top as f64], [right as f64, bottom as f64]))
                && lit.any_between((left, right), (top, bottom))
            {
                let rows = &word_idx[top * lit.words_per_row()..(bottom + 1) * lit.words_per_row()];
                draw_facet(&Facet::new(&triangle.corners, idx), (left, right), rows, lit.words_per_row(), words);
            }
        });
    }

    /// Empty words with their rays.
    fn lay_out(&mut self, renderer: &Renderer, lit: &LitPixels) {
        self.word_idx.clear();
        self.word_idx.resize(lit.n_words(), NONE);
        for (word_idx, (u, v, n)) in lit.segments(MAP_STEP_PX).enumerate() {
            if word_idx == self.words.len() {
                let triangle = [NO_TRIANGLE; WORD_PX];
                self.words.push(Word { lit: 0, rays: [NOTHING; 2], ray_length: NOTHING, triangle });
            }
            let word = &mut self.words[word_idx];
            let first = u % WORD_PX;
            renderer.rays.read(u, v, word.rays.each_mut().map(|axis| &mut axis[first..first + n]));
            word.lit = lit.word(u, v);
            word.ray_length = [f64::INFINITY; WORD_PX];
            self.word_idx[v * lit.words_per_row() + u / WORD_PX] = word_idx as u32;
        }
    }

    /// The word of a segment, and the offset of the segment in it.
    fn word(&self, words_per_row: usize, (u, v): (usize, usize)) -> (&Word, usize) {
        let slot = self.word_idx[v * words_per_row + u / WORD_PX];
        debug_assert_ne!(slot, NONE, "only prepared words are evaluated");
        (&self.words[slot as usize], u % WORD_PX)
    }

    /// The rays of a segment.
    pub(crate) fn fill_rays(&self, words_per_row: usize, (u, v): (usize, usize), n: usize, hits: &mut PixelHits) {
        let (word, first) = self.word(words_per_row, (u, v));
        for (axis, rays) in hits.rays_mut(n).into_iter().zip(&word.rays) {
            axis.copy_from_slice(&rays[first..first + n]);
        }
    }

    /// Replaces the hits of a pixel segment, which are those of its plate with the same reflectance, where the part is
    /// nearer; pixels that were not requested have no hit.
    pub(crate) fn cast(
        &self,
        mesh: &Mesh,
        words_per_row: usize,
        (u, v): (usize, usize),
        n: usize,
        hits: &mut PixelHits,
    ) {
        let (word, first) = self.word(words_per_row, (u, v));
        let on_part = put_before(&word.ray_length[first..first + n], word.lit >> first, hits);
        let mut last = (NO_TRIANGLE, Vector3::zeros());
        for lane in lanes(on_part) {
            let idx = word.triangle[first + lane];
            if last.0 != idx {
                // All of a triangle shows the camera the same side.
                let normal = mesh.plate.axes * mesh.solid.normal(idx);
                last = (idx, if normal.dot(&hits.ray(lane)) > 0.0 { -normal } else { normal });
            }
            hits.set_normal(lane, &last.1);
        }
    }
}

impl Facet {
    fn new(corners: &[Vector3<f64>; 3], idx: u32) -> Self {
        let [corner, a, b] = [corners[0], corners[1] - corners[0], corners[2] - corners[0]];
        let from = -corner;
        let v = from.cross(&a);
        let (u, scale, height) = (b.cross(&from), b.cross(&a), b.dot(&v));
        // Rays hit it in front of the camera where `scale` has the sign of `height`.
        let sign = height.signum();
        let (u, v, scale) = (u * sign, v * sign, scale * sign);
        let seam = scale * SEAM;
        Self { within: [u + seam, v + seam, scale + seam - u - v], scale, height: height * sign, idx }
    }

    /// Tests the pixels of a step of a word.
    #[inline(always)]
    fn test(&self, step: usize, word: &mut Word) {
        let Self { within: [u, v, w], scale, height, idx } = self;
        let Word { rays: [x, y], ray_length, triangle, .. } = word;
        let (x, y) = (&x.as_chunks::<STEP_PX>().0[step], &y.as_chunks::<STEP_PX>().0[step]);
        let mut inside = [false; STEP_PX];
        for lane in 0..STEP_PX {
            let by = |n: &Vector3<f64>| n.x * x[lane] + n.y * y[lane] + n.z;
            inside[lane] = (by(u) >= 0.0) & (by(v) >= 0.0) & (by(w) >= 0.0);
        }
        if inside == [false; STEP_PX] {
            return;
        }
        let ray_length = &mut ray_length.as_chunks_mut::<STEP_PX>().0[step];
        let triangle = &mut triangle.as_chunks_mut::<STEP_PX>().0[step];
        let (mut met, mut nearest) = ([0.0; STEP_PX], [false; STEP_PX]);
        for lane in 0..STEP_PX {
            met[lane] = height / (scale.x * x[lane] + scale.y * y[lane] + scale.z);
        }
        for lane in 0..STEP_PX {
            nearest[lane] = inside[lane] & (met[lane] > 0.0) & (met[lane] < ray_length[lane]);
        }
        if nearest != [false; STEP_PX] {
            for lane in 0..STEP_PX {
                ray_length[lane] = if nearest[lane] { met[lane] } else { ray_length[lane] };
                triangle[lane] = if nearest[lane] { *idx } else { triangle[lane] };
            }
        }
    }
}

/// Tests the requested pixels from column `left` to `right` of whole rows, whose words lie at `rows`.
#[multiversion(targets("x86_64+avx2"))]
fn draw_facet(
    facet: &Facet,
    (left, right): (usize, usize),
    rows: &[u32],
    words_per_row: usize,
    words: &mut [Word],
) {
    for word in left / WORD_PX..=right / WORD_PX {
        let between = bits_between(left, right, word);
        for row in rows[word..].iter().step_by(words_per_row) {
            let Some(word) = words.get_mut(*row as usize) else { continue };
            let mut requested = word.lit & between;
            while requested != 0 {
                let step = requested.trailing_zeros() as usize / STEP_PX;
                facet.test(step, word);
                requested &= !(((1 << STEP_PX) - 1) << (step * STEP_PX));
            }
        }
    }
}

/// Replaces the hits where the part is nearer, and returns these pixels; those not in `requested` have no hit.
#[multiversion(targets("x86_64+avx2"))]
fn put_before(part: &[f64], requested: u64, hits: &mut PixelHits) -> u64 {
    let mut on_part = 0;
    for (lane, (ray_length, part)) in hits.ray_length.iter_mut().zip(part).enumerate() {
        // Without a plate its ray length is NaN.
        let behind = *ray_length < *part;
        let nearer = (*part < f64::INFINITY) & !behind;
        let requested = requested >> lane & 1 != 0;
        on_part |= u64::from(nearer & requested) << lane;
        let nearest = if nearer { *part } else { *ray_length };
        *ray_length = if requested { nearest } else { f64::NAN };
    }
    on_part
}

/// Corners (u, v) of an image rectangle around a sphere; `None` if it is large or the camera is near it.
fn rectangle_around(camera: &Camera, centre: &Vector3<f64>, radius_mm: f64) -> Option<([f64; 2], [f64; 2])> {
    let nearest = centre.z - radius_mm;
    let (x, y) = (centre.x / centre.z, centre.y / centre.z);
    // At d from the centre, (x, y) changes by (d_x − x·d_z, d_y − y·d_z)/z: at most |d|·√(1 + x² + y²)/z.
    let ideal = radius_mm * (1.0 + x * x + y * y).sqrt() / nearest;
    let half_px = LENS_STRETCH * camera.fx_px.max(camera.fy_px) * ideal;
    if nearest <= 0.0 || half_px > LARGE_PX {
        return None;
    }
    let pixel = camera.project(centre)?;
    Some(([pixel.x - half_px, pixel.y - half_px], [pixel.x + half_px, pixel.y + half_px]))
}

/// Columns and rows of the image that a triangle may cover: left, right, top, bottom.
fn pixels_around(camera: &Camera, pixels: &[Option<[f64; 2]>; 3]) -> Option<(usize, usize, usize, usize)> {
    let (width, height) = (camera.width_px, camera.height_px);
    let [Some(a), Some(b), Some(c)] = *pixels else { return Some((0, width - 1, 0, height - 1)) };
    let [a, b, c] = [a, b, c].map(Vector2::from);
    let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    let margin = MARGIN_PX + BOW_PER_PX * (high - low).norm_squared();
    let span = |low: f64, high: f64, size: usize| {
        let (low, high) = (ceil(low - margin).max(0.0), floor(high + margin).min(size as f64 - 1.0));
        (low <= high).then_some((low as usize, high as usize))
    };
    let (left, right) = span(low.x, high.x, width)?;
    let (top, bottom) = span(low.y, high.y, height)?;
    Some((left, right, top, bottom))
}
