//! h² mutexes: pairs of facts that no state on a path from the initial state to the goal contains.
//!
//! Forward h² \[1\] finds pairs of facts that no reachable state contains. Backward h² \[2\] finds pairs that
//! no state contains from which the goal is reachable; such pairs detect dead ends. An operator is useless if
//! its condition or its result contains a mutex pair. The analysis is conservative, i.e. it may miss mutexes:
//! numeric conditions, clauses and derived facts are ignored, and conditional effects may occur or not.
//!
//! \[1\] P. Haslum, H. Geffner: Admissible heuristics for optimal planning, AIPS 2000.
//! \[2\] V. Alcázar, Á. Torralba: A reminder about the importance of computing and exploiting invariants in
//! planning, ICAPS 2015.

use task::limits::{Interrupted, Limits};
use task::number::dense;
use task::task::number::TaskNumber;
use task::task::{Fact, Operator, OperatorId, Task, VariableId};

/// Upper limit on the number of facts; a pair table then takes 8 MB.
const MAX_FACTS: usize = 8_000;
/// Limit on the work of the fixpoint computation, as the number of visited bitset words (about 0.5 s).
const MAX_WORK: usize = 400_000_000;
/// Maximum number of rounds of forward and backward h² analysis, which prune with each other's results.
const MAX_ROUNDS: usize = 4;

type Words = Vec<u64>;

struct Rule {
    before: Vec<u32>,
    after: Vec<u32>,
    adds: Vec<u32>,
    /// Variables that the operator sets.
    set: Vec<VariableId>,
    /// All facts of the variables that the operator may change and does not require.
    open: Vec<u32>,
    /// Variables that the operator requires or may change.
    touched: Vec<VariableId>,
}

/// For each fact: a bitset of the facts that are compatible with it, i.e. for which the analysis does
/// not exclude a common state.
struct Table {
    words: usize,
    bits: Words,
}

impl Table {
    fn new(facts: usize) -> Self {
        let words = facts.div_ceil(64);
        Self { words, bits: vec![0; words.saturating_mul(facts)] }
    }

    fn row(&self, fact: u32) -> &[u64] {
        let start = (fact as usize).saturating_mul(self.words);
        &self.bits[start..start.saturating_add(self.words)]
    }

    fn has(&self, one: u32, other: u32) -> bool {
        has(self.row(one), other)
    }

    /// Marks two facts as compatible. Returns `true` if they were not marked before.
    fn insert(&mut self, one: u32, other: u32) -> bool {
        let is_new = !self.has(one, other);
        for (row, fact) in [(one, other), (other, one)] {
            let start = (row as usize).saturating_mul(self.words);
            insert(&mut self.bits[start..], fact);
        }
        is_new
    }

    /// Marks `fact` as compatible with all `others`. Returns `true` if a pair was not marked
    /// before.
    fn join(&mut self, fact: u32, others: &[u64]) -> bool {
        let mut is_new = false;
        for (index, word) in others.iter().enumerate() {
            let start = (fact as usize).saturating_mul(self.words);
            let mut news = word & !self.bits[start.saturating_add(index)];
            is_new |= news != 0;
            while news != 0 {
                let new_fact = dense(index).saturating_mul(64).saturating_add(news.trailing_zeros());
                self.insert(fact, new_fact);
                news &= news.saturating_sub(1);
            }
        }
        is_new
    }

    /// Returns the facts in `all` that are compatible with each fact in `facts`; `None` if `facts`
    /// are not pairwise compatible.
    fn beside(&self, facts: &[u32], all: &[u64]) -> Option<Words> {
        let mut common = all.to_vec();
        for fact in facts {
            let row = self.row(*fact);
            if facts.iter().any(|other| !has(row, *other)) {
                return None;
            }
            common.iter_mut().zip(row).for_each(|(word, row)| *word &= row);
        }
        Some(common)
    }
}

fn has(words: &[u64], fact: u32) -> bool {
    words[(fact >> 6) as usize] >> (fact & 63) & 1 == 1
}

fn insert(words: &mut [u64], fact: u32) {
    words[(fact >> 6) as usize] |= 1 << (fact & 63);
}

fn remove(words: &mut [u64], fact: u32) {
    words[(fact >> 6) as usize] &= !(1 << (fact & 63));
}

fn common(words: &[u64], others: &[u64]) -> Words {
    words.iter().zip(others).map(|(word, other)| word & other).collect()
}

#[expect(clippy::arithmetic_side_effects, reason = "positions in words in memory; `count` is 1 to 64")]
fn remove_all(words: &mut [u64], facts: std::ops::Range<u32>) {
    let mut start = facts.start;
    while start < facts.end {
        let next = facts.end.min((start | 63) + 1);
        let count = next - start;
        words[(start >> 6) as usize] &= !(u64::MAX >> (64 - count) << (start & 63));
        start = next;
    }
}

