//! Clauses that exclude interference between operators of the same step.
//!
//! In ∀-step semantics \[1\] the operators of a step can be executed in any order with the same result. In
//! ∃-step semantics \[2\] they can be executed in at least one order; here this is the order of the ground
//! task. In both semantics, all conditions hold before the step and all effects hold after the step.
//!
//! `o@t` means that operator o is executed at step t. The clauses are added for pairs (R, E) of sets of
//! operators:
//! - for each fact: R has the fact as a condition, and E sets its variable to another value (operators that
//!   require another value of the variable are omitted, because they cannot share a step with R);
//! - for each variable that is also read otherwise: R reads it in a clause, by a conditional effect or through
//!   a derived variable, and E sets it.
//!
//! The clauses are:
//! - ∃-step: `¬o@t ∨ ¬p@t` for o ∈ E before p ∈ R in the order. A ladder of auxiliary variables a ("an earlier
//!   operator has changed the fact", one for each further operator of E) encodes this with few clauses:
//!   `o@t → a@t`, `a@t → a'@t` for the next variable a', and `a@t → ¬p@t`;
//! - ∀-step: these clauses, and again in the reverse order;
//! - exclusion, in both semantics: at most one operator of each of these groups, so that numbers, designs and
//!   costs are encoded as in sequential semantics:
//!   - the operators with the same slot (design parameter), or that read or change the same numeric variable;
//!   - the operators with a comparison without numeric variables, which can depend on their designs;
//!   - the operators that change the abstract state of the projection with which costs are reduced (by the
//!     differences of its goal distances).
//!
//! Every sequential plan is also a plan in these semantics, so bounds on the length of sequential
//! plans remain valid.
//!
//! \[1\] H. Kautz, B. Selman: Pushing the envelope: planning, propositional logic and stochastic
//! search, AAAI 1996.
//! \[2\] J. Rintanen, K. Heljanko, I. Niemelä: Planning as satisfiability: parallel plans and
//! algorithms for plan search, Artificial Intelligence 170(12-13), 2006.

use rustc_hash::FxHashSet;
use search::bounds::Projection;
use std::collections::BTreeMap;
use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::task::{Condition, OperatorId, VariableId};
use task::words;

use crate::encode::builder::Builder;
use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::sat::Lit;

/// Number of operators at one step, and the order in which they must be executable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StepSemantics {
    /// At most one operator per step.
    Sequential,
    /// Several operators per step, which can be executed in any order with the same result.
    ForAllStep,
    /// Several operators per step, which can be executed in the order of the ground task.
    ExistsStep,
}

words! {
    StepSemantics, "semantics": Sequential = "sequential", ForAllStep = "for-all-step", ExistsStep = "exists-step"
}

pub(super) struct Interference {
    /// `true` if conflicts apply in the reverse order as well (∀-step semantics).
    both_orders: bool,
    /// Exclusion groups, i.e. groups of operators of which at most one may occur at a step.
    exclusions: Vec<Vec<OperatorId>>,
    conflicts: Vec<Conflict>,
    classes: Vec<Option<usize>>,
}

/// Operators that change a fact or variable, and operators that need it unchanged, both in
/// ascending order.
struct Conflict {
    erase: Vec<OperatorId>,
    need: Vec<OperatorId>,
}

#[derive(Default)]
struct Uses {
    /// Operators whose condition contains a fact about the variable, by required value.
    require: BTreeMap<u32, Vec<OperatorId>>,
    /// Operators that read the variable in a clause, in the condition of a conditional effect, or through a derived
    /// variable.
    read: Vec<OperatorId>,
    write: Vec<(OperatorId, u32)>,
}

