//! What the robot reports, as updates of an engine.
//!
//! A functional value is replaced in one [`Delta`], so that no engine ever sees two of them. Retraction does the
//! rest: a status that was concluded from the old value goes with it.

use rules::{Atom, BuiltIn, Delta, Engine, Fact, Literal, Symbol, Symbols, Term as Argument};

use super::facts::Facts;
use super::terms::{self, beside};
use crate::error::Error;
use crate::vocab::local_name;

/// How a component is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Out of order.
    Failed,
    /// In order again after a failure.
    Recovered,
    /// In order.
    Working,
}

/// How the vocabularies in real use write a status: strings in MROS, other strings in PLANTA, booleans before that.
fn spellings(status: Status) -> Vec<Literal> {
    let (mros, planta, truth) = match status {
        Status::Failed => ("FALSE", "ERROR", false),
        Status::Recovered => ("RECOVERED", "OK", true),
        Status::Working => ("TRUE", "OK", true),
    };
    vec![Literal::string(mros), Literal::string(planta), Literal::Boolean(truth)]
}

/// Whether a status in any spelling says that a component is out of order.
pub(crate) fn is_failed(status: &str) -> bool {
    spells(Status::Failed, status)
}

/// Whether a status says that a component is in order after a failure. Vocabularies without a word for that say only
/// that it is in order, which is not meant here.
pub(crate) fn is_recovered(status: &str) -> bool {
    spells(Status::Recovered, status) && !spells(Status::Working, status)
}

fn spells(status: Status, text: &str) -> bool {
    spellings(status).iter().any(|literal| literal.lexical() == text)
}

/// The update that gives a component a status, in place of any it was said to have. The component is named by its
/// IRI or local name; the status is spelled as the knowledge base's range of the status property asks.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such component.
pub fn component_status(engine: &mut Engine, component: &str, status: Status) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(beside(terms::STATUS, class));
    let spellings: Vec<Symbol> =
        spellings(status).into_iter().map(|literal| engine.symbols_mut().literal(literal)).collect();
    let fitting = spellings.iter().copied().find(|&value| allows(engine, property, value));
    let value = fitting.unwrap_or(spellings[0]);
    Ok(replace(engine, property, subject, Some(value)))
}

/// As [`component_status`], with the status as someone else spells it; whether the knowledge base allows it is not
/// looked at, so that a wrong spelling is a contradiction.
///
/// # Errors
/// As [`component_status`].
pub fn component_report(engine: &mut Engine, component: &str, status: Literal) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(beside(terms::STATUS, class));
    let value = engine.symbols_mut().literal(status);
    Ok(replace(engine, property, subject, Some(value)))
}

/// The update that takes away what was said of a component's status.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such component.
pub fn clear_component_status(engine: &mut Engine, component: &str) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(beside(terms::STATUS, class));
    Ok(replace(engine, property, subject, None))
}

/// The update after which a function design, named by its IRI or local name, is said not to be realisable whatever its components and
/// measurements are like, or after which nobody says so any more.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such design.
pub fn design_realisable(engine: &mut Engine, design: &str, realisable: bool) -> Result<Delta, Error> {
    let (subject, class) = Facts::new(engine).find("function design", terms::FUNCTION_DESIGN, design)?;
    let property = engine.symbols_mut().name(beside(terms::REALISABILITY, class));
    let value = (!realisable).then(|| engine.symbols_mut().literal(Literal::Boolean(false)));
    Ok(replace(engine, property, subject, value))
}

