//! Clauses under construction, with their families and the meanings of variables.

use std::fmt;

use task::number::{Int, dense};

use crate::sat::Lit;

/// Purpose of a clause. The file that writes a family documents it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// State variables have exactly one value.
    Domain,
    /// At most one operator per step, and none after the last one.
    Sequence,
    /// Operators at the same step do not interfere.
    Interference,
    /// Operators require their conditions.
    Condition,
    /// Operators have their effects.
    Effect,
    /// Conditional effects take place if their conditions hold.
    Conditional,
    /// A value changes only if an operator sets it.
    Frame,
    /// Derived variables are the least fixpoint of their rules.
    Axiom,
    /// Each function in use has exactly one suitable design.
    Selection,
    /// Interchangeable designs and objects are used in a fixed order.
    Symmetry,
    /// Exact integer arithmetic for numeric variables.
    Numeric,
    /// The accumulated cost.
    Cost,
    /// The last state satisfies the goal.
    Goal,
    /// The plan is cheaper than the incumbent.
    Bound,
}

impl Family {
    pub(crate) const ALL: [Self; 14] = [
        Self::Domain,
        Self::Sequence,
        Self::Interference,
        Self::Condition,
        Self::Effect,
        Self::Conditional,
        Self::Frame,
        Self::Axiom,
        Self::Selection,
        Self::Symmetry,
        Self::Numeric,
        Self::Cost,
        Self::Goal,
        Self::Bound,
    ];

    /// Name in statistics.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Domain => "domain",
            Self::Sequence => "sequence",
            Self::Interference => "interference",
            Self::Condition => "condition",
            Self::Effect => "effect",
            Self::Conditional => "conditional",
            Self::Frame => "frame",
            Self::Axiom => "axiom",
            Self::Selection => "selection",
            Self::Symmetry => "symmetry",
            Self::Numeric => "numeric",
            Self::Cost => "cost",
            Self::Goal => "goal",
            Self::Bound => "bound",
        }
    }
}

/// Meaning of a variable of the formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum VariableMeaning {
    /// The constant true.
    True,
    /// The operator is executed at the step.
    Operator { operator: u32, step: u32 },
    /// Some operator is executed at the step.
    Busy { step: u32 },
    /// The finite-domain variable has the value before the step.
    Value { variable: u32, value: u32, step: u32 },
    /// The slot is filled with its design at the step.
    Design { slot: u32, design: u32, step: u32 },
    /// The operator at the step is one of a group.
    Group { group: u32, step: u32 },
    /// The accumulated cost before the step, minus its lower bound, is at least the amount.
    CostAtLeast { amount: Int, step: u32, stage: u32 },
    /// The step adds at least the amount.
    Increment { amount: Int, step: u32, stage: u32 },
    /// The conditional effect with this index of the operator takes place at the step.
    Fires { operator: u32, effect: u32, step: u32 },
    /// The body of the rule with this index in a layer of derived variables holds before the step.
    Body { layer: u32, rule: u32, step: u32 },
    /// The derived variable follows in more than `rounds` rounds of its layer.
    Later { variable: u32, rounds: u32, step: u32 },
    /// A bit of a number.
    Bit { bit: u32 },
    /// Known plans are excluded.
    Others,
    /// A counted number of literals of a core is true.
    Paid,
    /// Auxiliary variable, for example of an at-most-one constraint.
    Ladder,
}

/// A formula in conjunctive normal form.
#[derive(Default)]
pub struct Formula {
    meanings: Vec<VariableMeaning>,
    literals: Vec<Lit>,
    /// End of each clause in `literals`, and its family.
    clauses: Vec<(u32, Family)>,
    /// Per literal: number (plus 1) of the last clause that contains it.
    last: Vec<u32>,
}

impl Formula {
    /// An empty formula with the constant true.
    pub(crate) fn new() -> Self {
        let mut formula = Self::default();
        let truth = formula.fresh(VariableMeaning::True);
        formula.literals.push(truth);
        formula.clauses.push((1, Family::Domain));
        formula
    }

    /// The literal that is always true.
    pub(crate) const fn truth() -> Lit {
        Lit::TRUE
    }

    pub fn fresh(&mut self, meaning: VariableMeaning) -> Lit {
        let literal = Lit::positive(dense(self.meanings.len()));
        self.meanings.push(meaning);
        self.last.extend([0, 0]);
        literal
    }

