//! What the robot reports, as updates of an engine.
//!
//! A functional value is replaced in one [`Delta`], so that no engine ever sees two of them. Retraction does the
//! rest: a status that was concluded from the old value goes with it.

use rules::{Atom, Delta, Engine, Fact, Literal, Symbol, Symbols, Term as Argument};

use super::terms::{self, Term, beside};
use super::{Individual, View};
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

/// The update that gives a component a status, in place of any it was said to have. The component is named by its
/// IRI or local name; the status is spelled as the knowledge base's range of the status property asks.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such component.
pub fn component_status(engine: &mut Engine, component: &str, status: Status) -> Result<Delta, Error> {
    let (individual, class) = find(engine, "component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(beside(terms::STATUS, class));
    let subject = engine.symbols_mut().name(&individual.iri);
    let spellings: Vec<Symbol> =
        spellings(status).into_iter().map(|literal| engine.symbols_mut().literal(literal)).collect();
    let fitting = spellings.iter().copied().find(|&value| allows(engine, property, value));
    let value = fitting.unwrap_or(spellings[0]);
    Ok(replace(engine, property, subject, Some(value)))
}

/// The update that takes away what was said of a component's status.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such component.
pub fn clear_component_status(engine: &mut Engine, component: &str) -> Result<Delta, Error> {
    let (individual, class) = find(engine, "component", terms::COMPONENT, component)?;
    let property = engine.symbols_mut().name(beside(terms::STATUS, class));
    let subject = engine.symbols_mut().name(&individual.iri);
    Ok(replace(engine, property, subject, None))
}

/// The update that sets the measured value of a quality attribute, named by the IRI or local name of its type.
///
/// Where nothing holds measurements of that type yet, an individual `obs_<type>` is made. Groundings whose design has
/// an estimation of the type are linked to what holds the measurement, as the rules of MROS expect.
///
/// # Errors
/// [`Error::Unknown`] where the knowledge base has no such attribute type.
pub fn measured_value(engine: &mut Engine, attribute: &str, value: Literal) -> Result<Delta, Error> {
    let (kind, class) = find(engine, "quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
    let groundings = groundings(engine, &kind);
    let measurements = View::new(engine).measurements().into_iter();
    let mut holders: Vec<Individual> = measurements
        .filter(|measurement| measurement.attribute == kind.name)
        .map(|measurement| measurement.individual)
        .collect();
    let mut delta = Delta::default();
    if holders.is_empty() {
        let holder =
            Individual::new(&format!("{}obs_{}", &kind.iri[..kind.iri.len() - kind.name.len()], kind.name));
        delta.insert = observation(engine.symbols_mut(), &holder, &kind, class);
        holders.push(holder);
    }
    let symbols = engine.symbols_mut();
    let property = symbols.name(beside(terms::HAS_VALUE, class));
    let (link, value) = (symbols.name(terms::HAS_QA_VALUE[0]), symbols.literal(value));
    for holder in holders {
        let subject = engine.symbols_mut().name(&holder.iri);
        for grounding in &groundings {
            let grounding = engine.symbols_mut().name(&grounding.iri);
            delta.insert.push(Fact::new(link, [grounding, subject]));
        }
        let change = replace(engine, property, subject, Some(value));
        delta.insert.extend(change.insert);
        delta.delete.extend(change.delete);
    }
    Ok(delta)
}

/// The facts that make `holder` hold measurements of a type.
fn observation(symbols: &mut Symbols, holder: &Individual, kind: &Individual, class: &str) -> Vec<Fact> {
    let (subject, kind) = (symbols.name(&holder.iri), symbols.name(&kind.iri));
    let mut facts = vec![
        Fact::new(symbols.name(beside(terms::QA_VALUE, class)), [subject]),
        Fact::new(symbols.name(beside(terms::IS_TYPE, class)), [subject, kind]),
    ];
    if let Some(measured) = symbols.find_name(terms::IS_MEASURED[0]) {
        let truth = symbols.literal(Literal::Boolean(true));
        facts.push(Fact::new(measured, [subject, truth]));
    }
    facts
}

/// The groundings whose design has an estimation of an attribute type.
fn groundings(engine: &Engine, kind: &Individual) -> Vec<Individual> {
    let view = View::new(engine);
    let estimates = |design: &Individual| {
        let values = view.objects(&design.iri, terms::HAS_ESTIMATION);
        values.iter().any(|value| view.objects(&value.iri, terms::IS_TYPE).contains(kind))
    };
    let groundings = view.members(terms::FUNCTION_GROUNDING).into_iter();
    groundings
        .filter(|grounding| view.objects(&grounding.iri, terms::TYPE_FD).iter().any(estimates))
        .collect()
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

/// Whether no constraint of the program forbids a value that lies outside an enumerated range of the property.
fn allows(engine: &Engine, property: Symbol, value: Symbol) -> bool {
    let ranges = engine.program().rules.iter().filter(|rule| rule.head.is_empty()).filter_map(|rule| {
        match &rule.body[..] {
            [Atom::Relation { predicate, arguments }, Atom::Not { predicate: range, arguments: tested }]
                if *predicate == property && arguments.get(1) == tested.first() =>
            {
                Some(*range)
            }
            _ => None,
        }
    });
    let mut ranges = ranges.filter(|range| is_enumeration(engine, *range));
    ranges.all(|range| engine.holds(&Fact::new(range, [value])))
}

/// Whether a range lists its members, and is not computed from the values that occur.
fn is_enumeration(engine: &Engine, range: Symbol) -> bool {
    let concluded = engine.program().rules.iter().flat_map(|rule| &rule.head);
    !concluded.into_iter().any(|atom| {
        matches!(atom, Atom::Relation { predicate, arguments }
            if *predicate == range && matches!(arguments[..], [Argument::Variable(_)]))
    })
}

/// The individual with that IRI or local name among the members of a notion, and the class that it is a member of.
fn find(
    engine: &Engine,
    kind: &'static str,
    term: Term,
    name: &str,
) -> Result<(Individual, &'static str), Error> {
    let view = View::new(engine);
    let mut known = Vec::new();
    for class in term {
        for individual in view.individuals_of(class) {
            if individual.iri == name || individual.name == local_name(name) && !name.contains(':') {
                return Ok((individual, class));
            }
            known.push(individual.name);
        }
    }
    known.sort();
    known.dedup();
    Err(Error::Unknown { kind, name: name.to_owned(), known })
}
