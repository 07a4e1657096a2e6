//! Evaluates conditions and expressions of the PDDL files for an action instance. The results are
//! simplified by static facts and by the witness, i.e. the over-approximation of the reachable
//! states.

use std::collections::BTreeMap;

use num_rational::BigRational;
use num_traits::{One, Zero};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::faithful::axioms::Axioms;
use crate::faithful::formula::{DEPTH_LIMIT, Formula};
use crate::faithful::invariant::Invariant;
use crate::faithful::key::Key;
use crate::faithful::length::Length;
use crate::faithful::linear::Linear;
use crate::faithful::verdict::Cause;
use crate::faithful::world::World;
use pddl::ast::{Arithmetic, Atom, Comparison, Condition, Expression, Name, Term, TypedName};

const SIZE_LIMIT: usize = 200_000;
/// Upper limit on the number of parts that one reader evaluates, counting repeated evaluations (see
/// [`Reader::unfold`]).
const WORK_LIMIT: usize = 16 * SIZE_LIMIT;
const VARIABLE_LIMIT: usize = 10_000;
/// Maximum nesting depth at which derived atoms are replaced by their rules recursively. It counts all
/// conditions (`and`, `or`, `not`, quantifiers) from the outermost derived atom on, and so bounds the call
/// stack. Deeper atoms are evaluated separately, with an explicit stack (see [`Reader::unfold`]).
const UNFOLDING_LIMIT: usize = 100;

/// Key of the fluent `total-time`, which only metrics contain.
pub(super) const TOTAL_TIME: Key = (u32::MAX, SmallVec::new_const());

/// Changes since the state before the action, by start effects and events: new truth values of
/// atoms, and new values of fluents.
#[derive(Debug, Clone, Default)]
pub(super) struct Applied {
    pub(super) truths: BTreeMap<Key, bool>,
    pub(super) changes: BTreeMap<Key, Linear>,
}

/// The bound variables of a quantifier: the remaining candidates of each variable, and the object
/// of the outer variable that it shadows.
type Levels = Vec<(std::vec::IntoIter<u32>, Option<u32>)>;

pub(super) struct Reader<'r> {
    pub(super) world: &'r World<'r>,
    pub(super) invariant: &'r Invariant,
    pub(super) axioms: &'r Axioms,
    pub(super) binding: FxHashMap<&'r Name, u32>,
    pub(super) applied: Applied,
    pub(super) length: Option<Length>,
    pub(super) is_metric: bool,
    /// Whether the condition of a conditional effect (`when`) is evaluated. Undefined comparisons
    /// are not supported there.
    pub(super) in_when: bool,
    /// Whether derived atoms are kept instead of being replaced by their rules.
    pub(super) opaque: bool,
    unfolding: Unfolding,
    depth: usize,
    size: usize,
    work: usize,
}

#[derive(Default)]
struct Unfolding {
    /// The derived atoms whose rules are being evaluated, outermost first.
    path: Vec<Key>,
    base: usize,
    /// An atom nested deeper than [`UNFOLDING_LIMIT`]. Its condition is computed separately, before
    /// the evaluation that found the atom is repeated.
    pending: Option<Key>,
    known: FxHashMap<Key, Formula>,
}

impl<'r> Reader<'r> {
    pub(super) fn new(world: &'r World<'r>, invariant: &'r Invariant, axioms: &'r Axioms) -> Self {
        Self {
            world,
            invariant,
            axioms,
            binding: FxHashMap::default(),
            applied: Applied::default(),
            length: None,
            is_metric: false,
            in_when: false,
            opaque: false,
            unfolding: Unfolding::default(),
            depth: 0,
            size: 0,
            work: 0,
        }
    }

