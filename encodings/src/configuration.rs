//! Which design each of several functions gets, where their designs compete for components or share a budget.
//!
//! The best choice serves as many functions as can be served together; of those choices, it misses the fewest requirements, and of
//! those it has the greatest sum of utilities.
//! Of equals it is the first: earlier functions get the earlier ones of their designs.
//!
//! Function after function, all that has been chosen so far is kept unless something else is at least as good in every respect: as
//! many functions served, no more requirements missed, as much utility, no more of any budget, no component more in use. What is left at the end has the
//! optimum among it. A choice that can no more keep a budget, whatever comes, is left out at once.

use std::cmp::Ordering;
use std::collections::BTreeSet;

use num_rational::BigRational;
use num_traits::Zero as _;

use crate::limits::{Interrupted, Limits};

/// One of the designs of a function.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DesignChoice {
    /// How many requirements of the function it misses.
    pub missed: usize,
    /// What it is worth; larger is better.
    pub utility: BigRational,
    /// What it takes of each budget.
    pub demands: Vec<BigRational>,
    /// Components that only one of all chosen designs can use, as numbers of the caller's.
    pub components: BTreeSet<usize>,
}

/// A choice for each function, if it can be served.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chosen {
    /// The position of the design in the function's list.
    pub designs: Vec<Option<usize>>,
    /// The sum of the utilities.
    pub utility: BigRational,
    /// Whether it is proved that no choice is better; a limit was reached if not.
    pub optimal: bool,
}

/// What has been chosen for the functions so far.
#[derive(Debug, Clone, Default)]
struct Label {
    designs: Vec<Option<usize>>,
    served: usize,
    missed: usize,
    utility: BigRational,
    spent: Vec<BigRational>,
    used: BTreeSet<usize>,
}

impl Label {
    fn with(&self, position: usize, choice: &DesignChoice) -> Option<Self> {
        if !self.used.is_disjoint(&choice.components) {
            return None;
        }
        let mut label = self.clone();
        label.designs.push(Some(position));
        label.served = label.served.saturating_add(1);
        label.missed = label.missed.saturating_add(choice.missed);
        label.utility += &choice.utility;
        label.spent.iter_mut().zip(&choice.demands).for_each(|(spent, demand)| *spent += demand);
        label.used.extend(&choice.components);
        Some(label)
    }

    fn without(&self) -> Self {
        let mut label = self.clone();
        label.designs.push(None);
        label
    }

    fn worth(&self, other: &Self) -> Ordering {
        self.served
            .cmp(&other.served)
            .then_with(|| other.missed.cmp(&self.missed))
            .then_with(|| self.utility.cmp(&other.utility))
    }

    /// Whether whatever can be added to the other one can be added to this one.
    fn is_as_free(&self, other: &Self) -> bool {
        self.used.is_subset(&other.used)
            && self.spent.iter().zip(&other.spent).all(|(own, other)| own <= other)
    }
}

/// The best choice for functions, each with its designs in the order of preference among equals, under budgets.
pub fn configure(functions: &[Vec<DesignChoice>], budgets: &[BigRational], limits: &Limits) -> Chosen {
    let least = least_demands(functions, budgets.len());
    let first = Label { spent: vec![BigRational::zero(); budgets.len()], ..Label::default() };
    let mut labels = vec![first];
    for (at, (designs, least)) in functions.iter().zip(&least).enumerate() {
        match extended(&labels, designs, least, budgets, limits) {
            Ok(next) => labels = next,
            Err(Interrupted) => {
                return completed(&labels, functions, at, &least_demands(functions, budgets.len()), budgets);
            }
        }
    }
    let best = labels.into_iter().reduce(|best, other| if other.worth(&best).is_gt() { other } else { best });
    let Label { designs, utility, .. } = best.unwrap_or_default();
    Chosen { designs, utility, optimal: true }
}

/// For each function, the least that the functions after it can take of each budget.
fn least_demands(functions: &[Vec<DesignChoice>], budgets: usize) -> Vec<Vec<BigRational>> {
    let mut after = vec![BigRational::zero(); budgets];
    let mut all = Vec::with_capacity(functions.len());
    for designs in functions.iter().rev() {
        all.push(after.clone());
        for (budget, least) in after.iter_mut().enumerate() {
            let demands = designs.iter().filter_map(|design| design.demands.get(budget));
            // A function that is not served takes nothing.
            *least += demands.min().cloned().unwrap_or_default().min(BigRational::zero());
        }
    }
    all.reverse();
    all
}

fn fits(label: &Label, least: &[BigRational], budgets: &[BigRational]) -> bool {
    let ahead = label.spent.iter().zip(least).map(|(spent, least)| spent + least);
    ahead.zip(budgets).all(|(spent, budget)| spent <= *budget)
}

/// All labels with one more function, without those that others are as good as. They are in the order of preference.
fn extended(
    labels: &[Label],
    designs: &[DesignChoice],
    least: &[BigRational],
    budgets: &[BigRational],
    limits: &Limits,
) -> Result<Vec<Label>, Interrupted> {
    let mut next: Vec<Label> = Vec::new();
    for label in limits.watch(labels) {
        let label = label?;
        let with = designs.iter().enumerate().filter_map(|(position, choice)| label.with(position, choice));
        for new in limits.watch(with.chain([label.without()])) {
            let new = new?;
            let is_worse = |old: &Label| old.worth(&new).is_ge() && old.is_as_free(&new);
            if !fits(&new, least, budgets) || next.iter().any(is_worse) {
                continue;
            }
            next.retain(|old| !(new.worth(old).is_gt() && new.is_as_free(old)));
            next.push(new);
        }
    }
    Ok(next)
}

