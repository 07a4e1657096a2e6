//! Delete relaxation \[1\] of a task: rules that derive facts from facts, at the cost of an operator.
//!
//! An operator becomes one rule for its unconditional effects and one rule for each conditional effect. All
//! these rules have the operator's minimum cost (0 if it is negative), which a relaxed plan pays only once.
//! Axioms and literals of clauses become rules without cost. Numeric conditions are ignored, and derived
//! variables may be false at any time. The relaxation therefore admits every plan of the task.
//!
//! \[1\] B. Bonet, H. Geffner: Planning as heuristic search, Artificial Intelligence 129, 2001.

use rustc_hash::FxHashMap;

use task::lists::Lists;
use task::number::{Int, dense};
use task::task::{Condition, Fact, Literal, Task};

/// Maximum operator cost, so that sums do not overflow.
const COST_LIMIT: Int = 1 << 40;
pub(super) const ALWAYS: u32 = 0;
pub(super) const GOAL: u32 = 1;

pub(super) struct DeleteRelaxation {
    /// Cost of each payer. The payer of a rule is its operator. The last payer has no cost and pays
    /// for rules without an operator.
    pub(super) costs: Vec<u64>,
    pub(super) payers: Vec<u32>,
    /// For each rule: the facts of its condition; never empty.
    pub(super) required: Lists,
    pub(super) given: Lists,
    pub(super) rules_of: Lists,
    pub(super) required_by: Lists,
    pub(super) given_by: Lists,
    first: Vec<u32>,
    basic: usize,
}

struct Builder<'a> {
    task: &'a Task,
    first: Vec<u32>,
    facts: u32,
    payers: Vec<u32>,
    required: Lists,
    given: Lists,
    clauses: FxHashMap<Vec<u32>, u32>,
    free: u32,
}

impl DeleteRelaxation {
    pub(super) fn new(task: &Task) -> Option<Self> {
        let costs = task.operators.iter().map(|operator| operator.cost.minimum().max(0));
        let costs = costs.map(|cost| u64::try_from(cost).ok().filter(|_| cost <= COST_LIMIT));
        let mut costs: Vec<u64> = costs.collect::<Option<_>>()?;
        costs.push(0);
        let mut builder = Builder::new(task);
        builder.rule(builder.free, &task.goal, &[], vec![GOAL]);
        for (operator, payer) in task.operators.iter().zip(0..) {
            let effects: Vec<u32> = operator.effects.iter().map(|fact| builder.fact(*fact)).collect();
            builder.rule(payer, &operator.condition, &[], effects);
            for effect in &operator.conditional {
                let given = effect.effects.iter().map(|fact| builder.fact(*fact)).collect();
                builder.rule(payer, &operator.condition, &effect.condition, given);
            }
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            let head = builder.fact(rule.head);
            builder.rule(builder.free, &rule.body, &[], vec![head]);
        }
        let Builder { first, facts, payers, required, given, .. } = builder;
        // All rules of an operator are updated together when its cost changes.
        let mut rules_by_payer: Vec<Vec<u32>> = vec![Vec::new(); costs.len()];
        for (payer, rule) in payers.iter().zip(0..) {
            rules_by_payer[*payer as usize].push(rule);
        }
        let mut rules_of = Lists::default();
        for rules in rules_by_payer {
            rules_of.push(&rules);
        }
        let (required_by, given_by) = (required.inverse(facts as usize), given.inverse(facts as usize));
        Some(Self {
            costs,
            payers,
            required,
            given,
            rules_of,
            required_by,
            given_by,
            first,
            basic: task.basic,
        })
    }

    pub(super) fn facts(&self) -> usize {
        self.required_by.count()
    }

    /// Returns the number of a fact of a basic variable.
    #[expect(clippy::arithmetic_side_effects, reason = "facts are numbered")]
    pub(super) fn fact(&self, fact: Fact) -> u32 {
        self.first[fact.variable.index()] + fact.value
    }

