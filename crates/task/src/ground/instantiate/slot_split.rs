//! Splits action schemas into the parts that mention slots and the parts that do not.

use crate::ground::vocabulary::atom::{Binding, Row};
use crate::lifted::configuration::{
    SlotParameter, conjuncts, expression_terms, formula_terms, slots_of_expression, slots_of_formula,
};
use crate::lifted::{Change, Effect, Expression, Formula, Lifted, Schema, Term};
use crate::task::quantity::SlotSet;

pub(super) struct SplitSchema<'a> {
    pub(super) schema: &'a Schema,
    pub(super) designs: &'a [SlotParameter],
    /// The design parameters that are slots.
    pub(super) parameters: &'a [SlotParameter],
    /// Key parameters, in ascending order: those in the duration, in the functions of the slots, and in conditions
    /// and operands of effects that mention slots. Instances with equal objects for these parameters share data.
    key: Vec<u32>,
    pub(super) start: Conjuncts<'a>,
    pub(super) over_all: Conjuncts<'a>,
    pub(super) at_end: Conjuncts<'a>,
}

pub(super) struct Conjuncts<'a> {
    /// Conjuncts that mention no slot, except literals that relaxed reachability has already decided.
    pub(super) closed: Vec<&'a Formula>,
    pub(super) open: Vec<(&'a Formula, SlotSet)>,
}

impl<'a> Conjuncts<'a> {
    fn new(lifted: &Lifted, condition: &'a Formula, slots: &[SlotParameter]) -> Self {
        let mut conjuncts_by_kind = Self { closed: Vec::new(), open: Vec::new() };
        for conjunct in conjuncts(condition) {
            let mentioned = slots_of_formula(conjunct, slots);
            if !mentioned.is_empty() {
                conjuncts_by_kind.open.push((conjunct, mentioned));
            } else if !settled(lifted, conjunct) {
                // Static literals hold in all reached instances, so they are dropped.
                conjuncts_by_kind.closed.push(conjunct);
            }
        }
        conjuncts_by_kind
    }
}

fn settled(lifted: &Lifted, conjunct: &Formula) -> bool {
    match conjunct {
        Formula::Literal { predicate, .. } => {
            let predicate = &lifted.predicates[predicate.index()];
            !predicate.fluent && !predicate.derived
        }
        _ => false,
    }
}

impl<'a> SplitSchema<'a> {
    pub(super) fn new(
        lifted: &Lifted,
        schema: &'a Schema,
        designs: &'a [SlotParameter],
        parameters: &'a [SlotParameter],
    ) -> Self {
        let start = Conjuncts::new(lifted, &schema.start_condition, parameters);
        let over_all = Conjuncts::new(lifted, &schema.over_all, parameters);
        let at_end = Conjuncts::new(lifted, &schema.at_end, parameters);
        let mut key = Vec::new();
        let mut note = |term: Term| {
            if let Term::Parameter(parameter) = term
                && (parameter as usize) < schema.parameters.len()
                && parameters.iter().all(|slot| slot.parameter != parameter)
            {
                key.push(parameter);
            }
        };
        for slot in parameters {
            note(slot.function);
        }
        for (conjunct, _) in start.open.iter().chain(&over_all.open).chain(&at_end.open) {
            formula_terms(conjunct, &mut note);
        }
        let effects = schema.start_effects.iter().chain(&schema.end_effects);
        for expression in
            effects.filter_map(|effect| open_operand(effect, parameters)).chain(&schema.duration)
        {
            expression_terms(expression, &mut note);
        }
        key.sort_unstable();
        key.dedup();
        Self { schema, designs, parameters, key, start, over_all, at_end }
    }

    pub(super) fn key(&self, binding: &Binding) -> Row {
        self.key.iter().filter_map(|parameter| binding[*parameter as usize]).collect()
    }

    /// Returns the conditions and expressions that mention the slot at `position` and no other slot. The
    /// expressions are the duration and the operands of unconditional effects.
    pub(super) fn about(&self, position: u32) -> (Vec<&'a Formula>, Vec<&'a Expression>) {
        let only = SlotSet::from_slice(&[position]);
        let open = self.start.open.iter().chain(&self.over_all.open).chain(&self.at_end.open);
        let conditions = open.filter(|(_, mentioned)| *mentioned == only).map(|(conjunct, _)| *conjunct);
        let effects = self.schema.start_effects.iter().chain(&self.schema.end_effects);
        let unconditional = effects.filter(|effect| conjuncts(&effect.condition).is_empty());
        let expressions = unconditional.filter_map(|effect| open_operand(effect, self.parameters));
        let expressions = expressions.chain(&self.schema.duration);
        let expressions = expressions.filter(|e| slots_of_expression(e, self.parameters) == only);
        (conditions.collect(), expressions.collect())
    }
}

pub(super) fn open_operand<'a>(effect: &'a Effect, parameters: &[SlotParameter]) -> Option<&'a Expression> {
    match &effect.change {
        Change::Assign { expression, .. }
            if effect.bound.is_empty() && !slots_of_expression(expression, parameters).is_empty() =>
        {
            Some(expression)
        }
        _ => None,
    }
}
