//! Optimal selection of designs without a plan, for functions that compete for components or share budgets.
//!
//! The best assignment serves as many functions as possible, then violates the fewest requirements, and then has
//! the greatest sum of utilities. Ties are broken in favour of earlier designs of earlier functions. The three
//! criteria are combined into one integer, the *worth* of an assignment: an additional served function outweighs
//! all requirements, and one requirement outweighs all utilities. A component that only one design can use is
//! modelled as a budget of 1. A design that several functions select consumes budgets once.
//!
//! The algorithm is dynamic programming over the functions with dominance pruning. A partial assignment is dominated
//! if another one for these functions consumes no more of any budget and has a greater worth. At equal worth, the
//! other one must also be preferred. It must also be able to pay for the shared designs that only the dominated one
//! has paid for; if such a design has a negative demand, both must have selected the same shared designs. A
//! partial assignment is also pruned if a budget does not even suffice for the minimum consumption of the remaining
//! functions. So is one with an upper bound on its completions that is less than the best known worth. This upper bound
//! is a Lagrangian relaxation of the budgets, which is valid for any non-negative multipliers \[1\]. A subgradient
//! method computes good multipliers in floating-point arithmetic \[2\]. The multipliers are then rounded, and the bound
//! is evaluated exactly.
//!
//! - \[1\] H. Everett: Generalized Lagrange Multiplier Method for Solving Problems of Optimum Allocation of
//!   Resources, Operations Research 11(3), 1963.
//! - \[2\] M. Held, R. M. Karp: The Traveling-Salesman Problem and Minimum Spanning Trees: Part II,
//!   Mathematical Programming 1, 1971.

use std::collections::{BTreeMap, BTreeSet};

use num_bigint::BigInt;
use num_integer::Integer as _;
use num_rational::BigRational;
use num_traits::{One as _, Signed as _, ToPrimitive as _, Zero as _};

use task::limits::{Interrupted, Limits};

const ROUNDS: usize = 300;
/// Number of fractional bits of the Lagrangian multipliers.
const PRICE_BITS: i32 = 40;

/// A design that a function can use.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DesignChoice {
    /// Number of the function's requirements that the design violates.
    pub missed: usize,
    /// Utility of the design; higher is better.
    pub utility: BigRational,
    /// Consumption of each budget by the design, in the order of the budgets. Missing entries are 0; negative
    /// ones add to the budget.
    pub demands: Vec<BigRational>,
    /// Exclusive components that the design uses, numbered by the caller. At most one selected design may use
    /// each component.
    pub components: BTreeSet<usize>,
    /// Number of the design, if several functions can select it. Choices with one number have equal demands and
    /// components. If several of them are selected, they count as one design.
    pub identity: Option<usize>,
}

/// An assignment of designs to functions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// For each function: the index of its selected design, or `None` if the function is not served.
    pub designs: Vec<Option<usize>>,
    /// Sum of the utilities of the selected designs.
    pub utility: BigRational,
    /// `true` if the assignment is proved optimal, or if it is proved that none respects the budgets; `false` if a
    /// limit was reached first.
    pub optimal: bool,
}

/// Computes the best assignment of designs to functions that respects the budgets and uses each exclusive component
/// by at most one design. The best assignment serves the most functions, then violates the fewest requirements, then has
/// the greatest utility; among equals, earlier designs are preferred. At a limit, returns the best known assignment. If
/// no assignment that respects the budgets is found, no design is selected.
pub fn configure(functions: &[Vec<DesignChoice>], budgets: &[BigRational], limits: &Limits) -> Assignment {
    let problem = Problem::new(functions, budgets);
    let (prices, incumbent) = problem.prices(limits);
    let (designs, optimal) = match problem.search(&prices, &incumbent, limits) {
        Ok(designs) => (designs, true),
        Err(Interrupted) => (incumbent.designs, false),
    };
    let chosen = functions
        .iter()
        .zip(&designs)
        .filter_map(|(designs, index)| index.and_then(|index| designs.get(index)));
    let utility = chosen.map(|design| &design.utility).sum();
    Assignment { designs, utility, optimal }
}