impl Interference {
    /// Computes the interference relation of a task. Returns `None` in sequential semantics.
    /// `potential` is the projection by which costs are reduced.
    pub(super) fn new(
        context: Context<'_>,
        semantics: StepSemantics,
        potential: Option<&Projection>,
    ) -> Result<Option<Self>, Interrupted> {
        let Context { task, limits } = context;
        if semantics == StepSemantics::Sequential {
            return Ok(None);
        }
        let support = Support::new(context)?;
        let mut variables: Vec<Uses> = (0..task.basic).map(|_| Uses::default()).collect();
        let mut slots = vec![Vec::new(); task.slots.len()];
        let mut numbers = vec![Vec::new(); task.initial.numbers.len()];
        let (mut constant, mut changers) = (Vec::new(), Vec::new());
        for item in limits.watch(task.operators.iter().zip(OperatorId::all(task.operators.len()))) {
            let (operator, id) = item?;
            for usage in operator.slots.iter() {
                slots[usage.slot.index()].push(id);
            }
            let mut numbers_used = support.numbers_of(&operator.condition);
            let mut read = support.read_by(&operator.condition);
            for effect in &operator.conditional {
                let condition = Condition { clauses: vec![effect.condition.clone()], ..Condition::default() };
                numbers_used.extend(support.numbers_of(&condition));
                read.extend(support.read_by(&condition));
            }
            for effect in &operator.numeric_effects {
                numbers_used.push(effect.variable.index());
                numbers_used.extend(effect.value.coefficients.iter().map(|(variable, _)| variable.index()));
            }
            for number in sorted(&mut numbers_used) {
                numbers[*number].push(id);
            }
            for variable in sorted(&mut read) {
                variables[*variable].read.push(id);
            }
            for fact in operator.condition.facts.iter().filter(|fact| fact.variable.index() < task.basic) {
                variables[fact.variable.index()].require.entry(fact.value).or_default().push(id);
            }
            let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
            for effect in operator.effects.iter().chain(conditional) {
                variables[effect.variable.index()].write.push((id, effect.value));
            }
            if operator.condition.comparisons.iter().any(|comparison| comparison.coefficients.is_empty()) {
                constant.push(id);
            }
            let moves = potential.is_some_and(|p| p.transitions(id).iter().any(|t| t.source != t.target));
            changers.extend(moves.then_some(id));
        }
        let groups = std::iter::once(changers).chain(slots).chain(numbers).chain([constant]);
        let exclusions: Vec<_> = groups.filter(|group| group.len() > 1).collect();
        let mut classes = vec![None; task.operators.len()];
        for (group, position) in exclusions.iter().zip(0..) {
            for id in group {
                classes[id.index()].get_or_insert(position);
            }
        }
        let mut conflicts = Vec::new();
        for uses in &variables {
            uses.conflicts(&mut conflicts, limits)?;
        }
        Ok(Some(Self { both_orders: semantics == StepSemantics::ForAllStep, exclusions, conflicts, classes }))
    }

    /// Returns the index of the first exclusion group (operators of which at most one occurs at a step) that contains
    /// an operator, or `None` if no group does. Operators with the same index never share a step.
    pub(super) fn class(&self, operator: OperatorId) -> Option<usize> {
        self.classes[operator.index()]
    }

    pub(super) fn add(&self, builder: &mut Builder<'_>, step: usize) -> Result<(), Interrupted> {
        for group in &self.exclusions {
            let literals: Vec<_> =
                group.iter().filter_map(|id| builder.variables.operator(step, *id)).collect();
            builder.formula.at_most_one(Family::Interference, &literals);
        }
        for conflict in builder.limits.watch(&self.conflicts) {
            let conflict = conflict?;
            let mut users: BTreeMap<OperatorId, (bool, bool)> = BTreeMap::new();
            for id in &conflict.erase {
                users.entry(*id).or_default().0 = true;
            }
            for id in &conflict.need {
                users.entry(*id).or_default().1 = true;
            }
            let present = |(id, uses): (&OperatorId, &(bool, bool))| {
                Some((builder.variables.operator(step, *id)?, *uses))
            };
            let mut chain: Vec<_> = users.iter().filter_map(present).collect();
            ladder(&mut builder.formula, &chain);
            // In ∀-step semantics, every order must be executable. The conflicts therefore apply in the reverse order, too.
            if self.both_orders {
                chain.reverse();
                ladder(&mut builder.formula, &chain);
            }
        }
        Ok(())
    }
}

impl Uses {
    fn conflicts(&self, out: &mut Vec<Conflict>, limits: &Limits) -> Result<(), Interrupted> {
        let mut conflicts = Vec::new();
        let required: BTreeMap<OperatorId, u32> =
            self.require.iter().flat_map(|(value, all)| all.iter().map(|id| (*id, *value))).collect();
        let mut writers: BTreeMap<Option<u32>, Vec<(OperatorId, u32)>> = BTreeMap::new();
        for (id, set) in &self.write {
            writers.entry(required.get(id).copied()).or_default().push((*id, *set));
        }
        for item in limits.watch(&self.require) {
            let (value, need) = item?;
            // Operators that require another value of the variable cannot occur at the same step
            // anyway.
            let possible = [None, Some(*value)].into_iter().filter_map(|required| writers.get(&required));
            let erase = possible.flatten().filter(|(_, set)| set != value);
            let mut erase: Vec<_> = erase.map(|(id, _)| *id).collect();
            erase.sort_unstable();
            erase.dedup();
            conflicts.push(Conflict { erase, need: need.clone() });
        }
        let mut erase: Vec<_> = self.write.iter().map(|(id, _)| *id).collect();
        erase.dedup();
        conflicts.push(Conflict { erase, need: self.read.clone() });
        conflicts.retain(|conflict| !conflict.erase.is_empty() && !conflict.need.is_empty());
        out.append(&mut conflicts);
        Ok(())
    }
}

