//! Landmarks of a task and their orders, found by backchaining from the goal \[1\].
//!
//! A fact A that is a condition of all possible first achievers of a landmark B is a landmark, too. A is then
//! ordered before B by a greedy-necessary order. If each achiever of B requires a fact of one predicate, the
//! disjunction of these facts is a landmark. If B is unreachable in the relaxation without A, A comes before
//! B. A reasonable order delays a landmark that would have to be destroyed to achieve another landmark; such
//! orders only guide the search.
//!
//! \[1\] S. Richter, M. Westphal: The LAMA planner, JAIR 39, 2010, section 4.

use rustc_hash::{FxHashMap, FxHashSet};
use task::limits::{Interrupted, Limits};
use task::number::dense;
use task::task::number::TaskNumber;
use task::task::{Fact, Task};

use crate::satisfice::delete_relaxation::{NO_OPERATOR, Proposition, Relaxation};

const MAX_DISJUNCTION: usize = 4;
const MAX_LANDMARKS: usize = 500;
/// Limit on the number of landmarks times the number of propositions and nodes of the relaxation.
const MAX_WORK: usize = 400_000_000;

/// A landmark: in every plan, at least one of its propositions is true at some time.
#[derive(Debug, Clone)]
pub(super) struct Landmark {
    pub(super) any_of: Vec<Proposition>,
    /// Landmarks ordered before this landmark, by sound or reasonable orders.
    pub(super) after: Vec<u32>,
    /// Landmarks that require this landmark directly before they are first achieved
    /// (greedy-necessary orders).
    pub(super) needed_by: Vec<u32>,
    pub(super) is_goal: bool,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Landmarks {
    pub(super) all: Vec<Landmark>,
}

struct LandmarkFactory<'a, N> {
    task: &'a Task<N>,
    relaxation: &'a Relaxation<N>,
    adders: Vec<Vec<u32>>,
    initial: Vec<bool>,
    all: Vec<Landmark>,
    known: FxHashMap<Vec<Proposition>, u32>,
    /// Orders between landmarks, as pairs (earlier, later).
    orders: FxHashSet<(u32, u32)>,
    needed: FxHashSet<(u32, u32)>,
    exclusive: FxHashMap<Proposition, Vec<usize>>,
}

impl Landmarks {
    pub(super) fn new<N: TaskNumber>(
        task: &Task<N>,
        relaxation: &Relaxation<N>,
        limits: &Limits,
    ) -> Result<Self, Interrupted> {
        let mut adders = vec![Vec::new(); relaxation.propositions];
        for (effects, node) in relaxation.effects.iter().zip(0..) {
            for effect in effects {
                adders[*effect as usize].push(node);
            }
        }
        let mut initial = vec![false; relaxation.propositions];
        for proposition in relaxation.facts(&task.initial.values).chain(relaxation.always.iter().copied()) {
            initial[proposition as usize] = true;
        }
        let mut exclusive: FxHashMap<Proposition, Vec<usize>> = FxHashMap::default();
        for (group, number) in task.exclusive.iter().zip(0..) {
            for fact in group {
                exclusive.entry(relaxation.fact(*fact)).or_default().push(number);
            }
        }
        let mut finder = LandmarkFactory {
            task,
            relaxation,
            adders,
            initial,
            all: Vec::new(),
            known: FxHashMap::default(),
            orders: FxHashSet::default(),
            needed: FxHashSet::default(),
            exclusive,
        };
        finder.find(limits)?;
        finder.reasonable(limits)?;
        Ok(finder.finish())
    }
}

