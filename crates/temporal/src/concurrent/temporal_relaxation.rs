//! Delete relaxation of the split task: rules from conditions to effects.
//!
//! Each start, end and instantaneous action becomes a rule, as in the relaxed planning graphs of CRIKEY \[1\]. That
//! an instance runs is a fact that its start adds and its end requires, so required concurrency is visible. An
//! end requires the condition over all as well. A numeric condition needs as many applications of a rule as its
//! amount \[2\]; a condition on a duration that the planner chooses always holds.
//!
//! \[1\] A. Coles, M. Fox, D. Long, A. Smith: Planning with problems requiring temporal coordination, AAAI 2008.
//! \[2\] E. Scala, P. Haslum, S. Thiébaux: Heuristics for numeric planning via subgoaling, IJCAI 2016.

use rustc_hash::{FxHashMap, FxHashSet};
use task::lists::Lists;
use task::number::{Int, dense};
use task::task::quantity::{Linear, NumericId};
use task::task::{Condition, Fact, Literal, Operator, OperatorId, Task, Variable};

use crate::concurrent::conjunctions::{Conjunction, Scope, add_conjunctions};
use crate::concurrent::happening::Role;
use crate::concurrent::rule::{NumericEffect, Proposition, Rule};
use crate::concurrent::temporal_task::TemporalTask;

/// A linear expression that must be at least 0.
#[derive(Debug, Clone)]
pub(super) struct Numeric {
    pub(super) linear: Linear<Int>,
    pub(super) proposition: Proposition,
}

/// A relaxed task; rules are numbered.
pub(super) struct TemporalRelaxation {
    /// The proposition of each variable's first value.
    pub(super) first: Vec<Proposition>,
    pub(super) propositions: usize,
    /// What each rule needs, ascending.
    pub(super) needs: Lists,
    /// How much that is.
    pub(super) unmet: Vec<u32>,
    /// The rules that need nothing.
    pub(super) free: Vec<u32>,
    pub(super) adds: Lists,
    /// The numeric conditions that each rule raises.
    pub(super) raises: Vec<Box<[NumericEffect]>>,
    /// What each rule counts in a relaxed plan.
    pub(super) weights: Vec<u32>,
    /// The happening of each rule; none for clauses and derived facts.
    pub(super) origins: Vec<Option<OperatorId>>,
    /// The rules that need each proposition.
    pub(super) needing: Lists,
    pub(super) numeric: Vec<Numeric>,
    /// Ascending.
    pub(super) goal: Vec<Proposition>,
    /// By instance the rule of its end.
    pub(super) ends: Vec<u32>,
    /// The values that derived variables have unless a rule gives them another one.
    pub(super) defaults: Vec<Proposition>,
    pub(super) conjunctions: Vec<Conjunction>,
}

/// Collects rules.
struct RelaxationBuilder<'a> {
    task: &'a Task,
    /// The numbers that the planner chooses.
    chosen: FxHashSet<NumericId>,
    first: Vec<Proposition>,
    propositions: u32,
    rules: Vec<Rule>,
    clauses: FxHashMap<Vec<Literal>, Proposition>,
    comparisons: FxHashMap<Linear<Int>, u32>,
    numeric: Vec<Numeric>,
}

