//! The context for evaluating a property: the explored model, the options and the work budget.

use std::cell::RefCell;

use fixedbitset::FixedBitSet;

use crate::check::answer::Precision;
use crate::check::ask::{Checked, property_error};
use crate::check::options::Options;
use crate::error::{Error, Place};
use crate::explore::Explored;
use crate::mdp::Mdp;
use crate::number::Number;
use crate::policy::choices_of;
use crate::prism::{Packed, Program};
use crate::solve::Work;

pub struct Query<'a, N> {
    pub program: &'a Program<N>,
    pub explored: &'a Explored<Packed, N>,
    pub options: &'a Options<'a>,
    /// The indices of the reward structures for which rewards were computed during exploration.
    pub computed_rewards: &'a [usize],
    /// The process in doubles, from which an initial policy for exact policy iteration is computed. `None` if
    /// the arithmetic is not exact.
    pub doubles: Option<Mdp<f64>>,
    pub work: RefCell<Work<'a>>,
    /// The choices of the given policy; `None` if no policy is given.
    pub evaluated: Option<FixedBitSet>,
}

/// Returns the index of the reward structure `name`, or of the first structure if `name` is `None`.
pub fn structure(names: &[String], name: Option<&str>) -> Result<usize, Error> {
    let number = match name {
        None => (!names.is_empty()).then_some(0),
        Some(name) => names.iter().position(|candidate| candidate == name),
    };
    number.ok_or_else(|| {
        let text = match name {
            Some(name) => format!("there are no rewards `\"{name}\"`; there are: {}", names.join(", ")),
            None => "the model has no rewards".to_owned(),
        };
        property_error("Q202", Place { line: 1, column: 1 }, &text)
    })
}

impl<'a, N: Number> Query<'a, N> {
    /// Creates a query with a work budget for exact arithmetic.
    ///
    /// # Errors
    /// The given policy in `options` belongs to another model.
    pub fn new(
        program: &'a Program<N>,
        explored: &'a Explored<Packed, N>,
        options: &'a Options<'a>,
        computed_rewards: &'a [usize],
        work: u64,
    ) -> Result<Self, Error> {
        let evaluated =
            options.evaluate.as_ref().map(|table| table.choices(program, explored)).transpose()?;
        let evaluated = evaluated.map(|policy| choices_of(&explored.mdp, &policy));
        let mut work = Work::new(work).with_progress(options.bounds.progress, explored.mdp.states());
        if let Some(Precision::Relative(width)) = options.precision {
            work.tight = width.clamp(1e-14, work.tight);
        } else if options.precision.is_some() {
            work.tight = 1e-12;
        }
        Ok(Self { program, explored, options, computed_rewards, doubles: None, work: work.into(), evaluated })
    }

    pub fn mdp(&self) -> &Mdp<N> {
        &self.explored.mdp
    }

    /// Returns the rewards of a structure by choice: state reward plus transition reward.
    pub fn rewards(&self, name: Option<&str>) -> Result<&[N], Error> {
        let number = structure(&self.program.reward_names, name)?;
        let at = self.computed_rewards.iter().position(|computed| *computed == number);
        let at = at.ok_or_else(|| Error::Policy("these rewards were not computed".to_owned()))?;
        Ok(&self.explored.rewards[at])
    }

    /// Returns the number of items of a structure that define state rewards.
    pub fn state_reward_count(&self, name: Option<&str>) -> Result<usize, Error> {
        let number = structure(&self.program.reward_names, name)?;
        Ok(self.program.state_reward_count(number))
    }

    /// Returns the state rewards of a structure by state, without the transition rewards.
    pub fn state_rewards(&self, name: Option<&str>) -> Checked<Vec<N>> {
        let number = structure(&self.program.reward_names, name)?;
        let mut values = Vec::new();
        let mut rewards = Vec::with_capacity(self.mdp().states());
        for state in &self.explored.states {
            self.program.unpack(state, &mut values);
            rewards.push(self.program.state_reward(number, &values)?);
        }
        Ok(rewards)
    }
}
