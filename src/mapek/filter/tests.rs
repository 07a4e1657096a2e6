//! Tests of the filters against their definitions: oracles evaluate the whole history of samples, without incremental
//! state.

use std::time::Duration;

use fastrand::Rng;
use num_rational::BigRational;
use ontology::tomasys::change::Status;

use super::attribute::{AttributeFilter, AttributeState, Bound, Elapsed, Hold, Side, Stale, Verdict};
use super::component::{ComponentFilter, ComponentState};
use super::{FilterSettings, Filters, MeasuredSettings};

fn value(thousandths: i64) -> BigRational {
    BigRational::new(thousandths.into(), 1000.into())
}

fn bound(thousandths: i64, side: Side, band: i64) -> Bound {
    Bound { value: value(thousandths), side, band: value(band) }
}

/// Returns `true` if a bound with hysteresis counts as satisfied after the samples. The last sample that violates the
/// bound, or satisfies it by at least its band, is decisive. Without such a sample, the first sample is decisive.
fn is_kept(bound: &Bound, samples: &[BigRational]) -> bool {
    let decisive = samples.iter().rev().find(|sample| !bound.keeps(sample) || bound.keeps_clearly(sample));
    bound.keeps(decisive.unwrap_or(&samples[0]))
}

fn random_bounds(random: &mut Rng, sides: &[Side]) -> Vec<Bound> {
    let count = random.i64(1..=4);
    (0..count)
        .map(|at| bound(200 + 200 * at, sides[random.usize(..sides.len())], random.i64(0..90)))
        .collect()
}

fn random_sample(random: &mut Rng, bounds: &[Bound]) -> BigRational {
    if random.bool() {
        return value(random.i64(0..1200));
    }
    let bound = &bounds[random.usize(..bounds.len())];
    &bound.value + value(random.i64(-120..=120))
}

#[test]
fn bounds_are_independent_triggers() {
    let mut random = Rng::with_seed(1);
    for _ in 0..3_000 {
        let bounds = random_bounds(&mut random, &[Side::Least, Side::Most]);
        let filter = AttributeFilter { bounds: bounds.clone(), ..AttributeFilter::default() };
        let (mut state, mut samples, mut believed) = (AttributeState::default(), Vec::new(), None);
        for now in 0..30 {
            samples.push(random_sample(&mut random, &bounds));
            if let Verdict::Accepted(value) = filter.sample(&mut state, now, &samples[samples.len() - 1]) {
                believed = Some(value);
            }
            let current = believed.as_ref().expect("the first sample is believed");
            for bound in &bounds {
                assert_eq!(
                    bound.keeps(current),
                    is_kept(bound, &samples),
                    "{bounds:?} {samples:?} {current}"
                );
                // A filter never makes a design available that the sample makes unavailable.
                assert!(bound.keeps(&samples[samples.len() - 1]) || !bound.keeps(current));
            }
        }
    }
}

#[test]
fn noise_within_the_band_crosses_at_most_once() {
    let mut random = Rng::with_seed(2);
    for _ in 0..2_000 {
        let mut bounds = vec![bound(800, Side::Most, 16), bound(800, Side::Least, 16)];
        bounds.truncate(random.usize(1..=2));
        let filter = AttributeFilter { bounds: bounds.clone(), ..AttributeFilter::default() };
        let mut state = AttributeState::believing(Some(value(if random.bool() { 500 } else { 900 })));
        let mut cells = vec![];
        for now in 0..40 {
            let sample = value(800 + random.i64(-15..=15));
            if let Verdict::Accepted(value) = filter.sample(&mut state, now, &sample) {
                cells.push(bounds.iter().map(|bound| bound.keeps(&value)).collect::<Vec<_>>());
            }
        }
        cells.dedup();
        assert!(cells.len() <= 2, "{bounds:?} {cells:?}");
        // A sample far beyond the bound counts at once.
        for far in [500, 900] {
            let Verdict::Accepted(value) = filter.sample(&mut state, 50, &value(far)) else {
                panic!("{far} is held")
            };
            assert_eq!(value, self::value(far));
        }
    }
}

