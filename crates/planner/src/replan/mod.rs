//! Incremental replanning for one mission: the planner of an adaptation loop.
//!
//! Availability and state are assumptions, not facts \[1\]. The mission is grounded once, with every design
//! available and without conclusions from numbers. A problem is then a state of that task (see
//! [`state_mapping`]), and a set of available designs restricts its operators (see [`restrict_designs`]). Data
//! that depend on that set alone (operators, pattern databases, undominated designs) are cached for recent sets,
//! since failed components often recover. The remaining work per problem is the search, whose heuristic is exact
//! in the projections, and the tie-breaking. The answers equal those of grounding and optimising from scratch,
//! except that SAT does not prove them a second time.
//!
//! The previous plan, if it is still valid, is an upper bound, and the answer if time runs out first.
//!
//! No SAT solver is kept with assumptions: on maps of 50 to 200 places the search takes milliseconds and a SAT
//! proof seconds, and clauses learnt for one cost limit do not help with the next.
//!
//! - \[1\] N. Eén, N. Sörensson: Temporal induction by incremental SAT solving, ENTCS 89(4), 2003.

mod query;
mod replan_cache;
mod restrict_designs;
mod solve;
mod state_mapping;
mod usage;

use std::fmt;
use std::sync::Arc;

use pddl::TypeHierarchy;
use pddl::ast::{Atom, Domain, Identifier, InitialElement, Name, Problem, Span, Term};
use replan_cache::{AvailabilityContext, GroundBase};
use search::search::STATE_LIMIT;
use state_mapping::{Layout, ReplanState};
use task::compile::is_needed;
use task::ground::{Generality, GroundConfig, ground_for};
use task::lifted::ObjectId;
use task::limits::{Interrupted, Limits};
use task::number::Int;
use usage::Usage;

pub use query::{FirstStep, Progress, Query, ReplanOutcome};

/// Numbers of the initial state have at most so many decimals, as a power of ten.
const PRECISION: Int = 1_000_000;
/// For so many sets of available designs what was found out about them is kept.
const MAX_CACHED_SETS: usize = 8;

/// The search for what blocks a mission stores at most so many states each time: its answer is a help, and should not take longer
/// than the plan.
const BLOCKING_STATES: usize = 5_000;

/// Plans for problems of one domain that differ in their state and in what is available.
#[derive(Clone)]
pub struct Replanner {
    base: Arc<GroundBase>,
    /// The sets of available designs met last, the latest at the end.
    sets: Vec<(Vec<Vec<ObjectId>>, Arc<AvailabilityContext>)>,
}

impl Replanner {
    /// Grounds a problem with all that `available` says of some object taken for available. None if the domain does not lend
    /// itself to that: where availability is asked for otherwise than as a condition of actions on their parameters, where
    /// facts change by themselves, where there are preferences or constraints on trajectories, where actions earn something, or where the problem cannot be ground at all.
    pub fn new(
        domain: &Domain,
        problem: &Problem,
        available: &[Name],
        config: &GroundConfig,
    ) -> Option<Self> {
        if is_needed(domain, problem) {
            return None;
        }
        let requirements = usage::requirements(domain, available)?;
        let in_goal = |name: &Name| usage::in_condition(&problem.goal, name) > 0;
        let is_timed = |element: &InitialElement| matches!(element, InitialElement::Timed(..));
        if available.iter().any(in_goal) || problem.init.iter().any(is_timed) {
            return None;
        }
        let full = with_all(domain, problem, available);
        let generality = Generality { numbers: Some(PRECISION), ..Generality::default() };
        let task = ground_for(domain, &full, config, &generality).ok()?;
        if task.operators.iter().any(|operator| operator.cost.minimum() < 0 || operator.wait.is_some()) {
            return None;
        }
        let layout = Layout::new(Usage::of(domain, problem), available, problem, &task);
        Some(Self { base: Arc::new(GroundBase { task, layout, requirements }), sets: Vec::new() })
    }

    /// A best plan for a problem.
    pub fn plan(&mut self, query: &Query<'_>) -> ReplanOutcome {
        self.plan_aloud(query, &mut |_| {})
    }

