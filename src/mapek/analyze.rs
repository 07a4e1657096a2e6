//! Analyze (of MAPE-K): computes the available designs and the objectives in error from the knowledge base, and
//! compares them with the previous results.

use std::collections::{BTreeMap, BTreeSet};

use rules::{Derivation, Fact, Literal, Reason, Symbols, Value};
use serde::{Deserialize, Serialize};

use crate::knowledge::{Fault, Knowledge};
use crate::mapek::answer::{Answer, DesignChange, ObjectiveChange};
use crate::mapek::beliefs::Beliefs;
use crate::mapek::changes::add_new;
use crate::mapek::monitor::Base;

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Findings {
    pub(super) lost: BTreeSet<String>,
    pub(super) gained: BTreeSet<String>,
    pub(super) errors: Vec<String>,
}

impl Findings {
    pub(super) fn is_empty(&self) -> bool {
        self.lost.is_empty() && self.gained.is_empty() && self.errors.is_empty()
    }

    /// Adds later findings. A design that is lost and then gained, or gained and then lost, counts as neither.
    pub(super) fn extend(&mut self, later: Self) {
        for design in later.lost {
            if !self.gained.remove(&design) {
                self.lost.insert(design);
            }
        }
        for design in later.gained {
            if !self.lost.remove(&design) {
                self.gained.insert(design);
            }
        }
        add_new(&mut self.errors, later.errors);
    }
}

/// Returns the local names of available designs. If the conclusions are incomplete, no design counts as available.
pub(crate) fn available(knowledge: &Knowledge) -> BTreeSet<String> {
    if knowledge.fault().is_some() {
        return BTreeSet::new();
    }
    let designs = knowledge.catalogue().designs().iter().filter(|design| design.available);
    designs.map(|design| design.individual.name.clone()).collect()
}

pub(super) fn report_contradictions(beliefs: &mut Beliefs, answers: &mut Vec<Answer>) {
    let Some(knowledge) = beliefs.mission.knowledge() else { return };
    answers.extend(doubts(knowledge, &mut beliefs.fault, &mut beliefs.violated));
}

/// Returns answers if the reasoning fault or the violated constraints of the knowledge base differ from `fault` and
/// `violated`. Updates `fault` and `violated`.
pub(crate) fn doubts(
    knowledge: &Knowledge,
    fault: &mut Option<Fault>,
    violated: &mut BTreeSet<String>,
) -> Vec<Answer> {
    let mut answers = Vec::new();
    if knowledge.fault() != fault.as_ref() {
        *fault = knowledge.fault().cloned();
        answers.push(Answer::Unconcluded { fault: fault.clone() });
    }
    let mut contradictions = knowledge.contradictions();
    for fact in contradictions.iter_mut().flat_map(|contradiction| contradiction.facts.iter_mut()) {
        *fact = with_local_names(fact);
    }
    let now: BTreeSet<String> =
        contradictions.iter().map(|contradiction| contradiction.violated.clone()).collect();
    if now != *violated {
        *violated = now;
        answers.push(Answer::Contradicted { contradictions });
    }
    answers
}

pub(super) fn analyze_change(beliefs: &mut Beliefs, base: Base, answers: &mut Vec<Answer>) -> Findings {
    if base > Base::Nothing {
        report_contradictions(beliefs, answers);
    }
    if base == Base::Watched { analyze(beliefs, answers) } else { Findings::default() }
}

pub(super) fn analyze(beliefs: &mut Beliefs, answers: &mut Vec<Answer>) -> Findings {
    let mut findings = Findings::default();
    let Some(knowledge) = beliefs.mission.knowledge() else { return findings };
    let (designs, objectives) = changes(knowledge, &mut beliefs.available, &mut beliefs.statuses);
    for change in &designs {
        let set = if change.available { &mut findings.gained } else { &mut findings.lost };
        set.insert(change.design.clone());
    }
    let errors = objectives.iter().filter(|change| !change.statuses.is_empty());
    findings.errors = errors.map(|change| error(&change.objective, &change.statuses)).collect();
    answers.extend(inferred(designs, objectives));
    findings
}

/// Returns the sentence in [`Findings::errors`] about an objective in error.
pub(super) fn error(objective: &str, statuses: &[String]) -> String {
    format!("{objective} is {}", statuses.join(", "))
}

pub(crate) fn inferred(designs: Vec<DesignChange>, objectives: Vec<ObjectiveChange>) -> Option<Answer> {
    let is_something = !designs.is_empty() || !objectives.is_empty();
    is_something.then_some(Answer::Inferred { designs, objectives })
}

/// Compares the available designs and the statuses of objectives in error with `designs` and `objectives`. Returns the
/// differences with reasons, and updates both arguments.
pub(crate) fn changes(
    knowledge: &Knowledge,
    designs: &mut BTreeSet<String>,
    objectives: &mut BTreeMap<String, Vec<String>>,
) -> (Vec<DesignChange>, Vec<ObjectiveChange>) {
    let now = available(knowledge);
    let changed_designs = designs.symmetric_difference(&now);
    let changed_designs =
        changed_designs.map(|design| availability(knowledge, design, now.contains(design))).collect();
    *designs = now;
    let now = statuses(knowledge);
    let names: BTreeSet<&String> = now.keys().chain(objectives.keys()).collect();
    let changed_names = names.into_iter().filter(|name| now.get(*name) != objectives.get(*name));
    let objective = |name: &String| ObjectiveChange {
        objective: name.clone(),
        statuses: now.get(name).cloned().unwrap_or_default(),
        because: why_objective(knowledge, name),
    };
    let changed_objectives = changed_names.map(objective).collect();
    *objectives = now;
    (changed_designs, changed_objectives)
}

