//! What the files say against what the task says: initial states, goals, and each instance of an action against the
//! operator that stands for it.

use std::collections::{BTreeMap, BTreeSet};

use num_rational::BigRational;
use num_traits::{Signed, Zero};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::certificate::faithful::Obstacle;
use crate::certificate::faithful::linear::Linear;
use crate::certificate::faithful::meaning::{self, Meaning, TOTAL_TIME};
use crate::certificate::faithful::world::{Key, World};
use crate::certificate::model::{self, Argument, Condition, Fact, Literal, Model, Operator};
use crate::pddl::ast::{Action, Direction};

type Result<T> = std::result::Result<T, Obstacle>;

fn wrong<T>(reason: impl Into<String>) -> Result<T> {
    Err(Obstacle::Wrong(reason.into()))
}

fn unknown<T>(reason: impl Into<String>) -> Result<T> {
    Err(Obstacle::Unknown(reason.into()))
}

fn integer(number: impl Into<i128>) -> BigRational {
    BigRational::from_integer(number.into().into())
}

pub(super) struct Comparison<'c> {
    world: &'c World<'c>,
    model: &'c Model,
    /// By atom and fluent as written, in small letters.
    facts: FxHashMap<String, Fact>,
    numbers: FxHashMap<String, u32>,
    schemas: FxHashMap<String, u32>,
    objects: FxHashMap<String, u32>,
    /// By schema and arguments; none for a slot.
    operators: FxHashMap<(u32, Vec<Option<u32>>), Vec<usize>>,
    /// Which arguments of a schema are slots.
    masks: FxHashMap<u32, BTreeSet<Vec<bool>>>,
    /// None if plans are measured by time or length.
    metric: Option<Linear>,
    pub(super) timed: bool,
}

impl<'c> Comparison<'c> {
    pub(super) fn new(world: &'c World<'c>, model: &'c Model) -> Result<Self> {
        let by_name =
            |names: &[String]| (0..).zip(names).map(|(own, name)| (name.to_ascii_lowercase(), own)).collect();
        let mut facts = FxHashMap::default();
        for (variable, values) in (0..).zip(&model.variables) {
            let atoms = &values[..values.len() - 1];
            facts
                .extend((0..).zip(atoms).map(|(value, atom)| (atom.to_ascii_lowercase(), (variable, value))));
        }
        let mut operators: FxHashMap<_, Vec<usize>> = FxHashMap::default();
        let mut masks: FxHashMap<u32, BTreeSet<Vec<bool>>> = FxHashMap::default();
        for (position, operator) in model.operators.iter().enumerate() {
            if operator.wait.is_some() || !operator.conditional.is_empty() {
                return unknown("waits and conditional effects");
            }
            let object = |argument: &Argument| match argument {
                Argument::Object(object) => Some(*object),
                Argument::Slot(_) => None,
            };
            let arguments: Vec<Option<u32>> = operator.arguments.iter().map(object).collect();
            let mask = arguments.iter().map(Option::is_none).collect();
            masks.entry(operator.schema).or_default().insert(mask);
            operators.entry((operator.schema, arguments)).or_default().push(position);
        }
        if !model.axioms.is_empty() || model.objective.maximize {
            return unknown("derived predicates and metrics to be maximized");
        }
        let metric = match &world.problem.metric {
            Some(metric) if metric.direction == Direction::Maximize => {
                return unknown("metrics to be maximized");
            }
            Some(metric) => {
                let linear = meaning::metric(world, &metric.expression).map_err(Obstacle::Unknown)?;
                Some(linear.ok_or_else(|| Obstacle::Unknown("a metric without a value".into()))?)
            }
            None => None,
        };
        let step = model::Quantity { constant: model.objective.scale, tables: Vec::new() };
        Ok(Self {
            world,
            model,
            facts,
            numbers: by_name(&model.fluents),
            schemas: by_name(&model.schemas),
            objects: by_name(&model.objects),
            operators,
            masks,
            metric,
            timed: model.operators.iter().any(|operator| operator.cost != step),
        })
    }

