//! JSON format of derivations: all facts of a mission's knowledge base, and a derivation of each inferred
//! fact. `rules::replay` checks the derivations without running the inference engine.

use rules::{Derivation, DerivationStep, Fact, Literal, Reason, RuleIdentity, Symbol, Symbols};
use serde::{Deserialize, Serialize};

/// Name of the file with the derivations.
pub const DERIVATIONS: &str = "derivations.json";
/// Name and version of the format.
pub const FORMAT: &str = "metaplan-derivations/1";

/// The contents of the file. Each derivation step follows the steps that support it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// The format identifier, [`FORMAT`].
    pub format: String,
    /// The names and literals; other parts refer to them by index.
    pub terms: Vec<Term>,
    /// The rules; derivation steps refer to them by index.
    pub rules: Vec<Rule>,
    /// The derivation steps, one for each fact.
    pub steps: Vec<Step>,
}

/// An IRI or an RDF literal.
#[derive(Debug, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Term {
    /// An IRI, for an individual, class or property.
    Name(String),
    /// A typed literal: lexical form, IRI of the datatype.
    Literal(String, String),
    /// A language-tagged string: text, `rdf:langString`, language.
    Text(String, String, String),
}

/// A rule, identified by its file and its position in the file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rule {
    /// Name of the rule file.
    pub source: String,
    /// Position of the rule in the file.
    pub position: u32,
    /// Label of the rule, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// The variables to which each step of the rule binds values, in the order of
    /// [`Step::bindings`].
    pub variables: Vec<String>,
}

/// A derivation step: a fact and its justification. The fact is asserted if neither `rule` nor
/// `supports` is present.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Predicate and arguments, as indices of terms.
    pub fact: Vec<u32>,
    /// Index of the rule that derives the fact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rule: Option<u32>,
    /// The values of the rule's variables, as indices of terms.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bindings: Vec<u32>,
    /// For a rule, the indices of the steps whose facts match the relation atoms of the rule's
    /// body, in the order of the atoms. Without a rule, the indices of the steps that support an
    /// equality.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supports: Option<Vec<u32>>,
}

pub(crate) fn read(text: &str, symbols: &mut Symbols) -> Result<Derivation, String> {
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
