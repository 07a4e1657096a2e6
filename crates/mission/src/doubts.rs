//! Lints: warnings about legal but suspicious missions, which adapt less than their authors expect. Most of these
//! lints report names that occur only in the knowledge base or only in the PDDL files.

use std::collections::{BTreeMap, BTreeSet};

use diagnostics::nearest;
use ontology::tomasys::FunctionDesign;
use ontology::vocab::local_name;
use pddl::ast::{ActionBody, Assignment, Effect, Identifier, InitialElement, Name};
use pddl::{Diagnostic, Mentioned, Severity, print_domain};
use rules::{Engine, Fact, Symbol};

use crate::binding;
use crate::joined::Mission;
use crate::knowledge::{Knowledge, doubt_about};
use crate::message::{Message, did_you_mean};

impl Mission {
    /// Returns lint warnings: actions and designs of the knowledge base that the PDDL files do not name,
    /// components and attributes that nothing uses or declares, bindings to unknown names, conclusions that the
    /// domain declares itself, and numeric functions without a value. Without a knowledge base, only numeric functions are checked.
    pub fn doubts(&self) -> Vec<Message> {
        let Some(knowledge) = &self.knowledge else { return self.functions_without_value() };
        let mut doubts = Vec::new();
        // In PLANTA's form, conditions name the actions of the knowledge base, so schemas need no
        // matching names.
        if self.planta.is_none() {
            doubts.extend(self.actions_without_schema(knowledge));
            doubts.extend(self.declared_conclusions());
        }
        let never_named = self.never_named.iter();
        doubts.extend(never_named.map(|(iri, text)| doubt_about(knowledge, "M221", iri, text.clone())));
        doubts.extend(components(knowledge));
        doubts.extend(self.functions_without_value());
        doubts.extend(attributes(knowledge));
        doubts.extend(self.idle_bindings(knowledge));
        doubts
    }

    /// Warns about bindings to classes without individuals, to attributes without an estimation or measurement, and to
    /// unknown actions.
    fn idle_bindings(&self, knowledge: &Knowledge) -> Vec<Message> {
        let (view, catalogue) = (knowledge.view(), knowledge.catalogue());
        let estimated: BTreeSet<&str> = catalogue.designs().iter().flat_map(estimates).collect();
        let measured: BTreeSet<&str> =
            catalogue.measurements().iter().map(|measurement| measurement.attribute.as_str()).collect();
        let actions: BTreeSet<&str> =
            catalogue.actions().iter().map(|action| local_name(&action.individual.iri)).collect();
        let idle = |(symbol, query): (&String, &String)| {
            let (kind, name) = query.split_once(':')?;
            let is_used = catalogue.actions().iter().any(|action| match kind {
                "action" => self.bindings.is_action(&Name::new(symbol), &action.individual),
                "requires" => binding::is_only(action, Some(name)),
                _ => false,
            });
            let empty = BTreeSet::new();
            let (lacks, names) = match kind {
                "estimation" | "chosen" | "reconfigured" => ("no design has an estimation of", &estimated),
                "measured" => ("there is no measurement of", &measured),
                "action" | "requires" if !is_used => ("the knowledge base has no action", &actions),
                "class" if catalogue.members(&view, name).is_empty() => {
                    ("the knowledge base has no individuals of", &empty)
                }
                _ => return None,
            };
            if names.contains(name) || names.contains(binding::plain(name)) {
                return None;
            }
            let suggestion = did_you_mean(name, names.iter().copied());
            let text = format!("`{symbol}` is bound to `{query}`, but {lacks} `{name}`{suggestion}");
            Some(Message::warning("M227", text))
        };
        self.bindings.written().iter().filter_map(idle).collect()
    }

    /// Warns about actions of the knowledge base without a corresponding schema of the domain, if they have
    /// requirements or quality bounds and no predicate states these requirements.
    fn actions_without_schema(&self, knowledge: &Knowledge) -> Vec<Message> {
        let schemas: Vec<&Name> = self.domain.actions.iter().map(|action| &action.identifier.name).collect();
        let predicates: Vec<&Name> =
            self.domain.predicates.iter().map(|predicate| &predicate.identifier.name).collect();
        let view = knowledge.view();
        let actions = view.actions();
        let relevant =
            actions.iter().filter(|action| !action.requires.is_empty() || !action.quality.is_empty());
        let mut doubts = Vec::new();
        for action in relevant {
            let name = &action.individual.name;
            let mut names =
                actions.iter().filter(|other| view.are_same(&action.individual.iri, &other.individual.iri));
            let has_schema = names
                .any(|other| schemas.iter().any(|schema| self.bindings.is_action(schema, &other.individual)));
            if has_schema
                || predicates.iter().any(|predicate| self.bindings.says_needs(predicate, &action.individual))
            {
                continue;
            }
            let candidates = schemas.iter().map(|schema| schema.as_str());
            let nearest_schema = nearest(name.strip_prefix("a_").unwrap_or(name), candidates);
            let nearest_schema = nearest_schema.map_or_else(String::new, |nearest_schema| {
                format!(
                    "; if it corresponds to `{nearest_schema}`, use this name, or bind `{nearest_schema} = \
                         \"action:{name}\"`"
                )
            });
            let text = format!(
                "no action of the domain corresponds to <{}>, so its requirements are ignored{nearest_schema}",
                action.individual.iri
            );
            doubts.push(doubt_about(knowledge, "M205", &action.individual.iri, text));
        }
        doubts
    }

