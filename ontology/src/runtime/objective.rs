//! Adds, removes and grounds objectives, each as one update.

use rules::{Delta, Fact, Literal, Symbol};

use super::knowledge::{Mode, Runtime};
use crate::error::Error;
use crate::tomasys::Individual;
use crate::tomasys::change::{self, is_recovered};
use crate::tomasys::terms::{self, term_for};
use crate::vocab::{local_name, tomasys};

const UNGROUNDED: &str = "UNGROUNDED";

/// An objective to add.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewObjective<'a> {
    /// IRI, or a name in the namespace of TOMASys, as in MROS.
    pub name: &'a str,
    /// IRI or local name of the function to provide.
    pub function: &'a str,
    /// Non-functional requirements: IRI or local name of an attribute type, and a bound in its unit.
    pub requirements: Vec<(&'a str, Literal)>,
    /// `true` if a better design is searched even while the objective has no problem.
    pub always_improve: bool,
}

impl Runtime {
    /// Adds an objective. At first the objective is ungrounded, i.e. no design is selected for it.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] for an unknown function or attribute type, [`Error::Exists`],
    /// [`Error::BadName`] or [`Error::Engine`].
    pub fn add_objective(&mut self, objective: &NewObjective) -> Result<Delta, Error> {
        let (function, _) = self.all_facts().find("function", terms::FUNCTION, objective.function)?;
        if self.all_facts().find("objective", terms::OBJECTIVE, objective.name).is_ok() {
            return Err(Error::Exists { name: objective.name.to_owned() });
        }
        let name = iri_of(objective.name)?;
        let mut insert = Vec::new();
        for (attribute, bound) in &objective.requirements {
            let (kind, class) =
                self.all_facts().find("quality attribute type", terms::ATTRIBUTE_TYPE, attribute)?;
            let requirement = format!("{name}_nfr_{}", local_name(attribute));
            let requirement = self.engine.symbols_mut().name(&requirement);
            let bound = self.engine.symbols_mut().literal(bound.clone());
            insert.extend([
                self.fact(term_for(terms::QA_VALUE, class), [requirement]),
                self.fact(term_for(terms::IS_TYPE, class), [requirement, kind]),
                self.fact(term_for(terms::HAS_VALUE, class), [requirement, bound]),
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

    /// Removes an objective with its groundings, and with the requirements that no other objective has.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] or [`Error::Engine`].
    pub fn remove_objective(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let facts = self.facts();
        let mut removed = facts.objects(objective, terms::HAS_NFR);
        removed.retain(|&requirement| {
            facts.subjects(requirement, terms::HAS_NFR).iter().all(|&owner| owner == objective)
        });
        removed.extend(facts.subjects(objective, terms::SOLVES_O));
        removed.push(objective);
        let delete = removed.into_iter().flat_map(|individual| self.mentions(individual)).collect();
        self.apply(Delta { insert: Vec::new(), delete })
    }

    /// Grounds an objective: selects the design, which replaces any other design, and removes the objective's status.
    /// Returns the new grounding. In retract mode, existing measurements of the design's estimated attributes are
    /// linked to the grounding, and if the objective is updatable, recovered components count as working (see
    /// [`Runtime::note_recoveries`]). In latch mode, as in MROS, only later measurements are linked.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] or [`Error::Engine`].
    pub fn ground(&mut self, objective: &str, design: &str) -> Result<Individual, Error> {
        let (symbol, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let is_updatable = self.mode == Mode::Retract && self.facts().is_true(symbol, terms::UPDATABLE);
        let recoveries = if is_updatable { self.recoveries() } else { Vec::new() };
        self.ground_and_withdraw(objective, design, recoveries).map(|(grounding, _)| grounding)
    }

    /// Grounds an objective like [`Runtime::ground`], but keeps all reports about components, including
    /// recoveries. Returns the change of all facts.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] or [`Error::Engine`].
    pub fn assign(&mut self, objective: &str, design: &str) -> Result<Delta, Error> {
        self.ground_and_withdraw(objective, design, Vec::new()).map(|(_, delta)| delta)
    }

    fn ground_and_withdraw(
        &mut self,
        objective: &str,
        design: &str,
        withdrawn: Vec<Fact>,
    ) -> Result<(Individual, Delta), Error> {
        let (objective, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let (design, _) = self.all_facts().find("function design", terms::FUNCTION_DESIGN, design)?;
        let mut delete = self.release(objective);
        delete.extend(withdrawn);
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

    /// Removes the groundings of an objective, which becomes ungrounded.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] or [`Error::Engine`].
    pub fn unground(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let delete = self.release(objective);
        let status = self.engine.symbols_mut().literal(Literal::string(UNGROUNDED));
        let insert = vec![self.fact(terms::OBJECTIVE_STATUS[0], [objective, status])];
        self.apply(Delta { insert, delete })
    }

    /// Withdraws the reports of components that have recovered, so that these components count as
    /// working. MROS does this when its adaptation loop has noticed updatable objectives, before it
    /// plans for them.
    ///
    /// # Errors
    /// Returns [`Error::Engine`].
    pub fn note_recoveries(&mut self) -> Result<Delta, Error> {
        let delete = self.recoveries();
        self.apply(Delta { insert: Vec::new(), delete })
    }

    /// Unlinks measurements of the previous design's performance from the groundings of an objective,
    /// until the values are reported again. Measurements of the environment, whose attribute types have
    /// a `qa_comparison_operator`, remain.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] or [`Error::Engine`].
    pub fn forget_performance(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let facts = self.all_facts();
        let is_environmental = |&holder: &Symbol| {
            let mut kinds = facts.objects(holder, terms::IS_TYPE).into_iter();
            kinds.any(|kind| !facts.texts(kind, terms::OPERATOR).is_empty())
        };
        let groundings = facts.subjects(objective, terms::SOLVES_O).into_iter();
        let links = groundings.flat_map(|grounding| self.statements(grounding, terms::HAS_QA_VALUE));
        let is_stale = |fact: &Fact| fact.arguments.get(1).is_some_and(|holder| !is_environmental(holder));
        let delete = links.filter(is_stale).collect();
        self.apply(Delta { insert: Vec::new(), delete })
    }

    /// Asserts the derived failures of designs for an objective, so that the error log keeps them when
    /// the objective's status is removed. MROS keeps failures indefinitely; here they are removed with
    /// the objective.
    ///
    /// # Errors
    /// Returns [`Error::Unknown`] or [`Error::Engine`].
    pub fn log_failures(&mut self, objective: &str) -> Result<Delta, Error> {
        let (objective, _) = self.all_facts().find("objective", terms::OBJECTIVE, objective)?;
        let facts = self.all_facts();
        let symbols = self.engine.symbols();
        let predicates = terms::ERROR_LOG.iter().filter_map(|name| symbols.find_name(name));
        let rows = predicates.flat_map(|predicate| {
            let designs = facts.subjects(objective, terms::ERROR_LOG).into_iter();
            designs.map(move |design| Fact::new(predicate, [design, objective]))
        });
        let insert = rows.filter(|fact| self.engine.holds(fact)).collect();
        self.apply(Delta { insert, delete: Vec::new() })
    }

    fn recoveries(&self) -> Vec<Fact> {
        let facts = self.facts();
        let recovered =
            |&component: &Symbol| facts.texts(component, terms::STATUS).iter().any(|text| is_recovered(text));
        let components = facts.members(terms::COMPONENT).into_iter().filter(recovered);
        components.flat_map(|component| self.statements(component, terms::STATUS)).collect()
    }

    fn release(&self, objective: Symbol) -> Vec<Fact> {
        let groundings = self.facts().subjects(objective, terms::SOLVES_O).into_iter();
        let mut delete: Vec<Fact> = groundings.flat_map(|grounding| self.mentions(grounding)).collect();
        delete.extend(self.statements(objective, terms::OBJECTIVE_STATUS));
        delete.extend(self.statements(objective, terms::UPDATABLE));
        delete
    }

    fn measurements(&self, design: Symbol) -> Vec<Symbol> {
        if self.mode == Mode::Latch {
            return Vec::new();
        }
        let facts = self.facts();
        let estimations = facts.objects(design, terms::HAS_ESTIMATION).into_iter();
        let kinds = estimations.flat_map(|value| facts.objects(value, terms::IS_TYPE));
        kinds.flat_map(|kind| change::holders(facts, kind)).collect()
    }

    fn grounding_name(&self, objective: Symbol, design: Symbol) -> String {
        let facts = self.facts();
        let (design, owner) = (self.individual(design).name, self.individual(objective).name);
        let design = design.strip_prefix("fd_").unwrap_or(&design);
        let name = format!("{}fg_{design}", tomasys::NS);
        let is_taken = self.engine.symbols().find_name(&name).is_some_and(|grounding| {
            facts.objects(grounding, terms::SOLVES_O).iter().any(|&other| other != objective)
        });
        if is_taken { format!("{name}_{owner}") } else { name }
    }

    pub(super) fn fact<const N: usize>(&mut self, predicate: &str, arguments: [Symbol; N]) -> Fact {
        Fact::new(self.engine.symbols_mut().name(predicate), arguments)
    }
}

fn iri_of(name: &str) -> Result<String, Error> {
    let forbidden = |c: &char| c.is_whitespace() || c.is_control() || "<>\"{}|\\^`".contains(*c);
    match name.chars().find(forbidden) {
        Some(character) => Err(Error::BadName { name: name.to_owned(), character }),
        None if name.contains(':') => Ok(name.to_owned()),
        None => Ok(format!("{}{name}", tomasys::NS)),
    }
}