struct Item {
    worth: BigInt,
    demands: Vec<BigInt>,
    /// Identity of the design, if several functions can select it.
    shared: Option<usize>,
}

struct Problem {
    functions: Vec<Vec<Item>>,
    budgets: Vec<BigInt>,
    /// For each function: the minimum consumption of each budget by this and all later functions;
    /// at the end 0.
    least: Vec<Vec<BigInt>>,
    /// The first and the last function of each design that several functions can select, by identity.
    shared: BTreeMap<usize, (usize, usize)>,
}

/// The selected designs of the functions up to some index.
#[derive(Clone, Default)]
struct Label {
    designs: Vec<Option<usize>>,
    worth: BigInt,
    spent: Vec<BigInt>,
    /// Identities of the selected designs that further functions can select.
    shared: BTreeSet<usize>,
}

impl Label {
    fn with(&self, position: Option<usize>, item: Option<&Item>) -> Self {
        let mut label = self.clone();
        label.designs.push(position);
        if let Some(item) = item {
            label.worth += &item.worth;
            if item.shared.is_none_or(|design| label.shared.insert(design)) {
                label.spent.iter_mut().zip(&item.demands).for_each(|(spent, demand)| *spent += demand);
            }
        }
        label
    }

    /// Returns `true` if each completion of `other` that respects the budgets is also one of this label. `demands` are
    /// the demands of the shared designs; `None` if one is negative, from which only its first selection gains.
    fn is_as_free(&self, other: &Self, demands: Option<&BTreeMap<usize, Vec<BigInt>>>) -> bool {
        let fits = |spent: &[BigInt]| spent.iter().zip(&other.spent).all(|(spent, allowed)| spent <= allowed);
        let Some(demands) = demands else { return self.shared == other.shared && fits(&self.spent) };
        if !fits(&self.spent) {
            return false;
        }
        // This label may still have to pay for designs that the other one has paid for.
        let mut spent = self.spent.clone();
        for demands in other.shared.difference(&self.shared).filter_map(|design| demands.get(design)) {
            spent.iter_mut().zip(demands).for_each(|(spent, demand)| *spent += demand);
        }
        fits(&spent)
    }
}

/// Lagrangian multipliers (prices) of the budgets, and upper bounds on the worth after paying these
/// prices, in units of 2^-`PRICE_BITS`.
struct LagrangeMultipliers {
    each: Vec<BigInt>,
    /// For each function: the greatest sum of reduced worths (worth minus priced demands) of this
    /// and all later functions, where each contributes at least 0; at the end 0.
    after: Vec<BigInt>,
}

fn scaled<'a>(numbers: impl Iterator<Item = &'a BigRational> + Clone) -> (Vec<BigInt>, BigInt) {
    let scale = numbers.clone().fold(BigInt::one(), |scale, number| scale.lcm(number.denom()));
    (numbers.map(|number| (number * &scale).to_integer()).collect(), scale)
}

