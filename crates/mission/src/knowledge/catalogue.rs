//! Cache of the knowledge-base queries that planning needs, kept across events.
//!
//! Changes of the availability of designs and of measured values, which most events cause, are applied
//! incrementally. Changes that the cached results do not depend on, such as the status of a component or of
//! an objective, are ignored. All other changes rebuild the cache. The cache always equals the results of
//! [`View`].

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use ontology::tomasys::{Action, FunctionDesign, Individual, Measurement, View};
use ontology::vocab::{local_name, pddl_tomasys, suave, tomasys};
use rules::{Delta, Engine, Fact, Literal, Symbol};

/// Cached designs, actions and measured values, and the members of already queried classes.
#[derive(Debug, Clone)]
pub struct Catalogue {
    designs: Vec<FunctionDesign>,
    actions: Vec<Action>,
    measurements: Vec<Measurement>,
    /// Members of each queried class. Shared by copies until a member of a class changes.
    classes: Arc<Mutex<BTreeMap<String, Arc<[Individual]>>>>,
}

const AVAILABILITY: [&str; 4] = [
    tomasys::FD_REALISABILITY,
    pddl_tomasys::FD_REALISABILITY,
    suave::FD_REALISABILITY,
    tomasys::FD_AVAILABLE,
];
const VALUES: [&str; 3] = [tomasys::HAS_VALUE, pddl_tomasys::QA_HAS_VALUE, suave::HAS_VALUE];
const ESTIMATIONS: [&str; 3] =
    [tomasys::HAS_QA_ESTIMATION, pddl_tomasys::HAS_QA_ESTIMATION, suave::HAS_QA_ESTIMATION];
/// Properties whose facts do not affect the cache.
const OTHERS: [&str; 13] = [
    tomasys::C_STATUS,
    pddl_tomasys::C_STATUS,
    suave::C_STATUS,
    tomasys::O_STATUS,
    tomasys::O_UPDATABLE,
    tomasys::O_ALWAYS_IMPROVE,
    tomasys::FG_STATUS,
    tomasys::TYPE_F,
    tomasys::TYPE_FD,
    tomasys::SOLVES_O,
    tomasys::HAS_QA_VALUE,
    tomasys::HAS_NFR,
    tomasys::FD_ERROR_LOG,
];
/// Classes that do not affect the cache, unless their members were queried.
const OTHER_CLASSES: [&str; 2] = [tomasys::OBJECTIVE, tomasys::FUNCTION_GROUNDING];

impl Catalogue {
    pub(super) fn new(view: &View<'_>) -> Self {
        Self {
            designs: view.function_designs(),
            actions: view.actions(),
            measurements: view.measurements(),
            classes: Arc::default(),
        }
    }

    /// Returns the cached [`View::function_designs`].
    pub fn designs(&self) -> &[FunctionDesign] {
        &self.designs
    }

    pub(crate) fn actions(&self) -> &[Action] {
        &self.actions
    }

    pub(crate) fn measurements(&self) -> &[Measurement] {
        &self.measurements
    }

    /// Returns the members of a class given by its IRI, or of all classes with that local name.
    pub fn members(&self, view: &View<'_>, class: &str) -> Arc<[Individual]> {
        let mut classes = self.classes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(members) = classes.get(class) {
            return Arc::clone(members);
        }
        let members = if class.contains(':') {
            view.individuals_of(class)
        } else {
            view.individuals_of_class_named(class)
        };
        let members: Arc<[Individual]> = members.into();
        classes.insert(class.to_owned(), Arc::clone(&members));
        members
    }

    /// Updates the cache after a change of facts. Returns `false` if the cache must be rebuilt.
    pub(super) fn follow(&mut self, delta: &Delta, engine: &Engine) -> bool {
        delta.insert.iter().chain(&delta.delete).all(|fact| self.follow_fact(fact, engine))
    }

