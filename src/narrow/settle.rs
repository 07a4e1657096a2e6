//! Determines the derived predicates of a domain that no action and no timed initial literal can change, and their
//! clauses.
//!
//! A predicate is *open* if an action or a timed initial literal changes it, or if it has an axiom that is not a
//! clause. It is also open if one of its clauses has an open atom in the body, or if it is outside of the vocabulary
//! (see `fold`). Axioms about domains and ranges of
//! properties make nearly every predicate open: for example, `(functionGrounding ?f ?fd)` implies that `?f` is a
//! function and `?fd` is a function design. Such a clause derives nothing new if all facts of the predicate have
//! arguments of the right class anyway. This is so if the initial facts have such arguments, and every action that adds
//! a `functionGrounding` requires that the argument is in the class. Such a requirement, by a unary predicate that
//! never changes, is a *guard*.
//!
//! Clauses of an open predicate are therefore unfolded \[1\]. A clause is dropped if its body contains its head, or an
//! atom whose guard implies the head. If no open atom remains, the predicate is *settled*. Each step preserves the
//! least fixpoint in every reachable state.
//!
//! \[1\] H. Tamaki, T. Sato: Unfold/fold transformation of logic programs, ICLP 1984.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use pddl::Signs;
use pddl::ast::{Action, ActionBody, Atom, Condition, ConditionTime, Domain, Effect, Name, Problem, Term};

use super::clause::{Clause, Fact, Literal, MAX_CLAUSES, Operand};

const MAX_DEPTH: usize = 8;

/// Guards. A guard is a predicate, an argument position and a class (unary predicate that never
/// changes). In every fact of the predicate that an action adds, the argument at this position is in
/// the class.
pub(super) type Guards = BTreeSet<(Name, usize, Name)>;

/// Returns the domain without the conditions over all of the actions whose duration may be 0. They do not apply to this
/// duration, so an action may add facts although it violates them.
pub(super) fn with_certain_conditions<'d>(domain: &'d Domain, problem: &Problem) -> Cow<'d, Domain> {
    let signs = Signs::new(domain, problem);
    let mut certain = Cow::Borrowed(domain);
    for (position, action) in domain.actions.iter().enumerate().filter(|(_, a)| signs.admit_zero(&a.body)) {
        let mut action = action.clone();
        if let ActionBody::Durative { conditions, .. } = &mut action.body {
            conditions.retain(|(time, _)| *time != ConditionTime::OverAll);
        }
        certain.to_mut().actions[position] = action;
    }
    certain
}

/// Returns the guards of a domain from [`with_certain_conditions`]: the classes that all actions require of the arguments
/// of facts that they add. `varying` contains the predicates that actions or timed initial literals change
/// and the derived predicates; they do not count as classes, because members of a class must be
/// fixed by the initial state. Predicates in `timed` have no guards.
pub(super) fn guards(domain: &Domain, varying: &BTreeSet<Name>, timed: &BTreeSet<Name>) -> Guards {
    let mut guards: BTreeMap<(Name, usize), BTreeSet<Name>> = BTreeMap::new();
    for action in &domain.actions {
        let Additions { classes, atoms } = additions(action, varying);
        for (atom, bound) in atoms {
            for (position, argument) in atom.arguments.iter().enumerate() {
                let is_asked = |of: &Term| are_equal(of, argument) && !is_bound(argument, &bound);
                let required = classes.iter().filter(|(_, of)| is_asked(of)).map(|(class, _)| class.clone());
                let required: BTreeSet<Name> = required.collect();
                let key = (atom.predicate.name.clone(), position);
                guards
                    .entry(key)
                    .and_modify(|common| common.retain(|class| required.contains(class)))
                    .or_insert(required);
            }
        }
    }
    let each = guards.into_iter().filter(|((predicate, _), _)| !timed.contains(predicate));
    each.flat_map(|((predicate, position), classes)| {
        classes.into_iter().map(move |class| (predicate.clone(), position, class))
    })
    .collect()
}