    fn fact(&self, key: &Key) -> Option<Fact> {
        self.facts.get(&self.world.show(key)).copied()
    }

    fn initial_value(&self, key: &Key) -> Result<BigRational> {
        match self.world.initial_value(key) {
            Some(value) => Ok(value.clone()),
            None if *key == TOTAL_TIME || self.world.name(key.0) == "total-cost" => Ok(BigRational::zero()),
            None => unknown(format!("{}, which has no initial value", self.world.show(key))),
        }
    }

    pub(super) fn initial(&self) -> Result<()> {
        let none = |values: &Vec<String>| values.len() as u32 - 1;
        let mut values: Vec<u32> = self.model.variables.iter().map(none).collect();
        for key in self.world.initial_atoms() {
            if let Some((variable, value)) = self.fact(&key) {
                let own = &mut values[variable as usize];
                if *own != none(&self.model.variables[variable as usize]) {
                    return wrong(format!("two values of variable {variable} hold at first"));
                }
                *own = value;
            }
        }
        if let Some(variable) = (0..values.len()).find(|own| values[*own] != self.model.values[*own]) {
            return wrong(format!("variable {variable} has another value at first"));
        }
        let mut known = FxHashSet::default();
        let values = self.world.problem.init.iter().filter_map(|element| match element {
            crate::pddl::ast::InitialElement::Value(atom, value, _) => Some((atom, value)),
            _ => None,
        });
        for (atom, value) in values {
            let key = self.world.key(atom, &FxHashMap::default()).map_err(Obstacle::Unknown)?;
            if let Some(number) = self.numbers.get(&self.world.show(&key)) {
                known.insert(*number);
                if integer(self.model.numbers[*number as usize]) != value * integer(self.model.number_scale) {
                    return wrong(format!("{} has another value at first", self.world.show(&key)));
                }
            }
        }
        for (number, fluent) in (0..).zip(&self.model.fluents) {
            let is_cost = fluent.eq_ignore_ascii_case("(total-cost)");
            let is_known = known.contains(&number) || is_cost && self.model.numbers[number as usize] == 0;
            if !is_known {
                return unknown(format!("the number {fluent}, which is no fluent of the problem"));
            }
        }
        let offset = match &self.metric {
            None => BigRational::zero(),
            Some(metric) => {
                let mut sum = metric.constant.clone();
                for (key, factor) in &metric.factors {
                    sum += factor * self.initial_value(key)?;
                }
                sum
            }
        };
        if integer(self.model.objective.offset) != offset * integer(self.model.objective.scale) {
            return wrong("the metric has another value at first");
        }
        Ok(())
    }

    /// The goal of the files implies that of the task, which may also know that nothing reaches it.
    pub(super) fn goal(&self, reached: &FxHashSet<Key>) -> Result<()> {
        let goal = Meaning::of_goal(self.world, &self.world.problem.goal).map_err(Obstacle::Unknown)?;
        let Some(goal) = goal else { return Ok(()) };
        if goal.positive.iter().any(|key| !reached.contains(key)) {
            return Ok(());
        }
        if self.model.goal.clauses.iter().any(Vec::is_empty) {
            return unknown("a goal that is out of reach for other reasons than deletions");
        }
        self.implies(&goal, &self.model.goal, (&[], &[]))
            .or_else(|reason| wrong(format!("the goal: {reason}")))
    }

