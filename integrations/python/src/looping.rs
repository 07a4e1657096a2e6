//! The adaptation loop for Python: event lines in, answer lines out.

use std::sync::{Mutex, PoisonError};

use metaplan::mapek::{self, Observation};
use pyo3::prelude::*;

use crate::failure::raise;
use crate::mission::{Mission, seconds};

/// The adaptation loop of a single robot.
#[pyclass(module = "metaplan._native", frozen)]
pub(crate) struct Loop {
    control: Mutex<mapek::Loop>,
}

fn lines(answers: &[mapek::Answer]) -> Vec<String> {
    answers.iter().map(|answer| answer.to_json().to_string()).collect()
}

#[pymethods]
impl Loop {
    /// Creates the loop of a mission in its current situation. `time_limit` is the planning time in
    /// seconds; `None` keeps the manifest's setting.
    #[new]
    fn new(py: Python<'_>, mission: &Mission, time_limit: Option<f64>) -> PyResult<Self> {
        let setup = mission.read();
        let mut settings = setup.settings.clone();
        if let Some(time) = time_limit {
            settings = settings.with_time_limit(seconds("time_limit", time)?);
        }
        let mission = setup.mission.clone();
        let control = py
            .detach(move || mapek::Loop::new(mission, settings))
            .map_err(|messages| raise(py, &messages))?;
        Ok(Self { control: Mutex::new(control) })
    }

    /// Starts the loop. Returns the answers of the first planning.
    fn start(&self, py: Python<'_>) -> Vec<String> {
        py.detach(|| lines(&self.control.lock().unwrap_or_else(PoisonError::into_inner).start()))
    }

    /// Handles an event line that was received `now` seconds after the start. Returns the answers.
    fn handle(&self, py: Python<'_>, line: &str, now: f64) -> PyResult<Vec<String>> {
        let now = seconds("now", now)?;
        let observation = Observation::parse(line);
        Ok(py.detach(|| {
            lines(&self.control.lock().unwrap_or_else(PoisonError::into_inner).handle(&observation, now))
        }))
    }
}
