//! The same task in other units: all constants become integers, as sums and comparisons of these are quick.

use std::sync::Arc;

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_rational::BigRational;
use num_traits::One;
use rustc_hash::FxHashMap;

use crate::limits::{Interrupted, Limits};
use crate::number::Rational;
use crate::quantity::{Linear, Quantity, Table};
use crate::task::{Condition, Task};

/// Common denominators of more bits are not looked for.
const BIT_LIMIT: u64 = 200;

/// A task whose costs are this many times those of the task that it was made from.
pub(crate) struct Integral {
    pub(crate) task: Task<Rational>,
    pub(crate) cost_scale: Rational,
}

/// The least common multiple of denominators so far; none if it is too long.
struct Common(Option<BigInt>);

impl Common {
    fn add(&mut self, number: &Rational) {
        if let Some(common) = self.0.as_mut().filter(|_| !number.is_integer()) {
            *common = common.lcm(number.to_big().denom());
            self.0 = self.0.take().filter(|common| common.bits() <= BIT_LIMIT);
        }
    }

    fn add_all(&mut self, quantity: &Quantity<Rational>, seen: &mut Scaled) {
        self.add(&quantity.constant);
        for table in &quantity.tables {
            seen.tables.entry(Arc::as_ptr(&table.values).addr()).or_insert_with(|| {
                table.values.iter().for_each(|value| self.add(value));
                Arc::clone(&table.values)
            });
        }
    }

    fn scale(self) -> Rational {
        self.0.map_or_else(Rational::one, |common| Rational::from_big(BigRational::from_integer(common)))
    }
}

/// Tables that have been met, by where their values are, as many operators share one.
#[derive(Default)]
struct Scaled {
    tables: FxHashMap<usize, Arc<[Rational]>>,
    /// What keeps the places from being used again.
    originals: Vec<Arc<[Rational]>>,
}

impl Scaled {
    fn quantity(&mut self, quantity: &mut Quantity<Rational>, scale: &Rational) {
        quantity.constant = quantity.constant.clone() * scale;
        for Table { values, .. } in &mut quantity.tables {
            let originals = &mut self.originals;
            let scaled = self.tables.entry(Arc::as_ptr(values).addr()).or_insert_with(|| {
                originals.push(Arc::clone(values));
                values.iter().map(|value| value.clone() * scale).collect()
            });
            *values = Arc::clone(scaled);
        }
    }
}

fn compared(condition: &mut Condition<Rational>) -> impl Iterator<Item = &mut Linear<Rational>> {
    condition.comparisons.iter_mut().chain(&mut condition.above)
}

/// All linear expressions of a task.
fn linears(task: &mut Task<Rational>) -> impl Iterator<Item = &mut Linear<Rational>> {
    let bodies = task.axioms.iter_mut().flat_map(|layer| &mut layer.rules).map(|rule| &mut rule.body);
    let operators = task.operators.iter_mut().flat_map(|operator| {
        let values = operator.numeric_effects.iter_mut().map(|effect| &mut effect.value);
        compared(&mut operator.condition).chain(values)
    });
    bodies.chain([&mut task.goal]).flat_map(compared).chain(operators)
}

impl Integral {
    /// What a search goes by is scaled: conditions, effects, costs, and the initial state.
    pub(crate) fn of(task: &Task<Rational>, limits: &Limits) -> Result<Self, Interrupted> {
        let mut task = task.clone();
        let (mut costs, mut numbers) = (Common(Some(BigInt::one())), Common(Some(BigInt::one())));
        let mut seen = Scaled::default();
        for operator in limits.watch(&task.operators) {
            costs.add_all(&operator?.cost, &mut seen);
        }
        seen.tables.clear();
        task.initial.numbers.iter().for_each(|number| numbers.add(number));
        for linear in linears(&mut task) {
            numbers.add_all(&linear.quantity, &mut seen);
        }
        let (cost_scale, number_scale) = (costs.scale(), numbers.scale());
        let mut scaled = Scaled::default();
        for operator in &mut task.operators {
            scaled.quantity(&mut operator.cost, &cost_scale);
        }
        let mut scaled = Scaled::default();
        for number in &mut task.initial.numbers {
            *number = number.clone() * &number_scale;
        }
        for linear in linears(&mut task) {
            scaled.quantity(&mut linear.quantity, &number_scale);
        }
        Ok(Self { task, cost_scale })
    }
}