#[test]
fn a_bound_in_the_settings_has_the_direction_of_its_key() {
    let ninety = || vec![value(90_000)];
    let settings = [
        MeasuredSettings { upper_bounds: ninety(), ..MeasuredSettings::default() },
        MeasuredSettings { lower_bounds: ninety(), ..MeasuredSettings::default() },
        MeasuredSettings { bounds: ninety(), ..MeasuredSettings::default() },
    ];
    // The band is 1.8. `None` is a sample that is held back.
    let samples = [85, 91, 92, 89, 88];
    let believed = [
        [Some(85), Some(91), Some(92), None, Some(88)],
        [Some(85), None, Some(92), Some(89), Some(88)],
        [Some(85), None, Some(92), None, Some(88)],
    ];
    for (measured, believed) in settings.into_iter().zip(believed) {
        let mut settings = FilterSettings::default();
        settings.measured.insert("humidity".to_owned(), measured);
        let filters = Filters::new(&settings, None);
        let mut states = filters.states(None);
        for (sample, expected) in samples.into_iter().zip(believed) {
            let sample = value(1000 * sample);
            let result = filters.sample(&mut states, Duration::ZERO, "humidity", &sample, &mut Vec::new());
            assert_eq!(result, expected.map(|number| value(1000 * number)), "{sample}: {settings:?}");
        }
    }
}

/// Times, in the unit of the filter's times, with samples in thousandths; `None` for a tick.
type History = Vec<(u64, Option<i64>)>;

/// Value in thousandths that is believed at the end of a history, computed from the definition of debouncing for each
/// bound on its own. A bound changes as soon as all samples of the last `debounce`, and at least `agree` of the last
/// `of` counted samples, lie on its other side. Samples count since the last change after which the latest sample
/// crossed no bound. Of the samples that lie in the cell with these changes, the latest one is believed.
fn believed(history: &History, bounds: &[i64], debounce: u64, agree: usize, of: usize) -> i64 {
    let samples: Vec<(u64, i64)> =
        history.iter().filter_map(|(time, sample)| sample.map(|sample| (*time, sample))).collect();
    let mut current = samples[0].1;
    let end = history.last().map_or(0, |(time, _)| *time);
    // Samples before a change of the believed value do not agree with later ones.
    let mut first_counted = 0;
    for now in 0..=end {
        // The debounce time of earlier samples may end now, before a sample at the same time counts.
        for inclusive in [false, true] {
            let past: Vec<(u64, i64)> = samples
                .iter()
                .copied()
                .filter(|(time, _)| *time < now || (inclusive && *time == now))
                .collect();
            let Some((_, last)) = past.last().copied() else { continue };
            let crosses = |bound: i64, sample: i64| (sample > bound) != (current > bound);
            let changed: Vec<i64> = bounds
                .iter()
                .copied()
                .filter(|bound| {
                    let run = past.iter().rev().take_while(|(_, sample)| crosses(*bound, *sample));
                    let Some((since, _)) = run.last() else { return false };
                    let counted = past.iter().skip(first_counted).rev().take(of.max(agree).max(1));
                    let agreeing = counted.filter(|(_, sample)| crosses(*bound, *sample)).count();
                    now - since >= debounce && (agree <= 1 || agreeing >= agree)
                })
                .collect();
            if bounds.iter().all(|bound| !crosses(*bound, last)) {
                current = last;
            } else if !changed.is_empty() {
                let is_in_cell = |sample: &i64| {
                    bounds.iter().all(|bound| crosses(*bound, *sample) == changed.contains(bound))
                };
                let latest = past.iter().rev().map(|(_, sample)| *sample).find(is_in_cell);
                current = latest.expect("a sample that crosses the changed bounds only");
                // Those that have crossed farther bounds still count for these.
                if bounds.iter().all(|bound| (last > *bound) == (current > *bound)) {
                    first_counted = past.len();
                }
            }
        }
    }
    current
}

