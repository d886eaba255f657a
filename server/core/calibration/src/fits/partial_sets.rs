//! Labelling by hypothesis of images that contain only some of the lines.
//!
//! Every lit line lies on a known board. In the plane across the lines each of them is a point, and each light sheet a
//! ray. A hypothesis assigns the lines of three images to orders; it is tested against the lines of all other
//! images. It is accepted only if every other assignment is clearly worse (`docs/maths/calibration.md`, section 3).

use nalgebra::{Vector2, Vector3};
use optics::{LightModelKind, LightSurfaces};
use statistics::median;

use crate::first::board_lines::BoardPiece;
use crate::fits::laser_points::on_pattern;
use crate::fits::light_fit::{Scene, board_hit, fit_light};
use crate::fits::section::{Rays, SectionModel};
use crate::params::{
    BOW_MARGIN, HYPOTHESIS_MARGIN, HYPOTHESIS_MAX_RMS_PITCHES, HYPOTHESIS_OTHER_FRACTION, LASER_REJECT_SIGMAS,
    MIN_LASER_POSES, MIN_LINE_COLUMNS, SAME_LINE_GAP_FRACTION, SECTION_CAP_PITCHES, SECTION_POINTS_PER_LINE,
    SEED_IMAGES, STEP_ROUNDING,
};
use crate::solving::bundle::sheet_residual;
use crate::solving::observation::LaserObservation;

/// A line of an image in the plane across the lines: (across, along the light), mm.
#[derive(Debug, Clone)]
pub(super) struct SectionLine {
    /// Its pieces.
    pieces: Vec<usize>,
    /// Its position.
    pub at: Vector2<f64>,
}

/// A line of an image on its board, camera frame.
struct LineInSpace {
    pieces: Vec<usize>,
    hits: Vec<Vector3<f64>>,
}

/// The lines of one image from the top (left), and the labels they may have.
struct SectionImage {
    lines: Vec<SectionLine>,
    /// Indices into the orders, one list per possible assignment.
    assignments: Vec<Vec<usize>>,
}

/// An assignment for all images with its cost.
struct Hypothesis {
    /// Per image: index of its assignment; `None` where none fits.
    assignments: Vec<Option<usize>>,
    /// Mean square of the lines' distances from their rays, in line pitches.
    cost: f64,
}

/// Assigns the lines of all images to orders; changes nothing and returns `false` if the images do not determine
/// them.
///
/// `lines`: per image its whole lines from the top (left), as indices of pieces. `spacing`: columns between the
/// points used by a fit.
pub(super) fn label_partial_sets(
    pieces: &mut [BoardPiece],
    lines: &[Vec<Vec<usize>>],
    scene: &Scene,
    spacing: usize,
) -> bool {
    let images = images(pieces, lines, scene);
    if images.len() < MIN_LASER_POSES {
        return false;
    }
    let models = SectionModel::candidates(scene);
    let mut hypotheses: Vec<Hypothesis> = models.iter().flat_map(|model| hypotheses(&images, model)).collect();
    hypotheses.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let Some(limit) = hypotheses.first().map(|best| HYPOTHESIS_MARGIN.powi(2) * best.cost) else { return false };
    let mut plausible: Vec<Vec<BoardPiece>> = Vec::new();
    let mut accepted: Vec<&Hypothesis> = Vec::new();
    for hypothesis in hypotheses.iter().take_while(|hypothesis| hypothesis.cost <= limit) {
        let is_new = accepted.iter().all(|other| differs(hypothesis, other, &images));
        if is_new && hypothesis.cost <= HYPOTHESIS_MAX_RMS_PITCHES.powi(2) {
            accepted.push(hypothesis);
            plausible.push(labelled_pieces(pieces, &images, hypothesis, scene));
        }
    }
    let Some(chosen) = best_plausible(plausible, scene, spacing) else { return false };
    pieces.clone_from_slice(&chosen);
    true
}

