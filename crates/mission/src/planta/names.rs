//! PDDL names of IRIs and literals, following PLANTA's `OWLToPDDL`.
//!
//! The name of an entity is the local part of its IRI. The name of an inferred predicate is
//! `inferred-` with this part, capitalised. The name of a literal is its lexical form, an
//! underscore and the local part of its datatype:
//! `0.25_decimal`, `FALSE_string`.

use std::collections::HashMap;

use ontology::vocab::{local_name, xsd};
use pddl::ast::Name;
use rules::Literal;

pub(super) const LESS: &str = "lessThan";
pub(super) const EQUAL: &str = "equalTo";
/// Derived predicate that holds if an axiom is violated.
pub(super) const INCONSISTENT: &str = "inferred-Inconsistent";
/// Predicate of a design and a boolean. With `false`, the design is not realisable.
pub(super) const UNREALISABLE: &str = "inferred-Fd_realisability";
/// Predicate of a function and the design that is configured for it.
pub(super) const GROUNDING: &str = "functionGrounding";
/// Pseudo-design in PLANTA's domains that marks a function without a design.
pub(super) const UNGROUND: &str = "fd_unground";
/// Type names for numbers. The first name is the default; the second name is used only for domains
/// that use it and not the first.
pub(super) const NUMBER_TYPES: [&str; 2] = ["numerical-object", "owl-number"];

pub(super) fn plain(iri: &str) -> Name {
    Name::new(&spelled(local_name(iri)))
}

pub(super) fn inferred(plain: &Name) -> Name {
    let mut letters = plain.as_str().chars();
    let first = letters.next().map(|first| first.to_uppercase().collect::<String>()).unwrap_or_default();
    Name::new(&format!("inferred-{first}{}", letters.as_str()))
}

pub(super) fn literal(lexical: &str, datatype: Option<&str>) -> Name {
    let datatype = local_name(datatype.unwrap_or(xsd::STRING));
    Name::new(&format!("{}_{datatype}", spelled(lexical)))
}

/// Replaces by underscores: white space, control characters, parentheses, square and curly brackets, quotation marks,
/// backticks, the characters `;?:,|\`, and non-ASCII characters that are neither letters nor digits. Other ASCII
/// symbols, such as `.` and `#`, are kept, although standard PDDL names do not admit them.
fn spelled(text: &str) -> String {
    let allowed = |letter: char| {
        letter.is_ascii_graphic() && !"()[]{};\"'?:,|`\\".contains(letter) || letter.is_alphanumeric()
    };
    text.chars().map(|letter| if allowed(letter) { letter } else { '_' }).collect()
}

/// Numeric datatypes of XSD.
const NUMERIC_TYPES: [&str; 16] = [
    "decimal",
    "double",
    "float",
    "integer",
    "nonNegativeInteger",
    "positiveInteger",
    "nonPositiveInteger",
    "negativeInteger",
    "long",
    "int",
    "short",
    "byte",
    "unsignedLong",
    "unsignedInt",
    "unsignedShort",
    "unsignedByte",
];

/// Parses a name such as `0.25_decimal` as a number. `None` if the name is not of this form.
pub(super) fn number(name: &Name) -> Option<Literal> {
    let (lexical, datatype) = name.as_str().rsplit_once('_')?;
    // Names in PDDL have no case.
    let datatype = NUMERIC_TYPES.iter().find(|known| known.eq_ignore_ascii_case(datatype))?;
    let namespace = &xsd::DECIMAL[..xsd::DECIMAL.len() - local_name(xsd::DECIMAL).len()];
    let value = Literal::parse(lexical, Some(&format!("{namespace}{datatype}")), None);
    value.as_rational().is_some().then_some(value)
}

/// PDDL names of literals by value. `1.50` and `1.5` are equal, so they have the same name.
#[derive(Debug, Clone, Default)]
pub(super) struct Literals {
    names: HashMap<Literal, Name>,
}

impl Literals {
    /// Names a literal, unless it already has a name.
    pub fn insert(&mut self, value: Literal, name: Name) {
        self.names.entry(value).or_insert(name);
    }

    /// Adds the names in `others`, which take precedence over the present names.
    pub fn prefer(&mut self, mut others: Self) {
        std::mem::swap(self, &mut others);
        for (value, name) in others.names {
            self.insert(value, name);
        }
    }

    /// Returns the name of a literal. A decimal without a given name is written with a fraction, as
    /// in PLANTA.
    pub fn name(&self, value: &Literal) -> Name {
        self.names.get(value).cloned().unwrap_or_else(|| {
            let mut lexical = value.lexical();
            if matches!(value, Literal::Decimal(_)) && !lexical.contains('.') {
                lexical.push_str(".0");
            }
            let datatype = if matches!(value, Literal::Decimal(_)) { xsd::DECIMAL } else { value.datatype() };
            literal(&lexical, Some(datatype))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{NUMERIC_TYPES, Name, number};

    #[test]
    fn numbers_of_all_datatypes_are_recognised_in_any_case() {
        for datatype in NUMERIC_TYPES {
            let lexical = if datatype.starts_with("negative") || datatype.starts_with("nonPositive") {
                "-7"
            } else {
                "7"
            };
            for datatype in [datatype.to_owned(), datatype.to_ascii_lowercase()] {
                let name = Name::new(&format!("{lexical}_{datatype}"));
                assert!(number(&name).is_some(), "{name}");
            }
        }
        for other in ["7", "7_string", "x_integer", "7_robot"] {
            assert!(number(&Name::new(other)).is_none(), "{other}");
        }
    }
}
