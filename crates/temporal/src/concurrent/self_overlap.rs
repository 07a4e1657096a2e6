//! Upper bounds on the number of simultaneous runs of a ground action that can be useful.
//!
//! In PDDL 2.1, an action can start again while it runs. Most actions cannot, because their start
//! requires a fact that the start deletes. A run whose start and end change nothing is redundant.
//! Both are proved from the facts that hold while the action runs;
//! docs/decisions/self-overlapping-actions.md has the arguments.

use std::collections::BTreeMap;

use rustc_hash::FxHashSet;
use task::limits::{Interrupted, Limits};
use task::number::Int;
use task::task::{Fact, NumericEffect, NumericId, Operator, OperatorId, Task, VariableId};

use crate::concurrent::action_invariants::{Index, Invariant, MAX_PAIR_CHECKS};
use crate::concurrent::happening::{Happening, Instance, Role};
use crate::concurrent::relevant_effects::{Change, RelevanceContext, asked, change, needed};
use crate::concurrent::split::UNDER_WAY;
use crate::concurrent::time_number::TimeNumber;

/// Maximum number of iterations of the analysis: a bound for one instance can improve the bounds of others.
const FIXPOINT_ROUNDS: usize = 2;

pub(super) fn bound_self_overlap<T: TimeNumber>(
    task: &Task,
    happenings: &[Happening<T>],
    instances: &mut [Instance<T>],
    separation: T,
    limits: &Limits,
) -> Result<(), Interrupted> {
    for instance in &mut *instances {
        instance.under_way = under_way(task, instance);
    }
    let snapshot = instances.to_vec();
    let index = Index::new(task, happenings, &snapshot);
    let mut work_left = MAX_PAIR_CHECKS;
    for instance in limits.watch(&mut *instances) {
        let instance = instance?;
        // A variable with two values belongs to this instance alone. Otherwise the other atoms of
        // the variable are false while the action runs. The start requires such an atom, so runs
        // exclude each other.
        let is_alone = |fact: Fact| task.variables[fact.variable.index()].values.len() == 2;
        let is_single = !instance.under_way.is_some_and(is_alone)
            || index.excludes_itself(instance, &mut work_left) == Some(true);
        instance.most = if is_single { 1 } else { u32::MAX };
    }
    let (needed, read_facts) = (needed(task), asked(task, &snapshot));
    for _ in 0..FIXPOINT_ROUNDS {
        let most: Vec<u32> = instances.iter().map(|instance| instance.most).collect();
        let relevance = RelevanceContext { most: &most, separation, needed: &needed, asked: &read_facts };
        for instance in limits.watch(&mut *instances) {
            let instance = instance?;
            if instance.most > 1
                && let Some(bound) = index.most(instance, &relevance, &mut work_left)
            {
                instance.most = instance.most.min(bound);
            }
        }
        if instances.iter().zip(&most).all(|(instance, most)| instance.most == *most) {
            break;
        }
    }
    let relevance = RelevanceContext { most: &[], separation, needed: &needed, asked: &[] };
    for instance in instances {
        instance.under_way = instance.under_way.filter(|_| instance.most > 1);
        instance.counts_by_end =
            instance.under_way.is_some_and(|under_way| counts_by_end(task, instance, under_way, &relevance));
    }
    Ok(())
}

fn under_way<T: TimeNumber>(task: &Task, own: &Instance<T>) -> Option<Fact> {
    let name = |fact: &Fact| &task.variables[fact.variable.index()].values[fact.value as usize];
    let required = &task.operators[own.end.index()].condition.facts;
    required.iter().find(|fact| name(fact).starts_with(UNDER_WAY)).copied()
}

fn clashes(fact: Fact, others: &[Fact]) -> bool {
    others.iter().any(|other| other.variable == fact.variable && other.value != fact.value)
}

#[derive(Clone, Copy)]
struct Inside<'i, T: TimeNumber> {
    own: &'i Instance<T>,
    invariant: &'i Invariant,
    known: &'i RelevanceContext<'i, T>,
}

