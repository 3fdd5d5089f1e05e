//! Long work beside the interpreter.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use gmhm_tools::failure::Failure;
use gmhm_tools::progress::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors;

/// How soon Ctrl-C is seen.
const POLL: Duration = Duration::from_millis(20);

/// As on the main thread of a program.
const STACK: usize = 8 << 20;

/// What work hears of its caller, and says to it.
#[derive(Default)]
pub struct Caller {
    cancelled: AtomicBool,
    notes: Mutex<Vec<String>>,
}

impl Caller {
    /// Receives notes, which become warnings.
    pub fn notes(&self) -> impl FnMut(&str) {
        |note| self.notes.lock().unwrap_or_else(PoisonError::into_inner).push(note.to_owned())
    }
}

impl Progress for Caller {
    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Does work on the tools' threads while other threads of Python run. Ctrl-C raises at once; the work ends as soon as it sees that it was cancelled.
pub fn run<T, W>(py: Python<'_>, work: W) -> PyResult<T>
where
    T: Send + 'static,
    W: FnOnce(&Caller) -> Result<T, Failure> + Send + 'static,
{
    let caller = Arc::new(Caller::default());
    let (sender, mut receiver) = channel();
    let of_work = Arc::clone(&caller);
    threads()?.spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(|| work(&of_work)));
        // Nobody waits for it after Ctrl-C.
        let _ = sender.send(done);
    });
    loop {
        let received;
        (receiver, received) = py.detach(move || {
            let received = receiver.recv_timeout(POLL);
            (receiver, received)
        });
        match received {
            Ok(Ok(done)) => {
                for note in caller.notes.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
                    errors::warn(py, &note)?;
                }
                return done.map_err(|failure| errors::exception(py, &failure));
            }
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout) => {
                if let Err(interrupt) = py.check_signals() {
                    caller.cancelled.store(true, Ordering::Relaxed);
                    return Err(interrupt);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the work ended without a result"));
            }
        }
    }
}

/// The threads of this process: after a fork the parent's do not run.
fn threads() -> PyResult<Arc<ThreadPool>> {
    static THREADS: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((of, pool)) = threads.as_ref()
        && *of == process
    {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().stack_size(STACK).thread_name(|k| format!("gmhm-{k}")).build();
    let pool = Arc::new(pool.map_err(|error| PyRuntimeError::new_err(error.to_string()))?);
    // Those of the parent cannot be joined here.
    std::mem::forget(threads.replace((process, Arc::clone(&pool))));
    Ok(pool)
}