/// The update that sets the measured value of a quality attribute, named by the IRI or local name of its type.
///
/// Where nothing holds measurements of that type yet, an individual `obs_<type>` is made. Groundings whose design has
/// an estimation of the type are linked to what holds the measurement, as the rules of MROS expect.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such attribute type.
pub fn measured_value(engine: &mut Engine, attribute: &str, value: Literal) -> Result<Delta, Error> {
    let facts = Facts::new(engine);
    let (kind, class) = facts.find("quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
    let groundings = groundings(facts, kind);
    let mut holders = holders(facts, kind);
    let mut delta = Delta::default();
    if holders.is_empty() {
        let iri = facts.name(kind).unwrap_or_default();
        let name = local_name(iri);
        let holder = format!("{}obs_{name}", &iri[..iri.len() - name.len()]);
        let holder = engine.symbols_mut().name(&holder);
        delta.insert = observation(engine.symbols_mut(), holder, kind, class);
        holders.push(holder);
    }
    let symbols = engine.symbols_mut();
    let property = symbols.name(beside(terms::HAS_VALUE, class));
    let (link, value) = (symbols.name(terms::HAS_QA_VALUE[0]), symbols.literal(value));
    for holder in holders {
        delta.insert.extend(groundings.iter().map(|&grounding| Fact::new(link, [grounding, holder])));
        let change = replace(engine, property, holder, Some(value));
        delta.insert.extend(change.insert);
        delta.delete.extend(change.delete);
    }
    Ok(delta)
}

/// The update that withdraws the measured value of a quality attribute, named by the IRI or local name of its type.
///
/// # Errors
/// As [`measured_value`].
pub fn unmeasured(engine: &mut Engine, attribute: &str) -> Result<Delta, Error> {
    let facts = Facts::new(engine);
    let (kind, class) = facts.find("quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
    let holders = holders(facts, kind);
    let property = engine.symbols_mut().name(beside(terms::HAS_VALUE, class));
    let changes = holders.into_iter().map(|holder| replace(engine, property, holder, None));
    let delete = changes.flat_map(|change| change.delete).collect();
    Ok(Delta { insert: Vec::new(), delete })
}

/// The facts that make `holder` hold measurements of a type.
fn observation(symbols: &mut Symbols, holder: Symbol, kind: Symbol, class: &str) -> Vec<Fact> {
    let mut facts = vec![
        Fact::new(symbols.name(beside(terms::QA_VALUE, class)), [holder]),
        Fact::new(symbols.name(beside(terms::IS_TYPE, class)), [holder, kind]),
    ];
    if let Some(measured) = symbols.find_name(terms::IS_MEASURED[0]) {
        let truth = symbols.literal(Literal::Boolean(true));
        facts.push(Fact::new(measured, [holder, truth]));
    }
    facts
}

/// What holds measurements of an attribute type: what says so, and what is named as MROS names it.
pub(crate) fn holders(facts: Facts, kind: Symbol) -> Vec<Symbol> {
    let named = |holder| facts.name(holder).is_some_and(|iri| local_name(iri).starts_with("obs_"));
    let mut holders = facts.subjects(kind, terms::IS_TYPE);
    holders.retain(|&holder| named(holder) || facts.is_true(holder, terms::IS_MEASURED));
    holders
}

/// The groundings whose design has an estimation of an attribute type.
fn groundings(facts: Facts, kind: Symbol) -> Vec<Symbol> {
    let values = facts.subjects(kind, terms::IS_TYPE).into_iter();
    let designs = values.flat_map(|value| facts.subjects(value, terms::HAS_ESTIMATION));
    designs.flat_map(|design| facts.subjects(design, terms::TYPE_FD)).collect()
}

/// The update after which `subject` has one stated value of a property, or none.
pub fn replace(engine: &Engine, property: Symbol, subject: Symbol, value: Option<Symbol>) -> Delta {
    let pattern = [Some(subject), None];
    let rows = engine.matching(property, &pattern);
    let old = rows.map(|row| Fact::new(property, [subject, row[1]])).filter(|fact| engine.is_asserted(fact));
    let new = value.map(|value| Fact::new(property, [subject, value]));
    let delete = old.filter(|fact| Some(fact) != new.as_ref()).collect();
    Delta { insert: new.into_iter().collect(), delete }
}

/// Whether no constraint of the program forbids a value because it lies outside the property's range: outside an
/// enumeration, or in another datatype.
fn allows(engine: &Engine, property: Symbol, value: Symbol) -> bool {
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
            Some((arguments.get(1)?, tests))
        }
        _ => None,
    });
    !tests.any(|(tested, tests)| tests.iter().all(|test| forbids(test, tested)))
}
