//! Exports all facts of a mission's knowledge base, each with one derivation. The checker `rules::replay` shares only
//! the code of single built-ins and aggregates with the rule engine.

use rules::{DerivationStep, Engine, Literal, Reason, Symbol, Value};

use ::verify::derivations::{Document, FORMAT, Rule, Step, Term};

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
