//! Delete relaxation of the split task: rules from conditions to effects.
//!
//! Each start, end, instantaneous action and timed initial literal becomes a rule, as in the relaxed
//! planning graphs of CRIKEY \[1\]. A start adds the fact that its action runs, and the end requires
//! this fact, so required concurrency is visible. An end also requires the over-all condition. A numeric
//! condition needs enough applications of rules to reach its amount \[2\]; a condition on a
//! duration that the planner chooses always holds.
//!
//! \[1\] A. Coles, M. Fox, D. Long, A. Smith: Planning with problems requiring temporal
//! coordination, AAAI 2008.
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
use crate::concurrent::time_number::TimeNumber;

/// A numeric condition: a linear expression that must be at least 0, and its proposition.
#[derive(Debug, Clone)]
pub(super) struct Numeric {
    pub(super) linear: Linear<Int>,
    pub(super) proposition: Proposition,
}

pub(super) struct TemporalRelaxation {
    /// Proposition of the first value of each variable; the other values have the following
    /// numbers.
    pub(super) first: Vec<Proposition>,
    pub(super) propositions: usize,
    pub(super) needs: Lists,
    /// Propositions that must hold from the start of an action to the rule of its end (see [`Rule`]). Empty for
    /// other rules, and in the inadmissible relaxation.
    pub(super) over_all: Lists,
    /// Number of conditions of each rule.
    pub(super) unmet: Vec<u32>,
    pub(super) free: Vec<u32>,
    pub(super) adds: Lists,
    /// Numeric conditions whose linear expressions each rule may increase, with the amounts. An amount is `None`
    /// if it depends on the state or overflows.
    pub(super) raises: Vec<Box<[NumericEffect]>>,
    pub(super) weights: Vec<u32>,
    /// Operator from which each rule was made; `None` for the rules of clauses and derived facts.
    pub(super) origins: Vec<Option<OperatorId>>,
    pub(super) needing: Lists,
    pub(super) numeric: Vec<Numeric>,
    pub(super) goal: Vec<Proposition>,
    pub(super) ends: Vec<u32>,
    /// Propositions of the default values of derived variables, which hold from the beginning.
    pub(super) defaults: Vec<Proposition>,
    pub(super) conjunctions: Vec<Conjunction>,
}

struct RelaxationBuilder<'a> {
    task: &'a Task,
    is_admissible: bool,
    chosen: FxHashSet<NumericId>,
    first: Vec<Proposition>,
    propositions: u32,
    rules: Vec<Rule>,
    clauses: FxHashMap<Vec<Literal>, Proposition>,
    comparisons: FxHashMap<Linear<Int>, u32>,
    numeric: Vec<Numeric>,
}

impl TemporalRelaxation {
    /// Inadmissible relaxation that guides a search. It has conjunctions of facts, and over-all
    /// facts are conditions of starts.
    pub(super) fn new<T: TimeNumber>(concurrent: &TemporalTask<T>) -> Self {
        Self::build(concurrent, false)
    }

    /// Relaxation that admits every executable plan. It has no conjunctions, and over-all
    /// conditions are conditions of the ends only.
    pub(super) fn admissible<T: TimeNumber>(concurrent: &TemporalTask<T>) -> Self {
        Self::build(concurrent, true)
    }

