//! State registry and closed list of A\*, with packed states.
//!
//! Finite-domain values are packed into as few bits as they need. Equal numbers are stored once, and states
//! refer to them by index. A *place* is the combination of the finite-domain values (with symmetries, the
//! canonical ones) and the numbers that must be equal for dominance. A hash table finds the place of a state.
//! The states of a place differ in cost, steps, and other numbers. Those that no other state of the place
//! dominates form its Pareto front.

use std::hash::{Hash, Hasher};
use std::sync::Arc;

use hashbrown::HashTable;
use rustc_hash::FxHasher;
use task::number::dense;
use task::task::number::TaskNumber;
use task::task::{State, Task};

use crate::search::monotonicity::Polarity;
use crate::search::pareto_front::{Criteria, Front};
use crate::search::symmetry::Orbits;

/// Missing index: no next node of a front, no parent, or no step.
pub(super) const NONE: u32 = u32::MAX;

const WORD: u32 = u32::BITS;

struct BitField {
    variable: usize,
    word: usize,
    shift: u32,
    mask: u32,
}

/// A numeric variable that is not part of the key. It is compared by ≥ or ≤, or ignored.
struct ComparedVariable {
    variable: usize,
    asked: Polarity,
}

/// Bit that marks an entry of `fronts` as an index in `trees` instead of the index of a node.
const TREE_FLAG: u32 = 1 << 31;

/// Number of nodes at which a search must end. Indices of nodes must be below `TREE_FLAG`. The other half of them is
/// left for the successors of the last expanded state.
pub(super) const MAX_NODES: usize = TREE_FLAG as usize / 2;

/// Interned numbers: equal numbers have equal indices.
struct Numbers<N> {
    all: Vec<N>,
    table: HashTable<u32>,
}

#[derive(Clone, Copy)]
pub(super) struct ParentLink {
    pub(super) parent: u32,
    /// Index of an operator with one of its combinations of designs, see `SearchTask::step`.
    pub(super) step: u32,
    pub(super) steps: u32,
}

