//! Progress on stderr: a bar with remaining time on a terminal, periodic lines elsewhere, nothing with `--quiet`.

use parking_lot::Mutex;
use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pipeline::{Reporter, Task};

/// Minimum time between two progress lines where no bar can be drawn.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Steps of a bar that shows a fraction.
const FRACTION_TICKS: u64 = 1000;

/// Reporter on stderr.
#[derive(Debug)]
pub struct Stderr {
    quiet: bool,
    terminal: bool,
    warnings: Mutex<Vec<String>>,
}

impl Stderr {
    /// For this process.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, terminal: std::io::stderr().is_terminal(), warnings: Mutex::default() }
    }

    /// The warnings so far, in order.
    pub fn warnings(&self) -> Vec<String> {
        self.warnings.lock().clone()
    }

    fn task(&self, title: &str, unit: &str, total: u64, template: &str) -> Box<dyn Task> {
        let bar = if self.quiet || !self.terminal {
            ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden())
        } else {
            ProgressBar::new(total)
        };
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("━╸─"));
        }
        bar.set_message(title.to_owned());
        let lines = (!self.quiet && !self.terminal).then(|| Mutex::new(Instant::now()));
        if lines.is_some() {
            eprintln!("{title} …");
        }
        Box::new(StderrTask { bar, lines, unit: unit.to_owned() })
    }
}

impl Reporter for Stderr {
    fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    fn warn(&self, text: &str) {
        eprintln!("warning: {text}");
        self.warnings.lock().push(text.to_owned());
    }

    /// Never: on the command line, cancelling ends the process.
    fn is_cancelled(&self) -> bool {
        false
    }

    fn count(&self, title: &str, unit: &str, total: usize) -> Box<dyn Task> {
        let template = format!(
            "{{msg:28}} {{bar:32.cyan/blue}} {{pos:>4}}/{{len}} {unit}, {{elapsed}} elapsed, {{eta}} left"
        );
        self.task(title, unit, total as u64, &template)
    }

    fn fraction(&self, title: &str) -> Box<dyn Task> {
        self.task(
            title,
            "",
            FRACTION_TICKS,
            "{msg:28!} {bar:32.cyan/blue} {percent:>3} %, {elapsed} elapsed, {eta} left",
        )
    }
}

/// A bar or periodic lines. The bar is cleared when this is dropped.
#[derive(Debug)]
pub struct StderrTask {
    bar: ProgressBar,
    /// When the last line was written; `None` if no lines are written.
    lines: Option<Mutex<Instant>>,
    unit: String,
}

impl StderrTask {
    fn line(&self, text: impl Fn(&ProgressBar) -> String) {
        let Some(lines) = &self.lines else { return };
        let mut last = lines.lock();
        if last.elapsed() < LINE_INTERVAL {
            return;
        }
        *last = Instant::now();
        let left = self.bar.eta().as_secs();
        eprintln!("{}, about {left} s left", text(&self.bar));
    }
}

impl Task for StderrTask {
    fn step(&self) {
        self.bar.inc(1);
        self.line(|bar| {
            format!("{}: {}/{} {}", bar.message(), bar.position(), bar.length().unwrap_or(0), self.unit)
        });
    }

    fn at(&self, step: &str, fraction: f64) {
        self.bar.set_message(step.to_owned());
        self.bar.set_position((fraction.clamp(0.0, 1.0) * FRACTION_TICKS as f64) as u64);
        self.line(|_| format!("{step} ({:.0} %)", fraction * 100.0));
    }
}

impl Drop for StderrTask {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
