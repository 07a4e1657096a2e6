//! Limits of evaluation: a budget of steps, and an interrupt function of the caller.

use std::cell::{Cell, RefCell};
use std::fmt;
use std::sync::Arc;

use crate::error::Error;
use crate::literal::Literal;
use crate::rule::RuleIdentity;

/// Default of [`Limits::steps`].
pub const DEFAULT_STEP_BUDGET: u64 = 10_000_000_000;

/// Steps charged for a value that a recursive rule computes for the first time. Only the budget stops a
/// rule that counts upwards, and each of its rounds is expensive.
const STEPS_PER_NEW_VALUE: u64 = 25_000;

/// Number of bytes of a value for which [`STEPS_PER_NEW_VALUE`] is charged once more, because a rule
/// that doubles a number creates longer and longer values.
const BYTES_PER_CHARGE: u64 = 8;

/// Maximum size of a computed value. A chain of rules that concatenate long texts would exceed the memory before the
/// budget ends it.
pub(crate) const MAX_VALUE_BYTES: u64 = 1 << 24;

const MAX_SHOWN_CHARACTERS: usize = 40;

/// Number of visited rows and charged steps between two calls of the interrupt function.
const ROWS_PER_INTERRUPT_CHECK: u64 = 1 << 14;

/// Limits of derivations and updates.
#[derive(Clone, Debug)]
pub struct Limits {
    /// Maximum number of steps of one evaluation of the rules. An update can consist of several evaluations, for
    /// example if rules derive equalities. Roughly, a step extends one partial match of a rule's body. A value that a
    /// recursive rule computes for the first time costs 25,000 steps, and 25,000 more for every 8 bytes of its digits
    /// or text. Other new values cost a step for every 8 bytes. A new value of more than 16 MiB exhausts the budget.
    pub steps: u64,
    /// Function that can stop a derivation or an update. It is called after about every 16,000 visited rows and
    /// charged steps.
    pub interrupt: Option<Interrupt>,
}

impl Default for Limits {
    fn default() -> Self {
        Self { steps: DEFAULT_STEP_BUDGET, interrupt: None }
    }
}

/// Stop condition of the caller: an expired deadline or a pressed key, for example.
#[derive(Clone)]
pub struct Interrupt(Arc<dyn Fn() -> bool + Send + Sync>);

impl Interrupt {
    /// Creates an interrupt that stops evaluation at the next call for which the function returns `true`. The
    /// function is called often, so it has to be fast.
    pub fn new(is_over: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self(Arc::new(is_over))
    }

    /// Calls the function. Returns `true` if evaluation has to stop.
    pub fn is_over(&self) -> bool {
        (self.0)()
    }
}

impl fmt::Debug for Interrupt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Interrupt")
    }
}

#[derive(Clone, Copy, Debug)]
enum Stop {
    Exhausted,
    Interrupted,
}

#[derive(Debug)]
pub(crate) struct Budget {
    limits: Limits,
    remaining_steps: Cell<u64>,
    rows_until_check: Cell<u64>,
    /// `true` in semi-naive rounds, in which rules may use their own conclusions.
    pub recursive: Cell<bool>,
    stopped: Cell<Option<(Stop, u32)>>,
    value: RefCell<Option<Box<str>>>,
}

impl Budget {
    pub fn new(limits: &Limits) -> Self {
        Self {
            limits: limits.clone(),
            remaining_steps: Cell::new(limits.steps),
            rows_until_check: Cell::new(ROWS_PER_INTERRUPT_CHECK),
            recursive: Cell::new(false),
            stopped: Cell::new(None),
            value: RefCell::new(None),
        }
    }

    /// Takes steps from the budget, which all rules share. Returns `false` if evaluation has to stop. If the
    /// budget is exhausted, the error names `rule`.
    pub fn spend(&self, steps: u64, rule: u32) -> bool {
        let remaining = self.remaining_steps.get();
        if remaining < steps {
            self.stop(Stop::Exhausted, rule);
        }
        self.remaining_steps.set(remaining.saturating_sub(steps));
        self.visit(steps, rule)
    }

    /// Charges a value that a rule has computed for the first time. Returns `false` if evaluation has to stop, which is
    /// also the case if the value is longer than [`MAX_VALUE_BYTES`].
    pub fn spend_on_value(&self, value: Option<&Literal>, rule: u32) -> bool {
        let size = value.map_or(0, Literal::size);
        // Without recursion, a rule computes a bounded number of values, but they can be long.
        let steps = if self.recursive.get() {
            STEPS_PER_NEW_VALUE.saturating_mul(1 + size / BYTES_PER_CHARGE)
        } else {
            size / BYTES_PER_CHARGE
        };
        if size > MAX_VALUE_BYTES {
            self.stop(Stop::Exhausted, rule);
        }
        let may_continue = self.spend(steps, rule);
        if !may_continue && self.value.borrow().is_none() {
            self.value.replace(value.map(abbreviated));
        }
        may_continue
    }

    /// Counts visited rows, and calls the interrupt function when it is due. Returns `false` if evaluation
    /// has to stop. If the function stops it, the error names `rule`.
    pub fn visit(&self, rows: u64, rule: u32) -> bool {
        let remaining = self.rows_until_check.get().saturating_sub(rows);
        if remaining > 0 {
            self.rows_until_check.set(remaining);
            return self.stopped.get().is_none();
        }
        self.rows_until_check.set(ROWS_PER_INTERRUPT_CHECK);
        if self.limits.interrupt.as_ref().is_some_and(Interrupt::is_over) {
            self.stop(Stop::Interrupted, rule);
        }
        self.stopped.get().is_none()
    }

    fn stop(&self, stop: Stop, rule: u32) {
        if self.stopped.get().is_none() {
            self.stopped.set(Some((stop, rule)));
        }
    }

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

fn abbreviated(value: &Literal) -> Box<str> {
    let text = value.lexical();
    let length = text.chars().count();
    if length <= MAX_SHOWN_CHARACTERS {
        return text.into();
    }
    let start: String = text.chars().take(MAX_SHOWN_CHARACTERS).collect();
    format!("{start}… ({length} characters)").into()
}
