//! Atoms to finite-domain variables, rationals to integers: the last step of grounding.

use std::collections::BTreeMap;
use std::hash::BuildHasher;
use std::sync::Arc;

use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use smallvec::SmallVec;

use crate::error::Error;
use crate::ground::Generality;
use crate::ground::derived::components;
use crate::ground::evaluate::AtomId;
use crate::ground::events::Timing;
use crate::ground::instantiate::{GroundOperator, GroundSlots, GroundTask};
use crate::ground::integers::{Denominator, Integers};
use crate::ground::metric::initial_value;
use crate::ground::mutex;
use crate::ground::normal_form::{GroundCondition, GroundLiteral};
use crate::ground::prune::{atom_name, numeric_name, read_atoms};
use crate::lifted::{Lifted, ObjectId, Rational};
use crate::limits::{Interrupted, Limits};
use crate::number::{checked_lcm, dense};
use crate::quantity::{Linear, NumericId, Quantity};
use crate::task::{
    Axiom, Condition, ConditionalEffect, Fact, Layer, Literal, NumericEffect, Objective, Operator, Slot,
    SlotId, SlotUse, State, Task, Variable, VariableId,
};
use crate::task_number::TaskNumber;

/// Builds the final task.
///
/// # Errors
/// `Error::Overflow` if exact integers would not fit.
pub(crate) fn finish<N: TaskNumber>(
    lifted: &Lifted,
    mut task: GroundTask<'_>,
    unreachable: Option<String>,
    generality: &Generality,
    limits: &Limits,
) -> Result<Task<N>, Error> {
    let atoms = Atoms::new(lifted, &task, limits)?;
    let mut numbers = Numbers::<N>::new(lifted, &task, generality)?;
    let (mut objectives, mut costs) = objectives::<N>(lifted, &task)?;
    let mut durations = Denominator::new("durations");
    for operator in limits.watch(&task.operators) {
        let operator = operator?;
        durations.quantity(&operator.duration);
        durations.note(|| schema_name(lifted, operator));
        let bounds = [&operator.timing.start, &operator.timing.end].into_iter().flatten();
        operator.wait.iter().chain(bounds.map(|(time, _)| time)).for_each(|time| durations.number(time));
    }
    let mut durations = durations.integers::<N>()?;
    let mut slots = Slots::new(&task.operators);

    let mut operators = Distinct::with_capacity(task.operators.len());
    for ground in limits.watch(std::mem::take(&mut task.operators)) {
        let ground = ground?;
        let name = schema_name(lifted, &ground);
        let kinds = (&mut numbers, &mut costs[..], &mut durations);
        let finished = operator(ground, &atoms, &mut slots, kinds).map_err(|error| error.within(&name))?;
        if let Some(operator) = finished {
            operators.insert(operator);
        }
    }
    let goal = match &task.goal {
        Some(goal) => condition(goal, &atoms, &mut numbers)?,
        None => Condition::default(),
    };
    let exclusive =
        || contradictory(&goal).then(|| "the goal asks for atoms that exclude each other".to_owned());
    let unreachable = unreachable.or_else(exclusive);
    let axioms = atoms.axioms(&task, &mut numbers)?;
    let mut task = Task {
        object_names: lifted.objects.iter().map(ToString::to_string).collect(),
        schema_names: lifted.schemas.iter().map(|schema| schema.name.to_string()).collect(),
        basic: atoms.basic,
        variables: atoms.variables,
        exclusive: atoms.exclusive,
        number_names: std::mem::take(&mut numbers.names),
        number_scale: numbers.integers.scale,
        axioms,
        initial: State { values: atoms.initial, numbers: std::mem::take(&mut numbers.initial) },
        slots: slots.all,
        operators: operators.operators,
        goal,
        objective: objectives.remove(0),
        others: objectives,
        time_scale: durations.scale,
        unreachable,
    };
    let mut initial = std::mem::replace(&mut task.initial, State { values: Vec::new(), numbers: Vec::new() });
    task.close(&mut initial);
    task.initial = initial;
    Ok(task)
}