pub(super) struct Additions<'a> {
    /// Required classes, each with the term that has to be a member.
    pub classes: Vec<(Name, &'a Term)>,
    /// Added atoms, each with the variables that are bound by quantifiers within the effect.
    pub atoms: Vec<(&'a Atom, Vec<&'a Name>)>,
}

/// Returns the atoms that an action may add, and the classes that it requires. Unary predicates count as classes unless
/// they are in `varying`.
pub(super) fn additions<'a>(action: &'a Action, varying: &BTreeSet<Name>) -> Additions<'a> {
    let (conditions, effects): (Vec<&Condition>, Vec<&Effect>) = match &action.body {
        ActionBody::Instantaneous { precondition, effect } => (vec![precondition], vec![effect]),
        // A condition at the start need not hold when the action adds the fact, but classes never
        // change.
        ActionBody::Durative { conditions, effects, .. } => (
            conditions.iter().map(|(_, part)| part).collect(),
            effects.iter().map(|(_, part)| part).collect(),
        ),
    };
    let mut atoms = Vec::new();
    for effect in effects {
        added(effect, &[], &mut atoms);
    }
    Additions { classes: classes(&conditions, varying), atoms }
}

/// Returns the unary atoms that the conditions require, as pairs of predicate and argument. Omits
/// `varying` predicates, whose members differ between states.
fn classes<'c>(conditions: &[&'c Condition], varying: &BTreeSet<Name>) -> Vec<(Name, &'c Term)> {
    let (mut parts, mut found_classes) = (conditions.to_vec(), Vec::new());
    while let Some(part) = parts.pop() {
        match part {
            Condition::And(conjuncts) => parts.extend(conjuncts),
            Condition::Atom(atom) if !varying.contains(&atom.predicate.name) => {
                if let [argument] = &atom.arguments[..] {
                    found_classes.push((atom.predicate.name.clone(), argument));
                }
            }
            _ => {}
        }
    }
    found_classes
}

fn added<'e>(effect: &'e Effect, bound: &[&'e Name], atoms: &mut Vec<(&'e Atom, Vec<&'e Name>)>) {
    match effect {
        Effect::And(parts) => {
            for part in parts {
                added(part, bound, atoms);
            }
        }
        Effect::Add(atom) => atoms.push((atom, bound.to_vec())),
        Effect::ForAll(variables, inner) => {
            let quantified = variables.iter().map(|variable| &variable.identifier.name);
            added(inner, &bound.iter().copied().chain(quantified).collect::<Vec<_>>(), atoms);
        }
        // The condition of the effect only restricts the added facts, so ignoring it is safe.
        Effect::When(_, inner) => added(inner, bound, atoms),
        Effect::Delete(_) | Effect::Assign(..) => {}
    }
}

pub(super) fn are_equal(left: &Term, right: &Term) -> bool {
    match (left, right) {
        (Term::Variable(left), Term::Variable(right)) | (Term::Constant(left), Term::Constant(right)) => {
            left.name == right.name
        }
        _ => false,
    }
}

fn is_bound(term: &Term, bound: &[&Name]) -> bool {
    matches!(term, Term::Variable(variable) if bound.contains(&&variable.name))
}

/// Clauses of the settled predicates, and clauses of the open predicates (`None` if an axiom is not a clause,
/// or if the predicate may have a large extension).
pub(super) type Parted = (BTreeMap<Name, Vec<Clause>>, BTreeMap<Name, Option<Vec<Clause>>>);

pub(super) fn settle(
    mut clauses_by_head: BTreeMap<Name, Option<Vec<Clause>>>,
    changed: &BTreeSet<Name>,
    guards: &Guards,
) -> Parted {
    loop {
        let open = open(&clauses_by_head, changed);
        let candidates = clauses_by_head.keys().filter(|head| open.contains(*head));
        let resolved = candidates.into_iter().find_map(|head| {
            let clauses =
                Unfold { clauses_by_head: &clauses_by_head, open: &open, guards, head }.clauses()?;
            Some((head.clone(), clauses))
        });
        let Some((head, clauses)) = resolved else {
            let (open, settled): (BTreeMap<_, _>, BTreeMap<_, _>) =
                clauses_by_head.into_iter().partition(|(head, _)| open.contains(head));
            let settled = settled.into_iter().filter_map(|(head, clauses)| Some((head, clauses?)));
            return (settled.collect(), open);
        };
        // A newly settled predicate may make further predicates settled, so the loop starts again.
        clauses_by_head.insert(head, Some(clauses));
    }
}