struct Support {
    basic: usize,
    /// For each derived variable: basic variables and numeric variables on which it depends.
    of: Vec<(Vec<usize>, Vec<usize>)>,
}

impl Support {
    /// Computes the support layer by layer. The variables of one layer depend on each other, so they have the same
    /// support.
    #[expect(clippy::arithmetic_side_effects, reason = "basic variables come first; rules are of the others")]
    fn new(context: Context<'_>) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let derived = task.variables.len() - task.basic;
        let mut support = Self { basic: task.basic, of: vec![(Vec::new(), Vec::new()); derived] };
        for layer in limits.watch(&task.axioms) {
            let layer = layer?;
            let (mut heads, mut read) = (FxHashSet::default(), FxHashSet::default());
            let mut numbers = FxHashSet::default();
            for rule in limits.watch(&layer.rules) {
                let rule = rule?;
                heads.insert(rule.head.variable.index() - task.basic);
                read.extend(support.read_by(&rule.body));
                read.extend(rule.body.facts.iter().filter_map(|fact| support.if_basic(fact.variable)));
                numbers.extend(support.numbers_of(&rule.body));
            }
            let mut read: Vec<_> = read.into_iter().collect();
            let mut numbers: Vec<_> = numbers.into_iter().collect();
            sorted(&mut read);
            sorted(&mut numbers);
            for head in heads {
                support.of[head] = (read.clone(), numbers.clone());
            }
        }
        Ok(support)
    }

    fn if_basic(&self, variable: VariableId) -> Option<usize> {
        (variable.index() < self.basic).then_some(variable.index())
    }

    fn derived(&self, condition: &Condition) -> impl Iterator<Item = &(Vec<usize>, Vec<usize>)> {
        let literals = condition.clauses.iter().flatten().map(|literal| literal.fact.variable);
        let facts = condition.facts.iter().map(|fact| fact.variable);
        facts.chain(literals).filter_map(|variable| self.of.get(variable.index().checked_sub(self.basic)?))
    }

    /// Returns the basic variables that a condition reads in clauses or through derived variables.
    fn read_by(&self, condition: &Condition) -> Vec<usize> {
        let literals = condition.clauses.iter().flatten();
        let direct = literals.filter_map(|literal| self.if_basic(literal.fact.variable));
        direct.chain(self.derived(condition).flat_map(|(variables, _)| variables.iter().copied())).collect()
    }

    fn numbers_of(&self, condition: &Condition) -> Vec<usize> {
        let direct = condition.comparisons.iter().flat_map(|linear| &linear.coefficients);
        let direct = direct.map(|(variable, _)| variable.index());
        direct.chain(self.derived(condition).flat_map(|(_, numbers)| numbers.iter().copied())).collect()
    }
}

fn sorted(numbers: &mut Vec<usize>) -> &[usize] {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Adds clauses by which no operator that needs a fact follows another operator that erases the fact. `chain`
/// has the operators in order, each with two flags: it erases the fact, it needs the fact.
fn ladder(formula: &mut Formula, chain: &[(Lit, (bool, bool))]) {
    let last = chain.iter().rposition(|(_, (_, needs))| *needs);
    let mut erased = !Formula::truth();
    for (index, (literal, (erases, needs))) in chain.iter().enumerate() {
        if *needs {
            formula.add(Family::Interference, [!erased, !*literal]);
        }
        if *erases && last.is_some_and(|last| index < last) {
            if erased == !Formula::truth() {
                erased = *literal;
            } else {
                let longer = formula.fresh(VariableMeaning::Ladder);
                formula.add(Family::Interference, [!erased, longer]);
                formula.add(Family::Interference, [!*literal, longer]);
                erased = longer;
            }
        }
    }
}
