//! Evaluates state formulas and numeric expressions, in which properties can be nested.

use fixedbitset::FixedBitSet;
use num_rational::BigRational;

use crate::check::ask::{Checked, Stop, property_error, refusal};
use crate::check::query::Query;
use crate::check::steps::UNDERFLOW_THRESHOLD;
use crate::check::vector::{Span, Vector};
use crate::error::{Diagnostic, Error};
use crate::explore::DEADLOCK;
use crate::number::{Number, enclosing};
use crate::prism::ast::{BinaryOp, Expr, ExprKind, Property, Type};
use crate::prism::{Code, Names};

/// Prefix of the variable names of precomputed state sets. A parsed name never contains this
/// character.
const PREFIX: &str = "#";

/// Returns `true` if a property is numeric. An expression counts as numeric only if it contains a numeric
/// property.
pub fn is_number(property: &Property) -> bool {
    use crate::prism::ast::Filter;
    match property {
        Property::Probability(question, _)
        | Property::Reward(question, ..)
        | Property::SteadyState(question, _) => question.bound.is_none(),
        Property::Filter(filter, inner, _) => match filter {
            Filter::ForAll | Filter::Exists => false,
            Filter::Count | Filter::Sum | Filter::Average => true,
            _ => is_numeric(inner),
        },
        Property::Expression(inner) => is_numeric(inner),
        Property::Multi(_) => true,
        Property::Refused(_) => false,
    }
}

/// Returns `true` if an expression contains a numeric property and is itself numeric.
fn is_numeric(expression: &Expr) -> bool {
    match &expression.kind {
        ExprKind::Property(property) => is_number(property),
        ExprKind::Negative(inner) => is_numeric(inner),
        ExprKind::Binary(op, left, right) => op.is_arithmetic() && (is_numeric(left) || is_numeric(right)),
        ExprKind::If(_, then, otherwise) => is_numeric(then) || is_numeric(otherwise),
        ExprKind::Call(_, arguments) => arguments.iter().any(is_numeric),
        _ => false,
    }
}

fn is_comparison(op: BinaryOp) -> bool {
    !op.is_arithmetic() && !matches!(op, BinaryOp::And | BinaryOp::Or | BinaryOp::Implies | BinaryOp::Iff)
}

pub const BUILT_IN: [&str; 2] = ["init", "deadlock"];

/// Returns `true` if a label is predefined and no declaration with this name replaces it.
pub fn is_built_in(label: &str, names: &Names) -> bool {
    BUILT_IN.contains(&label) && names.label(label).is_none()
}

/// Replaces nested properties and predefined labels by constants of the right type, for type
/// checking.
pub fn with_placeholders(expression: &Expr, names: &Names) -> Expr {
    expression.rewrite(&mut |part| match &part.kind {
        ExprKind::Property(property) if is_number(property) => {
            let kind = ExprKind::Number(BigRational::default());
            Some(Expr { kind, place: part.place })
        }
        ExprKind::Property(_) => Some(Expr { kind: ExprKind::Bool(true), place: part.place }),
        ExprKind::Label(label) if is_built_in(label, names) => {
            Some(Expr { kind: ExprKind::Bool(true), place: part.place })
        }
        _ => None,
    })
}

/// Returns `true` if an expression depends only on the values of variables, i.e. contains no
/// property and no predefined label.
pub fn is_of_states(expression: &Expr, names: &Names) -> bool {
    let mut depends_on_variables_only = true;
    let _ = expression.rewrite(&mut |part| {
        match &part.kind {
            ExprKind::Property(_) | ExprKind::Temporal(_) => depends_on_variables_only = false,
            ExprKind::Label(label) if is_built_in(label, names) => depends_on_variables_only = false,
            ExprKind::Label(label) => {
                depends_on_variables_only &=
                    names.label(label).is_some_and(|inner| is_of_states(inner, names));
            }
            _ => {}
        }
        None
    });
    depends_on_variables_only
}

