//! Reads of the values of quality attributes by rules. Determines which measurements a rule can read.

use std::sync::Arc;

use ontology::AXIOM_SOURCE;
use ontology::tomasys::Measurement;
use ontology::vocab::local_name;
use rules::{Atom, Engine, Fact, Rule, Symbol, Symbols, Term};

/// Local names of the properties that hold values of quality attributes.
pub const VALUE_PROPERTIES: [&str; 2] = ["hasValue", "qa_has_value"];

/// A condition of a rule on the value of an individual, which may be negated or in an aggregate.
#[derive(Debug, Clone)]
pub struct ValueRead {
    holder: Term,
    /// The value. `None` if the condition is negated, or only requires that there is a measurement.
    pub value: Option<Term>,
    /// `true` if the individual is an estimation of a design, not a measurement.
    pub is_estimation: bool,
    /// Facts that the rule requires of the individual: property and attribute type.
    kinds: Vec<(Symbol, Symbol)>,
    /// `true` if the rule requires that the attribute type has a requirement or a comparison operator.
    is_bounded: bool,
}

impl ValueRead {
    /// Returns `true` if this condition can read the value of the measurement.
    pub fn can_be(&self, measurement: &Measurement, engine: &Engine) -> bool {
        let symbols = engine.symbols();
        let iri = measurement.individual.iri.as_str();
        match self.holder {
            _ if self.is_estimation => false,
            Term::Constant(symbol) => symbols.value(symbol).as_name() == Some(iri),
            Term::Variable(_) => symbols.find_name(iri).is_some_and(|individual| {
                let has = |&(property, kind): &_| engine.holds(&Fact::new(property, [individual, kind]));
                self.kinds.iter().all(has)
            }),
        }
    }

    /// Returns `true` if the individual may be a measurement of the attribute with this IRI. Assumes that no
    /// design has a requirement for the attribute, and that the attribute has no comparison operator.
    fn can_measure(&self, attribute: &str, symbols: &Symbols) -> bool {
        let is_attribute = |kind: Symbol| symbols.value(kind).as_name() == Some(attribute);
        match self.holder {
            _ if self.is_estimation => false,
            // The measurement that the first report creates.
            Term::Constant(symbol) => {
                local(symbols, symbol).strip_prefix("obs_") == Some(local_name(attribute))
            }
            Term::Variable(_) => !self.is_bounded && self.kinds.iter().all(|(_, kind)| is_attribute(*kind)),
        }
    }
}

/// Returns the reads of each rule and axiom, in the order of the program.
pub(super) fn value_reads(engine: &Engine) -> Arc<[Vec<ValueRead>]> {
    let symbols = engine.symbols();
    let reads = |rule: &Rule| -> Vec<ValueRead> {
        let nested = rule.body.iter().flat_map(|atom| reads_in(symbols, atom.parts(), &rule.body));
        reads_in(symbols, &rule.body, &[]).into_iter().chain(nested).collect()
    };
    engine.program().rules.iter().map(reads).collect()
}

/// Returns `true` if a rule or an axiom may read a measurement of the attribute with this IRI. Assumes that no
/// design has a requirement for the attribute, and that the attribute has no comparison operator. `reads` is
/// the result of [`value_reads`].
pub(super) fn is_read(engine: &Engine, reads: &[Vec<ValueRead>], attribute: &str) -> bool {
    let symbols = engine.symbols();
    engine.program().rules.iter().zip(reads).any(|(rule, reads)| {
        reads.iter().any(|read| read.can_measure(attribute, symbols))
            && (*rule.identity.source != *AXIOM_SOURCE || concludes_more(symbols, rule))
    })
}

/// Returns `true` if the rule of an axiom concludes more than that a value exists. It then has several conditions or
/// concludes a property. Conclusions about properties of values or with names of the W3C do not count.
fn concludes_more(symbols: &Symbols, rule: &Rule) -> bool {
    rule.head.iter().any(|atom| {
        let Atom::Relation { predicate, arguments } = atom else { return false };
        let name = symbols.value(*predicate).as_name().unwrap_or_default();
        let is_copy = matches!(local_name(name), "hasValue" | "qa_has_value" | "isMeasured" | "hasQAvalue");
        let is_new = !name.starts_with("http://www.w3.org/") && !is_copy;
        is_new && (rule.body.len() > 1 || arguments.len() > 1)
    })
}

fn local(symbols: &Symbols, symbol: Symbol) -> &str {
    symbols.value(symbol).as_name().map_or("", local_name)
}

