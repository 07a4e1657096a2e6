//! Lowers SWRL rules to rules of the engine, without duplicates.

use std::collections::{HashMap, HashSet};

use rules::{BuiltIn, RuleIdentity, Term, Variable};

use super::class;
use super::context::{Conjunction, Context, Variables, cross};
use super::range;
use crate::error::Warning;
use crate::owl::{Argument, Atom, ClassExpression, Rule};
use crate::vocab::owl;

/// Adds the lowered rules to `context`, without duplicates. Returns the number of duplicates: rules that
/// differ from another rule at most in the names of variables and in the order of body atoms. Some duplicates
/// are not recognised, see [`canonical`].
pub(crate) fn lower(rules: &[Rule], context: &mut Context) -> usize {
    let mut contents = HashSet::new();
    let mut duplicates = 0;
    for rule in rules {
        let identity = RuleIdentity {
            source: rule.ontology.clone(),
            label: rule.label.clone(),
            position: rule.position,
        };
        let position = context.rules.len();
        context.swrl_starts.push(position);
        let (ontology, label) = (rule.ontology.to_string(), rule.label.as_ref().map(ToString::to_string));
        let result = lower_rule(rule, &identity, context);
        if let Err(reason) = context.take_gaps().map_err(str::to_owned).and(result) {
            context.rules.truncate(position);
            context.warnings.push(Warning::UnusableRule { ontology, position: rule.position, label, reason });
            continue;
        }
        let content: Vec<_> = context.rules[position..].iter().map(canonical).collect();
        // A duplicate may have been lowered to several rules of the engine; all of them are removed.
        if !contents.insert(content) {
            context.rules.truncate(position);
            duplicates += 1;
        } else if rule.enabled == Some(false) {
            context.warnings.push(Warning::DisabledRule { ontology, position: rule.position, label });
        }
    }
    duplicates
}

/// Returns body and head with the atoms of the body sorted, and with variables numbered in this order. The
/// result is equal for rules that differ in the names of variables or in the order of body atoms, unless a body has
/// several atoms with one predicate.
fn canonical(rule: &rules::Rule) -> (Vec<rules::Atom>, Vec<rules::Atom>) {
    // Sorting must not depend on the numbers of variables.
    let anonymous = |_: Variable| Term::Variable(Variable(0));
    let mut body = rule.body.clone();
    body.sort_by_cached_key(|atom| format!("{:?}", renamed(atom, &mut { anonymous })));
    let mut numbers = HashMap::new();
    let mut number = |variable: Variable| {
        let next = Variable(numbers.len() as u16);
        Term::Variable(*numbers.entry(variable).or_insert(next))
    };
    let body = body.iter().map(|atom| renamed(atom, &mut number)).collect();
    (body, rule.head.iter().map(|atom| renamed(atom, &mut number)).collect())
}

/// Returns the atom with its variables replaced. Aggregates are returned unchanged.
fn renamed(atom: &rules::Atom, name: &mut dyn FnMut(Variable) -> Term) -> rules::Atom {
    use rules::Atom as A;
    let mut term = |term: Term| match term {
        Term::Variable(variable) => name(variable),
        Term::Constant(_) => term,
    };
    match atom.clone() {
        A::Relation { predicate, arguments } => {
            A::Relation { predicate, arguments: arguments.into_iter().map(term).collect() }
        }
        A::Not { predicate, arguments } => {
            A::Not { predicate, arguments: arguments.into_iter().map(term).collect() }
        }
        A::BuiltIn { built_in, arguments } => {
            A::BuiltIn { built_in, arguments: arguments.into_iter().map(term).collect() }
        }
        A::NotBuiltIn { built_in, arguments } => {
            A::NotBuiltIn { built_in, arguments: arguments.into_iter().map(term).collect() }
        }
        A::Aggregate { .. } => atom.clone(),
        A::NotSame(left, right) => A::NotSame(term(left), term(right)),
        A::NotDifferent(left, right) => A::NotDifferent(term(left), term(right)),
        A::Same(left, right) => A::Same(term(left), term(right)),
        A::Different(left, right) => A::Different(term(left), term(right)),
    }
}

fn lower_rule(rule: &Rule, identity: &RuleIdentity, context: &mut Context) -> Result<(), String> {
    let mut variables = Variables::default();
    let mut bodies: Vec<Conjunction> = vec![Vec::new()];
    for atom in &rule.body {
        let mut alternatives = condition(context, atom, &mut variables)?;
        if let Atom::Class(class, argument) = atom
            && bodies.len() * alternatives.len() > class::MAX_ALTERNATIVES
        {
            let x = term(context, argument, &mut variables);
            alternatives = class::abbreviated(context, class, alternatives, x);
        }
        bodies = cross(&bodies, &alternatives);
    }
    for body in &mut bodies {
        individuals(context, rule, body, &mut variables);
    }
    // Head atoms with a condition of their own need a separate rule.
    let (mut heads, mut conditional) = (Vec::new(), Vec::new());
    for atom in &rule.head {
        for (body, head) in conclusions(context, atom, &mut variables)? {
            if body.is_empty() && !head.is_empty() {
                heads.extend(head);
            } else {
                conditional.push((body, head));
            }
        }
    }
    for body in &bodies {
        // An empty head in the document is an integrity constraint.
        if !heads.is_empty() || rule.head.is_empty() {
            context.rule(identity, heads.clone(), body.clone(), &variables);
        }
        for (conditions, head) in &conditional {
            let body = body.iter().chain(conditions).cloned().collect();
            context.rule(identity, head.clone(), body, &variables);
        }
    }
    Ok(())
}

