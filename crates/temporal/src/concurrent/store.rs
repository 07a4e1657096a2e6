//! Packed temporal states of the exact search.
//!
//! Finite-domain values take as many bits as they need, and times as many bytes. States that can dominate each
//! other share a *place*: the state, the running actions, and the numbers that are not comparable.

use std::hash::{Hash, Hasher};

use hashbrown::HashTable;
use rustc_hash::FxHasher;
use task::number::{Int, dense, words};
use task::task::{OperatorId, State};

use crate::concurrent::simple_temporal_network::SimpleTemporalNetwork;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_task::TemporalTask;

/// Where a finite-domain variable lies among the words of a key.
struct Field {
    word: usize,
    shift: u32,
    mask: u32,
}

/// A step of the search.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    pub(super) parent: u32,
    pub(super) operator: OperatorId,
    /// Whether the action has ended as well.
    pub(super) compressed: bool,
    /// Whether this takes place at the time of what was before.
    pub(super) together: bool,
    /// How many happenings lead here.
    pub(super) depth: u32,
}

struct Node {
    place: u32,
    origin: Option<Origin>,
    cost: Int,
    /// The least time at which everything has happened.
    latest: Int,
    numbers: Box<[Int]>,
    clocks: Box<[u8]>,
    is_dominated: bool,
}

struct Place {
    key: Box<[u32]>,
    /// The nodes that none dominates.
    front: Vec<u32>,
}

/// How situations are packed.
pub(super) struct Packing<'a> {
    concurrent: &'a TemporalTask,
    fields: Vec<Field>,
    width: usize,
}

/// A packed situation.
pub(super) struct PackedNode {
    values: Box<[u32]>,
    numbers: Box<[Int]>,
    clocks: Box<[u8]>,
    cost: Int,
}

impl PackedNode {
    /// About how many bytes it takes besides itself.
    pub(super) fn bytes(&self) -> usize {
        let values = size_of_val(&*self.values).saturating_add(size_of_val(&*self.numbers));
        values.saturating_add(self.clocks.len())
    }
}

/// Packed situations.
pub(super) struct Store<'a> {
    concurrent: &'a TemporalTask,
    packing: Packing<'a>,
    /// Whether more of a number is never worse.
    monotone: bool,
    places: Vec<Place>,
    table: HashTable<u32>,
    nodes: Vec<Node>,
    bytes: usize,
    /// How many pairs of situations were compared.
    pub(super) compared: usize,
}

fn hash_of(key: &[u32]) -> u64 {
    let mut hasher = FxHasher::default();
    key.hash(&mut hasher);
    hasher.finish()
}

#[expect(clippy::arithmetic_side_effects, reason = "the bits of values that are held in memory")]
impl<'a> Packing<'a> {
    pub(super) fn new(concurrent: &'a TemporalTask) -> Self {
        let (mut word, mut used) = (0, 0);
        let mut fields = Vec::new();
        for variable in &concurrent.task.variables[..concurrent.task.basic] {
            let last = dense(variable.values.len().max(1)) - 1;
            let bits = u32::BITS - last.leading_zeros();
            if used + bits > u32::BITS {
                (word, used) = (word + 1, 0);
            }
            let mask = if bits == u32::BITS { u32::MAX } else { (1 << bits) - 1 };
            fields.push(Field { word, shift: used.min(u32::BITS - 1), mask });
            used += bits;
        }
        Self { concurrent, fields, width: word + 1 }
    }

    fn values(&self, state: &State) -> Vec<u32> {
        let mut words = vec![0; self.width];
        for (value, Field { word, shift, .. }) in state.values.iter().zip(&self.fields) {
            words[*word] |= value << shift;
        }
        words
    }

    /// The state of which these are the values and the numbers.
    fn state(&self, words: &[u32], numbers: &[Int]) -> State {
        let task = &self.concurrent.task;
        let mut values = task.initial.values.clone();
        for (value, Field { word, shift, mask }) in values.iter_mut().zip(&self.fields) {
            *value = (words[*word] >> shift) & mask;
        }
        let mut state = State { values, numbers: numbers.to_vec() };
        task.evaluate_axioms(&mut state);
        state
    }

    pub(super) fn pack(&self, TemporalState { state, clocks, cost }: &TemporalState) -> PackedNode {
        let (values, numbers) = (self.values(state).into_boxed_slice(), state.numbers.clone());
        PackedNode { values, numbers: numbers.into_boxed_slice(), clocks: clocks.pack(), cost: *cost }
    }

    pub(super) fn unpack(&self, PackedNode { values, numbers, clocks, cost }: &PackedNode) -> TemporalState {
        TemporalState {
            state: self.state(values, numbers),
            clocks: SimpleTemporalNetwork::unpack(clocks),
            cost: *cost,
        }
    }
}

