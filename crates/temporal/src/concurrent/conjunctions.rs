//! Explicit conjunctions in the delete relaxation, for facts that no action adds again.
//!
//! A relaxed plan deletes nothing. So an action that deletes a fact looks useful even if the fact is
//! needed later and nothing adds it again. For each such fact f, the relaxed task gets conjunctions
//! f ∧ p, up to work limits. Here p is a proposition that is needed together with f, and that a rule
//! deleting f would help to achieve. Only rules that keep f achieve f ∧ p. These are conjunctions of
//! two facts as in the task Π^C \[1\], for a few selected facts.
//!
//! \[1\] E. Keyder, J. Hoffmann, P. Haslum: Improving delete relaxation heuristics through
//! explicitly represented conjunctions, JAIR 50, 2014.

use rustc_hash::{FxHashMap, FxHashSet};
use task::lists::Lists;
use task::number::dense;

use crate::concurrent::rule::{Proposition, Rule};

/// Upper limit on added rules, per rule of the relaxed task. `EXTRA_RULES` is added to the limit.
const MAX_RULES_PER_RULE: usize = 2;
const EXTRA_RULES: usize = 1_000;
/// Work limit of the selection of conjunctions, in rule visits per rule.
const MAX_VISITS_PER_RULE: usize = 64;

/// A conjunction proposition, followed by its two members.
pub(super) type Conjunction = [Proposition; 3];

pub(super) struct Scope<'a> {
    pub(super) rules: &'a mut Vec<Rule>,
    pub(super) goal: &'a mut Vec<Proposition>,
    /// Range of the propositions of each variable; empty if the variable gets no conjunctions.
    pub(super) variables: &'a [std::ops::Range<Proposition>],
    pub(super) propositions: &'a mut u32,
}

struct Index {
    /// Conditions of each rule; the last entry holds the conditions of the goal.
    needs: Lists,
    adding: Lists,
    needing: Lists,
    setting: Vec<Vec<u32>>,
}

/// Adds conjunctions to a relaxed task, rewrites rules and goal to require them, and returns them. Callers must
/// let a conjunction hold in the evaluated state if both members hold.
#[expect(clippy::arithmetic_side_effects, reason = "propositions and rules are held in memory")]
pub(super) fn add_conjunctions(scope: &mut Scope<'_>) -> Vec<Conjunction> {
    let index = Index::new(scope);
    let count = scope.rules.len();
    let (mut copies, mut looks) = (count * MAX_RULES_PER_RULE + EXTRA_RULES, count * MAX_VISITS_PER_RULE);
    let mut conjunctions = Vec::new();
    for (variable, range) in scope.variables.iter().enumerate() {
        let setting = &index.setting[variable];
        for fact in range.clone() {
            let is_needed = !index.needing.of(fact).is_empty();
            if setting.is_empty() || !is_needed || !index.adding.of(fact).is_empty() {
                continue;
            }
            // All rules that set the variable set it to another value, so they delete the fact.
            let together = index.together(fact, setting, scope, &mut looks);
            let is_open = |rule: &u32| setting.binary_search(rule).is_err();
            let mut rules: Vec<u32> = together
                .iter()
                .flat_map(|proposition| index.adding.of(*proposition))
                .copied()
                .filter(is_open)
                .collect();
            rules.sort_unstable();
            rules.dedup();
            if together.is_empty() || rules.len() > copies {
                continue;
            }
            copies -= rules.len();
            let first = *scope.propositions;
            let numbers: FxHashMap<Proposition, Proposition> =
                together.iter().copied().zip(first..).collect();
            *scope.propositions += dense(together.len());
            conjunctions
                .extend(together.iter().map(|proposition| [numbers[proposition], fact, *proposition]));
            for rule in rules {
                let copy = scope.rules[rule as usize].with(fact, index.needs.of(rule), &numbers);
                scope.rules.push(copy);
            }
            for rule in index.needing.of(fact) {
                let needs = scope.rules[..count].get_mut(*rule as usize).map(|rule| &mut rule.needs);
                let needs = needs.unwrap_or(scope.goal);
                needs.retain(|need| !numbers.contains_key(need));
                needs.extend(index.needs.of(*rule).iter().filter_map(|need| numbers.get(need)));
                needs.sort_unstable();
            }
        }
    }
    conjunctions
}

impl Index {
    fn new(scope: &Scope<'_>) -> Self {
        let propositions = *scope.propositions as usize;
        let (mut adds, mut needs) = (Lists::default(), Lists::default());
        let mut setting = vec![Vec::new(); scope.variables.len()];
        for (rule, content) in (0..).zip(scope.rules.iter()) {
            adds.push(&content.adds);
            needs.push(&content.needs);
            for fact in &content.sets {
                let variable = scope.variables.partition_point(|range| range.end <= *fact);
                if setting[variable].last() != Some(&rule) {
                    setting[variable].push(rule);
                }
            }
        }
        needs.push(scope.goal);
        let (adding, needing) = (adds.inverse(propositions), needs.inverse(propositions));
        Self { needs, adding, needing, setting }
    }

