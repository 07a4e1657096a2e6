//! Detects interchangeable designs of a slot (a parameter for a function design) by hashing.
//!
//! Each design has a signature: a hash of its entries in the tables of effects, comparisons and costs, and in the
//! forbidden combinations. Tables of durations and of further objectives are ignored. Only designs with equal
//! signatures are compared. The running time is therefore about linear in the size of the tables.

use std::hash::{BuildHasher, Hash};

use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};

use task::context::Context;
use task::limits::Interrupted;
use task::number::Int;
use task::task::quantity::{Quantity, SlotSet};
use task::task::{Operator, SlotId};

/// Part of a task that may distinguish the designs of a slot, for example a cost table of an operator. It has an entry
/// for each design that this operator admits.
struct Witness<'t> {
    /// The admitted designs, as indices into the slot's designs, ascending.
    designs: &'t [u32],
    says: WitnessKind<'t>,
}

enum WitnessKind<'t> {
    /// The operator admits these designs and no others.
    Admitted,
    /// A table with rows of length `stride`. Every `designs.len()`-th row belongs to the same
    /// design.
    Table { values: &'t [Int], stride: usize },
    /// For each design: the combinations of other designs that are forbidden with it, sorted.
    Forbidden(Vec<Vec<SlotSet>>),
}

impl Witness<'_> {
    fn rows<'v>(&self, values: &'v [Int], stride: usize, position: usize) -> impl Iterator<Item = &'v [Int]> {
        values.chunks(stride).skip(position).step_by(self.designs.len())
    }

    fn signature(&self, position: usize) -> u64 {
        match &self.says {
            WitnessKind::Admitted => 1,
            WitnessKind::Table { values, stride } => {
                hash(&self.rows(values, *stride, position).collect::<Vec<_>>())
            }
            WitnessKind::Forbidden(others) => hash(&others[position]),
        }
    }

    fn tells_apart(&self, a: u32, b: u32) -> bool {
        let (a, b) = match (self.designs.binary_search(&a), self.designs.binary_search(&b)) {
            (Ok(a), Ok(b)) => (a, b),
            (a, b) => return a.is_ok() != b.is_ok(),
        };
        match &self.says {
            WitnessKind::Admitted => false,
            WitnessKind::Table { values, stride } => {
                !self.rows(values, *stride, a).eq(self.rows(values, *stride, b))
            }
            WitnessKind::Forbidden(others) => others[a] != others[b],
        }
    }
}

fn hash<T: Hash>(value: &T) -> u64 {
    FxBuildHasher.hash_one(value)
}

/// Returns the designs of a slot (as indices into its designs, ascending) that are interchangeable with an
/// earlier design of the slot.
pub(super) fn equal_designs(context: Context<'_>, slot: SlotId) -> Result<Vec<u32>, Interrupted> {
    let Context { task, limits } = context;
    let witnesses = witnesses(context, slot)?;
    let mut signatures = vec![0_u64; task.slots[slot.index()].designs.len()];
    for (witness, number) in witnesses.iter().zip(0_u64..) {
        for item in limits.watch(witness.designs.iter().enumerate()) {
            let (position, design) = item?;
            let signature = &mut signatures[*design as usize];
            *signature = hash(&(*signature, number, witness.signature(position)));
        }
    }
    let mut different: FxHashMap<u64, Vec<u32>> = FxHashMap::default();
    let mut equal = Vec::new();
    for (signature, design) in limits.watch(signatures).zip(0..) {
        let representatives = different.entry(signature?).or_default();
        let is_equal =
            |candidate: &u32| !witnesses.iter().any(|witness| witness.tells_apart(*candidate, design));
        if representatives.iter().any(is_equal) { equal.push(design) } else { representatives.push(design) }
    }
    Ok(equal)
}

/// Returns all parts of the task that may distinguish designs of a slot. A part that operators share occurs
/// once.
#[expect(clippy::arithmetic_side_effects, reason = "positions in lists that are held in memory")]
fn witnesses(context: Context<'_>, slot: SlotId) -> Result<Vec<Witness<'_>>, Interrupted> {
    let Context { task, limits } = context;
    let mut seen: FxHashSet<(*const u32, *const u8, SlotSet)> = FxHashSet::default();
    let mut witnesses = Vec::new();
    for operator in limits.watch(&task.operators) {
        let operator = operator?;
        let Some(position) = operator.slots.iter().position(|usage| usage.slot == slot) else { continue };
        let designs = &operator.slots[position].designs[..];
        // Operators share their tables, so addresses identify parts that are already listed.
        let mut is_new =
            |address: *const u8, slots: &SlotSet| seen.insert((designs.as_ptr(), address, slots.clone()));
        if is_new(std::ptr::null(), &SlotSet::new()) {
            witnesses.push(Witness { designs, says: WitnessKind::Admitted });
        }
        for table in quantities(operator).flat_map(|quantity| &quantity.tables) {
            let Some(table_position) = table.slots.iter().position(|slot| *slot as usize == position) else {
                continue;
            };
            if is_new(table.values.as_ptr().cast(), &table.slots) {
                let later = table.slots[table_position + 1..]
                    .iter()
                    .map(|slot| operator.slots[*slot as usize].designs.len());
                let says = WitnessKind::Table { values: &table.values, stride: later.product() };
                witnesses.push(Witness { designs, says });
            }
        }
        for rule in operator.forbidden.iter() {
            let Some(rule_position) = rule.slots.iter().position(|slot| *slot as usize == position) else {
                continue;
            };
            if is_new(rule.combinations.as_ptr().cast(), &rule.slots) {
                let mut partners: Vec<Vec<SlotSet>> = vec![Vec::new(); designs.len()];
                for combination in limits.watch(&rule.combinations) {
                    let mut partner = combination?.clone();
                    let design = partner.remove(rule_position);
                    partners[design as usize].push(partner);
                }
                for rests in &mut partners {
                    rests.sort_unstable();
                    rests.dedup();
                }
                witnesses.push(Witness { designs, says: WitnessKind::Forbidden(partners) });
            }
        }
    }
    Ok(witnesses)
}

fn quantities(operator: &Operator) -> impl Iterator<Item = &Quantity<Int>> {
    let effects = operator.numeric_effects.iter().map(|effect| &effect.value.quantity);
    let comparisons = operator.condition.comparisons.iter().map(|comparison| &comparison.quantity);
    effects.chain(comparisons).chain([&operator.cost])
}
