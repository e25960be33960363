//! Long work: on its own thread, without Python's lock.
//!
//! The caller's thread waits without the lock, hands what the work says to the caller's function,
//! and looks for control-C ten times a second. Where either raises, the call ends at once with that
//! exception, and the work at the next step that it tells of (after the drape at hand); what it
//! would have given is lost, and no file is written, since files are written by the caller's
//! thread.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors::internal;

/// Between two looks for control-C.
const POLL: Duration = Duration::from_millis(100);
/// The stack of the work \[bytes\], that of a program's first thread.
const STACK: usize = 8 << 20;

/// What the work has to say.
enum Event<T> {
    /// A step begins.
    Said(String),
    /// It is done, or has panicked.
    Done(thread::Result<T>),
}

/// What ends the work of a caller who has gone.
struct Gone;

/// How the work says what it does.
pub(crate) struct Teller {
    say: Box<dyn Fn(String) + Send + Sync>,
    gone: Arc<AtomicBool>,
}

impl Teller {
    /// Says what is being done. The work ends here if nobody waits for it any more.
    pub(crate) fn say(&self, step: impl Into<String>) {
        if self.gone.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Gone));
        }
        (self.say)(step.into());
    }
}

/// Does `work` on another thread and waits for it. `progress` is called with each step in words, on
/// the caller's thread.
///
/// # Errors
/// What `progress` raises, control-C, and a panic of the work as an `InternalError`.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Teller) -> T + Send + 'static,
) -> PyResult<T> {
    if let Some(progress) = progress.filter(|progress| !progress.is_callable()) {
        let kind = progress.get_type();
        return Err(PyTypeError::new_err(format!(
            "progress: a {kind} cannot be called; give a function of a str"
        )));
    }
    let (sender, mut receiver) = channel();
    let gone = Arc::new(AtomicBool::new(false));
    start(sender, Arc::clone(&gone), work).map_err(internal)?;
    let end = loop {
        // a receiver is moved there and back, since it cannot be lent to code without the lock
        let event;
        (receiver, event) = py.detach(move || {
            let event = receiver.recv_timeout(POLL);
            (receiver, event)
        });
        match event {
            Ok(Event::Said(step)) => {
                let heard = progress.map_or(Ok(()), |progress| progress.call1((step,)).map(drop));
                if let Err(error) = heard {
                    break Err(error);
                }
            }
            Ok(Event::Done(Ok(result))) => break Ok(result),
            Ok(Event::Done(Err(panic))) => break Err(internal(words(panic.as_ref()))),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break Err(internal("the work is gone")),
        }
        if let Err(error) = py.check_signals() {
            break Err(error);
        }
    };
    gone.store(true, Ordering::Relaxed);
    end
}

/// Starts the work.
fn start<T: Send + 'static>(
    sender: Sender<Event<T>>,
    gone: Arc<AtomicBool>,
    work: impl FnOnce(&Teller) -> T + Send + 'static,
) -> std::io::Result<()> {
    let said = sender.clone();
    // nobody listens once the caller has gone
    let say = Box::new(move |step| drop(said.send(Event::Said(step))));
    let teller = Teller { say, gone };
    let all = move || {
        let result = catch_unwind(AssertUnwindSafe(|| work(&teller)));
        drop(sender.send(Event::Done(result)));
    };
    thread::Builder::new().name("scan2params".into()).stack_size(STACK).spawn(all).map(drop)
}

/// What a panic says.
fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref().cloned()).unwrap_or_else(|| "a panic without words".into())
}
