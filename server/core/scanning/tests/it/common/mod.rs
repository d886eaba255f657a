//! Stations and scenes with known truth for the tests of labelling.

pub mod planes;
pub mod random;
pub mod rendered;
pub mod rig_a;
pub mod scene;
pub mod splatted;
pub mod truth_lines;
pub mod watched;

use nalgebra::{DMatrix, Vector3};
use optics::{Calibration, Camera, DepthRangeMm, Grating, LightSurfaces, StageAxis};
use scanning::ScanFrame;
use vision::{CentrelinePoint, Centrelines, LineDirection, Segment};

/// Stated noise of the test points, px: a typical extraction.
pub const SIGMA_PX: f64 = 0.05;

/// A scan with the true order of every point.
pub struct KnownScan {
    pub frames: Vec<ScanFrame>,
    /// Per frame, segment, point: the true order; `None` for reflections.
    pub orders: Vec<Vec<Vec<Option<i8>>>>,
}

impl KnownScan {
    /// The true order at a pixel of a frame.
    pub fn order_at(&self, frame: usize, u_px: f32, v_px: f32) -> Option<i8> {
        let lines = &self.frames[frame].centrelines;
        for (segment, orders) in lines.segments.iter().zip(&self.orders[frame]) {
            for (point, order) in segment.points.iter().zip(orders) {
                if (point.u_px as f32, point.v_px as f32) == (u_px, v_px) {
                    return *order;
                }
            }
        }
        None
    }

    /// Number of points that are on the part.
    pub fn n_true(&self) -> usize {
        self.orders.iter().flatten().flatten().filter(|order| order.is_some()).count()
    }

    /// (fraction of true points recovered, points with a wrong order or on no surface).
    pub fn score(&self, result: &scanning::ScanResult) -> (f64, usize) {
        let mut right = 0;
        let mut wrong = 0;
        for (frame, lines) in self.frames.iter().enumerate() {
            let mut truth = std::collections::HashMap::new();
            for (segment, orders) in lines.centrelines.segments.iter().zip(&self.orders[frame]) {
                for (point, order) in segment.points.iter().zip(orders) {
                    truth.insert(((point.u_px as f32).to_bits(), (point.v_px as f32).to_bits()), *order);
                }
            }
            for point in result.cloud.points.iter().filter(|point| point.frame as usize == frame) {
                match truth[&(point.u_px.to_bits(), point.v_px.to_bits())] {
                    Some(order) if order == point.order => right += 1,
                    _ => wrong += 1,
                }
            }
        }
        (right as f64 / self.n_true() as f64, wrong)
    }
}

/// Asserts that at least `share` of the points is recovered and none has a wrong order.
pub fn assert_labelled(
    name: &str,
    scan: &KnownScan,
    calibration: &Calibration,
    share: f64,
) -> scanning::ScanResult {
    let result = scanning::scan_cloud(&scan.frames, calibration, &scanning::ScanParams::default()).unwrap();
    let (recovered, wrong) = scan.score(&result);
    eprintln!("{name}: recovered {:.3} %, wrong {wrong}, dropped {:?}", 100.0 * recovered, result.report.dropped);
    if std::env::var_os("EXPLAIN").is_some() {
        explain(scan, &result);
    }
    for pair in &result.report.self_consistency {
        eprintln!("  {pair:?}");
    }
    assert_eq!(wrong, 0, "{name}: points of a wrong order");
    assert!(recovered >= share, "{name}: recovered {recovered} of the points");
    result
}

/// Pieces of lines from points (u, v, order), one per column (row); a new segment where the column is not the next.
pub fn segments(
    points: &[(f64, f64, Option<i8>)],
    direction: LineDirection,
) -> (Vec<Segment>, Vec<Vec<Option<i8>>>) {
    let mut segments: Vec<Segment> = Vec::new();
    let mut orders: Vec<Vec<Option<i8>>> = Vec::new();
    let mut last = f64::NAN;
    for &(u_px, v_px, order) in points {
        let (along, normal) = match direction {
            LineDirection::Rows => (u_px, [0.0, 1.0]),
            LineDirection::Columns => (v_px, [1.0, 0.0]),
        };
        let point = CentrelinePoint {
            u_px,
            v_px,
            normal,
            sigma_px: SIGMA_PX,
            intensity: 100.0,
            width_px: 5.0,
            saturated: false,
        };
        let across_jump =
            segments.last().and_then(|s| s.points.last()).is_some_and(|last: &CentrelinePoint| match direction {
                LineDirection::Rows => (last.v_px - v_px).abs() > 2.0,
                LineDirection::Columns => (last.u_px - u_px).abs() > 2.0,
            });
        let follows = along > last && along - last < 1.5;
        if !follows || across_jump {
            segments.push(Segment::default());
            orders.push(Vec::new());
        }
        last = along;
        segments.last_mut().unwrap().points.push(point);
        orders.last_mut().unwrap().push(order);
    }
    (segments, orders)
}

