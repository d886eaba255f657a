//! Correction from the centre of a disc's image to the image of the disc's centre (`docs/maths/corners.md`, eq. 4–5).

use nalgebra::{Matrix2, Vector2};
use statistics::median;

use super::super::fitting::warp::BoardWarp;
use super::super::params::{ECCENTRICITY_ROUNDS, RIM_POINTS};
use super::disc::Disc;

/// Corrects every ellipse's centre with the map fitted to all centres; `places` are the discs' grid positions. `None`
/// if the centres do not determine a map.
pub(super) fn to_disc_centres(discs: &[Disc], places: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
    let mut centres: Vec<[f64; 2]> = discs.iter().map(|disc| disc.centre_px).collect();
    for _ in 0..ECCENTRICITY_ROUNDS {
        let pairs: Vec<_> = places.iter().copied().zip(centres.iter().copied()).collect();
        let warp = BoardWarp::fit(&pairs)?;
        let radius = radius(discs, places, &warp);
        for ((centre, disc), place) in centres.iter_mut().zip(discs).zip(places) {
            let shift = eccentricity(&warp, *place, radius)?;
            *centre = [disc.centre_px[0] - shift[0], disc.centre_px[1] - shift[1]];
        }
    }
    Some(centres)
}

/// Radius of the discs in grid steps, from the area of their images: the median.
fn radius(discs: &[Disc], places: &[[f64; 2]], warp: &BoardWarp) -> f64 {
    let of = |(disc, place): (&Disc, &[f64; 2])| {
        let [c, r] = warp.shape_at(*place).square_px;
        (disc.area_px2 / std::f64::consts::PI / (c[0] * r[1] - c[1] * r[0]).abs()).sqrt()
    };
    let mut radii: Vec<f64> = discs.iter().zip(places).map(of).collect();
    median(&mut radii).unwrap_or(0.0)
}

/// Offset (px) of the centre of the ellipse that best fits the disc's rim from the image of the disc's centre.
///
/// For each pair of opposite rim points, the midpoint minus the image of the centre is the part that no ellipse about
/// that centre can represent. The shift is the least-squares fit of these parts along the rim's normals.
fn eccentricity(warp: &BoardWarp, place: [f64; 2], radius: f64) -> Option<[f64; 2]> {
    let centre = warp.at(place);
    let on_rim = |k: usize| {
        let angle = 2.0 * std::f64::consts::PI * k as f64 / RIM_POINTS as f64;
        let [u, v] = warp.at([place[0] + radius * angle.cos(), place[1] + radius * angle.sin()]);
        Vector2::new(u - centre[0], v - centre[1])
    };
    let rim: Vec<Vector2<f64>> = (0..RIM_POINTS).map(on_rim).collect();
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for k in 0..RIM_POINTS {
        let opposite = rim[(k + RIM_POINTS / 2) % RIM_POINTS];
        let tangent = rim[(k + 1) % RIM_POINTS] - rim[(k + RIM_POINTS - 1) % RIM_POINTS];
        // n·nᵀ ds with the normal n: the outer product of the tangent's perpendicular over its length.
        let across = Vector2::new(-tangent.y, tangent.x);
        let weighted = across * across.transpose() / across.norm();
        normal += weighted;
        right += weighted * (0.5 * (rim[k] + opposite));
    }
    Some((normal.try_inverse()? * right).into())
}