    /// Returns a condition (or its negation, if `holds` is `false`), evaluated after the start effects, as a formula
    /// over the state before the start effects. A comparison with an undefined value is false, even if negated.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "conditions nest no deeper than what is read recursively"
    )]
    pub(super) fn formula(&mut self, condition: &'r Condition, holds: bool) -> Result<Formula, Cause> {
        self.depth += 1;
        let formula = self.formula_of(condition, holds);
        self.depth -= 1;
        formula
    }

    fn formula_of(&mut self, condition: &'r Condition, holds: bool) -> Result<Formula, Cause> {
        match condition {
            Condition::And(parts) => self.junction(parts.iter().map(|part| (part, holds)), holds),
            Condition::Or(parts) => self.junction(parts.iter().map(|part| (part, holds)), !holds),
            Condition::Not(inner) => self.formula(inner, !holds),
            Condition::Imply(left, right) => {
                self.junction([(&**left, !holds), (&**right, holds)].into_iter(), !holds)
            }
            Condition::Exists(bound, inner) => self.quantified(bound, (inner, Some(inner)), holds, !holds),
            Condition::ForAll(bound, inner) => self.quantified(bound, (inner, None), holds, holds),
            Condition::Atom(atom) => {
                let key = self.world.key(atom, &self.binding)?;
                self.atom(key, holds)
            }
            Condition::Equal(left, right, _) => Ok(Formula::truth(self.equal(left, right)? == holds)),
            Condition::Compare(operator, left, right, _) => {
                let comparison = self.compare(*operator, left, right)?;
                Ok(match comparison {
                    Some(comparison) if holds => comparison,
                    Some(comparison) => comparison.negated(),
                    None => Formula::truth(false),
                })
            }
        }
    }

    pub(super) fn count(&mut self) -> Result<(), Cause> {
        self.count_parts(1)
    }

    fn count_parts(&mut self, parts: usize) -> Result<(), Cause> {
        self.size = self.size.saturating_add(parts);
        self.work = self.work.saturating_add(parts);
        if self.size <= SIZE_LIMIT && self.work <= WORK_LIMIT {
            return Ok(());
        }
        let (what, limit) = if self.size > SIZE_LIMIT {
            ("parts of the conditions of one instance", SIZE_LIMIT)
        } else {
            ("evaluated parts of the conditions of one instance", WORK_LIMIT)
        };
        Err(Cause::TooMany { what: what.into(), limit })
    }

    fn junction(
        &mut self,
        parts: impl Iterator<Item = (&'r Condition, bool)>,
        all: bool,
    ) -> Result<Formula, Cause> {
        let mut formulas = Vec::new();
        // Parts without derived atoms are evaluated first: they may decide the junction without
        // unfolding.
        let (later, sooner): (Vec<_>, Vec<_>) = parts.partition(|(part, _)| self.is_derived(part));
        for (part, holds) in sooner.into_iter().chain(later) {
            let part = self.formula(part, holds)?;
            if part.is(!all) {
                return Ok(part);
            }
            formulas.push(part);
        }
        Ok(Formula::junction(formulas, all))
    }

    fn is_derived(&self, condition: &Condition) -> bool {
        match condition {
            Condition::And(parts) | Condition::Or(parts) => parts.iter().any(|part| self.is_derived(part)),
            Condition::Not(inner) | Condition::Exists(_, inner) | Condition::ForAll(_, inner) => {
                self.is_derived(inner)
            }
            Condition::Imply(left, right) => self.is_derived(left) || self.is_derived(right),
            Condition::Atom(atom) => self.world.is_derived(atom),
            Condition::Equal(..) | Condition::Compare(..) => false,
        }
    }

    fn quantified(
        &mut self,
        bound: &'r [TypedName],
        (inner, within): (&'r Condition, Option<&'r Condition>),
        holds: bool,
        all: bool,
    ) -> Result<Formula, Cause> {
        let mut formulas = Vec::new();
        self.each(bound, within, &mut |reader| {
            let part = reader.formula(inner, holds)?;
            let decided = part.is(!all);
            formulas.push(part);
            Ok(!decided)
        })?;
        Ok(Formula::junction(formulas, all))
    }

    /// Calls `visit` for every binding of the variables `bound`, until `visit` returns `false`.
    /// Bindings under which `within` is false in every state of the witness may be skipped. Returns
    /// `false` if `visit` did, otherwise `true`.
    pub(super) fn each(
        &mut self,
        bound: &'r [TypedName],
        within: Option<&'r Condition>,
        visit: &mut dyn FnMut(&mut Self) -> Result<bool, Cause>,
    ) -> Result<bool, Cause> {
        if bound.len() > VARIABLE_LIMIT {
            let what = format!("variables of one quantifier or rule, of which one has {}", bound.len());
            return Err(Cause::TooMany { what, limit: VARIABLE_LIMIT });
        }
        let mut open = Levels::new();
        loop {
            self.count()?;
            if let Some(next) = bound.get(open.len()) {
                let objects = self.candidates(&bound[open.len()..], within).into_iter();
                open.push((objects, self.binding.get(&next.identifier.name).copied()));
            } else if !visit(self)? {
                for (own, (_, hidden)) in bound.iter().zip(&open).rev() {
                    self.rebind(&own.identifier.name, *hidden);
                }
                return Ok(false);
            }
            if !self.next_binding(bound, &mut open) {
                return Ok(true);
            }
        }
    }

    #[expect(clippy::arithmetic_side_effects, reason = "an entry for each of the first variables")]
    fn next_binding(&mut self, bound: &'r [TypedName], open: &mut Levels) -> bool {
        while !open.is_empty() {
            let last = open.len() - 1;
            let name = &bound[last].identifier.name;
            let (objects, hidden) = &mut open[last];
            if let Some(object) = objects.next() {
                self.binding.insert(name, object);
                return true;
            }
            let hidden = *hidden;
            self.rebind(name, hidden);
            open.pop();
        }
        false
    }

    fn rebind(&mut self, name: &'r Name, hidden: Option<u32>) {
        match hidden {
            Some(object) => self.binding.insert(name, object),
            None => self.binding.remove(name),
        };
    }

    pub(super) fn equal(&self, left: &Term, right: &Term) -> Result<bool, Cause> {
        Ok(self.world.object(left, &self.binding)? == self.world.object(right, &self.binding)?)
    }

    fn atom(&mut self, key: Key, holds: bool) -> Result<Formula, Cause> {
        self.count()?;
        if let Some(known) = self.applied.truths.get(&key) {
            return Ok(Formula::truth(*known == holds));
        }
        if self.world.rules(key.0).is_some() {
            return self.derived(key, holds);
        }
        Ok(atom(self.world, self.invariant, key, holds))
    }

    fn derived(&mut self, key: Key, holds: bool) -> Result<Formula, Cause> {
        if self.opaque {
            let may_hold = self.axioms.bound.contains(&key);
            return Ok(if may_hold { Formula::Atom(key, holds) } else { Formula::truth(!holds) });
        }
        if !self.is_touched(key.0) {
            if let Some(known) = self.axioms.known(&key) {
                return Ok(Formula::truth(known == holds));
            }
            if self.axioms.linked.contains(&key) {
                return Ok(Formula::Atom(key, holds));
            }
        }
        let formula = self.unfold(&key)?;
        Ok(if holds { formula } else { formula.negated() })
    }

    /// Returns `true` if a derived predicate depends on start effects or on events during the
    /// action. Facts of the witness then do not apply to it.
    pub(super) fn is_touched(&self, symbol: u32) -> bool {
        let touched = self.applied.truths.keys().chain(self.applied.changes.keys());
        self.axioms.depends(symbol, touched.map(|key| key.0))
    }

    /// Returns the condition under which a derived atom holds.
    ///
    /// Rules are unfolded recursively up to a limit on the nesting. An atom beyond the limit aborts
    /// the evaluation. The condition of this atom is computed first, and then the evaluation is
    /// repeated.
    pub(super) fn unfold(&mut self, key: &Key) -> Result<Formula, Cause> {
        if let Some(known) = self.unfolding.known.get(key).cloned() {
            self.count_parts(known.size())?;
            return Ok(known);
        }
        if self.unfolding.path.is_empty() {
            return self.unfold_from(key);
        }
        if self.unfolding.path.contains(key) {
            return Err(self.circular(key));
        }
        if self.depth.saturating_sub(self.unfolding.base) > UNFOLDING_LIMIT {
            self.unfolding.pending = Some(key.clone());
            // This error aborts the evaluation. `unfold_from` then repeats the evaluation.
            return Err(Cause::Stopped);
        }
        let outer = std::mem::take(&mut self.binding);
        let body = self.body(key)?;
        self.binding = outer;
        Ok(body)
    }

    fn unfold_from(&mut self, key: &Key) -> Result<Formula, Cause> {
        let outer = std::mem::take(&mut self.binding);
        let (base, size) = (self.depth, self.size);
        self.unfolding.base = base;
        let mut open = vec![key.clone()];
        let formula = loop {
            // An explicit stack is used because recursion would be as deep as the chain of rules.
            let Some(own) = open.last().cloned() else { break Err(Cause::Stopped) };
            (self.depth, self.size) = (base, size);
            self.unfolding.path.clear();
            match (self.body(&own), self.unfolding.pending.take()) {
                (Ok(formula), _) if open.len() == 1 => break Ok(formula),
                (Ok(formula), _) if formula.depth() > DEPTH_LIMIT => {
                    let what =
                        "levels of a condition after derived atoms are replaced by their rules".to_owned();
                    break Err(Cause::TooMany { what, limit: DEPTH_LIMIT });
                }
                (Ok(formula), _) => {
                    open.pop();
                    self.unfolding.known.insert(own, formula);
                }
                (Err(_), Some(below)) if open.contains(&below) => break Err(self.circular(&below)),
                (Err(_), Some(below)) => open.push(below),
                (Err(cause), None) => break Err(cause),
            }
        };
        self.unfolding = Unfolding::default();
        self.depth = base;
        self.binding = outer;
        formula
    }

    fn circular(&self, key: &Key) -> Cause {
        let atom = self.world.show(key);
        Cause::unsupported(if self.is_touched(key.0) {
            format!("{atom}, which depends on itself and on what changes during the same action")
        } else {
            format!("{atom}, which depends on itself and is not a variable of the task")
        })
    }

    fn body(&mut self, key: &Key) -> Result<Formula, Cause> {
        self.unfolding.path.push(key.clone());
        let mut bodies = Vec::new();
        for rule in self.world.rules(key.0).unwrap_or_default() {
            let parameters = &rule.head.parameters;
            let fits = parameters.len() == key.1.len()
                && parameters.iter().zip(&key.1).all(|(own, object)| self.world.is_of(*object, &own.r#type));
            if !fits {
                continue;
            }
            let names = parameters.iter().map(|parameter| &parameter.identifier.name);
            self.binding = names.zip(key.1.iter().copied()).collect();
            bodies.push(self.formula(&rule.condition, true)?);
        }
        self.unfolding.path.pop();
        Ok(Formula::junction(bodies, false))
    }

    /// Translates a comparison to a condition on fluents. Returns `None` if one side is undefined,
    /// and fails if this happens in the condition of a conditional effect.
    fn compare(
        &mut self,
        operator: Comparison,
        left: &'r Expression,
        right: &'r Expression,
    ) -> Result<Option<Formula>, Cause> {
        self.count()?;
        let (Some(left), Some(right)) = (self.expression(left)?, self.expression(right)?) else {
            if self.in_when {
                return Err(Cause::unsupported("a comparison without a value in `when`"));
            }
            return Ok(None);
        };
        let difference = left.minus(&right);
        let at_least = |linear: Linear, strict: bool| self.invariant.compare(&linear, strict);
        Ok(Some(match operator {
            Comparison::GreaterOrEqual => at_least(difference, false),
            Comparison::Greater => at_least(difference, true),
            Comparison::LessOrEqual => at_least(difference.negated(), false),
            Comparison::Less => at_least(difference.negated(), true),
            Comparison::Equal => {
                let opposite = difference.negated();
                Formula::junction([at_least(difference, false), at_least(opposite, false)], true)
            }
        }))
    }

    fn fluent(&mut self, atom: &Atom) -> Result<Option<Linear>, Cause> {
        let key = self.world.key(atom, &self.binding)?;
        if let Some(known) = self.applied.changes.get(&key) {
            return Ok(Some(known.clone()));
        }
        let initial = self.world.initial_value(&key);
        if !self.world.changes(key.0) {
            return Ok(initial.cloned().map(Linear::constant));
        }
        if initial.is_none() {
            return Err(Cause::unsupported(format!(
                "{}, which changes and has no value at first",
                self.world.show(&key)
            )));
        }
        Ok(Some(self.invariant.fluent(key)))
    }

    /// Returns the value of an expression after the start effects, as a linear expression over the fluents
    /// before them. Returns `None` if it is undefined. Fails for example if the value is not linear or depends
    /// on a chosen duration.
    pub(super) fn expression(&mut self, expression: &'r Expression) -> Result<Option<Linear>, Cause> {
        Ok(match expression {
            Expression::Number(number, _) => Some(Linear::constant(number.clone())),
            Expression::Fluent(atom) => self.fluent(atom)?,
            Expression::Duration(_) => match &self.length {
                None => None,
                Some(length) => {
                    let open = || Cause::unsupported("what depends on a duration that is chosen");
                    Some(Linear::constant(length.fixed().ok_or_else(open)?.clone()))
                }
            },
            Expression::TotalTime(_) if self.is_metric => Some(Linear::fluent(TOTAL_TIME)),
            Expression::TotalTime(_) => return Err(Cause::unsupported("total-time outside of the metric")),
            Expression::Operation(operation, parts, _) => {
                let mut values = Vec::new();
                for part in parts {
                    let Some(value) = self.expression(part)? else { return Ok(None) };
                    values.push(value);
                }
                combined(*operation, values)?
            }
        })
    }
}

/// Returns the condition that a basic (not derived) atom has the given truth value, simplified by
/// static facts and the witness.
pub(super) fn atom(world: &World<'_>, invariant: &Invariant, key: Key, holds: bool) -> Formula {
    if !world.changes(key.0) {
        return Formula::truth(world.holds_initially(&key) == holds);
    }
    if !invariant.may_hold(&key) {
        return Formula::truth(!holds);
    }
    Formula::Atom(key, holds)
}

fn combined(operation: Arithmetic, values: Vec<Linear>) -> Result<Option<Linear>, Cause> {
    let mut values = values.into_iter();
    let Some(mut result) = values.next() else {
        return Err(Cause::unsupported("an operation without operands"));
    };
    if operation == Arithmetic::Subtract && values.len() == 0 {
        return Ok(Some(result.negated()));
    }
    for next in values {
        result = match operation {
            Arithmetic::Add => result.plus(&next, &BigRational::one()),
            Arithmetic::Subtract => result.minus(&next),
            Arithmetic::Multiply => match (result.value().cloned(), next.value()) {
                (_, Some(factor)) => result.times(factor),
                (Some(factor), None) => next.times(&factor),
                (None, None) => return Err(Cause::unsupported("products of numeric fluents that change")),
            },
            Arithmetic::Divide => match next.value() {
                Some(divisor) if divisor.is_zero() => return Ok(None),
                Some(divisor) => result.times(&divisor.recip()),
                None => return Err(Cause::unsupported("division by numeric fluents that change")),
            },
        };
    }
    Ok(Some(result))
}