impl<T: TimeNumber> Index<'_, T> {
    /// Returns `true` if it is proved that no run of the action can start during another run. Returns `None`
    /// if the work limit `left` is used up.
    fn excludes_itself(&self, own: &Instance<T>, left: &mut usize) -> Option<bool> {
        let invariant = self.invariant(own, true, left)?;
        if self.excludes(&invariant, own, own.start) {
            return Some(true);
        }
        let start = &self.task.operators[own.start.index()];
        if !start.conditional.is_empty() {
            return Some(false);
        }
        for fact in &start.effects {
            let required = start.condition.facts.iter().find(|condition| condition.variable == fact.variable);
            let Some(required) = required.filter(|required| required.value != fact.value) else { continue };
            if !self.is_reached(own, &invariant, (*fact, required.value), left)? {
                return Some(true);
            }
        }
        Some(false)
    }

    /// Returns `true` if other happenings during a run may change a variable from the fact `from`,
    /// which the start sets, to the value `to`. Returns `None` if the work limit is used up.
    fn is_reached(
        &self,
        own: &Instance<T>,
        invariant: &Invariant,
        (from, to): (Fact, u32),
        left: &mut usize,
    ) -> Option<bool> {
        let variable = from.variable;
        let setting: Vec<&Operator> = self
            .setting(own, variable)
            .filter(|id| !self.is_outside(invariant, own, *id))
            .map(|id| &self.task.operators[id.index()])
            .collect();
        *left = left.checked_sub(self.setting(own, variable).count())?;
        let mut reached = vec![from.value];
        let mut next = 0;
        while let Some(value) = reached.get(next).copied() {
            next = next.saturating_add(1);
            *left = left.checked_sub(setting.len())?;
            for operator in &setting {
                let mut facts = operator.condition.facts.iter();
                if facts.any(|fact| fact.variable == variable && fact.value != value) {
                    continue;
                }
                let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
                for fact in operator.effects.iter().chain(conditional) {
                    if fact.variable == variable && !reached.contains(&fact.value) {
                        reached.push(fact.value);
                    }
                }
            }
        }
        Some(reached.contains(&to))
    }

    /// Upper bound on the number of simultaneous runs that can be useful. Returns `None` if no
    /// bound is proved or the work limit is used up.
    fn most(&self, own: &Instance<T>, known: &RelevanceContext<'_, T>, left: &mut usize) -> Option<u32> {
        let [start, end] = [own.start, own.end].map(|id| &self.task.operators[id.index()]);
        if own.is_chosen || ![start, end].into_iter().all(is_plain) {
            return None;
        }
        let mut assigned = Vec::new();
        for effect in end.numeric_effects.iter().filter(|effect| !is_timer(own, effect.variable)) {
            match change(effect) {
                Some(Change::Sets(value)) => assigned.push((effect.variable, value)),
                _ if known.is_loss(effect) => {}
                _ => return None,
            }
        }
        let alone = self.invariant(own, true, left)?;
        if !self.lasts_as_long(own, start, &alone) {
            return None;
        }
        let under_way = own.under_way?.variable;
        let [starts, ends] = [start, end].map(|operator| -> Vec<Fact> {
            operator.effects.iter().filter(|fact| fact.variable != under_way).copied().collect()
        });
        // The run that ends first deletes a fact that the over-all condition of the other run
        // requires. So the runs start and end together, and one run has the effect of both.
        if ends.iter().any(|fact| clashes(*fact, &alone.over_all)) {
            return Some(1);
        }
        let invariant = self.invariant(own, false, left)?;
        let wanted = known.relevant_effects(&ends);
        let hidden = wanted.iter().filter(|fact| clashes(**fact, &starts)).map(|fact| fact.variable);
        let hidden: Vec<VariableId> = hidden.collect();
        for variable in &hidden {
            *left = left.checked_sub(self.task.operators.len())?;
            if !self.is_hidden(own, &invariant, &starts, *variable) {
                return None;
            }
        }
        let set = known.relevant_effects(&starts);
        let inside = Inside { own, invariant: &invariant, known };
        let mut bound: Int = 1;
        for (facts, assigned) in [(&set, &[][..]), (&wanted, &assigned)] {
            let facts: Vec<Fact> =
                facts.iter().filter(|fact| !hidden.contains(&fact.variable)).copied().collect();
            let undoing = self.undoing(inside, (&facts, assigned), left)?;
            bound = bound.saturating_add(self.times_together(inside, undoing, left)?);
        }
        // Ends of earlier runs undo effects of starts. The argument then only proves that the first
        // two overlapping runs need not overlap, so only the bound 1 is valid.
        let is_cut = set.iter().any(|fact| clashes(*fact, &ends) && !hidden.contains(&fact.variable));
        u32::try_from(bound).ok().filter(|bound| *bound == 1 || !is_cut)
    }

    /// Operators other than the start and end of `own` that undo one of the facts or numeric
    /// assignments during a run. Returns `None` if the work limit is used up.
    fn undoing(
        &self,
        Inside { own, invariant, known }: Inside<'_, T>,
        (facts, assigned): (&[Fact], &[(NumericId, Int)]),
        left: &mut usize,
    ) -> Option<FxHashSet<OperatorId>> {
        let mut operators = FxHashSet::default();
        for fact in facts {
            *left = left.checked_sub(self.setting(own, fact.variable).count())?;
            operators.extend(self.setting(own, fact.variable).filter(|id| self.changes(*id, *fact)));
        }
        for (number, value) in assigned {
            *left = left.checked_sub(self.changing(own, *number).count())?;
            operators.extend(self.changing(own, *number).filter(|id| {
                let mut effects = self.task.operators[id.index()].numeric_effects.iter();
                effects.any(|effect| effect.variable == *number && !known.keeps(effect, *value))
            }));
        }
        operators.retain(|id| !self.is_outside(invariant, own, *id));
        Some(operators)
    }

    /// Upper bound on the total number of useful occurrences of the operators `happenings` during a
    /// run. Returns `None` if there is no bound or the work limit is used up. Among happenings that
    /// only serve the same facts, only the first one is useful, and one more after each happening
    /// that undoes these facts.
    fn times_together(
        &self,
        inside: Inside<'_, T>,
        happenings: FxHashSet<OperatorId>,
        left: &mut usize,
    ) -> Option<Int> {
        let mut total: Int = 0;
        let mut groups: BTreeMap<Vec<Fact>, Option<Int>> = BTreeMap::new();
        for id in happenings {
            let times = self.times(id, inside.own, inside.known);
            if let Some(facts) = self.purpose(id, inside.known) {
                let sum = groups.entry(facts).or_insert(Some(0));
                *sum = sum.zip(times).map(|(sum, times)| sum.saturating_add(times));
            } else {
                total = total.saturating_add(times?);
            }
        }
        for (facts, times) in groups {
            let undoing = self.undoing(inside, (&facts, &[]), left)?;
            // The number of runs of the instance itself has no bound yet.
            let is_undone = facts
                .iter()
                .any(|fact| [inside.own.start, inside.own.end].iter().any(|id| self.changes(*id, *fact)));
            let undoing = if is_undone { None } else { Some(undoing) };
            let again = undoing.and_then(|undoing| {
                undoing.into_iter().try_fold(1, |sum: Int, id| {
                    Some(sum.saturating_add(self.times(id, inside.own, inside.known)?))
                })
            });
            total = total.saturating_add(match (times, again) {
                (Some(times), Some(again)) => times.min(again),
                (times, again) => times.or(again)?,
            });
        }
        Some(total)
    }

    /// Facts that are the only useful effects of the run that the end `id` completes. Returns
    /// `None` if the run may have other useful effects or `id` is not an end.
    fn purpose(&self, id: OperatorId, known: &RelevanceContext<'_, T>) -> Option<Vec<Fact>> {
        let Role::End(instance) = self.happenings[id.index()].role else { return None };
        let instance = &self.instances[instance as usize];
        let [start, end] = [instance.start, instance.end].map(|id| &self.task.operators[id.index()]);
        let wanted = |operator: &Operator| -> Vec<Fact> {
            // A variable that only marks the instance as running has two values.
            let is_own = |fact: &Fact| {
                let is_alone = self.task.variables[fact.variable.index()].values.len() == 2;
                is_alone && instance.under_way.is_some_and(|running| running.variable == fact.variable)
            };
            known.relevant_effects(&operator.effects).into_iter().filter(|fact| !is_own(fact)).collect()
        };
        let is_good_for_facts = !instance.is_chosen
            && [start, end].into_iter().all(is_plain)
            && wanted(start).is_empty()
            && [start, end]
                .into_iter()
                .flat_map(|operator| &operator.numeric_effects)
                .all(|effect| is_timer(instance, effect.variable) || known.is_loss(effect));
        is_good_for_facts.then(|| wanted(end))
    }

    /// Upper bound on the number of occurrences of a happening during a run of `own`. Returns `None` if no
    /// bound is known, for example if the duration of `own` is not constant.
    fn times(&self, id: OperatorId, own: &Instance<T>, known: &RelevanceContext<'_, T>) -> Option<Int> {
        let happening = &self.happenings[id.index()];
        let apart = match happening.role {
            Role::Never => return Some(0),
            Role::Timed(_) => return Some(1),
            Role::Start(other) | Role::End(other) if known.most[other as usize] == 1 => self.duration(other),
            _ => {
                let marks = &happening.accesses.marks;
                let mut after = happening.accesses.after.iter();
                let is_apart = after.any(|(key, by)| *by > T::ZERO && marks.binary_search(key).is_ok());
                is_apart.then_some(known.separation)?
            }
        };
        let duration = own.timer.is_none().then_some(own.duration)?;
        duration.quotient(apart)?.checked_add(1)
    }

    /// Returns `true` if a run of `own` that starts during another run of `own` certainly has the same
    /// duration as that run, and the start changes no other number.
    fn lasts_as_long(&self, own: &Instance<T>, start: &Operator, invariant: &Invariant) -> bool {
        start.numeric_effects.iter().all(|effect| {
            let mut numbers =
                effect.value.coefficients.iter().flat_map(|(number, _)| self.changing(own, *number));
            is_timer(own, effect.variable) && numbers.all(|id| self.is_outside(invariant, own, id))
        })
    }

    /// Returns `true` if it is certain that only the starts and ends of `own` read or set the variable
    /// during a run.
    fn is_hidden(
        &self,
        own: &Instance<T>,
        invariant: &Invariant,
        starts: &[Fact],
        variable: VariableId,
    ) -> bool {
        let task = self.task;
        let is_derived_from = task.axioms.iter().flat_map(|layer| &layer.rules).any(|rule| {
            let facts = rule.body.facts.iter().map(|fact| fact.variable);
            let clauses = rule.body.clauses.iter().flatten().map(|literal| literal.fact.variable);
            facts.chain(clauses).any(|candidate| candidate == variable)
        });
        let mut operators = OperatorId::all(task.operators.len());
        !is_derived_from
            && operators.all(|id| {
                let mentions = mentions(&task.operators[id.index()], variable);
                [own.start, own.end].contains(&id)
                    || self.happenings[id.index()].role == Role::Never
                    || !mentions
                    || self.is_outside(invariant, own, id)
            })
            && self.holding().all(|(other, over_all)| {
                let operator = &task.operators[over_all.index()];
                let is_own = own.over_all == Some(over_all);
                let required = operator.condition.facts.iter().find(|fact| fact.variable == variable);
                !mentions(operator, variable)
                    || !is_own
                        && required.is_some_and(|fact| clashes(*fact, starts))
                        && self.is_outside(invariant, own, other)
            })
    }
}