/// The h² mutexes of a task, from forward and backward analysis.
pub struct MutexPairs {
    first: Vec<u32>,
    /// Pairs that a state on a path from the initial state to the goal may contain.
    alive: Table,
    useless: Vec<bool>,
}

impl MutexPairs {
    /// Computes the h² mutexes of a task. Returns `None` if there are too many facts, or the work limit is
    /// reached in the first round.
    pub(crate) fn new<N: TaskNumber>(task: &Task<N>, limits: &Limits) -> Result<Option<Self>, Interrupted> {
        let mut first = Vec::with_capacity(task.basic);
        let mut variables = Vec::new();
        for (variable, id) in task.variables[..task.basic].iter().zip((0..).map(VariableId)) {
            first.push(dense(variables.len()));
            variables.extend(variable.values.iter().map(|_| id));
        }
        let facts = dense(variables.len());
        if facts as usize > MAX_FACTS {
            return Ok(None);
        }
        let work = task.operators.len().saturating_mul((facts as usize).div_ceil(64));
        let Some(left) = MAX_WORK.checked_sub(work).filter(|left| *left > 0) else { return Ok(None) };
        let mut builder = H2Builder { task, first, variables, facts, left };
        let mut rules = Vec::with_capacity(task.operators.len());
        for operator in limits.watch(&task.operators) {
            rules.push(builder.rule(operator?));
        }
        let mut useless = vec![false; rules.len()];
        let mut alive = None;
        for _ in 0..MAX_ROUNDS {
            let Some(forwards) = builder.forwards(&rules, &useless, limits)? else { break };
            let Some(backwards) = builder.backwards(&rules, &useless, &forwards, limits)? else { break };
            let mut is_over = true;
            let all_facts = vec![u64::MAX; builder.words()];
            for (rule, useless) in rules.iter().zip(&mut useless) {
                // An operator is useless if its condition or its result contains a mutex pair.
                let is_alive = |facts| backwards.beside(facts, &all_facts).is_some();
                if !(*useless || is_alive(&rule.before) && is_alive(&rule.after)) {
                    *useless = true;
                    is_over = false;
                }
            }
            alive = Some(backwards);
            if is_over {
                break;
            }
        }
        Ok(alive.map(|alive| Self { first: builder.first, alive, useless }))
    }

    pub(crate) fn is_operator_useless(&self, operator: OperatorId) -> bool {
        self.useless[operator.index()]
    }

    /// Returns `true` if a mutex pair proves that the goal is unreachable from the state `values`. Checks
    /// only pairs with a variable that differs from `before`, a state without mutex pairs.
    pub(crate) fn is_dead_end(&self, before: &[u32], values: &[u32]) -> bool {
        let number = |variable: usize| self.first[variable].saturating_add(values[variable]);
        (0..self.first.len()).filter(|variable| before[*variable] != values[*variable]).any(|changed| {
            let row = self.alive.row(number(changed));
            (0..self.first.len()).any(|variable| !has(row, number(variable)))
        })
    }
}

struct H2Builder<'a, N> {
    task: &'a Task<N>,
    first: Vec<u32>,
    variables: Vec<VariableId>,
    facts: u32,
    left: usize,
}