impl<N: Number> Query<'_, N> {
    pub fn kind_of(&self, expression: &Expr) -> Checked<Type> {
        let names = &self.program.names;
        let compiled = names.clone().compile(&with_placeholders(expression, names));
        compiled.map(|(_, kind)| kind).map_err(|problem| Stop::Wrong(Error::Property(problem.into())))
    }

    pub fn every(&self) -> FixedBitSet {
        let mut states = FixedBitSet::with_capacity(self.mdp().states());
        states.insert_range(..);
        states
    }

    pub fn truth(&self, expression: &Expr) -> Checked<FixedBitSet> {
        let (code, sets) = self.prepared(expression, Type::Bool)?;
        let n = self.mdp().states();
        let mut satisfying = FixedBitSet::with_capacity(n);
        let mut values = Vec::new();
        for (number, state) in self.explored.states.iter().enumerate() {
            self.program.unpack(state, &mut values);
            values.extend(sets.iter().map(|set| i64::from(set.contains(number))));
            let holds =
                code.holds(&values).map_err(|fault| property_error("Q303", expression.place, fault.0))?;
            satisfying.set(number, holds);
        }
        Ok(satisfying)
    }

    /// Compiles an expression. Nested properties, predefined labels and comparisons of property values become
    /// additional Boolean variables. Also returns, for each of these variables, the states in which it is true.
    fn prepared(&self, expression: &Expr, kind: Type) -> Checked<(Code, Vec<FixedBitSet>)> {
        let mut sets = Vec::new();
        let mut stopped = None;
        let written = self.with_sets(expression, &mut sets, &mut stopped);
        if let Some(stop) = stopped {
            return Err(stop);
        }
        let mut names = self.program.names.clone();
        let mut problems = Vec::new();
        for number in 0..sets.len() {
            let variable = crate::mdp::dense(self.program.variables.len().saturating_add(number));
            names.variable(
                &format!("{PREFIX}{number}"),
                variable,
                Type::Bool,
                expression.place,
                &mut problems,
            );
        }
        let code = names.typed(&written, kind).map_err(|problem| Error::Property(problem.into()))?;
        Ok((code, sets))
    }

    /// Replaces nested properties, predefined labels and comparisons of property values by Boolean variables.
    /// For each variable, the set of states in which it is true is appended to `sets`. The first error is
    /// stored in `stopped`.
    fn with_sets(&self, expression: &Expr, sets: &mut Vec<FixedBitSet>, stopped: &mut Option<Stop>) -> Expr {
        expression.rewrite(&mut |part| {
            let set = match &part.kind {
                ExprKind::Property(property) => self.property_truth(property),
                ExprKind::Label(label) if is_built_in(label, &self.program.names) => Ok(self.built_in(label)),
                ExprKind::Binary(op, left, right)
                    if is_comparison(*op) && (is_numeric(left) || is_numeric(right)) =>
                {
                    self.compared(*op, left, right)
                }
                _ => return None,
            };
            match set {
                Ok(set) => {
                    let name = format!("{PREFIX}{}", sets.len());
                    sets.push(set);
                    Some(Expr { kind: ExprKind::Name(name), place: part.place })
                }
                Err(stop) => {
                    stopped.get_or_insert(stop);
                    Some(Expr { kind: ExprKind::Bool(false), place: part.place })
                }
            }
        })
    }

    fn built_in(&self, label: &str) -> FixedBitSet {
        let mdp = self.mdp();
        let mut labelled = FixedBitSet::with_capacity(mdp.states());
        if label == "init" {
            labelled.insert_range(..self.explored.starts);
            return labelled;
        }
        for state in 0..mdp.states() {
            labelled.set(state, mdp.choices(state).any(|choice| mdp.action(choice) == DEADLOCK));
        }
        labelled
    }

    fn compared(&self, op: BinaryOp, left: &Expr, right: &Expr) -> Checked<FixedBitSet> {
        let every = self.every();
        let (left, right) = (self.numbers(left, &every)?, self.numbers(right, &every)?);
        let mut satisfying = FixedBitSet::with_capacity(self.mdp().states());
        for state in 0..self.mdp().states() {
            let order = |a: &BigRational, b: &BigRational| compare(op, a.cmp(b));
            let holds = match (left.ends(state), right.ends(state)) {
                (Some((a, b)), Some((c, d))) => {
                    // A comparison is decided if it has the same result for all four pairs of ends of the two
                    // intervals. For equality, both intervals must also be points, or they must be disjoint.
                    let corners = [order(&a, &c), order(&a, &d), order(&b, &c), order(&b, &d)];
                    let equal = matches!(op, BinaryOp::Equal | BinaryOp::NotEqual) && (a != b || c != d);
                    let apart = b < c || d < a;
                    let decided = corners.iter().all(|corner| *corner == corners[0]) && (!equal || apart);
                    decided.then_some(corners[0])
                }
                (None, Some(_)) => Some(compare(op, std::cmp::Ordering::Greater)),
                (Some(_), None) => Some(compare(op, std::cmp::Ordering::Less)),
                (None, None) => Some(compare(op, std::cmp::Ordering::Equal)),
            };
            satisfying.set(state, holds.ok_or_else(undecided)?);
        }
        Ok(satisfying)
    }

    /// Computes the value of a numeric expression in the states `wanted`. In other states, it may have no value, for
    /// example because of a division by zero. Values of properties can only be negated, added, subtracted, multiplied
    /// and divided.
    pub fn numbers(&self, expression: &Expr, wanted: &FixedBitSet) -> Checked<Vector<N>> {
        match &expression.kind {
            ExprKind::Property(property) if is_number(property) => self.property_numbers(property, wanted),
            ExprKind::Negative(inner) if is_numeric(inner) => {
                let zero = Vector::exactly(vec![N::zero(); self.mdp().states()], Span::Any);
                joined(BinaryOp::Minus, [&zero, &self.numbers(inner, wanted)?], expression, wanted)
            }
            ExprKind::Binary(op, left, right) if op.is_arithmetic() && is_numeric(expression) => {
                let operands = [&self.numbers(left, wanted)?, &self.numbers(right, wanted)?];
                joined(*op, operands, expression, wanted)
            }
            _ if is_numeric(expression) => Err(property_error(
                "Q403",
                expression.place,
                "values of properties support sums, differences, products and quotients only",
            )
            .into()),
            _ => self.plain_numbers(expression, wanted),
        }
    }

    fn plain_numbers(&self, expression: &Expr, wanted: &FixedBitSet) -> Checked<Vector<N>> {
        let (code, sets) = self.prepared(expression, Type::Double)?;
        let mut values = Vec::new();
        let mut vector = Vector::exactly(Vec::new(), Span::Any);
        for (number, state) in self.explored.states.iter().enumerate() {
            self.program.unpack(state, &mut values);
            values.extend(sets.iter().map(|set| i64::from(set.contains(number))));
            let value = match code.number(&values) {
                Ok(value) => value,
                Err(_) if !wanted.contains(number) => BigRational::default(),
                Err(fault) => return Err(property_error("Q303", expression.place, fault.0).into()),
            };
            if !N::EXACT {
                let (lower, upper) = enclosing(&value);
                vector.errors.push(upper - lower);
            }
            vector.values.push(N::from_rational(&value));
        }
        vector.infinite.grow(vector.values.len());
        Ok(vector)
    }

    /// Evaluates an expression without variables.
    pub fn constant(&self, expression: &Expr) -> Checked<BigRational> {
        let mut names = self.program.names.clone();
        let code = names.constant(expression, Type::Double);
        let value = code.and_then(|code| {
            code.number(&[]).map_err(|fault| Diagnostic::new("Q303", expression.place, fault.0))
        });
        Ok(value.map_err(|problem| Error::Property(problem.into()))?)
    }
}

