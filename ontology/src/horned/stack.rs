//! Room for horned-owl, which recurses into lists and expressions.

/// The stack on which horned-owl runs, in bytes of address space: it recurses into lists and expressions.
const STACK: usize = 1 << 29;

/// Runs a reader or writer where long lists do not overflow the stack.
pub(super) fn with_stack<T: Send>(run: impl FnOnce() -> T + Send) -> Result<T, String> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, run);
        let thread = thread.map_err(|error| format!("there is no room for the OWL reader: {error}"))?;
        thread.join().map_err(|_| "the OWL reader failed on it".to_owned())
    })
}