    /// Whether what an instance requires implies a condition of an operator with a choice of designs.
    fn implies(
        &self,
        meaning: &Meaning,
        condition: &Condition,
        (choice, sizes): (&[u32], &[usize]),
    ) -> std::result::Result<(), String> {
        let known = Known::new(self, meaning);
        if let Some(fact) = condition.facts.iter().find(|fact| !known.fact(**fact)) {
            return Err(format!("{} is required", self.model.variables[fact.0 as usize][fact.1 as usize]));
        }
        if !condition.clauses.iter().all(|clause| clause.iter().any(|literal| known.literal(literal))) {
            return Err("a clause is required".into());
        }
        for linear in &condition.comparisons {
            let constant = self.model.quantity(&linear.quantity, choice, sizes);
            let factors: BTreeMap<u32, BigRational> =
                linear.factors.iter().map(|(number, factor)| (*number, integer(*factor))).collect();
            if factors.is_empty() && constant >= 0 {
                continue;
            }
            let implied = |(own, strict): &(Linear, bool)| self.implied(own, *strict, &factors, constant);
            if !meaning.comparisons.iter().any(implied) {
                return Err("a comparison is required".into());
            }
        }
        Ok(())
    }

    /// A linear expression over fluents as one over numbers; none where the task does not know a fluent.
    fn over_numbers(&self, linear: &Linear) -> Option<(BTreeMap<u32, BigRational>, BigRational)> {
        let scale = integer(self.model.number_scale);
        let number = |(key, factor): (&Key, &BigRational)| {
            Some((*self.numbers.get(&self.world.show(key))?, factor.clone()))
        };
        let factors = linear.factors.iter().map(number).collect::<Option<_>>()?;
        Some((factors, &linear.constant * scale))
    }

    /// Whether a comparison that holds implies that factors times numbers plus a constant are at least 0. Numbers
    /// are integers.
    fn implied(
        &self,
        holds: &Linear,
        strict: bool,
        factors: &BTreeMap<u32, BigRational>,
        constant: i128,
    ) -> bool {
        let Some((own, least)) = self.over_numbers(holds) else { return false };
        let ((Some((number, first)), true), false) =
            ((own.iter().next(), own.len() == factors.len()), own.is_empty())
        else {
            return false;
        };
        let Some(wanted) = factors.get(number) else { return false };
        let ratio = wanted / first;
        let same = own
            .iter()
            .all(|(number, factor)| factors.get(number).is_some_and(|other| *other == factor * &ratio));
        if !ratio.is_positive() || !same || !factors.values().all(BigRational::is_integer) {
            return false;
        }
        // The sum of numbers is an integer, and at least (or more than) this.
        let bound = -(least * ratio);
        let bound = if strict { bound.floor() + integer(1) } else { bound.ceil() };
        bound + integer(constant) >= BigRational::zero()
    }

    /// Looks for an operator that does what an instance does; `false` if there is none, and none is needed because the
    /// instance changes nothing that the task knows.
    pub(super) fn instance(&self, action: &Action, arguments: &[u32], meaning: &Meaning) -> Result<bool> {
        let mut together: Vec<u32> =
            meaning.positive.iter().filter_map(|key| Some(self.fact(key)?.0)).collect();
        together.sort_unstable();
        if together.windows(2).any(|pair| pair[0] == pair[1]) {
            // Of two values of a variable at most one holds.
            return Ok(false);
        }
        let cost = self.cost(meaning)?;
        let mut reason = "no operator stands for it".to_owned();
        for (operator, choice) in self.candidates(action, arguments) {
            match self.simulates(operator, &choice, meaning, &cost) {
                Ok(()) => return Ok(true),
                Err(other) => reason = other,
            }
        }
        let knows_atom = |(key, holds): (&Key, &bool)| {
            let before = if *holds { &meaning.positive } else { &meaning.negative };
            !before.contains(key) && self.fact(key).is_some()
        };
        let knows_number = |key: &Key| self.numbers.contains_key(&self.world.show(key));
        if !meaning.truths.iter().any(knows_atom)
            && !meaning.changes.keys().any(knows_number)
            && !cost.is_negative()
        {
            return Ok(false);
        }
        let call = (u32::MAX, arguments.to_vec());
        let objects = self.world.show(&call).trim_start_matches("(?").to_owned();
        let text = format!("({}{objects}: {reason}", action.identifier.name);
        // Grounding knows more about what can become of numbers, and of atoms.
        if reason.starts_with("no operator") { unknown(text) } else { wrong(text) }
    }

