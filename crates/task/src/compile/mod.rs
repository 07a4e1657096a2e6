//! Compiles preferences and trajectory constraints of PDDL 3 to PDDL 2. Works on the syntax tree before names
//! are resolved.
//!
//! Each instance of a constraint (except `at end`) is monitored by an automaton. Auxiliary atoms store its state, and
//! additional effects of the actions update these atoms. A condition on the state *after* an action is regressed to the
//! state before the action (`regress`) \[1\], so the automata need no actions of their own. Hard constraints
//! become conditions of actions and of the goal. Preferences on the goal and on trajectories are evaluated
//! after the plan by hidden actions (`preferences`) \[2\]: each preference is satisfied or costs what the
//! metric specifies \[3\]. Violated preferences in preconditions are counted by additional effects. If actions
//! may overlap, the hidden actions are never executed; their conditions are evaluated in the last state.
//!
//! \[1\] L. Bonassi et al.: On planning with qualitative state-trajectory constraints in PDDL3 by compiling
//! them away, ICAPS 2021.
//! \[2\] E. Keyder, H. Geffner: Soft goals can be compiled away, JAIR 36, 2009.
//! \[3\] A. Gerevini et al.: Deterministic planning in the fifth international planning competition,
//! Artificial Intelligence 173, 2009.
//!
//! Names of auxiliary atoms and actions contain a space, so no name in a PDDL file can equal them.

mod deadline;
mod initial;
mod instances;
mod preferences;
mod regress;
mod semantics;
mod simplify;
mod syntax_edits;
mod timed;
mod trajectory_monitors;
use std::borrow::Cow;

use crate::error::{Errors, File};
use crate::limits::Limits;
use pddl::ast::{Constraint, Domain, Expression, InitialElement, Metric, Name, Problem, Term};

pub use deadline::Deadline;
use instances::Objects;
pub use semantics::PlanSemantics;
use syntax_edits::unsupported;
use trajectory_monitors::Monitors;

/// A task whose preferences and trajectory constraints have been compiled away, except deadlines
/// (`always-within`), which are checked on plans.
pub struct CompiledTask<'t> {
    pub domain: Cow<'t, Domain>,
    pub problem: Cow<'t, Problem>,
    pub objectives: Cow<'t, [Metric]>,
    /// Deadlines (`always-within`), which are checked once the times of a plan are known.
    pub deadlines: Vec<Deadline>,
    /// `false` if the compiled task may restrict the times of happenings more than the original task does. Irrelevant
    /// for sequential plans.
    pub is_exact: bool,
}

/// Returns `true` if the task has trajectory constraints or preferences, i.e. if [`compile`] would change the
/// task.
pub fn is_needed(domain: &Domain, problem: &Problem) -> bool {
    constraints(domain, problem).next().is_some()
        || domain.actions.iter().any(|action| !action.preferences.is_empty())
}

/// Returns `true` if the name belongs to an auxiliary action, for example one that evaluates a preference.
pub fn is_hidden(action: &str) -> bool {
    action.contains(' ')
}

/// Returns `true` if the name belongs to an auxiliary action that evaluates a preference as violated.
pub fn is_violation(action: &str) -> bool {
    is_hidden(action) && action.ends_with(preferences::VIOLATION)
}

/// Returns `true` if the name belongs to an auxiliary action that evaluates a preference as satisfied. Every sequential
/// plan ends with one evaluation for each of these actions, as satisfied or as violated.
pub fn is_satisfaction(action: &str) -> bool {
    is_hidden(action) && action.ends_with(preferences::SATISFACTION)
}

pub(crate) fn is_violation_count(function: &Name) -> bool {
    preferences::is_count(function)
}