    /// Propositions that are needed at the same time as `fact` and that a rule in `deleting` may
    /// help to achieve, in ascending order. The needed propositions are the conditions of the rules
    /// that require `fact`, and the conditions for achieving these. The result is empty if the work
    /// limit `looks` is used up while the needed propositions are collected.
    fn together(
        &self,
        fact: Proposition,
        deleting: &[u32],
        scope: &Scope<'_>,
        looks: &mut usize,
    ) -> Vec<Proposition> {
        let rules = &scope.rules;
        let mut needed = FxHashSet::default();
        let mut stack: Vec<Proposition> =
            self.needing.of(fact).iter().flat_map(|rule| self.needs.of(*rule)).copied().collect();
        while let Some(proposition) = stack.pop() {
            if proposition == fact || !needed.insert(proposition) {
                continue;
            }
            let open =
                self.adding.of(proposition).iter().filter(|rule| deleting.binary_search(rule).is_err());
            for rule in open {
                *looks = looks.saturating_sub(1);
                stack.extend(self.needs.of(*rule));
            }
            if *looks == 0 {
                return Vec::new();
            }
        }
        let mut spoilt = FxHashSet::default();
        let mut stack: Vec<Proposition> =
            deleting.iter().flat_map(|rule| &rules[*rule as usize].adds).copied().collect();
        while let Some(proposition) = stack.pop() {
            if !needed.contains(&proposition) || !spoilt.insert(proposition) {
                continue;
            }
            for rule in self.needing.of(proposition) {
                *looks = looks.saturating_sub(1);
                stack.extend(rules.get(*rule as usize).into_iter().flat_map(|rule| &rule.adds));
            }
        }
        let mut together: Vec<Proposition> = spoilt.into_iter().collect();
        together.sort_unstable();
        together
    }
}

#[cfg(test)]
mod tests {
    use num_rational::BigRational;
    use pddl::{Source, read};

    use crate::concurrent::ground_concurrent;
    use crate::concurrent::relaxed_plan_heuristic::RelaxedPlanHeuristic;
    use crate::concurrent::successors::Expansion;
    use crate::concurrent::temporal_relaxation::TemporalRelaxation;
    use task::ground::GroundConfig;

    /// `lock` needs the key after the door is open. `break` opens the door but uses up the key.
    const DOMAIN: &str =
        "(define (domain d) (:requirements :durative-actions) (:predicates (key) (window) (inside) (open) (locked))
        (:durative-action climb :parameters () :duration (= ?duration 1) :condition (at start (window)) :effect (at end (inside)))
        (:durative-action unlock :parameters () :duration (= ?duration 1) :condition (at start (inside)) :effect (at end (open)))
        (:durative-action break :parameters () :duration (= ?duration 1) :condition (at start (key))
          :effect (and (at start (not (key))) (at end (open))))
        (:durative-action lock :parameters () :duration (= ?duration 1)
          :condition (and (at start (key)) (at start (open))) :effect (at end (locked))))";

    fn guide(facts: &str, goal: &str) -> Option<Vec<String>> {
        let problem = format!("(define (problem p) (:domain d) (:init {facts}) (:goal {goal}))");
        let (domain, problem, _) =
            read(&Source::new("domain", DOMAIN), &Source::new("problem", problem)).expect("PDDL");
        let separation = BigRational::new(1.into(), 1000.into());
        let concurrent = ground_concurrent(&domain, &problem, &GroundConfig::default(), &separation)
            .expect("a task")
            .narrow();
        let relaxed = TemporalRelaxation::new(&concurrent);
        let guide = RelaxedPlanHeuristic::new(&relaxed).guide(&Expansion::new(&concurrent).root())?;
        let schema = |id: &task::task::OperatorId| concurrent.task.operators[id.index()].schema;
        let name = |id| concurrent.task.schema_names[schema(id) as usize].clone();
        Some(guide.preferred.iter().map(name).collect())
    }

    #[test]
    fn a_relaxed_plan_does_not_use_up_the_key_that_it_needs_later() {
        let begins = |actions: &[&str]| Some(actions.iter().map(|name| (*name).to_owned()).collect());
        assert_eq!(guide("(key) (window)", "(open)"), begins(&["break"]));
        assert_eq!(guide("(key) (window)", "(locked)"), begins(&["climb"]));
        assert_eq!(guide("(key)", "(locked)"), None);
        // The goal requires the key as well.
        assert_eq!(guide("(key)", "(and (open) (key))"), None);
        assert_eq!(guide("(key)", "(open)"), begins(&["break"]));
    }
}
