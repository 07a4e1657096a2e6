//! When evaluation stops before its end: a budget of steps, and a question that its caller answers.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::sync::Arc;

use crate::error::Error;
use crate::literal::Literal;
use crate::rule::RuleIdentity;

/// How many steps one update may take, unless the caller says otherwise.
pub const DEFAULT_STEP_BUDGET: u64 = 10_000_000_000;

/// The steps that a value costs which a recursive rule computes and nothing has named before: nothing but the budget ends
/// a rule that counts, and its rounds are dear.
const VALUE_STEPS: u64 = 25_000;

/// A value costs [`VALUE_STEPS`] again for each so many bytes: a rule that doubles a number makes longer and longer ones.
const BYTES_PER_VALUE: u64 = 8;

/// A message shows at most so many characters of a value.
const SHOWN_CHARACTERS: usize = 40;

/// The caller is asked after so many rows at most.
const ROWS_BETWEEN_QUESTIONS: u64 = 1 << 14;

/// How far evaluation goes.
#[derive(Clone, Debug)]
pub struct Limits {
    /// How many steps one update may take. A step extends one partial match of a rule's body; a value that a recursive rule
    /// computes for the first time costs 25,000, and as many for every 8 bytes of its digits or text.
    pub steps: u64,
    /// Asked every few thousand rows, which is some microseconds to a millisecond apart.
    pub interrupt: Option<Interrupt>,
}

impl Default for Limits {
    fn default() -> Self {
        Self { steps: DEFAULT_STEP_BUDGET, interrupt: None }
    }
}

/// Whether evaluation is to stop at once: a deadline that has passed, a key that was pressed.
#[derive(Clone)]
pub struct Interrupt(Arc<dyn Fn() -> bool + Send + Sync>);

impl Interrupt {
    /// Stops evaluation when the function says `true`. It is called often, so it has to be cheap.
    pub fn new(is_over: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Arc::new(is_over))
    }
}

impl fmt::Debug for Interrupt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Interrupt")
    }
}

/// Why an update stopped.
#[derive(Clone, Copy, Debug)]
enum Stop {
    Exhausted,
    Interrupted,
}

/// What an update has left, and the compiled rule at which it stopped.
#[derive(Debug)]
pub(crate) struct Budget {
    limits: Limits,
    left: Cell<u64>,
    rows: Cell<u64>,
    /// Whether the rules that are evaluated feed on their own conclusions.
    pub recursive: Cell<bool>,
    stopped: Cell<Option<(Stop, u32)>>,
    /// The last value that a recursive rule computed, once the budget is used up by values.
    value: RefCell<Option<Box<str>>>,
}

impl Budget {
    pub fn new(limits: &Limits) -> Self {
        Self {
            limits: limits.clone(),
            left: Cell::new(limits.steps),
            rows: Cell::new(ROWS_BETWEEN_QUESTIONS),
            recursive: Cell::new(false),
            stopped: Cell::new(None),
            value: RefCell::new(None),
        }
    }

    /// Takes steps of a rule; `false` once evaluation has to stop.
    pub fn spend(&self, steps: u64, rule: u32) -> bool {
        let left = self.left.get();
        if left < steps {
            self.stop(Stop::Exhausted, rule);
        }
        self.left.set(left.saturating_sub(steps));
        self.visit(steps, rule)
    }

    /// Notes a value that a rule has computed for the first time; `false` once evaluation has to stop.
    pub fn spend_on_value(&self, value: Option<&Literal>, rule: u32) -> bool {
        if !self.recursive.get() {
            return true;
        }
        let size = value.map_or(0, Literal::size);
        let goes_on = self.spend(VALUE_STEPS.saturating_mul(1 + size / BYTES_PER_VALUE), rule);
        if !goes_on && self.value.borrow().is_none() {
            self.value.replace(value.map(shown));
        }
        goes_on
    }

    /// Notes rows that a rule looked at; `false` once evaluation has to stop.
    pub fn visit(&self, rows: u64, rule: u32) -> bool {
        let left = self.rows.get().saturating_sub(rows);
        if left > 0 {
            self.rows.set(left);
            return self.stopped.get().is_none();
        }
        self.rows.set(ROWS_BETWEEN_QUESTIONS);
        if self.limits.interrupt.as_ref().is_some_and(|interrupt| (interrupt.0)()) {
            self.stop(Stop::Interrupted, rule);
        }
        self.stopped.get().is_none()
    }

    fn stop(&self, stop: Stop, rule: u32) {
        if self.stopped.get().is_none() {
            self.stopped.set(Some((stop, rule)));
        }
    }

    /// The error, once evaluation has stopped; `identity` names compiled rules.
    pub fn error(&self, identity: impl Fn(u32) -> RuleIdentity) -> Option<Error> {
        self.stopped.get().map(|(stop, rule)| match stop {
            Stop::Exhausted => Error::BudgetExhausted {
                rule: identity(rule),
                budget: self.limits.steps,
                value: self.value.borrow().clone(),
            },
            Stop::Interrupted => Error::Interrupted { rule: identity(rule) },
        })
    }
}

/// A value as a message shows it: a long one by its beginning and its length.
fn shown(value: &Literal) -> Box<str> {
    let text = value.lexical();
    let length = text.chars().count();
    if length <= SHOWN_CHARACTERS {
        return text.into();
    }
    let start: String = text.chars().take(SHOWN_CHARACTERS).collect();
    format!("{start}… ({length} characters)").into()
}
