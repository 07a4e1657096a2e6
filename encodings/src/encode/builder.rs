//! Formula under construction, to which the families of clauses are added.
//!
//! A group g of operators has one variable `g@t` per step t, which is true if one of the group's
//! members o is executed at the step (`o@t`): `o@t → g@t` for each member, and `g@t → ⋁ o@t`. With
//! groups, clauses about designs, costs and consumption do not have to be repeated for each operator.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;
use task::context::Context;
use task::limits::{Interrupted, Limits};
use task::number::dense;
use task::task::{Operator, OperatorId, Task};

use crate::encode::formula::{Family, Formula, VariableMeaning};
use crate::encode::variables::Variables;
use crate::sat::Lit;

pub(super) struct Builder<'a> {
    pub(super) task: &'a Task,
    pub(super) limits: &'a Limits,
    pub(super) formula: Formula,
    pub(super) variables: Variables,
    most: usize,
    groups: FxHashMap<(usize, Vec<OperatorId>), Lit>,
}

impl<'a> Builder<'a> {
    /// Creates a formula with the variables of the task. Its only clause is the constant true.
    /// `allowed[step][operator]` is `true` if the operator may occur at the step.
    pub(super) fn new(
        context: Context<'a>,
        allowed: &[Vec<bool>],
        max_clauses: usize,
    ) -> Result<Self, Interrupted> {
        let Context { task, limits } = context;
        let mut formula = Formula::new();
        let variables = Variables::declare(context, &mut formula, allowed)?;
        Ok(Self { task, limits, formula, variables, most: max_clauses, groups: FxHashMap::default() })
    }

    pub(super) fn check(&self) -> Result<(), Interrupted> {
        if self.formula.clause_count() > self.most { Err(Interrupted) } else { self.limits.check() }
    }

    /// Returns a literal that is true if an operator in `members` is executed at the step. If the group is new, its
    /// defining clauses are added to `family`. Members that are impossible at the step are ignored. The remaining
    /// members need a new variable only if there are at least two, but not all possible operators of the step.
    pub(super) fn group(&mut self, step: usize, members: &[OperatorId], family: Family) -> Lit {
        let present: Vec<_> = {
            let candidates = &self.variables.operators[step];
            let find = |id: &OperatorId| candidates.binary_search_by_key(id, |(id, _)| *id).ok();
            members.iter().filter_map(|id| find(id).map(|index| candidates[index])).collect()
        };
        match present[..] {
            [] => return !Formula::truth(),
            [(_, only)] => return only,
            _ if present.len() == self.variables.operators[step].len() => return self.variables.busy[step],
            _ => {}
        }
        let key = (step, present.iter().map(|(id, _)| *id).collect::<Vec<_>>());
        if let Some(group) = self.groups.get(&key) {
            return *group;
        }
        let group =
            self.formula.fresh(VariableMeaning::Group { group: dense(self.groups.len()), step: dense(step) });
        for (_, literal) in &present {
            self.formula.add(family, [!*literal, group]);
        }
        self.formula.add(family, present.iter().map(|(_, literal)| *literal).chain([!group]));
        self.groups.insert(key, group);
        group
    }

    /// Groups the operators at a step by the values that `property` returns. An operator with
    /// several values is in several groups.
    pub(super) fn partition<K: Ord>(
        &self,
        step: usize,
        property: impl Fn(&'a Operator) -> Vec<K>,
    ) -> BTreeMap<K, Vec<OperatorId>> {
        let mut parts: BTreeMap<K, Vec<OperatorId>> = BTreeMap::new();
        for (id, _) in &self.variables.operators[step] {
            for key in property(&self.task.operators[id.index()]) {
                parts.entry(key).or_default().push(*id);
            }
        }
        parts
    }
}
