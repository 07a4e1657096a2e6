//! Names in PDDL of what a knowledge base names by IRIs and literals, as PLANTA's `OWLToPDDL` gives them.
//!
//! An entity has the local part of its IRI; what a rule or an axiom concludes is `inferred-` and that part with a capital; a
//! literal is its lexical form, an underscore and the local part of its datatype: `0.25_decimal`, `FALSE_string`.

use std::collections::HashMap;

use ontology::vocab::{local_name, xsd};
use pddl::ast::Name;
use rules::Literal;

/// That one number is less than another.
pub(super) const LESS: &str = "lessThan";
/// That two numbers are equal.
pub(super) const EQUAL: &str = "equalTo";
/// That something contradicts an axiom.
pub(super) const INCONSISTENT: &str = "inferred-Inconsistent";
/// That a design cannot be realised, or can, where its second argument is true.
pub(super) const UNREALISABLE: &str = "inferred-Fd_realisability";
/// What PLANTA's domains ground a function with that is not at work.
pub(super) const UNGROUND: &str = "fd_unground";
/// The types that domains give to numbers; the first unless a domain has the second only.
pub(super) const NUMBER_TYPES: [&str; 2] = ["numerical-object", "owl-number"];

/// The name of an individual, a class or a property.
pub(super) fn plain(iri: &str) -> Name {
    Name::new(&spelled(local_name(iri)))
}

/// The name of what is stated of a class or property, or follows.
pub(super) fn inferred(plain: &Name) -> Name {
    let mut letters = plain.as_str().chars();
    let first = letters.next().map(|first| first.to_uppercase().collect::<String>()).unwrap_or_default();
    Name::new(&format!("inferred-{first}{}", letters.as_str()))
}

/// The name of a literal.
pub(super) fn literal(lexical: &str, datatype: Option<&str>) -> Name {
    let datatype = local_name(datatype.unwrap_or(xsd::STRING));
    Name::new(&format!("{}_{datatype}", spelled(lexical)))
}

/// A text without what would end a name in PDDL.
fn spelled(text: &str) -> String {
    let allowed = |letter: char| {
        letter.is_ascii_graphic() && !"()[]{};\"'?:,|`\\".contains(letter) || letter.is_alphanumeric()
    };
    text.chars().map(|letter| if allowed(letter) { letter } else { '_' }).collect()
}

/// The number that a name such as `0.25_decimal` stands for.
pub(super) fn number(name: &Name) -> Option<Literal> {
    let (lexical, datatype) = name.as_str().rsplit_once('_')?;
    let namespace = &xsd::DECIMAL[..xsd::DECIMAL.len() - local_name(xsd::DECIMAL).len()];
    let value = Literal::parse(lexical, Some(&format!("{namespace}{}", datatype.to_ascii_lowercase())), None);
    value.as_rational().is_some().then_some(value)
}

/// The names of literals by value: `1.50` and `1.5` are one number, so that they are one object.
#[derive(Debug, Clone, Default)]
pub(super) struct Literals {
    names: HashMap<Literal, Name>,
}

impl Literals {
    /// A literal is known by this name from now on, unless it has another one.
    pub fn insert(&mut self, value: Literal, name: Name) {
        self.names.entry(value).or_insert(name);
    }

    /// Literals have these names first.
    pub fn prefer(&mut self, mut others: Self) {
        std::mem::swap(self, &mut others);
        for (value, name) in others.names {
            self.insert(value, name);
        }
    }

    /// The name of a literal; a decimal number that no file names is written as PLANTA writes it, with a fraction.
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