impl TemporalRelaxation {
    pub(super) fn new(concurrent: &TemporalTask) -> Self {
        let task = &concurrent.task;
        let chosen = concurrent.instances.iter().filter(|own| own.is_chosen);
        let chosen = chosen.filter_map(|own| own.timer.map(|(number, _)| number)).collect();
        let mut maker = RelaxationBuilder::new(task, chosen);
        let mut ends = vec![0; concurrent.instances.len()];
        let ids = OperatorId::all(task.operators.len());
        for ((operator, happening), id) in task.operators.iter().zip(&concurrent.happenings).zip(ids) {
            if let Role::End(instance) = happening.role {
                ends[instance as usize] = dense(maker.rules.len());
            }
            maker.happening(concurrent, id, operator, happening.role);
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            let needs = maker.needs(&rule.body);
            let adds = vec![maker.fact(rule.head)];
            maker.rules.push(Rule { needs, adds, ..Rule::default() });
        }
        let mut goal = maker.needs(&task.goal);
        maker.raise(task);
        let conjunctions = maker.conjoin(concurrent, &mut goal);
        let derived = task.variables.iter().enumerate().skip(task.basic);
        let defaults = derived.map(|(variable, own)| maker.last(variable, own.values.len())).collect();
        let RelaxationBuilder { first, propositions, rules, numeric, .. } = maker;
        let (mut needs, mut adds) = (Lists::default(), Lists::default());
        for rule in &rules {
            needs.push(&rule.needs);
            adds.push(&rule.adds);
        }
        let propositions = propositions as usize;
        Self {
            first,
            propositions,
            needing: needs.inverse(propositions),
            needs,
            unmet: rules.iter().map(|rule| dense(rule.needs.len())).collect(),
            free: (0..).zip(&rules).filter(|(_, rule)| rule.needs.is_empty()).map(|(own, _)| own).collect(),
            adds,
            weights: rules.iter().map(|rule| rule.weight).collect(),
            origins: rules.iter().map(|rule| rule.origin).collect(),
            raises: rules.into_iter().map(|rule| rule.raises.into_boxed_slice()).collect(),
            numeric,
            goal,
            ends,
            defaults,
            conjunctions,
        }
    }
}