/// Adds `owl:Thing` atoms for variables that the body otherwise leaves unbound, so that they range over all
/// individuals. Considers the variable of each `owl:Thing` atom (which lowering drops), and the first variable of
/// each equality of two variables.
fn individuals(context: &mut Context, rule: &Rule, body: &mut Conjunction, variables: &mut Variables) {
    for atom in &rule.body {
        let argument = match atom {
            Atom::Class(ClassExpression::Class(iri), argument) if &**iri == owl::THING => argument,
            Atom::SameIndividual(first, Argument::Variable(_)) => first,
            _ => continue,
        };
        if let (Argument::Variable(_), x) = (argument, term(context, argument, variables))
            && !is_bound(body, x)
        {
            body.push(context.thing(x));
        }
    }
}

/// Returns `true` if a relation atom binds the variable `x`, or if `x` equals a constant or a variable
/// of a relation atom.
fn is_bound(body: &Conjunction, x: Term) -> bool {
    let binds = |atom: &rules::Atom| matches!(atom, rules::Atom::Relation { arguments, .. } if arguments.contains(&x));
    body.iter().any(|atom| match atom {
        rules::Atom::Same(left, right) if *left == x || *right == x => {
            let other = if *left == x { *right } else { *left };
            other != x && (matches!(other, Term::Constant(_)) || body.iter().any(|atom| {
                matches!(atom, rules::Atom::Relation { arguments, .. } if arguments.contains(&other))
            }))
        }
        atom => binds(atom),
    })
}

fn term(context: &mut Context, argument: &Argument, variables: &mut Variables) -> Term {
    match argument {
        Argument::Variable(iri) => variables.of_iri(iri),
        Argument::Individual(iri) => context.constant(iri),
        Argument::Literal(literal) => Term::Constant(context.literal(literal)),
    }
}

fn condition(
    context: &mut Context,
    atom: &Atom,
    variables: &mut Variables,
) -> Result<Vec<Conjunction>, String> {
    Ok(match atom {
        Atom::Class(ClassExpression::Class(iri), _) if &**iri == owl::THING => vec![Vec::new()],
        Atom::Class(class, argument) => {
            let x = term(context, argument, variables);
            class::condition(context, class, x, variables)
        }
        Atom::DataRange(range, argument) => {
            let value = term(context, argument, variables);
            range::condition(context, range, value)?
        }
        Atom::ObjectProperty(property, first, second) => {
            let (x, y) = (term(context, first, variables), term(context, second, variables));
            vec![vec![context.property(property, x, y)]]
        }
        Atom::DataProperty(property, first, second) => {
            let (x, y) = (term(context, first, variables), term(context, second, variables));
            vec![vec![context.relation(property, [x, y])]]
        }
        Atom::SameIndividual(first, second) => {
            vec![vec![rules::Atom::Same(term(context, first, variables), term(context, second, variables))]]
        }
        Atom::DifferentIndividuals(first, second) => {
            let (x, y) = (term(context, first, variables), term(context, second, variables));
            vec![vec![context.different(x, y)]]
        }
        Atom::BuiltIn(iri, arguments) => {
            let unknown = || {
                let suggestion = BuiltIn::similar(iri).map(|name| format!("; did you mean `{name}`?"));
                format!("the built-in <{iri}> is not known{}", suggestion.unwrap_or_default())
            };
            let built_in = BuiltIn::from_iri(iri).ok_or_else(unknown)?;
            let arguments = with_names(built_in, arguments.clone());
            let arguments = arguments.iter().map(|argument| term(context, argument, variables)).collect();
            vec![vec![rules::Atom::BuiltIn { built_in, arguments }]]
        }
    })
}

/// Prepends the names of the argument variables to the expression of `swrlm:eval`.
fn with_names(built_in: BuiltIn, mut arguments: Vec<Argument>) -> Vec<Argument> {
    if let [_, Argument::Literal(text), values @ ..] = arguments.as_mut_slice() {
        let name = |argument: &Argument| match argument {
            Argument::Variable(iri) => Some(iri.to_string()),
            _ => None,
        };
        let names: Vec<Option<String>> = values.iter().map(name).collect();
        let names: Vec<Option<&str>> = names.iter().map(Option::as_deref).collect();
        if let Some(expression) = built_in.with_names(&text.lexical, &names) {
            text.lexical = expression.into();
        }
    }
    arguments
}

fn conclusions(
    context: &mut Context,
    atom: &Atom,
    variables: &mut Variables,
) -> Result<class::Conclusions, String> {
    match atom {
        Atom::Class(class, argument) => {
            let x = term(context, argument, variables);
            Ok(class::conclusions(context, class, x, variables))
        }
        Atom::DataRange(..) => Err("a data range as a conclusion".to_owned()),
        Atom::BuiltIn(..) => Err("a built-in as a conclusion".to_owned()),
        _ => {
            let alternatives = condition(context, atom, variables)?;
            Ok(alternatives.into_iter().map(|atoms| (Vec::new(), atoms)).collect())
        }
    }
}
