//! Parses plans: IPC format, temporal plans, and the output of POPF for `PlanSys2`.

use num_rational::BigRational;

use crate::ast::{Name, Span};
use crate::diagnostic::{Errors, Sink};
use crate::number::{Literal, literal};
use crate::source::{Source, place};

/// Plan as written, with its steps in the order of the text.
#[derive(Debug, Clone, Default)]
pub struct PlanText {
    /// Steps in the order of the text.
    pub steps: Vec<PlanStep>,
}

/// One action of a plan.
#[derive(Debug, Clone)]
pub struct PlanStep {
    /// Name of the schema. Several schemas may have this name.
    pub action: Name,
    /// Objects for the parameters.
    pub arguments: Vec<Name>,
    /// Start time, in the domain's time unit, if stated.
    pub start: Option<BigRational>,
    /// Duration, in the domain's time unit, if stated.
    pub duration: Option<BigRational>,
    /// Line of the text, from 1; 0 if the step was not read from a text.
    pub line: usize,
}

impl PlanText {
    /// Text before the last plan in the output of an anytime planner.
    pub const ANNOUNCEMENT: &str = "Solution Found";

    /// Reads one step per line: `(move a b)` or `0.000: (move a b) [5.000]`. Comments begin with
    /// `;`. If the text contains `Solution Found`, only the lines after its last occurrence are
    /// read, and lines that begin with neither an opening parenthesis nor a digit are ignored.
    ///
    /// # Errors
    ///
    /// Returns an error for each remaining line that is neither a step, empty nor a comment, but at
    /// most 201 errors. A text of more than 4 GB gives a single error.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions in a text in memory, which are at most its length"
    )]
    pub fn parse(source: &Source) -> Result<Self, Errors> {
        let text = source.text();
        // Anytime planners print improving plans; the last one is the best.
        let announced = text.rfind(Self::ANNOUNCEMENT);
        let begin = announced.map_or(0, |at| text[at..].find('\n').map_or(text.len(), |end| at + end + 1));
        let mut sink = Sink::new(source);
        if u32::try_from(text.len()).is_err() {
            sink.error("P100", Span::default(), "the file is larger than 4 GB");
            return Err(sink.finish().into());
        }
        let mut steps = Vec::new();
        let mut at = begin;
        for line in text[begin..].split_inclusive('\n') {
            let content = without_comment(line);
            let trimmed = content.trim();
            let start = place(at + content.len() - content.trim_start().len());
            at += line.len();
            if trimmed.is_empty() || (announced.is_some() && !looks_like_step(trimmed)) {
                continue;
            }
            match step(trimmed) {
                Ok(step) => steps.push(PlanStep { line: source.position(start).line, ..step }),
                Err(message) => {
                    let span = Span { start, end: start.saturating_add(place(trimmed.len())) };
                    sink.error("P150", span, message)
                        .help("a step is `(action object …)` or `0.000: (action object …) [duration]`");
                }
            }
        }
        if sink.has_errors() { Err(sink.finish().into()) } else { Ok(Self { steps }) }
    }
}

/// Removes the comment from a line. A semicolon inside brackets does not begin a comment: LPG writes
/// `[D:5.00; C:0.10]`.
fn without_comment(line: &str) -> &str {
    let mut in_brackets = false;
    let end = line.find(|character| {
        in_brackets = (in_brackets || character == '[') && character != ']';
        character == ';' && !in_brackets
    });
    &line[..end.unwrap_or(line.len())]
}

fn looks_like_step(line: &str) -> bool {
    line.starts_with(|first: char| first == '(' || first.is_ascii_digit())
}

fn step(line: &str) -> Result<PlanStep, String> {
    let (before, remainder) = line.split_once('(').ok_or("this is not a step of a plan")?;
    let (inside, after) = remainder.split_once(')').ok_or("the `)` of this step is missing")?;
    let start = match before.trim() {
        "" => None,
        time => Some(number(time.strip_suffix(':').ok_or("expected `:` after the time")?.trim())?),
    };
    let duration = match after.trim() {
        "" => None,
        bracket => {
            // LPG prints an unbalanced parenthesis: `[5.0000])`.
            let inner = bracket
                .trim_end_matches([')', ' '])
                .strip_prefix('[')
                .and_then(|remainder| remainder.strip_suffix(']'));
            let inner = inner.ok_or("expected a duration such as `[5.000]` after the action")?;
            Some(number(inner.trim().trim_start_matches("D:").split(';').next().unwrap_or_default().trim())?)
        }
    };
    let mut words = inside.split_whitespace().map(Name::new);
    let action = words.next().ok_or("the name of the action is missing")?;
    Ok(PlanStep { action, arguments: words.collect(), start, duration, line: 0 })
}

fn number(text: &str) -> Result<BigRational, String> {
    match literal(text) {
        Literal::Number(value) => Ok(value),
        _ => Err(format!("`{text}` is not a number")),
    }
}