#[test]
fn debounce_matches_its_definition_with_and_without_ticks() {
    let mut random = Rng::with_seed(3);
    for round in 0..3_000 {
        let (debounce, of) = (random.u64(0..6), random.usize(0..5));
        let agree = random.usize(0..=of);
        let bounds = &[500, 700, 300][..random.usize(1..=3)];
        let filter = AttributeFilter {
            bounds: bounds.iter().map(|value| bound(*value, Side::Most, 0)).collect(),
            debounce,
            agree,
            of,
            ..AttributeFilter::default()
        };
        let mut history: History = vec![(0, Some(400))];
        for _ in 0..random.usize(1..25) {
            let time = history[history.len() - 1].0 + random.u64(1..4);
            history.push((time, Some(200 * random.i64(1..=4) + random.i64(0..50))));
        }
        let end = history[history.len() - 1].0 + 10;
        let mut results = Vec::new();
        for ticks in [false, true] {
            let (mut state, mut current) = (AttributeState::default(), None);
            let mut next = 0;
            for now in 0..=end {
                let sample = history.get(next).filter(|(time, _)| *time == now);
                if !ticks && sample.is_none() && now != end {
                    continue;
                }
                while let Some(Elapsed::Accepted(value)) = filter.elapse(&mut state, now) {
                    current = Some(value);
                }
                if let Some((_, Some(sample))) = sample {
                    next += 1;
                    if let Verdict::Accepted(value) = filter.sample(&mut state, now, &value(*sample)) {
                        current = Some(value);
                    }
                }
                let record = state.to_record();
                assert_eq!(AttributeState::from_record(&record).as_ref(), Some(&state), "{record}");
            }
            results.push(current.expect("the first sample is believed"));
            assert_eq!(filter.due(&state), None, "nothing is due at the end unless samples are missing");
        }
        let mut whole = history.clone();
        whole.push((end, None));
        let expected = value(believed(&whole, bounds, debounce, agree, of));
        let in_cell =
            |value: &BigRational| filter.bounds.iter().map(|bound| bound.keeps(value)).collect::<Vec<_>>();
        assert_eq!(
            results.iter().map(in_cell).collect::<Vec<_>>(),
            [in_cell(&expected), in_cell(&expected)],
            "round {round}: {bounds:?} {debounce} {agree}/{of} {history:?}"
        );
        if bounds.len() == 1 {
            assert_eq!(results, [expected.clone(), expected], "round {round}");
        }
    }
}

#[test]
fn outliers_do_not_cross_further_bounds() {
    let bounds = [1250, 2250, 3250].map(|value| bound(value, Side::Least, 0)).to_vec();
    let debounced = AttributeFilter { bounds: bounds.clone(), debounce: 50, ..AttributeFilter::default() };
    let agreeing = AttributeFilter { bounds, agree: 4, of: 5, ..AttributeFilter::default() };
    for filter in [debounced, agreeing] {
        let mut state = AttributeState::believing(Some(value(3500)));
        for (now, sample) in [(10, 3100), (20, 3100), (30, 3100)] {
            assert_eq!(filter.sample(&mut state, now, &value(sample)), Verdict::Held(Hold::Debounce));
        }
        let verdict = filter.sample(&mut state, 59, &value(500));
        let believed = match filter.elapse(&mut state, 60) {
            Some(Elapsed::Accepted(believed)) => believed,
            _ => match verdict {
                Verdict::Accepted(believed) => believed,
                Verdict::Held(hold) => panic!("{hold:?}"),
            },
        };
        assert_eq!(believed, value(3100));
    }
}

