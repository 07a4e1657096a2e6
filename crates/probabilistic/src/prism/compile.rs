//! Compiles expressions of the syntax tree: resolves names, infers types, and evaluates constants.

use std::collections::{BTreeMap, HashSet};

use num_rational::BigRational;
use rustc_hash::FxHashMap;

use crate::error::{Diagnostic, Error, Place};
use crate::number::parse_decimal;
use crate::prism::ast::{BinaryOp, Expr, ExprKind, Function, Model, Type};
use crate::prism::code::{Code, Fault};
use crate::prism::expression::Cursor;
use crate::prism::lexer::{Kind, tokens};

#[derive(Debug, Clone)]
enum Meaning {
    Constant(Code, Type),
    Variable(u32, Type),
    Formula(usize),
}

#[derive(Debug, Clone)]
pub struct Names {
    meanings: FxHashMap<String, Meaning>,
    formulas: Vec<Expr>,
    labels: FxHashMap<String, Expr>,
    /// The formulas and labels whose definitions are being expanded, outermost first.
    open: Vec<String>,
    depth: usize,
    /// Number of compiled subexpressions: of the current top-level expression, and of all expressions.
    parts: [usize; 2],
}

/// Upper limit on the nesting depth of an expression, with formulas expanded.
pub const MAX_DEPTH: usize = 250;
/// Upper limit on the sum of the levels of formulas that are expanded inside each other. It is slightly above the number
/// of levels that the parser admits, so that recursion over an expanded expression needs no larger stack.
pub const MAX_LEVELS: usize = 25_000;
/// Upper limits on the number of subexpressions: in one top-level expression, and in all expressions together.
pub const MAX_PARTS: [usize; 2] = [200_000, 5_000_000];
/// The message about an expression beyond [`MAX_DEPTH`] or [`MAX_PARTS`].
pub const TOO_LARGE: &str = "after the expansion of its formulas, this is nested too deeply or too large";

/// The values of constants that the user sets, as text, by name. They override values in the model.
pub type Settings = BTreeMap<String, String>;

impl Names {
    /// Declares the constants, formulas and labels of a model. Variables are added with [`Names::variable`].
    ///
    /// # Errors
    /// A constant without a value or with an invalid value, a value for an unknown constant, constants that
    /// depend on each other, or a name declared twice.
    pub fn new(model: &Model, settings: &Settings) -> Result<Self, Error> {
        let mut names = Self {
            meanings: FxHashMap::default(),
            formulas: model.formulas.iter().map(|formula| formula.expression.clone()).collect(),
            labels: FxHashMap::default(),
            open: Vec::new(),
            depth: 0,
            parts: [0; 2],
        };
        let mut problems = Vec::new();
        for label in &model.labels {
            if names.labels.insert(label.name.clone(), label.expression.clone()).is_some() {
                problems.push(duplicate(&format!("label `\"{}\"`", label.name), label.place));
            }
        }
        for (number, formula) in model.formulas.iter().enumerate() {
            names.declare(&formula.name, Meaning::Formula(number), formula.place, &mut problems);
        }
        for name in settings.keys() {
            if !model.constants.iter().any(|constant| constant.name == *name) {
                let declared: Vec<_> =
                    model.constants.iter().map(|constant| constant.name.as_str()).collect();
                return Err(Error::Constant(format!(
                    "the model has no constant `{name}`; it has: {}",
                    declared.join(", ")
                )));
            }
        }
        let mut missing = Vec::new();
        // A constant may use constants declared after it. Each round evaluates the constants that use no constant
        // without a value. A round without progress means that some of the remaining constants depend on each other.
        // Rounds alternate in direction, so that constants in reverse order of dependency need two rounds.
        let declared: HashSet<&str> = model.constants.iter().map(|constant| constant.name.as_str()).collect();
        let mut waiting: Vec<_> = model.constants.iter().collect();
        while !waiting.is_empty() {
            let before = waiting.len();
            let mut next = Vec::new();
            for constant in waiting {
                let setting = settings.get(&constant.name);
                let code = match (setting, &constant.value) {
                    (Some(text), _) => setting_code(text, constant.kind, &constant.name)?,
                    (None, None) => {
                        missing.push(constant.name.as_str());
                        zero(constant.kind)
                    }
                    (None, Some(value)) => {
                        if names.has_undefined(value, model, &declared) {
                            next.push(constant);
                            continue;
                        }
                        match names.constant(value, constant.kind) {
                            Ok(code) => code,
                            Err(problem) => {
                                problems.push(problem);
                                zero(constant.kind)
                            }
                        }
                    }
                };
                let meaning = Meaning::Constant(code, constant.kind);
                names.declare(&constant.name, meaning, constant.place, &mut problems);
            }
            next.reverse();
            waiting = next;
            if waiting.len() == before {
                waiting.sort_by_key(|constant| (constant.place.line, constant.place.column));
                for constant in waiting.drain(..) {
                    let text = format!("the value of `{}` depends on itself", constant.name);
                    problems.push(Diagnostic::new("Q204", constant.place, text));
                }
            }
        }
        if !problems.is_empty() {
            return Err(Error::Model(problems.into()));
        }
        if !missing.is_empty() {
            return Err(Error::Constant(format!("constants without value: {}", missing.join(", "))));
        }
        Ok(names)
    }