    fn follow_fact(&mut self, fact: &Fact, engine: &Engine) -> bool {
        let name = |symbol: Symbol| engine.symbols().value(symbol).as_name().unwrap_or_default();
        let property = name(fact.predicate);
        let Some(&individual) = fact.arguments.first() else { return false };
        let subject = name(individual);
        if AVAILABILITY.contains(&property) {
            if let Ok(place) = self.designs.binary_search_by(|own| own.individual.iri.as_str().cmp(subject)) {
                let value = engine.symbols().find_literal(&Literal::Boolean(false));
                let is_false = |property: &&str| {
                    let fact = engine.symbols().find_name(property).zip(value);
                    fact.is_some_and(|(property, value)| {
                        engine.holds(&Fact::new(property, [individual, value]))
                    })
                };
                self.designs[place].available = !AVAILABILITY.iter().any(is_false);
            }
            return true;
        }
        if VALUES.contains(&property) {
            let is_estimation = |property: &&str| {
                let symbol = engine.symbols().find_name(property);
                symbol
                    .is_some_and(|symbol| engine.matching(symbol, &[None, Some(individual)]).next().is_some())
            };
            let place = self.measurements.binary_search_by(|own| own.individual.iri.as_str().cmp(subject));
            let (Ok(place), false) = (place, ESTIMATIONS.iter().any(is_estimation)) else { return false };
            let mut literals: Vec<&Literal> =
                VALUES.iter().flat_map(|property| values(engine, individual, property)).collect();
            if literals.len() > 1 {
                literals.sort_by_cached_key(ToString::to_string);
            }
            let value = literals.into_iter().find_map(Literal::as_rational);
            let iri = self.measurements[place].individual.iri.clone();
            for own in self.measurements.iter_mut().filter(|own| own.individual.iri == iri) {
                own.value.clone_from(&value);
            }
            return true;
        }
        if OTHER_CLASSES.contains(&property) {
            let classes = self.classes.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let is_queried = classes.contains_key(property) || classes.contains_key(local_name(property));
            // Copies of this cache do not share the change of the members.
            self.classes = Arc::new(Mutex::new(classes));
            return !is_queried;
        }
        OTHERS.contains(&property)
    }
}

fn values<'a>(engine: &'a Engine, subject: Symbol, property: &str) -> impl Iterator<Item = &'a Literal> {
    let symbols = engine.symbols();
    let rows: Vec<Symbol> = symbols.find_name(property).map_or_else(Vec::new, |property| {
        engine.matching(property, &[Some(subject), None]).map(|row| row[1]).collect()
    });
    rows.into_iter().filter_map(|symbol| symbols.value(symbol).as_literal())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use ontology::tomasys::change::Status;

    use crate::knowledge::{COADAPTATION, Knowledge, Sources};

    #[test]
    fn the_query_cache_equals_the_view_after_every_event() {
        for name in ["ugv", "uuv", "camara_like"] {
            let document =
                Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../ontology/kb/{name}.ttl"));
            let rules = vec![COADAPTATION.to_owned()];
            let sources = Sources { documents: vec![document], rules, ..Sources::default() };
            let mut knowledge = Knowledge::read(&sources).expect("the knowledge base is read");
            let components = knowledge
                .view()
                .components()
                .into_iter()
                .map(|known| known.individual.name)
                .collect::<Vec<_>>();
            let attributes =
                knowledge.view().attribute_types().into_iter().map(|kind| kind.name).collect::<Vec<_>>();
            let mut random = fastrand::Rng::with_seed(11);
            let mut kept_count = 0;
            for _ in 0..300 {
                match random.u32(..8) {
                    0..=3 => {
                        let statuses = [Status::Failed, Status::Recovered, Status::Working];
                        let component = &components[random.usize(..components.len())];
                        knowledge.report(component, statuses[random.usize(..3)]).expect("it is known");
                    }
                    4..=6 if !attributes.is_empty() => {
                        let attribute = &attributes[random.usize(..attributes.len())];
                        knowledge.measure(attribute, &random.u32(..100).to_string()).expect("it is known");
                    }
                    _ => {
                        let designs = knowledge.view().function_designs();
                        let design = &designs[random.usize(..designs.len())];
                        let pairs = design
                            .solves
                            .first()
                            .map(|function| (function.name.clone(), design.individual.name.clone()));
                        let pairs: Vec<_> = pairs.into_iter().filter(|_| random.bool()).collect();
                        knowledge.pursue(&pairs).expect("they are known");
                    }
                }
                kept_count += usize::from(knowledge.catalogue.get().is_some());
                let (catalogue, view) = (knowledge.catalogue(), knowledge.view());
                assert_eq!(catalogue.designs(), view.function_designs());
                assert_eq!(catalogue.actions(), view.actions());
                assert_eq!(catalogue.measurements(), view.measurements());
                for class in ["FunctionDesign", "Function", "Component", "Action", "Objective"] {
                    if class != "Objective" || random.u32(..10) == 0 {
                        assert_eq!(*catalogue.members(&view, class), *view.individuals_of_class_named(class));
                    }
                }
            }
            assert!(kept_count > 150, "{name}: the cache survived only {kept_count} of 300 events");
        }
    }
}
