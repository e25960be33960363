//! Ctrl-C: what is half written is removed, and the exit code is 130. A verb that has an answer
//! already, and works on a better one, gives that first ([`answers`]).
//!
//! Finished results stay: rows of a batch and of a run of `generate` are written one by one,
//! and the same command continues from there. A program that was started with the signal
//! ignored (in the background of a script) still ignores it.

use std::io::IsTerminal as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use super::print;
use crate::io::abandon_unfinished;

/// The exit code of a program that a user interrupted.
const INTERRUPTED: u8 = 130;

/// Whether the same command continues where this one is interrupted.
static CONTINUES: AtomicBool = AtomicBool::new(false);

/// Lets the message of an interruption say that the same command continues from there.
pub fn continues() {
    CONTINUES.store(true, Ordering::Relaxed);
}

type Answer = Box<dyn FnOnce() + Send>;

/// Gives the answer that there is already.
static ANSWER: Mutex<Option<Answer>> = Mutex::new(None);

/// Has `give` called where the program is interrupted from now on, until [`answers_no_more`].
pub fn answers(give: impl FnOnce() + Send + 'static) {
    *ANSWER.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(give));
}

/// The better answer is there. Waits for the end of the program where the other one is being given.
pub fn answers_no_more() {
    ANSWER.lock().unwrap_or_else(PoisonError::into_inner).take();
}

/// Takes Ctrl-C over, from here to the end of the program.
pub fn watch() {
    // Where it cannot be taken over the system ends the program, as it does without.
    let _ = ctrlc::try_set_handler(|| {
        // held until the program ends, so that the work does not answer as well
        let mut answer = ANSWER.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(give) = answer.take() {
            give();
            std::process::exit(print::finish(INTERRUPTED).into());
        }
        abandon_unfinished();
        // A terminal has shown `^C` at the end of a line.
        let line_break = if std::io::stderr().is_terminal() { "\n" } else { "" };
        let next = if CONTINUES.load(Ordering::Relaxed) {
            "; finished results are kept, and the same command continues from there"
        } else {
            ""
        };
        warning!("{line_break}error: interrupted{next}");
        std::process::exit(INTERRUPTED.into());
    });
}
