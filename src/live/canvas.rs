//! The plan of a run as it is seen: drawn when somebody looks, and not when it is made.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::mapek::Outlook;
use crate::report::Painter;
use crate::visible::visible;

/// The last plan, and its picture once somebody has asked for it.
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

    /// Takes another plan, or that there is none. Whoever draws holds nobody up meanwhile.
    pub(super) fn take(&self, outlook: Option<Outlook>) {
        *self.lock() = Shown { outlook: outlook.map(Arc::new), drawn: None };
    }

    /// The picture of the last plan, with the number that the request of its first step has; nothing where there is no plan.
    pub(super) fn picture(&self) -> Arc<str> {
        let (outlook, drawn) = {
            let shown = self.lock();
            (shown.outlook.clone(), shown.drawn.clone())
        };
        if let Some(drawn) = drawn {
            return drawn;
        }
        let (Some(outlook), Some(painter)) = (outlook, &self.painter) else { return Arc::from("") };
        let part = painter.part(&outlook);
        let drawn: Arc<str> =
            format!("<div id=\"drawn\" data-first=\"{}\">{}</div>", outlook.first, visible(&part)).into();
        let mut shown = self.lock();
        if shown.outlook.as_ref().is_some_and(|own| Arc::ptr_eq(own, &outlook)) {
            shown.drawn = Some(Arc::clone(&drawn));
        }
        drawn
    }

    fn lock(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