fn open(clauses_by_head: &BTreeMap<Name, Option<Vec<Clause>>>, changed: &BTreeSet<Name>) -> BTreeSet<Name> {
    let mut open = changed.clone();
    loop {
        let depends_on_open =
            |clauses: &Vec<Clause>| clauses.iter().any(|clause| first_open(clause, &open).is_some());
        let newly_open: Vec<Name> = clauses_by_head
            .iter()
            .filter(|(head, clauses)| !open.contains(*head) && clauses.as_ref().is_none_or(depends_on_open))
            .map(|(head, _)| head.clone())
            .collect();
        if newly_open.is_empty() {
            return open;
        }
        open.extend(newly_open);
    }
}

fn first_open(clause: &Clause, open: &BTreeSet<Name>) -> Option<usize> {
    clause.body.iter().position(|part| matches!(part, Literal::Holds(name, _) if open.contains(name)))
}

struct Unfold<'a> {
    clauses_by_head: &'a BTreeMap<Name, Option<Vec<Clause>>>,
    open: &'a BTreeSet<Name>,
    guards: &'a Guards,
    head: &'a Name,
}

impl Unfold<'_> {
    /// Returns equivalent clauses of the predicate without open atoms, or `None` if open atoms
    /// remain or a limit is exceeded.
    fn clauses(&self) -> Option<Vec<Clause>> {
        let mut agenda: Vec<(Clause, usize)> =
            self.clauses_by_head[self.head].as_ref()?.iter().map(|clause| (clause.clone(), 0)).collect();
        let (mut done, mut count) = (BTreeSet::new(), 0);
        while let Some((clause, depth)) = agenda.pop() {
            count += 1;
            // Unfolding may grow exponentially; an unsettled predicate is merely less efficient.
            if count > MAX_CLAUSES {
                return None;
            }
            if self.says_nothing(&clause) {
                continue;
            }
            let Some(at) = first_open(&clause, self.open) else {
                // A set removes the duplicates that different unfoldings produce.
                done.insert(clause);
                continue;
            };
            let Literal::Holds(name, _) = &clause.body[at] else { return None };
            // Recursive clauses cannot be unfolded completely.
            if depth >= MAX_DEPTH || name == self.head {
                return None;
            }
            // Predicates that actions change have no clauses, and not all axioms of a domain are
            // clauses.
            let by = self.clauses_by_head.get(name)?.as_ref()?;
            agenda.extend(by.iter().filter_map(|by| Some((clause.unfolded(at, by, depth + 1)?, depth + 1))));
        }
        Some(done.into_iter().collect())
    }

    /// Returns `true` if the clause is redundant: its body contains its head, or an atom whose guard already implies
    /// the head.
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

    fn holds_of_all(&self, class: &Name) -> bool {
        let is_inclusion = |clause: &Clause| match (&clause.body[..], &clause.arguments[..]) {
            ([Literal::Holds(name, operands)], [Operand::Variable(_)]) => {
                name == class && *operands == clause.arguments
            }
            _ => false,
        };
        self.clauses_by_head[self.head].iter().flatten().any(is_inclusion)
    }
}

/// Returns `true` if the fact complies with the guard, which restricts an argument of a predicate to a class: the fact
/// has another predicate or fewer arguments, or `stated` contains the fact that its argument is in the class.
pub(super) fn keeps(
    (predicate, arguments): &Fact,
    (guarded, position, class): &(Name, usize, Name),
    stated: &BTreeSet<Fact>,
) -> bool {
    let has = |of: &Name| stated.contains(&(class.clone(), vec![of.clone()]));
    predicate != guarded || arguments.get(*position).is_none_or(has)
}