/// The best label, completed by the first design that fits for each function that is left.
fn completed(
    labels: &[Label],
    functions: &[Vec<DesignChoice>],
    from: usize,
    least: &[Vec<BigRational>],
    budgets: &[BigRational],
) -> Chosen {
    let best = labels.iter().reduce(|best, other| if other.worth(best).is_gt() { other } else { best });
    let mut label = best.cloned().unwrap_or_default();
    for (designs, least) in functions.iter().zip(least).skip(from) {
        let mut with =
            designs.iter().enumerate().filter_map(|(position, choice)| label.with(position, choice));
        label = with.find(|new| fits(new, least, budgets)).unwrap_or_else(|| label.without());
    }
    Chosen { designs: label.designs, utility: label.utility, optimal: false }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::tests::random::Random;

    fn number(value: i64) -> BigRational {
        BigRational::from_integer(value.into())
    }

    /// Functions served, requirements missed, utility.
    type Worth = (usize, std::cmp::Reverse<usize>, BigRational);

    /// All choices, the preferred ones first; the first of the best ones.
    fn by_enumeration(
        functions: &[Vec<DesignChoice>],
        budgets: &[BigRational],
    ) -> (Worth, Vec<Option<usize>>) {
        let mut all: Vec<Vec<Option<usize>>> = vec![Vec::new()];
        for designs in functions {
            let choices = || (0..designs.len()).map(Some).chain([None]);
            all = all
                .iter()
                .flat_map(|known| choices().map(|own| [known.clone(), vec![own]].concat()))
                .collect();
        }
        let mut best: Option<(Worth, Vec<Option<usize>>)> = None;
        for designs in all {
            let chosen: Vec<&DesignChoice> =
                functions.iter().zip(&designs).filter_map(|(own, at)| at.map(|at| &own[at])).collect();
            let used: usize = chosen.iter().map(|own| own.components.len()).sum();
            let different: BTreeSet<usize> = chosen.iter().flat_map(|own| own.components.clone()).collect();
            let spent =
                |budget: usize| chosen.iter().map(|own| own.demands[budget].clone()).sum::<BigRational>();
            if used > different.len() || (0..budgets.len()).any(|budget| spent(budget) > budgets[budget]) {
                continue;
            }
            let missed: usize = chosen.iter().map(|own| own.missed).sum();
            let utility = chosen.iter().map(|own| own.utility.clone()).sum::<BigRational>();
            let worth = (chosen.len(), std::cmp::Reverse(missed), utility);
            if best.as_ref().is_none_or(|(known, _)| worth > *known) {
                best = Some((worth, designs));
            }
        }
        best.expect("nothing at all is a choice")
    }

    fn random(random: &mut Random) -> (Vec<Vec<DesignChoice>>, Vec<BigRational>) {
        let budgets: Vec<BigRational> = (0..random.below(3)).map(|_| number(random.below(9))).collect();
        let functions = (0..=random.below(4)).map(|_| {
            let design = |random: &mut Random| DesignChoice {
                missed: random.below(2) as usize,
                utility: number(random.below(4) - 1),
                demands: budgets.iter().map(|_| number(random.below(6) - 1)).collect(),
                components: (0..random.below(3)).map(|_| random.below(4) as usize).collect(),
            };
            (0..random.below(4)).map(|_| design(random)).collect()
        });
        (functions.collect(), budgets.clone())
    }

    #[test]
    fn the_best_choice_is_that_of_an_enumeration() {
        let mut draw = Random(7);
        let mut partly = 0;
        for round in 0..3000 {
            let (functions, budgets) = random(&mut draw);
            let chosen = configure(&functions, &budgets, &Limits::none());
            // Where less than nothing is left, nothing is chosen at all.
            if budgets.iter().any(|budget| *budget < BigRational::zero()) {
                continue;
            }
            let ((served, _, utility), designs) = by_enumeration(&functions, &budgets);
            assert!(chosen.optimal);
            assert_eq!(
                (chosen.designs, chosen.utility),
                (designs, utility),
                "round {round}: {functions:?} {budgets:?}"
            );
            partly += usize::from(served < functions.len());
        }
        assert!((300..2700).contains(&partly), "the choices are of one kind: {partly}");
    }

    #[test]
    fn a_limit_leaves_a_choice_that_is_allowed() {
        let item = |utility: i64, demand: i64| DesignChoice {
            missed: 0,
            utility: number(utility),
            demands: vec![number(demand)],
            components: BTreeSet::new(),
        };
        let functions = vec![vec![item(9, 5), item(1, 1)], vec![item(9, 5), item(2, 1)]];
        let chosen = configure(&functions, &[number(6)], &Limits::none().with_time(Duration::ZERO));
        assert_eq!(chosen, Chosen { designs: vec![Some(0), Some(1)], utility: number(11), optimal: false });
        let chosen = configure(&functions, &[number(6)], &Limits::none());
        assert_eq!((chosen.designs, chosen.optimal), (vec![Some(0), Some(1)], true));
    }
}