    /// Returns `true` if an expression uses a constant that has no value yet, directly or through formulas.
    fn has_undefined(&self, value: &Expr, model: &Model, declared: &HashSet<&str>) -> bool {
        let mut used = Vec::new();
        value.names(&mut used);
        let mut has_undefined = false;
        for at in 0.. {
            let Some((name, _)) = used.get(at).copied() else { break };
            has_undefined |= !self.meanings.contains_key(name) && declared.contains(name);
            if let Some(formula) = model.formulas.iter().find(|formula| formula.name == name)
                && !used[..at].iter().any(|(earlier, _)| *earlier == name)
            {
                formula.expression.names(&mut used);
            }
        }
        has_undefined
    }

    fn declare(&mut self, name: &str, meaning: Meaning, place: Place, problems: &mut Vec<Diagnostic>) {
        if self.meanings.insert(name.to_owned(), meaning).is_some() {
            problems.push(duplicate(&format!("name `{name}`"), place));
        }
    }

    /// Declares a variable. If the name is declared already, an error is appended to `problems`.
    pub fn variable(
        &mut self,
        name: &str,
        number: u32,
        kind: Type,
        place: Place,
        problems: &mut Vec<Diagnostic>,
    ) {
        self.declare(name, Meaning::Variable(number, kind), place, problems);
    }

    pub fn find_variable(&self, name: &str) -> Option<(u32, Type)> {
        match self.meanings.get(name)? {
            Meaning::Variable(number, kind) => Some((*number, *kind)),
            _ => None,
        }
    }

    pub fn label(&self, name: &str) -> Option<&Expr> {
        self.labels.get(name)
    }

    pub fn labels(&self) -> Vec<&str> {
        let mut labels: Vec<_> = self.labels.keys().map(String::as_str).collect();
        labels.sort_unstable();
        labels
    }

    /// Compiles an expression without variables and evaluates it to a literal of type `kind`.
    pub fn constant(&mut self, value: &Expr, kind: Type) -> Result<Code, Diagnostic> {
        let code = self.typed(value, kind)?;
        if !code.is_constant() {
            return Err(Diagnostic::new("Q205", value.place, "a value without variables is needed here"));
        }
        fold(&code, kind).map_err(|Fault(text)| Diagnostic::new("Q303", value.place, text))
    }

    /// Compiles an expression that must have the given type. Integers are accepted as `double`.
    pub fn typed(&mut self, expression: &Expr, expected: Type) -> Result<Code, Diagnostic> {
        let (code, actual) = self.compile(expression)?;
        if actual == expected || expected == Type::Double && actual == Type::Int {
            return Ok(code);
        }
        let text = format!("the type here must be `{}`, not `{}`", expected.name(), actual.name());
        Err(Diagnostic::new("Q203", expression.place, text))
    }

