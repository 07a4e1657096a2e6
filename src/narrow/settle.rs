//! Which derived predicates of a knowledge base no action and no event can change, and the clauses that decide them.
//!
//! A predicate is *open* if an action or an event changes it, if it has an axiom that is not a clause, or if a clause for it asks for
//! an open one. Taken as they stand, the axioms about domains and ranges open nearly everything: what
//! `(functionGrounding ?f ?fd)` relates is concluded to be a function and a function design. Such a conclusion says nothing new
//! where each action that adds the fact asks first whether its arguments are stated to be of that class (a *guard*), and where
//! the initial state keeps to it. So clauses of an open predicate are unfolded \[1\]; those that conclude what they ask for are
//! dropped, and so are those with a fact that guards the conclusion. If no open atom is left, the predicate is *settled*.
//! Each step keeps the least fixpoint as it is, in every state that can be reached.
//!
//! \[1\] H. Tamaki, T. Sato: Unfold/fold transformation of logic programs, ICLP 1984.

use std::collections::{BTreeMap, BTreeSet};

use pddl::ast::{Action, ActionBody, Atom, Condition, Domain, Effect, Name, Term};

use super::clause::{Clause, Fact, Literal, Operand};

/// How often a clause is unfolded, and how many clauses of one predicate that may make.
const DEPTH: usize = 8;
const CLAUSES: usize = 1000;

/// That arguments of a fact which actions add are stated to be of some classes: predicate, position, class.
pub(super) type Guards = BTreeSet<(Name, usize, Name)>;

/// The classes that all actions of a domain require of the arguments of the facts that they add. A class guards only if the initial
/// state alone decides what belongs to it, so that `varying` has the predicates that actions or events change, and derived predicates.
pub(super) fn guards(domain: &Domain, varying: &BTreeSet<Name>, timed: &BTreeSet<Name>) -> Guards {
    let mut found: BTreeMap<(Name, usize), BTreeSet<Name>> = BTreeMap::new();
    for action in &domain.actions {
        let Additions { classes, atoms } = additions(action, varying);
        for (atom, bound) in atoms {
            for (position, argument) in atom.arguments.iter().enumerate() {
                let is_asked = |of: &Term| same(of, argument) && !is_bound(argument, &bound);
                let own = classes.iter().filter(|(_, of)| is_asked(of)).map(|(class, _)| class.clone());
                let own: BTreeSet<Name> = own.collect();
                let key = (atom.predicate.name.clone(), position);
                found.entry(key).and_modify(|all| all.retain(|class| own.contains(class))).or_insert(own);
            }
        }
    }
    let each = found.into_iter().filter(|((predicate, _), _)| !timed.contains(predicate));
    each.flat_map(|((predicate, position), classes)| {
        classes.into_iter().map(move |class| (predicate.clone(), position, class))
    })
    .collect()
}

/// The facts that an action adds, and the classes that it requires of objects.
pub(super) struct Additions<'a> {
    /// Predicates of one argument, and the argument.
    pub classes: Vec<(Name, &'a Term)>,
    /// Added atoms, each with the variables that quantifiers within the effect bind.
    pub atoms: Vec<(&'a Atom, Vec<&'a Name>)>,
}

/// The additions of an action. Predicates in `varying` are no classes.
pub(super) fn additions<'a>(action: &'a Action, varying: &BTreeSet<Name>) -> Additions<'a> {
    let (conditions, effects): (Vec<&Condition>, Vec<&Effect>) = match &action.body {
        ActionBody::Instantaneous { precondition, effect } => (vec![precondition], vec![effect]),
        // A condition at the start need not hold when the action adds the fact; classes are never changed.
        ActionBody::Durative { conditions, effects, .. } => {
            (conditions.iter().map(|(_, own)| own).collect(), effects.iter().map(|(_, own)| own).collect())
        }
    };
    let mut atoms = Vec::new();
    for effect in effects {
        added(effect, &[], &mut atoms);
    }
    Additions { classes: classes(&conditions, varying), atoms }
}

/// The unary atoms that a condition requires, without those of `varying` predicates, which may hold of other things in other states.
fn classes<'c>(asked: &[&'c Condition], varying: &BTreeSet<Name>) -> Vec<(Name, &'c Term)> {
    let (mut parts, mut found) = (asked.to_vec(), Vec::new());
    while let Some(part) = parts.pop() {
        match part {
            Condition::And(more) => parts.extend(more),
            Condition::Atom(atom) if !varying.contains(&atom.predicate.name) => {
                if let [own] = &atom.arguments[..] {
                    found.push((atom.predicate.name.clone(), own));
                }
            }
            _ => {}
        }
    }
    found
}

/// The atoms that an effect adds, each with the variables that quantifiers within the effect bind.
fn added<'e>(effect: &'e Effect, bound: &[&'e Name], found: &mut Vec<(&'e Atom, Vec<&'e Name>)>) {
    match effect {
        Effect::And(parts) => {
            for part in parts {
                added(part, bound, found);
            }
        }
        Effect::Add(atom) => found.push((atom, bound.to_vec())),
        Effect::ForAll(variables, inner) => {
            let own = variables.iter().map(|own| &own.identifier.name);
            added(inner, &bound.iter().copied().chain(own).collect::<Vec<_>>(), found);
        }
        Effect::When(_, inner) => added(inner, bound, found),
        Effect::Delete(_) | Effect::Assign(..) => {}
    }
}

