//! Translates reports of the robot to updates of an engine.
//!
//! The value of a functional property is replaced in one [`Delta`], so that no engine evaluates rules with two
//! values. Conclusions from the old value are retracted with it.

use std::collections::BTreeSet;

use rules::{Atom, BuiltIn, Delta, Engine, Fact, Literal, Symbol, Symbols, Term as Argument};

use super::facts::Facts;
use super::terms::{self, term_for};
use crate::error::Error;
use crate::vocab::{local_name, owl};

/// State of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The component does not work.
    Failed,
    /// The component works again after a failure.
    Recovered,
    /// The component works.
    Working,
}

impl Status {
    /// Returns the spelling of the status in MROS: `FALSE`, `RECOVERED` or `TRUE`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Failed => "FALSE",
            Self::Recovered => "RECOVERED",
            Self::Working => "TRUE",
        }
    }

    /// Returns the status with this spelling in MROS.
    pub fn from_word(word: &str) -> Option<Self> {
        [Self::Failed, Self::Recovered, Self::Working].into_iter().find(|status| status.word() == word)
    }
}

/// Returns the spellings of a status in the supported vocabularies: a string in MROS, another string in
/// PLANTA, and a boolean in older vocabularies.
fn spellings(status: Status) -> Vec<Literal> {
    let (planta, truth) = match status {
        Status::Failed => ("ERROR", false),
        Status::Recovered | Status::Working => ("OK", true),
    };
    vec![Literal::string(status.word()), Literal::string(planta), Literal::Boolean(truth)]
}

/// Returns `true` if a status denotes a failure, in any spelling.
pub fn is_failed(status: &str) -> bool {
    spells(Status::Failed, status)
}

/// Returns `true` if a status denotes a recovery. Vocabularies without a term for recovery use the
/// status of a working component, which does not count as a recovery.
pub(crate) fn is_recovered(status: &str) -> bool {
    spells(Status::Recovered, status) && !spells(Status::Working, status)
}

fn spells(status: Status, text: &str) -> bool {
    spellings(status).iter().any(|literal| literal.lexical() == text)
}

/// Builds the update that sets the status of a component, given by its IRI or local name. The status gets the
/// spelling that the constraints of the knowledge base allow.
///
/// # Errors
/// Returns [`Error::Unknown`] if the knowledge base has no such component.
pub fn component_status(engine: &mut Engine, component: &str, status: Status) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(term_for(terms::STATUS, class));
    let spellings: Vec<Symbol> =
        spellings(status).into_iter().map(|literal| engine.symbols_mut().literal(literal)).collect();
    // If all spellings are allowed, or none is, the spelling of MROS is used.
    let fitting = spellings.iter().copied().find(|&value| allows(engine, property, subject, value));
    let value = fitting.unwrap_or(spellings[0]);
    Ok(replace(engine, property, subject, Some(value)))
}

/// Builds the update that sets the status of a component in a given spelling. The spelling is not
/// checked: a wrong spelling can violate a constraint of the knowledge base.
///
/// # Errors
/// Returns the errors of [`component_status`].
pub fn component_report(engine: &mut Engine, component: &str, status: Literal) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(term_for(terms::STATUS, class));
    let value = engine.symbols_mut().literal(status);
    Ok(replace(engine, property, subject, Some(value)))
}

/// Builds the update that removes the status of a component.
///
/// # Errors
/// Returns [`Error::Unknown`] if the knowledge base has no such component.
pub fn clear_component_status(engine: &mut Engine, component: &str) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(term_for(terms::STATUS, class));
    Ok(replace(engine, property, subject, None))
}

/// Builds the update that states that a function design, given by its IRI or local name, is not realisable,
/// independently of component states and measurements. If `realisable`, the update removes the stated realisability of
/// the design.
///
/// # Errors
/// Returns [`Error::Unknown`] if the knowledge base has no such design.
pub fn design_realisable(engine: &mut Engine, design: &str, realisable: bool) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("function design", terms::FUNCTION_DESIGN, design)?;
    let property = engine.symbols_mut().name(term_for(terms::REALISABILITY, class));
    let value = (!realisable).then(|| engine.symbols_mut().literal(Literal::Boolean(false)));
    Ok(replace(engine, property, subject, value))
}

