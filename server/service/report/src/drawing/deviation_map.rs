//! The deviations of a cloud's points from the surfaces they belong to, seen from above.

use image::RgbaImage;
use maud::{Markup, html};
use pipeline::Failure;
use scanning::Cloud;

use super::page::{figure, legend};
use super::top_grid::TopGrid;

/// From the lowest to the highest deviation: blue, light grey at zero, red. The same as on the page.
const COLOURS: [[u8; 3]; 9] = [
    [0x21, 0x66, 0xac],
    [0x43, 0x93, 0xc3],
    [0x92, 0xc5, 0xde],
    [0xd1, 0xe5, 0xf0],
    [0xf2, 0xf2, 0xf2],
    [0xfd, 0xdb, 0xc7],
    [0xf4, 0xa5, 0x82],
    [0xd6, 0x60, 0x4d],
    [0xb2, 0x18, 0x2b],
];

/// Of points without a deviation: a darker grey than that of zero.
const NO_DEVIATION: [u8; 3] = [0xa0, 0xa4, 0xa8];

/// Fraction of the coloured cells within the ends of the scale.
const SCALED_FRACTION: f64 = 0.98;

/// Smallest end of the scale, mm: a perfect surface is not coloured by its rounding errors.
const LEAST_SCALE_MM: f64 = 0.001;

/// A cell of the map.
#[derive(Clone, Copy, PartialEq)]
enum Cell {
    /// Without points.
    Empty,
    /// Its points have no deviation.
    Other,
    /// Mean deviation of those that have one, mm.
    Mean(f64),
}

/// Mean deviations over x and y.
pub struct DeviationMap {
    grid: TopGrid,
    cells: Vec<Cell>,
    scale_mm: f64,
}

impl DeviationMap {
    /// `deviations_mm`: of every point of the cloud; NaN where it has none. `None` if no point has one.
    pub fn new(cloud: &Cloud, deviations_mm: &[f32]) -> Option<Self> {
        let grid = TopGrid::new(cloud);
        let mut sums = vec![(0.0, 0u32, false); grid.n_cells()];
        for (point, deviation_mm) in cloud.points.iter().zip(deviations_mm) {
            let (sum, n, has_points) = &mut sums[grid.cell(point.x_mm, point.y_mm)];
            *has_points = true;
            if deviation_mm.is_finite() {
                (*sum, *n) = (*sum + f64::from(*deviation_mm), *n + 1);
            }
        }
        let cells: Vec<Cell> = sums
            .into_iter()
            .map(|(sum, n, has_points)| match n {
                0 if has_points => Cell::Other,
                0 => Cell::Empty,
                n => Cell::Mean(sum / f64::from(n)),
            })
            .collect();
        let scale_mm = scale_mm(&cells)?;
        Some(Self { grid, cells, scale_mm })
    }

    /// The map with its width and height, mm.
    pub fn image(&self) -> (RgbaImage, [f64; 2]) {
        let colour = |idx: usize| match self.cells[idx] {
            Cell::Empty => None,
            Cell::Other => Some(NO_DEVIATION),
            Cell::Mean(deviation_mm) => Some(colour(deviation_mm / self.scale_mm)),
        };
        (self.grid.image(colour), self.grid.size_mm())
    }

    /// The map with axes and legend, for a page.
    ///
    /// # Errors
    /// The image cannot be encoded.
    pub fn figure(&self, caption: &str) -> Result<Markup, Failure> {
        let keys: Vec<(String, String)> = self
            .stops()
            .step_by(2)
            .map(|(deviation_mm, colour)| (microns(deviation_mm), css(colour)))
            .chain([("no deviation".to_owned(), css(NO_DEVIATION))])
            .collect();
        Ok(figure(html! { (self.grid.plot(&self.image().0)?.svg()) (legend(&keys)) }, caption))
    }

    /// The colours of the scale with their deviations, mm, from one end to the other.
    pub fn stops(&self) -> impl Iterator<Item = (f64, [u8; 3])> {
        let half = (COLOURS.len() / 2) as f64;
        COLOURS
            .into_iter()
            .enumerate()
            .map(move |(idx, colour)| (self.scale_mm * (idx as f64 / half - 1.0), colour))
    }
}