pub fn undecided() -> Stop {
    let text = "the bounds on a value do not decide whether a part of the property holds in some state; solve exactly \
                (`--exact`)";
    refusal("Q508", text)
}

pub fn compare(op: BinaryOp, order: std::cmp::Ordering) -> bool {
    match op {
        BinaryOp::Less => order.is_lt(),
        BinaryOp::LessEqual => order.is_le(),
        BinaryOp::Greater => order.is_gt(),
        BinaryOp::Equal => order.is_eq(),
        BinaryOp::NotEqual => order.is_ne(),
        _ => order.is_ge(),
    }
}

/// Combines two vectors state by state with an arithmetic operator. The resulting errors include the errors of
/// the operands and the rounding of the operation. Fails for a division by zero in a state of `wanted`; in other states,
/// the result is 0. Infinite operands are permitted only in sums, as the first operand of a difference, and as a
/// divisor.
fn joined<N: Number>(
    op: BinaryOp,
    [left, right]: [&Vector<N>; 2],
    at: &Expr,
    wanted: &FixedBitSet,
) -> Checked<Vector<N>> {
    let fault = |text: &str| Stop::Wrong(property_error("Q303", at.place, text));
    let mut vector = Vector::exactly(Vec::with_capacity(left.values.len()), Span::Any);
    vector.infinite.grow(left.values.len());
    for (state, (a, b)) in left.values.iter().zip(&right.values).enumerate() {
        let ends = [left.infinite.contains(state), right.infinite.contains(state)];
        let (value, infinite) = match (op, ends) {
            (BinaryOp::Divide, [false, _]) if ends[1] => (N::zero(), false),
            (BinaryOp::Divide, [false, false]) if b.is_zero() => {
                if wanted.contains(state) {
                    return Err(fault("a division by zero"));
                }
                (N::zero(), false)
            }
            (BinaryOp::Plus, [false, false]) => (a.plus(b), false),
            (BinaryOp::Minus, [false, false]) => (a.minus(b), false),
            (BinaryOp::Times, [false, false]) => (a.times(b), false),
            (BinaryOp::Divide, [false, false]) => (a.over(b), false),
            (BinaryOp::Plus, _) | (BinaryOp::Minus, [true, false]) => (N::zero(), true),
            _ if wanted.contains(state) => return Err(fault("an operation with an infinite value")),
            _ => (N::zero(), false),
        };
        vector.infinite.set(state, infinite);
        if !N::EXACT {
            let (e, f) = (left.error(state), right.error(state));
            let (x, y) = (a.to_f64().abs(), b.to_f64().abs());
            let error = match op {
                _ if infinite || ends[1] => 0.0,
                BinaryOp::Plus | BinaryOp::Minus => e + f,
                BinaryOp::Times => x * f + y * e + e * f,
                _ if f >= y => f64::INFINITY,
                _ => (e + x / y * f) / (y - f),
            };
            // Products and quotients may underflow, with their errors, unless an operand is exactly 0.
            let size = value.to_f64().abs();
            let underflows = matches!(op, BinaryOp::Times | BinaryOp::Divide)
                && size < UNDERFLOW_THRESHOLD
                && x + e > 0.0
                && y + f > 0.0;
            let rounding = size * f64::EPSILON + if underflows { UNDERFLOW_THRESHOLD } else { 0.0 };
            vector.errors.push((error + rounding) * (1.0 + 16.0 * f64::EPSILON));
        }
        vector.values.push(value);
    }
    Ok(vector)
}