fn mentions(operator: &Operator, variable: VariableId) -> bool {
    let facts = operator.condition.facts.iter().chain(&operator.effects);
    let conditional = operator.conditional.iter().flat_map(|effect| &effect.effects);
    let conditions = operator.conditional.iter().flat_map(|effect| &effect.condition);
    let literals = operator.condition.clauses.iter().flatten().chain(conditions);
    let facts = facts.chain(conditional).copied().chain(literals.map(|literal| literal.fact));
    facts.into_iter().any(|fact| fact.variable == variable)
}

fn is_plain(operator: &Operator) -> bool {
    operator.conditional.is_empty() && operator.cost.tables.is_empty() && operator.cost.constant >= 0
}

/// Returns `true` if only the end of a run has relevant effects, and the end of a second run changes nothing
/// more.
fn counts_by_end<T: TimeNumber>(
    task: &Task,
    own: &Instance<T>,
    under_way: Fact,
    known: &RelevanceContext<'_, T>,
) -> bool {
    let [start, end] = [own.start, own.end].map(|id| &task.operators[id.index()]);
    let starts = known.relevant_effects(&start.effects);
    !own.is_chosen
        && [start, end].into_iter().all(is_plain)
        && starts.iter().all(|fact| fact.variable == under_way.variable)
        && start.numeric_effects.iter().all(|effect| is_timer(own, effect.variable))
        && assigns_constants(own, end)
}

