//! Conditions of an action instance, as formulas over the state before the action. Partial states: known truth
//! values and comparisons, from which a condition may follow or be refuted.

use std::collections::BTreeMap;

use num_rational::BigRational;
use num_traits::{One, Signed, Zero};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

use crate::faithful::key::Key;
use crate::faithful::linear::Linear;
use crate::faithful::verdict::Cause;

const CASE_LIMIT: usize = 4_096;

/// Upper limit on the nesting depth of a formula that replaces a derived atom; the outermost one may exceed it.
/// Functions on formulas recurse to the depth of the whole formula, at most a few hundred levels more.
pub(super) const DEPTH_LIMIT: usize = 300;

/// A condition in negation normal form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Formula {
    All(Vec<Formula>),
    Any(Vec<Formula>),
    Atom(Key, bool),
    /// The expression is at least 0, or greater than 0 if the flag (strict) is `true`.
    Compare(Linear, bool),
}

impl Formula {
    pub(super) fn truth(holds: bool) -> Self {
        if holds { Self::All(Vec::new()) } else { Self::Any(Vec::new()) }
    }

    pub(super) fn is(&self, holds: bool) -> bool {
        match self {
            Self::All(parts) => holds && parts.is_empty(),
            Self::Any(parts) => !holds && parts.is_empty(),
            _ => false,
        }
    }

    /// Creates a simplified conjunction of the parts, or a disjunction if `all` is `false`.
    pub(super) fn junction(parts: impl IntoIterator<Item = Self>, all: bool) -> Self {
        let mut simplified = Vec::new();
        for part in parts {
            match part {
                part if part.is(!all) => return part,
                Self::All(inner) if all => simplified.extend(inner),
                Self::Any(inner) if !all => simplified.extend(inner),
                part if part.is(all) => {}
                part => simplified.push(part),
            }
        }
        match simplified.len() {
            1 => simplified.swap_remove(0),
            _ if all => Self::All(simplified),
            _ => Self::Any(simplified),
        }
    }

    pub(super) fn size(&self) -> usize {
        match self {
            Self::All(parts) | Self::Any(parts) => parts.iter().map(Self::size).sum(),
            _ => 1,
        }
    }

    pub(super) fn depth(&self) -> usize {
        match self {
            Self::All(parts) | Self::Any(parts) => {
                parts.iter().map(Self::depth).max().unwrap_or(0).saturating_add(1)
            }
            _ => 0,
        }
    }

    pub(super) fn negated(&self) -> Self {
        match self {
            Self::All(parts) => Self::junction(parts.iter().map(Self::negated), false),
            Self::Any(parts) => Self::junction(parts.iter().map(Self::negated), true),
            Self::Atom(key, holds) => Self::Atom(key.clone(), !holds),
            Self::Compare(linear, strict) => Self::Compare(linear.negated(), !strict),
        }
    }
}

/// Properties of every state: the mutex groups of each atom, and for each fluent of the task a
/// factor that makes its value an integer.
#[derive(Debug, Default)]
pub(super) struct Structure {
    pub(super) groups: FxHashMap<Key, SmallVec<[u32; 1]>>,
    pub(super) integers: FxHashMap<Key, BigRational>,
}

/// A partial state: truth values of some atoms, and comparisons that hold.
#[derive(Debug, Clone, Default)]
pub(super) struct Known {
    atoms: BTreeMap<Key, bool>,
    holding: BTreeMap<u32, Key>,
    pub(super) comparisons: Vec<(Linear, bool)>,
}

impl Known {
    pub(super) fn holding(&self, group: u32) -> Option<&Key> {
        self.holding.get(&group)
    }

    pub(super) fn holding_atoms(&self) -> impl Iterator<Item = &Key> {
        self.atoms.iter().filter(|(_, holds)| **holds).map(|(key, _)| key)
    }

    pub(super) fn atom(&self, structure: &Structure, key: &Key) -> Option<bool> {
        if let Some(holds) = self.atoms.get(key) {
            return Some(*holds);
        }
        let groups = structure.groups.get(key)?;
        groups.iter().any(|group| self.holding.contains_key(group)).then_some(false)
    }

    /// Returns the truth value that the partial state implies for a condition, or `None` if neither value is found to
    /// follow. The test is incomplete: each comparison is tested against single known comparisons.
    pub(super) fn decide(&self, structure: &Structure, formula: &Formula) -> Option<bool> {
        match formula {
            Formula::All(parts) => self.junction(structure, parts, true),
            Formula::Any(parts) => self.junction(structure, parts, false),
            Formula::Atom(key, holds) => self.atom(structure, key).map(|known| known == *holds),
            Formula::Compare(linear, strict) => {
                let follows = |wanted: &Linear, strict: bool| {
                    self.comparisons.iter().any(|known| implies(structure, known, wanted, strict))
                };
                if follows(linear, *strict) {
                    Some(true)
                } else if follows(&linear.negated(), !strict) {
                    Some(false)
                } else {
                    None
                }
            }
        }
    }

    fn junction(&self, structure: &Structure, parts: &[Formula], all: bool) -> Option<bool> {
        let mut open = false;
        for part in parts {
            match self.decide(structure, part) {
                Some(holds) if holds != all => return Some(!all),
                Some(_) => {}
                None => open = true,
            }
        }
        (!open).then_some(all)
    }

