//! Builder: creates an engine from rule texts and facts.

use crate::builtin::BuiltIn;
use crate::engine::Engine;
use crate::error::{Error, Errors};
use crate::fact::Fact;
use crate::limits::Limits;
use crate::literal::Literal;
use crate::rule::Program;
use crate::swrl::{Prefixes, Syntax, parse_rules_as};
use crate::symbol::{Symbol, Symbols};

/// Builder of an engine from rule texts, rules as data and facts; created by [`Engine::builder`].
///
/// ```
/// use metaplan_rules::{Delta, Engine, Fact};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut engine = Engine::builder()
///     .prefix("", "http://example.org/#")
///     .rules("lamps.swrl", "[dark] Lamp(?l) ^ not on(?l, true) -> Dark(?l) .  [one] -> Lamp(lamp) .")
///     .build()?;
///
/// let [dark, on, lamp] = ["Dark", "on", "lamp"].map(|local| engine.name(&format!("http://example.org/#{local}")));
/// let is_dark = Fact::new(dark, [lamp]);
/// assert!(engine.holds(&is_dark));
///
/// let yes = engine.literal(true.into());
/// let change = engine.apply(Delta { insert: vec![Fact::new(on, [lamp, yes])], delete: vec![] })?;
/// assert_eq!(change.delete, [is_dark]);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Default)]
pub struct EngineBuilder {
    symbols: Symbols,
    prefixes: Prefixes,
    syntax: Syntax,
    texts: Vec<(String, String)>,
    program: Program,
    facts: Vec<Fact>,
    limits: Limits,
}

impl EngineBuilder {
    /// Sets the interner to which the symbols of [`EngineBuilder::program`] and [`EngineBuilder::facts`]
    /// refer. Symbols of rule texts are added to the interner.
    #[must_use]
    pub fn symbols(self, symbols: Symbols) -> Self {
        Self { symbols, ..self }
    }

    /// Defines a prefix for rule texts that do not declare it.
    #[must_use]
    pub fn prefix(mut self, prefix: &str, iri: &str) -> Self {
        self.prefixes.insert(prefix, iri);
        self
    }

    /// Adds rules in SWRL's human-readable syntax. `source` names the text in errors and in the identities of the
    /// rules. The head of a rule without a body always holds.
    #[must_use]
    pub fn rules(mut self, source: &str, text: &str) -> Self {
        self.texts.push((source.to_owned(), text.to_owned()));
        self
    }

    /// Adds a built-in for the rule texts, in addition to those of SWRL.
    #[must_use]
    pub fn built_in(mut self, built_in: BuiltIn) -> Self {
        self.syntax.built_ins.push(built_in);
        self
    }

    /// Adds rules as data, before those of the texts. If the program has equality, so has the engine.
    #[must_use]
    pub fn program(mut self, program: Program) -> Self {
        self.program.rules.extend(program.rules);
        self.program.equality |= program.equality;
        self
    }

    /// Adds stated facts.
    #[must_use]
    pub fn facts(mut self, facts: impl IntoIterator<Item = Fact>) -> Self {
        self.facts.extend(facts);
        self
    }

    /// Sets the limits of the first derivation and of each later update.
    #[must_use]
    pub fn limits(self, limits: Limits) -> Self {
        Self { limits, ..self }
    }

    /// Parses the rule texts, and creates an engine with all facts that follow.
    ///
    /// # Errors
    /// Returns the errors of all texts (R101, R102, R104). If the texts have none, returns the errors of
    /// [`Engine::with_limits`].
    pub fn build(mut self) -> Result<Engine, Errors> {
        let mut errors: Vec<Error> = Vec::new();
        for (source, text) in &self.texts {
            match parse_rules_as(text, source, &mut self.symbols, &self.prefixes, &self.syntax) {
                Ok(program) => self.program.rules.extend(program.rules),
                Err(text_errors) => errors.extend(text_errors),
            }
        }
        Errors::unless_empty(errors)?;
        Engine::with_limits(self.symbols, self.program, self.facts, self.limits)
    }
}

impl Engine {
    /// Creates a builder without rules or facts.
    pub fn builder() -> EngineBuilder {
        EngineBuilder::default()
    }

    /// Returns the symbol of a name, such as an IRI, for facts.
    pub fn name(&mut self, name: &str) -> Symbol {
        self.symbols_mut().name(name)
    }

    /// Returns the symbol of a value, for facts.
    pub fn literal(&mut self, literal: Literal) -> Symbol {
        self.symbols_mut().literal(literal)
    }
}
