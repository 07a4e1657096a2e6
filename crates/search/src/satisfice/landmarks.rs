//! Landmarks and their orders, found backwards from the goal \[1\].
//!
//! Each condition that all possible first achievers of a landmark share is a landmark, ordered greedily-necessary
//! before it. If each achiever requires a fact of one predicate, the disjunction of these facts is a landmark.
//! Facts that are unreachable without a landmark come after it. Reasonable orders delay a landmark that would
//! be deleted on the way to another one; they only guide the search.
//!
//! \[1\] S. Richter, M. Westphal: The LAMA planner, JAIR 39, 2010, section 4.

use rustc_hash::{FxHashMap, FxHashSet};
use task::limits::{Interrupted, Limits};
use task::number::dense;
use task::task::number::TaskNumber;
use task::task::{Fact, Task};

use crate::satisfice::delete_relaxation::{NO_OPERATOR, Proposition, Relaxation};

/// Disjunctions of more facts are not looked for.
const MAX_DISJUNCTION: usize = 4;
/// No more landmarks than these.
const MAX_LANDMARKS: usize = 500;
/// Propositions times landmarks, at most.
const MAX_WORK: usize = 400_000_000;

/// A landmark: one of its propositions.
#[derive(Debug, Clone)]
pub(super) struct Landmark {
    pub(super) any_of: Vec<Proposition>,
    /// Landmarks that come before it, as orders that hold or only guide.
    pub(super) after: Vec<u32>,
    /// Landmarks that it has to hold right before.
    pub(super) needed_by: Vec<u32>,
    pub(super) is_goal: bool,
}

/// Landmarks of a task.
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
    /// For each landmark which propositions are reached without it.
    orders: FxHashSet<(u32, u32)>,
    needed: FxHashSet<(u32, u32)>,
    exclusive: FxHashMap<Proposition, Vec<usize>>,
}