    /// Returns an undecided leaf (atom or comparison) that `admits` accepts. Returns `None` if the
    /// condition is decided or has no such leaf.
    pub(super) fn open<'f>(
        &self,
        structure: &Structure,
        formula: &'f Formula,
        admits: &dyn Fn(&Formula) -> bool,
    ) -> Option<&'f Formula> {
        if self.decide(structure, formula).is_some() {
            return None;
        }
        match formula {
            Formula::All(parts) | Formula::Any(parts) => {
                parts.iter().find_map(|part| self.open(structure, part, admits))
            }
            leaf => admits(leaf).then_some(leaf),
        }
    }

    /// Extends the partial state by a condition. The resulting partial states together cover all
    /// states in which both hold. Fails if there are more than [`CASE_LIMIT`].
    pub(super) fn assume(&self, structure: &Structure, formula: &Formula) -> Result<Vec<Self>, Cause> {
        match self.decide(structure, formula) {
            Some(true) => return Ok(vec![self.clone()]),
            Some(false) => return Ok(Vec::new()),
            None => {}
        }
        let mut extended = self.clone();
        match formula {
            Formula::Atom(key, holds) => {
                extended.atoms.insert(key.clone(), *holds);
                for group in structure.groups.get(key).into_iter().flatten().filter(|_| *holds) {
                    extended.holding.insert(*group, key.clone());
                }
                Ok(vec![extended])
            }
            Formula::Compare(linear, strict) => {
                extended.comparisons.push((linear.clone(), *strict));
                Ok(vec![extended])
            }
            Formula::Any(parts) => {
                let mut cases = Vec::new();
                for part in parts {
                    cases.extend(self.assume(structure, part)?);
                    limited(cases.len())?;
                }
                Ok(cases)
            }
            Formula::All(parts) => {
                let mut cases = vec![extended];
                // Leaves are assumed first: they do not split the partial state, and they may
                // decide the remaining parts.
                let is_leaf = |part: &&Formula| matches!(part, Formula::Atom(..) | Formula::Compare(..));
                let (leaves, others): (Vec<_>, Vec<_>) = parts.iter().partition(is_leaf);
                for part in leaves.into_iter().chain(others) {
                    let mut longer = Vec::new();
                    for known in &cases {
                        longer.extend(known.assume(structure, part)?);
                        limited(longer.len())?;
                    }
                    cases = longer;
                }
                Ok(cases)
            }
        }
    }

    /// Splits the partial state into partial states that decide each of the formulas. Fails if
    /// there are more than [`CASE_LIMIT`].
    pub(super) fn split<'f>(
        self,
        structure: &Structure,
        formulas: impl Iterator<Item = &'f Formula>,
    ) -> Result<Vec<Self>, Cause> {
        let mut cases = vec![self];
        for formula in formulas {
            let mut longer = Vec::new();
            for known in cases {
                if known.decide(structure, formula).is_some() {
                    longer.push(known);
                } else {
                    longer.extend(known.assume(structure, formula)?);
                    longer.extend(known.assume(structure, &formula.negated())?);
                }
                limited(longer.len())?;
            }
            cases = longer;
        }
        Ok(cases)
    }
}

fn limited(cases: usize) -> Result<(), Cause> {
    if cases <= CASE_LIMIT {
        return Ok(());
    }
    Err(Cause::TooMany { what: "cases of one instance of an action".into(), limit: CASE_LIMIT })
}

/// Returns `true` if the comparison `known` implies that `wanted` is at least 0, or greater than 0
/// if `strict`. Returns `false` if the two expressions are not proportional apart from their
/// constants.
fn implies(structure: &Structure, known: &(Linear, bool), wanted: &Linear, strict: bool) -> bool {
    let Some(ratio) = wanted.ratio_to(&known.0).filter(Signed::is_positive) else { return false };
    // Lower bound on `wanted` without its constant term, as it follows from `known`.
    let mut least = -(&known.0.constant * ratio);
    let mut is_strict = known.1;
    if let Some(unit) = unit(structure, wanted) {
        // Without its constant, `wanted` is a multiple of the unit, so the bound can be rounded up.
        let multiple = &least / &unit;
        let rounded = if is_strict { multiple.floor() + BigRational::one() } else { multiple.ceil() };
        (least, is_strict) = (rounded * unit, false);
    }
    let least = least + &wanted.constant;
    least.is_positive() || least.is_zero() && (is_strict || !strict)
}

/// Returns a common divisor of all values that an expression without its constant term has in any state.
/// Returns `None` if there is no fluent, or if a fluent has no known factor that makes it an integer.
fn unit(structure: &Structure, linear: &Linear) -> Option<BigRational> {
    let mut unit: Option<BigRational> = None;
    for (key, factor) in &linear.factors {
        // In every state, the fluent is a multiple of 1 divided by the factor that makes it an integer.
        let step = (factor / structure.integers.get(key)?).abs();
        unit = Some(match unit {
            None => step,
            Some(unit) => common(&unit, &step),
        });
    }
    unit
}

fn common(left: &BigRational, right: &BigRational) -> BigRational {
    let (mut left, mut right) = (left.clone(), right.clone());
    while !right.is_zero() {
        let remainder = &left - (&left / &right).floor() * &right;
        (left, right) = (right, remainder);
    }
    left
}
