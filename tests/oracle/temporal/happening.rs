//! Semantics of one happening. Conditions, `when` conditions and operands are evaluated in the preceding
//! state, and all active effects apply at once. Two happenings interfere depending on the facts and numbers
//! that they read and write.

use std::collections::HashMap;

use num_traits::Zero as _;

use super::model::{Action, Atom, Body, Effect, Expression, Fluent, Operation, Part, Q, Task, Term, q};

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Obstacle {
    Blocked(&'static str),
    /// A number exceeds the range of the oracle, so the result is unknown.
    TooLarge,
}

pub const UNDEFINED: Obstacle = Obstacle::Blocked("a value is undefined");

pub type Atoms = u128;

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct State {
    /// The true atoms of predicates that are not derived.
    pub atoms: Atoms,
    pub values: Vec<Option<Q>>,
}

/// Combination of all changes of a number by one happening.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    Add(Q),
    Scale(Q),
    Assign(Q),
}

/// Facts and numbers that a happening reads, and the changes by its active effects.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Happening {
    pub reads: Atoms,
    pub reads_values: u64,
    pub adds: Atoms,
    pub deletes: Atoms,
    pub changes: Vec<(usize, Change)>,
}

#[derive(Debug)]
pub struct World {
    pub task: Task,
    /// Number of the first ground atom of each predicate.
    pub(super) atoms: Vec<usize>,
    /// Number of the first instance of each function.
    pub(super) values: Vec<usize>,
    pub(super) depends: HashMap<usize, (Atoms, u64)>,
    /// Ground actions: number of the action schema, and arguments.
    pub instances: Vec<(usize, Vec<usize>)>,
    pub initial: State,
    /// Times and changes of the timed initial literals, in order of time.
    pub events: Vec<(Q, Happening)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Start,
    Finish,
    /// Start and end together, of an instantaneous action or an action of duration 0.
    Both,
}

/// Returns the number if its numerator and denominator are below 2^30, so that no operation on two such
/// numbers overflows.
pub fn fit(value: Q) -> Result<Q, Obstacle> {
    let limit = 1 << 30;
    if value.numer().abs() < limit && *value.denom() < limit { Ok(value) } else { Err(Obstacle::TooLarge) }
}

impl Happening {
    fn writes(&self) -> Atoms {
        self.adds | self.deletes
    }

    pub fn interferes(&self, other: &Self) -> bool {
        let atoms = self.writes() & other.reads
            | other.writes() & self.reads
            | self.adds & other.deletes
            | self.deletes & other.adds;
        let reads_changed = |reader: &Self, writer: &Self| {
            writer.changes.iter().any(|(value, _)| reader.reads_values & (1 << value) != 0)
        };
        let conflicting_changes = self.changes.iter().any(|(value, change)| {
            other.changes.iter().any(|(other_value, other_change)| {
                let commute = matches!(
                    (change, other_change),
                    (Change::Add(_), Change::Add(_)) | (Change::Scale(_), Change::Scale(_))
                );
                value == other_value && !commute
            })
        });
        atoms != 0 || reads_changed(self, other) || reads_changed(other, self) || conflicting_changes
    }

    pub fn apply(&self, state: &State) -> Result<State, Obstacle> {
        let mut after = state.clone();
        after.atoms = (after.atoms & !self.deletes) | self.adds;
        for (at, change) in &self.changes {
            let previous = after.values[*at];
            after.values[*at] = Some(fit(match change {
                Change::Add(amount) => previous.ok_or(UNDEFINED)? + amount,
                Change::Scale(amount) => previous.ok_or(UNDEFINED)? * amount,
                Change::Assign(value) => *value,
            })?);
        }
        Ok(after)
    }

    /// Joins two simultaneous happenings, which must not interfere.
    fn joined(mut self, other: Self) -> Result<Self, Obstacle> {
        self.reads |= other.reads;
        self.reads_values |= other.reads_values;
        self.adds |= other.adds;
        self.deletes |= other.deletes;
        for (at, change) in other.changes {
            match (self.changes.iter_mut().find(|(value, _)| *value == at), change) {
                (Some((_, Change::Add(sum))), Change::Add(amount)) => *sum = fit(*sum + amount)?,
                (Some((_, Change::Scale(product))), Change::Scale(amount)) => {
                    *product = fit(*product * amount)?;
                }
                _ => self.changes.push((at, change)),
            }
        }
        Ok(self)
    }
}

