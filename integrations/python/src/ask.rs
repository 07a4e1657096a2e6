//! Functions that need no mission: verification of certificates, queries of knowledge bases, model
//! checking, explanation of message codes.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use metaplan::answers::{CheckAnswer, CodeAnswer, ReasonAnswer, VerificationAnswer};
use metaplan::certificate::Verifier;
use metaplan::codes;
use metaplan::knowledge::{Knowledge, Sources};
use metaplan::message::{Errors, Message};
use metaplan::probabilistic::check::{Exactness, Options, check as checked};
use metaplan::probabilistic::explore::Bounds;
use metaplan::probabilistic::{Error, prism, property};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;

use crate::failure::raise;
use crate::mission::{Mission, seconds};
use crate::wait::detached;

fn json(answer: &impl serde::Serialize) -> String {
    serde_json::to_string(answer).unwrap_or_default()
}

/// Verifies a certificate. Returns the report as JSON and as text.
#[pyfunction]
#[pyo3(signature = (directory, mission=None, time_limit=None))]
pub(crate) fn verify(
    py: Python<'_>,
    directory: PathBuf,
    mission: Option<&Mission>,
    time_limit: Option<f64>,
) -> PyResult<(String, String)> {
    let interrupt = AtomicBool::new(false);
    let time = time_limit.map(|time| seconds("time_limit", time)).transpose()?;
    let setup = mission.map(Mission::read);
    let mission = setup.as_ref().map(|setup| &setup.mission);
    let (report, stopped) = detached(py, &interrupt, || {
        let mut verifier =
            Verifier::new(&directory).mission(mission).stop(|| interrupt.load(Ordering::Relaxed));
        if let Some(time) = time {
            verifier = verifier.time_limit(time);
        }
        verifier.verify()
    });
    stopped.map_or_else(|| Ok((json(&VerificationAnswer::new(&report)), report.to_string())), Err)
}

/// Infers facts from knowledge bases and rules, with failed components `fail` and measured
/// attributes `set`. Returns the answer as JSON.
#[pyfunction]
#[pyo3(signature = (documents, rules, fail, set))]
pub(crate) fn reason(
    py: Python<'_>,
    documents: Vec<PathBuf>,
    rules: Vec<String>,
    fail: Vec<String>,
    set: Vec<(String, String)>,
) -> PyResult<String> {
    let concluded = || -> Result<String, Errors> {
        let mut knowledge = Knowledge::read(&Sources { documents, rules, ..Sources::default() })?;
        for component in &fail {
            knowledge.fail(component)?;
        }
        for (attribute, value) in &set {
            knowledge.measure(attribute, value)?;
        }
        let contradictions = knowledge.contradictions();
        Ok(json(&ReasonAnswer::new(&knowledge, &contradictions)))
    };
    py.detach(concluded).map_err(|messages| raise(py, &messages))
}

/// Computes the value of a property of a PRISM model. Returns the answer as JSON.
#[pyfunction]
#[pyo3(signature = (name, model, property, constants, exact=None))]
pub(crate) fn check(
    py: Python<'_>,
    name: &str,
    model: &str,
    property: &str,
    constants: BTreeMap<String, String>,
    exact: Option<bool>,
) -> PyResult<String> {
    let exactness = match exact {
        Some(true) => Exactness::Always,
        Some(false) => Exactness::Never,
        None => Exactness::Auto,
    };
    let interrupt = AtomicBool::new(false);
    let answered = || -> Result<String, Error> {
        let read = prism::parse(model)?;
        let parsed_property = property::parse(property)?;
        let continues = |_: usize| !interrupt.load(Ordering::Relaxed);
        let bounds = Bounds::default().with_progress(&continues);
        let options =
            Options::default().with_settings(constants).with_exactness(exactness).with_bounds(bounds);
        Ok(json(&CheckAnswer::new(property, &checked(&read, &parsed_property, &options)?)))
    };
    let (answer, stopped) = detached(py, &interrupt, answered);
    if let Some(error) = stopped {
        return Err(error);
    }
    answer.map_err(|error| {
        let (file, text) =
            if matches!(error, Error::Model(_)) { (name, model) } else { ("property", property) };
        let messages: Vec<Message> = match error.diagnostics() {
            [] => vec![Message::at("Q506", file, None, error.to_string())],
            problems => problems
                .iter()
                .map(|problem| {
                    let place = Some((problem.place.line, problem.place.column));
                    Message::at(problem.code, file, place, problem.message.clone()).with_source(text)
                })
                .collect(),
        };
        raise(py, &messages)
    })
}

/// Explains an error code. Returns the answer as JSON.
#[pyfunction]
pub(crate) fn explain_code(code: &str) -> PyResult<String> {
    codes::find(code)
        .map(|found| json(&CodeAnswer::from(found)))
        .ok_or_else(|| PyKeyError::new_err(format!("there is no code {code:?}")))
}
