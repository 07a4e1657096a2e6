//! Clauses of derived predicates: a head, and a body that is a conjunction of atoms and inequalities. Converts
//! axioms of a domain to clauses, and replaces atoms in the body of a clause by their definitions (unfolding).

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{Condition, Derived, Name, Term, TypedName};

/// Maximum number of conjunctions in the disjunctive normal form of an axiom, and of the clauses that unfolding
/// a predicate considers.
pub(super) const MAX_CLAUSES: usize = 1000;

pub(super) type Fact = (Name, Vec<Name>);

/// A Horn clause `head(arguments) ← body`, possibly with inequalities in the body. Its variables
/// are local to the clause.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Clause {
    pub head: Name,
    pub arguments: Vec<Operand>,
    pub body: Vec<Literal>,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Literal {
    /// An atom: predicate and arguments. Type tests are unary atoms, see [`of_type`].
    Holds(Name, Vec<Operand>),
    Equal(bool, Operand, Operand),
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Operand {
    Variable(Name),
    Constant(Name),
}

impl Literal {
    pub fn name(&self) -> Option<&Name> {
        match self {
            Self::Holds(name, _) => Some(name),
            Self::Equal(..) => None,
        }
    }

    /// Returns `true` if the predicate is the relation of a type.
    pub fn is_type(&self) -> bool {
        matches!(self, Self::Holds(name, _) if name.as_str().contains(' '))
    }

    pub fn operands(&self) -> Vec<&Operand> {
        match self {
            Self::Holds(_, operands) => operands.iter().collect(),
            Self::Equal(_, left, right) => vec![left, right],
        }
    }
}

/// Returns the name of the relation that contains the objects of a type. The name contains a blank,
/// so it differs from all predicates.
pub(super) fn of_type(r#type: &Name) -> Name {
    Name::new(&format!("type {type}"))
}

/// Converts a derived predicate to clauses without equalities. Supports conjunctions, disjunctions and existential
/// quantifiers over atoms, equalities and negated equalities. Returns `None` for other conditions, for repeated
/// variable names (except in alternative disjuncts), for variables with several types, and if a limit is exceeded.
pub(super) fn clauses(derived: &Derived) -> Option<Vec<Clause>> {
    let head = &derived.head;
    let mut variables: BTreeSet<Name> = BTreeSet::new();
    let typed = typed(&head.parameters, &mut variables)?;
    let parameters =
        head.parameters.iter().map(|parameter| Operand::Variable(parameter.identifier.name.clone()));
    let arguments: Vec<Operand> = parameters.collect();
    let name = &head.identifier.name;
    let clause = |body: Vec<Literal>| {
        let body = [typed.clone(), body].concat();
        Clause { head: name.clone(), arguments: arguments.clone(), body }.resolved()
    };
    Some(disjuncts(&derived.condition, &mut variables)?.into_iter().filter_map(clause).collect())
}

/// Returns a type test for each typed variable, and adds the variables to `names`. Returns `None`
/// if a variable name occurs twice or a variable has several alternative types.
fn typed(variables: &[TypedName], names: &mut BTreeSet<Name>) -> Option<Vec<Literal>> {
    let mut types = Vec::new();
    for variable in variables {
        let name = &variable.identifier.name;
        if !names.insert(name.clone()) {
            return None;
        }
        match &variable.r#type.alternatives[..] {
            [] => {}
            [r#type] => {
                types.push(Literal::Holds(of_type(&r#type.name), vec![Operand::Variable(name.clone())]));
            }
            _ => return None,
        }
    }
    Some(types)
}

/// Converts a condition to disjunctive normal form, as a list of conjunctions. Returns `None` for
/// unsupported conditions, and for more than [`MAX_CLAUSES`] conjunctions.
fn disjuncts(condition: &Condition, variables: &mut BTreeSet<Name>) -> Option<Vec<Vec<Literal>>> {
    let single = |literal| Some(vec![vec![literal]]);
    match condition {
        Condition::And(parts) => {
            let mut conjunctions = vec![Vec::new()];
            for part in parts {
                let part = disjuncts(part, variables)?;
                let concatenated =
                    |left: &Vec<Literal>, right: &Vec<Literal>| [left.clone(), right.clone()].concat();
                // The form grows exponentially with the conjuncts; an axiom that is not a clause is merely less
                // efficient.
                if conjunctions.len() * part.len() > MAX_CLAUSES {
                    return None;
                }
                conjunctions = conjunctions
                    .iter()
                    .flat_map(|left| part.iter().map(move |right| concatenated(left, right)))
                    .collect();
            }
            Some(conjunctions)
        }
        Condition::Or(parts) => {
            // Several disjuncts may bind the same name, but no later conjunct.
            let outer = variables.clone();
            let mut conjunctions = Vec::new();
            for part in parts {
                let mut names = outer.clone();
                conjunctions.extend(disjuncts(part, &mut names)?);
                if conjunctions.len() > MAX_CLAUSES {
                    return None;
                }
                variables.extend(names);
            }
            Some(conjunctions)
        }
        Condition::Exists(bound, inner) => {
            let types = typed(bound, variables)?;
            let inner = disjuncts(inner, variables)?;
            Some(inner.into_iter().map(|part| [types.clone(), part].concat()).collect())
        }
        Condition::Atom(atom) => {
            single(Literal::Holds(atom.predicate.name.clone(), atom.arguments.iter().map(operand).collect()))
        }
        Condition::Equal(left, right, _) => single(Literal::Equal(true, operand(left), operand(right))),
        Condition::Not(inner) => match &**inner {
            Condition::Equal(left, right, _) => single(Literal::Equal(false, operand(left), operand(right))),
            _ => None,
        },
        _ => None,
    }
}

pub(super) fn operand(term: &Term) -> Operand {
    match term {
        Term::Variable(identifier) => Operand::Variable(identifier.name.clone()),
        Term::Constant(identifier) => Operand::Constant(identifier.name.clone()),
    }
}

impl Clause {
    /// Returns `true` if each variable of the clause occurs in an atom that is not a type test. The facts of
    /// these atoms then limit what the clause derives, however many objects there are.
    pub fn is_bound(&self) -> bool {
        let atoms = self.body.iter().filter(|part| matches!(part, Literal::Holds(..)) && !part.is_type());
        let bound: BTreeSet<&Operand> = atoms.flat_map(Literal::operands).collect();
        let operands = self.body.iter().flat_map(Literal::operands).chain(&self.arguments);
        operands.into_iter().all(|operand| matches!(operand, Operand::Constant(_)) || bound.contains(operand))
    }

    /// Eliminates equalities by substitution, and removes repeated conjuncts and true inequalities of
    /// constants. Returns `None` if an equality or inequality can never hold, e.g. `a = b` for two constants.
    fn resolved(mut self) -> Option<Self> {
        while let Some(at) = self.body.iter().position(|part| matches!(part, Literal::Equal(true, ..))) {
            let Literal::Equal(_, left, right) = self.body.remove(at) else { continue };
            match (left, right) {
                (left, right) if left == right => {}
                (Operand::Variable(name), other) | (other, Operand::Variable(name)) => {
                    self = self.with(&BTreeMap::from([(name, other)]));
                }
                _ => return None,
            }
        }
        let constant = |operand: &Operand| matches!(operand, Operand::Constant(_));
        for part in &self.body {
            if let Literal::Equal(false, left, right) = part
                && left == right
            {
                return None;
            }
        }
        self.body.retain(|part| match part {
            Literal::Equal(false, left, right) => !(constant(left) && constant(right)),
            _ => true,
        });
        self.body.sort();
        self.body.dedup();
        Some(self)
    }

    fn with(self, map: &BTreeMap<Name, Operand>) -> Self {
        let substitute = |operand: Operand| match &operand {
            Operand::Variable(name) => map.get(name).cloned().unwrap_or(operand),
            Operand::Constant(_) => operand,
        };
        let substitute_all = |operands: Vec<Operand>| operands.into_iter().map(substitute).collect();
        let part = |part: Literal| match part {
            Literal::Holds(name, operands) => Literal::Holds(name, substitute_all(operands)),
            Literal::Equal(is_equality, left, right) => {
                Literal::Equal(is_equality, substitute(left), substitute(right))
            }
        };
        Self {
            head: self.head,
            arguments: substitute_all(self.arguments),
            body: self.body.into_iter().map(part).collect(),
        }
    }

    /// Replaces the atom at position `at` of the body by the body of `by`, a clause for the atom's predicate.
    /// The variables of `by` are renamed with a blank and `depth` as a suffix; names in PDDL have no blank. Returns
    /// `None` if the atom and the head of `by` do not unify, or if the result contains an inequality that can never
    /// hold.
    pub fn unfolded(&self, at: usize, by: &Self, depth: usize) -> Option<Self> {
        let Literal::Holds(_, operands_of_atom) = &self.body[at] else { return None };
        let operands = by.body.iter().flat_map(Literal::operands).chain(&by.arguments);
        let names = operands.filter_map(|operand| match operand {
            Operand::Variable(name) => Some(name.clone()),
            Operand::Constant(_) => None,
        });
        let fresh = names.map(|name| {
            let renamed = Name::new(&format!("{name} {depth}"));
            (name, Operand::Variable(renamed))
        });
        let by = by.clone().with(&fresh.collect());
        let mut body = self.body.clone();
        body.remove(at);
        let pairs = operands_of_atom.iter().cloned().zip(by.arguments);
        body.extend(pairs.map(|(left, right)| Literal::Equal(true, left, right)));
        body.extend(by.body);
        Self { head: self.head.clone(), arguments: self.arguments.clone(), body }.resolved()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conjunctions_of_many_disjunctions_are_not_clauses() {
        let clauses_of = |conjuncts: usize| {
            let text = format!(
                "(define (domain d) (:predicates (a ?x) (b ?x) (c ?x))\n (:derived (c ?x) (and {})))",
                "(or (a ?x) (b ?x)) ".repeat(conjuncts)
            );
            let domain = pddl::parse_domain(&pddl::Source::new("d.pddl", text)).0.expect("a domain");
            clauses(&domain.derived[0]).map(|clauses| clauses.len())
        };
        assert_eq!(clauses_of(2), Some(4));
        assert_eq!(clauses_of(40), None);
    }
}