impl World {
    pub fn new(task: Task) -> Self {
        let objects = task.objects.len();
        let offsets = |list: &[(String, usize)]| {
            let mut next = 0;
            let offset = |(_, arity): &(String, usize)| {
                let first = next;
                next += objects.pow(*arity as u32);
                first
            };
            (list.iter().map(offset).collect::<Vec<_>>(), next)
        };
        let (atoms, _) = offsets(&task.predicates);
        let (values, total_values) = offsets(&task.functions);
        assert!(task.is_small(), "the generator makes small tasks");
        let initial = State { atoms: 0, values: vec![None; total_values] };
        let (depends, instances, events) = (HashMap::new(), Vec::new(), Vec::new());
        let mut world = Self { task, atoms, values, depends, instances, initial, events };
        for atom in &world.task.atoms {
            world.initial.atoms |= 1 << world.atom(atom, &[]);
        }
        for (fluent, value) in &world.task.values {
            let at = world.value_index(fluent, &[]);
            world.initial.values[at] = Some(*value);
        }
        world.depends = world.dependencies();
        world.instances = world.ground();
        world.events =
            world.task.events.iter().map(|(time, literals)| (*time, world.event(literals))).collect();
        world
    }

    fn event(&self, literals: &[(bool, Atom)]) -> Happening {
        let mut event = Happening::default();
        for (positive, atom) in literals {
            *(if *positive { &mut event.adds } else { &mut event.deletes }) |= 1 << self.atom(atom, &[]);
        }
        event
    }

    fn ground(&self) -> Vec<(usize, Vec<usize>)> {
        let mut instances = Vec::new();
        for (action, schema) in self.task.actions.iter().enumerate() {
            let mut rows = vec![Vec::new()];
            for kind in &schema.parameters {
                let extend = |row: &Vec<usize>| {
                    self.of_type(*kind).map(|object| [&row[..], &[object]].concat()).collect::<Vec<_>>()
                };
                rows = rows.iter().flat_map(extend).collect();
            }
            instances.extend(rows.into_iter().map(|row| (action, row)));
        }
        instances
    }

