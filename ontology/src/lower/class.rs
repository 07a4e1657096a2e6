//! Lowers class expressions as conditions (in bodies) and as conclusions (in heads), as far as OWL 2 RL admits
//! them.

use rules::{Atom, Term};

use super::context::{Conjunction, Context, Equality, INTERNAL, Variables, cross, identity};
use super::range;
use crate::owl::{Axiom, Bound, ClassExpression, DataRange, Iri, ObjectPropertyExpression};
use crate::vocab::owl;

/// Consequences of membership in a class: pairs of additional conditions and head atoms. An empty head
/// is a contradiction.
pub(crate) type Conclusions = Vec<(Conjunction, Vec<Atom>)>;

/// Lowers a class as a condition. Returns alternative conjunctions of atoms: `x` is in `class` if one of
/// them holds. Each part without a rule form is recorded as a gap in `context`.
pub(crate) fn condition(
    context: &mut Context,
    class: &ClassExpression,
    x: Term,
    variables: &mut Variables,
) -> Vec<Conjunction> {
    use ClassExpression as C;
    match class {
        C::Class(iri) if &**iri == owl::THING => vec![Vec::new()],
        C::Class(iri) if &**iri == owl::NOTHING => Vec::new(),
        C::Class(iri) => vec![vec![context.relation(iri, [x])]],
        C::IntersectionOf(classes) => {
            let factors = classes.iter().map(|class| (class, condition(context, class, x, variables)));
            let factors: Vec<_> = factors.collect();
            let size = factors
                .iter()
                .fold(1, |size: usize, (_, alternatives)| size.saturating_mul(alternatives.len()));
            let mut product = vec![Vec::new()];
            for (class, mut alternatives) in factors {
                // Expansion would be exponential in the number of unions.
                if size > MAX_ALTERNATIVES {
                    alternatives = abbreviated(context, class, alternatives, x);
                }
                product = cross(&product, &alternatives);
            }
            product
        }
        C::UnionOf(classes) => {
            let mut alternatives = Vec::new();
            for class in classes {
                alternatives.extend(condition(context, class, x, variables));
            }
            alternatives
        }
        C::OneOf(individuals) => {
            individuals.iter().map(|iri| vec![Atom::Same(x, context.constant(iri))]).collect()
        }
        C::SomeValuesFrom(property, filler) | C::Cardinality(Bound::Min, 1, property, filler) => {
            if let Some(restriction) = context.inclusions.condition(class) {
                let name = relation_of(&restriction);
                if context.abbreviated.insert(name.clone()) {
                    let mut variables = Variables::default();
                    let member = variables.fresh("x");
                    let head = context.relation(&name, [member]);
                    for body in some_value(context, property, filler, member, &mut variables) {
                        context.auxiliary_rule(&restriction, head.clone(), body, &variables);
                    }
                }
                return vec![vec![context.relation(&name, [x])]];
            }
            some_value(context, property, filler, x, variables)
        }
        C::HasValue(property, individual) => {
            let value = context.constant(individual);
            vec![vec![context.property(property, x, value)]]
        }
        C::HasSelf(property) => vec![vec![context.property(property, x, x)]],
        C::DataSomeValuesFrom(property, range) | C::DataCardinality(Bound::Min, 1, property, range) => {
            let value = variables.fresh("v");
            let edge = vec![vec![context.relation(property, [x, value])]];
            cross(&edge, &range_condition(context, range, value))
        }
        C::DataHasValue(property, literal) => {
            let value = Term::Constant(context.literal(literal));
            vec![vec![context.relation(property, [x, value])]]
        }
        C::ComplementOf(_) => context.gap("a complement as a condition"),
        C::AllValuesFrom(..) | C::DataAllValuesFrom(..) => {
            // Under the open-world assumption, an individual may always have further values. Therefore only a
            // membership in an included restriction proves a universal restriction.
            context.gap::<()>("a universal restriction as a condition");
            let restriction = context.inclusions.condition(class);
            let atom = restriction.map(|restriction| context.relation(&relation_of(&restriction), [x]));
            atom.map(|atom| vec![atom]).into_iter().collect()
        }
        C::Cardinality(..) | C::DataCardinality(..) => context.gap("a cardinality as a condition"),
    }
}

fn some_value(
    context: &mut Context,
    property: &ObjectPropertyExpression,
    filler: &ClassExpression,
    x: Term,
    variables: &mut Variables,
) -> Vec<Conjunction> {
    let y = variables.fresh("y");
    let edge = vec![vec![context.property(property, x, y)]];
    cross(&edge, &condition(context, filler, y, variables))
}

/// Limit on the number of alternatives to which a conjunction of unions is expanded. Larger conjunctions
/// use auxiliary relations.
pub(crate) const MAX_ALTERNATIVES: usize = 16;

