//! The `swrlm` library: square root, natural logarithm, and evaluation of expressions.
//!
//! An expression of `eval` refers to the variables of its atom by name: `swrlm:eval(?r, "(57 * x) / y", ?x,
//! ?y)`. A built-in receives values only. Therefore [`BuiltIn::with_names`] inserts the names into the text
//! when a rule is parsed: `"x, y: (57 * x) / y"`. Text with a colon already has names and is not changed.

use super::expression;
use crate::builtin::custom::Definition;
use crate::builtin::signature::BuiltIn;
use crate::literal::Literal;

const EVAL: &str = "http://swrl.stanford.edu/ontologies/built-ins/3.4/swrlm.owl#eval";
const SQRT: &str = "http://swrl.stanford.edu/ontologies/built-ins/3.4/swrlm.owl#sqrt";
const LOG: &str = "http://swrl.stanford.edu/ontologies/built-ins/3.4/swrlm.owl#log";

struct Unary(&'static str, fn(f64) -> f64);

struct Eval;

pub(super) const ALL: [&dyn Definition; 3] = [&Unary(SQRT, f64::sqrt), &Unary(LOG, f64::ln), &Eval];

fn number(value: f64) -> Option<Literal> {
    value.is_finite().then(|| Literal::double(value))
}

impl Definition for Unary {
    fn iri(&self) -> &'static str {
        self.0
    }

    fn accepts(&self, count: usize) -> bool {
        count == 2
    }

    fn is_function(&self) -> bool {
        true
    }

    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        number((self.1)(arguments[0].as_f64()?))
    }
}

impl Definition for Eval {
    fn iri(&self) -> &'static str {
        EVAL
    }

    fn accepts(&self, count: usize) -> bool {
        count >= 2
    }

    fn is_function(&self) -> bool {
        true
    }

    fn compute(&self, arguments: &[&Literal]) -> Option<Literal> {
        let [text, values @ ..] = arguments else { return None };
        let Literal::String(text) = text else { return None };
        let (names, text) = text.split_once(':').unwrap_or(("", text));
        let names: Vec<&str> = names.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
        let values = values.iter().map(|value| value.as_f64()).collect::<Option<Vec<f64>>>()?;
        if names.len() > values.len() {
            return None;
        }
        let named: Vec<(&str, f64)> = names.into_iter().zip(values).collect();
        number(expression::value(text, &named)?)
    }
}

impl BuiltIn {
    /// Returns the expression of a `swrlm:eval` atom, preceded by the local names of the atom's arguments.
    /// Returns `None` if the expression already has names (contains a colon), if `names` is empty, and for
    /// other built-ins. A constant argument has the name `_`.
    pub fn with_names(self, expression: &str, names: &[Option<&str>]) -> Option<String> {
        let is_eval = self.name() == EVAL && !expression.contains(':') && !names.is_empty();
        let local = |name: &str| name.rsplit(['#', '/', ':']).next().map(str::to_owned);
        let names: Vec<String> =
            names.iter().map(|name| name.and_then(local).unwrap_or("_".into())).collect();
        is_eval.then(|| format!("{}: {expression}", names.join(", ")))
    }
}