#[test]
fn implausible_samples_are_ignored_until_they_are_confirmed() {
    let filter = AttributeFilter {
        minimum: Some(value(0)),
        maximum: Some(value(2000)),
        jump: Some(value(100)),
        ..AttributeFilter::default()
    };
    let mut state = AttributeState::default();
    let mut check = |now, sample: i64, is_accepted: bool| {
        let verdict = filter.sample(&mut state, now, &value(sample));
        assert_eq!(verdict == Verdict::Accepted(value(sample)), is_accepted, "{sample}: {verdict:?}");
    };
    check(0, 500, true);
    check(1, -1, false);
    check(2, 2001, false);
    check(3, 900, false);
    check(4, 510, true);
    check(5, 900, false);
    check(6, 950, true);
    check(7, 500, false);
    check(8, 1200, false);
    check(9, 1000, true);
}

#[test]
fn silence_is_reported_once_after_the_period() {
    let mut random = Rng::with_seed(4);
    for stale in [Stale::Keep, Stale::Unknown, Stale::Worst] {
        for _ in 0..500 {
            let filter = AttributeFilter {
                bounds: vec![bound(500, Side::Most, 10), bound(700, Side::Most, 10)],
                period: Some(random.u64(1..6)),
                stale,
                ..AttributeFilter::default()
            };
            let period = filter.period.expect("there is one");
            let mut state = AttributeState::default();
            AttributeFilter::begin(&mut state, 0);
            let (mut last_sample, mut silent) = (0, false);
            for now in 0..60 {
                let due = filter.due(&state);
                let elapsed = filter.elapse(&mut state, now);
                let is_new = !silent && now > last_sample + period;
                assert_eq!(elapsed.is_some(), is_new, "{now} {last_sample} {period}");
                assert_eq!(due.is_some_and(|due| due <= now), is_new);
                if let Some(Elapsed::Silent(worst)) = &elapsed {
                    let is_worst = worst.as_ref().is_some_and(|worst| *worst > value(700));
                    assert_eq!(is_worst, stale == Stale::Worst);
                }
                silent |= is_new;
                assert_eq!(filter.elapse(&mut state, now), None, "once");
                if random.u32(..4) == 0 {
                    filter.sample(&mut state, now, &value(400));
                    (last_sample, silent) = (now, false);
                }
            }
        }
    }
}

#[test]
fn the_first_sample_after_a_withdrawal_is_believed() {
    let filter = AttributeFilter {
        bounds: vec![bound(800, Side::Most, 16)],
        debounce: 5,
        period: Some(2),
        stale: Stale::Unknown,
        ..AttributeFilter::default()
    };
    for (sample, is_kept) in [(795, false), (500, true)] {
        let mut state = AttributeState::believing(Some(value(900)));
        AttributeFilter::begin(&mut state, 0);
        assert_eq!(filter.elapse(&mut state, 5), Some(Elapsed::Silent(None)));
        let Verdict::Accepted(believed) = filter.sample(&mut state, 6, &value(sample)) else {
            panic!("{sample} is held")
        };
        // The bound still has its hysteresis.
        assert_eq!(filter.bounds[0].keeps(&believed), is_kept, "{sample}: {believed}");
    }
    let mut state = AttributeState::believing(Some(value(900)));
    assert_eq!(filter.sample(&mut state, 1, &value(795)), Verdict::Held(Hold::Hysteresis));
}

#[test]
fn the_worst_value_keeps_the_fewest_bounds() {
    let mut random = Rng::with_seed(5);
    for _ in 0..1_000 {
        let bounds = random_bounds(&mut random, &[Side::Least, Side::Most]);
        let filter = AttributeFilter { bounds: bounds.clone(), ..AttributeFilter::default() };
        let worst = filter.worst().expect("there are bounds");
        let kept_count = |value: &BigRational| bounds.iter().filter(|bound| bound.keeps(value)).count();
        let minimum = (-100..1500).map(|sample| kept_count(&value(sample))).min();
        assert_eq!(Some(kept_count(&worst)), minimum, "{bounds:?}");
        // Only plausible values count.
        let (low, high) = (random.i64(0..1200), random.i64(0..300));
        let (minimum, maximum) = (Some(value(low)), Some(value(low + high)));
        let worst = AttributeFilter { minimum, maximum, ..filter }.worst().expect("there are bounds");
        let minimum = (low..=low + high).map(|sample| kept_count(&value(sample))).min();
        assert_eq!(Some(kept_count(&worst)), minimum, "{bounds:?} {low} {high}");
    }
}

