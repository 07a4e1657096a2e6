//! Pareto front of many labels (search nodes with several criteria, such as path cost and resources), stored
//! as a tree of boxes in the space of criteria.
//!
//! Each box stores the best and the worst value of each criterion among its labels, so dominance queries can
//! skip whole boxes, as in the ND-tree \[1\]. A box is split by the criterion that divides its labels most
//! evenly, as in a k-d tree.
//!
//! \[1\] A. Jaszkiewicz, T. Lust: ND-Tree-Based Update: A Fast Algorithm for the Dynamic
//! Nondominance Problem, IEEE Transactions on Evolutionary Computation 22(5), 2018.

use task::number::dense;

/// Comparison of labels (search nodes) by several criteria. A label has one number for each criterion. Labels
/// and numbers are given by their indices.
pub(super) trait Criteria {
    /// Returns `true` if number `one` is at least as good as number `other` by the criterion.
    fn is_as_good(&self, criterion: usize, one: u32, other: u32) -> bool;

    /// Returns `true` if label `one` is at least as good as label `other` by every criterion. Implementations
    /// may break ties by further criteria.
    fn dominates(&self, one: u32, other: u32) -> bool;

    fn numbers(&self, label: u32, to: &mut Vec<u32>);
}

enum Content {
    Labels(Vec<u32>),
    /// Inner node. Box `first` contains the labels whose number is at least as good as `number` by
    /// `criterion`; box `second` contains the other labels.
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

#[derive(Default)]
pub(super) struct Front {
    regions: Vec<Region>,
    /// Maximum number of labels in a leaf, unless all its labels are equally good by each criterion.
    most: usize,
}

impl Front {
    pub(super) fn new(labels: Vec<u32>, most: usize, criteria: &impl Criteria) -> Self {
        let mut front = Self { regions: vec![region(labels, criteria)], most };
        front.split(0, criteria);
        front
    }

    pub(super) fn bytes(&self) -> usize {
        let numbers = self.regions.first().map_or(0, |region| region.best.len());
        let region = numbers.saturating_add(self.most).saturating_mul(8);
        self.regions.len().saturating_mul(region.saturating_add(size_of::<Region>()))
    }

    /// Returns `true` if `dominates` returns `true` for some label. Only labels in boxes whose best
    /// values are at least as good as `numbers` are tested.
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
            // The best values bound all labels of the box. If they fail in one criterion, no label of the box
            // dominates.
            if !pairs.all(|(criterion, (best, number))| criteria.is_as_good(criterion, *best, *number)) {
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

    /// Adds a label that is not dominated. Removes all labels that it dominates, and passes each of
    /// them to `leaves`.
    pub(super) fn insert(&mut self, label: u32, criteria: &impl Criteria, mut leaves: impl FnMut(u32)) {
        let mut numbers = Vec::new();
        criteria.numbers(label, &mut numbers);
        let mut stack = vec![0_u32];
        while let Some(region) = stack.pop() {
            let region = &mut self.regions[region as usize];
            let mut pairs = numbers.iter().zip(&region.worst).enumerate();
            // If the new label is worse than the worst value of the box by some criterion, it dominates no
            // label of the box.
            if !pairs.all(|(criterion, (number, worst))| criteria.is_as_good(criterion, *number, *worst)) {
                continue;
            }
            match &mut region.content {
                Content::Labels(labels) => labels.retain(|stored| {
                    let leaving = criteria.dominates(label, *stored);
                    if leaving {
                        leaves(*stored);
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

    /// Splits a leaf recursively, until each leaf has at most `most` labels or its labels are equally good.
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
            let mut label_numbers = Vec::new();
            let (first, second): (Vec<u32>, Vec<u32>) = labels.into_iter().partition(|label| {
                criteria.numbers(*label, &mut label_numbers);
                criteria.is_as_good(criterion, label_numbers[criterion], number)
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
    for (criterion, number) in numbers.iter().enumerate() {
        if !criteria.is_as_good(criterion, region.best[criterion], *number) {
            region.best[criterion] = *number;
        }
        if !criteria.is_as_good(criterion, *number, region.worst[criterion]) {
            region.worst[criterion] = *number;
        }
    }
}

/// Returns the criterion whose median splits the labels most evenly, and the median; `None` if all labels are
/// equally good.
fn middle(labels: &[u32], criteria: &impl Criteria) -> Option<(usize, u32)> {
    let mut label_numbers = Vec::new();
    let mut columns: Vec<Vec<u32>> = Vec::new();
    for label in labels {
        criteria.numbers(*label, &mut label_numbers);
        columns.resize(label_numbers.len(), Vec::new());
        for (column, number) in columns.iter_mut().zip(&label_numbers) {
            column.push(*number);
        }
    }
    let balance = |(criterion, column): (usize, &Vec<u32>)| {
        let number = median(criterion, column.clone(), criteria)?;
        let first = column.iter().filter(|value| criteria.is_as_good(criterion, **value, number)).count();
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

/// Returns the median of the numbers in `column`. If it is as bad as the worst number, returns the worst of
/// the better numbers, or `None` if all numbers are equally good.
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

    /// Points with three coordinates. Lower values are better in the first two coordinates, higher values in
    /// the last.
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
        fn a_front_holds_exactly_the_labels_that_no_other_label_dominates(most in 0_usize..30, points in proptest::collection::vec(
            proptest::collection::vec(0_u32..30, 3), 1..400,
        )) {
            let points = Points(points);
            let mut front = Front::new(vec![0], most, &points);
            let mut expected = vec![0_u32];
            for new in 1..dense(points.0.len()) {
                let numbers = &points.0[new as usize];
                let is_dominated = expected.iter().any(|label| points.dominates(*label, new));
                prop_assert_eq!(front.any(numbers, &points, |label| points.dominates(label, new)), is_dominated);
                if !is_dominated {
                    let mut removed = Vec::new();
                    front.insert(new, &points, |label| removed.push(label));
                    let (mut out, stay): (Vec<u32>, Vec<u32>) = expected.into_iter().partition(|label| points.dominates(new, *label));
                    removed.sort_unstable();
                    out.sort_unstable();
                    prop_assert_eq!(removed, out);
                    expected = stay;
                    expected.push(new);
                }
            }
        }
    }
}
