//! Evaluation of built-ins: tests of arguments, and computed values.

use std::cmp::Ordering;

use super::signature::{BuiltIn, Kind, SWRLB};
use super::{library, math, pattern, temporal, text, uri};
use crate::literal::Literal;

impl BuiltIn {
    /// Returns the built-in with an IRI of `swrlb`, or of any version of the libraries `swrlm` and `temporal`
    /// of `SWRLTab`; `None` for other IRIs, and for a name that these libraries do not have.
    pub fn from_iri(iri: &str) -> Option<Self> {
        match iri.strip_prefix(SWRLB) {
            Some(local) => Self::from_name(local),
            None => library::find(iri),
        }
    }

    /// Returns all solutions of a built-in. Each solution contains the values of the unknown arguments, in
    /// order. If all arguments are known, there is one empty solution if the built-in holds. The result is
    /// empty if the built-in does not [bind](Self::binds) the unknown arguments.
    pub fn solve(self, arguments: &[Option<&Literal>]) -> Vec<Vec<Literal>> {
        if self.is_undecided(arguments.iter().copied().flatten()) {
            return Vec::new();
        }
        let bound_arguments: Option<Vec<&Literal>> = arguments.iter().copied().collect();
        if let Some(bound_arguments) = bound_arguments {
            return if self.holds(&bound_arguments) { vec![Vec::new()] } else { Vec::new() };
        }
        let inputs: Option<Vec<&Literal>> = arguments.iter().skip(1).copied().collect();
        match (arguments.first(), inputs, self.shape()) {
            (Some(None), Some(inputs), Some((.., Kind::Choice))) => {
                pattern::tokens(&inputs).into_iter().map(|token| vec![token]).collect()
            }
            (Some(None), Some(inputs), _) => self.compute(&inputs).map(|v| vec![v]).into_iter().collect(),
            (Some(Some(whole)), None, Some((.., Kind::Parts))) => {
                self.parts(whole, &arguments[1..]).into_iter().collect()
            }
            _ => Vec::new(),
        }
    }

    /// Returns `true` if an argument is a fresh value, unless the built-in is a test of a data range. A fresh value can
    /// be any value, so no other built-in holds for it.
    fn is_undecided<'l>(self, mut arguments: impl Iterator<Item = &'l Literal>) -> bool {
        !matches!(self, Self::DataRange | Self::OutsideDataRange) && arguments.any(Literal::is_fresh)
    }

    /// Returns `true` if a test holds. For a function, returns `true` if the first argument is its result;
    /// for `tokenize`, if the first argument is one of its results.
    pub fn holds(self, arguments: &[&Literal]) -> bool {
        if self.is_undecided(arguments.iter().copied()) {
            return false;
        }
        match (self, arguments) {
            (Self::Tokenize, [token, rest @ ..]) => pattern::tokens(rest).iter().any(|other| other == *token),
            (Self::Custom(custom), _) if !self.is_function() => custom.definition().holds(arguments),
            (_, [result, rest @ ..]) if self.is_function() => {
                self.compute(rest).is_some_and(|value| value == **result)
            }
            (Self::Matches, _) => pattern::matches(arguments),
            (_, [left, right]) => self.test(left, right),
            _ => false,
        }
    }

    fn test(self, left: &Literal, right: &Literal) -> bool {
        let order = || left.compare(right);
        match self {
            Self::DataRange => matches!(right, Literal::Uri(datatype) if left.is_in(datatype)),
            Self::OutsideDataRange => {
                matches!(right, Literal::Uri(datatype) if left.membership(datatype) == Some(false))
            }
            Self::Equal => order() == Some(Ordering::Equal),
            // SWRL defines `notEqual` as the negation of `equal`. An ill-typed literal has no value, and
            // satisfies neither.
            Self::NotEqual => {
                !left.is_ill_typed() && !right.is_ill_typed() && order() != Some(Ordering::Equal)
            }
            Self::LessThan => order() == Some(Ordering::Less),
            Self::LessThanOrEqual => order().is_some_and(Ordering::is_le),
            Self::GreaterThan => order() == Some(Ordering::Greater),
            Self::GreaterThanOrEqual => order().is_some_and(Ordering::is_ge),
            _ => text::test(self, left, right),
        }
    }

    /// Returns the regular expression of the built-in and the reason why it cannot be used. Returns `None` if
    /// the expression is valid (even if it exceeds the size limit) or not constant, and for built-ins without one.
    /// Constant flags are checked, too. `argument` returns the argument at a position if it is constant.
    pub(crate) fn bad_pattern<'l>(
        self,
        argument: &impl Fn(usize) -> Option<&'l Literal>,
    ) -> Option<(String, String)> {
        let (pattern, flags) = match self {
            Self::Matches => (1, 2),
            Self::Tokenize => (2, 3),
            Self::Replace => (2, 4),
            _ => return None,
        };
        let text = |at| argument(at).and_then(text::as_text);
        let pattern = text(pattern)?;
        let fault = pattern::fault(pattern, text(flags).unwrap_or_default())?;
        Some((pattern.to_owned(), fault))
    }

    /// Returns the result of a function. `arguments` omits the first argument, which is the result.
    /// Returns `None` if the result is undefined.
    pub fn compute(self, arguments: &[&Literal]) -> Option<Literal> {
        let is_applicable = self.is_function() && self.accepts(arguments.len() + 1);
        if !is_applicable || self.is_undecided(arguments.iter().copied()) {
            return None;
        }
        if let Self::Custom(custom) = self {
            return custom.definition().compute(arguments);
        }
        if self == Self::Replace {
            return pattern::replace(arguments);
        }
        let result = math::compute(self, arguments).or_else(|| text::compute(self, arguments));
        result.or_else(|| temporal::compute(self, arguments)).or_else(|| uri::compute(self, arguments))
    }
}
