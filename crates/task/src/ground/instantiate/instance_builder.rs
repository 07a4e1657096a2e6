//! Partially evaluates the conditions and expressions of an action instance, and collects its forbidden
//! combinations of designs.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::error::{Error, File, Place};
use crate::ground::evaluate::condition::residual;
use crate::ground::evaluate::slots::{Slots, for_each_combination, open};
use crate::ground::instantiate::design_constraints::{distinct, forbid};
use crate::ground::vocabulary::atom::Binding;
use crate::ground::vocabulary::eval_error::{Failure, possible};
use crate::ground::vocabulary::partial_eval::{Residual, compare};
use crate::ground::vocabulary::world::World;
use crate::lifted::{Expression, Formula, Rational, Schema};
use crate::number::dense;
use crate::task::quantity::{Linear, Quantity, SlotSet};
use crate::task::{Argument, ForbiddenCombinations};
use pddl::ast::Span;

/// Value of an expression in a conditional effect, computed before it is known whether the effect occurs.
pub(super) struct Apart {
    /// Value of the expression; `None` if a part without slots is undefined.
    pub(super) operand: Option<Linear<Rational>>,
    pub(super) undefined: Arc<[ForbiddenCombinations]>,
}

pub(super) struct Build<'w, 'a> {
    pub(super) world: &'w mut World<'a>,
    pub(super) binding: Binding,
    pub(super) slots: &'w Slots<'w>,
    pub(super) forbidden: Vec<ForbiddenCombinations>,
}

impl Build<'_, '_> {
    #[expect(clippy::arithmetic_side_effects, reason = "a count of what is held in memory")]
    pub(super) fn conditions(
        &mut self,
        closed: &[&Formula],
        open: &[Residual],
    ) -> Result<Vec<Residual>, Failure> {
        let mut parts = Vec::with_capacity(open.len() + closed.len());
        parts.extend_from_slice(open);
        for conjunct in closed {
            parts.push(residual(self.world, conjunct, &mut self.binding)?);
        }
        Ok(parts)
    }

    /// Returns the residuals of comparisons that mention slots and depend on the state. Combinations of designs
    /// that violate a static comparison, or another conjunct over several slots, are forbidden. Other conjuncts
    /// over a single slot are skipped, because `suitable_designs` has evaluated them.
    pub(super) fn open_conditions(&mut self, open: &[(&Formula, SlotSet)]) -> Result<Vec<Residual>, Failure> {
        let mut parts = Vec::new();
        for (conjunct, mentioned) in open {
            if let Formula::Compare(comparison, left, right, _) = conjunct {
                let (left, right) = (self.open(left)?, self.open(right)?);
                // A comparison without fluents is decided for each combination of designs.
                let static_part = left.coefficients.is_empty() && right.coefficients.is_empty();
                match compare(*comparison, left, right) {
                    residual if static_part => self.forbid(mentioned, &residual)?,
                    residual => parts.push(residual),
                }
            } else if mentioned.len() > 1 {
                self.forbid_unless(conjunct, mentioned)?;
            }
        }
        Ok(parts)
    }

    /// Evaluates an expression of a conditional effect. Combinations of designs for which the value is
    /// undefined are returned, not forbidden.
    pub(super) fn open_apart(&mut self, expression: &Expression) -> Result<Apart, Failure> {
        let outer = std::mem::take(&mut self.forbidden);
        let operand = possible(self.open(expression));
        let undefined = std::mem::replace(&mut self.forbidden, outer);
        Ok(Apart { operand: operand?, undefined: distinct(undefined) })
    }

    pub(super) fn open(&mut self, expression: &Expression) -> Result<Linear<Rational>, Failure> {
        let forbidden = &mut self.forbidden;
        let mut undefined = |slots: &SlotSet, combination: SlotSet| forbid(forbidden, slots, combination);
        open(self.world, expression, &mut self.binding, self.slots, &mut undefined)
    }