/// The pieces with the labels of a hypothesis.
fn labelled_pieces(
    pieces: &[BoardPiece],
    images: &[SectionImage],
    hypothesis: &Hypothesis,
    scene: &Scene,
) -> Vec<BoardPiece> {
    let mut labelled = pieces.to_vec();
    for (image, assignment) in images.iter().zip(&hypothesis.assignments) {
        for (idx, line) in image.lines.iter().enumerate() {
            for &piece in &line.pieces {
                labelled[piece].order =
                    assignment.map(|assignment| scene.orders[image.assignments[assignment][idx]]);
            }
        }
    }
    labelled
}

/// The only plausible assignment, or the one whose order 0 is clearly the flattest: assignments shifted by one order
/// differ only in the bow of the lines, and only the undiffracted order has none.
fn best_plausible(mut plausible: Vec<Vec<BoardPiece>>, scene: &Scene, spacing: usize) -> Option<Vec<BoardPiece>> {
    if plausible.len() < 2 {
        return plausible.pop();
    }
    let mut bows = Vec::with_capacity(plausible.len());
    for pieces in &plausible {
        bows.push(bow_of_order_0(pieces, scene, spacing)?);
    }
    let mut sorted = bows.clone();
    sorted.sort_by(f64::total_cmp);
    let best = bows.iter().position(|bow| *bow == sorted[0])?;
    (sorted[1] > BOW_MARGIN * sorted[0]).then(|| plausible.swap_remove(best))
}

/// RMS of the distances in σ between the points labelled 0 and their best plane.
fn bow_of_order_0(pieces: &[BoardPiece], scene: &Scene, spacing: usize) -> Option<f64> {
    let mut laser = on_pattern(pieces, spacing, 1.0);
    laser.retain(|point| point.order == 0);
    let scene = Scene { orders: &[0], ..*scene };
    let plane = fit_light(&scene, &laser, LightModelKind::Planes, None).ok()?.light;
    Some(residual_rms(&scene, &plane, &laser))
}

/// RMS of the points' distances from their curves, in σ.
fn residual_rms(scene: &Scene, light: &LightSurfaces, laser: &[LaserObservation]) -> f64 {
    let z = |point: &LaserObservation| {
        let sheet = sheet_residual(scene.camera, light, &scene.poses[point.block], point, None)?;
        Some((sheet.residual_px / point.sigma_px).powi(2).min(LASER_REJECT_SIGMAS.powi(2)))
    };
    let squares: Vec<f64> = laser.iter().filter_map(z).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Whether two hypotheses assign different labels to many lines: single lines may be clutter.
fn differs(a: &Hypothesis, b: &Hypothesis, images: &[SectionImage]) -> bool {
    let (mut n_lines, mut n_different) = (0, 0);
    for (image, (a, b)) in images.iter().zip(a.assignments.iter().zip(&b.assignments)) {
        n_lines += image.lines.len();
        n_different += if a == b { 0 } else { image.lines.len() };
    }
    n_different as f64 > HYPOTHESIS_OTHER_FRACTION * n_lines as f64
}

/// Every assignment of every three of the fullest images, tested on all images.
fn hypotheses(images: &[SectionImage], model: &SectionModel) -> Vec<Hypothesis> {
    let mut fullest: Vec<usize> = (0..images.len()).collect();
    fullest.sort_by_key(|&idx| std::cmp::Reverse(images[idx].lines.len()));
    fullest.truncate(SEED_IMAGES);
    let mut tried = Vec::new();
    for (i, &a) in fullest.iter().enumerate() {
        for (j, &b) in fullest.iter().enumerate().skip(i + 1) {
            for &c in &fullest[j + 1..] {
                for assignment_a in 0..images[a].assignments.len() {
                    for assignment_b in 0..images[b].assignments.len() {
                        for assignment_c in 0..images[c].assignments.len() {
                            let seed = [(a, assignment_a), (b, assignment_b), (c, assignment_c)];
                            tried.extend(extended_to_all(images, model, &seed));
                        }
                    }
                }
            }
        }
    }
    tried
}

/// The rays of a seed label all images; the rays fitted to all images label them again.
fn extended_to_all(images: &[SectionImage], model: &SectionModel, seed: &[(usize, usize)]) -> Option<Hypothesis> {
    let mut assignments = vec![None; images.len()];
    for &(image, assignment) in seed {
        assignments[image] = Some(assignment);
    }
    let mut made = None;
    for _ in 0..3 {
        let rays = model.rays(&labelled(images, &assignments))?;
        let best: Vec<(Option<usize>, f64)> = images.iter().map(|image| best_assignment(image, &rays)).collect();
        let n_lines: usize = images.iter().map(|image| image.lines.len()).sum();
        let cost = best.iter().map(|(_, cost)| cost).sum::<f64>() / n_lines as f64;
        assignments = best.into_iter().map(|(assignment, _)| assignment).collect();
        made = Some(Hypothesis { assignments: assignments.clone(), cost });
    }
    made
}

/// The labelled lines: (label, position).
fn labelled(images: &[SectionImage], assignments: &[Option<usize>]) -> Vec<(usize, Vector2<f64>)> {
    let of_image = |(image, assignment): (&SectionImage, &Option<usize>)| {
        let labels = assignment.map_or(&[][..], |assignment| &image.assignments[assignment][..]);
        labels.iter().copied().zip(image.lines.iter().map(|line| line.at)).collect::<Vec<_>>()
    };
    images.iter().zip(assignments).flat_map(of_image).collect()
}

/// The assignment with rays closest to the lines, if it is better than none, and the sum of its squares.
fn best_assignment(image: &SectionImage, rays: &Rays) -> (Option<usize>, f64) {
    let cap = SECTION_CAP_PITCHES.powi(2);
    let none = cap * image.lines.len() as f64;
    let cost = |labels: &[usize]| -> f64 {
        let of_line =
            |(line, &label): (&SectionLine, &usize)| rays.distance_pitches(label, &line.at).map(|d| d * d);
        image.lines.iter().zip(labels).map(|pair| of_line(pair).unwrap_or(cap).min(cap)).sum()
    };
    let costs = image.assignments.iter().map(|labels| cost(labels)).enumerate();
    match costs.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((assignment, cost)) if cost < none => (Some(assignment), cost),
        _ => (None, none),
    }
}

