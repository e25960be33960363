//! One line on stderr, if it is a terminal, that says what is being done and for how
//! long; it is gone when the work is done. Elsewhere nothing is printed. There is
//! nothing coloured in it, so that NO_COLOR changes nothing.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Between two pictures of the line.
const TICK: Duration = Duration::from_millis(120);

/// A line that lives as long as the work.
pub(super) struct Working {
    line: ProgressBar,
}

impl Working {
    /// Shows the line: `doing` is what is being done.
    pub(super) fn on(doing: impl Into<String>) -> Self {
        let line = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg} {elapsed}") {
            line.set_style(style);
        }
        line.set_message(doing.into());
        line.enable_steady_tick(TICK);
        Self { line }
    }

    /// What is being done from now on.
    pub(super) fn now(&self, doing: impl Into<String>) {
        self.line.set_message(doing.into());
    }

    /// Prints without the line in between.
    pub(super) fn aside<T>(&self, print: impl FnOnce() -> T) -> T {
        self.line.suspend(print)
    }
}

impl Drop for Working {
    fn drop(&mut self) {
        self.line.finish_and_clear();
    }
}
