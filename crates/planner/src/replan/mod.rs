//! Incremental replanning for one mission, as needed in an adaptation loop.
//!
//! State and availability are inputs of each query, like assumptions in incremental SAT \[1\]. The mission is
//! grounded once, with all designs available and without conclusions from the initial values of numbers. A query
//! then gives a state of this task (see [`state_mapping`]) and a set of available objects, which restricts the
//! operators (see [`restrict_designs`]). Data that depend only on this set (operators, pattern databases,
//! non-dominated designs) are cached for recent sets, because failed components often recover. For each query, only
//! the search and the tie-breaking remain. An optimal plan has the same metric as after grounding and optimising
//! from scratch, but the SAT solver does not confirm it.
//!
//! If the previous plan is still valid, its cost is an upper bound for the search. At the time limit, a valid
//! previous plan is returned unless a better plan was found.
//!
//! No SAT solver with assumptions is used. On maps of 50 to 200 places, the search takes milliseconds and a
//! SAT proof seconds, and clauses learnt for one cost limit do not help with the next.
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

/// All multiples of 1/`PRECISION` are possible values of the task's numeric variables in a query.
const PRECISION: Int = 1_000_000;
const MAX_CACHED_SETS: usize = 8;

/// Maximum number of states of each search of [`Replanner::blocking`]. The result is only a hint
/// for users, so it must not take longer than planning.
const BLOCKING_STATES: usize = 5_000;

/// Incremental planner for problems of one domain that differ only in state and availability.
#[derive(Clone)]
pub struct Replanner {
    base: Arc<GroundBase>,
    /// The least recently used set of available objects comes first.
    sets: Vec<(Vec<Vec<ObjectId>>, Arc<AvailabilityContext>)>,
}

impl Replanner {
    /// Grounds a problem with all objects available. `available` lists the predicates that state availability.
    /// Returns `None` if replanning does not support the domain or problem, or if grounding fails. Not supported
    /// are timed initial literals, preferences, trajectory constraints and negative costs. Availability must be a
    /// condition on action parameters only. For an action that may have the duration 0, it must not be only a
    /// condition over all.
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
        let only_over_all = usage::only_over_all(domain, available);
        let may_ignore = |schema: u32| only_over_all.get(schema as usize).is_some_and(|only| *only);
        if task.operators.iter().any(|own| may_ignore(own.schema) && own.duration.minimum() <= 0) {
            return None;
        }
        let layout = Layout::new(Usage::of(domain, problem), available, &full, &task);
        Some(Self { base: Arc::new(GroundBase { task, layout, requirements }), sets: Vec::new() })
    }

    /// Computes a best plan for the state and availability of a query, within the limits of the query.
    pub fn plan(&mut self, query: &Query<'_>) -> ReplanOutcome {
        self.plan_aloud(query, &mut |_| {})
    }

    /// Computes a best plan like [`Replanner::plan`], and reports the progress of the search.
    pub fn plan_aloud(&mut self, query: &Query<'_>, report: &mut dyn FnMut(Progress)) -> ReplanOutcome {
        let base = self.base.clone();
        let Some(situation) = base.layout.situation(&base.task, query.problem) else {
            return ReplanOutcome::Misfit;
        };
        let Ok(set) = self.set(&situation.available, query.limits) else {
            let Ok(task) = base.masked(&situation.available, &query.limits.extended()) else {
                return ReplanOutcome::Unknown;
            };
            return solve::reuse_previous_plan(&base, &task, &situation, query);
        };
        solve::solve(&base, &set, &situation, query, STATE_LIMIT, report)
    }

    /// Returns a minimal set of unavailable objects that makes the problem unsolvable: if any single object
    /// of the set and all objects outside the set were available, there would be a plan. The problem must
    /// have no plan with the availability of the query. Returns an empty set if the problem has no plan even
    /// with all objects available. Returns `None` if a limit prevents the answer, or if the problem differs
    /// from the grounded one in more than state and availability. Uses deletion-based extraction of a minimal
    /// unsatisfiable subset \[1\].
    ///
    /// - \[1\] J. Marques-Silva, I. Lynce: On improving MUS extraction algorithms, SAT 2011.
    pub fn blocking(&mut self, query: &Query<'_>) -> Option<Vec<String>> {
        let base = self.base.clone();
        let situation = base.layout.situation(&base.task, query.problem)?;
        let possible = base.possible();
        let missing: Vec<(usize, ObjectId)> = (0..possible.len())
            .flat_map(|predicate| possible[predicate].iter().map(move |object| (predicate, *object)))
            .filter(|(predicate, object)| situation.available[*predicate].binary_search(object).is_err())
            .collect();
        let mut blocking = missing.clone();
        let is_solvable = |blocked: &[(usize, ObjectId)]| {
            let open = |predicate: usize| {
                let is_open = |object: &&ObjectId| !blocked.contains(&(predicate, **object));
                possible[predicate].iter().filter(is_open).copied().collect()
            };
            let available: Vec<Vec<ObjectId>> = (0..possible.len()).map(open).collect();
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
        // An object can be removed from the set if the remaining objects still make the problem unsolvable.
        for candidate in &missing {
            let reduced: Vec<_> = blocking.iter().copied().filter(|object| object != candidate).collect();
            if !is_solvable(&reduced)? {
                blocking = reduced;
            }
        }
        let name = |(_, object): &(usize, ObjectId)| base.task.object_names[object.index()].clone();
        let mut names: Vec<String> = blocking.iter().map(name).collect();
        names.sort();
        names.dedup();
        Some(names)
    }

    fn set(
        &mut self,
        available: &[Vec<ObjectId>],
        limits: &Limits,
    ) -> Result<Arc<AvailabilityContext>, Interrupted> {
        let context = match self.sets.iter().position(|(cached, _)| cached == available) {
            Some(position) => self.sets.remove(position).1,
            None => Arc::new(self.base.restrict(available, limits)?),
        };
        if self.sets.len() >= MAX_CACHED_SETS {
            self.sets.remove(0);
        }
        self.sets.push((available.to_vec(), context.clone()));
        Ok(context)
    }
}

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
        for object in objects.filter(|object| hierarchy.admits(&object.r#type, &parameter.r#type)) {
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