    /// Compiles an expression and returns it with its inferred type. Fails for an unknown name, a
    /// wrong type, a property, a circular formula or label, or an expression beyond [`MAX_DEPTH`] or
    /// [`MAX_PARTS`].
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "depth and parts are refused as soon as they pass their limits, and each leaves the depth that it entered"
    )]
    pub fn compile(&mut self, expression: &Expr) -> Result<(Code, Type), Diagnostic> {
        // For a top-level expression, the number of subexpressions starts at 0.
        if self.depth == 0 {
            self.parts[0] = 0;
        }
        self.depth += 1;
        self.parts = self.parts.map(|parts| parts + 1);
        if self.depth > MAX_DEPTH || self.parts.iter().zip(MAX_PARTS).any(|(parts, most)| *parts > most) {
            self.depth -= 1;
            return Err(Diagnostic::new("Q104", expression.place, TOO_LARGE));
        }
        let compiled = self.kind(expression);
        self.depth -= 1;
        compiled
    }

    fn kind(&mut self, expression: &Expr) -> Result<(Code, Type), Diagnostic> {
        Ok(match &expression.kind {
            ExprKind::Bool(value) => (Code::Whole(i64::from(*value)), Type::Bool),
            ExprKind::Int(value) => (Code::Whole(*value), Type::Int),
            ExprKind::Number(value) => (Code::Number(value.clone()), Type::Double),
            ExprKind::Name(name) => self.name(name, expression.place)?,
            ExprKind::Label(label) => {
                let Some(inner) = self.labels.get(label).cloned() else {
                    let text = match self.labels().join(", ") {
                        labels if labels.is_empty() => {
                            format!("there is no label `\"{label}\"`, and no other one")
                        }
                        labels => format!("there is no label `\"{label}\"`; there are: {labels}"),
                    };
                    return Err(Diagnostic::new("Q202", expression.place, text));
                };
                self.nested(&format!("\"{label}\""), &inner, expression.place)?
            }
            ExprKind::Not(inner) => (Code::Not(Box::new(self.typed(inner, Type::Bool)?)), Type::Bool),
            ExprKind::Negative(inner) => {
                let (code, kind) = self.numeric(inner)?;
                (Code::Negative(Box::new(code), kind), kind)
            }
            ExprKind::Binary(op, left, right) => self.binary(*op, left, right, expression.place)?,
            ExprKind::If(condition, then, otherwise) => {
                let condition = self.typed(condition, Type::Bool)?;
                let (then, a) = self.compile(then)?;
                let (alternative, b) = self.compile(otherwise)?;
                let Some(kind) = common(a, b) else {
                    return Err(Diagnostic::new(
                        "Q203",
                        otherwise.place,
                        format!("the two sides of `:` are `{}` and `{}`", a.name(), b.name()),
                    ));
                };
                (Code::If(Box::new(condition), Box::new(then), Box::new(alternative)), kind)
            }
            ExprKind::Call(function, arguments) => self.call(*function, arguments, expression.place)?,
            ExprKind::Property(_) | ExprKind::Temporal(_) => {
                let text = "a property has a value in a state of a model only, and cannot stand here";
                return Err(Diagnostic::new("Q205", expression.place, text));
            }
        })
    }

    fn name(&mut self, name: &str, place: Place) -> Result<(Code, Type), Diagnostic> {
        match self.meanings.get(name) {
            Some(Meaning::Constant(code, kind)) => Ok((code.clone(), *kind)),
            Some(Meaning::Variable(number, kind)) => Ok((Code::Variable(*number), *kind)),
            Some(Meaning::Formula(formula)) => {
                let inner = self.formulas[*formula].clone();
                self.nested(name, &inner, place)
            }
            None => {
                let text = format!("`{name}` is not a constant, formula or variable of the model");
                Err(Diagnostic::new("Q201", place, text))
            }
        }
    }

    fn nested(&mut self, name: &str, inner: &Expr, place: Place) -> Result<(Code, Type), Diagnostic> {
        if self.open.iter().any(|open| open == name) {
            return Err(Diagnostic::new(
                "Q204",
                place,
                format!("the definition of `{name}` contains `{name}` itself"),
            ));
        }
        self.open.push(name.to_owned());
        let result = self.compile(inner);
        self.open.pop();
        result
    }

    fn numeric(&mut self, expression: &Expr) -> Result<(Code, Type), Diagnostic> {
        let (code, kind) = self.compile(expression)?;
        match kind {
            Type::Bool => {
                Err(Diagnostic::new("Q203", expression.place, "a number is needed here, not `bool`"))
            }
            _ => Ok((code, kind)),
        }
    }

    fn binary(
        &mut self,
        op: BinaryOp,
        left: &Expr,
        right: &Expr,
        place: Place,
    ) -> Result<(Code, Type), Diagnostic> {
        match op {
            BinaryOp::And | BinaryOp::Or => {
                let mut parts = Vec::new();
                flatten(op, left, &mut parts);
                flatten(op, right, &mut parts);
                let codes = parts.into_iter().map(|part| self.typed(part, Type::Bool));
                let codes: Vec<_> = codes.collect::<Result<_, _>>()?;
                Ok((if op == BinaryOp::And { Code::All(codes) } else { Code::Any(codes) }, Type::Bool))
            }
            BinaryOp::Iff | BinaryOp::Implies => {
                let (left, right) = (self.typed(left, Type::Bool)?, self.typed(right, Type::Bool)?);
                let code = match op {
                    BinaryOp::Iff => Code::Iff(Box::new(left), Box::new(right)),
                    _ => Code::Any(vec![Code::Not(Box::new(left)), right]),
                };
                Ok((code, Type::Bool))
            }
            BinaryOp::Equal | BinaryOp::NotEqual => {
                let ((left, a), (right, b)) = (self.compile(left)?, self.compile(right)?);
                let Some(kind) = common(a, b) else {
                    let text = format!("`{}` and `{}` cannot be compared", a.name(), b.name());
                    return Err(Diagnostic::new("Q203", place, text));
                };
                Ok((Code::Compare(op, kind, Box::new(left), Box::new(right)), Type::Bool))
            }
            BinaryOp::Less | BinaryOp::LessEqual | BinaryOp::Greater | BinaryOp::GreaterEqual => {
                let ((left, a), (right, b)) = (self.numeric(left)?, self.numeric(right)?);
                let kind = common(a, b).unwrap_or(Type::Double);
                Ok((Code::Compare(op, kind, Box::new(left), Box::new(right)), Type::Bool))
            }
            BinaryOp::Plus | BinaryOp::Minus | BinaryOp::Times | BinaryOp::Divide => {
                // Arithmetic associates to the left. The chain is unrolled, so that long sums need no deep recursion.
                let (mut chain, mut first) = (vec![(op, right)], left);
                while let ExprKind::Binary(op, left, right) = &first.kind
                    && op.is_arithmetic()
                {
                    chain.push((*op, right));
                    first = left;
                }
                let (mut code, mut kind) = self.numeric(first)?;
                for (op, right) in chain.into_iter().rev() {
                    let (right, b) = self.numeric(right)?;
                    let common_kind = common(kind, b).unwrap_or(Type::Double);
                    kind = if op == BinaryOp::Divide { Type::Double } else { common_kind };
                    code = Code::Arithmetic(op, kind, Box::new(code), Box::new(right));
                }
                Ok((code, kind))
            }
        }
    }

    fn call(
        &mut self,
        function: Function,
        arguments: &[Expr],
        place: Place,
    ) -> Result<(Code, Type), Diagnostic> {
        let mut codes = Vec::new();
        let mut common_kind = Type::Int;
        for argument in arguments {
            let (code, kind) = self.numeric(argument)?;
            common_kind = common(common_kind, kind).unwrap_or(Type::Double);
            codes.push(code);
        }
        if function == Function::Mod && common_kind != Type::Int {
            return Err(Diagnostic::new("Q203", place, "`mod` takes integers"));
        }
        let kind = match function {
            Function::Min | Function::Max | Function::Pow => common_kind,
            Function::Floor | Function::Ceil | Function::Round | Function::Mod => Type::Int,
            Function::Log => Type::Double,
        };
        Ok((Code::Call(function, kind, codes), kind))
    }
}

