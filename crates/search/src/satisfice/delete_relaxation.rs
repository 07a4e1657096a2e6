//! Delete relaxation of a ground task as nodes with conditions and effects.
//!
//! Propositions are facts, disjunctions and numeric comparisons. A node is an operator, a conditional effect, a
//! rule of a derived variable, or one way to make a disjunction true. A derived variable that is required to be
//! false counts as false. The best designs are selected for each purpose separately. The number of repetitions
//! until a comparison holds is estimated as by Scala et al. \[1\]; an operator that does not add a constant counts
//! as achieving it at once.
//!
//! \[1\] E. Scala, P. Haslum, S. Thiébaux: Heuristics for numeric planning via subgoaling, IJCAI 2016.

use rustc_hash::{FxHashMap, FxHashSet};

use task::limits::{Interrupted, Limits};
use task::lists::Lists;
use task::number::dense;
use task::task::number::{TaskNumber, sum_of_products};
use task::task::quantity::{Linear, NumericId, Quantity};
use task::task::{Condition, Fact, Literal, Operator, OperatorId, State, Task, VariableId};

/// Something that may hold: by number.
pub(super) type Proposition = u32;

/// A node that is not an operator's.
pub(super) const NO_OPERATOR: u32 = u32::MAX;

/// A sum of numeric variables, and what it has to come to.
pub(super) struct NumericCondition<N> {
    pub(super) sum: Vec<(NumericId, N)>,
    /// What the sum has to be at least, or above if it says so, and the proposition that it is.
    pub(super) thresholds: Vec<(N, bool, Proposition)>,
}

impl<N: TaskNumber> NumericCondition<N> {
    /// What the sum comes to; none if that does not fit.
    pub(super) fn value(&self, numbers: &[N]) -> Option<N> {
        let terms = self.sum.iter().map(|(variable, factor)| (factor, &numbers[variable.index()]));
        sum_of_products(N::zero(), terms)
    }
}

/// How an operator helps with a direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Achiever {
    pub(super) direction: u32,
    /// What it adds each time; infinite if once is enough.
    pub(super) gain: f64,
}

/// A task without its deletes.
pub(super) struct Relaxation<N> {
    /// The proposition of each variable's first value.
    first: Vec<Proposition>,
    pub(super) propositions: usize,
    /// What is taken to hold always.
    pub(super) always: Vec<Proposition>,
    pub(super) directions: Vec<NumericCondition<N>>,
    /// The operator of each node.
    pub(super) operators: Vec<u32>,
    pub(super) conditions: Lists,
    pub(super) effects: Lists,
    pub(super) supports: Vec<Vec<Achiever>>,
    /// For each proposition the nodes that have it as a condition.
    pub(super) waiting: Lists,
    /// Whether a node is an operator itself, and not one of its conditional effects.
    pub(super) is_base: Vec<bool>,
    /// Holds where the goal does.
    pub(super) goal: Proposition,
    /// What the goal requires.
    pub(super) goals: Vec<Proposition>,
}

impl<N: TaskNumber> Relaxation<N> {
    pub(super) fn new(task: &Task<N>, limits: &Limits) -> Result<Self, Interrupted> {
        Builder::new(task).build(limits)
    }

    pub(super) fn fact(&self, fact: Fact) -> Proposition {
        self.first[fact.variable.index()].saturating_add(fact.value)
    }

    /// The fact of a proposition; none if it is a disjunction or a comparison.
    pub(super) fn fact_of(&self, proposition: Proposition) -> Option<Fact> {
        if proposition >= *self.first.last()? {
            return None;
        }
        let variable = self.first.partition_point(|first| *first <= proposition).checked_sub(1)?;
        let value = proposition.checked_sub(self.first[variable])?;
        Some(Fact { variable: VariableId::of(variable), value })
    }

    /// The propositions of facts in a state.
    pub(super) fn facts<'s>(&'s self, values: &'s [u32]) -> impl Iterator<Item = Proposition> + 's {
        self.first.iter().zip(values).map(|(first, value)| first.saturating_add(*value))
    }
}

impl<N: TaskNumber> Relaxation<N> {
    /// Whether a proposition that is a fact or a comparison holds in a state.
    pub(super) fn holds(&self, proposition: Proposition, state: &State<N>) -> bool {
        if let Some(fact) = self.fact_of(proposition) {
            return fact.holds(&state.values);
        }
        let all = self.directions.iter().flat_map(|direction| {
            direction
                .thresholds
                .iter()
                .map(move |(threshold, strict, own)| (direction, threshold, *strict, *own))
        });
        all.filter(|(.., own)| *own == proposition).any(|(direction, threshold, strict, _)| {
            direction
                .value(&state.numbers)
                .is_some_and(|value| if strict { value > *threshold } else { value >= *threshold })
        })
    }
}