#[expect(clippy::arithmetic_side_effects, reason = "counts of what is held in memory")]
impl<'a> Store<'a> {
    pub(super) fn new(concurrent: &'a TemporalTask, monotone: bool) -> Self {
        let (places, table, nodes) = (Vec::new(), HashTable::new(), Vec::new());
        Self {
            concurrent,
            packing: Packing::new(concurrent),
            monotone,
            places,
            table,
            nodes,
            bytes: 0,
            compared: 0,
        }
    }

    /// About how many bytes are taken.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn is_dominated(&self, id: u32) -> bool {
        self.nodes[id as usize].is_dominated
    }

    pub(super) fn origin(&self, id: u32) -> Option<Origin> {
        self.nodes[id as usize].origin
    }

    /// Adds a situation; none if another one dominates it.
    pub(super) fn add(&mut self, situation: &TemporalState, origin: Option<Origin>) -> Option<u32> {
        let key = self.key(situation);
        let hash = hash_of(&key);
        let id = dense(self.nodes.len());
        let found = self.table.find(hash, |place| self.places[*place as usize].key[..] == key[..]).copied();
        let place = if let Some(place) = found {
            let mut front = std::mem::take(&mut self.places[place as usize].front);
            self.compared = self.compared.saturating_add(front.len());
            let mut known = front.iter().map(|known| &self.nodes[*known as usize]);
            let is_dominated = known.any(|known| self.dominates(known, situation));
            if !is_dominated {
                let worse: Vec<bool> = front
                    .iter()
                    .map(|known| self.is_worse(&self.nodes[*known as usize], situation))
                    .collect();
                for (known, worse) in front.iter().zip(&worse) {
                    let known = &mut self.nodes[*known as usize];
                    known.is_dominated = *worse;
                    if *worse {
                        self.bytes -= known.clocks.len();
                        known.clocks = Box::default();
                    }
                }
                let mut worse = worse.into_iter();
                front.retain(|_| worse.next() == Some(false));
                front.push(id);
            }
            self.places[place as usize].front = front;
            if is_dominated {
                return None;
            }
            place
        } else {
            let place = dense(self.places.len());
            self.bytes += key.len() * 4 + size_of::<Place>() + 16;
            self.places.push(Place { key: key.into_boxed_slice(), front: vec![id] });
            let places = &self.places;
            self.table.insert_unique(hash, place, |place| hash_of(&places[*place as usize].key));
            place
        };
        let TemporalState { state, clocks, cost } = situation;
        let (numbers, packed) = (state.numbers.clone().into_boxed_slice(), clocks.pack());
        self.bytes += size_of::<Node>() + size_of_val(&*numbers) + packed.len();
        let latest = clocks.latest();
        let is_dominated = false;
        self.nodes.push(Node { place, origin, cost: *cost, latest, numbers, clocks: packed, is_dominated });
        Some(id)
    }

    /// The situation of a node that is not dominated.
    pub(super) fn situation(&self, id: u32) -> TemporalState {
        let node = &self.nodes[id as usize];
        let state = self.packing.state(&self.places[node.place as usize].key, &node.numbers);
        TemporalState { state, clocks: SimpleTemporalNetwork::unpack(&node.clocks), cost: node.cost }
    }

    /// What must be equal where one situation dominates another one.
    fn key(&self, TemporalState { state, clocks, .. }: &TemporalState) -> Vec<u32> {
        let mut key = self.packing.values(state);
        clocks.signature(&mut key);
        if !self.monotone {
            key.extend(state.numbers.iter().flat_map(|number| words(*number)));
        }
        key
    }

    /// Whether a node is no worse than a situation of the same place.
    fn dominates(&self, node: &Node, TemporalState { state, clocks, cost }: &TemporalState) -> bool {
        let (guards, separation) = (&self.concurrent.guards, self.concurrent.separation);
        node.cost <= *cost
            && node.latest <= clocks.latest()
            && node.numbers.iter().zip(&state.numbers).all(|(own, other)| own >= other)
            && {
                let mut own = SimpleTemporalNetwork::unpack_head(&node.clocks);
                own.clocks.dominates_ignoring_accesses(clocks) && {
                    own.finish();
                    own.clocks.accesses_no_later(clocks, guards, separation)
                }
            }
    }

    /// Whether a situation of the same place is no worse than a node.
    fn is_worse(&self, node: &Node, TemporalState { state, clocks, cost }: &TemporalState) -> bool {
        let (guards, separation) = (&self.concurrent.guards, self.concurrent.separation);
        node.cost >= *cost
            && node.latest >= clocks.latest()
            && node.numbers.iter().zip(&state.numbers).all(|(own, other)| own <= other)
            && {
                let mut other = SimpleTemporalNetwork::unpack_head(&node.clocks);
                clocks.dominates_ignoring_accesses(&other.clocks) && {
                    other.finish();
                    clocks.accesses_no_later(&other.clocks, guards, separation)
                }
            }
    }
}
