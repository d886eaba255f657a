//! Small plots as SVG: axes with round tick values, dots, lines, bars, cells.

use std::fmt::Write as _;

use maud::{Markup, html};

/// Left margin, for tick labels.
const LEFT: f64 = 52.0;
/// Bottom margin, for tick labels and the axis title.
const BELOW: f64 = 38.0;
/// Top and right margin.
const MARGIN: f64 = 12.0;
/// Approximate number of ticks per axis.
const TICKS: f64 = 5.0;

/// An axis: its range and its title with unit.
pub struct Axis {
    low: f64,
    high: f64,
    title: String,
}

impl Axis {
    /// An axis from `low` to `high`; `low > high` reverses it, as for image rows.
    pub fn new(low: f64, high: f64, title: &str) -> Self {
        let high = if (high - low).abs() > 0.0 { high } else { low + 1.0 };
        Self { low, high, title: title.to_owned() }
    }

    /// An axis that contains all values, with a small margin.
    pub fn around(values: impl Iterator<Item = f64>, title: &str) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return Self::new(0.0, 1.0, title);
        }
        let room = ((high - low) * 0.06).max(1e-12);
        Self::new(low - room, high + room, title)
    }

    /// An axis from `-extent` to `extent`.
    pub fn symmetric(extent: f64, title: &str) -> Self {
        Self::new(-extent, extent, title)
    }

    fn fraction(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    fn ticks(&self) -> Vec<f64> {
        let step = round_step((self.high - self.low).abs() / TICKS);
        let (low, high) = (self.low.min(self.high), self.low.max(self.high));
        let first = (low / step).ceil() as i64;
        let last = (high / step).floor() as i64;
        (first..=last).map(|tick| tick as f64 * step).collect()
    }
}

/// 1, 2 or 5 times a power of ten, at least `rough`.
fn round_step(rough: f64) -> f64 {
    let power = 10f64.powf(rough.log10().floor());
    let lead = rough / power;
    let round = if lead <= 1.0 {
        1.0
    } else if lead <= 2.0 {
        2.0
    } else if lead <= 5.0 {
        5.0
    } else {
        10.0
    };
    round * power
}

/// A plot under construction.
pub struct Plot {
    x: Axis,
    y: Axis,
    width: f64,
    height: f64,
    parts: Vec<Markup>,
}

impl Plot {
    /// A plot whose plotting area has the given size in SVG units.
    pub fn new(x: Axis, y: Axis, width: f64, height: f64) -> Self {
        Self { x, y, width, height, parts: Vec::new() }
    }

    /// Small dots of one colour, drawn as one path.
    pub fn dots(&mut self, points: impl Iterator<Item = (f64, f64)>, size: f64, style: &str) {
        let mut path = String::new();
        for (x, y) in points {
            if self.inside(x, y) {
                let _ = write!(path, "M{:.1} {:.1}h0", self.place_x(x), self.place_y(y));
            }
        }
        self.parts.push(html! {
            path d=(path) fill="none" stroke-width=(size) stroke-linecap="round" style=(style) {}
        });
    }

    /// A line through the points.
    pub fn line(&mut self, points: &[(f64, f64)], style: &str) {
        let mut path = String::new();
        for (idx, (x, y)) in points.iter().enumerate() {
            let command = if idx == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{command}{:.1} {:.1}", self.place_x(*x), self.place_y(*y));
        }
        self.parts.push(html! { path d=(path) fill="none" stroke-linejoin="round" style=(style) {} });
    }

    /// Short lines from (x, y) along (dx, dy), all in axis units.
    pub fn arrows(&mut self, arrows: impl Iterator<Item = [f64; 4]>, style: &str) {
        let mut path = String::new();
        for [x, y, dx, dy] in arrows {
            let (x0, y0) = (self.place_x(x), self.place_y(y));
            let _ =
                write!(path, "M{x0:.1} {y0:.1}l{:.1} {:.1}", self.place_x(x + dx) - x0, self.place_y(y + dy) - y0);
        }
        self.parts.push(html! { path.thin d=(path) style=(style) {} });
    }

    /// A rectangle between two corners, with a tooltip.
    pub fn cell(&mut self, from: (f64, f64), to: (f64, f64), class: &str, opacity: f64, tip: &str) {
        let (x0, x1) = (self.place_x(from.0), self.place_x(to.0));
        let (y0, y1) = (self.place_y(from.1), self.place_y(to.1));
        let opacity = format!("{opacity:.3}");
        self.parts.push(html! {
            rect x=(tenths(x0.min(x1))) y=(tenths(y0.min(y1))) width=(tenths((x1 - x0).abs()))
                height=(tenths((y1 - y0).abs())) class=(class) opacity=(opacity) { title { (tip) } }
        });
    }