impl Problem {
    fn new(functions: &[Vec<DesignChoice>], budgets: &[BigRational]) -> Self {
        let all_designs = || functions.iter().flatten();
        let (utilities, _) = scaled(all_designs().map(|design| &design.utility));
        // Utilities may be negative. A requirement outweighs the difference of any two sums of utilities.
        let requirement: BigInt = utilities.iter().map(BigInt::abs).sum::<BigInt>() * 2 + 1;
        let function = &requirement * all_designs().map(|design| BigInt::from(design.missed)).sum::<BigInt>()
            + &requirement;
        let mut worths = all_designs()
            .zip(utilities)
            .map(|(design, utility)| &function - &requirement * design.missed + utility);
        let components: BTreeSet<usize> =
            all_designs().flat_map(|design| design.components.iter().copied()).collect();
        let zero = BigRational::zero();
        let demand =
            |design: &'_ DesignChoice, budget: usize| design.demands.get(budget).unwrap_or(&zero).clone();
        let mut columns = Vec::new();
        let mut whole = Vec::new();
        for (budget, most) in budgets.iter().enumerate() {
            let numbers: Vec<BigRational> =
                all_designs().map(|design| demand(design, budget)).chain([most.clone()]).collect();
            let (mut column, _) = scaled(numbers.iter());
            whole.push(column.pop().unwrap_or_default());
            columns.push(column.into_iter());
        }
        for component in components {
            let uses =
                all_designs().map(|design| BigInt::from(u8::from(design.components.contains(&component))));
            columns.push(uses.collect::<Vec<_>>().into_iter());
            whole.push(BigInt::one());
        }
        let mut shared: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
        for (at, designs) in functions.iter().enumerate() {
            for design in designs.iter().filter_map(|design| design.identity) {
                shared.entry(design).or_insert((at, at)).1 = at;
            }
        }
        shared.retain(|_, (first, last)| first < last);
        let mut item = |design: &DesignChoice| {
            let demands: Vec<BigInt> =
                columns.iter_mut().map(|column| column.next().unwrap_or_default()).collect();
            // It does not matter whether a design that consumes nothing has been selected before.
            let consumes = demands.iter().any(|demand| !demand.is_zero());
            let shared = design.identity.filter(|design| consumes && shared.contains_key(design));
            Item { shared, worth: worths.next().unwrap_or_default(), demands }
        };
        let functions: Vec<Vec<Item>> =
            functions.iter().map(|designs| designs.iter().map(&mut item).collect()).collect();
        let mut least = vec![vec![BigInt::zero(); whole.len()]];
        for designs in functions.iter().rev() {
            let after = least.last().cloned().unwrap_or_default();
            let least_here = after.into_iter().enumerate().map(|(budget, after)| {
                let demands = designs.iter().filter_map(|design| design.demands.get(budget));
                // A function that is not served consumes nothing.
                after + demands.min().cloned().unwrap_or_default().min(BigInt::zero())
            });
            let least_here = least_here.collect();
            least.push(least_here);
        }
        least.reverse();
        Self { functions, budgets: whole, least, shared }
    }

    fn nothing(&self) -> Label {
        Label { spent: vec![BigInt::zero(); self.budgets.len()], ..Label::default() }
    }

    /// Returns `true` if each budget, considered separately, suffices for the label and the minimum
    /// consumption of the functions from index `from` on.
    fn fits(&self, label: &Label, from: usize) -> bool {
        let Some(least) = self.least.get(from) else { return true };
        let ahead = label.spent.iter().zip(least).map(|(spent, least)| spent + least);
        ahead.zip(&self.budgets).all(|(spent, budget)| spent <= *budget)
    }

    /// Assigns to each function in turn the most preferred design that leaves enough of each budget, if there is
    /// one. If the result violates a budget, no function is served.
    fn greedy(&self, preference: impl Fn(&Item) -> f64) -> Label {
        let mut label = self.nothing();
        for (at, designs) in self.functions.iter().enumerate() {
            let mut order: Vec<(usize, f64)> = designs.iter().map(&preference).enumerate().collect();
            order.sort_by(|a, b| b.1.total_cmp(&a.1));
            let mut extended =
                order.into_iter().map(|(position, _)| label.with(Some(position), designs.get(position)));
            let feasible = extended.find(|new| self.fits(new, at.saturating_add(1)));
            label = feasible.unwrap_or_else(|| label.with(None, None));
        }
        // A later function with negative consumption may not be served, so feasibility is checked again.
        if self.fits(&label, self.functions.len()) {
            return label;
        }
        self.functions.iter().fold(self.nothing(), |label, _| label.with(None, None))
    }

