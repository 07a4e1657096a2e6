//! The picture of the current plan, drawn when it is first requested.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::mapek::Outlook;
use crate::report::Painter;
use crate::visible::visible;

#[derive(Debug, Default)]
pub(super) struct Canvas {
    painter: Option<Painter>,
    shown: Mutex<Shown>,
}

#[derive(Debug, Default)]
struct Shown {
    outlook: Option<Arc<Outlook>>,
    drawn: Option<Arc<str>>,
}

impl Canvas {
    pub(super) fn new(painter: Option<Painter>) -> Self {
        Self { painter, shown: Mutex::default() }
    }

    /// Replaces the current plan. Does not wait for a drawing in progress.
    pub(super) fn take(&self, outlook: Option<Outlook>) {
        *self.lock() = Shown { outlook: outlook.map(Arc::new), drawn: None };
    }

    /// Returns the picture of the current plan as HTML; its attribute `data-first` is the action number of the plan's
    /// first step. Empty without a plan, or without a painter.
    pub(super) fn picture(&self) -> Arc<str> {
        let (outlook, drawn) = {
            let state = self.lock();
            (state.outlook.clone(), state.drawn.clone())
        };
        if let Some(drawn) = drawn {
            return drawn;
        }
        let (Some(outlook), Some(painter)) = (outlook, &self.painter) else { return Arc::from("") };
        let part = painter.part(&outlook);
        let drawn: Arc<str> =
            format!("<div id=\"drawn\" data-first=\"{}\">{}</div>", outlook.first, visible(&part)).into();
        let mut state = self.lock();
        if state.outlook.as_ref().is_some_and(|current| Arc::ptr_eq(current, &outlook)) {
            state.drawn = Some(Arc::clone(&drawn));
        }
        drawn
    }

    fn lock(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
