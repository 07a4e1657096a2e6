//! Evaluates conditions and expressions in a state, directly on the syntax tree.
//!
//! A comparison with an undefined value (for example a function without a value, or a division by zero) is neither
//! true nor false (Kleene's three-valued logic). A compound condition is undefined only if its truth depends on
//! such a comparison.

use num_rational::BigRational;
use num_traits::Zero;
use rustc_hash::FxHashSet;

use crate::ast::{
    Arithmetic, Atom, Comparison, Condition, Expression, Name, Term, TypeExpression, TypedName,
};

use super::trace::Trace;
use super::world::{Arguments, State, Symbol, World};

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Undefined {
    Function(String),
    Division,
    Size,
    /// `?duration` or `total-time` in a context that does not define it.
    Place,
}

/// Variables of the enclosing action, axiom and quantifiers, the innermost last.
#[derive(Debug, Clone, Default)]
pub(super) struct Bindings<'p>(pub(super) Vec<Binding<'p>>);

#[derive(Debug, Clone, Copy)]
pub(super) struct Binding<'p> {
    pub(super) variable: &'p Name,
    pub(super) r#type: &'p TypeExpression,
    pub(super) object: Option<Symbol>,
}

impl<'p> Bindings<'p> {
    pub(super) fn position(&self, variable: &Name) -> Option<usize> {
        self.0.iter().rposition(|binding| binding.variable == variable)
    }

    pub(super) fn get(&self, variable: &Name) -> Option<Symbol> {
        self.position(variable).and_then(|position| self.0[position].object)
    }

    pub(super) fn declare(&mut self, variables: &'p [TypedName]) {
        self.0.extend(variables.iter().map(|entry| Binding {
            variable: &entry.identifier.name,
            r#type: &entry.r#type,
            object: None,
        }));
    }
}

/// Maximum number of bits of a numerator or denominator in a result. Repeated squaring would otherwise exhaust
/// memory.
const BITS_LIMIT: u64 = 100_000;

#[derive(Debug, Clone, Copy)]
pub(super) struct Evaluator<'e, 'p> {
    pub(super) world: &'e World<'p>,
    pub(super) state: &'e State,
    pub(super) duration: Option<&'e BigRational>,
    pub(super) total_time: Option<&'e BigRational>,
    /// Addresses of subconditions that count as true while [`Evaluator::solve`] searches for bindings.
    pub(super) ignored: Option<&'e FxHashSet<*const Condition>>,
    pub(super) trace: Option<&'e Trace<'e, 'p>>,
}

impl<'e, 'p> Evaluator<'e, 'p> {
    pub(super) fn new(world: &'e World<'p>, state: &'e State) -> Self {
        Self { world, state, duration: None, total_time: None, ignored: None, trace: None }
    }

    pub(super) fn holds(
        &self,
        condition: &'p Condition,
        bindings: &mut Bindings<'p>,
    ) -> Result<bool, Undefined> {
        match condition {
            Condition::And(parts) => self.all(parts.iter(), bindings),
            Condition::Or(parts) => self.any(parts.iter(), bindings),
            Condition::Not(inner) => self.holds(inner, bindings).map(|holds| !holds),
            Condition::Imply(premise, conclusion) => match self.holds(premise, bindings) {
                Ok(false) => Ok(true),
                Ok(true) => self.holds(conclusion, bindings),
                // A true conclusion makes the implication true, regardless of the premise.
                Err(undefined) => match self.holds(conclusion, bindings) {
                    Ok(true) => Ok(true),
                    _ => Err(undefined),
                },
            },
            Condition::Exists(variables, body) => self.exists(variables, body, bindings),
            Condition::ForAll(variables, body) => self.for_all(variables, body, bindings),
            Condition::Atom(atom) => {
                Ok(self.arguments(atom, bindings).is_some_and(|arguments| self.is_fact(atom, arguments)))
            }
            Condition::Equal(left, right, _) => Ok(self.term(left, bindings).is_some()
                && self.term(left, bindings) == self.term(right, bindings)),
            Condition::Compare(operator, left, right, _) => {
                Ok(compare(*operator, &self.value(left, bindings)?, &self.value(right, bindings)?))
            }
        }
    }

    fn is_fact(&self, atom: &Atom, arguments: Arguments) -> bool {
        let name = &atom.predicate.name;
        let predicate = self.world.symbol(name);
        let holds = self.state.holds(predicate, &arguments);
        if let Some(trace) = self.trace.filter(|_| !holds) {
            trace.missed(name, (predicate, arguments));
        }
        holds
    }

    fn all(
        &self,
        parts: impl Iterator<Item = &'p Condition>,
        bindings: &mut Bindings<'p>,
    ) -> Result<bool, Undefined> {
        let mut result = Ok(true);
        for part in parts {
            match self.holds(part, bindings) {
                Ok(true) => {}
                Ok(false) => return Ok(false),
                Err(undefined) => result = result.and(Err(undefined)),
            }
        }
        result
    }

    fn any(
        &self,
        parts: impl Iterator<Item = &'p Condition>,
        bindings: &mut Bindings<'p>,
    ) -> Result<bool, Undefined> {
        let mut result = Ok(false);
        for part in parts {
            match self.holds(part, bindings) {
                Ok(true) => return Ok(true),
                Ok(false) => {}
                Err(undefined) => result = result.and(Err(undefined)),
            }
        }
        result
    }

