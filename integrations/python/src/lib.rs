//! Native part of the Python package. It returns answers of the facade as JSON and text, from which
//! `metaplan/*.py` creates objects.
//!
//! The interpreter lock is released during work, except in `pddl` and in changes of a mission's situation.
//! While planning, explaining and verifying, signals are checked every 20 ms, and Ctrl-C sets the
//! interrupt flag of the work. Python handles signals in its main thread only, so work in another thread
//! is not interrupted. Other functions (such as `reason`, `check`, `compare` and the loop) handle signals
//! only at their end.

mod ask;
mod failure;
mod looping;
mod mission;
mod wait;

use pyo3::prelude::*;

/// The native module of `metaplan`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<mission::Mission>()?;
    module.add_class::<mission::Planned>()?;
    module.add_class::<looping::Loop>()?;
    module.add_function(wrap_pyfunction!(ask::verify, module)?)?;
    module.add_function(wrap_pyfunction!(ask::reason, module)?)?;
    module.add_function(wrap_pyfunction!(ask::check, module)?)?;
    module.add_function(wrap_pyfunction!(ask::explain_code, module)?)?;
    Ok(())
}
