//! Runs horned-owl on a thread with a large stack, because horned-owl recurses along lists and
//! expressions.

/// Stack size in bytes. Only address space is reserved; pages are committed on use.
const STACK_BYTES: usize = 1 << 29;

pub(super) fn with_stack<T: Send>(run: impl FnOnce() -> T + Send) -> Result<T, String> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, run);
        let thread = thread.map_err(|error| format!("there is no room for the OWL reader: {error}"))?;
        // `join` fails if horned-owl panicked.
        thread.join().map_err(|_| "the OWL reader failed on it".to_owned())
    })
}