impl Landmarks {
    /// Landmarks of a task from its initial state.
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
        let most = MAX_WORK
            .checked_div(self.relaxation.propositions.saturating_add(self.relaxation.operators.len()));
        let most = most.unwrap_or(MAX_LANDMARKS).min(MAX_LANDMARKS);
        let mut next: u32 = 0;
        while (next as usize) < self.all.len() {
            limits.check()?;
            if self.all.len() < most {
                self.before(next);
            }
            next = next.saturating_add(1);
        }
        Ok(())
    }

    fn add(&mut self, mut any_of: Vec<Proposition>, is_goal: bool) -> u32 {
        any_of.sort_unstable();
        any_of.dedup();
        if let Some(known) = self.known.get(&any_of) {
            if is_goal {
                self.all[*known as usize].is_goal = true;
            }
            return *known;
        }
        let own = dense(self.all.len());
        self.known.insert(any_of.clone(), own);
        self.all.push(Landmark { any_of, after: Vec::new(), needed_by: Vec::new(), is_goal });
        own
    }

    /// Landmarks before a landmark.
    fn before(&mut self, landmark: u32) {
        let own = self.all[landmark as usize].any_of.clone();
        if own.iter().any(|proposition| self.initial[*proposition as usize]) {
            return;
        }
        let (reached, enabled) = self.reach_without(&own);
        for (other, index) in self.all.iter().zip(0..) {
            if index != landmark && other.any_of.iter().all(|proposition| !reached[*proposition as usize]) {
                self.orders.insert((landmark, index));
            }
        }
        let achievers: Vec<u32> = own
            .iter()
            .flat_map(|proposition| &self.adders[*proposition as usize])
            .copied()
            .filter(|node| enabled[*node as usize])
            .collect();
        let Some((first, rest)) = achievers.split_first() else { return };
        let mut shared: Vec<Proposition> = self.relaxation.conditions.of(*first).to_vec();
        for node in rest {
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
        let own = self.add(any_of, false);
        if own != before {
            self.orders.insert((own, before));
            self.needed.insert((own, before));
        }
    }

    /// Facts of one predicate of which each achiever requires one.
    fn disjunctive(&mut self, achievers: &[u32], shared: &[Proposition], landmark: u32) {
        if achievers.len() < 2 {
            return;
        }
        let mut sets: Option<FxHashMap<&str, Vec<Proposition>>> = None;
        for node in achievers {
            let mut own: FxHashMap<&str, Vec<Proposition>> = FxHashMap::default();
            for condition in self.relaxation.conditions.of(*node) {
                if let Some(fact) = self.relaxation.fact_of(*condition)
                    && !shared.contains(condition)
                {
                    own.entry(predicate(self.task, fact)).or_default().push(*condition);
                }
            }
            sets = Some(match sets.take() {
                None => own,
                Some(known) => known
                    .into_iter()
                    .filter_map(|(name, mut facts)| {
                        facts.extend(own.get(name)?);
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

    /// What is reached without ever reaching some propositions, and which nodes are, their own effects apart.
    fn reach_without(&self, excluded: &[Proposition]) -> (Vec<bool>, Vec<bool>) {
        let relaxation = self.relaxation;
        let mut reached = vec![false; relaxation.propositions];
        let mut left: Vec<u32> = relaxation.conditions.iter().map(|list| dense(list.len())).collect();
        let mut enabled = vec![false; left.len()];
        let mut open: Vec<Proposition> = Vec::new();
        for (held, proposition) in self.initial.iter().zip(0..) {
            if *held && !excluded.contains(&proposition) {
                reached[proposition as usize] = true;
                open.push(proposition);
            }
        }
        // Numbers are taken for reached: landmarks of facts are no fewer for what they need besides.
        for (_, _, proposition) in relaxation.directions.iter().flat_map(|direction| &direction.thresholds) {
            if !excluded.contains(proposition) {
                reached[*proposition as usize] = true;
                open.push(*proposition);
            }
        }
        let mut ready: Vec<u32> = (0..dense(left.len())).filter(|node| left[*node as usize] == 0).collect();
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
                let left = &mut left[*node as usize];
                *left = left.saturating_sub(1);
                if *left == 0 {
                    ready.push(*node);
                }
            }
        }
        (reached, enabled)
    }

    /// Orders that keep landmarks from being given up again.
    fn reasonable(&mut self, limits: &Limits) -> Result<(), Interrupted> {
        let all = 0..dense(self.all.len());
        let sides: Vec<Vec<Proposition>> = all.clone().map(|own| self.side(own)).collect();
        let goals: Vec<u32> = all.filter(|own| self.all[*own as usize].is_goal).collect();
        let pairs = goals.iter().flat_map(|later| goals.iter().map(move |sooner| (*sooner, *later)));
        let mut needed: Vec<(u32, u32)> = self.needed.iter().copied().collect();
        needed.sort_unstable();
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.all.len()];
        for (one, other) in &self.orders {
            before[*other as usize].push(*one);
        }
        for own in &mut before {
            own.sort_unstable();
        }
        let others = needed
            .iter()
            .flat_map(|(later, common)| before[*common as usize].iter().map(move |sooner| (*sooner, *later)));
        let mut reach = closure(self.all.len(), &self.orders);
        for pair in limits.watch(pairs.chain(others)) {
            let (sooner, later) = pair?;
            if sooner == later
                || has(&reach[later as usize], sooner)
                || self.orders.contains(&(sooner, later))
            {
                continue;
            }
            let [other] = self.all[later as usize].any_of[..] else { continue };
            if sides[sooner as usize].iter().any(|own| self.are_mutex(*own, other)) {
                self.orders.insert((sooner, later));
                connect(&mut reach, sooner, later);
            }
        }
        Ok(())
    }

    /// What holds when a landmark is brought about: itself, what all of its achievers bring about besides, and what is needed right before. None
    /// if it is a disjunction.
    fn side(&self, landmark: u32) -> Vec<Proposition> {
        let [one] = self.all[landmark as usize].any_of[..] else { return Vec::new() };
        let mut achievers = self.adders[one as usize].iter();
        let mut side = achievers.next().map_or_else(Vec::new, |start| self.all_effects(*start));
        for node in achievers {
            let effects = self.all_effects(*node);
            side.retain(|effect| effects.contains(effect));
        }
        side.push(one);
        for (needed, by) in &self.needed {
            if *by == landmark && self.all[*needed as usize].any_of.len() == 1 {
                side.extend(&self.all[*needed as usize].any_of);
            }
        }
        side.sort_unstable();
        side.dedup();
        side
    }

    /// The effects of a node, with those of its operator.
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
        let same = matches!((fact(one), fact(other)), (Some(a), Some(b)) if a.variable == b.variable);
        let groups = |proposition| self.exclusive.get(&proposition).map_or(&[][..], Vec::as_slice);
        same || groups(one).iter().any(|group| groups(other).contains(group))
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

/// For each landmark a bit for each that comes after it, by any number of orders.
fn closure(count: usize, orders: &FxHashSet<(u32, u32)>) -> Vec<Vec<u64>> {
    let mut reach = vec![vec![0_u64; count.div_ceil(64)]; count];
    for (one, other) in orders {
        reach[*one as usize][(other >> 6) as usize] |= 1 << (other & 63);
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

/// What leads to a landmark leads to these, too.
fn join(reach: &mut [Vec<u64>], landmark: u32, further: &[u64]) {
    for own in reach.iter_mut().filter(|own| has(own, landmark)) {
        for (word, more) in own.iter_mut().zip(further) {
            *word |= more;
        }
    }
}

/// Adds an order, and all that follows.
fn connect(reach: &mut [Vec<u64>], sooner: u32, later: u32) {
    let mut further = reach[later as usize].clone();
    further[(later >> 6) as usize] |= 1 << (later & 63);
    for (word, more) in reach[sooner as usize].iter_mut().zip(&further) {
        *word |= more;
    }
    join(reach, sooner, &further);
}

/// The predicate of a fact, as its value's name begins.
fn predicate<N>(task: &Task<N>, fact: Fact) -> &str {
    let name = &task.variables[fact.variable.index()].values[fact.value as usize];
    name.split([' ', '(', ')']).find(|word| !word.is_empty()).unwrap_or(name)
}
