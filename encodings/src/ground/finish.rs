//! Atoms to finite-domain variables, rationals to integers: the last step of grounding.

use std::collections::BTreeMap;

use num_integer::Integer;
use num_traits::ToPrimitive;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::error::Error;
use crate::ground::derived::components;
use crate::ground::evaluate::AtomId;
use crate::ground::instantiate::{GroundOperator, GroundTask};
use crate::ground::metric::initial_value;
use crate::ground::mutex;
use crate::ground::normal_form::{GroundCondition, GroundLiteral};
use crate::ground::prune::{atom_name, read_atoms};
use crate::lifted::{Lifted, ObjectId, Rational};
use crate::quantity::{Linear, NumericId, Quantity};
use crate::task::{
    Axiom, Condition, ConditionalEffect, Fact, Layer, Literal, NumericEffect, NumericVariable, Objective,
    Operator, Slot, SlotId, SlotUse, State, Task, Variable, VariableId,
};

/// Integers of a task stay below this, so that sums over a plan fit 64 bits.
const LIMIT: i64 = 1 << 46;

/// Builds the final task.
///
/// # Errors
/// `Error::Overflow` if exact integers would not fit.
pub(crate) fn finish(
    lifted: &Lifted,
    task: &GroundTask<'_>,
    unreachable: Option<String>,
) -> Result<Task, Error> {
    let atoms = Atoms::new(lifted, task);
    let mut numbers = Numbers::new(task)?;
    let mut objectives = Vec::new();
    for (objective, position) in task.objectives.iter().zip(0..) {
        let costs = task.operators.iter().flat_map(|operator| operator.costs[position].numbers());
        let scale = common_denominator(costs.chain([&objective.offset]), "the metric")?;
        let offset = integer(&objective.offset, scale, "the metric")?;
        objectives.push(Objective { scale, offset, maximize: objective.maximize });
    }
    let time_scale =
        common_denominator(task.operators.iter().flat_map(|o| o.duration.numbers()), "durations")?;
    let (slots, slot_ids) = slots(&task.operators);

    let mut operators = Vec::with_capacity(task.operators.len());
    let mut seen = FxHashSet::default();
    for operator in &task.operators {
        let costs = operator.costs.iter().zip(&objectives);
        let mut costs = costs.map(|(cost, objective)| integers(cost, objective.scale, "the metric"));
        let operator = Operator {
            schema: operator.schema,
            arguments: operator.arguments.clone(),
            configuration: operator.configuration.clone(),
            slots: slot_uses(&slots, &slot_ids, operator),
            forbidden: operator.forbidden.clone(),
            condition: condition(&operator.condition, &atoms, &numbers)?,
            effects: atoms.effects(operator),
            conditional: atoms.conditional(operator),
            numeric_effects: numbers.effects(operator)?,
            cost: costs.next().unwrap_or_else(|| Ok(Quantity::constant(1)))?,
            others: costs.collect::<Result<_, _>>()?,
            duration: integers(&operator.duration, time_scale, "durations")?,
        };
        if !contradictory(&operator.condition) && seen.insert(operator.clone()) {
            operators.push(operator);
        }
    }
    let goal = match &task.goal {
        Some(goal) => condition(goal, &atoms, &numbers)?,
        None => Condition::default(),
    };
    let exclusive =
        || contradictory(&goal).then(|| "the goal asks for atoms that exclude each other".to_owned());
    let unreachable = unreachable.or_else(exclusive);
    let axioms = atoms.axioms(task, &numbers)?;
    let mut task = Task {
        object_names: lifted.objects.iter().map(ToString::to_string).collect(),
        schema_names: lifted.schemas.iter().map(|schema| schema.name.to_string()).collect(),
        basic: atoms.basic,
        variables: atoms.variables,
        axioms,
        initial: State { values: atoms.initial, numbers: std::mem::take(&mut numbers.initial) },
        numerics: numbers.variables,
        slots,
        operators,
        goal,
        objective: objectives.remove(0),
        others: objectives,
        time_scale,
        unreachable,
    };
    let mut initial = std::mem::replace(&mut task.initial, State { values: Vec::new(), numbers: Vec::new() });
    task.close(&mut initial);
    task.initial = initial;
    Ok(task)
}

