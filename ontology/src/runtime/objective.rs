//! Objectives and groundings come and go: each as one update.

use rules::{Delta, Fact, Literal, Symbol};

use super::knowledge::{Mode, Runtime};
use crate::error::Error;
use crate::tomasys::Individual;
use crate::tomasys::change::{self, is_recovered};
use crate::tomasys::terms::{self, beside};
use crate::vocab::{local_name, tomasys};

/// The status of an objective that no design has been chosen for.
const UNGROUNDED: &str = "UNGROUNDED";

/// An objective to pursue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewObjective<'a> {
    /// Its IRI, or a name in the namespace of TOMASys as MROS makes it.
    pub name: &'a str,
    /// The function to provide, by IRI or local name.
    pub function: &'a str,
    /// Non-functional requirements: an attribute type, by IRI or local name, and a bound in its unit.
    pub requirements: Vec<(&'a str, Literal)>,
    /// Whether to look for a better design also while all is well.
    pub always_improve: bool,
}

impl Runtime {
    /// Begins to pursue an objective; it is ungrounded at first.
    ///
    /// # Errors
    /// [`Error::Unknown`] for a function or attribute type that is not in the knowledge base, [`Error::Exists`],
    /// [`Error::BadName`], [`Error::Engine`].
    pub fn add_objective(&mut self, objective: &NewObjective) -> Result<Delta, Error> {
        let (function, _) = self.all().find("function", terms::FUNCTION, objective.function)?;
        if self.all().find("objective", terms::OBJECTIVE, objective.name).is_ok() {
            return Err(Error::Exists { name: objective.name.to_owned() });
        }
        let name = iri_of(objective.name)?;
        let mut insert = Vec::new();
        for (attribute, bound) in &objective.requirements {
            let (kind, class) =
                self.all().find("quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
            let requirement = format!("{name}_nfr_{}", local_name(attribute));
            let requirement = self.engine.symbols_mut().name(&requirement);
            let bound = self.engine.symbols_mut().literal(bound.clone());
            insert.extend([
                self.fact(beside(terms::QA_VALUE, class), [requirement]),
                self.fact(beside(terms::IS_TYPE, class), [requirement, kind]),
                self.fact(beside(terms::HAS_VALUE, class), [requirement, bound]),
            ]);
            let subject = self.engine.symbols_mut().name(&name);
            insert.push(self.fact(terms::HAS_NFR[0], [subject, requirement]));
        }
        let subject = self.engine.symbols_mut().name(&name);
        let status = self.engine.symbols_mut().literal(Literal::string(UNGROUNDED));
        insert.extend([
            self.fact(terms::OBJECTIVE[0], [subject]),
            self.fact(terms::TYPE_F[0], [subject, function]),
            self.fact(terms::OBJECTIVE_STATUS[0], [subject, status]),
        ]);
        if objective.always_improve {
            let truth = self.engine.symbols_mut().literal(Literal::Boolean(true));
            insert.push(self.fact(terms::ALWAYS_IMPROVE[0], [subject, truth]));
        }
        self.apply(Delta { insert, delete: Vec::new() })
    }

    /// Gives an objective up, with its requirements and its grounding.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Engine`].
    pub fn remove_objective(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let facts = self.facts();
        let mut gone = facts.objects(objective, terms::HAS_NFR);
        gone.extend(facts.subjects(objective, terms::SOLVES_O));
        gone.push(objective);
        let delete = gone.into_iter().flat_map(|individual| self.mentions(individual)).collect();
        self.apply(Delta { insert: Vec::new(), delete })
    }

    /// A design provides an objective's function from now on, in place of any other. The objective's status is
    /// forgotten. In retract mode the grounding sees what has been measured so far and recoveries count as noted; in
    /// latch mode, as with MROS, it sees measurements from the next one on.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Engine`].
    pub fn ground(&mut self, objective: &str, design: &str) -> Result<Individual, Error> {
        let (found, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let noted = self.mode == Mode::Retract && self.facts().is_true(found, terms::UPDATABLE);
        let recoveries = if noted { self.recoveries() } else { Vec::new() };
        self.ground_and_forget(objective, design, recoveries).map(|(grounding, _)| grounding)
    }

    /// As [`Runtime::ground`], and what components have reported stays as it is, recoveries among it; returns what holds
    /// since, and what no more.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Engine`].
    pub fn assign(&mut self, objective: &str, design: &str) -> Result<Delta, Error> {
        self.ground_and_forget(objective, design, Vec::new()).map(|(_, delta)| delta)
    }

    fn ground_and_forget(
        &mut self,
        objective: &str,
        design: &str,
        forgotten: Vec<Fact>,
    ) -> Result<(Individual, Delta), Error> {
        let (objective, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let (design, _) = self.all().find("function design", terms::FUNCTION_DESIGN, design)?;
        let mut delete = self.release(objective);
        delete.extend(forgotten);
        let iri = self.grounding_name(objective, design);
        let measurements = self.measurements(design);
        let grounding = self.engine.symbols_mut().name(&iri);
        let mut insert = vec![
            self.fact(terms::FUNCTION_GROUNDING[0], [grounding]),
            self.fact(terms::TYPE_FD[0], [grounding, design]),
            self.fact(terms::SOLVES_O[0], [grounding, objective]),
        ];
        for holder in measurements {
            insert.push(self.fact(terms::HAS_QA_VALUE[0], [grounding, holder]));
        }
        let delta = self.apply(Delta { insert, delete })?;
        Ok((Individual::new(&iri), delta))
    }

    /// No design provides an objective's function from now on.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Engine`].
    pub fn unground(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let delete = self.release(objective);
        let status = self.engine.symbols_mut().literal(Literal::string(UNGROUNDED));
        let insert = vec![self.fact(terms::OBJECTIVE_STATUS[0], [objective, status])];
        self.apply(Delta { insert, delete })
    }

    /// Components that report their recovery count as working from now on: the loop has seen that objectives are
    /// updatable. MROS does this before it plans for an updatable objective.
    ///
    /// # Errors
    /// [`Error::Engine`].
    pub fn note_recoveries(&mut self) -> Result<Delta, Error> {
        let delete = self.recoveries();
        self.apply(Delta { insert: Vec::new(), delete })
    }

    /// What was measured of the design before does not count for the one that an objective is grounded with now, until it is measured
    /// again. Measurements of the surroundings count: those of attribute types with a `qa_comparison_operator`.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Engine`].
    pub fn forget_performance(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let facts = self.all();
        let is_of_surroundings = |&holder: &Symbol| {
            let mut kinds = facts.objects(holder, terms::IS_TYPE).into_iter();
            kinds.any(|kind| !facts.texts(kind, terms::OPERATOR).is_empty())
        };
        let groundings = facts.subjects(objective, terms::SOLVES_O).into_iter();
        let links = groundings.flat_map(|grounding| self.statements(grounding, terms::HAS_QA_VALUE));
        let is_stale = |fact: &Fact| fact.arguments.get(1).is_some_and(|holder| !is_of_surroundings(holder));
        let delete = links.filter(is_stale).collect();
        self.apply(Delta { insert: Vec::new(), delete })
    }

    /// States which designs have failed an objective, so that this is known when its status is forgotten. MROS keeps that for ever;
    /// here it goes with the objective.
    ///
    /// # Errors
    /// [`Error::Unknown`], [`Error::Engine`].
    pub fn log_failures(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all().find("objective", terms::OBJECTIVE, objective)?;
        let facts = self.all();
        let symbols = self.engine.symbols();
        let predicates = terms::ERROR_LOG.iter().filter_map(|name| symbols.find_name(name));
        let rows = predicates.flat_map(|predicate| {
            let designs = facts.subjects(objective, terms::ERROR_LOG).into_iter();
            designs.map(move |design| Fact::new(predicate, [design, objective]))
        });
        let insert = rows.filter(|fact| self.engine.holds(fact)).collect();
        self.apply(Delta { insert, delete: Vec::new() })
    }

    /// The statements that components have recovered.
    fn recoveries(&self) -> Vec<Fact> {
        let facts = self.facts();
        let recovered =
            |&component: &Symbol| facts.texts(component, terms::STATUS).iter().any(|text| is_recovered(text));
        let components = facts.members(terms::COMPONENT).into_iter().filter(recovered);
        components.flat_map(|component| self.statements(component, terms::STATUS)).collect()
    }

    /// What goes when an objective is grounded anew: its groundings and its status.
    fn release(&self, objective: Symbol) -> Vec<Fact> {
        let groundings = self.facts().subjects(objective, terms::SOLVES_O).into_iter();
        let mut delete: Vec<Fact> = groundings.flat_map(|grounding| self.mentions(grounding)).collect();
        delete.extend(self.statements(objective, terms::OBJECTIVE_STATUS));
        delete.extend(self.statements(objective, terms::UPDATABLE));
        delete
    }

    /// What holds measurements of the attributes that a design has estimations of; none in latch mode.
    fn measurements(&self, design: Symbol) -> Vec<Symbol> {
        if self.mode == Mode::Latch {
            return Vec::new();
        }
        let facts = self.facts();
        let estimations = facts.objects(design, terms::HAS_ESTIMATION).into_iter();
        let kinds = estimations.flat_map(|value| facts.objects(value, terms::IS_TYPE));
        kinds.flat_map(|kind| change::holders(facts, kind)).collect()
    }

    /// `fg_<design>`, and the objective's name too where another objective has a grounding of that name.
    fn grounding_name(&self, objective: Symbol, design: Symbol) -> String {
        let facts = self.facts();
        let (design, owner) = (self.individual(design).name, self.individual(objective).name);
        let design = design.strip_prefix("fd_").unwrap_or(&design);
        let name = format!("{}fg_{design}", tomasys::NS);
        let taken = self.engine.symbols().find_name(&name).is_some_and(|grounding| {
            facts.objects(grounding, terms::SOLVES_O).iter().any(|&other| other != objective)
        });
        if taken { format!("{name}_{owner}") } else { name }
    }

    pub(super) fn fact<const N: usize>(&mut self, predicate: &str, arguments: [Symbol; N]) -> Fact {
        Fact::new(self.engine.symbols_mut().name(predicate), arguments)
    }
}

/// The IRI of a new individual.
fn iri_of(name: &str) -> Result<String, Error> {
    let forbidden = |c: &char| c.is_whitespace() || c.is_control() || "<>\"{}|\\^`".contains(*c);
    match name.chars().find(forbidden) {
        Some(character) => Err(Error::BadName { name: name.to_owned(), character }),
        None if name.contains(':') => Ok(name.to_owned()),
        None => Ok(format!("{}{name}", tomasys::NS)),
    }
}