struct Builder<'a, N> {
    task: &'a Task<N>,
    first: Vec<Proposition>,
    next: Proposition,
    always: Vec<Proposition>,
    is_always: FxHashSet<Proposition>,
    directions: Vec<NumericCondition<N>>,
    by_sum: FxHashMap<Vec<(NumericId, N)>, usize>,
    by_threshold: FxHashMap<(usize, N, bool), Proposition>,
    disjunctions: FxHashMap<Vec<Literal>, Proposition>,
    operators: Vec<u32>,
    is_base: Vec<bool>,
    conditions: Lists,
    effects: Lists,
}

impl<'a, N: TaskNumber> Builder<'a, N> {
    fn new(task: &'a Task<N>) -> Self {
        let mut first = Vec::with_capacity(task.variables.len().saturating_add(1));
        let mut next: Proposition = 0;
        for variable in &task.variables {
            first.push(next);
            next = next.saturating_add(dense(variable.values.len()));
        }
        first.push(next);
        Self {
            task,
            first,
            next,
            always: Vec::new(),
            is_always: FxHashSet::default(),
            directions: Vec::new(),
            by_sum: FxHashMap::default(),
            by_threshold: FxHashMap::default(),
            disjunctions: FxHashMap::default(),
            operators: Vec::new(),
            is_base: Vec::new(),
            conditions: Lists::default(),
            effects: Lists::default(),
        }
    }

    fn build(mut self, limits: &Limits) -> Result<Relaxation<N>, Interrupted> {
        let task = self.task;
        for (variable, id) in
            task.variables.iter().zip(VariableId::all(task.variables.len())).skip(task.basic)
        {
            for value in 1..dense(variable.values.len()) {
                let proposition = self.fact(Fact { variable: id, value });
                self.holds_always(proposition);
            }
        }
        let goals = self.condition(&task.goal);
        let goal = self.fresh();
        self.node(NO_OPERATOR, false, &goals, &[goal]);
        for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
            let (operator, id) = item?;
            let conditions = self.condition(&operator.condition);
            let effects: Vec<Proposition> = operator.effects.iter().map(|fact| self.fact(*fact)).collect();
            self.node(id.0, true, &conditions, &effects);
            for effect in &operator.conditional {
                let mut conditions = conditions.clone();
                for literal in &effect.condition {
                    conditions.extend(self.literal(*literal));
                }
                let effects: Vec<Proposition> = effect.effects.iter().map(|fact| self.fact(*fact)).collect();
                self.node(id.0, false, &conditions, &effects);
            }
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            let conditions = self.condition(&rule.body);
            let head = self.fact(rule.head);
            self.node(NO_OPERATOR, false, &conditions, &[head]);
        }
        let supports = self.supports(limits)?;
        let propositions = self.next as usize;
        let waiting = self.conditions.inverse(propositions);
        Ok(Relaxation {
            first: self.first,
            propositions,
            always: self.always,
            directions: self.directions,
            operators: self.operators,
            conditions: self.conditions,
            effects: self.effects,
            supports,
            waiting,
            is_base: self.is_base,
            goal,
            goals,
        })
    }

    fn fresh(&mut self) -> Proposition {
        let own = self.next;
        self.next = self.next.saturating_add(1);
        own
    }

    fn holds_always(&mut self, proposition: Proposition) {
        self.always.push(proposition);
        self.is_always.insert(proposition);
    }

    fn node(&mut self, operator: u32, is_base: bool, conditions: &[Proposition], effects: &[Proposition]) {
        let mut conditions: Vec<Proposition> =
            conditions.iter().copied().filter(|own| !self.is_always.contains(own)).collect();
        conditions.sort_unstable();
        conditions.dedup();
        self.operators.push(operator);
        self.is_base.push(is_base);
        self.conditions.push(&conditions);
        self.effects.push(effects);
    }

    fn fact(&self, fact: Fact) -> Proposition {
        self.first[fact.variable.index()].saturating_add(fact.value)
    }

    fn condition(&mut self, condition: &Condition<N>) -> Vec<Proposition> {
        let mut all: Vec<Proposition> = condition.facts.iter().map(|fact| self.fact(*fact)).collect();
        for clause in &condition.clauses {
            all.extend(self.clause(clause));
        }
        for (linears, strict) in [(&condition.comparisons, false), (&condition.above, true)] {
            for linear in linears {
                all.extend(self.comparison(linear, strict));
            }
        }
        all
    }

    /// The proposition of a comparison at its best; none if it always holds.
    fn comparison(&mut self, linear: &Linear<N>, strict: bool) -> Option<Proposition> {
        let threshold = negated(maximum(&linear.quantity));
        if linear.coefficients.is_empty() {
            let holds = if strict { threshold < N::zero() } else { threshold <= N::zero() };
            if holds {
                return None;
            }
        }
        let direction = *self.by_sum.entry(linear.coefficients.clone()).or_insert_with(|| {
            let sum = linear.coefficients.clone();
            self.directions.push(NumericCondition { sum, thresholds: Vec::new() });
            self.directions.len().saturating_sub(1)
        });
        let key = (direction, threshold, strict);
        if let Some(known) = self.by_threshold.get(&key) {
            return Some(*known);
        }
        let own = self.fresh();
        self.directions[direction].thresholds.push((key.1.clone(), strict, own));
        self.by_threshold.insert(key, own);
        Some(own)
    }

    fn clause(&mut self, clause: &[Literal]) -> Option<Proposition> {
        if let [only] = clause {
            return self.literal(*only);
        }
        let mut parts = Vec::with_capacity(clause.len());
        for literal in clause {
            parts.push(self.literal(*literal)?);
        }
        let mut key = clause.to_vec();
        key.sort_unstable();
        if let Some(known) = self.disjunctions.get(&key) {
            return Some(*known);
        }
        let own = self.fresh();
        self.disjunctions.insert(key, own);
        for part in parts {
            self.node(NO_OPERATOR, false, &[part], &[own]);
        }
        Some(own)
    }

    /// The proposition of a literal; none if it is taken to hold always.
    fn literal(&mut self, literal: Literal) -> Option<Proposition> {
        let Literal { fact, positive } = literal;
        let own = self.fact(fact);
        if positive {
            return (!self.is_always.contains(&own)).then_some(own);
        }
        let values = dense(self.task.variables[fact.variable.index()].values.len());
        if fact.variable.index() >= self.task.basic {
            // A derived variable has the other value, which is true, if its rules say so.
            return (fact.value != 0).then(|| self.fact(Fact { value: 0, ..fact }));
        }
        if values == 2 {
            return Some(self.fact(Fact { value: 1_u32.saturating_sub(fact.value), ..fact }));
        }
        let key = vec![literal];
        if let Some(known) = self.disjunctions.get(&key) {
            return Some(*known);
        }
        let own = self.fresh();
        self.disjunctions.insert(key, own);
        for value in (0..values).filter(|value| *value != fact.value) {
            let other = self.fact(Fact { value, ..fact });
            self.node(NO_OPERATOR, false, &[other], &[own]);
        }
        Some(own)
    }

    /// How the base node of each operator helps with numbers.
    fn supports(&self, limits: &Limits) -> Result<Vec<Vec<Achiever>>, Interrupted> {
        let mut of: FxHashMap<NumericId, Vec<usize>> = FxHashMap::default();
        for (index, direction) in self.directions.iter().enumerate() {
            for (variable, _) in &direction.sum {
                of.entry(*variable).or_default().push(index);
            }
        }
        let mut supports = vec![Vec::new(); self.operators.len()];
        let nodes = self.operators.iter().zip(&self.is_base).zip(&mut supports);
        for item in limits.watch(nodes) {
            let ((operator, is_base), own) = item?;
            if !*is_base {
                continue;
            }
            let operator = &self.task.operators[*operator as usize];
            let changed = operator.numeric_effects.iter().filter_map(|effect| of.get(&effect.variable));
            let mut touched: Vec<usize> = changed.flatten().copied().collect();
            touched.sort_unstable();
            touched.dedup();
            for index in touched {
                if let Some(gain) = gain(operator, &self.directions[index].sum) {
                    own.push(Achiever { direction: dense(index), gain });
                }
            }
        }
        Ok(supports)
    }
}