/// The images with at least two lines on their boards, each line a point of the section.
fn images(pieces: &[BoardPiece], lines: &[Vec<Vec<usize>>], scene: &Scene) -> Vec<SectionImage> {
    let in_space: Vec<Vec<LineInSpace>> = lines
        .iter()
        .map(|of_image| {
            let all =
                of_image.iter().map(|line| LineInSpace { pieces: line.clone(), hits: hits(pieces, line, scene) });
            all.filter(|line| line.hits.len() >= 2).collect()
        })
        .collect();
    let Some(section) = Section::across(in_space.iter().flatten().map(|line| line.hits.as_slice())) else {
        return Vec::new();
    };
    let image = |of_image: Vec<LineInSpace>| {
        let seen = |line: LineInSpace| SectionLine { pieces: line.pieces, at: section.place_of(&line.hits) };
        let lines = merged(of_image.into_iter().map(seen).collect());
        let assignments = assignments(&lines, scene)?;
        Some(SectionImage { lines, assignments })
    };
    in_space.into_iter().filter(|of_image| of_image.len() >= 2).filter_map(image).collect()
}

/// Merges lines at the same position: they are unjoined pieces of one line.
fn merged(lines: Vec<SectionLine>) -> Vec<SectionLine> {
    let largest = lines.windows(2).map(|pair| (pair[1].at - pair[0].at).norm()).fold(0.0, f64::max);
    let mut merged: Vec<SectionLine> = Vec::with_capacity(lines.len());
    for line in lines {
        match merged.last_mut().filter(|last| (line.at - last.at).norm() < SAME_LINE_GAP_FRACTION * largest) {
            Some(last) => last.pieces.extend(line.pieces),
            None => merged.push(line),
        }
    }
    merged
}

