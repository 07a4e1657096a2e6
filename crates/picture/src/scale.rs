//! Linear scales, axis ticks, number formats and text widths.

/// Maximum width in pixels of an ASCII character of the pictures' fixed-width font at 11 pixels.
const CHARACTER: f64 = 6.75;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    from: (f64, f64),
    to: (f64, f64),
}

impl Scale {
    /// Creates a scale. If `from` is a single number, it is widened to length 1.
    pub(crate) fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        let is_point = (from.1 - from.0).abs() < f64::EPSILON * from.0.abs().max(1.0);
        Self { from: if is_point { (from.0, from.0 + 1.0) } else { from }, to }
    }

    pub(crate) fn at(&self, value: f64) -> f64 {
        let part = (value - self.from.0) / (self.from.1 - self.from.0);
        self.to.0 + part * (self.to.1 - self.to.0)
    }

    /// Returns round numbers in the range in ascending order, at most about `most`.
    pub(crate) fn ticks(&self, most: usize) -> Vec<f64> {
        if most == 0 {
            return Vec::new();
        }
        let step = round_step((self.from.1 - self.from.0) / most as f64);
        // The tolerance keeps a tick at the end of the range in spite of rounding.
        let (first, last) = ((self.from.0 / step).ceil(), (self.from.1 / step + 1e-9).floor());
        let count = if last >= first { (last - first) as usize + 1 } else { 0 };
        (0..count.min(1000)).map(|index| (first + index as f64) * step).collect()
    }
}

/// Rounds a positive number up to 1, 2 or 5 times a power of ten.
pub(crate) fn round_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.max(f64::MIN_POSITIVE).log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let enough = factors.into_iter().find(|factor| factor * power >= least * (1.0 - 1e-9));
    enough.unwrap_or(10.0) * power
}

/// Returns the minimum and maximum of the finite numbers, or 0 and 1 if there are no finite
/// numbers.
pub(crate) fn range(numbers: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = numbers.into_iter().filter(|number| number.is_finite());
    let range = finite.fold(None, |range: Option<(f64, f64)>, number| {
        Some(range.map_or((number, number), |(low, high)| (low.min(number), high.max(number))))
    });
    range.unwrap_or((0.0, 1.0))
}

pub(crate) fn px(value: f64) -> String {
    number((value * 10.0).round() / 10.0)
}

/// Formats a number without superfluous zeros, rounded to ten digits in total and at most nine decimals, but
/// never coarser than to an integer.
pub(crate) fn number(value: f64) -> String {
    let digits = 9 - value.abs().max(1.0).log10().floor() as i32;
    let text = format!("{value:.*}", digits.clamp(0, 9) as usize);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    // A tiny negative number rounds to -0.
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

pub(crate) fn compact(value: f64) -> String {
    let text = number(value);
    if text.len() <= 7 { text } else { format!("{value:.1e}") }
}

pub(crate) fn width(text: &str) -> f64 {
    // Characters of East Asian scripts are about twice as wide as ASCII characters. Every character
    // outside of ASCII counts as twice as wide, so the estimate is rather too large.
    text.chars().map(|character| if character.is_ascii() { CHARACTER } else { 2.0 * CHARACTER }).sum()
}

/// Truncates a text with an ellipsis to a width in pixels. The result is empty if the text does not
/// fit and fewer than two of its characters would remain.
pub(crate) fn fit(text: &str, room: f64) -> String {
    if width(text) <= room {
        return text.to_owned();
    }
    let mut short = String::new();
    for character in text.chars() {
        short.push(character);
        if width(&short) + 2.0 * CHARACTER > room {
            short.pop();
            break;
        }
    }
    // A single letter with an ellipsis would not be informative.
    if short.chars().count() < 2 { String::new() } else { short + "…" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_have_round_numbers() {
        let check = |from: (f64, f64), expected: &[f64]| {
            assert_eq!(Scale::new(from, (0.0, 100.0)).ticks(5), expected, "{from:?}");
        };
        check((0.0, 4.0), &[0.0, 1.0, 2.0, 3.0, 4.0]);
        check((0.0, 412.0), &[0.0, 100.0, 200.0, 300.0, 400.0]);
        check((92.0, 100.0), &[92.0, 94.0, 96.0, 98.0, 100.0]);
        check((-1.0, 1.0), &[-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(Scale::new((3.0, 3.0), (0.0, 100.0)).ticks(5).len(), 6, "a point is widened");
    }

    #[test]
    fn texts_are_cut_to_their_room() {
        for (text, room, expected) in
            [("move", 40.0, "move"), ("move wp1 wp2", 50.0, "move …"), ("move", 10.0, "")]
        {
            let short = fit(text, room);
            assert_eq!(short, expected);
            assert!(width(&short) <= room);
        }
        for (value, expected) in [(0.1 + 0.2, "0.3"), (408.0, "408"), (-0.0, "0"), (1e12, "1000000000000")] {
            assert_eq!(number(value), expected);
        }
    }
}
