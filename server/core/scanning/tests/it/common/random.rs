//! Random stations and parts that were not used to tune the parameters.

use nalgebra::{DMatrix, Rotation3, Vector3};
use optics::{Calibration, Grating, LightSurfaces};
use vision::{CentrelinePoint, LineDirection, Segment};

use super::planes::fitted_planes;
use super::scene::{Noise, scan_with};
use super::{KnownScan, SIGMA_PX, station};

/// Ratio of the noise to the stated σ.
const UNDERSTATED: f64 = 1.3;
/// Largest gap and largest step across which an extractor merges two lines, px.
const JOIN_PX: f64 = 1.5;
/// Lines closer to each other than this are extracted as one, px.
const LINE_WIDTH_PX: f64 = 5.0;
/// Deepest and highest ground, mm.
const GROUND_MM: [f64; 2] = [395.0, 430.0];

/// A random scene with its station.
pub struct Trial {
    /// The calibration passed to the labelling: sometimes plane models.
    pub calibration: Calibration,
    pub known: KnownScan,
    pub name: String,
}

/// Random numbers of various distributions.
struct RandomNumbers(Noise);

impl RandomNumbers {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.uniform()
    }

    fn chance(&mut self, share: f64) -> bool {
        self.0.uniform() < share
    }

    fn count(&mut self, low: usize, high: usize) -> usize {
        (self.between(low as f64, high as f64 + 1.0) as usize).min(high)
    }
}

/// The scene of a seed: stairs, islands, spheres, boxes, domes, wedges, ghosts and gaps; 3–9 orders; either direction
/// of lines; steps of 0.2–2 mm over a short or long travel; occasionally plane models.
pub fn trial(seed: u64) -> Trial {
    let mut random = RandomNumbers(Noise(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5DEE_CE66));
    (0..8).for_each(|_| {
        random.0.uniform();
    });
    let n_orders = random.count(3, 9) as i8;
    let turned = random.chance(0.5);
    let exact = random_station(&mut random, n_orders, turned);
    let with_planes = random.chance(0.15);
    let step_mm = 0.2 * 10f64.powf(random.between(0.0, 1.0));
    let n_frames = (random.between(4.0, 45.0) / step_mm).clamp(4.0, 40.0) as usize;
    let positions: Vec<f64> = (0..n_frames).map(|i| (i as f64 - (n_frames - 1) as f64 / 2.0) * step_mm).collect();
    let part = random_part(&mut random);
    let surface = |x: f64, y: f64| if turned { part(y, x) } else { part(x, y) };
    let mut known = scan_with(&exact, &surface, &positions, turned, UNDERSTATED, seed);
    let direction = if turned { LineDirection::Columns } else { LineDirection::Rows };
    if random.chance(0.5) {
        cut_gaps(&mut random, &mut known);
    }
    join_touching(&mut known, direction);
    let ghosts = random.chance(0.4);
    if ghosts {
        add_ghosts(&mut random, &mut known, &exact, direction);
    }
    let calibration = if with_planes { fitted_planes(&exact) } else { exact };
    let name = format!(
        "seed {seed}: {n_orders} orders, {direction:?}, {n_frames} × {step_mm:.2} mm{}{}",
        if with_planes { ", planes" } else { "" },
        if ghosts { ", ghosts" } else { "" }
    );
    Trial { calibration, known, name }
}

/// The test station with another grating, slightly rotated.
fn random_station(random: &mut RandomNumbers, n_orders: i8, turned: bool) -> Calibration {
    let mut station = station(n_orders, turned);
    let LightSurfaces::Grating(grating) = &station.light else { panic!("station without grating") };
    let small = |random: &mut RandomNumbers| Vector3::from_fn(|_, _| random.between(-0.02, 0.02));
    let (tilt, turn) = (Rotation3::new(small(random)), Rotation3::new(small(random)));
    let (axis, fan) = (turn * grating.axis, turn * grating.fan);
    let (normal, groove) = (tilt * grating.normal, tilt * grating.groove);
    let moved = Grating {
        source_mm: grating.source_mm * random.between(0.8, 1.2),
        axis,
        fan: (fan - axis * fan.dot(&axis)).normalize(),
        normal,
        groove: (groove - normal * groove.dot(&normal)).normalize(),
        gap_mm: grating.gap_mm,
        wavelength_over_period: random.between(0.022, 0.05),
    };
    station.light = LightSurfaces::Grating(moved);
    station.covariance = DMatrix::from_diagonal_element(22, 22, 1e-10);
    station
}