    /// Warns about used predicates `inferred-…` that nothing makes true, although there is a knowledge base: no axiom,
    /// binding, effect or fact. A domain that declares all of them is not in PLANTA's form, so that the knowledge base
    /// adds no axioms.
    fn declared_conclusions(&self) -> Vec<Message> {
        let is_conclusion = |name: &Name| name.as_str().to_ascii_lowercase().starts_with("inferred-");
        let declared = self.domain.predicates.iter().map(|declared| &declared.identifier);
        let conclusions: Vec<_> = declared.filter(|declared| is_conclusion(&declared.name)).collect();
        if conclusions.is_empty() {
            return Vec::new();
        }
        let problem = self.current();
        let mentioned = Mentioned::by_domain(&self.domain).and_problem(&problem);
        let facts: BTreeSet<&Name> = problem
            .init
            .iter()
            .filter_map(|element| match element {
                InitialElement::Fact(atom) => Some(&atom.predicate.name),
                _ => None,
            })
            .collect();
        let axioms = || self.domain.derived.iter().map(|axiom| &axiom.head.identifier.name);
        let is_empty = |name: &Name| {
            mentioned.predicates.contains(name)
                && !mentioned.changed.contains(name)
                && !facts.contains(name)
                && !self.bindings.is_bound_predicate(name)
                && !axioms().any(|head| head == name)
        };
        let warning = |identifier: &Identifier| {
            let text = format!(
                "the domain declares `{}`, so the knowledge base adds no conclusions for it, and nothing else makes it true",
                identifier.name
            );
            let diagnostic =
                Diagnostic::new(&self.domain_source, identifier.span, Severity::Warning, "M215", text);
            Message::from_pddl(&[diagnostic], &[&self.domain_source])
        };
        let help = "remove the declaration; a domain with undeclared predicates `inferred-…` gets the axioms of the \
                    knowledge base";
        let empty = conclusions.into_iter().filter(|identifier| is_empty(&identifier.name));
        empty.flat_map(warning).map(|message| message.with_help(help)).collect()
    }

    /// Warns about numeric functions that the domain uses, but that have neither an initial value nor an `assign`
    /// effect. `total-cost` and sums over designs are exempt.
    fn functions_without_value(&self) -> Vec<Message> {
        if self.domain.functions.is_empty() {
            return Vec::new();
        }
        let problem = self.current();
        let valued: BTreeSet<&Name> = problem
            .init
            .iter()
            .filter_map(|element| match element {
                InitialElement::Value(atom, ..) => Some(&atom.predicate.name),
                _ => None,
            })
            .collect();
        let text = print_domain(&self.domain);
        let is_used = |name: &Name| {
            // The declaration counts as one occurrence, so a used function occurs at least twice.
            let count = [format!("({name})"), format!("({name} ")];
            count.iter().map(|form| text.matches(form.as_str()).count()).sum::<usize>() > 1
        };
        let effects = self.domain.actions.iter().flat_map(|action| match &action.body {
            ActionBody::Instantaneous { effect, .. } => vec![effect],
            ActionBody::Durative { effects, .. } => effects.iter().map(|(_, effect)| effect).collect(),
        });
        let effects: Vec<&Effect> = effects.collect();
        let declared = self.domain.functions.iter().map(|declared| &declared.identifier);
        let silent = declared.filter(|identifier| {
            let name = &identifier.name;
            name.as_str() != "total-cost"
                && !valued.contains(name)
                && is_used(name)
                && !self.stands_for_designs(name)
                && !effects.iter().any(|effect| assigns(effect, name))
        });
        let warning = |identifier: &Identifier| {
            let sources = match self.knowledge {
                Some(_) => "neither the problem nor the knowledge base gives one, by name or by a binding",
                None => "the problem does not give one, and there is no knowledge base",
            };
            let text = format!("`{}` has no value: {sources}", identifier.name);
            let diagnostic =
                Diagnostic::new(&self.domain_source, identifier.span, Severity::Warning, "M206", text);
            Message::from_pddl(&[diagnostic], &[&self.domain_source])
        };
        silent.flat_map(warning).collect()
    }
}

fn estimates(design: &FunctionDesign) -> impl Iterator<Item = &str> {
    design.estimations.keys().map(String::as_str)
}

fn assigns(effect: &Effect, name: &Name) -> bool {
    match effect {
        Effect::And(parts) => parts.iter().any(|part| assigns(part, name)),
        Effect::ForAll(_, inner) | Effect::When(_, inner) => assigns(inner, name),
        Effect::Assign(Assignment::Assign, target, ..) => target.predicate.name == *name,
        Effect::Assign(..) | Effect::Add(_) | Effect::Delete(_) => false,
    }
}