/// An operator of the final task; none if its condition contradicts itself.
fn operator<N: TaskNumber>(
    ground: GroundOperator,
    atoms: &Atoms,
    slots: &mut Slots,
    (numbers, costs, durations): (&mut Numbers<N>, &mut [Integers<N>], &mut Integers<N>),
) -> Result<Option<Operator<N>>, Error> {
    let condition = condition(&ground.condition, atoms, numbers)?;
    if contradictory(&condition) {
        return Ok(None);
    }
    let by_objective = ground.costs.iter().zip(costs);
    let mut by_objective = by_objective.map(|(cost, integers)| integers.quantity(cost));
    Ok(Some(Operator {
        schema: ground.schema,
        slots: slots.uses(&ground.slots),
        condition,
        effects: atoms.effects(&ground),
        conditional: atoms.conditional(&ground),
        numeric_effects: numbers.effects(&ground)?,
        cost: by_objective.next().unwrap_or_else(|| Ok(Quantity::constant(N::one())))?,
        others: by_objective.collect::<Result<_, _>>()?,
        duration: durations.quantity(&ground.duration)?,
        arguments: ground.arguments,
        configuration: ground.configuration,
        forbidden: ground.forbidden,
        wait: ground.wait.map(|time| durations.number(&time)).transpose()?,
        timing: Timing {
            start: ground.timing.start.map(|(time, _)| durations.number(&time)).transpose()?,
            end: ground.timing.end.map(|(time, _)| durations.number(&time)).transpose()?,
        },
    }))
}

/// The action of an operator, for errors.
fn schema_name(lifted: &Lifted, operator: &GroundOperator) -> String {
    let schema = lifted.schemas.get(operator.schema as usize);
    schema.map_or_else(|| "a wait".to_owned(), |schema| format!("`{}`", schema.name))
}

/// Operators without repetitions, in order.
struct Distinct<N> {
    operators: Vec<Operator<N>>,
    /// Positions by hash.
    positions: FxHashMap<u64, SmallVec<[u32; 2]>>,
}

impl<N: TaskNumber> Distinct<N> {
    fn with_capacity(capacity: usize) -> Self {
        let mut positions = FxHashMap::default();
        positions.reserve(capacity);
        Self { operators: Vec::with_capacity(capacity), positions }
    }

    fn insert(&mut self, operator: Operator<N>) {
        let positions = self.positions.entry(FxBuildHasher.hash_one(&operator)).or_default();
        if positions.iter().all(|position| self.operators[*position as usize] != operator) {
            positions.push(dense(self.operators.len()));
            self.operators.push(operator);
        }
    }
}

/// The objectives, and what makes integers of the costs by each.
#[expect(clippy::type_complexity, reason = "a list for each of two things")]
fn objectives<N: TaskNumber>(
    lifted: &Lifted,
    task: &GroundTask<'_>,
) -> Result<(Vec<Objective<N>>, Vec<Integers<N>>), Error> {
    let (mut objectives, mut conversions) = (Vec::new(), Vec::new());
    for (objective, position) in task.objectives.iter().zip(0..) {
        let mut denominator = Denominator::new("the metric");
        denominator.number(&objective.offset);
        denominator.note(|| "its value at the start".to_owned());
        for operator in &task.operators {
            denominator.quantity(&operator.costs[position]);
            denominator.note(|| schema_name(lifted, operator));
        }
        let integers = denominator.integers()?;
        let offset = integers.number(&objective.offset)?;
        objectives.push(Objective { scale: integers.scale, offset, maximize: objective.maximize });
        conversions.push(integers);
    }
    Ok((objectives, conversions))
}

/// The finite-domain variables and where each atom went.
struct Atoms {
    variables: Vec<Variable>,
    /// How many of them are not derived.
    basic: usize,
    initial: Vec<u32>,
    /// By atom.
    facts: Vec<Option<Fact>>,
    /// The value of each variable that stands for none of its atoms.
    none: Vec<u32>,
    /// See [`Task::exclusive`].
    exclusive: Vec<Vec<Fact>>,
}

