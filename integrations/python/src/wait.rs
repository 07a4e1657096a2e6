//! Runs work without the interpreter lock, and handles signals meanwhile.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

const INTERVAL: Duration = Duration::from_millis(20);
/// Stack size of the working thread in bytes, as large as that of a main thread.
const STACK: usize = 8 << 20;

/// Runs `work` on a thread while other threads of the interpreter continue. If a signal raises an
/// exception such as `KeyboardInterrupt`, sets the interrupt flag and still waits for the result.
/// Then the exception, the last one if there are several, is returned together with the result, which may be partial.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    interrupt: &AtomicBool,
    work: impl FnOnce() -> T + Send,
) -> (T, Option<PyErr>) {
    py.detach(|| {
        thread::scope(|scope| {
            let (sender, receiver) = channel();
            let worker = move || {
                let outcome = catch_unwind(AssertUnwindSafe(work));
                // The receiver waits until a result arrives.
                let _ = sender.send(outcome);
            };
            let started = thread::Builder::new().stack_size(STACK).spawn_scoped(scope, worker);
            let mut stopped = None;
            loop {
                match receiver.recv_timeout(INTERVAL) {
                    Ok(Ok(found)) => return (found, stopped),
                    Ok(Err(panic)) => resume_unwind(panic),
                    Err(RecvTimeoutError::Timeout) => {
                        // A path to the method does not compile, because it is not general enough
                        // in its lifetime.
                        #[expect(clippy::redundant_closure_for_method_calls, reason = "see above")]
                        let signal = Python::attach(|py| py.check_signals());
                        if let Err(error) = signal {
                            interrupt.store(true, Ordering::Relaxed);
                            stopped = Some(error);
                        }
                    }
                    Err(RecvTimeoutError::Disconnected) => match &started {
                        Ok(_) => unreachable!("a worker sends before it ends"),
                        Err(error) => panic!("no thread can be started: {error}"),
                    },
                }
            }
        })
    })
}