    /// Returns, for each fact, whether it is reachable from a state if the fact `excluded` never holds. Also
    /// returns the number of visited rules.
    pub(super) fn reachable_without(&self, values: &[u32], excluded: Option<u32>) -> (Vec<bool>, u64) {
        let mut reachable = vec![false; self.facts()];
        let mut unreached: Vec<u32> =
            (0..dense(self.payers.len())).map(|rule| dense(self.required.of(rule).len())).collect();
        let mut visits = unreached.len() as u64;
        let mut open: Vec<u32> = self.state(values).filter(|fact| Some(*fact) != excluded).collect();
        for fact in &open {
            reachable[*fact as usize] = true;
        }
        while let Some(fact) = open.pop() {
            for rule in self.required_by.of(fact) {
                visits = visits.saturating_add(1);
                let count = &mut unreached[*rule as usize];
                *count = count.saturating_sub(1);
                if *count > 0 {
                    continue;
                }
                for given in self.given.of(*rule) {
                    if Some(*given) != excluded && !std::mem::replace(&mut reachable[*given as usize], true) {
                        open.push(*given);
                    }
                }
            }
        }
        (reachable, visits)
    }

    /// Returns the facts that hold in a state, without derived variables, followed by `ALWAYS`.
    #[expect(clippy::arithmetic_side_effects, reason = "facts are numbered")]
    pub(super) fn state<'s>(&'s self, values: &'s [u32]) -> impl Iterator<Item = u32> + 's {
        let values = values[..self.basic].iter().zip(&self.first);
        values.map(|(value, first)| first + value).chain([ALWAYS])
    }
}

impl<'a> Builder<'a> {
    #[expect(clippy::arithmetic_side_effects, reason = "facts are held in memory")]
    fn new(task: &'a Task) -> Self {
        let mut facts = GOAL + 1;
        let first = task.variables.iter().map(|variable| {
            let first = facts;
            facts += dense(variable.values.len());
            first
        });
        let first = first.collect();
        let (payers, required, given) = (Vec::new(), Lists::default(), Lists::default());
        let free = dense(task.operators.len());
        Self { task, first, facts, payers, required, given, clauses: FxHashMap::default(), free }
    }

    /// Returns the number of a fact in the relaxation. A derived variable may be false at any time, so its
    /// falsity is `ALWAYS`.
    #[expect(clippy::arithmetic_side_effects, reason = "facts are numbered")]
    fn fact(&self, fact: Fact) -> u32 {
        let variable = fact.variable.index();
        if variable >= self.task.basic && fact.value != 0 {
            ALWAYS
        } else {
            self.first[variable] + fact.value
        }
    }

    fn literal(&self, literal: Literal) -> Vec<u32> {
        if literal.positive {
            return vec![self.fact(literal.fact)];
        }
        let values = 0..dense(self.task.variables[literal.fact.variable.index()].values.len());
        let values = values.filter(|value| *value != literal.fact.value);
        values.map(|value| self.fact(Fact { value, ..literal.fact })).collect()
    }

    /// Returns a fact that represents the disjunction of `facts`, if necessary a new artificial
    /// fact with a rule for each disjunct.
    #[expect(clippy::arithmetic_side_effects, reason = "facts are held in memory")]
    fn any(&mut self, mut facts: Vec<u32>) -> u32 {
        facts.sort_unstable();
        facts.dedup();
        if let [fact] = facts[..] {
            return fact;
        }
        if facts.contains(&ALWAYS) {
            return ALWAYS;
        }
        if let Some(fact) = self.clauses.get(&facts) {
            return *fact;
        }
        let fact = self.facts;
        self.facts += 1;
        for disjunct in &facts {
            self.add(self.free, vec![*disjunct], vec![fact]);
        }
        self.clauses.insert(facts, fact);
        fact
    }

    fn rule(&mut self, payer: u32, condition: &Condition, literals: &[Literal], given: Vec<u32>) {
        let mut required: Vec<u32> = condition.facts.iter().map(|fact| self.fact(*fact)).collect();
        for clause in &condition.clauses {
            let facts = clause.iter().flat_map(|literal| self.literal(*literal)).collect();
            required.push(self.any(facts));
        }
        for literal in literals {
            required.push(self.any(self.literal(*literal)));
        }
        self.add(payer, required, given);
    }

    fn add(&mut self, payer: u32, mut required: Vec<u32>, mut given: Vec<u32>) {
        required.sort_unstable();
        required.dedup();
        if required.len() > 1 {
            required.retain(|fact| *fact != ALWAYS);
        }
        if required.is_empty() {
            required.push(ALWAYS);
        }
        given.sort_unstable();
        given.dedup();
        given.retain(|fact| *fact != ALWAYS && required.binary_search(fact).is_err());
        if !given.is_empty() {
            self.payers.push(payer);
            self.required.push(&required);
            self.given.push(&given);
        }
    }
}