    /// As [`Replanner::plan`], telling on the way how far the search is.
    pub fn plan_aloud(&mut self, query: &Query<'_>, report: &mut dyn FnMut(Progress)) -> ReplanOutcome {
        let base = self.base.clone();
        let Some(situation) = base.layout.situation(&base.task, query.problem) else {
            return ReplanOutcome::Misfit;
        };
        let Ok(set) = self.set(&situation.available, query.limits) else {
            let Ok(task) = base.masked(&situation.available, &Limits::none()) else {
                return ReplanOutcome::Unknown;
            };
            return solve::reuse_previous_plan(&base, &task, &situation, query);
        };
        solve::solve(&base, &set, &situation, query, STATE_LIMIT, report)
    }

    /// The smallest part of what is not available that alone leaves no plan for an unsolvable problem: with any one of these objects
    /// there would be one, were all others available, too. Nothing if other things are the reason; none if that could not be
    /// found out. The deletion-based search for a minimal unsatisfiable core \[1\].
    ///
    /// - \[1\] J. Marques-Silva, I. Lynce: On improving MUS extraction algorithms, SAT 2011.
    pub fn blocking(&mut self, query: &Query<'_>) -> Option<Vec<String>> {
        let base = self.base.clone();
        let situation = base.layout.situation(&base.task, query.problem)?;
        let all = base.possible();
        let missing: Vec<(usize, ObjectId)> = (0..all.len())
            .flat_map(|predicate| all[predicate].iter().map(move |object| (predicate, *object)))
            .filter(|(predicate, object)| situation.available[*predicate].binary_search(object).is_err())
            .collect();
        let mut blocking = missing.clone();
        let is_solvable = |blocked: &[(usize, ObjectId)]| {
            let open = |predicate: usize| {
                let is_open = |object: &&ObjectId| !blocked.contains(&(predicate, **object));
                all[predicate].iter().filter(is_open).copied().collect()
            };
            let available: Vec<Vec<ObjectId>> = (0..all.len()).map(open).collect();
            let situation = ReplanState { available, ..situation.clone() };
            let set = base.restrict(&situation.available, query.limits).ok()?;
            match solve::solve(&base, &set, &situation, query, BLOCKING_STATES, &mut |_| {}) {
                ReplanOutcome::Optimal { .. } => Some(true),
                ReplanOutcome::Unsolvable => Some(false),
                ReplanOutcome::Feasible { .. } | ReplanOutcome::Misfit | ReplanOutcome::Unknown => None,
            }
        };
        if !is_solvable(&[])? {
            return Some(Vec::new());
        }
        for one in &missing {
            let rest: Vec<_> = blocking.iter().copied().filter(|other| other != one).collect();
            if !is_solvable(&rest)? {
                blocking = rest;
            }
        }
        let name = |(_, object): &(usize, ObjectId)| base.task.object_names[object.index()].clone();
        let mut names: Vec<String> = blocking.iter().map(name).collect();
        names.sort();
        names.dedup();
        Some(names)
    }

    /// What is known of a set of available designs, or is found out now. What was cut short by a limit is not kept.
    fn set(
        &mut self,
        available: &[Vec<ObjectId>],
        limits: &Limits,
    ) -> Result<Arc<AvailabilityContext>, Interrupted> {
        let found = match self.sets.iter().position(|(known, _)| known == available) {
            Some(position) => self.sets.remove(position).1,
            None => Arc::new(self.base.restrict(available, limits)?),
        };
        if self.sets.len() >= MAX_CACHED_SETS {
            self.sets.remove(0);
        }
        self.sets.push((available.to_vec(), found.clone()));
        Ok(found)
    }
}

/// The problem with everything available that can be.
fn with_all(domain: &Domain, problem: &Problem, available: &[Name]) -> Problem {
    let hierarchy = TypeHierarchy::of(domain);
    let mut full = problem.clone();
    full.init.retain(|element| match element {
        InitialElement::Fact(atom) | InitialElement::NegatedFact(atom) => {
            !available.contains(&atom.predicate.name)
        }
        _ => true,
    });
    let declared = domain.predicates.iter().filter(|declared| available.contains(&declared.identifier.name));
    for declared in declared {
        let Some(parameter) = declared.parameters.first() else { continue };
        let objects = domain.constants.iter().chain(&problem.objects);
        for object in objects.filter(|object| hierarchy.fits(&object.r#type, &parameter.r#type)) {
            let name = Identifier { name: object.identifier.name.clone(), span: Span::default() };
            full.init.push(InitialElement::Fact(Atom {
                predicate: declared.identifier.clone(),
                arguments: vec![Term::Constant(name)],
                span: Span::default(),
            }));
        }
    }
    full
}

impl fmt::Debug for Replanner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Replanner").field("sets", &self.sets.len()).finish_non_exhaustive()
    }
}
