//! Missions and their plans for Python.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Duration;

use metaplan::answers::{
    ChangesAnswer, CompareAnswer, ComparisonAnswer, DesignAnswer, PlanAnswer, VerdictAnswer,
};
use metaplan::comparison::{self, Coadaptation, Compared, NoResult, Risk, Tasked};
use metaplan::file::source;
use metaplan::knowledge::{COADAPTATION, Knowledge, Sources};
use metaplan::mapek::Loop;
use metaplan::message::{Errors, Message};
use metaplan::mission::{self as missions, Bindings, Names, read_plan};
use metaplan::pddl::{Source, validate};
use metaplan::planner::{Config, Exact, Limits, Plan, Solution, Step};
use metaplan::planner::{Planned as Found, Planner, consistent};
use metaplan::report::{Positions, Seen};
use metaplan::setup::Setup;
use metaplan::{explain, report};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use serde::Serialize;

use crate::failure::{listed, raise, raise_one};
use crate::wait::detached;

/// A mission in its current situation. If a thread changes the mission, calls that are running in
/// other threads keep the previous situation.
#[pyclass(module = "metaplan._native", frozen)]
pub(crate) struct Mission {
    setup: RwLock<Arc<Setup>>,
}

/// Result of planning, as JSON and text.
#[pyclass(module = "metaplan._native", frozen)]
pub(crate) struct Planned {
    /// The answer in the JSON format of `metaplan plan` or `metaplan plan --pareto`.
    #[pyo3(get)]
    json: String,
    /// The numbers of the answer as exact texts, in JSON; see `Numbers`.
    #[pyo3(get)]
    exact: String,
    /// The plan with one step per line. `None` without a plan, or for a Pareto front.
    #[pyo3(get)]
    text: Option<String>,
    /// The status and its proof in a sentence. For a Pareto front, only the status.
    #[pyo3(get)]
    verdict: String,
    /// Warnings as JSON.
    #[pyo3(get)]
    warnings: String,
    seen: Option<Drawable>,
}

/// Exact numbers of a plan as texts: decimals if possible, otherwise fractions. JSON numbers cannot
/// represent 1/3.
#[derive(Serialize)]
struct Numbers {
    cost: Option<String>,
    lower_bound: Option<String>,
    makespan: Option<String>,
    objectives: Vec<String>,
    steps: Vec<[String; 3]>,
    alternatives: Vec<Vec<[String; 3]>>,
}

#[derive(Serialize)]
struct FrontNumbers {
    points: Vec<Numbers>,
}

impl Numbers {
    fn of(solution: &Solution, objectives: &[Exact], alternatives: &[Plan]) -> Self {
        let text = |number: &Exact| number.to_string();
        Self {
            cost: solution.plan.as_ref().map(|plan| text(&plan.cost)),
            lower_bound: solution.lower_bound.as_ref().map(text),
            makespan: None,
            objectives: objectives.iter().map(text).collect(),
            steps: solution.plan.as_ref().map(Self::steps).unwrap_or_default(),
            alternatives: alternatives.iter().map(Self::steps).collect(),
        }
    }

    fn steps(plan: &Plan) -> Vec<[String; 3]> {
        let numbers = |step: &Step| [&step.start, &step.duration, &step.cost].map(Exact::to_string);
        plan.steps.iter().map(numbers).collect()
    }
}

/// Data from which a picture of the plan is drawn when it is requested.
struct Drawable {
    setup: Arc<Setup>,
    problem: metaplan::pddl::ast::Problem,
    solution: Solution,
}

#[pymethods]
impl Planned {
    /// Returns the plan as a timeline in SVG. `None` without a plan, and for a Pareto front.
    fn svg(&self) -> Option<String> {
        let Drawable { setup, problem, solution } = self.seen.as_ref()?;
        let seen = Seen { mission: &setup.mission, problem, positions: &Positions::Unknown };
        Some(report::plan_picture(seen, solution).svg())
    }
}

struct Wanted {
    config: Config,
    minimize: Vec<String>,
    pareto: Option<[String; 2]>,
    alternatives: Option<usize>,
    separation: Option<Exact>,
    certificate: Option<PathBuf>,
}

