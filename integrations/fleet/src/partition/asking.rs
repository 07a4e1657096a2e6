//! Operations on a log that are retried until they succeed or fail definitely.

use std::future::Future;
use std::time::Duration;

use crate::store::{Bucket, Fault, Store};

/// Writes a value if the current revision of the key is `after`. Retries until the value is stored,
/// and returns its revision. Returns [`Fault::Conflict`] if another value with a newer revision is
/// found.
pub(super) async fn write<S: Store>(
    store: &S,
    bucket: Bucket,
    key: &str,
    value: &[u8],
    after: u64,
) -> Result<u64, Fault> {
    for attempt in 1.. {
        match store.put(bucket, key, value, after).await {
            Ok(revision) => return Ok(revision),
            Err(Fault::Unreachable(_)) => {}
            Err(fault) => match store.get(bucket, key).await {
                Ok(Some(entry)) if entry.value == value => return Ok(entry.revision),
                Ok(entry) if entry.as_ref().map_or(0, |entry| entry.revision) > after => return Err(fault),
                _ => {}
            },
        }
        pause(attempt).await;
    }
    Err(Fault::Conflict)
}

/// Repeats an operation with pauses until its result is known, i.e. not [`Fault::Unreachable`].
pub(super) async fn persist<T, F: Future<Output = Result<T, Fault>>>(
    ask: impl Fn() -> F,
) -> Result<T, Fault> {
    for attempt in 1.. {
        match ask().await {
            Err(Fault::Unreachable(_)) => pause(attempt).await,
            other => return other,
        }
    }
    Err(Fault::Conflict)
}

/// Waits for a random time before another attempt. The upper limit is 10 ms · 2^attempt, and at most 5 s.
/// Random pauses prevent synchronised retries.
pub(crate) async fn pause(attempt: u32) {
    let limit = 5_000.min(10_u64 << attempt.min(10));
    tokio::time::sleep(Duration::from_millis(fastrand::u64(1..=limit))).await;
}

pub(super) fn bytes(value: &impl serde::Serialize) -> Vec<u8> {
    serde_json::to_vec(value).unwrap_or_default()
}
