//! Expresses the task in terms of the PDDL files: translates its variables, numbers, conditions and
//! rules to formulas over atoms and fluents.

use std::collections::BTreeMap;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::faithful::axioms::Axioms;
use crate::faithful::formula::{DEPTH_LIMIT, Formula, Structure};
use crate::faithful::invariant::Invariant;
use crate::faithful::key::Key;
use crate::faithful::linear::Linear;
use crate::faithful::reader;
use crate::faithful::verdict::{Cause, Difference, Obstacle};
use crate::faithful::world::World;
use crate::model::{self, Condition, Fact, Literal, Model};

const SIZE_LIMIT: usize = 200_000;

/// Upper limit on the number of parts of the rules of derived variables, after unfolding, in total.
const TOTAL_LIMIT: usize = 16 * SIZE_LIMIT;

type Result<T> = std::result::Result<T, Obstacle>;

pub(super) struct Names {
    /// For each variable and value, the atom; `None` for the last value of a variable, and for a derived variable
    /// that represents no derived atom of the PDDL files.
    keys: Vec<Vec<Option<Key>>>,
    facts: FxHashMap<Key, Fact>,
    pub(super) fluents: Vec<Key>,
    pub(super) numbers: FxHashMap<Key, u32>,
    pub(super) structure: Structure,
    pub(super) linked: FxHashSet<Key>,
    layers: FxHashMap<u32, usize>,
}

fn form<T>(reason: impl Into<String>) -> Result<T> {
    Err(Difference::Form { reason: reason.into() }.into())
}

impl Names {
    pub(super) fn new(world: &World<'_>, model: &Model) -> Result<Self> {
        let mut names = Self {
            keys: Vec::new(),
            facts: FxHashMap::default(),
            fluents: Vec::new(),
            numbers: FxHashMap::default(),
            structure: Structure::default(),
            linked: FxHashSet::default(),
            layers: FxHashMap::default(),
        };
        for (variable, values) in (0..).zip(&model.variables) {
            let is_basic = (variable as usize) < model.basic;
            if !is_basic && values.len() != 2 {
                return form("a derived variable that has not two values");
            }
            let mut keys = Vec::new();
            let atoms = values.split_last().map_or(&[][..], |(_, atoms)| atoms);
            for (value, text) in (0..).zip(atoms) {
                let key = world.written(text);
                let is_derived = |key: &Key| world.rules(key.0).is_some();
                let changes = |key: &Key| world.changes(key.0) && !is_derived(key);
                if is_basic && !key.as_ref().is_some_and(changes) {
                    return form(format!("{text} is not an atom of the files that actions can change"));
                }
                let key = key.filter(|key| is_basic || is_derived(key));
                if let Some(key) = &key {
                    if names.facts.insert(key.clone(), (variable, value)).is_some() {
                        return form(format!("{text} is the value of two variables"));
                    }
                    if is_basic {
                        names.structure.groups.entry(key.clone()).or_default().push(variable);
                    } else {
                        names.linked.insert(key.clone());
                    }
                }
                keys.push(key);
            }
            keys.push(None);
            names.keys.push(keys);
        }
        let scale = model.number_scale.to_rational();
        for (number, text) in (0..).zip(&model.fluents) {
            let Some(key) = world.written(text) else {
                return form(format!("{text} is not a fluent of the files"));
            };
            names.structure.integers.insert(key.clone(), scale.clone());
            if names.numbers.insert(key.clone(), number).is_some() {
                return form(format!("{text} is two numbers"));
            }
            names.fluents.push(key);
        }
        names.layers(model)?;
        Ok(names)
    }