/// Points of a line on its board's pattern; empty for a line with hardly any.
fn hits(pieces: &[BoardPiece], line: &[usize], scene: &Scene) -> Vec<Vector3<f64>> {
    let on_pattern = || line.iter().map(|&idx| &pieces[idx]).filter(|piece| piece.on_pattern);
    let n_points: usize = on_pattern().map(|piece| piece.points.len()).sum();
    if n_points < MIN_LINE_COLUMNS {
        return Vec::new();
    }
    let points = on_pattern().flat_map(|piece| piece.points.iter().map(move |point| (piece.block, point)));
    let step = n_points.div_ceil(SECTION_POINTS_PER_LINE);
    points
        .step_by(step)
        .filter_map(|(block, point)| {
            let pixel = Vector2::new(point.u_px, point.v_px);
            let seen =
                LaserObservation { block, order: 0, pixel, sigma_px: point.sigma_px, effective_weight: 1.0 };
            board_hit(scene.camera, &scene.poses[block], &seen)
        })
        .collect()
}

/// Possible labels of the lines of an image; `None` if their distances show that they are not neighbours of one set.
///
/// Behind a grating the lines are evenly spaced, so that a missing one is visible; of independent lasers any may be
/// missing.
fn assignments(lines: &[SectionLine], scene: &Scene) -> Option<Vec<Vec<usize>>> {
    let n_orders = scene.orders.len();
    if scene.nominal_wavelength_over_period.is_none() {
        return Some(choices(n_orders, lines.len()));
    }
    let gaps: Vec<f64> = lines.windows(2).map(|pair| (pair[1].at - pair[0].at).norm()).collect();
    let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let mut places = vec![0];
    for gap in gaps {
        let steps = gap / smallest;
        if (steps - steps.round()).abs() > STEP_ROUNDING {
            return None;
        }
        places.push(places.last().copied().unwrap_or(0) + steps.round() as usize);
    }
    // Even the smallest gap may contain a missing line.
    let assignments = [1, 2].into_iter().flat_map(|pitches| {
        let places: Vec<usize> = places.iter().map(|at| pitches * at).collect();
        let reach = places.last().copied().unwrap_or(0);
        (0..n_orders.saturating_sub(reach)).map(move |first| places.iter().map(|at| first + at).collect())
    });
    Some(assignments.collect())
}

/// Every increasing choice of `n_chosen` labels.
fn choices(n_labels: usize, n_chosen: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..n_chosen {
        all = all
            .into_iter()
            .flat_map(|chosen: Vec<usize>| {
                let next = chosen.last().map_or(0, |last| last + 1);
                (next..n_labels).map(move |label| [chosen.clone(), vec![label]].concat())
            })
            .collect();
    }
    all
}

/// The plane across the lines, through the middle of the lit points.
struct Section {
    along: Vector3<f64>,
    across: Vector3<f64>,
    away: Vector3<f64>,
    middle_mm: f64,
}

impl Section {
    fn across<'a>(lines: impl Iterator<Item = &'a [Vector3<f64>]> + Clone) -> Option<Self> {
        let chord = |hits: &[Vector3<f64>]| Some(hits.last()? - hits.first()?);
        let along = lines.clone().filter_map(chord).sum::<Vector3<f64>>().try_normalize(0.0)?;
        let away = (Vector3::z() - along * along.z).try_normalize(0.0)?;
        let mut places: Vec<f64> = lines.flatten().map(|hit| hit.dot(&along)).collect();
        let middle_mm = median(&mut places)?;
        Some(Self { along, across: away.cross(&along), away, middle_mm })
    }

    /// Intersection of a straight line through `hits` (at least two) with the plane.
    fn place_of(&self, hits: &[Vector3<f64>]) -> Vector2<f64> {
        let n = hits.len() as f64;
        let mean = hits.iter().sum::<Vector3<f64>>() / n;
        let at = |hit: &Vector3<f64>| (hit - mean).dot(&self.along);
        let spread: f64 = hits.iter().map(|hit| at(hit).powi(2)).sum();
        let slope =
            hits.iter().map(|hit| (hit - mean) * at(hit)).sum::<Vector3<f64>>() / spread.max(f64::MIN_POSITIVE);
        let hit = mean + slope * (self.middle_mm - mean.dot(&self.along));
        Vector2::new(hit.dot(&self.across), hit.dot(&self.away))
    }
}