    /// Computes multipliers by a subgradient method. Also returns the best assignment found by greedy selection
    /// along the way. At a limit, the multipliers are valid, but the bounds may be weak.
    #[expect(clippy::cast_possible_truncation, reason = "rounding is meant; bounds hold for whatever prices")]
    fn prices(&self, limits: &Limits) -> (LagrangeMultipliers, Label) {
        let float = |number: &BigInt| number.to_f64().unwrap_or(f64::MAX);
        let budgets: Vec<f64> = self.budgets.iter().map(float).collect();
        let mut incumbent = self.greedy(|item| float(&item.worth));
        let mut prices = vec![0.0_f64; budgets.len()];
        let mut best = (f64::INFINITY, prices.clone());
        let mut stride = 1.0;
        for _ in limits.watch(0..ROUNDS).map_while(Result::ok) {
            let reduced = |item: &Item| {
                let paid: f64 =
                    item.demands.iter().zip(&prices).map(|(demand, price)| float(demand) * price).sum();
                float(&item.worth) - paid
            };
            let (mut bound, mut slack) = (0.0, budgets.clone());
            for designs in &self.functions {
                let chosen =
                    designs.iter().map(|item| (item, reduced(item))).max_by(|a, b| a.1.total_cmp(&b.1));
                let Some((item, worth)) = chosen.filter(|(_, worth)| *worth > 0.0) else { continue };
                bound += worth;
                slack.iter_mut().zip(&item.demands).for_each(|(slack, demand)| *slack -= float(demand));
            }
            bound += budgets.iter().zip(&prices).map(|(budget, price)| budget * price).sum::<f64>();
            let candidate = self.greedy(reduced);
            if candidate.worth > incumbent.worth {
                incumbent = candidate;
            }
            if bound < best.0 {
                best = (bound, prices.clone());
            } else {
                stride *= 0.97;
            }
            let length: f64 = slack.iter().map(|slack| slack * slack).sum();
            if length <= 0.0 {
                break;
            }
            let step = stride * (bound - float(&incumbent.worth)).max(0.0) / length;
            prices
                .iter_mut()
                .zip(&slack)
                .for_each(|(price, slack)| *price = (*price - step * slack).max(0.0));
        }
        let unit = 2.0_f64.powi(PRICE_BITS);
        let each: Vec<BigInt> =
            best.1.iter().map(|price| BigInt::from((price * unit).min(1e30) as i128)).collect();
        let mut after = vec![BigInt::zero()];
        for (at, designs) in self.functions.iter().enumerate().rev() {
            let reduced = designs.iter().map(|item| {
                let paid: BigInt = item.demands.iter().zip(&each).map(|(demand, price)| demand * price).sum();
                let first = item.shared.and_then(|design| self.shared.get(&design)).map(|(first, _)| *first);
                // An earlier function may have paid for the design.
                let is_paid = first.is_some_and(|first| first < at);
                let paid = if is_paid { paid.min(BigInt::zero()) } else { paid };
                (&item.worth << PRICE_BITS) - paid
            });
            let best_value = reduced.max().unwrap_or_default().max(BigInt::zero());
            let sum = after.last().cloned().unwrap_or_default() + best_value;
            after.push(sum);
        }
        after.reverse();
        (LagrangeMultipliers { each, after }, incumbent)
    }

    /// Returns an upper bound on the worth of all completions of a label, in units of
    /// 2^-`PRICE_BITS`. The functions from index `from` on are not assigned yet.
    fn bound(&self, label: &Label, from: usize, prices: &LagrangeMultipliers) -> BigInt {
        let slack = self.budgets.iter().zip(&label.spent).map(|(budget, spent)| budget - spent);
        let paid: BigInt = slack.zip(&prices.each).map(|(slack, price)| slack * price).sum();
        (&label.worth << PRICE_BITS) + paid + prices.after.get(from).cloned().unwrap_or_default()
    }