    /// What an instance adds to the metric.
    fn cost(&self, meaning: &Meaning) -> Result<BigRational> {
        let duration = meaning.duration.clone().unwrap_or_else(BigRational::zero);
        let Some(metric) = &self.metric else {
            return Ok(if self.timed { duration } else { integer(1) });
        };
        let mut sum = Linear::constant(BigRational::zero());
        for (key, factor) in &metric.factors {
            if *key == TOTAL_TIME {
                sum.constant += &duration * factor;
            } else if let Some(after) = meaning.changes.get(key) {
                let growth = after.clone().plus(&Linear::fluent(key.clone()), &integer(-1));
                sum = sum.plus(&growth, factor);
            }
        }
        match sum.value() {
            Some(cost) => Ok(cost.clone()),
            None => unknown("costs that depend on the state"),
        }
    }

    /// Operators with a choice of designs that have these arguments.
    fn candidates(&self, action: &Action, arguments: &[u32]) -> Vec<(&'c Operator, Vec<u32>)> {
        let name = action.identifier.name.as_str().to_ascii_lowercase();
        let object = |object: &u32| self.objects.get(&self.world.name(*object).to_ascii_lowercase()).copied();
        let objects: Option<Vec<u32>> = arguments.iter().map(object).collect();
        let (Some(schema), Some(objects)) = (self.schemas.get(&name), objects) else { return Vec::new() };
        let mut found = Vec::new();
        for mask in self.masks.get(schema).into_iter().flatten().filter(|mask| mask.len() == objects.len()) {
            let pattern = objects.iter().zip(mask).map(|(object, open)| (!open).then_some(*object)).collect();
            for position in self.operators.get(&(*schema, pattern)).into_iter().flatten() {
                let operator = &self.model.operators[*position];
                found.extend(self.choice(operator, &objects).map(|choice| (operator, choice)));
            }
        }
        found
    }

    /// The choice of designs that gives an operator its arguments, if it admits that.
    fn choice(&self, operator: &Operator, objects: &[u32]) -> Option<Vec<u32>> {
        let uses = &self.model.uses[operator.uses as usize];
        let mut choice: Vec<Option<u32>> = vec![None; uses.len()];
        for (argument, object) in operator.arguments.iter().zip(objects) {
            let Argument::Slot(place) = argument else { continue };
            let (slot, designs) = uses.get(*place as usize)?;
            let all = &self.model.slots[*slot as usize];
            let position = designs.iter().position(|design| all[*design as usize] == *object)? as u32;
            let own = &mut choice[*place as usize];
            if own.is_some_and(|other| other != position) {
                return None;
            }
            *own = Some(position);
        }
        let choice: Vec<u32> = choice.into_iter().collect::<Option<_>>()?;
        let excluded = self.model.exclusions[operator.exclusions as usize].iter().any(|exclusion| {
            let chosen: Vec<u32> = exclusion.slots.iter().map(|slot| choice[*slot as usize]).collect();
            exclusion.combinations.contains(&chosen)
        });
        (!excluded).then_some(choice)
    }

    fn simulates(
        &self,
        operator: &Operator,
        choice: &[u32],
        meaning: &Meaning,
        cost: &BigRational,
    ) -> std::result::Result<(), String> {
        let sizes = self.model.sizes(operator);
        self.implies(meaning, &operator.condition, (choice, &sizes))?;
        self.same_effects(operator, meaning)?;
        for (number, fluent) in (0..).zip(&self.model.fluents) {
            let change = operator.changes.iter().find(|(own, _)| *own == number).map(|(_, value)| value);
            let meant = meaning
                .changes
                .iter()
                .find(|(key, _)| self.numbers.get(&self.world.show(key)) == Some(&number));
            let identity = (BTreeMap::from([(number, integer(1))]), BigRational::zero());
            let expected = match meant {
                Some((_, linear)) => {
                    self.over_numbers(linear).ok_or("a change by what the task does not know")?
                }
                None => identity.clone(),
            };
            let found = match change {
                Some(value) => {
                    let factors = value.factors.iter().map(|(own, factor)| (*own, integer(*factor)));
                    (factors.collect(), integer(self.model.quantity(&value.quantity, choice, &sizes)))
                }
                None => identity,
            };
            if expected != found {
                return Err(format!("{fluent} changes otherwise"));
            }
        }
        let own = self.model.quantity(&operator.cost, choice, &sizes);
        if integer(own) > cost * integer(self.model.objective.scale) {
            return Err(format!("it costs {cost}, the operator more"));
        }
        Ok(())
    }