pub(super) fn availability(knowledge: &Knowledge, design: &str, available: bool) -> DesignChange {
    let because = match knowledge.fault() {
        _ if available => Vec::new(),
        Some(fault) => vec![missing_conclusions(fault)],
        None => ruled_out(knowledge, design),
    };
    DesignChange { design: design.to_owned(), available, because }
}

pub(super) fn missing_conclusions(fault: &Fault) -> String {
    format!("the conclusions are unknown: {}", fault.message)
}

fn statuses(knowledge: &Knowledge) -> BTreeMap<String, Vec<String>> {
    let objectives = knowledge.runtime().objectives().into_iter();
    let in_error = objectives.filter(ontology::runtime::Objective::is_in_error);
    in_error.map(|objective| (objective.individual.name, objective.statuses)).collect()
}

pub(crate) fn ruled_out(knowledge: &Knowledge, design: &str) -> Vec<String> {
    unavailable(knowledge, design).iter().flat_map(|derivation| reasons(knowledge, derivation)).collect()
}

/// Returns a derivation of each statement that a design is unavailable, e.g. `fd_realisability(d, false)`; empty if no
/// such statement holds.
pub(crate) fn unavailable(knowledge: &Knowledge, design: &str) -> Vec<Derivation> {
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
        [ontology::vocab::tomasys::NS, ontology::vocab::pddl_tomasys::NS, ontology::vocab::suave::NS]
            .map(|space| format!("{space}{name}"))
    });
    let predicates = names.iter().flatten().filter_map(|name| symbols.find_name(name));
    predicates.filter_map(|predicate| engine.why(&Fact::new(predicate, [subject, falsehood]))).collect()
}

fn why_objective(knowledge: &Knowledge, objective: &str) -> Vec<String> {
    let derivations = knowledge.runtime().why(objective).unwrap_or_default();
    derivations.iter().flat_map(|derivation| reasons(knowledge, derivation)).collect()
}

fn reasons(knowledge: &Knowledge, derivation: &Derivation) -> Vec<String> {
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
            lines.push(fact_text(&step.fact, symbols));
        }
    }
    lines
}

pub(crate) fn fact_text(fact: &Fact, symbols: &Symbols) -> String {
    let mut text = String::with_capacity(64);
    for (position, &symbol) in std::iter::once(&fact.predicate).chain(&fact.arguments).enumerate() {
        text += ["", "(", ", "][position.min(2)];
        match symbols.value(symbol) {
            Value::Name(name) => text += ontology::vocab::local_name(name),
            Value::Literal(literal) => text += &with_local_names(&literal.to_string()),
        }
    }
    text += if fact.arguments.is_empty() { "()" } else { ")" };
    text
}

pub(crate) fn with_local_names(text: &str) -> String {
    let mut parts = text.split('<');
    let mut short = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        if let Some((iri, suffix)) = part.split_once('>') {
            short += ontology::vocab::local_name(iri);
            short += suffix;
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

    use super::{analyze_change, available};
    use crate::mapek::answer::Answer;
    use crate::mapek::beliefs::Beliefs;
    use crate::mapek::monitor::Base;
    use crate::setup::Setup;

    #[test]
    fn changes_of_availability_are_reported_once() {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/ugv.toml");
        let mut beliefs = Beliefs::new(Setup::read(&manifest).expect("the mission is read").mission);
        beliefs.available = available(beliefs.mission.knowledge().expect("a knowledge base"));
        let before = beliefs.available.clone();
        beliefs.mission.fail("c_kinect").expect("a component");
        let mut answers = Vec::new();
        let stated = analyze_change(&mut beliefs, Base::Stated, &mut answers);
        assert!(stated.lost.is_empty() && answers.is_empty(), "nothing that is watched has changed");
        let findings = analyze_change(&mut beliefs, Base::Watched, &mut answers);
        assert!(findings.lost.contains("fd_amcl_kinect") && findings.gained.is_empty(), "{findings:?}");
        assert!(beliefs.available.is_disjoint(&findings.lost));
        assert_eq!(beliefs.available.union(&findings.lost).cloned().collect::<super::BTreeSet<_>>(), before);
        let [Answer::Inferred { designs, .. }] = &answers[..] else { panic!("{answers:?}") };
        assert_eq!(designs.len(), findings.lost.len());
        assert!(designs.iter().all(|change| !change.available && !change.because.is_empty()), "{designs:?}");
        answers.clear();
        let again = analyze_change(&mut beliefs, Base::Watched, &mut answers);
        assert!(again.lost.is_empty() && answers.is_empty(), "it is said once");
    }
}
