//! One line on stderr, if it is a terminal, that says what is being done and for how
//! long; it is gone when the work is done. Elsewhere nothing is printed, unless `--verbose` asks
//! for a line for each step; with `--quiet` nothing is. There is nothing coloured in it, so that
//! NO_COLOR changes nothing.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::print;

/// Between two pictures of the line.
const TICK: Duration = Duration::from_millis(120);

/// A line that lives as long as the work.
pub struct Working {
    line: ProgressBar,
    since: Instant,
}

impl Working {
    /// Shows the line: `doing` is what is being done.
    pub fn on(doing: impl Into<String>) -> Self {
        let silent = print::is_quiet() || print::is_verbose();
        let line = if silent { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg} {elapsed}") {
            line.set_style(style);
        }
        line.enable_steady_tick(TICK);
        let working = Self { line, since: Instant::now() };
        working.now(doing);
        working
    }

    /// What is being done from now on.
    pub fn now(&self, doing: impl Into<String>) {
        let doing = doing.into();
        if print::is_verbose() && doing != self.line.message() {
            eprintln!("{:8.2} s  {doing}", self.since.elapsed().as_secs_f64());
        }
        self.line.set_message(doing);
    }

    /// The line, for who has to end it in this one's place.
    pub fn handle(&self) -> ProgressBar {
        self.line.clone()
    }

    /// Prints without the line in between.
    pub fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.line.suspend(print)
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        self.line.finish_and_clear();
    }
}