    /// Dynamic programming over the functions. Prunes partial assignments that cannot reach the worth of
    /// `incumbent`. Returns the designs of `incumbent` if no assignment respects the budgets.
    fn search(
        &self,
        prices: &LagrangeMultipliers,
        incumbent: &Label,
        limits: &Limits,
    ) -> Result<Vec<Option<usize>>, Interrupted> {
        let target: BigInt = &incumbent.worth << PRICE_BITS;
        let items = self.functions.iter().flatten();
        let shared_demands: BTreeMap<usize, Vec<BigInt>> =
            items.filter_map(|item| Some((item.shared?, item.demands.clone()))).collect();
        let has_gain = shared_demands.values().flatten().any(BigInt::is_negative);
        let shared_demands = (!has_gain).then_some(&shared_demands);
        let mut labels = vec![self.nothing()];
        let designs = self.functions.len().saturating_mul(size_of::<Option<usize>>());
        // The digits of a number are stored outside of it.
        let spent = self.budgets.len().saturating_mul(2_usize.saturating_mul(size_of::<BigInt>()));
        let bytes = size_of::<Label>().saturating_add(designs).saturating_add(spent);
        for (from, designs) in (1..).zip(&self.functions) {
            let mut next: Vec<Label> = Vec::new();
            for label in limits.watch(&labels) {
                let label = label?;
                let extensions =
                    designs.iter().enumerate().map(|(at, item)| label.with(Some(at), Some(item)));
                for new in limits.watch(extensions.chain([label.with(None, None)])) {
                    let mut new = new?;
                    new.shared
                        .retain(|design| self.shared.get(design).is_some_and(|(_, last)| *last >= from));
                    let is_worse =
                        |old: &Label| old.worth >= new.worth && old.is_as_free(&new, shared_demands);
                    let is_hopeless = !self.fits(&new, from) || self.bound(&new, from, prices) < target;
                    if is_hopeless || next.iter().any(is_worse) {
                        continue;
                    }
                    // Of equally good labels (partial assignments), the older one is preferred and kept.
                    next.retain(|old| old.worth >= new.worth || !new.is_as_free(old, shared_demands));
                    next.push(new);
                    if next.len().saturating_mul(bytes) > limits.room() {
                        return Err(Interrupted);
                    }
                }
            }
            labels = next;
        }
        // Labels (partial assignments) are generated in order of preference, so the first of several best
        // labels is preferred.
        let best =
            labels.into_iter().reduce(|best, label| if label.worth > best.worth { label } else { best });
        Ok(best.map_or_else(|| incumbent.designs.clone(), |best| best.designs))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use testing::random::Random;

    fn number(value: i64) -> BigRational {
        BigRational::from_integer(value.into())
    }

    type Worth = (usize, std::cmp::Reverse<usize>, BigRational);

    fn by_enumeration(
        functions: &[Vec<DesignChoice>],
        budgets: &[BigRational],
    ) -> (Worth, Vec<Option<usize>>) {
        let mut assignments: Vec<Vec<Option<usize>>> = vec![Vec::new()];
        for designs in functions {
            let choices = || (0..designs.len()).map(Some).chain([None]);
            assignments = assignments
                .iter()
                .flat_map(|prefix| choices().map(|choice| [prefix.clone(), vec![choice]].concat()))
                .collect();
        }
        let mut best: Option<(Worth, Vec<Option<usize>>)> = None;
        for designs in assignments {
            let chosen: Vec<&DesignChoice> = functions
                .iter()
                .zip(&designs)
                .filter_map(|(designs, index)| index.map(|index| &designs[index]))
                .collect();
            let mut identities = BTreeSet::new();
            let is_new =
                |design: &&&DesignChoice| design.identity.is_none_or(|design| identities.insert(design));
            let consumers: Vec<&DesignChoice> = chosen.iter().filter(is_new).copied().collect();
            let used: usize = consumers.iter().map(|design| design.components.len()).sum();
            let different: BTreeSet<usize> =
                consumers.iter().flat_map(|design| design.components.clone()).collect();
            let spent = |budget: usize| {
                consumers.iter().map(|design| design.demands[budget].clone()).sum::<BigRational>()
            };
            if used > different.len() || (0..budgets.len()).any(|budget| spent(budget) > budgets[budget]) {
                continue;
            }
            let missed: usize = chosen.iter().map(|design| design.missed).sum();
            let utility = chosen.iter().map(|design| design.utility.clone()).sum::<BigRational>();
            let worth = (chosen.len(), std::cmp::Reverse(missed), utility);
            if best.as_ref().is_none_or(|(best_worth, _)| worth > *best_worth) {
                best = Some((worth, designs));
            }
        }
        best.expect("nothing at all is a choice")
    }

    fn random(random: &mut Random) -> (Vec<Vec<DesignChoice>>, Vec<BigRational>) {
        let budgets: Vec<BigRational> = (0..random.below(3)).map(|_| number(random.below(9))).collect();
        let design = |random: &mut Random| DesignChoice {
            missed: random.below(2) as usize,
            utility: number(random.below(4) - 1),
            demands: budgets.iter().map(|_| number(random.below(6) - 1)).collect(),
            components: (0..random.below(3)).map(|_| random.below(4) as usize).collect(),
            identity: None,
        };
        let shared: Vec<DesignChoice> =
            (0..2).map(|number| DesignChoice { identity: Some(number), ..design(random) }).collect();
        let functions = (0..=random.below(4)).map(|_| {
            let choice = |random: &mut Random| {
                let new = design(random);
                let DesignChoice { missed, utility, .. } = &new;
                match shared.get(random.below(6) as usize) {
                    Some(design) => {
                        DesignChoice { missed: *missed, utility: utility.clone(), ..design.clone() }
                    }
                    None => new,
                }
            };
            (0..random.below(4)).map(|_| choice(random)).collect()
        });
        (functions.collect(), budgets.clone())
    }

    #[test]
    fn the_assignment_agrees_with_enumeration() {
        let mut draw = Random(7);
        let mut partly = 0;
        for round in 0..3000 {
            let (functions, budgets) = random(&mut draw);
            let chosen = configure(&functions, &budgets, &Limits::none());
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
    fn assignments_are_exact_for_numbers_of_any_magnitude() {
        let mut draw = Random(11);
        let power = |exponent: usize| {
            BigRational::from_integer(BigInt::from(10).pow(u32::try_from(exponent).expect("small")))
        };
        for round in 0..300 {
            let number = |draw: &mut Random| {
                let digits = number(draw.below(1 << 53)) / power(16);
                match draw.below(6) {
                    0 => digits * power(320),
                    1 => digits / power(320),
                    _ => digits,
                }
            };
            let functions: Vec<Vec<DesignChoice>> = (0..=draw.below(3))
                .map(|_| {
                    let design = |draw: &mut Random| DesignChoice {
                        missed: 0,
                        utility: number(draw),
                        demands: vec![number(draw)],
                        ..DesignChoice::default()
                    };
                    (0..=draw.below(3)).map(|_| design(&mut draw)).collect()
                })
                .collect();
            // Budgets that just suffice, or are too small by a minimal amount.
            let sufficient: BigRational = functions
                .iter()
                .filter_map(|designs| designs.first())
                .map(|design| design.demands[0].clone())
                .sum();
            for budget in [sufficient.clone(), sufficient - power(0) / power(640)] {
                let budgets = [budget.max(BigRational::zero())];
                let chosen = configure(&functions, &budgets, &Limits::none());
                let ((_, _, utility), designs) = by_enumeration(&functions, &budgets);
                assert_eq!(
                    (chosen.designs, chosen.utility),
                    (designs, utility),
                    "round {round}: {functions:?} {budgets:?}"
                );
            }
        }
    }

    fn by_amounts(functions: &[Vec<(i64, usize)>], budget: usize) -> (usize, i64) {
        let mut best = vec![(0, 0); budget + 1];
        for designs in functions {
            let with = |amount: usize| {
                let fitting = designs.iter().filter(|(_, demand)| *demand <= amount);
                let worths = fitting.map(|(utility, demand)| {
                    (best[amount - demand].0 + 1, best[amount - demand].1 + utility)
                });
                worths.chain([best[amount]]).max()
            };
            best = (0..=budget).map(|amount| with(amount).expect("one")).collect();
        }
        best[budget]
    }

    #[test]
    fn assignments_of_thousands_of_designs_agree_with_dynamic_programming() {
        let mut draw = Random(5);
        for (count, designs, budget) in [(40, 50, 300), (20, 200, 90), (100, 20, 450), (8, 3, 9)] {
            let functions: Vec<Vec<(i64, usize)>> = (0..count)
                .map(|_| (0..designs).map(|_| (draw.below(1000), 1 + draw.below(30) as usize)).collect())
                .collect();
            let item = |(utility, demand): &(i64, usize)| DesignChoice {
                missed: 0,
                utility: number(*utility),
                demands: vec![number(*demand as i64)],
                ..DesignChoice::default()
            };
            let choices: Vec<Vec<DesignChoice>> =
                functions.iter().map(|designs| designs.iter().map(item).collect()).collect();
            let chosen = configure(&choices, &[number(budget)], &Limits::none());
            let (served, utility) = by_amounts(&functions, budget as usize);
            assert!(chosen.optimal);
            assert_eq!((chosen.designs.iter().flatten().count(), chosen.utility), (served, number(utility)));
        }
    }

    #[test]
    fn equal_designs_of_several_objectives_of_one_function_are_no_burden() {
        for has_component in [false, true] {
            let design = |identity| DesignChoice {
                utility: number(1),
                components: has_component.then_some(identity).into_iter().collect(),
                identity: Some(identity),
                ..DesignChoice::default()
            };
            let functions = vec![(0..12).map(design).collect::<Vec<_>>(); 10];
            let limits = Limits::none().with_time(Duration::from_secs(60));
            let chosen = configure(&functions, &[], &limits);
            assert!(chosen.optimal && chosen.utility == number(10), "{has_component}: {chosen:?}");
            assert_eq!(chosen.designs, vec![Some(0); 10]);
        }
    }

    #[test]
    fn a_limit_returns_a_feasible_assignment() {
        let item = |utility: i64, demand: i64| DesignChoice {
            missed: 0,
            utility: number(utility),
            demands: vec![number(demand)],
            ..DesignChoice::default()
        };
        let functions = vec![vec![item(9, 5), item(1, 1)], vec![item(9, 5), item(2, 1)]];
        let chosen = configure(&functions, &[number(6)], &Limits::none().with_time(Duration::ZERO));
        assert_eq!(
            chosen,
            Assignment { designs: vec![Some(0), Some(1)], utility: number(11), optimal: false }
        );
        let chosen = configure(&functions, &[number(6)], &Limits::none());
        assert_eq!((chosen.designs, chosen.optimal), (vec![Some(0), Some(1)], true));
    }

    #[test]
    fn multipliers_and_labels_respect_the_limits() {
        let item = |utility: i64, demand: i64| DesignChoice {
            utility: number(utility),
            demands: vec![number(demand)],
            ..DesignChoice::default()
        };
        let functions = vec![vec![item(9, 5), item(1, 1)], vec![item(9, 5), item(2, 1)]];
        let problem = Problem::new(&functions, &[number(6)]);
        let price = |limits: &Limits| problem.prices(limits).0.each[0].clone();
        assert!(price(&Limits::none()) > BigInt::zero());
        assert_eq!(price(&Limits::none().with_time(Duration::ZERO)), BigInt::zero());
        let chosen = configure(&functions, &[number(6)], &Limits::none().with_room(1));
        assert_eq!((chosen.designs, chosen.optimal), (vec![Some(0), Some(1)], false));
    }
}