impl<N: TaskNumber> LandmarkFactory<'_, N> {
    fn find(&mut self, limits: &Limits) -> Result<(), Interrupted> {
        for goal in &self.relaxation.goals {
            self.add(vec![*goal], true);
        }
        let max_landmarks = MAX_WORK
            .checked_div(self.relaxation.propositions.saturating_add(self.relaxation.operators.len()));
        let max_landmarks = max_landmarks.unwrap_or(MAX_LANDMARKS).min(MAX_LANDMARKS);
        let mut next: u32 = 0;
        while (next as usize) < self.all.len() {
            limits.check()?;
            if self.all.len() < max_landmarks {
                self.before(next);
            }
            next = next.saturating_add(1);
        }
        Ok(())
    }

    fn add(&mut self, mut any_of: Vec<Proposition>, is_goal: bool) -> u32 {
        any_of.sort_unstable();
        any_of.dedup();
        if let Some(landmark) = self.known.get(&any_of) {
            if is_goal {
                self.all[*landmark as usize].is_goal = true;
            }
            return *landmark;
        }
        let index = dense(self.all.len());
        self.known.insert(any_of.clone(), index);
        self.all.push(Landmark { any_of, after: Vec::new(), needed_by: Vec::new(), is_goal });
        index
    }

    /// Finds landmarks that must hold before `landmark`, and adds their orders. Also orders `landmark` before
    /// the known landmarks that are unreachable without it. Does nothing if `landmark` holds initially.
    fn before(&mut self, landmark: u32) {
        let propositions = self.all[landmark as usize].any_of.clone();
        // A landmark that holds initially needs no achiever.
        if propositions.iter().any(|proposition| self.initial[*proposition as usize]) {
            return;
        }
        let (reached, enabled) = self.reach_without(&propositions);
        for (candidate, index) in self.all.iter().zip(0..) {
            if index != landmark && candidate.any_of.iter().all(|proposition| !reached[*proposition as usize])
            {
                self.orders.insert((landmark, index));
            }
        }
        let achievers: Vec<u32> = propositions
            .iter()
            .flat_map(|proposition| &self.adders[*proposition as usize])
            .copied()
            .filter(|node| enabled[*node as usize])
            .collect();
        let Some((first, others)) = achievers.split_first() else { return };
        let mut shared: Vec<Proposition> = self.relaxation.conditions.of(*first).to_vec();
        for node in others {
            let conditions = self.relaxation.conditions.of(*node);
            shared.retain(|condition| conditions.binary_search(condition).is_ok());
        }
        for condition in &shared {
            if self.relaxation.fact_of(*condition).is_some() {
                self.order(vec![*condition], landmark);
            }
        }
        self.disjunctive(&achievers, &shared, landmark);
    }

    fn order(&mut self, any_of: Vec<Proposition>, before: u32) {
        let landmark = self.add(any_of, false);
        if landmark != before {
            self.orders.insert((landmark, before));
            self.needed.insert((landmark, before));
        }
    }

    /// Adds disjunctive landmarks that come before `landmark`: sets of 2 to `MAX_DISJUNCTION` facts of
    /// one predicate, none of them initially true. Each of the `achievers` of `landmark` requires a
    /// fact of each set. The conditions `shared` by all achievers are not used.
    fn disjunctive(&mut self, achievers: &[u32], shared: &[Proposition], landmark: u32) {
        if achievers.len() < 2 {
            return;
        }
        let mut sets: Option<FxHashMap<&str, Vec<Proposition>>> = None;
        for node in achievers {
            let mut facts_by_predicate: FxHashMap<&str, Vec<Proposition>> = FxHashMap::default();
            for condition in self.relaxation.conditions.of(*node) {
                if let Some(fact) = self.relaxation.fact_of(*condition)
                    && !shared.contains(condition)
                {
                    facts_by_predicate.entry(predicate(self.task, fact)).or_default().push(*condition);
                }
            }
            sets = Some(match sets.take() {
                None => facts_by_predicate,
                Some(previous) => previous
                    .into_iter()
                    .filter_map(|(name, mut facts)| {
                        facts.extend(facts_by_predicate.get(name)?);
                        facts.sort_unstable();
                        facts.dedup();
                        (facts.len() <= MAX_DISJUNCTION).then_some((name, facts))
                    })
                    .collect(),
            });
        }
        let mut sets: Vec<Vec<Proposition>> = sets.into_iter().flatten().map(|(_, facts)| facts).collect();
        sets.retain(|facts| {
            (2..=MAX_DISJUNCTION).contains(&facts.len())
                && !facts.iter().any(|fact| self.initial[*fact as usize])
        });
        sets.sort();
        for facts in sets {
            self.order(facts, landmark);
        }
    }

    /// Computes relaxed reachability if the propositions `excluded` are never true. Returns for
    /// each proposition whether it is reached, and for each node whether all its conditions are
    /// reached.
    fn reach_without(&self, excluded: &[Proposition]) -> (Vec<bool>, Vec<bool>) {
        let relaxation = self.relaxation;
        let mut reached = vec![false; relaxation.propositions];
        let mut unreached_conditions: Vec<u32> =
            relaxation.conditions.iter().map(|list| dense(list.len())).collect();
        let mut enabled = vec![false; unreached_conditions.len()];
        let mut open: Vec<Proposition> = Vec::new();
        for (is_initial, proposition) in self.initial.iter().zip(0..) {
            if *is_initial && !excluded.contains(&proposition) {
                reached[proposition as usize] = true;
                open.push(proposition);
            }
        }
        // Numeric comparisons are assumed to be reached. This can miss landmarks, but never adds wrong ones.
        for (_, _, proposition) in relaxation.directions.iter().flat_map(|direction| &direction.thresholds) {
            if !excluded.contains(proposition) {
                reached[*proposition as usize] = true;
                open.push(*proposition);
            }
        }
        let mut ready: Vec<u32> = (0..dense(unreached_conditions.len()))
            .filter(|node| unreached_conditions[*node as usize] == 0)
            .collect();
        loop {
            while let Some(node) = ready.pop() {
                enabled[node as usize] = true;
                for effect in relaxation.effects.of(node) {
                    if !reached[*effect as usize] && !excluded.contains(effect) {
                        reached[*effect as usize] = true;
                        open.push(*effect);
                    }
                }
            }
            let Some(proposition) = open.pop() else { break };
            for node in relaxation.waiting.of(proposition) {
                let count = &mut unreached_conditions[*node as usize];
                *count = count.saturating_sub(1);
                if *count == 0 {
                    ready.push(*node);
                }
            }
        }
        (reached, enabled)
    }

    fn reasonable(&mut self, limits: &Limits) -> Result<(), Interrupted> {
        let indices = 0..dense(self.all.len());
        let sides: Vec<Vec<Proposition>> = indices.clone().map(|landmark| self.side(landmark)).collect();
        let goals: Vec<u32> = indices.filter(|landmark| self.all[*landmark as usize].is_goal).collect();
        let pairs = goals.iter().flat_map(|later| goals.iter().map(move |sooner| (*sooner, *later)));
        let mut needed: Vec<(u32, u32)> = self.needed.iter().copied().collect();
        needed.sort_unstable();
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.all.len()];
        for (sooner, later) in &self.orders {
            before[*later as usize].push(*sooner);
        }
        for predecessors in &mut before {
            predecessors.sort_unstable();
        }
        let indirect = needed
            .iter()
            .flat_map(|(later, common)| before[*common as usize].iter().map(move |sooner| (*sooner, *later)));
        let mut reach = closure(self.all.len(), &self.orders);
        for pair in limits.watch(pairs.chain(indirect)) {
            let (sooner, later) = pair?;
            if sooner == later
                // An order that would close a cycle is not added.
                || has(&reach[later as usize], sooner)
                || self.orders.contains(&(sooner, later))
            {
                continue;
            }
            let [proposition] = self.all[later as usize].any_of[..] else { continue };
            if sides[sooner as usize].iter().any(|effect| self.are_mutex(*effect, proposition)) {
                self.orders.insert((sooner, later));
                connect(&mut reach, sooner, later);
            }
        }
        Ok(())
    }

    /// Returns propositions that are true when a landmark is achieved or directly before: the landmark, the
    /// common effects of all its achievers, and the facts that it requires by greedy-necessary orders
    /// (except disjunctions). Empty for a disjunctive landmark.
    fn side(&self, landmark: u32) -> Vec<Proposition> {
        let [proposition] = self.all[landmark as usize].any_of[..] else { return Vec::new() };
        let mut achievers = self.adders[proposition as usize].iter();
        let mut side = achievers.next().map_or_else(Vec::new, |start| self.all_effects(*start));
        for node in achievers {
            let effects = self.all_effects(*node);
            side.retain(|effect| effects.contains(effect));
        }
        side.push(proposition);
        for (needed, by) in &self.needed {
            if *by == landmark && self.all[*needed as usize].any_of.len() == 1 {
                side.extend(&self.all[*needed as usize].any_of);
            }
        }
        side.sort_unstable();
        side.dedup();
        side
    }

    fn all_effects(&self, node: u32) -> Vec<Proposition> {
        let mut effects = self.relaxation.effects.of(node).to_vec();
        let operator = self.relaxation.operators[node as usize];
        if operator != NO_OPERATOR {
            let operator = &self.task.operators[operator as usize];
            effects.extend(operator.effects.iter().map(|fact| self.relaxation.fact(*fact)));
        }
        effects
    }

    fn are_mutex(&self, one: Proposition, other: Proposition) -> bool {
        if one == other {
            return false;
        }
        let fact = |proposition| self.relaxation.fact_of(proposition);
        let is_same_variable =
            matches!((fact(one), fact(other)), (Some(a), Some(b)) if a.variable == b.variable);
        let groups = |proposition| self.exclusive.get(&proposition).map_or(&[][..], Vec::as_slice);
        is_same_variable || groups(one).iter().any(|group| groups(other).contains(group))
    }

    fn finish(mut self) -> Landmarks {
        let mut orders: Vec<(u32, u32)> = self.orders.into_iter().collect();
        orders.sort_unstable();
        for (sooner, later) in orders {
            self.all[later as usize].after.push(sooner);
        }
        let mut needed: Vec<(u32, u32)> = self.needed.into_iter().collect();
        needed.sort_unstable();
        for (needed, by) in needed {
            self.all[needed as usize].needed_by.push(by);
        }
        Landmarks { all: self.all }
    }
}

