//! Checks an optimality proof (argument) against the ground task, by induction over the steps of plans. Each
//! state that matters must be covered by a label (state with a cost) of the argument, or pruned by a lower
//! bound. Arithmetic is exact.

use std::rc::Rc;

use num_rational::BigRational;
use rustc_hash::FxHashMap;
use serde::de::DeserializeOwned;

use crate::argument::ARGUMENT_FORMAT;
use crate::argument::Argument;
use crate::integer::Integer;
use crate::model::TASK_FORMAT;
use crate::model::{Model, Operator, Quantity};
use crate::references;
use crate::semantics::{State, holds_without_numbers};
use crate::table::{Table, TableFault, check_need, check_potential};

/// Upper limit on the number of non-dominated combinations of designs, summed over all operators. Operators with equal
/// slots, exclusions, costs and numeric expressions are counted once.
const CHOICE_LIMIT: usize = 1 << 20;
/// Upper limit on the number of pairwise comparisons of design combinations, summed over all
/// operators; about 1 s of work.
const COMPARISON_LIMIT: usize = 1 << 25;
/// Number of labels between two polls of the limits.
const POLL_INTERVAL: usize = 64;
/// Work of enumerating one combination of designs, in units of one comparison.
const COMBINATION_COST: usize = 2;

/// Sizes of a checked optimality proof.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checked {
    /// Number of labels, i.e. of states in the induction.
    pub labels: usize,
    /// Number of tables with lower bounds on the remaining cost (potentials).
    pub potentials: usize,
    /// Number of tables with lower bounds on required numeric values (needs).
    pub needs: usize,
}

/// The first reason why a certificate is rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// A document (task or argument) is malformed, or the task exceeds a limit of the checker.
    #[error("{document}: {reason}")]
    Form {
        /// Name of the document.
        document: &'static str,
        /// Description of the error.
        reason: String,
    },
    /// The claimed cost is not the cost of any plan, because it is not integral in the units of the
    /// task.
    #[error("no plan of the task can cost {0}")]
    Cost(String),
    /// An entry of a table is not a lower bound.
    #[error("{table} {position} is not a lower bound: {reason}")]
    Bound {
        /// Kind of the table: `potential` (remaining cost) or `need` (required numeric value).
        table: &'static str,
        /// Position of the table among the tables of this kind, from 0.
        position: usize,
        /// Description of the entry or operator that violates the bound.
        reason: String,
    },
    /// The initial state is neither covered by a label (state of the proof) nor pruned by a bound.
    #[error("no label covers the initial state")]
    Initial,
    /// A label (state of the proof), given by its position in the argument, is a goal state with a
    /// smaller cost than claimed.
    #[error("label {0} is a goal state, and cheaper than claimed")]
    Goal(usize),
    /// A label (state of the proof), given by its position in the argument, is a goal state, but the
    /// claim is that there is no plan.
    #[error("label {0} is a goal state, but the claim is that there is no plan")]
    Solvable(usize),
    /// A successor of a label (state of the proof) is neither covered by a label nor pruned by a
    /// bound.
    #[error("label {label}, operator {operator}: nothing covers the state that follows")]
    Successor {
        /// Position of the label in the argument, from 0.
        label: usize,
        /// Position of the operator in the task, from 0.
        operator: usize,
    },
    /// The check was cancelled.
    #[error("the check was stopped before its end")]
    Stopped,
}

/// A ground task that was read from its document. All references in it are checked.
#[derive(Debug)]
pub struct GroundTask {
    pub(super) model: Model,
}

impl GroundTask {
    /// Reads the document of a ground task.
    ///
    /// # Errors
    /// The document is malformed.
    pub fn read(text: &str) -> Result<Self, Fault> {
        let model: Model = read("the task", text)?;
        require_format("the task", &model.format, TASK_FORMAT)?;
        references::task(&model).map_err(|reason| form("the task", reason))?;
        Ok(Self { model })
    }
}

