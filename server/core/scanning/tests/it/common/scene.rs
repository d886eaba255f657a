//! Small scenes lit order by order: a height field on the stage, with shadows and occlusion.

use nalgebra::Vector3;
use optics::{Calibration, Grating, LightSurfaces, PointMm, StagePosition};
use rayon::prelude::*;
use scanning::ScanFrame;
use vision::LineDirection;

use super::{KnownScan, SIGMA_PX, centrelines, segments};

/// Fan angle between light rays: 0.4 columns of the test station.
const PHI_STEP_RAD: f64 = 0.0006;
/// Step along light and camera rays, mm; thinner features would be missed.
const MARCH_MM: f64 = 1.0;

/// Depth of the part's surface (part frame) at (x, y); `f64::INFINITY` where there is no surface.
pub type Surface<'a> = &'a (dyn Fn(f64, f64) -> f64 + Sync);

/// Scans `surface` at the given stage positions; `turned` stations have their lines along columns.
pub fn scan(calibration: &Calibration, surface: Surface, positions_mm: &[f64], turned: bool) -> KnownScan {
    scan_with(calibration, surface, positions_mm, turned, 1.0, 7)
}

/// [`scan`] with `understated` times the stated noise.
pub fn scan_with(
    calibration: &Calibration,
    surface: Surface,
    positions_mm: &[f64],
    turned: bool,
    understated: f64,
    seed: u64,
) -> KnownScan {
    let LightSurfaces::Grating(grating) = &calibration.light else { panic!("the scene needs a grating") };
    let direction = if turned { LineDirection::Columns } else { LineDirection::Rows };
    let stage = calibration.stage.unwrap().linear().unwrap().direction;
    let light = grating_light(grating);
    let frames = positions_mm.par_iter().enumerate().map(|(frame, &position_mm)| {
        let mut noise = Noise((seed << 20) + frame as u64);
        let shift = stage * position_mm;
        let depth = |p: &Vector3<f64>| p.z - surface(p.x - shift.x, p.y - shift.y) - shift.z;
        let mut points = Vec::new();
        for &order in &calibration.orders {
            points.extend(line(calibration, &|phi_rad| light(order, phi_rad), order, &depth, turned, &mut || {
                understated * noise.next()
            }));
        }
        let (found, orders) = segments(&points, direction);
        (
            ScanFrame {
                centrelines: centrelines(found, direction),
                position: StagePosition::LinearMm(position_mm),
            },
            orders,
        )
    });
    let (frames, orders) = frames.unzip();
    KnownScan { frames, orders }
}

/// Positive inside the part, negative outside; only the sign matters. Part frame.
pub type Solid<'a> = &'a (dyn Fn(&Vector3<f64>) -> f64 + Sync);

/// A light ray of an order by its fan angle: origin and direction.
pub type Light<'a> = &'a (dyn Fn(i8, f64) -> Option<(Vector3<f64>, Vector3<f64>)> + Sync);

/// Scans a part moved by the stage of `calibration`, lit by `light`, with lines along columns.
pub fn scan_moved(
    calibration: &Calibration,
    solid: Solid,
    light: Light,
    positions: &[StagePosition],
) -> KnownScan {
    scan_moved_with(calibration, solid, light, positions, 11)
}

/// [`scan_moved`] with the noise of a seed.
pub fn scan_moved_with(
    calibration: &Calibration,
    solid: Solid,
    light: Light,
    positions: &[StagePosition],
    seed: u64,
) -> KnownScan {
    let stage = calibration.stage.unwrap();
    let frames = positions.par_iter().enumerate().map(|(frame, &position)| {
        let mut noise = Noise((seed << 20) + frame as u64);
        let motion = stage.motion(position).unwrap();
        let depth = |p: &Vector3<f64>| solid(&motion.part_from_camera(&PointMm::new(*p)).xyz);
        let mut points = Vec::new();
        for &order in &calibration.orders {
            let ray = |phi_rad: f64| light(order, phi_rad);
            points.extend(line(calibration, &ray, order, &depth, true, &mut || noise.next()));
        }
        let (found, orders) = segments(&points, LineDirection::Columns);
        (ScanFrame { centrelines: centrelines(found, LineDirection::Columns), position }, orders)
    });
    let (frames, orders) = frames.unzip();
    KnownScan { frames, orders }
}

/// The light of a grating.
pub fn grating_light(
    grating: &Grating,
) -> impl Fn(i8, f64) -> Option<(Vector3<f64>, Vector3<f64>)> + Sync + use<> {
    let grating = *grating;
    move |order, phi_rad| grating.ray(phi_rad, order).map(|ray| (ray.origin_mm, ray.direction))
}

/// The visible points of one order, one per column (row), with noise.
fn line(
    calibration: &Calibration,
    ray: &dyn Fn(f64) -> Option<(Vector3<f64>, Vector3<f64>)>,
    order: i8,
    depth: &dyn Fn(&Vector3<f64>) -> f64,
    turned: bool,
    noise: &mut dyn FnMut() -> f64,
) -> Vec<(f64, f64, Option<i8>)> {
    let mut points = Vec::new();
    let mut last: Option<(f64, f64, f64)> = None;
    for i in -500..=500 {
        let here = ray(f64::from(i) * PHI_STEP_RAD).and_then(|(origin_mm, direction)| {
            let hit = first_hit(&origin_mm, &direction, depth)?;
            visible(&hit, depth).then_some(())?;
            let pixel = calibration.camera.project(&hit)?;
            let (along, across) = if turned { (pixel.y, pixel.x) } else { (pixel.x, pixel.y) };
            Some((along, across, hit.z))
        });
        if let (Some(from), Some(to)) = (last, here)
            && (from.2 - to.2).abs() < 2.0
            && to.0 > from.0
        {
            let mut along = from.0.ceil();
            while along < to.0 {
                let across = from.1 + (to.1 - from.1) * (along - from.0) / (to.0 - from.0) + noise() * SIGMA_PX;
                let (u, v) = if turned { (across, along) } else { (along, across) };
                let camera = &calibration.camera;
                if u >= 0.0 && v >= 0.0 && u < camera.width_px as f64 && v < camera.height_px as f64 {
                    points.push((u, v, Some(order)));
                }
                along += 1.0;
            }
        }
        last = here;
    }
    points
}

/// First intersection of a light ray with the surface.
fn first_hit(
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
    depth: &dyn Fn(&Vector3<f64>) -> f64,
) -> Option<Vector3<f64>> {
    let at = |t: f64| origin + direction * t;
    let mut t = (340.0 - origin.z) / direction.z;
    let end = (460.0 - origin.z) / direction.z;
    while t < end {
        if depth(&at(t + MARCH_MM)) > 0.0 {
            let (mut low, mut high) = (t, t + MARCH_MM);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if depth(&at(middle)) > 0.0 { high = middle } else { low = middle }
            }
            // Hits on vertical walls are kept, because walls are part of the surface.
            return Some(at(low));
        }
        t += MARCH_MM;
    }
    None
}

/// Whether the hit is visible from the camera.
fn visible(hit: &Vector3<f64>, depth: &dyn Fn(&Vector3<f64>) -> f64) -> bool {
    let ray = hit / hit.z;
    let mut z = hit.z - 0.2;
    while z > 340.0 {
        if depth(&(ray * z)) > 0.0 {
            return false;
        }
        z -= MARCH_MM;
    }
    true
}

/// A fixed sequence of approximately normal numbers (sum of twelve uniform ones).
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Uniform between 0 and 1.
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}