pub(super) fn same(left: &Term, right: &Term) -> bool {
    match (left, right) {
        (Term::Variable(left), Term::Variable(right)) | (Term::Constant(left), Term::Constant(right)) => {
            left.name == right.name
        }
        _ => false,
    }
}

fn is_bound(term: &Term, bound: &[&Name]) -> bool {
    matches!(term, Term::Variable(own) if bound.contains(&&own.name))
}

/// The clauses of settled predicates, and those of the others.
pub(super) type Parted = (BTreeMap<Name, Vec<Clause>>, BTreeMap<Name, Option<Vec<Clause>>>);

/// The clauses of settled predicates, in which no open predicate occurs.
pub(super) fn settle(
    mut all: BTreeMap<Name, Option<Vec<Clause>>>,
    changed: &BTreeSet<Name>,
    guards: &Guards,
) -> Parted {
    loop {
        let open = open(&all, changed);
        let candidates = all.keys().filter(|head| open.contains(*head));
        let found = candidates.into_iter().find_map(|head| {
            let clauses = Unfold { all: &all, open: &open, guards, head }.clauses()?;
            Some((head.clone(), clauses))
        });
        let Some((head, clauses)) = found else {
            let (open, settled): (BTreeMap<_, _>, BTreeMap<_, _>) =
                all.into_iter().partition(|(head, _)| open.contains(head));
            let settled = settled.into_iter().filter_map(|(head, clauses)| Some((head, clauses?)));
            return (settled.collect(), open);
        };
        all.insert(head, Some(clauses));
    }
}

/// The predicates that may change from state to state.
fn open(all: &BTreeMap<Name, Option<Vec<Clause>>>, changed: &BTreeSet<Name>) -> BTreeSet<Name> {
    let mut open = changed.clone();
    loop {
        let asks = |clauses: &Vec<Clause>| clauses.iter().any(|clause| first_open(clause, &open).is_some());
        let more: Vec<Name> = all
            .iter()
            .filter(|(head, clauses)| !open.contains(*head) && clauses.as_ref().is_none_or(asks))
            .map(|(head, _)| head.clone())
            .collect();
        if more.is_empty() {
            return open;
        }
        open.extend(more);
    }
}

fn first_open(clause: &Clause, open: &BTreeSet<Name>) -> Option<usize> {
    clause.body.iter().position(|part| matches!(part, Literal::Holds(name, _) if open.contains(name)))
}

/// One predicate whose clauses are unfolded.
struct Unfold<'a> {
    all: &'a BTreeMap<Name, Option<Vec<Clause>>>,
    open: &'a BTreeSet<Name>,
    guards: &'a Guards,
    head: &'a Name,
}

impl Unfold<'_> {
    /// Clauses without open atoms; none if some are left.
    fn clauses(&self) -> Option<Vec<Clause>> {
        let mut left: Vec<(Clause, usize)> =
            self.all[self.head].as_ref()?.iter().map(|clause| (clause.clone(), 0)).collect();
        let (mut done, mut count) = (BTreeSet::new(), 0);
        while let Some((clause, depth)) = left.pop() {
            count += 1;
            if count > CLAUSES {
                return None;
            }
            if self.says_nothing(&clause) {
                continue;
            }
            let Some(at) = first_open(&clause, self.open) else {
                done.insert(clause);
                continue;
            };
            let Literal::Holds(name, _) = &clause.body[at] else { return None };
            if depth >= DEPTH || name == self.head {
                return None;
            }
            // What actions change has no clauses, and not all axioms of a domain are clauses.
            let by = self.all.get(name)?.as_ref()?;
            left.extend(by.iter().filter_map(|by| Some((clause.unfolded(at, by, depth + 1)?, depth + 1))));
        }
        Some(done.into_iter().collect())
    }

    /// Whether a clause asks for what it concludes, or for a fact of which that is stated anyway.
    fn says_nothing(&self, clause: &Clause) -> bool {
        clause.body.iter().any(|part| {
            let Literal::Holds(name, operands) = part else { return false };
            let itself = name == self.head && *operands == clause.arguments;
            let guarded = |(predicate, position, class): &(Name, usize, Name)| {
                predicate == name
                    && clause.arguments[..] == operands[*position..=*position]
                    && self.holds_of_all(class)
            };
            itself || self.guards.iter().any(guarded)
        })
    }

    /// Returns `true` if a clause concludes the predicate of all members of a class.
    fn holds_of_all(&self, class: &Name) -> bool {
        let is_inclusion = |clause: &Clause| match (&clause.body[..], &clause.arguments[..]) {
            ([Literal::Holds(name, operands)], [Operand::Variable(_)]) => {
                name == class && *operands == clause.arguments
            }
            _ => false,
        };
        self.all[self.head].iter().flatten().any(is_inclusion)
    }
}

/// Whether a fact keeps to a guard, where so much is stated.
pub(super) fn keeps(
    (predicate, arguments): &Fact,
    (guarded, position, class): &(Name, usize, Name),
    stated: &BTreeSet<Fact>,
) -> bool {
    let has = |of: &Name| stated.contains(&(class.clone(), vec![of.clone()]));
    predicate != guarded || arguments.get(*position).is_none_or(has)
}
