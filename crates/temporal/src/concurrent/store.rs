//! Packed temporal states of the exact search.
//!
//! Finite-domain values take as many bits as they need, and times as many bytes as they need. A *place*
//! groups the states that may dominate each other: states with the same values and running actions and,
//! unless larger numbers are never worse, the same numbers.

use std::hash::{Hash, Hasher};

use hashbrown::HashTable;
use rustc_hash::FxHasher;
use task::number::{Int, dense, words};
use task::task::{OperatorId, State};

use crate::concurrent::simple_temporal_network::SimpleTemporalNetwork;
use crate::concurrent::successors::TemporalState;
use crate::concurrent::temporal_task::TemporalTask;
use crate::concurrent::time_number::TimeNumber;

struct Field {
    word: usize,
    shift: u32,
    mask: u32,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    pub(super) parent: u32,
    pub(super) operator: OperatorId,
    /// `true` if the same step also applied the end of the started action.
    pub(super) compressed: bool,
    pub(super) together: bool,
    pub(super) depth: u32,
}

struct Node<T> {
    place: u32,
    origin: Option<Origin>,
    cost: Int,
    latest: T,
    numbers: Box<[Int]>,
    clocks: Box<[u8]>,
    is_dominated: bool,
}

struct Place {
    key: Box<[u32]>,
    front: Vec<u32>,
}

pub(super) struct Packing<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    fields: Vec<Field>,
    width: usize,
}

pub(super) struct PackedNode {
    values: Box<[u32]>,
    numbers: Box<[Int]>,
    clocks: Box<[u8]>,
    cost: Int,
}

impl PackedNode {
    pub(super) fn bytes(&self) -> usize {
        let values = size_of_val(&*self.values).saturating_add(size_of_val(&*self.numbers));
        values.saturating_add(self.clocks.len())
    }
}

pub(super) struct Store<'a, T: TimeNumber = Int> {
    concurrent: &'a TemporalTask<T>,
    packing: Packing<'a, T>,
    /// `true` if a larger value of a number is never worse.
    monotone: bool,
    places: Vec<Place>,
    table: HashTable<u32>,
    nodes: Vec<Node<T>>,
    bytes: usize,
    /// Sum, over all calls of `add`, of the number of stored nodes that may dominate the state.
    pub(super) compared: usize,
}

fn hash_of(key: &[u32]) -> u64 {
    let mut hasher = FxHasher::default();
    key.hash(&mut hasher);
    hasher.finish()
}