fn is_timer<T: TimeNumber>(own: &Instance<T>, number: NumericId) -> bool {
    own.timer.is_some_and(|(timer, _)| timer == number)
}

/// Returns `true` if the end sets numbers only to constants, so that a second end changes nothing.
fn assigns_constants<T: TimeNumber>(own: &Instance<T>, end: &Operator) -> bool {
    let is_set = |effect: &NumericEffect| matches!(change(effect), Some(Change::Sets(_)));
    end.numeric_effects.iter().all(|effect| is_timer(own, effect.variable) || is_set(effect))
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::{Source, read};

    use crate::concurrent::ground_concurrent;
    use task::ground::GroundConfig;

    /// Bound on useful simultaneous runs of `charge` with the additional effects `more`. The action
    /// `pump` requires a charge and only serves the fact `p`; other actions need `p` both true and
    /// false.
    fn charges(more: &str) -> u32 {
        let domain = format!(
            "(define (domain d) (:requirements :durative-actions :fluents) (:predicates (p) (q) (r)) (:functions (battery))
               (:durative-action charge :parameters () :duration (= ?duration 10)
                 :condition () :effect (and (at end (assign (battery) 1)) {more}))
               (:durative-action pump :parameters () :duration (= ?duration 1) :condition (at start (>= (battery) 1))
                 :effect (and (at end (p)) (at end (decrease (battery) 1))))
               (:durative-action full :parameters () :duration (= ?duration 1) :condition (at start (p)) :effect (at end (q)))
               (:durative-action empty :parameters () :duration (= ?duration 1)
                 :condition (and (at start (not (p))) (at start (q))) :effect (at end (r))))"
        );
        let problem = "(define (problem p) (:domain d) (:init (= (battery) 0)) (:goal (and (q) (r) (p))) (:metric minimize (total-time)))";
        let (domain, problem, _) =
            read(&Source::new("domain", domain), &Source::new("problem", problem)).expect("PDDL");
        let separation = BigRational::new(1.into(), 1000.into());
        let task = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
            .expect("a task")
            .narrow();
        let name = |instance: &super::Instance| {
            let schema = task.task.operators[instance.start.index()].schema;
            task.task.schema_names[schema as usize].as_str()
        };
        let charge = task.instances.iter().find(|instance| name(instance) == "charge").expect("an instance");
        charge.most
    }

    #[test]
    fn an_action_that_serves_one_fact_undoes_an_effect_once_unless_the_runs_undo_the_fact() {
        assert_eq!(charges(""), 2);
        // Each end makes another `pump` useful, so no bound is known.
        assert_eq!(charges("(at end (not (p)))"), u32::MAX);
    }
}
