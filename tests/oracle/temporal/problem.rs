//! Generates the problem of a random task: initial state, events, goal and measure.

use super::happening::World;
use super::make::{COST, LENGTH, LEVEL, MAYBE, Maker, always_true, constant};
use super::model::{Action, Atom, Body, Condition, Effect, Fluent, Measure, Operation, Part, Q, Term, q};
use super::sequence::Search;

impl Maker {
    fn ground_atoms(&self) -> Vec<Atom> {
        let objects = self.task.objects.len();
        let mut atoms = Vec::new();
        for predicate in (0..self.task.predicates.len()).filter(|at| !self.is_fixed(*at)) {
            let arity = self.task.predicates[predicate].1 as u32;
            for number in 0..objects.pow(arity) {
                let digit = |at: u32| Term::Object(number / objects.pow(arity - 1 - at) % objects);
                atoms.push(Atom { predicate, terms: (0..arity).map(digit).collect() });
            }
        }
        atoms
    }

    pub(super) fn initial(&mut self) {
        let atoms = self.ground_atoms();
        self.task.atoms = atoms.into_iter().filter(|_| self.chance(35)).collect();
        if let Some((predicate, kind)) = self.designs {
            for object in
                (0..self.task.objects.len()).filter(|at| self.task.objects[*at] == kind).collect::<Vec<_>>()
            {
                if self.chance(75) {
                    let terms = vec![Term::Object(object), Term::Object(0)];
                    self.task.atoms.push(Atom { predicate, terms });
                }
            }
        }
        let level = Fluent { function: LEVEL, terms: Vec::new() };
        self.task.values.push((level, q(self.random.i64(0..4))));
        for object in 0..self.task.objects.len() {
            let fluent = Fluent { function: LENGTH, terms: vec![Term::Object(object)] };
            let value = match self.flavour.unit {
                Some(unit) => unit * q(self.random.i64(0..4)),
                None => self.pick(&[q(0), q(1), q(2), q(3), Q::new(1, 2), q(10)]),
            };
            self.task.values.push((fluent, value));
        }
        if self.chance(60) {
            let maybe = Fluent { function: MAYBE, terms: Vec::new() };
            self.task.values.push((maybe, q(self.random.i64(0..3))));
        }
        self.task.values.push((Fluent { function: COST, terms: Vec::new() }, q(0)));
    }

    fn durations(&self) -> Vec<Q> {
        let world = World::new(self.task.clone());
        let duration = |(action, objects): &(usize, Vec<usize>)| match &self.task.actions[*action].body {
            Body::Durative { duration, .. } => world.value(duration, &world.initial, objects).ok(),
            Body::Instantaneous(_) => None,
        };
        let mut durations: Vec<Q> =
            world.instances.iter().filter_map(duration).filter(|d| *d > q(0)).collect();
        durations.sort_unstable();
        durations.dedup();
        durations
    }

    pub(super) fn events(&mut self) {
        if !self.chance(self.flavour.events) {
            return;
        }
        let durations = self.durations();
        if durations.is_empty() && self.chance(60) {
            return;
        }
        let atoms = self.ground_atoms();
        for _ in 0..self.random.usize(1..5) {
            // The times of events are sums of durations with a small offset, so that events and ends coincide
            // or almost coincide.
            let mut time = q(0);
            for _ in 0..self.random.usize(..3) {
                time += if durations.is_empty() {
                    self.flavour.unit.unwrap_or(q(1))
                } else {
                    self.pick(&durations)
                };
            }
            time += match self.flavour.unit {
                Some(unit) => unit * q(self.pick(&[0, 0, 1, 1, 2, -1])),
                None => self.pick(&[
                    q(0),
                    q(0),
                    q(0),
                    q(1),
                    Q::new(1, 2),
                    Q::new(-1, 2),
                    Q::new(1, 1000),
                    Q::new(-1, 1000),
                ]),
            };
            if time < q(0) || self.task.events.iter().any(|(used, _)| *used == time) {
                continue;
            }
            let mut literals: Vec<(bool, Atom)> = Vec::new();
            for _ in 0..self.pick(&[1, 1, 2]) {
                let atom = self.pick(&atoms);
                if literals.iter().all(|(_, used)| *used != atom) {
                    literals.push((self.random.bool(), atom));
                }
            }
            self.task.events.push((time, literals));
        }
        self.task.events.sort_by_key(|(time, _)| *time);
    }