    /// Records the layer of each derived variable and checks that the axioms are stratified. A rule
    /// may read derived variables of lower layers, and of its own layer if they are not negated.
    fn layers(&mut self, model: &Model) -> Result<()> {
        for (layer, rules) in model.axioms.iter().enumerate() {
            for (head, _) in &rules.rules {
                if self.layers.insert(head.0, layer).is_some_and(|other| other != layer) {
                    return form("a derived variable in two layers");
                }
            }
        }
        for (layer, rules) in model.axioms.iter().enumerate() {
            for (_, body) in &rules.rules {
                let facts = body.facts.iter().map(|fact| (*fact, true));
                for (fact, positive) in facts.chain(body.clauses.iter().flatten().copied()) {
                    let below = self.layers.get(&fact.0);
                    let holds = positive == (fact.1 == 0);
                    if below.is_some_and(|below| *below > layer || *below == layer && !holds) {
                        return form("a rule that reads a derived variable before it has its value");
                    }
                }
            }
        }
        Ok(())
    }

    pub(super) fn fact(&self, key: &Key) -> Option<Fact> {
        self.facts.get(key).copied()
    }

    pub(super) fn key(&self, fact: Fact) -> Option<&Key> {
        self.keys[fact.0 as usize][fact.1 as usize].as_ref()
    }

    pub(super) fn atoms(&self, variable: u32) -> impl Iterator<Item = (u32, &Key)> {
        (0..).zip(&self.keys[variable as usize]).filter_map(|(value, key)| Some((value, key.as_ref()?)))
    }
}

pub(super) struct Translation<'t> {
    pub(super) world: &'t World<'t>,
    pub(super) model: &'t Model,
    pub(super) names: &'t Names,
    pub(super) invariant: &'t Invariant,
    pub(super) axioms: &'t Axioms,
    possible: Vec<Vec<(u32, &'t Key)>>,
    /// The formulas that replace derived variables whose atoms are not in `Axioms::linked`.
    unfolded: BTreeMap<u32, Formula>,
    bodies: FxHashMap<u32, Vec<&'t Condition>>,
}

impl<'t> Translation<'t> {
    pub(super) fn new(
        world: &'t World<'t>,
        model: &'t Model,
        names: &'t Names,
        invariant: &'t Invariant,
        axioms: &'t Axioms,
    ) -> Result<Self> {
        let possible =
            |(variable, _)| names.atoms(variable).filter(|(_, key)| invariant.may_hold(key)).collect();
        let possible = (0..).zip(&model.variables).map(possible).collect();
        let mut bodies: FxHashMap<u32, Vec<&Condition>> = FxHashMap::default();
        for (head, body) in model.axioms.iter().flat_map(|layer| &layer.rules) {
            bodies.entry(head.0).or_default().push(body);
        }
        let unfolded = BTreeMap::new();
        let mut translation = Self { world, model, names, invariant, axioms, possible, unfolded, bodies };
        let mut total = 0;
        for variable in model.derived_variables() {
            translation.unfold(variable, &mut total)?;
        }
        Ok(translation)
    }

    pub(super) fn possible(&self, variable: u32) -> impl Iterator<Item = (u32, &'t Key)> {
        self.possible[variable as usize].iter().copied()
    }

    fn is_linked(&self, variable: u32) -> bool {
        self.names.key((variable, 0)).is_some_and(|key| self.axioms.linked.contains(key))
    }

    fn needs_unfolding(&self, variable: u32) -> bool {
        (variable as usize) >= self.model.basic
            && !self.is_linked(variable)
            && !self.unfolded.contains_key(&variable)
    }

    /// Computes the formula that replaces a derived variable. The formulas of the variables that its rules read
    /// are computed first.
    fn unfold(&mut self, variable: u32, total: &mut usize) -> Result<()> {
        let mut above = FxHashSet::default();
        // The stack of a depth-first search: each variable, and `true` once its dependencies are
        // finished.
        let mut open = vec![(variable, false)];
        while let Some((variable, is_ready)) = open.pop() {
            if !self.needs_unfolding(variable) {
                continue;
            }
            if is_ready {
                above.remove(&variable);
                self.replace(variable, total)?;
                continue;
            }
            if !above.insert(variable) {
                return Err(Cause::unsupported("a condition of the task that depends on itself").into());
            }
            open.push((variable, true));
            open.extend(self.read_by(variable).map(|below| (below, false)));
        }
        Ok(())
    }

