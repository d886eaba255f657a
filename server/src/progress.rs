//! Progress on stderr: a bar with time left on a terminal, a line now and then elsewhere, nothing when quiet.

use std::io::IsTerminal as _;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Shortest time between two progress lines where no bar can be drawn: enough for a log to show life.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Ticks of a bar that counts fractions.
const FRACTION_TICKS: u64 = 1000;

/// Where progress and notes go.
#[derive(Debug, Clone, Copy)]
pub struct Reporter {
    quiet: bool,
    terminal: bool,
}

impl Reporter {
    /// For this process's stderr.
    pub fn new(quiet: bool) -> Self {
        Self { quiet, terminal: std::io::stderr().is_terminal() }
    }

    /// A remark a person may skip.
    pub fn note(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// A remark a person should see, also when quiet.
    pub fn warn(&self, text: &str) {
        eprintln!("warning: {text}");
    }

    /// Progress over `total` things, such as pictures.
    pub fn count(&self, title: &str, unit: &str, total: usize) -> Task {
        let template =
            format!("{{msg:28}} {{bar:32.cyan/blue}} {{pos:>4}}/{{len}} {unit}, {{elapsed}} gone, {{eta}} left");
        self.task(title, unit, total as u64, &template)
    }

    /// Progress of a procedure that names its steps and the fraction done.
    pub fn fraction(&self, title: &str) -> Task {
        self.task(
            title,
            "",
            FRACTION_TICKS,
            "{msg:28!} {bar:32.cyan/blue} {percent:>3} %, {elapsed} gone, {eta} left",
        )
    }

    fn task(&self, title: &str, unit: &str, total: u64, template: &str) -> Task {
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
        Task { bar, lines, unit: unit.to_owned() }
    }
}

/// One running piece of work. The bar goes away when it is dropped.
#[derive(Debug)]
pub struct Task {
    bar: ProgressBar,
    /// When the last line was written; `None` where no lines are wanted.
    lines: Option<Mutex<Instant>>,
    unit: String,
}

impl Task {
    /// One more thing is done. May be called from any thread.
    pub fn step(&self) {
        self.bar.inc(1);
        self.line(|bar| {
            format!("{}: {}/{} {}", bar.message(), bar.position(), bar.length().unwrap_or(0), self.unit)
        });
    }

    /// Where a procedure is, in the operator's words, and the fraction done.
    pub fn at(&self, step: &str, fraction: f64) {
        self.bar.set_message(step.to_owned());
        self.bar.set_position((fraction.clamp(0.0, 1.0) * FRACTION_TICKS as f64) as u64);
        self.line(|_| format!("{step} ({:.0} %)", fraction * 100.0));
    }

    fn line(&self, text: impl Fn(&ProgressBar) -> String) {
        let Some(lines) = &self.lines else { return };
        let Ok(mut last) = lines.lock() else { return };
        if last.elapsed() < LINE_INTERVAL {
            return;
        }
        *last = Instant::now();
        let left = self.bar.eta().as_secs();
        eprintln!("{}, about {left} s left", text(&self.bar));
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
