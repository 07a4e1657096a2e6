//! Checks the argument of a certificate against the written task, by arithmetic alone.

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
use crate::table::{Table, check_need, check_potential};

/// Combinations of designs that matter, of all operators together, are not more than this.
const CHOICE_LIMIT: usize = 1 << 20;
/// Upper limit on the comparisons of two combinations of designs, of all operators together: about a second.
const COMPARISON_LIMIT: usize = 1 << 25;
/// Going through a combination counts as this many comparisons.
const COMBINATION_COST: usize = 2;

/// What was checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checked {
    /// States that the induction goes through.
    pub labels: usize,
    /// Tables of lower bounds on cost.
    pub potentials: usize,
    /// Tables of lower bounds on resources.
    pub needs: usize,
}

/// Why a certificate is not accepted: the first thing that is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// A document does not have its form.
    #[error("{document}: {reason}")]
    Form {
        /// Which one.
        document: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// The claimed cost is none that the task can have.
    #[error("no plan of the task can cost {0}")]
    Cost(String),
    /// A table of lower bounds is wrong.
    #[error("{table} {position} is not a lower bound: {reason}")]
    Bound {
        /// `potential` or `need`.
        table: &'static str,
        /// Counted from 0.
        position: usize,
        /// Where it fails.
        reason: String,
    },
    /// The initial state is not covered.
    #[error("no label covers the initial state")]
    Initial,
    /// A label is a goal state that costs less than the claim.
    #[error("label {0} is a goal state, and cheaper than claimed")]
    Goal(usize),
    /// A successor of a label is neither covered nor cut off.
    #[error("label {label}, operator {operator}: nothing covers the state that follows")]
    Successor {
        /// Position of the label, from 0.
        label: usize,
        /// Position of the operator, from 0.
        operator: usize,
    },
}

/// Checks that no plan of the task has a better metric than `claim`, or that it has no plan at all if there is no claim.
///
/// # Errors
/// The first thing that is wrong.
pub fn check(task: &str, argument: &str, claim: Option<&BigRational>) -> Result<Checked, Fault> {
    let (model, argument, cost) = parse(task, argument, claim)?;
    let mut potentials = Vec::new();
    for (potential, position) in argument.potentials.iter().zip(0..) {
        let table = Table::new(&model, &potential.pattern, &potential.values);
        check_potential(&model, &table).map_err(|reason| Fault::Bound {
            table: "potential",
            position,
            reason,
        })?;
        potentials.push(table);
    }
    let mut needs = Vec::new();
    for (need, position) in argument.needs.iter().zip(0..) {
        let table = Table::new(&model, &need.pattern, &need.values);
        check_need(&model, need.number, &table).map_err(|reason| Fault::Bound {
            table: "need",
            position,
            reason,
        })?;
        needs.push((need.number as usize, table));
    }
    let mut labels: FxHashMap<&[u32], Vec<(&[Integer], &Integer)>> = FxHashMap::default();
    for label in &argument.labels {
        labels.entry(&label.0).or_default().push((&label.1, &label.2));
    }
    let monotone = model.more_never_hurts();
    let checker = Checker {
        choices: choices(&model, monotone)?,
        model: &model,
        cost,
        potentials,
        needs,
        labels,
        monotone,
    };
    checker.induction(&argument)?;
    Ok(Checked {
        labels: argument.labels.len(),
        potentials: argument.potentials.len(),
        needs: argument.needs.len(),
    })
}

/// The documents, with what they refer to in place, and the sum of operator costs that is claimed.
pub(super) fn parse(
    task: &str,
    argument: &str,
    claim: Option<&BigRational>,
) -> Result<(Model, Argument, Option<Integer>), Fault> {
    let model: Model = read("the task", task)?;
    let argument: Argument = read("the argument", argument)?;
    for (document, found, expected) in
        [("the task", &model.format, TASK_FORMAT), ("the argument", &argument.format, ARGUMENT_FORMAT)]
    {
        if found != expected {
            return Err(form(document, format!("format `{found}`, where `{expected}` is expected")));
        }
    }
    references::task(&model).map_err(|reason| form("the task", reason))?;
    references::argument(&model, &argument).map_err(|reason| form("the argument", reason))?;
    let cost = claim.map(|claim| cost(&model, claim)).transpose()?;
    Ok((model, argument, cost))
}

fn form(document: &'static str, reason: String) -> Fault {
    Fault::Form { document, reason }
}

fn read<T: DeserializeOwned>(document: &'static str, text: &str) -> Result<T, Fault> {
    serde_json::from_str(text).map_err(|error| form(document, error.to_string()))
}