    fn for_all(
        &self,
        variables: &'p [TypedName],
        body: &'p Condition,
        bindings: &mut Bindings<'p>,
    ) -> Result<bool, Undefined> {
        let mut result = Ok(true);
        self.world.each(variables, bindings, &mut |bindings| {
            match self.holds(body, bindings) {
                Ok(false) => result = Ok(false),
                // An undefined instance does not end the loop: a later instance may be false.
                Err(undefined) if result == Ok(true) => result = Err(undefined),
                Ok(true) | Err(_) => {}
            }
            result != Ok(false)
        });
        result
    }

    fn exists(
        &self,
        variables: &'p [TypedName],
        body: &'p Condition,
        bindings: &mut Bindings<'p>,
    ) -> Result<bool, Undefined> {
        let outer = bindings.0.len();
        self.declare(variables, bindings);
        let mut result = Ok(false);
        self.solve(vec![body], outer, bindings, &mut |_, undefined| {
            // An undefined solution does not end the search: a later solution may be true.
            result = undefined.map_or(Ok(true), |undefined| Err(undefined.clone()));
            result != Ok(true)
        });
        bindings.0.truncate(outer);
        result
    }

    pub(super) fn term(&self, term: &Term, bindings: &Bindings<'p>) -> Option<Symbol> {
        match term {
            Term::Variable(identifier) => bindings.get(&identifier.name),
            Term::Constant(identifier) => Some(self.world.symbol(&identifier.name)),
        }
    }

    pub(super) fn arguments(&self, atom: &Atom, bindings: &Bindings<'p>) -> Option<Arguments> {
        atom.arguments.iter().map(|term| self.term(term, bindings)).collect()
    }

    pub(super) fn value(
        &self,
        expression: &Expression,
        bindings: &Bindings<'p>,
    ) -> Result<BigRational, Undefined> {
        match expression {
            Expression::Number(value, _) => Ok(value.clone()),
            Expression::Fluent(atom) => self.fluent(atom, bindings),
            Expression::Duration(_) => self.duration.cloned().ok_or(Undefined::Place),
            Expression::TotalTime(_) => self.total_time.cloned().ok_or(Undefined::Place),
            Expression::Operation(operation, operands, _) => {
                let mut operands = operands.iter().map(|operand| self.value(operand, bindings));
                let first = operands.next().unwrap_or_else(|| Ok(BigRational::zero()))?;
                let mut remaining = operands.peekable();
                // `(- a)` is a negation.
                if *operation == Arithmetic::Subtract && remaining.peek().is_none() {
                    return Ok(-first);
                }
                remaining.try_fold(first, |left, right| apply(*operation, &left, &right?))
            }
        }
    }

    fn fluent(&self, atom: &Atom, bindings: &Bindings<'p>) -> Result<BigRational, Undefined> {
        let symbol = self.world.symbol(&atom.predicate.name);
        let arguments = self.arguments(atom, bindings).unwrap_or_default();
        let undefined = || Undefined::Function(self.world.show(symbol, &arguments));
        self.state.values.get(&(symbol, arguments.clone())).cloned().ok_or_else(undefined)
    }
}

/// Returns the metric value of a plan that ends in this state. `None` without a metric or if the value is undefined.
pub(super) fn metric(world: &World<'_>, state: &State, total_time: &BigRational) -> Option<BigRational> {
    let metric = world.problem.metric.as_ref()?;
    let evaluator = Evaluator { total_time: Some(total_time), ..Evaluator::new(world, state) };
    evaluator.value(&metric.expression, &Bindings::default()).ok()
}

impl<'p> World<'p> {
    /// Calls `visit` for each assignment of objects to `variables`, until `visit` returns `false` or the
    /// budget is spent. Returns `true` if all assignments were visited and `visit` always returned `true`.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub(super) fn each(
        &self,
        variables: &'p [TypedName],
        bindings: &mut Bindings<'p>,
        visit: &mut dyn FnMut(&mut Bindings<'p>) -> bool,
    ) -> bool {
        // If a type has no objects, there is no assignment.
        if variables.iter().any(|entry| self.objects_of(&entry.r#type).next().is_none()) {
            return true;
        }
        let first = bindings.0.len();
        bindings.declare(variables);
        // Untried objects of each bound variable.
        let mut untried = Vec::with_capacity(variables.len());
        let is_complete = loop {
            for entry in &variables[untried.len()..] {
                let mut objects = self.objects_of(&entry.r#type);
                bindings.0[first + untried.len()].object = objects.next();
                untried.push(objects);
            }
            if self.budget.is_spent() || !visit(bindings) {
                break false;
            }
            let next = loop {
                let Some(objects) = untried.last_mut() else { break None };
                match objects.next() {
                    Some(object) => break Some(object),
                    None => untried.pop(),
                };
            };
            if next.is_none() {
                break true;
            }
            bindings.0[first + untried.len() - 1].object = next;
        };
        bindings.0.truncate(first);
        is_complete
    }
}

fn compare(operator: Comparison, left: &BigRational, right: &BigRational) -> bool {
    match operator {
        Comparison::Less => left < right,
        Comparison::LessOrEqual => left <= right,
        Comparison::Equal => left == right,
        Comparison::GreaterOrEqual => left >= right,
        Comparison::Greater => left > right,
    }
}

pub(super) fn apply(
    operation: Arithmetic,
    left: &BigRational,
    right: &BigRational,
) -> Result<BigRational, Undefined> {
    let value = match operation {
        Arithmetic::Add => left + right,
        Arithmetic::Subtract => left - right,
        Arithmetic::Multiply => left * right,
        Arithmetic::Divide if right.is_zero() => return Err(Undefined::Division),
        Arithmetic::Divide => left / right,
    };
    let bits = value.numer().bits().max(value.denom().bits());
    if bits > BITS_LIMIT { Err(Undefined::Size) } else { Ok(value) }
}
