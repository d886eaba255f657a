//! Crossings of laser lines with the rim of a plane.
//!
//! A line that ends at a rim fades over its blur: at a distance a from the rim, across the rim, its intensity is Φ(a/σ) of
//! the full intensity (eq. 12 of `docs/maths/metrology.md`), regardless of the extraction threshold, below which points are
//! lost. A rim crossed at a small angle cuts the sheet along its thickness, where neither height nor intensity locate the
//! rim; such crossings are excluded later.

use nalgebra::Vector3;
use statistics::median;
use statrs::distribution::{ContinuousCDF as _, Normal};

use crate::fitting::features::FeatureFit;
use crate::fitting::robust::normalised_distance;
use crate::fitting::sample::Samples;
use crate::measuring::noise::spacing_px;
use crate::params::{RIM_FULL_LIGHT_POINTS, RIM_GAP_SPACINGS, RIM_MIN_RUN_POINTS, RIM_REACH_LINE_SIGMAS};

/// Points within this many trims of a plane belong to it in the search for its rim.
const ON_PLANE_TRIMS: f64 = 2.0;

/// The crossing of a laser line with a rim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// The last point on the plane.
    pub(crate) sample_idx: u32,
    /// From that point to the rim, part frame, mm.
    pub(crate) offset: Vector3<f64>,
    /// From that point to the line as it runs further in, mm: where a rim is crossed obliquely, only one side of the line
    /// is left at its end.
    onto_line: Vector3<f64>,
    /// Unit vector along the line, away from the plane.
    pub(crate) outwards: Vector3<f64>,
    /// Blur of this end along its line (one σ, mm), up to infinity; `None` if the intensity does not fall before the line
    /// ends.
    pub(crate) blur_along_mm: Option<f64>,
    /// The point whose intensity is closest to [`FADING_AT`]; `None` if the intensity does not fall before the line ends.
    fading: Option<Fading>,
}

/// A point of reduced intensity.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fading {
    /// Distance from the last point back to it, mm.
    back_mm: f64,
    /// Its distance inside the rim, in blurs (one σ).
    inside_blurs: f64,
}

impl Crossing {
    /// Whether the intensity locates the rim.
    pub(crate) fn has_faded(&self) -> bool {
        self.fading.is_some()
    }

    /// The crossing of a rim with the unit normal `across` (in the plane, away from the material) whose blur across is
    /// `blur_mm`.
    pub(crate) fn of_rim(&self, across: &Vector3<f64>, blur_mm: f64) -> Self {
        let Some(Fading { back_mm, inside_blurs }) = self.fading else { return *self };
        let from_line = across * (inside_blurs * blur_mm) - self.outwards * back_mm;
        Self { offset: self.onto_line + from_line, ..*self }
    }
}

/// The ends of lines on a plane, among the candidates. A line that continues outside the candidates does not end there.
pub(crate) fn crossings(samples: &Samples, plane: &FeatureFit, candidates: &[u32]) -> Vec<Crossing> {
    let reach_mm = RIM_REACH_LINE_SIGMAS / 3.0 * samples.border_margin_mm();
    let is_on_plane = |idx: u32| {
        let sample = samples.at(idx);
        normalised_distance(&plane.shape, &sample).abs() <= ON_PLANE_TRIMS * plane.trim
            || plane.shape.distance_mm(&sample.in_part.xyz).abs() <= reach_mm
    };
    let mut spacings: Vec<f64> = candidates
        .windows(2)
        .filter(|pair| pair[1] == pair[0] + 1)
        .filter_map(|pair| spacing_px(samples, pair[0], pair[1]))
        .collect();
    let Some(spacing_px) = median(&mut spacings) else { return Vec::new() };
    let walk = Walk { samples, is_on_plane: &is_on_plane, gap_px: RIM_GAP_SPACINGS * spacing_px };
    let on_plane = candidates.iter().filter(|idx| is_on_plane(**idx));
    let ends: Vec<End> = on_plane.flat_map(|idx| [1, -1].map(|step| walk.end(*idx, step))).flatten().collect();
    ends.iter().map(End::crossing).collect()
}

/// The end of a line.
struct End {
    last: u32,
    outwards: Vector3<f64>,
    onto_line: Vector3<f64>,
    spacing_mm: f64,
    /// Fraction of the full intensity, from the last point inwards.
    shares: Vec<f64>,
}

impl End {
    /// How many points the fading extends over, at least the last one. Further in, speckle alone dims points.
    fn n_fading(&self) -> usize {
        let full = self.shares.iter().position(|share| *share >= FULL_FRACTION).unwrap_or(self.shares.len());
        full.clamp(1, RIM_MIN_RUN_POINTS)
    }

    /// Blur of this end along the line (one σ, mm), from a point of reduced intensity and the next one further in: that of
    /// a pixel if the next one has the full intensity already, infinite if it is no brighter. Its median over many ends
    /// counts all of them: without those whose next point is bright, it would lack the sharp ones.
    fn blur_mm(&self) -> Option<f64> {
        let near = self.shares.get(..=self.n_fading())?;
        let pair = near.windows(2).find(|pair| is_fading(pair[0]))?;
        let n_blurs = quantile(pair[1].clamp(0.0, 1.0)) - quantile(pair[0]);
        let spacings = if n_blurs > 0.0 { n_blurs.recip() } else { f64::INFINITY };
        Some(self.spacing_mm * spacings.max(PIXEL_BLUR))
    }