/// Compiles preferences and trajectory constraints away. Preferences that do not occur in `objectives` are dropped. If
/// `objectives` is empty, the metric of the problem counts instead.
///
/// # Errors
/// Returns the unsupported constraints and preferences with their source locations, or an error if a limit is reached
/// or the run is interrupted.
pub fn compile<'t>(
    domain: &'t Domain,
    problem: &'t Problem,
    objectives: &'t [Metric],
    course: PlanSemantics<'_>,
    limits: &Limits,
) -> Result<CompiledTask<'t>, Errors> {
    if !is_needed(domain, problem) {
        let (domain, problem) = (Cow::Borrowed(domain), Cow::Borrowed(problem));
        return Ok(CompiledTask {
            domain,
            problem,
            objectives: Cow::Borrowed(objectives),
            deadlines: Vec::new(),
            is_exact: true,
        });
    }
    let used_preferences =
        preferences_in(if objectives.is_empty() { problem.metric.as_slice() } else { objectives });
    let objects = Objects::of(domain, problem, limits);
    let mut monitors = Monitors::new(domain, problem, &objects, course);
    let mut errors = Vec::new();
    for (file, constraint) in constraints(domain, problem) {
        if constraint.preference.as_ref().is_none_or(|name| used_preferences.contains(&name.name)) {
            errors.extend(monitors.add_constraint(file, constraint).err());
        }
    }
    for preference in domain.actions.iter().flat_map(|action| &action.preferences) {
        if used_preferences.contains(&preference.name.name) {
            let place = (File::Domain, preference.span);
            errors.extend(monitors.is_defined(&preference.condition, place).err());
        }
    }
    let has_events = problem.init.iter().any(|element| matches!(element, InitialElement::Timed(..)));
    if has_events && !used_preferences.is_empty() && matches!(course, PlanSemantics::Sequence) {
        let objective =
            objectives.iter().position(|metric| !preferences_in(std::slice::from_ref(metric)).is_empty());
        let place = match objective {
            Some(index) => (File::Objective(index), objectives[index].span),
            None => (File::Problem, problem.metric.as_ref().map_or(problem.name.span, |metric| metric.span)),
        };
        errors.push(unsupported(
            "a preference together with timed initial literals",
            "`--concurrent`, or preferences without timed initial literals",
            place,
        ));
    }
    limits.check().map_err(|interrupted| vec![interrupted.into()])?;
    if !errors.is_empty() {
        return Err(errors.into());
    }
    let mut task = (domain.clone(), problem.clone());
    (task.0.constraints, task.1.constraints) = (Vec::new(), Vec::new());
    let mut is_exact = monitors.keeps_apart_nothing();
    let (wanted, deadlines) = monitors.install(&mut task.0, &mut task.1);
    let mut objectives = objectives.to_vec();
    for metric in task.1.metric.iter_mut().chain(&mut objectives) {
        name_violations(&mut metric.expression);
    }
    if !used_preferences.is_empty() {
        // Preferences in preconditions are compiled to effects that read the conditions of the preferences. Happenings
        // that change such a condition are then separated from the action, although the original task does not require
        // this.
        let mut preferences = task.0.actions.iter().flat_map(|action| &action.preferences);
        is_exact &= !preferences.any(|preference| used_preferences.contains(&preference.name.name));
        preferences::install(&mut task.0, &mut task.1, (wanted, &used_preferences), course);
    }
    for action in &mut task.0.actions {
        action.preferences.clear();
    }
    let (domain, problem) = (Cow::Owned(task.0), Cow::Owned(task.1));
    Ok(CompiledTask { domain, problem, objectives: Cow::Owned(objectives), deadlines, is_exact })
}

fn constraints<'t>(
    domain: &'t Domain,
    problem: &'t Problem,
) -> impl Iterator<Item = (File, &'t Constraint)> + use<'t> {
    let of_domain = domain.constraints.iter().map(|constraint| (File::Domain, constraint));
    of_domain.chain(problem.constraints.iter().map(|constraint| (File::Problem, constraint)))
}

fn violation(expression: &Expression) -> Option<&Name> {
    match expression {
        Expression::Fluent(atom) if atom.predicate.name == Name::new("is-violated") => {
            match &atom.arguments[..] {
                [Term::Constant(name)] => Some(&name.name),
                _ => None,
            }
        }
        _ => None,
    }
}

fn preferences_in(objectives: &[Metric]) -> Vec<Name> {
    fn walk(expression: &Expression, found: &mut Vec<Name>) {
        if let Some(name) = violation(expression).filter(|name| !found.contains(name)) {
            found.push(name.clone());
        }
        if let Expression::Operation(_, operands, _) = expression {
            for operand in operands {
                walk(operand, found);
            }
        }
    }
    let mut preferences = Vec::new();
    for metric in objectives {
        walk(&metric.expression, &mut preferences);
    }
    preferences
}

fn name_violations(expression: &mut Expression) {
    if let Some(name) = violation(expression).cloned() {
        *expression = Expression::Fluent(preferences::count(&name));
    } else if let Expression::Operation(_, operands, _) = expression {
        operands.iter_mut().for_each(name_violations);
    }
}
