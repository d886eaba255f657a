//! A frame's labels against themselves on other instruction sets; whether they are right is for `tests/it/one_frame.rs`.

use super::*;
use crate::synthetic::SyntheticScan;

/// Points of a usual frame.
const N_POINTS: usize = 2_000;

#[test]
fn every_instruction_set_decides_alike() {
    let scan = SyntheticScan::new(1, N_POINTS);
    let centrelines = scan.frame(0).centrelines;
    let n_orders = scan.calibration.orders.len();
    let triangulator = Triangulator::new(scan.calibration.clone());
    let mut found = FrameLabels::default();
    found.find(&centrelines, &triangulator, scan.calibration.depth_range_mm);
    assert!(!found.verdicts.is_empty());
    // Called from here the same is compiled for what every machine of this architecture has.
    let mut plain = FrameLabels::default();
    let FrameLabels { lines, pieces, cutter, .. } = &mut plain;
    lines.take(&centrelines);
    cutter.cut(lines, centrelines.correlation_px, pieces);
    assert_eq!(plain.pieces, found.pieces);
    let FrameLabels { pieces, places, neighbours, few, many, before, .. } = &mut found;
    few.decide(places, pieces, n_orders, neighbours, &mut plain.verdicts);
    assert_eq!(&plain.verdicts, before);
    many.decide(places, pieces, n_orders, neighbours, &mut plain.verdicts);
    assert_eq!(&plain.verdicts, before);
}