/// Returns the transitive closure of the orders: for each landmark, a bitset of the landmarks ordered after
/// it.
fn closure(count: usize, orders: &FxHashSet<(u32, u32)>) -> Vec<Vec<u64>> {
    let mut reach = vec![vec![0_u64; count.div_ceil(64)]; count];
    for (sooner, later) in orders {
        reach[*sooner as usize][(later >> 6) as usize] |= 1 << (later & 63);
    }
    for middle in 0..dense(count) {
        let further = reach[middle as usize].clone();
        join(&mut reach, middle, &further);
    }
    reach
}

fn has(words: &[u64], landmark: u32) -> bool {
    words[(landmark >> 6) as usize] >> (landmark & 63) & 1 == 1
}

/// Adds the landmarks in `further` to the successors of every landmark that is ordered before `landmark`.
fn join(reach: &mut [Vec<u64>], landmark: u32, further: &[u64]) {
    for successors in reach.iter_mut().filter(|successors| has(successors, landmark)) {
        for (word, more) in successors.iter_mut().zip(further) {
            *word |= more;
        }
    }
}

fn connect(reach: &mut [Vec<u64>], sooner: u32, later: u32) {
    let mut further = reach[later as usize].clone();
    further[(later >> 6) as usize] |= 1 << (later & 63);
    for (word, more) in reach[sooner as usize].iter_mut().zip(&further) {
        *word |= more;
    }
    join(reach, sooner, &further);
}

fn predicate<N>(task: &Task<N>, fact: Fact) -> &str {
    let name = &task.variables[fact.variable.index()].values[fact.value as usize];
    name.split([' ', '(', ')']).find(|word| !word.is_empty()).unwrap_or(name)
}