    /// The crossing before the rim's direction is known: half a spacing beyond the last point.
    fn crossing(&self) -> Crossing {
        let fading = self.shares.iter().enumerate().take(self.n_fading()).filter(|(_, share)| is_fading(**share));
        let middle = fading.min_by(|a, b| (a.1 - FADING_AT).abs().total_cmp(&(b.1 - FADING_AT).abs()));
        Crossing {
            sample_idx: self.last,
            offset: self.onto_line + self.outwards * (self.spacing_mm / 2.0),
            onto_line: self.onto_line,
            outwards: self.outwards,
            blur_along_mm: self.blur_mm(),
            fading: middle
                .map(|(k, share)| Fading { back_mm: k as f64 * self.spacing_mm, inside_blurs: quantile(*share) }),
        }
    }
}

/// Whether a fraction of the full intensity determines the distance to the rim.
fn is_fading(share: f64) -> bool {
    (FADING_FRACTION..1.0 - FADING_FRACTION).contains(&share)
}

/// Fraction of the full intensity at which fading ends: one σ of the blur inside the rim.
const FULL_FRACTION: f64 = 0.84;

/// Fraction of the full intensity that locates the rim best: there a line is as high at all angles to the rim; less
/// remains longer of a thick line that the rim cuts obliquely.
const FADING_AT: f64 = 0.75;

/// Fractions closer than this to 0 or 1 are dominated by noise.
const FADING_FRACTION: f64 = 0.05;

/// Blur by the extent of a pixel, one σ in pixels: 1/√12.
const PIXEL_BLUR: f64 = 0.289;

/// Quantile of the standard normal distribution.
fn quantile(share: f64) -> f64 {
    Normal::standard().inverse_cdf(share)
}

struct Walk<'a> {
    samples: &'a Samples<'a>,
    is_on_plane: &'a dyn Fn(u32) -> bool,
    gap_px: f64,
}

impl Walk<'_> {
    /// The neighbouring point of the same line on the plane.
    fn next(&self, idx: u32, step: i64) -> Option<u32> {
        let next =
            u32::try_from(i64::from(idx) + step).ok().filter(|next| (*next as usize) < self.samples.len())?;
        let px = spacing_px(self.samples, idx, next)?;
        (px <= self.gap_px && (self.is_on_plane)(next)).then_some(next)
    }

    /// The end of a line at `last`; `None` if the line continues in the direction of `step` or is too short.
    fn end(&self, last: u32, step: i64) -> Option<End> {
        if self.next(last, step).is_some() {
            return None;
        }
        let mut run = vec![last];
        while run.len() < RIM_FULL_LIGHT_POINTS.end
            && let Some(inwards) = self.next(run[run.len() - 1], -step)
        {
            run.push(inwards);
        }
        if run.len() < RIM_MIN_RUN_POINTS {
            return None;
        }
        let light = |k: usize| f64::from(self.samples.point(run[k]).intensity);
        let start = RIM_FULL_LIGHT_POINTS.start.min(run.len() / 2);
        let full = median(&mut (start..run.len()).map(light).collect::<Vec<f64>>()).filter(|full| *full > 0.0)?;
        let (near, far) = run[start..].split_at((run.len() - start) / 2);
        let mean = |run: &[u32]| {
            run.iter().map(|&idx| self.samples.position(idx)).sum::<Vector3<f64>>() / run.len() as f64
        };
        let (near, far) = (mean(near), mean(far));
        let outwards = (near - far).try_normalize(f64::MIN_POSITIVE)?;
        let end = self.samples.position(last);
        let chord_mm = outwards.dot(&(end - self.samples.position(run[run.len() - 1])));
        Some(End {
            last,
            outwards,
            onto_line: near + outwards * outwards.dot(&(end - near)) - end,
            spacing_mm: chord_mm / (run.len() - 1) as f64,
            shares: (0..run.len()).map(|k| light(k) / full).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64Mcg;

    const SPACING_MM: f64 = 0.1;

    /// An end of a line whose last point lies `inside_mm` inside the rim; speckle dims or brightens every point.
    fn end(inside_mm: f64, blur_mm: f64, contrast: f64, rng: &mut Pcg64Mcg) -> End {
        let mut share = |k: usize| {
            let noise: f64 = rng.sample(StandardNormal);
            Normal::standard().cdf((inside_mm + k as f64 * SPACING_MM) / blur_mm) * (1.0 + contrast * noise)
        };
        End {
            last: 0,
            outwards: Vector3::x(),
            onto_line: Vector3::zeros(),
            spacing_mm: SPACING_MM,
            shares: (0..16).map(&mut share).collect(),
        }
    }

    #[test]
    fn the_blur_of_many_ends_is_right_whether_sharp_or_soft() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for blur_mm in [0.06, 0.08, 0.12, 0.2] {
            let ends = (0..4000).map(|_| end(SPACING_MM * rng.random::<f64>(), blur_mm, 0.1, &mut rng));
            let mut blurs: Vec<f64> = ends.filter_map(|end| end.blur_mm()).collect();
            let found_mm = median(&mut blurs).unwrap();
            assert!((found_mm / blur_mm - 1.0).abs() < 0.15, "{blur_mm}: {found_mm}");
        }
    }

    #[test]
    fn a_rim_that_leaves_one_side_of_a_line_is_found_on_the_line() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let aside = Vector3::new(0.0, 0.05, 0.1);
        let end = End { onto_line: aside, ..end(0.5 * SPACING_MM, 0.08, 0.0, &mut rng) };
        let found = end.crossing().of_rim(&Vector3::x(), 0.08);
        assert!((found.offset - aside - Vector3::x() * 0.5 * SPACING_MM).norm() < 1e-9, "{found:?}");
    }
}