    fn forbid(&mut self, mentioned: &SlotSet, residual: &Residual) -> Result<(), Failure> {
        match residual {
            Residual::And(parts) => parts.iter().try_for_each(|part| self.forbid(mentioned, part)),
            Residual::False => self.forbid_where(mentioned, &|_| true),
            Residual::Compare { linear, strict } => {
                let sizes = self.slots.sizes();
                self.forbid_where(mentioned, &|choice| {
                    let value = linear.quantity.at(choice, &sizes);
                    value < Rational::from_integer(0) || (*strict && value == Rational::from_integer(0))
                })
            }
            _ => Ok(()),
        }
    }

    fn forbid_where(&mut self, mentioned: &SlotSet, fails: &dyn Fn(&[u32]) -> bool) -> Result<(), Failure> {
        let mut choice = vec![0; self.slots.designs.len()];
        let forbidden = &mut self.forbidden;
        let limits = self.world.limits;
        for_each_combination(mentioned, self.slots, &mut self.binding, limits, &mut |_, combination| {
            for (slot, design) in mentioned.iter().zip(combination) {
                choice[*slot as usize] = *design;
            }
            if fails(&choice) {
                forbid(forbidden, mentioned, SlotSet::from_slice(combination));
            }
            Ok(())
        })
    }

    pub(super) fn forbid_negative(&mut self, duration: &Quantity<Rational>) -> Result<(), Failure> {
        let zero = Rational::from_integer(0);
        let least = duration.tables.iter().filter_map(|table| table.values.iter().min());
        if least.fold(duration.constant.clone(), |sum, value| sum + value) >= zero {
            return Ok(());
        }
        let slots: BTreeSet<u32> =
            duration.tables.iter().flat_map(|table| table.slots.iter().copied()).collect();
        let sizes = self.slots.sizes();
        self.forbid_where(&slots.into_iter().collect(), &|choice| duration.at(choice, &sizes) < zero)
    }

    fn forbid_unless(&mut self, conjunct: &Formula, mentioned: &SlotSet) -> Result<(), Failure> {
        let (world, forbidden) = (&mut *self.world, &mut self.forbidden);
        let limits = world.limits;
        for_each_combination(mentioned, self.slots, &mut self.binding, limits, &mut |binding, combination| {
            if matches!(residual(world, conjunct, &mut binding.clone())?, Residual::False) {
                forbid(forbidden, mentioned, SlotSet::from_slice(combination));
            }
            Ok(())
        })
    }

    pub(super) fn static_quantity(
        &mut self,
        expression: &Expression,
        schema: &Schema,
    ) -> Result<Quantity<Rational>, Failure> {
        let linear = self.open(expression)?;
        if linear.coefficients.is_empty() {
            return Ok(linear.quantity);
        }
        Err(Failure::Error(Error::Unsupported {
            construct: format!("a duration of `{}` that depends on the state", schema.name),
            instead: "a duration over functions that no action changes".into(),
            place: expression_place(expression),
        }))
    }

    pub(super) fn arguments(&self, schema: &Schema) -> Vec<Argument> {
        let slot =
            |parameter: usize| self.slots.parameters.iter().position(|s| s.parameter as usize == parameter);
        self.binding[..schema.parameters.len()]
            .iter()
            .enumerate()
            .filter_map(|(parameter, object)| match object {
                Some(object) => Some(Argument::Object(*object)),
                None => slot(parameter).map(|position| Argument::Slot(dense(position))),
            })
            .collect()
    }
}

fn expression_place(expression: &Expression) -> Place {
    match expression {
        Expression::Function(_, _, place)
        | Expression::Product(_, place)
        | Expression::Quotient(_, _, place) => *place,
        Expression::Negate(inner) => expression_place(inner),
        Expression::Sum(parts) if !parts.is_empty() => expression_place(&parts[0]),
        Expression::Sum(_) | Expression::Number(_) | Expression::TotalTime => {
            Place { file: File::Domain, span: Span::default() }
        }
    }
}