impl<N: TaskNumber> H2Builder<'_, N> {
    fn words(&self) -> usize {
        (self.facts as usize).div_ceil(64)
    }

    fn is_basic(&self, variable: VariableId) -> bool {
        variable.index() < self.task.basic
    }

    fn number(&self, fact: Fact) -> u32 {
        self.first[fact.variable.index()].saturating_add(fact.value)
    }

    fn values(&self, variable: VariableId) -> std::ops::Range<u32> {
        let first = self.first[variable.index()];
        first..first.saturating_add(dense(self.task.variables[variable.index()].values.len()))
    }

    fn rule(&self, operator: &Operator<N>) -> Rule {
        let required = operator.condition.facts.iter().filter(|fact| self.is_basic(fact.variable));
        let conditional: Vec<Fact> =
            operator.conditional.iter().flat_map(|effect| &effect.effects).copied().collect();
        let may_change = |variable| conditional.iter().any(|fact| fact.variable == variable);
        let unconditional = operator.effects.iter().filter(|fact| !may_change(fact.variable));
        let persists = |fact: &&Fact| {
            !may_change(fact.variable)
                && operator.effects.iter().all(|effect| effect.variable != fact.variable)
        };
        let changing: Vec<VariableId> =
            operator.effects.iter().chain(&conditional).map(|fact| fact.variable).collect();
        let is_open = |variable: &&VariableId| required.clone().all(|fact| fact.variable != **variable);
        let open = changing.iter().filter(is_open).flat_map(|variable| self.values(*variable));
        let open: Vec<u32> = open.collect();
        let touched = changing.iter().copied().chain(required.clone().map(|fact| fact.variable)).collect();
        Rule {
            before: required.clone().map(|fact| self.number(*fact)).collect(),
            after: unconditional.chain(required.filter(persists)).map(|fact| self.number(*fact)).collect(),
            adds: operator.effects.iter().chain(&conditional).map(|fact| self.number(*fact)).collect(),
            set: operator.effects.iter().map(|effect| effect.variable).collect(),
            open,
            touched,
        }
    }

    /// Computes the pairs of facts that a state may contain that is reachable without useless operators.
    /// Returns `None` if the work limit is reached.
    fn forwards(
        &mut self,
        rules: &[Rule],
        useless: &[bool],
        limits: &Limits,
    ) -> Result<Option<Table>, Interrupted> {
        let mut table = Table::new(self.facts as usize);
        let initial: Vec<u32> = (0..dense(self.task.basic))
            .map(|variable| {
                self.number(Fact {
                    variable: VariableId(variable),
                    value: self.task.initial.values[variable as usize],
                })
            })
            .collect();
        let mut reached = vec![0; self.words()];
        for fact in &initial {
            insert(&mut reached, *fact);
            for other in &initial {
                table.insert(*fact, *other);
            }
        }
        loop {
            let mut is_over = true;
            for item in limits.watch(rules.iter().zip(useless)) {
                let (rule, useless) = item?;
                let steps = rule.before.len().saturating_add(rule.adds.len()).saturating_add(2);
                let Some(remaining) = self.left.checked_sub(steps.saturating_mul(table.words)) else {
                    return Ok(None);
                };
                self.left = remaining;
                if *useless {
                    continue;
                }
                let Some(mut beside) = table.beside(&rule.before, &reached) else { continue };
                rule.set.iter().for_each(|variable| remove_all(&mut beside, self.values(*variable)));
                rule.adds.iter().for_each(|fact| insert(&mut beside, *fact));
                for fact in &rule.adds {
                    // A variable has only one value, so an added fact is incompatible with the variable's
                    // other facts.
                    let variable_facts = self.values(self.variables[*fact as usize]);
                    let mut compatible = beside.clone();
                    variable_facts
                        .filter(|value| value != fact)
                        .for_each(|value| remove(&mut compatible, value));
                    if table.join(*fact, &compatible) {
                        is_over = false;
                        insert(&mut reached, *fact);
                    }
                }
            }
            if is_over {
                return Ok(Some(table));
            }
        }
    }

    /// Computes the pairs in `forwards` that a state may contain from which the goal is reachable without
    /// useless operators. Returns `None` if the work limit is reached.
    fn backwards(
        &mut self,
        rules: &[Rule],
        useless: &[bool],
        forwards: &Table,
        limits: &Limits,
    ) -> Result<Option<Table>, Interrupted> {
        let mut table = Table::new(self.facts as usize);
        let mut reached = vec![0; self.words()];
        // Facts that are compatible with all goal facts. Other values of the goal variables are thus
        // excluded.
        let goal = self.task.goal.facts.iter().filter(|fact| self.is_basic(fact.variable));
        let goal: Vec<u32> = goal.map(|fact| self.number(*fact)).collect();
        let reachable_facts = self.facts_of(forwards);
        let goal = forwards.beside(&goal, &reachable_facts).unwrap_or_else(|| vec![0; self.words()]);
        for fact in (0..self.facts).filter(|fact| has(&goal, *fact) && forwards.has(*fact, *fact)) {
            insert(&mut reached, fact);
            table.join(fact, &common(forwards.row(fact), &goal));
        }
        loop {
            let mut is_over = true;
            for item in limits.watch(rules.iter().zip(useless)) {
                let (rule, useless) = item?;
                let news = rule.before.len().saturating_add(rule.open.len());
                let steps = rule.before.len().saturating_add(rule.after.len()).saturating_add(news);
                let steps = steps.saturating_add(3).saturating_mul(table.words);
                let Some(remaining) = self.left.checked_sub(steps) else { return Ok(None) };
                self.left = remaining;
                if *useless {
                    continue;
                }
                let Some(mut state) = table.beside(&rule.after, &reached) else { continue };
                let Some(before) = forwards.beside(&rule.before, &reachable_facts) else { continue };
                rule.touched.iter().for_each(|variable| remove_all(&mut state, self.values(*variable)));
                let news =
                    || rule.before.iter().chain(&rule.open).copied().filter(|fact| has(&before, *fact));
                news().for_each(|fact| insert(&mut state, fact));
                let state = common(&state, &before);
                for fact in news() {
                    if table.join(fact, &common(&state, forwards.row(fact))) {
                        is_over = false;
                        insert(&mut reached, fact);
                    }
                }
            }
            if is_over {
                return Ok(Some(table));
            }
        }
    }

    fn facts_of(&self, table: &Table) -> Words {
        let mut facts = vec![0; self.words()];
        (0..self.facts).filter(|fact| table.has(*fact, *fact)).for_each(|fact| insert(&mut facts, fact));
        facts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::stubborn_sets::tests::{reachable, switches, to_go};
    use task::limits::Limits;
    use testing::adl::Generator;
    use testing::random::Random;
    use testing::{depot, ground_text};

    /// Returns the numbers of dead ends and of transitions by useless operators that were found. Checks
    /// that none of them is on a path to the goal.
    fn check(text: &(String, String)) -> Option<[usize; 2]> {
        let task = ground_text(text.clone());
        let (states, steps) = reachable(&task).filter(|_| task.unreachable.is_none())?;
        let best = to_go(&task, &states, &steps);
        let pairs = MutexPairs::new(&task, &Limits::none()).expect("no limit")?;
        // `is_dead_end` checks only pairs with a variable whose value has changed. `u32::MAX` is no
        // variable's value, so every variable counts as changed and all pairs are checked.
        let differing_values: Vec<u32> = vec![u32::MAX; task.variables.len()];
        let mut counts = [0, 0];
        for ((state, successors), goal_distance) in states.iter().zip(&steps).zip(&best) {
            let is_dead = pairs.is_dead_end(&differing_values, &state.values);
            assert!(goal_distance.is_none() || !is_dead, "{state:?} {text:?}");
            counts[0] += usize::from(is_dead);
            for (id, to, _) in successors {
                let is_useless = pairs.is_operator_useless(*id);
                assert!(goal_distance.is_none() || best[*to].is_none() || !is_useless, "{id:?} {text:?}");
                counts[1] += usize::from(is_useless);
            }
        }
        Some(counts)
    }

    fn check_all(seeds: std::ops::Range<u64>) {
        let (mut tasks, mut dead, mut useless) = (0, 0, 0);
        let least = 10 * seeds.clone().count();
        for seed in seeds {
            let mut random = Generator(Random(seed));
            let texts = [(random.domain(), random.problem()), depot(seed)];
            for text in (0..40).map(|part| switches(40 * seed + part)).chain(texts) {
                let counts = check(&text);
                tasks += usize::from(counts.is_some());
                dead += usize::from(counts.is_some_and(|[dead, _]| dead > 0));
                useless += usize::from(counts.is_some_and(|[_, useless]| useless > 0));
            }
        }
        assert!(
            tasks > least && dead > 50 && useless > 50,
            "{tasks} tasks, {dead} with dead states, {useless} with useless operators"
        );
    }

    #[test]
    fn nothing_on_a_path_to_the_goal_is_pruned() {
        check_all(0..30);
    }

    #[test]
    #[ignore = "takes minutes"]
    fn nothing_on_a_path_to_the_goal_is_pruned_in_many_tasks() {
        check_all(30..2_000);
    }

    /// A robot is below three tiles in a column. It paints neighbouring tiles and cannot enter painted tiles.
    #[test]
    fn painting_oneself_in_is_a_dead_end() {
        let domain = "(define (domain tiles) (:predicates (at ?t) (clear ?t) (painted ?t) (above ?a ?b))
            (:action move :parameters (?a ?b) :precondition (and (at ?a) (clear ?b) (or (above ?a ?b) (above ?b ?a)))
              :effect (and (not (at ?a)) (clear ?a) (at ?b) (not (clear ?b))))
            (:action paint :parameters (?a ?b) :precondition (and (at ?a) (clear ?b) (above ?b ?a))
              :effect (and (not (clear ?b)) (painted ?b)))
            (:action paint-down :parameters (?a ?b) :precondition (and (at ?a) (clear ?b) (above ?a ?b))
              :effect (and (not (clear ?b)) (painted ?b))))";
        let problem = "(define (problem p) (:domain tiles) (:objects t0 t1 t2 t3)
            (:init (at t0) (clear t1) (clear t2) (clear t3) (above t1 t0) (above t2 t1) (above t3 t2))
            (:goal (and (painted t1) (painted t2) (painted t3))))";
        let text = (domain.to_owned(), problem.to_owned());
        let task = ground_text(text.clone());
        let pairs = MutexPairs::new(&task, &Limits::none()).expect("no limit").expect("something to tell");
        for (operator, id) in task.operators.iter().zip((0..).map(OperatorId)) {
            let is_down = task.schema_names[operator.schema as usize] == "paint-down";
            assert_eq!(pairs.is_operator_useless(id), is_down, "{operator:?}");
        }
        assert!(check(&text).is_some_and(|[dead, _]| dead > 0));
    }
}