struct Node {
    place: u32,
    origin: ParentLink,
    cost: u32,
    next: u32,
    state: NodeStatus,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum NodeStatus {
    Open,
    /// Non-dominated, and the lazy heuristic has been evaluated.
    Closer,
    Dominated,
}

pub(super) struct StateRegistry<N> {
    fields: Vec<BitField>,
    exact: Vec<usize>,
    compared: Vec<ComparedVariable>,
    width: usize,
    /// `width` words for each place.
    keys: Vec<u32>,
    /// For each place: the first node of its Pareto front, which is a linked list. For a long
    /// front: the index in `trees` combined with `TREE_FLAG`.
    fronts: Vec<u32>,
    trees: Vec<Front>,
    /// Maximum length of a linked list. A longer front is stored as a tree.
    longest: usize,
    tree_bytes: usize,
    table: HashTable<u32>,
    nodes: Vec<Node>,
    /// For each node: the indices (in `numbers`) of the values of its compared variables.
    others: Vec<u32>,
    numbers: Numbers<N>,
    key: Vec<u32>,
    /// Compared numbers of the state that is looked up.
    own: Vec<u32>,
    /// If set, the keys are canonical, and states with the same canonical state count as equal.
    orbits: Option<Arc<Orbits>>,
    /// With symmetries: the packed original values of each node.
    plain: Vec<u32>,
    /// With symmetries: the packed original values of the state that is looked up.
    own_plain: Vec<u32>,
    values: Vec<u32>,
    image: Vec<u32>,
}

pub(super) struct VacantEntry {
    hash: u64,
    place: Option<u32>,
    cost: u32,
}

fn hash_of<T: Hash + ?Sized>(value: &T) -> u64 {
    let mut hasher = FxHasher::default();
    value.hash(&mut hasher);
    hasher.finish()
}

impl<N: TaskNumber> Numbers<N> {
    fn position(&mut self, number: &N) -> u32 {
        let hash = hash_of(number);
        let Self { all, table } = self;
        if let Some(position) = table.find(hash, |position| all[*position as usize] == *number) {
            return *position;
        }
        let position = dense(all.len());
        all.push(number.clone());
        table.insert_unique(hash, position, |position| hash_of(&all[*position as usize]));
        position
    }
}

/// Assigns bit fields by first-fit decreasing on the number of bits. Returns the fields and the
/// number of words.
#[expect(clippy::arithmetic_side_effects, reason = "bits of a word, and words that are held in memory")]
fn fields(sizes: &[usize]) -> (Vec<BitField>, usize) {
    let bits = |size: &usize| WORD - dense(size.saturating_sub(1)).leading_zeros();
    let mut order: Vec<(u32, usize)> =
        sizes.iter().map(bits).zip(0..).filter(|(bits, _)| *bits > 0).collect();
    order.sort_by_key(|(bits, _)| std::cmp::Reverse(*bits));
    let mut used: Vec<u32> = Vec::new();
    // All words before this index are full.
    let mut first = 0;
    let mut fields = Vec::with_capacity(order.len());
    for (bits, variable) in order {
        while used.get(first).is_some_and(|used| *used == WORD) {
            first += 1;
        }
        let free = used[first..].iter().position(|used| used + bits <= WORD);
        let word = free.map_or(used.len(), |free| first + free);
        if word == used.len() {
            used.push(0);
        }
        let shift = used[word];
        fields.push(BitField { variable, word, shift, mask: u32::MAX >> (WORD - bits) });
        used[word] += bits;
    }
    fields.sort_by_key(|field| field.word);
    (fields, used.len())
}

fn pack(fields: &[BitField], values: &[u32], words: usize, to: &mut Vec<u32>) {
    to.clear();
    to.resize(words, 0);
    for field in fields {
        to[field.word] |= values[field.variable] << field.shift;
    }
}

impl<N: TaskNumber> StateRegistry<N> {
    pub(super) fn new(
        task: &Task<N>,
        polarities: Vec<Polarity>,
        orbits: Option<Arc<Orbits>>,
        longest: usize,
    ) -> Self {
        let sizes: Vec<usize> =
            task.variables[..task.basic].iter().map(|variable| variable.values.len()).collect();
        let (fields, words) = fields(&sizes);
        let (mut exact, mut compared) = (Vec::new(), Vec::new());
        for (variable, asked) in polarities.into_iter().enumerate() {
            if asked.up && asked.down {
                exact.push(variable);
            } else {
                compared.push(ComparedVariable { variable, asked });
            }
        }
        let width = words.saturating_add(exact.len());
        Self {
            fields,
            exact,
            compared,
            width,
            keys: Vec::new(),
            fronts: Vec::new(),
            trees: Vec::new(),
            longest,
            tree_bytes: 0,
            table: HashTable::new(),
            nodes: Vec::new(),
            others: Vec::new(),
            numbers: Numbers { all: Vec::new(), table: HashTable::new() },
            key: Vec::new(),
            own: Vec::new(),
            orbits,
            plain: Vec::new(),
            own_plain: Vec::new(),
            values: Vec::new(),
            image: Vec::new(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(super) fn bytes(&self) -> usize {
        let words = [&self.keys, &self.fronts, &self.others, &self.plain]
            .map(|list| list.len().saturating_mul(size_of::<u32>()));
        // An entry takes four bytes and a control byte, and at most seven of eight buckets are used.
        let tables = [&self.table, &self.numbers.table].map(|table| table.capacity().saturating_mul(6));
        let nodes = self.nodes.len().saturating_mul(size_of::<Node>());
        let numbers = self.numbers.all.len().saturating_mul(size_of::<N>());
        words
            .into_iter()
            .chain(tables)
            .chain([self.tree_bytes])
            .fold(nodes.saturating_add(numbers), usize::saturating_add)
    }

    /// Looks up a state that is reached with this path cost and number of steps. Returns `None` if a stored
    /// state dominates it.
    pub(super) fn look_up(&mut self, state: &State<N>, cost: &N, steps: u32) -> Option<VacantEntry> {
        let words = self.words();
        // The original values are stored in addition to the key. A plan must be extracted from original
        // states, not from their canonical images.
        if let Some(orbits) = &self.orbits {
            pack(&self.fields, &state.values, words, &mut self.own_plain);
            self.values.clone_from(&state.values);
            orbits.canonicalize(&mut self.values, &mut self.image);
            pack(&self.fields, &self.values, words, &mut self.key);
        } else {
            pack(&self.fields, &state.values, words, &mut self.key);
        }
        for variable in &self.exact {
            let position = self.numbers.position(&state.numbers[*variable]);
            self.key.push(position);
        }
        self.own.clear();
        for compared in &self.compared {
            let position = self.numbers.position(&state.numbers[compared.variable]);
            self.own.push(position);
        }
        let hash = hash_of(&self.key[..]);
        let has_key = |place: &u32| self.key_of(*place) == self.key;
        let place = self.table.find(hash, has_key).copied();
        let cost = self.numbers.position(cost);
        let front = place.map_or(NONE, |place| self.fronts[place as usize]);
        let dominates = |id: u32| {
            // Cost and number of steps form one criterion, which is compared lexicographically.
            let node = &self.nodes[id as usize];
            self.is_as_cheap((node.cost, node.origin.steps), (cost, steps))
                && self.is_no_worse(self.others_of(id), &self.own)
        };
        let is_dominated = if front != NONE && front & TREE_FLAG != 0 {
            let mut numbers = vec![cost];
            numbers.extend_from_slice(&self.own);
            self.trees[(front ^ TREE_FLAG) as usize].any(&numbers, self, dominates)
        } else {
            self.chain(front).any(dominates)
        };
        (!is_dominated).then_some(VacantEntry { hash, place, cost })
    }

    fn words(&self) -> usize {
        self.width.saturating_sub(self.exact.len())
    }

    fn chain(&self, first: u32) -> impl Iterator<Item = u32> {
        let some = |node: u32| (node != NONE).then_some(node);
        std::iter::successors(some(first), move |node| some(self.nodes[*node as usize].next))
    }

    /// Stores the state of the last lookup, and marks the stored nodes that it dominates.
    pub(super) fn insert(&mut self, vacancy: &VacantEntry, origin: ParentLink) -> u32 {
        let place = vacancy.place.unwrap_or_else(|| self.add_place(vacancy.hash));
        let id = dense(self.nodes.len());
        let node = Node { place, origin, cost: vacancy.cost, next: NONE, state: NodeStatus::Open };
        self.nodes.push(node);
        self.others.extend_from_slice(&self.own);
        if self.orbits.is_some() {
            self.plain.extend_from_slice(&self.own_plain);
        }
        let front = self.fronts[place as usize];
        if front != NONE && front & TREE_FLAG != 0 {
            self.insert_into_tree(front ^ TREE_FLAG, id);
            return id;
        }
        // Nodes that the new node dominates are removed from the front.
        let (out, mut stay): (Vec<u32>, Vec<u32>) =
            self.chain(front).partition(|node_id| self.dominates(id, *node_id));
        for node_id in out {
            self.nodes[node_id as usize].state = NodeStatus::Dominated;
        }
        stay.insert(0, id);
        if stay.len() > self.longest {
            let tree = Front::new(stay, self.longest, self);
            self.tree_bytes = self.tree_bytes.saturating_add(tree.bytes());
            self.fronts[place as usize] = dense(self.trees.len()) | TREE_FLAG;
            self.trees.push(tree);
            return id;
        }
        for (position, node) in stay.iter().enumerate() {
            self.nodes[*node as usize].next = stay.get(position.saturating_add(1)).copied().unwrap_or(NONE);
        }
        self.fronts[place as usize] = id;
        id
    }

    fn insert_into_tree(&mut self, tree: u32, id: u32) {
        let mut front = std::mem::take(&mut self.trees[tree as usize]);
        let before = front.bytes();
        let mut out = Vec::new();
        front.insert(id, self, |node_id| out.push(node_id));
        for node_id in out {
            self.nodes[node_id as usize].state = NodeStatus::Dominated;
        }
        self.tree_bytes = self.tree_bytes.saturating_add(front.bytes()).saturating_sub(before);
        self.trees[tree as usize] = front;
    }

    fn add_place(&mut self, hash: u64) -> u32 {
        let place = dense(self.fronts.len());
        self.fronts.push(NONE);
        self.keys.extend_from_slice(&self.key);
        let (keys, width) = (&self.keys, self.width);
        self.table.insert_unique(hash, place, |place| hash_of(key_of(keys, width, *place)));
        place
    }

    fn key_of(&self, place: u32) -> &[u32] {
        key_of(&self.keys, self.width, place)
    }

    fn others_of(&self, node: u32) -> &[u32] {
        key_of(&self.others, self.compared.len(), node)
    }

    fn is_as_cheap(&self, one: (u32, u32), other: (u32, u32)) -> bool {
        let cost = |position: u32| &self.numbers.all[position as usize];
        if one.0 == other.0 { one.1 <= other.1 } else { cost(one.0) < cost(other.0) }
    }

    fn compares(&self, Polarity { up, down }: Polarity, one: u32, other: u32) -> bool {
        let number = |position: u32| &self.numbers.all[position as usize];
        one == other || (!up || number(one) >= number(other)) && (!down || number(one) <= number(other))
    }

    fn is_no_worse(&self, one: &[u32], other: &[u32]) -> bool {
        let mut pairs = self.compared.iter().zip(one.iter().zip(other));
        pairs.all(|(compared, (one, other))| self.compares(compared.asked, *one, *other))
    }

    pub(super) fn is_dominated(&self, node: u32) -> bool {
        self.nodes[node as usize].state == NodeStatus::Dominated
    }

    /// Records that the lazy heuristic has been evaluated for a node. Returns `false` if this was recorded
    /// before or the node is dominated.
    pub(super) fn mark_reevaluated(&mut self, node: u32) -> bool {
        let state = &mut self.nodes[node as usize].state;
        let is_first = *state == NodeStatus::Open;
        if is_first {
            *state = NodeStatus::Closer;
        }
        is_first
    }

    pub(super) fn origin(&self, node: u32) -> ParentLink {
        self.nodes[node as usize].origin
    }

    pub(super) fn cost(&self, node: u32) -> &N {
        &self.numbers.all[self.nodes[node as usize].cost as usize]
    }

    /// Unpacks the original (not canonical) state of a node into `state`. Derived variables are not set.
    pub(super) fn unpack(&self, node: u32, state: &mut State<N>) {
        let key = self.key_of(self.nodes[node as usize].place);
        // Canonical keys identify states but must not be expanded, because their steps would not form a plan.
        let words = if self.orbits.is_some() { key_of(&self.plain, self.words(), node) } else { key };
        for field in &self.fields {
            state.values[field.variable] = (words[field.word] >> field.shift) & field.mask;
        }
        let number = |position: u32| self.numbers.all[position as usize].clone();
        for (variable, position) in self.exact.iter().zip(&key[self.words()..]) {
            state.numbers[*variable] = number(*position);
        }
        for (compared, position) in self.compared.iter().zip(self.others_of(node)) {
            state.numbers[compared.variable] = number(*position);
        }
    }
}

impl<N: TaskNumber> Criteria for StateRegistry<N> {
    fn is_as_good(&self, criterion: usize, one: u32, other: u32) -> bool {
        let number = |position: u32| &self.numbers.all[position as usize];
        let Some(compared) = criterion.checked_sub(1) else { return number(one) <= number(other) };
        self.compares(self.compared[compared].asked, one, other)
    }

    fn dominates(&self, one: u32, other: u32) -> bool {
        let price = |node: u32| (self.nodes[node as usize].cost, self.nodes[node as usize].origin.steps);
        self.is_as_cheap(price(one), price(other))
            && self.is_no_worse(self.others_of(one), self.others_of(other))
    }

    fn numbers(&self, label: u32, to: &mut Vec<u32>) {
        to.clear();
        to.push(self.nodes[label as usize].cost);
        to.extend_from_slice(self.others_of(label));
    }
}

#[expect(clippy::arithmetic_side_effects, reason = "positions in a list that is held in memory")]
fn key_of(words: &[u32], width: usize, position: u32) -> &[u32] {
    &words[position as usize * width..(position as usize + 1) * width]
}
