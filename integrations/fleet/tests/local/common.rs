//! Helpers of the tests with and without servers: messages of a partition, free ports, and a client of HTTP endpoints.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use futures::StreamExt as _;
use metaplan_fleet::store::{Fault, Store, Stored, Stream};

pub(super) async fn read<S: Store>(store: &S, stream: Stream, partition: u32) -> Result<Vec<Stored>, Fault> {
    let end = store.end(stream, partition).await?;
    let mut messages: Vec<Stored> = Vec::new();
    let mut reader = store.follow(stream, partition, 0).await?;
    while messages.last().map_or(0, |last| last.sequence) < end {
        let next = tokio::time::timeout(Duration::from_secs(10), reader.next()).await;
        let silent = Err(Fault::Unreachable("there are no further messages".to_owned()));
        messages.push(next.ok().flatten().unwrap_or(silent)?);
    }
    Ok(messages)
}

/// Returns `true` if all events are discarded.
pub(super) async fn has_no_events<S: Store>(store: &S) -> Result<bool, Fault> {
    for partition in 0..store.partitions() {
        if store.end(Stream::Events, partition).await? > 0 {
            return Ok(false);
        }
    }
    Ok(true)
}

pub(super) fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    listener.local_addr().expect("it has an address").port()
}

/// Returns the status and the body of a page of this machine. `None` if the server does not reply in time.
pub(super) fn get(port: u16, path: &str) -> Option<(u16, String)> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(5))).ok()?;
    write!(stream, "GET {path} HTTP/1.0\r\n\r\n").ok()?;
    let mut text = String::new();
    stream.read_to_string(&mut text).ok()?;
    let (head, body) = text.split_once("\r\n\r\n")?;
    Some((head.split(' ').nth(1)?.parse().ok()?, body.to_owned()))
}
