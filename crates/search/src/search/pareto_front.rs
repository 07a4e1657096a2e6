//! Pareto front of many labels, stored as a tree of boxes.
//!
//! Each box stores the best and the worst value of each criterion among its labels. Whole boxes are skipped in
//! dominance queries, as in the ND-tree \[1\]. Boxes are split where their labels differ, as in a k-d tree.
//!
//! \[1\] A. Jaszkiewicz, T. Lust: ND-Tree-Based Update: A Fast Algorithm for the Dynamic Nondominance Problem,
//! IEEE Transactions on Evolutionary Computation 22(5), 2018.

use task::number::dense;

/// What labels are compared by: positions of numbers, one for each criterion.
pub(super) trait Criteria {
    /// Whether the first number is at least as good as the second by a criterion.
    fn is_as_good(&self, criterion: usize, one: u32, other: u32) -> bool;

    /// Whether the first label is at least as good as the second.
    fn dominates(&self, one: u32, other: u32) -> bool;

    /// The numbers of a label, one for each criterion.
    fn numbers(&self, label: u32, to: &mut Vec<u32>);
}

enum Content {
    Labels(Vec<u32>),
    /// Labels with a number as good as this one by this criterion are in the first box.
    Boxes {
        criterion: usize,
        number: u32,
        first: u32,
        second: u32,
    },
}

struct Region {
    best: Vec<u32>,
    worst: Vec<u32>,
    content: Content,
}

/// A front with many labels.
#[derive(Default)]
pub(super) struct Front {
    regions: Vec<Region>,
    /// As many labels stay in one box.
    most: usize,
}

impl Front {
    pub(super) fn new(labels: Vec<u32>, most: usize, criteria: &impl Criteria) -> Self {
        let mut front = Self { regions: vec![region(labels, criteria)], most };
        front.split(0, criteria);
        front
    }

    /// About how much memory is taken.
    pub(super) fn bytes(&self) -> usize {
        let numbers = self.regions.first().map_or(0, |region| region.best.len());
        let region = numbers.saturating_add(self.most).saturating_mul(8);
        self.regions.len().saturating_mul(region.saturating_add(size_of::<Region>()))
    }

    /// Whether a label dominates one with these numbers, as `dominates` has it.
    pub(super) fn any(
        &self,
        numbers: &[u32],
        criteria: &impl Criteria,
        dominates: impl Fn(u32) -> bool,
    ) -> bool {
        let mut stack = vec![0_u32];
        while let Some(region) = stack.pop() {
            let region = &self.regions[region as usize];
            let mut pairs = region.best.iter().zip(numbers).enumerate();
            if !pairs.all(|(criterion, (best, own))| criteria.is_as_good(criterion, *best, *own)) {
                continue;
            }
            match &region.content {
                Content::Labels(labels) => {
                    if labels.iter().any(|label| dominates(*label)) {
                        return true;
                    }
                }
                Content::Boxes { first, second, .. } => stack.extend([*second, *first]),
            }
        }
        false
    }

    /// Adds a label; what it dominates leaves the front.
    pub(super) fn insert(&mut self, label: u32, criteria: &impl Criteria, mut leaves: impl FnMut(u32)) {
        let mut numbers = Vec::new();
        criteria.numbers(label, &mut numbers);
        let mut stack = vec![0_u32];
        while let Some(region) = stack.pop() {
            let region = &mut self.regions[region as usize];
            let mut pairs = numbers.iter().zip(&region.worst).enumerate();
            if !pairs.all(|(criterion, (own, worst))| criteria.is_as_good(criterion, *own, *worst)) {
                continue;
            }
            match &mut region.content {
                Content::Labels(labels) => labels.retain(|known| {
                    let leaving = criteria.dominates(label, *known);
                    if leaving {
                        leaves(*known);
                    }
                    !leaving
                }),
                Content::Boxes { first, second, .. } => stack.extend([*second, *first]),
            }
        }
        let mut at = 0;
        loop {
            let region = &mut self.regions[at as usize];
            widen(region, &numbers, criteria);
            match &mut region.content {
                Content::Labels(labels) => {
                    labels.push(label);
                    break;
                }
                Content::Boxes { criterion, number, first, second } => {
                    let is_first = criteria.is_as_good(*criterion, numbers[*criterion], *number);
                    at = if is_first { *first } else { *second };
                }
            }
        }
        self.split(at, criteria);
    }

    /// Splits a box, and its parts, until they hold few labels.
    fn split(&mut self, from: u32, criteria: &impl Criteria) {
        let mut stack = vec![from];
        while let Some(at) = stack.pop() {
            let Content::Labels(labels) = &mut self.regions[at as usize].content else { continue };
            if labels.len() <= self.most {
                continue;
            }
            let labels = std::mem::take(labels);
            let Some((criterion, number)) = middle(&labels, criteria) else {
                self.regions[at as usize].content = Content::Labels(labels);
                continue;
            };
            let mut own = Vec::new();
            let (first, second): (Vec<u32>, Vec<u32>) = labels.into_iter().partition(|label| {
                criteria.numbers(*label, &mut own);
                criteria.is_as_good(criterion, own[criterion], number)
            });
            let [first, second] = [first, second].map(|labels| {
                let id = dense(self.regions.len());
                self.regions.push(region(labels, criteria));
                id
            });
            self.regions[at as usize].content = Content::Boxes { criterion, number, first, second };
            stack.extend([first, second]);
        }
    }
}

