//! Common denominators, by which the numbers of a ground task are multiplied to obtain integers.

use certificate::format::Integer;
use num_bigint::BigInt;
use num_integer::Integer as _;
use num_traits::{One, Signed};

use crate::certificate::no_certificate::{MAX_DENOMINATOR_BITS, NoCertificate, action_name};
use task::number::Rational;
use task::task::Task;
use task::task::common_denominator::CommonDenominator;
use task::task::number::TaskNumber;
use task::task::quantity::Linear;

pub(super) struct Scales {
    pub(super) numbers: Integer,
    pub(super) costs: Integer,
    pub(super) times: Integer,
    /// Factor for cost bounds, which are counted in multiples of a unit.
    pub(super) bounds: Integer,
}

impl Scales {
    pub(super) fn one() -> Self {
        let unit = || Integer::from(1);
        Self { numbers: unit(), costs: unit(), times: unit(), bounds: unit() }
    }

    /// Computes the factors for a task whose cost bounds are counted in multiples of `unit`.
    ///
    /// # Errors
    /// An effect multiplies a number by a fraction (its values then have no common denominator), or a denominator
    /// has too many bits.
    pub(super) fn of(task: &Task<Rational>, unit: &Rational) -> Result<Self, NoCertificate> {
        let mut numbers = CommonDenominator::of_at_most(MAX_DENOMINATOR_BITS);
        let mut times = CommonDenominator::of_at_most(MAX_DENOMINATOR_BITS);
        let mut costs = CommonDenominator::of_at_most(MAX_DENOMINATOR_BITS);
        task.initial.numbers.iter().for_each(|number| numbers.number(number));
        let rules = task.axioms.iter().flat_map(|layer| &layer.rules).map(|rule| &rule.body);
        let conditions = task.operators.iter().map(|operator| &operator.condition);
        for condition in conditions.chain(rules).chain([&task.goal]) {
            condition.linears().for_each(|linear| numbers.quantity(&linear.quantity));
        }
        for operator in &task.operators {
            for effect in &operator.numeric_effects {
                numbers.quantity(&effect.value.quantity);
                if !effect.value.coefficients.iter().all(|(_, factor)| factor.is_integer()) {
                    let action = format!("`{}`", action_name(task, operator));
                    return Err(NoCertificate::Fraction { action });
                }
            }
            costs.quantity(&operator.cost);
            times.quantity(&operator.duration);
            operator.wait.iter().for_each(|time| times.number(time));
        }
        costs.number(&task.objective.offset);
        costs.number(unit);
        let [numbers, costs, times] = [numbers, costs, times]
            .map(|denominator| denominator.get().map(Integer::from).ok_or(NoCertificate::Denominator));
        let (numbers, costs, times) = (numbers?, costs?, times?);
        let bounds = scaled(unit, &costs);
        Ok(Self { numbers, costs, times, bounds })
    }
}

/// Returns the product of `number` and `scale`, which must be a multiple of the denominator of
/// `number`.
pub(super) fn scaled<N: TaskNumber>(number: &N, scale: &Integer) -> Integer {
    let number = number.to_rational();
    if let Some(integer) = number.to_int() {
        return &Integer::from(integer) * scale;
    }
    let product = number.to_big() * scale.to_rational();
    debug_assert!(product.is_integer(), "{number:?} times {scale}");
    product.to_integer().into()
}

/// Returns the least factor that makes the coefficients of a comparison integers.
pub(super) fn whole<N: TaskNumber>(linear: &Linear<N>) -> Integer {
    let denominators = linear.coefficients.iter().map(|(_, factor)| factor.to_rational());
    let denominators = denominators.filter(|factor| !factor.is_integer());
    denominators.fold(BigInt::one(), |common, factor| common.lcm(factor.to_big().denom()).abs()).into()
}