/// Replaces the alternative conjunctions for `x` in `class` by one atom of an auxiliary relation. A rule for each
/// alternative derives the relation. Fewer than two alternatives are returned unchanged. If one of several
/// alternatives is empty, `x` is always in `class`, and the result is the empty conjunction.
pub(crate) fn abbreviated(
    context: &mut Context,
    class: &ClassExpression,
    alternatives: Vec<Conjunction>,
    x: Term,
) -> Vec<Conjunction> {
    if alternatives.len() < 2 {
        return alternatives;
    }
    // An empty conjunction always holds.
    if alternatives.iter().any(Vec::is_empty) {
        return vec![Vec::new()];
    }
    let name = format!("{INTERNAL}class:{class}");
    if context.abbreviated.insert(name.clone()) {
        let mut variables = Variables::default();
        let member = variables.fresh("x");
        for body in condition(context, class, member, &mut variables) {
            let head = context.relation(&name, [member]);
            context.auxiliary_rule(class, head, body, &variables);
        }
    }
    vec![vec![context.relation(&name, [x])]]
}

/// Lowers a class as a condition, like [`condition`], but replaces many alternatives by one atom of an auxiliary relation.
/// If two classes are combined, the number of rules would be quadratic.
pub(crate) fn brief_condition(
    context: &mut Context,
    class: &ClassExpression,
    x: Term,
    variables: &mut Variables,
) -> Vec<Conjunction> {
    let alternatives = condition(context, class, x, variables);
    if alternatives.len() > MAX_ALTERNATIVES {
        return abbreviated(context, class, alternatives, x);
    }
    alternatives
}

fn range_condition(context: &mut Context, range: &DataRange, value: Term) -> Vec<Conjunction> {
    range::condition(context, range, value).unwrap_or_else(|reason| context.gap(reason))
}

/// Returns the consequences of `x` being in `class`. Consequences that rules cannot express are recorded as
/// gaps.
pub(crate) fn conclusions(
    context: &mut Context,
    class: &ClassExpression,
    x: Term,
    variables: &mut Variables,
) -> Conclusions {
    use ClassExpression as C;
    let heads = |atom| vec![(Vec::new(), vec![atom])];
    match class {
        C::Class(iri) if &**iri == owl::THING => Vec::new(),
        C::Class(iri) if &**iri == owl::NOTHING => vec![(Vec::new(), Vec::new())],
        C::Class(iri) => heads(context.relation(iri, [x])),
        C::IntersectionOf(classes) => {
            let mut consequences = Vec::new();
            for class in classes {
                consequences.extend(conclusions(context, class, x, variables));
            }
            consequences
        }
        C::OneOf(individuals) => one_of(context, individuals, x),
        C::HasValue(property, individual) => {
            let value = context.constant(individual);
            heads(context.property(property, x, value))
        }
        C::HasSelf(property) => heads(context.property(property, x, x)),
        C::DataHasValue(property, literal) => {
            let value = Term::Constant(context.literal(literal));
            heads(context.relation(property, [x, value]))
        }
        C::ComplementOf(class) => {
            let forbidden = condition(context, class, x, variables);
            forbidden.into_iter().map(|body| (body, Vec::new())).collect()
        }
        C::AllValuesFrom(property, filler) => {
            let mut consequences = all_values(context, property, filler, x, variables);
            consequences.extend(included(context, class, x));
            consequences
        }
        C::DataAllValuesFrom(property, range) => {
            let value = variables.fresh("v");
            let edge = context.relation(property, [x, value]);
            let bodies = range::violations(context, range, &[edge], value);
            let bodies = bodies.unwrap_or_else(|reason| context.gap(reason));
            bodies.into_iter().map(|body| (body, Vec::new())).collect()
        }
        C::Cardinality(Bound::Max, 0, property, filler) => {
            let y = variables.fresh("y");
            let edge = vec![vec![context.property(property, x, y)]];
            let forbidden = cross(&edge, &condition(context, filler, y, variables));
            forbidden.into_iter().map(|body| (body, Vec::new())).collect()
        }
        C::Cardinality(Bound::Max, 1, property, filler) => {
            at_most_one(context, property, filler, x, variables)
        }
        C::DataCardinality(Bound::Max, limit @ (0 | 1), property, range) => {
            at_most(context, *limit, property, range, x, variables)
        }
        C::Cardinality(Bound::Exact, n @ (0 | 1), property, filler) => {
            let at_most_n = C::Cardinality(Bound::Max, *n, property.clone(), filler.clone());
            let mut consequences = conclusions(context, &at_most_n, x, variables);
            if *n == 1 {
                context.gap::<()>(EXISTS);
                consequences.extend(included(context, class, x));
            }
            consequences
        }
        C::DataCardinality(Bound::Exact, n @ (0 | 1), property, range) => {
            let consequences = at_most(context, *n, property, range, x, variables);
            if *n == 1 {
                context.gap::<()>(EXISTS);
            }
            consequences
        }
        C::Cardinality(Bound::Min, 0, ..) | C::DataCardinality(Bound::Min, 0, ..) => Vec::new(),
        C::SomeValuesFrom(property, filler) | C::Cardinality(Bound::Min, 1, property, filler) => {
            match &**filler {
                C::OneOf(individuals) if individuals.len() == 1 => {
                    let value = context.constant(&individuals[0]);
                    heads(context.property(property, x, value))
                }
                _ => only_included(context, class, x, EXISTS),
            }
        }
        C::DataSomeValuesFrom(property, DataRange::OneOf(values)) if values.len() == 1 => {
            let value = Term::Constant(context.literal(&values[0]));
            heads(context.relation(property, [x, value]))
        }
        C::DataSomeValuesFrom(..) | C::DataCardinality(Bound::Min, 1, ..) => context.gap(EXISTS),
        C::UnionOf(_) => context.gap("a union as a conclusion"),
        C::Cardinality(..) | C::DataCardinality(..) => {
            only_included(context, class, x, "a cardinality as a conclusion")
        }
    }
}

