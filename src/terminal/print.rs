//! Printing that cannot panic: in this room and in the programs `println!` and its kin mean these
//! macros, and the programs' `deny(clippy::print_stdout, clippy::print_stderr)` holds that none of
//! the standard library's is left. A program takes them in its `main.rs`, with
//! `#[macro_use(eprint, eprintln, print, println, warning)] extern crate scan2params`.
//!
//! A reader of stdout that goes (`| head -1`) had what it wanted: nothing more is
//! printed, files are still written, and the exit code is that of the work. A command
//! whose product is what it prints ends there, with exit code 0. What cannot be printed
//! for another reason (a full disk) is a failure, reported at the end, with exit code 1.
//! What cannot be said on stderr is lost: there is nobody left to tell.

use std::fmt;
use std::io::{self, Write as _};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

#[doc(hidden)]
#[macro_export]
macro_rules! print {
    ($($text:tt)*) => { $crate::terminal::print::to_stdout(format_args!($($text)*)) };
}

#[doc(hidden)]
#[macro_export]
macro_rules! println {
    () => { $crate::terminal::print::to_stdout(format_args!("\n")) };
    ($($text:tt)*) => {
        $crate::terminal::print::to_stdout(format_args!("{}\n", format_args!($($text)*)))
    };
}

#[doc(hidden)]
#[macro_export]
macro_rules! eprint {
    ($($text:tt)*) => { $crate::terminal::print::to_stderr(format_args!($($text)*)) };
}

/// Prints warnings and errors on stderr, also with `--quiet`.
#[doc(hidden)]
#[macro_export]
macro_rules! warning {
    ($($text:tt)*) => {
        $crate::terminal::print::always(format_args!("{}\n", format_args!($($text)*)))
    };
}

#[doc(hidden)]
#[macro_export]
macro_rules! eprintln {
    ($($text:tt)*) => {
        $crate::terminal::print::to_stderr(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// Why stdout took no more.
static FAULT: OnceLock<io::Error> = OnceLock::new();
static IS_ALL: AtomicBool = AtomicBool::new(false);

/// From here on what is printed is all that the program makes: it ends when stdout
/// takes no more.
pub fn stdout_is_all() {
    IS_ALL.store(true, Ordering::Relaxed);
}

/// Prints on stdout, as long as it takes something.
pub fn to_stdout(text: fmt::Arguments<'_>) {
    if FAULT.get().is_none() {
        note(io::stdout().lock().write_all(plain(text).as_bytes()));
    }
}

/// What is printed on stderr: 0 warnings and errors, 1 also the results of the work, 2 also its
/// steps.
static TALK: AtomicU8 = AtomicU8::new(1);

/// Takes `--quiet` and `--verbose`, of which one at most is given.
pub fn talk(quiet: bool, verbose: bool) {
    let level = if quiet { 0 } else { 1 + u8::from(verbose) };
    TALK.store(level, Ordering::Relaxed);
}

/// Whether only warnings and errors are printed on stderr.
pub fn is_quiet() -> bool {
    TALK.load(Ordering::Relaxed) == 0
}

/// Whether the steps of the work are printed on stderr.
pub fn is_verbose() -> bool {
    TALK.load(Ordering::Relaxed) == 2
}

/// Prints on stderr, unless `--quiet` was given.
pub fn to_stderr(text: fmt::Arguments<'_>) {
    if !is_quiet() {
        always(text);
    }
}

/// Prints on stderr.
pub fn always(text: fmt::Arguments<'_>) {
    let _ = io::stderr().lock().write_all(plain(text).as_bytes());
}

/// A text without the control characters that names of files may bring to a terminal.
fn plain(text: fmt::Arguments<'_>) -> String {
    let text = text.to_string();
    let harmful = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if text.contains(harmful) { text.replace(harmful, "\u{fffd}") } else { text }
}

fn note(printed: io::Result<()>) {
    let Err(error) = printed else { return };
    let _ = FAULT.set(error);
    if IS_ALL.load(Ordering::Relaxed) {
        let code = finish(0);
        crate::io::abandon_unfinished();
        std::process::exit(code.into());
    }
}

/// Prints what is held back. Returns the exit code of a program whose work ended with
/// `code`: another where that was 0 and stdout did not take everything.
pub fn finish(code: u8) -> u8 {
    if FAULT.get().is_none()
        && let Err(error) = io::stdout().flush()
    {
        let _ = FAULT.set(error);
    }
    match FAULT.get() {
        Some(error) if !reader_has_gone(error) => {
            warning!("error: stdout cannot be written ({error}); check the disk or the pipe");
            if code == 0 { 1 } else { code }
        }
        _ => code,
    }
}

/// Whether an error says that nobody reads on: the end of a pipe, not a failure.
pub fn reader_has_gone(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::BrokenPipe
}

/// Help, the version, or what is wrong with the arguments.
pub fn of_clap(error: &clap::Error) -> ExitCode {
    let code = u8::try_from(error.exit_code()).unwrap_or(2);
    match error.print() {
        Err(fault) if !error.use_stderr() => note(Err(fault)),
        _ => {}
    }
    ExitCode::from(finish(code))
}
