//! Bindings of recorded derivations: one vector of slots per compiled rule, with slots reused after
//! deletion.

use std::sync::Arc;

use crate::network::Network;
use crate::store::Record;
use crate::symbol::Symbol;

#[derive(Clone, Default, Debug)]
pub(crate) struct Records {
    rules: Vec<Arc<Slots>>,
}

#[derive(Clone, Default, Debug)]
struct Slots {
    width: usize,
    bindings: Vec<Symbol>,
    free: Vec<u32>,
}

impl Records {
    pub fn new(network: &Network) -> Self {
        let slots = |&width: &usize| Arc::new(Slots { width, ..Slots::default() });
        Self { rules: network.widths.iter().map(slots).collect() }
    }

    /// Adapts the table to the rules of a revised network. Drops the bindings of removed rules, and of rules
    /// whose number of variables has changed.
    pub fn revise(&mut self, network: &Network, is_removed: impl Fn(u32) -> bool) {
        let previous = std::mem::take(self);
        *self = Self::new(network);
        for (number, (slots, previous_slots)) in self.rules.iter_mut().zip(previous.rules).enumerate() {
            if !is_removed(number as u32) && slots.width == previous_slots.width {
                *slots = previous_slots;
            }
        }
    }

    pub fn add(&mut self, rule: u32, bindings: &[Symbol]) -> Record {
        let slots = Arc::make_mut(&mut self.rules[rule as usize]);
        // Slots have a fixed width, so a freed slot fits any later match of the rule.
        let slot = if let Some(slot) = slots.free.pop() {
            let start = slot as usize * slots.width;
            slots.bindings[start..start + slots.width].copy_from_slice(bindings);
            slot
        } else {
            slots.bindings.extend_from_slice(bindings);
            (slots.bindings.len() / slots.width) as u32 - 1
        };
        Record { rule, slot }
    }

    pub fn remove(&mut self, record: Record) {
        if record != Record::NONE {
            Arc::make_mut(&mut self.rules[record.rule as usize]).free.push(record.slot);
        }
    }

    pub fn get(&self, record: Record) -> &[Symbol] {
        // `Record::NONE` has a rule number beyond the table.
        self.rules.get(record.rule as usize).map_or(&[], |slots| {
            let start = record.slot as usize * slots.width;
            &slots.bindings[start..start + slots.width]
        })
    }
}
