//! Everything that follows from a mission's knowledge, with why, as a file: to be replayed by `rules::replay`, which shares no
//! code with the engine's evaluation.

use rules::{
    Derivation, DerivationStep, Engine, Fact, Literal, Reason, RuleIdentity, Symbol, Symbols, Value,
};
use serde::{Deserialize, Serialize};

/// The file.
pub(super) const DERIVATIONS: &str = "derivations.json";
const FORMAT: &str = "metaplan-derivations/1";

/// The document: steps, each after what it rests on.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    format: String,
    /// Names and literals; everything else refers to them by position.
    terms: Vec<Term>,
    rules: Vec<Rule>,
    steps: Vec<Step>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
enum Term {
    Name(String),
    /// Lexical form, datatype.
    Literal(String, String),
    /// Text, `rdf:langString`, language.
    Text(String, String, String),
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rule {
    source: String,
    position: u32,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    label: Option<String>,
    /// Those that have a value in each step.
    variables: Vec<String>,
}

/// A fact; stated unless more is said.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    /// Predicate and arguments.
    fact: Vec<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rule: Option<u32>,
    /// The values of the rule's variables.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    bindings: Vec<u32>,
    /// The steps of the facts that the relation atoms of the rule's body found, in order; or what an equality rests on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    supports: Option<Vec<u32>>,
}

/// Writes what an engine holds.
pub(super) fn write(engine: &Engine) -> serde_json::Result<String> {
    let derivation = engine.everything();
    let mut terms: Vec<Option<u32>> = vec![None; engine.symbols().len()];
    let mut document =
        Document { format: FORMAT.to_owned(), terms: Vec::new(), rules: Vec::new(), steps: Vec::new() };
    let mut rules = std::collections::BTreeMap::new();
    let mut number = |symbol: Symbol, listed: &mut Vec<Term>| {
        *terms[symbol.index()].get_or_insert_with(|| {
            listed.push(match engine.symbols().value(symbol) {
                Value::Name(name) => Term::Name(name.to_string()),
                Value::Literal(Literal::Language { text, tag }) => {
                    let datatype = "http://www.w3.org/1999/02/22-rdf-syntax-ns#langString";
                    Term::Text(text.to_string(), datatype.to_owned(), tag.to_string())
                }
                Value::Literal(literal) => Term::Literal(literal.lexical(), literal.datatype().to_owned()),
            });
            listed.len() as u32 - 1
        })
    };
    for DerivationStep { fact, reason } in &derivation.steps {
        let symbols = std::iter::once(fact.predicate).chain(fact.arguments.iter().copied());
        let fact = symbols.map(|symbol| number(symbol, &mut document.terms)).collect();
        let positions = |supports: &[usize]| Some(supports.iter().map(|support| *support as u32).collect());
        let mut step = Step { fact, rule: None, bindings: Vec::new(), supports: None };
        match reason {
            Reason::Asserted => {}
            Reason::Equality { supports } => step.supports = positions(supports),
            Reason::Rule { identity, bindings, supports, .. } => {
                let variables: Vec<String> = bindings.iter().map(|(name, _)| name.clone()).collect();
                let listed = &mut document.rules;
                let rule = rules.entry((identity, variables.clone())).or_insert_with(|| {
                    let label = identity.label.as_deref().map(str::to_owned);
                    let (source, position) = (identity.source.to_string(), identity.position);
                    listed.push(Rule { source, position, label, variables });
                    listed.len() as u32 - 1
                });
                step.rule = Some(*rule);
                let values = bindings.iter().map(|(_, symbol)| number(*symbol, &mut document.terms));
                step.bindings = values.collect();
                step.supports = positions(supports);
            }
        }
        document.steps.push(step);
    }
    serde_json::to_string(&document)
}

/// Reads derivations; names and values are interned in `symbols`.
pub(super) fn read(text: &str, symbols: &mut Symbols) -> Result<Derivation, String> {
    let wrong = |reason: &str| format!("{DERIVATIONS}: {reason}");
    let document: Document = serde_json::from_str(text).map_err(|error| wrong(&error.to_string()))?;
    if document.format != FORMAT {
        return Err(wrong(&format!("format `{}`, where `{FORMAT}` is expected", document.format)));
    }
    let intern = |term: &Term| match term {
        Term::Name(name) => symbols.name(name),
        Term::Literal(lexical, datatype) => symbols.literal(Literal::parse(lexical, Some(datatype), None)),
        Term::Text(text, datatype, language) => {
            symbols.literal(Literal::parse(text, Some(datatype), Some(language)))
        }
    };
    let terms: Vec<Symbol> = document.terms.iter().map(intern).collect();
    let term =
        |number: &u32| terms.get(*number as usize).copied().ok_or_else(|| wrong("a term that is not there"));
    let step = |step: &Step| {
        let mut fact = step.fact.iter().map(term);
        let predicate = fact.next().ok_or_else(|| wrong("a fact without a predicate"))??;
        let arguments: Vec<Symbol> = fact.collect::<Result<_, String>>()?;
        let supports = step.supports.iter().flatten().map(|support| *support as usize).collect();
        let reason = match (step.rule, &step.supports) {
            (None, None) => Reason::Asserted,
            (None, Some(_)) => Reason::Equality { supports },
            (Some(rule), _) => {
                let rule =
                    document.rules.get(rule as usize).ok_or_else(|| wrong("a rule that is not there"))?;
                if rule.variables.len() != step.bindings.len() {
                    return Err(wrong("a step that has not one value for each variable"));
                }
                let values = step.bindings.iter().map(term).collect::<Result<Vec<_>, String>>()?;
                Reason::Rule {
                    identity: RuleIdentity {
                        source: rule.source.as_str().into(),
                        label: rule.label.as_deref().map(Into::into),
                        position: rule.position,
                    },
                    bindings: rule.variables.iter().cloned().zip(values).collect(),
                    supports,
                    absent: Vec::new(),
                    aggregates: Vec::new(),
                }
            }
        };
        Ok(DerivationStep { fact: Fact::new(predicate, arguments), reason })
    };
    let steps = document.steps.iter().map(step).collect::<Result<_, String>>()?;
    Ok(Derivation { steps })
}