#[expect(clippy::arithmetic_side_effects, reason = "the bits of values that are held in memory")]
impl<'a, T: TimeNumber> Packing<'a, T> {
    pub(super) fn new(concurrent: &'a TemporalTask<T>) -> Self {
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

    /// Rebuilds a state from packed values and numbers, and derives the derived variables.
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

    pub(super) fn pack(&self, TemporalState { state, clocks, cost }: &TemporalState<T>) -> PackedNode {
        let (values, numbers) = (self.values(state).into_boxed_slice(), state.numbers.clone());
        PackedNode { values, numbers: numbers.into_boxed_slice(), clocks: clocks.pack(), cost: *cost }
    }

    pub(super) fn unpack(
        &self,
        PackedNode { values, numbers, clocks, cost }: &PackedNode,
    ) -> TemporalState<T> {
        TemporalState {
            state: self.state(values, numbers),
            clocks: SimpleTemporalNetwork::unpack(clocks),
            cost: *cost,
        }
    }
}

#[expect(clippy::arithmetic_side_effects, reason = "counts of what is held in memory")]
impl<'a, T: TimeNumber> Store<'a, T> {
    pub(super) fn new(concurrent: &'a TemporalTask<T>, monotone: bool) -> Self {
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

    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn is_dominated(&self, id: u32) -> bool {
        self.nodes[id as usize].is_dominated
    }

    pub(super) fn origin(&self, id: u32) -> Option<Origin> {
        self.nodes[id as usize].origin
    }

    /// Adds a temporal state, and returns its node id. Returns `None` if a stored node dominates
    /// the state. Stored nodes that the new state dominates are marked as dominated.
    pub(super) fn add(&mut self, situation: &TemporalState<T>, origin: Option<Origin>) -> Option<u32> {
        let key = self.key(situation);
        let hash = hash_of(&key);
        let id = dense(self.nodes.len());
        let existing_place =
            self.table.find(hash, |place| self.places[*place as usize].key[..] == key[..]).copied();
        let place = if let Some(place) = existing_place {
            let mut front = std::mem::take(&mut self.places[place as usize].front);
            self.compared = self.compared.saturating_add(front.len());
            let mut nodes = front.iter().map(|id| &self.nodes[*id as usize]);
            let is_dominated = nodes.any(|node| self.dominates(node, situation));
            if !is_dominated {
                let worse: Vec<bool> =
                    front.iter().map(|id| self.is_worse(&self.nodes[*id as usize], situation)).collect();
                for (id, worse) in front.iter().zip(&worse) {
                    let node = &mut self.nodes[*id as usize];
                    node.is_dominated = *worse;
                    if *worse {
                        // The network of a dominated node is never needed again.
                        self.bytes -= node.clocks.len();
                        node.clocks = Box::default();
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
        self.bytes += size_of::<Node<T>>() + size_of_val(&*numbers) + packed.len();
        let latest = clocks.latest();
        let is_dominated = false;
        self.nodes.push(Node { place, origin, cost: *cost, latest, numbers, clocks: packed, is_dominated });
        Some(id)
    }

    /// Unpacks the temporal state of a node. The node must not be dominated, because the networks
    /// of dominated nodes are discarded.
    pub(super) fn situation(&self, id: u32) -> TemporalState<T> {
        let node = &self.nodes[id as usize];
        let state = self.packing.state(&self.places[node.place as usize].key, &node.numbers);
        TemporalState { state, clocks: SimpleTemporalNetwork::unpack(&node.clocks), cost: node.cost }
    }

    /// Key of a place: the parts of a state that must be equal for dominance between two states.
    fn key(&self, TemporalState { state, clocks, .. }: &TemporalState<T>) -> Vec<u32> {
        let mut key = self.packing.values(state);
        clocks.signature(&mut key);
        if !self.monotone {
            key.extend(state.numbers.iter().flat_map(|number| words(*number)));
        }
        key
    }

    fn dominates(&self, node: &Node<T>, TemporalState { state, clocks, cost }: &TemporalState<T>) -> bool {
        let (guards, separation) = (&self.concurrent.guards, self.concurrent.separation);
        node.cost <= *cost
            && node.latest <= clocks.latest()
            && node.numbers.iter().zip(&state.numbers).all(|(stored, new)| stored >= new)
            && {
                // The head decides most comparisons, so the access times are unpacked only if
                // necessary.
                let mut head = SimpleTemporalNetwork::unpack_head(&node.clocks);
                head.clocks.dominates_ignoring_accesses(clocks) && {
                    head.finish();
                    head.clocks.accesses_no_later(clocks, guards, separation)
                }
            }
    }

    fn is_worse(&self, node: &Node<T>, TemporalState { state, clocks, cost }: &TemporalState<T>) -> bool {
        let (guards, separation) = (&self.concurrent.guards, self.concurrent.separation);
        node.cost >= *cost
            && node.latest >= clocks.latest()
            && node.numbers.iter().zip(&state.numbers).all(|(stored, new)| stored <= new)
            && {
                let mut head = SimpleTemporalNetwork::unpack_head(&node.clocks);
                clocks.dominates_ignoring_accesses(&head.clocks) && {
                    head.finish();
                    clocks.accesses_no_later(&head.clocks, guards, separation)
                }
            }
    }
}