/// A height over the ground at (x, y), zero outside the part.
type Body = Box<dyn Fn(f64, f64) -> f64 + Send + Sync>;

fn random_part(random: &mut RandomNumbers) -> impl Fn(f64, f64) -> f64 + Sync + use<> {
    let ground = random.between(GROUND_MM[0], GROUND_MM[1]);
    let steepness = if random.chance(0.3) { 0.5 } else { 0.12 };
    let tilt = [random.between(-0.2, 0.2), random.between(-steepness, steepness)];
    let bodies: Vec<Body> = (0..random.count(1, 7)).map(|_| random_body(random)).collect();
    move |x, y| {
        let height = bodies.iter().map(|body| body(x, y)).fold(0.0, f64::max);
        (ground + tilt[0] * x + tilt[1] * y - height).clamp(348.0, 452.0)
    }
}

fn random_body(random: &mut RandomNumbers) -> Body {
    let (x0, y0) = (random.between(-80.0, 80.0), random.between(-45.0, 45.0));
    let (a, b) = (random.between(3.0, 22.0), random.between(3.0, 22.0));
    let height = if random.chance(0.3) { random.between(18.0, 32.0) } else { random.between(1.0, 48.0) };
    let (sin, cos) = if random.chance(0.5) { (0.0, 1.0) } else { random.between(0.0, 3.1).sin_cos() };
    let local = move |x: f64, y: f64| {
        let (x, y) = (x - x0, y - y0);
        ((x * cos + y * sin) / a, (y * cos - x * sin) / b)
    };
    let lean = random.between(-0.3, 0.3);
    match random.count(0, 6) {
        0 | 1 => Box::new(move |x, y| {
            let (u, v) = local(x, y);
            if u.abs() < 1.0 && v.abs() < 1.0 { height } else { 0.0 }
        }),
        2 => Box::new(move |x, y| {
            let (u, v) = local(x, y);
            height * (1.0 - u * u - v * v).max(0.0).sqrt()
        }),
        3 => {
            // A sphere on the ground.
            let radius = random.between(6.0, 24.0);
            Box::new(move |x, y| {
                let squared = radius * radius - (x - x0).powi(2) - (y - y0).powi(2);
                if squared > 0.0 { radius + squared.sqrt() } else { 0.0 }
            })
        }
        4 => {
            let (n, along) = (random.between(2.0, 5.0), random.chance(0.5));
            Box::new(move |x, y| {
                let (u, v) = local(x, y);
                let place = if along { u } else { v };
                let inside = u.abs() < 2.0 && v.abs() < 2.0;
                if inside { height * ((place + 2.0) / 4.0 * n).ceil() / n.ceil() } else { 0.0 }
            })
        }
        5 => {
            let (px, py, side) = (random.between(6.0, 30.0), random.between(6.0, 30.0), random.between(1.5, 4.0));
            Box::new(move |x, y| {
                let (dx, dy) = ((x - x0).rem_euclid(px) - px / 2.0, (y - y0).rem_euclid(py) - py / 2.0);
                if dx.abs() < side && dy.abs() < side { 0.5 * height } else { 0.0 }
            })
        }
        _ => Box::new(move |x, y| {
            // A wedge.
            let (u, v) = local(x, y);
            if u.abs() < 1.5 && v.abs() < 1.5 { height * (0.5 + lean * u + 0.3 * v) } else { 0.0 }
        }),
    }
}

/// Removes points: dark patches on the part or in the image, and occasional single points.
fn cut_gaps(random: &mut RandomNumbers, known: &mut KnownScan) {
    let dark: Vec<[f64; 3]> = (0..random.count(1, 6))
        .map(|_| [random.between(0.0, 640.0), random.between(0.0, 640.0), random.between(5.0, 60.0)])
        .collect();
    let drift = if random.chance(0.5) { random.between(1.0, 4.0) } else { 0.0 };
    let single = random.between(0.0, 0.02);
    for (frame, scanned) in known.frames.iter_mut().enumerate() {
        let mut segments = Vec::new();
        let mut orders = Vec::new();
        for (segment, truth) in scanned.centrelines.segments.iter().zip(&known.orders[frame]) {
            let (mut points, mut kept) = (Vec::new(), Vec::new());
            for (point, order) in segment.points.iter().zip(truth) {
                let hidden = dark.iter().any(|[u, v, size]| {
                    (point.u_px - u).abs() < *size && (point.v_px - v - drift * frame as f64).abs() < *size
                });
                if hidden || random.chance(single) {
                    segments.push(Segment { points: std::mem::take(&mut points) });
                    orders.push(std::mem::take(&mut kept));
                } else {
                    points.push(*point);
                    kept.push(*order);
                }
            }
            segments.push(Segment { points });
            orders.push(kept);
        }
        scanned.centrelines.segments = segments.into_iter().filter(|segment| !segment.points.is_empty()).collect();
        known.orders[frame] = orders.into_iter().filter(|orders| !orders.is_empty()).collect();
    }
}