    pub(super) fn goal(&mut self) {
        if self.chance(20) {
            self.task.goal = self.conjunction(&[], &[1, 1, 2]);
            return;
        }
        let world = World::new(self.task.clone());
        // The search is limited to about 40 nodes, so its states are reachable by few actions.
        let search = Search::new(&world, 40);
        // States from the second half of the search usually need more actions.
        let (state, ..) = search.nodes[self.random.usize(search.nodes.len() / 2..search.nodes.len())].clone();
        let initial = search.nodes[0].0.atoms;
        let mut literals: Vec<(bool, Atom)> = Vec::new();
        let atoms = self.ground_atoms();
        for atom in &atoms {
            let bit = 1 << world.atom(atom, &[]);
            // Facts that differ from the initial state are preferred.
            let percent = if (state.atoms ^ initial) & bit == 0 { 5 } else { 60 };
            if self.chance(percent) {
                literals.push((state.atoms & bit != 0, atom.clone()));
            }
        }
        let literal = |(positive, atom): (bool, Atom)| {
            let atom = Condition::Atom(atom);
            if positive { atom } else { Condition::Not(Box::new(atom)) }
        };
        let mut parts: Vec<_> = literals.into_iter().map(literal).collect();
        if self.chance(self.flavour.numeric / 3) {
            parts.push(self.comparison(LEVEL, 0));
        }
        if parts.is_empty() || self.chance(10) {
            parts.push(self.condition(&[], 1));
        }
        self.task.goal = Condition::All(parts);
    }

    /// With probability 30 %, adds a costly action that is always applicable and achieves the literals of the goal.
    pub(super) fn add_costly_action(&mut self) {
        let Condition::All(parts) = &self.task.goal else { return };
        let literal = |part: &Condition| match part {
            Condition::Atom(atom) => Some(Effect::Add(atom.clone())),
            Condition::Not(part) => match &**part {
                Condition::Atom(atom) => Some(Effect::Delete(atom.clone())),
                _ => None,
            },
            _ => None,
        };
        let is_changeable = |effect: &Effect| match effect {
            Effect::Add(atom) | Effect::Delete(atom) => !self.is_fixed(atom.predicate),
            _ => false,
        };
        let mut effects: Vec<_> = parts.iter().filter_map(literal).filter(is_changeable).collect();
        if !self.chance(30) {
            return;
        }
        let body = if self.flavour.durative > 0 {
            let empty = Part { condition: always_true(), effects: Vec::new() };
            let duration = constant(self.flavour.unit.unwrap_or(q(10)) * q(10));
            Body::Durative {
                duration,
                start: empty,
                over_all: always_true(),
                end: Part { condition: always_true(), effects },
            }
        } else {
            let cost = Fluent { function: COST, terms: Vec::new() };
            effects.push(Effect::Change(Operation::Increase, cost, constant(q(50))));
            Body::Instantaneous(Part { condition: always_true(), effects })
        };
        self.task.actions.push(Action { name: "dear".into(), parameters: Vec::new(), body });
    }

    /// A task has no metric only if it is clear whether plans are then measured by their time.
    pub(super) fn measure(&mut self) {
        let is_durative = |action: &&Action| matches!(action.body, Body::Durative { .. });
        let durative = self.task.actions.iter().filter(is_durative).count();
        let has_costly_durative_action = self
            .task
            .actions
            .last()
            .filter(|action| action.name == "dear")
            .is_some_and(|action| is_durative(&action));
        if self.chance(30) {
            if self.flavour.unit.is_some() || has_costly_durative_action {
                self.task.measure = Measure::Time;
                return;
            }
            if durative == 0 {
                return;
            }
        }
        let functions = vec![(q(1), COST)];
        let weights = [q(1), q(2), Q::new(1, 2), q(100)];
        let (time, functions) = match self.random.u8(..10) {
            0..4 if durative > 0 => (q(1), Vec::new()),
            4..6 if durative > 0 => (self.pick(&weights), functions),
            6 if self.flavour.unit.is_none() => (q(0), vec![(self.pick(&weights), COST), (q(1), LEVEL)]),
            _ => (q(0), vec![(self.pick(&weights), COST)]),
        };
        let maximize = self.flavour.unit.is_none() && self.chance(8);
        self.task.measure = Measure::Metric { maximize, time, functions };
    }
}