    fn build<T: TimeNumber>(concurrent: &TemporalTask<T>, is_admissible: bool) -> Self {
        let task = &concurrent.task;
        let chosen = concurrent.instances.iter().filter(|instance| instance.is_chosen);
        let chosen = chosen.filter_map(|instance| instance.timer.map(|(number, _)| number)).collect();
        let mut builder = RelaxationBuilder::new(task, chosen, is_admissible);
        let mut ends = vec![0; concurrent.instances.len()];
        let ids = OperatorId::all(task.operators.len());
        for ((operator, happening), id) in task.operators.iter().zip(&concurrent.happenings).zip(ids) {
            let rule = builder.happening(concurrent, id, operator, happening.role);
            if let (Role::End(instance), Some(rule)) = (happening.role, rule) {
                ends[instance as usize] = rule;
            }
        }
        for rule in task.axioms.iter().flat_map(|layer| &layer.rules) {
            let needs = builder.needs(&rule.body);
            let adds = vec![builder.fact(rule.head)];
            builder.rules.push(Rule { needs, adds, ..Rule::default() });
        }
        let mut goal = builder.needs(&task.goal);
        builder.raise(task);
        let conjunctions = if is_admissible { Vec::new() } else { builder.conjoin(concurrent, &mut goal) };
        let derived = task.variables.iter().enumerate().skip(task.basic);
        let defaults = derived.map(|(index, variable)| builder.last(index, variable.values.len())).collect();
        let RelaxationBuilder { first, propositions, rules, numeric, .. } = builder;
        let (mut needs, mut over_all, mut adds) = (Lists::default(), Lists::default(), Lists::default());
        for rule in &rules {
            needs.push(&rule.needs);
            over_all.push(&rule.over_all);
            adds.push(&rule.adds);
        }
        let propositions = propositions as usize;
        Self {
            first,
            propositions,
            needing: needs.inverse(propositions),
            needs,
            over_all,
            unmet: rules.iter().map(|rule| dense(rule.needs.len())).collect(),
            free: (0..).zip(&rules).filter(|(_, rule)| rule.needs.is_empty()).map(|(id, _)| id).collect(),
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
    fn new(task: &'a Task, chosen: FxHashSet<NumericId>, is_admissible: bool) -> Self {
        let mut first = Vec::with_capacity(task.variables.len());
        let mut propositions = 0;
        for variable in &task.variables {
            first.push(propositions);
            propositions += dense(variable.values.len());
        }
        let (rules, numeric) = (Vec::new(), Vec::new());
        let (clauses, comparisons) = (FxHashMap::default(), FxHashMap::default());
        Self { task, is_admissible, chosen, first, propositions, rules, clauses, comparisons, numeric }
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

    /// Propositions of the facts, clauses and comparisons of a condition, ascending. Comparisons
    /// with chosen durations are omitted.
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

    fn clause(&mut self, literals: &[Literal]) -> Proposition {
        if let Some(clause) = self.clauses.get(literals) {
            return *clause;
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
        if let Some(index) = self.comparisons.get(linear) {
            return self.numeric[*index as usize].proposition;
        }
        let proposition = self.fresh();
        self.comparisons.insert(linear.clone(), dense(self.numeric.len()));
        self.numeric.push(Numeric { linear: linear.clone(), proposition });
        proposition
    }

    /// Returns the index of the rule without conditional effects; `None` for [`Role::Never`].
    fn happening<T: TimeNumber>(
        &mut self,
        concurrent: &TemporalTask<T>,
        id: OperatorId,
        operator: &Operator,
        role: Role,
    ) -> Option<u32> {
        let (mut needs, mut over_all_needs) = (self.needs(&operator.condition), Vec::new());
        let weight = match role {
            Role::Never => return None,
            Role::Timed(_) => 0,
            Role::Whole => 1,
            Role::Start(_) if self.is_admissible => 1,
            Role::Start(instance) => {
                // Facts of the `over all` condition must already hold before the start, unless the
                // start sets their variable. Otherwise only a simultaneous happening could add
                // these facts.
                let over_all = concurrent.instances[instance as usize].over_all;
                let required =
                    over_all.into_iter().flat_map(|id| &self.task.operators[id.index()].condition.facts);
                let sets =
                    |fact: &&Fact| operator.effects.iter().all(|effect| effect.variable != fact.variable);
                needs.extend(required.filter(sets).map(|fact| self.fact(*fact)));
                needs.sort_unstable();
                needs.dedup();
                1
            }
            Role::End(instance) => {
                let instance_data = &concurrent.instances[instance as usize];
                let over_all = instance_data.over_all;
                if self.is_admissible {
                    let condition = over_all.map(|id| &self.task.operators[id.index()].condition);
                    over_all_needs = condition.map(|condition| self.needs(condition)).unwrap_or_default();
                } else if let Some(over_all) = over_all {
                    needs.extend(self.needs(&self.task.operators[over_all.index()].condition));
                    needs.sort_unstable();
                    needs.dedup();
                }
                u32::from(!instance_data.compressible)
            }
        };
        let adds: Vec<_> = operator.effects.iter().map(|fact| self.fact(*fact)).collect();
        let rule = Rule {
            needs,
            over_all: over_all_needs,
            sets: adds.clone(),
            adds,
            raises: Vec::new(),
            weight,
            origin: Some(id),
        };
        let mut conditional = Vec::new();
        for effect in &operator.conditional {
            let effect_needs: Vec<_> =
                effect.condition.iter().map(|literal| self.clause(std::slice::from_ref(literal))).collect();
            let mut needs = [&rule.needs[..], &effect_needs].concat();
            needs.sort_unstable();
            needs.dedup();
            let adds: Vec<_> = effect.effects.iter().map(|fact| self.fact(*fact)).collect();
            let sets = [&rule.sets[..], &adds].concat();
            conditional.push(Rule { needs, adds, sets, ..rule.clone() });
        }
        let index = dense(self.rules.len());
        self.rules.push(rule);
        self.rules.extend(conditional);
        Some(index)
    }

    /// Adds a conjunction for each pair of facts selected by [`add_conjunctions`], and rewrites the
    /// rules and `goal` to use these conjunctions.
    fn conjoin<T: TimeNumber>(
        &mut self,
        concurrent: &TemporalTask<T>,
        goal: &mut Vec<Proposition>,
    ) -> Vec<Conjunction> {
        let ends =
            |first: Proposition, variable: &Variable| first.saturating_add(dense(variable.values.len()));
        let ranges = self
            .first
            .iter()
            .zip(&self.task.variables)
            .map(|(first, variable)| *first..ends(*first, variable));
        let mut variables: Vec<_> = ranges.take(self.task.basic).collect();
        // The task has no explicit effects that mark an instance as no longer running, so these
        // variables are excluded.
        for fact in concurrent.instances.iter().filter_map(|instance| instance.under_way) {
            variables[fact.variable.index()].start = variables[fact.variable.index()].end;
        }
        let Self { rules, propositions, .. } = self;
        add_conjunctions(&mut Scope { rules, goal, variables: &variables, propositions })
    }

    fn raise(&mut self, task: &Task) {
        let mut mentioning: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
        for (index, numeric) in (0..).zip(&self.numeric) {
            for (variable, _) in &numeric.linear.coefficients {
                mentioning.entry(variable.0).or_default().push(index);
            }
        }
        for rule in &mut self.rules {
            let Some(operator) = rule.origin.map(|id| &task.operators[id.index()]) else { continue };
            let variables = operator.numeric_effects.iter().map(|effect| effect.variable.0);
            let mut indices: Vec<u32> =
                variables.filter_map(|variable| mentioning.get(&variable)).flatten().copied().collect();
            indices.sort_unstable();
            indices.dedup();
            for index in indices {
                let by = difference(&self.numeric[index as usize].linear, operator);
                if by.is_none_or(|by| by > 0) {
                    rule.raises.push((index, by));
                }
            }
        }
    }
}

/// Amount that an operator adds to a linear expression. Returns `None` if the amount depends on the
/// state or overflows.
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
