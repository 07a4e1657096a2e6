//! A knowledge base at run time: OWL documents and rule files in an engine, kept in step with the robot.

use std::path::{Path, PathBuf};

use ontology::tomasys::View;
use ontology::tomasys::change::{self, Status};
use ontology::{Equality, ReadOptions};
use rules::{Delta, Engine, Fact, Literal, Prefixes, Program, Symbols};

use crate::message::Message;

/// The name under which the shipped co-adaptation rules are asked for.
pub const COADAPTATION: &str = "coadaptation";
/// The name under which the shipped rules of the TOMASys metamodel are asked for.
pub const TOMASYS: &str = "tomasys";

/// What an engine is built from.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// OWL documents (`-` is standard input); their imports are followed.
    pub documents: Vec<PathBuf>,
    /// Rule files in SWRL's human-readable syntax; `coadaptation` and `tomasys` name the shipped ones.
    pub rules: Vec<String>,
    /// Where imports are looked for.
    pub options: ReadOptions,
}

/// Knowledge about a robot: what is stated, and what follows.
#[derive(Debug, Clone)]
pub struct Knowledge {
    engine: Engine,
    rule_count: usize,
    warnings: Vec<Message>,
}

/// Something that the knowledge contradicts.
#[derive(Debug, Clone)]
pub struct Contradiction {
    /// The axiom or rule that is violated.
    pub violated: String,
    /// The facts that violate it together.
    pub facts: Vec<String>,
}

impl Knowledge {
    /// Reads documents and rules.
    ///
    /// # Errors
    /// All that is wrong with them.
    pub fn read(sources: &Sources) -> Result<Self, Vec<Message>> {
        Self::read_as(sources, Equality::Owl)
    }

    /// As [`Knowledge::read`], where two names may stand for one individual, as in OWL, or never.
    ///
    /// # Errors
    /// All that is wrong with the sources.
    pub fn read_as(sources: &Sources, equality: Equality) -> Result<Self, Vec<Message>> {
        let read = ontology::read_files(&sources.documents, &sources.options);
        let mut errors = Vec::new();
        let mut symbols = Symbols::new();
        let mut own = Vec::new();
        for file in &sources.rules {
            match parse_rule_file(file, &mut symbols) {
                Ok(program) => own.extend(program.rules),
                Err(more) => errors.extend(more),
            }
        }
        let ontology = match read {
            Ok(ontology) if errors.is_empty() => ontology,
            Ok(_) => return Err(errors),
            Err(more) => {
                errors.extend(more.iter().map(Message::from_ontology));
                return Err(errors);
            }
        };
        let lowered = ontology::lower_with(&ontology, equality, &mut symbols);
        let mut warnings: Vec<Message> =
            ontology.warnings.iter().chain(&lowered.warnings).map(Message::from_ontology_warning).collect();
        let rule_count = ontology.rules.len() + own.len();
        let mut program = lowered.program;
        program.rules.extend(own);
        let engine = Engine::new(symbols, program, lowered.facts)
            .map_err(|errors| errors.iter().map(Message::from_rules).collect::<Vec<_>>())?;
        let mistakes = ontology::tomasys::check(&ontology, &engine);
        warnings.extend(mistakes.iter().map(Message::from_ontology_warning));
        Ok(Self { engine, rule_count, warnings })
    }

    /// What is questionable about the documents.
    pub fn warnings(&self) -> &[Message] {
        &self.warnings
    }

    /// How many rules there are: those of each document, and those of rule files; axioms do not count.
    pub fn rule_count(&self) -> usize {
        self.rule_count
    }

    /// The typed view on what holds now.
    pub fn view(&self) -> View<'_> {
        View::new(&self.engine)
    }

    /// The engine, to ask for facts and derivations.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Marks a component, named by IRI or local name, as failed.
    ///
    /// # Errors
    /// There is no such component.
    pub fn fail(&mut self, component: &str) -> Result<(), Message> {
        let delta = change::component_status(&mut self.engine, component, Status::Failed);
        self.change(delta)
    }

    /// Sets the measured value of an attribute, named by the IRI or local name of its type.
    ///
    /// # Errors
    /// There is no such attribute, or the value is no number.
    pub fn measure(&mut self, attribute: &str, value: &str) -> Result<(), Message> {
        let literal = Literal::parse(value, Some("http://www.w3.org/2001/XMLSchema#decimal"), None);
        if literal.as_rational().is_none() {
            return Err(Message::error(
                "M102",
                format!("the value `{value}` of {attribute} is no decimal number"),
            ));
        }
        let delta = change::measured_value(&mut self.engine, attribute, literal);
        self.change(delta)
    }

    /// Whether some attribute type has this local name or IRI.
    pub fn has_attribute(&self, name: &str) -> bool {
        self.view().attribute_types().iter().any(|attribute| attribute.name == name || attribute.iri == name)
    }

    fn change(&mut self, delta: Result<Delta, ontology::Error>) -> Result<(), Message> {
        let delta = delta.map_err(|error| Message::from_ontology(&error))?;
        self.apply(delta)
    }

    /// Inserts and deletes stated facts.
    ///
    /// # Errors
    /// A rule runs away.
    pub fn apply(&mut self, delta: Delta) -> Result<(), Message> {
        self.engine.apply(delta).map(|_| ()).map_err(|error| Message::from_rules(&error))
    }

    /// The assertions of a document (without its imports and rules) as facts, to insert or delete.
    ///
    /// # Errors
    /// All that is wrong with the document.
    pub fn assertions(&mut self, file: &Path) -> Result<Vec<Fact>, Vec<Message>> {
        let options = ReadOptions { allow_missing_imports: true, ..ReadOptions::default() };
        let ontology = ontology::read_files(&[file], &options)
            .map_err(|errors| errors.iter().map(Message::from_ontology).collect::<Vec<_>>())?;
        Ok(ontology::lower(&ontology, self.engine.symbols_mut()).facts)
    }

    /// What follows and is not stated, in the order of its N-Triples.
    pub fn inferred(&self) -> Vec<Fact> {
        self.engine.facts().filter(|fact| !self.engine.is_asserted(fact)).collect()
    }

    /// All contradictions; empty if the knowledge is consistent.
    pub fn contradictions(&self) -> Vec<Contradiction> {
        let symbols = self.engine.symbols();
        let violations = self.engine.violations().into_iter();
        violations
            .map(|violation| Contradiction {
                violated: match &violation.cause {
                    rules::Cause::Constraint(identity) => {
                        identity.label.as_deref().map_or_else(|| identity.to_string(), ToOwned::to_owned)
                    }
                    rules::Cause::IllTyped(literal) => {
                        format!("the datatype of {} forbids its value", symbols.value(*literal))
                    }
                    other => format!("{other:?}"),
                },
                facts: violation.supports.iter().map(|fact| fact.display(symbols).to_string()).collect(),
            })
            .collect()
    }
}

fn parse_rule_file(file: &str, symbols: &mut Symbols) -> Result<Program, Vec<Message>> {
    let text = match file {
        COADAPTATION => rules::COADAPTATION_RULES.to_owned(),
        TOMASYS => rules::TOMASYS_RULES.to_owned(),
        "-" => std::io::read_to_string(std::io::stdin())
            .map_err(|error| vec![Message::at("M101", "-", None, format!("cannot be read: {error}"))])?,
        path => std::fs::read_to_string(path)
            .map_err(|error| vec![Message::at("M101", path, None, format!("cannot be read: {error}"))])?,
    };
    rules::parse_rules(&text, file, symbols, &Prefixes::default())
        .map_err(|errors| errors.iter().map(Message::from_rules).collect())
}