/// What an operator adds to a sum at its best; none if it adds nothing, infinite if that is not a constant or does not fit. Whether it is
/// above 0 is decided exactly: what nothing adds to is out of reach.
fn gain<N: TaskNumber>(operator: &Operator<N>, sum: &[(NumericId, N)]) -> Option<f64> {
    let mut gain = N::zero();
    for (variable, factor) in sum {
        let Some(effect) = operator.numeric_effects.iter().find(|effect| effect.variable == *variable) else {
            continue;
        };
        let quantity = &effect.value.quantity;
        let amount = match &effect.value.coefficients[..] {
            [(own, one)] if own == variable && one.is_one() => {
                if *factor < N::zero() {
                    quantity.minimum()
                } else {
                    maximum(quantity)
                }
            }
            _ => return Some(f64::INFINITY),
        };
        let Some(next) = factor.times(&amount).and_then(|more| gain.plus(&more)) else {
            return Some(f64::INFINITY);
        };
        gain = next;
    }
    // What is above 0 may be too little for a double.
    (gain > N::zero()).then(|| gain.approximate().max(f64::MIN_POSITIVE))
}

#[expect(clippy::arithmetic_side_effects, reason = "numbers of a task are far from the least integer")]
fn negated<N: TaskNumber>(number: N) -> N {
    -number
}

/// An upper bound on what designs contribute, as `Quantity::minimum` is a lower one.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "where they are machine integers, the numbers of a quantity fit together (TaskNumber::fits), whatever their signs"
)]
fn maximum<N: TaskNumber>(quantity: &Quantity<N>) -> N {
    let most = quantity.tables.iter().filter_map(|table| table.values.iter().max());
    most.fold(quantity.constant.clone(), |sum, value| sum + value.clone())
}