    fn read_by(&self, variable: u32) -> impl Iterator<Item = u32> {
        self.bodies(variable).flat_map(|body| {
            let clauses = body.clauses.iter().flatten().map(|((variable, _), _)| *variable);
            body.facts.iter().map(|fact| fact.0).chain(clauses)
        })
    }

    fn replace(&mut self, variable: u32, total: &mut usize) -> Result<()> {
        let sizes = self.read_by(variable).map(|below| self.unfolded.get(&below).map_or(1, Formula::size));
        let size = sizes.fold(0, usize::saturating_add);
        *total = total.saturating_add(size);
        let what = "parts of conditions of the task".to_owned();
        if size > SIZE_LIMIT {
            return Err(Cause::TooMany { what, limit: SIZE_LIMIT }.into());
        }
        if *total > TOTAL_LIMIT {
            return Err(Cause::TooMany { what, limit: TOTAL_LIMIT }.into());
        }
        let formula = self.rules(variable);
        if formula.depth() > DEPTH_LIMIT {
            let what = "levels of a condition of the task".to_owned();
            return Err(Cause::TooMany { what, limit: DEPTH_LIMIT }.into());
        }
        self.unfolded.insert(variable, formula);
        Ok(())
    }

    fn bodies(&self, variable: u32) -> impl Iterator<Item = &'t Condition> + '_ {
        self.bodies.get(&variable).into_iter().flatten().copied()
    }

    pub(super) fn rules(&self, variable: u32) -> Formula {
        Formula::junction(self.bodies(variable).map(|body| self.condition(body, &[], &[])), false)
    }

    fn fact(&self, (variable, value): Fact) -> Formula {
        let last_value = self.model.none(variable);
        if value == last_value {
            let negations = (0..last_value).map(|value| self.fact((variable, value)).negated());
            return Formula::junction(negations, true);
        }
        if let Some(unfolded) = self.unfolded.get(&variable) {
            return unfolded.clone();
        }
        match self.names.key((variable, value)) {
            Some(key) if (variable as usize) >= self.model.basic => Formula::Atom(key.clone(), true),
            Some(key) => reader::atom(self.world, self.invariant, key.clone(), true),
            None => Formula::truth(false),
        }
    }

    fn literal(&self, (fact, positive): &Literal) -> Formula {
        let formula = self.fact(*fact);
        if *positive { formula } else { formula.negated() }
    }

    pub(super) fn literals(&self, literals: &[Literal], all: bool) -> Formula {
        Formula::junction(literals.iter().map(|literal| self.literal(literal)), all)
    }

    /// Translates a condition of the task, given a choice of designs. `sizes` are the numbers of
    /// designs of the slots.
    pub(super) fn condition(&self, condition: &Condition, choice: &[u32], sizes: &[usize]) -> Formula {
        let facts = condition.facts.iter().map(|fact| self.fact(*fact));
        let clauses = condition.clauses.iter().map(|clause| self.literals(clause, false));
        let comparisons = condition.comparisons.iter().map(|linear| {
            let linear = self.linear(linear, choice, sizes);
            self.invariant.compare(&linear, false)
        });
        Formula::junction(facts.chain(clauses).chain(comparisons), true)
    }

    fn linear(&self, linear: &model::Linear, choice: &[u32], sizes: &[usize]) -> Linear {
        let scale = self.model.number_scale.to_rational();
        let mut sum = Linear::constant(self.model.quantity(&linear.quantity, choice, sizes).to_rational());
        for (number, factor) in &linear.factors {
            let fluent = Linear::fluent(self.names.fluents[*number as usize].clone());
            sum = sum.plus(&fluent, &(factor.to_rational() * &scale));
        }
        sum
    }

    /// Returns the new value of a fluent if the corresponding number of the task becomes `linear`.
    pub(super) fn value(&self, linear: &model::Linear, choice: &[u32], sizes: &[usize]) -> Linear {
        let value = self.linear(linear, choice, sizes).times(&self.model.number_scale.to_rational().recip());
        self.invariant.settled(&value)
    }
}