impl Atoms {
    fn new(lifted: &Lifted, task: &GroundTask<'_>, limits: &Limits) -> Result<Self, Interrupted> {
        let mut relevant = read_atoms(task);
        let mut derived: Vec<AtomId> =
            relevant.iter().copied().filter(|atom| task.world.is_derived(*atom)).collect();
        derived.sort_unstable();
        relevant.retain(|atom| !task.world.is_derived(*atom));
        let mut exclusive = Vec::new();
        let mut groups = Vec::new();
        for group in mutex::groups(task, &relevant, limits)? {
            if group.exclusive.len() > group.atoms.len() {
                exclusive.push(group.exclusive);
            }
            groups.push(group.atoms);
        }
        let grouped: FxHashSet<AtomId> = groups.iter().flatten().copied().collect();
        groups.extend(relevant.iter().filter(|atom| !grouped.contains(atom)).map(|atom| vec![*atom]));
        groups.sort_unstable();
        let mut atoms = Self {
            variables: Vec::new(),
            basic: groups.len(),
            initial: Vec::new(),
            facts: vec![None; task.world.atoms.len()],
            none: Vec::new(),
            exclusive: Vec::new(),
        };
        groups.extend(derived.into_iter().map(|atom| vec![atom]));
        for group in limits.watch(groups) {
            let group = group?;
            let variable = VariableId::of(atoms.variables.len());
            let mut values: Vec<String> = group.iter().map(|atom| atom_name(lifted, task, *atom)).collect();
            let none = dense(values.len());
            values.push("none of these".into());
            let mut initial = none;
            for (atom, value) in group.iter().zip(0..) {
                atoms.facts[atom.index()] = Some(Fact { variable, value });
                if let Some(((predicate, arguments), ())) = task.world.atoms.get_index(atom.index())
                    && task.world.holds_initially(*predicate, arguments)
                {
                    initial = value;
                }
            }
            atoms.variables.push(Variable { values });
            atoms.initial.push(initial);
            atoms.none.push(none);
        }
        let facts = |group: Vec<AtomId>| group.into_iter().filter_map(|atom| atoms.fact(atom)).collect();
        atoms.exclusive = exclusive.into_iter().map(facts).collect();
        Ok(atoms)
    }

    fn literal(&self, (atom, positive): (AtomId, bool)) -> Literal {
        let fact = self.fact(atom).expect("invariant: atoms in conditions are read, so they have a variable");
        Literal { fact, positive }
    }

    /// What an atom is in the task; nothing if no condition reads it.
    fn fact(&self, atom: AtomId) -> Option<Fact> {
        self.facts[atom.index()]
    }

    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    fn effects(&self, operator: &GroundOperator) -> Vec<Fact> {
        let none = |fact: Fact| Fact { value: self.none[fact.variable.index()], ..fact };
        let deletes = operator.deletes.iter().filter_map(|atom| self.fact(*atom)).map(none);
        let adds = operator.adds.iter().filter_map(|atom| self.fact(*atom));
        let mut effects: Vec<Fact> = Vec::with_capacity(operator.deletes.len() + operator.adds.len());
        for fact in deletes.chain(adds) {
            match effects.iter_mut().find(|known| known.variable == fact.variable) {
                Some(known) => *known = fact,
                None => effects.push(fact),
            }
        }
        let overridden = |fact: &Fact| {
            let atoms =
                operator.conditional.iter().flat_map(|effect| effect.adds.iter().chain(&effect.deletes));
            let mut facts = atoms.filter_map(|atom| self.fact(*atom));
            facts.any(|other| other.variable == fact.variable)
        };
        let required = |fact: &Fact| {
            let literals = &operator.condition.literals;
            literals.iter().any(|(atom, positive)| *positive && self.fact(*atom) == Some(*fact))
        };
        effects.retain(|fact| !required(fact) || overridden(fact));
        effects.sort_unstable();
        effects
    }

    /// Conditional effects in the order in which they take place: what becomes false, then what becomes true. A
    /// deletion where the operator sets the same variable anyway says nothing: of two atoms of one variable only one holds.
    fn conditional(&self, operator: &GroundOperator) -> Vec<ConditionalEffect> {
        if operator.conditional.is_empty() {
            return Vec::new();
        }
        let set: FxHashSet<VariableId> =
            operator.adds.iter().filter_map(|atom| self.fact(*atom)).map(|fact| fact.variable).collect();
        let added: FxHashSet<&AtomId> = operator.adds.iter().collect();
        let entry = |condition: &[GroundLiteral], mut effects: Vec<Fact>| {
            effects.sort_unstable();
            effects.dedup();
            let condition = condition.iter().map(|literal| self.literal(*literal)).collect();
            (!effects.is_empty()).then_some(ConditionalEffect { condition, effects })
        };
        let deletes = operator.conditional.iter().filter_map(|effect| {
            let gone = effect.deletes.iter().filter_map(|atom| Some((atom, self.fact(*atom)?)));
            let gone = gone.filter(|(atom, fact)| added.contains(atom) || !set.contains(&fact.variable));
            let none = |(_, fact): (_, Fact)| Fact { value: self.none[fact.variable.index()], ..fact };
            entry(&effect.condition, gone.map(none).collect())
        });
        let adds = operator.conditional.iter().filter_map(|effect| {
            entry(&effect.condition, effect.adds.iter().filter_map(|atom| self.fact(*atom)).collect())
        });
        deletes.chain(adds).collect()
    }