/// A station of 640 × 512 pixels at 400 mm with the given order count; `turned`: lines along columns.
pub fn station(n_orders: i8, turned: bool) -> Calibration {
    let swap = |v: Vector3<f64>| if turned { Vector3::new(v.y, v.x, v.z) } else { v };
    let normal = Vector3::new(-0.013, 0.387, 0.922).normalize();
    let axis = Vector3::new(-0.001, 0.409, 0.913).normalize();
    let fan = Vector3::new(1.0, 0.0034, 0.0);
    let fan = (fan - axis * fan.dot(&axis)).normalize();
    let groove = Vector3::new(1.0, 0.0087, 0.0105);
    let groove = (groove - normal * groove.dot(&normal)).normalize();
    // Exchanging x and y is a reflection, which reverses the period direction n × g: g is reversed to restore it.
    let groove = if turned { -groove } else { groove };
    let grating = Grating {
        source_mm: swap(Vector3::new(1.0, -174.0, 11.0)),
        axis: swap(axis),
        fan: swap(fan),
        normal: swap(normal),
        groove: swap(groove),
        gap_mm: 18.5,
        wavelength_over_period: 0.033,
    };
    let (width_px, height_px) = if turned { (512, 640) } else { (640, 512) };
    let camera = Camera::from_opencv(
        width_px,
        height_px,
        [[1260.0, 0.0, width_px as f64 / 2.0], [0.0, 1259.0, height_px as f64 / 2.0], [0.0, 0.0, 1.0]],
        &[-0.09, 0.11, 0.0, 0.0, 0.0],
    );
    let half = n_orders / 2;
    Calibration {
        id: "test".into(),
        camera,
        orders: (-half..=n_orders - 1 - half).collect(),
        light: LightSurfaces::Grating(grating),
        stage: Some(StageAxis::new(swap(Vector3::new(-0.005, 0.9998, -0.02))).into()),
        depth_range_mm: DepthRangeMm { near_mm: 345.0, far_mm: 455.0 },
        covariance: DMatrix::from_diagonal_element(22, 22, 1e-10),
    }
}

/// Centrelines from segments.
pub fn centrelines(segments: Vec<Segment>, direction: LineDirection) -> Centrelines {
    Centrelines { segments, direction, correlation_px: 2.0, lit_line: None }
}

/// Prints, per piece-sized run of points, what was lost or wrong; for debugging a failure.
pub fn explain(scan: &KnownScan, result: &scanning::ScanResult) {
    let mut found = std::collections::HashMap::new();
    for point in &result.cloud.points {
        found.insert((point.frame, point.u_px.to_bits(), point.v_px.to_bits()), point.order);
    }
    for (frame, lines) in scan.frames.iter().enumerate() {
        for (segment, orders) in lines.centrelines.segments.iter().zip(&scan.orders[frame]) {
            let given: Vec<Option<i8>> = segment
                .points
                .iter()
                .map(|p| found.get(&(frame as u32, (p.u_px as f32).to_bits(), (p.v_px as f32).to_bits())).copied())
                .collect();
            let mut first = 0;
            for idx in 1..=given.len() {
                if idx == given.len() || given[idx] != given[first] || orders[idx] != orders[first] {
                    if given[first] != orders[first] {
                        let (a, b) = (&segment.points[first], &segment.points[idx - 1]);
                        eprintln!(
                            "frame {frame}: true {:?} given {:?}, {} of {} points, ({:.0}, {:.0})–({:.0}, {:.0})",
                            orders[first],
                            given[first],
                            idx - first,
                            given.len(),
                            a.u_px,
                            a.v_px,
                            b.u_px,
                            b.v_px
                        );
                    }
                    first = idx;
                }
            }
        }
    }
}