/// The finite-domain variables and where each atom went.
struct Atoms {
    variables: Vec<Variable>,
    /// How many of them are not derived.
    basic: usize,
    initial: Vec<u32>,
    facts: FxHashMap<AtomId, Fact>,
    /// The value of each variable that stands for none of its atoms.
    none: Vec<u32>,
}

impl Atoms {
    fn new(lifted: &Lifted, task: &GroundTask<'_>) -> Self {
        let mut relevant = read_atoms(task);
        let mut derived: Vec<AtomId> =
            relevant.iter().copied().filter(|atom| task.world.is_derived(*atom)).collect();
        derived.sort_unstable();
        relevant.retain(|atom| !task.world.is_derived(*atom));
        let mut groups = mutex::groups(task, &relevant);
        let grouped: FxHashSet<AtomId> = groups.iter().flatten().copied().collect();
        groups.extend(relevant.iter().filter(|atom| !grouped.contains(atom)).map(|atom| vec![*atom]));
        groups.sort_unstable();
        let mut atoms = Self {
            variables: Vec::new(),
            basic: groups.len(),
            initial: Vec::new(),
            facts: FxHashMap::default(),
            none: Vec::new(),
        };
        groups.extend(derived.into_iter().map(|atom| vec![atom]));
        for group in groups {
            let variable = VariableId(atoms.variables.len() as u32);
            let mut values: Vec<String> = group.iter().map(|atom| atom_name(lifted, task, *atom)).collect();
            let none = values.len() as u32;
            values.push("none of these".into());
            let mut initial = none;
            for (atom, value) in group.iter().zip(0..) {
                atoms.facts.insert(*atom, Fact { variable, value });
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
        atoms
    }

    fn literal(&self, (atom, positive): (AtomId, bool)) -> Literal {
        Literal { fact: self.facts[&atom], positive }
    }

    fn effects(&self, operator: &GroundOperator) -> Vec<Fact> {
        let mut effects: FxHashMap<VariableId, u32> = FxHashMap::default();
        for atom in &operator.deletes {
            if let Some(fact) = self.facts.get(atom) {
                effects.insert(fact.variable, self.none[fact.variable.index()]);
            }
        }
        for atom in &operator.adds {
            if let Some(fact) = self.facts.get(atom) {
                effects.insert(fact.variable, fact.value);
            }
        }
        let known = |fact: &Fact| {
            let overridden =
                operator.conditional.iter().flat_map(|effect| effect.adds.iter().chain(&effect.deletes));
            let overridden = overridden.filter_map(|atom| self.facts.get(atom));
            operator
                .condition
                .literals
                .iter()
                .any(|(atom, positive)| *positive && self.facts.get(atom) == Some(fact))
                && !overridden.into_iter().any(|other| other.variable == fact.variable)
        };
        let mut effects: Vec<_> =
            effects.into_iter().map(|(variable, value)| Fact { variable, value }).collect();
        effects.retain(|fact| !known(fact));
        effects.sort_unstable();
        effects
    }

    /// Conditional effects in the order in which they take place: what becomes false, then what becomes true. A
    /// deletion where the operator sets the same variable anyway says nothing: of two atoms of one variable only one holds.
    fn conditional(&self, operator: &GroundOperator) -> Vec<ConditionalEffect> {
        let set: FxHashSet<VariableId> =
            operator.adds.iter().filter_map(|atom| self.facts.get(atom)).map(|fact| fact.variable).collect();
        let added: FxHashSet<&AtomId> = operator.adds.iter().collect();
        let entry = |condition: &[GroundLiteral], mut effects: Vec<Fact>| {
            effects.sort_unstable();
            effects.dedup();
            let condition = condition.iter().map(|literal| self.literal(*literal)).collect();
            (!effects.is_empty()).then_some(ConditionalEffect { condition, effects })
        };
        let deletes = operator.conditional.iter().filter_map(|effect| {
            let gone = effect.deletes.iter().filter_map(|atom| Some((atom, self.facts.get(atom)?)));
            let gone = gone.filter(|(atom, fact)| added.contains(atom) || !set.contains(&fact.variable));
            let none = |(_, fact): (_, &Fact)| Fact { value: self.none[fact.variable.index()], ..*fact };
            entry(&effect.condition, gone.map(none).collect())
        });
        let adds = operator.conditional.iter().filter_map(|effect| {
            entry(
                &effect.condition,
                effect.adds.iter().filter_map(|atom| self.facts.get(atom)).copied().collect(),
            )
        });
        deletes.chain(adds).collect()
    }

    /// The rules of derived variables in layers: what a layer depends on comes before it.
    fn axioms(&self, task: &GroundTask<'_>, numbers: &Numbers) -> Result<Vec<Layer>, Error> {
        let axioms = &task.world.definitions.axioms;
        let mut layers = Vec::new();
        for component in components(axioms) {
            let mut layer = Layer { rules: Vec::new(), recursive: component.len() > 1 };
            for axiom in axioms.iter().filter(|axiom| component.binary_search(&axiom.head).is_ok()) {
                let Some(head) = self.facts.get(&axiom.head) else { continue };
                layer.recursive |= axiom.body.atoms().any(|atom| atom == axiom.head);
                layer.rules.push(Axiom { head: *head, body: condition(&axiom.body, self, numbers)? });
            }
            if !layer.rules.is_empty() {
                layers.push(layer);
            }
        }
        Ok(layers)
    }
}

/// The numeric variables that conditions depend on, each with the factor that makes all its values integers.
struct Numbers {
    variables: Vec<NumericVariable>,
    initial: Vec<i64>,
    ids: FxHashMap<NumericId, NumericId>,
}

impl Numbers {
    fn new(task: &GroundTask<'_>) -> Result<Self, Error> {
        let mut used = FxHashSet::default();
        let mut rationals: Vec<Rational> = Vec::new();
        let mut note = |linear: &Linear<Rational>| {
            used.extend(linear.coefficients.iter().map(|(variable, _)| *variable));
            rationals.extend(linear.quantity.numbers());
        };
        for condition in task.operators.iter().map(|operator| &operator.condition).chain(&task.goal) {
            condition.comparisons.iter().for_each(|(linear, _)| note(linear));
        }
        for axiom in &task.world.definitions.axioms {
            axiom.body.comparisons.iter().for_each(|(linear, _)| note(linear));
        }
        for operator in &task.operators {
            operator.numeric_effects.values().for_each(&mut note);
        }
        let mut used: Vec<_> = used.into_iter().collect();
        used.sort_unstable();
        let initial: Vec<_> = used.iter().map(|variable| initial_value(&task.world, *variable)).collect();
        let scale = common_denominator(rationals.iter().chain(&initial), "numeric fluents")?;
        let mut numbers = Self { variables: Vec::new(), initial: Vec::new(), ids: FxHashMap::default() };
        for (variable, initial) in used.iter().zip(&initial) {
            numbers.ids.insert(*variable, NumericId(numbers.variables.len() as u32));
            numbers.variables.push(NumericVariable { scale });
            numbers.initial.push(integer(initial, scale, "numeric fluents")?);
        }
        Ok(numbers)
    }

    fn scale(&self) -> i64 {
        self.variables.first().map_or(1, |variable| variable.scale)
    }

    fn linear(&self, linear: &Linear<Rational>) -> Result<Linear<i64>, Error> {
        let overflow = || Error::Overflow { what: "a factor of a numeric fluent".into() };
        let coefficients = linear.coefficients.iter().map(|(variable, factor)| {
            let factor = if factor.is_integer() { factor.to_integer().to_i64() } else { None };
            Ok((self.ids[variable], factor.ok_or_else(overflow)?))
        });
        let quantity = integers(&linear.quantity, self.scale(), "numeric fluents")?;
        Ok(Linear { coefficients: coefficients.collect::<Result<_, Error>>()?, quantity })
    }

    fn effects(&self, operator: &GroundOperator) -> Result<Vec<NumericEffect>, Error> {
        let effects = operator.numeric_effects.iter().filter(|(variable, _)| self.ids.contains_key(variable));
        effects
            .map(|(variable, value)| {
                Ok(NumericEffect { variable: self.ids[variable], value: self.linear(value)? })
            })
            .collect()
    }
}

fn condition(ground: &GroundCondition, atoms: &Atoms, numbers: &Numbers) -> Result<Condition, Error> {
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
        let mut linear = linear.clone();
        // A comparison may be scaled at will, so fractional factors do no harm here.
        let denominators = linear.coefficients.iter().map(|(_, factor)| *factor.denom());
        linear.scale(&Rational::from_integer(denominators.fold(1, |lcm: i128, d| lcm.lcm(&d))));
        let mut integers = numbers.linear(&linear)?;
        if *strict {
            integers.quantity.constant -= 1;
        }
        condition.comparisons.push(integers);
    }
    condition.facts.sort_unstable();
    condition.facts.dedup();
    Ok(condition)
}

/// Whether two values of one variable are required.
fn contradictory(condition: &Condition) -> bool {
    condition.facts.windows(2).any(|pair| pair[0].variable == pair[1].variable)
}

/// A function, and which of the operator's slots for this function it is: an action may require one twice.
type SlotKey = (ObjectId, usize);

fn slot_keys(operator: &GroundOperator) -> impl Iterator<Item = (SlotKey, &Vec<ObjectId>)> {
    let slots = operator.slots.iter().enumerate();
    slots.map(|(position, (function, suitable))| {
        let earlier = operator.slots[..position].iter().filter(|(other, _)| other == function).count();
        ((*function, earlier), suitable)
    })
}

/// All functions whose design some operator leaves open, in the order of the objects, with all their designs.
fn slots(operators: &[GroundOperator]) -> (Vec<Slot>, FxHashMap<SlotKey, SlotId>) {
    let mut designs: BTreeMap<SlotKey, Vec<ObjectId>> = BTreeMap::new();
    for (key, suitable) in operators.iter().flat_map(slot_keys) {
        designs.entry(key).or_default().extend(suitable);
    }
    let (mut slots, mut ids) = (Vec::new(), FxHashMap::default());
    for (key, mut designs) in designs {
        designs.sort_unstable();
        designs.dedup();
        ids.insert(key, SlotId(slots.len() as u32));
        slots.push(Slot { designs });
    }
    (slots, ids)
}

fn slot_uses(slots: &[Slot], ids: &FxHashMap<SlotKey, SlotId>, operator: &GroundOperator) -> Vec<SlotUse> {
    let mut uses = Vec::new();
    for (key, suitable) in slot_keys(operator) {
        let slot = ids[&key];
        let all = &slots[slot.index()].designs;
        let designs =
            suitable.iter().filter_map(|design| all.binary_search(design).ok()).map(|i| i as u16).collect();
        uses.push(SlotUse { slot, designs });
    }
    uses
}

fn common_denominator<'a>(numbers: impl Iterator<Item = &'a Rational>, what: &str) -> Result<i64, Error> {
    let mut scale: i128 = 1;
    for number in numbers {
        scale = scale.lcm(number.denom());
        if scale > i128::from(LIMIT) {
            return Err(Error::Overflow { what: what.into() });
        }
    }
    Ok(scale as i64)
}

fn integer(number: &Rational, scale: i64, what: &str) -> Result<i64, Error> {
    let scaled = number * Rational::from_integer(i128::from(scale));
    match scaled.to_integer().to_i64() {
        Some(integer) if scaled.is_integer() && integer.abs() < LIMIT => Ok(integer),
        _ => Err(Error::Overflow { what: what.into() }),
    }
}

fn integers(quantity: &Quantity<Rational>, scale: i64, what: &str) -> Result<Quantity<i64>, Error> {
    quantity
        .map(|number| integer(number, scale, what).ok())
        .ok_or_else(|| Error::Overflow { what: what.into() })
}