impl<'a> RelaxationBuilder<'a> {
    #[expect(clippy::arithmetic_side_effects, reason = "values of variables are held in memory")]
    fn new(task: &'a Task, chosen: FxHashSet<NumericId>) -> Self {
        let mut first = Vec::with_capacity(task.variables.len());
        let mut propositions = 0;
        for variable in &task.variables {
            first.push(propositions);
            propositions += dense(variable.values.len());
        }
        let (rules, numeric) = (Vec::new(), Vec::new());
        let (clauses, comparisons) = (FxHashMap::default(), FxHashMap::default());
        Self { task, chosen, first, propositions, rules, clauses, comparisons, numeric }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "values of variables are held in memory")]
    fn fact(&self, fact: Fact) -> Proposition {
        self.first[fact.variable.index()] + fact.value
    }

    #[expect(clippy::arithmetic_side_effects, reason = "every variable has a value")]
    fn last(&self, variable: usize, values: usize) -> Proposition {
        self.first[variable] + dense(values) - 1
    }

    #[expect(clippy::arithmetic_side_effects, reason = "propositions are held in memory")]
    fn fresh(&mut self) -> Proposition {
        self.propositions += 1;
        self.propositions - 1
    }

    fn needs(&mut self, condition: &Condition) -> Vec<Proposition> {
        let mut needs: Vec<_> = condition.facts.iter().map(|fact| self.fact(*fact)).collect();
        for clause in &condition.clauses {
            needs.push(self.clause(clause));
        }
        for linear in condition.linears() {
            let mut mentioned = linear.coefficients.iter().map(|(number, _)| number);
            if !mentioned.any(|number| self.chosen.contains(number)) {
                needs.push(self.comparison(linear));
            }
        }
        needs.sort_unstable();
        needs.dedup();
        needs
    }

    /// A proposition that any of some literals brings about.
    fn clause(&mut self, literals: &[Literal]) -> Proposition {
        if let Some(known) = self.clauses.get(literals) {
            return *known;
        }
        let clause = self.fresh();
        for literal in literals {
            let values = 0..dense(self.task.variables[literal.fact.variable.index()].values.len());
            for value in values.filter(|value| (*value == literal.fact.value) == literal.positive) {
                let need = self.fact(Fact { value, ..literal.fact });
                self.rules.push(Rule { needs: vec![need], adds: vec![clause], ..Rule::default() });
            }
        }
        self.clauses.insert(literals.to_vec(), clause);
        clause
    }

    fn comparison(&mut self, linear: &Linear<Int>) -> Proposition {
        if let Some(known) = self.comparisons.get(linear) {
            return self.numeric[*known as usize].proposition;
        }
        let proposition = self.fresh();
        self.comparisons.insert(linear.clone(), dense(self.numeric.len()));
        self.numeric.push(Numeric { linear: linear.clone(), proposition });
        proposition
    }

    fn happening(&mut self, concurrent: &TemporalTask, id: OperatorId, operator: &Operator, role: Role) {
        let mut needs = self.needs(&operator.condition);
        let weight = match role {
            Role::Never => return,
            Role::Timed(_) => 0,
            Role::Whole => 1,
            Role::Start(instance) => {
                // What the start does not bring about itself has to hold before; only other happenings at the same time could help.
                let over_all = concurrent.instances[instance as usize].over_all;
                let required =
                    over_all.into_iter().flat_map(|id| &self.task.operators[id.index()].condition.facts);
                let sets = |fact: &&Fact| operator.effects.iter().all(|own| own.variable != fact.variable);
                needs.extend(required.filter(sets).map(|fact| self.fact(*fact)));
                needs.sort_unstable();
                needs.dedup();
                1
            }
            Role::End(instance) => {
                let own = &concurrent.instances[instance as usize];
                if let Some(over_all) = own.over_all {
                    needs.extend(self.needs(&self.task.operators[over_all.index()].condition));
                    needs.sort_unstable();
                    needs.dedup();
                }
                u32::from(!own.compressible)
            }
        };
        let adds: Vec<_> = operator.effects.iter().map(|fact| self.fact(*fact)).collect();
        let rule = Rule { needs, sets: adds.clone(), adds, raises: Vec::new(), weight, origin: Some(id) };
        let mut conditional = Vec::new();
        for effect in &operator.conditional {
            let own: Vec<_> =
                effect.condition.iter().map(|literal| self.clause(std::slice::from_ref(literal))).collect();
            let mut needs = [&rule.needs[..], &own].concat();
            needs.sort_unstable();
            needs.dedup();
            let adds: Vec<_> = effect.effects.iter().map(|fact| self.fact(*fact)).collect();
            let sets = [&rule.sets[..], &adds].concat();
            conditional.push(Rule { needs, adds, sets, ..rule.clone() });
        }
        self.rules.push(rule);
        self.rules.extend(conditional);
    }

    /// Adds conjunctions of facts that nothing brings back.
    fn conjoin(&mut self, concurrent: &TemporalTask, goal: &mut Vec<Proposition>) -> Vec<Conjunction> {
        let ends = |first: Proposition, own: &Variable| first.saturating_add(dense(own.values.len()));
        let all = self.first.iter().zip(&self.task.variables).map(|(first, own)| *first..ends(*first, own));
        let mut variables: Vec<_> = all.take(self.task.basic).collect();
        // That nothing is under way any more is not among the effects.
        for fact in concurrent.instances.iter().filter_map(|own| own.under_way) {
            variables[fact.variable.index()].start = variables[fact.variable.index()].end;
        }
        let Self { rules, propositions, .. } = self;
        add_conjunctions(&mut Scope { rules, goal, variables: &variables, propositions })
    }

    /// Notes which rules raise which numeric conditions.
    fn raise(&mut self, task: &Task) {
        let mut mentioning: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
        for (index, numeric) in (0..).zip(&self.numeric) {
            for (variable, _) in &numeric.linear.coefficients {
                mentioning.entry(variable.0).or_default().push(index);
            }
        }
        for rule in &mut self.rules {
            let Some(operator) = rule.origin.map(|id| &task.operators[id.index()]) else { continue };
            let changed = operator.numeric_effects.iter().map(|effect| effect.variable.0);
            let mut mentioned: Vec<u32> =
                changed.filter_map(|variable| mentioning.get(&variable)).flatten().copied().collect();
            mentioned.sort_unstable();
            mentioned.dedup();
            for index in mentioned {
                let by = difference(&self.numeric[index as usize].linear, operator);
                if by.is_none_or(|by| by > 0) {
                    rule.raises.push((index, by));
                }
            }
        }
    }
}

/// How much an operator adds to a linear expression; none if that depends on the state.
fn difference(linear: &Linear<Int>, operator: &Operator) -> Option<Int> {
    let mut sum: Int = 0;
    for effect in &operator.numeric_effects {
        let factor = linear.coefficients.iter().find(|(variable, _)| *variable == effect.variable);
        let Some((_, factor)) = factor else { continue };
        if effect.value.coefficients != [(effect.variable, 1)] || !effect.value.quantity.tables.is_empty() {
            return None;
        }
        sum = sum.checked_add(factor.checked_mul(effect.value.quantity.constant)?)?;
    }
    Some(sum)
}