    /// The rules of derived variables in layers: what a layer depends on comes before it.
    fn axioms<N: TaskNumber>(
        &self,
        task: &GroundTask<'_>,
        numbers: &mut Numbers<N>,
    ) -> Result<Vec<Layer<N>>, Error> {
        let axioms = &task.world.definitions.axioms;
        let mut layers = Vec::new();
        for component in components(axioms) {
            let mut layer = Layer { rules: Vec::new(), recursive: component.len() > 1 };
            for axiom in axioms.iter().filter(|axiom| component.binary_search(&axiom.head).is_ok()) {
                let Some(head) = self.fact(axiom.head) else { continue };
                layer.recursive |= axiom.body.atoms().any(|atom| atom == axiom.head);
                layer.rules.push(Axiom { head, body: condition(&axiom.body, self, numbers)? });
            }
            if !layer.rules.is_empty() {
                layers.push(layer);
            }
        }
        Ok(layers)
    }
}

/// The numeric variables that conditions depend on, with the factor that makes all their values integers.
struct Numbers<N> {
    initial: Vec<N>,
    names: Vec<String>,
    ids: FxHashMap<NumericId, NumericId>,
    integers: Integers<N>,
}

impl<N: TaskNumber> Numbers<N> {
    fn new(lifted: &Lifted, task: &GroundTask<'_>, generality: &Generality) -> Result<Self, Error> {
        let mut used = FxHashSet::default();
        let mut denominator = Denominator::new("numeric fluents");
        let mut note = |linear: &Linear<Rational>| {
            used.extend(linear.coefficients.iter().map(|(variable, _)| *variable));
            denominator.quantity(&linear.quantity);
        };
        for condition in task.operators.iter().map(|operator| &operator.condition).chain(&task.goal) {
            condition.comparisons.iter().for_each(|(linear, _)| note(linear));
        }
        for axiom in &task.world.definitions.axioms {
            axiom.body.comparisons.iter().for_each(|(linear, _)| note(linear));
        }
        for operator in &task.operators {
            operator.numeric_effects.iter().for_each(|(_, value)| note(value));
        }
        let mut used: Vec<_> = used.into_iter().collect();
        used.sort_unstable();
        let initial: Vec<_> = used.iter().map(|variable| initial_value(&task.world, *variable)).collect();
        denominator.note(|| "those in conditions and effects".to_owned());
        for (number, variable) in initial.iter().zip(&used) {
            denominator.number(number);
            denominator.note(|| numeric_name(lifted, task, *variable));
        }
        if let Some(precision) = generality.numbers {
            denominator.number(&Rational::new(1, precision));
        }
        let names = used.iter().map(|variable| numeric_name(lifted, task, *variable)).collect();
        let integers = denominator.integers()?;
        let initial = initial.iter().map(|number| integers.number(number)).collect::<Result<_, _>>()?;
        let ids = used.into_iter().zip((0..).map(NumericId)).collect();
        Ok(Self { initial, names, ids, integers })
    }

    fn linear(&mut self, linear: &Linear<Rational>) -> Result<Linear<N>, Error> {
        let overflow = || Error::Overflow { what: "a factor of a numeric fluent".into() };
        let coefficients = linear.coefficients.iter().map(|(variable, factor)| {
            Ok((self.ids[variable], N::from_rational(factor, 1).ok_or_else(overflow)?))
        });
        let coefficients = coefficients.collect::<Result<_, Error>>()?;
        Ok(Linear { coefficients, quantity: self.integers.quantity(&linear.quantity)? })
    }

    fn effects(&mut self, operator: &GroundOperator) -> Result<Vec<NumericEffect<N>>, Error> {
        let mut effects = Vec::new();
        for (variable, value) in operator.numeric_effects.iter() {
            if let Some(variable) = self.ids.get(variable).copied() {
                effects.push(NumericEffect { variable, value: self.linear(value)? });
            }
        }
        Ok(effects)
    }
}