/// The colour of a deviation relative to the end of the scale: that of the nearest stop between −1 and 1, mixed with the
/// next.
fn colour(relative: f64) -> [u8; 3] {
    let place = (relative.clamp(-1.0, 1.0) + 1.0) / 2.0 * (COLOURS.len() - 1) as f64;
    let idx = (place as usize).min(COLOURS.len() - 2);
    let mix = |channel: usize| {
        let (from, to) = (f64::from(COLOURS[idx][channel]), f64::from(COLOURS[idx + 1][channel]));
        (from + (to - from) * (place - idx as f64)).round() as u8
    };
    [0, 1, 2].map(mix)
}

/// The next 1, 2 or 5 times a power of ten that includes most of the cells; `None` without a coloured cell.
fn scale_mm(cells: &[Cell]) -> Option<f64> {
    let magnitude = |cell: &Cell| match cell {
        Cell::Mean(deviation_mm) => Some(deviation_mm.abs()),
        _ => None,
    };
    let mut magnitudes: Vec<f64> = cells.iter().filter_map(magnitude).collect();
    magnitudes.sort_by(f64::total_cmp);
    let last = magnitudes.len().checked_sub(1)?;
    let most = magnitudes[(last as f64 * SCALED_FRACTION).ceil() as usize].max(LEAST_SCALE_MM);
    // Rounded to a millionth of a decade, so that 0.02 is not above itself.
    let decade = 10f64.powf((most.log10() + 1e-6).floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    steps.into_iter().map(|step| step * decade).find(|scale| *scale >= most * (1.0 - 1e-6))
}

/// `−20 µm`.
pub fn microns(deviation_mm: f64) -> String {
    let microns = 1000.0 * deviation_mm;
    match microns {
        0.0 => "0".to_owned(),
        _ => format!("{}{} µm", if microns < 0.0 { "–" } else { "+" }, (microns.abs() * 10.0).round() / 10.0),
    }
}

fn css([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::drawing::point_at;

    fn cloud(positions: &[[f64; 2]]) -> Cloud {
        let point = |[x_mm, y_mm]: &[f64; 2]| point_at([*x_mm, *y_mm, 0.0]);
        Cloud { points: positions.iter().map(point).collect(), comments: Vec::new() }
    }

    #[test]
    fn points_above_are_red_below_blue_and_without_a_deviation_grey() {
        let cloud = cloud(&[[0.0, 0.0], [24.0, 0.0], [0.0, 24.0], [24.0, 24.0]]);
        let map = DeviationMap::new(&cloud, &[0.02, -0.02, f32::NAN, 0.0]).unwrap();
        let (image, [width_mm, height_mm]) = map.image();
        let (right, bottom) = (image.width() - 1, image.height() - 1);
        let rgb = |x, y| [image.get_pixel(x, y)[0], image.get_pixel(x, y)[1], image.get_pixel(x, y)[2]];
        assert_eq!(rgb(0, 0), COLOURS[8]);
        assert_eq!(rgb(right, 0), COLOURS[0]);
        assert_eq!(rgb(0, bottom), NO_DEVIATION);
        assert_eq!(rgb(right, bottom), COLOURS[4]);
        assert_eq!(image.get_pixel(right / 2, bottom / 2)[3], 0, "no points, no colour");
        // A cell is a tenth of a millimetre wide.
        assert!((width_mm - 24.1).abs() < 1e-9 && (height_mm - 24.0).abs() < 0.11, "{width_mm} × {height_mm}");
    }

    #[test]
    fn the_scale_is_a_round_number_that_includes_almost_all_cells() {
        for (most_mm, expected_mm) in
            [(0.02, 0.02), (0.021, 0.05), (0.051, 0.1), (0.9, 1.0), (1.1, 2.0), (0.000_01, 0.001)]
        {
            let mut cells = vec![Cell::Mean(most_mm); 100];
            cells.extend([Cell::Mean(30.0), Cell::Other, Cell::Empty]);
            let scale_mm = scale_mm(&cells).unwrap();
            assert!((scale_mm - expected_mm).abs() < 1e-12, "{most_mm}: {scale_mm}");
        }
        assert!(scale_mm(&[Cell::Other]).is_none());
    }

    #[test]
    fn the_legend_states_deviations_with_their_sign() {
        assert_eq!([-0.02, 0.0, 0.0005].map(microns), ["–20 µm", "0", "+0.5 µm"]);
    }
}