/// Joins lines whose ends touch, as an extractor without knowledge of orders does.
fn join_touching(known: &mut KnownScan, direction: LineDirection) {
    let place = |p: &CentrelinePoint| p.along_across(direction);
    for (frame, scanned) in known.frames.iter_mut().enumerate() {
        let segments = &mut scanned.centrelines.segments;
        let orders = &mut known.orders[frame];
        let mut idx = 0;
        while idx < segments.len() {
            let end = place(&segments[idx].points[segments[idx].points.len() - 1]);
            let follows = |segment: &Segment| {
                let start = place(&segment.points[0]);
                let gap = start.0 - end.0;
                gap > 0.0 && gap < JOIN_PX && (start.1 - end.1).abs() < JOIN_PX
            };
            let Some(next) = segments.iter().position(follows).filter(|&next| next != idx) else {
                idx += 1;
                continue;
            };
            let (tail, tail_orders) = (segments.remove(next), orders.remove(next));
            if next < idx {
                idx -= 1;
            }
            segments[idx].points.extend(tail.points);
            orders[idx].extend(tail_orders);
        }
    }
}

/// Stationary or moving reflections, and random pieces.
fn add_ghosts(random: &mut RandomNumbers, known: &mut KnownScan, station: &Calibration, direction: LineDirection) {
    let turned = direction == LineDirection::Columns;
    let (length, width) = if turned {
        (station.camera.height_px, station.camera.width_px)
    } else {
        (station.camera.width_px, station.camera.height_px)
    };
    let (length, width) = (length as f64, width as f64);
    let wanderers: Vec<[f64; 5]> = (0..random.count(0, 3))
        .map(|_| {
            let first = random.between(0.0, length - 100.0);
            let drift = if random.chance(0.4) { 0.0 } else { random.between(-3.0, 3.0) };
            [
                first,
                first + random.between(15.0, 100.0),
                random.between(0.2, 0.8) * width,
                drift,
                random.between(-0.1, 0.1),
            ]
        })
        .collect();
    let mut noise = Noise(99);
    for (frame, scanned) in known.frames.iter_mut().enumerate() {
        let chance = (0..random.count(0, 4)).map(|_| {
            let first = random.between(0.0, length - 20.0);
            [
                first,
                first + random.between(4.0, 18.0),
                random.between(0.1, 0.9) * width,
                0.0,
                random.between(-0.2, 0.2),
            ]
        });
        let chance: Vec<[f64; 5]> = chance.collect();
        for [first, last, across, drift, slope] in wanderers.iter().copied().chain(chance) {
            let at = |along: i64| {
                across + drift * frame as f64 + slope * (along as f64 - first) + noise.next() * SIGMA_PX
            };
            let columns: Vec<i64> = (first as i64..last as i64).collect();
            let places: Vec<f64> = columns.iter().copied().map(at).collect();
            let points: Vec<CentrelinePoint> = columns
                .iter()
                .zip(places)
                .map(|(&along, across)| CentrelinePoint {
                    u_px: if turned { across } else { along as f64 },
                    v_px: if turned { along as f64 } else { across },
                    normal: if turned { [1.0, 0.0] } else { [0.0, 1.0] },
                    sigma_px: SIGMA_PX,
                    intensity: 20.0,
                    width_px: 5.0,
                    saturated: false,
                })
                .collect();
            let place = |p: &CentrelinePoint| if turned { (p.v_px, p.u_px) } else { (p.u_px, p.v_px) };
            let hides_line = scanned.centrelines.segments.iter().flat_map(|segment| &segment.points).any(|line| {
                let (along, across) = place(line);
                let idx = along.round() - first.floor();
                idx >= 0.0 && points.get(idx as usize).is_some_and(|p| (place(p).1 - across).abs() < LINE_WIDTH_PX)
            });
            if hides_line {
                continue;
            }
            known.orders[frame].push(vec![None; points.len()]);
            scanned.centrelines.segments.push(Segment { points });
        }
    }
}