#[expect(clippy::arithmetic_side_effects, reason = "above the least number of its type")]
fn condition<N: TaskNumber>(
    ground: &GroundCondition,
    atoms: &Atoms,
    numbers: &mut Numbers<N>,
) -> Result<Condition<N>, Error> {
    let mut condition = Condition::default();
    for literal in &ground.literals {
        let literal = atoms.literal(*literal);
        let none = atoms.none[literal.fact.variable.index()];
        if literal.positive {
            condition.facts.push(literal.fact);
        } else if none == 1 {
            condition.facts.push(Fact { variable: literal.fact.variable, value: none });
        } else {
            condition.clauses.push(vec![literal]);
        }
    }
    for clause in &ground.clauses {
        condition.clauses.push(clause.iter().map(|literal| atoms.literal(*literal)).collect());
    }
    for (linear, strict) in &ground.comparisons {
        if !N::SCALED {
            let list = if *strict { &mut condition.above } else { &mut condition.comparisons };
            list.push(numbers.linear(linear)?);
            continue;
        }
        let mut linear = linear.clone();
        // A comparison may be scaled at will, so fractional factors do no harm here.
        let mut denominators = linear.coefficients.iter().map(|(_, factor)| factor.denominator());
        let common = denominators.try_fold(1, |common, next| checked_lcm(common, next?));
        let common = common.ok_or_else(|| Error::Overflow { what: "a factor of a numeric fluent".into() })?;
        linear.scale(&Rational::from_integer(common));
        let mut integers = numbers.linear(&linear)?;
        if *strict {
            integers.quantity.constant = integers.quantity.constant + -N::one();
        }
        condition.comparisons.push(integers);
    }
    condition.facts.sort_unstable();
    condition.facts.dedup();
    Ok(condition)
}

/// Whether two values of one variable are required.
fn contradictory<N>(condition: &Condition<N>) -> bool {
    condition.facts.windows(2).any(|pair| pair[0].variable == pair[1].variable)
}

/// A function, and which of the operator's slots for this function it is: an action may require one twice.
type SlotKey = (ObjectId, usize);

fn slot_keys(slots: &GroundSlots) -> impl Iterator<Item = (SlotKey, &Vec<ObjectId>)> {
    slots.iter().enumerate().map(|(position, (function, suitable))| {
        let earlier = slots[..position].iter().filter(|(other, _)| other == function).count();
        ((*function, earlier), suitable)
    })
}

/// All functions whose design some operator leaves open, in the order of the objects, with all their designs.
struct Slots {
    all: Vec<Slot>,
    ids: FxHashMap<SlotKey, SlotId>,
    /// How slots are used, by where they lie: operators share them.
    uses: FxHashMap<*const (ObjectId, Vec<ObjectId>), Arc<[SlotUse]>>,
}

impl Slots {
    fn new(operators: &[GroundOperator]) -> Self {
        let mut seen = FxHashSet::default();
        let distinct = operators.iter().filter(|operator| seen.insert(operator.slots.as_ptr()));
        let mut designs: BTreeMap<SlotKey, Vec<ObjectId>> = BTreeMap::new();
        for (key, suitable) in distinct.flat_map(|operator| slot_keys(&operator.slots)) {
            designs.entry(key).or_default().extend(suitable);
        }
        let mut slots = Self { all: Vec::new(), ids: FxHashMap::default(), uses: FxHashMap::default() };
        for (key, mut designs) in designs {
            designs.sort_unstable();
            designs.dedup();
            slots.ids.insert(key, SlotId::of(slots.all.len()));
            slots.all.push(Slot { designs });
        }
        slots
    }

    fn uses(&mut self, ground: &Arc<GroundSlots>) -> Arc<[SlotUse]> {
        if let Some(known) = self.uses.get(&ground.as_ptr()) {
            return known.clone();
        }
        let uses: Arc<[SlotUse]> = slot_keys(ground)
            .map(|(key, suitable)| {
                let slot = self.ids[&key];
                let all = &self.all[slot.index()].designs;
                let designs = suitable.iter().filter_map(|design| all.binary_search(design).ok());
                SlotUse { slot, designs: designs.map(dense).collect() }
            })
            .collect();
        self.uses.insert(ground.as_ptr(), uses.clone());
        uses
    }
}
