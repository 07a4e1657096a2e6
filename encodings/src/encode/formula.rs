//! Formula under construction: its clauses with their families, and the meanings of its variables. Also
//! auxiliary constraints: conjunction, disjunction, and at-most-one.

use std::fmt;

use task::number::{Int, dense};

use crate::sat::Lit;

/// Family of a clause, i.e. the purpose for which it is added. The file that adds a family
/// documents its clauses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// Clauses by which each state variable has exactly one value at each step.
    Domain,
    /// Clauses for the sequence of operators: at most one per step in sequential semantics, and
    /// none after an idle step.
    Sequence,
    /// Clauses by which operators at the same step do not interfere.
    Interference,
    /// Clauses by which an executed operator requires its conditions.
    Condition,
    /// Clauses by which an executed operator has its effects.
    Effect,
    /// Clauses by which conditional effects take place if their conditions hold.
    Conditional,
    /// Frame axioms: a value changes only if an operator sets another value.
    Frame,
    /// Clauses by which the derived variables are the least fixpoint of their rules.
    Axiom,
    /// Clauses by which each function in use has exactly one suitable design, in no forbidden combination.
    Selection,
    /// Symmetry breaking: of interchangeable designs of a slot only the first is used, and interchangeable
    /// objects are first used in a fixed order.
    Symmetry,
    /// Clauses for exact integer arithmetic on numeric variables.
    Numeric,
    /// Clauses that sum the cost of the plan, and exclude costs above the limit of the encoding.
    Cost,
    /// Clauses by which the last state satisfies the goal.
    Goal,
    /// Clauses for a cost limit that is lowered later, usually below the cost of the incumbent, or that no plan
    /// can meet. Also the clauses of core-guided search.
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
    /// The slot (a parameter for a function design) is filled with the design at the step.
    Design { slot: u32, design: u32, step: u32 },
    /// An operator of the group is executed at the step.
    Group { group: u32, step: u32 },
    /// The accumulated reduced cost (cost beyond the lower bound) is at least `amount`, after the cost source with
    /// number `stage` of the step before `step`. The condition implies the literal; the converse is not encoded.
    CostAtLeast { amount: Int, step: u32, stage: u32 },
    /// The cost source with number `stage` adds this amount at the step; with `CostEncoding::Apart`, at least this
    /// amount. The choices that cause exactly this amount imply the literal; the converse is not encoded.
    Increment { amount: Int, step: u32, stage: u32 },
    /// The conditional effect with this index of the operator takes place at the step.
    Fires { operator: u32, effect: u32, step: u32 },
    /// The body of the rule with this index in a layer of derived variables holds before the step.
    Body { layer: u32, rule: u32, step: u32 },
    /// The derived variable is derived after round `rounds` of its layer. Rounds are counted from 1.
    Later { variable: u32, rounds: u32, step: u32 },
    /// A bit of a number, or of an intermediate result.
    Bit { bit: u32 },
    /// Selector of clauses that hold while it is assumed: they exclude known plans, or require a difference from
    /// a known plan.
    Others,
    /// At least a certain number of the literals of a core, or of a part of the core, are true (variable of a
    /// totalizer of the core-guided search).
    Paid,
    /// Auxiliary variable without a meaning in the task, for example of an at-most-one constraint.
    Ladder,
}

/// A formula in conjunctive normal form.
#[derive(Default)]
pub struct Formula {
    meanings: Vec<VariableMeaning>,
    literals: Vec<Lit>,
    /// For each clause: its end in `literals`, and its family.
    clauses: Vec<(u32, Family)>,
    /// For each literal: the number, from 1, of the last clause to which it was added. 0 if it was added to no
    /// clause, or if that clause was dropped.
    last: Vec<u32>,
}

impl Formula {
    pub(crate) fn new() -> Self {
        let mut formula = Self::default();
        let truth = formula.fresh(VariableMeaning::True);
        formula.literals.push(truth);
        formula.clauses.push((1, Family::Domain));
        formula
    }

    pub(crate) const fn truth() -> Lit {
        Lit::TRUE
    }

    pub fn fresh(&mut self, meaning: VariableMeaning) -> Lit {
        let literal = Lit::positive(dense(self.meanings.len()));
        self.meanings.push(meaning);
        self.last.extend([0, 0]);
        literal
    }

    /// Adds a clause. The clause is dropped if it contains the constant true or complementary
    /// literals. The constant false and duplicate literals are omitted from it.
    #[expect(clippy::arithmetic_side_effects, reason = "clauses are held in memory")]
    pub fn add(&mut self, family: Family, clause: impl IntoIterator<Item = Lit>) {
        let start = self.literals.len();
        // Marks in `last` carry the number of the clause, so they need no reset between clauses.
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

    fn forget(&mut self, start: usize) {
        for literal in self.literals.drain(start..) {
            self.last[literal.index()] = 0;
        }
    }

    /// Returns a literal that is implied by each of the given literals; the converse is not
    /// encoded. Returns the given literal itself if there is only one, and the constant false for
    /// an empty list.
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

    /// Returns a literal that is equivalent to the conjunction of the premises. Premises that are the constant true are
    /// ignored. If no other premise remains, returns the constant true; if one remains, returns this premise.
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

    /// Adds an at-most-one constraint: pairwise clauses for up to five literals, otherwise Sinz's
    /// sequential counter \[1\].
    ///
    /// \[1\] C. Sinz: Towards an optimal CNF encoding of Boolean cardinality constraints, CP 2005.
    #[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
    pub(crate) fn at_most_one(&mut self, family: Family, literals: &[Lit]) {
        // For few literals, pairwise clauses are fewer than the clauses of the counter and need no
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

    /// Returns all clauses with their families, in the order of insertion.
    pub fn clauses(&self) -> impl Iterator<Item = (Family, &[Lit])> {
        self.clauses_from(0)
    }

    /// Returns the clauses from index `start` on, with their families.
    #[expect(clippy::arithmetic_side_effects, reason = "the first clause is told apart")]
    pub fn clauses_from(&self, start: usize) -> impl Iterator<Item = (Family, &[Lit])> {
        (start..self.clauses.len()).map(|index| {
            let start = if index == 0 { 0 } else { self.clauses[index - 1].0 as usize };
            let (end, family) = self.clauses[index];
            (family, &self.literals[start..end as usize])
        })
    }

    /// Returns the number of clauses of each family, by the name of the family.
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