/// The asserted facts, by argument.
type Stated = BTreeMap<Symbol, Vec<Fact>>;

fn stated(engine: &Engine) -> Stated {
    let mut stated = Stated::new();
    for fact in engine.stated_facts() {
        fact.arguments.iter().for_each(|argument| stated.entry(*argument).or_default().push(fact.clone()));
    }
    stated
}

/// Returns the asserted facts about an individual: those with the individual as their first
/// argument, and those with the individual as another argument.
fn about<'s>(engine: &Engine, stated: &'s Stated, iri: &str) -> (Vec<&'s Fact>, Vec<&'s Fact>) {
    let symbol = engine.symbols().find_name(iri);
    let facts = symbol.and_then(|symbol| stated.get(&symbol)).into_iter().flatten();
    facts.partition(|fact| fact.arguments.first() == symbol.as_ref())
}

/// Warns about components that occur only as values in facts about other individuals, and about components that no
/// design requires. A component counts as unrequired only if other components are required and no other fact links it.
fn components(knowledge: &Knowledge) -> Vec<Message> {
    let (engine, view, designs) = (knowledge.engine(), knowledge.view(), knowledge.catalogue().designs());
    let required: BTreeSet<&str> = designs
        .iter()
        .flat_map(|design| &design.components)
        .map(|component| component.iri.as_str())
        .collect();
    let components = view.components();
    let stated = stated(engine);
    let mut doubts = Vec::new();
    for component in components.iter().map(|component| &component.individual) {
        let (about, referring) = about(engine, &stated, &component.iri);
        if about.is_empty() {
            let names = components.iter().map(|known| known.individual.name.as_str());
            let candidates = names.filter(|name| *name != component.name);
            let suggestion = did_you_mean(&component.name, candidates);
            let text = format!(
                "the component <{}> is only mentioned and has no other statement{suggestion}",
                component.iri
            );
            doubts.push(doubt_about(knowledge, "M207", &component.iri, text));
        } else if !required.is_empty()
            && !required.contains(component.iri.as_str())
            && referring.is_empty()
            && about.iter().all(|fact| is_plain(engine, fact))
        {
            let text = format!(
                "no design requires the component <{}>, so its failure changes nothing",
                component.iri
            );
            doubts.push(doubt_about(knowledge, "M208", &component.iri, text));
        }
    }
    doubts
}

/// Returns `true` if the fact is a class membership or a component status. Such a fact does not
/// link a component to a design.
fn is_plain(engine: &Engine, fact: &Fact) -> bool {
    let name = engine.symbols().value(fact.predicate).as_name().unwrap_or_default();
    fact.arguments.len() == 1 || local_name(name) == "c_status"
}

/// Warns about attributes that are only mentioned, about attributes that nothing estimates, measures or
/// bounds, and about bounds of actions on attributes that no design estimates.
fn attributes(knowledge: &Knowledge) -> Vec<Message> {
    let (engine, view, designs) = (knowledge.engine(), knowledge.view(), knowledge.catalogue().designs());
    let estimated: BTreeSet<&str> = designs.iter().flat_map(estimates).collect();
    let bounded: BTreeSet<&str> = designs
        .iter()
        .flat_map(|design| &design.requirements)
        .map(|bound| bound.attribute.as_str())
        .collect();
    let mut doubts = Vec::new();
    let attributes = view.attribute_types();
    let stated = stated(engine);
    let mentioned = |iri: &str| about(engine, &stated, iri).0.is_empty();
    for kind in attributes.iter().filter(|kind| mentioned(&kind.iri)) {
        let candidates =
            attributes.iter().filter(|candidate| candidate.iri != kind.iri && !mentioned(&candidate.iri));
        let suggestion = did_you_mean(&kind.name, candidates.map(|candidate| candidate.name.as_str()));
        let text =
            format!("the attribute <{}> is only mentioned and has no other statement{suggestion}", kind.iri);
        doubts.push(doubt_about(knowledge, "M229", &kind.iri, text));
    }
    for kind in &attributes {
        let used = estimated.contains(kind.name.as_str()) || bounded.contains(kind.name.as_str());
        if !used && about(engine, &stated, &kind.iri).1.is_empty() {
            let text = format!("the attribute <{}> has neither values nor bounds", kind.iri);
            doubts.push(doubt_about(knowledge, "M209", &kind.iri, text));
        }
    }
    for quality in view.actions().into_iter().flat_map(|action| action.quality) {
        let attribute = quality.bounds.attribute.as_str();
        if !estimated.contains(attribute) {
            let suggestion = did_you_mean(attribute, estimated.iter().copied());
            let text = format!(
                "<{}> bounds `{attribute}`, which no design estimates, so every design satisfies it{suggestion}",
                quality.individual.iri
            );
            doubts.push(doubt_about(knowledge, "M210", &quality.individual.iri, text));
        }
    }
    doubts
}