/// A ground task with an argument and a claim. All references in the argument are checked.
#[derive(Debug)]
pub struct Claimed<'c> {
    pub(super) model: &'c Model,
    pub(super) argument: Argument,
    /// The claim as a sum of operator costs. `None` claims that there is no plan.
    pub(super) cost: Option<Integer>,
}

impl<'c> Claimed<'c> {
    /// Reads the document of an argument about a task. `claim` is the claimed value of the metric; without it, the
    /// claim is that the task has no plan.
    ///
    /// # Errors
    /// The document is malformed, or no plan of the task can have the claimed value.
    pub fn read(task: &'c GroundTask, argument: &str, claim: Option<&BigRational>) -> Result<Self, Fault> {
        let model = &task.model;
        let argument: Argument = read("the argument", argument)?;
        require_format("the argument", &argument.format, ARGUMENT_FORMAT)?;
        references::argument(model, &argument).map_err(|reason| form("the argument", reason))?;
        let cost = claim.map(|claim| cost(model, claim)).transpose()?;
        Ok(Self { model, argument, cost })
    }

    /// Checks that no plan of the task has a better metric value than the claim. Without a claimed value, checks that
    /// the task has no plan. `stop` returns `true` to cancel the check.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self, stop: &dyn Fn() -> bool) -> Result<Checked, Fault> {
        let Self { model, argument, cost } = self;
        let mut potentials = Vec::new();
        for (potential, position) in argument.potentials.iter().zip(0..) {
            let table = Table::new(model, &potential.pattern, &potential.values);
            check_potential(model, &table, stop).map_err(|fault| fault.at("potential", position))?;
            potentials.push(table);
        }
        let mut needs = Vec::new();
        for (need, position) in argument.needs.iter().zip(0..) {
            let table = Table::new(model, &need.pattern, &need.values);
            check_need(model, need.number, &table, stop).map_err(|fault| fault.at("need", position))?;
            needs.push((need.number as usize, table));
        }
        let mut labels: FxHashMap<&[u32], Vec<(&[Integer], &Integer)>> = FxHashMap::default();
        for label in &argument.labels {
            labels.entry(&label.0).or_default().push((&label.1, &label.2));
        }
        let monotone = model.more_never_hurts();
        let choices = choices(model, monotone, stop)?;
        let checker = Checker { choices, model, cost: cost.as_ref(), potentials, needs, labels, monotone };
        checker.induction(argument, stop)?;
        Ok(Checked {
            labels: argument.labels.len(),
            potentials: argument.potentials.len(),
            needs: argument.needs.len(),
        })
    }
}

/// Checks that no plan of the ground task `task` has a better metric value than `claim`. Without a
/// claim, checks that the task has no plan. `argument` is the proof.
///
/// # Errors
/// The first fault found.
pub fn check(task: &str, argument: &str, claim: Option<&BigRational>) -> Result<Checked, Fault> {
    Claimed::read(&GroundTask::read(task)?, argument, claim)?.check(&|| false)
}

fn require_format(document: &'static str, format: &str, expected: &str) -> Result<(), Fault> {
    if format == expected {
        return Ok(());
    }
    Err(form(document, format!("format `{format}`, where `{expected}` is expected")))
}

impl TableFault {
    fn at(self, table: &'static str, position: usize) -> Fault {
        match self {
            Self::NoBound(reason) => Fault::Bound { table, position, reason },
            Self::Stopped => Fault::Stopped,
        }
    }
}

fn stopped(stop: &dyn Fn() -> bool) -> Result<(), Fault> {
    if stop() { Err(Fault::Stopped) } else { Ok(()) }
}

fn form(document: &'static str, reason: String) -> Fault {
    Fault::Form { document, reason }
}

fn read<T: DeserializeOwned>(document: &'static str, text: &str) -> Result<T, Fault> {
    serde_json::from_str(text).map_err(|error| form(document, error.to_string()))
}