fn duplicate(description: &str, place: Place) -> Diagnostic {
    Diagnostic::new("Q206", place, format!("the {description} is repeated here"))
}

fn flatten<'a>(op: BinaryOp, expression: &'a Expr, parts: &mut Vec<&'a Expr>) {
    let mut stack = Vec::from([expression]);
    while let Some(next) = stack.pop() {
        match &next.kind {
            ExprKind::Binary(inner_op, left, right) if *inner_op == op => {
                stack.push(right);
                stack.push(left);
            }
            _ => parts.push(next),
        }
    }
}

fn common(a: Type, b: Type) -> Option<Type> {
    match (a, b) {
        (Type::Bool, Type::Bool) => Some(Type::Bool),
        (Type::Bool, _) | (_, Type::Bool) => None,
        (Type::Int, Type::Int) => Some(Type::Int),
        _ => Some(Type::Double),
    }
}

fn zero(kind: Type) -> Code {
    if kind == Type::Double { Code::Number(BigRational::default()) } else { Code::Whole(0) }
}

fn fold(code: &Code, kind: Type) -> Result<Code, Fault> {
    match kind {
        Type::Double => code.number(&[]).map(Code::Number),
        Type::Int => code.whole(&[]).map(Code::Whole),
        Type::Bool => code.holds(&[]).map(|value| Code::Whole(i64::from(value))),
    }
}

/// Parses the value that the user set for a constant: a decimal, or an expression without names.
fn setting_code(text: &str, kind: Type, name: &str) -> Result<Code, Error> {
    let invalid =
        || Error::Constant(format!("`{text}` is not a value of type `{}` for `{name}`", kind.name()));
    if kind == Type::Double
        && let Some(exact) = parse_decimal(text)
    {
        return Ok(Code::Number(exact));
    }
    let tokens = tokens(text).map_err(|_| invalid())?;
    let mut cursor = Cursor::new(&tokens);
    let expression = cursor.expression().map_err(|_| invalid())?;
    if *cursor.peek() != Kind::End {
        return Err(invalid());
    }
    let mut names = Names {
        meanings: FxHashMap::default(),
        formulas: Vec::new(),
        labels: FxHashMap::default(),
        open: Vec::new(),
        depth: 0,
        parts: [0; 2],
    };
    names.constant(&expression, kind).map_err(|_| invalid())
}
