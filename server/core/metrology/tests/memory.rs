//! Memory needed by a mesh and a measurement in addition to the cloud: a server may compute many while the laser is on.

#![allow(clippy::unwrap_used)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use metrology::{MeasureRequest, Tool, measure};
use scanning::{Cloud, CloudPoint, MeshParams, mesh_from_cloud};

/// Largest allocation at one time in addition to the cloud, bytes per point. A point of the cloud has 48.
const MEASUREMENT_BYTES: usize = 64;
const MESH_BYTES: usize = 112;

static HELD: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// Counts the allocated bytes.
struct Counting;

#[expect(unsafe_code, reason = "an allocator that counts cannot be written without")]
// SAFETY: every request is forwarded to the system allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        PEAK.fetch_max(HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size(), Ordering::Relaxed);
        // SAFETY: guaranteed by the caller.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: guaranteed by the caller.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Peak of the allocated bytes during `work`, relative to those before it.
fn peak_bytes<T>(work: impl FnOnce() -> T) -> (usize, T) {
    let before = HELD.load(Ordering::Relaxed);
    PEAK.store(before, Ordering::Relaxed);
    let done = work();
    (PEAK.load(Ordering::Relaxed) - before, done)
}

/// A block of 5 mm on a table, scanned by five orders in 120 frames: 360,000 points.
fn block_on_table() -> Cloud {
    let (n_frames, n_along) = (120, 600);
    let at = |frame: u32, order: i8, along: u32| {
        let x_mm = f64::from(along) * 0.1 - 30.0;
        let y_mm = f64::from(frame) * 0.2 + f64::from(order) * 4.0;
        let on_block = x_mm.abs() < 12.0 && (y_mm - 12.0).abs() < 8.0;
        // Noise that repeats periodically is sufficient here.
        let noise_mm = 0.01 * f64::from((frame * 31 + along * 17) % 13) / 6.0 - 0.01;
        CloudPoint {
            x_mm,
            y_mm,
            z_mm: if on_block { 395.0 } else { 400.0 } + noise_mm,
            order,
            frame,
            u_px: along as f32,
            v_px: 500.0 + 40.0 * f32::from(order),
            intensity: 120.0,
            sigma_mm: 0.01,
        }
    };
    let points = (0..n_frames)
        .flat_map(|frame| (-2..=2).flat_map(move |order| (0..n_along).map(move |along| at(frame, order, along))));
    Cloud { points: points.collect(), comments: Vec::new() }
}

/// One test, because the count is global.
#[test]
fn a_mesh_and_a_measurement_take_little_more_than_the_cloud() {
    let cloud = block_on_table();
    let n_points = cloud.points.len();
    for tool in [Tool::Plane, Tool::Step, Tool::Flatness] {
        let (bytes, measured) = peak_bytes(|| measure(&cloud, None, &MeasureRequest::new(tool)));
        let value = measured.unwrap().value;
        assert!(tool != Tool::Step || (value - 5.0).abs() < 0.01, "step of {value} mm");
        assert!(bytes <= MEASUREMENT_BYTES * n_points, "{tool}: {} bytes a point", bytes / n_points);
    }
    let (bytes, mesh) = peak_bytes(|| mesh_from_cloud(&cloud, &MeshParams::default()));
    assert!(mesh.triangles.len() > n_points / 5, "{} triangles", mesh.triangles.len());
    assert!(bytes <= MESH_BYTES * n_points, "mesh: {} bytes a point", bytes / n_points);
}