fn cost(model: &Model, metric: &BigRational) -> Result<Integer, Fault> {
    let scaled = metric * model.objective.scale.to_rational();
    let scaled = if model.objective.maximize { -scaled } else { scaled };
    let cost = scaled.is_integer().then(|| &Integer::from(scaled.to_integer()) - &model.objective.offset);
    cost.ok_or_else(|| Fault::Cost(metric.to_string()))
}

/// A combination of designs, one for each slot of an operator, with the cost of the operator.
type Choice = (Vec<u32>, Integer);

struct Checker<'c> {
    model: &'c Model,
    cost: Option<&'c Integer>,
    potentials: Vec<Table<'c>>,
    needs: Vec<(usize, Table<'c>)>,
    labels: FxHashMap<&'c [u32], Vec<(&'c [Integer], &'c Integer)>>,
    monotone: bool,
    choices: Vec<Rc<[Choice]>>,
}

impl Checker<'_> {
    fn induction(&self, argument: &Argument, stop: &dyn Fn() -> bool) -> Result<(), Fault> {
        // An empty clause in the goal means that grounding has found the goal unreachable.
        if self.cost.is_none() && self.model.goal.clauses.iter().any(Vec::is_empty) {
            return Ok(());
        }
        if !self.is_covered(&self.model.initial(), &Integer::ZERO) {
            return Err(Fault::Initial);
        }
        let index = Index::new(self.model);
        for (label, position) in argument.labels.iter().zip(0_usize..) {
            if position.is_multiple_of(POLL_INTERVAL) {
                stopped(stop)?;
            }
            let state = self.model.state(&label.0, &label.1);
            let paid = &label.2;
            if self.model.holds(&self.model.goal, &state, &[], &[]) {
                match self.cost {
                    None => return Err(Fault::Solvable(position)),
                    Some(cost) if paid < cost => return Err(Fault::Goal(position)),
                    Some(_) => {}
                }
            }
            for operator in index.candidates(&state) {
                if !self.successors_are_covered(operator, &state, paid) {
                    return Err(Fault::Successor { label: position, operator });
                }
            }
        }
        Ok(())
    }

    fn successors_are_covered(&self, position: usize, state: &State, paid: &Integer) -> bool {
        let operator = &self.model.operators[position];
        if !holds_without_numbers(&operator.condition, state) {
            return true;
        }
        let sizes = self.model.sizes(operator);
        self.choices[position].iter().all(|(choice, cost)| {
            !self.model.holds(&operator.condition, state, choice, &sizes)
                || self.is_covered(&self.model.successor(operator, state, choice, &sizes), &(paid + cost))
        })
    }

    /// Returns `true` if a lower bound prunes a state that is reached at cost `paid`, or if a label covers it.
    fn is_covered(&self, state: &State, paid: &Integer) -> bool {
        let too_expensive = self.potentials.iter().any(|potential| match (potential.at(state), self.cost) {
            (None, _) => true,
            (Some(more), Some(cost)) => paid + more >= *cost,
            (Some(_), None) => false,
        });
        let exhausted = |(number, need): &(usize, Table<'_>)| {
            need.at(state).is_none_or(|need| !need.is_zero() && *need > state.numbers[*number])
        };
        if too_expensive || self.needs.iter().any(exhausted) {
            return true;
        }
        let labels = self.labels.get(&state.values[..self.model.basic]);
        labels.into_iter().flatten().any(|(numbers, cost)| {
            let mut pairs = numbers.iter().zip(&state.numbers);
            *cost <= paid
                && if self.monotone { pairs.all(|(a, b)| a >= b) } else { pairs.all(|(a, b)| a == b) }
        })
    }
}