/// Returns the reads of a conjunction, without those in its aggregates. The conditions in `context` hold in addition.
fn reads_in(symbols: &Symbols, atoms: &[Atom], context: &[Atom]) -> Vec<ValueRead> {
    let mut conditions: Vec<(Symbol, &str, &[Term])> = Vec::new();
    for atom in atoms.iter().chain(context) {
        if let Atom::Relation { predicate, arguments } = atom {
            conditions.push((*predicate, local(symbols, *predicate), arguments.as_slice()));
        }
    }
    let links = |name: &str, to: Term| {
        conditions.iter().any(|(_, property, arguments)| *property == name && arguments.get(1) == Some(&to))
    };
    let is_bounded = |kind: Term| {
        conditions.iter().any(|(_, property, arguments)| match (*property, *arguments) {
            ("isQAtype", [subject, object]) => *object == kind && links("hasRequirement", *subject),
            ("qa_comparison_operator", [subject, _]) => *subject == kind,
            _ => false,
        })
    };
    let read = |atom: &Atom| {
        let (Atom::Relation { predicate, arguments } | Atom::Not { predicate, arguments }) = atom else {
            return None;
        };
        let is_positive = matches!(atom, Atom::Relation { .. });
        let (holder, value) = match (local(symbols, *predicate), arguments.as_slice()) {
            ("hasValue" | "qa_has_value", [holder, value]) => (*holder, is_positive.then_some(*value)),
            ("isMeasured", [holder, _]) | ("hasQAvalue", [_, holder]) => (*holder, None),
            _ => return None,
        };
        let is_estimation = links("hasQAestimation", holder);
        let mut read = ValueRead { holder, value, is_estimation, kinds: Vec::new(), is_bounded: false };
        for (property, name, arguments) in &conditions {
            match (*name, *arguments) {
                ("isQAtype", [subject, Term::Constant(kind)]) if *subject == holder => {
                    read.kinds.push((*property, *kind));
                }
                ("isQAtype", [subject, kind]) if *subject == holder => read.is_bounded |= is_bounded(*kind),
                _ => {}
            }
        }
        Some(read)
    };
    atoms.iter().filter_map(read).collect()
}

#[cfg(test)]
mod tests {
    use rules::{Engine, Prefixes, Symbols, parse_rules};

    use super::{is_read, value_reads};

    /// Checks which of the attributes `light` and `wind` a rule reads, if no design has a requirement for them.
    #[track_caller]
    fn check(body: &str, expected: [bool; 2]) {
        let mut symbols = Symbols::new();
        let text = format!(
            "@prefix t: <http://metacontrol.org/tomasys#> .\n@prefix r: <http://example.org/robot#> .\n\
             {body} -> t:fd_realisability(r:fd, false) .\n"
        );
        let program = parse_rules(&text, "test", &mut symbols, &Prefixes::new()).expect("rules");
        let engine = Engine::new(symbols, program, Vec::new()).expect("an engine");
        let reads = value_reads(&engine);
        let is_read = |name: &str| is_read(&engine, &reads, &format!("http://example.org/robot#{name}"));
        assert_eq!(["light", "wind"].map(is_read), expected, "{body}");
    }

    #[test]
    fn rules_read_the_attributes_that_their_conditions_allow() {
        check("t:hasValue(?q, ?x)", [true, true]);
        check("t:c_status(?c, false)", [false, false]);
        check("t:isQAtype(?q, r:wind) ^ t:hasValue(?q, ?x)", [false, true]);
        check("t:isQAtype(?q, r:wind) ^ not t:hasValue(?q, 3)", [false, true]);
        check("t:hasValue(r:obs_light, ?x)", [true, false]);
        check("t:hasQAestimation(?fd, ?q) ^ t:hasValue(?q, ?x)", [false, false]);
        // Here `?r` is the subject of a requirement, not a required value, so that every attribute may match.
        let bounded = "t:hasRequirement(?r, ?k) ^ t:isQAtype(?r, ?k)";
        check(&format!("{bounded} ^ t:isQAtype(?q, ?k) ^ t:hasValue(?q, ?x)"), [true, true]);
        // Only an attribute with a requirement or an operator matches, and these two have none.
        let bounded = "t:hasRequirement(?fd, ?r) ^ t:isQAtype(?r, ?k)";
        check(&format!("{bounded} ^ t:isQAtype(?q, ?k) ^ t:hasValue(?q, ?x)"), [false, false]);
        check("t:qa_comparison_operator(?k, ?o) ^ t:isQAtype(?q, ?k) ^ t:hasValue(?q, ?x)", [false, false]);
    }

    #[test]
    fn conditions_in_an_aggregate_concern_only_the_reads_in_it() {
        check("?n = count { t:isQAtype(?q, r:wind) ^ t:hasValue(?q, ?x) }", [false, true]);
        check("t:isQAtype(?q, r:wind) ^ ?n = count { t:hasValue(?q, ?x) }", [false, true]);
        check("t:hasValue(?q, ?x) ^ 0 = count { t:isQAtype(?q, r:wind) }", [true, true]);
    }
}