    /// Every variable has the value afterwards that its atoms say, and at most one of these holds.
    fn same_effects(&self, operator: &Operator, meaning: &Meaning) -> std::result::Result<(), String> {
        let known = Known::new(self, meaning);
        let mut touched: BTreeMap<u32, Vec<(u32, bool)>> = BTreeMap::new();
        for (key, holds) in &meaning.truths {
            if let Some((variable, value)) = self.fact(key) {
                touched.entry(variable).or_default().push((value, *holds));
            }
        }
        let effects: BTreeMap<u32, u32> = operator.effects.iter().copied().collect();
        let variables: BTreeSet<u32> = touched.keys().chain(effects.keys()).copied().collect();
        for variable in variables {
            let truths = touched.get(&variable).map_or(&[][..], Vec::as_slice);
            let name = || self.model.variables[variable as usize].join(" or ");
            let none = self.model.variables[variable as usize].len() as u32 - 1;
            let current = known.positive.iter().find(|fact| fact.0 == variable).map(|fact| fact.1);
            let is_deleted = |value: u32| truths.contains(&(value, false));
            // An atom that may hold before and is not taken away.
            let remains = |value: u32| {
                let may_hold = match current {
                    Some(current) => current == value,
                    None => !known.negative.contains(&(variable, value)),
                };
                may_hold && !is_deleted(value)
            };
            let added: Vec<u32> =
                truths.iter().filter(|(_, holds)| *holds).map(|(value, _)| *value).collect();
            let expected = match added[..] {
                [] if truths.is_empty() || current.is_some_and(|value| !is_deleted(value)) => current,
                [] if !(0..none).any(remains) => Some(none),
                [value] if !(0..none).any(|other| other != value && remains(other)) => Some(value),
                _ => return Err(format!("more than one value of {} may hold", name())),
            };
            let found = effects.get(&variable).copied();
            let unchanged = truths.is_empty() && found.is_none();
            if !unchanged && found.or(current) != expected || found.is_some() && expected.is_none() {
                return Err(format!("{} becomes another one", name()));
            }
        }
        Ok(())
    }
}

/// What is known of the task's variables where an instance may be executed.
struct Known<'k> {
    model: &'k Model,
    positive: FxHashSet<Fact>,
    negative: FxHashSet<Fact>,
}

impl<'k> Known<'k> {
    fn new(comparison: &Comparison<'k>, meaning: &Meaning) -> Self {
        let facts = |keys: &BTreeSet<Key>| keys.iter().filter_map(|key| comparison.fact(key)).collect();
        Self {
            model: comparison.model,
            positive: facts(&meaning.positive),
            negative: facts(&meaning.negative),
        }
    }

    fn is_none(&self, (variable, value): Fact) -> bool {
        value as usize + 1 == self.model.variables[variable as usize].len()
    }

    fn fact(&self, fact: Fact) -> bool {
        if self.is_none(fact) {
            return (0..fact.1).all(|value| self.negative.contains(&(fact.0, value)));
        }
        self.positive.contains(&fact)
    }

    fn literal(&self, (fact, positive): &Literal) -> bool {
        if *positive {
            return self.fact(*fact);
        }
        let other = self.positive.iter().any(|own| own.0 == fact.0 && own.1 != fact.1);
        other || !self.is_none(*fact) && self.negative.contains(fact)
    }
}
