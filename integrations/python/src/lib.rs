//! Metaplan for Python: what the facade has, as JSON and text; `metaplan/*.py` makes objects of it.
//!
//! Nothing is decided here. The interpreter's lock is released while work goes on; every 20 ms signals are looked at, and Ctrl-C sets the
//! flag that the planner heeds.

mod ask;
mod failure;
mod looping;
mod mission;
mod wait;

use pyo3::prelude::*;

/// The native part of `metaplan`.
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
