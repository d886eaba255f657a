//! The classic baseline: grey-level centroid (centre of gravity) of each line found, one scan column at a time.

use super::lines::candidates::Boxes;
use super::lines::crossing::Crossing;
use super::lines::noise::NoiseMap;
use super::lines::scatter::{Differences, Scatter};
use super::view::{Level, View};
use super::{CentrelinePoint, Centrelines, Segment};
use crate::params::{CENTROID_HALF_HEIGHT_WIDTHS, MIN_SEGMENT_COLUMNS};

/// Passes that centre the window on the line.
const PASSES: usize = 3;

/// Moves every point to the grey-level centroid of its column, with that centroid's scatter; a line ends where a column
/// has none.
pub fn place_at_centroids<T: Level>(view: &View<T>, noise: &NoiseMap, found: &mut Centrelines) {
    let centred = |point: &CentrelinePoint| Some((*point, crossing(view, noise, point)?));
    let mut lines: Vec<Vec<(CentrelinePoint, Crossing)>> = Vec::new();
    for segment in &found.segments {
        let points: Vec<_> = segment.points.iter().map(centred).collect();
        let runs = points.split(Option::is_none).filter(|run| run.len() >= MIN_SEGMENT_COLUMNS);
        lines.extend(runs.map(|run| run.iter().flatten().copied().collect()));
    }
    let crossings: Vec<Vec<Crossing>> =
        lines.iter().map(|line| line.iter().map(|(_, crossing)| *crossing).collect()).collect();
    let scatter = Scatter::measure(crossings.iter().map(Vec::as_slice), 0.0, &mut Differences::default());
    let placed = |(point, crossing): &(CentrelinePoint, Crossing)| CentrelinePoint {
        v_px: crossing.v,
        sigma_px: scatter.variance(crossing).sqrt() * point.normal[1].abs(),
        ..*point
    };
    found.segments = lines.iter().map(|line| Segment { points: line.iter().map(placed).collect() }).collect();
    found.correlation_px = scatter.correlation_px().max(1.0);
}

/// Grey-level centroid above the background near a point, with the coefficients of its noise: a pixel `d` rows from the
/// centroid moves it by `d` over the summed light per grey level. Camera noise is independent between pixels; speckle
/// is proportional to the light and absent where the pixel is at full scale.
fn crossing<T: Level>(view: &View<T>, noise: &NoiseMap, point: &CentrelinePoint) -> Option<Crossing> {
    let u = point.u_px.round() as usize;
    let width_px = point.width_px / point.normal[1].abs().max(0.1) as f32;
    let reach = (CENTROID_HALF_HEIGHT_WIDTHS * width_px).ceil();
    let background = background(view, u, point.v_px as f32, width_px);
    let rows = |middle: f32| {
        let (from, to) = ((middle - reach).round().max(0.0), (middle + reach).round());
        from as usize..(to as usize + 1).min(view.height)
    };
    let light = |row: usize| view.grey(u, row) - background;
    let mut v = point.v_px as f32;
    let mut sum = 0.0;
    for _ in 0..PASSES {
        sum = rows(v).map(light).sum::<f32>();
        let moment: f32 = rows(v).map(|row| light(row) * (row as f32 - v)).sum();
        v += moment / sum;
        if sum <= 0.0 || (v - point.v_px as f32).abs() > width_px {
            return None;
        }
    }
    let (mut camera, mut speckle) = (0.0f32, 0.0f32);
    for row in rows(v) {
        let weight = (row as f32 - v) / sum;
        camera += weight * weight;
        if view.grey(u, row) < view.full_scale {
            speckle += (weight * light(row).max(0.0)).powi(2);
        }
    }
    let sigma = noise.at(u, (v.round().max(0.0) as usize).min(view.height - 1));
    Some(Crossing {
        v: f64::from(v),
        camera_variance: f64::from(camera * sigma * sigma),
        speckle_variance: f64::from(speckle),
        intensity: point.intensity,
        width_px,
    })
}

/// Mean grey level of the two flanks of a line; where one lies outside the image, the other is used for both.
fn background<T: Level>(view: &View<T>, u: usize, v: f32, width_px: f32) -> f32 {
    let Boxes { half_height, flank } = Boxes::for_width(width_px);
    let v = v.round().max(0.0) as usize;
    let mean = |middle: usize| {
        let rows = middle.saturating_sub(half_height)..(middle + half_height + 1).min(view.height);
        let n = rows.len().max(1) as f32;
        rows.map(|row| view.grey(u, row)).sum::<f32>() / n
    };
    let above = v.checked_sub(flank).map(mean);
    let below = (v + flank < view.height).then(|| mean(v + flank));
    let either = above.or(below).unwrap_or(0.0);
    0.5 * (above.unwrap_or(either) + below.unwrap_or(either))
}
