//! Discs of known pose in front of a camera with a known lens, rendered by the covered fraction of every third of a
//! pixel. Not covered: illumination that varies within a disc, and boards that are not flat.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{Rng as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use vision::{CircleParams, GreyImage, Pixels};

pub const WIDTH: usize = 512;
pub const HEIGHT: usize = 400;
/// Subpixels along each side of a pixel.
const FINE: usize = 3;
const FOCAL_PX: f64 = 720.0;
const DARK: f64 = 40.0;
const BRIGHT: f64 = 200.0;

/// A view of a grid with a step of 1.
#[derive(Clone)]
pub struct View {
    pub params: CircleParams,
    pub radius: f64,
    pub rotation: Rotation3<f64>,
    /// Middle of the grid in the camera frame.
    pub middle: Vector3<f64>,
    /// Relative radial shift of a ray at a tangent of 1 from pixel to ideal direction.
    pub distortion: f64,
    pub blur_px: f64,
    pub noise_levels: f64,
    pub seed: u64,
}

impl View {
    /// A random view: tilts up to `tilt_rad` about both axes.
    pub fn random(params: &CircleParams, radius: f64, tilt_rad: f64, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let mut within = |limit: f64| rng.random_range(-limit..limit);
        let rotation = Rotation3::from_euler_angles(within(tilt_rad), within(tilt_rad), within(0.4));
        let [x, y] = extent(params);
        let distance = 1.75 * (FOCAL_PX / WIDTH as f64 * (x + 2.0)).max(FOCAL_PX / HEIGHT as f64 * (y + 2.0));
        let middle = Vector3::new(within(0.06) * distance, within(0.04) * distance, distance);
        Self {
            params: params.clone(),
            radius,
            rotation,
            middle,
            distortion: 0.25,
            blur_px: 0.8,
            noise_levels: 2.0,
            seed,
        }
    }

    fn place(&self, column: usize, row: usize) -> [f64; 2] {
        if self.params.staggered {
            [(2 * column + row % 2) as f64, row as f64]
        } else {
            [column as f64, row as f64]
        }
    }

    /// Board coordinates to ideal direction.
    fn ideal_from_board(&self) -> Matrix3<f64> {
        let [x, y] = extent(&self.params);
        let axes = self.rotation.matrix();
        let origin = self.middle - axes * Vector3::new(x / 2.0, y / 2.0, 0.0);
        Matrix3::from_columns(&[axes.column(0).into_owned(), axes.column(1).into_owned(), origin])
    }

    /// Pixel of a point on the board: the distortion is defined in the other direction and inverted iteratively.
    fn pixel(&self, place: [f64; 2]) -> [f64; 2] {
        let p = self.ideal_from_board() * Vector3::new(place[0], place[1], 1.0);
        let ideal = [p.x / p.z, p.y / p.z];
        let mut seen = ideal;
        for _ in 0..100 {
            let factor = 1.0 + self.distortion * (seen[0] * seen[0] + seen[1] * seen[1]);
            seen = ideal.map(|x| x / factor);
        }
        [FOCAL_PX * seen[0] + 0.5 * WIDTH as f64 + 3.3, FOCAL_PX * seen[1] + 0.5 * HEIGHT as f64 - 2.7]
    }

    pub fn truth(&self, column: usize, row: usize) -> [f64; 2] {
        self.pixel(self.place(column, row))
    }

    /// Signed distance on the board from the nearest disc's rim.
    fn field(&self, board_from_ideal: &Matrix3<f64>, u: f64, v: f64) -> f64 {
        let seen = [(u - 0.5 * WIDTH as f64 - 3.3) / FOCAL_PX, (v - 0.5 * HEIGHT as f64 + 2.7) / FOCAL_PX];
        let factor = 1.0 + self.distortion * (seen[0] * seen[0] + seen[1] * seen[1]);
        let p = board_from_ideal * Vector3::new(factor * seen[0], factor * seen[1], 1.0);
        let [x, y] = [p.x / p.z, p.y / p.z];
        let nearest = |row: f64| {
            let row = row.clamp(0.0, self.params.rows as f64 - 1.0);
            let (first, step) = if self.params.staggered { (row.rem_euclid(2.0), 2.0) } else { (0.0, 1.0) };
            let column = ((x - first) / step).round().clamp(0.0, self.params.columns as f64 - 1.0);
            (x - first - step * column).hypot(y - row)
        };
        nearest(y.floor()).min(nearest(y.ceil())) - self.radius
    }