/// The sum of operator costs that a metric stands for.
fn cost(model: &Model, metric: &BigRational) -> Result<Integer, Fault> {
    let scaled = metric * model.objective.scale.to_rational();
    let scaled = if model.objective.maximize { -scaled } else { scaled };
    let cost = scaled.is_integer().then(|| &Integer::from(scaled.to_integer()) - &model.objective.offset);
    cost.ok_or_else(|| Fault::Cost(metric.to_string()))
}

/// A combination of designs with what it costs.
type Choice = (Vec<u32>, Integer);

struct Checker<'c> {
    model: &'c Model,
    cost: Option<Integer>,
    potentials: Vec<Table<'c>>,
    needs: Vec<(usize, Table<'c>)>,
    labels: FxHashMap<&'c [u32], Vec<(&'c [Integer], &'c Integer)>>,
    monotone: bool,
    /// For each operator.
    choices: Vec<Rc<[Choice]>>,
}

impl Checker<'_> {
    fn induction(&self, argument: &Argument) -> Result<(), Fault> {
        // An empty clause: grounding has found that the goal never holds.
        if self.cost.is_none() && self.model.goal.clauses.iter().any(Vec::is_empty) {
            return Ok(());
        }
        if !self.is_covered(&self.model.initial(), &Integer::ZERO) {
            return Err(Fault::Initial);
        }
        let index = Index::new(self.model);
        for (label, position) in argument.labels.iter().zip(0..) {
            let state = self.model.state(&label.0, &label.1);
            let paid = &label.2;
            if self.model.holds(&self.model.goal, &state, &[], &[])
                && self.cost.as_ref().is_none_or(|cost| paid < cost)
            {
                return Err(Fault::Goal(position));
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

    /// Whether every plan that goes on from a state costs at least as much as is claimed, by a label or by a bound.
    fn is_covered(&self, state: &State, paid: &Integer) -> bool {
        let hopeless = self.potentials.iter().any(|potential| match (potential.at(state), &self.cost) {
            (None, _) => true,
            (Some(more), Some(cost)) => paid + more >= *cost,
            (Some(_), None) => false,
        });
        let exhausted = |(number, need): &(usize, Table<'_>)| {
            need.at(state).is_none_or(|need| !need.is_zero() && *need > state.numbers[*number])
        };
        if hopeless || self.needs.iter().any(exhausted) {
            return true;
        }
        let known = self.labels.get(&state.values[..self.model.basic]);
        known.into_iter().flatten().any(|(numbers, cost)| {
            let mut pairs = numbers.iter().zip(&state.numbers);
            *cost <= paid
                && if self.monotone { pairs.all(|(a, b)| a >= b) } else { pairs.all(|(a, b)| a == b) }
        })
    }
}

/// For each operator the combinations that no other one makes superfluous: one that costs no more, and with which every condition
/// holds as soon and every number ends as high (exactly so where more may hurt). What covers the successor by the
/// latter covers the successor by the former.
fn choices(model: &Model, monotone: bool) -> Result<Vec<Rc<[Choice]>>, Fault> {
    let mut known: FxHashMap<_, Rc<[Choice]>> = FxHashMap::default();
    let mut count = 0_usize;
    let mut comparisons = 0;
    let mut all = Vec::new();
    for operator in &model.operators {
        let quantities: Vec<_> = quantities(operator).collect();
        let key = (operator.uses, operator.exclusions, &operator.cost, quantities.clone());
        let own = if let Some(own) = known.get(&key) {
            Rc::clone(own)
        } else {
            let own = front(model, operator, &quantities, monotone, &mut comparisons)?;
            count = count.saturating_add(own.len());
            if count > CHOICE_LIMIT {
                let reason = format!("more than {CHOICE_LIMIT} combinations of designs matter");
                return Err(form("the task", reason));
            }
            known.insert(key, Rc::clone(&own));
            own
        };
        all.push(own);
    }
    Ok(all)
}

/// The combinations of an operator as [`choices`] has them; counts the comparisons.
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
    let all = model.choices(operator);
    let combinations = all.len();
    for choice in all {
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

/// What depends on designs in the conditions and changes of an operator.
fn quantities(operator: &Operator) -> impl Iterator<Item = &Quantity> {
    let changes = operator.changes.iter().map(|(_, value)| value);
    operator.condition.comparisons.iter().chain(changes).map(|linear| &linear.quantity)
}

/// Operators by a fact that they require.
struct Index {
    by_fact: FxHashMap<(u32, u32), Vec<usize>>,
    always: Vec<usize>,
}

impl Index {
    fn new(model: &Model) -> Self {
        let mut index = Self { by_fact: FxHashMap::default(), always: Vec::new() };
        for (operator, position) in model.operators.iter().zip(0..) {
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
