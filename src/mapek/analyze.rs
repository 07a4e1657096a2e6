//! Analyze: from what is known to which designs are available, which objectives are in error, and what has changed.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Fact, Literal, Reason, Symbols, Value};

use crate::knowledge::{Fault, Knowledge};
use crate::mapek::answer::{Answer, DesignChange, ObjectiveChange};
use crate::mapek::beliefs::Beliefs;
use crate::mapek::monitor::Base;

/// What the analysis has found.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// Designs that are available no more.
    pub(super) lost: BTreeSet<String>,
    /// Designs that are available again.
    pub(super) gained: BTreeSet<String>,
    /// Objectives that have come into error, with their statuses.
    pub(super) errors: Vec<String>,
}

/// The designs that are available, by local name; none where it is not known what follows.
pub(crate) fn available(knowledge: &Knowledge) -> BTreeSet<String> {
    if knowledge.fault().is_some() {
        return BTreeSet::new();
    }
    let designs = knowledge.catalogue().designs().iter().filter(|design| design.available);
    designs.map(|design| design.individual.name.clone()).collect()
}

/// Reports what contradicts itself, and that it is not known what follows, where that has changed; what was observed stays.
pub(super) fn contradict(beliefs: &mut Beliefs, answers: &mut Vec<Answer>) {
    let Some(knowledge) = beliefs.mission.knowledge() else { return };
    if knowledge.fault() != beliefs.fault.as_ref() {
        beliefs.fault = knowledge.fault().cloned();
        answers.push(Answer::Unconcluded { fault: beliefs.fault.clone() });
    }
    let mut contradictions = knowledge.contradictions();
    for fact in contradictions.iter_mut().flat_map(|own| own.facts.iter_mut()) {
        *fact = local(fact);
    }
    let violated: BTreeSet<String> = contradictions.iter().map(|own| own.violated.clone()).collect();
    if violated != beliefs.violated {
        beliefs.violated = violated;
        answers.push(Answer::Contradicted { contradictions });
    }
}

/// What a change of the knowledge base has led to: contradictions are reported, and where what is watched has changed, what
/// follows is compared with what followed before.
pub(super) fn follow(beliefs: &mut Beliefs, base: Base, answers: &mut Vec<Answer>) -> Findings {
    if base > Base::Nothing {
        contradict(beliefs, answers);
    }
    if base == Base::Watched { analyze(beliefs, answers) } else { Findings::default() }
}

/// Compares what follows now with what followed before, and reports the difference.
pub(super) fn analyze(beliefs: &mut Beliefs, answers: &mut Vec<Answer>) -> Findings {
    let mut findings = Findings::default();
    let Some(knowledge) = beliefs.mission.knowledge() else { return findings };
    let now = available(knowledge);
    let changed: Vec<String> = beliefs.available.symmetric_difference(&now).cloned().collect();
    let designs: Vec<DesignChange> = changed
        .into_iter()
        .map(|design| {
            let available = now.contains(&design);
            let because = match knowledge.fault() {
                _ if available => Vec::new(),
                Some(fault) => vec![unknown(fault)],
                None => ruled_out(knowledge, &design),
            };
            DesignChange { design, available, because }
        })
        .collect();
    for change in &designs {
        let set = if change.available { &mut findings.gained } else { &mut findings.lost };
        set.insert(change.design.clone());
    }
    let statuses = statuses(knowledge);
    let mut objectives = Vec::new();
    let names: BTreeSet<&String> = statuses.keys().chain(beliefs.statuses.keys()).collect();
    for name in names {
        let (before, after) = (beliefs.statuses.get(name), statuses.get(name));
        if before == after {
            continue;
        }
        let statuses = after.cloned().unwrap_or_default();
        if !statuses.is_empty() {
            findings.errors.push(format!("{name} is {}", statuses.join(", ")));
        }
        let because = why_objective(knowledge, name);
        objectives.push(ObjectiveChange { objective: name.clone(), statuses, because });
    }
    beliefs.available = now;
    beliefs.statuses = statuses;
    if !designs.is_empty() || !objectives.is_empty() {
        answers.push(Answer::Inferred { designs, objectives });
    }
    findings
}

/// Why nothing counts as available, and no plan is looked for.
pub(super) fn unknown(fault: &Fault) -> String {
    format!("it is not known what follows: {}", fault.message)
}

/// Objectives that have a status which calls for another design.
fn statuses(knowledge: &Knowledge) -> BTreeMap<String, Vec<String>> {
    let objectives = knowledge.runtime().objectives().into_iter();
    let in_error = objectives.filter(ontology::runtime::Objective::is_in_error);
    in_error.map(|objective| (objective.individual.name, objective.statuses)).collect()
}