/// Returns the non-dominated combinations of designs of each operator.
///
/// A combination dominates another one if it costs no more, satisfies every condition that the
/// other one satisfies, and leaves every number at least as high. (If larger numbers may hurt, the
/// numbers must be equal.) A label that covers the successor by the dominating combination then
/// also covers the successor by the dominated one.
fn choices(model: &Model, monotone: bool, stop: &dyn Fn() -> bool) -> Result<Vec<Rc<[Choice]>>, Fault> {
    let mut fronts: FxHashMap<_, Rc<[Choice]>> = FxHashMap::default();
    let mut count = 0_usize;
    let mut comparisons = 0;
    let mut choices = Vec::new();
    for operator in &model.operators {
        let quantities: Vec<_> = quantities(operator).collect();
        // Operators with equal slots, exclusions, costs and numeric expressions share a Pareto front.
        let key = (operator.uses, operator.exclusions, &operator.cost, quantities.clone());
        let front = if let Some(known) = fronts.get(&key) {
            Rc::clone(known)
        } else {
            stopped(stop)?;
            let front = front(model, operator, &quantities, monotone, &mut comparisons)?;
            count = count.saturating_add(front.len());
            if count > CHOICE_LIMIT {
                let reason = format!("more than {CHOICE_LIMIT} combinations of designs matter");
                return Err(form("the task", reason));
            }
            fronts.insert(key, Rc::clone(&front));
            front
        };
        choices.push(front);
    }
    Ok(choices)
}

/// Computes the non-dominated combinations for one operator. Adds the work, in comparisons of two
/// combinations, to `comparisons`.
fn front(
    model: &Model,
    operator: &Operator,
    quantities: &[&Quantity],
    monotone: bool,
    comparisons: &mut usize,
) -> Result<Rc<[Choice]>, Fault> {
    let sizes = model.sizes(operator);
    let mut front: Vec<(Choice, Vec<Integer>)> = Vec::new();
    let as_good = |a: &(Choice, Vec<Integer>), b: &(Choice, Vec<Integer>)| {
        let mut pairs = a.1.iter().zip(&b.1);
        a.0.1 <= b.0.1 && if monotone { pairs.all(|(a, b)| a >= b) } else { pairs.all(|(a, b)| a == b) }
    };
    let candidates = model.choices(operator);
    let combinations = candidates.len();
    for choice in candidates {
        *comparisons = comparisons.saturating_add(front.len()).saturating_add(COMBINATION_COST);
        if *comparisons > COMPARISON_LIMIT {
            let reason = format!(
                "an operator with {combinations} combinations of designs, too many of which have advantages over \
                 each other: more than {COMPARISON_LIMIT} comparisons"
            );
            return Err(form("the task", reason));
        }
        let profile = quantities.iter().map(|quantity| model.quantity(quantity, &choice, &sizes)).collect();
        let cost = model.quantity(&operator.cost, &choice, &sizes);
        let new = ((choice, cost), profile);
        if !front.iter().any(|old| as_good(old, &new)) {
            front.retain(|old| !as_good(&new, old));
            front.push(new);
        }
    }
    Ok(front.into_iter().map(|(choice, _)| choice).collect())
}

fn quantities(operator: &Operator) -> impl Iterator<Item = &Quantity> {
    let changes = operator.changes.iter().map(|(_, value)| value);
    operator.condition.comparisons.iter().chain(changes).map(|linear| &linear.quantity)
}

/// `by_fact` lists each operator under one of the facts that it requires; `always` lists the
/// operators that require no fact.
struct Index {
    by_fact: FxHashMap<(u32, u32), Vec<usize>>,
    always: Vec<usize>,
}

impl Index {
    fn new(model: &Model) -> Self {
        let mut index = Self { by_fact: FxHashMap::default(), always: Vec::new() };
        for (operator, position) in model.operators.iter().zip(0..) {
            // A fact about the variable with the largest domain is the most selective key.
            let widest =
                operator.condition.facts.iter().max_by_key(|fact| model.variables[fact.0 as usize].len());
            match widest {
                Some(fact) => index.by_fact.entry(*fact).or_default().push(position),
                None => index.always.push(position),
            }
        }
        index
    }

    fn candidates<'i>(&'i self, state: &'i State) -> impl Iterator<Item = usize> + 'i {
        let facts = (0..).zip(state.values.iter().copied());
        let required = facts.filter_map(|fact| self.by_fact.get(&fact)).flatten();
        self.always.iter().chain(required).copied()
    }
}
