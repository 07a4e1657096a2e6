//! `--concurrent` of `plan` and `report`: plans whose actions overlap.

use clap::Args;
use num_rational::BigRational;

use crate::cli::values::time;

/// Options for actions that overlap.
#[derive(Debug, Args)]
pub(super) struct Overlap {
    /// Allow actions to overlap as in PDDL 2.1. `total-time` is the makespan, which is minimised if the
    /// problem has no metric.
    #[arg(long)]
    concurrent: bool,
    /// With `--concurrent`: minimum time between interfering starts and ends of actions, in the domain's time unit.
    #[arg(long, value_name = "TIME", default_value = "0.001", value_parser = positive, requires = "concurrent")]
    epsilon: BigRational,
}

fn positive(text: &str) -> Result<BigRational, String> {
    time(text)
        .ok()
        .filter(|value| *value > BigRational::default())
        .ok_or_else(|| format!("`{text}` is not a time above 0 such as 0.001"))
}

impl Overlap {
    /// Returns the minimum time between interfering starts and ends of actions, or `None` for
    /// sequential plans.
    pub(super) fn separation(&self) -> Option<&BigRational> {
        self.concurrent.then_some(&self.epsilon)
    }
}