fn one_of(context: &mut Context, individuals: &[Iri], x: Term) -> Conclusions {
    match (context.equality, individuals) {
        // Different names are not concluded to be equal, as for functional properties.
        (Equality::UniqueNames, _) => {
            let differs = |individual: &Iri| Atom::Different(x, context.constant(individual));
            vec![(individuals.iter().map(differs).collect(), Vec::new())]
        }
        (Equality::UncheckedUniqueNames, [_]) => Vec::new(),
        (Equality::Owl, [individual]) => {
            vec![(Vec::new(), vec![Atom::Same(x, context.constant(individual))])]
        }
        _ => context.gap("a union as a conclusion"),
    }
}

fn at_most_one(
    context: &mut Context,
    property: &ObjectPropertyExpression,
    filler: &ClassExpression,
    x: Term,
    variables: &mut Variables,
) -> Conclusions {
    if context.equality == Equality::UncheckedUniqueNames {
        return Vec::new();
    }
    let (y, z) = (variables.fresh("y"), variables.fresh("z"));
    let edges = vec![vec![context.property(property, x, y), context.property(property, x, z)]];
    let bodies = cross(&edges, &brief_condition(context, filler, y, variables));
    let bodies = cross(&bodies, &brief_condition(context, filler, z, variables));
    let equality = context.equality;
    let conclusion = |mut body: Conjunction| match equality {
        // Different names are not concluded to be equal, as for functional properties.
        Equality::UniqueNames => {
            body.push(Atom::Different(y, z));
            (body, Vec::new())
        }
        _ => (body, vec![Atom::Same(y, z)]),
    };
    bodies.into_iter().map(conclusion).collect()
}

fn all_values(
    context: &mut Context,
    property: &ObjectPropertyExpression,
    filler: &ClassExpression,
    x: Term,
    variables: &mut Variables,
) -> Conclusions {
    let y = variables.fresh("y");
    let edge = context.property(property, x, y);
    let inner = conclusions(context, filler, y, variables);
    inner.into_iter().map(|(body, head)| (with_atom(edge.clone(), body), head)).collect()
}

/// If `class` implies a restriction (for example `∃p.C`) that is included in a restriction in the condition of an axiom
/// or rule, returns the conclusion that `x` is in the auxiliary relation of the implied restriction. Otherwise returns
/// no conclusion. See [`super::inclusion`].
fn included(context: &mut Context, class: &ClassExpression, x: Term) -> Conclusions {
    let restriction = context.inclusions.conclusion(class);
    let atom = restriction.map(|restriction| context.relation(&relation_of(&restriction), [x]));
    atom.map(|atom| (Vec::new(), vec![atom])).into_iter().collect()
}

fn only_included(
    context: &mut Context,
    class: &ClassExpression,
    x: Term,
    reason: &'static str,
) -> Conclusions {
    context.gap::<()>(reason);
    included(context, class, x)
}

pub(crate) fn lower_inclusions(context: &mut Context, position: usize) {
    for [sub, sup] in context.inclusions.pairs() {
        let mut variables = Variables::default();
        let x = variables.fresh("x");
        let [body, head] = [&sub, &sup].map(|class| context.relation(&relation_of(class), [x]));
        let identity = identity(&Axiom::SubClassOf(sub, sup), position);
        context.rule(&identity, vec![head], vec![body], &variables);
    }
}

fn relation_of(restriction: &ClassExpression) -> String {
    format!("{INTERNAL}restriction:{restriction}")
}

const EXISTS: &str = "an existential restriction as a conclusion";

/// Returns the contradiction of more than `limit` values; `limit` is 0 or 1.
fn at_most(
    context: &mut Context,
    limit: u32,
    property: &str,
    range: &DataRange,
    x: Term,
    variables: &mut Variables,
) -> Conclusions {
    let value = variables.fresh("v");
    let edge = vec![vec![context.relation(property, [x, value])]];
    let mut bodies = cross(&edge, &range_condition(context, range, value));
    if limit == 1 {
        let second_value = variables.fresh("w");
        let second =
            vec![vec![context.relation(property, [x, second_value]), Atom::Different(value, second_value)]];
        bodies = cross(&bodies, &cross(&second, &range_condition(context, range, second_value)));
    }
    bodies.into_iter().map(|body| (body, Vec::new())).collect()
}

fn with_atom(atom: Atom, mut body: Conjunction) -> Conjunction {
    body.insert(0, atom);
    body
}