#[test]
fn a_component_changes_after_reports_agree_for_the_confirmation_time() {
    let mut random = Rng::with_seed(6);
    for round in 0..3_000 {
        let filter = ComponentFilter { confirm: random.u64(0..3), heal: random.u64(0..6) };
        let (mut state, mut has_failed) = (ComponentState::default(), false);
        let mut reports: Vec<(u64, bool)> = Vec::new();
        let mut expected = false;
        for now in 0..50 {
            // By definition, a change is believed if all reports of the confirmation time differ from the current
            // belief.
            let is_ripe = |reports: &[(u64, bool)], believed: bool| {
                let run = reports.iter().rev().take_while(|(_, fails)| *fails != believed);
                let since = run.last().map(|(time, _)| *time);
                since.is_some_and(|since| now - since >= if believed { filter.heal } else { filter.confirm })
            };
            let was_due = filter.due(&state).is_some_and(|due| due <= now);
            if is_ripe(&reports, expected) {
                expected = !expected;
                reports.clear();
                assert!(was_due, "round {round} at {now}");
            }
            if let Some(status) = filter.elapse(&mut state, now) {
                has_failed = status == Status::Failed;
            }
            if random.u32(..2) == 0 {
                let status = [Status::Failed, Status::Working, Status::Recovered][random.usize(..3)];
                let fails = status == Status::Failed;
                reports.push((now, fails));
                if is_ripe(&reports, expected) {
                    expected = !expected;
                    reports.clear();
                }
                if filter.report(&mut state, now, status) {
                    has_failed = fails;
                }
            }
            assert_eq!(has_failed, expected, "round {round} at {now}: {filter:?} {reports:?}");
        }
    }
}

#[test]
fn a_restored_filter_has_the_same_state() {
    let mut random = Rng::with_seed(7);
    for _ in 0..500 {
        let bounds = random_bounds(&mut random, &[Side::Least, Side::Most]);
        let filter = AttributeFilter {
            bounds: bounds.clone(),
            agree: random.usize(0..3),
            of: 3,
            debounce: random.u64(0..4),
            jump: random.bool().then(|| value(300)),
            period: random.bool().then_some(3),
            ..AttributeFilter::default()
        };
        let (mut whole, mut cut) = (AttributeState::default(), AttributeState::default());
        for now in 0..40 {
            cut = AttributeState::from_record(&cut.to_record()).expect("it is read");
            assert_eq!(cut, whole);
            assert_eq!(filter.elapse(&mut whole, now), filter.elapse(&mut cut, now));
            if random.bool() {
                let sample = random_sample(&mut random, &bounds);
                assert_eq!(filter.sample(&mut whole, now, &sample), filter.sample(&mut cut, now, &sample));
            }
        }
    }
    assert_eq!(super::micros(Duration::from_secs(2)), 2_000_000);
}

#[test]
fn comparison_agrees_with_that_of_rationals() {
    let mut random = Rng::with_seed(11);
    let number = |random: &mut Rng| {
        // Integers below and beyond 64 bits.
        let wide = 1_i128 << random.u32(0..100);
        BigRational::new(random.i128(-wide..=wide).into(), random.i128(1..=wide).into())
    };
    for _ in 0..20_000 {
        let first = number(&mut random);
        let second = if random.u8(0..4) == 0 { first.clone() } else { number(&mut random) };
        assert_eq!(super::attribute::compare(&first, &second), first.cmp(&second), "{first} {second}");
    }
}