    pub(super) fn of_type(&self, kind: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.task.objects.len()).filter(move |object| self.task.objects[*object] == kind)
    }

    pub(super) fn index(&self, first: usize, terms: &[Term], bound: &[usize]) -> usize {
        let object = |term: &Term| match term {
            Term::Var(depth) => bound[*depth],
            Term::Object(object) => *object,
        };
        first + terms.iter().fold(0, |index, term| index * self.task.objects.len() + object(term))
    }

    pub fn atom(&self, atom: &Atom, bound: &[usize]) -> usize {
        self.index(self.atoms[atom.predicate], &atom.terms, bound)
    }

    pub fn value_index(&self, fluent: &Fluent, bound: &[usize]) -> usize {
        self.index(self.values[fluent.function], &fluent.terms, bound)
    }

    /// Returns the number of the only instance of a function without arguments.
    pub fn value_of(&self, function: usize) -> usize {
        self.values[function]
    }

    /// Returns the happening of an end of an instance. Fails if a condition does not hold in `state`.
    pub fn happening(&self, instance: usize, end: End, state: &State) -> Result<Happening, Obstacle> {
        let (action, bound) = &self.instances[instance];
        let action: &Action = &self.task.actions[*action];
        match (&action.body, end) {
            (Body::Durative { start, duration, .. }, End::Start) => {
                self.start_happening(start, duration, state, bound)
            }
            (Body::Instantaneous(part), _) | (Body::Durative { end: part, .. }, End::Finish) => {
                self.part(part, state, bound)
            }
            (Body::Durative { start, duration, end, .. }, End::Both) => {
                let start = self.start_happening(start, duration, state, bound)?;
                let end = self.part(end, state, bound)?;
                if start.interferes(&end) {
                    return Err(Obstacle::Blocked("start and end of an action of duration 0 interfere"));
                }
                start.joined(end)
            }
        }
    }

    /// Returns the happening of a start, which also reads the numbers that determine the duration.
    fn start_happening(
        &self,
        start: &Part,
        duration: &Expression,
        state: &State,
        bound: &[usize],
    ) -> Result<Happening, Obstacle> {
        let mut happening = self.part(start, state, bound)?;
        self.read_values(duration, bound, &mut happening);
        Ok(happening)
    }

    fn part(&self, part: &Part, state: &State, bound: &[usize]) -> Result<Happening, Obstacle> {
        let atoms = self.derived(state)?;
        let mut happening = Happening::default();
        let mut bound = bound.to_vec();
        self.read(&part.condition, &mut bound, &mut happening);
        if !self.holds_with(&part.condition, atoms, state, &mut bound)? {
            return Err(Obstacle::Blocked("a condition does not hold"));
        }
        let mut effects = Vec::new();
        for effect in &part.effects {
            self.effect(effect, true, (atoms, state), &mut bound, &mut happening, &mut effects)?;
        }
        happening.changes = combined(&effects)?;
        for (at, change) in &happening.changes {
            if !matches!(change, Change::Assign(_)) && state.values[*at].is_none() {
                return Err(UNDEFINED);
            }
        }
        Ok(happening)
    }

    /// Adds the reads of an effect to the happening, and its changes if the effect is active.
    fn effect(
        &self,
        effect: &Effect,
        active: bool,
        (atoms, state): (Atoms, &State),
        bound: &mut Vec<usize>,
        happening: &mut Happening,
        changes: &mut Vec<(usize, Operation, Q)>,
    ) -> Result<(), Obstacle> {
        match effect {
            Effect::Add(atom) if active => happening.adds |= 1 << self.atom(atom, bound),
            Effect::Delete(atom) if active => happening.deletes |= 1 << self.atom(atom, bound),
            Effect::Add(_) | Effect::Delete(_) => {}
            Effect::Change(operation, fluent, expression) => {
                self.read_values(expression, bound, happening);
                if active {
                    let value = self.value(expression, state, bound)?;
                    changes.push((self.value_index(fluent, bound), *operation, value));
                }
            }
            Effect::When(condition, parts) => {
                self.read(condition, bound, happening);
                let active = active && self.holds_with(condition, atoms, state, bound)?;
                for part in parts {
                    self.effect(part, active, (atoms, state), bound, happening, changes)?;
                }
            }
            Effect::Forall(kind, parts) => {
                for object in self.of_type(*kind).collect::<Vec<_>>() {
                    bound.push(object);
                    for part in parts {
                        self.effect(part, active, (atoms, state), bound, happening, changes)?;
                    }
                    bound.pop();
                }
            }
        }
        Ok(())
    }
}

/// Combines the active numeric effects of one happening to one change per number. Fails if the
/// effects conflict or divide by zero.
fn combined(effects: &[(usize, Operation, Q)]) -> Result<Vec<(usize, Change)>, Obstacle> {
    let mut changes: Vec<(usize, Change)> = Vec::new();
    for (at, operation, value) in effects {
        let change = match operation {
            Operation::Increase => Change::Add(*value),
            Operation::Decrease => Change::Add(-*value),
            Operation::ScaleUp => Change::Scale(*value),
            Operation::ScaleDown if value.is_zero() => return Err(UNDEFINED),
            Operation::ScaleDown => Change::Scale(q(1) / value),
            Operation::Assign => Change::Assign(*value),
        };
        let Some((_, sum)) = changes.iter_mut().find(|(value, _)| value == at) else {
            changes.push((*at, change));
            continue;
        };
        match (sum, change) {
            (Change::Add(sum), Change::Add(amount)) => *sum = fit(*sum + amount)?,
            (Change::Scale(product), Change::Scale(amount)) => *product = fit(*product * amount)?,
            (Change::Assign(value), Change::Assign(second)) if *value == second => {}
            _ => return Err(Obstacle::Blocked("effects contradict each other")),
        }
    }
    Ok(changes)
}