/// Builds the update that sets the measured value of a quality attribute, given by the IRI or local name of its
/// type.
///
/// If no individual holds measurements of this type, the update adds an individual `obs_<type>`, or `obs_<type>_` if
/// that is another value. Groundings whose design has an estimation of the type are linked to the individuals that
/// hold the measurement, as required by the rules of MROS.
///
/// # Errors
/// Returns [`Error::Unknown`] if the knowledge base has no such attribute type.
pub fn measured_value(engine: &mut Engine, attribute: &str, value: Literal) -> Result<Delta, Error> {
    let facts = Facts::new(engine);
    let (kind, class) = facts.find("quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
    let groundings = groundings(facts, kind);
    let mut holders = holders(facts, kind);
    let mut delta = Delta::default();
    if holders.is_empty() {
        let iri = facts.name(kind).unwrap_or_default();
        let name = local_name(iri);
        // The IRI has the namespace of the attribute type and the prefix `obs_` of MROS.
        let mut holder = format!("{}obs_{name}", &iri[..iri.len() - name.len()]);
        // An estimation can have this name. It keeps its value.
        let is_value = |iri: &str| {
            let symbol = engine.symbols().find_name(iri);
            symbol.is_some_and(|symbol| !facts.objects(symbol, terms::IS_TYPE).is_empty())
        };
        while is_value(&holder) {
            holder.push('_');
        }
        let holder = engine.symbols_mut().name(&holder);
        delta.insert = observation(engine.symbols_mut(), holder, kind, class);
        holders.push(holder);
    }
    let symbols = engine.symbols_mut();
    let property = symbols.name(term_for(terms::HAS_VALUE, class));
    let (link, value) = (symbols.name(terms::HAS_QA_VALUE[0]), symbols.literal(value));
    for holder in holders {
        delta.insert.extend(groundings.iter().map(|&grounding| Fact::new(link, [grounding, holder])));
        let change = replace(engine, property, holder, Some(value));
        delta.insert.extend(change.insert);
        delta.delete.extend(change.delete);
    }
    Ok(delta)
}

/// Builds the update that removes the measured value of a quality attribute, given by the IRI or local name of
/// its type.
///
/// # Errors
/// Returns the errors of [`measured_value`].
pub fn unmeasured(engine: &mut Engine, attribute: &str) -> Result<Delta, Error> {
    let facts = Facts::new(engine);
    let (kind, class) = facts.find("quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
    let holders = holders(facts, kind);
    let property = engine.symbols_mut().name(term_for(terms::HAS_VALUE, class));
    let changes = holders.into_iter().map(|holder| replace(engine, property, holder, None));
    let delete = changes.flat_map(|change| change.delete).collect();
    Ok(Delta { insert: Vec::new(), delete })
}

fn observation(symbols: &mut Symbols, holder: Symbol, kind: Symbol, class: &str) -> Vec<Fact> {
    let mut facts = vec![
        Fact::new(symbols.name(term_for(terms::QA_VALUE, class)), [holder]),
        Fact::new(symbols.name(term_for(terms::IS_TYPE, class)), [holder, kind]),
    ];
    if let Some(measured) = symbols.find_name(terms::IS_MEASURED[0]) {
        let truth = symbols.literal(Literal::Boolean(true));
        facts.push(Fact::new(measured, [holder, truth]));
    }
    facts
}

/// Returns the individuals that hold measurements of an attribute type: individuals with `isMeasured`
/// true, and individuals named `obs_…` as in MROS that have no `isMeasured` and are no estimations of designs.
pub(crate) fn holders(facts: Facts, kind: Symbol) -> Vec<Symbol> {
    let named = |holder| {
        facts.name(holder).is_some_and(|iri| local_name(iri).starts_with("obs_"))
            && facts.literals(holder, terms::IS_MEASURED).is_empty()
            && facts.subjects(holder, terms::HAS_ESTIMATION).is_empty()
    };
    let mut holders = facts.subjects(kind, terms::IS_TYPE);
    holders.retain(|&holder| named(holder) || facts.is_true(holder, terms::IS_MEASURED));
    holders
}

fn groundings(facts: Facts, kind: Symbol) -> Vec<Symbol> {
    let values = facts.subjects(kind, terms::IS_TYPE).into_iter();
    let designs = values.flat_map(|value| facts.subjects(value, terms::HAS_ESTIMATION));
    designs.flat_map(|design| facts.subjects(design, terms::TYPE_FD)).collect()
}

/// Builds the update after which `value` is the only asserted value of a property of `subject`, which can have several
/// names. Without `value`, the update removes all asserted values.
pub fn replace(engine: &Engine, property: Symbol, subject: Symbol, value: Option<Symbol>) -> Delta {
    let pattern = [Some(subject), None];
    let same_as = engine.symbols().find_name(owl::SAME_AS).filter(|_| engine.program().equality);
    let mut names = BTreeSet::from([subject]);
    names.extend(same_as.iter().flat_map(|&same_as| engine.matching(same_as, &pattern).map(|row| row[1])));
    let values: BTreeSet<Symbol> = engine.matching(property, &pattern).map(|row| row[1]).collect();
    let facts_of = |&name: &Symbol| values.iter().map(move |&value| Fact::new(property, [name, value]));
    let old = names.iter().flat_map(facts_of).filter(|fact| engine.is_asserted(fact));
    let new = value.map(|value| Fact::new(property, [subject, value]));
    let delete = old.filter(|fact| Some(fact) != new.as_ref()).collect();
    Delta { insert: new.into_iter().collect(), delete }
}

/// Returns `true` if no constraint of the program excludes the value for the property of the subject.
/// Considers enumerations and datatypes.
fn allows(engine: &Engine, property: Symbol, subject: Symbol, value: Symbol) -> bool {
    let literal = |symbol| engine.symbols().value(symbol).as_literal();
    let Some(value) = literal(value) else { return true };
    let forbids = |test: &Atom, tested: &Argument| match test {
        Atom::Different(first, Argument::Constant(member)) if first == tested => {
            literal(*member).is_some_and(|member| value.differs(member))
        }
        Atom::BuiltIn { built_in: BuiltIn::OutsideDataRange, arguments } => match arguments[..] {
            [first, Argument::Constant(datatype)] if first == *tested => {
                matches!(literal(datatype), Some(Literal::Uri(datatype)) if !value.is_in(datatype))
            }
            _ => false,
        },
        _ => false,
    };
    let constraints = engine.program().rules.iter().filter(|rule| rule.head.is_empty());
    let mut tests = constraints.filter_map(|rule| match &rule.body[..] {
        [Atom::Relation { predicate, arguments }, tests @ ..]
            if *predicate == property && !tests.is_empty() =>
        {
            match &arguments[..] {
                // The constraint is about another individual.
                [Argument::Constant(individual), _] if *individual != subject => None,
                [_, tested] => Some((tested, tests)),
                _ => None,
            }
        }
        _ => None,
    });
    !tests.any(|(tested, tests)| tests.iter().all(|test| forbids(test, tested)))
}
