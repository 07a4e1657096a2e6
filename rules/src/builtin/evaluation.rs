//! The values of built-ins: whether they hold of arguments, and what they compute.

use std::cmp::Ordering;

use super::signature::{BuiltIn, Kind, SWRLB};
use super::{library, math, pattern, temporal, text, uri};
use crate::literal::Literal;

impl BuiltIn {
    /// The built-in of an IRI: of `swrlb`, or of the libraries `swrlm` and `temporal` of `SWRLTab` in any of their versions.
    pub fn from_iri(iri: &str) -> Option<Self> {
        match iri.strip_prefix(SWRLB) {
            Some(local) => Self::from_name(local),
            None => library::find(iri),
        }
    }

    /// All ways in which a built-in holds: for each, the values of the arguments that are not known, in their order. Empty
    /// unless it [binds](Self::binds) them.
    pub fn solve(self, arguments: &[Option<&Literal>]) -> Vec<Vec<Literal>> {
        let known: Option<Vec<&Literal>> = arguments.iter().copied().collect();
        if let Some(known) = known {
            return if self.holds(&known) { vec![Vec::new()] } else { Vec::new() };
        }
        let rest: Option<Vec<&Literal>> = arguments.iter().skip(1).copied().collect();
        match (arguments.first(), rest, self.shape()) {
            (Some(None), Some(rest), Some((.., Kind::Choice))) => {
                pattern::tokens(&rest).into_iter().map(|token| vec![token]).collect()
            }
            (Some(None), Some(rest), _) => self.compute(&rest).map(|value| vec![value]).into_iter().collect(),
            (Some(Some(whole)), None, Some((.., Kind::Parts))) => {
                self.parts(whole, &arguments[1..]).into_iter().collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether a test holds of its arguments; for a function, whether the first argument is its result.
    pub fn holds(self, arguments: &[&Literal]) -> bool {
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
            // SWRL defines it as the negation of `equal`; what has no value satisfies neither.
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

    /// The pattern among the arguments that are known, and what is wrong with it, if anything.
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

    /// The result of a function on its arguments (without the first); `None` where it is undefined.
    pub fn compute(self, arguments: &[&Literal]) -> Option<Literal> {
        if !self.is_function() || !self.accepts(arguments.len() + 1) {
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
