//! Partial evaluation of a lifted condition under a binding of its parameters. Static facts are decided; the
//! remaining condition over fluents is the residual.

use crate::error::Error;
use crate::ground::evaluate::expression::ground;
use crate::ground::evaluate::join::{each_binding, guards_of_exists, guards_of_forall};
use crate::ground::vocabulary::atom::{Binding, arguments};
use crate::ground::vocabulary::eval_error::Failure;
use crate::ground::vocabulary::partial_eval::{Residual, compare, truth};
use crate::ground::vocabulary::world::World;
use crate::lifted::{Bound, Formula};

/// Evaluates a condition under a binding that assigns all slot parameters in it. A comparison with an undefined value
/// is false.
///
/// # Errors
/// The deadline has passed, the run is interrupted, a fluent has no initial value, or the condition is not supported.
pub fn residual(
    world: &mut World<'_>,
    formula: &Formula,
    binding: &mut Binding,
) -> Result<Residual, Failure> {
    Evaluation { refuses_undefined: false }.residual(world, formula, binding)
}

/// Evaluates the condition of a conditional effect under a binding that assigns all slot parameters in it.
///
/// # Errors
/// A comparison has an undefined value, the deadline has passed, the run is interrupted, a fluent has no initial
/// value, or the condition is not supported.
pub fn residual_of_effect(
    world: &mut World<'_>,
    formula: &Formula,
    binding: &mut Binding,
) -> Result<Residual, Failure> {
    Evaluation { refuses_undefined: true }.residual(world, formula, binding)
}

#[derive(Clone, Copy)]
struct Evaluation {
    /// `true` if an undefined value in a comparison is an error; `false` if the comparison is then false.
    refuses_undefined: bool,
}

impl Evaluation {
    fn residual(
        self,
        world: &mut World<'_>,
        formula: &Formula,
        binding: &mut Binding,
    ) -> Result<Residual, Failure> {
        match formula {
            Formula::And(parts) => self.junction(world, parts, binding, true),
            Formula::Or(parts) => self.junction(world, parts, binding, false),
            Formula::Exists(bound, body) => self.quantified(world, bound, body, binding, false),
            Formula::ForAll(bound, body) => self.quantified(world, bound, body, binding, true),
            Formula::Equal { positive, left, right } => {
                let is_equal = arguments(&[*left], binding) == arguments(&[*right], binding);
                Ok(truth(is_equal == *positive))
            }
            Formula::Literal { positive, predicate, terms } => {
                let arguments = arguments(terms, binding);
                if !world.lifted.predicates[predicate.index()].fluent {
                    return Ok(truth(world.holds_initially(*predicate, &arguments) == *positive));
                }
                // The relaxed reachability analysis never reaches this atom, so it is false in every state.
                if !world.is_reached(*predicate, &arguments) {
                    return Ok(truth(!positive));
                }
                Ok(Residual::Literal { atom: world.atom(*predicate, &arguments), positive: *positive })
            }
            Formula::Compare(comparison, left, right, place) => {
                let difference = match (ground(world, left, binding), ground(world, right, binding)) {
                    (Ok(left), Ok(right)) => (left, right),
                    // An action whose conditional effect reads an undefined value is not executable (PDDL 2.1). This is
                    // not supported here.
                    (Err(Failure::Undefined), _) | (_, Err(Failure::Undefined)) if self.refuses_undefined => {
                        return Err(Failure::Error(Error::Unsupported {
                            construct: "a comparison in `when` with a value that is not defined".into(),
                            instead: "a value for it in `:init`".into(),
                            place: *place,
                        }));
                    }
                    // Elsewhere, a comparison with an undefined value is false.
                    (Err(Failure::Undefined), _) | (_, Err(Failure::Undefined)) => {
                        return Ok(Residual::False);
                    }
                    (Err(failure), _) | (_, Err(failure)) => return Err(failure),
                };
                Ok(compare(*comparison, difference.0, difference.1))
            }
        }
    }

    fn junction(
        self,
        world: &mut World<'_>,
        parts: &[Formula],
        binding: &mut Binding,
        conjunction: bool,
    ) -> Result<Residual, Failure> {
        let mut residuals = Vec::new();
        for part in parts {
            let part = self.residual(world, part, binding)?;
            if part == truth(!conjunction) {
                return Ok(part);
            }
            residuals.push(part);
        }
        Ok(Residual::junction(residuals, conjunction))
    }

    fn quantified(
        self,
        world: &mut World<'_>,
        bound: &[Bound],
        body: &Formula,
        binding: &mut Binding,
        universal: bool,
    ) -> Result<Residual, Failure> {
        let guards = if universal { guards_of_forall(body) } else { guards_of_exists(body) };
        let mut residuals = Vec::new();
        let mut failure = None;
        let complete = each_binding(world, bound, &guards, binding, &mut |world, binding| match self
            .residual(world, body, binding)
        {
            Ok(part) if part == truth(!universal) => false,
            Ok(part) => {
                residuals.push(part);
                true
            }
            Err(error) => {
                failure = Some(error);
                false
            }
        })?;
        match failure {
            Some(failure) => Err(failure),
            None if complete => Ok(Residual::junction(residuals, universal)),
            None => Ok(truth(!universal)),
        }
    }
}