    /// A horizontal dashed line.
    pub fn rule_at(&mut self, y: f64) {
        let place = tenths(self.place_y(y));
        self.parts.push(html! { line.zero x1=(LEFT) x2=(LEFT + self.width) y1=(place) y2=(place) {} });
    }

    /// An image that fills the plotting area; `uri` is a data URI.
    pub fn backdrop(&mut self, uri: &str) {
        self.parts.push(html! {
            image href=(uri) x=(LEFT) y=(MARGIN) width=(self.width) height=(self.height) preserveAspectRatio="none" {}
        });
    }

    /// The drawing as an SVG element.
    pub fn svg(&self) -> Markup {
        let (width, height) = (LEFT + self.width + MARGIN, MARGIN + self.height + BELOW);
        html! {
            svg viewBox=(format!("0 0 {width:.0} {height:.0}")) role="img" {
                (self.axes())
                @for part in &self.parts { (part) }
            }
        }
    }

    fn axes(&self) -> Markup {
        let (bottom, right) = (MARGIN + self.height, LEFT + self.width);
        let middle = tenths(MARGIN + self.height / 2.0);
        html! {
            @for tick in self.x.ticks() {
                @let x = tenths(self.place_x(tick));
                line.rule x1=(x) x2=(x) y1=(MARGIN) y2=(tenths(bottom)) {}
                text x=(x) y=(tenths(bottom + 14.0)) text-anchor="middle" { (tick_text(tick, &self.x)) }
            }
            @for tick in self.y.ticks() {
                @let y = self.place_y(tick);
                line.rule x1=(LEFT) x2=(tenths(right)) y1=(tenths(y)) y2=(tenths(y)) {}
                text x=(tenths(LEFT - 6.0)) y=(tenths(y + 4.0)) text-anchor="end" { (tick_text(tick, &self.y)) }
            }
            text x=(tenths(LEFT + self.width / 2.0)) y=(tenths(bottom + 31.0)) text-anchor="middle" { (self.x.title) }
            text x="11" y=(middle) text-anchor="middle" transform={ "rotate(-90 11 " (middle) ")" } { (self.y.title) }
            rect.axis x=(LEFT) y=(MARGIN) width=(tenths(self.width)) height=(tenths(self.height)) {}
        }
    }

    fn inside(&self, x: f64, y: f64) -> bool {
        (0.0..=1.0).contains(&self.x.fraction(x)) && (0.0..=1.0).contains(&self.y.fraction(y))
    }

    fn place_x(&self, x: f64) -> f64 {
        LEFT + self.x.fraction(x) * self.width
    }

    fn place_y(&self, y: f64) -> f64 {
        MARGIN + (1.0 - self.y.fraction(y)) * self.height
    }
}

/// A length in SVG units, to a tenth.
pub fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// A tick value with as many decimals as needed, a real minus sign and no negative zero.
fn tick_text(tick: f64, axis: &Axis) -> String {
    let step = round_step((axis.high - axis.low).abs() / TICKS);
    let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{:.decimals$}", tick.abs());
    if tick < -step / 2.0 { format!("−{text}") } else { text }
}

/// One horizontal bar per name, with its value at the end. `marked` bars are highlighted.
pub fn bars(entries: &[(String, f64)], unit: &str, decimals: usize, marked: impl Fn(usize) -> bool) -> Markup {
    const ROW: f64 = 19.0;
    const NAMES: f64 = 128.0;
    const WIDTH: f64 = 520.0;
    const FIGURES: f64 = 84.0;
    let largest = entries.iter().map(|(_, value)| *value).fold(f64::MIN_POSITIVE, f64::max);
    let height = entries.len() as f64 * ROW + 4.0;
    html! {
        svg viewBox=(format!("0 0 {WIDTH} {height:.0}")) role="img" {
            @for (idx, (name, value)) in entries.iter().enumerate() {
                @let y = idx as f64 * ROW;
                @let base = tenths(y + 14.0);
                @let length = (value / largest * (WIDTH - NAMES - FIGURES)).max(1.0);
                text x=(NAMES - 8.0) y=(base) text-anchor="end" { (name) }
                rect.bar x=(NAMES) y=(tenths(y + 3.0)) width=(tenths(length)) height=(tenths(ROW - 5.0)) rx="2"
                    opacity=(if marked(idx) { 1.0 } else { 0.55 }) {}
                text.ink x=(tenths(NAMES + length + 6.0)) y=(base) { (format!("{value:.decimals$} {unit}")) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside_the_axis() {
        assert_eq!(Axis::new(0.0, 1280.0, "").ticks(), [0.0, 500.0, 1000.0]);
        assert_eq!(Axis::new(1024.0, 0.0, "").ticks().len(), 3);
        let ticks = Axis::new(-0.31, 0.29, "").ticks();
        assert!(ticks.len() >= 3 && ticks.iter().all(|tick| (-0.31..=0.29).contains(tick)), "{ticks:?}");
    }
}