    /// Adds a clause. Clauses with a true constant or complementary literals are dropped; false
    /// constants and duplicates are omitted.
    #[expect(clippy::arithmetic_side_effects, reason = "clauses are held in memory")]
    pub fn add(&mut self, family: Family, clause: impl IntoIterator<Item = Lit>) {
        let start = self.literals.len();
        // Marks carry the number of the clause, so they need no reset between clauses.
        let number = dense(self.clauses.len() + 1);
        for literal in clause {
            if literal == Self::truth() || self.last[(!literal).index()] == number {
                self.forget(start);
                return;
            }
            if literal != !Self::truth() && self.last[literal.index()] != number {
                self.last[literal.index()] = number;
                self.literals.push(literal);
            }
        }
        self.clauses.push((dense(self.literals.len()), family));
    }

    /// Drops the literals of an incomplete clause, so that the next clause can reuse its number.
    fn forget(&mut self, start: usize) {
        for literal in self.literals.drain(start..) {
            self.last[literal.index()] = 0;
        }
    }

    /// Literal that is implied by each of the given ones (one direction only). Returns the literal
    /// itself if there is only one.
    pub(crate) fn any(&mut self, family: Family, meaning: VariableMeaning, literals: &[Lit]) -> Lit {
        match literals {
            [] => !Self::truth(),
            [only] => *only,
            _ => {
                let any = self.fresh(meaning);
                for literal in literals {
                    self.add(family, [!*literal, any]);
                }
                any
            }
        }
    }

    /// Literal that is equivalent to the conjunction of the premises.
    pub(crate) fn equivalent(&mut self, meaning: VariableMeaning, premises: &[Lit], family: Family) -> Lit {
        let premises: Vec<_> = premises.iter().copied().filter(|l| *l != Self::truth()).collect();
        match premises[..] {
            [] => Self::truth(),
            [only] => only,
            _ => {
                let literal = self.fresh(meaning);
                for premise in &premises {
                    self.add(family, [!literal, *premise]);
                }
                self.add(family, premises.iter().map(|premise| !*premise).chain([literal]));
                literal
            }
        }
    }

    /// At-most-one constraint: pairwise for up to five literals, otherwise Sinz's sequential
    /// counter \[1\].
    ///
    /// \[1\] C. Sinz: Towards an optimal CNF encoding of Boolean cardinality constraints, CP 2005.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub(crate) fn at_most_one(&mut self, family: Family, literals: &[Lit]) {
        // For few literals pairwise clauses are fewer than those of the counter and need no
        // variables.
        if literals.len() <= 5 {
            for (position, a) in literals.iter().enumerate() {
                for b in &literals[position + 1..] {
                    self.add(family, [!*a, !*b]);
                }
            }
            return;
        }
        let mut before = self.fresh(VariableMeaning::Ladder);
        self.add(family, [!literals[0], before]);
        for (position, literal) in literals.iter().enumerate().skip(1) {
            self.add(family, [!before, !*literal]);
            if position + 1 < literals.len() {
                let next = self.fresh(VariableMeaning::Ladder);
                self.add(family, [!before, next]);
                self.add(family, [!*literal, next]);
                before = next;
            }
        }
    }

    pub fn variables(&self) -> usize {
        self.meanings.len()
    }

    pub fn clause_count(&self) -> usize {
        self.clauses.len()
    }

    /// All clauses in the order of insertion.
    pub fn clauses(&self) -> impl Iterator<Item = (Family, &[Lit])> {
        self.clauses_from(0)
    }

    /// Clauses from index `start` on.
    #[expect(clippy::arithmetic_side_effects, reason = "the first clause is told apart")]
    pub fn clauses_from(&self, start: usize) -> impl Iterator<Item = (Family, &[Lit])> {
        (start..self.clauses.len()).map(|index| {
            let start = if index == 0 { 0 } else { self.clauses[index - 1].0 as usize };
            let (end, family) = self.clauses[index];
            (family, &self.literals[start..end as usize])
        })
    }

    /// Number of clauses per family.
    pub fn counts(&self) -> Vec<(&'static str, usize)> {
        let count =
            |family| self.clauses.iter().filter(|(_, clause_family)| *clause_family == family).count();
        Family::ALL.iter().map(|family| (family.name(), count(*family))).collect()
    }

    #[cfg(test)]
    pub(crate) fn meaning(&self, variable: u32) -> VariableMeaning {
        self.meanings[variable as usize]
    }
}

impl fmt::Debug for Formula {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Formula({} variables, {} clauses)", self.variables(), self.clause_count())
    }
}