    pub fn image(&self) -> GreyImage {
        let (w, h) = (WIDTH * FINE, HEIGHT * FINE);
        let at = |k: usize| (k as f64 + 0.5) / FINE as f64 - 0.5;
        let board_from_ideal = self.ideal_from_board().try_inverse().unwrap();
        let field: Vec<f64> = (0..w * h).map(|k| self.field(&board_from_ideal, at(k % w), at(k / w))).collect();
        let light: Vec<f64> = (0..w * h)
            .map(|k| {
                let (u, v) = (k % w, k / w);
                let slope = |a: usize, b: usize, n: usize| (field[b] - field[a]) / n as f64;
                let (u0, u1) = (u.saturating_sub(1), (u + 1).min(w - 1));
                let (v0, v1) = (v.saturating_sub(1), (v + 1).min(h - 1));
                let gradient = [slope(v * w + u0, v * w + u1, u1 - u0), slope(v0 * w + u, v1 * w + u, v1 - v0)];
                let length = gradient[0].hypot(gradient[1]).max(1e-12);
                let covered = half_plane(-field[k] / length, gradient.map(|g| (g / length).abs()));
                BRIGHT + (DARK - BRIGHT) * covered
            })
            .collect();
        let kernel = kernel(self.blur_px * FINE as f64);
        let rows = blurred(&light, w, &kernel);
        let turned: Vec<f64> = (0..w * h).map(|k| rows[(k % h) * w + k / h]).collect();
        let columns = blurred(&turned, h, &kernel);
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed ^ 0x5eed);
        let levels = (0..WIDTH * HEIGHT).map(|k| {
            let (u, v) = (k % WIDTH, k / WIDTH);
            let parts = (0..FINE * FINE).map(|n| columns[(u * FINE + n % FINE) * h + v * FINE + n / FINE]);
            let noise: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
            let level = parts.sum::<f64>() / (FINE * FINE) as f64 + self.noise_levels * noise;
            level.round().clamp(0.0, 255.0) as u8
        });
        GreyImage::new(WIDTH, HEIGHT, Pixels::Eight(levels.collect())).unwrap()
    }
}

fn extent(params: &CircleParams) -> [f64; 2] {
    let x = if params.staggered { 2 * params.columns - 1 } else { params.columns - 1 };
    [x as f64, params.rows as f64 - 1.0]
}

/// Area of a unit square on the inner side of a straight edge, with the square's centre `depth` inside.
fn half_plane(depth: f64, normal: [f64; 2]) -> f64 {
    let (p, q) = (0.5 * (normal[0] + normal[1]), 0.5 * (normal[0] - normal[1]).abs());
    let t = depth.abs().min(p);
    let top = 1.0 / (p + q);
    let fall = (t - q).max(0.0);
    let from_middle = top * (t.min(q) + fall - fall * fall / (2.0 * (p - q).max(1e-12)));
    0.5 + from_middle.copysign(depth)
}

fn kernel(sigma: f64) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil() as i32;
    let raw: Vec<f64> = (-reach..=reach).map(|x| (-0.5 * (f64::from(x) / sigma).powi(2)).exp()).collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|weight| weight / sum).collect()
}

fn blurred(source: &[f64], width: usize, kernel: &[f64]) -> Vec<f64> {
    let reach = kernel.len() / 2;
    let mut target = Vec::with_capacity(source.len());
    for row in source.chunks_exact(width) {
        for u in 0..width {
            let at = |k: usize| row[(u + k).saturating_sub(reach).min(width - 1)];
            target.push(kernel.iter().enumerate().map(|(k, weight)| weight * at(k)).sum());
        }
    }
    target
}
