//! Planning parameters of the node.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use metaplan::message::Errors;
use ros2_client::ParameterValue;

use crate::node::{Declared, Node, Severity, any_value};
use crate::planner::Manner;

/// Default of `plan_solver_timeout` in seconds, as in PlanSys2.
const DEFAULT_TIMEOUT: f64 = 15.0;

/// Share of the timeout for planning. The reply must arrive before the client times out.
const PLANNING_SHARE: f64 = 0.9;

const DEFAULT_ALTERNATIVES: usize = 3;

fn declared() -> Vec<Declared> {
    let parameter =
        |name, description, value, check| Declared { name, description, value, is_dynamic: true, check };
    vec![
        parameter(
            "plan_solver_timeout",
            "time for which a client of the planner waits for a plan, in seconds",
            ParameterValue::Double(DEFAULT_TIMEOUT),
            timeout,
        ),
        parameter(
            "plan_solver_plugins",
            "accepted for PlanSys2's parameter files and ignored: there are no plugins",
            ParameterValue::StringArray(Vec::new()),
            any_value,
        ),
        parameter(
            "metric",
            "the metric to minimise if the problem has none, as problems of PlanSys2: `(cost)`, `total-time`",
            ParameterValue::String(String::new()),
            any_value,
        ),
        parameter(
            "overlap",
            "whether durative actions may overlap: `yes`, `no`, or `auto` (`yes` without a knowledge base, else `no`)",
            ParameterValue::String("auto".to_owned()),
            overlap,
        ),
        parameter(
            "alternatives",
            "maximum number of further equally good plans in the answer of get_plan_array",
            ParameterValue::Integer(DEFAULT_ALTERNATIVES as i64),
            alternatives,
        ),
    ]
}

fn timeout(value: &ParameterValue) -> Result<(), &'static str> {
    match value {
        ParameterValue::Double(seconds)
            if Duration::try_from_secs_f64(*seconds).is_ok_and(|timeout| !timeout.is_zero()) =>
        {
            Ok(())
        }
        _ => Err("must be a number of seconds above 0"),
    }
}

fn overlap(value: &ParameterValue) -> Result<(), &'static str> {
    match value {
        ParameterValue::String(text) if ["yes", "true", "no", "false", "auto"].contains(&text.as_str()) => {
            Ok(())
        }
        _ => Err("must be `yes`, `no` or `auto`"),
    }
}

fn alternatives(value: &ParameterValue) -> Result<(), &'static str> {
    match value {
        ParameterValue::Integer(0..=1000) => Ok(()),
        _ => Err("must be a number from 0 to 1000"),
    }
}

#[derive(Debug)]
pub(crate) struct Chosen {
    manner: Mutex<Manner>,
}

impl Chosen {
    /// Declares the planning parameters, and adopts their changes. The node must not have declared
    /// parameters before.
    pub(crate) fn declare(node: &Arc<Node>) -> Result<Arc<Self>, Errors> {
        let manner = Manner {
            metric: None,
            time_limit: Duration::ZERO,
            overlap: None,
            alternatives: DEFAULT_ALTERNATIVES,
        };
        let chosen = Arc::new(Self { manner: Mutex::new(manner) });
        let listener = Arc::clone(&chosen);
        let changed = move |name: &str, value: &ParameterValue| listener.set(name, value);
        for warning in node.declare(declared(), changed)? {
            node.log(Severity::Warn, &warning.message);
        }
        for parameter in declared() {
            if let Some(value) = node.parameter(parameter.name) {
                chosen.set(parameter.name, &value);
            }
        }
        Ok(chosen)
    }

    pub(crate) fn get(&self) -> Manner {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Manner> {
        self.manner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, name: &str, value: &ParameterValue) {
        let mut manner = self.lock();
        match (name, value) {
            ("plan_solver_timeout", ParameterValue::Double(seconds)) => {
                if let Ok(timeout) = Duration::try_from_secs_f64(*seconds) {
                    manner.time_limit = timeout.mul_f64(PLANNING_SHARE);
                }
            }
            ("metric", ParameterValue::String(text)) => {
                manner.metric = Some(text.trim().to_owned()).filter(|text| !text.is_empty());
            }
            ("overlap", ParameterValue::String(text)) => {
                manner.overlap = match text.as_str() {
                    "yes" | "true" => Some(true),
                    "no" | "false" => Some(false),
                    _ => None,
                };
            }
            ("alternatives", ParameterValue::Integer(count)) => {
                manner.alternatives = usize::try_from(*count).unwrap_or_default();
            }
            _ => {}
        }
    }
}