/// A box around some labels.
fn region(labels: Vec<u32>, criteria: &impl Criteria) -> Region {
    let mut region = Region { best: Vec::new(), worst: Vec::new(), content: Content::Labels(Vec::new()) };
    let mut numbers = Vec::new();
    for label in &labels {
        criteria.numbers(*label, &mut numbers);
        widen(&mut region, &numbers, criteria);
    }
    region.content = Content::Labels(labels);
    region
}

fn widen(region: &mut Region, numbers: &[u32], criteria: &impl Criteria) {
    if region.best.is_empty() {
        region.best.extend_from_slice(numbers);
        region.worst.extend_from_slice(numbers);
    }
    for (criterion, own) in numbers.iter().enumerate() {
        if !criteria.is_as_good(criterion, region.best[criterion], *own) {
            region.best[criterion] = *own;
        }
        if !criteria.is_as_good(criterion, *own, region.worst[criterion]) {
            region.worst[criterion] = *own;
        }
    }
}

/// Where to split labels so that the parts are most alike in size; none if they do not differ.
fn middle(labels: &[u32], criteria: &impl Criteria) -> Option<(usize, u32)> {
    let mut own = Vec::new();
    let mut columns: Vec<Vec<u32>> = Vec::new();
    for label in labels {
        criteria.numbers(*label, &mut own);
        columns.resize(own.len(), Vec::new());
        for (column, number) in columns.iter_mut().zip(&own) {
            column.push(*number);
        }
    }
    let balance = |(criterion, column): (usize, &Vec<u32>)| {
        let number = median(criterion, column.clone(), criteria)?;
        let first = column.iter().filter(|own| criteria.is_as_good(criterion, **own, number)).count();
        let smaller = first.min(column.len().saturating_sub(first));
        (smaller > 0).then_some((smaller, criterion, number))
    };
    let best = columns
        .iter()
        .enumerate()
        .filter_map(balance)
        .max_by_key(|(smaller, criterion, _)| (*smaller, std::cmp::Reverse(*criterion)));
    best.map(|(_, criterion, number)| (criterion, number))
}

/// A number in the middle, but not the worst one.
fn median(criterion: usize, mut column: Vec<u32>, criteria: &impl Criteria) -> Option<u32> {
    column.sort_by(|one, other| {
        match (criteria.is_as_good(criterion, *one, *other), criteria.is_as_good(criterion, *other, *one)) {
            (true, true) => std::cmp::Ordering::Equal,
            (true, false) => std::cmp::Ordering::Less,
            (false, _) => std::cmp::Ordering::Greater,
        }
    });
    let worst = *column.last()?;
    let better = column.iter().filter(|number| !criteria.is_as_good(criterion, worst, **number));
    let better: Vec<u32> = better.copied().collect();
    let middle = better.len().min(column.len() / 2);
    better.get(middle).or(better.last()).copied()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Points of which less is better in each coordinate but the last.
    struct Points(Vec<Vec<u32>>);

    impl Criteria for Points {
        fn is_as_good(&self, criterion: usize, one: u32, other: u32) -> bool {
            if criterion == 2 { one >= other } else { one <= other }
        }

        fn dominates(&self, one: u32, other: u32) -> bool {
            let [one, other] = [one, other].map(|point| &self.0[point as usize]);
            one.iter().zip(other).enumerate().all(|(criterion, (a, b))| self.is_as_good(criterion, *a, *b))
        }

        fn numbers(&self, label: u32, to: &mut Vec<u32>) {
            to.clone_from(&self.0[label as usize]);
        }
    }

    proptest! {
        #[test]
        fn a_front_is_what_nothing_dominates(most in 0_usize..30, points in proptest::collection::vec(
            proptest::collection::vec(0_u32..30, 3), 1..400,
        )) {
            let points = Points(points);
            let mut front = Front::new(vec![0], most, &points);
            let mut expected = vec![0_u32];
            for new in 1..dense(points.0.len()) {
                let own = &points.0[new as usize];
                let beaten = expected.iter().any(|known| points.dominates(*known, new));
                prop_assert_eq!(front.any(own, &points, |known| points.dominates(known, new)), beaten);
                if !beaten {
                    let mut left = Vec::new();
                    front.insert(new, &points, |known| left.push(known));
                    let (mut out, stay): (Vec<u32>, Vec<u32>) = expected.into_iter().partition(|known| points.dominates(new, *known));
                    left.sort_unstable();
                    out.sort_unstable();
                    prop_assert_eq!(left, out);
                    expected = stay;
                    expected.push(new);
                }
            }
        }
    }
}