/// The rules and stated facts by which a design is ruled out.
pub(crate) fn ruled_out(knowledge: &Knowledge, design: &str) -> Vec<String> {
    let engine = knowledge.engine();
    let symbols = engine.symbols();
    let designs = knowledge.catalogue().members(&knowledge.view(), "FunctionDesign");
    let Some(individual) = designs.iter().find(|individual| individual.name == design) else {
        return Vec::new();
    };
    let (Some(subject), Some(falsehood)) =
        (symbols.find_name(&individual.iri), symbols.find_literal(&Literal::Boolean(false)))
    else {
        return Vec::new();
    };
    let names = ["fd_realisability", "fd_available"].map(|name| {
        [ontology::vocab::tomasys::NS, ontology::vocab::pddl_tomasys::NS]
            .map(|space| format!("{space}{name}"))
    });
    let predicates = names.iter().flatten().filter_map(|name| symbols.find_name(name));
    let mut because = Vec::new();
    for predicate in predicates {
        if let Some(derivation) = engine.why(&Fact::new(predicate, [subject, falsehood])) {
            because.extend(reasons(knowledge, &derivation));
        }
    }
    because
}

/// The rules and stated facts by which an objective has its status.
pub(crate) fn why_objective(knowledge: &Knowledge, objective: &str) -> Vec<String> {
    let derivations = knowledge.runtime().why(objective).unwrap_or_default();
    derivations.iter().flat_map(|derivation| reasons(knowledge, derivation)).collect()
}

/// A derivation as lines: the labels of its rules, then the stated facts that it rests on.
fn reasons(knowledge: &Knowledge, derivation: &rules::Derivation) -> Vec<String> {
    let symbols = knowledge.engine().symbols();
    let mut lines = Vec::new();
    for step in &derivation.steps {
        if let Reason::Rule { identity, .. } = &step.reason {
            let label = identity.label.clone().unwrap_or_else(|| identity.to_string().into());
            lines.push(format!("rule: {label}"));
        }
    }
    for step in &derivation.steps {
        if matches!(step.reason, Reason::Asserted) {
            lines.push(said(&step.fact, symbols));
        }
    }
    lines
}

/// A fact as text with local names in place of IRIs.
fn said(fact: &Fact, symbols: &Symbols) -> String {
    let mut text = String::with_capacity(64);
    for (position, &symbol) in std::iter::once(&fact.predicate).chain(&fact.arguments).enumerate() {
        text += ["", "(", ", "][position.min(2)];
        match symbols.value(symbol) {
            Value::Name(name) => text += ontology::vocab::local_name(name),
            Value::Literal(literal) => text += &local(&literal.to_string()),
        }
    }
    text += if fact.arguments.is_empty() { "()" } else { ")" };
    text
}

/// A fact with local names in place of IRIs.
pub(crate) fn local(text: &str) -> String {
    let mut parts = text.split('<');
    let mut short = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        if let Some((iri, rest)) = part.split_once('>') {
            short += ontology::vocab::local_name(iri);
            short += rest;
        } else {
            short.push('<');
            short += part;
        }
    }
    short
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{available, follow};
    use crate::mapek::answer::Answer;
    use crate::mapek::beliefs::Beliefs;
    use crate::mapek::monitor::Base;
    use crate::setup::Setup;

    #[test]
    fn what_follows_is_compared_with_what_followed_before() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let mut beliefs = Beliefs::new(Setup::read(&manifest).expect("the mission is read").mission);
        beliefs.available = available(beliefs.mission.knowledge().expect("a knowledge base"));
        let before = beliefs.available.clone();
        beliefs.mission.fail("c_kinect").expect("a component");
        let mut answers = Vec::new();
        let stated = follow(&mut beliefs, Base::Stated, &mut answers);
        assert!(stated.lost.is_empty() && answers.is_empty(), "nothing that is watched has changed");
        let findings = follow(&mut beliefs, Base::Watched, &mut answers);
        assert!(findings.lost.contains("fd_amcl_kinect") && findings.gained.is_empty(), "{findings:?}");
        assert!(beliefs.available.is_disjoint(&findings.lost));
        assert_eq!(beliefs.available.union(&findings.lost).cloned().collect::<super::BTreeSet<_>>(), before);
        let [Answer::Inferred { designs, .. }] = &answers[..] else { panic!("{answers:?}") };
        assert_eq!(designs.len(), findings.lost.len());
        assert!(designs.iter().all(|change| !change.available && !change.because.is_empty()), "{designs:?}");
        answers.clear();
        let again = follow(&mut beliefs, Base::Watched, &mut answers);
        assert!(again.lost.is_empty() && answers.is_empty(), "it is said once");
    }
}