fn number(name: &str, text: &str) -> PyResult<Exact> {
    text.parse().map_err(|error| PyValueError::new_err(format!("{name}: {error}")))
}

fn word<T: std::str::FromStr<Err: std::fmt::Display>>(name: &str, text: &str) -> PyResult<T> {
    text.parse().map_err(|error| PyValueError::new_err(format!("{name}: {error}")))
}

pub(crate) fn seconds(name: &str, value: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(value)
        .map_err(|_| PyValueError::new_err(format!("{name} must be a number of seconds, not {value}")))
}

impl Mission {
    pub(crate) fn read(&self) -> Arc<Setup> {
        Arc::clone(&self.setup.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn change<T>(&self, change: impl FnOnce(&mut Setup) -> T) -> T {
        change(Arc::make_mut(&mut self.setup.write().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Mission {
    /// Reads a mission from a manifest.
    #[staticmethod]
    fn load(py: Python<'_>, manifest: PathBuf) -> PyResult<Self> {
        made(py, move || Setup::read(&manifest))
    }

    /// Reads a mission from the text of a manifest, whose paths are relative to a directory.
    #[staticmethod]
    fn parse(py: Python<'_>, name: String, text: String, directory: PathBuf) -> PyResult<Self> {
        made(py, move || Setup::parse(&name, &text, &directory))
    }

    /// Creates a mission from a domain and a problem, and optional knowledge bases. Domain and
    /// problem are each a path, or a name with a text.
    #[staticmethod]
    fn join(
        py: Python<'_>,
        name: String,
        files: [(PathBuf, Option<String>); 2],
        knowledge: Vec<PathBuf>,
        rules: Vec<String>,
        bindings: std::collections::BTreeMap<String, String>,
        names: Vec<(String, String)>,
    ) -> PyResult<Self> {
        made(py, move || joined(&name, files, knowledge, rules, &bindings, &names))
    }

    /// Returns a copy of the mission in the same situation.
    fn copy(&self) -> Self {
        Self { setup: RwLock::new(self.read()) }
    }

    /// Returns a checksum of everything that planning depends on: the mission with its files, the
    /// settings, and the version of Metaplan.
    fn digest(&self, py: Python<'_>) -> PyResult<String> {
        let setup = self.read();
        let control = py.detach(|| Loop::new(setup.mission.clone(), setup.settings.clone()));
        control.map(|control| control.digest()).map_err(|messages| raise(py, &messages))
    }

    /// Name of the mission.
    #[getter]
    fn name(&self) -> String {
        self.read().mission.name.clone()
    }

    /// Description of the mission.
    #[getter]
    fn description(&self) -> String {
        self.read().description.clone()
    }

    /// Names of the scenarios.
    #[getter]
    fn scenarios(&self) -> Vec<String> {
        self.read().scenarios.keys().cloned().collect()
    }

    /// Warnings about the mission's files, as JSON.
    #[getter]
    fn warnings(&self) -> String {
        listed(self.read().mission.warnings())
    }

    /// Returns the domain and the problem as PDDL. The problem includes facts and values from the
    /// knowledge base.
    fn pddl(&self, py: Python<'_>) -> PyResult<(String, String)> {
        let setup = self.read();
        let (problem, _) = setup.mission.filled().map_err(|messages| raise(py, &messages))?;
        let domain = metaplan::pddl::print_domain(setup.mission.domain());
        Ok((domain, metaplan::pddl::print_problem(&problem)))
    }

    /// Applies a scenario of the manifest.
    fn scenario(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        self.change(|setup| setup.apply(name)).map_err(|messages| raise(py, &messages))
    }

    /// Marks a component as failed.
    fn fail(&self, py: Python<'_>, component: &str) -> PyResult<()> {
        self.change(|setup| setup.mission.fail(component)).map_err(|message| raise_one(py, message))
    }

    /// Sets a measured attribute, a numeric fluent or a fact.
    fn set(&self, py: Python<'_>, name: &str, value: &str) -> PyResult<()> {
        self.change(|setup| setup.mission.set(name, value)).map_err(|message| raise_one(py, message))
    }

    /// Computes the best plan, or the Pareto front of two objectives. At a limit or when
    /// `on_improvement` returns `False`, returns the best result found until then. After Ctrl-C,
    /// returns the best plan found until then; raises `KeyboardInterrupt` without a plan, and for a
    /// Pareto front.
    #[pyo3(signature = (*, minimize, pareto=None, alternatives=None, concurrent=None, horizon=None, engine=None, strategy=None, confirm=false,
        time_limit=None, memory_limit=None, certificate=None, on_improvement=None))]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn plan(
        &self,
        py: Python<'_>,
        minimize: Vec<String>,
        pareto: Option<[String; 2]>,
        alternatives: Option<usize>,
        concurrent: Option<String>,
        horizon: Option<usize>,
        engine: Option<String>,
        strategy: Option<String>,
        confirm: bool,
        time_limit: Option<f64>,
        memory_limit: Option<usize>,
        certificate: Option<PathBuf>,
        on_improvement: Option<Py<PyAny>>,
    ) -> PyResult<Planned> {
        let mut limits = Limits::none();
        if let Some(time) = time_limit {
            limits = limits.with_time(seconds("time_limit", time)?);
        }
        if let Some(megabytes) = memory_limit {
            limits = limits.with_room(megabytes.saturating_mul(1 << 20));
        }
        let mut config = Config::default().with_horizon(horizon).with_confirmation(confirm);
        if let Some(engine) = &engine {
            config = config.with_engine(word("engine", engine)?);
        }
        if let Some(strategy) = &strategy {
            config = config.with_strategy(word("strategy", strategy)?);
        }
        let separation = concurrent.as_deref().map(|text| number("concurrent", text)).transpose()?;
        let interrupt = limits.interrupt();
        let config = config.with_limits(limits);
        let wanted = Wanted { config, minimize, pareto, alternatives, separation, certificate };
        let setup = self.read();
        let (found, stopped) = detached(py, &interrupt, || planned(&setup, wanted, on_improvement.as_ref()));
        match (found, stopped) {
            (Ok(planned), None) => Ok(planned),
            // After Ctrl-C, the best known plan is returned. A Pareto front, which has no `text`, is not returned.
            (Ok(planned), Some(error))
                if planned.text.is_some() && error.is_instance_of::<PyKeyboardInterrupt>(py) =>
            {
                Ok(planned)
            }
            (_, Some(error)) | (Err(Stop::Raised(error)), None) => Err(error),
            (Err(Stop::Wrong(messages)), None) => Err(raise(py, &messages)),
        }
    }

    /// Compares the plan with policies of probabilistic model checking. Returns the answer as JSON.
    fn compare(
        &self,
        py: Python<'_>,
        loss: Option<(String, f64)>,
        battery_unit: Option<u32>,
        penalty: Option<f64>,
        state_limit: usize,
    ) -> PyResult<String> {
        if let Some(penalty) = penalty.filter(|penalty| !(0.0..f64::INFINITY).contains(penalty)) {
            let text = format!("penalty must be a time that is at least 0, not {penalty}");
            return Err(PyValueError::new_err(text));
        }
        let setup = self.read();
        let mut roles = setup.roles.clone();
        if let Some((component, rate)) = loss {
            (roles.loss_component, roles.loss_rate) = (Some(component), rate);
        }
        roles.battery_unit = battery_unit.unwrap_or(roles.battery_unit);
        let mission = &setup.mission;
        let beside = || -> Result<String, NoResult> {
            let (problem, _) = mission.filled()?;
            let spelt_out = Coadaptation::is_spelt_out(&problem, &roles);
            let tasked = if spelt_out { None } else { Some(Tasked::new(mission, &problem, &roles)?) };
            let own = match &tasked {
                Some(tasked) => tasked.coadaptation.clone(),
                None => Coadaptation::new(mission, &problem, &roles)?,
            };
            own.check_loss().map_err(Errors::from)?;
            let compared = Compared { mission, roles: &roles, coadaptation: &own, tasked: tasked.as_ref() };
            let (risk, memory) = (Risk::all(&own), &|| None);
            let config = comparison::Config {
                risk,
                penalty,
                priority: comparison::Priority::Time,
                states: state_limit,
                memory,
            };
            let comparison = compared.compare(&config, &mut |_, _| {})?;
            let answer = CompareAnswer::new(vec![ComparisonAnswer::new(None, &comparison)], &[], &[]);
            Ok(serde_json::to_string(&answer).unwrap_or_default())
        };
        py.detach(beside).map_err(|error| match error {
            NoResult::Planner(messages) => raise(py, &messages),
            NoResult::Process(error) => raise_one(py, Message::error("Q506", error.to_string())),
        })
    }

    /// Validates a plan, given as text. Returns the verdict as JSON.
    fn validate(&self, py: Python<'_>, plan: &str, concurrent: bool, tolerance: &str) -> PyResult<String> {
        let tolerance = number("tolerance", tolerance)?.to_rational();
        let setup = self.read();
        let mission = &setup.mission;
        let judged = || {
            let (problem, _) = mission.filled()?;
            let plan = read_plan(&Source::new("plan", plan), mission)?;
            let options = validate::Options::default().with_concurrent(concurrent).with_tolerance(tolerance);
            let verdict = validate::validate(mission.domain(), &problem, &plan, &options);
            Ok(serde_json::to_string(&VerdictAnswer::new(&verdict)).unwrap_or_default())
        };
        py.detach(judged).map_err(|messages: Errors| raise(py, &messages))
    }

    /// Explains the availability and choice of a design. Without a design, explains which changes
    /// would alter the plan. Returns the answer as JSON.
    fn explain(&self, py: Python<'_>, design: Option<String>, time_limit: Option<f64>) -> PyResult<String> {
        let mut limits = Limits::none();
        if let Some(time) = time_limit {
            limits = limits.with_time(seconds("time_limit", time)?);
        }
        let interrupt = limits.interrupt();
        let setup = self.read();
        let (found, stopped) = detached(py, &interrupt, || {
            let mission = &setup.mission;
            let json = if let Some(design) = &design {
                let explanation = explain::design(mission, design, &limits)?;
                serde_json::to_string(&DesignAnswer::new(&mission.name, &explanation))
            } else {
                let changes = explain::smallest_changes(mission, &limits, &mut |_| {})?;
                serde_json::to_string(&ChangesAnswer::new(&mission.name, &changes))
            };
            Ok(json.unwrap_or_default())
        });
        match stopped {
            Some(error) => Err(error),
            None => found.map_err(|messages: Errors| raise(py, &messages)),
        }
    }
}

/// Reads a mission with the interpreter lock released, and checks that its inputs fit together.
fn made(py: Python<'_>, read: impl FnOnce() -> Result<Setup, Errors> + Send) -> PyResult<Mission> {
    let checked = move || {
        let setup = read()?;
        // Incompatible inputs are reported immediately, not on later queries.
        setup.mission.filled()?;
        Ok(setup)
    };
    let setup = py.detach(checked).map_err(|messages: Errors| raise(py, &messages))?;
    Ok(Mission { setup: RwLock::new(Arc::new(setup)) })
}

fn joined(
    name: &str,
    files: [(PathBuf, Option<String>); 2],
    documents: Vec<PathBuf>,
    rules: Vec<String>,
    bindings: &std::collections::BTreeMap<String, String>,
    own_names: &[(String, String)],
) -> Result<Setup, Errors> {
    let [domain, problem] = files.map(|(path, text)| match text {
        Some(text) => Ok(Source::new(path.display().to_string(), text)),
        None => source(&path),
    });
    let mut names = Names::default();
    for (individual, object) in own_names {
        names.add(individual, object, None);
    }
    let text = domain.as_ref().map_or("", |domain| domain.text());
    let rules = if rules.is_empty() { vec![COADAPTATION.to_owned()] } else { rules };
    let sources = Sources { documents, rules, ..Sources::default() };
    let knowledge = (!sources.documents.is_empty()).then(|| Knowledge::read_for(&sources, text));
    let bindings = Bindings::with(bindings).map_err(|text| Message::error("M105", text))?.naming(names);
    Ok(missions::Mission::new(name, knowledge, bindings, domain, problem)?.into())
}

/// Reason why there is no answer: errors of Metaplan, or a Python exception.
enum Stop {
    Wrong(Errors),
    Raised(PyErr),
}

impl From<Errors> for Stop {
    fn from(messages: Errors) -> Self {
        Self::Wrong(messages)
    }
}

fn planned(setup: &Arc<Setup>, wanted: Wanted, on_improvement: Option<&Py<PyAny>>) -> Result<Planned, Stop> {
    let mission = &setup.mission;
    consistent(mission.knowledge())?;
    let raised: Mutex<Option<PyErr>> = Mutex::default();
    let tell = |better: &metaplan::planner::Improvement| {
        let Some(listener) = on_improvement else { return ControlFlow::Continue(()) };
        let (cost, bound) = (better.cost.to_string(), better.lower_bound.to_string());
        let outcome = Python::attach(|py| {
            listener.call1(py, (cost, bound, better.gap(), better.horizon)).and_then(|said| said.extract(py))
        });
        match outcome {
            Ok(Some(false)) => ControlFlow::Break(()),
            Ok(_) => ControlFlow::Continue(()),
            Err(error) => {
                *raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                ControlFlow::Break(())
            }
        }
    };
    let planner = Planner::new(mission)?;
    let warnings = listed(mission.warnings().chain(planner.warnings()));
    let planner = planner
        .config(wanted.config)
        .minimize(wanted.minimize)
        .concurrent(wanted.separation.map(|separation| separation.to_rational()))
        .alternatives(wanted.alternatives)
        .on_improvement(tell);
    let answer = match &wanted.pareto {
        Some([first, second]) => {
            let front = planner.pareto([first, second])?;
            if let Some(directory) = &wanted.certificate {
                front.certify(directory).map_err(Errors::from)?;
            }
            let json = serde_json::to_string(&front.answer()).unwrap_or_default();
            let solved = front.front.points.iter().filter(|point| point.solution.plan.is_some());
            let points = solved.map(|point| Numbers::of(&point.solution, &point.values, &[])).collect();
            let exact = serde_json::to_string(&FrontNumbers { points }).unwrap_or_default();
            let verdict = front.front.status.to_string();
            Planned { json, exact, text: None, verdict, warnings, seen: None }
        }
        None => answered(setup, planner.plan()?, wanted.certificate, warnings)?,
    };
    match raised.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(Stop::Raised(error)),
        None => Ok(answer),
    }
}

fn answered(
    setup: &Arc<Setup>,
    found: Found<'_>,
    certificate: Option<PathBuf>,
    warnings: String,
) -> Result<Planned, Errors> {
    if let Some(directory) = certificate {
        found.certify(&directory)?;
    }
    let answer: PlanAnswer = found.answer();
    let json = serde_json::to_string(&answer).unwrap_or_default();
    let alternatives = found.alternatives.as_ref().map_or(&[][..], |found| &found.plans);
    // Only objectives of the call have names and are part of the answer; values of the problem's
    // own metric are not.
    let values = &found.values[..found.values.len().min(found.objectives().len())];
    let makespan = found.solution.plan.as_ref().filter(|_| found.overlaps()).map(Plan::makespan);
    let numbers = Numbers {
        makespan: makespan.map(|makespan| makespan.to_string()),
        ..Numbers::of(&found.solution, values, alternatives)
    };
    let exact = serde_json::to_string(&numbers).unwrap_or_default();
    let (verdict, problem) = (found.solution.verdict(), found.problem().clone());
    let solution = found.solution;
    let text = solution.plan.as_ref().map(Plan::to_string);
    let seen = text.is_some().then(|| Drawable { setup: Arc::clone(setup), problem, solution });
    Ok(Planned { json, exact, text, verdict, warnings, seen })
}
